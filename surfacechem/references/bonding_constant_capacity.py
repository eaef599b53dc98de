"""Bonding and sliding together, constant capacities."""

from __future__ import annotations

from fractions import Fraction
from typing import ClassVar

import numpy as np

from surfacechem.references._bonding import RelaxingBonds
from surfacechem.references._energy import ConstantCapacity, EnergyModel
from surfacechem.references.base import Array


class BondingConstantCapacity(RelaxingBonds):
    r"""Bonding with a constant relaxation time and friction power, perfect thermal contact, constant capacities.

    As :class:`~surfacechem.references.bonding.Bonding`, but bodies and interface have constant capacities. The energy
    integral :math:`CT-\frac{K_2x}{2T_0^2}T^2+\frac{K_0x}2=\text{const}+Dt` is then a quadratic equation for the rise

    .. math::
        T-T_i=\frac{2e}{b+\sqrt{b^2-2ke}},\quad k=\frac{K_2x}{T_0^2},\quad b=C-kT_i,\quad
        e=\frac{x_0-x}2\Big(K_0-K_2\frac{T_i^2}{T_0^2}\Big)+Dt

    in which the root is the total capacity :math:`C-kT`. Valid while that is positive.

    Source: Sauer, Duong & Mandadapu (2021), section 6.2, with temperature-independent capacities.

    >>> bonds = BondingConstantCapacity(C_1=1.0, C_2=1.0, T_0=300.0, K_0=60.0, T_i=300.0, tau=0.5)
    >>> f"{bonds.solution(50.0)['T']:.9f}"
    '315.000000000'
    """

    name: ClassVar[str] = "bonding-constant-capacity"
    model: ClassVar[EnergyModel] = ConstantCapacity()

    @property
    def _bond_capacity_scale(self) -> Fraction:
        return self._exact_C * Fraction(self.T_0) ** 2 / Fraction(self.T_i)

    def _curvature(self, unbonded_squared: Array) -> Array:
        return self.K_2 * unbonded_squared / self.T_0**2

    def temperature(self, t: Array) -> tuple[Array, Array]:
        x, y = self.unbonded_squared(t)
        released = 0.5 * y * (self.K_0 - self.K_2 * (self.T_i / self.T_0) ** 2) + self.D * t
        at_start = self.C * self.free_capacity + self._curvature(y) * self.T_i
        rise = 2.0 * released / (at_start + np.sqrt(at_start**2 - 2.0 * self._curvature(x) * released))
        return np.where(self.T_i + rise > 0.0, self.T_i + rise, np.nan), rise

    def heating_share(self, T: Array, t: Array) -> Array:
        x, y = self.unbonded_squared(t)
        rise = T - self.T_i
        return 1.0 / (self.C * self.free_capacity + self._curvature(y) * self.T_i - self._curvature(x) * rise)
