"""Gases and solids that react with a surface of an interface: reactions take molecules from them and add others."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NoReturn, Self

import cantera
import numpy as np

from surfacechem.contracts.terms import Spec
from surfacechem.contracts.units import parse
from surfacechem.errors import InputError
from surfacechem.solve.adapters.cantera_network import StateVectorReactor
from surfacechem.solve.contract import Array

REFUSED_CONNECTORS: list[Any] = []
"""Connectors that were refused: the reactors they join keep pointers to them in Cantera."""


def refuse(connector: Any, message: str) -> NoReturn:
    """Raise InputError for a connector that Cantera creates, and make it carry nothing between its reactors."""
    REFUSED_CONNECTORS.append(connector)
    if isinstance(connector, cantera.FlowDevice):
        connector.device_coefficient = 0.0
    else:
        connector.area = 0.0
    raise InputError(message)


class Receiver:
    """Neighbour of interfaces that receives the products of their reactions."""

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self.sources: list[tuple[Any, Callable[[float], tuple[Array, float]]]] = []
        """Interfaces, each with a function of time [s] for its inflow of species [kmol/s] and enthalpy [W]."""


class Gas(Receiver):
    """Source terms of interfaces in Cantera's balances of a gas.

    ``temperature`` is the index of the temperature among its variables: mass fractions follow it, and the mass is the
    first. ``energies`` is Cantera's name of the molar quantity of species in the energy balance [J/kmol].
    """

    temperature: int
    energies: str

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self.weights = self.phase.molecular_weights  # type: ignore[attr-defined]

    def after_eval(self, t: float, _lhs: Any, rhs: Any) -> None:
        """Add to Cantera's balances of mass, energy and species; Cantera calls it after their evaluation."""
        rates, first, phase = np.asarray(rhs), self.temperature + 1, self.phase  # type: ignore[attr-defined]
        for _, source in self.sources:
            amounts, enthalpy = source(t)
            masses = amounts * self.weights
            total = float(amounts @ self.weights)
            rates[0] += total
            if self.energy_enabled:  # type: ignore[attr-defined]  # the left side is the heat capacity
                rates[self.temperature] += enthalpy - float(amounts @ getattr(phase, self.energies))
            rates[first : first + len(masses)] += masses - total * phase.Y


class ReactingGas(Gas, cantera.ExtensibleIdealGasReactor):
    """Cantera's IdealGasReactor for a gas next to the surface of an interface.

    ``InterfaceReactor(..., neighbours={name: gas})`` makes it a neighbour, of one interface or of several.

    Its arguments are those of an IdealGasReactor, first the gas, a ``cantera.Solution``.
    """

    temperature = 2
    energies = "partial_molar_int_energies"


class ReactingGasAtPressure(Gas, cantera.ExtensibleIdealGasConstPressureReactor):
    """Cantera's IdealGasConstPressureReactor for a gas next to the surface of an interface.

    Its arguments are those of an IdealGasConstPressureReactor, first the gas, a ``cantera.Solution``.
    """

    temperature = 1
    energies = "partial_molar_enthalpies"


MASS = Spec("kg", "mass at the start", above=0)


class ReactingSolid(Receiver, StateVectorReactor):
    """A solid or a liquid next to the surface of an interface, such as the particle of an electrode or its electrolyte.

    ``InterfaceReactor(..., neighbours={name: solid})`` makes it a neighbour. Its variables are its amounts relative to
    the total amount at the start; temperature and pressure are held constant, whatever heat that takes. Its electric
    potential is that of the case. There is no other inflow or outflow: connectors are refused.

    Parameters
    ----------
    phase
        A ``cantera.Solution`` in its initial state.
    mass
        Its initial mass: kg, or a text with a unit.
    clone
        True for a copy of the phase; False for the phase itself, whose state then follows the reactor.
    name
        Its name in the network.

    Raises
    ------
    InputError
        For an invalid mass.
    """

    switches = {  # noqa: RUF012 - never changed
        "chemistry_enabled": (True, "Set multipliers on the phase of the interface beside it."),
        "energy_enabled": (False, "Its temperature is held; let a gas or a body have one that follows."),
    }

    def __new__(cls, phase: Any, *, mass: float | str, clone: bool = True, name: str = "solid") -> Self:
        """Use the phase itself, or a copy that Cantera makes for a reservoir."""
        return super().__new__(cls, cantera.Reservoir(phase, clone=True).phase if clone else phase, name=name)

    def __init__(self, phase: Any, *, mass: float | str, clone: bool = True, name: str = "solid") -> None:
        super().__init__(self.surface, name=name)
        kilograms = parse(mass, "kg", name="mass")
        MASS.check("mass", kilograms)
        self.names = tuple(phase.species_names)
        self.whole = kilograms / phase.mean_molecular_weight
        """Total amount at the start [kmol]."""
        self.x = phase.X

    @property
    def phase(self) -> Any:
        """The phase in its present state; Cantera would reset its own phase to the initial state."""
        return self.surface

    @property
    def amounts(self) -> Array:
        """Present amounts of its species [kmol]."""
        return np.asarray(self.x * self.whole)

    @property
    def mass(self) -> float:
        """Present mass [kg]."""
        return float(self.amounts @ self.phase.molecular_weights)

    @property  # type: ignore[misc]  # it follows from the mass
    def volume(self) -> float:
        """Present volume [m^3]."""
        return self.mass / float(self.phase.density)

    def _add_wall(self, wall: Any) -> None:
        refuse(wall, f"a wall on {self.name} would be without effect: its temperature and pressure are held.")

    def _add_inlet(self, device: Any) -> None:
        refuse(device, f"a flow into {self.name} would be lost: only reactions of interfaces change its amounts.")

    def _add_outlet(self, device: Any) -> None:
        refuse(device, f"a flow out of {self.name} has no source: only reactions of interfaces change its amounts.")

    def start(self) -> Array:
        return np.asarray(self.x)

    def put(self, x: Array) -> None:
        self.x = x
        self.phase.TPX = None, None, x

    def rates(self, t: float) -> Array:
        made = sum((source(t)[0] for _, source in self.sources), np.zeros(len(self.x)))
        return np.asarray(made / self.whole)
