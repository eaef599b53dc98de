"""A viscous film that thins with temperature, quadratic energies."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.references._bodies import FrictionallyHeated
from surfacechem.references._inversion import increasing_root
from surfacechem.references._special_functions import first_difference, second_difference
from surfacechem.references.base import Array, Parameters, SceneView


class ThinningFilm(FrictionallyHeated):
    r"""Heating by a film of viscosity :math:`\eta_0e^{-\beta(T-T_0)}`, quadratic energies, no loss.

    .. math:: \frac C{T_0}T\dot T=D_0e^{-\beta(T-T_0)},\qquad
        T=\frac1\beta\Big\{1+W_0\Big[(\beta T_i-1)e^{\beta T_i-1}+\frac{\beta^2D_0T_0t}Ce^{\beta T_0-1}\Big]\Big\}

    The Lambert function loses digits for small :math:`\beta T` and overflows for large. What is solved instead, to
    rounding, is the same equation for the rise :math:`\theta=T-T_i`,
    :math:`T_i\theta\exp[0,\beta\theta]+\theta^2\exp[0,\beta\theta,\beta\theta]=D_0e^{-\beta(T_i-T_0)}T_0t/C`.
    Any t >= 0, beta >= 0; beta = 0 is steady sliding.

    Source: Sauer, Duong & Mandadapu (2021), section 6.1, viscous law with a temperature-dependent viscosity (Reynolds
    1886), integrated.

    >>> film = ThinningFilm(C=4000.0, T_0=300.0, T_i=300.0, D_0=3000.0, beta=0.04)
    >>> f"{film.solution(4e4)['T']:.10f}"
    '467.5516435377'
    """

    name: ClassVar[str] = "thinning-film"

    beta: float = parameter("1/K", "decay of the viscosity per kelvin", at_least=0)

    @classmethod
    def from_scene(cls, scene: SceneView) -> Parameters:
        return {**super().from_scene(scene), "beta": scene.friction("beta")}

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        initial = self.D_0 * np.exp(-self.beta * (self.T_i - self.T_0))
        heat = initial * self.T_0 * t / self.C
        without_thinning = 2.0 * heat / (self.T_i + np.sqrt(self.T_i**2 + 2.0 * heat))
        exponent = np.log1p(self.beta * heat / self.T_i) / (self.beta or 1.0)
        above = np.where(self.beta > 0.0, np.minimum(exponent, without_thinning), without_thinning)
        rise = increasing_root(self._heat, heat, np.zeros_like(heat), above)
        return {"T": self.T_i + rise, "D": initial * np.exp(-self.beta * rise)}

    def _heat(self, rise: Array) -> tuple[Array, Array]:
        """Energy in units of C/T_0 that heats against the thinning, and its slope."""
        exponent = self.beta * rise
        linear = self.T_i * first_difference(np.zeros_like(exponent), exponent)
        quadratic = rise * np.exp(exponent) * second_difference(np.zeros_like(exponent), -exponent)
        return rise * (linear + quadratic), (self.T_i + rise) * np.exp(exponent)
