"""Two bodies of constant capacity with a heated medium between them."""

from __future__ import annotations

from surfacechem.contracts.terms import parameter
from surfacechem.references.base import Reference


class HeatedMedium(Reference):
    r"""What is given of the bodies, the conductances and the source :math:`D_0+D_1e^{-\gamma t}` in the medium."""

    C_1: float = parameter("J/(m^2 K)", "heat capacity of body 1", above=0)
    C_2: float = parameter("J/(m^2 K)", "heat capacity of body 2", above=0)
    h_1: float = parameter("W/(m^2 K)", "conductance between medium and body 1", above=0)
    h_2: float = parameter("W/(m^2 K)", "conductance between medium and body 2", above=0)
    T_1: float = parameter("K", "initial temperature of body 1", above=0)
    T_2: float = parameter("K", "initial temperature of body 2", above=0)
    D_0: float = parameter("W/m^2", "steady part of the source", default=0.0)
    D_1: float = parameter("W/m^2", "decaying part of the source at the start", default=0.0)
    gamma: float = parameter("1/s", "decay rate of the source", default=0.0, at_least=0)
