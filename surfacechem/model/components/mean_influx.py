r"""Heat that goes from the interface into both bodies alike.

Its driving force is the temperature of the interface over the harmonic mean of the bodies, so that the production of
both fluxes is a square,

.. math:: \sigma = h_m \left( T_c - \frac{2 T_1 T_2}{T_1 + T_2} \right)^2 \frac{T_1 + T_2}{T_1 T_2 T_c} \ge 0,

though one of the two alone may run uphill: into the hotter body, from an interface between both temperatures.
"""

from __future__ import annotations

import symengine

from surfacechem.errors import InputError
from surfacechem.expressions import Expression
from surfacechem.model.build import BOTH, Build
from surfacechem.model.components.exchange import check_closure, conductances, end_node, named_flux, receive
from surfacechem.quantities import Quantity


def mean_influx(build: Build) -> None:
    """Mean influx q_m = h_m [T_c - 2 T_1 T_2 / (T_1 + T_2)] of the paths with the closure `mean`."""
    channels: dict[str, Expression] = {}
    for law in (law for law in build.scene.heat if law.closure == "mean"):
        check_closure(build, law)
        if end_node(build, law.between[0]) is end_node(build, law.between[1]):
            raise InputError("`closure: mean` is of two bodies with temperatures of their own.", law.place)
        for channel, h in conductances(build, law).items():
            channels[channel] = channels.get(channel, symengine.Integer(0)) + h
    if channels:
        _into_both(build, channels)


def _into_both(build: Build, channels: dict[str, Expression]) -> None:
    bodies = [body.name for body in build.scene.bodies]
    (lower, upper), centre = (end_node(build, name) for name in bodies), end_node(build, "interface")
    build.conductances[BOTH] = list(channels.values())
    difference = centre.T - 2 * lower.T * upper.T / (lower.T + upper.T)
    flux = Quantity("q_c12", "W/m^2", "heat flux from interface to each body", tag="r:47")
    total, parts = named_flux(build, flux, {name: build.stretch * h * difference for name, h in channels.items()})
    for name in bodies:
        build.node_of[name].inflow.append(total)
    centre.inflow.append(-2 * total)
    for channel, heat in parts.items():
        for end, share in ((bodies[0], heat), (bodies[1], heat), ("interface", -2 * heat)):
            receive(build, end, share, channel)
    sum_h = symengine.Add(*channels.values())
    _warn_of_uphill(build, bodies)
    production = build.stretch * sum_h * difference**2 * (lower.T + upper.T) / (lower.T * upper.T * centre.T)
    build.production(flux.name, "heat flow from interface to each body", production)


def _warn_of_uphill(build: Build, bodies: list[str]) -> None:
    """Say where an interface heats a body that is hotter than itself."""
    (cold, _), (hot, name) = sorted((build.at_start(build.node_of[body].T), body) for body in bodies)
    if hot > cold:
        harmonic = 2 * cold * hot / (cold + hot)
        build.warnings.append(
            f"`closure: mean` heats both bodies alike: as they start, {name} also from an interface that is cooler "
            f"than itself, between {harmonic:.6g} K and {hot:.6g} K. Their entropy production together is positive. "
            "Where no heat should flow uphill, give paths from each body to the interface."
        )
