"""Consistent states: rates of the differential variables and values of the algebraic variables from G(t, y, ydot) = 0.

All unknowns are found by one damped Newton iteration. Its matrix has the column of G_ydot for a differential variable
and that of G_y for an algebraic one; it is regular exactly when the system has index one.
"""

from typing import Any

import numpy as np

from surfacechem.solve.radau.linear import factor, fold_chains, solve_real
from surfacechem.solve.radau.roundoff import measure_differences, rounding_of
from surfacechem.solve.radau.work import RESIDUAL, any_true, compiled, evaluate, evaluate_jacobian, finite, set_inputs
from surfacechem.tolerances import FEW_EPS, NEGLIGIBLE, SQRT_EPS, TINY

CONSISTENT, NO_STATE, SINGULAR_STATE, NOT_FINITE_STATE = range(4)
LIMIT = 100
CONVERGING = NEGLIGIBLE * SQRT_EPS
"""Correction after which the next one, being quadratic in it, is below EPS even with a factor of a million."""
FAR = 1.0 / NEGLIGIBLE**2
"""Multiple of a correction for the linearity test: the roundoff of one correction is negligible compared with it."""
SMALLEST_PIVOT = FEW_EPS
"""Scaled pivot at the roundoff of zero."""


@compiled
def _residual(w: Any) -> bool:
    """Write the residual at the trial state to the right-hand side; True if it is finite."""
    set_inputs(w, w.trial, w.trial_dot)
    evaluate(w, RESIDUAL, w.rhs)
    return bool(finite(w.rhs))


@compiled
def _fold(w: Any) -> bool:
    """Eliminate the chains from the matrix of the unknowns; the unknowns of a chain are its rates."""
    core = w.core
    for c in range(w.links):
        anchor = w.chains[c, 2]
        for i in range(core):
            w.real_border[i, c] = w.border_derivatives[1, i, c]
        for i in range(w.chains[c, 0] - core, w.chains[c, 1] - core):
            for side in range(3):
                w.real_bands[i, side] = w.band_derivatives[1, i, side]
            w.columns[core + i] = 1.0
        if anchor >= 0 and w.algebraic[anchor]:
            w.real_bands[w.chains[c, 0] - core, 0] = w.band_derivatives[0, w.chains[c, 0] - core, 0]
    return bool(fold_chains(w.real, w.real_border, w.real_bands, w.chains))


@compiled
def _factor(w: Any) -> bool:
    """Factor the matrix of the unknowns, each column in units of the sum of its entries relative to their rows."""
    n = w.core
    evaluate_jacobian(w)
    for i in range(n):
        for j in range(n):
            w.real[i, j] = w.jacobian[0 if w.algebraic[j] else 1, i, j]
    # Unknowns may differ by forty decades, and so may equations: compare entries relative to their rows. By the sum an
    # equation of one unknown is its pivot, rather than an equation in which it is the largest of several.
    for i in range(n):
        w.delta[i] = 0.0
        for j in range(n):
            w.delta[i] = max(w.delta[i], abs(w.real[i, j]))
    for j in range(n):
        total = 0.0
        for i in range(n):
            total += abs(w.real[i, j]) / w.delta[i] if w.delta[i] > 0.0 else 0.0
        w.columns[j] = 1.0 / total if total > 0.0 else 1.0
    if w.links > 0 and not _fold(w):
        return False
    return bool(factor(w.real, w.order[0], w.places[0], w.columns, w.delta, w.entries, SMALLEST_PIVOT))


@compiled
def _correction(w: Any, delta: Any) -> float:
    """Compute the Newton correction for the present residual; return its size in the algebraic variables."""
    norm = 0.0
    for j in range(w.n):
        delta[j] = -w.rhs[j]
    solve_real(w, delta)
    for j in range(w.n):
        if w.algebraic[j]:
            norm = max(norm, abs(delta[j]) / (abs(w.trial[j]) + abs(delta[j]) + TINY))
    return norm


@compiled
def _move(w: Any, delta: Any, fraction: float) -> None:
    """Move the unknowns along a correction: the algebraic variables, and the rates of the others."""
    for j in range(w.n):
        if w.algebraic[j]:
            w.trial[j] += fraction * delta[j]
        else:
            w.trial_dot[j] += fraction * delta[j]


@compiled
def _size(w: Any, delta: Any, unit: Any) -> float:
    """Return the size of a correction of the algebraic variables in these units, NaN included."""
    norm = 0.0
    for j in range(w.n):
        if w.algebraic[j] and not abs(delta[j]) / unit[j] <= norm:
            norm = abs(delta[j]) / unit[j]
    return norm


@compiled
def _damped(w: Any, delta: Any) -> bool:
    """Move as far along the correction as the next one by the same matrix does not grow; False if it always does.

    Residuals cannot be the measure: those of rates scale with the inverse of a possibly small coefficient, and are
    linear anyway. Source: Deuflhard (2011), Newton Methods for Nonlinear Problems, section 2.1, the natural
    monotonicity test.
    """
    following, unit = w.g[1], w.error  # memory of the step, unused here
    for j in range(w.n):
        unit[j] = abs(w.trial[j]) + abs(delta[j]) + TINY
    before = _size(w, delta, unit)
    fraction = 1.0
    # Forty halvings reach 1e-12 of the correction, a negligible move.
    _move(w, delta, 1.0)
    for _halving in range(40):
        if _residual(w):
            _correction(w, following)
            if _size(w, following, unit) <= before:
                return True
        fraction *= 0.5
        _move(w, delta, -fraction)
    return False


@compiled
def _is_rounding(w: Any, delta: Any) -> bool:
    """True if a correction that does not decrease is roundoff: if the equations are linear far along it, a correction
    solves them, and only roundoff is left.
    """
    _move(w, delta, FAR)
    straight = _residual(w)
    _correction(w, w.g[1])  # memory of the step, unused here
    _move(w, delta, -FAR)
    for j in range(w.n):
        small = NEGLIGIBLE * FAR * (abs(delta[j]) + FEW_EPS * abs(w.trial[j]))
        straight = straight and (not w.algebraic[j] or abs(w.g[1, j] + (FAR - 1.0) * delta[j]) <= small)
    return bool(straight)


@compiled
def _ends_in_roundoff(w: Any, delta: Any, norm: float) -> bool:
    """True if corrections of this size that do not decrease are roundoff, or if all equations hold within roundoff of
    their terms: corrections tell nothing then, as those of a velocity beside zero, where friction has a kink.
    """
    if norm <= SQRT_EPS or _is_rounding(w, delta):
        return True
    solved = w.links == 0 and _residual(w)
    if solved:
        measure_differences(w, w.trial, w.trial_dot)
        for i in range(w.n):
            solved = solved and abs(w.rhs[i]) <= rounding_of(w, i, w.trial, w.trial_dot)
    return bool(solved)


@compiled
def find_consistent(w: Any) -> int:
    """Make the trial state consistent at the time in the inputs."""
    if not _residual(w):
        return NOT_FINITE_STATE
    delta = w.g[0]
    nonlinear = any_true(w.algebraic)
    norm_last = np.inf
    for _iteration in range(LIMIT):
        if not _factor(w):
            return SINGULAR_STATE
        norm = _correction(w, delta)
        if not finite(delta):
            return SINGULAR_STATE
        # The system is linear in the derivatives: without algebraic variables one correction is exact.
        if not nonlinear or norm <= FEW_EPS or norm_last <= CONVERGING:
            _move(w, delta, 1.0)
            return CONSISTENT if _residual(w) else NOT_FINITE_STATE
        if norm >= norm_last and _is_rounding(w, delta):
            return CONSISTENT
        if not _damped(w, delta):
            # At roundoff level the corrections no longer decrease.
            break
        norm_last = norm
    return CONSISTENT if _ends_in_roundoff(w, delta, norm) else NO_STATE
