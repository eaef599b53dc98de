"""Places where two surfaces are nearest to each other: all of them, however many there are and however near.

Gaps are looked at all over one surface, finer than the grain of both, and from each place where no neighbour is nearer
Newton's method leads to the least gap.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from surfacechem.errors import InputError
from surfacechem.surfaces.projection import FIRST, POLE, Array, Surface, descended, newton_step
from surfacechem.tolerances import CBRT_EPS, NOISE, SAME, SQRT_EPS

COARSE, PER_GRAIN = 32, 4
"""Steps along a surface between places that are looked at, at least, and per grain."""

MOST_PLACES = 2_000_000
"""Places that are looked at, at most."""

TOGETHER = 100_000
"""Places that are looked at together."""


@dataclass(frozen=True)
class NearPlaces:
    """Parameters (k, 2) of the places of a surface that are nearest to the other, and the gaps there [m]; the nearest
    is the first.
    """

    at: Array
    gap: Array

    @property
    def count(self) -> int:
        """How many are as near as the nearest."""
        return int(np.sum(self.gap <= self.gap[0] + SAME * abs(self.gap[0])))


def near_places(
    outer: Surface, inner: Surface, size: float, alike: tuple[bool, bool], grain: float = math.inf
) -> NearPlaces:
    """Places of one surface that are nearer to the other than those around them.

    They are sought near the origin within ``size`` [m] where a surface has no end. Those that are farther than the
    nearest by more than a grain count for nothing of their own. InputError where there are too many to look at.
    """
    low, high = np.nan_to_num(np.transpose(outer.shape.span), posinf=size, neginf=-size)
    extents = _extents(outer, low, high)
    counts = _counts(outer, extents, alike, grain)
    ends = zip(low, high, counts, strict=True)
    axes = [np.linspace(a, b, n) if n > 1 else np.array([(a + b) / 2]) for a, b, n in ends]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    if outer.shape.about_axis and low[0] == 0:
        grid = np.maximum(grid, [POLE, -np.inf])
    gaps = _gaps(outer, inner, grid.reshape(-1, 2)).reshape(grid.shape[:2])
    chosen = _lowest(gaps, outer.shape.closed, NOISE * size)
    wide = min(grain, extents.max() / COARSE * PER_GRAIN)
    chosen = chosen[gaps.ravel()[chosen] <= gaps.min() + wide]
    steps = np.where(alike, 0.0, (high - low) / np.maximum(np.subtract(counts, 1), 1))
    at = _settled(outer, inner, grid.reshape(-1, 2)[chosen], steps, extents.max(), NOISE * size)
    return _distinct(outer, at, _gaps(outer, inner, at), SQRT_EPS * extents.max())


def _extents(outer: Surface, low: Array, high: Array) -> Array:
    """Lengths of a surface along its two parameters, at most [m]."""
    grid = np.stack(np.meshgrid(*np.linspace(low, high, 9).T, indexing="ij"), axis=-1)
    tangents = outer.derivatives(grid, FIRST)[1:]
    return np.asarray(np.linalg.norm(tangents, axis=-1).max(axis=(1, 2)) * (high - low))


def _counts(outer: Surface, extents: Array, alike: tuple[bool, bool], grain: float) -> list[int]:
    """Numbers of places along both parameters."""
    fine = [max(COARSE, math.ceil(PER_GRAIN * extent / grain)) for extent in extents]
    counts = [1 if same else steps + 1 for same, steps in zip(alike, fine, strict=True)]
    if math.prod(counts) > MOST_PLACES:
        text = f"the {outer.shape.name()} has details of {grain:.3g} m on {extents[0]:.3g} by {extents[1]:.3g} m"
        raise InputError(f"{text}, too many to look at: give it a smaller extent, or fewer and coarser details.")
    return counts


def _gaps(outer: Surface, inner: Surface, at: Array) -> Array:
    """Gaps at parameters (n, 2)."""
    parts = np.array_split(at, math.ceil(len(at) / TOGETHER))
    return np.concatenate([inner.nearest(outer.derivatives(part, FIRST)[0]).gap for part in parts])


def _lowest(gaps: Array, closed: tuple[bool, bool], noise: float) -> NDArray[np.int_]:
    """Indices of places of a grid that no neighbour is nearer than; one of those that are alike and side by side."""
    from scipy.ndimage import label, minimum_filter, minimum_position

    modes: Any = ["wrap" if comes_round else "nearest" for comes_round in closed]
    least = gaps <= minimum_filter(gaps, 3, mode=modes) + noise
    labels, count = label(least, np.ones((3, 3)))
    found = minimum_position(gaps, labels, range(1, count + 1))
    return np.asarray(np.ravel_multi_index(np.transpose(found), gaps.shape))


def _settled(outer: Surface, inner: Surface, at: Array, steps: Array, long: float, noise: float) -> Array:
    """The places of least gap near some, no step longer than that of the grid, over a ``long`` surface [m]."""
    low, high = np.transpose(outer.shape.span)
    low = np.where(outer.shape.closed, -np.inf, low) + (POLE if outer.shape.about_axis else 0.0)
    high = np.where(outer.shape.closed, np.inf, high)

    def slope(at: Array) -> tuple[Array, Array]:
        D = outer.derivatives(at, FIRST)
        x, tangents = D[0], D[1:]
        found = inner.nearest(x)
        along = found.normal
        # Beyond an edge the gap grows along the line to it.
        beyond = np.abs(np.einsum("nc,nc->n", x - found.point, along)) < np.abs(found.gap) * (1 - SAME)
        along[beyond] = ((x - found.point) / found.gap[:, None])[beyond]
        return np.einsum("nc,knc->nk", along, tangents), tangents

    def step(at: Array) -> Array:
        first, tangents = slope(at)
        small = CBRT_EPS * steps
        (uu, uv), (vu, vv) = (
            np.transpose((slope(at + shift)[0] - slope(at - shift)[0]) / max(2 * small[k], POLE))
            for k, shift in enumerate(np.diag(small))
        )
        E, F, G = (np.einsum("nc,nc->n", tangents[i], tangents[j]) for i, j in ((0, 0), (0, 1), (1, 1)))
        # A slope that changes the gap by its rounding is none.
        first[np.abs(first * steps) <= noise] = 0.0
        uu, vv = (bent if free else metric / long for bent, metric, free in ((uu, E, steps[0]), (vv, G, steps[1])))
        hessian = long * uu, long * (uv + vu) / 2, long * vv
        return np.clip(newton_step(long * first, hessian, (E, F, G), at <= low, at >= high), -steps, steps)

    return descended(at, low, high, lambda at: _gaps(outer, inner, at), step, noise)


def _distinct(outer: Surface, at: Array, gap: Array, near: float) -> NearPlaces:
    """The places without those that are the same point, by gap."""
    from scipy.spatial import KDTree

    order = np.argsort(gap, kind="stable")
    x = outer.derivatives(at[order], FIRST)[0]
    same = KDTree(x).query_pairs(near, output_type="ndarray")
    kept = np.delete(order, same.max(axis=1)) if len(same) else order
    return NearPlaces(at[kept], gap[kept])
