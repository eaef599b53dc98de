"""Solvers by name: those of this package, and those in ``adapters``, which are imported on first use; and the automatic
choice of one for a problem, with the reason in words.

>>> solver("radua")
Traceback (most recent call last):
    ...
surfacechem.errors.InputError: no solver 'radua'. Did you mean 'radau'? Known: bdf, cantera, cvode, ...
"""

import ast
import re
from functools import cache
from importlib import import_module
from pathlib import Path

import numpy as np

from surfacechem.compile.program import MOST_RATE_STATES, Program
from surfacechem.errors import refuse_unknown
from surfacechem.solve.contract import Problem, Solver
from surfacechem.tolerances import MIN_RTOL

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
    refuse_unknown([name], names, "no solver '{}'")
    if name in OWN:
        made = getattr(import_module("surfacechem.solve.radau.solver"), OWN[name])()
    else:
        made = import_module(f"surfacechem.solve.adapters.{_ADAPTERS[name]}").make(name)
    assert isinstance(made, Solver)
    return made


IMPLICIT, EXPLICIT = "radau", "dop853"

STIFF = 1e3
"""Ratio of the length of a run to its shortest relaxation time above which it counts as stiff from the start: some two
hundred explicit steps at their stability limit cost as much as the implicit steps of a smooth run.
"""


def method(problem: Problem, moves: bool) -> tuple[str, str]:
    """Return the solver of a problem and the reason in words; ``moves`` is True if a gap follows from a balance.

    A run that becomes stiff later needs no choice here: the explicit method then continues with implicit steps.
    """
    program = problem.program
    if program.external is not None:
        return CALLING_PYTHON[0], "rates of the mechanism come from Cantera itself, which it can ask"
    # After touch the last digit of the gap decides between branches; implicit steps locate it more closely.
    why = _why_implicit(problem) or ("a gap moves, and may touch or stop" if moves else "")
    if why:
        return IMPLICIT, f"implicit, order 5 to 13 by tolerance: {why}"
    return EXPLICIT, "explicit, order 8, as the start is not stiff; implicit from where the run becomes so"


def _why_implicit(problem: Problem) -> str:
    """Return the reason why steps have to be implicit, in words; empty if they can be explicit."""
    program = problem.program
    if any(program.algebraic):
        return "some states are algebraic"
    if program.chains:
        return "heat conducted between cells is stiff"
    if program.n > MOST_RATE_STATES:
        return f"{program.n} states, whose rates would be compiled for it"
    if program.rates is None:
        return "the equations determine their rates together"
    if problem.rtol <= MIN_RTOL:
        return "at this tolerance fewer and longer steps round less"
    end, fastest = float(problem.segments[-1]), fastest_relaxation(program, problem)
    if fastest * end <= STIFF:
        return ""
    return f"stiff, as the fastest relaxation at the start takes {1 / fastest:.2g} s of {end:.2g} s"


def fastest_relaxation(program: Program, problem: Problem) -> float:
    """Return the largest decay rate [1/s] of a small perturbation of the initial state, or a bound of it that is not
    stiff; may be infinite.
    """
    n, parameters = program.n, problem.parameters[0]
    inputs = np.concatenate([problem.segments[:1], problem.y0, np.zeros(n), parameters])
    assert program.rates is not None
    inputs[1 + n : 1 + 2 * n] = program.rates(inputs)
    K, M = program.derivatives(inputs)
    try:
        slopes = np.linalg.solve(M, -K)
        # No eigenvalue exceeds this norm, which is found in a third of the time and is small enough as a rule.
        norm = float((np.abs(slopes) @ problem.atol / problem.atol).max(initial=0.0))
        if norm * problem.segments[-1] <= STIFF:
            return norm
        growth = np.linalg.eigvals(slopes)
    except (np.linalg.LinAlgError, ValueError):
        return np.inf
    return float(max(-growth.real.min(initial=0.0), 0.0)) if np.all(np.isfinite(growth)) else np.inf
