"""The runs of a sweep: in one call of the compiled loop where nothing but the stepper is needed.

Where a scene jumps, or its medium is fitted as it goes, they are made one by one.
"""

from __future__ import annotations

import os
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from surfacechem.errors import InputError
from surfacechem.expressions import derivative
from surfacechem.format.plans import Plan
from surfacechem.model.system import System
from surfacechem.runs import spectrum
from surfacechem.runs.onebyone import batch
from surfacechem.runs.sweeps import Separate, Sweep
from surfacechem.solve.contract import Problem
from surfacechem.solve.radau.solver import Batch, Radau, gathered, solve_many
from surfacechem.solve.run import Model, Run

Array = NDArray[np.float64]

USUAL_EVENTS = 4
"""Events of a run for which there is room at first."""


def prepared(system: System, plan: Plan) -> System:
    """The system that a sweep compiles: with statistics of rupture where a load grows until bonds break."""
    if plan.until is None:
        return system
    origin = partial(prepared, system, plan)
    if (holding := system.holding) is not None:
        again = replace(holding, again=lambda sides: prepared(holding.again(sides), plan))
        system = replace(system, holding=again)
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
    if (suited := model.suited(values)) is not model:
        model, values = suited, [suited.adopted(point) for point in values]
    runs = settings(model.system, plan, run, values)
    if model.system.transitions or model.system.fit or run.solver != Radau.name:
        return _one_by_one(model, plan, run, list(zip(runs, values, strict=True)), nudged)
    problems = [model.problem(*pair, nudged=nudged) for pair in zip(runs, values, strict=True)]
    Radau().prepare()
    start = time.perf_counter()
    solved = _batch(problems, threads or os.cpu_count() or 1)
    return Sweep(model, plan, run, values, problems, solved, time.perf_counter() - start)


def _batch(problems: Sequence[Problem], threads: int) -> Batch:
    """The runs in one call of the compiled loop for each number of pieces that they have."""
    pieces = np.array([len(problem.segments) for problem in problems])
    groups = [np.flatnonzero(pieces == count) for count in np.unique(pieces)]
    return gathered([_alike([problems[int(i)] for i in group], threads) for group in groups], np.concatenate(groups))


def _alike(problems: Sequence[Problem], threads: int) -> Batch:
    first = problems[0]
    segments, times = (np.array([getattr(problem, name) for problem in problems]) for name in ("segments", "times"))
    shared = np.all(segments == segments[0]) and np.all(times == times[0])
    return solve_many(
        first.program,
        np.array([problem.y0 for problem in problems]),
        np.array([problem.parameters for problem in problems]),
        first.segments if shared else segments,
        first.rtol,
        first.atol,
        times=first.times if shared else times,
        margins=first.margins,
        max_steps=first.max_steps,
        threads=threads,
        event_rows=USUAL_EVENTS if first.margins else 0,
        spacing=[problem.spacing for problem in problems],
    )


def _one_by_one(
    model: Model, plan: Plan, run: Run, pairs: Sequence[tuple[Run, Mapping[str, float]]], nudged: bool
) -> Sweep:
    trajectories = [model.solve_values(*pair, nudged=nudged) for pair in pairs]
    seconds = sum(trajectory.seconds for trajectory in trajectories)
    results = [trajectory.result for trajectory in trajectories]
    values, problems = [trajectory.values for trajectory in trajectories], [result.problem for result in results]
    return Separate(model, plan, run, values, problems, batch(results), seconds, trajectories=trajectories)


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
