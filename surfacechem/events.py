"""Runs of a system with transitions: stretches between events, and the jumps at them.

Within a stretch the modes are constant and any solver of the contract integrates; where a margin of a transition
reaches zero the stretch ends, the jump is made, and the next one starts from there.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from surfacechem.jumps import Jump, Jumper, Point
from surfacechem.solvers.contract import Counters, Events, Points, Problem, Result, Solver, Status
from surfacechem.solvers.radau import consistent
from surfacechem.system import START, System

Array = NDArray[np.float64]

NOISE = 1e-13
"""Margins below this part of the largest seen count as zero."""

PROBE = 1e-9
"""Part of a stretch over which a margin at zero is followed to see which way it goes."""

LOST = (Status.STEP_UNDERFLOW, Status.SINGULAR, Status.NO_CONSISTENT_STATE)
"""Ways in which a solver ends where a quasi-static equilibrium is lost."""

AT_ONCE = 100
"""Transitions at one moment above which they are chatter."""


@dataclass
class Hybrid:
    """What a run of a system with transitions needs and has produced so far."""

    system: System
    method: Solver
    jumper: Jumper
    problem: Problem
    first: int
    """Index of the first transition among the margins of the problem."""
    deadline: float | None = None
    parts: list[Result] = field(default_factory=list)
    jumps: list[Jump] = field(default_factory=list)
    largest: Array = field(default_factory=lambda: np.zeros(0))
    booked: Array = field(default_factory=lambda: np.zeros(0))
    """Ledger at the start of the present stretch."""
    lasted: float = 0.0
    """Length of the last stretch [s]."""
    status: Status = Status.FINISHED
    reason: str = ""

    @cached_property
    def clock(self) -> int:
        """Column of the time at which a stretch starts."""
        return next(j for j, p in enumerate(self.system.parameters) if p.path == START)

    def run(self) -> Result:
        """The whole run as one result."""
        problem = self.problem
        self.largest = np.zeros(len(problem.margins))
        self.booked = np.zeros(problem.program.n_ledger)
        if problem.max_seconds is not None:
            self.deadline = time.monotonic() + problem.max_seconds
        y, modes = problem.y0, problem.parameters[0, self.jumper.mode_columns]
        for start, end, row in zip(problem.segments, problem.segments[1:], problem.parameters, strict=False):
            parameters = row.copy()
            parameters[self.jumper.mode_columns] = modes
            point = self._segment(Point(float(start), y, np.zeros(len(y)), parameters), float(end))
            if point is None:
                break
            y, modes = point.y, point.parameters[self.jumper.mode_columns]
        return self._merged()

    def _segment(self, point: Point, end: float) -> Point | None:
        """From a point to the end of its segment; None where the run ends before."""
        while point.t < end:
            started = self._settled(point, end)
            if started is None:
                return None
            result = self._stretch(started, end)
            if result is None:
                return None
            point = Point(result.t, result.y, result.ydot, started.parameters)
            if result.status is Status.FINISHED:
                return point
            index = self._transition(result, point)
            if index is None:
                self.status = result.status
                return None
            jumped = self._jump(index, point)
            if jumped is None:
                return None
            point = jumped
        return point

    def _stretch(self, start: Point, end: float) -> Result | None:
        problem, used = self.problem, sum(part.counters.steps for part in self.parts)
        seconds = None if self.deadline is None else self.deadline - time.monotonic()
        if used >= problem.max_steps or (seconds is not None and seconds <= 0):
            self.status = Status.MAX_STEPS if used >= problem.max_steps else Status.STOPPED
            return None
        reached = self.parts[-1].t if self.parts else -np.inf
        times = problem.times[(problem.times > reached) & (problem.times <= end)]
        local = start.parameters.copy()
        local[self.clock] = start.t
        part = replace(
            problem,
            y0=start.y,
            times=np.minimum(times - start.t, end - start.t),
            segments=np.array([0.0, end - start.t]),
            parameters=local[None],
            max_steps=problem.max_steps - used,
            max_seconds=seconds,
        )
        result = self.method.solve(part)
        self._absolute(result, start, times, end)
        if result.t > start.t:  # else its length is below the rounding of time
            self.parts.append(result)
        if len(result.margins):
            self.largest = np.maximum(self.largest, np.abs(result.margins))
        return result

    def _absolute(self, result: Result, start: Point, times: Array, end: float) -> None:
        """Times and ledger of a stretch as those of the whole run."""
        result.problem = replace(
            result.problem,
            times=times,
            segments=np.array([start.t, end]),
            parameters=start.parameters[None],
        )
        self.lasted = result.t
        result.t = end if result.status is Status.FINISHED else min(start.t + result.t, end)
        result.times = times[: len(result.times)]
        result.ledger = result.ledger + self.booked
        result.ledger_outputs = result.ledger_outputs + self.booked
        result.events = replace(result.events, t=result.events.t + start.t, ledger=result.events.ledger + self.booked)
        if result.steps is not None:
            result.steps = replace(result.steps, t=result.steps.t + start.t, ledger=result.steps.ledger + self.booked)
        self.booked = result.ledger

    def _transition(self, result: Result, point: Point) -> int | None:
        """The transition at which a stretch has ended, if any."""
        if result.status is Status.EVENT:
            index = int(result.events.index[-1]) - self.first
            return index if index >= 0 else None
        return self.jumper.lost_equilibrium(point, self.problem.rtol) if result.status in LOST else None

    # -- what happens at one moment -------------------------------------------------------------------------------

    def _settled(self, point: Point, end: float) -> Point | None:
        """The point after all transitions that are due at its own time."""
        for _ in range(AT_ONCE):
            due = self._due(point, end)
            if due is None:
                return point
            jumped = self._jump(due, point)
            if jumped is None:
                return None
            point = jumped
        self.status, self.reason = (
            Status.FAILED,
            f"transitions follow each other without end (chatter): {self.jumps[-1].transition.reason}",
        )
        return None

    def _due(self, point: Point, end: float) -> int | None:
        """The transition whose margin is closed, or is zero and closing."""
        now = self._margins(point)
        self.largest = np.maximum(self.largest, np.abs(now))
        small = NOISE * self.largest
        closed = now < -small
        if np.any(np.abs(now) <= small):
            later = self._margins(self._later(point, PROBE * (end - point.t)))
            closed |= (np.abs(now) <= small) & (later < now - small)
        due = np.nonzero(closed[self.first :])[0]
        return int(due[0]) if len(due) else None

    def _consistent(self, point: Point) -> Point:
        found = consistent(self.problem.program, point.t, point.y, np.zeros_like(point.y), point.parameters)
        return Point(point.t, found.y, found.ydot, point.parameters)

    def _later(self, point: Point, dt: float) -> Point:
        now = self._consistent(point)
        return self._consistent(Point(point.t + dt, now.y + dt * now.ydot, now.ydot, point.parameters))

    def _margins(self, point: Point) -> Array:
        margins = self.problem.program.margins
        assert margins is not None
        return margins(self._consistent(point).inputs())

    def _jump(self, index: int, point: Point) -> Point | None:
        """Carry out a transition and book it; None where the run ends with it."""
        jump = replace(self.jumper.make(index, point), since=self.lasted)
        self.lasted = 0.0
        self.jumps.append(jump)
        if jump.stops:
            self.status, self.reason = (
                Status.EVENT,
                f"{jump.transition.reason}, which is {jump.verdict}"
                if jump.verdict == "impossible"
                else f"{jump.transition.reason}, which {jump.verdict}",
            )
            return None
        self.booked = self.booked + np.array(
            [self._booking(account.law, account.kind, account.quantity.name, jump) for account in self.system.ledger]
        )
        return jump.after

    def _booking(self, law: str, kind: str, name: str, jump: Jump) -> float:
        """What a jump adds to an account of the ledger."""
        if kind == "bonds":
            j = self.jumper.states.index(law)
            return float(jump.after.y[j] - jump.before.y[j])
        if law != "events":
            return 0.0
        amounts = {
            "dissipation": jump.released,
            "entropy production": jump.entropy,
            "energy supply": -jump.heat_out,
            "entropy supply": -jump.entropy_out,
        }
        return amounts[kind]

    # -- one result -----------------------------------------------------------------------------------------------

    def _merged(self) -> Result:
        parts, problem = self.parts, self.problem
        last = parts[-1] if parts else None
        starts = [part.problem.segments[0] for part in parts]
        merged = replace(
            problem,
            segments=np.array([*starts, problem.segments[-1]]) if parts else problem.segments,
            parameters=np.concatenate([part.problem.parameters for part in parts]) if parts else problem.parameters,
        )
        n, q = problem.program.n, problem.program.n_ledger
        return Result(
            problem=merged,
            status=self.status,
            t=self.jumps[-1].t if self.reason and self.jumps else (last.t if last else float(problem.segments[0])),
            y=last.y if last else problem.y0,
            ydot=last.ydot if last else np.zeros(n),
            ledger=self.booked,
            margins=last.margins if last else np.zeros(0),
            times=_joined([part.times for part in parts], 0),
            outputs=_joined([part.outputs for part in parts], n),
            ledger_outputs=_joined([part.ledger_outputs for part in parts], q),
            events=_events(parts, n, q),
            counters=Counters(*(int(sum(c)) for c in zip(*(part.counters for part in parts), strict=True)))
            if parts
            else Counters(),
            steps=_steps(parts) if problem.record_steps and parts else None,
        )


def _joined(blocks: Sequence[Array], width: int) -> Array:
    if blocks:
        return np.concatenate(blocks)
    return np.empty((0, width)) if width else np.empty(0)


def _events(parts: Sequence[Result], n: int, q: int) -> Events:
    found = [part.events for part in parts]
    columns = [
        _joined([getattr(e, name) for e in found], width)
        for name, width in (("t", 0), ("y", n), ("ydot", n), ("ledger", q))
    ]
    index = np.concatenate([e.index for e in found]) if found else np.empty(0, np.int64)
    return Events(*columns, index=index)


def _steps(parts: Sequence[Result]) -> Points:
    """All steps; the start of a stretch, which is the end of the one before in other modes, only once."""
    rows = [part.steps for part in parts if part.steps is not None]
    columns = [
        np.concatenate([getattr(points, name)[0 if k == 0 else 1 :] for k, points in enumerate(rows)])
        for name in ("t", "y", "ydot", "ledger")
    ]
    return Points(*columns)
