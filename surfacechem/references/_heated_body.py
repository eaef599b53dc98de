"""One temperature heated by friction whose coefficient depends on temperature."""

from __future__ import annotations

from surfacechem.contracts.terms import parameter
from surfacechem.references.base import Reference


class FrictionallyHeated(Reference):
    """A total capacity and the dissipation it would see at the reference temperature."""

    C: float = parameter("J/(m^2 K)", "total heat capacity at T_0", above=0)
    T_0: float = parameter("K", "reference temperature", above=0)
    T_i: float = parameter("K", "initial temperature", above=0)
    D_0: float = parameter("W/m^2", "dissipation at T_0", at_least=0)
