"""Reversible adiabatic opening of a cohesive zone that weakens with temperature."""

from __future__ import annotations

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.references._bodies import UniformBody
from surfacechem.references._numerics import increasing_root
from surfacechem.references.base import Array, Quantities, read


class IsentropicCohesiveOpening(UniformBody):
    r"""Opening of a cohesive zone that weakens with temperature, in perfect contact and without heat supply: it cools.

    .. math:: T^3-BT^2-a(g_n)=0,\quad a=\frac{t_{max}T_0^2}C(g_n+g_0)e^{1-g_n/g_0},\quad B=T_i-\frac{a(g_i)}{T_i^2}

    for a strength :math:`t_{max}T_0/T`. The entropy
    :math:`C(T/T_0-1)-t_{max}\frac{T_0}{T^2}(g_n+g_0)e^{1-g_n/g_0}` of bodies and zone is constant; fully open, T = B.
    Quadratic energies; :math:`g_n=g_i+\dot gt\ge0`. If B <= 0 the temperature goes to zero as the zone opens.

    Source: Sauer, Duong & Mandadapu (2021), eq. ex:psi_czm and quadratic energy, at constant entropy.

    >>> zone = IsentropicCohesiveOpening(t_max=5e7, g_0=1e-8, C=0.02, T_0=300.0, T_i=300.0, g_dot=1e-8)
    >>> f"{zone.solution(1.0)['T']:.9f} {zone.open_temperature:.9f}"
    '286.764808584 232.042954289'
    """

    t_max: float = parameter("Pa", "strength at T_0", above=0)
    g_0: float = parameter("m", "gap at the strength", above=0)
    g_i: float = parameter("m", "initial gap", default=0.0, at_least=0)
    g_dot: float = parameter("m/s", "opening speed", at_least=0)

    readings = read(potential="t_max g_0", initial="g_i=g_n", ramp="g_dot=g_n")

    @property
    def open_temperature(self) -> float:
        """Temperature [K] of the open bodies."""
        return self.T_i - float(self._a(np.array(self.g_i))) / self.T_i**2

    def quantities(self, t: Array) -> Quantities:
        g, B = self.g_i + self.g_dot * t, self.open_temperature
        a = self._a(g)
        low = np.full_like(a, max(B, 0.0))
        T = increasing_root(lambda x: (x**2 * (x - B), x * (3.0 * x - 2.0 * B)), a, low, low + np.cbrt(a))
        u = g / self.g_0
        scale = self.C / (2.0 * self.T_0)
        zone, before = -4.0 * scale * a / T, -4.0 * scale * self._a(np.array(self.g_i)) / self.T_i
        work = scale * (T - self.T_i) * (T + self.T_i) + zone - before
        return {"g_n": g, "T": T, "t_n": self.t_max * self.T_0 / T * u * np.exp(1.0 - u), "U_c": zone, "work": work}

    def _a(self, g: Array) -> Array:
        return np.asarray(self.t_max * self.T_0**2 / self.C * (g + self.g_0) * np.exp(1.0 - g / self.g_0))
