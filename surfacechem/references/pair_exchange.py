"""Two bodies that exchange heat directly, quadratic energies."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.references._inversion import increasing_root
from surfacechem.references.base import Array, Parameters, Reference, SceneView


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

    name: ClassVar[str] = "pair-exchange"

    C_1: float = parameter("J/(m^2 K)", "heat capacity of body 1 at T_0", above=0)
    C_2: float = parameter("J/(m^2 K)", "heat capacity of body 2 at T_0", above=0)
    h: float = parameter("W/(m^2 K)", "conductance between the bodies", at_least=0)
    T_0: float = parameter("K", "reference temperature", above=0)
    T_1: float = parameter("K", "initial temperature of body 1", above=0)
    T_2: float = parameter("K", "initial temperature of body 2", above=0)

    @classmethod
    def from_scene(cls, scene: SceneView) -> Parameters:
        bodies = {name: scene.constant(name) for name in ("C_1", "C_2", "T_0")}
        return {**bodies, "h": scene.conductance(), "T_1": scene.initial("T_1"), "T_2": scene.initial("T_2")}

    @property
    def equilibrium_temperature(self) -> float:
        """Root mean square temperature [K]."""
        share = self.C_1 / (self.C_1 + self.C_2)
        return math.hypot(math.sqrt(share) * self.T_1, math.sqrt(1.0 - share) * self.T_2)

    @property
    def _initial_angle(self) -> float:
        mean = math.sqrt(self.C_1 / self.C_2) * self.T_1 + math.sqrt(self.C_2 / self.C_1) * self.T_2
        return math.atan2(self.T_2 - self.T_1, mean)

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        sine, cosine = _circle(self._half_tangent(self._approach(t)))
        ratio, equilibrium = math.sqrt(self.C_2 / self.C_1), self.equilibrium_temperature
        q = self.h * equilibrium * (ratio + 1.0 / ratio) * sine
        return {
            "T_1": equilibrium * (cosine - ratio * sine),
            "T_2": equilibrium * (cosine + sine / ratio),
            "q_1": q,
            "q_2": -q,
        }

    def _half_tangent(self, s: Array) -> Array:
        return math.tan(0.5 * self._initial_angle) * np.exp(-s)

    def _approach(self, t: Array) -> Array:
        """The s that belongs to t; its rate of change lies within bounds known beforehand."""
        scaled = t * self.h * self.T_0 / self.equilibrium_temperature * (1.0 / self.C_1 + 1.0 / self.C_2)
        most = 0.5 * (math.sqrt(self.C_1 / self.C_2) + math.sqrt(self.C_2 / self.C_1))
        least = min(1.0, self.T_1 * self.T_2 / self.equilibrium_temperature**2)
        return increasing_root(self._scaled_time, scaled, scaled / most, scaled / least)

    def _scaled_time(self, s: Array) -> tuple[Array, Array]:
        """The right-hand side of the implicit solution and its slope, T_1 T_2 / T_eq^2."""
        start, tangent = math.tan(0.5 * self._initial_angle), self._half_tangent(s)
        scale = 2.0 / ((1.0 + tangent**2) * (1.0 + start**2))
        skew = math.sqrt(self.C_1 / self.C_2) - math.sqrt(self.C_2 / self.C_1)
        cosines = scale * start**2 * np.expm1(-2.0 * s)
        sines = -scale * start * np.expm1(-s) * (1.0 - tangent * start)
        sine, cosine = _circle(tangent)
        return s + 2.0 * cosines + skew * sines, 1.0 - 2.0 * sine**2 + skew * sine * cosine


def _circle(half_tangent: Array) -> tuple[Array, Array]:
    """Sine and cosine of an angle from the tangent of its half."""
    return 2.0 * half_tangent / (1.0 + half_tangent**2), (1.0 - half_tangent**2) / (1.0 + half_tangent**2)
