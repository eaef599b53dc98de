"""A sweep as a labelled dataset: every quantity over the swept parameters, how each run ended, errors and run time."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from surfacechem.errors import InputError
from surfacechem.format.plans import Axis, Plan
from surfacechem.model.system import System
from surfacechem.quantities import Quantity
from surfacechem.results.event_table import event_columns
from surfacechem.results.netcdf import CONVENTIONS, Column, dataset_path, save, versions
from surfacechem.results.solution import DATASET_NAMES
from surfacechem.runs.sweeps import Sweep

if TYPE_CHECKING:
    import xarray

Array = NDArray[np.float64]

WORDS = {"mode": "most probable", "median": "median", "mean": "mean"}


@dataclass(frozen=True)
class SweepAccuracy:
    """Largest relative error of each run and where it is from; exact statistics by name where they are known."""

    errors: Array
    source: str
    exact: Mapping[str, Array] = field(default_factory=dict)


@dataclass(frozen=True, repr=False)
class SweepSolution:
    """What a sweep hands back. ``dataset`` is the xarray Dataset; ``write`` saves the same as netCDF."""

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
        every = [status for status, _ in self.sweep.ends]
        return ", ".join(f"{every.count(status)} {status}" for status in dict.fromkeys(every))

    @property
    def status(self) -> str:
        """'failed' if a run failed numerically, 'stopped' if physics stopped all of them, else 'finished'.

        That physics stops some runs is a result of a sweep; that all bonds break is what a spectrum is made for.
        """
        every = {status for status, _ in self.sweep.ends}
        stopped = every == {"stopped"} and not self.sweep.statistics
        return "failed" if "failed" in every else "stopped" if stopped else "finished"

    @cached_property
    def axes(self) -> dict[str, Axis]:
        """The swept parameters by the names of their dimensions."""
        taken = {*self.sweep.named, "time"}
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
        return (*self._coordinates(), *self._along(), *self._of_runs(), *self._events(), *self._statistics())

    @property
    def inner(self) -> str:
        """The dimension along each run: time, or the load that all runs grow to."""
        return self.plan.until[0] if self.plan.until else "time"

    def _coordinates(self) -> list[Column]:
        columns = []
        for name, axis in self.axes.items():
            unit, text = self._meaning(axis.path)
            columns.append(Column(name, (name,), np.asarray(axis.values, dtype=float), unit, text))
        times = self.sweep.times
        if self.plan.until is None:
            return [*columns, Column("time", ("time",), times[0], "s", "time since the start")]
        quantity = self._quantities[self.inner]
        start = float(self.sweep.named[self.inner][0, 0])
        load = start + (self.plan.until[1] - start) * times[0] / times[0, -1]
        return [
            *columns,
            Column(self.inner, (self.inner,), load, quantity.unit, quantity.long_name),
            Column("time", (*self.axes, self.inner), self._shaped(times), "s", "time since the start"),
        ]

    def _meaning(self, path: str) -> tuple[str, str]:
        """Unit and long name of a swept value."""
        state = next((s for s in self.system.states if path == s.path), None)
        if state is not None:
            quantity, _ = state.at_start
            return quantity.unit, f"initial {quantity.long_name}"
        spec = next(p.spec for p in self.system.parameters if p.path == path)
        return spec.unit, f"{spec.text} ({path})"

    @property
    def _quantities(self) -> dict[str, Quantity]:
        states = {state.name: state.quantity for state in self.system.states if state.name not in self.system.inside}
        return states | {item.name: item.quantity for item in self.system.outputs}

    def _shaped(self, values: Array) -> Array:
        """Values whose first axis is the run, with one axis for each swept parameter."""
        return values.reshape(*self.plan.shape, *values.shape[1:])

    def _along(self) -> list[Column]:
        dimensions = (*self.axes, self.inner)
        return [
            Column(
                DATASET_NAMES.get(name, name),
                dimensions,
                self._shaped(self.sweep.named[name]),
                q.unit,
                q.long_name,
                q.tag,
            )
            for name, q in self._quantities.items()
            if name != self.inner
        ]

    def _of_runs(self) -> list[Column]:
        sweep, batch = self.sweep, self.sweep.batch
        words = [np.array([end[k] for end in sweep.ends], dtype=object) for k in (0, 1)]
        rows = [
            ("status", words[0], "1", "how the run ended"),
            ("reason", words[1], "1", "why the run ended"),
            ("time_reached", batch.t, "s", "time that the run reached"),
            ("steps", batch.steps.astype(float), "1", "steps of the run"),
            ("energy_error", sweep.energy_error, "1", "largest energy residual relative to the energy exchanged"),
            ("entropy_error", sweep.entropy_error, "1", "largest entropy residual relative to what was exchanged"),
            ("site_error", sweep.site_error, "1", "largest residual of the site balances"),
            ("destroys_entropy", sweep.destroys_entropy.astype(float), "1", "1 where a law or a jump does, else 0"),
        ]
        if self.system.transitions:
            text = "most entropy that a jump has destroyed"
            rows.append(("entropy_destroyed", sweep.entropy_destroyed, "J/(m^2 K)", text))
        if self.accuracy:
            rows.append(("error", self.accuracy.errors, "1", "largest relative error of the run"))
        return [Column(name, tuple(self.axes), self._shaped(values), unit, text) for name, values, unit, text in rows]

    def _events(self) -> list[Column]:
        """The events of each run where there are jumps; beyond the last one of a run times and values are not set."""
        runs = range(len(self.sweep)) if self.system.transitions else ()
        tables = [{column.name: column for column in event_columns(self.sweep[i])} for i in runs]
        most = max((len(table["event_time"].values) for table in tables if table), default=0)
        every = {name: column for table in tables for name, column in table.items()}
        columns = []
        for name, column in every.items():
            empty: str | float = "" if column.values.dtype == object else np.nan
            values = np.full((len(tables), most), empty, dtype=column.values.dtype)
            for i, table in enumerate(tables):
                if name in table:
                    values[i, : len(table[name].values)] = table[name].values
            columns.append(Column(name, (*self.axes, "event"), self._shaped(values), column.unit, column.long_name))
        return columns

    def _statistics(self) -> list[Column]:
        columns = []
        exact = self.accuracy.exact if self.accuracy else {}
        for which, word in WORDS.items() if self.sweep.statistics else ():
            quantity = self._quantities[self.inner]
            found = np.array([getattr(statistics, which) for statistics in self.sweep.statistics])
            text = f"{word} {quantity.long_name} at rupture"
            for suffix, values in (("", found), ("_exact", exact.get(which))):
                if values is not None:
                    name = f"{self.inner}_{which}{suffix}"
                    label = f"exact {text}" if suffix else text
                    columns.append(Column(name, tuple(self.axes), self._shaped(values), quantity.unit, label))
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
            "Conventions": CONVENTIONS,
            "title": self.title,
            "source": self.source or "surfacechem",
            "history": f"made by surfacechem {version('surfacechem')} with {run.solver} at rtol {run.rtol:g}",
            "case": self.case,
            **({"mechanism": self.mechanism} if self.mechanism else {}),
            "sweep": json.dumps(_recorded(self.plan)),
            **({"departures": json.dumps({"changes": dict(self.changes)})} if self.changes else {}),
            "status": self.status,
            "reason": self.ends,
            "regime": self.system.regime,
            "solver": run.solver,
            "rtol": float(run.rtol),
            "runs": len(sweep),
            "count_steps": int(sweep.batch.steps.sum()),
            "run_seconds": float(sweep.seconds),
            "compile_seconds": float(sweep.model.compile_seconds),
            **error,
            "energy_error": float(np.max(sweep.energy_error)),
            "entropy_error": float(np.max(sweep.entropy_error)),
            "site_error": float(np.max(sweep.site_error)),
            "versions": versions(),
        }

    @cached_property
    def dataset(self) -> xarray.Dataset:
        """The sweep as an xarray Dataset."""
        import xarray

        data = {c.name: (c.dimensions, c.values, c.attributes) for c in self.columns}
        coordinates = {name: data.pop(name) for name in (*self.axes, *dict.fromkeys((self.inner, "time")))}
        return xarray.Dataset(data, coords=coordinates, attrs=dict(self.attributes))

    def write(self, path: str | Path) -> Path:
        """Save as netCDF; the file appears whole or not at all."""
        target = dataset_path(path)
        save(target, self.columns, self.attributes)
        return target


def _recorded(plan: Plan) -> dict[str, object]:
    axes = [{"path": a.path, "values": list(a.values), "logarithmic": a.logarithmic} for a in plan.axes]
    return {"axes": axes, "until": list(plan.until) if plan.until else None}


def recorded_plan(text: object) -> Plan:
    """The plan that an attribute ``sweep`` records; InputError where it records none."""
    try:
        content = json.loads(str(text))
        axes = [
            Axis(str(axis["path"]), _numbers(axis["values"]), axis["logarithmic"] is True) for axis in content["axes"]
        ]
        until = content["until"]
        return Plan(axes, (str(until[0]), _numbers(until[1:])[0]) if until else None)
    except (LookupError, TypeError, ValueError, RecursionError):
        raise InputError("the attribute 'sweep' is no plan of a sweep.") from None


def _numbers(values: Any) -> tuple[float, ...]:
    if not all(isinstance(value, float | int) for value in values):
        raise TypeError(values)
    return tuple(map(float, values))
