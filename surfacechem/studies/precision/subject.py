"""What is measured: a compiled case that any solver may run at any tolerance."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from surfacechem.scene import Scene
from surfacechem.solve import ASKING, solver
from surfacechem.solve.run import Model, Run, Trajectory

MOST_SECONDS = 60.0
"""A solve that takes longer than this counts as failed, unless the case allows less."""


@dataclass(frozen=True)
class Subject:
    """A case as the study sees it; ``exact`` names its exact solution, with its parameters."""

    name: str
    title: str
    text: str
    scene: Scene
    model: Model
    run: Run
    exact: tuple[str, Mapping[str, float]] | None = None
    changes: Mapping[str, float] = field(default_factory=dict)

    @property
    def states(self) -> list[str]:
        """Names of the states."""
        system = self.model.system
        return [state.name for state in system.states if state.name not in system.inside]

    @property
    def names(self) -> list[str]:
        """Names of all that may be compared."""
        return [*self.states, *(item.name for item in self.model.system.outputs)]

    def settings(self, name: str, rtol: float, limit: float = MOST_SECONDS) -> Run:
        """The run of the case with another solver and tolerance, its absolute tolerance in proportion."""
        run = self.run
        atol = None if run.atol is None else run.atol * rtol / run.rtol
        return replace(run, solver=name, rtol=rtol, atol=atol, max_seconds=run.max_seconds or limit)

    def solve(self, name: str, rtol: float, limit: float = MOST_SECONDS) -> Trajectory | str:
        """A run, or in words why the solver could not even say how it failed."""
        try:
            return self.model.solve(self.settings(name, rtol, limit), self.changes)
        except (ArithmeticError, RuntimeError, ValueError, np.linalg.LinAlgError) as error:
            return f"{type(error).__name__}: {error}"

    def unable(self, name: str) -> str:
        """Why a solver cannot run this case; empty where it can."""
        if self.model.program.filler is not None and name not in ASKING:
            return "rates of the mechanism come from Cantera itself, which this solver cannot ask"
        try:
            solver(name)
        except ImportError as error:
            return f"its library cannot be imported: {error}"
        return ""
