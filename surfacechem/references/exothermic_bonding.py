"""Exothermic bonding, closed form of the paper."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.references._perfect_contact import PerfectContact
from surfacechem.references.base import Array


class ExothermicBonding(PerfectContact):
    r"""Bonding that sets a constant energy free, perfect thermal contact, quadratic energies.

    .. math:: \phi=1-e^{-t/\tau},\quad T=T_0\sqrt{1+\kappa(1-e^{-2t/\tau})},\quad
        q_k=\frac{C_k}{C}\frac{K_0}\tau e^{-2t/\tau},\quad \kappa=\frac{K_0}{T_0C}

    From :math:`\phi=0` and :math:`T=T_0`; any t >= 0, K_0 >= 0. Ends at :math:`T_0\sqrt{1+\kappa}`.

    Source: Sauer, Duong & Mandadapu (2021), section 6.2.1, there for equal bodies and C_c = 0.

    >>> f"{ExothermicBonding(C_1=1.0, C_2=1.0, T_0=300.0, K_0=60.0, tau=0.5).solution(2.5)['T']:.12f}"
    '314.642005143357'
    """

    name: ClassVar[str] = "exothermic-bonding"

    K_0: float = parameter("J/m^2", "bond energy density", at_least=0)
    tau: float = parameter("s", "relaxation time of bonding", above=0)

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        kappa = self.K_0 / (self.T_0 * self.C)
        released = self.K_0 / self.tau * np.exp(-2.0 * t / self.tau)
        return {
            "phi": -np.expm1(-t / self.tau),
            "T": self.T_0 * np.sqrt(1.0 - kappa * np.expm1(-2.0 * t / self.tau)),
            "q_1": self.C_1 / self.C * released,
            "q_2": self.C_2 / self.C * released,
        }
