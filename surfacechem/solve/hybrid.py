"""Runs of a system with edges: flow until one is due, carry it out, flow on.

Within an arc the modes are constant and any solver of the contract integrates; where the guard of an edge reaches zero
the arc ends, the instant carries out what is due, and the next arc starts from there.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from surfacechem.model.system import START, System
from surfacechem.solve.bounces import ENDLESS, MANY, MISSED
from surfacechem.solve.contract import Counters, Events, Points, Problem, Result, Solver, Status
from surfacechem.solve.equilibria import ATOM, Point
from surfacechem.solve.instant import BRIEF, REACHED, Instant
from surfacechem.solve.jumps import Jumper
from surfacechem.solve.roundoff import solve

Array = NDArray[np.float64]

LOST = (Status.STEP_UNDERFLOW, Status.SINGULAR, Status.NO_CONSISTENT_STATE)
"""Ways in which a solver ends where a quasi-static equilibrium is lost."""

RENEWALS = 4
"""Number of brief arcs that time could not resolve that may follow each other."""


@dataclass(frozen=True)
class Arc:
    """A flow between events as it was solved, in its own time and with its own ledger."""

    result: Result
    start: Point
    end: float
    """Time reached [s]."""
    status: Status
    times: Array
    """Output times reached [s]."""
    booked: Array
    """Ledger at its start."""


class Hybrid:
    """One run of a system with edges."""

    def __init__(self, system: System, method: Solver, jumper: Jumper, problem: Problem, first: int) -> None:
        self.system, self.method, self.jumper, self.problem = system, method, jumper, problem
        self.instant = Instant(system, jumper, problem, first)
        self.arcs: list[Arc] = []
        self.exchanged = np.zeros(problem.program.n_ledger)
        self.deadline = None if problem.max_seconds is None else time.monotonic() + problem.max_seconds
        self._steps = self._written = 0
        """Steps taken and outputs written."""
        self._renewed = 0
        """Number of brief arcs in a row that time could not resolve."""

    def run(self) -> Result:
        """The whole run as one result; the instant holds its jumps, and why it ended where one of them ended it."""
        problem, instant, columns = self.problem, self.instant, self.jumper.mode_columns
        ended, y, modes = None, problem.y0, problem.parameters[0, columns]
        for start, end, row in zip(problem.segments, problem.segments[1:], problem.parameters, strict=False):
            parameters = row.copy()
            parameters[columns] = modes
            begun = instant.begin(Point(float(start), y, np.zeros(len(y)), parameters), ended)
            ended = self._segment(begun, float(end)) if begun is not None else None
            if ended is None:
                break
            y, modes = ended.y, ended.parameters[columns]
        if instant.status is Status.MAX_STEPS and instant.rebounds.count > MANY:
            instant.status, instant.reason = Status.FAILED, ENDLESS
        reached = self.arcs[-1].end if self.arcs else float(problem.segments[0])
        end = max(reached, instant.jumps[-1].t) if instant.reason and instant.jumps else reached
        if not self.arcs:
            return unbegun(problem, instant.status, end, instant.booked)
        return merged(problem, self.arcs, instant.status, end, instant.booked)

    def _segment(self, point: Point, end: float) -> Point | None:
        """From a point to the end of its load segment; None where the run ends before."""
        while point.t < end:
            started = self.instant.resolve(point)
            arc = self._flow(started, end) if started is not None else None
            if started is None or arc is None:
                return None
            point = Point(arc.end, arc.result.y, arc.result.ydot, started.parameters)
            if arc.status is Status.FINISHED:
                return point
            self._renewed = self._renewed + 1 if arc.result.t < BRIEF * self.problem.segments[-1] else 0
            index = self._edge(arc, point)
            if index is not None:
                jumped = self.instant.apply(index, self.jumper.equilibria.in_time(index, point, end), point)
                if jumped is None:
                    return None
                point = jumped
                continue
            across = self._across_touch(point) if arc.status in LOST else None
            # What time could not resolve any more goes on in a time of its own.
            renews = arc.status is Status.STEP_UNDERFLOW and arc.result.t > 0 and self._renewed < RENEWALS
            if across is None and not renews:
                self.instant.status = arc.status
                return None
            point = across or point
        return point

    def _flow(self, start: Point, end: float) -> Arc | None:
        """Integrate until an edge, a limit or the end of the segment; None where the run ends before or without it."""
        problem, instant = self.problem, self.instant
        seconds = None if self.deadline is None else self.deadline - time.monotonic()
        if self._steps >= problem.max_steps or (seconds is not None and seconds <= 0):
            instant.status = Status.MAX_STEPS if self._steps >= problem.max_steps else Status.STOPPED
            return None
        times = problem.times[self._written : int(np.searchsorted(problem.times, end, side="right"))]
        local = start.parameters.copy()
        local[self._clock] = start.t
        local[self.system.origins] -= start.t
        segments = instant.rebounds.pieces(start.t, end)
        problem = problem.changed(
            y0=start.y,
            times=np.clip(times - start.t, 0.0, end - start.t),
            segments=segments,
            parameters=np.repeat(local[None], len(segments) - 1, axis=0),
            max_steps=problem.max_steps - self._steps,
            max_seconds=seconds,
            exchanged=self.exchanged,
            goes_on=end < problem.segments[-1],
            seen=instant.rebounds.seen(start.t, instant.sizes(start)),
            in_play=self.system.in_play(local),
        )
        result = solve(self.method, problem, self.system.sliding)
        reached, status = min(start.t + result.t, end), result.status
        if status is Status.FINISHED or (status in LOST and end - reached <= REACHED * end):
            # Where a gap closes at the very end, the last of its digits are rounding of the time.
            reached, status = end, Status.FINISHED
        arc = Arc(result, start, reached, status, times[: len(result.times)], instant.booked)
        self.arcs.append(arc)
        instant.booked = instant.booked + result.ledger
        instant.flowed = (start.t, result.t, reached)
        self.exchanged = np.maximum(self.exchanged, np.abs(instant.booked))
        self._steps += result.counters.steps
        self._written += len(result.times)
        instant.see(np.vstack((start.y, result.y, *(() if result.steps is None else (result.steps.y,)))))
        if instant.rebounds.missed(result):
            instant.status, instant.reason = Status.FAILED, MISSED
            return None
        return arc

    def _edge(self, arc: Arc, point: Point) -> int | None:
        """The edge at which an arc has ended, if any."""
        if arc.status is Status.EVENT:
            events, instant = arc.result.events, self.instant
            fired = events.index[events.t == events.t[-1]]
            instant.limits = [int(i) for i in fired if i < instant.first and self.problem.margins[i].terminal]
            index = int(fired[-1]) - instant.first
            return index if index >= 0 else None
        return self.jumper.equilibria.lost(point, self.problem.rtol) if arc.status in LOST else None

    def _across_touch(self, point: Point) -> Point | None:
        """The point on the other side of a gap of zero, where stiffness may jump and Newton's method stalls."""
        gaps = np.array([state.quantity.unit == "m" for state in self.system.states])
        closing = gaps & (np.abs(point.y) < ATOM) & (point.y * point.ydot < 0)
        return replace(point, y=np.where(closing, -point.y, point.y)) if closing.any() else None

    @cached_property
    def _clock(self) -> int:
        """Column of the time at which an arc starts."""
        return next(j for j, p in enumerate(self.system.parameters) if p.path == START)


def unbegun(problem: Problem, status: Status, end: float, ledger: Array) -> Result:
    """The result of a run that ended with a jump at its start."""
    n, q, none = problem.program.n, problem.program.n_ledger, np.zeros(0)
    states, lines = np.empty((0, n)), np.empty((0, q))
    events = Events(none, states, states, lines, index=np.empty(0, np.int64))
    begun = (problem.y0, np.zeros(n), ledger)
    return Result(problem, status, end, *begun, none, none, states, lines, events, Counters(), stepping=0.0)


def merged(problem: Problem, arcs: Sequence[Arc], status: Status, end: float, ledger: Array) -> Result:
    """The arcs as one result, which ends at this time with this ledger."""
    last = arcs[-1].result
    happened = [(arc, arc.result.events, np.ones(len(arc.result.events.t), bool)) for arc in arcs]
    return Result(
        problem=problem.changed(
            segments=np.array([*(arc.start.t for arc in arcs), problem.segments[-1]]),
            parameters=np.array([arc.start.parameters for arc in arcs]),
        ),
        status=status,
        t=end,
        y=last.y,
        ydot=last.ydot,
        ledger=ledger,
        margins=last.margins,
        times=np.concatenate([arc.times for arc in arcs]),
        outputs=np.concatenate([arc.result.outputs for arc in arcs]),
        ledger_outputs=np.concatenate([arc.result.ledger_outputs + arc.booked for arc in arcs]),
        events=Events(*_rows(happened), index=np.concatenate([arc.result.events.index for arc in arcs])),
        counters=Counters(*map(sum, zip(*(arc.result.counters for arc in arcs), strict=True))),
        steps=_steps(arcs) if problem.record_steps else None,
        stepping=sum(arc.result.stepping for arc in arcs),
        segment=np.repeat(np.arange(len(arcs)), [len(arc.times) for arc in arcs]),
    )


def _steps(arcs: Sequence[Arc]) -> Points:
    """The steps of all arcs; the start of one, and what time cannot tell from it, is the event that ends the last."""
    taken = [(arc, arc.result.steps) for arc in arcs if arc.result.steps is not None]
    kept = [(arc, steps, (arc.start.t + steps.t > arc.start.t) | (arc is arcs[0])) for arc, steps in taken]
    counts = [int(keep.sum()) for _, _, keep in kept]
    return Points(*_rows(kept), segment=np.repeat(np.arange(len(counts)), counts))


def _rows(found: Sequence[tuple[Arc, Points, NDArray[np.bool_]]]) -> tuple[Array, Array, Array, Array]:
    """Times, states, rates and ledgers of the points that are kept of each arc, in the time and ledger of the run."""
    return (
        np.concatenate([arc.start.t + points.t[keep] for arc, points, keep in found]),
        np.concatenate([points.y[keep] for _, points, keep in found]),
        np.concatenate([points.ydot[keep] for _, points, keep in found]),
        np.concatenate([arc.booked + points.ledger[keep] for arc, points, keep in found]),
    )
