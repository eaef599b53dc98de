r"""The equations of an assembled scene in the form of a paper.

The program evaluates formulas that are guarded against overflow, division by zero and rates that time does not resolve
(:mod:`surfacechem.expressions`). Here they are printed without these guards, with the names of constants instead of
digits, a line for each mode (sticking, sliding), and solved for the rate that they evolve.

>>> from surfacechem.expressions import exp, log_fraction
>>> x, y = symengine.symbols("x y")
>>> readable(exp(x) * log_fraction(y))
exp(x)*log(y)
"""

from __future__ import annotations

import cmath
import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import product
from typing import Any, NamedTuple

import symengine
import sympy  # type: ignore[import-untyped]
from sympy.printing.latex import LatexPrinter  # type: ignore[import-untyped]

from surfacechem.compile.printing import (
    RELATIONS,
    TermPrinter,
    changing,
    parameter_text,
    pieces,
    quantities_read,
    safe,
    sympy_form,
)
from surfacechem.contracts.units import ELECTRON_VOLT
from surfacechem.expressions import EXPONENT_CAP, LARGE_EXPONENT, LITERAL, Expression, derivative
from surfacechem.model.system import Named, System
from surfacechem.quantities import AVOGADRO, BOLTZMANN, GAPS, GAS_CONSTANT, STEFAN_BOLTZMANN, VARIABLES, spelled
from surfacechem.tolerances import EQUAL, FRACTION_FLOOR, LEAST_BONDED, LEAST_COVERAGE, REPULSION_WALL, TIME_EPS, TINY

EXPONENT_CAPS = (EXPONENT_CAP, LARGE_EXPONENT, LITERAL, -30.0)
"""Exponents up to which a formula is valid without its guard."""

FLOORS = (FRACTION_FLOOR, LEAST_BONDED, LEAST_COVERAGE, REPULSION_WALL)
"""Amounts, and the part of a range, above which a formula is valid without its guard."""

OFF_ZERO = (TINY, TINY**0.5, TIME_EPS**2)
"""Numbers that, added or as a factor of what is added, keep a divisor or the base of a power off zero: the second one
where it is squared, the third one the square of a speed that no time resolves.
"""

K_B, R, N_A = map(symengine.Symbol, ("Boltzmann constant", "gas constant", "Avogadro constant"))

CONSTANTS = {
    K_B: (BOLTZMANN, r"k_{\mathrm{B}}"),
    R: (GAS_CONSTANT, "R"),
    N_A: (AVOGADRO, r"N_{\mathrm{A}}"),
    symengine.Symbol("elementary charge"): (float(ELECTRON_VOLT), "e"),
    symengine.Symbol("Stefan-Boltzmann constant"): (STEFAN_BOLTZMANN, r"\sigma_{\mathrm{SB}}"),
    symengine.pi: (math.pi, ""),
    symengine.sqrt(2 * symengine.pi): (math.sqrt(2 * math.pi), ""),
    symengine.E: (math.e, ""),
}
"""Constants that formulas contain as digits, and their LaTeX, by symbol."""

FACTORS = [symengine.Rational(*parts) for parts in ((1, 1), (2, 1), (4, 1), (8, 1), (1, 2), (1, 4), (3, 2), (2, 3))]

MOST_COMBINATIONS = 12
"""Most combinations of modes for which each has its line."""

LINE_LETTERS = 300
"""Letters of LaTeX above which an equation does not fit on a line."""

PHONE_LETTERS = 220
"""Letters of LaTeX above which a term does not fit on the line of a phone."""

MOST_SIMPLIFIED = 40
"""Most operations of an expression for which SymPy searches for a shorter form."""

TABLE_NUMBERS = 12
"""Numbers in a piecewise expression from which on it is printed as a table rather than a formula."""

TABLE_PREFIX = "table over "
"""Prefix of the names of symbols that stand for a table."""

HALF = symengine.Rational(1, 2)

LATEX_ESCAPES: Mapping[int, str] = {ord(c): f"\\{c}" for c in "_%&#$"}

GOLDEN_RATIO = 0.6180339887
"""Its multiples modulo one fill an interval evenly."""


class Equation(NamedTuple):
    """An equation as LaTeX: its left side, and the rest in pieces between which a line may break."""

    left: str
    pieces: Sequence[str]
    text: str
    """Its meaning, in words."""
    when: str
    """Modes in which it holds; empty if in all."""


class Statement(NamedTuple):
    """An equation of a state or a named quantity before it is printed."""

    name: str
    left: Expression
    right: Expression
    text: str
    when: str


def equations(system: System) -> tuple[list[Equation], dict[str, str]]:
    """Return the balances of a scene with the quantities they read, and the LaTeX of parameters and initial values.

    The latter are mappings by path.
    """
    printer = PaperPrinter(_names(system))
    symbols = {p.path: printer.text(p.symbol) for p in system.parameters}
    symbols |= {s.path: rf"{printer.text(symengine.Symbol(s.at_start[0].name))}(0)" for s in reversed(system.states)}
    return [printer.equation(line) for line in statements(system)], symbols


def latex(system: System, title: str) -> str:
    """Return the equations as a LaTeX align environment, with the values of the case as comments."""
    lines, symbols = equations(system)
    given, values = (p for p in system.parameters if p.path in system.changeable), [f"% {safe(title)}: {system.regime}"]
    values += [f"%   {symbols[p.path]} = {float(p.at(0.0))!r} {parameter_text(p)}" for p in given]
    names = [symbols[system.parameters[j].path] for j in changing(system)]
    for start, numbers in pieces(system)[1:]:
        then = ", ".join(f"{name} = {number!r}" for name, number in zip(names, numbers, strict=True))
        values.append(f"%   from {start!r} s on: {then}")
    rows = []
    for line in lines:
        equation = " ".join((line.left, *line.pieces)).replace("= ", "&= ", 1)
        note = "; ".join(filter(None, (line.text, line.when))).translate(LATEX_ESCAPES).replace("^", r"\^{}")
        rows.append(rf"  {equation} && \text{{{note}}}")
    return "\n".join([*values, r"\begin{align*}", " \\\\\n".join(rows), r"\end{align*}", ""])


def statements(system: System) -> list[Statement]:
    """Return every equation of a scene that a reader needs: the balances, then the quantities that they read."""
    levels = _constant_values(system)
    loads = {role.variable for role in system.roles if role.role == "prescribed"}
    # Print a prescribed quantity by its name wherever another quantity contains its formula.
    given = {
        item.expression: symengine.Symbol(item.name)
        for item in system.named
        if item.name in loads and isinstance(item.expression, symengine.Add)
    }
    named = [
        Named(item.quantity, _plain(item.name, item.expression.xreplace({} if item.name in loads else given)))
        for item in system.named
        if item.expression not in levels
    ]
    rows = [line for name, row in system.rows.items() for line in _balance(system, name, row.xreplace(given))]
    return [*rows, *(line for item in _read(named, rows) for line in _definition(system, item))]


def _read(named: Sequence[Named], rows: Sequence[Statement]) -> Sequence[Named]:
    """Return the quantities that the balances read, the last first; all if nothing evolves."""
    return quantities_read(named, [line.right for line in rows])[::-1] if rows else named


def _constant_values(system: System) -> set[Expression]:
    """Return the parameters that are just the constant value of a variable."""
    return {p.symbol for p in system.parameters if p.path.endswith(".level")}


def _names(system: System) -> dict[str, str]:
    """Return the LaTeX of symbols that are not named like variables."""
    names = {str(name): latex for name, (_, latex) in CONSTANTS.items()}
    for p in system.parameters:
        place = p.path.split(".")
        if place[0] == "loading" and len(place) > 1:  # the rate of a ramp of the load w_t is w_t,rate
            base, _, index = symbol(place[1]).partition("_")
            inside = index.strip("{}") + "," if index else ""
            names[str(p.symbol)] = rf"{base}_{{{inside}\mathrm{{{place[-1]}}}}}"
    levels = _constant_values(system)
    names |= {str(item.expression): symbol(item.name) for item in system.named if item.expression in levels}
    # Rates that another program evaluates.
    external = re.compile(r"interface\.mechanism\.reactions\..*\.value")
    names |= {str(p.symbol): rf"\text{{{p.spec.text}}}" for p in system.parameters if external.fullmatch(p.path)}
    for item in system.named:
        names[f"{item.name} of a fit"] = rf"{symbol(item.name)}\!\left(T\right)"
    for state in system.states:
        if species := state.quantity.species:  # coverages and site densities
            index = rf"\mathrm{{{species.translate(LATEX_ESCAPES)}}}"
            names |= {state.name: rf"\theta_{{{index}}}", f"N_{state.name}": f"N_{{{index}}}"}
    return names


def symbol(name: str) -> str:
    r"""Return the LaTeX of a name.

    >>> symbol("phi_max"), symbol("dT_dt"), symbol("q_1"), symbol("R_linear_affinity")
    ('\\phi_{\\mathrm{max}}', '\\dot{T}', 'q_{1}', 'R_{\\mathrm{linear\\,affinity}}')
    """
    rate = re.fullmatch(r"d(\w+)_dt", name)
    if rate:
        return rf"\dot{{{symbol(rate[1])}}}"
    if name in VARIABLES and VARIABLES[name].latex:
        return VARIABLES[name].latex
    return spelled(name)


# -- without guards ---------------------------------------------------------------------------------------------------


def readable(expression: Expression) -> Expression:
    """Return the expression without its numerical guards: its form wherever none of them acts."""
    whole = symengine.sympify(expression)
    if isinstance(whole, symengine.Piecewise):
        return _unguarded([*map(readable, whole.args[::2])], [*map(readable, whole.args[1::2])])
    if isinstance(whole, symengine.Float):
        return _constant(float(whole))
    if not whole.args:
        return whole
    make = type(whole) if isinstance(whole, RELATIONS) else whole.func
    found = make(*map(readable, whole.args))
    if isinstance(found, symengine.Mul) and float(found.args[0] if found.args[0].is_Number else 1) in OFF_ZERO:
        return symengine.Integer(0)
    is_magnitude = found.is_Pow and found.args[1] == HALF and found.args[0].is_Pow and found.args[0].args[1] == 2
    return symengine.Abs(found.args[0].args[0]) if is_magnitude else found


def _constant(value: float) -> Expression:
    """Return a number as a simple multiple of a constant of nature, or as an integer, if it is one; a guard is zero."""
    if abs(value) in OFF_ZERO:
        return symengine.Integer(0)
    if value == round(value) and abs(value) < 1 / EQUAL:
        return symengine.Integer(round(value))
    for (name, (size, _)), power, factor in product(CONSTANTS.items(), (1, -1), FACTORS):
        if math.isclose(abs(value), float(factor) * size**power, rel_tol=EQUAL):
            return (factor if value > 0 else -factor) * name**power
    return symengine.Float(value)


def _unguarded(values: Sequence[Any], conditions: Sequence[Any]) -> Expression:
    """Return a piecewise expression in its plain form: by its function's name, or without its guard."""
    first, condition = values[0], conditions[0]
    if condition == False:  # noqa: E712 - an expression, not a flag
        return _unguarded(values[1:], conditions[1:])
    if len({*values}) == 1 or condition == True:  # noqa: E712
        return first
    low, high = condition.args
    # A cap keeps an exponent or a logarithm within the floating-point range.
    if (high.is_Number and float(high) in EXPONENT_CAPS) or (low.is_Number and float(low) in FLOORS):
        return first
    if [*values] == [1, -1, 0]:
        return symengine.sign(high)
    if len(values) == 2 and (plain := _without_choice(first, values[1], low, high)) is not None:
        return plain
    if all(_are_equal(first, value) for value in values[1:]):
        return min(values, key=lambda value: len(str(value)))
    return symengine.Piecewise(*zip(values, conditions, strict=True))


def _without_choice(first: Any, other: Any, low: Any, high: Any) -> Expression | None:
    """Return the plain form of a choice, ``first`` for low < high, else ``other``; None if it has none."""
    if {first, other} == {low, high}:
        return symengine.Min(low, high) if first == low else symengine.Max(low, high)
    if (first, other, high) == (-low, low, 0) or (first, other, low) == (high, -high, 0):
        return symengine.Abs(low if high == 0 else high)
    if other == 1 and first * high == low:  # cap of rates that time does not resolve
        return other
    if low == 0 and not other.free_symbols and high.free_symbols <= first.free_symbols:  # a divisor, a base of a power
        return first.xreplace({symengine.Max(0, high): high})
    return None


def _are_equal(one: Expression, other: Expression) -> bool:
    """True if two expressions are equal at some states."""
    symbols = sorted(one.free_symbols | other.free_symbols, key=str)
    for place in range(1, 4):
        state = {x: 0.3 + math.fmod(place * (k + 1) * GOLDEN_RATIO, 0.5) for k, x in enumerate(symbols)}
        first, second = (complex(e.xreplace(state).n()) for e in (one, other))
        if not first or not cmath.isclose(first, second, rel_tol=EQUAL):
            return False
    return True


# -- an equation a line -----------------------------------------------------------------------------------------------


Splitter = Callable[[Expression], tuple[Expression, Expression]]


def _balance(system: System, name: str, row: Expression) -> Iterator[Statement]:
    """Yield a balance, solved for the rate that it evolves."""
    state = next(state for state in system.states if state.name == name)

    def sides(expression: Expression) -> tuple[Expression, Expression]:
        slope = derivative(expression, state.dot)
        if slope == 0 or state.dot in slope.free_symbols:
            return symengine.Integer(0), expression
        rest = expression.xreplace({state.dot: symengine.Integer(0)})
        # Capacities and stiffnesses are positive, as evaluated at a state of open gaps.
        at = {x: symengine.Integer(8) if str(x) in GAPS else HALF for x in slope.free_symbols}
        slope, rest = (-slope, rest) if sympy_form(slope.xreplace(at)).n() < 0 else (slope, -rest)
        return _shortest(slope) * state.dot, _shortest(rest)

    yield from _grouped(system, Named(state.quantity, row), sides, state.quantity.long_name)


def _definition(system: System, item: Named) -> Iterator[Statement]:
    """Yield the definition of a named quantity, unless it is a mode, which is only a name."""
    if str(item.expression) == item.name:
        return
    text = f"{item.quantity.long_name} [{item.quantity.unit}]"
    yield from _grouped(system, item, lambda e: (symengine.Symbol(item.name), _shortest(e)), text)


def _grouped(system: System, item: Named, sides: Splitter, text: str) -> Iterator[Statement]:
    """Yield an equation once for every group of modes in which it is the same."""
    expression = item.expression
    modes = [mode for mode in system.modes if mode.symbol in expression.free_symbols]
    if math.prod(len(mode.words) for mode in modes) > MOST_COMBINATIONS:
        modes = []
    found: dict[tuple[Expression, Expression], list[str]] = {}
    for values in product(*(mode.words for mode in modes)):
        at = {mode.symbol: symengine.Integer(round(value)) for mode, value in zip(modes, values, strict=True)}
        words = ", ".join(mode.words[value] for mode, value in zip(modes, values, strict=True))
        found.setdefault(sides(_tabulated(readable(expression.xreplace(at)))), []).append(words)
    for (left, right), holds in sorted(found.items(), key=lambda item: item[0][1] == 0):
        when = "otherwise" if right == 0 and len(holds) > 2 else " or ".join(holds)
        yield Statement(item.name, left, right, text, when if len(found) > 1 else "")


def _plain(name: str, expression: Expression) -> Expression:
    """Return the expression of a named quantity without its guards; that of a fit by its name."""
    if any(str(x).startswith(f"{name}_ends_") for x in symengine.sympify(expression).free_symbols):
        return symengine.Symbol(f"{name} of a fit")
    return readable(expression)


def _tabulated(expression: Expression) -> Expression:
    """Return the expression with a symbol for each table of numbers, such as an interpolation."""
    tables = [p for p in expression.atoms(symengine.Piecewise) if len(p.atoms(symengine.Float)) > TABLE_NUMBERS]
    return expression.xreplace({p: symengine.Symbol(TABLE_PREFIX + str(max(map(str, p.free_symbols)))) for p in tables})


def _shortest(expression: Expression) -> Expression:
    """Return the shortest form of an expression: as it is, with common factors extracted, or simplified by SymPy."""
    if {K_B, R} <= expression.free_symbols and not expression.has(symengine.E):
        expression = expression.xreplace({K_B: R / N_A})
    whole = sympy_form(expression)
    forms = [whole, sympy.factor_terms(whole, sign=True)]
    if not whole.has(sympy.Piecewise, sympy.Float) and sympy.count_ops(whole) <= MOST_SIMPLIFIED:
        if whole.is_rational_function():
            over, under = sympy.fraction(sympy.cancel(sympy.together(whole)))
            forms += [sympy.expand(whole), *(sympy.collect(over, x, sympy.factor) / under for x in over.free_symbols)]
        elif not whole.has(sympy.sin):  # a search of minutes that finds nothing
            forms.append(sympy.simplify(whole))
    return symengine.sympify(min(forms, key=sympy.count_ops))


class PaperPrinter(TermPrinter, LatexPrinter):  # type: ignore[misc]
    """A printer of formulas for readers: few digits, positive terms first, functions by their usual names."""

    def __init__(self, names: Mapping[str, str]) -> None:
        super().__init__({"mul_symbol": r"\,", "fold_short_frac": False, "ln_notation": True})
        self.names = names

    def equation(self, line: Statement) -> Equation:
        """Return a line as LaTeX, with the right side in its terms."""
        right = sympy_form(line.right)
        # Distribute a minus before a sum, and a product that is too long for a line.
        if right.as_coeff_Mul()[1].is_Add or len(self.text(right)) > LINE_LETTERS:
            right = sympy.expand_mul(right, deep=False)
        left, pieces = self._broken_product(sympy_form(line.left)), self._broken_sum(right)
        return Equation(left[0], [*left[1:], f"= {pieces[0]}", *pieces[1:]], line.text, line.when)

    def _broken_sum(self, expression: Any) -> list[str]:
        """Return a sum in pieces that begin with the signs of its terms."""
        pieces: list[str] = []
        for term in self._as_ordered_terms(expression):
            first, *rest = self._broken_product(term)
            pieces += [first if first.startswith("-") or not pieces else f"+ {first}", *rest]
        return pieces

    def _broken_product(self, term: Any) -> list[str]:
        """Return a term in one piece; a long one in its factors, and large factors that are sums in their terms."""
        if len(self.text(term)) <= PHONE_LETTERS or not term.is_Mul:
            return [self.text(term)]
        factors = term.as_ordered_factors()
        large = [factor for factor in factors if len(self.text(factor)) > PHONE_LETTERS / 4]
        rest = sympy.Mul(*(factor for factor in factors if factor not in large))
        # Divisors come last.
        large.sort(key=lambda factor: bool((1 / factor).is_Add))
        pieces = ["-" if rest == -1 else self.text(rest)]
        for factor in large:
            pieces += self._bracketed(1 / factor, "/ (") if (1 / factor).is_Add else self._bracketed(factor, "(")
        return pieces[rest == 1 and not (1 / large[0]).is_Add :]

    def _bracketed(self, factor: Any, opened: str) -> list[str]:
        """Return a factor, or the terms of a factor that is a sum, between brackets."""
        first, *more = self._broken_sum(factor) if factor.is_Add else [self.text(factor)]
        return [f"{opened}{first}", *more[:-1], f"{more[-1]})"] if more else [first]

    def _as_ordered_terms(self, expr: Any, order: Any = None) -> list[Any]:
        terms = super()._as_ordered_terms(expr, order)
        return sorted(terms, key=lambda term: bool(term.could_extract_minus_sign()))

    def _print_Symbol(self, expression: Any, style: str = "plain") -> str:
        name = str(expression)
        if rate := re.fullmatch(r"d(\w+)_dt", name):
            return self._rate(self.names.get(rate[1]) or symbol(rate[1]))
        if name.startswith(TABLE_PREFIX):
            return rf"\mathcal{{F}}\left({symbol(name.removeprefix(TABLE_PREFIX))}\right)"
        if name in self._terms:
            return rf"\left({self.text(self._terms[name])}\right)"
        latex = self.names.get(name) or symbol(name)
        return rf"\left({latex}\right)" if " / " in latex else latex

    def _rate(self, latex: str) -> str:
        """Return a rate, with the dot over the letter and not over its index."""
        base, line, index = latex.partition("_")
        if base.startswith((r"\ln", "|")):
            return rf"\frac{{\mathrm{{d}} {latex}}}{{\mathrm{{d}} t}}"
        accent, base = (r"\ddot", base[5:]) if base.startswith(r"\dot ") else (r"\dot", base)
        return rf"{accent}{{{base}}}{line}{index}"

    def _print_Abs(self, expression: Any, exp: Any = None) -> str:
        inside = expression.args[0]
        # The symbol of a magnitude has its bars.
        plain = str(super()._print_Abs(expression)) if "|" not in self._print(inside) else self._print(inside)
        return plain if exp is None else f"{plain}^{{{exp}}}"

    def _print_Float(self, expression: Any) -> str:
        mantissa, _, power = f"{float(f'{float(expression):.4g}')!r}".partition("e")
        number = mantissa.removesuffix(".0")
        if not power:
            return number
        return (f"{number} \\cdot " if number != "1" else "") + f"10^{{{int(power)}}}"

    def _print_exp(self, expression: Any, exp: Any = None) -> str:
        inside = self._print(expression.args[0])
        plain = rf"e^{{{inside}}}" if r"\frac" not in inside else rf"\exp\left({inside}\right)"
        return plain if exp is None else rf"\left({plain}\right)^{{{exp}}}"

    def _print_log(self, expression: Any, exp: Any = None) -> str:
        plain = rf"\ln\left({self._print(expression.args[0])}\right)"
        return plain if exp is None else rf"\left({plain}\right)^{{{exp}}}"

    def _print_sign(self, expression: Any, exp: Any = None) -> str:
        return rf"\operatorname{{sgn}}\left({self._print(expression.args[0])}\right)" + (f"^{{{exp}}}" if exp else "")
