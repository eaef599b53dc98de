"""Debonding along a falling line, with a partial unloading on the way."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.errors import InputError
from surfacechem.references.base import Array, Parameters, Reference, SceneView


class BilinearDebonding(Reference):
    r"""Bonds that break along a falling line of traction as the gap opens, is closed, and opens again for good.

    .. math:: t_n=\phi E_bg_n,\qquad
        \phi=\frac{g_c}{\hat g}\,\frac{g_f-\hat g}{g_f-g_c},\quad g_c=\frac{t_{max}}{E_b}\le\hat g\le g_f,\qquad
        D=\tfrac12(t_{max}\hat g-\hat tg_c)-H_r(1-\phi)

    with the largest gap so far :math:`\hat g`, and what is dissipated until then, D: the area that loading and
    unloading enclose less what the broken bonds keep. In all it is :math:`\tfrac12t_{max}g_f-H_r`. The gap
    opens at a constant speed to :math:`g_1`, closes at the same speed, and opens again. Any t >= 0.

    Source: bilinear law as in Camanho & Davila (2002), NASA/TM-2002-211737, integrated.

    >>> zone = BilinearDebonding(t_max=8e7, E_b=1e15, g_f=24e-6, H_r=2.0, g_1=8e-6, speed=1e-6)
    >>> " ".join(f"{x:.9f}" for x in zone.solution([4.0, 12.0, 40.0])["heat"])
    '155.357859532 315.872909699 958.000000000'
    """

    name: ClassVar[str] = "bilinear-debonding"

    t_max: float = parameter("Pa", "tensile strength", above=0)
    E_b: float = parameter("Pa/m", "stiffness of complete bonding", above=0)
    g_f: float = parameter("m", "gap at which the last bonds break", above=0)
    H_r: float = parameter("J/m^2", "heat released by complete bonding", default=0.0)
    g_1: float = parameter("m", "gap at which it is first closed again", at_least=0)
    speed: float = parameter("m/s", "speed of the gap", above=0)

    @classmethod
    def from_scene(cls, scene: SceneView) -> Parameters:
        own = {name: scene.reaction(name) for name in ("t_max", "E_b", "g_f")}
        return {**own, "H_r": scene.potential("H_r")}

    def __post_init__(self) -> None:
        """Refuse a line that does not fall."""
        super().__post_init__()
        if self.g_f <= self.peak:
            raise InputError(f"{self.name}: g_f must be above t_max / E_b = {self.peak!r} m.")

    @property
    def peak(self) -> float:
        """Gap [m] of the largest traction."""
        return self.t_max / self.E_b

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        back, again = 2.0 * self.g_1 - self.speed * t, self.speed * t - 2.0 * self.g_1
        g = np.where(self.speed * t <= self.g_1, self.speed * t, np.maximum(back, again))
        largest = np.clip(np.maximum(g, np.where(self.speed * t > self.g_1, self.g_1, 0.0)), self.peak, self.g_f)
        left = (self.g_f - largest) / (self.g_f - self.peak)
        phi = self.peak / largest * left
        lost = (largest - self.peak) * self.g_f / (largest * (self.g_f - self.peak))  # 1 - phi
        heat = 0.5 * self.t_max * (largest - self.peak * left) - self.H_r * lost
        return {"g_n": g, "phi": phi, "t_n": phi * self.E_b * g, "heat": heat}
