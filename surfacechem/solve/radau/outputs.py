"""Outputs inside a step.

The collocation polynomial serves where it satisfies the equations between the stages. In components that follow
others at once it is a mere interpolation, which the error estimate of the step does not see; there an output is
computed by a step of its own, from the start of the main step, which has the full order of the method.
"""

from typing import Any

from surfacechem.solve.radau.dense import add_probe, integrate_ledger, interpolate, interpolate_rate, keep_polynomial
from surfacechem.solve.radau.newton import CONVERGED, end_of_step, factor_newton, predict, solve_stages, stage_count
from surfacechem.solve.radau.roundoff import find_noise
from surfacechem.solve.radau.step import MAGNIFIED, filter_residual, store_polynomial
from surfacechem.solve.radau.tables import GAMMA, PROBE, PROBE_RATE
from surfacechem.solve.radau.work import (
    BASE,
    CONTRACTION,
    ERROR,
    GUESSED,
    LEDGER,
    MEMBER,
    NOISE,
    Q_PROBE,
    Q_TRIAL,
    TAU,
    THETA,
    TRIAL,
    TRIAL_DOT,
    TRIES,
    WEIGHT,
    compiled,
    copy,
    evaluate,
    set_inputs,
)

ALLOWED = 2.0
"""Error of the polynomial between its stages, in units of the tolerance."""


@compiled
def _largest(w: Any, floor: float) -> float:
    """Largest error in units of the tolerance, of the part above so many times the noise."""
    norm = 0.0
    for j in range(w.algebraic.shape[0]):
        size = (abs(w.vector[ERROR, j]) - floor * w.vector[NOISE, j]) / w.vector[WEIGHT, j]
        # Not max(): a NaN must reach the caller.
        if not size <= norm:
            norm = size
    return norm


@compiled
def _polynomial_serves(w: Any, h: float) -> bool:
    """Whether the equations hold at the probe, midway between the stages, where the polynomial is worst."""
    x = PROBE[w.count[MEMBER]]
    interpolate_rate(w, h, x)
    w.inputs[0] = w.clock[BASE] + (w.clock[TAU] + x * h)
    set_inputs(w, w.vector[TRIAL], w.vector[TRIAL_DOT])
    filter_residual(w)
    if _largest(w, 0.0) <= ALLOWED:
        return True
    find_noise(w)
    return bool(_largest(w, MAGNIFIED) <= ALLOWED)


@compiled
def _probe_ledger(w: Any, h: float) -> None:
    """Sample the rates of the ledger at the probe. The correction of the state there comes first: a fast rate would
    magnify its error.
    """
    k = w.count[MEMBER]
    for j in range(w.algebraic.shape[0]):
        w.vector[TRIAL, j] += w.vector[ERROR, j]
        w.vector[TRIAL_DOT, j] += GAMMA[k] / h * w.vector[ERROR, j]
    set_inputs(w, w.vector[TRIAL], w.vector[TRIAL_DOT])
    evaluate(w, LEDGER, w.ledger[Q_PROBE].ctypes.data)
    for m in range(w.ledger.shape[1]):
        defect = w.ledger[Q_PROBE, m] - PROBE_RATE[k, 7] * w.rates[7, m]
        for i in range(stage_count(k)):
            defect -= PROBE_RATE[k, i] * w.rates[i, m]
        w.ledger[Q_PROBE, m] = h * defect
    add_probe(w, k, w.ledger[Q_PROBE])


@compiled
def _recall_step(w: Any, h: float) -> None:
    """Stages and quadratures of the main step, from its stored polynomial."""
    for i in range(stage_count(w.count[MEMBER])):
        copy(w.z_last[i], w.z[i])
    if w.ledger.shape[1] > 0:
        integrate_ledger(w, h)


@compiled
def _step_aside(w: Any, size: float) -> bool:
    """State and ledger at the end of a step of this size, as trial values; False where Newton's method fails."""
    if not factor_newton(w, size):
        return False
    predict(w, size)
    w.clock[CONTRACTION] = 1.0
    if solve_stages(w, size) != CONVERGED:
        return False
    if w.ledger.shape[1] > 0:
        integrate_ledger(w, size)
    end_of_step(w, size, TRIAL, TRIAL_DOT, Q_TRIAL)
    return True


@compiled
def _write(w: Any, row: Any) -> None:
    """[y | ledger] of the trial values."""
    n = w.algebraic.shape[0]
    copy(w.vector[TRIAL], row)
    copy(w.ledger[Q_TRIAL], row[n:])


@compiled
def _write_by_steps(w: Any, times: Any, outputs: Any, first: int, last: int, h: float) -> None:
    """Each output by a step of its own; leaves the main step as it was."""
    theta, contraction, guessed = w.clock[THETA], w.clock[CONTRACTION], w.clock[GUESSED]
    tries = w.count[TRIES]
    store_polynomial(w, h, 0.0)
    for i in range(first, last):
        size = (times[i] - w.clock[BASE]) - w.clock[TAU]
        if not (0.0 < size < h and _step_aside(w, size)):
            interpolate(w, min(max(size / h, 0.0), 1.0))
        _write(w, outputs[i])
    _recall_step(w, h)
    factor_newton(w, h)
    w.clock[THETA], w.clock[CONTRACTION], w.clock[GUESSED] = theta, contraction, guessed
    w.count[TRIES] = tries


@compiled
def _write_inside(w: Any, times: Any, outputs: Any, first: int, last: int, h: float) -> None:
    """Outputs between the ends of the step."""
    keep_polynomial(w)
    serves = _polynomial_serves(w, h)
    if w.ledger.shape[1] > 0:
        _probe_ledger(w, h)
    if not serves:
        _write_by_steps(w, times, outputs, first, last, h)
        return
    for i in range(first, last):
        x = ((times[i] - w.clock[BASE]) - w.clock[TAU]) / h
        interpolate(w, min(max(x, 0.0), 1.0))
        _write(w, outputs[i])


@compiled
def write_outputs(w: Any, times: Any, outputs: Any, first: int, h: float, end: float) -> int:
    """Outputs up to the end of the step; returns how many the run has now."""
    last = first
    while last < times.shape[0] and times[last] < end:
        last += 1
    if last > first:
        _write_inside(w, times, outputs, first, last, h)
    if last < times.shape[0] and times[last] == end:
        end_of_step(w, h, TRIAL, TRIAL_DOT, Q_TRIAL)
        _write(w, outputs[last])
        last += 1
    return last
