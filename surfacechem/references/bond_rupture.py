"""Rupture of bonds: by Bell's law, in clusters that share a load, and debonding of an interface, sudden or gradual."""

from __future__ import annotations

import math
from functools import cached_property
from typing import NamedTuple

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.errors import InputError
from surfacechem.quantities import BOLTZMANN
from surfacechem.references.base import Array, Parameters, Quantities, Reference, SceneView, UniformBody, read
from surfacechem.references.numerics import AutonomousODE, increasing_root, remainder, scaled_expint, short_integral


class BellBond(Reference):
    """Bonds with a rupture rate exponential in their force, by a rate without force and a transition distance."""

    k_off: float = parameter("1/s", "rupture rate without force", above=0)
    x_off: float = parameter("m", "distance to the transition state", above=0)
    T: float = parameter("K", "temperature", above=0)
    phi_i: float = parameter("1", "initial bonding state", default=1.0, above=0, at_most=1)

    readings = read(reaction="k_off x_off", initial="phi_i=phi", temperature="T")

    @property
    def force_scale(self) -> float:
        """Force [N] that increases the rupture rate by a factor e: k_B T / x_off."""
        return BOLTZMANN * self.T / self.x_off


class BellConstantForce(BellBond):
    r"""Bonds that break under a constant force without forming again.

    .. math:: \phi=\phi_ie^{-kt},\qquad \ln k=\ln k_{off}+\frac{fx_{off}}{k_BT}

    The rate is kept as its logarithm, so that no force overflows; :math:`\ln\phi` is exact even if :math:`\phi`
    underflows to zero.

    Source: Bell (1978), Science 200, 618-627, doi 10.1126/science.347575.

    >>> bond = BellConstantForce(k_off=0.1, x_off=4e-10, T=300.0, f=3e-11)
    >>> f"{bond.solution(1.37945379273430010)['phi']:.12f}, {bond.lifetime:.6f} s"
    '0.082084998624, 0.551782 s'
    """

    f: float = parameter("N", "force per bond")

    readings = read(initial="f")
    statistics = ("lifetime",)

    @property
    def log_rate(self) -> float:
        """Logarithm of the rupture rate in 1/s."""
        return math.log(self.k_off) + self.f / self.force_scale

    @property
    def lifetime(self) -> float:
        """Mean time [s] to rupture, 1/k; zero below 1e-323 s."""
        return math.exp(-max(self.log_rate, -700.0))

    def quantities(self, t: Array) -> Quantities:
        broken = np.exp(np.log(t) + self.log_rate)
        return {"phi": self.phi_i * np.exp(-broken), "ln_phi": math.log(self.phi_i) - broken}


class BellRamp(BellBond):
    r"""Bonds under the force :math:`f=rt` that do not form again, and the statistics of the force at which they break.

    .. math:: \frac\phi{\phi_i}=\exp\{-b\,(e^{f/f_\beta}-1)\},\qquad f_\beta=\frac{k_BT}{x_{off}},\quad
        b=\frac{k_{off}f_\beta}r,\\
        f_{mode}=f_\beta\max\Big(\ln\frac1b,0\Big),\quad f_{mean}=f_\beta e^bE_1(b),\quad
        f_{median}=f_\beta\ln\Big(1+\frac{\ln2}b\Big)

    Any loading rate; :math:`\ln\phi` is exact even if :math:`\phi` underflows to zero.

    Source: Evans & Ritchie (1997), Biophys. J. 72, 1541-1555, doi 10.1016/S0006-3495(97)78802-7; the mean is the
    integral of their distribution, Abramowitz & Stegun (1964), 5.1.1.

    >>> bond = BellRamp(k_off=0.1, x_off=4e-10, T=300.0, rate=1e-10)
    >>> " ".join(f"{1e12 * force:.6f} pN" for force in (bond.mode, bond.mean, bond.median))
    '47.324836 pN 41.886280 pN 43.683190 pN'
    """

    rate: float = parameter("N/s", "loading rate", above=0)

    readings = read(ramp="rate=f")
    statistics = ("mode", "median", "mean")

    @property
    def severity(self) -> float:
        """Rupture rate without force, times the time in which the force grows by the force scale: b."""
        return self.k_off * self.force_scale / self.rate

    @property
    def mode(self) -> float:
        """Most probable force at rupture [N]."""
        return self.force_scale * max(-math.log(self.severity), 0.0)

    @property
    def mean(self) -> float:
        """Mean force at rupture [N]."""
        return self.force_scale * float(scaled_expint(1, np.array(self.severity)))

    @property
    def median(self) -> float:
        """Force [N] at which half of the bonds are broken."""
        return self.force_scale * math.log1p(math.log(2.0) / self.severity)

    def log_density(self, f: Array) -> Array:
        """Return the logarithm of the probability density [1/N] of rupture at the force f."""
        scaled = f / self.force_scale
        return math.log(self.k_off / self.rate) + scaled - self.severity * np.expm1(scaled)

    def quantities(self, t: Array) -> Quantities:
        f = self.rate * t
        broken = self.severity * np.expm1(f / self.force_scale)
        return {"phi": self.phi_i * np.exp(-broken), "ln_phi": math.log(self.phi_i) - broken, "f": f}


FAR = 0.1
"""Excess of F/phi over its critical value above which the two terms of the rate no longer cancel."""


class Cluster(BellBond):
    """Bell bonds whose number per area determines the force on each."""

    n_c: float = parameter("1/m^2", "density of bonding sites", above=0)
    t_n: float = parameter("Pa", "tensile traction", above=0)

    readings = read(constant="n_c=N_c", initial="t_n")

    @property
    def load(self) -> float:
        """Force per site in units of the force scale."""
        return self.t_n / (self.n_c * self.force_scale)


class SharedLoadCluster(Cluster):
    r"""Bonds that share a constant traction and do not form again: the fewer remain, the faster they break.

    .. math:: \dot\phi=-k_{off}\phi e^{F/\phi},\quad F=\frac{t_nx_{off}}{n_ck_BT},\qquad
        E_1\Big(\frac F\phi\Big)=E_1\Big(\frac F{\phi_i}\Big)-k_{off}t

    All bonds are broken, with infinite slope, at :math:`t^*=E_1(F/\phi_i)/k_{off}`; before,
    :math:`\phi\simeq F/W_0\big(1/k_{off}(t^*-t)\big)`. All terms are scaled by :math:`e^{-F/\phi_i}`, so that no load
    overflows. Close to rupture the error of the state is the rounding of t times its slope.

    Source: Erdmann & Schwarz (2004), J. Chem. Phys. 121, 8997, doi 10.1063/1.1805496, deterministic equation without
    rebinding, integrated.

    >>> traction = 0.5 * 1e14 * 1.380649e-23 * 300.0 / 4e-10
    >>> cluster = SharedLoadCluster(k_off=1.0, x_off=4e-10, T=300.0, n_c=1e14, t_n=traction)
    >>> f"{cluster.end_time:.12f} s, {cluster.solution(0.279886797388080406)['phi']:.12f}"
    '0.559773594776 s, 0.582551985238'
    """

    @property
    def end_time(self) -> float:
        """Time [s] at which the last bond breaks; zero below 1e-323 s."""
        start = self.load / self.phi_i
        return float(np.exp(-start) * scaled_expint(1, np.array(start))) / self.k_off

    def quantities(self, t: Array) -> Quantities:
        # The growth w of F/phi from its start x_0 solves e^x_0 [E_1(x_0) - E_1(x_0 + w)] = k_off t e^x_0: directly in
        # the first half of the time, by logarithms of the remaining time in the second.
        x_0 = self.load / self.phi_i
        scaled, whole = np.exp(x_0 + np.log(self.k_off * t)), float(scaled_expint(1, np.array(x_0)))

        def slope(w: Array) -> Array:
            return np.exp(-w) / (x_0 + w)

        def elapsed(w: Array) -> tuple[Array, Array]:
            apart = whole - np.exp(-w) * scaled_expint(1, x_0 + w)
            near = w < 0.25 * min(1.0, x_0)  # the integrals would cancel
            return np.where(near, short_integral(slope, w), apart) if near.any() else apart, slope(w)

        def log_left(w: Array) -> tuple[Array, Array]:
            left = scaled_expint(1, x_0 + w)
            return w - np.log(left), 1.0 / (left * (x_0 + w))

        early, exponent = scaled < 0.5 * whole, np.full_like(scaled, x_0)
        # Both searches start close below their roots. In the first, the elapsed time is less than (1 - e^-w)/x_0, and
        # half of the total less than 1/(2 x_0); in the second, e^x E_1(x) > 1/(x + 1), and w + 1 is at most `most`.
        gone = scaled[early]
        nothing = np.zeros_like(gone)
        exponent[early] += increasing_root(
            elapsed, gone, nothing, nothing + max(1.0, x_0) * 50.0, -np.log1p(-np.minimum(x_0 * gone, 0.5))
        )
        left = -np.log(np.maximum(1.0 - scaled[~early] / whole, 2.0**-60) * whole)
        most = np.maximum(left, 1.0) + 1.0
        exponent[~early] += increasing_root(log_left, left, np.zeros_like(left), most, left - np.log(x_0 + most))
        phi = np.where(t < self.end_time, self.load / exponent, 0.0)
        return {"phi": phi, "f": self.t_n / (self.n_c * phi)}


class Expansion(NamedTuple):
    r"""The rate r about a bonding state, in units of :math:`e^{1+F_*}`: value, slope and remainder.

    .. math:: r(a+\delta)=r(a)+r'(a)\,\delta+e^{x_a}(a+\delta)(e^{-q}-1+q),\quad x_a=\frac Fa,\quad
        q=\frac{x_a\delta}{a+\delta}
    """

    state: float
    critical_exponent: float
    apart: float
    """Critical exponent minus F/a."""
    value: float
    slope: float

    def rate(self, delta: Array | float, phi: Array | float) -> Array:
        """Return the rate at phi, which is ``delta`` away from the state."""
        q = (self.critical_exponent - self.apart) * delta / phi
        rest = math.exp(-self.apart) * phi * remainder(np.asarray(q))
        return np.asarray(self.value + self.slope * delta + rest)

    def derivative(self, delta: Array) -> Array:
        """Return the derivative of the rate."""
        exponent = self.critical_exponent - self.apart
        q = exponent * delta / (self.state + delta)
        curved = remainder(np.asarray(q)) - np.expm1(-q) * exponent * self.state / (self.state + delta)
        return np.asarray(self.slope + math.exp(-self.apart) * curved)


class RebindingCluster(Cluster):
    r"""Bonds that share a constant traction and form again at free sites, which carry no load.

    .. math:: \dot\phi=-k_{off}\,r(\phi),\quad r=\phi e^{F/\phi}-\gamma(1-\phi),\quad F=\frac{t_nx_{off}}{n_ck_BT},\quad
        \gamma=\frac{k_{on}}{k_{off}}

    A steady state exists up to the critical load :math:`F_*=W_0(\gamma/e)`, where
    :math:`\phi_*=\frac{F_*}{1+F_*}`. Above it the cluster breaks; just above, after
    :math:`\pi\sqrt{2/(e^{F_*/\phi_*}(F-F_*)r''(\phi_*))}/k_{off}`. The paths to the steady state and to rupture are
    quadratures, inverted to rounding. The rate is expanded about the critical state in terms that do not cancel, so
    that the relative error of a lifetime is the rounding of F over its distance from :math:`F_*`.

    Source: Erdmann & Schwarz (2004), J. Chem. Phys. 121, 8997, doi 10.1063/1.1805496; Bell (1978), Science 200, 618.

    >>> site = 1e14 * 1.380649e-23 * 300.0 / 4e-10
    >>> cluster = RebindingCluster(k_off=1.0, k_on=1.0, x_off=4e-10, T=300.0, n_c=1e14, t_n=0.3 * site)
    >>> f"{cluster.critical_load:.10f}, {cluster.critical_state:.10f}, {cluster.end_time:.6f} s"
    '0.2784645428, 0.2178117057, 3.163522 s'
    """

    k_on: float = parameter("1/s", "rate at which free sites bond", above=0)

    readings = read(reaction="k_on")

    @cached_property
    def critical_load(self) -> float:
        """Largest force per site, in units of the force scale, with a steady state: F_*."""
        from scipy.special import wrightomega  # W_0 of an exponential, which may overflow

        return float(wrightomega(math.log(self.k_on / self.k_off) - 1.0))

    @property
    def critical_traction(self) -> float:
        """Largest traction [Pa] with a steady state."""
        return self.critical_load * self.n_c * self.force_scale

    @cached_property
    def critical_state(self) -> float:
        """Bonding state at the critical load."""
        return self.critical_load / (1.0 + self.critical_load)

    @cached_property
    def breaks(self) -> bool:
        """True if the cluster ruptures instead of reaching its steady state."""
        below = self.phi_i < self.critical_state and bool(
            self._about(0.0).rate(self.phi_i - self.critical_state, self.phi_i) > 0.0
        )
        return self.load > self.critical_load or below

    @cached_property
    def end_time(self) -> float:
        """Time [s] at which the last bond breaks; infinite if a steady state is reached."""
        return self._path.duration / self.k_off if self.breaks else math.inf

    @property
    def steady_state(self) -> float:
        """Stable bonding state below the critical load; InputError above it."""
        return self.critical_state + self._above_critical

    @property
    def passage_time(self) -> float:
        """Asymptotic lifetime [s] just above the critical load, from the bottleneck at the slowest state."""
        exponent = 1.0 + self.critical_load
        curvature = math.exp(exponent) * exponent**2 / self.critical_state
        distance = math.exp(exponent) * (self.load - self.critical_load)
        return math.pi * math.sqrt(2.0 / (distance * curvature)) / self.k_off

    def _about(self, d: float) -> Expansion:
        """Return the expansion of the rate about the state that is ``d`` above the critical one."""
        state, exponent, below = self.critical_state + d, 1.0 + self.critical_load, self.critical_load - self.load
        apart = (exponent * d + below) / state  # critical exponent minus that of this state
        slope = -self.critical_load * math.expm1(-apart) + apart * math.exp(-apart)
        value = -self.critical_state * -math.expm1(-below / self.critical_state) if d == 0.0 else 0.0
        return Expansion(state, exponent, apart, value, slope)

    @cached_property
    def _above_critical(self) -> float:
        """Distance of the stable state from the critical one."""
        if self.load > self.critical_load:
            raise InputError(f"{self.name}: no steady state above t_n = {self.critical_traction!r} Pa.")
        expansion = self._about(0.0)
        target = np.array([-expansion.value])
        if target[0] == 0.0:
            return 0.0

        def distance(d: Array) -> tuple[Array, Array]:
            return expansion.rate(d, self.critical_state + d) - expansion.value, expansion.derivative(d)

        # Up to second order in the exponent, r grows by d^2 / (phi_* + d) times this.
        growth = 0.5 * math.exp(-expansion.apart) * expansion.critical_exponent**2
        half, top = 0.5 * target / growth, np.array([1.0 - self.critical_state])
        start = half + np.sqrt(half**2 + 2 * half * self.critical_state)
        return float(increasing_root(distance, target, np.zeros(1), top, start)[0])

    @cached_property
    def _path(self) -> AutonomousODE:
        """Path from the start to rupture or to the steady state, in units of 1/k_off."""
        scale, critical = math.exp(1.0 + self.critical_load), self._about(0.0)
        if self.breaks:

            def rupture(gone: Array, left: Array) -> Array:
                if self.load > self.critical_load + FAR * self.critical_state:  # the two terms do not cancel
                    return left * np.exp(self.load / left) - self.k_on / self.k_off * (1.0 - left)
                delta = np.where(gone < left, self.phi_i - self.critical_state - gone, left - self.critical_state)
                return scale * critical.rate(delta, left)

            return AutonomousODE(rupture, self.phi_i, [x for x in [self.phi_i - self.critical_state] if x > 0.0])
        end, steady = self._about(self._above_critical), self.steady_state
        side = math.copysign(1.0, self.phi_i - steady)
        return AutonomousODE(
            lambda _, left: side * scale * end.rate(side * left, steady + side * left), abs(self.phi_i - steady)
        )

    def quantities(self, t: Array) -> Quantities:
        if not self.breaks and self.phi_i == self.steady_state:
            phi: Array | float = self.phi_i
        else:
            covered, left = self._path.position(self.k_off * t)
            end = 0.0 if self.breaks else self.steady_state
            toward = math.copysign(1.0, end - self.phi_i)
            phi = np.where(covered < left, self.phi_i + toward * covered, end - toward * left)
        return {"phi": phi, "f": self.t_n / (self.n_c * np.asarray(phi))}


class SuddenDebonding(UniformBody):
    r"""Sudden debonding under a traction, quadratic energies: the uniform temperature afterwards and its verdict.

    .. math:: \frac C{2T_0}(T_f^2-T_i^2)=E:=\frac{t_n^2}2\Big(\frac1k+\frac1{E_n}\Big)-\frac{K_0}2\phi_i(2-\phi_i)

    The energy that springs release, less that of the bonds, becomes heat. Admissible iff :math:`E\ge0`: below, energy
    is conserved with :math:`T_f<T_i` but entropy falls by :math:`C(T_i-T_f)/T_0`; at :math:`E\le-CT_i^2/2T_0` no
    temperature conserves energy. The paper has :math:`\phi_i=1`, :math:`T_i=T_0`, a rigid interface, and
    :math:`T_f=T_0\sqrt{1-\kappa+(t_n/t_0)^2}` with :math:`\kappa=K_0/(T_0C)`, :math:`t_0^2=T_0Ck`; its cooling branch
    violates its own second law.

    Source: Sauer, Duong & Mandadapu (2021), section 6.3, with the entropy of the jump.

    >>> bonds = SuddenDebonding(C=2.0, T_0=300.0, T_i=300.0, K_0=600.0, t_n=7e7, k=1e13)
    >>> f"{bonds.final_temperature:.6f} {bonds.entropy_change:.6f} {bonds.verdict}"
    '271.108834 -0.192608 entropy-violating'
    """

    K_0: float = parameter("J/m^2", "bond energy density")
    phi_i: float = parameter("1", "bonding state before", default=1.0, at_least=0, at_most=1)
    t_n: float = parameter("Pa", "traction before")
    k: float = parameter("Pa/m", "stiffness of the bodies", above=0)
    compliance: float = parameter("m/Pa", "compliance 1/E_n of the bonded interface", default=0.0, at_least=0)

    readings = read(potential="K_0", initial="phi_i=phi", normal="k")

    @classmethod
    def from_scene(cls, scene: SceneView) -> Parameters:
        loaded = scene.initial("t_n") if "t_n" in scene.scene.loading else scene.read("limit", "t_max")
        return {**super().from_scene(scene), "t_n": loaded}

    @property
    def traction(self) -> float:
        """Traction [Pa] at which the interface debonds."""
        return self.t_n

    @property
    def released_energy(self) -> float:
        """Energy [J/m^2] that becomes heat."""
        elastic = 0.5 * self.traction**2 * (1.0 / self.k + self.compliance)
        return elastic - 0.5 * self.K_0 * self.phi_i * (2.0 - self.phi_i)

    @property
    def final_temperature(self) -> float:
        """Temperature [K] after debonding; NaN if there is none."""
        if self.verdict == "impossible":
            return math.nan
        return float(self.heated(np.array(self.released_energy)))

    @property
    def entropy_change(self) -> float:
        """Entropy [J/(m^2 K)] that the event produces; NaN if it is impossible."""
        before, after = self.model.entropy(np.array([self.T_i, self.final_temperature]) - self.T_0, self.C, self.T_0)
        return float(after - before)

    @property
    def verdict(self) -> str:
        """'admissible', 'entropy-violating' or 'impossible'."""
        if self.released_energy >= 0.0:
            return "admissible"
        none, before = self.model.energy(np.array([0.0, self.T_i]) - self.T_0, self.C, self.T_0)
        return "entropy-violating" if self.released_energy + float(before - none) > 0.0 else "impossible"

    def quantities(self, t: Array) -> Quantities:
        return {"T": self.final_temperature, "entropy_change": self.entropy_change}


class PulledToDebonding(SuddenDebonding):
    r"""Elastic bodies, bonded by a rigid interface, are pulled apart at constant speed until all bonds break at once.

    .. math:: t_n=kw<t_0\,\phi_i\,T_0/T_i,\qquad w=\dot wt;\quad\text{then }\phi=0,\ t_n=0,\ g_n=w,\ T=T_f

    with the final temperature of sudden debonding, whose parameter :math:`t_n` is here the strength
    :math:`t_0` of complete bonding at :math:`T_0`. There is no solution if debonding is impossible.

    Source: Sauer, Duong & Mandadapu (2021), section 6.3 with eq. e:debond.

    >>> bodies = PulledToDebonding(
    ...     C=2.0, T_0=300.0, T_i=300.0, K_0=300.0, t_n=7.745966692414834e7, k=1e13, w_dot=1e-6)
    >>> f"{bodies.debonding_time:.9f} {bodies.solution(9.0)['T']:.9f}"
    '7.745966692 367.423461417'
    """

    w_dot: float = parameter("m/s", "speed of the far field", above=0)

    readings = read(ramp="w_dot=w_n")

    @property
    def debonding_time(self) -> float:
        """Time [s] at which the strength is reached."""
        return self.traction / (self.k * self.w_dot)

    @property
    def traction(self) -> float:
        return self.t_n * self.phi_i * self.T_0 / self.T_i

    def quantities(self, t: Array) -> Quantities:
        if self.verdict == "impossible":
            raise InputError(f"{self.name}: no temperature conserves the energy.")
        bonded, w = t < self.debonding_time, self.w_dot * t
        return {
            "w_n": w,
            "g_n": np.where(bonded, 0.0, w),
            "t_n": np.where(bonded, self.k * w, 0.0),
            "phi": np.where(bonded, self.phi_i, 0.0),
            "T": np.where(bonded, self.T_i, self.final_temperature),
        }


class BilinearDebonding(Reference):
    r"""Bonds that break along a falling line of traction as the gap opens, closes, and opens again.

    .. math:: t_n=\phi E_bg_n,\qquad
        \phi=\frac{g_c}{\hat g}\,\frac{g_f-\hat g}{g_f-g_c},\quad g_c=\frac{t_{max}}{E_b}\le\hat g\le g_f,\qquad
        D=\tfrac12(t_{max}\hat g-\hat tg_c)-H_r(1-\phi)

    with the largest gap so far :math:`\hat g`, and the energy dissipated so far, D: the area between loading and
    unloading less the energy stored by the broken bonds. Its total is :math:`\tfrac12t_{max}g_f-H_r`. The gap opens at
    a constant speed to :math:`g_1`, closes at the same speed, and opens again. Any t >= 0.

    Source: bilinear law as in Camanho & Davila (2002), NASA/TM-2002-211737, integrated.

    >>> zone = BilinearDebonding(t_max=8e7, E_b=1e15, g_f=24e-6, H_r=2.0, g_1=8e-6, speed=1e-6)
    >>> " ".join(f"{x:.9f}" for x in zone.solution([4.0, 12.0, 40.0])["heat"])
    '155.357859532 315.872909699 958.000000000'
    """

    t_max: float = parameter("Pa", "tensile strength", above=0)
    E_b: float = parameter("Pa/m", "stiffness of complete bonding", above=0)
    g_f: float = parameter("m", "gap at which the last bonds break", above=0)
    H_r: float = parameter("J/m^2", "heat released by complete bonding", default=0.0)
    g_1: float = parameter("m", "gap at which it is first closed again", at_least=0)
    speed: float = parameter("m/s", "speed of the gap", above=0)

    readings = read(reaction="t_max E_b g_f", potential="H_r")

    def flaw(self) -> str:
        return f"g_f must be above t_max / E_b = {self.peak!r} m." if self.g_f <= self.peak else ""

    @property
    def peak(self) -> float:
        """Gap [m] of the largest traction."""
        return self.t_max / self.E_b

    def quantities(self, t: Array) -> Quantities:
        back, again = 2.0 * self.g_1 - self.speed * t, self.speed * t - 2.0 * self.g_1
        g = np.where(self.speed * t <= self.g_1, self.speed * t, np.maximum(back, again))
        largest = np.clip(np.maximum(g, np.where(self.speed * t > self.g_1, self.g_1, 0.0)), self.peak, self.g_f)
        left = (self.g_f - largest) / (self.g_f - self.peak)
        phi = self.peak / largest * left
        lost = (largest - self.peak) * self.g_f / (largest * (self.g_f - self.peak))  # 1 - phi
        heat = 0.5 * self.t_max * (largest - self.peak * left) - self.H_r * lost
        return {"g_n": g, "phi": phi, "t_n": phi * self.E_b * g, "heat": heat}
