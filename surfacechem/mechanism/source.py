"""The text of a mechanism file with the line of every entry, and what of it belongs to a phase."""

from __future__ import annotations

import io
import re
from collections.abc import Iterable, Iterator, Mapping
from difflib import get_close_matches
from typing import Any

from surfacechem.errors import InputError, Place, suggestion

ARROWS = ("<=>", "=>", "=")
"""What stands between the sides of an equation; only the second is one way."""

WRITER = "YamlWriter"
"""How Cantera signs the files that it writes."""

CANTERA_UNITS = {"length": "m", "quantity": "kmol", "energy": "J", "activation-energy": "J/kmol"}
"""What numbers in such a file count in where it does not say otherwise."""


class Source:
    """The text of a mechanism with the line of every entry."""

    def __init__(self, file: str, text: str) -> None:
        self.file = file
        self.text = text
        self.data = _parse(file, text)

    def place(self, node: Any, key: Any = None, path: str = "") -> Place:
        """Place of a mapping or list, or of one of its entries."""
        marks = getattr(node, "lc", None)
        if marks is None:
            return Place(self.file, 0, path)
        where = (marks.data or {}).get(key)
        return Place(self.file, (where[0] if where else marks.line) + 1, path)

    def phases(self) -> list[Any]:
        """The phase entries."""
        return [entry for entry in self.data.get("phases") or [] if isinstance(entry, Mapping)]

    def phase(self, name: str | None, place: Place | None) -> Any:
        """The phase of that name, or the only one."""
        phases = {str(entry.get("name")): entry for entry in self.phases()}
        if not phases:
            known = [str(key) for key in self.data]
            guess = next(iter(get_close_matches("phases", known, 1)), None)
            raise InputError(
                f"no `phases` in the mechanism.{suggestion('phases', known)}", self.place(self.data, guess)
            )
        if name is None and len(phases) == 1:
            return next(iter(phases.values()))
        if name is None:
            raise InputError(f"the mechanism has several phases, name one.{suggestion('', phases)}", place)
        if name not in phases:
            raise InputError(f"{self.file} has no phase '{name}'.{suggestion(name, phases)}", place)
        return phases[name]

    def section(self, name: str, node: Any, key: str) -> list[Any]:
        """A list of species or reactions in this file."""
        if name not in self.data:
            known = [k for k, v in self.data.items() if isinstance(v, list) and k != "phases"]
            raise InputError(
                f"no section '{name}' in this file.{suggestion(name, known)} A mechanism is one file.",
                self.place(node, key, key),
            )
        return list(self.data[name] or [])

    def species(self, phase: Any) -> Iterator[Any]:
        """The species entries that the phase may use."""
        yield from self._entries(phase, "species")

    def all_species(self) -> Iterator[Any]:
        """The species entries of all phases."""
        for phase in self.phases():
            yield from self.species(phase)

    def reactions(self, phase: Any) -> Iterator[Any]:
        """The reaction entries that the phase may use, in order."""
        if phase.get("reactions", "all") != "none":
            yield from self._entries(phase, "reactions")

    @property
    def written(self) -> bool:
        """Whether Cantera itself has written the file."""
        return str(self.data.get("generator")) == WRITER

    def defaults(self, entry: Any) -> Mapping[str, Any]:
        """Units that a bare number in the entry has; what Cantera itself has written counts in its own."""
        own = entry.get("units") if isinstance(entry, Mapping) else None
        written = CANTERA_UNITS if self.written else {}
        return {**written, **_mapping(self.data.get("units")), **_mapping(own)}

    def _entries(self, phase: Any, key: str) -> Iterator[Any]:
        for name in sections(phase.get(key, "all"), key):
            if name in self.data or phase.get(key) is not None:
                yield from self.section(name, phase, key)


def sections(declared: Any, default: str) -> list[str]:
    """Names of the sections that a phase's `species` or `reactions` refers to."""
    if isinstance(declared, str):
        return [default]
    names = [next(iter(item)) if isinstance(item, Mapping) else None for item in declared]
    plain = [item for item in declared if not isinstance(item, Mapping)]
    if default == "species":
        return [*([default] if plain else []), *(name for name in names if name)]
    return [*plain, *(name for name in names if name)]


def chosen(declared: Any, available: Iterable[str]) -> list[str]:
    """Names of the species that a phase declares, those of a whole section included."""
    listed = [] if isinstance(declared, str) else declared
    plain = [str(item) for item in listed if not isinstance(item, Mapping)]
    named = [names for item in listed if isinstance(item, Mapping) for names in item.values()]
    whole = isinstance(declared, str) or "all" in named
    return [*(available if whole else plain), *(str(name) for names in named if names != "all" for name in names)]


def sides(equation: str) -> tuple[dict[str, float], dict[str, float], bool]:
    """Coefficients of the reactants and of the products, and whether the reaction is reversible.

    >>> sides("2 a(s) + b(s) => c(s)")
    ({'a(s)': 2.0, 'b(s)': 1.0}, {'c(s)': 1.0}, False)
    """
    words = equation.split()
    arrow = next((word for word in words if word in ARROWS), "")
    middle = words.index(arrow) if arrow else len(words)
    return _side(words[:middle]), _side(words[middle + 1 :]), arrow != "=>"


def _side(words: list[str]) -> dict[str, float]:
    total: dict[str, float] = {}
    factor = 1.0
    for word in words:
        if re.fullmatch(r"[0-9]*\.?[0-9]+", word):
            factor = float(word)
        elif word != "+":
            total[word] = total.get(word, 0.0) + factor
            factor = 1.0
    return total


def _mapping(node: Any) -> Mapping[str, Any]:
    return node if isinstance(node, Mapping) else {}


def _parse(file: str, text: str) -> Any:
    from ruamel.yaml import YAML
    from ruamel.yaml.error import MarkedYAMLError

    try:
        data = YAML(typ="rt").load(io.StringIO(text))
    except MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else 0
        raise InputError(f"{error.problem}.", Place(file, line)) from None
    if not isinstance(data, Mapping):
        raise InputError("a mechanism is a mapping with `phases`, `species` and `reactions`.", Place(file))
    return data
