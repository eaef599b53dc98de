"""A medium whose bonds take more heat capacity than it has."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from surfacechem.contracts.terms import parameter
from surfacechem.references.base import Array, Reference


class EndothermicMedium(Reference):
    r"""Capacity of a medium with endothermic bonds, and the growth of a small deviation from the bodies' temperature.

    .. math:: C_{eff}=\Big(C_c-\frac{K_2(1-\phi)^2}{T_0}\Big)\frac T{T_0},\qquad \lambda=-\frac{h_1+h_2}{C_{eff}}

    at a bonding state that does not change. With :math:`C_{eff}<0` every deviation grows, the faster the better the
    conductance: no scene may have it, and one that starts so has to be refused.

    Source: Sauer, Duong & Mandadapu (2021), section 6.2.2 with finite conductances, linearised.

    >>> medium = EndothermicMedium(C_c=0.1, K_2=240.0, phi=0.0, T=300.0, T_0=300.0, h_1=500.0, h_2=300.0)
    >>> f"{medium.capacity:.6f} {medium.growth_rate:.6f}"
    '-0.700000 1142.857143'
    """

    name: ClassVar[str] = "endothermic-medium"

    C_c: float = parameter("J/(m^2 K)", "heat capacity of the medium at T_0", at_least=0)
    K_2: float = parameter("J/m^2", "quadratic part of the bond energy density", at_least=0)
    phi: float = parameter("1", "bonding state", at_least=0, at_most=1)
    T: float = parameter("K", "temperature", above=0)
    T_0: float = parameter("K", "reference temperature", above=0)
    h_1: float = parameter("W/(m^2 K)", "conductance between medium and body 1", at_least=0)
    h_2: float = parameter("W/(m^2 K)", "conductance between medium and body 2", at_least=0)

    @property
    def capacity(self) -> float:
        """Capacity [J/(m^2 K)] at constant bonding state."""
        return (self.C_c - self.K_2 * (1.0 - self.phi) ** 2 / self.T_0) * self.T / self.T_0

    @property
    def growth_rate(self) -> float:
        """Rate [1/s] at which a deviation grows; negative where it decays."""
        return -(self.h_1 + self.h_2) / self.capacity

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        return {"C_eff": self.capacity, "growth_rate": self.growth_rate}
