"""Events at one moment: the edges that are due are carried out in order until none is.

Nothing here integrates and no clock runs: a hybrid run and a network of reactors own an instant each, and tell it where
the flow between has led. What is due is carried out edge by edge; the ledger gains what each of them books.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np

from surfacechem.model.automaton import REST_TIME_PATH, SLIP_PATH
from surfacechem.model.system import System
from surfacechem.solve.contract import CHATTER, FITTED_PART, RETURN_FACTOR, Array, Mask, Problem, Result, Status
from surfacechem.solve.equilibria import BALANCED, Point, drift_of
from surfacechem.solve.jump_heat import LoadStep
from surfacechem.solve.jumps import EdgeUncertainty, Jump, Jumper, velocity_scales
from surfacechem.solve.radau.solver import consistent
from surfacechem.tolerances import BRIEF_PART, GUARD_EPS, IDLE, MICROMETRE, NEWTON_EPS, PICOMETRE

SAME_MOMENT = NEWTON_EPS
"""Part of the time within which two moments are one: a step onto an event solves for its time."""

NO_PUSH = "nothing pushes it off where it rests; with a mass or a damper any disturbance would"

MANY_REBOUNDS = 1000
"""Number of rebounds above which they explain that a run has used up its steps."""

ENDLESS = (
    "the number of steps allowed was used up by rebounds; with a smaller coefficient of restitution they would end"
)

MISSED_CLOSING = "the method has not seen the gap close; radau does, or a tighter tolerance"


class Rebounds:
    """Rebounds: edges whose guard leaves an exact zero and may soon return, ever lower and sooner (Zeno behaviour).

    How large the guard has been before is no measure of its rounding then, and a first step must not pass the return.
    ``first`` is the index of the first edge among the guards.
    """

    def __init__(self, jumper: Jumper, first: int) -> None:
        self.jumper = jumper
        self.margins = [first + j for j, item in enumerate(jumper.system.edges) if item.returns is not None]
        self.count = 0
        self.last = (0.0, 0.0)
        """Time of the last one, and how long it takes to return [s]; zero where that is open."""

    def see(self, jump: Jump) -> None:
        """Remember a jump where it is a rebound, or ends them."""
        if jump.edge.returns is not None:
            self.count += 1
            self.last = jump.t, float(np.max(self.jumper.times_of_return(jump.after.inputs())))

    def pieces(self, start: float, end: float) -> Array:
        """Pieces of a stretch in its own time: one of its own for what returns so soon that a step might miss it."""
        soon = RETURN_FACTOR * self._flight_time(start)
        inside = [soon] if 0 < soon < FITTED_PART * (end - start) else []
        return np.array([0.0, *inside, end - start])

    def seen(self, start: float, sizes: Array) -> Array:
        """Sizes of the margins that their rounding is in proportion to."""
        if not self.margins:
            return sizes
        own = sizes.copy()
        own[self.margins] = 0.0 if self._flight_time(start) else np.maximum(sizes[self.margins], MICROMETRE)
        return own

    def missed(self, result: Result) -> bool:
        """Whether an arc has ended beyond what it should have ended at, by more than has a meaning for bodies."""
        ended = result.events.index if result.status is Status.EVENT else ()
        playing = result.problem.in_play
        found = [j for j in self.margins if playing is None or playing[j]] if len(result.margins) else []
        return any(result.margins[j] < -PICOMETRE and j not in ended for j in found)

    def _flight_time(self, start: float) -> float:
        """Time [s] until the guard that has just rebounded returns to zero."""
        since, time = self.last
        return time if since == start else 0.0


class Instant:
    """The present moment of a run: what has jumped so far, and how large the states have been."""

    def __init__(self, system: System, jumper: Jumper, problem: Problem, first: int) -> None:
        self.system, self.jumper, self.program = system, jumper, problem.program
        self.first = first
        """Index of the first edge among the guards; limits come before."""
        self.rtol = problem.rtol
        self.start, self.end = float(problem.segments[0]), float(problem.segments[-1])
        """Times [s] between which the run goes; what is brief is so against them."""
        self.strict = np.array([kind.strict for kind in problem.margins], dtype=bool)
        self.terminal = np.array([kind.terminal for kind in problem.margins], dtype=bool)
        self.scales = velocity_scales(system)
        self.peaks = self.scales.copy()
        """Largest states seen; what is left of them is rounding. A velocity adds up what forces have given and taken,
        and is rounding where it is small against its scale; a gap may be exactly zero, at touch.
        """
        self.booked = np.zeros(problem.program.n_ledger)
        """Ledger now."""
        self.rebounds = Rebounds(jumper, first)
        slip = {p.symbol for p in system.parameters if p.path == SLIP_PATH}
        ends = [any(edge.when.get(mode) == (0,) for mode in slip) for edge in system.edges]
        self._sticking = first + np.flatnonzero(ends)
        """Indices of the guards that end sticking."""
        self.jumps: list[Jump] = []
        self.limits: list[int] = []
        """Limits that were reached together with the last edge."""
        self.step: LoadStep | None = None
        """The last loads that have jumped."""
        self.flowed = (np.nan, 0.0, np.nan)
        """Start of the last flow, its length, and its end [s]; the length is sharper than the difference of the two."""
        self._sized: tuple[Point | None, Array, Array] = None, self.peaks, self.peaks
        """A point, the peaks with which it was looked at, and the sizes of the guards there."""
        self._resolved = 0
        """Number of edges before the last chatter that was resolved."""
        self._sharpened = -np.inf
        """Time [s] at which the peaks of the states were last forgotten."""
        self.status = Status.FINISHED
        self.reason = ""
        """Reason why the run ends here, in words, where it does."""

    # -- what is seen of the guards -------------------------------------------------------------------------------

    def in_play(self, point: Point) -> Mask:
        """Mask of the guards that are active in the modes of a point."""
        return np.array(self.system.in_play(point.parameters), dtype=bool)

    def see(self, y: Array) -> None:
        """Keep the largest states seen, shape (..., states)."""
        self.peaks = np.fmax(self.peaks, np.fmax.reduce(np.abs(y.reshape(-1, len(self.peaks))), axis=0, initial=0.0))

    def sizes(self, point: Point) -> Array:
        """Magnitudes of the guards at the peaks of the states, to which their rounding is in proportion.

        What is left of a state that was large is known no better than it was then.
        """
        if self.program.margins is None:
            return np.zeros(0)
        if self._sized[0] is point and self._sized[1] is self.peaks:
            return self._sized[2]
        found = self.jumper.magnitudes(np.concatenate((point.inputs(), np.maximum(self.peaks, np.abs(point.y)))))
        self._sized = point, self.peaks, np.where(np.isfinite(found), found, 0.0)
        return self._sized[2]

    def consistent(self, point: Point) -> Point:
        """The point with the rates and algebraic variables that belong to it."""
        found = consistent(self.program, point.t, point.y, np.zeros_like(point.y), point.parameters)
        return Point(point.t, found.y, found.ydot, point.parameters)

    # -- what is due ----------------------------------------------------------------------------------------------

    def begin(self, point: Point, before: Point | None) -> Point | None:
        """The start of a load segment, where loads that jump there have moved what is in equilibrium with them."""
        corrected = self.jumper.equilibria.corrected
        steps = [index for index, edge in enumerate(self.system.edges) if point.t in edge.times]
        if not steps or before is None:
            return corrected(point)
        before = corrected(before)
        point, self.step = replace(point, y=before.y), LoadStep(before)
        return self.apply(steps[0], point, before) if self.jumper.is_loaded(before, point) else point

    def resolve(self, point: Point) -> Point | None:
        """The point after all edges that are due at its own time; None where the run ends here."""
        guards = self.program.margins
        if guards is None:
            return point
        while self._may_go_on(point):
            seen = self.consistent(point) if self.jumper.guards_read_rates else point
            now, playing, sizes = guards(seen.inputs()), self.in_play(point), self.sizes(point)
            due = self._due(now[self.first :], playing[self.first :], sizes[self.first :], point)
            closed = self._closed(now, playing, sizes, due is not None) if self.jumps else []
            if closed:
                margin = self.system.moving_margins[closed[0]]
                self.status, self.reason = Status.EVENT, self.system.reason(margin, self.jumps[-1].after.inputs())
                return None
            if due is None:
                self.limits = []
                return point
            jumped = self.apply(due, point)
            if jumped is None:
                return None
            point = jumped
        last = self.jumps[-1]
        if last.edge.fold is None or not np.array_equal(last.before.y, last.after.y):
            endless = f"transitions follow each other without end (chatter): {last.edge.reason}"
            self.status, self.reason = Status.FAILED, endless
            return None
        # A fold that lets go of a gap again and again and leaves it where it is counts once, and ends the run.
        while self.jumps[-2:-1] and self.jumps[-2].edge is last.edge and self.jumps[-2].t == last.t:
            self.jumps.pop()
        self.status, self.reason = Status.EVENT, f"{last.edge.reason}, but {NO_PUSH}"
        return None

    def _may_go_on(self, point: Point) -> bool:
        """Whether edges may follow at a moment; not where they chatter, more of them than any cause needs.

        That may only seem so where what moves now is rounding of what has moved before: it is forgotten first. Rebounds
        that follow each other faster than time can tell have come to rest.
        """
        t, recent = point.t, len(self.jumps) - self._resolved
        if recent < CHATTER or self.jumps[-CHATTER].t < t - SAME_MOMENT * max(t, BRIEF_PART * self.end):
            return True
        if t > self._sharpened + IDLE * self.end:
            self._sharpened, self._resolved, self.peaks = t, len(self.jumps), self.scales.copy()
            return True
        rests = next((j for j, p in enumerate(self.system.parameters) if p.path == REST_TIME_PATH), None)
        if rests is None or self.jumps[-1].edge.returns is None or point.parameters[rests] == t:
            return False
        point.parameters[rests], self._resolved = t, len(self.jumps)
        return True

    def _due(self, now: Array, playing: Mask, sizes: Array, point: Point) -> int | None:
        """The edge whose guard is closed, or is zero and closing; the drift of the integration is not closed."""
        small = GUARD_EPS * sizes
        closed = playing & (now < -np.maximum(drift_of(self.rtol) * sizes, small))
        near = playing & ~closed & (now <= small) & ~self.strict[self.first :]
        if near.any():
            near &= self.jumper.guard_rates(self.consistent(point).inputs()) < 0
            # Rounding undoes nothing: no edge leads to modes that have been left at this very moment.
            left = [j.before.parameters[self.jumper.mode_columns] for j in self.jumps[-CHATTER:] if j.t == point.t]
            for j in np.flatnonzero(near).tolist():
                closed[j] = not any(np.array_equal(self.jumper.modes_after(j, point), modes) for modes in left)
        return int(closed.argmax()) if closed.any() else None

    def _closed(self, now: Array, playing: Mask, sizes: Array, due: bool) -> list[int]:
        """Limits beyond which a jump has carried the state; not what modes say that are left at this moment."""
        # Beyond the end of a law, be it by rounding, what it says has no meaning.
        margins = self.system.moving_margins[: self.first]
        least = [0.0 if m.domain else -GUARD_EPS * size for m, size in zip(margins, sizes, strict=False)]
        closed = [i for i in range(self.first) if self.terminal[i] and playing[i] and now[i] < least[i]]
        closed += [i for i in self.limits if playing[i] and now[i] <= GUARD_EPS * sizes[i]]
        if not (due and closed):
            return closed
        return [i for i in closed if i not in self._found_anew]

    @cached_property
    def _found_anew(self) -> set[int]:
        """Limits that read states without a past, which are found anew as modes change."""
        found = {state.symbol for state in self.system.states if state.algebraic}
        read = [self.system.expand(m.expression).free_symbols for m in self.system.moving_margins[: self.first]]
        return {i for i, symbols in enumerate(read) if symbols & found}

    def _borne(self, index: int, point: Point) -> float:
        """Rounding of the margin of sticking [Pa], on both sides of an edge."""
        if not (len(self._sticking) and self.system.edges[index].equilibrates):
            return 0.0
        parameters = point.parameters.copy()
        parameters[self.jumper.mode_columns] = self.jumper.modes_after(index, point)
        both = [self.sizes(at)[self._sticking] for at in (replace(point, parameters=parameters), point)]
        return GUARD_EPS * float(np.max(both))

    def apply(self, index: int, point: Point, last: Point | None = None) -> Point | None:
        """Carry out an edge and book it; None where the run ends with it."""
        largest, drift = float(self.sizes(point)[self.first + index]), drift_of(self.rtol)
        balanced = BALANCED if self.system.edges[index].times else drift
        slack = EdgeUncertainty(GUARD_EPS * largest, drift * largest, balanced, self._borne(index, point), self.rtol)
        step = self.step if self.step is not None and self.step.before.t == point.t else None
        before = self.jumps[-1].t if self.jumps else self.start
        begun, length, reached = self.flowed
        since = length + (point.t - reached) if begun == before else point.t - before
        jump = self.jumper.make(index, point, since, slack, last, step)
        self.jumps.append(jump)
        if jump.stops:
            word = f"is impossible: {jump.obstacle}" if jump.obstacle else jump.verdict
            self.status, self.reason = Status.EVENT, f"{jump.edge.reason}, which {word}"
            return None
        self.rebounds.see(jump)
        self.booked = self.booked + self.jumper.booked(jump)
        return jump.after
