"""A study of stability: the matrix, the worst corners, and what is handed over of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from surfacechem.errors import InputError, Place, suggestion
from surfacechem.solvers import names as known_solvers
from surfacechem.stability import page as pages
from surfacechem.stability.matrix import RTOL, SOLVERS, Matrix, few, matrix
from surfacechem.stability.regimes import chosen
from surfacechem.stability.search import Corner, worst_corner
from surfacechem.studyreport import Page, as_dataset, write

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

ROUNDS = 12
"""Rounds of a search for a worst corner."""


@dataclass(frozen=True)
class Study:
    """What came of the regimes. ``dataset`` has dimensions (regime, decade, solver), ``figure`` is a heat map."""

    matrix: Matrix
    corners: Sequence[Corner]
    command: str

    @cached_property
    def page(self) -> Page:
        """The report."""
        return pages.page(self.matrix, self.corners, self.command)

    @cached_property
    def figure(self) -> Figure:
        """Digits kept, at a glance."""
        return pages.figure(self.matrix)

    @cached_property
    def dataset(self) -> xarray.Dataset:
        """The matrix as an xarray Dataset."""
        return as_dataset(pages.columns(self.matrix), ("regime", "decade", "solver"), self.attributes)

    @property
    def attributes(self) -> dict[str, str | float | int]:
        """Global attributes of the dataset."""
        return {"Conventions": "CF-1.11", "title": self.page.title, "study": "stability", "history": self.command,
                "rtol": self.matrix.rtol}  # fmt: skip

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
    solved = matrix(found, solvers, rtol, few if quick else list)
    corners = [worst_corner(regime, rounds, rtol) for regime in found if regime.space] if rounds else []
    return Study(solved, corners, _command(regimes, solvers, rtol, quick, rounds))


def _command(regimes: Sequence[str], solvers: Sequence[str], rtol: float, quick: bool, rounds: int) -> str:
    options = [f"--solvers {','.join(solvers)}"] if tuple(solvers) != SOLVERS else []
    options += [f"--rtol {rtol:g}"] if rtol != RTOL else []
    options += ["--quick"] if quick else []
    options += [f"--search {rounds}"] if rounds != ROUNDS else []
    return " ".join(["surfacechem stability", *regimes, *options])
