"""Runs of a system with transitions: stretches between events, and the jumps at them.

Within a stretch the modes are constant and any solver of the contract integrates; where a margin of a transition
reaches zero the stretch ends, the jump is made, and the next one starts from there.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from surfacechem.model.automaton import RESTS
from surfacechem.model.system import START, System
from surfacechem.solve.arcs import Part, across_kink, changed, merged
from surfacechem.solve.bounces import ENDLESS, MANY, MISSED, Rebounds
from surfacechem.solve.contract import Problem, Result, Solver, Status
from surfacechem.solve.equilibria import BALANCED, DRIFT, Point
from surfacechem.solve.jumps import Jump, Jumper, booked
from surfacechem.solve.load_path import LoadStep
from surfacechem.solve.radau.solver import consistent
from surfacechem.solve.roundoff import sizes, solve, to_pass

Array = NDArray[np.float64]

NOISE = 1e-13
"""Margins below this part of the largest seen count as zero."""

REACHED = 1e-14
"""Part of the time of a run within which a stretch has reached its end."""

LOST = (Status.STEP_UNDERFLOW, Status.SINGULAR, Status.NO_CONSISTENT_STATE)
"""Ways in which a solver ends where a quasi-static equilibrium is lost."""

LATE, RENEWALS = 1e-6, 4
"""Part of a run below which a stretch is short, and the number of short ones that may follow each other."""

AT_ONCE = 12
"""Transitions at one moment from which on they are chatter."""

SHARPENED = 1e-9
"""Part of a run after which the largest margins seen may be forgotten again: a choice, far above the rounding of time
and far below what is of interest. What follows itself without end within it is chatter even where it would calm down.
"""

NO_PUSH = "nothing pushes it off where it rests; with a mass or a damper any disturbance would"


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
    parts: list[Part] = field(default_factory=list)
    jumps: list[Jump] = field(default_factory=list)
    largest: Array = field(default_factory=lambda: np.zeros(0))
    booked: Array = field(default_factory=lambda: np.zeros(0))
    """Ledger now."""
    calm: int = 0
    """Number of transitions before the last chatter that was resolved."""
    sharpened: float = -np.inf
    """Time [s] at which the largest margins seen were last forgotten."""
    steps: int = 0
    step: LoadStep | None = None
    """The last loads that have jumped."""
    renewed: int = 0
    """Number of short stretches in a row that time could not resolve."""
    written: int = 0
    """Number of outputs written."""
    limits: list[int] = field(default_factory=list)
    """Limits that were reached together with the last transition."""
    status: Status = Status.FINISHED
    reason: str = ""

    @cached_property
    def clock(self) -> int:
        """Column of the time at which a stretch starts."""
        return next(j for j, p in enumerate(self.system.parameters) if p.path == START)

    @cached_property
    def rebounds(self) -> Rebounds:
        """What leaves an exact zero and returns to it."""
        return Rebounds(self.system, self.first)

    def run(self) -> Result:
        """The whole run as one result."""
        problem = self.problem
        self.largest = np.zeros(len(problem.margins))
        self.booked = np.zeros(problem.program.n_ledger)
        self.exchanged = np.zeros(problem.program.n_ledger)
        if problem.max_seconds is not None:
            self.deadline = time.monotonic() + problem.max_seconds
        ended, y, modes = None, problem.y0, problem.parameters[0, self.jumper.mode_columns]
        for start, end, row in zip(problem.segments, problem.segments[1:], problem.parameters, strict=False):
            parameters = row.copy()
            parameters[self.jumper.mode_columns] = modes
            point = Point(float(start), y, np.zeros(len(y)), parameters)
            begun = self._begun(point, ended)
            ended = self._segment(begun, float(end)) if begun is not None else None
            if ended is None:
                break
            y, modes = ended.y, ended.parameters[self.jumper.mode_columns]
        if self.status is Status.MAX_STEPS and self.rebounds.count > MANY:
            self.status, self.reason = Status.FAILED, ENDLESS
        reached = self.parts[-1].end if self.parts else float(problem.segments[0])
        end = max(reached, self.jumps[-1].t) if self.reason and self.jumps else reached
        return merged(problem, self.parts, self.status, end, self.booked)

    def _begun(self, point: Point, before: Point | None) -> Point | None:
        """The start of a piece of time, where loads that jump there have moved what is in equilibrium with them."""
        polished = self.jumper.equilibria.polished
        steps = [index for index, item in enumerate(self.system.edges) if point.t in item.times]
        if not steps or before is None:
            return polished(point)
        before = polished(before)
        point, self.step = replace(point, y=before.y), LoadStep(before)
        return self._jump(steps[0], point, before) if self.jumper.is_loaded(before, point) else point

    def _segment(self, point: Point, end: float) -> Point | None:
        """From a point to the end of its segment; None where the run ends before."""
        while point.t < end:
            started = self._settled(point)
            if started is None:
                return None
            part = self._stretch(started, end)
            if part is None:
                return None
            if self.rebounds.missed(part.result):
                self.status, self.reason = Status.FAILED, MISSED
                return None
            point = Point(part.end, part.result.y, part.result.ydot, started.parameters)
            if part.status is Status.FINISHED:
                return point
            index = self._transition(part, point)
            across = across_kink(self.system.states, point) if index is None and part.status in LOST else None
            renews = self._renews(part)
            if across is not None or (index is None and renews):
                point = across or point
                continue
            if index is None:
                self.status = part.status
                return None
            jumped = self._jump(index, self.jumper.equilibria.in_time(index, point, end), point)
            if jumped is None:
                return None
            point = jumped
        return point

    def _stretch(self, start: Point, end: float) -> Part | None:
        problem = self.problem
        seconds = None if self.deadline is None else self.deadline - time.monotonic()
        if self.steps >= problem.max_steps or (seconds is not None and seconds <= 0):
            self.status = Status.MAX_STEPS if self.steps >= problem.max_steps else Status.STOPPED
            return None
        last = int(np.searchsorted(problem.times, end, side="right"))
        times = problem.times[self.written : last]
        local = start.parameters.copy()
        local[self.clock] = start.t
        local[self.system.origins] -= start.t
        segments = self.rebounds.pieces(start.t, end)
        part = changed(
            problem,
            y0=start.y,
            times=np.clip(times - start.t, 0.0, end - start.t),
            segments=segments,
            parameters=np.repeat(local[None], len(segments) - 1, axis=0),
            max_steps=problem.max_steps - self.steps,
            max_seconds=seconds,
            exchanged=self.exchanged,
            goes_on=end < problem.segments[-1],
            seen=self.rebounds.seen(start.t, sizes(problem, self.system, start, self.largest)),
            in_play=self.system.in_play(local),
        )
        return self._keep(solve(self.method, part, self.system.sliding), start, times, end)

    def _keep(self, result: Result, start: Point, times: Array, end: float) -> Part:
        """The stretch with its times as those of the run, and the ledger up to its end."""
        reached, status = min(start.t + result.t, end), result.status
        if status is Status.FINISHED or (status in LOST and end - reached <= REACHED * end):
            # Where a gap closes at the very end, the last of its digits are rounding of the time.
            reached, status = end, Status.FINISHED
        part = Part(result, start, reached, status, times[: len(result.times)], self.booked)
        self.parts.append(part)
        self.booked = self.booked + result.ledger
        self.exchanged = np.maximum(self.exchanged, np.abs(self.booked))
        self.steps += result.counters.steps
        self.written += len(result.times)
        if len(result.margins):
            self._see(result.margins, self._in_play(start))
        return part

    def _transition(self, part: Part, point: Point) -> int | None:
        """The transition at which a stretch has ended, if any."""
        if part.status is Status.EVENT:
            events = part.result.events
            fired = events.index[events.t == events.t[-1]]
            self.limits = [int(i) for i in fired if i < self.first and self.problem.margins[i].terminal]
            index = int(fired[-1]) - self.first
            return index if index >= 0 else None
        return self.jumper.equilibria.lost(point, self.problem.rtol) if part.status in LOST else None

    def _renews(self, part: Part) -> bool:
        """Whether a stretch that time could not resolve any more goes on in a time of its own."""
        self.renewed = self.renewed + 1 if part.result.t < LATE * self.problem.segments[-1] else 0
        return part.status is Status.STEP_UNDERFLOW and part.result.t > 0 and self.renewed < RENEWALS

    # -- what happens at one moment -------------------------------------------------------------------------------

    def _settled(self, point: Point) -> Point | None:
        """The point after all transitions that are due at its own time."""
        if self.problem.program.margins is None:
            return point
        while not self._chatters(point.t) or self._calmed(point):
            now, playing = self._margins(point), self._in_play(point)
            self._see(now, playing)
            due = self._due(now[self.first :], playing[self.first :], point)
            if self._ended(now, playing, due is not None):
                return None
            if due is None:
                self.limits = []
                return point
            jumped = self._jump(due, point)
            if jumped is None:
                return None
            point = jumped
        self._end_of_chatter(self.jumps[-1])
        return None

    def _end_of_chatter(self, last: Jump) -> None:
        """A fold that lets go of a gap again and again and leaves it where it is counts once, and ends the run."""
        if last.edge.fold is not None and np.array_equal(last.before.y, last.after.y):
            while self.jumps[-2:-1] and self.jumps[-2].edge is last.edge and self.jumps[-2].t == last.t:
                self.jumps.pop()
            self.status, self.reason = Status.EVENT, f"{last.edge.reason}, but {NO_PUSH}"
        else:
            endless = f"transitions follow each other without end (chatter): {last.edge.reason}"
            self.status, self.reason = Status.FAILED, endless

    def _chatters(self, t: float) -> bool:
        """Whether more transitions have followed each other without time going on than any cause needs."""
        recent = len(self.jumps) - self.calm
        moment = REACHED * max(t, LATE * self.problem.segments[-1])
        return recent >= AT_ONCE and self.jumps[-AT_ONCE].t >= t - moment

    def _calmed(self, point: Point) -> bool:
        """Whether what follows itself without end comes to an end, though nothing has stopped it so far.

        It may only seem to do so where what moves now is rounding of what has moved before: that is forgotten first.
        Rebounds that follow each other faster than time can tell have come to rest.
        """
        if point.t > self.sharpened + SHARPENED * self.problem.segments[-1]:
            self.sharpened, self.calm, self.largest = point.t, len(self.jumps), np.zeros_like(self.largest)
            return True
        rests = next((j for j, p in enumerate(self.system.parameters) if p.path == RESTS), None)
        if rests is None or self.jumps[-1].edge.returns is None or point.parameters[rests] == point.t:
            return False
        point.parameters[rests], self.calm = point.t, len(self.jumps)
        return True

    def _margins(self, point: Point) -> Array:
        if self.jumper.margins_read_rates:
            point = self._consistent(point)
        margins = self.problem.program.margins
        assert margins is not None
        return margins(point.inputs())

    def _in_play(self, point: Point) -> NDArray[np.bool_]:
        return np.array(self.system.in_play(point.parameters), dtype=bool)

    def _see(self, margins: Array, playing: NDArray[np.bool_]) -> None:
        """Keep the largest margins seen while in play."""
        self.largest = np.maximum(self.largest, np.where(playing, np.abs(margins), 0.0))
        for alike in self._alike:
            self.largest[alike] = self.largest[alike].max()

    @cached_property
    def _alike(self) -> list[list[int]]:
        """Margins that measure the same in different modes."""
        measures = [item.measure for item in self.system.edges]
        return [[self.first + j for j, other in enumerate(measures) if other == name] for name in {*measures} - {""}]

    @cached_property
    def _of_modes(self) -> list[bool]:
        """Which limits read states that have no past: they are found anew as modes change."""
        found = {state.symbol for state in self.system.states if state.algebraic}
        return [bool(self.system.expand(m.expression).free_symbols & found) for m in self.system.moving_margins()]

    def _ended(self, now: Array, playing: NDArray[np.bool_], due: bool) -> bool:
        """Whether a jump has carried the state to where a law ends; not what modes say that are left at this moment."""
        kinds, margins = self.problem.margins[: self.first], self.system.moving_margins()
        # Beyond the end of a law, be it by rounding, what it says has no meaning.
        least = [0.0 if margin.domain else -NOISE * size for margin, size in zip(margins, self.largest, strict=False)]
        closed = [i for i, kind in enumerate(kinds) if kind.terminal and playing[i] and now[i] < least[i]]
        closed += [i for i in self.limits if playing[i] and now[i] <= NOISE * self.largest[i]]
        closed = [i for i in closed if not (due and self._of_modes[i])]
        if closed and self.jumps:
            reason = self.system.reason(margins[closed[0]], self.jumps[-1].after.inputs())
            self.status, self.reason = Status.EVENT, reason
        return bool(closed and self.jumps)

    def _due(self, now: Array, playing: NDArray[np.bool_], point: Point) -> int | None:
        """The transition whose margin is closed, or is zero and closing; the drift of the integration is not closed."""
        small = NOISE * sizes(self.problem, self.system, point, self.largest)[self.first :]
        drift = np.maximum(DRIFT * self.problem.rtol * self.largest[self.first :], small)
        closed = playing & (now < -drift)
        near = playing & ~closed & (now <= small) & ~to_pass(self.problem)[self.first :]
        if near.any():
            near &= self.jumper.margin_rates(self._consistent(point)) < 0
            closed |= np.array([one and not self._leads_back(j, point) for j, one in enumerate(near)])
        return int(closed.argmax()) if closed.any() else None

    def _leads_back(self, index: int, point: Point) -> bool:
        """Whether a transition leads to modes that have been left at this very moment: rounding undoes nothing."""
        left = [j.before.parameters[self.jumper.mode_columns] for j in self.jumps[-AT_ONCE:] if j.t == point.t]
        return bool(left) and any(np.array_equal(self.jumper.modes_after(index, point), modes) for modes in left)

    def _consistent(self, point: Point) -> Point:
        found = consistent(self.problem.program, point.t, point.y, np.zeros_like(point.y), point.parameters)
        return Point(point.t, found.y, found.ydot, point.parameters)

    def _jump(self, index: int, point: Point, last: Point | None = None) -> Point | None:
        """Carry out a transition and book it; None where the run ends with it."""
        largest, drift = float(self.largest[self.first + index]), DRIFT * self.problem.rtol
        balanced = BALANCED if self.system.edges[index].times else drift
        small, drift = NOISE * largest, drift * largest
        step = self.step if self.step is not None and self.step.before.t == point.t else None
        jump = self.jumper.make(
            index, point, self._since(point.t), small, drift, balanced, last, step, self.problem.rtol
        )
        self.jumps.append(jump)
        if jump.stops:
            word = f"is impossible: {jump.obstacle}" if jump.obstacle else jump.verdict
            self.status, self.reason = Status.EVENT, f"{jump.edge.reason}, which {word}"
            return None
        self.rebounds.see(jump)
        changes = [booked(jump, account, self.jumper.states) for account in self.system.ledger]
        self.booked = self.booked + np.array(changes)
        return jump.after

    def _since(self, t: float) -> float:
        """Time since the transition before, or the start; the length of the stretch between is sharper than t."""
        before = self.jumps[-1].t if self.jumps else float(self.problem.segments[0])
        part = self.parts[-1] if self.parts else None
        return part.result.t + (t - part.end) if part is not None and part.start.t == before else t - before
