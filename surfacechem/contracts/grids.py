"""Grids across a body: points from the contact to the far side, as fractions of the thickness."""

from __future__ import annotations

import math
from itertools import pairwise


def graded(cells: int, grading: float = 1.0) -> tuple[float, ...]:
    """Return the points of ``cells`` cells with widths in a geometric series, ``grading`` from the first to the last.

    The mapping is smooth and the same for every number of cells, so that halving the cells shows the error.

    >>> graded(4)
    (0.0, 0.25, 0.5, 0.75, 1.0)
    >>> [round(point, 12) for point in graded(2, grading=9.0)]
    [0.0, 0.25, 1.0]
    """
    if grading == 1.0:
        return tuple(i / cells for i in range(cells + 1))
    s = math.log(grading)
    return (*(math.expm1(s * i / cells) / math.expm1(s) for i in range(cells)), 1.0)


def layered(cells: int, layer: float, both: bool = False) -> tuple[float, ...]:
    """Return the points of cells whose width is proportional to their distance from the contact plus a ``layer``.

    With ``both`` also to the distance from the far side. Layers of every depth from ``layer`` on are then equally well
    resolved. The mapping is smooth and the same for every number of cells.

    >>> [round(point, 12) for point in layered(2, layer=1 / 8)]
    [0.0, 0.25, 1.0]
    >>> [round(point, 12) for point in layered(2, layer=1 / 8, both=True)]
    [0.0, 0.5, 1.0]
    """
    s = e_folds(layer, both)
    if not both:
        return (*(layer * math.expm1(s * i / cells) for i in range(cells)), 1.0)
    ratio = layer / (1 + layer)
    near = [layer * math.expm1(s * i / cells) / (1 + ratio * math.exp(s * i / cells)) for i in range(cells // 2 + 1)]
    return (*near, *(1 - x for x in reversed(near[: (cells + 1) // 2])))


def e_folds(layer: float, both: bool = False) -> float:
    """Return the logarithm of the growth of the cell width, plus that of its decay towards a far side with layers."""
    return math.log1p(1 / layer) * (2 if both else 1)


def volume_shares(at: tuple[float, ...]) -> tuple[float, ...]:
    """Return the volume fraction of each point: half of the cells on either side.

    >>> volume_shares((0.0, 0.25, 1.0))
    (0.125, 0.5, 0.375)
    """
    widths = [b - a for a, b in pairwise(at)]
    return tuple((a + b) / 2 for a, b in zip([0.0, *widths], [*widths, 0.0], strict=True))
