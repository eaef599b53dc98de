"""Temperatures of slabs in closed form, for tests of bodies that are divided into cells.

Eigenfunctions of the slab where heat has crossed a part of it, error functions of the half space before: Carslaw &
Jaeger (1959), Conduction of Heat in Solids, sections 2.7, 2.9, 3.4 and 3.11. Lengths in units of the thickness, times
in those of L^2 / alpha.
"""

import numpy as np
from scipy.optimize import brentq
from scipy.special import erfc, erfcx

EARLY = 5e-3
"""Time up to which the far side feels less than 1e-15, and from which forty eigenfunctions are enough."""


def ierfc(z):
    """Integral of the complementary error function."""
    return np.exp(-(z**2)) / np.sqrt(np.pi) - z * erfc(z)


def heated(x, t):
    """Rise by a unit flux into the face of a slab that is insulated behind, shape (times, places)."""
    x, t = np.atleast_1d(x)[None, :], np.atleast_1d(t)[:, None]
    early = 2 * np.sqrt(t) * ierfc(x / (2 * np.sqrt(t)))
    n = np.arange(1, 41)[:, None, None]
    modes = (-1.0) ** n * np.exp(-((n * np.pi) ** 2) * t) * np.cos(n * np.pi * (1 - x)) / (n * np.pi) ** 2
    late = t + (3 * (1 - x) ** 2 - 1) / 6 - 2 * modes.sum(axis=0)
    return np.where(t < EARLY, early, late)


def touched(x, t, biot):
    """Rise from 0 of a slab insulated behind towards 1 that acts on its face through a conductance."""
    x, t = np.atleast_1d(x)[None, :], np.atleast_1d(t)[:, None]
    z = x / (2 * np.sqrt(t))
    early = erfc(z) - np.exp(-(z**2)) * erfcx(z + biot * np.sqrt(t))
    late = np.ones_like(early)
    for n in range(40):
        low, high = n * np.pi, (n + 0.5) * np.pi
        root = brentq(lambda r: r * np.sin(r) - biot * np.cos(r), low, high, xtol=1e-15, rtol=1e-14)
        weight = 4 * np.sin(root) / (2 * root + np.sin(2 * root)) if root else 1.0
        late = late - weight * np.exp(-(root**2) * t) * np.cos(root * (1 - x))
    return np.where(t < EARLY, early, late)
