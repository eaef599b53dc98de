"""A study as it is handed back: its dataset, its figure, its report, its files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

from surfacechem.results.netcdf import CONVENTIONS, Column
from surfacechem.studies.precision.columns import columns
from surfacechem.studies.precision.plan import Measured, Plan
from surfacechem.studies.report import Page, as_dataset, machine, write

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure


@dataclass(frozen=True, repr=False)
class Study:
    """What ``surfacechem.precision`` hands back. ``dataset`` is the xarray Dataset; ``write`` saves all of it."""

    plan: Plan
    cases: tuple[Measured, ...]

    def __repr__(self) -> str:
        """Size in a line."""
        return (
            f"<Study of {len(self.cases)} cases, {len(self.plan.solvers)} solvers at {len(self.plan.tolerances)} "
            "tolerances>"
        )

    @property
    def command(self) -> str:
        """The command line that makes the study again."""
        return self.plan.command([case.subject.name for case in self.cases])

    @property
    def status(self) -> str:
        """'failed' where a case has no reference, so that there are no errors; else 'finished'."""
        return "finished" if all(case.truth for case in self.cases) else "failed"

    @cached_property
    def columns(self) -> tuple[Column, ...]:
        """Every variable of the dataset, the coordinates first."""
        return columns(self.plan, self.cases)

    @cached_property
    def attributes(self) -> Mapping[str, str | float | int]:
        """Global attributes: scalars and strings only."""
        return {
            "Conventions": CONVENTIONS,
            "title": f"Error against run time: {', '.join(case.subject.name for case in self.cases)}",
            "source": "surfacechem",
            "history": f"made by surfacechem {version('surfacechem')}: {self.command}",
            "study": "precision",
            "command": self.command,
            "repeat": self.plan.repeat,
            "status": self.status,
            **machine(),
        }

    @cached_property
    def dataset(self) -> xarray.Dataset:
        """The study as an xarray Dataset over case, solver and tolerance.

        ``dataset.set_index(case="case_name", solver="solver_name")`` lets ``sel`` find cases and solvers by name; since
        ``tolerance`` is also an argument of ``sel``, tolerances are asked for by ``sel({"tolerance": 1e-8})``.
        """
        return as_dataset(self.columns, ["tolerance"], self.attributes)

    def figure(self) -> Figure:
        """Run time against error."""
        from surfacechem.studies.precision.figure import figure

        return figure(self.dataset)

    @property
    def page(self) -> Page:
        """The report; ``page.text()`` is its tables, ``page.html()`` all of it."""
        from surfacechem.studies.precision.page import page

        return page(str(self.attributes["title"]), self.command, self.cases, self.figure())

    def write(self, path: str | Path) -> list[Path]:
        """Save as netCDF, SVG, PNG and HTML side by side; returns the files."""
        return write(path, self.columns, self.attributes, self.figure(), self.page)
