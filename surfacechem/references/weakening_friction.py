"""Heating by dry friction that weakens with temperature, quadratic energies: without and with heat loss."""

from __future__ import annotations

import math

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.references._bodies import FrictionallyHeated
from surfacechem.references._numerics import increasing_root, short_integral
from surfacechem.references.base import Array, Quantities, read


class WeakeningFriction(FrictionallyHeated):
    r"""Heating by friction with :math:`\mu=\mu_0T_0/T`, quadratic energies, no loss.

    .. math:: \frac C{T_0}T\dot T=D_0\frac{T_0}T,\qquad T^3=T_i^3+3T_0^2D_0t/C

    With :math:`D_0=\mu_0pv`; from :math:`T_i=T_0` this is :math:`T_0(1+3t/\tau)^{1/3}`, :math:`\tau=CT_0/D_0`.
    Any t >= 0.

    Source: Sauer, Duong & Mandadapu (2021), section 6.1, with the temperature dependence of their friction coefficient,
    integrated.

    >>> f"{WeakeningFriction(C=4000.0, T_0=300.0, T_i=300.0, D_0=3000.0).solution(4e4)['T']:.10f}"
    '2010.5278186134'
    """

    def quantities(self, t: Array) -> Quantities:
        T = np.cbrt(self.T_i**3 + 3.0 * self.T_0**2 * self.D_0 * t / self.C)
        return {"T": T, "D": self.D_0 * self.T_0 / T}


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

    H: float = parameter("W/(m^2 K)", "conductance to the surroundings", above=0)
    T_a: float = parameter("K", "temperature of the surroundings", above=0)

    readings = read(total_conductance="H", surroundings_temperature="T_a")

    @property
    def steady_temperature(self) -> float:
        """Temperature [K] at which friction and loss balance."""
        return 0.5 * (self.T_a + math.hypot(self.T_a, 2.0 * math.sqrt(self.D_0 * self.T_0 / self.H)))

    def quantities(self, t: Array) -> Quantities:
        scaled = t * self.H * self.T_0 / self.C
        # The slope of the scaled time lies between its values at both ends, and so does s.
        ends = [T**2 / (T - self._other_root) for T in (self.T_i, self.steady_temperature)]
        s = increasing_root(self._scaled_time, scaled, scaled / max(ends), scaled / min(ends))
        T = self.T_i + (self.T_i - self.steady_temperature) * np.expm1(-s)
        return {"T": T, "D": self.D_0 * self.T_0 / T}

    def time(self, T: Array) -> Array:
        """Return the time [s] at which the temperature is T, between T_i and the steady state."""
        approach = -np.log1p((T - self.T_i) / (self.T_i - self.steady_temperature))
        return self._scaled_time(approach)[0] * self.C / (self.H * self.T_0)

    @property
    def _other_root(self) -> float:
        return -self.D_0 * self.T_0 / self.H / self.steady_temperature

    def _scaled_time(self, s: Array) -> tuple[Array, Array]:
        """Return the right-hand side of the implicit solution and its slope."""
        steady, other = self.steady_temperature, self._other_root

        def slope(s: Array) -> Array:
            T = self.T_i + (self.T_i - steady) * np.expm1(-s)
            return np.asarray(T**2 / (T - other))

        rise = (self.T_i - steady) * np.expm1(-s)
        logarithms = steady**2 * s + other**2 * np.log1p(rise / (self.T_i - other))
        weak_loss = 4.0 * (self.T_i + rise) < -other  # far from both roots the logarithms would cancel
        return np.where(weak_loss, short_integral(slope, s), logarithms / (steady - other) - rise), slope(s)
