"""An exponential cohesive zone in series with a spring: its branches, and where they end."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from surfacechem.references._roots import increasing_root
from surfacechem.references.base import Array
from surfacechem.references.semenov_fold import scaled_rise

SERIES_LIMIT = 0.1


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
    """Stiffness [Pa/m] of the spring, strength [Pa] of the zone and the gap [m] at which it is reached."""

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
        """Where the bodies snap apart: the smaller x with x exp(-x) = k g_0 / t_max, g = g_0 (1 + x)."""
        x = float(scaled_rise(np.array([self.severity]))[0])
        g, w, t = self._state(x)
        after = float(self.gap(np.array([w]), self._state(self._larger())[0], math.inf)[0])
        return self._fold(g, w, t, after)

    def closing(self) -> Fold:
        """Where they snap together: the larger such x."""
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
