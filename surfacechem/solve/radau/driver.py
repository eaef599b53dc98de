"""A whole run, compiled: segments, steps, events, outputs; and the loop over a batch of runs."""

from typing import Any

import numpy as np

from surfacechem.solve.contract import Status
from surfacechem.solve.radau.consistency import find_consistent
from surfacechem.solve.radau.dense import finish_step, hold_rates, ledger_norm
from surfacechem.solve.radau.guards import AT_START, find_event, keep_sides, mark_at_end, restore_sides, start_margins
from surfacechem.solve.radau.linear import LARGE
from surfacechem.solve.radau.newton import stage_count
from surfacechem.solve.radau.outputs import write_outputs, write_picture
from surfacechem.solve.radau.step import (
    BRIEF,
    GOOD,
    accept,
    advance,
    first_size,
    growing_size,
    keep_matrices,
    loosening,
    restart,
    store_polynomial,
    unseen,
)
from surfacechem.solve.radau.stepper import END, EVENTS, FIRST_COUNTER, INSIDE, OUTPUTS, RECORDS
from surfacechem.solve.radau.work import any_true, clear, compiled, copy, lay_out, row_of
from surfacechem.tolerances import NEGLIGIBLE, ROUNDING, SHALLOW, SQRT_EPS

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
SINGULAR = 0.5
"""Power of the step with which the error of an account falls at least where its rate is singular at the start: that of
a rate that grows like the inverse root, as of ideal diffusion; that of a logarithm falls with the step itself.
"""
LEAST_NORM = 1e-2
"""Error norm of the last step below which the controller learns nothing more from it (Hairer & Wanner II, IV.8)."""

TAKEN, AGAIN, MISSED, ENDED = range(4)
"""Verdicts on a step."""


@compiled
def _write_state(w: Any, row: Any, t: float) -> None:
    """[t | y | ydot | ledger] of the current state."""
    n = w.n
    row[0] = t
    for j in range(n):
        row[1 + j] = w.y[j]
        row[1 + n + j] = w.ydot[j]
    for m in range(w.n_ledger):
        row[1 + 2 * n + m] = w.q[m]


@compiled
def _write_events(w: Any, events: Any, counts: Any) -> bool:
    """A row for each guard that fired; True if one of them is terminal."""
    now = w.base + w.tau
    terminal = False
    for m in range(w.n_margins):
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
        # Those for which there is no room are counted all the same: the run is then repeated with room for all.
        counts[EVENTS] += 1
        terminal = terminal or w.kinds[m, 0] == 1
    return terminal


@compiled
def _record(w: Any, records: Any, counts: Any) -> None:
    if counts[RECORDS] < records.shape[0]:
        _write_state(w, records[counts[RECORDS]], w.base + w.tau)
    counts[RECORDS] += 1


@compiled
def _start(w: Any, i: int) -> int:
    """Begin anew at the current state, with the tables begun where it is the first one."""
    outcome = restart(w)
    if outcome != GOOD:
        return outcome
    counts, times, outputs = w.counts[i], w.times[row_of(w.times, i)], w.outputs[i]
    start_margins(w)
    clear(w.fired)
    if counts[OUTPUTS] == 0 and times.shape[0] > 0 and times[0] <= w.base:
        copy(w.y, outputs[0])
        copy(w.q, outputs[0, w.n :])
        counts[OUTPUTS] = 1
    if counts[RECORDS] == 0:
        _record(w, w.records[i], counts)
    elif w.picture > 0.0 and w.tau == 0.0:
        # The other side of where a segment begins.
        if counts[INSIDE] < w.inside_times.shape[1]:
            w.inside_times[i, counts[INSIDE]] = w.base
            copy(w.y, w.inside[i, counts[INSIDE]])
            copy(w.q, w.inside[i, counts[INSIDE], w.n :])
        counts[INSIDE] += 1
    return GOOD


@compiled
def _is_brief(w: Any, h: float) -> bool:
    """Whether a step is too brief for the ledger to shorten it: what ends the run there is told by the states."""
    return bool(h < SHALLOW * (w.base + w.tau))


@compiled
def _ledger_limit(w: Any, h: float, remaining: float) -> float:
    """Longest next step that serves the ledger; shorter than this one where this one does not."""
    norm = 0.0 if _is_brief(w, h) else min(ledger_norm(w, h, remaining), 1e30)
    h_refused, w.h_refused = w.h_refused, 0.0
    if norm == 0.0:
        return np.inf
    # The local error of a quadrature of order 2s - 1 goes with h^(2s), slower where a rate is singular at the start.
    power, least = 2.0 * stage_count(w.member), 0.1
    if w.tau < h < h_refused:  # farther from the start a rate is as smooth as elsewhere
        found = np.log(w.norm_refused / norm) / np.log(h_refused / h)
        # What falls slower still is noise, which no shorter step is rid of.
        if found >= SINGULAR:
            power, least = min(power, found), 0.01
    limit = h * max(least, 0.9 * max(norm, NEGLIGIBLE) ** (-1.0 / power))
    if norm <= 1.0:
        return max(limit, h)
    if w.refused > PATIENCE + w.steps // 2:
        return np.inf
    w.refused += 1
    w.h_refused, w.norm_refused = h, norm
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
    if w.n_margins > 0:
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
        if _is_brief(w, size) and ledger_norm(w, size, left) > 1.0:
            hold_rates(w, size)
    if size > BRIEF * spacing:
        # Beside the ends of a segment and beside events there may be something narrow.
        seen = unseen(w, size, spacing, left, w.tau == 0.0, size == left or any_true(w.fired))
        if seen < 1.0:
            restore_sides(w)
            return MISSED, seen * size
    return TAKEN, size


@compiled
def _accept(w: Any, i: int, size: float, end: float, goes_on: bool) -> None:
    """Move on by a step of this size, with its outputs; to the very end of the segment where it is all but reached."""
    counts = w.counts[i]
    reached = w.base + (w.tau + size)
    whole = size == (end - w.base) - w.tau or reached >= end
    times = w.times[row_of(w.times, i)]
    counts[OUTPUTS] = write_outputs(w, times, w.outputs[i], counts[OUTPUTS], size, end if whole else reached)
    if w.picture > 0.0:
        counts[INSIDE] = write_picture(w, w.inside_times[i], w.inside[i], counts[INSIDE], size)
    store_polynomial(w, size, 1.0)
    accept(w, size)
    _record(w, w.records[i], counts)
    if whole:
        w.tau = end - w.base
        if w.n_margins > 0 and goes_on:
            mark_at_end(w)


@compiled
def _run_segment(w: Any, i: int, end: float, goes_on: bool) -> int:
    """Integrate to the end of a segment; GOOD, or the status that ends the run."""
    h, size_last, norm_last, aim = 0.0, 0.0, 1.0, np.inf
    spacing = w.spacing[row_of(w.spacing, i)]
    if spacing < np.inf:
        spacing = min(spacing, (end - w.base) / FEWEST)
    while end - w.base - w.tau > 0.0:
        if h == 0.0:
            outcome = _start(w, i)
            if outcome != GOOD:
                return outcome
            h, size_last, norm_last, aim = first_size(w, end - w.base), 0.0, 1.0, np.inf
        left = (end - w.base) - w.tau
        remaining = min(left, aim - w.tau)
        # No tiny last step: two of half the length are better than a whole one and a rest.
        if h >= remaining * (1.0 - SQRT_EPS):
            h = remaining
        elif 2.0 * h > remaining:
            h = 0.5 * remaining
        outcome, h, norm, proposed = advance(w, h, i, size_last, norm_last)
        if outcome != GOOD:
            return outcome
        finish_step(w, h)
        limit = _ledger_limit(w, h, left)
        verdict, size = _judge(w, h, limit, left, spacing)
        if verdict == ENDED:
            _write_events(w, w.events[i], w.counts[i])
            return EVENT
        if verdict != TAKEN:
            if verdict == MISSED:
                # A step ends there, so that its last stage feels what the others have missed.
                aim = w.tau + size
            w.rejected += 1
            w.h_factored = 0.0
            h = size
            continue
        if size == remaining:
            aim = np.inf
        _accept(w, i, size, end, goes_on)
        # The controller compares steps that were judged by their error, whatever an event has left of them.
        size_last, norm_last = h, max(norm, LEAST_NORM)
        h = min(keep_matrices(w, h, min(proposed, limit)), growing_size(w))
        if any_true(w.fired):
            if _write_events(w, w.events[i], w.counts[i]):
                return EVENT
            h = 0.0
    return GOOD


@compiled
def _run(w: Any, i: int) -> None:
    """One run, from its initial state through its segments."""
    segments, counts, end = w.segments[row_of(w.segments, i)], w.counts[i], w.ends[i]
    clear(w.fired)
    w.steps = w.rejected = w.residuals = w.jacobians = w.factorizations = w.iterations = 0
    w.member = w.last_member = w.tries = w.calm = w.fresh = w.refused = 0
    if w.core >= LARGE:
        for m in range(w.order.shape[0]):
            w.order[m, 3, 0] = -1  # that of another run counts for nothing
    clear(w.q)
    peaks = w.peaks[row_of(w.peaks, i)]
    copy(peaks[: w.n_ledger], w.q_largest)
    copy(peaks[w.n_ledger : w.n_ledger + w.n_margins], w.margin_largest)
    w.explicit, w.stiff_steps, w.h_refused = w.explicitly, 0, 0.0
    copy(w.y0[i], w.y)
    extremes = peaks[w.n_ledger + w.n_margins :]
    for j in range(w.n):
        w.least[j] = extremes[j] if extremes.shape[0] > 0 else np.inf
        w.largest[j] = extremes[w.n + j] if extremes.shape[0] > 0 else -np.inf
    clear(w.ydot)
    status = GOOD
    for segment in range(segments.shape[0] - 1):
        w.base = segments[segment]
        w.tau = 0.0
        copy(w.parameters[i, segment], w.inputs[1 + 2 * w.n :])
        more = w.goes_on != 0 or segment + 2 < segments.shape[0]
        status = _run_segment(w, i, segments[segment + 1], more)
        if status != GOOD:
            break
    counts[END] = FINISHED if status == GOOD else status
    _write_state(w, end, segments[-1] if status == GOOD else w.base + w.tau)
    if w.n_margins > 0:
        start_margins(w)
        copy(w.margin, end[end.shape[0] - w.n_margins :])
    counters = w.steps, w.rejected, w.residuals, w.jacobians, w.factorizations, w.iterations
    for k, counter in enumerate(counters):
        counts[FIRST_COUNTER + k] = counter


@compiled
def _make_consistent(w: Any, i: int) -> None:
    """The state of a row [t | y | ydot] made consistent in place."""
    n, row = w.n, w.ends[i]
    w.inputs[0] = row[0]
    copy(w.parameters[row_of(w.parameters, i), 0], w.inputs[1 + 2 * n :])
    copy(row[1 : 1 + n], w.trial)
    copy(row[1 + n : 1 + 2 * n], w.trial_dot)
    w.counts[i, END] = find_consistent(w)
    copy(w.trial, row[1:])
    copy(w.trial_dot, row[1 + n :])


def run_batch(first: int, last: int, memory: Any, batch: Any) -> None:
    """Runs first to last - 1 of a batch, whose fields come as a plain tuple, since Numba looks at the types of a named
    one twice as long. Every run writes to its own rows, so the result does not depend on the threads, each of which has
    a memory of its own. Without segments the rows of ``ends`` are made consistent.
    """
    w = lay_out(batch, memory)
    w.loose = loosening(w.rtol)
    for i in range(first, last):
        if w.segments.shape[1] == 0:
            _make_consistent(w, i)
        else:
            _run(w, i)
