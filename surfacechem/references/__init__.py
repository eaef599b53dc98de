"""Exact solutions, one family per file, for verifying every solver to rounding.

`get("endothermic-bonding")` imports only the file with the class EndothermicBonding, and returns that class; `all()`
returns all by name.
"""

from __future__ import annotations

import re
from functools import cache
from importlib import import_module
from inspect import isabstract
from pathlib import Path

from surfacechem.errors import InputError, expect, suggestion
from surfacechem.references.base import Reference, name_of

__all__ = ["Reference", "all", "get", "known", "names"]


def names() -> list[str]:
    """Return the names of all exact solutions."""
    return sorted(all())


def known(name: str) -> bool:
    """True if there is an exact solution of this name; imports only the file of its class."""
    file = _files(tuple(__path__)).get(name)
    return file is not None and name in _members(file)


@cache
def get(name: str) -> type[Reference]:
    """Return the exact solution of a name.

    Parameters
    ----------
    name
        One of :func:`names`.

    Returns
    -------
    type
        Its class, whose parameters in SI make one solution: ``get("bell-ramp")(k_off=0.1, ...)``.

    Raises
    ------
    InputError
        If there is none of that name; the message has the nearest.

    Examples
    --------
    >>> get("sliding-constant-capacity").__name__
    'SlidingConstantCapacity'
    """
    expect(name, str, "the name of an exact solution is a text")
    if not known(name):
        raise InputError(f"no exact solution '{name}'.{suggestion(name, names())}")
    return _members(_files(tuple(__path__))[name])[name]


def all() -> dict[str, type[Reference]]:
    """Return every exact solution by name."""
    files = dict.fromkeys(_files(tuple(__path__)).values())
    return {name: kind for file in files for name, kind in _members(file).items()}


@cache
def _files(folders: tuple[str, ...]) -> dict[str, str]:
    """Return the file of every class by its name as an exact solution, read off the text of the files."""
    paths = sorted(path for folder in folders for path in Path(folder).glob("[!_]*.py"))
    texts = {path.stem: path.read_text(encoding="utf-8") for path in paths}
    return {name_of(kind): stem for stem, text in texts.items() for kind in re.findall(r"^class (\w+)", text, re.M)}


def _members(file: str) -> dict[str, type[Reference]]:
    """Return the exact solutions of a file by name."""
    module = import_module(f"{__name__}.{file}")
    kinds = [kind for kind in vars(module).values() if isinstance(kind, type) and kind.__module__ == module.__name__]
    return {kind.name: kind for kind in kinds if issubclass(kind, Reference) and not isabstract(kind)}
