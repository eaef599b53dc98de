"""A sweep as a labelled dataset: every quantity over the swept parameters, how each run ended, errors and run time."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from surfacechem.format.plans import STATISTICS, Axis, Plan
from surfacechem.model.system import System
from surfacechem.results.dataset import Results, quantities, quantity_columns
from surfacechem.results.event_table import entropy_destroyed, event_columns
from surfacechem.results.netcdf import Column, versions
from surfacechem.runs.sweeps import Sweep, SweepAccuracy

Array = NDArray[np.float64]


@dataclass(frozen=True, repr=False)
class SweepSolution(Results):
    """What a sweep hands back."""

    sweep: Sweep
    title: str = ""
    source: str = ""
    case: str = ""
    mechanism: str = ""
    accuracy: SweepAccuracy | None = None
    changes: Mapping[str, float] = field(default_factory=dict)
    """Parameters and initial values that differ from the case, by path."""

    def __repr__(self) -> str:
        """Title, size and ends in a line."""
        return f"<SweepSolution {self.title!r}: {len(self.sweep)} runs, {self.ends}>"

    @property
    def plan(self) -> Plan:
        """What was swept."""
        return self.sweep.plan

    @property
    def system(self) -> System:
        """The assembled equations."""
        return self.sweep.model.system

    @property
    def ends(self) -> str:
        """How many runs ended in which way, in words."""
        every = [run.status for run in self.sweep]
        return ", ".join(f"{every.count(status)} {status}" for status in dict.fromkeys(every))

    @property
    def status(self) -> str:
        """'failed' if a run failed numerically, 'stopped' if physics stopped all of them, else 'finished'.

        That physics stops some runs is a result of a sweep; that all bonds break is what a spectrum is made for.
        """
        every = {run.status for run in self.sweep}
        stopped = every == {"stopped"} and not self.sweep.statistics
        return "failed" if "failed" in every else "stopped" if stopped else "finished"

    @cached_property
    def axes(self) -> dict[str, Axis]:
        """The swept parameters by the names of their dimensions."""
        taken = {*quantities(self.system), *self.system.inside, "time"}
        axes: dict[str, Axis] = {}
        for axis in self.plan.axes:
            parts = [
                p.replace("-", "_").replace("[", "_").strip("]") for p in axis.path.removesuffix(".level").split(".")
            ]
            names = ["_".join(parts[-k:]) for k in range(1, len(parts) + 1)]
            axes[next((name for name in names if name not in taken | set(axes)), f"{names[-1]}_swept")] = axis
        return axes

    @cached_property
    def columns(self) -> tuple[Column, ...]:
        """Every variable of the dataset, the coordinates first."""
        along = quantity_columns(self.sweep.runs, self.inner, self._shape)
        return (
            *self._coordinates(next((column for column in along if column.name == self.inner), None)),
            *(column for column in along if column.name != self.inner),
            *self._of_runs(),
            *event_columns(self.sweep.runs, self._shape),
            *self._statistics(),
        )

    @property
    def _shape(self) -> dict[str, int]:
        """Names and sizes of the dimensions of the swept parameters."""
        return dict(zip(self.axes, self.plan.shape, strict=True))

    @property
    def inner(self) -> str:
        """The dimension along each run: time, or the load that all runs grow to."""
        return self.plan.until[0] if self.plan.until else "time"

    def _coordinates(self, load: Column | None) -> list[Column]:
        """The swept parameters, and the times or, where a load ends the runs, the values of this."""
        columns = []
        for name, axis in self.axes.items():
            unit, text = self._meaning(axis.path)
            columns.append(Column(name, (name,), np.asarray(axis.values, dtype=float), unit, text))
        times = np.array([run.result.problem.times for run in self.sweep])
        if self.plan.until is None or load is None:
            return [*columns, Column("time", ("time",), times[0], "s", "time since the start")]
        start = float(load.values.flat[0])
        values = start + (self.plan.until[1] - start) * times[0] / times[0, -1]
        each = times.reshape(*self.plan.shape, -1)
        return [
            *columns,
            Column(self.inner, (self.inner,), values, load.unit, load.long_name),
            Column("time", (*self.axes, self.inner), each, "s", "time since the start"),
        ]

    def _meaning(self, path: str) -> tuple[str, str]:
        """Unit and long name of a swept value."""
        state = next((s for s in self.system.states if path == s.path), None)
        if state is not None:
            quantity, _ = state.at_start
            return quantity.unit, f"initial {quantity.long_name}"
        spec = next(p.spec for p in self.system.parameters if p.path == path)
        return spec.unit, f"{spec.text} ({path})"

    def _of_runs(self) -> list[Column]:
        """How each run ended, and what its balances, jumps and error are."""
        runs, audits = self.sweep.runs, self.sweep.audits
        destroyed = [entropy_destroyed(run.jumps) for run in runs]
        destroys = [books.destroys or most > 0 for books, most in zip(audits, destroyed, strict=True)]
        residuals = {
            "energy": "largest energy residual relative to the energy exchanged",
            "entropy": "largest entropy residual relative to what was exchanged",
            "site": "largest residual of the site balances",
        }
        columns = [
            self._of_each("status", [run.status for run in runs], "1", "how the run ended"),
            self._of_each("reason", [run.reason for run in runs], "1", "why the run ended"),
            self._of_each("time_reached", [run.result.t for run in runs], "s", "time that the run reached"),
            self._of_each("steps", [run.result.counters.steps for run in runs], "1", "steps of the run"),
            *(
                self._of_each(f"{balance}_error", [getattr(books, f"{balance}_error") for books in audits], "1", text)
                for balance, text in residuals.items()
            ),
            self._of_each("destroys_entropy", destroys, "1", "1 where a law or a jump does, else 0"),
        ]
        if self.system.edges:
            text = "most entropy that a jump has destroyed"
            columns.append(self._of_each("entropy_destroyed", destroyed, "J/(m^2 K)", text))
        if self.accuracy:
            text = "largest relative error of the run"
            columns.append(self._of_each("error", self.accuracy.errors, "1", text))
        return columns

    def _of_each(self, name: str, values: Sequence[Any] | Array, unit: str, text: str) -> Column:
        """A column of one value a run."""
        shaped = np.array(values, object if isinstance(values[0], str) else float).reshape(self.plan.shape)
        return Column(name, tuple(self.axes), shaped, unit, text)

    def _statistics(self) -> list[Column]:
        columns = []
        exact = self.accuracy.exact if self.accuracy else {}
        for which, word in STATISTICS.items() if self.sweep.statistics else ():
            quantity = quantities(self.system)[self.inner]
            found = np.array([getattr(statistics, which) for statistics in self.sweep.statistics])
            text = f"{word} {quantity.long_name} at rupture"
            for suffix, values in (("", found), ("_exact", exact.get(which))):
                if values is not None:
                    name = f"{self.inner}_{which}{suffix}"
                    label = f"exact {text}" if suffix else text
                    columns.append(self._of_each(name, values, quantity.unit, label))
        return columns

    @cached_property
    def attributes(self) -> dict[str, str | float | int]:
        """Global attributes: scalars and strings only."""
        sweep, run = self.sweep, self.sweep.run
        error: dict[str, str | float] = {}
        if self.accuracy:
            known = self.accuracy.errors[np.isfinite(self.accuracy.errors)]
            worst = float(np.max(known)) if len(known) else np.nan
            error = {"error": worst, "error_source": self.accuracy.source}
        return {
            **self._origin(run),
            "sweep": self.plan.record,
            **({"departures": json.dumps({"changes": dict(self.changes)})} if self.changes else {}),
            "status": self.status,
            "reason": self.ends,
            "regime": self.system.regime,
            "solver": run.solver,
            "rtol": float(run.rtol),
            "runs": len(sweep),
            "count_steps": sweep.steps,
            "run_seconds": float(sweep.seconds),
            "compile_seconds": float(sweep.model.compile_seconds),
            **error,
            "energy_error": sweep.worst("energy"),
            "entropy_error": sweep.worst("entropy"),
            "site_error": sweep.worst("site"),
            "versions": versions(),
        }
