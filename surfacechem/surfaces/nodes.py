"""Sums over the inner of two surfaces: nodes that gather around the nearest point.

Around the foot of a point at the distance h the parameters are x = h sinh t. In t the distance has no feature narrower
than pi/2 whatever h is, so that Gauss's rule on pieces of a fixed length converges geometrically for any gap; the
number of pieces grows with the logarithm of size over gap. Feet that are as near lie within 2 h, so that one is enough.

Source: Johnston & Elliott (2005), doi 10.1002/nme.1208, for the substitution.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np

from surfacechem.contracts.terms import PairEnergy
from surfacechem.errors import InputError
from surfacechem.surfaces.projection import FIRST, POLE, Array, Projection, Surface
from surfacechem.surfaces.shapes import Cavity, Cylinder, Plane, Sphere
from surfacechem.tolerances import NEGLIGIBLE, TINY

ORDERS = (4, 6, 9, 13, 18, 25)
"""Points of Gauss's rule on each piece, more and more of them until two in a row agree."""

LAST = len(ORDERS) - 1
"""Level of the last of the orders; rules of higher levels inside have pieces that are half as long."""

LEFT_OUT = 0.01
"""Part of the accuracy that is far away of one surface, and not summed."""

PIECE = 2.0
"""Length of a piece in t."""

CHEBYSHEV, BETWEEN = np.cos(np.pi * (np.arange(24) + 0.5) / 24), np.array([-0.97, -0.52, 0.14, 0.71])
"""Gaps for a polynomial of their logarithm, and places between them at which it is tried."""

Kernel = Callable[[Array], Array]
"""Energy of a law and its slope (n, 2) at n distances."""

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
    """Circles around the feet on a plane, a sphere or a cavity: their distances from points at the gaps (n,), how far
    they lie below the feet, and their areas, each (n, k).
    """

    gap: Array
    r: Array
    down: Array
    area: Array

    def profile(self, law: Callable[[Array], Array]) -> Array:
        """Sums (n, 3) over the circles: energy, strength of what acts along the arms, and that times how low they are;
        what points across the normal cancels.
        """
        psi, slope = np.moveaxis(law(self.r), -1, 0)
        strength = -slope * self.area / self.r
        return np.stack([(psi * self.area).sum(-1), strength.sum(-1), (strength * self.down).sum(-1)], axis=-1)


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


def piece_edges(low: Array, high: Array, grain: Array | float = math.inf, level: int = 0) -> Array:
    """Edges (n, k) of pieces from parameters ``low`` to ``high`` (n,) around zero, none longer than PIECE, nor than the
    grain of the surface, in units of the scale of sinh t; shorter ones for a level above the last.
    """
    if np.all(np.isinf(grain)):
        return divided(np.stack([low, high], axis=1), level)
    parts = 2 ** max(level - LAST, 0)
    return np.concatenate([-_outward(-low, grain, parts)[:, ::-1], _outward(high, grain, parts)[:, 1:]], axis=1)


def divided(edges: Array, level: int) -> Array:
    """Edges (n, k) of pieces between given ones (n, m), none longer than PIECE; shorter ones for a level above the
    last.
    """
    found = [edges[:, :1]]
    for low, high in pairwise(edges.T):
        parts = math.ceil(float(np.max(high - low)) / PIECE) * 2 ** max(level - LAST, 0)
        found.append(low[:, None] + (high - low)[:, None] * np.arange(1, parts + 1) / max(parts, 1))
    return np.concatenate(found, axis=1)


def _outward(end: Array, grain: Array | float, parts: int) -> Array:
    """Edges of parts of pieces from zero to an end; where that is reached sooner the last pieces are empty."""
    found = [np.zeros_like(end)]
    while np.any(found[-1] < end):
        wide = np.minimum(found[-1] + PIECE / parts, np.arcsinh(np.sinh(found[-1]) + grain / parts))
        found.append(np.minimum(wide, end))
    return np.stack(found, axis=1)


@dataclass(frozen=True)
class Extent:
    """How far laws of the distance reach: the power with which they fall off at least, the distance at which they end,
    infinite where they do not, and distances (increasing) [m] at which they bend, their end the last of them.
    """

    decay: float
    cutoff: float
    bends: tuple[float, ...]

    def levels(self, surface: Surface) -> list[float]:
        """Gaps to a surface [m] at which sums over it bend: there its nearest or its farthest point is at a bend."""
        shape, found = surface.shape, set(self.bends)
        if is_round(surface) and not isinstance(shape, Plane):
            bulge, R = getattr(shape, "bulge"), getattr(shape, "R")  # noqa: B009
            found |= {bulge * (bend - 2 * R) for bend in self.bends}
        return sorted(gap for gap in found if gap > 0)


def extents(laws: Sequence[PairEnergy]) -> dict[Extent, list[int]]:
    """Which laws have nodes of their own: those that bend or end at distances of their own, all others together."""
    found: dict[tuple[float, ...], list[int]] = {}
    for k, law in enumerate(laws):
        bends = law.kinks.get("r", ())
        places = {float(r) for r in (bends if isinstance(bends, Sequence) else (bends,))}
        if math.isfinite(law.cutoff):
            places = {r for r in places if r < law.cutoff} | {law.cutoff}
        found.setdefault((law.cutoff, *sorted(places)), []).append(k)
    return {
        Extent(min(laws[k].decay for k in which), cutoff, tuple(bends)): which
        for (cutoff, *bends), which in found.items()
    }


def inner_sums(
    surface: Surface, x: Array, laws: Sequence[PairEnergy], kernels: Sequence[Kernel], level: int, rtol: float
) -> tuple[list[Sums], int]:
    """Sums over the inner surface for points (n, 3), of each law with its kernel, and the number of pairs of points.

    InputError where a point is in the body.
    """
    near = surface.nearest(x)
    if not np.all(near.gap > 0):
        raise InputError("the surfaces overlap; a law of pairs of points holds outside only.")
    found: dict[int, Sums] = {}
    pairs = surface.search * len(x)
    for extent, which in extents(laws).items():
        sums, more = _sums_of(surface, x, near, [kernels[k] for k in which], extent, level, rtol)
        found |= dict(zip(which, sums, strict=True))
        pairs += more
    return [found[k] for k in range(len(laws))], pairs


def _sums_of(
    surface: Surface, x: Array, near: Projection, kernels: Sequence[Kernel], extent: Extent, level: int, rtol: float
) -> tuple[list[Sums], int]:
    """The same for laws of one extent."""
    # Of what lies beyond, a part of size (h / reach)^(decay - 2) of all is missed.
    farther = (rtol * LEFT_OUT) ** (-1 / (extent.decay - 2))
    if not is_round(surface):
        nodes = _inner_grid(surface, x, near, np.minimum(near.gap * farther, extent.cutoff), level)
        return [nodes.sums(one) for one in kernels], nodes.area.size
    pairs = 0

    def profiles(gaps: Array) -> Array:
        nonlocal pairs
        circles = _around(surface, gaps, farther, extent, level)
        pairs += circles.area.size
        return np.concatenate([circles.profile(one) for one in kernels], axis=-1)

    found, sums = tabulated(profiles, near.gap, rtol, extent.levels(surface)), []
    for energy, whole, lower in np.split(found.T, len(kernels)):
        push = (whole * near.gap + lower)[:, None] * near.normal
        sums.append((energy, push, whole[:, None] * near.point - lower[:, None] * near.normal))
    return sums, pairs


def tabulated(function: Callable[[Array], Array], gaps: Array, rtol: float, levels: Sequence[float] = ()) -> Array:
    """A function (n, k) of many gaps by polynomials of their logarithm, on pieces that are short enough; it bends at
    some ``levels``.
    """
    at, x = np.log(gaps), np.concatenate([CHEBYSHEV, BETWEEN])
    pieces = max(1, math.ceil(np.ptp(at)))
    inside = [math.log(gap) for gap in levels if at.min() < math.log(gap) < at.max()]
    edges = np.sort([*np.linspace(at.min(), at.max(), pieces + 1), *inside])
    home = np.clip(np.searchsorted(edges, at, side="right") - 1, 0, len(edges) - 2)
    waiting = [(np.flatnonzero(home == k), edges[k], edges[k + 1]) for k in range(len(edges) - 1)]
    parts = []
    while waiting:
        which, low, high = waiting.pop()
        if len(which) < 2 * len(x):
            parts += [(which, function(gaps[which]))] if len(which) else []
            continue
        middle, half = (low + high) / 2, max((high - low) / 2, TINY)
        known = function(np.exp(middle + half * x))
        fit = np.polynomial.chebyshev.chebfit(CHEBYSHEV, known[: len(CHEBYSHEV)], len(CHEBYSHEV) - 1)
        missed = np.polynomial.chebyshev.chebval(BETWEEN, fit).T - known[len(CHEBYSHEV) :]
        if np.all(np.abs(missed) <= rtol * NEGLIGIBLE * np.abs(known).max(axis=0)):
            z = np.clip((at[which] - middle) / half, -1, 1)
            parts.append((which, np.polynomial.chebyshev.chebval(z, fit).T))
        else:
            below = at[which] < middle
            waiting += [(which[below], low, middle), (which[~below], middle, high)]
    found = np.empty((len(gaps), parts[0][1].shape[-1]))
    for which, values in parts:
        found[which] = values
    return found


def _inner_grid(surface: Surface, x: Array, found: Projection, reach: Array, level: int) -> Grid:
    """Nodes of a surface around the nearest point for each point (n, 3), up to a reach (n,)."""
    low, high = np.transpose(surface.shape.span)
    _, x_u, x_v = surface.derivatives(found.at, FIRST)
    axes = []
    for k, tangent in enumerate((x_u, x_v)):
        at, size = found.at[:, k], np.maximum(np.linalg.norm(tangent, axis=-1), POLE)
        ends = (at - math.pi, at + math.pi) if surface.shape.closed[k] else (low[k], high[k])
        scale, far = found.gap / size, reach / size
        below, above = np.minimum(at - ends[0], far), np.minimum(ends[1] - at, far)
        grain = surface.shape.grain / size / scale
        edges = piece_edges(-np.arcsinh(below / scale), np.arcsinh(above / scale), grain, level)
        t, w = gauss(edges, ORDERS[min(level, LAST)])
        axes.append((at[:, None] + scale[:, None] * np.sinh(t), w * scale[:, None] * np.cosh(t)))
    (u, du), (v, dv) = axes
    u, v = np.broadcast_arrays(u[:, :, None], v[:, None, :])
    points, x_u, x_v = surface.derivatives(np.stack([u, v], axis=-1).reshape(len(x), -1, 2), FIRST)
    E, F, G = (np.einsum("nkc,nkc->nk", *pair) for pair in ((x_u, x_u), (x_u, x_v), (x_v, x_v)))
    return Grid(x, points, np.sqrt(E * G - F**2) * (du[:, :, None] * dv[:, None, :]).reshape(len(x), -1))


def _around(surface: Surface, gap: Array, farther: float, extent: Extent, level: int) -> Circles:
    """Circles around the feet on a plane, a sphere or a cavity of points at gaps (n,), up to where laws end or, where
    they do not, so many times ``farther`` than the gap.
    """
    shape = surface.shape
    bent = 0.0 if isinstance(shape, Plane) else getattr(shape, "bulge") / getattr(shape, "R")  # noqa: B009
    last = math.pi / abs(bent) if bent else math.inf
    ends = [np.zeros_like(gap)]
    for bend in extent.bends:
        # The circle at which the distance is that of a bend, from the law of cosines.
        chord = np.sqrt(np.maximum(bend - gap, 0.0) * (bend + gap) / np.maximum(1 + bent * gap, TINY))
        ends.append(2 / abs(bent) * np.arcsin(np.minimum(chord * abs(bent) / 2, 1)) if bent else chord)
    if math.isinf(extent.cutoff):
        ends.append(np.minimum(gap * farther, last))
    edges = divided(
        np.minimum.accumulate(np.arcsinh(np.stack(ends[::-1], axis=1) / gap[:, None]), axis=1)[:, ::-1], level
    )
    t, w = gauss(edges, ORDERS[min(level, LAST)])
    s = gap[:, None] * np.sinh(t)
    ds = w * np.hypot(gap[:, None], s)
    chord = 2 * np.sin(bent * s / 2) / bent if bent else s
    out = np.sin(bent * s) / bent if bent else s
    # The law of cosines for a chord, which does not cancel next to the foot.
    r = np.sqrt(gap[:, None] ** 2 + (1 + bent * gap[:, None]) * chord**2)
    return Circles(gap, r, bent * chord**2 / 2, 2 * math.pi * np.abs(out) * ds)


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
