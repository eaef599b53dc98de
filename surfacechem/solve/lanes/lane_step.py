"""One explicit step of order 8 for eight runs at once, each with its own time and size: stages, error, polynomial, and
the looks at the equations inside it.

The rules are those of the steps of one run, with the accounts of the ledger integrated beside the states.

Source: Hairer, Norsett & Wanner, Solving Ordinary Differential Equations I, sections II.4, II.5 and II.10 (DOP853).
"""

from typing import Any

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray

from surfacechem.compile.vectors import LANES
from surfacechem.solve.lanes.layout import MEMORY, SIZES
from surfacechem.solve.lanes.vector import absolute, any_lane, floor, lanes, put, same, square_root, where
from surfacechem.solve.radau.dense import FORESEEN_PART, N_GROUPS, booked
from surfacechem.solve.radau.explicit import DENSEST, ERROR_PART, FELT, FOLLOWED, STIFF_STEP
from surfacechem.solve.radau.record import StepperRecord
from surfacechem.solve.radau.step import END_LOOKS, LOOK_PART, MAX_GROWTH, MIN_GROWTH, SAFETY, UNSEEN_ERROR
from surfacechem.solve.radau.tables import (
    DENSE_FACTORS,
    EXPLICIT,
    EXPLICIT_ERRORS,
    EXPLICIT_NODES,
    GAMMA,
    LAST_STAGE,
    STAGES_OF_DENSE,
)
from surfacechem.solve.radau.work import RATES, compiled, evaluate, weighted_sums
from surfacechem.tolerances import LOOSE_RTOL, RUN_EPS, TINY

WORK = StepperRecord("LaneWork", SIZES, {"loose": float}, MEMORY)
END_STAGE = STAGES_OF_DENSE - 1
"""The last stage of a step, at its end."""


def _polynomial_table() -> NDArray[np.float64]:
    """Coefficients of x, x^2, ... in the change over a fraction x of the step, per unit of it, from all its rates."""
    x = Polynomial([0.0, 1.0])
    table = np.zeros((len(DENSE_FACTORS) + 1, LAST_STAGE + 1))
    for stage in range(LAST_STAGE + 1):
        total = Polynomial([0.0])
        for i, factor in enumerate(DENSE_FACTORS[::-1, stage]):
            total = (total + factor) * (x if i % 2 == 0 else 1.0 - x)
        table[: len(total.coef), stage] = total.coef
    return table[1:]


_change = weighted_sums(EXPLICIT)
_errors = weighted_sums(EXPLICIT_ERRORS)
_coefficients = weighted_sums(_polynomial_table())
ORDER = len(DENSE_FACTORS)


@compiled
def larger(a: Any, b: Any) -> Any:
    """The larger at each place; the second where one is no number."""
    return where(a > b, a, b)


@compiled
def smaller(a: Any, b: Any) -> Any:
    """The smaller at each place; the second where one is no number."""
    return where(a < b, a, b)


@compiled
def eighth_root(a: Any) -> Any:
    """The root of order 8, that of the method."""
    return square_root(square_root(square_root(a)))


@compiled
def put_start(w: Any) -> None:
    """Time and state at the start of the step."""
    put(w.inputs[0], lanes(w.t))
    for m in range(w.n):
        put(w.inputs[1 + m], lanes(w.y[m]))


@compiled
def set_weights(w: Any) -> None:
    """Weights of the error norm at the start of the step."""
    for m in range(w.n):
        put(w.weight[m], larger(w.rtol * absolute(lanes(w.y[m])) + w.atol[m], TINY))


@compiled
def norm_of(w: Any, row: Any) -> Any:
    """The largest of these changes of the states beside their tolerances."""
    norm = same(0.0)
    for m in range(w.n):
        size = absolute(lanes(row[m])) / lanes(w.weight[m])
        norm = where(size <= norm, norm, size)  # not the larger: what is no number must be seen
    return norm


@compiled
def _evaluate_stage(w: Any, i: int, columns: int, change: Any) -> None:
    """Rates of a stage, by those of the stages before it, and the changes up to it of the first so many columns."""
    h = lanes(w.h)
    _change(i, w.k.ctypes.data, LANES * w.columns, LANES * columns, change.ctypes.data)
    put(w.inputs[0], lanes(w.t) + EXPLICIT_NODES[i] * h)
    for m in range(w.n):
        put(w.inputs[1 + m], lanes(w.y[m]) + h * lanes(change[m]))
    evaluate(w, RATES, w.k[i])


@compiled
def _ledger_norms(w: Any) -> Any:
    """Error of the accounts in units of what is allowed: those of one kind beside the largest of them, which turned
    over so much or soon will.
    """
    h, span = lanes(w.h), lanes(w.end) - lanes(w.t)
    for m in range(w.n_ledger):
        rate = same(0.0)
        for i in range(STAGES_OF_DENSE):
            rate = larger(rate, absolute(lanes(w.k[i, w.n + m])))
        put(w.q_rate[m], rate)
        put(w.q_scale[m], lanes(w.q_largest[m]) + larger(h, FORESEEN_PART * span) * rate)
    norm = same(0.0)
    for group in range(N_GROUPS):
        miss, second, scale = same(0.0), same(0.0), same(TINY)
        for m in range(w.n_ledger):
            if w.groups[m] == group:
                miss = larger(miss, absolute(lanes(w.coarse[w.n + m])))
                second = larger(second, absolute(lanes(w.fine[w.n + m])))
                scale = larger(scale, lanes(w.q_scale[m]))
        norm = larger(norm, h * miss * miss / (square_root(miss * miss + 0.01 * second * second) + TINY) / scale)
    return where(h < LOOSE_RTOL * lanes(w.t), 0.0, norm / booked(w.rtol))


@compiled
def try_step(w: Any) -> None:
    """All stages of a step of each lane, and the norms of their errors."""
    for i in range(1, END_STAGE):
        _evaluate_stage(w, i, w.n, w.change_before if i == END_STAGE - 1 else w.change)
    _evaluate_stage(w, END_STAGE, w.columns, w.change)
    h, every = lanes(w.h), LANES * w.columns
    _errors(0, w.k.ctypes.data, every, every, w.coarse.ctypes.data)
    _errors(1, w.k.ctypes.data, every, every, w.fine.ctypes.data)
    largest, second = same(0.0), same(0.0)
    blank = same(0.0)
    for m in range(w.columns):
        put(w.y_new[m], lanes(w.y[m]) + h * lanes(w.change[m]))
        blank = blank + 0.0 * lanes(w.coarse[m])  # no number where an error is none: comparisons lose it
    for m in range(w.n):
        size = larger(absolute(lanes(w.y[m])), absolute(lanes(w.y_new[m])))
        rate = h / larger(w.rtol * size + w.atol[m], TINY)
        error = absolute(lanes(w.coarse[m])) * rate
        largest = where(error <= largest, largest, error)
        second = larger(second, absolute(lanes(w.fine[m])) * rate)
    # The estimate of fifth order, made one of seventh by that of third.
    norm = largest * largest / (ERROR_PART * square_root(largest * largest + 0.01 * second * second + TINY))
    put(w.norm, blank + (larger(norm, _ledger_norms(w)) if w.n_ledger > 0 else norm))


@compiled
def propose(w: Any) -> None:
    """The size of the next step by the error of this one (Gustafsson 1994), or of its repetition where it fails."""
    h, h_last, given = lanes(w.h), lanes(w.h_last), lanes(w.norm)
    norm = larger(where(given < 1e30, given, 1e30), RUN_EPS)
    factor = SAFETY / eighth_root(norm)
    passes = norm < 1.0
    predicted = factor * h / h_last * eighth_root(lanes(w.norm_last) / norm)
    factor = where(passes & (h_last > 0.0), smaller(factor, predicted), factor)
    factor = smaller(larger(factor, MIN_GROWTH), MAX_GROWTH)
    put(w.following, h * where(passes & (lanes(w.again) > 0.5), smaller(factor, 1.0), factor))


@compiled
def find_stiff(w: Any) -> None:
    """Mark steps that are stiff, long beside the fastest rate, which the rates of the last two stages tell."""
    largest, fastest, speed, change = same(0.0), same(0.0), same(0.0), same(0.0)
    for m in range(w.n):
        end, unit = lanes(w.k[END_STAGE, m]), 1.0 / lanes(w.weight[m])
        apart = absolute(end - lanes(w.k[END_STAGE - 1, m]))
        # Of the variable that feels the difference of the two most: slower ones differ by their error alone.
        most = apart * unit > largest
        largest = where(most, apart * unit, largest)
        moved = absolute(lanes(w.change[m]) - lanes(w.change_before[m]))
        fastest = where(most, apart / (moved + TINY), fastest)
        speed = larger(speed, absolute(end) * unit)
        change = larger(change, absolute(end - lanes(w.k[0, m])) * unit)
    outrun = (fastest > FELT) & (change < FOLLOWED * fastest * speed)
    put(w.stiff, where((fastest > STIFF_STEP) | outrun, 1.0, 0.0))


@compiled
def interpolate(w: Any, columns: int) -> None:
    """The polynomials of the steps, of the first so many columns."""
    for i in range(STAGES_OF_DENSE, LAST_STAGE + 1):
        _evaluate_stage(w, i, w.n, w.rates)
    for d in range(ORDER):
        _coefficients(d, w.k.ctypes.data, LANES * w.columns, LANES * columns, w.polynomial[d].ctypes.data)


@compiled
def put_inside(w: Any, x: Any) -> None:
    """Time and state at the fraction x of each step."""
    h = lanes(w.h)
    put(w.inputs[0], lanes(w.t) + x * h)
    for m in range(w.n):
        total = lanes(w.polynomial[ORDER - 1, m])
        for d in range(ORDER - 2, -1, -1):
            total = total * x + lanes(w.polynomial[d, m])
        put(w.inputs[1 + m], lanes(w.y[m]) + h * x * total)


@compiled
def put_roughly(w: Any, x: float) -> None:
    """The same by the cubic Hermite polynomial of each step, for which it needs no further rates."""
    h = lanes(w.h)
    put(w.inputs[0], lanes(w.t) + x * h)
    for m in range(w.n):
        mean, first, last = lanes(w.change[m]), lanes(w.k[0, m]), lanes(w.k[END_STAGE, m])
        bend = 3.0 * mean - 2.0 * first - last + x * (first + last - 2.0 * mean)
        put(w.inputs[1 + m], lanes(w.y[m]) + h * x * (first + x * bend))


@compiled
def put_end(w: Any) -> None:
    """Time and state at the end of each step."""
    put(w.inputs[0], lanes(w.t) + lanes(w.h))
    for m in range(w.n):
        put(w.inputs[1 + m], lanes(w.y_new[m]))


@compiled
def _prepare_looks(w: Any) -> None:
    """Set the allowed defect of each column's rate from the slope of its polynomial, and that slope's coefficients."""
    h = lanes(w.h)
    for m in range(w.n):
        size = larger(absolute(lanes(w.y[m])), absolute(lanes(w.y_new[m])))
        put(w.allowed[m], UNSEEN_ERROR * GAMMA[DENSEST] * w.loose * larger(w.rtol * size + w.atol[m], TINY) / h)
    for m in range(w.n_ledger):
        put(w.allowed[w.n + m], same(np.inf))  # of what belongs to no group it only has to be a number
    for group in range(N_GROUPS):
        scale = same(TINY)
        for m in range(w.n_ledger):
            if w.groups[m] == group:
                scale = larger(scale, lanes(w.q_scale[m]))
        for m in range(w.n_ledger):
            if w.groups[m] == group:
                put(w.allowed[w.n + m], UNSEEN_ERROR * booked(w.rtol) * scale / h)
    for d in range(ORDER):
        for m in range(w.columns):
            put(w.slope_of[d, m], float(d + 1) * lanes(w.polynomial[d, m]))


@compiled
def _agrees(w: Any, x: Any) -> Any:
    """Mask of lanes in which equations and ledger rates at the fraction x of the step are close to the polynomials."""
    put_inside(w, x)
    evaluate(w, RATES, w.rates)
    agrees = x >= 0.0
    for m in range(w.columns):
        total = lanes(w.slope_of[ORDER - 1, m])
        for d in range(ORDER - 2, -1, -1):
            total = total * x + lanes(w.slope_of[d, m])
        defect, allowed = absolute(lanes(w.rates[m]) - total), lanes(w.allowed[m])
        close = defect <= allowed  # what is no number is not
        if m >= w.n and any_lane(~close):
            # The quadrature of a smooth rate is better than its polynomial of order 7, by 6/7 of that power; 3/4 is
            # what products give.
            part = defect / larger(larger(lanes(w.q_rate[m - w.n]), defect), TINY)
            squared = (defect / allowed) * (defect / allowed)
            close = squared * squared * (part * part * part) <= 1.0
        agrees = agrees & close
    return agrees


@compiled
def _miss(w: Any, x: Any, looks: Any) -> None:
    """Keep where the lanes that look there have missed something, if they have not before."""
    missed = lanes(w.missed)
    put(w.missed, where((looks > 0.5) & (missed == 1.0) & ~_agrees(w, x), x, missed))


@compiled
def has_points(w: Any, good: Any) -> bool:
    """Whether a step is looked at inside."""
    h, spacing = lanes(w.h), lanes(w.spacing_of)
    beside = lanes(w.begins) + lanes(w.last) + lanes(w.onto) > 0.5
    return bool(any_lane(good & (h > LOOK_PART * spacing) & (beside | (h >= spacing))))


@compiled
def look(w: Any, good: Any) -> None:
    """The fraction of each step at which it has missed something, one where it has not, as far as the points tell.

    Beside the ends of a segment, and of steps that an event has cut short, there may be something narrow.
    """
    h, spacing = lanes(w.h), lanes(w.spacing_of)
    looks = good & (h > LOOK_PART * spacing)
    _prepare_looks(w)
    begins, ends = where(looks, lanes(w.begins), 0.0), where(looks, larger(lanes(w.last), lanes(w.onto)), 0.0)
    if any_lane(begins > 0.5):
        # From the narrowest outwards: the first that differs says how short the step has to be.
        for k in range(END_LOOKS, 0, -1):
            _miss(w, same(10.0**-k), begins)
    points = where(looks, h / spacing, 0.0)
    i = 0.0
    while any_lane(points >= i + 1.0):
        # Of so many whole spacings each has one in its middle.
        most = floor(points)
        _miss(w, (i + 0.5) / larger(most, 1.0), where(most >= i + 1.0, 1.0, 0.0))
        i += 1.0
    if any_lane(ends > 0.5):
        for k in range(1, END_LOOKS + 1):
            _miss(w, same(1.0 - 10.0**-k), ends)
