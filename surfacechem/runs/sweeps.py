"""Sweeps: runs over a grid of parameter values, the error of each run, and their dataset."""

from __future__ import annotations

import json
import logging
import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cache, cached_property, partial
from numbers import Integral
from typing import Any

import numpy as np
from numpy.typing import NDArray

from surfacechem import references
from surfacechem.errors import InputError
from surfacechem.expressions import derivative
from surfacechem.format import Case
from surfacechem.format.plans import RUN_DIMENSION, STATISTICS, LazyArray, Plan, name_parts
from surfacechem.model.system import System
from surfacechem.quantities import VARIABLES
from surfacechem.references.base import SceneView
from surfacechem.results.accuracy import CELLS_UNKNOWN, ENDED_AT_START, CellErrors, second_tolerance
from surfacechem.results.audit import Audit, audit, verdicts
from surfacechem.results.dataset import DATASET_NAMES, Results, coverage_columns, quantities, quantity_columns
from surfacechem.results.error_estimates import against_exact, estimated, second_run, second_settings, with_cells
from surfacechem.results.event_table import entropy_destroyed, event_columns, event_times
from surfacechem.results.matching import exact_values, match
from surfacechem.results.netcdf import COORDINATES, Column, versions
from surfacechem.results.refinement import shared_times
from surfacechem.results.solution import run_warnings
from surfacechem.runs import spectrum
from surfacechem.runs.keeping import (
    END_COLUMNS,
    EXTREMES,
    SINGLE_COLUMNS,
    at_end,
    balances_of,
    described,
    end_of,
    extremes,
    keep_of,
)
from surfacechem.runs.listing import counted
from surfacechem.solve.run import Model, Run, Trajectory
from surfacechem.tolerances import EPS, LINE_ERROR

RESERVED_COLUMNS = ("time", RUN_DIMENSION, "species", "coverage", "error", "entropy_destroyed", "lifetime")
"""Names of dimensions and columns of sweeps that are not quantities."""

COLUMN_PREFIXES = ("event", "checked", "hardest")
"""Prefixes of the names of dimensions and columns of events and of checked runs."""

NUMBERS = re.compile(r"(?<![\w.])[-+]?\d[\d.]*(e[-+]?\d+)?")
"""What differs between the same warning of two runs."""

MOST_FOLLOWED = 64
"""Largest number of runs from which the output times of a sweep are chosen; of more, an evenly spread subset."""

MOST_OUTPUTS = 128_000
"""Outputs of all runs of a sweep together, if they need more than the evenly spaced times."""

UNBROKEN = "the run ended with too many bonds left"
"""Reason why an error of the load at rupture, or of a lifetime, is unknown."""

RUNS_AT_A_TIME = 64
"""Runs that are solved at a time; progress is reported between portions."""

log = logging.getLogger(__name__)

# -- runs over a plan -------------------------------------------------------------------------------------------------


def prepared(system: System, plan: Plan) -> System:
    """Return the system that a sweep compiles: with statistics of rupture if a load grows until bonds break, with the
    mean lifetime if runs end at a given survival.
    """
    if plan.until is None:
        return system
    variable, target = plan.until
    found = system
    if plan.load:
        spectrum.history(system, variable)
    if not plan.load:
        found = spectrum.with_lifetime(system, target)
    elif spectrum.breaks_bonds(system):
        found = spectrum.with_rupture(system, variable)
    elif spectrum.evolves_bonds(system):
        warning = "bonds can form again, so that their loss is no spectrum of rupture forces: none is given."
        found = replace(system, warnings=(*system.warnings, warning))
    return replace(found, origin=partial(prepared, system, plan))


def processors(threads: int | None = None) -> int:
    """Return how many threads are asked for; by default the number of processors that this process may use, which are
    fewer than there are for a job on a shared machine.
    """
    if threads is not None:
        if not (isinstance(threads, Integral) and threads > 0):
            raise InputError(f"a number of threads is 1 or more, not {threads!r}.", path="threads")
        return int(threads)
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not every system reports it
        return os.cpu_count() or 1


def solve(
    model: Model, plan: Plan, run: Run, changes: Mapping[str, float], threads: int | None = None
) -> list[Trajectory]:
    """Solve the runs of a :func:`prepared` system over the plan; how a run ends is its status, never an exception."""
    values = []
    for point in plan.points:
        with _told(plan, point):
            values.append(model.values({**changes, **point}))
    run = model.chosen(run, values[0])
    runs = settings(model.system, plan, following(model, plan, run, changes, threads), values)
    if run.steady:
        from surfacechem.runs.at_rest import refuse_histories, to_steady_state, together

        refuse_histories(model.system)
        found = []
        for at, point in zip(values, plan.points, strict=True):
            with _told(plan, point):
                found.append(to_steady_state(model, runs[0], at))
        runs = together(found)
    pairs = list(zip(runs, values, strict=True))
    done: list[Trajectory] = []
    for start in range(0, len(pairs), RUNS_AT_A_TIME):
        log.info("runs", extra={"done": start, "total": len(pairs)})
        portion = pairs[start : start + RUNS_AT_A_TIME]
        try:
            done += model.solve_all(portion, processors(threads))
        except InputError:
            for pair, point in zip(portion, plan.points[start:], strict=False):
                with _told(plan, point):
                    model.problem(*pair)
            raise
    return done


def following(model: Model, plan: Plan, run: Run, changes: Mapping[str, float], threads: int | None = None) -> Run:
    """Return the settings with output times that resolve the runs of a plan, or an evenly spread subset of many;
    unchanged if times were given.
    """
    if run.picture is None or plan.load or run.steady:
        return run
    some = plan.picked(np.arange(0, plan.size, -(-plan.size // MOST_FOLLOWED)))
    try:
        pairs = [(run, model.values({**changes, **point})) for point in some.points]
        done = model.solve_all(pairs, processors(threads))
    except InputError:
        return run  # refused runs are reported when all runs are solved
    return replace(run, times=shared_times(done, max(len(run.times), MOST_OUTPUTS // plan.size)))


@contextmanager
def _told(plan: Plan, point: Mapping[str, float]) -> Iterator[None]:
    """Add the swept values of a run to an error of it."""
    try:
        yield
    except InputError as error:
        path = next((path for path in point if error.message.startswith(f"{path} ")), "")
        given = ", ".join(f"{path} = {plan.told(path, value)}" for path, value in point.items())
        more = f"This is the run with {given}; a store, -o NAME.zarr, marks such runs and goes on."
        raise InputError(f"{error.message} {more}", error.place, path=path) from None


def settings(system: System, plan: Plan, run: Run, values: Sequence[Mapping[str, float]]) -> list[Run]:
    """Return the settings of each run: the same output times for all, or times stretched to the moment at which the
    load reaches the value in the plan.
    """
    # States inside steps are stored where they are asked for more closely than usual.
    run = replace(run, picture=None, looks=run.looks if run.looks < LINE_ERROR else 0.0)
    if plan.until is None or not plan.load:
        return [run] * len(values)
    variable, target = plan.until
    if system.breakpoints:
        message = f"runs until {variable} is reached cannot have histories with breakpoints."
        raise InputError(message, path="sweep.until")
    line = spectrum.history(system, variable)
    shape = np.asarray(run.times) / run.times[-1]
    runs = []
    for at in values:
        point = {parameter.symbol: at[parameter.path] for parameter in system.parameters}
        start, slope = (float(part.subs({**point, system.t: 0})) for part in (line, derivative(line, system.t)))
        if not (target - start) * slope > 0:
            told = f"{target:g} {VARIABLES[variable].unit}: it starts at {start:g} and changes by {slope:g}"
            message = f"{variable} never reaches {told} each second."
            raise InputError(message, path="sweep.until")
        runs.append(replace(run, times=tuple((shape * ((target - start) / slope)).tolist())))
    return runs


# -- errors of the runs -----------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class SweepAccuracy:
    """Largest relative error of each run and its source; exact statistics by name, where known."""

    errors: NDArray[np.float64]
    source: str
    exact: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)
    reasons: Sequence[str] = ()
    """Reason why the error of each run is unknown; '' where it is known."""

    @property
    def known(self) -> NDArray[np.float64]:
        """Known errors."""
        return self.errors[np.isfinite(self.errors)]

    @property
    def unknown(self) -> str:
        """Numbers of runs with an unknown error and their reasons, in words; '' if there are none."""
        return "; ".join(unknown_in(len(alike), alike[0]) for alike in grouped(filter(None, self.reasons)))


def grouped(texts: Iterable[str]) -> list[list[str]]:
    """Return texts that differ in their numbers only, of two runs say, in groups."""
    found: dict[str, list[str]] = {}
    for text in texts:
        found.setdefault(NUMBERS.sub("", text), []).append(text)
    return [*found.values()]


def unknown_in(count: int, why: str) -> str:
    """Describe the number of runs with an unknown error, and the reason; '' if there are none.

    >>> unknown_in(2, "unknown: the run ended at its start")
    'unknown in 2 runs: the run ended at its start'
    """
    said = ": ".join(filter(None, (counted(count, "run"), why.removeprefix("unknown: "))))
    return f"unknown in {said}" if count else ""


def accuracy(
    case: Case, done: SweepSolution, threads: int | None, cells: Callable[[], Sequence[CellErrors]]
) -> SweepAccuracy:
    """Return the error of each run, from the exact solution of the case, else from a second sweep; NaN if it is
    unknown. ``cells`` finds the errors of the cells across bodies of each run.
    """
    unused, named, found = case.unused, case.reference, None
    second = cache(lambda: _second(done, threads))
    # Options of a reference belong to the case as written, and fit no other run.
    if named is not None and not named.options:
        try:
            found = _against_exact(case, done, named.name, second)
        except InputError as error:
            unused = f"the exact solution {named.name} does not apply to this scene: {error.message.rstrip('.')}"
    elif named is not None:
        unused = named.fixed
    found = found or _estimated(done, second(), cells(), unused)
    wanted = done.run.accuracy
    if wanted is None or not np.any(found.known > wanted):
        return found
    # The runs of a sweep share one tolerance, and none is repeated at a tighter one.
    missed = f"{wanted:.0e} was asked, which takes a tighter `rtol` under `run` here"
    return replace(found, source=f"{found.source}; {missed}")


def _estimated(done: SweepSolution, second: SweepSolution, cells: Sequence[CellErrors], unused: str) -> SweepAccuracy:
    """Return the errors of all runs from a second sweep, with those of cells; ``unused`` is the reason against an exact
    solution.
    """
    if done.statistics:
        pairs = zip(done.statistics, second.statistics, cells, strict=True)
        errors = [_of_statistics(ours, theirs.__getitem__) + found.largest for ours, theirs, found in pairs]
        reasons = [UNBROKEN if found.converged else CELLS_UNKNOWN for found in cells]
    else:
        runs = zip(done.runs, second.runs, cells, strict=True)
        estimates = [with_cells(estimated(ours, theirs), each) for ours, theirs, each in runs]
        errors = [each.error for each in estimates]
        reasons = [each.source for each in estimates]
    source = ", ".join([second_run(second.run, "sweep"), *dict.fromkeys(f.source for f in cells if f.variables)])
    return SweepAccuracy(np.array(errors), "; ".join(filter(None, (source, unused))), reasons=_unknown(errors, reasons))


def _unknown(errors: Iterable[float], reasons: Iterable[str]) -> list[str]:
    """Return the reasons of the runs whose errors are unknown, '' for the others."""
    return [why if np.isnan(error) else "" for error, why in zip(errors, reasons, strict=True)]


def _second(done: SweepSolution, threads: int | None) -> SweepSolution:
    """Solve the runs at the second tolerance, as for a single run."""
    settings, integrals = [second_settings(run) for run in done.runs], bool(done.statistics)
    pairs = [
        (replace(own, accounts=own.accounts or integrals), run.values)
        for own, run in zip(settings, done.runs, strict=True)
    ]
    runs = done.model.solve_all(pairs, processors(threads))
    return replace(done, run=done.run.second(second_tolerance(done.run.rtol)), runs=runs)


def _against_exact(case: Case, done: SweepSolution, name: str, second: Callable[[], SweepSolution]) -> SweepAccuracy:
    """Return errors of the load at rupture, else of all quantities; InputError if the solution does not fit all runs.

    For loads at rupture the fit is tested on the outermost runs. A run that ended at its start has no error.
    """
    begun = [i for i, run in enumerate(done.runs) if len(run.stored.result.times) > 1]
    if not begun:
        raise InputError("all runs ended at their start.")
    errors, reasons = np.full(len(done.runs), np.nan), [ENDED_AT_START] * len(done.runs)
    exact = {which: errors.copy() for which in done.statistic_names if which in references.get(name).statistics}
    for i in begun:
        run = done.runs[i]
        if exact:
            reference = match(name, {}, SceneView(case.scene, run))
            if i in (begun[0], begun[-1]):
                exact_values(reference, case.scene, run)
            errors[i] = _of_statistics(done.statistics[i], partial(getattr, reference))
            reasons[i] = UNBROKEN
            for which, values in exact.items():
                values[i] = getattr(reference, which)
        else:
            found = against_exact(run, case.scene, name, {}, second().runs[i] if event_times(run) else None)
            errors[i], reasons[i] = found.error, found.source
    return SweepAccuracy(errors, f"exact solution {name}", exact, _unknown(errors, reasons))


def _of_statistics(found: Mapping[str, float], exact: Callable[[str], float]) -> float:
    """Return the largest error of the load at rupture, or that of the lifetime; absolute if the exact value is zero."""
    pairs = [(ours, exact(which)) for which, ours in found.items()]
    known = [pair for pair in pairs if not np.isnan(pair[0])]  # what a run has not reached has no error
    errors = [float(abs(ours - true) / abs(true) if true else abs(ours)) for ours, true in known]
    return float(np.max([EPS, *errors])) if errors else np.nan


# -- the dataset ------------------------------------------------------------------------------------------------------


def parameter_names(system: System, plan: Plan) -> dict[str, str]:
    """Return the paths of the swept parameters by their names in the dataset: the shortest unique tails of paths, which
    no column or dimension of a file or store may have.
    """
    kept, shown = keep_of(None, system), {DATASET_NAMES.get(name, name) for name in quantities(system)}
    stored = described(system, replace(kept, at_events=kept.last, reach=dict.fromkeys(kept.last, 0.0)))
    more = [f"{name}_{which}" for name in shown for which in (*EXTREMES, *STATISTICS, "before", "after")]
    exact = [f"{name}_exact" for name in (*more, "lifetime")]
    taken = {*kept.last, *shown, *system.interior, *stored, *END_COLUMNS, *more, *exact, *RESERVED_COLUMNS}
    found: dict[str, str] = {}
    for path in plan.paths:
        parts = name_parts(path)
        names = ["_".join(parts[-k:]) for k in range(1, len(parts) + 1)]
        free = (name for name in names if name not in taken | set(found) and not name.startswith(COLUMN_PREFIXES))
        found[next(free, f"{names[-1]}_swept")] = path
    return found


def dimensions(plan: Plan, names: Mapping[str, str]) -> dict[str, int]:
    """Return the sizes of the dimensions of a sweep by name; those of a grid are its parameters."""
    own = [RUN_DIMENSION] if plan.zipped else list(names)[: len(plan.axes)]
    return dict(zip([*own, *([RUN_DIMENSION] if plan.sample else [])], plan.shape, strict=True))


def parameter_columns(system: System, plan: Plan, names: Mapping[str, str]) -> list[Column]:
    """Return the values of the swept parameters, each along its own dimension, computed when they are read."""
    columns = []
    sample, drawn = plan.sample, set(plan.sample.draws) if plan.sample else set()
    values = {axis.path: LazyArray(axis.at, len(axis)) for axis in plan.axes}
    values |= {path: LazyArray(partial(sample.of, path), sample.runs) for path in drawn} if sample else {}
    for name, path in names.items():
        state = next((s for s in system.states if s.path == path), None)
        if state is not None:
            unit, text = state.at_start[0].unit, f"initial {state.at_start[0].long_name}"
        else:
            spec = next(p.spec for p in system.parameters if p.path == path)
            unit, text = spec.unit, f"{spec.text} ({path})"
        along = RUN_DIMENSION if plan.zipped or path in drawn else name
        columns.append(Column(name, (along,), values[path], unit, text))
    return columns


@dataclass(frozen=True, repr=False)
class SweepSolution(Results):
    """Results of a sweep: its runs in the order of :attr:`Plan.points`, their error, and their dataset."""

    model: Model
    plan: Plan
    run: Run
    """Settings of all runs; if a load ends them, each has its own output times."""
    runs: Sequence[Trajectory]
    judge: Callable[[SweepSolution], SweepAccuracy] | None = None
    """Function that finds the errors of the runs."""

    def __getstate__(self) -> dict[str, Any]:
        """Pickle the errors themselves instead of the function that finds them."""
        return {**vars(self), "accuracy": self.accuracy, "judge": None}

    @cached_property
    def accuracy(self) -> SweepAccuracy | None:
        """Errors of the runs and their source, found on first access."""
        return self.judge(self) if self.judge else None

    def __repr__(self) -> str:
        """Return title, size and ends in a line."""
        return f"<SweepSolution {self.title!r}: {counted(len(self.runs), 'run')}, {self.ends}>"

    @property
    def system(self) -> System:
        """The assembled equations."""
        return self.model.system

    @property
    def seconds(self) -> float:
        """Run time of all runs."""
        return sum(run.seconds for run in self.runs)

    @property
    def steps(self) -> int:
        """Steps of all runs."""
        return sum(run.result.counters.steps for run in self.runs)

    @cached_property
    def audits(self) -> list[Audit]:
        """The balances of each run."""
        return [audit(run) for run in self.runs]

    @cached_property
    def run_ends(self) -> list[dict[str, Any]]:
        """Entries of END_COLUMNS for each run."""
        return [end_of(run) | balances_of(run, balances) for run, balances in zip(self.runs, self.audits, strict=True)]

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """Warnings for readers of the results, each in the words of the first run that it is about."""
        pairs = zip(self.runs, self.audits, strict=True)
        alike = grouped(text for run, own in pairs for text in run_warnings(run, own, verdicts(run, own)))
        return tuple(f"{len(texts)} of {counted(len(self.runs), 'run')}: {texts[0]}" for texts in alike)

    def worst(self, balance: str) -> float:
        """Return the largest error over all runs of the balance of energy, entropy or site."""
        return float(np.max([getattr(balances, f"{balance}_error") for balances in self.audits]))

    @cached_property
    def statistics(self) -> Sequence[dict[str, float]]:
        """Mode, median and mean of the load at rupture of each run, or its lifetime; empty if the sweep has none."""
        if self.plan.until is None or not spectrum.breaks_bonds(self.system):
            return []
        return [spectrum.statistics(run, self.plan.load) for run in self.runs]

    @cached_property
    def statistic_names(self) -> list[str]:
        """Names of the statistics."""
        return [*self.statistics[0]] if self.statistics else []

    @property
    def ends(self) -> str:
        """Numbers of runs by status, in words, with the reason why runs stopped or failed if it is one for all."""
        why: dict[str, list[str]] = {}
        for run in self.runs:
            why.setdefault(run.status, []).append(run.reason.partition(" at t = ")[0])
        one = {status: f" ({reasons[0]})" for status, reasons in why.items() if len({*reasons}) == 1 and reasons[0]}
        one.pop("finished", None)
        return ", ".join(f"{len(reasons)} {status}{one.get(status, '')}" for status, reasons in why.items())

    @property
    def status(self) -> str:
        """'failed' if a run failed numerically, 'stopped' if physics stopped all of them, else 'finished'.

        If physics stops some runs this is a result of a sweep; in a spectrum all bonds are meant to break.
        """
        every = {run.status for run in self.runs}
        stopped = every == {"stopped"} and not self.statistics
        return "failed" if "failed" in every else "stopped" if stopped else "finished"

    @cached_property
    def parameters(self) -> dict[str, str]:
        """Paths of the swept parameters, by their names in the dataset."""
        return parameter_names(self.system, self.plan)

    @cached_property
    def axes(self) -> dict[str, int]:
        """Sizes of the dimensions of the sweep: those of a grid are its parameters."""
        return dimensions(self.plan, self.parameters)

    @property
    def inner(self) -> str:
        """Dimension along each run: time, or the load that ends all runs."""
        return self.plan.load or "time"

    @cached_property
    def columns(self) -> tuple[Column, ...]:
        """Every variable of the dataset, the coordinates first."""
        shape = self.axes
        along = {column.name: column for column in quantity_columns(self.runs, self.inner, shape)}
        load = along.pop(self.inner, None)
        species = coverage_columns(self.system, along.values())
        columns = [*self._coordinates(load), *along.values(), *species, *self._of_runs()]
        columns += event_columns(self.runs, shape)
        # Of each run the last, largest and smallest values, which may lie between the shared output times.
        single = [{"last": at_end(run), **extremes(run)} for run in self.runs]
        for name, q in quantities(self.system).items():
            for which, words in SINGLE_COLUMNS.items():
                own = f"{DATASET_NAMES.get(name, name)}_{which}"
                each = [run[which][name] for run in single]
                columns.append(self._of_each(own, each, q.unit, f"{q.long_name} {words}"))
        for which in self.statistic_names:
            name, unit, text = which, "s", "mean lifetime"
            if self.plan.load:
                q = quantities(self.system)[self.plan.load]
                name, unit, text = f"{q.name}_{which}", q.unit, f"{STATISTICS[which]} {q.long_name} at rupture"
            found = [statistics[which] for statistics in self.statistics]
            columns.append(self._of_each(name, found, unit, text))
            if self.accuracy and which in self.accuracy.exact:
                exact = self.accuracy.exact[which]
                columns.append(self._of_each(f"{name}_exact", exact, unit, f"exact {text}"))
        if self.statistic_names and self.plan.load:
            known = {column.name: column for column in columns}
            # A load that ends runs is linear in time; any other is refused.
            speed = np.diff(known[self.inner].values[:2]) / np.diff(known["time"].values[..., :2], axis=-1)
            values = spectrum.lifetimes(known["survival"].values, known[f"density_{self.inner}"].values, speed)
            text = f"mean lifetime at a constant {known[self.inner].long_name}, of bonds without memory"
            columns.append(Column("lifetime", (*shape, self.inner), values, "s", text))
        return tuple(columns)

    def _coordinates(self, load: Column | None) -> list[Column]:
        """Return the swept parameters, and the times or, if a load ends the runs, the values of this load."""
        swept = parameter_columns(self.system, self.plan, self.parameters)
        columns = [column._replace(values=column.values[:]) for column in swept]
        times = np.array([run.result.problem.times for run in self.runs])
        if self.plan.until is None or not self.plan.load or load is None:
            return [*columns, Column("time", ("time",), times[0], "s", "time since the start")]
        start = float(load.values.flat[0])
        values = start + (self.plan.until[1] - start) * times[0] / times[0, -1]
        columns.append(Column(self.inner, (self.inner,), values, load.unit, load.long_name))
        each = times.reshape(*self.plan.shape, -1)
        return [*columns, Column("time", (*self.axes, self.inner), each, "s", "time since the start")]

    def _of_runs(self) -> list[Column]:
        """Return columns about the runs: end, balances, jumps and error."""
        columns = [
            self._of_each(name, [end[name] for end in self.run_ends], "s" if name == "time_reached" else "1", text)
            for name, text in END_COLUMNS.items()
        ]
        if self.system.edges:
            destroyed = [entropy_destroyed(run.jumps) for run in self.runs]
            text = "most entropy that a jump has destroyed"
            columns.append(self._of_each("entropy_destroyed", destroyed, "J/(m^2 K)", text))
        if self.accuracy:
            columns.append(self._of_each("error", self.accuracy.errors, "1", "largest relative error of the run"))
        return columns

    def _of_each(self, name: str, values: Sequence[Any] | NDArray[np.float64], unit: str, text: str) -> Column:
        """Return a column with one value per run."""
        is_text = isinstance(values[0], str)
        shaped = np.array(values, object if is_text else float).reshape(self.plan.shape)
        return Column(name, tuple(self.axes), shaped, "" if is_text else self.system.unit(unit), text)

    @cached_property
    def attributes(self) -> dict[str, str | float | int]:
        """Global attributes: scalars and strings only."""
        error: dict[str, str | float] = {}
        if self.accuracy:
            worst = float(np.max(self.accuracy.known)) if len(self.accuracy.known) else np.nan
            source = "; ".join(filter(None, (self.accuracy.source, self.accuracy.unknown)))
            error = {"error": worst, "error_source": source}
        return {
            **self._origin("made", f"with {self.run.solver} at rtol {self.run.rtol:g}"),
            "sweep": self.plan.record,
            COORDINATES: " ".join(self.parameters),
            **({"departures": json.dumps(self._changed(self.system))} if self.changes else {}),
            "status": self.status,
            "reason": self.ends,
            "regime": self.system.regime,
            "solver": self.run.solver,
            "rtol": float(self.run.rtol),
            "warnings": "; ".join(self.warnings) or "none",
            "runs": len(self.runs),
            "count_steps": self.steps,
            "run_seconds": float(self.seconds),
            "compile_seconds": float(self.model.compile_seconds),
            **({"integrals_seconds": self.before_seconds} if self.system.in_totals else {}),
            **error,
            **{f"{balance}_error": self.worst(balance) for balance in ("energy", "entropy", "site")},
            "versions": versions(),
        }
