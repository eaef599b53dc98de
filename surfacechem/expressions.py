"""Elementary functions that take floats and symbols alike, guarded at their singular ends.

Laws are written with these. Given a float they return a float; given a SymEngine expression they return one that
SymEngine differentiates exactly and compiles. Every function here keeps its value *and its derivative* finite.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import reduce
from typing import Any, TypeAlias

Expression: TypeAlias = Any
"""A float or a SymEngine expression."""

EXPONENT_CAP = 300.0
"""Largest exponent taken literally; above it exp continues as its tangent.

A rate of exp(300) = 2e130 times its prefactor is instantaneous on every time scale a run can resolve, and its square
is still a finite double, so error norms and matrix factorisations survive it.
"""


def is_symbolic(*values: Expression) -> bool:
    """Whether any of the values is a symbolic expression."""
    return any(hasattr(value, "free_symbols") for value in values)


def depends(expression: Expression, symbol: Expression) -> bool:
    """Whether the expression contains the symbol."""
    return is_symbolic(expression) and symbol in expression.free_symbols


def derivative(expression: Expression, symbol: Expression) -> Expression:
    """Derivative of an expression, without the empty pieces that differentiation leaves of guarded functions.

    >>> import symengine
    >>> x, T = symengine.symbols("x T")
    >>> derivative(derivative(T * log_fraction(x), T), T), derivative(power(x, 0.95), T)
    (0, 0)
    """
    import symengine

    result = symengine.diff(symengine.sympify(expression), symbol)
    while empty := {piece: symengine.Integer(0) for piece in result.atoms(symengine.Piecewise) if _vanishes(piece)}:
        result = result.xreplace(empty)
    return result


def _vanishes(piece: Any) -> bool:
    return all(value == 0 for value in piece.args[::2])


def _engine(*values: Expression) -> Any:
    if is_symbolic(*values):
        import symengine

        return symengine
    return math


def where(condition: Expression, yes: Expression, no: Expression) -> Expression:
    """``yes`` where the condition holds, else ``no``."""
    if isinstance(condition, bool):
        return yes if condition else no
    import symengine

    return symengine.Piecewise((yes, condition), (no, True))


def exp(x: Expression) -> Expression:
    """exp(x), continued by its tangent above EXPONENT_CAP."""
    if not is_symbolic(x):
        return math.exp(x) if x < EXPONENT_CAP else math.exp(EXPONENT_CAP) * (1 + x - EXPONENT_CAP)
    if x.is_Number:
        return exp(float(x))
    import symengine

    top = math.exp(EXPONENT_CAP)
    return where(x < EXPONENT_CAP, symengine.exp(x), top * (x + (1 - EXPONENT_CAP)))


def exponents(expression: Expression) -> list[Expression]:
    """The exponents of an expression that :func:`exp` and :func:`expm1` cap.

    >>> import symengine
    >>> exponents(2 * exp(symengine.Symbol("x")) + 1)
    [x]
    """
    if not is_symbolic(expression):
        return []
    import symengine

    conditions = {condition for piece in expression.atoms(symengine.Piecewise) for condition in piece.args[1::2]}
    return [item.args[0] for item in conditions if len(item.args) == 2 and item.args[1] == EXPONENT_CAP]


def expm1(x: Expression) -> Expression:
    """exp(x) - 1 without cancellation near zero, continued by its tangent above EXPONENT_CAP."""
    if not is_symbolic(x):
        return math.expm1(x) if x < EXPONENT_CAP else exp(x)
    if x.is_Number:
        return expm1(float(x))
    import symengine

    # 2 e^(x/2) sinh(x/2) is exact near zero; the outer pieces are where one of its factors would over- or underflow.
    middle = 2 * symengine.exp(x / 2) * symengine.sinh(x / 2)
    return symengine.Piecewise((symengine.exp(x) - 1, x < -30.0), (middle, x < EXPONENT_CAP), (exp(x), True))


def decay(x: Expression) -> Expression:
    """exp(-x) where x is not negative; its derivatives combine with their like, which those of a guarded exp do not."""
    if not is_symbolic(x):
        return exp(-x)
    import symengine

    return symengine.exp(-x)


def log(x: Expression) -> Expression:
    """Natural logarithm of a positive number."""
    return _engine(x).log(x)


LARGE_EXPONENT = 200.0
"""Exponent above which arsinh(x exp(exponent)) is taken by its logarithm."""

TINY = 1e-300
"""Magnitudes below this count as this in a logarithm."""

FRACTION_FLOOR = 1e-300
"""Fractions below this count as this in a logarithm, as Cantera does for vanished species."""


def log_fraction(x: Expression) -> Expression:
    """Natural logarithm of a fraction, or of a rate that may vanish, finite at zero."""
    if not is_symbolic(x):
        return math.log(max(x, FRACTION_FLOOR))
    import symengine

    return where(x > FRACTION_FLOOR, symengine.log(x), math.log(FRACTION_FLOOR))


def log_sum(logarithms: Iterable[Expression]) -> Expression:
    """Logarithm of a sum of which only the logarithms are known.

    >>> log_sum([-1000.0, -1000.0])
    -999.3068528194401
    """

    def add(a: Expression, b: Expression) -> Expression:
        return where(a > b, a + log(1 + exp(b - a)), b + log(1 + exp(a - b)))

    return reduce(add, logarithms)


def sqrt(x: Expression) -> Expression:
    """Square root."""
    return _engine(x).sqrt(x)


def asinh_exp(x: Expression, exponent: Expression) -> Expression:
    """arsinh(x exp(exponent)); for large exponents by its logarithm, so that none overflows."""
    if not is_symbolic(x, exponent):
        if x == 0:
            return 0.0
        if exponent < LARGE_EXPONENT:
            return math.asinh(x * math.exp(exponent))
        return math.copysign(math.log(2 * abs(x)) + exponent, x)
    import symengine

    plain = symengine.asinh(x * exp(exponent))
    size = absolute(x)
    far = sign(x) * (log(where(size > TINY, size, TINY + 0 * size)) + math.log(2) + exponent)
    return symengine.Piecewise((plain, exponent < LARGE_EXPONENT), (far, True))


def sinh_exp(x: Expression, exponent: Expression) -> Expression:
    """sinh(x) exp(exponent) without overflow of either, the inverse of arsinh(v exp(-exponent)).

    >>> sinh_exp(0.5, 0.0) == math.sinh(0.5), sinh_exp(-400.0, -400.0), sinh_exp(1e-9, 0.0) > 0
    (True, -0.5, True)
    """
    return where(x < 0, -_half(-x, exponent), _half(x, exponent))


def _half(x: Expression, exponent: Expression) -> Expression:
    """The same for x >= 0."""
    return -0.5 * expm1(-2 * x) * exp(x + exponent)


def norm(x: Expression, y: Expression) -> Expression:
    """Length of a vector; its derivatives are zero where it has none.

    >>> norm(3.0, 4.0), norm(0.0, 0.0)
    (5.0, 0.0)
    """
    square = x**2 + y**2
    return where(square > 0, sqrt(square), 0) if is_symbolic(square) else math.hypot(x, y)


def sin(x: Expression) -> Expression:
    """Sine of an angle in radians."""
    return _engine(x).sin(x)


def cos(x: Expression) -> Expression:
    """Cosine of an angle in radians."""
    return _engine(x).cos(x)


def sign(x: Expression) -> Expression:
    """-1, 0 or 1."""
    if not is_symbolic(x):
        return math.copysign(1.0, x) if x else 0.0
    import symengine

    return symengine.Piecewise((1.0, x > 0), (-1.0, x < 0), (0.0, True))


def absolute(x: Expression) -> Expression:
    """|x|."""
    return where(x < 0, -x, x)


def positive(x: Expression) -> Expression:
    """The positive part of x."""
    return where(x > 0, x, 0.0 * x)


def power(base: Expression, exponent: Expression) -> Expression:
    """base**exponent; a fractional power of what rounding has carried below zero is zero.

    >>> power(4.0, -0.5), power(-1.0, -0.5)
    (0.5, 0.0)
    """
    if isinstance(exponent, int):
        return base**exponent
    if isinstance(base, int | float) and base <= 0:
        return 0.0
    return where(base > 0, positive(base) ** exponent, 0 * base)
