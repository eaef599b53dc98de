"""Error against run time: cases over tolerances and solvers, against a reference whose own uncertainty is stated."""

from __future__ import annotations

import logging
import math
import shlex
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from statistics import median

from surfacechem.errors import InputError, Place, suggestion
from surfacechem.results.achieved import computed
from surfacechem.results.audit import audit
from surfacechem.results.event_table import event_times
from surfacechem.runs.report import duration
from surfacechem.runs.simulation import Simulation, load
from surfacechem.solve import names as known_solvers
from surfacechem.solve.radau.solver import LOOSEST
from surfacechem.solve.run import Trajectory
from surfacechem.studies.grid import BRIEF, BUDGET, Cell, attempt, check_range, check_solvers, filled
from surfacechem.studies.report import Section, Study, Table, Variable
from surfacechem.studies.truth import KINDS, MEANING, Errors, Subject, Truth, establish

log = logging.getLogger(__name__)

TOLERANCES = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
REPEAT, MOST_REPEAT = 5, 1000

COUNTS = {
    "steps": "steps taken",
    "rejected": "steps rejected",
    "residuals": "right-hand sides that the solver asked for",
    "jacobians": "Jacobians",
    "factorizations": "matrices factored",
}
"""What a solver counts."""

HEADING = ("solver", "rtol", "final", "max", "L2", "events", "energy", "time", "median", "longest", "in steps", *COUNTS)

METHOD = f"""\
Errors are relative to the true value at the same time, or to 1e-9 (states; 1 for other variables) of its largest value
if that is more; of the compared variables the worst counts. L2 is the root mean square in time. Errors of events are
relative to the time of the event. Errors marked < are below the uncertainty of the reference and say no more than that.
Energy is the largest energy residual of the run relative to the energy exchanged; it needs no reference.

Times are of the run alone, with all output times, events and the ledger of the balances, after a first run that warms
up. Rounds are interleaved over solvers and tolerances; runs below {BRIEF:g} s are repeated within a round, solves that
have taken {BUDGET:g} s together are not timed again. The least time counts; median and longest show the spread.
Compilation is apart.

Libraries are called step by step from Python through the adapters of this package, which look for events within each
step, write the outputs and integrate the ledger of the balances. "In steps" is the part of the time inside the
library's own steps, with the right-hand sides that it asked for: the least that a leaner adapter could come to. radau
does all of it in compiled code; it takes tolerances above {LOOSEST:g} as {LOOSEST:g}. A count that a library does not
tell is left empty.
"""


@dataclass
class Point(Cell):
    """One solver at one tolerance: 'finished', 'stopped' by physics as the reference, 'failed', or 'omitted'."""

    errors: Errors | None = None
    energy: float = math.nan


@dataclass(frozen=True)
class Compared:
    """One case: what it was held against, or why there is nothing, and its points by solver and tolerance."""

    subject: Subject
    variables: Sequence[str]
    truth: Truth | None
    reference: str
    points: Mapping[tuple[str, float], Point]


def precision(
    cases: str | Path | Sequence[str | Path],
    solvers: Sequence[str] = known_solvers,
    tolerances: Sequence[float] = TOLERANCES,
    variables: Sequence[str] = (),
    repeat: int = REPEAT,
    overrides: Sequence[str] | Mapping[str, object] = (),
) -> Study:
    """Run cases with several solvers over tolerances and hold them against a reference: error against run time.

    ``variables`` are states or named quantities whose errors count, the states if none are given; ``repeat`` is the
    number of timed rounds; ``overrides`` change values of every case, as for ``load``. InputError for what is unknown,
    before anything runs.
    """
    check_solvers(solvers, "solvers")
    for rtol in tolerances:
        check_range(rtol, 0 < rtol <= 0.1, "> 0 and <= 0.1", "tolerances")
    if len(tolerances) == 0:
        raise InputError("at least one is needed.", Place(path="tolerances"))
    check_range(repeat, 1 <= repeat <= MOST_REPEAT, f">= 1 and <= {MOST_REPEAT}", "repeat")
    subjects = [subject(load(name, overrides)) for name in ([cases] if isinstance(cases, str | Path) else cases)]
    names = [one.case.name for one in subjects]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"the case {name} is given twice.")
    known = {name for one in subjects for name in one.names}
    for name in variables:
        if name not in known:
            raise InputError(f"no variable '{name}' in the cases.{suggestion(name, known)}", Place(path="variables"))
    tolerances = sorted(set(map(float, tolerances)), reverse=True)
    solvers, variables = tuple(dict.fromkeys(solvers)), tuple(dict.fromkeys(variables))
    compared = [_compared(one, variables, solvers, tolerances, repeat) for one in subjects]
    words = ["surfacechem", "precision", *names, "--solvers", ",".join(solvers)]
    words += ["--tolerances", ",".join(f"{rtol:g}" for rtol in tolerances), "--repeat", str(repeat)]
    words += ["--variables", ",".join(variables)] if variables else []
    changes = [f"{path}={value}" for path, value in overrides.items()] if isinstance(overrides, Mapping) else overrides
    status = "finished" if all(case.truth for case in compared) else "failed"
    return Study(
        kind="precision",
        title=f"Error against run time: {', '.join(names)}",
        command=shlex.join([*words, *(word for text in changes for word in ("--set", text))]),
        axes={
            "tolerance": tolerances,
            "case": compared,
            "solver": solvers,
            "variable": list(dict.fromkeys(name for case in compared for name in case.variables)),
        },
        variables=list(_variables()),
        coordinates=["tolerance"],
        sections=list(_sections(compared)),
        omissions=list(_omissions(compared)),
        settings={"repeat": repeat, "status": status},
        status=status,
    )


def subject(simulation: Simulation) -> Subject:
    """A case as the study sees it; InputError where it cannot start."""
    case, model = simulation.case, simulation.model
    try:
        model.problem(case.run, model.values())
    except InputError as error:
        raise case.located(error) from None
    return Subject(case, model)


def _compared(
    subject: Subject, wanted: Sequence[str], solvers: Sequence[str], tolerances: Sequence[float], repeat: int
) -> Compared:
    """A case measured: its states, or those of the wanted variables that it has."""
    name, known = subject.case.name, subject.names
    variables = tuple(name for name in wanted if name in known) or tuple(subject.states)
    log.info("%s: its reference", name)
    truth, reference = None, ""
    try:
        truth = establish(subject, variables)
        reference = truth.source
    except InputError as error:
        reference = error.message
    log.info("%s: %d solvers at %d tolerances", name, len(solvers), len(tolerances))

    points = filled(solvers, tolerances, lambda rtol: partial(_attempt, subject, truth, rtol), repeat)
    return Compared(subject, variables, truth, reference, points)


def _attempt(subject: Subject, truth: Truth | None, rtol: float, solver: str) -> Point:
    if unable := subject.unable(solver):
        return Point("omitted", unable)
    return attempt(partial(subject.solve, solver, rtol), partial(_judged, truth))


def _judged(truth: Truth | None, done: Trajectory | Exception) -> Point:
    if isinstance(done, Exception):
        return Point("failed", f"{type(done).__name__}: {done}")
    objection = done.reason if done.status == "failed" else ""
    if objection := (truth.objection(done) if truth else objection):
        return Point("failed", objection)
    errors = truth.errors(computed(done), event_times(done)) if truth else None
    if errors and not all(math.isfinite(error) for kind in errors.by_kind.values() for error in kind.values()):
        return Point("failed", "values are not finite")
    return Point(done.status, done.reason, errors, audit(done).energy_error)


# -- the dataset -------------------------------------------------------------------------------------------------------


def _variables() -> Iterator[Variable]:
    """The variables over case, solver and tolerance, the coordinates first."""
    yield Variable("tolerance", ("tolerance",), float, "1", "relative tolerance asked for")
    yield Variable("case_name", ("case",), lambda case: case.subject.case.name, "1", "name of the case")
    yield Variable("solver_name", ("solver",), str, "1", "name of the solver")
    yield Variable("variable_name", ("variable",), str, "1", "name of the compared variable")
    yield Variable("title", ("case",), lambda case: case.subject.case.title, "1", "title of the case")
    yield Variable("case_text", ("case",), lambda case: case.subject.case.text, "1", "the case itself")
    yield Variable("reference", ("case",), lambda case: case.reference, "1", "what the runs are held against")
    compile_seconds, text = (
        (lambda case: case.subject.model.compile_seconds),
        "time to compile the equations of the case",
    )
    yield Variable("compile_seconds", ("case",), compile_seconds, "s", text)
    for kind, text in MEANING.items():
        known, text = partial(_uncertainty, kind=kind), f"uncertainty of the reference: {text}"
        yield Variable(f"uncertainty_{kind}", ("case",), known, "1", text)
    cells: list[tuple[str, Callable[[Point], float | str], str, str]] = [
        ("status", lambda point: point.outcome, "1", "finished, stopped, failed or omitted"),
        ("reason", lambda point: point.reason, "1", "why the run ended, failed or was left out"),
        *((f"error_{kind}", partial(_error, kind=kind), "1", text) for kind, text in MEANING.items()),
        ("energy_error", lambda p: p.energy, "1", "largest energy residual relative to the energy exchanged"),
        ("run_seconds", lambda p: min(p.seconds, default=math.nan), "s", "least run time"),
        ("run_seconds_median", lambda p: median(p.seconds or [math.nan]), "s", "median run time"),
        ("run_seconds_max", lambda p: max(p.seconds, default=math.nan), "s", "longest run time"),
        ("stepping_seconds", _stepping, "s", "least time inside the library's own steps"),
        ("repetitions", lambda p: float(len(p.seconds)), "1", "number of timed runs"),
    ]
    every = ("case", "solver", "tolerance")
    for name, read, unit, text in cells:
        yield Variable(name, every, lambda case, s, rtol, read=read: read(case.points[s, rtol]), unit, text)
    for name, text in COUNTS.items():
        count = partial(lambda case, s, rtol, name: case.points[s, rtol].count(name, s), name=name)
        yield Variable(f"count_{name}", every, count, "1", text)
    for kind in KINDS:
        each = partial(lambda case, s, rtol, name, kind: _error(case.points[s, rtol], kind, name), kind=kind)
        yield Variable(f"variable_error_{kind}", (*every, "variable"), each, "1", f"{MEANING[kind]} of each variable")


def _uncertainty(case: Compared, kind: str) -> float:
    return case.truth.uncertainty.worst(kind) if case.truth else math.nan


def _error(point: Point, kind: str, variable: str = "") -> float:
    if point.errors is None:
        return math.nan
    return point.errors.by_kind[kind].get(variable, math.nan) if variable else point.errors.worst(kind)


def _stepping(point: Point) -> float:
    """Least time inside a library's own steps; not a number for a method that does outputs and events itself."""
    return min(point.stepping, default=math.nan)


# -- the report --------------------------------------------------------------------------------------------------------


def _sections(compared: Sequence[Compared]) -> Iterator[Section]:
    yield Section("Run time against error", figure=True, details=True)
    for case in compared:
        yield _of_case(case)
        rows = [
            (solver, f"{rtol:.0e}", name, *(f"{point.errors.by_kind[kind][name]:.1e}" for kind in KINDS))
            for (solver, rtol), point in case.points.items()
            if point.errors
            for name in case.variables
        ]
        heading = ("solver", "rtol", "variable", "final", "max", "L2")
        table = Table(heading, rows, "; ".join(MEANING[kind] for kind in KINDS))
        yield Section(f"{case.subject.case.name}, variable by variable", tables=[table], details=True)
    yield Section("How it was measured", METHOD.split("\n\n"), details=True)
    for case in compared:
        yield Section(f"Case {case.subject.case.name}", [case.subject.case.text], details=True)


def _of_case(case: Compared) -> Section:
    lines = [f"reference  {case.reference}"]
    if case.truth:
        uncertain = {kind: case.truth.uncertainty.worst(kind) for kind in KINDS}
        uncertain |= {"events": case.truth.uncertainty.worst("event")} if case.truth.events else {}
        lines.append(f"uncertain  {', '.join(f'{kind} {error:.1e}' for kind, error in uncertain.items())}")
    lines.append(f"variables  {', '.join(case.variables)}")
    lines.append(f"compile    {duration(case.subject.model.compile_seconds)}")
    points = {key: point for key, point in case.points.items() if point.outcome != "omitted"}
    failures = [(s, f"{rtol:.0e}", p.reason) for (s, rtol), p in points.items() if p.outcome == "failed"]
    rows = [_row(solver, rtol, point, case.truth) for (solver, rtol), point in points.items()]
    marked = [i for i, point in enumerate(points.values()) if point.outcome == "failed"]
    tables = [Table(HEADING, rows, marked=marked), *([Table(("failed", "rtol", "why"), failures)] if failures else [])]
    return Section(f"{case.subject.case.name}: {case.subject.case.title}", lines, tables)


def _row(solver: str, rtol: float, point: Point, truth: Truth | None) -> list[str]:
    """A line of the table: errors, of which those below the uncertainty of the reference say no more than that."""
    seconds = [f(point.seconds or [math.nan]) for f in (min, median, max)]
    times = ["" if math.isnan(t) else duration(t) for t in (*seconds, _stepping(point))]
    counts = ["" if math.isnan(n) else f"{n:.0f}" for n in (point.count(name, solver) for name in COUNTS)]
    errors = ["failed", "", "", "", ""]
    if point.outcome != "failed":
        errors = []
        for kind in MEANING:
            error, limit = _error(point, kind), truth.uncertainty.worst(kind) if truth else math.nan
            errors.append("" if math.isnan(error) else f"<{limit:.1e}" if error < limit else f"{error:.1e}")
        errors.append(f"{point.energy:.1e}")
    return [solver, f"{rtol:.0e}", *errors, *times, *counts]


def _omissions(compared: Sequence[Compared]) -> Iterator[str]:
    """Solvers that cannot run a case, and cases without a reference."""
    left_out = [
        f"{case.subject.case.name}: {solver}: {point.reason}"
        for case in compared
        for (solver, _), point in case.points.items()
        if point.outcome == "omitted"
    ]
    yield from dict.fromkeys(left_out)
    for case in compared:
        if case.truth is None:
            yield f"{case.subject.case.name}: no errors: {case.reference}"
