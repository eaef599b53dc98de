"""Rates of surface reactions: mass action whose reverse follows from the thermo, and Cantera's Arrhenius coefficient.

The other rate types are in :mod:`surfacechem.mechanism.rate_types`. A load factor of a law of
:mod:`surfacechem.laws.kinetics` becomes a rate type by the law's ``rate_types``; any other rate type is a subclass with
Cantera's name as ``kind`` and a ``coefficient``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

from surfacechem.contracts.terms import RateLaw, Spec, option, parameter
from surfacechem.expressions import Expression, log, log_fraction, power, scaled_exp, where
from surfacechem.mechanism.mixture import Formula, Species
from surfacechem.mechanism.thermo import Bind
from surfacechem.quantities import BOLTZMANN, GAS_CONSTANT, KILO, MOLECULAR

NO_COVERAGES: Mapping[str, Expression] = {}

COVERAGE_FLOOR = 1e-20
"""Floor of coverages in a rate that depends on their logarithm, as in Cantera."""

USED = 1e-14
"""Coverage below which a reaction of an order below one is complete.

A power has an infinite slope at its end, and order zero a step; below this coverage the rate is proportional to it. A
step advances time by at least 4e-16 of itself. A coverage that is consumed within the elapsed time falls by as much, so
that this layer has room for 25 steps.
"""


@dataclass(frozen=True)
class CoverageTerm:
    """Factor of a rate by one coverage: 10^(a theta) theta^m exp(-E(theta) / R T), E a polynomial [J/mol]."""

    variable: str
    a: float = 0.0
    m: float = 0.0
    E: tuple[float, ...] = ()

    def exponent(self, theta: Expression, T: Expression) -> Expression:
        """Logarithm of the factor."""
        energy: Expression = 0
        for coefficient in reversed(self.E):  # Horner, from the first power on: E(0) = 0
            energy = theta * (energy + coefficient)
        # One exponent for Cantera's three dependences, so that no factor overflows.
        value = self.a * math.log(10) * theta - energy / (GAS_CONSTANT * T)
        if self.m:
            value += self.m * log(floored(theta))
        return value


def floored(theta: Expression, floor: float = COVERAGE_FLOOR) -> Expression:
    """Return the coverage, at least a floor.

    >>> floored(0.5), floored(0.0)
    (0.5, 1e-20)
    """
    return where(theta > floor, theta, floor + 0 * theta)


class MechanismReaction(RateLaw):
    """A reaction of a mechanism: its name, its equation and its stoichiometry."""

    number: str = option("short name of the reaction")
    equation: str = option("the reaction as the mechanism writes it")
    change: Mapping[str, float] = option("products less reactants, for each coverage")

    @property
    def label(self) -> str:
        """Short name for the quantities of this reaction."""
        return self.number

    @property
    def title(self) -> str:
        """The reaction in words."""
        return self.equation

    def stoichiometry(self) -> Mapping[str, int | float]:
        """Change of each coverage, in molecules."""
        return {name: plain(nu) for name, nu in self.change.items() if nu}


class InterfaceArrhenius(MechanismReaction):
    r"""Mass action on a surface with a modified Arrhenius coefficient, per current area.

    .. math:: R = k(T) \left[ \prod_k n_k^{\,r_k}
              - e^{(\Delta g + \Delta w) / k_B T} \prod_k (n_k^\circ)^{-\nu_k} \prod_k n_k^{\,p_k} \right],
              \quad n_k = n_k^\circ \theta_k

    .. math:: k = A\,T^b \exp\left( -\frac{E_a}{R_g T} \right)
              \prod_k 10^{a_k \theta_k}\,\theta_k^{m_k} \exp\left( -\frac{E_k(\theta_k)}{R_g T} \right)

    r are the orders, p the coefficients of the products, :math:`\nu = p - r`, and :math:`n_k^\circ = N_k / J_c` the
    amount of species k per current area at full coverage; w is the elastic energy of bonds across the gap. The bracket
    vanishes where the reaction's affinity does. Other rate types are subclasses with another ``coefficient``.

    Source: Kee, Coltrin, Glarborg & Zhu, Chemically Reacting Flow (2018), ch. 11; Cantera's interface-Arrhenius with
    its coverage dependencies. Admissible where it is reversible; an irreversible reaction needs mu <= 0.
    """

    kind: ClassVar[str] = "interface-Arrhenius"
    """Cantera's name of the rate type."""
    keys: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "rate-constant": ("A", "b", "Ea"),
        "coverage-dependencies": ("a", "m", "E"),
    }
    """Keys of a reaction of this type in addition to those of every reaction, with the keys inside."""
    native: ClassVar[bool] = True
    """True if Cantera has the type without an extension."""

    orders: Mapping[str, float] = option("forward order of each coverage")
    products: Mapping[str, float] = option("product coefficient of each coverage")
    species: tuple[Species, ...] = option("the species that take part")
    reversible: bool = option("whether the reverse follows from the thermo", default=True)
    A: float = parameter("m^(2n-2)/s", "pre-exponential factor at 1 K, per molecule; n is the total order")
    b: float = parameter("1", "temperature exponent", default=0.0)
    Ea: float = parameter("J/mol", "activation energy", default=0.0)
    coverage: tuple[CoverageTerm, ...] = option("dependence on coverages", default=())

    @classmethod
    def own_keys(cls) -> dict[str, str]:
        """Keys of the reaction in a mechanism file that are not Cantera's, each with its field."""
        return {}

    @classmethod
    def parameters_of(cls, reaction: Any, variables: Mapping[str, str], order: float) -> Mapping[str, Any]:
        """Return A, b, Ea and coverage terms, in SI units per molecule, from a Cantera reaction of a total order."""
        rate, terms = reaction.rate, []
        for name, term in sorted(rate.coverage_dependencies.items()):
            energies = term["E"] if isinstance(term["E"], list | tuple) else [term["E"]]
            E = tuple(float(energy) / KILO for energy in energies)
            terms.append(CoverageTerm(variables[name], float(term["a"]), float(term["m"]), E))
        return {
            # One kmol^(1 - n) for a reaction of order n, since the rate is in kmol too.
            "A": rate.pre_exponential_factor * MOLECULAR ** (1 - order),
            "b": rate.temperature_exponent,
            "Ea": rate.activation_energy / KILO,
            "coverage": tuple(terms),
        }

    def with_parts(self, bind: Bind) -> Self:
        """Return the reaction with symbols for the parameters of its species."""
        return self.bind({"species": tuple(bind(item, item.path, "") for item in self.species)})

    def refine(self, name: str, spec: Spec) -> Spec:
        """Return the specification; the unit of A follows from the order of this reaction."""
        return replace(spec, unit=unit_of_rate(sum(self.orders.values()))) if name == "A" else spec

    def own_reads(self) -> tuple[str, ...]:
        """Return the variables of the coefficient other than temperature."""
        return tuple(term.variable for term in self.coverage)

    def exponent(self, values: Mapping[str, Expression]) -> Expression:
        """Exponent of the rate coefficient."""
        T = values["T_c"]
        value = -self.Ea / (GAS_CONSTANT * T)
        for term in self.coverage:
            value += term.exponent(values[term.variable], T)
        return value

    def coefficient(self, values: Mapping[str, Expression], shift: Expression) -> Expression:
        """Return the rate coefficient times exp(shift), as one exponential so that neither factor overflows."""
        return scaled_exp(self.A * values["T_c"] ** self.b, self.exponent(values) + shift)

    def log_coefficient(self, values: Mapping[str, Expression]) -> Expression:
        """Logarithm of the rate coefficient."""
        return log(self.A) + self.b * log(values["T_c"]) + self.exponent(values)

    @property
    def balanced(self) -> bool:
        """True if the reverse follows from the thermo."""
        return self.reversible

    @property
    def rate(self) -> Formula:  # type: ignore[override]
        """Net rate [1/(m^2 s)]."""
        return self._formula(lambda values: self._forward(values) - self._reverse(values))

    @property
    def forward(self) -> Formula:
        """Forward rate [1/(m^2 s)]."""
        return self._formula(self._forward)

    @property
    def reverse(self) -> Formula:
        """Reverse rate [1/(m^2 s)]; zero for an irreversible reaction."""
        return self._formula(self._reverse)

    @property
    def log_forward(self) -> Formula:
        """Logarithm of the forward rate [ln 1/(m^2 s)]."""
        return self._formula(self._log_forward)

    @property
    def log_rate(self) -> Formula | None:
        """Logarithm of the rate of an irreversible reaction; None for a reversible one."""
        return None if self.reversible else self.log_forward

    def _formula(self, evaluate: Callable[[Mapping[str, Expression]], Expression]) -> Formula:
        # The affinity depends on the gap if an elastic species changes, and on the coverages that interact with it.
        changing = [item for item in self.species if self.reversible and self.change.get(item.variable)]
        # Only what is needed: a variable that no formula reads is left out of the equations.
        gap = ("g_n",) if any(item.spring for item in changing) else ()
        own = (name for item in self.species for name in (item.variable, item.concentration))
        around = (x.variable for item in changing for x in item.interactions)
        return Formula(("T_c", *gap, *own, *around, *self.own_reads()), evaluate)

    def _forward(self, values: Mapping[str, Expression]) -> Expression:
        return self.coefficient(values, 0) * self._amounts(values, self.orders, -1)

    def _log_forward(self, values: Mapping[str, Expression]) -> Expression:
        total = self.log_coefficient(values)
        for item in self.species:
            order = self.orders.get(item.variable, 0)
            if order:
                total += plain(order) * (log(values[item.concentration]) + log_fraction(values[item.variable]))
        return total

    def _reverse(self, values: Mapping[str, Expression]) -> Expression:
        if not self.reversible:
            return 0
        # The equilibrium constant of coverages is exp(-affinity); that of amounts has these powers as factors.
        standard: Expression = 1
        for item in self.species:
            standard *= values[item.concentration] ** plain(-self.change.get(item.variable, 0))
        affinity = self.standard_affinity(values["T_c"], values.get("g_n"), values)
        # One exponential of the sum: coefficient and constant may overflow while their product does not.
        return self.coefficient(values, affinity) * standard * self._amounts(values, self.products, 1)

    def standard_affinity(
        self, T: Expression, g_n: Expression = None, coverages: Mapping[str, Expression] = NO_COVERAGES
    ) -> Expression:
        """Return the standard Gibbs energy of the reaction over k_B T, including the elastic energy of bonds.

        The elastic energy is that at the gap ``g_n`` [m]. Interactions are included if ``coverages`` are given.
        """
        total: Expression = 0
        for item in self.species:
            nu = self.change.get(item.variable)
            if not nu:
                continue
            value = item.gibbs(T)
            if item.spring is not None:
                value += item.spring.energy(g_n) / BOLTZMANN
            for interaction in item.interactions if coverages else ():
                value += interaction.gibbs(T, coverages[interaction.variable]) / GAS_CONSTANT
            total += plain(nu) * value
        return total / T

    def _amounts(self, values: Mapping[str, Expression], orders: Mapping[str, float], way: int) -> Expression:
        """Return the product of amounts to their orders in the forward (-1) or backward (1) rate.

        It vanishes with each species that the reaction consumes.
        """
        product: Expression = 1
        for item in self.species:
            order, theta = orders.get(item.variable, 0), values[item.variable]
            # Below first order the slope is infinite at zero coverage, which no step can follow.
            if order < 1 and way * self.change.get(item.variable, 0) > 0:
                product *= values[item.concentration] ** plain(order) * theta * floored(theta, USED) ** plain(order - 1)
            elif order:
                product *= power(values[item.concentration] * theta, plain(order))
        return product


def unit_of_rate(order: float) -> str:
    """Return the unit of a rate coefficient for a total order.

    >>> unit_of_rate(1), unit_of_rate(2), unit_of_rate(0)
    ('1/s', 'm^2/s', '1/(m^2 s)')
    """
    exponent = 2 * order - 2
    if exponent == 0:
        return "1/s"
    return f"m^{plain(exponent)}/s" if exponent > 0 else f"1/(m^{plain(-exponent)} s)"


def plain(number: float) -> int | float:
    """Return an integer for a whole number, so that powers stay integer powers.

    >>> plain(2.0), plain(0.5)
    (2, 0.5)
    """
    return int(number) if float(number).is_integer() else float(number)
