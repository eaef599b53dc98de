"""The report of a study: figure, tables, the reference of each case, failures, omissions and how it was timed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from statistics import median
from typing import TYPE_CHECKING

from surfacechem.runs.report import duration
from surfacechem.solve.radau.solver import LOOSEST
from surfacechem.studies.precision.columns import COUNTS, count, stepping
from surfacechem.studies.precision.errors import KINDS, MEANING
from surfacechem.studies.precision.measure import BRIEF, BUDGET, Point
from surfacechem.studies.precision.plan import Measured
from surfacechem.studies.report import Page, Section, Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from surfacechem.studies.precision.truth import Truth

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


def page(title: str, command: str, measured: Sequence[Measured], figure: Figure) -> Page:
    """The report."""
    overview = Section("Run time against error", figures=[figure], details=True)
    method = Section("How it was measured", METHOD.split("\n\n"), details=True)
    cases = [section for case in measured for section in (_case(case), _variables(case))]
    texts = [Section(f"Case {c.subject.name}", [c.subject.text], details=True) for c in measured]
    return Page(title, command, [overview, *cases, method, *texts], _omissions(measured))


def _case(case: Measured) -> Section:
    rows = [_row(point, case.truth) for point in case.points if point.status != "omitted"]
    marked = [i for i, row in enumerate(rows) if row[2] == "failed"]
    lines = [f"{case.subject.name}: {case.subject.title}", f"reference  {case.reference}"]
    if case.truth:
        lines.append(f"uncertain  {_uncertainty(case.truth)}")
    lines.append(f"variables  {', '.join(case.variables)}")
    lines.append(f"compile    {duration(case.subject.model.compile_seconds)}")
    failures = [(point.solver, f"{point.rtol:.0e}", point.reason) for point in case.points if point.status == "failed"]
    tables = [Table(HEADING, rows, marked=marked)]
    tables += [Table(("failed", "rtol", "why"), failures)] if failures else []
    return Section(lines[0], lines[1:], tables)


def _uncertainty(truth: Truth) -> str:
    parts = [f"{kind} {truth.uncertainty.worst(kind):.1e}" for kind in KINDS]
    events = [f"events {truth.uncertainty.event:.1e}"] if truth.events else []
    return ", ".join([*parts, *events])


def _row(point: Point, truth: Truth | None) -> list[str]:
    seconds = point.seconds
    times = [duration(f(seconds)) for f in (min, median, max)] if seconds else ["", "", ""]
    inside = stepping(point)
    times.append("" if math.isnan(inside) else duration(inside))
    counts = [_whole(count(point, name)) for name in COUNTS]
    if point.status == "failed":
        return [point.solver, f"{point.rtol:.0e}", "failed", "", "", "", "", *times, *counts]
    errors = [_error(point, truth, kind) for kind in (*KINDS, "event")]
    return [point.solver, f"{point.rtol:.0e}", *errors, f"{point.energy:.1e}", *times, *counts]


def _error(point: Point, truth: Truth | None, kind: str) -> str:
    if point.errors is None or truth is None or math.isnan(point.errors.worst(kind)):
        return ""
    error, limit = point.errors.worst(kind), truth.uncertainty.worst(kind)
    return f"<{limit:.1e}" if error < limit else f"{error:.1e}"


def _whole(number: float) -> str:
    return "" if math.isnan(number) else f"{number:.0f}"


def _variables(case: Measured) -> Section:
    """Errors of each variable, for the page only."""
    rows = [
        [point.solver, f"{point.rtol:.0e}", name, *(f"{point.errors.by_kind[kind][name]:.1e}" for kind in KINDS)]
        for point in case.points
        if point.errors
        for name in case.variables
    ]
    table = Table(
        ("solver", "rtol", "variable", "final", "max", "L2"), rows, "; ".join(MEANING[kind] for kind in KINDS)
    )
    return Section(f"{case.subject.name}, variable by variable", tables=[table], details=True)


def _omissions(cases: Sequence[Measured]) -> list[str]:
    """Solvers that cannot run a case, and cases without a reference."""
    found = [
        f"{case.subject.name}: {point.solver}: {point.reason}"
        for case in cases
        for point in case.points
        if point.status == "omitted"
    ]
    missing = [f"{case.subject.name}: no errors: {case.untrue}" for case in cases if not case.truth]
    return [*dict.fromkeys(found), *missing]
