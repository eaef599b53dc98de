"""Error against run time: cases over tolerances and solvers, compared with a reference of known uncertainty.

The reference is the exact solution, else two different methods that agree. A method is run at two tight tolerances a
decade apart and extrapolated in the tolerance, assuming an error proportional to it. Of several methods the two that
agree best are used. The uncertainty is their difference, or the size of the extrapolation if that is more. The
uncertainty of an exact solution is that of its evaluation: its change when the times change by their last bit.

Runs are compared at the known states of a tight run, and errors are relative to the same sizes as those of any run.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations, count
from pathlib import Path
from statistics import median
from typing import NamedTuple

import numpy as np

from surfacechem.documents.document import as_texts
from surfacechem.errors import InputError, Place, expect, refuse_unknown
from surfacechem.format import Case
from surfacechem.references.base import SceneView
from surfacechem.results.accuracy import errors_over_time
from surfacechem.results.audit import audit
from surfacechem.results.error_estimates import clear_of, computed, difference, event_errors, fewer, floors, sizes
from surfacechem.results.event_table import event_times
from surfacechem.results.matching import exact_values, match
from surfacechem.runs.simulation import Simulation, load
from surfacechem.runs.summaries import duration
from surfacechem.solve import CALLING_PYTHON, solver
from surfacechem.solve import names as known_solvers
from surfacechem.solve.contract import Array
from surfacechem.solve.run import Model, Trajectory
from surfacechem.studies.grid import BRIEF_RUN, LIBRARY_ERRORS, ROUND_SECONDS, Cell, attempt, check_options, filled
from surfacechem.studies.report import PageSection, PageTable, Study, Variable
from surfacechem.tolerances import EPS, MIN_RTOL, SQRT_EPS

Values = Mapping[str, Array]

# Methods for a reference, the quicker first; the last only if no other can run the case. They are of different
# families, two implementations of collocation and multistep methods, so that they share no bug.
REFERENCE_METHODS = ("radau", "lsoda", "scipy-radau", "cantera")

# Ratio of the two tolerances from which a method is extrapolated. With closer ones the difference would be little more
# than rounding, with others errors would no longer be proportional to the tolerance.
TEN = 10.0

# A solve that takes longer than this counts as failed, unless the case allows less; limit for a reference [s], long
# enough that the choice of its methods does not depend on the load of the machine.
MOST_SECONDS, LONGEST_SOLVE = 60.0, 900.0

# Relative tolerances of a study, if none are given.
TOLERANCES = tuple(10.0**-k for k in (4, 6, 8, 10, 12))

# Methods that differ by more do not agree: a reference must resolve at least the errors of the loosest tolerance.
AGREEMENT = TOLERANCES[0] / 100

# Two methods that differ by no more than this need no third.
REFERENCE_ERROR = TEN * TOLERANCES[-1]

NORMS = ("final", "max", "l2")
# The kinds of errors; the last one does not belong to a variable.
MEANING = {
    "final": "relative error at the end",
    "max": "largest relative error",
    "l2": "root mean square in time of the relative error",
    "event": "largest relative error of the times of events",
}


Errors = Mapping[tuple[str, str], float]
"""Errors by kind and variable; errors of event times belong to no variable, and there may be none."""


def worst(errors: Errors, *kinds: str) -> float:
    """Return the largest error of these kinds over the variables; NaN if there is none."""
    return float(np.max([error for (kind, _), error in errors.items() if kind in kinds] or [math.nan]))


def mean_square(times: Array, error: Array) -> float:
    """Return the root mean square in time, by the trapezoidal rule.

    >>> mean_square(np.array([0.0, 1.0, 3.0]), np.array([0.2, 0.2, 0.2]))
    0.2
    """
    if len(times) < 2:
        return float(np.max(error, initial=0.0))
    return float(np.sqrt(np.trapezoid(error**2, times) / (times[-1] - times[0])))


class Subject(NamedTuple):
    """A case that can be run with any solver at any tolerance."""

    case: Case
    model: Model

    @property
    def states(self) -> list[str]:
        """Names of the states."""
        return list(self.model.system.own_states)

    @property
    def names(self) -> list[str]:
        """Names of all quantities that can be compared."""
        return [*self.states, *(item.name for item in self.model.system.outputs)]

    def solve(self, name: str, rtol: float, limit: float = MOST_SECONDS) -> Trajectory:
        """Run with another solver and tolerance, the absolute tolerance in proportion."""
        run = self.case.run
        atol = None if run.atol is None else run.atol * rtol / run.rtol
        seconds = run.max_seconds or limit
        return self.model.solve(replace(run, solver=name, rtol=rtol, atol=atol, max_seconds=seconds))

    def unable(self, name: str) -> str:
        """Return the reason why a solver cannot run this case; empty if it can."""
        if self.model.program.external is not None and name not in CALLING_PYTHON:
            return "rates of the mechanism come from Cantera itself, which this solver cannot ask"
        try:
            solver(name)
        except ImportError as error:
            return f"its library cannot be imported: {error}"
        return ""

    def methods(self) -> list[str]:
        """Return the methods for a reference; Cantera's only if no other can run the case."""
        able = [name for name in REFERENCE_METHODS if not self.unable(name)]
        return [name for name in able if name != "cantera"] or able

    def tight(self, method: str, rtol: float) -> Trajectory:
        """Run for a reference; InputError if it fails."""
        try:
            found = self.solve(method, rtol, LONGEST_SOLVE)
            why = found.reason if found.status == "failed" or len(found.result.times) < 2 else ""
        except LIBRARY_ERRORS as error:
            why = f"{type(error).__name__}: {error}"
        if why:
            raise InputError(f"{self.case.name} has no reference: {method} at rtol {rtol:.0e}: {why}")
        return found


class Truth(NamedTuple):
    """True values of the variables at the output times, true event times, and the uncertainty of both."""

    source: str
    status: str
    times: Array
    values: Values
    floors: Mapping[str, float | Array]
    events: Values
    end: float
    """Requested end of the run [s]."""
    uncertainty: Mapping[tuple[str, str], float] = {}

    @classmethod
    def of(cls, run: Trajectory, source: str, variables: Sequence[str]) -> Truth:
        """Return the truth with times and floors of a run, without values and events."""
        known: dict[str, float | Array] = {**floors(run), **sizes(run)}
        found = {name: size for name, size in known.items() if name in variables}
        return cls(source, run.status, run.result.times, {}, found, {}, run.run.times[-1])

    def errors(self, values: Values, events: Values) -> Errors:
        """Return the errors of values and of event times, over the output times that both have reached."""
        # Between the times of the same event in the two runs only its time has an error.
        both = [(events.get(name, ()), times) for name, times in self.events.items()]
        pairs = [pair for found, times in both if len(found) == len(times) for pair in zip(found, times, strict=True)]
        alike = clear_of(self.times, pairs)
        found: dict[tuple[str, str], float] = {}
        for name, every in errors_over_time(values, self.values, self.floors).items():
            error = np.where(alike[: len(every)], every, 0.0)
            found["final", name], found["max", name] = float(error[-1]), float(error.max())
            found["l2", name] = mean_square(self.times[: len(error)], error)
        for worst_of_events in event_errors(events, self.events, self.end).values():
            found["event", ""] = worst_of_events
        return found

    def objection(self, trajectory: Trajectory) -> str:
        """Return the reason why a run has no errors: it failed, or ended otherwise; empty if it has."""
        if trajectory.status == "failed":
            return trajectory.reason
        if trajectory.status != self.status:
            return f"ended otherwise than the reference: {trajectory.reason}"
        if abs(len(trajectory.result.times) - len(self.times)) > 1:  # an output may lie between the two ends
            return f"ended elsewhere than the reference: {trajectory.reason}"
        return difference(event_times(trajectory), self.events)


def with_stored_times(subject: Subject) -> Subject:
    """Return the subject with outputs at the known states of a tight run; unchanged if that run fails."""
    try:
        found = subject.tight(subject.methods()[0], MIN_RTOL)
    except InputError:
        return subject
    run, times = subject.case.run, fewer(found.stored).result.times
    # Towards an event states may change like a square root, so that next to it errors are those of rounding in time.
    moments = np.concatenate([[0.0], *event_times(found).values()])
    times = times[np.all(np.abs(times[:, None] - moments) > SQRT_EPS * moments, axis=1)]
    times = np.union1d(times, [0.0, run.times[-1]])
    return subject._replace(case=replace(subject.case, own_run=replace(run, times=tuple(times.tolist()), picture=None)))


def establish(subject: Subject, variables: Sequence[str]) -> Truth:
    """Return the truth of a case; InputError if none can be found."""
    reference = subject.case.reference
    if reference is None:
        return numerical(subject, variables)
    trajectory, scene = subject.tight(subject.methods()[0], MIN_RTOL), subject.case.scene
    result = trajectory.result
    # A second evaluation at times one rounding earlier gives the effect of rounding on the exact values.
    perturbed = replace(trajectory, result=result._replace(times=result.times * (1 - EPS)))
    try:
        named = reference.name, reference.options
        exact, moved = (
            exact_values(match(*named, SceneView(scene, run)), scene, run) for run in (trajectory, perturbed)
        )
    except InputError as error:
        found = numerical(subject, variables)
        unused = f"the exact solution {reference.name} does not apply to this scene: {error.message}"
        return found._replace(source=f"{found.source}; {unused}")
    # Variables and event times that the exact solution does not give are those of two methods.
    known = {name: exact[name] for name in variables if name in exact}
    whole, others = Truth.of(trajectory, "", variables), [name for name in variables if name not in known]
    beside = numerical(subject, others) if others or event_times(trajectory) else whole
    beside = beside._replace(floors=whole.floors)
    noise = beside._replace(times=result.times, values=known, events={}).errors(moved, {})
    uncertain = {**beside.uncertainty, **{key: error + EPS for key, error in noise.items()}}
    others += ["events"] if beside.events else []
    source = f"exact solution {reference.name}" + (f"; {', '.join(others)}: {beside.source}" if others else "")
    values = {**beside.values, **known}
    return beside._replace(source=source, times=result.times, values=values, uncertainty=uncertain)


def numerical(subject: Subject, variables: Sequence[str]) -> Truth:
    """Return the truth from the two methods that agree best; InputError if no two agree."""
    name = subject.case.name
    found: list[Truth] = []
    failures = []
    for method in subject.methods():
        if len(found) == 2 and _apart(*found) <= REFERENCE_ERROR:
            break
        try:
            found.append(_extrapolated(subject, method, variables))
        except InputError as error:
            failures.append(error.message)
    if not found:
        raise InputError("; ".join(failures))
    if len(found) == 1:
        return found[0]._replace(source=f"{found[0].source} alone, which no second method confirms")
    first, second = min(combinations(found, 2), key=lambda pair: _apart(*pair))
    methods, largest = f"{first.source} and {second.source}", _apart(first, second)
    if math.isinf(largest):
        raise InputError(f"{name} has no reference: its methods come to different ends or events.")
    if not largest <= AGREEMENT:
        raise InputError(f"{name} has no reference: the methods that agree best, {methods}, differ by {largest:.1e}.")
    source = f"{methods}, extrapolated from rtol {MIN_RTOL * TEN:.0e} and {MIN_RTOL:.0e}"
    apart, own = first.errors(second.values, second.events), first.uncertainty
    larger = {key: max(apart.get(key, 0.0), own.get(key, 0.0)) for key in {**apart, **own}}
    return first._replace(source=source, uncertainty=larger)


def _apart(a: Truth, b: Truth) -> float:
    """Return the largest difference of two methods; infinite if their ends or events differ."""
    if a.status != b.status or difference(a.events, b.events) or len(a.times) != len(b.times):
        return math.inf
    return float(np.nan_to_num(worst(a.errors(b.values, b.events), "max", "event"), nan=math.inf))


def _extrapolated(subject: Subject, method: str, variables: Sequence[str]) -> Truth:
    """Return values and event times of one method; their uncertainty is the size of the extrapolation."""
    loose, tight = (subject.tight(method, rtol) for rtol in (MIN_RTOL * TEN, MIN_RTOL))
    n = min(len(loose.result.times), len(tight.result.times))
    before, after = ({name: computed(run)[name][:n] for name in variables} for run in (loose, tight))
    events, last = event_times(loose), event_times(tight)
    if loose.status != tight.status or difference(events, last):
        name = subject.case.name
        raise InputError(f"{name} has no reference: {method} comes to other ends or events when it is tighter.")
    values = {name: _limit(before[name], after[name]) for name in variables}
    whole = Truth.of(tight, method, variables)
    limits = {name: _limit(events[name], last[name]) for name in last}
    truth = whole._replace(times=whole.times[:n], values=values, events=limits)
    return truth._replace(uncertainty=truth.errors(after, last))


def _limit(loose: Array, tight: Array) -> Array:
    """Extrapolate errors in proportion to the tolerance (Richardson)."""
    return np.asarray(tight + (tight - loose) / (TEN - 1))


log = logging.getLogger(__name__)

REPEAT, MOST_REPEAT = 5, 1000

# Counts of a solver.
COUNTS = {
    "steps": "steps taken",
    "rejected": "steps rejected",
    "residuals": "right-hand sides that the solver asked for",
    "jacobians": "Jacobians",
    "factorizations": "matrices factored",
}

HEADING = ("solver", "rtol", "final", "max", "L2", "events", "energy", "time", "median", "longest", "in steps", *COUNTS)

METHOD = f"""\
Runs are compared where a tight one is looked at: at the ends of its steps and inside them, 400 times at most. Errors of
states are relative to the true value at the same time and what it changes by within the time that has passed, at most
to its largest value; of other variables to that. Of the compared variables the worst counts. L2 is the root mean square
in time. Errors of events are relative to the time of the event. Errors marked < are below the uncertainty of the
reference and say no more than that. Energy is the largest
energy residual of the run relative to the energy exchanged; it needs no reference.

Times are of the run alone, with all output times, events and the ledger of the balances, after a first run that warms
up. Rounds are interleaved over solvers and tolerances; runs below {BRIEF_RUN:g} s are repeated within a round, solves
that have taken {ROUND_SECONDS:g} s together are not timed again. The least time counts; median and longest show the
spread. Compilation is apart.

Libraries are called step by step from Python through the adapters of this package, which look for events within each
step, write the outputs and integrate the ledger of the balances. "In steps" is the part of the time inside the
library's own steps, with the right-hand sides that it asked for: the least that a leaner adapter could come to. radau
does all of it in compiled code. A count that a library does not tell is left empty.
"""


@dataclass
class WorkPoint(Cell):
    """One solver at one tolerance: 'finished', 'stopped' by physics as in the reference, 'failed', or 'omitted'."""

    errors: Errors | None = None
    energy: float = math.nan

    def error(self, kind: str, variable: str = "") -> float:
        """Return the error of a variable, else the largest; NaN if there is none."""
        errors = self.errors or {}
        return errors.get((kind, variable), math.nan) if variable else worst(errors, kind)


class ComparedCase(NamedTuple):
    """A case with its reference, or the reason why there is none, and its points by solver and tolerance."""

    subject: Subject
    variables: Sequence[str]
    truth: Truth | None
    reference: str
    points: Mapping[tuple[str, float], WorkPoint]

    @property
    def name(self) -> str:
        """The name of the case."""
        return self.subject.case.name

    def uncertainty(self, kind: str) -> float:
        """Return the uncertainty of the reference; NaN if there is none."""
        return worst(self.truth.uncertainty, kind) if self.truth else math.nan


def precision(
    cases: str | Path | Sequence[str | Path],
    solvers: Sequence[str] = known_solvers,
    tolerances: Sequence[float] = TOLERANCES,
    variables: Sequence[str] = (),
    repeat: int = REPEAT,
    overrides: Sequence[str] | Mapping[str, object] = (),
) -> Study:
    """Run cases with several solvers over tolerances and compare them with a reference: error against run time.

    Parameters
    ----------
    cases
        Names or files of cases.
    solvers
        Names of solvers.
    tolerances
        Relative tolerances.
    variables
        States or named quantities whose errors count, the states if none are given.
    repeat
        Number of timed rounds.
    overrides
        Changes of values of every case, as for :func:`load`.

    Returns
    -------
    Study
        Dataset, figure and report.

    Raises
    ------
    InputError
        If a name is unknown, before anything runs.
    """
    check_options(solvers, tolerances, repeat, (1, MOST_REPEAT), ("solvers", "tolerances", "repeat"))
    cases = [cases] if isinstance(cases, str | Path) else cases
    expect(cases, Collection, "cases are names or files", Place(path="cases"))
    subjects = _subjects(cases, overrides, variables)
    tolerances = sorted(set(map(float, tolerances)), reverse=True)
    solvers, variables = tuple(dict.fromkeys(solvers)), tuple(dict.fromkeys(variables))
    compared = [_compared(one, variables, solvers, tolerances, repeat) for one in subjects]
    options = ["--solvers", ",".join(solvers), "--tolerances", ",".join(map(repr, tolerances))]
    options += ["--repeat", str(repeat), *(["--variables", ",".join(variables)] if variables else [])]
    status = "finished" if all(case.truth for case in compared) else "failed"
    return Study(
        kind="precision",
        title=f"Error against run time: {', '.join(case.name for case in compared)}",
        arguments=[*map(str, cases), *options, *(word for text in as_texts(overrides) for word in ("--set", text))],
        axes={
            "tolerance": tolerances,
            "case": compared,
            "solver": solvers,
            "variable": list(dict.fromkeys(name for case in compared for name in case.variables)),
        },
        variables=list(_variables()),
        sections=list(_sections(compared)),
        omissions=list(_omissions(compared)),
        settings={"repeat": repeat, "status": status},
        status=status,
    )


def _subjects(
    cases: Sequence[str | Path], overrides: Sequence[str] | Mapping[str, object], variables: Sequence[str]
) -> list[Subject]:
    """Return the cases; InputError for a case given twice, and for a variable that none has."""
    subjects = [subject(load(name, overrides)) for name in cases]
    if not subjects:
        raise InputError("at least one is needed.", Place(path="cases"))
    names = [one.case.name for one in subjects]
    if twice := next((name for name in names if names.count(name) > 1), None):
        raise InputError(f"the case {twice} is given twice.")
    if lone := next((one.case for one in subjects if not (variables or one.states)), None):
        text = "nothing evolves whose error could be compared; name what follows, `--variables t_n` for instance."
        raise lone.located(InputError(text, Place(path="bodies")))
    known = {name for one in subjects for name in one.names}
    refuse_unknown(variables, known, "no variable '{}' in the cases", Place(path="variables"))
    return subjects


def subject(simulation: Simulation) -> Subject:
    """Return a case as subject of the study; InputError if it cannot start."""
    case, model = simulation.case, simulation.model
    with case.locating():
        model.problem(case.run, model.values())
    return Subject(case, model)


def _compared(
    subject: Subject, wanted: Sequence[str], solvers: Sequence[str], tolerances: Sequence[float], repeat: int
) -> ComparedCase:
    """Measure a case: its states, or the wanted variables that it has."""
    name, known = subject.case.name, subject.names
    variables = tuple(name for name in wanted if name in known) or tuple(subject.states)
    log.info("%s: its reference", name)
    truth: Truth | None = None
    subject = with_stored_times(subject)
    try:
        truth = establish(subject, variables)
        reference = truth.source
    except InputError as error:
        reference = error.message
    numbers, cells = count(), len(solvers) * len(tolerances)

    def measured(rtol: float, solver: str) -> WorkPoint:
        log.info("%s: %s at rtol %g", name, solver, rtol, extra={"done": next(numbers), "total": cells})
        if unable := subject.unable(solver):
            return WorkPoint("omitted", unable)
        return attempt(partial(subject.solve, solver, rtol), partial(_judged, truth))

    points = filled(solvers, {rtol: partial(measured, rtol) for rtol in tolerances}, repeat)
    return ComparedCase(subject, variables, truth, reference, points)


def _judged(truth: Truth | None, done: Trajectory | Exception) -> WorkPoint:
    if isinstance(done, Exception):
        return WorkPoint("failed", f"{type(done).__name__}: {done}")
    objection = truth.objection(done) if truth else done.reason if done.status == "failed" else ""
    if objection:
        return WorkPoint("failed", objection)
    errors = truth.errors(computed(done), event_times(done)) if truth else None
    if errors and not all(map(math.isfinite, errors.values())):
        return WorkPoint("failed", "values are not finite")
    return WorkPoint(done.status, done.reason, errors, audit(done).energy_error)


# -- the dataset -------------------------------------------------------------------------------------------------------


def _variables() -> Iterator[Variable]:
    """Yield the variables over case, solver and tolerance, the coordinates first."""
    every = ("case", "solver", "tolerance")
    yield Variable("tolerance", ("tolerance",), float, "1", "relative tolerance asked for")
    yield Variable("case_name", ("case",), lambda case: case.name, "1", "name of the case")
    yield Variable("solver_name", ("solver",), str, "1", "name of the solver")
    yield Variable("variable_name", ("variable",), str, "1", "name of the compared variable")
    yield Variable("title", ("case",), lambda case: case.subject.case.title, "1", "title of the case")
    yield Variable("case_text", ("case",), lambda case: case.subject.case.text, "1", "the case itself")
    yield Variable("reference", ("case",), lambda case: case.reference, "1", "what the runs are held against")
    text = "time to compile the equations of the case"
    yield Variable("compile_seconds", ("case",), lambda case: case.subject.model.compile_seconds, "s", text)
    for kind, text in MEANING.items():
        known, text = partial(ComparedCase.uncertainty, kind=kind), f"uncertainty of the reference: {text}"
        yield Variable(f"uncertainty_{kind}", ("case",), known, "1", text)
    inside = "least time inside the library's own steps"
    of_point: list[tuple[str, str, str, Callable[[WorkPoint], float | str]]] = [
        ("status", "1", "finished, stopped, failed or omitted", lambda p: p.outcome),
        ("reason", "1", "why the run ended, failed or was left out", lambda p: p.reason),
        *((f"error_{kind}", "1", text, partial(WorkPoint.error, kind=kind)) for kind, text in MEANING.items()),
        ("energy_error", "1", "largest energy residual relative to the energy exchanged", lambda p: p.energy),
        ("run_seconds", "s", "least run time", lambda p: min(p.seconds, default=math.nan)),
        ("run_seconds_median", "s", "median run time", lambda p: median(p.seconds or [math.nan])),
        ("run_seconds_max", "s", "longest run time", lambda p: max(p.seconds, default=math.nan)),
        ("stepping_seconds", "s", inside, lambda p: min(p.stepping, default=math.nan)),
        ("repetitions", "1", "number of timed runs", lambda p: float(len(p.seconds))),
        *((f"count_{name}", "1", text, partial(WorkPoint.count, name=name)) for name, text in COUNTS.items()),
    ]
    for name, unit, text, read in of_point:
        yield Variable(name, every, lambda case, s, rtol, read=read: read(case.points[s, rtol]), unit, text)
    for kind in NORMS:
        each = partial(lambda case, s, rtol, name, kind: case.points[s, rtol].error(kind, name), kind=kind)
        yield Variable(f"variable_error_{kind}", (*every, "variable"), each, "1", f"{MEANING[kind]} of each variable")


# -- the report --------------------------------------------------------------------------------------------------------


def _sections(compared: Sequence[ComparedCase]) -> Iterator[PageSection]:
    yield PageSection("Run time against error", figure=True, details=True)
    for case in compared:
        yield from _of_case(case)
    yield PageSection("How it was measured", METHOD.split("\n\n"), details=True)
    for case in compared:
        yield PageSection(f"Case {case.name}", [case.subject.case.text], details=True)


def _of_case(case: ComparedCase) -> Iterator[PageSection]:
    lines = [f"reference  {case.reference}"]
    if case.truth:
        uncertain = [f"{kind} {case.uncertainty(kind):.1e}" for kind in NORMS]
        uncertain += [f"events {case.uncertainty('event'):.1e}"] * bool(case.truth.events)
        lines.append(f"uncertain  {', '.join(uncertain)}")
    lines.append(f"variables  {', '.join(case.variables)}")
    lines.append(f"compile    {duration(case.subject.model.compile_seconds)}")
    points = [point for point in case.points.values() if point.outcome != "omitted"]
    marked = [i for i, point in enumerate(points) if point.outcome == "failed"]
    tables = [PageTable(HEADING, [_row(point, case) for point in points], marked=marked)]
    failures = [(points[i].solver, f"{points[i].value:.0e}", points[i].reason) for i in marked]
    tables += [PageTable(("failed", "rtol", "why"), failures)] * bool(failures)
    yield PageSection(f"{case.name}: {case.subject.case.title}", lines, tables)
    rows = [
        (point.solver, f"{point.value:.0e}", name, *(f"{point.error(kind, name):.1e}" for kind in NORMS))
        for point in points
        for name in (case.variables if point.errors else ())
    ]
    heading, caption = ("solver", "rtol", "variable", "final", "max", "L2"), "; ".join(MEANING[kind] for kind in NORMS)
    yield PageSection(f"{case.name}, variable by variable", tables=[PageTable(heading, rows, caption)], details=True)


def _row(point: WorkPoint, case: ComparedCase) -> list[str]:
    """Return a row of the table; errors below the uncertainty of the reference are marked."""
    seconds = [f(point.seconds or [math.nan]) for f in (min, median, max)]
    times = ["" if math.isnan(t) else duration(t) for t in (*seconds, min(point.stepping, default=math.nan))]
    counts = ["" if math.isnan(n) else f"{n:.0f}" for n in map(point.count, COUNTS)]
    errors = ["failed", "", "", "", ""]
    if point.outcome != "failed":
        pairs = [(point.error(kind), case.uncertainty(kind)) for kind in MEANING]
        errors = ["" if math.isnan(e) else f"<{limit:.1e}" if e < limit else f"{e:.1e}" for e, limit in pairs]
        errors.append(f"{point.energy:.1e}")
    return [point.solver, f"{point.value:.0e}", *errors, *times, *counts]


def _omissions(compared: Sequence[ComparedCase]) -> Iterator[str]:
    """Yield solvers that cannot run a case, and cases without a reference."""
    points = [(case, point) for case in compared for point in case.points.values() if point.outcome == "omitted"]
    yield from dict.fromkeys(f"{case.name}: {point.solver}: {point.reason}" for case, point in points)
    yield from (f"{case.name}: no errors: {case.reference}" for case in compared if case.truth is None)
