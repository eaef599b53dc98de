"""Two bodies and an interface that share one temperature."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import ClassVar

from surfacechem.contracts.terms import parameter
from surfacechem.references._energy import EnergyModel
from surfacechem.references.base import Array, Reference


class PerfectContact(Reference):
    """The capacities that share one temperature."""

    C_1: float = parameter("J/(m^2 K)", "heat capacity of body 1 at T_0", above=0)
    C_2: float = parameter("J/(m^2 K)", "heat capacity of body 2 at T_0", above=0)
    C_c: float = parameter("J/(m^2 K)", "heat capacity of the interface at T_0", default=0.0, at_least=0)
    T_0: float = parameter("K", "reference temperature", above=0)

    @property
    def C(self) -> float:
        """Total heat capacity at T_0."""
        return float(self._exact_C)

    @property
    def _exact_C(self) -> Fraction:
        return Fraction(self.C_1) + Fraction(self.C_2) + Fraction(self.C_c)


class SteadySliding(PerfectContact):
    """Heating by a constant dissipation: the energy D t is shared in proportion to the capacities."""

    model: ClassVar[EnergyModel]

    T_i: float = parameter("K", "initial temperature", above=0)
    D: float = parameter("W/m^2", "friction power, traction times sliding velocity", at_least=0)

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        rise = self.model.rise(self.D * t, self.C, self.T_0, self.T_i)
        return {
            "T": self.T_i + rise,
            "q_1": self.C_1 / self.C * self.D,
            "q_2": self.C_2 / self.C * self.D,
            "S_total": self.model.entropy(self.T_i - self.T_0 + rise, self.C, self.T_0),
        }
