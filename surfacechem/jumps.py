"""Jumps of the state at a transition: energy is conserved, entropy is tested, gaps find their next equilibrium.

Source: lumped form of the balances across a jump; Sauer, Duong & Mandadapu (2021), section 6.3, for sudden debonding.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from surfacechem.compile import Function, compile_function
from surfacechem.expressions import Expression, derivative
from surfacechem.marching import march, zero_ahead
from surfacechem.system import HELD, Equilibrium, System, Transition

Array = NDArray[np.float64]

DRIFT = 100.0
"""Traction out of balance that the integration explains, relative to its parts and in units of the tolerance."""

ADMISSIBLE, VIOLATES, IMPOSSIBLE = "admissible", "destroys entropy", "impossible"

ROUNDING = 1e-12
"""Entropy that counts as none, relative to the entropies that change."""

DIGITS = 4 * float(np.finfo(float).eps)
"""Last digits of a number."""

SWEEPS, STILL, TINY = 60, 1e-12, 1e-9
"""Rounds in which gaps in equilibrium with each other are found, and the change at which they rest: relative, of at
least a nanometre."""

NEWTON = 60
POLISH = 3
DRIFTED = 1e-3
"""Largest relative drift of a gap from its equilibrium that is corrected without a search."""


@dataclass(frozen=True)
class Point:
    """A state with the parameters that hold there."""

    t: float
    y: Array
    ydot: Array
    parameters: Array

    def inputs(self) -> Array:
        return np.concatenate(([self.t], self.y, self.ydot, self.parameters))


@dataclass(frozen=True)
class Jump:
    """What happened at a transition."""

    t: float
    transition: Transition
    before: Point
    after: Point
    released: float
    """Energy turned into heat [J/m^2]."""
    entropy: float
    """Entropy produced [J/(m^2 K)], what reservoirs take included."""
    verdict: str
    since: float = 0.0
    """Time since the transition before [s], sharper than the difference of their times late in a run."""
    work: Mapping[str, float] = field(default_factory=dict)
    """Work of the far-field tractions [J/m^2], by account."""
    heat_out: float = 0.0
    """Heat passed to prescribed temperatures [J/m^2]."""
    entropy_out: float = 0.0

    @property
    def stops(self) -> bool:
        """Whether the run cannot, or may not, go on."""
        return self.verdict == IMPOSSIBLE or (self.verdict == VIOLATES and self.transition.violation == "refuse")


class Jumper:
    """The jumps of a system, compiled when the first one happens."""

    def __init__(self, system: System) -> None:
        self.system = system
        self.states = [state.name for state in system.states]
        mode_symbols = {mode.symbol for mode in system.modes}
        kept = [p.symbol in mode_symbols or p.path == HELD for p in system.parameters]
        self.mode_columns = [j for j, keep in enumerate(kept) if keep]

    @cached_property
    def _maps(self) -> list[Function]:
        """For each transition the new states and the new modes."""
        system = self.system
        modes = [system.parameters[j].symbol for j in self.mode_columns]
        return [
            compile_function(
                system.inputs,
                [system.expand(item.jump.get(s.symbol, s.symbol)) for s in system.states]
                + [system.expand(item.modes.get(m, m)) for m in modes],
            )
            for item in system.transitions
        ]

    @cached_property
    def _moving_margins(self) -> list[Expression]:
        return [self.system.expand(item.margin) for item in self.system.transitions]

    @cached_property
    def margins_read_rates(self) -> bool:
        """Whether margins depend on rates, or on variables that have to be found with them."""
        rates = {state.dot for state in self.system.states}
        others = [self.system.expand(margin.expression) for margin in self.system.margins]
        return any(state.algebraic for state in self.system.states) or any(
            item.free_symbols & rates for item in [*self._moving_margins, *others]
        )

    @cached_property
    def _margin_rates(self) -> Function:
        states, t = self.system.states, self.system.t
        rates = [sum((derivative(m, s.symbol) * s.dot for s in states), derivative(m, t)) for m in self._moving_margins]
        return compile_function(self.system.inputs, rates)

    def margin_rates(self, point: Point) -> Array:
        """Time derivatives of the margins of the transitions at a consistent point."""
        return self._margin_rates(point.inputs())

    @cached_property
    def _books(self) -> Function:
        """What a jump conserves, the total entropy, and the potentials of the far-field tractions."""
        system = self.system
        books = [system.jump_energy, system.find("S_total").expression, *system.given.values()]
        return compile_function(system.inputs, [system.expand(item) for item in books])

    def _sink_function(self, kind: str) -> Function:
        """What a jump conserves; then temperature, share, energy and capacity of each sink."""
        if kind not in self._sink_functions:
            sinks = self.system.sinks[kind]
            columns = [item for s in sinks for item in (s.T, s.share, s.energy, derivative(s.energy, s.T))]
            expressions = [self.system.expand(item) for item in (self.system.jump_energy, *columns)]
            self._sink_functions[kind] = compile_function(self.system.inputs, expressions)
        return self._sink_functions[kind]

    @cached_property
    def _sink_functions(self) -> dict[str, Function]:
        return {}

    @cached_property
    def _equilibria(self) -> Function:
        """Driving traction and size of its parts, for each quasi-static gap."""
        items = [item for e in self.system.equilibria for item in (e.residual, e.size)]
        return compile_function(self.system.inputs, [self.system.expand(item) for item in items])

    @cached_property
    def _folds(self) -> list[Function | None]:
        """Tangent and curvature of the transitions that are folds."""
        system = self.system
        return [
            compile_function(system.inputs, [system.expand(f.tangent), system.expand(f.curvature)]) if f else None
            for f in (item.fold for item in system.transitions)
        ]

    def at_fold(self, index: int, point: Point) -> tuple[Point, float] | None:
        """The point with its gap at the fold itself, and the direction in which it runs from there.

        Equilibrium is lost like a square root in time, so that a run ends a little before the fold. None where the
        fold is out of reach.
        """
        fold, function = self.system.transitions[index].fold, self._folds[index]
        assert fold is not None
        assert function is not None
        column = 1 + self.states.index(fold.state)
        base = point.inputs()
        direction = float(np.sign(function(base)[1]))

        def tangent(gaps: Sequence[float] | Array) -> Array:
            rows = np.repeat(base[None], len(gaps), axis=0)
            rows[:, column] = gaps
            return np.atleast_2d(function(rows))[:, 0]

        g = zero_ahead(tangent, float(base[column]), direction, 1.0)
        if g is None:
            return None
        y = point.y.copy()
        y[column - 1] = g
        return Point(point.t, y, point.ydot, point.parameters), direction

    def lost_equilibrium(self, point: Point, rtol: float) -> int | None:
        """The fold that is so close to a point that time cannot tell them apart."""
        for index, item in enumerate(self.system.transitions):
            found = self.at_fold(index, point) if item.fold else None
            if found is not None and self._is_close(index, point, found[0], DRIFT * rtol):
                return index
        return None

    def _is_close(self, index: int, point: Point, fold: Point, tolerance: float) -> bool:
        state = self.system.transitions[index].fold.state  # type: ignore[union-attr]
        number = [e.state for e in self.system.equilibria].index(state)
        size, left = (abs(float(self._equilibria(p.inputs())[2 * number + 1 - k])) for k, p in ((0, point), (1, fold)))
        return left <= tolerance * size

    def settle(self, point: Point) -> Point | None:
        """The point with its quasi-static gaps in equilibrium, temperatures held; None where there is none."""
        for e in self.system.equilibria:
            found = self._next_equilibrium(point, e, "", 0.0, 0.0)
            if found is None:
                return None
            point = found
        return point

    @cached_property
    def _tangents(self) -> Function:
        """Driving traction and its slope, for each quasi-static gap."""
        symbols = {state.name: state.symbol for state in self.system.states}
        residuals = [(self.system.expand(e.residual), symbols[e.state]) for e in self.system.equilibria]
        return compile_function(self.system.inputs, [x for r, g in residuals for x in (r, derivative(r, g))])

    def polished(self, point: Point) -> Point:
        """The point without the drift that integration has left in its quasi-static gaps."""
        if not self.system.equilibria:
            return point
        y = point.y.copy()
        columns = [self.states.index(e.state) for e in self.system.equilibria]
        for _ in range(POLISH):
            values = self._tangents(replace(point, y=y).inputs())
            residual, slope = values[::2], values[1::2]
            change = np.where(slope < 0, -residual / np.where(slope < 0, slope, -1.0), 0.0)
            y[columns] += np.where(np.abs(change) <= DRIFTED * np.abs(y[columns]), change, 0.0)
        return replace(point, y=y)

    def make(self, index: int, before: Point, since: float) -> Jump:
        """Carry out a transition; ``since`` is the time since the one before [s]."""
        item = self.system.transitions[index]
        values = self._maps[index](before.inputs())
        n = len(before.y)
        parameters = before.parameters.copy()
        parameters[self.mode_columns] = values[n:]
        start = Point(before.t, values[:n], np.zeros(n), parameters)
        books = self._books(before.inputs())
        energy = float(books[0])
        after: Point | None = start
        if item.settles:
            direction = 0.0
            if item.fold is not None:
                found = self.at_fold(index, before)
                if found is not None:
                    before, direction = found
                    after = Point(start.t, before.y, start.ydot, parameters)
            after = self._settled(after, item, energy, direction)
        heated = self._heated(after, item.sinks, energy) if after is not None else None
        if heated is None:
            return Jump(before.t, item, before, start, 0.0, 0.0, IMPOSSIBLE, since)
        final, released, out, taken = heated
        return self._judged(
            Jump(before.t, item, before, final, released, taken, ADMISSIBLE, since, heat_out=out, entropy_out=taken),
            books,
        )

    def _settled(self, point: Point | None, item: Transition, energy: float, direction: float) -> Point | None:
        """The point with all quasi-static gaps in equilibrium; each may move the others through pressure and heat."""
        moved: Point | None = point
        for sweep in range(SWEEPS):
            last = moved
            for e in self.system.equilibria:
                own = sweep == 0 and item.fold is not None and e.state == item.fold.state
                moved = moved and self._next_equilibrium(moved, e, item.sinks, energy, direction if own else 0.0)
            if moved is None or last is None:
                return None
            if len(self.system.equilibria) < 2 or np.all(np.abs(moved.y - last.y) <= STILL * (np.abs(moved.y) + TINY)):
                return moved
        return None

    def _judged(self, jump: Jump, books: Array) -> Jump:
        """The jump with the entropy it produces, what the second law says of that, and the work done in it."""
        now = self._books(jump.after.inputs())
        before, after = float(books[1]), float(now[1])
        gain = after - before + jump.entropy_out
        size = max(abs(before), abs(after), abs(jump.entropy_out))
        work = dict(zip(self.system.given, (now[2:] - books[2:]).tolist(), strict=True))
        return replace(jump, entropy=gain, verdict=ADMISSIBLE if gain >= -ROUNDING * size else VIOLATES, work=work)

    def _heated(self, point: Point, kind: str, energy: float) -> tuple[Point, float, float, float] | None:
        """The point with the released energy in its sinks: point, energy, heat and entropy passed to reservoirs."""
        rows = point.inputs()[None]
        heated, released = self._temperatures(rows, kind, energy)
        if not np.all(np.isfinite(heated)):
            return None
        heat, entropy, total = 0.0, 0.0, float(released[0])
        if abs(total) <= self._rounding(point, kind):
            return point, 0.0, 0.0, 0.0
        if any(s.prescribed for s in self.system.sinks[kind]):
            values = self._sink_function(kind)(rows)[0, 1:].reshape(-1, 4)
            for s, (T, share, _, _) in zip(self.system.sinks[kind], values.tolist(), strict=True):
                heat += share * total if s.prescribed else 0.0
                entropy += share * total / T if s.prescribed else 0.0
        return Point(point.t, heated[0, 1 : 1 + len(point.y)], point.ydot, point.parameters), total, heat, entropy

    def _rounding(self, point: Point, kind: str) -> float:
        """Energy that the last digits of the states and of the energy itself stand for [J/m^2]."""
        rows = np.repeat(point.inputs()[None], 1 + len(point.y), axis=0)
        states = slice(1, 1 + len(point.y))
        rows[1:, states] *= 1 + DIGITS * np.eye(len(point.y))
        energies = self._sink_function(kind)(rows)[:, 0]
        return float(np.sum(np.abs(energies[1:] - energies[0])) + DIGITS * abs(energies[0]))

    def _temperatures(self, rows: Array, kind: str, energy: float) -> tuple[Array, Array]:
        """Inputs with the temperatures that take up what is missing from the energy, and the energy released."""
        sinks, function = self.system.sinks[kind], self._sink_function(kind)
        free = [(j, 1 + self.states.index(s.node)) for j, s in enumerate(sinks) if not s.prescribed]
        values = function(rows)
        released = energy - values[:, 0]
        now = values[:, 1:].reshape(len(rows), -1, 4)
        target = now[:, :, 2] + now[:, :, 1] * released[:, None]
        rows = rows.copy()
        for _ in range(NEWTON if free else 0):
            done = True
            for j, column in free:
                T = rows[:, column]
                change = (target[:, j] - now[:, j, 2]) / now[:, j, 3]
                moved = T + change
                done = done and not np.any(np.abs(change) > 4e-16 * np.abs(T))
                # A body without a minimum of energy above T = 0 lets Newton's method run out below it.
                rows[:, column] = np.where(moved > 0, moved, np.nan)
            if done:
                break
            now = function(rows)[:, 1:].reshape(len(rows), -1, 4)
        return rows, released

    def _next_equilibrium(
        self, point: Point, e: Equilibrium, kind: str, energy: float, direction: float
    ) -> Point | None:
        """The nearest zero of the driving traction in the direction in which it pushes."""
        column = 1 + self.states.index(e.state)
        number = self.system.equilibria.index(e)
        base = point.inputs()

        def driving(gaps: Sequence[float] | Array) -> Array:
            rows = np.repeat(base[None], len(gaps), axis=0)
            rows[:, column] = gaps
            if kind:
                heated, _ = self._temperatures(rows, kind, energy)
                rows = np.where(np.isfinite(heated), heated, rows)
            return np.asarray(np.atleast_2d(self._equilibria(rows))[:, 2 * number])

        g = march(driving, float(base[column]), direction)
        if g is None:
            return None
        y = point.y.copy()
        y[column - 1] = g
        return Point(point.t, y, point.ydot, point.parameters)
