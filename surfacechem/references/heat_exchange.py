"""Heat of bodies: exchanged between two, with a reservoir or a medium between them, conducted, extracted; ignition.

Conducting bodies are solved by Laplace transformation: the responses of the bodies to heat at their contact, and a
numerical inversion. Source: Carslaw & Jaeger (1959), Conduction of Heat in Solids, chapter XII; Weideman & Trefethen
(2007), Parabolic and hyperbolic contours for computing the Bromwich integral, Math. Comp. 76, and Trefethen, Weideman &
Schmelzer (2006), Talbot quadratures and rational approximations, BIT 46, for the contour.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from surfacechem.contracts.terms import Load, parameter
from surfacechem.errors import InputError
from surfacechem.references.base import Array, Parameters, Quantities, Reference, SceneView, UniformBody, read
from surfacechem.references.numerics import first_difference, increasing_root, scaled_rise, second_difference

if TYPE_CHECKING:
    from surfacechem.scene import Body, Scene


class PairExchange(Reference):
    r"""An isolated pair of bodies with quadratic energies and a direct conductance.

    .. math:: \frac{C_k}{T_0}T_k\dot T_k=q_k,\qquad q_1=-q_2=h(T_2-T_1)

    :math:`C_1T_1^2+C_2T_2^2` is constant, so the state is an angle u on an ellipse,

    .. math:: T_1=T_{eq}\Big(\cos u-\sqrt{\tfrac{C_2}{C_1}}\sin u\Big),\quad
        T_2=T_{eq}\Big(\cos u+\sqrt{\tfrac{C_1}{C_2}}\sin u\Big),\quad
        T_{eq}=\sqrt{\frac{C_1T_1^2+C_2T_2^2}{C_1+C_2}}

    and equilibrium is the root mean square. With :math:`s=\ln\frac{\tan(u_i/2)}{\tan(u/2)}`, from zero to infinity,

    .. math:: \frac{hT_0}{T_{eq}}\frac{C_1+C_2}{C_1C_2}\,t=s+2(\cos u_i-\cos u)
        +\frac{C_1-C_2}{\sqrt{C_1C_2}}(\sin u_i-\sin u)

    is inverted to rounding. Any t >= 0.

    Source: quadratic energies of Sauer, Duong & Mandadapu (2021) with their direct heat transfer law (section 5.6),
    integrated.

    >>> pair = PairExchange(C_1=1000.0, C_2=1000.0, h=250.0, T_0=300.0, T_1=280.0, T_2=420.0)
    >>> f"{pair.solution(5.21127900453175)['T_1']:.10f}"
    '349.2382293563'
    """

    C_1: float = parameter("J/(m^2 K)", "heat capacity of body 1 at T_0", above=0)
    C_2: float = parameter("J/(m^2 K)", "heat capacity of body 2 at T_0", above=0)
    h: float = parameter("W/(m^2 K)", "conductance between the bodies", at_least=0)
    T_0: float = parameter("K", "reference temperature", above=0)
    T_1: float = parameter("K", "initial temperature of body 1", above=0)
    T_2: float = parameter("K", "initial temperature of body 2", above=0)

    readings = read(constant="C_1 C_2 T_0", initial="T_1 T_2", total_conductance="h")

    @property
    def equilibrium_temperature(self) -> float:
        """Root mean square temperature [K]."""
        share = self.C_1 / (self.C_1 + self.C_2)
        return math.hypot(math.sqrt(share) * self.T_1, math.sqrt(1.0 - share) * self.T_2)

    def quantities(self, t: Array) -> Quantities:
        equilibrium, ratio = self.equilibrium_temperature, math.sqrt(self.C_2 / self.C_1)
        skew = 1.0 / ratio - ratio
        # The angle u on the ellipse is represented by the tangent of its half, which decays as exp(-s).
        start = math.tan(0.5 * math.atan2(self.T_2 - self.T_1, self.T_1 / ratio + self.T_2 * ratio))

        def circle(s: Array) -> tuple[Array, Array, Array]:
            tangent = start * np.exp(-s)
            square = 1.0 + tangent**2
            return tangent, 2.0 * tangent / square, (1.0 - tangent**2) / square

        def scaled_time(s: Array) -> tuple[Array, Array]:
            """Return the right-hand side of the implicit solution and its slope, T_1 T_2 / T_eq^2."""
            tangent, sine, cosine = circle(s)
            scale = 2.0 / ((1.0 + tangent**2) * (1.0 + start**2))
            cosines = scale * start**2 * np.expm1(-2.0 * s)
            sines = -scale * start * np.expm1(-s) * (1.0 - tangent * start)
            return s + 2.0 * cosines + skew * sines, 1.0 - 2.0 * sine**2 + skew * sine * cosine

        scaled = t * self.h * self.T_0 / equilibrium * (1.0 / self.C_1 + 1.0 / self.C_2)
        # Bounds of the slope are known, and thus bounds of s.
        most, least = 0.5 * (1.0 / ratio + ratio), min(1.0, self.T_1 * self.T_2 / equilibrium**2)
        _, sine, cosine = circle(increasing_root(scaled_time, scaled, scaled / most, scaled / least))
        q = self.h * equilibrium * (ratio + 1.0 / ratio) * sine
        return {
            "T_1": equilibrium * (cosine - ratio * sine),
            "T_2": equilibrium * (cosine + sine / ratio),
            "q_1": q,
            "q_2": -q,
        }


class ReservoirExchange(UniformBody):
    r"""A body with quadratic energy that relaxes to the temperature of a reservoir.

    .. math:: \frac C{T_0}T\dot T=q=h(T_a-T),\qquad
        T=T_a\big\{1+W_0\big(y_0e^{y_0-\lambda t}\big)\big\},\quad y_0=\frac{T_i}{T_a}-1,\quad
        \lambda=\frac{hT_0}{CT_a}

    The Lambert function loses digits for a cold body and overflows for a hot one. Instead, the same equation is solved
    to rounding for :math:`s=\ln\frac{T_i-T_a}{T-T_a}`, namely :math:`s+y_0(1-e^{-s})=\lambda t`. Any t >= 0.

    Source: quadratic energy of Sauer, Duong & Mandadapu (2021), integrated; Corless et al. (1996) for W.

    >>> body = ReservoirExchange(C=900.0, T_0=300.0, T_i=500.0, h=40.0, T_a=290.0)
    >>> f"{body.solution(180.5)['T']:.10f}"
    '290.1077462179'
    """

    h: float = parameter("W/(m^2 K)", "conductance to the reservoir", at_least=0)
    T_a: float = parameter("K", "temperature of the reservoir", above=0)

    readings = read(total_conductance="h", surroundings_temperature="T_a")

    def quantities(self, t: Array) -> Quantities:
        relative, distance = self.T_i / self.T_a, self.T_a - self.T_i
        offset = -distance / self.T_a

        def scaled_time(s: Array) -> tuple[Array, Array]:
            """Return the left-hand side of the implicit solution, positive terms for a cold body, and its slope."""
            curved = -offset * s**2 * second_difference(np.zeros_like(s), -s)
            return s * relative + curved, relative + offset * np.expm1(-s)

        scaled = self.h * self.T_0 / (self.C * self.T_a) * t
        s = increasing_root(scaled_time, scaled, scaled / max(1.0, relative), scaled / min(1.0, relative))
        return {"T": self.T_i - distance * np.expm1(-s), "q": self.h * distance * np.exp(-s)}


class HeatedMedium(Reference):
    r"""Bodies of constant capacity, a medium between them, and the source :math:`D_0+D_1e^{-\gamma t}` in it."""

    C_1: float = parameter("J/(m^2 K)", "heat capacity of body 1", above=0)
    C_2: float = parameter("J/(m^2 K)", "heat capacity of body 2", above=0)
    h_1: float = parameter("W/(m^2 K)", "conductance between medium and body 1", above=0)
    h_2: float = parameter("W/(m^2 K)", "conductance between medium and body 2", above=0)
    T_1: float = parameter("K", "initial temperature of body 1", above=0)
    T_2: float = parameter("K", "initial temperature of body 2", above=0)
    D_0: float = parameter("W/m^2", "steady part of the source", default=0.0)
    D_1: float = parameter("W/m^2", "decaying part of the source at the start", default=0.0)
    gamma: float = parameter("1/s", "decay rate of the source", default=0.0, at_least=0)

    readings = read(constant="C_1 C_2", initial="T_1 T_2", conductance="h_1=1 h_2=2", heating_at_T_0="D_0")


class ThreeTemperatures(HeatedMedium):
    r"""Two bodies and a medium with heat capacity, all constant, and a decaying source in the medium.

    .. math:: C_k\dot T_k=q_k=h_k(T_c-T_k),\qquad C_c\dot T_c=D_0+D_1e^{-\gamma t}-q_1-q_2

    In :math:`y_k=\sqrt{h_k}(T_c-T_k)` the matrix is symmetric and positive,
    :math:`S_{kl}=\delta_{kl}\frac{h_k}{C_k}+\frac{\sqrt{h_kh_l}}{C_c}`. The response of each of its two modes to the
    source consists of divided differences of the exponential, and so do the integrals of :math:`q_k` that give the
    temperatures; the response to a steady source, :math:`q_k=D\,C_k/C`, is used to drive the modes. The slow rate is
    :math:`h_1h_2C/(C_1C_2C_c)` over the fast one. No step loses digits for :math:`C_c\to0` or :math:`h_k\to0,\infty`.

    Any t >= 0. Source: Sauer, Duong & Mandadapu (2021), section 5.6 (heat transfer) with constant capacities, solved
    by diagonalisation.

    >>> bodies = ThreeTemperatures(C_1=1200.0, C_2=500.0, C_c=8.0, h_1=2500.0, h_2=700.0,
    ...                            T_1=290.0, T_2=350.0, T_c=300.0, D_0=400.0)
    >>> f"{bodies.solution(10.0)['T_c']:.12f}"
    '310.081108421144'
    """

    C_c: float = parameter("J/(m^2 K)", "heat capacity of the medium", above=0)
    T_c: float = parameter("K", "initial temperature of the medium", above=0)

    readings = read(constant="C_c", initial="T_c")

    def quantities(self, t: Array) -> Quantities:
        zero, decay, total = np.zeros_like(t), -self.gamma * t, self.C_1 + self.C_2 + self.C_c
        # Flux and heat into each body, and the sizes of their terms as temperatures [K].
        q, heat, by, off = np.zeros((4, 2, t.size))
        for rate, mode, initial in self.modes():
            # Amplitude of the mode and its integral over time: free decay and both parts of the source.
            drive = rate * sum(axis * C / total / root for axis, C, _, root in zip(mode, *self._paths, strict=True))
            free = -rate * t
            amplitudes, integrals = [initial * np.exp(free)], [initial * t * first_difference(zero, free)]
            for strength, exponent in ((self.D_0, zero), (self.D_1, decay)):
                amplitudes.append(strength * drive * t * first_difference(exponent, free))
                integrals.append(strength * drive * t**2 * second_difference(exponent, free))
            for k, (axis, C, h, root) in enumerate(zip(mode, *self._paths, strict=True)):
                q[k] += root * axis * np.sum(amplitudes, axis=0)
                heat[k] += root * axis * np.sum(integrals, axis=0)
                by[k] += root * abs(axis) * np.sum(np.abs(integrals), axis=0) / C
                off[k] += root * abs(axis) * np.sum(np.abs(amplitudes), axis=0) / h
        given = self.D_0 * t + self.D_1 * t * first_difference(zero, decay)
        by_c = self.T_c + (np.abs(given) + by[0] * self.C_1 + by[1] * self.C_2) / self.C_c
        bodies, to = (self.T_1 + heat[0] / self.C_1, self.T_2 + heat[1] / self.C_2), (q[0] / self.h_1, q[1] / self.h_2)
        # Each temperature in the way with the least cancellation: from its own heat, or from another one and the flux.
        ways = (self.T_1 + by[0] + off[0], self.T_2 + by[1] + off[1], by_c)
        own = self.T_c + (given - heat[0] - heat[1]) / self.C_c
        T_c = np.choose(np.argmin(ways, axis=0), (bodies[0] + to[0], bodies[1] + to[1], own))
        least = np.min(ways, axis=0)
        T_1 = np.where(self.T_1 + by[0] <= least + off[0], bodies[0], T_c - to[0])
        T_2 = np.where(self.T_2 + by[1] <= least + off[1], bodies[1], T_c - to[1])
        return {"T_1": T_1, "T_2": T_2, "T_c": T_c, "q_1": q[0], "q_2": q[1]}

    @property
    def _paths(self) -> tuple[tuple[float, float], ...]:
        """Capacities of the bodies, conductances to them, and square roots of the conductances."""
        return (self.C_1, self.C_2), (self.h_1, self.h_2), (float(np.sqrt(self.h_1)), float(np.sqrt(self.h_2)))

    def modes(self) -> Iterator[tuple[float, tuple[float, float], float]]:
        """Yield decay rate [1/s], unit vector and initial amplitude of the fast and of the slow mode.

        The eigenvalues of S, and the eigenvector of the larger one, follow from a Jacobi rotation, accurate by entry.
        """
        _, _, (root_1, root_2) = self._paths
        own_1, own_2 = self.h_1 / self.C_1, self.h_2 / self.C_2
        coupling = root_1 * root_2 / self.C_c
        half_gap = 0.5 * ((own_1 - own_2) / coupling + (self.h_1 - self.h_2) / (root_1 * root_2))
        tangent = 1.0 / (abs(half_gap) + np.hypot(1.0, half_gap))
        cosine = 1.0 / np.hypot(1.0, tangent)
        fast = max(own_1 + self.h_1 / self.C_c, own_2 + self.h_2 / self.C_c) + coupling * tangent
        slow = own_1 * (self.h_2 / self.C_c) * ((self.C_1 + self.C_2 + self.C_c) / self.C_2) / fast
        along, across = (cosine, cosine * tangent) if half_gap >= 0.0 else (cosine * tangent, cosine)
        start = (root_1 * (self.T_c - self.T_1), root_2 * (self.T_c - self.T_2))
        yield fast, (along, across), along * start[0] + across * start[1]
        yield slow, (-across, along), along * start[1] - across * start[0]


class ThreeTemperaturesNoCapacity(HeatedMedium):
    r"""Two bodies of constant capacity and a medium without: the limit C_c = 0, an algebraic temperature.

    .. math:: T_c=\frac{h_1T_1+h_2T_2+D}{h_1+h_2},\qquad
        q_1=\alpha_1D+h(T_2-T_1),\quad q_2=\alpha_2D-h(T_2-T_1)

    with :math:`D=D_0+D_1e^{-\gamma t}`, :math:`\alpha_k=h_k/(h_1+h_2)`, :math:`h=h_1h_2/(h_1+h_2)`. The difference
    :math:`T_2-T_1` decays at the rate :math:`h(1/C_1+1/C_2)` and is driven by
    :math:`(\alpha_2/C_2-\alpha_1/C_1)D`. The medium starts from its algebraic temperature. Any t >= 0.

    Source: Sauer, Duong & Mandadapu (2021), section 5.6 (heat transfer), with constant capacities, integrated.

    >>> bodies = ThreeTemperaturesNoCapacity(C_1=1200.0, C_2=500.0, h_1=2500.0, h_2=700.0, T_1=290.0, T_2=350.0,
    ...                                      D_0=150.0, D_1=4000.0, gamma=3.0)
    >>> f"{bodies.solution(100.0)['T_c']:.12f}"
    '317.303334981051'
    """

    def quantities(self, t: Array) -> Quantities:
        share_1, share_2 = self.h_1 / (self.h_1 + self.h_2), self.h_2 / (self.h_1 + self.h_2)
        h, initial, zero, source_decay = share_1 * self.h_2, self.T_2 - self.T_1, np.zeros_like(t), -self.gamma * t
        # T_2 - T_1 and its integral over time: free decay and both parts of the source.
        decay, drive = -h * (1.0 / self.C_1 + 1.0 / self.C_2) * t, share_2 / self.C_2 - share_1 / self.C_1
        difference, integral = initial * np.exp(decay), initial * t * first_difference(zero, decay)
        for strength, exponent in ((self.D_0, zero), (self.D_1, source_decay)):
            difference = difference + strength * drive * t * first_difference(exponent, decay)
            integral = integral + strength * drive * t**2 * second_difference(exponent, decay)
        source = self.D_0 + self.D_1 * np.exp(source_decay)
        given = self.D_0 * t + self.D_1 * t * first_difference(zero, source_decay)
        T_1 = self.T_1 + (share_1 * given + h * integral) / self.C_1
        T_2 = self.T_2 + (share_2 * given - h * integral) / self.C_2
        return {
            "T_1": T_1,
            "T_2": T_2,
            "T_c": share_1 * T_1 + share_2 * T_2 + source / (self.h_1 + self.h_2),
            "q_1": share_1 * source + h * difference,
            "q_2": share_2 * source - h * difference,
        }


class CoolingToZero(UniformBody):
    r"""Constant heat extraction with quadratic energies; zero temperature is reached with infinite slope.

    .. math:: T=T_i\sqrt{1-t/t_0},\qquad t_0=\frac{CT_i^2}{2T_0Q}

    Exact for 0 <= t <= t_0, which is `end_time`, with full relative accuracy up to there.

    Source: Sauer, Duong & Mandadapu (2021), quadratic energy, integrated.

    >>> body = CoolingToZero(C=100.0, T_0=300.0, T_i=300.0, Q=50.0)
    >>> body.end_time, f"{body.solution(270.0)['T']:.10f}"
    (300.0, '94.8683298051')
    """

    Q: float = parameter("W/m^2", "heat extracted", above=0)

    readings = read(heat_supply="Q=-Q")

    @property
    def end_time(self) -> float:
        """Time [s] at which the temperature is zero."""
        return self.C * self.T_i**2 / (2.0 * self.T_0 * self.Q)

    def quantities(self, t: Array) -> Quantities:
        return {"T": self.T_i * np.sqrt((self.end_time - t) / self.end_time)}


class SemenovFold(Reference):
    r"""Algebraic temperature of an interface whose dissipation is activated by temperature; lower branch.

    .. math:: D_0e^{\beta(T_c-T_0)}=H(T_c-T_0),\qquad T_c=T_0-\frac1\beta W_0\Big(-\frac{\beta D_0}H\Big),\qquad
        D_0\le D_{crit}=\frac H{e\beta}

    Both branches meet at :math:`T_0+1/\beta`; beyond :math:`D_{crit}` no solution exists (ignition). Close to the fold
    W loses half the digits; v = 1 - beta (T_c - T_0) is found to rounding from :math:`-v-\ln(1-v)=-\ln(D_0/D_{crit})`.
    The remaining error is due to the rounding of D_0: T_c is known to about
    :math:`10^{-16}/(\beta\sqrt{1-D_0/D_{crit}})`.

    Source: Semenov (1928), Z. Phys. 48, 571-582, thermal explosion; interface without capacity of Sauer, Duong &
    Mandadapu (2021).

    >>> interface = SemenovFold(T_0=300.0, beta=0.05, H=50.0, D_0=183.939720585721)
    >>> f"{interface.solution(0.0)['T_c']:.10f}, {interface.critical_dissipation:.10f}"
    '304.6392190597, 367.8794411714'
    """

    T_0: float = parameter("K", "temperature of both bodies", above=0)
    beta: float = parameter("1/K", "growth of the dissipation per kelvin", above=0)
    H: float = parameter("W/(m^2 K)", "sum of the conductances to the bodies", above=0)
    D_0: float = parameter("W/m^2", "dissipation at T_0", at_least=0)

    # The factor of a law has the decay per kelvin; beta is the growth.
    readings = read(constant="T_0", total_conductance="H", heating_at_T_0="D_0", friction="beta=-beta")

    def flaw(self) -> str:
        most = self.critical_dissipation
        return f"no solution above D_0 = {most!r} W/m^2 (ignition)." if most < self.D_0 else ""

    @property
    def critical_dissipation(self) -> float:
        """Largest D_0 [W/m^2] with a solution."""
        return self.H / (math.e * self.beta)

    def quantities(self, t: Array) -> Quantities:
        scaled = scaled_rise(np.array([self.D_0 / self.critical_dissipation]))[0]
        return {"T_c": self.T_0 + scaled / self.beta, "D": self.H * scaled / self.beta}


Complex: TypeAlias = NDArray[Any]
"""Complex values."""

NODES = 24
"""Points on the contour: each reduces the error by a factor of 3.9, until rounding is reached."""

HELD_CONDUCTANCE = 1e300
"""Conductance at a far side that is held at a temperature."""


def inverse_laplace(image: Callable[[Complex], Complex], t: Array) -> Array:
    """Return the function of times t > 0 whose Laplace transform is ``image``, which may have further axes.

    >>> bool(abs(inverse_laplace(lambda s: 1 / (s + 2), np.array([0.5]))[0] - np.exp(-1)) < 1e-12)
    True
    """
    angle = (2 * np.arange(NODES // 2) + 1) * np.pi / NODES
    path = NODES * (0.5017 * angle / np.tan(0.6407 * angle) - 0.6122 + 0.2645j * angle)
    slope = NODES * (0.5017 / np.tan(0.6407 * angle) - 0.5017 * 0.6407 * angle / np.sin(0.6407 * angle) ** 2 + 0.2645j)
    result: Any = 0.0
    for z, weight in zip(path, np.exp(path) * slope, strict=True):
        # The other half of the contour is the complex conjugate.
        result = result + 2 * np.imag(weight * image(z / t) / t) / NODES
    return np.asarray(result)


class ConductingSlab(NamedTuple):
    """A body of capacity C and conductivity k over its thickness, both per area; a lump if it has no conductivity.

    Beyond the far side is the temperature ``T_far`` behind a conductance; without capacity the temperature is constant.
    """

    T: float
    C: float
    thickness: float = 1.0
    conductivity: float = 0.0
    h_far: float = 0.0
    T_far: float = 0.0

    def answer(self, s: Complex, x: Array | float = 0.0) -> tuple[Complex, Complex]:
        """Return the temperature at x per heat flux into the contact, and the temperature minus its initial value
        without any flux there.
        """
        if not self.C:
            return np.zeros_like(s), np.zeros_like(s)
        if not self.conductivity:
            return 1 / (self.C * s), np.zeros_like(s)
        # Decay of a wave per length, k times it, and the fraction left after a path across the slab and back.
        p = np.sqrt(s * self.C / (self.conductivity * self.thickness))
        kp, E = self.conductivity * p, np.exp(-2 * p * self.thickness)
        back = (kp - self.h_far) / (kp + self.h_far)
        heated = (np.exp(-p * x) + back * np.exp(-p * (2 * self.thickness - x))) / (kp * (1 - back * E))
        if not self.h_far:
            return heated, np.zeros_like(s)
        from_far = (self.T_far - self.T) / s / (kp / self.h_far * (1 - E) + 1 + E)
        return heated, from_far * (np.exp(-p * (self.thickness - x)) + np.exp(-p * (self.thickness + x)))


class ConductingSlabs(Reference):
    r"""Two slabs of constant properties in contact, perfect or through a resistance, with any far sides.

    .. math:: \frac{C_k}{L_k}\dot T_k=k_k\,T_{k,xx},\qquad q=\frac{T_1-T_2}{R}=-k_k T_{k,x}\Big|_{x=0}

    In Laplace transforms, with :math:`p=\sqrt{sC/(kL)}` and the wave reflected at the far side, the response of each
    body to a flux is :math:`Z=(1+rE)/(kp\,(1-rE))`, :math:`E=e^{-2pL}`, :math:`r=(kp-h)/(kp+h)`, and
    :math:`q=\Delta T/(s\,(Z_1+Z_2+R))`. The inversion is a quadrature on Talbot's contour, accurate to 1e-11 of the
    temperature differences. A body without conductivity is a lump, one without capacity has a constant temperature.

    Any t >= 0. Source: Carslaw & Jaeger (1959), Conduction of Heat in Solids, section 12.8.

    >>> slab = ConductingSlabs(T_1=400.0, C_1=4000.0, thickness_1=2e-3, conductivity_1=0.2, T_2=300.0, R=1e-3)
    >>> f"{slab.solution(20.0)['T_1']:.8f}"
    '306.43289553'
    """

    continuous: ClassVar[bool] = True

    T_1: float = parameter("K", "initial temperature of body 1", above=0)
    T_2: float = parameter("K", "initial temperature of body 2", above=0)
    C_1: float = parameter("J/(m^2 K)", "heat capacity of body 1", default=0.0, at_least=0)
    C_2: float = parameter("J/(m^2 K)", "heat capacity of body 2", default=0.0, at_least=0)
    thickness_1: float = parameter("m", "thickness of body 1", default=1.0, above=0)
    thickness_2: float = parameter("m", "thickness of body 2", default=1.0, above=0)
    conductivity_1: float = parameter("W/(m K)", "conductivity of body 1; 0: a lump", default=0.0, at_least=0)
    conductivity_2: float = parameter("W/(m K)", "conductivity of body 2; 0: a lump", default=0.0, at_least=0)
    h_far_1: float = parameter("W/(m^2 K)", "conductance at the far side of body 1", default=0.0, at_least=0)
    h_far_2: float = parameter("W/(m^2 K)", "conductance at the far side of body 2", default=0.0, at_least=0)
    T_far_1: float = parameter("K", "temperature beyond the far side of body 1", default=0.0, at_least=0)
    T_far_2: float = parameter("K", "temperature beyond the far side of body 2", default=0.0, at_least=0)
    R: float = parameter("m^2 K/W", "resistance of the contact; 0: perfect", default=0.0, at_least=0)

    readings = read(
        constant="C_1 C_2 thickness_1 thickness_2 conductivity_1 conductivity_2 h_far_1 h_far_2",
        initial="T_1 T_2 T_far_1 T_far_2",
    )

    @classmethod
    def from_scene(cls, scene: SceneView) -> Parameters:
        for reason in _beside_conduction(scene.scene):
            raise InputError(f"it holds for conduction between two bodies alone, and {reason}.")
        values, h = dict(super().from_scene(scene)), scene.total_conductance
        values["R"] = 1.0 / h if h else None
        for k in "12":  # a body with an initial profile has no separate temperature at the contact
            values[f"T_{k}"] = scene.run.values.get(f"initial.profile_{k}", values[f"T_{k}"])
            if values[f"T_far_{k}"] is not None and values[f"h_far_{k}"] is None:
                values[f"h_far_{k}"] = HELD_CONDUCTANCE
        return values

    @property
    def bodies(self) -> tuple[ConductingSlab, ConductingSlab]:
        """Both bodies."""
        first, second = (
            ConductingSlab(*[getattr(self, f"{name}_{k}") for name in ConductingSlab._fields]) for k in (1, 2)
        )
        return first, second

    def _flux(self, s: Complex) -> Complex:
        """Return the transform of the heat flux from the first to the second body."""
        first, second = self.bodies
        (heated_1, open_1), (heated_2, open_2) = first.answer(s), second.answer(s)
        return ((first.T - second.T) / s + open_1 - open_2) / (heated_1 + heated_2 + self.R)

    def quantities(self, t: Array) -> Quantities:
        """Return temperatures at the contact; through a resistance also the heat fluxes, which start finite."""
        T_1, T_2 = (self.profile(number, np.zeros(1), t)[:, 0] for number in (1, 2))
        if not self.R:
            return {"T_1": T_1, "T_2": T_2, "T": T_1}
        q = np.full(t.size, (self.T_1 - self.T_2) / self.R)
        q[t > 0] = inverse_laplace(self._flux, t[t > 0])
        return {"T_1": T_1, "T_2": T_2, "q_1": -q, "q_2": q}

    def profile(self, number: int, x: Array, t: Array) -> Array:
        """Return temperatures of a body at distances from the contact [m], shape (times, places)."""
        body, sign = self.bodies[number - 1], 1.0 if number == 2 else -1.0
        values = np.full((t.size, x.size), body.T)

        def rise(s: Complex) -> Complex:
            heated, unheated = body.answer(s, x)
            return unheated + sign * self._flux(s) * heated

        values[t > 0] += inverse_laplace(rise, t[t > 0, None])
        return values


def _beside_conduction(scene: Scene) -> Iterator[str]:
    """Yield the contents of a scene other than conduction, in words."""
    interface, bodies = scene.interface, {body.name for body in scene.bodies}
    laws = (interface.potentials, interface.frictions, interface.reactions, interface.limits, interface.variables)
    if any(laws):
        yield "the interface has laws of its own"
    if any((scene.normal, scene.tangential, scene.programme, scene.loading)):
        yield "something is loaded or moves"
    if interface.temperature not in (None, *(body.temperature for body in scene.bodies)):
        yield "the interface has a temperature of its own"
    for path in scene.heat:
        if path.name() != "conductance" or set(path.between) != bodies or path.varying:
            yield f"the heat path {path.name()} is no constant one between the bodies"
    for body in scene.bodies:
        yield from _not_constant(body)


def _not_constant(body: Body) -> Iterator[str]:
    """Yield the properties of a body that are not constant, in words."""
    energy, conduction = body.energy, body.conduction
    if energy is not None and (energy.name() != "constant" or energy.varying):
        yield f"the heat capacity of {body.name} varies"
    if conduction is not None and conduction.varying:
        yield f"the conductivity of {body.name} varies"
    loads = [body.temperature, conduction.far if conduction else None]
    if any(isinstance(load, Load) and load.name() != "hold" for load in loads):
        yield f"a temperature of {body.name} varies"
