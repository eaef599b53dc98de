"""What rounding errors of the residual do to the solution of one step.

Where large terms of an equation cancel, the residual is known only to the rounding of those terms, and no correction
or error estimate can be smaller than its image under the inverse Newton matrix. The floor is found when a step is
about to fail, so smooth runs do not pay for it.
"""

from typing import Any

import numpy as np

from surfacechem.solve.radau.linear import solve_real
from surfacechem.solve.radau.tables import GAMMA
from surfacechem.solve.radau.work import (
    ATOL,
    DELTA,
    H_FACTORED,
    MEMBER,
    NOISE,
    RESIDUAL,
    RTOL,
    SCALE,
    WOBBLE,
    WOBBLE_NOW,
    WOBBLE_SUMS,
    YDOT,
    Y,
    clear,
    compiled,
    evaluate,
    set_inputs,
)
from surfacechem.tolerances import NEGLIGIBLE, ULPS

DIFFERENCE = np.array([1.0, -5.0, 10.0, -10.0, 5.0, -1.0]) / np.sqrt(252.0)
"""A fifth difference of values with independent errors has their size."""

WINDOWS, NEAR = 3, NEGLIGIBLE
"""Differences that are taken, and how far apart their times are as parts of a step."""

LARGEST = NEGLIGIBLE**2
"""Noise above this part of a variable, and of what it typically is, would mean a singular matrix, not rounding."""


@compiled
def _measure_wobble(w: Any, y: int, ydot: int) -> None:
    """Fifth differences of the equations over neighbouring times: smooth ones have none, rounding of their loads does.

    Source: Hamming (1973), Numerical Methods for Scientists and Engineers, noise by differences.
    """
    t, n = w.inputs[0], w.algebraic.shape[0]
    clear(w.vector[WOBBLE])
    for row in range(WINDOWS):
        clear(w.vector[WOBBLE_SUMS + row])
    set_inputs(w, w.vector[y], w.vector[ydot])
    for k in range(WINDOWS + DIFFERENCE.shape[0] - 1):
        w.inputs[0] = t + k * NEAR * w.clock[H_FACTORED]
        evaluate(w, RESIDUAL, w.vector[WOBBLE_NOW].ctypes.data)
        for row in range(WINDOWS):
            if 0 <= k - row < DIFFERENCE.shape[0]:
                for i in range(n):
                    w.vector[WOBBLE_SUMS + row, i] += DIFFERENCE[k - row] * w.vector[WOBBLE_NOW, i]
    for row in range(WINDOWS):
        for i in range(n):
            w.vector[WOBBLE, i] = max(w.vector[WOBBLE, i], abs(w.vector[WOBBLE_SUMS + row, i]))
    w.inputs[0] = t


@compiled
def _row_noise(w: Any, i: int, y: int, ydot: int) -> float:
    """Rounding error of equation i, whose terms are as large as its derivatives times their variables."""
    total = 0.0
    for j in range(w.jacobian.shape[1]):
        total += abs(w.jacobian[0, i, j] * w.vector[y, j]) + abs(w.jacobian[1, i, j] * w.vector[ydot, j])
    if w.chains.shape[0] > 0:
        total += _border_noise(w, i)
    return max(ULPS * total, w.vector[WOBBLE, i])


@compiled
def _border_noise(w: Any, i: int) -> float:
    total = 0.0
    for c in range(w.chains.shape[0]):
        j = w.chains[c, 0]
        total += abs(w.border_derivatives[0, i, c] * w.vector[Y, j])
        total += abs(w.border_derivatives[1, i, c] * w.vector[YDOT, j])
    return total


@compiled
def _chain_noise(w: Any, column: Any) -> None:
    """Rounding errors of the equations of all chains, into their places in the column."""
    core = w.jacobian.shape[1]
    for c in range(w.chains.shape[0]):
        first, end, anchor = w.chains[c, 0], w.chains[c, 1], w.chains[c, 2]
        for i in range(first, end):
            total = 0.0
            for side in range(3):
                j = anchor if side == 0 and i == first else i + side - 1
                if 0 <= j < end:
                    total += abs(w.band_derivatives[0, i - core, side] * w.vector[Y, j])
                    total += abs(w.band_derivatives[1, i - core, side] * w.vector[YDOT, j])
            column[i] = ULPS * total


@compiled
def spread_noise(w: Any, y: int, ydot: int) -> None:
    """Change of each variable that rounding errors of the residuals at these states can cause, into NOISE."""
    n = w.algebraic.shape[0]
    column = w.vector[DELTA]
    _measure_wobble(w, y, ydot)
    for j in range(n):
        w.vector[NOISE, j] = ULPS * abs(w.vector[y, j])
    core = w.jacobian.shape[1]
    for i in range(core if w.chains.shape[0] == 0 else core + 1):
        clear(column)
        if i < core:
            column[i] = _row_noise(w, i, y, ydot)
        else:
            # Heat that enters a chain anywhere raises its temperatures everywhere: nothing cancels in one sum.
            _chain_noise(w, column)
        solve_real(w, column)
        for j in range(n):
            w.vector[NOISE, j] += abs(column[j])


@compiled
def find_noise(w: Any) -> None:
    """Largest change of each variable at the start of the step that rounding errors can cause, into NOISE."""
    spread_noise(w, Y, YDOT)
    for j in range(w.algebraic.shape[0]):
        most = max(LARGEST * w.vector[SCALE, j], w.vector[ATOL, j] / w.clock[RTOL])
        w.vector[NOISE, j] = min(w.vector[NOISE, j], most)


@compiled
def correction_is_noise(w: Any, stages: int) -> bool:
    """Whether Newton's last correction, kept in g, is no larger than the noise, magnified by the method."""
    find_noise(w)
    for i in range(stages):
        for j in range(w.algebraic.shape[0]):
            if not abs(w.g[i, j]) <= 2.0 * GAMMA[w.count[MEMBER]] * w.vector[NOISE, j]:
                return False
    return True
