"""Models and their runs: a system is compiled once and run with any values of its parameters."""

from __future__ import annotations

import math
import operator
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from numbers import Real
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from surfacechem.compile import PREPARATION
from surfacechem.compile.program import (
    Chain,
    ExternalInputs,
    Function,
    Program,
    compile_function,
    compile_program,
    kept,
    key_of,
)
from surfacechem.contracts.terms import Spec
from surfacechem.errors import PATHS, InputError, expect, suggestion
from surfacechem.model.assemble import StartLimits
from surfacechem.model.system import System
from surfacechem.solve import AUTO, CALLING_PYTHON, EXPLICIT, method, solver
from surfacechem.solve import segments as pieces
from surfacechem.solve.contract import Array, Guard, Index, Mask, Problem, Result, Solver, States, Status, among
from surfacechem.solve.diagnose import LED_BACK, are_led_back, closest_margin, termination
from surfacechem.solve.equilibria import NO_BALANCE, Equilibria, Point
from surfacechem.solve.hybrid import Flow, Hybrid, carried, solve_together, with_start, without_stall
from surfacechem.solve.jumps import Jump, Jumper
from surfacechem.solve.radau.solver import consistent, put_rates
from surfacechem.solve.segments import BETWEEN_POINTS, LARGEST_SLACK, Passing
from surfacechem.tolerances import ATOL_OF_SCALE, DEFAULT_RTOL, EPS, FINER_BY, FORMULA_EPS, LINE_ERROR, SQRT_EPS

GROUPS = {"energy supply": 0, "dissipation": 0, "heat": 0, "entropy supply": 1, "entropy production": 1, "bonds": 2}
"""Groups of accounts whose quadrature errors are compared with a common scale."""

CHECKS_PER_RUN, SECOND_RUN_CHECKS = 60.0, 7.3
"""Least number of checks of steps against the equations inside in a run, and the factor for the second run, which must
not miss the same features. Choices: a check costs an evaluation, and 7.3 is not an integer, so that the checks of the
two runs are at different times. Features that both miss last less than 1/438 of the run, as every estimate says.
"""

ROWS_AT_ONCE = 10_000
"""Rows for which named quantities are evaluated together; they take some MB."""

SAMPLED_OUTPUTS = 100
"""Approximate number of outputs from which roundoff is estimated."""

OWN = "radau"
"""Default method."""

COLDER_GUESSES = 0.95 ** np.arange(1, 40)
"""Factors of the first guess of a temperature that are tried if it leads to an unstable one."""

STATE_SPEC, POSITIVE_SPEC = Spec("", "initial value"), Spec("", "initial value", above=0)
"""Ranges of initial values: finite, and positive if the logarithm is the state; margins check the rest."""

RUN_RANGES = {
    "rtol": Spec("1", "", above=0, at_most=math.nextafter(1, 0)),
    "atol": Spec("1", "", at_least=0),
    "accuracy": Spec("1", "", above=0, at_most=1),
    "max_steps": Spec("1", "", at_least=1),
    "max_seconds": Spec("s", "", above=0),
}
"""Ranges of the numbers of a run."""


@dataclass(frozen=True)
class Run:
    """Settings of a run: output times [s], tolerances, method, budgets."""

    times: Sequence[float]
    rtol: float = DEFAULT_RTOL
    atol: float | None = None
    solver: str = OWN
    max_steps: int = 100_000
    max_seconds: float | None = None
    accuracy: float | None = None
    """Requested relative accuracy, if no tolerances were given."""
    picture: float | None = None
    """Largest error of linear interpolation between outputs, which are then chosen by the run, as a part of the range
    of each quantity; None if the outputs are ``times``.
    """
    looks: float = LINE_ERROR
    """Error, as a part of its range, to which each state is known by linear interpolation inside long steps, whatever
    the outputs; 0 if only ends of steps and outputs are stored.
    """
    steady: bool = False
    """True if it ends where nothing changes any more; the times are then those of a run of any length."""
    rest: float | None = None
    """Time at which it comes to rest [s], if that was found before."""
    accounts: bool = True
    """False if nobody asks for the accounts of the ledger; they are left out unless jumps book on them."""
    closer: int = 0
    """Number of looser runs before it in a chain of error estimates: 0 for a run, 1 for its second run."""

    def __post_init__(self) -> None:
        """Check the tolerances, and that output times start at zero, where the initial values hold, and increase."""
        if not isinstance(self.times, tuple) or {*map(type, self.times)} - {int, float}:  # others compare in other ways
            try:
                object.__setattr__(self, "times", tuple(map(float, self.times)))
            except (TypeError, ValueError):
                raise InputError(f"output times are a list of numbers, not {self.times!r}.") from None
        times = self.times
        if len(times) < 2 or times[0] != 0 or not all(map(operator.lt, times, times[1:])) or times[-1] == np.inf:
            raise InputError(
                "output times must start at 0 and increase from each to the next, at least two, all finite."
            )
        for name, spec in RUN_RANGES.items():
            if (value := getattr(self, name)) is not None or getattr(Run, name) is not None:
                expect(value, Real, f"{name} is a number")
                spec.check(name, value)

    @cached_property
    def moments(self) -> Array:
        """Output times [s]."""
        return np.asarray(self.times, dtype=float)

    @property
    def samples(self) -> float:
        """Number of parts of the run in each of which steps are checked at least once against the equations inside."""
        return CHECKS_PER_RUN * SECOND_RUN_CHECKS**self.closer

    def second(self, rtol: float, **others: Any) -> Run:
        """Return the run that estimates the error of this one.

        It has another relative tolerance, an absolute one in proportion, and more checks inside steps, at other times.
        The last digits of loads are perturbed, and load segments are cut in two, as steps fill short ones at any
        tolerance. Explicit steps are compared with implicit ones, which do not miss the same features.

        Parameters
        ----------
        rtol
            The other relative tolerance.
        others
            Further differences.

        Returns
        -------
        Run
            The same run with these differences.
        """
        atol = None if self.atol is None else self.atol * rtol / self.rtol
        used = OWN if self.solver == EXPLICIT else self.solver
        steps = 2 * self.max_steps
        return replace(self, rtol=rtol, atol=atol, solver=used, max_steps=steps, closer=self.closer + 1, **others)


class Discontinuities(NamedTuple):
    """Moments at which quantities may jump, by run and in order of time: jumps, and breakpoints of loads."""

    owner: Index
    """The run of each."""
    t: Array
    before: dict[str, Array]
    """States and named quantities right before."""
    after: dict[str, Array]
    """The same right after."""
    last: Mask
    """Mask of the last one at each time."""

    @classmethod
    def of(cls, model: Model, owner: Index, before: Array, after: Array) -> Discontinuities:
        """Return the discontinuities of runs of a model from inputs on both sides, a row each."""
        order, n = np.lexsort((before[:, 0], owner)), len(model.system.states)
        owner, before, after = owner[order], before[order], after[order]
        t, y, ydot = before[:, 0], slice(1, 1 + n), slice(1 + n, 1 + 2 * n)
        if len(t):  # rates and algebraic variables are still those from before
            found = consistent(model.program, t, after[:, y], 0.0, after[:, 1 + 2 * n :])
            after[found.valid, y], after[found.valid, ydot] = found.y[found.valid], found.ydot[found.valid]
        names = model.system.variable_names
        sides = [np.hstack((rows[:, y], model.named(rows.copy()))).T for rows in (before, after)]
        last = (np.diff(owner, append=-1) != 0) | (np.diff(t, append=np.inf) > 0)
        return cls(owner, t, dict(zip(names, sides[0], strict=True)), dict(zip(names, sides[1], strict=True)), last)


@dataclass(frozen=True)
class Trajectory:
    """A solved run: the solver's result, the values it ran with, its end in words and its run time [s]."""

    model: Model
    run: Run
    result: Result
    values: Mapping[str, float]
    status: str
    reason: str
    seconds: float
    jumps: tuple[Jump, ...] = ()

    def __repr__(self) -> str:
        """Return states, steps and end in a line."""
        states = ", ".join(state.name for state in self.model.system.states)
        return f"<Trajectory of {states}: {self.result.counters.steps} steps, {self.status}, {self.reason}>"

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Restore the machine code of the problem from the model, which has compiled it again."""
        problem = replace(state["result"].problem, program=state["model"].program)
        vars(self).update(state, result=state["result"]._replace(problem=problem))

    def at(self, rows: States) -> Trajectory:
        """Return the trajectory with these states as outputs."""
        t, y, ledger, segment = rows
        result = self.result._replace(times=t, outputs=y, ledger_outputs=ledger, segment=segment)
        found = replace(self, result=result)
        vars(found).update({name: known for name, known in vars(self).items() if name == "_at_steps"})
        return found

    def at_times(self, times: Sequence[float] | Array) -> Trajectory:
        """Return the trajectory with only the outputs at these times, which increase."""
        wanted = np.asarray(times)
        found = self.picked(among(self.result.times, wanted))
        vars(found).update(run=replace(self.run, times=tuple(wanted.tolist())))
        return found

    @property
    def written(self) -> States:
        """States, ledgers and segments at the outputs."""
        result = self.result
        segment = result.segments_at(result.times, result.segment)
        return States(result.times, result.outputs, result.ledger_outputs, segment)

    def picked(self, rows: Index | Mask | slice) -> Trajectory:
        """Return the trajectory with some of its outputs; what is known of them is not evaluated again."""
        found, known = self.at(self.written.picked(rows)), vars(self)
        vars(found).update({name: known[name][rows] for name in ("_inputs", "outputs", "rates") if name in known})
        return found

    def with_more(self, rows: Sequence[States]) -> Trajectory:
        """Return the trajectory with further outputs, in order of time; those it has are not evaluated again."""
        more = self.at(States(*map(np.concatenate, zip(*rows, strict=True))))
        every = States(*map(np.concatenate, zip(self.written, *rows, strict=True)))
        order = np.argsort(every.t, kind="stable")
        found = self.at(every.picked(order))
        vars(found)["_inputs"] = np.concatenate((self._inputs, more._inputs))[order]
        vars(found)["outputs"] = np.concatenate((self.outputs, more.outputs))[order]
        return found

    def _blocks(self) -> Iterator[Trajectory]:
        """Yield the trajectory, in blocks of outputs if these are many."""
        count = len(self.result.times)
        if count <= ROWS_AT_ONCE:
            yield self
        else:
            rows, firsts = self.written, range(0, count, ROWS_AT_ONCE)
            yield from (self.at(rows.picked(slice(first, first + ROWS_AT_ONCE))) for first in firsts)

    @property
    def sample(self) -> Trajectory:
        """The trajectory with a sample of its outputs, enough to estimate roundoff."""
        count = len(self.result.times)
        return self.picked(np.arange(0, count, max(count // SAMPLED_OUTPUTS, 1)))

    @cached_property
    def known(self) -> States:
        """All stored states, in order of time."""
        return self.result.known or self.result.states()

    @cached_property
    def stored(self) -> Trajectory:
        """The trajectory with outputs at which runs are compared, whatever outputs were requested.

        They are the ends of its steps and the stored states inside them; the requested outputs are included if no
        states inside are stored.
        """
        result, rows = self.result, self.known
        t = np.minimum(rows.t, self.run.times[-1])  # the last step may end beyond it by rounding
        kept = np.append(True, t[1:] > t[:-1])  # of the two sides of a moment keep the first, as an output does
        if (result.known or result.inside) is not None and result.steps is not None:
            kept &= among(rows.t, result.steps.t) | ~among(rows.t, result.times)
        rows = rows._replace(t=t)
        return self.at(rows if kept.all() else rows.picked(kept.nonzero()[0]))

    @cached_property
    def _inputs(self) -> Array:
        """Arguments of compiled functions at the output times."""
        result, y = self.result, self.result.outputs
        rows = self.model.inputs(result, result.times, y, y, result.segment)  # in place of the rates, put next
        put_rates(self.model.program, rows)
        return rows

    @cached_property
    def rates(self) -> Array:
        """Time derivatives of the states at the output times, shape (times, states).

        Those of algebraic states, which no equation gives, are difference quotients; zero at t = 0.
        """
        program, n, rows, y = self.model.program, self.model.program.n, self._inputs, self.result.outputs
        t, rates = rows[:, :1], rows[:, 1 + n : 1 + 2 * n]
        algebraic = program.algebraic_mask & (t > 0)
        if algebraic.any():
            passed = SQRT_EPS * t
            later = consistent(program, (t + passed)[:, 0], y + passed * rates, 0.0, rows[:, 1 + 2 * n :])
            rates = np.divide(later.y - y, passed, out=rates.copy(), where=algebraic & later.valid[:, None])
        return rates

    @cached_property
    def roundings(self) -> dict[str, float]:
        """Largest change of each named quantity by one rounding of a state."""
        found = [block.sensitivities(EPS * block.result.outputs) for block in self._blocks()]
        return dict(zip(self.model.system.output_columns, np.fmax.reduce(found), strict=True))

    def sensitivities(self, changes: Array) -> Array:
        """Return the largest change of each named quantity by ``changes`` of one state, shape (times, states)."""
        model, system, times = self.model, self.model.system, self.result.times
        # Of the states inside bodies only the first enters a flux; the others are not named.
        own = [system.state_columns[name] for name in system.own_states]
        together = max(1, ROWS_AT_ONCE // max(len(times), 1))
        worst = np.zeros(self.outputs.shape[1])
        for chunk in (own[first : first + together] for first in range(0, len(own), together)):
            rows = np.array([self._inputs] * len(chunk))
            for perturbed, j in zip(rows, chunk, strict=True):
                perturbed[:, 1 + j] += changes[:, j]
            apart = model.named(rows.reshape(-1, rows.shape[-1])).reshape(len(chunk), *self.outputs.shape)
            with np.errstate(invalid="ignore"):  # quantities may be infinite
                np.abs(np.subtract(apart, self.outputs, out=apart), out=apart)
                worst = np.fmax(worst, np.fmax.reduce(apart.max(axis=1, initial=0.0)))
        return worst

    def everywhere(self, name: str) -> Array:
        """Return a state or a named quantity at the output times and at every step; empty if the name is unknown."""
        return np.concatenate(self.column(name) or [np.empty(0)])

    def column(self, name: str) -> list[Array]:
        """Return a state or a named quantity at the output times, and at every step if any is recorded; empty if the
        name is unknown.
        """
        j = self.model.system.variable_columns.get(name)
        return [] if j is None else [table[:, j] for table in self.tables]

    @cached_property
    def tables(self) -> list[Array]:
        """States and named quantities at the output times, and at every step if any is recorded, each of shape
        (times, variables).
        """
        return [np.concatenate((self.result.outputs, self.outputs), axis=1), *self._at_steps]

    @cached_property
    def ranges(self) -> dict[str, tuple[float, float]]:
        """Least and largest value of each state and named quantity over outputs and steps; empty without any."""
        every = np.concatenate(self.tables)
        ends = zip(every.min(axis=0).tolist(), every.max(axis=0).tolist(), strict=True) if len(every) else ()
        return dict(zip(self.model.system.variable_columns, ends, strict=False))

    @cached_property
    def _at_steps(self) -> list[Array]:
        """Variables at every step, which do not depend on the outputs."""
        if (steps := self.result.steps) is None or not len(steps.t):
            return []
        named = self.model.evaluate(self.result, steps.t, steps.y, steps.ydot, steps.segment)
        return [np.concatenate((steps.y, named), axis=1)]

    @cached_property
    def discontinuities(self) -> Discontinuities:
        """Jumps from which the run goes on, and the breakpoints of loads, apart from jumps, that it has passed."""
        model, result, steps = self.model, self.result, self.result.steps
        sides = [(jump.before.inputs(), jump.after.inputs()) for jump in self.jumps if not jump.stops]
        before, after = np.array(sides).reshape(-1, 2, model.program.n_inputs).swapaxes(0, 1)
        if steps is not None:
            at = among(steps.t, result.problem.segments[1:-1]) & (steps.t < result.t)
            at &= ~among(steps.t, np.array([jump.t for jump in self.jumps]))
            known, segment = (steps.t[at], steps.y[at], steps.ydot[at]), result.segments_at(steps.t[at])
            before = np.concatenate((before, model.inputs(result, *known, segment)))
            after = np.concatenate((after, model.inputs(result, *known, segment + 1)))
        return Discontinuities.of(model, np.zeros(len(before), np.int64), before, after)

    @property
    def within_bounds(self) -> Trajectory:
        """The trajectory with bonding states that roundoff has made negative set to zero."""
        return self._brought_back or self

    @cached_property
    def _brought_back(self) -> Trajectory | None:
        """The same; None where nothing is negative: kept in itself, a trajectory would outlive its last use."""
        result, steps, least = self.result, self.result.steps, self.model.system.least_states
        if (result.outputs >= least).all() and (steps is None or (steps.y >= least).all()):
            return None
        steps = steps and replace(steps, y=np.maximum(steps.y, least))
        return replace(self, result=result._replace(outputs=np.maximum(result.outputs, least), steps=steps))

    @cached_property
    def quantities(self) -> Array:
        """States, accounts and named quantities at the output times, shape (quantities, times)."""
        return np.concatenate((self.result.outputs.T, self.result.ledger_outputs.T, self.outputs.T))

    @cached_property
    def outputs(self) -> Array:
        """Named quantities at the output times, shape (times, outputs)."""
        if len(self.result.times) > ROWS_AT_ONCE:
            return np.concatenate([block.outputs for block in self._blocks()])
        return self.model.named(self._inputs.copy() if self.model.program.external else self._inputs)


def values_of(system: System, changes: Mapping[str, float] | None = None) -> dict[str, float]:
    """Return every parameter and initial value by path, with some of them changed."""
    values = system.given_values.copy()
    if not changes:
        return values
    above_zero = {s.path for s in system.states if s.is_temperature or (s.given and not s.given.state)}
    specs = {s.path: POSITIVE_SPEC if s.path in above_zero else STATE_SPEC for s in system.states}
    specs |= {parameter.path: parameter.spec for parameter in system.parameters}
    known = system.changeable
    for path, value in changes.items():
        if path not in known:
            raise InputError(f"no parameter '{path}' to change.{suggestion(path, known, PATHS)}")
        specs[path].check(path, float(value))
        values[path] = float(value)
    return values


def refuse_static(system: System, case: str = "CASE") -> None:
    """Raise InputError if nothing in a scene changes."""
    if system.is_static:
        command = f"`surfacechem evaluate {case}` gives its quantities"
        remedy = f"Let a temperature or bonds evolve, or a history change; {command}."
        raise InputError(f"there is nothing to solve: everything is prescribed. {remedy}", path="bodies")


def stable_guess(system: System, program: Program, y: Array, parameters: Array) -> Array:
    """Return first guesses that lead to a stable state; the given ones if they do or if none does.

    Heat production that grows with temperature can balance the losses twice: in a stable state, and at a higher
    temperature in one from which any perturbation leads to ignition or cooling.
    """
    guessed = guessed_temperatures(system)
    if not guessed.any():
        return y
    if not are_stable(system, program, y[None], parameters)[0]:
        tried = np.array([np.where(guessed, part * y, y) for part in COLDER_GUESSES])
        stable = are_stable(system, program, tried, parameters)
        y = tried[int(stable.argmax())] if stable.any() else y
    found = consistent(program, 0.0, y, np.zeros_like(y), parameters)
    if found.valid and np.any(found.y[guessed] <= 0):
        names = " and ".join(state.name for state, is_one in zip(system.states, guessed, strict=True) if is_one)
        raise InputError(
            f"at the start the interface takes up more heat than any temperature {names} above zero brings it.",
            path="interface",
        )
    return y


def guessed_temperatures(system: System) -> Mask:
    """Return the mask of states that are temperatures without capacity, of which starts give first guesses."""
    return np.array([state.algebraic and state.is_temperature for state in system.states], dtype=bool)


def are_stable(system: System, program: Program, y: Array, parameters: Array) -> Mask:
    """Return a mask of the first guesses [run, state] that lead to states in which all stability limits are positive;
    parameters are one vector or one for each run.
    """
    active = system.active_guards(np.atleast_2d(parameters)[0])
    checks = [i for i, m in enumerate(system.event_margins) if m.stability and active[i]]
    if not checks or program.margins is None:
        return np.ones(len(y), dtype=bool)
    found = consistent(program, 0.0, y, np.zeros_like(y), parameters)
    parameters = np.broadcast_to(parameters, (len(y), parameters.shape[-1]))
    rows = np.concatenate([np.zeros((len(y), 1)), found.y, found.ydot, parameters], axis=1)
    return np.asarray(found.valid & np.all(np.atleast_2d(program.margins(rows))[:, checks] > 0, axis=1))


def _external_inputs(system: System) -> ExternalInputs | None:
    """Return the rates that an engine outside the equations gives, with the compiled expressions that it reads."""
    outside = system.external_rates
    if outside is None:
        return None
    first, columns = 1 + 2 * len(system.states), system.parameter_columns
    positions = np.array([first + columns[path] for path in outside.engine.gives], dtype=np.int64)
    reads = compile_function(system.inputs, [system.expand(expression) for expression in outside.reads])
    return ExternalInputs(reads, positions, outside.engine)


class Model:
    """A system with its machine code, compiled when it is built."""

    def __init__(self, system: System) -> None:
        refuse_static(system)
        system = system.with_dummy_state()
        start = time.perf_counter()
        n, inputs = len(system.states), system.inputs
        self.system, self._sizes = system, np.array([state.size for state in system.states])
        self.margins = system.event_margins
        """Margins that can close during the run; the others are checked at the start only."""
        names, formed = [item.symbol for item in system.named], [item.expression for item in system.named]
        local = system.local_time(formed)
        program = compile_program(
            system.t,
            inputs[1 : n + 1],
            inputs[n + 1 : 2 * n + 1],
            inputs[2 * n + 1 :],
            system.local_time(list(system.rows.values())),
            system.local_time([account.rate for account in system.ledger]),
            system.local_time([m.expression for m in self.margins] + [edge.guard for edge in system.edges]),
            chains=[Chain(*chain) for chain in system.chains],
            named=list(zip(names, local, strict=True)),
            keeps=system.origin is not None,
        )
        self.program = replace(
            program,
            external=_external_inputs(system),
            groups=tuple(GROUPS.get(account.kind, -1) for account in system.ledger),
        )
        self.jumper = Jumper(system) if system.has_arcs else None
        # The program's key has the inputs, and the expressions that are the same in both times.
        own = [each for each, other in zip(formed, local, strict=True) if each is not other]
        key = program.key and key_of(own, program.key, [item.name for item in system.outputs])
        self.output_function: Function = kept(self._compiled_outputs, key)
        self.compile_seconds = time.perf_counter() - start
        """Time to compile the equations, and the functions first needed in a run: gaps, guards and jumps."""

    def _compiled_outputs(self) -> Function:
        """Compile the outputs."""
        system = self.system
        outputs = [system.expand(item.expression) for item in system.outputs]
        return compile_function(system.inputs, outputs, system.cell_symbols)

    def __reduce__(self) -> tuple[type[Model], tuple[System]]:
        """Pickle the system only; its machine code is compiled again."""
        return type(self), (self.system,)

    def values(self, changes: Mapping[str, float] | None = None) -> dict[str, float]:
        """Return every parameter and initial value by path, in SI, with some of them changed.

        Parameters
        ----------
        changes
            Values that differ from those of the scene, by path, in SI.

        Returns
        -------
        dict
            Values by path: those that a run may change.

        Raises
        ------
        InputError
            If there is no parameter of a path, or a value is outside its range.
        """
        return values_of(self.system, changes)

    @cached_property
    def equilibria(self) -> Equilibria:
        """The quasi-static gaps and their compiled functions; one a model."""
        return self.jumper.equilibria if self.jumper else Equilibria(self.system)

    @cached_property
    def passing(self) -> Passing:
        """Search for the times at which prescribed variables pass narrow features."""
        return Passing(self.system)

    @cached_property
    def starts(self) -> tuple[list[int], Function]:
        """Columns of the modes that follow from the initial state, and the function for their values."""
        return pieces.mode_starts(self.system)

    def problem(self, run: Run, values: Mapping[str, float], *, passing: bool = True) -> Problem:
        """Return the initial value problem; raise InputError if the initial state is not admissible.

        ``passing`` also ends segments where prescribed variables pass narrow features.
        """
        system, end = self.system, run.times[-1]
        segments = pieces.segments(system, end, values)
        parameters = pieces.segment_parameters(system, segments, run.rtol, values)
        if passing:
            segments, parameters = self.passing.pieces(segments, parameters, values, run.max_steps)
        for _ in range(run.closer):
            segments, parameters = pieces.cut(segments, parameters)
        y = system.initial_state(values)
        columns, begun = self.starts
        if columns:
            parameters[:, columns] = begun(np.concatenate([[0.0], y, np.zeros_like(y), parameters[0]]))
        pieces.start_registers(system, parameters, values)
        self._limits.check(y, parameters[0])
        if run.closer % 2:  # where a result depends on the last digits, two runs of the same numbers would agree
            pieces.perturb_histories(system, parameters)
        if system.equilibria:
            y, parameters = self._equilibrated(y, parameters)
        start = stable_guess(system, self.program, y, parameters[0])
        if system.equilibria:  # given gaps are first guesses only; those found must be admissible too
            self._limits.check(start, parameters[0])
        atol = self._sizes * (run.atol if run.atol is not None else ATOL_OF_SCALE * run.rtol)
        least = np.zeros(self.program.n_margins)
        # The sign of a state below its tolerance is unknown, as that of a margin below its roundoff.
        least[self._peaks[0]] = atol[self._peaks[1]] / FORMULA_EPS
        return Problem(
            program=self.program if run.accounts or self.jumper else self._without_accounts,
            y0=start,
            times=run.moments,
            segments=segments,
            parameters=parameters,
            rtol=run.rtol,
            atol=atol,
            margins=self._guards,
            margin_peaks=least,
            max_steps=run.max_steps,
            max_seconds=run.max_seconds,
            record_steps=True,
            line_error=(run.picture or run.looks) / FINER_BY,
            spacing=end / run.samples,
            active=system.active_guards(parameters[0]),
        )

    def _equilibrated(self, y: Array, parameters: Array) -> tuple[Array, Array]:
        """Return the states with gaps in equilibrium, and all segments' parameters with the modes found there."""
        settled = self.equilibria.equilibrate(Point(0.0, y, np.zeros_like(y), parameters[0].copy()))
        if settled is None:
            raise InputError(f"{NO_BALANCE}.", path="mechanics")
        return settled.y, np.where(settled.parameters != parameters[0], settled.parameters, parameters)

    @cached_property
    def _limits(self) -> StartLimits:
        return StartLimits(self.system)

    @cached_property
    def _without_accounts(self) -> Program:
        return replace(self.program, ledger=None, n_ledger=0, groups=())

    @cached_property
    def _peaks(self) -> Index:
        """Margins at whose zeros only steps end and that are states, and these states."""
        columns = {state.symbol: j for j, state in enumerate(self.system.states)}
        found = [(i, columns[m.expression]) for i, m in enumerate(self.margins) if m.peak and m.expression in columns]
        return np.array(found, int).reshape(-1, 2).T

    @cached_property
    def _guards(self) -> tuple[Guard, ...]:
        """Event types of the limits, followed by those of the guards of edges."""
        limits = (
            Guard(terminal=True, domain=m.domain) if m.terminal else Guard(terminal=False, direction=0, smooth=m.peak)
            for m in self.margins
        )
        return (*limits, *(Guard(terminal=True, strict=edge.strict) for edge in self.system.edges))

    def solve(self, run: Run, changes: Mapping[str, float] | None = None) -> Trajectory:
        """Run the model.

        Parameters
        ----------
        run
            Output times, solver, tolerances.
        changes
            Values that differ from those of the scene, by path, in SI.

        Returns
        -------
        Trajectory
            Its end is a status with a reason, never an exception, once the input was admissible.

        Raises
        ------
        InputError
            If there is no parameter of a path, or the start is not admissible.
        """
        return self.solve_values(run, self.values(changes))

    def chosen(self, run: Run, values: Mapping[str, float]) -> Run:
        """Return the run with a method: the given one, or the one chosen for the scene with these values."""
        if run.solver != AUTO:
            return run
        try:
            return self._with_method(run, self.problem(run, values))
        except InputError:  # the run raises it again
            return replace(run, solver=OWN)

    def _with_method(self, run: Run, problem: Problem) -> Run:
        return replace(run, solver=method(problem, self.system.has_moving_gap)[0]) if run.solver == AUTO else run

    def solve_values(self, run: Run, values: Mapping[str, float]) -> Trajectory:
        """Run with every value given, without a check of parameter ranges."""
        return self.solve_all([(run, values)])[0]

    def solve_all(self, runs: Sequence[tuple[Run, Mapping[str, float]]], threads: int = 1) -> list[Trajectory]:
        """Solve runs that differ in values and output times, together in the compiled loop."""
        before = PREPARATION.seconds
        problems = [self.problem(*pair) for pair in runs]
        run = self._with_method(runs[0][0], problems[0])
        used = solver(run.solver)
        if self.program.external is not None and run.solver not in CALLING_PYTHON:
            raise InputError(
                f"rates of the mechanism come from Cantera itself, which the solver {run.solver} cannot ask. Use "
                f"`solver: {CALLING_PYTHON[0]}` under `run`.",
                path="run.solver",
            )
        used.prepare()
        self.compile_seconds += PREPARATION.seconds - before
        first = runs[0][0]  # often the settings of all

        def settled(each: Run) -> Run:
            return run if each is first else each if each.solver == run.solver else replace(each, solver=run.solver)

        items = [(settled(each), values, problem) for (each, values), problem in zip(runs, problems, strict=True)]
        # A limit in seconds applies to each run alone.
        groups = [[item] for item in items] if run.max_seconds else [items]
        return [done for group in groups for done in self._solve_together(used, group, threads)]

    def _solve_together(
        self, used: Solver, items: Sequence[tuple[Run, Mapping[str, float], Problem]], threads: int
    ) -> list[Trajectory]:
        """Solve runs whose arcs go into common batches; each counts an equal part of the run time."""
        start, prepared = time.perf_counter(), PREPARATION.seconds
        ends = solve_together([self._flow(problem, used.crosses_edges) for _, _, problem in items], used, threads)
        compiling = PREPARATION.seconds - prepared
        seconds = (time.perf_counter() - start - compiling) / len(items)
        self.compile_seconds += compiling
        done = []
        for (run, values, problem), (result, jumps, ended) in zip(items, ends, strict=True):
            status, reason = ended or self.verdict(run, result, values)
            done.append(Trajectory(self, run, with_start(problem, result), values, status, reason, seconds, jumps))
        return done

    def _flow(self, problem: Problem, crosses: bool) -> Flow[tuple[Result, tuple[Jump, ...], tuple[str, str] | None]]:
        """Return a run as a flow: its result, its jumps, and how it ended if a jump ended it.

        ``crosses`` is True if the method can carry out edges by itself.
        """
        if self.jumper is None:
            return (yield from without_stall(problem, self.system.slip_velocities)), (), None
        crosses = crosses and not self.system.solves_jumps and self.program.external is None
        told = (yield from carried(problem, self.jumper)) if crosses else None
        if told is None:
            hybrid = Hybrid(self.jumper, problem)
            told = (yield from hybrid.run()), hybrid.instant.jumps, hybrid.instant.reason
        result, jumps, reason = told
        word = "failed" if result.status is Status.FAILED else "stopped"
        return result, tuple(jumps), (word, f"{reason} at t = {result.t:.9g} s") if reason else None

    def verdict(self, run: Run, result: Result, values: Mapping[str, float]) -> tuple[str, str]:
        """Return the outcome of a run and its reason, in words."""
        where = f"t = {result.t:.9g} s"
        if result.status is Status.FINISHED:
            rest = "" if run.rest is None else f"came to rest at t = {run.rest:.9g} s, a steady state"
            return "finished", rest or f"reached the end at {where}"
        if result.status is Status.EVENT:
            index, at, y = int(result.events.index[-1]), np.array([result.t]), result.y[None]
            margin = self.margins[index]
            if result.margins[index] > 0:  # it has passed zero by a jump, at the pole where another one ends
                margin = closest_margin(self.system, self.program, self.margins, result) or margin
            inputs = self.inputs(result, at, y, result.ydot[None])
            if are_led_back(self.system, self.program, margin, at, y, inputs[:, 1 + 2 * len(result.y) :])[0]:
                return "failed", f"{margin.reason} at {where}: {LED_BACK[BETWEEN_POINTS * run.rtol > LARGEST_SLACK]}"
            return "stopped", f"{self.system.reason(margin, inputs[0])} at {where}"
        return termination(self.system, self.program, self.margins, result, values, self.named)

    def evaluate(
        self, result: Result, t: Array, y: Array, ydot: Array, segment: NDArray[np.int64] | None = None
    ) -> Array:
        """Evaluate named quantities along a trajectory.

        Parameters
        ----------
        result, t, y, ydot
            A result, and times [s], states and their rates along it, shapes (n,), (n, states), (n, states).
        segment
            Number of the segment between breakpoints of each time; determined from the times if not given.

        Returns
        -------
        ndarray
            Shape (n, outputs).
        """
        return self.named(self.inputs(result, t, y, ydot, segment))

    def named(self, inputs: Array) -> Array:
        """Return named quantities at arguments of compiled functions, which are filled in place."""
        if not len(inputs):
            return np.empty((0, self.output_function.n_out))
        return self.output_function(self.program.filled(inputs))

    def inputs(
        self, result: Result, t: Array, y: Array, ydot: Array, segment: NDArray[np.int64] | None = None
    ) -> Array:
        """Return the arguments of compiled functions along a trajectory."""
        n, parameters = self.program.n, result.problem.parameters
        rows = np.empty((len(t), self.program.n_inputs))
        rows[:, 0], rows[:, 1 : 1 + n], rows[:, 1 + n : 1 + 2 * n] = t, y, ydot
        rows[:, 1 + 2 * n :] = parameters if len(parameters) == 1 else parameters[result.segments_at(t, segment)]
        return rows
