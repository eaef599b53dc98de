"""Solvers by name; each is imported when it is asked for.

>>> solver("radua")
Traceback (most recent call last):
    ...
ValueError: no solver 'radua'. Did you mean 'radau'? Known: bdf, cantera, cvode, ida, lsoda, radau, scipy-radau.
"""

import difflib
from importlib import import_module

from surfacechem.solve.contract import Solver

_FACTORIES = {
    "radau": ("radau.solver", "Radau"),
    "lsoda": ("adapters.scipy_methods", "lsoda"),
    "bdf": ("adapters.scipy_methods", "bdf"),
    "scipy-radau": ("adapters.scipy_methods", "radau"),
    "cvode": ("adapters.sundials", "CVODESolver"),
    "ida": ("adapters.sundials", "IDASolver"),
    "cantera": ("adapters.cantera_network", "CanteraSolver"),
}

names = tuple(_FACTORIES)

AUTO = "auto"
"""The method is chosen for the scene, and the tolerance from the accuracy that is asked for."""

ASKING = ("cantera",)
"""Solvers that call Python for their right-hand sides, and so can ask something outside for rates."""


def solver(name: str) -> Solver:
    """The solver of this name; 'radau' is our own and the default."""
    if name not in _FACTORIES:
        near = difflib.get_close_matches(name, _FACTORIES, n=1)
        guess = f" Did you mean '{near[0]}'?" if near else ""
        raise ValueError(f"no solver '{name}'.{guess} Known: {', '.join(sorted(_FACTORIES))}.")
    module, factory = _FACTORIES[name]
    made = getattr(import_module(f"surfacechem.solve.{module}"), factory)()
    assert isinstance(made, Solver)
    return made
