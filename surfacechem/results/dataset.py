"""Datasets of runs: the columns that a run and a sweep have in common, in xarray and in netCDF with CF conventions.

On two curved surfaces results at some output times are added: moments, area of contact, and fields over body 1.
"""

from __future__ import annotations

import json
import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from surfacechem.documents.cache_folder import version
from surfacechem.errors import InputError, refuse_unknown
from surfacechem.model.system import Profile, System
from surfacechem.quantities import Quantity
from surfacechem.results.netcdf import CONVENTIONS, TABLES, Column, Data, dataset_path, save, save_table
from surfacechem.solve.contract import Array
from surfacechem.solve.run import Trajectory

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

    from surfacechem.surfaces.potential import CurvedSurfaces

DATASET_NAMES = {
    "Q_1": "Q_ext_1",
    "Q_2": "Q_ext_2",
    "Q_c": "Q_ext_c",
    "W_n": "work_n",
    "W_t": "work_t",
    "W_t2": "work_t2",
}
"""Names that differ in the dataset, where no two names may differ in upper and lower case only."""


def changes_of(attributes: Mapping[str, Any]) -> dict[str, tuple[float, str]]:
    """Return the changes of a run to its case, from its attributes: values in SI by path, each with its unit.

    >>> changes_of({"departures": '{"changes": {"initial.T": 280.0}, "units": {"initial.T": "K"}}'})
    {'initial.T': (280.0, 'K')}
    """
    try:
        found = json.loads(str(attributes.get("departures", "{}")))
        units = found.get("units", {})
        return {path: (float(x), str(units.get(path, ""))) for path, x in found.get("changes", {}).items()}
    except (AttributeError, TypeError, ValueError, RecursionError):
        raise InputError("the attribute 'departures' says no changes of a case.") from None


def quantities(system: System) -> dict[str, Quantity]:
    """Return the states, except those inside bodies, and the named quantities, by name."""
    states = {name: state.quantity for name, state in system.own_states.items()}
    return states | {item.name: item.quantity for item in system.outputs}


def quantity_columns(
    runs: Sequence[Trajectory], inner: str = "time", axes: Mapping[str, int] | None = None
) -> list[Column]:
    """Return states and named quantities at the output times of one run, or of many along the ``axes`` of a sweep, by
    name and size; in a sweep a quantity is NaN at times that a run did not reach.
    """
    system = runs[0].model.system
    kept = [system.state_columns[name] for name in system.own_states]
    found = quantities(system)
    values: Iterable[Array] = (*runs[0].result.outputs[:, kept].T, *runs[0].outputs.T)
    if axes:  # one table for all runs; a column is a view of it
        table = np.full((len(found), len(runs), len(runs[0].result.problem.times)), np.nan)
        for i, run in enumerate(runs):
            table[:, i, : len(run.result.times)] = [*run.result.outputs[:, kept].T, *run.outputs.T]
        values = table.reshape(len(found), *axes.values(), -1)
    return [
        Column(DATASET_NAMES.get(name, name), (*(axes or {}), inner), each, q.unit, q.long_name, q.tag)
        for each, (name, q) in zip(values, found.items(), strict=True)
    ]


def coverage_columns(system: System, columns: Iterable[Column]) -> list[Column]:
    """Return columns of all coverages, along the names of species in the mechanism, which need not suit variables."""
    species = {state.name: state.quantity.species for state in system.states if state.quantity.species}
    found = {column.name: column for column in columns if column.name in species}
    if not found:
        return []
    names, first = np.array([species[name] for name in found], dtype=object), next(iter(found.values()))
    values = np.stack([np.asarray(column.values) for column in found.values()], axis=-1)
    return [
        Column("species", ("species",), names, "", "species of the surface"),
        Column("coverage", (*first.dimensions, "species"), values, "1", "coverage of each species"),
    ]


def profile_values(trajectory: Trajectory, profile: Profile) -> Array:
    """Return the temperatures across a body at the output times, shape (times, points)."""
    names = [profile.surface, *profile.states, *([profile.far] if profile.far else [])]
    return np.stack([trajectory.column(name)[0] for name in names], axis=1)


def profile_columns(trajectory: Trajectory) -> list[Column]:
    """Return the columns of each profile and of its coordinate."""
    found = []
    for profile in trajectory.model.system.profiles:
        x, values = f"x_{profile.number}", profile_values(trajectory, profile)
        places = np.array(profile.points) * trajectory.values[profile.thickness]
        found.append(Column(x, (x,), places, "m", f"distance from the contact into {profile.body}"))
        found.append(Column(profile.name, ("time", x), values, "K", f"temperature across {profile.body}"))
    return found


def _above(module: str) -> Any:
    """Import a module of a higher room by name, at call time: the modules that draw results import this one."""
    return import_module(f"surfacechem.{module}")


@dataclass(frozen=True, kw_only=True, repr=False)
class Results(ABC):
    """Results of a run or a sweep: ``dataset`` is the xarray Dataset, ``write`` saves the same as netCDF."""

    title: str = ""
    source: str = ""
    case: str = ""
    """Text of the case, from which the run can be repeated."""
    mechanism: str = ""
    changes: Mapping[str, float] = field(default_factory=dict)
    """Parameters and initial values that differ from the case, by path."""
    before_seconds: float = 0.0
    """Time that integrals over surfaces took before the run [s]."""

    @property
    @abstractmethod
    def columns(self) -> Sequence[Column]:
        """Every variable of the dataset, the coordinates first."""

    @property
    @abstractmethod
    def attributes(self) -> Mapping[str, str | float | int]:
        """Global attributes: scalars and strings only."""

    def _changed(self, system: System) -> dict[str, object]:
        """Return the entries of `departures` for the changes; empty if there are none."""
        units = system.changeable
        known = {"changes": dict(self.changes), "units": {path: units[path] for path in self.changes}}
        return known if self.changes else {}

    def _origin(self, made: str, how: str) -> dict[str, str | float | int]:
        """Return attributes with the origin of the dataset, which is ``made``, or evaluated."""
        return {
            "Conventions": CONVENTIONS,
            "title": self.title,
            "source": self.source or "surfacechem",
            "history": f"{made} by surfacechem {version('surfacechem')} {how}",
            "case": self.case,
            **({"mechanism": self.mechanism} if self.mechanism else {}),
        }

    @property
    def data(self) -> Data:
        """The dataset for figures and reports: that of xarray if it is there, as it may have been changed."""
        return Data.of(self.dataset) if "dataset" in vars(self) else Data.of_columns(self.columns, self.attributes)

    @cached_property
    def dataset(self) -> xarray.Dataset:
        """The xarray Dataset."""
        return Data.of_columns(self.columns, self.attributes).to_xarray()

    def __getitem__(self, name: str) -> xarray.DataArray:
        """Return a variable of the dataset by name; InputError if it has none of that name."""
        refuse_unknown([name], list(map(str, self.dataset.variables)), "no variable '{}'")
        return self.dataset[name]

    def plot(self, variables: Sequence[str] | None = None, against: str | None = None, celsius: bool = False) -> Figure:
        """Draw the figure of the dataset; a notebook shows it, ``savefig`` writes it.

        Parameters
        ----------
        variables
            Names of the variables to show, instead of the usual choice.
        against
            The variable along the axis, instead of time.
        celsius
            True for temperatures in degrees Celsius instead of kelvins.

        Returns
        -------
        matplotlib.figure.Figure
            The figure.

        Raises
        ------
        InputError
            If the dataset has no variable of a name.
        """
        figure: Figure = _above("plots").figure(self.data, variables, against, celsius)
        return figure

    def report(self, path: str | Path = "report.html") -> Path:
        """Write one self-contained page of all results, which needs no other file and no network.

        Parameters
        ----------
        path
            The HTML file.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        InputError
            If the name of the file is that of another format.
        """
        written: Path = _above("studies.run_report").write(self.data, path)
        return written

    def _repr_html_(self) -> str:
        """Return HTML for a notebook: the summary and a small figure."""
        return str(_above("studies.run_report").glance(self))

    def write(self, path: str | Path) -> Path:
        """Save as netCDF, or as a table if the name ends with .csv or .parquet; whole or not at all.

        Parameters
        ----------
        path
            The file; without a suffix it gets .nc.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        OutputError
            If it cannot be written.
        """
        target = dataset_path(path)
        if target.suffix.lower() in TABLES:
            save_table(target, self.dataset)
        else:
            save(target, self.columns, self.attributes)
        return target


MOST_SURFACE_TIMES = 9
"""Number of evenly spread output times at which results on the surfaces are computed."""

POINTS_ALONG, POINTS_AROUND, POINTS_ACROSS = 81, 16, 33
"""Points of the fields away from and around an axis of symmetry; in both directions if there is none."""

TIME = "surface_time"


def surface_columns(trajectory: Trajectory, surface: CurvedSurfaces) -> tuple[list[Column], float]:
    """Return columns over the times of the surfaces and over body 1, and the time spent on their integrals [s]."""
    from surfacechem.surfaces.potential import INTEGRATION_TIME, integrating

    before, times = INTEGRATION_TIME.seconds, trajectory.result.times
    chosen = np.unique(np.linspace(0, len(times) - 1, MOST_SURFACE_TIMES).round().astype(int))
    columns = [Column(TIME, (TIME,), times[chosen], "s", "times at which the surfaces are looked at")]
    with integrating():
        surface, gaps = surface.of_run(trajectory.values), trajectory.column("g_n")[0][chosen]
        # A run may end a rounding beyond the range of tabulated approaches.
        approaches, stretches = np.clip(gaps, *surface.approach), np.ones_like(gaps)
        if stretch := trajectory.column("J_c"):
            stretches = stretch[0][chosen]
        columns += [*_totals(surface, approaches, stretches), *_fields(surface, approaches, stretches)]
    return columns, INTEGRATION_TIME.seconds - before


def _totals(surface: CurvedSurfaces, approaches: Array, stretches: Array) -> list[Column]:
    """Return moment, area of contact, conductance, and the deviation of the local law."""
    from surfacechem.surfaces.inner_sums import alike_around

    force, moment_x, moment_y, local, least, places, area, across = surface.totals(approaches, stretches)
    columns = []
    if not alike_around(*surface.surfaces(0.0)):
        columns = [
            Column(f"moment_{axis}", (TIME,), moment, "N m", f"moment on body 1 about the {axis} axis")
            for axis, moment in (("x", moment_x), ("y", moment_y))
        ]
    columns += [
        Column("approach", (TIME,), approaches, "m", "approach of the surfaces"),
        Column("force", (TIME,), force, "N", "normal force on body 1, tension positive"),
        Column("gap_least", (TIME,), least, "m", "least gap of the surfaces"),
        Column("gap_places", (TIME,), places, "1", "places that are as near"),
        Column("contact_area", (TIME,), area, "m^2", "area of body 1 that touches or overlaps body 2"),
        Column("contact_radius", (TIME,), np.sqrt(area / math.pi), "m", "radius of a circle of the area of contact"),
    ]
    if surface.pairs:
        text = "force of the local law minus the integral"
        columns.append(Column("local_difference", (TIME,), local - force, "N", text))
    if surface.heat_laws:
        columns.append(Column("conductance", (TIME,), across, "W/K", "heat conductance over the gap"))
    return columns


def _fields(surface: CurvedSurfaces, approaches: Array, stretches: Array) -> Sequence[Column]:
    """Return gap and traction at points of body 1, which are denser where body 2 is nearest."""
    from surfacechem.surfaces.forces import length
    from surfacechem.surfaces.patches import Budget, outer_patches
    from surfacechem.surfaces.projection import FIRST_ORDER

    lower, upper = surface.surfaces(float(approaches.min()))
    size = length(lower, upper)
    patches, _ = outer_patches(lower, upper, size, size, Budget(surface.accuracy))
    lower = patches.surface
    counts = [POINTS_ALONG, POINTS_AROUND] if patches.uniform[1] else [POINTS_ACROSS, POINTS_ACROSS]
    at = np.stack(np.meshgrid(*map(patches.line, (0, 1), counts), indexing="ij"), axis=-1)
    D = lower.derivatives(lower.off_pole(at), FIRST_ORDER)
    x, normals = D[0], lower.normals(D)
    near = [replace(upper, approach=d).nearest(x) for d in approaches.tolist()]
    gap, opposite = np.array([one.gap for one in near]), np.array([one.point for one in near])
    # With an axis of symmetry all columns around it are equal.
    some = slice(0, 1 if patches.uniform[1] else None)
    points, directions = (part[:, some].reshape(-1, 3) for part in (x, normals))
    gaps = gap[:, :, some].reshape(len(gap), -1)
    felt, summed = surface.tractions(points, directions, gaps, approaches, stretches)
    traction = np.broadcast_to(felt.reshape(len(gap), len(x), -1), gap.shape)
    over = ("u", "v")
    places = [
        Column(f"surface_{axis}", over, x[..., k], "m", f"{axis} of points of body 1") for k, axis in enumerate("xyz")
    ]
    places += [
        Column(f"opposite_{axis}", (TIME, *over), opposite[..., k], "m", f"{axis} of the nearest point of body 2")
        for k, axis in enumerate("xyz")
    ]
    by = "" if summed or not surface.pairs else " by the local law"
    text = f"normal traction on body 1{by}, tension positive"
    return [
        *places,
        Column("gap", (TIME, *over), gap, "m", "gap between the surfaces"),
        Column("traction", (TIME, *over), traction, "Pa", text),
    ]
