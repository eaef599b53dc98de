"""Adiabatic first-order reaction whose rate is proportional to temperature."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.errors import InputError
from surfacechem.references.base import Array, Reference


class AdiabaticLinearRate(Reference):
    r"""Adiabatic first-order bonding with a rate proportional to temperature, constant capacity.

    .. math:: \dot\phi=k_i\frac T{T_i}(1-\phi),\quad T=T_i(1+a\phi),\qquad
        \phi=\frac{e^z-1}{e^z+a},\quad z=(1+a)k_it,\quad a=\frac{\Delta T}{T_i}

    From :math:`\phi=0`. Any t >= 0, a > -1 (exothermic or endothermic).

    Source: linear kinetics of Sauer, Duong & Mandadapu (2021), constant capacity, integrated by partial fractions.

    >>> reaction = AdiabaticLinearRate(k_i=0.3, T_i=300.0, delta_T=450.0)
    >>> f"{reaction.solution(9.5)['T']:.10f}"
    '749.0957668630'
    """

    name: ClassVar[str] = "adiabatic-linear-rate"

    k_i: float = parameter("1/s", "rate constant at T_i", at_least=0)
    T_i: float = parameter("K", "initial temperature", above=0)
    delta_T: float = parameter("K", "adiabatic temperature rise of the complete reaction")

    def __post_init__(self) -> None:
        """Refuse a reaction that needs more heat than there is."""
        super().__post_init__()
        if self.delta_T <= -self.T_i:
            raise InputError(f"{self.name}: delta_T must be above -T_i = {-self.T_i:g} K.")

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        final, a = (self.T_i + self.delta_T) / self.T_i, self.delta_T / self.T_i
        exponent = -final * self.k_i * t
        denominator = final + a * np.expm1(exponent) if a < 0.0 else 1.0 + a * np.exp(exponent)
        phi = -np.expm1(exponent) / denominator
        return {"phi": phi, "T": self.T_i + self.delta_T * phi}
