"""Outputs that follow a run: of all states that are known, those without which its picture would not be true.

Known are the ends of steps, both sides of events and breakpoints, the times at which runs are compared, and what the
stepper adds inside steps that are too long for a straight line. The picture is true where straight lines between
outputs, over time as over its logarithm, miss no quantity by more than a part of its range.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from surfacechem.solve.contract import Array, States
from surfacechem.solve.run import Run, Trajectory

Flags = NDArray[np.bool_]

SAMPLED = 100
"""Rows that tell how large rounding is."""

UNRESOLVED = 100.0
"""Tolerances of a value below which a change may be an error of the run."""


def _two_sided(t: Array) -> tuple[Array, Flags]:
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


def needed(t: Array, values: Array, allowed: Array, kept: Flags) -> Flags:
    """Rows between which straight lines over time, and over its logarithm, miss no value by more than is allowed.

    ``values`` has shape (times, quantities), ``allowed`` is for each quantity; rows that are ``kept`` are among them.
    """
    kept = kept.copy()
    kept[[0, -1]] = True
    scaled = np.divide(values, allowed, out=np.zeros_like(values), where=allowed > 0)
    log = np.log(np.maximum(t, t[t > 0].min(initial=1.0)))
    open_rows = np.flatnonzero(~kept)
    while len(open_rows):
        ends = np.flatnonzero(kept)
        right = np.searchsorted(ends, open_rows)
        left, right = ends[right - 1], ends[right]
        missed = np.zeros(len(open_rows))
        for over in (t, log):
            length = over[right] - over[left]
            part = np.divide(over[open_rows] - over[left], length, out=np.zeros_like(length), where=length > 0)
            line = scaled[left] + part[:, None] * (scaled[right] - scaled[left])
            missed = np.fmax(missed, np.abs(scaled[open_rows] - line).max(axis=1, initial=0.0))
        # The worst row of each interval that is missed; what lies in the others is not looked at again.
        order = np.lexsort((missed, left))
        last = np.append(np.diff(left[order]) > 0, True)
        worst = order[last]
        worst = worst[missed[worst] > 1]
        kept[open_rows[worst]] = True
        open_rows = open_rows[np.isin(left, left[worst]) & ~kept[open_rows]]
    return kept


def _edges(values: Array) -> Flags:
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


def _kept(run: Run, t: Array, quantities: Array, noise: Array, part: float, sides: Flags) -> Flags:
    """Rows that the picture of these quantities needs, ``sides`` of events among them; ``noise`` is not pictured."""
    values = np.where(np.isfinite(quantities), quantities, 0.0)
    allowed = part * np.ptp(values, axis=0) + UNRESOLVED * run.rtol * np.abs(values).max(axis=0) + noise
    seen = np.ptp(values, axis=0) > allowed
    return needed(t, values[:, seen], allowed[seen], sides | _edges(quantities[:, seen]))


def _at(trajectory: Trajectory, rows: States) -> Trajectory:
    """The trajectory with these states at its outputs."""
    t, y, ledger, segment = rows
    return replace(
        trajectory,
        result=replace(trajectory.result, times=t, outputs=y, ledger_outputs=ledger, segment=segment),
    )


def _chosen(rows: States, which: Flags) -> States:
    """Some of the rows."""
    assert rows.segment is not None
    return States(rows.t[which], rows.y[which], rows.ledger[which], rows.segment[which])


def followed(trajectory: Trajectory) -> Trajectory:
    """The trajectory with the outputs that its picture needs, instead of those at which runs are compared."""
    result, part, system = trajectory.result, trajectory.run.picture, trajectory.model.system
    rows = result.known or result.states()
    if part is None or len(rows.t) < 2:
        return trajectory
    t, sides = _two_sided(rows.t)
    rows = _chosen(rows._replace(t=t), sides)
    moments = np.array([*result.events.t, *(jump.t for jump in trajectory.jumps)])
    beside = np.isin(rows.t, moments) | np.isin(np.nextafter(rows.t, np.inf), moments)
    sampled = np.arange(len(rows.t)) % max(len(rows.t) // SAMPLED, 1) == 0
    noise = _at(trajectory, _chosen(rows, sampled)).roundings
    shown = [j for j, state in enumerate(system.states) if state.name not in system.inside]
    states = np.hstack([rows.y[:, shown], rows.ledger])
    every = np.hstack([states, _at(trajectory, rows).outputs])
    unknown = np.array([0.0] * states.shape[1] + [UNRESOLVED * noise[name] for name in system.output_columns])
    return _at(trajectory, _chosen(rows, _kept(trajectory.run, rows.t, every, unknown, part, beside)))
