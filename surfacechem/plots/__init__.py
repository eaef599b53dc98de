"""Figures of runs, sweeps and studies, each from a dataset alone.

Only Matplotlib's object-oriented interface is used: nothing here opens windows or changes global settings.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from surfacechem.errors import InputError, Place
from surfacechem.plots.style import COLOURS, STYLE, opened, save, write

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

__all__ = ["COLOURS", "STYLE", "figure", "opened", "save", "write"]


def figure(
    data: xarray.Dataset | str | Path, variables: Sequence[str] | None = None, against: str | None = None
) -> Figure:
    """The figure that suits a dataset or its netCDF file: of a run, of a sweep, or of a study.

    ``variables`` are shown instead of the usual choice; those of a run over the variable ``against`` instead of time.
    """
    from surfacechem.plots import run, study, sweep

    dataset = opened(data)
    if "study" in dataset.attrs:
        if variables or against:
            raise InputError("the figure of a study has no choice of variables.")
        return study.figure(dataset)
    if "sweep" not in dataset.attrs:
        return run.figure(dataset, variables, against)
    if against:
        raise InputError("a sweep is plotted over what it sweeps; runs have other axes.", Place(path="--against"))
    return sweep.figure(dataset, variables)
