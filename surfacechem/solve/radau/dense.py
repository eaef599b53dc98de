"""Dense output of state, rate and ledger inside a step, and the quadrature error of the ledger.

The collocation polynomial has only the order of the stages. The defect of its derivative at the start of the step,
which is the error estimate, determines its leading error term; adding this term gains one order at no cost.

The states choose the step size. Where an account integrates something that hardly affects them, such as the work on a
gap that is moved through a steep traction, the step may be too long for the account; the norm here finds such steps.
"""

from typing import Any

import numpy as np

from surfacechem.solve.radau import tables
from surfacechem.solve.radau.newton import divide, put_change, set_stage, stage_count, value_and_slope
from surfacechem.solve.radau.work import LEDGER, combine, compiled, copy, evaluate, finite, put
from surfacechem.tolerances import NEGLIGIBLE, RUN_EPS, TINY, UNEQUAL

N_GROUPS = 3
"""Groups of accounts that share a scale: energies, entropies, bonds."""
LEDGER_FACTOR, LEDGER_RTOL = 30.0, RUN_EPS
"""Allowed quadrature error in units of the tolerance of the states, and its least value."""
FORESEEN_PART = NEGLIGIBLE**2
"""Part of the remaining time for which a rate is assumed to last, where little has been exchanged so far."""


@compiled
def _newton_form(k: int, values: Any, correction: Any, result: Any) -> None:
    """Divided differences of the polynomial through 0 and the stage values, including its correction."""
    s = stage_count(k)
    # Newton's form is accurate at the nodes, where sums of powers lose digits.
    for m in range(result.shape[0]):
        row = result[m]
        divide(k, values, m, row)
        row[s] = row[s + 1] = 0.0
        for i in range(s + 1):
            row[i] += tables.DEFECT[k, i] * correction[m]


@compiled
def keep_polynomial(w: Any) -> None:
    """Store the polynomials of state and ledger over the step in Newton's form, for outputs and events inside it."""
    _newton_form(w.member, w.z, w.correction, w.polynomial)
    _newton_form(w.member, w.q_stage, w.q_correction, w.q_polynomial)


@compiled
def put_inside(w: Any, h: float, x: float) -> None:
    """Set trial state and inputs to the dense output at the fraction x of the step, with the derivative of its
    polynomial.
    """
    top = stage_count(w.member)
    for m in range(w.n):
        change, slope = value_and_slope(w.member, top, x, w.polynomial[m])
        w.trial[m] = w.y[m] + change
        w.trial_dot[m] = slope / h
    put(w, x * h, w.trial, w.trial_dot)


@compiled
def probe_ledger(w: Any, h: float) -> None:
    """Evaluate the ledger rates at the trial state, corrected by its error there, which a fast rate would magnify."""
    n, rate = w.n, tables.GAMMA[w.member] / h
    for j in range(n):
        w.inputs[1 + j] = w.trial[j] + w.error[j]
        w.inputs[1 + n + j] = w.trial_dot[j] + rate * w.error[j]
    evaluate(w, LEDGER, w.q_probe)


@compiled
def scan_step(w: Any) -> None:
    """Evaluate the change of the state and its rate times the step at all points where guards are examined."""
    k, n = w.member, w.n
    s = stage_count(k)
    copy(w.correction, w.z[s])  # a row that is free
    points, terms, z = 4 * k + 9, s + 1, w.z.ctypes.data
    combine(tables.SCAN_VALUES[k].ctypes.data, 8, points, terms, z, n, w.scanned.ctypes.data)
    combine(tables.SCAN_RATES[k].ctypes.data, 8, points, terms, z, n, w.scanned_rates.ctypes.data)


@compiled
def put_scanned(w: Any, h: float, i: int) -> None:
    """Set the inputs to one of the points where guards are examined."""
    put_change(w, h, tables.SCANNED[w.member, i], w.scanned[i], w.scanned_rates[i], 1.0 / h)


@compiled
def finish_step(w: Any, h: float) -> None:
    """Complete the step for dense output: the leading error term of the polynomial, and the quadratures of the
    ledger.
    """
    for m in range(w.n):
        w.correction[m] = 0.0 if w.explicit != 0 else tables.GAMMA[w.member] * w.error[m]
    if w.n_ledger > 0:
        integrate_ledger(w, h)


@compiled
def integrate_ledger(w: Any, h: float) -> None:
    """Integrate the ledger over the step at its stages; row 7 of the rates holds those at the start of the step."""
    k = w.member
    s = stage_count(k)
    for i in range(s):
        set_stage(w, i, h)
        evaluate(w, LEDGER, w.rates[i])
    # Radau's quadrature has the order 2s - 1 of the method, its polynomial that of the stages plus one.
    count, rates, stages, defects = w.n_ledger, w.rates, w.q_stage, w.q_correction
    combine(tables.COLLOCATION[k].ctypes.data, 7, s, s, rates.ctypes.data, count, stages.ctypes.data)
    copy(rates[7], defects)
    for i in range(s):
        for m in range(count):
            stages[i, m] *= h
            defects[m] -= tables.START_RATE[k, i] * rates[i, m]
    for m in range(count):
        defects[m] *= h


@compiled
def hold_rates(w: Any, h: float) -> None:
    """Integrate the ledger over the step with the rates at its start, where those at its end are singular."""
    k = w.member
    for m in range(w.n_ledger):
        for i in range(stage_count(k)):
            w.rates[i, m] = w.rates[7, m]
            w.q_stage[i, m] = tables.NODES[k, i] * h * w.rates[7, m]
        w.q_correction[m] = 0.0


# -- the error of the quadrature ---------------------------------------------------------------------------------------


@compiled
def defect_norm(w: Any, defects: Any, h: float, remaining: float) -> float:
    """Norm of the quadrature error over the step, in units of the allowed one, from defects of the rates.

    It is relative to the amount each account has exchanged or soon will. The defect of the rate has the order s of the
    stages, the quadrature 2s - 1: for a smooth rate its error, relative to the amount exchanged in the step, is that
    power of the defect.
    """
    largest, rates = w.q_turnover, w.rates
    for m in range(w.n_ledger):
        largest[m] = abs(rates[7, m])
    for i in range(stage_count(w.member)):
        for m in range(w.n_ledger):
            largest[m] = max(largest[m], abs(rates[i, m]))
    for m in range(w.n_ledger):
        rate, miss = largest[m], abs(defects[m])
        if miss > 0.0:
            rate = max(rate, miss / h)
        w.q_error[m], w.q_turnover[m], w.q_explained[m] = miss, h * rate, 0.0
        w.q_largest[m] = max(w.q_largest[m], abs(w.q[m]))
        w.q_scale[m] = w.q_largest[m] + max(h, FORESEEN_PART * remaining) * rate
    return _group_norm(w)


@compiled
def ledger_rtol(rtol: float) -> float:
    """Quadrature error that a tolerance of the states allows, relative to the amount exchanged; bounded, however loose
    the tolerance, so that the balances close.
    """
    return float(min(max(LEDGER_FACTOR * rtol, LEDGER_RTOL), NEGLIGIBLE))


@compiled
def _group_norm(w: Any) -> float:
    """Largest quadrature error in units of the allowed error of its group."""
    # Accounts of one kind are summed: the error of one counts relative to the largest.
    norm, allowed, power = 0.0, ledger_rtol(w.rtol), 1.0 - 1.0 / stage_count(w.member)
    for group in range(N_GROUPS):
        miss, scale = 0.0, TINY
        for m in range(w.n_ledger):
            if w.groups[m] == group:
                scale = max(scale, w.q_scale[m])
                # An error is less than its defect: its power, the costliest part, only where it may be the largest.
                if w.q_error[m] - w.q_explained[m] > miss:
                    part = w.q_error[m] / w.q_turnover[m]
                    miss = max(miss, w.q_error[m] * part**power - w.q_explained[m])
        norm = max(norm, miss / scale)
    return norm / allowed


@compiled
def explained_norm(w: Any, h: float) -> float:
    """The last norm without the part that an error of the states within their tolerance causes in an account."""
    n, last = w.n, stage_count(w.member) - 1
    set_stage(w, last, h)
    for j in range(n):
        change = UNEQUAL[j % len(UNEQUAL)] * w.weight[j]
        w.inputs[1 + j] += change
        w.inputs[1 + n + j] += change / h
    evaluate(w, LEDGER, w.q_explained)
    for m in range(w.n_ledger):
        w.q_explained[m] = h * abs(w.q_explained[m] - w.rates[last, m])
    return _group_norm(w)


@compiled
def ledger_norm(w: Any, h: float, remaining: float) -> float:
    """Norm of the quadrature errors over the step; zero where they limit no step, infinite where a rate at its end
    is.
    """
    if w.n_ledger == 0:
        return 0.0
    if not finite(w.q_stage[stage_count(w.member) - 1]):
        return np.inf
    return explained_norm(w, h) if defect_norm(w, w.q_correction, h, remaining) > NEGLIGIBLE else 0.0
