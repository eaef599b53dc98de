"""What a mechanism file may hold. Cantera ignores what it does not know; here it is an error with its line."""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from surfacechem.errors import InputError, Place, suggestion
from surfacechem.mechanism.rates import kinds

PHASE = frozenset(
    [
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
        "skip-undeclared-elements",
        "skip-undeclared-third-bodies",
        "explicit-third-body-duplicates",
    ]
)
SPECIES = frozenset(["name", "composition", "thermo", "sites", "note", "description", "transport"])
THERMO = {
    "constant-cp": frozenset(["model", "T0", "h0", "s0", "cp0", "T-min", "T-max", "reference-pressure", "note"]),
    "NASA7": frozenset(["model", "temperature-ranges", "data", "reference-pressure", "note"]),
    "NASA9": frozenset(["model", "temperature-ranges", "data", "reference-pressure", "note"]),
    "Shomate": frozenset(["model", "temperature-ranges", "data", "reference-pressure", "note"]),
}
REACTION = frozenset(
    [
        "equation",
        "type",
        "rate-constant",
        "coverage-dependencies",
        "orders",
        "negative-orders",
        "nonreactant-orders",
        "duplicate",
        "negative-A",
        "units",
        "id",
        "note",
        "description",
    ]
)
RATE_CONSTANT = frozenset(("A", "b", "Ea"))
COVERAGE = frozenset(("a", "m", "E"))
STATE = frozenset(("T", "P", "coverages"))
FILE = frozenset(
    [
        "description",
        "generator",
        "date",
        "input-files",
        "cantera-version",
        "git-commit",
        "units",
        "phases",
        "species",
        "reactions",
        "elements",
        "extensions",
        "note",
    ]
)

REMEDIES = {
    "adjacent-phases": "bulk and gas neighbours are not part of the compiled path; write all species into one surface "
    "phase.",
    "coverage-dependencies": "coverage-dependent enthalpy and entropy need not follow from one free energy; put the "
    "dependence into the reaction's activation energy.",
    "reference-state-coverage": "coverage-dependent thermo is not lowered; use `thermo: ideal-surface`.",
    "sticking-coefficient": "a sticking reaction needs a gas; give a `rate-constant` instead.",
    "Motz-Wise": "this correction is for sticking reactions, which need a gas; remove it.",
    "sticking-species": "a sticking reaction needs a gas; give a `rate-constant` instead.",
    "beta": "charge transfer needs an electric potential; give a plain `rate-constant` instead.",
    "exchange-current-density-formulation": "charge transfer needs an electric potential; give a plain "
    "`rate-constant` instead.",
    "efficiencies": "third bodies belong to gases; remove it.",
    "equation-of-state": "a surface species has no volume; remove it.",
    "critical-parameters": "a surface species has no critical point; remove it.",
}
"""What Cantera knows and the compiled path does not, with the way out."""


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
        return list(self.data.get("phases") or [])

    def phase(self, name: str | None, place: Place | None) -> Any:
        """The phase of that name, or the only one."""
        phases = {str(entry.get("name")): entry for entry in self.phases()}
        if not phases:
            raise InputError("no `phases` in the mechanism.", Place(self.file))
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
        yield from self._entries(phase, "species", "species")

    def reactions(self, phase: Any) -> Iterator[Any]:
        """The reaction entries that the phase may use, in order."""
        if phase.get("reactions", "all") != "none":
            yield from self._entries(phase, "reactions", "reactions")

    def _entries(self, phase: Any, key: str, default: str) -> Iterator[Any]:
        for name in _sections(phase.get(key, "all"), default):
            if name in self.data or phase.get(key) is not None:
                yield from self.section(name, phase, key)


def _sections(declared: Any, default: str) -> list[str]:
    """Names of the sections that a phase's `species` or `reactions` refers to."""
    if isinstance(declared, str):
        return [default]
    names = [next(iter(item)) if isinstance(item, Mapping) else None for item in declared]
    plain = [item for item in declared if not isinstance(item, Mapping)]
    if default == "species":
        return [*([default] if plain else []), *(name for name in names if name)]
    return [*plain, *(name for name in names if name)]


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


def check(source: Source, phase: Any) -> None:
    """Raise InputError at the first key of the file that means nothing, or that cannot be lowered."""
    _check_file(source)
    _keys(source, phase, PHASE, f"phase {phase.get('name')}")
    if "site-density" not in phase:
        message = "the phase has no `site-density`. Give one, for instance `site-density: 1e-9 mol/cm^2`."
        raise InputError(message, source.place(phase))
    if isinstance(phase.get("state"), Mapping):
        _keys(source, phase["state"], STATE, "state")
    for entry in source.species(phase):
        _check_species(source, entry)
    species = frozenset(str(entry.get("name")) for entry in source.species(phase))
    for entry in source.reactions(phase):
        _check_reaction(source, entry, species)


def _check_file(source: Source) -> None:
    sections = {
        name
        for phase in source.phases()
        for key in ("species", "reactions")
        for name in _sections(phase.get(key, "all"), key)
    }
    _keys(source, source.data, FILE | sections, "the file")


def _check_species(source: Source, entry: Any) -> None:
    title = f"species {entry.get('name')}"
    _keys(source, entry, SPECIES, title)
    thermo = entry.get("thermo")
    if not isinstance(thermo, Mapping):
        raise InputError(f"{title} has no `thermo`.", source.place(entry))
    model = str(thermo.get("model"))
    if model not in THERMO:
        message = f"{title}: thermo model '{model}' is not lowered.{suggestion(model, THERMO)}"
        raise InputError(message, source.place(thermo, "model"))
    _keys(source, thermo, THERMO[model], f"{title}: thermo")


def _check_reaction(source: Source, entry: Any, species: frozenset[str]) -> None:
    title = f"reaction {entry.get('equation')}"
    _keys(source, entry, REACTION, title)
    _check_type(source, entry, title)
    if not isinstance(entry.get("rate-constant"), Mapping):
        raise InputError(f"{title} has no `rate-constant: {{A, b, Ea}}`.", source.place(entry))
    _keys(source, entry["rate-constant"], RATE_CONSTANT, f"{title}: rate-constant")
    for name, terms in (entry.get("coverage-dependencies") or {}).items():
        if name not in species:
            message = f"{title}: coverage-dependencies: no species '{name}'.{suggestion(str(name), species)}"
            raise InputError(message, source.place(entry["coverage-dependencies"], name))
        if isinstance(terms, Mapping):
            _keys(source, terms, COVERAGE, f"{title}: coverage-dependencies: {name}")


def _check_type(source: Source, entry: Any, title: str) -> None:
    """Cantera writes a type with or without its prefix; a plain rate needs none."""
    kind = str(entry.get("type", "Arrhenius"))
    known = kinds()
    if kind not in known and f"interface-{kind}" not in known and kind != "elementary":
        message = f"{title}: rate type '{kind}' is not lowered.{suggestion(kind, known)}"
        raise InputError(message, source.place(entry, "type"))


def _keys(source: Source, node: Any, known: Sequence[str] | frozenset[str], title: str) -> None:
    if not isinstance(node, Mapping):
        raise InputError(f"{title} is not a mapping: {node!r}.", Place(source.file))
    for key in node:
        if key in known:
            continue
        place = source.place(node, key)
        if key in REMEDIES:
            raise InputError(f"{title}: '{key}' cannot be used here: {REMEDIES[key]}", place)
        raise InputError(f"{title}: unknown key '{key}'.{suggestion(str(key), known)}", place)
