r"""The principal branch of Lambert's W for arguments beyond the range of doubles.

Source: Corless, Gonnet, Hare, Jeffrey & Knuth (1996), Adv. Comput. Math. 5, 329-359.
"""

from __future__ import annotations

import numpy as np

from surfacechem.references._roots import increasing_root
from surfacechem.references.base import Array


def lambert_of_exp(a: Array) -> Array:
    r""":math:`W_0(e^a)`, the w > 0 with :math:`w+\ln w=a`, for any a.

    >>> lambert_of_exp(np.array([1.0, 1e4]))
    array([1.00000000e+00, 9.99079058e+03])
    """
    low, high = np.minimum(a, 1.0), np.maximum(a, 1.0)
    small = np.exp(increasing_root(_of_logarithm, low, low - np.exp(low), low))
    large = increasing_root(_of_w, high, 0.5 * (1.0 + high), high)
    return np.where(a < 1.0, small, large)


def _of_logarithm(s: Array) -> tuple[Array, Array]:
    return s + np.exp(s), 1.0 + np.exp(s)


def _of_w(w: Array) -> tuple[Array, Array]:
    return w + np.log(w), 1.0 + 1.0 / w
