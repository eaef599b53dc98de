"""A viscous film that closes at constant speed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.references._bodies import UniformBody
from surfacechem.references.base import Array, Parameters, SceneView


class ClosingFilm(UniformBody):
    r"""Heating by a viscous film whose gap closes linearly: it grows like a logarithm.

    .. math:: g_n=g_i-at,\qquad T^2=T_i^2+\frac{2T_0\eta v^2}{Ca}\ln\frac{g_i}{g_n}

    Quadratic energies, perfect thermal contact. Before `end_time` :math:`g_i/a`, at which dissipation and temperature
    are infinite.

    Source: Sauer, Duong & Mandadapu (2021), eq. e:visc_fric and section 6.1, integrated.

    >>> film = ClosingFilm(eta=0.01, v=0.5, g_i=1e-5, a=1e-6, C=800.0, T_0=300.0, T_i=300.0)
    >>> f"{film.solution(9.0)['T']:.10f} {film.end_time:.1f}"
    '307.1112942393 10.0'
    """

    name: ClassVar[str] = "closing-film"

    eta: float = parameter("Pa s", "film viscosity", at_least=0)
    v: float = parameter("m/s", "sliding velocity")
    g_i: float = parameter("m", "initial gap", above=0)
    a: float = parameter("m/s", "closing speed", above=0)

    @classmethod
    def from_scene(cls, scene: SceneView) -> Parameters:
        opening = scene.ramp("g_n")
        film = {"eta": scene.friction("eta"), "v": scene.initial("v"), "g_i": scene.initial("g_n")}
        return {**film, "a": None if opening is None else -opening, **super().from_scene(scene)}

    @property
    def end_time(self) -> float:
        """Time [s] at which the gap is closed."""
        return self.g_i / self.a

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        return self.at_gap(self.g_i * (self.end_time - t) / self.end_time)

    def at_gap(self, g: Array) -> Mapping[str, Array | float]:
        """The state when the gap is g; better than by time where that is rounded close to the end."""
        heat = self.eta * self.v**2 / self.a * np.log(self.g_i / g)
        T = np.sqrt(self.T_i**2 + 2.0 * self.T_0 * heat / self.C)
        return {"g_n": g, "T": T, "D": self.eta * self.v**2 / g, "heat": heat}
