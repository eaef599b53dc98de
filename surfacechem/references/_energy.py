r"""The two energy models of a body, in terms of the excess temperature :math:`\theta=T-T_0`.

With :math:`\theta` instead of :math:`T` nothing cancels close to the reference temperature.
Source: Sauer, Duong & Mandadapu (2021), quadratic model; Callen (1985), Thermodynamics, constant capacity.
"""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np

from surfacechem.references.base import Array


class EnergyModel(ABC):
    """How energy and entropy of a capacity `C` depend on temperature; both are zero at `T_0`."""

    @abstractmethod
    def rise(self, energy: Array, C: float, T_0: float, T_i: float) -> Array:
        """Temperature rise above `T_i` when `energy` is added."""

    @abstractmethod
    def energy(self, excess: Array, C: float, T_0: float) -> Array:
        """Energy at the temperature `T_0 + excess`."""

    @abstractmethod
    def entropy(self, excess: Array, C: float, T_0: float) -> Array:
        """Entropy at the temperature `T_0 + excess`."""


class QuadraticEnergy(EnergyModel):
    r""":math:`U=\frac{C}{2T_0}(T^2-T_0^2)`, :math:`S=C\,(T/T_0-1)`, capacity :math:`C\,T/T_0`."""

    def rise(self, energy: Array, C: float, T_0: float, T_i: float) -> Array:
        difference_of_squares = 2.0 * T_0 * energy / C
        return np.asarray(difference_of_squares / (T_i + np.sqrt(T_i**2 + difference_of_squares)))

    def energy(self, excess: Array, C: float, T_0: float) -> Array:
        return C * excess * (1.0 + excess / (2.0 * T_0))

    def entropy(self, excess: Array, C: float, T_0: float) -> Array:
        return C * excess / T_0


class ConstantCapacity(EnergyModel):
    r""":math:`U=C\,(T-T_0)`, :math:`S=C\ln(T/T_0)`."""

    def rise(self, energy: Array, C: float, T_0: float, T_i: float) -> Array:
        return energy / C

    def energy(self, excess: Array, C: float, T_0: float) -> Array:
        return C * excess

    def entropy(self, excess: Array, C: float, T_0: float) -> Array:
        return np.asarray(C * np.log1p(excess / T_0))
