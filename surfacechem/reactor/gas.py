"""A gas that reacts with the surfaces beside it: what they take it loses, what they make it receives."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import cantera
import numpy as np

from surfacechem.solve.contract import Array


class Receiver:
    """What a gas beside interfaces adds to Cantera's own balances.

    ``temperature`` is the place of that among its variables: after it come mass fractions, the first is the mass.
    """

    temperature: int

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self.sources: list[Callable[[float], tuple[Array, float]]] = []
        """Amounts of species [kmol/s] and enthalpy [W] that come in at a time [s]."""
        self.weights = self.phase.molecular_weights  # type: ignore[attr-defined]

    def energies(self) -> Array:
        """What a species holds of the quantity in whose balance the temperature is [J/kmol]."""
        raise NotImplementedError

    def after_eval(self, t: float, _lhs: Any, rhs: Any) -> None:
        """Called by Cantera after its own balances of mass, energy and species, which this adds to."""
        for source in self.sources:
            amounts, enthalpy = source(t)
            masses = amounts * self.weights
            total = masses.sum()
            rhs[0] += total
            if self.energy_enabled:  # type: ignore[attr-defined]  # its left side is the heat capacity
                rhs[self.temperature] += enthalpy - amounts @ self.energies()
            own = np.asarray(rhs)[self.temperature + 1 : self.temperature + 1 + len(masses)]
            own += masses - total * self.phase.Y  # type: ignore[attr-defined]


class ReactingGas(Receiver, cantera.ExtensibleIdealGasReactor):
    """Cantera's IdealGasReactor for a gas beside the surface of an interface.

    ``InterfaceReactor(..., neighbours={name: gas})`` makes it a neighbour, of one interface or of several.

    Its arguments are those of an IdealGasReactor, first the gas, a ``cantera.Solution``.
    """

    temperature = 2

    def energies(self) -> Array:
        return np.asarray(self.phase.partial_molar_int_energies)


class ReactingGasAtPressure(Receiver, cantera.ExtensibleIdealGasConstPressureReactor):
    """Cantera's IdealGasConstPressureReactor for a gas beside the surface of an interface.

    Its arguments are those of an IdealGasConstPressureReactor, first the gas, a ``cantera.Solution``.
    """

    temperature = 1

    def energies(self) -> Array:
        return np.asarray(self.phase.partial_molar_enthalpies)
