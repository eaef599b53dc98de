"""Figures of runs, sweeps and studies, each from a dataset alone.

Only Matplotlib's object-oriented interface is used: nothing here opens windows or changes global settings.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from surfacechem.errors import InputError, expect
from surfacechem.plots.style import COLOURS, STYLE, in_celsius, opened, save, write

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

    from surfacechem.results.netcdf import Data

__all__ = ["COLOURS", "STYLE", "figure", "opened", "save", "write"]


def figure(
    data: Data | xarray.Dataset | str | Path | Sequence[Data | xarray.Dataset | str | Path],
    variables: Sequence[str] | None = None,
    against: str | None = None,
    celsius: bool = False,
) -> Figure:
    """Draw the figure of a dataset or of its netCDF file: of a run, a sweep, a study, or several of them.

    Parameters
    ----------
    data
        A dataset, or the path of its file; or a list of them, whose curves are named by their differences.
    variables
        Names of the variables to show, instead of the usual choice.
    against
        The variable along the axis, instead of time; for a sweep, whose runs are then drawn one by one, instead of the
        swept parameter.
    celsius
        True for temperatures in degrees Celsius instead of kelvins.

    Returns
    -------
    matplotlib.figure.Figure
        The figure, which ``savefig`` writes and a notebook shows.

    Raises
    ------
    InputError
        If a file is no dataset of surfacechem, or has no variable of a name.
    """
    _check_choice(variables, against)
    several = [data] if isinstance(data, str | Path) or not isinstance(data, Sequence) else data
    datasets = [opened(each) for each in several]
    if celsius:
        datasets = [in_celsius(dataset) for dataset in datasets]
    # Only the module for this kind of dataset is imported.
    if len(datasets) > 1:
        from surfacechem.plots import comparison

        return comparison.figure(datasets, variables, against)
    (dataset,) = datasets
    if "study" in dataset.attrs:
        if variables or against:
            raise InputError("the figure of a study has no choice of variables.")
        from surfacechem.plots import study

        return study.figure(dataset)
    if "sweep" in dataset.attrs:
        from surfacechem.plots import sweep

        return sweep.figure(dataset, variables, against)
    from surfacechem.plots import time_series

    if "time" not in dataset and "point" in dataset.sizes:
        return time_series.at_states(dataset, variables, against)
    return time_series.figure(dataset, variables, against)


def _check_choice(variables: Sequence[str] | None, against: str | None) -> None:
    """Raise InputError if the variables are no list, or only the variable of the axis."""
    if isinstance(variables, str):
        raise InputError(f"variables are a list of names, not '{variables}'; a figure is written by its savefig.")
    expect(variables, (Collection, type(None)), "variables are a list of names")
    if variables and {*variables} == {against}:
        raise InputError(f"{against} is the axis: name other variables, or leave `against` out.")
