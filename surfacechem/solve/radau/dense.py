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
    SCAN_RATES,
    SCAN_VALUES,
    SCANNED,
    START_RATE,
)
from surfacechem.solve.radau.work import (
    LEDGER,
    combine,
    compiled,
    copy,
    evaluate,
    put,
)


@compiled
def _newton_form(k: int, values: Any, correction: Any, result: Any) -> None:
    """Divided differences of the polynomial through 0 and these values at the stages, with its correction."""
    s = stage_count(k)
    # Newton's form keeps its digits at the nodes, where sums of powers lose them.
    for m in range(result.shape[0]):
        row = result[m]
        divide(k, values, m, row)
        row[s] = row[s + 1] = 0.0
        for i in range(s + 1):
            row[i] += DEFECT[k, i] * correction[m]


@compiled
def keep_polynomial(w: Any) -> None:
    """Newton's form of the polynomials of state and ledger over the step, for outputs and events inside."""
    _newton_form(w.member, w.z, w.correction, w.polynomial)
    _newton_form(w.member, w.q_stage, w.q_correction, w.q_polynomial)


@compiled
def interpolate(w: Any, x: float) -> None:
    """State and ledger at the fraction x of the step."""
    top = stage_count(w.member) + 1
    for m in range(w.n):
        w.trial[m] = w.y[m] + nested(w.member, top, x, w.polynomial[m])
    for m in range(w.n_ledger):
        w.q_trial[m] = w.q[m] + nested(w.member, top, x, w.q_polynomial[m])


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
def put_inside(w: Any, h: float, x: float) -> None:
    """State at the fraction x of the step and the derivative of its polynomial, as trial and as inputs."""
    for m in range(w.n):
        change, slope = change_and_slope(w.member, x, w.polynomial[m])
        w.trial[m] = w.y[m] + change
        w.trial_dot[m] = slope / h
    put(w, x * h, w.trial, w.trial_dot)


@compiled
def probe_ledger(w: Any, h: float) -> None:
    """Rates of the ledger at the trial state, at the time of the inputs. The state is corrected by its error there
    first: a fast rate would magnify it.
    """
    n, rate = w.n, GAMMA[w.member] / h
    for j in range(n):
        w.inputs[1 + j] = w.trial[j] + w.error[j]
        w.inputs[1 + n + j] = w.trial_dot[j] + rate * w.error[j]
    evaluate(w, LEDGER, w.q_probe)


@compiled
def scan_step(w: Any) -> None:
    """Change of the state since the start, and its rate times the step, at all points where margins are examined."""
    k, n = w.member, w.n
    s = stage_count(k)
    copy(w.correction, w.z[s])  # a row that is free
    points, terms, z = 4 * k + 9, s + 1, w.z.ctypes.data
    combine(SCAN_VALUES[k].ctypes.data, 8, points, terms, z, n, w.scanned.ctypes.data)
    combine(SCAN_RATES[k].ctypes.data, 8, points, terms, z, n, w.scanned_rates.ctypes.data)


@compiled
def put_scanned(w: Any, h: float, i: int) -> None:
    """Inputs at a point where margins are examined."""
    n, rate = w.n, 1.0 / h
    inputs, y, change, slope = w.inputs, w.y, w.scanned[i], w.scanned_rates[i]
    inputs[0] = w.base + (w.tau + SCANNED[w.member, i] * h)
    for m in range(n):
        inputs[1 + m] = y[m] + change[m]
        inputs[1 + n + m] = slope[m] * rate


@compiled
def finish_step(w: Any, h: float) -> None:
    """What interpolation inside the step needs beyond the stages: the leading error of the polynomial, from the error
    estimate, and the quadratures of the ledger.
    """
    for m in range(w.n):
        w.correction[m] = 0.0 if w.explicit != 0 else GAMMA[w.member] * w.error[m]
    if w.n_ledger > 0:
        integrate_ledger(w, h)


@compiled
def integrate_ledger(w: Any, h: float) -> None:
    """Quadratures over the step at its stages; row 7 of the rates holds those at the start of the step."""
    k = w.member
    s = stage_count(k)
    for i in range(s):
        set_stage(w, i, h)
        evaluate(w, LEDGER, w.rates[i])
    # Radau's quadrature has the order 2s - 1 of the method, its polynomial that of the stages plus one.
    for m in range(w.n_ledger):
        defect = w.rates[7, m]
        for i in range(s):
            defect -= START_RATE[k, i] * w.rates[i, m]
            total = 0.0
            for j in range(s):
                total += COLLOCATION[k, i, j] * w.rates[j, m]
            w.q_stage[i, m] = h * total
        w.q_correction[m] = h * defect


@compiled
def hold_rates(w: Any, h: float) -> None:
    """Quadratures over the step with the rates at its start, where those at its end are singular."""
    k = w.member
    for m in range(w.n_ledger):
        for i in range(stage_count(k)):
            w.rates[i, m] = w.rates[7, m]
            w.q_stage[i, m] = NODES[k, i] * h * w.rates[7, m]
        w.q_correction[m] = 0.0
