"""Events of interfaces inside the steps of a network's integrator.

The integrator is asked for a time just ahead of the present one, so that it takes one step and no more; the end of that
step is the time at which it has evaluated last. Between the two its polynomial says where a margin reaches zero, and
the network has not yet gone there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from surfacechem.reactor.interface import InterfaceReactor
from surfacechem.solve.adapters.crossings import crossings
from surfacechem.solve.contract import Array

FIRST = 1e-9
"""First look ahead after a start, as part of what is integrated: the integrator starts with shorter steps still."""

SHORTEST, AHEAD = 1e4, 4.0
"""The shortest first look and all later ones, in roundings of the time."""


NODES, WEIGHTS = np.polynomial.legendre.leggauss(6)
"""Gauss's quadrature from -1 to 1."""

PANELS_OF_A_PERIOD = 8


@dataclass(frozen=True)
class Event:
    """A transition of an interface at a time [s]."""

    t: float
    interface: InterfaceReactor
    index: int


class Watch:
    """What is known of the step that the integrator has taken last."""

    def __init__(self, net: Any, interfaces: Sequence[InterfaceReactor]) -> None:
        self.net = net
        self.interfaces = [item for item in interfaces if item.scene.moments]
        self.started = False
        self.known = -np.inf
        """Time up to which the next event is known [s]."""
        self.event: Event | None = None
        self._before: list[Array] = []
        self._origin = 0.0
        self._rows = np.zeros((1, 0))

    def restart(self) -> None:
        """The integrator starts anew from here."""
        self.started, self.known, self.event = False, -np.inf, None

    def ahead(self, goal: float) -> float:
        """A time for which the integrator takes a step, [s]."""
        now = float(self.net.time)
        self._before = [item.scene.transitions(now, item.x) for item in self.interfaces]
        if self.started:
            return min(goal, now + AHEAD * float(np.spacing(now)))
        soonest = min(item.scene.moments.soonest() for item in self.interfaces if item.scene.moments)
        return min(goal, now + max(min(FIRST * (goal - now), soonest / 2), SHORTEST * float(np.spacing(now))))

    def look(self) -> None:
        """Find the first event in the step that the integrator has just taken."""
        now = float(self.net.time)
        self.started, self.event = True, None
        self.known = max([now, *(item.asked for item in self.interfaces)])
        self._origin, self._rows = now, self._polynomial()
        for item, before in zip(self.interfaces, self._before, strict=True):
            self._first(item, before, now)

    def book(self, start: float, end: float) -> None:
        """Integrate the ledgers over a part of the step, which the integrator does not see where nothing else moves."""
        for item in self.interfaces:
            frequency = max((item.scene.values[path] for path in item.scene.model.system.cycles), default=0.0)
            panels = 1 + int(PANELS_OF_A_PERIOD * frequency * (end - start))
            edges = np.linspace(start, end, panels + 1)
            for low, high in pairwise(edges):
                times = (low + high) / 2 + (high - low) / 2 * NODES
                rates = [item.ledger_rates(t, self._at(item, t)) for t in times.tolist()]
                item.ledger = item.ledger + (high - low) / 2 * (WEIGHTS @ np.array(rates))

    def _at(self, item: InterfaceReactor, t: float) -> Array:
        """Variables of an interface within the step."""
        return np.asarray(_value(self._rows[:, self._columns(item)], t - self._origin) * item.unit)

    def _first(self, item: InterfaceReactor, before: Array, now: float) -> None:
        def margins(t: float) -> Array:
            return item.scene.transitions(t, self._at(item, t))

        passed = np.flatnonzero((before > 0) & (margins(now) <= 0)).tolist()
        zeros = dict.fromkeys(passed, now) or crossings(
            margins, np.sign(margins(now)), np.full(len(before), -1), now, self.known
        )
        if zeros:
            first = min(zeros, key=lambda i: zeros[i])
            if self.event is None or zeros[first] < self.event.t:
                self.event = Event(zeros[first], item, first)

    def _polynomial(self) -> Array:
        """Coefficients of the powers of the time from now, shape (powers, variables)."""
        rows, factorial = [], 1.0
        for k in range(int(self.net.solver_stats["last_order"]) + 1):
            factorial *= max(k, 1)
            rows.append(np.asarray(self.net.get_derivative(k)) / factorial)
        return np.array(rows)

    def _columns(self, item: InterfaceReactor) -> slice:
        reactors = list(self.net.reactors)
        first = sum(reactor.n_vars for reactor in reactors[: reactors.index(item)])
        return slice(first, first + item.n_vars)


def _value(rows: Array, s: float) -> Array:
    value = np.zeros(rows.shape[1])
    for row in rows[::-1]:
        value = row + s * value
    return value
