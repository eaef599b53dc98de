"""Constant heat extraction down to zero temperature, for both energy models."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.references.base import Array, Parameters, Reference, SceneView


class CoolingToZeroConstantCapacity(Reference):
    r"""Constant heat extraction with a constant capacity.

    .. math:: T=T_i(1-t/t_0),\qquad t_0=CT_i/Q

    Exact for 0 <= t <= t_0, which is `end_time`; the relative accuracy holds up to there.

    Source: energy balance of a body with constant capacity, integrated.

    >>> body = CoolingToZeroConstantCapacity(C=100.0, T_i=300.0, Q=50.0)
    >>> body.end_time, float(body.solution(270.0)["T"])
    (600.0, 165.0)
    """

    name: ClassVar[str] = "cooling-to-zero-constant-capacity"

    C: float = parameter("J/(m^2 K)", "total heat capacity at T_0", above=0)
    T_i: float = parameter("K", "initial temperature", above=0)
    Q: float = parameter("W/m^2", "heat extracted", above=0)

    @classmethod
    def from_scene(cls, scene: SceneView) -> Parameters:
        return {"C": scene.capacity, "T_i": scene.temperature, "Q": -scene.heat_supply}

    @property
    def end_time(self) -> float:
        """Time [s] at which the temperature is zero."""
        return self.C * self.T_i / self.Q

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        return {"T": self.T_i * ((self.end_time - t) / self.end_time)}


class CoolingToZero(CoolingToZeroConstantCapacity):
    r"""Constant heat extraction with quadratic energies; zero temperature is reached with infinite slope.

    .. math:: T=T_i\sqrt{1-t/t_0},\qquad t_0=\frac{CT_i^2}{2T_0Q}

    Exact for 0 <= t <= t_0, which is `end_time`; the relative accuracy holds up to there.

    Source: Sauer, Duong & Mandadapu (2021), quadratic energy, integrated.

    >>> body = CoolingToZero(C=100.0, T_0=300.0, T_i=300.0, Q=50.0)
    >>> body.end_time, f"{body.solution(270.0)['T']:.10f}"
    (300.0, '94.8683298051')
    """

    name: ClassVar[str] = "cooling-to-zero"

    T_0: float = parameter("K", "reference temperature", above=0)

    @classmethod
    def from_scene(cls, scene: SceneView) -> Parameters:
        return {**super().from_scene(scene), "T_0": scene.constant("T_0")}

    @property
    def end_time(self) -> float:
        """Time [s] at which the temperature is zero."""
        return self.C * self.T_i**2 / (2.0 * self.T_0 * self.Q)

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        return {"T": self.T_i * np.sqrt((self.end_time - t) / self.end_time)}
