"""Sums over the inner of two surfaces of laws of the distance: on circles around a foot where all points are alike,
else on nodes that gather around that.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from surfacechem.contracts.terms import PairEnergy
from surfacechem.errors import InputError
from surfacechem.surfaces.nodes import Extent, Kernel, Sums, divided, gauss, is_round, order_of, tensor_grid
from surfacechem.surfaces.projection import Array, Projection, Surface
from surfacechem.surfaces.rays import ray_grid
from surfacechem.surfaces.shapes import Plane
from surfacechem.tolerances import NEGLIGIBLE, TINY

LEFT_OUT = 0.01
"""Part of the accuracy that is far away of one surface, and not summed."""

SOUGHT = 4
"""Points that are looked at for one on a ray, as bends are sought along it."""

CHEBYSHEV, BETWEEN = np.cos(np.pi * (np.arange(24) + 0.5) / 24), np.array([-0.97, -0.52, 0.14, 0.71])
"""Gaps for a polynomial of their logarithm, and places between them at which it is tried."""


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
        reach = np.minimum(near.gap * farther, extent.cutoff)
        if extent.bends:
            nodes = ray_grid(surface, x, near, reach, extent, level)
            return [nodes.sums(one) for one in kernels], SOUGHT * nodes.area.size
        nodes = tensor_grid(surface, x, near, reach, level)
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
    t, w = gauss(edges, order_of(level))
    s = gap[:, None] * np.sinh(t)
    ds = w * np.hypot(gap[:, None], s)
    chord = 2 * np.sin(bent * s / 2) / bent if bent else s
    out = np.sin(bent * s) / bent if bent else s
    # The law of cosines for a chord, which does not cancel next to the foot.
    r = np.sqrt(gap[:, None] ** 2 + (1 + bent * gap[:, None]) * chord**2)
    return Circles(gap, r, bent * chord**2 / 2, 2 * math.pi * np.abs(out) * ds)
