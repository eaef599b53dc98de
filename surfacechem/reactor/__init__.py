"""A scene in a Cantera reactor network, with gas reactors, reservoirs, walls and flow controllers.

``interface_reactor`` (the reactor that holds a scene), ``network`` (a ReactorNet that stops at breakpoints and events),
``watch`` (event location inside the integrator's steps), ``coupling`` (connections of other reactors to its bodies, and
gases and solids that react with it), ``embedded`` (the scene as its equations, and its history).
"""

from surfacechem.reactor.coupling import ReactingGas, ReactingGasAtPressure, ReactingSolid
from surfacechem.reactor.interface_reactor import InterfaceReactor, InterfaceStopped
from surfacechem.reactor.network import ReactorNet

__all__ = [
    "InterfaceReactor",
    "InterfaceStopped",
    "ReactingGas",
    "ReactingGasAtPressure",
    "ReactingSolid",
    "ReactorNet",
]
