"""Errors of a run against the truth: final, largest and root mean square in time, and of the times of events.

All are relative to the true value at the same time, or to a floor if that is more: of a state the size at which its
absolute tolerance is as much as the relative one, of another variable its largest value.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from surfacechem.results.accuracy import relative_errors

Array = NDArray[np.float64]

Values: TypeAlias = Mapping[str, Array]

KINDS = ("final", "max", "l2")
MEANING = {
    "final": "relative error at the end",
    "max": "largest relative error",
    "l2": "root mean square in time of the relative error",
    "event": "largest relative error of the times of events",
}
"""What each error is; the last is not of variables."""


@dataclass(frozen=True)
class Errors:
    """Errors by kind and variable, and of the times of events (NaN where there are none)."""

    by_kind: Mapping[str, Mapping[str, float]]
    event: float = np.nan

    @property
    def finite(self) -> bool:
        """Whether every error is a number; that of the events may be missing."""
        return bool(np.isfinite([e for kind in self.by_kind.values() for e in kind.values()]).all())

    def worst(self, kind: str) -> float:
        """The largest over the variables, or that of the events."""
        return self.event if kind == "event" else max(self.by_kind[kind].values())


def compare(times: Array, values: Values, true: Values, floors: Mapping[str, float]) -> Errors:
    """Errors of the variables that have a truth, over the output times that both runs reached."""
    found: dict[str, dict[str, float]] = {kind: {} for kind in KINDS}
    for name, exact in true.items():
        n = min(len(values[name]), len(exact))
        error = relative_errors(values[name][:n], exact[:n], floors[name])
        found["final"][name] = float(error[-1])
        found["max"][name] = float(error.max())
        found["l2"][name] = mean_square(times[:n], error)
    return Errors(found)


def mean_square(times: Array, error: Array) -> float:
    """Root mean square in time, by the trapezoidal rule.

    >>> mean_square(np.array([0.0, 1.0, 3.0]), np.array([0.2, 0.2, 0.2]))
    0.2
    """
    if len(times) < 2:
        return float(np.max(error, initial=0.0))
    return float(np.sqrt(np.trapezoid(error**2, times) / (times[-1] - times[0])))


def larger(one: Errors, other: Errors) -> Errors:
    """The larger error of two for each kind and variable."""
    found = {
        kind: {name: max(error, other.by_kind[kind].get(name, 0.0)) for name, error in errors.items()}
        for kind, errors in one.by_kind.items()
    }
    return Errors(found, float(np.fmax(one.event, other.event)))
