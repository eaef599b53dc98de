r"""Special functions whose arguments overflow or whose values cancel in their usual form.

Divided differences of the exponential are what the response of a linear system to an exponential source is made of:
:math:`\int_0^t e^{-\lambda(t-s)}e^{-\gamma s}\,ds = t\,\exp[-\lambda t,-\gamma t]`, and its integral over time is
:math:`t^2\exp[0,-\lambda t,-\gamma t]`. No difference of nearly equal exponentials is ever formed.

Sources: McCurdy, Ng & Parlett (1984), Math. Comp. 43, 501-528 (differences); Abramowitz & Stegun (1964), 5.1
(exponential integrals); Corless, Gonnet, Hare, Jeffrey & Knuth (1996), Adv. Comput. Math. 5, 329-359 (Lambert's W).
"""

from __future__ import annotations

import numpy as np

from surfacechem.references._inversion import increasing_root
from surfacechem.references.base import Array

SERIES_TERMS = 22
"""Of the second difference for arguments within [-1, 0]; those left out begin with 23 / 24! = 4e-23."""

ASYMPTOTIC_TERMS = 38
CONVERGENT_TERMS = 160
"""Of Ei up to FAR_EI; those left out begin with 40^160 / (160 160!) = 3e-31, against e^40 / 40 = 6e15."""

FAR, FAR_EI = 50.0, 40.0
"""Arguments of E_n and Ei from which on asymptotic series reach rounding before they diverge: 38! / 40^38 = 7e-17."""


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
    return np.where(low < -1.0, apart, _second_difference_series(np.maximum(low, -1.0), np.maximum(middle, -1.0)))


def _second_difference_series(a: Array, b: Array) -> Array:
    """Taylor series in the complete homogeneous symmetric polynomials of a and b, for arguments within [-1, 0]."""
    polynomial, power, factorial = np.ones_like(a), np.ones_like(a), 2.0
    total = polynomial / factorial
    for order in range(1, SERIES_TERMS):
        power = power * b
        polynomial = polynomial * a + power
        factorial *= order + 2.0
        total = total + polynomial / factorial
    return total


def remainder(q: Array) -> Array:
    r""":math:`e^{-q}-1+q\ge0` without cancellation, for any q.

    >>> float(remainder(np.array(1e-9)))
    4.999999998333333e-19
    """
    p = np.abs(q)
    near = np.minimum(p, 1.0)
    falling = near**2 * second_difference(np.zeros_like(near), -near)
    rising = near**2 * np.exp(near) * second_difference(-near, -near)
    with np.errstate(over="ignore"):
        far = np.where(q < -40.0, np.exp(p), np.expm1(-np.maximum(q, -40.0)) + q)
    return np.where(p < 1.0, np.where(q < 0.0, rising, falling), far)


def scaled_expint(n: int, x: Array) -> Array:
    r""":math:`e^xE_n(x)` for x > 0 and n = 1 or 2.

    >>> scaled_expint(1, np.array([1e-3, 1.0, 1e3]))
    array([6.33787407e+00, 5.96347362e-01, 9.99001994e-04])
    """
    from scipy.special import expn

    near, far = np.minimum(x, FAR), np.maximum(x, FAR)
    return np.where(x < FAR, np.exp(near) * expn(n, near), _asymptotic(n, far))


def scaled_Ei(x: Array) -> Array:
    r""":math:`e^{-x}{\rm Ei}(x)` for x > 0.

    >>> scaled_Ei(np.array([1.0, 50.0]))
    array([0.69717488, 0.02041705])
    """
    near, far = np.minimum(x, FAR_EI), np.maximum(x, FAR_EI)
    term, total = np.ones_like(near), np.zeros_like(near)
    for n in range(1, CONVERGENT_TERMS):
        term = term * near / n
        total = total + term / n
    convergent = np.exp(-near) * (np.euler_gamma + np.log(near) + total)
    return np.where(x < FAR_EI, convergent, -_asymptotic(1, -far))  # Ei(x) = -E_1(-x)


def _asymptotic(n: int, x: Array) -> Array:
    r"""Asymptotic series of :math:`e^xE_n(x)`."""
    term, total = 1.0 / x, 1.0 / x
    for k in range(n, n + ASYMPTOTIC_TERMS):
        term = -term * k / x
        total = total + term
    return total


def lambert_of_exp(a: Array) -> Array:
    r""":math:`W_0(e^a)`, the w > 0 with :math:`w+\ln w=a`, for any a.

    >>> lambert_of_exp(np.array([1.0, 1e4]))
    array([1.00000000e+00, 9.99079058e+03])
    """
    low, high = np.minimum(a, 1.0), np.maximum(a, 1.0)
    small = np.exp(increasing_root(lambda s: (s + np.exp(s), 1.0 + np.exp(s)), low, low - np.exp(low), low))
    large = increasing_root(lambda w: (w + np.log(w), 1.0 + 1.0 / w), high, 0.5 * (1.0 + high), high)
    return np.where(a < 1.0, small, large)
