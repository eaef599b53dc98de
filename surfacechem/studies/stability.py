"""The stability matrix: dangerous regimes solved to so many digits, refused for the right reason, or failed, by solver.

The condition number of a problem tells how well it determines its answer, from the exact answer alone: a relative
change eps of the data changes the answer by up to eps times this number, whatever solves the problem. So many of its
digits are lost to the rounding of the data, and to the tolerance of a solver, whose error is that of a problem with
changed data. Source: Higham (2002), Accuracy and Stability of Numerical Algorithms, section 1.6.

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

# Right to some digits; ended or refused for the right reason; a failure that says so; a wrong answer; an answer to a
# problem whose condition leaves no digits at the tolerance.
SOLVED, REFUSED, FAILED, WRONG, SENSITIVE = OUTCOMES = ("solved", "refused", "failed", "wrong", "sensitive")

# Tolerance of every solver, and the steps after which a run has failed. Choices: all of the libraries take this
# tolerance, and need 60 to 440 steps at it where a regime is mild.
STUDY_RTOL, STEPS = 1e-10, 1500

# Digits below which a value that is given out as an answer is wrong, and those that a double holds.
LEAST, MOST = 2.0, 16.0

SOLVERS = (OWN, "dop853", "lsoda", "bdf", "scipy-radau", "cvode", "ida")

# Rounds of a search for a worst corner, and the most that may be asked for.
SEARCH_ROUNDS, MOST_ROUNDS = 12, 10_000

SEED = 20210301
# Differential evolution: points kept, length of a difference, share of its coordinates that is taken. Few points, since
# each is a case to be compiled; the other two are in the ranges that Storn & Price advise.
POPULATION, WEIGHT, CROSSOVER = 8, 0.7, 0.8

# A failure counts as worse than any error, a wrong answer as worse than a failure.
PENALTY = {FAILED: MOST, WRONG: 2 * MOST}

Answer = Mapping[str, Array]
Data = Mapping[str, float]

# The output times among the data.
TIME_NAME = "t"

# Relative steps of the data, from 1e-6 to 16 roundings.
PERTURBATIONS = tuple(2.0**-k for k in (20, 24, 28, 32, 36, 40, 44, 48))

# Relative change of a slope from one step to the next, below which it is one: a choice, as condition numbers are told
# to one digit. Less would ask for shorter steps, in whose slopes there is more rounding.
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
    """One solver at one problem: its outcome, and the digits it kept."""

    digits: float
    """-log10 of the largest relative error, of values or of the time of the end; none where the input is refused."""
    condition: float = math.nan
    """Condition number of the problem: relative change of its answer over that of its data; none where not known."""

    @property
    def text(self) -> str:
        """The attempt in a table.

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
    """The worst point that a search has found, of how many tried, and how many were not solved."""

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
    """Solve difficult regimes over decades of their parameter and tell the digits that each solver keeps.

    Parameters
    ----------
    *regimes
        Names of regimes; all if none is named.
    solvers
        Names of solvers.
    rtol
        Relative tolerance of each.
    quick
        Whether four values of each parameter are enough.
    rounds
        Rounds of a search for the worst corner of each regime that has one; none where it is zero.

    Returns
    -------
    Study
        Digits over regimes, values and solvers.

    Raises
    ------
    InputError
        Where no regime or solver has a name.
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
    """First, middle and last of the values, and the one before the last."""
    return [values[i] for i in sorted({0, len(values) // 2, len(values) - 2, len(values) - 1})]


# -- one problem -------------------------------------------------------------------------------------------------------


def prepared(problem: Trial, rtol: float = STUDY_RTOL) -> Callable[[str], Attempt]:
    """Attempts at a problem by solver; it is read and compiled once."""
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
    """The case of a problem with its changes."""
    changes = {**problem.changes, "run": {"times": list(problem.times)}}
    case = cases.load(problem.case, changes)
    return replace(case, reference=None)  # the regime has its own expectation


def _judged(expected: Expectation, rtol: float, known: float, done: Trajectory | Exception) -> Attempt:
    """Outcome, digits and reason of a run, judged by the ``known`` condition of its problem."""
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
    """Attempt that ended in an error: right where its refusal was expected, for that reason."""
    reason = error.message if isinstance(error, InputError) else f"{type(error).__name__}: {error}"
    right = isinstance(expected, Refused) and expected.reason in reason
    return Attempt(REFUSED if right else FAILED, reason, MOST if right else 0.0, known)


def _largest_error(expected: Exact, done: Trajectory) -> tuple[float, str]:
    """The largest relative error of a run, and the variable that has it."""
    compared = {*expected.also, *(state.name for state in done.model.system.states)}
    exact = {name: np.asarray(v) for name, v in expected.values(done.result.times).items() if name in compared}
    errors = largest_errors(computed(done), exact, {name: answer_floor(true) for name, true in exact.items()})
    worst = max(errors, key=lambda name: math.inf if math.isnan(errors[name]) else errors[name])
    return errors[worst], worst


def digits_of(error: float) -> float:
    """Digits that an error leaves.

    >>> digits_of(1e-8), digits_of(0.0), digits_of(math.nan), digits_of(10.0)
    (8.0, 16.0, 0.0, 0.0)
    """
    if math.isnan(error):
        return 0.0
    return min(max(-math.log10(error), 0.0), MOST) if error > 0 else MOST


def digits_left(condition: float, change: float) -> float:
    """Digits of an answer that a relative change of the data leaves.

    >>> round(digits_left(1e6, 1e-10), 9), digits_left(1.0, 1e-20), digits_left(1e20, 1e-10)
    (4.0, 16.0, 0.0)
    """
    return digits_of(condition * change) if math.isfinite(condition) else math.nan


# -- its condition -----------------------------------------------------------------------------------------------------


def condition(problem: Trial, names: Collection[str]) -> float:
    """Largest relative change of the named values over that of the data, all of which change at once; not a number
    where the problem has no answer in numbers, or the data are not stated.

    Data are the parameters of the exact solution and the output times; those that are zero stay so.

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
    """Size of an exact answer below which its errors are relative to this: a part of its largest value."""
    return ERROR_FLOOR * float(np.max(np.abs(values), initial=0.0))


def _slopes(answer: Callable[[Data], Answer], base: Answer, data: Data, name: str) -> Answer:
    """Relative changes of the answer over that of one of the data, with the largest step that the next one confirms.

    A step goes the other way where there is no answer.
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
        # Long steps see the curvature, short ones rounding: taken is the first slope that the next step confirms.
        changes = ((np.abs(before[key] - slope), STRAIGHT_PART * slope) for key, slope in now.items())
        if before and now and all(np.max(change, initial=0.0) <= np.max(most, initial=0.0) for change, most in changes):
            return now
        before = now
    return before


# -- the worst corner --------------------------------------------------------------------------------------------------


def worst_corner(regime: Regime, rounds: int = SEARCH_ROUNDS, rtol: float = STUDY_RTOL, seed: int = SEED) -> Corner:
    """Differential evolution over the regime's space, on decimal logarithms; the same seed gives the same corner.

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
        except InputError as error:  # the corner is outside of what the exact solution holds for
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
    """The variables over regime, decade and solver, the coordinates first; nothing where a regime has fewer values."""

    def at(read: Callable[[Attempt], float | str], nothing: float | str = math.nan) -> Callable[..., float | str]:
        def value(row: MatrixRow, k: int, solver: str = first) -> float | str:
            return read(row.cells[solver, row.values[k]]) if k < len(row.values) else nothing

        return value

    problem, cell = ("regime", "decade"), ("regime", "decade", "solver")
    relative = "relative change of the answer over its data's"
    possible = "digits that rounding of the data leaves"
    largest = "-log10 of the largest relative error, of values or of the time of the end"
    came = f"what came of it: {', '.join(OUTCOMES)}"
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
    yield Variable(
        "reason", cell, at(lambda cell: cell.reason, ""), "1", "where the error is largest, or why the run ended"
    )


def _sections(
    rows: Sequence[MatrixRow], corners: Sequence[Corner], solvers: Sequence[str], rtol: float
) -> Iterator[PageSection]:
    """The report; the terminal shows the summary and the corners."""
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
    """Every cell of a regime, with what was said of the first solver's."""
    lines, marked = [], []
    for i, value in enumerate(row.values):
        first, *_ = cells = [cell for cell in row.cells.values() if cell.value == value]
        texts = (row.regime.label(value), *_condition_texts(first.condition, rtol), *(cell.text for cell in cells))
        lines.append((*texts, str(first.counters.steps), first.reason))
        marked += [i] if any(cell.outcome in OUTCOME_COLOURS for cell in cells) else []
    of_first = (f"steps of {first.solver}", f"{first.solver}: where, or why")
    return PageTable((row.regime.symbol, *headings, *of_first), lines, row.regime.title, marked)


def _kept(cells: Sequence[Attempt]) -> str:
    """The least digits of all answers, and how many cells failed or are wrong."""
    outcomes = [cell.outcome for cell in cells]
    answers = [cell.digits for cell in cells if cell.outcome not in OUTCOME_COLOURS]
    counts = [f"{outcomes.count(word)} {word}" for word in OUTCOME_COLOURS if word in outcomes]
    return ", ".join([f"{min(answers):.1f}" if answers else "none", *counts])


def _condition_texts(number: float, rtol: float) -> Sequence[str]:
    """A condition number, the digits that are possible, and those that it leaves at the tolerance."""
    left = (f"{digits_left(number, change):.1f}" for change in (EPS, rtol))
    return (f"{number:.0e}", *left) if math.isfinite(number) else ("", "", "")


def _omissions(rows: Sequence[MatrixRow], solvers: Sequence[str], searched: bool) -> Iterator[str]:
    """Values, solvers, searches and steps that were left out, each with the reason."""
    every, taken = sum(len(row.regime.values) for row in rows), sum(len(row.values) for row in rows)
    if taken < every:
        yield f"{every - taken} of {every} values of the regimes, for the sake of time"
    if others := [name for name in known_solvers if name not in solvers]:
        yield f"the solvers {', '.join(others)}, which were not asked for"
    if not searched:
        yield "the search for worst corners, which was not asked for"
    if full := sum(cell.counters.steps >= STEPS for row in rows for cell in row.cells.values()):
        yield f"what lies beyond {STEPS} steps of a run: {full} took as many, and count as failed"
