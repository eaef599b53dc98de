"""The rate types that Cantera does not have: each is a law of a case, with an Arrhenius coefficient as its constant."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, field, fields, replace
from functools import cache
from typing import Any, ClassVar, cast

from surfacechem.contracts.terms import RateLaw, RateType, reads
from surfacechem.errors import InputError
from surfacechem.expressions import Expression, log, log_fraction, log_sum, where
from surfacechem.laws import laws
from surfacechem.mechanism.mixture import Formula
from surfacechem.mechanism.rates import USED, InterfaceArrhenius, floored, plain
from surfacechem.quantities import GAS_CONSTANT

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

    def _forward(self, values: Mapping[str, Expression], shift: Expression = 0) -> Expression:
        # Amounts at full coverage: the coverages are in the affinity.
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
            spec = replace(spec, unit="1", text=f"{spec.text}, over the rate constant")
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
