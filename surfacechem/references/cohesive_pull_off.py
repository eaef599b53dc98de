"""Quasi-static pull-off of bodies that an exponential cohesive zone holds together."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.errors import InputError
from surfacechem.references._cohesive import Fold, SpringAndZone
from surfacechem.references.base import Array, Reference


class CohesivePullOff(Reference):
    r"""Elastic bodies, held together by an exponential cohesive zone, are pulled apart at constant speed.

    .. math:: k(w-g_n)=t_{max}\frac{g_n}{g_0}e^{1-g_n/g_0},\qquad
        g_{off}=g_0\Big[1-W_0\Big(-\frac{kg_0}{t_{max}}\Big)\Big],\quad
        g_{on}=g_0\Big[1-W_{-1}\Big(-\frac{kg_0}{t_{max}}\Big)\Big]

    Stable for every w iff :math:`kg_0/t_{max}\ge1/e`; otherwise the gap jumps, on opening from :math:`g_{off}`, on
    closing from :math:`g_{on}`, to the other branch at the same w. The heat is the drop of
    :math:`\tfrac12k(w-g_n)^2+\Psi`. Here :math:`w=w_i+\dot wt`, opening, from the closed branch. Both folds are good to
    rounding also where they meet.

    Source: Sauer, Duong & Mandadapu (2021), eq. ex:bt_czm with the sign of tension, with an elastic body.

    >>> bodies = CohesivePullOff(t_max=1e6, g_0=1e-8, k=1e13, w_dot=1e-8)
    >>> f"{bodies.opening.g:.9e} {bodies.opening.w:.9e} {bodies.opening.release:.9e} {bodies.closing.release:.9e}"
    '1.111832559e-08 1.105377225e-07 3.054240033e-02 1.000742319e-02'
    """

    name: ClassVar[str] = "cohesive-pull-off"

    t_max: float = parameter("Pa", "strength", above=0)
    g_0: float = parameter("m", "gap at the strength", above=0)
    k: float = parameter("Pa/m", "stiffness of the bodies", above=0)
    w_i: float = parameter("m", "initial far-field displacement", default=0.0, at_least=0)
    w_dot: float = parameter("m/s", "speed of the far field", at_least=0)

    def __post_init__(self) -> None:
        """Refuse what starts beyond the closed branch."""
        super().__post_init__()
        if not self.stable and self.w_i > self.opening.w:
            raise InputError(f"{self.name}: w_i must not be above the fold at {self.opening.w!r} m.")

    @property
    def bodies(self) -> SpringAndZone:
        """Spring and zone."""
        return SpringAndZone(self.k, self.t_max, self.g_0)

    @property
    def stable(self) -> bool:
        """Whether every displacement has one gap."""
        return self.bodies.severity >= 1.0

    @property
    def opening(self) -> Fold:
        """The jump on opening."""
        return self._if_unstable().opening()

    @property
    def closing(self) -> Fold:
        """The jump on closing."""
        return self._if_unstable().closing()

    def _if_unstable(self) -> SpringAndZone:
        if self.stable:
            raise InputError(f"{self.name}: stable for every displacement; there is no jump.")
        return self.bodies

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        w = self.w_i + self.w_dot * t
        if self.stable:
            g, heat = self.bodies.gap(w, 0.0, math.inf), np.zeros_like(w)
        else:
            fold, open_ = self.opening, w > self.opening.w
            closed = self.bodies.gap(np.minimum(w, fold.w), 0.0, fold.g)
            g = np.where(open_, self.bodies.gap(np.maximum(w, fold.w), self.closing.g, math.inf), closed)
            heat = np.where(open_, fold.release, 0.0)
        return {"w_n": w, "g_n": g, "t_n": self.bodies.traction(g), "heat": heat}
