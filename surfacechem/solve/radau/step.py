"""One accepted step: error estimate, choice of size and order, trials until one passes, and checks against the
equations between the stages.

The estimate compares the derivative of the collocation polynomial at the start of the step with the true one, filtered
through the real Newton matrix (Hairer & Wanner II, IV.8). It has order s while the method has order 2s - 1, hence the
loosened tolerance.

A step evaluates the equations only at its stages, and so does its error estimate: neither sees a narrow feature between
two of them. Steps longer than a given spacing are therefore checked: equations and ledger are evaluated at further
points, at most that far apart. Narrow features lie where a formula changes, hence at the ends of a load segment: its
first and its last step are checked at points ever closer to these ends. A step whose polynomial disagrees with the
equations is too long.
"""

from typing import Any

import numpy as np

from surfacechem.solve.contract import Status
from surfacechem.solve.radau.consistency import CONSISTENT, NO_STATE, SINGULAR_STATE, find_consistent
from surfacechem.solve.radau.dense import (
    defect_norm,
    explained_norm,
    keep_polynomial,
    probe_ledger,
    put_inside,
)
from surfacechem.solve.radau.explicit import (
    DENSEST,
    MAX_ERROR_RATIO,
    STIFF_STEPS,
    is_long,
    may_be_narrow,
    put_rates,
    step_explicitly,
)
from surfacechem.solve.radau.linear import solve_real
from surfacechem.solve.radau.newton import (
    CONVERGED,
    NOT_FINITE,
    OPEN,
    SHORTENED,
    differentiate_at_end,
    differentiate_system,
    divide,
    end_of_step,
    factor_newton,
    predict,
    set_stage,
    solve_stages,
    stage_count,
    value_and_slope,
)
from surfacechem.solve.radau.roundoff import MAGNIFIED, find_noise, spread_noise
from surfacechem.solve.radau.stepper import STOP
from surfacechem.solve.radau.tables import GAMMA, MEMBER_RTOLS, START_SLOPE
from surfacechem.solve.radau.work import (
    LEDGER,
    RATES,
    RESIDUAL,
    compiled,
    copy,
    evaluate,
    finite,
    put,
    row_of,
    set_inputs,
)
from surfacechem.tolerances import EPS, FORMULA_EPS, LEAST_WEIGHT, NEGLIGIBLE, NEWTON_EPS, RUN_EPS, SQRT_EPS, TINY, ULPS

# The first two as in RADAU5 (Hairer & Wanner II, IV.8).
SAFETY = 0.9
MAX_GROWTH = 8.0
MIN_GROWTH = 0.1
CONTRACTING = 0.05
"""Newton contraction aimed at: where it limits the step, a failure costs more than a smaller step."""
LEAST_CONVERGENT = 0.5
NOISY = 0.05
"""Error assumed where the estimate is roundoff, so that the step grows slowly."""


@compiled
def set_weights(w: Any) -> None:
    """Set the weights of the error norm, the typical sizes for pivoting, and the size of roundoff in that norm."""
    rounding = 0.0
    for j in range(w.n):
        size = abs(w.y[j])
        weight = max(w.atol[j] + w.rtol * size, LEAST_WEIGHT)
        w.weight[j] = weight
        w.scale[j] = max(size, weight)
        rounding = max(rounding, EPS * size / weight)
    w.roundoff = rounding


@compiled
def preferred_member(rtol: float) -> int:
    """Member of the family for a tolerance: low order for loose ones, high order for tight ones."""
    return 0 if rtol > MEMBER_RTOLS[0] else 1 if rtol > MEMBER_RTOLS[1] else 2


@compiled
def loosening(rtol: float) -> float:
    """Factor by which the low-order error estimate may exceed the tolerance."""
    # The estimate has about half the order of the method: it exceeds the true error by more the tighter the tolerance.
    return float(min(max(rtol, NEWTON_EPS), 0.1) ** -0.25)


@compiled
def filter_residual(w: Any) -> bool:
    """Filter the residual at the inputs through the real Newton matrix into ``error``, an error of the state; True if
    finite.
    """
    # Unfiltered, the defect of a stiff component would be as large as its rate (Hairer & Wanner II, IV.8).
    error = w.error
    w.residuals += 1
    if w.explicit != 0:
        evaluate(w, RATES, error)
        for j in range(w.n):
            error[j] = (error[j] - w.inputs[1 + w.n + j]) * w.h_factored / GAMMA[DENSEST]
    else:
        evaluate(w, RESIDUAL, error)
        solve_real(w, error)
        for j in range(w.n):
            error[j] = -error[j]
    return bool(finite(error))


@compiled
def error_norm(w: Any, floor: float) -> float:
    """Norm of the error, of which ``floor`` times the noise is not counted."""
    norm = 0.0
    last = stage_count(w.member) - 1
    for j in range(w.n):
        size = max(abs(w.y[j]), abs(w.y[j] + w.z[last, j]))
        weight = max(w.atol[j] + w.rtol * size, LEAST_WEIGHT)
        norm = max(norm, (abs(w.error[j]) - floor * w.noise[j]) / weight)
    return norm / w.loose


@compiled
def _set_start_slope(w: Any, h: float) -> None:
    """Store the slope of the polynomial at the start of the step in ``delta``."""
    k = w.member
    for m in range(w.n):
        slope = 0.0
        for j in range(stage_count(k)):
            slope += START_SLOPE[k, j] * w.z[j, m]
        w.delta[m] = slope / h


@compiled
def _defect_at_start(w: Any, h: float, y: Any) -> bool:
    """Store the defect of the polynomial's slope at the start of the step in ``error``; True if finite."""
    _set_start_slope(w, h)
    put(w, 0.0, y, w.delta)
    return bool(filter_residual(w))


@compiled
def estimate_error(w: Any, h: float) -> float:
    """Norm of the local error."""
    if not _defect_at_start(w, h, w.y):
        return np.inf
    norm = error_norm(w, 0.0)
    if norm < NOISY:
        return norm
    # The noise costs eight evaluations: it is found only where the estimate may reject the step.
    find_noise(w)
    return float(max(error_norm(w, MAGNIFIED), NOISY))


@compiled
def estimate_again(w: Any, h: float) -> float:
    """Filter the estimate a second time, where a stiff transient made the first one too large."""
    for m in range(w.n):
        w.trial[m] = w.y[m] + w.error[m]
    # The slope is formed again, since find_noise has overwritten the inputs.
    if not _defect_at_start(w, h, w.trial):
        return np.inf
    return float(max(error_norm(w, MAGNIFIED), NOISY))


@compiled
def _may_hide(w: Any, h: float) -> bool:
    """True if the defect at the start of the step, which stiff equations filter, exceeds the tolerance without them."""
    _set_start_slope(w, h)
    for j in range(w.n):
        if not w.algebraic[j] and abs(w.delta[j] - w.ydot[j]) * h > w.loose * w.weight[j] * GAMMA[w.member]:
            return True
    return False


@compiled
def repeat_step(w: Any, size: float) -> float:
    """Repeat the step, or a part of it, with the size for which the matrices are factored and the full order of the
    method; return the norm of its error, infinite if it fails.
    """
    if w.explicit != 0:
        return float(step_explicitly(w, size, np.inf))
    predict(w, size)
    return float(estimate_error(w, size)) if solve_stages(w, size) <= OPEN else np.inf


@compiled
def next_size(w: Any, h: float, norm: float, h_last: float, norm_last: float) -> float:
    """Propose a step size by Gustafsson's predictive controller; h_last = 0 where there is no accepted step before.

    Source: Gustafsson (1994), Control-theoretic techniques for stepsize selection in implicit Runge-Kutta methods, ACM
    Trans. Math. Softw. 20; the safety factor for many iterations from Hairer & Wanner II, IV.8.
    """
    k = w.member
    limit = 7 + 2 * k
    safety = min(SAFETY, SAFETY * (2.0 * limit + 1.0) / (2.0 * limit + w.newton_steps))
    # The estimate of s stages goes with h^(s+1).
    exponent = 1.0 / (stage_count(k) + 1.0)
    factor = safety * max(norm, RUN_EPS) ** -exponent
    if h_last > 0.0 and norm < 1.0:
        factor = min(factor, factor * h / h_last * (norm_last / max(norm, RUN_EPS)) ** exponent)
    return h * min(MAX_GROWTH, max(MIN_GROWTH, factor))


@compiled
def choose_member(w: Any, slowest: float) -> bool:
    """Lower the order where Newton contracts slower than ``slowest``, raise it after a few easy steps; True if it
    changed.

    Source: Hairer & Wanner (1999), J. Comput. Appl. Math. 111: high order pays while the iteration is easy.
    """
    k = w.member
    easy = w.easy_steps + 1 if w.theta < 0.05 else 0
    if w.theta > slowest:
        w.member = max(0, k - 1)
    elif easy >= 3:
        w.member = min(k + 1, preferred_member(w.rtol))
    w.easy_steps = easy if w.member == k else 0
    return bool(w.member != k)


@compiled
def growing_size(w: Any) -> float:
    """Step size in which states below their tolerances, where no error counts, grow at most e-fold, each by its own
    derivative or two by one another's.

    The method damps a state that grows much faster, and would never leave an unstable equilibrium. A state that is
    exactly zero with zero rate does not grow.
    """
    if w.jacobian_age == INVALID:
        return np.inf
    mass, stiffness = w.jacobian[1], w.jacobian[0]
    fastest = 0.0
    for j in range(mass.shape[0]):
        driven = w.y[j] != 0.0 or w.ydot[j] != 0.0
        if driven and mass[j, j] != 0.0 and abs(w.y[j]) < w.atol[j]:
            own = -stiffness[j, j] / mass[j, j]
            fastest = max(fastest, own)
            # As in branching chains; where amounts feed one another all grow no slower than two of them.
            for i in range(mass.shape[0]):
                if i != j and stiffness[i, j] * stiffness[j, i] > 0 and mass[i, i] != 0 and abs(w.y[i]) < w.atol[i]:
                    both = stiffness[i, j] / mass[i, i] * (stiffness[j, i] / mass[j, j])
                    fastest = max(fastest, _growth_of_two(own, -stiffness[i, i] / mass[i, i], both))
    return 1.0 / fastest if fastest > 0.0 else np.inf


@compiled
def _growth_of_two(first: float, second: float, both: float) -> float:
    """Growth rate of two states with these derivatives of their rates by themselves, and this product of those by one
    another; zero within roundoff, as of a fast exchange.
    """
    half = (first - second) / 2
    root = np.sqrt(half * half + both)
    growth = (first + second) / 2 + root
    return growth if growth > FORMULA_EPS * (abs(first) + abs(second) + root) else 0.0


@compiled
def _rate_norm(w: Any, rate: Any) -> float:
    norm = 0.0
    for j in range(w.n):
        if not w.algebraic[j]:
            norm = max(norm, abs(rate[j]) / w.weight[j])
    return norm / w.loose


@compiled
def first_size(w: Any, span: float) -> float:
    """First step size: the change of the rate over a small trial step keeps within the tolerance, but time resolves
    loads in it.

    Source: Hairer, Norsett & Wanner, Solving Ordinary Differential Equations I, section II.4.
    """
    n = w.n
    speed = _rate_norm(w, w.ydot)
    if not 0.0 < speed < np.inf:
        return NEGLIGIBLE * span
    size = 0.0
    for j in range(n):
        size = max(size, abs(w.y[j]) / w.weight[j])
    # Within a trial step the state changes by a millionth of itself at most, or by a hundredth of the tolerance.
    trial = min(max(NEGLIGIBLE**2 * size / w.loose, 1e-2) / speed, NEGLIGIBLE * span)
    for j in range(n):
        w.trial[j] = w.y[j] + (0.0 if w.algebraic[j] else trial * w.ydot[j])
        w.trial_dot[j] = w.ydot[j]
    w.inputs[0] = w.base + (w.tau + trial)
    if w.explicit != 0:
        set_inputs(w, w.trial, w.ydot)
        put_rates(w, w.trial_dot)
    elif find_consistent(w) != CONSISTENT:
        return trial
    for j in range(n):
        w.trial_dot[j] -= w.ydot[j]
    change = _rate_norm(w, w.trial_dot) / speed
    if not change * span > SQRT_EPS * trial:
        return 0.05 * span
    # Divide first: a rate of 1e200 over 1e-200 s would overflow.
    time_scale = trial / change
    exponent = 1.0 / (stage_count(w.member) + 1.0)
    size = max(time_scale * min(1.0, (speed * time_scale) ** -exponent), NEWTON_EPS * w.base)
    return min(size, 0.05 * span)


INVALID, OLD, CURRENT = range(3)
"""States of the stored Jacobian: not valid, taken at an earlier state, or taken at the current one."""

SLOW, SLOW_REJECTED = 0.8, 0.3
"""Newton contraction from which on a lower order is better, after an accepted and after a rejected step."""

SINGULAR_TRIALS = 12
"""Step sizes tried where matrices are singular: the last is 0.37^12 = 7e-6 of the first."""

JACOBIAN_GROWTH = 10.0
"""Growth of the step after which the Jacobian is renewed: one from where the equations were far stiffer makes
corrections small however large the remaining error is.
"""

GOOD = -1
"""Outcome where a run may go on; others are numbers of a status."""
FINISHED, EVENT = int(Status.FINISHED), int(Status.EVENT)
STEP_UNDERFLOW, MAX_STEPS = int(Status.STEP_UNDERFLOW), int(Status.MAX_STEPS)
NONFINITE, NO_CONSISTENT = int(Status.NOT_FINITE), int(Status.NO_CONSISTENT_STATE)
SINGULAR, STOPPED, LEFT = int(Status.SINGULAR), int(Status.STOPPED), int(Status.LEFT)


@compiled
def _reset_newton(w: Any) -> None:
    """Reset what implicit steps know of those before."""
    w.h_last = w.h_factored = w.theta = w.guess_error = 0.0
    w.contraction = 1.0
    w.easy_steps = 0
    w.jacobian_age = INVALID
    w.member = preferred_member(w.rtol)


@compiled
def restart(w: Any) -> int:
    """Make the state consistent and reset the history of steps; time is counted from here."""
    w.base += w.tau
    w.tau = 0.0
    w.ledger_rejections = min(w.ledger_rejections, (w.steps - w.steps_before) // 2)
    _reset_newton(w)
    w.inputs[0] = w.base
    if w.explicit != 0:
        set_inputs(w, w.y, w.ydot)
        put_rates(w, w.trial_dot)
        if finite(w.trial_dot):
            copy(w.trial_dot, w.ydot)
            w.member = DENSEST
        else:
            w.explicit = 0
    if w.explicit == 0:
        copy(w.y, w.trial)
        copy(w.ydot, w.trial_dot)
        outcome = find_consistent(w)
        if outcome != CONSISTENT:
            return NO_CONSISTENT if outcome == NO_STATE else SINGULAR if outcome == SINGULAR_STATE else NONFINITE
        copy(w.trial, w.y)
        copy(w.trial_dot, w.ydot)
    # Rates at the start of the first step; later steps reuse those at the end of the step before.
    if w.n_ledger > 0:
        set_inputs(w, w.y, w.ydot)
        evaluate(w, LEDGER, w.rates[7])
    set_weights(w)
    return GOOD


@compiled
def _prepare(w: Any, h: float, foresee: bool) -> int:
    """Provide the Newton matrices for this step size, reusing valid ones."""
    if w.h_factored == h:
        return GOOD
    outgrown = w.theta >= NEGLIGIBLE or h > JACOBIAN_GROWTH * w.h_jacobian
    if w.jacobian_age == INVALID or (w.jacobian_age == OLD and outgrown):
        if not differentiate_system(w, h, foresee):
            return NONFINITE
        w.jacobian_age = CURRENT
        w.h_jacobian = h
    return GOOD if _factor(w, h) else SINGULAR


@compiled
def _factor(w: Any, h: float) -> bool:
    """Factor the Newton matrices for this step size; True if none is singular."""
    w.h_factored = 0.0  # invalid until the factorization succeeds
    copy(w.scale, w.pivot)
    if not factor_newton(w, h):
        return False
    w.h_factored = h
    return True


@compiled
def _is_astray(w: Any, h: float) -> bool:
    """True if the residuals at the end of the step, through the matrices there, are an error beyond tolerance and
    roundoff.
    """
    set_stage(w, stage_count(w.member) - 1, h)
    for j in range(w.n):
        w.trial[j], w.trial_dot[j], w.error[j] = w.inputs[1 + j], w.inputs[1 + w.n + j], w.rhs[j]
    solve_real(w, w.error)
    if error_norm(w, 0.0) * w.loose <= 1.0:
        return False
    spread_noise(w, w.trial, w.trial_dot)
    return not error_norm(w, MAGNIFIED) * w.loose <= 1.0


@compiled
def _estimate_at_end(w: Any, h: float, size_last: float) -> float:
    """Norm of the local error, filtered through the matrices at the end of the step; given are residuals there, and the
    noise of the step.

    Where the equations are soft before the first stage, the stages do not see how far the rates before have moved the
    states, and the matrix at the start hides it.
    """
    _set_start_slope(w, h)
    set_stage(w, stage_count(w.member) - 1, h)
    for j in range(w.n):
        w.inputs[1 + w.n + j] += 0.0 if w.algebraic[j] else w.delta[j] - w.ydot[j]
    evaluate(w, RESIDUAL, w.error)
    w.residuals += 1
    for i in range(w.n):
        w.error[i] -= w.rhs[i]
    solve_real(w, w.error)
    if size_last > 0.0:
        # Rates at the start are slopes of the last step, with the noise of its stages.
        return float(error_norm(w, MAGNIFIED * max(1.0, h / size_last)))
    find_noise(w)
    return float(error_norm(w, MAGNIFIED))


@compiled
def _norm_at_end(w: Any, h: float, size_last: float, is_open: bool, hides: bool) -> float:
    """Norm of the error as the matrices at the end of the step tell, which replace those of the step; infinite if they
    are singular, or if the end of the step is open through them.
    """
    copy(w.error, w.columns)
    if hides:
        find_noise(w)
    regular = differentiate_at_end(w, h)
    w.jacobian_age, w.h_jacobian = CURRENT, h
    evaluate(w, RESIDUAL, w.rhs)
    w.residuals += 1
    norm = np.inf
    if regular and finite(w.rhs) and _factor(w, h):
        norm = _estimate_at_end(w, h, size_last) if hides else 0.0
        if is_open and _is_astray(w, h):
            norm = np.inf
    copy(w.columns, w.error)
    return norm


@compiled
def _try_step(w: Any, h: float, repeated: bool, size_last: float) -> tuple[int, float]:
    """Solve the stages of a step and estimate its error; return the outcome of Newton's method and the norm of the
    error.

    What the matrix of the step may hide, those at its end tell.
    """
    outcome = solve_stages(w, h)
    if outcome > OPEN:
        return outcome, np.inf
    norm = estimate_error(w, h)
    hides = norm < 1.0 and _may_hide(w, h)
    if norm >= 1.0 and repeated:
        norm = min(norm, estimate_again(w, h))
    if norm < 1.0 and (hides or outcome == OPEN):
        norm = max(norm, _norm_at_end(w, h, size_last, outcome == OPEN, hides))
        if norm >= 1.0:
            w.jacobian_age = INVALID
    return CONVERGED, norm


@compiled
def too_small(w: Any, h: float) -> bool:
    """True if the step no longer advances time."""
    return not (h > TINY and h > ULPS * w.tau)


@compiled
def _may_try(w: Any, h: float, i: int) -> int:
    """Return GOOD, or the reason why run i tries no step of this size."""
    if too_small(w, h):
        return STEP_UNDERFLOW
    # Rejected steps are not counted, so that a run can be repeated with the number of steps that it took.
    if max(w.steps, w.rejected - w.rejected_before) >= w.max_steps[row_of(w.max_steps, i)]:
        return MAX_STEPS
    return STOPPED if w.counts[i, STOP] != 0 else GOOD


@compiled
def advance_explicitly(w: Any, h: float, i: int, h_last: float, norm_last: float) -> tuple[int, float, float, float]:
    """As :func:`advance_implicitly`, by explicit steps."""
    failed = False
    w.newton_steps = 1
    while True:
        outcome = _may_try(w, h, i)
        if outcome != GOOD:
            return outcome, h, 0.0, h
        norm = step_explicitly(w, h, 1.0)
        if failed and norm > MAX_ERROR_RATIO * (norm_last * (h / h_last) ** 8):
            w.stiff_steps += STIFF_STEPS
        if norm < 1.0:
            proposed = h if failed else next_size(w, h, norm, h_last, norm_last)
            return GOOD, h, norm, min(proposed, next_size(w, h, norm, 0.0, 1.0))
        w.rejected += 1
        failed, h_last, norm_last = True, h, norm
        h = next_size(w, h, min(norm, 1e30), 0.0, 1.0)


@compiled
def advance_implicitly(w: Any, h: float, i: int, size_last: float, norm_last: float) -> tuple[int, float, float, float]:
    """Shrink h until a step passes; return the outcome, the step taken, its error norm and the next step size."""
    # The first step after a start, and every repeated one, may be in a transient.
    repeated = w.h_last == 0.0
    singular, failed = 0, False
    while True:
        outcome = _may_try(w, h, i)
        if outcome == GOOD:
            predict(w, h)
            outcome = _prepare(w, h, not failed)
        if outcome == SINGULAR and singular < SINGULAR_TRIALS:
            # A matrix may be singular for a particular step size.
            singular += 1
            w.jacobian_age = INVALID
            failed = True
            h *= 0.37
            continue
        if outcome != GOOD:
            return outcome, h, 0.0, h
        outcome, norm = _try_step(w, h, repeated, size_last)
        if outcome == CONVERGED:
            if norm < 1.0:
                proposed = next_size(w, h, norm, size_last, norm_last)
                return GOOD, h, norm, min(h, proposed) if failed else proposed
            smaller = next_size(w, h, min(norm, 1e30), 0.0, 1.0)
        else:
            smaller = h * (0.1 if outcome == NOT_FINITE else SHORTENED)
            failed = True
        w.rejected += 1
        w.h_factored = 0.0
        if outcome != CONVERGED:
            aged = w.jacobian_age == OLD
            w.jacobian_age = INVALID
            if aged:
                continue  # retry with a current Jacobian before shortening the step
        choose_member(w, SLOW_REJECTED)
        repeated = True
        h = smaller


@compiled
def advance(w: Any, h: float, i: int, size_last: float, norm_last: float) -> tuple[int, float, float, float]:
    """As :func:`advance_implicitly`, by explicit steps as long as the equations are not stiff."""
    if w.explicit != 0:
        found = advance_explicitly(w, h, i, size_last, norm_last)
        if found[0] != STEP_UNDERFLOW:
            return found
        w.explicit = 0
        _reset_newton(w)
    return advance_implicitly(w, h, i, size_last, norm_last)


@compiled
def store_polynomial(w: Any, h: float, offset: float) -> None:
    """Store the polynomial of this step for predictions from its end (offset 1) or its start (offset 0)."""
    k = w.member
    for i in range(stage_count(k)):
        copy(w.z[i], w.z_last[i])
    for m in range(w.n):
        divide(k, w.z, m, w.z_polynomial[m])
    w.h_last = h
    w.offset = offset
    w.last_member = w.member


@compiled
def accept(w: Any, h: float) -> None:
    """Move to the end of the step."""
    last = stage_count(w.member) - 1
    end_of_step(w, h, w.y, w.ydot, w.q)
    copy(w.rates[last], w.rates[7])
    w.tau += h
    w.steps += 1
    w.jacobian_age = min(w.jacobian_age, OLD)
    set_weights(w)
    if w.explicit != 0:
        w.stiff_steps = w.stiff_steps + 2 if is_long(w) else max(w.stiff_steps - 1, 0)
        if w.stiff_steps >= 2 * STIFF_STEPS:
            w.explicit = 0
            _reset_newton(w)


@compiled
def keep_matrices(w: Any, h: float, proposed: float) -> float:
    """Choose the next step size: unchanged where Newton converged so fast that the factors are worth keeping."""
    if w.jacobian_age == INVALID:
        return proposed
    # Newton's contraction goes with the square of the step; it means nothing where the predictor was good or roundoff
    # ended the iteration.
    if w.guess_error > 1.0 and w.theta > 0.0:
        proposed = min(proposed, h * max(LEAST_CONVERGENT, np.sqrt(CONTRACTING / w.theta)))
    if choose_member(w, SLOW):
        w.h_factored = 0.0
    elif w.theta < NEGLIGIBLE and h <= proposed <= 1.2 * h:
        # A step longer by a fifth is worth less than a new factorization (Hairer & Wanner II, IV.8).
        return h
    if w.theta >= NEGLIGIBLE:
        w.h_factored = 0.0
    return proposed


MAX_DEFECT = 3.0
"""Defect between the stages, in units of the one allowed at the start of a step, beyond which a step is too long.

A choice: the polynomial is somewhat worse between the stages than at the ends. A smaller value rejects good steps, a
larger one accepts features that change the state by so many tolerances.
"""

END_CHECKS = 10
"""Number of checks next to the end of a segment, each ten times closer to it than the one before."""

CHECK_PART = 1e-2
"""Part of the spacing below which a step is not checked: a choice that saves time. Its stages lie closer together than
the checks; a narrower feature may be missed, as it may between two checks.
"""


@compiled
def _differs(w: Any, h: float, x: float, remaining: float) -> bool:
    """True if the equations, or the rates of the ledger at the corrected state, disagree with the polynomials at a
    fraction of the step.
    """
    put_inside(w, h, x)
    if not filter_residual(w):
        return True
    if not error_norm(w, 0.0) <= MAX_DEFECT:
        find_noise(w)
        if not error_norm(w, MAGNIFIED) <= MAX_DEFECT:
            return True
    if w.n_ledger == 0:
        return False
    probe_ledger(w, h)
    top = stage_count(w.member)
    for m in range(w.n_ledger):
        _, slope = value_and_slope(w.member, top, x, w.q_polynomial[m])
        w.q_probe[m] = h * w.q_probe[m] - slope
    return bool(not defect_norm(w, w.q_probe, h, remaining) <= MAX_DEFECT and not explained_norm(w, h) <= MAX_DEFECT)


@compiled
def first_defect(w: Any, h: float, spacing: float, remaining: float, begins: bool, ends: bool) -> float:
    """Return the fraction of a step at which its polynomial first disagrees with the equations; one if nowhere checked.

    ``begins`` and ``ends`` tell whether the step touches an end of a segment or an event, next to which a feature may
    be narrow.
    """
    if not may_be_narrow(w, h):
        return 1.0
    points = int(h / spacing)
    if points > 0 or begins or ends:
        keep_polynomial(w)
    if begins:
        # From the narrowest outwards: the first disagreement tells how short the step has to be.
        for k in range(END_CHECKS, 0, -1):
            if _differs(w, h, 10.0**-k, remaining):
                return 10.0**-k
    for i in range(points):
        x = (i + 0.5) / points
        if _differs(w, h, x, remaining):
            return x
    if ends:
        for k in range(1, END_CHECKS + 1):
            if _differs(w, h, 1.0 - 10.0**-k, remaining):
                return 1.0 - 10.0**-k
    return 1.0
