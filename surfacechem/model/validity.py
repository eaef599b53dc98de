"""What must hold before a run starts: every margin is open at the initial state."""

from __future__ import annotations

import math
from collections.abc import Mapping
from fractions import Fraction
from typing import Any

import symengine

from surfacechem.errors import InputError
from surfacechem.expressions import Expression
from surfacechem.model.system import Margin, System


def check_start(system: System, values: Mapping[str, float], initial: Mapping[str, float]) -> None:
    """Raise InputError if the initial state is outside the range in which the laws hold.

    ``values`` holds the parameters of the first piece of time by path, ``initial`` the states by name.
    """
    point = {parameter.symbol: _exact(values[parameter.path]) for parameter in system.parameters}
    point |= {state.symbol: _exact(initial[state.name]) for state in system.states if not state.algebraic}
    point[system.t] = symengine.Integer(0)
    for margin in system.margins:
        if margin.terminal:
            _check(margin, _at(system.expand(margin.masked), point))


def _at(expression: Expression, point: Mapping[Any, Any]) -> Expression:
    try:
        return expression.subs(point)
    except RuntimeError:  # a condition on a number that is undefined
        return symengine.nan


def _check(margin: Margin, value: Expression) -> None:
    if value.free_symbols:  # needs an algebraic variable or a derivative, which only the run can find
        return
    number = _number(value)
    if not number > 0:
        remedy = f" {margin.remedy}" if margin.remedy else ""
        message = f"at the start {margin.reason} ({margin.name} does not hold: {number:.6g}).{remedy}"
        raise InputError(message, path=margin.path)


def _number(value: Expression) -> float:
    try:
        return float(value)
    except (RuntimeError, TypeError):  # an undefined number, zero over zero for instance
        return math.nan


def _exact(value: float) -> Any:
    """A double as the rational number it is, so that a vanishing capacity is seen to vanish."""
    fraction = Fraction(value)
    return symengine.Integer(fraction.numerator) / symengine.Integer(fraction.denominator)
