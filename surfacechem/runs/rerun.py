"""Repetition of a run from its own file: the dataset carries the case, the mechanism and the solver."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from surfacechem import format as cases
from surfacechem import solve as solvers
from surfacechem.errors import InputError, Place
from surfacechem.format.plans import recorded_plan
from surfacechem.results.netcdf import Column, dataset_path, opened, reading, save_kept
from surfacechem.results.solution import ASKED_SETTINGS, RECORDED_SETTINGS, Solution
from surfacechem.runs.checking import check
from surfacechem.runs.simulation import Simulation
from surfacechem.runs.sweeps import SweepSolution

if TYPE_CHECKING:
    import xarray

A = TypeVar("A")


DEPARTURE_TYPES: Mapping[str, tuple[type, ...]] = {
    "changes": (dict,),
    "units": (dict,),
    "times": (list,),
    "picture": (float, type(None)),
    "atol": (float, int, type(None)),
    "max_steps": (int,),
    "solver": (str,),
    "accuracy": (float, type(None)),
    "rtol": (float,),
    "error": (str,),
}
"""Settings, with their types, that a file may record as different from those of its case."""


@dataclass(frozen=True)
class Record:
    """Content of a file: attributes and variables."""

    path: Path
    attributes: Mapping[str, Any]
    variables: Mapping[str, Any]

    def attribute(self, name: str, kind: type[A]) -> A:
        """Return a global attribute of this type; InputError if the file has none of that name."""
        if name not in self.attributes:
            raise self.error(f"has no attribute '{name}'; only datasets written by a run can be run again.")
        value = self.attributes[name]
        if isinstance(value, np.generic):
            value = value.item()
        if not isinstance(value, kind):
            raise self.error(f"the attribute '{name}' is no {'text' if kind is str else 'number'}.")
        return value

    @property
    def place(self) -> Place:
        """Place of the record, for messages."""
        return Place(str(self.path))

    def error(self, message: str) -> InputError:
        """Return an input error about this file."""
        return InputError(message, self.place)


def read(path: str | Path) -> Record:
    """Read the attributes and variables of a netCDF file."""

    def record() -> Record:
        with opened(path) as file:
            file.set_auto_mask(False)
            attributes = {name: file.getncattr(name) for name in file.ncattrs()}
            variables = {name: np.asarray(variable[...]) for name, variable in file.variables.items()}
        return Record(Path(path), attributes, variables)

    return reading(Path(path), record)


@dataclass(frozen=True)
class KeptSweep:
    """A repeated sweep of which a part of the results is kept."""

    data: xarray.Dataset

    @classmethod
    def of(cls, record: Record, case: cases.Case) -> KeptSweep:
        """Repeat the sweep of a record and load what its case keeps."""
        try:
            plan = recorded_plan(record.attribute("sweep", str))
            changes = dict(json.loads(record.attribute("changes", str)))
        except (InputError, TypeError, ValueError, RecursionError):
            raise record.error("the attributes 'sweep' and 'changes' are not those of a sweep.") from None
        with TemporaryDirectory() as folder:
            stream = Simulation(case).stream(plan, Path(folder) / "again.zarr", changes)
            store = stream.run()
            check(stream)
            with store.dataset as data:
                return cls(data.load())

    @property
    def columns(self) -> list[Column]:
        """Its variables."""
        return [Column(str(name), (), each.values, "", "") for name, each in self.data.variables.items()]

    def write(self, path: str | Path) -> Path:
        """Write the file."""
        return save_kept(self.data, dataset_path(path))


def run_again(record: Record, allow_code: bool = False) -> Solution | SweepSolution | KeptSweep:
    """Repeat the run or sweep of a record; ``allow_code`` permits laws whose source code the record carries."""
    mechanism = record.attribute("mechanism", str) if "mechanism" in record.attributes else None
    text = record.attribute("case", str)
    if not text:
        raise record.error("holds no case, as its scene was built in Python; run it there.")
    where = f"case in {record.path}"
    case = cases.load_text(text, record.path.stem, record.path.parent, mechanism, file=where, allow_code=allow_code)
    if "keep" in record.attributes:
        return KeptSweep.of(record, case)
    departures = _departures(record)
    made: dict[str, Any] = {"solver": record.attribute("solver", str), "rtol": record.attribute("rtol", float)}
    try:
        # A limit of wall-clock time is not reproducible.
        asked = {name: departures[name] for name in RECORDED_SETTINGS + ASKED_SETTINGS if name in departures}
        run = replace(case.run, max_seconds=None, **asked)
        if run.solver != solvers.AUTO:  # what an accuracy took, it takes again
            run = replace(run, **made)
        if run.solver not in (*solvers.names, solvers.AUTO):
            raise InputError(f"no run is made with the solver '{run.solver}'.")
        plan = recorded_plan(record.attribute("sweep", str)) if "sweep" in record.attributes else None
    except InputError as error:
        raise error.at(record.place) from None
    if plan is None:
        return Simulation(case).run(departures.get("changes"), run, departures.get("error", "auto"))
    return Simulation(replace(case, own_run=run)).sweep_plan(plan, departures.get("changes"))


def _departures(record: Record) -> Mapping[str, Any]:
    """Return the recorded settings that differ from those of the case."""
    if "departures" not in record.attributes:
        return {}
    try:
        found = json.loads(record.attribute("departures", str))
    except (ValueError, RecursionError):
        raise record.error("the attribute 'departures' is no JSON.") from None
    if not isinstance(found, dict) or any(not isinstance(found[k], DEPARTURE_TYPES.get(k, ())) for k in found):
        raise record.error(f"the attribute 'departures' may hold {', '.join(DEPARTURE_TYPES)}, each of its kind.")
    numbers = [*found.get("times", []), *found.get("changes", {}).values(), found.get("max_steps", 1)]
    numbers += [found[name] for name in ("picture", "accuracy", "rtol") if found.get(name) is not None]
    if not all(isinstance(value, float | int) and math.isfinite(value) for value in numbers):
        raise record.error("the attribute 'departures' holds what is no number where one is needed.")
    return found | ({"times": tuple(found["times"])} if "times" in found else {})


def differences(record: Record, solution: Solution | SweepSolution | KeptSweep) -> list[str]:
    """Return the names of variables that are not bit for bit those of the record, or are missing in one of the two."""
    ours = {column.name: np.asarray(column.values) for column in solution.columns}
    theirs = record.variables
    return [name for name in dict.fromkeys([*theirs, *ours]) if not _identical(ours.get(name), theirs.get(name))]


def _identical(ours: Any, theirs: Any) -> bool:
    if ours is None or theirs is None or ours.shape != theirs.shape:
        return False
    if ours.dtype == object or theirs.dtype == object:
        return [str(value) for value in ours.flat] == [str(value) for value in theirs.flat]
    return bool(ours.astype(np.float64).tobytes() == theirs.astype(np.float64).tobytes())
