"""Columns of data and their files: netCDF with CF conventions, and tables. Only a complete file replaces an old one."""

from __future__ import annotations

import os
import re
import secrets
import stat
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from functools import cache, cached_property
from importlib.util import find_spec
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from surfacechem.documents.cache_folder import version
from surfacechem.errors import InputError, OutputError, Place, PlacedError, nearest

if TYPE_CHECKING:
    import netCDF4
    import xarray

R = TypeVar("R")

CONVENTIONS = "CF-1.11"

READING_TIMEOUT = 20.0
"""Time [s] that reading a small file may take: in a damaged file HDF5 may search without end."""

_BEGUN_READING: dict[Path, subprocess.Popen[bytes]] = {}
"""Processes that test files which are read soon."""

LEAST_BANDWIDTH = 1e7
"""Least speed of a disk, in bytes per second."""

READING_TEST = """
import os
import sys
from contextlib import suppress
import netCDF4
with netCDF4.Dataset(os.fsencode(sys.argv[1]).decode("latin-1"), encoding="latin-1") as file:
    for item in (file, *file.variables.values()):
        for name in item.ncattrs():
            with suppress(Exception):
                item.getncattr(name)
        if item is not file:
            with suppress(Exception):
                item[...]
"""
"""Program that reads all of a file and ignores errors on the way."""

SUFFIXES = (".nc", ".nc4", ".cdf")
"""Suffixes of netCDF files."""

CSV, PARQUET = ".csv", ".parquet"
TABLES = (CSV, PARQUET)
"""Suffixes of files that hold a dataset as a table."""

COORDINATES = "coordinates"
"""Global attribute that names auxiliary coordinates: those without a dimension of the same name."""

RUN_SUFFIXES = (*SUFFIXES, *TABLES)
"""Suffixes of files to which a run can be written."""


class Column(NamedTuple):
    """A variable of the dataset."""

    name: str
    dimensions: tuple[str, ...]
    values: Any
    unit: str
    long_name: str
    tag: str = ""
    error: float | None = None
    """Largest relative error, if known."""

    @property
    def attributes(self) -> dict[str, str | float]:
        """CF attributes, the number of the equation, and the error; a text has no unit, ""."""
        result = {"units": cf_unit(self.unit)} if self.unit else {}
        result["long_name"] = self.long_name
        told = {} if self.error is None else {"error": self.error}
        return result | ({"equation": self.tag} if self.tag else {}) | told


@dataclass(frozen=True, eq=False)
class DataVariable:
    """A variable of a dataset, as xarray names its parts."""

    name: str
    dims: tuple[str, ...]
    source: Any
    """The values, or what reads them when they are asked for."""
    attrs: Mapping[str, Any] = field(default_factory=dict)

    @cached_property
    def values(self) -> NDArray[Any]:
        """The values, shape as ``dims``."""
        return np.asarray(self.source)

    @property
    def kind(self) -> str:
        """Kind of the values, as NumPy names it; known without reading them."""
        return str(self.source.dtype.kind)


@dataclass(frozen=True, eq=False)
class Data:
    """A dataset for figures and reports: of a file, a store or an xarray Dataset, without the imports of the latter,
    which take as long as a figure. It iterates over the names of variables that are no coordinates.
    """

    variables: Mapping[str, DataVariable]
    attrs: Mapping[str, Any] = field(default_factory=dict)
    coords: Collection[str] = ()
    """Names of the coordinates."""
    file: str = ""

    @classmethod
    def of(cls, dataset: xarray.Dataset) -> Data:
        """Return the variables of an xarray Dataset; values are read when they are asked for."""
        parts = {str(name): (str(name), tuple(map(str, v.dims)), v, v.attrs) for name, v in dataset.variables.items()}
        variables = {name: DataVariable(*part) for name, part in parts.items()}
        coords = [name for name in variables if name in dataset.coords]
        return cls(variables, dataset.attrs, coords, str(dataset.encoding.get("source", "")))

    @classmethod
    def made_of(cls, variables: Iterable[DataVariable], attributes: Mapping[str, Any], file: str = "") -> Data:
        """Return variables as a dataset; those along themselves, time, and those in an attribute, of the dataset or as
        xarray writes it of a variable, are coordinates.
        """
        known, attributes = {each.name: each for each in variables}, dict(attributes)
        texts = [attributes.pop(COORDINATES, ""), *(each.attrs.get(COORDINATES, "") for each in known.values())]
        said = {"time", *" ".join(map(str, texts)).split()}
        return cls(known, attributes, [name for name, v in known.items() if v.dims == (name,) or name in said], file)

    @classmethod
    def of_columns(cls, columns: Iterable[Column], attributes: Mapping[str, Any]) -> Data:
        """Return columns as a dataset."""
        found = (DataVariable(c.name, c.dimensions, np.asarray(c.values), c.attributes) for c in columns)
        return cls.made_of(found, attributes)

    def to_xarray(self) -> xarray.Dataset:
        """The xarray Dataset."""
        import pandas
        import xarray

        # Checks of an array import Dask and Pint if installed, for a second.
        found = {v.name: xarray.Variable(v.dims, v.values, v.attrs, fastpath=True) for v in self.variables.values()}
        indexes: dict[Any, Any] = {}
        for name in self.coords:
            if found[name].dims == (name,):
                values = self[name].values
                indexes[name] = xarray.indexes.PandasIndex(pandas.Index(values, dtype=values.dtype), name)
                found |= indexes[name].create_variables({name: found[name]})
        order = [*self, *self.coords]
        # The public constructor merges variable by variable, which takes longer than all else: here nothing differs.
        return xarray.Dataset._construct_direct(
            {name: found[name] for name in order}, {*self.coords}, dict(self.sizes), {**self.attrs}, indexes
        )

    @cached_property
    def sizes(self) -> dict[str, int]:
        """Length of each dimension."""
        pairs = (zip(each.dims, each.source.shape, strict=True) for each in self.variables.values())
        return dict(chain.from_iterable(pairs))

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names of variables that are no coordinates."""
        return (name for name in self.variables if name not in self.coords)

    def __contains__(self, name: str) -> bool:
        """True if there is a variable or a coordinate of this name."""
        return name in self.variables

    def __getitem__(self, name: str) -> DataVariable:
        """Return a variable or a coordinate; of a dimension without one the numbers of its places."""
        if name not in self.variables and name in self.sizes:
            return DataVariable(name, (name,), np.arange(self.sizes[name]))
        return self.variables[name]


@cache
def cf_unit(unit: str) -> str:
    """Return a unit of this package in the notation of the CF conventions.

    >>> cf_unit("W/(m^2 K)"), cf_unit("1/m^2"), cf_unit("1"), cf_unit("m/s^2")
    ('W m-2 K-1', 'm-2', '1', 'm s-2')
    """
    top, _, bottom = unit.partition("/")
    factors = [re.sub(r"\^", "", factor) for factor in top.split() if factor != "1"]
    for factor in bottom.strip("()").split():
        base, _, power = factor.partition("^")
        factors.append(f"{base}-{power or 1}")
    return " ".join(factors) or "1"


def versions() -> str:
    """Return the versions of the packages on which a result depends."""
    return ", ".join(f"{name} {version(name)}" for name in ("surfacechem", "numpy", "numba", "symengine"))


def dataset_path(path: str | Path) -> Path:
    """Return the path of a file for a dataset; InputError if its suffix is that of another format.

    >>> dataset_path("run.nc").name
    'run.nc'
    """
    target = Path(path)
    suffix = target.suffix.lower()
    if suffix and suffix not in RUN_SUFFIXES:
        remedy = f"{', '.join(RUN_SUFFIXES)}. Give {target.with_suffix('.nc').name}, or a name without suffix."
        stores = " Stores (.zarr) are for `sweep`." if suffix == ".zarr" else ""
        raise InputError(f"no dataset is written as '{target.suffix}': {remedy}{stores}", Place(str(path)))
    if suffix == PARQUET and find_spec("pyarrow") is None:
        message = "Parquet needs PyArrow: `pip install 'surfacechem[parquet]'`. A .csv needs nothing more."
        raise InputError(message, Place(str(path)))
    return target


@contextmanager
def replacing(target: Path) -> Iterator[Path]:
    """Open a temporary file next to the target, which replaces it and takes over its permissions on success.

    A link is followed. InputError if the target is no regular file, or protected; OutputError if writing fails, on a
    full disk for instance.
    """
    target = target.resolve()  # the file that a link points to, so that the link stays
    place = Place(str(target))
    if target.is_dir():
        raise InputError("is a directory; give a file name to write to.", place)
    if target.exists() and not target.is_file():
        raise InputError("is no regular file; give a file name to write to.", place)
    if target.exists() and not target.stat().st_mode & stat.S_IWUSR:
        raise InputError("cannot be written: it is read-only.", place)
    if not target.parent.is_dir():
        raise InputError(f"cannot be written: there is no folder {target.parent}.", place)
    replaced = stat.S_IMODE(target.stat().st_mode) if target.exists() else None
    temporary = target.with_name(f".surfacechem-{secrets.token_hex(8)}{target.suffix}")
    try:  # from here on, so that a signal leaves no temporary file
        try:  # an empty file with these permissions, less those of the user's umask
            mode = 0o666 if replaced is None else replaced
            os.close(os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY, mode))
        except OSError as error:
            raise InputError(f"cannot be written: {error.strerror or error}.", place) from error
        try:
            yield temporary
        except OSError as error:
            raise OutputError(f"cannot be written: {_reason(temporary, error)}.", place) from error
        if replaced is not None:
            temporary.chmod(replaced)
        temporary.replace(target)
    finally:
        with suppress(OSError):  # on a read-only file system removing fails even if there is no file
            temporary.unlink()


def _reason(path: Path, error: OSError) -> str:
    """Return the reason why a file could not be written: HDF5 gives none, but plain writing meets the same error."""
    if error.strerror:
        return error.strerror
    try:
        with path.open("wb", buffering=0) as file:
            for _ in range(64):
                file.write(bytes(1 << 16))
    except OSError as found:
        return found.strerror or str(found)
    return str(error)


def save(target: Path, columns: Sequence[Column], attributes: Mapping[str, str | float | int]) -> None:
    """Write a netCDF file, whole or not at all; on failure the data goes to a temporary folder named in the
    OutputError.
    """
    try:
        with replacing(target) as temporary:
            write_netcdf(temporary, columns, attributes)
    except OutputError as error:
        kept = Path(tempfile.gettempdir()) / f"{target.stem}-{secrets.token_hex(4)}.nc"
        try:
            with replacing(kept) as temporary:
                write_netcdf(temporary, columns, attributes)
        except PlacedError as second:
            raise OutputError(f"{error.message} In {kept.parent} it {second.message}", error.place) from None
        message = f"{error.message} The results are kept in {kept}; move them from there."
        raise OutputError(message, error.place) from None


def opened(path: str | Path, mode: Literal["r", "w"] = "r") -> netCDF4.Dataset:
    """Open a netCDF file. Its name goes as bytes, since the library refuses one that the locale cannot encode."""
    import netCDF4

    return netCDF4.Dataset(os.fsencode(path).decode("latin-1"), mode, format="NETCDF4", encoding="latin-1")


def write_netcdf(path: Path, columns: Sequence[Column], attributes: Mapping[str, str | float | int]) -> None:
    """Write columns and attributes to a new file; OSError if that fails."""
    try:
        with opened(path, "w") as file:
            for column in columns:  # all are defined before any is written: between these the library looks at all
                for dimension, size in zip(column.dimensions, np.shape(column.values), strict=True):
                    if dimension not in file.dimensions:
                        file.createDimension(dimension, size)
                kind = str if np.asarray(column.values).dtype == object else np.float64
                variable = file.createVariable(column.name, kind, column.dimensions, fill_value=False)
                variable.setncatts(column.attributes)
            file.setncatts(attributes)
            for column in columns:
                file[column.name][...] = column.values
    except RuntimeError as error:  # the library raises it for all errors of HDF5
        raise OSError(str(error)) from error


def read_netcdf(path: Path) -> Data:
    """Read the whole dataset of a file as it is written; OSError if it cannot be read."""

    def attributes(item: Any) -> dict[str, Any]:
        return {name: item.getncattr(name) for name in item.ncattrs()}

    with opened(path) as file:
        file.set_auto_maskandscale(False)
        variables = [
            DataVariable(name, item.dimensions, np.asarray(item[...]), attributes(item))
            for name, item in file.variables.items()
        ]
        whole = attributes(file)
    return Data.made_of(variables, whole, str(path))


def save_kept(dataset: xarray.Dataset, target: Path) -> Path:
    """Write the kept results of a sweep to one file, netCDF or a table, in which codes are replaced by words."""
    if target.suffix.lower() in TABLES:
        runs = dataset.drop_dims(["checked", "hardest"], errors="ignore")
        words = {"status": runs["status"].attrs["flag_meanings"].split(), "reason": runs.attrs["reasons"]}
        told = {name: runs[name].copy(data=np.array(texts, object)[runs[name].values]) for name, texts in words.items()}
        # A table has the rows of its first variable: outputs if there are series.
        save_table(target, runs.assign(told)[sorted(runs.data_vars, key=lambda name: -runs[name].ndim)])
    else:
        with replacing(target) as path:
            dataset.to_netcdf(path)
    return target


def save_table(target: Path, dataset: xarray.Dataset) -> None:
    """Write one row per output, whole or not at all; columns are headed by name and unit, ``v [m s-1]``, texts by name.

    Variables with other dimensions than the first one, events and profiles for instance, are in netCDF only.
    """
    along = set(next(iter(dataset.data_vars.values())).dims)
    names = [name for name, item in dataset.data_vars.items() if item.dims and set(item.dims) <= along]
    with warnings.catch_warnings():
        # pandas warns that a table with more than a hundred columns is fragmented.
        warnings.simplefilter("ignore")
        frame = dataset[names].to_dataframe().reset_index()
    units = {name: dataset[name].attrs.get("units", "1") for name in frame if dataset[name].dtype.kind not in "OUT"}
    frame = frame.rename(columns={name: f"{name} [{unit}]" for name, unit in units.items()})
    with replacing(target) as temporary:
        if target.suffix.lower() == CSV:
            frame.to_csv(temporary, index=False, lineterminator="\n")
        else:
            frame.to_parquet(temporary, index=False)


def reading(path: Path, read: Callable[[], R]) -> R:
    """Return the result of ``read`` on a netCDF file; InputError if it is missing, a store, a table, or damaged."""
    if path.is_dir():
        remedy = "`surfacechem sweep CASE -o NAME.zarr --resume` computes what it misses, and `plot` draws it"
        raise InputError(f"is a folder. A store is not run again: {remedy}.", Place(str(path)))
    if path.suffix.lower() in TABLES:
        remedy = f"Write the run to {path.with_suffix('.nc').name}, which holds events, errors and the case, too."
        raise InputError(f"is a table of numbers, which is for other programs. {remedy}", Place(str(path)))
    try:
        size = path.stat().st_size
        _try_elsewhere(path, READING_TIMEOUT + size / LEAST_BANDWIDTH)
        return read()
    except FileNotFoundError:
        beside = [other.name for other in path.parent.glob(f"*{path.suffix}")]  # a sweep's file has another name
        raise InputError(f"there is no file {path}.{nearest(path.name, beside)}") from None
    except Exception as error:  # a damaged file may raise anything in the library
        reason = " ".join(str(getattr(error, "strerror", None) or error).split()) or type(error).__name__
        raise InputError(f"is not a readable netCDF dataset: {reason}.", Place(str(path))) from error


def _try_elsewhere(path: Path, seconds: float) -> None:
    """Raise OSError if a process that reads the file crashes, or takes longer than so many seconds.

    In a damaged file HDF5 may search without end, and only the end of its process stops it: a thread would keep its
    locks, and crash the process at exit.
    """
    with _BEGUN_READING.pop(path, None) or _trial(path) as trial:
        try:
            code = trial.wait(timeout=seconds)
        except subprocess.TimeoutExpired:
            trial.kill()
            raise TimeoutError(f"no answer in {seconds:g} s") from None
    if code not in (0, 1):  # 1 means an exception, which reading raises again in this process
        raise OSError(f"a process that reads it crashes (exit code {code})")


def _trial(path: Path) -> subprocess.Popen[bytes]:
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, "-P", "-c", READING_TEST, str(path)]
    return subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def begin_reading(path: Path) -> None:
    """Start testing in parallel whether a file that will be read soon is readable."""
    if path.is_file():
        _BEGUN_READING[path] = _trial(path)
