"""What a mechanism file may hold. Cantera ignores what it does not know; here it is an error with its line."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from surfacechem.errors import InputError, Place, suggestion
from surfacechem.mechanism import values
from surfacechem.mechanism.interaction import MODEL, check_dependence
from surfacechem.mechanism.rate_types import kind_of, kinds, names
from surfacechem.mechanism.rates import InterfaceArrhenius, SurfaceReaction
from surfacechem.mechanism.remedies import (
    CHARGED,
    LEAVE,
    MODELS,
    PRESSURE,
    REMEDIES,
    STICKING,
    is_evaluated,
    is_foreign,
    needs_neighbour,
)
from surfacechem.mechanism.source import Source, chosen, sections, sides

FILE = frozenset(
    (
        "description",
        "generator",
        "date",
        "input-files",
        "cantera-version",
        "git-commit",
        "note",
        "units",
        "phases",
        "species",
        "reactions",
        "elements",
        "extensions",
    )
)
PHASE = frozenset(
    (
        "name",
        "elements",
        "species",
        "thermo",
        "kinetics",
        "reactions",
        "site-density",
        "state",
        "transport",
        "note",
        "description",
    )
)
SPECIES = frozenset(
    (
        *("name", "composition", "thermo", "sites", "bond", "units", "note", "description", "transport"),
        "coverage-dependencies",
    )
)
CONSTANT_CP = frozenset(("model", "T0", "h0", "s0", "cp0", "T-min", "T-max", "reference-pressure", "note"))
POLYNOMIAL = frozenset(("model", "temperature-ranges", "data", "reference-pressure", "note"))
THERMO = {"constant-cp": CONSTANT_CP, "NASA7": POLYNOMIAL, "NASA9": POLYNOMIAL, "Shomate": POLYNOMIAL}
REACTION = frozenset(
    (
        "equation",
        "type",
        "orders",
        "negative-orders",
        "nonreactant-orders",
        "duplicate",
        "units",
        "id",
        "note",
        "description",
    )
)
BOND = {"stiffness": "N/m", "rest-length": "m"}
"""Keys of the elasticity of a bond with the units they have."""
STATE = frozenset(("T", "P", "coverages"))
WRITTEN_SPECIES, WRITTEN_STATE = frozenset(("size", "charge")), frozenset(("X", "Y"))
"""Keys that Cantera writes beside those that it documents; the state of a file is not used."""

BESIDE = frozenset(("adjacent-phases", "skip-undeclared-elements", "Motz-Wise"))
"""Keys of a phase with neighbours; all elements of its species have to be declared in any case."""


def check(source: Source, phase: Any, evaluate: bool = False) -> None:
    """Raise InputError at the first entry that means nothing, means something else, or cannot be lowered.

    With ``evaluate`` reactions of other types are left to Cantera.
    """
    beside = evaluate and has_neighbours(phase)
    _check_file(source)
    _check_phase(source, phase, BESIDE if beside else frozenset())
    entries = list(source.species(phase))
    for entry in entries:
        # A neighbour's species are Cantera's affair; but one without a name may be the surface's own, misspelt.
        if not beside or "name" not in entry:
            _check_species(source, entry)
    names = _names(source, phase, entries)
    own = [entry for entry in entries if entry.get("name") in names]
    for entry in own if beside else ():
        _check_species(source, entry)
    for entry in own if beside else entries:
        _check_composition(source, phase, entry)
    for entry in own:
        check_dependence(source, phase, entry, names)
    _check_state(source, phase, names)
    for entry in source.reactions(phase):
        if evaluate and is_evaluated(entry, names, beside):
            _check_evaluated(source, phase, entry, names, beside)
        else:
            _check_reaction(source, phase, entry, names)


def has_neighbours(phase: Any) -> bool:
    """Whether a surface phase has others beside it."""
    return bool(phase.get("adjacent-phases"))


def _check_file(source: Source) -> None:
    declared = {
        name
        for phase in source.phases()
        for key in ("species", "reactions")
        for name in sections(phase.get(key, "all"), key)
    }
    _keys(source, source.data, FILE | declared, "the file")
    values.check_units(source, source.data)


def _check_phase(source: Source, phase: Any, more: frozenset[str]) -> None:
    title = f"phase {phase.get('name')}"
    model = str(phase.get("thermo"))
    if model in MODELS:
        raise InputError(f"{title}: thermo '{model}' is not lowered: {MODELS[model]}", source.place(phase, "thermo"))
    _keys(source, phase, PHASE | more | ({"reference-state-coverage"} if model == MODEL else set()), title)
    if model not in ("ideal-surface", MODEL):
        message = f"{title}: thermo '{model}' is not lowered: use `ideal-surface`."
        raise InputError(message, source.place(phase, "thermo"))
    if phase.get("kinetics", "surface") != "surface":
        message = f"{title}: kinetics '{phase['kinetics']}' is not lowered; use `kinetics: surface`."
        raise InputError(message, source.place(phase, "kinetics"))
    if "site-density" not in phase:
        message = "the phase has no `site-density`. Give one, for instance `site-density: 1e-9 mol/cm^2`."
        raise InputError(message, source.place(phase))
    values.check_positive(source, phase, "site-density", title)
    values.check_bare(source, phase, "site-density", title)


def _check_state(source: Source, phase: Any, names: Iterable[str]) -> None:
    state = phase.get("state")
    if not isinstance(state, Mapping):
        return
    _keys(source, state, STATE | (WRITTEN_STATE if source.written else set()), "state")
    values.check_kelvin(source, state, "T", "state")
    if isinstance(state.get("coverages"), Mapping):
        _known(source, state["coverages"], names, "state: coverages")


def _check_species(source: Source, entry: Any) -> None:
    title = f"species {entry.get('name')}"
    _keys(source, entry, SPECIES | (WRITTEN_SPECIES if source.written else set()), title)
    values.check_units(source, entry)
    values.check_positive(source, entry, "sites", title)
    thermo = entry.get("thermo")
    if not isinstance(thermo, Mapping):
        raise InputError(f"{title} has no `thermo`.", source.place(entry))
    model = str(thermo.get("model"))
    if "model" in thermo and model not in THERMO:
        message = f"{title}: thermo model '{model}' is not lowered.{suggestion(model, THERMO)}"
        raise InputError(message, source.place(thermo, "model"))
    known = THERMO.get(model, CONSTANT_CP | POLYNOMIAL)
    _keys(source, thermo, known, f"{title}: thermo")
    for key in ("T0", "T-min", "T-max"):
        values.check_kelvin(source, thermo, key, title)
    for key in ("h0", "s0", "cp0"):
        values.check_bare(source, thermo, key, title, entry)
    if "bond" in entry:
        _keys(source, entry["bond"], BOND, f"{title}: bond", source.place(entry, "bond"))
        for key, unit in BOND.items():
            values.check_dimension(source, entry["bond"], key, f"{title}: bond", unit, entry)
            if source.written and isinstance(entry["bond"].get(key), int | float) and entry["bond"][key]:
                message = f"{title}: bond: {key}: Cantera has written this number without its unit [{unit}]; add it."
                raise InputError(message, source.place(entry["bond"], key))


def _check_composition(source: Source, phase: Any, entry: Any) -> None:
    import cantera

    own = [str(element.get("symbol")) for element in source.data.get("elements") or []]
    known = phase.get("elements", [*cantera.Element.element_symbols, "E", *own])
    for element in entry.get("composition") or {}:
        if element not in known:
            guess = suggestion(str(element), known) if "elements" in phase else ""
            message = f"species {entry.get('name')}: composition: no element '{element}'.{guess}"
            raise InputError(message, source.place(entry["composition"], element))


def _names(source: Source, phase: Any, entries: list[Any]) -> list[str]:
    """The species of the phase, each of which the file must hold."""
    known = [str(entry.get("name")) for entry in entries]
    declared = phase.get("species", "all")
    names = chosen(declared, known)
    for name in names:
        if name not in known:
            raise InputError(f"species: no species '{name}'.{suggestion(name, known)}", source.place(phase, "species"))
    return names


def _check_reaction(source: Source, phase: Any, entry: Any, names: list[str]) -> None:
    title = f"reaction {entry.get('equation')}"
    _keys(source, entry, REACTION.union(*map(_own, kinds().values())), title)
    values.check_units(source, entry)
    if "equation" not in entry:
        raise InputError("a reaction has no `equation`.", source.place(entry))
    law = _law(source, entry, title)
    for key in entry:
        if key not in REACTION | _own(law):
            having = ", ".join(sorted(kind for kind, other in kinds().items() if key in _own(other)))
            message = f"{title}: '{key}' is no key of {law.kind}; it belongs to {having}."
            raise InputError(message, source.place(entry, key))
    left_out = _check_equation(source, phase, entry, names, title)
    _check_rate(source, entry, law, [] if left_out else names, title)


def _check_evaluated(source: Source, phase: Any, entry: Any, names: list[str], beside: bool) -> None:
    """What Cantera would ignore in a reaction that it evaluates; what another extension reads is its own affair."""
    title = f"reaction {entry['equation']}"
    law = kind_of(str(entry.get("type", "Arrhenius")))
    if law is not None and not law.native:
        message = f"{title}: a rate of type '{entry['type']}' belongs to surface species; this one has a neighbour's."
        raise InputError(message, source.place(entry, "type"))
    if not is_foreign(entry):
        inner = {**InterfaceArrhenius.keys, **STICKING, **CHARGED}
        _keys(source, entry, {*REACTION, *inner}, title)
        for key, known in inner.items():
            if key != "coverage-dependencies" and known and isinstance(entry.get(key), Mapping):
                _keys(source, entry[key], known, f"{title}: {key}")
        _check_coverages(source, entry, inner["coverage-dependencies"], names, title)
    _check_equation(source, phase, entry, [] if beside else names, title)


def _own(law: type[SurfaceReaction]) -> set[str]:
    """Keys that a reaction has because of its rate type."""
    return {*law.keys, *law.own_keys()}


def _law(source: Source, entry: Any, title: str) -> type[SurfaceReaction]:
    """The rate type, which Cantera writes with or without its prefix; a plain rate needs none."""
    kind = str(entry.get("type", "Arrhenius"))
    if kind in PRESSURE:
        message = f"{title}: rate type '{kind}' depends on pressure, which belongs to gases; give a `rate-constant`."
        raise InputError(message, source.place(entry, "type"))
    if needs_neighbour(kind):
        raise InputError(f"{title}: rate type '{kind}': {needs_neighbour(kind)}", source.place(entry, "type"))
    law = kind_of(kind)
    if law is None:
        message = f"{title}: rate type '{kind}' is not lowered.{suggestion(kind, names())} {LEAVE}"
        raise InputError(message, source.place(entry, "type"))
    return law


def _check_equation(source: Source, phase: Any, entry: Any, names: list[str], title: str) -> bool:
    """Whether the reaction is left out, because the phase takes only those of its own species; all are in ``names``."""
    reactants, products, _ = sides(str(entry["equation"]))
    place = source.place(entry, "equation")
    for name in (*reactants, *products):
        if name.strip("(+)") == "M":
            raise InputError(f"{title}: third bodies belong to gases; remove '{name}'.", place)
    if not reactants or not products:
        raise InputError(f"{title}: an equation has two sides with `<=>` or `=>` between them.", place)
    unknown = [name for name in (*reactants, *products) if names and name not in names]
    if unknown and phase.get("reactions", "all") == "declared-species":
        return True
    if unknown:
        raise InputError(f"{title}: no species '{unknown[0]}'.{suggestion(unknown[0], names)}", place)
    if reactants == products:
        raise InputError(f"{title}: both sides are the same, so that nothing changes.", place)
    return False


def _check_rate(source: Source, entry: Any, law: type[SurfaceReaction], names: list[str], title: str) -> None:
    for key, inner in law.keys.items():
        node = entry.get(key)
        if key == "coverage-dependencies":
            _check_coverages(source, entry, inner, names, title)
        elif inner and key in entry and not isinstance(node, Mapping):
            wanted = f"{key}: {{{', '.join(inner)}}}"
            raise InputError(f"{title}: write `{wanted}`, not {node!r}.", source.place(entry, key))
        elif inner and isinstance(node, Mapping):
            _keys(source, node, inner, f"{title}: {key}")
    if isinstance(entry.get("orders"), Mapping) and names:
        _known(source, entry["orders"], names, f"{title}: orders")
    if "rate-constant" in law.keys:
        _check_arrhenius(source, entry, title)
    specs = dict(law.specs())
    for key, name in law.own_keys().items():
        values.check_dimension(source, entry, key, title, specs[name].unit, entry)


def _check_coverages(source: Source, entry: Any, inner: Iterable[str], names: list[str], title: str) -> None:
    node = entry.get("coverage-dependencies")
    if not isinstance(node, Mapping):
        return
    if names:
        _known(source, node, names, f"{title}: coverage-dependencies")
    for name, terms in node.items():
        if isinstance(terms, Mapping):
            _keys(source, terms, inner, f"{title}: coverage-dependencies: {name}")
            values.check_bare(source, terms, "E", title, entry)


def _check_arrhenius(source: Source, entry: Any, title: str) -> None:
    rate = entry.get("rate-constant")
    if not isinstance(rate, Mapping):
        raise InputError(f"{title} has no `rate-constant: {{A, b, Ea}}`.", source.place(entry))
    if values.leading(rate.get("A")) < 0:
        raise InputError(f"{title}: 'A' is negative: {REMEDIES['negative-A']}", source.place(rate, "A"))
    orders = {**sides(str(entry["equation"]))[0], **(entry.get("orders") or {})}
    if sum(map(values.leading, orders.values())) != 1:
        values.check_bare(source, rate, "A", title, entry)
    values.check_bare(source, rate, "Ea", title, entry)


def _known(source: Source, node: Any, names: Iterable[str], title: str) -> None:
    """Every key is a species."""
    for name in node:
        if name not in names:
            raise InputError(f"{title}: no species '{name}'.{suggestion(str(name), names)}", source.place(node, name))


def _keys(source: Source, node: Any, known: Iterable[str], title: str, place: Place | None = None) -> None:
    if not isinstance(node, Mapping):
        raise InputError(f"{title} is not a mapping: {node!r}.", place or Place(source.file))
    allowed = set(known)
    for key in node:
        if key in allowed:
            continue
        place = source.place(node, key)
        if key in REMEDIES:
            raise InputError(f"{title}: '{key}' cannot be used here: {REMEDIES[key]}", place)
        raise InputError(f"{title}: unknown key '{key}'.{suggestion(str(key), allowed)}", place)
