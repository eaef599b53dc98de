"""What runs are held against: the exact solution, else two different methods that agree; its uncertainty is stated.

A method is run at two tight tolerances a decade apart and extrapolated in the tolerance, to which its error is taken to
be proportional. Of several methods the two that agree best are believed, and how far they differ is the uncertainty, or
how far the extrapolation went if that is more. The uncertainty of an exact solution is that of its evaluation: how far
it moves when the times move by their last bit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from surfacechem.errors import InputError
from surfacechem.results.accuracy import TIGHTEST
from surfacechem.results.achieved import computed, difference, event_error, floor
from surfacechem.results.event_table import event_times
from surfacechem.solve.run import Trajectory
from surfacechem.studies.precision.errors import KINDS, Errors, compare, larger
from surfacechem.studies.precision.subject import Subject

Array = NDArray[np.float64]

METHODS = ("radau", "scipy-radau", "lsoda", "cantera")
"""Methods that a reference may be made of; the last only where it is needed."""

DECADE = 10.0
"""Ratio of the two tolerances from which a method is extrapolated."""

LONGEST = 900.0
"""A run for a reference may take so long [s]: which methods it is made of must not depend on how busy a machine is."""

AGREE = 1e-6
"""Methods that differ by more than this do not agree."""

EPSILON = float(np.finfo(float).eps)


@dataclass(frozen=True)
class Truth:
    """True values of the variables at the output times, true times of the events, and how uncertain both are."""

    source: str
    status: str
    times: Array
    values: Mapping[str, Array]
    floors: Mapping[str, float]
    events: Mapping[str, Array]
    end: float
    """End of the run as it was asked for [s]."""
    uncertainty: Errors

    def errors(self, values: Mapping[str, Array], events: Mapping[str, Array]) -> Errors:
        """Errors of values and of times of events."""
        found = compare(self.times, values, self.values, self.floors)
        return replace(found, event=event_error(events, self.events, self.end)) if self.events else found

    def objection(self, trajectory: Trajectory) -> str:
        """Why a run has no errors: it failed, or came to another end; empty where it has."""
        if trajectory.status == "failed":
            return trajectory.reason
        if trajectory.status != self.status:
            return f"ended otherwise than the reference: {trajectory.reason}"
        if abs(len(trajectory.result.times) - len(self.times)) > 1:  # an output may lie between the two ends
            return f"ended elsewhere than the reference: {trajectory.reason}"
        return difference(event_times(trajectory), self.events)


def establish(subject: Subject, variables: Sequence[str]) -> Truth:
    """The truth of a case; InputError where there is none to be had."""
    if subject.exact is None:
        return numerical(subject, variables)
    name, options = subject.exact
    trajectory = _tight(subject, _able(subject)[0], TIGHTEST)
    try:
        exact = _exact(subject, trajectory, name, options)
    except InputError as error:
        found = numerical(subject, variables)
        unused = f"the exact solution {name} is not of this scene: {error.message}"
        return replace(found, source=f"{found.source}; {unused}")
    known = {variable: exact[variable] for variable in variables if variable in exact}
    if len(known) == len(variables) and not event_times(trajectory):
        return _with_exact(_alone(trajectory, variables), name, known, trajectory)
    return _with_exact(numerical(subject, variables), name, known, trajectory)


def _able(subject: Subject) -> list[str]:
    """Methods for a reference; that of Cantera only where no other can run the case."""
    able = [name for name in METHODS if not subject.unable(name)]
    return able if able == ["cantera"] else [name for name in able if name != "cantera"]


def _tight(subject: Subject, method: str, rtol: float) -> Trajectory:
    trajectory = subject.solve(method, rtol, LONGEST)
    if isinstance(trajectory, str) or trajectory.status == "failed" or len(trajectory.result.times) < 2:
        why = trajectory if isinstance(trajectory, str) else trajectory.reason
        raise InputError(f"{subject.name} has no reference: {method} at rtol {rtol:.0e}: {why}")
    return trajectory


# -- exact solutions ---------------------------------------------------------------------------------------------------


def _exact(
    subject: Subject, trajectory: Trajectory, name: str, options: Mapping[str, float]
) -> dict[str, tuple[Array, Array]]:
    """Exact values, and those at times that differ in the last bit."""
    from surfacechem.results.matching import exact_values

    result = trajectory.result
    nudged = replace(trajectory, result=replace(result, times=result.times * (1 - EPSILON)))
    values, moved = (exact_values(name, options, subject.scene, run) for run in (trajectory, nudged))
    return {variable: (values[variable], moved[variable]) for variable in values}


def _alone(trajectory: Trajectory, variables: Sequence[str]) -> Truth:
    """What an exact solution needs beside its values, from a run."""
    nothing = Errors({kind: {} for kind in KINDS})
    floors = {name: floor(trajectory, name) for name in variables}
    result = trajectory.result
    return Truth("", trajectory.status, result.times, {}, floors, {}, trajectory.run.times[-1], nothing)


def _with_exact(truth: Truth, name: str, known: Mapping[str, tuple[Array, Array]], trajectory: Trajectory) -> Truth:
    """The truth with what is known exactly in the place of computed values."""
    times = trajectory.result.times
    exact = {variable: values for variable, (values, _) in known.items()}
    moved = {variable: values for variable, (_, values) in known.items()}
    noise = compare(times, moved, exact, truth.floors).by_kind
    old = truth.uncertainty.by_kind
    combined = {k: {**old[k], **{variable: e + EPSILON for variable, e in noise[k].items()}} for k in KINDS}
    rest = [variable for variable in truth.values if variable not in exact]
    beside = [*rest, *(["events"] if truth.events else [])]
    source = f"exact solution {name}" + (f"; {', '.join(beside)}: {truth.source}" if beside else "")
    values = {**truth.values, **exact}
    return replace(
        truth, source=source, times=times, values=values, uncertainty=Errors(combined, truth.uncertainty.event)
    )


# -- references that are computed -------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Extrapolated:
    """Values and times of events of one method, and how far the extrapolation went."""

    method: str
    truth: Truth

    def against(self, other: _Extrapolated) -> Errors:
        return self.truth.errors(other.truth.values, other.truth.events)


def numerical(subject: Subject, variables: Sequence[str]) -> Truth:
    """The truth from the two methods that agree best; InputError where no two agree."""
    found, failures = [], []
    for method in _able(subject):
        try:
            found.append(_extrapolated(subject, method, variables))
        except InputError as error:
            failures.append(error.message)
    if not found:
        raise InputError("; ".join(failures))
    pairs = [(a, b, a.against(b)) for a, b in combinations(found, 2) if _alike(a, b)]
    if not pairs:
        if len(found) > 1:
            raise InputError(f"{subject.name} has no reference: its methods come to different ends or events.")
        return _of_one(found[0])
    first, second, apart = min(pairs, key=lambda pair: _size(pair[2]))
    if not _size(apart) <= AGREE:
        names = f"{first.method} and {second.method}"
        raise InputError(
            f"{subject.name} has no reference: the methods that agree best, {names}, differ by {_size(apart):.1e}."
        )
    source = f"{first.method} and {second.method}, extrapolated from rtol {TIGHTEST * DECADE:.0e} and {TIGHTEST:.0e}"
    return replace(first.truth, source=source, uncertainty=larger(apart, first.truth.uncertainty))


def _of_one(only: _Extrapolated) -> Truth:
    return replace(only.truth, source=f"{only.method} alone, which no second method confirms")


def _alike(one: _Extrapolated, other: _Extrapolated) -> bool:
    a, b = one.truth, other.truth
    return a.status == b.status and not difference(a.events, b.events) and len(a.times) == len(b.times)


def _size(errors: Errors) -> float:
    return float(np.fmax(errors.worst("max"), errors.event))


def _extrapolated(subject: Subject, method: str, variables: Sequence[str]) -> _Extrapolated:
    loose, tight = (_tight(subject, method, rtol) for rtol in (TIGHTEST * DECADE, TIGHTEST))
    n = min(len(loose.result.times), len(tight.result.times))
    before, after = ({name: computed(run)[name][:n] for name in variables} for run in (loose, tight))
    events, last = event_times(loose), event_times(tight)
    if loose.status != tight.status or difference(events, last):
        raise InputError(f"{subject.name} has no reference: {method} comes to other ends or events when it is tighter.")
    truth = Truth(
        source=method,
        status=tight.status,
        times=tight.result.times[:n],
        values={name: _limit(before[name], after[name]) for name in variables},
        floors={name: floor(tight, name) for name in variables},
        events={name: _limit(events[name], times) for name, times in last.items()},
        end=tight.run.times[-1],
        uncertainty=Errors({}),
    )
    return _Extrapolated(method, replace(truth, uncertainty=truth.errors(after, last)))


def _limit(loose: Array, tight: Array) -> Array:
    """Richardson extrapolation of errors in proportion to the tolerance."""
    return np.asarray(tight + (tight - loose) / (DECADE - 1))
