"""The sweep of a case: runs, and how far each of them is from the truth."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from typing import TypeAlias

import numpy as np

from surfacechem import references
from surfacechem.errors import InputError
from surfacechem.format import Case, ExactSolution
from surfacechem.references.base import SceneView
from surfacechem.results.accuracy import ROUNDING, UNKNOWN, CellErrors, second_tolerance
from surfacechem.results.error_estimates import against_exact, estimated, second_run, with_cells
from surfacechem.results.event_table import event_times
from surfacechem.results.matching import exact_values, match
from surfacechem.runs.spectrum import Statistics
from surfacechem.runs.sweep_dataset import WORDS, SweepAccuracy, SweepSolution
from surfacechem.runs.sweeps import Sweep, prepared, settings, solve

__all__ = ["prepared", "settings", "solution", "solve"]

Cells: TypeAlias = Callable[[], Sequence[CellErrors]]
"""Errors of the cells across bodies, of each run."""


def solution(case: Case, done: Sweep, changes: Mapping[str, float], threads: int | None, cells: Cells) -> SweepSolution:
    """Runs that were made with the settings of the case, with how far each is from the truth."""
    accuracy = _accuracy(case, done, threads, cells)
    return SweepSolution(done, case.title, case.source, case.text, case.mechanism_text or "", accuracy, changes)


def _accuracy(case: Case, done: Sweep, threads: int | None, cells: Cells) -> SweepAccuracy:
    unused, named = case.unused, case.reference
    if named is not None and not named.options:
        try:
            return _against_exact(case, done, named, threads)
        except InputError as error:
            unused = f"the exact solution {named.name} is not of this scene: {error.message}"
    elif named is not None:
        unused = named.fixed
    estimate = _against_tighter(_second(done, threads), done, cells())
    return replace(estimate, source="; ".join(filter(None, (estimate.source, unused))))


def _second(done: Sweep, threads: int | None) -> Sweep:
    """The runs at another tolerance, as :meth:`Model.resolve` has each."""
    rtol = second_tolerance(done.run.rtol)
    pairs = [(run.run.second(rtol), run.values) for run in done]
    runs = done.model.solve_all(pairs, threads or os.cpu_count() or 1, nudged=True)
    return replace(done, run=done.run.second(rtol), runs=runs)


def _against_exact(case: Case, done: Sweep, named: ExactSolution, threads: int | None) -> SweepAccuracy:
    """Errors of the load at rupture, else of all; InputError where the solution is not that of every run.

    For the loads at rupture that is tested on the outermost runs.

    A run with one output has nothing to compare but its events, one without any has no error.
    """
    begun = [i for i, run in enumerate(done) if len(run.result.times) > 1]
    if not begun:
        raise InputError("no run reached a second output.")
    second = cache(lambda: _second(done, threads))
    errors = np.full(len(done), np.nan)
    exact = {which: np.full(len(done), np.nan) for which in WORDS if done.statistics}
    for i, run in enumerate(done):
        if len(run.result.times) < 2:
            errors[i] = estimated(run, second()[i]).error if len(run.result.times) else np.nan
        elif exact:
            if i in (begun[0], begun[-1]):
                exact_values(named.name, named.options, case.scene, run)
            reference = match(references.get(named.name), named.options, SceneView(case.scene, run))
            errors[i] = _of_statistics(done, i, reference)
            for which, values in exact.items():
                values[i] = getattr(reference, which)
        else:
            errors[i] = against_exact(
                run,
                case.scene,
                named.name,
                named.options,
                second=second()[i] if event_times(run) else None,
            ).error
    return SweepAccuracy(errors, f"exact solution {named.name}", exact)


def _of_statistics(done: Sweep, i: int, exact: references.Reference | Statistics) -> float:
    """Largest error of the load at rupture; that of one which is exactly zero is absolute."""
    pairs = [(getattr(done.statistics[i], which), getattr(exact, which)) for which in WORDS]
    errors = [float(abs(ours - true) / abs(true) if true else abs(ours)) for ours, true in pairs]
    return max(max(errors), ROUNDING)


def _against_tighter(second: Sweep, done: Sweep, cells: Sequence[CellErrors]) -> SweepAccuracy:
    """Errors of states, events and statistics, estimated from a second sweep, with those of the cells of each run; not
    numbers where they are not known.
    """
    if done.statistics:
        errors = [_of_statistics(done, i, second.statistics[i]) + cells[i].largest for i in range(len(done))]
    else:
        errors = [with_cells(estimated(*pair), found).error for *pair, found in zip(done, second, cells, strict=True)]
    ways = dict.fromkeys(found.source for found in cells if found.variables)
    unknown = sum(not found.converged for found in cells)
    said = f"; unknown in {unknown} of {len(cells)} runs: {UNKNOWN}" if unknown else ""
    return SweepAccuracy(np.array(errors), ", ".join([second_run(second.run, "sweep"), *ways]) + said)
