"""Endothermic bonding, closed form of the paper."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import ClassVar

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.errors import InputError
from surfacechem.references._perfect_contact import PerfectContact
from surfacechem.references.base import Array


class EndothermicBonding(PerfectContact):
    r"""Bonding with a bond energy that grows as :math:`T^2`, perfect thermal contact, quadratic energies.

    .. math:: \phi=1-e^{-t/\tau},\quad T=T_0\sqrt{\frac{1-\kappa}{1-\kappa e^{-2t/\tau}}},\quad
        q_k=-\frac{C_k}{C}\frac{K_2}\tau\frac{(1-\kappa)e^{-2t/\tau}}{(1-\kappa e^{-2t/\tau})^2},\quad
        \kappa=\frac{K_2}{T_0C}<1

    From :math:`\phi=0` and :math:`T=T_0`. Ends at :math:`T_0\sqrt{1-\kappa}` after an initial layer as short as
    :math:`\tau(1-\kappa)/2`; accurate for :math:`1-\kappa` down to rounding.

    Source: Sauer, Duong & Mandadapu (2021), section 6.2.2, there for equal bodies and C_c = 0.

    >>> nearly_one = EndothermicBonding(C_1=1.0, C_2=1.0, T_0=256.0, K_2=512.0 * (1.0 - 2.0**-40), tau=1.0)
    >>> f"{nearly_one.solution(1e-12)['T']:.12f}"
    '143.130196231040'
    """

    name: ClassVar[str] = "endothermic-bonding"

    K_2: float = parameter("J/m^2", "bond energy density at T_0", at_least=0)
    tau: float = parameter("s", "relaxation time of bonding", above=0)

    def __post_init__(self) -> None:
        """Refuse what has no positive heat capacity to begin with."""
        super().__post_init__()
        if self.free_capacity <= 0.0:
            raise InputError(f"{self.name}: K_2 must be below T_0 (C_1 + C_2 + C_c), the capacity it takes away.")

    @property
    def free_capacity(self) -> float:
        r""":math:`1-\kappa` from exact arithmetic."""
        return float(1 - Fraction(self.K_2) / (Fraction(self.T_0) * self._exact_C))

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        kappa = self.K_2 / (self.T_0 * self.C)
        ratio = self.free_capacity / (self.free_capacity - kappa * np.expm1(-2.0 * t / self.tau))
        absorbed = self.K_2 / self.tau * np.exp(-2.0 * t / self.tau) * ratio**2 / self.free_capacity
        return {
            "phi": -np.expm1(-t / self.tau),
            "T": self.T_0 * np.sqrt(ratio),
            "q_1": -self.C_1 / self.C * absorbed,
            "q_2": -self.C_2 / self.C * absorbed,
        }
