"""Autocatalytic cure with the heat of reaction in the bodies."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.errors import InputError
from surfacechem.quantities import GAS_CONSTANT
from surfacechem.references._numerics import AutonomousODE
from surfacechem.references.base import Array, Quantities, Reference, read


class KamalCureConstantCapacity(Reference):
    r"""Adiabatic autocatalytic cure, constant capacities.

    .. math:: \dot\phi=\Big(A_1e^{-E_1/R_gT}+A_2e^{-E_2/R_gT}\phi^m\Big)(1-\phi)^n,\qquad
        T=T_i+\Delta T\,(\phi-\phi_i)

    The time :math:`t=\int d\phi/\dot\phi(\phi,T(\phi))` is a sum of Gauss panels that shrink towards both ends, and is
    inverted to rounding. A ΔT of zero is isothermal cure. :math:`n\ge1`; any t >= 0.

    Source: Kamal & Sourour (1973), Polym. Eng. Sci. 13, 59-64, doi 10.1002/pen.760130110, integrated.

    >>> layer = KamalCureConstantCapacity(A_1=4e5, E_1=7e4, A_2=2e6, E_2=6e4, m=0.5, n=1.5, T_i=360.0, delta_T=120.0)
    >>> f"{layer.solution(190.424045193457)['phi']:.10f}"
    '0.5000000000'
    """

    A_1: float = parameter("1/s", "pre-exponential factor of the uncatalysed reaction", at_least=0)
    E_1: float = parameter("J/mol", "activation energy of the uncatalysed reaction", default=0.0, at_least=0)
    A_2: float = parameter("1/s", "pre-exponential factor of the autocatalytic reaction", at_least=0)
    E_2: float = parameter("J/mol", "activation energy of the autocatalytic reaction", default=0.0, at_least=0)
    m: float = parameter("1", "order of the autocatalysis", default=1.0, above=0)
    n: float = parameter("1", "order of the reaction", default=1.0, at_least=1)
    T_i: float = parameter("K", "initial temperature", above=0)
    delta_T: float = parameter("K", "heat of reaction over the heat capacity at T_0", default=0.0, at_least=0)
    phi_i: float = parameter("1", "initial degree of cure", default=0.0, at_least=0, at_most=1)

    readings = read(reaction="A_1 E_1 A_2 E_2 m n", initial="phi_i=phi", temperature="T_i", adiabatic_rise="delta_T")

    def __post_init__(self) -> None:
        """Refuse parameters with which the reaction cannot start."""
        super().__post_init__()
        if self.A_1 == 0.0 and (self.phi_i == 0.0 or self.A_2 == 0.0):
            raise InputError(f"{self.name}: nothing starts the reaction; A_1 or phi_i and A_2 must be above zero.")

    def rate(self, cured: Array, left: Array) -> Array:
        """Return the rate of phi [1/s] when phi has grown by ``cured`` and is below one by ``left``."""
        RT = GAS_CONSTANT * (self.T_i + self.delta_T * cured)
        k_1, k_2 = self.A_1 * np.exp(-self.E_1 / RT), self.A_2 * np.exp(-self.E_2 / RT)
        return np.asarray((k_1 + k_2 * (self.phi_i + cured) ** self.m) * left**self.n)

    @cached_property
    def _path(self) -> AutonomousODE:
        return AutonomousODE(self.rate, 1.0 - self.phi_i)

    def quantities(self, t: Array) -> Quantities:
        if self.phi_i == 1.0:
            return {"phi": 1.0, "unreacted": 0.0, "T": self.T_i, "phi_dot": 0.0}
        cured, left = self._path.position(t)
        phi = np.where(left < 0.5, 1.0 - left, self.phi_i + cured)
        return {"phi": phi, "unreacted": left, "T": self.T_i + self.delta_T * cured, "phi_dot": self.rate(cured, left)}
