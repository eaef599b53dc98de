"""A scene in a Cantera reactor network, beside gas reactors, reservoirs, walls and flow controllers.

``interface`` (the reactor that holds a scene), ``network`` (a ReactorNet that stops at breakpoints and limits),
``coupling`` (how other reactors touch its bodies), ``gas`` (gases and solids that react with it), ``embedded`` (the
scene in it, and what it went through).
"""

from surfacechem.reactor.gas import ReactingGas, ReactingGasAtPressure, ReactingSolid
from surfacechem.reactor.interface import InterfaceReactor, InterfaceStopped
from surfacechem.reactor.network import ReactorNet

__all__ = [
    "InterfaceReactor",
    "InterfaceStopped",
    "ReactingGas",
    "ReactingGasAtPressure",
    "ReactingSolid",
    "ReactorNet",
]
