"""What the stepper is to do at the margins of a system, and what of a margin is no more than rounding."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from surfacechem.compile.program import Function
from surfacechem.model.automaton import Transition
from surfacechem.model.system import Margin as Watched
from surfacechem.model.system import System
from surfacechem.solve.contract import Margin, Problem
from surfacechem.solve.equilibria import Point

Array = NDArray[np.float64]

NUDGE = 1e-6
"""Part by which states and loads are changed to see what margins are made of."""


def watched(margin: Watched) -> Margin:
    """What the stepper does at a margin of the system."""
    if margin.peak:
        return Margin.peak()
    return Margin.stop() if margin.terminal else Margin.restart()


def awaited(item: Transition) -> Margin:
    """What the stepper does at the margin of a transition."""
    return Margin.bear() if item.to_pass else Margin.stop()


def to_pass(problem: Problem) -> NDArray[np.bool_]:
    """Which margins it takes more to than to touch zero."""
    return np.array([kind.to_pass for kind in problem.margins], dtype=bool)


def sizes(problem: Problem, system: System, point: Point, seen: Array) -> Array:
    """Largest sizes of the margins seen; of one to pass also what cancels in it where it is zero."""
    margins = problem.program.margins
    if margins is None or not np.any(passed := to_pass(problem)):
        return seen
    return np.where(passed, np.maximum(seen, _terms(margins, system, point)), seen)


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
