"""Error of a run: from an exact solution, from a second run at another tolerance, or from its own balances.

>>> import surfacechem
>>> case = surfacechem.load("exothermic")
>>> case.run().accuracy.source, case.run(error="balances").accuracy.source
('exact solution exothermic-bonding', 'balances only: what they miss is not seen')
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from surfacechem.contracts.terms import Law
from surfacechem.errors import InputError, Place, refuse_unknown
from surfacechem.results.accuracy import (
    CELLS_UNKNOWN,
    ENDED_AT_START,
    NOTHING_EVOLVES,
    RTOL_PART,
    Accuracy,
    CellErrors,
    largest_errors,
    second_tolerance,
)
from surfacechem.results.audit import audit
from surfacechem.results.dataset import profile_values
from surfacechem.results.event_table import KINK, SIDE, event_times
from surfacechem.scene import Scene
from surfacechem.solve import AUTO, method
from surfacechem.solve.contract import Array, Mask, Problem, States, Status, among
from surfacechem.solve.run import Run, Trajectory
from surfacechem.tolerances import (
    ATOL_OF_SCALE,
    BRIEF_PART,
    EPS,
    ERROR_FLOOR,
    FINER_BY,
    MIN_RTOL,
    NEGLIGIBLE,
    RUN_ERROR,
    SQRT_EPS,
)

if TYPE_CHECKING:
    from surfacechem.references.base import Reference

ENDED_EARLIER = "ended earlier"
"""Note on a second run that ended before the first one."""

ERROR_SOURCES = ("auto", "estimate", "balances")
"""Sources of the error: an exact solution if there is one, else a second run; always a second run; the balances only.
"""

MOST_TIMES = 400
"""Largest number of times at which an exact solution is evaluated, and of those inside steps at which a second run is.
"""

DRIVING_TIMES = 10.0 ** np.arange(-15, 1)
"""Time steps, relative to a run, over which one state may drive another."""

ENERGY_UNIT, ENTROPY_UNIT = "J/m^2", "J/(m^2 K)"
"""Units of accounts that are compared with each other."""

SPENT = (Status.MAX_STEPS, Status.STOPPED)
"""Outcomes of runs that have used up their steps or their time."""

EVENTS = "event times"
"""Name of the event times among the compared variables."""


def check_source(option: str, run: Run) -> None:
    """Raise InputError for an unknown way, and for one that leaves out the second run needed to verify an accuracy."""
    refuse_unknown([option], ERROR_SOURCES, "no source '{}' of an error", Place(path="--error"))
    if option == "balances" and run.solver == AUTO:
        text = f"the accuracy {asked_accuracy(run):g} is verified by a second run, which `balances` leaves out"
        raise InputError(f"{text}: give a tolerance, `rtol`, instead of it, or another source.", Place(path="--error"))


def accuracy(
    trajectory: Trajectory,
    scene: Scene,
    exact: tuple[str, Mapping[str, float]] | None,
    option: str,
    cells: Callable[[], CellErrors] = CellErrors,
    estimate: Accuracy | None = None,
) -> Accuracy:
    """Return the error of a run by one of the ERROR_SOURCES; ``exact`` has name and parameters of the exact solution.

    ``cells`` finds the errors of the cells across bodies, which a second run at another tolerance does not see;
    ``estimate`` is the estimate from a second run, if there was one.
    """
    if ended_at_start(trajectory):
        return unknown(ENDED_AT_START)
    if option == "balances":
        if len(trajectory.result.times) < 2:
            return unknown("the run ended before its second output")
        balances = audit(trajectory)
        errors = {"energy": balances.energy_error, "entropy": balances.entropy_error, "sites": balances.site_error}
        errors |= {law.path: law.error for law in inexact(scene)}
        return Accuracy(stated(errors), "balances only: what they miss is not seen", errors)
    unused = ""
    if exact is not None and option != "estimate":
        try:
            known = {EVENTS: estimate.variables[EVENTS]} if estimate and EVENTS in estimate.variables else None
            found = against_exact(trajectory, scene, *exact, late=known)
            return replace(found, asked=estimate.asked if estimate else None)
        except InputError as error:
            unused = f"; the exact solution {exact[0]} does not apply to this scene: {error.message}"
    estimate = with_cells(estimate or against_tighter(trajectory), cells())
    return replace(estimate, source=f"{estimate.source}{unused}")


def ended_at_start(trajectory: Trajectory) -> bool:
    """True if a run ended at its start, so that no step of a method has contributed to it."""
    result = trajectory.result
    return not len(result.times) or (trajectory.status == "stopped" and result.t == 0)


def inexact(scene: Scene) -> list[Law]:
    """Return the laws that compute numbers themselves, with an error."""
    return [law for law in (*scene.interface.potentials, *scene.heat) if law.error > 0]


def law_errors(trajectory: Trajectory, other: Trajectory, scene: Scene) -> CellErrors:
    """Return the errors of a run due to errors of numbers that laws compute, from a run whose laws differ by these."""
    also = [name for name in trajectory.model.system.output_columns if name == "t_n" or name.startswith("q_")]
    errors, note = state_differences(trajectory, other, also=also)
    if note or trajectory.status != other.status:
        errors[EVENTS] = math.inf
    most = max(law.error for law in inexact(scene))
    return CellErrors(errors, source=f"and one with forces of the surfaces wrong by their error, {most:.1e}")


def against_exact(
    trajectory: Trajectory,
    scene: Scene,
    name: str,
    options: Mapping[str, float],
    second: Trajectory | None = None,
    late: Mapping[str, float] | None = None,
) -> Accuracy:
    """Return the largest errors at the times at which the run is compared, and those of the times of events.

    Event times are compared with the end of the exact solution if all events are there, else with a second run, which
    is made if ``second`` is not given and the errors ``late`` of event times are unknown. InputError if the exact
    solution is another scene's.
    """
    from surfacechem.references.base import SceneView
    from surfacechem.results.matching import exact_values, in_range, match

    # With cells, whose layers are unresolved at first, errors are taken at the requested times.
    seen = trajectory if trajectory.model.system.profiles else trajectory.stored
    # Its parameters are read at the start of the run; of many outputs the others are not needed.
    begun = seen if len(seen.result.times) <= MOST_TIMES else seen.picked(slice(1))
    reference = match(name, options, SceneView(scene, begun))
    if late is None:
        with in_range():
            late = _event_errors(trajectory, reference, second)
    latest = max(late.values(), default=0.0)
    if not trajectory.model.system.profiles:
        seen = fewer(seen, latest)
    exact = exact_values(reference, scene, seen, to_the_end=True, side=max(SIDE, latest))
    # A solution that ends with an infinite slope has no value at its last moment.
    alike = _off_events(seen, latest) & np.isfinite(np.column_stack([*exact.values()])).all(axis=1)
    ours, known = computed(seen), sizes(seen, named=exact.keys() - states(seen).keys())
    if not alike.all():
        ours, known = ({key: each[key][alike] for key in exact} for each in (ours, known))
    true = exact if alike.all() else {key: values[alike] for key, values in exact.items()}
    errors = largest_errors(ours, true, known) | dict(late)
    error = stated(errors)
    at = partial(exact_values, reference, scene, to_the_end=True, side=max(SIDE, error), tested=False)
    return Accuracy(error, f"exact solution {name}", errors, at)


def _event_errors(trajectory: Trajectory, reference: Reference, second: Trajectory | None) -> dict[str, float]:
    """Return the errors of the times of events beside an exact solution."""
    found = event_times(trajectory)
    if not found or trajectory.result.status in SPENT:
        return {}
    end = reference.end_time
    if all(np.all(np.abs(times - end) <= SQRT_EPS * times) for times in found.values()):  # the solution ends there
        expected = {name: np.full(len(times), end) for name, times in found.items()}
    else:  # exact solutions have no list of events: a second run finds them, and no step depends on its outputs
        run = trajectory.run
        brief = run.second(
            second_tolerance(run.rtol), times=(0.0, run.times[-1]), picture=None, looks=0.0, accounts=False
        )
        expected = event_times(second or trajectory.model.solve_values(brief, trajectory.values))
    return event_errors(found, expected, trajectory.run.times[-1])


def _off_events(trajectory: Trajectory, late: float) -> Mask:
    """Return the mask of outputs away from every jump, and from the end of a run stopped by physics.

    The times of these may err by the relative amount ``late``, and near them the side of an exact solution, and its
    slope, depend on the time. Outputs are also left out within a brief part of the time to the next jump.
    """
    result, end, stopped = trajectory.result, trajectory.run.times[-1], trajectory.status == "stopped"
    moments = np.array(sorted({*(jump.t for jump in trajectory.jumps), *[result.t] * stopped}))
    if not len(moments):
        return np.ones(len(result.times), bool)
    brief = BRIEF_PART * np.diff([0.0, *moments, max([end, *moments[-1:]])])
    ways = moments - np.maximum(brief[:-1], 2 * late * moments), moments + np.maximum(brief[1:], 2 * late * moments)
    return clear_of(result.times, np.transpose(ways))


def fewer(trajectory: Trajectory, late: float = 0.0) -> Trajectory:
    """Return the run with at most MOST_TIMES outputs, so that an exact solution is quick: its ends, and outputs away
    from events, whose times may err by the relative amount ``late``.
    """
    times = trajectory.result.times
    if len(times) <= MOST_TIMES:
        return trajectory
    kept = _off_events(trajectory, late)
    kept[[0, -1]] = True
    rows = np.flatnonzero(kept)
    return trajectory.at_times(times[np.unique(rows[np.linspace(0, len(rows) - 1, MOST_TIMES).round().astype(int)])])


def second_settings(trajectory: Trajectory, known: bool = False) -> Run:
    """Return the settings of the second run: another tolerance, more and other checks against the equations, and
    outputs at the times of comparison, without accounts unless these are compared. With ``known`` it has all that the
    first has, as it may become the result.
    """
    run, seen, steps = trajectory.run, trajectory.stored.result.times, trajectory.result.steps
    compared = among(seen, np.empty(0) if steps is None else steps.t)
    others = np.flatnonzero(~compared)
    compared[others[:: len(others) // MOST_TIMES + 1]] = True
    times = tuple(np.union1d(run.times if known else (0.0, run.times[-1]), seen[compared]).tolist())
    brief = {} if known else {"picture": None, "looks": 0.0, "accounts": not states(trajectory)}
    return run.second(second_tolerance(run.rtol), times=times, **brief)


def _second(trajectory: Trajectory, known: bool = False) -> Trajectory:
    """Make the second run."""
    return trajectory.model.solve_values(second_settings(trajectory, known), trajectory.values)


def against_tighter(trajectory: Trajectory) -> Accuracy:
    """Estimate the errors from a second run; unknown if the first has used up its budget, as the second would, too."""
    if trajectory.result.status in SPENT:
        return unknown(f"the run failed: {trajectory.reason}")
    return estimated(trajectory, _second(trajectory))


def estimated(trajectory: Trajectory, second: Trajectory) -> Accuracy:
    """Return the errors of states and event times, estimated from a second run at another tolerance."""
    other = second.run.rtol
    if ended_at_start(trajectory):
        return unknown(ENDED_AT_START)
    if trajectory.status == "failed" and len(trajectory.result.times) < 2:
        return unknown(f"the run failed: {trajectory.reason}")
    earlier, later = sorted((second, trajectory), key=lambda each: each.result.t)
    apart = later.result.t - earlier.result.t > RUN_ERROR * trajectory.run.rtol * trajectory.run.times[-1]
    if second.status == "failed" or (apart and earlier.status == "stopped" != later.status):
        fate = ENDED_EARLIER if earlier is second else f"{second.status} later"
        return unknown(f"a second run at rtol {other:.0e} {fate}: {second.reason}")
    seen = trajectory.stored
    errors, note = state_differences(seen, second)
    if not errors:
        return unknown(NOTHING_EVOLVES if len(trajectory.result.times) > 1 else ENDED_AT_START)
    if note and stated(errors) > RUN_ERROR * trajectory.run.rtol:  # the two runs went different ways
        return unknown(f"a second run at rtol {other:.0e}, which had {note}")
    source = f"{second_run(second.run)}, which had {note}" if note else second_run(second.run)
    return Accuracy(stated(errors), source, errors, named=partial(of_named, seen, second))


def unknown(why: str) -> Accuracy:
    """Return an unknown error, with its reason."""
    return Accuracy(math.nan, f"unknown: {why}")


def stated(errors: Mapping[str, float]) -> float:
    """Return the error of a whole run: the largest, and at least the last digit."""
    return max(*errors.values(), EPS)


def second_run(run: Run, kind: str = "run") -> str:
    """Describe the source of an estimate: a briefer process that no law announces may be missed by both runs."""
    return f"estimate: a second {kind} at rtol {run.rtol:.0e} that resolves 1/{run.samples:.0f} of the time"


def state_differences(
    ours: Trajectory, theirs: Trajectory, first: int = 0, also: Collection[str] = ()
) -> tuple[dict[str, float], str]:
    """Return the largest differences of two runs in each state, in the named quantities ``also``, and in event times;
    and a note on events in which they differ.

    States are compared from the output number ``first`` of those that both have.
    """
    found, expected = event_times(ours), event_times(theirs)
    note = difference(found, expected)
    times = theirs.result.times[among(theirs.result.times, ours.result.times)][first:]
    rows = [run.result.times.searchsorted(times) for run in (ours, theirs)]
    errors: dict[str, float] = {}
    if first + len(times) > 1:
        alike = clear_of(times, _pairs(found, expected)) if note else agree_at_jumps(times, ours, theirs)
        points = [{profile.name: profile.points for profile in run.model.system.profiles} for run in (ours, theirs)]
        values, true = (
            {name: each[own[alike]] for name, each in _compared(run, also).items()}
            for run, own in zip((ours, theirs), rows, strict=True)
        )
        for name in points[0].keys() & points[1].keys():
            few = min(points, key=lambda each: len(each[name]))[name]  # of two grids the one with fewer points
            values[name], true[name] = (
                each[name] if own[name] == few else _cubic(own[name], each[name], few)
                for each, own in zip((values, true), points, strict=True)
            )
        known = sizes(theirs, named=values.keys() - states(theirs).keys())
        known = {name: size[rows[1][alike]] for name, size in known.items()}
        errors = largest_errors(values, {name: true[name] for name in true if name in values}, known)
    return errors | event_errors(found, expected, ours.run.times[-1]), note


def of_named(ours: Trajectory, theirs: Trajectory) -> dict[str, float]:
    """Return the largest differences of two runs in each named quantity.

    Differences within roundoff count as zero. Next to events and breakpoints times are compared instead of values.
    """
    found, expected = event_times(ours), event_times(theirs)
    times = theirs.result.times[among(theirs.result.times, ours.result.times)]
    rows = [run.result.times.searchsorted(times) for run in (ours, theirs)]
    alike = clear_of(times, _pairs(found, expected) + [(t, t) for t in ours.result.problem.segments])
    if not difference(found, expected):
        alike &= agree_at_jumps(times, ours, theirs)
    first, second = (run.picked(own[alike]) for run, own in zip((ours, theirs), rows, strict=True))
    names, true = second.model.system.output_columns, second.outputs
    rounded = RUN_ERROR * np.array(list(second.sample.roundings.values()))
    size = _named_sizes(second, [*names.values()])
    with np.errstate(invalid="ignore"):  # infinite values of both are equal
        missed = np.fmax(np.abs(first.outputs - true) - rounded, 0.0)
    errors = np.fmax.reduce(np.divide(missed, size, out=np.zeros_like(missed), where=size > 0), initial=0.0)
    named, sample = dict(zip(names, errors.tolist(), strict=True)), second.sample
    if errors.max(initial=0) <= NEGLIGIBLE:
        return named
    # Left out are quantities that never exceed the effect of errors within the tolerance of the states, an effect that
    # is quadratic in them, such as the energy of a spring at zero extension: no digit of it is known.
    changes = ours.run.rtol * np.maximum(np.abs(sample.result.outputs), state_floors(theirs))
    made, by_less = (sample.sensitivities(each) for each in (changes, changes / FINER_BY))
    largest = np.abs(sample.outputs).max(axis=0, initial=0.0)
    squares = (largest <= made) & (2 * FINER_BY * by_less <= made)
    return {name: error for (name, error), left_out in zip(named.items(), squares, strict=True) if not left_out}


def _named_sizes(trajectory: Trajectory, columns: list[int]) -> Array:
    """Return the sizes of some named quantities at the outputs: the largest value, or the change within the elapsed
    time, at the rates there, if that is more.
    """
    result = trajectory.result
    passed = SQRT_EPS * result.times
    y, segment = result.outputs + passed[:, None] * trajectory.rates, result.segments_at(result.times, result.segment)
    later = trajectory.at(States(result.times + passed, y, result.ledger_outputs, segment))
    values = trajectory.outputs[:, columns]
    with np.errstate(invalid="ignore"):
        changes = np.abs(later.outputs[:, columns] - values) / SQRT_EPS
    return np.asarray(np.fmax(np.abs(values).max(axis=0, initial=0.0), changes))


def _compared(trajectory: Trajectory, also: Collection[str]) -> dict[str, Array]:
    """Return the states at the output times, and some named quantities; without states the exchanged amounts."""
    names = [account.quantity.name for account in trajectory.model.system.ledger]
    own = states(trajectory) or dict(zip(names, trajectory.result.ledger_outputs.T, strict=True))
    return own | {name: each for name, each in computed(trajectory).items() if name in also} if also else own


def _cubic(places: Sequence[float], rows: Array, wanted: Sequence[float]) -> Array:
    """Interpolate rows at other places, by the polynomial through the four nearest points of each."""
    x, at = np.array(places), np.array(wanted)
    width = min(len(x), 4)
    first = np.clip(np.searchsorted(x, at) - width // 2, 0, len(x) - width)
    near = first[:, None] + np.arange(width)
    others = ~np.eye(width, dtype=bool)
    factors = (at[:, None, None] - x[near][:, None]) / np.where(others, x[near][:, :, None] - x[near][:, None], 1.0)
    return np.asarray((rows[:, near] * np.prod(factors, axis=2, where=others)).sum(axis=2))


def agree_at_jumps(times: Array, first: Trajectory, second: Trajectory) -> Mask:
    """Return the mask of times at which two runs with the same events have made the same jumps.

    Event times are compared separately. One run may have made one more jump at the end, where roundoff decides whether
    it still happens.
    """
    both = min(len(first.jumps), len(second.jumps))
    pairs = [(one.t, other.t) for one, other in zip(first.jumps[:both], second.jumps[:both], strict=True)]
    return clear_of(times, pairs + [(jump.t, jump.t) for jump in (*first.jumps[both:], *second.jumps[both:])])


def clear_of(times: Array, pairs: Sequence[tuple[float, float]] | Array) -> Mask:
    """Return the mask of times outside all of these intervals between the times of the same event in two runs.

    >>> clear_of(np.array([0.5, 1.0, 2.5, 4.0]), [(2.0, 3.0), (1.0, 1.0)]).tolist()
    [True, False, False, True]
    """
    if not len(pairs):
        return np.ones(len(times), bool)
    early, late = np.sort(np.sort(np.reshape(pairs, (-1, 2)), axis=1), axis=0).T
    begun = np.searchsorted(early * (1 - SIDE), times, side="right")
    return np.asarray(begun == np.searchsorted(late * (1 + SIDE), times))  # as many have ended


def with_cells(estimate: Accuracy, cells: CellErrors) -> Accuracy:
    """Add the errors of the cells across bodies to an estimate; the sum is unknown if they are."""
    if not cells.variables:
        return estimate
    if not cells.converged:
        return replace(estimate, error=math.nan, source=f"unknown: {CELLS_UNKNOWN}", variables={}, named=dict)
    if math.isnan(estimate.error):
        if estimate.source != unknown(NOTHING_EVOLVES).source:
            return estimate
        # If nothing evolves the errors of laws are the only ones.
        words = f"estimate: a second run {cells.source.removeprefix('and one ')}"
        return Accuracy(stated(cells.variables), words, cells.variables)
    errors = CellErrors(estimate.variables).added_to(cells).variables
    worst = max(estimate.error, stated(errors))
    source = f"{estimate.source}, {cells.source}"
    return replace(estimate, error=worst, variables=errors, source=source, named=dict)


def states(trajectory: Trajectory) -> dict[str, Array]:
    """Return the states at the output times, by name; those inside a body as one profile."""
    system, outputs = trajectory.model.system, trajectory.result.outputs
    found = {name: outputs[:, system.state_columns[name]] for name in system.own_states}
    return found | {profile.name: profile_values(trajectory, profile) for profile in system.profiles}


def computed(trajectory: Trajectory) -> dict[str, Array]:
    """Return states and named quantities at the output times, by name."""
    return states(trajectory) | dict(zip(trajectory.model.system.output_columns, trajectory.outputs.T, strict=True))


def sizes(trajectory: Trajectory, named: Collection[str] = ()) -> dict[str, Array]:
    """Return the sizes to which errors are relative, at each output.

    For a state this is its value plus its change within the elapsed time at the current rate, at most its largest
    value, unless it changes by itself within a moment; at the end, unless physics ended the run, the value alone. For a
    profile it is the least size that counts, for a quantity ``named`` in addition to states the largest value, or the
    change within the elapsed time if that is more.

    An error of this relative size means that every state is, up to this part of itself, the value at a time that is
    right up to this part of itself, which is all that can be known near a zero; and, except for brief moments, that it
    is right at its own time up to this part of its largest value.
    """
    system, result, least = trajectory.model.system, trajectory.result, state_floors(trajectory)
    found: dict[str, Array] = {}
    for profile in system.profiles:
        floor = max((float(least[system.state_columns[state]]) for state in profile.states), default=0.0)
        found[profile.name] = np.full((len(result.times), 1), floor)
    if own := {name: column for name, column in system.output_columns.items() if name in named}:
        found |= zip(own, _named_sizes(trajectory, [*own.values()]).T, strict=True)
    if len(own) < len(named):
        found |= {name: np.full(len(result.times), size) for name, size in _exchanged_sizes(trajectory).items()}
    end, speed, size = trajectory.run.times[-1], np.abs(trajectory.rates), np.maximum(np.abs(result.outputs), least)
    most = np.where(size < BRIEF_PART * end * speed, np.inf, size.max(axis=0, initial=0.0))
    whole = np.fmin(size + result.times[:, None] * speed, most)
    if trajectory.status == "finished":
        whole[-1:] = size[-1:]
    return found | dict(zip(system.state_columns, whole.T, strict=True))


def floors(trajectory: Trajectory) -> dict[str, float]:
    """Return the sizes below which errors are relative to these: of states their floors, of named quantities and
    accounts their largest values.
    """
    system = trajectory.model.system
    found = dict(zip(system.state_columns, state_floors(trajectory).tolist(), strict=True))
    found |= {p.name: max((found[state] for state in p.states), default=0.0) for p in system.profiles}
    others = dict(zip(system.output_columns, trajectory.outputs.T, strict=True))
    largest = {name: float(np.max(np.abs(values), initial=0.0)) for name, values in others.items()}
    return largest | _exchanged_sizes(trajectory) | found


def _exchanged_sizes(trajectory: Trajectory) -> dict[str, float]:
    """Return the largest value of each account, at least ATOL_OF_SCALE of all that is stored or exchanged in its unit.

    A smaller account, as the energy that a spring releases at zero extension, is roundoff. Energy over temperature
    counts as entropy.
    """
    system = trajectory.model.system
    units = [each.unit for each in (*(o.quantity for o in system.outputs), *(a.quantity for a in system.ledger))]
    values = np.concatenate([trajectory.outputs, trajectory.result.ledger_outputs], axis=1)
    sizes, whole = np.abs(values).max(axis=0, initial=0.0), dict.fromkeys(units, 0.0)
    for unit, size in zip(units, sizes, strict=True):
        whole[unit] = max(whole[unit], float(size))
    if (hottest := whole.get("K", 0.0)) > 0 and ENTROPY_UNIT in whole:
        whole[ENTROPY_UNIT] = max(whole[ENTROPY_UNIT], whole.get(ENERGY_UNIT, 0.0) / hottest)
    least = [ATOL_OF_SCALE * whole[unit] for unit in units]
    own = np.maximum(sizes, least)[len(system.outputs) :].tolist()
    return dict(zip((account.quantity.name for account in system.ledger), own, strict=True))


def state_floors(trajectory: Trajectory) -> Array:
    """Return the size of each state at which its absolute tolerance equals the relative one, at most its scale."""
    scales = np.array([state.scale for state in trajectory.model.system.states])
    least = np.minimum(trajectory.result.problem.atol / trajectory.run.rtol, scales)
    # A state that never exceeds the last digit of its scale is zero, however tight the absolute tolerance: the coverage
    # of a species that no reaction makes is roundoff.
    most = np.abs(trajectory.result.outputs).max(axis=0, initial=0.0)
    least = np.where(most < EPS * scales, np.maximum(least, EPS * scales), least)
    small = (most > 0) & (most < least)
    if small.any():  # so is a velocity that the last digit of a load drives
        ends = {0, len(trajectory.result.times) // 2, len(trajectory.result.times) - 1}
        driven = _driven(trajectory.picked(np.array(sorted(ends))))
        least = np.where(small & (most <= RUN_ERROR * EPS * driven), np.maximum(least, driven), least)
    return np.asarray(least)


def _driven(trajectory: Trajectory) -> Array:
    """Return the largest size of each state if all others drive it over a time step of any length within the run, shape
    (states,).

    The step is an implicit one. For a mass on a spring the size of the velocity is the gap times the frequency.
    """
    program, result = trajectory.model.program, trajectory.result
    segment = result.segments_at(result.times, result.segment)
    inputs = trajectory.model.inputs(result, result.times, result.outputs, trajectory.rates, segment)
    by_state, by_rate = program.derivatives(program.filled(inputs))
    others, found = np.abs(result.outputs), np.zeros(program.n)
    for length in trajectory.run.times[-1] * DRIVING_TIMES:
        with suppress(np.linalg.LinAlgError):
            # The propagator of an implicit Euler step of this length.
            kept = np.linalg.solve(by_rate + length * by_state, by_rate)
            coupled = np.abs(kept) * (1 - np.eye(program.n))
            found = np.fmax(found, np.einsum("tij,tj->ti", coupled, others).max(axis=0, initial=0.0))
    return found


def difference(found: Mapping[str, Array], expected: Mapping[str, Array]) -> str:
    """Describe the difference of the events of two runs; empty if they have the same. Kinks do not count.

    >>> difference({"slip": [0.1]}, {"slip": [0.1, 0.2], "stop": [0.3]})
    'other events: 2 slip instead of 1, 1 stop instead of 0'
    """
    names = [name for name in {**expected, **found} if not name.startswith(KINK)]
    counts = {name: (len(expected.get(name, ())), len(found.get(name, ()))) for name in names}
    parts = [f"{theirs} {name} instead of {ours}" for name, (theirs, ours) in counts.items() if theirs != ours]
    return f"other events: {', '.join(parts)}" if parts else ""


def event_errors(found: Mapping[str, Array], expected: Mapping[str, Array], end: float) -> dict[str, float]:
    """Return the largest error of the times of shared events, each relative to its own time, or to ERROR_FLOOR of the
    run if that is more; empty if no time is compared.
    """
    errors = [np.abs(ours - true) / np.maximum(true, ERROR_FLOOR * end) for ours, true in shared_times(found, expected)]
    return {EVENTS: float(max(error.max() for error in errors))} if errors else {}


def shared_times(found: Mapping[str, Array], expected: Mapping[str, Array]) -> list[tuple[Array, Array]]:
    """Return the times of the events that two runs share, a pair of arrays for each name: all in order, or only those
    that are nearest to each other if one run has more of them.

    >>> shared_times({"slip": np.array([0.1, 0.2])}, {"slip": np.array([0.19]), "stop": np.array([0.3])})
    [(array([0.2]), array([0.19]))]
    """
    pairs = []
    for name in sorted(expected.keys() & found.keys()):
        ours, theirs = found[name], expected[name]
        if len(ours) != len(theirs):
            if name.startswith(KINK):
                continue
            nearest, back = (np.searchsorted((x[1:] + x[:-1]) / 2, y) for x, y in ((theirs, ours), (ours, theirs)))
            mutual = back[nearest] == np.arange(len(ours))
            ours, theirs = ours[mutual], theirs[nearest[mutual]]
        pairs.append((ours, theirs))
    return pairs


def _pairs(found: Mapping[str, Array], expected: Mapping[str, Array]) -> list[tuple[float, float]]:
    return [pair for both in shared_times(found, expected) for pair in zip(*both, strict=True)]


def asked_accuracy(run: Run) -> float:
    """Return the relative accuracy that a run asks for."""
    return run.accuracy if run.accuracy is not None else run.rtol / RTOL_PART


def verified(first: Trajectory) -> tuple[Trajectory, Accuracy]:
    """Return the first of a sequence of runs, each tighter by a hundred, that agrees with the next as accurately as
    asked.

    The tolerance of the first is a hundredth of the accuracy. Most runs are confirmed by the second, so the cost is
    that of two runs, the second at a hundredth of the tolerance.
    """
    wanted = asked_accuracy(first.run)
    if first.result.status in SPENT:
        return first, against_tighter(first)
    while True:
        last = first.run.rtol <= MIN_RTOL  # a tighter run would not be more accurate
        second = _second(first, known=True)
        found = replace(compared(first, second), asked=wanted)
        if second.status == "failed" or found.error <= wanted:
            return first, found
        if last:
            missed = f"{wanted:.0e} is not reached at the tightest tolerance"
            if (lost := rounding_of_time(first)) > wanted / 10:
                missed = f"{wanted:.0e} is out of reach, as rounding of the time alone changes a state by {lost:.0e}"
            return first, replace(found, source=f"{found.source}; {missed}")
        first = second.at_times(first.run.times)


def compared(first: Trajectory, second: Trajectory) -> Accuracy:
    """Return the largest differences of two runs: of states, and of event times including an end set by physics."""
    if second.status == "failed":
        return unknown(f"a second run at rtol {second.run.rtol:.0e} failed: {second.reason}")
    source = second_run(second.run)
    if first.status != second.status:
        return Accuracy(math.inf, f"{source}, which {second.status}: {second.reason}")
    seen = first.stored
    errors, others = state_differences(seen, second)
    if others and first.run.rtol > MIN_RTOL:  # at MIN_RTOL roundoff decides on events without effect
        return Accuracy(math.inf, f"{source}, which had {others}")
    if not errors:
        return unknown(ENDED_AT_START)
    return Accuracy(stated(errors), source, errors, named=partial(of_named, seen, second))


def rounding_of_time(trajectory: Trajectory) -> float:
    """Return the largest relative change of a state by the last bit of time: no run is more accurate than that.

    It is large where a state runs towards a singular end.
    """
    seen = trajectory.stored
    known = sizes(seen)
    size = np.transpose([known[name] for name in seen.model.system.state_columns])
    change = EPS * np.abs(seen.rates) * seen.result.times[:, None]
    return float(np.max(np.divide(change, size, out=np.zeros_like(change), where=size > 0), initial=0.0))


def reasons(problem: Problem, run: Run, moves: bool) -> list[tuple[str, str, str]]:
    """Return rows of the settings chosen for a run with their reasons; ``moves`` is True if a balance moves its gap."""
    part = f"a hundredth of the accuracy {asked_accuracy(run):.0e}, as errors of smooth runs are below 100 rtol"
    if run.rtol == MIN_RTOL:
        part = f"for the accuracy {asked_accuracy(run):.0e}; below this is rounding"
    again = "a second run must agree to the accuracy, else it is verified in turn"
    return [
        ("solver", *method(problem, moves)),
        ("rtol", f"{run.rtol:.0e}", part),
        ("verified", f"{second_tolerance(run.rtol):.0e}", again),
    ]
