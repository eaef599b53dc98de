"""The condition number of a problem, which tells how well it determines its answer, from the exact answer alone.

A relative change eps of the data changes the answer by up to eps times this number, whatever solves the problem: so
many of its digits are lost to the rounding of the data, and to the tolerance of a solver, whose error is that of a
problem with changed data. Source: Higham (2002), Accuracy and Stability of Numerical Algorithms, section 1.6.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from surfacechem.errors import InputError
from surfacechem.results.accuracy import relative_errors
from surfacechem.studies.regimes import Exact, Refused, Stops, Trial
from surfacechem.tolerances import FLOOR

Array = NDArray[np.float64]
Answer = Mapping[str, Array]
Data = Mapping[str, float]

# The output times among the data.
TIME = "t"

# Relative steps of the data, from 1e-6 to 16 roundings.
STEPS = tuple(2.0**-k for k in (20, 24, 28, 32, 36, 40, 44, 48))

# Relative change of a slope from one step to the next, below which it is one: a choice, as condition numbers are told
# to one digit. Less would ask for shorter steps, in whose slopes there is more rounding.
STRAIGHT = 0.1


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
        data[TIME] = 1.0

    def answer(changed: Mapping[str, float]) -> Answer:
        if isinstance(expected, Stops):
            return {TIME: np.array([again(changed)])}
        values: Answer = again({name: changed[name] for name in expected.data}, changed[TIME] * times)
        return {name: np.atleast_1d(values[name]) for name in values if name in {*names, *expected.also}}

    base = answer(data)
    total = {name: np.zeros_like(values) for name, values in base.items()}
    for name in data:
        for key, slope in (_slopes(answer, base, data, name) if data[name] else {}).items():
            total[key] = total[key] + slope
    return float(max((slopes.max(initial=0.0) for slopes in total.values()), default=0.0))


def least(values: Array | float) -> float:
    """Size of an exact answer below which its errors are relative to this: a part of its largest value."""
    return FLOOR * float(np.max(np.abs(values), initial=0.0))


def _slopes(answer: Callable[[Data], Answer], base: Answer, data: Data, name: str) -> Answer:
    """Relative changes of the answer over that of one of the data, with the largest step that the next one confirms.

    A step goes the other way where there is no answer.
    """
    before: Answer = {}
    for step in STEPS:
        now: Answer = {}
        for sign in (1.0, -1.0):
            moved = data[name] * (1.0 + sign * step)
            with suppress(InputError):
                found, done = answer({**data, name: moved}), abs(moved - data[name]) / abs(data[name])
                now = {key: relative_errors(found[key], base[key], least(base[key])) / done for key in base}
                break
        # Long steps see the curvature, short ones rounding: taken is the first slope that the next step confirms.
        changes = ((np.abs(before[key] - slope), STRAIGHT * slope) for key, slope in now.items())
        if before and now and all(np.max(change, initial=0.0) <= np.max(most, initial=0.0) for change, most in changes):
            return now
        before = now
    return before
