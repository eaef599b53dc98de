"""The rate types that are lowered, by Cantera's name."""

from __future__ import annotations

import inspect

from surfacechem.mechanism import affinity, bonds, cure, rates
from surfacechem.mechanism.rates import SurfaceReaction

FAMILIES = (rates, bonds, affinity, cure)
"""The modules in which rate types stand."""

PREFIX = "interface-"


def kinds() -> dict[str, type[SurfaceReaction]]:
    """Every rate type that is lowered, by Cantera's name."""
    values = (value for family in FAMILIES for value in vars(family).values())
    laws = [value for value in values if inspect.isclass(value) and issubclass(value, SurfaceReaction)]
    return {law.kind: law for law in laws if law.kind}


def kind_of(name: str) -> type[SurfaceReaction] | None:
    """The rate type that a mechanism calls by that name; Cantera puts the prefix where it is missing."""
    known = kinds()
    plain = "Arrhenius" if name == "elementary" else name
    return known.get(plain) or known.get(PREFIX + plain)


def names() -> list[str]:
    """The rate types as a mechanism writes them."""
    return [kind.removeprefix(PREFIX) for kind in kinds()]
