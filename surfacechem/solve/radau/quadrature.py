"""Error of the ledger's quadrature over a step.

The states choose the steps. Where they hardly feel what an account integrates, such as the work on a gap that is
moved through a steep traction, the steps may be too long for it; here such a step is found.
"""

from typing import Any

from surfacechem.solve.radau.newton import set_stage, stage_count
from surfacechem.solve.radau.work import (
    LEDGER,
    MEMBER,
    Q_CORRECTION,
    Q_LARGEST,
    Q_MISS,
    Q_NUDGED,
    Q_SCALE,
    RTOL,
    WEIGHT,
    Q,
    compiled,
    evaluate,
)
from surfacechem.tolerances import NEGLIGIBLE, ROUNDING, TINY

GROUPS = 3
"""Accounts that are measured together: energies, entropies, bonds."""
LOOSER, LEAST = 30.0, ROUNDING
"""Error of a quadrature in units of the tolerance of the states, and the least there is."""
FORESEEN = NEGLIGIBLE**2
"""Part of the time to go for which a rate is taken to last, where little was exchanged so far."""


@compiled
def _find_misses(w: Any, row: int, h: float, remaining: float) -> None:
    """Error of each account's quadrature from the defects in a row, and what it turned over or soon will.

    The defect of the rate has the order s of the stages, the quadrature 2s - 1: for a smooth rate its error, relative
    to what the step turns over, is that power of the defect.
    """
    s = stage_count(w.count[MEMBER])
    for m in range(w.groups.shape[0]):
        rate = abs(w.rates[7, m])
        for i in range(s):
            rate = max(rate, abs(w.rates[i, m]))
        miss = abs(w.ledger[row, m])
        if miss > 0.0:
            rate = max(rate, miss / h)
            miss *= (miss / (h * rate)) ** (1.0 - 1.0 / s)
        w.ledger[Q_MISS, m] = miss
        w.ledger[Q_LARGEST, m] = max(w.ledger[Q_LARGEST, m], abs(w.ledger[Q, m]))
        w.ledger[Q_SCALE, m] = w.ledger[Q_LARGEST, m] + max(h, FORESEEN * remaining) * rate


@compiled
def _group_norm(w: Any) -> float:
    """Largest error in units of what is allowed in its group."""
    norm, allowed = 0.0, max(LOOSER * w.clock[RTOL], LEAST)
    for group in range(GROUPS):
        miss, scale = 0.0, TINY
        for m in range(w.groups.shape[0]):
            if w.groups[m] == group:
                miss = max(miss, w.ledger[Q_MISS, m])
                scale = max(scale, w.ledger[Q_SCALE, m])
        norm = max(norm, miss / scale)
    return norm / allowed


@compiled
def _excuse_states(w: Any, h: float) -> None:
    """Take away what an error of the states within their tolerance makes of an account."""
    n, last = w.algebraic.shape[0], stage_count(w.count[MEMBER]) - 1
    set_stage(w, last, h)
    # Unlike changes: what the states may miss must not cancel in their differences.
    for j in range(n):
        change = (1 + j % 3) * (1 - 2 * (j % 2)) * w.vector[WEIGHT, j]
        w.inputs[1 + j] += change
        w.inputs[1 + n + j] += change / h
    evaluate(w, LEDGER, w.ledger[Q_NUDGED].ctypes.data)
    for m in range(w.groups.shape[0]):
        w.ledger[Q_MISS, m] -= h * abs(w.ledger[Q_NUDGED, m] - w.rates[last, m])


@compiled
def defect_norm(w: Any, row: int, h: float, remaining: float) -> float:
    """Error of the quadratures over the step in units of what is allowed, from the defects in a row."""
    _find_misses(w, row, h, remaining)
    return _group_norm(w)


@compiled
def excused_norm(w: Any, h: float) -> float:
    """The error that was found last, without what the states may miss."""
    _excuse_states(w, h)
    return _group_norm(w)


@compiled
def ledger_norm(w: Any, h: float, remaining: float) -> float:
    """Error of the quadratures over the step in units of what is allowed; nothing where it limits no step."""
    return excused_norm(w, h) if defect_norm(w, Q_CORRECTION, h, remaining) > NEGLIGIBLE else 0.0


@compiled
def ledger_factor(w: Any, norm: float) -> float:
    """Change of the step size that the ledger allows."""
    return float(max(0.1, 0.9 * max(norm, NEGLIGIBLE) ** (-0.5 / stage_count(w.count[MEMBER]))))
