"""Intervals that an expression cannot leave, from those of its symbols."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import symengine

from surfacechem.expressions import FRACTION_FLOOR, Expression

Interval = tuple[float, float]
Known = Mapping[Expression, Interval]

WHOLE: Interval = (-math.inf, math.inf)

MONOTONE: dict[str, Callable[[float], float]] = {
    "sinh": lambda x: math.sinh(x) if abs(x) < 700 else math.copysign(math.inf, x),
    "asinh": math.asinh,
    "tanh": math.tanh,
    "atan": math.atan,
}

VANISHED = math.log(FRACTION_FLOOR)
"""Logarithm that stands for one of nothing."""


def enclosure(expression: Expression, known: Known) -> Interval:
    """Least and largest value, or wider; symbols that are not known may have any value.

    >>> import symengine
    >>> x, T = symengine.symbols("x T")
    >>> enclosure(2 * T * symengine.exp(x) + x**2, {T: (1.0, 3.0)})
    (0.0, inf)
    """
    node = symengine.sympify(expression)
    if node in known:
        return known[node]
    if node.is_Symbol:
        return WHOLE
    if not node.args:
        value = float(node)
        return (-math.inf, -math.inf) if value == VANISHED else (value, value)
    if isinstance(node, symengine.Piecewise):
        return _pieces(node, known)
    shifted = _shifted(node, known) if node.is_Add else None
    if shifted is not None:
        return shifted
    parts = [enclosure(part, known) for part in node.args]
    if node.is_Add:
        return _sum(parts)
    if node.is_Mul:
        return _product(parts)
    if node.is_Pow:
        return _power(node, parts)
    return _function(type(node).__name__, parts)


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
    left, right = condition.args
    (a, b), (c, d) = enclosure(left, known), enclosure(right, known)
    strict = isinstance(condition, symengine.Lt)
    if b < c or (b == c and not strict):
        return True, known, known
    if a > d or (a == d and strict):
        return False, known, known
    return (
        None,
        {**known, left: (a, min(b, d)), right: (max(a, c), d)},
        {**known, left: (max(a, c), b), right: (c, min(b, d))},
    )


def _shifted(node: Any, known: Known) -> Interval | None:
    """Interval of a sum that differs by a number from one that is known."""
    for other, (low, high) in known.items():
        difference = node - other if other.is_Add else other
        if difference.is_Number:
            return low + float(difference), high + float(difference)
    return None


def _sum(parts: list[Interval]) -> Interval:
    for vanished in ((-math.inf, -math.inf), (math.inf, math.inf)):
        if vanished in parts and (-vanished[0], -vanished[1]) not in parts:
            return vanished  # the logarithm of nothing outweighs everything finite
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
