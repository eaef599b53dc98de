"""Errors and run times of one case: every solver at every tolerance.

A first round warms up and gives errors and counts. The rounds that follow are timed and interleaved, so that a busy
moment of the machine does not hit one solver alone; brief runs are repeated within a round. Compilation is apart.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from surfacechem.results.achieved import computed
from surfacechem.results.audit import audit
from surfacechem.results.event_table import event_times
from surfacechem.solve.contract import Counters
from surfacechem.solve.run import Trajectory
from surfacechem.studies.precision.errors import Errors
from surfacechem.studies.precision.subject import Subject
from surfacechem.studies.precision.truth import Truth

BRIEF, LEAST_REPEATS, MOST_REPEATS = 0.05, 3, 20
"""Runs briefer than this [s] are repeated within a round up to this time, at least and at most so often."""

BUDGET = 10.0
"""A solver at one tolerance is not timed again once it has taken this long [s]."""


@dataclass(frozen=True)
class Point:
    """One solver at one tolerance. Errors, balances and counts are None where it failed or was left out."""

    solver: str
    rtol: float
    status: str
    """'finished', 'stopped' by physics as the reference, 'failed', or 'omitted'."""
    reason: str
    errors: Errors | None = None
    energy: float = np.nan
    counters: Counters | None = None
    seconds: list[float] = field(default_factory=list)
    """Run times; of a failed solve, the time that it took to fail."""
    stepping: list[float] = field(default_factory=list)
    """Parts of the run times inside a library's own steps; NaN for a method that does everything itself."""


def measure(
    subject: Subject, truth: Truth | None, solvers: Sequence[str], tolerances: Sequence[float], repeat: int
) -> list[Point]:
    """All points of a case, solver by solver."""
    points = [_first(subject, truth, name, rtol) for name in solvers for rtol in tolerances]
    for _ in range(repeat):
        for point in points:
            if point.status in ("finished", "stopped") and sum(point.seconds) < BUDGET:
                _again(subject, point)
    return [_without_first(point) for point in points]


def _first(subject: Subject, truth: Truth | None, name: str, rtol: float) -> Point:
    unable = subject.unable(name)
    if unable:
        return Point(name, rtol, "omitted", unable)
    trajectory = subject.solve(name, rtol)
    if isinstance(trajectory, str):
        return Point(name, rtol, "failed", trajectory)
    counters, cost = trajectory.result.counters, ([trajectory.seconds], [trajectory.result.stepping])
    objection = _objection(trajectory, truth)
    if objection:
        return Point(name, rtol, "failed", objection, None, np.nan, counters, *cost)
    errors = truth.errors(computed(trajectory), event_times(trajectory)) if truth else None
    if errors is not None and not errors.finite:
        return Point(name, rtol, "failed", "values are not finite", None, np.nan, counters, *cost)
    energy = audit(trajectory).energy_error
    return Point(name, rtol, trajectory.status, trajectory.reason, errors, energy, counters, *cost)


def _objection(trajectory: Trajectory, truth: Truth | None) -> str:
    if truth is not None:
        return truth.objection(trajectory)
    return trajectory.reason if trajectory.status == "failed" else ""


def _again(subject: Subject, point: Point) -> None:
    """A round of a point; one that ends otherwise, where the machine is too busy for its time limit, does not count."""
    spent: list[float] = []
    while not _enough(point, spent):
        trajectory = subject.solve(point.solver, point.rtol)
        if isinstance(trajectory, str) or trajectory.status != point.status:
            return
        spent.append(trajectory.seconds)
        point.seconds.append(trajectory.seconds)
        point.stepping.append(trajectory.result.stepping)


def _enough(point: Point, spent: list[float]) -> bool:
    if min(point.seconds) > BRIEF:
        return len(spent) > 0
    return len(spent) >= MOST_REPEATS or (len(spent) >= LEAST_REPEATS and sum(spent) > BRIEF)


def _without_first(point: Point) -> Point:
    """The first run warmed up, unless it was the only one."""
    if len(point.seconds) > 1:
        del point.seconds[0], point.stepping[0]
    return point
