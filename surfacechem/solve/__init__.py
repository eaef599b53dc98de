"""Solvers by name: our own, and those of the files in ``adapters``, each of which is imported when it is asked for.

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
"""Name by which the method is chosen for the scene, and the tolerance from the accuracy that is asked for."""

CALLING_PYTHON = ("cantera",)
"""Solvers that call Python for their right-hand sides, and so can use rates evaluated outside."""


_ADAPTERS: dict[str, str] = {}
"""Files of adapters by the names of their solvers, which are read without importing a library."""
for _file in sorted(Path(__file__).with_name("adapters").glob("*.py")):
    _declared = re.search(r"^NAMES = (\(.*\))$", _file.read_text(encoding="utf-8"), re.MULTILINE)
    _ADAPTERS.update(dict.fromkeys(ast.literal_eval(_declared[1]) if _declared else (), _file.stem))

OWN = {"radau": "Radau", "dop853": "Dop853"}
"""The methods of this package, and their classes."""

names = (*OWN, *sorted(_ADAPTERS, key=lambda name: name in CALLING_PYTHON))


@cache
def solver(name: str) -> Solver:
    """The solver of this name; 'radau' is our own and the default."""
    if name not in names:
        raise ValueError(f"no solver '{name}'.{suggestion(name, names)}")
    if name in OWN:
        made = getattr(import_module("surfacechem.solve.radau.solver"), OWN[name])()
    else:
        made = import_module(f"surfacechem.solve.adapters.{_ADAPTERS[name]}").make(name)
    assert isinstance(made, Solver)
    return made
