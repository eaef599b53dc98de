"""Heat exchange of bodies with quadratic energies: of a pair, and of a body with a reservoir."""

from __future__ import annotations

import math

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.references._bodies import UniformBody
from surfacechem.references._numerics import increasing_root, second_difference
from surfacechem.references.base import Array, Quantities, Reference, read


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
