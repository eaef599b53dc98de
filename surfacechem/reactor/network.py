"""A ReactorNet that stops where histories jump and where a scene ends."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import cantera

from surfacechem.errors import InputError
from surfacechem.reactor.interface import InterfaceReactor
from surfacechem.solvers.contract import Counters

GROWTH = 1e4
"""How much longer than the last a step of CVODE may be: after the first step this, later 10."""


class ReactorNet(cantera.ReactorNet):
    """Cantera's ReactorNet for networks with interfaces.

    ``advance`` and ``step`` end a step at every breakpoint of a prescribed history, record the interfaces, and raise
    InterfaceStopped with the reason where a scene ends.
    """

    def __init__(self, reactors: Sequence[Any] = ()) -> None:
        self.interfaces: list[InterfaceReactor] = []
        self._last_step = 0.0
        self._steps = 0
        self._fresh = True
        super().__init__(reactors)
        self.interfaces += [reactor for reactor in reactors if isinstance(reactor, InterfaceReactor)]

    def advance(self, t: float, apply_limit: bool = True) -> float:
        """Advance to time t [s]; returns the time reached."""
        while True:
            goal = min([t, *self._breakpoints()])
            with self._guarded():
                super().advance(goal, apply_limit)
            self._arrive(goal)
            if goal >= t or self.time < goal:
                return float(self.time)

    def step(self) -> float:
        """Take one step of the integrator, or go to the next breakpoint where a step could pass it."""
        following = self._breakpoints()
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

    def _breakpoints(self) -> list[float]:
        """Breakpoints ahead, in order."""
        if self._fresh:
            self._begin()
        return sorted({b for interface in self.interfaces for b in interface.scene.breakpoints if b > self.time})

    def _begin(self) -> None:
        self._fresh = False
        for interface in self.interfaces:
            interface.begin_piece(self.time, self.rtol)
            interface.record(self.time)

    def _arrive(self, t: float) -> None:
        pieces = [interface for interface in self.interfaces if t in interface.scene.breakpoints]
        for interface in self.interfaces:
            self._record(interface, t)
        for interface in pieces:
            interface.begin_piece(t, self.rtol)
        if pieces:
            if self.n_sensitivity_params:
                raise InputError(f"sensitivities end at the breakpoint t = {t:g} s, where the integration starts anew.")
            self.reinitialize()
            self._steps = 0

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
