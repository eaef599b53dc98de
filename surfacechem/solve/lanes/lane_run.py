"""Whole runs, eight at once, compiled: starts, steps, events, load segments and ends; the loop with explicit steps.

A lane whose run has ended takes the next one. Runs that need more (stiffness, guards that touch zero or start there,
rates that are not finite, noise) end with status LEFT and are repeated by the stepper for single runs.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from surfacechem.compile.vectors import LANES
from surfacechem.solve.lanes.lane_guards import (
    ends_on_guard,
    find_crossings,
    mark_at_end,
    may_cross,
    start_margins,
)
from surfacechem.solve.lanes.lane_step import (
    END_STAGE,
    find_defects,
    find_noise,
    find_stiff,
    first_defect,
    interpolate,
    larger,
    needs_checks,
    norm_of,
    nothing,
    prepare_checks,
    propose_size,
    put_moved,
    put_roughly,
    put_start,
    root_of,
    set_weights,
    smaller,
    try_step,
)
from surfacechem.solve.lanes.layout import EXPLICIT_MEMORY, NUMBERS, ORDER, SIZES
from surfacechem.solve.lanes.vector import absolute, any_lane, lanes, put, put_where, same, where
from surfacechem.solve.radau.driver import FEWEST_CHECKS, LEAST_NORM
from surfacechem.solve.radau.explicit import STIFF_STEPS
from surfacechem.solve.radau.step import EVENT, FINISHED, LEFT, loosening
from surfacechem.solve.radau.stepper import END, EVENTS, FIRST_COUNTER, OUTPUTS, RECORDS
from surfacechem.solve.radau.work import MARGINS, RATES, StepperRecord, compiled, evaluate, laying_out, row_of
from surfacechem.tolerances import FORMULA_EPS, NEGLIGIBLE, NEWTON_EPS, RUN_EPS, SQRT_EPS, ULPS

MOST_TRIALS = 16
"""Rejected trials in a row after which the cause is noise or stiffness. At a singular start, where each is a tenth of
the last, they reach the shortest steps that matter.
"""
CONSTANTS = RATES + 1
"""Row of the constants in the table of addresses."""
FREE_LANES = 4
"""Number of free lanes at which new runs begin, which divides the number of lanes: a choice. A smaller one fills the
lanes better, a larger one shares the cost of starts and ends among more runs.
"""


@compiled
def _write_state(w: Any, row: Any, lane: int) -> None:
    """Write [t | y | ydot | ledger] at the start of a lane's step."""
    n = w.n
    row[0] = w.t[lane]
    for m in range(n):
        row[1 + m] = w.y[m, lane]
        row[1 + n + m] = w.k[0, m, lane]
    for m in range(w.n_ledger):
        row[1 + 2 * n + m] = w.y[n + m, lane]


@compiled
def _record(w: Any, lane: int) -> None:
    """Record the start of a run or the end of a step."""
    row, records = int(w.steps[lane]), w.records[w.run[lane]]
    if row < records.shape[0]:
        _write_state(w, records[row], lane)


@compiled
def _end(w: Any, lane: int, status: int) -> None:
    """End a run and free its lane. Its guards are evaluated later, together with those of other runs that end."""
    i = w.run[lane]
    counts = w.counts[i]
    counts[END], counts[RECORDS] = status, 1 + int(w.steps[lane])
    _write_state(w, w.ends[i], lane)
    for k, counter in enumerate((w.steps[lane], w.rejected[lane], w.evaluations[lane])):
        counts[FIRST_COUNTER + k] = int(counter)
    w.over[lane] = i
    w.ended += 1
    _leave(w, lane)


@compiled
def _leave(w: Any, lane: int) -> None:
    w.run[lane], w.next_output[lane], w.busy[lane], w.fresh[lane] = -1, np.inf, 0.0, 0.0
    w.free += 1


@compiled
def _give_up(w: Any, lane: int) -> None:
    """Free a lane and leave its run to the stepper for single runs."""
    w.counts[w.run[lane], END] = LEFT
    _leave(w, lane)


@compiled
def _enter(w: Any, lane: int) -> None:
    """Enter the current load segment of a lane: its end and its parameters."""
    i = w.run[lane]
    segment, segments, spacing = w.segment[lane], w.segments[row_of(w.segments, i)], w.spacing[row_of(w.spacing, i)]
    w.t[lane] = w.entered[lane] = segments[segment]
    w.end[lane] = segments[segment + 1]
    for j in range(w.parameters.shape[2]):
        w.inputs[1 + 2 * w.n + j, lane] = w.parameters[i, segment, j]
    w.spacing_of[lane] = min(spacing, (w.end[lane] - w.t[lane]) / FEWEST_CHECKS)
    w.fresh[lane] = 1.0


@compiled
def _begin(w: Any, lane: int, i: int) -> None:
    """Begin run i in a lane."""
    w.run[lane], w.segment[lane], w.busy[lane], w.most_steps[lane] = i, 0, 1.0, w.max_steps[row_of(w.max_steps, i)]
    w.free -= 1
    w.steps[lane] = w.rejected[lane] = w.evaluations[lane] = w.failed[lane] = w.stiff_steps[lane] = w.landing[lane] = 0
    peaks = w.peaks[row_of(w.peaks, i)]
    for m in range(w.n):
        w.y[m, lane] = w.y0[i, m]
    for m in range(w.n_ledger):
        w.y[w.n + m, lane] = 0.0
        w.q_largest[m, lane] = peaks[m]
    for m in range(w.n_margins):
        w.margin_largest[m, lane] = peaks[w.n_ledger + m]
        w.fired[m, lane] = 0.0
    _enter(w, lane)


@compiled
def _first_sizes(w: Any) -> Any:
    """First step sizes: the change of the rate over a small trial step keeps within the tolerance (II.4)."""
    span, speed, size = lanes(w.end) - lanes(w.t), norm_of(w, w.k[0]) / w.loose, norm_of(w, w.y) / w.loose
    trial = smaller(larger(size * NEGLIGIBLE**2, 1e-2) / speed, span * NEGLIGIBLE)
    put_moved(w, trial, w.k[0], trial)
    evaluate(w, RATES, w.rates)
    for m in range(w.n):
        put(w.rates[m], lanes(w.rates[m]) - lanes(w.k[0, m]))
    change = norm_of(w, w.rates) / w.loose / speed
    scale = trial / change
    first = smaller(scale * smaller(1.0 / w.root_of(w, speed * scale), 1.0), 0.05 * span)
    first = where(change * span > SQRT_EPS * trial, first, 0.05 * span)
    return where((speed > 0.0) & (speed < np.inf), first, NEGLIGIBLE * span)


@compiled
def _start(w: Any) -> None:
    """Evaluate rates, sides of guards and first step sizes of the lanes that start or restart; leave others
    unchanged.
    """
    fresh = lanes(w.fresh) > 0.5
    evaluate(w, CONSTANTS, w.inputs[1 + 2 * w.n + w.parameters.shape[2]])
    put_start(w)
    evaluate(w, RATES, w.rates)
    for m in range(w.columns):
        put_where(fresh, w.k[0, m], lanes(w.rates[m]))
    put(w.unclear, 0.0)
    if w.n_margins > 0:
        start_margins(w, fresh)
    set_weights(w)
    put_where(fresh, w.proposed, _first_sizes(w))
    put_where(fresh, w.aim, np.inf)
    put_where(fresh, w.h_last, 0.0)
    put_where(fresh, w.known, 0.0)
    for lane in range(LANES):
        i = w.run[lane]
        if w.fresh[lane] < 0.5:
            continue
        w.fresh[lane], w.begins[lane], w.again[lane], w.failed[lane], w.spread[lane] = 0.0, 1.0, 0.0, 0, 0.0
        for m in range(w.n_margins):
            w.fired[m, lane] = 0.0
        if w.unclear[lane] > 0.5:
            _give_up(w, lane)
            continue
        counts, times = w.counts[i], w.times[row_of(w.times, i)]
        if counts[OUTPUTS] == 0 and times.shape[0] > 0 and times[0] <= w.t[lane]:
            for m in range(w.columns):
                w.outputs[i, 0, m] = w.y[m, lane]
            counts[OUTPUTS] = 1
        _find_next_output(w, lane)
        if w.steps[lane] == 0.0:
            _record(w, lane)


@compiled
def _choose_sizes(w: Any) -> None:
    """Choose the step of each lane: the proposed size, up to the end of its segment or the time where a step has to
    end; zero where there is no run.
    """
    t, h, landing = lanes(w.t), lanes(w.proposed), lanes(w.landing) > 0.5
    left = lanes(w.end) - t
    remaining = smaller(lanes(w.aim) - t, left)
    # No tiny last step: two equal ones are better than a full one and a remainder, unless that is roundoff of time.
    whole = where(2.0 * h > remaining, 0.5 * remaining, h)
    whole = where(h >= remaining * (1.0 - SQRT_EPS) - ULPS * t, remaining, whole)
    h = smaller(where(landing, h, whole), left)  # a step onto a guard may aim a rounding beyond
    put(w.h, where(lanes(w.busy) > 0.5, h, 0.0))
    put(w.last, where(h == left, 1.0, 0.0))
    put(w.onto, where(landing, 1.0, 0.0))


@compiled
def _find_next_output(w: Any, lane: int) -> None:
    k, times = w.counts[w.run[lane], OUTPUTS], w.times[row_of(w.times, w.run[lane])]
    w.next_output[lane] = times[k] if k < times.shape[0] else np.inf


@compiled
def _write_outputs(w: Any, lane: int) -> None:
    """Write the outputs up to the end of the step."""
    i, t_new = w.run[lane], w.t_new[lane]
    counts, times, outputs = w.counts[i], w.times[row_of(w.times, i)], w.outputs[i]
    k = counts[OUTPUTS]
    while k < times.shape[0] and times[k] <= t_new:
        x = (times[k] - w.t[lane]) / w.h[lane]
        for m in range(w.columns):
            total = w.polynomial[ORDER - 1, m, lane]
            for d in range(ORDER - 2, -1, -1):
                total = total * x + w.polynomial[d, m, lane]
            inside = w.y[m, lane] + w.h[lane] * x * total
            outputs[k, m] = w.y_new[m, lane] if times[k] == t_new else inside
        k += 1
    counts[OUTPUTS] = k
    _find_next_output(w, lane)


@compiled
def _write_events(w: Any, lane: int) -> bool:
    """Write a row for each guard that fires at the state of the lane; True if one of them is terminal."""
    i = w.run[lane]
    counts, events = w.counts[i], w.events[i]
    nearest, terminal = np.inf, False
    for m in range(w.n_margins):
        if w.fired[m, lane] > 0.5:
            nearest = min(nearest, w.side[m, lane] * w.margin[m, lane])
    for m in range(w.n_margins):
        value = w.side[m, lane] * w.margin[m, lane]
        if w.fired[m, lane] < 0.5 or value > max(nearest, FORMULA_EPS * w.margin_largest[m, lane]):
            w.fired[m, lane] = 0.0
            continue
        if counts[EVENTS] < events.shape[0]:
            row = events[counts[EVENTS]]
            row[0] = m
            _write_state(w, row[1:], lane)
        counts[EVENTS] += 1
        terminal = terminal or w.kinds[m, 0] == 1
    return terminal


@compiled
def _move_on(w: Any) -> None:
    """Move the lanes whose steps are accepted to the ends of these steps."""
    w.keep_step(w)
    taken, t_new = lanes(w.taken) > 0.5, lanes(w.t_new)
    for m in range(w.columns):
        put_where(taken, w.y[m], lanes(w.y_new[m]))
        put_where(taken, w.k[0, m], lanes(w.k[w.end_stage, m]))
    for m in range(w.n_margins):
        put_where(taken, w.margin_first[m], lanes(w.margin_end[m]))
    for m in range(w.n_ledger):
        put(w.q_largest[m], larger(absolute(lanes(w.y[w.n + m])), lanes(w.q_largest[m])))
    put_where(taken, w.t, t_new)
    for flag in (w.begins, w.again, w.failed):
        put_where(taken, flag, 0.0)
    put_where(taken, w.steps, lanes(w.steps) + 1.0)
    stiff_steps = lanes(w.stiff_steps)
    fewer = larger(stiff_steps - 1.0, same(0.0))
    put_where(taken, w.stiff_steps, where(lanes(w.stiff) > 0.5, stiff_steps + 2.0, fewer))
    # An error far below the tolerance tells the controller nothing more.
    put_where(taken, w.h_last, lanes(w.h))
    put_where(taken, w.root_last, larger(lanes(w.root), w.least_root))
    put_where(taken, w.proposed, lanes(w.following))
    put_where(taken, w.aim, where(t_new >= lanes(w.aim), np.inf, lanes(w.aim)))


@compiled
def _go_on(w: Any, lane: int) -> None:
    """Handle what follows an accepted step: an event, the next segment, or the end."""
    whole = w.t[lane] == w.end[lane]
    # A step that ends just short of a kink at the end of the segment reaches the end, as far as time tells.
    near = w.landing[lane] > 0 and w.end[lane] - w.t[lane] <= NEWTON_EPS * w.t[lane] + RUN_EPS * w.h[lane]
    more = (whole or near) and w.segment[lane] + 2 < w.segments.shape[1]
    if (more and mark_at_end(w, lane)) or w.landing[lane] > 0:
        w.landing[lane], w.fresh[lane] = 0, 1.0
        if _write_events(w, lane):
            _end(w, lane, EVENT)
            return
    if more:
        w.segment[lane] += 1
        _enter(w, lane)
    elif whole:
        _end(w, lane, FINISHED)


@compiled
def _conclude(w: Any, lane: int) -> None:
    """Decide about a trial step that may not be accepted as it is: repeat it, shorter or onto a guard, or accept it."""
    h = w.h[lane]
    if w.again[lane] > 0.5:
        w.find_noise(w, lane)
    if not w.norm[lane] < 1.0:
        w.h_tried[lane], w.norm_tried[lane] = h, min(w.norm[lane], 1e30)
        w.proposed[lane], w.again[lane] = w.following[lane], 1.0
        w.failed[lane] += 1
        w.rejected[lane] += 1
        # If this was a step onto a guard, the step in which that was found has misled: go on by whole steps.
        w.landing[lane] = 0
        for m in range(w.n_margins):
            w.fired[m, lane] = 0.0
    elif w.defect_at[lane] < 1.0:
        # End a step there, so that its last stage sees what the other stages have missed.
        w.aim[lane], w.proposed[lane] = w.t[lane] + w.defect_at[lane] * h, w.defect_at[lane] * h
        w.failed[lane] += 1
        w.rejected[lane] += 1
    elif w.n_margins > 0 and w.landing[lane] == 0 and w.crossing[lane] < 1.0:
        w.landing[lane], w.nudge[lane], w.longest[lane] = 1, 0.0, 1.25 * h
        w.proposed[lane] = w.crossing[lane] * h
        w.rejected[lane] += 1
    elif w.landing[lane] == 0 or ends_on_guard(w, lane):
        w.taken[lane] = 1.0
        if w.next_output[lane] <= w.t_new[lane]:
            _write_outputs(w, lane)


@compiled
def _are_pending(w: Any, pending: Any) -> bool:
    """Mark the lanes of a mask in which something is to be done one by one; True if there are any."""
    pending = pending & (lanes(w.busy) > 0.5)
    put(w.pending, where(pending, 1.0, 0.0))
    return bool(any_lane(pending))


@compiled
def _continue_all(w: Any) -> None:
    """Go on after the steps: where one ends at an event, a segment or the run; where a run is given up."""
    taken = lanes(w.taken) > 0.5
    ends = (lanes(w.t) == lanes(w.end)) | (lanes(w.landing) > 0.5)
    for lane in range(LANES if _are_pending(w, taken & (ends if w.records.shape[1] == 0 else taken)) else 0):
        if w.pending[lane] > 0.5:
            _record(w, lane)
            _go_on(w, lane)
    # Guards are unclear, or explicit steps make no progress.
    slow = (lanes(w.failed) > float(MOST_TRIALS)) | (lanes(w.stiff_steps) >= 2.0 * STIFF_STEPS)
    spent = lanes(w.steps) + lanes(w.rejected) >= lanes(w.most_steps)
    # A step onto a guard may be shorter than time resolves: near rupture the state changes by much within it.
    stuck = (lanes(w.landing) < 0.5) & ~(lanes(w.proposed) > ULPS * lanes(w.t))
    for lane in range(LANES if _are_pending(w, (lanes(w.unclear) > 0.5) | slow | spent | stuck) else 0):
        if w.pending[lane] > 0.5:
            _give_up(w, lane)


@compiled
def _write_margins(w: Any) -> None:
    """Write the guards of runs that have just ended."""
    if w.ended == 0:
        return
    w.ended = 0
    if w.n_margins > 0:
        put_start(w)
        evaluate(w, MARGINS, w.margin)
    for lane in range(LANES):
        if w.over[lane] >= 0:
            i, end = w.over[lane], w.ends[w.over[lane]]
            for m in range(w.n_margins):
                end[end.shape[0] - w.n_margins + m] = w.margin[m, lane]
            # The lane waits at a start: beyond an end the rates may take a branch that all lanes would pay for.
            for m in range(w.n):
                w.y[m, lane] = w.y0[i, m]
            w.over[lane] = -1


@compiled
def _step(w: Any) -> None:
    """Try one step of every lane, and accept or reject each."""
    _choose_sizes(w)
    put(w.t_new, where(lanes(w.last) > 0.5, lanes(w.end), lanes(w.t) + lanes(w.h)))
    set_weights(w)
    w.try_step(w)
    propose_size(w)
    w.limit_size(w)
    good = (lanes(w.norm) < 1.0) & (lanes(w.busy) > 0.5)
    put(w.unclear, 0.0)
    if any_lane(good):
        w.find_stiff(w)
        put(w.defect_at, 1.0)
        close = may_cross(w, good)
        seen, shown = needs_checks(w, good), any_lane(lanes(w.next_output) < lanes(w.t_new))
        if seen or shown:
            w.interpolate(w, w.columns)
            w.put_matrices(w)
        elif any_lane(close):
            w.interpolate(w, w.n)
        if seen:
            prepare_checks(w)
            # One lane after another, at eight points at once: steps differ in the number of looks that they need.
            for lane in range(LANES):
                if w.spacings[lane] >= 0.0:
                    w.defect_at[lane] = first_defect(w, lane)
        if shown:
            w.check_outputs(w)
        find_crossings(w, good & (lanes(w.defect_at) == 1.0), close)
    # A usual step is accepted: it passes, and nothing happens in it.
    usual = (lanes(w.norm) < 1.0) & (lanes(w.defect_at) == 1.0) & (lanes(w.crossing) == 1.0) & (lanes(w.onto) < 0.5)
    usual = usual & ~(lanes(w.next_output) <= lanes(w.t_new)) & (lanes(w.again) < 0.5)
    put(w.taken, where(usual, lanes(w.busy), 0.0))
    for lane in range(LANES if _are_pending(w, ~usual) else 0):
        if w.pending[lane] > 0.5:
            _conclude(w, lane)
    _move_on(w)
    _continue_all(w)
    _write_margins(w)


@compiled
def run_through(w: Any, count: int) -> None:
    """Solve the runs of a batch. The result of a run depends neither on its neighbours nor on the threads."""
    w.loose = loosening(w.rtol)
    following = 0
    for lane in range(LANES):
        w.over[lane] = -1
        _leave(w, lane)
    while w.free < LANES or following < count:
        # Runs begin together, so that several share each evaluation at starts and ends.
        for lane in range(LANES if w.free >= FREE_LANES else 0):
            if w.run[lane] < 0 and following < count:
                _begin(w, lane, following)
                following += 1
        if any_lane(lanes(w.fresh) > 0.5):
            _start(w)
        if w.free < LANES:
            _step(w)


def loop_of(name: str, end_stage: int, power: float, memory: Mapping[str, Any], **parts: Any) -> Any:
    """Return the loop with the steps of a method.

    ``end_stage`` is the row of its rates at the end of a step, ``power`` that of its error from which the next size
    follows; the ``parts`` are the compiled functions in which methods differ, by the names by which the loop calls
    them.
    """
    method = {"end_stage": end_stage, "power": power, "least_root": LEAST_NORM**power, **parts}
    lay_out = laying_out(StepperRecord(name, SIZES, NUMBERS, memory, method))

    def run(count: int, table: int) -> None:
        run_through(lay_out(table), count)

    return run


run_explicitly = loop_of(
    "ExplicitLanes", END_STAGE, 0.125, EXPLICIT_MEMORY,
    root_of=root_of, try_step=try_step, limit_size=nothing, find_noise=find_noise, find_stiff=find_stiff,
    put_roughly=put_roughly, interpolate=interpolate, put_matrices=nothing, find_defects=find_defects,
    check_outputs=nothing, keep_step=nothing,
)  # fmt: skip
"""Solve the runs of a batch."""
