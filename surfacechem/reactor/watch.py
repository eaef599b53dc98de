"""Event location for interfaces inside the steps of a network's integrator.

The integrator is asked for a time just ahead of the present one, so that it takes exactly one step; the end of that
step is the time of its last evaluation. In between, its dense output gives the first zero of a guard before the network
advances there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import pairwise
from typing import Any, NamedTuple

import cantera
import numpy as np

from surfacechem.errors import InputError
from surfacechem.reactor.coupling import Gas
from surfacechem.reactor.interface_reactor import InterfaceReactor
from surfacechem.solve.adapters.cantera_network import StateVectorReactor, last_step
from surfacechem.solve.adapters.dense_step import DenseStep, Guards, first_crossing
from surfacechem.solve.contract import Array, Guard
from surfacechem.tolerances import NEGLIGIBLE

FIRST_AHEAD = NEGLIGIBLE**3
"""Longest time of the first request after a start, as a fraction of the integration."""

MIN_AHEAD, LATER_AHEAD = 1e4, 4.0
"""The shortest first request and all later ones, in roundings of the time."""


_GAUSS = np.polynomial.legendre.leggauss(3)
_BETWEEN = np.polynomial.Polynomial([155 / 891, 0, -10 / 9, 0, 1]).roots()
"""Nodes that Kronrod adds to three of Gauss: the roots of Stieltjes's polynomial."""

NODES = np.sort(np.concatenate([_GAUSS[0], _BETWEEN]))
"""Nodes of the quadrature of Gauss and Kronrod with seven points, from -1 to 1."""

WEIGHTS = np.linalg.solve(np.polynomial.legendre.legvander(NODES, 6).T, [2, 0, 0, 0, 0, 0, 0])
"""Its weights, exact for polynomials up to the eleventh degree: the integrator's have the fifth at most."""

LESS_GAUSS = WEIGHTS - np.insert(_GAUSS[1], [0, 1, 2, 3], 0.0)
"""These less the weights of Gauss for three of the points, which are exact up to the fifth degree."""

PANELS_PER_CYCLE = 8
"""Panels in a cycle of a load from which halving begins, a choice: two coarser panels could agree by aliasing."""

MOST_PANELS = 64
"""Panels at once, a choice: a call for so many costs little more than for one."""

MOST_HALVINGS = 8
"""Halvings of a panel, a choice: accounts that are roundoff never agree, and 256 panels resolve what a step passes over
smoothly."""


Given = list[tuple[int, int]]
"""Places among the parameters of an interface and in the network of the same quantities."""


@dataclass(frozen=True)
class InterfaceEvent:
    """A transition of an interface at a time [s]."""

    t: float
    interface: InterfaceReactor
    index: int


class StepPanel(NamedTuple):
    """A part of a step of the integrator, with all that rates at the nodes of its quadrature depend on."""

    step: DenseStep
    low: float
    """Its first time [s]."""
    length: float
    """Its length [s]."""
    times: Array
    """Times of its nodes [s]."""
    rows: Array
    """Variables of the network there, a row each."""
    parameters: list[list[Array]]
    """Parameters of each interface there, none if they are the present ones."""


class StepWatcher:
    """Events of interfaces and their ledgers, along the dense output of the last step of the integrator."""

    def __init__(self, net: Any, interfaces: Sequence[InterfaceReactor]) -> None:
        self.net = net
        self.interfaces = list(interfaces)
        self._is_coupled = any(item.coupled for item in interfaces)
        self._is_ours = all(isinstance(reactor, StateVectorReactor) for reactor in net.reactors)
        """True if all reactors can be set from Python to any time of a step, forth and back; others only forth."""
        self._halves = self._is_ours or not self._is_coupled
        self._combined: list[Array] = []
        """How the accounts of each interface follow from its states."""
        self.started = False
        self.known = -np.inf
        """Time up to which the next event is known [s]."""
        self.event: InterfaceEvent | None = None
        self._end = -np.inf
        """Time up to which there are panels [s]."""
        self._panels: list[StepPanel] = []
        """Panels along which the ledgers are not integrated yet."""
        self._reached: list[Array] = []
        """Variables of the interfaces at the end of them."""
        self._before: list[Array] = []
        self._step: DenseStep | None = None

    @cached_property
    def _columns(self) -> dict[Any, slice]:
        """Places of the variables of each reactor in the network."""
        ends = np.cumsum([0, *(reactor.n_vars for reactor in self.net.reactors)]).tolist()
        return {reactor: slice(*each) for reactor, each in zip(self.net.reactors, pairwise(ends), strict=True)}

    @cached_property
    def _temperatures(self) -> dict[InterfaceReactor, Given]:
        """For interfaces that jump, the temperatures that reactors give them."""
        return {item: self._given(item) for item in self.interfaces if item.scene.events}

    def _given(self, item: InterfaceReactor) -> Given:
        """Return where temperatures that reactors give an interface stand, among its parameters and in the network.

        InputError for a reactor without a temperature among its variables.
        """
        found = []
        for place, reactor in item.temperatures():
            if reactor in self._columns and not isinstance(reactor, StateVectorReactor):  # others hold theirs
                names = [reactor.component_name(i) for i in range(reactor.n_vars)]
                if "temperature" not in names:
                    part = f"{item.name} jumps where the temperature of {reactor.name} may have a part"
                    problem = f"{part}, of which only the energy is known inside a step"
                    remedy = "Let it be an IdealGasReactor or another one with a temperature among its variables."
                    raise InputError(f"{problem}. {remedy}")
                found.append((place, self._columns[reactor].start + names.index("temperature")))
        return found

    def restart(self) -> None:
        """Restart, as the integrator does."""
        self.started, self.known, self.event = False, -np.inf, None
        self._end = float(self.net.time)
        self._combined = [item.combined(self._end) for item in self.interfaces]

    def ahead(self, goal: float) -> float:
        """Return a time [s] at which a request makes the integrator take one step."""
        now = float(self.net.time)
        self._before = [item.transitions(now) for item in self.interfaces]
        if self.started:
            return min(goal, now + LATER_AHEAD * float(np.spacing(abs(now))))
        soon = [FIRST_AHEAD * (goal - now)]
        soon += [item.scene.events.soonest() / 2 for item in self.interfaces if item.scene.events]
        soon += [item.scene.soonest_change(now, item.x, self.net.rtol) for item in self.interfaces]
        return min(goal, now + max(min(soon), MIN_AHEAD * float(np.spacing(abs(now)))))

    def locate_event(self) -> None:
        """Locate the first event in the step that the integrator has just taken."""
        now = float(self.net.time)
        self.started, self.event = True, None
        self.known = max([now, *(item.asked for item in self.interfaces)])
        self._step = step = last_step(self.net, now, self.known)
        for item, before in zip(self.interfaces, self._before, strict=True):
            if not len(before):
                continue
            given = self._temperatures[item]
            guards = Guards.of([Guard.stop()] * len(before), partial(self._guards, item, given))
            guards.rows = partial(self._guard_rows, item, given)
            guards.start(before)
            present = guards.values(now, step.y(now))
            t, fired = now, np.flatnonzero(guards.crossed(present)).tolist()
            if not fired:
                guards.start(present)
                t, fired = first_crossing(step, guards, np.isfinite(present), 0.0)
            if fired and (self.event is None or t < self.event.t):
                self.event = InterfaceEvent(t, item, fired[0])
        if self._is_coupled:  # the guards have displaced the reactors
            self.go(now)

    def _guards(self, item: InterfaceReactor, given: Given, t: float, y: Array) -> Array:
        """Return the guards of an interface at a time and the variables of the network."""
        if self._is_coupled:
            item.scene.evaluation.parameters[:] = self._parameters(item, given, t, y)
        return item.scene.transitions(t, y[self._columns[item]] * item.unit)

    def _guard_rows(self, item: InterfaceReactor, given: Given, times: Array, rows: Array) -> Array:
        """Return the guards of an interface at several times and variables of the network, a row each."""
        table = item.scene.evaluation.parameters
        if self._is_coupled:
            moments = zip(times.tolist(), rows, strict=True)
            table = np.array([self._parameters(item, given, t, y) for t, y in moments])
        return item.scene.many_transitions(times, rows[:, self._columns[item]] * item.unit, table)

    def _parameters(self, item: InterfaceReactor, given: Given, t: float, y: Array) -> Array:
        """Return the parameters of an interface at a time in a step and the variables of the network then.

        Reactors of Cantera cannot be set to it; what edges depend on is read from their variables.
        """
        self._set(y)
        parameters = item.parameters_at(t)
        for place, column in given:
            parameters[place] = y[column]
        for beside in item.scene.neighbours:
            if isinstance(beside.reactor, Gas):
                state = beside.reactor.state_at(y[self._columns[beside.reactor]])
                parameters[beside.places] = state[: len(beside.places)]
        return parameters

    def _set(self, y: Array) -> None:
        """Set the reactors that are set from Python to the variables of the network."""
        for reactor, columns in self._columns.items():
            if isinstance(reactor, StateVectorReactor):
                reactor.put(y[columns])

    def _put(self, t: float, y: Array) -> None:
        """Set the reactors to a time and the variables of the network then."""
        if self._is_ours:
            self._set(y)
        else:
            self.go(max(t, float(self.net.time)))  # the first request after a start has passed a little of the step

    def go(self, t: float) -> None:
        """Let the integrator set all reactors to a time that is not before the last one."""
        cantera.ReactorNet.advance(self.net, t, False)

    def follow(self, end: float) -> None:
        """Go to a time in the step, and keep the panels on the way there."""
        start, self._end = self._end, end
        before = self._decisive_loads(start)
        if end > start:
            assert self._step is not None
            cycles = [item.scene.values[path] for item in self.interfaces for path in item.scene.model.system.cycles]
            count = 1 + int(PANELS_PER_CYCLE * max(cycles, default=0.0) * (end - start))
            length = (end - start) / count
            self._panels += [self._panel(self._step, start + k * length, length) for k in range(count)]
        self.go(end)
        if before != (now := self._decisive_loads(start)):
            edge, name = next(each for each in before if before[each] != now[each])
            problem = f"the load {name}, which reads a reactor that cannot be set back to a time inside a step"
            raise InputError(f"{edge} depends on {problem}. Let the load follow from time and from interfaces.")
        self.go(end)
        self._reached = [item.x for item in self.interfaces]
        if len(self._panels) >= MOST_PANELS:
            self.book()

    @cached_property
    def _decisive(self) -> list[tuple[InterfaceReactor, str, str]]:
        """Interfaces, edges and the loads that these read, if there are reactors that cannot be set from Python."""
        loads = [(item, name) for item in self.interfaces if not self._is_ours for name in item.loads]
        return [(item, edge, name) for item, name in loads if (edge := item.scene.edge_that_reads(name))]

    def _decisive_loads(self, t: float) -> dict[tuple[str, str], float]:
        """Return these loads at a time [s], at the states then of reactors that are set from Python, of others now."""
        if self._decisive and self._step:
            self._set(self._step.y(t))
        return {(edge, name): item.loads[name](t) for item, edge, name in self._decisive}

    def book(self) -> None:
        """Integrate the ledgers along the panels kept so far.

        The integrator may step over their changes while nothing else moves, so panels are halved where anything varies.
        """
        if self._panels:
            panels, self._panels = self._panels, []
            gain = self._integral(panels, MOST_HALVINGS)
            for item, x, combined in zip(self.interfaces, self._reached, self._combined, strict=True):
                item.book(x, gain[: len(x)], combined)
                gain = gain[len(x) :]
            if self._halves and self._is_coupled:
                self.go(float(self.net.time))

    def _integral(self, panels: Sequence[StepPanel], left: int) -> Array:
        """Return the integrals of all rates over panels, halved until two rules agree, relative to the amounts
        exchanged and to the states.
        """
        rates = self._rates(panels)
        halves = np.array([panel.length / 2 for panel in panels])[:, None]
        found = halves * (WEIGHTS @ rates)
        if not left or not self._halves:
            return np.asarray(found.sum(axis=0))
        # Within a load segment rates are smooth along the dense output, so that halving converges fast.
        known = np.concatenate([np.append(item.x[: len(item.scene.states)], item.ledger) for item in self.interfaces])
        allowed = self.net.rtol * (halves * (WEIGHTS @ np.abs(rates)) + np.abs(known))
        agree = np.all(halves * np.abs(LESS_GAUSS @ rates) <= allowed, axis=1)
        rough = [panel for panel, fine in zip(panels, agree, strict=True) if not fine]
        parts = [self._panel(p.step, p.low + k * p.length / 2, p.length / 2) for p in rough for k in range(2)]
        rest = self._integral(parts, left - 1) if parts else 0.0
        return np.asarray(found[agree].sum(axis=0) + rest)

    def _panel(self, step: DenseStep, low: float, length: float) -> StepPanel:
        """Return a panel of a step with the parameters that each interface has at its nodes."""
        times = low + length / 2 * (1 + NODES)
        panel = StepPanel(step, low, length, times, step.rows(times), [[] for _ in self.interfaces])
        if self._is_coupled:
            for t, y in zip(times.tolist(), panel.rows, strict=True):
                self._put(t, y)
                for item, parameters in zip(self.interfaces, panel.parameters, strict=True):
                    parameters.append(item.parameters_at(t))
        return panel

    def _rates(self, panels: Sequence[StepPanel]) -> Array:
        """Return the rates of all interfaces at the nodes of panels: [panel, node, rate]."""
        times = np.concatenate([panel.times for panel in panels])
        rows = np.concatenate([panel.rows for panel in panels])
        found = []
        for k, item in enumerate(self.interfaces):
            given = [row for panel in panels for row in panel.parameters[k]]
            parameters = np.array(given or item.scene.evaluation.parameters)
            found.append(item.scene.many_rates(times, rows[:, self._columns[item]] * item.unit, parameters))
        return np.hstack(found).reshape(len(panels), len(NODES), -1)
