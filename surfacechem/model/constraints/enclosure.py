"""Intervals that an expression cannot leave, from those of its symbols.

Where a condition holds the interval of what it compares is narrowed, and with it that of every multiple and of all
that differs from it by a number. Source: Moore, Kearfott & Cloud (2009), Introduction to Interval Analysis, SIAM.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Mapping
from typing import Any

import symengine

from surfacechem.expressions import Expression

Interval = tuple[float, float]
Known = Mapping[Hashable, Interval]
"""Intervals of symbols, and of the cores of sums and products (:func:`affine`)."""

WHOLE: Interval = (-math.inf, math.inf)

MONOTONE: dict[str, Callable[[float], float]] = {
    "sinh": lambda x: math.sinh(x) if abs(x) < 700 else math.copysign(math.inf, x),
    "asinh": math.asinh,
    "tanh": math.tanh,
    "atan": math.atan,
}

VANISHED = symengine.Symbol("log_of_nothing")
"""The logarithm of nothing, which outweighs everything finite."""

NOTHING: Interval = (-math.inf, -math.inf)


def enclosure(expression: Expression, known: Known) -> Interval:
    """Least and largest value, or wider; symbols that are not known may have any value.

    >>> import symengine
    >>> x, T = symengine.symbols("x T")
    >>> enclosure(2 * T * symengine.exp(x) + x**2, {T: (1.0, 3.0)})
    (0.0, inf)
    """
    node = symengine.sympify(expression)
    if node == VANISHED:
        return NOTHING
    if node.is_Symbol:
        return known.get(node, WHOLE)
    if not node.args:
        return (float(node), float(node)) if node.is_real else WHOLE
    if isinstance(node, symengine.Piecewise):
        return _pieces(node, known)
    if node.is_Add or node.is_Mul:
        core, factor, rest = affine(node)
        if core in known:
            return _shift(_product([(factor, factor), known[core]]), rest)
    parts = [enclosure(part, known) for part in node.args]
    if node.is_Add:
        return NOTHING if _is_logarithm_of_a_part(node) else _sum(parts)
    if node.is_Mul:
        return _product(parts)
    if node.is_Pow:
        return _power(node, parts)
    return _function(type(node).__name__, parts)


def affine(expression: Expression) -> tuple[Hashable, float, float]:
    """Core, factor and rest of an expression that is factor * core + rest; sums in proportion share their core.

    >>> import symengine
    >>> x, y = symengine.symbols("x y")
    >>> affine(x - 2 * y)[0] == affine(2 * y - x + 7)[0] == affine((x - 2 * y) / 3)[0]
    True
    """
    node = symengine.expand(expression, deep=False)
    terms, rest = {}, 0.0
    for part in node.args if node.is_Add else (node,):
        numbers = [item for item in part.args if item.is_Number] if part.is_Mul else []
        if part.is_Number:
            rest += _real(part)
        else:
            own = symengine.Mul(*(item for item in part.args if not item.is_Number)) if numbers else part
            terms[own] = math.prod(_real(number) for number in numbers)
    if not all(map(math.isfinite, (rest, *terms.values()))):
        return node, 1.0, 0.0
    if not terms:
        return 0, 0.0, rest
    leading = min(terms, key=hash)
    factor = terms[leading]
    if len(terms) == 1:
        return leading, factor, rest
    return frozenset((term, value / factor) for term, value in terms.items()), factor, rest


def _real(number: Any) -> float:
    return float(number) if number.is_real else math.nan


def narrowed(known: Known, expression: Expression, low: float, high: float) -> Known:
    """What is known where an expression also lies between two values."""
    core, factor, rest = affine(expression)
    if factor == 0:
        return known
    ends = sorted(((low - rest) / factor, (high - rest) / factor))
    before = known.get(core, WHOLE)
    least, most = max(ends[0], before[0]), min(ends[1], before[1])
    return {**known, core: (least, most)} if least <= most else known


def _pieces(node: Any, known: Known) -> Interval:
    found: list[Interval] = []
    for value, condition in zip(node.args[::2], node.args[1::2], strict=True):
        holds, if_so, if_not = _condition(condition, known)
        if holds is not False:
            found.append(enclosure(value, if_so))
        if holds:
            break
        known = if_not
    return min(low for low, _ in found), max(high for _, high in found)


def _condition(condition: Any, known: Known) -> tuple[bool | None, Known, Known]:
    """Whether a condition holds or fails for all values, else None; and what is known where it holds and fails."""
    if condition == symengine.true or condition == symengine.false:
        return bool(condition == symengine.true), known, known
    if not isinstance(condition, symengine.Lt | symengine.Le):
        return None, known, known
    difference = condition.args[0] - condition.args[1]
    low, high = enclosure(difference, known)
    strict = isinstance(condition, symengine.Lt)
    if high < 0 or (high == 0 and not strict):
        return True, known, known
    if low > 0 or (low == 0 and strict):
        return False, known, known
    return None, narrowed(known, difference, low, 0.0), narrowed(known, difference, 0.0, high)


def _is_logarithm_of_a_part(node: Any) -> bool:
    """Whether a sum is the logarithm of something in proportion to what has vanished, whatever that multiplies."""
    return any(part == VANISHED for part in node.args)


def _shift(interval: Interval, by: float) -> Interval:
    return interval[0] + by, interval[1] + by


def _sum(parts: list[Interval]) -> Interval:
    """The sum of what is below everything finite and of what may be anything may be anything."""
    low, high = (sum(part[side] for part in parts) for side in (0, 1))
    return (-math.inf if math.isnan(low) else low), (math.inf if math.isnan(high) else high)


def _product(parts: list[Interval]) -> Interval:
    low, high = 1.0, 1.0
    for part in parts:
        ends = [_times(a, b) for a in (low, high) for b in part]
        low, high = min(ends), max(ends)
    return low, high


def _times(a: float, b: float) -> float:
    """Product of two ends; nothing times anything is nothing."""
    return 0.0 if a == 0 or b == 0 else a * b


def _power(node: Any, parts: list[Interval]) -> Interval:
    (low, high), exponent = parts[0], node.args[1]
    if node.args[0] == symengine.E:
        return _exp(parts[1][0]), _exp(parts[1][1])
    if not exponent.is_Number:
        return (0.0, math.inf) if low >= 0 else WHOLE
    n = float(exponent)
    even = n == int(n) and int(n) % 2 == 0
    if even and low < 0:
        low, high = (0.0 if high > 0 else min(-low, -high)), max(-low, high, -high)
    elif low < 0 and (n != int(n) or n < 0):
        return WHOLE if high >= 0 or n != int(n) else (_raised(high, n), _raised(low, n))
    ends = sorted((_raised(low, n), _raised(high, n)))
    return ends[0], ends[1]


def _exp(x: float) -> float:
    return math.exp(x) if x < 700 else math.inf


def _raised(x: float, n: float) -> float:
    if x == 0 and n < 0:
        return math.inf
    try:
        return float(x**n)
    except OverflowError:
        return math.inf if x > 0 or n % 2 == 0 else -math.inf


def _function(name: str, parts: list[Interval]) -> Interval:
    low, high = parts[0]
    if name in MONOTONE and len(parts) == 1:
        return MONOTONE[name](low), MONOTONE[name](high)
    if name == "log" and low >= 0:
        return (math.log(low) if low > 0 else -math.inf), (math.log(high) if high > 0 else -math.inf)
    return (-1.0, 1.0) if name in ("sin", "cos") else WHOLE
