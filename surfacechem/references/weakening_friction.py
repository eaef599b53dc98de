"""Dry friction that weakens with temperature, quadratic energies."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from surfacechem.references._heated_body import FrictionallyHeated
from surfacechem.references.base import Array


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

    name: ClassVar[str] = "weakening-friction"

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        T = np.cbrt(self.T_i**3 + 3.0 * self.T_0**2 * self.D_0 * t / self.C)
        return {"T": T, "D": self.D_0 * self.T_0 / T}
