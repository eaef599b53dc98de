"""The worst corner of a regime: a search over decades of its parameters for what the solver does worst."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import Bounds, differential_evolution

from surfacechem.errors import InputError
from surfacechem.solve.run import OWN
from surfacechem.studies.stability.matrix import FAILED, MOST, RTOL, WRONG, Cell, attempt
from surfacechem.studies.stability.regime import Regime

log = logging.getLogger(__name__)

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

    Source: Storn & Price (1997), Differential evolution, J. Global Optim. 11, 341 (rand/1/bin), as in SciPy.
    """
    random = np.random.default_rng(seed)
    names, low, high = list(regime.space), *np.array(list(regime.space.values())).T
    log.info("%s: searching its worst corner", regime.name)
    seen: list[tuple[dict[str, float], Cell]] = []

    def kept(point: NDArray[np.float64]) -> float:
        values = {name: float(10.0**x) for name, x in zip(names, point, strict=True)}
        seen.append((values, _cell(regime, values, rtol)))
        return -badness(seen[-1][1])

    differential_evolution(
        kept,
        Bounds(low, high),
        strategy="rand1bin",
        init=low + (high - low) * random.random((POPULATION, len(names))),
        maxiter=rounds,
        mutation=WEIGHT,
        recombination=CROSSOVER,
        tol=0,
        polish=False,
        rng=random,
    )
    point, cell = max(seen, key=lambda point_and_cell: badness(point_and_cell[1]))
    return Corner(regime, point, cell, len(seen), sum(cell.outcome in BADNESS for _, cell in seen))


def _cell(regime: Regime, point: Mapping[str, float], rtol: float) -> Cell:
    try:
        problem = regime.corner(point)
    except InputError as error:  # the corner is outside of what the exact solution holds for
        return Cell("refused", MOST, 0, 0, 0.0, error.message)
    return attempt(problem, [OWN], rtol)[0]
