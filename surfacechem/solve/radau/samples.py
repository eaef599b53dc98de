"""What lies between the stages of a long step.

A step knows the equations at its stages alone, and so does the estimate of its error: what is over between two of them
is seen by neither. A step that is longer than the spacing asked for is held against the equations and the ledger at
further points, so far apart at most. What is narrow lies beside a place where a formula changes, hence at the end of a
segment: the first and the last step of one are looked at the more closely, the nearer it is. Where the equations have
nothing in common with its polynomial, a step is too long.
"""

from typing import Any

from surfacechem.solve.radau.dense import change_and_slope, interpolate_rate, keep_polynomial
from surfacechem.solve.radau.quadrature import defect_norm, excused_norm
from surfacechem.solve.radau.roundoff import find_noise
from surfacechem.solve.radau.step import MAGNIFIED, error_norm, filter_residual
from surfacechem.solve.radau.tables import GAMMA
from surfacechem.solve.radau.work import (
    BASE,
    ERROR,
    LEDGER,
    MEMBER,
    Q_PROBE,
    TAU,
    TRIAL,
    TRIAL_DOT,
    compiled,
    evaluate,
    set_inputs,
)

FAR = 3.0
"""Errors in units of what a step may have at its start, beyond which it has not seen what is there: between the stages
the polynomial is somewhat worse than at the ends.
"""

DECADES = 10
"""Points at which what lies beside the end of a segment is looked at, each ten times nearer than the one before."""

BRIEF = 1e-2
"""Part of the spacing below which a step is taken to see what is there."""


@compiled
def _state_differs(w: Any, h: float, x: float) -> bool:
    """Whether the equations at a point are far from the polynomial; leaves the error of the state there in ERROR."""
    interpolate_rate(w, h, x)
    w.inputs[0] = w.clock[BASE] + (w.clock[TAU] + x * h)
    set_inputs(w, w.vector[TRIAL], w.vector[TRIAL_DOT])
    if not filter_residual(w):
        return True
    if error_norm(w, 0.0) <= FAR:
        return False
    find_noise(w)
    return bool(not error_norm(w, MAGNIFIED) <= FAR)


@compiled
def _ledger_differs(w: Any, h: float, x: float, remaining: float) -> bool:
    """Whether the rates of the ledger at a point are far from its polynomial, with the state corrected there."""
    k = w.count[MEMBER]
    for j in range(w.algebraic.shape[0]):
        w.inputs[1 + j] += w.vector[ERROR, j]
        w.inputs[1 + w.algebraic.shape[0] + j] += GAMMA[k] / h * w.vector[ERROR, j]
    evaluate(w, LEDGER, w.ledger[Q_PROBE].ctypes.data)
    for m in range(w.ledger.shape[1]):
        _, slope = change_and_slope(k, x, w.q_polynomial[m])
        w.ledger[Q_PROBE, m] = h * w.ledger[Q_PROBE, m] - slope
    return bool(not defect_norm(w, Q_PROBE, h, remaining) <= FAR and not excused_norm(w, h) <= FAR)


@compiled
def _differs(w: Any, h: float, x: float, remaining: float) -> bool:
    return _state_differs(w, h, x) or (w.ledger.shape[1] > 0 and _ledger_differs(w, h, x, remaining))


@compiled
def unseen(w: Any, h: float, spacing: float, remaining: float, begins: bool, ends: bool) -> float:
    """The part of a step at which it has missed something; one where it has not, as far as the points tell.

    It ``begins`` or ``ends`` where something may be narrow.
    """
    points = int(h / spacing)
    if points > 0 or begins or ends:
        keep_polynomial(w)
    if begins:
        for k in range(DECADES, 0, -1):
            if _differs(w, h, 10.0**-k, remaining):
                return 10.0**-k
    for i in range(points):
        x = (i + 0.5) / points
        if _differs(w, h, x, remaining):
            return x
    if ends:
        for k in range(1, DECADES + 1):
            if _differs(w, h, 1.0 - 10.0**-k, remaining):
                return 1.0 - 10.0**-k
    return 1.0
