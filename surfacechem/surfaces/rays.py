"""Sums over a surface of laws with kinks or a cutoff: along rays from the foot, cut at the distances of these.

The rays go to the edges of the surface, or at most to the cutoff, in parameters without a pole. Along a ray nodes are
graded towards its start as in :mod:`surfacechem.surfaces.nodes`, and along edges towards the closest point.

Source: Duffy (1982), doi 10.1137/0719090, for the rays; Saye (2015), doi 10.1137/140966290, for the cuts.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from surfacechem.surfaces.nodes import Extent, Grid, divided, gauss_rule, order_of
from surfacechem.surfaces.projection import POLE, Array, Projection, Surface
from surfacechem.surfaces.shapes import Indices, Sphere
from surfacechem.tolerances import TINY

KINK_SAMPLES = 4
"""Parts of a piece between whose ends it is tested if the distance passes that of a kink."""


@dataclass(frozen=True)
class Rays:
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
        return replace(self, **parts)

    @property
    def scale(self) -> Array:
        """Gap of each ray's point as a fraction of the ray (k,)."""
        ends = np.linalg.norm(self.at(np.ones(len(self.owner)))[0] - self.at(np.zeros(len(self.owner)))[0], axis=-1)
        return np.asarray(self.gaps[self.owner] / np.maximum(ends, TINY))

    def at(self, s: Array) -> tuple[Array, Array]:
        """Return points (k, ..., 3) at parts (k, ...) of the rays, and areas per area of the coordinates (k, ...)."""
        there = (slice(None), *[None] * (s.ndim - 1))
        return pole_free(self.surface, self.start[there] + s[..., None] * (self.end - self.start)[there])

    def distances(self, s: Array) -> Array:
        """Return the distances of the points at parts (k, ...) of the rays."""
        owners = self.points[self.owner][(slice(None), *[None] * (s.ndim - 1))]
        return np.asarray(np.linalg.norm(self.at(s)[0] - owners, axis=-1))


def has_pole(surface: Surface) -> bool:
    """True if the parameters of a surface are a distance from a pole and an angle about it."""
    return surface.shape.about_axis and not surface.shape.closed[0]


def pole_free(surface: Surface, w: Array) -> tuple[Array, Array]:
    """Return points (..., 3) at coordinates (..., 2), and areas per area of these (...)."""
    if not has_pole(surface):
        return surface.elements(w)
    u = np.maximum(np.hypot(w[..., 0], w[..., 1]), POLE)
    x, areas = surface.elements(np.stack([u, np.arctan2(w[..., 1], w[..., 0])], axis=-1))
    return x, areas / u


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
