"""One explicit step of order 8 of eight runs at once: stages, local error, dense output, and checks against the
equations between the stages.

The rules are those of the stepper for single runs; here the ledger is integrated as further states.

Source: Hairer, Norsett & Wanner, Solving Ordinary Differential Equations I, sections II.4, II.5 and II.10 (DOP853).
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray

from surfacechem.compile.vectors import LANES
from surfacechem.solve.lanes.layout import ORDER
from surfacechem.solve.lanes.vector import (
    absolute,
    any_lane,
    floor,
    lanes,
    polynomial,
    polynomial_of,
    put,
    same,
    square_root,
    where,
)
from surfacechem.solve.radau import explicit, tables
from surfacechem.solve.radau.dense import FORESEEN_PART, N_GROUPS, ledger_rtol
from surfacechem.solve.radau.explicit import DENSEST
from surfacechem.solve.radau.step import CHECK_PART, END_CHECKS, MAX_DEFECT, MAX_GROWTH, MIN_GROWTH, SAFETY
from surfacechem.solve.radau.work import RATES, compiled, evaluate, evaluate_at, weighted_sums
from surfacechem.tolerances import LEAST_WEIGHT, LOOSE_RTOL, RUN_EPS, TINY

END_STAGE = tables.STAGES_OF_DENSE - 1
"""The last stage, at the end of the step."""
COUNT = np.arange(LANES, dtype=float)
_NARROWING = 10.0 ** -np.arange(1, END_CHECKS + 1)
NEAR_START = np.concatenate([_NARROWING[::-1], np.ones(LANES)])
"""Fractions of a step for looks next to its start, with room for the last vector."""
NEAR_END = np.concatenate([np.ones(LANES), 1.0 - _NARROWING, np.ones(LANES)])
"""The same next to its end, with room before the first of them, too."""


def coefficients_of(polynomials: Sequence[Polynomial], count: int) -> NDArray[np.float64]:
    """Return the coefficients of x, x^2, ..., a row for each power."""
    table = np.zeros((count + 1, len(polynomials)))
    for j, each in enumerate(polynomials):
        table[: len(each.coef), j] = each.coef
    return table[1:]


_change = weighted_sums(tables.EXPLICIT, LANES)
_errors = weighted_sums(tables.EXPLICIT_ERRORS, LANES)
# Of the change over a fraction x of the step, per unit of the step, by all rates.
_coefficients = weighted_sums(coefficients_of(tables.dense_at(Polynomial([0.0, 1.0])), ORDER), LANES)


@compiled
def larger(a: Any, b: Any) -> Any:
    """The larger value of each lane; the second where one is NaN."""
    return where(a > b, a, b)


@compiled
def smaller(a: Any, b: Any) -> Any:
    """The smaller value of each lane; the second where one is NaN."""
    return where(a < b, a, b)


@compiled
def root_of(_w: Any, a: Any) -> Any:
    """The eighth root, for step sizes of a method of order 8."""
    return square_root(square_root(square_root(a)))


@compiled
def put_start(w: Any) -> None:
    """Set the inputs to time and state at the start of the step."""
    put(w.inputs[0], lanes(w.t))
    for m in range(w.n):
        put(w.inputs[1 + m], lanes(w.y[m]))


@compiled
def put_moved(w: Any, passed: Any, changes: Any, factor: Any) -> None:
    """Set the inputs to the time that has passed since the start of the step, and to the states with these changes."""
    put(w.inputs[0], lanes(w.t) + passed)
    for m in range(w.n):
        put(w.inputs[1 + m], lanes(w.y[m]) + factor * lanes(changes[m]))


@compiled
def set_weights(w: Any) -> None:
    """Set the weights of the error norm at the start of the step."""
    for m in range(w.n):
        put(w.weight[m], larger(w.rtol * absolute(lanes(w.y[m])) + w.atol[m], LEAST_WEIGHT))


@compiled
def norm_of(w: Any, row: Any) -> Any:
    """The maximum norm of changes of the states, relative to their tolerances."""
    norm = same(0.0)
    for m in range(w.n):
        size = absolute(lanes(row[m])) / lanes(w.weight[m])
        norm = where(size <= norm, norm, size)  # not larger(): NaN must be seen
    return norm


@compiled
def _tolerance(w: Any, m: int) -> Any:
    """The tolerance of a state over the step."""
    size = larger(absolute(lanes(w.y[m])), absolute(lanes(w.y_new[m])))
    return larger(w.rtol * size + w.atol[m], LEAST_WEIGHT)


@compiled
def error_norm(w: Any, errors: Any) -> Any:
    """The maximum norm of errors of the states at the end of the step, relative to their tolerances over the step."""
    norm = same(0.0)
    for m in range(w.n):
        size = absolute(lanes(errors[m])) / _tolerance(w, m)
        norm = where(size <= norm, norm, size)  # not larger(): NaN must be seen
    return norm


@compiled
def _evaluate_stage(w: Any, i: int) -> None:
    """Evaluate the rates of stage i, and the weighted sum of the earlier stages: of the accounts at the end alone."""
    h, columns = lanes(w.h), w.columns if i == END_STAGE else w.n
    # What the last two stages of a step have is kept.
    change = w.change_before if i == END_STAGE - 1 else w.change if i <= END_STAGE else w.rates
    _change(i, w.k.ctypes.data, LANES * w.columns, LANES * columns, change.ctypes.data)
    put_moved(w, tables.EXPLICIT_NODES[i] * h, change, h)
    evaluate(w, RATES, w.k[i])


@compiled
def scale_ledger(w: Any, stages: int) -> None:
    """Set the largest rate of each account at these stages, and its scale: the largest amount exchanged so far, or
    expected soon.
    """
    h, span = lanes(w.h), lanes(w.end) - lanes(w.t)
    for m in range(w.n_ledger):
        rate = same(0.0)
        for i in range(stages):
            rate = larger(rate, absolute(lanes(w.k[i, w.n + m])))
        put(w.q_rate[m], rate)
        put(w.q_scale[m], lanes(w.q_largest[m]) + larger(h, FORESEEN_PART * span) * rate)


@compiled
def is_brief(w: Any) -> Any:
    """True in lanes whose step is too brief for the ledger to shorten it, for the run and for its segment."""
    return lanes(w.h) < LOOSE_RTOL * smaller(lanes(w.t), lanes(w.end) - lanes(w.entered))


@compiled
def _ledger_norms(w: Any) -> Any:
    """Error norm of the ledger. Accounts of one kind share a scale."""
    h, norm = lanes(w.h), same(0.0)
    scale_ledger(w, tables.STAGES_OF_DENSE)
    for group in range(N_GROUPS):
        miss, second, scale = same(0.0), same(0.0), same(TINY)
        for m in range(w.n_ledger):
            if w.groups[m] == group:
                miss = larger(miss, absolute(lanes(w.coarse[w.n + m])))
                second = larger(second, absolute(lanes(w.fine[w.n + m])))
                scale = larger(scale, lanes(w.q_scale[m]))
        norm = larger(norm, h * miss * miss / (square_root(miss * miss + 0.01 * second * second) + TINY) / scale)
    return where(is_brief(w), 0.0, norm / ledger_rtol(w.rtol))


@compiled
def try_step(w: Any) -> None:
    """Evaluate all stages of a step of each lane, and the norm of its local error."""
    for i in range(1, END_STAGE + 1):
        _evaluate_stage(w, i)
    put(w.evaluations, lanes(w.evaluations) + float(tables.LAST_STAGE))
    h, every = lanes(w.h), LANES * w.columns
    _errors(0, w.k.ctypes.data, every, every, w.coarse.ctypes.data)
    _errors(1, w.k.ctypes.data, every, every, w.fine.ctypes.data)
    largest, second = same(0.0), same(0.0)
    blank = same(0.0)
    for m in range(w.columns):
        put(w.y_new[m], lanes(w.y[m]) + h * lanes(w.change[m]))
        blank = blank + 0.0 * lanes(w.coarse[m])  # NaN where an error is NaN, which comparisons would lose
    for m in range(w.n):
        unit = 1.0 / _tolerance(w, m)
        error = absolute(h * lanes(w.coarse[m])) * unit
        largest = where(error <= largest, largest, error)
        second = larger(second, absolute(h * lanes(w.fine[m])) * unit)
    # The estimate of fifth order, made one of seventh by that of third.
    norm = largest * largest / (explicit.ERROR_PART * square_root(largest * largest + 0.01 * second * second + TINY))
    put(w.norm, blank + (larger(norm, _ledger_norms(w)) if w.n_ledger > 0 else norm))


@compiled
def propose_size(w: Any) -> None:
    """Propose the size of the next step (Gustafsson 1994), or of the repetition of one that fails."""
    h, h_last, given = lanes(w.h), lanes(w.h_last), lanes(w.norm)
    norm = larger(where(given < 1e30, given, 1e30), RUN_EPS)
    root = w.root_of(w, norm)
    put(w.root, root)
    factor, passes = SAFETY / root, norm < 1.0
    predicted = factor * h / h_last * (lanes(w.root_last) / root)
    factor = where(passes & (h_last > 0.0), smaller(factor, predicted), factor)
    factor = smaller(larger(factor, MIN_GROWTH), MAX_GROWTH)
    put(w.following, h * where(passes & (lanes(w.again) > 0.5), smaller(factor, 1.0), factor))


@compiled
def find_stiff(w: Any) -> None:
    """Mark steps that are long compared with the fastest rate, which the rates of the last two stages estimate."""
    largest, fastest, speed, change = same(0.0), same(0.0), same(0.0), same(0.0)
    for m in range(w.n):
        end, unit = lanes(w.k[END_STAGE, m]), 1.0 / lanes(w.weight[m])
        apart = absolute(end - lanes(w.k[END_STAGE - 1, m]))
        # From the variable in which the two differ most: in slower ones they differ by their error alone.
        most = apart * unit > largest
        largest = where(most, apart * unit, largest)
        moved = absolute(lanes(w.change[m]) - lanes(w.change_before[m]))
        fastest = where(most, apart / (moved + TINY), fastest)
        speed = larger(speed, absolute(end) * unit)
        change = larger(change, absolute(end - lanes(w.k[0, m])) * unit)
    is_limited = (fastest > explicit.STABILITY_LIMIT) & (change < explicit.FOLLOWED_PART * fastest * speed)
    put(w.stiff, where((fastest > explicit.STIFF_STEP) | is_limited, 1.0, 0.0))


@compiled
def find_noise(w: Any, lane: int) -> None:
    """Count a repeated step whose error has not fallen with its size as stiff: the cause is noise, or stiffness."""
    if w.norm[lane] > explicit.MAX_ERROR_RATIO * w.norm_tried[lane] * (w.h[lane] / w.h_tried[lane]) ** 8:
        w.stiff_steps[lane] += explicit.STIFF_STEPS


@compiled
def interpolate(w: Any, columns: int) -> None:
    """The polynomials of the steps, of the first so many columns."""
    for i in range(tables.STAGES_OF_DENSE, tables.LAST_STAGE + 1):
        _evaluate_stage(w, i)
    for d in range(ORDER):
        _coefficients(d, w.k.ctypes.data, LANES * w.columns, LANES * columns, w.polynomial[d].ctypes.data)


@compiled
def put_inside(w: Any, x: Any) -> None:
    """Set the inputs to time and state at the fraction x of each step."""
    h = lanes(w.h)
    put(w.inputs[0], lanes(w.t) + x * h)
    for m in range(w.n):
        put(w.inputs[1 + m], lanes(w.y[m]) + h * x * polynomial(w.polynomial, m, x))


@compiled
def put_roughly(w: Any, x: float) -> None:
    """Set the inputs by the cubic Hermite polynomial of each step, which needs no further stages."""
    h = lanes(w.h)
    put(w.inputs[0], lanes(w.t) + x * h)
    for m in range(w.n):
        mean, first, last = lanes(w.change[m]), lanes(w.k[0, m]), lanes(w.k[END_STAGE, m])
        curvature = 3.0 * mean - 2.0 * first - last + x * (first + last - 2.0 * mean)
        put(w.inputs[1 + m], lanes(w.y[m]) + h * x * (first + x * curvature))


@compiled
def differentiate_polynomials(w: Any, columns: int) -> None:
    """Set the coefficients of the slopes of the dense output, of the first so many columns."""
    for d in range(ORDER):
        for m in range(columns):
            put(w.slope_of[d, m], float(d + 1) * lanes(w.polynomial[d, m]))


@compiled
def prepare_checks(w: Any) -> None:
    """Set the allowed defect of the rate of each column, and the coefficients of the slope of the dense output."""
    h = lanes(w.h)
    for m in range(w.n):
        put(w.allowed[m], MAX_DEFECT * tables.GAMMA[DENSEST] * w.loose * _tolerance(w, m) / h)
    for m in range(w.n_ledger):
        put(w.allowed[w.n + m], same(np.inf))  # an account without a group only has to be finite
    for group in range(N_GROUPS):
        scale = same(TINY)
        for m in range(w.n_ledger):
            if w.groups[m] == group:
                scale = larger(scale, lanes(w.q_scale[m]))
        for m in range(w.n_ledger):
            if w.groups[m] == group:
                put(w.allowed[w.n + m], MAX_DEFECT * ledger_rtol(w.rtol) * scale / h)
    differentiate_polynomials(w, w.columns)


@compiled
def put_points(w: Any, lane: int, x: Any) -> None:
    """Set the inputs inside to time and state of a lane at eight fractions x of its step."""
    h, inputs = w.h[lane], w.inside[lane]
    if w.spread[lane] < 0.5:
        w.spread[lane] = 1.0
        for r in range(1 + 2 * w.n, w.n_inputs):
            put(inputs[r], w.inputs[r, lane])
    put(inputs[0], w.t[lane] + x * h)
    for m in range(w.n):
        put(inputs[1 + m], w.y[m, lane] + h * x * polynomial_of(w.polynomial, m, lane, x))


@compiled
def find_defects(w: Any, lane: int, x: Any) -> None:
    """The defects of the dense output of a lane at eight fractions x of its step: rates less slopes of all columns."""
    put_points(w, lane, x)
    evaluate_at(w, RATES, w.inside[lane], w.rates)
    for m in range(w.columns):
        put(w.rates[m], lanes(w.rates[m]) - polynomial_of(w.slope_of, m, lane, x))


@compiled
def _agrees(w: Any, lane: int, x: Any) -> Any:
    """Mask of the fractions x of the step of a lane at which the rates agree with the slope of the dense output."""
    w.find_defects(w, lane, x)
    agrees = x >= 0.0
    for m in range(w.columns):
        allowed = w.allowed[m, lane]
        defect = absolute(lanes(w.rates[m]))
        close = defect <= same(allowed)  # False for NaN
        if m >= w.n and any_lane(~close):
            # The quadrature of a smooth rate is better than its polynomial of order 7, by 6/7 of that power; 3/4 is
            # what products give.
            part = defect / larger(larger(same(w.q_rate[m - w.n, lane]), defect), TINY)
            squared = (defect / allowed) * (defect / allowed)
            close = squared * squared * (part * part * part) <= 1.0
        agrees = agrees & close
    return agrees


@compiled
def needs_checks(w: Any, good: Any) -> bool:
    """Set the whole spacings of each step; True if the equations are to be checked somewhere inside one."""
    h, spacing = lanes(w.h), lanes(w.spacing_of)
    checked = good & (h > CHECK_PART * spacing)
    if w.divisors.shape[0] > 0:  # elsewhere the equations change within no less than the stages resolve
        wide = lanes(w.stiff) < 0.5
        for m in range(w.n):
            if w.divisors[m]:
                first, last = lanes(w.y[m]), lanes(w.y_new[m])
                near, far = first + h / 3.0 * lanes(w.k[0, m]), last - h / 3.0 * lanes(w.k[w.end_stage, m])
                least = smaller(smaller(first, near), smaller(far, last))
                most = larger(larger(first, near), larger(far, last))
                wide = wide & ((least > explicit.SMOOTH_PART * most) | (most < explicit.SMOOTH_PART * least))
        checked = checked & ~wide
    put(w.spacings, where(checked, floor(h / spacing), -1.0))
    at_ends = lanes(w.begins) + lanes(w.last) + lanes(w.onto) > 0.5
    return bool(any_lane((lanes(w.spacings) >= 0.0) & (at_ends | (lanes(w.spacings) > 0.5))))


@compiled
def first_defect(w: Any, lane: int) -> float:
    """The fraction of the step of a lane where the dense output first misses the equations; one if nowhere.

    Looks are denser next to the ends of a load segment and of a step that an event has cut short: a feature there may
    be narrow. They go from the narrowest outwards: the first disagreement tells how short the step has to be.
    """
    spacing = 1.0 / w.spacings[lane]  # one look in the middle of each
    near_start = END_CHECKS if w.begins[lane] > 0.5 else 0
    inside = near_start + int(w.spacings[lane])
    every = inside + (END_CHECKS if w.last[lane] + w.onto[lane] > 0.5 else 0)
    for first in range(0, every, LANES):
        k = lanes(COUNT) + float(first)
        x = (k - (near_start - 0.5)) * spacing
        if first < near_start:
            x = where(k < float(near_start), lanes(NEAR_START[first:]), x)
        if first + LANES > inside:
            x = where(k >= float(inside), lanes(NEAR_END[LANES + first - inside :]), x)
        misses = (k < float(every)) & ~_agrees(w, lane, x)
        if any_lane(misses):
            put(w.at, where(misses, x, -1.0))
            for j in range(LANES):
                if w.at[j] >= 0.0:
                    return float(w.at[j])
    return 1.0


@compiled
def nothing(_w: Any, *_given: Any) -> None:
    """A part of the loop in which nothing is to be done with steps of this method."""
