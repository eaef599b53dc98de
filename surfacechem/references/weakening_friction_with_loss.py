"""Dry friction that weakens with temperature, with heat loss, quadratic energies."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.references._heated_body import FrictionallyHeated
from surfacechem.references._quadrature import short_integral
from surfacechem.references._roots import increasing_root
from surfacechem.references.base import Array


class WeakeningFrictionWithLoss(FrictionallyHeated):
    r"""Heating by friction with :math:`\mu=\mu_0T_0/T` and a linear heat loss, quadratic energies.

    .. math:: \frac C{T_0}T\dot T=D_0\frac{T_0}T-H(T-T_a)=-\frac HT(T-T_+)(T-T_-),\qquad
        T_\pm=\tfrac12\Big(T_a\pm\sqrt{T_a^2+4D_0T_0/H}\Big)

    The stable steady state is :math:`T_+`. With :math:`s=\ln\frac{T_+-T_i}{T_+-T}`, which runs from zero to infinity,

    .. math:: \frac{HT_0}Ct=\frac{T_+^2s+T_-^2\ln\frac{T-T_-}{T_i-T_-}}{T_+-T_-}-(T-T_i)

    is inverted for s to rounding. Any t >= 0, heating or cooling.

    Source: Sauer, Duong & Mandadapu (2021), section 6.1, with the temperature dependence of their friction coefficient
    and a loss, integrated by partial fractions.

    >>> body = WeakeningFrictionWithLoss(C=4000.0, T_0=300.0, T_i=300.0, D_0=3000.0, H=12.0, T_a=300.0)
    >>> f"{body.solution(725.983775452141641)['T']:.10f}"
    '446.0249099279'
    """

    name: ClassVar[str] = "weakening-friction-with-loss"

    H: float = parameter("W/(m^2 K)", "conductance to the surroundings", above=0)
    T_a: float = parameter("K", "temperature of the surroundings", above=0)

    @property
    def steady_temperature(self) -> float:
        """Temperature [K] at which friction and loss balance."""
        return 0.5 * (self.T_a + math.hypot(self.T_a, 2.0 * math.sqrt(self.D_0 * self.T_0 / self.H)))

    @property
    def _other_root(self) -> float:
        return -self.D_0 * self.T_0 / self.H / self.steady_temperature

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        T = self.T_i + self._rise(self._approach(t))
        return {"T": T, "D": self.D_0 * self.T_0 / T}

    def time(self, T: Array) -> Array:
        """The time [s] at which the temperature is T, between T_i and the steady state."""
        steady = self.steady_temperature
        approach = -np.log1p((T - self.T_i) / (self.T_i - steady))
        return self._scaled_time(approach)[0] * self.C / (self.H * self.T_0)

    def _rise(self, s: Array) -> Array:
        return (self.T_i - self.steady_temperature) * np.expm1(-s)

    def _approach(self, t: Array) -> Array:
        """The s that belongs to t; its rate of change lies between the values at both ends."""
        scaled = t * self.H * self.T_0 / self.C
        ends = [T**2 / (T - self._other_root) for T in (self.T_i, self.steady_temperature)]
        return increasing_root(self._scaled_time, scaled, scaled / max(ends), scaled / min(ends))

    def _scaled_time(self, s: Array) -> tuple[Array, Array]:
        """The right-hand side of the implicit solution and its slope."""
        steady, other, rise = self.steady_temperature, self._other_root, self._rise(s)
        logarithms = steady**2 * s + other**2 * np.log1p(rise / (self.T_i - other))
        weak_loss = 4.0 * (self.T_i + rise) < -other  # far below both roots the logarithms cancel
        slope = self._slope(s)
        return np.where(weak_loss, short_integral(self._slope, s), logarithms / (steady - other) - rise), slope

    def _slope(self, s: Array) -> Array:
        T = self.T_i + self._rise(s)
        return np.asarray(T**2 / (T - self._other_root))
