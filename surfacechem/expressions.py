"""Elementary functions of floats and symbols, guarded at their singular points.

Laws are written with these. Given a float they return a float; given a SymEngine expression they return one that
SymEngine differentiates exactly and compiles. Every function here keeps its value *and its derivative* finite.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import lru_cache, reduce
from typing import Any, TypeAlias

from surfacechem.tolerances import EPS, FORMULA_EPS, FRACTION_FLOOR, GUARD_EPS, TINY

Expression: TypeAlias = Any
"""A float or a SymEngine expression."""


class _Lazy:
    """SymEngine, imported when the first symbol appears: numbers do without it."""

    def __getattr__(self, name: str) -> Any:
        import symengine

        setattr(self, name, getattr(symengine, name))
        return getattr(symengine, name)


symengine: Any = _Lazy()

EXPONENT_CAP = 300.0
"""Largest exponent of a plain exponential; above it exp continues as its tangent.

A rate of exp(300) = 2e130 times its prefactor is instantaneous on every time scale that a run can resolve, and its
square is still a finite double, so error norms and matrix factorisations remain finite.
"""


def is_symbolic(*values: Expression) -> bool:
    """True if any of the values is a symbolic expression."""
    # Test the type: reading the attribute of an expression would collect its symbols.
    return any(hasattr(type(value), "free_symbols") for value in values)


def depends(expression: Expression, symbol: Expression) -> bool:
    """True if the expression contains the symbol."""
    return is_symbolic(expression) and symbol in _symbols(expression)


@lru_cache(maxsize=8)
def _symbols(expression: Expression) -> Any:
    """Return the symbols of an expression, cached: a potential of many species is tested for each of them in turn."""
    return expression.free_symbols


def without(expression: Expression, known: Mapping[Any, Expression]) -> Expression:
    """Replace the known symbols in an expression; only those in it are passed on, as SymEngine would search for all."""
    whole = symengine.sympify(expression)
    parts = {symbol: known[symbol] for symbol in whole.free_symbols if symbol in known}
    return whole.subs(parts) if parts else whole


def derivative(expression: Expression, symbol: Expression) -> Expression:
    """Differentiate an expression, and remove the zero pieces that differentiation leaves of guarded functions.

    >>> import symengine
    >>> x, T = symengine.symbols("x T")
    >>> derivative(derivative(T * log_fraction(x), T), T), derivative(power(x, 0.95), T)
    (0, 0)
    """
    # Differentiation leaves nested zero pieces of terms without the symbol too, and removing these takes long.
    result = symengine.diff(symengine.Add(*terms_of(expression).get(symbol, ())), symbol)
    zero = symengine.Integer(0)
    while empty := {p: zero for p in result.atoms(symengine.Piecewise) if all(v == 0 for v in p.args[::2])}:
        result = result.xreplace(empty)
    return result


def terms_of(expression: Expression) -> dict[Any, list[Expression]]:
    """Return the terms of a sum by the symbols in them: a derivative by a symbol needs no others.

    >>> import symengine
    >>> x, y = symengine.symbols("x y")
    >>> terms = terms_of(x + 2 * y)
    >>> terms[x], terms[y]
    ([x], [2*y])
    """
    whole = symengine.sympify(expression)
    found: dict[Any, list[Expression]] = {}
    for term in whole.args if whole.is_Add else (whole,):
        for symbol in term.free_symbols:
            found.setdefault(symbol, []).append(term)
    return found


def gradient(expression: Expression, known: dict[Any, dict[Any, Expression]] | None = None) -> dict[Any, Expression]:
    """Return the nonzero derivatives of an expression by symbol.

    Every subexpression is differentiated once, by the symbols that it contains; ``known`` stores these results.

    >>> import symengine
    >>> x, y = symengine.symbols("x y")
    >>> slopes = gradient(x * y + 2 * y)
    >>> slopes[x], slopes[y]
    (y, 2 + x)
    """
    whole = symengine.sympify(expression)
    known = {} if known is None else known
    if whole in known:
        return known[whole]
    totals = {symbol: symengine.Add(*slopes) for symbol, slopes in _slopes(whole, known).items()}
    known[whole] = {symbol: slope for symbol, slope in totals.items() if slope != 0}
    return known[whole]


def _slopes(whole: Any, known: dict[Any, dict[Any, Expression]]) -> dict[Any, list[Expression]]:
    """Return the terms of the derivatives of a node by each symbol, one from each of its arguments."""
    if whole.is_Symbol:
        return {whole: [symengine.Integer(1)]}
    found: dict[Any, list[Expression]] = {}
    if isinstance(whole, symengine.Piecewise):  # its arguments alternate between values and conditions
        branches = [gradient(value, known) for value in whole.args[::2]]
        zero = symengine.Integer(0)
        for symbol in dict.fromkeys(symbol for branch in branches for symbol in branch):
            values = (branch.get(symbol, zero) for branch in branches)
            found[symbol] = [symengine.Piecewise(*zip(values, whole.args[1::2], strict=True))]
        return found
    for k, part in enumerate(whole.args):
        slopes = gradient(part, known)
        outer = _partial(whole, k) if slopes else 0
        for symbol, slope in slopes.items():
            found.setdefault(symbol, []).append(outer * slope)
    return found


def _partial(whole: Any, k: int, at: Sequence[Any] = ()) -> Expression:
    """Differentiate a sum, product, power or function by its argument number k, at its own arguments or at others."""
    arguments = at or whole.args
    if whole.is_Add:
        return 1
    if whole.is_Mul:
        return symengine.Mul(*arguments[:k], *arguments[k + 1 :])
    dummies = [symengine.Symbol(f"argument {j}") if j == k or at else a for j, a in enumerate(arguments)]
    values = dict(zip(dummies, arguments, strict=True)) if at else {dummies[k]: arguments[k]}
    return symengine.diff(whole.func(*dummies), dummies[k]).xreplace(values)


def certain(expression: Expression) -> Expression:
    """Return an expression that is positive only where the given one is, whatever its roundoff.

    >>> import symengine
    >>> x = symengine.Symbol("x")
    >>> [float(certain(x - 1).subs({x: 1 + above})) > 0 for above in (1e-14, 1e-12)]
    [False, True]
    """
    return expression - GUARD_EPS * magnitude(expression)


def magnitude(expression: Expression, sizes: Mapping[Any, Expression] | None = None) -> Expression:
    """Return the running error bound: evaluated in doubles, the expression errs by a few times half an EPS of this.

    Symbols contribute their ``sizes``, else their absolute values: they are rounded too, and a sum of large terms that
    cancel is no more accurate than its terms.

    Source: Higham (2002), Accuracy and Stability of Numerical Algorithms, section 3.3.

    >>> import symengine
    >>> x, y = symengine.symbols("x y")
    >>> magnitude(x * (y - 3)).subs({x: -2.0, y: 4.0})
    16.0
    >>> magnitude(positive(y - 1)).subs({y: 1.0})
    2.0
    """
    known = dict(sizes or {})

    def bound(e: Any) -> Any:
        if e not in known:
            known[e] = computed(e)
        return known[e]

    def computed(e: Any) -> Any:
        if not e.args:
            return symengine.Abs(e)
        if isinstance(e, symengine.Piecewise):
            sides, conditions = [bound(side) for side in e.args[::2]], list(e.args[1::2])
            first = conditions[0]
            if len(sides) == 2 and isinstance(first, symengine.StrictLessThan | symengine.LessThan):
                apart = first.args[0] - first.args[1]  # within roundoff of the condition either side may apply
                sides.insert(0, sides[0] + sides[1])
                conditions.insert(0, symengine.Le(symengine.Abs(apart), FORMULA_EPS * bound(apart)))
            return symengine.Piecewise(*zip(sides, conditions, strict=True))
        if e.is_Add or e.is_Mul:  # the error of each term or factor, with the others exact
            return symengine.Add(*(symengine.Abs(_partial(e, i)) * bound(a) for i, a in enumerate(e.args)))
        near = _off_zero(e, bound)
        # |f'(a)| M(a), and |f| for the rounding of f itself
        errors = (symengine.Abs(_partial(e, i, near)) * bound(a) for i, a in enumerate(e.args) if a.free_symbols)
        return symengine.Add(symengine.Abs(e.func(*near) if near else e), *errors)

    return bound(symengine.sympify(expression))


def _off_zero(power: Any, bound: Callable[[Any], Any]) -> tuple[Any, ...]:
    """Return the arguments of a broken power at a base larger by its roundoff, which may hide that it is zero or below,
    where slopes are infinite; none of other expressions.
    """
    if not power.is_Pow or power.args[1].is_Integer or not power.args[0].free_symbols:
        return ()
    base, exponent = power.args
    return symengine.Abs(base) + EPS * bound(base) + TINY, exponent


def _engine(x: Expression) -> Any:
    return symengine if is_symbolic(x) else math


def where(condition: Expression, yes: Expression, no: Expression) -> Expression:
    """Return ``yes`` where the condition holds, else ``no``."""
    if isinstance(condition, bool):
        return yes if condition else no
    return symengine.Piecewise((yes, condition), (no, True))


def by_ranges(x: Expression, ranges: Sequence[tuple[Expression, Expression]], beyond: Expression) -> Expression:
    """Return the value of the first of the ``ranges``, pairs of end and value, that ends above x; else ``beyond``.

    >>> by_ranges(0.5, [(0.0, "low"), (1.0, "middle")], "high")
    'middle'
    """
    for end, value in reversed(ranges):
        beyond = where(x < end, value, beyond)
    return beyond


def polynomial(x: Expression, coefficients: Sequence[Expression]) -> Expression:
    """Return the sum of powers of x with these coefficients, from the constant on, by Horner's rule.

    >>> polynomial(2.0, [1.0, 0.0, 3.0])
    13.0
    """
    return reduce(lambda value, coefficient: value * x + coefficient, reversed(coefficients))


def monotone_cubics(
    x: Expression, at: Sequence[float], values: Sequence[float], before: Expression, beyond: Expression
) -> Expression:
    """Return monotone cubics through points, with other values before the first and beyond the last of them.

    Source: Fritsch & Butland (1984), doi 10.1137/0905021.
    """
    from scipy.interpolate import PchipInterpolator

    rows = PchipInterpolator(at, values).c.T[:, ::-1].tolist()
    ranges = [(high, polynomial(x - low, row)) for low, high, row in zip(at, at[1:], rows, strict=False)]
    return by_ranges(x, [(at[0], before), *ranges], beyond)


def exp(x: Expression) -> Expression:
    """exp(x), continued by its tangent above EXPONENT_CAP."""
    if not is_symbolic(x):
        return math.exp(x) if x < EXPONENT_CAP else math.exp(EXPONENT_CAP) * (1 + x - EXPONENT_CAP)
    if x.is_Number:
        return exp(float(x))
    return where(x < EXPONENT_CAP, symengine.exp(x), math.exp(EXPONENT_CAP) * (x + (1 - EXPONENT_CAP)))


LITERAL = 250.0
"""Largest exponent of a product with a plain exponential; well below EXPONENT_CAP."""


def scaled_exp(factor: Expression, exponent: Expression) -> Expression:
    """Return factor * exp(exponent) with one exponential, so that a tiny factor may have a large exponent.

    Above LITERAL the logarithm of a factor below one is added to the exponent before it is capped; exponentials in the
    factor are combined with it.

    >>> scaled_exp(2.0, 0.0), round(scaled_exp(1e-239, 560.0), 6)
    (2.0, 16029.126851)
    """
    if not is_symbolic(factor, exponent):
        if exponent < LITERAL or not 0 < factor < 1:
            return factor * exp(exponent)
        return exp(exponent + math.log(factor))
    rest, own = _exponential(factor)
    exponent = symengine.sympify(exponent + own)
    if rest == 0 or exponent == 0:
        return rest
    inside = where(rest > 0, where(rest < 1, rest, 1), 1)
    far = rest / inside * exp(exponent + symengine.log(inside))
    return where(exponent < LITERAL, rest * symengine.exp(exponent), far)


def product(*factors: Expression) -> Expression:
    """Return the product with all exponentials combined into one, see :func:`scaled_exp`.

    >>> product(2.0, 3.0)
    6.0
    """
    if not is_symbolic(*factors):
        return math.prod(factors)
    parts = [_exponential(factor) for factor in factors]
    return scaled_exp(math.prod(rest for rest, _ in parts), sum(exponent for _, exponent in parts))


def _exponential(factor: Expression) -> tuple[Expression, Expression]:
    """Split a product into its other factors and the sum of the exponents of its (guarded) exponentials."""
    node = symengine.sympify(factor)
    rest, exponent = symengine.Integer(1), symengine.Integer(0)
    for part in node.args if node.is_Mul else (node,):
        if isinstance(part, symengine.Piecewise) and part.args[1].args[1:] in ((LITERAL,), (EXPONENT_CAP,)):
            inner, own = _exponential(part.args[0])
            rest, exponent = rest * inner, exponent + own
        elif part.is_Pow and part.args[0] == symengine.E:
            exponent += part.args[1]
        elif part.is_Pow and part.args[1].is_Number:
            inner, own = _exponential(part.args[0])
            rest, exponent = rest * inner ** part.args[1], exponent + part.args[1] * own
        else:
            rest *= part
    return rest, exponent


def exponents(expression: Expression) -> list[Expression]:
    """Return the exponents in an expression that :func:`exp` and :func:`expm1` cap.

    >>> import symengine
    >>> exponents(2 * exp(symengine.Symbol("x")) + 1)
    [x]
    """
    if not is_symbolic(expression):
        return []
    conditions = {condition for piece in expression.atoms(symengine.Piecewise) for condition in piece.args[1::2]}
    return [item.args[0] for item in conditions if len(item.args) == 2 and item.args[1] == EXPONENT_CAP]


def expm1(x: Expression) -> Expression:
    """exp(x) - 1 without cancellation near zero, continued by its tangent above EXPONENT_CAP."""
    if not is_symbolic(x):
        return math.expm1(x) if x < EXPONENT_CAP else exp(x)
    if x.is_Number:
        return expm1(float(x))
    # 2 e^(x/2) sinh(x/2) is accurate near zero; in the outer pieces one of its factors would over- or underflow.
    middle = 2 * symengine.exp(x / 2) * symengine.sinh(x / 2)
    return symengine.Piecewise((symengine.exp(x) - 1, x < -30.0), (middle, x < EXPONENT_CAP), (exp(x), True))


def scaled_expm1(factor: Expression, x: Expression, shift: Expression = 0) -> Expression:
    """Return factor * exp(shift) * (exp(x) - 1) with one exponential, see :func:`scaled_exp`.

    >>> scaled_expm1(2.0, -1e-20), round(scaled_expm1(1e-239, 560.0), 6)
    (-2e-20, 16029.126851)
    """
    if not is_symbolic(factor, x, shift):
        return -scaled_exp(factor, shift + x) * math.expm1(-x) if x > 0 else scaled_exp(factor, shift) * math.expm1(x)
    return where(x > 0, -scaled_exp(factor, shift + x) * _falling(-x), scaled_exp(factor, shift) * _falling(x))


def _falling(x: Expression) -> Expression:
    """exp(x) - 1 for a symbolic x <= 0."""
    return where(x < -30.0, symengine.exp(x) - 1, 2 * symengine.exp(x / 2) * symengine.sinh(x / 2))


def decay(x: Expression) -> Expression:
    """exp(-x) for x >= 0; unlike those of a guarded exp, like terms of its derivatives combine."""
    if not is_symbolic(x):
        return exp(-x)
    return symengine.exp(-x)


def log(x: Expression) -> Expression:
    """Natural logarithm of a positive number."""
    return _engine(x).log(x)


LARGE_EXPONENT = 200.0
"""Exponent above which arsinh(x exp(exponent)) is computed by its logarithm."""


def log_fraction(x: Expression) -> Expression:
    """Natural logarithm of a fraction, or of a rate that may vanish; finite at zero."""
    if not is_symbolic(x):
        return math.log(max(x, FRACTION_FLOOR))
    return where(x > FRACTION_FLOOR, symengine.log(x), math.log(FRACTION_FLOOR))


def mixing(x: Expression) -> Expression:
    """Fraction times its logarithm, x ln x, with derivatives ln x + 1 and 1/x; its tangent from FRACTION_FLOOR on.

    The derivatives of a product with a guarded ln x contain x/x^2, which is not finite near zero.

    >>> import symengine
    >>> x = symengine.Symbol("x")
    >>> mixing(1.0), mixing(0.5) == -0.5 * math.log(2.0)
    (0.0, True)
    >>> float(derivative(mixing(x), x).subs({x: 0})) == 1 + log_fraction(0.0)  # else rates at zero are off by e
    True
    """
    if not is_symbolic(x):
        return x * log_fraction(x)
    return where(x > FRACTION_FLOOR, x * symengine.log(x), (math.log(FRACTION_FLOOR) + 1) * x)


def log_sum(logarithms: Iterable[Expression]) -> Expression:
    """Logarithm of a sum, from the logarithms of its terms.

    >>> log_sum([-1000.0, -1000.0])
    -999.3068528194401
    """

    def add(a: Expression, b: Expression) -> Expression:
        return where(a > b, a + log(1 + decay(a - b)), b + log(1 + decay(b - a)))

    return reduce(add, logarithms)


def sqrt(x: Expression) -> Expression:
    """Square root."""
    return _engine(x).sqrt(x)


def asinh_exp(x: Expression, exponent: Expression) -> Expression:
    """arsinh(x exp(exponent)); for large exponents by its logarithm, without overflow."""
    if not is_symbolic(x, exponent):
        if x == 0:
            return 0.0
        if exponent < LARGE_EXPONENT:
            return math.asinh(x * math.exp(exponent))
        return math.copysign(math.log(2 * abs(x)) + exponent, x)
    plain = symengine.asinh(x * exp(exponent))
    size = absolute(x)
    far = sign(x) * (log(where(size > FRACTION_FLOOR, size, FRACTION_FLOOR + 0 * size)) + math.log(2) + exponent)
    return symengine.Piecewise((plain, exponent < LARGE_EXPONENT), (far, True))


def sinh_exp(x: Expression, exponent: Expression) -> Expression:
    """sinh(x) exp(exponent) without overflow of either, the inverse of arsinh(v exp(-exponent)).

    >>> sinh_exp(0.5, 0.0) == math.sinh(0.5), sinh_exp(-400.0, -400.0), sinh_exp(1e-9, 0.0) > 0
    (True, -0.5, True)
    """
    return where(x < 0, -_half(-x, exponent), _half(x, exponent))


def _half(x: Expression, exponent: Expression) -> Expression:
    """sinh(x) exp(exponent) for x >= 0."""
    return -0.5 * expm1(-2 * x) * exp(x + exponent)


def norm(x: Expression, y: Expression) -> Expression:
    """Length of a vector; its derivatives are zero at the zero vector.

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
    return symengine.Piecewise((1.0, x > 0), (-1.0, x < 0), (0.0, True))


def absolute(x: Expression) -> Expression:
    """|x|."""
    return where(x < 0, -x, x)


def positive(x: Expression) -> Expression:
    """The positive part of x."""
    return where(x > 0, x, 0.0 * x)


def power(base: Expression, exponent: Expression) -> Expression:
    """base**exponent; a fractional power of a base that roundoff has made negative is zero.

    >>> power(4.0, -0.5), power(-1.0, -0.5)
    (0.5, 0.0)
    """
    if isinstance(exponent, int):
        return base**exponent
    if isinstance(base, int | float) and base <= 0:
        return 0.0
    return where(base > 0, positive(base) ** exponent, 0 * base)
