"""Pieces of time between which the parameters of a system may jump, and the parameters of each."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from surfacechem.model.system import TOLERANCE, System

Array = NDArray[np.float64]

PARTS_OF_A_PERIOD, MOST_PARTS = 8.17, 20_000
"""Parts into which the period of a load is cut, so many that no cut falls on a reversal, and the number of them above
which it is left to the steps."""

STRAY, LARGEST_SLACK = 1e3, 1e-3
"""How far bonding may stray beyond its bounds between two points of a step, in tolerances, and at most."""


def segments(system: System, end: float, values: Mapping[str, float]) -> Array:
    """Pieces of time: between breakpoints, and parts of the period of a load where the state may be at rest."""
    inside = [t for t in system.breakpoints if 0 < t < end]
    for path in system.cycles:
        count = math.floor(PARTS_OF_A_PERIOD * values[path] * end)
        if count <= MOST_PARTS:
            inside += [k / (PARTS_OF_A_PERIOD * values[path]) for k in range(1, count + 1)]
    return np.unique([0.0, *(t for t in inside if t < end), end])


def segment_parameters(system: System, starts: Array, rtol: float, values: Mapping[str, float]) -> Array:
    """Parameters of each piece: loads as they start it, bounds with the slack that the tolerance needs."""
    rows = np.empty((len(starts), len(system.parameters)))
    for j, parameter in enumerate(system.parameters):
        if parameter.load is not None:
            rows[:, j] = [parameter.at(float(start)) for start in starts]
        elif parameter.path == "run.slack":
            rows[:, j] = min(max(values[parameter.path], STRAY * rtol), LARGEST_SLACK)
        elif parameter.path == TOLERANCE:
            rows[:, j] = rtol
        else:
            rows[:, j] = values[parameter.path]
    return rows


def nudge(system: System, parameters: Array) -> None:
    """Change the numbers of histories by their last digit, one up, the next down; times that pieces count from stay."""
    loads = [j for j, p in enumerate(system.parameters) if p.path.startswith("loading.") and p.field != "origin"]
    parameters[:, loads] *= 1 + np.finfo(float).eps * (-1.0) ** np.arange(len(loads))


def start_modes(system: System, parameters: Array, values: Mapping[str, float]) -> None:
    """Modes that follow from the initial state."""
    symbols = [p.symbol for p in system.parameters]
    initial = {state.symbol: state.from_given(values) for state in system.states}
    initial |= dict(zip(symbols, parameters[0].tolist(), strict=True)) | {system.t: 0}
    for mode in system.modes:
        if mode.start is not None:
            start = float(system.expand(mode.start).subs(initial))
            parameters[:, symbols.index(mode.symbol)] = start
        if mode.given is not None:
            parameters[:, symbols.index(mode.symbol)] = mode.given(values)
