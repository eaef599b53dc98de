"""Jumps of the state along an edge: reset, new equilibrium, distribution of heat, second law, ledger.

Energy is conserved in each: its decrease becomes heat. Source: lumped form of the balances across a jump; Sauer, Duong
& Mandadapu (2021), section 6.3, for sudden debonding.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import symengine

from surfacechem.compile.program import Function, compile_function
from surfacechem.expressions import magnitude
from surfacechem.model.automaton import INTERFACE, REST_TIME_PATH, Edge
from surfacechem.model.balances import elastic_energy
from surfacechem.model.system import START, System
from surfacechem.quantities import VELOCITIES
from surfacechem.solve.contract import Array, EdgeTables, Index
from surfacechem.solve.equilibria import BALANCED, Equilibria, FoldPoint, Folds, Point, compiled, formulas, rate_of
from surfacechem.solve.jump_heat import JumpHeat, LoadPath, LoadStep
from surfacechem.solve.radau.stepper import BONDS, ENTROPY_OUT, HEAT_OUT, NOT_BOOKED, PRODUCED, RELEASED, WORK
from surfacechem.tolerances import FEW_EPS, GAP_EPS, RUN_EPS

ADMISSIBLE, VIOLATES, IMPOSSIBLE = "admissible", "destroys entropy", "impossible"

NO_REST = "no gap follows at which the tractions are in equilibrium; with a mass or a damper it would move on"
NO_DOMAIN = "no gap follows at which the tractions are in equilibrium and the laws hold"
NO_HEAT = "it would take more heat than there is"
NO_ENERGY = "the energy of the interface is not finite after it"
NO_SHARES = "where the sliding ends and who takes its heat do not agree; with a damper it would take its time"

SHARE_ROUNDS = 20
"""Rounds in which the end of a slip and the shares of its heat have to agree, if each depends on the other: every round
adds a digit or more where they converge at all.
"""


class EdgeUncertainty(NamedTuple):
    """Uncertainty of an edge at its moment."""

    noise: float = 0.0
    """Roundoff of its guard."""
    drift: float = 0.0
    """Drift of its guard that the integration may have caused."""
    balanced: float = BALANCED
    """Residual of the tractions that the integration may leave, relative to their terms."""
    friction_noise: float = 0.0
    """Roundoff of the margin between friction limit and traction [Pa]."""
    rtol: float = 0.0
    """Relative tolerance of the run, for what is found along the path of a jump."""


@dataclass(frozen=True)
class Jump:
    """Record of a jump along an edge."""

    t: float
    edge: Edge
    before: Point
    after: Point
    released: float
    """Energy turned into heat [J/m^2]."""
    entropy: float
    """Entropy produced [J/(m^2 K)], including that of the heat passed to reservoirs."""
    verdict: str
    since: float = 0.0
    """Time since the last edge [s], more accurate than the difference of their times late in a run."""
    work: Mapping[str, float] = field(default_factory=dict)
    """Work of the far-field tractions [J/m^2], by account."""
    obstacle: str = ""
    """Reason why the jump is impossible, if it is."""
    heat_out: float = 0.0
    """Heat passed to prescribed temperatures [J/m^2]."""
    entropy_out: float = 0.0

    @property
    def stops(self) -> bool:
        """True if the run cannot, or may not, go on."""
        return self.verdict == IMPOSSIBLE or (self.verdict == VIOLATES and self.edge.violation == "refuse")


def velocity_scales(system: System) -> Array:
    """Return the scales of the velocities among the states, zero for the other states."""
    return np.array([state.size * (state.name in VELOCITIES) for state in system.states])


def _integers(rows: Sequence[Any], *shape: int) -> Index:
    return np.array(rows, np.int64).reshape(shape)


_ONE_THREAD = threading.RLock()


class ImpossibleError(Exception):
    """A jump has no end state; the message is the reason."""


@dataclass(frozen=True)
class PendingJump:
    """A jump after the reset of modes and bonds, before gaps and temperatures follow."""

    index: int
    edge: Edge
    start: Point
    energy: float
    """Conserved energy before the jump; ``level`` is that after the reset [J/m^2]."""
    level: float
    fold: FoldPoint | None
    slack: EdgeUncertainty
    step: LoadStep | None
    """Loads that have jumped at this moment."""


class Jumper:
    """The jumps of a system, compiled on the first jump."""

    def __init__(self, system: System) -> None:
        self.system = system
        self.equilibria = Equilibria(system)
        self.folds = Folds(self.equilibria)
        self._jumps = False
        """True if jumps are expected, so that the functions only they need are worth compiling."""
        self._tables: EdgeTables | None = None
        memory = {item.symbol for item in system.discrete}
        kept = [p.symbol in memory or p.path == REST_TIME_PATH for p in system.parameters]
        self.mode_columns = [j for j, keep in enumerate(kept) if keep]

    # -- compiled functions of the inputs -------------------------------------------------------------------------

    @cached_property
    def magnitudes(self) -> Function:
        """Running error bounds of limits and guards, as functions of inputs and peaks of the states; one a model."""
        peaks = [symengine.Symbol(f"peak of {state.name}") for state in self.system.states]
        return compile_function([*self.system.inputs, *peaks], self._bounds(peaks))

    @cached_property
    def first_magnitudes(self) -> Function:
        """The same as functions of the inputs at a start, where the peaks are those of the states alone."""
        sizes = zip(self.system.states, velocity_scales(self.system).tolist(), strict=True)
        peaks = [symengine.Max(size, symengine.Abs(state.symbol)) for state, size in sizes]
        return compile_function(self.system.inputs, self._bounds(peaks), steps=True)

    def _bounds(self, peaks: list[symengine.Expr]) -> list[symengine.Expr]:
        system = self.system
        known = dict(zip((state.symbol for state in system.states), peaks, strict=True))
        # A rate is known to the roundoff of its state, divided by the time that has passed.
        known |= {state.dot: peak / system.t for state, peak in zip(system.states, peaks, strict=True)}
        guards = [m.expression for m in system.event_margins] + [edge.guard for edge in system.edges]
        return [magnitude(system.expand(guard), known) for guard in guards]

    times_of_return = formulas(lambda self: (e.return_time for e in self.system.edges if e.return_time is not None))
    """Times of flight [s] of rebounds."""
    guard_rates = formulas(lambda self: (rate_of(self.system, edge.guard) for edge in self.system.edges))
    """Time derivatives of the guards of the edges, at consistent inputs."""
    _energy = formulas(lambda self: [self.system.jump_energy])
    """Energy that a jump conserves; compiled separately, as a search evaluates it at many rows."""
    _far_fields = formulas(lambda self: (item for pull in self.system.far_fields.values() for item in pull))
    """Stiffness, displacement and traction of the far field, and the gap, for each direction."""

    @cached_property
    def _resets(self) -> list[Function]:
        """Reset map of each edge: the new states, then the new modes and registers."""
        states = [state.symbol for state in self.system.states]
        modes = [self.system.parameters[j].symbol for j in self.mode_columns]
        return [
            compiled(self.system, [*(edge.reset.get(x, x) for x in states), *(edge.modes.get(m, m) for m in modes)])
            for edge in self.system.edges
        ]

    @cached_property
    def guards_read_rates(self) -> bool:
        """True if guards depend on rates, or on algebraic variables that are found with them."""
        states = self.system.states
        guards = [*(edge.guard for edge in self.system.edges), *(margin.expression for margin in self.system.margins)]
        read = set().union(*(self.system.expand(guard).free_symbols for guard in guards))
        return any(state.algebraic or state.dot in read for state in states)

    @cached_property
    def _total_functions(self) -> Function:
        """Energy that a jump conserves, total entropy, and potentials of the far-field tractions; then the magnitudes
        of the first two. A call costs more than the evaluation, so all are in one function.
        """
        system = self.system
        totals = [system.jump_energy, system.find("S_total").expression]
        return compiled(system, [*totals, *system.far_work.values(), *(magnitude(system.expand(x)) for x in totals)])

    def _totals(self, rows: Array) -> Array:
        """Return the totals at arguments of compiled functions; infinite magnitudes, as at a bound, count as zero."""
        found = self._total_functions(rows)
        found[..., -2:] = np.where(np.isfinite(found[..., -2:]), found[..., -2:], 0.0)
        return found

    def _far_field(self, point: Point) -> Array:
        """Return stiffness, displacement, traction and gap, each by direction, shape (4, directions)."""
        return np.asarray(self._far_fields(point.inputs()).reshape(-1, 4).T)

    @cached_property
    def _ends(self) -> list[tuple[str, Function]]:
        """Limits of the laws' domains that depend on quasi-static gaps, each with its reason."""
        moved = {e.state for e in self.system.equilibria}
        gaps = {state.symbol for state in self.system.states if state.name in moved}
        ends = [m for m in self.system.margins if m.domain and self.system.expand(m.expression).free_symbols & gaps]
        return [(m.reason, compiled(self.system, [m.expression])) for m in ends]

    @cached_property
    def _heat(self) -> JumpHeat:
        return JumpHeat(self.system)

    @cached_property
    def _load_path(self) -> LoadPath:
        moved = next((columns for axis, columns in self._stages if axis != "n"), [])
        return LoadPath(self.equilibria, self._heat, self._energy, moved)

    @cached_property
    def _stages(self) -> list[tuple[str, list[int]]]:
        """Axes along which gaps move in a jump, the normal first, and the columns of their states."""
        moved: dict[str, set[str]] = {}
        for e in sorted(self.system.equilibria, key=lambda e: e.axis):
            moved.setdefault(e.axis, set()).update((e.state, *e.coupled))
        if "n" in moved:
            moved["n"].update(self.system.followers)
        return [(axis, [1 + self.system.state_columns[name] for name in names]) for axis, names in moved.items()]

    # -- tables for the compiled loop -----------------------------------------------------------------------------

    @property
    def edge_tables(self) -> EdgeTables:
        """Tables of the edges for the compiled loop; functions that only jumps need once jumps are expected."""
        with _ONE_THREAD:
            if self._tables:
                return self._tables
            system, nodes = self.system, list(self._heat.nodes.values()) if self.system.edges else []
            functions: list[Function | None] = [self.magnitudes, *[None] * (4 + len(system.edges))]
            if self._jumps and system.edges:
                node_values = self._heat.node_values if nodes else None
                functions[1:] = (
                    self.guard_rates,
                    self._total_functions,
                    node_values,
                    self.times_of_return,
                    *self._resets,
                )
            starts = [j for j, p in enumerate(system.parameters) if p.path == START]
            reset = len(system.states) + len(self.mode_columns)
            self._tables = EdgeTables(
                sizes=_integers((4 + len(system.far_work), len(nodes) * (3 + len(system.sinks)), reset), 3),
                code=_integers([(f.address, f.user) if f else (0, 0) for f in functions], -1, 2),
                edges=_integers([self._row(edge) for edge in system.edges], -1, 5),
                when=_integers(system.guard_conditions, -1, 3),
                held=_integers(self.mode_columns, -1),
                clocks=_integers([*starts, *system.origins], -1),
                nodes=_integers([-1 if node.prescribed else system.state_columns[node.node] for node in nodes], -1),
                accounts=_integers(self._accounts, -1, 2),
                least_peaks=velocity_scales(system),
            )
            return self._tables

    def _row(self, edge: Edge) -> tuple[int, int, bool, int, bool]:
        """Return a row of the table of edges."""
        returns = [item for item in self.system.edges if item.return_time is not None]
        source = self._first_source(edge)
        return (
            self.system.state_columns[edge.measure] if edge.measure else -1,
            list(self.system.sinks).index(INTERFACE) if source < 0 else source,
            edge.violation == "refuse",
            next((k for k, item in enumerate(returns) if item is edge), -1),
            edge.rests,
        )

    def expect_jumps(self) -> bool:
        """Have the functions compiled that only jumps need; True if they were not before."""
        with _ONE_THREAD:
            before, self._jumps = self._jumps, True
            self._tables = self._tables if before else None
        return not before

    @cached_property
    def _accounts(self) -> list[tuple[int, int]]:
        """Kind of each account in jumps, and its index among states or totals."""
        given, found = list(self.system.far_work), []
        sums = {"dissipation": RELEASED, "entropy production": PRODUCED, "energy supply": HEAT_OUT}
        for account in self.system.ledger:
            name = account.quantity.name
            if account.kind == "bonds":
                found.append((BONDS, self.system.state_columns[account.law]))
            elif account.law == "events":
                found.append((sums.get(account.kind, ENTROPY_OUT), 0))
            else:
                found.append((WORK, 2 + given.index(name)) if name in given else (NOT_BOOKED, 0))
        return found

    def ledger_change(self, jump: Jump) -> Array:
        """Return the amounts that a jump adds to the accounts of the ledger."""
        changes = jump.after.y - jump.before.y
        sums = {RELEASED: jump.released, PRODUCED: jump.entropy}
        sums |= {HEAT_OUT: -jump.heat_out, ENTROPY_OUT: -jump.entropy_out}
        amounts = []
        for account, (kind, place) in zip(self.system.ledger, self._accounts, strict=True):
            # Jumping loads, and the last part before a fold, do work on other accounts too.
            work = jump.work.get(account.quantity.name, 0.0)
            amounts.append(changes[place] if kind == BONDS else sums.get(kind, work))
        return np.array(amounts)

    def carried_out(self, arcs: Array, rows: Array, start: float, end: float) -> list[Jump]:
        """Return the jumps that the compiled loop has carried out between these times, from its rows."""
        edges, given, found, last = self.system.edges, list(self.system.far_work), [], start
        columns = 7 + len(given)
        width = (rows.shape[1] - columns) // 2
        for row, numbers in zip(rows, rows[:, :columns].tolist(), strict=True):
            index, arc, released, gain, heat, entropy, admissible, *work = numbers
            point, after = (Point.of(row[k : k + width], len(self.system.states)) for k in (columns, columns + width))
            began, length = arcs[int(arc) - 1, :2].tolist() if arc else (math.nan, 0.0)
            # The length of the last arc is more accurate than the difference of two times.
            since = length + (point.t - min(began + length, end)) if began == last else point.t - last
            verdict, done = ADMISSIBLE if admissible else VIOLATES, dict(zip(given, work, strict=True))
            found.append(
                Jump(point.t, edges[int(index)], point, after, released, gain, verdict, since, done, "", heat, entropy)
            )
            last = point.t
        return found

    # -- questions of an Instant ----------------------------------------------------------------------------------

    def modes_after(self, index: int, point: Point) -> Array:
        """Return the modes and registers that an edge sets."""
        return self._resets[index](point.inputs())[len(point.y) :]

    def is_loaded(self, before: Point, point: Point) -> bool:
        """True if a jump of the loads does work or changes the balance of tractions."""
        if self.equilibria.items:
            (last, sizes), (now, _) = self.equilibria.balance(before), self.equilibria.balance(point)
            if np.any(np.abs(now - last) > BALANCED * sizes):
                return True
        if not self.system.far_fields:
            return False
        old, new = self._far_field(before), self._far_field(point)
        return not np.allclose(old[[1, 3]], new[[1, 3]], rtol=BALANCED, atol=GAP_EPS)

    # -- a jump, step by step -------------------------------------------------------------------------------------

    def make(
        self,
        index: int,
        before: Point,
        since: float,
        slack: EdgeUncertainty,
        last: Point | None = None,
        step: LoadStep | None = None,
    ) -> Jump:
        """Carry out an edge, ``since`` seconds after the last one.

        ``last`` is the state before loads jump, or where the integration ended close to a fold; ``step`` are the loads
        that have jumped at this moment.
        """
        edge, fold = self.system.edges[index], self.folds.at(index, before)
        before, start = self._reset(index, before if fold is None else fold.point, fold)
        jump = Jump(before.t, edge, before, start, 0.0, 0.0, IMPOSSIBLE, since)
        level = float(self._totals(start.inputs())[0])
        if not np.isfinite(level):
            return replace(jump, obstacle=NO_ENERGY)
        totals, lift = self._totals_before(edge, before, last)
        pending = PendingJump(index, edge, start, float(totals[0]), level, fold, slack, step)
        if step is not None:
            self._load_path.reach(index, step, before)
        try:
            rest, shares = self._equilibrated(pending) if edge.equilibrates else (start, None)
            after, released, heat_out, entropy_out = self._heated(rest, pending, shares)
        except ImpossibleError as obstacle:
            return replace(jump, obstacle=str(obstacle))
        # Friction never pulls a gap back: it sticks.
        if edge.equilibrates and self.equilibria.would_reverse(after, slack.balanced, slack.friction_noise):
            after = self.equilibria.with_slip(after, 0.0)
        gain, admissible, done = self._judged(edge, before.inputs(), after.inputs(), totals, slack.noise, entropy_out)
        verdict = ADMISSIBLE if admissible else VIOLATES
        work = lift | {name: lift.get(name, 0.0) + more for name, more in done.items()}
        return Jump(before.t, edge, before, after, released, gain, verdict, since, work, "", heat_out, entropy_out)

    def _reset(self, index: int, before: Point, fold: FoldPoint | None) -> tuple[Point, Point]:
        """Return the point before a jump, and the point after the reset map of the edge."""
        slip, n = self.equilibria.slip, len(before.y)
        values = self._resets[index](before.inputs())
        if slip is not None and before.parameters[slip] and not values[n + self.mode_columns.index(slip)]:
            # The remaining residual of the integration would act as a driving traction on the sticking interface.
            before = self.equilibria.corrected(before)
            values = self._resets[index](before.inputs())
        parameters = before.parameters.copy()
        parameters[self.mode_columns] = values[n:]
        if self.system.edges[index].fold is not None and fold is None and slip is not None:
            parameters[slip] = 0.0  # no steady sliding, and nothing drives it
        return before, Point(before.t, values[:n], np.zeros(n), parameters)

    def _totals_before(self, edge: Edge, before: Point, last: Point | None) -> tuple[Array, dict[str, float]]:
        """Return the totals before a jump, and the work up to there that the integration does not include.

        It is the work of far-field displacements that jump before anything moves, and that between the end of the
        integration and a fold.
        """
        if last is None or not (edge.times or edge.fold):
            return self._totals(before.inputs()), {}
        totals = self._totals((last if edge.times else before).inputs())
        # The heat of the jump counts from the end of the integration. Free nodes are already at the fold, with the heat
        # of the last part in their temperatures; reservoirs have not received theirs yet.
        missing_heat = edge.fold and not self._heat.free
        if missing_heat:
            totals[:2] = self._totals(last.inputs())[:2]
        if not self.system.far_fields:
            return totals, {}
        (k, w, F, g), (_, w_new, F_new, g_new) = self._far_field(last), self._far_field(before)
        if edge.fold:
            middle = (g_new + g) / 2
            lift = elastic_energy(k, w_new, middle) - elastic_energy(k, w, middle)
            totals[0] += missing_heat * np.sum(lift + (F - F_new) * middle)
            pull_work = lift + (F_new + F) / 2 * (g_new - g)
            return totals, dict(zip(self.system.far_fields, pull_work.tolist(), strict=True))
        lift = elastic_energy(k, w_new, g) - elastic_energy(k, w, g)
        totals[0] += np.sum(lift) + np.sum((F - F_new) * g)
        accounts = list(self.system.far_fields)
        for j, name in enumerate(self.system.far_work, start=2):
            totals[j] = (F_new * g)[accounts.index(name)] if name in accounts else totals[j]
        return totals, dict(zip(accounts, lift.tolist(), strict=True))

    def _equilibrated(self, pending: PendingJump) -> tuple[Point, Array | None]:
        """Return the point at which the gaps come to rest, and the shares of frictional heat if its path matters."""
        shares: Array | None = None
        for _ in range(SHARE_ROUNDS):
            after = self._kept(pending, self._gaps_at_rest(pending, shares))
            found = self._path_shares(pending, after)
            agreed = found is None or (
                shares is not None and np.allclose(found, shares, rtol=0.0, atol=pending.slack.rtol)
            )
            shares = found
            if agreed or not self._load_path.warms_itself:
                break
        else:
            raise ImpossibleError(NO_SHARES)
        # Touch does not move gaps; any other jump may leave the domain of a law.
        closed = [] if pending.edge.measure else [why for why, end in self._ends if not end(after.inputs())[0] > 0]
        if closed:
            raise ImpossibleError(f"{NO_DOMAIN}: {closed[0]}")
        return after, shares

    def _kept(self, pending: PendingJump, after: Point | None) -> Point:
        """Return the end of a jump, with the modes set by the edge if its measured state has not moved."""
        if after is None:
            raise ImpossibleError(NO_REST)
        edge, slack, slip = pending.edge, pending.slack, self.equilibria.slip
        if not edge.measure or pending.fold is not None:
            return after
        if abs(after.y[self.system.state_columns[edge.measure]]) > max(slack.noise, slack.drift):
            return after
        sliding = 0.0 if slip is None else after.parameters[slip]
        return self.equilibria.with_slip(after._replace(parameters=pending.start.parameters), sliding)

    def _gaps_at_rest(self, pending: PendingJump, shares: Array | None) -> Point | None:
        """Return the point at which the gaps come to rest, sliding or sticking: friction never pulls sliding back."""

        def heat(rows: Array) -> Array:
            return self._heat.distributed(rows, self._heat_by_source(rows, pending), shares)[0]

        found, start, fold = self.equilibria, pending.start, pending.fold
        slip = 0.0 if found.slip is None else start.parameters[found.slip]
        if not slip:
            # At touch only the integration has left a residual: what is unstable there moves off.
            balanced = pending.slack.balanced if pending.edge.measure else BALANCED
            return found.equilibrate(start, heat, balanced, fold)
        stuck = None if fold is None else self.folds.held_at(pending.index, fold)
        trial = found.equilibrate(found.with_slip(start, 0.0), heat, lost=stuck)
        if trial is None:
            return None
        onward = found.with_slip(trial, slip)
        if found.would_reverse(onward, pending.slack.balanced, pending.slack.friction_noise, heat):
            return trial
        # Where sticking preserves the equilibrium, only that of sliding is lost.
        return found.equilibrate(onward, heat, pending.slack.balanced, lost=fold if stuck is None else None)

    def _path_shares(self, pending: PendingJump, after: Point) -> Array | None:
        """Return the shares of the frictional heat along the path of jumping loads; None if it does not matter."""
        step, edge = pending.step, pending.edge
        slip, path = self.equilibria.slip, self._load_path
        if step is None or edge.heat == "snap" or slip is None or not after.parameters[slip] or not path.varies:
            return None
        frictional = float(self._heat_by_source(after.inputs()[None], pending)[0, -1])
        small = FEW_EPS * max(float(self._totals(after.inputs())[-2]), abs(pending.energy))
        if not frictional > small:
            return None
        broken = pending.energy - pending.level if edge.heat == "local" else 0.0
        return path.shares(step, pending.start, after, broken, pending.slack.rtol * frictional + small)

    def _heat_by_source(self, rows: Array, pending: PendingJump) -> Array:
        """Return the heat of a jump to each of the rows [J/m^2] by source, shape (rows, sources + 1).

        Friction is last, with the bonds that it breaks. The energy falls in the reset, then as gaps follow, axis by
        axis: friction prevents sliding until the normal gap has arrived.
        """
        edge, start = pending.edge, pending.start
        by_source = np.zeros((len(rows), len(self.system.sinks) + 1))

        by_source[:, self._first_source(edge)] += pending.energy - pending.level
        parameters = 1 + 2 * len(start.y)
        here = np.repeat(start.inputs()[None], len(rows), axis=0)
        here[:, parameters:] = rows[:, parameters:]
        slip, lost = self.equilibria.slip, self.equilibria.followers
        level = np.full(len(rows), pending.level)
        for axis, columns in self._stages:
            here[:, columns] = rows[:, columns]
            now = self._energy(here)[:, 0]
            if axis == "n":  # the interface makes heat where bonds break, or where it slides
                gives = np.any(rows[:, lost] != start.inputs()[lost], axis=1)
            else:
                gives = rows[:, parameters + slip] != 0 if slip is not None else np.zeros(len(rows), dtype=bool)
            with np.errstate(invalid="ignore"):  # trial values far away may not be finite
                fall = level - now
            by_source[~gives, self._source(edge, axis)] += fall[~gives]
            by_source[gives, self._source(edge, INTERFACE) if axis == "n" else -1] += fall[gives]
            level = now
        return by_source

    def _source(self, edge: Edge, axis: str) -> int:
        """Return the column of the source that makes the heat along an axis."""
        sources = list(self.system.sinks)
        return sources.index(axis if axis in sources and edge.heat != "snap" else INTERFACE)

    def _first_source(self, edge: Edge) -> int:
        """Return the source of the energy released before gaps move; the last one, friction, if it is local."""
        return -1 if edge.heat == "local" else self._source(edge, "n" if edge.heat == "joint" else INTERFACE)

    def _heated(self, point: Point, pending: PendingJump, shares: Array | None) -> tuple[Point, float, float, float]:
        """Return the point with the heat in its nodes; energy released, heat and entropy passed to reservoirs.

        Heat that is negligible compared with the energy before the jump counts as zero.
        """
        rows = point.inputs()[None]
        by_source = self._heat_by_source(rows, pending)
        small = FEW_EPS * max(float(self._totals(rows[0])[-2]), abs(pending.energy))
        by_source[np.abs(by_source) <= small] = 0.0
        released, heat, entropy = float(by_source.sum()), 0.0, 0.0
        if by_source.any():
            rows, taken, T = self._heat.distributed(rows, by_source, shares)
            out = self._heat.reservoirs
            heat, entropy = float(taken[:, out].sum()), float((taken / T)[:, out].sum())
        if not np.all(np.isfinite(rows)):  # nodes cannot take the heat
            raise ImpossibleError(NO_HEAT)
        return point._replace(y=rows[0, 1 : 1 + len(point.y)]), released, heat, entropy

    def _judged(
        self, edge: Edge, before: Array, after: Array, totals: Array, noise: float, entropy_out: float
    ) -> tuple[float, bool, dict[str, float]]:
        """Return the entropy that a jump between these inputs produces, the second law's verdict, and the work done.

        Negative production is tolerated up to roundoff, and up to the effect of the guard's ``noise`` on entropy and on
        energy, the latter as heat at the temperature of the coldest node.
        """
        perturbed = before.copy()
        if edge.measure:
            perturbed[1 + self.system.state_columns[edge.measure]] += noise
        now, still, moved = self._totals(np.stack([after, before, perturbed]))
        gain = float(now[1] - totals[1] + entropy_out)
        small = RUN_EPS * max(abs(totals[1]), abs(now[1]), abs(entropy_out))
        small += FEW_EPS * still[-1] + abs(moved[1] - still[1])
        if self._heat.nodes:
            small += abs(moved[0] - still[0]) / self._heat.at(before[None])[0].min()
        work = (now[2:-2] - totals[2:-2]).tolist()
        return gain, bool(gain >= -small), dict(zip(self.system.far_work, work, strict=True))
