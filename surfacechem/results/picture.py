"""Outputs that follow a run: of all states that are known, those without which its picture would not be true.

Known are the ends of steps, both sides of events and breakpoints, the times at which runs are compared, and what the
stepper adds inside steps that are too long for a straight line. The picture is true where straight lines between
outputs, over time as over its logarithm, miss no quantity by more than a part of its range. Where quantities bend
between states that are known, the run is made again with outputs there.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from surfacechem.results.spatial import begun, unresolved
from surfacechem.solve.contract import Array, Index, Mask, States
from surfacechem.solve.run import Trajectory
from surfacechem.tolerances import UNRESOLVED

LONG = 64
"""Rows between two that are kept of which one in the middle is kept, too, where the line between the two misses any."""

BENDS, CLOSER, ROUNDS = 100, 16, 2
"""Between how many known states a run is known closer at most, in how many parts of it, and how often in turn."""


def _two_sided(t: Array) -> tuple[Array, Mask]:
    """Times that increase, and which rows to keep: where several have one time, the first, moved to just before it, and
    the last.
    """
    same = np.diff(t) <= 0
    begins, ends = np.append(True, ~same), np.append(~same, True)
    moved = np.where(begins & ~ends & (t > 0), np.nextafter(t, -1.0), t)
    kept = (begins & (t > 0)) | ends
    # Of a row that lies where another has been moved to, the one beside the event counts.
    rows = np.flatnonzero(kept)
    kept[rows[:-1][np.diff(moved[rows]) <= 0]] = False
    return moved, kept


def needed(t: Array, values: Array, allowed: Array, kept: Mask) -> Mask:
    """Rows between which straight lines over time, and over its logarithm, miss no value by more than is allowed.

    ``values`` has shape (times, quantities), ``allowed`` is for each quantity; rows that are ``kept`` are among them.
    """
    kept = kept.copy()
    kept[[0, -1]] = True
    scaled = np.divide(values, allowed, out=np.zeros_like(values), where=allowed > 0)
    rows = np.flatnonzero(~kept)
    while len(rows):
        ends = np.flatnonzero(kept)
        right = np.searchsorted(ends, rows)
        left = ends[right - 1]
        missed = _missed(t, scaled, left, rows, ends[right])
        # The worst row of each interval that is missed; what lies in the others is not looked at again.
        order = np.lexsort((missed, left))
        worst = order[np.append(np.diff(left[order]) > 0, True)]
        worst = worst[missed[worst] > 1]
        kept[rows[worst]] = True
        again = np.isin(left, left[worst])
        # Where all swings are alike the worst is next to an end each time: halves come to an end, too.
        middle = (rows == (left + ends[right]) // 2) & (ends[right] - left > LONG)
        kept[rows[again & middle]] = True
        rows = rows[again & ~kept[rows]]
    return kept


def _missed(t: Array, values: Array, left: Index, rows: Index, right: Index) -> Array:
    """By how much lines from one row to another miss rows between them, over time or its logarithm, at worst."""
    missed = np.zeros(len(rows))
    for over in (t, np.log(np.maximum(t, t[t > 0].min(initial=1.0)))):
        length = over[right] - over[left]
        part = np.divide(over[rows] - over[left], length, out=np.zeros_like(length), where=length > 0)
        line = values[left] + part[:, None] * (values[right] - values[left])
        missed = np.fmax(missed, np.abs(values[rows] - line).max(axis=1, initial=0.0))
    return missed


def _edges(values: Array) -> Mask:
    """Rows with an extreme of a quantity, and those beside which one begins or ceases to be a number."""
    number = np.isfinite(values)
    found = np.zeros(len(values), bool)
    changes = np.any(number[1:] != number[:-1], axis=1)
    found[1:] |= changes
    found[:-1] |= changes
    if not values.size:
        return found
    found[np.argmax(np.where(number, values, -np.inf), axis=0)] = True
    found[np.argmin(np.where(number, values, np.inf), axis=0)] = True
    return found


def _chosen(rows: States, which: Mask) -> States:
    """Some of the rows."""
    assert rows.segment is not None
    return States(rows.t[which], rows.y[which], rows.ledger[which], rows.segment[which])


def _bends(trajectory: Trajectory, allowed: Array) -> Array:
    """Times between outputs at which named quantities, in whose middle lines from one to the next miss them by more
    than is allowed, are to be known: they may bend where states do not.
    """
    result, y, rates = trajectory.result, trajectory.result.outputs, trajectory.rates
    t, segment = result.times, result.segments_at(result.times, result.segment)
    left = np.flatnonzero((np.diff(t) > 0) & (np.diff(segment) == 0) & (t[:-1] > 0))
    right, length = left + 1, np.diff(t)[left]
    middle = t[left] + length / 2
    states = (y[left] + y[right]) / 2 + length[:, None] / 8 * (rates[left] - rates[right])
    between = trajectory.at(States(middle, states, result.ledger_outputs[left], segment[left]))
    lines = (trajectory.outputs[left] + trajectory.outputs[right]) / 2
    with np.errstate(invalid="ignore"):  # quantities may be infinite
        apart = np.abs(between.outputs - lines)
    missed = np.divide(apart, allowed, out=np.zeros_like(apart), where=allowed > 0).max(axis=1, initial=0.0)
    rows = np.sort(np.argsort(-missed, kind="stable")[:BENDS])
    rows = rows[missed[rows] > 1]
    parts = np.minimum(np.ceil(missed[rows]), CLOSER).astype(int)
    inside = [np.linspace(t[left[i]], t[right[i]], n, endpoint=False)[1:] for i, n in zip(rows, parts, strict=True)]
    return np.concatenate([[], *inside])


def followed(trajectory: Trajectory, rounds: int = ROUNDS) -> Trajectory:
    """The trajectory with the outputs that its picture needs, instead of those at which runs are compared."""
    part, rows = trajectory.run.picture, trajectory.result.known or trajectory.result.states()
    if part is None or len(rows.t) < 2:
        return trajectory
    t, sides = _two_sided(rows.t)
    # What cells do not resolve yet is no part of the picture, but for how it begins.
    system, end = trajectory.model.system, trajectory.run.times[-1]
    early = unresolved(system, end, t)
    sides &= ~early | np.isin(t, begun(system, end))
    rows, early = _chosen(rows._replace(t=t), sides), early[sides]
    # What is shown over time, shape (times, quantities), and how much of it may be rounding.
    whole = trajectory.at(rows)
    quantities = np.hstack([rows.y, rows.ledger, whole.outputs])
    roundings = whole.some.roundings
    unknown = [UNRESOLVED * roundings[name] for name in system.output_columns]
    noise = np.pad(unknown, (quantities.shape[1] - len(unknown), 0))
    # Both sides of events are kept; rounding is not pictured, and what is early counts for no range.
    moments = np.array([*trajectory.result.events.t, *(jump.t for jump in trajectory.jumps)])
    beside = np.isin(rows.t, moments) | np.isin(np.nextafter(rows.t, np.inf), moments)
    values = np.where(np.isfinite(quantities), quantities, 0.0)
    known, rtol = values if early.all() else values[~early], trajectory.run.rtol
    allowed = part * np.ptp(known, axis=0) + UNRESOLVED * rtol * np.abs(values).max(axis=0) + noise
    bends = (
        _bends(whole, allowed[len(allowed) - whole.outputs.shape[1] :])
        if rounds and trajectory.run.max_seconds is None
        else ()
    )
    if len(bends):
        run = replace(trajectory.run, times=tuple(np.union1d(trajectory.run.times, bends).tolist()))
        return followed(trajectory.model.solve_values(run, trajectory.values), rounds - 1)
    seen = np.ptp(values, axis=0) > allowed
    kept = needed(rows.t, values[:, seen], allowed[seen], beside | _edges(quantities[:, seen]))
    return whole.picked(kept)
