"""Events at one moment: edges that are due are carried out in order until none is left.

Nothing is integrated here and no time passes: a hybrid run and a network of reactors each own an Instant, and pass it
the state after every flow. Edges are carried out one by one, and each adds its amounts to the ledger.
"""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np

from surfacechem.model.automaton import REST_TIME_PATH, SLIP_PATH
from surfacechem.solve.contract import CHATTER, FITTED_PART, RETURN_FACTOR, Array, Mask, Problem, Result, Status
from surfacechem.solve.equilibria import BALANCED, Point, drift_of
from surfacechem.solve.jump_heat import LoadStep
from surfacechem.solve.jumps import EdgeUncertainty, Jump, Jumper, velocity_scales
from surfacechem.solve.radau.solver import consistent
from surfacechem.tolerances import BRIEF_PART, GUARD_EPS, IDLE, MICROMETRE, NEWTON_EPS, PICOMETRE

SAME_MOMENT = NEWTON_EPS
"""Relative difference of times that count as one moment: the step onto an event solves for its time."""

UNDRIVEN = "nothing pushes it off where it rests; with a mass or a damper any disturbance would"

MANY_REBOUNDS = 1000
"""Number of rebounds above which they explain that a run has used up its steps."""

ENDLESS = (
    "the number of steps allowed was used up by rebounds; with a smaller coefficient of restitution they would end"
)

MISSED_CLOSING = "the method has not seen the gap close; radau does, or a tighter tolerance"


class Rebounds:
    """Rebounds: edges whose guard leaves an exact zero and may soon return, ever lower and sooner (Zeno behaviour).

    The largest size of the guard so far is then no measure of its roundoff, and the first step must not pass the
    return. ``first`` is the index of the first edge among the guards.
    """

    def __init__(self, jumper: Jumper, first: int) -> None:
        self.jumper = jumper
        self.margins = [first + j for j, item in enumerate(jumper.system.edges) if item.return_time is not None]
        self.count = 0
        self.last = (0.0, 0.0)
        """Time of the last rebound, and its time of flight [s]; zero if unknown."""

    def record(self, jump: Jump) -> None:
        """Record a jump if it is a rebound."""
        if jump.edge.return_time is not None:
            self.count += 1
            self.last = jump.t, float(np.max(self.jumper.times_of_return(jump.after.inputs())))

    def segments(self, start: float, end: float) -> Array:
        """Return the segments of an arc in its own time, with a separate one for a return that a step might miss."""
        soon = RETURN_FACTOR * self._flight_time(start)
        return np.array([0.0, *([soon] if 0 < soon < FITTED_PART * (end - start) else []), end - start])

    def margin_peaks(self, start: float, sizes: Array) -> Array:
        """Return the sizes of the margins to which their roundoff is proportional."""
        if not self.margins:
            return sizes
        own = sizes.copy()
        own[self.margins] = 0.0 if self._flight_time(start) else np.maximum(sizes[self.margins], MICROMETRE)
        return own

    def passed_guard(self, result: Result) -> bool:
        """True if an arc has ended beyond a guard it should have stopped at, by more than a picometre."""
        ended = result.events.index if result.status is Status.EVENT else ()
        active = result.problem.active
        found = [j for j in self.margins if active is None or active[j]] if len(result.margins) else []
        return any(result.margins[j] < -PICOMETRE and j not in ended for j in found)

    def _flight_time(self, start: float) -> float:
        """Time [s] until the guard that has just rebounded returns to zero."""
        since, time = self.last
        return time if since == start else 0.0


class Instant:
    """The present moment of a run, with the jumps so far and the largest states."""

    def __init__(self, jumper: Jumper, problem: Problem) -> None:
        self.system = system = jumper.system
        self.jumper, self.program = jumper, problem.program
        self.first = first = len(system.event_margins)
        """Index of the first edge among the guards; limits come before."""
        self.rtol = problem.rtol
        self.start, self.end = float(problem.segments[0]), float(problem.segments[-1])
        """Start and end of the run [s], the scale for brief times."""
        self.strict = np.array([kind.strict for kind in problem.margins], dtype=bool)
        self.rests = np.array([edge.rests for edge in system.edges], dtype=bool)
        self.terminal = np.array([kind.terminal for kind in problem.margins], dtype=bool)
        self.scales = velocity_scales(system)
        self.peaks = self.scales.copy()
        """Largest states so far; their roundoff remains when the states become small. A velocity sums the impulses of
        forces and is roundoff where small against its scale; a gap may be exactly zero, at touch.
        """
        self.ledger = np.zeros(problem.program.n_ledger)
        """Ledger now."""
        self.rebounds = Rebounds(jumper, first)
        slip = {p.symbol for p in system.parameters if p.path == SLIP_PATH}
        ends = [any(edge.when.get(mode) == (0,) for mode in slip) for edge in system.edges]
        self._slip_guards = first + np.flatnonzero(ends)
        """Indices of the guards that end sticking."""
        self.jumps: list[Jump] = []
        self.limits: list[int] = []
        """Limits that were reached together with the last edge."""
        self.step: LoadStep | None = None
        """Last jump of the loads."""
        self.last_flow = (np.nan, 0.0, np.nan)
        """Start, length and end of the last flow [s]; the length is more accurate than the difference of the others."""
        self._cached_sizes: tuple[Point | None, Array, Array] = None, self.peaks, self.peaks
        """A point, the peaks used there, and the sizes of the guards."""
        self._jumps_resolved = 0
        """Number of edges before the last chatter that was resolved."""
        self._peaks_reset = -np.inf
        """Time [s] at which the peaks of the states were last reset."""
        self.status = Status.FINISHED
        self.reason = ""
        """Reason why the run ends here, in words, if it does."""

    # -- sizes of the guards --------------------------------------------------------------------------------------

    def active_guards(self, point: Point) -> Mask:
        """Return a mask of the guards that are active in the modes of a point."""
        return np.array(self.system.active_guards(point.parameters), dtype=bool)

    def update_peaks(self, y: Array) -> None:
        """Update the largest states, from states of shape (..., states)."""
        self.peaks = np.fmax(self.peaks, np.fmax.reduce(np.abs(y.reshape(-1, len(self.peaks))), axis=0, initial=0.0))

    def sizes(self, point: Point) -> Array:
        """Return the magnitudes of the guards at the peaks of the states; their roundoff is proportional to these.

        A state that was large keeps the absolute uncertainty of that time.
        """
        if self.program.margins is None:
            return np.zeros(0)
        if self._cached_sizes[0] is point and self._cached_sizes[1] is self.peaks:
            return self._cached_sizes[2]
        found = self.jumper.magnitudes(np.concatenate((point.inputs(), np.maximum(self.peaks, np.abs(point.y)))))
        self._cached_sizes = point, self.peaks, np.where(np.isfinite(found), found, 0.0)
        return self._cached_sizes[2]

    def consistent(self, point: Point) -> Point:
        """Return the point with consistent rates and algebraic variables."""
        found = consistent(self.program, point.t, point.y, np.zeros_like(point.y), point.parameters)
        return Point(point.t, found.y, found.ydot, point.parameters)

    def _moment(self, t: float) -> float:
        """Return the earliest time [s] that counts as the same moment."""
        return t - SAME_MOMENT * max(t, BRIEF_PART * self.end)

    # -- edges that are due ---------------------------------------------------------------------------------------

    def begin(self, point: Point, before: Point | None) -> Point | None:
        """Return the start of a load segment; if loads jump there, after the jump of the state that they cause."""
        corrected = self.jumper.equilibria.corrected
        steps = [index for index, edge in enumerate(self.system.edges) if point.t in edge.times]
        if not steps or before is None:
            return corrected(point)
        before = corrected(before)
        point, self.step = point._replace(y=before.y), LoadStep(before)
        return self.apply(steps[0], point, before) if self.jumper.is_loaded(before, point) else point

    def resolve(self, point: Point) -> Point | None:
        """Return the point after all edges that are due at its time; None if the run ends here."""
        guards = self.program.margins
        if guards is None:
            return point
        while self._may_go_on(point):
            seen = self.consistent(point) if self.jumper.guards_read_rates else point
            now, active, sizes = guards(seen.inputs()), self.active_guards(point), self.sizes(point)
            due = self._due(now[self.first :], active[self.first :], sizes[self.first :], point)
            closed = self._closed(now, active, sizes, due is not None) if self.jumps else []
            if closed:
                margin = self.system.event_margins[closed[0]]
                self.status, self.reason = Status.EVENT, self.system.reason(margin, self.jumps[-1].after.inputs())
                return None
            if due is None:
                self.limits = []
                return point
            jumped = self.apply(due, point._replace(ydot=seen.ydot))
            if jumped is None:
                return None
            point = jumped
        last = self.jumps[-1]
        if last.edge.fold is None or not np.array_equal(last.before.y, last.after.y):
            endless = f"transitions follow each other without end (chatter): {last.edge.reason}"
            self.status, self.reason = Status.FAILED, endless
            return None
        # A fold that fires repeatedly without moving the gap counts once, and ends the run.
        while self.jumps[-2:-1] and self.jumps[-2].edge is last.edge and self.jumps[-2].t == last.t:
            self.jumps.pop()
        self.status, self.reason = Status.EVENT, f"{last.edge.reason}, but {UNDRIVEN}"
        return None

    def on_tick(self, index: int, point: Point, end: float) -> Point:
        """Return the point at which an arc has reached an edge, at the first tick of a run's clock that is not before.

        An arc counts time from its own start, more finely than the run: within a tick a guard may change by more than
        its uncertainty, and an edge that is carried out before its time is found again, without end.
        """
        guards, j, at = self.program.margins, self.first + index, self.jumper.equilibria.corrected(point)
        assert guards is not None
        at = self.consistent(at) if self.jumper.guards_read_rates else at
        # After an arc within one tick time has to go on, whatever the roundoff.
        still = self.last_flow[0] == point.t
        least = 0.0 if still else max(drift_of(self.rtol), GUARD_EPS) * self.sizes(point)[j]
        early = guards(at.inputs())[j] > least
        return point._replace(t=min(math.nextafter(point.t, math.inf), end)) if early else point

    def _may_go_on(self, point: Point) -> bool:
        """True if edges may follow at a moment; False where they chatter, with more edges than any cause needs.

        Chatter may be apparent, where a motion is the roundoff of earlier, larger states: their peaks are reset first.
        Rebounds that follow each other faster than time can resolve have come to rest.
        """
        t, recent = point.t, len(self.jumps) - self._jumps_resolved
        if recent < CHATTER or self.jumps[-CHATTER].t < self._moment(t):
            return True
        if t > self._peaks_reset + IDLE * self.end:
            self._peaks_reset, self._jumps_resolved, self.peaks = t, len(self.jumps), self.scales.copy()
            return True
        column = self.system.parameter_columns.get(REST_TIME_PATH)
        if column is None or self.jumps[-1].edge.return_time is None or point.parameters[column] == t:
            return False
        point.parameters[column], self._jumps_resolved = t, len(self.jumps)
        return True

    def _due(self, now: Array, active: Mask, sizes: Array, point: Point) -> int | None:
        """Return the edge whose guard is below zero by more than the integration's drift, or is zero and closing."""
        small = GUARD_EPS * sizes
        rests, moment = self.rests & (now <= small), self._moment(point.t)
        for jump in self.jumps[-CHATTER:]:  # what has rested at this moment and gone on since does not rest again
            rests &= [jump.t < moment or jump.edge is not edge for edge in self.system.edges]
        closed = active & (rests | (now < -np.maximum(drift_of(self.rtol) * sizes, small)))
        near = active & ~closed & (now <= small) & ~self.strict[self.first :]
        if near.any():
            near &= self.jumper.guard_rates(self.consistent(point).inputs()) < 0
            # Roundoff must not undo an edge: no edge leads back to modes that were left at this moment.
            left = [j.before.parameters[self.jumper.mode_columns] for j in self.jumps[-CHATTER:] if j.t == point.t]
            for j in np.flatnonzero(near).tolist():
                closed[j] = not any(np.array_equal(self.jumper.modes_after(j, point), modes) for modes in left)
        return int(closed.argmax()) if closed.any() else None

    def _closed(self, now: Array, active: Mask, sizes: Array, due: bool) -> list[int]:
        """Return the limits beyond which a jump has carried the state, except those of modes left at this moment."""
        # Beyond the domain of a law, even by roundoff, its values have no meaning.
        margins = self.system.event_margins
        least = [0.0 if m.domain else -GUARD_EPS * size for m, size in zip(margins, sizes, strict=False)]
        closed = [i for i in range(self.first) if self.terminal[i] and active[i] and now[i] < least[i]]
        closed += [i for i in self.limits if active[i] and now[i] <= GUARD_EPS * sizes[i]]
        if not (due and closed):
            return closed
        return [i for i in closed if i not in self._algebraic_limits]

    @cached_property
    def _algebraic_limits(self) -> set[int]:
        """Limits that read algebraic states, which are found anew as modes change."""
        found = {state.symbol for state in self.system.states if state.algebraic}
        read = [self.system.expand(m.expression).free_symbols for m in self.system.event_margins]
        return {i for i, symbols in enumerate(read) if symbols & found}

    def apply(self, index: int, point: Point, last: Point | None = None) -> Point | None:
        """Carry out an edge and add it to the ledger; None if the run ends with it."""
        size, drift = float(self.sizes(point)[self.first + index]), drift_of(self.rtol)
        balanced, sticking = BALANCED if self.system.edges[index].times else drift, 0.0
        if len(self._slip_guards) and self.system.edges[index].equilibrates:
            parameters = point.parameters.copy()
            parameters[self.jumper.mode_columns] = self.jumper.modes_after(index, point)
            # The larger magnitude of the margin of sticking on both sides of the edge.
            both = [self.sizes(at)[self._slip_guards] for at in (point._replace(parameters=parameters), point)]
            sticking = float(np.max(both))
        slack = EdgeUncertainty(GUARD_EPS * size, drift * size, balanced, GUARD_EPS * sticking, self.rtol)
        step = self.step if self.step is not None and self.step.before.t == point.t else None
        before = self.jumps[-1].t if self.jumps else self.start
        begun, length, reached = self.last_flow
        since = length + (point.t - reached) if begun == before else point.t - before
        jump = self.jumper.make(index, point, since, slack, last, step)
        self.jumps.append(jump)
        if jump.stops:
            word = f"is impossible: {jump.obstacle}" if jump.obstacle else jump.verdict
            self.status, self.reason = Status.EVENT, f"{jump.edge.reason}, which {word}"
            return None
        self.rebounds.record(jump)
        self.ledger = self.ledger + self.jumper.ledger_change(jump)
        return jump.after
