"""Runs to a steady state: `until: steady`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from surfacechem.errors import InputError
from surfacechem.model.system import System
from surfacechem.results.audit import audit
from surfacechem.solve.run import Model, Run, Trajectory
from surfacechem.tolerances import LINE_ERROR, NEGLIGIBLE, RUN_ERROR

HORIZON = 1e8
"""Longest time [s] of the search for a steady state, three years: beyond it the product of step size and rate of a
fast surface is so large that a double no longer resolves one next to it.
"""

REST_RATIO = 10.0
"""Least ratio of the integrated time to the time at which the states come to rest, for the end to count as steady."""

SHORTER_TIMES = (1e6, 1e4, 1e2, 1.0)
"""Shorter times [s] of the search, tried where errors of a fast surface, summed over years, hide the steady state: the
number of sites drifts.
"""

PATH = "run.until"


class NoSteadyStateError(InputError):
    """A run that reaches no steady state."""


def refuse_histories(system: System) -> None:
    """Raise InputError if a prescribed variable depends on time, so that no steady state exists."""
    if system.moving:
        raise InputError(
            f"{system.moving[0]} changes in time, so there is no steady state: give it one value.", path=PATH
        )


def to_steady_state(model: Model, run: Run, values: Mapping[str, float]) -> Run:
    """Return the run that ends at its steady state; InputError if none is found.

    The end is the first time after which all states stay within their tolerances of a value that they keep for ten
    times as long, and within a thousandth of it for three years. A run that an event stops lasts twice the time of that
    event.
    """
    refuse_histories(model.system)
    # A shorter search would miss slow changes, and those that set in after a long time of rest.
    far = _solved_until(model, run, values, HORIZON)
    if far.status == "stopped":
        return replace(run, times=_until(run, min(2 * far.result.t, HORIZON) or HORIZON))
    mover, states = _rest_of(far)[1], model.system.states
    scales, sites = np.array([(state.scale, bool(state.quantity.species)) for state in states]).T
    lost = abs(np.sum((far.result.y - far.result.outputs[0]) * sites))
    drifting = lost > run.rtol * abs(far.result.y[mover]) and _rest_of(far, RUN_ERROR)[0] * REST_RATIO <= HORIZON
    for end in (HORIZON, *(SHORTER_TIMES if drifting or audit(far).site_error > run.rtol else ())):
        near = far if end == HORIZON else _solved_until(model, run, values, end)
        last, change = _rest_of(near)[0], np.abs(near.result.y - far.result.y)
        # Both end states agree to a thousandth of their size; of traces, to a thousandth of their scale.
        alike = np.all(change <= NEGLIGIBLE * np.maximum(np.abs(near.result.y), scales))
        if near.status == "finished" and last * REST_RATIO <= end and alike:
            return replace(run, times=_until(run, last), rest=last)
    text = f"the case did not reach a steady state within {HORIZON:.3g} s: {states[mover].name} still changes."
    raise NoSteadyStateError(text, path=PATH)


def _solved_until(model: Model, run: Run, values: Mapping[str, float], end: float) -> Trajectory:
    return model.solve_values(replace(run, times=(0.0, end), picture=LINE_ERROR, accuracy=None), values)


def together(found: Sequence[Run]) -> list[Run]:
    """Return these runs, all with the end time of the last one to reach its steady state."""
    last = max(each.times[-1] for each in found)
    return [replace(each, times=_until(each, last)) for each in found]


def _until(run: Run, end: float) -> tuple[float, ...]:
    return tuple(end * (t / run.times[-1]) for t in run.times)  # the last of them exactly the end


def _rest_of(reached: Trajectory, tolerances: float = 1.0) -> tuple[float, int]:
    """Return the first time after which every state stays within so many ``tolerances`` of its final value, and the
    index of the last state to do so.
    """
    result = reached.result
    known, problem = result.known or result.states(), result.problem
    evolved = np.flatnonzero(~problem.program.algebraic_mask)
    y, last = known.y[:, evolved], result.y[evolved]
    away = np.abs(y - last) > tolerances * (problem.rtol * np.abs(last) + problem.atol[evolved])
    when = np.array([np.flatnonzero(column)[-1] + 1 if column.any() else 1 for column in away.T], dtype=int)
    return float(known.t[min(int(when.max()), len(known.t) - 1)]), int(evolved[when.argmax()])
