"""Loading of a mechanism: Cantera parses, converts units and balances equations; the result is lowered to laws."""

from __future__ import annotations

import math
import pickle
import re
import sys
import warnings
from collections.abc import Mapping, Sequence
from functools import partial
from itertools import accumulate
from pathlib import Path
from typing import Any, NamedTuple

from surfacechem import documents as data
from surfacechem.contracts.terms import Potential, RateLaw
from surfacechem.documents import document
from surfacechem.documents.cache_folder import PACKAGE, cache_root, fingerprint, from_file, source_digest, version
from surfacechem.errors import InputError, Place, refuse_unknown, suggestion
from surfacechem.mechanism.evaluated import EvaluatedReaction, Neighbour, NeighbourReaction, SurfaceEngine, hold
from surfacechem.mechanism.keys import PhaseCheck, has_neighbours, is_evaluated
from surfacechem.mechanism.rates import kind_of, names, plain
from surfacechem.mechanism.source import MECHANISM_LIMITS, Source, own_parameters, sides
from surfacechem.mechanism.thermo import (
    KEY,
    BondSpring,
    IdealMixture,
    Species,
    identifiers,
    interactions,
    lower,
    unpaired_dependence,
)
from surfacechem.quantities import MOLECULAR
from surfacechem.scene import BondingVariable, Engine, Sites
from surfacechem.tolerances import NO_AMOUNT

ROOMS = ".", "contracts", "documents", "laws", "mechanism"
"""Folders of the package whose code determines what a mechanism becomes."""

LIBRARIES = "cantera", "numpy", "ruamel.yaml", "symengine"
"""Libraries whose code does too."""

REACTIONS_PATH = "interface.mechanism.reactions"
"""Path at which a case changes parameters of reactions."""


class Mechanism(NamedTuple):
    """A Cantera surface mechanism as potentials, rate laws and coverages of an interface."""

    potentials: tuple[Potential, ...]
    reactions: tuple[RateLaw, ...]
    variables: tuple[BondingVariable, ...]
    bonds: tuple[str, ...]
    """Names of the coverages that count as bonds."""
    sites: Sites
    """Density of possible bonds: the site density over the number of sites of a bond."""
    text: str
    """Text of the mechanism file."""
    species: Mapping[str, str]
    """Name of the coverage of each species."""
    phase: str
    temperatures: tuple[float, float]
    """Temperature range in which the thermo of every species is valid, including neighbours [K]."""
    engine: Engine | None = None
    """Engine that evaluates the rates that are not lowered, if any."""
    remarks: tuple[str, ...] = ()
    """Remarks on unusual entries of the file."""
    follows_from_text: bool = False
    """True if it depends on no other file, on no code outside the package and on no engine."""

    def coverages(self, given: Mapping[str, float], place: Place | None = None) -> dict[str, float]:
        """Return initial values from coverages by species; others are zero, and all must sum to one."""
        refuse_unknown(given, self.species, "coverages: no species '{}'", place)
        total = sum(given.values())
        if abs(total - 1) > NO_AMOUNT:
            raise InputError(f"coverages sum to {total:.12g}, not to 1.", place)
        return {variable: float(given.get(name, 0.0)) for name, variable in self.species.items()}


def load_mechanism(
    path: Path,
    phase: str | None = None,
    bonds: Sequence[str] = (),
    place: Place | None = None,
    evaluate: bool = False,
    neighbours: Mapping[str, Neighbour] | None = None,
    name: str = "",
    text: str | None = None,
) -> Mechanism:
    """Load one surface phase of a Cantera mechanism.

    ``phase`` may be empty if the file has one surface; ``bonds`` names the species that count as bonds. ``place`` is
    where the case names the mechanism, for errors that are not in the mechanism file. With ``evaluate`` reactions that
    are not lowered are evaluated by Cantera during a run; ``neighbours`` are the prescribed states of the phases next
    to the surface, None leaves them as in the file. ``name`` is the name of the file in errors if not its path,
    ``text`` its content if it is available already. What follows from that text alone is read from the cache folder,
    without Cantera, if it was loaded before.
    """
    if text is None:
        path = find(str(path), Path(), Place(document.OVERRIDE))
        text = document.read(path, name, MECHANISM_LIMITS)
    file = name or str(path)
    load = partial(_loaded, file, text, phase, bonds, place, evaluate, neighbours)
    if neighbours:
        return load()
    sources = [source_digest(str(path)) for room in ROOMS for path in sorted((PACKAGE / room).glob("*.py"))]
    code = sys.version, *map(version, LIBRARIES), *sources
    mark = fingerprint(file, text, phase, list(bonds), evaluate, code)
    path = cache_root() / "mechanisms" / mark.digest[:32]
    found: Mechanism = from_file(
        path, load, pickle.loads, lambda made: pickle.dumps(made) if made.follows_from_text else None
    )
    return found


def _loaded(
    file: str,
    text: str,
    phase: str | None,
    bonds: Sequence[str],
    place: Place | None,
    evaluate: bool,
    neighbours: Mapping[str, Neighbour] | None,
) -> Mechanism:
    """Load one surface phase from the text of a file."""
    source = Source(file, text)
    entry = source.phase(phase, place)
    # First our check, since Cantera ignores unknown keys.
    PhaseCheck(source, entry, evaluate).run()
    surface, said = _cantera(source, entry)
    odd = hold(surface, neighbours, place)
    kept = _kept(source, entry, surface)
    species = _species(surface, source, entry, any(outside for _, _, outside in kept))
    by_name = {item.name: item for item in species}
    refuse_unknown(bonds, by_name, "bonds: no species '{}' in the mechanism", place)
    chosen = [by_name[bond] for bond in dict.fromkeys(bonds)]
    density = surface.site_density * MOLECULAR
    # Half as many bonds fit if each takes two sites, so that phi is the coverage of bonds in both cases.
    possible = density / min((item.sites for item in chosen), default=1.0)
    reactions = tuple(_reaction(source, f"R{i}", *one, species) for i, one in enumerate(kept, start=1))
    again = partial(_engine, file, text, phase, bonds, place, evaluate, neighbours)
    engine = SurfaceEngine(surface, species, reactions, neighbours or {}, again)
    mixture_place = source.place(entry, path="interface.mechanism")
    mixture = IdealMixture(species=species, temperatures=engine.temperatures, place=mixture_place)
    return Mechanism(
        potentials=(mixture,),
        reactions=reactions,
        variables=tuple(
            BondingVariable(s.variable, density / s.sites, f"coverage of {s.name}", s.name) for s in species
        ),
        bonds=tuple(item.variable for item in chosen),
        sites=Sites(possible, possible),
        text=source.text,
        species={item.name: item.variable for item in species},
        phase=str(entry["name"]),
        temperatures=engine.temperatures,
        engine=engine if engine.gives else None,
        remarks=(*said, *odd),
        follows_from_text=not engine.gives and _is_whole(source, entry, reactions),
    )


def _engine(*given: Any) -> Engine:
    """Return the engine of a mechanism that has one."""
    engine = _loaded(*given).engine
    assert engine is not None
    return engine


def _is_whole(source: Source, phase: Any, reactions: Sequence[RateLaw]) -> bool:
    """True if the phase refers to no other phase, file or extension, and all its laws are stated in this package."""
    declared = [phase.get(key) for key in ("species", "reactions", "elements")]
    # Cantera takes what is before a slash for the name of a file.
    if phase.get("adjacent-phases") or source.data.get("extensions") or "/" in str(declared):
        return False
    stated = (getattr(law, "law", type(law)) for law in reactions)  # rate types follow from laws
    return all(law.__module__.startswith(f"{PACKAGE.name}.") for law in stated)


def find(name: str, folder: Path, place: Place) -> Path:
    """Return the path of a mechanism file in a folder, in this package, or in Cantera's data directories."""
    path = document.file_in(folder, name, place) or document.file_in(data.mechanisms(), name, place)
    if path is not None:
        return path
    import cantera  # slow, hence last

    folders = [Path(other) for other in cantera.get_data_directories() if other != "."]
    for other in folders:
        if (path := document.file_in(other, name, place)) is not None:
            return path
    files = ((file, other) for other in (folder, data.mechanisms(), *folders) for file in other.glob("*.yaml"))
    examples = ((file, other) for other in folders for file in other.glob("*/*.yaml"))
    known = {file.relative_to(other).as_posix() for file, other in (*files, *examples)}
    message = f"no mechanism file {name}.{suggestion(Path(name).name, known)}"
    raise InputError(message, place if place.line or place.path else None)


def _cantera(source: Source, phase: Any) -> tuple[Any, tuple[str, ...]]:
    """Return the phase as Cantera reads it, with its warnings; its errors keep their line."""
    import cantera

    try:
        with warnings.catch_warnings(record=True) as caught:  # warnings become remarks of the mechanism
            warnings.simplefilter("always")
            surface = cantera.Interface(yaml=_plain_text(source, phase), name=str(phase["name"]))
    except cantera.CanteraError as error:
        # Cantera's message without its frame, at the line it names, else at that of the phase.
        found = re.search(r"[Ee]rror on lines? (\d+)", str(error))
        noise = re.compile(r"^(\*+|\^|)$|^[|>]|thrown by|[Ee]rror on lines?")
        lines = dict.fromkeys(line.strip() for line in str(error).splitlines())
        message = " ".join(line for line in lines if not noise.search(line)) or "the mechanism cannot be read"
        if kind := re.search(r"Unknown reaction rate type '(?:interface-)?([^']*)'", message):
            message = f"no rate type '{kind[1]}'.{suggestion(kind[1], names())}"
        place = Place(source.file, int(found[1]) if found else source.place(phase).line)
        raise InputError(f"Cantera: {message}", place) from None
    said = dict.fromkeys(" ".join(str(item.message).split()) for item in caught)
    return surface, tuple(f"{source.file}: Cantera: {text}" for text in said)


def _plain_text(source: Source, phase: Any) -> str:
    """Return the text with our rate types renamed to Arrhenius, so that Cantera reads it without an extension."""
    text = source.text
    starts = list(accumulate((len(line) for line in text.splitlines(keepends=True)), initial=0))
    places = {}
    for entry in source.reactions(phase):
        law = kind_of(str(entry["type"])) if "type" in entry else None
        if law is not None and not law.native:
            place = source.place(entry, "type")
            places[place.line, place.column] = entry
    for (line, column), entry in sorted(places.items(), reverse=True):  # backwards, so that positions stay valid
        start, kind = starts[line - 1] + column, re.escape(str(entry["type"]))
        renamed, found = re.subn(rf"""\A(\S+\s*:\s*["']?){kind}""", r"\1interface-Arrhenius", text[start:], count=1)
        if not found:
            raise source.error(f"type: write `type: {entry['type']}` on one line.", entry, "type")
        text = text[:start] + renamed
    return text


def _species(surface: Any, source: Source, phase: Any, fixed: bool) -> tuple[Species, ...]:
    entries = {str(entry["name"]): entry for entry in source.species(phase)}
    names = identifiers(surface.species_names)
    result = []
    for item in surface.species():
        entry = entries[item.name]
        title, spring = f"species {item.name}", None
        if "bond" in entry:
            bond, keys = entry["bond"], {name.replace("_", "-"): name for name, _ in BondSpring.specs()}
            read, place = partial(source.number, entry, bond, title=f"{title}: bond: "), source.place(entry, "bond")
            own: dict[str, Any] = own_parameters(BondSpring, keys, bond, f"{title}: bond", read, place)
            spring = BondSpring(**own)
        try:
            gibbs = lower(item.thermo)
        except InputError as error:  # out of range after Cantera's conversion of units
            raise source.error(f"{title}: thermo: {error.message}", entry, "thermo") from None
        # Cantera's standard state is at that coverage, ours at full coverage: they differ by R T times its logarithm.
        if "reference-state-coverage" in phase:
            gibbs = gibbs._replace(shift=-math.log(float(phase["reference-state-coverage"])))
        around = interactions(source, entry, names)
        result.append(Species(item.name, names[item.name], float(item.size), gibbs, spring, around, fixed))
    if (odd := unpaired_dependence(result)) is not None:
        name, other = odd
        problem = "this belongs to no free energy, so that energy would come out of a cycle of coverages"
        both = "Between two species make both linear, without heat capacity"
        remedy = f"{both}, and give {other} the same dependence on {name}, per site."
        message = f"species {name}: coverage-dependencies: {other}: {problem}. {remedy}"
        raise source.error(message, entries[name].get(KEY), other)
    return tuple(result)


def _kept(source: Source, phase: Any, surface: Any) -> list[tuple[Any, Any, bool]]:
    """Return every reaction as Cantera and as the file has it, and whether only Cantera can evaluate its rate.

    With `reactions: declared-species` Cantera omits reactions of other species.
    """
    known = dict.fromkeys(surface.kinetics_species_names)
    declared = {name.casefold(): name for name in known}
    own = []
    for entry in source.reactions(phase):
        reactants, products, _ = sides(str(entry["equation"]))
        others = [name for name in (*reactants, *products) if name not in known]
        # Cantera matches names regardless of case; here two names would stand for one species.
        for name in others:
            if name.casefold() in declared:
                message = f"reaction {entry['equation']}: no species '{name}'. Write '{declared[name.casefold()]}'."
                raise source.error(message, entry, "equation")
        if not others:
            own.append(entry)
    beside, names = has_neighbours(phase), surface.species_names
    pairs = zip(surface.reactions(), own, strict=True)
    return [(x, entry, is_evaluated(entry, names, beside) or x.rate.uses_electrochemistry) for x, entry in pairs]


def _reaction(
    source: Source, label: str, reaction: Any, entry: Any, outside: bool, species: tuple[Species, ...]
) -> RateLaw:
    """Return the law of a reaction: a formula, or a number that Cantera evaluates."""
    title, place = f"reaction {reaction.equation}", source.place(entry, path=f"{REACTIONS_PATH}.{label}")
    names = dict.fromkeys((*reaction.reactants, *reaction.products))
    change = {name: reaction.products.get(name, 0.0) - reaction.reactants.get(name, 0.0) for name in names}
    whole = {name: plain(nu) for name, nu in change.items() if nu}
    variables = {item.name: item.variable for item in species}
    given: dict[str, Any] = {
        "number": label,
        "equation": reaction.equation,
        "change": {variables[name]: nu for name, nu in whole.items() if name in variables},
        "reversible": bool(reaction.reversible),
        "place": place,
    }
    if not outside:
        return _lowered(reaction, source, entry, species, given)
    elastic = [item.name for item in species if item.name in whole and item.spring is not None]
    # Cantera's thermo does not depend on a gap.
    if reaction.reversible and elastic:
        message = f"{title}: {elastic[0]} is elastic, which Cantera's equilibrium constant does not know. "
        raise InputError(f"{message}Write two one-way reactions.", place)
    given |= {"whole": whole, "value": 0.0}
    if beside := _outside(whole, variables):
        return NeighbourReaction(enthalpy=0.0, gibbs=0.0, in_neighbours=beside, **given)
    return EvaluatedReaction(**given)


def _outside(whole: Mapping[str, float], own: Mapping[str, str]) -> dict[str, float]:
    """Return the part of a change that belongs to other phases."""
    return {name: nu for name, nu in whole.items() if name not in own}


def _lowered(
    reaction: Any, source: Source, entry: Any, species: tuple[Species, ...], given: Mapping[str, Any]
) -> RateLaw:
    """Return the law of a reaction as a formula; ``given`` are the fields common to all reactions."""
    title, place = f"reaction {reaction.equation}", given["place"]
    variables = {item.name: item.variable for item in species}
    law = kind_of(str(entry.get("type", "Arrhenius")))
    assert law is not None, "what is not lowered is evaluated, or was refused"
    forward = {variables[name]: order for name, order in {**reaction.reactants, **reaction.orders}.items()}
    if any(order < 0 for order in forward.values()):
        raise InputError(f"{title}: a negative order is infinite where the coverage vanishes; remove it.", place)
    who = f"a rate of type {law.kind.removeprefix('interface-')}"
    taking_part = {*reaction.reactants, *reaction.products, *reaction.orders}
    try:
        own: dict[str, Any] = {
            **law.parameters_of(reaction, variables, sum(forward.values())),
            **own_parameters(law, law.own_keys(), entry, who, partial(source.number, entry, entry)),
        }
        return law(
            orders=forward,
            products={variables[name]: nu for name, nu in reaction.products.items()},
            species=tuple(item for item in species if item.name in taking_part),
            **given,
            **own,
        )
    except InputError as error:  # a number of the mechanism is out of range
        raise InputError(f"{title}: {error.message}", error.place or place) from None
