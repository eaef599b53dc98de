"""State, rate and ledger inside a step.

The collocation polynomial has only the order of the stages. The defect of its derivative at the start of the step,
which is the error estimate, fixes its leading error term; adding that term gains one order at no cost.
"""

from typing import Any

from surfacechem.solve.radau.newton import divide, nested, set_stage, stage_count
from surfacechem.solve.radau.tables import (
    COLLOCATION,
    DEFECT,
    GAMMA,
    NEWTON_NODES,
    NODES,
    PROBE_SHAPE,
    SCAN_RATES,
    SCAN_VALUES,
    SCANNED,
    START_RATE,
)
from surfacechem.solve.radau.work import (
    BASE,
    CORRECTION,
    ERROR,
    LEDGER,
    MEMBER,
    Q_CORRECTION,
    Q_TRIAL,
    TAU,
    TRIAL,
    TRIAL_DOT,
    Q,
    Y,
    combine,
    compiled,
    copy,
    evaluate,
)


@compiled
def _newton_form(k: int, values: Any, correction: Any, result: Any) -> None:
    """Divided differences of the polynomial through 0 and these values at the stages, with its correction."""
    s = stage_count(k)
    for m in range(result.shape[0]):
        row = result[m]
        divide(k, values, m, row)
        row[s] = row[s + 1] = 0.0
        for i in range(s + 1):
            row[i] += DEFECT[k, i] * correction[m]


@compiled
def keep_polynomial(w: Any) -> None:
    """Newton's form of the polynomials of state and ledger over the step, for outputs and events inside."""
    k = w.count[MEMBER]
    _newton_form(k, w.z, w.vector[CORRECTION], w.polynomial)
    _newton_form(k, w.q_stage, w.ledger[Q_CORRECTION], w.q_polynomial)


@compiled
def add_probe(w: Any, k: int, defect: Any) -> None:
    """The next term of the ledger's polynomial, from a defect of its rate at the probe."""
    for m in range(w.q_polynomial.shape[0]):
        for i in range(stage_count(k) + 2):
            w.q_polynomial[m, i] += PROBE_SHAPE[k, i] * defect[m]


@compiled
def _evaluate(k: int, x: float, polynomial: Any, start: Any, result: Any) -> None:
    for m in range(polynomial.shape[0]):
        result[m] = start[m] + nested(k, stage_count(k) + 1, x, polynomial[m])


@compiled
def interpolate(w: Any, x: float) -> None:
    """State and ledger at the fraction x of the step."""
    k = w.count[MEMBER]
    _evaluate(k, x, w.polynomial, w.vector[Y], w.vector[TRIAL])
    _evaluate(k, x, w.q_polynomial, w.ledger[Q], w.ledger[Q_TRIAL])


@compiled
def change_and_slope(k: int, x: float, row: Any) -> Any:
    """A polynomial of a step at the fraction x, less its value at the start, and its derivative by x."""
    top = stage_count(k)
    value, slope = row[top], 0.0
    for i in range(top - 1, -1, -1):
        slope = slope * (x - NEWTON_NODES[k, i]) + value
        value = value * (x - NEWTON_NODES[k, i]) + row[i]
    return value * x, slope * x + value


@compiled
def interpolate_rate(w: Any, h: float, x: float) -> None:
    """State at the fraction x of the step, and the derivative of its polynomial."""
    for m in range(w.polynomial.shape[0]):
        change, slope = change_and_slope(w.count[MEMBER], x, w.polynomial[m])
        w.vector[TRIAL, m] = w.vector[Y, m] + change
        w.vector[TRIAL_DOT, m] = slope / h


@compiled
def scan_step(w: Any) -> None:
    """Change of the state since the start, and its rate times the step, at all points where margins are examined."""
    k, n = w.count[MEMBER], w.algebraic.shape[0]
    s = stage_count(k)
    copy(w.vector[CORRECTION], w.z[s])  # a row that is free
    points, terms, z = 4 * k + 9, s + 1, w.z.ctypes.data
    combine(SCAN_VALUES[k].ctypes.data, 8, points, terms, z, n, w.scanned.ctypes.data)
    combine(SCAN_RATES[k].ctypes.data, 8, points, terms, z, n, w.scanned_rates.ctypes.data)


@compiled
def put_scanned(w: Any, h: float, i: int) -> None:
    """Inputs at a point where margins are examined."""
    n, rate = w.algebraic.shape[0], 1.0 / h
    w.inputs[0] = w.clock[BASE] + (w.clock[TAU] + SCANNED[w.count[MEMBER], i] * h)
    inputs, y, change, slope = w.inputs, w.vector[Y], w.scanned[i], w.scanned_rates[i]
    for m in range(n):
        inputs[1 + m] = y[m] + change[m]
        inputs[1 + n + m] = slope[m] * rate


@compiled
def keep_correction(w: Any) -> None:
    """Leading error of the polynomial per unit shape, from the error estimate."""
    for m in range(w.algebraic.shape[0]):
        w.vector[CORRECTION, m] = GAMMA[w.count[MEMBER]] * w.vector[ERROR, m]


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


@compiled
def hold_rates(w: Any, h: float) -> None:
    """Quadratures over the step with the rates at its start, where those at its end are singular."""
    k = w.count[MEMBER]
    for m in range(w.ledger.shape[1]):
        for i in range(stage_count(k)):
            w.rates[i, m] = w.rates[7, m]
            w.q_stage[i, m] = NODES[k, i] * h * w.rates[7, m]
        w.ledger[Q_CORRECTION, m] = 0.0
