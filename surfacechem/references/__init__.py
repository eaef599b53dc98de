"""Exact solutions, one family per file, for verifying every solver to rounding.

`get("endothermic-bonding")` imports the file of bonding only and returns one class; `all()` returns all by name.
"""

from __future__ import annotations

import pkgutil
from functools import cache
from importlib import import_module
from inspect import isabstract

from surfacechem.errors import InputError, suggestion
from surfacechem.references.base import Reference

__all__ = ["Reference", "all", "get", "known", "names"]

NO_SOLUTIONS = ("base", "scene_view")
"""Modules without an exact solution, in addition to those that begin with an underscore."""


def names() -> list[str]:
    """Return the names of all exact solutions."""
    return sorted(all())


def known(name: str) -> bool:
    """True if there is an exact solution of this name; imports only the file of its family."""
    return name in _family(name)


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
    if not known(name):
        raise InputError(f"no exact solution '{name}'.{suggestion(name, names())}")
    return _family(name)[name]


def all() -> dict[str, type[Reference]]:
    """Return every exact solution by name."""
    return {name: kind for family in _families() for name, kind in _members(family).items()}


@cache
def _family(name: str) -> dict[str, type[Reference]]:
    """Return the exact solutions of the file with the longest name that is part of this one."""
    families = [family for family in _families() if family.replace("_", "-") in name]
    return _members(max(families, key=len)) if families else {}


def _families() -> list[str]:
    """Return the names of the files with exact solutions."""
    files = (module.name for module in pkgutil.iter_modules(__path__))
    return [file for file in files if file not in NO_SOLUTIONS and not file.startswith("_")]


def _members(family: str) -> dict[str, type[Reference]]:
    """Return the exact solutions of a file by name."""
    module = import_module(f"{__name__}.{family}")
    kinds = [kind for kind in vars(module).values() if isinstance(kind, type) and kind.__module__ == module.__name__]
    return {kind.name: kind for kind in kinds if issubclass(kind, Reference) and not isabstract(kind)}
