"""The loop over lanes with steps of Radau IIA: five stages, order 9, each lane with its own Newton iteration.

The rules are those of the stepper for single runs: the same stages, estimate of the error and dense output. Here the
equations are solved for their rates, the Jacobian is evaluated and factored in each step, and the ledger is integrated
from its rates at the stages.

The Newton matrices a/h - J are in units of the weights of the error norm, so that rows and columns have like sizes.
Rows are exchanged in each lane by itself where its pivot is small.

Source: Hairer & Wanner, Solving Ordinary Differential Equations II, sections IV.5 and IV.8; Golub & Van Loan, Matrix
Computations, section 3.4; the threshold of exchanges as in the stepper for single runs.
"""

from typing import Any

import numpy as np
from numpy.polynomial import Polynomial

from surfacechem.compile.vectors import LANES
from surfacechem.solve.lanes.lane_run import loop_of
from surfacechem.solve.lanes.lane_step import (
    coefficients_of,
    differentiate_polynomials,
    error_norm,
    is_brief,
    larger,
    nothing,
    put_inside,
    put_moved,
    put_points,
    put_start,
    scale_ledger,
    smaller,
)
from surfacechem.solve.lanes.layout import ORDER, RADAU_MEMORY
from surfacechem.solve.lanes.vector import (
    absolute,
    any_lane,
    exponential,
    lanes,
    logarithm,
    polynomial,
    polynomial_of,
    put,
    put_where,
    same,
    square_root,
    where,
)
from surfacechem.solve.radau import newton, tables
from surfacechem.solve.radau.dense import N_GROUPS, ledger_rtol
from surfacechem.solve.radau.explicit import DENSEST
from surfacechem.solve.radau.linear import PIVOT_PART
from surfacechem.solve.radau.outputs import POLYNOMIAL_ERROR
from surfacechem.solve.radau.step import CONTRACTING, LEAST_CONVERGENT, MIN_GROWTH, SAFETY
from surfacechem.solve.radau.work import JACOBIAN, RATES, RESIDUAL, compiled, evaluate, evaluate_at, weighted_sums
from surfacechem.tolerances import EPS, FORMULA_EPS, NEGLIGIBLE, NEWTON_EPS, TINY, UNEQUAL

MEMBER, STAGES = 1, 5
"""Member of the family in these steps, and its number of stages."""
C = tables.NODES[MEMBER, :STAGES]
POWER = 1.0 / (STAGES + 1.0)
"""Exponent of the size of a step: the estimate of s stages goes with h^(s+1)."""
MOST_ITERATIONS = 9
DIVERGED = (SAFETY / newton.SHORTENED) ** (1.0 / POWER)
"""Norm assigned to a step without convergence: the next trial is shortened as in single runs. If that fails
too, the next ones have a tenth each.
"""
EIGENVALUES = np.array([tables.GAMMA[MEMBER], *tables.PAIR_VALUES[MEMBER, :2]])


def _polynomials() -> list[Polynomial]:
    """Return the changes over a fraction x of the step, per unit of the step: by the rate at the start (not used), by
    the rate at each stage, and by the correction, whose slope vanishes at all stages.
    """
    every = [Polynomial([0.0])]
    for i in range(STAGES):
        others = np.delete(C, i)
        every.append((Polynomial.fromroots(others) / np.prod(C[i] - others)).integ())
    return [*every, (Polynomial.fromroots(C) / np.prod(-C)).integ()]


_quarters = weighted_sums(np.array([[each(x) for each in _polynomials()] for x in (0.25, 0.5, 0.75)]), LANES)
_polynomial = weighted_sums(coefficients_of(_polynomials(), ORDER), LANES)
# The extrapolated change after the end of a step, by its stage rates.
_after_end = [each(Polynomial([1.0, 1.0])) for each in _polynomials()[1 : 1 + STAGES]]
_extrapolated = weighted_sums(coefficients_of(_after_end, STAGES), LANES)
_to_slopes = weighted_sums(tables.INVERSE[MEMBER, :STAGES, :STAGES], LANES)
_to_parts = weighted_sums(tables.TO_PARTS[MEMBER, :STAGES, :STAGES], LANES)
_from_parts = weighted_sums(tables.FROM_PARTS[MEMBER, :STAGES, :STAGES], LANES)
_start_slope = weighted_sums(tables.START_SLOPE[MEMBER : MEMBER + 1, :STAGES], LANES)
_weights = weighted_sums(np.array([[0.0, *tables.COLLOCATION[MEMBER, STAGES - 1, :STAGES]]]), LANES)
_defect_at_start = weighted_sums(np.array([[1.0, *-tables.START_RATE[MEMBER, :STAGES], 0.0]]), LANES)


@compiled
def _put_derivatives(w: Any, chosen: Any) -> None:
    """Set the derivatives of the rates at the start of the step from those at the end, in the lanes of a mask."""
    for i in range(w.n):
        for j in range(w.n):
            put_where(chosen, w.jacobian[i, j], lanes(w.end_jacobian[i, j]))
        put_where(chosen, w.time_slopes[i], lanes(w.end_time_slopes[i]))


@compiled
def differentiate(w: Any) -> None:
    """Set the inputs to the start of the step, and evaluate the derivatives of the rates there where the step before
    has left none.
    """
    put_start(w)
    new = lanes(w.known) < 0.5
    if any_lane(new):
        evaluate(w, JACOBIAN, w.end_jacobian)
        _put_derivatives(w, new)
    put(w.known, 1.0)
    put(w.known_at_end, 0.0)


@compiled
def keep_derivatives(w: Any) -> None:
    """Keep the derivatives at the end of the steps that are taken, if they have been evaluated."""
    taken = lanes(w.taken) > 0.5
    ends = taken & (lanes(w.known_at_end) > 0.5)
    if any_lane(ends):
        _put_derivatives(w, ends)
    put_where(taken, w.known, lanes(w.known_at_end))


@compiled
def _exchange(re: Any, im: Any, flags: Any, k: int) -> None:
    """Move a large entry of column k to the pivot, in each lane by itself."""
    for i in range(k + 1, re.shape[0]):
        pivot = absolute(lanes(re[k, k])) + absolute(lanes(im[k, k]))
        moves = PIVOT_PART * (absolute(lanes(re[i, k])) + absolute(lanes(im[i, k]))) > pivot
        put(flags[k, i], where(moves, 1.0, 0.0))
        if any_lane(moves):
            for j in range(k, re.shape[0]):
                for part in (re, im):
                    upper, lower = lanes(part[k, j]), lanes(part[i, j])
                    put_where(moves, part[k, j], lower)
                    put_where(moves, part[i, j], upper)


@compiled
def factor(w: Any, s: int, jacobian: Any, real: Any, imaginary: Any) -> None:
    """Factor matrix s, J subtracted from a complex number on the diagonal; pivots are replaced by their inverses.

    Where a matrix is singular the factors, and all that is found with them, are not finite.
    """
    n, re, im = w.n, w.matrix[s, 0], w.matrix[s, 1]
    for i in range(n):
        unit = 1.0 / lanes(w.weight[i])
        for j in range(n):
            put(re[i, j], 0.0 - lanes(jacobian[i, j]) * (lanes(w.weight[j]) * unit))
            put(im[i, j], 0.0)
        put(re[i, i], real - lanes(jacobian[i, i]))
        put(im[i, i], imaginary)
    for k in range(n):
        _exchange(re, im, w.exchanged[s], k)
        a, b = lanes(re[k, k]), lanes(im[k, k])
        size = a * a + b * b
        a, b = a / size, (0.0 - b) / size
        put(re[k, k], a)
        put(im[k, k], b)
        for i in range(k + 1, n):
            c, d = lanes(re[i, k]), lanes(im[i, k])
            p, q = a * c - b * d, a * d + b * c
            put(re[i, k], p)
            put(im[i, k], q)
            for j in range(k + 1, n):
                c, d = lanes(re[k, j]), lanes(im[k, j])
                put(re[i, j], lanes(re[i, j]) - (p * c - q * d))
                put(im[i, j], lanes(im[i, j]) - (p * d + q * c))


@compiled
def solve(w: Any, s: int, x: Any, y: Any) -> None:
    """Overwrite a right-hand side, with real part x and imaginary part y, by the solution with matrix s."""
    n, re, im = w.n, w.matrix[s, 0], w.matrix[s, 1]
    for i in range(n):
        unit = 1.0 / lanes(w.weight[i])
        put(x[i], lanes(x[i]) * unit)
        put(y[i], lanes(y[i]) * unit)
    for k in range(n):
        for i in range(k + 1, n):
            moves = lanes(w.exchanged[s, k, i]) > 0.5
            if any_lane(moves):
                for part in (x, y):
                    upper, lower = lanes(part[k]), lanes(part[i])
                    put_where(moves, part[k], lower)
                    put_where(moves, part[i], upper)
        a, b = lanes(x[k]), lanes(y[k])
        for i in range(k + 1, n):
            c, d = lanes(re[i, k]), lanes(im[i, k])
            put(x[i], lanes(x[i]) - (a * c - b * d))
            put(y[i], lanes(y[i]) - (a * d + b * c))
    for k in range(n - 1, -1, -1):
        a, b = lanes(x[k]), lanes(y[k])
        for j in range(k + 1, n):
            c, d, p, q = lanes(re[k, j]), lanes(im[k, j]), lanes(x[j]), lanes(y[j])
            a, b = a - (c * p - d * q), b - (c * q + d * p)
        c, d = lanes(re[k, k]), lanes(im[k, k])
        put(x[k], a * c - b * d)
        put(y[k], a * d + b * c)
    for i in range(n):
        put(x[i], lanes(x[i]) * lanes(w.weight[i]))
        put(y[i], lanes(y[i]) * lanes(w.weight[i]))


@compiled
def solve_of(w: Any, lane: int, x: Any) -> None:
    """Overwrite eight right-hand sides by the solutions with the real matrix, the first one, of one lane."""
    n, a = w.n, w.matrix[0, 0]
    for i in range(n):
        put(x[i], lanes(x[i]) * (1.0 / w.weight[i, lane]))
    for k in range(n):
        for i in range(k + 1, n):
            if w.exchanged[0, k, i, lane] > 0.5:
                upper, lower = lanes(x[k]), lanes(x[i])
                put(x[k], lower)
                put(x[i], upper)
        for i in range(k + 1, n):
            put(x[i], lanes(x[i]) - a[i, k, lane] * lanes(x[k]))
    for k in range(n - 1, -1, -1):
        total = lanes(x[k])
        for j in range(k + 1, n):
            total = total - a[k, j, lane] * lanes(x[j])
        put(x[k], total * a[k, k, lane])
    for i in range(n):
        put(x[i], lanes(x[i]) * w.weight[i, lane])


@compiled
def root_of(w: Any, a: Any) -> Any:
    """The root for step sizes: the power of the method."""
    return exponential(w.power * logarithm(a))


@compiled
def _predict(w: Any) -> None:
    """Predict the increments of the stages from the last step; zero where there is none or the step is too long."""
    h, last = lanes(w.h), lanes(w.h_last)
    known = (last > 0.0) & (h <= newton.PREDICTOR_REACH * last)
    ratio = where(known, h / last, 0.0)
    every = LANES * w.n
    for d in range(STAGES):
        _extrapolated(d, w.k_last.ctypes.data, every, every, w.predictor[d].ctypes.data)
    for i in range(STAGES):
        s = C[i] * ratio
        for m in range(w.n):
            total = lanes(w.predictor[STAGES - 1, m])
            for d in range(STAGES - 2, -1, -1):
                total = total * s + lanes(w.predictor[d, m])
            put(w.z[i, m], where(known, last * s * total, 0.0))


@compiled
def _put_stage(w: Any, i: int) -> None:
    put_moved(w, C[i] * lanes(w.h), w.z[i], 1.0)


@compiled
def _put_slopes(w: Any, i: int) -> None:
    """Set the rates of the states at a stage to the slopes of their polynomials."""
    every, row, rate = LANES * w.n, w.k[1 + i], 1.0 / lanes(w.h)
    _to_slopes(i, w.z.ctypes.data, every, every, row.ctypes.data)
    for m in range(w.n):
        put(row[m], lanes(row[m]) * rate)


@compiled
def _correct(w: Any, active: Any) -> Any:
    """Correct the stages of the active lanes by one iteration of Newton's method; return the norm of corrections."""
    every = LANES * w.n
    for i in range(STAGES):
        _put_slopes(w, i)
        _put_stage(w, i)
        evaluate(w, RESIDUAL, w.g[i])
        for m in range(w.n):
            put(w.g[i, m], lanes(w.k[1 + i, m]) - lanes(w.g[i, m]))
    for m in range(w.n):
        put_where(active, w.error[m], lanes(w.g[STAGES - 1, m]))
    for i in range(STAGES):
        _to_parts(i, w.g.ctypes.data, every, every, w.parts[i].ctypes.data)
    for m in range(w.n):
        put(w.imaginary[m], 0.0)
    solve(w, 0, w.parts[0], w.imaginary)
    solve(w, 1, w.parts[1], w.parts[2])
    solve(w, 2, w.parts[3], w.parts[4])
    for i in range(STAGES):
        _from_parts(i, w.parts.ctypes.data, every, every, w.g[i].ctypes.data)
    norm = same(0.0)
    for m in range(w.n):
        unit = 1.0 / lanes(w.weight[m])
        for i in range(STAGES):
            change = lanes(w.g[i, m])
            put(w.z[i, m], lanes(w.z[i, m]) + where(active, change, 0.0))
            size = absolute(change) * unit
            norm = where(size <= norm, norm, size)  # not larger(): NaN must be seen
    return norm


@compiled
def _move_states(w: Any) -> None:
    """Move the states in the inputs by their weights."""
    for m in range(w.n):
        put(w.inputs[1 + m], lanes(w.inputs[1 + m]) + UNEQUAL[m % len(UNEQUAL)] * lanes(w.weight[m]))


@compiled
def are_open(w: Any, residual: Any, unit: Any, rates: Any) -> Any:
    """Mask of lanes in which an equation is open by more than a rate that moves its state by the tolerance in the step,
    or by roundoff of its rate; ``unit`` [1/s] is the diagonal of its matrix.
    """
    found = same(0.0)
    for m in range(w.n):
        allowed = unit * lanes(w.weight[m]) + NEWTON_EPS * absolute(lanes(rates[m]))
        found = where(absolute(lanes(residual[m])) > allowed, 1.0, found)
    return found > 0.5


@compiled
def _leave_roundoff_out(w: Any, gap: Any) -> None:
    """Leave out of what the equations at the inputs are open by what may be roundoff of the states, by how much the
    equations change when the states move by their weights; the inputs move.
    """
    evaluate(w, RESIDUAL, w.imaginary)
    _move_states(w)
    evaluate(w, RESIDUAL, w.rates)
    part = same(0.0)
    for m in range(w.n):
        part = larger(part, newton.ROUNDINGS * EPS * absolute(lanes(w.y_new[m])) / lanes(w.weight[m]))
    for m in range(w.n):
        left, change = lanes(gap[m]), absolute(lanes(w.rates[m]) - lanes(w.imaginary[m]))
        put(gap[m], where(absolute(left) > part * change, left, 0.0))


@compiled
def _norm_by_diagonal(w: Any, diagonal: Any, gap: Any) -> Any:
    """A bound of the norm of what the equations at the end of the step are open by, through the matrix there, by the
    series in what is not on its diagonal; infinite where this does not halve the first term.
    """
    first, second = same(0.0), same(0.0)
    for i in range(w.n):
        unit = 1.0 / (lanes(w.weight[i]) * absolute(diagonal - lanes(w.end_jacobian[i, i])))
        size = absolute(lanes(gap[i])) * unit
        put(w.imaginary[i], unit)
        put(w.rhs[i], size * lanes(w.weight[i]))
        first = where(size <= first, first, size)  # not larger(): NaN must be seen
    for i in range(w.n):
        total = same(0.0)
        for j in range(w.n):
            if j != i:
                total = total + absolute(lanes(w.end_jacobian[i, j])) * lanes(w.rhs[j])
        size = total * lanes(w.imaginary[i])
        second = where(size <= second, second, size)
    return where(second <= 0.5 * first, 2.0 * first, np.inf)


@compiled
def norm_at_end(w: Any, s: int, diagonal: Any, gap: Any, hides: Any) -> Any:
    """The norm, in the lanes in which the matrix of the step hides it, of what the equations at the inputs, the end of
    the step, are open by, through the matrix there, which overwrites matrix s; zero in others.

    Equations may have become much softer than the matrix of the step. What may be roundoff does not count.
    """
    evaluate(w, JACOBIAN, w.end_jacobian)
    put(w.known_at_end, 1.0)
    norm = where(hides, _norm_by_diagonal(w, diagonal, gap), 0.0)
    hides = ~(norm < 1.0)
    if any_lane(hides):
        factor(w, s, w.end_jacobian, diagonal, same(0.0))
        _leave_roundoff_out(w, gap)
        for m in range(w.n):
            put(w.rhs[m], lanes(gap[m]))
            put(w.imaginary[m], 0.0)
        solve(w, s, w.rhs, w.imaginary)
        norm = where(hides, error_norm(w, w.rhs), norm)
    return norm


@compiled
def _are_astray(w: Any) -> Any:
    """Mask of lanes in which Newton's method ends at a wrong state, because equations have become much softer than its
    matrix: its last corrections are small and close no gap.

    How far the equations at the end of the step were open before the last correction is in ``error``.
    """
    diagonal = EIGENVALUES[0].real / lanes(w.h)
    astray = are_open(w, w.error, diagonal, w.k[STAGES])
    if any_lane(astray):
        _put_slopes(w, STAGES - 1)
        _put_stage(w, STAGES - 1)
        evaluate(w, RESIDUAL, w.rhs)
        for m in range(w.n):
            put(w.error[m], lanes(w.k[STAGES, m]) - lanes(w.rhs[m]))
        astray = astray & are_open(w, w.error, diagonal, w.k[STAGES])
    if any_lane(astray):
        # In place of a matrix of a pair, which serves no more.
        astray = ~(norm_at_end(w, 1, diagonal, w.error, astray) < 1.0)
    return astray


@compiled
def _solve_stages(w: Any) -> Any:
    """Iterate to the tolerance in each lane; return the mask of lanes in which it is met.

    A lane that is done changes no more, so that it does not depend on its neighbours.
    """
    active = lanes(w.h) > 0.0
    solved = active & ~active
    fresh = ~(lanes(w.h_last) > 0.0)
    contraction = exponential(newton.TRUST * logarithm(larger(where(fresh, 1.0, lanes(w.contraction)), same(EPS))))
    theta, last, rate_last = same(0.0), same(1.0), same(0.0)
    for iteration in range(MOST_ITERATIONS):
        norm = _correct(w, active)
        put(w.evaluations, lanes(w.evaluations) + where(active, float(STAGES), 0.0))
        goes_on = norm < np.inf
        if iteration == 0:
            put(w.guess_error, norm)
        else:
            ratio = norm / last
            rate = ratio if iteration == 1 else square_root(ratio * rate_last)
            rate_last, expected = ratio, norm * rate / (1.0 - rate)
            for _ in range(MOST_ITERATIONS - 1 - iteration):
                expected = expected * rate
            goes_on = goes_on & (rate < newton.DIVERGENT) & (expected <= newton.NEWTON_PART)
            theta = where(active, rate, theta)
            contraction = where(active, larger(rate / (1.0 - rate), same(newton.SLOWEST_KNOWN)), contraction)
        # At loose tolerances a single correction may hide a layer that the Jacobian does not resolve.
        roundoff = same(0.0)  # of the states, also of one that grows from zero to its last stage
        for m in range(w.n):
            size = larger(absolute(lanes(w.z[STAGES - 1, m])), absolute(lanes(w.y[m])))
            roundoff = larger(roundoff, EPS * size / lanes(w.weight[m]))
        met = norm <= newton.ROUNDINGS * roundoff
        if iteration > 0 or w.rtol < tables.COARSE_RTOL:
            met = met | (goes_on & (contraction * norm <= newton.NEWTON_PART))
        solved = solved | (active & met)
        active = active & goes_on & ~met
        if not any_lane(active):
            break
        last = larger(norm, same(TINY))
    put(w.theta, theta)
    put(w.contraction, contraction)
    return solved


@compiled
def _filter(w: Any) -> None:
    """Overwrite defects of rates by errors of states, through the real Newton matrix.

    Unfiltered, the defect of a stiff component would be as large as its rate (Hairer & Wanner II, IV.8).
    """
    for m in range(w.n):
        put(w.imaginary[m], 0.0)
    solve(w, 0, w.rhs, w.imaginary)


@compiled
def _estimate(w: Any, rates: Any) -> None:
    """The error of the step, from the defect of its polynomial against these rates at the start, filtered through the
    Newton matrix.
    """
    every, rate = LANES * w.n, 1.0 / lanes(w.h)
    _start_slope(0, w.z.ctypes.data, every, every, w.rhs.ctypes.data)
    for m in range(w.n):
        put(w.rhs[m], lanes(rates[m]) - rate * lanes(w.rhs[m]))
    _filter(w)


@compiled
def _error_norm(w: Any) -> Any:
    """The norm of the local error; filtered twice in a stiff transient, where the first estimate is too large."""
    _estimate(w, w.k[0])
    for m in range(w.n):
        put(w.error[m], lanes(w.rhs[m]))
    norm = error_norm(w, w.error) / w.loose
    again = (norm >= 1.0) & ((lanes(w.again) > 0.5) | ~(lanes(w.h_last) > 0.0)) & (lanes(w.h) > 0.0)
    if any_lane(again):
        put_moved(w, 0.0, w.error, 1.0)
        evaluate(w, RESIDUAL, w.rates)
        _estimate(w, w.rates)
        for m in range(w.n):
            put_where(again, w.error[m], lanes(w.rhs[m]))
        norm = where(again, smaller(norm, error_norm(w, w.error) / w.loose), norm)
    return norm


@compiled
def _ledger_norm(w: Any) -> Any:
    """The norm of the quadrature errors, less what is explained (``change``), in units of what is allowed."""
    h, norm = lanes(w.h), same(0.0)
    for group in range(N_GROUPS):
        miss, scale = same(0.0), same(TINY)
        for m in range(w.n_ledger):
            if w.groups[m] == group:
                defect = absolute(lanes(w.coarse[w.n + m]))
                # The quadrature of a smooth rate is better than its polynomial, by 4/5 of this power; 3/4 is what
                # products give.
                part = square_root(defect / larger(larger(lanes(w.q_rate[m]), defect), same(TINY)))
                miss = larger(miss, h * defect * part * square_root(part) - lanes(w.change[w.n + m]))
                scale = larger(scale, lanes(w.q_scale[m]))
        norm = larger(norm, miss / scale)
    return norm / ledger_rtol(w.rtol)


@compiled
def _integrate_ledger(w: Any) -> Any:
    """Integrate the ledger over the step, and return the norm of its error."""
    for i in range(STAGES):
        _put_stage(w, i)
        evaluate(w, RATES, w.k[1 + i])
        _put_slopes(w, i)
    h, every = lanes(w.h), LANES * w.columns
    _weights(0, w.k.ctypes.data, every, every, w.change.ctypes.data)
    _defect_at_start(0, w.k.ctypes.data, every, every, w.coarse.ctypes.data)
    for m in range(w.n, w.columns):
        put(w.y_new[m], lanes(w.y[m]) + h * lanes(w.change[m]))
        put(w.k[1 + STAGES, m], lanes(w.coarse[m]))
    scale_ledger(w, 1 + STAGES)
    for m in range(w.n_ledger):
        put(w.change[w.n + m], 0.0)
    norm = _ledger_norm(w)
    counts = norm > NEGLIGIBLE
    if any_lane(counts):
        # As in single runs, less the part that an error of the states within their tolerance causes: without it a rate
        # of states far below their tolerance would be held against itself.
        _put_stage(w, STAGES - 1)
        _move_states(w)
        evaluate(w, RATES, w.rates)
        for m in range(w.n, w.columns):
            put(w.change[m], h * absolute(lanes(w.rates[m]) - lanes(w.k[STAGES, m])))
        norm = where(counts, _ledger_norm(w), norm)
    blank = same(0.0)
    for m in range(w.n, w.columns):
        blank = blank + 0.0 * lanes(w.coarse[m])  # NaN where a rate is, which comparisons would lose
    return blank + where(is_brief(w), 0.0, norm)


@compiled
def try_step(w: Any) -> None:
    """Solve for all stages of a step of each lane, and find the norm of its local error."""
    differentiate(w)
    rate = 1.0 / lanes(w.h)
    for s in range(3):
        factor(w, s, w.jacobian, EIGENVALUES[s].real * rate, EIGENVALUES[s].imag * rate)
    _predict(w)
    solved = _solve_stages(w)
    for m in range(w.n):
        put(w.y_new[m], lanes(w.y[m]) + lanes(w.z[STAGES - 1, m]))
    solved = solved & ~_are_astray(w)
    norm = _error_norm(w)
    if w.n_ledger > 0:
        ledger = _integrate_ledger(w)
        norm = where(ledger <= norm, norm, ledger + 0.0 * norm)  # NaN where either is
    else:
        for i in range(STAGES):
            _put_slopes(w, i)
    for m in range(w.n):
        put(w.k[1 + STAGES, m], tables.GAMMA[MEMBER] * lanes(w.error[m]) / lanes(w.h))
    first = (lanes(w.guess_error) < np.inf) & (lanes(w.again) < 0.5)
    put(w.norm, where(solved, norm, where(first, DIVERGED, np.inf)))


@compiled
def limit_size(w: Any) -> None:
    """Limit the size of the next step such that Newton's method contracts well, too."""
    # Shorten the repetition of a step that fails again by the order in its size that its error has shown: it is lower
    # than usual in a transient, and where the rate of an account is singular at the start.
    norm, before = lanes(w.norm), lanes(w.norm_tried)
    fails = (lanes(w.again) > 0.5) & (norm >= 1.0) & (norm < before)
    if any_lane(fails):
        inverse = logarithm(lanes(w.h_tried) / lanes(w.h)) / logarithm(before / norm)
        size = lanes(w.h) * larger(SAFETY * exponential(0.0 - inverse * logarithm(norm)), same(MIN_GROWTH))
        put_where(fails, w.following, smaller(size, lanes(w.following)))
    h, theta = lanes(w.h), where(lanes(w.guess_error) > 1.0, lanes(w.theta), 0.0)
    convergent = h * larger(square_root(CONTRACTING / theta), same(LEAST_CONVERGENT))
    put(w.following, smaller(lanes(w.following), where(theta > 0.0, convergent, np.inf)))
    limit_growth(w)


@compiled
def limit_growth(w: Any) -> None:
    """Limit the next step such that states below their tolerances, where no error counts, grow at most e-fold, each by
    its own derivative or two by one another's.
    """
    fastest = same(0.0)
    for m in range(w.n):
        driven = (lanes(w.y[m]) > 0.0) | (lanes(w.y[m]) < 0.0) | (absolute(lanes(w.k[0, m])) > 0.0)
        grows = driven & (absolute(lanes(w.y[m])) < w.atol[m])
        if any_lane(grows):
            first = lanes(w.jacobian[m, m])
            fastest = where(grows, larger(fastest, first), fastest)
            for other in range(w.n):
                if other == m:
                    continue
                second = lanes(w.jacobian[other, other])
                both = lanes(w.jacobian[other, m]) * lanes(w.jacobian[m, other])
                pair = grows & (both > 0.0) & (absolute(lanes(w.y[other])) < w.atol[other])
                half = (first - second) / 2.0
                root = square_root(where(pair, half * half + both, 0.0))
                growth = (first + second) / 2.0 + root
                beyond = growth > FORMULA_EPS * (absolute(first) + absolute(second) + root)
                fastest = where(pair & beyond, larger(fastest, growth), fastest)
    put(w.following, smaller(lanes(w.following), where(fastest > 0.0, 1.0 / fastest, np.inf)))


@compiled
def put_roughly(w: Any, x: float) -> None:
    """Set the inputs to time and state at a quarter point of each step, by its polynomial."""
    h = lanes(w.h)
    _quarters(int(4.0 * x) - 1, w.k.ctypes.data, LANES * w.columns, LANES * w.n, w.rates.ctypes.data)
    put_moved(w, x * h, w.rates, h)


@compiled
def interpolate(w: Any, columns: int) -> None:
    """The polynomials of the steps, of the first so many columns."""
    for d in range(ORDER):
        _polynomial(d, w.k.ctypes.data, LANES * w.columns, LANES * columns, w.polynomial[d].ctypes.data)


@compiled
def find_defects(w: Any, lane: int, x: Any) -> None:
    """The defects of the dense output of a lane at eight fractions x of its step, of the states as errors; of accounts
    at the state that is corrected by its error, which a fast rate would magnify.
    """
    inputs = w.inside[lane]
    put_points(w, lane, x)
    evaluate_at(w, RESIDUAL, inputs, w.rhs)
    for m in range(w.n):
        put(w.rhs[m], lanes(w.rhs[m]) - polynomial_of(w.slope_of, m, lane, x))
    solve_of(w, lane, w.rhs)
    for m in range(w.n):
        put(inputs[1 + m], lanes(inputs[1 + m]) + lanes(w.rhs[m]))
    if w.n_ledger > 0:
        evaluate_at(w, RATES, inputs, w.rates)
    for m in range(w.n):
        put(w.rates[m], tables.GAMMA[DENSEST] / w.h[lane] * lanes(w.rhs[m]))
    for m in range(w.n, w.columns):
        put(w.rates[m], lanes(w.rates[m]) - polynomial_of(w.slope_of, m, lane, x))


@compiled
def check_outputs(w: Any) -> None:
    """End a step at its next output where the polynomial between the stages is less accurate than the step."""
    shown = (lanes(w.next_output) < lanes(w.t_new)) & (lanes(w.defect_at) == 1.0)
    differentiate_polynomials(w, w.n)
    x = same(tables.PROBE[MEMBER])
    put_inside(w, x)
    evaluate(w, RESIDUAL, w.rhs)
    for m in range(w.n):
        put(w.rhs[m], lanes(w.rhs[m]) - polynomial(w.slope_of, m, x))
    _filter(w)
    serves = shown
    for m in range(w.n):
        serves = serves & (absolute(lanes(w.rhs[m])) <= POLYNOMIAL_ERROR * lanes(w.weight[m]))
    until = (lanes(w.next_output) - lanes(w.t)) / lanes(w.h)
    put_where(shown & ~serves, w.defect_at, until)


@compiled
def keep_step(w: Any) -> None:
    """Keep the slopes at the stages of the steps that are taken, from which the next ones are predicted."""
    keep_derivatives(w)
    taken = lanes(w.taken) > 0.5
    for i in range(STAGES):
        for m in range(w.n):
            put_where(taken, w.k_last[i, m], lanes(w.k[1 + i, m]))


run_by_radau = loop_of(
    "RadauLanes", STAGES, POWER, RADAU_MEMORY,
    root_of=root_of, try_step=try_step, limit_size=limit_size, find_noise=nothing, find_stiff=nothing,
    put_roughly=put_roughly, interpolate=interpolate, put_matrices=nothing, find_defects=find_defects,
    check_outputs=check_outputs, keep_step=keep_step,
)  # fmt: skip
"""Solve the runs of a batch."""
