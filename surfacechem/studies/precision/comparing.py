"""Cases over tolerances and solvers: what ``surfacechem precision`` does, from names to a study."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

from surfacechem import solve as known_solvers
from surfacechem.errors import InputError, Place, suggestion
from surfacechem.runs.simulation import Simulation, load
from surfacechem.studies.precision.plan import Plan, measured
from surfacechem.studies.precision.study import Study
from surfacechem.studies.precision.subject import Subject

TOLERANCES = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
REPEAT, MOST_REPEAT = 5, 1000


def precision(
    cases: str | Path | Sequence[str | Path],
    solvers: Sequence[str] = known_solvers.names,
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
    plan = _plan(solvers, tolerances, variables, repeat, overrides)
    named = [cases] if isinstance(cases, str | Path) else list(cases)
    subjects = [_subject(load(name, overrides)) for name in named]
    _check(subjects, plan.variables)
    return Study(plan, tuple(measured(subject, plan) for subject in subjects))


def _plan(
    solvers: Sequence[str],
    tolerances: Sequence[float],
    variables: Sequence[str],
    repeat: int,
    overrides: Sequence[str] | Mapping[str, object],
) -> Plan:
    for name in solvers:
        if name not in known_solvers.names:
            raise InputError(f"no solver '{name}'.{suggestion(name, known_solvers.names)}", Place(path="solvers"))
    for rtol in tolerances:
        if not (math.isfinite(rtol) and 0 < rtol <= 0.1):
            raise InputError(f"{rtol:g} is outside its range: > 0 and <= 0.1.", Place(path="tolerances"))
    for kind, values in (("solvers", solvers), ("tolerances", tolerances)):
        if len(values) == 0:
            raise InputError("at least one is needed.", Place(path=kind))
    if not 1 <= repeat <= MOST_REPEAT:
        raise InputError(f"{repeat} is outside its range: >= 1 and <= {MOST_REPEAT}.", Place(path="repeat"))
    pairs = overrides.items() if isinstance(overrides, Mapping) else None
    texts = overrides if pairs is None else [f"{path}={value}" for path, value in pairs]
    unique = sorted(set(map(float, tolerances)), reverse=True)
    return Plan(tuple(dict.fromkeys(solvers)), tuple(unique), tuple(dict.fromkeys(variables)), repeat, tuple(texts))


def _subject(simulation: Simulation) -> Subject:
    """A case as the study sees it; InputError where it cannot start."""
    case = simulation.case
    try:
        simulation.model.problem(case.run, simulation.model.values())
    except InputError as error:
        raise case.located(error) from None
    exact = (case.reference.name, case.reference.options) if case.reference else None
    return Subject(case.name, case.title, case.text, case.scene, simulation.model, case.run, exact)


def _check(subjects: Sequence[Subject], variables: Sequence[str]) -> None:
    """InputError for a case that is given twice or a variable that no case has."""
    names = [subject.name for subject in subjects]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"the case {name} is given twice.")
    known = {name for subject in subjects for name in subject.names}
    for name in variables:
        if name not in known:
            raise InputError(f"no variable '{name}' in the cases.{suggestion(name, known)}", Place(path="variables"))
