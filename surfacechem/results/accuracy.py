"""Relative errors, and their estimates if no exact solution is known."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from numbers import Real
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from surfacechem.errors import InputError, Place, expect
from surfacechem.tolerances import CONTROL_RTOL, LOOSEST_RTOL, MAX_RTOL, MIN_RTOL

Array = NDArray[np.float64]

SECOND_RUN_FACTOR = 1e-2
"""Ratio of the tolerance of the second run, from which an error is estimated, to that of the first one."""

RTOL_PART = 1e-2
"""Fraction of the requested accuracy that is the tolerance of a step: for the exact solutions the error of a run is
below a hundred times its tolerance, except near singular ends.
"""

CELLS_UNKNOWN = "the error of the cells across bodies does not fall as their number grows"
"""Reason why the error of a run with cells is unknown."""

ENDED_AT_START = "the run ended at its start"

NOTHING_EVOLVES = "nothing evolves, and no work is done"
"""Reason why the difference of two runs at different tolerances is no estimate."""


def check_tolerance(rtol: float, option: str) -> None:
    """Raise InputError for a relative tolerance out of the range of runs: tighter ones are below roundoff."""
    expect(rtol, Real, "a tolerance is a number", Place(path=option))
    if not MIN_RTOL <= rtol <= MAX_RTOL:
        raise InputError(f"{rtol:g} is outside its range: >= {MIN_RTOL:g} and <= {MAX_RTOL:g}.", Place(path=option))


def first_tolerance(accuracy: float) -> float:
    """Return the relative tolerance of a step for a requested accuracy.

    >>> first_tolerance(1e-8), first_tolerance(1e-20)
    (1e-10, 1e-13)
    """
    return min(max(accuracy * RTOL_PART, MIN_RTOL), LOOSEST_RTOL)


def second_tolerance(rtol: float) -> float:
    """Return the tolerance of the second run; it is looser only if the first is tighter than all others.

    >>> second_tolerance(1e-8), second_tolerance(1e-13), second_tolerance(1e-15)
    (1e-10, 3e-14, 1e-13)
    """
    if rtol > MIN_RTOL:
        return max(rtol * SECOND_RUN_FACTOR, MIN_RTOL)
    return CONTROL_RTOL if rtol > CONTROL_RTOL else MIN_RTOL


def relative_errors(values: Array, exact: Array, floor: float | Array) -> Array:
    """Return errors relative to the exact value, or to ``floor`` if that is larger; absolute if both are zero.

    >>> relative_errors(np.array([1.5, 2.0, 1e-9]), np.array([1.0, 2.0, 0.0]), 1e-6).tolist()
    [0.5, 0.0, 0.001]
    """
    scale = np.asarray(np.maximum(np.abs(exact), floor))
    scale[scale == 0] = 1.0
    return np.asarray(np.abs(values - exact) / scale)


def errors_over_time(
    values: Mapping[str, Array], true: Mapping[str, Array], floors: Mapping[str, float | Array]
) -> dict[str, Array]:
    """Return relative errors of the variables that have true values, at the times that both have. An error is relative
    to the entry of ``floors`` if the value is smaller.
    """
    found = {}
    for name, exact in true.items():
        n = min(len(values[name]), len(exact))
        found[name] = relative_errors(values[name][:n], np.asarray(exact)[:n], np.atleast_1d(floors[name])[:n])
    return found


def largest_errors(
    values: Mapping[str, Array], true: Mapping[str, Array], floors: Mapping[str, float | Array]
) -> dict[str, float]:
    """Return the largest relative error of each variable that has true values, from an exact solution or another run.

    >>> largest_errors({"T": np.array([301.0, 303.0])}, {"T": np.array([300.0, 300.0])}, {"T": 1.0})
    {'T': 0.01}
    """
    errors = errors_over_time(values, true, floors)
    return {name: float(np.max(found, initial=0.0)) for name, found in errors.items()}


@dataclass(frozen=True)
class Accuracy:
    """Error of a run: the largest relative error of the compared variables, and its source."""

    error: float
    source: str
    """The exact solution's name, the second run and its tolerance, or the balances, in words."""
    variables: Mapping[str, float] = field(default_factory=dict)
    exact: Callable[..., Mapping[str, Array]] | None = field(default=None, compare=False, repr=False)
    """Function for the exact values at the outputs of a run, by variable, if an exact solution was named."""
    asked: float | None = None
    """Requested accuracy, if the tolerance was chosen from it."""
    named: Callable[[], Mapping[str, float]] = field(default=dict, compare=False, repr=False)
    """Function for the errors of quantities that follow from the compared variables, by name, where known."""

    @cached_property
    def everywhere(self) -> dict[str, float]:
        """All known errors, by variable."""
        return {**self.named(), **self.variables}


class CellErrors(NamedTuple):
    """Relative errors that a second run at another tolerance does not see, by variable: of the cells across bodies, or
    of numbers that laws compute themselves; empty if there are none.
    """

    variables: Mapping[str, float] = {}
    converged: bool = True
    """True if runs with a half and a quarter of the cells confirm the order, so that the errors are known."""
    in_noise: bool = False
    """True if errors of the tolerance hide the effect of more cells."""
    source: str = "and one with half of the cells"
    """Source of the errors, in words that continue the source of the errors of the tolerance."""

    @property
    def largest(self) -> float:
        """Largest error; NaN if it is unknown."""
        return max(self.variables.values(), default=0.0) if self.converged else math.nan

    def added_to(self, other: CellErrors) -> CellErrors:
        """Return the sum of both errors, known if both are."""
        names = {**self.variables, **other.variables}
        total = {name: self.variables.get(name, 0.0) + other.variables.get(name, 0.0) for name in names}
        return other._replace(variables=total, converged=self.converged and other.converged)

    def combined(self, other: CellErrors) -> CellErrors:
        """Return the sum of errors of two kinds, with the sources of both."""
        kinds = [found.source for found in (other, self) if found.variables]
        return self.added_to(other)._replace(source=", ".join(kinds), in_noise=self.in_noise or other.in_noise)
