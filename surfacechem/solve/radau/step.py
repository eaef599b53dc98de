"""Error estimate and choice of step size and order of the Radau IIA family.

The estimate compares the derivative of the collocation polynomial at the start of the step with the true one,
filtered through the real Newton matrix (Hairer & Wanner II, IV.8). It has order s while the method has order 2s - 1,
hence the loosened tolerance.
"""

from typing import Any

import numpy as np

from surfacechem.solve.radau.consistency import CONSISTENT, find_consistent
from surfacechem.solve.radau.linear import solve_real
from surfacechem.solve.radau.newton import stage_count
from surfacechem.solve.radau.roundoff import find_noise
from surfacechem.solve.radau.tables import START_SLOPE
from surfacechem.solve.radau.work import (
    ATOL,
    BASE,
    CALM,
    DELTA,
    ERROR,
    GUESSED,
    LOOSE,
    MEMBER,
    NOISE,
    RESIDUAL,
    RESIDUALS,
    ROUNDING,
    RTOL,
    SCALE,
    TAU,
    THETA,
    TRIAL,
    TRIAL_DOT,
    TRIES,
    WEIGHT,
    YDOT,
    Y,
    compiled,
    evaluate,
    finite,
    set_inputs,
)

SAFETY = 0.9
GROWTH = 8.0
SHRINK = 0.1
TINIEST = 1e-290
MAGNIFIED = 10.0
"""Noise of the estimate, which extrapolates the noise of every stage, in units of that of one residual."""
CONTRACTING = 0.05
"""Contraction of Newton's method aimed at: where it limits the step, a failure costs more than a smaller step."""
LEAST_CONVERGENT = 0.5
NOISY = 0.05
"""Error assumed where the estimate is noise, so that the step grows slowly."""


@compiled
def set_weights(w: Any) -> None:
    """Weights of the error norm, the typical sizes for pivoting, and the size of rounding errors in that norm."""
    rounding = 0.0
    for j in range(w.algebraic.shape[0]):
        size = abs(w.vector[Y, j])
        weight = max(w.vector[ATOL, j] + w.clock[RTOL] * size, TINIEST)
        w.vector[WEIGHT, j] = weight
        w.vector[SCALE, j] = max(size, weight)
        rounding = max(rounding, 2.3e-16 * size / weight)
    w.clock[ROUNDING] = rounding


@compiled
def preferred_member(rtol: float) -> int:
    """Low order for loose tolerances, high order for tight ones."""
    if rtol > 2e-5:
        return 0
    return 1 if rtol > 3e-12 else 2


@compiled
def loosening(rtol: float) -> float:
    """How much larger the low-order estimate may be than the tolerance."""
    return float(min(max(rtol, 1e-14), 0.1) ** -0.25)


@compiled
def filter_residual(w: Any) -> bool:
    """Residual at the inputs through the real Newton matrix, an error of the state, into ERROR."""
    error = w.vector[ERROR]
    evaluate(w, RESIDUAL, error.ctypes.data)
    w.count[RESIDUALS] += 1
    solve_real(w, error)
    for j in range(error.shape[0]):
        error[j] = -error[j]
    return bool(finite(error))


@compiled
def error_norm(w: Any, floor: float) -> float:
    """Norm of the part of the error above so many times the noise."""
    norm = 0.0
    last = stage_count(w.count[MEMBER]) - 1
    for j in range(w.algebraic.shape[0]):
        size = max(abs(w.vector[Y, j]), abs(w.vector[Y, j] + w.z[last, j]))
        weight = max(w.vector[ATOL, j] + w.clock[RTOL] * size, TINIEST)
        norm = max(norm, (abs(w.vector[ERROR, j]) - floor * w.vector[NOISE, j]) / weight)
    return norm / w.clock[LOOSE]


@compiled
def estimate_error(w: Any, h: float) -> float:
    """Norm of the local error."""
    k = w.count[MEMBER]
    n = w.algebraic.shape[0]
    for m in range(n):
        slope = 0.0
        for j in range(stage_count(k)):
            slope += START_SLOPE[k, j] * w.z[j, m]
        w.vector[DELTA, m] = slope / h
    w.inputs[0] = w.clock[BASE] + w.clock[TAU]
    set_inputs(w, w.vector[Y], w.vector[DELTA])
    if not filter_residual(w):
        return np.inf
    norm = error_norm(w, 0.0)
    if norm < NOISY:
        return norm
    find_noise(w)
    return float(max(error_norm(w, MAGNIFIED), NOISY))


@compiled
def estimate_again(w: Any) -> float:
    """The estimate filtered a second time, where a stiff transient made the first one too large."""
    for m in range(w.algebraic.shape[0]):
        w.inputs[1 + m] = w.vector[Y, m] + w.vector[ERROR, m]
    if not filter_residual(w):
        return np.inf
    return float(max(error_norm(w, MAGNIFIED), NOISY))


@compiled
def next_size(w: Any, h: float, norm: float, h_last: float, norm_last: float) -> float:
    """Gustafsson's predictive controller; h_last = 0 where there is no accepted step before."""
    k = w.count[MEMBER]
    limit = 7 + 2 * k
    safety = min(SAFETY, SAFETY * (2.0 * limit + 1.0) / (2.0 * limit + w.count[TRIES]))
    exponent = 1.0 / (stage_count(k) + 1.0)
    factor = safety * max(norm, 1e-12) ** -exponent
    if h_last > 0.0 and norm < 1.0:
        factor = min(factor, factor * h / h_last * (norm_last / max(norm, 1e-12)) ** exponent)
    return h * min(GROWTH, max(SHRINK, factor))


@compiled
def convergent_size(w: Any, h: float) -> float:
    """Step size at which Newton's method will contract as it should, if its contraction is like the square of the
    step size; any where the first guess was good or rounding ended the iteration: then the contraction tells nothing.
    """
    theta = w.clock[THETA] if w.clock[GUESSED] > 1.0 else 0.0
    return h * max(LEAST_CONVERGENT, np.sqrt(CONTRACTING / theta)) if theta > 0.0 else np.inf


@compiled
def choose_member(w: Any, slowest: float) -> bool:
    """Lower order where Newton contracts slower than this, back up after a few easy steps; True if the member
    changed.
    """
    k = w.count[MEMBER]
    if w.clock[THETA] > slowest:
        w.count[CALM] = 0
        w.count[MEMBER] = max(0, k - 1)
    elif w.clock[THETA] < 0.05:
        w.count[CALM] += 1
        if w.count[CALM] >= 3:
            w.count[MEMBER] = min(k + 1, preferred_member(w.clock[RTOL]))
    else:
        w.count[CALM] = 0
    if w.count[MEMBER] != k:
        w.count[CALM] = 0
    return bool(w.count[MEMBER] != k)


@compiled
def growing_size(w: Any) -> float:
    """Step in which what is still below the tolerance, where no error counts, grows no more than e-fold by its own
    derivative alone.

    The method would damp what grows much faster, and never leave an equilibrium that is unstable. What is nothing and
    is driven by nothing does not grow.
    """
    mass, stiffness = w.jacobian[1], w.jacobian[0]
    fastest = 0.0
    for j in range(mass.shape[0]):
        driven = w.vector[Y, j] != 0.0 or w.vector[YDOT, j] != 0.0
        if driven and mass[j, j] != 0.0 and abs(w.vector[Y, j]) < w.vector[ATOL, j]:
            fastest = max(fastest, -stiffness[j, j] / mass[j, j])
    return 1.0 / fastest if fastest > 0.0 else np.inf


@compiled
def _rate_norm(w: Any, rate: Any) -> float:
    norm = 0.0
    for j in range(w.algebraic.shape[0]):
        if not w.algebraic[j]:
            norm = max(norm, abs(rate[j]) / w.vector[WEIGHT, j])
    return norm / w.clock[LOOSE]


@compiled
def first_size(w: Any, span: float) -> float:
    """Step over which the change of the rate, felt by a small trial step, stays within the tolerance."""
    n = w.algebraic.shape[0]
    speed = _rate_norm(w, w.vector[YDOT])
    if not 0.0 < speed < np.inf:
        return 1e-3 * span
    size = 0.0
    for j in range(n):
        size = max(size, abs(w.vector[Y, j]) / w.vector[WEIGHT, j])
    trial = min(max(1e-6 * size / w.clock[LOOSE], 1e-2) / speed, 1e-3 * span)
    for j in range(n):
        w.vector[TRIAL, j] = w.vector[Y, j] + (0.0 if w.algebraic[j] else trial * w.vector[YDOT, j])
        w.vector[TRIAL_DOT, j] = w.vector[YDOT, j]
    w.inputs[0] = w.clock[BASE] + (w.clock[TAU] + trial)
    if find_consistent(w) != CONSISTENT:
        return trial
    for j in range(n):
        w.vector[TRIAL_DOT, j] -= w.vector[YDOT, j]
    change = _rate_norm(w, w.vector[TRIAL_DOT]) / speed
    if not change * span > 1e-9 * trial:
        return 0.05 * span
    # Ratios first: a rate of 1e200 over 1e-200 s would overflow.
    time_scale = trial / change
    exponent = 1.0 / (stage_count(w.count[MEMBER]) + 1.0)
    return min(time_scale * min(1.0, (speed * time_scale) ** -exponent), 0.05 * span)
