"""Relative errors, and their estimates where no exact solution is known."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from surfacechem.errors import InputError, Place
from surfacechem.tolerances import CONTROL_RTOL, LOOSEST_RTOL, MAX_RTOL, MIN_RTOL

Array = NDArray[np.float64]

SECOND_RUN_FACTOR = 1e-2
"""Without an exact solution the error is estimated from a second run whose tolerance is lower by this factor."""

RTOL_PART = 1e-2
"""The tolerance of a step is this part of the accuracy asked for. Over the exact solutions the error of a run is below
a hundred times its tolerance, but near singular ends.
"""

CELLS_UNKNOWN = "the error of the cells across bodies does not fall as their number grows"
"""Reason why the error of a run with cells is not known."""

ENDED_AT_START = "the run ended at its start"

NOTHING_EVOLVES = "nothing evolves, and no work is done"
"""Reason why two runs at different tolerances tell nothing."""


def check_tolerance(rtol: float, option: str) -> None:
    """Raise InputError for a relative tolerance out of the range of runs: what is tighter is rounding."""
    if not MIN_RTOL <= rtol <= MAX_RTOL:
        raise InputError(f"{rtol:g} is outside its range: >= {MIN_RTOL:g} and <= {MAX_RTOL:g}.", Place(path=option))


def first_tolerance(accuracy: float) -> float:
    """Relative tolerance of a step for an accuracy that is asked for.

    >>> first_tolerance(1e-8), first_tolerance(1e-20)
    (1e-10, 1e-13)
    """
    return min(max(accuracy * RTOL_PART, MIN_RTOL), LOOSEST_RTOL)


def second_tolerance(rtol: float) -> float:
    """Tolerance of the second run; only one that is tighter than all others has a looser one.

    >>> second_tolerance(1e-8), second_tolerance(1e-13), second_tolerance(1e-15)
    (1e-10, 3e-14, 1e-13)
    """
    if rtol > MIN_RTOL:
        return max(rtol * SECOND_RUN_FACTOR, MIN_RTOL)
    return CONTROL_RTOL if rtol > CONTROL_RTOL else MIN_RTOL


def relative_errors(values: Array, exact: Array, floor: float | Array) -> Array:
    """Errors relative to the exact value at the same time, or to ``floor`` if that is more; absolute where both are
    zero.

    >>> relative_errors(np.array([1.5, 2.0, 1e-9]), np.array([1.0, 2.0, 0.0]), 1e-6).tolist()
    [0.5, 0.0, 0.001]
    """
    scale = np.asarray(np.maximum(np.abs(exact), floor))
    scale[scale == 0] = 1.0
    return np.asarray(np.abs(values - exact) / scale)


def errors_over_time(
    values: Mapping[str, Array], true: Mapping[str, Array], floors: Mapping[str, float | Array]
) -> dict[str, Array]:
    """Relative errors of the variables that have true values, at the times that both have; ``floors`` are sizes below
    which errors are relative to these.
    """
    found = {}
    for name, exact in true.items():
        n = min(len(values[name]), len(exact))
        floor = np.broadcast_to(floors[name], np.shape(exact))
        found[name] = relative_errors(values[name][:n], np.asarray(exact)[:n], floor[:n])
    return found


def largest_errors(
    values: Mapping[str, Array], true: Mapping[str, Array], floors: Mapping[str, float | Array]
) -> dict[str, float]:
    """The largest relative error of each variable that has true values: how far a run is from an exact solution, or
    from another run.

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
    exact: Mapping[str, Any] = field(default_factory=dict, compare=False)
    """Exact values at the output times, by variable, where an exact solution was named."""
    asked: float | None = None
    """Accuracy that was asked for, where the tolerance was chosen from it."""
    named: Callable[[], Mapping[str, float]] = field(default=dict, compare=False)
    """The errors of what follows from the compared variables, by variable, where they are known."""

    @cached_property
    def everywhere(self) -> dict[str, float]:
        """The errors of all variables of which one is known, by variable."""
        return {**self.named(), **self.variables}


@dataclass(frozen=True)
class CellErrors:
    """Relative errors that a second run at another tolerance does not see, by variable: those that cells across bodies
    leave, or numbers that laws compute for themselves; nothing where there are none.
    """

    variables: Mapping[str, float] = field(default_factory=dict)
    converged: bool = True
    """Whether half of the cells and a quarter of them confirm the order, so that the errors are known."""
    in_noise: bool = False
    """Whether the tolerance of the run hides what more cells would change."""
    source: str = "and one with half of the cells"
    """Source of the errors, in words that follow those for the errors of the tolerance."""

    @property
    def largest(self) -> float:
        """The largest error; not a number where it is not known."""
        return max(self.variables.values(), default=0.0) if self.converged else math.nan

    def added_to(self, other: CellErrors) -> CellErrors:
        """Errors of both; known where both are."""
        names = {**self.variables, **other.variables}
        total = {name: self.variables.get(name, 0.0) + other.variables.get(name, 0.0) for name in names}
        return replace(other, variables=total, converged=self.converged and other.converged)

    def beside(self, other: CellErrors) -> CellErrors:
        """Errors of two kinds together, with the words for both."""
        kinds = [found.source for found in (other, self) if found.variables]
        return replace(self.added_to(other), source=", ".join(kinds), in_noise=self.in_noise or other.in_noise)
