"""An explicit step of order 8 where the equations give their rates and are not stiff: the pair of Dormand and Prince.

Its polynomial, of order 7, is kept as its values at the nodes of seven implicit stages, which determine it: outputs,
events and the ledger read it as they read that of an implicit step.

Source: Hairer, Norsett & Wanner, Solving Ordinary Differential Equations I, sections II.5, II.6 and II.10 (DOP853).
"""

from typing import Any

import numpy as np

from surfacechem.solve.radau.tables import (
    DENSE,
    EXPLICIT,
    EXPLICIT_ERRORS,
    EXPLICIT_NODES,
    GAMMA,
    LAST_STAGE,
    STAGES_OF_DENSE,
)
from surfacechem.solve.radau.work import RATES, compiled, copy, evaluate, finite, weighted_sums
from surfacechem.tolerances import TINY

ERROR_PART = 0.2
"""Part of the tolerance that an error of a step may take: what its polynomial, one order lower, adds is about as much
again as the rest.
"""
STIFF_STEP = 3.0
"""Step times the fastest rate that counts as stiff where it lasts: what decays so fast is gone by 1e-19 in fifteen
steps, and what swings is not resolved. The method is stable up to 6.1, less where rounding limits the steps.
"""
FELT, FOLLOWED = 0.1, 0.1
"""Step times the fastest rate from which on it limits steps at tight tolerances, too, and the part of that by which the
rates change in a step where nothing follows the fastest any more.
"""
STIFF_STEPS = 15
"""Number of stiff steps after which the run goes on implicitly; two others take back one of them."""

FALLS = 3.0
"""Largest ratio of the error of a repeated step to the one expected of its size; more is noise, which implicit steps
measure, or a formula that changes.
"""

DENSEST = 2
"""The member of the implicit family whose stages carry the polynomial."""


_change = weighted_sums(EXPLICIT)
_errors = weighted_sums(EXPLICIT_ERRORS)
_at_nodes = weighted_sums(DENSE)


@compiled
def _evaluate_stage(w: Any, h: float, i: int, change: Any) -> None:
    """Rates of a stage, by those of the stages before it."""
    inputs, y, k = w.inputs, w.y, w.k
    _change(i, k.ctypes.data, w.n, w.n, change.ctypes.data)
    inputs[0] = w.base + (w.tau + EXPLICIT_NODES[i] * h)
    for m in range(w.n):
        inputs[1 + m] = y[m] + h * change[m]
    evaluate(w, RATES, k[i])


@compiled
def _error_of_step(w: Any, h: float) -> float:
    """The norm of the local error from the rates of all stages."""
    n, errors, change, largest, second = w.n, w.parts, w.slopes[0], 0.0, 0.0
    _errors(0, w.k.ctypes.data, n, n, errors[0].ctypes.data)
    _errors(1, w.k.ctypes.data, n, n, errors[4].ctypes.data)
    for m in range(n):
        size = max(abs(w.y[m]), abs(w.y[m] + h * change[m]))
        rate = h / max(w.atol[m] + w.rtol * size, TINY)
        largest, second = max(largest, abs(errors[0, m]) * rate), max(second, abs(errors[4, m]) * rate)
    # The estimate of fifth order, made one of seventh by that of third.
    return float(largest * largest / (ERROR_PART * np.sqrt(largest * largest + 0.01 * second * second + TINY)))


@compiled
def _interpolate(w: Any, h: float) -> bool:
    """Further rates, and the polynomial of the step as the changes at the nodes of the stages; whether they are
    finite.
    """
    n, z = w.n, w.z
    for i in range(STAGES_OF_DENSE, LAST_STAGE + 1):
        _evaluate_stage(w, h, i, w.parts[0])
    w.residuals += LAST_STAGE + 1 - STAGES_OF_DENSE
    for i in range(7):
        _at_nodes(i, w.k.ctypes.data, n, n, z[i].ctypes.data)
    total = 0.0
    for i in range(7):
        for m in range(n):
            z[i, m] *= h
            total += 0.0 * z[i, m]
    return bool(total == 0.0)


@compiled
def step_explicitly(w: Any, h: float, worst: float) -> float:
    """The norm of the local error of a step of this size, infinite where it has no rates; with its polynomial where the
    norm is below the worst. Its rates are those of w.k, in row 12 those at its end.
    """
    w.h_factored = h
    copy(w.ydot, w.k[0])
    for i in range(1, STAGES_OF_DENSE):
        # The last two changes are kept: a vector runs over into the three rows behind its own.
        _evaluate_stage(w, h, i, w.slopes[4 if i == STAGES_OF_DENSE - 2 else 0])
    w.residuals += STAGES_OF_DENSE - 1
    # The rates of these stages are no part of the error themselves.
    for i in range(1, 5):
        if not finite(w.k[i]):
            return np.inf
    norm = _error_of_step(w, h)
    return norm if norm < worst and _interpolate(w, h) else max(norm, worst)


@compiled
def mark_noise(w: Any, norm: float, expected: float) -> None:
    """Count the error of a step that was repeated with another size as a stiff one where it has not fallen with it."""
    if norm > FALLS * expected:
        w.stiff_steps += STIFF_STEPS


@compiled
def is_stiff(w: Any) -> bool:
    """Whether steps are long beside the fastest rate again and again, as the rates of the last two stages tell."""
    k, largest, fastest, speed, change = w.k, 0.0, 0.0, 0.0, 0.0
    end, last = STAGES_OF_DENSE - 1, STAGES_OF_DENSE - 2
    for m in range(w.n):
        apart, unit = abs(k[end, m] - k[last, m]), 1.0 / w.weight[m]
        # Of the variable that feels the difference of the two most: slower ones differ by their error alone.
        if apart * unit > largest:
            largest, fastest = apart * unit, apart / (abs(w.slopes[0, m] - w.slopes[4, m]) + TINY)
        speed, change = max(speed, abs(k[end, m]) * unit), max(change, abs(k[end, m] - k[0, m]) * unit)
    outrun = fastest > FELT and change < FOLLOWED * fastest * speed
    w.stiff_steps = w.stiff_steps + 2 if fastest > STIFF_STEP or outrun else max(w.stiff_steps - 1, 0)
    return bool(w.stiff_steps >= 2 * STIFF_STEPS)


@compiled
def defect_of_rates(w: Any, error: Any) -> bool:
    """By how much the rates in the inputs miss those of the equations, as an error of the state; whether it is
    finite.
    """
    evaluate(w, RATES, error)
    w.residuals += 1
    for m in range(w.n):
        error[m] = (error[m] - w.inputs[1 + w.n + m]) * w.h_factored / GAMMA[DENSEST]
    return bool(finite(error))


@compiled
def put_rates(w: Any, known: Any) -> None:
    """Rates of the equations at the state in the inputs, into these."""
    n, inputs = w.n, w.inputs
    evaluate(w, RATES, known)
    w.residuals += 1
    for m in range(n):
        inputs[1 + n + m] = known[m]
