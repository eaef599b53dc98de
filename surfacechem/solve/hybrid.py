"""Runs of a system with edges: flow until one is due, carry it out, flow on.

Within an arc the modes are constant and any solver of the contract integrates; where the guard of an edge reaches zero
the arc ends, the instant carries out what is due, and the next arc starts from there.
"""

from __future__ import annotations

import time
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from surfacechem.model.system import START, System
from surfacechem.solve.arcs import Part, across_kink, changed, merged
from surfacechem.solve.bounces import ENDLESS, MANY, MISSED
from surfacechem.solve.contract import Problem, Result, Solver, Status
from surfacechem.solve.equilibria import Point
from surfacechem.solve.instant import BRIEF, REACHED, Instant
from surfacechem.solve.jumps import Jumper
from surfacechem.solve.roundoff import solve

Array = NDArray[np.float64]

LOST = (Status.STEP_UNDERFLOW, Status.SINGULAR, Status.NO_CONSISTENT_STATE)
"""Ways in which a solver ends where a quasi-static equilibrium is lost."""

RENEWALS = 4
"""Number of brief arcs that time could not resolve that may follow each other."""


class Hybrid:
    """One run of a system with edges."""

    def __init__(self, system: System, method: Solver, jumper: Jumper, problem: Problem, first: int) -> None:
        self.system, self.method, self.jumper, self.problem = system, method, jumper, problem
        self.instant = Instant(system, jumper, problem, first)
        self.parts: list[Part] = []
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
        reached = self.parts[-1].end if self.parts else float(problem.segments[0])
        end = max(reached, instant.jumps[-1].t) if instant.reason and instant.jumps else reached
        return merged(problem, self.parts, instant.status, end, instant.booked)

    def _segment(self, point: Point, end: float) -> Point | None:
        """From a point to the end of its load segment; None where the run ends before."""
        while point.t < end:
            started = self.instant.resolve(point)
            part = self._flow(started, end) if started is not None else None
            if started is None or part is None:
                return None
            point = Point(part.end, part.result.y, part.result.ydot, started.parameters)
            if part.status is Status.FINISHED:
                return point
            self._renewed = self._renewed + 1 if part.result.t < BRIEF * self.problem.segments[-1] else 0
            index = self._edge(part, point)
            if index is not None:
                jumped = self.instant.apply(index, self.jumper.equilibria.in_time(index, point, end), point)
                if jumped is None:
                    return None
                point = jumped
                continue
            across = across_kink(self.system.states, point) if part.status in LOST else None
            # What time could not resolve any more goes on in a time of its own.
            renews = part.status is Status.STEP_UNDERFLOW and part.result.t > 0 and self._renewed < RENEWALS
            if across is None and not renews:
                self.instant.status = part.status
                return None
            point = across or point
        return point

    def _flow(self, start: Point, end: float) -> Part | None:
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
        arc = changed(
            problem,
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
        result = solve(self.method, arc, self.system.sliding)
        reached, status = min(start.t + result.t, end), result.status
        if status is Status.FINISHED or (status in LOST and end - reached <= REACHED * end):
            # Where a gap closes at the very end, the last of its digits are rounding of the time.
            reached, status = end, Status.FINISHED
        part = Part(result, start, reached, status, times[: len(result.times)], instant.booked)
        self.parts.append(part)
        instant.booked = instant.booked + result.ledger
        instant.flowed = (start.t, result.t, reached)
        self.exchanged = np.maximum(self.exchanged, np.abs(instant.booked))
        self._steps += result.counters.steps
        self._written += len(result.times)
        instant.see(np.vstack((start.y, result.y, *(() if result.steps is None else (result.steps.y,)))))
        if instant.rebounds.missed(result):
            instant.status, instant.reason = Status.FAILED, MISSED
            return None
        return part

    def _edge(self, part: Part, point: Point) -> int | None:
        """The edge at which an arc has ended, if any."""
        if part.status is Status.EVENT:
            events, instant = part.result.events, self.instant
            fired = events.index[events.t == events.t[-1]]
            instant.limits = [int(i) for i in fired if i < instant.first and self.problem.margins[i].terminal]
            index = int(fired[-1]) - instant.first
            return index if index >= 0 else None
        return self.jumper.equilibria.lost(point, self.problem.rtol) if part.status in LOST else None

    @cached_property
    def _clock(self) -> int:
        """Column of the time at which an arc starts."""
        return next(j for j, p in enumerate(self.system.parameters) if p.path == START)
