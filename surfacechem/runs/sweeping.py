"""The sweep of a case: runs, and how far each of them is from the truth."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from surfacechem import references
from surfacechem.errors import InputError
from surfacechem.format import Case, ExactSolution
from surfacechem.references.base import SceneView
from surfacechem.results.accuracy import ROUNDING, UNKNOWN, CellErrors, largest_errors, second_tolerance
from surfacechem.results.achieved import apart, floor, second_run, stated
from surfacechem.results.matching import beside_events, exact_values, match, renamed
from surfacechem.runs import sweep_runs
from surfacechem.runs.spectrum import Statistics
from surfacechem.runs.sweep_dataset import WORDS, SweepAccuracy, SweepSolution
from surfacechem.runs.sweep_runs import prepared, settings, solve
from surfacechem.runs.sweeps import Sweep

__all__ = ["prepared", "settings", "solution", "solve"]

Array = NDArray[np.float64]


Cells: TypeAlias = Callable[[], Sequence[CellErrors]]
"""Errors of the cells across bodies, of each run."""


def solution(case: Case, done: Sweep, changes: Mapping[str, float], threads: int | None, cells: Cells) -> SweepSolution:
    """Runs that were made with the settings of the case, with how far each is from the truth."""
    accuracy = _accuracy(case, done, changes, threads, cells)
    return SweepSolution(done, case.title, case.source, case.text, case.mechanism_text or "", accuracy, changes)


def _accuracy(
    case: Case, done: Sweep, changes: Mapping[str, float], threads: int | None, cells: Cells
) -> SweepAccuracy:
    if case.reference is None or case.reference.options:
        unused = case.reference.fixed if case.reference else case.unused
        estimate = _against_tighter(done, changes, threads, cells())
        return replace(estimate, source="; ".join(filter(None, (estimate.source, unused))))
    try:
        return _against_exact(case, done, case.reference)
    except InputError as error:
        estimate = _against_tighter(done, changes, threads, cells())
        unused = f"the exact solution {case.reference.name} is not of this scene: {error.message}"
        return replace(estimate, source=f"{estimate.source}; {unused}")


def _against_exact(case: Case, done: Sweep, named: ExactSolution) -> SweepAccuracy:
    """Errors of the load at rupture, else of all; that the solution is one is tested on the outermost runs.

    Runs that end before their first output have no error.
    """
    begun = np.flatnonzero(done.reached.any(axis=1)).tolist()
    if not begun:
        raise InputError("no run reached an output.")
    for i in {begun[0], begun[-1]}:
        exact_values(named.name, named.options, case.scene, done[i])
    errors = np.full(len(done), np.nan)
    found = {which: np.full(len(done), np.nan) for which in WORDS if done.statistics}
    for i in begun:
        reference = match(references.get(named.name), named.options, SceneView(case.scene, done[i]))
        for which, values in found.items():
            values[i] = getattr(reference, which)
        errors[i] = _of_statistics(done, i, reference) if found else _of_quantities(done, i, reference)
    return SweepAccuracy(np.maximum(errors, ROUNDING), f"exact solution {named.name}", found)


def _of_statistics(done: Sweep, i: int, exact: references.Reference | Statistics) -> float:
    """Largest error of the load at rupture; that of one which is exactly zero is absolute."""
    pairs = [(getattr(done.statistics[i], which), getattr(exact, which)) for which in WORDS]
    return float(max(abs(ours - true) / abs(true) if true else abs(ours) for ours, true in pairs))


def _of_quantities(done: Sweep, i: int, reference: references.Reference) -> float:
    """Largest error of states and named quantities."""
    run, reached = done[i], done.reached[i]
    exact = beside_events(lambda t: renamed(reference.solution(t), run), run)
    ours = {name: done.named[name][i][reached] for name in exact}
    return stated(largest_errors(ours, exact, partial(floor, run)))


def _against_tighter(
    done: Sweep, changes: Mapping[str, float], threads: int | None, cells: Sequence[CellErrors]
) -> SweepAccuracy:
    """Errors of states, events and statistics, estimated from a second sweep, with those of the cells of each run; not
    numbers where they are not known.
    """
    other = second_tolerance(done.run.rtol)
    second = sweep_runs.solve(done.model, done.plan, done.run.second(other), changes, threads, nudged=True)
    errors = np.full(len(done), np.nan)
    for i in range(len(done)):
        if done.statistics:
            errors[i] = max(_of_statistics(done, i, second.statistics[i]), ROUNDING)
        elif (
            done.reached[i].any()
            and np.array_equal(done.reached[i], second.reached[i])
            and "failed" not in (done[i].status, second[i].status)
        ):
            differences, _ = apart(done[i], second[i])
            errors[i] = stated(differences) if differences else np.nan
    errors += [found.largest for found in cells]
    source = second_run(second.run, "sweep")
    ways = dict.fromkeys(found.source for found in cells if found.variables)
    unknown = sum(not found.converged for found in cells)
    said = f"; unknown in {unknown} of {len(cells)} runs: {UNKNOWN}" if unknown else ""
    return SweepAccuracy(errors, ", ".join([source, *ways]) + said)
