"""Whole runs, compiled: segments, steps, events, outputs, edges; and the loop over a batch of runs."""

from typing import Any

import numpy as np

from surfacechem.solve.contract import FITTED_PART, RETURN_FACTOR
from surfacechem.solve.edges import find_magnitudes, jump, resolve
from surfacechem.solve.radau.consistency import find_consistent
from surfacechem.solve.radau.dense import finish_step, hold_rates, ledger_norm
from surfacechem.solve.radau.guards import AT_START, find_event, mark_at_end, resolved, restore_sides, start_margins
from surfacechem.solve.radau.linear import LARGE_MATRIX
from surfacechem.solve.radau.newton import stage_count
from surfacechem.solve.radau.outputs import is_within, write_interior, write_now, write_outputs
from surfacechem.solve.radau.step import (
    CHECK_PART,
    EVENT,
    FINISHED,
    GOOD,
    LEFT,
    accept,
    advance,
    first_defect,
    first_size,
    growing_size,
    keep_matrices,
    loosening,
    restart,
    store_polynomial,
)
from surfacechem.solve.radau.stepper import ARCS, END, EVENTS, FIRST_COUNTER, INSIDE, OUTPUTS, RECORDS, RETURNS
from surfacechem.solve.radau.work import (
    MARGINS,
    any_true,
    clear,
    compiled,
    copy,
    evaluate,
    keep_largest,
    lay_out,
    put,
    row_of,
)
from surfacechem.tolerances import FEW_EPS, LOOSE_RTOL, MICROMETRE, NEGLIGIBLE, PICOMETRE, RUN_EPS, SQRT_EPS, ULPS

MOST_REFUSED = 40
"""Steps that the ledger may reject since the last restart, in addition to half of all: its error may be noise, which
must not end a run.
"""
FEWEST_CHECKS = 4
"""Fewest checks of the steps against the equations inside in a segment, however short: a choice. Each costs an
evaluation in every segment; a feature that lasts less than a fourth of a segment may be missed.
"""
SINGULAR_POWER = 0.5
"""Least order in the step of the error of an account whose rate is singular at the start: that of an inverse square
root, as in ideal diffusion; the error of a logarithm is of order one.
"""
LEAST_NORM = 1e-2
"""Error norm of the last step below which it tells the controller nothing more (Hairer & Wanner II, IV.8)."""

TAKEN, REPEAT, DEFECTIVE, ENDED = range(4)
"""Verdicts on a step."""


@compiled
def _write_state(w: Any, row: Any, t: float) -> None:
    """Write [t | y | ydot | ledger] of the current state, including the ledger at the start of the arc."""
    n = w.n
    row[0] = t
    for j in range(n):
        row[1 + j] = w.y[j]
        row[1 + n + j] = w.ydot[j]
    for m in range(w.n_ledger):
        row[1 + 2 * n + m] = w.booked[m] + w.q[m]


@compiled
def _now(w: Any) -> float:
    """Return the time of the run."""
    return float(w.arc_start + (w.base + w.tau))


@compiled
def _write_events(w: Any, events: Any, counts: Any) -> bool:
    """Write a row for each guard that fired, except those of edges, which are written as these are carried out; True if
    one of them is terminal.
    """
    now = w.base + w.tau
    terminal = False
    for m in range(w.n_margins):
        if w.fired[m] == 0:
            continue
        terminal = terminal or w.kinds[m, 0] == 1
        if m >= w.n_margins - w.edges.shape[0]:
            continue
        k = min(counts[EVENTS], events.shape[0]) - 1
        if w.kinds[m, 0] == 0:
            # A step ends just short of a kink and the next one passes it: count one event.
            while k >= w.first_event and now - (events[k, 1] - w.arc_start) <= RUN_EPS * now and events[k, 0] != m:
                k -= 1
            if k >= w.first_event and now - (events[k, 1] - w.arc_start) <= RUN_EPS * now:
                continue
        if counts[EVENTS] < events.shape[0]:
            row = events[counts[EVENTS]]
            row[0] = m
            _write_state(w, row[1:], _now(w))
        # Count events without space too: the run is then repeated with space for all.
        counts[EVENTS] += 1
    return terminal


@compiled
def _record(w: Any, records: Any, counts: Any) -> None:
    # A step too short to change the time repeats the event that ended the last arc.
    if counts[RECORDS] > 0 and w.clocks.shape[0] > 0 and _now(w) == w.arc_start:
        return
    if counts[RECORDS] < records.shape[0]:
        _write_state(w, records[counts[RECORDS]], _now(w))
    counts[RECORDS] += 1


@compiled
def _write_up_to(w: Any, i: int, end: float) -> None:
    """Write the outputs up to this time of the arc that are still missing, all with the present state.

    Needed at the start of a segment, and where time cannot tell an event from its end, after which no arc may follow.
    """
    counts, times = w.counts[i], w.times[row_of(w.times, i)]
    while counts[OUTPUTS] < times.shape[0] and is_within(w, times[counts[OUTPUTS]], end):
        write_now(w, w.outputs[i, counts[OUTPUTS]])
        counts[OUTPUTS] += 1


@compiled
def _start(w: Any, i: int) -> int:
    """Start or restart at the current state; record it if it is the first."""
    outcome = restart(w)
    if outcome != GOOD:
        return outcome
    counts = w.counts[i]
    start_margins(w)
    clear(w.fired)
    _write_up_to(w, i, w.base)
    if counts[RECORDS] == 0:
        _record(w, w.records[i], counts)
    elif w.line_error > 0.0 and w.tau == 0.0:
        # Store the state on the other side of the breakpoint.
        if counts[INSIDE] < w.inside_times.shape[1]:
            w.inside_times[i, counts[INSIDE]] = w.arc_start + w.base
            write_now(w, w.inside[i, counts[INSIDE]])
        counts[INSIDE] += 1
    return GOOD


@compiled
def _is_brief(w: Any, h: float, remaining: float) -> bool:
    """True if a step is too brief for the ledger to shorten it, for the run and for its segment: there the states
    decide whether the run ends.
    """
    return bool(h < LOOSE_RTOL * (min(w.base, remaining) + w.tau))


@compiled
def _ledger_limit(w: Any, h: float, remaining: float) -> float:
    """Return the longest next step that the error of the ledger allows; shorter than this one if that is rejected."""
    norm = 0.0 if _is_brief(w, h, remaining) else min(ledger_norm(w, h, remaining), 1e30)
    h_refused, w.h_refused = w.h_refused, 0.0
    if norm == 0.0:
        return np.inf
    # The local error of a quadrature of order 2s - 1 is O(h^(2s)), of lower order if a rate is singular at the start.
    power, least = 2.0 * stage_count(w.member), 0.1
    if w.tau < h < h_refused:  # farther from the start the rate is smooth
        found = np.log(w.norm_refused / norm) / np.log(h_refused / h)
        # An error of lower order is noise, which a shorter step does not reduce.
        if found >= SINGULAR_POWER:
            power, least = min(power, found), 0.01
    limit = h * max(least, 0.9 * max(norm, NEGLIGIBLE) ** (-1.0 / power))
    if norm <= 1.0:
        return max(limit, h)
    if w.ledger_rejections > MOST_REFUSED + (w.steps - w.steps_before) // 2:
        return np.inf
    w.ledger_rejections += 1
    w.h_refused, w.norm_refused = h, norm
    return limit


@compiled
def _judge(w: Any, h: float, limit: float, left: float, spacing: float) -> tuple[int, float]:
    """Return a verdict on a converged step, and a size: up to where it is TAKEN, or that of the next trial.

    An event may shorten it. It is repeated if the ledger allows less (``limit``), if a guard may be passed at its
    start, and, DEFECTIVE, up to a feature between its stages.
    """
    if limit < h:
        return REPEAT, limit
    size = h
    if w.n_margins > 0:
        size = find_event(w, h)
    if size == AT_START:
        return ENDED, h
    if size == 0.0:
        return REPEAT, 0.25 * h
    if size != h:
        # The step onto an event may end where a rate is singular, unlike the longer step. The ledger approaches it
        # in ever shorter steps, and holds the rates at the start over the last one.
        limit = _ledger_limit(w, size, left)
        if limit < size:
            restore_sides(w)
            return REPEAT, limit
        if _is_brief(w, size, left) and ledger_norm(w, size, left) > 1.0:
            hold_rates(w, size)
    if size > CHECK_PART * spacing:
        # Next to the ends of a segment and to events there may be narrow features.
        defect_at = first_defect(w, size, spacing, left, w.tau == 0.0, size == left or any_true(w.fired))
        if defect_at < 1.0:
            restore_sides(w)
            return DEFECTIVE, defect_at * size
    return TAKEN, size


@compiled
def _accept(w: Any, i: int, size: float, end: float, continued: bool) -> None:
    """Move on by a step of this size and write its outputs; up to roundoff to the exact end of the segment."""
    counts = w.counts[i]
    reached = w.base + (w.tau + size)
    whole = size == (end - w.base) - w.tau or reached >= end
    # A step that ends just short of a kink at the end of the segment reaches the end, as far as time tells.
    at_end = whole or end - reached <= resolved(w, size)
    times = w.times[row_of(w.times, i)]
    # The last outputs of an arc are those up to the end of its segment.
    shown = w.outputs_end - w.arc_start if whole and end == w.arc_end else end if whole else reached
    counts[OUTPUTS] = write_outputs(w, times, w.outputs[i], counts[OUTPUTS], size, shown)
    if w.line_error > 0.0:
        counts[INSIDE] = write_interior(w, w.inside_times[i], w.inside[i], counts[INSIDE], size)
    store_polynomial(w, size, 1.0)
    accept(w, size)
    keep_largest(w.y, w.peaks_seen)
    _record(w, w.records[i], counts)
    if whole:
        w.tau = end - w.base
    if at_end and w.n_margins > 0 and continued:
        mark_at_end(w)


@compiled
def _run_segment(w: Any, i: int, end: float, continued: bool) -> int:
    """Integrate to the end of a segment; return GOOD, or the status that ends the run."""
    h, size_last, norm_last, aim = 0.0, 0.0, 1.0, np.inf
    spacing = w.spacing[row_of(w.spacing, i)]
    if spacing < np.inf:
        spacing = min(spacing, (end - w.base) / FEWEST_CHECKS)
    while end - w.base - w.tau > 0.0:
        if h == 0.0:
            outcome = _start(w, i)
            if outcome != GOOD:
                return outcome
            h, size_last, norm_last, aim = first_size(w, end - w.base), 0.0, 1.0, np.inf
        left = (end - w.base) - w.tau
        remaining = min(left, aim - w.tau)
        # No tiny last step: two equal ones are better than a full one and a remainder, unless that is roundoff of time.
        if h >= remaining * (1.0 - SQRT_EPS) - ULPS * w.tau:
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
            if verdict == DEFECTIVE:
                # End a step there, so that its last stage sees what the other stages have missed.
                aim = w.tau + size
            w.rejected += 1
            w.h_factored = 0.0
            h = size
            continue
        if size == remaining:
            aim = np.inf
        _accept(w, i, size, end, continued)
        # The controller compares the steps whose error was estimated, even if an event has shortened them.
        size_last, norm_last = h, max(norm, LEAST_NORM)
        h = min(keep_matrices(w, h, min(proposed, limit)), growing_size(w))
        if any_true(w.fired):
            if _write_events(w, w.events[i], w.counts[i]):
                return EVENT
            h = 0.0
    return GOOD


@compiled
def _reset_history(w: Any, i: int) -> None:
    """Reset the history of steps, as at the start of a run or an arc."""
    clear(w.fired)
    w.member = w.last_member = w.newton_steps = w.easy_steps = w.jacobian_age = w.ledger_rejections = 0
    if w.core >= LARGE_MATRIX:
        for m in range(w.order.shape[0]):
            w.order[m, 3, 0] = -1  # discard the pivot order of another run
    clear(w.q)
    clear(w.ydot)
    clear(w.noise)
    w.explicit, w.stiff_steps, w.h_refused = int(w.explicitly), 0, 0.0
    w.first_event, w.steps_before, w.rejected_before = w.counts[i, EVENTS], w.steps, w.rejected


@compiled
def _run_segments(w: Any, i: int) -> int:
    """Run until an event ends it; return GOOD, or the status that ends it."""
    segments, peaks = w.segments[row_of(w.segments, i)], w.peaks[row_of(w.peaks, i)]
    _reset_history(w, i)
    copy(peaks[: w.n_ledger], w.q_largest)
    copy(peaks[w.n_ledger : w.n_ledger + w.n_margins], w.margin_largest)
    extremes = peaks[w.n_ledger + w.n_margins :]
    for j in range(w.n):
        w.least[j] = extremes[j] if extremes.shape[0] > 0 else np.inf
        w.largest[j] = extremes[w.n + j] if extremes.shape[0] > 0 else -np.inf
    for m in range(w.n_margins):
        w.active[m] = w.kinds[m, 5]
    w.arc_end = w.outputs_end = np.inf
    for segment in range(segments.shape[0] - 1):
        w.base, w.tau = segments[segment], 0.0
        copy(w.parameters[i, segment], w.inputs[1 + 2 * w.n :])
        more = w.continued != 0.0 or segment + 2 < segments.shape[0]
        status = _run_segment(w, i, segments[segment + 1], more)
        if status != GOOD:
            return status
    return GOOD


@compiled
def _begin_arc(w: Any, i: int) -> None:
    """Begin an arc at the moment, with its own time."""
    n, counts, t = w.n, w.counts[i], w.moment[0]
    if counts[ARCS] < w.arcs.shape[1]:
        row = w.arcs[i, counts[ARCS]]
        row[0] = t
        row[2], row[3], row[4] = counts[RECORDS], counts[OUTPUTS], counts[INSIDE]
        copy(w.moment[1 + 2 * n :], row[5:])
    counts[ARCS] += 1
    _reset_history(w, i)
    w.arc_start, w.tau = t, 0.0
    copy(w.moment[1 : 1 + n], w.y)
    keep_largest(w.y, w.peaks_seen)
    copy(w.exchanged, w.q_largest)
    copy(w.moment, w.inputs)
    w.inputs[1 + 2 * n + w.clocks[0]] = t
    for k in range(1, w.clocks.shape[0]):
        w.inputs[1 + 2 * n + w.clocks[k]] -= t


@compiled
def _run_arc(w: Any, i: int, end: float, continued: bool) -> int:
    """Flow from the moment to an edge, a limit, or the end of a segment; return GOOD, or the status that ends the arc.

    The moment is then that of its end.
    """
    flight_time = w.flight_time if w.rebound_time == w.moment[0] else 0.0
    _begin_arc(w, i)
    # After a rebound the sizes of guards that return are zero, as for exact values.
    copy(w.magnitude, w.margin_largest)
    for m in range(w.n_margins - w.edges.shape[0], w.n_margins):
        if w.edges[m - w.n_margins + w.edges.shape[0], RETURNS] >= 0:
            w.margin_largest[m] = 0.0 if flight_time > 0.0 else max(w.magnitude[m], MICROMETRE)
    # Stop just short of a breakpoint at which no load changes: formulas there are those of the next segment.
    last = end if w.loads_change else max(end - FEW_EPS * end, 0.5 * (w.arc_start + end))
    w.arc_end, w.outputs_end, w.base = last - w.arc_start, end, 0.0
    status = GOOD
    if 0.0 < RETURN_FACTOR * flight_time < FITTED_PART * w.arc_end:
        # A return so soon that a step might miss it gets a separate segment.
        status = _run_segment(w, i, RETURN_FACTOR * flight_time, True)
        w.base, w.tau = w.base + w.tau, 0.0
    if status == GOOD:
        status = _run_segment(w, i, w.arc_end, continued)
    if w.counts[i, ARCS] <= w.arcs.shape[1]:
        w.arcs[i, w.counts[i, ARCS] - 1, 1] = w.base + w.tau
    w.moment[0] = end if status == GOOD else min(_now(w), end)
    if status == EVENT and w.moment[0] == end:
        _write_up_to(w, i, w.outputs_end - w.arc_start)
    for m in range(w.n_ledger):
        w.booked[m] += w.q[m]
    keep_largest(w.booked, w.exchanged)
    clear(w.q)
    copy(w.y, w.moment[1:])
    for j in range(w.n):
        w.least[j], w.largest[j] = min(w.least[j], w.y[j]), max(w.largest[j], w.y[j])
    copy(w.ydot, w.moment[1 + w.n :])
    return status


@compiled
def _has_passed_guard(w: Any) -> bool:
    """True if an arc has ended beyond a guard it should have stopped at, by more than a picometre."""
    first, passed = w.n_margins - w.edges.shape[0], False
    if w.edges.shape[0] == 0:
        return passed
    put(w, 0.0, w.y, w.ydot)
    evaluate(w, MARGINS, w.margin_probe)
    for e in range(w.edges.shape[0]):
        closed = w.edges[e, RETURNS] >= 0 and w.active[first + e] == 1 and w.margin_probe[first + e] < -PICOMETRE
        passed = passed or (closed and w.fired[first + e] == 0)
    return passed


@compiled
def _carry_out(w: Any, i: int) -> int:
    """Carry out the edge at which an arc has ended: GOOD, EVENT at a limit, LEFT if left to Instant."""
    first, last, limit = w.n_margins - w.edges.shape[0], -1, False
    for m in range(w.n_margins):
        fired = w.fired[m] != 0
        last = m if fired else last
        limit = limit or (fired and m < first and w.kinds[m, 0] == 1)
    if last < first:
        return EVENT
    find_magnitudes(w)
    return GOOD if not limit and jump(w, i, last - first) else LEFT


@compiled
def _begin_segment(w: Any, i: int, segment: int) -> None:
    """Set the moment to the start of a segment, with its parameters, except the modes and registers, which last."""
    parameters, first = w.parameters[i], 1 + 2 * w.n
    for k in range(w.held.shape[0]):
        w.reset[k] = w.moment[first + w.held[k]]
    copy(parameters[segment], w.moment[first:])
    for k in range(w.held.shape[0] if segment > 0 else 0):
        w.moment[first + w.held[k]] = w.reset[k]
    w.moment[0] = w.segments[row_of(w.segments, i), segment]
    clear(w.moment[1 + w.n : first])
    w.loads_change = segment + 1 == parameters.shape[0]
    for j in range(0 if w.loads_change else parameters.shape[1]):
        if parameters[segment, j] != parameters[segment + 1, j]:
            w.loads_change = 1


@compiled
def _run_arcs(w: Any, i: int) -> int:
    """Run and carry out edges; return GOOD, or the status that ends the run."""
    segments = w.segments[row_of(w.segments, i)]
    last = segments.shape[0] - 1
    clear(w.exchanged)
    copy(w.least_peaks, w.peaks_seen)
    w.rebound_time, w.flight_time = -np.inf, 0.0
    for k in range(w.jump_times.shape[0]):
        w.jump_times[k] = -np.inf
    for j in range(w.n):
        w.moment[1 + j] = w.least[j] = w.largest[j] = w.y[j]
    for segment in range(last):
        _begin_segment(w, i, segment)
        end = segments[segment + 1]
        while True:
            if not resolve(w, i, segments[last]):
                return LEFT
            if w.moment[0] >= end:
                break
            status = _run_arc(w, i, end, segment + 1 < last)
            if status in (GOOD, EVENT) and _has_passed_guard(w):
                return LEFT
            if status == EVENT:
                status = _carry_out(w, i)
            elif status == GOOD:
                break
            if status != GOOD:
                return status
    return GOOD


@compiled
def _run(w: Any, i: int) -> None:
    """Run from the initial state to the end."""
    counts, end, segments = w.counts[i], w.ends[i], w.segments[row_of(w.segments, i)]
    w.steps = w.rejected = w.residuals = w.jacobians = w.factorizations = w.iterations = 0
    w.arc_start, w.base, w.tau, w.h_factored = 0.0, segments[0], 0.0, 0.0
    clear(w.booked)
    copy(w.y0[i], w.y)
    status = _run_arcs(w, i) if w.clocks.shape[0] > 0 else _run_segments(w, i)
    counts[END] = FINISHED if status == GOOD else status
    _write_state(w, end, segments[-1] if status == GOOD else _now(w))
    if w.n_margins > 0:
        start_margins(w)
        copy(w.margin, end[end.shape[0] - w.n_margins :])
    counters = w.steps, w.rejected, w.residuals, w.jacobians, w.factorizations, w.iterations
    for k, counter in enumerate(counters):
        counts[FIRST_COUNTER + k] = counter


def run_batch(count: int, table: int) -> None:
    """Solve the runs of a batch; without segments make the rows of ``ends`` consistent.

    ``table`` is the address of the addresses of the arrays of the batch and of the memory. Every run writes to its own
    rows and each thread has its own memory, so the result does not depend on the threads.
    """
    w = lay_out(table)
    w.loose = loosening(w.rtol)
    for i in range(count):
        if w.segments.shape[1] > 0:
            _run(w, i)
            continue
        n, row = w.n, w.ends[i]
        w.inputs[0] = row[0]
        copy(w.parameters[row_of(w.parameters, i), 0], w.inputs[1 + 2 * n :])
        copy(row[1 : 1 + n], w.trial)
        copy(row[1 + n : 1 + 2 * n], w.trial_dot)
        w.counts[i, END] = find_consistent(w)
        copy(w.trial, row[1:])
        copy(w.trial_dot, row[1 + n :])
