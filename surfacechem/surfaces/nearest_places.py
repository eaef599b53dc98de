"""All points at which two surfaces are locally nearest, however many and however close to each other.

The gap is sampled on a grid over one surface, finer than the grain of both. From each grid point that is nearer than
its neighbours Newton's method leads to the local minimum.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfacechem.errors import InputError
from surfacechem.surfaces.projection import FIRST_ORDER, MOST_NEWTON_STEPS, POLE, Array, Surface, descended, newton_step
from surfacechem.surfaces.shapes import Indices
from surfacechem.tolerances import CBRT_EPS, EQUAL, FORMULA_EPS, SQRT_EPS

COARSE_STEPS, STEPS_PER_GRAIN = 32, 4
"""Least number of grid steps along a surface, and steps per grain."""

MOST_PLACES = 5_000_000
"""Most points of the finest grid."""

PLACES_AT_ONCE, CALL_COST = 100_000, 200
"""Points evaluated together, and the overhead of a call in points."""


ZOOM_PLACES, ZOOM_FACTOR = 9, 0.6
"""Points along each side of a grid around the least gap, and the factor by which the next grid is smaller."""

MOST_TURN = math.atan(1e3)
"""Turn [rad] beyond which nearest points of infinite surfaces are not searched farther out: a choice."""


@dataclass(frozen=True)
class NearPlaces:
    """Parameters (k, 2) of a surface's points that are nearest to the other, and gaps [m]; the nearest first."""

    at: Array
    gap: Array

    @property
    def count(self) -> int:
        """Number of points that are as near as the nearest."""
        return int(np.sum(self.gap <= self.gap[0] + EQUAL * abs(self.gap[0])))


def near_places(
    outer: Surface,
    inner: Surface,
    size: float,
    uniform: tuple[bool, bool],
    grain: float = math.inf,
    take: Callable[[int], None] = lambda _: None,
) -> NearPlaces:
    """Return the points of one surface at which the gap to the other has a local minimum.

    An infinite surface is searched near the origin, within ``size`` [m] and, if tilted, as far as a tilted plane is
    nearest to a parabola. Minima that exceed the least gap by more than a grain may be omitted. InputError if the grid
    has too many points; ``take`` is called in advance with the cost in points.
    """
    from scipy.spatial import KDTree

    sought = size * (1 + math.tan(min(abs(outer.shape.tilt) + abs(inner.shape.tilt), MOST_TURN)))
    low, high = np.nan_to_num(np.transpose(outer.shape.span), posinf=sought, neginf=-sought)
    grid = np.stack(np.meshgrid(*np.linspace(low, high, 9).T, indexing="ij"), axis=-1)
    tangents = outer.derivatives(grid, FIRST_ORDER)[1:]
    # Lengths of the surface along its two parameters, at most.
    extents = np.linalg.norm(tangents, axis=-1).max(axis=(1, 2)) * (high - low)
    wide = min(grain, extents.max() / COARSE_STEPS * STEPS_PER_GRAIN)
    # A surface without a grain needs only the coarsest grid.
    halvings = np.ceil(np.log2(np.maximum(STEPS_PER_GRAIN * extents / grain / COARSE_STEPS, 1))).astype(int)
    steps = np.where(uniform, 1, COARSE_STEPS * 2**halvings)
    if math.prod(int(n) for n in steps) > MOST_PLACES:
        text = f"the {outer.shape.name()} has details of {grain:.3g} m on {extents[0]:.3g} by {extents[1]:.3g} m"
        raise InputError(f"{text}, too many to look at: give it a smaller extent, or fewer and coarser details.")

    def parameters(nodes: Indices) -> Array:
        return outer.off_pole(low + (high - low) * np.where(uniform, 0.5, nodes / steps))

    def gap(at: Array) -> Array:
        take((len(at) + CALL_COST) * inner.search)
        parts = np.array_split(at, math.ceil(len(at) / PLACES_AT_ONCE))
        return np.concatenate([inner.nearest(outer.derivatives(part, FIRST_ORDER)[0]).gap for part in parts])

    gaps = _near_grid(lambda nodes: gap(parameters(nodes)), steps, halvings, extents, wide)
    chosen = _lowest(gaps, outer.shape.closed, FORMULA_EPS * size)
    chosen = chosen[gaps[tuple(chosen.T)] <= gaps.min() + wide]
    poles = (chosen[:, 0] == 0) & (outer.shape.about_axis and low[0] == 0 and not uniform[1])
    if poles.any():
        # At a pole all directions are degenerate: start the search next to it, where the gap is least.
        chosen, poles = np.concatenate([chosen, [[1, int(np.argmin(gaps[1]))]]]), np.append(poles, False)
    apart, noise = np.where(uniform, 0.0, (high - low) / steps), FORMULA_EPS * size
    at, gaps = _refined(outer, inner, gap, parameters(chosen), apart, extents.max(), noise)
    # Drop a pole that is not nearer than the point found from there.
    kept = ~poles | (gaps < gaps[-1] - noise)
    order = np.flatnonzero(kept)[np.argsort(gaps[kept], kind="stable")]
    x = outer.derivatives(at[order], FIRST_ORDER)[0]
    same = KDTree(x).query_pairs(SQRT_EPS * extents.max(), output_type="ndarray")
    order = np.delete(order, same.max(axis=1)) if len(same) else order
    return NearPlaces(at[order], gaps[order])


def _near_grid(
    gap: Callable[[Indices], Array], steps: Indices, halvings: Indices, extents: Array, wide: float
) -> Array:
    """Return the gaps on a grid with these steps, infinite where they cannot be within ``wide`` of the least.

    Between two points a gap changes by at most their distance, so the grid is refined only where a point between those
    of a coarser one may be near.
    """
    found = np.full(steps + 1, np.inf)
    strides = [np.minimum(2**halvings, 2**k) for k in range(halvings.max(), -1, -1)]
    new = _mesh(np.arange(0, n + 1, stride) if n > 1 else [0] for n, stride in zip(steps, strides[0], strict=True))
    found[tuple(new.T)] = gap(new)
    for before, stride in pairwise(strides):
        reach = float(np.linalg.norm(extents * before / np.maximum(steps, before)))
        near = np.argwhere(found <= found.min() + wide + reach)
        halved = (stride < before) & (steps > 1)
        around = _mesh((-s, 0, s) if finer else (0,) for s, finer in zip(stride, halved, strict=True))
        new = np.unique((near[:, None] + around).reshape(-1, 2), axis=0)
        new = new[np.all((new >= 0) & (new <= steps), axis=1)]
        new = new[np.isinf(found[tuple(new.T)])]
        found[tuple(new.T)] = gap(new)
    return found


def _mesh(axes: Iterable[ArrayLike]) -> NDArray[Any]:
    """Return all pairs (n, 2) of points on two axes."""
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)


def _lowest(gaps: Array, closed: tuple[bool, bool], noise: float) -> Indices:
    """Return the indices (n, 2) of grid points with no nearer neighbour; one of each group of equal neighbours."""
    from scipy.ndimage import label, minimum_filter, minimum_position

    modes: Any = ["wrap" if comes_round else "nearest" for comes_round in closed]
    least = gaps <= minimum_filter(gaps, 3, mode=modes) + noise
    least &= np.isfinite(gaps)
    labels, count = label(least, np.ones((3, 3)))
    found = minimum_position(gaps, labels, range(1, count + 1))
    return np.array(found, dtype=int)


def _refined(
    outer: Surface, inner: Surface, gap: Callable[[Array], Array], at: Array, steps: Array, long: float, noise: float
) -> tuple[Array, Array]:
    """Return the points (n, 2) of least gap near starting points, and the gaps there.

    No step is longer than that of the grid; the surface is ``long`` [m].
    """
    low, high = outer.bounds

    def slope(at: Array) -> tuple[Array, Array]:
        D = outer.derivatives(at, FIRST_ORDER)
        x, tangents = D[0], D[1:]
        found = inner.nearest(x)
        along = found.normal
        # Beyond an edge the gap grows along the line to it.
        beyond = np.abs(np.einsum("nc,nc->n", x - found.point, along)) < np.abs(found.gap) * (1 - EQUAL)
        along[beyond] = (x - found.point)[beyond] / found.gap[beyond, None]
        return np.einsum("nc,knc->nk", along, tangents), tangents

    def step(at: Array, _: Indices) -> Array:
        first, tangents = slope(at)
        small = CBRT_EPS * steps
        (uu, uv), (vu, vv) = (
            np.transpose((slope(at + shift)[0] - slope(at - shift)[0]) / max(2 * small[k], POLE))
            for k, shift in enumerate(np.diag(small))
        )
        E, F, G = (np.einsum("nc,nc->n", tangents[i], tangents[j]) for i, j in ((0, 0), (0, 1), (1, 1)))
        # A slope that changes the gap by roundoff counts as zero.
        first[np.abs(first * steps) <= noise] = 0.0
        uu, vv = (bent if free else metric / long for bent, metric, free in ((uu, E, steps[0]), (vv, G, steps[1])))
        hessian = long * uu, long * (uv + vu) / 2, long * vv
        return np.clip(newton_step(long * first, hessian, (E, F, G), at <= low, at >= high), -steps, steps)

    found = descended(at, low, high, lambda at, _: gap(at), step, noise, EQUAL)
    gaps = gap(found)
    nearest = np.array([np.argmin(gaps)])
    first, here = slope(found[nearest])[0], found[nearest]
    first[((here <= low) & (first > 0)) | ((here >= high) & (first < 0))] = 0.0
    # Along an edge of the other surface the gap has kinks or jumps, and Newton's method may not converge.
    if np.abs(first * steps).max() > SQRT_EPS * long:
        found[nearest], gaps[nearest] = _nelder_mead(gap, here[0], steps, np.array([low, high]))
    return found, gaps


def _nelder_mead(gap: Callable[[Array], Array], at: Array, steps: Array, bounds: Array) -> tuple[Array, float]:
    """Return the point (2,) of least gap near a start, and the gap there.

    By the method of Nelder and Mead, which needs no slope, and then on grids that shrink around the best point so far,
    as that method may stall where the gap jumps. The returned gap is the one found: evaluated again, roundoff may give
    the value beyond the jump.
    """
    from scipy.optimize import minimize

    def value(at: Array) -> float:
        return float(gap(at[None])[0])

    corners = at + np.diag(np.where(at + steps > bounds[1], -steps, steps))
    options: Any = {"initial_simplex": [at, *corners], "xatol": SQRT_EPS * steps.max(), "fatol": EQUAL * steps.max()}
    rest = minimize(value, list(at), method="Nelder-Mead", bounds=list(bounds.T), options=options)
    at, least = np.asarray(rest.x), float(rest.fun)
    around = _mesh([np.linspace(-1, 1, ZOOM_PLACES)] * 2)
    size = 1.0
    for _ in range(MOST_NEWTON_STEPS):
        places = np.clip(at + size * steps * around, *bounds)
        gaps = gap(places)
        k = np.argmin(gaps)
        best, least = (places[k], float(gaps[k])) if gaps[k] < least else (at, least)
        # Keep the width of the grid while the best point moves.
        size *= 1.0 if np.max(np.abs(best - at) / np.maximum(steps, POLE)) > size / 2 else ZOOM_FACTOR
        at = best
    return at, least
