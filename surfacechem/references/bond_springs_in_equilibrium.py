"""Bond springs that are in chemical equilibrium while the gap opens."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.references.base import Array, Reference


class BondSpringsInEquilibrium(Reference):
    r"""Springs whose stiffness is in proportion to the bonds, and bonds that are in equilibrium with the tension.

    .. math:: \phi=1-\frac{E_bg_n^2}{2K_0},\quad t_n=\phi E_bg_n\quad\text{for }g_n<\sqrt{2K_0/E_b},\quad\text{else }0

    Peak traction at :math:`\sqrt{2K_0/3E_b}`, work of separation :math:`K_0/2`. Here :math:`g_n=g_i+\dot gt\ge0`; the
    limit of kinetics that are fast against the opening.

    Source: Sauer, Duong & Mandadapu (2021), eq. ex:psi_c with :math:`E_n=\phi E_b` and eq. e:Psi_bt, at zero chemical
    potential.

    >>> bonds = BondSpringsInEquilibrium(E_b=1e16, K_0=0.2, g_dot=1e-9)
    >>> f"{bonds.peak_gap:.9e} {bonds.strength:.9e} {bonds.work_of_separation}"
    '3.651483717e-09 2.434322478e+07 0.1'
    """

    name: ClassVar[str] = "bond-springs-in-equilibrium"

    E_b: float = parameter("Pa/m", "stiffness of complete bonding", above=0)
    K_0: float = parameter("J/m^2", "bond energy density", above=0)
    g_i: float = parameter("m", "initial gap", default=0.0, at_least=0)
    g_dot: float = parameter("m/s", "opening speed", at_least=0)

    @property
    def failure_gap(self) -> float:
        """Gap [m] at which the last bond breaks."""
        return math.sqrt(2.0 * self.K_0 / self.E_b)

    @property
    def peak_gap(self) -> float:
        """Gap [m] of the largest traction."""
        return self.failure_gap / math.sqrt(3.0)

    @property
    def strength(self) -> float:
        """Largest traction [Pa]."""
        return 2.0 / 3.0 * self.E_b * self.peak_gap

    @property
    def work_of_separation(self) -> float:
        """Work [J/m^2] of complete opening."""
        return 0.5 * self.K_0

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        g = self.g_i + self.g_dot * t
        ratio = np.minimum(g / self.failure_gap, 1.0)
        phi = (1.0 - ratio) * (1.0 + ratio)
        return {"g_n": g, "phi": phi, "t_n": phi * self.E_b * g}
