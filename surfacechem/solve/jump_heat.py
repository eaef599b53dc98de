r"""Nodes that take the heat of a jump, and their temperatures; for load jumps integrated along the path of the loads.

Loads that jump are the limit of a fast ramp, which rate-independent friction follows at every moment: the jumping loads
go along straight lines, from part 0 before the step to part 1 after it. Along the sliding path x each body takes the
heat

.. math:: Q_k = \int s_k\,\mathrm dH

of the friction H by the shares :math:`s_k` of the moment.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
import symengine
from numpy.polynomial import chebyshev

from surfacechem.compile.program import Function
from surfacechem.expressions import derivative
from surfacechem.model.automaton import INTERFACE, Sink
from surfacechem.model.system import System
from surfacechem.solve.contract import HEAT_STEPS, Array, Mask
from surfacechem.solve.equilibria import Equilibria, Heat, Point, compiled, formulas, zero
from surfacechem.tolerances import ULPS

Moments = Callable[[Array, Array], tuple[Array, Array]]
"""Function from places along the path and the heat each node has taken up to there, shape (places, nodes), to the heat
made up to each place, shape (places,), and the shares there, shape (places, nodes).
"""

PANEL_DEGREE = 16
"""Degree of the polynomials of shares and heat on a panel; half the degree gives the error estimate."""

NARROWEST, QUADRATURE_PANELS = 2.0**-50, 1000
"""Narrowest panel, at the roundoff of the path, and most panels. A step of the shares, as at touch, takes two panels
for each bit of its place, a hundred in all. Ten such steps are more than occur; beyond that it is roundoff.
"""

PICARD_ROUNDS, PICARD_PART = 50, 0.1
"""Picard iterations in which the heat of a panel and the temperatures must agree, within this part of the tolerance;
otherwise the panel is halved, which weakens the feedback until they do.
"""


class JumpHeat:
    """The nodes that take the heat of jumps."""

    def __init__(self, system: System) -> None:
        self.system = system
        self.interface = list(system.sinks).index(INTERFACE)

    @cached_property
    def nodes(self) -> dict[str, Sink]:
        """All nodes that take heat of jumps, by name."""
        return {sink.node: sink for sinks in self.system.sinks.values() for sink in sinks}

    @cached_property
    def free(self) -> list[int]:
        """Columns among the inputs of the temperatures that heat raises."""
        return [1 + self.system.state_columns[sink.node] for sink in self.nodes.values() if not sink.prescribed]

    @cached_property
    def node_values(self) -> Function:
        """Temperature, energy and capacity of each node, and its share of the heat from each source."""
        shares = [{s.node: s.share for s in sinks} for sinks in self.system.sinks.values()]
        columns = [
            item
            for name, s in self.nodes.items()
            for item in (s.T, s.energy, derivative(s.energy, s.T), *(share.get(name, 0) for share in shares))
        ]
        return compiled(self.system, columns)

    def at(self, rows: Array) -> tuple[Array, Array, Array, Array]:
        """Return temperature, energy and capacity of each node, shape (rows, nodes), and its shares by source."""
        values = self.node_values(rows).reshape(len(rows), len(self.nodes), -1)
        return values[:, :, 0], values[:, :, 1], values[:, :, 2], values[:, :, 3:]

    @cached_property
    def reservoirs(self) -> Mask:
        """Mask of the nodes that pass on the heat that they take."""
        return np.array([node.prescribed for node in self.nodes.values()], dtype=bool)

    def distributed(self, rows: Array, by_source: Array, shares: Array | None) -> tuple[Array, Array, Array]:
        """Return inputs after the nodes have taken the heat, the heat that each takes, and its temperature before.

        The last two have shape (rows, nodes). ``by_source`` has a column for each source, friction last: its heat is
        distributed by the ``shares`` along the path if these are known, else as the interface shares it at the end.
        """
        T, U, C, parts = self.at(rows)
        rubbed = parts[:, :, self.interface] if shares is None else shares
        taken = np.einsum("ijk,ik->ij", parts, by_source[:, :-1]) + rubbed * by_source[:, -1:]
        return self._with_energy(rows, U + taken, U, C), taken, T

    def with_heat(self, rows: Array, taken: Array) -> Array:
        """Return inputs with the temperatures of the nodes after each has taken its heat, shape (rows, nodes)."""
        _, U, C, _ = self.at(rows)
        return self._with_energy(rows, U + taken, U, C)

    def _with_energy(self, rows: Array, target: Array, U: Array, C: Array) -> Array:
        """Solve for the temperatures at which the nodes have these target energies, shape (rows, nodes)."""
        free = list(zip([j for j, s in enumerate(self.nodes.values()) if not s.prescribed], self.free, strict=True))
        rows, left = rows.copy(), np.arange(len(rows))
        # Each row stops when it has converged, so that its result does not depend on the others.
        for _ in range(HEAT_STEPS if free else 0):
            changes = np.zeros(len(left), dtype=bool)
            for j, column in free:
                T = rows[left, column]
                with np.errstate(over="ignore", invalid="ignore"):  # trial values far away may not be finite
                    change = (target[left, j] - U[:, j]) / C[:, j]
                moved = T + change
                changes |= np.abs(change) > ULPS * np.abs(T)
                # A body without a minimum of energy above T = 0 lets Newton's method run out below it.
                rows[left, column] = np.where(moved > 0, moved, np.nan)
            left = left[changes]
            if not len(left):
                break
            _, U, C, _ = self.at(rows[left])
        return rows


@dataclass
class LoadStep:
    """A jump of loads at one moment."""

    before: Point
    reached: float = 0.0
    """Part of the path at which the last edge of this moment is carried out."""

    def levels(self, system: System, after: Point) -> Array:
        """Return the change of each parameter as the loads jump."""
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
    """Return a point after a load jump with the loads at a part of their path."""
    return point._replace(parameters=point.parameters - (1 - part) * change)


@cache
def _panel(degree: int) -> tuple[Array, Array]:
    """Return the nodes of a panel from 0 to 1, and the integrals of f dg up to each, for nodal values of both."""
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


def shared_heat(moments: Moments, n_nodes: int, small: float, *, feeds_back: bool) -> Array:
    """Return the heat that each node has taken along a path from 0 to 1, shape (n_nodes,).

    Panels are halved until the integrals of their polynomials and those of half the degree agree within the heat
    ``small``. Shares that add up to one conserve the heat on any panels.
    """
    (points, integrals), (_, coarse) = _panel(PANEL_DEGREE), _panel(PANEL_DEGREE // 2)
    taken, begin, width, panels = np.zeros(n_nodes), 0.0, 1.0, 0
    while begin < 1.0:
        panels += 1
        up_to = np.repeat(taken[None], len(points), axis=0)
        for _ in range(PICARD_ROUNDS if feeds_back else 1):
            heat, shares = moments(begin + width * points, up_to)
            last, up_to = up_to, taken + np.einsum("ifg,fk,g->ik", integrals, shares, heat)
            agrees = not feeds_back or np.max(np.abs(up_to - last)) <= PICARD_PART * small
            if agrees:
                break
        if not np.all(np.isfinite(up_to)):
            return np.full(n_nodes, np.nan)
        half = np.einsum("fg,fk,g->k", coarse[-1], shares[::2], heat[::2])
        close = agrees and np.max(np.abs(up_to[-1] - taken - half)) <= small
        if close or width <= NARROWEST or panels > QUADRATURE_PANELS:
            taken, begin = up_to[-1], begin + width
            width = min(2 * width, 1.0 - begin)
        else:
            width /= 2
    return taken


def _first(curve: Callable[[float], float], reached: float) -> float:
    """Return the part of the path beyond which a curve is negative, starting from a part already reached."""
    here, there = curve(reached), curve(1.0)
    if not here > 0:
        return reached
    return zero(curve, (reached, 1.0), (here, there)) if there < 0 else 1.0


class LoadPath:
    """The path of the sliding gaps as loads jump."""

    def __init__(self, equilibria: Equilibria, heat: JumpHeat, energy: Function, moved: list[int]) -> None:
        self.system, self.equilibria, self.heat, self.energy = equilibria.system, equilibria, heat, energy
        self.moved = moved
        """Columns among the inputs of the states that move along the interface."""

    @cached_property
    def varies(self) -> bool:
        """True if the shares of frictional heat change as loads jump."""
        fixed = {p.symbol for p in self.system.parameters if p.load is None}
        shares = [self.system.expand(sink.share) for sink in self.system.sinks[INTERFACE]]
        return any(symengine.sympify(share).free_symbols - fixed for share in shares)

    @cached_property
    def warms_itself(self) -> bool:
        """True if friction or the shares of its heat depend on the temperatures that this heat raises."""
        hot = {symengine.Symbol(name) for name in self.heat.nodes}
        expressions = [e.residual for e in self.equilibria.items] + [s.share for s in self.system.sinks[INTERFACE]]
        return any(self.system.expand(x).free_symbols & hot for x in expressions)

    _guards = formulas(lambda self: (edge.guard for edge in self.system.edges))

    def reach(self, index: int, step: LoadStep, before: Point) -> None:
        """Advance along the path of the loads to where an edge that follows from them is carried out."""
        if self.equilibria.slip is None or not self.varies or self.system.edges[index].times:
            return
        change = step.levels(self.system, before)

        def guard(part: float) -> float:
            loaded = at_part(before, change, part)
            held = self._held(loaded, np.abs(before.y - step.before.y))
            return float(self._guards(held._replace(parameters=loaded.parameters).inputs())[index])

        step.reached = _first(guard, step.reached)

    def shares(self, step: LoadStep, start: Point, after: Point, broken: float, small: float) -> Array | None:
        """Return the shares of a jump's frictional heat, shape (nodes,), up to heat that is ``small``.

        It begins with the heat of bonds that are ``broken`` as sliding begins. The sliding gap is at each place when
        the loads reach the first part of their path that drives it on there, warmed by the frictional heat so far, with
        everything else in equilibrium at that part.
        """
        change = step.levels(self.system, after)
        j, line, length = self._slip_direction(start, after)
        slip = 0.0 if self.equilibria.slip is None else float(after.parameters[self.equilibria.slip])
        span = np.abs(after.y - step.before.y)
        columns, onward = np.array(self.moved) - 1, float(np.sign(length))

        def moment(place: float, floor: float, taken: Array) -> tuple[float, float, Array]:
            """Return the part of the load path at a place, at least that before it, and energy and shares there."""
            y = start.y.copy()
            y[columns] += place * length * line
            there = start._replace(y=y, parameters=after.parameters)

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
                return -onward * float(self.equilibria.driving(at(part))[0, j])

            part = _first(resists, floor)
            row, here = at(part), after.inputs()
            here[self.moved] = row[0, self.moved]
            return part, float(self.energy(here)[0]), self.heat.at(row)[3][0, :, self.heat.interface]

        level = after.inputs()
        level[self.moved] = start.inputs()[self.moved]
        begun, begin, shares = moment(0.0, step.reached, np.zeros(len(self.heat.nodes)))
        at_once = (broken + float(self.energy(level)[0]) - begin) * shares
        reached = {0.0: begun}  # at ends of panels: where less load is needed, the part already reached holds

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
        """Return the point in equilibrium with sliding stuck; unchanged if there is none."""
        stuck = self.equilibria.with_slip(point, 0.0)
        return self.equilibria.equilibrate_near(stuck, warm, span) or stuck

    def _slip_direction(self, start: Point, after: Point) -> tuple[int, Array, float]:
        """Return the index of the sliding gap, the change of the states that move along the interface with it by
        itself, and its distance.
        """
        found, columns = self.equilibria, np.array(self.moved) - 1
        j = next(j for j, e in enumerate(found.items) if e.slip)
        others = [k for k, column in enumerate(found.columns) if k != j and 1 + column in self.moved]
        changes = found.changes(found.with_slip(after, 0.0))[[j, *others]][:, columns]
        return j, changes[0], float(np.linalg.lstsq(changes.T, (after.y - start.y)[columns], rcond=None)[0][0])
