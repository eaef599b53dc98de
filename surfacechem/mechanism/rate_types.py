"""The rate types that Cantera does not know: each is a law of a case, with an Arrhenius rate for its constant."""

from __future__ import annotations

import inspect
from abc import abstractmethod
from collections.abc import Mapping
from functools import cache
from typing import cast

from surfacechem.contracts.terms import RateFactor, parameter, reads
from surfacechem.errors import InputError
from surfacechem.expressions import Expression, log, log_fraction, log_sum, where
from surfacechem.laws import bonds
from surfacechem.laws.kinetics import ExponentialAffinity, LinearAffinity, autocatalysis
from surfacechem.mechanism.mixture import Formula
from surfacechem.mechanism.rates import GONE, InterfaceArrhenius, floored, plain
from surfacechem.quantities import BOLTZMANN, GAS_CONSTANT

PREFIX = "interface-"


class LoadedReaction(InterfaceArrhenius, RateFactor):
    """A surface reaction whose Arrhenius coefficient is multiplied by the factor of a load, which subclasses add.

    What the factor calls ``f`` is the force on the bond of this reaction.
    """

    formula = "rate"
    contract = "bonding"

    kind = ""
    native = False

    @classmethod
    def own_keys(cls) -> dict[str, str]:
        """Keys of the reaction in a mechanism file: the parameters of the factor."""
        arrhenius = dict(InterfaceArrhenius.specs())
        return {name.replace("_", "-"): name for name, _ in cls.specs() if name not in arrhenius}

    @property
    def load(self) -> str:
        """The force per bond: that of the elastic bond which reacts or forms, else the one shared or prescribed."""
        elastic = {item.variable for item in self.species if item.spring}
        return next((f"f_{name}" for name in (*self.orders, *self.products) if name in elastic), "f")

    @property
    def ranges(self) -> Mapping[str, tuple[float, float]]:
        """Those of the factor."""
        return {self.load if name == "f" else name: limits for name, limits in super().ranges.items()}

    @property
    def peaks(self) -> Mapping[str, Expression]:
        """Those of the factor."""
        return {self.load if name == "f" else name: top for name, top in super().peaks.items()}

    @property
    def distance(self) -> Expression | None:
        """That to the transition state, under a force that is not the bond's own."""
        return self.work_distance if self.load == "f" else None

    def own_reads(self) -> tuple[str, ...]:
        """Coverages, and the force or the gap."""
        arguments = (self.load if name == "f" else name for name in reads(self.log_factor) if name != "T_c")
        return (*super().own_reads(), *arguments)

    def exponent(self, values: Mapping[str, Expression]) -> Expression:
        """Exponent of the rate coefficient with that of the load."""
        arguments = {name: values[self.load if name == "f" else name] for name in reads(self.log_factor)}
        return super().exponent(values) + self.log_factor(**arguments)


class AffinityReaction(InterfaceArrhenius):
    r"""A reaction whose net rate is a function of its affinity that vanishes with it, so that it runs both ways.

    The amount of its reactants at full coverage gives the coefficient the unit that it has in mass action.
    """

    kind = ""
    native = False

    def __post_init__(self) -> None:
        """The equation says that it runs both ways."""
        super().__post_init__()
        # A net rate is one function; taken one way only it would run on against the affinity.
        if not self.reversible:
            raise InputError(f"reaction {self.equation}: a rate by affinity runs both ways; write `<=>`.", self.place)

    @abstractmethod
    def net(self, forward: Expression, mu: Expression, T_c: Expression) -> Expression:
        """Net rate at the forward rate of equal chemical potentials and their change mu [J]."""

    @property
    def rate(self) -> Formula:  # type: ignore[override]
        """Net rate [1/(m^2 s)]; the chemical potential change is that of the whole interface."""
        names = ("mu", *self._formula(self._forward).__signature__.parameters)
        return Formula(names, lambda values: self.net(self._forward(values), values["mu"], values["T_c"]))

    def _forward(self, values: Mapping[str, Expression], shift: Expression = 0) -> Expression:
        product = self.coefficient(values, shift)
        for item in self.species:
            product *= values[item.concentration] ** plain(self.orders.get(item.variable, 0))
        return product

    def _reverse(self, values: Mapping[str, Expression]) -> Expression:
        affinity = self.standard_affinity(values["T_c"], values.get("g_n"), values)
        changed = [(plain(nu), values[name]) for name, nu in self.change.items() if nu]
        return self._forward(values, affinity + sum(nu * log_fraction(theta) for nu, theta in changed))

    def _log_forward(self, values: Mapping[str, Expression]) -> Expression:
        orders = ((values[item.concentration], self.orders.get(item.variable, 0)) for item in self.species)
        return self.log_coefficient(values) + sum(plain(order) * log(full) for full, order in orders)


class InterfaceLinearAffinity(AffinityReaction):
    r"""Rate proportional to the affinity in a mechanism, ``type: linear-affinity``.

    .. math:: R = -k(T) \prod_k (n_k^\circ)^{r_k}\,\frac{\mu}{k_B T}

    b = 1 makes :math:`c_r` of the law independent of temperature. Always admissible.
    Source: Sauer, Duong & Mandadapu (2021), eq. e:R.
    """

    kind = "interface-linear-affinity"

    def net(self, forward: Expression, mu: Expression, T_c: Expression) -> Expression:
        """The law linear-affinity with c_r = k / k_B T for a reaction of first order."""
        return LinearAffinity(c_r=0.0).bind({"c_r": 1 / (BOLTZMANN * T_c)}).rate(mu=mu, n_c=forward)


class InterfaceExponentialAffinity(AffinityReaction):
    r"""Rate exponential in the affinity in a mechanism, ``type: exponential-affinity``.

    .. math:: R = k(T) \prod_k (n_k^\circ)^{r_k} \left( 1 - e^{\mu / k_B T} \right)

    Always admissible. Source: Sauer, Duong & Mandadapu (2021), the equation after e:R.
    """

    kind = "interface-exponential-affinity"

    def net(self, forward: Expression, mu: Expression, T_c: Expression) -> Expression:
        """The law exponential-affinity with C_r = n_c k / k_B T for a reaction of first order."""
        return ExponentialAffinity(C_r=0.0).bind({"C_r": forward / (BOLTZMANN * T_c)}).rate(mu=mu, T_c=T_c)


class InterfaceKamalSourour(InterfaceArrhenius):
    r"""Autocatalytic cure in a mechanism, ``type: Kamal-Sourour``: what is formed speeds up its own formation.

    .. math:: R = n^\circ \left( A\,T^b e^{-E_a / R_g T} + A_2 e^{-E_2 / R_g T} \theta_p^{\,m} \right) \theta_r^{\,n}

    One species r turns into one species p. Admissible where it is reversible or mu <= 0.
    Source: Kamal & Sourour (1973), Polym. Eng. Sci. 13, 59, doi 10.1002/pen.760130110.
    """

    kind = "interface-Kamal-Sourour"
    native = False

    A_2: float = parameter("1/s", "pre-exponential factor of autocatalysis", at_least=0)
    E_2: float = parameter("J/mol", "activation energy of autocatalysis", default=0.0)
    m: float = parameter("1", "order of autocatalysis", default=1.0, above=0)
    n: float = parameter("1", "order in what has not reacted", default=1.0, above=0)

    def __post_init__(self) -> None:
        """One species turns into another."""
        super().__post_init__()
        if set(self.orders.values()) != {1.0} or set(self.products.values()) != {1.0} or len(self.change) != 2:
            message = f"reaction {self.equation}: Kamal-Sourour is for one species that turns into another, `a => b`."
            raise InputError(message, self.place)

    @classmethod
    def own_keys(cls) -> dict[str, str]:
        return {"A-2": "A_2", "E-2": "E_2", "m": "m", "n": "n"}

    def coefficient(self, values: Mapping[str, Expression], shift: Expression) -> Expression:
        """The rate coefficient times exp(shift)."""
        shift, (product,) = shift + self._order(values), self.products
        catalysed = autocatalysis(self.A_2, self.E_2, self.m, values[product], values["T_c"], shift)
        return super().coefficient(values, shift) + catalysed

    def log_coefficient(self, values: Mapping[str, Expression]) -> Expression:
        """Logarithm of the rate coefficient."""
        (product,) = self.products
        catalysis = self.m * log_fraction(values[product]) - self.E_2 / (GAS_CONSTANT * values["T_c"])
        return log_sum([super().log_coefficient(values), log(self.A_2) + catalysis]) + self._order(values)

    def _order(self, values: Mapping[str, Expression]) -> Expression:
        """What the coefficient lacks as mass action is of first order."""
        (reactant,) = self.orders
        theta = values[reactant]
        return (self.n - 1) * where(self.n < 1, log(floored(theta, GONE)), log_fraction(theta))


@cache
def kinds() -> dict[str, type[InterfaceArrhenius]]:
    """Every rate type that is lowered, by Cantera's name: those of this module, and one for each factor of a load."""
    known: list[type[InterfaceArrhenius]] = [
        InterfaceArrhenius,
        InterfaceLinearAffinity,
        InterfaceExponentialAffinity,
        InterfaceKamalSourour,
    ]
    for factor in vars(bonds).values():
        if inspect.isclass(factor) and issubclass(factor, RateFactor) and factor is not RateFactor:
            text = inspect.getdoc(factor) or ""
            words = text.partition("\n\n>>>")[0]  # the worked number is that of the factor
            own = {"kind": PREFIX + factor.rate_type, "__doc__": words, "__module__": __name__}
            name = f"Interface{factor.__name__.removesuffix('Factor')}"
            known.append(cast(type[InterfaceArrhenius], type(name, (LoadedReaction, factor), own)))
    return {law.kind: law for law in known}


def kind_of(name: str) -> type[InterfaceArrhenius] | None:
    """The rate type that a mechanism calls by that name; Cantera puts the prefix where it is missing."""
    plain_name = "Arrhenius" if name == "elementary" else name
    return kinds().get(plain_name) or kinds().get(PREFIX + plain_name)


def names() -> list[str]:
    """The rate types as a mechanism writes them."""
    return [kind.removeprefix(PREFIX) for kind in kinds()]
