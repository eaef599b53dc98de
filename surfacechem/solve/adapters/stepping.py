"""Runs with single steps of a library's method, and the segments, events, outputs and checks of the contract."""

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from surfacechem.errors import InputError
from surfacechem.solve.adapters.dense_step import NODES, WEIGHTS, DenseStep, Guards, Steps, first_crossing, gained_at
from surfacechem.solve.adapters.evaluation import Evaluation, Evaluations
from surfacechem.solve.contract import Array, Counters, Events, Points, Problem, Result, Solver, Status
from surfacechem.solve.radau import stepper
from surfacechem.tolerances import EPS, FORMULA_EPS, NEGLIGIBLE, SQRT_EPS, ULPS

ENTROPY_GROUP = 1
"""Group of the ledger's entropy accounts."""

MAX_DEFECT = 100.0
"""Defect, in tolerances, above which a step has missed something before an event."""

FIRST_TOGETHER, TOGETHER_GROWTH, MOST_TOGETHER = 16, 4, 256
"""Number of steps for which the equations are evaluated together: at first, its growth, and at most. Steps beyond an
event are wasted; between 64 and 256 the maximum makes no difference to a run of a hundred reactions.
"""

MOST_INPUTS = 2**17
"""Largest number of inputs of these evaluations, a megabyte: what a cache does not hold is no faster together."""

LONGEST_FIRST = 1e3
"""Largest first change of a state that its rate may predict, in units of the state."""


class StepError(Exception):
    """The library could not take a step."""


class NoStateError(Exception):
    """No consistent state exists at a point that the run needs."""


class View(Evaluation):
    """The problem in one segment as a library sees it: x = differential or all variables.

    For libraries without algebraic variables it is reduced to x' = f(t, x) of the differential ones. The first search
    for algebraic variables starts from the initial state.
    """

    def __init__(self, problem: Problem, parameters: Array, start: Array) -> None:
        super().__init__(problem.program, start, parameters)
        self.problem = problem
        self.differential = ~problem.program.algebraic_mask
        self.many = Evaluations(problem.program, parameters)
        self.atol = problem.atol[self.differential]
        self.residuals = self.jacobians = 0
        """Right-hand sides and Jacobians requested by the library; those for outputs and events do not count."""

    def row(self, t: float, y: Array, ydot: Array) -> Array:
        """Return the arguments of compiled functions at a state."""
        return self.program.filled(np.concatenate(([t], y, ydot, self.parameters)))

    def complete(self, t: float, x: Array) -> tuple[Array, Array]:
        """Return state and derivatives from the differential variables, solving for the algebraic ones."""
        if not self.put(t, x):
            return np.full_like(self.y, np.nan), np.full_like(self.y, np.nan)
        return self.y.copy(), self.ydot.copy()

    def matrices(self, t: float, y: Array, ydot: Array) -> tuple[Array, Array]:
        """Return G_y and G_ydot."""
        self.jacobians += 1
        return self.program.derivatives(self.row(t, y, ydot))

    def first_step(self, span: float, y: Array, ydot: Array) -> float:
        """Return the step that CVODE begins with if it is asked for a time ``span`` later, infinite if it finds one.

        It seeks one between a hundred roundings of that time and the step in which a variable changes by a tenth. Where
        the latter is the shorter, it takes their geometric mean instead, from which no failures lead far enough down.
        """
        changed = 0.1 * np.abs(y[self.differential]) + self.atol
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            soon = float(np.nanmin(changed / np.abs(ydot[self.differential]), initial=np.inf))
        return soon if soon < 100 * EPS * span else np.inf

    def growing_size(self, t: float, x: Array) -> float:
        """Return the step in which states below their tolerances grow at most e-fold, by one another's derivatives.

        No error counts there, and implicit methods damp what grows much faster: they would never leave an unstable
        equilibrium. The compiled stepper keeps to the same.
        """
        below = np.flatnonzero(np.abs(x) < self.atol)
        if not len(below):
            return np.inf
        states, sizes = np.empty((1 + len(below), len(self.y))), self.atol[below]
        states[:, self.free], states[:, self.algebraic] = x, self.guess
        states[1 + np.arange(len(below)), self.free[below]] += sizes
        rates = self.many(np.full(len(states), t), states)[1][:, self.free[below]]
        slopes = ((rates[1:] - rates[0]) / sizes[:, None]).T
        driven = (x[below] != 0) | (rates[0] != 0)  # what is exactly zero, with zero rate, does not grow
        for _ in below:
            driven |= (slopes[:, driven] != 0).any(axis=1)
        if not np.all(np.isfinite(slopes)):
            return np.inf
        fastest = float(np.linalg.eigvals(slopes[driven][:, driven]).real.max(initial=0.0))
        # That of a fast exchange is zero within roundoff.
        return 1 / fastest if fastest > FORMULA_EPS * np.abs(slopes).max() else np.inf

    def reduced_rates(self, t: float, x: Array) -> Array:
        """Return the right-hand side f of the reduced system."""
        self.residuals += 1
        return self.complete(t, x)[1][self.differential]

    def reduced_jacobian(self, t: float, x: Array) -> Array:
        """Return df/dx, from G_x dx + G_u du = 0 with u the derivatives and algebraic variables."""
        y, ydot = self.complete(t, x)
        by_state, by_rate = self.matrices(t, y, ydot)
        unknown = np.where(self.differential, by_rate, by_state)
        try:
            return np.asarray(-np.linalg.solve(unknown, by_state[:, self.differential])[self.differential])
        except np.linalg.LinAlgError:
            return np.full((len(x), len(x)), np.nan)


class Method(ABC):
    """One library method running over one interval without breakpoints."""

    together = FIRST_TOGETHER
    """Number of steps that are taken before the first look at margins, in a run without an event so far."""

    @abstractmethod
    def several(self, most: int) -> Steps:
        """Take at least one step, and up to this many if the dense output of earlier steps remains available."""

    @property
    def counters(self) -> Counters:
        """Matrices factored, Jacobians formed and steps rejected so far, where the library tells."""
        return Counters()


class SingleSteps(Method):
    """Steps with time counted from their start: a fast transient may be over before the time of the run changes."""

    def __init__(self, most: int, start: float, end: float) -> None:
        self.most = most
        """Most steps without a change of the run's time."""
        self.start, self.t, self.end = start, start, end
        self.passed = 0.0
        """Time since the start [s]."""

    @abstractmethod
    def step(self) -> float:
        """Take one step, of the size that the library chooses; return the time since the start at its end [s]."""

    @abstractmethod
    def dense(self) -> Callable[[float], Array]:
        """Return the variables in the last step as a function of the time of the run."""

    def several(self, most: int) -> Steps:
        return Steps.of([self.advance()])

    def advance(self) -> DenseStep:
        """Take steps until the time of the run changes."""
        before, taken = self.t, 0
        while self.t == before:
            if taken >= self.most:
                raise StepError(f"more than {self.most} steps without a change of the time in its last digit")
            last, self.passed, taken = self.passed, self.step(), taken + 1
            if not self.passed > last:  # some methods would repeat such steps endlessly
                raise StepError("the step size fell to zero")
            self.t = self.end if self.passed >= self.end - self.start else self.start + self.passed
        return DenseStep(before, self.t, self.dense())


class SteppingSolver(Solver):
    """A solver made of a library's single steps."""

    counts_rejected = False
    keeps_longest = False
    """True if its longest step is that of the start."""
    keeps_algebraic = False
    """True if x includes the algebraic variables."""

    def prepare(self) -> None:
        stepper.LOOP.load()  # it finds consistent states

    def check(self, count: int) -> None:
        """Raise InputError if there is no variable to integrate, without which some libraries take no step."""
        if count == 0:
            message = f"{self.name} has nothing to integrate, since all variables follow from balances"
            raise InputError(f"{message}: `radau` and `ida` step along these.", path="run.solver")

    @abstractmethod
    def begin(self, view: View, t: float, end: float, y: Array, ydot: Array) -> Method:
        """Start the library's method at a consistent state."""

    def solve(self, problem: Problem) -> Result:
        run, status = _Run(self, problem), Status.FINISHED
        for parameters, end in zip(problem.parameters, problem.segments[1:], strict=True):
            run.view, run.end = View(problem, parameters, run.y), float(end)
            try:
                status = run.through_segment()
            except NoStateError:
                status = Status.NO_CONSISTENT_STATE
            except StepError:
                status = Status.STEP_UNDERFLOW if np.all(np.isfinite(run.y)) else Status.NOT_FINITE
            run.told.append(Counters(residuals=run.view.residuals, jacobians=run.view.jacobians))
            if status != Status.FINISHED:
                break
        return run.result(status)


class _Inside(NamedTuple):
    """Variables at the quadrature points of consecutive steps, [node, step, ...]."""

    times: Array
    """Start of the first step and ends of all [s]."""
    y: Array
    ydot: Array
    ledger: Array
    """Rates of the ledger."""
    margins: Array

    def part(self, first: int, end: int) -> "_Inside":
        """Return those of some of the steps."""
        rows = (each[:, first:end] for each in (self.y, self.ydot, self.ledger, self.margins))
        return _Inside(self.times[first : end + 1], *rows)

    def integral(self, rates: Array) -> Array:
        """Return the integral of these rates over each step."""
        return np.diff(self.times)[:, None] * sum(weight * row for weight, row in zip(WEIGHTS, rates, strict=True))


class _Run:
    """A run in progress: its present state and its results so far."""

    def __init__(self, solver: SteppingSolver, problem: Problem) -> None:
        program = problem.program
        self.solver, self.problem = solver, problem
        self.started = time.monotonic()
        self.t, self.y, self.ydot = float(problem.segments[0]), problem.y0, np.zeros(program.n)
        self.ledger, self.ledger_rates = np.zeros(program.n_ledger), np.zeros(program.n_ledger)
        self.margins = np.zeros(0)
        self.entropic = np.array(program.groups) == ENTROPY_GROUP
        self.guards = Guards.of(problem.margins, self._guards, problem.margin_peaks)
        self.plain = program.plain_margins and not program.algebraic_mask.any()
        """True if margins depend only on variables that the library integrates."""
        if self.plain:
            self.guards.rows = lambda times, x: self.view.many.margins(times, x)
        self.active = np.array((True,) * program.n_margins if problem.active is None else problem.active, bool)
        self.outputs: list[Array] = []
        self.fired: list[int] = []
        self.restarts: list[int] = []
        """Margins that fire at the present time."""
        self.events: list[tuple[Array, Array, Array, Array]] = []
        """Times, states, rates and ledgers at events, whose margins are in ``fired``."""
        self.steps: list[tuple[Array, Array, Array, Array]] = []
        """Times, states, rates and ledgers at the ends of steps, of several steps at a time."""
        self.told: list[Counters] = []
        """Counts of the library, and of its calls."""
        self.count, self.stepping = 0, 0.0
        """Steps, and time inside those of the library [s]."""
        self.view: View
        self.end: float
        """End of the present segment [s]."""
        self.aim: float | None = None
        """Expected time of an event that the library's step has passed over: the next steps end there."""

    def through_segment(self) -> Status:
        """Integrate to the end of the segment, restarting the library after each event."""
        end = self.end
        while self.t < end:
            start = self.t
            y, ydot = self.view.complete(start, self.y[self.view.differential])
            if not np.all(np.isfinite(y)):
                raise NoStateError
            self.y, self.ydot = y, ydot
            self.view.hold(start, y, ydot)
            self.margins, self.ledger_rates = self.view.margins(), self.view.ledger()
            self.guards.start(self.margins, self.restarts)
            self._record_start()
            stop = end if self.aim is None or self.aim <= start else self.aim
            if self.solver.keeps_longest:  # a limit of its steps has to be lifted by another start
                stop = min(stop, start + FIRST_TOGETHER * self.view.growing_size(start, y[self.view.differential]))
            method = self.solver.begin(self.view, start, stop, self.y, self.ydot)
            try:
                self.restarts = self._to_event(method, stop)
            finally:
                self.told.append(method.counters)
            if any(self.problem.margins[i].terminal for i in self.restarts):
                return Status.EVENT
            over = self._over_budget()
            if over is not None and self.t < end:
                return over
        return Status.FINISHED

    def _record_start(self) -> None:
        """Record the start of the run, once, among its outputs and steps."""
        if not self.outputs and len(self.problem.times) and self.problem.times[0] <= self.t:
            self.outputs.append(np.concatenate((self.y, self.ledger)))
        if self.problem.record_steps and not self.steps:
            self.steps.append((np.array([self.t]), self.y[None], self.ydot[None], self.ledger[None]))

    def _over_budget(self) -> Status | None:
        if self.count >= self.problem.max_steps:
            return Status.MAX_STEPS
        limit = self.problem.max_seconds
        return Status.STOPPED if limit is not None and time.monotonic() - self.started > limit else None

    def _within_budget(self, most: int) -> int:
        """Return this number of steps, or the number that the budget allows at the pace so far, at least one."""
        most, limit = min(most, self.problem.max_steps - self.count), self.problem.max_seconds
        if limit is None:
            return most
        if not self.count:
            return min(most, FIRST_TOGETHER)
        passed = time.monotonic() - self.started
        return max(1, min(most, int(self.count * (limit - passed) / passed)))

    def _to_event(self, method: Method, end: float) -> list[int]:
        """Step until an event, the end, or the end of the budget; return the margins that fired."""
        inputs = len(NODES) * self.view.program.n_inputs
        # Algebraic variables are searched from those of the last step, which must be close: one step at a time.
        largest = 1 if len(self.view.algebraic) else max(FIRST_TOGETHER, min(MOST_TOGETHER, MOST_INPUTS // inputs))
        eventful = bool(self.fired) or self.problem.exchanged is not None
        start, most = self.t, min(largest, FIRST_TOGETHER if eventful else method.together)
        while self.t < end and self._over_budget() is None:
            before = time.perf_counter()
            steps = method.several(self._within_budget(most))
            self.stepping += time.perf_counter() - before
            if not steps.times[1] > self.t:
                raise StepError("the step size fell to zero")
            most = min(TOGETHER_GROWTH * most, largest)
            inside = self._inside(steps, min(float(steps.times[-1]), end))
            if self.t == start:
                # A step far longer than the transient it starts in may end on another solution, which its error test
                # does not detect.
                moved = np.abs(self.ydot) * (inside.times[1] - start)
                seen = np.abs(self.y) + np.abs(inside.y[-1, 0]) + self.problem.atol
                if np.any((moved > LONGEST_FIRST * seen)[self.view.differential]):
                    raise StepError("the first step is longer than the layer it starts in")
            first, count = 0, len(steps.times) - 1
            while first < count:
                margins = inside.margins[:, first:]  # reductions are fastest along the first axis
                far = self.guards.far(margins, self.active) if self.problem.margins else count - first
                if far:
                    self._accept(steps.since(first), inside.part(first, first + far))
                else:
                    far, fired = 1, self._through(steps.step(first), end, inside.part(first, first + 1))
                    if fired is not None:
                        return fired
                first += far
        return []

    def _through(self, step: DenseStep, end: float, inside: _Inside) -> list[int] | None:
        """Accept a step that may have an event; return the fired margins if the library has to restart, else None."""
        within = step._replace(start=self.t, end=min(step.end, end))
        # Simultaneous zeros differ by the error of the library's polynomial.
        resolution = min(self.problem.rtol, SQRT_EPS) * (within.end - self.t) + ULPS * abs(within.end)
        reached, fired = first_crossing(within, self.guards, self.active, resolution)
        if reached < within.end:
            inside = self._inside(Steps.of([step]), reached)
        if reached == self.end and (self.problem.continued or reached < self.problem.segments[-1]):
            # The next segment cannot tell on which side of zero a kink was.
            fired = sorted({*fired, *self.guards.at_zero(inside.margins[-1, -1], self.active)})
        if fired and self.aim is None and not self._adds_up(inside, MAX_DEFECT)[0]:
            self.aim = reached
            return []
        self._accept(lambda _: step, inside, fired)
        return fired or None

    def _accept(self, step: Callable[[int], DenseStep], inside: _Inside, fired: Sequence[int] = ()) -> None:
        """Move on to the end of these steps, and store their outputs and events."""
        # Copies, since a view would keep all nodes in memory.
        times, y, ydot = inside.times, inside.y[-1].copy(), inside.ydot[-1].copy()
        gains = inside.integral(inside.ledger)
        # Quadrature is the only value of accounts that the library does not integrate.
        relied = np.ones(len(y), bool) if step(0).ledger is None else self._adds_up(inside, NEGLIGIBLE)
        for k in np.flatnonzero(~relied).tolist():
            gains[k] = self._gained(step(k), float(times[k]), float(times[k + 1]), gains[k])
        ledgers = np.cumsum(np.concatenate((self.ledger[None], gains)), axis=0)
        self._write_outputs(step, inside, ledgers, relied)
        if not all(np.all(np.isfinite(rows)) for rows in (y, ydot, ledgers)):
            raise StepError("a state is not finite")
        if self.aim is not None and self.aim <= self.t:
            self.aim = None
        self.t, self.y, self.ydot, self.ledger = float(times[-1]), y[-1], ydot[-1], ledgers[-1]
        self.ledger_rates, self.margins = inside.ledger[-1, -1].copy(), inside.margins[-1, -1].copy()
        self.view.guess = self.y[self.view.algebraic]
        self.count += len(y)
        if self.problem.record_steps:
            self.steps.append((times[1:], y, ydot, ledgers[1:]))
        self.fired += fired
        self.events += [(times[-1:], y[-1:], ydot[-1:], ledgers[-1:])] * len(fired)

    def _write_outputs(
        self, step: Callable[[int], DenseStep], inside: _Inside, ledgers: Array, relied: NDArray[np.bool_]
    ) -> None:
        """Store the outputs within steps, from the ledger at their ends and its rates inside."""
        times, asked = inside.times, self.problem.times[len(self.outputs) :]
        for t in asked[asked <= times[-1]].tolist():
            k = int(np.searchsorted(times[1:], t))
            start, end = times[k : k + 2].tolist()
            state, ledger = inside.y[-1, k], ledgers[k + 1]
            if t < end:
                state, _ = self._state(step(k), t)
                gain = gained_at((t - start) / (end - start), inside.ledger[:, k]) * (end - start)
                ledger = ledgers[k] + (gain if relied[k] else self._gained(step(k), start, t, gain))
            row = np.concatenate((state, ledger))
            if not np.all(np.isfinite(row)):
                raise StepError("an output is not finite")
            self.outputs.append(row)

    def _gained(self, step: DenseStep, start: float, end: float, quadrature: Array) -> Array:
        """Return the change of the ledger over a part of a step as the library integrates it.

        Entropy is integrated by quadrature all the same: the library does not resolve its production.
        """
        assert step.ledger is not None
        return np.where(self.entropic, quadrature, step.ledger(end) - step.ledger(start))

    def _inside(self, steps: Steps, reached: float) -> _Inside:
        """Evaluate the equations at the quadrature points of steps up to a time within the last of them."""
        view = self.view
        ends = np.concatenate(([self.t], steps.times[1:-1], [reached]))
        times = ends[:-1] + np.multiply.outer(NODES[1:], np.diff(ends))
        times[-1] = ends[1:]
        x = y = steps.at_nodes(times)
        if len(view.algebraic) and not self.solver.keeps_algebraic:
            y = np.empty((len(x), len(self.y)))
            y[:, view.free], y[:, view.algebraic] = x, view.guess
        starts, shape = (self.y, self.ydot, self.ledger_rates, self.margins), (len(NODES), len(ends) - 1)
        found = []
        for start, later in zip(starts, view.many(times.ravel(), y), strict=True):
            rows = np.concatenate((start[None], later[-shape[1] : -1], later))  # ends of steps start others
            found.append(rows.reshape(*shape, len(start)))
        return _Inside(ends, *found)

    def _state(self, step: DenseStep, t: float) -> tuple[Array, Array]:
        """Return state and derivatives inside the last step."""
        x = step.y(t)
        if self.solver.keeps_algebraic:
            self.view.guess, x = x[self.view.algebraic], x[self.view.differential]
        return self.view.complete(t, x)

    def _guards(self, t: float, x: Array) -> Array:
        """Return the margins from the library's variables, finding other variables only if margins need them."""
        state = (x, np.zeros_like(x)) if self.plain else self._state(DenseStep(t, t, lambda _: x), t)
        self.view.hold(t, *state, whole=not self.problem.program.plain_margins)
        return self.view.margins()

    def _adds_up(self, inside: _Inside, factor: float) -> NDArray[np.bool_]:
        """Return a mask of steps whose integrated rates equal the increment within ``factor`` tolerances.

        It finds peaks inside a step, which a test at its end alone misses.
        """
        starts, ends = inside.y[0], inside.y[-1]
        missed = np.abs(inside.integral(inside.ydot) - (ends - starts))
        sizes = self.problem.rtol * np.maximum(np.abs(ends), np.abs(starts)) + self.problem.atol
        return np.asarray(np.all((missed <= factor * sizes)[:, self.view.differential], axis=1))

    def result(self, status: Status) -> Result:
        """Return the result of the run under the contract."""
        problem, program = self.problem, self.problem.program
        n, q = program.n, program.n_ledger

        none = np.empty(0), np.empty((0, n)), np.empty((0, n)), np.empty((0, q))

        def points(parts: Sequence[tuple[Array, Array, Array, Array]]) -> list[Array]:
            return [np.concatenate(column) for column in zip(none, *parts, strict=True)]

        outputs = np.array(self.outputs).reshape(-1, n + q)
        return Result(
            problem=problem,
            status=status,
            t=self.t,
            y=self.y,
            ydot=self.ydot,
            ledger=self.ledger,
            margins=self.margins,
            times=problem.times[: len(outputs)],
            outputs=outputs[:, :n],
            ledger_outputs=outputs[:, n:],
            events=Events(*points(self.events), index=np.array(self.fired, dtype=np.int64)),
            counters=Counters(*map(sum, zip(Counters(self.count), *self.told, strict=True))),
            steps=Points(*points(self.steps)) if problem.record_steps else None,
            stepping=self.stepping,
        )
