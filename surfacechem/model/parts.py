"""Records that the phases of the assembly pass on: temperatures, bonding variables and the interface's free energy."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import symengine

from surfacechem.contracts import grids
from surfacechem.expressions import Expression
from surfacechem.model.balances import Node
from surfacechem.scene import Body, Conduction


@dataclass(frozen=True)
class Bond:
    """A bonding variable that is a state: its symbol, its rate, its initial value, and the amount where it is one."""

    symbol: Any
    dot: Any
    density: Expression
    initial: Expression


@dataclass(frozen=True)
class Slab:
    """A body with its temperatures in a row, from the contact on; a far side that is held is the last one."""

    number: int
    body: Body
    law: Conduction
    points: tuple[float, ...]
    behind: tuple[Node, ...]
    """The nodes behind that of the contact."""

    @property
    def inner(self) -> tuple[Node, ...]:
        """The nodes of its own that evolve."""
        return tuple(node for node in self.behind if not node.prescribed)

    @property
    def profile(self) -> str:
        """Name of its temperatures together."""
        return f"profile_{self.number}"


@dataclass(frozen=True)
class Thermal:
    """Temperature nodes by name, the members that they belong to, and the bodies that are divided into cells."""

    nodes: Mapping[str, Node]
    members: Mapping[str, str]
    """Name of the node of each body, of the interface and of the surroundings."""
    slabs: Mapping[str, Slab] = field(default_factory=dict)
    resistances: Mapping[str, Expression] = field(default_factory=dict)
    """L / k of the bodies that say how they conduct [m^2 K/W]."""

    @cached_property
    def node_of(self) -> dict[str, Node]:
        """Node of each member."""
        return {member: self.nodes[name] for member, name in self.members.items()}

    @cached_property
    def free(self) -> list[Node]:
        """The nodes at the contact whose temperature is not prescribed."""
        return [node for node in self.nodes.values() if not node.prescribed]

    @cached_property
    def prescribed(self) -> list[Node]:
        """The nodes at the contact whose temperature is prescribed."""
        return [node for node in self.nodes.values() if node.prescribed]

    @cached_property
    def places(self) -> dict[str, Node]:
        """Nodes by the places that powers go to; a body is its contact."""
        return (
            {node.name: node for slab in self.slabs.values() for node in slab.behind} | dict(self.nodes) | self.node_of
        )

    def owners(self, node: Node) -> str:
        """The members that have a node, in words."""
        return " and ".join(member for member, name in self.members.items() if name == node.name)

    def volume(self, body: str) -> dict[str, Expression]:
        """Places in a body with their parts of its volume; the one at the contact is the first."""
        if body not in self.slabs:
            return {body: symengine.Integer(1)}
        slab = self.slabs[body]
        return dict(zip((body, *(node.name for node in slab.behind)), grids.volume_shares(slab.points), strict=True))

    def with_energy(self, member: str, F: Expression) -> Thermal:
        """A copy with the free energy of a member [J/m^2]."""
        node = self.node_of[member]
        changed = replace(node, energies={**node.energies, member: F})
        return replace(self, nodes={**self.nodes, node.name: changed})


@dataclass(frozen=True)
class HeatPath:
    """A conductance [W/(m^2 K)] between two ends, in parallel with others of the same ends."""

    ends: tuple[str, str]
    h: Expression


@dataclass(frozen=True)
class Energy:
    """Free energy of the interface [J/m^2], and how much of it friction acts beside."""

    psi: Expression
    unbonded: Expression
    """Fraction of the interface on which friction acts, beside adhesion in parallel."""
    unbonded_energy: Expression
    """Energy, per area of that fraction, of the elastic gap that friction slides on [J/m^2]."""


NO_ENERGY = Energy(symengine.Integer(0), symengine.Integer(1), symengine.Integer(0))
NO_NODES = Thermal({}, {})
