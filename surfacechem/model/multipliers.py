"""A factor on each reaction rate, one unless it is changed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import symengine

from surfacechem.contracts.terms import Spec
from surfacechem.model.system import Parameter, System


def with_multipliers(system: System) -> tuple[System, tuple[str, ...]]:
    """The system with parameters ``multiplier.LABEL``, and the labels of the reactions in the order of the scene."""
    labels = tuple(item.name[2:] for item in system.named if item.quantity.tag == "e:R")
    return _multiplied(system, labels), labels


def _multiplied(system: System, labels: Sequence[str]) -> System:
    symbols = {f"R_{label}": symengine.Symbol(f"multiplier_{label}") for label in labels}
    named = tuple(
        replace(item, expression=symbols[item.name] * item.expression) if item.name in symbols else item
        for item in system.named
    )
    factors = tuple(
        Parameter(symbol, f"multiplier.{name[2:]}", Spec("1", "factor on a rate"), 1.0)
        for name, symbol in symbols.items()
    )
    origin = partial(_multiplied, system, labels)
    return replace(system, named=named, parameters=(*system.parameters, *factors), origin=origin)
