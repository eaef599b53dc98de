"""Sweeps: a grid of parameter values, and the runs over it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from surfacechem.format.plans import Plan
from surfacechem.results.audit import SLACK, Audit, audit, lost
from surfacechem.runs import spectrum
from surfacechem.runs.spectrum import Statistics
from surfacechem.solve.contract import Counters, Problem, Result, Status
from surfacechem.solve.jumps import VIOLATES
from surfacechem.solve.radau.solver import Batch, consistent
from surfacechem.solve.run import Model, Run, Trajectory

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Sweep:
    """Runs over a grid, in the order of :attr:`Plan.points`."""

    model: Model
    plan: Plan
    run: Run
    values: Sequence[Mapping[str, float]]
    problems: Sequence[Problem]
    batch: Batch
    seconds: float
    """Run time of the whole batch."""
    exact: Mapping[str, Array] = field(default_factory=dict)

    def __getstate__(self) -> dict[str, Any]:
        """All but machine code, which is made again from the system."""
        return {**vars(self), "problems": [problem.with_program(None) for problem in self.problems]}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Give the problems the machine code that the model has made anew."""
        program = state["model"].program
        vars(self).update(state, problems=[problem.with_program(program) for problem in state["problems"]])

    def __len__(self) -> int:
        """Number of runs."""
        return len(self.problems)

    def __iter__(self) -> Iterator[Trajectory]:
        """The runs in order."""
        return (self[i] for i in range(len(self)))

    def __getitem__(self, i: int) -> Trajectory:
        """One run."""
        problem, batch, n = self.problems[i], self.batch, int(self.batch.counts[i])
        result = Result(
            problem=problem,
            status=Status(int(batch.status[i])),
            t=float(batch.t[i]),
            y=batch.y[i],
            ydot=batch.ydot[i],
            ledger=batch.ledger[i],
            margins=batch.margins[i],
            times=problem.times[:n],
            outputs=batch.outputs[i, :n],
            ledger_outputs=batch.ledger_outputs[i, :n],
            events=batch.events[i],
            counters=Counters(steps=int(batch.steps[i])),
        )
        run = replace(self.run, times=tuple(problem.times.tolist()))
        return Trajectory(
            self.model, run, result, self.values[i], *self.model.verdict(result, self.values[i]), self.seconds
        )

    @cached_property
    def ends(self) -> list[tuple[str, str]]:
        """Status and reason of each run."""
        return [(self[i].status, self[i].reason) for i in range(len(self))]

    @cached_property
    def rates(self) -> Array:
        """Time derivatives of the states at the outputs, [run, output, state]; not set where a run did not arrive."""
        return self._inputs[:, :, 1 + self.model.program.n : 1 + 2 * self.model.program.n]

    @cached_property
    def reached(self) -> NDArray[np.bool_]:
        """Which outputs each run reached, [run, output]."""
        return np.arange(self.batch.outputs.shape[1]) < self.batch.counts[:, None]

    @cached_property
    def times(self) -> Array:
        """Output times [s], [run, output]."""
        return np.array([problem.times for problem in self.problems])

    @cached_property
    def _inputs(self) -> Array:
        """Arguments of compiled functions at every output, zero where a run did not arrive."""
        program, (runs, outputs, n) = self.model.program, self.batch.outputs.shape
        table = np.zeros((runs, outputs, program.n_inputs))
        for i, problem in enumerate(self.problems):
            piece = np.searchsorted(problem.segments[1:-1], problem.times, side="left")
            table[i, :, 1 + 2 * n :] = problem.parameters[piece]
        table[:, :, 0] = self.times
        rows = table[self.reached]
        rows[:, 1 : 1 + n] = self.batch.outputs[self.reached]
        guess = np.zeros((len(rows), n))
        found = consistent(program, rows[:, 0], rows[:, 1 : 1 + n], guess, rows[:, 1 + 2 * n :])
        rows[:, 1 + n : 1 + 2 * n] = found.ydot
        table[self.reached] = rows
        return table

    @cached_property
    def named(self) -> dict[str, Array]:
        """States and named quantities at the outputs, [run, output]; not a number where a run did not arrive."""
        system = self.model.system
        rows = self._inputs[self.reached]
        values = np.full((*self.reached.shape, len(system.states) + len(system.outputs)), np.nan)
        n = len(system.states)
        if len(rows):
            values[self.reached] = np.concatenate([rows[:, 1 : 1 + n], self.model.output_function(rows)], axis=1)
        names = [*(state.name for state in system.states), *(item.name for item in system.outputs)]
        return dict(zip(names, np.moveaxis(values, -1, 0), strict=True))

    @cached_property
    def statistics(self) -> list[Statistics]:
        """Mode, median and mean of the load at rupture of each run; empty where the sweep has none."""
        if self.plan.until is None or not spectrum.breaks_bonds(self.model.system):
            return []
        return [spectrum.statistics(self[i], self.plan.until[0]) for i in range(len(self))]

    @cached_property
    def energy_error(self) -> Array:
        """Largest energy residual of each run relative to the energy it exchanged."""
        supplied, turned = self._booked("energy supply"), self._booked("dissipation")
        return self._residual("E_total", "U_", [supplied], [supplied, turned])

    @cached_property
    def entropy_error(self) -> Array:
        """Largest entropy residual of each run relative to the entropy it exchanged or produced."""
        booked = [self._booked("entropy supply"), self._booked("entropy production")]
        return self._residual("S_total", "S_", booked, booked)

    @cached_property
    def site_error(self) -> Array:
        """Largest residual of the site balances of each run."""
        accounts = [(j, a.law) for j, a in enumerate(self.model.system.ledger) if a.kind == "bonds"]
        worst = np.zeros(len(self))
        for j, name in accounts:
            change = self.named[name] - self.named[name][:, :1]
            booked = np.where(self.reached, self.batch.ledger_outputs[:, :, j], np.nan)
            worst = np.maximum(worst, np.nanmax(np.abs(change - booked), axis=1))
        return worst

    @property
    def destroys_entropy(self) -> NDArray[np.bool_]:
        """Which runs have a law that destroys entropy beyond their tolerance, or a jump that does."""
        return self.violations | (self.entropy_destroyed > 0)

    @property
    def entropy_destroyed(self) -> Array:
        """Most entropy that a jump of each run has destroyed [J/(m^2 K)]; where nothing jumps, none."""
        return np.zeros(len(self))

    @cached_property
    def violations(self) -> NDArray[np.bool_]:
        """Which runs have laws that destroy entropy beyond their tolerance, alone or together."""
        system, lengths = self.model.system, np.diff(self.times)
        both = self.reached[:, 1:] & self.reached[:, :-1]
        suspect = np.zeros(len(self), dtype=bool)
        accounts = [(j, f"sigma_{a.law}") for j, a in enumerate(system.ledger) if a.kind == "entropy production"]
        for j, name in accounts:
            booked = np.diff(np.where(self.reached, self.batch.ledger_outputs[:, :, j], 0.0))
            seen = self.named[name][:, 1:] * lengths
            amount, whole = lost(np.where(both, booked, 0.0), np.where(both, seen, 0.0))
            suspect |= ~(amount <= SLACK * self.run.rtol * whole)
        return np.array([doubt and self.books(i).destroys for i, doubt in enumerate(suspect)], dtype=bool)

    def books(self, i: int) -> Audit:
        """The audit of one run."""
        return audit(self[i])

    def _residual(self, total: str, prefix: str, booked: Sequence[Array], exchanged: Sequence[Array]) -> Array:
        """What a total changed by without being booked, relative to the largest part that was exchanged."""
        change = self.named[total] - self.named[total][:, :1]
        names = [f"{prefix}{suffix}" for suffix in ("1", "2", "c")]
        stored = [self.named[name] - self.named[name][:, :1] for name in names if name in self.named]
        parts = [*stored, *(column for block in exchanged for column in np.moveaxis(block, -1, 0))]
        scale = np.max([np.nanmax(np.abs(part), axis=1) for part in parts], axis=0, initial=0.0)
        worst = np.nanmax(np.abs(change - sum(block.sum(axis=-1) for block in booked)), axis=1)
        return np.asarray(np.where(scale > 0, worst / np.where(scale > 0, scale, 1.0), worst))

    def _booked(self, kind: str) -> Array:
        columns = [j for j, account in enumerate(self.model.system.ledger) if account.kind == kind]
        values = self.batch.ledger_outputs[:, :, columns]
        return np.asarray(np.where(self.reached[:, :, None], values, np.nan))


@dataclass(frozen=True, kw_only=True)
class Separate(Sweep):
    """A sweep whose runs were made one by one."""

    trajectories: Sequence[Trajectory]

    def __getitem__(self, i: int) -> Trajectory:
        """One run."""
        return self.trajectories[i]

    @cached_property
    def _inputs(self) -> Array:
        table = np.zeros((*self.batch.outputs.shape[:2], self.model.program.n_inputs))
        for i, trajectory in enumerate(self.trajectories):
            result = trajectory.result
            rows = self.model.inputs(result, result.times, result.outputs, trajectory.rates)
            table[i, : len(rows)] = self.model.program.filled(rows)
        return table

    @cached_property
    def _audits(self) -> list[Audit]:
        return [audit(trajectory) for trajectory in self.trajectories]

    @cached_property
    def energy_error(self) -> Array:
        """Largest energy residual of each run relative to the energy it exchanged."""
        return np.array([books.energy_error for books in self._audits])

    @cached_property
    def entropy_error(self) -> Array:
        """Largest entropy residual of each run relative to the entropy it exchanged or produced."""
        return np.array([books.entropy_error for books in self._audits])

    @cached_property
    def site_error(self) -> Array:
        """Largest residual of the site balances of each run."""
        return np.array([books.site_error for books in self._audits])

    def books(self, i: int) -> Audit:
        """The audit of one run."""
        return self._audits[i]

    @cached_property
    def violations(self) -> NDArray[np.bool_]:
        """Which runs have laws that destroy entropy beyond their tolerance, alone or together."""
        return np.array([books.destroys for books in self._audits], dtype=bool)

    @cached_property
    def entropy_destroyed(self) -> Array:
        """Most entropy that a jump of each run has destroyed [J/(m^2 K)]; one that was refused destroys none."""
        flagged = [[j for j in run.jumps if j.verdict == VIOLATES and not j.stops] for run in self.trajectories]
        return np.array([max((-jump.entropy for jump in jumps), default=0.0) for jumps in flagged])
