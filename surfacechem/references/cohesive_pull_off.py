"""Quasi-static pull-off of bodies that an exponential cohesive zone holds together, and what its snap heats."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.errors import InputError
from surfacechem.references._bodies import UniformBody
from surfacechem.references._inversion import increasing_root
from surfacechem.references.base import Array, Parameters, Reference, SceneView
from surfacechem.references.semenov_fold import scaled_rise

SERIES_LIMIT = 0.1
"""Up to here a series of 16 terms is exact: the next is 0.1^18 / 18 against 0.1^2 / 2."""


@dataclass(frozen=True)
class Fold:
    """A state in which the quasi-static gap is lost, and the one it jumps to at the same displacement."""

    g: float
    w: float
    t: float
    g_after: float
    t_after: float
    release: float
    """Energy [J/m^2] that the jump turns into heat."""


@dataclass(frozen=True)
class SpringAndZone:
    """An exponential cohesive zone in series with a spring: its branches, and where they end.

    Stiffness [Pa/m] of the spring, strength [Pa] of the zone and the gap [m] at which it is reached.
    """

    k: float
    t_max: float
    g_0: float

    @property
    def severity(self) -> float:
        """Stiffness over the steepest softening; from one on every displacement has one gap."""
        return math.e * self.k * self.g_0 / self.t_max

    def traction(self, g: Array) -> Array:
        """Traction [Pa] of the zone."""
        return np.asarray(self.t_max * g / self.g_0 * np.exp(1.0 - g / self.g_0))

    def energy(self, g: float, w: float) -> float:
        """Energy [J/m^2] of spring and zone."""
        u = g / self.g_0
        return 0.5 * self.k * (w - g) ** 2 - self.t_max * self.g_0 * (1.0 + u) * math.exp(1.0 - u)

    def gap(self, w: Array, low: float, high: float) -> Array:
        """The gap [m] at displacements w, on a stable branch between two gaps."""
        lower = np.minimum(np.full_like(w, low), w)
        return increasing_root(self._displacement, w, lower, np.maximum(np.minimum(w, high), lower))

    def _displacement(self, g: Array) -> tuple[Array, Array]:
        slope = self.t_max / self.g_0 * (1.0 - g / self.g_0) * np.exp(1.0 - g / self.g_0)
        return g + self.traction(g) / self.k, 1.0 + slope / self.k

    def opening(self) -> Fold:
        """The snap apart: the smaller x with x exp(-x) = k g_0 / t_max, g = g_0 (1 + x)."""
        x = float(scaled_rise(np.array([self.severity]))[0])
        g, w, t = self._state(x)
        after = float(self.gap(np.array([w]), self._state(self._larger())[0], math.inf)[0])
        return self._fold(g, w, t, after)

    def closing(self) -> Fold:
        """The snap together: the larger such x."""
        g, w, t = self._state(self._larger())
        after = float(self.gap(np.array([w]), 0.0, self._state(float(scaled_rise(np.array([self.severity]))[0]))[0])[0])
        return self._fold(g, w, t, after)

    def _state(self, x: float) -> tuple[float, float, float]:
        g, t = self.g_0 * (1.0 + x), self.t_max * (1.0 + x) * math.exp(-x)
        return g, g + t / self.k, t

    def _fold(self, g: float, w: float, t: float, after: float) -> Fold:
        release = self.energy(g, w) - self.energy(after, w)
        return Fold(g, w, t, after, float(self.traction(np.array(after))), release)

    def _larger(self) -> float:
        distance = np.array([-math.log(self.severity)])
        low, high = np.sqrt(2.0 * distance), distance + np.sqrt(distance * (distance + 2.0))
        return 1.0 + float(increasing_root(_beyond_the_fold, distance, low, high)[0])


def _beyond_the_fold(v: Array) -> tuple[Array, Array]:
    """The function v - ln(1 + v), by its series where the two would cancel, and its slope."""
    near = np.minimum(v, SERIES_LIMIT)
    series = sum((-1) ** n * near**n / n for n in range(2, 18))
    return np.where(v < SERIES_LIMIT, series, v - np.log1p(v)), v / (1.0 + v)


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

    @classmethod
    def from_scene(cls, scene: SceneView) -> Parameters:
        zone = {name: scene.potential(name) for name in ("t_max", "g_0")}
        far = {"k": scene.support("normal", "k"), "w_i": scene.initial("w_n"), "w_dot": scene.ramp("w_n")}
        return {**zone, **far}

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
        """True if every displacement has one gap."""
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


class CohesivePullOffHeating(CohesivePullOff, UniformBody):
    r"""Cohesive pull-off in perfect thermal contact: what the jump releases heats the bodies.

    .. math:: T^2=T_i^2+\frac{2T_0}C\,\big[\tfrac12k(w-g_n)^2+\Psi\big]_{after}^{before}

    Quadratic energies; a strength that does not depend on temperature, so that the gap is that of the pull-off without
    heat and the temperature changes at the jump only.

    Source: Sauer, Duong & Mandadapu (2021), eq. ex:bt_czm with the sign of tension, and the quadratic energy.

    >>> bodies = CohesivePullOffHeating(t_max=1e6, g_0=1e-8, k=1e13, w_dot=1e-8, C=2e-4, T_0=300.0, T_i=310.0)
    >>> f"{bodies.solution(20.0)['T']:.9f}"
    '433.274971584'
    """

    name: ClassVar[str] = "cohesive-pull-off-heating"

    @classmethod
    def from_scene(cls, scene: SceneView) -> Parameters:
        return {**super().from_scene(scene), **UniformBody.from_scene(scene)}

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        mechanics = super().quantities(t)
        return {**mechanics, "T": self.heated(np.asarray(mechanics["heat"]))}
