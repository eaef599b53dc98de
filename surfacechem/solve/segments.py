"""Load segments: intervals of time between which parameters may jump, and the parameters of each.

A segment also ends where a prescribed variable passes a narrow feature: at turning points of histories, and where a
formula changes branch. Functions of time alone need no step to be located, so the ends of segments are computed in
advance, and no step passes over the feature.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import lru_cache

import numpy as np
import symengine

from surfacechem.compile.program import Function, compile_function, needed
from surfacechem.expressions import Expression, derivative
from surfacechem.model.system import END_PATH, RTOL_PATH, System
from surfacechem.solve.contract import Array, Index, Mask
from surfacechem.tolerances import FEW_EPS, GUARD_EPS, NEGLIGIBLE

SEGMENTS_PER_CYCLE, MOST_SEGMENTS = 8.17, 20_000
"""Parts of the period of a load, a number such that no cut falls on a reversal, and the number of parts in a run above
which periods are not cut.
"""

GOLDEN_PART = 0.5 * (math.sqrt(5) - 1)
"""Part of a piece of time at which it is cut: of a load that is symmetric nothing happens there."""

BETWEEN_POINTS, LARGEST_SLACK = 1e3, NEGLIGIBLE
"""Slack of bonding beyond its bounds between two points of a step, in tolerances, and its largest value."""


def segments(system: System, end: float, values: Mapping[str, float]) -> Array:
    """Return the segments of a run: between breakpoints, and parts of a load's period under which the state may
    rest.
    """
    inside = [t for t in system.breakpoints if 0 < t < end]
    for path in system.cycles:
        count = math.floor(SEGMENTS_PER_CYCLE * values[path] * end)
        if count <= MOST_SEGMENTS:
            inside += [k / (SEGMENTS_PER_CYCLE * values[path]) for k in range(1, count + 1)]
    return np.array(sorted({0.0, *(t for t in inside if t < end), end}))


def segment_parameters(system: System, segments: Array, rtol: float, values: Mapping[str, float]) -> Array:
    """Return the parameters of each segment: loads as they start it, bounds with the slack that the tolerance needs."""
    starts = segments[:-1]
    slack = min(max(values.get("run.slack", 0.0), BETWEEN_POINTS * rtol), LARGEST_SLACK)
    given = {**values, "run.slack": slack, RTOL_PATH: rtol, END_PATH: segments[-1]}
    rows = np.array([[given[parameter.path] for parameter in system.parameters]] * len(starts), dtype=float)
    for j, parameter in enumerate(system.parameters):
        if parameter.load is not None:
            rows[:, j] = [parameter.at(float(start)) for start in starts]
    return rows


def cut(segments: Array, parameters: Array) -> tuple[Array, Array]:
    """Each piece of time in two: steps that are as long as pieces, whatever the tolerance is, are others then.

    >>> cut(np.array([0.0, 1.0]), np.array([[300.0]]))[0].round(3).tolist()
    [0.0, 0.618, 1.0]
    """
    inside = segments[:-1] + GOLDEN_PART * np.diff(segments)
    return np.sort(np.concatenate([segments, inside])), np.repeat(parameters, 2, axis=0)


def perturb_histories(system: System, parameters: Array) -> None:
    """Change the numbers of histories by a few roundings, alternately up and down. Origins of time stay.

    A single rounding might be lost where a state is rounded, for instance in an impact.
    """
    loads = [j for j, p in enumerate(system.parameters) if p.path.startswith("loading.") and p.field != "origin"]
    parameters[:, loads] *= 1 + FEW_EPS * (-1.0) ** np.arange(len(loads))


def mode_starts(system: System) -> tuple[list[int], Function]:
    """Return the columns of the modes that follow from the initial state, and the function for their values.

    Columns are counted from the end of the arguments of compiled functions, which is that of the parameters.
    """
    started = [mode for mode in system.modes if mode.start is not None]
    columns = [system.mode_columns[mode.name] - len(system.parameters) for mode in started]
    return columns, compile_function(system.inputs, [system.expand(mode.start) for mode in started])


def start_registers(system: System, parameters: Array, values: Mapping[str, float]) -> None:
    """Set the registers that follow from the initial state."""
    symbols = [p.symbol for p in system.parameters]
    for register in system.registers:
        if register.given is not None:
            parameters[:, symbols.index(register.symbol)] = register.given(values)


COMPARISONS = (symengine.StrictLessThan, symengine.LessThan)
"""SymEngine reverses the other comparisons."""

TURN_PARTS, PARTS_PER_CYCLE = 64, 8
"""Parts of a run, and of the period of a cyclic load, in each of which a prescribed variable is assumed to turn at most
once; a sine turns once in four parts. A choice: two turns within a part are not found, and more parts cost evaluations
of functions of time alone.
"""

PARTS_PER_STEP = 10
"""Most parts of periods for each step allowed: two turns a period end a step, so the steps are used up before the
parts.
"""

SEARCHED_AT_ONCE = 2**10
"""Runs of a batch that are searched together: their parts stay in the cache. A choice."""

BISECTIONS = 64
"""Bisections that reduce any part of a run to the last bit of its time."""


class Passing:
    """Search for the times at which prescribed variables, as functions of time alone, pass narrow features."""

    def __init__(self, system: System) -> None:
        turns, places = _narrow(system)
        self.turns, self._cycles = len(turns), system.cycles
        self._columns = np.array(
            [j for j, p in enumerate(system.parameters) if any(p.symbol in x.free_symbols for x in (*turns, *places))],
            dtype=np.int64,
        )
        self.reads = {system.parameters[j].path for j in self._columns}
        """Paths of the parameters that these depend on."""
        self.function: Function | None = None
        """What passes narrow features, as a function of the time and these parameters; None if nothing does."""
        if turns or places:
            symbols = [system.parameters[j].symbol for j in self._columns]
            self.function = compile_function([system.t, *symbols], [*turns, *places])
        self._found = lru_cache(maxsize=8)(self._find)

    def pieces(self, segments: Array, table: Array, values: Mapping[str, float], max_steps: int) -> tuple[Array, Array]:
        """Return the segments, whose parameters are ``table``, cut at these times, and the new parameters.

        ``values`` are those of the run by path.
        """
        if self.function is None:
            return segments, table
        (searched,), (density,) = self._searched(segments[None], values, max_steps)
        found = self._found(searched.tobytes(), table[:, self._columns].tobytes(), float(density))
        if not len(found):
            return segments, table
        right = np.searchsorted(segments, found)
        gaps = np.minimum(found - segments[right - 1], segments[right] - found)
        found = found[gaps > GUARD_EPS * found]
        found = found[np.diff(found, prepend=0.0) > GUARD_EPS * found]
        within = np.searchsorted(segments, found) - 1
        return np.insert(segments, within + 1, found), np.insert(table, within + 1, table[within], axis=0)

    def cut(self, segments: Array, table: Array, values: Mapping[str, float], max_steps: int) -> Mask:
        """Return the mask of runs with such times, from segments [run, end] and their parameters [run, segment,
        parameter]; ``values`` are what the runs share.
        """
        found = np.zeros(len(segments), dtype=bool)
        for first in range(0, len(segments) if self.function else 0, SEARCHED_AT_ONCE):
            own = slice(first, first + SEARCHED_AT_ONCE)
            low, high, piece = _parts(*self._searched(segments[own], values, max_steps))
            given = table[own, :, self._columns].reshape(-1, len(self._columns))
            changed, *_ = self._changes(low, high, given[piece], slice(None))
            found[first + piece[changed] // table.shape[1]] = True
        return found

    def _searched(self, segments: Array, values: Mapping[str, float], max_steps: int) -> tuple[Array, Array]:
        """Return the segments [run, end] as far as they are searched, and the number of parts a second [run]."""
        frequency = max((values[path] for path in self._cycles), default=0.0)
        density = np.maximum(TURN_PARTS / (segments[:, -1] - segments[:, 0]), PARTS_PER_CYCLE * frequency)
        return np.minimum(segments, segments[:, :1] + PARTS_PER_STEP * max_steps / density[:, None]), density

    def _find(self, segments: bytes, table: bytes, density: float) -> Array:
        """Return all times inside the segments, in order, from a search with ``density`` parts a second."""
        ends = np.frombuffer(segments)
        values = np.frombuffer(table).reshape(len(ends) - 1, -1)
        low, high, piece = _parts(ends[None], np.array([density]))
        turning = self._zeros(low, high, values[piece], slice(0, self.turns)) if self.turns else np.empty(0)
        if len(turning):
            inner = np.searchsorted(low, turning, side="right") - 1
            low, high = np.insert(low, inner + 1, turning), np.insert(high, inner, turning)
            piece = np.insert(piece, inner, piece[inner])
        passed = self._zeros(low, high, values[piece], slice(self.turns, None))
        return np.union1d(turning, passed) if len(turning) else passed

    def _zeros(self, low: Array, high: Array, values: Array, which: slice) -> Array:
        """Return the times at which functions change sign in these intervals, the first time beyond each change."""
        i, j, side = self._changes(low, high, values, which)
        low, high, values = low[i], high[i], values[i]
        rows = np.arange(len(i))
        for _ in range(BISECTIONS if len(i) else 0):
            middle = 0.5 * (low + high)
            ahead = self._signs(middle, values, which)[rows, j] == side
            low, high = np.where(ahead, middle, low), np.where(ahead, high, middle)
        return np.unique(high) if len(i) else high

    def _changes(self, low: Array, high: Array, values: Array, which: slice) -> tuple[Index, Index, Array]:
        """Return the intervals in which functions change sign, the functions, and their signs before."""
        before, after = self._signs(low, values, which), self._signs(high, values, which)
        i, j = np.nonzero((before * after < 0) | ((after == 0) & (before != 0)))
        return i, j, before[i, j]

    def _signs(self, t: Array, values: Array, which: slice) -> Array:
        assert self.function is not None
        return np.asarray(np.sign(self.function(np.column_stack([t, values]))[:, which]))


def _parts(segments: Array, density: Array) -> tuple[Array, Array, Index]:
    """Return the first and last times of the parts of segments [run, end], of so many a second in each run, and the
    segment of each, counted over all runs.
    """
    widths = np.diff(segments)
    parts = np.ceil(density[:, None] * widths).astype(np.int64)
    lengths, counts = widths.ravel(), parts.ravel()
    piece = np.repeat(np.arange(len(counts)), counts)
    into = np.arange(len(piece)) - np.repeat(np.cumsum(counts) - counts, counts)
    low = segments[:, :-1].ravel()[piece] + into / counts[piece] * lengths[piece]
    high = np.append(low[1:], np.nan)
    high[np.cumsum(parts.sum(axis=1)) - 1] = segments[:, -1]
    return low, high, piece


def _narrow(system: System) -> tuple[list[Expression], list[Expression]]:
    """Return expressions in time alone whose sign changes mark narrow features.

    They are the slopes of histories that enter functions other than sums, products and whole powers, the differences
    that conditions compare, and the peaks of laws.
    """
    bent, compared, t = set(), set(), system.t
    for member in _members(system):
        curved = list(member.atoms(symengine.Function, symengine.Piecewise))
        curved += [x for x in member.atoms(symengine.Pow) if not (x.args[1].is_Integer and x.args[1] > 0)]
        bent |= {symbol for item in curved for symbol in item.free_symbols}
        compared |= _compared(member)
    bends = [expression for _, expression in needed(_definitions(system), [*bent])]
    turns = [derivative(system.expand(x), t) for x in bends if t in symengine.sympify(x).free_symbols]
    peaks = [margin.expression for margin in system.margins if margin.peak]
    places = [system.expand(item) for item in (*sorted(compared, key=str), *peaks)]
    return _of_time(system, turns), _of_time(system, places)


def _of_time(system: System, expressions: Sequence[Expression]) -> list[Expression]:
    """Return the expressions that depend on time and parameters alone, each once."""
    given = {system.t, *(parameter.symbol for parameter in system.parameters)}
    return [item for item in dict.fromkeys(expressions) if system.t in item.free_symbols <= given]


def _members(system: System) -> list[Expression]:
    """Return the integrated expressions, and the named quantities in them."""
    integrated = [symengine.sympify(row) for row in (*system.rows.values(), *(item.rate for item in system.ledger))]
    named = [symengine.sympify(expression) for _, expression in needed(_definitions(system), integrated)]
    return integrated + named


def _compared(expression: Expression) -> set[Expression]:
    """Return the differences of the two sides of an expression's conditions."""
    conditions = {condition for piece in expression.atoms(symengine.Piecewise) for condition in piece.args[1::2]}
    single = {item for condition in conditions for item in (condition, *condition.atoms(*COMPARISONS))}
    return {item.args[0] - item.args[1] for item in single if isinstance(item, COMPARISONS)}


def _definitions(system: System) -> list[tuple[Expression, Expression]]:
    """Return the named quantities with their definitions."""
    return [(symengine.Symbol(item.name), item.expression) for item in system.named]
