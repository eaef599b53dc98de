"""The rate type of autocatalytic cure."""

from __future__ import annotations

from collections.abc import Mapping

from surfacechem.contracts.terms import parameter
from surfacechem.errors import InputError
from surfacechem.expressions import Expression, log, log_fraction, log_sum, power, scaled_exp, where
from surfacechem.mechanism.rates import GONE, InterfaceArrhenius, floored
from surfacechem.quantities import GAS_CONSTANT


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
        order, activation = self._order(values), -self.E_2 / (GAS_CONSTANT * values["T_c"])
        (product,) = self.products
        # As a power it is nothing where nothing has formed: what waits for its own product does not begin by itself.
        autocatalysis = scaled_exp(self.A_2, activation + shift + order) * power(values[product], self.m)
        return super().coefficient(values, shift + order) + autocatalysis

    def log_coefficient(self, values: Mapping[str, Expression]) -> Expression:
        """Logarithm of the rate coefficient."""
        pathways = [super().log_coefficient(values), log(self.A_2) + self._catalysis(values)]
        return log_sum(pathways) + self._order(values)

    def _catalysis(self, values: Mapping[str, Expression]) -> Expression:
        (product,) = self.products
        return self.m * log_fraction(values[product]) - self.E_2 / (GAS_CONSTANT * values["T_c"])

    def _order(self, values: Mapping[str, Expression]) -> Expression:
        """What the coefficient lacks as mass action is of first order."""
        (reactant,) = self.orders
        theta = values[reactant]
        return (self.n - 1) * where(self.n < 1, log(floored(theta, GONE)), log_fraction(theta))
