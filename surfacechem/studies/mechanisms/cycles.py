"""Cycles of reactions: whether the rates around each agree with any thermo at all.

Reactions that lead back to where they began change nothing, so that in equilibrium the product of their k_f/k_r is one,
whatever the thermo of the species. Rates whose product is not one keep the cycle running without end.

Source: Wegscheider (1901), Monatsh. Chem. 22, 849, doi 10.1007/BF01517498.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import lcm

import numpy as np
from numpy.typing import NDArray

from surfacechem.model.pairs import Opposed
from surfacechem.results.detailed_balance import ROUNDED
from surfacechem.studies.mechanisms.rate_tables import Curves

Array = NDArray[np.float64]
Step = str | Opposed
"""A reaction, by its label, or a pair of one-way reactions."""


@dataclass(frozen=True)
class Cycle:
    """Steps that together change nothing, each with how often it is taken; backwards where that is negative."""

    steps: Sequence[tuple[Step, int]]

    @property
    def labels(self) -> tuple[str, ...]:
        """Labels of all its reactions."""
        return tuple(label for step, _ in self.steps for label in _labels(step))

    def departure(self, curves: Curves, temperatures: Array, forces: Array) -> Array:
        """Logarithm of the product of k_f/k_r around the cycle."""
        total = np.zeros(np.broadcast_shapes(np.shape(temperatures), np.shape(forces)))
        for step, times in self.steps:
            if isinstance(step, Opposed):
                total = total + times * curves.departure(step, temperatures, forces)
        return total


def cycles(curves: Curves) -> list[Cycle]:
    """Independent cycles that hold at least one pair or one-way reaction; others agree by construction."""
    steps = _steps(curves)
    changes = [curves.laws[step].change if isinstance(step, str) else step.change for step in steps]
    found = []
    for row in _null_space(changes):
        taken = [(step, times) for step, times in zip(steps, row, strict=True) if times]
        if any(isinstance(step, Opposed) or not curves.laws[step].reversible for step, _ in taken):
            found.append(Cycle(taken))
    return found


def verdict(cycle: Cycle, curves: Curves, temperatures: Array, forces: Array) -> str:
    """Whether a cycle can come to rest, in words."""
    one_way = {step: times for step, times in cycle.steps if isinstance(step, str) and not curves.laws[step].reversible}
    if one_way and min(one_way.values()) < 0 < max(one_way.values()):
        return "goes round neither way, since it has one-way reactions in both directions"
    if one_way:
        return f"nothing stops it, since there is no way back from {', '.join(one_way)}: give each a reverse"
    values = cycle.departure(curves, temperatures, forces)
    worst = float(values.flat[int(np.abs(values).argmax())])
    if abs(worst) <= ROUNDED:
        return f"the product of k_f/k_r is 1 to within {abs(worst):.1e}"
    return f"INCONSISTENT: the product of k_f/k_r is not 1 but exp({worst:.3g}) at most, which no thermo allows"


def _labels(step: Step) -> tuple[str, ...]:
    return step.labels if isinstance(step, Opposed) else (step,)


def _steps(curves: Curves) -> list[Step]:
    paired = {label for pair in curves.pairs for label in pair.labels}
    return [*(label for label in curves.laws if label not in paired), *curves.pairs]


def _null_space(changes: Sequence[Mapping[str, float]]) -> list[list[int]]:
    """Integer combinations of changes that are none, one for each change that depends on those before it."""
    reduced: list[tuple[str, dict[str, Fraction], list[Fraction]]] = []
    found = []
    for k, change in enumerate(changes):
        rest = {name: Fraction(nu).limit_denominator(1000) for name, nu in change.items() if nu}
        made = [Fraction(int(i == k)) for i in range(len(changes))]
        for pivot, other, combination in reduced:
            factor = rest.get(pivot, Fraction(0)) / other[pivot]
            for name, value in other.items():
                rest[name] = rest.get(name, Fraction(0)) - factor * value
            made = [a - factor * b for a, b in zip(made, combination, strict=True)]
        rest = {name: value for name, value in rest.items() if value}
        if rest:
            reduced.append((next(iter(rest)), rest, made))
        else:
            scale = lcm(*(value.denominator for value in made))
            found.append([int(value * scale) for value in made])
    return found
