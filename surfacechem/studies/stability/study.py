"""A study of stability: the matrix, the worst corners, and what is handed over of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

from surfacechem.errors import InputError, Place, suggestion
from surfacechem.results.netcdf import CONVENTIONS
from surfacechem.solve import names as known_solvers
from surfacechem.studies.report import Page, as_dataset, machine, write
from surfacechem.studies.stability import page as pages
from surfacechem.studies.stability.matrix import RTOL, SOLVERS, Matrix, few, matrix
from surfacechem.studies.stability.regimes import chosen
from surfacechem.studies.stability.search import Corner, worst_corner

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

ROUNDS, MOST_ROUNDS = 12, 10_000
"""Rounds of a search for a worst corner, and the most that may be asked for."""


@dataclass(frozen=True)
class Study:
    """What came of the regimes. ``dataset`` has dimensions (regime, decade, solver), ``figure`` is a heat map."""

    matrix: Matrix
    corners: Sequence[Corner]
    command: str
    searched: bool
    """Whether worst corners were searched for."""

    @cached_property
    def page(self) -> Page:
        """The report."""
        left_out = pages.omissions(self.matrix, self.searched)
        return pages.page(self.matrix, self.corners, self.command, self.figure, left_out)

    @cached_property
    def figure(self) -> Figure:
        """Digits kept, at a glance."""
        from surfacechem.studies.stability.figure import figure

        return figure(self.dataset)

    @cached_property
    def dataset(self) -> xarray.Dataset:
        """The matrix as an xarray Dataset."""
        return as_dataset(pages.columns(self.matrix), ("regime", "decade", "solver"), self.attributes)

    @property
    def attributes(self) -> dict[str, str | float | int]:
        """Global attributes of the dataset."""
        return {
            "Conventions": CONVENTIONS,
            "title": pages.TITLE,
            "source": "surfacechem",
            "history": f"made by surfacechem {version('surfacechem')}: {self.command}",
            "study": "stability",
            "command": self.command,
            "rtol": self.matrix.rtol,
            **machine(),
        }

    def write(self, path: str | Path) -> list[Path]:
        """Save .nc, .svg, .png and .html side by side."""
        return write(path, pages.columns(self.matrix), self.attributes, self.figure, self.page)


def stability(
    *regimes: str,
    solvers: Sequence[str] = SOLVERS,
    rtol: float = RTOL,
    quick: bool = False,
    rounds: int = ROUNDS,
) -> Study:
    """Solve the regimes, all if none is named, with the solvers; ``quick`` takes four values of each.

    ``rounds`` of a search for the worst corner of each regime that has one; none where it is zero.
    """
    found = chosen(regimes)
    for name in solvers:
        if name not in known_solvers:
            raise InputError(f"no solver '{name}'.{suggestion(name, known_solvers)}", Place(path="--solvers"))
    if not 0 < rtol <= 0.1:
        raise InputError(f"{rtol:g} is outside its range: > 0 and <= 0.1.", Place(path="--rtol"))
    if not 0 <= rounds <= MOST_ROUNDS:
        raise InputError(f"{rounds} is outside its range: >= 0 and <= {MOST_ROUNDS}.", Place(path="--search"))
    if len(solvers) == 0:
        raise InputError("at least one is needed.", Place(path="--solvers"))
    solved = matrix(found, solvers, rtol, few if quick else list)
    corners = [worst_corner(regime, rounds, rtol) for regime in found if regime.space] if rounds else []
    return Study(solved, corners, _command(regimes, solvers, rtol, quick, rounds), rounds > 0)


def _command(regimes: Sequence[str], solvers: Sequence[str], rtol: float, quick: bool, rounds: int) -> str:
    options = [f"--solvers {','.join(solvers)}"] if tuple(solvers) != SOLVERS else []
    options += [f"--rtol {rtol:g}"] if rtol != RTOL else []
    options += ["--quick"] if quick else []
    options += [f"--search {rounds}"] if rounds != ROUNDS else []
    return " ".join(["surfacechem stability", *regimes, *options])
