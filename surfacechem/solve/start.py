"""The stable one among several states of what has no inertia or capacity, from which a run starts."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from surfacechem.compile.program import Program
from surfacechem.errors import InputError
from surfacechem.model.system import System
from surfacechem.solve.radau.solver import consistent

Array = NDArray[np.float64]

COLDER = 0.95 ** np.arange(1, 40)
"""Parts of the first guess of a temperature that are tried where that leads to an unstable one."""


def stable_start(system: System, program: Program, y: Array, parameters: Array) -> Array:
    """First guesses that lead to a stable state; those given, where they do or where none does.

    Heat that grows with temperature meets what leaves twice: in a stable state, and above it in one that any
    disturbance ignites or cools down.
    """
    guessed = np.array([state.algebraic and state.is_temperature for state in system.states])
    if not guessed.any():
        return y
    if not _are_stable(system, program, y[None], parameters)[0]:
        tried = np.array([np.where(guessed, part * y, y) for part in COLDER])
        stable = _are_stable(system, program, tried, parameters)
        y = tried[int(stable.argmax())] if stable.any() else y
    found = consistent(program, 0.0, y, np.zeros_like(y), parameters)
    if found.valid and np.any(found.y[guessed] <= 0):
        names = " and ".join(state.name for state, is_one in zip(system.states, guessed, strict=True) if is_one)
        raise InputError(
            f"at the start the interface takes up more heat than any temperature {names} above zero brings it.",
            path="interface",
        )
    return y


def _are_stable(system: System, program: Program, y: Array, parameters: Array) -> NDArray[np.bool_]:
    """Which first guesses lead to states in which all limits of stability are open."""
    playing = system.in_play(parameters)
    checks = [i for i, m in enumerate(system.moving_margins()) if m.stability and playing[i]]
    if not checks or program.margins is None:
        return np.ones(len(y), dtype=bool)
    found = consistent(program, 0.0, y, np.zeros_like(y), parameters)
    rows = np.concatenate([np.zeros((len(y), 1)), found.y, found.ydot, np.tile(parameters, (len(y), 1))], axis=1)
    return np.asarray(found.valid & np.all(np.atleast_2d(program.margins(rows))[:, checks] > 0, axis=1))
