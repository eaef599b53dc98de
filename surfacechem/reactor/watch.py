"""Event location for interfaces inside the steps of a network's integrator.

The integrator is asked for a time just ahead of the present one, so that it takes exactly one step; the end of that
step is the time of its last evaluation. In between, its dense output gives the first zero of a guard before the network
advances there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise, takewhile
from typing import Any

import numpy as np

from surfacechem.reactor.interface import InterfaceReactor
from surfacechem.solve.adapters.cantera_network import last_step
from surfacechem.solve.adapters.dense_step import DenseStep, Guards, first_crossing
from surfacechem.solve.contract import Array, Guard
from surfacechem.tolerances import NEGLIGIBLE

FIRST_AHEAD = NEGLIGIBLE**3
"""Time of the first request after a start, as a fraction of the integration; first steps are shorter."""

MIN_AHEAD, LATER_AHEAD = 1e4, 4.0
"""The shortest first request and all later ones, in roundings of the time."""


NODES, WEIGHTS = np.polynomial.legendre.leggauss(6)
"""Nodes and weights of Gauss's quadrature from -1 to 1."""

PANELS_PER_CYCLE = 8
"""Panels in a cycle of a load from which halving begins, a choice: two coarser panels could agree by aliasing."""

MOST_HALVINGS = 8
"""Halvings of a panel, a choice: accounts that are roundoff never agree, and 256 panels resolve what a step passes over
smoothly."""


@dataclass(frozen=True)
class InterfaceEvent:
    """A transition of an interface at a time [s]."""

    t: float
    interface: InterfaceReactor
    index: int


class StepWatcher:
    """Events and dense output of the last step of the integrator."""

    def __init__(self, net: Any, interfaces: Sequence[InterfaceReactor]) -> None:
        self.net = net
        # Scenes that jump, and those with histories, over which the integrator may step: their accounts are integrated
        # here. Others keep the integrator's speed.
        self.interfaces = [item for item in interfaces if item.scene.events or (item.scene.varies and not item.coupled)]
        for item in self.interfaces:
            item.integrated = not item.coupled
        self.started = False
        self.known = -np.inf
        """Time up to which the next event is known [s]."""
        self.event: InterfaceEvent | None = None
        self._before: list[Array] = []
        self._steps: list[DenseStep] = []

    def restart(self) -> None:
        """Restart, as the integrator does."""
        self.started, self.known, self.event = False, -np.inf, None

    def ahead(self, goal: float) -> float:
        """Return a time [s] at which a request makes the integrator take one step."""
        now = float(self.net.time)
        self._before = [item.scene.transitions(now, item.x) for item in self.interfaces]
        if self.started:
            return min(goal, now + LATER_AHEAD * float(np.spacing(now)))
        soonest = min((item.scene.events.soonest() for item in self.interfaces if item.scene.events), default=np.inf)
        return min(goal, now + max(min(FIRST_AHEAD * (goal - now), soonest / 2), MIN_AHEAD * float(np.spacing(now))))

    def locate_event(self) -> None:
        """Locate the first event in the step that the integrator has just taken."""
        now = float(self.net.time)
        self.started, self.event = True, None
        self.known = max([now, *(item.asked for item in self.interfaces)])
        self._steps = [self._step_of(item, now) for item in self.interfaces]
        for item, step, before in zip(self.interfaces, self._steps, self._before, strict=True):
            if not len(before):
                continue
            guards = Guards.of([Guard.stop()] * len(before), item.scene.transitions)
            guards.start(before)
            present = item.scene.transitions(now, step.y(now))
            t, fired = now, np.flatnonzero(guards.crossed(present)).tolist()
            if not fired:
                guards.start(present)
                t, fired = first_crossing(step, guards, np.isfinite(present), 0.0)
            if fired and (self.event is None or t < self.event.t):
                self.event = InterfaceEvent(t, item, fired[0])

    def integrate_ledgers(self, start: float, end: float) -> None:
        """Integrate the ledgers over a part of the step.

        The integrator may step over their changes while nothing else moves, so panels are halved where histories vary.
        Values from the network are known at the ends of steps only; with them the integrator's ledger is used.
        """
        for item, step in zip(self.interfaces, self._steps, strict=True):
            if item.coupled:
                continue
            frequency = max((item.scene.values[path] for path in item.scene.model.system.cycles), default=0.0)
            panels = 1 + int(PANELS_PER_CYCLE * frequency * (end - start))
            edges = np.linspace(start, end, panels + 1)
            for low, high in pairwise(edges):
                gain, size = _panel(item, step, low, high)
                if item.scene.varies:
                    gain = self._halved(item, step, low, high, gain, size, MOST_HALVINGS)
                item.ledger = item.ledger + gain

    def _halved(
        self, item: InterfaceReactor, step: DenseStep, low: float, high: float, gain: Array, size: Array, left: int
    ) -> Array:
        """Return the integral of the ledger rates, from panels that are halved until the halves agree with the whole,
        relative to the amounts exchanged.
        """
        ends = (low, (low + high) / 2), ((low + high) / 2, high)
        halves = [_panel(item, step, *each) for each in ends]
        found = halves[0][0] + halves[1][0]
        # Within a load segment rates are smooth along the dense output, so that halving converges fast.
        if not left or np.all(np.abs(found - gain) <= self.net.rtol * (size + np.abs(item.ledger))):
            return found
        first, second = (
            self._halved(item, step, *each, *half, left - 1) for each, half in zip(ends, halves, strict=True)
        )
        return first + second

    def _step_of(self, item: InterfaceReactor, now: float) -> DenseStep:
        """Return the dense output of the rest of the step, for the variables of an interface."""
        first = sum(reactor.n_vars for reactor in takewhile(lambda reactor: reactor is not item, self.net.reactors))
        return last_step(self.net, now, self.known, item.unit, slice(first, first + item.n_vars))


def _panel(item: InterfaceReactor, step: DenseStep, low: float, high: float) -> tuple[Array, Array]:
    """Return the integral of the ledger rates over a panel, and that of their magnitudes."""
    times = (low + high) / 2 + (high - low) / 2 * NODES
    rates = np.array([item.ledger_rates(t, step.y(t)) for t in times.tolist()])
    return (high - low) / 2 * (WEIGHTS @ rates), (high - low) / 2 * (WEIGHTS @ np.abs(rates))
