"""Bonds that break at once: the bonding state, or the bonds of a mechanism by the reactions in which they break."""

from __future__ import annotations

from collections.abc import Mapping

import symengine

from surfacechem.contracts.terms import Law
from surfacechem.errors import InputError, suggestion
from surfacechem.expressions import Expression, depends
from surfacechem.model.build import Build
from surfacechem.scene import BondingVariable

Stoichiometry = Mapping[str, int | float]


def bonds_left(build: Build) -> Expression | None:
    """The bonding state, before it is defined for the laws; None where nothing bonds."""
    if "phi" in build.bonding:
        return build.bonding["phi"].symbol
    bonds = [build.bonding[name].symbol for name in build.interface.bonds]
    return symengine.Add(*bonds) if bonds else None


def follows_bonds(build: Build, strength: Expression) -> bool:
    """Whether a strength is that of the bonds, so that it comes back with them."""
    expanded = build.expanded(strength)
    names = ("phi", *build.interface.bonds)
    return any(depends(expanded, symengine.Symbol(name)) for name in names)


def broken(build: Build, law: Law, named: str = "") -> dict[Expression, Expression]:
    """New values of the bonding variables where bonds break at once: of all of them, or of the one ``named``."""
    if not build.interface.bonds:
        if named:
            message = f"{law.name()} breaks '{named}', but the bonds are not species of a mechanism."
            raise InputError(message, law.place)
        return {bond.symbol: symengine.Integer(0) for name, bond in build.bonding.items() if name == "phi"}
    lost = [_named(build, law, named)] if named else list(build.interface.bonds)
    changes: dict[str, Expression] = {}
    for name in lost:
        nu = _way(build, law, name, lost)
        extent = build.bonding[name].symbol * build.bonding[name].density / -nu[name]
        for other, n in nu.items():
            changes[other] = changes.get(other, 0) + n * extent / build.bonding[other].density
    none = symengine.Integer(0)
    return {
        build.bonding[x].symbol: none if x in lost else build.bonding[x].symbol + change
        for x, change in changes.items()
    }


def _species(variable: BondingVariable) -> str:
    return variable.long_name.removeprefix("coverage of ")


def _named(build: Build, law: Law, name: str) -> str:
    variables = [item for item in build.interface.variables if item.name in build.interface.bonds]
    known = {_species(item): item.name for item in variables} | {item.name: item.name for item in variables}
    if name not in known:
        bonds = [_species(item) for item in variables]
        raise InputError(f"{law.name()}: no bond is called '{name}'.{suggestion(name, bonds)}", law.place)
    return known[name]


def _way(build: Build, law: Law, name: str, lost: list[str]) -> Stoichiometry:
    """The reaction by which a bond breaks: the first that turns it into what is no bond."""
    found = [_breaking(reaction.stoichiometry(), name) for reaction in build.interface.reactions]
    ways = [nu for nu in found if nu and not any(n > 0 and x in build.interface.bonds for x, n in nu.items())]
    if not ways:
        message = f"{law.name()} breaks bonds at once, but no reaction says what {name} breaks into."
        raise InputError(message, law.place)
    if any(nu != ways[0] for nu in ways[1:]):
        products = " + ".join(x for x, n in ways[0].items() if n > 0)
        build.warnings.append(
            f"{law.name()} breaks {name} into {products}, by the first of the reactions that break it."
        )
    return ways[0]


def _breaking(nu: Stoichiometry, name: str) -> Stoichiometry:
    """A reaction, or its reverse, that consumes one of the bond and no other bond; empty where it is none."""
    if not nu.get(name):
        return {}
    return {x: -n / nu[name] for x, n in nu.items() if n}
