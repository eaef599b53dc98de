"""Exact solutions, one a file, for verifying every solver to rounding.

`get("endothermic-bonding")` gives one class and imports its file only; `all()` gives every class by name.
"""

from __future__ import annotations

import pkgutil
from importlib import import_module

from surfacechem.errors import InputError, suggestion
from surfacechem.references.base import Reference

__all__ = ["Reference", "all", "get", "names"]

NO_SOLUTIONS = ("base", "matching")


def names() -> list[str]:
    """Names of all exact solutions, read off the file names."""
    files = [module.name for module in pkgutil.iter_modules(__path__)]
    return sorted(file.replace("_", "-") for file in files if file not in NO_SOLUTIONS and not file.startswith("_"))


def get(name: str) -> type[Reference]:
    """The exact solution called `name`.

    >>> get("sliding").__name__
    'Sliding'
    """
    known = names()
    if name not in known:
        raise InputError(f"no exact solution '{name}'.{suggestion(name, known)}")
    module = import_module(f"{__name__}.{name.replace('-', '_')}")
    return next(entry for entry in vars(module).values() if isinstance(entry, type) and _is_called(entry, name))


def all() -> dict[str, type[Reference]]:
    """Every exact solution by name."""
    return {name: get(name) for name in names()}


def _is_called(entry: type, name: str) -> bool:
    return issubclass(entry, Reference) and vars(entry).get("name") == name
