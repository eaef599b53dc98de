"""Bonding with a constant relaxation time in perfect thermal contact, for both energy models."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from fractions import Fraction
from typing import ClassVar

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.errors import InputError
from surfacechem.references._energy import EnergyModel
from surfacechem.references._perfect_contact import PerfectContact
from surfacechem.references.base import Array


class RelaxingBonds(PerfectContact):
    r"""Bond energy :math:`\frac12K(T)x`, :math:`x=(1-\phi)^2`, whose :math:`x` decays as :math:`e^{-2t/\tau}`.

    Everything is written with :math:`y=x_0-x\ge0`, which is known to rounding however small t is. A subclass states the
    temperature and the total capacity; fluxes, energy and entropies follow.
    """

    model: ClassVar[EnergyModel]

    T_i: float = parameter("K", "initial temperature", above=0)
    phi_i: float = parameter("1", "initial bonding state", default=0.0, at_least=0, at_most=1)
    K_0: float = parameter("J/m^2", "temperature-independent part of the bond energy density", default=0.0)
    K_1: float = parameter("J/m^2", "linear (entropic) part of the bond energy density", default=0.0)
    K_2: float = parameter("J/m^2", "quadratic part of the bond energy density", default=0.0)
    tau: float = parameter("s", "relaxation time of bonding", above=0)
    D: float = parameter("W/m^2", "friction power, traction times sliding velocity", default=0.0, at_least=0)

    def __post_init__(self) -> None:
        """Refuse what has no positive heat capacity to begin with."""
        super().__post_init__()
        if self.free_capacity <= 0.0:
            raise InputError(
                f"{self.name}: the total heat capacity must be positive, but K_2 (1 - phi_i)^2 takes away "
                f"{1.0 - self.free_capacity:.17g} of it. Lower K_2 or raise phi_i."
            )

    @property
    def free_capacity(self) -> float:
        """Share of the initial capacity that the unformed bonds leave, from exact arithmetic (it may be 2^-52)."""
        return float(1 - Fraction(self.K_2) * (1 - Fraction(self.phi_i)) ** 2 / self._bond_capacity_scale)

    @property
    @abstractmethod
    def _bond_capacity_scale(self) -> Fraction:
        """The value of K_2 x at which the initial capacity vanishes."""

    @abstractmethod
    def temperature(self, t: Array) -> tuple[Array, Array]:
        """Temperature and its rise above the initial one."""

    @abstractmethod
    def heating_share(self, T: Array, t: Array) -> Array:
        """Heating of a body over total heat set free, per capacity of that body."""

    def unbonded_squared(self, t: Array) -> tuple[Array, Array]:
        """The square x of the unbonded fraction, and how much of it is gone."""
        initial = (1.0 - self.phi_i) ** 2
        return initial * np.exp(-2.0 * t / self.tau), -initial * np.expm1(-2.0 * t / self.tau)

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        x, _ = self.unbonded_squared(t)
        T, rise = self.temperature(t)
        excess, relative = self.T_i - self.T_0 + rise, T / self.T_0
        bond_energy = self.K_0 - self.K_2 * relative**2
        share = self.heating_share(T, t) * (x / self.tau * bond_energy + self.D)
        bond_entropy = -0.5 * x * (self.K_1 + 2.0 * self.K_2 * relative) / self.T_0
        stiffness = self.K_0 + self.K_1 * relative + self.K_2 * relative**2
        return {
            "phi": self.phi_i - (1.0 - self.phi_i) * np.expm1(-t / self.tau),
            "T": T,
            "q_1": self.C_1 * share,
            "q_2": self.C_2 * share,
            "U_c": self.model.energy(excess, self.C_c, self.T_0) + 0.5 * x * bond_energy,
            "S_total": self.model.entropy(excess, self.C, self.T_0) + bond_entropy,
            "sigma_chem": x * stiffness / (self.tau * T),
        }
