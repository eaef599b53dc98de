"""Energy balances, temperature states and what must hold for them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import symengine

from surfacechem.contracts.terms import Load
from surfacechem.errors import InputError, Place
from surfacechem.expressions import Expression, depends, derivative
from surfacechem.model import balances
from surfacechem.model.balances import HEAT, INTERFACE, MECHANICS, OUTSIDE, WORK, Node, Power
from surfacechem.model.build import Build
from surfacechem.model.constraints.folds import determinant
from surfacechem.model.ledger import GAPS
from surfacechem.model.system import STABLE, Margin, State
from surfacechem.quantities import VARIABLES, Quantity

_NEWTON = 20
"""Steps to a temperature from an energy that is close to quadratic."""

COLD = 1e-9
"""Temperature that counts as zero [K]."""

CAPACITY_REMEDY = (
    "The interface's potential takes more capacity than there is. Of a bond energy: kappa_2 (1 - phi_i)^2 must stay "
    "below 1, with kappa_2 = K_2 / (T_0 C) and C the capacities that share this temperature."
)


def surface_work(build: Build) -> Iterator[Power]:
    """Rates of what the free energy depends on beside temperature, and the work that tractions do on the interface."""
    build.rates = {bond.symbol: bond.dot for bond in build.bonding.values()}
    for name, label, text in (
        *((gap, f"W_{gap}", f"work done on the gap {gap}") for gap in GAPS),
        ("J_c", "W_J", "work done in stretching the surface"),
    ):
        x = symengine.Symbol(name)
        if not depends(build.psi, x):
            continue
        moved = name in build.motion.gap_rates
        build.rates[x] = build.motion.gap_rates[name] if moved else build.rate_of(name)
        power = balances.power(build.psi, x, build.rates[x])
        if power != 0:
            yield Power(WORK, MECHANICS if moved else OUTSIDE, INTERFACE, power, label, text)
    phi = symengine.Symbol("phi")
    if phi not in build.rates and depends(build.psi, phi):
        build.rates[phi] = build.rate_of("phi")


def equations(build: Build) -> Iterator[Power]:
    """Energy balances, states and margins of the temperatures."""
    rates = build.rates
    free = [node for node in build.nodes.values() if not node.prescribed]
    for node in free:
        _temperature_state(build, node)
    own_rows = {node.name: balances.node_row(node, rates, build.about) for node in free}
    for node in free:
        _temperature_margins(build, node, own_rows[node.name])
    build.rows.energies(own_rows, _centre(build, own_rows))
    for node in build.nodes.values():
        if node.prescribed:
            build.margins.append(_warm(node))
            yield from _recovered_heat(build, node)
    if not (build.states or build.slabs):
        message = "there is nothing to solve: everything is prescribed. Let a temperature or bonds evolve."
        raise InputError(message, Place(path="bodies"))


def _centre(build: Build, free: Mapping[str, Expression]) -> str:
    """The node whose balance is the sum of all: the interface's, or where it has none the first."""
    interface = build.node_of.get("interface")
    return interface.name if interface and interface.name in free else next(iter(free), "")


def _temperature_state(build: Build, node: Node) -> None:
    F = node.free_energy
    algebraic = balances.second(F, node.T) == 0
    members = [body for body in build.scene.bodies if build.node_of[body.name] is node]
    if algebraic and members:
        raise InputError(
            f"nothing evolves or prescribes {node.name}: give {members[0].name} a heat capacity C, or its "
            "temperature a value.",
            path=f"bodies.{members[0].name}",
        )
    initial = build.scene.initial.get(node.name, _guess(build)) if algebraic else _initial(build, node)
    if not initial > 0:
        raise InputError(
            f"initial {node.name} = {initial:g} K is not an absolute temperature above zero.",
            path=f"initial.{node.name}",
        )
    quantity = VARIABLES.get(node.name, Quantity(node.name, "K", f"temperature of {_members(build, node)}", node.name))
    build.states.append(State(quantity, node.T, node.T_dot, initial, initial, algebraic))


def _initial(build: Build, node: Node) -> float:
    """Initial value; bodies that touch with different temperatures start from the one that keeps their energy."""
    slabs = [build.slabs[name] for name, other in build.node_of.items() if other is node and name in build.slabs]
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


def _members(build: Build, node: Node) -> str:
    return " and ".join(name for name, other in build.node_of.items() if other is node)


def _guess(build: Build) -> float:
    """Start value for an algebraic interface temperature: the mean of the bodies."""
    values = [build.scene.initial.get(build.node_of[body.name].name) for body in build.scene.bodies]
    known = [value for value in values if value is not None]
    loads = [body.temperature for body in build.scene.bodies if isinstance(body.temperature, Load)]
    known += [float(load.bind(load.piece(0.0)).value(0.0)) for load in loads]
    return sum(known) / len(known) if known else float(build.scene.T_0 or 300.0)


def _temperature_margins(build: Build, node: Node, row: Expression) -> None:
    build.margins.append(_warm(node))
    if _is_algebraic(build, node):
        _fold_margin(build, node, row)
    elif "interface" in node.energies and balances.second(build.psi, node.T) != 0:
        capacity = balances.conditioned(node.capacity(), build.about)
        quantity = Quantity(f"C_{node.name}", "J/(m^2 K)", f"heat capacity of {_members(build, node)}")
        symbol = build.name(quantity, capacity)
        reason = f"the heat capacity at {node.name} was lost"
        build.margins.append(Margin(f"C_{node.name} > 0", symbol, reason, remedy=CAPACITY_REMEDY, path="interface"))


def _warm(node: Node) -> Margin:
    return Margin(f"{node.name} > 0", node.T - COLD, f"the temperature {node.name} reached zero")


def _is_algebraic(build: Build, node: Node) -> bool:
    return any(state.algebraic for state in build.states if state.name == node.name)


def _fold_margin(build: Build, node: Node, row: Expression) -> None:
    """An algebraic temperature is stable while heat leaves faster than it is produced as it rises."""
    explicit = {bond.dot: bond.dot - build.rows[name] for name, bond in build.bonding.items()}
    slope = _with_velocity(build, build.expanded(row.subs(explicit)), node.T)
    if slope == 0:
        raise InputError(
            f"nothing determines the interface temperature {node.name}: it has no capacity and no heat path. Give the "
            "interface a capacity or a heat path, or let it share the temperature of a body.",
            Place(path="interface.temperature"),
        )
    reason = f"ignition: no temperature {node.name} balances the heat that the interface produces"
    other = f"runaway cooling: no temperature {node.name} balances the heat that the interface takes up"
    fluxes = {symengine.Symbol(item.name): 0 for item in build.named if item.name.startswith("q_")}
    produced = -build.expanded(row.subs(explicit).subs(fluxes))
    if not slope.free_symbols & {state.symbol for state in build.states}:
        reason = f"no heat path determines the temperature {node.name}"
        other = reason
    build.margins.append(Margin(f"{STABLE}{node.name}", slope, reason, below=(produced, other)))


def _with_velocity(build: Build, heat: Expression, T: Expression) -> Expression:
    """Slope of a balance of heat with temperature as a motion that has no inertia follows it."""
    following, slope = list(build.motion.slides_by.values()), derivative(heat, T)
    if not any(depends(heat, x) for x in following):
        return slope
    tractions = [build.expanded(build.rows[str(x)]) for x in following]
    A = [[derivative(row, x) for x in following] for row in tractions]
    moved = [derivative(row, T) for row in tractions]
    for j, x in enumerate(following):
        turned = [[*row[:j], change, *row[j + 1 :]] for row, change in zip(A, moved, strict=True)]
        slope -= derivative(heat, x) * determinant(turned) / determinant(A)
    return slope


def _recovered_heat(build: Build, node: Node) -> Iterator[Power]:
    """The heat that must be supplied from outside to keep a prescribed temperature."""
    if node.energies:
        build.rate_of(node.name)  # refuses a jump, whose heat would be unknown
    supply = balances.node_row(node, build.rates, build.about)
    if supply != 0:
        text = f"heat supplied to keep {node.name}"
        symbol = build.name(Quantity(f"Q_{node.name}", "W/m^2", text), supply)
        yield Power(HEAT, OUTSIDE, node.name, symbol, f"H_{node.name}", text, entropy=symbol / node.T)
