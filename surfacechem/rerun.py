"""A run again from its own file: the case and the mechanism that the dataset carries, with the recorded solver."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from surfacechem import case as cases
from surfacechem.errors import InputError, Place
from surfacechem.simulation import Simulation
from surfacechem.solution import Solution
from surfacechem.sweep_dataset import SweepSolution, recorded_plan


@dataclass(frozen=True)
class Record:
    """What a file holds: its attributes and every variable."""

    path: Path
    attributes: Mapping[str, Any]
    variables: Mapping[str, Any]

    def attribute(self, name: str) -> Any:
        """A global attribute; InputError where the file has none of that name."""
        if name not in self.attributes:
            raise InputError(f"has no attribute '{name}'; only datasets written by a run can be run again.", self.place)
        return self.attributes[name]

    @property
    def place(self) -> Place:
        """Where the record is from, for messages."""
        return Place(str(self.path))


def read(path: str | Path) -> Record:
    """The attributes and variables of a netCDF file."""
    import netCDF4

    try:
        with netCDF4.Dataset(path) as file:
            file.set_auto_mask(False)
            attributes = {name: file.getncattr(name) for name in file.ncattrs()}
            variables = {name: np.asarray(variable[...]) for name, variable in file.variables.items()}
    except OSError as error:
        raise InputError(f"is not a readable netCDF dataset: {error.strerror or error}.", Place(str(path))) from error
    return Record(Path(path), attributes, variables)


def run_again(record: Record) -> Solution | SweepSolution:
    """The case of a record, run or swept as it was."""
    mechanism = record.attributes.get("mechanism")
    case = cases.load_text(str(record.attribute("case")), record.path.stem, record.path.parent, mechanism)
    departures = json.loads(record.attributes.get("departures", "{}"))
    run = replace(
        case.run,
        solver=str(record.attribute("solver")),
        rtol=float(record.attribute("rtol")),
        times=tuple(departures.get("times", case.run.times)),
        atol=departures.get("atol", case.run.atol),
        max_steps=departures.get("max_steps", case.run.max_steps),
        max_seconds=None,
    )
    if "sweep" not in record.attributes:
        return Simulation(case).run(departures.get("changes"), run, departures.get("error", "auto"))
    plan = recorded_plan(str(record.attribute("sweep")))
    return Simulation(replace(case, run=run)).sweep_plan(plan, departures.get("changes"))


def differences(record: Record, solution: Solution | SweepSolution) -> list[str]:
    """Names of the variables that are not bit for bit those of the record, or in one of the two only."""
    ours = {column.name: np.asarray(column.values) for column in solution.columns}
    theirs = record.variables
    return [name for name in dict.fromkeys([*theirs, *ours]) if not _identical(ours.get(name), theirs.get(name))]


def _identical(ours: Any, theirs: Any) -> bool:
    if ours is None or theirs is None or ours.shape != theirs.shape:
        return False
    if ours.dtype == object or theirs.dtype == object:
        return [str(value) for value in ours.flat] == [str(value) for value in theirs.flat]
    return bool(ours.astype(np.float64).tobytes() == theirs.astype(np.float64).tobytes())
