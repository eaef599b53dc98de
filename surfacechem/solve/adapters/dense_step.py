"""Steps of any library's integrator with dense output, the first zero of a guard in a step, and the ledger along it."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from surfacechem.solve.contract import Array, Guard
from surfacechem.solve.equilibria import zero
from surfacechem.tolerances import FORMULA_EPS, SQRT_EPS

GUARD_POINTS = 16
"""Points of a step at which guards are evaluated; a pair of zeros between two points shows as a minimum."""


class DenseStep(NamedTuple):
    """A step from ``start`` to ``end`` [s], with the variables at any time in it.

    ``many`` returns the variables at several times, a row each, if a library can do that at once; ``ledger`` is the
    change of the ledger since the library started, if the library integrates it.
    """

    start: float
    end: float
    y: Callable[[float], Array]
    many: Callable[[Array], Array] | None = None
    ledger: Callable[[float], Array] | None = None

    def rows(self, times: Array) -> Array:
        """Return the variables at several times, a row each."""
        return self.many(times) if self.many else np.array([self.y(t) for t in times.tolist()])


@dataclass(frozen=True)
class Steps:
    """Consecutive steps, each made on demand.

    ``times`` are the start of the first and the ends of all; ``inside`` [step, node, variable] are the variables at
    NODES except the first, if they are known.
    """

    times: Array
    step: Callable[[int], DenseStep]
    inside: Array | None = None

    @classmethod
    def of(cls, steps: Sequence[DenseStep]) -> "Steps":
        """Return the steps of a list."""
        return cls(np.array([steps[0].start, *(step.end for step in steps)]), steps.__getitem__)

    def since(self, first: int) -> Callable[[int], DenseStep]:
        """Return the steps from one of them on."""
        return lambda k: self.step(first + k)

    def at_nodes(self, times: Array) -> Array:
        """Return the variables at these times [node, step] of NODES except the first; the last step may be cut."""
        count = times.shape[1]
        known = 0 if self.inside is None else count - bool(times[-1, -1] < self.times[count])
        rows = [self.step(k).rows(times[:, k])[:, None] for k in range(known, count)]
        if self.inside is not None:
            rows.insert(0, self.inside[:known].swapaxes(0, 1))
        return np.concatenate(rows, axis=1).reshape(times.size, -1)


@dataclass
class Guards:
    """Event functions of time and variables, each with its side of zero.

    A side is 1 or -1; it is 0 for a guard that starts at zero or has just fired, until it has left zero. ``largest`` is
    the largest magnitude of each so far, to which its roundoff is proportional; ``now`` are the latest values. ``due``
    are limits that started at zero or beyond and have not left yet: they fire if they fall. ``rows`` evaluates the
    guards at several times at once, a row each, if that is possible.
    """

    values: Callable[[float, Array], Array]
    directions: Array
    strict: NDArray[np.bool_]
    limits: NDArray[np.bool_]
    largest: Array
    rows: Callable[[Array, Array], Array] | None = None
    sides: Array = field(init=False)
    now: Array = field(init=False)
    due: NDArray[np.bool_] = field(init=False)

    @classmethod
    def of(cls, kinds: Sequence[Guard], values: Callable[[float, Array], Array], seen: Array | None = None) -> "Guards":
        """Return the guards of a problem, with the largest magnitudes ``seen`` before, if any."""
        directions = np.array([float(kind.direction) for kind in kinds])
        strict = np.array([kind.strict for kind in kinds], dtype=bool)
        limits = np.array([kind.terminal and kind.direction <= 0 for kind in kinds], dtype=bool)
        return cls(values, directions, strict, limits, np.zeros(len(kinds)) if seen is None else seen.copy())

    def start(self, now: Array, fired: Iterable[int] = ()) -> None:
        """Set the sides of zero from these values; guards that have just fired have none."""
        self.largest = np.fmax(self.largest, np.abs(now))
        self.sides = np.sign(now)
        self.sides[list(fired)] = 0.0
        self.now = now
        self.due = self.limits & np.isfinite(now) & (now <= FORMULA_EPS * self.largest)
        self.due[list(fired)] = False

    def follow(self, now: Array) -> None:
        """Update sides and magnitudes with these values, if no guard has fired before them."""
        self.largest = np.fmax(self.largest, np.abs(now))
        left = np.abs(now) > np.where((self.sides != 0.0) & ~self.strict, 0.0, FORMULA_EPS * self.largest)
        self.sides = np.where(left, np.sign(now), self.sides)
        self.due &= np.abs(self._change_of_due(now)) <= FORMULA_EPS * self.largest
        self.now = now

    def _change_of_due(self, now: Array) -> Array:
        """Return the change of the due guards since the last values; zero for the others, which may be infinite."""
        return np.subtract(now, self.now, out=np.zeros_like(now), where=self.due)

    def crossed(self, now: Array) -> NDArray[np.bool_]:
        """Return a mask of guards across zero in a direction that counts; strict ones by more than their roundoff."""
        across = np.where(self.strict, now < -FORMULA_EPS * self.largest, now * self.sides <= 0.0)
        return across & (self.sides != 0.0) & (self.sides * self.directions <= 0.0)

    def at_zero(self, now: Array, active: NDArray[np.bool_]) -> list[int]:
        """Return the kinks that these values have brought to zero within roundoff, in a direction that counts."""
        counts = active & ~self.limits & (self.sides != 0.0) & (self.sides * self.directions <= 0.0)
        near = np.isfinite(self.largest) & (np.abs(now) <= FORMULA_EPS * self.largest)
        return np.flatnonzero(counts & near).tolist()

    def fallen(self, now: Array) -> NDArray[np.bool_]:
        """Return a mask of the due guards that have fallen to these values."""
        return self.due & (self._change_of_due(now) < -FORMULA_EPS * self.largest)

    def far(self, values: Array, active: NDArray[np.bool_]) -> int:
        """Count the first steps in which guards change by less than their distance from zero, and follow them.

        ``values`` [point, step, guard] are those at some points of consecutive steps, from the start of each to its
        end. Most guards are bounds of states that stay far from them throughout a run. One that moves one way only,
        as a coverage that grows from nothing, may change by that much in a step if not from one point to the next.
        """
        rows = np.where(active, values, 1.0)
        heights = rows * np.where(active & (self.sides < 0.0), -1.0, 1.0)
        lowest, highest = heights.min(axis=0), heights.max(axis=0)
        clear = lowest > highest - lowest
        if not clear.all():
            changes, nearer = np.diff(heights, axis=0), np.minimum(heights[1:], heights[:-1])
            one_way = np.all(changes >= 0.0, axis=0) | np.all(changes <= 0.0, axis=0)
            clear |= one_way & np.all(np.abs(changes) < nearer, axis=0)
        clear = clear & (~active | (self.sides != 0.0) & ~self.due) | (lowest == 0.0) & (highest == 0.0)
        near = int(clear.argmin())
        count = len(clear) if clear.flat[near] else near // len(active)
        if count:
            self.largest = np.fmax(self.largest, np.where(self.sides == 0.0, 0.0, highest[:count].max(axis=0)))
            self.now = rows[-1, count - 1].copy()
        return count

    def untouched(self, times: Array, step: DenseStep, active: NDArray[np.bool_]) -> bool:
        """True if all active guards stay on their sides at these times of a step, its start first, with no dip between;
        they are then updated.
        """
        if self.rows is None:
            return False
        rows = np.vstack((self.now, self.rows(times[1:], step.rows(times[1:]))))
        values = np.where(active, rows, 1.0)
        heights = values * self.sides
        quiet = bool(np.all(heights > 0.0)) and not np.any(_may_dip(self, times, values))
        if quiet:
            largest = np.fmax.accumulate(np.fmax(self.largest, np.abs(values)))
            changes = np.diff(np.where(self.due, values, 0.0), axis=0)
            self.due &= np.all(np.abs(changes) <= FORMULA_EPS * largest[1:], axis=0)
            self.largest, self.now = largest[-1], values[-1]
        return quiet


def first_crossing(
    step: DenseStep, guards: Guards, active: NDArray[np.bool_], resolution: float
) -> tuple[float, list[int]]:
    """Return the time of the first zero of the active guards in a step, and all that are zero within the resolution.

    Without a zero these are the end of the step and an empty list, and the guards are updated. A guard that crosses
    zero twice between two points is found where its values allow a minimum below zero. Times are in s.
    """

    def at(t: float) -> Array:
        return np.where(active, guards.values(t, step.y(t)), 1.0)

    def one(i: int) -> Callable[[float], float]:
        return lambda t: float(guards.sides[i] * at(t)[i])

    def dips(points: Sequence[tuple[float, Array]]) -> dict[int, float]:
        at_times, values = map(np.array, zip(*points, strict=True))
        low = np.flatnonzero(_may_dip(guards, at_times, values)).tolist()
        bottoms = {i: _bottom(one(i), *at_times.tolist()) for i in low}
        return {i: _zero(one(i), points[0][0], x) for i, x in bottoms.items() if guards.crossed(at(x))[i]}

    times = np.unique(np.linspace(step.start, step.end, GUARD_POINTS + 1))  # fewer in a step of few roundings
    if guards.due.any():
        # Motion that begins as a power of time may have either sign on the polynomial inside; its end is right.
        soon, late = guards.fallen(at(times[1])), guards.fallen(at(times[-1]))
        if np.any(fallen := np.where(guards.sides != 0.0, soon, late) & active):
            return step.start, np.flatnonzero(fallen).tolist()
    if guards.untouched(times, step, active):
        return step.end, []
    points = [(step.start, np.where(active, guards.now, 1.0))]
    for t in times[1:].tolist():
        points.append((t, at(t)))
        last, now = points[-2][0], points[-1][1]
        zeros = dips(points[-3:]) if len(points) > 2 else {}
        zeros |= {i: _zero(one(i), last, t) for i in np.flatnonzero(guards.crossed(now) & active).tolist()}
        if zeros:
            # Another guard may cross and return in the same interval; it is then still rising at its end.
            near = t - SQRT_EPS * (step.end - step.start)
            if last < near < t:
                zeros = dips([points[-2], (near, at(near)), points[-1]]) | zeros
            first = min(zeros.values())
            return first, [i for i, zero in sorted(zeros.items()) if zero <= first + resolution]
        guards.follow(now)
    return step.end, []


def _zero(value: Callable[[float], float], low: float, high: float) -> float:
    """Return the zero of a function positive at the lower end; next to that end if roundoff makes it negative."""
    at_low, at_high = value(low), value(high)
    if not at_low > 0.0 > at_high:
        return high if at_high == 0.0 else float(np.nextafter(low, high))
    return zero(value, (low, high), (at_low, at_high))


def _may_dip(guards: Guards, times: Array, values: Array) -> NDArray[np.bool_]:
    """Return a mask of triples [time, guard] with a middle minimum so low that a smooth guard may reach zero."""
    heights, steps = guards.sides * values, np.diff(times)[:, None]
    before, middle, after = heights[:-2], heights[1:-1], heights[2:]
    steepest = np.maximum((before - middle) / steps[:-1], (after - middle) / steps[1:])
    counts = (guards.sides != 0.0) & (guards.sides * guards.directions <= 0.0)
    lowest = (middle > 0.0) & (middle < before) & (middle < after)
    return np.asarray(counts & lowest & (middle <= steepest * (steps[:-1] + steps[1:])))


def _bottom(value: Callable[[float], float], a: float, b: float, c: float) -> float:
    """Return the minimum between a and c, or the first point across zero met in the search.

    By parabolas, or a tenth of the larger part where these make no progress, to the accuracy with which values
    determine a minimum (after Brent 1973, Algorithms for Minimization without Derivatives, chapter 5).
    """
    at_a, at_b, at_c = value(a), value(b), value(c)
    while at_b > 0.0 and c - a > SQRT_EPS * (abs(b) + (c - a)):
        left, right = (b - a) * (at_b - at_c), (b - c) * (at_b - at_a)
        curvature = left - right  # zero if the values underflow
        x = b - 0.5 * ((b - a) * left - (b - c) * right) / curvature if curvature else b
        if not (a < x < c and abs(x - b) > 0.01 * (c - a)):  # no progress: into the larger part
            x = b + 0.1 * (c - b) if c - b > b - a else b - 0.1 * (b - a)
        at_x = value(x)
        if at_x < at_b:
            (a, at_a, c, at_c) = (b, at_b, c, at_c) if x > b else (a, at_a, b, at_b)
            b, at_b = x, at_x
        elif x > b:
            c, at_c = x, at_x
        else:
            a, at_a = x, at_x
    return b


NODES = np.array([0.0, 0.11747233803526766, 0.35738424175967742, 0.64261575824032258, 0.88252766196473235, 1.0])
"""Gauss-Lobatto points of a step: the libraries' polynomials have at most order five."""


HERMITE = np.linalg.inv(
    [[power.deriv(k)(x) for power in map(np.polynomial.Polynomial, np.identity(6))] for x in (-1, 0) for k in range(3)]
)
"""Matrix from values, slopes and second derivatives at -1 and at 0 to the coefficients of their polynomial."""

DERIVATIVES = np.tile(np.arange(3.0), 2)
"""Orders of these derivatives."""

AT_NODES = np.power.outer(NODES[1:] - 1.0, np.arange(6.0))
"""Powers of (time - end) / size at the nodes except the first."""


def hermite(sizes: Array, ends: Array) -> Array:
    """Return coefficients [step, power, variable] of polynomials in (time - end) / size of consecutive steps.

    They interpolate value, slope and second derivative at the ends: [end, derivative, variable].
    """
    scales = np.power.outer(sizes, DERIVATIVES)[..., None]
    return np.asarray(HERMITE @ (np.concatenate((ends[:-1], ends[1:]), axis=1) * scales))


def at_nodes(rows: Array) -> Array:
    """Return the values [step, node, variable] of such polynomials at the nodes except the first."""
    return np.asarray(AT_NODES @ rows)


def on_step(end: float, size: float, rows: Array, t: Any) -> Array:
    """Evaluate one such polynomial at a time, or at several in a row each; a step of size zero has its end value.

    >>> on_step(1.0, 0.5, np.array([[2.0], [4.0]]), 0.75), on_step(1.0, 0.0, np.array([[2.0], [4.0]]), 1.0)
    (array([0.]), array([2.]))
    """
    part = (t - end) / size if size else np.zeros_like(t)
    return np.asarray(np.power.outer(part, np.arange(len(rows))) @ rows)


TO_POWERS = np.linalg.inv(np.vander(NODES, increasing=True)) / np.arange(1.0, len(NODES) + 1)[:, None]
"""Matrix from values at the nodes to the coefficients of the integral of their polynomial."""

WEIGHTS = 1 / (30 * np.polynomial.Legendre.basis(5)(2 * NODES - 1) ** 2)
"""Quadrature weights of the values at the nodes over the whole step."""


def gained_at(part: float, rates: Array) -> Array:
    """Return the change of the ledger up to a part of a step, per length of the step, from its rates at the nodes.

    The libraries do not integrate the ledger: they would need it in their error norm to integrate it well, and a state
    at rest, which needs no steps, may still do work.
    """
    return np.asarray(part ** np.arange(1.0, len(NODES) + 1) @ (TO_POWERS @ rates))
