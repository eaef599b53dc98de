"""A ReactorNet that stops where histories jump, where a scene jumps and where it ends."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cached_property
from itertools import chain
from typing import Any, SupportsFloat

import cantera
import numpy as np

from surfacechem.errors import InputError
from surfacechem.reactor.coupling import HeatWall
from surfacechem.reactor.embedded import ASSUMED_LENGTH, NO_SHORTER
from surfacechem.reactor.interface_reactor import InterfaceReactor, InterfaceStopped
from surfacechem.reactor.watch import LATER_AHEAD, StepWatcher
from surfacechem.solve.adapters.cantera_network import Derivatives, StateVectorReactor, last_step
from surfacechem.solve.adapters.dense_step import Guards, first_crossing
from surfacechem.solve.contract import Array, Counters, Guard

SETTINGS = (
    *("energy_enabled", "chemistry_enabled", "device_coefficient", "time_function", "pressure_function"),
    *("area", "heat_transfer_coeff", "emissivity", "expansion_rate_coeff", "heat_flux", "velocity"),
)
"""Settings of reactors and of their connectors, functions by their present values."""

SIDES = ("upstream", "downstream", "left_reactor", "right_reactor")
"""Attributes of connectors that name the reactor or reservoir on a side."""


class ReactorNet(cantera.ReactorNet):
    """Cantera's ReactorNet for networks with interfaces.

    ``advance`` and ``step`` end a step at every breakpoint of a prescribed history and at every event of a scene. They
    carry out its jump, record the interfaces, and raise InterfaceStopped with the reason where a scene ends.

    Parameters
    ----------
    reactors
        Reactors of Cantera and interfaces, in the order of their indices. Interfaces whose reactions get sensitivities
        precede the reactors that take from them.
    """

    def __init__(self, reactors: Sequence[Any] = ()) -> None:
        self._fresh = True
        self._started = -np.inf
        self._last_surroundings: list[object] = []
        """Quantities besides the variables on which rates depend, at the present time."""
        super().__init__(reactors)
        for reactor, count in Counter(self.reactors).items():  # Cantera has taken them from the argument
            if count > 1:
                raise InputError(f"{reactor.name} stands {count} times in the list of reactors: give it once.")
        names = Counter[str]()
        for reactor in self.reactors:
            if isinstance(reactor, StateVectorReactor):
                names[reactor.name] += 1
                if (count := names[reactor.name]) > 1:
                    reactor.name = f"{reactor.name}_{count}"

    @property
    def interfaces(self) -> list[InterfaceReactor]:
        """Its interfaces, in the order of the reactors."""
        return [reactor for reactor in self.reactors if isinstance(reactor, InterfaceReactor)]

    @cached_property
    def _watch(self) -> StepWatcher:
        return StepWatcher(self, self.interfaces)

    @property
    def initial_time(self) -> float:
        """Time at which the integration begins [s]; to be set before."""
        return float(super().initial_time)

    @initial_time.setter
    def initial_time(self, t: float) -> None:
        if not self._fresh and self.interfaces:
            raise InputError("the network has run, and its interfaces with it: begin at another time with new ones.")
        self._set_clock(t)

    def _set_clock(self, t: float) -> None:
        cantera_time: Any = cantera.ReactorNet.initial_time
        cantera_time.__set__(self, t)

    def advance(self, t: float, apply_limit: bool = True) -> float:
        """Advance to a time, or to where a variable has changed by its advance limit.

        Parameters
        ----------
        t
            Time [s].
        apply_limit
            Whether advance limits count.

        Returns
        -------
        float
            The time reached [s].

        Raises
        ------
        InterfaceStopped
            Where a scene ends, with the reason.
        InputError
            For a time that is no finite number.
        cantera.CanteraError
            For a time that is past.
        """
        given: Any = t  # a script may give a text
        if not isinstance(given, SupportsFloat) or not np.isfinite(float(given)):
            raise InputError(f"a network advances to a finite time in s, not to {t!r}; try `advance_to_steady_state`.")
        t = float(given)  # of float32, differences would be rounded to its digits
        self._begin_or_restart()
        if self.time - t > LATER_AHEAD * np.spacing(abs(self.time)):
            raise cantera.CanteraError(f"Cannot integrate backwards in time: {t:.17g} s < {self.time:.17g} s.")
        return self._advance(t, apply_limit)

    def _advance(self, t: float, apply_limit: bool = True) -> float:
        while True:
            goal = min([t, *self._breakpoints()])
            with self._guarded():
                if self.interfaces:
                    self._reach(goal, apply_limit)
                elif not self._is_reached(goal):
                    super().advance(goal, apply_limit)
            self._arrive(float(self.time))
            if self.time >= t or self.time < goal:
                return float(self.time)

    def _reach(self, goal: float, apply_limit: bool) -> None:
        """Advance to a time, through the events of scenes before it."""
        watch = self._watch
        for interface in self.interfaces:
            if interface.scene.events:
                interface.scene.events.until(goal, self.rtol)
        start = np.array(self.get_state()) if apply_limit and np.any(self.advance_limits >= 0) else None
        try:
            while not self._is_reached(goal):
                if self.time >= watch.known:
                    self._locate_event(goal)
                event, now = watch.event, float(self.time)
                end = min(goal, watch.known if event is None else max(event.t, now))
                reached = end if start is None else self._limited(now, end, start)
                watch.follow(reached)
                if reached < end:
                    return
                if event is not None and self.time >= event.t:
                    watch.book()
                    event.interface.jump(self.time, event.index)
                    self._restart(f"the event at t = {self.time:g} s")
        finally:
            watch.book()

    def _is_reached(self, goal: float) -> bool:
        """True if a time is reached.

        Just after a start, a time within rounding is reached by setting the clock, since CVODE takes no step as short.
        """
        if self.time == self._started and 0 < goal - self.time <= LATER_AHEAD * np.spacing(abs(goal)):
            self._set_clock(goal)
            self._started = goal
        return bool(self.time >= goal)

    def _limited(self, now: float, end: float, start: Array) -> float:
        """Return the first time in a step at which a variable has changed by its advance limit, else the end.

        Cantera's limit would count from the last event or request of a step, not from the start of the user's advance.
        """
        limits = np.asarray(self.advance_limits)
        limited = limits >= 0

        def room(_: float, y: Array) -> Array:
            return np.asarray((limits - np.abs(y - start))[limited])

        if np.any(room(now, np.asarray(self.get_state())) < 0):  # an event has passed the limit
            return now
        step = last_step(self, now, end)
        guards = Guards.of([Guard.stop()] * int(limited.sum()), room)
        guards.start(room(now, step.y(now)))
        return first_crossing(step, guards, np.ones(int(limited.sum()), dtype=bool), 0.0)[0]

    def _locate_event(self, goal: float) -> None:
        """Make the integrator take a step, advance a little into it, and locate its first event."""
        super().advance(self._watch.ahead(goal), False)
        self._watch.locate_event()

    def _restart(self, where: str) -> None:
        """Restart the integration from the present state."""
        if self.n_sensitivity_params:
            raise InputError(f"sensitivities end at {where}, where the integration starts anew.")
        for interface in self.interfaces:
            if interface.scene.events:
                interface.jump(self.time)
            self._record(interface, self.time)
        self.reinitialize()

    def reinitialize(self) -> None:
        """Restart the integration from the present states of the reactors, like Cantera's method.

        Changes by a script of an interface or its surroundings, such as an area or a multiplier, need no such call.
        """
        super().reinitialize()
        if not self._fresh:
            self._watch.restart()
            for interface in self.interfaces:
                interface.restarted = self.time
            for interface in self.interfaces[:1]:
                interface.derivatives = Derivatives(self.time)
            self._started = self.time

    def step(self) -> float:
        """Take one step of the integrator, to its end or to the event or breakpoint in it.

        Returns
        -------
        float
            The time reached [s].

        Raises
        ------
        InterfaceStopped
            Where a scene ends, with the reason.
        """
        self._begin_or_restart()
        if not self.interfaces:
            super().step()
            self._arrive(self.time)
            return float(self.time)
        watch, ahead = self._watch, min(self._breakpoints(), default=np.inf)
        if self._is_reached(ahead):
            return self._advance(ahead)
        if self.time >= watch.known:
            with self._guarded():
                self._locate_event(min(ahead, self.time + ASSUMED_LENGTH))
        event = watch.event
        return self._advance(min(ahead, watch.known if event is None else event.t))

    def solve_steady(self, loglevel: int = 0) -> None:
        """Refuse if there are interfaces: surface sites are conserved, so that steady states are not isolated."""
        if self.interfaces:
            problem = "solve_steady does not know reacting surfaces, whose sites are conserved"
            raise InputError(f"{problem}. Use advance_to_steady_state.")
        super().solve_steady(loglevel)

    def _begin_or_restart(self) -> None:
        """Begin, or restart if a script has changed anything."""
        if self._fresh:
            self._begin()
        elif self._surroundings() != self._last_surroundings:  # the integrator has passed this time with the old values
            self._restart(f"what a script has changed at t = {self.time:g} s")
            self._last_surroundings = self._surroundings()

    def _breakpoints(self) -> list[float]:
        """Return the breakpoints ahead, in order."""
        return sorted({b for interface in self.interfaces for b in interface.scene.breakpoints if b > self.time})

    def _surroundings(self) -> list[object]:
        """Return settings and states that a script may change: of reactors, connectors and their reservoirs."""
        own = [reactor for reactor in self.reactors if not isinstance(reactor, StateVectorReactor)]
        joined = [(*each.inlets, *each.outlets, *each.walls, *each.surfaces) for each in own]
        around = [item for item in chain(*joined) if not isinstance(item, HeatWall)]
        ends = [getattr(item, end, None) for item in around for end in SIDES]  # a refused connector lacks a side
        # First, since reactors may share a phase, which must be left in the state of a reactor of the network.
        outside = [end.phase.state.tobytes() for end in ends if end is not None and end not in self.reactors]
        settings = [getattr(item, name, None) for item in (*own, *around) for name in SETTINGS]
        inputs = [interface.inputs_at(float(self.time)) for interface in self.interfaces]
        return [*outside, *map(_contents, own), *settings, *inputs]

    def _begin(self) -> None:
        self._refuse_strangers()
        self._fresh, self._started = False, self.time
        for interface in self.interfaces:
            interface.begin_segment(self.time, self.rtol)
            if interface.scene.events:
                interface.jump(self.time)
            interface.record(self.time)
        if self.interfaces:
            self.reinitialize()

    def _refuse_strangers(self) -> None:
        """Refuse reactors whose interfaces are not in the network, and interfaces whose reactors are not in it."""
        for reactor in self.reactors:
            connected = [interface for interface, _ in getattr(reactor, "sources", ())]
            connected += [wall.interface for wall in reactor.walls if isinstance(wall, HeatWall)]
            for interface in connected:
                if interface not in self.interfaces:
                    raise InputError(interface.left_out(reactor.name))
        for interface in self.interfaces:
            for role, reactor in interface.others():
                if not isinstance(reactor, cantera.Reservoir) and reactor not in self.reactors:
                    problem = f"the reactor that {role} of {interface.name} is not in the network"
                    remedy = "give it to ReactorNet too, or let it be a Reservoir"
                    raise InputError(f"{problem}, so it would never change: {remedy}.")

    def _arrive(self, t: float) -> None:
        pieces = [interface for interface in self.interfaces if t in interface.scene.breakpoints]
        for interface in self.interfaces:
            self._record(interface, t)
        for interface in pieces:
            interface.begin_segment(t, self.rtol)
        if pieces:
            self._restart(f"the breakpoint t = {t:g} s")
        self._last_surroundings = self._surroundings()

    def _record(self, interface: InterfaceReactor, t: float) -> None:
        stats = self.solver_stats
        interface.history.rtol = self.rtol
        interface.history.counters = Counters(
            steps=int(stats["steps"]),
            rejected=int(stats["err_test_fails"] + stats["nonlinear_conv_fails"]),
            residuals=interface.evaluations,
            jacobians=int(stats["jac_evals"]),
            factorizations=int(stats["lin_solve_setups"]),
            iterations=int(stats["nonlinear_iters"]),
        )
        interface.record(t)

    def _swiftest(self) -> str:
        """Describe the variable of the network that changes fastest, beside its value, and what the clock resolves."""
        y, rates = (np.array(self.get_derivative(k)) for k in range(2))
        counts = [len(r.scene.states) if isinstance(r, InterfaceReactor) else r.n_vars for r in self.reactors]
        own = np.hstack([np.arange(r.n_vars) < count for r, count in zip(self.reactors, counts, strict=True)])
        speeds = np.abs(np.divide(rates, y, out=np.zeros_like(y), where=own & (y != 0)))
        fastest, start = int(speeds.argmax()), self.initial_time
        found = f", where {self.component_name(fastest)} changes by {speeds[fastest]:.3g} of itself a second"
        if abs(start) > self.time - start:
            resolved = f"Times are resolved to {np.spacing(self.time):.1g} s there"
            found += f". {resolved}: let `initial_time` be nearer to zero"
        return found

    @contextmanager
    def _guarded(self) -> Iterator[None]:
        """Context in which the network stops at breakpoints, and an interface's exception replaces Cantera's."""
        for interface in self.interfaces:
            interface.passes_breakpoints = True
        try:
            yield
        except cantera.CanteraError:
            for interface in self.interfaces:
                if interface.error is not None:
                    if interface.reason.startswith(NO_SHORTER):
                        interface.reason += self._swiftest()
                        interface.error = InterfaceStopped(interface.reason)
                    interface.end()
                    raise interface.error from None
            raise
        finally:
            for interface in self.interfaces:
                interface.passes_breakpoints = False


def _contents(reactor: Any) -> tuple[bytes, float, bytes]:
    """Return state and volume of a reactor, and its rate constants, which show changes of multipliers."""
    phase = reactor.phase
    reacts = reactor.chemistry_enabled and getattr(phase, "n_reactions", 0)
    return phase.state.tobytes(), reactor.volume, phase.forward_rate_constants.tobytes() if reacts else b""
