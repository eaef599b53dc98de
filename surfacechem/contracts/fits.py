"""Piecewise polynomial fits of functions of temperature without a formula, within a verified error.

A property of a fluid is smooth except at kinks, where a correlation ends or a critical enhancement fades. Pieces are as
long as possible, so that kinks lie between them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

DEGREE = 10
"""Degree of each polynomial."""

MOST_PIECES = 12
"""Most pieces of a fit."""

FIT_ACCURACY = 2e-9
"""Largest relative error at the points of verification; between them it is of the same size."""

CRITICAL_ACCURACY = 1000 * FIT_ACCURACY
"""The same near a critical point, where published equations of state and their solvers are not smooth to FIT_ACCURACY;
it is far below the uncertainty of any property there."""

CHECKS_PER_COEFFICIENT = 5
"""Points of verification per coefficient."""

KINK_RESOLUTION = 1e-7
"""Accuracy to which kinks are located, as a fraction of the range."""


class NoFitError(ValueError):
    """The function has no piecewise polynomial of the required accuracy."""


class Piece(NamedTuple):
    """A polynomial on low <= T <= high; its coefficients are those of powers of x = (2 T - low - high)/(high - low)."""

    low: float
    high: float
    coefficients: tuple[float, ...]

    def __call__(self, T: Array) -> Array:
        """Return values at T."""
        x = (2 * T - self.low - self.high) / (self.high - self.low)
        return np.asarray(np.polynomial.polynomial.polyval(x, np.array(self.coefficients)))


def fit(function: Callable[[Array], Array], low: float, high: float, target: float = FIT_ACCURACY) -> tuple[Piece, ...]:
    """Fit the function on low <= T <= high, relative error below a target; NoFitError if too many pieces are needed.

    >>> pieces = fit(lambda T: np.exp(600 / T), 280.0, 360.0)
    >>> len(pieces), bool(abs(pieces[0](300.0) / np.exp(2) - 1) < 1e-10)
    (1, True)
    """
    pieces: list[Piece] = []
    start = low
    while start < high:
        if len(pieces) == MOST_PIECES:
            raise NoFitError(f"more than {MOST_PIECES} polynomials would be needed between {low:g} and {high:g} K.")
        pieces.append(_polynomial(function, start, high, target) or _longest(function, start, high, target))
        start = pieces[-1].high
    return tuple(pieces)


def _padded(powers: ArrayLike) -> tuple[float, ...]:
    given = [float(power) for power in np.asarray(powers, dtype=float)]
    return (*given, *[0.0] * (DEGREE + 1 - len(given)))


def _longest(function: Callable[[Array], Array], low: float, high: float, target: float) -> Piece:
    """Return the longest piece from low on; it ends just beyond a kink, so that the next one starts behind the kink."""
    good, bad, found = low, high, None  # bisection: a piece that ends before a kink fits, one beyond it does not
    while bad - good > KINK_RESOLUTION * (high - low):
        middle = (good + bad) / 2
        piece = _polynomial(function, low, middle, target)
        if piece is None:
            bad = middle
        else:
            good, found = middle, piece
    if found is None:
        raise NoFitError(f"it is not smooth at {low:g} K.")
    # The same polynomial, extended to the upper end of the bracket.
    width = found.high - low
    x = np.polynomial.Polynomial([(low + bad - found.low - found.high) / width, (bad - low) / width])
    return Piece(low, bad, _padded(np.polynomial.Polynomial(np.array(found.coefficients))(x).coef))


def _polynomial(function: Callable[[Array], Array], low: float, high: float, target: float) -> Piece | None:
    """Return the polynomial through the Chebyshev nodes; None if its error elsewhere exceeds the target."""
    nodes = np.cos(np.pi * (np.arange(DEGREE + 1) + 0.5) / (DEGREE + 1))
    values = function((low + high) / 2 + (high - low) / 2 * nodes)
    powers = chebyshev.cheb2poly(chebyshev.chebfit(nodes, values, DEGREE))
    piece = Piece(low, high, _padded(powers))
    # Also between the nodes, where the error of interpolation is largest.
    T = np.linspace(low, high, CHECKS_PER_COEFFICIENT * (DEGREE + 1) + 1)
    exact = function(T)
    return piece if bool(np.all(np.abs(piece(T) - exact) <= target * np.abs(exact))) else None
