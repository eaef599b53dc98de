"""What a mechanism file may hold. Cantera ignores what it does not know; here it is an error with its line.

Below are the tables of keys, of what Cantera knows and the compiled path does not, with the way out, and of entries
whose bare number Cantera would misread. :class:`Check` holds a file against them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from surfacechem.errors import InputError, Place, suggestion
from surfacechem.mechanism.interaction import CAPACITY, COEFFICIENTS, CURVES, DEPENDENT, KEY, TOGETHER
from surfacechem.mechanism.rate_types import kind_of, kinds, names
from surfacechem.mechanism.rates import InterfaceArrhenius
from surfacechem.mechanism.source import Source, chosen, sections, sides
from surfacechem.mechanism.values import leading


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


FILE = _words(
    "description generator date input-files cantera-version git-commit note units phases species reactions elements "
    "extensions"
)
PHASE = _words("name elements species thermo kinetics reactions site-density state transport note description")
STATE = _words("T P coverages")
SPECIES = _words("name composition thermo sites bond units note description transport coverage-dependencies")
REACTION = _words("equation type orders negative-orders nonreactant-orders duplicate units id note description")
CONSTANT_CP = _words("model T0 h0 s0 cp0 T-min T-max reference-pressure note")
POLYNOMIAL = _words("model temperature-ranges data reference-pressure note")
THERMO = {"constant-cp": CONSTANT_CP, "NASA7": POLYNOMIAL, "NASA9": POLYNOMIAL, "Shomate": POLYNOMIAL}
BOND = {"stiffness": "N/m", "rest-length": "m"}
"""Keys of the elasticity of a bond with the units they have."""
WRITTEN_SPECIES, WRITTEN_STATE = _words("size charge"), _words("X Y")
"""Keys that Cantera writes beside those that it documents; the state of a file is not used."""
BESIDE = _words("adjacent-phases skip-undeclared-elements Motz-Wise")
"""Keys of a phase with neighbours; all elements of its species have to be declared in any case."""
UNITS = _words("length mass time quantity current temperature pressure energy activation-energy")
"""Dimensions for which a file may say what a bare number means."""

ARRHENIUS = ("A", "b", "Ea")
STICKING: Mapping[str, tuple[str, ...]] = {
    "sticking-coefficient": ARRHENIUS,
    "Motz-Wise": (),
    "sticking-species": (),
    "sticking-order": (),
}
"""Keys of sticking reactions, with the keys inside."""
CHARGED: Mapping[str, tuple[str, ...]] = {"beta": (), "exchange-current-density-formulation": ()}
"""Keys of reactions that carry charge from one phase to another."""

LEAVE = "With `solver: cantera` under `run` Cantera evaluates it."
"""The way out for what is not lowered."""
NEEDS = f"the compiled path knows surface species only. {LEAVE[:-1]}, with the neighbours held as the case says."
"""The way out for what needs phases beside the surface."""
STICKS = f"a sticking reaction needs a gas: {NEEDS}"
CHARGES = f"charge transfer needs a neighbour at an electric potential: {NEEDS}"
OF_GASES = "third bodies belong to gases; remove it."
REMEDIES = {
    "adjacent-phases": f"gas and bulk neighbours: {NEEDS}",
    "reference-state-coverage": f"it belongs to `thermo: {DEPENDENT}`.",
    **dict.fromkeys(STICKING, STICKS),
    "Motz-Wise": f"this correction is for sticking reactions, which need a gas: {NEEDS}",
    **dict.fromkeys(CHARGED, CHARGES),
    "efficiencies": OF_GASES,
    "default-efficiency": OF_GASES,
    "explicit-third-body-duplicates": OF_GASES,
    "skip-undeclared-elements": "species would vanish without a word; write down their elements instead.",
    "skip-undeclared-third-bodies": OF_GASES,
    "negative-A": "a negative rate goes on where nothing is left to react; use a positive `A`.",
    "equation-of-state": "a surface species has no volume; remove it.",
    "critical-parameters": "a surface species has no critical point; remove it.",
}
"""Keys that are not for here, with the way out."""
MODELS = {"edge": "a contact line has rates per length, and a scene has an area; write the reactions on a surface."}
"""Phase models that are not plain surfaces, with the way out."""
NEIGHBOURLY = {"sticking": f"a sticking reaction needs a gas beside the surface: {NEEDS}", "electrochemical": CHARGES}
"""Rate types, by how they begin, of surfaces with neighbours, with the way out."""
PRESSURE = ("three-body", "falloff", "chemically-activated", "pressure-dependent-Arrhenius", "Chebyshev")
"""Rate types of gases."""

AMOUNT, ENERGY = ("quantity",), ("activation-energy", "quantity")
BARE = {
    "site-density": (AMOUNT, "kmol/m^2", "1e-9 mol/m^2"),
    "A": (AMOUNT, "powers of m^2/kmol", "1e8 m^2/mol/s"),
    "Ea": (ENERGY, "J/kmol", "50 kJ/mol"),
    "E": (ENERGY, "J/kmol", "50 kJ/mol"),
    "h0": (AMOUNT, "J/kmol", "-10 kJ/mol"),
    "s0": (AMOUNT, "J/(kmol K)", "50 J/mol/K"),
    "cp0": (AMOUNT, "J/(kmol K)", "30 J/mol/K"),
}
"""Entries whose bare number Cantera counts per kmol: what in `units` says otherwise, the unit, and an example."""
OWN = {
    "m": (("length",), "0.4 nm"),
    "N/m": (("length",), "1 pN/nm"),
    "J": (ENERGY, "10 kJ/mol"),
    "J/mol": (ENERGY, "50 kJ/mol"),
}
"""Units of numbers that Cantera does not read: what in `units` gives a bare one a meaning, and an example."""


def has_neighbours(phase: Any) -> bool:
    """Whether a surface phase has others beside it."""
    return bool(phase.get("adjacent-phases"))


def _needs_neighbour(kind: str) -> str:
    """Why a rate type needs a neighbour, and the way out; empty where it needs none."""
    plain = kind.removeprefix("interface-")
    return next((text for start, text in NEIGHBOURLY.items() if plain.startswith(start)), "")


def _is_foreign(entry: Any) -> bool:
    """Whether a reaction is of a type that is not known here, but may be one of Cantera's or of another extension."""
    kind = str(entry.get("type", "Arrhenius"))
    return "equation" in entry and kind_of(kind) is None and kind not in PRESSURE and not _needs_neighbour(kind)


def is_evaluated(entry: Any, names: Iterable[str], beside: bool) -> bool:
    """Whether only Cantera can say how fast a reaction is; ``beside`` tells whether the surface has neighbours.

    ``names`` are the species of the surface.
    """
    if "equation" not in entry:
        return False
    reactants, products, _ = sides(str(entry["equation"]))
    outside = beside and not {*reactants, *products, *(entry.get("orders") or {})} <= set(names)
    special = any(key in entry for key in (*STICKING, *CHARGED))
    return outside or special or _is_foreign(entry) or bool(_needs_neighbour(str(entry.get("type", ""))))


class Check:
    """A phase of a mechanism, held against what it may hold.

    :meth:`run` raises InputError at the first entry that means nothing, means something else, or cannot be lowered.
    With ``evaluate`` reactions of other types are left to Cantera.
    """

    def __init__(self, source: Source, phase: Any, evaluate: bool = False) -> None:
        self.source = source
        self.phase = phase
        self.evaluate = evaluate
        self.beside = evaluate and has_neighbours(phase)
        self.names: list[str] = []
        """The species of the phase."""

    def run(self) -> None:
        """Check all that the phase uses."""
        source, phase = self.source, self.phase
        parts = ((part, key) for part in source.phases for key in ("species", "reactions"))
        declared = {name for part, key in parts for name in sections(part.get(key, "all"), key)}
        self._keys(source.data, FILE | declared, "the file")
        self._units(source.data)
        self._phase()
        self._all_species(list(source.species(phase)))
        state = phase.get("state")
        if isinstance(state, Mapping):
            self._keys(state, STATE | (WRITTEN_STATE if source.written else set()), "state")
            self._kelvin(state, "T", "state")
            self._known(state.get("coverages"), self.names, "state: coverages")
        for entry in source.reactions(phase):
            if self.evaluate and is_evaluated(entry, self.names, self.beside):
                self._evaluated(entry)
            else:
                self._reaction(entry)

    def _all_species(self, entries: list[Any]) -> None:
        """Every species; those of neighbours are Cantera's affair, but one without a name may be a misspelt one."""
        known = [str(entry.get("name")) for entry in entries]
        self.names = chosen(self.phase.get("species", "all"), known)
        own = [entry for entry in entries if entry.get("name") in self.names]
        for entry in entries:
            if not self.beside or "name" not in entry or entry["name"] in self.names:
                self._species(entry)
        for name in self.names:
            if name not in known:
                message = f"species: no species '{name}'.{suggestion(name, known)}"
                raise self.source.error(message, self.phase, "species")
        for entry in own if self.beside else entries:
            self._composition(entry)
        for entry in own:
            self._dependence(entry)

    def _phase(self) -> None:
        phase, error = self.phase, self.source.error
        title, model = f"phase {phase.get('name')}", str(phase.get("thermo"))
        if model in MODELS:
            raise error(f"{title}: thermo '{model}' is not lowered: {MODELS[model]}", phase, "thermo")
        more = {"reference-state-coverage"} if model == DEPENDENT else set()
        self._keys(phase, PHASE | more | (BESIDE if self.beside else set()), title)
        if model not in ("ideal-surface", DEPENDENT):
            raise error(f"{title}: thermo '{model}' is not lowered: use `ideal-surface`.", phase, "thermo")
        kinetics = phase.get("kinetics", "surface")
        if kinetics != "surface":
            raise error(f"{title}: kinetics '{kinetics}' is not lowered; use `kinetics: surface`.", phase, "kinetics")
        if "site-density" not in phase:
            message = "the phase has no `site-density`. Give one, for instance `site-density: 1e-9 mol/cm^2`."
            raise error(message, phase)
        self._positive(phase, "site-density", title)
        self._bare(phase, "site-density", title)

    def _species(self, entry: Any) -> None:
        source, title = self.source, f"species {entry.get('name')}"
        self._keys(entry, SPECIES | (WRITTEN_SPECIES if source.written else set()), title)
        self._units(entry)
        self._positive(entry, "sites", title)
        thermo = entry.get("thermo")
        if not isinstance(thermo, Mapping):
            raise source.error(f"{title} has no `thermo`.", entry)
        model = str(thermo.get("model"))
        if "model" in thermo and model not in THERMO:
            message = f"{title}: thermo model '{model}' is not lowered.{suggestion(model, THERMO)}"
            raise source.error(message, thermo, "model")
        self._keys(thermo, THERMO.get(model, CONSTANT_CP | POLYNOMIAL), f"{title}: thermo")
        for key in ("T0", "T-min", "T-max"):
            self._kelvin(thermo, key, title)
        for key in ("h0", "s0", "cp0"):
            self._bare(thermo, key, title, entry)
        if "bond" not in entry:
            return
        title, bond = f"{title}: bond", entry["bond"]
        self._keys(bond, BOND, title, source.place(entry, "bond"))
        if "stiffness" not in bond:
            raise source.error(f"{title} needs `stiffness`: stiffness of the bond [N/m].", entry, "bond")
        for key, unit in BOND.items():
            self._own_number(bond, key, title, unit, entry)
            if source.written and isinstance(bond.get(key), int | float) and bond[key]:
                message = f"{title}: {key}: Cantera has written this number without its unit [{unit}]; add it."
                raise source.error(message, bond, key)

    def _composition(self, entry: Any) -> None:
        import cantera

        own = [str(element.get("symbol")) for element in self.source.data.get("elements") or []]
        known = self.phase.get("elements", [*cantera.Element.element_symbols, "E", *own])
        for element in entry.get("composition") or {}:
            if element not in known:
                guess = suggestion(str(element), known) if "elements" in self.phase else ""
                message = f"species {entry.get('name')}: composition: no element '{element}'.{guess}"
                raise self.source.error(message, entry["composition"], element)

    def _dependence(self, entry: Any) -> None:
        """Thermo that depends on coverages is what Cantera takes it for."""
        node, error = entry.get(KEY), self.source.error
        title = f"species {entry.get('name')}: {KEY}"
        if node is None:
            return
        if self.phase.get("thermo") != DEPENDENT:
            message = f"{title}: only a phase with `thermo: {DEPENDENT}` reads this; give the phase that, or remove it."
            raise error(message, entry, KEY)
        if not isinstance(node, Mapping) or not all(isinstance(inner, Mapping) for inner in node.values()):
            raise error(f"{title}: write `{{species: {{model: linear, enthalpy: ...}}}}`.", entry, KEY)
        self._known(node, self.names, title)
        for name, inner in node.items():
            self._one_dependence(entry, inner, f"{title}: {name}")
            self._together(inner, f"{title}: {name}")

    def _one_dependence(self, entry: Any, node: Any, title: str) -> None:
        error, model = self.source.error, str(node.get("model"))
        if model not in CURVES:
            raise error(f"{title}: no model '{model}'.{suggestion(model, CURVES)}", node, "model")
        known = ("model", "units", *CURVES[model], *CAPACITY)
        given = {**self.source.defaults(entry), **(node.get("units") or {})}
        for key, value in node.items():
            if key not in known:
                raise error(f"{title}: unknown key '{key}'.{suggestion(str(key), known)}", node, key)
            if key.endswith("-coefficients") and (not isinstance(value, list) or len(value) != COEFFICIENTS):
                message = f"{title}: {key} are {COEFFICIENTS} numbers; those that are not there are 0."
                raise error(message, node, key)
            pure = key in ("model", "units") or key.endswith(("-change", "-coverages"))
            if not pure and self._unitless(node, key, given, AMOUNT):
                message = (
                    f"{title}: {key} without a unit counts in kmol. Say what it counts in, such as "
                    "`units: {energy: eV, quantity: molec}` beside it."
                )
                raise error(message, node, key)

    def _together(self, node: Any, title: str) -> None:
        """Keys that need each other."""
        for group in TOGETHER:
            missing = set(group) - set(node)
            if missing and len(missing) < len(group):
                first, needed = (next(key for key in group if (key in missing) == lacks) for lacks in (False, True))
                raise self.source.error(f"{title}: {first} needs `{needed}` too.", node, first)

    def _reaction(self, entry: Any) -> None:
        title = f"reaction {entry.get('equation')}"
        self._keys(entry, REACTION.union(*map(_own, kinds().values())), title)
        self._units(entry)
        if "equation" not in entry:
            raise self.source.error("a reaction has no `equation`.", entry)
        law = self._rate_type(entry, title)
        for key in entry:
            if key not in REACTION | _own(law):
                having = ", ".join(sorted(kind for kind, other in kinds().items() if key in _own(other)))
                message = f"{title}: '{key}' is no key of {law.kind}; it belongs to {having}."
                raise self.source.error(message, entry, key)
        known = self._equation(entry, self.names, title)
        for key, inner in law.keys.items():
            if inner and key != KEY and key in entry and not isinstance(entry[key], Mapping):
                message = f"{title}: write `{key}: {{{', '.join(inner)}}}`, not {entry[key]!r}."
                raise self.source.error(message, entry, key)
        self._inside(entry, law.keys, known, title)
        if known:
            self._known(entry.get("orders"), known, f"{title}: orders")
        if "rate-constant" in law.keys:
            self._arrhenius(entry, title)
        specs = dict(law.specs())
        for key, name in law.own_keys().items():
            self._own_number(entry, key, title, specs[name].unit, entry)

    def _rate_type(self, entry: Any, title: str) -> type[InterfaceArrhenius]:
        """The rate type, which Cantera writes with or without its prefix; a plain rate needs none."""
        kind = str(entry.get("type", "Arrhenius"))
        law = kind_of(kind)
        if kind in PRESSURE:
            problem = " depends on pressure, which belongs to gases; give a `rate-constant`."
        elif reason := _needs_neighbour(kind):
            problem = f": {reason}"
        elif law is None:
            problem = f" is not lowered.{suggestion(kind, names())} {LEAVE}"
        else:
            return law
        raise self.source.error(f"{title}: rate type '{kind}'{problem}", entry, "type")

    def _evaluated(self, entry: Any) -> None:
        """What Cantera would ignore in a reaction that it evaluates; what another extension reads is its own affair."""
        title = f"reaction {entry['equation']}"
        known: list[str] = [] if self.beside else self.names
        law = kind_of(str(entry.get("type", "Arrhenius")))
        if law is not None and not law.native:
            kind = entry["type"]
            message = f"{title}: a rate of type '{kind}' belongs to surface species; this one has a neighbour's."
            raise self.source.error(message, entry, "type")
        if not _is_foreign(entry):
            inner = {**InterfaceArrhenius.keys, **STICKING, **CHARGED}
            self._keys(entry, {*REACTION, *inner}, title)
            self._inside(entry, inner, self.names, title)
        self._equation(entry, known, title)

    def _equation(self, entry: Any, known: list[str], title: str) -> list[str]:
        """The species that the reaction may name: none are ``known`` where it is left out, because the phase takes only
        those of its own species.
        """
        error = self.source.error
        reactants, products, _ = sides(str(entry["equation"]))
        for name in (*reactants, *products):
            if name.strip("(+)") == "M":
                raise error(f"{title}: third bodies belong to gases; remove '{name}'.", entry, "equation")
        if not reactants or not products:
            message = f"{title}: an equation has two sides with `<=>` or `=>` between them."
            raise error(message, entry, "equation")
        unknown = [name for name in (*reactants, *products) if known and name not in known]
        if unknown and self.phase.get("reactions", "all") == "declared-species":
            return []
        if unknown:
            raise error(f"{title}: no species '{unknown[0]}'.{suggestion(unknown[0], known)}", entry, "equation")
        if reactants == products:
            raise error(f"{title}: both sides are the same, so that nothing changes.", entry, "equation")
        return known

    def _inside(self, entry: Any, inner: Mapping[str, Iterable[str]], known: list[str], title: str) -> None:
        """The keys inside those of a rate, which are coefficients, and dependences on coverages by species."""
        for key, allowed in inner.items():
            node = entry.get(key)
            if key != KEY and allowed and isinstance(node, Mapping):
                self._keys(node, allowed, f"{title}: {key}")
            elif key == KEY and isinstance(node, Mapping):
                self._known(node, known or node, f"{title}: {KEY}")
                for name, terms in node.items():
                    if isinstance(terms, Mapping):
                        self._keys(terms, allowed, f"{title}: {KEY}: {name}")
                        self._bare(terms, "E", title, entry)

    def _arrhenius(self, entry: Any, title: str) -> None:
        rate = entry.get("rate-constant")
        if not isinstance(rate, Mapping):
            raise self.source.error(f"{title} has no `rate-constant: {{A, b, Ea}}`.", entry)
        if leading(rate.get("A")) < 0:
            raise self.source.error(f"{title}: 'A' is negative: {REMEDIES['negative-A']}", rate, "A")
        orders = {**sides(str(entry["equation"]))[0], **(entry.get("orders") or {})}
        if sum(map(leading, orders.values())) != 1:  # of first order it is a frequency, in 1/s whatever the units
            self._bare(rate, "A", title, entry)
        self._bare(rate, "Ea", title, entry)

    def _keys(self, node: Any, known: Iterable[str], title: str, place: Place | None = None) -> None:
        """Every key of a mapping is known."""
        if not isinstance(node, Mapping):
            raise InputError(f"{title} is not a mapping: {node!r}.", place or Place(self.source.file))
        allowed = set(known)
        for key in node:
            if key in REMEDIES and key not in allowed:
                raise self.source.error(f"{title}: '{key}' cannot be used here: {REMEDIES[key]}", node, key)
            if key not in allowed:
                raise self.source.error(f"{title}: unknown key '{key}'.{suggestion(str(key), allowed)}", node, key)

    def _known(self, node: Any, known: Iterable[str], title: str) -> None:
        """Every key of what may be a mapping is a species."""
        for name in node if isinstance(node, Mapping) else ():
            if name not in known:
                message = f"{title}: no species '{name}'.{suggestion(str(name), known)}"
                raise self.source.error(message, node, name)

    def _units(self, node: Any) -> None:
        """The `units` of an entry are dimensions and units that exist."""
        import cantera

        given = node.get("units") if isinstance(node, Mapping) else None
        if given is None:
            return
        if not isinstance(given, Mapping):
            message = f"units: a mapping such as {{length: m, quantity: mol}}, not {given!r}."
            raise self.source.error(message, node)
        for key, unit in given.items():
            if key not in UNITS:
                raise self.source.error(f"units: unknown key '{key}'.{suggestion(str(key), UNITS)}", given, key)
            if key == "temperature" and unit != "K":
                raise self.source.error(f"units: temperatures are in K, not in {unit}.", given, key)
            try:
                cantera.UnitSystem({key: str(unit)})  # type: ignore[arg-type]
            except cantera.CanteraError:
                message = f"units: {key}: '{unit}' is no unit of it that Cantera knows."
                raise self.source.error(message, given, key) from None

    def _unitless(self, node: Any, key: str, given: Mapping[str, Any], wanted: tuple[str, ...]) -> float:
        """The first number other than zero without a unit; zero where ``given`` has a ``wanted`` dimension for it."""
        numbers = node.get(key) if isinstance(node.get(key), list) else [node.get(key)]
        bare = [] if any(item in given for item in wanted) else [x for x in numbers if isinstance(x, int | float)]
        return next(filter(None, bare), 0)

    def _bare(self, node: Any, key: str, title: str, entry: Any = None) -> None:
        """A number that Cantera would count per kmol has a unit."""
        wanted, unit, example = BARE[key]
        if number := self._unitless(node, key, self.source.defaults(entry), wanted):
            message = (
                f"{title}: {key}: {number:g} without a unit counts in {unit}. Write it with its unit, such as "
                f"`{key}: {example}`, or say at the top `units: {{quantity: mol, activation-energy: kJ/mol}}`."
            )
            raise self.source.error(message, node, key)

    def _own_number(self, node: Any, key: str, title: str, unit: str, entry: Any) -> None:
        """A length, stiffness or energy that Cantera does not read has a unit."""
        wanted, example = OWN.get(unit, ((), ""))
        number = self._unitless(node, key, self.source.defaults(entry), wanted) if wanted else 0
        if number:
            message = (
                f"{title}: {key}: {number:g} has no unit, and `units` says nothing about it; write it in {unit}, "
                f"such as `{key}: {example}`."
            )
            raise self.source.error(message, node, key)

    def _positive(self, node: Any, key: str, title: str) -> None:
        """A number that is there is above zero."""
        if key in node and not leading(node[key]) > 0:
            raise self.source.error(f"{title}: {key}: {node[key]!r} is no number above zero.", node, key)

    def _kelvin(self, node: Any, key: str, title: str) -> None:
        """A temperature is in kelvin: Cantera reads degrees Celsius as such without a word."""
        value = node.get(key)
        other = isinstance(value, str) and value.split()[-1:] != ["K"]
        if value is not None and (other or not leading(value) > 0):
            message = f"{title}: {key}: '{value}' is no temperature above zero in kelvin; write `{key}: 298.15 K`."
            raise self.source.error(message, node, key)


def _own(law: type[InterfaceArrhenius]) -> set[str]:
    """Keys that a reaction has because of its rate type."""
    return {*law.keys, *law.own_keys()}
