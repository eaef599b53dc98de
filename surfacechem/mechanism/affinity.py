"""Rate types driven by the affinity instead of mass action: linear and exponential in it."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping

from surfacechem.errors import InputError
from surfacechem.expressions import Expression, expm1, log, log_fraction
from surfacechem.mechanism.mixture import Formula
from surfacechem.mechanism.rates import InterfaceArrhenius, plain
from surfacechem.quantities import BOLTZMANN


class AffinityReaction(InterfaceArrhenius):
    """A reaction whose net rate is a function of its affinity that vanishes with it, so that it runs both ways."""

    kind = ""
    native = False

    def __post_init__(self) -> None:
        """The equation says that it runs both ways."""
        super().__post_init__()
        if not self.reversible:
            raise InputError(f"reaction {self.equation}: a rate by affinity runs both ways; write `<=>`.", self.place)

    @property
    def rate(self) -> Formula:  # type: ignore[override]
        """Net rate [1/(m^2 s)]; the chemical potential change is that of the whole interface."""
        return Formula(("mu", *self._formula(self._forward).__signature__.parameters), self._net)

    def _net(self, values: Mapping[str, Expression]) -> Expression:
        return -self._forward(values) * self.drive(values["mu"] / (BOLTZMANN * values["T_c"]))

    @abstractmethod
    def drive(self, x: Expression) -> Expression:
        """The rate backward over forward, less one, at the reduced chemical potential change x = mu / k_B T."""

    def _forward(self, values: Mapping[str, Expression]) -> Expression:
        return self.coefficient(values, 0) * self._full(values)

    def _reverse(self, values: Mapping[str, Expression]) -> Expression:
        affinity = self.standard_affinity(values["T_c"], values.get("g_n"), values)
        return self.coefficient(values, affinity + self._log_mixing(values)) * self._full(values)

    def _log_forward(self, values: Mapping[str, Expression]) -> Expression:
        orders = ((values[item.concentration], self.orders.get(item.variable, 0)) for item in self.species)
        return self.log_coefficient(values) + sum(plain(order) * log(full) for full, order in orders)

    def _full(self, values: Mapping[str, Expression]) -> Expression:
        """Amounts of the reactants at full coverage, which give the coefficient the unit it has in mass action."""
        product: Expression = 1
        for item in self.species:
            product *= values[item.concentration] ** plain(self.orders.get(item.variable, 0))
        return product

    def _log_mixing(self, values: Mapping[str, Expression]) -> Expression:
        terms = ((self.change.get(item.variable, 0), values[item.variable]) for item in self.species)
        return sum(plain(nu) * log_fraction(theta) for nu, theta in terms if nu)


class InterfaceLinearAffinity(AffinityReaction):
    r"""Rate proportional to the affinity in a mechanism, ``type: linear-affinity``.

    .. math:: R = -k(T) \prod_k (n_k^\circ)^{r_k}\,\frac{\mu}{k_B T}

    The law linear-affinity with :math:`c_r = k / k_B T` for a reaction of first order; b = 1 makes it independent of
    temperature. Always admissible. Source: Sauer, Duong & Mandadapu (2021), eq. e:R.
    """

    kind = "interface-linear-affinity"

    def drive(self, x: Expression) -> Expression:
        """The linear part of exp(x) - 1."""
        return x


class InterfaceExponentialAffinity(AffinityReaction):
    r"""Rate exponential in the affinity in a mechanism, ``type: exponential-affinity``.

    .. math:: R = k(T) \prod_k (n_k^\circ)^{r_k} \left( 1 - e^{\mu / k_B T} \right)

    The law exponential-affinity with :math:`C_r = n_c k / k_B T` for a reaction of first order. Always admissible.
    Source: Sauer, Duong & Mandadapu (2021), the equation after e:R.
    """

    kind = "interface-exponential-affinity"

    def drive(self, x: Expression) -> Expression:
        """exp(x) - 1."""
        return expm1(x)
