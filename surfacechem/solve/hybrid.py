"""Hybrid runs of a system with edges: integrate until an edge is due, carry it out, go on.

Within an arc the modes are constant and any solver of the contract integrates. Where the guard of an edge reaches zero
the arc ends, Instant carries out the edges that are due, and the next arc starts from there.

A run does not call a solver: it is a generator that yields problems and receives their results, so that the arcs of
many runs are solved in one compiled batch.
"""

from __future__ import annotations

import time
from collections.abc import Generator, Sequence
from dataclasses import replace
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from surfacechem.model.system import START
from surfacechem.quantities import GAPS
from surfacechem.solve.contract import Array, Counters, Events, Index, Points, Problem, Result, Solver, States, Status
from surfacechem.solve.equilibria import Point
from surfacechem.solve.instant import ENDLESS, MANY_REBOUNDS, MISSED_CLOSING, SAME_MOMENT, Instant
from surfacechem.solve.jumps import Jump, Jumper
from surfacechem.solve.radau.solver import consistent
from surfacechem.tolerances import BRIEF_PART, FEW_EPS, FORMULA_EPS, GAP_EPS, ULPS

Found = TypeVar("Found")
Flow = Generator[Problem, Result, Found]
"""Generator that yields one problem after another and receives the results."""

LOST_STATUSES = (Status.STEP_UNDERFLOW, Status.SINGULAR, Status.NO_CONSISTENT_STATE)
"""Ends of a solver that may mean the loss of a quasi-static equilibrium."""

MOST_BRIEF_ARCS = 4
"""Most consecutive brief arcs after a step size underflow."""

ROUNDINGS, MOST_RAISES = 100.0, 3
"""Raised absolute tolerance of a sliding velocity in units of its roundoff, and the number of raises."""


def solve_together(flows: Sequence[Flow[Found]], method: Solver, threads: int = 1) -> list[Found]:
    """Run flows to their ends and return their values; problems yielded at the same time are solved in one batch."""
    found: dict[int, Found] = {}
    results: dict[int, Any] = dict.fromkeys(range(len(flows)))
    while results:
        problems = {}
        for i, result in results.items():
            try:
                problems[i] = flows[i].send(result)
            except StopIteration as ended:
                found[i] = ended.value
        solved = method.solve_all(list(problems.values()), threads) if problems else []
        results = dict(zip(problems, solved, strict=True))
    return [found[i] for i in range(len(flows))]


def without_stall(problem: Problem, velocities: NDArray[np.bool_]) -> Flow[Result]:
    """Solve a problem; ``velocities`` marks the algebraic states that follow from tractions.

    Near zero such a velocity is roundoff: the difference of large tractions, divided by a resistance. If the step size
    underflows there, the absolute tolerance of the velocity is raised to this roundoff.
    """
    result = yield problem
    for _ in range(MOST_RAISES if velocities.any() else 0):
        if result.status is not Status.STEP_UNDERFLOW:
            break
        atol = np.where(velocities, np.maximum(problem.atol, ROUNDINGS * rounding(result)), problem.atol)
        if not np.all(np.isfinite(atol)) or np.all(atol == problem.atol):
            break
        problem = replace(problem, atol=atol)
        result = yield problem
    return result


def rounding(result: Result) -> Array:
    """Return the uncertainty of each unknown at the end of a run from roundoff of its equation, shape (states,)."""
    problem, n = result.problem, len(result.y)
    # What stalls at a breakpoint does so in the segment that begins there.
    parameters = problem.parameters[np.searchsorted(problem.segments[1:-1], result.t, side="right")]
    inputs = np.concatenate(([result.t], result.y, result.ydot, parameters))
    both = problem.program.derivatives(problem.program.filled(inputs))
    terms = np.abs(both[0] * result.y).sum(axis=1) + np.abs(both[1] * result.ydot).sum(axis=1)
    matrix = np.where(problem.program.algebraic_mask, both[0], both[1])
    try:
        found: Array = np.abs(np.linalg.inv(matrix)) @ (ULPS * terms)
    except np.linalg.LinAlgError:
        return np.zeros(n)
    return found


class Arc(NamedTuple):
    """A solved flow between events, with its time and ledger counted from its start."""

    result: Result
    start: Point
    end: float
    """Time reached [s]."""
    status: Status
    ledger: Array
    """Ledger at its start."""


class Hybrid:
    """One run of a system with edges."""

    def __init__(self, jumper: Jumper, problem: Problem) -> None:
        self.system, self.jumper, self.problem = jumper.system, jumper, problem
        self.instant = Instant(jumper, problem)
        self.arcs: list[Arc] = []
        self.outputs: list[States] = []
        """Outputs in the time and ledger of the run, with the arcs as segments."""
        self.exchanged = np.zeros(problem.program.n_ledger)
        self.extremes = np.array([problem.y0, problem.y0])
        self.deadline = None if problem.max_seconds is None else time.monotonic() + problem.max_seconds
        self._steps = self._outputs_written = 0
        """Steps taken and outputs written."""
        self._gaps = np.array([state.name in GAPS for state in self.system.states])
        """Mask of the states that are gaps."""
        self._start = self.system.parameter_columns[START]
        """Column of the time at which an arc starts."""
        self._brief_arcs = 0
        """Number of consecutive brief arcs after a step size underflow."""

    def run(self) -> Flow[Result]:
        """Run to the end and return one result; ``instant`` holds the jumps, and the reason if a jump ended the run."""
        problem, instant, columns = self.problem, self.instant, self.jumper.mode_columns
        last, y, modes = None, problem.y0, problem.parameters[0, columns]
        for start, end, row in zip(problem.segments, problem.segments[1:], problem.parameters, strict=False):
            parameters = row.copy()
            parameters[columns] = modes
            point = instant.begin(Point(float(start), y, np.zeros(len(y)), parameters), last)
            while point is not None and point.t < end:
                point = instant.resolve(point)
                arc = (yield from self._flow(point, float(end))) if point is not None else None
                point = self._next_start(arc, float(end)) if arc is not None else None
            if point is None:
                break
            last, y, modes = point, point.y, point.parameters[columns]
        if instant.status is Status.MAX_STEPS and instant.rebounds.count > MANY_REBOUNDS:
            instant.status, instant.reason = Status.FAILED, ENDLESS
        reached = self.arcs[-1].end if self.arcs else float(problem.segments[0])
        # A jump may lie beyond the last arc, at the time of a fold.
        t = max(reached, instant.jumps[-1].t) if instant.reason and instant.jumps else reached
        return self._joined(t) if self.arcs else ended_at_start(problem, instant.status, t, instant.ledger)

    def _next_start(self, arc: Arc, end: float) -> Point | None:
        """Return the point from which a run goes on after an arc; None if the run ends with it."""
        point = Point(arc.end, arc.result.y, arc.result.ydot, arc.start.parameters)
        if arc.status is Status.FINISHED:
            return point
        self._brief_arcs = self._brief_arcs + 1 if arc.result.t < BRIEF_PART * self.problem.segments[-1] else 0
        index, lost = -1, arc.status in LOST_STATUSES
        if arc.status is Status.EVENT:
            events, instant = arc.result.events, self.instant
            fired = events.index[events.t == events.t[-1]]
            instant.limits = [int(i) for i in fired if i < instant.first and self.problem.margins[i].terminal]
            index = int(fired[-1]) - instant.first
            if index >= 0 and index not in self.jumper.folds.items:  # the time of a fold follows from the loads
                point = instant.on_tick(index, point, end)
        elif lost:
            index = self.jumper.folds.reached(point, self.problem.rtol)
        if index >= 0:
            reached = self.jumper.folds.in_time(index, point, end)
            self._complete_outputs(reached, end)
            return self.instant.apply(index, reached, point)
        beyond = self._beyond(arc, point) if lost and not self._is_limited(arc) else None
        if beyond is None:
            self.instant.status = arc.status
        return beyond

    def _complete_outputs(self, reached: Point, end: float) -> None:
        """Give outputs between the end of the integration and a fold the state of the fold.

        If ``end`` cannot be told from the event in time, its output is included, since no arc may follow.
        """
        times = self.problem.times[self._outputs_written :]
        times = times[times <= reached.t] if reached.t >= end else times[times < reached.t]
        count = len(times), 1
        self._write(times, np.tile(reached.y, count), np.tile(self.instant.ledger, count))

    def _write(self, times: Array, y: Array, ledger: Array) -> None:
        """Add outputs of the last arc."""
        self.outputs.append(States(times, y, ledger, np.full(len(times), len(self.arcs) - 1)))
        self._outputs_written += len(times)

    def _beyond(self, arc: Arc, point: Point) -> Point | None:
        """Return the point from which a run may go on after a solver has failed; None if there is none."""
        # At zero gap the stiffness may jump and Newton's method stall: go on from the mirrored point.
        closing = self._gaps & (np.abs(point.y) < GAP_EPS) & (point.y * point.ydot < 0)
        if closing.any():
            return point._replace(y=np.where(closing, -point.y, point.y))
        # After an underflow go on with the time counted from here, which is resolved more finely.
        unresolved = arc.status is Status.STEP_UNDERFLOW and arc.result.t > 0 and self._brief_arcs < MOST_BRIEF_ARCS
        return point if unresolved else None

    def _is_limited(self, arc: Arc) -> bool:
        """True if a limit is zero, up to roundoff, at the end of an arc."""
        count, guards = min(self.instant.first, len(arc.result.margins)), self.problem.program.margins
        if not count or guards is None:
            return False
        limits = np.array([m.terminal and not m.strict for m in self.problem.margins[:count]], dtype=bool)
        zero = np.abs(arc.result.margins[:count]) <= FORMULA_EPS * np.abs(guards(arc.start.inputs())[:count])
        return bool(np.any(limits & zero & self.instant.active_guards(arc.start)[:count]))

    def _arc_end(self, start: float, end: float) -> float:
        """Return the end of an arc: just before a breakpoint without a change of loads.

        Formulas at the breakpoint are those of the next segment.
        """
        row = int(np.searchsorted(self.problem.segments, end))
        parameters = self.problem.parameters
        if row >= len(parameters) or not np.array_equal(parameters[row - 1], parameters[row]):
            return end
        return max(end - FEW_EPS * end, 0.5 * (start + end))

    def _flow(self, start: Point, end: float) -> Flow[Arc | None]:
        """Integrate until an edge, a limit or the end of the segment; None if the run ends before or without it."""
        problem, instant = self.problem, self.instant
        seconds = None if self.deadline is None else self.deadline - time.monotonic()
        if self._steps >= problem.max_steps or (seconds is not None and seconds <= 0):
            instant.status = Status.MAX_STEPS if self._steps >= problem.max_steps else Status.STOPPED
            return None
        times = problem.times[self._outputs_written : int(np.searchsorted(problem.times, end, side="right"))]
        local = start.parameters.copy()
        local[self._start] = start.t
        local[self.system.origins] -= start.t
        segments = instant.rebounds.segments(start.t, self._arc_end(start.t, end))
        problem = replace(
            problem,
            y0=start.y,
            times=np.minimum(np.maximum(times - start.t, 0.0), segments[-1]),
            segments=segments,
            parameters=np.repeat(local[None], len(segments) - 1, axis=0),
            max_steps=problem.max_steps - self._steps,
            max_seconds=seconds,
            exchanged=self.exchanged,
            continued=end < problem.segments[-1],
            margin_peaks=instant.rebounds.margin_peaks(start.t, instant.sizes(start)),
            active=self.system.active_guards(local),
            extremes=self.extremes,
            elapsed=start.t,
        )
        result = yield from without_stall(problem, self.system.slip_velocities)
        reached, status = min(start.t + result.t, end), result.status
        if status is Status.FINISHED or (status in LOST_STATUSES and end - reached <= SAME_MOMENT * end):
            # Where a gap closes at the very end, the remaining time is roundoff.
            reached, status = end, Status.FINISHED
        arc = Arc(result, start, reached, status, instant.ledger)
        self.arcs.append(arc)
        self._write(times[: len(result.times)], result.outputs, instant.ledger + result.ledger_outputs)
        instant.ledger = instant.ledger + result.ledger
        instant.last_flow = (start.t, result.t, reached)
        self.exchanged = np.maximum(self.exchanged, np.abs(instant.ledger))
        self._steps += result.counters.steps
        seen = np.vstack((start.y, result.y, *(() if result.steps is None else (result.steps.y,))))
        least, largest = self.extremes
        self.extremes = np.array([np.minimum(least, seen.min(axis=0)), np.maximum(largest, seen.max(axis=0))])
        instant.update_peaks(seen)
        if instant.rebounds.passed_guard(result):
            instant.status, instant.reason = Status.FAILED, MISSED_CLOSING
            return None
        return arc

    def _joined(self, end: float) -> Result:
        """Join the arcs to one result that ends at this time."""
        arcs, instant, problem, last = self.arcs, self.instant, self.problem, self.arcs[-1].result
        segments = np.array([*(arc.start.t for arc in arcs), problem.segments[-1]])
        problem = replace(problem, segments=segments, parameters=np.array([arc.start.parameters for arc in arcs]))
        outputs = States(*map(np.concatenate, zip(*self.outputs, strict=True)))
        *events, _ = _points(arcs, [arc.result.events for arc in arcs])
        steps = known = None
        if problem.record_steps:
            t, y, ydot, ledger, number = _points(arcs, [arc.result.steps for arc in arcs])
            # The start of an arc, and a step too short to change the time, repeat the event that ended the last arc.
            kept = (t > segments[number]) | (number == 0)
            steps = Points(t[kept], y[kept], ydot[kept], ledger[kept], segment=number[kept])
            if problem.line_error:
                inside = [
                    States(arc.start.t + rows.t, rows.y, arc.ledger + rows.ledger, np.full(len(rows.t), k))
                    for k, arc in enumerate(arcs)
                    if (rows := arc.result.inside) is not None
                ]
                parts = outputs, States(t, y, ledger, number), *inside
                known = known_states(parts, np.array([arc.end for arc in arcs]))
        return Result(
            problem=problem,
            status=instant.status,
            t=end,
            y=last.y,
            ydot=last.ydot,
            ledger=instant.ledger,
            margins=last.margins,
            times=outputs.t,
            outputs=outputs.y,
            ledger_outputs=outputs.ledger,
            events=Events(*events, index=np.concatenate([arc.result.events.index for arc in arcs])),
            counters=Counters(*map(sum, zip(*(arc.result.counters for arc in arcs), strict=True))),
            steps=steps,
            stepping=sum((arc.result.stepping for arc in arcs), 0.0),
            segment=outputs.segment,
            known=known,
        )


def _points(arcs: Sequence[Arc], parts: Sequence[Points | None]) -> tuple[Array, Array, Array, Array, Index]:
    """Return times, states, rates and ledgers of points of the arcs, in the time and ledger of the run, and the number
    of the arc of each.
    """
    rows = [
        (arc.start.t + part.t, part.y, part.ydot, arc.ledger + part.ledger, np.full(len(part.t), k))
        for k, (arc, part) in enumerate(zip(arcs, parts, strict=True))
        if part is not None
    ]
    t, y, ydot, ledger, number = map(np.concatenate, zip(*rows, strict=True))
    return t, y, ydot, ledger, number


def known_states(parts: Sequence[States], ends: Array) -> States:
    """Return all states of arcs that end at these times, in order of time, of those at one moment of an arc the first:
    outputs, at exactly the requested times, which may lie behind the last step before a fold, come before others.
    """
    outputs, *others = parts
    within = [rows._replace(t=np.minimum(rows.t, ends[rows.segment])) for rows in others]
    return States(*map(np.concatenate, zip(outputs, *within, strict=True))).in_order()


def carried(problem: Problem, jumper: Jumper) -> Flow[tuple[Result, list[Jump], str] | None]:
    """Run with the compiled loop carrying out the edges; return result, jumps, and the reason if a jump ended it.

    None if the loop leaves the run to :class:`Hybrid`.
    """
    result = yield replace(problem, edges=jumper.edge_tables)
    if result.status is Status.LEFT and jumper.expect_jumps():
        result = yield replace(problem, edges=jumper.edge_tables)
    if result.course is None or result.status in (Status.LEFT, *LOST_STATUSES):
        return None
    start, end = problem.segments[[0, -1]].tolist()
    jumps = jumper.carried_out(*result.course, start, end)
    result = with_arc_segments(problem, result)
    if result.status is Status.MAX_STEPS and sum(jump.edge.return_time is not None for jump in jumps) > MANY_REBOUNDS:
        return result._replace(status=Status.FAILED), jumps, ENDLESS
    return result, jumps, ""


def with_arc_segments(problem: Problem, result: Result) -> Result:
    """Return a result of the compiled loop with its arcs as segments."""
    assert result.course is not None
    arcs = result.course.arcs
    if len(arcs) == 1 and not len(result.course.jumps):
        return result._replace(problem=problem)
    problem = replace(problem, segments=np.append(arcs[:, 0], problem.segments[-1]), parameters=arcs[:, 5:])

    def segments(column: int, count: int) -> Index:
        """Return the arc of each of this number of points."""
        return np.repeat(np.arange(len(arcs)), np.diff(arcs[:, column], append=count).astype(np.int64))

    outputs = States(result.times, result.outputs, result.ledger_outputs, segments(3, len(result.times)))
    steps, inside, known = result.steps, result.inside, None
    if steps is not None:
        steps = replace(steps, segment=segments(2, len(steps.t)))
    if inside is not None and steps is not None:
        inside = inside._replace(segment=segments(4, len(inside.t)))
        parts = outputs, States(steps.t, steps.y, steps.ledger, steps.segment), inside
        known = known_states(parts, np.append(arcs[1:, 0], result.t))
    return result._replace(problem=problem, segment=outputs.segment, steps=steps, inside=None, known=known)


def ended_at_start(problem: Problem, status: Status, end: float, ledger: Array) -> Result:
    """Return the result of a run that ended with a jump at its start."""
    n, q, none = problem.program.n, problem.program.n_ledger, np.zeros(0)
    states, lines = np.empty((0, n)), np.empty((0, q))
    events = Events(none, states, states, lines, index=np.empty(0, np.int64))
    begun = (problem.y0, np.zeros(n), ledger)
    return Result(problem, status, end, *begun, none, none, states, lines, events, Counters(), stepping=0.0)


def with_start(problem: Problem, result: Result) -> Result:
    """Add the initial state as output to a result without outputs, if the equations hold there.

    It is the state before any jump.
    """
    if len(result.times) or not len(problem.times) or result.t > problem.times[0]:
        return result
    at, y, parameters = problem.times[:1], problem.y0, problem.parameters[0]
    start = consistent(problem.program, float(at[0]), y, np.zeros_like(y), parameters)
    if not start.valid:
        return result
    ledger = np.zeros((1, problem.program.n_ledger))
    shown = result._replace(problem=problem, times=at, outputs=start.y[None], ledger_outputs=ledger)
    return shown._replace(segment=None, inside=None, known=None)
