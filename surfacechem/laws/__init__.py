"""The laws, one family per module. A law is found by its contract and its name; no other family is imported."""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from types import ModuleType
from typing import TypeVar

from surfacechem.contracts import terms
from surfacechem.contracts.terms import Law
from surfacechem.errors import LAWS, InputError, suggestion

L = TypeVar("L", bound=type[Law])

FAMILIES: dict[type[Law], tuple[str, ...]] = {
    terms.BodyEnergy: ("free_energy",),
    terms.Potential: ("free_energy", "cohesive", "longrange", "films"),
    terms.RateLaw: ("kinetics", "cohesive"),
    terms.Friction: ("friction", "films"),
    terms.HeatTransfer: ("heat_transfer", "films"),
    terms.Limit: ("cohesive",),
    terms.Property: ("films",),
    terms.Load: ("loading",),
    terms.Factor: ("factors",),
    terms.Shape: ("shapes",),
    terms.PairEnergy: ("longrange",),
    terms.FilmGrowth: ("films",),
}
"""The modules that hold the laws of each contract."""


OTHER_ROOMS = {"shapes": "surfacechem.surfaces.shapes"}
"""Modules of laws in other subpackages, by family."""


def module(family: str) -> ModuleType:
    """Return the module of a family."""
    return importlib.import_module(OTHER_ROOMS.get(family, f"{__name__}.{family}"))


def _stated_in(found: ModuleType, contract: type[Law]) -> Iterator[type[Law]]:
    for value in vars(found).values():
        own = inspect.isclass(value) and value.__module__ == found.__name__
        if own and issubclass(value, contract) and value.is_stated():
            yield value


def laws(contract: type[Law]) -> dict[str, type[Law]]:
    """Return all laws of a contract, by name."""
    own = [*_of_installed_packages(), *_registered.values(), *_of_the_case.get()]
    return _shipped(contract) | {law.name(): law for law in own if issubclass(law, contract)}


def _shipped(contract: type[Law]) -> dict[str, type[Law]]:
    return {law.name(): law for family in FAMILIES[contract] for law in _stated_in(module(family), contract)}


def knows(contract: type[Law], name: str) -> bool:
    """True if a contract has a law of that name."""
    return _found(contract, name) is not None


def find(contract: type[Law], name: str) -> type[Law]:
    """Return the law of that name; imports no family after the one that holds it."""
    found = _found(contract, name)
    if found is None:
        raise InputError(f"no {contract.contract} law '{name}'.{suggestion(name, laws(contract), LAWS)}")
    return found


def _found(contract: type[Law], name: str) -> type[Law] | None:
    # Family by family, so that a case imports none after the one that it uses.
    for family in FAMILIES[contract]:
        for law in _stated_in(module(family), contract):
            if law.name() == name:
                return law
    return laws(contract).get(name)


# -- laws of one's own ------------------------------------------------------------------------------------------------

ENTRY_POINTS = "surfacechem.laws"
"""Entry points by which other packages provide laws: classes, or modules of them."""

_registered: dict[str, type[Law]] = {}
_of_the_case: ContextVar[tuple[type[Law], ...]] = ContextVar("laws of the case that is read", default=())


def register(law: L) -> L:
    """Register a law by its name for all cases read from now on; also a decorator.

    A law registered again, as when a notebook cell runs again, replaces the previous one.

    Parameters
    ----------
    law
        The class.

    Returns
    -------
    type
        The same class.

    Raises
    ------
    InputError
        Where the class is no law, or has the name of one of the package.
    """
    check_own(law)
    _registered[law.name()] = law
    return law


def check_own(law: type[Law]) -> None:
    """Raise InputError unless a class is a law of some contract, with a name that no law of the package has."""
    contracts = [contract for contract in FAMILIES if contract in getattr(law, "__mro__", ())]
    if not contracts or not law.is_stated():
        known = ", ".join(contract.__name__ for contract in FAMILIES)
        raise InputError(f"{getattr(law, '__name__', law)} is no law: a law is a subclass of one of {known}.")
    for contract in contracts:
        if law.name() in _shipped(contract):
            taken = f"the {contract.contract} law '{law.name()}' of the package"
            raise InputError(f"{law.__name__} has the name of {taken}.")


def laws_of_module(found: ModuleType) -> list[type[Law]]:
    """Return the laws that a module defines."""
    own = (value for contract in FAMILIES for value in _stated_in(found, contract))
    return list(dict.fromkeys(own))


@contextmanager
def known(own: Sequence[type[Law]]) -> Iterator[None]:
    """Context in which the laws of a case are known: while it is read, and in no other case."""
    token = _of_the_case.set(tuple(own))
    try:
        yield
    finally:
        _of_the_case.reset(token)


@cache
def _of_installed_packages() -> tuple[type[Law], ...]:
    """Return the laws of installed packages, imported when a name is not in this package, or to list all laws."""
    from importlib.metadata import entry_points  # a case that names no such law need not import it

    found: list[type[Law]] = []
    for point in entry_points(group=ENTRY_POINTS):
        try:
            given = point.load()
            own = laws_of_module(given) if isinstance(given, ModuleType) else [given]
            for law in own:
                check_own(law)
        except Exception as error:  # the code of another package may raise anything
            said = error.message if isinstance(error, InputError) else f"{type(error).__name__}: {error}"
            raise InputError(f"the entry point {point.value} of an installed package gives no laws: {said}") from error
        found += own
    return tuple(found)
