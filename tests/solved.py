"""Runs of scenes built in Python, by the names of their states, quantities, accounts and events."""

from typing import Any

import numpy as np

from surfacechem.model.assemble import assemble
from surfacechem.results.audit import audit
from surfacechem.scene import Scene
from surfacechem.solve.jumps import Jump
from surfacechem.solve.run import Model, Run, Trajectory


class Solved:
    """A trajectory, and what is in it by name."""

    def __init__(self, trajectory: Trajectory) -> None:
        self.trajectory = trajectory
        self.system = trajectory.model.system
        self.states = [state.name for state in self.system.states]

    def __getattr__(self, name: str) -> Any:
        return getattr(self.trajectory, name)

    def __getitem__(self, name: str) -> np.ndarray:
        """A state, named quantity or account at the output times."""
        result = self.trajectory.result
        found = dict(zip(self.states, result.outputs.T, strict=True))
        found |= {item.name: self.trajectory.outputs[:, j] for j, item in enumerate(self.system.outputs)}
        found |= {account.quantity.name: result.ledger_outputs[:, j] for j, account in enumerate(self.system.ledger)}
        return found[name]

    @property
    def events(self) -> list[str]:
        """Names of the events."""
        return [jump.edge.name for jump in self.trajectory.jumps]

    def of(self, name: str) -> list[Jump]:
        """The jumps of a transition."""
        return [jump for jump in self.trajectory.jumps if jump.edge.name.startswith(name)]

    def state(self, jump: Jump, name: str, side: str = "after") -> float:
        """A state beside a jump."""
        return float(getattr(jump, side).y[self.states.index(name)])

    def account(self, name: str, when: int) -> float:
        """A line of the ledger at an event."""
        column = [account.quantity.name for account in self.system.ledger].index(name)
        return float(self.trajectory.result.events.ledger[when, column])

    def end(self, name: str) -> float:
        """A state where the run ends."""
        return float(self.trajectory.result.y[self.states.index(name)])

    def booked(self, name: str) -> float:
        """An account where the run ends."""
        return float(self.trajectory.result.ledger[[a.quantity.name for a in self.system.ledger].index(name)])

    @property
    def energy_error(self) -> float:
        return audit(self.trajectory).energy_error

    @property
    def findings(self) -> tuple[str, ...]:
        return audit(self.trajectory).findings


def solve(given: Scene | Model, times, changes=None, outputs: int = 11, **settings) -> Solved:
    """A run to a time, with so many outputs evenly spread, or over output times."""
    model = given if isinstance(given, Model) else Model(assemble(given))
    times = np.linspace(0.0, times, outputs) if np.isscalar(times) else times
    times = [float(t) for t in times]
    return Solved(model.solve(Run(times=times if times[0] == 0 else (0.0, *times), **settings), changes))


def closed(given: Scene | Model, times, changes=None, exact: float = 1e-9, **settings) -> Solved:
    """A run that finishes, destroys no entropy, and whose energy is closed but for the last digits of the states."""
    solved = solve(given, times, changes, **settings)
    assert solved.status == "finished", solved.reason
    books = audit(solved.trajectory)
    assert np.max(np.abs(books.energy) - books.energy_rounding) <= exact * books.energy_scale
    assert books.violations == ()
    return solved
