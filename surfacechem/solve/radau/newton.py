"""Simplified Newton iteration for the stage increments Z_i = Y_i - y_n of one Radau IIA step.

Each stage requires G(t_i, y_n + Z_i, (1/h) sum_j (A^-1)_ij Z_j) = 0. In the eigenbasis of A^-1 the Newton matrix splits
into one real and (s-1)/2 complex matrices (lambda/h) G_ydot + G_y of the size of the state.
"""

from typing import Any

import numpy as np

from surfacechem.solve.radau import tables
from surfacechem.solve.radau.explicit import put_rates
from surfacechem.solve.radau.linear import (
    LARGE_MATRIX,
    count_entries_of_rows,
    factor,
    factor_again,
    fold_chains,
    shifted,
    solve_complex,
    solve_real,
)
from surfacechem.solve.radau.roundoff import correction_is_noise
from surfacechem.solve.radau.work import (
    RESIDUAL,
    clear,
    combine,
    compiled,
    copy,
    evaluate,
    evaluate_jacobian,
    finite,
    put,
)
from surfacechem.tolerances import EPS, NEGLIGIBLE, NEWTON_EPS, TINY

CONVERGED, OPEN, DIVERGED, NOT_FINITE = range(4)
"""Outcomes of Newton's method; open where corrections are small, but equations may have become so much softer than its
matrix that this tells nothing.
"""

NEWTON_PART = NEGLIGIBLE
"""Newton error allowed, in units of the tolerance. The order of the method makes steps more accurate than the
tolerance, so a looser limit would dominate the error; and a Jacobian taken where the equations are far stiffer than at
the solution makes the corrections small before the residual is.
"""

FORESEEN_GROWTH = 1.5
"""Largest ratio of a step to the one before for which the predictor is good enough to differentiate in mid-step."""

PREDICTOR_REACH = 30.0
"""Largest ratio of a step to the one before up to which its polynomial is extrapolated."""

STIFFER = 3.0
"""Largest accepted ratio of the derivatives at the predicted state to those at the start of the step."""

SLOWEST_KNOWN = 0.02
"""Least contraction assumed: a component that converges at once hides a slower one behind its first correction."""

TRUST = 0.8
"""Power that reduces the confidence in a contraction found on another step (Hairer & Wanner II, IV.8)."""

DIVERGENT = 0.99
"""Rate of contraction from which on the iteration is given up, as in the code RADAU5 of these authors."""

ROUNDINGS = 8.0
"""Corrections, in roundings of the states, up to which they are roundoff: a choice, some for the sums of the stages."""

SHORTENED = 0.4
"""Part of a step that is tried again where the iteration did not converge, a choice."""


@compiled
def stage_count(k: int) -> int:
    """Number of stages of member k of the family."""
    return 2 * k + 3


@compiled
def divide(k: int, values: Any, m: int, row: Any) -> None:
    """Newton's form x (row[0] + (x - c_1) (row[1] + ...)) of the polynomial through 0 and the stage values in
    column m.
    """
    s = stage_count(k)
    for i in range(s):
        row[i] = values[i, m] * tables.INVERSE_GAPS[k, 0, i]
    for level in range(1, s):
        for i in range(s - 1, level - 1, -1):
            row[i] = (row[i] - row[i - 1]) * tables.INVERSE_GAPS[k, level, i]


@compiled
def value_and_slope(k: int, top: int, x: float, row: Any) -> Any:
    """Evaluate a polynomial in Newton's form, and its derivative, at x; row[top] is its last coefficient."""
    value, slope = row[top], 0.0
    for i in range(top - 1, -1, -1):
        slope = slope * (x - tables.NEWTON_NODES[k, i]) + value
        value = value * (x - tables.NEWTON_NODES[k, i]) + row[i]
    return value * x, slope * x + value


@compiled
def nested_four(k: int, top: int, x: Any, row: Any) -> tuple[float, float, float, float]:
    """Evaluate a polynomial at four points at once, in four independent chains of operations."""
    a = b = c = d = row[top]
    for i in range(top - 1, -1, -1):
        node, factor = tables.NEWTON_NODES[k, i], row[i]
        a, b, c, d = (
            a * (x[0] - node) + factor,
            b * (x[1] - node) + factor,
            c * (x[2] - node) + factor,
            d * (x[3] - node) + factor,
        )
    return a * x[0], b * x[1], c * x[2], d * x[3]


@compiled
def _differentiate_at_start(w: Any) -> None:
    put(w, 0.0, w.y, w.ydot)
    evaluate_jacobian(w)
    w.jacobians += 1


@compiled
def _row_sizes(w: Any, sizes: Any) -> None:
    """Sizes of the core equations, from their derivatives times the typical sizes of the states; NaN where a derivative
    is not finite.
    """
    for i in range(w.core):
        total = 0.0
        for j in range(w.core):
            total += abs(w.jacobian[0, i, j]) * w.scale[j] + 0.0 * w.jacobian[1, i, j]
        sizes[i] = total


@compiled
def _take_jacobian(w: Any) -> bool:
    """Prepare the Jacobian for factorizations; True if it is finite."""
    for part in range(2):
        for i in range(w.core):
            if not finite(w.jacobian[part, i]):
                return False
    if w.core >= LARGE_MATRIX:
        count_entries_of_rows(w.jacobian, w.entries[4])
    # Chains that are not finite are found by their pivots.
    return True


@compiled
def differentiate_system(w: Any, h: float, foresee: bool) -> bool:
    """Evaluate G_y and G_ydot in mid-step if the predictor is good enough there, otherwise at the start; True if
    finite.
    """
    _differentiate_at_start(w)
    if foresee and w.offset == 1.0 and 0.0 < h <= FORESEEN_GROWTH * w.h_last:
        known, sizes = w.columns, w.rhs
        _row_sizes(w, known)
        set_stage(w, w.member + 1, h)
        evaluate_jacobian(w)
        w.jacobians += 1
        _row_sizes(w, sizes)
        stiffer = False
        for i in range(w.core):
            # Not >: a value that is not finite must count as stiffer.
            stiffer = stiffer or not sizes[i] <= STIFFER * known[i]
        if stiffer:
            # A step from a wrong prediction must not count as converged.
            _differentiate_at_start(w)
    return _take_jacobian(w)


@compiled
def differentiate_at_end(w: Any, h: float) -> bool:
    """Evaluate G_y and G_ydot at the end of the step, and leave its inputs there; True if finite."""
    set_stage(w, stage_count(w.member) - 1, h)
    evaluate_jacobian(w)
    w.jacobians += 1
    return _take_jacobian(w)


@compiled
def _factor_shifted(w: Any, m: int, shift: Any, matrix: Any, border: Any, bands: Any) -> bool:
    """Factor matrix m, the core of G_y + shift G_ydot, with the chains eliminated."""
    order, places = w.order[m], w.places[m]
    chained = w.links > 0
    if w.core >= LARGE_MATRIX and not chained:
        entries = w.entries[4]
        if order[3, 0] >= 0 and factor_again(w.jacobian, entries, shift, matrix, order, places, w.pivot, w.delta):
            return True
        if m > 0:
            # The real matrix is factored already and has the same pattern.
            for k in range(len(order)):
                copy(w.order[0, k], order[k])
            for k in range(w.core):
                copy(w.places[0, k], places[k])
            if factor_again(w.jacobian, entries, shift, matrix, order, places, w.pivot, w.delta):
                return True
    shifted(w.jacobian, shift, matrix)
    if chained:
        shifted(w.border_derivatives, shift, border)
        shifted(w.band_derivatives, shift, bands)
        if not fold_chains(matrix, border, bands, w.chains):
            return False
    return bool(factor(matrix, order, places, w.pivot, w.delta, w.entries, 0.0))


@compiled
def factor_newton(w: Any, h: float) -> bool:
    """Factor the real and the complex Newton matrices for this step size."""
    k = w.member
    w.factorizations += 1
    if not _factor_shifted(w, 0, tables.GAMMA[k] / h, w.real, w.real_border, w.real_bands):
        return False
    for pair in range(k + 1):
        border, bands = w.complex_border[pair], w.complex_bands[pair]
        if not _factor_shifted(w, 1 + pair, tables.PAIR_VALUES[k, pair] / h, w.complex[pair], border, bands):
            return False
    return True


@compiled
def predict(w: Any, h: float) -> None:
    """Predict the stages from the stored polynomial; zero increments where there is none or the step is too long for
    it.
    """
    k, last = w.member, w.last_member
    s, top, z = stage_count(k), stage_count(last), w.z
    if not h <= PREDICTOR_REACH * w.h_last:
        for i in range(s):
            clear(z[i])
        return
    for m in range(w.n):
        row = w.z_polynomial[m]
        # Predictions start at the end of the stored step, or at its start where the step is repeated with another size,
        # or inside where a part of it is.
        start = 0.0 if w.offset == 0.0 else w.z_last[top - 1, m]
        if 0.0 < w.offset < 1.0:
            start = value_and_slope(last, top - 1, w.offset, row)[0]
        for i in range(s):
            x = w.offset + tables.NODES[k, i] * h / w.h_last
            z[i, m] = value_and_slope(last, top - 1, x, row)[0] - start


@compiled
def put_change(w: Any, h: float, x: float, change: Any, slope: Any, rate: float) -> None:
    """Set the inputs to the fraction x of a step, from the change of the state up to there, and its slope and rate."""
    n = w.n
    # Local names save the loops a reload from the record after each store.
    inputs, y = w.inputs, w.y
    inputs[0] = w.base + (w.tau + x * h)
    for m in range(n):
        inputs[1 + m] = y[m] + change[m]
        inputs[1 + n + m] = slope[m] * rate


@compiled
def set_stage(w: Any, i: int, h: float) -> None:
    """Set the inputs to stage i."""
    k, s = w.member, stage_count(w.member)
    if w.explicit != 0:
        put_change(w, h, tables.NODES[k, i], w.z[i], w.k[12], 1.0)
        if i + 1 < s:
            put_rates(w, w.trial_dot)
        return
    combine(tables.INVERSE[k, i].ctypes.data, 7, 1, s, w.z.ctypes.data, w.n, w.slopes[i].ctypes.data)
    put_change(w, h, tables.NODES[k, i], w.z[i], w.slopes[i], 1.0 / h)


@compiled
def end_of_step(w: Any, h: float, y: Any, ydot: Any, q: Any) -> None:
    """Write state, derivative and ledger at the end of the step into these vectors."""
    n, last = w.n, stage_count(w.member) - 1
    set_stage(w, last, h)
    for m in range(n):
        y[m] = w.inputs[1 + m]
        ydot[m] = w.inputs[1 + n + m]
    for m in range(w.n_ledger):
        q[m] = w.q[m] + w.q_stage[last, m]


@compiled
def _evaluate_stages(w: Any, h: float) -> None:
    """Evaluate the residuals at all stages."""
    k, s, rate = w.member, stage_count(w.member), 1.0 / h
    combine(tables.INVERSE[k].ctypes.data, 7, s, s, w.z.ctypes.data, w.n, w.slopes.ctypes.data)
    for i in range(s):
        put_change(w, h, tables.NODES[k, i], w.z[i], w.slopes[i], rate)
        evaluate(w, RESIDUAL, w.g[i])
    w.residuals += s


@compiled
def _correct(w: Any) -> float:
    """Compute one Newton correction of all stages, kept in g; return its weighted maximum norm."""
    k, n = w.member, w.n
    s = stage_count(k)
    # Local names save the loops a reload from the record after each store.
    parts, pairs, g, z, weight = w.parts, w.pairs, w.g, w.z, w.weight
    # The stages decouple in the eigenbasis of the inverse collocation matrix (Butcher 1976; Bickart 1977).
    combine(tables.TO_PARTS[k].ctypes.data, 7, s, s, g.ctypes.data, n, parts.ctypes.data)
    solve_real(w, parts[0])
    for pair in range(k + 1):
        for m in range(n):
            pairs[pair, m] = complex(parts[1 + 2 * pair, m], parts[2 + 2 * pair, m])
        solve_complex(w, pair, pairs[pair])
        for m in range(n):
            parts[1 + 2 * pair, m], parts[2 + 2 * pair, m] = pairs[pair, m].real, pairs[pair, m].imag
    combine(tables.FROM_PARTS[k].ctypes.data, 7, s, s, parts.ctypes.data, n, g.ctypes.data)
    norm = 0.0
    for m in range(n):
        largest = 0.0
        for i in range(s):
            change = g[i, m]
            z[i, m] += change
            # Not max(): a NaN must reach the caller.
            if abs(change) > largest or change != change:
                largest = abs(change)
        size = largest / weight[m]
        if size > norm or size != size:
            norm = size
    return norm


@compiled
def _may_be_astray(w: Any, h: float) -> bool:
    """True if Newton's method may end at a wrong state, because equations have become much softer than its matrix: its
    last corrections are small and close no gap.

    What the equations at the end of the step were open by before the last correction is in ``columns``.
    """
    if not _may_be_open(w, h, w.columns):
        return False
    set_stage(w, stage_count(w.member) - 1, h)
    evaluate(w, RESIDUAL, w.rhs)
    w.residuals += 1
    return bool(_may_be_open(w, h, w.rhs))


@compiled
def _may_be_open(w: Any, h: float, residual: Any) -> bool:
    """True if an equation is open by more than rates change it that move the states by their tolerances in the step, or
    by roundoff of the rates.
    """
    unit = tables.GAMMA[w.member] / h
    for i in range(w.core):
        allowed = 0.0
        for j in range(w.core):
            rate = w.inputs[1 + w.n + j]
            allowed += abs(w.jacobian[1, i, j]) * (unit * w.weight[j] + NEWTON_EPS * abs(rate))
        if abs(residual[i]) > allowed:
            return True
    return False


@compiled
def solve_stages(w: Any, h: float) -> int:
    """Iterate to the tolerance, or to roundoff where that is larger; store the rate of contraction.

    Source: Hairer & Wanner II, IV.8: the observed contraction estimates the remaining correction, and whether the
    allowed iterations will suffice.
    """
    limit = 7 + 2 * w.member
    contraction = max(w.contraction, EPS) ** TRUST
    s = stage_count(w.member)
    norm = norm_last = rate_last = 0.0
    w.theta = 0.0
    settled = False
    for iteration in range(limit):
        _evaluate_stages(w, h)
        copy(w.g[s - 1], w.columns)
        norm = _correct(w)
        w.iterations += 1
        w.newton_steps = iteration + 1
        if not norm < np.inf:
            return NOT_FINITE
        if iteration == 0:
            w.guess_error = norm
        else:
            ratio = norm / norm_last
            rate = ratio if iteration == 1 else np.sqrt(ratio * rate_last)
            rate_last = ratio
            if rate >= DIVERGENT or rate / (1.0 - rate) * norm * rate ** (limit - 1 - iteration) > NEWTON_PART:
                break
            w.theta = rate
            contraction = max(rate / (1.0 - rate), SLOWEST_KNOWN)
        # At loose tolerances a single correction may hide a layer that the Jacobian does not resolve.
        believed = iteration > 0 or w.rtol < tables.COARSE_RTOL
        settled = (believed and contraction * norm <= NEWTON_PART) or norm <= ROUNDINGS * w.roundoff
        if settled:
            w.contraction = contraction
            break
        norm_last = max(norm, TINY)
    if not settled:
        # A stalled iteration may be at roundoff level, where the contraction means nothing.
        w.guess_error = 0.0
        if not correction_is_noise(w, s):
            return DIVERGED
    return OPEN if _may_be_astray(w, h) else CONVERGED
