"""Dry friction that weakens with temperature, constant capacity."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from surfacechem.references._heated_body import FrictionallyHeated
from surfacechem.references.base import Array


class WeakeningFrictionConstantCapacity(FrictionallyHeated):
    r"""Heating by friction with :math:`\mu=\mu_0T_0/T`, constant capacity, no loss.

    .. math:: C\dot T=D_0\frac{T_0}T,\qquad T^2=T_i^2+2T_0D_0t/C

    With :math:`D_0=\mu_0pv`. The same T(t) as steady sliding with quadratic energies. Any t >= 0.

    Source: Sauer, Duong & Mandadapu (2021), section 6.1, with the temperature dependence of their friction coefficient
    and a constant capacity, integrated.

    >>> body = WeakeningFrictionConstantCapacity(C=4000.0, T_0=300.0, T_i=300.0, D_0=3000.0)
    >>> f"{body.solution(4e4)['T']:.10f}"
    '4253.2340636273'
    """

    name: ClassVar[str] = "weakening-friction-constant-capacity"

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        T = np.sqrt(self.T_i**2 + 2.0 * self.T_0 * self.D_0 * t / self.C)
        return {"T": T, "D": self.D_0 * self.T_0 / T}
