"""Times at which given variables pass what is narrow: turning points of histories, and places where a formula changes.

What depends on time alone needs no step to be found: a run ends a piece there, so that no step passes over it.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from typing import Any

import numpy as np
import symengine
from numpy.typing import NDArray

from surfacechem.compile.program import Function, compile_function
from surfacechem.expressions import Expression, derivative
from surfacechem.model.system import System

Array = NDArray[np.float64]

COMPARISONS = (symengine.StrictLessThan, symengine.LessThan)
"""SymEngine turns the others round."""

GRID, PARTS_OF_A_PERIOD = 64, 8
"""Parts of a run in each of which a given variable is taken to turn at most once, and of the period of one that repeats
itself, where a sine turns once in four of them. A choice: what turns twice within a part is not found, and more parts
cost evaluations of what depends on time alone."""

ENOUGH = 10
"""Parts of periods for each step allowed: two a period end a step, so that the steps are used up before the parts."""

HALVINGS = 64
"""What takes any part of a run to the last bit of its time."""

TOLD_APART = 1e-13
"""Relative difference of times that are one: a piece between them would be rounding."""


class Passing:
    """The places of a system that time alone leads past."""

    def __init__(self, system: System) -> None:
        turns, places = _turns(system), _places(system)
        self.turns = len(turns)
        self._columns = np.array(
            [j for j, p in enumerate(system.parameters) if any(p.symbol in x.free_symbols for x in (*turns, *places))],
            dtype=np.int64,
        )
        self._function: Function | None = None
        if turns or places:
            symbols = [system.parameters[j].symbol for j in self._columns]
            self._function = compile_function([system.t, *symbols], [*turns, *places])
        self._found = lru_cache(maxsize=8)(self._find)

    def pieces(self, segments: Array, table: Array, frequency: float, max_steps: int) -> tuple[Array, Array]:
        """Segments that end at these times, too, and their parameters; those of the segments given are ``table``.

        ``frequency`` [1/s] is the highest of a given variable.
        """
        if self._function is None:
            return segments, table
        parts = max(GRID / (segments[-1] - segments[0]), PARTS_OF_A_PERIOD * frequency)
        looked_at = np.minimum(segments, segments[0] + ENOUGH * max_steps / parts)
        found = self._found(looked_at.tobytes(), table[:, self._columns].tobytes(), parts)
        beside = np.searchsorted(segments, found)
        gaps = np.minimum(found - segments[beside - 1], segments[beside] - found)
        found = found[gaps > TOLD_APART * found]
        apart = np.diff(found, prepend=0.0) > TOLD_APART * found
        found = found[apart]
        within = np.searchsorted(segments, found) - 1
        return np.insert(segments, within + 1, found), np.insert(table, within + 1, table[within], axis=0)

    def _find(self, segments: bytes, table: bytes, density: float) -> Array:
        """All times inside the segments, in order; each is looked at in so many parts a second."""
        ends = np.frombuffer(segments)
        values = np.frombuffer(table).reshape(len(ends) - 1, -1)
        parts = np.ceil(density * np.diff(ends)).astype(np.int64)
        piece = np.repeat(np.arange(len(parts)), parts)
        into = np.arange(len(piece)) - np.repeat(np.cumsum(parts) - parts, parts)
        low = ends[piece] + into / parts[piece] * np.diff(ends)[piece]
        high = np.append(low[1:], ends[-1])
        turning = self._zeros(low, high, values[piece], slice(0, self.turns))
        inner = np.searchsorted(low, turning, side="right") - 1
        low, high = np.insert(low, inner + 1, turning), np.insert(high, inner, turning)
        piece = np.insert(piece, inner, piece[inner])
        passed = self._zeros(low, high, values[piece], slice(self.turns, None))
        return np.unique(np.concatenate([turning, passed]))

    def _zeros(self, low: Array, high: Array, values: Array, which: slice) -> Array:
        """Where functions change sign between these times, the first time beyond."""
        assert self._function is not None
        function = self._function

        def at(t: Array, rows: Array) -> Array:
            return np.sign(function(np.column_stack([t, rows]))[:, which])

        before, after = at(low, values), at(high, values)
        i, j = np.nonzero((before * after < 0) | ((after == 0) & (before != 0)))
        low, high, values, side = low[i], high[i], values[i], before[i, j]
        rows = np.arange(len(i))
        for _ in range(HALVINGS if len(i) else 0):
            middle = 0.5 * (low + high)
            ahead = at(middle, values)[rows, j] == side
            low, high = np.where(ahead, middle, low), np.where(ahead, high, middle)
        return np.unique(high)


def _turns(system: System) -> list[Expression]:
    """Slopes of the histories on which anything depends other than by sums, products and whole powers."""
    bent = _closure(system, {symbol for member in _members(system) for symbol in _inside_functions(member)})
    given = (item for item in system.named if symengine.Symbol(item.name) in bent)
    slopes = (derivative(system.expand(item.expression), system.t) for item in given if _reads_time(system, item))
    return _of_time(system, slopes)


def _reads_time(system: System, item: Any) -> bool:
    return system.t in symengine.sympify(item.expression).free_symbols


def _places(system: System) -> list[Expression]:
    """What conditions of formulas compare, and the peaks of laws."""
    compared = {gap for member in _members(system) for gap in _compared(member)}
    peaks = [margin.expression for margin in system.margins if margin.peak]
    return _of_time(system, (system.expand(item) for item in (*sorted(compared, key=str), *peaks)))


def _members(system: System) -> list[Expression]:
    """What is integrated, and the named quantities that it is made of."""
    integrated = [symengine.sympify(row) for row in (*system.rows.values(), *(item.rate for item in system.ledger))]
    read = _closure(system, {symbol for item in integrated for symbol in item.free_symbols})
    named = [item.expression for item in system.named if symengine.Symbol(item.name) in read]
    return [*integrated, *(symengine.sympify(item) for item in named)]


def _closure(system: System, symbols: set[Any]) -> set[Any]:
    """The symbols, with all that the named quantities among them are made of; each is made of earlier ones."""
    found = set(symbols)
    for item in reversed(system.named):
        if symengine.Symbol(item.name) in found:
            found |= symengine.sympify(item.expression).free_symbols
    return found


def _inside_functions(expression: Expression) -> set[Any]:
    """The symbols in arguments of anything but sums, products and whole powers."""
    curved = expression.atoms(symengine.Function, symengine.Piecewise)
    powers = (item for item in expression.atoms(symengine.Pow) if not _is_whole(item.args[1]))
    return {symbol for item in (*curved, *powers) for symbol in item.free_symbols}


def _is_whole(exponent: Any) -> bool:
    return bool(exponent.is_Integer and exponent > 0)


def _compared(expression: Expression) -> set[Expression]:
    """Differences of what the conditions of an expression compare."""
    conditions = {condition for piece in expression.atoms(symengine.Piecewise) for condition in piece.args[1::2]}
    single = {item for condition in conditions for item in (condition, *condition.atoms(*COMPARISONS))}
    return {item.args[0] - item.args[1] for item in single if isinstance(item, COMPARISONS)}


def _of_time(system: System, expressions: Iterable[Expression]) -> list[Expression]:
    """Those that depend on time and on parameters alone, each once."""
    given = {system.t, *(parameter.symbol for parameter in system.parameters)}
    return [item for item in dict.fromkeys(expressions) if system.t in item.free_symbols <= given]
