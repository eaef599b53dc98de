"""The worst corner of a regime: a search over decades of its parameters for what the solver does worst."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from surfacechem.errors import InputError
from surfacechem.integrate import OWN
from surfacechem.stability.matrix import FAILED, MOST, RTOL, WRONG, Cell, attempt
from surfacechem.stability.regime import Regime

SEED = 20210301
POPULATION, WEIGHT, CROSSOVER = 8, 0.7, 0.8
"""Differential evolution: points kept, length of a difference, share of its coordinates that is taken."""

BADNESS = {FAILED: MOST, WRONG: 2 * MOST}
"""A failure counts as worse than any error, a wrong answer as worse than a failure."""


@dataclass(frozen=True)
class Corner:
    """The worst point that a search has found, of how many tried, and how many were not solved."""

    regime: Regime
    point: Mapping[str, float]
    cell: Cell
    tried: int
    unsolved: int


def badness(cell: Cell) -> float:
    """What the search maximises: lost digits, and more for what is no answer."""
    return MOST - cell.digits + BADNESS.get(cell.outcome, 0.0)


def worst_corner(regime: Regime, rounds: int = 12, rtol: float = RTOL, seed: int = SEED) -> Corner:
    """Differential evolution over the regime's space, on decimal logarithms; the same seed gives the same corner.

    Source: Storn & Price (1997), Differential evolution, J. Global Optim. 11, 341 (rand/1/bin).
    """
    names, low, high = list(regime.space), *np.array(list(regime.space.values())).T
    random = np.random.default_rng(seed)
    points = low + (high - low) * random.random((POPULATION, len(names)))
    cells = [_cell(regime, names, point, rtol) for point in points]
    seen = list(cells)
    for _ in range(rounds):
        for i in range(POPULATION):
            trial = _trial(points, i, low, high, random)
            cell = _cell(regime, names, trial, rtol)
            seen.append(cell)
            if badness(cell) >= badness(cells[i]):
                points[i], cells[i] = trial, cell
    worst = max(range(POPULATION), key=lambda i: badness(cells[i]))
    unsolved = sum(cell.outcome in BADNESS for cell in seen)
    return Corner(regime, _values(names, points[worst]), cells[worst], len(seen), unsolved)


def _trial(
    points: NDArray[np.float64],
    i: int,
    low: NDArray[np.float64],
    high: NDArray[np.float64],
    random: np.random.Generator,
) -> NDArray[np.float64]:
    a, b, c = points[random.choice([j for j in range(len(points)) if j != i], 3, replace=False)]
    taken = random.random(len(low)) < CROSSOVER
    taken[random.integers(len(low))] = True
    return np.asarray(np.clip(np.where(taken, a + WEIGHT * (b - c), points[i]), low, high))


def _values(names: list[str], point: NDArray[np.float64]) -> dict[str, float]:
    return {name: float(10.0**x) for name, x in zip(names, point, strict=True)}


def _cell(regime: Regime, names: list[str], point: NDArray[np.float64], rtol: float) -> Cell:
    try:
        problem = regime.corner(_values(names, point))
    except InputError as error:  # the corner is outside of what the exact solution holds for
        return Cell("refused", MOST, 0, 0, 0.0, error.message)
    return attempt(problem, [OWN], rtol)[0]
