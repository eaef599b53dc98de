r"""Sinks of the heat of a jump and their temperatures; for load jumps integrated along the path of the loads.

Loads that jump are the limit of a fast ramp. Friction without a rate follows them at every moment: what jumps goes
along straight lines of the loads, from part 0 before the step to part 1 after it. Along the way x of what slides each
body takes the heat

.. math:: Q_k = \int s_k\,\mathrm dH

of friction H by the shares :math:`s_k` of the moment.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np
import symengine
from numpy.polynomial import chebyshev

from surfacechem.compile.program import Function
from surfacechem.expressions import derivative
from surfacechem.model.automaton import INTERFACE, Sink
from surfacechem.model.system import System
from surfacechem.solve.contract import HEAT_STEPS, Array, Mask
from surfacechem.solve.equilibria import Equilibria, GapDirection, Heat, Point, compiled
from surfacechem.solve.zeros import zero
from surfacechem.tolerances import ULPS

Moments = Callable[[Array, Array], tuple[Array, Array]]
"""From ways and what each taker has taken up to there, shape (ways, takers): the heat made up to each way, shape
(ways,), and the shares at these moments, shape (ways, takers)."""

PANEL_DEGREE = 16
"""Degree of shares and heat on a panel; half of it tells how good that is."""

NARROWEST, QUADRATURE_PANELS = 2.0**-50, 1000
"""Panel within which ways have no more digits: there a step of the shares, as at touch, is as sharp as it can be. Such
a step takes two panels for each digit. Ten of them are more than there are, and what takes more panels is rounding."""

PICARD_ROUNDS, PICARD_PART = 50, 0.1
"""Rounds in which what a panel takes has to agree with the temperatures that this gives, within a part of what counts;
a panel in which it does not is halved, which makes the feedback as weak as it has to be."""


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
    def asked(self) -> Function:
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
        values = self.asked(rows).reshape(len(rows), len(self.nodes), -1)
        return values[:, :, 0], values[:, :, 1], values[:, :, 2], values[:, :, 3:]

    @cached_property
    def passed(self) -> Mask:
        """Mask of the nodes that pass on the heat that they take."""
        return np.array([node.prescribed for node in self.nodes.values()], dtype=bool)

    def given(self, rows: Array, made: Array, shares: Array | None) -> tuple[Array, Array, Array]:
        """Inputs with the temperatures of the nodes after they have taken the heat that is made; the heat that each
        takes, and its temperature before, each of shape (rows, nodes).

        ``made`` has a column for each maker, and friction last: its heat goes by the ``shares`` along its way, where
        these are known, else as the interface shares it at the end.
        """
        T, U, C, parts = self.at(rows)
        rubbed = parts[:, :, self.interface] if shares is None else shares
        taken = np.einsum("ijk,ik->ij", parts, made[:, :-1]) + rubbed * made[:, -1:]
        return self._with_energy(rows, U + taken, U, C), taken, T

    def warmed(self, rows: Array, made: Array, shares: Array | None) -> Array:
        """Inputs with the temperatures of the nodes after they have taken the heat that is made."""
        return self.given(rows, made, shares)[0]

    def with_heat(self, rows: Array, taken: Array) -> Array:
        """Inputs with the temperatures of the nodes after each has taken its heat, shape (rows, nodes)."""
        _, U, C, _ = self.at(rows)
        return self._with_energy(rows, U + taken, U, C)

    def _with_energy(self, rows: Array, target: Array, U: Array, C: Array) -> Array:
        """Inputs with the temperatures at which nodes of these energies and capacities have the energies of a target,
        each of shape (rows, nodes).
        """
        free = list(zip([j for j, s in enumerate(self.nodes.values()) if not s.prescribed], self.free, strict=True))
        rows, left = rows.copy(), np.arange(len(rows))
        # Each row ends where it has converged: what it becomes does not depend on the others.
        for _ in range(HEAT_STEPS if free else 0):
            moves = np.zeros(len(left), dtype=bool)
            for j, column in free:
                T = rows[left, column]
                with np.errstate(over="ignore", invalid="ignore"):  # far away a search may see no number
                    change = (target[left, j] - U[:, j]) / C[:, j]
                moved = T + change
                moves |= np.abs(change) > ULPS * np.abs(T)
                # A body without a minimum of energy above T = 0 lets Newton's method run out below it.
                rows[left, column] = np.where(moved > 0, moved, np.nan)
            left = left[moves]
            if not len(left):
                break
            _, U, C, _ = self.at(rows[left])
        return rows


@dataclass
class LoadStep:
    """Loads that jump at one moment."""

    before: Point
    reached: float = 0.0
    """Part of the way at which the last edge of this moment is taken."""

    def levels(self, system: System, after: Point) -> Array:
        """By how much each parameter changes as the loads go from before the step to after it."""
        change = np.zeros(len(after.parameters))
        fields: dict[str, dict[str, int]] = {}
        for j, parameter in enumerate(system.parameters):
            if parameter.load is not None:
                fields.setdefault(parameter.path.rpartition(".")[0], {})[parameter.field] = j
        for columns in fields.values():
            load = system.parameters[next(iter(columns.values()))].load
            if load is None or "level" not in columns:
                continue
            old, new = (
                load.bind({name: float(point.parameters[j]) for name, j in columns.items()}).value(after.t)
                for point in (self.before, after)
            )
            change[columns["level"]] = float(new) - float(old)
        return change


def at_part(point: Point, change: Array, part: float) -> Point:
    """A point after a step with the loads at a part of their way."""
    return replace(point, parameters=point.parameters - (1 - part) * change)


@cache
def _panel(degree: int) -> tuple[Array, Array]:
    """Points of a panel from 0 to 1, and the integrals of f dg up to each of them for values of f and g at all."""
    points = (1 - np.cos(np.pi * np.arange(degree + 1) / degree)) / 2
    basis = np.linalg.inv(chebyshev.chebvander(2 * points - 1, degree))
    x, weights = np.polynomial.legendre.leggauss(degree + 1)
    integrals = np.zeros((degree + 1,) * 3)
    for i, end in enumerate(points):
        inside = end * (x + 1) / 2
        values = chebyshev.chebvander(2 * inside - 1, degree) @ basis
        slopes = 2 * chebyshev.chebval(2 * inside - 1, chebyshev.chebder(basis)).T
        integrals[i] = np.einsum("q,qf,qg->fg", end * weights / 2, values, slopes)
    return points, integrals


def shared_heat(moments: Moments, takers: int, small: float, *, feeds_back: bool) -> Array:
    """Heat that each of the takers has taken at the end of a way from 0 to 1, shape (takers,).

    Panels are halved until the integrals of their polynomials and those of half the degree agree within the heat that
    is ``small``. Shares that add up to one leave no heat out, whatever the panels.
    """
    (points, integrals), (_, coarse) = _panel(PANEL_DEGREE), _panel(PANEL_DEGREE // 2)
    taken, begin, width, panels = np.zeros(takers), 0.0, 1.0, 0
    while begin < 1.0:
        panels += 1
        up_to = np.repeat(taken[None], len(points), axis=0)
        for _ in range(PICARD_ROUNDS if feeds_back else 1):
            made, shares = moments(begin + width * points, up_to)
            last, up_to = up_to, taken + np.einsum("ifg,fk,g->ik", integrals, shares, made)
            agrees = not feeds_back or np.max(np.abs(up_to - last)) <= PICARD_PART * small
            if agrees:
                break
        if not np.all(np.isfinite(up_to)):
            return np.full(takers, np.nan)
        half = np.einsum("fg,fk,g->k", coarse[-1], shares[::2], made[::2])
        close = agrees and np.max(np.abs(up_to[-1] - taken - half)) <= small
        if close or width <= NARROWEST or panels > QUADRATURE_PANELS:
            taken, begin = up_to[-1], begin + width
            width = min(2 * width, 1.0 - begin)
        else:
            width /= 2
    return taken


def _first(curve: Callable[[float], float], reached: float) -> float:
    """The part of the way beyond which a curve is below zero, from one that is reached already."""
    here, there = curve(reached), curve(1.0)
    if not here > 0:
        return reached
    return zero(curve, (reached, 1.0), (here, there)) if there < 0 else 1.0


class LoadPath:
    """The way of what slides as loads jump."""

    def __init__(
        self,
        system: System,
        equilibria: Equilibria,
        heat: JumpHeat,
        energy: Function,
        stages: Sequence[tuple[str, list[int]]],
    ) -> None:
        self.system, self.equilibria, self.heat, self.energy = system, equilibria, heat, energy
        self.moved = next((columns for axis, columns in stages if axis != "n"), [])
        """Columns of the states that move along the interface, among the inputs."""

    @cached_property
    def varies(self) -> bool:
        """Whether the shares of the heat of friction change as loads jump."""
        fixed = {p.symbol for p in self.system.parameters if p.load is None}
        shares = [self.system.expand(sink.share) for sink in self.system.sinks[INTERFACE]]
        return any(symengine.sympify(share).free_symbols - fixed for share in shares)

    @cached_property
    def warms_itself(self) -> bool:
        """Whether friction, or how its heat is shared, changes with the temperatures that this heat raises."""
        hot = {symengine.Symbol(name) for name in self.heat.nodes}
        felt = [e.residual for e in self.equilibria.items] + [s.share for s in self.system.sinks[INTERFACE]]
        return any(self.system.expand(x).free_symbols & hot for x in felt)

    @cached_property
    def _guards(self) -> Function:
        return compiled(self.system, (edge.guard for edge in self.system.edges))

    def reach(self, index: int, step: LoadStep, before: Point) -> None:
        """Go along the way of the loads to where an edge that follows from them is taken."""
        if self.equilibria.slip is None or not self.varies or self.system.edges[index].times:
            return
        change = step.levels(self.system, before)

        def guard(part: float) -> float:
            loaded = at_part(before, change, part)
            held = self._held(loaded, np.abs(before.y - step.before.y))
            return float(self._guards(replace(held, parameters=loaded.parameters).inputs())[index])

        step.reached = _first(guard, step.reached)

    def shares(self, step: LoadStep, start: Point, after: Point, broken: float, small: float) -> Array | None:
        """The shares of the heat of friction of a jump, shape (nodes,), but for heat that is ``small``.

        It begins with that of bonds that are ``broken`` as sliding begins.
        What slides is at each place at the first part of the way of the loads at which it is pushed on there, warmed
        by what it has rubbed so far, and all else is in equilibrium at that part.
        """
        change = step.levels(self.system, after)
        j, way, length = self._way(start, after)
        slip = 0.0 if self.equilibria.slip is None else float(after.parameters[self.equilibria.slip])
        span = np.abs(after.y - step.before.y)
        columns, onward = np.array(self.moved) - 1, float(np.sign(length))

        def moment(place: float, floor: float, taken: Array) -> tuple[float, float, Array]:
            """Part of the way of the loads at a place, if no less than that before it; energy and shares there."""
            y = start.y.copy()
            y[columns] += place * length * way.moves[columns]
            there = replace(start, y=y, parameters=after.parameters)

            hot = self.heat.with_heat(start.inputs()[None], taken[None])[0, self.heat.free]

            def warm(rows: Array) -> Array:
                if not self.warms_itself:
                    return rows
                warmed = rows.copy()
                warmed[:, self.heat.free] = hot
                return warmed

            def at(part: float) -> Array:
                held = self._held(at_part(there, change, part), span, warm)
                return warm(self.equilibria.with_slip(held, slip).inputs()[None])

            def resists(part: float) -> float:
                return -onward * float(self.equilibria.pushes(at(part))[0, j])

            part = _first(resists, floor)
            row, here = at(part), after.inputs()
            here[self.moved] = row[0, self.moved]
            return part, float(self.energy(here)[0]), self.heat.at(row)[3][0, :, self.heat.interface]

        level = after.inputs()
        level[self.moved] = start.inputs()[self.moved]
        begun, begin, shares = moment(0.0, step.reached, np.zeros(len(self.heat.nodes)))
        at_once = (broken + float(self.energy(level)[0]) - begin) * shares
        reached = {0.0: begun}  # at the ends of panels: where sliding eases it runs on at the part it has begun at

        def moments(places: Array, taken: Array) -> tuple[Array, Array]:
            part, found = reached[float(places[0])], []
            for place, heat in zip(places, taken, strict=True):
                part, energy, share = moment(float(place), part, at_once + heat)
                found.append((begin - energy, share))
            reached[float(places[-1])] = part
            return np.array([made for made, _ in found]), np.array([share for _, share in found])

        taken = at_once + shared_heat(moments, len(self.heat.nodes), small, feeds_back=self.warms_itself)
        whole = float(np.sum(taken))
        return taken / whole if whole > 0 else None

    def _held(self, point: Point, span: Array, warm: Heat = lambda rows: rows) -> Point:
        """The point with all in equilibrium while friction holds; where there is none, as it is."""
        stuck = self.equilibria.with_slip(point, 0.0)
        return self.equilibria.equilibrate_near(stuck, warm, span) or stuck

    def _way(self, start: Point, after: Point) -> tuple[int, GapDirection, float]:
        """Index of the gap that slides, its way when sliding by itself, and the distance along that."""
        ways = self.equilibria.ways(self.equilibria.with_slip(after, 0.0))
        j = next(j for j, e in enumerate(self.equilibria.items) if e.slides)
        along = [ways[j], *(way for way in ways if way is not ways[j] and 1 + way.column in self.moved)]
        columns = np.array(self.moved) - 1
        moves = np.array([way.moves[columns] for way in along]).T
        return j, ways[j], float(np.linalg.lstsq(moves, (after.y - start.y)[columns], rcond=None)[0][0])
