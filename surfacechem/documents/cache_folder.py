"""The user's cache folder for expensive results: fits of properties, integrals over surfaces, machine code.

The name of a file is a digest of all its inputs, so that it is never used for other ones. A file is read only if its
SHA-256 is right and no other user could have written it. Files that cannot be written, read or trusted cost time only.
"""

from __future__ import annotations

import hashlib
import json
import os
import stat
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import fields, is_dataclass
from functools import cache
from importlib import metadata
from itertools import count
from pathlib import Path
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

PACKAGE = Path(__file__).parents[1]

WRITABLE_BY_OTHERS = stat.S_IWGRP | stat.S_IWOTH
"""Write permissions of others."""

version = cache(metadata.version)
"""Version of an installed package; the lookup is slow."""

MOST_FILES = 4096
"""Number of files of one kind beyond which the older half is removed; at 5 to 100 kB each some 100 MB."""


def cache_root() -> Path:
    """Return SURFACECHEM_CACHE, else NUMBA_CACHE_DIR, else the user's cache folder."""
    for variable in ("SURFACECHEM_CACHE", "NUMBA_CACHE_DIR"):
        if os.environ.get(variable):
            return Path(os.environ[variable])
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return base / "surfacechem"


# -- files ------------------------------------------------------------------------------------------------------------


def sealed(content: bytes) -> bytes:
    """Return content preceded by its SHA-256, so that damage is detected."""
    return hashlib.sha256(content).hexdigest().encode() + b"\n" + content


def unsealed(data: bytes) -> bytes | None:
    """Return the content of sealed data; None if it is damaged."""
    content = data[2 * hashlib.sha256().digest_size + 1 :]
    return content if sealed(content) == data else None


def make_folder(folder: Path) -> None:
    """Create a folder of the cache, writable only for its user from the start."""
    for path in (cache_root(), folder):
        path.mkdir(mode=0o755, parents=True, exist_ok=True)


def keep_file(path: Path, data: bytes) -> None:
    """Write a file whole or not at all; what a machine that stops meanwhile leaves of it has another SHA-256."""
    handle, name = tempfile.mkstemp(dir=path.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        Path(name).chmod(0o644)
        Path(name).replace(path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise


def untrusted(paths: Iterable[Path]) -> str | None:
    """Return the reason why files of the cache could be another user's; None if they cannot be, or do not exist."""
    if not hasattr(os, "getuid"):
        return None  # on Windows a user's folder is writable to that user alone
    root = cache_root()
    for path in (root, *paths):
        # A file that another process removes meanwhile is skipped.
        try:
            found = path.stat() if path == root else path.lstat()
        except OSError:
            continue
        if found.st_uid not in (os.getuid(), 0):
            return f"{path} belongs to another user"
        shared = path == root and found.st_mode & stat.S_ISVTX  # in a sticky folder others cannot replace our files
        if stat.S_ISLNK(found.st_mode) or (found.st_mode & WRITABLE_BY_OTHERS and not shared):
            return f"{path} can be written by other users"
    return None


# -- numbers ----------------------------------------------------------------------------------------------------------


class Fingerprint(NamedTuple):
    """A digest of the contents of objects; equal only if the contents are."""

    digest: str
    is_lasting: bool
    """True if it is the same in every process; user-defined laws may depend on anything, which cannot be compared."""


_CLASS_NUMBERS: WeakKeyDictionary[type, int] = WeakKeyDictionary()
_COUNTER = count()


def fingerprint(*things: Any) -> Fingerprint:
    """Return the fingerprint of numbers, texts, arrays, and of laws and other records of them.

    >>> fingerprint([1.0, 2.0]) == fingerprint((1.0, 2.0)), fingerprint(0.1) == fingerprint(0.1 + 1e-18)
    (True, True)
    >>> fingerprint(1.0) == fingerprint("1.0")
    False
    """
    digest, is_lasting = hashlib.sha256(), True
    for thing in things:
        for part, lasting in _parts(thing):
            digest.update(str(len(part)).encode() + b":" + part)
            is_lasting = is_lasting and lasting
    return Fingerprint(digest.hexdigest(), is_lasting)


def _parts(thing: Any) -> Iterator[tuple[bytes, bool]]:
    """Yield all contents of an object, each with True if it is the same in every process."""
    if isinstance(thing, float):
        yield float(thing).hex().encode(), True
    elif thing is None or isinstance(thing, bool | int | str):
        yield repr(thing).encode(), True
    elif isinstance(thing, np.ndarray):
        yield f"{thing.dtype.str} {thing.shape}".encode() + np.ascontiguousarray(thing).tobytes(), True
    elif isinstance(thing, Mapping):
        yield f"mapping of {len(thing)}".encode(), True
        for item in thing.items():
            yield from _parts(item)
    elif isinstance(thing, Sequence):
        yield f"sequence of {len(thing)}".encode(), True
        for item in thing:
            yield from _parts(item)
    elif is_dataclass(thing) and not isinstance(thing, type):
        yield _code(type(thing))
        for name in (item.name for item in fields(thing) if item.repr):
            yield from _parts((name, getattr(thing, name)))
    else:  # unknown: different from everything
        yield str(next(_COUNTER)).encode(), False


def _code(kind: type) -> tuple[bytes, bool]:
    """Return a class as its name and source; a class outside the package gets a unique number."""
    source = getattr(sys.modules.get(kind.__module__), "__file__", None)
    if source is None or not Path(source).is_relative_to(PACKAGE):
        return f"{_CLASS_NUMBERS.setdefault(kind, next(_COUNTER))}".encode(), False
    return f"{kind.__module__}.{kind.__qualname__} {source_digest(source)}".encode(), True


@cache
def source_digest(file: str) -> str:
    """Return the SHA-256 of a file of source code."""
    return hashlib.sha256(Path(file).read_bytes()).hexdigest()


def cached(mark: Fingerprint, code: Iterable[Path], find: Callable[[], Any]) -> Any:
    """Return the result of ``find``, made of numbers, texts and lists; read from its file in the cache if that exists.

    ``code`` are the source files on which it depends, in addition to those of the classes in ``mark``; versions of
    libraries other than NumPy, SciPy and SymEngine belong into the mark.
    """
    if not mark.is_lasting:
        return find()
    sources = sorted(source_digest(str(path)) for path in code)
    libraries = [version(name) for name in ("numpy", "scipy", "symengine")]
    name = fingerprint(mark.digest, sources, libraries).digest[:32]
    return from_file(cache_root() / "numbers" / f"{name}.json", find, json.loads, lambda x: json.dumps(x).encode())


def from_file(
    path: Path, find: Callable[[], Any], read: Callable[[bytes], Any], write: Callable[[Any], bytes | None]
) -> Any:
    """Return the result of ``find``, read from its file in the cache if that exists, else computed and stored.

    It is not stored if ``write`` returns None.
    """
    folder = path.parent
    with suppress(OSError, ValueError):
        if untrusted((folder, path)) is None and (content := unsealed(path.read_bytes())) is not None:
            return read(content)
    found = find()
    if (content := write(found)) is None:
        return found
    with suppress(OSError):
        make_folder(folder)
        keep_file(path, sealed(content))
        # For one of sixteen names, which are digests: to list the folder takes longer than to store a file.
        names = os.listdir(folder) if path.stem < "1" else []
        if len(names) > MOST_FILES:
            for old in sorted((folder / name for name in names), key=os.path.getmtime)[: len(names) // 2]:
                old.unlink(missing_ok=True)
    return found
