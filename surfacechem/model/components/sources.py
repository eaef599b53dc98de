"""Where the heat of a body comes from: the channels that carry it, or, in perfect contact, what has made it."""

from __future__ import annotations

import symengine

from surfacechem.expressions import Expression, derivative
from surfacechem.model import balances
from surfacechem.model.balances import Node
from surfacechem.model.build import Build
from surfacechem.quantities import Quantity
from surfacechem.scene import Body

GAPS = ("g_n", "g_t", "u_t", "u_t2")
GEOMETRY = (*GAPS, "J_c")
"""What moves the surfaces rather than their bonds."""


def by_channel(build: Build, k: int, body: Body) -> Expression:
    """Heat into a body by stated laws; where several channels carry it, the sum of a flux for each."""
    channels = build.from_interface[body.name]
    if len(channels) < 2:
        return symengine.Add(*channels.values())
    return symengine.Add(*(_part(build, k, body, name, heat) for name, heat in channels.items()))


def by_source(build: Build, k: int, body: Body, flux: Expression) -> None:
    """Name what makes the heat of a body that shares its temperature: its part, by capacity, of each source.

    The rest is exchanged with what has another temperature, supplied from outside, or thermo-elastic.
    """
    node = build.node_of[body.name]
    share = -node.T * balances.second(node.energies[body.name], node.T) / _capacity(build, node)
    made = {"friction": _friction(build), "reaction": heat_of_reaction(build)}
    parts = {name: share * heat for name, heat in made.items() if heat != 0}
    if not parts or len(parts) + _exchanges(build) < 2:
        return
    named = [_part(build, k, body, name, heat) for name, heat in parts.items()]
    if _exchanges(build):
        _part(build, k, body, "exchange", flux - symengine.Add(*named))


def _capacity(build: Build, node: Node) -> Expression:
    """Heat capacity of a node, by its name where it has one."""
    name = f"C_{node.name}"
    known = any(item.name == name for item in build.named)
    return symengine.Symbol(name) if known else balances.conditioned(node.capacity(), build.about)


def _part(build: Build, k: int, body: Body, name: str, heat: Expression) -> Expression:
    text = f"heat flux from the interface into {body.name} by {name}"
    return build.areal(Quantity(f"q_{k}_{name}", "W/m^2", text), heat)


def _friction(build: Build) -> Expression:
    return symengine.Add(*(symengine.Symbol(f"D_{label}") for label in build.dissipation if label in build.frictions))


def heat_of_reaction(build: Build) -> Expression:
    """Heat of all reactions: minus the change of the internal energy with the bonds."""
    node = build.node_of.get("interface")
    U = balances.internal_energy(build.psi, node.T) if node else build.psi
    bonds = {x: rate for x, rate in build.rates.items() if str(x) not in GEOMETRY}
    return -symengine.Add(*(derivative(U, x) * rate for x, rate in bonds.items()))


def _exchanges(build: Build) -> bool:
    """Whether anything but friction and reactions brings heat to the bodies and the interface."""
    supplied = any(build.variables.was_read(Q) for Q in ("Q_1", "Q_2", "Q_c"))
    return (
        bool(build.scene.heat)
        or supplied
        or any(str(x) in GEOMETRY for x in build.rates)
        or bool(build.motion.far_fields)
    )
