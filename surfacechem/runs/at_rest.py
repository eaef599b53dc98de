"""Runs until nothing changes any more: `until: steady`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from surfacechem.errors import InputError
from surfacechem.expressions import depends
from surfacechem.model.system import System
from surfacechem.solve.run import Model, Run, Trajectory
from surfacechem.tolerances import PICTURE

LONGEST = 1e8
"""Time [s] for which rest is looked for, three years: beyond, step sizes times the rates of a fast surface are more
than a double resolves beside one.
"""

AFTER = 10.0
"""So many times as long as it takes to come to rest, a state is at rest."""

PATH = "run.until"


def refuse_histories(system: System) -> None:
    """InputError where no steady state can be."""
    moving = [item.name for item in system.named if depends(system.expand(item.expression), system.t)]
    if moving:
        raise InputError(f"{moving[0]} changes in time, so there is no steady state: give it one value.", path=PATH)


def to_rest(model: Model, run: Run, changes: Mapping[str, float]) -> Run:
    """The run that ends where the states have come within their tolerances of values that they keep ten times as long,
    and for three years; the whole of a run that stops before. InputError where there is none.
    """
    refuse_histories(model.system)
    # A shorter look would take slow changes, and those that follow when nothing happened for long, for none.
    reached = model.solve(replace(run, times=(0.0, LONGEST), picture=PICTURE, accuracy=None), changes)
    last = LONGEST
    if reached.status == "finished":
        last, name = _rest_of(reached)
        if last * AFTER > LONGEST:
            raise InputError(f"the case has come to no rest in {LONGEST:.3g} s: {name} still changes.", path=PATH)
    return replace(run, times=tuple(last * t / run.times[-1] for t in run.times))


def _rest_of(reached: Trajectory) -> tuple[float, str]:
    """The first time of a run after which no state leaves the tolerance of its last value, and which state is last."""
    result = reached.result
    known, problem = result.known or result.states(), result.problem
    evolved = np.flatnonzero(~problem.program.algebraic_mask)
    y, last = known.y[:, evolved], result.y[evolved]
    away = np.abs(y - last) > problem.rtol * np.abs(last) + problem.atol[evolved]
    when = np.array([np.flatnonzero(column)[-1] + 1 if column.any() else 1 for column in away.T], dtype=int)
    worst = int(when.argmax())
    return float(known.t[min(int(when[worst]), len(known.t) - 1)]), reached.model.system.states[
        int(evolved[worst])
    ].name
