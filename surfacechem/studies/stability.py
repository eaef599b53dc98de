"""The stability matrix: correct digits, refusals and failures of each solver in difficult regimes.

The condition number of a problem follows from the exact answer alone: a relative change eps of the data changes the
answer by up to eps times this number, for any solver. Its decimal logarithm is the number of digits lost to the
rounding of the data; the same applies to the tolerance of a solver, whose error is that of a problem with changed data.
Source: Higham (2002), Accuracy and Stability of Numerical Algorithms, section 1.6.

>>> study = stability("seconds", solvers=["radau"], quick=True, rounds=0)
>>> bool(study.dataset["digits"].min() > 9)
True
"""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import Bounds, differential_evolution

from surfacechem import format as cases
from surfacechem.errors import InputError
from surfacechem.format import Case
from surfacechem.plots.study import OUTCOME_COLOURS, OUTCOME_MARKS
from surfacechem.results.accuracy import largest_errors, relative_errors
from surfacechem.results.error_estimates import computed
from surfacechem.solve import names as known_solvers
from surfacechem.solve.contract import Array
from surfacechem.solve.run import OWN, Model, Run, Trajectory
from surfacechem.studies.grid import Cell, attempt, check_options, filled
from surfacechem.studies.regimes import Exact, Expectation, Refused, Regime, Stops, Trial, chosen
from surfacechem.studies.report import PageSection, PageTable, Study, Variable
from surfacechem.tolerances import EPS, ERROR_FLOOR

log = logging.getLogger(__name__)

# Correct to some digits; ended or refused for the right reason; a reported failure; a wrong answer; an answer to a
# problem whose condition leaves no digits at the tolerance.
SOLVED, REFUSED, FAILED, WRONG, SENSITIVE = OUTCOMES = ("solved", "refused", "failed", "wrong", "sensitive")

# Tolerance of every solver, and the steps after which a run counts as failed. Choices: all libraries accept this
# tolerance, and need 60 to 440 steps for it in mild regimes.
STUDY_RTOL, STEPS = 1e-10, 1500

# Digits below which a returned value counts as wrong, and digits of a double.
LEAST, MOST = 2.0, 16.0

SOLVERS = (OWN, "dop853", "lsoda", "bdf", "scipy-radau", "cvode", "ida")

# Rounds of a search for a worst corner: default and maximum.
SEARCH_ROUNDS, MOST_ROUNDS = 12, 10_000

SEED = 20210301
# Differential evolution: population, weight of a difference, crossover probability. Few points, since each is a case to
# be compiled; the other two are in the ranges that Storn & Price recommend.
POPULATION, WEIGHT, CROSSOVER = 8, 0.7, 0.8

# A failure is worse than any error, a wrong answer worse than a failure.
PENALTY = {FAILED: MOST, WRONG: 2 * MOST}

Answer = Mapping[str, Array]
Data = Mapping[str, float]

# Name of the output times among the data.
TIME_NAME = "t"

# Relative steps of the data for differences, from 1e-6 to 16 roundings.
PERTURBATIONS = tuple(2.0**-k for k in (20, 24, 28, 32, 36, 40, 44, 48))

# Relative change of a slope from one step to the next, below which it is accepted: a choice, as condition numbers are
# given to one digit. A smaller one would require shorter steps, whose slopes have more rounding.
STRAIGHT_PART = 0.1

MEANING = (
    f"Digits kept are -log10 of the largest relative error; {MOST:g} is rounding. R: ended or refused by physics, for "
    "the right reason, with the digits of the time of its end. ×: failed, and said so. !: an answer that is wrong, to "
    f"less than {LEAST:g} digits. ~: so few digits, too, but the problem leaves no more at this tolerance. Its "
    "condition number is the relative change of the answer over that of the data: what rounding of the data, or a "
    "tolerance, changes by itself. Possible digits are those that rounding leaves."
)


@dataclass
class Attempt(Cell):
    """One solver at one problem: its outcome, and its correct digits."""

    digits: float
    """-log10 of the largest relative error, of values or of the end time; MOST for an expected refusal."""
    condition: float = math.nan
    """Condition number of the problem: relative change of its answer over that of its data; NaN if unknown."""

    @property
    def text(self) -> str:
        """Text of the attempt in a table.

        >>> Attempt("solved", "in T", 9.87).text, Attempt("failed", "stiff", 0.0).text
        ('9.9', '×')
        """
        mark = OUTCOME_MARKS.get(self.outcome, "")
        return mark if self.outcome == FAILED else f"{mark} {self.digits:.1f}".strip()


class MatrixRow(NamedTuple):
    """Attempts at a regime by solver and value."""

    regime: Regime
    values: Sequence[float]
    cells: Mapping[tuple[str, float], Attempt]


class Corner(NamedTuple):
    """The worst point that a search has found, the number of points tried, and the number of those not solved."""

    regime: Regime
    point: Mapping[str, float]
    cell: Attempt
    tried: int
    unsolved: int


def stability(
    *regimes: str,
    solvers: Sequence[str] = SOLVERS,
    rtol: float = STUDY_RTOL,
    quick: bool = False,
    rounds: int = SEARCH_ROUNDS,
) -> Study:
    """Solve difficult regimes over decades of their parameter and report the correct digits of each solver.

    Parameters
    ----------
    *regimes
        Names of regimes; all by default.
    solvers
        Names of solvers.
    rtol
        Relative tolerance of each.
    quick
        True to use only four values of each parameter.
    rounds
        Rounds of a search for the worst corner of each regime that has one; no search if zero.

    Returns
    -------
    Study
        Digits over regimes, values and solvers.

    Raises
    ------
    InputError
        If a name is not that of a regime or solver.
    """
    found = chosen(regimes)
    check_options(solvers, [rtol], rounds, (0, MOST_ROUNDS), ("--solvers", "--rtol", "--search"))
    rows = []
    for number, regime in enumerate(found):
        values = thinned(regime.values) if quick else list(regime.values)
        done = {"done": number, "total": len(found)}
        log.info("%s: %d values", regime.name, len(values), extra=done)
        runs = {value: prepared(regime.problem(value), rtol) for value in values}
        rows.append(MatrixRow(regime, values, filled(solvers, runs)))
    corners = [worst_corner(regime, rounds, rtol) for regime in found if regime.space] if rounds else []
    options = ["--solvers", ",".join(solvers)] if tuple(solvers) != SOLVERS else []
    options += ["--rtol", repr(float(rtol))] if rtol != STUDY_RTOL else []
    options += ["--quick"] if quick else []
    options += ["--search", str(rounds)] if rounds != SEARCH_ROUNDS else []
    return Study(
        kind="stability",
        title="Stability of the solvers in dangerous regimes",
        arguments=[*regimes, *options],
        axes={"regime": rows, "decade": range(max(len(row.values) for row in rows)), "solver": solvers},
        variables=list(_variables(solvers[0])),
        sections=list(_sections(rows, corners, solvers, rtol)),
        omissions=list(_omissions(rows, solvers, searched=rounds > 0)),
        settings={"rtol": rtol},
    )


def thinned(values: Sequence[float]) -> list[float]:
    """Return the first, the middle, the last but one, and the last of the values."""
    return [values[i] for i in sorted({0, len(values) // 2, len(values) - 2, len(values) - 1})]


# -- one problem -------------------------------------------------------------------------------------------------------


def prepared(problem: Trial, rtol: float = STUDY_RTOL) -> Callable[[str], Attempt]:
    """Return a function that solves a problem with a solver; the problem is read and compiled once."""
    try:
        model = Model(read(problem).system())
    except InputError as error:
        refused = _unfinished(problem.expected, math.nan, error)
        return lambda name: replace(refused)
    known = condition(problem, [state.name for state in model.system.states])
    times = (0.0, *problem.times) if problem.times[0] else tuple(problem.times)
    run = Run(times=times, rtol=rtol, max_steps=STEPS)
    judge = partial(_judged, problem.expected, rtol, known)
    return lambda name: attempt(partial(model.solve, replace(run, solver=name)), judge)


def read(problem: Trial) -> Case:
    """Return the case of a problem with its changes."""
    changes = {**problem.changes, "run": {"times": list(problem.times)}}
    case = cases.load(problem.case, changes)
    return replace(case, reference=None)  # the regime has its own expectation


def _judged(expected: Expectation, rtol: float, known: float, done: Trajectory | Exception) -> Attempt:
    """Judge a run by the ``known`` condition of its problem: outcome, digits and reason."""
    if isinstance(done, Exception):
        return _unfinished(expected, known, done)
    outcome, digits, reason = WRONG, 0.0, done.reason
    if done.status == "stopped" and isinstance(expected, Stops):
        if expected.reason in done.reason:
            outcome, digits = REFUSED, digits_of(abs(done.result.t - expected.t) / (expected.t or 1.0))
    elif done.status != "finished":
        outcome = FAILED
    elif isinstance(expected, Exact) and expected.events not in (None, len(done.jumps)):
        reason = f"{len(done.jumps)} events, not {expected.events}"
    elif isinstance(expected, Exact):
        error, worst = _largest_error(expected, done)
        outcome, digits, reason = SOLVED, digits_of(error), f"in {worst}"
    if digits < LEAST and outcome in (SOLVED, REFUSED):
        outcome = SENSITIVE if digits_left(known, rtol) < LEAST else WRONG
    return Attempt(outcome, reason, digits, known)


def _unfinished(expected: Expectation, known: float, error: Exception) -> Attempt:
    """Return the attempt for an error; it is right if this refusal was expected, for that reason."""
    reason = error.message if isinstance(error, InputError) else f"{type(error).__name__}: {error}"
    right = isinstance(expected, Refused) and expected.reason in reason
    return Attempt(REFUSED if right else FAILED, reason, MOST if right else 0.0, known)


def _largest_error(expected: Exact, done: Trajectory) -> tuple[float, str]:
    """Return the largest relative error of a run, and the variable that has it."""
    compared = {*expected.also, *(state.name for state in done.model.system.states)}
    exact = {name: np.asarray(v) for name, v in expected.values(done.result.times).items() if name in compared}
    errors = largest_errors(computed(done), exact, {name: answer_floor(true) for name, true in exact.items()})
    worst = max(errors, key=lambda name: math.inf if math.isnan(errors[name]) else errors[name])
    return errors[worst], worst


def digits_of(error: float) -> float:
    """Return the correct digits that an error leaves.

    >>> digits_of(1e-8), digits_of(0.0), digits_of(math.nan), digits_of(10.0)
    (8.0, 16.0, 0.0, 0.0)
    """
    if math.isnan(error):
        return 0.0
    return min(max(-math.log10(error), 0.0), MOST) if error > 0 else MOST


def digits_left(condition: float, change: float) -> float:
    """Return the digits of an answer that a relative change of the data leaves.

    >>> round(digits_left(1e6, 1e-10), 9), digits_left(1.0, 1e-20), digits_left(1e20, 1e-10)
    (4.0, 16.0, 0.0)
    """
    return digits_of(condition * change) if math.isfinite(condition) else math.nan


# -- condition of a problem --------------------------------------------------------------------------------------------


def condition(problem: Trial, names: Collection[str]) -> float:
    """Return the largest relative change of the named values over that of the data, all of which change at once; NaN if
    the answer is not numerical or the data are not given.

    Data are the parameters of the exact solution and the output times; zeros are not changed.

    >>> from surfacechem.studies.regimes import regimes
    >>> [f"{condition(regimes()['cold'].problem(part), ['T']):.0e}" for part in (1e-3, 1e-6)]
    ['3e+06', '3e+12']
    """
    expected, times = problem.expected, np.array(problem.times)
    if isinstance(expected, Refused) or expected.again is None:
        return float("nan")
    again: Callable[..., Any] = expected.again
    data = dict(expected.data)
    if isinstance(expected, Exact):
        data[TIME_NAME] = 1.0

    def answer(changed: Mapping[str, float]) -> Answer:
        if isinstance(expected, Stops):
            return {TIME_NAME: np.array([again(changed)])}
        values: Answer = again({name: changed[name] for name in expected.data}, changed[TIME_NAME] * times)
        return {name: np.atleast_1d(values[name]) for name in values if name in {*names, *expected.also}}

    base = answer(data)
    total = {name: np.zeros_like(values) for name, values in base.items()}
    for name in data:
        for key, slope in (_slopes(answer, base, data, name) if data[name] else {}).items():
            total[key] = total[key] + slope
    return float(max((slopes.max(initial=0.0) for slopes in total.values()), default=0.0))


def answer_floor(values: Array | float) -> float:
    """Return the size of an exact answer below which errors are relative to this: a part of its largest value."""
    return ERROR_FLOOR * float(np.max(np.abs(values), initial=0.0))


def _slopes(answer: Callable[[Data], Answer], base: Answer, data: Data, name: str) -> Answer:
    """Return the relative change of the answer over that of one of the data, by the first step that the next confirms.

    If there is no answer in one direction the step is taken in the other.
    """
    before: Answer = {}
    for step in PERTURBATIONS:
        now: Answer = {}
        for sign in (1.0, -1.0):
            moved = data[name] * (1.0 + sign * step)
            with suppress(InputError):
                found, done = answer({**data, name: moved}), abs(moved - data[name]) / abs(data[name])
                now = {key: relative_errors(found[key], base[key], answer_floor(base[key])) / done for key in base}
                break
        # Long steps include curvature, short ones rounding: the first slope that the next step confirms is taken.
        changes = ((np.abs(before[key] - slope), STRAIGHT_PART * slope) for key, slope in now.items())
        if before and now and all(np.max(change, initial=0.0) <= np.max(most, initial=0.0) for change, most in changes):
            return now
        before = now
    return before


# -- the worst corner --------------------------------------------------------------------------------------------------


def worst_corner(regime: Regime, rounds: int = SEARCH_ROUNDS, rtol: float = STUDY_RTOL, seed: int = SEED) -> Corner:
    """Search for the worst point of the regime's space by differential evolution of decimal logarithms; ``seed`` fixes
    the result.

    Source: Storn & Price (1997), Differential evolution, J. Global Optim. 11, 341 (rand/1/bin), as in SciPy.
    """
    random = np.random.default_rng(seed)
    names, low, high = list(regime.space), *np.array(list(regime.space.values())).T
    log.info("%s: searching its worst corner", regime.name)
    seen: list[tuple[float, dict[str, float], Attempt]] = []

    def kept(logarithms: NDArray[np.float64]) -> float:
        point = {name: float(10.0**x) for name, x in zip(names, logarithms, strict=True)}
        try:
            cell = prepared(regime.corner(**point), rtol)(OWN)
        except InputError as error:  # the point is outside the validity of the exact solution
            cell = Attempt(REFUSED, error.message, MOST)
        seen.append((MOST - cell.digits + PENALTY.get(cell.outcome, 0.0), point, cell))
        return -seen[-1][0]

    differential_evolution(
        kept,
        Bounds(low, high),
        strategy="rand1bin",
        init=low + (high - low) * random.random((POPULATION, len(names))),
        maxiter=rounds,
        mutation=WEIGHT,
        recombination=CROSSOVER,
        tol=0,
        polish=False,
        rng=random,
    )
    _, point, cell = max(seen, key=lambda found: found[0])
    return Corner(regime, point, cell, len(seen), sum(cell.outcome in PENALTY for *_, cell in seen))


# -- the dataset and the report ----------------------------------------------------------------------------------------


def _variables(first: str) -> Iterator[Variable]:
    """Yield the variables over regime, decade and solver, coordinates first; empty beyond the values of a regime."""

    def at(read: Callable[[Attempt], float | str], nothing: float | str = math.nan) -> Callable[..., float | str]:
        def value(row: MatrixRow, k: int, solver: str = first) -> float | str:
            return read(row.cells[solver, row.values[k]]) if k < len(row.values) else nothing

        return value

    problem, cell = ("regime", "decade"), ("regime", "decade", "solver")
    relative = "relative change of the answer over its data's"
    possible = "digits that rounding of the data leaves"
    largest = "-log10 of the largest relative error, of values or of the time of the end"
    came = f"what came of it: {', '.join(OUTCOMES)}"
    why = "where the error is largest, or why the run ended"
    yield Variable("regime", ("regime",), lambda row: row.regime.name, "1", "regime")
    yield Variable("decade", ("decade",), float, "1", "number of the value, from mild to extreme")
    yield Variable("solver", ("solver",), str, "1", "solver")
    yield Variable("symbol", ("regime",), lambda row: row.regime.symbol, "1", "parameter")
    yield Variable("value", problem, at(lambda cell: cell.value), "1", "value of the parameter")
    yield Variable("condition", problem, at(lambda cell: cell.condition), "1", relative)
    yield Variable("possible", problem, at(lambda cell: digits_left(cell.condition, EPS)), "1", possible)
    yield Variable("digits", cell, at(lambda cell: cell.digits), "1", largest)
    yield Variable("steps", cell, at(lambda cell: cell.counters.steps), "1", "steps")
    yield Variable("residuals", cell, at(lambda cell: cell.counters.residuals), "1", "evaluations of the equations")
    yield Variable("seconds", cell, at(lambda cell: sum(cell.seconds)), "s", "run time")
    yield Variable("outcome", cell, at(lambda cell: cell.outcome, ""), "1", came)
    yield Variable("reason", cell, at(lambda cell: cell.reason, ""), "1", why)


def _sections(
    rows: Sequence[MatrixRow], corners: Sequence[Corner], solvers: Sequence[str], rtol: float
) -> Iterator[PageSection]:
    """Yield the sections of the report; the terminal shows the summary and the corners."""
    headings = ("condition", "possible", f"at rtol {rtol:g}")
    lines = []
    for regime, values, cells in rows:
        known = [cells[solvers[0], value].condition for value in values]
        worst = max((number for number in known if math.isfinite(number)), default=math.nan)
        span = f"{regime.symbol}: {regime.label(values[0])} .. {regime.label(values[-1])}"
        kept = [_kept([cells[solver, value] for value in values]) for solver in solvers]
        lines.append((regime.name, span, *_condition_texts(worst, rtol), *kept))
    caption = f"Least digits kept over all values, at rtol {rtol:g}, and the largest condition number"
    summary = PageTable(("regime", "from .. to", *headings, *solvers), lines, caption)
    yield PageSection("Digits kept", [MEANING], [summary], figure=True)
    found = []
    for corner in corners:
        where = ", ".join(f"{name} = {value:.3g}" for name, value in corner.point.items())
        said = f"{corner.cell.text} {corner.cell.reason}"
        found.append((corner.regime.name, f"{corner.tried}", f"{corner.unsolved}", said, where))
    if found:
        heading, caption = ("regime", "points", "not solved", "worst", "where"), "Worst corners that a search has found"
        yield PageSection("Corners", tables=[PageTable(heading, found, caption)])
    every = [_details(row, [*headings, *solvers], rtol) for row in rows]
    yield PageSection("Every cell", tables=every, details=True)


def _details(row: MatrixRow, headings: Sequence[str], rtol: float) -> PageTable:
    """Return the table of every cell of a regime, with steps and reasons of the first solver."""
    lines, marked = [], []
    for i, value in enumerate(row.values):
        first, *_ = cells = [cell for cell in row.cells.values() if cell.value == value]
        texts = (row.regime.label(value), *_condition_texts(first.condition, rtol), *(cell.text for cell in cells))
        lines.append((*texts, str(first.counters.steps), first.reason))
        marked += [i] if any(cell.outcome in OUTCOME_COLOURS for cell in cells) else []
    of_first = (f"steps of {first.solver}", f"{first.solver}: where, or why")
    return PageTable((row.regime.symbol, *headings, *of_first), lines, row.regime.title, marked)


def _kept(cells: Sequence[Attempt]) -> str:
    """Describe the least digits of all answers, and the numbers of failed and wrong cells."""
    outcomes = [cell.outcome for cell in cells]
    answers = [cell.digits for cell in cells if cell.outcome not in OUTCOME_COLOURS]
    counts = [f"{outcomes.count(word)} {word}" for word in OUTCOME_COLOURS if word in outcomes]
    return ", ".join([f"{min(answers):.1f}" if answers else "none", *counts])


def _condition_texts(number: float, rtol: float) -> Sequence[str]:
    """Return a condition number, the possible digits, and the digits that it leaves at the tolerance."""
    left = (f"{digits_left(number, change):.1f}" for change in (EPS, rtol))
    return (f"{number:.0e}", *left) if math.isfinite(number) else ("", "", "")


def _omissions(rows: Sequence[MatrixRow], solvers: Sequence[str], searched: bool) -> Iterator[str]:
    """Yield values, solvers, searches and steps that were left out, each with the reason."""
    every, taken = sum(len(row.regime.values) for row in rows), sum(len(row.values) for row in rows)
    if taken < every:
        yield f"{every - taken} of {every} values of the regimes, for the sake of time"
    if others := [name for name in known_solvers if name not in solvers]:
        yield f"the solvers {', '.join(others)}, which were not asked for"
    if not searched:
        yield "the search for worst corners, which was not asked for"
    if full := sum(cell.counters.steps >= STEPS for row in rows for cell in row.cells.values()):
        yield f"what lies beyond {STEPS} steps of a run: {full} took as many, and count as failed"
