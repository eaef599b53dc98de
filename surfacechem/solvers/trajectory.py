"""A whole run, compiled: segments, steps, events, outputs; and the loop over a batch of runs."""

from typing import Any

from surfacechem.solvers.consistency import find_consistent
from surfacechem.solvers.contract import Status
from surfacechem.solvers.locate import find_event, start_margins
from surfacechem.solvers.native import (
    ATOL,
    BASE,
    H_FACTORED,
    LOOSE,
    M_LARGEST,
    M_NOW,
    M_SLOPE,
    RTOL,
    TAU,
    TRIAL,
    TRIAL_DOT,
    YDOT,
    Q,
    Y,
    allocate,
    any_true,
    clear,
    compiled,
    compiled_once,
    copy,
    keep_alive,
    reference,
)
from surfacechem.solvers.radau_advance import (
    GOOD,
    accept,
    advance,
    finish_step,
    keep_matrices,
    restart,
    store_polynomial,
)
from surfacechem.solvers.radau_outputs import write_outputs
from surfacechem.solvers.radau_step import first_size, loosening

FINISHED = int(Status.FINISHED)
EVENT = int(Status.EVENT)

END, OUTPUTS, EVENTS, RECORDS = range(4)
"""Entries of the per-run table of counts after the counters: status, outputs written, events, recorded steps."""
N_COUNTERS = 6


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


@compiled_once
def _write_events(w: Any, events: Any, kinds: Any, fired: Any, counts: Any) -> bool:
    """A row for each margin that fired; True if one of them is terminal."""
    terminal = False
    for m in range(kinds.shape[0]):
        if fired[m]:
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
def _run_segment(
    w: Any,
    end: float,
    kinds: Any,
    fired: Any,
    slopes: Any,
    limits: Any,
    stop: Any,
    times: Any,
    outputs: Any,
    steps: Any,
    events: Any,
    counts: Any,
) -> int:
    """Integrate to the end of a segment; GOOD, or the status that ends the run."""
    outcome = restart(w)
    if outcome != GOOD:
        return outcome
    if kinds.shape[0] > 0:
        start_margins(w, fired)
        clear(fired)
    if counts[OUTPUTS] == 0 and times.shape[0] > 0 and times[0] <= w.clock[BASE]:
        copy(w.vector[Y], outputs[0])
        copy(w.ledger[Q], outputs[0, w.algebraic.shape[0] :])
        counts[OUTPUTS] = 1
    if counts[RECORDS] == 0:
        _record(w, steps, counts)
    size_last, norm_last = 0.0, 1.0
    h = first_size(w, end - w.clock[BASE])
    while True:
        remaining = (end - w.clock[BASE]) - w.clock[TAU]
        if not remaining > 0.0:
            return GOOD
        h = _next_try(h, remaining)
        outcome, h, norm, proposed = advance(w, h, limits[0], stop, size_last, norm_last)
        if outcome != GOOD:
            return outcome
        finish_step(w, h)
        size = h
        if kinds.shape[0] > 0:
            size = find_event(w, h, kinds, fired, slopes)
            if size == 0.0:
                h *= 0.25
                w.clock[H_FACTORED] = 0.0
                continue
        reached = end if size == remaining else w.clock[BASE] + (w.clock[TAU] + size)
        counts[OUTPUTS] = write_outputs(w, times, outputs, counts[OUTPUTS], size, reached)
        store_polynomial(w, size, 1.0)
        accept(w, size)
        if size == remaining:
            w.clock[TAU] = end - w.clock[BASE]
        _record(w, steps, counts)
        if kinds.shape[0] > 0 and any_true(fired):
            if _write_events(w, events, kinds, fired, counts):
                return EVENT
            if not end - (w.clock[BASE] + w.clock[TAU]) > 0.0:
                return GOOD
            outcome = restart(w)
            if outcome != GOOD:
                return outcome
            start_margins(w, fired)
            clear(fired)
            h = first_size(w, end - w.clock[BASE])
            size_last, norm_last = 0.0, 1.0
            continue
        size_last, norm_last = h, max(norm, 1e-2)
        h = keep_matrices(w, h, proposed)


@compiled_once
def _run(
    w: Any,
    y0: Any,
    parameters: Any,
    segments: Any,
    times: Any,
    kinds: Any,
    limits: Any,
    stop: Any,
    end: Any,
    counts: Any,
    counters: Any,
    outputs: Any,
    steps: Any,
    events: Any,
) -> None:
    n = w.algebraic.shape[0]
    n_margins = kinds.shape[0]
    fired = w.fired
    clear(fired)
    clear(w.count)
    clear(w.ledger[Q])
    clear(w.margin[M_LARGEST])
    w.clock[TAU] = 0.0
    for j in range(n):
        w.vector[Y, j] = y0[j]
        w.vector[YDOT, j] = 0.0
    status = FINISHED
    for segment in range(segments.shape[0] - 1):
        w.clock[BASE] = segments[segment]
        w.clock[TAU] = 0.0
        copy(parameters[segment], w.inputs[1 + 2 * n :])
        status = _run_segment(
            w,
            segments[segment + 1],
            kinds,
            fired,
            w.margin[M_SLOPE],
            limits,
            stop,
            times,
            outputs,
            steps,
            events,
            counts,
        )
        if status != GOOD:
            break
    counts[END] = FINISHED if status == GOOD else status
    t = segments[-1] if status == GOOD else w.clock[BASE] + w.clock[TAU]
    _write_state(w, end, t)
    if n_margins > 0:
        start_margins(w, fired)
        copy(w.margin[M_NOW], end[end.shape[0] - n_margins :])
    for i in range(N_COUNTERS):
        counters[i] = w.count[i]


def run_batch(
    first: int,
    last: int,
    code: Any,
    algebraic: Any,
    limits: Any,
    stop: Any,
    tolerances: Any,
    kinds: Any,
    y0: Any,
    parameters: Any,
    segments: Any,
    times: Any,
    ends: Any,
    counts: Any,
    counters: Any,
    outputs: Any,
    steps: Any,
    events: Any,
) -> None:
    """Runs first to last - 1 of a batch; every run writes to its own rows, so the result does not depend on the
    threads.
    """
    work = allocate(code, algebraic, parameters.shape[2], limits[1], kinds.shape[0])
    w = reference(work)
    w.clock[RTOL] = tolerances[0]
    w.clock[LOOSE] = loosening(tolerances[0])
    copy(tolerances[1:], w.vector[ATOL])
    for i in range(first, last):
        _run(
            w,
            y0[i],
            parameters[i],
            segments,
            times,
            kinds,
            limits,
            stop,
            ends[i],
            counts[i],
            counters[i],
            outputs[i],
            steps[i],
            events[i],
        )
    keep_alive(work)


def make_consistent(code: Any, algebraic: Any, t: Any, y: Any, ydot: Any, parameters: Any, outcomes: Any) -> None:
    """Consistent states in place, row by row; parameters may be one row for all."""
    n = algebraic.shape[0]
    work = allocate(code, algebraic, parameters.shape[1], 0, 0)
    w = reference(work)
    for i in range(t.shape[0]):
        w.inputs[0] = t[i]
        copy(parameters[i if parameters.shape[0] > 1 else 0], w.inputs[1 + 2 * n :])
        for j in range(n):
            w.vector[TRIAL, j] = y[i, j]
            w.vector[TRIAL_DOT, j] = ydot[i, j]
        outcomes[i] = find_consistent(w)
        for j in range(n):
            y[i, j] = w.vector[TRIAL, j]
            ydot[i, j] = w.vector[TRIAL_DOT, j]
    keep_alive(work)
