"""Contact interfaces that bond, slide, break and heat.

>>> import surfacechem
>>> solution = surfacechem.run("exothermic")
>>> solution.status
'finished'

``load`` reads a case and returns a :class:`~surfacechem.runs.simulation.Simulation`, which compiles once and runs with
any values of its parameters; ``run`` does both, ``sweep`` runs many at once, ``precision`` measures error against run
time, ``steady`` finds where a mechanism comes to rest and what controls that, ``register`` makes a law of one's own
known.
Theory: Sauer, Duong & Mandadapu (2021), doi 10.1177/10812865211032723.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from surfacechem.laws import register
    from surfacechem.runs.simulation import Simulation, load, run, sweep
    from surfacechem.studies.precision import precision
    from surfacechem.studies.steady import steady

__all__ = ["Simulation", "load", "precision", "register", "run", "steady", "sweep"]


# Modules of names that are not in runs.simulation; each is imported on first use.
_ELSEWHERE = {"precision": "studies.precision", "register": "laws", "steady": "studies.steady"}


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return import_module("importlib.metadata").version(__name__)
    if name not in __all__:
        raise AttributeError(f"module 'surfacechem' has no attribute {name!r}")
    return getattr(import_module(f"surfacechem.{_ELSEWHERE.get(name, 'runs.simulation')}"), name)


def __dir__() -> list[str]:
    return [*__all__, "__version__"]  # a shell completes what a user calls, imported or not
