"""Sides of zero on which margins are: where they start, and what counts as a crossing."""

from typing import Any

from surfacechem.solve.radau.work import (
    BASE,
    M_BEFORE,
    M_EARLIER,
    M_FIRST,
    M_FIRST_SIDE,
    M_LARGEST,
    M_NOW,
    M_SIDE,
    MARGINS,
    RTOL,
    TAU,
    YDOT,
    Y,
    clear,
    compiled,
    copy,
    evaluate,
    set_inputs,
)

LEAVING, AT_ZERO, BEYOND = 0.0, 2.0, -2.0
"""Sides of zero besides 1 and -1: of a margin that has just fired, of a limit that starts at zero, and beyond it."""

SHALLOW = 1e-10
"""Relative depth below zero that a margin must reach to pass where it turns round there. Less than the tolerance may be
the error of the states; at loose tolerances this much counts all the same, since what is brief is shallow, too.
"""

NOISE = 4e-15
"""Relative to the largest value seen, a margin this small is zero."""


@compiled
def noise(w: Any, m: int) -> float:
    """Size of a margin that is zero for all that can be told."""
    return float(NOISE * w.margin[M_LARGEST, m])


@compiled
def is_limit(kinds: Any, m: int) -> bool:
    """Whether the run may not go on where this margin is below zero."""
    return bool(kinds[m, 0] == 1 and kinds[m, 1] <= 0)


@compiled
def start_margins(w: Any, kinds: Any) -> None:
    """Sides of zero at a start or restart."""
    w.inputs[0] = w.clock[BASE] + w.clock[TAU]
    set_inputs(w, w.vector[Y], w.vector[YDOT])
    evaluate(w, MARGINS, w.margin[M_NOW].ctypes.data)
    copy(w.margin[M_NOW], w.margin[M_BEFORE])
    for m in range(w.margin.shape[1]):
        value = w.margin[M_NOW, m]
        w.margin[M_LARGEST, m] = max(w.margin[M_LARGEST, m], abs(value))
        if w.fired[m] != 0:
            w.margin[M_SIDE, m] = LEAVING
        elif abs(value) <= noise(w, m):
            w.margin[M_SIDE, m] = AT_ZERO if is_limit(kinds, m) else LEAVING
        elif value > 0.0:
            w.margin[M_SIDE, m] = 1.0
        else:
            w.margin[M_SIDE, m] = BEYOND if is_limit(kinds, m) else -1.0


@compiled
def keep_sides(w: Any) -> None:
    """Remember the margins at the start of a step."""
    copy(w.margin[M_SIDE], w.margin[M_FIRST_SIDE])
    copy(w.margin[M_BEFORE], w.margin[M_FIRST])


@compiled
def restore_sides(w: Any) -> None:
    """Go back to the margins at the start of a step that is made again; none has fired."""
    copy(w.margin[M_FIRST_SIDE], w.margin[M_SIDE])
    copy(w.margin[M_FIRST], w.margin[M_BEFORE])
    clear(w.fired)


@compiled
def crosses(w: Any, kinds: Any, m: int) -> bool:
    """Whether a margin lies across zero from its side, in a direction that counts; one to pass, by more than noise."""
    side, value, direction = w.margin[M_SIDE, m], w.margin[M_NOW, m], kinds[m, 1]
    if kinds[m, 3] == 1:
        return bool(side == 1.0 and value < -noise(w, m))
    falling = side == 1.0 and value <= 0.0 and direction <= 0
    rising = side == -1.0 and value >= 0.0 and direction >= 0
    return bool(falling or rising)


@compiled
def mark_at_end(w: Any, kinds: Any) -> None:
    """Mark the kinks that reach zero with the end of a segment: the next one cannot tell on which side they were."""
    set_inputs(w, w.vector[Y], w.vector[YDOT])
    w.inputs[0] = w.clock[BASE] + w.clock[TAU]
    evaluate(w, MARGINS, w.margin[M_NOW].ctypes.data)
    for m in range(kinds.shape[0]):
        side = w.margin[M_SIDE, m]
        counts = kinds[m, 0] == 0 and abs(side) == 1.0 and side * kinds[m, 1] <= 0.0
        if counts and abs(w.margin[M_NOW, m]) <= noise(w, m):
            w.fired[m] = 1


@compiled
def passed_by(w: Any, kinds: Any, m: int) -> float:
    """How far below zero the lowest point between two crossings has to lie to count."""
    return float(max(min(w.clock[RTOL], SHALLOW) * w.margin[M_LARGEST, m], noise(w, m)) if kinds[m, 3] == 1 else 0.0)


@compiled
def falls_from_start(w: Any, m: int) -> bool:
    """Whether a limit that started at zero or beyond is now found to have gone the wrong way."""
    side, value = w.margin[M_SIDE, m], w.margin[M_NOW, m]
    if side == AT_ZERO:
        return bool(value < -noise(w, m))
    return bool(side == BEYOND and value < w.margin[M_BEFORE, m] - noise(w, m))


@compiled
def update_sides(w: Any, kinds: Any) -> None:
    """Move on to the margins of now: their sides, the largest seen, and what was before."""
    copy(w.margin[M_BEFORE], w.margin[M_EARLIER])
    for m in range(w.margin.shape[1]):
        value, side = w.margin[M_NOW, m], w.margin[M_SIDE, m]
        w.margin[M_LARGEST, m] = max(w.margin[M_LARGEST, m], abs(value))
        moved = value - w.margin[M_BEFORE, m] if side == BEYOND else value
        if abs(moved) > (0.0 if abs(side) == 1.0 and kinds[m, 3] == 0 else noise(w, m)):
            w.margin[M_SIDE, m] = 1.0 if value > 0.0 else -1.0
        w.margin[M_BEFORE, m] = value


@compiled
def kink_at(w: Any, kinds: Any, first: int) -> int:
    """The kink at which a step ends: the margin that it went for, or another that fires there; -1 if there is none."""
    found = -1
    for m in range(kinds.shape[0]):
        if kinds[m, 0] == 0 and kinds[m, 2] == 0 and (m == first or (found < 0 and w.fired[m] != 0)):
            found = m
    return found
