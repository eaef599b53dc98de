r"""Divided differences of the exponential, to rounding.

They are what the response of a linear system to an exponential source is made of:
:math:`\int_0^t e^{-\lambda(t-s)}e^{-\gamma s}\,ds = t\,\exp[-\lambda t,-\gamma t]`, and its integral over time is
:math:`t^2\exp[0,-\lambda t,-\gamma t]`. No difference of nearly equal exponentials is ever formed.

Source: McCurdy, Ng & Parlett (1984), Math. Comp. 43, 501-528.
"""

from __future__ import annotations

import numpy as np

from surfacechem.references.base import Array

SERIES_TERMS = 22


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
