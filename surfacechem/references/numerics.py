r"""Numerical methods accurate to rounding: roots, integrals, autonomous equations, and special functions.

The response of a linear system to an exponential source consists of divided differences of the exponential:
:math:`\int_0^t e^{-\lambda(t-s)}e^{-\gamma s}\,ds = t\,\exp[-\lambda t,-\gamma t]`, and its integral over time is
:math:`t^2\exp[0,-\lambda t,-\gamma t]`. No difference of nearly equal exponentials is ever formed.

Sources: McCurdy, Ng & Parlett (1984), Math. Comp. 43, 501-528 (differences); Abramowitz & Stegun (1964), 5.1
(exponential integrals).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from surfacechem.references.base import Array
from surfacechem.tolerances import FEW_EPS, QUARTER_EPS, SQRT_EPS

MOST_ITERATIONS = 400
"""Largest number of iterations: bisection alone takes 52, and one for each factor of two between the bracket's ends."""

GAUSS_POINTS = 18
"""Gauss points of a panel: a singularity a third of a panel's length away leaves an error of 3^-36 = 7e-18."""

END_QUARTERINGS = 400
"""Number of panels towards each end: the smallest is 2^-801 of the path."""

LEAST_TIME = 1e-300
"""Times [s] below this count as zero."""

PANELS_AT_ONCE = 64
"""Panels that are formed together: most runs end long before the last one."""

INNER_HALVINGS = 60
"""Halvings towards a point inside; distances below 2^-60 of the span are not resolved."""

Rate = Callable[[Array, Array], Array]
"""Rate of the covered distance, as a function of the distances to the start and to the end; positive between them."""


gauss = cache(np.polynomial.legendre.leggauss)
"""Gauss points and weights on [-1, 1], by their number; they must not be written to."""


def increasing_root(
    function: Callable[..., tuple[Array, Array]],
    target: Array,
    low: Array,
    high: Array,
    start: Array | None = None,
    *along: NDArray[Any],
    rounding: Array | None = None,
) -> Array:
    """Return the arguments at which an increasing `function`, given as value and slope, reaches `target` in [low,
    high], or comes as near as the ``rounding`` of the target; ``along`` are its further arguments, one for each root.

    Newton's method inside a shrinking bracket, from `low` unless a better guess is given. Without further arguments all
    roots are of one function: inverse Hermite interpolation between the first values gives the next guess. It ends when
    the next step, predicted by quadratic convergence, is below the last digit, since rounding causes such steps without
    end.

    >>> increasing_root(lambda x: (x**2, 2 * x), np.array([2.0]), np.array([1.0]), np.array([2.0]))
    array([1.41421356])
    """
    x = low if start is None else np.clip(start, low, high)
    rounding = FEW_EPS * np.abs(target) if rounding is None else rounding
    found, left, before = x.copy(), np.arange(len(x)), np.zeros_like(x)
    for _ in range(MOST_ITERATIONS):
        if not len(left):
            return found
        value, slope = function(x, *along)
        error = value - target
        low, high = np.where(error <= 0.0, x, low), np.where(error >= 0.0, x, high)
        with np.errstate(all="ignore"):
            following = x - error / slope
            near = bend = np.full(len(x), np.nan)
            if not along and len(x) > 1:
                near, low, high, bend = _between(x, value, slope, target, low, high)
            # From QUARTER_EPS on two of Newton's steps are enough.
            shared = (near > low) & (near < high) & (np.abs(following - x) > QUARTER_EPS * np.abs(x))
            following = np.where(shared, near, following)
            inside = (following > low) & (following < high)
            following = np.where(inside, following, 0.5 * (low + high))
            # The values of other roots may put x far outside its bracket, whose width then tells nothing of the step.
            step = np.abs(following - x)
            after = step**2 * np.where(np.isnan(bend), step / before**2, bend)
        reached = np.abs(error) <= rounding
        last = inside & (step <= SQRT_EPS * np.abs(x)) & (after <= FEW_EPS * np.abs(x))
        goes_on = ~(reached | (np.minimum(step, high - low) <= FEW_EPS * np.abs(x)) | last)
        x, before = np.where((error == 0.0) | (reached & ~inside), x, following), np.where(shared, 0.0, step)
        found[left] = x
        if not goes_on.all():  # most of the time is that of the function
            left, x, before, low, high = (each[goes_on] for each in (left, x, before, low, high))
            target, rounding = target[goes_on], rounding[goes_on]
            along = tuple(each[goes_on] for each in along)
    raise ArithmeticError(f"no root found between {low} and {high}")


def _between(x: Array, value: Array, slope: Array, target: Array, low: Array, high: Array) -> tuple[Array, ...]:
    """Return guesses for the roots of an increasing function from values and slopes at some points, by cubics through
    two neighbours of each root; smaller brackets; and half the relative change of the slope over x.

    NaN for roots that are not between two points of similar slopes.
    """
    order = np.argsort(value, kind="stable")
    x, value, slope = x[order], value[order], slope[order]
    right = np.searchsorted(value, target)
    is_inside = (right > 0) & (right < len(x))
    right = np.clip(right, 1, len(x) - 1)
    (x_0, x_1), (f_0, f_1), (slope_0, slope_1) = ((each[right - 1], each[right]) for each in (x, value, slope))
    low, high = np.where(is_inside, np.maximum(low, x_0), low), np.where(is_inside, np.minimum(high, x_1), high)
    bend = np.abs(slope_1 - slope_0) / (slope_1 + slope_0) / (x_1 - x_0)
    alike = is_inside & (slope_1 < 2 * slope_0) & (slope_0 < 2 * slope_1)
    guess = hermite(target, (f_0, f_1), (x_0, x_1), (1 / slope_0, 1 / slope_1))
    return np.where(alike, guess, np.nan), low, high, np.where(alike, bend, np.nan)


def hermite(t: Array, times: tuple[Array, Array], values: tuple[Array, Array], slopes: tuple[Array, Array]) -> Array:
    """Return the cubic Hermite polynomials with these values and slopes at two times each.

    >>> float(hermite(np.array(0.5), (np.array(0.0), np.array(1.0)), (np.array(0.0), np.array(1.0)), (0.0, 3.0)))
    0.125
    """
    length, rise = times[1] - times[0], values[1] - values[0]
    part = (t - times[0]) / length
    bend = slopes[0] * length - rise, rise - slopes[1] * length
    return np.asarray(values[0] + part * (rise + (1 - part) * ((1 - part) * bend[0] + part * bend[1])))


def short_integral(function: Callable[[Array], Array], upper: Array) -> Array:
    """Return the integral from zero to `upper` by ten Gauss points, accurate where closed forms cancel.

    >>> f"{float(short_integral(np.exp, np.array(1e-20))):.14e}"
    '1.00000000000000e-20'
    """
    nodes, weights = gauss(10)
    return np.asarray(0.5 * upper * (function(0.5 * np.multiply.outer(upper, 1.0 + nodes)) @ weights))


class AutonomousODE:
    """An autonomous equation of one variable: times along a path of given length by quadrature, and their inverse.

    The variable runs from a start to an end that it may reach or only approach. It is represented by its distances from
    both, so that no digits are lost at either end. Gauss panels shrink geometrically towards both ends and towards any
    point at which the rate nearly vanishes (``hard``): no singularity is closer to a panel than a third of its length.
    """

    def __init__(self, rate: Rate, length: float, hard: Sequence[float] = ()) -> None:
        self.rate, self.length = rate, length
        self.nodes, self.weights = gauss(GAUSS_POINTS)
        half = 0.5 * length
        steps = half * 0.5 ** np.arange(1.0, INNER_HALVINGS)
        quartered = half * 0.25 ** np.arange(END_QUARTERINGS + 1.0)
        edges = []
        for of_end, found in ((False, [x for x in hard if x < half]), (True, [length - x for x in hard if x >= half])):
            with np.errstate(all="ignore"):
                rates = self._rate(quartered, np.full(len(quartered), of_end))
            # Below the last edge at which the rate differs from that at the end, one panel is enough.
            least, most = sorted(float(rates[-1]) * part for part in (1 - FEW_EPS, 1 + FEW_EPS))
            differs = ~((rates >= least) & (rates <= most))
            last = int(np.flatnonzero(np.append(True, differs))[-1])
            near = [x + step for x in found for step in (*-steps, 0.0, *steps)]
            points = np.array([0.0, *quartered[: last + 1], *near])
            edges.append(np.unique(points[(points >= 0.0) & (points <= half)]))
        early, late = edges
        # Distances of a panel are measured from the nearer end: the start in the first half, the end in the second.
        self.first, self.last = np.append(early[:-1], late[:0:-1]), np.append(early[1:], late[-2::-1])
        self.from_end = np.arange(len(self.first)) >= len(early) - 1
        self.slowness, self.times = np.empty((0, GAUSS_POINTS)), np.zeros(1)

    def _reach(self, t: float) -> None:
        """Form the panels up to a time."""
        while (done := len(self.slowness)) < len(self.first) and self.times[-1] <= t:
            rows = slice(done, done + PANELS_AT_ONCE)
            slowness = self._slowness(self.first[rows], self.last[rows], self.from_end[rows])
            self.slowness = np.concatenate((self.slowness, slowness))
            self.times = np.append(self.times, self.times[-1] + np.cumsum(slowness @ self.weights))

    def _slowness(self, first: Array, last: Array, from_end: NDArray[np.bool_]) -> Array:
        """Return the inverse rates at the Gauss points between two points of one panel, in units of half their time
        per distance, shape (intervals, points).
        """
        middle, half = 0.5 * (first + last)[:, None], 0.5 * (last - first)[:, None]
        with np.errstate(all="ignore"):  # zero time where the rate overflows
            slowness = np.abs(half) / self._rate(middle + half * self.nodes, from_end[:, None])
        return np.where(half == 0.0, 0.0, slowness)

    def _rate(self, distance: Array, from_end: NDArray[np.bool_]) -> Array:
        rest = self.length - distance
        return self.rate(np.where(from_end, rest, distance), np.where(from_end, distance, rest))

    @property
    def duration(self) -> float:
        """Time in which all but 2^-801 of the path is covered."""
        self._reach(math.inf)
        return float(self.times[-1])

    def position(self, t: Array) -> tuple[Array, Array]:
        """Return the distances from the start and from the end at the times t."""
        t = np.where(t < LEAST_TIME, 0.0, t)
        self._reach(float(t.max(initial=0.0)))
        end = self.times[-1]
        j = np.clip(np.searchsorted(self.times, t, side="right") - 1, 0, len(self.slowness) - 1)
        start, stop, from_end = panels = self.first[j], self.last[j], self.from_end[j]

        def elapsed(share: Array, start: Array, stop: Array, from_end: NDArray[np.bool_]) -> tuple[Array, Array]:
            point = start + share * (stop - start)
            time = self._slowness(start, point, from_end) @ self.weights
            return time, np.abs(stop - start) / self._rate(point, from_end)

        target, slowness = np.minimum(t, end) - self.times[j], self.slowness[j]
        # The first guess of the share of a panel is of cubics between its Gauss points.
        times, row, shares = slowness @ _running_weights().T, np.arange(len(t)), 0.5 * (1.0 + self.nodes)
        right = np.clip((times < target[:, None]).sum(axis=1), 1, GAUSS_POINTS - 1)
        left = right - 1
        with np.errstate(all="ignore"):
            slopes = 0.5 / slowness[row, left], 0.5 / slowness[row, right]
            guess = hermite(target, (times[row, left], times[row, right]), (shares[left], shares[right]), slopes)
        guess = np.where(target > 0.0, np.nan_to_num(guess), 0.0)
        ends, rounding = (np.zeros_like(target), np.ones_like(target)), FEW_EPS * np.minimum(t, end)
        share = increasing_root(elapsed, target, *ends, guess, *panels, rounding=rounding)
        distance = np.where(t < end, start + share * (stop - start), 0.0)
        rest = self.length - distance
        return np.where(from_end, rest, distance), np.where(from_end, distance, rest)


@cache
def _running_weights() -> Array:
    r"""Return the weights of the integrals from -1 to each Gauss point, shape (points, points).

    They integrate the polynomials :math:`l_j=w_j\sum_k(k+\tfrac12)P_k(x_j)P_k` that are one at a point and zero at the
    others; the integral of :math:`(2k+1)P_k` is :math:`P_{k+1}-P_{k-1}`.
    """
    nodes, weights = gauss(GAUSS_POINTS)
    P = np.polynomial.legendre.legvander(nodes, GAUSS_POINTS).T
    rises = P[1:] - np.concatenate((-np.ones((1, GAUSS_POINTS)), P[:-2]))
    return np.asarray(0.5 * weights * (rises.T @ P[:-1]))


INVERSE_FACTORIALS = [1.0 / math.factorial(k) for k in range(2, 21)]
"""1/2!, 1/3!, ...: within [-1, 1] the first omitted term is 1/21! = 2e-20."""

SERIES_TERMS = 22
"""Terms of the second difference for arguments within [-1, 0]; the first omitted one is 23 / 24! = 4e-23."""

ASYMPTOTIC_TERMS = 38
ASYMPTOTIC_EN, ASYMPTOTIC_EI = 50.0, 40.0
"""Arguments of E_n and Ei above which asymptotic series reach rounding before they diverge: 38! / 40^38 = 7e-17."""


def first_difference(a: Array, b: Array) -> Array:
    r""":math:`\exp[a,b]=(e^a-e^b)/(a-b)`, and :math:`e^a` for equal arguments.

    >>> float(first_difference(np.array(0.0), np.array(-1e-20)))
    1.0
    """
    distance = np.abs(a - b)
    safe = np.where(distance > 0.0, distance, 1.0)
    return np.asarray(np.exp(np.maximum(a, b)) * np.where(distance > 0.0, -np.expm1(-safe) / safe, 1.0))


def second_difference(a: Array, b: Array) -> Array:
    r""":math:`\exp[0,a,b]` for :math:`a,b\le0`.

    >>> float(second_difference(np.array(0.0), np.array(-1e-9)))
    0.4999999998333333
    """
    low, middle = np.minimum(a, b), np.maximum(a, b)
    far = np.where(low < -1.0, low, -1.0)
    apart = (first_difference(middle, np.zeros_like(middle)) - first_difference(low, middle)) / -far
    # Within [-1, 0] the differences cancel: a Taylor series in the complete homogeneous symmetric polynomials of both.
    near_low, near_middle = np.maximum(low, -1.0), np.maximum(middle, -1.0)
    polynomial, power, factorial = np.ones_like(near_low), np.ones_like(near_low), 2.0
    series = polynomial / factorial
    for order in range(1, SERIES_TERMS):
        power = power * near_middle
        polynomial = polynomial * near_low + power
        factorial *= order + 2.0
        series = series + polynomial / factorial
    return np.where(low < -1.0, apart, series)


def remainder(q: Array) -> Array:
    r""":math:`e^{-q}-1+q\ge0` without cancellation, for any q.

    >>> float(remainder(np.array(1e-9)))
    4.999999998333333e-19
    """

    def series(near: Array) -> Array:
        found = np.full(near.shape, INVERSE_FACTORIALS[-1])
        for coefficient in INVERSE_FACTORIALS[-2::-1]:
            found *= near
            np.subtract(coefficient, found, out=found)
        return np.asarray(near**2 * found)

    def apart(far: Array) -> Array:
        with np.errstate(over="ignore"):
            return np.asarray(np.where(far < -40.0, np.exp(np.abs(far)), np.expm1(-np.maximum(far, -40.0)) + far))

    return _by_range(q, np.abs(q) < 1.0, series, apart)


def scaled_expint(n: int, x: Array) -> Array:
    r""":math:`e^xE_n(x)` for x > 0 and n = 1 or 2.

    >>> scaled_expint(1, np.array([1e-3, 1.0, 1e3]))
    array([6.33787407e+00, 5.96347362e-01, 9.99001994e-04])
    """
    from scipy.special import expn

    return _by_range(x, x < ASYMPTOTIC_EN, lambda near: np.exp(near) * expn(n, near), lambda far: _asymptotic(n, far))


def scaled_Ei(x: Array) -> Array:
    r""":math:`e^{-x}{\rm Ei}(x)` for x > 0.

    >>> scaled_Ei(np.array([1.0, 50.0]))
    array([0.69717488, 0.02041705])
    """
    from scipy.special import expi

    # Ei(x) = -E_1(-x)
    return _by_range(x, x < ASYMPTOTIC_EI, lambda near: np.exp(-near) * expi(near), lambda far: -_asymptotic(1, -far))


def _by_range(
    x: Array, below: NDArray[np.bool_], near: Callable[[Array], Array], far: Callable[[Array], Array]
) -> Array:
    """Evaluate two formulas, one where the mask is set and one elsewhere, each only in its range."""
    x = np.asarray(x)
    if below.all():
        return np.asarray(near(x))
    found = np.empty(x.shape)
    for formula, own in ((near, below), (far, ~below)):
        if own.any():  # an evaluation of no values takes as long as one of a few
            found[own] = formula(x[own])
    return found


def _asymptotic(n: int, x: Array) -> Array:
    r"""Return the asymptotic series of :math:`e^xE_n(x)`."""
    inverse = 1.0 / x
    term, total = inverse.copy(), inverse.copy()
    for k in range(n, n + ASYMPTOTIC_TERMS):
        term *= inverse
        term *= -k
        total += term
    return total


SERIES_LIMIT = 0.1
"""Largest argument for which a series of 16 terms is exact: the next term is 0.1^18 / 18, the first 0.1^2 / 2."""


def scaled_rise(severity: Array) -> Array:
    r"""Return the smaller x with :math:`xe^{1-x}=D_0/D_{crit}`, as 1 - v; not above one."""
    almost_one = np.nextafter(1.0, 0.0)
    with np.errstate(divide="ignore"):
        distance = np.abs(np.log1p(severity - 1.0))
        low = np.minimum(2.0 / (1.0 + np.sqrt(1.0 + 2.0 / distance)), almost_one)
    high = np.minimum(np.sqrt(2.0 * distance), almost_one)
    v = increasing_root(lambda v: log_remainder(-v), distance, np.minimum(low, high), high)
    return np.where(v < 0.5, 1.0 - v, severity / math.e * np.exp(1.0 - v))


def log_remainder(x: Array) -> tuple[Array, Array]:
    r"""Return :math:`x-\ln(1+x)`, by its series where the two would cancel, and the size of its slope."""
    near = np.clip(x, -SERIES_LIMIT, SERIES_LIMIT)
    series = sum((-1) ** n * near**n / n for n in range(2, 18))
    return np.where(np.abs(x) < SERIES_LIMIT, series, x - np.log1p(x)), np.abs(x) / (1.0 + x)
