"""Quadrature nodes on the inner of two surfaces that are graded towards the foot of an outer point.

Around the foot of a point at the distance h the parameters are x = h sinh t. In t the distance has no feature narrower
than pi/2 for any h, so Gauss quadrature on pieces of a fixed length converges geometrically for any gap; the number of
pieces grows with the logarithm of size over gap. Equally near feet lie within 2 h, so one is enough.

Source: Johnston & Elliott (2005), doi 10.1002/nme.1208, for the substitution.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np

from surfacechem.contracts.terms import Shape
from surfacechem.surfaces.projection import FIRST_ORDER, POLE, Array, Projection, Surface
from surfacechem.surfaces.shapes import Cavity, Cylinder, Indices, Plane, Sphere

ORDERS = (4, 6, 9, 13, 18, 25)
"""Gauss points on each piece, increased until two successive rules agree."""

LAST_LEVEL = len(ORDERS) - 1
"""Level of the last order; inside, rules of higher levels have pieces of half the length."""

PIECE_LENGTH = 2.0
"""Length of a piece in t."""

Kernel = Callable[[Array], Array]
"""Function from n distances to energy and slope of a law, shape (n, 2)."""

Sums = tuple[Array, Array]
"""For n outer points: energy (n,), and force on them (n, 3)."""


@dataclass(frozen=True)
class Grid:
    """Points (k, 3) of the inner surface with areas (k,), each with the index of its outer point (n, 3).

    If all outer points have equally many, the shapes are (n, k / n, 3) and (n, k / n), without an index.
    """

    outer: Array
    owner: Indices | None
    x: Array
    area: Array

    def sums(self, law: Kernel) -> Sums:
        """Return the sums of a law of the distance over the inner points."""
        owner = self.owner
        away = (self.outer[:, None] if owner is None else self.outer[owner]) - self.x
        r = np.sqrt(np.einsum("...c,...c", away, away))
        psi, slope = np.moveaxis(law(r), -1, 0)
        strength = -slope * self.area / r
        if owner is None:
            return np.einsum("nk,nk->n", psi, self.area), np.einsum("nk,nkc->nc", strength, away)
        parts = np.concatenate([(psi * self.area)[:, None], strength[:, None] * away], axis=-1)
        energy, *push = (np.asarray(np.bincount(owner, part, len(self.outer)), np.float64) for part in parts.T)
        return energy, np.stack(push, axis=-1)


def is_round(shape: Shape) -> bool:
    """True if all points of a shape are equivalent: an infinite plane, a whole sphere or cavity."""
    if type(shape) is Plane:
        return shape.length is None and shape.width is None
    return type(shape) is Sphere or (type(shape) is Cavity and shape.angle == math.pi)


@dataclass(frozen=True)
class Extent:
    """Range of laws of the distance.

    Their least power of decay, their cutoff (infinite without one), and distances (increasing) [m] at which they have
    kinks, the cutoff being the last.
    """

    decay: float
    cutoff: float
    kinks: tuple[float, ...]

    def levels(self, shape: Shape) -> list[float]:
        """Return the gaps to a shape [m] at which its nearest or farthest point is at a kink: sums have kinks there."""
        found = set(self.kinks)
        if isinstance(shape, Sphere) and is_round(shape):
            found |= {shape.bulge * (kink - 2 * shape.R) for kink in self.kinks}
        return sorted(gap for gap in found if gap > 0)


_legendre = lru_cache(np.polynomial.legendre.leggauss)


def order_of(level: int) -> int:
    """Return the number of points of a level's rule."""
    return ORDERS[min(level, LAST_LEVEL)]


def gauss_rule(edges: Array, order: int) -> tuple[Array, Array]:
    """Return nodes and weights (n, k) of Gauss quadrature on each of the pieces between edges (n, pieces + 1)."""
    x, w = _legendre(order)
    length = np.diff(edges)[..., None]
    at = edges[:, :-1, None] + length * (x + 1) / 2
    return at.reshape(len(edges), -1), (length * w / 2).reshape(len(edges), -1)


def piece_edges(low: Array, high: Array, grain: Array | float = math.inf, level: int = 0) -> Array:
    """Return edges (n, k) of pieces from parameters ``low`` to ``high`` (n,) around zero.

    None is longer than PIECE_LENGTH or than the grain of the surface, in units of the scale of sinh t; shorter ones for
    levels above the last.
    """
    if np.all(np.isinf(grain)):
        return divided(np.stack([low, high], axis=1), level)
    parts = 2 ** max(level - LAST_LEVEL, 0)
    return np.concatenate([-_outward(-low, grain, parts)[:, ::-1], _outward(high, grain, parts)[:, 1:]], axis=1)


def divided(edges: Array, level: int) -> Array:
    """Divide pieces between edges (n, m) so that none exceeds PIECE_LENGTH; into shorter ones above the last level."""
    found = [edges[:, :1]]
    for low, high in pairwise(edges.T):
        parts = math.ceil(float(np.max(high - low)) / PIECE_LENGTH) * 2 ** max(level - LAST_LEVEL, 0)
        found.append(low[:, None] + (high - low)[:, None] * np.arange(1, parts + 1) / max(parts, 1))
    return np.concatenate(found, axis=1)


def _outward(end: Array, grain: Array | float, parts: int) -> Array:
    """Return edges of pieces, or of parts of them, from zero to an end; trailing pieces of a shorter row are empty."""
    found = [np.zeros_like(end)]
    while np.any(found[-1] < end):
        wide = np.minimum(found[-1] + PIECE_LENGTH / parts, np.arcsinh(np.sinh(found[-1]) + grain / parts))
        found.append(np.minimum(wide, end))
    return np.stack(found, axis=1)


def tensor_grid(surface: Surface, x: Array, found: Projection, reach: Array, level: int) -> Grid:
    """Return nodes of a surface around the foot of each point (n, 3), up to a reach (n,)."""
    low, high = np.transpose(surface.shape.span)
    _, x_u, x_v = surface.derivatives(found.at, FIRST_ORDER)
    axes = []
    for k, tangent in enumerate((x_u, x_v)):
        at, size = found.at[:, k], np.maximum(np.linalg.norm(tangent, axis=-1), POLE)
        ends = (at - math.pi, at + math.pi) if surface.shape.closed[k] else (low[k], high[k])
        scale, far = found.gap / size, _parameter_bound(surface, k, size, reach + found.gap)
        below, above = np.minimum(at - ends[0], far), np.minimum(ends[1] - at, far)
        grain = surface.shape.grain / size / scale
        edges = piece_edges(-np.arcsinh(below / scale), np.arcsinh(above / scale), grain, level)
        t, w = gauss_rule(edges, order_of(level))
        axes.append((at[:, None] + scale[:, None] * np.sinh(t), w * scale[:, None] * np.cosh(t)))
    (u, du), (v, dv) = axes
    u, v = np.broadcast_arrays(u[:, :, None], v[:, None, :])
    points, areas = surface.elements(np.stack([u, v], axis=-1).reshape(len(x), -1, 2))
    return Grid(x, None, points, areas * (du[:, :, None] * dv[:, None, :]).reshape(len(x), -1))


def _parameter_bound(surface: Surface, k: int, tangent: Array, distance: Array) -> Array:
    """Return a bound on the parameter difference from a foot, along a direction with tangents of this length (n,), for
    points within a distance (n,) of the foot.
    """
    shape = surface.shape
    # An angle may differ by up to pi times distance over tangent; other parameters are lengths.
    return math.pi * distance / tangent if shape.closed[k] or isinstance(shape, Sphere) else distance


def alike_around(outer: Surface, inner: Surface) -> bool:
    """True if nothing varies around a common axis."""
    axial = all(s.shape.tilt == 0 for s in (outer, inner)) and outer.shape.about_axis
    return axial and (inner.shape.about_axis or is_round(inner.shape))


def alike_along(outer: Surface, inner: Surface) -> bool:
    """True if nothing varies along a cylinder over a surface that is infinite in its direction."""
    shapes = outer.shape, inner.shape
    if not isinstance(shapes[0], Cylinder) or any(shape.tilt for shape in shapes):
        return False
    same = shapes[0].turn == shapes[1].turn and isinstance(shapes[1], Cylinder) and shapes[1].length is None
    return same or (is_round(inner.shape) and isinstance(shapes[1], Plane))
