"""What must hold before a run starts, and whether heat paths across a gap are what they should be at touch.

Source: Sauer, Duong & Mandadapu (2021), section on heat transfer: the sum of gas and radiation may exceed the contact.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from fractions import Fraction
from typing import Any

import symengine

from surfacechem.errors import InputError
from surfacechem.expressions import Expression, depends
from surfacechem.model.build import Build
from surfacechem.model.system import System
from surfacechem.tolerances import CBRT_EPS, EPS

OPENINGS = tuple(10.0 ** (k / 8) for k in range(-80, -16))
"""Gaps at which a conductance is looked at [m]: 0.1 nm to 10 mm."""

P, G = symengine.Symbol("p"), symengine.Symbol("g_n")


def check_touch(build: Build) -> None:
    """Warn of conductances that jump at touch, rise as the gap opens, or hold where nothing touches."""
    for (a, b), channels in build.conductances.items():
        across = [h for h in channels if depends(h, G)]
        if not across:
            continue
        start = _Start(build)
        ends = f"the conductance between {a} and {b}"
        contact = [(h, start.at(h, P, 0.0)) for h in channels if depends(h, P) and not depends(h, G)]
        if any(value for _, value in contact if value is not None):
            build.warnings.append(
                f"{ends} has a part that reads p and does not vanish without pressure, nor with the gap."
            )
        total = symengine.Add(*across)
        at_touch = start.at(total, G, 0.0)
        # A pole, as of a film of no thickness, is no jump: the law ends there, and says so itself.
        if not start.apart and at_touch is not None and math.isfinite(at_touch):
            build.warnings += _along(start, total, ends)


def _along(start: _Start, h: Expression, ends: str) -> list[str]:
    before, after = (start.at(h, G, side * EPS) or 0.0 for side in (-1, 1))
    if abs(after - before) > CBRT_EPS * max(before, after):
        return [f"{ends} jumps at touch, from {before:.6g} to {after:.6g} W/(m^2 K)."]
    values = [(start.at(h, G, g) or 0.0, g) for g in OPENINGS]
    highest, where = max(values)
    if highest > (1 + CBRT_EPS) * before:
        values_there = f"{before:.6g} W/(m^2 K) at touch, {highest:.6g} at a gap of {where:.2g} m"
        return [f"{ends} is not monotone: {values_there}. Gas and radiation across the closed gap exceed the contact."]
    return []


class _Start:
    """Numbers for everything but the gap and the pressure, at the start."""

    def __init__(self, build: Build) -> None:
        point: dict[Any, Any] = {build.t: 0.0}
        point |= {parameter.symbol: parameter.at(0.0) for parameter in build.parameters.items}
        point |= {state.symbol: state.initial for state in build.states if state.symbol not in (P, G)}
        for item in build.named:
            if symengine.Symbol(item.name) not in (P, G):
                point[symengine.Symbol(item.name)] = symengine.sympify(item.expression).subs(point)
        self.point = point
        held = build.loads.get("g_n")
        self.apart = held is not None and held.name() == "hold" and held.value(0.0) > 0
        """Whether the gap is held open."""

    def at(self, h: Expression, variable: Any, value: float) -> float | None:
        """Value of a conductance where the variable has this value; None where it depends on more."""
        found = symengine.sympify(h).subs(self.point).subs({variable: value})
        return None if found.free_symbols else float(found)


def check_start(system: System, values: Mapping[str, float], initial: Mapping[str, float]) -> None:
    """Raise InputError if the initial state is outside the range in which the laws hold.

    ``values`` holds the parameters of the first piece of time by path, ``initial`` the states by name.
    """
    point = {parameter.symbol: _exact(values[parameter.path]) for parameter in system.parameters}
    point |= {state.symbol: _exact(initial[state.name]) for state in system.states if not state.algebraic}
    point[system.t] = symengine.Integer(0)
    for margin in system.margins:
        if margin.terminal:
            try:
                value = system.expand(margin.masked).subs(point)
                if value.free_symbols:  # needs an algebraic variable or a derivative, which only the run can find
                    continue
                number = float(value)
            except (RuntimeError, TypeError):  # an undefined number, zero over zero for instance
                number = math.nan
            if not number > 0:
                remedy = f" {margin.remedy}" if margin.remedy else ""
                message = f"at the start {margin.reason} ({margin.name} does not hold: {number:.6g}).{remedy}"
                raise InputError(message, path=margin.path)


def _exact(value: float) -> Any:
    """A double as the rational number it is, so that a vanishing capacity is seen to vanish."""
    fraction = Fraction(value)
    return symengine.Integer(fraction.numerator) / symengine.Integer(fraction.denominator)
