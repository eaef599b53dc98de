"""The slow passage of an overdamped gap through the ghost of a fold."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.references._inversion import increasing_root
from surfacechem.references.base import Array, Parameters, Reference, SceneView
from surfacechem.references.cohesive_pull_off import SpringAndZone

GRID = 200
"""Gaps whose times give the first guess of the gap at a time."""

PANEL = 0.25
"""Length of a panel in arsinh of the distance from the fold; the poles of 1 / cosh are pi / 2 away, so that
16 Gauss points leave 25^-32."""

SERIES_LIMIT = 0.5
"""Up to here a series of 18 terms is exact: the next is 0.5^20 19 / 20! = 7e-24."""


class OverdampedPullOff(Reference):
    r"""Overdamped opening of a cohesive zone at a far-field displacement a little beyond its fold.

    .. math:: c\,\dot g_n=k(w_{off}+\delta w-g_n)-t_n(g_n),\qquad
        t\simeq\pi c\sqrt{\frac2{a\,k\,\delta w}},\quad a=-t_n''(g_{off})

    The time is an integral over the gap whose peak of width :math:`\sqrt{2k\delta w/a}` at the fold is resolved by
    :math:`g_n-g_{off}\propto\sinh`; the force is summed without cancellation, so that any :math:`\delta w` is met to
    rounding. Exact until half the way from the fold to the open gap, at `end_time`.

    Source: Sauer, Duong & Mandadapu (2021), eq. ex:bt_czm with the sign of tension; passage time of Strogatz, Nonlinear
    Dynamics and Chaos (1994), section 4.3.

    >>> gap = OverdampedPullOff(t_max=1e6, g_0=1e-8, k=1e13, c=2e5, delta_w=1.1e-15)
    >>> f"{gap.time(4e-8):.8e} {gap.asymptotic_time:.8e}"
    '9.50710596e-05 9.50681912e-05'
    """

    name: ClassVar[str] = "overdamped-pull-off"

    t_max: float = parameter("Pa", "strength", above=0)
    g_0: float = parameter("m", "gap at the strength", above=0)
    k: float = parameter("Pa/m", "stiffness of the bodies", above=0)
    c: float = parameter("Pa s/m", "damping", above=0)
    delta_w: float = parameter("m", "far-field displacement beyond the fold", above=0)
    g_i: float = parameter("m", "initial gap", default=0.0, at_least=0)

    @classmethod
    def from_scene(cls, scene: SceneView) -> Parameters:
        zone = {name: scene.potential(name) for name in ("t_max", "g_0")}
        dampers = [c for c in (scene.support("normal", name) for name in ("c_b", "c_g")) if c is not None]
        held = {"k": scene.support("normal", "k"), "c": sum(dampers) if dampers else None}
        return {**zone, **held, "g_i": scene.initial("g_n")}

    @property
    def bodies(self) -> SpringAndZone:
        """Spring and zone."""
        return SpringAndZone(self.k, self.t_max, self.g_0)

    @property
    def w(self) -> float:
        """Far-field displacement [m]."""
        return self.bodies.opening().w + self.delta_w

    @property
    def _x(self) -> float:
        return self.bodies.opening().g / self.g_0 - 1.0

    @property
    def width(self) -> float:
        """Width [m] of the bottleneck."""
        return math.sqrt(2.0 * self.k * self.delta_w / self._curvature)

    @property
    def _curvature(self) -> float:
        return self.t_max / self.g_0**2 * (1.0 - self._x) * math.exp(-self._x)

    @property
    def asymptotic_time(self) -> float:
        """Time [s] of the passage from far below to far above, for small delta_w."""
        return math.pi * self.c * math.sqrt(2.0 / (self._curvature * self.k * self.delta_w))

    @property
    def end_gap(self) -> float:
        """Gap [m] at `end_time`."""
        fold = self.bodies.opening()
        final = float(self.bodies.gap(np.array([self.w]), self.bodies.closing().g, math.inf)[0])
        return 0.5 * (fold.g + final)

    @property
    def end_time(self) -> float:
        """Time [s] until which the solution is stated."""
        return self.time(self.end_gap)

    def time(self, g: float) -> float:
        """The time [s] at which the gap is g."""
        return float(self._times(np.array([g]))[0])

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        low, high = np.full_like(t, self.g_i), np.full_like(t, self.end_gap)
        first, last = np.arcsinh((np.array([self.g_i, self.end_gap]) - self._x_gap) / self.width)
        grid = self._x_gap + self.width * np.sinh(np.linspace(first, last, GRID))
        guess = np.where(t > 0, np.interp(t, self._times(grid), grid), low)
        g = increasing_root(lambda x: (self._times(x), self.c / self._force(x - self._x_gap)), t, low, high, guess)
        return {"g_n": g, "t_n": self.bodies.traction(g), "v_n": self._force(g - self._x_gap) / self.c}

    @property
    def _x_gap(self) -> float:
        return self.bodies.opening().g

    def _times(self, g: Array) -> Array:
        """Integral of c dg / force over panels in arsinh of the distance from the fold."""
        start, ends = math.asinh((self.g_i - self._x_gap) / self.width), np.arcsinh((g - self._x_gap) / self.width)
        panels = max(1, math.ceil(float(np.max(ends) - start) / PANEL))
        nodes, weights = np.polynomial.legendre.leggauss(16)
        edges = start + np.multiply.outer(ends - start, np.arange(panels) / panels)
        step = ((ends - start) / panels)[:, None, None]
        u = edges[:, :, None] + 0.5 * step * (1.0 + nodes)
        rates = self.c * self.width * np.cosh(u) / self._force(self.width * np.sinh(u))
        return np.asarray(np.sum(0.5 * step * weights * rates, axis=(1, 2)))

    def _force(self, distance: Array) -> Array:
        """Driving traction [Pa] at a distance from the gap of the fold."""
        y, x = distance / self.g_0, self._x
        near = np.where(np.abs(y) < SERIES_LIMIT, y, 0.0)
        coefficients = [0.0, 0.0, *((-1) ** n * (n - 1 - x) / math.factorial(n) for n in range(2, 20))]
        series = np.polynomial.polynomial.polyval(near, coefficients)
        far = -(1.0 + x) * np.expm1(-y) - x * y - y * np.exp(-y)
        shape = np.where(np.abs(y) < SERIES_LIMIT, series, far)
        return np.asarray(self.k * self.delta_w + self.t_max * math.exp(-x) * shape)
