"""Which bounds of the bonding state a scene needs: those beyond which its laws could carry it.

Only the sign of the rate at a bound matters. It is found as an interval over all temperatures, gaps and loads, with the
bound put into the rate before, and for the values of the parameters that a run has.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import symengine

from surfacechem.contracts.terms import Spec
from surfacechem.expressions import FRACTION_FLOOR, Expression
from surfacechem.model.build import Build
from surfacechem.model.constraints.enclosure import VANISHED, WHOLE, Interval, Known, enclosure, narrowed

COLDEST, HOTTEST = 1e-9, 1e9
"""Temperatures between which rates are looked at [K]."""

Sides = frozenset[int]
"""Bounds: -1 is zero, 1 the upper one."""


class Decision:
    """The rate of the bonding state at its bounds, and what is known of the variables there."""

    def __init__(self, build: Build, rate: Expression, top: float) -> None:
        modes = {mode.symbol: (float(min(mode.words)), float(max(mode.words))) for mode in build.modes}
        self._known: dict[Any, Interval] = {**modes, **{node.T: (COLDEST, HOTTEST) for node in build.nodes.values()}}
        self._known |= dict.fromkeys(symengine.symbols("t J_c"), (0.0, math.inf))
        at_bound = {-1: _substitutions(build, 0.0), 1: _substitutions(build, top)}
        self._rates = {side: _put(rate, at) for side, at in at_bound.items()}
        self._varying = {
            side: [(spec, _put(value, at)) for _, _, spec, value in build.variables.varying]
            for side, at in at_bound.items()
        }
        read = {x for rate in self._rates.values() for x in rate.free_symbols}
        read |= {x for values in self._varying.values() for _, value in values for x in value.free_symbols}
        outside = build.interface.engine.gives if build.interface.engine else ()
        self._parameters = {
            p.path: p
            for p in build.parameters.items
            if p.load is None and p.symbol in read - self._known.keys() and p.path not in outside
        }
        self._found: dict[tuple[Interval, ...], Sides] = {}

    @property
    def paths(self) -> tuple[str, ...]:
        """Paths of the parameters that decide."""
        return tuple(self._parameters)

    @cached_property
    def usual(self) -> Sides:
        """The bounds that the scene as it stands needs."""
        ranges = tuple((p.value, p.value) for p in self._parameters.values())
        self._found[ranges] = self._needed(ranges)
        return self._found[ranges]

    def needed(self, values: Mapping[str, Interval]) -> Sides:
        """The bounds that are needed while the parameters lie in intervals, by path."""
        ranges = tuple(values[path] for path in self._parameters)
        if ranges not in self._found:
            self._found[ranges] = self._needed(ranges) if self._ever else self._ever
        return self._found[ranges]

    @cached_property
    def _ever(self) -> Sides:
        """The bounds that could be needed with any values that the parameters may have."""
        specs = [p.spec for p in self._parameters.values()]
        return self._needed([(max(spec.above, spec.at_least), spec.at_most) for spec in specs])

    def _needed(self, ranges: Sequence[Interval]) -> Sides:
        symbols = [p.symbol for p in self._parameters.values()]
        known = self._known | dict(zip(symbols, ranges, strict=True))
        return frozenset(side for side in (-1, 1) if self._passes(side, known))

    def _passes(self, side: int, known: Known) -> bool:
        for spec, value in self._varying[side]:
            known = _in_range(known, value, spec)
        low, high = enclosure(self._rates[side], known)
        return low < 0 if side < 0 else high > 0


def _substitutions(build: Build, phi: float) -> dict[Any, Expression]:
    """What stands for the bonding state at a bound, for all that depends on it, and for the side of touch."""
    at: dict[Any, Expression] = {
        symengine.Symbol("phi"): symengine.Integer(int(phi)) if phi == int(phi) else symengine.RealDouble(phi),
        symengine.Symbol("side"): symengine.Symbol("g_n"),
    }
    for item in build.named:
        if item.name != "J_c":
            at[symengine.Symbol(item.name)] = _put(item.expression, at)
    return at


def _put(expression: Expression, at: Mapping[Any, Expression]) -> Expression:
    """The expression at the bound, its logarithms of nothing by name."""
    found = symengine.sympify(expression)
    values = {piece: piece.subs(at) for piece in found.atoms(symengine.Piecewise)}
    logarithms = {piece: sign * VANISHED for piece, value in values.items() if (sign := _floored(value))}
    return found.xreplace(logarithms).subs(at)


def _floored(value: Expression) -> int:
    """The sign with which a value is the logarithm of nothing; 0 where it is not."""
    size = float(value) / math.log(FRACTION_FLOOR) if value.is_Number else 0.0
    return int(size) if size in (1.0, -1.0) else 0


def _in_range(known: Known, value: Expression, spec: Spec) -> Known:
    """What is known as a run ends where a parameter that varies leaves its range."""
    low = max(spec.above, spec.at_least)
    known = narrowed(known, value, low, spec.at_most)
    if not (value.is_Mul and low >= 0):
        return known
    unsure = [part for part in value.args if not enclosure(part, known)[0] > 0]
    return narrowed(known, unsure[0], 0.0, WHOLE[1]) if len(unsure) == 1 else known
