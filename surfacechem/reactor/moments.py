"""Events of a scene that a reactor network integrates: what is due at a moment, where in a step, and what follows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from surfacechem.solve.adapters.evaluation import Evaluation
from surfacechem.solve.contract import Array, Problem
from surfacechem.solve.equilibria import Point
from surfacechem.solve.instant import Instant
from surfacechem.solve.jumps import Jump
from surfacechem.solve.run import Model

GLOBAL = 100
"""By how much the error of a state may exceed the tolerance of a step."""


class Moments:
    """The instants of a scene whose arcs something else integrates, without a time of their own."""

    def __init__(self, model: Model, problem: Problem, evaluation: Evaluation) -> None:
        assert model.jumper is not None
        self.system, self.jumper = model.system, model.jumper
        self.instant = Instant(model.system, model.jumper, problem, len(model.margins))
        self.evaluation = evaluation
        """Present state and parameters of the scene."""
        self.loads: Array | None = None
        """Parameters of the piece of time that has just ended."""

    @property
    def jumps(self) -> list[Jump]:
        """What has happened so far."""
        return self.instant.jumps

    def until(self, goal: float, rtol: float) -> None:
        """The time that is integrated next, and how closely; what is brief is so against it."""
        self.instant.end, self.instant.rtol = goal, GLOBAL * rtol

    def begin_piece(self, parameters: Array) -> None:
        """Go on with the present modes and other parameters."""
        own, columns = self.evaluation.parameters, self.jumper.mode_columns
        modes, self.loads = own[columns].copy(), own.copy()
        own[:] = parameters
        own[columns] = modes

    def here(self) -> Point:
        """The state last put."""
        at = self.evaluation
        return Point(float(at.inputs[0]), at.y.copy(), at.ydot.copy(), at.parameters.copy())

    def margins(self) -> Array:
        """Guards of the edges at the state last put, infinite where they are not in play."""
        now, playing = self.evaluation.margins(), self.instant.in_play(self.here())
        self.instant.see(self.evaluation.y)
        return np.where(playing, now, np.inf)[self.instant.first :]

    def soonest(self) -> float:
        """Time [s] in which a guard of the state last put would close at its present rate."""
        now, rates = self.margins(), self.jumper.guard_rates(self.here().inputs())
        with np.errstate(divide="ignore", invalid="ignore"):
            left = np.where((now > 0) & (rates < 0), -now / rates, np.inf)
        return float(left.min(initial=np.inf))

    def settle(self) -> Array | None:
        """Carry out what is due at the state last put: additions to the ledger; None where the scene ends here."""
        before, here, loads = self.instant.booked.copy(), self.here(), self.loads
        begun: Point | None = here
        if loads is not None:
            histories = [parameter.load is not None for parameter in self.system.parameters]
            last = replace(here, parameters=np.where(histories, loads, here.parameters))
            begun, self.loads = self.instant.begin(here, last), None
        return self._taken(self.instant.resolve(begun) if begun is not None else None, before)

    def fire(self, index: int) -> Array | None:
        """Carry out an edge at the state last put, and what follows at once."""
        before = self.instant.booked.copy()
        point = self.instant.apply(index, self.here())
        return self._taken(self.instant.resolve(point) if point is not None else None, before)

    def _taken(self, point: Point | None, before: Array) -> Array | None:
        """Go on from a point; what the ledger has gained since."""
        if point is None:
            return None
        self.evaluation.parameters[:] = point.parameters
        self.evaluation.restart(point.y)
        return self.instant.booked - before
