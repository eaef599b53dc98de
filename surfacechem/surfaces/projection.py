"""Surfaces in space and their closest-point projection.

Body 1 lies below its surface. Body 2 is the mirror image of such a body, moved up by the approach d: at d = 0 the
highest point of one touches the lowest of the other.

Source: Sauer, Duong & Mandadapu (2021), section 2 with eq. e:gap; Konyukhov & Schweizerhof (2013), Computational
Contact Mechanics, doi 10.1007/978-3-642-31531-2, for rates and the uniqueness of a projection.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfacechem.contracts.terms import Shape
from surfacechem.errors import InputError
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

FIRST_ORDER, SECOND_ORDER, THIRD_ORDER = 3, 6, 10
"""Numbers of derivatives up to an order: x; x_u, x_v; x_uu, x_uv, x_vv; and four of third order."""

AREA_ALONE = 0
"""Argument for points and areas per parameters only."""


@lru_cache(maxsize=64)
def _compiled(shape: Shape, count: int) -> Callable[[Array], Array]:
    """Return the point of a shape with its derivatives, or its area per parameters, as machine code."""
    import symengine

    u, v = symengine.symbols("u v")
    orders = [(i - j, j) for i in range(4) for j in range(i + 1)][: count or FIRST_ORDER]
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


@dataclass(frozen=True)
class Projection:
    """Closest points of a surface; arrays over the projected points.

    ``at`` are the parameters (..., 2), ``gap`` is the distance along ``direction``, negative inside the body [m],
    ``beyond`` the distance of the points beyond each edge along the surface (..., edges) [m]. The direction is the
    normal, but at an edge or a tip that from the closest point. After a search, ``minima`` are the indices (m,) of the
    points of all searches, in one flat row, and the parameters (m, 2) that these have found.
    """

    surface: Surface
    at: Array
    point: Array
    normal: Array
    direction: Array
    gap: Array
    beyond: Array
    minima: tuple[Indices, Array] | None

    @cached_property
    def tied(self) -> NDArray[np.bool_]:
        """Mask of the points with another equally close point of the surface."""
        shape, size = self.surface.shape, np.abs(self.gap)
        x = self.point + self.gap[..., None] * self.direction
        D = self.surface.derivatives(self.at, SECOND_ORDER)
        found = _degenerate(D, self.normal * _dot(x - self.point, self.normal)[..., None])
        if shape.about_axis:
            # For a point on the axis all points around it are equally close.
            own, around = (x - [0.0, 0.0, self.surface.approach]) @ self.surface.axes, np.linalg.norm(D[2], axis=-1)
            found |= (np.hypot(own[..., 0], own[..., 1]) < EQUAL * around) & (around > EQUAL * size)
        if self.minima is not None:
            which, places = self.minima
            rival, size = self.surface.derivatives(places, FIRST_ORDER)[0], size.reshape(-1)[which]
            x, nearest = (points.reshape(-1, 3)[which] for points in (x, self.point))
            near = np.linalg.norm(x - rival, axis=-1) <= size * (1 + EQUAL)
            near &= np.linalg.norm(rival - nearest, axis=-1) > np.sqrt(EQUAL) * size
            found.reshape(-1)[which[near]] = True
        return found


@dataclass(frozen=True)
class Curvature:
    """Mean [1/m] and Gaussian curvature [1/m^2], positive where the body bulges, and their rates."""

    mean: Array
    gaussian: Array
    mean_rate: Array
    gaussian_rate: Array


@dataclass(frozen=True)
class Rates:
    """Rates of a projection while point and surface move.

    Of the parameters, of the gap [m/s], of the gap vector from the surface to the point [m/s], of the normal [1/s], and
    of the curvature there.
    """

    at: Array
    gap: Array
    vector: Array
    normal: Array
    curvature: Curvature


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

    def derivatives(self, at: Array, count: int = THIRD_ORDER) -> Array:
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
        minima = None
        if self.shape.foot is not None:
            at = self.shape.foot(own)
        else:
            which, starts = self.shape.starts(own.reshape(-1, 3))
            places = x.reshape(-1, 3)[which]
            found = self._search(places, starts)
            distances = np.linalg.norm(places - self.derivatives(found, FIRST_ORDER)[0], axis=-1)
            order, minima = np.lexsort((distances, which)), (which, found)
            at = found[order[np.unique(which[order], return_index=True)[1]]].reshape(*x.shape[:-1], 2)
        at = self.off_pole(at)
        D = self.derivatives(at, FIRST_ORDER)
        normal, away = self.normals(D), x - D[0]
        # Beyond an edge the distance is not along the normal, which then determines only the side.
        size = np.linalg.norm(away, axis=-1)
        side = _dot(away, normal)
        # A point behind the surface but beyond an edge is next to the body, not inside it.
        beyond, at_edge = self._beyond(at, away, D[1:3])
        gap = np.where((side < 0) & ~np.any(beyond > 0, axis=-1), -size, size)
        off = (at_edge & (size > 0))[..., None]
        direction = np.where(off, np.divide(away, gap[..., None], out=np.zeros_like(away), where=off), normal)
        return Projection(self, at, D[0], normal, direction, gap, beyond, minima)

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

    def _beyond(self, at: Array, away: Array, tangents: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Return the distances beyond each edge [m], (..., edges), of points that are ``away`` from their feet, and a
        mask of the feet at an edge or a tip.
        """
        found, at_edge = np.empty((*at.shape[:-1], len(self.edges))), np.zeros(at.shape[:-1], dtype=bool)
        for j, (k, side, end) in enumerate(self.edges):
            left, size = side * (end - at[..., k]), np.linalg.norm(tangents[k], axis=-1)
            found[..., j] = np.where(left > POLE, -left * size, side * _dot(away, tangents[k]) / size)
            at_edge |= left <= (POLE if self.shape.about_axis and side < 0 else 0.0)
        return found, at_edge

    def _search(self, places: Array, starts: Array) -> Array:
        """Return parameters (n, 2) of the closest points of some (n, 3) by Newton's method with halved steps."""
        low, high = self.bounds

        def value(at: Array, which: Indices) -> Array:
            return np.asarray(np.linalg.norm(places[which] - self.derivatives(at, FIRST_ORDER)[0], axis=-1))

        def step(at: Array, which: Indices) -> Array:
            D = self.derivatives(at, SECOND_ORDER)
            away = places[which] - D[0]
            slope = np.stack([-_dot(away, D[1]), -_dot(away, D[2])], axis=-1)
            metric, hessian = _forms(D, away)
            move = newton_step(slope, hessian, metric, at <= low, at >= high)
            if self.shape.about_axis:
                move[..., 1] = 0.0  # keep the angle about the axis
            return move

        return descended(np.clip(starts, low, high), low, high, value, step)

    def curvature(self, at: Array, rate: Array | None = None) -> Curvature:
        """Return the curvature at parameters (..., 2), and its rate if they change at a ``rate``."""
        D = self.derivatives(at)
        E, F, G = _metric(D)
        outward = cross(D[1], D[2]) * (-1 if self.upper else 1)
        size = np.linalg.norm(outward, axis=-1)
        n = outward / size[..., None]
        # The product rule, with rates of the derivatives along the path of the parameters.
        p, q = np.moveaxis(np.zeros_like(at) if rate is None else rate, -1, 0)[..., None]
        turned = [p * D[k] + q * D[k + 1] for k in (3, 4, 6, 7, 8)]  # rates of x_u, x_v, x_uu, x_uv, x_vv
        swing = (cross(turned[0], D[2]) + cross(D[1], turned[1])) * (-1 if self.upper else 1)
        n_dot = (swing - n * _dot(n, swing)[..., None]) / size[..., None]
        L, M, N = (-_dot(n, D[k]) for k in (3, 4, 5))
        L_dot, M_dot, N_dot = (-_dot(n_dot, D[k]) - _dot(n, turned[k - 1]) for k in (3, 4, 5))
        E_dot, G_dot = 2 * _dot(D[1], turned[0]), 2 * _dot(D[2], turned[1])
        F_dot = _dot(D[1], turned[1]) + _dot(turned[0], D[2])
        area, area_dot = E * G - F**2, E_dot * G + E * G_dot - 2 * F * F_dot
        mean, gaussian = (E * N - 2 * F * M + G * L) / (2 * area), (L * N - M**2) / area
        top = E_dot * N + E * N_dot - 2 * (F_dot * M + F * M_dot) + G_dot * L + G * L_dot
        bottom = L_dot * N + L * N_dot - 2 * M * M_dot
        return Curvature(mean, gaussian, (top / 2 - mean * area_dot) / area, (bottom - gaussian * area_dot) / area)

    def rates(self, x: ArrayLike, moves: ArrayLike, shift: ArrayLike = (0, 0, 0), spin: ArrayLike = (0, 0, 0)) -> Rates:
        """Return the rates of the projection of points with velocities ``moves`` [m/s].

        The surface moves by ``shift`` [m/s] and turns about the origin by ``spin`` [rad/s]. InputError if the closest
        point is not unique.
        """
        x, moves, spin = (np.asarray(item, dtype=float) for item in (x, moves, spin))
        found = self.nearest(x)
        if np.any(found.tied):
            raise InputError("two points of the surface are equally near, so that their distance has no rate.")
        D = self.derivatives(found.at, SECOND_ORDER)
        relative = moves - np.asarray(shift, dtype=float) - cross(spin, x)
        # At a pole, replaced by a point next to it, the axis counts as its normal.
        at = self._rates(found.at, D, found.gap[..., None] * found.direction, relative)
        glide = at[..., :1] * D[1] + at[..., 1:] * D[2]
        vector = relative - glide + cross(spin, x - D[0])
        # Weingarten: the normal turns with the second form.
        slopes = np.stack([_dot(D[3], found.normal), _dot(D[4], found.normal), _dot(D[5], found.normal)])
        E, F, G = _metric(D)
        first = slopes[0] * at[..., 0] + slopes[1] * at[..., 1]
        second = slopes[1] * at[..., 0] + slopes[2] * at[..., 1]
        area = (E * G - F**2)[..., None]
        turned = (G * first - F * second)[..., None] * D[1] + (E * second - F * first)[..., None] * D[2]
        normal = -turned / area + cross(spin, found.normal)
        return Rates(at, _dot(relative, found.direction), vector, normal, self.curvature(found.at, at))

    def _rates(self, at: Array, D: Array, away: Array, relative: Array) -> Array:
        """Return the rates of the parameters of closest points, for relative velocities of points ``away`` from
        there.
        """
        low, high = np.transpose(self.shape.span)
        low = low + (POLE if self.shape.about_axis else 0.0)
        slopes = np.stack([_dot(away, D[k]) for k in (1, 2)], axis=-1)
        sizes = np.linalg.norm(away, axis=-1)[..., None] * np.moveaxis(np.linalg.norm(D[1:3], axis=-1), 0, -1)
        # The foot of a point beyond an edge or a tip stays there.
        held = ((at <= low) & (slopes < -EQUAL * sizes)) | ((at >= high) & (slopes > EQUAL * sizes))
        held &= ~np.array(self.shape.closed)
        if self.shape.about_axis:
            # At a tip the angle is degenerate.
            held[..., 1] |= held[..., 0] & (at[..., 0] <= POLE)
        _, (a, b, c) = _forms(D, away)
        a, c = np.where(held[..., 0], 1.0, a), np.where(held[..., 1], 1.0, c)
        b = np.where(held.any(axis=-1), 0.0, b)
        along, across = (np.where(held[..., k], 0.0, _dot(relative, D[k + 1])) for k in range(2))
        det = a * c - b**2
        return np.stack([(c * along - b * across) / det, (a * across - b * along) / det], axis=-1)


def _dot(a: Array, b: Array) -> Array:
    return np.asarray(np.einsum("...i,...i", a, b))


def cross(a: Array, b: Array) -> Array:
    """Return vector products (..., 3); for few vectors in a tenth of the time of NumPy's."""
    (a0, a1, a2), (b0, b1, b2) = ((v[..., 0], v[..., 1], v[..., 2]) for v in (a, b))
    return np.stack([a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0], axis=-1)


def _metric(D: Array) -> tuple[Array, Array, Array]:
    return _dot(D[1], D[1]), _dot(D[1], D[2]), _dot(D[2], D[2])


def _degenerate(D: Array, away: Array) -> NDArray[np.bool_]:
    """Return a mask of points at which normals meet, so that many points are closest."""
    (E, F, G), (a, b, c) = _forms(D, away)
    # Eigenvalues of the second in terms of the first, 1 - distance * curvature, vanish there.
    area = E * G - F**2
    ratio, trace = (a * c - b**2) / area, (E * c + G * a - 2 * F * b) / area
    return np.asarray((ratio <= EQUAL) & (np.abs(ratio) <= EQUAL * np.maximum(np.abs(trace), 1)))


def _forms(D: Array, away: Array) -> tuple[tuple[Array, Array, Array], tuple[Array, Array, Array]]:
    """Return the metric, and the second derivatives of half the squared distance, each uu, uv, vv."""
    E, F, G = _metric(D)
    return (E, F, G), (E - _dot(away, D[3]), F - _dot(away, D[4]), G - _dot(away, D[5]))


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
