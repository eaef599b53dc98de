"""Jumps of the state at a transition: energy is conserved, entropy is tested, gaps find their next equilibrium.

Source: lumped form of the balances across a jump; Sauer, Duong & Mandadapu (2021), section 6.3, for sudden debonding.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from surfacechem.compile.program import Function, Program, compile_function
from surfacechem.expressions import Expression, derivative
from surfacechem.model.automaton import INTERFACE, RESTS, Edge
from surfacechem.model.springs import stored
from surfacechem.model.system import Account, System
from surfacechem.solve.branches import Domain
from surfacechem.solve.equilibria import ATOM, BALANCED, Equilibria, Heat, Lost, Point
from surfacechem.solve.jump_heat import JumpHeat
from surfacechem.solve.load_path import LoadPath, LoadStep

Array = NDArray[np.float64]

ADMISSIBLE, VIOLATES, IMPOSSIBLE = "admissible", "destroys entropy", "impossible"

NO_REST = "no gap follows at which the tractions are in equilibrium; with a mass or a damper it would move on"
NO_DOMAIN = "no gap follows at which the tractions are in equilibrium and the laws hold"
NO_HEAT = "it would take more heat than there is"
NO_ENERGY = "the energy of the interface is not finite after it"

ROUNDING = 1e-12
"""Entropy that counts as none, relative to the entropies that change."""

DIGITS = 4 * float(np.finfo(float).eps)
"""Last digits of a number."""

ROUNDS = 20
"""Rounds in which the end of a slip and the shares of its heat agree, where the one depends on the other."""


@dataclass(frozen=True)
class Jump:
    """What happened at a transition."""

    t: float
    edge: Edge
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
    obstacle: str = ""
    """Why it is impossible, where it is."""
    heat_out: float = 0.0
    """Heat passed to prescribed temperatures [J/m^2]."""
    entropy_out: float = 0.0

    @property
    def stops(self) -> bool:
        """Whether the run cannot, or may not, go on."""
        return self.verdict == IMPOSSIBLE or (self.verdict == VIOLATES and self.edge.violation == "refuse")


def booked(jump: Jump, account: Account, states: Sequence[str]) -> float:
    """What a jump adds to an account of the ledger; ``states`` are the names of the states in order."""
    if account.kind == "bonds":
        j = states.index(account.law)
        return float(jump.after.y[j] - jump.before.y[j])
    if account.law != "events":
        return jump.work.get(account.quantity.name, 0.0)
    amounts = {
        "dissipation": jump.released,
        "entropy production": jump.entropy,
        "energy supply": -jump.heat_out,
        "entropy supply": -jump.entropy_out,
    }
    return amounts[account.kind]


class Jumper:
    """The jumps of a system, compiled when the first one happens."""

    def __init__(self, system: System, program: Program) -> None:
        self.system = system
        self.states = [state.name for state in system.states]
        self.equilibria = Equilibria(system, program)
        memory = {item.symbol for item in system.memory}
        kept = [p.symbol in memory or p.path == RESTS for p in system.parameters]
        self.mode_columns = [j for j, keep in enumerate(kept) if keep]

    @cached_property
    def _maps(self) -> list[Function]:
        """For each transition the new states and the new modes."""
        system = self.system
        modes = [system.parameters[j].symbol for j in self.mode_columns]
        return [
            compile_function(
                system.inputs,
                [system.expand(item.reset.get(s.symbol, s.symbol)) for s in system.states]
                + [system.expand(item.modes.get(m, m)) for m in modes],
            )
            for item in system.edges
        ]

    def modes_after(self, index: int, point: Point) -> Array:
        """The modes that a transition sets."""
        return self._maps[index](point.inputs())[len(point.y) :]

    @cached_property
    def _moving_margins(self) -> list[Expression]:
        return [self.system.expand(edge.guard) for edge in self.system.edges]

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

    @cached_property
    def _energy(self) -> Function:
        """What a jump conserves."""
        return compile_function(self.system.inputs, [self.system.expand(self.system.jump_energy)])

    @cached_property
    def _heat(self) -> JumpHeat:
        return JumpHeat(self.system)

    @cached_property
    def _load_path(self) -> LoadPath:
        return LoadPath(self.system, self.equilibria, self._heat, self._energy, self._stages)

    @cached_property
    def _stages(self) -> list[tuple[str, list[int]]]:
        """The axes along which gaps move in a jump, and the columns of their states: the normal goes ahead."""
        moved: dict[str, set[str]] = {}
        for e in sorted(self.system.equilibria, key=lambda e: e.axis):
            moved.setdefault(e.axis, set()).update((e.state, *e.along))
        if "n" in moved:
            moved["n"].update(self.system.follows)
        return [(axis, [1 + self.states.index(name) for name in names]) for axis, names in moved.items()]

    def _made(self, rows: Array, item: Edge, start: Point, energy: float) -> Array:
        """Heat that a jump to each of the rows makes [J/m^2], by who makes it, shape (rows, makers + 1).

        Friction is last, with the bonds that it breaks.
        The energy falls as the state jumps, then as gaps follow, axis by axis: friction holds what would slide until
        the normal gap is where it goes to.
        """
        makers = list(self.system.sinks)
        made = np.zeros((len(rows), len(makers) + 1))

        def maker(axis: str) -> int:
            return makers.index(axis if axis in makers and item.heat != "snap" else INTERFACE)

        level = self._energy(start.inputs())[0]
        first = -1 if item.heat == "local" else maker("n" if item.heat == "joint" else INTERFACE)
        made[:, first] += energy - level
        here = np.repeat(start.inputs()[None], len(rows), axis=0)
        here[:, 1 + 2 * len(start.y) :] = rows[:, 1 + 2 * len(start.y) :]
        for axis, columns in self._stages:
            here[:, columns] = rows[:, columns]
            now = self._energy(here)[:, 0]
            gives = self._gives(axis, start, rows)
            with np.errstate(invalid="ignore"):  # far away from where it begins a search may see no number
                fall = level - now
            made[~gives, maker(axis)] += fall[~gives]
            made[gives, maker(INTERFACE) if axis == "n" else -1] += fall[gives]
            level = now
        return made

    def _gives(self, axis: str, start: Point, rows: Array) -> NDArray[np.bool_]:
        """Whether the interface gives way along an axis: it slides, or loses bonds."""
        slip, lost = self.equilibria.slip, self.equilibria.followers
        if axis == "n":
            return np.asarray(np.any(rows[:, lost] != start.inputs()[lost], axis=1))
        if slip is None:
            return np.zeros(len(rows), dtype=bool)
        return np.asarray(rows[:, 1 + 2 * len(self.states) + slip] != 0)

    def make(
        self,
        index: int,
        before: Point,
        since: float,
        noise: float = 0.0,
        drift: float = 0.0,
        balanced: float = BALANCED,
        last: Point | None = None,
        step: LoadStep | None = None,
        rtol: float = 0.0,
    ) -> Jump:
        """Carry out a transition, ``since`` the one before [s]; ``noise`` is what its margin rounds to, ``drift`` how
        far the integration may have carried it, and ``balanced`` the part of tractions by which it leaves them out of
        balance. ``last`` is the state before loads jump, or where the integration ended close to a fold. ``step`` are
        loads that have jumped at this moment; what their way decides is found within ``rtol``.
        """
        item = self.system.edges[index]
        lost = self.equilibria.at_fold(index, before) if item.fold is not None else None
        before = lost.point if lost is not None else before
        values = self._maps[index](before.inputs())
        if self._ends_sliding(before, values):
            # What the integration has left of the balance would look like a push to what sticks from here on.
            before = self.equilibria.polished(before)
            values = self._maps[index](before.inputs())
        n = len(before.y)
        parameters = before.parameters.copy()
        parameters[self.mode_columns] = values[n:]
        if item.fold is not None and lost is None and self.equilibria.slip is not None:
            parameters[self.equilibria.slip] = 0.0  # there is no steady sliding, and nothing pushes it on
        start = Point(before.t, values[:n], np.zeros(n), parameters)
        if not np.isfinite(self._books(start.inputs())[0]):
            return Jump(before.t, item, before, start, 0.0, 0.0, IMPOSSIBLE, since, obstacle=NO_ENERGY)
        books, lift = self._opened(item, before, last)
        energy = float(books[0])
        if step is not None:
            self._load_path.reach(index, step, before)
        after: Point | None = start
        shares: Array | None = None
        for _ in range(ROUNDS if item.equilibrates else 0):

            def heat(rows: Array, shares: Array | None = shares) -> Array:
                return self._heat.warmed(rows, self._made(rows, item, start, energy), shares)

            after = self._rested(index, start, lost, heat, balanced)
            after = after if lost is not None else self._kept(item, after, parameters, max(noise, drift))
            found = self._path_shares(step, item, start, after, energy, rtol)
            agreed = found is None or (shares is not None and np.allclose(found, shares, rtol=0.0, atol=rtol))
            shares = found
            if agreed or not self._load_path.warms_itself:
                break
        beyond = self._beyond(item, after)
        heated = self._heated(after, item, start, energy, shares) if after is not None and not beyond else None
        if heated is None:
            obstacle = f"{NO_DOMAIN}: {beyond}" if beyond else NO_REST if after is None else NO_HEAT
            return Jump(before.t, item, before, start, 0.0, 0.0, IMPOSSIBLE, since, obstacle=obstacle)
        final, released, out, taken = heated
        if item.equilibrates and self.equilibria.is_pushed_back(final, balanced):  # friction pulls nothing back
            final = self.equilibria.with_slip(final, 0.0)
        jump = Jump(
            before.t, item, before, final, released, taken, ADMISSIBLE, since, lift, heat_out=out, entropy_out=taken
        )
        return self._judged(jump, books, noise)

    def _ends_sliding(self, before: Point, values: Array) -> bool:
        """Whether the new modes ``values`` end with make what slides in balance stick."""
        slip = self.equilibria.slip
        if slip is None:
            return False
        return bool(before.parameters[slip]) and not values[len(before.y) + self.mode_columns.index(slip)]

    @cached_property
    def _pulls(self) -> Function:
        """Stiffness, displacement and traction of the far field, and the gap, for each direction."""
        items = [self.system.expand(item) for pull in self.system.pulls.values() for item in pull]
        return compile_function(self.system.inputs, items)

    def is_loaded(self, before: Point, point: Point) -> bool:
        """Whether a jump of the loads does work or sets anything in motion."""
        if self.equilibria.pushed(before, point) or not self.system.pulls:
            return self.equilibria.pushed(before, point)
        (_, *old), (_, *new) = (self._pulls(p.inputs()).reshape(-1, 4).T for p in (before, point))
        return not np.allclose([old[0], old[2]], [new[0], new[2]], rtol=BALANCED, atol=ATOM)

    def _opened(self, item: Edge, before: Point, last: Point | None) -> tuple[Array, dict[str, float]]:
        """The books before a jump, and the work up to there that the integration has not seen.

        That of far-field displacements that jump before anything moves, and that on the last of the way to a fold.
        """
        if last is None or not (item.times or item.fold):
            return self._books(before.inputs()), {}
        books = self._books((last if item.times else before).inputs())
        if not self.system.pulls:
            return books, {}
        (k, w, F, g), (_, w_new, F_new, g_new) = (self._pulls(p.inputs()).reshape(-1, 4).T for p in (last, before))
        if item.fold:
            middle = (g_new + g) / 2
            way = stored(k, w_new, middle) - stored(k, w, middle) + (F_new + F) / 2 * (g_new - g)
            return books, dict(zip(self.system.pulls, way.tolist(), strict=True))
        lift = stored(k, w_new, g) - stored(k, w, g)
        books[0] += np.sum(lift) + np.sum((F - F_new) * g)
        accounts = list(self.system.pulls)
        for j, name in enumerate(self.system.given, start=2):
            books[j] = (F_new * g)[accounts.index(name)] if name in accounts else books[j]
        return books, dict(zip(accounts, lift.tolist(), strict=True))

    def _rested(self, index: int, start: Point, lost: Lost | None, heat: Heat, balanced: float) -> Point | None:
        """Where the gaps come to rest. What slides may go on, or sticks: friction never pulls it back."""
        found = self.equilibria
        slip = 0.0 if found.slip is None else start.parameters[found.slip]
        if not slip:
            return found.let_go(lost, start.parameters, heat) if lost else found.settle(start, heat)
        stuck = None if lost is None else found.held_at(index, lost)
        at_rest = found.with_slip(start, 0.0)
        trial = found.let_go(stuck, at_rest.parameters, heat) if stuck else found.settle(at_rest, heat)
        if trial is None:
            return None
        onward = found.with_slip(trial, slip)
        if found.is_pushed_back(onward, balanced, heat):
            return trial
        if lost is not None and stuck is None:  # it is sliding that is lost
            return found.let_go(lost, onward.parameters, heat)
        return found.settle(onward, heat, balanced)

    def _path_shares(
        self, step: LoadStep | None, item: Edge, start: Point, after: Point | None, energy: float, rtol: float
    ) -> Array | None:
        """The shares by which the heat of friction is taken along the way of loads that jump, where that matters."""
        if step is None or after is None or item.heat == "snap" or not self._load_path.slides(start, after):
            return None
        made = float(self._made(after.inputs()[None], item, start, energy)[0, -1])
        broken = energy - float(self._energy(start.inputs())[0]) if item.heat == "local" else 0.0
        small = self._rounding(after, energy)
        return self._load_path.shares(step, start, after, broken, rtol * made + small) if made > small else None

    def _beyond(self, item: Edge, after: Point | None) -> str:
        """Why laws end before the gaps come to rest, where they do; touch leaves gaps where they are."""
        if after is None or not item.equilibrates or item.measure:
            return ""
        return self._domain.beyond(after.inputs())

    @cached_property
    def _domain(self) -> Domain:
        return Domain(self.system)

    def _kept(self, item: Edge, after: Point | None, parameters: Array, small: float) -> Point | None:
        """The modes that a transition sets hold while its measure is as good as zero."""
        if after is None or not item.measure or abs(after.y[self.states.index(item.measure)]) > small:
            return after
        slip = self.equilibria.slip
        kept = replace(after, parameters=parameters)
        return kept if slip is None else self.equilibria.with_slip(kept, after.parameters[slip])

    def _judged(self, jump: Jump, books: Array, noise: float) -> Jump:
        """The jump with the entropy it produces, what the second law says of that, and the work done in it."""
        now = self._books(jump.after.inputs())
        before, after = float(books[1]), float(now[1])
        gain = after - before + jump.entropy_out
        size = max(abs(before), abs(after), abs(jump.entropy_out))
        known = ROUNDING * size + self._entropy_rounding(jump, noise)
        done = zip(self.system.given, (now[2:] - books[2:]).tolist(), strict=True)
        work = {**jump.work, **{name: jump.work.get(name, 0.0) + moved for name, moved in done}}
        return replace(jump, entropy=gain, verdict=ADMISSIBLE if gain >= -known else VIOLATES, work=work)

    def _entropy_rounding(self, jump: Jump, noise: float) -> float:
        """Entropy that the last digits of the states stand for, and the noise of what the margin measures."""
        point, n = jump.before, len(jump.before.y)
        nudges = DIGITS * np.abs(point.y)
        if jump.edge.measure:
            nudges[self.states.index(jump.edge.measure)] += noise
        rows = np.repeat(point.inputs()[None], 1 + n, axis=0)
        rows[1:, 1 : 1 + n] += np.diag(nudges)
        entropies = self._books(rows)[:, 1]
        return float(np.sum(np.abs(entropies[1:] - entropies[0])))

    def _heated(
        self, point: Point, item: Edge, start: Point, energy: float, shares: Array | None
    ) -> tuple[Point, float, float, float] | None:
        """The point with the heat made in its nodes: point, energy, heat and entropy passed to reservoirs."""
        rows = point.inputs()[None]
        made = self._made(rows, item, start, energy)
        made[np.abs(made) <= self._rounding(point, energy)] = 0.0
        if not np.any(made):
            return point, 0.0, 0.0, 0.0
        heated = self._heat.warmed(rows, made, shares)
        if not np.all(np.isfinite(heated)):
            return None
        T, _, _, taken = self._heat.taken(rows, made, shares)
        passed = np.array([node.prescribed for node in self._heat.nodes.values()])
        heat, entropy = float(np.sum(taken[0, passed])), float(np.sum((taken / T)[0, passed]))
        after = Point(point.t, heated[0, 1 : 1 + len(point.y)], point.ydot, point.parameters)
        return after, float(np.sum(made)), heat, entropy

    def _rounding(self, point: Point, energy: float) -> float:
        """Energy that the last digits of the states and of the energies themselves stand for [J/m^2]."""
        rows = np.repeat(point.inputs()[None], 1 + len(point.y), axis=0)
        states = slice(1, 1 + len(point.y))
        rows[1:, states] *= 1 + DIGITS * np.eye(len(point.y))
        energies = self._energy(rows)[:, 0]
        return float(np.sum(np.abs(energies[1:] - energies[0])) + DIGITS * max(abs(energies[0]), abs(energy)))
