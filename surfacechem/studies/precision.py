"""Error against run time: cases over tolerances and solvers, compared with a reference of known uncertainty."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import count
from pathlib import Path
from statistics import median

from surfacechem.documents.document import as_texts
from surfacechem.errors import InputError, Place, refuse_unknown
from surfacechem.results.audit import audit
from surfacechem.results.error_estimates import computed
from surfacechem.results.event_table import event_times
from surfacechem.runs.simulation import Simulation, load
from surfacechem.runs.summaries import duration
from surfacechem.solve import names as known_solvers
from surfacechem.solve.run import Trajectory
from surfacechem.studies.grid import BRIEF_RUN, ROUND_SECONDS, Cell, attempt, check_options, filled
from surfacechem.studies.report import PageSection, PageTable, Study, Variable
from surfacechem.studies.truth import MEANING, NORMS, TOLERANCES, Errors, Subject, Truth, establish, with_stored_times

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
        if self.errors is None:
            return math.nan
        return self.errors.by_kind[kind].get(variable, math.nan) if variable else self.errors.worst(kind)


@dataclass(frozen=True)
class ComparedCase:
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
        return self.truth.uncertainty.worst(kind) if self.truth else math.nan


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
    try:
        model.problem(case.run, model.values())
    except InputError as error:
        raise case.located(error) from None
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
    if errors and not all(math.isfinite(error) for kind in errors.by_kind.values() for error in kind.values()):
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
    of_point: list[tuple[str, str, str, Callable[[WorkPoint], float | str]]] = [
        ("status", "1", "finished, stopped, failed or omitted", lambda p: p.outcome),
        ("reason", "1", "why the run ended, failed or was left out", lambda p: p.reason),
        *((f"error_{kind}", "1", text, partial(WorkPoint.error, kind=kind)) for kind, text in MEANING.items()),
        ("energy_error", "1", "largest energy residual relative to the energy exchanged", lambda p: p.energy),
        ("run_seconds", "s", "least run time", lambda p: min(p.seconds, default=math.nan)),
        ("run_seconds_median", "s", "median run time", lambda p: median(p.seconds or [math.nan])),
        ("run_seconds_max", "s", "longest run time", lambda p: max(p.seconds, default=math.nan)),
        (
            "stepping_seconds",
            "s",
            "least time inside the library's own steps",
            lambda p: min(p.stepping, default=math.nan),
        ),
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
