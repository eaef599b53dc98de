"""Events of a scene that a reactor network integrates: what is due at a moment, where in a step, and what follows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from surfacechem.solve import ASKING, solver
from surfacechem.solve.adapters.evaluation import Evaluation
from surfacechem.solve.arcs import changed
from surfacechem.solve.contract import Array, Problem
from surfacechem.solve.equilibria import Point
from surfacechem.solve.hybrid import AT_ONCE, REACHED, Hybrid
from surfacechem.solve.run import Model

GLOBAL = 100
"""By how much the error of a state may exceed the tolerance of a step."""


class Moments(Hybrid):
    """The transitions of a scene whose stretches something else integrates, without a time of their own."""

    evaluation: Evaluation
    """Present state and parameters of the scene."""
    loads: Array | None = None
    """Parameters of the piece of time that has just ended."""

    @classmethod
    def of(cls, model: Model, problem: Problem, evaluation: Evaluation) -> Moments | None:
        """Those of a model, None where it has none; ``evaluation`` holds the present state and parameters."""
        if model.jumper is None:
            return None
        made = cls(model.system, solver(ASKING[0]), model.jumper, problem, len(model.margins))
        made.largest = np.zeros(len(problem.margins))
        made.booked = np.zeros(problem.program.n_ledger)
        made.evaluation = evaluation
        return made

    def until(self, goal: float, rtol: float) -> None:
        """The time that is integrated next, and how closely; what is brief is so against it."""
        self.problem = changed(self.problem, segments=np.array([0.0, goal]), rtol=GLOBAL * rtol)

    @property
    def modes(self) -> Array:
        """Present modes."""
        return self.evaluation.parameters[self.jumper.mode_columns].copy()

    def begin_piece(self, parameters: Array) -> None:
        """Go on with the present modes and other parameters."""
        modes, self.loads = self.modes, self.evaluation.parameters.copy()
        self.evaluation.parameters[:] = parameters
        self.evaluation.parameters[self.jumper.mode_columns] = modes

    def here(self) -> Point:
        """The state last put."""
        at = self.evaluation
        return Point(float(at.inputs[0]), at.y.copy(), at.ydot.copy(), at.parameters.copy())

    def margins(self) -> Array:
        """Margins of the transitions at the state last put."""
        now = self.evaluation.margins().copy()
        playing = np.array(self.system.in_play(self.evaluation.parameters))
        self._see(now, playing)
        return np.where(playing, now, np.inf)[self.first :]

    def soonest(self) -> float:
        """Time [s] in which a margin of the state last put would close at its present rate."""
        now, rates = self.margins(), self.jumper.margin_rates(self.here())
        with np.errstate(divide="ignore", invalid="ignore"):
            left = np.where((now > 0) & (rates < 0), -now / rates, np.inf)
        return float(left.min(initial=np.inf))

    def settle(self) -> Array | None:
        """Carry out what is due at the state last put: additions to the ledger; None where the scene ends here."""
        before, here, loads = self.booked.copy(), self.here(), self.loads
        begun: Point | None = here
        if loads is not None:
            histories = [parameter.load is not None for parameter in self.system.parameters]
            begun = self._begun(here, replace(here, parameters=np.where(histories, loads, here.parameters)))
            self.loads = None
        point = self._settled(begun) if begun is not None else None
        return None if point is None else self._taken(point, before)

    def fire(self, index: int) -> Array | None:
        """Carry out a transition at the state last put, and what follows at once."""
        before = self.booked.copy()
        point = self._jump(index, self.here())
        point = self._settled(point) if point is not None else None
        return None if point is None else self._taken(point, before)

    def lost(self) -> int | None:
        """The transition at which an equilibrium was lost near the state last put, if any."""
        return self.jumper.equilibria.lost(self.here(), self.problem.rtol)

    def _taken(self, point: Point, before: Array) -> Array:
        self.evaluation.parameters[:] = point.parameters
        self.evaluation.restart(point.y)
        return self.booked - before

    def _chatters(self, t: float) -> bool:
        recent = len(self.jumps) - self.calm
        return recent >= AT_ONCE and self.jumps[-AT_ONCE].t >= t - REACHED * t
