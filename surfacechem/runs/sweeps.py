"""Sweeps: a grid of parameter values, the runs over it, and how far each of them is from the truth."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from surfacechem import references
from surfacechem.errors import InputError
from surfacechem.expressions import derivative
from surfacechem.format import Case
from surfacechem.format.plans import STATISTICS, Plan
from surfacechem.model.system import System
from surfacechem.references.base import SceneView
from surfacechem.results.accuracy import UNKNOWN, CellErrors, second_tolerance
from surfacechem.results.audit import Audit, audit
from surfacechem.results.error_estimates import against_exact, estimated, second_run, with_cells
from surfacechem.results.event_table import event_times
from surfacechem.results.matching import exact_values, match
from surfacechem.runs import spectrum
from surfacechem.runs.spectrum import Statistics
from surfacechem.scene import Scene
from surfacechem.solve.run import Model, Run, Trajectory
from surfacechem.tolerances import EPS


@dataclass(frozen=True)
class SweepAccuracy:
    """Largest relative error of each run and where it is from; exact statistics by name where they are known."""

    errors: NDArray[np.float64]
    source: str
    exact: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)


@dataclass(frozen=True)
class Sweep(Sequence[Trajectory]):
    """Runs over a grid, in the order of :attr:`Plan.points`."""

    model: Model
    plan: Plan
    run: Run
    """Settings of all runs; where a load ends them, each has output times of its own."""
    runs: Sequence[Trajectory]

    def __len__(self) -> int:
        """Number of runs."""
        return len(self.runs)

    def __iter__(self) -> Iterator[Trajectory]:
        """The runs in order."""
        return iter(self.runs)

    def __getitem__(self, i: Any) -> Any:
        """One run."""
        return self.runs[i]

    @property
    def seconds(self) -> float:
        """Run time of all runs."""
        return sum(run.seconds for run in self)

    @property
    def steps(self) -> int:
        """Steps of all runs."""
        return sum(run.result.counters.steps for run in self)

    @cached_property
    def audits(self) -> list[Audit]:
        """The balances of each run."""
        return [audit(run) for run in self]

    def worst(self, balance: str) -> float:
        """Largest error over all runs of the balance of energy, entropy or site."""
        return float(np.max([getattr(books, f"{balance}_error") for books in self.audits]))

    @cached_property
    def statistics(self) -> list[Statistics]:
        """Mode, median and mean of the load at rupture of each run; empty where the sweep has none."""
        if self.plan.until is None or not spectrum.breaks_bonds(self.model.system):
            return []
        return [spectrum.statistics(run, self.plan.until[0]) for run in self]


def prepared(system: System, plan: Plan) -> System:
    """The system that a sweep compiles: with statistics of rupture where a load grows until bonds break."""
    if plan.until is None:
        return system
    origin = partial(prepared, system, plan)
    spectrum.history(system, plan.until[0])
    if spectrum.breaks_bonds(system):
        return replace(spectrum.with_rupture(system, plan.until[0]), origin=origin)
    if spectrum.evolves_bonds(system):
        warning = "bonds can form again, so that their loss is no spectrum of rupture forces: none is given."
        return replace(system, warnings=(*system.warnings, warning), origin=origin)
    return replace(system, origin=origin)


def solve(
    model: Model,
    plan: Plan,
    run: Run,
    changes: Mapping[str, float] | None = None,
    threads: int | None = None,
    *,
    nudged: bool = False,
) -> Sweep:
    """Run the model of a :func:`prepared` system over the plan; how a run ends is its status, never an exception.

    Where ``nudged``, loads differ in their last digit, as in the second run of an estimate.
    """
    run = model.chosen(run)
    values = [model.values({**(changes or {}), **point}) for point in plan.points]
    pairs = list(zip(settings(model.system, plan, run, values), values, strict=True))
    return Sweep(model, plan, run, model.solve_all(pairs, threads or os.cpu_count() or 1, nudged=nudged))


def settings(system: System, plan: Plan, run: Run, values: Sequence[Mapping[str, float]]) -> list[Run]:
    """The settings of each run, its output times stretched to where a load is reached that the plan names."""
    if plan.until is None:
        return [run] * len(values)
    variable, target = plan.until
    if system.breakpoints:
        raise InputError(f"runs until {variable} is reached cannot have histories with breakpoints.", path="sweep")
    line = spectrum.history(system, variable)
    shape = np.asarray(run.times) / run.times[-1]
    runs = []
    for at in values:
        point = {parameter.symbol: at[parameter.path] for parameter in system.parameters}
        start, slope = (float(part.subs({**point, system.t: 0})) for part in (line, derivative(line, system.t)))
        if not (target - start) * slope > 0:
            message = f"{variable} never reaches {target:g}: it starts at {start:g} and changes by {slope:g}/s."
            raise InputError(message, path="sweep.until")
        runs.append(replace(run, times=tuple((shape * ((target - start) / slope)).tolist())))
    return runs


def accuracy(case: Case, done: Sweep, threads: int | None, cells: Callable[[], Sequence[CellErrors]]) -> SweepAccuracy:
    """How far each run is from the truth: from the exact solution of the case, else from a second sweep; not a number
    where that is not known. ``cells`` finds the errors of the cells across bodies of each run.
    """
    unused, named = case.unused, case.reference
    if named is not None and not named.options:
        try:
            return _against_exact(case.scene, done, named.name, threads)
        except InputError as error:
            unused = f"the exact solution {named.name} is not of this scene: {error.message}"
    elif named is not None:
        unused = named.fixed
    second, left = _second(done, threads), cells()
    if done.statistics:
        errors = [_of_statistics(done, i, second.statistics[i]) + found.largest for i, found in enumerate(left)]
    else:
        errors = [with_cells(estimated(*pair), found).error for *pair, found in zip(done, second, left, strict=True)]
    source = ", ".join([second_run(second.run, "sweep"), *dict.fromkeys(f.source for f in left if f.variables)])
    if unknown := sum(not found.converged for found in left):
        source += f"; unknown in {unknown} of {len(left)} runs: {UNKNOWN}"
    return SweepAccuracy(np.array(errors), "; ".join(filter(None, (source, unused))))


def _second(done: Sweep, threads: int | None) -> Sweep:
    """The runs at another tolerance, as :meth:`Model.resolve` has each."""
    rtol = second_tolerance(done.run.rtol)
    pairs = [(run.run.second(rtol), run.values) for run in done]
    runs = done.model.solve_all(pairs, threads or os.cpu_count() or 1, nudged=True)
    return replace(done, run=done.run.second(rtol), runs=runs)


def _against_exact(scene: Scene, done: Sweep, name: str, threads: int | None) -> SweepAccuracy:
    """Errors of the load at rupture, else of all; InputError where the solution is not that of every run.

    For the loads at rupture that is tested on the outermost runs. A run with one output has nothing to compare but its
    events, one without any has no error.
    """
    begun = [i for i, run in enumerate(done) if len(run.result.times) > 1]
    if not begun:
        raise InputError("no run reached a second output.")
    second = cache(lambda: _second(done, threads))
    errors = np.full(len(done), np.nan)
    exact = {which: np.full(len(done), np.nan) for which in STATISTICS if done.statistics}
    for i, run in enumerate(done):
        if len(run.result.times) < 2:
            errors[i] = estimated(run, second()[i]).error if len(run.result.times) else np.nan
        elif exact:
            if i in (begun[0], begun[-1]):
                exact_values(name, {}, scene, run)
            reference = match(references.get(name), {}, SceneView(scene, run))
            errors[i] = _of_statistics(done, i, reference)
            for which, values in exact.items():
                values[i] = getattr(reference, which)
        else:
            errors[i] = against_exact(run, scene, name, {}, second()[i] if event_times(run) else None).error
    return SweepAccuracy(errors, f"exact solution {name}", exact)


def _of_statistics(done: Sweep, i: int, exact: references.Reference | Statistics) -> float:
    """Largest error of the load at rupture; that of one which is exactly zero is absolute."""
    pairs = [(getattr(done.statistics[i], which), getattr(exact, which)) for which in STATISTICS]
    errors = [float(abs(ours - true) / abs(true) if true else abs(ours)) for ours, true in pairs]
    return max(max(errors), EPS)
