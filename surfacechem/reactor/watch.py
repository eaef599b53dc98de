"""Event location for interfaces inside the steps of a network's integrator.

The integrator is asked for a time just ahead of the present one, so that it takes exactly one step; the end of that
step is the time of its last evaluation. In between, its dense output gives the first zero of a guard before the network
advances there.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from surfacechem.reactor.interface_reactor import InterfaceReactor
from surfacechem.solve.adapters.cantera_network import StateVectorReactor, last_step
from surfacechem.solve.adapters.dense_step import DenseStep, Guards, first_crossing
from surfacechem.solve.contract import Array, Guard
from surfacechem.tolerances import NEGLIGIBLE, TINY

FIRST_AHEAD = NEGLIGIBLE**3
"""Time of the first request after a start, as a fraction of the integration; first steps are shorter."""

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

MOST_HALVINGS = 8
"""Halvings of a panel, a choice: accounts that are roundoff never agree, and 256 panels resolve what a step passes over
smoothly."""

EXPLAINED = 10.0
"""Ratio of the relative errors of an account and of a state up to which the same is their cause, a choice: between 10
and 100 the errors of balances stay the same."""


@dataclass(frozen=True)
class InterfaceEvent:
    """A transition of an interface at a time [s]."""

    t: float
    interface: InterfaceReactor
    index: int


class StepWatcher:
    """Events of interfaces and their ledgers, along the dense output of the last step of the integrator."""

    def __init__(self, net: Any, interfaces: Sequence[InterfaceReactor]) -> None:
        self.net = net
        # Scenes that jump, and those whose ledgers are integrated here. Others keep the integrator's speed.
        ours = all(isinstance(reactor, StateVectorReactor) for reactor in net.reactors)
        self._counted_here = [item for item in interfaces if _is_counted_here(item, ours)]
        """Interfaces whose ledgers are integrated here, not by the integrator."""
        for item in self._counted_here:
            item.integrated = True
        self.interfaces = [item for item in interfaces if item.scene.events or item.integrated]
        self._is_coupled = any(item.coupled for item in self.interfaces)
        self._varies = any(item.scene.varies or item.loads for item in self._counted_here)
        self.started = False
        self.known = -np.inf
        """Time up to which the next event is known [s]."""
        self.event: InterfaceEvent | None = None
        self._end = -np.inf
        """Time up to which the ledgers are integrated [s]."""
        self._before: list[Array] = []
        self._step: DenseStep | None = None

    @cached_property
    def _columns(self) -> dict[Any, slice]:
        """Places of the variables of each reactor in the network."""
        ends = np.cumsum([0, *(reactor.n_vars for reactor in self.net.reactors)]).tolist()
        return {reactor: slice(*each) for reactor, each in zip(self.net.reactors, pairwise(ends), strict=True)}

    def restart(self) -> None:
        """Restart, as the integrator does."""
        self.started, self.known, self.event = False, -np.inf, None
        self._end = float(self.net.time)

    def ahead(self, goal: float) -> float:
        """Return a time [s] at which a request makes the integrator take one step."""
        now = float(self.net.time)
        self._before = [item.scene.transitions(now, item.x) for item in self.interfaces]
        if self.started:
            return min(goal, now + LATER_AHEAD * float(np.spacing(now)))
        soonest = min((item.scene.events.soonest() for item in self.interfaces if item.scene.events), default=np.inf)
        return min(goal, now + max(min(FIRST_AHEAD * (goal - now), soonest / 2), MIN_AHEAD * float(np.spacing(now))))

    def locate_event(self) -> None:
        """Locate the first event in the step that the integrator has just taken; it may displace the reactors."""
        now = float(self.net.time)
        self.started, self.event = True, None
        self.known = max([now, *(item.asked for item in self.interfaces)])
        self._step = step = last_step(self.net, now, self.known, np.ones(self.net.n_vars))
        for item, before in zip(self.interfaces, self._before, strict=True):
            if not len(before):
                continue
            guards = Guards.of([Guard.stop()] * len(before), self._guards_of(item))
            guards.start(before)
            present = guards.values(now, step.y(now))
            t, fired = now, np.flatnonzero(guards.crossed(present)).tolist()
            if not fired:
                guards.start(present)
                t, fired = first_crossing(step, guards, np.isfinite(present), 0.0)
            if fired and (self.event is None or t < self.event.t):
                self.event = InterfaceEvent(t, item, fired[0])

    def _guards_of(self, item: InterfaceReactor) -> Callable[[float, Array], Array]:
        """Return the guards of an interface as a function of time and the variables of the network."""

        def guards(t: float, y: Array) -> Array:
            if self._is_coupled:
                self._put(y)
            return item.scene.transitions(t, y[self._columns[item]] * item.unit)

        return guards

    def _put(self, y: Array) -> None:
        """Set the reactors of this package to the variables of a network."""
        for reactor, columns in self._columns.items():
            if isinstance(reactor, StateVectorReactor):
                reactor.put(y[columns])

    def integrate_ledgers(self, end: float) -> None:
        """Integrate the ledgers up to a time in the step; it may displace the reactors.

        The integrator may step over their changes while nothing else moves, so panels are halved where anything varies.
        """
        start, self._end = self._end, end
        if not self._counted_here or not end > start:
            return
        assert self._step is not None
        cycles = [item.scene.values[path] for item in self._counted_here for path in item.scene.model.system.cycles]
        panels = 1 + int(PANELS_PER_CYCLE * max(cycles, default=0.0) * (end - start))
        length = (end - start) / panels
        gain = np.sum([self._integral(start + k * length, length, MOST_HALVINGS) for k in range(panels)], axis=0)
        ends, first = self._step.rows(np.array([start, end])), 0
        for item in self._counted_here:
            own, size = gain[:, first : first + len(item.x)]
            item.ledger = item.ledger + self._gained(item, own, size, ends[:, self._columns[item]] * item.unit)
            first += len(item.x)

    def _gained(self, item: InterfaceReactor, gain: Array, size: Array, ends: Array) -> Array:
        """Return the change of an interface's ledger, from the integrals of its rates and of their magnitudes, and from
        its variables at both ends.

        Reactions that run both ways fast magnify the error of a step in the integrals. The integrator's own sum has no
        such error, and is what neighbours receive, but it may miss what happens while no state moves. So it is taken
        where the difference is no larger than that of a state. Entropy production it does not resolve.
        """
        count, changes = len(item.scene.states), ends[1] - ends[0]
        if not item.coupled:
            return gain[count:]
        missed, tolerances = np.abs(gain - changes), self.net.rtol * np.abs(ends).max(axis=0) + self.net.atol
        parts = np.where(missed > NEGLIGIBLE * tolerances, missed, 0.0) / np.maximum(size, TINY)
        explained = missed <= EXPLAINED * parts[:count].max(initial=0.0) * size
        summed = ~item.scene.entropic & (explained[count:] | bool(item.neighbours))
        return np.where(summed, changes[count:], gain[count:])

    def _integral(self, low: float, length: float, left: int) -> Array:
        """Return the integrals of all rates and of their magnitudes, from panels that are halved until two rules agree,
        relative to the amounts exchanged and to the states.
        """
        rates = self._panel(low + length / 2 * (1 + NODES))
        found = length / 2 * np.array([WEIGHTS @ rates, WEIGHTS @ np.abs(rates)])
        if not left or not self._varies:
            return found
        # Within a load segment rates are smooth along the dense output, so that halving converges fast.
        known = np.concatenate([np.append(item.x[: -len(item.ledger)], item.ledger) for item in self._counted_here])
        if np.all(length / 2 * np.abs(LESS_GAUSS @ rates) <= self.net.rtol * (found[1] + np.abs(known))):
            return found
        return self._integral(low, length / 2, left - 1) + self._integral(low + length / 2, length / 2, left - 1)

    def _panel(self, times: Array) -> Array:
        """Return the rates of all interfaces at times of the step, a row each."""
        assert self._step is not None
        rows = self._step.rows(times)
        if self._is_coupled:
            return np.array([self._rates(t, y) for t, y in zip(times.tolist(), rows, strict=True)])
        parts = ((item, rows[:, self._columns[item]] * item.unit) for item in self._counted_here)
        return np.hstack([item.scene.many_rates(times, part) for item, part in parts])

    def _rates(self, t: float, y: Array) -> Array:
        """Return the rates at a time and the variables of the network, from which interfaces take values."""
        self._put(y)
        return np.concatenate([item.rates_inside(t) for item in self._counted_here])


def _is_counted_here(item: InterfaceReactor, ours: bool) -> bool:
    """True if the ledger of an interface is integrated along the steps of a network.

    ``ours`` is true if all reactors are set from Python, so that they can be at any time of a step. Those of Cantera
    are at its end only.
    """
    return ours if item.coupled else bool(item.scene.events) or item.scene.varies
