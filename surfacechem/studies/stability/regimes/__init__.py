"""The regimes of the stability matrix, one class each; a class in any file of this folder is one.

>>> list(regimes())[:3]
['affinity', 'bell', 'capacity']
"""

from __future__ import annotations

import pkgutil
from functools import cache
from importlib import import_module

from surfacechem.errors import InputError, suggestion
from surfacechem.studies.stability.regime import Regime


@cache
def regimes() -> dict[str, Regime]:
    """Every regime by name."""
    modules = [import_module(f"{__name__}.{module.name}") for module in pkgutil.iter_modules(__path__)]
    kinds = [kind for module in modules for kind in vars(module).values() if _is_regime(kind, module.__name__)]
    return {kind.name: kind() for kind in sorted(kinds, key=lambda kind: str(kind.name))}


def _is_regime(kind: object, module: str) -> bool:
    return isinstance(kind, type) and issubclass(kind, Regime) and kind.__module__ == module


def chosen(names: tuple[str, ...]) -> list[Regime]:
    """The regimes of these names, or all; InputError with the nearest guess."""
    known = regimes()
    for name in names:
        if name not in known:
            raise InputError(f"no regime '{name}'.{suggestion(name, known)}")
    return [known[name] for name in names or known]
