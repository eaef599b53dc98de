"""The spring that stands for the stiffness of the bodies."""

from __future__ import annotations

from typing import Any


def stored(k: Any, w: Any, g: Any) -> Any:
    """Elastic energy [J/m^2] of bodies of stiffness `k` [Pa/m], the far field displaced by `w` [m] at the gap `g` [m].

    Of expressions or of arrays.
    """
    return k * (w - g) ** 2 / 2
