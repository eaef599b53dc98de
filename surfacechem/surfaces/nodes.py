"""Sums over the inner of two surfaces: nodes that gather around the nearest point.

Around the foot of a point at the distance h the parameters are x = h sinh t. In t the distance has no feature narrower
than pi/2 whatever h is, so that Gauss's rule on pieces of a fixed length converges geometrically for any gap; the
number of pieces grows with the logarithm of size over gap. Feet that are as near lie within 2 h, so that one is enough.

Source: Johnston & Elliott (2005), doi 10.1002/nme.1208, for the substitution.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from surfacechem.contracts.terms import PairEnergy
from surfacechem.errors import InputError
from surfacechem.surfaces.projection import FIRST, POLE, Array, Projection, Surface
from surfacechem.surfaces.shapes import Cavity, Cylinder, Plane, Sphere

PIECE = 2.0
"""Length of a piece in t."""

Sums = tuple[Array, Array, Array]
"""For n outer points: energy (n,), force on them (n, 3), and inner points weighted by what acts on each (n, 3)."""


@dataclass(frozen=True)
class Grid:
    """Points (n, k, 3) of the inner surface for each of n points of the outer one, with their areas (n, k)."""

    outer: Array
    x: Array
    area: Array

    def sums(self, law: Callable[[Array], Array]) -> Sums:
        """Sums over the inner points of a law of the distance."""
        away = self.outer[:, None] - self.x
        r = np.sqrt(np.einsum("nkc,nkc->nk", away, away))
        psi, slope = np.moveaxis(law(r), -1, 0)
        strength = -slope * self.area / r
        push, theirs = (np.einsum("nk,nkc->nc", strength, arms) for arms in (away, self.x))
        return np.einsum("nk,nk->n", psi, self.area), push, theirs


@dataclass(frozen=True)
class Circles:
    """Circles around the feet (n, 3) on a plane, a sphere or a cavity: their distances from the outer points, how far
    they lie below the feet, and their areas, each (n, k).
    """

    foot: Array
    normal: Array
    gap: Array
    r: Array
    down: Array
    area: Array

    def sums(self, law: Callable[[Array], Array]) -> Sums:
        """Sums over the circles of a law of the distance; what points across the normal cancels."""
        psi, slope = np.moveaxis(law(self.r), -1, 0)
        strength = -slope * self.area / self.r
        whole, lower = strength.sum(axis=-1)[:, None], np.einsum("nk,nk->n", strength, self.down)[:, None]
        push = (whole * self.gap[:, None] + lower) * self.normal
        return np.einsum("nk,nk->n", psi, self.area), push, whole * self.foot - lower * self.normal


def is_round(surface: Surface) -> bool:
    """Whether all points of a surface are alike: a plane without end, a whole sphere or cavity."""
    shape = surface.shape
    if type(shape) is Plane:
        return shape.length is None and shape.width is None
    return type(shape) is Sphere or (type(shape) is Cavity and shape.angle == math.pi)


@lru_cache
def _legendre(order: int) -> tuple[Array, Array]:
    return np.polynomial.legendre.leggauss(order)


def gauss(edges: Array, order: int) -> tuple[Array, Array]:
    """Nodes and weights (n, k) of Gauss's rule on each of the pieces between edges (n, pieces + 1)."""
    x, w = _legendre(order)
    length = np.diff(edges)[..., None]
    at = edges[:, :-1, None] + length * (x + 1) / 2
    return at.reshape(len(edges), -1), (length * w / 2).reshape(len(edges), -1)


def piece_edges(low: Array, high: Array, grain: Array | float = math.inf) -> Array:
    """Edges (n, k) of pieces from parameters ``low`` to ``high`` (n,) around zero, none longer than PIECE, nor than the
    grain of the surface, in units of the scale of sinh t.
    """
    if np.all(np.isinf(grain)):
        count = max(1, math.ceil(float(np.max(high - low)) / PIECE))
        return low[:, None] + (high - low)[:, None] * np.arange(count + 1) / count
    return np.concatenate([-_outward(-low, grain)[:, ::-1], _outward(high, grain)[:, 1:]], axis=1)


def _outward(end: Array, grain: Array | float) -> Array:
    """Edges from zero to an end; where that is reached sooner than elsewhere the last pieces are empty."""
    found = [np.zeros_like(end)]
    while np.any(found[-1] < end):
        wide = np.minimum(found[-1] + PIECE, np.arcsinh(np.sinh(found[-1]) + grain))
        found.append(np.minimum(wide, end))
    return np.stack(found, axis=1)


def inner_nodes(surface: Surface, x: Array, order: int, law: PairEnergy, rtol: float) -> Grid | Circles:
    """Nodes around the nearest point of the surface for each point (n, 3); InputError where it is in the body."""
    found = surface.nearest(x)
    if not np.all(found.gap > 0):
        raise InputError("the surfaces overlap; a law of pairs of points holds outside only.")
    # Of what lies beyond, a part of size (h / reach)^(decay - 2) of all is missed.
    reach = np.minimum(found.gap * (rtol / 10) ** (-1 / (law.decay - 2)), law.cutoff)
    if is_round(surface):
        return _around(surface, found, reach, order, law.cutoff)
    low, high = np.transpose(surface.shape.span)
    _, x_u, x_v = surface.derivatives(found.at, FIRST)
    axes = []
    for k, tangent in enumerate((x_u, x_v)):
        at, size = found.at[:, k], np.maximum(np.linalg.norm(tangent, axis=-1), POLE)
        ends = (at - math.pi, at + math.pi) if surface.shape.closed[k] else (low[k], high[k])
        scale, far = found.gap / size, reach / size
        below, above = np.minimum(at - ends[0], far), np.minimum(ends[1] - at, far)
        grain = surface.shape.grain / size / scale
        edges = piece_edges(-np.arcsinh(below / scale), np.arcsinh(above / scale), grain)
        t, w = gauss(edges, order)
        axes.append((at[:, None] + scale[:, None] * np.sinh(t), w * scale[:, None] * np.cosh(t)))
    (u, du), (v, dv) = axes
    u, v = np.broadcast_arrays(u[:, :, None], v[:, None, :])
    points, x_u, x_v = surface.derivatives(np.stack([u, v], axis=-1).reshape(len(x), -1, 2), FIRST)
    E, F, G = (np.einsum("nkc,nkc->nk", *pair) for pair in ((x_u, x_u), (x_u, x_v), (x_v, x_v)))
    return Grid(x, points, np.sqrt(E * G - F**2) * (du[:, :, None] * dv[:, None, :]).reshape(len(x), -1))


def _around(surface: Surface, near: Projection, reach: Array, order: int, cutoff: float) -> Circles:
    """Circles around the feet on a plane, a sphere or a cavity, up to where a law ends."""
    shape, gap = surface.shape, near.gap
    bent = 0.0 if isinstance(shape, Plane) else getattr(shape, "bulge") / getattr(shape, "R")  # noqa: B009
    end = np.minimum(reach, math.pi / abs(bent)) if bent else reach
    if math.isfinite(cutoff):
        # The circle at which the distance is the cut-off, from the law of cosines.
        chord = np.maximum(cutoff**2 - gap**2, 0.0) / (1 + bent * gap)
        end = 2 / abs(bent) * np.arcsin(np.minimum(np.sqrt(chord) * abs(bent) / 2, 1)) if bent else np.sqrt(chord)
    t, w = gauss(piece_edges(np.zeros_like(gap), np.arcsinh(end / gap)), order)
    s = gap[:, None] * np.sinh(t)
    ds = w * np.hypot(gap[:, None], s)
    chord = 2 * np.sin(bent * s / 2) / bent if bent else s
    out = np.sin(bent * s) / bent if bent else s
    # The law of cosines for a chord, which does not cancel next to the foot.
    r = np.sqrt(gap[:, None] ** 2 + (1 + bent * gap[:, None]) * chord**2)
    return Circles(near.point, near.normal, gap, r, bent * chord**2 / 2, 2 * math.pi * np.abs(out) * ds)


def alike_around(outer: Surface, inner: Surface) -> bool:
    """Whether nothing changes around a common axis."""
    axial = all(s.shape.tilt == 0 for s in (outer, inner)) and outer.shape.about_axis
    return axial and (inner.shape.about_axis or is_round(inner))


def alike_along(outer: Surface, inner: Surface) -> bool:
    """Whether nothing changes along a cylinder over something without end in its direction."""
    shapes = outer.shape, inner.shape
    if not isinstance(shapes[0], Cylinder) or any(shape.tilt for shape in shapes):
        return False
    same = shapes[0].turn == shapes[1].turn and isinstance(shapes[1], Cylinder) and shapes[1].length is None
    return same or (is_round(inner) and isinstance(shapes[1], Plane))
