"""The stable one among several states of what has no inertia or capacity, from which a run starts."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from surfacechem.compile.program import Program
from surfacechem.errors import InputError
from surfacechem.model.system import STABLE, System
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
    playing = system.in_play(parameters)
    checks = [i for i, m in enumerate(system.moving_margins()) if m.name.startswith(STABLE) and playing[i]]
    chosen = _stable(program, checks, y, parameters, guessed) if checks else y
    found = consistent(program, 0.0, chosen, np.zeros_like(y), parameters)
    if found.valid and np.any(found.y[guessed] <= 0):
        names = " and ".join(state.name for state, is_one in zip(system.states, guessed, strict=True) if is_one)
        raise InputError(
            f"at the start the interface takes up more heat than any temperature {names} above zero brings it.",
            path="interface",
        )
    return chosen


def _stable(program: Program, checks: list[int], y: Array, parameters: Array, guessed: NDArray[np.bool_]) -> Array:
    tried = np.vstack([y, *(np.where(guessed, part * y, y) for part in COLDER)])
    if _are_stable(program, checks, tried[:1], parameters)[0]:
        return y
    stable = _are_stable(program, checks, tried, parameters)
    return np.asarray(tried[int(stable.argmax())] if stable.any() else y)


def _are_stable(program: Program, checks: list[int], y: Array, parameters: Array) -> NDArray[np.bool_]:
    found = consistent(program, 0.0, y, np.zeros_like(y), parameters)
    rows = np.concatenate([np.zeros((len(y), 1)), found.y, found.ydot, np.tile(parameters, (len(y), 1))], axis=1)
    assert program.margins is not None
    margins = np.atleast_2d(program.margins(rows))[:, checks]
    return np.asarray(found.valid & np.all(margins > 0, axis=1))
