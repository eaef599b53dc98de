"""State, rate and ledger inside a step.

The collocation polynomial has only the order of the stages. The defect of its derivative at the start of the step,
which is the error estimate, fixes its leading error term; adding that term gains one order at no cost.
"""

from typing import Any

from surfacechem.solvers.native import (
    CORRECTION,
    ERROR,
    LEDGER,
    MEMBER,
    Q_CORRECTION,
    Q_TRIAL,
    TRIAL,
    TRIAL_DOT,
    Q,
    Y,
    clear,
    compiled,
    evaluate,
)
from surfacechem.solvers.radau_stages import lagrange, set_stage, stage_count
from surfacechem.solvers.radau_tables import COLLOCATION, DEFECT, GAMMA, INVERSE, LAGRANGE, NODES, START_RATE


@compiled
def _defect_shape(k: int, x: float) -> float:
    value = 0.0
    for i in range(stage_count(k), -1, -1):
        value = (value + DEFECT[k, i]) * x
    return value


@compiled
def keep_correction(w: Any) -> None:
    """Leading error of the polynomial per unit shape, from the error estimate."""
    for m in range(w.algebraic.shape[0]):
        w.vector[CORRECTION, m] = GAMMA[w.count[MEMBER]] * w.vector[ERROR, m]


@compiled
def interpolate(w: Any, x: float) -> None:
    """State and ledger at the fraction x of the step."""
    k = w.count[MEMBER]
    lagrange(w, k, x)
    shape = _defect_shape(k, x)
    for m in range(w.algebraic.shape[0]):
        value = shape * w.vector[CORRECTION, m]
        for j in range(stage_count(k)):
            value += w.basis[j] * w.z[j, m]
        w.vector[TRIAL, m] = w.vector[Y, m] + value
    for m in range(w.ledger.shape[1]):
        value = shape * w.ledger[Q_CORRECTION, m]
        for j in range(stage_count(k)):
            value += w.basis[j] * w.q_stage[j, m]
        w.ledger[Q_TRIAL, m] = w.ledger[Q, m] + value


@compiled
def interpolate_rate(w: Any, h: float, x: float) -> None:
    """Derivative of the corrected polynomial at the fraction x of the step."""
    k = w.count[MEMBER]
    s = stage_count(k)
    shape = 1.0
    for i in range(s):
        shape *= 1.0 - x / NODES[k, i]
    clear(w.basis)
    for i in range(s):
        weight = LAGRANGE[k, i] * NODES[k, i]
        for j in range(s):
            if j != i:
                weight *= x - NODES[k, j]
        for j in range(s):
            w.basis[j] += weight * INVERSE[k, i, j]
    for m in range(w.algebraic.shape[0]):
        value = shape * w.vector[CORRECTION, m]
        for j in range(s):
            value += w.basis[j] * w.z[j, m]
        w.vector[TRIAL_DOT, m] = value / h


@compiled
def integrate_ledger(w: Any, h: float) -> None:
    """Quadratures over the step at its stages; row 7 of the rates holds those at the start of the step."""
    k = w.count[MEMBER]
    s = stage_count(k)
    for i in range(s):
        set_stage(w, i, h)
        evaluate(w, LEDGER, w.rates[i].ctypes.data)
    for m in range(w.ledger.shape[1]):
        defect = w.rates[7, m]
        for i in range(s):
            defect -= START_RATE[k, i] * w.rates[i, m]
            total = 0.0
            for j in range(s):
                total += COLLOCATION[k, i, j] * w.rates[j, m]
            w.q_stage[i, m] = h * total
        w.ledger[Q_CORRECTION, m] = h * defect
