"""Edges in the compiled loop: which edge is due at a moment, and the jump along it.

This is what :class:`Instant` does where no gap has to be searched for and no rare case occurs; those are left to it.
"""

from typing import Any

import numpy as np

from surfacechem.solve.contract import HEAT_STEPS
from surfacechem.solve.radau import stepper
from surfacechem.solve.radau.consistency import find_consistent
from surfacechem.solve.radau.work import (
    GUARD_RATES,
    MAGNITUDES,
    MARGINS,
    NODES,
    RESETS,
    TIMES_OF_RETURN,
    TOTALS,
    compiled,
    copy,
    evaluate,
    evaluate_at,
    finite,
    set_inputs,
)
from surfacechem.tolerances import BRIEF_PART, DRIFT, FEW_EPS, GUARD_EPS, MOST_DRIFT, NEWTON_EPS, RUN_EPS, ULPS

NO_EDGE, UNDECIDED = -1, -2
"""Values instead of the index of the edge that is due: none is; undecided here, and left to Instant."""

OPEN, CLOSED, NEAR, RESTING = range(4)
"""States of the guard of an edge."""


@compiled
def find_active(w: Any) -> None:
    """Mark the guards that are active in the present modes."""
    for m in range(w.n_margins):
        w.active[m] = 1
    k, rules = 0, w.when.shape[0]
    while k < rules:
        guard, column, holds = w.when[k, 0], w.when[k, 1], False
        while k < rules and w.when[k, 0] == guard and w.when[k, 1] == column:
            holds = holds or w.moment[1 + 2 * w.n + column] == w.when[k, 2]
            k += 1
        if not holds:
            w.active[guard] = 0


@compiled
def find_magnitudes(w: Any) -> None:
    """Evaluate the magnitudes of the guards at the peaks of the states; their roundoff is proportional to these."""
    for j in range(w.n):
        w.state_sizes[j] = max(w.peaks_seen[j], abs(w.moment[1 + j]))
    if w.n_margins == 0:
        return
    evaluate_at(w, MAGNITUDES, w.moment, w.magnitude)
    for m in range(w.n_margins):
        if not abs(w.magnitude[m]) < np.inf:
            w.magnitude[m] = 0.0


@compiled
def _closing(w: Any, m: int) -> int:
    """Return CLOSED if the guard of an edge is below zero by more than the drift, RESTING or NEAR if it is zero."""
    value, size, small = w.margin_probe[m], w.magnitude[m], GUARD_EPS * w.magnitude[m]
    if w.active[m] == 0 or value > small:
        return OPEN
    if value < -max(min(DRIFT * w.rtol, MOST_DRIFT) * size, small):
        return CLOSED
    rests = w.edges[m - w.n_margins + w.edges.shape[0], stepper.RESTS] == 1
    return RESTING if rests else NEAR if w.kinds[m, 3] == 0 else OPEN


@compiled
def _due(w: Any, first: int) -> int:
    """Return the edge whose guard is closed, or is zero and closing."""
    due, near = NO_EDGE, False
    for m in range(first, w.n_margins):
        w.fired[m] = _closing(w, m)
        near = near or w.fired[m] == NEAR
    if near and w.code[GUARD_RATES, 0] == 0:
        return UNDECIDED
    if near:
        evaluate(w, GUARD_RATES, w.margin_slope)
    for m in range(w.n_margins - 1, first - 1, -1):
        closes = w.fired[m] == RESTING or (w.fired[m] == NEAR and w.margin_slope[m - first] < 0.0)
        # After a jump at this moment roundoff must not trigger the way back.
        if closes and w.jump_times[-1] == w.moment[0]:
            return UNDECIDED
        if closes or w.fired[m] == CLOSED:
            due = m - first
    return due


@compiled
def resolve(w: Any, i: int, end: float) -> bool:
    """Carry out all edges that are due at the moment; False if this is left to Instant."""
    first = w.n_margins - w.edges.shape[0]
    while True:
        t = w.moment[0]
        if w.jump_times[0] >= t - NEWTON_EPS * max(t, BRIEF_PART * end):  # chatter, including arcs of no duration
            return False
        find_magnitudes(w)
        find_active(w)
        copy(w.moment, w.inputs)
        for j in range(w.n):
            w.trial[j], w.trial_dot[j] = w.moment[1 + j], 0.0
        if w.n_margins > 0:
            find_consistent(w)
            set_inputs(w, w.trial, w.trial_dot)
            evaluate(w, MARGINS, w.margin_probe)
        for m in range(first if w.jump_times[-1] >= 0.0 else 0):  # limits beyond which a jump has carried the state
            slack = 0.0 if w.kinds[m, 4] == 1 else GUARD_EPS * w.magnitude[m]
            if w.kinds[m, 0] == 1 and w.active[m] == 1 and w.margin_probe[m] < -slack:
                return False
        due = _due(w, first)
        if due == NO_EDGE:
            return True
        if due == UNDECIDED or not jump(w, i, due):
            return False


@compiled
def _evaluate_totals(w: Any, row: Any, totals: Any) -> None:
    """Evaluate the totals of a jump; a magnitude that is not finite, as at a bound, counts as zero."""
    evaluate_at(w, TOTALS, row, totals)
    for k in range(totals.shape[0] - 2, totals.shape[0]):
        if not abs(totals[k]) < np.inf:
            totals[k] = 0.0


@compiled
def _distribute_heat(w: Any, source: int, released: float) -> tuple[float, float]:
    """Distribute the heat of a jump to the nodes; return the heat and entropy that reservoirs take.

    Each node's temperature is that at which its energy has risen by its share.
    """
    row, nodes, heat, entropy = w.after, w.nodes.shape[0], 0.0, 0.0
    if nodes == 0:
        return heat, entropy
    width = w.nodal.shape[0] // nodes
    evaluate_at(w, NODES, row, w.nodal)
    for k in range(nodes):
        taken = w.nodal[k * width + 3 + source] * released
        w.targets[k] = w.nodal[k * width + 1] + taken
        if w.nodes[k] < 0:
            heat += taken
            entropy += taken / w.nodal[k * width]
    for _iteration in range(HEAT_STEPS):
        moves = False
        for k in range(nodes):
            if w.nodes[k] >= 0:
                T = row[1 + w.nodes[k]]
                change = (w.targets[k] - w.nodal[k * width + 1]) / w.nodal[k * width + 2]
                moves = moves or abs(change) > ULPS * abs(T)
                row[1 + w.nodes[k]] = T + change if T + change > 0.0 else np.nan
        if not moves:
            break
        evaluate_at(w, NODES, row, w.nodal)
    return heat, entropy


@compiled
def _coldest(w: Any) -> float:
    """Return the lowest temperature before the jump among the nodes that may take its heat."""
    found, nodes = np.inf, w.nodes.shape[0]
    if nodes > 0:
        evaluate_at(w, NODES, w.moment, w.nodal)
        for k in range(nodes):
            found = min(found, w.nodal[k * (w.nodal.shape[0] // nodes)])
    return float(found)


@compiled
def _add_to_ledger(w: Any, released: float, gain: float, heat: float, entropy: float) -> None:
    """Add the amounts of the jump to the accounts of the ledger."""
    for m in range(w.n_ledger):
        kind, place = w.accounts[m, 0], w.accounts[m, 1]
        if kind == stepper.BONDS:
            w.booked[m] += w.after[1 + place] - w.moment[1 + place]
        elif kind == stepper.WORK:
            w.booked[m] += w.totals_after[place] - w.totals_before[place]
        elif kind == stepper.RELEASED:
            w.booked[m] += released
        elif kind == stepper.PRODUCED:
            w.booked[m] += gain
        elif kind == stepper.HEAT_OUT:
            w.booked[m] -= heat
        elif kind == stepper.ENTROPY_OUT:
            w.booked[m] -= entropy


@compiled
def _write(w: Any, i: int, e: int, released: float, gain: float, heat: float, entropy: float, valid: bool) -> None:
    """Write the edge and the moment at which it is carried out, and the jump along it."""
    counts, n, given = w.counts[i], w.n, w.totals_before.shape[0] - 4
    if counts[stepper.EVENTS] < w.events.shape[1]:
        row = w.events[i, counts[stepper.EVENTS]]
        row[0] = w.n_margins - w.edges.shape[0] + e
        copy(w.moment[: 1 + 2 * n], row[1:])
        copy(w.booked, row[2 + 2 * n :])
    counts[stepper.EVENTS] += 1
    if counts[stepper.JUMPS] < w.jumps.shape[1]:
        row = w.jumps[i, counts[stepper.JUMPS]]
        row[0], row[1], row[6] = e, counts[stepper.ARCS], valid
        row[2], row[3], row[4], row[5] = released, gain, heat, entropy
        for k in range(given):
            row[7 + k] = w.totals_after[2 + k] - w.totals_before[2 + k]
        copy(w.moment, row[7 + given :])
        copy(w.after, row[7 + given + w.moment.shape[0] :])
    counts[stepper.JUMPS] += 1


@compiled
def jump(w: Any, i: int, e: int) -> bool:
    """Carry out an edge: reset, distribute heat, test the second law, update the ledger. False if left to Instant."""
    n, t, source, measure = w.n, w.moment[0], w.edges[e, stepper.HEAT_SOURCE], w.edges[e, stepper.MEASURE]
    rounding = GUARD_EPS * w.magnitude[w.n_margins - w.edges.shape[0] + e]
    if w.code[TOTALS, 0] == 0:
        return False
    copy(w.moment, w.after)
    evaluate_at(w, RESETS + e, w.moment, w.reset)
    for j in range(n):
        w.after[1 + j], w.after[1 + n + j] = w.reset[j], 0.0
    for k in range(w.held.shape[0]):
        w.after[1 + 2 * n + w.held[k]] = w.reset[n + k]
    before, now, varied = w.totals_before, w.totals_after, w.totals_perturbed
    _evaluate_totals(w, w.moment, before)
    _evaluate_totals(w, w.after, now)
    released, heat, entropy = before[0] - now[0], 0.0, 0.0
    if not finite(now[:1]):
        return False
    if abs(released) <= FEW_EPS * max(now[-2], abs(before[0])):
        released = 0.0
    else:
        heat, entropy = _distribute_heat(w, source, released)
        _evaluate_totals(w, w.after, now)
    copy(w.moment, w.perturbed)
    if measure >= 0:
        w.perturbed[1 + measure] += rounding
    _evaluate_totals(w, w.perturbed, varied)
    gain = now[1] - before[1] + entropy
    small = RUN_EPS * max(abs(before[1]), abs(now[1]), abs(entropy)) + FEW_EPS * before[-1] + abs(varied[1] - before[1])
    # Entropy production is not negative, up to roundoff and the uncertainty of the heat.
    admissible = gain >= -small - abs(varied[0] - before[0]) / _coldest(w)
    if not finite(w.after) or (w.edges[e, stepper.REFUSES] == 1 and not admissible):
        return False
    _write(w, i, e, released, gain, heat, entropy, admissible)
    _add_to_ledger(w, released, gain, heat, entropy)
    copy(w.after, w.moment)
    for k in range(w.jump_times.shape[0] - 1):
        w.jump_times[k] = w.jump_times[k + 1]
    w.jump_times[-1] = t
    if w.edges[e, stepper.RETURNS] >= 0:
        evaluate_at(w, TIMES_OF_RETURN, w.after, w.margin_slope)
        w.rebound_time, w.flight_time = t, -np.inf
        for k in range(w.edges.shape[0]):
            if w.edges[k, stepper.RETURNS] >= 0:
                w.flight_time = max(w.flight_time, w.margin_slope[w.edges[k, stepper.RETURNS]])
    return True
