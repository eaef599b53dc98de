"""Constant heat extraction from one temperature."""

from __future__ import annotations

from surfacechem.contracts.terms import parameter
from surfacechem.references.base import Reference


class SteadyCooling(Reference):
    """A total capacity that loses heat at a constant rate until its temperature is zero."""

    C: float = parameter("J/(m^2 K)", "total heat capacity at T_0", above=0)
    T_i: float = parameter("K", "initial temperature", above=0)
    Q: float = parameter("W/m^2", "heat extracted", above=0)
