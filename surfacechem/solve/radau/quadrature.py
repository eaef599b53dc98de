"""Error of the ledger's quadrature over a step.

The states choose the steps. Where they hardly feel what an account integrates, such as the work on a gap that is
moved through a steep traction, the steps may be too long for it; here such a step is found.
"""

from typing import Any

import numpy as np

from surfacechem.solve.radau.newton import set_stage, stage_count
from surfacechem.solve.radau.work import LEDGER, compiled, evaluate, finite
from surfacechem.tolerances import NEGLIGIBLE, ROUNDING, TINY

GROUPS = 3
"""Accounts that are measured together: energies, entropies, bonds."""
LOOSER, LEAST = 30.0, ROUNDING
"""Error of a quadrature in units of the tolerance of the states, and the least there is."""
FORESEEN = NEGLIGIBLE**2
"""Part of the time to go for which a rate is taken to last, where little was exchanged so far."""


@compiled
def defect_norm(w: Any, defects: Any, h: float, remaining: float) -> float:
    """Error of the quadratures over the step in units of what is allowed, from defects of their rates.

    It is held against what each account turned over or soon will. The defect of the rate has the order s of the stages,
    the quadrature 2s - 1: for a smooth rate its error, relative to what the step turns over, is that power of the
    defect.
    """
    s = stage_count(w.member)
    for m in range(w.n_ledger):
        rate = abs(w.rates[7, m])
        for i in range(s):
            rate = max(rate, abs(w.rates[i, m]))
        miss = abs(defects[m])
        if miss > 0.0:
            rate = max(rate, miss / h)
            miss *= (miss / (h * rate)) ** (1.0 - 1.0 / s)
        w.q_miss[m] = miss
        w.q_largest[m] = max(w.q_largest[m], abs(w.q[m]))
        w.q_scale[m] = w.q_largest[m] + max(h, FORESEEN * remaining) * rate
    return _group_norm(w)


@compiled
def _group_norm(w: Any) -> float:
    """Largest error in units of what is allowed in its group."""
    # Accounts of one kind are added up: what one of them misses counts beside the largest.
    norm, allowed = 0.0, max(LOOSER * w.rtol, LEAST)
    for group in range(GROUPS):
        miss, scale = 0.0, TINY
        for m in range(w.n_ledger):
            if w.groups[m] == group:
                miss = max(miss, w.q_miss[m])
                scale = max(scale, w.q_scale[m])
        norm = max(norm, miss / scale)
    return norm / allowed


@compiled
def excused_norm(w: Any, h: float) -> float:
    """The error that was found last, without what an error of the states within their tolerance makes of an account."""
    n, last = w.n, stage_count(w.member) - 1
    set_stage(w, last, h)
    # Unlike changes: what the states may miss must not cancel in their differences.
    for j in range(n):
        change = (1 + j % 3) * (1 - 2 * (j % 2)) * w.weight[j]
        w.inputs[1 + j] += change
        w.inputs[1 + n + j] += change / h
    evaluate(w, LEDGER, w.q_nudged)
    for m in range(w.n_ledger):
        w.q_miss[m] -= h * abs(w.q_nudged[m] - w.rates[last, m])
    return _group_norm(w)


@compiled
def ledger_norm(w: Any, h: float, remaining: float) -> float:
    """Error of the quadratures over the step in units of what is allowed: nothing where it limits no step, infinite
    where a rate at the end of the step is.
    """
    if w.n_ledger == 0:
        return 0.0
    if not finite(w.q_stage[stage_count(w.member) - 1]):
        return np.inf
    return excused_norm(w, h) if defect_norm(w, w.q_correction, h, remaining) > NEGLIGIBLE else 0.0
