"""Where margins cross zero between two times, for integrators that tell a state at any time of their last step."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from surfacechem.solve.contract import Array

POINTS = 16
"""Points of a step at which margins are looked at."""

LEAST = 4 * float(np.finfo(float).eps)
"""Part of the time to which zeros are found."""


def crossings(
    margins: Callable[[float], Array], sides: Array, directions: Array, low: float, high: float
) -> dict[int, float]:
    """Times at which margins cross zero first between two times, by position; empty where none does.

    ``sides`` are the signs of the margins on the way, 0 for what is to be left alone until it has left zero, and are
    kept up; ``directions`` are -1 for falling, 1 for rising, 0 for both.
    """
    for t in np.linspace(low, high, POINTS + 1)[1:].tolist():
        values = margins(t)
        crossing = np.flatnonzero(_crosses(sides, values, directions)).tolist()
        if crossing:
            return {i: _zero(margins, i, low, t) for i in crossing}
        np.copyto(sides, np.sign(values), where=values != 0.0)
        low = t
    return {}


def _crosses(sides: Array, values: Array, directions: Array) -> NDArray[np.bool_]:
    """Which margins have changed their side, in a direction that counts."""
    falls = (sides > 0) & (values <= 0) & (directions <= 0)
    return falls | ((sides < 0) & (values >= 0) & (directions >= 0))


def _zero(margins: Callable[[float], Array], i: int, low: float, high: float) -> float:
    """Zero in the bracket; its lower end where a margin starts on the far side already."""
    at_low, at_high = (float(margins(t)[i]) for t in (low, high))
    if at_low * at_high >= 0.0:
        return high if at_high == 0.0 else float(np.nextafter(low, high))
    return float(brentq(lambda t: float(margins(t)[i]), low, high, xtol=1e-300, rtol=LEAST))
