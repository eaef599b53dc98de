"""Batches of runs of one model as arrays: from columns of values through the compiled loop to columns of results.

No object is made per run. Runs that arrays leave open (an inadmissible start, an edge that is due at the start, a run
that could not go on) are solved one by one.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from surfacechem.compile.program import Function, compile_function
from surfacechem.errors import InputError
from surfacechem.expressions import certain, derivative
from surfacechem.format.plans import Plan
from surfacechem.model.system import System
from surfacechem.results.audit import LAST_DIGITS, residuals, resolved
from surfacechem.results.store import CHUNK_BYTES
from surfacechem.runs import spectrum
from surfacechem.runs.keeping import REACHES, STATUSES, Columns, Keep, begins, crossed, reason_table, variable
from surfacechem.solve import EXPLICIT, IMPLICIT
from surfacechem.solve.contract import Array, Index, Mask, Problem, Status
from surfacechem.solve.diagnose import are_led_back
from surfacechem.solve.lanes.lane_batch import solve_batch
from surfacechem.solve.radau.solver import Room, consistent, peaks_before, put_rates, solve_arrays
from surfacechem.solve.radau.stepper import ARCS, END, EVENTS, FIRST_COUNTER, JUMPS, OUTPUTS, RECORDS
from surfacechem.solve.run import Discontinuities, Model, Run, are_stable, guessed_temperatures
from surfacechem.tolerances import EPS, GUARD_EPS, MICROMETRE, MIN_RTOL, PICOMETRE

MOST_ROWS = 4096, 1024
"""Largest numbers of steps and events of a run for which memory is allocated; a run with more is solved by itself."""

PILOT_RUNS, USUAL_STEPS = 16, 100
"""Runs from which the numbers of steps and events of the others are estimated, and the number of steps before."""

FIRST_RUNS = 100
"""Runs of a plan among which an admissible one is searched for, whose problem the others share."""


LARGEST_FREED = 31 * 2**20
"""Size of a freed block [bytes] that the C library of Linux takes as the largest of usual ones; at most 32 MB."""

Values = tuple[Array, dict[str, Array]]
"""States and named quantities at rows of arguments: the table of all of them, and its columns by name."""


@dataclass(frozen=True)
class Ends:
    """Result of a batch of runs, with the parameters, the starts of the segments and the output times of each."""

    batch: Any
    table: Array
    """Parameters, shape (runs, segments, parameters)."""
    segments: Array
    times: Array

    @cached_property
    def last(self) -> Array:
        """The arguments of compiled functions at the ends of the runs."""
        n, end = self.batch.y0.shape[1], self.batch.ends
        return self.inputs(np.arange(len(end)), end[:, 0], end[:, 1 : 1 + n], end[:, 1 + n : 1 + 2 * n])

    def inputs(self, owner: Index, t: Array, y: Array, ydot: Array, after: bool = False) -> Array:
        """Return the arguments of compiled functions at points of the runs ``owner``; ``after`` means behind
        breakpoints.
        """
        segment: Any = 0
        if self.segments.shape[1] > 2:
            breaks = self.segments[np.minimum(owner, len(self.segments) - 1), 1:-1]
            segment = (t[:, None] >= breaks if after else t[:, None] > breaks).sum(axis=1)
        count, width = self.table.shape[1:]
        parameters = self.table.reshape(-1, width).take(owner * count + segment, axis=0)
        return np.concatenate([t[:, None], y, ydot, parameters], axis=1)


def is_array(model: Model, plan: Plan, run: Run, problem: Problem) -> bool:
    """True if the runs of a plan differ only in values of states and parameters, so that arrays can solve them."""
    system = model.system
    # A load that ends the runs must be one ramp without breakpoints.
    jumps = system.solves_jumps or (plan.load and len(problem.segments) > 2)
    plain = run.max_seconds is None and not run.steady and model.program.external is None
    own = plain and run.solver in (IMPLICIT, EXPLICIT) and not set(plan.paths) & set(system.cycles)
    return own and not jumps and _starts_as_given(system, set(plan.paths))


def passes_alike(model: Model, plan: Plan) -> bool:
    """True if prescribed variables pass narrow features at the same times in all runs of a plan, or pass none."""
    return model.passing.function is None or not (plan.load or model.passing.reads & set(plan.paths))


def cannot_jump(model: Model, problem: Problem) -> bool:
    """True if no run can jump: each has one arc, and all begin in the same modes, whatever their values are."""
    one_arc = model.jumper is None or len(problem.segments) == 2
    return one_arc and all(mode.start is None for mode in model.system.modes)


def of_each(best: np.ufunc, owner: Index, table: Array, count: int) -> Array:
    """Reduce the rows [rows, columns] of each of ``count`` runs by ``best``; ``owner`` gives the run of each row, in
    ascending order. NaN for a run without rows.
    """
    found = np.full((count, table.shape[1]), np.nan)
    runs, first = np.unique(owner, return_index=True)
    if len(runs):
        found[runs] = best.reduceat(table, first, axis=0)
    return found


def all_above(table: Array, least: float, columns: Sequence[int] | Index) -> Mask:
    """Return the mask of rows whose entries in some columns are above a number.

    Column by column: NumPy takes several times as long to reduce rows of a few entries.
    """
    found = np.ones(len(table), dtype=bool)
    for j in columns:
        found &= table[:, j] > least
    return found


def keep_memory() -> None:
    """Make the C library keep the memory of arrays that are freed, for those of the next runs.

    Else it returns that of large ones to the system, which clears each page anew before it is written to again; that
    takes longer than the arithmetic. What counts as large follows from the largest block that was ever freed. No page
    of this one is written to, so that it takes no memory.

    Source: mallopt(3), M_MMAP_THRESHOLD.
    """
    np.empty(LARGEST_FREED, np.uint8)


def _starts_as_given(system: System, swept: set[str]) -> bool:
    """True if states start at given values or their logarithms, or are found from them, and no register is."""
    made = [state for state in system.states if state.given is not None and state.given.state and state.path in swept]
    registers = [register for register in system.registers if register.given is not None]
    return not (made or registers)


class ArrayRuns:
    """Runs of a plan that can be solved as arrays, see :func:`is_array`."""

    jumps = False
    """True if runs go on after their jumps."""
    room: Room | None = None
    """Table sizes of a run, of steps and events among others, as large as earlier runs needed; None for the usual."""
    most_steps = USUAL_STEPS
    """Largest number of steps of earlier runs, where steps are kept."""

    def __init__(
        self, model: Model, plan: Plan, run: Run, changes: Mapping[str, float], keep: Keep, automatic: bool
    ) -> None:
        """Prepare the runs; ``automatic`` is True if their solver was chosen for them. One that is named gives the
        results of single runs, to the last bit.
        """
        keep_memory()
        self.model, self.plan, self.run, self.keep = model, plan, run, keep
        self.values = model.values(changes)
        # Implicit steps in lanes are for stiffness, of all runs or of those that turn stiff; the other reasons for
        # implicit steps ask for single runs.
        stiff = automatic and run.rtol > MIN_RTOL and not model.system.has_moving_gap
        self.passes_alike = passes_alike(model, plan)
        self.problem = replace(self._first_problem(changes), explicit=run.solver == EXPLICIT, implicit_lanes=stiff)
        system = model.system
        self.n = len(system.states)
        columns = system.parameter_columns
        self.parameter_columns = {path: columns[path] for path in plan.paths if path in columns}
        self.first_row = np.concatenate(
            [[0.0], system.initial_state(self.values), np.zeros(self.n), self.problem.parameters[0]]
        )
        """Arguments of compiled functions at the start of a run of the case."""
        self.state_columns = [(j, state) for j, state in enumerate(system.states) if state.path in plan.paths]
        self.reasons = reason_table(system)
        self.keeps_extremes = bool(keep.max or keep.min)
        self.breaks = self.problem.segments[1:-1]
        self.keeps_steps = self.keeps_extremes or bool(keep.reach and len(self.breaks))
        self.impacts = [len(model.margins) + j for j, edge in enumerate(system.edges) if edge.is_impact]
        """Columns of the guards of impacts."""
        self.no_peaks = peaks_before(self.problem)[None]
        """Largest accounts and guards before any evaluation."""
        times = self.problem.times
        ends = 2 * max(keep.balances, bool(keep.reach))
        self.shape = times if self.keeps_extremes or keep.series else times[[0, -1]][:ends]
        """Output times of a run of the case: all, or the first and the last, or none."""
        self.keeps_course = bool(len(self.shape))
        """True if more is kept than ends and events."""

    def _first_problem(self, changes: Mapping[str, float]) -> Problem:
        """Return the problem of the first admissible run; InputError if none of the first FIRST_RUNS is admissible."""
        refused = InputError("no run of the plan is admissible.", path="sweep")
        for number in range(min(self.plan.size, FIRST_RUNS)):
            point = {path: float(value[0]) for path, value in self.plan.at(np.array([number])).items()}
            try:
                values = self.model.values({**changes, **point})
                return self.model.problem(self.run, values, passing=self.passes_alike)
            except InputError as error:
                refused = error
        raise refused

    # -- compiled once ----------------------------------------------------------------------------------------------

    @cached_property
    def limits(self) -> Function | None:
        """Margins that must be positive at the start, except those that read rates, less their roundoff."""
        system = self.model.system
        rates = {state.dot for state in system.states}
        found = [expression for _, expression in system.limits if not expression.free_symbols & rates]
        return compile_function(system.inputs, [*map(certain, found)], steps=True) if found else None

    @cached_property
    def ramp(self) -> Function | None:
        """Initial value and slope of the load that ends the runs, if there is one."""
        if not self.plan.load:
            return None
        system = self.model.system
        line = spectrum.history(system, self.plan.load)
        return compile_function(system.inputs, [line, derivative(line, system.t)])

    @cached_property
    def reads_rates(self) -> bool:
        """True if what is kept or balanced depends on rates of the states."""
        system = self.model.system
        read = set().union(*(system.expand(system.find(name).expression).free_symbols for name in self.quantities[0]))
        return any(state.dot in read for state in system.states)

    @cached_property
    def quantities(self) -> tuple[list[str], Function]:
        """Names of the quantities that are kept or balanced beside the states, and the function for their values."""
        system, keep = self.model.system, self.keep
        wanted = {*keep.last, *keep.max, *keep.min, *keep.series}
        if keep.balances:
            wanted |= {system.variable_names[j] for total in system.totals for j in total.variables}
            wanted |= {system.ledger[j].law for j in system.account_columns.get("bonds", ())}
        chosen = [item for item in system.outputs if item.name in wanted]
        expressions = [system.expand(item.expression) for item in chosen]
        return [item.name for item in chosen], compile_function(system.inputs, expressions, system.cell_symbols)

    # -- from values to arrays ----------------------------------------------------------------------------------------

    @property
    def at_once(self) -> int:
        """Number of runs computed at once, small enough that outputs and all derived arrays stay small."""
        system, points = self.model.system, max(len(self.shape), 1) + self.most_steps * self.keeps_steps
        row = 8 * points * (4 * len(system.inputs) + 4 * len(system.outputs) + len(system.ledger))
        return max(CHUNK_BYTES // (2 * row), 1)

    def solve(self, values: Mapping[str, Array]) -> tuple[Mask, Columns]:
        """Solve runs with these values; return the mask of runs with a certain result, and their columns."""
        count = len(next(iter(values.values())))
        if self.room is None and count > PILOT_RUNS:
            self._solve({path: column[:: count // PILOT_RUNS] for path, column in values.items()})
        size = self.at_once
        parts = [
            self._solve({path: column[first : first + size] for path, column in values.items()})
            for first in range(0, count, size)
        ]
        if len(parts) == 1:
            return parts[0]
        found = [columns for _, columns in parts if columns]
        whole = {name: np.concatenate([each[name] for each in found]) for name in found[0]} if found else {}
        return np.concatenate([done for done, _ in parts]), whole

    def _solve(self, values: Mapping[str, Array]) -> tuple[Mask, Columns]:
        table, y0, rows = self.starts(values)
        peaks, none_due = self.guards(rows)
        ends, times = self.ends(rows)
        solved = self._admissible(values, rows) & none_due & np.isfinite(ends) & (ends > 0)
        segments = self.problem.segments[None]
        if self.ramp is not None:
            segments = np.column_stack([np.zeros(len(ends)), ends])
        solved[solved] = self._are_found(y0[solved], table[solved, 0])
        if not self.passes_alike:
            cut = np.broadcast_to(segments, (len(ends), segments.shape[1]))[solved], table[solved]
            solved[solved] = ~self.model.passing.cut(*cut, self.values, self.run.max_steps)
        # What is chosen is copied.
        own: Any = slice(None) if solved.all() else np.flatnonzero(solved)
        y0, table = y0[own], table[own]
        if not len(y0):
            return solved, {}
        peaks, times, segments = (shared if len(shared) == 1 else shared[own] for shared in (peaks, times, segments))
        # The spacing of checks against the equations scales with the run; outputs serve only the kept columns.
        problem = replace(self.problem, times=times[0], record_steps=self.keeps_steps, line_error=0.0)
        spacing = segments[:, -1] / self.run.samples
        clear, columns = self._columns(self._solved(problem, y0, table, spacing, peaks, segments, times))
        if clear.all():
            return solved, columns
        solved[solved] = clear
        return solved, {name: column[clear] for name, column in columns.items()}

    def _are_found(self, y0: Array, parameters: Array) -> Mask:
        """Return the mask of starts from which stable temperatures above zero are found where there is no capacity; the
        others are searched for run by run.
        """
        system, program = self.model.system, self.model.program
        guessed = guessed_temperatures(system)
        if not (guessed.any() and len(y0)):
            return np.ones(len(y0), dtype=bool)
        found = consistent(program, 0.0, y0, np.zeros_like(y0), parameters)
        return found.valid & (found.y[:, guessed] > 0).all(axis=1) & are_stable(system, program, y0, parameters)

    def _solved(self, problem: Problem, y0: Array, table: Array, *others: Array) -> Ends:
        """Solve the runs; ``others`` are spacing, peaks, segments and times as the stepper takes them."""
        *_, segments, times = others
        return Ends(self._filled(problem, (y0, table, *others)), table, segments, times)

    def _filled(self, problem: Problem, columns: Sequence[Array]) -> Any:
        """Return the batch of the runs, which are repeated if their tables were too small."""
        keeps_inside, fits = self.jumps and (self.keeps_steps or bool(self.keep.reach)), False
        while not fits:
            batch = self._batch(problem, columns, self.room)
            steps, events = np.clip(batch.counts[:, [RECORDS, EVENTS]].max(axis=0), 1, MOST_ROWS).tolist()
            needed = steps * self.keeps_steps, events, 0, events * keeps_inside
            had = batch.records.shape[1], batch.events.shape[1], 0, batch.jumps.shape[1]
            fits = all(each <= rows for each, rows in zip(needed, had, strict=True))
            if not (fits and self.room):
                room = self.room or (0, len(problem.margins), 0, 0)
                self.room = tuple(max(each + each // 4, rows) for each, rows in zip(needed, room, strict=True))
            self.most_steps = max(self.most_steps, steps)
        return batch

    def _batch(self, problem: Problem, columns: Sequence[Array], room: Room | None) -> Any:
        """Return the batch of the runs, with tables of a size; of the usual one by default."""
        return solve_batch(problem, *columns, room=room)

    def starts(self, values: Mapping[str, Array]) -> tuple[Array, Array, Array]:
        """Return parameters [run, segment, parameter], initial states [run, state] and both as rows of arguments."""
        n, count = self.n, len(next(iter(values.values())))
        rows = np.repeat(self.first_row[None], count, axis=0)
        y0, first = rows[:, 1 : 1 + n], rows[:, 1 + 2 * n :]
        # Runs without breakpoints have a single segment, whose parameters are those of the rows.
        table = np.repeat(self.problem.parameters[None], count, axis=0) if len(self.breaks) else first[:, None]
        for path, column in self.parameter_columns.items():
            first[:, column] = values[path]
            table[:, :, column] = first[:, column, None]
        with np.errstate(invalid="ignore", divide="ignore"):
            for column, state in self.state_columns:
                y0[:, column] = values[state.path] if state.given is None else np.log(values[state.path])
        columns, begun = self.model.starts
        if columns:
            modes = begun(rows)
            first[:, columns], table[:, :, columns] = modes, modes[:, None]
        return table, y0, rows

    def _admissible(self, values: Mapping[str, Array], rows: Array) -> Mask:
        """Return the mask of starts that are within all ranges, and by more than roundoff within all limits."""
        solved: Mask = np.isfinite(rows @ np.zeros(rows.shape[1]))  # zero times infinity is not a number
        system = self.model.system
        specs = {parameter.path: parameter.spec for parameter in system.parameters}
        for path, column in values.items():
            spec = specs.get(path)
            if spec is not None:
                solved &= (column > spec.above) & (column >= spec.at_least) & (column <= spec.at_most)
        if self.limits is not None:
            # Margins that may be zero within roundoff are decided in exact numbers, run by run.
            solved &= all_above(self.limits(rows), 0.0, range(self.limits.n_out))
        return solved

    def ends(self, rows: Array) -> tuple[Array, Array]:
        """Return the end time of each run, and the output times: of each run if a load ends them, else of all."""
        if self.ramp is None:
            return np.full(len(rows), self.problem.segments[-1]), self.shape[None]
        assert self.plan.until is not None
        value, slope = self.ramp(rows).T
        # A load that does not move gives an infinite end, and such runs are left to be refused one by one.
        with np.errstate(all="ignore"):
            ends = (self.plan.until[1] - value) / slope
        return ends, np.asarray(self.shape / self.problem.times[-1]) * ends[:, None]

    def guards(self, rows: Array) -> tuple[Array, Mask]:
        """Return largest accounts and guards before the start, as a first arc has them, and the mask of runs without an
        edge that is due there.
        """
        model, count = self.model, len(rows)
        program, jumper = model.program, model.jumper
        if jumper is None or program.margins is None:
            return self.no_peaks, np.ones(count, dtype=bool)
        # The same magnitudes as at the start of a single run, where nothing has been evaluated before.
        first, y, seen = len(model.margins), rows[:, 1 : 1 + self.n], rows
        sizes = jumper.first_magnitudes(rows)
        sizes = sizes if np.isfinite(sizes.sum()) else np.nan_to_num(sizes)
        if jumper.guards_read_rates:
            point = consistent(program, np.zeros(count), y, np.zeros_like(y), rows[:, 1 + 2 * self.n :])
            seen = np.concatenate([rows[:, :1], point.y, point.ydot, rows[:, 1 + 2 * self.n :]], axis=1)
        now = program.margins(seen)
        active = first + np.flatnonzero(model.system.active_guards(self.problem.parameters[0])[first:])
        none_due = np.ones(count, dtype=bool)
        for j in active:
            none_due &= now[:, j] > GUARD_EPS * sizes[:, j]
        sizes[:, self.impacts] = np.maximum(sizes[:, self.impacts], MICROMETRE)
        exchanged = np.zeros((count, program.n_ledger))
        return np.concatenate([exchanged, sizes], axis=1) if program.n_ledger else sizes, none_due

    # -- from arrays to columns ---------------------------------------------------------------------------------------

    def _columns(self, found: Ends) -> tuple[Mask, Columns]:
        """Return the mask of runs with a certain result, and their columns."""
        batch, counts = found.batch, found.batch.counts
        status, reason, clear = self._verdicts(found)
        # A run that overflows its tables, or ends before its first output, is solved by itself.
        for which, table, matters in ((EVENTS, batch.events, True), (RECORDS, batch.records, self.keeps_steps)):
            clear &= counts[:, which] <= table.shape[1] if matters else True
        clear &= counts[:, OUTPUTS] > 0 if self.keeps_course else True
        columns: Columns = {
            "status": status,
            "reason": reason,
            "time_reached": batch.ends[:, 0].copy(),
            "steps": counts[:, FIRST_COUNTER].astype(np.int32),
        }
        values = self._last_values(found)
        columns |= {f"{name}_last": values[name] for name in self.keep.last}
        columns |= self.along(found, clear) if self.keeps_course else {}
        return clear, columns | self._event_columns(found)

    def _last_values(self, found: Ends) -> Mapping[str, Array]:
        """Return the kept quantities at the ends of the runs by name; those of states alone without an evaluation."""
        states = {state.name: 1 + j for j, state in enumerate(self.model.system.states)}
        if set(self.keep.last) <= set(states):
            return {name: found.batch.ends[:, states[name]].copy() for name in self.keep.last}
        last, whole = found.last, found.batch.counts[:, END] == Status.FINISHED
        if self.reads_rates and whole.any():  # rates from the equations, as at outputs
            rows = last[whole]
            put_rates(self.model.program, rows)
            last[whole] = rows
        return self._values(last)[1]

    def _verdicts(self, found: Ends) -> tuple[Any, Any, Mask]:
        """Return codes of status and reason, and the mask of runs for which both are certain."""
        model, batch, n, last = self.model, found.batch, self.n, found.last
        outcome = batch.counts[:, END].copy()
        ended, stopped = outcome == Status.FINISHED, outcome == Status.EVENT
        reason = np.full(len(outcome), self.reasons.index(self.reasons[0]), np.int16)
        whole = model.jumper is None or self.jumps
        clear = ended | (stopped & whole)
        if whole and stopped.any():
            newest = np.clip(batch.counts[:, EVENTS], 1, batch.events.shape[1]) - 1
            index = batch.events[np.arange(len(outcome)), newest, 0]
            for j, margin in enumerate(model.margins):
                hit = np.flatnonzero(stopped & (index == j))
                if len(hit):  # a run that its own rates lead back from its limit is not certain
                    t, y, parameters = last[hit, 0], last[hit, 1 : 1 + n], last[hit, 1 + 2 * n :]
                    led = are_led_back(model.system, model.program, margin, t, y, parameters)
                    reason[hit] = self.reasons.index(margin.reason)
                    clear[hit] &= ~led & (margin.below is None)
        elif not whole:  # a gap may have closed without an event
            clear &= all_above(batch.ends[:, -model.program.n_margins :], -PICOMETRE, self.impacts)
        return stopped * np.int8(STATUSES.index("stopped")), reason, clear

    def _values(self, rows: Array) -> Values:
        """Return states, and what is kept or balanced, at rows of arguments: the table, and its columns by name."""
        states, (names, quantities) = self.model.system.states, self.quantities
        # Column-major, since columns are what is used.
        table = np.empty((self.n + len(names), len(rows))).T
        table[:, : self.n], table[:, self.n :] = rows[:, 1 : 1 + self.n], quantities(rows)
        return table, dict(zip((*(state.name for state in states), *names), table.T, strict=True))

    def along(self, found: Ends, clear: Mask) -> Columns:
        """Return series, extremes and balances, from outputs and steps."""
        batch, n, keep = found.batch, self.n, self.keep
        counts, times = batch.counts, found.times
        count, most = batch.outputs.shape[:2]
        reached = np.arange(most) < counts[:, OUTPUTS, None]
        # One row per output that a run has reached, so that nothing is evaluated in vain.
        owner, k = np.nonzero(reached)
        t, y = times[np.minimum(owner, len(times) - 1), k], batch.outputs[owner, k, :n]
        rows = found.inputs(owner, t, y, np.zeros_like(y))
        if self.reads_rates:
            put_rates(self.model.program, rows)
        table, values = self._values(rows)
        columns: Columns = {}
        for name in keep.series:
            columns[name] = np.full((count, most), np.nan)
            columns[name][owner, k] = values[name]
        columns |= self.balances(found, rows, values, reached) if self.keep.balances else {}
        if not self.keeps_extremes:
            return columns
        return columns | self.extremes(found, clear, owner, table, list(values))

    def extremes(self, found: Ends, clear: Mask, owner: Index, outputs: Array, names: list[str]) -> Columns:
        """Return largest and smallest values of the quantities ``names`` over outputs [outputs, names] of the runs
        ``owner``, over the ends of steps, and after jumps.
        """
        batch, n = found.batch, self.n
        taken = np.arange(batch.records.shape[1]) < np.where(clear, batch.counts[:, RECORDS], 0)[:, None]
        step_owner, m = np.nonzero(taken)
        steps = batch.records[step_owner, m]
        inputs = found.inputs(step_owner, steps[:, 0], steps[:, 1 : 1 + n], steps[:, 1 + n : 1 + 2 * n])
        parts = [(owner, outputs), (step_owner, self._values(inputs)[0])]
        leaps = self._discontinuities(found)
        parts.append((leaps.owner[leaps.last], np.column_stack([leaps.after[name][leaps.last] for name in names])))
        columns: Columns = {}
        for which, chosen, best in (("max", self.keep.max, np.fmax), ("min", self.keep.min, np.fmin)):
            extreme = best.reduce([of_each(best, runs, table, len(clear)) for runs, table in parts])
            columns |= {f"{name}_{which}": extreme[:, names.index(name)] for name in chosen}
        return columns

    def _discontinuities(self, found: Ends) -> Discontinuities:
        """Return the jumps of the runs, and the breakpoints of loads that they have passed between jumps."""
        batch, n, width = found.batch, self.n, self.model.program.n_inputs
        # These tables are empty if runs end at their edges, or if nothing along the runs is kept.
        rows, records = (
            table if table.shape[1] else np.empty((len(table), 0, 2 * width)) for table in (batch.jumps, batch.records)
        )
        owner, k = np.nonzero(np.arange(rows.shape[1]) < batch.counts[:, JUMPS, None])
        before, after = rows[owner, k, -2 * width : -width], rows[owner, k, -width:]
        times, taken = records[..., 0], np.arange(records.shape[1]) < batch.counts[:, RECORDS, None]
        of, m = np.nonzero(taken & np.isin(times, self.breaks) & (times < batch.ends[:, :1]))
        calm = ~np.isin(of + 1j * times[of, m], owner + 1j * before[:, 0])
        of, steps = of[calm], records[of[calm], m[calm]]
        known = of, steps[:, 0], steps[:, 1 : 1 + n], steps[:, 1 + n : 1 + 2 * n]
        before = np.concatenate((before, found.inputs(*known)))
        after = np.concatenate((after, found.inputs(*known, after=True)))
        return Discontinuities.of(self.model, np.concatenate((owner, of)), before, after)

    @cached_property
    def totals(self) -> Function:
        """Totals that are balanced: energy and entropy."""
        system = self.model.system
        return compile_function(
            system.inputs, [system.expand(system.find(name).expression) for name in ("E_total", "S_total")]
        )

    def balances(self, found: Ends, rows: Array, values: Mapping[str, Array], reached: Mask) -> Columns:
        """Return the errors of the balances of each run over its outputs, as in its audit."""
        system, batch, n = self.model.system, found.batch, self.n
        # Column-major, since NumPy is slow in finding the largest of a few contiguous outputs.
        reached, all_reached = np.asfortranarray(reached), reached.all()
        owner, k = np.nonzero(reached)

        def whole(column: Array) -> Array:
            """Return a table of runs and outputs; beyond the end of a run it repeats the start, with no exchange."""
            if all_reached:
                return np.asfortranarray(column.reshape(reached.shape))
            filled = np.zeros(reached.shape, order="F")
            filled[owner, k] = column
            return np.where(reached, filled, filled[:, :1])

        # The same residuals and roundings as in the audit of one run, over the existing outputs.
        names = system.variable_names
        named = {j: whole(values[names[j]]) for total in system.totals for j in total.variables}
        outputs = np.asfortranarray(batch.outputs[..., n:])
        first = np.where(reached[:, :1, None], outputs[:, :1], 0.0)  # a run without outputs has none in its memory
        ledger = outputs if all_reached else np.where(reached[..., None], outputs, first)
        rounded = of_each(np.fmax, owner, self._rounding(rows), len(reached))
        columns: Columns = {}
        left = zip(("energy", "entropy"), system.totals, residuals(system.totals, named, ledger), strict=True)
        for j, (which, total, (residual, scale)) in enumerate(left):
            stored = np.maximum(rounded[:, j] / EPS, np.abs(named[total.variables[0]]).max(axis=1))
            stored = np.maximum(stored, scale) if which == "entropy" else stored
            rounding = EPS * stored * (LAST_DIGITS + batch.counts[:, RECORDS])
            worst = np.max(np.abs(residual), axis=-1, initial=0.0)
            columns[f"{which}_error"] = resolved(worst, scale, stored, rounding)
        sites = np.zeros(len(reached))
        for j in system.account_columns.get("bonds", ()):
            bonds = whole(values[system.ledger[j].law])
            sites = np.maximum(sites, np.abs(bonds - bonds[:, :1] - ledger[..., j]).max(axis=1))
        return {**columns, "site_error": sites}

    def _rounding(self, rows: Array) -> Array:
        """Return the largest change of each total by the last bit of a state, shape (rows, 2)."""
        totals, moved = self.totals(rows), rows.copy()
        worst = np.zeros_like(totals)
        for j in range(1, 1 + self.n):
            moved[:, j] *= 1 + EPS
            np.fmax(worst, np.abs(self.totals(moved) - totals), out=worst)
            moved[:, j] = rows[:, j]
        return worst

    def _event_columns(self, found: Ends) -> Columns:
        """Return the first times of events after which a run goes on, and of values that are reached."""
        batch, keep = found.batch, self.keep
        named = [margin.name for margin in self.model.margins] + [edge.name for edge in self.model.system.edges]
        columns: Columns = {}
        names = [*((name, f"time_{variable(name)}") for name in keep.events)]
        names += [(f"{REACHES}{name}", f"time_to_{name}") for name in keep.reach or {}]
        if not names:
            return columns
        recorded = np.arange(batch.events.shape[1]) < batch.counts[:, EVENTS, None]
        for name, column in names:
            wanted = [j for j, each in enumerate(named) if each == name]
            owner, row = np.nonzero(recorded & np.isin(batch.events[..., 0], wanted))
            owner, first = np.unique(owner, return_index=True)
            rows = np.full((len(recorded), 2 + self.n), np.nan)
            rows[owner] = batch.events[owner, row[first], : 2 + self.n]
            columns[column] = rows[:, 1]
            for state in keep.at_events if name in keep.events else ():
                columns[f"{state}_at_{variable(name)}"] = rows[:, 2 + self.model.system.state_columns[state]]
        for name, t in self._reached_otherwise(found, named) if keep.reach else ():
            columns[f"time_to_{name}"] = np.fmin(columns[f"time_to_{name}"], np.where(t < np.inf, t, np.nan))
        return columns

    def _reached_otherwise(self, found: Ends, named: Sequence[str]) -> Iterator[tuple[str, Array]]:
        """Yield each variable of which values are reached, and when a jump reaches them, or the start; else infinity.

        The names are those of margins and edges.
        """
        leaps, starts = self._discontinuities(found), found.batch.outputs[:, 0, : self.n]
        rows = found.inputs(np.arange(len(starts)), np.zeros(len(starts)), starts, np.zeros_like(starts))
        put_rates(self.model.program, rows)
        assert self.model.program.margins is not None
        distances = self.model.program.margins(rows)
        for name, level in (self.keep.reach or {}).items():
            first, leapt = np.full(len(starts), np.inf), crossed(leaps.before[name], leaps.after[name], level)
            np.minimum.at(first, leaps.owner[leapt], leaps.t[leapt])
            first[begins(distances[:, named.index(f"{REACHES}{name}")], level)] = 0.0
            yield name, first


class JumpingRuns(ArrayRuns):
    """Runs of a plan with their jumps as arrays."""

    jumps = True

    def guards(self, rows: Array) -> tuple[Array, Mask]:
        """Return zero accounts and guards; edges may be due in all runs."""
        return self.no_peaks, np.ones(len(rows), dtype=bool)

    def _solved(self, problem: Problem, y0: Array, table: Array, *others: Array) -> Ends:
        """Solve runs along their edges; repeat them if their tables were too small."""
        jumper = self.model.jumper
        assert jumper is not None
        jumper.expect_jumps()
        batch = self._filled(replace(problem, edges=jumper.edge_tables), (y0, table, *others))
        arcs = batch.arcs
        begun = np.where(np.arange(arcs.shape[1]) < batch.counts[:, ARCS, None], arcs[..., 0], np.inf)
        return Ends(batch, arcs[..., 5:], np.column_stack([begun, np.full(len(y0), np.inf)]), others[-1])

    def _batch(self, problem: Problem, columns: Sequence[Array], room: Room | None) -> Any:
        """Return the batch of the runs along their edges, with tables of a size; of the usual one by default."""
        return solve_arrays(problem, *columns, room=room)
