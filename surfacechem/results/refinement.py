"""Choice of outputs that resolve a run: the subset of all known states that linear interpolation needs.

Known states are the ends of steps, both sides of events and breakpoints, the times at which runs are compared, and the
states that the stepper adds inside steps that are too long for a straight line. The subset is sufficient if straight
lines between outputs, over time and over its logarithm, miss no quantity by more than a part of its range. Where
quantities bend between two known states, the run is repeated from one to the other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np

from surfacechem.results.spatial import layer_starts, unresolved
from surfacechem.solve import solver
from surfacechem.solve.contract import Array, Index, Mask, States, among
from surfacechem.solve.radau.solver import consistent
from surfacechem.solve.run import ROWS_AT_ONCE, Trajectory
from surfacechem.tolerances import EPS, FINER_BY, RUN_ERROR

SHARED_DENSITY = 2
"""Ratio of the density of shared outputs of many runs to that of the run with the densest outputs."""

MOST_REFINED, PARTS_REFINED, REFINEMENT_ROUNDS = 100, 16, 2
"""Largest numbers of intervals of a block that are refined, of parts of each, and of rounds."""


def _two_sided(t: Array) -> tuple[Array, Mask]:
    """Return increasing times and the mask of rows to keep. Of rows with one time, the first is moved to just before
    it, and only the first and the last are kept.
    """
    same = t[1:] <= t[:-1]
    if not same.any():
        return t, np.ones(len(t), bool)
    begins, ends = np.append(True, ~same), np.append(~same, True)
    moved = np.where(begins & ~ends & (t > 0), np.nextafter(t, -1.0), t)
    kept = (begins & (t > 0)) | ends
    # If another row lies at the time to which one was moved, the one next to the event is kept.
    rows = np.flatnonzero(kept)
    kept[rows[:-1][np.diff(moved[rows]) <= 0]] = False
    return moved, kept


def needed_rows(t: Array, values: Array, allowed: Array, kept: Mask) -> Mask:
    """Return the mask of rows whose connecting lines, over time and its logarithm, miss no value by more than allowed.

    ``values`` has shape (quantities, times), ``allowed`` one entry for each quantity; rows that are ``kept`` stay. The
    first choice is as dense as the curvature asks for; where a line misses, the worst row is added until none does.
    """
    kept = kept.copy()
    kept[[0, -1]] = True
    scaled = values / np.where(allowed > 0, allowed, np.inf)[:, None]
    ways = np.array([t, np.log(np.maximum(t, t[t > 0].min(initial=1.0)))])
    lines = np.floor(np.cumsum(_lines(ways, scaled)))
    kept[1:] |= lines > np.concatenate((np.zeros(1), lines[:-1]))
    rows = (~kept).nonzero()[0]
    while len(rows):
        ends = kept.nonzero()[0]
        interval = ends.searchsorted(rows)
        left, right, most, last = ends[interval - 1], ends[interval], np.zeros(len(ends)), np.zeros(len(ends), np.int64)
        missed = _missed(ways, scaled, left, rows, right)
        np.maximum.at(most, interval, missed)
        # The worst row of each interval that a line misses; rows in other intervals are done.
        again, worst = most[interval] > 1, ((missed > 1) & (missed == most[interval])).nonzero()[0]
        last[interval[worst]] = rows[worst]
        kept[last] = True
        rows = rows[again & ~kept[rows]]
    return kept


def _lines(ways: Array, values: Array) -> Array:
    """Return the number of lines for each interval between two rows, at most one, by the curvature over time or over
    its logarithm; ``values`` has shape (quantities, times). Each line misses two thirds of one: the curvature varies.
    """
    found = np.zeros(max(values.shape[1] - 1, 0))
    if len(found) > 1:
        rise = values[:, 1:] - values[:, :-1]
        slope, bends = np.empty_like(rise), np.empty_like(rise[:, 1:])
        for way in ways:
            length = way[1:] - way[:-1]
            with np.errstate(all="ignore"):  # no length over the logarithm before the first time
                np.divide(rise, length, out=slope)
                np.abs(np.subtract(slope[:, 1:], slope[:, :-1], out=bends), out=bends)
                bend = bends.max(axis=0, initial=0.0) / (way[2:] - way[:-2])
                # A line of this length misses its length squared times bend / 4.
                density = np.sqrt(3 / 8 * bend)
            density[~np.isfinite(density)] = 0.0
            ends = np.concatenate((density[:1], density, density[-1:]))
            found = np.fmax(found, length / 2 * (ends[1:] + ends[:-1]))
    return np.asarray(np.minimum(found, 1.0))


def _missed(ways: Array, values: Array, left: Index, rows: Index, right: Index) -> Array:
    """Return the larger error of lines over time and over its logarithm, from one row to another, at rows between them;
    ``values`` has shape (quantities, times).
    """
    start, missed = values.take(left, axis=1), np.zeros(len(rows))
    rise, risen = (np.subtract(each, start, out=each) for each in (values.take(at, axis=1) for at in (right, rows)))
    begun = ways.take(left, axis=1)
    length, passed = ways.take(right, axis=1) - begun, ways.take(rows, axis=1) - begun
    apart = start  # its memory
    for part in np.divide(passed, length, out=np.zeros_like(length), where=length > 0):
        np.multiply(part, rise, out=apart)
        np.abs(np.subtract(risen, apart, out=apart), out=apart)
        missed = np.fmax(missed, apart.max(axis=0, initial=0.0))
    return missed


def _edges(values: Array) -> Mask:
    """Return the mask of times with an extreme of a quantity, and next to a change between finite and not finite;
    ``values`` has shape (quantities, times).
    """
    found, number = np.zeros(values.shape[1], bool), np.isfinite(values)
    if not values.size:
        return found
    low = high = values
    if not number.all():
        changes = np.any(number[:, 1:] != number[:, :-1], axis=0)
        found[1:] |= changes
        found[:-1] |= changes
        low, high = np.where(number, values, np.inf), np.where(number, values, -np.inf)
    found[high.argmax(axis=1)] = True
    found[low.argmin(axis=1)] = True
    return found


@dataclass
class _Resolution:
    """Quantities over time, states and accounts included: their ranges so far, and the allowed error of lines."""

    reach: Array = field(default_factory=lambda: np.array(-np.inf))
    """Largest values with either sign, of all outputs and of those that count for ranges, shape (4, quantities)."""
    noise: Array = field(default_factory=lambda: np.array(0.0))
    """Change of each quantity by the last bit or the absolute tolerance of a state."""

    def update(self, block: Trajectory) -> None:
        """Update ranges and allowed errors with the outputs of a block."""
        values, sample, part = _finite(block.quantities), block.sample, block.run.picture or 0.0
        unknown = sample.sensitivities(EPS * np.abs(sample.result.outputs) + sample.result.problem.atol)
        known = np.zeros(len(values) - len(unknown))  # states and accounts
        self.noise = np.maximum(self.noise, np.concatenate((known, RUN_ERROR * unknown)))
        # Early rows, whose layers are unresolved, do not count for the ranges.
        late = ~unresolved(block.model.system, block.run.times[-1], block.result.times)
        parts = [values] if late.all() else [values, values[:, late]]
        sides = [(-part.min(axis=1, initial=np.inf), part.max(axis=1, initial=-np.inf)) for part in parts]
        self.reach = np.maximum(self.reach, np.concatenate((sides[0], sides[-1])))
        every, known = self.reach[:2].sum(axis=0), self.reach[2:].sum(axis=0)
        # Errors of the run need not be resolved, but they are at most this part of a value at any tolerance. The rest
        # of the part is the error of known states for the states between them.
        error = min(RUN_ERROR * block.run.rtol, part) * self.reach[:2].max(axis=0)
        self.allowed = (1 - 1 / FINER_BY) * part * np.where(known < 0, every, known) + error + self.noise
        self.varies = every > self.allowed

    def needed(self, block: Trajectory, moments: Array) -> Mask:
        """Return the mask of outputs that resolve a block, with both sides of events at these ``moments``."""
        t, values = block.result.times, block.quantities[self.varies]
        return needed_rows(t, _finite(values), self.allowed[self.varies], _sides(t, moments) | _edges(values))


def _finite(values: Array) -> Array:
    """Return values with zeros for NaN and infinity."""
    number = np.isfinite(values)
    return values if number.all() else np.where(number, values, 0.0)


def _refinements(trajectory: Trajectory, resolution: _Resolution) -> list[States]:
    """Return states between outputs where lines miss named quantities by more than is allowed.

    Named quantities may bend where states do not. Only there the run is repeated, from the output before.
    """
    result, y, rates = trajectory.result, trajectory.result.outputs, trajectory.rates
    t, segment, problem = result.times, result.segments_at(result.times, result.segment), result.problem
    lengths, room = np.diff(t), np.diff(t) / np.spacing(t[1:])  # only so many times lie between two outputs
    left = np.flatnonzero((room >= 2) & (np.diff(segment) == 0) & (t[:-1] > 0))
    right, length = left + 1, lengths[left]
    middle = t[left] + length / 2
    # The middle of the cubic Hermite interpolant.
    states = (y[left] + y[right]) / 2 + length[:, None] / 8 * (rates[left] - rates[right])
    if problem.program.algebraic_mask.any():  # quantities may be small differences of algebraic states
        parameters = problem.parameters[segment[left]]
        states = consistent(problem.program, middle, states, rates[left], parameters).y
    between = trajectory.at(States(middle, states, result.ledger_outputs[left], segment[left]))
    lines = (trajectory.outputs.take(left, axis=0) + trajectory.outputs.take(right, axis=0)) / 2
    with np.errstate(invalid="ignore"):  # quantities may be infinite
        apart = np.abs(between.outputs - lines)
    allowed, varies = (each[len(each) - apart.shape[1] :] for each in (resolution.allowed, resolution.varies))
    missed = (apart[:, varies] / allowed[varies]).max(axis=1, initial=0.0)
    if not (missed > 1).any():
        return []
    rows = np.sort(np.argsort(-missed, kind="stable")[:MOST_REFINED])
    rows = rows[missed[rows] > 1]
    bent = left[rows]
    parts = np.minimum(np.minimum(np.ceil(missed[rows]), PARTS_REFINED), room[bent]).astype(int)
    # No event lies between two outputs.
    arc = replace(problem, record_steps=False, line_error=0.0, max_seconds=None, active=(False,) * len(problem.margins))
    problems = [
        replace(arc, y0=y[i], times=np.linspace(*ends, n + 1)[1:-1], segments=np.array(ends), parameters=p[None])
        for i, n, p, ends in zip(
            bent, parts, problem.parameters[segment[bent]], zip(t[bent], t[bent + 1], strict=True), strict=True
        )
    ]
    found = solver(trajectory.run.solver).solve_all(problems)
    return [
        States(each.times, each.outputs, result.ledger_outputs[i] + each.ledger_outputs, segment[[i] * len(each.times)])
        for i, each in zip(bent, found, strict=True)
    ]


def refined(trajectory: Trajectory) -> Trajectory:
    """Return the trajectory with outputs that resolve it, instead of the times at which runs are compared."""
    rows = trajectory.known
    if trajectory.run.picture is None or len(rows.t) < 2:
        return trajectory
    t, sides = _two_sided(rows.t)
    # Times at which cells do not yet resolve a thermal layer are left out, except its start.
    system, end = trajectory.model.system, trajectory.run.times[-1]
    sides &= ~unresolved(system, end, t) | among(t, layer_starts(system, end))
    rows, which, moments = rows._replace(t=t), np.flatnonzero(sides), _event_times(trajectory)
    # Each block begins with the last row of the one before.
    blocks, resolution, found = range(0, max(len(which) - 1, 1), ROWS_AT_ONCE - 1), _Resolution(), []

    @lru_cache(maxsize=1)  # what is but one block is evaluated once
    def block(first: int) -> Trajectory:
        return trajectory.at(rows.picked(which[first : first + ROWS_AT_ONCE]))

    for first in blocks:
        resolution.update(block(first))
    for first in blocks:
        whole = block(first)
        for _ in range(REFINEMENT_ROUNDS):
            if not (bends := _refinements(whole, resolution)):
                break
            whole = whole.with_more(bends)
            resolution.update(whole)
        kept = resolution.needed(whole, moments)
        kept[-1] = first == blocks[-1]
        found.append(whole.picked(kept))
    if len(found) == 1:
        return found[0]
    return trajectory.at(States(*map(np.concatenate, zip(*(each.written for each in found), strict=True))))


def shared_times(runs: Sequence[Trajectory], most: int) -> tuple[float, ...]:
    """Return output times for all runs: everywhere as dense as those of the run with the densest outputs, or as dense
    as ``most`` times can be. If there is room, times that no line may skip in any of the runs are added.
    """
    resolved = [each for each in map(refined, runs) if len(each.result.times) > 1]  # others end at once
    own, usual = [each.result.times for each in resolved], runs[0].run.times
    every = np.unique(np.concatenate([*own, usual[-1:]]))
    if len(own) < 2:
        return tuple(every.tolist() if own else usual)
    lengths, middles, density = np.diff(every), every[:-1] + np.diff(every) / 2, np.zeros(len(every) - 1)
    for t in own:
        within = slice(None, np.searchsorted(middles, t[-1]))  # a run that was stopped has no outputs later
        each = np.diff(t)[np.searchsorted(t, middles[within], side="right") - 1]
        density[within] = np.maximum(density[within], 1 / each)
    # Two for one, since they are not at the best times of each run.
    count = np.append(0.0, np.cumsum(SHARED_DENSITY * density * lengths))
    parts = min(int(np.ceil(count[-1])) + 1, most)
    times = [np.interp(np.linspace(0, count[-1], parts), count, every), every[[0, -1]]]
    sides = [p.result.times[_sides(p.result.times, _event_times(p)) | _edges(p.result.outputs.T)] for p in resolved]
    marked = np.unique(np.concatenate([*sides, *map(_steps, resolved)]))
    return tuple(np.unique(np.concatenate([*times, marked if len(marked) <= most else []])).tolist())


def _event_times(trajectory: Trajectory) -> Array:
    """Return the times of events, in order."""
    return np.array(sorted([*trajectory.result.events.t, *(jump.t for jump in trajectory.jumps)]))


def _sides(t: Array, moments: Array) -> Mask:
    """Return the mask of times on either side of one of these moments, which are in order."""
    return among(t, moments) | among(np.nextafter(t, np.inf), moments)


def _steps(trajectory: Trajectory) -> Array:
    """Return the times on both sides of breakpoints at which a load steps; an output there is before the step."""
    t, breaks = trajectory.result.times, trajectory.result.problem.segments[1:-1]
    breaks = breaks[
        np.isin(breaks, t) & np.isin(np.nextafter(breaks, -1.0), t) & ~np.isin(breaks, _event_times(trajectory))
    ]
    return np.concatenate((breaks, np.nextafter(breaks, np.inf)))
