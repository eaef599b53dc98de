"""Ledger of the powers of a scene: accounts, flows into the nodes, and heat fluxes.

Also the totals that the ledger must explain, the sinks of the heat of jumps, and the thermal regime in words.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from typing import Any, NamedTuple

import symengine

from surfacechem.errors import InputError
from surfacechem.expressions import Expression, depends, derivative
from surfacechem.model import balances
from surfacechem.model.automaton import Sink
from surfacechem.model.balances import DISSIPATION, INTERFACE, MECHANICS, OUTSIDE, WORK, Node, PowerFlow
from surfacechem.model.build import Build, Record
from surfacechem.model.components.heat import receivers
from surfacechem.model.system import Account
from surfacechem.quantities import VARIABLES, Quantity
from surfacechem.scene import Body

GAPS = ("g_n", "g_t", "u_t", "u_t2")
GEOMETRY = (*GAPS, "J_c")
"""Variables of the free energy that move the surfaces, not their bonds."""


class Flow(NamedTuple):
    """Energy flow between two places [W/m^2]; an interface without heat capacity passes it on to the bodies."""

    source: str
    target: str
    rate: Expression
    channels: Mapping[str, Expression] = {}


def energy_flows(build: Build) -> Iterator[Flow]:
    """Yield the energy flows, from source to target, of all powers of a scene."""
    for power in build.powers:
        targets = power.target if isinstance(power.target, Mapping) else {power.target: symengine.Integer(1)}
        if INTERFACE in targets and INTERFACE not in build.thermal.node_of and power.kind != WORK:
            channel = {MECHANICS: "friction", INTERFACE: "reaction", OUTSIDE: "external"}[power.source]
            heats = {end: share * power.amount for end, share in build.shares().items()}
            yield from (Flow(INTERFACE, end, heat, {channel: heat}) for end, heat in heats.items() if heat != 0)
        else:
            for place, share in targets.items():
                yield Flow(power.source, place, share * power.amount, power.channels)


def add_record(build: Build, record: Record) -> None:
    """Keep a record; of a power also its accounts, except those of dissipation, which follow in `flows`."""
    build.add(record)
    if isinstance(record, PowerFlow) and record.kind != DISSIPATION:
        _account(build, record)


def flows(build: Build) -> None:
    """Add the flows into each node, from all powers and the work of tractions, and the accounts of dissipation."""
    build.rates = _rates(build)
    # Tractions do work on the interface: from outside if the gap is prescribed, else from the mechanics.
    for name in GEOMETRY:
        x = symengine.Symbol(name)
        work = balances.power(build.psi, x, build.rates[x]) if x in build.rates else 0
        if work != 0:
            origin = MECHANICS if name in build.motion.gap_rates else OUTSIDE
            label, text = f"W_{name}", f"work done on the gap {name}"
            if name == "J_c":
                label, text = "W_J", "work done in stretching the surface"
            add_record(build, PowerFlow(WORK, origin, INTERFACE, work, label, text))
    for power in build.powers:
        if power.kind == DISSIPATION:
            _account(build, power)
    for passage in energy_flows(build):
        source, target = build.thermal.places.get(passage.source), build.thermal.places.get(passage.target)
        if source is target:  # no change, such as heat that bonds release and keep
            continue
        if target is not None:
            build.inflow.setdefault(target.name, []).append(passage.rate)
        if source is not None:
            build.inflow.setdefault(source.name, []).append(-passage.rate)


def _rates(build: Build) -> dict[Any, Expression]:
    """Return the time derivatives of the variables of the interface's free energy other than temperature."""
    rates: dict[Any, Expression] = {bond.symbol: bond.dot for bond in build.bonding.values()}
    for name in (*GEOMETRY, "phi"):
        x = symengine.Symbol(name)
        if x not in rates and depends(build.psi, x):
            moved = build.motion.gap_rates.get(name)
            rates[x] = build.rate_of(name) if moved is None else moved
    return rates


def _account(build: Build, power: PowerFlow) -> None:
    """Add the accounts of a power: its supply or dissipation, and its entropy production."""
    label, produced = power.label, power.entropy
    text = power.text or label.replace("_", " ")
    if power.kind == DISSIPATION:
        symbol = build.name(Quantity(f"D_{label}", "W/m^2", f"dissipation of {text}"), power.rate)
        turned = Quantity(f"heat_{label}", "J/m^2", f"energy dissipated by {text}")
        build.ledger.append(Account(turned, symbol, "dissipation", label))
        produced = symbol / build.variables.get("T_c", "the dissipation") if produced is None else produced
    elif power.source == OUTSIDE:
        build.ledger.append(Account(Quantity(label, "J/m^2", text), power.rate, "energy supply"))
        if power.entropy is not None:
            entropy = Quantity(f"{label}_entropy", "J/(m^2 K)", f"entropy supplied with {text}")
            build.ledger.append(Account(entropy, power.entropy, "entropy supply"))
        return
    if produced is not None:
        sigma = build.name(Quantity(f"sigma_{label}", "W/(m^2 K)", f"entropy production of {text}"), produced)
        integral = Quantity(f"entropy_{label}", "J/(m^2 K)", f"entropy produced by {text}")
        build.ledger.append(Account(integral, sigma, "entropy production", label))


def _stored(build: Build) -> dict[str, list[tuple[Node | None, Expression]]]:
    """Return the free energies [J/m^2] by member, each with its node, or None if it has no temperature."""
    stored: dict[str, list[tuple[Node | None, Expression]]] = {}
    inside = [node for slab in build.thermal.slabs.values() for node in slab.inner]
    for node in (*build.thermal.nodes.values(), *inside):
        for member, F in node.energies.items():
            if F != 0:
                stored.setdefault(member, []).append((node, F))
    if build.interface.temperature is None and build.psi != 0:  # no medium, so no temperature
        stored[INTERFACE] = [(None, build.psi)]
    return stored


def totals(build: Build) -> None:
    """Name energies, entropies, heat fluxes into the bodies, the heat of reaction and the modes as outputs."""
    suffixes = {INTERFACE: "c"} | {body.name: str(k) for k, body in enumerate(build.scene.bodies, start=1)}
    energies, entropies = [], []
    for member, parts in _stored(build).items():
        U = _sum([balances.internal_energy(F, node.T) if node else F for node, F in parts])
        quantity = Quantity(f"U_{suffixes[member]}", "J/m^2", f"internal energy of {member}")
        energies.append(build.name(quantity, U))
        S = _sum([balances.entropy(F, node.T) for node, F in parts if node])
        if S != 0:
            quantity = Quantity(f"S_{suffixes[member]}", "J/(m^2 K)", f"entropy of {member}")
            entropies.append(build.name(quantity, S))
    energies += build.stored
    build.name(Quantity("E_total", "J/m^2", "total energy"), sum(energies, symengine.Integer(0)))
    build.name(Quantity("S_total", "J/(m^2 K)", "total entropy"), sum(entropies, symengine.Integer(0)))
    _fluxes(build)
    _enthalpy(build)
    for mode in build.modes:
        build.name(Quantity(mode.name, "1", f"mode ({mode.legend})"), mode.symbol)
    if build.interface.bonds:  # coverages of a mechanism stand for the bonding state
        build.name(VARIABLES["phi"], build.variables.get("phi", "the dataset"))


def _sum(terms: list[Expression]) -> Expression:
    """Return the sum; a single term unchanged, since a sum of one term rounds differently."""
    return terms[0] if len(terms) == 1 else symengine.Add(*terms)


def _enthalpy(build: Build) -> None:
    """Name the heat of reaction and the contact enthalpy per bonding site, if nothing but bonds changes."""
    bonds = {x: rate for x, rate in build.rates.items() if str(x) not in GEOMETRY}
    if not any(depends(build.psi, x) for x in bonds) or any(law.taken is not None for law in build.interface.reactions):
        return
    node = build.thermal.node_of.get(INTERFACE)
    U = balances.internal_energy(build.psi, node.T) if node else build.psi
    heat = -symengine.Add(*(derivative(U, x) * rate for x, rate in bonds.items()))
    text = "heat of reaction at constant temperature and gap, positive where exothermic"
    build.name(Quantity("q_reaction", "W/m^2", text), heat)
    if build.variables.has("N_c"):
        borne = sum((symengine.Symbol(g) * derivative(build.psi, symengine.Symbol(g)) for g in GAPS), 0)
        site = build.variables.get("N_c", "the contact enthalpy")
        build.name(Quantity("e_c", "J", "contact enthalpy per bonding site"), (symengine.Symbol("U_c") - borne) / site)


def _fluxes(build: Build) -> None:
    """Name the heat flux from the interface into each body, and add the account of its balance."""
    flows = list(energy_flows(build))
    fluxes = []
    for k, body in enumerate(build.scene.bodies, start=1):
        flux, booked = _flux(build, k, body, flows)
        fluxes.append(flux)
        if booked is not None and booked != 0:
            account = Quantity(f"heat_into_{k}", "J/m^2", f"heat received by {body.name} from the interface")
            build.ledger.append(Account(account, booked, "heat"))
    known = [flux for flux in fluxes if flux is not None]
    if all(flux == 0 for flux in known):
        return
    for k, body, flux in zip((1, 2), build.scene.bodies, fluxes, strict=True):
        if flux is not None:
            text = f"heat flux from the interface into {body.name}"
            build.areal(Quantity(f"q_{k}", "W/m^2", text, tag="e:qc_k1"), flux)
    if len(known) == 2:
        q_1, q_2 = symengine.symbols("q_1 q_2")
        build.name(Quantity("q_m", "W/m^2", "mean heat flux into the bodies", tag="e:qm_def"), (q_1 + q_2) / 2)
        text = "transfer heat flux from body 2 to body 1"
        build.name(Quantity("q_t", "W/m^2", text, tag="e:qt_def"), (q_1 - q_2) / 2)


def _flux(build: Build, k: int, body: Body, flows: list[Flow]) -> tuple[Expression, Expression] | tuple[None, None]:
    """Return the heat flux from the interface into a body, and the flux that goes to its account.

    The laws state the flux; for a body whose node has other members it is recovered from the body's balance. If the
    temperature evolves, the account gets the flux recovered from the balance.

    If two bodies share a prescribed temperature, the split of the heat between them is undetermined: None.
    """
    node = build.thermal.node_of[body.name]
    members = build.thermal.members.items()
    sharing = [other for other, name in members if name == node.name and other != body.name]
    channels, elsewhere = _heat_into(build, body, flows)
    if len(channels) > 1 and not sharing:
        for name, heat in channels.items():
            text = f"heat flux from the interface into {body.name} by {name}"
            channels[name] = build.areal(Quantity(f"q_{k}_{name}", "W/m^2", text), heat)
    flux = symengine.Add(*channels.values())
    if sharing and node.prescribed:
        if sharing != [INTERFACE]:
            return None, None
        moved = balances.energy_rate(build.psi, node.T, node.T_dot, build.rates, {})
        into_interface = (flow.rate * ((flow.target == INTERFACE) - (flow.source == INTERFACE)) for flow in flows)
        flux = flux + symengine.Add(*into_interface) - moved
    elif body.name in node.energies:
        recovered = balances.energy_rate(node.energies[body.name], node.T, node.T_dot, {}, {}) - elsewhere
        flux = recovered if sharing else flux
        if not node.prescribed:
            return flux, recovered
    return flux, flux


def _heat_into(build: Build, body: Body, flows: list[Flow]) -> tuple[dict[str, Expression], Expression]:
    """Return the heat into a body from the interface and the other body, by channel, and the rest of its inflow."""
    near = {INTERFACE, *(other.name for other in build.scene.bodies)}
    channels: dict[str, Expression] = {}
    elsewhere = symengine.Integer(0)
    for flow in (flow for flow in flows if body.name in (flow.source, flow.target)):
        sign, other = (1, flow.source) if flow.target == body.name else (-1, flow.target)
        if other not in near:
            elsewhere += sign * flow.rate
            continue
        for channel, heat in flow.channels.items():
            channels[channel] = channels.get(channel, symengine.Integer(0)) + sign * heat
    return channels, elsewhere


def sinks(build: Build) -> dict[str, tuple[Sink, ...]]:
    """Return the sinks of the heat of jumps, of the interface and of the supports, along the paths of heat."""
    if not build.edges:
        return {}
    # Only jumps change these accounts.
    nothing = symengine.Integer(0)
    rows = [
        ("released", "J/m^2", "energy that jumps have turned into heat", "dissipation"),
        ("entropy_events", "J/(m^2 K)", "entropy produced by jumps", "entropy production"),
    ]
    if build.thermal.prescribed:
        rows += [
            ("H_events", "J/m^2", "heat of jumps supplied to prescribed temperatures", "energy supply"),
            ("H_events_entropy", "J/(m^2 K)", "entropy of that heat", "entropy supply"),
        ]
    for name, unit, text, kind in rows:
        build.ledger.append(Account(Quantity(name, unit, text), nothing, kind, "events"))
    centre = build.thermal.node_of.get(INTERFACE)
    if centre is None or not centre.takes_heat:
        # A local release draws its energy from the heat of the interface, so the interface has to store heat.
        for law in build.interface.limits:
            if law.release == "local":
                problem = "in a local release the interface pays, but here it has no heat of its own"
                remedy = "Give it a temperature and a capacity, or use `release: joint`, in which the bodies do."
                raise InputError(f"{problem}. {remedy}", law.place)
    supports = {axis: _merged(build, far.receivers(build)) for axis, far in build.motion.far_fields.items()}
    return {INTERFACE: _merged(build, receivers(build)), **supports}


def _merged(build: Build, shares: Mapping[str, Expression]) -> tuple[Sink, ...]:
    """Return one sink per node; shares of the same node add up."""
    total: dict[str, Expression] = {}
    for place, share in shares.items():
        name = build.thermal.places[place].name
        total[name] = total.get(name, 0) + share
    nodes = ((build.thermal.places[name], share) for name, share in total.items())
    return tuple(
        Sink(node.name, node.T, balances.internal_energy(node.free_energy, node.T), share, node.prescribed)
        for node, share in nodes
    )


def _is_one_constant(build: Build, names: Collection[str]) -> bool:
    """True if prescribed temperatures are equal and constant."""
    loads = [build.loads[name] for name in names]
    starts = {load.at_start() for load in loads}
    moves = any(build.slope_of(name) != 0 for name in names) or any(load.jumps() for load in loads)
    return len(starts) == 1 and not moves


def regime(build: Build) -> str:
    """Return the thermal regime in words."""
    thermal = build.thermal
    nodes = [thermal.members[body.name] for body in build.scene.bodies]
    centre = thermal.members.get(INTERFACE)
    if centre is None:
        if nodes[0] == nodes[1]:
            return "perfect contact without a medium"
        # The bodies are coupled by a medium if the case names one, or if a law is one of a film or a gap.
        channels = {channel for law in build.scene.heat for channel in law.channels()}
        between = build.interface.medium is not None or channels & {"film", "gas", "gap"}
        return "medium without temperature" if between else "no medium"
    names = {*nodes, centre}
    if all(thermal.nodes[name].prescribed for name in names):
        return "isothermal" if _is_one_constant(build, names) else "prescribed temperatures"
    if len(names) == 1:
        return "perfect contact"
    return "one-sided perfect contact" if centre in nodes else "separate interface temperature"
