"""Sums of laws of the distance over the inner of two surfaces.

On a surface whose points are all equivalent they are sums over circles around the foot of a point, else over nodes that
are graded towards the foot.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from surfacechem.contracts.terms import PairEnergy, Shape
from surfacechem.errors import InputError
from surfacechem.expressions import Expression
from surfacechem.surfaces.nodes import Extent, Kernel, Sums, divided, gauss_rule, is_round, order_of, tensor_grid
from surfacechem.surfaces.projection import Array, Projection, Surface
from surfacechem.surfaces.rays import ray_grid
from surfacechem.surfaces.shapes import Sphere
from surfacechem.tolerances import NEGLIGIBLE, TINY

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
    import symengine

    r = symengine.Symbol("r")
    return with_slope(law.energy(r), r)


def with_slope(formula: Expression, symbol: Expression) -> Kernel:
    """Return a formula of one symbol and its slope as machine code, (n, 2) for n values of the symbol."""
    import symengine

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


@dataclass(frozen=True)
class SumsByGap:
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
        r, height, area = self._circles(gaps)
        sums = []
        for law in self.laws:
            psi, slope = np.moveaxis(kernel(law)(r), -1, 0)
            # Energy, and force along the normal; tangential components cancel.
            sums += [(psi * area).sum(-1), (-slope * area / r * height).sum(-1)]
        return np.stack(sums, axis=-1), area.size

    def _circles(self, gap: Array) -> tuple[Array, Array, Array]:
        """Return circles around the feet: distances from the points, depths below these, and areas, each (n, k)."""
        bent = self.shape.bulge / self.shape.R if isinstance(self.shape, Sphere) else 0.0
        last = math.pi / abs(bent) if bent else math.inf
        ends = [np.zeros_like(gap)]
        for kink in self.extent.kinks:
            # The circle on which the distance is that of a kink, from the law of cosines.
            chord = np.sqrt(np.maximum(kink - gap, 0.0) * (kink + gap) / np.maximum(1 + bent * gap, TINY))
            ends.append(2 / abs(bent) * np.arcsin(np.minimum(chord * abs(bent) / 2, 1)) if bent else chord)
        if math.isinf(self.extent.cutoff):
            ends.append(np.minimum(gap * self.farther, last))
        out = np.arcsinh(np.stack(ends[::-1], axis=1) / gap[:, None])
        t, w = gauss_rule(divided(np.minimum.accumulate(out, axis=1)[:, ::-1], self.level), order_of(self.level))
        gap = gap[:, None]
        s = gap * np.sinh(t)
        ds = w * np.hypot(gap, s)
        chord = 2 * np.sin(bent * s / 2) / bent if bent else s
        radius = np.sin(bent * s) / bent if bent else s
        # The law of cosines in terms of the chord, which does not cancel next to the foot.
        r = np.sqrt(gap**2 + (1 + bent * gap) * chord**2)
        return r, gap + bent * chord**2 / 2, 2 * math.pi * np.abs(radius) * ds


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
