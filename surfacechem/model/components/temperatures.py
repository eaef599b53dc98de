"""Temperature nodes: who carries which temperature, which are prescribed, and the energies of the bodies."""

from __future__ import annotations

import re
from functools import partial

import symengine

from surfacechem.contracts.terms import Load, Spec
from surfacechem.errors import InputError, Place
from surfacechem.expressions import Expression
from surfacechem.model.balances import Node
from surfacechem.model.build import Build
from surfacechem.quantities import VARIABLES, Quantity
from surfacechem.scene import Body


def temperatures(build: Build) -> None:
    """Nodes: who carries which temperature, and which are prescribed."""
    if build.scene.T_0 is not None:
        spec = Spec("K", "reference temperature", above=0)
        build.variables.define("T_0", partial(build.constant, "T_0", "T_0", spec, build.scene.T_0), "constant", "T_0")
    for k, body in enumerate(build.scene.bodies, start=1):
        _join(build, f"T_{k}", body.temperature, body.name)
    if build.interface.temperature is not None:
        _join(build, "T_c", build.interface.temperature, "interface")
    else:
        build.variables.define(
            "T_c", partial(_mean_temperature, build), "derived", "harmonic mean of the bodies, no medium"
        )
    if build.scene.surroundings is not None:
        _join(build, "T_a", build.scene.surroundings, "surroundings")
    for k, body in enumerate(build.scene.bodies, start=1):
        _body_energy(build, body, f"_{k}")


def _join(build: Build, variable: str, temperature: str | Load, member: str) -> None:
    own_history = isinstance(temperature, Load)
    load = temperature if isinstance(temperature, Load) else build.scene.loading.get(temperature)
    name = variable if isinstance(temperature, Load) else temperature
    if own_history and name in build.nodes:
        raise InputError(
            f"{name} has two roles: the temperature of {member}, and a node of another member.", _place(member)
        )
    node = build.nodes.get(name) or _new_node(build, name, load, member)
    build.node_of[member] = node
    role = "prescribed" if node.prescribed else ("temperature node" if name == variable else "merged")
    build.variables.define(variable, lambda: node.T, role, f"{member}: {name}")


def _place(member: str) -> Place:
    return Place(path="interface.temperature" if member == "interface" else f"bodies.{member}.temperature")


def _new_node(build: Build, name: str, load: Load | None, member: str) -> Node:
    if name == "T_0" or not re.fullmatch(r"T\w*", name, re.ASCII):
        message = f"'{name}' cannot name a temperature: use T, followed by letters, digits or _, but not T_0."
        raise InputError(message, _place(member))
    symbol = symengine.Symbol(name)
    quantity = VARIABLES.get(name, Quantity(name, "K", f"temperature of node {name}", name))
    if load is None:
        node = Node(name, symbol, symengine.Symbol(f"d{name}_dt"))
    else:
        build.prescribe(quantity, load)
        node = Node(name, symbol, build.slope_of(name), prescribed=True)
    build.nodes[name] = node
    return node


def _mean_temperature(build: Build) -> Expression:
    shares = build.shares()
    if "surroundings" in shares and "surroundings" not in build.node_of:
        raise InputError("heat is lost to surroundings that have no temperature. Add `surroundings`.", path="interface")
    return build.name(
        VARIABLES["T_c"], 1 / symengine.Add(*(share / build.node_of[end].T for end, share in shares.items()))
    )


def _body_energy(build: Build, body: Body, suffix: str) -> None:
    node = build.node_of[body.name]
    if body.energy is not None:
        law = build.variables.bind(body.energy, f"bodies.{body.name}", suffix)
        F = law.energy(T=node.T, T_0=build.variables.get("T_0", f"the body {body.name}", f"bodies.{body.name}"))
        build.refuse_foreign(F, {node.T}, body.energy)
        node.energies[body.name] = F
