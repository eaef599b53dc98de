"""Report on a mechanism, as text and as a figure: species, reactions, equilibrium constants, rates, and cycles.

All rates are kept as logarithms, so that no exponent overflows. They are those at coverages of one, per possible bond,
so that forward over reverse is the equilibrium constant of the coverages whatever the order.

Cycles are sequences of reactions whose changes sum to zero, so that in equilibrium the product of their k_f/k_r is one,
whatever the thermo of the species. Rates with another product keep the cycle running without end. Source: Wegscheider
(1901), Monatsh. Chem. 22, 849, doi 10.1007/BF01517498.
"""

from __future__ import annotations

import itertools
import math
import textwrap
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from fractions import Fraction
from functools import cached_property
from math import lcm
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import symengine

from surfacechem.contracts.terms import reads
from surfacechem.contracts.units import parse
from surfacechem.errors import InputError, Place
from surfacechem.expressions import Expression, depends, derivative, log, log_sum
from surfacechem.mechanism import Mechanism
from surfacechem.mechanism.evaluated import EvaluatedReaction
from surfacechem.mechanism.rates import InterfaceArrhenius
from surfacechem.mechanism.source import Source
from surfacechem.mechanism.thermo import IdealMixture, Species
from surfacechem.model.components.pairs import Opposed, lengths, opposed
from surfacechem.quantities import BOLTZMANN, GAS_CONSTANT
from surfacechem.results.audit import ROUNDED_DEPARTURE, in_words
from surfacechem.runs.listing import TEXT_WIDTH, columns, source
from surfacechem.solve.contract import Array
from surfacechem.tolerances import RUN_EPS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# A reaction, by its label, or a pair of one-way reactions.
Step = str | Opposed

TEMPERATURE, FORCE = symengine.symbols("T_c f")


class Thermo(NamedTuple):
    """Standard enthalpy, entropy and Gibbs energy of a species [J/mol, J/(mol K), J/mol]."""

    h: float
    s: float
    g: float


class Curves:
    """Functions of temperature [K] and force per bond [N] that follow from a mechanism."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism
        self.laws = {law.label: law for law in mechanism.reactions if isinstance(law, InterfaceArrhenius)}
        self.pairs: Sequence[Opposed] = opposed(self.laws)
        self.species: dict[str, Species] = {
            item.name: item for law in mechanism.potentials if isinstance(law, IdealMixture) for item in law.species
        }
        springs = {name: item.spring for name, item in self.species.items() if item.spring}
        self.pulled = next((name for name, spring in springs.items() if spring.stiffness), "")
        """Species on which the force acts: the first elastic one, whose gap the others share; empty without any."""
        self._amounts = {variable.name: variable.density for variable in mechanism.variables}
        first = next(iter(self.species.values()))
        self.site_density = self._amounts[first.variable] * first.sites
        """Sites per reference area [1/m^2]."""
        self._coverages = {name: symengine.Symbol(name) for name in self._amounts}
        self._lengths = lengths(self.laws, self.pairs)
        self._known = self._names(springs)
        self._numbers: dict[Expression, float] = {}
        for law in self.laws.values():
            self._numbers |= {symbol: float(getattr(law, name)) for name, symbol in _symbols(law).items()}

    def _names(self, springs: Mapping[str, Any]) -> dict[str, Expression]:
        """Return the expressions of names that a law may read; at the gap the pulled bond carries the force."""
        pulled = springs.get(self.pulled)
        gap = pulled.rest_length + FORCE / pulled.stiffness if pulled else 0.0
        known: dict[str, Expression] = {**self._coverages, "T_c": TEMPERATURE, "f": FORCE, "g_n": gap}
        known |= {f"{letter}_{name}": amount for letter in "Nn" for name, amount in self._amounts.items()}
        for name, spring in springs.items():
            known[f"f_{self.species[name].variable}"] = spring.stiffness * (gap - spring.rest_length)
        return known

    @cached_property
    def _psi(self) -> Expression:
        """Free energy of the mixture [J/m^2], without interactions, so that standard states have no coverage."""
        psi: Expression = 0
        for potential in self.mechanism.potentials:
            if isinstance(potential, IdealMixture):
                species = tuple(item._replace(interactions=()) for item in potential.species)
                potential = potential.bind({"species": species})
            psi += self._call(potential.statement)
        return psi

    @property
    def evaluated(self) -> list[EvaluatedReaction]:
        """Reactions whose rates Cantera computes during a run."""
        return [law for law in self.mechanism.reactions if isinstance(law, EvaluatedReaction)]

    @property
    def loaded(self) -> bool:
        """True if a force changes any rate or constant."""
        rates = (self._log_rate([label], law.change) for label, law in self.laws.items())
        constants = (self._log_equilibrium(law.change, False) for law in self.laws.values())
        return any(depends(expression, FORCE) for expression in (*rates, *constants))

    def thermo(self, temperature: float) -> dict[str, Thermo]:
        """Return the standard thermo of every species at a temperature [K], without force."""
        found = {}
        for name, item in self.species.items():
            g = symengine.sympify(item.gibbs(TEMPERATURE))
            function = symengine.Lambdify([TEMPERATURE], [g, derivative(g, TEMPERATURE)], cse=True)
            value, slope = (GAS_CONSTANT * float(x) for x in function([temperature]))
            found[name] = Thermo(value - temperature * slope, -slope, value)
        return found

    def log_forward(self, label: str, temperatures: Array, forces: Array) -> Array:
        """Return the logarithm of the forward rate per possible bond [1/s]."""
        return self._evaluate(self._log_rate([label], self.laws[label].change), temperatures, forces)

    def log_reverse(self, label: str, temperatures: Array, forces: Array) -> Array | None:
        """Return the logarithm of the reverse rate per possible bond [1/s]; None if the reaction is irreversible."""
        if not self.laws[label].reversible:
            return None
        return self.log_forward(label, temperatures, forces) - self.log_equilibrium(label, temperatures, forces)

    def log_equilibrium(self, label: str, temperatures: Array, forces: Array) -> Array:
        """Return the logarithm of the equilibrium constant of the coverages."""
        paired = any(label in pair.labels for pair in self.pairs)
        return self._evaluate(self._log_equilibrium(self.laws[label].change, paired), temperatures, forces)

    def departure(self, pair: Opposed, temperatures: Array, forces: Array) -> Array:
        """Return ln(k_f/k_r) - ln K of a pair of opposed reactions."""
        forward, backward = (self._log_rate(laws, pair.change) for laws in (pair.forward, pair.backward))
        return self._evaluate(forward - backward - self._log_equilibrium(pair.change, True), temperatures, forces)

    def _call(self, formula: Callable[..., Expression]) -> Expression:
        return formula(**{name: self._known[name] for name in reads(formula)})

    def _log_rate(self, labels: Iterable[str], change: Mapping[str, int | float]) -> Expression:
        """Return the logarithm of a rate over the amount of the bond that the reaction makes or breaks."""
        laws = (self.laws[label] for label in labels)
        total = log_sum([self._call(law.bind(_symbols(law)).log_forward) for law in laws])
        return total - log(min(self._amounts[name] for name in change))

    def _log_equilibrium(self, change: Mapping[str, int | float], paired: bool) -> Expression:
        """Return the logarithm of the equilibrium constant; ``paired`` reactions include the work of a given force."""
        total: Expression = 0
        for name, nu in change.items():
            total += nu * derivative(self._psi, self._coverages[name]) / self._amounts[name]
            total -= nu * FORCE * self._lengths.get(name, 0) if paired else 0
        return -total / (BOLTZMANN * TEMPERATURE)

    def _evaluate(self, expression: Expression, temperatures: Array, forces: Array) -> Array:
        """Evaluate an expression at coverages of one."""
        full = symengine.sympify(expression).subs(dict.fromkeys(self._coverages.values(), 1))
        function = symengine.Lambdify([TEMPERATURE, FORCE, *self._numbers], [full], cse=True)
        points = np.stack(np.broadcast_arrays(temperatures, forces, *self._numbers.values()), axis=-1)
        return np.asarray(function(points), dtype=np.float64)[..., 0]


def _symbols(law: InterfaceArrhenius) -> dict[str, Expression]:
    """Return a symbol for every number of a law: the logarithm of a zero becomes infinite only when evaluated."""
    return {name: symengine.Symbol(f"{law.label}.{name}") for name, _ in law.specs()}


class ReactionCycle(NamedTuple):
    """Steps whose changes sum to zero, each with its multiplicity, which is negative if it is taken backwards."""

    steps: Sequence[tuple[Step, int]]

    @property
    def labels(self) -> tuple[str, ...]:
        """Labels of all reactions of the cycle."""
        pairs = (step.labels if isinstance(step, Opposed) else (step,) for step, _ in self.steps)
        return tuple(label for labels in pairs for label in labels)

    def departure(self, curves: Curves, temperatures: Array, forces: Array) -> Array:
        """Return the logarithm of the product of k_f/k_r around the cycle."""
        total = np.zeros(np.broadcast_shapes(np.shape(temperatures), np.shape(forces)))
        for step, times in self.steps:
            if isinstance(step, Opposed):
                total = total + times * curves.departure(step, temperatures, forces)
        return total


def cycles(curves: Curves) -> list[ReactionCycle]:
    """Return independent cycles with at least one pair or one-way reaction; others agree by construction."""
    paired = {label for pair in curves.pairs for label in pair.labels}
    steps: list[Step] = [*(label for label in curves.laws if label not in paired), *curves.pairs]
    changes = [curves.laws[step].change if isinstance(step, str) else step.change for step in steps]
    found = []
    for row in null_space(changes):
        taken = [(step, times) for step, times in zip(steps, row, strict=True) if times]
        if any(isinstance(step, Opposed) or not curves.laws[step].reversible for step, _ in taken):
            found.append(ReactionCycle(taken))
    return found


def null_space(changes: Sequence[Mapping[str, float]]) -> list[list[int]]:
    """Return integer combinations of changes that vanish, one for each change that depends on those before it."""
    from sympy import Matrix  # type: ignore[import-untyped]  # slow to import

    names = dict.fromkeys(name for change in changes for name in change)
    rows = [[Fraction(change.get(name, 0)).limit_denominator(1000) for change in changes] for name in names]
    found = []
    for row in Matrix(rows).nullspace() if rows else ():
        scale = lcm(*(int(value.q) for value in row))
        found.append([int(value * scale) for value in row])
    return found


def cycle_verdict(cycle: ReactionCycle, curves: Curves, temperatures: Array, forces: Array) -> str:
    """Return the verdict on a cycle in words: whether it comes to rest."""
    one_way = {step: times for step, times in cycle.steps if isinstance(step, str) and not curves.laws[step].reversible}
    if one_way and min(one_way.values()) < 0 < max(one_way.values()):
        return "goes round neither way, since it has one-way reactions in both directions"
    if one_way:
        return f"nothing stops it, since there is no way back from {', '.join(one_way)}: give each a reverse"
    values = cycle.departure(curves, temperatures, forces)
    worst = float(values.flat[int(np.abs(values).argmax())])
    if abs(worst) <= ROUNDED_DEPARTURE:
        return f"the product of k_f/k_r is 1 to within {abs(worst):.1e}"
    return f"INCONSISTENT: the product of k_f/k_r is not 1 but exp({worst:.3g}) at most, which no thermo allows"


# Temperature [K] at which the thermo of the species is shown, if it is in range.
STANDARD_T = 298.15

# Numbers of values of a range in tables and in curves.
TABLE_COLUMNS, CURVE_POINTS = 5, 200


class Span(NamedTuple):
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
    pulled = curves.pulled or "a bond"
    over_temperature = _table(curves, "T [K]", T, T, np.zeros(1)) if curves.laws else []
    over_force = _table(curves, "f [pN]", f * 1e12, np.array([shown]), f) if curves.loaded else []
    sections = {
        f"Species at {shown:g} K, without force": columns(_species(curves, shown)),
        "Reactions": list(reaction_lines(curves, temperatures, forces)),
        "Reactions whose rates Cantera gives, under `solver: cantera`": columns(outside),
        "Cycles": columns((" ".join(cycle.labels), cycle_verdict(cycle, curves, *grid)) for cycle in cycles(curves)),
        "Against temperature, without force; rates per bond at coverages of one": columns(over_temperature),
        f"Against the force on {pulled}, at {shown:g} K": columns(over_force),
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

    >>> power_of_ten(0.0), power_of_ten(1000.0), power_of_ten(-math.inf), power_of_ten(-1e23)
    ('1', '1.97e+434', '0', '1e-43429448190325178761216')
    """
    if not math.isfinite(logarithm):
        return "0" if logarithm < 0 else str(logarithm)
    if abs(logarithm) < 9:
        return f"{math.exp(logarithm):.4g}"
    exponent, rest = divmod(logarithm / math.log(10), 1.0)
    return f"{10**rest:.3g}e{int(exponent):+03d}"


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
