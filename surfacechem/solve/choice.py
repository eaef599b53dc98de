"""Automatic choice of the solver for a problem, with the reason in words."""

import numpy as np

from surfacechem.compile.program import MOST_RATE_STATES, Program
from surfacechem.solve import CALLING_PYTHON
from surfacechem.solve.contract import Problem
from surfacechem.tolerances import MIN_RTOL

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
    """Return the largest decay rate [1/s] of a small perturbation of the initial state; may be infinite."""
    n, parameters = program.n, problem.parameters[0]
    inputs = np.concatenate([problem.segments[:1], problem.y0, np.zeros(n), parameters])
    assert program.rates is not None
    inputs[1 + n : 1 + 2 * n] = program.rates(inputs)
    K, M = program.derivatives(inputs)
    try:
        growth = np.linalg.eigvals(np.linalg.solve(M, -K))
    except (np.linalg.LinAlgError, ValueError):
        return np.inf
    return float(max(-growth.real.min(initial=0.0), 0.0)) if np.all(np.isfinite(growth)) else np.inf
