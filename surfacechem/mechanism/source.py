"""The text of a mechanism file with the line of every entry, the entries of a phase, and numbers that Cantera ignores.

Cantera converts the numbers that it reads; this module converts those of this package, such as the length of a bond.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import MISSING, fields, replace
from difflib import get_close_matches
from functools import lru_cache
from math import inf
from typing import Any

from surfacechem.contracts.terms import Law, Spec
from surfacechem.documents import document
from surfacechem.documents.document import Limits, Tree
from surfacechem.errors import InputError, Place, refuse_unknown, suggestion
from surfacechem.quantities import AVOGADRO, KILO

MECHANISM_LIMITS = Limits(largest=10_000_000, most=200_000)
"""Size limits of a mechanism, which may be that of a large gas next to the surface."""

ARROWS = ("<=>", "=>", "=")
"""Arrows between the sides of an equation; only the second is irreversible."""

DEPENDENT = "coverage-dependent-surface"
SURFACES = ("ideal-surface", DEPENDENT)
"""Phase models that are lowered; only in the second does thermo depend on coverages."""

YAML_WRITER = "YamlWriter"
"""Generator name in the files that Cantera writes."""

CANTERA_UNITS = {"length": "m", "quantity": "kmol", "energy": "J", "activation-energy": "J/kmol"}
"""Units of numbers in such a file unless it states others."""

ENERGY = ("activation-energy", "quantity")
OWN_UNITS = {
    "m": (("length",), "0.4 nm"),
    "N/m": (("length",), "1 pN/nm"),
    "J": (ENERGY, "10 kJ/mol"),
    "J/mol": (ENERGY, "50 kJ/mol"),
}
"""Units of numbers that Cantera does not read: the keys of `units` that give a bare number its unit, and an example."""

LARGEST_NUMBERS = {
    "m": (1e-5, "a length", "0.4 nm"),
    "J": (1e7 / AVOGADRO, "an energy", "50 kJ/mol"),
    "J/mol": (1e7, "an energy", "50 kJ/mol"),
}
"""Largest plausible numbers for a molecule, even a tether, by unit, each with its kind and an example."""

NUMBER, NAME, MAPPING, LIST = (int, float), (str, int, float), (dict,), (list,)

Kinds = Mapping[str, tuple[type, ...]]


def _any(keys: str) -> Kinds:
    return dict.fromkeys(keys.split(), ())


FILE: Kinds = {
    "units": MAPPING,
    **dict.fromkeys(("phases", "elements"), LIST),
    **_any("description generator date input-files cantera-version git-commit note species reactions extensions"),
}
PHASE: Kinds = {
    "name": NAME,
    "thermo": (str,),
    "species": (str, list),
    "reactions": (str, list),
    "elements": LIST,
    "state": MAPPING,
    "adjacent-phases": LIST,
    "site-density": NAME,
    "reference-state-coverage": NUMBER,
    **_any("kinetics transport skip-undeclared-elements Motz-Wise note description"),
}
SPECIES: Kinds = {
    "units": MAPPING,
    "name": NAME,
    "thermo": (str, dict),
    "composition": MAPPING,
    "bond": MAPPING,
    **dict.fromkeys(("sites", "size", "charge"), NUMBER),
    **_any("transport coverage-dependencies note description"),
}
REACTION: Kinds = {
    "units": MAPPING,
    "equation": (str,),
    "type": (str,),
    "orders": MAPPING,
    "coverage-dependencies": MAPPING,
    "duplicate": (bool,),
    "id": NAME,
    **_any("negative-orders nonreactant-orders note description"),
}
"""Keys of an entry, each with the allowed types of its value if these matter before Cantera reads it.

Some keys are for one kind of file or phase only; those of rate types are in their classes: see
:mod:`surfacechem.mechanism.keys`.
"""

KIND_WORDS = {dict: "a mapping", list: "a list", str: "a text", float: "a number", bool: "true or false"}


class Mapped(dict[str, Any]):
    """A mapping of the file as plain data, with its tree, which has the places."""

    def __init__(self, tree: Tree) -> None:
        super().__init__((key, _placed(child)) for key, child in tree.value.items())
        self.tree = tree


class Listed(list[Any]):
    """A list of the file as plain data, with its tree, which has the places."""

    def __init__(self, tree: Tree) -> None:
        super().__init__(map(_placed, tree.value))
        self.tree = tree


def _placed(tree: Tree) -> Any:
    """Return a value with places for its mappings and lists."""
    kinds: Mapping[type, Any] = {dict: Mapped, list: Listed}
    made = kinds.get(type(tree.value))
    return made(tree) if made else tree.value


@lru_cache(maxsize=16)  # runs, sweeps and tables read the same file repeatedly
def _parsed(text: str, file: str) -> Tree:
    return document.build(text, file, MECHANISM_LIMITS)


class Source:
    """The text of a mechanism with the place of every entry."""

    def __init__(self, file: str, text: str) -> None:
        self.file = file
        self.text = text
        self.data = _placed(_parsed(text, file))
        if not isinstance(self.data, Mapped):
            raise InputError("a mechanism is a mapping with `phases`, `species` and `reactions`.", Place(file))
        self._check(self.data, FILE)
        self.phases = self._entry_list("phases", PHASE)
        self._entry_list("elements", {})
        parts = ((phase, key) for phase in self.phases for key in ("species", "reactions"))
        self.sections = {name for phase, key in parts for name in sections(phase.get(key, "all"), key)}
        """Names of the sections of species and reactions that some phase of the file uses."""
        self.written = str(self.data.get("generator")) == YAML_WRITER
        """True if Cantera has written the file."""

    def place(self, node: Any, key: Any = None, path: str = "") -> Place:
        """Return the place of a mapping or list, or of one of its entries."""
        if not isinstance(node, Mapped | Listed):
            return Place(self.file, 0, path)
        inside: Mapping[Any, Tree] = node.tree.value if isinstance(node, Mapped) else dict(enumerate(node.tree.value))
        # A missing entry is reported at its parent.
        return replace(inside.get(key, node.tree).place, path=path)

    def error(self, message: str, node: Any, key: Any = None) -> InputError:
        """Return an error at a mapping or list of the file, or at one of its entries."""
        return InputError(message, self.place(node, key))

    def number(self, entry: Any, node: Any, key: str, spec: Spec, title: str = "") -> float:
        """Return a number that Cantera does not read, in its SI unit; a bare one has the unit of the file."""
        import cantera

        value, (wanted, example) = node[key], OWN_UNITS.get(spec.unit, ((), ""))
        declared: Any = self.defaults(entry)
        if isinstance(value, bool) or not isinstance(value, str | int | float):
            raise self.error(f"{title}{key} must be a number, not {value!r}.", node, key)
        if wanted and unitless(value, declared, wanted):
            problem = f"{title}{key}: {value:g} has no unit, and `units` says nothing about it"
            raise self.error(f"{problem}; write it in {spec.unit}, such as `{key}: {example}`.", node, key)
        try:
            units = cantera.UnitSystem(declared)
            found = converted(units, value if isinstance(value, str) else float(value), spec.unit)
            spec.check(key, found)
        except InputError as error:
            # Errors of the range contain the key already.
            named = error.message if error.message.startswith(key) else f"{key}: {error.message}"
            raise self.error(f"{title}{named}", node, key) from None
        except (cantera.CanteraError, ValueError):
            raise self.error(f"{title}{key} = {value} is not a quantity in {spec.unit}.", node, key) from None
        return found

    def _check(self, node: Any, kinds: Kinds) -> None:
        """Raise InputError if the value of a key has the wrong type."""
        for key, value in node.items():
            allowed = kinds.get(key)
            # In Python true is an int; in a mechanism it is no number.
            if allowed and (not isinstance(value, allowed) or (isinstance(value, bool) and bool not in allowed)):
                wanted = " or ".join(KIND_WORDS[kind] for kind in allowed if kind in KIND_WORDS)
                raise self.error(f"{key}: this must be {wanted}, not {node.tree.value[key].shown}.", node, key)

    def _entry_list(self, name: str, kinds: Kinds) -> list[Any]:
        """Return the mappings of a section; InputError at an entry that is none."""
        entries = self.data.get(name)
        if entries is None:
            return []
        if not isinstance(entries, Listed):
            raise self.error(f"{name}: this must be a list, not {self.data.tree.value[name].shown}.", self.data, name)
        for i, entry in enumerate(entries):
            if not isinstance(entry, Mapped):
                raise self.error(f"{name}: an entry is a mapping, not {entries.tree.value[i].shown}.", entries, i)
            self._check(entry, kinds)
        return list(entries)

    def phase(self, name: str | None, place: Place | None) -> Any:
        """Return the phase of that name, else the only surface, else the only phase."""
        phases = {str(entry.get("name")): entry for entry in self.phases}
        if not phases:
            known = [str(key) for key in self.data]
            guess = next(iter(get_close_matches("phases", known, 1)), None)
            raise self.error(f"no `phases` in the mechanism.{suggestion('phases', known)}", self.data, guess)
        surfaces = [known for known, entry in phases.items() if entry.get("thermo") in SURFACES]
        if name is None and not surfaces and len(phases) > 1:
            problem = f"the mechanism has no phase that is a surface ({' or '.join(SURFACES)})"
            raise InputError(f"{problem}, only {', '.join(phases)}.", place)
        surfaces = surfaces or list(phases)
        if name is None and len(surfaces) > 1:
            several = "the mechanism has several phases, name one: `phase` in a case, `--phase` of the command."
            raise InputError(f"{several}{suggestion('', surfaces)}", place)
        name = surfaces[0] if name is None else name
        refuse_unknown([name], phases, f"{self.file} has no phase '{{}}'", place)
        return phases[name]

    def species(self, phase: Any) -> Iterator[Any]:
        """Yield the species entries that the phase may use."""
        yield from self._entries(phase, "species", SPECIES)

    def reactions(self, phase: Any) -> Iterator[Any]:
        """Yield the reaction entries that the phase may use, in order."""
        if phase.get("reactions", "all") != "none":
            yield from self._entries(phase, "reactions", REACTION)

    def _entries(self, phase: Any, key: str, kinds: Kinds) -> Iterator[Any]:
        for name in sections(phase.get(key, "all"), key):
            # A phase that does not name its sections may have no entries.
            if name in self.data:
                yield from self._entry_list(name, kinds)
            elif phase.get(key) is not None:
                known = [k for k, v in self.data.items() if isinstance(v, list) and k != "phases"]
                message = f"no section '{name}' in this file.{suggestion(name, known)} A mechanism is one file."
                raise InputError(message, self.place(phase, key, key))

    def defaults(self, entry: Any) -> Mapping[str, Any]:
        """Return the units of bare numbers in the entry; in a file that Cantera has written they are Cantera's."""
        own = entry.get("units") if isinstance(entry, Mapping) else None
        written = CANTERA_UNITS if self.written else {}
        given = [item for item in (self.data.get("units"), own) if isinstance(item, Mapping)]
        return {key: unit for units in (written, *given) for key, unit in units.items()}


def sections(declared: Any, default: str) -> list[str]:
    """Return the names of the sections to which a phase's `species` or `reactions` refers."""
    if isinstance(declared, str):
        return [default]
    named = [next(iter(item)) for item in declared if isinstance(item, Mapping) and item]
    plain = [item for item in declared if not isinstance(item, Mapping)]
    # In `species` a bare word is a species of the default section, in `reactions` it is a section.
    if default == "species" and plain:
        plain = [default]
    return [*plain, *named]


def sides(equation: str) -> tuple[dict[str, float], dict[str, float], bool]:
    """Return the coefficients of the reactants and of the products, and whether the reaction is reversible.

    >>> sides("2 a(s) + b(s) => c(s)")
    ({'a(s)': 2.0, 'b(s)': 1.0}, {'c(s)': 1.0}, False)
    """
    # As in Cantera: names may contain any sign, so only spaces separate them.
    words = equation.split()
    arrow = next((word for word in words if word in ARROWS), "")
    middle = words.index(arrow) if arrow else len(words)
    found: list[dict[str, float]] = [{}, {}]
    for side, part in zip(found, (words[:middle], words[middle + 1 :]), strict=True):
        factor = 1.0
        for word in part:
            if re.fullmatch(r"[0-9]*\.?[0-9]+", word):
                factor = float(word)
            elif word != "+":
                side[word] = side.get(word, 0.0) + factor
                factor = 1.0
    return found[0], found[1], arrow != "=>"


def leading(value: Any) -> float:
    """Return the number at the beginning of a value; nan if there is none.

    >>> leading("-1e-9 mol/m^2"), leading(2)
    (-1e-09, 2.0)
    """
    if isinstance(value, int | float):
        return float(value)
    found = re.match(r"\s*([-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?)", str(value))
    return float(found[1]) if found else float("nan")


def own_parameters(
    law: type[Law],
    keys: Mapping[str, str],
    node: Any,
    who: str,
    read: Callable[[str, Spec], float],
    place: Place | None = None,
) -> dict[str, float]:
    """Return the parameters of a law from an entry with these keys, each ``read`` with its specification.

    InputError at a ``place`` if a parameter without default is missing.
    """
    specs = dict(law.specs())
    optional = {item.name for item in fields(law) if item.default is not MISSING}
    for key, name in keys.items():
        if key not in node and name not in optional:
            raise InputError(f"{who} needs `{key}`: {specs[name].text} [{specs[name].unit}].", place)
    return {name: read(key, specs[name]) for key, name in keys.items() if key in node}


def unitless(value: Any, given: Mapping[str, Any], wanted: Iterable[str]) -> float:
    """Return the first nonzero number without a unit; zero if ``given`` units have a ``wanted`` dimension."""
    if any(item in given for item in wanted):
        return 0
    numbers = value if isinstance(value, list) else [value]
    return next((x for x in numbers if isinstance(x, int | float) and x), 0)


def converted(units: Any, value: str | float, unit: str) -> float:
    """Return a number in an SI unit; energies may be per molecule or per mole, as Cantera's activation energies."""
    if unit == "1":
        return float(value)
    number = _energy(units, value, unit) if unit in ("J", "J/mol") else float(units.convert_to(value, unit))
    # A forgotten nano, or per mole, is a valid unit: only the size tells.
    largest, what, example = LARGEST_NUMBERS.get(unit, (inf, "", ""))
    if abs(number) > largest:
        raise InputError(f"{value} is {what} of {number:g} {unit}, which no bond has; write it as `{example}`.")
    return number


def _energy(units: Any, value: str | float, unit: str) -> float:
    import cantera

    if unit == "J" and isinstance(value, str):
        try:
            return float(units.convert_to(value, "J"))
        except cantera.CanteraError:
            pass  # an energy per amount
    return float(units.convert_activation_energy_to(value, "J/kmol")) / (KILO * (AVOGADRO if unit == "J" else 1))
