"""Numbers of a mechanism over temperature and force: standard thermo, equilibrium constants, rates, and their verdicts.

Everything is kept as logarithms, so that no exponent is too large to be shown. Rates are those at coverages of one, per
possible bond, so that forward over reverse is the equilibrium constant of the coverages whatever the order.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import symengine
from numpy.typing import NDArray

from surfacechem.contracts.terms import Potential, reads
from surfacechem.expressions import Expression, depends, derivative, log, log_sum
from surfacechem.mechanism import Mechanism
from surfacechem.mechanism.mixture import IdealMixture, Species
from surfacechem.mechanism.rates import SurfaceReaction
from surfacechem.model.components.pulled import lengths
from surfacechem.model.pairs import Opposed, opposed
from surfacechem.quantities import BOLTZMANN, GAS_CONSTANT

Array = NDArray[np.float64]

TEMPERATURE, FORCE = symengine.symbols("T_c f")


@dataclass(frozen=True)
class Thermo:
    """Standard enthalpy, entropy and Gibbs energy of a species [J/mol, J/(mol K), J/mol]."""

    h: float
    s: float
    g: float


class Curves:
    """Functions of temperature [K] and force per bond [N] that follow from a mechanism."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism
        self.laws = {law.label: law for law in mechanism.reactions if isinstance(law, SurfaceReaction)}
        self.pairs: Sequence[Opposed] = opposed(self.laws)
        symbols = {label: _symbols(law) for label, law in self.laws.items()}
        self._bound = {label: law.bind(symbols[label]) for label, law in self.laws.items()}
        self._numbers = {
            symbol: float(getattr(self.laws[label], name))
            for label in symbols
            for name, symbol in symbols[label].items()
        }
        self._amounts = {variable.name: variable.density for variable in mechanism.variables}
        self._coverages = {name: symengine.Symbol(name) for name in self._amounts}
        self._lengths = lengths(self.laws, self.pairs)
        self._psi = sum(self._call(_alone(law).statement) for law in mechanism.potentials)

    @property
    def loaded(self) -> bool:
        """Whether a force changes any rate or constant."""
        rates = (self._log_rate([label], law.change) for label, law in self.laws.items())
        constants = (self._log_equilibrium(law.change, False) for law in self.laws.values())
        return any(depends(expression, FORCE) for expression in (*rates, *constants))

    @property
    def pulled(self) -> str:
        """The species on which the force acts: the first elastic one, whose gap the others share; none otherwise."""
        return next((name for name, item in self.species.items() if item.spring and item.spring.stiffness), "")

    @property
    def species(self) -> dict[str, Species]:
        """The species by name."""
        mixtures = (law for law in self.mechanism.potentials if isinstance(law, IdealMixture))
        return {item.name: item for law in mixtures for item in law.species}

    @property
    def site_density(self) -> float:
        """Sites per reference area [1/m^2]."""
        item = next(iter(self.species.values()))
        return self._amounts[item.variable] * item.sites

    def thermo(self, temperature: float) -> dict[str, Thermo]:
        """Standard thermo of every species at a temperature [K], without force."""
        return {name: _thermo(item, temperature) for name, item in self.species.items()}

    def log_forward(self, label: str, temperatures: Array, forces: Array) -> Array:
        """Logarithm of the forward rate per possible bond [1/s]."""
        return self._evaluate(self._log_rate([label], self.laws[label].change), temperatures, forces)

    def log_reverse(self, label: str, temperatures: Array, forces: Array) -> Array | None:
        """Logarithm of the reverse rate per possible bond [1/s]; None where the reaction is irreversible."""
        if not self.laws[label].reversible:
            return None
        return self.log_forward(label, temperatures, forces) - self.log_equilibrium(label, temperatures, forces)

    def log_equilibrium(self, label: str, temperatures: Array, forces: Array) -> Array:
        """Logarithm of the equilibrium constant of the coverages."""
        paired = any(label in pair.labels for pair in self.pairs)
        return self._evaluate(self._log_equilibrium(self.laws[label].change, paired), temperatures, forces)

    def departure(self, pair: Opposed, temperatures: Array, forces: Array) -> Array:
        """ln(k_f/k_r) - ln K of reactions that undo each other."""
        forward, backward = (self._log_rate(laws, pair.change) for laws in (pair.forward, pair.backward))
        return self._evaluate(forward - backward - self._log_equilibrium(pair.change, True), temperatures, forces)

    def _log_rate(self, labels: Iterable[str], change: Mapping[str, int | float]) -> Expression:
        """At coverages of one, over the amount of the bond that the reaction makes or breaks."""
        total = log_sum([self._call(self._bound[label].log_forward) for label in labels])
        return self._filled(total) - log(min(self._amounts[name] for name in change))

    def _log_equilibrium(self, change: Mapping[str, int | float], paired: bool) -> Expression:
        """With the work of a prescribed force on reactions that undo each other."""
        total: Expression = 0
        for name, nu in change.items():
            total += nu * derivative(self._psi, self._coverages[name]) / self._amounts[name]
            total -= nu * FORCE * self._lengths.get(name, 0) if paired else 0
        return self._filled(-total / (BOLTZMANN * TEMPERATURE))

    def _filled(self, expression: Expression) -> Expression:
        return symengine.sympify(expression).subs(dict.fromkeys(self._coverages.values(), 1))

    def _call(self, formula: Callable[..., Expression]) -> Expression:
        known: dict[str, Expression] = {**self._coverages, "T_c": TEMPERATURE, "f": FORCE, "g_n": self._gap}
        known |= {f"{letter}_{name}": amount for letter in "Nn" for name, amount in self._amounts.items()}
        for item in self.species.values():
            if item.spring:
                known[f"f_{item.variable}"] = item.spring.stiffness * (self._gap - item.spring.rest_length)
        return formula(**{name: known[name] for name in reads(formula)})

    @property
    def _gap(self) -> Expression:
        """The gap at which the pulled bond carries the force; zero where no bond is elastic."""
        spring = self.species[self.pulled].spring if self.pulled else None
        return spring.rest_length + FORCE / spring.stiffness if spring else 0.0

    def _evaluate(self, expression: Expression, temperatures: Array, forces: Array) -> Array:
        function = symengine.Lambdify([TEMPERATURE, FORCE, *self._numbers], [expression], cse=True)
        points = np.stack(np.broadcast_arrays(temperatures, forces, *self._numbers.values()), axis=-1)
        return np.asarray(function(points), dtype=np.float64)[..., 0]


def _symbols(law: SurfaceReaction) -> dict[str, Expression]:
    """A symbol for every number of a law: the logarithm of one that is zero is infinite only when it is evaluated."""
    return {name: symengine.Symbol(f"{law.label}.{name}") for name, _ in law.specs()}


def _alone(law: Potential) -> Potential:
    """The potential without interactions, so that standard states depend on no coverage."""
    if not isinstance(law, IdealMixture):
        return law
    return law.bind({"species": tuple(replace(item, interactions=()) for item in law.species)})


def _thermo(species: Species, temperature: float) -> Thermo:
    g = symengine.sympify(species.gibbs(TEMPERATURE))
    function = symengine.Lambdify([TEMPERATURE], [g, derivative(g, TEMPERATURE)], cse=True)
    value, slope = (GAS_CONSTANT * float(x) for x in function([temperature]))
    return Thermo(value - temperature * slope, -slope, value)
