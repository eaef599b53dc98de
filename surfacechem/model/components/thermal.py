"""Temperatures: nodes and their members, the energies of the bodies, the balances of energy and their margins."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import partial

import symengine

from surfacechem.contracts.terms import Load, Spec
from surfacechem.errors import InputError, Place
from surfacechem.expressions import Expression, depends, derivative
from surfacechem.model import balances
from surfacechem.model.balances import HEAT, INTERFACE, OUTSIDE, SURROUNDINGS, Node, PowerFlow
from surfacechem.model.build import Build, Thermal
from surfacechem.model.constraints.fold import determinant
from surfacechem.model.system import STABLE_PREFIX, Margin, State
from surfacechem.quantities import VARIABLES, Quantity
from surfacechem.tolerances import NO_AMOUNT

_NEWTON = 20
"""Newton steps to a temperature from an energy that is close to quadratic."""

CAPACITY_REMEDY = (
    "The interface's potential takes more capacity than there is. Of a bond energy: kappa_2 (1 - phi_i)^2 must stay "
    "below 1, with kappa_2 = K_2 / (T_0 C) and C the capacities that share this temperature."
)


def variables(build: Build) -> Iterator[Thermal]:
    """Yield the temperature nodes with their members, first without, then with the free energies of the bodies."""
    scene = build.scene
    if scene.T_0 is not None:
        spec = Spec("K", "reference temperature", above=0)
        build.variables.define("T_0", partial(build.constant, "T_0", "T_0", spec, scene.T_0), "constant", "T_0")
    if build.interface.temperature is None:

        def mean() -> Expression:
            shares, nodes = build.shares(), build.thermal.node_of
            if SURROUNDINGS in shares and SURROUNDINGS not in nodes:
                problem = "heat is lost to surroundings that have no temperature"
                raise InputError(f"{problem}. Add `surroundings`.", path="interface")
            inverse = symengine.Add(*(share / nodes[end].T for end, share in shares.items()))
            return build.name(VARIABLES["T_c"], 1 / inverse)

        build.variables.define("T_c", mean, "derived", "harmonic mean of the bodies, no medium")
    thermal = Thermal({}, {})
    given: list[tuple[str, str | Load | None, str]] = [
        *((f"T_{k}", body.temperature, body.name) for k, body in enumerate(scene.bodies, start=1)),
        ("T_c", scene.interface.temperature, INTERFACE),
        ("T_a", scene.surroundings, SURROUNDINGS),
    ]
    for variable, temperature, member in given:
        if temperature is not None:
            thermal = _with_member(build, thermal, variable, temperature, member)
    yield thermal
    for k, body in enumerate(scene.bodies, start=1):
        if body.energy is not None:
            T = thermal.node_of[body.name].T
            law = build.variables.bind(body.energy, f"bodies.{body.name}", f"_{k}")
            F = law.energy(T=T, T_0=build.variables.get("T_0", f"the body {body.name}", f"bodies.{body.name}"))
            build.refuse_foreign(F, {T}, body.energy)
            build.law_domain(body.energy, law, {"T": T})
            thermal = thermal.with_energy(body.name, F)
    yield thermal


def _with_member(build: Build, thermal: Thermal, variable: str, temperature: str | Load, member: str) -> Thermal:
    """Return the nodes with that of one more member, which may share the node of another member."""
    name, own = (variable, temperature) if isinstance(temperature, Load) else (temperature, None)
    path = f"{member}.temperature" if member == INTERFACE else f"bodies.{member}.temperature"
    if own is not None and name in thermal.nodes:
        message = f"{name} has two roles: the temperature of {member}, and a node of another member."
        raise InputError(message, path=path)
    if name == "T_0" or not re.fullmatch(r"T\w*", name, re.ASCII):
        message = f"'{name}' cannot name a temperature: use T, followed by letters, digits or _, but not T_0."
        raise InputError(message, path=path)
    node = thermal.nodes.get(name)
    if node is None:
        symbol, load = symengine.Symbol(name), own or build.scene.loading.get(name)
        if load is None:
            node = Node(name, symbol, symengine.Symbol(f"d{name}_dt"))
        else:
            build.prescribe(VARIABLES.get(name, Quantity(name, "K", f"temperature {name}", name)), load)
            node = Node(name, symbol, build.slope_of(name), prescribed=True)
    role = "prescribed" if node.prescribed else ("temperature node" if name == variable else "merged")
    build.variables.define(variable, partial(symengine.Symbol, name), role, f"{member}: {name}")
    return Thermal({**thermal.nodes, name: node}, {**thermal.members, member: name})


def rows(build: Build) -> Iterator[PowerFlow | State | Margin]:
    """Yield states, margins and energy balances of temperatures; prescribed ones give the heat that keeps them."""
    thermal = build.thermal
    yield from (_temperature_state(build, node) for node in thermal.free)
    own_rows = {node.name: build.energy_row(node) for node in thermal.free}
    # The row of the interface's node is the sum of all rows; if it is not free, the first row is.
    centre = thermal.members.get(INTERFACE, "")
    build.rows.energies(own_rows, centre if centre in own_rows else next(iter(own_rows), ""))
    for node in (*thermal.free, *thermal.prescribed):
        reason, least = f"the temperature {node.name} reached zero", f"Below {NO_AMOUNT:g} K it counts as zero."
        yield Margin(f"{node.name} > 0", node.T - NO_AMOUNT, reason, remedy=least)
        if node.prescribed:
            if node.energies:
                build.rate_of(node.name)  # refuses a jump, whose heat would be unknown
            supply = build.energy_row(node)
            if supply != 0:
                text = f"heat supplied to keep {node.name}"
                symbol = build.name(Quantity(f"Q_{node.name}", "W/m^2", text), supply)
                yield PowerFlow(HEAT, OUTSIDE, node.name, symbol, f"H_{node.name}", text, entropy=symbol / node.T)
        elif balances.second(node.free_energy, node.T) == 0:
            yield _fold_margin(build, node, own_rows[node.name])
        elif INTERFACE in node.energies and balances.second(build.psi, node.T) != 0:
            capacity = balances.conditioned(node.capacity(), build.expansion_points)
            quantity = Quantity(f"C_{node.name}", "J/(m^2 K)", f"heat capacity of {thermal.owners(node)}")
            symbol = build.name(quantity, capacity)
            reason = f"the heat capacity at {node.name} was lost"
            yield Margin(f"C_{node.name} > 0", symbol, reason, remedy=CAPACITY_REMEDY, path="interface")


def _temperature_state(build: Build, node: Node) -> State:
    algebraic = balances.second(node.free_energy, node.T) == 0
    members = [body for body in build.scene.bodies if build.thermal.members[body.name] == node.name]
    if algebraic and members:
        owner = members[0].name
        remedy = f"give {owner} a heat capacity C, or its temperature a value"
        raise InputError(f"nothing evolves or prescribes {node.name}: {remedy}.", path=f"bodies.{owner}")
    initial = _guess(build, node) if algebraic else _initial(build, node)
    if not initial > 0:
        message = f"initial {node.name} = {initial:g} K is not an absolute temperature above zero."
        raise InputError(message, path=f"initial.{node.name}")
    quantity = VARIABLES.get(
        node.name, Quantity(node.name, "K", f"temperature of {build.thermal.owners(node)}", node.name)
    )
    return State(quantity, initial, initial, algebraic, is_temperature=True)


def _initial(build: Build, node: Node) -> float:
    """Return the initial value; bodies in perfect contact at different temperatures start from their common energy."""
    thermal = build.thermal
    slabs = [slab for name, slab in thermal.slabs.items() if thermal.members[name] == node.name]
    inside = [build.scene.initial.get(slab.profile) for slab in slabs]
    if node.name in build.scene.initial or len(slabs) < len(node.energies) or None in inside:
        return build.initial(node.name)
    values = {p.symbol: p.value for p in build.parameters.items}
    parts = [
        (balances.internal_energy(node.energies[slab.body.name], node.T).subs(values), float(T))
        for slab, T in zip(slabs, inside, strict=True)
        if T is not None
    ]
    U = symengine.Add(*(part for part, _ in parts))
    missing = U - sum(part.subs({node.T: T}) for part, T in parts)
    T = sum(T for _, T in parts) / len(parts)
    for _ in range(_NEWTON):
        T -= float(missing.subs({node.T: T})) / float(derivative(missing, node.T).subs({node.T: T}))
    return T


def _guess(build: Build, node: Node) -> float:
    """Return the start value of an algebraic interface temperature: as given, or the mean of the bodies."""
    initial, bodies = build.scene.initial, build.scene.bodies
    if node.name in initial:
        return initial[node.name]
    known = [initial[name] for body in bodies if (name := build.thermal.members[body.name]) in initial]
    known += [body.temperature.at_start() for body in bodies if isinstance(body.temperature, Load)]
    return sum(known) / len(known) if known else float(build.scene.T_0 or 300.0)


def _fold_margin(build: Build, node: Node, row: Expression) -> Margin:
    """Return the stability margin of an algebraic temperature: heat losses must grow faster with it than production."""
    explicit = {bond.dot: bond.dot - build.rows[name] for name, bond in build.bonding.items()}
    slope = _with_velocity(build, build.expanded(row.subs(explicit)), node.T)
    if slope == 0:
        problem = f"nothing determines the interface temperature {node.name}: it has no capacity and no heat path"
        remedy = "Give the interface a capacity or a heat path, or let it share the temperature of a body."
        raise InputError(f"{problem}. {remedy}", Place(path="interface.temperature"))
    reason = f"ignition: no temperature {node.name} balances the heat that the interface produces"
    other = f"runaway cooling: no temperature {node.name} balances the heat that the interface takes up"
    carried = {power.rate: 0 for power in build.powers if power.channels}
    produced = -build.expanded(row.subs(explicit).subs(carried))
    if not slope.free_symbols & {state.symbol for state in build.states}:
        reason = f"no heat path determines the temperature {node.name}"
        other = reason
    return Margin(f"{STABLE_PREFIX}{node.name}", slope, reason, below=(produced, other), stability=node.name)


def _with_velocity(build: Build, heat: Expression, T: Expression) -> Expression:
    """Return the slope of a heat balance with temperature, including the response of sliding without inertia."""
    following, slope = list(build.motion.slip_unknowns.values()), derivative(heat, T)
    if not any(depends(heat, x) for x in following):
        return slope
    tractions = [build.expanded(build.rows[str(x)]) for x in following]
    A = [[derivative(row, x) for x in following] for row in tractions]
    moved = [derivative(row, T) for row in tractions]
    # Cramer's rule for dx/dT from the linearised balances of tractions, A dx/dT = -moved.
    for j, x in enumerate(following):
        turned = [[*row[:j], change, *row[j + 1 :]] for row, change in zip(A, moved, strict=True)]
        slope -= derivative(heat, x) * determinant(turned) / determinant(A)
    return slope
