"""A whole run, compiled: segments, steps, events, outputs; and the loop over a batch of runs."""

from typing import Any

import numpy as np

from surfacechem.solve.contract import Status
from surfacechem.solve.radau.advance import (
    BRIEF,
    GOOD,
    accept,
    advance,
    finish_step,
    keep_matrices,
    restart,
    store_polynomial,
    unseen,
)
from surfacechem.solve.radau.consistency import find_consistent
from surfacechem.solve.radau.guards import AT_START, find_event, keep_sides, mark_at_end, restore_sides, start_margins
from surfacechem.solve.radau.outputs import write_outputs
from surfacechem.solve.radau.quadrature import ledger_factor, ledger_norm
from surfacechem.solve.radau.step import first_size, growing_size, loosening
from surfacechem.solve.radau.work import (
    ATOL,
    BASE,
    H_FACTORED,
    LOOSE,
    M_LARGEST,
    M_NOW,
    Q_LARGEST,
    REFUSED,
    REJECTED,
    RTOL,
    SPACING,
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
    lay_out,
    reference,
)

FINISHED = int(Status.FINISHED)
EVENT = int(Status.EVENT)

END, OUTPUTS, EVENTS, RECORDS = range(4)
"""Entries of the per-run table of counts: status, outputs written, events, recorded steps; then the counters."""
FIRST_COUNTER, COUNTERS = 4, 6

PATIENCE = 40
"""Steps that the ledger may refuse beside every second, since the last restart: what it misses may be noise, which must
not end a run.
"""
FEWEST = 4
"""Points of a segment at which its steps are held against the equations, however short it is: a choice. Each costs an
evaluation in every segment; what lasts less than a fourth of a segment may be missed.
"""
SAME = 1e-12
"""Difference of times, relative to time, that makes no second event of a kink."""
SHORTEST = 1e-10
"""Part of the time so far below which the ledger shortens no step: what ends the run there is told by the states."""


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
def _is_known(w: Any, events: Any, counts: Any, m: int) -> bool:
    """Whether an event of this margin is written that but for digits is of now: a step ends just short of a kink, and
    the next one passes it.
    """
    now = w.clock[BASE] + w.clock[TAU]
    k = min(counts[EVENTS], events.shape[0]) - 1
    while k >= 0 and now - events[k, 1] <= SAME * now:
        if events[k, 0] == m:
            return True
        k -= 1
    return False


@compiled
def _write_events(w: Any, events: Any, kinds: Any, counts: Any) -> bool:
    """A row for each margin that fired; True if one of them is terminal."""
    terminal = False
    for m in range(kinds.shape[0]):
        if w.fired[m] != 0:
            if kinds[m, 0] == 0 and _is_known(w, events, counts, m):
                continue
            if counts[EVENTS] < events.shape[0]:
                row = events[counts[EVENTS]]
                row[0] = m
                _write_state(w, row[1:], w.clock[BASE] + w.clock[TAU])
            counts[EVENTS] += 1
            terminal = terminal or kinds[m, 0] == 1
    return terminal


@compiled
def _record(w: Any, steps: Any, counts: Any) -> None:
    if counts[RECORDS] < steps.shape[0]:
        _write_state(w, steps[counts[RECORDS]], w.clock[BASE] + w.clock[TAU])
    counts[RECORDS] += 1


@compiled
def _next_try(h: float, remaining: float) -> float:
    """Fit the step to the end of the segment without a tiny last one."""
    if h >= remaining * (1.0 - 1e-9):
        return remaining
    return 0.5 * remaining if 2.0 * h > remaining else h


@compiled
def _start(w: Any, kinds: Any, times: Any, outputs: Any, steps: Any, counts: Any) -> int:
    """Begin anew at the current state, with the tables begun where it is the first one."""
    outcome = restart(w)
    if outcome != GOOD:
        return outcome
    if w.margin.shape[1] > 0:
        start_margins(w, kinds)
        clear(w.fired)
    if counts[OUTPUTS] == 0 and times.shape[0] > 0 and times[0] <= w.clock[BASE]:
        copy(w.vector[Y], outputs[0])
        copy(w.ledger[Q], outputs[0, w.algebraic.shape[0] :])
        counts[OUTPUTS] = 1
    if counts[RECORDS] == 0:
        _record(w, steps, counts)
    return GOOD


@compiled
def _move(w: Any, size: float, reached: float, times: Any, outputs: Any, steps: Any, counts: Any) -> None:
    """Accept a step of this size, with its outputs."""
    counts[OUTPUTS] = write_outputs(w, times, outputs, counts[OUTPUTS], size, reached)
    store_polynomial(w, size, 1.0)
    accept(w, size)
    _record(w, steps, counts)


@compiled
def _ledger_limit(w: Any, h: float, remaining: float) -> float:
    """Longest next step that serves the ledger; shorter than this one where this one does not."""
    brief = h < SHORTEST * (w.clock[BASE] + w.clock[TAU])
    norm = 0.0 if brief or w.ledger.shape[1] == 0 else ledger_norm(w, h, remaining)
    if norm == 0.0:
        return np.inf
    limit = h * ledger_factor(w, norm)
    if norm <= 1.0:
        return max(limit, h)
    if w.count[REFUSED] > PATIENCE + w.count[STEPS] // 2:
        return np.inf
    w.count[REJECTED] += 1
    w.count[REFUSED] += 1
    w.clock[H_FACTORED] = 0.0
    return limit


@compiled
def _run_segment(
    w: Any,
    end: float,
    goes_on: bool,
    kinds: Any,
    max_steps: int,
    stop: Any,
    times: Any,
    outputs: Any,
    steps: Any,
    events: Any,
    counts: Any,
) -> int:
    """Integrate to the end of a segment; GOOD, or the status that ends the run."""
    h, size_last, norm_last = 0.0, 0.0, 1.0
    aim, spacing = np.inf, w.clock[SPACING]
    if spacing < np.inf:
        spacing = min(spacing, (end - w.clock[BASE]) / FEWEST)
    while end - w.clock[BASE] - w.clock[TAU] > 0.0:
        if h == 0.0:
            outcome = _start(w, kinds, times, outputs, steps, counts)
            if outcome != GOOD:
                return outcome
            h, size_last, norm_last = first_size(w, end - w.clock[BASE]), 0.0, 1.0
            aim = np.inf
        left = (end - w.clock[BASE]) - w.clock[TAU]
        remaining = min(left, aim - w.clock[TAU])
        outcome, h, norm, proposed = advance(w, _next_try(h, remaining), max_steps, stop, size_last, norm_last)
        if outcome != GOOD:
            return outcome
        finish_step(w, h)
        limit = _ledger_limit(w, h, left)
        if limit < h:
            h = limit
            continue
        size = h
        if kinds.shape[0] > 0:
            keep_sides(w)
            size = find_event(w, h, kinds)
        if size == AT_START:
            _write_events(w, events, kinds, counts)
            return EVENT
        if size == 0.0:
            h *= 0.25
            w.clock[H_FACTORED] = 0.0
            continue
        seen = 1.0
        if size > BRIEF * spacing:
            seen = unseen(w, size, spacing, left, w.clock[TAU] == 0.0, size == left or any_true(w.fired))
        if seen < 1.0:
            # A step ends there, so that its last stage feels what the others have missed.
            h = seen * size
            aim = w.clock[TAU] + h
            if kinds.shape[0] > 0:
                restore_sides(w)
            w.count[REJECTED] += 1
            w.clock[H_FACTORED] = 0.0
            continue
        reached = w.clock[BASE] + (w.clock[TAU] + size)
        whole = size == left or reached >= end
        if size == remaining:
            aim = np.inf
        _move(w, size, end if whole else reached, times, outputs, steps, counts)
        if whole:
            w.clock[TAU] = end - w.clock[BASE]
            if kinds.shape[0] > 0 and goes_on:
                mark_at_end(w, kinds)
        size_last, norm_last = h, max(norm, 1e-2)
        h = min(keep_matrices(w, h, min(proposed, limit)), growing_size(w))
        if kinds.shape[0] > 0 and any_true(w.fired):
            if _write_events(w, events, kinds, counts):
                return EVENT
            h = 0.0
    return GOOD


@compiled
def _run(
    w: Any,
    exchanged: Any,
    seen: Any,
    goes_on: int,
    y0: Any,
    parameters: Any,
    segments: Any,
    times: Any,
    kinds: Any,
    max_steps: int,
    stop: Any,
    end: Any,
    counts: Any,
    outputs: Any,
    steps: Any,
    events: Any,
) -> None:
    n = w.algebraic.shape[0]
    clear(w.fired)
    clear(w.count)
    clear(w.ledger[Q])
    copy(exchanged, w.ledger[Q_LARGEST])
    copy(seen, w.margin[M_LARGEST])
    copy(y0, w.vector[Y])
    clear(w.vector[YDOT])
    status = GOOD
    for segment in range(segments.shape[0] - 1):
        w.clock[BASE] = segments[segment]
        w.clock[TAU] = 0.0
        copy(parameters[segment], w.inputs[1 + 2 * n :])
        more = goes_on != 0 or segment + 2 < segments.shape[0]
        status = _run_segment(
            w, segments[segment + 1], more, kinds, max_steps, stop, times, outputs, steps, events, counts
        )
        if status != GOOD:
            break
    counts[END] = FINISHED if status == GOOD else status
    _write_state(w, end, segments[-1] if status == GOOD else w.clock[BASE] + w.clock[TAU])
    if kinds.shape[0] > 0:
        start_margins(w, kinds)
        copy(w.margin[M_NOW], end[end.shape[0] - kinds.shape[0] :])
    for i in range(COUNTERS):
        counts[FIRST_COUNTER + i] = w.count[i]


@compiled
def _make_consistent(w: Any, parameters: Any, row: Any, counts: Any) -> None:
    """The state of a row [t | y | ydot] made consistent in place."""
    n = w.algebraic.shape[0]
    w.inputs[0] = row[0]
    copy(parameters[0], w.inputs[1 + 2 * n :])
    copy(row[1 : 1 + n], w.vector[TRIAL])
    copy(row[1 + n : 1 + 2 * n], w.vector[TRIAL_DOT])
    counts[END] = find_consistent(w)
    copy(w.vector[TRIAL], row[1:])
    copy(w.vector[TRIAL_DOT], row[1 + n :])


def run_batch(
    first: int,
    last: int,
    code: Any,
    algebraic: Any,
    chains: Any,
    groups: Any,
    exchanged: Any,
    seen: Any,
    goes_on: int,
    max_steps: int,
    stop: Any,
    rtol: float,
    spacing: float,
    atol: Any,
    kinds: Any,
    y0: Any,
    parameters: Any,
    segments: Any,
    times: Any,
    ends: Any,
    counts: Any,
    outputs: Any,
    steps: Any,
    events: Any,
) -> None:
    """Runs first to last - 1 of a batch; every run writes to its own rows, so the result does not depend on the
    threads. Without segments the rows of ``ends`` are made consistent; parameters may then be one row for all.
    """
    place = np.zeros(1, np.int64)
    lay_out(code, algebraic, chains, groups, place, parameters.shape[2], kinds.shape[0])
    memory = np.zeros(place[0] // 8, np.int64)
    place[0] = memory.ctypes.data
    w = reference(lay_out(code, algebraic, chains, groups, place, parameters.shape[2], kinds.shape[0]))
    w.clock[RTOL] = rtol
    w.clock[LOOSE] = loosening(rtol)
    w.clock[SPACING] = spacing
    copy(atol, w.vector[ATOL])
    for i in range(first, last):
        if segments.shape[0] == 0:
            _make_consistent(w, parameters[i if parameters.shape[0] > 1 else 0], ends[i], counts[i])
            continue
        _run(
            w,
            exchanged,
            seen,
            goes_on,
            y0[i],
            parameters[i],
            segments,
            times,
            kinds,
            max_steps,
            stop,
            ends[i],
            counts[i],
            outputs[i],
            steps[i],
            events[i],
        )
    # A last use: Numba releases an array after the last statement that names it.
    memory[0] = 0
