"""The equations of an assembled scene as readable, executable Python.

It is a module of functions with the signature of the compiled ones: ``residual``, ``jacobian``,
``outputs``, ``ledger`` and ``margins`` of (t, y, ydot, parameters). It is the debug mode: where the compiled code
returns NaN, this one raises at the line of the quantity concerned. If a history consists of pieces, each is printed
with its start, and the functions use the piece in which t lies unless ``parameters`` are passed.
"""

from __future__ import annotations

import linecache
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from types import ModuleType
from typing import Any, NamedTuple

import symengine
import sympy  # type: ignore[import-untyped]
from sympy.core.parameters import distribute  # type: ignore[import-untyped]
from sympy.printing.printer import Printer  # type: ignore[import-untyped]
from sympy.printing.pycode import PythonCodePrinter  # type: ignore[import-untyped]

from surfacechem.compile.program import jacobian, needed
from surfacechem.expressions import Expression
from surfacechem.model.system import Named, Parameter, System
from surfacechem.quantities import Quantity

CODE_WIDTH = 100
"""Width of printed lines; longer ones are broken where an expression permits."""


class Row(NamedTuple):
    """A line of a printed function: a local name, its expression and its meaning."""

    name: str
    expression: Expression
    text: str


RELATIONS = (symengine.LessThan, symengine.StrictLessThan, symengine.Equality, symengine.Unequality)

CONDITION_PREFIX = "condition of "
"""Prefix of the names of symbols that stand for separately printed terms."""


@lru_cache(maxsize=1000)
def sympy_form(expression: Expression) -> Any:
    """Return the same expression in SymPy, without expanding products of sums, which would change the rounding.

    Cached: several functions print the same quantities, and SymPy is slow with conditions of piecewise expressions.
    """
    with distribute(False):
        return symengine.sympify(expression)._sympy_()


class TermPrinter(Printer):  # type: ignore[misc]
    """A SymPy printer that prints piecewise terms inside conditions separately, in the places of their symbols."""

    _terms: Mapping[str, Any] = {}

    def text(self, expression: Expression) -> str:
        # SymPy's canonical form of conditions does not finish if they contain piecewise terms.
        whole, around = symengine.sympify(expression), self._terms
        inner = {piece for relation in whole.atoms(*RELATIONS) for piece in relation.atoms(symengine.Piecewise)}
        self._terms = {f"{CONDITION_PREFIX}{k}": piece for k, piece in enumerate(sorted(inner, key=str))}
        try:
            named = {piece: symengine.Symbol(name) for name, piece in self._terms.items()}
            return str(self.doprint(sympy_form(whole.xreplace(named))))
        finally:
            self._terms = around


class _Python(TermPrinter, PythonCodePrinter):  # type: ignore[misc]
    def __init__(self) -> None:
        super().__init__({"fully_qualified_modules": True})
        self.reserved_words: set[str] = {*PythonCodePrinter.reserved_words, "math", "ydot", "parameters"}

    def _print_Float(self, expression: Any) -> str:
        return repr(float(expression))

    def _print_Symbol(self, expression: Any) -> str:
        term = self._terms.get(str(expression))
        return str(super()._print_Symbol(expression)) if term is None else self.text(term)

    def name(self, name: str) -> str:
        return str(self.doprint(sympy.Symbol(name)))


def python(system: System, title: str = "") -> str:
    """Return the equations as the source of a Python module."""
    printer = _Python()
    functions = [
        _function(system, printer, name, text, rows, ", ".join(printer.name(row.name) for row in rows))
        for name, (text, rows) in _functions(system).items()
    ]
    functions += [_jacobian(system, printer)] if system.rows else []
    lines = [f"    {float(p.at(0.0))!r},  # {p.symbol} {parameter_text(p)}" for p in system.parameters]
    parameters = "\n".join(["PARAMETERS = (", *lines, ")\n"])
    states = "\n".join(
        f"    {state.name} [{state.quantity.unit}] {state.quantity.long_name}"
        f" ({'algebraic' if state.algebraic else 'evolved'})"
        for state in system.states
    )
    heading = f"{title}: {system.regime}" if title else system.regime
    evolving = f"y holds\n\n{states}\n\nand ydot their time derivatives."
    held = evolving if states else "Nothing evolves: y and ydot are empty."
    text = f"{safe(heading)}.\n\nt is time [s]. {held}"
    return "\n\n".join([f'"""{text}\n"""\n\nimport math\n', parameters, *_pieces(system), *functions])


def executable(system: System) -> ModuleType:
    """Return the printed module, ready to call; its source shows in tracebacks and debuggers."""
    source = python(system)
    module = ModuleType("surfacechem_equations")
    module.__file__ = f"<equations {id(system):#x}>"
    linecache.cache[module.__file__] = (len(source), None, source.splitlines(keepends=True), module.__file__)
    exec(compile(source, module.__file__, "exec"), vars(module))
    return module


def _functions(system: System) -> dict[str, tuple[str, list[Row]]]:
    """Return the text and the rows of every printed function."""
    balances = [Row(f"balance_{name}", row, f"balance of {name}") for name, row in system.rows.items()]
    outputs = [Row(item.name, symengine.Symbol(item.name), "") for item in system.outputs]
    ledger = [
        Row(f"rate_of_{a.quantity.name}", a.rate, f"rate of: {_described(a.quantity)}; {a.kind}") for a in system.ledger
    ]
    watched = [(m.masked, f"{m.name}, else {m.reason}") for m in system.event_margins]
    watched += [(item.masked, f"else {item.name}: {item.reason}") for item in system.edges]
    margins = [Row(f"margin_{i}", expression, text) for i, (expression, text) in enumerate(watched)]
    functions = {
        "residual": ("The balances, zero where they hold.", balances),
        "outputs": ("The named quantities of the dataset.", outputs),
        "ledger": ("Rates of the quantities that are integrated beside the state.", ledger),
        "margins": ("What must stay positive.", margins),
    }
    return {name: (text, rows) for name, (text, rows) in functions.items() if rows}


def pieces(system: System) -> list[tuple[float, tuple[float, ...]]]:
    """Return the pieces of histories: start [s], and the numbers in the order of :func:`changing`.

    A piece excludes its start; the first one holds from the beginning.
    """
    loads = [system.parameters[j] for j in changing(system)]
    found: list[tuple[float, tuple[float, ...]]] = []
    for start in [0.0, *(t for t in system.breakpoints if t > 0)] if loads else []:
        numbers = tuple(float(p.at(start)) for p in loads)
        if not found or found[-1][1] != numbers:
            found.append((start, numbers))
    return found if len(found) > 1 else []


def changing(system: System) -> list[int]:
    """Return the positions of the parameters that change from piece to piece of a history."""
    return [j for j, p in enumerate(system.parameters) if p.load is not None]


def _pieces(system: System) -> list[str]:
    """Return the pieces of histories, and the function that finds the parameters at a time."""
    found = pieces(system)
    if not found:
        return []
    names = ", ".join(str(system.parameters[j].symbol) for j in changing(system))
    rows = [f"    ({start!r}, {list(numbers)!r})," for start, numbers in found]
    head = ["# From which time on [s], that time not included, histories have which numbers:", f"# {names}."]
    table = "\n".join([*head, f"CHANGING = {changing(system)!r}", "PIECES = (", *rows, ")\n"])
    return [table, PARAMETERS_AT]


PARAMETERS_AT = '''\
def parameters_at(t):
    """The parameters of the piece in which a time lies, or which it ends."""
    values = list(PARAMETERS)
    numbers = next((numbers for start, numbers in reversed(PIECES) if start < t), PIECES[0][1])
    for place, number in zip(CHANGING, numbers):
        values[place] = number
    return values
'''


def parameter_text(parameter: Parameter) -> str:
    """Return unit, meaning and path of a parameter."""
    return safe(f"[{parameter.spec.unit}] {parameter.spec.text} ({parameter.path})")


def _jacobian(system: System, printer: _Python) -> str:
    """Return the function for the derivatives of the balances, by states and by rates, as two lists of rows."""
    n = len(system.states)
    arguments = system.inputs[1 : 1 + 2 * n]
    known = {symengine.Symbol(item.name): item for item in system.named}
    slopes, names = jacobian([*system.rows.values()], arguments, [(x, item.expression) for x, item in known.items()])
    # Names that are valid in Python and in no formula.
    own = {x: symengine.Symbol(re.sub(r"^d (.*) by (.*)$", r"slope_of_\1_by_\2", str(x))) for x, _ in names}
    named = [known.get(x) or Named(Quantity(str(own[x]), "1", str(x)), slope.xreplace(own)) for x, slope in names]
    cells: list[list[str]] = []
    rows: list[Row] = []
    for i, (name, row) in enumerate(zip(system.rows, slopes, strict=True)):
        found = {x: Row(f"slope_{i}_{x}", row[x].xreplace(own), f"balance of {name} by {x}") for x in row}
        rows += found.values()
        cells.append([found[x].name if x in found else "0.0" for x in arguments])
    parts = (", ".join(f"[{', '.join(row[part])}]" for row in cells) for part in (slice(n), slice(n, None)))
    text, returned = "Derivatives of the balances, a row each: by y, and by ydot.", ", ".join(f"[{x}]" for x in parts)
    return _function(replace(system, named=tuple(named)), printer, "jacobian", text, rows, returned)


def _function(system: System, printer: _Python, name: str, text: str, rows: Sequence[Row], returned: str) -> str:
    states = [state.name for state in system.states]
    rates = [str(state.dot) for state in system.states]
    pieced = bool(pieces(system))
    usual = "None" if pieced else "PARAMETERS"
    lines = [f"def {name}(t, y, ydot, parameters={usual}):", f'    """{text}"""']
    lines += ["    parameters = parameters_at(t) if parameters is None else parameters"] if pieced else []
    for names, source in ((states, "y"), (rates, "ydot"), ([str(p.symbol) for p in system.parameters], "parameters")):
        if names:
            own = ", ".join(map(printer.name, names)) + "," * (len(names) == 1)
            bracketed = len(own) > CODE_WIDTH or len(names) == 1
            lines += _broken_line("    (", own, f") = {source}") if bracketed else [f"    {own} = {source}"]
    for item in quantities_read(system.named, [row.expression for row in rows]):
        lines += _assignment(printer, item.name, item.expression, _described(item.quantity))
    for row in rows:
        if str(row.expression) != row.name:
            lines += _assignment(printer, row.name, row.expression, row.text)
    return "\n".join([*lines, *_broken_line("    return [", returned, "]"), ""])


def quantities_read(named: Sequence[Named], expressions: Iterable[Expression]) -> list[Named]:
    """Return the named quantities that expressions read, directly or through others, in order."""
    items = {symengine.Symbol(item.name): item for item in named}
    return [items[symbol] for symbol, _ in needed([(x, item.expression) for x, item in items.items()], [*expressions])]


def _described(quantity: Quantity) -> str:
    return safe(f"{quantity.long_name} [{quantity.unit}]" + (f", {quantity.tag}" if quantity.tag else ""))


def safe(text: str) -> str:
    """Return text in one line that ends neither a comment nor a docstring."""
    return " ".join(text.split()).replace("\\", "/").replace('"""', "'''")


def _assignment(printer: _Python, name: str, expression: Expression, text: str) -> list[str]:
    value = printer.text(expression)
    left = f"    {printer.name(name)} = "
    lines = [left + value] if len(left + value) <= CODE_WIDTH else _broken_line(left + "(", value, ")")
    return [f"    # {text}", *lines]


def _broken_line(before: str, text: str, after: str) -> list[str]:
    """Return text between brackets, broken before operators and after commas if it is too long for one line.

    A product that is too long is broken before its functions.
    """
    if len(before + text + after) <= CODE_WIDTH:
        return [before + text + after]
    lines: list[str] = []
    whole = re.split(r" (?=[+-] |if |else )|(?<=,) ", text)
    factors = [[piece] if len(piece) <= CODE_WIDTH else re.split(r"(?<=[^*]\*)(?=math\.)", piece) for piece in whole]
    for piece in (factor for pieces in factors for factor in pieces):
        if lines and len(lines[-1]) + len(piece) + 9 <= CODE_WIDTH:
            lines[-1] += f" {piece}"
        else:
            lines.append(piece)
    return [before, *(f"        {line}" for line in lines), f"    {after}"]
