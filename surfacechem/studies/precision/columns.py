"""The variables of the dataset of a study, over case, solver and tolerance."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from statistics import median

import numpy as np
from numpy.typing import NDArray

from surfacechem.results.netcdf import Column
from surfacechem.solve import solver as method
from surfacechem.studies.precision.errors import KINDS, MEANING
from surfacechem.studies.precision.measure import Point
from surfacechem.studies.precision.plan import Measured, Plan

POINT = ("case", "solver", "tolerance")

LABELS = {"case": "case_name", "solver": "solver_name", "variable": "variable_name"}
"""Variables that name what lies along a dimension; CF allows coordinate variables of numbers only."""

COUNTS = {
    "steps": "steps taken",
    "rejected": "steps rejected",
    "residuals": "right-hand sides that the solver asked for",
    "jacobians": "Jacobians",
    "factorizations": "matrices factored",
}
"""What a solver counts."""

SPREAD: dict[str, tuple[Callable[[list[float]], float], str]] = {
    "run_seconds": (min, "least run time"),
    "run_seconds_median": (median, "median run time"),
    "run_seconds_max": (max, "longest run time"),
}


def columns(plan: Plan, cases: Sequence[Measured]) -> tuple[Column, ...]:
    """Every variable, the coordinates first."""
    names = list(dict.fromkeys(name for case in cases for name in case.variables))
    axes = [
        ("tolerance", np.array(plan.tolerances), "relative tolerance asked for"),
        ("case", _words([case.subject.name for case in cases]), "name of the case"),
        ("solver", _words(plan.solvers), "name of the solver"),
        ("variable", _words(names), "name of the compared variable"),
    ]
    coordinates = [Column(LABELS.get(name, name), (name,), values, "1", text) for name, values, text in axes]
    points = [Column(name, POINT, _table(plan, cases, read), unit, text) for name, read, unit, text in _point_readers()]
    return (*coordinates, *_of_cases(cases), *points, *_of_variables(plan, cases, names))


def _of_cases(cases: Sequence[Measured]) -> list[Column]:
    compiled = np.array([case.subject.model.compile_seconds for case in cases])
    rows = [
        ("title", _words([case.subject.title for case in cases]), "1", "title of the case"),
        ("case_text", _words([case.subject.text for case in cases]), "1", "the case itself"),
        ("reference", _words([case.reference for case in cases]), "1", "what the runs are held against"),
        ("compile_seconds", compiled, "s", "time to compile the equations of the case"),
    ]
    for kind, text in MEANING.items():
        values = np.array([case.truth.uncertainty.worst(kind) if case.truth else np.nan for case in cases])
        rows.append((f"uncertainty_{kind}", values, "1", f"uncertainty of the reference: {text}"))
    return [Column(name, ("case",), values, unit, text) for name, values, unit, text in rows]


Reader = Callable[[Point], object]


def _point_readers() -> list[tuple[str, Reader, str, str]]:
    """What is read off each point: name, reader, unit, long name."""
    energy = "largest energy residual relative to the energy exchanged"
    return [
        ("status", lambda point: point.status, "1", "finished, stopped, failed or omitted"),
        ("reason", lambda point: point.reason, "1", "why the run ended, failed or was left out"),
        *((f"error_{kind}", partial(_error, kind=kind), "1", text) for kind, text in MEANING.items()),
        ("energy_error", lambda point: point.energy, "1", energy),
        *((name, partial(_seconds, take=take), "s", text) for name, (take, text) in SPREAD.items()),
        ("stepping_seconds", stepping, "s", "least time inside the library's own steps"),
        ("repetitions", lambda point: float(len(point.seconds)), "1", "number of timed runs"),
        *((f"count_{name}", partial(count, name=name), "1", text) for name, text in COUNTS.items()),
    ]


def _error(point: Point, kind: str, variable: str | None = None) -> float:
    if point.errors is None:
        return np.nan
    return point.errors.by_kind[kind].get(variable, np.nan) if variable else point.errors.worst(kind)


def _seconds(point: Point, take: Callable[[list[float]], float]) -> float:
    return take(point.seconds) if point.seconds else np.nan


def stepping(point: Point) -> float:
    """Least time inside a library's own steps; NaN for a method that does outputs and events itself."""
    return min(point.stepping) if point.stepping else np.nan


def count(point: Point, name: str) -> float:
    """A count of a solver; NaN where its library does not tell."""
    counters = point.counters
    if counters is None or (name == "rejected" and not method(point.solver).counts_rejected):
        return np.nan
    if name == "factorizations" and counters.jacobians > 0 and counters.factorizations == 0:
        return np.nan
    return float(getattr(counters, name))


def _of_variables(plan: Plan, cases: Sequence[Measured], names: Sequence[str]) -> list[Column]:
    found = []
    for kind in KINDS:
        tables = [_table(plan, cases, partial(_error, kind=kind, variable=name)) for name in names]
        text = f"{MEANING[kind]} of each variable"
        found.append(Column(f"variable_error_{kind}", (*POINT, "variable"), np.stack(tables, axis=-1), "1", text))
    return found


def _table(plan: Plan, cases: Sequence[Measured], read: Reader) -> NDArray[np.generic]:
    """A value for each point."""
    rows = [[[read(case.point(s, rtol)) for rtol in plan.tolerances] for s in plan.solvers] for case in cases]
    texts = isinstance(rows[0][0][0], str)
    return np.array(rows, dtype=object if texts else float)


def _words(texts: Sequence[str]) -> NDArray[np.object_]:
    return np.array(list(texts), dtype=object)
