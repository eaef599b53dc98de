"""Rounding of sliding velocities.

A run may stall because a sliding velocity without inertia is near zero, where it is no more than rounding: it is what
is left of large tractions, divided by a resistance; what they are rounded by it cannot resolve, however small it is.
Where a run stalls at that, the velocity's absolute tolerance is raised to it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from surfacechem.solve.contract import Problem, Result, Solver, Status
from surfacechem.tolerances import ULPS

Array = NDArray[np.float64]

SEEN, AGAIN = 100.0, 3
"""Tolerance in units of the rounding, and how often it is raised."""


def solve(method: Solver, problem: Problem, velocities: NDArray[np.bool_], first: Result | None = None) -> Result:
    """The result of a method, or the ``first`` one found; ``velocities`` marks the algebraic states that tractions
    determine.
    """
    result = first or method.solve(problem)
    for _ in range(AGAIN if velocities.any() else 0):
        if result.status is not Status.STEP_UNDERFLOW:
            break
        atol = np.where(velocities, np.maximum(problem.atol, SEEN * rounding(result)), problem.atol)
        if not np.all(np.isfinite(atol)) or np.all(atol == problem.atol):
            break
        problem = problem.changed(atol=atol)
        result = method.solve(problem)
    return result


def rounding(result: Result) -> Array:
    """What rounding of the equations' terms leaves uncertain of each unknown at the end of a run, shape (states,)."""
    problem, n = result.problem, len(result.y)
    inputs = np.concatenate(([result.t], result.y, result.ydot, problem.parameters[-1]))
    both = problem.program.jacobian(problem.program.filled(inputs)).reshape(2, n, n)
    terms = np.abs(both[0] * result.y).sum(axis=1) + np.abs(both[1] * result.ydot).sum(axis=1)
    matrix = np.where(problem.program.algebraic_mask, both[0], both[1])
    try:
        found: Array = np.abs(np.linalg.inv(matrix)) @ (ULPS * terms)
    except np.linalg.LinAlgError:
        return np.zeros(n)
    return found
