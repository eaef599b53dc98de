"""One kind of bond that breaks at a rate exponential in the force it carries."""

from __future__ import annotations

from surfacechem.contracts.terms import parameter
from surfacechem.quantities import BOLTZMANN
from surfacechem.references.base import Reference


class BellBond(Reference):
    """Bell's law: an unstressed rate and a distance over which the force does work."""

    k_off: float = parameter("1/s", "rupture rate without force", above=0)
    x_off: float = parameter("m", "distance to the transition state", above=0)
    T: float = parameter("K", "temperature", above=0)
    phi_i: float = parameter("1", "initial bonding state", default=1.0, above=0, at_most=1)

    @property
    def force_scale(self) -> float:
        """Force [N] that speeds rupture up by a factor e: k_B T / x_off."""
        return BOLTZMANN * self.T / self.x_off
