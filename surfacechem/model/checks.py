"""Checks before a run: initial values, limits at the start, and conductances of heat paths on both sides of touch.

Source: Sauer, Duong & Mandadapu (2021), section on heat transfer: the sum of gas and radiation may exceed the contact.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction
from functools import lru_cache
from typing import Any

import symengine

from surfacechem.errors import InputError, suggestion
from surfacechem.expressions import Expression, depends
from surfacechem.model.build import Build
from surfacechem.model.system import Array, System
from surfacechem.tolerances import CBRT_EPS, EPS

TRIAL_GAPS = tuple(10.0 ** (k / 8) for k in range(-80, -16))
"""Trial gaps for the check that a conductance is monotone [m]: 0.1 nm to 10 mm."""

P, G = symengine.symbols("p g_n")


def conductance_warnings(system: System) -> Iterator[str]:
    """Yield warnings on conductances that jump at touch, rise as the gap opens, or do not vanish without contact.

    Everything but the gap and the pressure has its value at the start.
    """
    point = _numbers_at_start(system)
    gap = system.definitions.get(G)
    moves = {system.t, *(state.symbol for state in system.states)}
    held_open = gap is not None and not gap.free_symbols & moves and gap.subs(point) > 0
    for (a, b), channels in system.conductances.items():
        ends = f"the conductance between {a} and {b}"
        across = [symengine.sympify(h).subs(point) for h in channels if depends(h, G)]
        if not across:
            continue
        borne = (symengine.sympify(h).subs(point) for h in channels if depends(h, P) and not depends(h, G))
        if any(_value(h, P, 0.0) for h in borne):
            yield f"{ends} has a part that reads p and does not vanish without pressure, nor with the gap."
        if not held_open:
            yield from _at_touch(ends, symengine.Add(*across))


def _numbers_at_start(system: System) -> dict[Any, Any]:
    """Return numbers for everything but the gap and the pressure."""
    point: dict[Any, Any] = {system.t: 0.0} | {item.symbol: item.at(0.0) for item in system.parameters}
    point |= {state.symbol: state.initial for state in system.states if state.symbol not in (P, G)}
    for item in system.named:
        symbol = symengine.Symbol(item.name)
        if symbol not in (P, G):
            point[symbol] = symengine.sympify(item.expression).subs(point)
    return point


def _value(h: Expression, variable: Any, value: float) -> float | None:
    """Return a conductance at this value of the variable; None if it depends on more variables."""
    found = h.subs({variable: value})
    return None if found.free_symbols else float(found)


def _at_touch(ends: str, h: Expression) -> Iterator[str]:
    at_touch = _value(h, G, 0.0)
    # A pole, as of a film of zero thickness, is no jump: the law ends there and has a margin for it.
    if at_touch is None or not math.isfinite(at_touch):
        return
    before, after = (_value(h, G, side * EPS) or 0.0 for side in (-1, 1))
    highest, where = max((_value(h, G, g) or 0.0, g) for g in TRIAL_GAPS)
    if max(before, after) > (1 + CBRT_EPS) * min(before, after):
        yield f"{ends} jumps at touch, from {before:.6g} to {after:.6g} W/(m^2 K)."
    elif highest > (1 + CBRT_EPS) * before:
        values = f"{before:.6g} W/(m^2 K) at touch, {highest:.6g} at a gap of {where:.2g} m"
        yield f"{ends} is not monotone: {values}. Gas and radiation across the closed gap exceed the contact."


def refuse_idle_initial_values(build: Build) -> None:
    """Raise InputError if an initial value belongs to no variable that evolves."""
    states = {state.start or state.at_start[0].name for state in build.states}
    for name in build.scene.initial:
        if name in states:
            continue
        if name in build.scene.loading:
            message = f"{name} is prescribed under `loading`, so it has no initial value; remove one of them."
        elif build.variables.has(name):
            symbol = build.variables.get(name, "the initial value")
            same = next((state.name for state in build.states if state.symbol == symbol), None)
            message = f"{name} has two roles: an initial value, and prescribed or constant elsewhere."
            message = f"{name} is {same} in this case; give `{same}` instead." if same else message
        elif name in ("phi", "ln_phi"):
            message = f"nothing evolves {name}. Give a law under `bonding`, or remove it."
        else:
            known = {*states, *(slab.profile for slab in build.thermal.slabs.values())}
            message = f"nothing that evolves is called '{name}'.{suggestion(name, known)}"
        raise InputError(message, path=f"initial.{name}")


class StartLimits:
    """Check of initial values against the limits of a system."""

    def __init__(self, system: System) -> None:
        states = [None if state.algebraic else state.symbol for state in system.states]
        symbols = [system.t, *states, *(parameter.symbol for parameter in system.parameters)]
        self._places = {symbol: place for place, symbol in enumerate(symbols) if symbol is not None}
        self._limits = [(margin, expression, _sum(expression, self._places)) for margin, expression in system.limits]

    def check(self, y: Array, parameters: Array) -> None:
        """Raise InputError if these states and parameters are outside the range in which the laws hold."""
        numbers = [0.0, *y.tolist(), *parameters.tolist(), 1.0]
        for margin, expression, terms in self._limits:
            number = self._exactly(expression, terms, numbers)
            # A limit that reads an algebraic variable or a derivative is None: only the run can evaluate it.
            if number is not None and not number > 0:
                remedy = f" {margin.remedy}" if margin.remedy else ""
                message = f"at the start {margin.reason} ({margin.name} does not hold: {number:.6g}).{remedy}"
                raise InputError(message, path=margin.path)

    def _exactly(
        self, expression: Expression, terms: Sequence[tuple[int, float]] | None, numbers: Sequence[float]
    ) -> float | None:
        """Return the value of an expression without roundoff; NaN if undefined, None if a symbol has no number.

        ``terms`` are those of a sum of known symbols and numbers, None for any other expression.
        """
        try:
            if terms is not None:
                return math.fsum([factor * numbers[place] for place, factor in terms])
            known = {x: self._places[x] for x in expression.free_symbols if x in self._places}
            value = expression.subs({x: _exact(numbers[place]) for x, place in known.items()})
            return None if value.free_symbols else float(value)
        except (RuntimeError, TypeError, ValueError):  # undefined, such as zero over zero
            return math.nan


def _sum(expression: Expression, places: Mapping[Any, int]) -> list[tuple[int, float]] | None:
    """Return positions and factors of the terms, if an expression is a sum of known symbols and numbers alone.

    Most limits are. A number is its factor times the last entry, which is one.
    """
    terms = []
    for term in expression.args if isinstance(expression, symengine.Add) else (expression,):
        if isinstance(term, symengine.Float | symengine.Integer):
            terms.append((-1, float(term)))
        elif term in places:
            terms.append((places[term], 1.0))
        elif -term in places:
            terms.append((places[-term], -1.0))
        else:
            return None
    return terms


@lru_cache(maxsize=1024)
def _exact(value: float) -> Any:
    """Return a double as an exact rational number, so that a capacity that vanishes exactly is found to vanish."""
    fraction = Fraction(value)
    return symengine.Integer(fraction.numerator) / symengine.Integer(fraction.denominator)
