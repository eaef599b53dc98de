"""The laws, one family a module. A law is found by the contract it fulfils and its name; nothing else is imported."""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Iterator
from types import ModuleType

from surfacechem.contracts.terms import (
    BodyEnergy,
    Factor,
    Friction,
    HeatTransfer,
    Law,
    Limit,
    Load,
    Potential,
    Property,
    RateLaw,
    Shape,
)
from surfacechem.errors import InputError, suggestion

FAMILIES: dict[type[Law], tuple[str, ...]] = {
    BodyEnergy: ("bulk",),
    Potential: ("bonding", "contact", "cohesive", "longrange", "films"),
    RateLaw: ("kinetics", "bonds", "cohesive"),
    Friction: ("friction", "films"),
    HeatTransfer: ("heat", "contact_conductance", "films"),
    Limit: ("cohesive",),
    Property: ("media",),
    Load: ("loading",),
    Factor: ("factors",),
    Shape: ("shapes",),
}
"""The modules in which the laws of a contract stand."""


ELSEWHERE = {"shapes": "surfacechem.surfaces.shapes"}
"""Modules of other rooms."""


def module(family: str) -> ModuleType:
    """The module of a family."""
    return importlib.import_module(ELSEWHERE.get(family, f"{__name__}.{family}"))


def _in_module(contract: type[Law], family: str) -> Iterator[type[Law]]:
    found = module(family)
    for value in vars(found).values():
        own = inspect.isclass(value) and value.__module__ == found.__name__
        if own and issubclass(value, contract) and not inspect.isabstract(value):
            yield value


def laws(contract: type[Law]) -> dict[str, type[Law]]:
    """All laws that fulfil a contract, by name."""
    return {law.name(): law for family in FAMILIES[contract] for law in _in_module(contract, family)}


def find(contract: type[Law], name: str) -> type[Law]:
    """The law of that name; imports no family beyond the one that holds it."""
    # One family after the other, so that a case imports no more than those before its own.
    for family in FAMILIES[contract]:
        for law in _in_module(contract, family):
            if law.name() == name:
                return law
    raise InputError(f"no {contract.contract} law '{name}'.{suggestion(name, laws(contract))}")
