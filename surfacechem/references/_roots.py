"""Inversion of an increasing function to rounding: Newton's method kept inside a shrinking bracket."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from surfacechem.references.base import Array

ROUNDING = 4.0 * np.finfo(np.float64).eps
ITERATIONS = 400


def increasing_root(
    function: Callable[[Array], tuple[Array, Array]],
    target: Array,
    low: Array,
    high: Array,
    start: Array | None = None,
) -> Array:
    """Where `function`, which gives value and slope and increases on [low, high], reaches `target`.

    It starts at `low` unless a better guess is given.

    >>> increasing_root(lambda x: (x**2, 2 * x), np.array([2.0]), np.array([1.0]), np.array([2.0]))
    array([1.41421356])
    """
    x = low if start is None else np.clip(start, low, high)
    for _ in range(ITERATIONS):
        value, slope = function(x)
        error = value - target
        low, high = np.where(error <= 0.0, x, low), np.where(error >= 0.0, x, high)
        with np.errstate(all="ignore"):
            newton = x - error / slope
        inside = (newton > low) & (newton < high)
        following = np.where(inside, newton, 0.5 * (low + high))
        reached = np.abs(error) <= ROUNDING * np.abs(target)
        step = np.minimum(np.abs(following - x), high - low)
        settled = reached | (step <= ROUNDING * np.abs(x))
        x = np.where((error == 0.0) | (reached & ~inside), x, following)
        if settled.all():
            return x
    raise ArithmeticError(f"no root found between {low} and {high}")
