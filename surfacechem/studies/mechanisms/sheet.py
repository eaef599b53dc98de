"""A mechanism as text: species, reactions, equilibrium constants, rates over temperature and force, and verdicts."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from surfacechem.errors import InputError, Place
from surfacechem.mechanism.rates import SurfaceReaction
from surfacechem.mechanism.source import Source
from surfacechem.results.detailed_balance import said
from surfacechem.runs.listing import WIDTH, source
from surfacechem.runs.report import columns
from surfacechem.studies.mechanisms.cycles import cycles
from surfacechem.studies.mechanisms.cycles import verdict as around
from surfacechem.studies.mechanisms.rate_tables import Curves
from surfacechem.units import parse

Array = NDArray[np.float64]

STANDARD = 298.15
"""Temperature [K] at which the thermo of the species is shown, where it is in range."""

COLUMNS = 5


@dataclass(frozen=True)
class Span:
    """Values from ``low`` to ``high``, in SI."""

    low: float
    high: float

    def values(self, number: int = COLUMNS) -> Array:
        """Evenly spaced values; one where the ends are the same."""
        return np.linspace(self.low, self.high, number if self.high > self.low else 1)

    def words(self, unit: str, scale: float = 1.0) -> str:
        """The range in a unit of which ``scale`` make one in SI."""
        ends = dict.fromkeys(f"{end * scale:g}" for end in (self.low, self.high))
        return f"{' to '.join(ends)} {unit}"


def span(text: str, unit: str, option: str, above: float = -math.inf) -> Span:
    """A range such as ``280..360 K``, or one value.

    >>> span("280..360 K", "K", "--temperature")
    Span(low=280.0, high=360.0)
    """
    place = Place(path=option)
    first, dots, last = (part.strip() for part in text.partition(".."))
    symbol = last.lstrip("+-0123456789.eE").strip()
    ends = [f"{first} {symbol}" if first.replace(".", "").isdigit() else first, last] if dots else [first, first]
    low, high = (parse(end, unit, place, option) for end in ends)
    if high < low or low <= above:
        raise InputError(f"'{text}' is no range upwards of admissible values; write it as `280..360 K`.", place)
    return Span(low, high)


def reference(temperatures: Span) -> float:
    """The one temperature [K] at which a range is shown."""
    inside = temperatures.low <= STANDARD <= temperatures.high
    return STANDARD if inside else (temperatures.low + temperatures.high) / 2


def sheet(curves: Curves, temperatures: Span, forces: Span) -> str:
    """Everything about a mechanism, one fact a line."""
    mechanism = curves.mechanism
    shown = reference(temperatures)
    sections = [
        f"phase {mechanism.phase}, {curves.site_density:.6g} sites/m^2",
        _section(f"Species at {shown:g} K, without force", _species(curves, shown)),
        "\n".join(["Reactions", *_reactions(curves, temperatures, forces)]),
        _section("Cycles", _cycles(curves, temperatures, forces)),
        _section("Against temperature, without force; rates per bond at coverages of one", _hot(curves, temperatures)),
        _section(f"Against the force on {curves.pulled or 'a bond'}, at {shown:g} K", _loaded(curves, shown, forces)),
        "\n".join(["Rate types", *(_source(law) for law in _types(curves))]),
        _section("Remarks", [(remark,) for remark in remarks(curves)]),
    ]
    return "\n\n".join(part for part in sections if part)


def _section(heading: str, rows: Any) -> str:
    rows = list(rows)
    return "\n".join([heading, *(f"  {line}" for line in columns(rows))]) if rows else ""


def _species(curves: Curves, temperature: float) -> Iterator[tuple[str, ...]]:
    text = Source("", curves.mechanism.text)
    made_of = {str(entry.get("name")): entry.get("composition") for entry in text.all_species()}
    yield "", "made of", "sites", "h [kJ/mol]", "s [J/(mol K)]", "g [kJ/mol]"
    for name, value in curves.thermo(temperature).items():
        sites = f"{curves.species[name].sites:g}"
        numbers = (_number(value.h / 1e3), _number(value.s), _number(value.g / 1e3))
        yield name, _composition(made_of.get(name)), sites, *numbers


def _composition(elements: Mapping[str, float] | None) -> str:
    return " ".join(f"{name}{number:g}" for name, number in (elements or {}).items()) or "-"


def _number(value: float, digits: int = 6) -> str:
    return f"{value:.{digits}g}" if abs(value) > 1e-9 else "0"


def _reactions(curves: Curves, temperatures: Span, forces: Span) -> Iterator[str]:
    for label, law in curves.laws.items():
        place = f"{law.place.file}:{law.place.line}" if law.place else ""
        yield f"  {label}  {law.equation}  ({law.kind}, {place})"
        yield f"      {_parameters(law)}"
        yield f"      {verdict(curves, label, temperatures, forces)}"


def _parameters(law: SurfaceReaction) -> str:
    numbers = ((name, law.refine(name, spec).unit, getattr(law, name)) for name, spec in law.specs())
    given = [f"{name} = {value:.6g}" + ("" if unit == "1" else f" {unit}") for name, unit, value in numbers]
    return ", ".join(given)


def verdict(curves: Curves, label: str, temperatures: Span, forces: Span) -> str:
    """Whether a reaction keeps detailed balance, in words."""
    if curves.laws[label].reversible:
        return "consistent by construction: the reverse follows from K(g, T)"
    pair = next((pair for pair in curves.pairs if label in pair.labels), None)
    if pair is None:
        return "runs one way only: it has no equilibrium, and destroys entropy where its affinity is against it"
    grid = np.meshgrid(temperatures.values(20), forces.values(20) if curves.loaded else np.zeros(1))
    values = curves.departure(pair, *grid)
    others = " and ".join(other for other in pair.labels if other != label)
    where = temperatures.words("K") + (f", {forces.words('pN', 1e12)}" if curves.loaded else "")
    return f"pair with {others}: {said(float(values.min()), float(values.max()))} ({where})"


def _cycles(curves: Curves, temperatures: Span, forces: Span) -> Iterator[tuple[str, ...]]:
    grid = np.meshgrid(temperatures.values(20), forces.values(20) if curves.loaded else np.zeros(1))
    for cycle in cycles(curves):
        yield " ".join(cycle.labels), around(cycle, curves, *grid)


def _hot(curves: Curves, temperatures: Span) -> Iterator[tuple[str, ...]]:
    T = temperatures.values()
    yield "", "T [K]", *(f"{value:.6g}" for value in T)
    yield from _rows(curves, T, np.zeros(1), list(curves.laws))


def _loaded(curves: Curves, temperature: float, forces: Span) -> Iterator[tuple[str, ...]]:
    if not curves.loaded:
        return
    f = forces.values()
    yield "", "f [pN]", *(f"{value * 1e12:.6g}" for value in f)
    yield from _rows(curves, np.array(temperature), f, list(curves.laws))


def _rows(curves: Curves, T: Array, f: Array, labels: list[str]) -> Iterator[tuple[str, ...]]:
    for label in labels:
        reverse = curves.log_reverse(label, T, f)
        yield label, "K [1]", *map(power_of_ten, curves.log_equilibrium(label, T, f))
        yield "", "forward [1/s]", *map(power_of_ten, curves.log_forward(label, T, f))
        if reverse is not None:
            yield "", "reverse [1/s]", *map(power_of_ten, reverse)
    for pair in curves.pairs:
        departure = curves.departure(pair, T, f)
        yield " ".join(pair.labels), "ln(k_f/k_r) - ln K", *(_number(value, 3) for value in departure)


def power_of_ten(logarithm: float) -> str:
    """A number of which the natural logarithm is known, however large it is.

    >>> power_of_ten(0.0), power_of_ten(1000.0), power_of_ten(-math.inf)
    ('1', '1.97e+434', '0')
    """
    if not math.isfinite(logarithm):
        return "0" if logarithm < 0 else str(logarithm)
    if abs(logarithm) < 9:
        return f"{math.exp(logarithm):.4g}"
    exponent = math.floor(logarithm / math.log(10))
    return f"{math.exp(logarithm - exponent * math.log(10)):.3g}e{exponent:+03d}"


def _types(curves: Curves) -> list[type[SurfaceReaction]]:
    return list(dict.fromkeys(type(law) for law in curves.laws.values()))


def _source(law: type[SurfaceReaction]) -> str:
    text = f"{law.kind}: {source(law)}".replace("``", "")
    return textwrap.fill(text, WIDTH, initial_indent="  ", subsequent_indent="      ", break_on_hyphens=False)


def remarks(curves: Curves) -> Iterator[str]:
    """What is odd about a mechanism, though not wrong."""
    yield from curves.mechanism.remarks
    idle = set(curves.mechanism.species.values())
    around = [name for name, item in curves.species.items() if item.interactions]
    if around:
        yield f"The thermo of {', '.join(around)} depends on coverages; everything above is without that."
    for law in curves.laws.values():
        idle -= set(law.change)
        yield from _odd(law)
    for name, variable in curves.mechanism.species.items():
        if variable in idle:
            yield f"{name} takes part in no reaction: its coverage stays as it is."


def _odd(law: SurfaceReaction) -> Iterator[str]:
    where = f"{law.place.file}:{law.place.line}: " if law.place else ""
    missing = [name for name, nu in law.change.items() if nu < 0 and not law.orders.get(name)]
    if missing:
        yield f"{where}{law.equation} goes on where nothing is left to react: its order in a reactant is zero."
