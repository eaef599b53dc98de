r"""Heat paths between temperature nodes, and external heat: fluxes and their entropy production.

A path with the closure `mean` heats both bodies alike. Its driving force is the difference between the temperature of
the interface and the harmonic mean of the bodies, so that the production of both fluxes is a square,

.. math:: \sigma = h_m \left( T_c - \frac{2 T_1 T_2}{T_1 + T_2} \right)^2 \frac{T_1 + T_2}{T_1 T_2 T_c} \ge 0,

although one of the two fluxes alone may flow uphill: into the hotter body, if the interface is between both.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping

import symengine

from surfacechem.contracts.terms import HeatTransfer
from surfacechem.errors import InputError, Place, suggestion
from surfacechem.expressions import Expression, where
from surfacechem.model.balances import HEAT, INTERFACE, OUTSIDE, Node, PowerFlow
from surfacechem.model.build import BOTH_BODIES, Build, Record
from surfacechem.model.system import Margin
from surfacechem.quantities import Quantity
from surfacechem.tolerances import NO_AMOUNT


def laws(build: Build) -> Iterator[Record]:
    """Yield the fluxes between nodes and the external heat."""
    # Heat produced in a medium leaves it across the medium's own resistance.
    films = [law for law in build.scene.heat if law.closure == "medium" and law.resistances is not None]
    # Parallel paths between the same ends are added up, by channel.
    groups: dict[frozenset[str], tuple[tuple[str, str], dict[str, Expression]]] = {}
    for law in (law for law in build.scene.heat if law not in films):
        for ends, channels in _paths(build, law):
            _, together = groups.setdefault(frozenset(ends), (ends, {}))
            for channel, h in channels.items():
                together[channel] = together.get(channel, symengine.Integer(0)) + h
    for ends, channels in groups.values():
        build.conductances.setdefault(ends, []).extend(channels.values())
        yield from (_into_both(build, channels) if ends == BOTH_BODIES else _between(build, ends, channels))
    for law in films:
        yield from _through_film(build, law)
    yield from _external(build)
    if build.interface.temperature is None and build.interface.loss:
        reason = "the fractions of the interface's heat add up to more than 1"
        yield Margin("partition <= 1", build.shares()[build.scene.bodies[1].name] + NO_AMOUNT, reason)


def _external(build: Build) -> Iterator[PowerFlow]:
    """Yield the heat that a scene supplies to its bodies and its interface."""
    first, second = (body.name for body in build.scene.bodies)
    for member, Q in ((first, "Q_1"), (second, "Q_2"), (INTERFACE, "Q_c")):
        if build.variables.has(Q):
            heat, node = build.variables.get(Q, "the energy balance"), build.thermal.node_of.get(member)
            # Without a medium the heat of the interface goes to the bodies.
            T = build.variables.get("T_c", "the external heat") if node is None else node.T
            text = f"external heat into {member}"
            yield PowerFlow(HEAT, OUTSIDE, member, heat, f"H_{Q[2:]}", text, entropy=heat / T)


def receivers(build: Build) -> dict[str, Expression]:
    """Return the places that receive the heat that the interface makes in a jump, with their shares.

    The interface if it stores heat; without a medium the ends of its heat. If its temperature is algebraic, the ends of
    its heat paths in proportion to their conductances, since it rises until they carry off everything.
    """
    centre = build.thermal.node_of.get(INTERFACE)
    if centre is None:
        return build.shares()
    if centre.takes_heat:
        return {INTERFACE: symengine.Integer(1)}
    bodies = tuple(body.name for body in build.scene.bodies)
    by_end: dict[str, Expression] = {}
    for pair, channels in build.conductances.items():
        for end in bodies if pair == BOTH_BODIES else set(pair) - {INTERFACE} if INTERFACE in pair else ():
            by_end[end] = by_end.get(end, 0) + symengine.Add(*(_area(build, pair) * h for h in channels))
    whole = symengine.Add(*by_end.values())
    # While no path conducts the shares are equal, so that they still sum to one.
    conducts = where(whole > 0, whole, 1)
    return {end: where(whole > 0, h / conducts, symengine.Rational(1, len(by_end))) for end, h in by_end.items()}


def _area(build: Build, ends: Collection[str]) -> Expression:
    """Return the area of a path over the reference area, which heat to the surroundings leaves through."""
    return symengine.Integer(1) if "surroundings" in ends else build.stretch


def _two_nodes(build: Build, law: HeatTransfer) -> tuple[Node, Node]:
    """Return the nodes of both ends of a path; they must differ, and be bodies unless the closure is direct."""
    a, b = law.between
    if a == b:
        raise InputError(f"a heat path needs two different ends, not {a} twice.", _ends(law))
    first, second = end_node(build, a, law), end_node(build, b, law)
    if law.closure != "direct" and not {a, b} <= {body.name for body in build.scene.bodies}:
        raise InputError(f"`closure: {law.closure}` belongs to a path between the two bodies.", law.place)
    if first is second and law.closure == "mean":
        raise InputError("`closure: mean` is of two bodies with temperatures of their own.", law.place)
    if first is second:
        raise InputError(f"the heat path between {a} and {b} has one temperature, {first.name}; remove it.", law.place)
    return first, second


def _through_film(build: Build, law: HeatTransfer) -> Iterator[PowerFlow]:
    r"""Yield the heat that a film with the mean temperature T_c gives to its walls.

    Across the film the temperature is a parabola on top of a line. With the resistances r of the film and :math:`r_k`
    of its walls, beyond which the temperatures are :math:`T_k`,

    .. math:: q_1 = \frac{6 (r + 2 r_2) (T_c - T_1) - 2 r (T_2 - T_1)}{r^2 + 4 r (r_1 + r_2) + 12 r_1 r_2}

    and :math:`q_2` likewise. Without a film, r = 0, each wall would have a separate path. Without resistance of the
    walls the first coefficient is 6/r; the second term subtracts the excess over 1/r of the two paths in series.
    """
    ends, centre = _two_nodes(build, law), end_node(build, "interface", law)
    bound = build.variables.bind(law, f"heat.{law.name()}")
    r_1, r, r_2 = build.variables.call(bound, bound.resistances)
    build.law_domain(law, bound, {})
    scale = r**2 + 4 * r * (r_1 + r_2) + 12 * r_1 * r_2
    beside = -2 * r / scale * (ends[1].T - ends[0].T)
    flows, produced = [], symengine.Integer(0)
    for end, node, wall, sign in zip(law.between, ends, (r_2, r_1), (1, -1), strict=True):
        h = 6 * (r + 2 * wall) / scale
        build.conductances.setdefault((INTERFACE, end), []).append(h)
        text = f"heat flux from the film into {end}"
        flux = Quantity(_path_name(build, "interface", end), "W/m^2", text, tag="e:qc_k1")
        q = build.name(flux, build.stretch * (h * (centre.T - node.T) + sign * beside))
        flows.append(PowerFlow(HEAT, INTERFACE, end, q, channels={law.channel: q}))
        produced += q * (centre.T - node.T) / (centre.T * node.T)
    # One account for both: a wall that takes heat from a film colder than itself takes it from the other wall, through
    # the film.
    yield flows[0]._replace(label=build.unique("film"), text="heat flow through the film", entropy=produced)
    yield from flows[1:]


def _paths(build: Build, law: HeatTransfer) -> Iterator[tuple[tuple[str, str], dict[str, Expression]]]:
    """Yield ends and conductances of a law, by channel; a path through the medium is two of twice the conductance."""
    (a, b), nodes = law.between, _two_nodes(build, law)
    bound = build.variables.bind(law, f"heat.{law.name()}")
    own = {"T_from": nodes[0].T, "T_to": nodes[1].T}
    channels = {name: build.variables.call(bound, formula, own) for name, formula in bound.channels().items()}
    build.law_domain(law, bound, own)
    if law.closure == "medium":
        centre = end_node(build, "interface", law)
        for ends, node in zip(((a, "interface"), ("interface", b)), nodes, strict=True):
            if node is not centre:
                yield ends, {name: 2 * h for name, h in channels.items()}
    else:
        yield (a, b) if law.closure == "direct" else BOTH_BODIES, channels


def _between(build: Build, ends: tuple[str, str], channels: Mapping[str, Expression]) -> Iterator[PowerFlow]:
    """Yield the power between two ends, with the flux of each channel if there are several."""
    (a, b), area = ends, _area(build, ends)
    from_node, to_node = end_node(build, a), end_node(build, b)
    difference = from_node.T - to_node.T
    flux = Quantity(_path_name(build, a, b), "W/m^2", f"heat flux from {a} to {b}", tag="e:qc_k1")
    total, parts = _named_flux(build, flux, {channel: area * h * difference for channel, h in channels.items()})
    produced = area * symengine.Add(*channels.values()) * difference**2 / (from_node.T * to_node.T)
    yield PowerFlow(HEAT, a, b, total, flux.name, f"heat flow from {a} to {b}", parts, produced)


def _named_flux(
    build: Build, flux: Quantity, parts: Mapping[str, Expression]
) -> tuple[Expression, dict[str, Expression]]:
    """Name a flux and, if there are several, its channels."""
    if len(parts) == 1:
        total = build.name(flux, *parts.values())
        return total, dict.fromkeys(parts, total)
    named = {}
    for channel, part in parts.items():
        quantity = Quantity(f"{flux.name}_{channel}", "W/m^2", f"{flux.long_name} by {channel}")
        named[channel] = build.name(quantity, part)
    return build.name(flux, symengine.Add(*named.values())), named


def _path_name(build: Build, a: str, b: str) -> str:
    """Return the name of the flux between two ends: q_12, q_c1, q_1a."""
    short = {body.name: str(k) for k, body in enumerate(build.scene.bodies, start=1)}
    short |= {"interface": "c", "surroundings": "a"}
    return build.unique(f"q_{short[a]}{short[b]}")


def _ends(law: HeatTransfer | None) -> Place:
    """Return the place in a case that names the ends of a heat path."""
    return Place(path=f"{law.path}.between" if law else "heat")


def end_node(build: Build, end: str, law: HeatTransfer | None = None) -> Node:
    """Return the temperature node of an end of a heat path; InputError if it has none."""
    if end in build.thermal.node_of:
        return build.thermal.node_of[end]
    if end == "interface":
        raise InputError("the interface has no temperature. Add `interface.temperature`.", _ends(law))
    if end == "surroundings":
        message = "the surroundings have no temperature. Add `surroundings: {temperature: ...}`."
        raise InputError(message, _ends(law))
    known = {*build.thermal.node_of, "interface", "surroundings"}
    raise InputError(f"no end '{end}'.{suggestion(end, known)}", _ends(law))


def _into_both(build: Build, channels: Mapping[str, Expression]) -> Iterator[PowerFlow | str]:
    """Yield the mean influx q_m = h_m [T_c - 2 T_1 T_2 / (T_1 + T_2)] into both bodies."""
    bodies = [body.name for body in build.scene.bodies]
    (lower, upper), centre = (end_node(build, name) for name in bodies), end_node(build, "interface")
    difference = centre.T - 2 * lower.T * upper.T / (lower.T + upper.T)
    flux = Quantity("q_c12", "W/m^2", "heat flux from interface to each body", tag="r:47")
    total, parts = _named_flux(build, flux, {name: build.stretch * h * difference for name, h in channels.items()})
    sum_h = symengine.Add(*channels.values())
    (cold, _), (hot, name) = sorted((build.at_start(build.thermal.node_of[body].T), body) for body in bodies)
    if hot > cold:
        harmonic = 2 * cold * hot / (cold + hot)
        between = f"an interface that is cooler than itself, between {harmonic:.6g} K and {hot:.6g} K"
        heats = f"`closure: mean` heats both bodies alike: as they start, {name} also from {between}"
        remedy = "Where no heat should flow uphill, give paths from each body to the interface."
        yield f"{heats}. Their entropy production together is positive. {remedy}"
    produced = build.stretch * sum_h * difference**2 * (lower.T + upper.T) / (lower.T * upper.T * centre.T)
    text = "heat flow from interface to each body"
    yield PowerFlow(HEAT, INTERFACE, bodies[0], total, flux.name, text, parts, produced)
    yield PowerFlow(HEAT, INTERFACE, bodies[1], total, channels=parts)
