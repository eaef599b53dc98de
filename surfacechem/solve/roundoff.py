"""Rounding of margins and of sliding velocities, and what the stepper does at each margin.

A run may stall because a sliding velocity without inertia is near zero, where it is no more than rounding: it is what
is left of large tractions, divided by a resistance; what they are rounded by it cannot resolve, however small it is.
Where a run stalls at that, the velocity's absolute tolerance is raised to it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from surfacechem.compile.program import Function, Program
from surfacechem.model.automaton import Edge
from surfacechem.model.system import Margin as Watched
from surfacechem.model.system import System
from surfacechem.solve.arcs import changed
from surfacechem.solve.contract import Margin, Problem, Result, Solver, Status
from surfacechem.solve.equilibria import Point

Array = NDArray[np.float64]

NUDGE = 1e-6
"""Part by which states and loads are changed to see what margins are made of."""


def watched(margin: Watched) -> Margin:
    """What the stepper does at a margin of the system."""
    if margin.peak:
        return Margin.peak()
    return Margin.stop() if margin.terminal else Margin.restart()


def awaited(item: Edge) -> Margin:
    """What the stepper does at the margin of a transition."""
    return Margin.bear() if item.strict else Margin.stop()


def sizes(program: Program, strict: NDArray[np.bool_], system: System, point: Point, seen: Array) -> Array:
    """Largest sizes of the guards seen; of a strict one also what cancels in it where it is zero."""
    if program.margins is None or not np.any(strict):
        return seen
    return np.where(strict, np.maximum(seen, _terms(program.margins, system, point)), seen)


def _terms(margins: Function, system: System, point: Point) -> Array:
    """Size of the terms of each margin, which rounding is in proportion to whatever is left, shape (margins,).

    Loads are made of such terms too, as the phase of an oscillation is.
    """
    n, inputs = len(system.states), point.inputs()
    given = [1 + 2 * n + j for j, p in enumerate(system.parameters) if p.changeable or p.load is not None]
    columns = np.array([*range(1, 1 + n), *given])
    typical = np.abs(inputs[columns])
    typical[:n] = np.maximum(typical[:n], [state.finest or state.scale for state in system.states])
    rows = np.repeat(inputs[None], 1 + len(columns), axis=0)
    rows[np.arange(1, len(rows)), columns] += NUDGE * typical
    values = margins(rows)
    with np.errstate(invalid="ignore"):  # a margin out of play may be infinite
        found = np.max(np.abs(values[1:] - values[0]), axis=0) / NUDGE
    return np.where(np.isfinite(found), found, 0.0)


ULPS = 4.4e-16
"""Rounding of a term: its own, and that of the sum it enters."""

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
        problem = changed(problem, atol=atol)
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
