"""Runs with a library's method: its single steps, and around them the segments, events, outputs and checks of the
contract.
"""

import time
from abc import ABC, abstractmethod
from dataclasses import dataclass, field

import numpy as np

from surfacechem.solve.adapters.crossings import crossings
from surfacechem.solve.adapters.evaluation import Evaluation
from surfacechem.solve.adapters.step_ledger import NODES, StepLedger
from surfacechem.solve.contract import Array, Counters, Events, Points, Problem, Result, Solver, Status
from surfacechem.solve.radau import stepper

MISSED = 100.0
"""Errors in units of the tolerance beyond which a step has not seen what lies before an event."""

LONGEST_FIRST = 1e3
"""First change of a state that its rate may predict, in units of the state."""


class StepError(Exception):
    """The library could not take a step."""


class NoStateError(Exception):
    """No consistent state exists at a point the run needs."""


@dataclass
class View:
    """The problem as a library sees it in one segment: x = differential or all variables."""

    problem: Problem
    parameters: Array
    guess: Array
    """Last algebraic variables found: the start of the next search."""
    residuals: int = 0
    """Right-hand sides that the library has asked for; those for outputs and events are not counted."""
    jacobians: int = 0
    evaluation: Evaluation = field(init=False)

    def __post_init__(self) -> None:
        """Its buffer serves all states of the segment."""
        self.evaluation = Evaluation(self.problem.program, self.guess, self.parameters)

    def inputs(self, t: float, y: Array, ydot: Array) -> Array:
        return self.problem.program.filled(np.concatenate(([t], y, ydot, self.parameters)))

    def complete(self, t: float, differential: Array) -> tuple[Array, Array]:
        """State and derivative with the algebraic variables found from the equations."""
        evaluation = self.evaluation
        evaluation.guess = self.guess[self.problem.program.algebraic_mask]
        if not evaluation.put(t, differential):
            return np.full_like(evaluation.y, np.nan), np.full_like(evaluation.y, np.nan)
        self.guess = evaluation.y.copy()
        return self.guess, evaluation.ydot.copy()

    def ledger_rates(self, t: float, y: Array, ydot: Array) -> Array:
        self.evaluation.hold(t, y, ydot)
        return self.evaluation.ledger()

    def margins(self, t: float, y: Array, ydot: Array) -> Array:
        self.evaluation.hold(t, y, ydot, whole=not self.problem.program.plain_margins)
        return self.evaluation.margins()

    def matrices(self, t: float, y: Array, ydot: Array) -> tuple[Array, Array]:
        """G_y and G_ydot."""
        self.jacobians += 1
        return self.problem.program.derivatives(self.inputs(t, y, ydot))


class Method(ABC):
    """One library method running over one stretch without breakpoints."""

    @abstractmethod
    def advance(self) -> float:
        """Take one step of the library's choice; returns the time reached."""

    @abstractmethod
    def at(self, t: float) -> Array:
        """The variables inside the last step."""

    @property
    def factorizations(self) -> int:
        """Matrices factored so far; 0 where the library does not tell."""
        return 0

    @property
    def own_jacobians(self) -> int:
        """Jacobians that the library has made so far by itself."""
        return 0

    @property
    def rejected(self) -> int:
        """Steps rejected so far, for a solver that counts them."""
        return 0


@dataclass
class Progress:
    """What a run has produced so far."""

    problem: Problem
    started: float
    t: float
    y: Array
    ydot: Array
    ledger: Array
    margins: Array
    sides: Array
    outputs: list[Array] = field(default_factory=list)
    events: list[tuple[int, float, Array, Array, Array]] = field(default_factory=list)
    steps: list[tuple[float, Array, Array, Array]] = field(default_factory=list)
    count: int = 0
    residuals: int = 0
    jacobians: int = 0
    factorizations: int = 0
    rejected: int = 0
    stepping: float = 0.0
    """Time inside the library's own steps [s]."""
    aim: float | None = None
    """Where a step has to end, since one that went beyond has not seen what lies before."""

    def restart_sides(self, fired: set[int]) -> None:
        self.sides = np.sign(self.margins)
        self.sides[list(fired)] = 0.0

    def over_budget(self) -> Status | None:
        if self.count >= self.problem.max_steps:
            return Status.MAX_STEPS
        limit = self.problem.max_seconds
        return Status.STOPPED if limit is not None and time.monotonic() - self.started > limit else None


class SteppingSolver(Solver):
    """A solver made of a library's single steps."""

    counts_rejected = False
    keeps_algebraic = False
    """Whether x holds the algebraic variables too."""

    def prepare(self) -> None:
        stepper.compile_stepper()  # consistent states are found by it

    @abstractmethod
    def begin(self, view: View, t: float, end: float, y: Array, ydot: Array) -> Method:
        """Start the library's method at a consistent state."""

    def solve(self, problem: Problem) -> Result:
        program = problem.program
        empty = np.zeros(0)
        progress = Progress(
            problem,
            time.monotonic(),
            float(problem.segments[0]),
            problem.y0,
            np.zeros(program.n),
            np.zeros(program.n_ledger),
            empty,
            empty,
        )
        status = Status.FINISHED
        for parameters, end in zip(problem.parameters, problem.segments[1:], strict=True):
            view = View(problem, parameters, progress.y)
            try:
                status = self._segment(view, progress, float(end))
            except NoStateError:
                status = Status.NO_CONSISTENT_STATE
            except StepError:
                status = Status.STEP_UNDERFLOW if np.all(np.isfinite(progress.y)) else Status.NOT_FINITE
            progress.residuals += view.residuals
            progress.jacobians += view.jacobians
            if status != Status.FINISHED:
                break
        return _result(progress, status)

    def _state(self, view: View, method: Method, t: float) -> tuple[Array, Array]:
        """State and derivative inside the last step."""
        x = method.at(t)
        if not self.keeps_algebraic:
            return view.complete(t, x)
        view.guess = x
        return view.complete(t, x[~view.problem.program.algebraic_mask])

    def _ledger(self, view: View, progress: Progress, method: Method, reached: float) -> StepLedger:
        """The ledger along the part of the last step that counts."""
        start, size = progress.t, reached - progress.t
        first = view.ledger_rates(start, progress.y, progress.ydot)
        if not len(first):
            return StepLedger(start, size, progress.ledger, np.zeros((len(NODES), 0)))
        inside = [start + size * float(node) for node in NODES[1:]]
        rates = [view.ledger_rates(t, *self._state(view, method, t)) for t in inside]
        return StepLedger(start, size, progress.ledger, np.array([first, *rates]))

    def _segment(self, view: View, progress: Progress, end: float) -> Status:
        fired: set[int] = set()
        while progress.t < end:
            start = progress.t
            progress.y, progress.ydot = view.complete(start, progress.y[~view.problem.program.algebraic_mask])
            if not np.all(np.isfinite(progress.y)):
                raise NoStateError
            progress.margins = view.margins(start, progress.y, progress.ydot)
            progress.restart_sides(fired)
            _start_tables(progress)
            stop = end if progress.aim is None or progress.aim <= start else progress.aim
            method = self.begin(view, start, stop, progress.y, progress.ydot)
            try:
                fired = self._stretch(view, progress, method, stop)
            finally:
                progress.factorizations += method.factorizations
                progress.jacobians += method.own_jacobians
                progress.rejected += method.rejected
            if any(view.problem.margins[i].terminal for i in fired):
                return Status.EVENT
            over = progress.over_budget()
            if over is not None and progress.t < end:
                return over
        return Status.FINISHED

    def _stretch(self, view: View, progress: Progress, method: Method, end: float) -> set[int]:
        """Step until an event, the end of the segment or of the budget; returns the margins that fired."""
        start = progress.t
        while progress.t < end and progress.over_budget() is None:
            before = time.perf_counter()
            reached = min(method.advance(), end)
            progress.stepping += time.perf_counter() - before
            if not reached > progress.t:
                raise StepError("the step size fell to zero")
            if progress.t == start:
                self._check_first(view, progress, method, reached)
            fired: set[int] = set()
            if view.problem.margins:
                reached, fired = self._find_event(view, progress, method, reached)
                if fired and progress.aim is None and not self._seen(view, progress, method, reached):
                    progress.aim = reached
                    return set()
            along = self._ledger(view, progress, method, reached)
            self._write_outputs(view, progress, method, along)
            y, ydot = self._state(view, method, reached)
            ledger = along.at(reached)
            if not (np.all(np.isfinite(y)) and np.all(np.isfinite(ydot)) and np.all(np.isfinite(ledger))):
                raise StepError("a state is not finite")
            if progress.aim is not None and progress.aim <= progress.t:
                progress.aim = None
            progress.t, progress.y, progress.ydot, progress.ledger = reached, y, ydot, ledger
            progress.margins = view.margins(reached, y, ydot)
            progress.count += 1
            if view.problem.record_steps:
                progress.steps.append((reached, y, ydot, ledger))
            progress.events.extend((i, reached, y, ydot, ledger) for i in sorted(fired))
            if fired:
                return fired
        return set()

    def _check_first(self, view: View, progress: Progress, method: Method, reached: float) -> None:
        """A first step far longer than the layer it starts in may end in another solution, unseen by its own test."""
        y, _ = self._state(view, method, reached)
        moved = np.abs(progress.ydot) * (reached - progress.t)
        seen = np.abs(progress.y) + np.abs(y) + view.problem.atol
        if np.any((moved > LONGEST_FIRST * seen)[~view.problem.program.algebraic_mask]):
            raise StepError("the first step is longer than the layer it starts in")

    def _margins(self, view: View, method: Method, t: float) -> Array:
        program = view.problem.program
        if program.plain_margins and not program.algebraic_mask.any():
            y = method.at(t)
            return view.margins(t, y, np.zeros_like(y))
        y, ydot = self._state(view, method, t)
        return view.margins(t, y, ydot)

    def _find_event(self, view: View, progress: Progress, method: Method, reached: float) -> tuple[float, set[int]]:
        directions = np.array([float(margin.direction) for margin in view.problem.margins])
        if view.problem.in_play is not None:  # no direction counts for what is not in play
            directions[~np.array(view.problem.in_play)] = np.nan
        zeros = crossings(lambda t: self._margins(view, method, t), progress.sides, directions, progress.t, reached)
        if zeros:
            first = min(zeros.values())
            near = 1e-9 * (reached - progress.t) + 4e-16 * abs(first)
            return first, {i for i, zero in zeros.items() if zero <= first + near}
        return reached, set()

    def _seen(self, view: View, progress: Progress, method: Method, reached: float) -> bool:
        """Whether the rates up to an event inside the last step add up to its increment; a step that is tested at its
        end alone passes over a peak on the way.
        """
        size = reached - progress.t
        inside = [progress.t + size * float(node) for node in NODES[1:]]
        rates = np.array([progress.ydot, *(self._state(view, method, t)[1] for t in inside)])
        y, problem = self._state(view, method, reached)[0], view.problem
        missed = np.abs(StepLedger(progress.t, size, progress.y, rates).at(reached) - y)
        allowed = MISSED * (problem.rtol * np.maximum(np.abs(y), np.abs(progress.y)) + problem.atol)
        return bool(np.all((missed <= allowed)[~problem.program.algebraic_mask]))

    def _write_outputs(self, view: View, progress: Progress, method: Method, along: StepLedger) -> None:
        times, reached = view.problem.times, along.start + along.size
        while len(progress.outputs) < len(times) and times[len(progress.outputs)] <= reached:
            t = float(times[len(progress.outputs)])
            y, _ = self._state(view, method, t)
            ledger = along.at(t)
            if not (np.all(np.isfinite(y)) and np.all(np.isfinite(ledger))):
                raise StepError("an output is not finite")
            progress.outputs.append(np.concatenate((y, ledger)))


def _start_tables(progress: Progress) -> None:
    """The initial state as first output and first step."""
    times = progress.problem.times
    if not progress.outputs and len(times) and times[0] <= progress.t:
        progress.outputs.append(np.concatenate((progress.y, progress.ledger)))
    if progress.problem.record_steps and not progress.steps:
        progress.steps.append((progress.t, progress.y, progress.ydot, progress.ledger))


def _rows(rows: list[tuple[float, Array, Array, Array]], problem: Problem) -> tuple[Array, Array, Array, Array]:
    widths = (problem.program.n, problem.program.n, problem.program.n_ledger)
    t = np.array([row[0] for row in rows])
    y, ydot, ledger = (
        np.array([row[1 + i] for row in rows]).reshape(len(rows), width) for i, width in enumerate(widths)
    )
    return t, y, ydot, ledger


def _result(progress: Progress, status: Status) -> Result:
    problem, n = progress.problem, progress.problem.program.n
    outputs = np.array(progress.outputs).reshape(-1, n + problem.program.n_ledger)
    index = np.array([event[0] for event in progress.events], dtype=np.int64)
    return Result(
        problem=problem,
        status=status,
        t=progress.t,
        y=progress.y,
        ydot=progress.ydot,
        ledger=progress.ledger,
        margins=progress.margins,
        times=problem.times[: len(outputs)],
        outputs=outputs[:, :n],
        ledger_outputs=outputs[:, n:],
        events=Events(*_rows([event[1:] for event in progress.events], problem), index=index),
        counters=Counters(
            steps=progress.count,
            rejected=progress.rejected,
            residuals=progress.residuals,
            jacobians=progress.jacobians,
            factorizations=progress.factorizations,
        ),
        steps=Points(*_rows(progress.steps, problem)) if problem.record_steps else None,
        stepping=progress.stepping,
    )
