"""Sums of laws of the distance over the inner of two surfaces, and their quadrature nodes.

On a surface whose points are all equivalent they are sums over circles around the foot of a point, else over nodes that
are graded towards the foot. Around the foot of a point at the distance h the parameters are x = h sinh t. In t the
distance has no feature narrower than pi/2 for any h, so Gauss quadrature on pieces of a fixed length converges
geometrically for any gap; the number of pieces grows with the logarithm of size over gap. Equally near feet lie within
2 h, so one is enough.

For laws with kinks or a cutoff the nodes are along rays from the foot, cut at the distances of these. The rays go to
the edges of the surface, or at most to the cutoff, in parameters without a pole. Along a ray nodes are graded towards
its start, and along edges towards the closest point.

Source: Johnston & Elliott (2005), doi 10.1002/nme.1208, for the substitution; Duffy (1982), doi 10.1137/0719090, for
the rays; Saye (2015), doi 10.1137/140966290, for the cuts.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import lru_cache
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from surfacechem.contracts.terms import PairEnergy, Shape
from surfacechem.errors import InputError
from surfacechem.expressions import Expression, symengine
from surfacechem.surfaces.projection import FIRST_ORDER, POLE, Array, Projection, Surface
from surfacechem.surfaces.shapes import Cavity, Cylinder, Indices, Plane, Sphere
from surfacechem.tolerances import NEGLIGIBLE, TINY

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


class Grid(NamedTuple):
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


class Extent(NamedTuple):
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
        scale, far = found.gap / size, reach + found.gap
        if surface.shape.closed[k] or isinstance(surface.shape, Sphere):
            # An angle may differ by up to pi times distance over tangent; other parameters are lengths.
            far = math.pi * far / size
        below, above = np.minimum(at - ends[0], far), np.minimum(ends[1] - at, far)
        grain = surface.shape.grain / size / scale
        edges = piece_edges(-np.arcsinh(below / scale), np.arcsinh(above / scale), grain, level)
        t, w = gauss_rule(edges, order_of(level))
        axes.append((at[:, None] + scale[:, None] * np.sinh(t), w * scale[:, None] * np.cosh(t)))
    (u, du), (v, dv) = axes
    u, v = np.broadcast_arrays(u[:, :, None], v[:, None, :])
    points, areas = surface.elements(np.stack([u, v], axis=-1).reshape(len(x), -1, 2))
    return Grid(x, None, points, areas * (du[:, :, None] * dv[:, None, :]).reshape(len(x), -1))


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


KINK_SAMPLES = 4
"""Parts of a piece between whose ends it is tested if the distance passes that of a kink."""


class Rays(NamedTuple):
    """Rays (k,) from the feet of n points (n, 3) to the edges of a surface.

    Each has the index of its point, start and end in coordinates (k, 2) without a pole, and twice the area of its
    triangle in these (k,).
    """

    surface: Surface
    points: Array
    gaps: Array
    owner: Indices
    start: Array
    end: Array
    area: Array

    def chosen(self, which: Indices) -> Rays:
        """Return some of the rays, with repetitions if an index occurs several times."""
        parts = {name: getattr(self, name)[which] for name in ("owner", "start", "end", "area")}
        return self._replace(**parts)

    @property
    def scale(self) -> Array:
        """Gap of each ray's point as a fraction of the ray (k,)."""
        ends = np.linalg.norm(self.at(np.ones(len(self.owner)))[0] - self.at(np.zeros(len(self.owner)))[0], axis=-1)
        return np.asarray(self.gaps[self.owner] / np.maximum(ends, TINY))

    def at(self, s: Array) -> tuple[Array, Array]:
        """Return points (k, ..., 3) at parts (k, ...) of the rays, and areas per area of the coordinates (k, ...)."""
        there = (slice(None), *[None] * (s.ndim - 1))
        w = self.start[there] + s[..., None] * (self.end - self.start)[there]
        if not has_pole(self.surface):
            return self.surface.elements(w)
        u = np.maximum(np.hypot(w[..., 0], w[..., 1]), POLE)
        x, areas = self.surface.elements(np.stack([u, np.arctan2(w[..., 1], w[..., 0])], axis=-1))
        return x, areas / u

    def distances(self, s: Array) -> Array:
        """Return the distances of the points at parts (k, ...) of the rays."""
        owners = self.points[self.owner][(slice(None), *[None] * (s.ndim - 1))]
        return np.asarray(np.linalg.norm(self.at(s)[0] - owners, axis=-1))


def has_pole(surface: Surface) -> bool:
    """True if the parameters of a surface are a distance from a pole and an angle about it."""
    return surface.shape.about_axis and not surface.shape.closed[0]


def ray_grid(surface: Surface, x: Array, near: Projection, reach: Array, extent: Extent, level: int) -> Grid:
    """Return nodes of a surface for points (n, 3) with their feet, up to a law's cutoff or a reach (n,)."""
    seen = np.flatnonzero(near.gap < extent.cutoff)
    if not len(seen):
        return Grid(x, seen, np.empty((0, 3)), np.empty(0))
    feet, gaps = near.at[seen], near.gap[seen]
    # Points within reach of a point are farther from its foot by at most the gap.
    edges = _circle if has_pole(surface) else _rectangle
    start, end, area = edges(surface, feet, gaps, reach[seen] + gaps, level)
    owner = np.repeat(np.arange(len(seen)), end.shape[1])
    rays = Rays(surface, x[seen], gaps, owner, start.reshape(-1, 2), end.reshape(-1, 2), area.ravel())
    rays = rays.chosen(np.flatnonzero(rays.area > 0))
    which, ends = _pieces(rays, extent, level)
    t, w = gauss_rule(ends, order_of(level))
    rays = rays.chosen(which)
    scale = rays.scale[:, None]
    s = scale * np.sinh(t)
    points, areas = rays.at(s)
    weights = areas * rays.area[:, None] * s * scale * np.cosh(t) * w
    return Grid(x, np.repeat(seen[rays.owner], t.shape[1]), points.reshape(-1, 3), weights.ravel())


def _pieces(rays: Rays, extent: Extent, level: int) -> tuple[Indices, Array]:
    """Return pieces of rays up to the cutoff: the ray of each, and its ends (m, 2) in t."""
    from scipy.optimize.elementwise import find_root

    scale = rays.scale
    whole = np.arcsinh(1 / scale)
    edges = divided(np.stack([np.zeros_like(whole), whole], axis=1), level)
    count = edges.shape[1] - 1
    samples = whole[:, None] * np.arange(count * KINK_SAMPLES + 1) / (count * KINK_SAMPLES)
    r = rays.distances(scale[:, None] * np.sinh(samples))
    rank, t = [np.repeat(np.arange(len(whole)), count + 1)], [edges.ravel()]
    for kink in extent.kinks:
        ray, k = np.nonzero((r[:, :-1] < kink) != (r[:, 1:] < kink))

        def above(t: Array, which: Indices, kink: float = kink) -> Array:
            return rays.chosen(which).distances(scale[which] * np.sinh(t)) - kink

        if not len(ray):
            continue
        found: Any = find_root(above, (samples[ray, k], samples[ray, k + 1]), args=(ray,))
        rank.append(ray)
        t.append(found.x)
    ray, places = np.concatenate(rank), np.concatenate(t)
    order = np.lexsort((places, ray))
    ray, places = ray[order], places[order]
    inside = (ray[1:] == ray[:-1]) & (places[1:] > places[:-1])
    which, ends = ray[:-1][inside], np.stack([places[:-1], places[1:]], axis=1)[inside]
    seen = rays.chosen(which).distances(scale[which] * np.sinh(ends.mean(axis=1))) < extent.cutoff
    return which[seen], ends[seen]


def _rectangle(surface: Surface, feet: Array, gaps: Array, far: Array, level: int) -> tuple[Array, Array, Array]:
    """Return rays (n, k) to a rectangle of parameters around each foot: starts, ends, and twice their areas."""
    lengths = np.linalg.norm(surface.derivatives(feet, 3)[1:], axis=-1)
    low, high = np.transpose(surface.shape.span)
    sides = []
    for k in range(2):
        if surface.shape.closed[k]:
            sides.append((np.full(len(feet), -math.pi), np.full(len(feet), math.pi)))
        else:
            sides.append((-np.minimum(feet[:, k] - low[k], far), np.minimum(high[k] - feet[:, k], far)))
    ends, areas = [], []
    for k in range(2):
        for side in sides[k]:
            # Along a side the integrand varies on the scale of the distance from the foot, or of the gap.
            unit = np.maximum(np.abs(side) * lengths[k], gaps) / lengths[1 - k]
            edges = divided(np.stack([np.arcsinh(end / unit) for end in sides[1 - k]], axis=1), level)
            t, w = gauss_rule(edges, order_of(level))
            along = unit[:, None] * np.sinh(t)
            to = np.broadcast_to(side[:, None], along.shape), along
            ends.append(np.stack(to if k == 0 else to[::-1], axis=-1))
            areas.append(np.abs(side)[:, None] * unit[:, None] * np.cosh(t) * w)
    end = np.concatenate(ends, axis=1) + feet[:, None]
    return np.broadcast_to(feet[:, None], end.shape), end, np.concatenate(areas, axis=1)


def _circle(surface: Surface, feet: Array, gaps: Array, far: Array, level: int) -> tuple[Array, Array, Array]:
    """Return rays (n, k) to a circle around the pole, or around each foot where the edge is far away."""
    length = np.linalg.norm(surface.derivatives(feet, 3)[1], axis=-1)
    (_, edge), _ = surface.shape.span
    angle = feet[:, 1]
    start = feet[:, :1] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    # Angles from the pole are not lengths, but few in all: rays go to the edge.
    beyond = np.zeros(len(feet), dtype=bool) if isinstance(surface.shape, Sphere) else edge - feet[:, 0] > far
    radius = np.where(beyond, far, edge)
    middle = np.where(beyond[:, None], start, 0.0)
    left = np.where(beyond, radius, radius - feet[:, 0])
    unit = np.maximum(left, gaps / length) / radius
    end = np.arcsinh(math.pi / unit)
    t, w = gauss_rule(divided(np.stack([-end, np.zeros_like(end), end], axis=1), level), order_of(level))
    turn = angle[:, None] + unit[:, None] * np.sinh(t)
    out = radius[:, None, None] * np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    along = np.stack([-out[..., 1], out[..., 0]], axis=-1)
    ends = middle[:, None] + out
    arms = ends - start[:, None]
    area = np.abs(arms[..., 0] * along[..., 1] - arms[..., 1] * along[..., 0]) * unit[:, None] * np.cosh(t) * w
    return np.broadcast_to(start[:, None], ends.shape), ends, area


TRUNCATION_PART = 0.01
"""Truncation error of a sum as a fraction of the accuracy: distant parts of a surface are omitted."""

KINK_SEARCH_COST = 4
"""Points evaluated for each node on a ray, in the search for kinks along it."""

CHEBYSHEV_NODES, TABLE_CHECKS = np.cos(np.pi * (np.arange(24) + 0.5) / 24), np.array([-0.97, -0.52, 0.14, 0.71])
"""Chebyshev nodes in the logarithm of the gap for a table, and points between them at which it is tested."""

TABLE_LENGTH = 0.5
"""Length of a table's piece in the logarithm of the gap: over one, a sum of r^-10 falls to a fiftieth."""

MOST_FALL, END_NODES = 100.0, 6
"""Largest ratio of a sum in a table to its size at the smaller end, so that the error of the larger value is a tenth of
the accuracy of the smaller; and the number of gaps over which that size is taken, as the sum may change sign.
"""

FEWEST_TABULATED = 56
"""Points up to which sums are computed singly if no table is accurate or used again: twice the cost of a table."""


@lru_cache(maxsize=64)
def kernel(law: PairEnergy) -> Kernel:
    """Return the energy of a pair and its slope as machine code, (n, 2) for n distances."""
    r = symengine.Symbol("r")
    return with_slope(law.energy(r), r)


def with_slope(formula: Expression, symbol: Expression) -> Kernel:
    """Return a formula of one symbol and its slope as machine code, (n, 2) for n values of the symbol."""
    value = symengine.sympify(formula)
    # Branches that would divide by zero are not taken.
    compiled: Kernel = symengine.Lambdify([symbol], [value, value.diff(symbol)], backend="llvm")

    def values(places: Array) -> Array:
        # The machine code does not accept an empty array.
        flat = compiled(places.reshape(-1, 1)) if places.size else np.empty(0)
        return np.asarray(flat).reshape(*places.shape, 2)

    return values


def laws_by_extent(laws: Sequence[PairEnergy]) -> dict[Extent, list[int]]:
    """Group the laws that share nodes by extent: one for each set of kinks and cutoff, one for all laws without."""
    found: dict[tuple[float, ...], list[int]] = {}
    for k, law in enumerate(laws):
        kinks = law.kinks.get("r", ())
        places = {float(r) for r in (kinks if isinstance(kinks, Sequence) else (kinks,))}
        if math.isfinite(law.cutoff):
            places = {r for r in places if r < law.cutoff} | {law.cutoff}
        found.setdefault((law.cutoff, *sorted(places)), []).append(k)
    return {
        Extent(min(laws[k].decay for k in which), cutoff, tuple(kinks)): which
        for (cutoff, *kinks), which in found.items()
    }


def inner_sums(
    surface: Surface, x: Array, laws: Sequence[PairEnergy], level: int, rtol: float
) -> tuple[list[Sums], int]:
    """Return the sums of each law over the inner surface for points (n, 3), and the number of pairs of points.

    InputError if a point is inside the body.
    """
    near = surface.nearest(x)
    if not np.all(near.gap > 0):
        raise InputError("the surfaces overlap; a law of pairs of points holds outside only.")
    found: dict[int, Sums] = {}
    pairs = len(x)
    for extent, which in laws_by_extent(laws).items():
        sums, more = _sums_of(surface, x, near, [laws[k] for k in which], extent, level, rtol)
        found |= dict(zip(which, sums, strict=True))
        pairs += more
    return [found[k] for k in range(len(laws))], pairs


def _sums_of(
    surface: Surface, x: Array, near: Projection, laws: Sequence[PairEnergy], extent: Extent, level: int, rtol: float
) -> tuple[list[Sums], int]:
    """Return sums over the inner surface of laws of one extent."""
    # Truncation at the reach omits a part (h / reach)^(decay - 2) of the sum.
    farther = (rtol * TRUNCATION_PART) ** (-1 / (extent.decay - 2))
    if not is_round(surface.shape):
        reach = np.minimum(near.gap * farther, extent.cutoff)
        if extent.kinks:
            nodes = ray_grid(surface, x, near, reach, extent, level)
            return [nodes.sums(kernel(law)) for law in laws], KINK_SEARCH_COST * nodes.area.size
        nodes = tensor_grid(surface, x, near, reach, level)
        return [nodes.sums(kernel(law)) for law in laws], nodes.area.size
    found, pairs = tabulated(SumsByGap(surface.shape, tuple(laws), extent, farther, level, rtol), near.gap)
    return [(energy, push[:, None] * near.normal) for energy, push in np.split(found.T, len(laws))], pairs


class SumsByGap(NamedTuple):
    """Sums (n, 2 laws) around the feet of points at gaps (n,), on a shape whose points are all equivalent.

    They do not depend on where the foot is: they are over circles up to the laws' cutoff or, without one, up to
    ``farther`` times the gap.
    """

    shape: Shape
    laws: tuple[PairEnergy, ...]
    extent: Extent
    farther: float
    level: int
    rtol: float

    def at(self, gaps: Array) -> tuple[Array, int]:
        """Return the sums, and the number of pairs of points."""
        bent = self.shape.bulge / self.shape.R if isinstance(self.shape, Sphere) else 0.0
        last = math.pi / abs(bent) if bent else math.inf
        ends = [np.zeros_like(gaps)]
        for kink in self.extent.kinks:
            # The circle on which the distance is that of a kink, from the law of cosines.
            chord = np.sqrt(np.maximum(kink - gaps, 0.0) * (kink + gaps) / np.maximum(1 + bent * gaps, TINY))
            ends.append(2 / abs(bent) * np.arcsin(np.minimum(chord * abs(bent) / 2, 1)) if bent else chord)
        if math.isinf(self.extent.cutoff):
            ends.append(np.minimum(gaps * self.farther, last))
        gap = gaps[:, None]
        out = np.arcsinh(np.stack(ends[::-1], axis=1) / gap)
        t, w = gauss_rule(divided(np.minimum.accumulate(out, axis=1)[:, ::-1], self.level), order_of(self.level))
        s = gap * np.sinh(t)
        ds = w * np.hypot(gap, s)
        chord = 2 * np.sin(bent * s / 2) / bent if bent else s
        radius = np.sin(bent * s) / bent if bent else s
        # The law of cosines in terms of the chord, which does not cancel next to the foot.
        r = np.sqrt(gap**2 + (1 + bent * gap) * chord**2)
        # Depths below the points, and areas, of circles around the feet.
        height, area, sums = gap + bent * chord**2 / 2, 2 * math.pi * np.abs(radius) * ds, []
        for law in self.laws:
            psi, slope = np.moveaxis(kernel(law)(r), -1, 0)
            # Energy, and force along the normal; tangential components cancel.
            sums += [(psi * area).sum(-1), (-slope * area / r * height).sum(-1)]
        return np.stack(sums, axis=-1), area.size


@lru_cache(maxsize=4096)
def table(profile: SumsByGap, low: float, high: float) -> tuple[Array | None, int]:
    """Return Chebyshev coefficients (24, 2 laws) in the logarithm of the gap between two of its values, and the number
    of pairs evaluated; no coefficients if they miss the values between the nodes.
    """
    at = (low + high) / 2 + (high - low) / 2 * np.concatenate([CHEBYSHEV_NODES, TABLE_CHECKS])
    known, pairs = profile.at(np.exp(at))
    fit = np.polynomial.chebyshev.chebfit(CHEBYSHEV_NODES, known[: len(CHEBYSHEV_NODES)], len(CHEBYSHEV_NODES) - 1)
    missed = np.polynomial.chebyshev.chebval(TABLE_CHECKS, fit).T - known[len(CHEBYSHEV_NODES) :]
    sizes = np.abs(known)
    ends = [sizes[: len(CHEBYSHEV_NODES)][side].max(axis=0) for side in (slice(END_NODES), slice(-END_NODES, None))]
    good = np.all(np.abs(missed) <= profile.rtol * NEGLIGIBLE * sizes.max(axis=0))
    good &= np.all(sizes.max(axis=0) <= MOST_FALL * np.minimum(*ends))
    return np.asarray(fit) if good else None, pairs


def tabulated(profile: SumsByGap, gaps: Array) -> tuple[Array, int]:
    """Return a profile (n, k) of many gaps, and the number of pairs evaluated.

    Unless the profile has kinks, it comes from tables over pieces of the logarithm of the gap, which are the same for
    all points and approaches.
    """
    at, parts = np.log(gaps), []
    low, high = float(at.min()), float(at.max())
    if profile.extent.kinks:
        # Next to a cutoff the sums nearly vanish, and a table across it would have a large relative error.
        levels = [math.log(gap) for gap in profile.extent.levels(profile.shape)]
        inside = [level for level in levels if low < level < high]
        edges = np.unique([*np.linspace(low, high, math.ceil(high - low) + 1), *inside])
    else:
        edges = TABLE_LENGTH * np.arange(math.floor(low / TABLE_LENGTH), math.floor(high / TABLE_LENGTH) + 2)
    home = np.clip(np.searchsorted(edges, at, side="right") - 1, 0, max(len(edges) - 2, 0))
    waiting = [(np.flatnonzero(home == k), edges[k], edges[min(k + 1, len(edges) - 1)]) for k in np.unique(home)]
    pairs, single = 0, [np.empty(0, dtype=int)]
    while waiting:
        which, low, high = waiting.pop()
        few = len(which) < FEWEST_TABULATED
        fit, more = table(profile, float(low), float(high)) if not (few and profile.extent.kinks) else (None, 0)
        pairs += more
        middle, half = (low + high) / 2, max((high - low) / 2, TINY)
        if fit is not None:
            parts.append((which, np.polynomial.chebyshev.chebval((at[which] - middle) / half, fit).T))
        elif few:
            single.append(which)
        else:
            below = at[which] < middle
            waiting += [(part, *ends) for part, *ends in ((which[below], low, middle), (which[~below], middle, high))]
    which = np.concatenate(single)
    if len(which):
        values, more = profile.at(gaps[which])
        parts, pairs = [*parts, (which, values)], pairs + more
    found = np.empty((len(gaps), parts[0][1].shape[-1]))
    for which, values in parts:
        found[which] = values
    return found, pairs
