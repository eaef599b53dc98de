"""Exact solution of a scene: parameters read off the scene, and a check that it solves the scene's equations.

An exact solution that does not belong to the scene is refused: it must have the initial values of the scene, satisfy
the assembled equations, and conserve the energy of the scene in its jumps.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import lru_cache, partial
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from surfacechem import references
from surfacechem.errors import InputError
from surfacechem.references.base import ConstantCapacity, QuadraticEnergy, Reference, SceneView
from surfacechem.results.event_table import SIDE
from surfacechem.scene import Scene
from surfacechem.solve.contract import Array
from surfacechem.solve.run import Trajectory
from surfacechem.tolerances import EQUAL, EQUATION_MISMATCH, FEW_EPS, QUARTER_EPS, RUN_EPS, RUN_ERROR, SQRT_EPS

Solution = Callable[[Array], dict[str, Array]]
"""Function for exact values under the names of the scene, at any times."""

DIFFERENCE_ROUNDING = 2 * FEW_EPS
"""Relative rounding of a difference of five values."""

MOST_PROBES = 7
"""Number of times at which the equations are tested, in as many arcs between events if there are so many."""

JUMP_RATIO = 10.0
"""Ratio of the change of a solution to that over an equal time before, above which the change is a jump. A smooth
solution has the ratio 1, a power p of the remaining time 1/(2^p - 1): 2.4 for a root. Ten, that of p = 1/7, is a
choice; a smaller jump is taken for a smooth change, and the difference behind it counts as an error.
"""

END_PART = 0.01
"""Fraction of an arc near its ends in which nothing is tested, since the times of events have errors."""

SHORTEST_ARC = 8 * SQRT_EPS
"""Ratio of its length to the time, below which an arc is too short for differences in time: their steps are
DIFFERENCE_STEP of it, 1e-11 of the time, of which the last digit of time is 2e-5.
"""

DIFFERENCE_STEP = QUARTER_EPS
"""Step of five-point differences in time, relative to the time since the start of the arc: truncation is of fourth
order, 2e-16, and rounding 1e-12.
"""


@contextmanager
def in_range() -> Iterator[None]:
    """Raise InputError for an arithmetic error, such as an overflow: the solution is for another scene."""
    try:
        yield
    except ArithmeticError:
        raise InputError("its formulas leave the range of numbers") from None


@in_range()
def exact_values(
    reference: Reference,
    scene: Scene,
    run: Trajectory,
    to_the_end: bool = False,
    side: float = SIDE,
    tested: bool = True,
) -> dict[str, Array]:
    """Return exact values at the output times by the names of the scene.

    InputError if the solution is that of another scene, unless it was ``tested`` before.

    With ``to_the_end`` the outputs of a run may lie beyond the end of the solution by the error of its own end. Jumps
    of run and solution are the same if their times differ by less than the fraction ``side``.
    """
    solution = partial(_solution, reference, SceneView(scene, run))
    times = np.minimum(run.result.times, reference.end_time) if to_the_end else run.result.times
    before_end = times[-1] * (1 - SIDE * np.array([2.0, 4.0]))
    # A run that ends at its start meets no equation.
    probed = tested and len(times) > 1 and not reference.continuous
    probes, since = _probes(run) if probed else (np.empty(0), np.empty(0))
    step = DIFFERENCE_STEP * since
    around = probes + np.multiply.outer(np.arange(-2, 3), step)
    # All times in one call, as the cost of an exact solution is per call.
    every = solution(np.concatenate([times, before_end, around.ravel()]))
    first = len(times) + len(before_end)
    exact = {each: values[: len(times)].copy() for each, values in every.items()}

    def until_end(t: Array) -> dict[str, Array]:
        return solution(np.minimum(t, reference.end_time))

    near_end = {each: values[len(times) : first] for each, values in every.items()}
    _choose_sides(exact, near_end, until_end, run, side)
    if reference.continuous:
        return _with_profiles(reference, exact, scene, run)
    for j, state in enumerate(run.model.system.states if tested else ()):
        if state.name in exact:
            start, ours = exact[state.name][0], run.result.outputs[0, j]
            if not _same(start, ours, state.scale):
                raise InputError(f"it starts from {state.name} = {start:.9g}, the scene from {ours:.9g}.")
    if probed:
        near = {each: values[first:].reshape(5, -1) for each, values in every.items()}
        _check_equations(near, run, probes, step)
        _check_jumps(until_end, run, side)
    return exact


def _choose_sides(
    exact: dict[str, Array], before_end: Mapping[str, Array], solution: Solution, run: Trajectory, side: float
) -> None:
    """Replace exact values at the times of jumps by those on the side of the jump on which the run has its output.

    Jumps are those of the run and of its loads, and one of the solution at the very end, where roundoff decides whether
    a run still has it.
    """
    times = run.result.times
    moments = np.array([*run.result.problem.segments[1:-1], *(jump.t for jump in run.jumps)])
    if len(moments):
        around = np.concatenate([[-np.inf], np.unique(moments), [np.inf]])
        k = np.searchsorted(around, times)
        near = np.minimum(times - around[k - 1], around[k] - times) <= SIDE * times
        for way in (-SIDE, SIDE, -side, side) if near.any() else ():
            _take_nearer(exact, solution(times[near] * max(1 + 2 * way, 0.0)), run, near)
        if near[-1]:
            return
    last = np.array([values[-1] for values in exact.values()])
    close, far = np.reshape([*before_end.values()], (-1, 2)).T
    jumped = np.abs(last - close) > JUMP_RATIO * np.abs(close - far) + EQUAL * np.abs(close)
    if jumped.any():
        others = {name: close[k : k + 1] for k, name in enumerate(before_end) if jumped[k]}
        _take_nearer(exact, others, run, times >= times[-1] * (1 - SIDE))


def _take_nearer(exact: dict[str, Array], others: Mapping[str, Array], run: Trajectory, at: NDArray[np.bool_]) -> None:
    """Replace exact values at some outputs by other values that are nearer to those of the run."""
    system = run.model.system
    for name, other in others.items():
        if name in system.state_columns:
            own = run.result.outputs[at, system.state_columns[name]]
        elif name in system.output_columns:
            own = run.outputs[at, system.output_columns[name]]
        else:
            continue
        nearer = np.abs(other - own) < np.abs(exact[name][at] - own)
        exact[name][at] = np.where(nearer, other, exact[name][at])


@in_range()
def match(name: str, options: Mapping[str, float], view: SceneView) -> Reference:
    """Return the named reference with the parameters of the scene, and ``options`` for those not in the scene.

    InputError if an option differs from the value of the scene, as after a change of the scene alone.
    """
    # Options supply parameters that the scene does not determine; others must agree with the scene.
    kind = references.get(name)
    values, told = dict(options), kind.from_scene(view)
    for item in kind.parameters:
        found, spec = told.get(item.name), item.metadata["spec"]
        if found is None:
            if item.name not in values and item.default is dataclasses.MISSING:
                raise InputError(f"it needs {item.name} ({spec.text}), which the scene has not.")
        elif item.name not in options:
            values[item.name] = found
        elif not _same(options[item.name], found, 0.0):
            ours, theirs = (f"{value:.9g} {spec.unit}" for value in (found, options[item.name]))
            raise InputError(f"it is given for {item.name} = {theirs}; the scene has {ours}.")
    return kind(**values)


def _same(a: float, b: float, scale: float) -> bool:
    return abs(a - b) <= max(EQUAL * max(abs(a), abs(b)), RUN_EPS * scale)


def _solution(reference: Reference, view: SceneView, t: Array) -> dict[str, Array]:
    """Return exact values under the names of the scene, and the temperature that follows from the heat."""
    exact = reference.solution(t)
    energies = {body.energy.name() for body in view.scene.bodies if body.energy is not None}
    if "T" not in exact and "heat" in exact and energies in ({"quadratic"}, {"constant"}) and view.temperature:
        model = QuadraticEnergy() if energies == {"quadratic"} else ConstantCapacity()
        T, T_0 = view.temperature, view.constant("T_0")
        exact["T"] = T + model.rise(exact["heat"], view.capacity, T if T_0 is None else T_0, T)
    return renamed(exact, view.run)


def _with_profiles(reference: Reference, exact: Mapping[str, Array], scene: Scene, run: Trajectory) -> dict[str, Array]:
    """Return exact values of bodies without cells by the names of the scene, with their profiles.

    At the instant of first contact the temperature of the contact is undefined: the value of the run is taken.
    """
    system, times = run.model.system, run.result.times
    result = {name: x.copy() for name, x in exact.items() if name in system.state_columns | system.output_columns}
    shared = scene.bodies[0].temperature
    if "T" in exact and shared == scene.bodies[1].temperature and isinstance(shared, str):
        result[shared] = exact["T"].copy()
    for item in system.profiles:
        places = np.array(item.points) * run.values[item.thickness]
        result[item.name] = reference.profile(item.number, places, times)
        if item.surface in system.state_columns:
            ours = run.result.outputs[0, system.state_columns[item.surface]]
            result[item.name][0, 0] = ours
            if item.surface in result:
                result[item.surface][0] = ours
    return result


def renamed(exact: Mapping[str, Array], run: Trajectory) -> dict[str, Array]:
    """Return exact values under the names of the scene; variables that it does not have are left out."""
    system = run.model.system
    known = system.variable_columns
    temperatures = [name for name, state in system.own_states.items() if state.is_temperature]
    rates = [own for own in known if own.startswith("R_")]
    # Variables with another name in exact solutions.
    others = {"T": temperatures, "R_c": rates, "sigma_chem": [f"sigma_{own[2:]}" for own in rates]}
    result = {}
    for name, values in exact.items():
        candidates = [name] if name in known else others.get(name, [])
        if len(candidates) == 1:
            result[candidates[0]] = values
    return result


def _check_equations(near: Mapping[str, Array], run: Trajectory, t: Array, step: Array) -> None:
    """Refuse a solution that does not satisfy the scene's equations, by its values at the probes ``t`` and at two steps
    before and after each, shape (5, probes).
    """
    system, problem, program = run.model.system, run.result.problem, run.model.program
    names = list(system.state_columns)
    if missing := [name for name in names if name not in near]:
        raise InputError(f"it says nothing of {', '.join(missing)}.")
    values = np.array([near[name] for name in names]).reshape(len(names), 5, len(t))
    # Rates by central differences, and their rounding.
    slope = (8 * (values[:, 3] - values[:, 1]) - (values[:, 4] - values[:, 0])) / (12 * step)
    rounding = (DIFFERENCE_ROUNDING * (np.abs(values[:, 2]) + np.abs(t * slope)) / step).T
    y, ydot = values[:, 2].T, slope.T
    _check_given({name: found[2] for name, found in near.items()}, run, t, y, ydot)
    segment = np.searchsorted(problem.segments[1:-1], t, side="left")
    inputs = np.concatenate([t[:, None], y, ydot, problem.parameters[segment]], axis=1)
    _check_guards(run, inputs)
    misses = program.residual(inputs)
    by_state, by_rate = program.derivatives(inputs)
    terms = by_rate * ydot[:, None, :]
    known = (np.abs(by_rate) * rounding[:, None, :]).sum(axis=2)
    # Residuals within the rounding of the rates count as zero.
    misses = np.copysign(np.maximum(np.abs(misses) - known, 0.0), misses)
    sizes = np.abs(terms).sum(axis=2) + np.abs(misses - terms.sum(axis=2))
    # Near equilibrium all terms of an equation vanish, so its largest size over the run is the scale.
    largest = sizes.max(axis=0)
    parts = np.abs(misses) / np.where(largest > 0, largest, 1.0)
    # A balance without rates has no scale, as its terms cancel. It determines algebraic states, so that its error is
    # that of these states: the correction of Newton's method, relative to them.
    still, algebraic = ~by_rate.any(axis=(0, 2)), np.array([state.algebraic for state in system.states])
    if still.any():
        reach = np.abs(y[:, algebraic]).max(axis=0)
        reach = np.where(reach > 0, reach, [state.scale for state in system.states if state.algebraic])
        slopes = by_state[:, still][:, :, algebraic] * reach
        for part, miss, matrix in zip(parts, misses[:, still], slopes, strict=True):
            if np.all(np.isfinite(miss)) and np.all(np.isfinite(matrix)):
                part[still] = np.abs(np.linalg.lstsq(matrix, -miss)[0]).max()
    if parts.max() > EQUATION_MISMATCH:
        j, row = np.unravel_index(parts.argmax(), parts.shape)
        equation = list(system.rows)[row]
        raise InputError(f"at t = {t[j]:.3g} s it misses the equation of {equation} by {100 * parts.max():.3g}%.")


def _check_guards(run: Trajectory, inputs: Array) -> None:
    """Refuse a solution that is where the scene jumps; ``inputs`` are its states in the modes of the run."""
    model, first = run.model, len(run.model.margins)
    if model.jumper is None or model.program.margins is None:
        return
    least = -EQUATION_MISMATCH * model.jumper.first_magnitudes(inputs)
    for k, j in np.argwhere(model.program.margins(inputs) < least):
        if j >= first and model.system.active_guards(inputs[k, 1 + 2 * model.program.n :])[j]:
            why = model.system.edges[j - first].reason
            raise InputError(f"at t = {inputs[k, 0]:.3g} s it is beyond a jump of the scene: {why}.")


def _check_jumps(solution: Solution, run: Trajectory, side: float) -> None:
    """Refuse a solution that does not conserve the scene's energy in the jumps of the run that make heat of it.

    Its energy on either side of a jump is that on the parabola through three times, which lie farther from the jump
    than ``side`` and than the time of the jump may err; it is known to what the line through two of them misses.
    """
    model, columns, late = run.model, run.model.system.state_columns, max(side, RUN_ERROR * run.run.rtol)
    moments = {t: list(jumps) for t, jumps in groupby(run.jumps, key=lambda jump: jump.t)}
    # What the last of ever smaller jumps release is lost in the roundoff of the solution.
    most = max((sum(abs(jump.released) for jump in jumps) for jumps in moments.values()), default=0.0)
    for t, until, jumps in zip(moments, [*moments, run.result.t][1:], moments.values(), strict=False):
        around = t * (1 + 2 * late * np.array([-3, -2, -1, 1, 2, 3]))
        released = sum(abs(jump.released) for jump in jumps)
        if not released or not (t - jumps[0].since <= around[0] and around[-1] <= until):
            continue
        near = solution(around)
        y = np.column_stack([near[name] for name in columns])
        modes = np.repeat([jumps[0].before.parameters, jumps[-1].after.parameters], 3, axis=0)
        named = model.named(np.column_stack((around, y, np.zeros_like(y), modes)))
        energy = named[:, model.system.output_columns["E_total"]]
        bends = energy[[0, 5]] - 2 * energy[[1, 4]] + energy[2:4]
        before, after = 2 * energy[2:4] - energy[[1, 4]] + bends
        missing = after - before + sum(jump.heat_out - sum(jump.work.values()) for jump in jumps)
        unsure = np.abs(bends).sum() + RUN_EPS * np.abs(energy).max()
        if not abs(missing) <= (EQUATION_MISMATCH + late) * most + unsure:
            text = f"{abs(missing):.3g} J/m^2 of the {released:.3g} J/m^2 that the scene releases"
            raise InputError(f"at t = {t:.3g} s it misses {text}.")


def _check_given(exact: Mapping[str, Array], run: Trajectory, t: Array, y: Array, ydot: Array) -> None:
    """Refuse a solution for another load."""
    columns = run.model.system.output_columns
    loads = {role.variable for role in run.model.system.roles if role.role == "prescribed"}
    given = [name for name in columns if name in loads and name in exact]
    named = run.model.evaluate(run.result, t, y, ydot) if given else np.empty(0)
    for name in given:
        theirs, ours = exact[name], named[:, columns[name]]
        for k in np.flatnonzero(~(np.abs(theirs - ours) <= EQUAL * np.abs(ours).max()))[:1]:
            raise InputError(f"at t = {t[k]:.3g} s its {name} is {theirs[k]:.6g}, the scene's {ours[k]:.6g}.")


def _edges(run: Trajectory) -> tuple[float, ...]:
    """Return the times between which a run has no event or breakpoint, in order."""
    end = float(run.result.times[-1])
    return tuple(sorted({end, *(t for t in run.result.problem.segments.tolist() if t <= end)}))


def _probes(run: Trajectory) -> tuple[Array, Array]:
    """Return the times at which the equations are tested, and the time since the start of the arc at each: inside arcs
    and, as all may be over in a small part of the first, at the ends of some of its steps.
    """
    edges, steps = _edges(run), run.result.steps
    probes, since = _spread(*edges)
    if steps is None:
        return probes, since
    first = steps.t[(steps.t > 0) & (steps.t < (1 - END_PART) * edges[1])]
    some = first[np.unique(np.linspace(0, len(first) - 1, MOST_PROBES).astype(int))] if len(first) else first
    return np.append(some, probes), np.append(some, since)


@lru_cache
def _spread(*edges: float) -> tuple[Array, Array]:
    """Return times inside the arcs between ``edges``, and the time since the start of the arc at each."""
    if len(edges) < 2:
        raise InputError("the run ended before anything could be compared.")
    long = np.flatnonzero(np.diff(edges) > SHORTEST_ARC * np.array(edges[1:]))
    spread = np.linspace(0, len(long) - 1, MOST_PROBES).astype(int)
    chosen = long[np.union1d(spread, np.arange(min(MOST_PROBES, len(long))))]
    parts = np.linspace(END_PART, 1 - END_PART, max(2, MOST_PROBES // len(chosen)))
    since = np.multiply.outer(np.diff(edges)[chosen], parts)
    return np.ravel(np.array(edges)[chosen, None] + since), np.ravel(since)
