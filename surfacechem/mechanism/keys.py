"""Valid keys of a mechanism file: Cantera ignores unknown keys; here they are errors with their line.

The keys of entries are in :mod:`surfacechem.mechanism.source`. This module has the keys inside them, the keys that
Cantera supports and the compiled path does not, with advice, and the entries whose bare number Cantera would misread.
:class:`PhaseCheck` checks a file against them.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from itertools import chain
from typing import Any

from surfacechem.errors import InputError, Place, refuse_unknown, suggestion
from surfacechem.mechanism.evaluated import GASES
from surfacechem.mechanism.rates import InterfaceArrhenius, kind_of, kinds, names
from surfacechem.mechanism.source import (
    DEPENDENT,
    ENERGY,
    FILE,
    PHASE,
    REACTION,
    SPECIES,
    SURFACES,
    Source,
    converted,
    leading,
    sides,
    unitless,
)
from surfacechem.mechanism.thermo import CAPACITY_KEYS, COEFFICIENTS, KEY, MODEL_KEYS

_words = str.split

STATE_KEYS = _words("T P coverages")
CONSTANT_CP = _words("model T0 h0 s0 cp0 T-min T-max reference-pressure note")
POLYNOMIAL = _words("model temperature-ranges data reference-pressure note")
THERMO = {"constant-cp": CONSTANT_CP, "NASA7": POLYNOMIAL, "NASA9": POLYNOMIAL, "Shomate": POLYNOMIAL}
BOND = {"stiffness": "N/m", "rest-length": "m"}
"""Keys of the elasticity of a bond with their units."""
WRITTEN_SPECIES, WRITTEN_STATE = {"size", "charge"}, ("X", "Y")
"""Undocumented keys that Cantera writes; the state of a file is not used."""
NEIGHBOUR_KEYS = {"adjacent-phases", "skip-undeclared-elements", "Motz-Wise"}
"""Keys of a phase with neighbours; all elements of its species have to be declared in any case."""
UNIT_DIMENSIONS = _words("length mass time quantity current temperature pressure energy activation-energy")
"""Dimensions for which a file may define the unit of bare numbers."""

ARRHENIUS = ("A", "b", "Ea")
MASEL = ("A", "b", "Ea0", "w")
"""Keys of a Blowers-Masel rate coefficient, which Cantera evaluates."""
STICKING: Mapping[str, tuple[str, ...]] = {
    "sticking-coefficient": ARRHENIUS,
    "Motz-Wise": (),
    "sticking-species": (),
    "sticking-order": (),
}
"""Keys of sticking reactions, with the keys inside."""
CHARGED: Mapping[str, tuple[str, ...]] = {"beta": (), "exchange-current-density-formulation": ()}
"""Keys of reactions that transfer charge between phases."""

LEAVE = "With `solver: cantera` under `run` Cantera evaluates it."
"""Advice for reactions that are not lowered."""
NEEDS = f"the compiled path knows surface species only. {LEAVE[:-1]}, with the neighbours held as the case says."
"""Advice for entries that require neighbouring phases."""
STICKING_ADVICE = f"a sticking reaction needs a gas: {NEEDS}"
CHARGES = f"charge transfer needs a neighbour at an electric potential: {NEEDS}"
THIRD_BODY_ADVICE = "third bodies belong to gases; remove it."
KEY_REMEDIES = {
    "adjacent-phases": f"gas and bulk neighbours: {NEEDS}",
    "reference-state-coverage": f"it belongs to `thermo: {DEPENDENT}`.",
    **dict.fromkeys(STICKING, STICKING_ADVICE),
    "Motz-Wise": f"this correction is for sticking reactions, which need a gas: {NEEDS}",
    **dict.fromkeys(CHARGED, CHARGES),
    "efficiencies": THIRD_BODY_ADVICE,
    "default-efficiency": THIRD_BODY_ADVICE,
    "explicit-third-body-duplicates": THIRD_BODY_ADVICE,
    "skip-undeclared-elements": "species would vanish without a word; write down their elements instead.",
    "skip-undeclared-third-bodies": THIRD_BODY_ADVICE,
    "negative-A": "a negative rate goes on where nothing is left to react; use a positive `A`.",
    "equation-of-state": "a surface species has no volume; remove it.",
    "critical-parameters": "a surface species has no critical point; remove it.",
}
"""Keys that are not supported, each with advice."""
OTHER_MODELS = {
    "edge": "a contact line has rates per length, and a scene has an area; write the reactions on a surface.",
    **dict.fromkeys(GASES, "this is a gas and no surface. Name the phase that is one; the gas may be its neighbour."),
}
"""Phase models that are not plain surfaces, each with advice."""
NEIGHBOURLY = {"sticking": f"a sticking reaction needs a gas beside the surface: {NEEDS}", "electrochemical": CHARGES}
"""Rate types of surfaces with neighbours, by prefix, each with advice."""
GAS_TYPES = _words("three-body falloff chemically-activated pressure-dependent-Arrhenius Chebyshev linear-Burke")
"""Rate types of gases."""

AMOUNT = ("quantity",)
ENERGIES = ("Ea", "Ea0", "w", "E")
"""Energies in rates."""
BARE_UNITS = {
    "site-density": (AMOUNT, "kmol/m^2", "1e-9 mol/m^2"),
    "A": (AMOUNT, "powers of m^2/kmol", "1e8 m^2/mol/s"),
    **dict.fromkeys(ENERGIES, (ENERGY, "J/kmol", "50 kJ/mol")),
    "h0": (AMOUNT, "J/kmol", "-10 kJ/mol"),
    "s0": (AMOUNT, "J/(kmol K)", "50 J/mol/K"),
    "cp0": (AMOUNT, "J/(kmol K)", "30 J/mol/K"),
}
"""Entries whose bare number Cantera counts per kmol: the key of `units` that changes this, the unit, and an example."""
TEMPERATURE_KEYS = ("T", "T0", "T-min", "T-max")
"""Temperatures; Cantera reads degrees Celsius as kelvin without an error."""
POSITIVE = ("site-density", "sites")
"""Numbers that must be positive."""


def has_neighbours(phase: Any) -> bool:
    """True if a surface phase has neighbours."""
    return bool(phase.get("adjacent-phases"))


def _needs_neighbour(kind: str) -> str:
    """Return the reason why a rate type needs a neighbour, with advice; empty if it needs none."""
    plain = kind.removeprefix("interface-")
    return next((text for start, text in NEIGHBOURLY.items() if plain.startswith(start)), "")


def _is_masel(kind: str) -> bool:
    """True if a rate type has a Blowers-Masel coefficient."""
    return kind.endswith("Blowers-Masel")


def _is_foreign(entry: Any) -> bool:
    """True if a reaction has an unknown type, which may belong to another extension."""
    kind = str(entry.get("type", "Arrhenius"))
    known = kind_of(kind) or _is_masel(kind) or _needs_neighbour(kind)
    return "equation" in entry and not known


def is_evaluated(entry: Any, names: Iterable[str], neighbours: bool) -> bool:
    """True if only Cantera can evaluate a reaction's rate.

    ``names`` are the species of the surface, ``neighbours`` is true if the surface has neighbours.
    """
    if "equation" not in entry:
        return False
    reactants, products, _ = sides(str(entry["equation"]))
    outside = neighbours and not {*reactants, *products, *(entry.get("orders") or {})} <= set(names)
    special, kind = any(key in entry for key in (*STICKING, *CHARGED)), str(entry.get("type", ""))
    return outside or special or _is_foreign(entry) or _is_masel(kind) or bool(_needs_neighbour(kind))


def chosen(declared: Any, available: Iterable[str]) -> list[str]:
    """Return the names of the species that a phase declares, including those of whole sections."""
    listed = [] if isinstance(declared, str) else declared
    plain = [str(item) for item in listed if not isinstance(item, Mapping)]
    named = [names for item in listed if isinstance(item, Mapping) for names in item.values()]
    whole = isinstance(declared, str) or "all" in named
    return [*(available if whole else plain), *(str(name) for names in named if names != "all" for name in names)]


class PhaseCheck:
    """Check of a phase of a mechanism against its valid keys and values.

    :meth:`run` raises InputError at the first entry that has no meaning, has another meaning in Cantera, or cannot be
    lowered. With ``evaluate`` reactions of other types are left to Cantera.
    """

    def __init__(self, source: Source, phase: Any, evaluate: bool = False) -> None:
        self.source = source
        self.phase = phase
        self.evaluate = evaluate
        self.has_neighbours = evaluate and has_neighbours(phase)
        self.names: list[str] = []
        """The species of the phase."""

    def run(self) -> None:
        """Check everything that the phase uses."""
        source, phase = self.source, self.phase
        # Sections of other phases of the file are known keys, but are not checked.
        self._keys(source.data, {*FILE, *source.sections}, "the file")
        self._units(source.data)
        self._phase()
        self._all_species(list(source.species(phase)))
        state = phase.get("state")
        if isinstance(state, Mapping):
            self._keys(state, (*STATE_KEYS, *(WRITTEN_STATE if source.written else ())), "state")
            self._numbers(state, ("T",), "state")
            self._among(state.get("coverages"), self.names, "state: coverages: no species")
        for entry in source.reactions(phase):
            if (kind := str(entry.get("type"))) in GAS_TYPES:
                problem = f"rate type '{kind}' depends on pressure, which belongs to gases; give a `rate-constant`."
                raise source.error(f"reaction {entry.get('equation')}: {problem}", entry, "type")
            if self.evaluate and is_evaluated(entry, self.names, self.has_neighbours):
                self._evaluated(entry)
            else:
                self._reaction(entry)

    def _phase(self) -> None:
        phase, error = self.phase, self.source.error
        title, model = f"phase {phase.get('name')}", str(phase.get("thermo"))
        if model in OTHER_MODELS:
            raise error(f"{title}: thermo '{model}' is not lowered: {OTHER_MODELS[model]}", phase, "thermo")
        known = set(PHASE) - (set() if self.has_neighbours else NEIGHBOUR_KEYS)
        self._keys(phase, known - (set() if model == DEPENDENT else {"reference-state-coverage"}), title)
        if model not in SURFACES:
            raise error(f"{title}: thermo '{model}' is not lowered: use `ideal-surface`.", phase, "thermo")
        kinetics = phase.get("kinetics", "surface")
        if kinetics != "surface":
            raise error(f"{title}: kinetics '{kinetics}' is not lowered; use `kinetics: surface`.", phase, "kinetics")
        if "site-density" not in phase:
            message = "the phase has no `site-density`. Give one, for instance `site-density: 1e-9 mol/cm^2`."
            raise error(message, phase)
        self._numbers(phase, ("site-density",), title)
        if self.has_neighbours:
            self._neighbours(phase, ())

    def _neighbours(self, phase: Any, before: tuple[str, ...]) -> None:
        """Refuse a phase that is its own neighbour, or its neighbour's neighbour: Cantera would recurse without end."""
        phases = {str(entry.get("name")): entry for entry in self.source.phases}
        path = (*before, str(phase.get("name")))
        declared = phase.get("adjacent-phases") or ()
        own = [item for item in declared if not isinstance(item, Mapping) or isinstance(item.get("phases"), list)]
        for name in chosen(own, ()):
            if name in path:
                whose = "itself" if name == path[-1] else f"{name}, whose neighbour it is"
                message = f"phase {path[-1]}: adjacent-phases: the phase names {whose}; remove that."
                raise self.source.error(message, phase, "adjacent-phases")
            if name in phases:
                self._neighbours(phases[name], path)

    def _all_species(self, entries: list[Any]) -> None:
        """Check every species; neighbours' species are left to Cantera, unless they lack a name, perhaps by a typo."""
        import cantera

        there = [str(entry.get("name")) for entry in entries]
        self.names = chosen(self.phase.get("species", "all"), there)
        own = [entry for entry in entries if entry.get("name") in self.names]
        for entry in entries:
            if not self.has_neighbours or "name" not in entry or entry in own:
                self._species(entry)
        place = self.source.place(self.phase, "species")
        refuse_unknown(self.names, there, "species: no species '{}'", place)
        # Elements are declared by the phase, or exist; the nearest of all existing ones would be a poor suggestion.
        declared = [str(element.get("symbol")) for element in self.source.data.get("elements") or []]
        elements = self.phase.get("elements", [*cantera.Element.element_symbols, "E", *declared])
        for entry in own if self.has_neighbours else entries:
            title = f"species {entry.get('name')}: composition: no element"
            self._among(entry.get("composition"), elements, title, hint="elements" in self.phase)
        for entry in own:
            self._dependence(entry)

    def _species(self, entry: Any) -> None:
        source, title = self.source, f"species {entry.get('name')}"
        self._keys(entry, set(SPECIES) - (set() if source.written else WRITTEN_SPECIES), title)
        self._units(entry)
        self._numbers(entry, ("sites",), title)
        thermo = entry.get("thermo")
        if not isinstance(thermo, Mapping):
            raise source.error(f"{title} has no `thermo`.", entry)
        model = str(thermo.get("model"))
        if "model" in thermo and model not in THERMO:
            message = f"{title}: thermo model '{model}' is not lowered.{suggestion(model, THERMO)}"
            raise source.error(message, thermo, "model")
        self._keys(thermo, THERMO.get(model, (*CONSTANT_CP, *POLYNOMIAL)), f"{title}: thermo")
        self._numbers(thermo, (*TEMPERATURE_KEYS[1:], "h0", "s0", "cp0"), title, entry)
        bond = entry.get("bond", {})
        self._keys(bond, BOND, f"{title}: bond", source.place(entry, "bond"))
        for key, unit in BOND.items():
            if source.written and isinstance(bond.get(key), int | float) and bond[key]:
                message = f"{title}: bond: {key}: Cantera has written this number without its unit [{unit}]; add it."
                raise source.error(message, bond, key)

    def _dependence(self, entry: Any) -> None:
        """Check that coverage-dependent thermo is given in the form that Cantera reads."""
        dependences, error = entry.get(KEY), self.source.error
        title = f"species {entry.get('name')}: {KEY}"
        if dependences is None:
            return
        if self.phase.get("thermo") != DEPENDENT:
            message = f"{title}: only a phase with `thermo: {DEPENDENT}` reads this; give the phase that, or remove it."
            raise error(message, entry, KEY)
        if not isinstance(dependences, Mapping) or not all(isinstance(x, Mapping) for x in dependences.values()):
            raise error(f"{title}: write `{{species: {{model: linear, enthalpy: ...}}}}`.", entry, KEY)
        self._among(dependences, self.names, f"{title}: no species")
        for name, node in dependences.items():
            self._curve(entry, node, f"{title}: {name}")

    def _curve(self, entry: Any, node: Any, title: str) -> None:
        """Check a dependence of thermo on one coverage: keys of its model, required pairs of keys, units."""
        error, model = self.source.error, str(node.get("model"))
        refuse_unknown([model], MODEL_KEYS, f"{title}: no model '{{}}'", self.source.place(node, "model"))
        groups = CAPACITY_KEYS, *MODEL_KEYS[model]
        self._keys(node, ("model", "units", *chain(*groups)), title)
        given = {**self.source.defaults(entry), **(node.get("units") or {})}
        for key, value in node.items():
            if key.endswith("-coefficients") and (not isinstance(value, list) or len(value) != COEFFICIENTS):
                message = f"{title}: {key} are {COEFFICIENTS} numbers; those that are not there are 0."
                raise error(message, node, key)
            pure = key.endswith(("model", "units", "-change", "-coverages"))
            if not pure and unitless(value, given, AMOUNT):
                remedy = "Say what it counts in, such as `units: {energy: eV, quantity: molec}` beside it."
                raise error(f"{title}: {key} without a unit counts in kmol. {remedy}", node, key)
        for group in groups:
            there, missing = set(group) & set(node), set(group) - set(node)
            if there and missing:
                first, needed = min(there, key=group.index), min(missing, key=group.index)
                raise error(f"{title}: {first} needs `{needed}` too.", node, first)

    def _reaction(self, entry: Any) -> None:
        """Check a reaction that is lowered."""
        title, error = f"reaction {entry.get('equation')}", self.source.error
        own = {kind: {*law.keys, *law.own_keys()} for kind, law in kinds().items()}
        self._keys(entry, {*REACTION}.union(*own.values()), title)
        self._units(entry)
        if "equation" not in entry:
            raise error("a reaction has no `equation`.", entry)
        # First whether any type has the keys, then whether this one does, so that suggestions come from all.
        law = self._rate_type(entry, title)
        for key in entry:
            if key not in {*REACTION, *own[law.kind]}:
                having = ", ".join(sorted(kind for kind, known in own.items() if key in known))
                raise error(f"{title}: '{key}' is no key of {law.kind}; it belongs to {having}.", entry, key)
        known = self._equation(entry, self.names, title)
        for key, inner in law.keys.items():
            if inner and key != KEY and key in entry and not isinstance(entry[key], Mapping):
                raise error(f"{title}: write `{key}: {{{', '.join(inner)}}}`, not {entry[key]!r}.", entry, key)
        self._inside(entry, law.keys, known, title)
        if known:
            self._among(entry.get("orders"), known, f"{title}: orders: no species")
        self._arrhenius(entry, title)

    def _arrhenius(self, entry: Any, title: str) -> None:
        error = self.source.error
        rate = entry.get("rate-constant")
        if not isinstance(rate, Mapping):
            raise error(f"{title} has no `rate-constant: {{A, b, Ea}}`.", entry)
        if leading(rate.get("A")) < 0:
            raise error(f"{title}: 'A' is negative: {KEY_REMEDIES['negative-A']}", rate, "A")
        self._coefficients(entry, title)

    def _coefficients(self, entry: Any, title: str) -> None:
        """Check that the numbers of a rate coefficient, and of a sticking coefficient, have units."""
        orders = {**sides(str(entry["equation"]))[0], **(entry.get("orders") or {})}
        # At first order A is in 1/s in any units; with an exchange current it is a current, and sticking coefficients
        # are pure.
        plain = sum(map(leading, orders.values())) == 1 or bool(entry.get("exchange-current-density-formulation"))
        for key, pure in (("rate-constant", plain), ("sticking-coefficient", True)):
            if isinstance(rate := entry.get(key), Mapping):
                self._numbers(rate, MASEL[2:] + ARRHENIUS[2 if pure else 0 :], title, entry)

    def _rate_type(self, entry: Any, title: str) -> type[InterfaceArrhenius]:
        """Return the rate type, which Cantera writes with or without its prefix; Arrhenius needs no type."""
        kind = str(entry.get("type", "Arrhenius"))
        law = kind_of(kind)
        if reason := _needs_neighbour(kind):
            problem = f": {reason}"
        elif law is None:
            problem = f" is not lowered.{suggestion(kind, names())} {LEAVE}"
        else:
            return law
        raise self.source.error(f"{title}: rate type '{kind}'{problem}", entry, "type")

    def _evaluated(self, entry: Any) -> None:
        """Refuse entries that Cantera would ignore in a reaction that it evaluates, except keys of other extensions."""
        title = f"reaction {entry['equation']}"
        law = kind_of(str(entry.get("type", "Arrhenius")))
        if law is not None and not law.native:
            kind = entry["type"]
            message = f"{title}: a rate of type '{kind}' belongs to surface species; this one has a neighbour's."
            raise self.source.error(message, entry, "type")
        # Another extension has unknown keys.
        if not _is_foreign(entry):
            inner: dict[str, tuple[str, ...]] = {**InterfaceArrhenius.keys, **STICKING, **CHARGED}
            if _is_masel(str(entry.get("type"))):
                inner |= dict.fromkeys(("rate-constant", "sticking-coefficient"), MASEL)
            self._keys(entry, {*REACTION, *inner}, title)
            self._inside(entry, inner, self.names, title)
            self._coefficients(entry, title)
        self._equation(entry, [] if self.has_neighbours else self.names, title)

    def _equation(self, entry: Any, known: list[str], title: str) -> list[str]:
        """Check an equation and return the species that the reaction may name.

        None are ``known`` if the reaction is left out, because the phase takes only reactions of its species.
        """
        reactants, products, _ = sides(str(entry["equation"]))
        named = (*reactants, *products)
        unknown = [name for name in named if known and name not in known]
        problem = ""
        if third := [name for name in named if name.strip("(+)") == "M"]:
            problem = f"third bodies belong to gases; remove '{third[0]}'."
        elif not reactants or not products:
            problem = "an equation has two sides with `<=>` or `=>` between them."
        elif unknown and self.phase.get("reactions", "all") == "declared-species":
            return []
        elif unknown:
            problem = f"no species '{unknown[0]}'.{suggestion(unknown[0], known)}"
        elif reactants == products:
            problem = "both sides are the same, so that nothing changes."
        if problem:
            raise self.source.error(f"{title}: {problem}", entry, "equation")
        return known

    def _inside(self, entry: Any, inner: Mapping[str, Iterable[str]], known: list[str], title: str) -> None:
        """Check the keys inside the entries of a rate: coefficients, and dependences on coverages by species."""
        for key, allowed in inner.items():
            node = entry.get(key)
            if not isinstance(node, Mapping):
                continue
            if key != KEY and allowed:
                self._keys(node, allowed, f"{title}: {key}")
            elif key == KEY:
                self._among(node, known or node, f"{title}: {KEY}: no species")
                for name, terms in node.items():
                    if isinstance(terms, Mapping):
                        self._keys(terms, allowed, f"{title}: {KEY}: {name}")
                        self._numbers(terms, ("E",), title, entry)
                    elif isinstance(terms, list):  # Cantera's short form
                        self._numbers(dict(zip(allowed, terms, strict=False)), ("E",), title, entry, (node, name))

    def _keys(self, node: Any, known: Iterable[str], title: str, place: Place | None = None) -> None:
        """Check that every key of a mapping is known."""
        if not isinstance(node, Mapping):
            raise InputError(f"{title} is not a mapping: {node!r}.", place or Place(self.source.file))
        allowed = set(known)
        for key in node:
            if key in KEY_REMEDIES and key not in allowed:
                raise self.source.error(f"{title}: '{key}' cannot be used here: {KEY_REMEDIES[key]}", node, key)
        self._among(node, allowed, f"{title}: unknown key")

    def _among(self, node: Any, known: Collection[str], problem: str, hint: bool = True) -> None:
        """Check that every key of a node, if it is a mapping, is known; with ``hint`` suggest the nearest known key."""
        for name in node if isinstance(node, Mapping) else ():
            if name not in known:
                guess = suggestion(str(name), known) if hint else ""
                raise self.source.error(f"{problem} '{name}'.{guess}", node, name)

    def _units(self, node: Any) -> None:
        """Check that the `units` of an entry are existing dimensions and units."""
        import cantera

        given, error = node.get("units"), self.source.error
        if given is None:
            return
        self._among(given, UNIT_DIMENSIONS, "units: unknown key")
        for key, unit in given.items():
            if key == "temperature" and unit != "K":
                raise error(f"units: temperatures are in K, not in {unit}.", given, key)
            try:
                cantera.UnitSystem({key: str(unit)})  # type: ignore[arg-type]
            except cantera.CanteraError:
                raise error(f"units: {key}: '{unit}' is no unit of it that Cantera knows.", given, key) from None

    def _numbers(
        self, node: Any, keys: Iterable[str], title: str, entry: Any = None, at: tuple[Any, str] | None = None
    ) -> None:
        """Check that numbers of a mapping, if present, mean what Cantera reads: in kelvin, positive, with units.

        Errors are placed ``at`` another entry if the mapping is not in the file.
        """
        for key in filter(node.__contains__, keys):
            value, (wanted, unit, example), problem = node[key], BARE_UNITS.get(key, ((), "", "")), ""
            celsius = isinstance(value, str) and value.split()[-1:] != ["K"]
            if key in TEMPERATURE_KEYS and value is not None and (celsius or not leading(value) > 0):
                problem = f"'{value}' is no temperature above zero in kelvin; write `{key}: 298.15 K`."
            elif key in POSITIVE and not leading(value) > 0:
                problem = f"{value!r} is no number above zero."
            elif wanted and (number := unitless(value, self.source.defaults(entry), wanted)):
                said = "say at the top `units: {quantity: mol, activation-energy: kJ/mol}`"
                remedy = f"Write it with its unit, such as `{key}: {example}`, or {said}."
                problem = f"{number:g} without a unit counts in {unit}. {remedy}"
            elif key in ENERGIES:
                problem = self._energy(value, entry)
            if problem:
                raise self.source.error(f"{title}: {key}: {problem}", *(at or (node, key)))

    def _energy(self, value: Any, entry: Any) -> str:
        """Return the defect of an energy of a rate, or of one of several, in words; Cantera refuses invalid texts."""
        import cantera

        declared: Any = self.source.defaults(entry)
        units = cantera.UnitSystem(declared)
        for one in value if isinstance(value, list) else [value]:
            try:
                converted(units, one, "J/mol")
            except InputError as error:
                return error.message
            except (cantera.CanteraError, TypeError, ValueError):
                continue
        return ""
