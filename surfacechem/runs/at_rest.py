"""Runs to a steady state: `until: steady`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np

from surfacechem.errors import InputError
from surfacechem.expressions import depends
from surfacechem.model.system import System
from surfacechem.results.audit import audit
from surfacechem.solve.run import Model, Run, Trajectory
from surfacechem.tolerances import LINE_ERROR, NEGLIGIBLE, RUN_ERROR

HORIZON = 1e8
"""Time [s] for which rest is looked for, three years: beyond, step sizes times the rates of a fast surface are more
than a double resolves beside one.
"""

REST_RATIO = 10.0
"""Least ratio of the time looked at to the time to come to rest, with which a state counts as at rest."""

SHORTER_TIMES = (1e6, 1e4, 1e2, 1.0)
"""Times [s] for which rest is looked for where errors of a fast surface, summed over years, hide it: its sites do not
stay what they are.
"""

PATH = "run.until"


class UnrestError(InputError):
    """A run that does not come to rest."""


def refuse_histories(system: System) -> None:
    """Raise InputError where no steady state can be."""
    moving = [item.name for item in system.named if depends(system.expand(item.expression), system.t)]
    if moving:
        raise InputError(f"{moving[0]} changes in time, so there is no steady state: give it one value.", path=PATH)


def to_rest(model: Model, run: Run, values: Mapping[str, float]) -> Run:
    """The run that ends where the states have come within their tolerances of values that they keep ten times as long,
    and keep but for a thousandth for three years; twice as long as one that stops before. InputError where there is
    none.
    """
    refuse_histories(model.system)
    # A shorter look would take slow changes, and those that follow when nothing happened for long, for none.
    far = _looked(model, run, values, HORIZON)
    if far.status == "stopped":
        return replace(run, times=_until(run, min(2 * far.result.t, HORIZON) or HORIZON))
    mover, states = _rest_of(far)[1], model.system.states
    scales, sites = np.array([(state.scale, bool(state.quantity.species)) for state in states]).T
    lost = abs(np.sum((far.result.y - far.result.outputs[0]) * sites))
    drifting = lost > run.rtol * abs(far.result.y[mover]) and _rest_of(far, RUN_ERROR)[0] * REST_RATIO <= HORIZON
    for end in (HORIZON, *(SHORTER_TIMES if drifting or audit(far).site_error > run.rtol else ())):
        near = far if end == HORIZON else _looked(model, run, values, end)
        last, change = _rest_of(near)[0], np.abs(near.result.y - far.result.y)
        # Both end in states that differ slightly, or by a trace of something.
        alike = np.all(change <= NEGLIGIBLE * np.maximum(np.abs(near.result.y), scales))
        if near.status == "finished" and last * REST_RATIO <= end and alike:
            return replace(run, times=_until(run, last), rest=last)
    text = f"the case did not reach a steady state within {HORIZON:.3g} s: {states[mover].name} still changes."
    raise UnrestError(text, path=PATH)


def _looked(model: Model, run: Run, values: Mapping[str, float], end: float) -> Trajectory:
    return model.solve_values(replace(run, times=(0.0, end), picture=LINE_ERROR, accuracy=None), values)


def all_to_rest(model: Model, run: Run, points: Iterable[Mapping[str, float]]) -> list[Run]:
    """The runs with these values, all of which end where the last of them has come to rest."""
    found = [to_rest(model, run, values) for values in points]
    last = max(each.times[-1] for each in found)
    return [replace(each, times=_until(each, last)) for each in found]


def _until(run: Run, end: float) -> tuple[float, ...]:
    return tuple(end * (t / run.times[-1]) for t in run.times)  # the last of them exactly the end


def _rest_of(reached: Trajectory, tolerances: float = 1.0) -> tuple[float, int]:
    """The first time of a run after which no state is more tolerances away from its last value, and which is last."""
    result = reached.result
    known, problem = result.known or result.states(), result.problem
    evolved = np.flatnonzero(~problem.program.algebraic_mask)
    y, last = known.y[:, evolved], result.y[evolved]
    away = np.abs(y - last) > tolerances * (problem.rtol * np.abs(last) + problem.atol[evolved])
    when = np.array([np.flatnonzero(column)[-1] + 1 if column.any() else 1 for column in away.T], dtype=int)
    return float(known.t[min(int(when.max()), len(known.t) - 1)]), int(evolved[when.argmax()])
