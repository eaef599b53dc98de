"""Searches along a gap: the next equilibrium in the direction in which the tractions push, or the fold ahead."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from surfacechem.compile.preparing import PREPARING

Array = NDArray[np.float64]
Curve = Callable[[Sequence[float] | Array], Array]

CLOSEST: dict[str, Any] = {"xtol": 1e-300, "rtol": 8.9e-16, "maxiter": 300, "disp": False}
"""How closely a root of the tractions is found: to rounding."""

FIRST, GROWTH, MARCH = 1e-9, 1.02, 2400
"""First step of the search for the next equilibrium, relative to the gap, its growth, and the number of steps."""

REACH = FIRST * (GROWTH ** (MARCH - 1) - 1) / (GROWTH - 1)
"""How far a search goes, relative to the gap."""

SMALLEST_GAP = 1e-12
"""Gap [m] below which the search starts as if from this one."""


def march(driving: Curve, start: float, direction: float, noise: Curve) -> float | None:
    """The gap at which the push of the driving traction, or that from a fold, ends.

    At a fold the push begins as rounding: it counts from where it is more than the ``noise`` of the tractions.
    """
    push = float(np.sign(driving([start])[0]))
    if push == 0.0 and direction == 0.0:
        return start
    return zero_ahead(driving, start, direction or push, direction or push, noise if direction else None)


def steps_ahead(start: float, direction: float) -> Array:
    """Gaps in ever longer steps from a gap in a direction."""
    size = FIRST * max(abs(start), SMALLEST_GAP)
    return np.asarray(start + direction * size * (GROWTH ** np.arange(MARCH) - 1) / (GROWTH - 1))


def push_ahead(driving: Curve, start: float, direction: float, least: Curve, *, lost: bool) -> float | None:
    """The first gap in a direction at which the driving traction pushes on by more than the ``least`` that counts.

    None where there is none, or where it resists before and the balance is not known to be ``lost``.
    """
    gaps = steps_ahead(start, direction)
    values, small = direction * driving(gaps), least(gaps)
    first = int(np.argmax(values > small))
    resists = not lost and bool(np.any(values[:first] < -small[:first]))
    return float(gaps[first]) if values[first] > small[first] and not resists else None


def zero_ahead(curve: Curve, start: float, direction: float, sign: float, noise: Curve | None = None) -> float | None:
    """The first zero in a direction of what has a sign before it; it may start with the other one within rounding."""
    with PREPARING:
        from scipy.optimize import brentq

    gaps = steps_ahead(start, direction)
    values = sign * curve(gaps)
    least = 0.0 if noise is None else noise(gaps)
    first = int(np.argmax(values > least))
    crossed = np.nonzero(~(values[first:] > 0))[0]
    if not values[first] > 0 or len(crossed) == 0 or not np.isfinite(values[first + crossed[0]]):
        return None
    j = first + int(crossed[0])
    if values[j] == 0.0:
        return float(gaps[j])
    found = float(brentq(lambda g: float(curve([g])[0]), gaps[j - 1], gaps[j], **CLOSEST))
    # At a pole the sign changes too, but there is no zero.
    return None if abs(curve([found])[0]) > max(abs(values[j - 1]), abs(values[j])) else found
