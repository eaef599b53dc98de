"""Reference of a study: the exact solution, else two different methods that agree; with its uncertainty.

A method is run at two tight tolerances a decade apart and extrapolated in the tolerance, assuming an error proportional
to it. Of several methods the two that agree best are used. The uncertainty is their difference, or the size of the
extrapolation if that is more. The uncertainty of an exact solution is that of its evaluation: its change when the times
change by their last bit.

Runs are compared at the known states of a tight run, and errors are relative to the same sizes as those of any run.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations

import numpy as np

from surfacechem.errors import InputError
from surfacechem.format import Case
from surfacechem.references.base import SceneView
from surfacechem.results.accuracy import errors_over_time
from surfacechem.results.error_estimates import clear_of, computed, difference, event_errors, fewer, floors, sizes
from surfacechem.results.event_table import event_times
from surfacechem.results.matching import exact_values, match
from surfacechem.solve import CALLING_PYTHON, solver
from surfacechem.solve.contract import Array
from surfacechem.solve.run import Model, Trajectory
from surfacechem.studies.grid import LIBRARY_ERRORS
from surfacechem.tolerances import EPS, MIN_RTOL, SQRT_EPS

Values = Mapping[str, Array]

# Methods for a reference, the quicker first; the last only if no other can run the case. They are of different
# families, two implementations of collocation and multistep methods, so that they share no bug.
REFERENCE_METHODS = ("radau", "lsoda", "scipy-radau", "cantera")

# Ratio of the two tolerances from which a method is extrapolated. With closer ones the difference would be little more
# than rounding, with others errors would no longer be proportional to the tolerance.
TEN = 10.0

# A solve that takes longer than this counts as failed, unless the case allows less; limit for a reference [s], long
# enough that the choice of its methods does not depend on the load of the machine.
MOST_SECONDS, LONGEST_SOLVE = 60.0, 900.0

# Relative tolerances of a study, if none are given.
TOLERANCES = tuple(10.0**-k for k in (4, 6, 8, 10, 12))

# Methods that differ by more do not agree: a reference must resolve at least the errors of the loosest tolerance.
AGREEMENT = TOLERANCES[0] / 100

# Two methods that differ by no more than this need no third.
REFERENCE_ERROR = TEN * TOLERANCES[-1]

NORMS = ("final", "max", "l2")
# The kinds of errors; the last one does not belong to a variable.
MEANING = {
    "final": "relative error at the end",
    "max": "largest relative error",
    "l2": "root mean square in time of the relative error",
    "event": "largest relative error of the times of events",
}


@dataclass(frozen=True)
class Errors:
    """Errors by kind and variable; errors of event times belong to no variable, and there may be none."""

    by_kind: Mapping[str, Mapping[str, float]] = field(default_factory=lambda: {kind: {} for kind in MEANING})

    def worst(self, *kinds: str) -> float:
        """Return the largest error over the variables; NaN if there is none."""
        return float(np.max([error for kind in kinds for error in self.by_kind[kind].values()] or [math.nan]))

    def larger(self, other: Errors) -> Errors:
        """Return the larger of two errors for each kind and variable."""
        found = {}
        for kind, errors in self.by_kind.items():
            names = dict.fromkeys((*errors, *other.by_kind[kind]))
            found[kind] = {name: max(errors.get(name, 0.0), other.by_kind[kind].get(name, 0.0)) for name in names}
        return Errors(found)


def mean_square(times: Array, error: Array) -> float:
    """Return the root mean square in time, by the trapezoidal rule.

    >>> mean_square(np.array([0.0, 1.0, 3.0]), np.array([0.2, 0.2, 0.2]))
    0.2
    """
    if len(times) < 2:
        return float(np.max(error, initial=0.0))
    return float(np.sqrt(np.trapezoid(error**2, times) / (times[-1] - times[0])))


@dataclass(frozen=True)
class Subject:
    """A case that can be run with any solver at any tolerance."""

    case: Case
    model: Model

    @property
    def states(self) -> list[str]:
        """Names of the states."""
        system = self.model.system
        return [state.name for state in system.states if state.name not in system.interior]

    @property
    def names(self) -> list[str]:
        """Names of all quantities that can be compared."""
        return [*self.states, *(item.name for item in self.model.system.outputs)]

    def solve(self, name: str, rtol: float, limit: float = MOST_SECONDS) -> Trajectory:
        """Run with another solver and tolerance, the absolute tolerance in proportion."""
        run = self.case.run
        atol = None if run.atol is None else run.atol * rtol / run.rtol
        seconds = run.max_seconds or limit
        return self.model.solve(replace(run, solver=name, rtol=rtol, atol=atol, max_seconds=seconds))

    def unable(self, name: str) -> str:
        """Return the reason why a solver cannot run this case; empty if it can."""
        if self.model.program.external is not None and name not in CALLING_PYTHON:
            return "rates of the mechanism come from Cantera itself, which this solver cannot ask"
        try:
            solver(name)
        except ImportError as error:
            return f"its library cannot be imported: {error}"
        return ""

    def methods(self) -> list[str]:
        """Return the methods for a reference; Cantera's only if no other can run the case."""
        able = [name for name in REFERENCE_METHODS if not self.unable(name)]
        return [name for name in able if name != "cantera"] or able

    def tight(self, method: str, rtol: float) -> Trajectory:
        """Run for a reference; InputError if it fails."""
        try:
            found = self.solve(method, rtol, LONGEST_SOLVE)
            why = found.reason if found.status == "failed" or len(found.result.times) < 2 else ""
        except LIBRARY_ERRORS as error:
            why = f"{type(error).__name__}: {error}"
        if why:
            raise InputError(f"{self.case.name} has no reference: {method} at rtol {rtol:.0e}: {why}")
        return found


@dataclass(frozen=True)
class Truth:
    """True values of the variables at the output times, true event times, and the uncertainty of both."""

    source: str
    status: str
    times: Array
    values: Values
    floors: Mapping[str, float | Array]
    events: Values
    end: float
    """Requested end of the run [s]."""
    uncertainty: Errors = field(default_factory=Errors)

    @classmethod
    def of(cls, run: Trajectory, source: str, variables: Sequence[str]) -> Truth:
        """Return the truth with times and floors of a run, without values and events."""
        known: dict[str, float | Array] = {**floors(run), **sizes(run)}
        found = {name: size for name, size in known.items() if name in variables}
        return cls(source, run.status, run.result.times, {}, found, {}, run.run.times[-1])

    def errors(self, values: Values, events: Values) -> Errors:
        """Return the errors of values and of event times, over the output times that both have reached."""
        # Between the times of the same event in the two runs only its time has an error.
        both = [(events.get(name, ()), times) for name, times in self.events.items()]
        pairs = [pair for found, times in both if len(found) == len(times) for pair in zip(found, times, strict=True)]
        alike = clear_of(self.times, pairs)
        found = {
            name: np.where(alike[: len(error)], error, 0.0)
            for name, error in errors_over_time(values, self.values, self.floors).items()
        }
        return Errors(
            {
                "final": {name: float(error[-1]) for name, error in found.items()},
                "max": {name: float(error.max()) for name, error in found.items()},
                "l2": {name: mean_square(self.times[: len(error)], error) for name, error in found.items()},
                "event": dict(zip([""], event_errors(events, self.events, self.end).values(), strict=False)),
            }
        )

    def objection(self, trajectory: Trajectory) -> str:
        """Return the reason why a run has no errors: it failed, or ended otherwise; empty if it has."""
        if trajectory.status == "failed":
            return trajectory.reason
        if trajectory.status != self.status:
            return f"ended otherwise than the reference: {trajectory.reason}"
        if abs(len(trajectory.result.times) - len(self.times)) > 1:  # an output may lie between the two ends
            return f"ended elsewhere than the reference: {trajectory.reason}"
        return difference(event_times(trajectory), self.events)


def with_stored_times(subject: Subject) -> Subject:
    """Return the subject with outputs at the known states of a tight run; unchanged if that run fails."""
    try:
        found = subject.tight(subject.methods()[0], MIN_RTOL)
    except InputError:
        return subject
    run, times = subject.case.run, fewer(found.stored).result.times
    # Towards an event states may change like a square root, so that next to it errors are those of rounding in time.
    moments = np.concatenate([[0.0], *event_times(found).values()])
    times = times[np.all(np.abs(times[:, None] - moments) > SQRT_EPS * moments, axis=1)]
    times = np.union1d(times, [0.0, run.times[-1]])
    return replace(subject, case=replace(subject.case, own_run=replace(run, times=tuple(times.tolist()), picture=None)))


def establish(subject: Subject, variables: Sequence[str]) -> Truth:
    """Return the truth of a case; InputError if none can be found."""
    reference = subject.case.reference
    if reference is None:
        return numerical(subject, variables)
    trajectory, scene = subject.tight(subject.methods()[0], MIN_RTOL), subject.case.scene
    result = trajectory.result
    # A second evaluation at times one rounding earlier gives the effect of rounding on the exact values.
    perturbed = replace(trajectory, result=replace(result, times=result.times * (1 - EPS)))
    try:
        named = reference.name, reference.options
        exact, moved = (
            exact_values(match(*named, SceneView(scene, run)), scene, run) for run in (trajectory, perturbed)
        )
    except InputError as error:
        found = numerical(subject, variables)
        unused = f"the exact solution {reference.name} does not apply to this scene: {error.message}"
        return replace(found, source=f"{found.source}; {unused}")
    # Variables and event times that the exact solution does not give are those of two methods.
    known = {name: exact[name] for name in variables if name in exact}
    whole, others = Truth.of(trajectory, "", variables), [name for name in variables if name not in known]
    beside = numerical(subject, others) if others or event_times(trajectory) else whole
    beside = replace(beside, floors=whole.floors)
    noise = replace(beside, times=result.times, values=known, events={}).errors(moved, {}).by_kind
    uncertain = {
        kind: {**errors, **{name: error + EPS for name, error in noise[kind].items()}}
        for kind, errors in beside.uncertainty.by_kind.items()
    }
    others += ["events"] if beside.events else []
    source = f"exact solution {reference.name}" + (f"; {', '.join(others)}: {beside.source}" if others else "")
    values = {**beside.values, **known}
    return replace(beside, source=source, times=result.times, values=values, uncertainty=Errors(uncertain))


def numerical(subject: Subject, variables: Sequence[str]) -> Truth:
    """Return the truth from the two methods that agree best; InputError if no two agree."""
    name = subject.case.name
    found: list[Truth] = []
    failures = []
    for method in subject.methods():
        if len(found) == 2 and _apart(*found) <= REFERENCE_ERROR:
            break
        try:
            found.append(_extrapolated(subject, method, variables))
        except InputError as error:
            failures.append(error.message)
    if not found:
        raise InputError("; ".join(failures))
    if len(found) == 1:
        return replace(found[0], source=f"{found[0].source} alone, which no second method confirms")
    first, second = min(combinations(found, 2), key=lambda pair: _apart(*pair))
    methods, largest = f"{first.source} and {second.source}", _apart(first, second)
    if math.isinf(largest):
        raise InputError(f"{name} has no reference: its methods come to different ends or events.")
    if not largest <= AGREEMENT:
        raise InputError(f"{name} has no reference: the methods that agree best, {methods}, differ by {largest:.1e}.")
    source = f"{methods}, extrapolated from rtol {MIN_RTOL * TEN:.0e} and {MIN_RTOL:.0e}"
    apart = first.errors(second.values, second.events)
    return replace(first, source=source, uncertainty=apart.larger(first.uncertainty))


def _apart(a: Truth, b: Truth) -> float:
    """Return the largest difference of two methods; infinite if their ends or events differ."""
    if a.status != b.status or difference(a.events, b.events) or len(a.times) != len(b.times):
        return math.inf
    return float(np.nan_to_num(a.errors(b.values, b.events).worst("max", "event"), nan=math.inf))


def _extrapolated(subject: Subject, method: str, variables: Sequence[str]) -> Truth:
    """Return values and event times of one method; their uncertainty is the size of the extrapolation."""
    loose, tight = (subject.tight(method, rtol) for rtol in (MIN_RTOL * TEN, MIN_RTOL))
    n = min(len(loose.result.times), len(tight.result.times))
    before, after = ({name: computed(run)[name][:n] for name in variables} for run in (loose, tight))
    events, last = event_times(loose), event_times(tight)
    if loose.status != tight.status or difference(events, last):
        name = subject.case.name
        raise InputError(f"{name} has no reference: {method} comes to other ends or events when it is tighter.")
    values = {name: _limit(before[name], after[name]) for name in variables}
    whole = Truth.of(tight, method, variables)
    limits = {name: _limit(events[name], last[name]) for name in last}
    truth = replace(whole, times=whole.times[:n], values=values, events=limits)
    return replace(truth, uncertainty=truth.errors(after, last))


def _limit(loose: Array, tight: Array) -> Array:
    """Extrapolate errors in proportion to the tolerance (Richardson)."""
    return np.asarray(tight + (tight - loose) / (TEN - 1))
