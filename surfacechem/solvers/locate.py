"""Events: zeros of margins inside a step.

Margins are examined at interior points of the step, since a high order steps over double crossings. The first zero is
bracketed on the corrected polynomial, then the step is repeated onto it with the full order of the method.
"""

from typing import Any

from surfacechem.solvers.dense import interpolate_rate, keep_polynomial
from surfacechem.solvers.native import (
    BASE,
    H_FACTORED,
    M_BEFORE,
    M_LARGEST,
    M_NOW,
    M_SIDE,
    M_SLOPE,
    MARGINS,
    MEMBER,
    TAU,
    TRIAL,
    TRIAL_DOT,
    YDOT,
    Y,
    compiled,
    evaluate,
    set_inputs,
)
from surfacechem.solvers.radau_advance import finish_step, store_polynomial
from surfacechem.solvers.radau_stages import CONVERGED, factor_newton, predict, set_stage, solve_stages, stage_count
from surfacechem.solvers.radau_step import estimate_error

POINTS = 16
NOISE = 4e-15
"""Relative to the largest value seen, a margin this small right after a start has not left zero."""


@compiled
def margins_inside(w: Any, h: float, x: float) -> None:
    """Margins at the fraction x of the step, from the polynomial."""
    interpolate_rate(w, h, x)
    w.inputs[0] = w.clock[BASE] + (w.clock[TAU] + x * h)
    set_inputs(w, w.vector[TRIAL], w.vector[TRIAL_DOT])
    evaluate(w, MARGINS, w.margin[M_NOW].ctypes.data)


@compiled
def start_margins(w: Any) -> None:
    """Sides of zero at a start or restart; a margin that has just fired, or is zero, has to leave zero first."""
    w.inputs[0] = w.clock[BASE] + w.clock[TAU]
    set_inputs(w, w.vector[Y], w.vector[YDOT])
    evaluate(w, MARGINS, w.margin[M_NOW].ctypes.data)
    for m in range(w.margin.shape[1]):
        value = w.margin[M_NOW, m]
        w.margin[M_LARGEST, m] = max(w.margin[M_LARGEST, m], abs(value))
        if w.fired[m] != 0 or abs(value) <= NOISE * w.margin[M_LARGEST, m]:
            w.margin[M_SIDE, m] = 0.0
        else:
            w.margin[M_SIDE, m] = 1.0 if value > 0.0 else -1.0


@compiled
def _crosses(side: float, value: float, direction: int) -> bool:
    falling = side > 0.0 and value <= 0.0 and direction <= 0
    rising = side < 0.0 and value >= 0.0 and direction >= 0
    return falling or rising


@compiled
def _update_sides(w: Any) -> None:
    for m in range(w.margin.shape[1]):
        value = w.margin[M_NOW, m]
        w.margin[M_BEFORE, m] = value
        w.margin[M_LARGEST, m] = max(w.margin[M_LARGEST, m], abs(value))
        if abs(value) > (NOISE * w.margin[M_LARGEST, m] if w.margin[M_SIDE, m] == 0.0 else 0.0):
            w.margin[M_SIDE, m] = 1.0 if value > 0.0 else -1.0


@compiled
def _scan(w: Any, h: float, kinds: Any) -> float:
    """End of the first interval in which margins cross, marking them; 0 if there is none."""
    any_crossing = False
    for i in range(1, POINTS + 1):
        x = i / POINTS
        margins_inside(w, h, x)
        for m in range(kinds.shape[0]):
            crossing = _crosses(w.margin[M_SIDE, m], w.margin[M_NOW, m], kinds[m, 1])
            w.fired[m] = crossing
            any_crossing = any_crossing or crossing
        if any_crossing:
            return x
        _update_sides(w)
    return 0.0


@compiled
def _bisect(w: Any, h: float, m: int, low: float, high: float) -> float:
    """Zero of one margin on the polynomial: the crossed end of a small bracket (Illinois method)."""
    side = w.margin[M_SIDE, m]
    margins_inside(w, h, high)
    value_high = w.margin[M_NOW, m]
    margins_inside(w, h, low)
    value_low = w.margin[M_NOW, m]
    if value_low * side <= 0.0:
        # The bracket starts where the margin fired before it had left zero.
        return low
    kept = 0
    for iteration in range(100):
        if high - low <= 1e-13 * high or value_high == 0.0:
            break
        x = low + (high - low) * (value_low / (value_low - value_high))
        if not low < x < high or iteration % 8 == 7:
            x = 0.5 * (low + high)
        margins_inside(w, h, x)
        value = w.margin[M_NOW, m]
        if value * side <= 0.0:
            high, value_high = x, value
            value_low *= 0.5 if kept == 1 else 1.0
            kept = 1
        else:
            low, value_low = x, value
            value_high *= 0.5 if kept == -1 else 1.0
            kept = -1
    return high


@compiled
def _slope(w: Any, h: float, m: int, x: float) -> float:
    """Change of a margin per step, from the polynomial around x."""
    width = 1e-4 * x
    margins_inside(w, h, x + width)
    ahead = w.margin[M_NOW, m]
    margins_inside(w, h, x - width)
    return float((ahead - w.margin[M_NOW, m]) / (2.0 * width))


@compiled
def step_onto(w: Any, size: float) -> bool:
    """Repeat the step with another size, with the full order of the method."""
    w.clock[H_FACTORED] = 0.0
    if not factor_newton(w, size):
        return False
    predict(w, size)
    if solve_stages(w, size) != CONVERGED:
        return False
    store_polynomial(w, size, 0.0)
    estimate_error(w, size)
    finish_step(w, size)
    return True


@compiled
def _margins_at_end(w: Any, size: float) -> None:
    set_stage(w, stage_count(w.count[MEMBER]) - 1, size)
    evaluate(w, MARGINS, w.margin[M_NOW].ctypes.data)


@compiled
def _refine(w: Any, h: float, m: int, x: float, slope: float) -> float:
    """Step onto the zero of margin m, landing on the crossed side; returns the step size, or 0 where the repeated
    step fails.
    """
    side = w.margin[M_SIDE, m]
    size = x * h
    store_polynomial(w, h, 0.0)
    resolution = 2e-16 * (abs(w.clock[BASE] + w.clock[TAU]) + size)
    for attempt in range(12):
        if not step_onto(w, size):
            return 0.0
        _margins_at_end(w, size)
        value = w.margin[M_NOW, m]
        change = -value / slope * h if slope != 0.0 else 0.0
        crossed = value * side <= 0.0
        if crossed and (abs(change) <= resolution or value == 0.0 or attempt >= 6):
            return size
        if not crossed and abs(change) <= resolution:
            change = resolution * 2.0**attempt
        size = min(max(size + change, 0.5 * size), min(2.0 * size, 1.25 * h))
    return size


@compiled
def _mark_coincident(w: Any, h: float, size: float, kinds: Any) -> None:
    """Keep as fired the margins that are across zero too, or within rounding of it in time."""
    _margins_at_end(w, size)
    near = 1e-12 * (abs(w.clock[BASE] + w.clock[TAU]) * 1e-2 + size)
    for m in range(kinds.shape[0]):
        value, slope = w.margin[M_NOW, m], w.margin[M_SLOPE, m]
        across = _crosses(w.margin[M_SIDE, m], value, kinds[m, 1])
        close = slope != 0.0 and abs(value / slope) * h <= near
        w.fired[m] = across or (w.fired[m] != 0 and close)


@compiled
def find_event(w: Any, h: float, kinds: Any) -> float:
    """Size of the step onto the first event, marking all that fire there; h if there is none, 0 if the step must be
    repeated.
    """
    keep_polynomial(w)
    end = _scan(w, h, kinds)
    if end == 0.0:
        return h
    first, earliest = -1, 2.0
    for m in range(kinds.shape[0]):
        w.margin[M_SLOPE, m] = 0.0
        if w.fired[m] != 0:
            x = _bisect(w, h, m, end - 1.0 / POINTS, end)
            w.margin[M_SLOPE, m] = _slope(w, h, m, max(x, 1e-12))
            if x < earliest:
                first, earliest = m, x
    size = _refine(w, h, first, max(earliest, 1e-300), w.margin[M_SLOPE, first])
    if size == 0.0:
        return 0.0
    _mark_coincident(w, h, size, kinds)
    w.fired[first] = 1
    return size
