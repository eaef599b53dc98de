"""Solvers by name: those of this package, and those in ``adapters``, which are imported on first use.

>>> solver("radua")
Traceback (most recent call last):
    ...
ValueError: no solver 'radua'. Did you mean 'radau'? Known: bdf, cantera, cvode, dop853, ida, lsoda, radau, scipy-radau.
"""

import ast
import re
from functools import cache
from importlib import import_module
from pathlib import Path

from surfacechem.errors import suggestion
from surfacechem.solve.contract import Solver

AUTO = "auto"
"""Name that leaves the choice of the method to the program, and that of the tolerance to the requested accuracy."""

CALLING_PYTHON = ("cantera",)
"""Solvers whose right-hand sides are called from Python, so that rates may be evaluated by external code."""


_ADAPTERS: dict[str, str] = {}
"""Adapter module of each solver, read from the files without importing a library."""
for _file in sorted(Path(__file__).with_name("adapters").glob("*.py")):
    _declared = re.search(r"^NAMES = (\(.*\))$", _file.read_text(encoding="utf-8"), re.MULTILINE)
    _ADAPTERS.update(dict.fromkeys(ast.literal_eval(_declared[1]) if _declared else (), _file.stem))

OWN = {"radau": "Radau", "dop853": "Dop853"}
"""Methods of this package, and their classes."""

names = (*OWN, *sorted(_ADAPTERS, key=lambda name: name in CALLING_PYTHON))


@cache
def solver(name: str) -> Solver:
    """Return the solver of this name; the default is 'radau', a method of this package."""
    if name not in names:
        raise ValueError(f"no solver '{name}'.{suggestion(name, names)}")
    if name in OWN:
        made = getattr(import_module("surfacechem.solve.radau.solver"), OWN[name])()
    else:
        made = import_module(f"surfacechem.solve.adapters.{_ADAPTERS[name]}").make(name)
    assert isinstance(made, Solver)
    return made
