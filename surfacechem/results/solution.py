"""Results of a run: balances, error, warnings, and a labelled dataset."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from surfacechem.results.accuracy import Accuracy
from surfacechem.results.audit import Audit, Balances, BalanceVerdict, audit, findings, least_productions, verdicts
from surfacechem.results.dataset import (
    DATASET_NAMES,
    Results,
    coverage_columns,
    profile_columns,
    quantity_columns,
    surface_columns,
)
from surfacechem.results.event_table import event_columns, event_findings, event_waits
from surfacechem.results.netcdf import Column, versions
from surfacechem.results.refinement import refined
from surfacechem.solve import AUTO, solver
from surfacechem.solve.contract import Status
from surfacechem.solve.jumps import ADMISSIBLE
from surfacechem.solve.run import Run, Trajectory

RECORDED_SETTINGS: tuple[str, ...] = ("times", "picture", "atol", "max_steps")
"""Settings of a run that a dataset records if they differ from those of its case; others are attributes."""

ASKED_SETTINGS = ("solver", "accuracy", "rtol")
"""Those from which solver and tolerances of a run follow that are chosen for an accuracy."""


def run_warnings(
    trajectory: Trajectory, audit: Audit, verdicts: Sequence[BalanceVerdict], accuracy: Accuracy | None = None
) -> list[str]:
    """Return warnings for readers of the results of a run, in words."""
    return [
        *audit.findings,
        *(str(verdict) for verdict in verdicts if not verdict.consistent),
        *event_findings(trajectory.jumps, trajectory.model.system.unit("J/(m^2 K)")),
        *event_waits(trajectory),
        *findings(trajectory, accuracy),
        *trajectory.model.system.warnings,
    ]


class Judgement(NamedTuple):
    """Error of a run, as far as known."""

    accuracy: Accuracy | None = None
    notes: tuple[str, ...] = ()
    """Further notes for readers of the results."""


@dataclass(frozen=True, repr=False)
class Solution(Results):
    """Results of a run. ``dataset`` is the xarray Dataset; ``write`` saves the same as netCDF.

    The error of the run, from an exact solution or a second run, is computed on first access.
    """

    trajectory: Trajectory
    """The run, with states at the times at which runs are compared."""
    judge: Callable[[], Judgement] = Judgement
    """Function that finds the error of the run."""
    case_run: Run | None = None
    """Run settings of the case; the dataset records those that differ."""
    asked: Run | None = None
    """Run settings that were asked for; where an accuracy was, those of the run follow from these."""
    surface: Any = None
    """Free energy of two curved surfaces, if the scene has any."""
    error_from: str = "auto"
    """Requested source of the error."""

    def __repr__(self) -> str:
        """Return title, end and error in a line."""
        error = f", error {self.accuracy.error:.1e}" if self.accuracy else ""
        return f"<Solution {self.title!r}: {self.status}, {self.reason}{error}>"

    @property
    def status(self) -> str:
        """'finished', 'stopped' by physics, or 'failed' numerically."""
        return self.trajectory.status

    @property
    def reason(self) -> str:
        """Reason for the end of the run."""
        return self.trajectory.reason

    @cached_property
    def judgement(self) -> Judgement:
        """Error of the run, and its source."""
        return self.judge()

    def __getstate__(self) -> dict[str, Any]:
        """Pickle the error itself instead of the function that finds it."""
        return {**vars(self), "judgement": self.judgement, "judge": Judgement}

    @property
    def accuracy(self) -> Accuracy | None:
        """Error of the run, and its source."""
        return self.judgement.accuracy

    @property
    def notes(self) -> tuple[str, ...]:
        """Further notes for readers of the results."""
        return self.judgement.notes

    @cached_property
    def shown(self) -> Trajectory:
        """The run with states at the times of the dataset, which resolve it if no times were asked for."""
        return refined(self.trajectory)

    @cached_property
    def audit(self) -> Audit:
        """Residuals of the balances and least dissipation."""
        return audit(self.trajectory)

    @cached_property
    def verdicts(self) -> tuple[BalanceVerdict, ...]:
        """Verdicts on detailed balance of pairs of one-way reactions."""
        return verdicts(self.trajectory, self.audit)

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """Warnings for readers of the results, in words."""
        return (*run_warnings(self.trajectory, self.audit, self.verdicts, self.accuracy), *self.notes)

    @cached_property
    def columns(self) -> tuple[Column, ...]:
        """Every variable of the dataset, the time coordinate first."""
        trajectory, accounts = self.shown, self.trajectory.model.system.ledger
        (energy, _), (entropy, _), sites = Balances.of(trajectory)
        own = quantity_columns([trajectory])
        along = [*own, *profile_columns(trajectory), *coverage_columns(trajectory.model.system, own)]
        columns = [Column("time", ("time",), trajectory.result.times, "s", "time since the start"), *along]
        for account, values in zip(accounts, trajectory.result.ledger_outputs.T, strict=True):
            q = account.quantity
            columns.append(Column(DATASET_NAMES.get(q.name, q.name), ("time",), values, q.unit, q.long_name))
        text = "total entropy minus the entropy supplied and produced"
        columns += [
            Column("energy_residual", ("time",), energy, "J/m^2", "total energy minus the energy supplied"),
            Column("entropy_residual", ("time",), entropy, "J/(m^2 K)", text),
        ]
        if any(account.kind == "bonds" for account in accounts):
            text = "largest residual of the site balances"
            columns.append(Column("site_residual", ("time",), sites, "1", text))
        for law, low in least_productions(trajectory).items():
            text = f"least entropy production of {law.replace('_', ' ')}"
            columns.append(Column(f"least_sigma_{law}", (), np.float64(low), "W/(m^2 K)", text))
        computed, accuracy = {column.name: column for column in along}, self.accuracy or Accuracy(np.nan, "")
        for name, values in (accuracy.exact(trajectory) if accuracy.exact else {}).items():
            c = computed[name]
            columns.append(Column(f"{name}_exact", c.dimensions, values, c.unit, f"exact {c.long_name}"))
        errors = accuracy.everywhere
        known = {DATASET_NAMES.get(name, name): error for name, error in errors.items()}
        columns = [c._replace(error=known[c.name]) if c.name in known else c for c in columns]
        columns += event_columns([trajectory])
        if not trajectory.model.system.in_totals:
            return tuple(columns)
        named = (column._replace(unit=trajectory.model.system.unit(column.unit)) for column in columns)
        return (*named, *self._surface_columns[0])

    @cached_property
    def _surface_columns(self) -> tuple[list[Column], float]:
        """Columns on two curved surfaces, and the time that they took [s]."""
        return surface_columns(self.shown, self.surface)

    @property
    def integrals_seconds(self) -> float:
        """Time that integrals over surfaces took, before the run and for its dataset [s]."""
        return self.before_seconds + self._surface_columns[1]

    @cached_property
    def attributes(self) -> dict[str, str | float | int]:
        """Global attributes: scalars and strings only."""
        run, result, balances = self.trajectory.run, self.trajectory.result, self.audit
        system = self.trajectory.model.system
        # Transitions that have destroyed entropy, or would have.
        refused = dict.fromkeys(jump.edge.name for jump in self.trajectory.jumps if jump.verdict != ADMISSIBLE)
        counts = result.counters._asdict()
        if not solver(run.solver).counts_rejected:
            del counts["rejected"]
        error: dict[str, str | float] = {}
        if found := self.accuracy:
            error = {"error": float(found.error), "error_source": found.source}
            error |= {} if found.asked is None else {"error_asked": float(found.asked)}
        return {
            **self._origin("made", f"with {run.solver} at rtol {run.rtol:g}"),
            **self._departures(),
            "status": self.status,
            "reason": self.reason,
            "warnings": "; ".join(self.warnings) or "none",
            "regime": system.regime,
            **self._reaction(),
            "solver": run.solver,
            "rtol": float(run.rtol),
            **{f"cells_{p.number}": len(p.points) - 1 for p in system.profiles},
            **{f"count_{name}": int(value) for name, value in counts.items()},
            "time_reached": float(result.t),
            "run_seconds": float(self.trajectory.seconds),
            "compile_seconds": float(self.trajectory.model.compile_seconds),
            **({"integrals_seconds": self.integrals_seconds} if system.in_totals else {}),
            **error,
            "energy_error": balances.energy_error,
            "entropy_error": balances.entropy_error,
            "site_error": balances.site_error,
            "entropy_violations": ", ".join((*balances.violations, *refused)) or "none",
            **({"detailed_balance": "; ".join(map(str, self.verdicts))} if self.verdicts else {}),
            "versions": versions(),
        }

    def _reaction(self) -> dict[str, str]:
        """Return the class of the reactions, if they have a heat; heat within the tolerance counts as zero."""
        if "q_reaction" not in self.trajectory.ranges:
            return {}
        low, high = self.trajectory.ranges["q_reaction"]
        felt = self.trajectory.run.rtol * max(-low, high)
        found = [name for name, most in (("exothermic", high), ("endothermic", -low)) if most > felt]
        return {"reaction": " and ".join(found) or "isothermic"}

    def _departures(self) -> dict[str, str]:
        """Return the settings in which the run differs from its case, for running it again."""
        departures = self._changed(self.trajectory.model.system)
        if self.case_run is not None:
            run, names = self.trajectory.run, RECORDED_SETTINGS
            if self.asked and AUTO in (self.asked.solver, self.case_run.solver):
                run, names = self.asked, RECORDED_SETTINGS + ASKED_SETTINGS
            now, usual = ({name: getattr(r, name) for name in names} for r in (run, self.case_run))
            departures |= {name: value for name, value in now.items() if value != usual[name]}
        if self.error_from != "auto":
            departures["error"] = self.error_from
        if self.trajectory.result.status is Status.STOPPED:
            departures["max_steps"] = self.trajectory.result.counters.steps  # a time limit is not reproducible
        return {"departures": json.dumps(departures)} if departures else {}
