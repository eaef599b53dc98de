"""The grid of a study: every solver at every value of a problem, run once for its result and again for its time.

The first run warms up and gives errors and counts. The following rounds are timed and interleaved, so that a busy
moment of the machine does not affect one solver only; brief runs are repeated within a round. Compilation is not
included.
"""

from __future__ import annotations

import logging
import math
import warnings
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np

from surfacechem.errors import InputError, Place, expect, refuse_unknown
from surfacechem.results.accuracy import check_tolerance
from surfacechem.solve import names, solver
from surfacechem.solve.contract import Counters
from surfacechem.solve.run import Trajectory

# Choices: a busy scheduler switches every few milliseconds; among repeats over 50 ms some are undisturbed, and the
# least time counts.
# Runs briefer than this [s] are repeated within a round up to this time; least and largest number of repeats.
BRIEF_RUN, LEAST_REPEATS, MOST_REPEATS = 0.05, 3, 20

# A solver at one value is not timed again once it has taken this long [s].
ROUND_SECONDS = 1.0

# Exceptions of libraries that do not report a failure by a status.
LIBRARY_ERRORS = (ArithmeticError, RuntimeError, ValueError)


@dataclass
class Cell:
    """One solver at one problem and one value: outcome, counts and times; studies add their measures."""

    outcome: str
    reason: str
    counters: Counters = field(default_factory=Counters, kw_only=True)
    """Counts of the solver; empty without run times."""
    seconds: list[float] = field(default_factory=list, kw_only=True)
    """Run times; for a failed solve, the time until the failure."""
    stepping: list[float] = field(default_factory=list, kw_only=True)
    """Parts of the run times inside a library's own steps; NaN for a method that does everything itself."""
    again: Callable[[], Trajectory] | None = field(default=None, kw_only=True, repr=False)
    """Function that repeats the run."""
    solver: str = field(default="", kw_only=True)
    value: float = field(default=math.nan, kw_only=True)
    """Value of the parameter; with the solver, the place in the grid."""

    def count(self, name: str) -> float:
        """Return a count of the solver; NaN if its library does not report it."""
        counters = self.counters
        if not self.seconds or (name == "rejected" and not solver(self.solver).counts_rejected):
            return math.nan
        if name == "factorizations" and counters.jacobians > 0 and counters.factorizations == 0:
            return math.nan
        return float(getattr(counters, name))


C = TypeVar("C", bound=Cell)


def attempt(solve: Callable[[], Trajectory], judge: Callable[[Trajectory | Exception], C]) -> C:
    """Run, and judge the result, or the error with which a library ended."""
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")  # the status says what libraries warn about
            done = solve()
            cell = judge(done)
    except (*LIBRARY_ERRORS, InputError) as error:
        return judge(error)
    cell.counters, cell.seconds, cell.stepping = done.result.counters, [done.seconds], [done.result.stepping]
    cell.again = solve
    return cell


log = logging.getLogger(__name__)


def filled(
    solvers: Sequence[str], prepared: Mapping[float, Callable[[str], C]], rounds: int = 0
) -> dict[tuple[str, float], C]:
    """Return the cells of a problem by solver and value. Each is run once, by solver with the function prepared for the
    value, and then timed in so many rounds.
    """
    cells = {(name, value): run(name) for name in solvers for value, run in prepared.items()}
    for number in range(rounds):
        log.info("timed again", extra={"done": number, "total": rounds})
        for cell in cells.values():
            if cell.outcome in ("finished", "stopped") and sum(cell.seconds) < ROUND_SECONDS:
                _time_again(cell)
    for (name, value), cell in cells.items():
        cell.solver, cell.value = name, value
        if len(cell.seconds) > 1:  # the first run warmed up, unless it was the only one
            del cell.seconds[0], cell.stepping[0]
    return cells


def _time_again(cell: Cell) -> None:
    """Time a round of a cell. Runs with another outcome, when a busy machine exceeds the time limit, do not count."""
    spent: list[float] = []
    most = MOST_REPEATS if min(cell.seconds) <= BRIEF_RUN else 1
    while cell.again and len(spent) < most and (len(spent) < LEAST_REPEATS or sum(spent) <= BRIEF_RUN):
        done = attempt(cell.again, lambda done: Cell(done.status if isinstance(done, Trajectory) else "failed", ""))
        if done.outcome != cell.outcome:
            return
        spent += done.seconds
        cell.seconds += done.seconds
        cell.stepping += done.stepping


def check_options(
    solvers: Sequence[str], tolerances: Sequence[float], rounds: int, bounds: tuple[int, int], options: Sequence[str]
) -> None:
    """Raise InputError for an unknown solver, a tolerance out of range, rounds out of bounds, and an empty list of
    either; ``options`` names the three.
    """
    refuse_unknown(solvers, names, "no solver '{}'", Place(path=options[0]))
    expect(tolerances, Collection, "tolerances are a list", Place(path=options[1]))
    for rtol in tolerances:
        check_tolerance(rtol, options[1])
    for given, option in zip((solvers, tolerances), options, strict=False):
        if not given:
            raise InputError("at least one is needed.", Place(path=option))
    low, high = bounds
    expect(rounds, int, "rounds are a whole number", Place(path=options[2]))
    if not low <= rounds <= high:
        raise InputError(f"{rounds} is outside its range: >= {low} and <= {high}.", Place(path=options[2]))
