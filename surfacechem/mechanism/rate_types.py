"""The rate types that Cantera does not know: each is a law of a case, with an Arrhenius rate for its constant."""

from __future__ import annotations

import inspect
from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, field, fields, replace
from functools import cache
from typing import Any, ClassVar, cast

from surfacechem.contracts.terms import RateLaw, RateType, parameter, reads
from surfacechem.errors import InputError
from surfacechem.expressions import Expression, log, log_fraction, log_sum, where
from surfacechem.laws import bonds
from surfacechem.laws.kinetics import ExponentialAffinity, LinearAffinity, autocatalysis
from surfacechem.mechanism.mixture import Formula
from surfacechem.mechanism.rates import GONE, InterfaceArrhenius, floored, plain
from surfacechem.quantities import BOLTZMANN, GAS_CONSTANT

PREFIX = "interface-"


class LoadedReaction(InterfaceArrhenius):
    """A surface reaction whose Arrhenius coefficient a load changes as it changes a coefficient of a law of bonds.

    What the law calls ``f`` is the force on the bond of this reaction. Subclasses are made by :func:`_loaded`.
    """

    kind = ""
    native = False
    law: ClassVar[type[RateLaw]]
    rate_type: ClassVar[RateType]

    parameters: ClassVar[Mapping[str, str]]
    """Parameters of the law by their names in a mechanism."""

    @classmethod
    def own_keys(cls) -> dict[str, str]:
        """Keys of the reaction in a mechanism file: the parameters of the law, but for its rate constants."""
        return {name.replace("_", "-"): name for name in cls.parameters}

    @property
    def stated(self) -> RateLaw:
        """The law with the numbers of this reaction, and a rate constant of one."""
        own: dict[str, Any] = {name: getattr(self, own) for own, name in self.parameters.items()}
        return self.law(**own | dict(self.rate_type.constants))

    @property
    def log_factor(self) -> Callable[..., Expression]:
        """Logarithm of what the load does to the coefficient."""
        factor: Callable[..., Expression] = getattr(self.stated, self.rate_type.factor)
        return factor

    @property
    def load(self) -> str:
        """The force per bond: that of the elastic bond which reacts or forms, else the one shared or prescribed."""
        elastic = {item.variable for item in self.species if item.spring}
        return next((f"f_{name}" for name in (*self.orders, *self.products) if name in elastic), "f")

    @property
    def ranges(self) -> Mapping[str, tuple[float, float]]:
        """Those of the law."""
        return {self.load if name == "f" else name: limits for name, limits in self.stated.ranges.items()}

    @property
    def peaks(self) -> Mapping[str, Expression | Sequence[Expression]]:
        """Those of the law."""
        return {self.load if name == "f" else name: top for name, top in self.stated.peaks.items()}

    @property
    def distance(self) -> Expression | None:
        """That to the transition state, under a force that is not the bond's own."""
        known = self.rate_type.distance and self.load == "f"
        return vars(self.stated)[self.rate_type.distance] if known else None

    def own_reads(self) -> tuple[str, ...]:
        """Coverages, and the force or the gap."""
        arguments = (self.load if name == "f" else name for name in reads(self.log_factor) if name != "T_c")
        return (*super().own_reads(), *arguments)

    def exponent(self, values: Mapping[str, Expression]) -> Expression:
        """Exponent of the rate coefficient with that of the load."""
        log_factor = self.log_factor
        arguments = {name: values[self.load if name == "f" else name] for name in reads(log_factor)}
        return super().exponent(values) + log_factor(**arguments)


def _loaded(law: type[RateLaw], rate_type: RateType) -> type[LoadedReaction]:
    """The reaction of a rate type: its parameters are fields of the law, its documentation that of the factor."""
    renamed = {**rate_type.renamed, **rate_type.ratios}
    parameters = {**renamed, **{name: name for name in rate_type.names}}
    given = {item.name: item for item in fields(law)}
    own: dict[str, Any] = {}
    for name, source in parameters.items():
        spec = given[source].metadata["spec"]
        if name in rate_type.ratios:
            spec = replace(spec, unit="1", text=f"{spec.text}, over the rate constant")
        own[name] = field(default=MISSING if name in renamed else given[source].default, metadata={"spec": spec})
    text = inspect.getdoc(getattr(law, rate_type.factor)) or ""
    namespace = {
        "__doc__": text.partition("\n\n>>>")[0],  # the worked number is that of the law
        "__module__": __name__,
        "__annotations__": dict.fromkeys(own, float),
        "kind": PREFIX + rate_type.name,
        "law": law,
        "rate_type": rate_type,
        "parameters": parameters,
        **own,
    }
    name = "Interface" + rate_type.name.replace("-", " ").title().replace(" ", "")
    return cast(type[LoadedReaction], type(name, (LoadedReaction,), namespace))


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
    """Every rate type that is lowered, by Cantera's name: those of this module, and those of bonds under load."""
    known: list[type[InterfaceArrhenius]] = [
        InterfaceArrhenius,
        InterfaceLinearAffinity,
        InterfaceExponentialAffinity,
        InterfaceKamalSourour,
    ]
    for law in vars(bonds).values():
        if inspect.isclass(law) and issubclass(law, RateLaw):
            known.extend(_loaded(law, rate_type) for rate_type in law.rate_types)
    return {law.kind: law for law in known}


def kind_of(name: str) -> type[InterfaceArrhenius] | None:
    """The rate type that a mechanism calls by that name; Cantera puts the prefix where it is missing."""
    plain_name = "Arrhenius" if name == "elementary" else name
    return kinds().get(plain_name) or kinds().get(PREFIX + plain_name)


def names() -> list[str]:
    """The rate types as a mechanism writes them."""
    return [kind.removeprefix(PREFIX) for kind in kinds()]
