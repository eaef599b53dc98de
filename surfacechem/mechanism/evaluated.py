"""Reactions of a type that is not lowered: Cantera itself gives their rates while a scene runs.

Their heat follows from the potential like that of any other reaction, since the species' thermo is lowered.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from surfacechem.expressions import Expression
from surfacechem.mechanism.mixture import AVOGADRO, Formula, Species
from surfacechem.mechanism.rates import KILO, MechanismReaction
from surfacechem.terms import parameter

MOLECULAR = KILO * AVOGADRO
"""Molecules in a kmol."""


class EvaluatedReaction(MechanismReaction):
    """A reaction whose net rate is a number that comes from outside at every call."""

    value: float = parameter("1/(m^2 s)", "net rate, evaluated by Cantera", varies=False)

    @property
    def rate(self) -> Formula:  # type: ignore[override]
        """Net rate [1/(m^2 s)]."""
        return Formula((), self._rate)

    def _rate(self, _values: Mapping[str, Expression]) -> Expression:
        return self.value


class SurfaceEngine:
    """A Cantera surface as the source of the net rates of some of its reactions.

    ``reactions`` maps the position of each reaction in the surface to its law.
    """

    def __init__(self, surface: Any, species: Sequence[Species], reactions: Mapping[int, EvaluatedReaction]) -> None:
        self.surface = surface
        self.positions = list(reactions)
        self.gives = tuple(f"{law.path}.value" for law in reactions.values())
        first = species[0]
        self.reads = ("T_c", first.concentration, *(item.variable for item in species))
        self._sites = first.sites

    def __call__(self, values: Sequence[float]) -> Sequence[float]:
        """Net rates [1/(m^2 s)] at a temperature, the amount of the first species at full coverage, and coverages."""
        T, amount, *coverages = values
        if not (T > 0 and amount > 0):
            return [math.nan] * len(self.positions)
        self.surface.TP = T, None
        self.surface.site_density = amount * self._sites / MOLECULAR
        self.surface.set_unnormalized_coverages(coverages)
        rates = self.surface.net_rates_of_progress
        return [float(rates[i]) * MOLECULAR for i in self.positions]
