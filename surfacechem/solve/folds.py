"""Folds: where gaps without mass or damper lose their equilibrium, found from close by."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from surfacechem.compile.program import Function, Program
from surfacechem.expressions import derivative
from surfacechem.model.automaton import FOLD
from surfacechem.solve.branches import zero_ahead
from surfacechem.solve.equilibria import DRIFT, Array, Equilibria, Lost, Point, Way, compiled
from surfacechem.tolerances import SOON


class Folds:
    """The edges of a system that are folds, by index."""

    def __init__(self, equilibria: Equilibria, program: Program) -> None:
        self.equilibria, self.program, self.system = equilibria, program, equilibria.system
        self.items = {index: edge.fold for index, edge in enumerate(self.system.edges) if edge.fold is not None}

    @cached_property
    def _tangents(self) -> dict[int, Function]:
        """Tangent stiffness; by itself, as a search asks for it at many rows."""
        return {index: compiled(self.system, [fold.tangent]) for index, fold in self.items.items()}

    @cached_property
    def _shapes(self) -> dict[int, Function]:
        """How the tangent falls along each gap, how each gap warms the states, and the stiffness, row after row."""
        found = {}
        for index, fold in self.items.items():
            warming = [rise.get(name, 0) for rise in fold.warming for name in self.equilibria.states]
            entries = [entry for row in fold.stiffness for entry in row]
            found[index] = compiled(self.system, [*fold.falls, *warming, *entries])
        return found

    @cached_property
    def _approaches(self) -> dict[int, Function]:
        """Tangent, how fast it changes, and how each balance does by itself."""
        states, t, found = self.system.states, self.system.t, {}
        alone = [derivative(self.system.expand(row), t) for row in self.system.rows.values()] if self.items else []
        for index, fold in self.items.items():
            tangent = self.system.expand(fold.tangent)
            change = sum((derivative(tangent, s.symbol) * s.dot for s in states), derivative(tangent, t))
            found[index] = compiled(self.system, [tangent, change, *alone])
        return found

    def _shape(self, index: int, point: Point) -> tuple[Array, Array, Way]:
        """How the tangent of a fold falls along each gap, how each warms the states, and the way that is lost."""
        n = len(self.equilibria.items)
        values = np.atleast_1d(self._shapes[index](point.inputs()))
        falls, warming, entries = np.split(values, [n, n + n * len(self.system.states)])
        # The way that costs no traction: the gaps by which the stiffness is singular.
        free, weights = self.equilibria.free(point), np.zeros(n)
        weights[free] = np.linalg.svd(entries.reshape(n, n)[np.ix_(free, free)])[2][-1] if len(free) > 1 else 1.0
        weights /= weights[np.abs(weights).argmax()]
        return falls, warming.reshape(n, -1), self.equilibria.together(point, weights)

    def at(self, index: int, point: Point) -> Lost | None:
        """The fold itself, from a point close to it; None where it is out of reach, or the edge is none.

        Equilibrium is lost like a square root in time, so that a run ends a little before the fold. Where the stiffness
        rises as the interface slides on, only time leads to the fold, and nothing pushes the interface there.
        """
        if index not in self.items or not len(self.equilibria.free(point)):
            return None
        falls, warming, way = self._shape(index, point)
        direction, onward = float(np.sign(falls @ way.pulls)), self.equilibria.onward_along(point, way)
        if onward and direction != onward:
            return None
        there = replace(way, moves=way.moves + warming.T @ way.pulls)

        def ahead(gaps: Sequence[float] | Array) -> Array:
            return np.asarray(self._tangents[index](self.equilibria.along(point, there, gaps))).reshape(-1)

        at = zero_ahead(ahead, float(point.y[way.column]), direction, 1.0)
        if at is None:
            return None
        return Lost(self.equilibria.moved(point, self.equilibria.along(point, there, [at])), way, direction)

    def held_at(self, index: int, lost: Lost) -> Lost | None:
        """The same fold where sticking holds what slides; None where that keeps the equilibrium."""
        point = self.equilibria.with_slip(lost.point, 0.0)
        if self._tangents[index](point.inputs())[0] > FOLD:
            return None
        falls, _, way = self._shape(index, point)
        return Lost(point, way, float(np.sign(falls @ way.pulls)))

    def reached(self, point: Point, rtol: float) -> int:
        """The fold that is so close to a point that time cannot tell them apart; -1 where none is."""
        for index in self.items:
            found = self.at(index, point)
            if found is None:
                continue
            (_, sizes), (left, _) = self.equilibria.balance(point), self.equilibria.balance(found.point)
            if np.all(np.abs(left) <= DRIFT * rtol * np.abs(sizes)):
                return index
        return -1

    def in_time(self, index: int, point: Point, end: float) -> Point:
        """A point close to a fold at the time of the fold, where that is before the end; else as it is.

        Near a fold the square of the tangent stiffness falls in proportion to time.
        """
        if index not in self.items:
            return point
        approach = self._approaches[index]
        alone = approach(point.inputs())[2:]
        tangent, change, *_ = approach(replace(point, ydot=self._rates(point, alone)).inputs())
        left = float(-tangent / (2 * change)) if tangent > 0 > change else 0.0
        return replace(point, t=point.t + left) if left < min(SOON * point.t, end - point.t) else point

    def _rates(self, point: Point, alone: Array) -> Array:
        """Rates of all states, those of algebraic ones from how their balances change."""
        program = self.program
        inputs = program.filled(replace(point, ydot=np.zeros_like(point.y)).inputs())
        by_state, by_rate = program.derivatives(inputs)
        balances = np.asarray(by_rate.any(axis=1))
        matrix = np.where(balances[:, None], by_rate, by_state)
        # What is algebraic in a balance that has rates follows these without delay, and no gap follows it.
        matrix[balances & program.algebraic_mask] = np.eye(len(matrix))[balances & program.algebraic_mask]
        change = np.where(balances, program.residual(inputs), alone)
        change[balances & program.algebraic_mask] = 0.0
        try:
            return np.asarray(np.linalg.solve(matrix, -change))
        except np.linalg.LinAlgError:
            return np.zeros_like(point.y)
