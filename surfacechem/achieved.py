"""How far a run is from the truth: against an exact solution, a second run at another tolerance, or its own balances.

>>> import surfacechem
>>> case = surfacechem.load("exothermic")
>>> case.run().accuracy.source, case.run(error="balances").accuracy.source
('exact solution exothermic-bonding', 'balances only: what they miss is not seen')
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from surfacechem.accuracy import FLOOR, UNKNOWN, CellErrors, relative_error, second_tolerance
from surfacechem.audit import audit
from surfacechem.errors import InputError, Place, suggestion
from surfacechem.event_table import SIDE, event_times
from surfacechem.integrate import Trajectory
from surfacechem.profiles import profile_values
from surfacechem.scene import Scene
from surfacechem.solution import EARLIER, Accuracy

Array = NDArray[np.float64]

WAYS = ("auto", "estimate", "balances")
"""How a run tells its error: against the exact solution if there is one, else by a second run; always by a second run;
from the balances, which costs nothing."""

EVENTS = "event times"
"""What stands for the times of events among the compared variables."""


def check_way(way: str) -> None:
    """InputError for what is none of the WAYS."""
    if way not in WAYS:
        raise InputError(f"no source '{way}' of an error.{suggestion(way, WAYS)}", Place(path="--error"))


def accuracy(
    trajectory: Trajectory,
    scene: Scene,
    exact: tuple[str, Mapping[str, float]] | None,
    way: str,
    cells: Callable[[], CellErrors] = CellErrors,
    estimate: Accuracy | None = None,
) -> Accuracy:
    """The error of a run in one of the WAYS; ``exact`` names the exact solution of its case, with its parameters.

    ``cells`` finds the errors of the cells across bodies, which a second run at another tolerance does not see;
    ``estimate`` is that of a second run, where there was one.
    """
    if way == "balances":
        return from_balances(trajectory, "balances only: what they miss is not seen")
    if exact is None or way == "estimate":
        return with_cells(estimate, cells()) if estimate else against_tighter(trajectory, cells())
    try:
        return replace(against_exact(trajectory, scene, *exact), asked=estimate.asked if estimate else None)
    except InputError as error:
        estimate = with_cells(estimate, cells()) if estimate else against_tighter(trajectory, cells())
        unused = f"the exact solution {exact[0]} is not of this scene: {error.message}"
        return replace(estimate, source=f"{estimate.source}; {unused}")


def against_exact(trajectory: Trajectory, scene: Scene, name: str, options: Mapping[str, float]) -> Accuracy:
    """Largest errors at the output times; InputError where the exact solution is another scene's."""
    from surfacechem.references.matching import exact_values

    exact = exact_values(name, options, scene, trajectory)
    columns = computed(trajectory)
    errors = {key: relative_error(columns[key], values, floor(trajectory, key)) for key, values in exact.items()}
    return Accuracy(max(errors.values()), f"exact solution {name}", errors, exact)


def against_tighter(trajectory: Trajectory, cells: CellErrors | None = None) -> Accuracy:
    """Errors of states and of the times of events, estimated from a second run; at the tightest tolerance that run is
    the looser one. Those of the cells across bodies are added.
    """
    other = second_tolerance(trajectory.run.rtol)
    second = trajectory.model.resolve(trajectory, other)
    shared = len(trajectory.result.times)
    if len(second.result.times) < shared or shared < 2:
        why = f"a second run at rtol {other:.0e} {EARLIER}: {second.reason}"
        return from_balances(trajectory, f"balances only, since {why}")
    errors, note = apart(trajectory, second)
    source = second_run(other)
    found = Accuracy(max(errors.values()), f"{source}, which had {note}" if note else source, errors)
    return with_cells(found, cells) if cells else found


def second_run(rtol: float) -> str:
    """What an estimate is from, in words."""
    return f"estimate: a second run at rtol {rtol:.0e}"


def apart(first: Trajectory, second: Trajectory) -> tuple[dict[str, float], str]:
    """Largest differences of two runs in each state and in the times of events, and in which events they differ."""
    found, expected = event_times(first), event_times(second)
    note = difference(found, expected)
    times = first.result.times[: len(second.result.times)]
    shared = np.flatnonzero(np.full(len(times), True) if note else beside_jumps(times, first, second))
    ours, theirs = states(first), states(second)
    errors = {name: relative_error(ours[name][shared], theirs[name][shared], FLOOR) for name in ours}
    if found and not note:
        errors[EVENTS] = event_error(found, expected, first.run.times[-1])
    return errors, note


def beside_jumps(times: Array, first: Trajectory, second: Trajectory) -> NDArray[np.bool_]:
    """At which times two runs with the same events have made the same jumps; those of the events are compared apart."""
    ways = np.array([[one.t, other.t] for one, other in zip(first.jumps, second.jumps, strict=False)]).reshape(-1, 2)
    early, late = ways.min(axis=1) * (1 - SIDE), ways.max(axis=1) * (1 + SIDE)
    return np.asarray(np.all((times[:, None] < early) | (times[:, None] > late), axis=1))


def with_cells(estimate: Accuracy, cells: CellErrors) -> Accuracy:
    """An estimate with the errors of the cells across bodies added; not known where those are not."""
    if not cells.variables:
        return estimate
    if not cells.converged:
        return replace(estimate, error=math.nan, source=f"unknown: {UNKNOWN}", variables={})
    errors = dict(estimate.variables)
    for name, error in cells.variables.items():
        errors[name] = errors.get(name, 0.0) + error
    worst = max(estimate.error, *errors.values())
    return replace(estimate, error=worst, variables=errors, source=f"{estimate.source}, {cells.source}")


def from_balances(trajectory: Trajectory, source: str) -> Accuracy:
    """What the residuals of the balances tell of the error."""
    books = audit(trajectory)
    errors = {"energy": books.energy_error, "entropy": books.entropy_error, "sites": books.site_error}
    return Accuracy(max(errors.values()), source, errors)


def states(trajectory: Trajectory) -> dict[str, Array]:
    """States at the output times, by name; those inside bodies together."""
    system = trajectory.model.system
    lone = {s.name: j for j, s in enumerate(system.states) if s.name not in system.inside}
    found = {name: trajectory.result.outputs[:, j] for name, j in lone.items()}
    return found | {profile.name: profile_values(trajectory, profile) for profile in system.profiles}


def computed(trajectory: Trajectory) -> dict[str, Array]:
    """States and named quantities at the output times, by name."""
    names = [item.name for item in trajectory.model.system.outputs]
    return states(trajectory) | dict(zip(names, trajectory.outputs.T, strict=True))


def floor(trajectory: Trajectory, name: str) -> float:
    """The part of its largest value below which an exact value of a variable counts as this in relative errors."""
    system = trajectory.model.system
    return FLOOR if name in {*(s.name for s in system.states), *(p.name for p in system.profiles)} else 1.0


def difference(found: Mapping[str, Array], expected: Mapping[str, Array]) -> str:
    """In which events two runs differ, in words; empty where they have the same.

    >>> difference({"slip": [0.1]}, {"slip": [0.1, 0.2], "stop": [0.3]})
    'other events: 2 slip instead of 1, 1 stop instead of 0'
    """
    counts = {name: (len(expected.get(name, ())), len(found.get(name, ()))) for name in {**expected, **found}}
    parts = [f"{theirs} {name} instead of {ours}" for name, (theirs, ours) in counts.items() if theirs != ours]
    return f"other events: {', '.join(parts)}" if parts else ""


def event_error(found: Mapping[str, Array], expected: Mapping[str, Array], end: float) -> float:
    """Largest error of the times of events, each relative to its own time, or to FLOOR of the run if that is more."""
    errors = [
        np.abs(found[name] - times) / np.maximum(times, FLOOR * end) for name, times in expected.items() if len(times)
    ]
    return float(max((error.max() for error in errors), default=0.0))
