r"""Heat in the bodies: the two energy models, and bodies that share one temperature.

The models are written in the excess temperature :math:`\theta=T-T_0`, to avoid cancellation close to the reference
temperature. Source: Sauer, Duong & Mandadapu (2021), quadratic model; Callen (1985), Thermodynamics, constant capacity.
"""

from __future__ import annotations

from fractions import Fraction
from functools import cached_property
from typing import ClassVar

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.references.base import Array, Reference, read


class QuadraticEnergy:
    r""":math:`U=\frac{C}{2T_0}(T^2-T_0^2)`, :math:`S=C\,(T/T_0-1)`, capacity :math:`C\,T/T_0`; both zero at T_0."""

    def rise(self, energy: Array, C: float, T_0: float, T_i: float) -> Array:
        """Return the temperature rise above `T_i` when `energy` is added."""
        difference_of_squares = 2.0 * T_0 * energy / C
        return np.asarray(difference_of_squares / (T_i + np.sqrt(T_i**2 + difference_of_squares)))

    def energy(self, excess: Array, C: float, T_0: float) -> Array:
        """Return the energy at the temperature `T_0 + excess`."""
        return C * excess * (1.0 + excess / (2.0 * T_0))

    def entropy(self, excess: Array, C: float, T_0: float) -> Array:
        """Return the entropy at the temperature `T_0 + excess`."""
        return C * excess / T_0


class ConstantCapacity:
    r""":math:`U=C\,(T-T_0)`, :math:`S=C\ln(T/T_0)`."""

    def rise(self, energy: Array, C: float, T_0: float, T_i: float) -> Array:
        """Return the temperature rise above `T_i` when `energy` is added."""
        return energy / C

    def energy(self, excess: Array, C: float, T_0: float) -> Array:
        """Return the energy at the temperature `T_0 + excess`."""
        return C * excess

    def entropy(self, excess: Array, C: float, T_0: float) -> Array:
        """Return the entropy at the temperature `T_0 + excess`."""
        return np.asarray(C * np.log1p(excess / T_0))


class PerfectContact(Reference):
    """Capacities that share one temperature."""

    C_1: float = parameter("J/(m^2 K)", "heat capacity of body 1 at T_0", above=0)
    C_2: float = parameter("J/(m^2 K)", "heat capacity of body 2 at T_0", above=0)
    C_c: float = parameter("J/(m^2 K)", "heat capacity of the interface at T_0", default=0.0, at_least=0)
    T_0: float = parameter("K", "reference temperature", above=0)

    readings = read(constant="C_1 C_2 C_c T_0")

    @cached_property
    def C(self) -> float:
        """Total heat capacity at T_0."""
        return float(self.exact_capacity)

    @cached_property
    def exact_capacity(self) -> Fraction:
        """Total heat capacity at T_0 without rounding."""
        return Fraction(self.C_1) + Fraction(self.C_2) + Fraction(self.C_c)


class UniformBody(Reference):
    """Bodies and interface at one temperature, with quadratic energies unless a subclass has another model."""

    model: ClassVar[QuadraticEnergy] = QuadraticEnergy()

    C: float = parameter("J/(m^2 K)", "total heat capacity at T_0", above=0)
    T_0: float = parameter("K", "reference temperature", above=0)
    T_i: float = parameter("K", "initial temperature", above=0)

    readings = read(constant="T_0", capacity="C", temperature="T_i")

    def heated(self, heat: Array) -> Array:
        """Return the temperature [K] after a supply of heat [J/m^2]."""
        return self.T_i + self.model.rise(heat, self.C, self.T_0, self.T_i)


class FrictionallyHeated(UniformBody):
    """A body and the dissipation that it would have at the reference temperature."""

    D_0: float = parameter("W/m^2", "dissipation at T_0", at_least=0)

    readings = read(heating_at_T_0="D_0")
