r"""Exponential integrals without the exponential that makes them vanish or overflow.

Source: Abramowitz & Stegun (1964), 5.1.
"""

from __future__ import annotations

import numpy as np
from scipy.special import expn

from surfacechem.references.base import Array

ASYMPTOTIC = 50.0
"""From here on the asymptotic series reaches rounding before it diverges."""


def scaled_expint(n: int, x: Array) -> Array:
    r""":math:`e^xE_n(x)` for x > 0 and n = 1 or 2.

    >>> scaled_expint(1, np.array([1e-3, 1.0, 1e3]))
    array([6.33787407e+00, 5.96347362e-01, 9.99001994e-04])
    """
    near, far = np.minimum(x, ASYMPTOTIC), np.maximum(x, ASYMPTOTIC)
    return np.where(x < ASYMPTOTIC, np.exp(near) * expn(n, near), _asymptotic(n, far))


def _asymptotic(n: int, x: Array) -> Array:
    term, total = 1.0 / x, 1.0 / x
    for k in range(n, n + 30):
        term = -term * k / x
        total = total + term
    return total
