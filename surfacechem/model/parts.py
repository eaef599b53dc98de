"""Records that the phases of the assembly exchange: temperature nodes, bonding variables, heat paths, free energy."""

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
    """A bonding variable that is a state: its symbol, rate, site density (its amount at one) and initial value."""

    symbol: Any
    dot: Any
    density: Expression
    initial: Expression


@dataclass(frozen=True)
class Slab:
    """A body divided into cells: temperatures from the contact on, with a prescribed far side as the last one."""

    number: int
    body: Body
    law: Conduction
    points: tuple[float, ...]
    behind: tuple[Node, ...]
    """The nodes behind the one at the contact."""

    @property
    def inner(self) -> tuple[Node, ...]:
        """The nodes behind the contact that evolve."""
        return tuple(node for node in self.behind if not node.prescribed)

    @property
    def profile(self) -> str:
        """Name of its temperature profile."""
        return f"profile_{self.number}"


@dataclass(frozen=True)
class Thermal:
    """Temperature nodes by name, the members that share them, and the bodies that are divided into cells."""

    nodes: Mapping[str, Node]
    members: Mapping[str, str]
    """Name of the node of each body, of the interface and of the surroundings."""
    slabs: Mapping[str, Slab] = field(default_factory=dict)
    resistances: Mapping[str, Expression] = field(default_factory=dict)
    """L / k of the bodies with a stated conductivity [m^2 K/W]."""

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
        """Nodes by the places that exchange power; the place of a body is its contact."""
        return (
            {node.name: node for slab in self.slabs.values() for node in slab.behind} | dict(self.nodes) | self.node_of
        )

    def owners(self, node: Node) -> str:
        """Return the members that share a node, in words."""
        return " and ".join(member for member, name in self.members.items() if name == node.name)

    def volume(self, body: str) -> dict[str, Expression]:
        """Return the places in a body with their fractions of its volume; the place at the contact comes first."""
        if body not in self.slabs:
            return {body: symengine.Integer(1)}
        slab = self.slabs[body]
        return dict(zip((body, *(node.name for node in slab.behind)), grids.volume_shares(slab.points), strict=True))

    def with_energy(self, member: str, F: Expression) -> Thermal:
        """Return a copy with the free energy of a member [J/m^2]."""
        node = self.node_of[member]
        changed = replace(node, energies={**node.energies, member: F})
        return replace(self, nodes={**self.nodes, node.name: changed})


@dataclass(frozen=True)
class HeatPath:
    """A conductance [W/(m^2 K)] between two ends, in parallel with others between the same ends."""

    ends: tuple[str, str]
    h: Expression


@dataclass(frozen=True)
class Energy:
    """Free energy of the interface [J/m^2], and the part of the interface on which friction acts."""

    psi: Expression
    unbonded: Expression
    """Fraction of the interface on which friction acts, in parallel with adhesion."""
    unbonded_energy: Expression
    """Elastic energy of the gap in series with friction, per area of that fraction [J/m^2]."""


NO_ENERGY = Energy(symengine.Integer(0), symengine.Integer(1), symengine.Integer(0))
NO_NODES = Thermal({}, {})
