"""Gaps without mass or damper: the equilibrium they find together, and the folds at which they lose it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from surfacechem.compile.program import Function, Program, compile_function
from surfacechem.expressions import Expression, derivative
from surfacechem.model.automaton import FOLD, SIDE, SLIP
from surfacechem.model.system import System
from surfacechem.solve.branches import (
    KICK,
    Curve,
    Field,
    Indices,
    come_to_rest,
    equilibrium,
    march,
    push_ahead,
    stiffness,
    unstable_way,
    zero_ahead,
)
from surfacechem.tolerances import NEGLIGIBLE, ROUNDING, SOLVED

Array = NDArray[np.float64]
Heat = Callable[[Array], Array]
"""Inputs with the temperatures that a jump to them gives."""

DRIFT = 100.0
"""Traction out of balance that the integration explains, relative to its parts and in units of the tolerance."""

NANOMETRE = 1e-9
"""Gap [m] below which the size of a gap counts as this one: surfaces are no smoother."""

SOON = 1e-9
"""Part of the time of a fold within which nothing but the gaps changes."""

ATOM = 1e-20
"""Gap [m] that counts as none: the rounding of a micrometre, far below any atom."""

BALANCED = ROUNDING
"""Tractions out of balance that count as none, relative to their parts: those of a run hold its rounding."""

POLISH = 3
"""Newton steps that take the drift of an integration out of the gaps: each doubles the digits."""


@dataclass(frozen=True)
class Point:
    """A state with the parameters that hold there."""

    t: float
    y: Array
    ydot: Array
    parameters: Array

    def inputs(self) -> Array:
        """Arguments of compiled functions."""
        return np.concatenate(([self.t], self.y, self.ydot, self.parameters))


def compiled(system: System, expressions: Iterable[Expression]) -> Function:
    """Machine code of expressions of a system, of its inputs."""
    return compile_function(system.inputs, [system.expand(item) for item in expressions])


@dataclass(frozen=True)
class Way:
    """A direction in the space of the gaps: what moves, the gap that counts the way, and the tractions along it."""

    moves: Array
    """Change of each state, shape (states,)."""
    column: int
    """The state that changes by one."""
    pulls: Array
    """Weights of the driving tractions, shape (equilibria,)."""


@dataclass(frozen=True)
class Lost:
    """A fold: the point there, the way in which the gaps are lost, and the direction along it."""

    point: Point
    way: Way
    direction: float


class Equilibria:
    """The quasi-static gaps of a system; each function is compiled when first needed."""

    def __init__(self, system: System, program: Program) -> None:
        self.system, self.program = system, program
        self.states = [state.name for state in system.states]
        self.items = system.equilibria
        paths = [parameter.path for parameter in system.parameters]
        self.slip = paths.index(SLIP) if SLIP in paths and any(e.slides for e in self.items) else None
        """Column of the mode of sliding among the parameters, where gaps in equilibrium stick or slide."""
        sided = SIDE in paths and "g_n" in self.states
        self._side = 1 + 2 * len(self.states) + paths.index(SIDE) if sided else None
        self.followers = [1 + self.states.index(name) for name in system.follows]
        """Columns of the states that follow the normal gap where it jumps, among the inputs."""

    @cached_property
    def _balance(self) -> Function:
        """Driving traction and size of its parts, for each gap."""
        return compiled(self.system, (item for e in self.items for item in (e.residual, e.size)))

    @cached_property
    def _company(self) -> Function:
        """How far other gaps move with each."""
        return compiled(self.system, (e.along.get(name, 0) for e in self.items for name in self.states))

    @cached_property
    def _tangents(self) -> Function:
        """Driving traction and its slope along the gap and what moves with it, for each gap."""
        symbols, found = {state.name: state.symbol for state in self.system.states}, []
        for e in self.items:
            residual = self.system.expand(e.residual)
            with_it = (self.system.expand(w) * derivative(residual, symbols[x]) for x, w in e.along.items())
            found += [residual, derivative(residual, symbols[e.state]) + sum(with_it)]
        return compiled(self.system, found)

    @cached_property
    def _active(self) -> Function:
        """Zero for gaps that are held."""
        return compiled(self.system, (e.active for e in self.items))

    @cached_property
    def _follow(self) -> Function:
        """States that follow the normal gap where it jumps."""
        return compiled(self.system, self.system.follows.values())

    @cached_property
    def _next_pushes(self) -> Function:
        """Rate at which the loads alone change the driving traction of each gap."""
        return compiled(self.system, (derivative(self.system.expand(e.residual), self.system.t) for e in self.items))

    # -- gaps along a way -----------------------------------------------------------------------------------------

    def ways(self, point: Point) -> list[Way]:
        """The way of each gap by itself."""
        company = self._company(point.inputs()).reshape(len(self.items), len(self.states))
        columns = [self.states.index(e.state) for e in self.items]
        company[np.arange(len(columns)), columns] = 1.0
        return [Way(company[j], column, np.eye(len(columns))[j]) for j, column in enumerate(columns)]

    def _together(self, ways: Sequence[Way], weights: Array) -> Way:
        """Several gaps that move together, counted by the one that moves the most, whose weight is 1."""
        first = ways[int(np.abs(weights).argmax())]
        moves = sum((w * way.moves for w, way in zip(weights, ways, strict=True)), np.zeros(len(self.states)))
        # What follows another gap would move twice where that gap has a share of its own.
        return Way(moves, first.column, weights)

    def _arrived(self, rows: Array, *, jumps: bool) -> Array:
        """Inputs whose gaps have moved, with the mode of touch that belongs to them; in a jump with what follows."""
        if self._side is not None:
            # A law that changes at touch holds on its own side only; beyond it may have poles.
            column, g = self._side, rows[:, 1 + self.states.index("g_n")]
            rows[:, column] = np.where(g == 0, rows[:, column], np.sign(g))
        if jumps and self.followers:
            rows[:, self.followers] = self._follow(rows)
        return rows

    def _along_way(self, point: Point, way: Way, gaps: Sequence[float] | Array, *, jumps: bool) -> Array:
        """Inputs with the gaps along a way."""
        rows = np.repeat(point.inputs()[None], len(gaps), axis=0)
        rows[:, 1 : 1 + len(point.y)] += np.outer(np.asarray(gaps) - point.y[way.column], way.moves)
        rows[:, 1 + way.column] = gaps
        return self._arrived(rows, jumps=jumps)

    def _moved(self, point: Point, row: Array) -> Point:
        n = len(point.y)
        return replace(point, y=row[1 : 1 + n], parameters=row[1 + 2 * n :])

    def _at(self, point: Point, way: Way, gap: float | None, heat: Heat | None) -> Point | None:
        """The point with its gaps at a place of a way, where there is one."""
        if gap is None:
            return None
        return self._moved(point, self._along_way(point, way, [gap], jumps=heat is not None)[0])

    def _curves(self, point: Point, way: Way, heat: Heat | None) -> tuple[Curve, Curve]:
        """Driving traction along a way and its rounding, as functions of the gap that counts the way."""
        jumps = heat is not None

        def driving(gaps: Sequence[float] | Array) -> Array:
            pushes = self.pushes(self._along_way(point, way, gaps, jumps=jumps), heat)
            return np.asarray(np.where(way.pulls != 0, pushes, 0.0) @ way.pulls)

        def noise(gaps: Sequence[float] | Array) -> Array:
            sizes = np.atleast_2d(self._balance(self._along_way(point, way, gaps, jumps=jumps)))[:, 1::2]
            return np.asarray(SOLVED * np.where(way.pulls != 0, sizes, 0.0) @ np.abs(way.pulls))

        return driving, noise

    def pushes(self, rows: Array, heat: Heat | None = None) -> Array:
        """Driving tractions at inputs with the temperatures that a jump to them gives, shape (rows, equilibria)."""
        return np.asarray(np.atleast_2d(self._balance(_warmed(rows, heat)))[:, ::2])

    def _free(self, point: Point) -> Indices:
        """Indices of the gaps that are not held."""
        return np.nonzero(self._active(point.inputs()))[0]

    def _moves(self, point: Point) -> tuple[Array, Array]:
        """Change of the states with each gap that is not held, and the columns of these gaps."""
        ways, free = self.ways(point), self._free(point)
        return np.array([ways[j].moves for j in free]), np.array([ways[j].column for j in free])

    def _field(self, point: Point, heat: Heat | None) -> tuple[Field, Array]:
        """Driving tractions of the gaps that are not held, by how far they have moved; and the size of these gaps."""
        free, (moves, columns), n = self._free(point), self._moves(point), len(point.y)

        def driving(moved: Array) -> Array:
            rows = np.repeat(point.inputs()[None], len(moved), axis=0)
            rows[:, 1 : 1 + n] += moved @ moves
            return self.pushes(self._arrived(rows, jumps=heat is not None), heat)[:, free]

        return driving, np.maximum(np.abs(point.y[columns]), NANOMETRE)

    # -- equilibrium ----------------------------------------------------------------------------------------------

    def settle(self, point: Point, heat: Heat | None = None, balanced: float = BALANCED) -> Point | None:
        """The point with all gaps in equilibrium; each may move the others through pressure, shear and heat.

        A single gap is found by a search along it, several at the end of the damped motion that they begin. Where the
        tractions are ``balanced`` within this part, what slides runs on only if that balance is unstable.
        """
        if not self.items or len(self._free(point)) == 0:
            return point
        values = self._balance(point.inputs())
        is_balanced = np.all(np.abs(values[::2]) <= balanced * values[1::2])
        return self._released(point, heat, self._unstable(point, heat) if is_balanced else None)

    def settle_near(self, point: Point, heat: Heat, span: Array) -> Point | None:
        """The point with all gaps in equilibrium, for loads that go from one value to the next little by little.

        Newton's method leads there where its first step is no longer than the gaps or their whole ``span``, shape
        (states,), and each is at most half as long as the one before; elsewhere they settle.
        """
        free = self._free(point)
        if len(free) == 0:
            return point
        (driving, scale), (moves, columns) = self._field(point, heat), self._moves(point)
        sizes = np.maximum(scale, span[columns])
        way = equilibrium(driving, sizes, np.arange(len(free)), np.zeros(len(free)), 1.0)
        if way is None:
            return self.settle(point, heat)
        rows = replace(point, y=point.y + way @ moves).inputs()[None]
        return self._moved(point, self._arrived(rows, jumps=True)[0])

    def let_go(self, lost: Lost, parameters: Array, heat: Heat) -> Point | None:
        """Where the gaps come to rest from a fold, with the parameters that hold then."""
        return self._released(replace(lost.point, parameters=parameters), heat, lost)

    def _released(self, point: Point, heat: Heat | None, lost: Lost | None) -> Point | None:
        """Where what is not held comes to rest, from an equilibrium that is lost or from tractions out of balance."""
        free = self._free(point)
        if len(free) > 1:
            return self._damped(point, heat, lost)
        if len(free) == 0:
            return point
        way, direction = (lost.way, lost.direction) if lost else (self.ways(point)[free[0]], 0.0)
        onward = self._onward_along(point, way)
        if onward and not direction:
            return self._slid(point, way, onward, heat)
        driving, noise = self._curves(point, way, heat)
        gap = march(driving, float(point.y[way.column]), direction, noise)
        if gap is not None and abs(gap) < ATOM and abs(driving([0.0])) <= noise([0.0]):
            gap = 0.0  # laws that end with the gap shall know it
        return self._at(point, way, gap, heat)

    def _slid(self, point: Point, way: Way, onward: float, heat: Heat | None) -> Point | None:
        """Where what slides has come to balance; friction pulls nothing back.

        It has begun to slide as the push was above what sticking bears by no less than rounding. Where the stiffness is
        hardly more than none, as at a fold that is reached in time alone, this makes a way that can be seen.
        """
        driving, noise = self._curves(point, way, heat)
        start = float(point.y[way.column])
        now, least = onward * float(driving([start])[0]), float(noise([start])[0])
        beyond = march(lambda gaps: driving(gaps) + onward * least, start, onward, noise) if now > -least else start
        slope = float(np.abs(way.pulls) @ np.abs(self._tangents(point.inputs())[1::2]))
        if beyond is None or abs(beyond - start) * slope > BALANCED / SOLVED * least:
            return self._at(point, way, beyond, heat)
        return self._at(point, way, march(driving, start, 0.0, noise), heat) if now > 0 else point

    def _damped(self, point: Point, heat: Heat | None, lost: Lost | None) -> Point | None:
        """Where several gaps come to rest together."""
        (driving, scale), free = self._field(point, heat), self._free(point)
        moves, columns = self._moves(point)
        begins = np.zeros(len(free))
        if lost is not None:
            along, noise = self._curves(point, lost.way, heat)
            start = float(point.y[lost.way.column])
            gap = push_ahead(along, start, lost.direction, noise, lost=True)
            if gap is None:
                return None
            way = lost.direction * lost.way.pulls[free]
            # What is less drowns in the rounding of the other gaps.
            begins = way * max(abs(gap - start), KICK / float(np.max(np.abs(way) / scale)))
        rest = come_to_rest(driving, scale, self._onward(point)[free], begins)
        if rest is None:
            return None
        y = point.y + rest @ moves
        y[columns] = np.where(np.abs(y[columns]) < ATOM, 0.0, y[columns])  # laws that end with the gap shall know it
        return self._moved(point, self._arrived(replace(point, y=y).inputs()[None], jumps=heat is not None)[0])

    def _unstable(self, point: Point, heat: Heat | None) -> Lost | None:
        """The way in which gaps run away from a balance, where that is unstable: a fold that is passed already.

        Friction that falls with its own heat has no steady sliding on a spring that is softer than this fall. What
        nothing pushes yet, as where it is symmetric, is pushed by what the loads do next.
        """
        onward = self._onward(point)
        pushes = onward if onward.any() else self._next_pushes(point.inputs())
        free = self._free(point)
        if not pushes[free].any():
            return None
        change = stiffness(*self._field(point, heat), np.zeros(len(free)))
        found = unstable_way(change) if np.all(np.isfinite(change)) else None
        if found is None:
            return None
        weights = np.zeros(len(onward))
        weights[free] = found
        way, direction = self._together(self.ways(point), weights), float(np.sign(weights @ pushes))
        if not direction:
            return None
        driving, noise = self._curves(point, way, heat)
        start = float(point.y[way.column])
        left = np.abs(driving([start]))  # the balance was left by no more than the integration explains
        begins = push_ahead(driving, start, direction, lambda gaps: noise(gaps) + left, lost=False)
        return None if begins is None else Lost(point, way, direction)

    def pushed(self, before: Point, point: Point) -> bool:
        """Whether loads have changed a balance of tractions by more than rounding."""
        if not self.items:
            return False
        last, values = self._balance(before.inputs()), self._balance(point.inputs())
        return bool(np.any(np.abs(values[::2] - last[::2]) > BALANCED * values[1::2]))

    def polished(self, point: Point) -> Point:
        """The point without the drift that integration has left in its gaps."""
        for _ in range(POLISH if self.items else 0):
            values = self._tangents(point.inputs())
            y = point.y.copy()
            for way, residual, slope in zip(self.ways(point), values[::2], values[1::2], strict=True):
                change = -residual / slope if slope < 0 else 0.0
                if abs(change) <= NEGLIGIBLE * abs(point.y[way.column]):  # else it is no drift
                    y += change * way.moves
            point = replace(point, y=y)
        return point

    # -- sliding --------------------------------------------------------------------------------------------------

    def _onward(self, point: Point) -> Array:
        """Direction in which each gap moves as the interface slides on; zero for what may move in both."""
        slip = 0.0 if self.slip is None else point.parameters[self.slip]
        return np.array([slip * e.slides for e in self.items])

    def _onward_along(self, point: Point, way: Way) -> float:
        """Direction of a way in which the interface slides on; zero where nothing slides along it."""
        return float(np.sign(self._onward(point) @ way.pulls))

    def with_slip(self, point: Point, slip: float) -> Point:
        """The point with another mode of sliding."""
        parameters = point.parameters.copy()
        if self.slip is not None:
            parameters[self.slip] = slip
        return replace(point, parameters=parameters)

    def is_pushed_back(self, point: Point, drift: float, heat: Heat | None = None) -> bool:
        """Whether the tractions would pull what slides back, by more than the ``drift`` of their balance."""
        onward = self._onward(point)
        if not onward.any():
            return False
        j = int(np.abs(onward).argmax())
        inputs = _warmed(point.inputs()[None], heat)[0]
        residual, slope = self._tangents(inputs)[2 * j : 2 * j + 2]
        size = self._balance(inputs)[2 * j + 1]
        # Where nothing elastic holds it, it cannot stick.
        return bool(slope < 0 and onward[j] * residual < -drift * size)

    # -- folds ----------------------------------------------------------------------------------------------------

    @cached_property
    def _tangent_of_folds(self) -> list[Function | None]:
        """Tangent stiffness of the edges that are folds."""
        return [compiled(self.system, [edge.fold.tangent]) if edge.fold else None for edge in self.system.edges]

    @cached_property
    def _shapes_of_folds(self) -> list[Function | None]:
        """Of the edges that are folds: how the tangent falls, the warming, and the stiffness, row after row."""
        found: list[Function | None] = []
        for fold in (edge.fold for edge in self.system.edges):
            if fold is None:
                found.append(None)
                continue
            warming = [rise.get(name, 0) for rise in fold.warming for name in self.states]
            stiffness = [entry for row in fold.stiffness for entry in row]
            found.append(compiled(self.system, [*fold.falls, *warming, *stiffness]))
        return found

    def _shape(self, index: int, point: Point) -> tuple[Array, Array, Way]:
        """How the tangent of a fold falls along each gap, how each warms the states, and the way that is lost."""
        shape, n = self._shapes_of_folds[index], len(self.items)
        assert shape is not None
        falls, warming, entries = np.split(np.atleast_1d(shape(point.inputs())), [n, n + n * len(self.states)])
        # The way that costs no traction: the gaps by which the stiffness is singular.
        ways, active = self.ways(point), self._free(point)
        weights = np.zeros(len(ways))
        A = entries.reshape(n, n)[np.ix_(active, active)]
        weights[active] = np.linalg.svd(A)[2][-1] if len(active) > 1 else 1.0
        weights /= weights[np.abs(weights).argmax()]
        return falls, warming.reshape(n, -1), self._together(ways, weights)

    def at_fold(self, index: int, point: Point) -> Lost | None:
        """The fold itself, from a point close to it; None where it is out of reach.

        Equilibrium is lost like a square root in time, so that a run ends a little before the fold. Where the stiffness
        rises as the interface slides on, only time leads to the fold, and nothing pushes the interface there.
        """
        tangent, (falls, warming, way) = self._tangent_of_folds[index], self._shape(index, point)
        direction, onward = float(np.sign(falls @ way.pulls)), self._onward_along(point, way)
        if onward and direction != onward:
            return None
        there = replace(way, moves=way.moves + warming.T @ way.pulls)

        def ahead(gaps: Sequence[float] | Array) -> Array:
            assert tangent is not None
            return np.asarray(tangent(self._along_way(point, there, gaps, jumps=False))).reshape(-1)

        at = zero_ahead(ahead, float(point.y[way.column]), direction, 1.0)
        found = self._at(point, there, at, None)
        return None if found is None else Lost(found, way, direction)

    def held_at(self, index: int, lost: Lost) -> Lost | None:
        """The same fold where sticking holds what slides; None where that keeps the equilibrium."""
        tangent, point = self._tangent_of_folds[index], self.with_slip(lost.point, 0.0)
        assert tangent is not None
        if tangent(point.inputs())[0] > FOLD:
            return None
        falls, _, way = self._shape(index, point)
        return Lost(point, way, float(np.sign(falls @ way.pulls)))

    def lost(self, point: Point, rtol: float) -> int | None:
        """The fold that is so close to a point that time cannot tell them apart."""
        for index, edge in enumerate(self.system.edges):
            found = self.at_fold(index, point) if edge.fold else None
            if found is None:
                continue
            sizes, left = self._balance(point.inputs())[1::2], self._balance(found.point.inputs())[::2]
            if np.all(np.abs(left) <= DRIFT * rtol * np.abs(sizes)):
                return index
        return None

    @cached_property
    def _approaches(self) -> list[Function | None]:
        """Tangent of the edges that are folds, how fast it changes, and how each balance does by itself."""
        states, t = self.system.states, self.system.t
        alone = [derivative(self.system.expand(row), t) for row in self.system.rows.values()]
        found: list[Function | None] = []
        for fold in (edge.fold for edge in self.system.edges):
            if fold is None:
                found.append(None)
                continue
            tangent = self.system.expand(fold.tangent)
            change = sum((derivative(tangent, s.symbol) * s.dot for s in states), derivative(tangent, t))
            found.append(compiled(self.system, [tangent, change, *alone]))
        return found

    def in_time(self, index: int, point: Point, end: float) -> Point:
        """A point close to a fold at the time of the fold, where that is before the end; else as it is.

        Near a fold the square of the tangent stiffness falls in proportion to time.
        """
        approach, left = self._approaches[index], 0.0
        if approach is not None:
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


def _warmed(rows: Array, heat: Heat | None) -> Array:
    """Inputs with the temperatures that a jump to them gives, where it gives any."""
    if heat is None:
        return rows
    warmed = heat(rows)
    return np.where(np.isfinite(warmed), warmed, rows)
