"""Who takes the heat that a jump makes, and how warm that makes them."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from surfacechem.compile.program import Function
from surfacechem.expressions import derivative
from surfacechem.model.automaton import INTERFACE, Sink
from surfacechem.model.system import System
from surfacechem.solve.equilibria import compiled
from surfacechem.tolerances import ULPS

Array = NDArray[np.float64]

NEWTON = 60


class JumpHeat:
    """The nodes that take heat of jumps."""

    def __init__(self, system: System) -> None:
        self.system = system
        self.states = [state.name for state in system.states]
        self.interface = list(system.sinks).index(INTERFACE)

    @cached_property
    def nodes(self) -> dict[str, Sink]:
        """Everything that takes heat of jumps, by the name of the node."""
        return {sink.node: sink for sinks in self.system.sinks.values() for sink in sinks}

    @cached_property
    def free(self) -> list[int]:
        """Columns of the temperatures that heat raises, among the inputs."""
        return [1 + self.states.index(sink.node) for sink in self.nodes.values() if not sink.prescribed]

    @cached_property
    def _columns(self) -> Function:
        """Temperature, energy and capacity of each node, and its part of the heat that each maker makes."""
        shares = [{s.node: s.share for s in sinks} for sinks in self.system.sinks.values()]
        columns = [
            item
            for name, s in self.nodes.items()
            for item in (s.T, s.energy, derivative(s.energy, s.T), *(share.get(name, 0) for share in shares))
        ]
        return compiled(self.system, columns)

    def at(self, rows: Array) -> tuple[Array, Array, Array, Array]:
        """Temperature, energy, capacity and shares of what each maker makes, of each node, shape (rows, nodes)."""
        values = self._columns(rows).reshape(len(rows), len(self.nodes), -1)
        return values[:, :, 0], values[:, :, 1], values[:, :, 2], values[:, :, 3:]

    def taken(self, rows: Array, made: Array, shares: Array | None) -> tuple[Array, Array, Array, Array]:
        """Temperature, energy and capacity of each node, and the heat that it takes, each of shape (rows, nodes).

        ``made`` has a column for each maker, and friction last: its heat goes by the ``shares`` along its way, where
        these are known, else as the interface shares it at the end.
        """
        T, U, C, parts = self.at(rows)
        rubbed = parts[:, :, self.interface] if shares is None else shares
        return T, U, C, np.einsum("ijk,ik->ij", parts, made[:, :-1]) + rubbed * made[:, -1:]

    def warmed(self, rows: Array, made: Array, shares: Array | None) -> Array:
        """Inputs with the temperatures of the nodes after they have taken the heat that is made."""
        return self.with_heat(rows, self.taken(rows, made, shares)[3])

    def with_heat(self, rows: Array, taken: Array) -> Array:
        """Inputs with the temperatures of the nodes after each has taken its heat, shape (rows, nodes)."""
        free = list(zip([j for j, s in enumerate(self.nodes.values()) if not s.prescribed], self.free, strict=True))
        _, U, C, _ = self.at(rows)
        target, rows = U + taken, rows.copy()
        for _ in range(NEWTON if free else 0):
            done = True
            for j, column in free:
                T = rows[:, column]
                with np.errstate(over="ignore", invalid="ignore"):  # far away a search may see no number
                    change = (target[:, j] - U[:, j]) / C[:, j]
                moved = T + change
                done = done and not np.any(np.abs(change) > ULPS * np.abs(T))
                # A body without a minimum of energy above T = 0 lets Newton's method run out below it.
                rows[:, column] = np.where(moved > 0, moved, np.nan)
            if done:
                break
            _, U, C, _ = self.at(rows)
        return rows
