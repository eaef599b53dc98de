"""Parallel bonds that share a constant load."""

from __future__ import annotations

from surfacechem.contracts.terms import parameter
from surfacechem.references._bell import BellBond


class Cluster(BellBond):
    """Bell bonds whose number per area decides on the force of each."""

    n_c: float = parameter("1/m^2", "density of bonding sites", above=0)
    t_n: float = parameter("Pa", "tensile traction", above=0)

    @property
    def load(self) -> float:
        """Force per site in units of the force scale."""
        return self.t_n / (self.n_c * self.force_scale)
