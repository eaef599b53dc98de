"""A mechanism as text and as a figure: species, reactions, equilibrium constants, rates over temperature and force."""

from __future__ import annotations

import itertools
import math
import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from surfacechem.contracts.units import parse
from surfacechem.errors import InputError, Place
from surfacechem.mechanism.source import Source
from surfacechem.results.findings import in_words
from surfacechem.runs.listing import TEXT_WIDTH, source
from surfacechem.runs.sheet import columns
from surfacechem.solve.contract import Array
from surfacechem.studies.mechanism_rates import Curves, cycle_verdict, cycles
from surfacechem.tolerances import RUN_EPS

if TYPE_CHECKING:
    from matplotlib.figure import Figure


# Temperature [K] at which the thermo of the species is shown, if it is in range.
STANDARD_T = 298.15

# Numbers of values of a range in tables and in curves.
TABLE_COLUMNS, CURVE_POINTS = 5, 200


@dataclass(frozen=True)
class Span:
    """Values from ``low`` to ``high``, in SI."""

    low: float
    high: float

    def values(self, number: int = TABLE_COLUMNS) -> Array:
        """Return evenly spaced values; a single one if the ends are equal."""
        return np.linspace(self.low, self.high, number if self.high > self.low else 1)

    def text(self, unit: str, scale: float = 1.0) -> str:
        """Return the range in a unit, ``scale`` of which are one SI unit."""
        ends = dict.fromkeys(f"{end * scale:g}" for end in (self.low, self.high))
        return f"{' to '.join(ends)} {unit}"


def span(text: str, unit: str, option: str, above: float = -math.inf) -> Span:
    """Parse a range such as ``280..360 K``, or one value.

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
    """Return the single temperature [K] at which a range is shown."""
    inside = temperatures.low <= STANDARD_T <= temperatures.high
    return STANDARD_T if inside else (temperatures.low + temperatures.high) / 2


def mechanism_sheet(curves: Curves, temperatures: Span, forces: Span) -> str:
    """Describe a mechanism, one fact per line."""
    shown, grid = reference(temperatures), _grid(curves, temperatures, forces)
    T, f = temperatures.values(), forces.values()
    types = []
    for kind in dict.fromkeys(type(law) for law in curves.laws.values()):
        text = f"{kind.kind}: {source(kind)}".replace("``", "")
        types += textwrap.wrap(text, TEXT_WIDTH - 2, subsequent_indent="    ", break_on_hyphens=False)
    outside = [(law.label, law.equation, f"line {law.place.line}") for law in curves.evaluated if law.place]
    cold, pulled = np.array([shown]), curves.pulled or "a bond"
    sections = {
        f"Species at {shown:g} K, without force": columns(_species(curves, shown)),
        "Reactions": list(reaction_lines(curves, temperatures, forces)),
        "Reactions whose rates Cantera gives, under `solver: cantera`": columns(outside),
        "Cycles": columns((" ".join(cycle.labels), cycle_verdict(cycle, curves, *grid)) for cycle in cycles(curves)),
        "Against temperature, without force; rates per bond at coverages of one": columns(
            _table(curves, "T [K]", T, T, np.zeros(1))
        )
        if curves.laws
        else [],
        f"Against the force on {pulled}, at {shown:g} K": columns(_table(curves, "f [pN]", f * 1e12, cold, f))
        if curves.loaded
        else [],
        "Rate types": types,
        "Remarks": list(remarks(curves, temperatures)),
    }
    head = f"phase {curves.mechanism.phase}, {curves.site_density:.6g} sites/m^2"
    parts = ["\n  ".join([heading, *lines]) for heading, lines in sections.items() if lines]
    return "\n\n".join([head, *parts])


def reaction_lines(curves: Curves, temperatures: Span, forces: Span) -> Iterator[str]:
    """Yield formula, numbers and verdict of each lowered reaction."""
    for label, law in curves.laws.items():
        place = f"{law.place.file}:{law.place.line}" if law.place else ""
        units = {name: law.refine(name, spec).unit for name, spec in law.specs()}
        numbers = [f"{name} = {getattr(law, name):.6g} {unit}".removesuffix(" 1") for name, unit in units.items()]
        yield f"{label}  {law.equation}  ({law.kind}, {place})"
        yield f"    {', '.join(numbers)}"
        yield f"    {verdict(curves, label, temperatures, forces)}"


def _species(curves: Curves, temperature: float) -> Iterator[tuple[str, ...]]:
    text = Source("", curves.mechanism.text)
    entries = text.species(text.phase(curves.mechanism.phase, None))
    made_of = {str(entry.get("name")): entry.get("composition") or {} for entry in entries}
    yield "", "made of", "sites", "h [kJ/mol]", "s [J/(mol K)]", "g [kJ/mol]"
    for name, value in curves.thermo(temperature).items():
        elements = " ".join(f"{element}{count:g}" for element, count in made_of.get(name, {}).items())
        numbers = (_number(value.h / 1e3), _number(value.s), _number(value.g / 1e3))
        yield name, elements or "-", f"{curves.species[name].sites:g}", *numbers


def _number(value: float, digits: int = 6) -> str:
    """Format a difference of numbers of up to a thousand [kJ/mol]; roundoff is shown as zero."""
    return f"{value:.{digits}g}" if abs(value) > 1e3 * RUN_EPS else "0"


def verdict(curves: Curves, label: str, temperatures: Span, forces: Span) -> str:
    """Return the verdict on the detailed balance of a reaction, in words."""
    if curves.laws[label].reversible:
        return "consistent by construction: the reverse follows from K(g, T)"
    pair = next((pair for pair in curves.pairs if label in pair.labels), None)
    if pair is None:
        return "runs one way only: it has no equilibrium, and destroys entropy where its affinity is against it"
    values = curves.departure(pair, *_grid(curves, temperatures, forces))
    others = " and ".join(other for other in pair.labels if other != label)
    where = temperatures.text("K") + (f", {forces.text('pN', 1e12)}" if curves.loaded else "")
    return f"pair with {others}: {in_words(float(values.min()), float(values.max()))} ({where})"


def _grid(curves: Curves, temperatures: Span, forces: Span) -> Sequence[Array]:
    return np.meshgrid(temperatures.values(20), forces.values(20) if curves.loaded else np.zeros(1))


def _table(curves: Curves, name: str, x: Array, T: Array, f: Array) -> Iterator[tuple[str, ...]]:
    yield "", name, *(f"{value:.6g}" for value in x)
    for label in curves.laws:
        reverse = curves.log_reverse(label, T, f)
        yield label, "K [1]", *map(power_of_ten, curves.log_equilibrium(label, T, f))
        yield "", "forward [1/s]", *map(power_of_ten, curves.log_forward(label, T, f))
        if reverse is not None:
            yield "", "reverse [1/s]", *map(power_of_ten, reverse)
    for pair in curves.pairs:
        departure = curves.departure(pair, T, f)
        yield " ".join(pair.labels), "ln(k_f/k_r) - ln K", *(_number(value, 3) for value in departure)


def power_of_ten(logarithm: float) -> str:
    """Format a number given by its natural logarithm, however large it is.

    >>> power_of_ten(0.0), power_of_ten(1000.0), power_of_ten(-math.inf)
    ('1', '1.97e+434', '0')
    """
    if not math.isfinite(logarithm):
        return "0" if logarithm < 0 else str(logarithm)
    if abs(logarithm) < 9:
        return f"{math.exp(logarithm):.4g}"
    exponent = math.floor(logarithm / math.log(10))
    return f"{math.exp(logarithm - exponent * math.log(10)):.3g}e{exponent:+03d}"


def remarks(curves: Curves, temperatures: Span) -> Iterator[str]:
    """Yield peculiarities of a mechanism, and of what is shown of it, that are not errors."""
    yield from curves.mechanism.remarks
    low, high = curves.mechanism.temperatures
    if not low <= temperatures.low <= temperatures.high <= high:
        yield f"The thermo holds from {low:g} to {high:g} K: what is outside is an extrapolation."
    idle = set(curves.mechanism.species.values())
    around = [name for name, item in curves.species.items() if item.interactions]
    if around:
        yield f"The thermo of {', '.join(around)} depends on coverages; everything above is without that."
    for law in (*curves.laws.values(), *curves.evaluated):
        idle -= set(law.change)
    for law in curves.laws.values():
        where = f"{law.place.file}:{law.place.line}: " if law.place else ""
        if any(nu < 0 and not law.orders.get(name) for name, nu in law.change.items()):
            yield f"{where}{law.equation} goes on where nothing is left to react: its order in a reactant is zero."
    for name, variable in curves.mechanism.species.items():
        if variable in idle:
            yield f"{name} takes part in no reaction: its coverage stays as it is."


def figure(curves: Curves, temperatures: Span, forces: Span) -> Figure:
    """Draw rates (left) and equilibrium constants (right), over temperature and in a second row over force."""
    from surfacechem.plots.style import COLOURS, NOTE_STYLE, TITLE_STYLE, panels

    shown, T, f = reference(temperatures), temperatures.values(CURVE_POINTS), forces.values(CURVE_POINTS)
    rows = [(T, T, np.zeros(1), "Temperature [K]")]
    rows += [(f * 1e12, np.array([shown]), f, f"Force on {curves.pulled or 'a bond'} [pN]")] if curves.loaded else []
    with panels(7.2, 0.6 + 2.5 * len(rows), len(rows), 2) as (plot, axes):
        for (rates, constants), (x, hot, pulled, label) in zip(axes, rows, strict=True):
            for (name, law), colour in zip(curves.laws.items(), itertools.cycle(COLOURS), strict=False):
                drawn = [
                    (rates, curves.log_forward(name, hot, pulled), "-", f"{name}: {law.equation}"),
                    (rates, curves.log_reverse(name, hot, pulled), "--", f"{name}, reverse"),
                    (constants, curves.log_equilibrium(name, hot, pulled), "-", "_"),
                ]
                for ax, logarithm, style, text in drawn:
                    if logarithm is not None:
                        values = np.broadcast_to(logarithm, x.shape) / math.log(10)
                        ax.plot(x, values, style, color=colour, label=text, marker="o" if len(x) == 1 else "")
            rates.set(xlabel=label, ylabel="log$_{10}$ Rate per bond [1/s]")
            constants.set(xlabel=label, ylabel="log$_{10}$ K [1]")
        if curves.loaded:
            axes[1][0].set_title(f"at {shown:g} K", loc="left", **NOTE_STYLE)
        handles, labels = axes[0][0].get_legend_handles_labels()
        plot.legend(handles, labels, loc="outside lower center", ncols=min(len(labels), 3))
        plot.suptitle(f"Phase {curves.mechanism.phase}", **TITLE_STYLE)
    return plot
