"""The stability matrix: every regime at every value of its parameter with every solver, and what came of it."""

from __future__ import annotations

import logging
import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from surfacechem import format as cases
from surfacechem.errors import InputError
from surfacechem.format import Case
from surfacechem.results.accuracy import relative_error
from surfacechem.results.achieved import computed
from surfacechem.solve.run import OWN, Model, Run, Trajectory
from surfacechem.studies.stability.condition import condition, least
from surfacechem.studies.stability.regime import Exact, Problem, Refused, Regime, Stops

log = logging.getLogger(__name__)

SOLVED, REFUSED, FAILED, WRONG, SENSITIVE = "solved", "refused", "failed", "wrong", "sensitive"
OUTCOMES = (SOLVED, REFUSED, FAILED, WRONG, SENSITIVE)
"""Right to some digits; ended or refused for the right reason; a failure that says so; a wrong answer; an answer to a
problem whose condition leaves no digits at the tolerance.
"""

RTOL, STEPS = 1e-10, 1500
"""Tolerance of every solver, and the steps after which a run has failed."""

LEAST = 2.0
"""Digits below which a value that is given out as an answer is wrong."""

MOST = 16.0
"""Digits that a double holds."""

SOLVERS = (OWN, "lsoda", "bdf", "scipy-radau", "cvode", "ida")


@dataclass(frozen=True)
class Cell:
    """What one solver made of one problem."""

    outcome: str
    digits: float
    """-log10 of the largest relative error, of values or of the time of the end; none where the input is refused."""
    steps: int
    residuals: int
    seconds: float
    reason: str
    condition: float = math.nan
    """Condition number of the problem: relative change of its answer over that of its data; none where not known."""

    @property
    def possible(self) -> float:
        """Digits that rounding of the data leaves to any solver."""
        return digits_left(self.condition, np.finfo(float).eps)

    @property
    def kept(self) -> float:
        """Digits of an answer; none for a failure."""
        return self.digits if self.outcome in (SOLVED, REFUSED) else 0.0


@dataclass(frozen=True)
class Row:
    """Cells of a regime by value and solver."""

    regime: Regime
    values: Sequence[float]
    cells: Sequence[Sequence[Cell]]


@dataclass(frozen=True)
class Matrix:
    """All rows, with the solvers in the order of their cells."""

    rows: Sequence[Row]
    solvers: Sequence[str]
    rtol: float


def few(values: Sequence[float]) -> list[float]:
    """First, middle and last of the values, and the one before the last."""
    return [values[i] for i in sorted({0, len(values) // 2, len(values) - 2, len(values) - 1})]


def matrix(
    regimes: Sequence[Regime],
    solvers: Sequence[str] = SOLVERS,
    rtol: float = RTOL,
    pick: Callable[[Sequence[float]], Sequence[float]] = list,
) -> Matrix:
    """Solve everything; ``pick`` may leave values out."""
    rows = []
    for number, regime in enumerate(regimes, 1):
        values = list(pick(regime.values))
        log.info("%s: %d values, regime %d of %d", regime.name, len(values), number, len(regimes))
        rows.append(Row(regime, values, [attempt(regime.problem(value), solvers, rtol) for value in values]))
    return Matrix(rows, list(solvers), rtol)


def attempt(problem: Problem, solvers: Sequence[str] = SOLVERS, rtol: float = RTOL) -> list[Cell]:
    """A problem with every solver; it is read and compiled once."""
    try:
        model = Model(read(problem).system())
    except InputError as error:
        return [_refusal(problem, error)] * len(solvers)
    known = condition(problem, [state.name for state in model.system.states])
    return [replace(solve(problem, model, solver, rtol, known), condition=known) for solver in solvers]


def digits_left(condition: float, change: float) -> float:
    """Digits of an answer that a relative change of the data leaves.

    >>> round(digits_left(1e6, 1e-10), 9), digits_left(1.0, 1e-20), digits_left(1e20, 1e-10)
    (4.0, 16.0, 0.0)
    """
    return digits_of(condition * change) if math.isfinite(condition) else math.nan


def read(problem: Problem) -> Case:
    """The case of a problem with its changes."""
    changes = {**problem.changes, "run": {"times": list(problem.times)}}
    shipped = "\n" not in problem.case
    case = cases.load(problem.case, changes) if shipped else cases.load_text(problem.case, "regime", overrides=changes)
    return replace(case, reference=None)  # the regime has its own expectation


def solve(problem: Problem, model: Model, solver: str, rtol: float, known: float = math.nan) -> Cell:
    """One run and what came of it, by the ``known`` condition of its problem."""
    times = (0.0, *problem.times) if problem.times[0] else tuple(problem.times)
    run = Run(times=times, rtol=rtol, solver=solver, max_steps=STEPS)
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")  # libraries warn of what the status says
            trajectory = model.solve(run)
            outcome, digits, reason = _judged(problem, trajectory)
        if outcome in (SOLVED, REFUSED) and digits < LEAST:
            outcome = SENSITIVE if digits_left(known, rtol) < LEAST else WRONG
    except InputError as error:
        return _refusal(problem, error)
    counters = trajectory.result.counters
    return Cell(outcome, digits, counters.steps, counters.residuals, trajectory.seconds, reason)


def _refusal(problem: Problem, error: InputError) -> Cell:
    expected = problem.expected
    right = isinstance(expected, Refused) and expected.reason in error.message
    return Cell(REFUSED if right else FAILED, MOST if right else 0.0, 0, 0, 0.0, error.message)


def _judged(problem: Problem, trajectory: Trajectory) -> tuple[str, float, str]:
    """Outcome, digits and reason of a run that was begun."""
    expected, status, reason = problem.expected, trajectory.status, trajectory.reason
    if status == "failed":
        return FAILED, 0.0, reason
    if isinstance(expected, Stops):
        if status != "stopped" or expected.reason not in reason:
            return WRONG, 0.0, reason
        return REFUSED, digits_of(abs(trajectory.result.t - expected.t) / (expected.t or 1.0)), reason
    if status == "stopped" or isinstance(expected, Refused):
        return (FAILED if status == "stopped" else WRONG), 0.0, reason
    if expected.events is not None and len(trajectory.jumps) != expected.events:
        return WRONG, 0.0, f"{len(trajectory.jumps)} events, not {expected.events}"
    error, where = largest_error(expected, trajectory)
    return SOLVED, digits_of(error), where


def digits_of(error: float) -> float:
    """Digits that an error leaves.

    >>> digits_of(1e-8), digits_of(0.0), digits_of(math.nan), digits_of(10.0)
    (8.0, 16.0, 0.0, 0.0)
    """
    if math.isnan(error):
        return 0.0
    return min(max(-math.log10(error), 0.0), MOST) if error > 0 else MOST


def largest_error(expected: Exact, trajectory: Trajectory) -> tuple[float, str]:
    """The largest relative error of the expected values, and where it is."""
    ours = computed(trajectory)
    exact = expected.values(trajectory.result.times)
    known = {*expected.also, *(state.name for state in trajectory.model.system.states)}
    errors = {
        name: relative_error(ours[name], np.asarray(exact[name]), least(exact[name])) for name in exact if name in known
    }
    worst = max(errors, key=lambda name: math.inf if math.isnan(errors[name]) else errors[name])
    return errors[worst], f"in {worst}"
