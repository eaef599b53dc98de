"""Gaps without mass or damper: the equilibrium that they find together, how they slide into it, and the folds where it
is lost, found from close by.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from surfacechem.compile.program import Function, compile_function
from surfacechem.expressions import Expression, derivative
from surfacechem.model.automaton import FOLD_STIFFNESS, SIDE_PATH, SLIP_PATH
from surfacechem.model.system import System
from surfacechem.solve.branches import (
    FIRST_PUSH,
    Curve,
    Field,
    Indices,
    come_to_rest,
    equilibrium,
    march,
    next_root,
    push_ahead,
    stiffness,
    unstable_direction,
)
from surfacechem.solve.contract import Array
from surfacechem.tolerances import (
    DRIFT,
    GAP_EPS,
    IDLE,
    MOST_DRIFT,
    NANOMETRE,
    NEGLIGIBLE,
    NEWTON_EPS,
    PICOMETRE,
    RUN_EPS,
)

Heat = Callable[[Array], Array]
"""Function from inputs to inputs with the temperatures that a jump to them gives."""

BALANCED = RUN_EPS
"""Tractions out of balance that count as none, relative to their parts: those of a run hold its rounding."""

NO_BALANCE = "there is no gap at which the tractions are in equilibrium at the start"

CORRECTIONS = 3
"""Newton steps that take the drift of an integration out of the gaps: each doubles the digits."""


def drift_of(rtol: float) -> float:
    """Traction out of balance that the integration explains at a tolerance, relative to its parts."""
    return min(DRIFT * rtol, MOST_DRIFT)


@dataclass(frozen=True)
class Point:
    """A state with the parameters that hold there."""

    t: float
    y: Array
    ydot: Array
    parameters: Array

    @classmethod
    def of(cls, inputs: Array, n: int) -> Point:
        """The point at arguments of compiled functions with so many states."""
        return cls(float(inputs[0]), inputs[1 : 1 + n], inputs[1 + n : 1 + 2 * n], inputs[1 + 2 * n :])

    def inputs(self) -> Array:
        """Arguments of compiled functions."""
        return np.concatenate(([self.t], self.y, self.ydot, self.parameters))


def compiled(system: System, expressions: Iterable[Expression]) -> Function:
    """Compile expressions of a system as a function of its inputs."""
    return compile_function(system.inputs, [system.expand(item) for item in expressions])


@dataclass(frozen=True)
class GapDirection:
    """A direction in the space of the gaps: what moves, the gap that counts the way, and the tractions along it."""

    moves: Array
    """Change of each state, shape (states,)."""
    column: int
    """The state that changes by one."""
    pulls: Array
    """Weights of the driving tractions, shape (equilibria,)."""


@dataclass(frozen=True)
class FoldPoint:
    """A fold: the point there, the way in which the gaps are lost, and the direction along it."""

    point: Point
    way: GapDirection
    direction: float


@dataclass(frozen=True)
class FreeGaps:
    """The gaps of a point that are not held, counted by how far each has moved from there."""

    which: Indices
    columns: Array
    """Columns of the states that are the gaps."""
    moves: Array
    """Change of the states with each, shape (gaps, states)."""
    driving: Field
    scale: Array
    """Sizes of the gaps [m]."""


class Equilibria:
    """The quasi-static gaps of a system; each function is compiled when first needed."""

    def __init__(self, system: System) -> None:
        self.system = system
        self.states = [state.name for state in system.states]
        self.items = system.equilibria
        paths = [parameter.path for parameter in system.parameters]
        self.slip = paths.index(SLIP_PATH) if SLIP_PATH in paths and any(e.slides for e in self.items) else None
        """Column of the mode of sliding among the parameters, where gaps in equilibrium stick or slide."""
        sided = SIDE_PATH in paths and "g_n" in self.states
        self._side = 1 + 2 * len(self.states) + paths.index(SIDE_PATH) if sided else None
        self.followers = [1 + self.states.index(name) for name in system.follows]
        """Columns of the states that follow the normal gap where it jumps, among the inputs."""

    @cached_property
    def _balance(self) -> Function:
        """Driving traction and size of its parts, for each gap; by itself, as a search asks for it at many rows."""
        return compiled(self.system, (item for e in self.items for item in (e.residual, e.size)))

    @cached_property
    def _moving(self) -> Function:
        """For each gap zero where it is held, and how far each state moves with it."""
        rows = ([e.active, *(e.along.get(name, int(name == e.state)) for name in self.states)] for e in self.items)
        return compiled(self.system, (item for row in rows for item in row))

    @cached_property
    def _bears(self) -> Function:
        """Friction limit for each gap [Pa]."""
        return compiled(self.system, (e.bears for e in self.items))

    @cached_property
    def _tangents(self) -> Function:
        """For each gap the driving traction, its slope along what moves, and the rate at which loads change it."""
        symbols, found = {state.name: state.symbol for state in self.system.states}, []
        for e in self.items:
            residual = self.system.expand(e.residual)
            with_it = (self.system.expand(w) * derivative(residual, symbols[x]) for x, w in e.along.items())
            slope = derivative(residual, symbols[e.state]) + sum(with_it)
            found += [residual, slope, derivative(residual, self.system.t)]
        return compiled(self.system, found)

    @cached_property
    def _follow(self) -> Function:
        """States that follow the normal gap where it jumps."""
        return compiled(self.system, self.system.follows.values())

    # -- gaps along a way -----------------------------------------------------------------------------------------

    def free(self, point: Point) -> Indices:
        """Indices of the gaps that are not held."""
        return np.nonzero(self._moving(point.inputs())[:: 1 + len(self.states)])[0]

    def ways(self, point: Point) -> list[GapDirection]:
        """The way of each gap by itself."""
        moves = self._moving(point.inputs()).reshape(len(self.items), 1 + len(self.states))[:, 1:]
        alone = np.eye(len(self.items))
        return [GapDirection(moves[j], self.states.index(e.state), alone[j]) for j, e in enumerate(self.items)]

    def together(self, point: Point, weights: Array) -> GapDirection:
        """Several gaps that move together, counted by the one that moves the most, whose weight is 1."""
        ways = self.ways(point)
        moves = sum((w * way.moves for w, way in zip(weights, ways, strict=True)), np.zeros(len(self.states)))
        return GapDirection(moves, ways[int(np.abs(weights).argmax())].column, weights)

    def _free(self, point: Point, heat: Heat | None) -> FreeGaps:
        which, ways = self.free(point), self.ways(point)
        moves, columns = np.array([ways[j].moves for j in which]), np.array([ways[j].column for j in which])

        def driving(moved: Array) -> Array:
            rows = np.repeat(point.inputs()[None], len(moved), axis=0)
            rows[:, 1 : 1 + len(point.y)] += moved @ moves
            return self.pushes(self._arrived(rows, jumps=heat is not None), heat)[:, which]

        return FreeGaps(which, columns, moves, driving, np.maximum(np.abs(point.y[columns]), NANOMETRE))

    def _arrived(self, rows: Array, *, jumps: bool) -> Array:
        """Inputs whose gaps have moved, with the mode of touch that belongs to them; in a jump with what follows."""
        if self._side is not None:
            # A law that changes at touch holds on its own side only; beyond it may have poles.
            column, g = self._side, rows[:, 1 + self.states.index("g_n")]
            rows[:, column] = np.where(g == 0, rows[:, column], np.sign(g))
        if jumps and self.followers:
            rows[:, self.followers] = self._follow(rows)
        return rows

    def along(self, point: Point, way: GapDirection, gaps: Sequence[float] | Array, *, jumps: bool = False) -> Array:
        """Inputs with the gaps along a way."""
        rows = np.repeat(point.inputs()[None], len(gaps), axis=0)
        rows[:, 1 : 1 + len(point.y)] += np.outer(np.asarray(gaps) - point.y[way.column], way.moves)
        rows[:, 1 + way.column] = gaps
        return self._arrived(rows, jumps=jumps)

    def moved(self, point: Point, rows: Array) -> Point:
        """The point with the states and modes of the only row."""
        n = len(point.y)
        return replace(point, y=rows[0, 1 : 1 + n], parameters=rows[0, 1 + 2 * n :])

    def _curves(self, point: Point, way: GapDirection, heat: Heat | None) -> tuple[Curve, Curve]:
        """Driving traction along a way and its rounding, as functions of the gap that counts the way."""
        pulled, jumps = way.pulls != 0, heat is not None

        def driving(gaps: Sequence[float] | Array) -> Array:
            pushes = self.pushes(self.along(point, way, gaps, jumps=jumps), heat)
            return np.asarray(np.where(pulled, pushes, 0.0) @ way.pulls)

        def noise(gaps: Sequence[float] | Array) -> Array:
            sizes = np.atleast_2d(self._balance(self.along(point, way, gaps, jumps=jumps)))[:, 1::2]
            return np.asarray(NEWTON_EPS * np.where(pulled, sizes, 0.0) @ np.abs(way.pulls))

        return driving, noise

    def balance(self, point: Point) -> tuple[Array, Array]:
        """Driving traction of each gap, and the size of its parts."""
        values = self._balance(point.inputs())
        return values[::2], values[1::2]

    def pushes(self, rows: Array, heat: Heat | None = None) -> Array:
        """Driving tractions at inputs with the temperatures that a jump to them gives, shape (rows, equilibria)."""
        return np.asarray(np.atleast_2d(self._balance(_warmed(rows, heat)))[:, ::2])

    # -- equilibrium ----------------------------------------------------------------------------------------------

    def equilibrate(
        self, point: Point, heat: Heat | None = None, balanced: float = BALANCED, lost: FoldPoint | None = None
    ) -> Point | None:
        """The point with all gaps in equilibrium; each may move the others through pressure, shear and heat.

        A single gap is found by a search along it, several at the end of the damped motion that they begin. Where the
        tractions are ``balanced`` within this part, what slides runs on only if that balance is unstable. From a
        balance that is ``lost`` gaps go on with the parameters of the point.
        """
        if lost is not None:
            return self._released(replace(lost.point, parameters=point.parameters), heat, lost)
        if not self.items or len(self.free(point)) == 0:
            return point
        driving, sizes = self.balance(point)
        is_balanced = np.all(np.abs(driving) <= balanced * sizes)
        return self._released(point, heat, self._unstable(point, heat) if is_balanced else None)

    def equilibrate_near(self, point: Point, heat: Heat, span: Array) -> Point | None:
        """The point with all gaps in equilibrium, for loads that go from one value to the next little by little.

        Newton's method leads there where its first step is no longer than the gaps or their whole ``span``, shape
        (states,), and each is at most half as long as the one before; elsewhere they settle.
        """
        if len(self.free(point)) == 0:
            return point
        free = self._free(point, heat)
        n, sizes = len(free.which), np.maximum(free.scale, span[free.columns])
        way = equilibrium(free.driving, sizes, np.arange(n), np.zeros(n), 1.0)
        if way is None:
            return self.equilibrate(point, heat)
        there = replace(point, y=point.y + way @ free.moves)
        return self.moved(point, self._arrived(there.inputs()[None], jumps=True))

    def _released(self, point: Point, heat: Heat | None, lost: FoldPoint | None) -> Point | None:
        """Point at which the free gaps come to rest after a lost equilibrium, or from tractions out of balance."""
        free = self.free(point)
        if len(free) > 1:
            return self._damped(point, heat, lost)
        if len(free) == 0:
            return point
        way, direction = (lost.way, lost.direction) if lost else (self.ways(point)[free[0]], 0.0)
        onward = self.onward_along(point, way)
        driving, noise = self._curves(point, way, heat)
        start = float(point.y[way.column])
        if onward and not direction:
            gap = self._slid(point, way, onward, driving, noise)
        else:
            gap = march(driving, start, direction, noise)
            if gap is not None and abs(gap) < GAP_EPS and abs(driving([0.0])) <= noise([0.0]):
                gap = 0.0  # laws that end with the gap shall know it
        if gap is None or (onward and gap == start):
            return None if gap is None else point
        return self.moved(point, self.along(point, way, [gap], jumps=heat is not None))

    def _slid(self, point: Point, way: GapDirection, onward: float, driving: Curve, noise: Curve) -> float | None:
        """The gap at which what slides has come to balance; friction pulls nothing back.

        It has begun to slide as the push was above what sticking bears by no less than rounding. Where the stiffness is
        hardly more than none, as at a fold that is reached in time alone, this makes a way that can be seen.
        """
        start = float(point.y[way.column])
        now, least = onward * float(driving([start])[0]), float(noise([start])[0])
        beyond = march(lambda gaps: driving(gaps) + onward * least, start, onward, noise) if now > -least else start
        slope = float(np.abs(way.pulls) @ np.abs(self._tangents(point.inputs())[1::3]))
        if beyond is None or abs(beyond - start) * slope > BALANCED / NEWTON_EPS * least:
            return beyond
        return march(driving, start, 0.0, noise) if now > 0 else start

    def _damped(self, point: Point, heat: Heat | None, lost: FoldPoint | None) -> Point | None:
        """Point at which several gaps come to rest together, by damped motion."""
        free = self._free(point, heat)
        begins = np.zeros(len(free.which))
        if lost is not None:
            along, noise = self._curves(point, lost.way, heat)
            start = float(point.y[lost.way.column])
            gap = push_ahead(along, start, lost.direction, noise, lost=True)
            if gap is None:
                return None
            way = lost.direction * lost.way.pulls[free.which]
            # What is less drowns in the rounding of the other gaps.
            begins = way * max(abs(gap - start), FIRST_PUSH / float(np.max(np.abs(way) / free.scale)))
        rest = come_to_rest(free.driving, free.scale, self._onward(point)[free.which], begins)
        if rest is None:
            return None
        y, columns = point.y + rest @ free.moves, free.columns
        y[columns] = np.where(np.abs(y[columns]) < GAP_EPS, 0.0, y[columns])  # laws that end with the gap shall know it
        return self.moved(point, self._arrived(replace(point, y=y).inputs()[None], jumps=heat is not None))

    def _unstable(self, point: Point, heat: Heat | None) -> FoldPoint | None:
        """The way in which gaps run away from a balance, where that is unstable: a fold that is passed already.

        Friction that falls with its own heat has no steady sliding on a spring that is softer than this fall. What
        nothing pushes yet, as where it is symmetric, is pushed by what the loads do next.
        """
        onward, free = self._onward(point), self._free(point, heat)
        pushes = onward if onward.any() else self._tangents(point.inputs())[2::3]
        if not pushes[free.which].any():
            return None
        change = stiffness(free.driving, free.scale, np.zeros(len(free.which)))
        found = unstable_direction(change) if np.all(np.isfinite(change)) else None
        weights = np.zeros(len(onward))
        weights[free.which] = 0.0 if found is None else found
        direction = float(np.sign(weights @ pushes))
        if not direction:
            return None
        way = self.together(point, weights)
        driving, noise = self._curves(point, way, heat)
        start = float(point.y[way.column])
        left = np.abs(driving([start]))  # the balance was left by no more than the integration explains
        begins = push_ahead(driving, start, direction, lambda gaps: noise(gaps) + left, lost=False)
        return None if begins is None else FoldPoint(point, way, direction)

    def corrected(self, point: Point) -> Point:
        """The point without the drift that integration has left in its gaps."""
        for _ in range(CORRECTIONS if self.items else 0):
            values = self._tangents(point.inputs())
            y = point.y.copy()
            for way, residual, slope in zip(self.ways(point), values[::3], values[1::3], strict=True):
                change = -residual / slope if slope < 0 else 0.0
                if abs(change) <= NEGLIGIBLE * max(abs(point.y[way.column]), PICOMETRE):  # else it is no drift
                    y += change * way.moves
            point = replace(point, y=y)
        return point

    # -- sliding --------------------------------------------------------------------------------------------------

    def _onward(self, point: Point) -> Array:
        """Direction in which each gap moves as the interface slides on; zero for what may move in both.

        So may what slides where sticking bears nothing.
        """
        slip = 0.0 if self.slip is None else point.parameters[self.slip]
        if not slip:
            return np.zeros(len(self.items))
        directions: Array = slip * np.array([e.slides for e in self.items])
        return np.where(self._bears(point.inputs()) > 0, directions, 0.0)

    def onward_along(self, point: Point, way: GapDirection) -> float:
        """Direction of a way in which the interface slides on; zero where nothing slides along it."""
        return float(np.sign(self._onward(point) @ way.pulls))

    def with_slip(self, point: Point, slip: float) -> Point:
        """The point with another mode of sliding."""
        parameters = point.parameters.copy()
        if self.slip is not None:
            parameters[self.slip] = slip
        return replace(point, parameters=parameters)

    def is_pushed_back(self, point: Point, drift: float, noise: float = 0.0, heat: Heat | None = None) -> bool:
        """Whether the tractions would pull what slides back, by more than the ``drift`` of their balance, relative to
        its parts, and than ``noise`` [Pa].
        """
        onward = self._onward(point)
        if not onward.any():
            return False
        j = int(np.abs(onward).argmax())
        inputs = _warmed(point.inputs()[None], heat)[0]
        residual, slope = self._tangents(inputs)[3 * j : 3 * j + 2]
        size = self._balance(inputs)[2 * j + 1]
        # Where nothing elastic holds it, it cannot stick.
        return bool(slope < 0 and onward[j] * residual < -max(drift * size, noise))


def _warmed(rows: Array, heat: Heat | None) -> Array:
    """Inputs with the temperatures that a jump to them gives, where it gives any."""
    if heat is None:
        return rows
    warmed = heat(rows)
    return np.where(np.isfinite(warmed), warmed, rows)


class Folds:
    """The edges of a system that are folds, by index."""

    def __init__(self, equilibria: Equilibria) -> None:
        self.equilibria, self.system = equilibria, equilibria.system
        self.items = {index: edge.fold for index, edge in enumerate(self.system.edges) if edge.fold is not None}

    @cached_property
    def _tangents(self) -> dict[int, Function]:
        """Tangent stiffness; by itself, as a search asks for it at many rows."""
        return {index: compiled(self.system, [fold.tangent]) for index, fold in self.items.items()}

    @cached_property
    def _shapes(self) -> dict[int, Function]:
        """Functions for the fall of the tangent along each gap, the warming of states by each, and the stiffness."""
        found = {}
        for index, fold in self.items.items():
            warming = [rise.get(name, 0) for rise in fold.warming for name in self.equilibria.states]
            entries = [entry for row in fold.stiffness for entry in row]
            found[index] = compiled(self.system, [*fold.falls, *warming, *entries])
        return found

    @cached_property
    def _approach(self) -> Function:
        """For each gap the driving traction, and how fast it changes."""
        states, t, found = self.system.states, self.system.t, []
        for item in self.equilibria.items:
            residual = self.system.expand(item.residual)
            change = sum((derivative(residual, s.symbol) * s.dot for s in states), derivative(residual, t))
            found += [residual, change]
        return compiled(self.system, found)

    def _shape(self, index: int, point: Point) -> tuple[Array, GapDirection, Array]:
        """Fall of the tangent of a fold along each gap, the way that is lost, and the change of the states along it,
        warming included.
        """
        n = len(self.equilibria.items)
        values = np.atleast_1d(self._shapes[index](point.inputs()))
        falls, warming, entries = np.split(values, [n, n + n * len(self.system.states)])
        # The way that costs no traction: the gaps by which the stiffness is singular.
        free, weights = self.equilibria.free(point), np.zeros(n)
        weights[free] = np.linalg.svd(entries.reshape(n, n)[np.ix_(free, free)])[2][-1] if len(free) > 1 else 1.0
        weights /= weights[np.abs(weights).argmax()]
        way = self.equilibria.together(point, weights)
        return falls, way, way.moves + warming.reshape(n, -1).T @ way.pulls

    def at(self, index: int, point: Point) -> FoldPoint | None:
        """The fold itself, from a point close to it; None where it is out of reach, or the edge is none.

        Equilibrium is lost like a square root in time, so that a run ends a little before the fold. Where the stiffness
        rises as the interface slides on, only time leads to the fold, and nothing pushes the interface there.
        """
        if index not in self.items or not len(self.equilibria.free(point)):
            return None
        falls, way, moves = self._shape(index, point)
        direction, onward = float(np.sign(falls @ way.pulls)), self.equilibria.onward_along(point, way)
        if onward and direction != onward:
            return None

        there = replace(way, moves=moves)

        def ahead(gaps: Sequence[float] | Array) -> Array:
            return np.asarray(self._tangents[index](self.equilibria.along(point, there, gaps))).reshape(-1)

        at = next_root(ahead, float(point.y[way.column]), direction, 1.0)
        if at is None:
            return None
        return FoldPoint(self.equilibria.moved(point, self.equilibria.along(point, there, [at])), way, direction)

    def held_at(self, index: int, lost: FoldPoint) -> FoldPoint | None:
        """The same fold where sticking holds what slides; None where that keeps the equilibrium."""
        point = self.equilibria.with_slip(lost.point, 0.0)
        if self._tangents[index](point.inputs())[0] > FOLD_STIFFNESS:
            return None
        falls, way, _ = self._shape(index, point)
        return FoldPoint(point, way, float(np.sign(falls @ way.pulls)))

    def reached(self, point: Point, rtol: float) -> int:
        """The fold that is so close to a point that time cannot tell them apart; -1 where none is."""
        for index in self.items:
            found = self.at(index, point)
            if found is None:
                continue
            (_, sizes), (left, _) = self.equilibria.balance(point), self.equilibria.balance(found.point)
            if np.all(np.abs(left) <= drift_of(rtol) * np.abs(sizes)):
                return index
        return -1

    def in_time(self, index: int, point: Point, end: float) -> Point:
        """A point close to a fold at the time of the fold, where that is before the end; else as it is.

        The traction that resists at the gap of the fold vanishes in proportion to time, whatever the run has missed of
        a gap that moves ever faster.
        """
        lost = self.at(index, point)
        if lost is None:
            return point
        beside = point.ydot - point.ydot[lost.way.column] * self._shape(index, point)[2]
        values = self._approach(replace(lost.point, ydot=beside).inputs())
        push, change = (lost.direction * float(lost.way.pulls @ part) for part in (values[::2], values[1::2]))
        left = -push / change if push < 0 < change else 0.0
        return replace(point, t=point.t + left) if left < min(IDLE * point.t, end - point.t) else point
