"""Stores of sweeps in Zarr version 3, written chunk by chunk; a chunk is valid once a mark with its checksum exists.

A store is created at once, with every array and no values. Each part has one writer of its chunks. Chunks may be
written again, since their content follows from the case and the plan alone. So a writer may be killed at any moment,
and the finished store has the same bytes as one that was never interrupted.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import secrets
import shutil
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from surfacechem.errors import InputError, OutputError, Place
from surfacechem.results.netcdf import Column

if TYPE_CHECKING:
    import xarray

STORE_SUFFIX = ".zarr"
MARKS_FOLDER = ".marks"

COORDINATE_PART = 2**20
"""Number of values of a coordinate that are written at a time."""

COMPRESSION = 0
"""Level of compression of stored arrays: the usual one of Zarr."""

MISSING = {"f": np.nan, "i": -1}
"""What stands for a missing value, by the kind of the type."""

CHUNK_BYTES = 64 * 2**20
"""Size of a chunk of all variables together."""

SHARED_ATTRIBUTES = {
    "title": "the title",
    "case": "the case",
    "mechanism": "the mechanism",
    "sweep": "the plan",
    "keep": "what is kept",
    "changes": "the changes",
    "run": "the settings of the run",
    "check": "what is checked",
    "versions": "the versions",
}
"""Attributes that all writers of a store must share, and their names in messages."""

ZARR_NEEDED = (
    "stores, and files of a sweep with `keep`, need Zarr, which is not installed: pip install 'surfacechem[sweeps]', "
    "or leave out `keep` and write to a name with .nc."
)


@dataclass(frozen=True)
class StoredArray:
    """An array of a store: its type, dimensions, and attributes."""

    kind: str
    dimensions: tuple[str, ...]
    attributes: Mapping[str, Any]


@dataclass(frozen=True)
class Layout:
    """Layout of a store: sizes of its dimensions, those of the runs first; arrays; coordinates."""

    sizes: Mapping[str, int]
    runs: tuple[str, ...]
    """Dimensions of the runs."""
    variables: Mapping[str, StoredArray]
    """Arrays along the runs."""
    unchunked: Mapping[str, StoredArray]
    """Arrays that do not belong to chunks."""
    coordinates: Sequence[Column]
    attributes: Mapping[str, Any]
    at_once: int
    """Largest number of runs in a chunk."""

    @cached_property
    def shape(self) -> tuple[int, ...]:
        """Number of runs along each of their dimensions."""
        return tuple(self.sizes[name] for name in self.runs)

    @cached_property
    def chunk(self) -> tuple[int, ...]:
        """Number of runs of a chunk along each of their dimensions; the last dimension is filled first."""
        bytes_of_run = sum(
            np.dtype(v.kind).itemsize * math.prod(self.sizes[d] for d in v.dimensions[len(self.runs) :])
            for v in self.variables.values()
        )
        left = max(1, min(self.at_once, CHUNK_BYTES // bytes_of_run))
        found = []
        for size in reversed(self.shape):
            found.append(min(size, left))
            left = max(1, left // found[-1])
        return tuple(reversed(found))

    @cached_property
    def counts(self) -> tuple[int, ...]:
        """Number of chunks along each dimension."""
        return tuple(-(-size // part) for size, part in zip(self.shape, self.chunk, strict=True))

    @property
    def chunks(self) -> int:
        """Number of chunks."""
        return math.prod(self.counts)

    def region(self, number: int) -> tuple[slice, ...]:
        """Return the runs of a chunk, as slices."""
        places = np.unravel_index(number, self.counts)
        return tuple(
            slice(int(k) * part, min((int(k) + 1) * part, size))
            for k, part, size in zip(places, self.chunk, self.shape, strict=True)
        )

    def index(self, number: int) -> NDArray[np.int64]:
        """Return the numbers of the runs of a chunk, in its order."""
        places = np.ix_(*(np.arange(part.start, part.stop) for part in self.region(number)))
        return np.asarray(np.ravel_multi_index(places, self.shape), np.int64).ravel()

    def runs_of(self, numbers: Iterable[int]) -> int:
        """Return the number of runs of these chunks."""
        return sum(math.prod(part.stop - part.start for part in self.region(number)) for number in numbers)


@dataclass
class Store:
    """A store that is written to."""

    path: Path
    layout: Layout = field(repr=False)
    _arrays: dict[str, Any] = field(default_factory=dict, repr=False)

    @property
    def marks(self) -> Path:
        """The folder of the marks."""
        return self.path / MARKS_FOLDER

    def write(self, number: int, columns: Mapping[str, NDArray[Any]], threads: int = 1) -> None:
        """Write a chunk, its arrays side by side in so many threads, and then its mark."""
        with self.writing():
            with ThreadPoolExecutor(threads) as pool:
                list(pool.map(partial(self._write, number, columns), self.layout.variables))
            self.mark(str(number), self.checksum(number))

    def _write(self, number: int, columns: Mapping[str, NDArray[Any]], name: str) -> None:
        """Write the file of an array as Zarr does, none if all values are missing.

        Its event loop would take longer than to compress.
        """
        from numcodecs.zstd import Zstd

        values, kind, file = columns[name], np.dtype(self.layout.variables[name].kind), self._file(number, name)
        shape = tuple(part.stop - part.start for part in self.layout.region(number))
        whole = np.full((*self.layout.chunk, *values.shape[1:]), MISSING[kind.kind], kind.newbyteorder("<"))
        whole[tuple(map(slice, shape))] = values.reshape(*shape, *values.shape[1:])
        if np.all((whole != whole) | (whole == MISSING[kind.kind])):
            file.unlink(missing_ok=True)
            return
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(Zstd(COMPRESSION).encode(whole))

    def write_unchunked(self, columns: Mapping[str, NDArray[Any]]) -> None:
        """Write whole arrays that do not belong to chunks."""
        with self.writing():
            for name, values in columns.items():
                self._array(name)[...] = values

    def mark(self, name: str, text: str) -> None:
        """Write a mark, whole or not at all."""
        # Renaming is atomic: the mark is whole or absent, whenever the process is killed.
        temporary = self.marks / f".{secrets.token_hex(8)}"
        temporary.write_text(text)
        temporary.replace(self.marks / name)

    def done(self, number: int) -> bool:
        """True if a chunk is marked, and matches its mark."""
        try:
            return (self.marks / str(number)).read_bytes() == self.checksum(number).encode()
        except OSError:
            return False

    def checksum(self, number: int) -> str:
        """Return the checksum of the files of a chunk; arrays whose values are all missing have no file."""
        found = hashlib.sha256()
        for name in self.layout.variables:
            # Of the files, since data may be damaged on the disk.
            file = self._file(number, name)
            found.update(file.read_bytes() if file.exists() else b"")
        return found.hexdigest()

    def _file(self, number: int, name: str) -> Path:
        """Return the file of an array in a chunk."""
        places = "/".join(map(str, np.unravel_index(number, self.layout.counts)))
        inner = "/0" * (len(self.layout.variables[name].dimensions) - len(self.layout.runs))
        return self.path / name / f"c/{places}{inner}"

    def read(self, name: str, number: int) -> NDArray[Any]:
        """Return the values of an array in a chunk, one row per run."""
        values = np.asarray(self._array(name)[self.layout.region(number)])
        return values.reshape(-1, *values.shape[len(self.layout.runs) :])

    def _array(self, name: str) -> Any:
        if name not in self._arrays:
            self._arrays[name] = _zarr().open_array(self.path / name, mode="r+")
        return self._arrays[name]

    def restore(self) -> None:
        """Make anew what a store has from its beginning, with the same bytes: it may be damaged."""
        with self.writing(), _made(self.path, self.layout) as made:
            for file in made.rglob("*"):
                if file.is_file():
                    target = self.path / file.relative_to(made)
                    target.parent.mkdir(parents=True, exist_ok=True)
                    file.replace(target)

    @contextmanager
    def writing(self) -> Iterator[None]:
        """Raise OutputError if writing to the disk fails."""
        try:
            yield
        except OSError as error:
            kept = "What is stored is kept: when there is room, go on with --resume."
            raise OutputError(f"cannot be written: {error.strerror or error}. {kept}", Place(str(self.path))) from error

    @contextmanager
    def locked(self, part: str) -> Iterator[None]:
        """Lock a part for this writer; InputError if it has another one. The lock ends with its process."""
        import fcntl

        file = self.marks / f"writer-{part}"
        with self.writing(), file.open("a") as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise InputError(f"another process is writing part {part} of it.", Place(str(self.path))) from None
            try:
                yield
            finally:
                file.unlink(missing_ok=True)

    @property
    def dataset(self) -> xarray.Dataset:
        """The dataset of the store as it is now; values are read on access."""
        return opened(self.path)


def opened(path: str | Path) -> xarray.Dataset:
    """Open the dataset of a store; values are read on access."""
    import xarray

    _zarr()
    try:
        found: xarray.Dataset = xarray.open_zarr(path, chunks=None)
    except (OSError, LookupError, RuntimeError, ValueError, TypeError) as error:
        raise InputError(f"is no readable store: {' '.join(str(error).split())}.", Place(str(path))) from None
    return found


def _zarr() -> Any:
    try:
        import zarr
    except ImportError:
        raise InputError(ZARR_NEEDED) from None
    return zarr


def store_path(path: str | Path) -> Path:
    """Return the path of a store; InputError if nothing can be written there."""
    target = Path(path)
    _zarr()
    if not target.parent.is_dir():
        raise InputError(f"cannot be written: there is no folder {target.parent}.", Place(str(path)))
    if not os.access(target if target.exists() else target.parent, os.W_OK):
        raise InputError("cannot be written: it is read-only.", Place(str(path)))
    return target


def begin(path: Path, layout: Layout, resume: bool) -> Store:
    """Return a store of this layout: a new one, or the existing one if it is of the same case, plan and versions.

    InputError if another one exists, or if one exists and ``resume`` is False.
    """
    store = Store(path, layout)
    if path.exists():
        if not resume:
            raise InputError("is there already: --resume goes on with it; or give another name.", Place(str(path)))
        _refuse_other(path, layout)
        return store
    with store.writing(), _made(path, layout) as made:
        try:
            made.rename(path)
        except OSError:  # several processes started at once: the first has made it, and the others continue with it
            _refuse_other(path, layout)
    return store


@contextmanager
def _made(path: Path, layout: Layout) -> Iterator[Path]:
    """Make a store without values beside the path; what is left of it is removed."""
    temporary = path.with_name(f".surfacechem-{secrets.token_hex(8)}{STORE_SUFFIX}")
    try:
        _make(temporary, layout)
        yield temporary
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def _refuse_other(path: Path, layout: Layout) -> None:
    """Raise InputError unless a folder is a store of the same case, plan and versions."""
    place = Place(str(path))
    try:
        there = json.loads((path / "zarr.json").read_text())["attributes"]
        known = (path / MARKS_FOLDER).is_dir() and "sweep" in there
    except (OSError, LookupError, TypeError, ValueError):
        known = False
    if not known:
        raise InputError("is no store of a sweep; give another name.", place)
    # Attributes as they are after writing and reading JSON, the format of the store.
    ours = json.loads(json.dumps(dict(layout.attributes)))
    different = [word for name, word in SHARED_ATTRIBUTES.items() if there.get(name) != ours.get(name)]
    if different:
        raise InputError(f"belongs to another sweep. Different: {', '.join(different)}.", place)


def _make(path: Path, layout: Layout) -> None:
    """Create all arrays, without values except those of the coordinates."""
    zarr = _zarr()
    group = zarr.create_group(path, zarr_format=3, attributes=dict(layout.attributes))
    for name, item in {**layout.variables, **layout.unchunked}.items():
        shape = tuple(layout.sizes[dimension] for dimension in item.dimensions)
        part = (*layout.chunk, *shape[len(layout.chunk) :]) if name in layout.variables else shape
        missing = MISSING[np.dtype(item.kind).kind]
        packed = {"compressors": zarr.codecs.ZstdCodec(level=COMPRESSION), "fill_value": missing}
        named = {"dimension_names": item.dimensions, "attributes": dict(item.attributes)}
        group.create_array(name, shape=shape, chunks=part, dtype=item.kind, **packed, **named)
    for column in layout.coordinates:
        values = column.values
        made = group.create_array(
            column.name,
            shape=values.shape,
            chunks=tuple(min(size, COORDINATE_PART) for size in values.shape),
            dtype=values.dtype,
            fill_value=np.nan,  # a part that is lost is not a number, rather than zero
            dimension_names=column.dimensions,
            attributes=column.attributes,
        )
        for first in range(0, values.shape[0], COORDINATE_PART):  # a plan may have more values than fit into memory
            made[first : first + COORDINATE_PART] = values[first : first + COORDINATE_PART]
    # Coordinates are complete from the beginning, as they follow from the plan.
    with warnings.catch_warnings():
        # Consolidated metadata is not yet part of the standard; readers without it open each array by itself.
        warnings.simplefilter("ignore")
        zarr.consolidate_metadata(path)
    (path / MARKS_FOLDER).mkdir()
