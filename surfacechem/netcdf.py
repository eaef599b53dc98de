"""Columns of data and netCDF files of them, with CF conventions: a file takes its place only when it is whole."""

from __future__ import annotations

import os
import re
import stat
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from surfacechem.errors import InputError, Place

CONVENTIONS = "CF-1.11"

SUFFIXES = (".nc", ".nc4", ".cdf")
"""What names of netCDF files end with."""


@dataclass(frozen=True)
class Column:
    """One variable of the dataset."""

    name: str
    dimensions: tuple[str, ...]
    values: Any
    unit: str
    long_name: str
    tag: str = ""

    @property
    def attributes(self) -> dict[str, str]:
        """CF attributes."""
        result = {"units": cf_unit(self.unit), "long_name": self.long_name}
        return result | ({"equation": self.tag} if self.tag else {})


def cf_unit(unit: str) -> str:
    """A unit of this package in the notation of the CF conventions.

    >>> cf_unit("W/(m^2 K)"), cf_unit("1/m^2"), cf_unit("1"), cf_unit("m/s^2")
    ('W m-2 K-1', 'm-2', '1', 'm s-2')
    """
    top, _, bottom = unit.partition("/")
    factors = [re.sub(r"\^", "", factor) for factor in top.split() if factor != "1"]
    for factor in bottom.strip("()").split():
        base, _, power = factor.partition("^")
        factors.append(f"{base}-{power or 1}")
    return " ".join(factors) or "1"


@cache
def versions() -> str:
    """Versions of what a result depends on."""
    names = ("surfacechem", "numpy", "numba", "symengine")
    return ", ".join(f"{name} {version(name)}" for name in names)


def dataset_path(path: str | Path) -> Path:
    """The path of a file that is to hold a dataset; InputError where its suffix is that of another format.

    >>> dataset_path("run.nc").name
    'run.nc'
    """
    target = Path(path)
    if target.suffix and target.suffix.lower() not in SUFFIXES:
        remedy = f"{', '.join(SUFFIXES)}. Give {target.with_suffix('.nc').name}, or a name without suffix."
        raise InputError(f"datasets are written as netCDF, not as '{target.suffix}': {remedy}", Place(str(path)))
    return target


@contextmanager
def replacing(target: Path) -> Iterator[Path]:
    """A temporary file beside the target that takes its place when all went well; InputError if it cannot be made.

    A link is followed; what is no regular file, or protected, is left alone.
    """
    target = target.resolve()
    if target.is_dir():
        raise InputError("is a directory; give a file name to write to.", Place(str(target)))
    if target.exists() and not target.is_file():
        raise InputError("is no regular file; give a file name to write to.", Place(str(target)))
    if target.exists() and not target.stat().st_mode & stat.S_IWUSR:
        raise InputError("cannot be written: it is read-only.", Place(str(target)))
    if not target.parent.is_dir():
        raise InputError(f"cannot be written: there is no folder {target.parent}.", Place(str(target)))
    try:
        handle, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.", suffix=target.suffix)
        os.close(handle)
    except OSError as error:
        raise InputError(f"cannot be written: {error.strerror or error}.", Place(str(target))) from error
    temporary = Path(name)
    try:
        yield temporary
        temporary.chmod(0o644)
        temporary.replace(target)
    finally:
        temporary.unlink(missing_ok=True)


def write_netcdf(path: Path, columns: Sequence[Column], attributes: Mapping[str, str | float | int]) -> None:
    """Write columns and attributes to a new file."""
    import netCDF4

    with netCDF4.Dataset(path, "w", format="NETCDF4") as file:
        for dimension, size in _dimensions(columns).items():
            file.createDimension(dimension, size)
        for column in columns:
            kind = str if np.asarray(column.values).dtype == object else np.float64
            variable = file.createVariable(column.name, kind, column.dimensions, fill_value=False)
            variable.setncatts(column.attributes)
            variable[...] = column.values
        file.setncatts(attributes)


def _dimensions(columns: Sequence[Column]) -> dict[str, int]:
    sizes: dict[str, int] = {}
    for column in columns:
        for axis, dimension in enumerate(column.dimensions):
            sizes[dimension] = np.shape(column.values)[axis]
    return sizes
