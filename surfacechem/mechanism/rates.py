"""Rates of surface reactions: mass action whose reverse follows from the thermo, Arrhenius, and all other rate types.

The rate types that Cantera does not have are laws of a case, with an Arrhenius coefficient as their constant: a load
factor of a law of :mod:`surfacechem.laws.kinetics` becomes one by the law's ``rate_types``. Any other rate type is a
subclass with Cantera's name as ``kind`` and a ``coefficient``.
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, field, fields
from functools import cache
from typing import Any, ClassVar, NamedTuple, Self, cast

from surfacechem.contracts.terms import RateLaw, RateType, Spec, option, parameter, reads
from surfacechem.errors import InputError
from surfacechem.expressions import Expression, log, log_fraction, log_sum, polynomial, power, scaled_exp, where
from surfacechem.laws import laws
from surfacechem.mechanism.thermo import Bind, Formula, Species
from surfacechem.quantities import BOLTZMANN, GAS_CONSTANT, KILO, MOLECULAR

COVERAGE_FLOOR = 1e-20
"""Floor of coverages in a rate that depends on their logarithm, as in Cantera."""

USED = 1e-14
"""Coverage below which a reaction of an order below one is complete.

A power has an infinite slope at its end, and order zero a step; below this coverage the rate is proportional to it. A
step advances time by at least 4e-16 of itself. A coverage that is consumed within the elapsed time falls by as much, so
that this layer has room for 25 steps.
"""


class CoverageTerm(NamedTuple):
    """Factor of a rate by one coverage: 10^(a theta) theta^m exp(-E(theta) / R T), E a polynomial [J/mol]."""

    variable: str
    a: float = 0.0
    m: float = 0.0
    E: tuple[float, ...] = ()

    def exponent(self, theta: Expression, T: Expression) -> Expression:
        """Logarithm of the factor."""
        energy: Expression = theta * polynomial(theta, self.E) if self.E else 0
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
        return spec._replace(unit=unit_of_rate(sum(self.orders.values()))) if name == "A" else spec

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

    def standard_affinity(self, T: Expression, g_n: Expression, coverages: Mapping[str, Expression]) -> Expression:
        """Return the standard Gibbs energy of the reaction over k_B T, including the elastic energy of bonds at the gap
        ``g_n`` [m] and the interactions of coverages.
        """
        total: Expression = 0
        for item in self.species:
            nu = self.change.get(item.variable)
            if not nu:
                continue
            value = item.gibbs(T)
            if item.spring is not None:
                value += item.spring.energy(g_n) / BOLTZMANN
            for interaction in item.interactions:
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


CANTERA_PREFIX = "interface-"


class LawReaction(InterfaceArrhenius):
    """A surface reaction by a law of a case, with the Arrhenius coefficient as its constant.

    The classes of rate types are made by :func:`_made`, one for each rate type of a law.
    """

    kind = ""
    native = False
    law: ClassVar[type[RateLaw]]
    rate_type: ClassVar[RateType]
    parameters: ClassVar[Mapping[str, str]]
    """Parameters of the law by their names in a mechanism."""

    @classmethod
    def own_keys(cls) -> dict[str, str]:
        """Keys of the reaction in a mechanism file: the parameters of the law, except its rate constants."""
        return {name.replace("_", "-"): name for name in cls.parameters}

    @property
    def stated(self) -> Any:
        """The law with the parameters of this reaction."""
        own: dict[str, Any] = {name: getattr(self, own) for own, name in self.parameters.items()}
        return self.law(**own | dict(self.rate_type.constants))


class LoadedReaction(LawReaction):
    """A reaction whose Arrhenius coefficient has the load factor of a law of bonds.

    The law's ``f`` is the force on the bond of this reaction.
    """

    @property
    def log_factor(self) -> Callable[..., Expression]:
        """Logarithm of the factor of the load on the coefficient."""
        factor: Callable[..., Expression] = getattr(self.stated, self.rate_type.method)
        return factor

    @property
    def load(self) -> str:
        """The force per bond: that of the elastic bond that reacts or forms, else the shared or prescribed one."""
        elastic = {item.variable for item in self.species if item.spring}
        return next((f"f_{name}" for name in (*self.orders, *self.products) if name in elastic), "f")

    @property
    def ranges(self) -> Mapping[str, tuple[float, float]]:
        """Ranges of the law."""
        return {self.load if name == "f" else name: limits for name, limits in self.stated.ranges.items()}

    @property
    def peaks(self) -> Mapping[str, Expression | Sequence[Expression]]:
        """Peaks of the law."""
        return {self.load if name == "f" else name: top for name, top in self.stated.peaks.items()}

    @property
    def distance(self) -> Expression | None:
        """Distance to the transition state, if the force is not that of an elastic bond."""
        known = self.rate_type.distance and self.load == "f"
        return vars(self.stated)[self.rate_type.distance] if known else None

    def own_reads(self) -> tuple[str, ...]:
        """Coverages, and the force or the gap."""
        arguments = (self.load if name == "f" else name for name in reads(self.log_factor) if name != "T_c")
        return (*super().own_reads(), *arguments)

    def exponent(self, values: Mapping[str, Expression]) -> Expression:
        """Exponent of the rate coefficient, including that of the load."""
        log_factor = self.log_factor
        arguments = {name: values[self.load if name == "f" else name] for name in reads(log_factor)}
        return super().exponent(values) + log_factor(**arguments)


class AffinityReaction(LawReaction):
    r"""A reaction whose net rate is a function of its affinity and vanishes with it: it is reversible.

    The amounts of its reactants at full coverage give the coefficient the same unit as in mass action.
    """

    def __post_init__(self) -> None:
        """Check that the equation is reversible."""
        super().__post_init__()
        # The net rate is one function; its forward part alone would run against the affinity.
        if not self.reversible:
            raise InputError(f"reaction {self.equation}: a rate by affinity runs both ways; write `<=>`.", self.place)

    def net(self, forward: Expression, mu: Expression, T_c: Expression) -> Expression:
        """Return the net rate from the forward rate at zero affinity and the change of chemical potential mu [J]."""
        rate: Expression = self.stated.net(forward, mu, T_c)
        return rate

    @property
    def rate(self) -> Formula:  # type: ignore[override]
        """Net rate [1/(m^2 s)]; the change of chemical potential is that of the whole interface."""
        names = ("mu", *self._formula(self._forward).__signature__.parameters)
        return Formula(names, lambda values: self.net(self._forward(values), values["mu"], values["T_c"]))

    def _forward(self, values: Mapping[str, Expression]) -> Expression:
        # Amounts at full coverage: the coverages are in the affinity.
        product = self.coefficient(values, 0)
        for item in self.species:
            product *= values[item.concentration] ** plain(self.orders.get(item.variable, 0))
        return product

    def _log_forward(self, values: Mapping[str, Expression]) -> Expression:
        orders = ((values[item.concentration], self.orders.get(item.variable, 0)) for item in self.species)
        return self.log_coefficient(values) + sum(plain(order) * log(full) for full, order in orders)


class CureReaction(LawReaction):
    """A reaction catalysed by its product: one species turns into another."""

    def __post_init__(self) -> None:
        """Check that one species turns into another."""
        super().__post_init__()
        if set(self.orders.values()) != {1.0} or set(self.products.values()) != {1.0} or len(self.change) != 2:
            message = f"reaction {self.equation}: Kamal-Sourour is for one species that turns into another, `a => b`."
            raise InputError(message, self.place)

    def coefficient(self, values: Mapping[str, Expression], shift: Expression) -> Expression:
        """Return the rate coefficient times exp(shift)."""
        shift, (product,) = shift + self._order(values), self.products
        return super().coefficient(values, shift) + self.stated.catalysed(values[product], values["T_c"], shift)

    def log_coefficient(self, values: Mapping[str, Expression]) -> Expression:
        """Return the logarithm of the rate coefficient."""
        law, (product,) = self.stated, self.products
        catalysis = law.m * log_fraction(values[product]) - law.E_2 / (GAS_CONSTANT * values["T_c"])
        return log_sum([super().log_coefficient(values), log(law.A_2) + catalysis]) + self._order(values)

    def _order(self, values: Mapping[str, Expression]) -> Expression:
        """Return the logarithm of theta^(n - 1), the difference of the order n from that of mass action, one."""
        (reactant,), n = self.orders, self.stated.n
        theta = values[reactant]
        return (n - 1) * where(n < 1, log(floored(theta, USED)), log_fraction(theta))


REACTIONS: Mapping[str, type[LawReaction]] = {"net": AffinityReaction, "catalysed": CureReaction}
"""Reactions by the method of a law; any other method is the logarithm of a load factor."""


def _made(law: type[RateLaw], rate_type: RateType) -> type[LawReaction]:
    """Make the reaction class of a rate type: its parameters are fields of the law, its docstring the method's."""
    renamed = {**rate_type.renamed, **rate_type.ratios}
    parameters = {**renamed, **{name: name for name in rate_type.names}}
    given = {item.name: item for item in fields(law)}
    own: dict[str, Any] = {}
    for name, source in parameters.items():
        spec = given[source].metadata["spec"]
        if name in rate_type.ratios:
            # The law's constant is one here, so that the other constants are ratios to the Arrhenius coefficient.
            spec = spec._replace(unit="1", text=f"{spec.text}, over the rate constant")
        own[name] = field(default=MISSING if name in renamed else given[source].default, metadata={"spec": spec})
    text = inspect.getdoc(getattr(law, rate_type.method)) or ""
    namespace = {
        "__doc__": text.partition("\n\n>>>")[0],  # the worked number is for the law
        "__module__": __name__,
        "__annotations__": dict.fromkeys(own, float),
        "kind": CANTERA_PREFIX + rate_type.name,
        "law": law,
        "rate_type": rate_type,
        "parameters": parameters,
        **own,
    }
    name = "Interface" + rate_type.name.replace("-", " ").title().replace(" ", "")
    return cast(type[LawReaction], type(name, (REACTIONS.get(rate_type.method, LoadedReaction),), namespace))


@cache
def kinds() -> dict[str, type[InterfaceArrhenius]]:
    """Return every rate type that is lowered, by Cantera's name: Arrhenius, and those that laws of bonding list."""
    known: dict[str, type[InterfaceArrhenius]] = {InterfaceArrhenius.kind: InterfaceArrhenius}
    for law in laws(RateLaw).values():
        assert issubclass(law, RateLaw)
        for made in (_made(law, rate_type) for rate_type in law.rate_types):
            known.setdefault(made.kind, made)  # laws of the package come first, and keep their names
    return known


def __getattr__(name: str) -> type[InterfaceArrhenius]:
    """Return the class of a rate type by its name, for `pickle`."""
    for made in kinds().values() if name.startswith("Interface") else ():
        if made.__name__ == name:
            return made
    raise AttributeError(name)


def kind_of(name: str) -> type[InterfaceArrhenius] | None:
    """Return the rate type of a name in a mechanism, with or without Cantera's prefix."""
    plain_name = "Arrhenius" if name == "elementary" else name
    return kinds().get(plain_name) or kinds().get(CANTERA_PREFIX + plain_name)


def names() -> list[str]:
    """Return the rate types as they are written in a mechanism."""
    return [kind.removeprefix(CANTERA_PREFIX) for kind in kinds()]
