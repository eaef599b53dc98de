"""The ledger along a step of a library's method."""

import numpy as np

from surfacechem.solve.contract import Array

NODES = np.array([0.0, 0.11747233803526766, 0.35738424175967742, 0.64261575824032258, 0.88252766196473235, 1.0])
"""Gauss-Lobatto points of a step: the polynomials of the libraries have order five at most."""

TO_POWERS = np.linalg.inv(np.vander(NODES, increasing=True)) / np.arange(1.0, len(NODES) + 1)[:, None]
"""From values at the nodes to the coefficients of the integral of their polynomial."""


class StepLedger:
    """The ledger along a step, from its rates at the nodes.

    Quadratures stay outside the library: it would have to count them in its error norm to integrate them well, and a
    state at rest, which needs no steps, may do work all the same.
    """

    def __init__(self, start: float, size: float, ledger: Array, rates: Array) -> None:
        self.start, self.size, self.ledger = start, size, ledger
        self.coefficients = TO_POWERS @ rates * size

    def at(self, t: float) -> Array:
        """The ledger at a time within the step."""
        part = (t - self.start) / self.size if self.size else 0.0
        return np.asarray(self.ledger + part ** np.arange(1.0, len(NODES) + 1) @ self.coefficients)
