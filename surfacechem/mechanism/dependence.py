"""Coverage-dependent thermo of a species in a mechanism file: what it may hold, and reading it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from surfacechem.errors import InputError, suggestion
from surfacechem.mechanism.interaction import Curve, Interaction
from surfacechem.mechanism.source import Source
from surfacechem.mechanism.thermo import KILO

KEY = "coverage-dependencies"

MODEL = "coverage-dependent-surface"
"""The model of the phase in which species have it."""

CURVES = {
    "linear": ("enthalpy", "entropy"),
    "polynomial": ("enthalpy-coefficients", "entropy-coefficients"),
    "piecewise-linear": (
        *("enthalpy-low", "enthalpy-high", "enthalpy-change"),
        *("entropy-low", "entropy-high", "entropy-change"),
    ),
    "interpolative": ("enthalpy-coverages", "enthalpies", "entropy-coverages", "entropies"),
}
"""Keys of each model."""

CAPACITY = ("heat-capacity-a", "heat-capacity-b")

COEFFICIENTS = 4
"""Number of coefficients of a polynomial, as Cantera reads it."""

TOGETHER = (
    *(("heat-capacity-a", "heat-capacity-b"), ("enthalpy-coverages", "enthalpies"), ("entropy-coverages", "entropies")),
    *(("enthalpy-low", "enthalpy-high", "enthalpy-change"), ("entropy-low", "entropy-high", "entropy-change")),
)
"""Keys that need each other."""


def check_dependence(source: Source, phase: Any, entry: Any, names: Iterable[str]) -> None:
    """Raise InputError where the coverage-dependent thermo of a species is not what Cantera takes it for."""
    node, title = entry.get(KEY), f"species {entry.get('name')}: {KEY}"
    if node is None:
        return
    if phase.get("thermo") != MODEL:
        message = f"{title}: only a phase with `thermo: {MODEL}` reads this; give the phase that, or remove it."
        raise InputError(message, source.place(entry, KEY))
    if not isinstance(node, Mapping) or not all(isinstance(inner, Mapping) for inner in node.values()):
        raise InputError(f"{title}: write `{{species: {{model: linear, enthalpy: ...}}}}`.", source.place(entry, KEY))
    for name, inner in node.items():
        if name not in names:
            raise InputError(f"{title}: no species '{name}'.{suggestion(str(name), names)}", source.place(node, name))
        _check_one(source, entry, inner, f"{title}: {name}")


def _check_one(source: Source, entry: Any, node: Any, title: str) -> None:
    model = str(node.get("model"))
    if model not in CURVES:
        raise InputError(f"{title}: no model '{model}'.{suggestion(model, CURVES)}", source.place(node, "model"))
    known = ("model", "units", *CURVES[model], *CAPACITY)
    counts = "quantity" in {**source.defaults(entry), **(node.get("units") or {})}
    for key, value in node.items():
        place = source.place(node, key)
        if key not in known:
            raise InputError(f"{title}: unknown key '{key}'.{suggestion(str(key), known)}", place)
        if key.endswith("-coefficients") and (not isinstance(value, list) or len(value) != COEFFICIENTS):
            raise InputError(f"{title}: {key} are {COEFFICIENTS} numbers; those that are not there are 0.", place)
        if not counts and key not in ("model", "units") and not key.endswith(("-change", "-coverages")):
            _check_bare(source, node, key, title)
    for group in TOGETHER:
        given = [key for key in group if key in node]
        if given and len(given) < len(group):
            missing = next(key for key in group if key not in node)
            raise InputError(f"{title}: {given[0]} needs `{missing}` too.", source.place(node, given[0]))


def _check_bare(source: Source, node: Any, key: str, title: str) -> None:
    many = node[key] if isinstance(node[key], list) else [node[key]]
    if any(isinstance(x, int | float) and x for x in many):
        message = (
            f"{title}: {key} without a unit counts in kmol. Say what it counts in, such as "
            "`units: {energy: eV, quantity: molec}` beside it."
        )
        raise InputError(message, source.place(node, key))


def interactions(source: Source, entry: Any, variables: Mapping[str, str]) -> tuple[Interaction, ...]:
    """How the thermo of a species depends on coverages, whose names ``variables`` gives by species."""
    found = []
    for name, node in (entry.get(KEY) or {}).items():
        reader = _Reader(source, entry, node)
        curves = (reader.curve("enthalpy", "enthalpies"), reader.curve("entropy", "entropies"))
        a, b = (reader.number(key) if key in node else 0.0 for key in CAPACITY)
        found.append(Interaction(str(name), variables[str(name)], *curves, a, b))
    return tuple(found)


@dataclass(frozen=True)
class _Reader:
    """The dependence on one species, in J, mol and K."""

    source: Source
    entry: Any
    node: Any

    def numbers(self, key: str) -> list[float]:
        """One value or several."""
        import cantera

        value, unit = self.node[key], "J/kmol" if key.startswith("enthalp") else "J/kmol/K"
        declared: Any = {**self.source.defaults(self.entry), **(self.node.get("units") or {})}
        units = cantera.UnitSystem(declared)
        return [float(units.convert_to(x, unit)) / KILO for x in (value if isinstance(value, list) else [value])]

    def number(self, key: str) -> float:
        """One value."""
        return self.numbers(key)[0]

    def curve(self, kind: str, many: str) -> Curve:
        """The enthalpy or the entropy over the coverage."""
        node = self.node
        if kind in node:
            return Curve.polynomial(self.numbers(kind))
        if f"{kind}-coefficients" in node:
            return Curve.polynomial(self.numbers(f"{kind}-coefficients"))
        if many in node:
            return Curve.through([float(x) for x in node[f"{kind}-coverages"]], self.numbers(many))
        if f"{kind}-change" in node:
            knot = float(node[f"{kind}-change"])
            middle = self.number(f"{kind}-low") * knot
            return Curve.through([0.0, knot, 1.0], [0.0, middle, middle + (1 - knot) * self.number(f"{kind}-high")])
        return Curve()
