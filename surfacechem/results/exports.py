"""Tables of a dataset for spreadsheets and data frames: CSV and Parquet, by the suffix of the file."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

from surfacechem.results.netcdf import CSV, replacing

if TYPE_CHECKING:
    import xarray


def save_table(target: Path, dataset: xarray.Dataset) -> None:
    """A row for each output, whole or not at all; each column is headed by its name and unit, ``v [m s-1]``.

    What has other dimensions than the first variable, events and profiles for instance, is in netCDF only.
    """
    frame = table(dataset)
    with replacing(target) as temporary:
        if target.suffix.lower() == CSV:
            frame.to_csv(temporary, index=False, lineterminator="\n")
        else:
            frame.to_parquet(temporary, index=False)


def table(dataset: xarray.Dataset) -> Any:
    """The pandas data frame of a dataset."""
    along = set(next(iter(dataset.data_vars.values())).dims)
    names = [name for name, item in dataset.data_vars.items() if item.dims and set(item.dims) <= along]
    with warnings.catch_warnings():
        # Of a table with more than a hundred columns pandas says that it is made of many parts.
        warnings.simplefilter("ignore")
        frame = dataset[names].to_dataframe().reset_index()
    units = {name: dataset[name].attrs.get("units", "1") for name in frame}
    return frame.rename(columns={name: f"{name} [{unit}]" for name, unit in units.items()})
