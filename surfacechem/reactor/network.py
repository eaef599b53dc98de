"""A ReactorNet that stops where histories jump, where a scene jumps and where it ends."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cached_property
from typing import Any

import cantera
import numpy as np

from surfacechem.errors import InputError
from surfacechem.reactor.interface import InterfaceReactor
from surfacechem.reactor.watch import Watch
from surfacechem.solve.contract import Counters

GROWTH = 1e4
"""How much longer than the last a step of CVODE may be: after the first step this, later 10."""

LONGEST = 1.0
"""Time that counts as what is integrated where no end is given [s]."""


class ReactorNet(cantera.ReactorNet):
    """Cantera's ReactorNet for networks with interfaces.

    ``advance`` and ``step`` end a step at every breakpoint of a prescribed history and at every event of a scene, whose
    jump they carry out, record the interfaces, and raise InterfaceStopped with the reason where a scene ends.
    """

    def __init__(self, reactors: Sequence[Any] = ()) -> None:
        self.interfaces: list[InterfaceReactor] = []
        self._last_step = 0.0
        self._steps = 0
        self._fresh = True
        super().__init__(reactors)
        self.interfaces += [reactor for reactor in reactors if isinstance(reactor, InterfaceReactor)]

    @cached_property
    def _watch(self) -> Watch:
        return Watch(self, self.interfaces)

    def advance(self, t: float, apply_limit: bool = True) -> float:
        """Advance to time t [s]; returns the time reached."""
        while True:
            goal = min([t, *self._breakpoints()])
            with self._guarded():
                self._reach(goal, apply_limit)
            self._arrive(goal)
            if goal >= t or self.time < goal:
                return float(self.time)

    def _reach(self, goal: float, apply_limit: bool) -> None:
        """Advance to a time, through the events of scenes on the way."""
        watch = self._watch
        if not watch.interfaces:
            super().advance(goal, apply_limit)
        for interface in watch.interfaces:
            interface.scene.moments.until(goal, self.rtol)  # type: ignore[union-attr]
        while self.time < goal:
            before = self.time
            if self.time >= watch.known:
                self._look(goal, apply_limit)
            event, now = watch.event, self.time
            super().advance(min(goal, watch.known if event is None else max(event.t, now)), apply_limit)
            watch.book(now, self.time)
            if event is not None and self.time >= event.t:
                event.interface.jump(self.time, event.index)
                self._anew(f"the event at t = {self.time:g} s")
            elif self.time <= before:
                return  # a limit that the user has set has stopped it

    def _look(self, goal: float, apply_limit: bool = True) -> None:
        """Let the integrator take a step, and go a little way into it."""
        before = self.time
        super().advance(self._watch.ahead(goal), apply_limit)
        self._watch.look()
        self._watch.book(before, self.time)

    def _anew(self, where: str) -> None:
        """Start the integration anew from where it is."""
        if self.n_sensitivity_params:
            raise InputError(f"sensitivities end at {where}, where the integration starts anew.")
        for interface in self._watch.interfaces:
            interface.jump(self.time)
            self._record(interface, self.time)
        self.reinitialize()
        self._watch.restart()
        self._steps = 0

    def step(self) -> float:
        """Take one step of the integrator, or go to the next breakpoint where a step could pass it."""
        following = self._breakpoints()
        if self._watch.interfaces:
            return self._watched_step(following)
        growth = GROWTH if self._steps < 2 else 10.0
        if following and (self._steps == 0 or self.time + growth * self._last_step >= following[0]):
            return self.advance(following[0])
        before = self.time
        with self._guarded():
            super().step()
        self._steps += 1
        self._last_step = self.time - before
        self._arrive(self.time)
        return float(self.time)

    def _watched_step(self, following: Sequence[float]) -> float:
        """To the end of the integrator's next step, or the event or breakpoint in it."""
        watch, ahead = self._watch, min(following, default=np.inf)
        if self.time >= watch.known:
            with self._guarded():
                self._look(min(ahead, self.time + LONGEST))
        event = watch.event
        return self.advance(min(ahead, watch.known if event is None else event.t))

    def _breakpoints(self) -> list[float]:
        """Breakpoints ahead, in order."""
        if self._fresh:
            self._begin()
        return sorted({b for interface in self.interfaces for b in interface.scene.breakpoints if b > self.time})

    def _begin(self) -> None:
        self._fresh = False
        self._refuse_strangers()
        for interface in self.interfaces:
            interface.begin_piece(self.time, self.rtol)
            if interface.scene.moments:
                interface.jump(self.time)
            interface.record(self.time)
        if self._watch.interfaces:
            self.reinitialize()

    def _refuse_strangers(self) -> None:
        """A reactor that takes the place of a body changes only if it is in the network."""
        for interface in self.interfaces:
            for body, reactor in interface.bodies.items():
                known = isinstance(reactor, cantera.Reservoir) or any(item is reactor for item in self.reactors)
                if not known:
                    raise InputError(
                        f"the reactor that stands for the body {body} of {interface.name} is not in the network, so "
                        "its temperature would never change: give it to ReactorNet too, or let it be a Reservoir."
                    )

    def _arrive(self, t: float) -> None:
        pieces = [interface for interface in self.interfaces if t in interface.scene.breakpoints]
        for interface in self.interfaces:
            self._record(interface, t)
        for interface in pieces:
            interface.begin_piece(t, self.rtol)
        if pieces:
            self._anew(f"the breakpoint t = {t:g} s")

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

    @contextmanager
    def _guarded(self) -> Iterator[None]:
        """Breakpoints are looked after; what an interface raises comes out as it is."""
        for interface in self.interfaces:
            interface.passes_breakpoints = True
        try:
            yield
        except cantera.CanteraError:
            for interface in self.interfaces:
                if interface.error is not None:
                    interface.end()
                    raise interface.error from None
            raise
        finally:
            for interface in self.interfaces:
                interface.passes_breakpoints = False
