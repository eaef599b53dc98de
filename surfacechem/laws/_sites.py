"""Two surfaces of sites that interact by a Lennard-Jones type potential."""

from __future__ import annotations

import math

from surfacechem.contracts.terms import Potential, parameter
from surfacechem.expressions import Expression


class InteractingSites(Potential):
    """Densities of sites on both surfaces, strength and range of the interaction of a pair.

    The sites stay with the surfaces: their densities are those on the reference area.
    """

    positive = ("g_n",)

    n_1: float = parameter("1/m^2", "density of interacting sites on body 1", at_least=0, stretch=-1)
    n_2: float = parameter("1/m^2", "density of interacting sites on body 2", at_least=0, stretch=-1)
    psi_0: float = parameter("J", "interaction energy of a pair", at_least=0)
    g_0: float = parameter("m", "range of the interaction", above=0)

    @property
    def stiffness(self) -> Expression:
        """A = 2 pi n_1 n_2 psi_0 [Pa/m]."""
        return 2 * math.pi * self.n_1 * self.n_2 * self.psi_0
