"""Outputs inside a step.

The collocation polynomial is used if it satisfies the equations between the stages. In components that follow others
instantaneously it merely interpolates, and the error estimate of the step does not include that error; nor is it as
accurate as the ends of long steps, whose order is higher. Then the step is repeated in equal parts, whose polynomials
are better. Outputs for which these do not serve either are computed by a step onto each, with the full order of the
method.
"""

from typing import Any

import numpy as np

from surfacechem.solve.radau.dense import (
    finish_step,
    integrate_ledger,
    keep_polynomial,
    probe_ledger,
    put_inside,
    scan_step,
)
from surfacechem.solve.radau.explicit import step_explicitly
from surfacechem.solve.radau.newton import end_of_step, factor_newton, nested_four, stage_count
from surfacechem.solve.radau.roundoff import MAGNIFIED, find_noise
from surfacechem.solve.radau.step import filter_residual, repeat_step, store_polynomial
from surfacechem.solve.radau.tables import PROBE, PROBE_RATE, PROBE_SHAPE, SCANNED
from surfacechem.solve.radau.work import compiled, copy
from surfacechem.tolerances import FINER_BY

POLYNOMIAL_ERROR = 2.0
"""Largest error of the polynomial between its stages, in units of the tolerance."""

PART_ERROR = 0.1
"""The same of the polynomial of a part of a step: a choice that keeps the accuracy of a step onto each output. Half a
step has an error a hundred times smaller, so that a larger one would save little.
"""

FEW_PARTS = 16
"""Most parts in which a step is repeated for its outputs: a choice. More cost more than a step onto each of a few
outputs, whose number must not decide: none of them depends on others.
"""

MOST_PARTS = 64
"""Most parts of a step, equal in time or in its logarithm, between which states are stored: a polynomial of order 7
needs no more.
"""

FLAT_RANGE = 1e3
"""Range of a state, in tolerances, added to the actual range: a smaller variation is error."""


@compiled
def _largest(w: Any, floor: float) -> float:
    """Return the largest error in units of the tolerance, less ``floor`` times the noise."""
    norm = 0.0
    for j in range(w.n):
        size = (abs(w.error[j]) - floor * w.noise[j]) / w.weight[j]
        # Not max(): a NaN must reach the caller.
        if not size <= norm:
            norm = size
    return norm


@compiled
def _passed(w: Any, time: float, origin: float) -> float:
    """Return the time from the start of the step to an output."""
    return float(((time - origin) - w.base) - w.tau)


@compiled
def write_four(w: Any, times: Any, outputs: Any, first: int, end: int, h: float, origin: float) -> None:
    """Write up to four outputs from the polynomials of the step."""
    k, x, n = w.member, w.fractions, w.n
    top, last = stage_count(k) + 1, end - 1
    for i in range(4):
        x[i] = min(max(_passed(w, times[min(first + i, last)], origin) / h, 0.0), 1.0)
    second, third, fourth = min(first + 1, last), min(first + 2, last), min(first + 3, last)
    for m in range(n + w.n_ledger):
        start, row = (w.y[m], w.polynomial[m]) if m < n else (w.q[m - n], w.q_polynomial[m - n])
        a, b, c, d = nested_four(k, top, x, row)
        outputs[fourth, m], outputs[third, m], outputs[second, m], outputs[first, m] = (
            start + d,
            start + c,
            start + b,
            start + a,
        )


@compiled
def _probe_polynomial(w: Any, h: float) -> None:
    """Prepare the polynomials of state and ledger, and find the error of that of the state midway between the stages,
    where it is least accurate.
    """
    k, s = w.member, stage_count(w.member)
    keep_polynomial(w)
    put_inside(w, h, PROBE[k])
    filter_residual(w)
    if w.n_ledger > 0:
        probe_ledger(w, h)
    # The next term of the ledger's polynomial, from the defect of its rates at the probe.
    for m in range(w.n_ledger):
        defect = w.q_probe[m] - PROBE_RATE[k, 7] * w.rates[7, m]
        for i in range(s):
            defect -= PROBE_RATE[k, i] * w.rates[i, m]
        for i in range(s + 2):
            w.q_polynomial[m, i] += PROBE_SHAPE[k, i] * (h * defect)


@compiled
def _write_by_parts(
    w: Any, times: Any, outputs: Any, first: int, last: int, h: float, origin: float, parts: int
) -> int:
    """Write outputs from the polynomials of equal parts of the step, up to a part in which that is not accurate; return
    the number of the next output.
    """
    start, size = w.tau, h / parts
    if w.explicit == 0 and not factor_newton(w, size):
        return first
    copy(w.y, w.y_first)
    copy(w.ydot, w.ydot_first)
    copy(w.q, w.q_first)
    copy(w.rates[7], w.rates_first)
    for part in range(parts):
        w.offset, w.contraction = part / parts, 1.0
        if not repeat_step(w, size) < np.inf:
            break
        finish_step(w, size)
        _probe_polynomial(w, size)
        if not _largest(w, MAGNIFIED) <= PART_ERROR:
            break
        following = first
        while following < last and (part + 1 == parts or _passed(w, times[following], origin) <= size):
            following += 1
        for i in range(first, following, 4):
            write_four(w, times, outputs, i, following, size, origin)
        first = following
        if first == last:
            break
        end_of_step(w, size, w.y, w.ydot, w.q)
        copy(w.rates[stage_count(w.member) - 1], w.rates[7])
        w.tau = start + (part + 1) * size
    w.tau, w.offset = start, 0.0
    copy(w.y_first, w.y)
    copy(w.ydot_first, w.ydot)
    copy(w.q_first, w.q)
    copy(w.rates_first, w.rates[7])
    return first


@compiled
def _write_by_step(w: Any, times: Any, outputs: Any, i: int, h: float, origin: float) -> None:
    """Write an output computed by a separate step of full order; if Newton's method fails, it stays as it is."""
    size = _passed(w, times[i], origin)
    w.contraction = 1.0
    if not 0.0 < size < h or (w.explicit == 0 and not factor_newton(w, size)) or not repeat_step(w, size) < np.inf:
        return
    if w.n_ledger > 0:
        integrate_ledger(w, size)
    end_of_step(w, size, outputs[i], w.trial_dot, outputs[i, w.n :])


@compiled
def _write_inside(w: Any, times: Any, outputs: Any, first: int, last: int, h: float, origin: float) -> None:
    """Write states at times in order between the ends of the step, counted from an origin."""
    _probe_polynomial(w, h)
    missed, s = _largest(w, 0.0), stage_count(w.member)
    if missed > POLYNOMIAL_ERROR:
        find_noise(w)
        missed = _largest(w, MAGNIFIED)
    for i in range(first, last, 4):
        write_four(w, times, outputs, i, last, h, origin)
    if missed <= POLYNOMIAL_ERROR:
        return
    theta, contraction, guessed, tries = w.theta, w.contraction, w.guess_error, w.newton_steps
    store_polynomial(w, h, 0.0)
    copy(w.correction, w.z_last[s])  # a row that is free
    # In components that follow others, the error of the polynomial goes with this power of the size.
    parts = np.ceil((missed / PART_ERROR) ** (1.0 / s))
    if parts <= FEW_PARTS:
        first = _write_by_parts(w, times, outputs, first, last, h, origin, int(parts))
    for i in range(first, last):
        _write_by_step(w, times, outputs, i, h, origin)
    # Restore the main step after others were taken inside it: its stages, quadratures and factors, the correction of
    # its polynomial, and the state of Newton's method: the next step must not depend on the requested outputs.
    if w.explicit != 0:
        step_explicitly(w, h, np.inf)
    for i in range(s):
        copy(w.z_last[i], w.z[i])
    copy(w.z_last[s], w.correction)
    if w.n_ledger > 0:
        integrate_ledger(w, h)
    if w.explicit == 0:
        factor_newton(w, h)
    w.theta, w.contraction, w.guess_error, w.newton_steps = theta, contraction, guessed, tries


@compiled
def _add_booked(w: Any, rows: Any, first: int, last: int) -> None:
    """Add the ledger at the start of the arc to rows of states and ledgers."""
    for i in range(first, last):
        for m in range(w.n_ledger):
            rows[i, w.n + m] += w.booked[m]


@compiled
def write_now(w: Any, row: Any) -> None:
    """Write the present state and ledger."""
    copy(w.y, row)
    for m in range(w.n_ledger):
        row[w.n + m] = w.booked[m] + w.q[m]


@compiled
def is_within(w: Any, t: float, end: float) -> bool:
    """True if an output time is at most this time of the arc, and not after its segment, whose end it may round to."""
    return bool(t - w.arc_start <= end and t <= w.outputs_end)


@compiled
def write_outputs(w: Any, times: Any, outputs: Any, first: int, h: float, end: float) -> int:
    """Write the outputs up to the end of the step, at this time of the arc; return the run's number of outputs."""
    last = first
    while last < times.shape[0] and times[last] - w.arc_start < end:
        last += 1
    if last > first:
        _write_inside(w, times, outputs, first, last, h, w.arc_start)
    while last < times.shape[0] and is_within(w, times[last], end):  # several if the time of the arc rounds
        end_of_step(w, h, outputs[last], w.trial_dot, outputs[last, w.n :])
        last += 1
    _add_booked(w, outputs, first, last)
    return last


@compiled
def _parts(w: Any, h: float, growth: float) -> Any:
    """Return the numbers of parts of the step in which linear interpolation of every state keeps to the allowed error.

    The parts are equal in time, or in the logarithm of the time of the run, which becomes 1 + ``growth`` times as long.
    """
    scan_step(w)
    last, by_time, by_ratio = 4 * w.member + 8, 0.0, 0.0
    for i in range(last + 1):
        x = SCANNED[w.member, i]
        w.decades[i] = np.log1p(growth * x) / np.log1p(growth) if growth > 0.0 else x
        # A load may be a ramp since the start of the segment, which is curved over the logarithm only.
        by_ratio = max(by_ratio, abs(x - w.decades[i]) * h / ((w.tau + h) * FINER_BY))
    for m in range(w.n):
        # Ranges include the ends of earlier steps only, so that a continued run has the same.
        low = w.least[m] = min(w.least[m], w.y[m])
        high = w.largest[m] = max(w.largest[m], w.y[m])
        missed, beside, total = 0.0, 0.0, w.scanned[last, m]
        for i in range(last + 1):
            change = w.scanned[i, m]
            low, high = min(low, w.y[m] + change), max(high, w.y[m] + change)
            missed = max(missed, abs(change - SCANNED[w.member, i] * total))
            beside = max(beside, abs(change - w.decades[i] * total))
        size = high - low + FLAT_RANGE * w.weight[m]
        by_time, by_ratio = max(by_time, missed / size), max(by_ratio, beside / size)
    # The error of linear interpolation is of second order in its length.
    return (
        min(int(np.ceil(np.sqrt(by_time / w.line_error))), MOST_PARTS),
        min(int(np.ceil(np.sqrt(by_ratio / w.line_error))), MOST_PARTS),
    )


@compiled
def write_interior(w: Any, times: Any, states: Any, first: int, h: float) -> int:
    """Store states inside the step so that linear interpolation over time and its logarithm is accurate enough.

    Return the number of the run so far, including those for which there was no memory.
    """
    start = w.elapsed + (w.arc_start + (w.base + w.tau))
    growth = h / start if start > 0.0 else 0.0
    parts, ratios = _parts(w, h, growth)
    if ratios > 0 and growth <= parts * np.expm1(np.log1p(growth) / ratios):
        ratios = 0  # equal parts of the time suffice where parts of its logarithm are longest
    last = first + max(parts - 1, 0) + max(ratios - 1, 0)
    if first < last <= times.shape[0]:
        part = ratio = 1
        for i in range(first, last):
            by_time = h * part / parts if part < parts else np.inf
            by_ratio = start * np.expm1(np.log1p(growth) * ratio / ratios) if ratio < ratios else np.inf
            if by_time <= by_ratio:
                part += 1
            else:
                ratio += 1
            times[i] = w.base + (w.tau + min(by_time, by_ratio))
        _write_inside(w, times, states, first, last, h, 0.0)
        _add_booked(w, states, first, last)
        for i in range(first, last):
            times[i] += w.arc_start
    return last
