"""How well a problem determines its answer: the condition number, from the exact answer alone.

A relative change eps of the data changes the answer by up to eps times this number, whatever solves the problem: so
many of its digits are lost to the rounding of the data, and to the tolerance of a solver, whose error is that of a
problem with changed data. Source: Higham (2002), Accuracy and Stability of Numerical Algorithms, section 1.6.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping

import numpy as np
from numpy.typing import NDArray

from surfacechem.errors import InputError
from surfacechem.results.accuracy import FLOOR, relative_errors
from surfacechem.studies.regimes import Exact, Problem, Stops

Array = NDArray[np.float64]

TIME = "t"
"""The output times among the data."""

STEPS = tuple(2.0**-k for k in (20, 24, 28, 32, 36, 40, 44, 48))
"""Relative steps of the data, from 1e-6 to 16 roundings."""

STRAIGHT = 0.1
"""Relative change of a slope from one step to the next, below which it is one: a choice, as condition numbers are told
to one digit. Less would ask for shorter steps, in whose slopes there is more rounding."""


def condition(problem: Problem, names: Collection[str]) -> float:
    """Largest relative change of the named values over that of the data, all of which change at once; not a number
    where the problem has no answer in numbers, or the data are not stated.

    Data are the parameters of the exact solution and the output times; those that are zero stay so.

    >>> from surfacechem.studies.regimes import regimes
    >>> [f"{condition(regimes()['cold'].problem(part), ['T']):.0e}" for part in (1e-3, 1e-6)]
    ['3e+06', '3e+12']
    """
    expected = problem.expected
    if isinstance(expected, Exact) and expected.again is not None:
        again, times = expected.again, np.array(problem.times)
        every = {*names, *expected.also}

        def answer(data: Mapping[str, float]) -> dict[str, Array]:
            others = {name: value for name, value in data.items() if name != TIME}
            return _known(again(others, data[TIME] * times), every)

        return _condition(answer, {**expected.data, TIME: 1.0})
    if isinstance(expected, Stops) and expected.again is not None:
        end = expected.again
        return _condition(lambda data: {TIME: np.array([end(data)])}, expected.data)
    return float("nan")


def least(values: Array | float) -> float:
    """Size of an exact answer below which its errors are relative to this: a part of its largest value."""
    return FLOOR * float(np.max(np.abs(values), initial=0.0))


def _known(values: Mapping[str, Array | float], names: Collection[str]) -> dict[str, Array]:
    return {name: np.atleast_1d(np.asarray(value, dtype=float)) for name, value in values.items() if name in names}


def _condition(answer: Callable[[Mapping[str, float]], Mapping[str, Array]], data: Mapping[str, float]) -> float:
    base = answer(data)
    total = {name: np.zeros_like(values) for name, values in base.items()}
    for name, value in data.items():
        if value:
            for key, slope in _slopes(answer, base, data, name).items():
                total[key] = total[key] + slope
    return float(max((slopes.max(initial=0.0) for slopes in total.values()), default=0.0))


def _slopes(
    answer: Callable[[Mapping[str, float]], Mapping[str, Array]],
    base: Mapping[str, Array],
    data: Mapping[str, float],
    name: str,
) -> dict[str, Array]:
    """Relative changes of the answer over that of one of the data, with the largest step that the next one confirms."""
    before = None
    for step in STEPS:
        now = _changes(answer, base, data, name, step)
        if before is not None and now is not None and _confirmed(before, now):
            return now
        before = now
    return before or {}


def _confirmed(first: Mapping[str, Array], second: Mapping[str, Array]) -> bool:
    return all(
        np.max(np.abs(first[key] - second[key]), initial=0.0) <= STRAIGHT * np.max(second[key], initial=0.0)
        for key in second
    )


def _changes(
    answer: Callable[[Mapping[str, float]], Mapping[str, Array]],
    base: Mapping[str, Array],
    data: Mapping[str, float],
    name: str,
    step: float,
) -> dict[str, Array] | None:
    """Relative changes over the step, which goes the other way where there is no answer; None where there is on neither
    side.
    """
    for sign in (1.0, -1.0):
        moved = data[name] * (1.0 + sign * step)
        try:
            found = answer({**data, name: moved})
        except InputError:
            continue
        done = abs(moved - data[name]) / abs(data[name])
        return {key: relative_errors(found[key], values, least(values)) / done for key, values in base.items()}
    return None
