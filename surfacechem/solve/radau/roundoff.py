"""Roundoff of the residual and its effect on the solution of one step.

Where large terms of an equation cancel, the residual is known only to the roundoff of those terms, and no correction or
error estimate can be smaller than its image under the inverse Newton matrix. This floor is computed only when a step is
about to fail, so smooth runs do not pay for it.
"""

from typing import Any

import numpy as np

from surfacechem.solve.radau.linear import LARGE_MATRIX, bound_real, solve_real
from surfacechem.solve.radau.tables import GAMMA
from surfacechem.solve.radau.work import RESIDUAL, clear, compiled, evaluate, set_inputs
from surfacechem.tolerances import GUARD_EPS, NEGLIGIBLE, SINGULAR_NOISE, ULPS

FIFTH_DIFFERENCE = np.array([1.0, -5.0, 10.0, -10.0, 5.0, -1.0]) / np.sqrt(252.0)
"""Coefficients of a fifth difference, scaled so that it has the size of independent errors of the values."""

WINDOWS, TIME_SPACING = 3, NEGLIGIBLE
"""Number of differences, and the least spacing of their times as a part of the step."""

MAGNIFIED = 10.0
"""Noise of the error estimate, which extrapolates the noise of every stage, in units of the noise of one residual."""


@compiled
def measure_differences(w: Any, y: Any, ydot: Any) -> None:
    """Take fifth differences of the equations over neighbouring times: zero for smooth equations, but not for roundoff
    of their loads.

    Over times that count as equal, loads change by no more than their roundoff, which steps much shorter do not sample.

    Source: Hamming (1973), Numerical Methods for Scientists and Engineers, noise by differences.
    """
    t, n = w.inputs[0], w.n
    spacing = max(TIME_SPACING * w.h_factored, GUARD_EPS * (w.elapsed + (w.arc_start + t)))
    clear(w.differences)
    for row in range(WINDOWS):
        clear(w.difference_sums[row])
    set_inputs(w, y, ydot)
    for k in range(WINDOWS + FIFTH_DIFFERENCE.shape[0] - 1):
        w.inputs[0] = t + k * spacing
        evaluate(w, RESIDUAL, w.differences_now)
        for row in range(WINDOWS):
            if 0 <= k - row < FIFTH_DIFFERENCE.shape[0]:
                for i in range(n):
                    w.difference_sums[row, i] += FIFTH_DIFFERENCE[k - row] * w.differences_now[i]
    for row in range(WINDOWS):
        for i in range(n):
            w.differences[i] = max(w.differences[i], abs(w.difference_sums[row, i]))
    w.inputs[0] = t


@compiled
def rounding_of(w: Any, i: int, y: Any, ydot: Any) -> float:
    """Roundoff of one equation of the core."""
    total = 0.0
    for j in range(w.core):
        total += abs(w.jacobian[0, i, j] * y[j]) + abs(w.jacobian[1, i, j] * ydot[j])
    border = 0.0
    for c in range(w.links):
        j = w.chains[c, 0]
        border += abs(w.border_derivatives[0, i, c] * y[j])
        border += abs(w.border_derivatives[1, i, c] * ydot[j])
    return float(max(ULPS * (total + border), w.differences[i]))


@compiled
def spread_noise(w: Any, y: Any, ydot: Any) -> None:
    """Compute the change of each variable that roundoff of the residuals at a state can cause, into ``noise``.

    The terms of an equation are as large as its derivatives times their variables.
    """
    n, core, column = w.n, w.core, w.delta
    measure_differences(w, y, ydot)
    for j in range(n):
        w.noise[j] = ULPS * abs(y[j])
    for i in range(core if w.links == 0 else core + 1):
        clear(column)
        if i < core:
            column[i] = rounding_of(w, i, y, ydot)
        else:
            # Heat entering a chain anywhere raises all its temperatures: nothing cancels in a single sum.
            _chain_noise(w, y, ydot, column)
        solve_real(w, column)
        for j in range(n):
            w.noise[j] += abs(column[j])


@compiled
def _chain_noise(w: Any, y: Any, ydot: Any, column: Any) -> None:
    """Write the roundoff of the equations of all chains into their entries of the column."""
    for c in range(w.links):
        first, end, anchor = w.chains[c, 0], w.chains[c, 1], w.chains[c, 2]
        for i in range(first, end):
            total = 0.0
            for side in range(3):
                j = anchor if side == 0 and i == first else i + side - 1
                if 0 <= j < end:
                    total += abs(w.band_derivatives[0, i - w.core, side] * y[j])
                    total += abs(w.band_derivatives[1, i - w.core, side] * ydot[j])
            column[i] = ULPS * total


@compiled
def _bounds_serve(w: Any) -> bool:
    """Write bounds of the noise at the start of a step, from one solve instead of one for each variable.

    True if their effect on the error estimate is negligible compared with the tolerance.
    """
    measure_differences(w, w.y, w.ydot)
    for i in range(w.n):
        w.delta[i] = rounding_of(w, i, w.y, w.ydot)
    bound_real(w, w.delta)
    for j in range(w.n):
        w.noise[j] = ULPS * abs(w.y[j]) + w.delta[j]
        if not MAGNIFIED * w.noise[j] <= NEGLIGIBLE * w.weight[j]:
            return False
    return True


@compiled
def find_noise(w: Any) -> None:
    """Compute the largest change of each variable at the start of the step that roundoff can cause, into ``noise``."""
    if w.explicit != 0:  # no division by a small number
        for j in range(w.n):
            w.noise[j] = ULPS * abs(w.y[j])
        return
    if w.core >= LARGE_MATRIX and w.links == 0 and _bounds_serve(w):
        return
    spread_noise(w, w.y, w.ydot)
    for j in range(w.n):
        w.noise[j] = min(w.noise[j], _most_noise(w, j))


@compiled
def _most_noise(w: Any, j: int) -> float:
    return float(max(SINGULAR_NOISE * w.scale[j], w.atol[j] / w.rtol))


@compiled
def correction_is_noise(w: Any, stages: int) -> bool:
    """True if Newton's last correction, kept in g, is no larger than the noise, magnified by the method, or negligible.

    Elimination rounds small components in units of large ones, which no noise of the equations explains.
    """
    magnified = 2.0 * GAMMA[w.member]
    # Usually it exceeds any possible noise, and finding the noise takes a solve for each variable.
    for i in range(stages):
        for j in range(w.n):
            if w.explicit == 0 and not abs(w.g[i, j]) <= magnified * _most_noise(w, j):
                return False
    find_noise(w)
    for i in range(stages):
        for j in range(w.n):
            if not abs(w.g[i, j]) <= max(magnified * w.noise[j], NEGLIGIBLE * w.weight[j]):
                return False
    return True
