"""Surfaces in space and their closest-point projection.

Body 1 lies below its surface. Body 2 is the mirror image of such a body, moved up by the approach d: at d = 0 the
highest point of one touches the lowest of the other.

Source: Sauer, Duong & Mandadapu (2021), section 2 with eq. e:gap.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfacechem.contracts.terms import Shape
from surfacechem.expressions import symengine
from surfacechem.surfaces.shapes import Indices, Sphere
from surfacechem.tolerances import CLOSED_GUARD, EQUAL, FEW_EPS, TINY, ULPS

Array = NDArray[np.float64]

MOST_NEWTON_STEPS = 100
"""Most steps of Newton's method; some ten are usual."""

MOST_HALVINGS = 16
"""Most halvings of a step."""

SEARCH_COST = 500
"""Cost of a projection without a closed form, in pairs of points."""

POLE = CLOSED_GUARD
"""Least parameter next to the pole of a surface of revolution, where directions have no length."""

FIRST_ORDER, SECOND_ORDER = 3, 6
"""Numbers of derivatives up to an order: x; x_u, x_v; x_uu, x_uv, x_vv."""

AREA_ALONE = 0
"""Argument for points and areas per parameters only."""


@lru_cache(maxsize=64)
def _compiled(shape: Shape, count: int) -> Callable[[Array], Array]:
    """Return the point of a shape with its derivatives, or its area per parameters, as machine code."""
    u, v = symengine.symbols("u v")
    orders = [(i - j, j) for i in range(3) for j in range(i + 1)][: count or FIRST_ORDER]
    formulas: list[Any] = []
    for i, j in orders:
        for part in map(symengine.sympify, shape.point(u, v)):
            for symbol in (*[u] * i, *[v] * j):
                part = symengine.diff(part, symbol)
            formulas.append(part)
    if count == AREA_ALONE:
        across = cross(*np.array(formulas[3:]).reshape(2, 3))
        formulas = [*formulas[:3], symengine.sqrt(sum(part**2 for part in across))]
    compiled: Callable[[Array], Array] = symengine.Lambdify([u, v], formulas, cse=True, backend="llvm")
    return compiled


class Projection(NamedTuple):
    """Closest points of a surface; arrays over the projected points.

    ``at`` are the parameters (..., 2), ``gap`` is the distance along ``direction``, negative inside the body [m],
    ``beyond`` the distance of the points beyond each edge along the surface (..., edges) [m]. The direction is the
    normal, but at an edge or a tip that from the closest point.
    """

    at: Array
    point: Array
    normal: Array
    direction: Array
    gap: Array
    beyond: Array


@dataclass(frozen=True)
class Surface:
    """The surface of a body in space; the ``upper`` body is mirrored and moved up by ``approach`` [m]."""

    shape: Shape
    upper: bool = False
    approach: float = 0.0

    @cached_property
    def axes(self) -> Array:
        """Rotation, for the upper body with a reflection, from the coordinates of the shape to space."""
        (s, c), (sn, cs) = ((np.sin(angle), np.cos(angle)) for angle in (self.shape.turn, self.shape.tilt))
        tilted = np.array([[cs, 0, sn], [0, 1, 0], [-sn, 0, cs]]) @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        return np.asarray(np.diag([1.0, 1.0, -1.0]) @ tilted if self.upper else tilted)

    def derivatives(self, at: Array, count: int) -> Array:
        """Return points and derivatives (count, ..., 3) at parameters (..., 2)."""
        if self.shape.derivatives is not None:
            own = self.shape.derivatives(at[..., 0], at[..., 1], count)
        else:
            table = _compiled(self.shape, count)(np.ascontiguousarray(at))
            own = np.moveaxis(table.reshape(*at.shape[:-1], count, 3), -2, 0)
        found: Array = own @ self.axes.T
        found[0, ..., 2] += self.approach
        return found

    @property
    def search(self) -> int:
        """Cost of a projection, in points."""
        return 1 if self.shape.foot is not None else SEARCH_COST

    def elements(self, at: Array) -> tuple[Array, Array]:
        """Return points (..., 3) and areas per parameters (...)."""
        if self.shape.derivatives is not None:
            x, x_u, x_v = self.derivatives(at, FIRST_ORDER)
            return x, np.linalg.norm(cross(x_u, x_v), axis=-1)
        table = _compiled(self.shape, AREA_ALONE)(np.ascontiguousarray(at)).reshape(*at.shape[:-1], 4)
        return table[..., :3] @ self.axes.T + [0.0, 0.0, self.approach], table[..., 3]

    def normals(self, derivatives: Array) -> Array:
        """Return unit normals (..., 3) out of the body."""
        outward = cross(derivatives[1], derivatives[2]) * (-1 if self.upper else 1)
        return np.asarray(outward / np.linalg.norm(outward, axis=-1, keepdims=True))

    def nearest(self, x: ArrayLike) -> Projection:
        """Project points (..., 3)."""
        x = np.asarray(x, dtype=float)
        own = (x - [0.0, 0.0, self.approach]) @ self.axes
        if self.shape.foot is not None:
            at = np.clip(self.shape.foot(own), *np.transpose(self.shape.span))
        else:
            which, starts = self.shape.starts(own.reshape(-1, 3))
            places = x.reshape(-1, 3)[which]
            found = self._search(places, starts)
            distances = np.linalg.norm(places - self.derivatives(found, FIRST_ORDER)[0], axis=-1)
            order = np.lexsort((distances, which))
            at = found[order[np.unique(which[order], return_index=True)[1]]].reshape(*x.shape[:-1], 2)
        at = self.off_pole(at)
        D = self.derivatives(at, FIRST_ORDER)
        normal, away = self.normals(D), x - D[0]
        # Beyond an edge the distance is not along the normal, which then determines only the side.
        size = np.linalg.norm(away, axis=-1)
        side = _dot(away, normal)
        # A point behind the surface but beyond an edge is next to the body, not inside it.
        beyond, at_edge = np.empty((*at.shape[:-1], len(self.edges))), np.zeros(at.shape[:-1], dtype=bool)
        for j, (k, edge, end) in enumerate(self.edges):
            left, length = edge * (end - at[..., k]), np.linalg.norm(D[1 + k], axis=-1)
            beyond[..., j] = np.where(left > POLE, -left * length, edge * _dot(away, D[1 + k]) / length)
            at_edge |= left <= (POLE if self.shape.about_axis and edge < 0 else 0.0)
        gap = np.where((side < 0) & ~np.any(beyond > 0, axis=-1), -size, size)
        off = (at_edge & (size > 0))[..., None]
        direction = np.where(off, np.divide(away, gap[..., None], out=np.zeros_like(away), where=off), normal)
        return Projection(at, D[0], normal, direction, gap, beyond)

    @cached_property
    def bounds(self) -> tuple[Array, Array]:
        """Least and largest parameters (2,) of a search; closed parameters have no bounds."""
        low, high = np.transpose(self.shape.span)
        low = np.where(self.shape.closed, -np.inf, low) + (POLE if self.shape.about_axis else 0.0)
        return low, np.where(self.shape.closed, np.inf, high)

    def off_pole(self, at: Array) -> Array:
        """Move parameters (..., 2) at a pole, where directions have no length, next to it."""
        begins_at_pole = self.shape.about_axis and self.shape.span[0][0] == 0
        return np.asarray(np.maximum(at, [POLE, -np.inf])) if begins_at_pole else at

    @cached_property
    def edges(self) -> list[tuple[int, int, float]]:
        """Edges of the surface: index of the parameter, side (-1 below, +1 above), and its value there.

        A tip is an edge, a pole is not.
        """
        found = []
        for k, ends in enumerate(self.shape.span):
            for side, end in zip((-1, 1), ends, strict=True):
                smooth = self.shape.rises != 1 if side < 0 else isinstance(self.shape, Sphere) and end == math.pi
                pole = self.shape.about_axis and smooth
                if not (pole or self.shape.closed[k] or math.isinf(end)):
                    found.append((k, side, end))
        return found

    def _search(self, places: Array, starts: Array) -> Array:
        """Return parameters (n, 2) of the closest points of some (n, 3) by Newton's method with halved steps."""
        low, high = self.bounds

        def value(at: Array, which: Indices) -> Array:
            return np.asarray(np.linalg.norm(places[which] - self.derivatives(at, FIRST_ORDER)[0], axis=-1))

        def step(at: Array, which: Indices) -> Array:
            D = self.derivatives(at, SECOND_ORDER)
            away = places[which] - D[0]
            slope = np.stack([-_dot(away, D[1]), -_dot(away, D[2])], axis=-1)
            E, F, G = _dot(D[1], D[1]), _dot(D[1], D[2]), _dot(D[2], D[2])
            # Second derivatives of half the squared distance.
            hessian = E - _dot(away, D[3]), F - _dot(away, D[4]), G - _dot(away, D[5])
            move = newton_step(slope, hessian, (E, F, G), at <= low, at >= high)
            if self.shape.about_axis:
                move[..., 1] = 0.0  # keep the angle about the axis
            return move

        return descended(np.clip(starts, low, high), low, high, value, step)


def _dot(a: Array, b: Array) -> Array:
    return np.asarray(np.einsum("...i,...i", a, b))


def cross(a: Array, b: Array) -> Array:
    """Return vector products (..., 3); for few vectors in a tenth of the time of NumPy's."""
    (a0, a1, a2), (b0, b1, b2) = ((v[..., 0], v[..., 1], v[..., 2]) for v in (a, b))
    return np.stack([a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0], axis=-1)


def descended(
    at: Array,
    low: Array,
    high: Array,
    value: Callable[[Array, Indices], Array],
    step: Callable[[Array, Indices], Array],
    noise: float = 0.0,
    gain: float = 0.0,
) -> Array:
    """Return parameters (n, 2) between bounds that minimise values.

    Steps are halved unless they lower the value, up to ``noise``; a search ends if a halved step gains less than a part
    ``gain``. Values and steps are evaluated only for searches that have not ended.
    """
    found, which = at.copy(), np.arange(len(at))
    for _ in range(MOST_NEWTON_STEPS):
        here = found[which]
        now, move, length = value(here, which), step(here, which), np.ones(len(which))
        # Close to the end values agree up to roundoff, while steps still become shorter.
        most = now + np.maximum(noise, FEW_EPS * np.abs(now))
        tried = np.clip(here + move, low, high)
        after = value(tried, which)
        for _ in range(MOST_HALVINGS):
            worse = after > most
            if not worse.any():
                break
            length[worse] /= 2
            tried[worse] = np.clip(here + length[:, None] * move, low, high)[worse]
            after[worse] = value(tried[worse], which[worse])
        found[which] = np.where((after > most)[:, None], here, tried)
        moving = np.any(np.abs(found[which] - here) > ULPS * np.abs(here), axis=1)
        # At a kink of the values steps would be halved endlessly.
        moving &= (length == 1) | (now - after > gain * np.abs(now))
        which = which[moving]
        if len(which) == 0:
            break
    return found


def newton_step(
    slope: Array, hessian: tuple[Array, Array, Array], metric: tuple[Array, Array, Array], lowest: Any, highest: Any
) -> Array:
    """Return Newton's step (..., 2) from a slope (..., 2) and second derivatives uu, uv, vv; none across an edge.

    Where these are not convex the metric replaces them.
    """
    held = (lowest & (slope > 0)) | (highest & (slope < 0))
    slope = np.where(held, 0.0, slope)
    # At an edge only the component along it counts.
    E, F, G = metric[0], np.where(held.any(axis=-1), 0.0, metric[1]), metric[2]
    a, b, c = (
        np.where(held[..., 0], E, hessian[0]),
        np.where(held.any(axis=-1), 0.0, hessian[1]),
        np.where(held[..., 1], G, hessian[2]),
    )
    convex = (a * c - b**2 > EQUAL * (E * G - F**2)) & (a > 0)
    a, b, c = (np.where(convex, mine, usual) for mine, usual in ((a, E), (b, F), (c, G)))
    det = np.maximum(a * c - b**2, TINY)
    raised = np.stack([b * slope[..., 1] - c * slope[..., 0], b * slope[..., 0] - a * slope[..., 1]], axis=-1)
    return np.asarray(raised / det[..., None])
