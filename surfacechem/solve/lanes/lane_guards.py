"""Event location for eight runs at once: which guards are crossed in a step, where, and the steps that end there.

A guard that touches zero, or may do so, is marked as unclear: its run is repeated by the stepper for single runs.
"""

from typing import Any

import numpy as np

from surfacechem.solve.lanes.lane_step import larger, put_inside, smaller
from surfacechem.solve.lanes.vector import absolute, any_lane, lanes, put, put_where, same, where
from surfacechem.solve.radau.explicit import DENSEST
from surfacechem.solve.radau.guards import is_limit
from surfacechem.solve.radau.tables import SCANNED
from surfacechem.solve.radau.work import MARGINS, compiled, evaluate
from surfacechem.tolerances import CBRT_EPS, EPS, FORMULA_EPS, NEWTON_EPS, RUN_EPS, TINY

SCAN_FRACTIONS = SCANNED[DENSEST]
"""Fractions of a step at which guards are evaluated."""
MOST_SECANTS = 12
"""Most trial steps onto a guard: secant steps take four, the rounding of the guard a few more."""


@compiled
def start_margins(w: Any, fresh: Any) -> None:
    """Set the sides of the guards at a start or restart; a limit that may be beyond zero there is unclear. One that is
    at zero has no side until it leaves.
    """
    unclear = same(0.0)
    evaluate(w, MARGINS, w.margin)
    for m in range(w.n_margins):
        value, largest = lanes(w.margin[m]), lanes(w.margin_largest[m])
        largest = where(fresh, larger(largest, absolute(value)), largest)
        put(w.margin_largest[m], largest)
        put_where(fresh, w.margin_first[m], value)
        clear = (absolute(value) > FORMULA_EPS * largest) & (lanes(w.fired[m]) < 0.5)
        side = where(clear, where(value > 0.0, 1.0, -1.0), 0.0)
        put_where(fresh, w.side[m], side)
        if w.kinds[m, 5] == 0:
            put(w.side[m], 0.0)
        elif is_limit(w, m):
            unclear = where(side < -0.5, 1.0, unclear)
    put(w.unclear, unclear)


@compiled
def mark_at_end(w: Any, lane: int) -> bool:
    """Mark the kinks that reach zero at the end of a segment, as for a single run; True if there are any."""
    found = False
    for m in range(w.n_margins):
        side = w.side[m, lane]
        counts = w.kinds[m, 0] == 0 and abs(side) > 0.5 and side * w.kinds[m, 1] <= 0.0
        if counts and abs(w.margin[m, lane]) <= FORMULA_EPS * w.margin_largest[m, lane]:
            w.fired[m, lane], found = 1.0, True
    return found


@compiled
def _crosses(w: Any, m: int) -> Any:
    """Mask of lanes whose guard m has crossed zero in its direction; a strict guard by more than roundoff."""
    value, side, direction = lanes(w.margin[m]), lanes(w.side[m]), w.kinds[m, 1]
    least = FORMULA_EPS * lanes(w.margin_largest[m]) if w.kinds[m, 3] == 1 else same(0.0)
    falls = (side > 0.5) & (value <= 0.0 - least)
    rises = (side < -0.5) & (value >= least)
    if direction < 0:
        return falls
    if direction > 0:
        return rises
    return falls | rises


@compiled
def _dips(w: Any, m: int, a: float, b: float, c: float) -> Any:
    """Mask of lanes whose guard m has a minimum between three points that may touch zero although no point is across
    it.
    """
    side = lanes(w.side[m])
    at_a, at_b = side * lanes(w.margin_earlier[m]), side * lanes(w.margin_before[m])
    at_c = side * lanes(w.margin[m])
    falls, rises = (at_a - at_b) * ((c - a) / (b - a)), (at_c - at_b) * ((c - a) / (c - b))
    return (absolute(side) > 0.5) & (at_b < at_a) & (at_b < at_c) & (at_b <= larger(falls, rises))


@compiled
def may_cross(w: Any, good: Any) -> Any:
    """Mask of lanes whose guards need a scan of the step.

    A guard does if it is at zero at a quarter point of the step, or nearer to zero than twice its second difference
    over the quarter points: between two points a parabola dips by an eighth of that. States inside the step come from
    the cubic Hermite polynomial, whose error is small compared with its own second difference.
    """
    if w.n_margins == 0:
        return good & ~good  # nowhere
    for quarter in range(3):
        w.put_roughly(w, 0.25 * (quarter + 1))
        evaluate(w, MARGINS, w.margin_quarters[quarter])
    put(w.inputs[0], lanes(w.t) + lanes(w.h))
    for m in range(w.n):
        put(w.inputs[1 + m], lanes(w.y_new[m]))
    evaluate(w, MARGINS, w.margin_end)
    close = same(0.0)
    for m in range(w.n_margins):
        if w.kinds[m, 5] != 0:
            side, before, now = lanes(w.side[m]), lanes(w.margin_first[m]), lanes(w.margin_quarters[0, m])
            nearest, curvature = smaller(side * before, side * now), same(0.0)
            for quarter in range(1, 4):
                after = lanes(w.margin_quarters[quarter, m]) if quarter < 3 else lanes(w.margin_end[m])
                nearest = smaller(nearest, side * after)
                curvature = larger(curvature, absolute(after - 2.0 * now + before))
                before, now = now, after
            close = where(nearest > 2.0 * curvature, close, 1.0)
    return good & (lanes(w.onto) < 0.5) & (close > 0.5)


@compiled
def _scan(w: Any, searched: Any) -> None:
    """Find the first interval of each step in which guards cross, and which guards; unclear where one may touch
    zero.
    """
    for m in range(w.n_margins):
        put(w.margin[m], lanes(w.margin_first[m]))
    earlier, before = 0.0, 0.0
    for i in range(SCAN_FRACTIONS.shape[0]):
        x = SCAN_FRACTIONS[i]
        put_inside(w, same(x))
        for m in range(w.n_margins):  # the last two evaluations are kept
            put(w.margin_earlier[m], lanes(w.margin_before[m]))
            put(w.margin_before[m], lanes(w.margin[m]))
        evaluate(w, MARGINS, w.margin)
        found = same(0.0)
        for m in range(w.n_margins):
            if w.kinds[m, 5] == 0:
                continue
            crossed = searched & _crosses(w, m)
            found = where(crossed, 1.0, found)
            put_where(searched, w.fired[m], where(crossed, 1.0, 0.0))
            if before > 0.0:
                put_where(searched & _dips(w, m, earlier, before, x), w.unclear, 1.0)
        put_where(found > 0.5, w.low, before)
        put_where(found > 0.5, w.high, x)
        searched = searched & (found < 0.5)
        if not any_lane(searched):
            break
        for m in range(w.n_margins):
            value, side, largest = lanes(w.margin[m]), lanes(w.side[m]), lanes(w.margin_largest[m])
            largest = where(searched, larger(largest, absolute(value)), largest)
            put(w.margin_largest[m], largest)
            leaves = searched & (side == 0.0) & (absolute(value) > FORMULA_EPS * largest)
            if w.kinds[m, 5] != 0:
                put_where(leaves, w.side[m], where(value > 0.0, 1.0, -1.0))
                if is_limit(w, m):
                    put_where(leaves & (value < 0.0), w.unclear, 1.0)
        earlier, before = before, x


@compiled
def _nearest(w: Any) -> Any:
    """The least value of the guards that have fired, each counted positive on its own side."""
    least = same(np.inf)
    for m in range(w.n_margins):
        least = where(lanes(w.fired[m]) > 0.5, smaller(least, lanes(w.side[m]) * lanes(w.margin[m])), least)
    return least


@compiled
def _nearest_inside(w: Any, x: Any) -> Any:
    put_inside(w, x)
    evaluate(w, MARGINS, w.margin)
    return _nearest(w)


@compiled
def _locate(w: Any, crossing: Any) -> None:
    """Locate the zeros of guards on the dense output, and their slopes there (Illinois: Dowell & Jarratt 1971, BIT
    11).
    """
    low, high = lanes(w.low), lanes(w.high)
    at_low, at_high = _nearest_inside(w, low), _nearest_inside(w, high)
    # No guard is across zero at the very start of a step.
    at_low = where(at_low > 0.0, at_low, TINY)
    kept = same(0.0)
    for iteration in range(60):
        wide = crossing & (high - low > NEWTON_EPS * high) & (at_high < 0.0)
        if not any_lane(wide):
            break
        x = low + (high - low) * (at_low / (at_low - at_high))
        # Bisection at times: near a multiple zero the secants creep.
        x = where((x > low) & (x < high), x, 0.5 * (low + high)) if iteration % 8 != 7 else 0.5 * (low + high)
        value = _nearest_inside(w, x)
        across, before = value <= 0.0, kept
        kept = where(across, 1.0, -1.0)
        # An end that stays for a second time counts half, so that the secant moves past the zero.
        half_low, half_high = where(before > 0.5, 0.5, 1.0), where(before < -0.5, 0.5, 1.0)
        at_low = where(wide, where(across, half_low * at_low, value), at_low)
        at_high = where(wide, where(across, value, half_high * at_high), at_high)
        low, high = where(wide & ~across, x, low), where(wide & across, x, high)
    width = CBRT_EPS * larger(high, RUN_EPS)
    rise = _nearest_inside(w, high + width) - _nearest_inside(w, high - width)
    put_where(crossing, w.slope, rise / (2.0 * width * lanes(w.h)))
    put(w.crossing, where(crossing, high, 1.0))


@compiled
def find_crossings(w: Any, good: Any, close: Any) -> None:
    """Find the guards that are crossed in accepted steps, and where; for a step onto a guard, its value at the end.

    ``close`` is the mask of :func:`may_cross`, whose lanes have dense output.
    """
    landing, whole = good & (lanes(w.onto) > 0.5), good & (lanes(w.onto) < 0.5)
    for m in range(w.n_margins):
        if w.kinds[m, 5] != 0:
            largest = lanes(w.margin_largest[m])
            put_where(whole, w.margin_largest[m], larger(largest, absolute(lanes(w.margin_end[m]))))
    close = close & good
    put(w.high, 0.0)
    if any_lane(close):
        _scan(w, close)
    crossing = whole & (lanes(w.high) > 0.0)
    put(w.crossing, 1.0)
    if any_lane(crossing):
        _locate(w, crossing)
    for m in range(w.n_margins):
        put(w.margin[m], lanes(w.margin_end[m]))
    put_where(landing, w.value, _nearest(w))


@compiled
def ends_on_guard(w: Any, lane: int) -> bool:
    """True if a step onto a guard may end where it does; otherwise set the next trial, and mark it unclear after too
    many.

    It ends across zero by no more than time resolves, or just short of a kink: beyond one the last stage would already
    feel the other branch.
    """
    h, value, slope = w.h[lane], w.value[lane], w.slope[lane]
    attempt = w.landing[lane] - 1
    resolution = 0.5 * EPS * (abs(w.t[lane]) + h)
    change = -value / slope if slope < 0.0 else 0.0
    wanted = 1.0
    for m in range(w.n_margins):
        if w.fired[m, lane] > 0.5 and w.kinds[m, 0] == 0 and w.kinds[m, 2] == 0:
            wanted = -1.0  # the equations may have a kink there
    lies = value * wanted <= 0.0
    if lies and (abs(change) <= resolution * (1 + attempt) or w.nudge[lane] > 0.0 or attempt >= 6):
        return True
    if not lies and abs(change) <= resolution * (1 + attempt):
        # Time does not resolve this zero: cross it by the smallest push that changes the sign.
        w.nudge[lane] = max(2.0 * w.nudge[lane], resolution)
        change = wanted * w.nudge[lane]
    else:
        w.nudge[lane] = 0.0
    w.landing[lane] += 1
    if w.landing[lane] > MOST_SECANTS or slope >= 0.0:
        w.unclear[lane] = 1.0
    w.proposed[lane] = min(max(h + change, 0.5 * h), min(2.0 * h, w.longest[lane]))
    return False
