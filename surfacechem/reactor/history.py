"""What a scene in a network went through, as the solution that a run hands back."""

from __future__ import annotations

import numpy as np

from surfacechem.errors import InputError
from surfacechem.reactor.embedded import EmbeddedScene
from surfacechem.results.solution import Solution
from surfacechem.solve.contract import Array, Counters, Events, Problem, Result, Status
from surfacechem.solve.run import Run, Trajectory
from surfacechem.tolerances import DEFAULT_RTOL


class History:
    """Recorded states of a scene, each with the parameters that held."""

    def __init__(self, scene: EmbeddedScene) -> None:
        self.scene = scene
        self.rtol = DEFAULT_RTOL
        self.counters = Counters()
        self.times: list[float] = []
        self.rows: list[tuple[Array, Array, Array, Array]] = []

    def append(self, t: float, x: Array) -> None:
        """Keep variables at a time; a time that is there already is kept as it is."""
        if self.times and t <= self.times[-1]:
            return
        evaluation, n = self.scene.evaluation, len(self.scene.states)
        self.scene.put(t, x)
        self.times.append(t)
        self.rows.append((evaluation.y.copy(), evaluation.ydot.copy(), x[n:].copy(), evaluation.parameters.copy()))

    def solution(self, stop: str, seconds: float, *, alone: bool) -> Solution:
        """The recorded states as a run, ended by ``stop`` where that is not empty.

        Only what ran ``alone`` carries its case, from which a run can be made again.
        """
        if len(self.times) < 2:
            raise InputError("nothing was recorded yet: advance the network, or call `record`, at least twice.")
        run = Run(times=(0.0, self.times[-1]), rtol=self.rtol, solver="cantera")
        reason = stop or f"reached the end at t = {self.times[-1]:.9g} s"
        status = "stopped" if stop else "finished"
        result = self._result(Status.EVENT if stop else Status.FINISHED)
        case, moments = self.scene.case, self.scene.moments
        jumps = tuple(moments.jumps) if moments else ()
        return Solution(
            Trajectory(self.scene.model, run, result, self.scene.values, status, reason, seconds, jumps),
            title=case.title,
            source=case.source,
            case=case.text if alone else "",
            mechanism=case.mechanism_text or "",
        )

    def _result(self, status: Status) -> Result:
        problem = self._problem()
        y, ydot, ledger, _ = self.rows[-1]
        n, q = problem.program.n, problem.program.n_ledger
        none = Events(*(np.empty(shape) for shape in (0, (0, n), (0, n), (0, q))), index=np.empty(0, np.int64))
        return Result(
            problem=problem,
            status=status,
            t=self.times[-1],
            y=y,
            ydot=ydot,
            ledger=ledger,
            margins=np.zeros(problem.program.n_margins),
            times=problem.times,
            outputs=np.array([row[0] for row in self.rows]),
            ledger_outputs=np.array([row[2] for row in self.rows]),
            events=none,
            counters=self.counters,
        )

    def _problem(self) -> Problem:
        """A piece of time up to each record, with the parameters that held there."""
        base, times = self.scene.problem, np.array(self.times)
        before = times[0] - max(1.0, abs(times[0]))
        return Problem(
            program=base.program,
            y0=self.rows[0][0],
            times=times,
            segments=np.concatenate(([before], times)),
            parameters=np.array([row[3] for row in self.rows]),
            rtol=self.rtol,
            atol=base.atol,
            margins=base.margins,
        )
