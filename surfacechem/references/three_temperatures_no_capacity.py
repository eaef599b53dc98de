"""Two bodies that exchange heat with a medium of no capacity between them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from surfacechem.references._exponentials import first_difference, second_difference
from surfacechem.references._media import HeatedMedium
from surfacechem.references.base import Array


class ThreeTemperaturesNoCapacity(HeatedMedium):
    r"""Two bodies of constant capacity and a medium without: the limit C_c = 0, an algebraic temperature.

    .. math:: T_c=\frac{h_1T_1+h_2T_2+D}{h_1+h_2},\qquad
        q_1=\alpha_1D+h(T_2-T_1),\quad q_2=\alpha_2D-h(T_2-T_1)

    with :math:`D=D_0+D_1e^{-\gamma t}`, :math:`\alpha_k=h_k/(h_1+h_2)`, :math:`h=h_1h_2/(h_1+h_2)`. The difference
    :math:`T_2-T_1` decays at the rate :math:`h(1/C_1+1/C_2)` and is driven by
    :math:`(\alpha_2/C_2-\alpha_1/C_1)D`. The medium starts from its algebraic temperature. Any t >= 0.

    Source: Sauer, Duong & Mandadapu (2021), section 5.6 (heat transfer), with constant capacities, integrated.

    >>> bodies = ThreeTemperaturesNoCapacity(C_1=1200.0, C_2=500.0, h_1=2500.0, h_2=700.0, T_1=290.0, T_2=350.0,
    ...                                      D_0=150.0, D_1=4000.0, gamma=3.0)
    >>> f"{bodies.solution(100.0)['T_c']:.12f}"
    '317.303334981051'
    """

    name: ClassVar[str] = "three-temperatures-no-capacity"

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        share_1, share_2 = self.h_1 / (self.h_1 + self.h_2), self.h_2 / (self.h_1 + self.h_2)
        h = share_1 * self.h_2
        source, source_energy = self._source(t)
        difference, difference_integral = self._difference(t, h, share_2 / self.C_2 - share_1 / self.C_1)
        T_1 = self.T_1 + (share_1 * source_energy + h * difference_integral) / self.C_1
        T_2 = self.T_2 + (share_2 * source_energy - h * difference_integral) / self.C_2
        return {
            "T_1": T_1,
            "T_2": T_2,
            "T_c": share_1 * T_1 + share_2 * T_2 + source / (self.h_1 + self.h_2),
            "q_1": share_1 * source + h * difference,
            "q_2": share_2 * source - h * difference,
        }

    def _source(self, t: Array) -> tuple[Array, Array]:
        decay = -self.gamma * t
        released = self.D_0 * t + self.D_1 * t * first_difference(np.zeros_like(t), decay)
        return self.D_0 + self.D_1 * np.exp(decay), released

    def _difference(self, t: Array, h: float, drive: float) -> tuple[Array, Array]:
        """T_2 - T_1 and its integral over time."""
        zero, decay, source_decay = np.zeros_like(t), -h * (1.0 / self.C_1 + 1.0 / self.C_2) * t, -self.gamma * t
        initial = self.T_2 - self.T_1
        value, integral = initial * np.exp(decay), initial * t * first_difference(zero, decay)
        for strength, exponent in ((self.D_0, zero), (self.D_1, source_decay)):
            value = value + strength * drive * t * first_difference(exponent, decay)
            integral = integral + strength * drive * t**2 * second_difference(exponent, decay)
        return value, integral
