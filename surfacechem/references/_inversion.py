"""Integrals to rounding, inverse functions, and autonomous equations solved by the two."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from surfacechem.references.base import Array

ROUNDING = 4.0 * np.finfo(np.float64).eps
"""Relative difference to a target that no further iteration removes."""

ITERATIONS = 400
"""At most: halving alone takes 52 to the last digit, and one for each factor of two between the ends of a bracket."""

POINTS = 18
"""Gauss points of a panel: a singularity a panel's length away leaves an error of 5.8^-36 = 3e-28."""

HALVINGS = 800
"""Panels towards each end: the smallest is 2^-801 of the path."""

SOON = 1e-300
"""Times [s] below this count as zero."""

NEAR = 60
"""Halvings towards a point inside; below 2^-60 of the span it is no longer resolved."""

Rate = Callable[[Array, Array], Array]
"""Rate at which the distance covered grows, from the distances to the start and to the end; positive between them."""


def increasing_root(
    function: Callable[[Array], tuple[Array, Array]],
    target: Array,
    low: Array,
    high: Array,
    start: Array | None = None,
) -> Array:
    """Arguments at which `function`, which gives value and slope and increases on [low, high], reaches `target`.

    Newton's method, kept inside a shrinking bracket.

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


def short_integral(function: Callable[[Array], Array], upper: Array) -> Array:
    """Integral from zero to `upper` by ten Gauss points: exact where closed forms cancel to nothing.

    >>> f"{float(short_integral(np.exp, np.array(1e-20))):.14e}"
    '1.00000000000000e-20'
    """
    nodes, weights = np.polynomial.legendre.leggauss(10)
    return np.asarray(0.5 * upper * (function(0.5 * np.multiply.outer(upper, 1.0 + nodes)) @ weights))


class Separable:
    """An autonomous equation of one variable: times along a path of given length, by quadrature, and their inverse.

    The variable runs from a start to an end that it may reach or only approach. It is known by its distances from both,
    so that neither end loses digits. Gauss panels shrink geometrically towards both ends and towards any point at which
    the rate nearly vanishes, so that no singularity is closer to a panel than its length.
    """

    def __init__(self, rate: Rate, length: float, hard: Sequence[float] = ()) -> None:
        self.rate, self.length, self.hard = rate, length, tuple(hard)
        self.nodes, self.weights = np.polynomial.legendre.leggauss(POINTS)

    @cached_property
    def _panels(self) -> tuple[Array, Array, NDArray[np.bool_]]:
        """First and last distance of each panel and which of them count from the end."""
        half, powers = 0.5 * self.length, 0.5 ** np.arange(HALVINGS + 1.0)
        points = np.concatenate([[0.0], half * powers[::-1]])
        early = self._refined(points, [at for at in self.hard if at < half])
        late = self._refined(points, [self.length - at for at in self.hard if at >= half])[:0:-1]
        first, last = np.concatenate([early[:-1], late[:-1]]), np.concatenate([early[1:], late[1:]])
        return first, last, np.arange(len(first)) >= len(early) - 1

    def _refined(self, points: Array, hard: Sequence[float]) -> Array:
        span = 0.5 * self.length * 0.5 ** np.arange(1.0, NEAR)
        extra = [at + side * span for at in hard for side in (-1.0, 1.0)]
        every = np.unique(np.concatenate([points, np.asarray(hard, dtype=float), *extra]))
        return every[(every >= 0.0) & (every <= 0.5 * self.length)]

    @cached_property
    def _times(self) -> Array:
        """Time at which each panel begins, and the end of the last."""
        first, last, late = self._panels
        return np.concatenate([[0.0], np.cumsum(self._time(first, last, late))])

    def _time(self, first: Array, last: Array, late: NDArray[np.bool_]) -> Array:
        """Time between two points of one panel."""
        middle, half = 0.5 * (first + last)[:, None], 0.5 * (last - first)[:, None]
        with np.errstate(all="ignore"):  # where the rate overflows no time passes
            times = np.abs(half) / self._rate(middle + half * self.nodes, late[:, None]) @ self.weights
        return np.where(first == last, 0.0, times)

    def _rate(self, distance: Array, late: NDArray[np.bool_]) -> Array:
        rest = self.length - distance
        return self.rate(np.where(late, rest, distance), np.where(late, distance, rest))

    @property
    def duration(self) -> float:
        """Time in which all but 2^-801 of the path is covered."""
        return float(self._times[-1])

    def position(self, t: Array) -> tuple[Array, Array]:
        """Distances from the start and from the end at the times t."""
        first, last, late = self._panels
        t = np.where(t < SOON, 0.0, t)
        j = np.clip(np.searchsorted(self._times, t, side="right") - 1, 0, len(first) - 1)
        start, stop, from_end = first[j], last[j], late[j]

        def elapsed(share: Array) -> tuple[Array, Array]:
            point = start + share * (stop - start)
            return self._time(start, point, from_end), np.abs(stop - start) / self._rate(point, from_end)

        target = np.minimum(t, self.duration) - self._times[j]
        share = increasing_root(elapsed, target, np.zeros_like(target), np.ones_like(target))
        distance = np.where(t < self.duration, start + share * (stop - start), 0.0)
        rest = self.length - distance
        return np.where(from_end, rest, distance), np.where(from_end, distance, rest)
