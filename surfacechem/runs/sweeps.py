"""Sweeps: a grid of parameter values, and the runs over it."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from surfacechem.errors import InputError
from surfacechem.expressions import derivative
from surfacechem.format.plans import Plan
from surfacechem.model.system import System
from surfacechem.results.audit import Audit, audit
from surfacechem.runs import spectrum
from surfacechem.runs.spectrum import Statistics
from surfacechem.solve.run import Model, Run, Trajectory


@dataclass(frozen=True)
class Sweep:
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

    def __getitem__(self, i: int) -> Trajectory:
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
