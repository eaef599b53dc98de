"""Diagnosis of a run that could not go on: a closing margin, a state that diverges, or motion too fast to resolve."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Literal

import numpy as np
import symengine
from numpy.typing import NDArray

from surfacechem.compile.program import Program
from surfacechem.model.system import Margin, State, System, TimeScale
from surfacechem.solve.contract import REASONS, Array, Points, Result, Status
from surfacechem.solve.hybrid import rounding
from surfacechem.solve.radau.solver import consistent
from surfacechem.tolerances import ATOL_OF_SCALE, CLOSED_GUARD, IDLE, NEGLIGIBLE, NEWTON_EPS, RUN_EPS, SINGULAR_NOISE

FEWEST, SHARP = 100.0, RUN_EPS
"""Fewest steps in a period that can resolve it, and the part of the time that a step can still resolve."""


def time_scales(system: System, values: Mapping[str, float]) -> list[tuple[TimeScale, float]]:
    """Return the characteristic times of free motions of the gaps [s], the shortest first."""
    point = {parameter.symbol: values[parameter.path] for parameter in system.parameters}
    found = [(scale, float(system.expand(scale.time).subs(point))) for scale in system.notes_of(TimeScale)]
    return sorted(found, key=lambda item: item[1])


def too_fast(system: System, result: Result, values: Mapping[str, float]) -> str:
    """Describe motion too fast to be resolved, with advice; empty if that is not why a run could not go on."""
    end = float(result.problem.segments[-1])
    shortest = {Status.MAX_STEPS: FEWEST * end / result.problem.max_steps, Status.STEP_UNDERFLOW: SHARP * result.t}
    for scale, time in time_scales(system, values):
        if time < shortest.get(result.status, 0.0):
            return f": the {scale.text}, {time:.3g} s, is too short for a run of {end:.3g} s; {scale.remedy}"
    return ""


STALLED = NEGLIGIBLE
"""A margin explains why a run cannot go on if it has shrunk to this part of its largest value and would close within
this part of the time that has passed.
"""

RESOLVED = NEWTON_EPS
"""Part of the time that has passed within which roundoff hides whether a margin shrinks."""

UNRESOLVED = Status.STEP_UNDERFLOW, Status.NOT_FINITE, Status.SINGULAR
"""Ends of runs in which a state may change too fast for time to resolve."""

STEEP = 2.0
"""Time in which a margin closes, in units of that in which the fastest state changes by itself, up to which it is that
change: one, and some for the last step, over which the rate is not constant.
"""

RUNAWAY = 1e12
"""Size of a diverging state, in units of its scale."""

RUNS_AWAY, GROWS = "runs away", "grows beyond all bounds"
"""How a state diverges: ever faster, or to sizes above RUNAWAY."""

LED_BACK = (
    "the rates lead back from it; they are so far apart that the last digits of the fast ones have carried it there",
    "the rates lead back from it; at this `rtol` steps may err by more than a bound allows for: tighten it",
)
"""Why a bonding variable is beyond its bound: by roundoff, or where steps may err by more than the slack of bounds."""


EXTRAPOLATIONS = np.ldexp(1.0, np.arange(-4, 3))
"""Lengths of the extrapolation beyond the end of a run, in units of the last step."""


def termination(
    system: System,
    program: Program,
    margins: Sequence[Margin],
    result: Result,
    values: Mapping[str, float],
    named: Callable[[Array], Array],
) -> tuple[str, str]:
    """Return the status of a run that could not go on, and why; ``named`` evaluates quantities at rows of inputs."""
    where = f"t = {result.t:.9g} s"
    parameters = result.problem.parameters[result.segments_at(np.array([result.t]))[0]]
    inputs = np.concatenate(([result.t], result.y, result.ydot, parameters))
    shrunk = closest_margin(system, program, margins, result)
    if shrunk is not None:
        return "stopped", f"{system.reason(shrunk, inputs)} near {where}"
    algebraic = [state for state in system.states if state.algebraic]
    if result.status in (Status.NO_CONSISTENT_STATE, Status.SINGULAR) and algebraic:
        return "stopped", f"{_unbalanced(system, algebraic, inputs)} at {where}"
    end = hidden(system.states, result) or runaway(system.states, result)
    if end := end or beyond_numbers(system, result, inputs, named):
        return "stopped", f"{end} near {where}"
    cause = too_fast(system, result, values) or swiftest(system.states, result)
    return "failed", f"{REASONS[result.status]} at {where}{_spent(result)}{cause}"


def _unbalanced(system: System, algebraic: Sequence[State], inputs: Array) -> str:
    """Describe why algebraic states have no values that satisfy their balances."""
    if all(state.is_temperature for state in algebraic):
        stable = next(margin for margin in system.margins if margin.stability == algebraic[0].name)
        return system.reason(stable, np.nan_to_num(inputs))
    names = " and ".join(state.at_start[0].name for state in algebraic)
    heated = any(state.is_temperature for state in algebraic)
    more = ": ignition, or sliding that nothing steadies" if heated else ""
    return f"no {names} satisfies the balances that have no inertia or capacity{more}"


def _spent(result: Result) -> str:
    """Describe the step budget if it was used up, and how many steps were ended by events or loads; else empty."""
    if result.status is not Status.MAX_STEPS:
        return ""
    problem = result.problem
    ended = int(np.searchsorted(problem.segments, result.t)) - 1
    many = NEGLIGIBLE * problem.max_steps < ended
    words = f", and {ended} of them ended at events, or where loads turn or pass what is narrow" if many else ""
    return f" (`run.max-steps` is {problem.max_steps}{words})"


def are_led_back(
    system: System, program: Program, margin: Margin, t: Array, y: Array, parameters: Array
) -> NDArray[np.bool_]:
    """Return a mask of runs that ended at the bound of a bonding variable only by roundoff: the rates there lead back.

    The ends of the runs are the rows.
    """
    # Not from the accounts of the bonds, which a sweep may leave out.
    names, bonds = [state.name for state in system.states], {each.bound[0] for each in system.margins if each.bound}
    if margin.bound is None or margin.bound[0] not in names:
        return np.zeros(len(t), dtype=bool)
    (name, limit), y = margin.bound, y.copy()
    for j, other in enumerate(names):
        if other in bonds:  # where one kind of bond occupies all sites, the others are zero
            y[:, j] = np.maximum(y[:, j], 0.0) if limit == 0 else 0.0
    j = names.index(name)
    symbols = [parameter.symbol for parameter in system.parameters]
    y[:, j] = symengine.Lambdify(symbols, [system.expand(limit)])(parameters)[:, 0]
    found = consistent(program, t, y, np.zeros_like(y), parameters)
    return found.valid & (found.ydot[:, j] >= 0 if limit == 0 else found.ydot[:, j] <= 0)


def closest_margin(system: System, program: Program, margins: Sequence[Margin], result: Result) -> Margin | None:
    """Return the margin that is closed, or nearly so and still closing, where a run could not go on; else None."""
    if program.margins is None or not margins:
        return None
    count, end = len(margins), Points(np.array([result.t]), result.y[None], result.ydot[None], result.ledger[None])
    terminal = np.array([margin.terminal for margin in margins])
    last = _values(system, program, result, end, side="right")[0, :count]
    if np.any(closed := terminal & (last <= 0)):
        return margins[int(np.argmax(closed))]
    if result.steps is None or len(result.steps.t) < 2:
        return None
    seen, t = _values(system, program, result, result.steps)[:, :count], result.steps.t
    before = max(int(np.searchsorted(t, t[-1] * (1 - RESOLVED))) - 1, 0)
    speeds = _speeds(system.states, result)
    fastest = int(speeds.argmax())
    with np.errstate(invalid="ignore", divide="ignore"):  # NaN where margins or states stand still
        shrink = seen[-1] / np.fmax.reduce(np.abs(seen), axis=0)
        left = seen[-1] / (seen[before] - seen[-1]) * (t[-1] - t[before])
        # A margin with an infinite slope at its end, as of bonds that share a load, is still large where time resolves
        # no more: it closes ever faster, no state faster.
        steep = (left * speeds[fastest] < STEEP) & (result.status in UNRESOLVED and _is_faster(result, fastest))
    closing = terminal & (seen[-1] < seen[before]) & ((left < STALLED * t[-1]) | (shrink < CLOSED_GUARD))
    closing &= (shrink < STALLED) | steep
    nearest = int(np.argmin(np.where(closing, shrink, np.inf)))
    return margins[nearest] if closing[nearest] else None


def _values(
    system: System, program: Program, result: Result, steps: Points, side: Literal["left", "right"] = "left"
) -> Array:
    """Return the margins at all steps, shape (steps, margins), NaN where inactive; ``side`` is that of breakpoints."""
    assert program.margins is not None
    segment = np.searchsorted(result.problem.segments[1:-1], steps.t, side=side)
    inputs = [steps.t[:, None], steps.y, steps.ydot, result.problem.parameters[segment]]
    values = np.atleast_2d(program.margins(program.filled(np.concatenate(inputs, axis=1))))
    active = np.array([system.active_guards(row) for row in result.problem.parameters])[segment]
    return np.where(active, values, np.nan)


def hidden(states: Sequence[State], result: Result) -> str | None:
    """Describe the algebraic state that roundoff of its balance hides, if the step size underflowed there."""
    if result.status is not Status.STEP_UNDERFLOW:
        return None
    noise, scales = rounding(result), np.array([state.scale for state in states])
    uncertain = noise / (np.abs(result.y) + ATOL_OF_SCALE * scales) * [state.algebraic for state in states]
    j = int(np.argmax(uncertain))
    if not uncertain[j] > SINGULAR_NOISE:
        return None
    name, unit = states[j].name, states[j].quantity.unit
    value, left = f"{result.y[j]:.3g} {unit}", f"{noise[j]:.2g} {unit}"
    return f"roundoff hides {name} = {value}: terms that cancel in its balance are so large that they leave {left} open"


def runaway(states: Sequence[State], result: Result) -> str | None:
    """Describe the state that changes too fast for time to resolve, if that is why a run could not go on."""
    if result.status not in UNRESOLVED:
        return None
    beyond = np.abs(result.y) / np.array([state.scale for state in states])
    if np.max(beyond) > RUNAWAY:
        j = int(np.argmax(beyond))
        return f"{states[j].name} {GROWS}, to {result.y[j]:.3g} {states[j].quantity.unit}"
    speed = _speeds(states, result)
    j = int(np.argmax(speed))
    if not (speed[j] * result.t > 1 / IDLE and _is_faster(result, j)):
        return None
    if states[j].given is not None:
        # The age of the contact diverges together with a velocity without inertia: name the velocity.
        names = [state.at_start[0].name for state in states if state.given and (state.algebraic or state is states[j])]
        return f"{names[0]} {RUNS_AWAY}, faster and faster"
    unit = states[j].quantity.unit
    return f"{states[j].name} {RUNS_AWAY}: it changes by {result.ydot[j]:.3g} {unit}/s, faster and faster"


def swiftest(states: Sequence[State], result: Result) -> str:
    """Describe the state with the fastest relative change if the step size underflowed, or that none changes; otherwise
    empty.
    """
    if result.status is not Status.STEP_UNDERFLOW:
        return ""
    speeds = _speeds(states, result)
    j = int(np.argmax(speeds))
    if speeds[j] == 0:
        return ": no state changes there; what grows too fast is an account, of heat or of what is made"
    unit, value, rate = states[j].quantity.unit, result.y[j], result.ydot[j]
    return f": {states[j].name} = {value:.3g} {unit}".removesuffix(" 1") + f" changes by {rate:.3g} {unit}/s"


def _speeds(states: Sequence[State], result: Result) -> Array:
    """Return the relative rates of change of the states [1/s]."""
    scales = np.array([state.scale for state in states])
    with np.errstate(over="ignore", invalid="ignore"):
        return np.nan_to_num(np.abs(result.ydot) / (np.abs(result.y) + ATOL_OF_SCALE * scales))


def no_number(system: System, outputs: Array) -> str:
    """Describe the first of the outputs that is not finite; otherwise empty."""
    finite = np.isfinite(outputs)
    return "" if finite.all() else f"{list(system.output_columns)[int(np.argmin(finite))]} is no finite number"


def beyond_numbers(system: System, result: Result, inputs: Array, named: Callable[[Array], Array]) -> str | None:
    """Describe the first named quantity that becomes infinite or NaN as the states continue, if that ended the run.

    Of several the first in the list is taken, on which the others depend.
    """
    if result.status is Status.NO_CONSISTENT_STATE and (odd := no_number(system, named(inputs[None])[0])):
        return odd
    if result.status is not Status.NOT_FINITE or result.steps is None or len(result.steps.t) < 2:
        return None
    n, ahead = len(result.y), np.append(0.0, EXTRAPOLATIONS) * np.diff(result.steps.t)[-1]
    rows = np.tile(inputs, (len(ahead), 1))
    rows[:, 0] += ahead
    rows[:, 1 : 1 + n] += ahead[:, None] * result.ydot
    with np.errstate(all="ignore"):
        number = np.isfinite(named(rows))
    first = np.where(number.all(axis=0) | ~number[0], len(ahead), np.argmin(number, axis=0))
    if first.min(initial=len(ahead)) == len(ahead):
        return None
    return f"{list(system.output_columns)[int(np.argmin(first))]} leaves the range of numbers"


def _is_faster(result: Result, j: int) -> bool:
    """True if the rate of a state has doubled since the last breakpoint or event, where a steep load may begin."""
    if result.steps is None:
        return False
    places = np.concatenate((result.problem.segments, result.events.t))
    begun = np.max(places[places <= result.t])
    # The first step that ends there started before it; immediate divergence ends further ones at the same time.
    since = np.searchsorted(result.steps.t, begun)
    since += bool(result.steps.t[since:].size) and result.steps.t[since] == begun
    return bool(np.any(2 * np.abs(result.steps.ydot[since:, j]) < abs(result.ydot[j])))
