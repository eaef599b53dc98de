"""Integrals over the outer of two surfaces: patches around each near point, divided until the integrals are accurate.

Each near point has a rectangle of parameters, in which nodes are graded towards it; a patch is no larger than the grain
of the surfaces. Patches on which two rules disagree get a higher order, or are divided. The points of the first search
do not depend on the accuracy, so no near point is missed at a low one.

Patches are cut along levels of the gap at which a law has a kink, and along lines where the foot reaches an edge of the
other surface, so that quadrature stays accurate on both sides: the level is located on each line of nodes along the
direction in which the gap changes most; the other direction is cut where the level leaves the patch.

Source: Bentley (1975), doi 10.1145/361002.361007, for rectangles around points; Berntsen, Espelid & Genz (1991), doi
10.1145/210232.210233, for the adaptive subdivision of many regions at a time; Saye (2015), doi 10.1137/140966290, for
the cuts.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, ClassVar, NamedTuple, Self

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


SAMPLES = np.array([0, 1 / 128, 1 / 4, 1 / 2, 3 / 4, 127 / 128, 1])
"""Points along each side of a patch at which it is tested for a level. The pairs at the ends give the slope there: a
minimum or maximum between other points shows as a change of its sign.
"""

SLIGHT_CUT, CUT_HALVINGS = 0.1, 8
"""A patch divided so unevenly that part times rest is below this is halved first. The second is the number of halvings
in excess of those that reduce its area to the accuracy.
"""

MOST_CROSSED = 256
"""Patches crossed by an edge in addition to their level are halved too, if there are at most this many: lines then
cross rather than run along each other.
"""

SIDE_PARTS, ROOT_SAMPLES = 3, 10
"""Parts of a side with separate lines of nodes, and gaps evaluated to locate a level on a line."""


@dataclass(frozen=True)
class Patches:
    """Patches of a surface between substituted parameters ``low`` and ``high``, around ``at`` with ``scale``.

    All four have shape (n, 2). Directions in which nothing varies (``uniform``) have two nodes.

    Patches that an ``other`` surface divides have levels: of the gap to it, or of the distance beyond one of its edges.
    ``level`` (n,) is the index of each patch's level, and ``along`` (n,) the direction in which it is located, -1 if it
    has none. Heights above a level smaller than ``noise`` [m] count as zero.
    """

    surface: Surface
    uniform: tuple[bool, bool]
    at: Array
    scale: Array
    low: Array
    high: Array
    level: Levels
    along: Levels
    share: Array
    """Fraction of each patch below the level times the fraction above."""
    crossed: NDArray[np.bool_]
    """True for patches that an edge divides in another way."""
    leaves: Array
    """Coordinates across that direction where the level leaves each patch at its ends (n, 2); NaN if unknown."""
    other: Surface | None = None
    levels: tuple[float, ...] = ()
    noise: float = 0.0

    arrays: ClassVar[Sequence[str]] = ("at", "scale", "low", "high", "level", "along", "share", "crossed", "leaves")
    """Names of the arrays with an entry for each patch."""

    @property
    def first_level(self) -> int:
        """Level of the first rule: with few patches two rules may agree while both are wrong, and a cut may be curved
        between the lines on which it is located.
        """
        curved = self.other is not None and self.other.search == 1
        return FIRST_LEVEL if curved or any(self.uniform) else 1

    def __getitem__(self, chosen: NDArray[Any] | slice) -> Self:
        """Return some of the patches."""
        return replace(self, **{name: getattr(self, name)[chosen] for name in self.arrays})

    def __len__(self) -> int:
        """Return the number of patches."""
        return len(self.at)

    def nodes(self, order: int) -> tuple[Array, Array]:
        """Return points (n, k, 3) of a rule on both sides of the level, and their areas (n, k).

        All patches have their level along one direction, so that their rules have equally many points.
        """
        k = int(self.along[0])
        if k < 0:
            (u, du), (v, dv) = (self.parameters(j, *self.rule(j, order)) for j in range(2))
            at, lengths = np.broadcast_arrays(u[:, :, None], v[:, None, :]), du[:, :, None] * dv[:, None, :]
        else:
            across, width = self._across(1 - k, order)
            n, m = across.shape
            each = self[np.repeat(np.arange(n), m)]
            ends = np.stack([each.low[:, k], each.crossing(k, across.ravel()), each.high[:, k]], axis=1)
            t, w = gauss_rule(ends, order)
            there, thickness = self.parameters(1 - k, across, width)
            here, length = (part.reshape(n, m, -1) for part in each.parameters(k, t, w))
            at, lengths = (here, np.broadcast_to(there[..., None], here.shape)), length * thickness[..., None]
            at = at if k == 0 else at[::-1]
        x, areas = self.surface.elements(np.stack(at, axis=-1).reshape(len(self), -1, 2))
        return x, areas * lengths.reshape(len(self), -1)

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
        """Return the halves of the patches in each direction in which something varies, each with its own level."""
        found = self
        for k in range(2):
            if not self.uniform[k]:
                found = found.cut(k, (found.low[:, k] + found.high[:, k]) / 2)
        return found if self.other is None else found.marked()

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

    def marked(self) -> Self:
        """Return the patches with their levels and directions determined anew."""
        assert self.other is not None
        u, v = (self.low[:, k, None] + (self.high - self.low)[:, k, None] * SAMPLES for k in range(2))
        x, gap, heights = self.seen(*np.broadcast_arrays(u[:, :, None], v[:, None, :]))
        # Take the level that divides a patch most evenly.
        below, above = (np.mean(s * heights > self.noise, axis=(1, 2)) for s in (-1, 1))
        best, share = np.argmax(below * above, axis=1), np.max(below * above, axis=1)
        over = np.take_along_axis(heights, best[:, None, None, None], axis=-1)
        # Choose a direction in which each line of nodes crosses the level once.
        steps = [np.diff(over[..., 0], axis=k + 1) for k in range(2)]
        ends = [(step.min(axis=k + 1), step.max(axis=k + 1)) for k, step in enumerate(steps)]
        turns = np.stack([np.any((low < -self.noise) & (high > self.noise), axis=1) for low, high in ends])
        steepness = np.stack([np.abs(step).mean(axis=(1, 2)) for step in steps])
        along = np.argmax(np.where(np.array(self.uniform)[:, None], -1.0, np.where(turns, 0.0, steepness)), axis=0)
        # Two edges never coincide; where a gap jumps its level is on the edge. Far from the body edges do not matter.
        edges = np.arange(heights.shape[-1]) < len(self.other.edges)
        alike = np.mean((heights > 0) == (over > 0), axis=(1, 2))
        apart = np.where(edges & edges[best, None], np.arange(len(edges)) != best[:, None], (alike > 0) & (alike < 1))
        crossed = np.any((below * above > 0) & apart & (edges | edges[best, None]), axis=1)
        crossed |= (share > 0) & turns[along, np.arange(len(along))]
        crossed &= gap.min(axis=(1, 2)) < np.linalg.norm(x[:, -1, -1] - x[:, 0, 0], axis=-1)
        along, none = np.where(share > 0, along, -1), np.full((len(self), 2), math.nan)
        return replace(self, level=best, along=along, share=share, crossed=crossed, leaves=none)

    def _across(self, j: int, order: int) -> tuple[Array, Array]:
        """Return nodes and weights (n, m) across the direction of the level, cut where it leaves the patch."""
        if self.uniform[j]:
            return self.rule(j, order)
        edges = np.column_stack([self.low[:, j], self.leaves, self.high[:, j]])
        return gauss_rule(np.sort(edges, axis=1), order)

    def left(self) -> Self:
        """Return the patches with the points at which their levels leave them."""
        leaves = self.leaves.copy()
        for k in range(2):
            chosen = self.along == k
            if self.uniform[1 - k] or not chosen.any():
                continue
            passed = self[chosen]
            ends = np.concatenate([passed.low[:, k], passed.high[:, k]])
            leaves[chosen] = passed.joined(passed).crossing(1 - k, ends).reshape(2, -1).T
        return replace(self, leaves=leaves)

    def crossing(self, k: int, across: Array) -> Array:
        """Return the coordinate along a direction at which each patch passes its level, at ``across``; else its end."""
        from scipy.optimize.elementwise import find_root

        def above(t: Array, across: Array, which: Array) -> Array:
            _, _, heights = self[which].seen(*((t, across) if k == 0 else (across, t)))
            return np.asarray(heights[np.arange(len(which)), self.level[which]])

        ends = self.low[:, k], self.high[:, k]
        reached: Any = {"fatol": self.noise}
        found: Any = find_root(above, ends, args=(across, np.arange(len(self))), tolerances=reached)
        return np.asarray(np.where(found.success, found.x, ends[1]))

    def seen(self, u: Array, v: Array) -> tuple[Array, Array, Array]:
        """Return points (n, ..., 3) at substituted parameters (n, ...), their gaps to the other surface, and their
        distances (n, ..., levels) [m] beyond edges, where the gap may jump, and above levels of the gap.
        """
        assert self.other is not None
        at = np.stack([self.parameters(k, t)[0] for k, t in enumerate((u, v))], axis=-1)
        x = self.surface.derivatives(at, FIRST_ORDER)[0]
        near = self.other.nearest(x)
        return x, near.gap, np.concatenate([near.beyond, near.gap[..., None] - self.levels], axis=-1)


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
    none, share = np.full(len(low), -1), np.zeros(len(low))
    at, scale = (np.tile(each, (len(low), 1)) for each in (at, scale))
    return Patches(outer, uniform, at, scale, low, high, none, none, share, share > 0, 0.0 * low)


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
            cost = f"{what} {self.projected(ahead):.1g} pairs of points"
            raise OutOfReachError(f"{text}: {cost}; ask for less, or smaller surfaces.")


class Rules:
    """Values of an integrand over patches by rules of some orders; raises InputError before they take too long."""

    def __init__(self, integrand: Integrand, search: int, budget: Budget) -> None:
        """Store the integrand, the cost of a projection onto the other surface in points, and the budget."""
        self.integrand, self.search, self.budget, self.points = integrand, search, budget, 0
        self.each: dict[int, float] = {}  # pairs of points for each outer point, by the level inside

    def __call__(self, patches: Patches, levels: Levels, inside: Levels) -> Array:
        """Return integrals (n, ...) over each patch, with the orders of its level and of its level inside."""
        found: dict[int, Array] = {}
        ranks = np.stack([levels, inside, patches.along], axis=1)
        for rank in np.unique(ranks, axis=0):
            where = np.flatnonzero((ranks == rank).all(axis=1))
            values = self._of_order(patches[where], ORDERS[rank[0]], int(rank[1]))
            found |= dict(zip(where.tolist(), values, strict=True))
        return np.array([found[k] for k in range(len(levels))])

    def _of_order(self, patches: Patches, order: int, inside: int) -> Array:
        """Return integrals (n, ...) over each patch by one rule."""
        found, begin, is_cut = [], 0, int(patches.along[0]) >= 0
        # Of a cut one: points on two sides of the level, in several parts across, and a search on each line of nodes.
        size, searches = (2 * SIDE_PARTS * order**2, SIDE_PARTS * order * ROOT_SAMPLES) if is_cut else (order**2, 0)
        while begin < len(patches):
            # One patch at first: the number of pairs of its points is not known yet.
            each = self.each.get(inside, PAIRS_AT_ONCE) * size
            part = patches[begin : begin + max(1, int(PAIRS_AT_ONCE / each))]
            x, area = part.nodes(order)
            values, together = self.integrand(x.reshape(-1, 3), inside)
            points = together + (area.size + len(part) * searches) * self.search
            found.append(np.einsum("nk...,nk->n...", values.reshape(*area.shape, *values.shape[1:]), area))
            self.points += points
            self.budget.spent += points + RULE_COST
            begin += len(part)
            self.budget.refuse_beyond(self.budget.spent + points / len(part) * (len(patches) - begin))
            self.each[inside] = together / area.size
        return np.concatenate(found)


class PatchResults(NamedTuple):
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
        kept = [np.concatenate([own[~gone], other]) for own, other in zip(self[1:], others[1:], strict=True)]
        return PatchResults(self.patches[~gone].joined(others.patches), *kept)


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
        for mask, level, changes in ((deeper, known.inside, known.within), (raised, known.level, known.over)):
            if not mask.any():
                continue
            level[mask] += 1
            finer = rules(known.patches[mask], known.level[mask], known.inside[mask])
            if known.patches.first_level == FIRST_LEVEL:
                changes[mask, 1] = changes[mask, 0]
            changes[mask, 0] = finer - known.value[mask]
            known.value[mask] = finer
        known.stalled[raised] = (known.level[raised] > FIRST_LEVEL) & (
            _largest(known.over[raised], size) * LEAST_GAIN > over[raised]
        )
        if halved.any():
            halves = known.patches[halved].halved().left()
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

    def changes(over: int, within: int) -> Array:
        """Return the last two changes (n, 2, ...); zero if the earlier one is not known."""
        steps = range(1, patches.first_level + 1)
        found = [value, *(rules(patches, level - k * over, inside - k * within) for k in steps)]
        both = [a - b for a, b in pairwise(found)]
        return np.stack([*both, np.zeros_like(value)][:2], axis=1)

    over = changes(1, 0)
    within = changes(0, 1) if nested else np.zeros_like(over)
    return PatchResults(patches, level.copy(), inside.copy(), value, over, within, np.zeros(len(level), dtype=bool))


def _largest(changes: Array, size: Array) -> Array:
    """Return the largest errors (n,) of patches over all entries; no less than the change before the last suggests."""
    entries = tuple(range(1, changes.ndim - 1))
    last, before = (np.abs(changes[:, k] / size).max(axis=entries, initial=0.0) for k in range(2))
    return np.asarray(np.maximum(last, before / LEAST_GAIN))


def with_levels(patches: Patches, other: Surface, levels: Sequence[float], noise: float, rtol: float) -> Patches:
    """Return patches of a surface with the gap levels and edges of the other surface that divide them."""
    for k in range(2):
        if not patches.uniform[k]:
            # Points of least gap, towards which patches are graded, must be at corners of patches.
            around = (patches.low[:, k] < 0) & (patches.high[:, k] > 0)
            patches = patches[~around].joined(patches[around].cut(k, 0.0))
    found = replace(patches, other=other, levels=tuple(levels), noise=noise).marked()
    if any(found.uniform):
        # Nothing varies across a direction: patches are divided at their levels once and for all.
        k = found.uniform.index(False)
        for _ in range(len(levels) + len(other.edges)):
            passed, rest = found[found.along == k], found[found.along != k]
            if not len(passed):
                break
            found = rest.joined(passed.cut(k, passed.crossing(k, passed.low[:, 1 - k]))).marked()
        return found
    for _ in range(CUT_HALVINGS - math.floor(math.log2(rtol) / 2)):
        slight = (found.along >= 0) & (found.share < SLIGHT_CUT)
        if found.crossed.sum() <= MOST_CROSSED:
            slight |= found.crossed
        if not slight.any():
            break
        found = found[~slight].joined(found[slight].halved())
    return found.left()
