"""Integrals over the outer of two surfaces: patches around each place that is near, divided until they are accurate.

Each place has a rectangle of parameters, in which nodes gather around it; a patch is no larger than the grain of the
surfaces. Patches on which two rules do not agree have more points, or are divided. What is looked at thus does not
depend on the accuracy, so that no place is missed at a low one.

Source: Bentley (1975), doi 10.1145/361002.361007, for rectangles around points; Berntsen, Espelid & Genz (1991),
doi 10.1145/210232.210233, for the adaptive subdivision of many regions at a time.
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
from surfacechem.surfaces.nearest_places import NearPlaces, near_places
from surfacechem.surfaces.nodes import LAST_LEVEL, ORDERS, alike_along, alike_around, gauss_rule, is_round, piece_edges
from surfacechem.surfaces.projection import FIRST_ORDER, POLE, Array, Surface
from surfacechem.surfaces.shapes import Disc, Plane
from surfacechem.tolerances import NEGLIGIBLE

LEAST_GAIN, FIRST_LEVEL = 4.0, 2
"""A rule of a level above enough gains as much at least, or the patch is divided; enough are those below to tell."""

HIGHER_START = NEGLIGIBLE, NEGLIGIBLE**3
"""Accuracies from which on patches in one direction begin with a rule of one more level: their points cost little."""

MOST_POINTS = 200_000_000
"""Pairs of points, of one integral or of all over an approach, after which an accuracy is out of reach: minutes."""

RULE_COST = 10_000
"""Pairs of points that take as long as any use of a rule, however few its points are."""

JUDGED_PART = 8
"""Part of the most points, one over this, after which it is seen whether the error of an integral falls fast enough,
since there were as many times fewer.
"""

FIRST_INTEGRALS = 2
"""Integrals of an approach that tell what all of them take: the nearest, and one that is farther."""

PAIRS_AT_ONCE = 400_000
"""Pairs of points that are looked at together."""

CONTACT_GAP = 2.0**-20
"""Fraction of the size of a surface below which a gap is one of contact."""

Levels = NDArray[np.int_]
"""Index of the order that each patch has."""

Integrand = Callable[[Array, int], tuple[Array, int]]
"""Values (n, ...) per area at points (n, 3), with rules of a level inside, and how many were looked at together."""


@dataclass(frozen=True)
class Patches:
    """Patches of a surface between substituted parameters ``low`` and ``high`` (n, 2), around ``at`` with ``scale``
    (n, 2); directions in which nothing changes have two nodes.
    """

    surface: Surface
    at: Array
    scale: Array
    low: Array
    high: Array
    alike: tuple[bool, bool]

    arrays: ClassVar[Sequence[str]] = ("at", "scale", "low", "high")
    """Names of the arrays with an entry for each patch."""

    @property
    def kinds(self) -> Levels:
        """Numbers (n,): patches of one kind have rules of as many points."""
        return np.zeros(len(self), dtype=int)

    @property
    def fewest(self) -> int:
        """Level of the rule that patches begin with: of few patches two rules may agree where neither is right."""
        return FIRST_LEVEL if any(self.alike) else 1

    def __getitem__(self, chosen: NDArray[Any] | slice) -> Self:
        """Some of the patches."""
        return replace(self, **{name: getattr(self, name)[chosen] for name in self.arrays})

    def __len__(self) -> int:
        """Number of patches."""
        return len(self.at)

    def nodes(self, order: int) -> tuple[Array, Array]:
        """Points (n, k, 3) of a rule, and their areas (n, k); all patches are of one kind."""
        (u, du), (v, dv) = (self.parameters(k, *self.rule(k, order)) for k in range(2))
        u, v = np.broadcast_arrays(u[:, :, None], v[:, None, :])
        return self.points(np.stack([u, v], axis=-1), du[:, :, None] * dv[:, None, :])

    def most(self, order: int) -> int:
        """Points of a rule on each, at most; all patches are of one kind."""
        return order**2

    def cost(self, order: int) -> int:
        """Pairs of points that take as long as finding those of a rule."""
        return 0 * order

    def points(self, at: Array, lengths: Array) -> tuple[Array, Array]:
        """Points (n, k, 3) at parameters (n, ..., 2), and their areas (n, k) from products of lengths (n, ...)."""
        x, areas = self.surface.elements(at.reshape(len(at), -1, 2))
        return x, areas * lengths.reshape(len(at), -1)

    def rule(self, k: int, order: int) -> tuple[Array, Array]:
        """Nodes and weights (n, m) along a direction."""
        ends = np.stack([self.low[:, k], self.high[:, k]], axis=1)
        if not self.alike[k]:
            return gauss_rule(ends, order)
        middle, half = ends.mean(axis=1)[:, None], np.diff(ends) / 2
        # Across a closed direction what points there cancels, along a length Gauss's rule of two points.
        shift = half / 2 if self.surface.shape.closed[k] else half / math.sqrt(3)
        return middle + shift * [-1, 1], half * np.ones(2)

    def parameters(self, k: int, t: Array, w: Array | float = 1.0) -> tuple[Array, Array]:
        """Parameters (n, ...) from substituted ones along a direction, and their lengths for some weights."""
        shape = -1, *[1] * (t.ndim - 1)
        at, scale = self.at[:, k].reshape(shape), self.scale[:, k].reshape(shape)
        if self.alike[k]:
            return at + scale * t, scale * w
        return at + scale * np.sinh(t), scale * np.cosh(t) * w

    def line(self, k: int, count: int) -> Array:
        """Parameters along a direction, from end to end of all patches; graded where they are around one place."""
        ends = [self.parameters(k, edge[:, k, None])[0] for edge in (self.low, self.high)]
        low, high = float(ends[0].min()), float(ends[1].max())
        if self.alike[k] or np.ptp(self.at[:, k]):
            return np.linspace(low, high, count)
        t = np.arcsinh((np.array([low, high]) - self.at[0, k]) / self.scale[0, k])
        return np.asarray(self.at[0, k] + self.scale[0, k] * np.sinh(np.linspace(t[0], t[1], count)))

    def halved(self) -> Self:
        """Their halves in each direction in which something changes."""
        found = self
        for k in range(2):
            if not self.alike[k]:
                found = found.cut(k, (found.low[:, k] + found.high[:, k]) / 2)
        return found

    def cut(self, k: int, at: Array | float) -> Self:
        """Parts below substituted parameters (n,) along a direction, followed by the parts above."""
        low, high = self.low.copy(), self.high.copy()
        low[:, k] = high[:, k] = at
        return replace(self, high=high).joined(replace(self, low=low))

    def joined(self, *others: Self) -> Self:
        """These patches and others."""
        parts: dict[str, Any] = {
            name: np.concatenate([getattr(part, name) for part in (self, *others)]) for name in self.arrays
        }
        return replace(self, **parts)


def outer_patches(
    outer: Surface, inner: Surface, size: float, reach: float, budget: Budget
) -> tuple[Patches, NearPlaces]:
    """The patches of a surface, graded towards the other up to a ``reach`` [m], and where that is nearest; the search
    for that is part of the ``budget``.
    """
    if type(outer.shape) is Plane and is_round(outer.shape) and outer.shape.tilt == 0:
        # Polar coordinates, in which nothing may change around an axis.
        polar = Surface(Disc(), outer.upper, outer.approach)
        outer = polar if alike_around(polar, inner) else outer
    alike = alike_along(outer, inner), alike_around(outer, inner)
    grain = min(outer.shape.grain, inner.shape.grain)
    near = near_places(outer, inner, size, alike, grain, budget.take)
    tangents = outer.derivatives(near.at, FIRST_ORDER)[1:]
    lengths = np.maximum(np.linalg.norm(tangents, axis=-1).T, POLE)
    first, low, high = near.at[0], *np.transpose(outer.shape.span)
    # Bodies that are far apart see each other from as far. A parameter without end is a distance from the axis or along
    # it, and where a surface is steep it is as much flatter: the root of its radius grows like the length of a step.
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
    # Lengths of a direction in which nothing changes are those of the parameter.
    scales = np.where(alike, 1.0, scales)
    rectangles = around_each(at, low, high, lengths[0])
    patches = [
        _patches(outer, at[k], scales[k], box, np.where(alike, math.inf, grain / lengths[k]), alike)
        for k, box in rectangles
    ]
    return patches[0].joined(*patches[1:]), near


def around_each(at: Array, low: Array, high: Array, lengths: Array) -> list[tuple[int, tuple[Array, Array]]]:
    """A rectangle around each of some places (n, 2) within one, cut where they are the farthest apart."""
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
    outer: Surface, at: Array, scale: Array, box: tuple[Array, Array], grain: Array, alike: tuple[bool, bool]
) -> Patches:
    """Patches of one rectangle of parameters."""
    pairs = []
    for k in range(2):
        ends = (np.stack(box)[:, k] - at[k]) / scale[k]
        if alike[k]:
            edges = ends
        else:
            ends = np.arcsinh(ends)
            edges = piece_edges(ends[:1], ends[1:], grain[k] / scale[k])[0]
        pairs.append(list(pairwise(edges)))
    low, high = np.moveaxis(np.array([(a, b) for a in pairs[0] for b in pairs[1]]), 2, 0)
    return Patches(outer, np.tile(at, (len(low), 1)), np.tile(scale, (len(low), 1)), low, high, alike)


class OutOfReachError(InputError):
    """An accuracy takes too many pairs of points."""


class Budget:
    """Cost of integrals, at least so many together, in pairs of points; OutOfReachError before it is too much."""

    def __init__(self, rtol: float) -> None:
        """Begin a budget for an accuracy that messages name."""
        self.rtol, self.integrals, self.done, self.spent = rtol, 1, 0, 0.0

    def whole(self, ahead: float) -> float:
        """Least cost of all integrals, where those that are done and the next one take so much."""
        return ahead * max(1.0, self.integrals / max(self.done + 1, FIRST_INTEGRALS))

    def take(self, points: int) -> None:
        """Count so many pairs of points that are next; OutOfReachError where they are too many."""
        self.spent += points
        self.refuse_beyond(self.spent)

    def refuse_beyond(self, ahead: float) -> None:
        """Raise OutOfReachError where that is too much."""
        if self.whole(ahead) > MOST_POINTS:
            text = f"the accuracy {self.rtol:.2g} of an integral over the surfaces is out of reach"
            what = f"{self.integrals} of them take" if self.integrals > 1 else "it takes"
            raise OutOfReachError(
                f"{text}: {what} {self.whole(ahead):.1g} pairs of points; ask for less, or smaller surfaces."
            )


class Rules:
    """Values of an integrand over patches by rules of some orders; InputError before they take too long."""

    def __init__(self, integrand: Integrand, search: int, budget: Budget) -> None:
        """Take the points that a projection to the other surface costs, and the budget."""
        self.integrand, self.search, self.budget, self.points = integrand, search, budget, 0
        self.each: dict[int, float] = {}  # pairs of points of one outer point, by the level inside

    def __call__(self, patches: Patches, levels: Levels, inside: Levels) -> Array:
        """Integrals (n, ...) over each patch, with the order of its level, and with that of another one inside."""
        found: dict[int, Array] = {}
        ranks = np.stack([levels, inside, patches.kinds], axis=1)
        for rank in np.unique(ranks, axis=0):
            where = np.flatnonzero((ranks == rank).all(axis=1))
            values = self._of_order(patches[where], ORDERS[rank[0]], int(rank[1]))
            found |= dict(zip(where.tolist(), values, strict=True))
        return np.array([found[k] for k in range(len(levels))])

    def _of_order(self, patches: Patches, order: int, inside: int) -> Array:
        """Integrals (n, ...) over each patch by one rule."""
        found, begin = [], 0
        while begin < len(patches):
            # One patch at first, as nobody knows yet how many pairs its points have.
            each = self.each.get(inside, PAIRS_AT_ONCE) * patches.most(order)
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
    """Results on some patches: levels of the rules over and inside each, values (n, ...), their changes with the last
    rule over it and inside it, and with the one before (n, 2, ...), and whether a higher order gained little.
    """

    patches: Patches
    level: Levels
    inside: Levels
    value: Array
    over: Array
    within: Array
    stuck: NDArray[np.bool_]

    def but(self, gone: NDArray[np.bool_], others: PatchResults) -> PatchResults:
        """The results without those of some patches, and with others."""
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
    """Integral over patches, its error relative to the ``sizes`` of the entries, no larger than what is ``left`` to it,
    and how many points it took.

    A ``nested`` integrand is a sum itself, with an error of its own; each of its points has a projection to the other
    surface that costs as much as ``search`` points. InputError where it takes more than its budget.
    """
    first = patches.fewest if not any(patches.alike) else FIRST_LEVEL + sum(left < goal for goal in HIGHER_START)
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
        if budget.whole(budget.spent) > MOST_POINTS / JUDGED_PART and met[-1][0] > JUDGED_PART * met[0][0]:
            budget.refuse_beyond(before + _expected(met, left))
        rank = np.argsort(over + within)
        worst = np.zeros(len(over), dtype=bool)
        worst[rank[~(np.cumsum((over + within)[rank]) <= left / 2)]] = True
        deeper = worst & (within > over)
        halved = worst & ~deeper & (known.stuck | (known.level == LAST_LEVEL))
        raised = worst & ~deeper & ~halved
        for mask, steps in ((deeper, (0, 1)), (raised, (1, 0))):
            if mask.any():
                _raise_level(rules, known, mask, steps)
        known.stuck[raised] = (known.level[raised] > FIRST_LEVEL) & (
            _largest(known.over[raised], size) * LEAST_GAIN > over[raised]
        )
        if halved.any():
            halves = known.patches[halved].halved()
            # A rule on half of a patch is as good as one of higher order.
            times = len(halves) // int(halved.sum())
            start, inside = np.maximum(known.level[halved] - 1, patches.fewest), known.inside[halved]
            known = known.but(halved, _start(rules, halves, np.tile(start, times), np.tile(inside, times), nested))


def _expected(met: Sequence[tuple[float, float]], rtol: float) -> float:
    """Points at which the error is that asked for, if it goes on to fall with the power of them with which it did."""
    points, error = met[-1]
    fewer, before = next(item for item in met[::-1] if item[0] <= points / JUDGED_PART or item is met[0])
    gain, more = math.log(max(before / error, 1.0)), math.log(points / fewer) if points > fewer else 1.0
    return points * (error / rtol) ** (more / gain) if gain > NEGLIGIBLE else points


def _start(rules: Rules, patches: Patches, level: Levels, inside: Levels, nested: bool) -> PatchResults:
    """Results on patches by rules of some levels and of those before."""
    value = rules(patches, level, inside)
    steps = range(1, patches.fewest + 1)
    over = _changes(value, *(rules(patches, level - k, inside) for k in steps))
    within = np.zeros_like(over)
    if nested:
        within = _changes(value, *(rules(patches, level, inside - k) for k in steps))
    return PatchResults(patches, level.copy(), inside.copy(), value, over, within, np.zeros(len(level), dtype=bool))


def _changes(value: Array, before: Array, first: Array | None = None) -> Array:
    """The last change of values (n, ...) and the one before (n, 2, ...), none where that is not known."""
    return np.stack([value - before, np.zeros_like(before) if first is None else before - first], axis=1)


def _raise_level(rules: Rules, known: PatchResults, mask: NDArray[np.bool_], steps: tuple[int, int]) -> None:
    """Rules of a higher level over, or inside, some patches."""
    known.level[mask] += steps[0]
    known.inside[mask] += steps[1]
    finer = rules(known.patches[mask], known.level[mask], known.inside[mask])
    changes = known.over if steps[0] else known.within
    if known.patches.fewest == FIRST_LEVEL:
        changes[mask, 1] = changes[mask, 0]
    changes[mask, 0] = finer - known.value[mask]
    known.value[mask] = finer


def _largest(changes: Array, size: Array) -> Array:
    """Errors (n,) of patches, the largest of all entries; what the change before the last says may have been missed."""
    entries = tuple(range(1, changes.ndim - 1))
    last, before = (np.abs(changes[:, k] / size).max(axis=entries, initial=0.0) for k in range(2))
    return np.asarray(np.maximum(last, before / LEAST_GAIN))
