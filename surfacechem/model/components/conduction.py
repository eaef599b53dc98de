"""Heat conduction across the bodies: cells in a row from the contact to the far side (finite volumes).

The points are the corners of the cells, so that the first one is the temperature at the contact, with half a cell's
capacity: the body's node, which heat paths, laws and perfect contact use. The rest of the body is a chain of balances.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise

import symengine

from surfacechem.contracts.terms import Varying, reads
from surfacechem.errors import InputError
from surfacechem.expressions import Expression
from surfacechem.model import balances
from surfacechem.model.balances import HEAT, SURROUNDINGS, Node, PowerFlow
from surfacechem.model.build import BOTH_BODIES, Build, Slab, Thermal
from surfacechem.model.system import Conductor, Profile, State
from surfacechem.quantities import Quantity
from surfacechem.scene import Body, Conduction, volume_shares


def variables(build: Build) -> Iterator[PowerFlow | Thermal]:
    """Divide the bodies that conduct into cells, and yield their heat fluxes."""
    thermal = build.thermal
    for number, body in enumerate(build.scene.bodies, start=1):
        law = body.conduction
        if law is None:
            continue
        _check(build, body, law)
        # In the body the factors follow the local temperature; the far side has its own section of a case.
        reference = replace(law.at_reference(), h_far=None)
        bound = build.variables.bind(reference, f"bodies.{body.name}.conduction", f"_{number}")
        resistances = {**thermal.resistances, body.name: bound.thickness / bound.conductivity}
        thermal = replace(thermal, resistances=resistances)
        if law.cells:
            slab, thermal = _divided(build, thermal, number, body, law)
            yield from _fluxes(build, slab, thermal.node_of[body.name], bound)
    yield thermal


def _check(build: Build, body: Body, law: Conduction) -> None:
    """Raise InputError if a body that conducts has no heat capacity, or one with a far side has no cells."""
    if body.energy is None:
        raise InputError(f"{body.name} conducts heat but stores none: give it a heat capacity C.", law.place)
    for path in build.scene.heat:
        if set(path.between) == {body.name, SURROUNDINGS} and law.cells:
            text = f"a path from {body.name} to the surroundings would end at its contact. Say `far` in `conduction`."
            raise InputError(text, path.place)
    if law.far is not None and not law.cells:
        raise InputError(f"{body.name} is one lump, so it has no far side. Give it cells, or a heat path.", law.place)


def _divided(build: Build, thermal: Thermal, number: int, body: Body, law: Conduction) -> tuple[Slab, Thermal]:
    """Share the body's energy among the nodes of its cells."""
    surface, shares = thermal.node_of[body.name], volume_shares(law.points)
    whole = surface.energies[body.name]
    nodes = dict(thermal.nodes)
    behind = []
    for i, share in enumerate(shares[1:], start=1):
        name = f"T_{number}_x{i}"
        if i == len(shares) - 1 and law.held:
            node = _far_node(build, number, body, law)
        elif name in nodes:
            raise InputError(f"{name} is a temperature inside {body.name}; give the other one another name.", law.place)
        else:
            node = Node(name, symengine.Symbol(name), symengine.Symbol(f"d{name}_dt"))
        behind.append(node._replace(energies={body.name: share * whole.subs({surface.T: node.T})}))
    nodes[surface.name] = surface._replace(energies={**surface.energies, body.name: shares[0] * whole})
    slab = Slab(number, body, law, law.points, tuple(behind))
    if law.far is not None:
        far = behind[-1] if law.held else _far_node(build, number, body, law)
        nodes[far.name] = far
    return slab, replace(thermal, nodes=nodes, slabs={**thermal.slabs, body.name: slab})


def _far_node(build: Build, number: int, body: Body, law: Conduction) -> Node:
    """Return the node of the temperature prescribed at the far side, or beyond a film there."""
    name = f"T_far_{number}"
    where = "at" if law.held else "beyond"
    assert law.far is not None
    build.prescribe(Quantity(name, "K", f"temperature {where} the far side of {body.name}"), law.far)
    return Node(name, symengine.Symbol(name), build.slope_of(name), prescribed=True)


def _fluxes(build: Build, slab: Slab, surface: Node, bound: Conduction) -> Iterator[PowerFlow]:
    """Yield the fluxes from node to node and through the far side."""
    name = slab.body.name
    conductivity = _conductivity(build, slab, surface, bound.conductivity)
    links = list(pairwise((surface, *slab.behind)))
    widths = [b - a for a, b in pairwise(slab.points)]
    conductances = [
        conductivity((a.T + b.T) / 2) / (bound.thickness * width) for (a, b), width in zip(links, widths, strict=True)
    ]
    if slab.law.h_far is not None:
        far = f"T_far_{slab.number}"
        links.append((slab.behind[-1], Node(far, symengine.Symbol(far), build.slope_of(far), prescribed=True)))
        h_far, spec = f"h_far_{slab.number}", dict(slab.law.specs())["h_far"]
        conductances.append(build.constant(h_far, f"{bound.path}.far.h", spec, slab.law.h_far))
    fluxes = [h * (a.T - b.T) for (a, b), h in zip(links, conductances, strict=True)]
    produced = (flux * (a.T - b.T) / (a.T * b.T) for (a, b), flux in zip(links, fluxes, strict=True))
    places = [name, *(b.name for _, b in links)]
    flows = [PowerFlow(HEAT, a, b, flux) for (a, b), flux in zip(pairwise(places), fluxes, strict=True)]
    label, text = f"conduction_{slab.number}", f"heat conduction in {name}"
    yield flows[0]._replace(label=label, text=text, entropy=symengine.Add(*produced))
    yield from flows[1:]


def _conductivity(build: Build, slab: Slab, surface: Node, reference: Expression) -> Callable[[Expression], Expression]:
    """Return the conductivity as a function of the local temperature."""
    given = slab.law.conductivity
    if not isinstance(given, Varying):
        return lambda T: reference
    own = {f"T_{slab.number}", surface.name}
    bound = []
    for factor in given.factors:
        others = {argument for argument in reads(factor.factor) if argument not in ("x", "T_0", factor.of)}
        if factor.of not in own or others:
            message = f"the conductivity of {slab.body.name} varies with its own temperature only: of: {min(own)}."
            raise InputError(message, factor.place)
        path = f"bodies.{slab.body.name}.conduction.{factor.name()}"
        bound.append((factor, build.variables.bind(factor, path, unit="K")))

    def conductivity(T: Expression) -> Expression:
        read = ({name: T for name in reads(factor.factor) if name != "T_0"} for _, factor in bound)
        values = (build.variables.factor(factor, own) for (_, factor), own in zip(bound, read, strict=True))
        return math.prod(values, start=reference)

    spec = dict(slab.law.specs())["conductivity"]
    # Without sources inside, the extremes are those of the start or of the ends.
    for T in (surface.T, slab.behind[0].T, slab.behind[-1].T):
        build.variables.factors += [(*pair, T) for pair in bound]
        build.variables.varying.append((slab.law, "conductivity", spec, conductivity(T)))
    return conductivity


def outputs(build: Build) -> Iterator[State | Profile | Conductor]:
    """Set the balances of the nodes inside the bodies; yield their states, after all other states."""
    for number, body in enumerate(build.scene.bodies, start=1):
        if body.conduction is not None:  # the data from which one judges whether a body may be one lump
            node, ends = build.thermal.node_of[body.name], build.conductances
            F = node.energies[body.name] / build.thermal.volume(body.name)[body.name]
            paths = [h for pair, several in ends.items() if body.name in pair or pair == BOTH_BODIES for h in several]
            alone = sum(other is node for other in build.thermal.node_of.values()) == 1
            resistance, capacity = build.thermal.resistances[body.name], -node.T * balances.second(F, node.T)
            whole = symengine.Add(*paths) if alone else None
            yield Conductor(number, body.name, not body.conduction.cells, resistance, capacity, whole)
    for slab in build.thermal.slabs.values():
        yield from _profile(build, slab)


def _profile(build: Build, slab: Slab) -> Iterator[State | Profile]:
    surface, initial = build.thermal.node_of[slab.body.name], build.scene.initial.get(slab.profile)
    start = slab.profile if initial is not None else surface.name
    if initial is None and surface.prescribed:
        text = f"nothing gives the temperature inside {slab.body.name}. Add `{slab.profile}:` under `initial`."
        raise InputError(text, slab.law.place)
    value = initial if initial is not None else build.initial(surface.name)
    if not value > 0:
        message = f"initial {start} = {value:g} K is not an absolute temperature above zero."
        raise InputError(message, path=f"initial.{start}")
    for i, node in enumerate(slab.inner, start=1):
        build.rows.balance(node.name, build.energy_row(node))
        quantity = Quantity(node.name, "K", f"temperature of {slab.body.name}, point {i} from the contact")
        yield State(quantity, value, value, start=start, is_temperature=True)
    last = slab.behind[-1]
    yield Profile(
        number=slab.number,
        body=slab.body.name,
        points=slab.points,
        thickness=f"{slab.law.path if slab.law.place else f'bodies.{slab.body.name}.conduction'}.thickness",
        surface=surface.name,
        anchored=not surface.prescribed,
        states=tuple(node.name for node in slab.inner),
        far=last.name if last.prescribed else "",
        after=slab.law.after,
    )
