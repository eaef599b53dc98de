"""Event location: zeros of margins inside a step, and the sides of zero on which margins start.

Margins are evaluated at interior points of the step, since a step of high order may contain two crossings; minima
between the points are located if they may reach zero. The first zero is bracketed on the corrected polynomial, then the
step is repeated onto it with the full order of the method.
"""

from typing import Any

import numpy as np

from surfacechem.solve.radau.dense import finish_step, keep_polynomial, put_inside, put_scanned, scan_step
from surfacechem.solve.radau.newton import factor_newton, set_stage, stage_count
from surfacechem.solve.radau.step import repeat_step, store_polynomial, too_small
from surfacechem.solve.radau.tables import SCAN_EDGE, SCANNED
from surfacechem.solve.radau.work import MARGINS, any_true, clear, compiled, copy, evaluate, put
from surfacechem.tolerances import CBRT_EPS, EPS, FORMULA_EPS, LOOSE_RTOL, NEWTON_EPS, RUN_EPS, SQRT_EPS, TINY

LEAVING, AT_ZERO, BEYOND, RISING, FALLING, INACTIVE = 0.0, 2.0, -2.0, 3.0, -3.0, 4.0
"""Sides of zero other than 1 and -1: of a margin that has just fired; of a limit that starts at zero, or beyond it; of
a limit that leaves zero in this step, upwards or downwards; of a margin that is inactive in the modes of the run.
"""

ALIKE_NOISE = 1e3
"""Difference of two values of a margin, in units of its noise, below which it is unknown which is closer to zero."""

AT_START, NEEDS_SHORTER = -1.0, -2.0
"""Codes instead of the place of a zero: a limit is passed at the start; only a shorter step can decide if it is."""


@compiled
def noise(w: Any, m: int) -> float:
    """Return the size below which a margin counts as zero: its roundoff, proportional to its largest value so far."""
    return float(FORMULA_EPS * w.margin_largest[m])


@compiled
def is_limit(w: Any, m: int) -> bool:
    """True if the run must end where this margin is below zero."""
    return bool(w.kinds[m, 0] == 1 and w.kinds[m, 1] <= 0)


@compiled
def start_margins(w: Any) -> None:
    """Set the sides of zero at a start or restart."""
    if w.n_margins == 0:
        return
    put(w, 0.0, w.y, w.ydot)
    evaluate(w, MARGINS, w.margin)
    copy(w.margin, w.margin_before)
    for m in range(w.n_margins):
        value = w.margin[m]
        if w.active[m] == 0:
            w.side[m] = INACTIVE
            continue
        w.margin_largest[m] = max(w.margin_largest[m], abs(value))
        if w.fired[m] != 0:
            w.side[m] = LEAVING
        elif abs(value) <= noise(w, m):
            w.side[m] = AT_ZERO if is_limit(w, m) else LEAVING
        elif value > 0.0:
            w.side[m] = 1.0
        else:
            w.side[m] = BEYOND if is_limit(w, m) else -1.0


@compiled
def restore_sides(w: Any) -> None:
    """Restore the margins at the start of a step that is repeated; none has fired."""
    copy(w.side_first, w.side)
    copy(w.margin_first, w.margin_before)
    clear(w.fired)


@compiled
def update_sides(w: Any) -> None:
    """Move on to the present margins: update their sides, largest values and last values."""
    copy(w.margin_before, w.margin_earlier)
    copy(w.side, w.side_last)
    for m in range(w.n_margins):
        value, side = w.margin[m], w.side[m]
        w.margin_largest[m] = max(w.margin_largest[m], abs(value))
        # A margin on a side changes it at once; one that leaves zero must first exceed roundoff.
        least = 0.0 if abs(side) == 1.0 and w.kinds[m, 3] == 0 else noise(w, m)
        if abs(side) < AT_ZERO and abs(value) > least:
            w.side[m] = 1.0 if value > 0.0 else -1.0
        w.margin_before[m] = value


@compiled
def crosses(w: Any, m: int) -> bool:
    """True if a margin has crossed zero from its side, in a direction that counts; a strict one by more than noise."""
    side, value, direction = w.side[m], w.margin[m], w.kinds[m, 1]
    if w.kinds[m, 3] == 1:
        return bool(side == 1.0 and value < -noise(w, m))
    falling = side == 1.0 and value <= 0.0 and direction <= 0
    rising = side == -1.0 and value >= 0.0 and direction >= 0
    return bool(falling or rising)


@compiled
def mark_at_end(w: Any) -> None:
    """Mark the kinks that reach zero at the end of a segment: the next segment cannot tell on which side they were."""
    put(w, 0.0, w.y, w.ydot)
    evaluate(w, MARGINS, w.margin)
    for m in range(w.n_margins):
        side = w.side[m]
        counts = w.kinds[m, 0] == 0 and abs(side) == 1.0 and side * w.kinds[m, 1] <= 0.0
        if counts and abs(w.margin[m]) <= noise(w, m):
            w.fired[m] = 1


@compiled
def _leave(w: Any, m: int, rises: bool, held: float) -> None:
    """Set the side of a limit that leaves its start at zero or beyond; ``held`` is that of a rise from zero."""
    beyond = w.side[m] == BEYOND
    w.side[m] = FALLING if not rises else -1.0 if beyond else held


@compiled
def _follow_rates(w: Any, h: float) -> None:
    """Set the sides of limits that start at zero or beyond and leave as fast as their initial rate predicts."""
    for j in range(w.n):
        w.trial[j] = w.y[j] + SCAN_EDGE * h * w.ydot[j]
    put(w, SCAN_EDGE * h, w.trial, w.ydot)
    evaluate(w, MARGINS, w.margin_probe)
    for m in range(w.n_margins):
        by_rate, change = w.margin_probe[m] - w.margin_before[m], w.margin[m] - w.margin_before[m]
        if abs(w.side[m]) == AT_ZERO and abs(by_rate) > noise(w, m) and 0.5 < change / by_rate < 2.0:
            _leave(w, m, by_rate > 0.0, 1.0)


@compiled
def _any_at_zero(w: Any) -> bool:
    """True if limits start a step at zero or beyond; reset how far each falls and rises in it."""
    found = False
    for m in range(w.n_margins):
        if w.side[m] == RISING:
            w.side[m] = AT_ZERO if abs(w.margin_before[m]) <= noise(w, m) else 1.0
        found = found or abs(w.side[m]) == AT_ZERO
        w.low[m] = w.high[m] = 0.0
    return found


@compiled
def _sides_are_known(w: Any, h: float) -> bool:
    """True if the step determines to which sides limits go that start at zero.

    Motion from rest under a load begins as a power of time, far below the error that the tolerance allows the
    polynomial there, which may have either sign. If a limit both falls and rises by more than the tolerance, a shorter
    step is needed; in the shortest step the larger excursion decides.
    """
    if not _any_at_zero(w):
        return True
    # Store how far each falls and rises in the step in the rows for brackets.
    for i in range(4 * w.member + 9):
        put_scanned(w, h, i)
        evaluate(w, MARGINS, w.margin)
        if i == 0:
            _follow_rates(w, h)
        for m in range(w.n_margins):
            change = w.margin[m] - (w.margin_before[m] if w.side[m] == BEYOND else 0.0)
            w.low[m] = max(w.low[m], -change)
            w.high[m] = max(w.high[m], change)
    known, shortest = True, too_small(w, 0.25 * h)
    for m in range(w.n_margins):
        fall, rise = w.low[m], w.high[m]
        small = max(noise(w, m), w.rtol * max(fall, rise))
        if abs(w.side[m]) == AT_ZERO and max(fall, rise) > noise(w, m):
            known = known and (shortest or min(fall, rise) <= small)
            _leave(w, m, rise > fall, RISING)
    return known


@compiled
def _probe(w: Any, h: float, m: int, x: float) -> float:
    """Evaluate a margin at the fraction x of the step, on the polynomial."""
    put_inside(w, h, x)
    evaluate(w, MARGINS, w.margin_probe)
    return float(w.margin_probe[m])


@compiled
def _may_reach(a: float, b: float, c: float, at_a: float, at_b: float, at_c: float) -> bool:
    """True if a smooth function with these values may have a minimum at or below zero in between."""
    steepest = max((at_a - at_b) / (b - a), (at_c - at_b) / (c - b))
    return at_b < at_a and at_b < at_c and at_b <= steepest * (c - a)


@compiled
def _vertex(a: float, b: float, c: float, at_a: float, at_b: float, at_c: float) -> float:
    """Return the minimum of the parabola, or a point in the larger part if that is no progress."""
    left, right = (b - a) * (at_b - at_c), (b - c) * (at_b - at_a)
    x = b - 0.5 * ((b - a) * left - (b - c) * right) / (left - right)
    if a < x < c and abs(x - b) > 1e-2 * (c - a):
        return x
    return b + 0.1 * (c - b) if c - b > b - a else b - 0.1 * (b - a)


@compiled
def _reaches(w: Any, h: float, m: int, a: float, b: float, c: float) -> float:
    """Return a point near b where a margin with a minimum there is across zero, or touches it; -1 if it does not.

    By parabolas, or a tenth of the larger part where these make no progress, to the accuracy with which values
    determine a minimum (after Brent 1973, Algorithms for Minimization without Derivatives, chapter 5).
    """
    side = w.side[m]
    touches = is_limit(w, m) and w.kinds[m, 3] == 0
    # A strict margin has to pass zero by more than the error of the states, which may be below the tolerance: at loose
    # tolerances a fixed part is used, since a brief dip is also shallow.
    shallow = max(min(w.rtol, LOOSE_RTOL) * w.margin_largest[m], noise(w, m))
    least = shallow if w.kinds[m, 3] == 1 else 0.0
    at_a, at_b, at_c = side * _probe(w, h, m, a), side * _probe(w, h, m, b), side * _probe(w, h, m, c)
    for _iteration in range(80):
        if at_b <= -least:
            return b
        if c - a <= SQRT_EPS * c or not _may_reach(a, b, c, at_a, at_b, at_c):
            break
        x = _vertex(a, b, c, at_a, at_b, at_c)
        at_x = side * _probe(w, h, m, x)
        if at_x < at_b and x > b:
            a, at_a, b, at_b = b, at_b, x, at_x
        elif at_x < at_b:
            c, at_c, b, at_b = b, at_b, x, at_x
        elif x > b:
            c, at_c = x, at_x
        else:
            a, at_a = x, at_x
    return b if touches and at_b <= noise(w, m) else -1.0


@compiled
def _dips(w: Any, h: float, m: int, a: float, b: float, c: float) -> bool:
    """True if a margin reaches zero between three points without being across at any of them; stores the bracket."""
    side = w.side[m]
    if abs(side) != 1.0 or side * w.kinds[m, 1] > 0.0:
        return False
    values = side * w.margin_earlier[m], side * w.margin_before[m], side * w.margin[m]
    if not _may_reach(a, b, c, values[0], values[1], values[2]):
        return False
    keep_polynomial(w)
    x = _reaches(w, h, m, a, b, c)
    w.low[m], w.high[m] = a, x
    return x > 0.0


@compiled
def _mark(w: Any, h: float, earlier: float, before: float, x: float) -> float:
    """Mark the margins that reach zero up to x, with their brackets.

    Return x if there are any, AT_START if a limit is passed at the start, else 0.
    """
    found = 0.0
    for m in range(w.n_margins):
        w.low[m], w.high[m] = before, x
        # A limit that falls from zero, or from beyond it, has left zero by now.
        falls = w.side[m] == FALLING and w.margin[m] < -noise(w, m)
        if falls and before <= SCAN_EDGE:
            found = AT_START
        elif falls:
            w.high[m] = before
        marked = falls or crosses(w, m) or (before > 0.0 and _dips(w, h, m, earlier, before, x))
        w.fired[m] = marked
        if marked and found == 0.0:
            found = x
    return found


@compiled
def _scan(w: Any, h: float) -> tuple[float, float]:
    """Return the start and the end of the first interval in which margins reach zero.

    The end is 0 if there is none, AT_START if a limit is passed at the start, NEEDS_SHORTER if one may be.
    """
    # All points at once: one product of tables and stages instead of a polynomial at each point.
    scan_step(w)
    if not _sides_are_known(w, h):
        return 0.0, NEEDS_SHORTER
    earlier, before = 0.0, 0.0
    for i in range(4 * w.member + 9):
        x = SCANNED[w.member, i]
        put_scanned(w, h, i)
        evaluate(w, MARGINS, w.margin)
        found = _mark(w, h, earlier, before, x)
        if found > 0.0:
            # Others may have a minimum in this interval, which shows with a point just behind it.
            keep_polynomial(w)
            copy(w.margin_before, w.margin_earlier)
            copy(w.margin, w.margin_before)
            put_inside(w, h, x + SCAN_EDGE)
            evaluate(w, MARGINS, w.margin)
            for m in range(w.n_margins):
                if w.fired[m] == 0:
                    w.fired[m] = _dips(w, h, m, before, x, x + SCAN_EDGE)
        if found != 0.0:
            return before, found
        update_sides(w)
        earlier, before = before, x
    return 1.0, 0.0


@compiled
def _bracketed(w: Any, h: float, m: int, low: float, high: float) -> float:
    """Return the zero of one margin on the polynomial: the crossed end of a small bracket (Illinois method).

    Source: Dowell & Jarratt (1971), A modified regula falsi method, BIT 11.
    """
    side = w.side[m]
    value_high, value_low = _probe(w, h, m, high), _probe(w, h, m, low)
    if value_high * side > 0.0:
        # The margin only touches zero there.
        return high
    # A jump just behind the start of an arc is at the start, as far as the time of the run tells.
    kept, least = 0, EPS * (w.elapsed + w.arc_start) / h
    for iteration in range(100):
        if high <= least or high - low <= NEWTON_EPS * high or value_high == 0.0:
            break
        x = low + (high - low) * (value_low / (value_low - value_high))
        # Bisect every eighth time: near a multiple zero the secants converge slowly.
        if not low < x < high or iteration % 8 == 7:
            x = 0.5 * (low + high)
        value = _probe(w, h, m, x)
        if value * side <= 0.0:
            high, value_high = x, value
            # Halve the value at an end that is kept twice, so that the secant passes the zero.
            value_low *= 0.5 if kept == 1 else 1.0
            kept = 1
        else:
            low, value_low = x, value
            value_high *= 0.5 if kept == -1 else 1.0
            kept = -1
    return high


@compiled
def _first(w: Any, h: float) -> tuple[int, float]:
    """Return the marked margin that reaches zero first, and where; store the slopes, per step, of all that cross."""
    first, earliest = -1, 2.0
    for m in range(w.n_margins):
        w.margin_slope[m] = 0.0
        if w.fired[m] != 0:
            x = _bracketed(w, h, m, w.low[m], w.high[m])
            if _probe(w, h, m, x) * w.side[m] <= 0.0:
                width = CBRT_EPS * max(x, RUN_EPS)
                rise = _probe(w, h, m, x + width) - _probe(w, h, m, x - width)
                w.margin_slope[m] = rise / (2.0 * width)
            if x < earliest:
                first, earliest = m, x
    return first, earliest


@compiled
def _step_onto(w: Any, size: float, worst: float) -> float:
    """Repeat the step with another size and the full order of the method, and evaluate the margins at its end.

    Return the size, or 0 if the step fails or its error is not below ``worst``.
    """
    w.h_factored = 0.0
    norm = repeat_step(w, size) if w.explicit != 0 or factor_newton(w, size) else np.inf
    if not norm < np.inf:
        return 0.0
    if w.explicit == 0:
        store_polynomial(w, size, 0.0)
    finish_step(w, size)
    set_stage(w, stage_count(w.member) - 1, size)
    evaluate(w, MARGINS, w.margin)
    return size if norm < worst else 0.0


@compiled
def _resolution(w: Any, size: float) -> float:
    """Return the resolution of time at the end of a step: half the spacing of doubles there."""
    return float(0.5 * EPS * (abs(w.base + w.tau) + size))


@compiled
def _refine(w: Any, h: float, m: int, x: float, worst: float) -> float:
    """Step onto the zero of margin m, ending on the crossed side.

    Return the step size, or 0 if the repeated step fails or its error is not below ``worst``. The slope of a margin
    that touches zero vanishes, and that of a near touch is unreliable: neither is used.
    """
    side, slope = w.side[m], w.margin_slope[m]
    size = best = x * h
    closest, nudge = np.inf, 0.0
    store_polynomial(w, h, 0.0)
    resolution = _resolution(w, size)
    for attempt in range(12):
        if _step_onto(w, size, worst) == 0.0:
            return 0.0
        value = w.margin[m]
        change = -value / slope * h if slope != 0.0 else 0.0
        crossed = value * side <= 0.0 or slope == 0.0
        # After a few attempts the remaining value is roundoff of the margin.
        if crossed and (abs(change) <= resolution * (1 + attempt) or nudge > 0.0 or attempt >= 6):
            return size
        if abs(value) > 2.0 * closest + ALIKE_NOISE * noise(w, m):
            # Its closest value counts as zero if it is noise; otherwise the polynomial was too coarse.
            return _step_onto(w, best, worst) if closest <= ALIKE_NOISE * noise(w, m) else 0.0
        if abs(value) < closest:
            best, closest = size, abs(value)
        if not crossed and abs(change) <= resolution:
            # Time does not resolve this zero: cross it by the smallest push, and do not return.
            nudge = change = max(2.0 * nudge, resolution)
        else:
            nudge = 0.0
        # The secant may be wrong near a kink: change the step by at most a factor of two.
        size = min(max(size + change, 0.5 * size), min(2.0 * size, 1.25 * h))
    return _step_onto(w, size, worst)


@compiled
def _short_of(w: Any, h: float, m: int, size: float) -> float:
    """Return a step that ends just short of a kink, as near as noise and time resolve: beyond it the last stage would
    already see the other branch.
    """
    side = w.side[m]
    slope = max(abs(w.margin_slope[m]) / h, abs(w.margin_before[m]) / size)
    # Double the distance at each attempt, so that few are needed for any slope.
    for attempt in range(40):
        shorter = size - _resolution(w, size) * 2.0**attempt
        if not (shorter > 0.5 * size and _step_onto(w, shorter, np.inf) > 0.0):
            break
        nearest = 2.0 * slope * (size - shorter)
        if 0.0 < w.margin[m] * side <= max(nearest, noise(w, m)):
            return shorter
    _step_onto(w, size, np.inf)
    return size


@compiled
def resolved(w: Any, size: float) -> float:
    """Return the difference below which two times count as equal."""
    return float(NEWTON_EPS * abs(w.base + w.tau) + RUN_EPS * size)


@compiled
def _mark_coincident(w: Any, h: float, size: float, first: int) -> bool:
    """Mark as fired the margins that are also across zero, or within roundoff of it in time.

    True if another than the first is well across: the polynomial was then too coarse to order them, as across an
    unknown kink.
    """
    near, passed = resolved(w, size), False
    for m in range(w.n_margins):
        value, slope = w.margin[m], w.margin_slope[m]
        close = abs(value) * h <= near * abs(slope) if slope != 0.0 else abs(value) <= noise(w, m)
        across = crosses(w, m)
        passed = passed or (m != first and across and not close and abs(value) > ALIKE_NOISE * noise(w, m))
        w.fired[m] = across or (w.fired[m] != 0 and close)
    return passed


@compiled
def _kink_at(w: Any, first: int) -> int:
    """Return the kink at which a step ends: the located margin, or another that fires there; -1 if there is none."""
    found = -1
    for m in range(w.n_margins):
        if w.kinds[m, 0] == 0 and w.kinds[m, 2] == 0 and (m == first or (found < 0 and w.fired[m] != 0)):
            found = m
    return found


@compiled
def find_event(w: Any, h: float) -> float:
    """Find the first event in the step and step onto it; return the size of the step, and mark all margins that fire.

    It is h if there is no event, 0 if the step must be repeated, and AT_START if a limit is passed at the start. If the
    event proves not to exist, the step ends there with no margin marked.
    """
    copy(w.side, w.side_first)
    copy(w.margin_before, w.margin_first)
    before, end = _scan(w, h)
    if end == NEEDS_SHORTER:
        restore_sides(w)
        return 0.0
    if end <= 0.0:
        return h if end == 0.0 else AT_START
    first, earliest = _first(w, h)
    if earliest < before:
        # A minimum is detected one point later: restore the sides of the point before it.
        copy(w.side_last, w.side)
    # A fold may lie just beyond a guard: explicit steps have to pass their error test there too.
    tested = w.kinds[first, 2] == 1 or (w.explicit != 0 and w.kinds[first, 0] == 1)
    size = _refine(w, h, first, max(earliest, TINY), 1.0 if tested else np.inf)
    if size == 0.0 or _mark_coincident(w, h, size, first):
        restore_sides(w)
        return 0.0
    short = _kink_at(w, first)
    if short >= 0:
        size = _short_of(w, h, short, size)
        _mark_coincident(w, h, size, short)
        w.fired[short] = 1
    # If a strict margin is not zero at the end, its dip was an artefact of the polynomial.
    left = w.margin[first] * w.side[first]
    reached = left <= ALIKE_NOISE * noise(w, first) + abs(w.margin_slope[first]) * resolved(w, size) / h
    w.fired[first] = w.kinds[first, 3] == 0 or reached
    if w.fired[first] == 0 and not any_true(w.fired):
        update_sides(w)
    return size
