"""The nonlinear system of one Radau IIA step, solved for the stage increments Z_i = Y_i - y_n by a simplified Newton
method.

Each stage asks G(t_i, y_n + Z_i, (1/h) sum_j (A^-1)_ij Z_j) = 0. In the eigenbasis of A^-1 the Newton matrix falls
apart into one real and (s-1)/2 complex matrices (lambda/h) G_ydot + G_y of the size of the state.
"""

from typing import Any

import numpy as np

from surfacechem.solve.radau.linear import factor, fold_shifted, solve_complex, solve_real
from surfacechem.solve.radau.roundoff import correction_is_noise
from surfacechem.solve.radau.tables import (
    COARSE,
    FROM_PARTS,
    GAMMA,
    INVERSE,
    INVERSE_GAPS,
    NEWTON_NODES,
    NODES,
    PAIR_VALUES,
    TO_PARTS,
)
from surfacechem.solve.radau.work import (
    BASE,
    COLUMNS,
    CONTRACTION,
    DELTA,
    FACTORIZATIONS,
    GUESSED,
    H_LAST,
    ITERATIONS,
    JACOBIAN,
    JACOBIANS,
    LAST_MEMBER,
    MEMBER,
    OFFSET,
    PIVOT,
    RESIDUAL,
    RESIDUALS,
    RHS,
    ROUNDOFF,
    RTOL,
    SCALE,
    TAU,
    THETA,
    TRIES,
    WEIGHT,
    YDOT,
    Q,
    Y,
    clear,
    combine,
    compiled,
    evaluate,
    finite,
    set_inputs,
)
from surfacechem.tolerances import EPS, NEGLIGIBLE, TINY

CONVERGED, DIVERGED, NOT_FINITE = range(3)

TIGHT = NEGLIGIBLE
"""Newton error allowed, in units of the tolerance. The order of the method makes steps better than the tolerance, so
that a looser limit would set the error; and a Jacobian taken where the equations are far stiffer than at the solution
makes the corrections small before the residual is.
"""

FORESEEN = 1.5
"""The longest step, in units of the one before, whose middle is foreseen well enough to differentiate there."""

REACH = 30.0
"""The longest step, in units of the one before, that its polynomial is continued to."""

STIFFER = 3.0
"""How much larger than at the start of the step the foreseen derivatives may be."""

SLOWEST_KNOWN = 0.02
"""Contraction never assumed better than this: a component that converges at once hides a slower one behind its first
correction."""


@compiled
def stage_count(k: int) -> int:
    """Stages of member k of the family."""
    return 2 * k + 3


@compiled
def divide(k: int, values: Any, m: int, row: Any) -> None:
    """Newton's form x (row[0] + (x - c_1) (row[1] + ...)) of the polynomial through 0 and column m of these values at
    the stages.
    """
    s = stage_count(k)
    for i in range(s):
        row[i] = values[i, m] * INVERSE_GAPS[k, 0, i]
    for level in range(1, s):
        for i in range(s - 1, level - 1, -1):
            row[i] = (row[i] - row[i - 1]) * INVERSE_GAPS[k, level, i]


@compiled
def nested(k: int, top: int, x: float, row: Any) -> float:
    """Value at x of a polynomial in Newton's form whose last coefficient is row[top]."""
    value = row[top]
    for i in range(top - 1, -1, -1):
        value = value * (x - NEWTON_NODES[k, i]) + row[i]
    return float(value * x)


@compiled
def _differentiate(w: Any) -> None:
    """Evaluate G_y and G_ydot at the inputs."""
    evaluate(w, JACOBIAN, w.jacobian.ctypes.data)
    w.count[JACOBIANS] += 1


@compiled
def _differentiate_at_start(w: Any) -> None:
    w.inputs[0] = w.clock[BASE] + w.clock[TAU]
    set_inputs(w, w.vector[Y], w.vector[YDOT])
    _differentiate(w)


@compiled
def _row_sizes(w: Any, sizes: Any) -> None:
    """Size of the equations of the core by their derivatives and the typical sizes of the states; NaN where they or
    those by the rates are not finite.
    """
    for i in range(w.jacobian.shape[1]):
        total = 0.0
        for j in range(w.jacobian.shape[1]):
            total += abs(w.jacobian[0, i, j]) * w.vector[SCALE, j] + 0.0 * w.jacobian[1, i, j]
        sizes[i] = total


@compiled
def _differentiate_midway(w: Any, h: float) -> None:
    """Evaluate G_y and G_ydot at the middle of the step as it is foreseen; at its start where the equations would be
    far stiffer: a step through states that are foreseen wrongly must not pass for one that has converged.
    """
    known, sizes = w.vector[COLUMNS], w.vector[RHS]
    _row_sizes(w, known)
    set_stage(w, w.count[MEMBER] + 1, h)
    _differentiate(w)
    _row_sizes(w, sizes)
    stiffer = False
    for i in range(w.jacobian.shape[1]):
        # Not >: what is not finite is stiffer, too.
        stiffer = stiffer or not sizes[i] <= STIFFER * known[i]
    if stiffer:
        _differentiate_at_start(w)


@compiled
def differentiate_system(w: Any, h: float, foresee: bool) -> bool:
    """Evaluate G_y and G_ydot midway through the step where the first guess of its stages foresees that, else at its
    start.
    """
    _differentiate_at_start(w)
    if foresee and w.clock[OFFSET] == 1.0 and 0.0 < h <= FORESEEN * w.clock[H_LAST]:
        _differentiate_midway(w, h)
    for part in range(2):
        for i in range(w.jacobian.shape[1]):
            if not finite(w.jacobian[part, i]):
                return False
    # Chains that are not finite show in their pivots.
    return True


@compiled
def factor_newton(w: Any, h: float) -> bool:
    """Factor the real and the complex Newton matrices for this step size."""
    k = w.count[MEMBER]
    mass, stiffness = w.jacobian[1], w.jacobian[0]
    n, chained = mass.shape[0], w.chains.shape[0] > 0
    w.count[FACTORIZATIONS] += 1
    real, pairs = w.real, w.complex
    for i in range(n):
        for j in range(n):
            real[i, j] = GAMMA[k] / h * mass[i, j] + stiffness[i, j]
    if chained and not fold_shifted(w, GAMMA[k] / h, real, w.real_border, w.real_bands):
        return False
    if not factor(real, w.order[0], w.vector[PIVOT], w.vector[DELTA], 0.0):
        return False
    for pair in range(k + 1):
        shift = PAIR_VALUES[k, pair] / h
        for i in range(n):
            for j in range(n):
                pairs[pair, i, j] = shift * mass[i, j] + stiffness[i, j]
        if chained and not fold_shifted(w, shift, pairs[pair], w.complex_border[pair], w.complex_bands[pair]):
            return False
        if not factor(pairs[pair], w.order[1 + pair], w.vector[PIVOT], w.vector[DELTA], 0.0):
            return False
    return True


@compiled
def predict(w: Any, h: float) -> None:
    """First guess of the stages from the stored polynomial; no change where there is none, or none that reaches."""
    k, last = w.count[MEMBER], w.count[LAST_MEMBER]
    s, top, z = stage_count(k), stage_count(last), w.z
    if not h <= REACH * w.clock[H_LAST]:
        for i in range(s):
            clear(z[i])
        return
    for m in range(w.algebraic.shape[0]):
        row = w.z_polynomial[m]
        start = 0.0 if w.clock[OFFSET] == 0.0 else w.z_last[top - 1, m]
        for i in range(s):
            x = w.clock[OFFSET] + NODES[k, i] * h / w.clock[H_LAST]
            z[i, m] = nested(last, top - 1, x, row) - start


@compiled
def _put_stage(w: Any, i: int, h: float, rate: float) -> None:
    """Inputs of stage i from its slope."""
    n = w.algebraic.shape[0]
    # Local names spare the loops a look at the workspace after each store.
    inputs, z, y, slopes = w.inputs, w.z[i], w.vector[Y], w.slopes[i]
    inputs[0] = w.clock[BASE] + (w.clock[TAU] + NODES[w.count[MEMBER], i] * h)
    for m in range(n):
        inputs[1 + m] = y[m] + z[m]
        inputs[1 + n + m] = slopes[m] * rate


@compiled
def set_stage(w: Any, i: int, h: float) -> None:
    """Inputs of stage i."""
    k, n = w.count[MEMBER], w.algebraic.shape[0]
    address = w.slopes[i].ctypes.data
    combine(INVERSE[k, i].ctypes.data, 7, 1, stage_count(k), w.z.ctypes.data, n, address)
    _put_stage(w, i, h, 1.0 / h)


@compiled
def end_of_step(w: Any, h: float, y: int, ydot: int, q: int) -> None:
    """State, derivative and ledger at the end of the step, into these rows."""
    n = w.algebraic.shape[0]
    last = stage_count(w.count[MEMBER]) - 1
    set_stage(w, last, h)
    for m in range(n):
        w.vector[y, m] = w.inputs[1 + m]
        w.vector[ydot, m] = w.inputs[1 + n + m]
    for m in range(w.ledger.shape[1]):
        w.ledger[q, m] = w.ledger[Q, m] + w.q_stage[last, m]


@compiled
def _stage_residuals(w: Any, h: float) -> None:
    k, rate = w.count[MEMBER], 1.0 / h
    s = stage_count(k)
    w.count[RESIDUALS] += s
    combine(INVERSE[k].ctypes.data, 7, s, s, w.z.ctypes.data, w.algebraic.shape[0], w.slopes.ctypes.data)
    for i in range(s):
        _put_stage(w, i, h, rate)
        evaluate(w, RESIDUAL, w.g[i].ctypes.data)


@compiled
def _correct(w: Any) -> float:
    """One Newton correction of all stages, kept in g; returns its weighted maximum norm."""
    k, n = w.count[MEMBER], w.algebraic.shape[0]
    s = stage_count(k)
    # Local names spare the loops a look at the workspace after each store.
    parts, pairs, g, z, weight = w.parts, w.pairs, w.g, w.z, w.vector[WEIGHT]
    combine(TO_PARTS[k].ctypes.data, 7, s, s, g.ctypes.data, n, parts.ctypes.data)
    solve_real(w, parts[0])
    for pair in range(k + 1):
        for m in range(n):
            pairs[pair, m] = complex(parts[1 + 2 * pair, m], parts[2 + 2 * pair, m])
        solve_complex(w, pair, pairs[pair])
        for m in range(n):
            parts[1 + 2 * pair, m], parts[2 + 2 * pair, m] = pairs[pair, m].real, pairs[pair, m].imag
    combine(FROM_PARTS[k].ctypes.data, 7, s, s, parts.ctypes.data, n, g.ctypes.data)
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
def solve_stages(w: Any, h: float) -> int:
    """Iterate to the tolerance, or to rounding level where that is coarser; leaves the contraction rate in the
    clock.
    """
    limit = 7 + 2 * w.count[MEMBER]
    contraction = max(w.clock[CONTRACTION], EPS) ** 0.8
    rounding = w.clock[ROUNDOFF]
    norm_last, rate_last = 0.0, 0.0
    w.clock[THETA] = 0.0
    for iteration in range(limit):
        _stage_residuals(w, h)
        norm = _correct(w)
        w.count[ITERATIONS] += 1
        w.count[TRIES] = iteration + 1
        if not norm < np.inf:
            return NOT_FINITE
        if iteration == 0:
            w.clock[GUESSED] = norm
        else:
            ratio = norm / norm_last
            rate = ratio if iteration == 1 else np.sqrt(ratio * rate_last)
            rate_last = ratio
            if rate >= 0.99 or rate / (1.0 - rate) * norm * rate ** (limit - 1 - iteration) > TIGHT:
                break
            w.clock[THETA] = rate
            contraction = max(rate / (1.0 - rate), SLOWEST_KNOWN)
        believed = iteration > 0 or w.clock[RTOL] < COARSE
        if (believed and contraction * norm <= TIGHT) or norm <= 8.0 * rounding:
            w.clock[CONTRACTION] = contraction
            return CONVERGED
        norm_last = max(norm, TINY)
    w.clock[GUESSED] = 0.0
    return CONVERGED if correction_is_noise(w, stage_count(w.count[MEMBER])) else DIVERGED
