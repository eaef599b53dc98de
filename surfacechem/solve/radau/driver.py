"""A whole run, compiled: segments, steps, events, outputs; and the loop over a batch of runs."""

from typing import Any

import numpy as np

from surfacechem.solve.contract import Status
from surfacechem.solve.radau.consistency import find_consistent
from surfacechem.solve.radau.dense import hold_rates
from surfacechem.solve.radau.guards import AT_START, find_event, keep_sides, mark_at_end, restore_sides, start_margins
from surfacechem.solve.radau.newton import stage_count
from surfacechem.solve.radau.outputs import write_outputs
from surfacechem.solve.radau.quadrature import ledger_factor, ledger_norm
from surfacechem.solve.radau.step import (
    BRIEF,
    GOOD,
    accept,
    advance,
    finish_step,
    first_size,
    growing_size,
    keep_matrices,
    loosening,
    restart,
    store_polynomial,
    unseen,
)
from surfacechem.solve.radau.stepper import END, EVENTS, FIRST_COUNTER, OUTPUTS, RECORDS, STOP, Batch
from surfacechem.solve.radau.work import (
    ATOL,
    BASE,
    H_FACTORED,
    LOOSE,
    M_LARGEST,
    M_NOW,
    MEMBER,
    Q_LARGEST,
    REFUSED,
    REJECTED,
    RTOL,
    STEPS,
    TAU,
    TRIAL,
    TRIAL_DOT,
    YDOT,
    Q,
    Y,
    any_true,
    clear,
    compiled,
    copy,
    finite,
    lay_out,
    reference,
)
from surfacechem.tolerances import ROUNDING, SHALLOW, SQRT_EPS

FINISHED = int(Status.FINISHED)
EVENT = int(Status.EVENT)


PATIENCE = 40
"""Steps that the ledger may refuse beside every second, since the last restart: what it misses may be noise, which must
not end a run.
"""
FEWEST = 4
"""Points of a segment at which its steps are held against the equations, however short it is: a choice. Each costs an
evaluation in every segment; what lasts less than a fourth of a segment may be missed.
"""
LEAST_NORM = 1e-2
"""Error norm of the last step below which the controller learns nothing more from it (Hairer & Wanner II, IV.8)."""

TAKEN, AGAIN, MISSED, ENDED = range(4)
"""Verdicts on a step."""


@compiled
def row_of(table: Any, i: int) -> int:
    """Row of run i in a table that has one for each run, or one for all."""
    return min(i, int(table.shape[0]) - 1)


@compiled
def _write_state(w: Any, row: Any, t: float) -> None:
    """[t | y | ydot | ledger] of the current state."""
    n = w.algebraic.shape[0]
    row[0] = t
    for j in range(n):
        row[1 + j] = w.vector[Y, j]
        row[1 + n + j] = w.vector[YDOT, j]
    for m in range(w.ledger.shape[1]):
        row[1 + 2 * n + m] = w.ledger[Q, m]


@compiled
def _write_events(w: Any, events: Any, counts: Any) -> bool:
    """A row for each guard that fired; True if one of them is terminal."""
    now = w.clock[BASE] + w.clock[TAU]
    terminal = False
    for m in range(w.kinds.shape[0]):
        if w.fired[m] == 0:
            continue
        k = min(counts[EVENTS], events.shape[0]) - 1
        if w.kinds[m, 0] == 0:
            # A step ends just short of a kink and the next one passes it: that is one event.
            while k >= 0 and now - events[k, 1] <= ROUNDING * now and events[k, 0] != m:
                k -= 1
            if k >= 0 and now - events[k, 1] <= ROUNDING * now:
                continue
        if counts[EVENTS] < events.shape[0]:
            row = events[counts[EVENTS]]
            row[0] = m
            _write_state(w, row[1:], now)
        counts[EVENTS] += 1
        terminal = terminal or w.kinds[m, 0] == 1
    return terminal


@compiled
def _record(w: Any, steps: Any, counts: Any) -> None:
    if counts[RECORDS] < steps.shape[0]:
        _write_state(w, steps[counts[RECORDS]], w.clock[BASE] + w.clock[TAU])
    counts[RECORDS] += 1


@compiled
def _next_try(h: float, remaining: float) -> float:
    """Fit the step to the end of the segment without a tiny last one."""
    if h >= remaining * (1.0 - SQRT_EPS):
        return remaining
    return 0.5 * remaining if 2.0 * h > remaining else h


@compiled
def _start(w: Any, batch: Any, i: int) -> int:
    """Begin anew at the current state, with the tables begun where it is the first one."""
    outcome = restart(w)
    if outcome != GOOD:
        return outcome
    counts, times, outputs = batch.counts[i], batch.times[row_of(batch.times, i)], batch.outputs[i]
    if w.kinds.shape[0] > 0:
        start_margins(w)
        clear(w.fired)
    if counts[OUTPUTS] == 0 and times.shape[0] > 0 and times[0] <= w.clock[BASE]:
        copy(w.vector[Y], outputs[0])
        copy(w.ledger[Q], outputs[0, w.algebraic.shape[0] :])
        counts[OUTPUTS] = 1
    if counts[RECORDS] == 0:
        _record(w, batch.steps[i], counts)
    return GOOD


@compiled
def _ledger_error(w: Any, h: float, remaining: float) -> float:
    """Error of the ledger over the step in units of what is allowed; infinite where one of its rates is."""
    if w.ledger.shape[1] == 0:
        return 0.0
    singular = not finite(w.q_stage[stage_count(w.count[MEMBER]) - 1])
    return np.inf if singular else ledger_norm(w, h, remaining)


@compiled
def _is_brief(w: Any, h: float) -> bool:
    """Whether a step is too brief for the ledger to shorten it: what ends the run there is told by the states."""
    return bool(h < SHALLOW * (w.clock[BASE] + w.clock[TAU]))


@compiled
def _ledger_limit(w: Any, h: float, remaining: float) -> float:
    """Longest next step that serves the ledger; shorter than this one where this one does not."""
    norm = 0.0 if _is_brief(w, h) else _ledger_error(w, h, remaining)
    if norm == 0.0:
        return np.inf
    limit = h * ledger_factor(w, norm)
    if norm <= 1.0:
        return max(limit, h)
    if w.count[REFUSED] > PATIENCE + w.count[STEPS] // 2:
        return np.inf
    w.count[REFUSED] += 1
    return limit


@compiled
def _judge(w: Any, h: float, limit: float, left: float, spacing: float) -> tuple[int, float]:
    """Whether a step that has converged is TAKEN, and up to where; else the size of the next trial.

    An event may cut it short; it is tried again where the ledger asks for less than it (``limit``), where a guard may
    be passed at its start, and up to what it has MISSED between its stages.
    """
    if limit < h:
        return AGAIN, limit
    size = h
    if w.kinds.shape[0] > 0:
        keep_sides(w)
        size = find_event(w, h)
    if size == AT_START:
        return ENDED, h
    if size == 0.0:
        return AGAIN, 0.25 * h
    if size != h:
        # The step onto an event may end where a rate is singular, which the longer one did not. The ledger comes near
        # to it in ever shorter steps, and counts over the last one with the rates at its start.
        limit = _ledger_limit(w, size, left)
        if limit < size:
            restore_sides(w)
            return AGAIN, limit
        if _is_brief(w, size) and _ledger_error(w, size, left) > 1.0:
            hold_rates(w, size)
    if size > BRIEF * spacing:
        seen = unseen(w, size, spacing, left, w.clock[TAU] == 0.0, size == left or any_true(w.fired))
        if seen < 1.0:
            if w.kinds.shape[0] > 0:
                restore_sides(w)
            return MISSED, seen * size
    return TAKEN, size


@compiled
def _accept(w: Any, batch: Any, i: int, size: float, end: float, goes_on: bool) -> None:
    """Move on by a step of this size, with its outputs; to the very end of the segment where it is all but reached."""
    counts = batch.counts[i]
    reached = w.clock[BASE] + (w.clock[TAU] + size)
    whole = size == (end - w.clock[BASE]) - w.clock[TAU] or reached >= end
    times = batch.times[row_of(batch.times, i)]
    counts[OUTPUTS] = write_outputs(w, times, batch.outputs[i], counts[OUTPUTS], size, end if whole else reached)
    store_polynomial(w, size, 1.0)
    accept(w, size)
    _record(w, batch.steps[i], counts)
    if whole:
        w.clock[TAU] = end - w.clock[BASE]
        if w.kinds.shape[0] > 0 and goes_on:
            mark_at_end(w)


@compiled
def _run_segment(w: Any, batch: Any, i: int, end: float, goes_on: bool) -> int:
    """Integrate to the end of a segment; GOOD, or the status that ends the run."""
    h, size_last, norm_last, aim = 0.0, 0.0, 1.0, np.inf
    spacing, max_steps = batch.spacing[row_of(batch.spacing, i)], batch.max_steps[row_of(batch.max_steps, i)]
    if spacing < np.inf:
        spacing = min(spacing, (end - w.clock[BASE]) / FEWEST)
    while end - w.clock[BASE] - w.clock[TAU] > 0.0:
        if h == 0.0:
            outcome = _start(w, batch, i)
            if outcome != GOOD:
                return outcome
            h, size_last, norm_last, aim = first_size(w, end - w.clock[BASE]), 0.0, 1.0, np.inf
        left = (end - w.clock[BASE]) - w.clock[TAU]
        remaining = min(left, aim - w.clock[TAU])
        outcome, h, norm, proposed = advance(
            w, _next_try(h, remaining), max_steps, batch.counts[i], size_last, norm_last
        )
        if outcome != GOOD:
            return outcome
        finish_step(w, h)
        limit = _ledger_limit(w, h, left)
        verdict, size = _judge(w, h, limit, left, spacing)
        if verdict == ENDED:
            _write_events(w, batch.events[i], batch.counts[i])
            return EVENT
        if verdict != TAKEN:
            if verdict == MISSED:
                # A step ends there, so that its last stage feels what the others have missed.
                aim = w.clock[TAU] + size
            w.count[REJECTED] += 1
            w.clock[H_FACTORED] = 0.0
            h = size
            continue
        if size == remaining:
            aim = np.inf
        _accept(w, batch, i, size, end, goes_on)
        size_last, norm_last = h, max(norm, LEAST_NORM)
        h = min(keep_matrices(w, h, min(proposed, limit)), growing_size(w))
        if any_true(w.fired):
            if _write_events(w, batch.events[i], batch.counts[i]):
                return EVENT
            h = 0.0
    return GOOD


@compiled
def _run(w: Any, batch: Any, i: int) -> None:
    """One run, from its initial state through its segments."""
    n, segments, counts, end = (
        w.algebraic.shape[0],
        batch.segments[row_of(batch.segments, i)],
        batch.counts[i],
        batch.ends[i],
    )
    clear(w.fired)
    clear(w.count)
    clear(w.ledger[Q])
    accounts, peaks = w.ledger.shape[1], batch.peaks[row_of(batch.peaks, i)]
    copy(peaks[:accounts], w.ledger[Q_LARGEST])
    copy(peaks[accounts:], w.margin[M_LARGEST])
    copy(batch.y0[i], w.vector[Y])
    clear(w.vector[YDOT])
    status = GOOD
    for segment in range(segments.shape[0] - 1):
        w.clock[BASE] = segments[segment]
        w.clock[TAU] = 0.0
        copy(batch.parameters[i, segment], w.inputs[1 + 2 * n :])
        more = batch.goes_on != 0 or segment + 2 < segments.shape[0]
        status = _run_segment(w, batch, i, segments[segment + 1], more)
        if status != GOOD:
            break
    counts[END] = FINISHED if status == GOOD else status
    _write_state(w, end, segments[-1] if status == GOOD else w.clock[BASE] + w.clock[TAU])
    if w.kinds.shape[0] > 0:
        start_margins(w)
        copy(w.margin[M_NOW], end[end.shape[0] - w.kinds.shape[0] :])
    for k in range(STOP - FIRST_COUNTER):
        counts[FIRST_COUNTER + k] = w.count[k]


@compiled
def _make_consistent(w: Any, batch: Any, i: int) -> None:
    """The state of a row [t | y | ydot] made consistent in place."""
    n, row = w.algebraic.shape[0], batch.ends[i]
    w.inputs[0] = row[0]
    copy(batch.parameters[row_of(batch.parameters, i), 0], w.inputs[1 + 2 * n :])
    copy(row[1 : 1 + n], w.vector[TRIAL])
    copy(row[1 + n : 1 + 2 * n], w.vector[TRIAL_DOT])
    batch.counts[i, END] = find_consistent(w)
    copy(w.vector[TRIAL], row[1:])
    copy(w.vector[TRIAL_DOT], row[1 + n :])


def run_batch(first: int, last: int, fields: Any) -> None:
    """Runs first to last - 1 of a :data:`Batch`, whose fields come as a plain tuple, since Numba looks at the types of
    a named one twice as long. Every run writes to its own rows, so the result does not depend on the threads. Without
    segments the rows of ``ends`` are made consistent.
    """
    batch = reference(Batch(*fields))
    place = np.zeros(1, np.int64)
    lay_out(batch, place)
    memory = np.zeros(place[0] // 8, np.int64)
    place[0] = memory.ctypes.data
    w = reference(lay_out(batch, place))
    w.clock[RTOL] = batch.rtol
    w.clock[LOOSE] = loosening(batch.rtol)
    copy(batch.atol, w.vector[ATOL])
    for i in range(first, last):
        if batch.segments.shape[1] == 0:
            _make_consistent(w, batch, i)
        else:
            _run(w, batch, i)
    # A last use: Numba releases an array after the last statement that names it.
    memory[0] = 0
