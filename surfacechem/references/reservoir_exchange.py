"""A body that exchanges heat with a reservoir, quadratic energy."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.references._bodies import UniformBody
from surfacechem.references._inversion import increasing_root
from surfacechem.references._special_functions import second_difference
from surfacechem.references.base import Array, Parameters, SceneView


class ReservoirExchange(UniformBody):
    r"""A body with quadratic energy that relaxes to the temperature of a reservoir.

    .. math:: \frac C{T_0}T\dot T=q=h(T_a-T),\qquad
        T=T_a\big\{1+W_0\big(y_0e^{y_0-\lambda t}\big)\big\},\quad y_0=\frac{T_i}{T_a}-1,\quad
        \lambda=\frac{hT_0}{CT_a}

    The Lambert function loses digits for a cold body and overflows for a hot one. What is solved instead, to rounding,
    is the same equation for :math:`s=\ln\frac{T_i-T_a}{T-T_a}`, namely :math:`s+y_0(1-e^{-s})=\lambda t`. Any t >= 0.

    Source: quadratic energy of Sauer, Duong & Mandadapu (2021), integrated; Corless et al. (1996) for W.

    >>> body = ReservoirExchange(C=900.0, T_0=300.0, T_i=500.0, h=40.0, T_a=290.0)
    >>> f"{body.solution(180.5)['T']:.10f}"
    '290.1077462179'
    """

    name: ClassVar[str] = "reservoir-exchange"

    h: float = parameter("W/(m^2 K)", "conductance to the reservoir", at_least=0)
    T_a: float = parameter("K", "temperature of the reservoir", above=0)

    @classmethod
    def from_scene(cls, scene: SceneView) -> Parameters:
        return {**super().from_scene(scene), "h": scene.conductance(), "T_a": scene.surroundings_temperature}

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        scaled = self.h * self.T_0 / (self.C * self.T_a) * t
        ends = (1.0, self.T_i / self.T_a)
        s = increasing_root(self._scaled_time, scaled, scaled / max(ends), scaled / min(ends))
        distance = self.T_a - self.T_i
        return {"T": self.T_i - distance * np.expm1(-s), "q": self.h * distance * np.exp(-s)}

    def _scaled_time(self, s: Array) -> tuple[Array, Array]:
        """The left-hand side of the implicit solution, a sum of positive numbers for a cold body, and its slope."""
        relative = self.T_i / self.T_a
        offset = (self.T_i - self.T_a) / self.T_a
        curved = -offset * s**2 * second_difference(np.zeros_like(s), -s)
        return s * relative + curved, relative + offset * np.expm1(-s)
