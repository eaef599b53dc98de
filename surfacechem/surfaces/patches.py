"""Integrals over the outer of two surfaces: patches around each near point, divided until the integrals are accurate.

Each near point has a rectangle of parameters, in which nodes are graded towards it; a patch is no larger than the grain
of the surfaces. Patches on which two rules disagree get a higher order, or are divided. The points of the first search
do not depend on the accuracy, so no near point is missed at a low one.

Source: Bentley (1975), doi 10.1145/361002.361007, for rectangles around points; Berntsen, Espelid & Genz (1991), doi
10.1145/210232.210233, for the adaptive subdivision of many regions at a time.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from itertools import pairwise
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from surfacechem.errors import InputError
from surfacechem.surfaces.inner_sums import (
    LAST_LEVEL,
    ORDERS,
    alike_along,
    alike_around,
    gauss_rule,
    is_round,
    piece_edges,
)
from surfacechem.surfaces.nearest_places import NearPlaces, near_places
from surfacechem.surfaces.projection import FIRST_ORDER, POLE, Array, Surface
from surfacechem.surfaces.shapes import Disc, Plane
from surfacechem.tolerances import NEGLIGIBLE

LEAST_GAIN, FIRST_LEVEL = 4.0, 2
"""Least gain in accuracy of the next level, below which a patch is divided; and the level from which this is tested."""

HIGHER_START = NEGLIGIBLE, NEGLIGIBLE**3
"""Accuracies below each of which patches in one direction begin one level higher: their points are cheap."""

MOST_POINTS = 200_000_000
"""Most pairs of points, of one integral or of all over an approach, before an accuracy is out of reach: minutes."""

RULE_COST = 10_000
"""Overhead of applying a rule, in pairs of points."""

JUDGED_PART = 8
"""Factor by which the number of points has to grow before it is tested, from 1/8 of the maximum on, if the error
decreases fast enough.
"""

FIRST_INTEGRALS = 2
"""Integrals of an approach from which the cost of all is estimated: the nearest, and one that is farther."""

PAIRS_AT_ONCE = 400_000
"""Pairs of points that are evaluated together."""

CONTACT_GAP = 2.0**-20
"""Fraction of the size of a surface below which a gap counts as contact."""

Levels = NDArray[np.int_]
"""Index of each patch's order."""

Integrand = Callable[[Array, int], tuple[Array, int]]
"""Function from points (n, 3), and the level of the rules inside, to values (n, ...) per area and a number of pairs."""


@dataclass(frozen=True)
class Patches:
    """Patches of a surface between substituted parameters ``low`` and ``high``, around ``at`` with ``scale``.

    All four have shape (n, 2). Directions in which nothing varies (``uniform``) have two nodes.
    """

    surface: Surface
    at: Array
    scale: Array
    low: Array
    high: Array
    uniform: tuple[bool, bool]

    arrays: ClassVar[Sequence[str]] = ("at", "scale", "low", "high")
    """Names of the arrays with an entry for each patch."""

    @property
    def rule_kinds(self) -> Levels:
        """Kind of each patch (n,): patches of one kind have rules with equally many points."""
        return np.zeros(len(self), dtype=int)

    @property
    def first_level(self) -> int:
        """Level of the first rule: with few patches two rules may agree while both are wrong."""
        return FIRST_LEVEL if any(self.uniform) else 1

    def __getitem__(self, chosen: NDArray[Any] | slice) -> Self:
        """Return some of the patches."""
        return replace(self, **{name: getattr(self, name)[chosen] for name in self.arrays})

    def __len__(self) -> int:
        """Return the number of patches."""
        return len(self.at)

    def nodes(self, order: int) -> tuple[Array, Array]:
        """Return points (n, k, 3) of a rule, and their areas (n, k); all patches are of one kind."""
        (u, du), (v, dv) = (self.parameters(k, *self.rule(k, order)) for k in range(2))
        u, v = np.broadcast_arrays(u[:, :, None], v[:, None, :])
        return self.points(np.stack([u, v], axis=-1), du[:, :, None] * dv[:, None, :])

    def point_count(self, order: int) -> int:
        """Return the largest number of points of a rule on each patch; all patches are of one kind."""
        return order**2

    def cost(self, order: int) -> int:
        """Return the cost of finding the points of a rule, in pairs of points."""
        return 0 * order

    def points(self, at: Array, lengths: Array) -> tuple[Array, Array]:
        """Return points (n, k, 3) at parameters (n, ..., 2), and their areas (n, k) from products of lengths."""
        x, areas = self.surface.elements(at.reshape(len(at), -1, 2))
        return x, areas * lengths.reshape(len(at), -1)

    def rule(self, k: int, order: int) -> tuple[Array, Array]:
        """Return nodes and weights (n, m) along a direction."""
        ends = np.stack([self.low[:, k], self.high[:, k]], axis=1)
        if not self.uniform[k]:
            return gauss_rule(ends, order)
        middle, half = ends.mean(axis=1)[:, None], np.diff(ends) / 2
        # Around a closed direction tangential components cancel; along a length it is the Gauss rule of two points.
        shift = half / 2 if self.surface.shape.closed[k] else half / math.sqrt(3)
        return middle + shift * [-1, 1], half * np.ones(2)

    def parameters(self, k: int, t: Array, w: Array | float = 1.0) -> tuple[Array, Array]:
        """Return parameters (n, ...) from substituted ones along a direction, and weights transformed with them."""
        shape = -1, *[1] * (t.ndim - 1)
        at, scale = self.at[:, k].reshape(shape), self.scale[:, k].reshape(shape)
        if self.uniform[k]:
            return at + scale * t, scale * w
        return at + scale * np.sinh(t), scale * np.cosh(t) * w

    def line(self, k: int, count: int) -> Array:
        """Return parameters along a direction from end to end of all patches; graded if they are around one point."""
        ends = [self.parameters(k, edge[:, k, None])[0] for edge in (self.low, self.high)]
        low, high = float(ends[0].min()), float(ends[1].max())
        if self.uniform[k] or np.ptp(self.at[:, k]):
            return np.linspace(low, high, count)
        t = np.arcsinh((np.array([low, high]) - self.at[0, k]) / self.scale[0, k])
        return np.asarray(self.at[0, k] + self.scale[0, k] * np.sinh(np.linspace(t[0], t[1], count)))

    def halved(self) -> Self:
        """Return the halves of the patches in each direction in which something varies."""
        found = self
        for k in range(2):
            if not self.uniform[k]:
                found = found.cut(k, (found.low[:, k] + found.high[:, k]) / 2)
        return found

    def cut(self, k: int, at: Array | float) -> Self:
        """Return the parts below substituted parameters (n,) along a direction, followed by the parts above."""
        low, high = self.low.copy(), self.high.copy()
        low[:, k] = high[:, k] = at
        return replace(self, high=high).joined(replace(self, low=low))

    def joined(self, *others: Self) -> Self:
        """Return these patches and others."""
        parts: dict[str, Any] = {
            name: np.concatenate([getattr(part, name) for part in (self, *others)]) for name in self.arrays
        }
        return replace(self, **parts)


def outer_patches(
    outer: Surface, inner: Surface, size: float, reach: float, budget: Budget
) -> tuple[Patches, NearPlaces]:
    """Return the patches of a surface, graded towards the other up to a ``reach`` [m], and the nearest points.

    The search for the nearest points counts in the ``budget``.
    """
    if type(outer.shape) is Plane and is_round(outer.shape) and outer.shape.tilt == 0:
        # Polar coordinates, in which nothing may vary around an axis.
        polar = Surface(Disc(), outer.upper, outer.approach)
        outer = polar if alike_around(polar, inner) else outer
    uniform = alike_along(outer, inner), alike_around(outer, inner)
    grain = min(outer.shape.grain, inner.shape.grain)
    near = near_places(outer, inner, size, uniform, grain, budget.take)
    tangents = outer.derivatives(near.at, FIRST_ORDER)[1:]
    lengths = np.maximum(np.linalg.norm(tangents, axis=-1).T, POLE)
    first, low, high = near.at[0], *np.transpose(outer.shape.span)
    # Bodies far apart need a larger reach. An infinite parameter is a distance from the axis or along
    # it; where the surface is steep it is also flatter: the root of its radius grows like the length of a step.
    endless = np.isinf(low) | np.isinf(high)
    far = reach * max(1.0, float(near.gap[0]) / size) * np.where(endless, lengths[0], 1 / lengths[0])
    closed = np.array(outer.shape.closed)
    low, high = (
        np.where(closed, first + s * math.pi, np.clip(e, np.minimum(first, 0.0) - far, np.maximum(first, 0.0) + far))
        for s, e in ((-1, low), (1, high))
    )
    at = np.where(closed, first + np.remainder(near.at - first + math.pi, 2 * math.pi) - math.pi, near.at)
    at = np.clip(at, low, high)
    scales = np.maximum(np.abs(near.gap), size * CONTACT_GAP)[:, None] / lengths
    # In a direction in which nothing varies the scale is one.
    scales = np.where(uniform, 1.0, scales)
    rectangles = around_each(at, low, high, lengths[0])
    patches = [
        _patches(outer, at[k], scales[k], box, np.where(uniform, math.inf, grain / lengths[k]), uniform)
        for k, box in rectangles
    ]
    return patches[0].joined(*patches[1:]), near


def around_each(at: Array, low: Array, high: Array, lengths: Array) -> list[tuple[int, tuple[Array, Array]]]:
    """Divide a rectangle into one for each of some points (n, 2), cut where they are farthest apart."""
    waiting, found = [(np.arange(len(at)), low, high)], []
    while waiting:
        group, low, high = waiting.pop()
        if len(group) == 1:
            found.append((int(group[0]), (low, high)))
            continue
        sorts = np.sort(at[group], axis=0)
        steps = np.diff(sorts, axis=0) * lengths
        row, k = np.unravel_index(np.argmax(steps), steps.shape)
        cut = (sorts[row, k] + sorts[row + 1, k]) / 2
        below = at[group, k] < cut
        middle = np.where(np.arange(2) == k, cut, high), np.where(np.arange(2) == k, cut, low)
        waiting += [(group[~below], middle[1], high), (group[below], low, middle[0])]
    return found


def _patches(
    outer: Surface, at: Array, scale: Array, box: tuple[Array, Array], grain: Array, uniform: tuple[bool, bool]
) -> Patches:
    """Return the patches of one rectangle of parameters."""
    pairs = []
    for k in range(2):
        ends = (np.stack(box)[:, k] - at[k]) / scale[k]
        if uniform[k]:
            edges = ends
        else:
            ends = np.arcsinh(ends)
            edges = piece_edges(ends[:1], ends[1:], grain[k] / scale[k])[0]
        pairs.append(list(pairwise(edges)))
    low, high = np.moveaxis(np.array([(a, b) for a in pairs[0] for b in pairs[1]]), 2, 0)
    return Patches(outer, np.tile(at, (len(low), 1)), np.tile(scale, (len(low), 1)), low, high, uniform)


class OutOfReachError(InputError):
    """An accuracy takes too many pairs of points."""


class Budget:
    """Cost of a number of integrals in pairs of points; raises OutOfReachError before it becomes too large."""

    def __init__(self, rtol: float) -> None:
        """Begin a budget for an accuracy that messages name."""
        self.rtol, self.integrals, self.done, self.spent = rtol, 1, 0, 0.0

    def projected(self, ahead: float) -> float:
        """Return the least cost of all integrals, if those done and the next one cost this much."""
        return ahead * max(1.0, self.integrals / max(self.done + 1, FIRST_INTEGRALS))

    def take(self, points: int) -> None:
        """Count the pairs of points that come next; raise OutOfReachError if they are too many."""
        self.spent += points
        self.refuse_beyond(self.spent)

    def refuse_beyond(self, ahead: float) -> None:
        """Raise OutOfReachError if this cost is too large."""
        if self.projected(ahead) > MOST_POINTS:
            text = f"the accuracy {self.rtol:.2g} of an integral over the surfaces is out of reach"
            what = f"{self.integrals} of them take" if self.integrals > 1 else "it takes"
            raise OutOfReachError(
                f"{text}: {what} {self.projected(ahead):.1g} pairs of points; ask for less, or smaller surfaces."
            )


class Rules:
    """Values of an integrand over patches by rules of some orders; raises InputError before they take too long."""

    def __init__(self, integrand: Integrand, search: int, budget: Budget) -> None:
        """Store the integrand, the cost of a projection onto the other surface in points, and the budget."""
        self.integrand, self.search, self.budget, self.points = integrand, search, budget, 0
        self.each: dict[int, float] = {}  # pairs of points for each outer point, by the level inside

    def __call__(self, patches: Patches, levels: Levels, inside: Levels) -> Array:
        """Return integrals (n, ...) over each patch, with the orders of its level and of its level inside."""
        found: dict[int, Array] = {}
        ranks = np.stack([levels, inside, patches.rule_kinds], axis=1)
        for rank in np.unique(ranks, axis=0):
            where = np.flatnonzero((ranks == rank).all(axis=1))
            values = self._of_order(patches[where], ORDERS[rank[0]], int(rank[1]))
            found |= dict(zip(where.tolist(), values, strict=True))
        return np.array([found[k] for k in range(len(levels))])

    def _of_order(self, patches: Patches, order: int, inside: int) -> Array:
        """Return integrals (n, ...) over each patch by one rule."""
        found, begin = [], 0
        while begin < len(patches):
            # One patch at first: the number of pairs of its points is not known yet.
            each = self.each.get(inside, PAIRS_AT_ONCE) * patches.point_count(order)
            part = patches[begin : begin + max(1, int(PAIRS_AT_ONCE / each))]
            x, area = part.nodes(order)
            values, together = self.integrand(x.reshape(-1, 3), inside)
            points = together + area.size * self.search + part.cost(order)
            found.append(np.einsum("nk...,nk->n...", values.reshape(*area.shape, *values.shape[1:]), area))
            self.points += points
            self.budget.spent += points + RULE_COST
            begin += len(part)
            self.budget.refuse_beyond(self.budget.spent + points / len(part) * (len(patches) - begin))
            self.each[inside] = together / area.size
        return np.concatenate(found)


@dataclass(frozen=True)
class PatchResults:
    """Results on some patches.

    Levels of the rules over and inside each, values (n, ...), their last two changes by the rule over the patch and by
    that inside (n, 2, ...), and flags of patches on which a higher order gained little.
    """

    patches: Patches
    level: Levels
    inside: Levels
    value: Array
    over: Array
    within: Array
    stalled: NDArray[np.bool_]

    def replaced(self, gone: NDArray[np.bool_], others: PatchResults) -> PatchResults:
        """Return the results without those of some patches, and with others."""
        kept = {
            item.name: np.concatenate([getattr(self, item.name)[~gone], getattr(others, item.name)])
            for item in fields(self)[1:]
        }
        return PatchResults(self.patches[~gone].joined(others.patches), **kept)


def integral(
    patches: Patches,
    integrand: Integrand,
    search: int,
    sizes: Callable[[Array], Array],
    left: float,
    budget: Budget,
    nested: bool = True,
) -> tuple[Array, float, int]:
    """Return an integral over patches, its error relative to the ``sizes`` of the entries, and the number of points.

    The error is at most ``left``. A ``nested`` integrand is itself a sum with an error; each of its points has a
    projection onto the other surface that costs as much as ``search`` points. InputError if it takes more than its
    budget.
    """
    first = patches.first_level if not any(patches.uniform) else FIRST_LEVEL + sum(left < goal for goal in HIGHER_START)
    rules, begin, before = Rules(integrand, search, budget), np.full(len(patches), first), budget.spent
    known, met = _start(rules, patches, begin, begin, nested), list[tuple[float, float]]()
    while True:
        whole = known.value.sum(axis=0)
        size = sizes(whole)
        over, within = _largest(known.over, size), _largest(known.within, size)
        error = float((over + within).sum())
        if error <= left:
            budget.done += 1
            return whole, error, rules.points
        met.append((budget.spent - before, error))
        if budget.projected(budget.spent) > MOST_POINTS / JUDGED_PART and met[-1][0] > JUDGED_PART * met[0][0]:
            budget.refuse_beyond(before + _expected(met, left))
        rank = np.argsort(over + within)
        worst = np.zeros(len(over), dtype=bool)
        worst[rank[~(np.cumsum((over + within)[rank]) <= left / 2)]] = True
        deeper = worst & (within > over)
        halved = worst & ~deeper & (known.stalled | (known.level == LAST_LEVEL))
        raised = worst & ~deeper & ~halved
        for mask, steps in ((deeper, (0, 1)), (raised, (1, 0))):
            if mask.any():
                _raise_level(rules, known, mask, steps)
        known.stalled[raised] = (known.level[raised] > FIRST_LEVEL) & (
            _largest(known.over[raised], size) * LEAST_GAIN > over[raised]
        )
        if halved.any():
            halves = known.patches[halved].halved()
            # On half of a patch a rule is as accurate as one of higher order on the whole.
            times = len(halves) // int(halved.sum())
            start, inside = np.maximum(known.level[halved] - 1, patches.first_level), known.inside[halved]
            known = known.replaced(halved, _start(rules, halves, np.tile(start, times), np.tile(inside, times), nested))


def _expected(met: Sequence[tuple[float, float]], rtol: float) -> float:
    """Extrapolate the number of points at which the error reaches the tolerance, by its convergence so far."""
    points, error = met[-1]
    fewer, before = next(item for item in met[::-1] if item[0] <= points / JUDGED_PART or item is met[0])
    gain, more = math.log(max(before / error, 1.0)), math.log(points / fewer) if points > fewer else 1.0
    falls = more / gain * math.log(error / rtol) if gain > NEGLIGIBLE else 0.0
    return points * math.exp(min(falls, math.log(MOST_POINTS)))


def _start(rules: Rules, patches: Patches, level: Levels, inside: Levels, nested: bool) -> PatchResults:
    """Return results on patches by rules of some levels and of those before."""
    value = rules(patches, level, inside)
    steps = range(1, patches.first_level + 1)
    over = _changes(value, *(rules(patches, level - k, inside) for k in steps))
    within = np.zeros_like(over)
    if nested:
        within = _changes(value, *(rules(patches, level, inside - k) for k in steps))
    return PatchResults(patches, level.copy(), inside.copy(), value, over, within, np.zeros(len(level), dtype=bool))


def _changes(value: Array, before: Array, first: Array | None = None) -> Array:
    """Return the last two changes of values (n, ...), shape (n, 2, ...); zero if the earlier one is not known."""
    return np.stack([value - before, np.zeros_like(before) if first is None else before - first], axis=1)


def _raise_level(rules: Rules, known: PatchResults, mask: NDArray[np.bool_], steps: tuple[int, int]) -> None:
    """Raise the level of the rules over, or inside, some patches."""
    known.level[mask] += steps[0]
    known.inside[mask] += steps[1]
    finer = rules(known.patches[mask], known.level[mask], known.inside[mask])
    changes = known.over if steps[0] else known.within
    if known.patches.first_level == FIRST_LEVEL:
        changes[mask, 1] = changes[mask, 0]
    changes[mask, 0] = finer - known.value[mask]
    known.value[mask] = finer


def _largest(changes: Array, size: Array) -> Array:
    """Return the largest errors (n,) of patches over all entries; no less than the change before the last suggests."""
    entries = tuple(range(1, changes.ndim - 1))
    last, before = (np.abs(changes[:, k] / size).max(axis=entries, initial=0.0) for k in range(2))
    return np.asarray(np.maximum(last, before / LEAST_GAIN))
