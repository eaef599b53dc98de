"""Friction, heat paths and external heat: what flows, and what it dissipates."""

from __future__ import annotations

import symengine

from surfacechem.assembly.build import Build
from surfacechem.assembly.slip import stick_limit
from surfacechem.balances import Node
from surfacechem.errors import InputError, suggestion
from surfacechem.expressions import Expression
from surfacechem.quantities import Quantity
from surfacechem.system import Margin
from surfacechem.terms import HeatTransfer


def friction(build: Build) -> None:
    """Sliding tractions and what they dissipate; their power comes from outside."""
    for law in build.interface.frictions:
        label = build.label(law)
        bound = build.variables.bind(law, f"interface.friction.{law.name()}")
        traction = build.variables.call(bound, bound.statement)
        build.law_margins(law, {})
        traction = build.name(Quantity(f"t_{label}", "Pa", f"tangential traction of {law.title}"), traction)
        v = build.variables.get("v", law)
        power = build.stretch * traction * v
        build.frictions.add(label)
        build.dissipation[label] = power
        if build.slip is None:
            build.supply(f"W_{label}", f"work done against {law.title}", power, None)
            _reversal(build)
        else:
            build.sliding_tractions.append(build.stretch * traction)
            stick_limit(build, law, bound)


def _reversal(build: Build) -> None:
    if build.slope_of("v") != 0 and not any(margin.name == "v" for margin in build.margins):
        build.margins.append(Margin("v", symengine.Symbol("v"), "sliding reverses", terminal=False))


def heat_paths(build: Build) -> None:
    """Fluxes between nodes, external heat, and the heat of friction and reaction where there is no medium."""
    for law in build.scene.heat:
        _heat_path(build, law)
    for member, Q in ((build.scene.bodies[0].name, "Q_1"), (build.scene.bodies[1].name, "Q_2"), ("interface", "Q_c")):
        if build.variables.has(Q):
            _external_heat(build, member, Q)
    if build.interface.temperature is None:
        heat = sum(build.dissipation.values(), symengine.Integer(0))
        if heat != 0:
            _share(build, heat)


def _share(build: Build, heat: Expression) -> None:
    for body, share in zip(build.scene.bodies, build.shares(), strict=True):
        build.node_of[body.name].inflow.append(share * heat)
        build.from_interface[body.name] += share * heat


def _heat_path(build: Build, law: HeatTransfer) -> None:
    a, b = law.between
    from_node, to_node = _end(build, a), _end(build, b)
    if from_node is to_node:
        raise InputError(
            f"the heat path between {a} and {b} has one temperature, {from_node.name}; remove it.", law.place
        )
    bound = build.variables.bind(law, f"heat.{law.name()}")
    h = build.variables.call(bound, bound.statement)
    area = symengine.Integer(1) if "surroundings" in (a, b) else build.stretch
    quantity = Quantity(_path_name(build, law), "W/m^2", f"heat flux from {a} to {b}", tag="e:qc_k1")
    difference = from_node.T - to_node.T
    flux = build.name(quantity, area * h * difference)
    from_node.inflow.append(-flux)
    to_node.inflow.append(flux)
    production = area * h * difference**2 / (from_node.T * to_node.T)
    build.production(quantity.name, f"heat flow from {a} to {b}", production)
    _received(build, law, flux)


def _received(build: Build, law: HeatTransfer, flux: Expression) -> None:
    """Remember which part of a body's heat comes from the interface or the other body, and which from elsewhere."""
    group = build.into_body if "surroundings" in law.between else build.from_interface
    for end, heat in zip(law.between, (-flux, flux), strict=True):
        if end in group:
            group[end] += heat
        elif end == "interface":
            build.into_interface.append(heat)


def _path_name(build: Build, law: HeatTransfer) -> str:
    """Name of the flux along a heat path: q_12, q_c1, q_1a."""
    short = {body.name: str(k) for k, body in enumerate(build.scene.bodies, start=1)}
    short |= {"interface": "c", "surroundings": "a"}
    return build.unique("q_" + "".join(short[end] for end in law.between))


def _end(build: Build, end: str) -> Node:
    if end in build.node_of:
        return build.node_of[end]
    if end == "interface":
        raise InputError("a heat path ends at the interface, which has no temperature. Give `interface.temperature`.")
    if end == "surroundings":
        raise InputError("a heat path ends at the surroundings. Give `surroundings: {temperature: ...}`.")
    raise InputError(f"heat path: no end '{end}'.{suggestion(end, [*build.node_of, 'interface', 'surroundings'])}")


def _external_heat(build: Build, member: str, name: str) -> None:
    Q = build.variables.get(name, "the energy balance")
    text = f"external heat into {member}"
    if member in build.node_of:
        build.node_of[member].inflow.append(Q)
        build.supply(f"H_{name[2:]}", text, Q, build.node_of[member].T)
    else:
        build.supply(f"H_{name[2:]}", text, Q, build.variables.get("T_c", "the external heat"))
        _share(build, Q)
    if member in build.into_body:
        build.into_body[member] += Q
    else:
        build.into_interface.append(Q)
