"""Numbers that a case gives for the species and reactions of its mechanism in place of those of the file."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, TypeVar

from surfacechem.contracts.terms import Law
from surfacechem.documents.document import Tree
from surfacechem.format.declarations import number

if TYPE_CHECKING:
    from surfacechem.mechanism import Mechanism
    from surfacechem.mechanism.mixture import Species

L = TypeVar("L", bound=Law)


def with_numbers(mechanism: Mechanism, species: Tree | None, reactions: Tree | None) -> Mechanism:
    """The mechanism with other numbers of some species, by name, and of some reactions, by label."""
    if species is not None:
        mechanism = _with_species(mechanism, species)
    if reactions is None:
        return mechanism
    given = reactions.mapping([law.label for law in mechanism.reactions], "reactions")
    laws = (_changed(law, given[law.label]) if law.label in given else law for law in mechanism.reactions)
    return replace(mechanism, reactions=tuple(laws))


def _with_species(mechanism: Mechanism, tree: Tree) -> Mechanism:
    (mixture,) = mechanism.potentials
    given = tree.mapping(mechanism.species, "species")
    species: dict[str, Species] = {item.name: item for item in vars(mixture)["species"]}
    if given and any(item.fixed for item in species.values()):
        raise tree.error("Cantera evaluates reactions here with the thermo of the file. Change it in the file.")
    species |= {name: _one_species(species[name], child) for name, child in given.items()}

    def renewed(law: L) -> L:
        return law.bind({"species": tuple(species[item.name] for item in vars(law)["species"])})

    reactions = tuple(renewed(law) for law in mechanism.reactions)
    return replace(mechanism, potentials=(renewed(mixture),), reactions=reactions)


def _one_species(item: Species, tree: Tree) -> Species:
    """A species with numbers for its bond and for its thermo, by temperature range where it has several."""
    ranges = item.gibbs.ranges
    own: list[Law] = [law for law in (item.spring, ranges.get("")) if law is not None]
    keys = {name: law for law in own for name, _ in law.specs()}
    fields = tree.mapping([*keys, *filter(None, ranges)])

    def renewed(law: L, part: Tree | None = None) -> L:
        inner = {key: child for key, child in fields.items() if keys.get(key) is law}
        return _changed(law, part or replace(tree, value=inner))

    forms = [renewed(form, fields.get(key)) for key, form in ranges.items()]
    return replace(item, gibbs=item.gibbs.with_forms(forms), spring=item.spring and renewed(item.spring))


def _changed(law: L, tree: Tree) -> L:
    """A law with the numbers that a case gives for it."""
    specs = {name: law.refine(name, spec) for name, spec in law.specs() if spec.varies}
    fields = tree.mapping(specs, "parameters")
    return law.given({name: number(child, specs[name], name) for name, child in fields.items()})
