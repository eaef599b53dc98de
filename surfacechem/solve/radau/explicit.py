"""Explicit steps of order 8 for nonstiff equations in explicit form: the pair of Dormand and Prince.

Their dense output, of order 7, is stored as its values at the nodes of seven implicit stages, which determine it:
outputs, events and the ledger read it as they read that of an implicit step.

Source: Hairer, Norsett & Wanner, Solving Ordinary Differential Equations I, sections II.5, II.6 and II.10 (DOP853).
"""

from typing import Any

import numpy as np

from surfacechem.solve.radau import tables
from surfacechem.solve.radau.work import RATES, compiled, copy, evaluate, finite, weighted_sums
from surfacechem.tolerances import TINY

ERROR_PART = 0.2
"""Part of the tolerance allowed for the error of a step: its dense output, of one order less, adds about as much
again.
"""
STIFF_STEP = 3.0
"""Product of step and fastest rate that counts as stiff if it persists: such a mode decays by 1e-19 in fifteen steps,
and an oscillation is not resolved. The method is stable up to 6.1, less where roundoff limits the steps.
"""
STABILITY_LIMIT, FOLLOWED_PART = 0.1, 0.1
"""Product of step and fastest rate from which on stability may limit steps at tight tolerances too, and the part of it
by which the rates change in a step once no state follows the fastest mode any more.
"""
STIFF_STEPS = 15
"""Stiff steps after which the run continues implicitly; two that are not stiff cancel one."""

SMOOTH_PART = 0.5
"""Part of its largest size that a divisor keeps all over a step of smooth equations. It is then within a third of a
constant: the powers of this third, of which its inverse is a series, soon vanish.
"""

MAX_ERROR_RATIO = 3.0
"""Largest ratio of the error of a repeated step to the one expected from its size; a larger one is noise, which
implicit steps can measure, or a change of formula.
"""

DENSEST = 2
"""Member of the implicit family whose stages hold the dense output."""


_change = weighted_sums(tables.EXPLICIT)
_errors = weighted_sums(tables.EXPLICIT_ERRORS)
_at_nodes = weighted_sums(tables.DENSE)


@compiled
def _evaluate_stage(w: Any, h: float, i: int, change: Any) -> None:
    """Evaluate the rates of stage i from those of the earlier stages."""
    inputs, y, k = w.inputs, w.y, w.k
    _change(i, k.ctypes.data, w.n, w.n, change.ctypes.data)
    inputs[0] = w.base + (w.tau + tables.EXPLICIT_NODES[i] * h)
    for m in range(w.n):
        inputs[1 + m] = y[m] + h * change[m]
    evaluate(w, RATES, k[i])


@compiled
def step_explicitly(w: Any, h: float, worst: float) -> float:
    """Return the norm of the local error of a step of this size, infinite where rates are not finite.

    Below ``worst`` it also provides the dense output. The rates are in w.k, those at the end of the step in row 12.
    """
    w.h_factored = h
    copy(w.ydot, w.k[0])
    for i in range(1, tables.STAGES_OF_DENSE):
        # Both of the last two changes are kept: a vector may overwrite the three rows behind its own.
        _evaluate_stage(w, h, i, w.slopes[4 if i == tables.STAGES_OF_DENSE - 2 else 0])
    w.residuals += tables.STAGES_OF_DENSE - 1
    # The error does not include the rates of these stages.
    for i in range(1, 5):
        if not finite(w.k[i]):
            return np.inf
    n, errors, change, largest, second = w.n, w.parts, w.slopes[0], 0.0, 0.0
    _errors(0, w.k.ctypes.data, n, n, errors[0].ctypes.data)
    _errors(1, w.k.ctypes.data, n, n, errors[4].ctypes.data)
    for m in range(n):
        size = max(abs(w.y[m]), abs(w.y[m] + h * change[m]))
        rate = h / max(w.atol[m] + w.rtol * size, TINY)
        largest, second = max(largest, abs(errors[0, m]) * rate), max(second, abs(errors[4, m]) * rate)
    # The estimate of fifth order, made one of seventh by that of third.
    norm = largest * largest / (ERROR_PART * np.sqrt(largest * largest + 0.01 * second * second + TINY))
    if not norm < worst:
        return max(norm, worst)
    # The further stages and the dense output, as changes at the nodes of the implicit stages.
    for i in range(tables.STAGES_OF_DENSE, tables.LAST_STAGE + 1):
        _evaluate_stage(w, h, i, w.parts[0])
    w.residuals += tables.LAST_STAGE + 1 - tables.STAGES_OF_DENSE
    total, z = 0.0, w.z
    for i in range(7):
        _at_nodes(i, w.k.ctypes.data, n, n, z[i].ctypes.data)
    for i in range(7):
        for m in range(n):
            z[i, m] *= h
            total += 0.0 * z[i, m]
    return norm if total == 0.0 else max(norm, worst)


@compiled
def is_long(w: Any) -> bool:
    """True if a step is long compared with the fastest rate, which the last two stages estimate."""
    k, largest, fastest, speed, change = w.k, 0.0, 0.0, 0.0, 0.0
    end, last = tables.STAGES_OF_DENSE - 1, tables.STAGES_OF_DENSE - 2
    for m in range(w.n):
        apart, unit = abs(k[end, m] - k[last, m]), 1.0 / w.weight[m]
        # From the variable in which the two differ most: in slower ones they differ by their error alone.
        if apart * unit > largest:
            largest, fastest = apart * unit, apart / (abs(w.slopes[0, m] - w.slopes[4, m]) + TINY)
        speed, change = max(speed, abs(k[end, m]) * unit), max(change, abs(k[end, m] - k[0, m]) * unit)
    is_limited = fastest > STABILITY_LIMIT and change < FOLLOWED_PART * fastest * speed
    return bool(fastest > STIFF_STEP or is_limited)


@compiled
def may_be_narrow(w: Any, h: float) -> bool:
    """True if the equations may change within less than the stages of a step resolve.

    Polynomials of a few states do not, if steps are not stiff and what they divide by changes by less than half of it.
    A cubic polynomial lies between its Bezier coefficients.
    """
    if w.explicit == 0 or w.divisors.shape[0] == 0 or is_long(w):
        return True
    wide, end = True, tables.STAGES_OF_DENSE - 1
    for m in range(w.n):
        if w.divisors[m]:
            first, last = w.y[m], w.y[m] + h * w.slopes[0, m]
            near, far = first + h / 3.0 * w.k[0, m], last - h / 3.0 * w.k[end, m]
            least, most = min(first, near, far, last), max(first, near, far, last)
            wide = wide and (least > SMOOTH_PART * most or most < SMOOTH_PART * least)
    return not wide


@compiled
def put_rates(w: Any, known: Any) -> None:
    """Evaluate the rates at the state in the inputs, and set the inputs to them."""
    n, inputs = w.n, w.inputs
    evaluate(w, RATES, known)
    w.residuals += 1
    for m in range(n):
        inputs[1 + n + m] = known[m]
