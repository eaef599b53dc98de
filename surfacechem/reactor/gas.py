"""A gas that reacts with the surfaces beside it: what they take it loses, what they make it receives."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import cantera
import numpy as np

from surfacechem.solve.contract import Array

MASS, TEMPERATURE, SPECIES = 0, 2, 3
"""Places of an IdealGasReactor's variables: mass, volume, temperature, and then mass fractions."""


class ReactingGas(cantera.ExtensibleIdealGasReactor):
    """Cantera's IdealGasReactor for a gas beside the surface of an interface.

    It takes what an IdealGasReactor takes. ``InterfaceReactor(..., neighbours={name: gas})`` makes it a neighbour, of
    one interface or of several.
    """

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self.weights = self.phase.molecular_weights
        self.sources: list[Callable[[float], tuple[Array, float]]] = []
        """Amounts of species [kmol/s] and enthalpy [W] that come in at a time [s]."""

    def after_eval(self, t: float, _lhs: Any, rhs: Any) -> None:
        """Called by Cantera after its own balances of mass, energy and species, which this adds to."""
        for source in self.sources:
            amounts, enthalpy = source(t)
            masses = amounts * self.weights
            total = masses.sum()
            rhs[MASS] += total
            if self.energy_enabled:  # its left side is the heat capacity at constant volume
                rhs[TEMPERATURE] += enthalpy - amounts @ self.phase.partial_molar_int_energies
            own = np.asarray(rhs)[SPECIES : SPECIES + len(masses)]
            own += masses - total * self.phase.Y
