"""Rates of a mechanism over temperature and force: standard thermo, equilibrium constants, rates, and cycles.

All are kept as logarithms, so that no exponent overflows. Rates are those at coverages of one, per possible bond, so
that forward over reverse is the equilibrium constant of the coverages whatever the order.

Cycles are sequences of reactions whose changes sum to zero, so that in equilibrium the product of their k_f/k_r is one,
whatever the thermo of the species. Rates with another product keep the cycle running without end. Source: Wegscheider
(1901), Monatsh. Chem. 22, 849, doi 10.1007/BF01517498.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from math import lcm
from typing import Any, NamedTuple

import numpy as np
import symengine

from surfacechem.contracts.terms import reads
from surfacechem.expressions import Expression, depends, derivative, log, log_sum
from surfacechem.mechanism import Mechanism
from surfacechem.mechanism.evaluated import EvaluatedReaction
from surfacechem.mechanism.mixture import IdealMixture, Species
from surfacechem.mechanism.rates import InterfaceArrhenius
from surfacechem.model.components.pairs import Opposed, lengths, opposed
from surfacechem.quantities import BOLTZMANN, GAS_CONSTANT
from surfacechem.results.findings import ROUNDED_DEPARTURE
from surfacechem.solve.contract import Array

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
                species = tuple(replace(item, interactions=()) for item in potential.species)
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


@dataclass(frozen=True)
class ReactionCycle:
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
