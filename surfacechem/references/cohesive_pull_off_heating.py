"""Heating by the snap of a cohesive pull-off."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.references._energy import QuadraticEnergy
from surfacechem.references.base import Array
from surfacechem.references.cohesive_pull_off import CohesivePullOff


class CohesivePullOffHeating(CohesivePullOff):
    r"""Cohesive pull-off in perfect thermal contact: what the jump releases heats the bodies.

    .. math:: T^2=T_i^2+\frac{2T_0}C\,\big[\tfrac12k(w-g_n)^2+\Psi\big]_{after}^{before}

    Quadratic energies; a strength that does not depend on temperature, so that the gap is that of the pull-off without
    heat and the temperature changes at the jump only.

    Source: Sauer, Duong & Mandadapu (2021), eq. ex:bt_czm with the sign of tension, and the quadratic energy.

    >>> bodies = CohesivePullOffHeating(t_max=1e6, g_0=1e-8, k=1e13, w_dot=1e-8, C=2e-4, T_0=300.0, T_i=310.0)
    >>> f"{bodies.solution(20.0)['T']:.9f}"
    '433.274971584'
    """

    name: ClassVar[str] = "cohesive-pull-off-heating"

    C: float = parameter("J/(m^2 K)", "total heat capacity at T_0", above=0)
    T_0: float = parameter("K", "reference temperature", above=0)
    T_i: float = parameter("K", "initial temperature", above=0)

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        mechanics = super().quantities(t)
        rise = QuadraticEnergy().rise(np.asarray(mechanics["heat"]), self.C, self.T_0, self.T_i)
        return {**mechanics, "T": self.T_i + rise}
