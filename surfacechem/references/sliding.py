"""Sliding and its heat: at constant dissipation, by dry friction, by rate-and-state friction, and by viscous films."""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import ClassVar

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.references.base import (
    Array,
    ConstantCapacity,
    FrictionallyHeated,
    PerfectContact,
    QuadraticEnergy,
    Quantities,
    Reference,
    UniformBody,
    read,
)
from surfacechem.references.numerics import first_difference, increasing_root, second_difference, short_integral


class Sliding(PerfectContact):
    r"""Steady sliding at constant dissipation, perfect thermal contact, quadratic energies.

    .. math:: T=\sqrt{T_i^2+2T_0Dt/C},\quad q_k=\frac{C_k}{C}D,\quad S=C\,(T/T_0-1),\quad C=C_1+C_2+C_c

    With :math:`T_i=T_0` this is :math:`T_0\sqrt{1+2t/\tau_s}`, :math:`\tau_s=CT_0/D`. Any t >= 0; D = mu p v (dry) or
    eta v^2/g_n (viscous) as long as it is constant.

    Source: Sauer, Duong & Mandadapu (2021), section 6.1.

    >>> bodies = Sliding(C_1=2000.0, C_2=2000.0, C_c=50.0, T_0=300.0, T_i=300.0, D=1000.0)
    >>> f"{bodies.solution(1215.0)['T']:.10f}"
    '519.6152422707'
    """

    model: ClassVar[QuadraticEnergy | ConstantCapacity] = QuadraticEnergy()

    T_i: float = parameter("K", "initial temperature", above=0)
    D: float = parameter("W/m^2", "friction power, traction times sliding velocity", at_least=0)

    readings = read(temperature="T_i", friction_power="D")

    def quantities(self, t: Array) -> Quantities:
        rise = self.model.rise(self.D * t, self.C, self.T_0, self.T_i)
        return {
            "T": self.T_i + rise,
            "q_1": self.C_1 / self.C * self.D,
            "q_2": self.C_2 / self.C * self.D,
            "S_total": self.model.entropy(self.T_i - self.T_0 + rise, self.C, self.T_0),
        }


class SlidingConstantCapacity(Sliding):
    r"""Steady sliding at constant dissipation, perfect thermal contact, constant capacities.

    .. math:: T=T_i+Dt/C,\quad q_k=\frac{C_k}{C}D,\quad S=C\ln(T/T_0),\quad C=C_1+C_2+C_c

    Any t >= 0. Source: Sauer, Duong & Mandadapu (2021), section 6.1, with temperature-independent capacities.

    >>> bodies = SlidingConstantCapacity(C_1=2000.0, C_2=2000.0, C_c=50.0, T_0=300.0, T_i=300.0, D=1000.0)
    >>> f"{bodies.solution(1215.0)['T']:.10f}"
    '600.0000000000'
    """

    model: ClassVar[QuadraticEnergy | ConstantCapacity] = ConstantCapacity()


class CoulombStop(UniformBody):
    r"""A free mass slides against constant dry friction until it rests; all kinetic energy becomes heat.

    .. math:: v=v_i-\mu p\,t/m\ge0,\quad t_{stop}=\frac{mv_i}{\mu p},\quad s_{stop}=\frac{mv_i^2}{2\mu p},\quad
        T^2=T_i^2+\frac{T_0}Cm(v_i^2-v^2)

    Quadratic energies, perfect thermal contact. Any t >= 0: the velocity is exactly zero from `stop_time` on.

    Source: Sauer, Duong & Mandadapu (2021), eq. e:dry_fric, with Newton's law, integrated.

    >>> slider = CoulombStop(m=5.0, mu=0.25, p=3e4, v_i=2.0, C=100.0, T_0=300.0, T_i=300.0)
    >>> slider.stop_time, float(slider.solution(0.01)["u_t"]), float(slider.solution(0.01)["v"])
    (0.0013333333333333333, 0.0013333333333333333, 0.0)
    """

    m: float = parameter("kg/m^2", "mass", above=0)
    mu: float = parameter("1", "sliding friction coefficient", above=0)
    p: float = parameter("Pa", "contact pressure", above=0)
    v_i: float = parameter("m/s", "initial velocity", at_least=0)

    readings = read(tangential="m", friction="mu", initial="p v_i=v")

    @property
    def stop_time(self) -> float:
        """Time [s] at which the mass comes to rest."""
        return self.m * self.v_i / (self.mu * self.p)

    def quantities(self, t: Array) -> Quantities:
        sliding = np.minimum(t, self.stop_time)
        v = np.where(t < self.stop_time, self.v_i - self.mu * self.p / self.m * sliding, 0.0)
        slip = sliding * 0.5 * (self.v_i + v)
        heat = self.mu * self.p * slip
        return {"v": v, "u_t": slip, "heat": heat, "T": self.heated(heat)}


class WeakeningFriction(FrictionallyHeated):
    r"""Heating by friction with :math:`\mu=\mu_0T_0/T`, quadratic energies, no loss.

    .. math:: \frac C{T_0}T\dot T=D_0\frac{T_0}T,\qquad T^3=T_i^3+3T_0^2D_0t/C

    With :math:`D_0=\mu_0pv`; from :math:`T_i=T_0` this is :math:`T_0(1+3t/\tau)^{1/3}`, :math:`\tau=CT_0/D_0`.
    Any t >= 0.

    Source: Sauer, Duong & Mandadapu (2021), section 6.1, with the temperature dependence of their friction coefficient,
    integrated.

    >>> f"{WeakeningFriction(C=4000.0, T_0=300.0, T_i=300.0, D_0=3000.0).solution(4e4)['T']:.10f}"
    '2010.5278186134'
    """

    def quantities(self, t: Array) -> Quantities:
        T = np.cbrt(self.T_i**3 + 3.0 * self.T_0**2 * self.D_0 * t / self.C)
        return {"T": T, "D": self.D_0 * self.T_0 / T}


class WeakeningFrictionWithLoss(FrictionallyHeated):
    r"""Heating by friction with :math:`\mu=\mu_0T_0/T` and a linear heat loss, quadratic energies.

    .. math:: \frac C{T_0}T\dot T=D_0\frac{T_0}T-H(T-T_a)=-\frac HT(T-T_+)(T-T_-),\qquad
        T_\pm=\tfrac12\Big(T_a\pm\sqrt{T_a^2+4D_0T_0/H}\Big)

    The stable steady state is :math:`T_+`. With :math:`s=\ln\frac{T_+-T_i}{T_+-T}`, which runs from zero to infinity,

    .. math:: \frac{HT_0}Ct=\frac{T_+^2s+T_-^2\ln\frac{T-T_-}{T_i-T_-}}{T_+-T_-}-(T-T_i)

    is inverted for s to rounding. Any t >= 0, heating or cooling.

    Source: Sauer, Duong & Mandadapu (2021), section 6.1, with the temperature dependence of their friction coefficient
    and a loss, integrated by partial fractions.

    >>> body = WeakeningFrictionWithLoss(C=4000.0, T_0=300.0, T_i=300.0, D_0=3000.0, H=12.0, T_a=300.0)
    >>> f"{body.solution(725.983775452141641)['T']:.10f}"
    '446.0249099279'
    """

    H: float = parameter("W/(m^2 K)", "conductance to the surroundings", above=0)
    T_a: float = parameter("K", "temperature of the surroundings", above=0)

    readings = read(total_conductance="H", surroundings_temperature="T_a")

    @property
    def steady_temperature(self) -> float:
        """Temperature [K] at which friction and loss balance."""
        return 0.5 * (self.T_a + math.hypot(self.T_a, 2.0 * math.sqrt(self.D_0 * self.T_0 / self.H)))

    def quantities(self, t: Array) -> Quantities:
        scaled = t * self.H * self.T_0 / self.C
        # The slope of the scaled time lies between its values at both ends, and so does s.
        ends = [T**2 / (T - self._other_root) for T in (self.T_i, self.steady_temperature)]
        s = increasing_root(self._scaled_time, scaled, scaled / max(ends), scaled / min(ends))
        T = self.T_i + (self.T_i - self.steady_temperature) * np.expm1(-s)
        return {"T": T, "D": self.D_0 * self.T_0 / T}

    def time(self, T: Array) -> Array:
        """Return the time [s] at which the temperature is T, between T_i and the steady state."""
        approach = -np.log1p((T - self.T_i) / (self.T_i - self.steady_temperature))
        return self._scaled_time(approach)[0] * self.C / (self.H * self.T_0)

    @property
    def _other_root(self) -> float:
        return -self.D_0 * self.T_0 / self.H / self.steady_temperature

    def _scaled_time(self, s: Array) -> tuple[Array, Array]:
        """Return the right-hand side of the implicit solution and its slope."""
        steady, other = self.steady_temperature, self._other_root

        def slope(s: Array) -> Array:
            T = self.T_i + (self.T_i - steady) * np.expm1(-s)
            return np.asarray(T**2 / (T - other))

        rise = (self.T_i - steady) * np.expm1(-s)
        logarithms = steady**2 * s + other**2 * np.log1p(rise / (self.T_i - other))
        weak_loss = 4.0 * (self.T_i + rise) < -other  # far from both roots the logarithms would cancel
        return np.where(weak_loss, short_integral(slope, s), logarithms / (steady - other) - rise), slope(s)


class AnisotropicSlide(UniformBody):
    r"""A free mass slides on dry friction with a coefficient for each axis, and turns towards the smoother one.

    .. math:: \frac{v_2}{v_{2i}} = \Big(\frac v{v_i}\Big)^r, \quad r = \frac{\mu_2}{\mu_1} \ge 1, \quad
        t_{stop} - t = \frac m{\mu_1 p} I_1(v), \quad u_{stop} - u = \frac m{\mu_1 p} I_2(v)

    .. math:: I_k(v) = \int_0^v x^{k-1} \sqrt{1 + c^2 x^{2 (r - 1)}}\,dx, \quad c = v_{2i} / v_i^r,

    which is a hypergeometric function; for the other axis :math:`c\,I_{1+r}` replaces :math:`I_2`. All kinetic energy
    becomes heat. Quadratic energies, perfect thermal contact. Any t >= 0: from `stop_time` on v is exactly zero.

    Source: Sauer, Duong & Mandadapu (2021), eq. e:dry_fric with a tensor of coefficients, with Newton's law: the
    quotient of its components separates.

    >>> slider = AnisotropicSlide(m=5.0, mu_1=0.2, mu_2=0.4, p=3e4, v_i=1.2, v_2_i=1.6, C=100.0, T_0=300.0, T_i=300.0)
    >>> round(slider.stop_time, 15), float(slider.solution(0.01)["v_2"])
    (0.001245312941584, 0.0)
    """

    m: float = parameter("kg/m^2", "mass", above=0)
    mu_1: float = parameter("1", "friction coefficient along v", above=0)
    mu_2: float = parameter("1", "friction coefficient along v_2, at least mu_1", above=0)
    p: float = parameter("Pa", "contact pressure", above=0)
    v_i: float = parameter("m/s", "initial velocity", above=0)
    v_2_i: float = parameter("m/s", "initial velocity across it")

    readings = read(tangential="m", friction="mu_1 mu_2", initial="p v_i=v v_2_i=v_2")

    @property
    def stop_time(self) -> float:
        """Time [s] at which the mass comes to rest."""
        return float(self._integral(1.0, np.array(1.0)) * self.v_i * self.m / (self.mu_1 * self.p))

    def _integral(self, k: float, x: Array) -> Array:
        """Return I_k of the velocity relative to the initial one."""
        from scipy.special import hyp2f1

        z, e = (self.v_2_i / self.v_i) ** 2, 2 * (self.mu_2 / self.mu_1 - 1)
        if e == 0:
            return np.asarray(x**k / k * math.sqrt(1 + z))
        return np.asarray(x**k / k * hyp2f1(-0.5, k / e, 1 + k / e, -z * x**e))

    def quantities(self, t: Array) -> Quantities:
        ratio, slope, deceleration = self.mu_2 / self.mu_1, self.v_2_i / self.v_i, self.mu_1 * self.p / self.m
        left = np.maximum(self.stop_time - t, 0) * deceleration / self.v_i

        def passed(x: Array) -> tuple[Array, Array]:
            return self._integral(1.0, x), np.sqrt(1 + slope**2 * x ** (2 * (ratio - 1)))

        # Velocity along the first axis relative to the initial one, zero from the stop on.
        x = increasing_root(passed, left, np.zeros_like(t), np.ones_like(t), np.sign(left))
        v, v_2 = self.v_i * x, self.v_2_i * x**ratio
        path, across = (self._integral(k, np.array(1.0)) - self._integral(k, x) for k in (2.0, 1.0 + ratio))
        speed = np.hypot(v, v_2)
        heat = 0.5 * self.m * (math.hypot(self.v_i, self.v_2_i) ** 2 - speed**2)
        turn = np.arctan(slope * x ** (ratio - 1)) - math.atan(slope)
        return {
            "v": v,
            "v_2": v_2,
            "speed": speed,
            "turn": np.where(x > 0, turn, 0.0),
            "u_t": path * self.v_i**2 / deceleration,
            "u_t2": across * self.v_i * self.v_2_i / deceleration,
            "heat": heat,
            "T": self.heated(heat),
        }


class VelocitySteps(Reference):
    """A velocity that steps, with friction as a function of velocity and age; subclasses have the law of the age."""

    law: ClassVar[str]

    mu_0: float = parameter("1", "steady friction coefficient at v_0", above=0)
    a: float = parameter("1", "direct effect of velocity", above=0)
    b: float = parameter("1", "effect of the age of the contact", at_least=0)
    L: float = parameter("m", "slip over which the contact forgets", above=0)
    v_0: float = parameter("m/s", "velocity of reference", above=0)
    p: float = parameter("Pa", "contact pressure", at_least=0)
    theta_i: float = parameter("s", "initial age", above=0)
    v_i: float = parameter("m/s", "velocity before and after the steps", above=0)
    v_step: float = parameter("m/s", "velocity between the steps", above=0)
    t_1: float = parameter("s", "time of the first step", at_least=0)
    t_2: float = parameter("s", "time of the second step", at_least=0)

    readings = read(friction="mu_0 a b L v_0", initial="p theta_i=theta v_i=v")

    def flaw(self) -> str:
        return f"t_2 must not be below t_1 = {self.t_1!r} s." if self.t_2 < self.t_1 else ""

    @abstractmethod
    def relaxed(self, ln_age: Array, slip: Array) -> Array:
        r"""Return the logarithm of :math:`v\theta/L` after a slip [in units of L] at a constant velocity."""

    def quantities(self, t: Array) -> Quantities:
        def ln_theta(start: Array, v: Array | float, duration: Array | float) -> Array:
            steady = np.log(self.L / v)
            return np.asarray(steady + self.relaxed(np.asarray(start - steady), np.asarray(v * duration / self.L)))

        after_1, after_2, ln_0 = t > self.t_1, t > self.t_2, np.log(self.theta_i)
        v = np.where(after_1 & ~after_2, self.v_step, self.v_i)
        ln_1 = ln_theta(ln_0, self.v_i, self.t_1)
        ln_2 = ln_theta(ln_1, self.v_step, self.t_2 - self.t_1)
        begun = np.where(after_2, self.t_2, np.where(after_1, self.t_1, 0.0))
        now = ln_theta(np.where(after_2, ln_2, np.where(after_1, ln_1, ln_0)), v, t - begun)
        # Traction from the logarithm of the hyperbolic sine, which may overflow.
        ln_sinh = np.log(v / (2.0 * self.v_0)) + (self.mu_0 + self.b * (np.log(self.v_0 / self.L) + now)) / self.a
        traction = self.a * self.p * (ln_sinh + np.log1p(np.sqrt(1.0 + np.exp(-2.0 * ln_sinh))))
        return {"ln_theta": now, "theta": np.exp(now), "v": v, f"t_{self.law}": traction}


class AgingVelocitySteps(VelocitySteps):
    r"""Rate-and-state friction with the aging law at a velocity that steps from one value to another and back.

    .. math:: \theta=\frac Lv+\Big(\theta_i-\frac Lv\Big)e^{-vt/L},\qquad
        t_t=a\,p\,\operatorname{arsinh}\Big[\frac v{2v_0}\exp\frac{\mu_0+b\ln(v_0\theta/L)}a\Big]

    at each velocity, t counted from its beginning. Any ages and positive velocities.

    Source: Dieterich (1979), doi 10.1029/JB084iB05p02161, and Ruina (1983), doi 10.1029/JB088iB12p10359, integrated.

    >>> rock = {"mu_0": 0.6, "a": 0.01, "b": 0.015, "L": 1e-5, "v_0": 1e-6, "p": 5e6}
    >>> steps = AgingVelocitySteps(**rock, theta_i=10.0, v_i=1e-6, v_step=1e-5, t_1=10.0, t_2=20.0)
    >>> " ".join(f"{t:.3f}" for t in steps.solution([10.0, 11.0, 20.0, 30.0])["t_rate_and_state_aging"])
    '3000000.000 3052021.636 2942466.011 2969843.586'
    """

    law: ClassVar[str] = "rate_and_state_aging"

    def relaxed(self, ln_age: Array, slip: Array) -> Array:
        return np.asarray(np.logaddexp(np.log(-np.expm1(-slip)), ln_age - slip))


class SlipVelocitySteps(VelocitySteps):
    r"""Rate-and-state friction with the slip law at a velocity that steps from one value to another and back.

    .. math:: \ln\frac{v\theta}L=\ln\frac{v\theta_i}L\,e^{-vt/L},\qquad
        t_t=a\,p\,\operatorname{arsinh}\Big[\frac v{2v_0}\exp\frac{\mu_0+b\ln(v_0\theta/L)}a\Big]

    at each velocity, t counted from its beginning. Any ages and positive velocities. Friction approaches its steady
    value exponentially with slip, in the same way after a step up and a step down.

    Source: Ruina (1983), doi 10.1029/JB088iB12p10359, integrated.

    >>> rock = {"mu_0": 0.6, "a": 0.01, "b": 0.015, "L": 1e-5, "v_0": 1e-6, "p": 5e6}
    >>> steps = SlipVelocitySteps(**rock, theta_i=10.0, v_i=1e-6, v_step=1e-5, t_1=10.0, t_2=20.0)
    >>> " ".join(f"{t:.3f}" for t in steps.solution([10.0, 11.0, 20.0, 30.0])["t_rate_and_state_slip"])
    '3000000.000 3005965.901 2942443.213 2936472.355'
    """

    law: ClassVar[str] = "rate_and_state_slip"

    def relaxed(self, ln_age: Array, slip: Array) -> Array:
        return np.asarray(ln_age * np.exp(-slip))


class ThinningFilm(FrictionallyHeated):
    r"""Heating by a film of viscosity :math:`\eta_0e^{-\beta(T-T_0)}`, quadratic energies, no loss.

    .. math:: \frac C{T_0}T\dot T=D_0e^{-\beta(T-T_0)},\qquad
        T=\frac1\beta\Big\{1+W_0\Big[(\beta T_i-1)e^{\beta T_i-1}+\frac{\beta^2D_0T_0t}Ce^{\beta T_0-1}\Big]\Big\}

    The Lambert function loses digits for small :math:`\beta T` and overflows for large. Instead, the same equation is
    solved to rounding for the rise :math:`\theta=T-T_i`,
    :math:`T_i\theta\exp[0,\beta\theta]+\theta^2\exp[0,\beta\theta,\beta\theta]=D_0e^{-\beta(T_i-T_0)}T_0t/C`.
    Any t >= 0, beta >= 0; beta = 0 is steady sliding.

    Source: Sauer, Duong & Mandadapu (2021), section 6.1, viscous law with a temperature-dependent viscosity (Reynolds
    1886), integrated.

    >>> film = ThinningFilm(C=4000.0, T_0=300.0, T_i=300.0, D_0=3000.0, beta=0.04)
    >>> f"{film.solution(4e4)['T']:.10f}"
    '467.5516435377'
    """

    beta: float = parameter("1/K", "decay of the viscosity per kelvin", at_least=0)

    readings = read(friction="beta")

    def quantities(self, t: Array) -> Quantities:
        initial = self.D_0 * np.exp(-self.beta * (self.T_i - self.T_0))
        heat = initial * self.T_0 * t / self.C
        without_thinning = 2.0 * heat / (self.T_i + np.sqrt(self.T_i**2 + 2.0 * heat))
        exponent = np.log1p(self.beta * heat / self.T_i) / (self.beta or 1.0)
        above = np.where(self.beta > 0.0, np.minimum(exponent, without_thinning), without_thinning)
        rise = increasing_root(self._heat, heat, np.zeros_like(heat), above)
        return {"T": self.T_i + rise, "D": initial * np.exp(-self.beta * rise)}

    def _heat(self, rise: Array) -> tuple[Array, Array]:
        """Return the energy, in units of C/T_0, that heats against the thinning, and its slope."""
        exponent = self.beta * rise
        linear = self.T_i * first_difference(np.zeros_like(exponent), exponent)
        quadratic = rise * np.exp(exponent) * second_difference(np.zeros_like(exponent), -exponent)
        return rise * (linear + quadratic), (self.T_i + rise) * np.exp(exponent)


class ClosingFilm(UniformBody):
    r"""Heating by a viscous film whose gap closes linearly: it grows like a logarithm.

    .. math:: g_n=g_i-at,\qquad T^2=T_i^2+\frac{2T_0\eta v^2}{Ca}\ln\frac{g_i}{g_n}

    Quadratic energies, perfect thermal contact. Valid before `end_time` :math:`g_i/a`, at which dissipation and
    temperature are infinite.

    Source: Sauer, Duong & Mandadapu (2021), eq. e:visc_fric and section 6.1, integrated.

    >>> film = ClosingFilm(eta=0.01, v=0.5, g_i=1e-5, a=1e-6, C=800.0, T_0=300.0, T_i=300.0)
    >>> f"{film.solution(9.0)['T']:.10f} {film.end_time:.1f}"
    '307.1112942393 10.0'
    """

    eta: float = parameter("Pa s", "film viscosity", at_least=0)
    v: float = parameter("m/s", "sliding velocity")
    g_i: float = parameter("m", "initial gap", above=0)
    a: float = parameter("m/s", "closing speed", above=0)

    readings = read(friction="eta", initial="v g_i=g_n", ramp="a=-g_n")

    @property
    def end_time(self) -> float:
        """Time [s] at which the gap closes."""
        return self.g_i / self.a

    def quantities(self, t: Array) -> Quantities:
        return self.at_gap(self.g_i * (self.end_time - t) / self.end_time)

    def at_gap(self, g: Array) -> Quantities:
        """Return the state at the gap g; more accurate than by time, which is rounded close to the end."""
        heat = self.eta * self.v**2 / self.a * np.log(self.g_i / g)
        T = np.sqrt(self.T_i**2 + 2.0 * self.T_0 * heat / self.C)  # not by the rise, which is infinite at the end
        return {"g_n": g, "T": T, "D": self.eta * self.v**2 / g, "heat": heat}
