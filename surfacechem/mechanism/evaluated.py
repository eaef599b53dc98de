"""Reactions that are not lowered: Cantera itself gives their rates while a scene runs.

Their heat follows from the potential like that of any other reaction, since the thermo of surface species is lowered.
What reactions take from phases beside the surface brings its enthalpy and its entropy with it, which Cantera gives too.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from surfacechem.contracts.terms import option, parameter
from surfacechem.expressions import Expression
from surfacechem.mechanism.mixture import AVOGADRO, Formula, Species
from surfacechem.mechanism.neighbours import Held
from surfacechem.mechanism.rates import MechanismReaction
from surfacechem.mechanism.thermo import KILO

MOLECULAR = KILO * AVOGADRO
"""Molecules in a kmol."""


class EvaluatedReaction(MechanismReaction):
    """A reaction whose net rate is a number that comes from outside at every call."""

    value: float = parameter("1/(m^2 s)", "net rate, evaluated by Cantera", varies=False)
    whole: Mapping[str, float] = option("products less reactants, those in neighbours included")
    reversible: bool = option("whether it runs both ways", default=True)

    @property
    def rate(self) -> Formula:  # type: ignore[override]
        """Net rate [1/(m^2 s)]."""
        return _given(lambda: self.value)

    @property
    def one_way(self) -> bool:
        """Whether the reaction runs one way only."""
        return not self.reversible

    def turnover(self) -> Mapping[str, int | float]:
        """Change of every species, in molecules."""
        return dict(self.whole)


class NeighbourReaction(EvaluatedReaction):
    """A reaction that takes something from phases beside the surface, or gives something to them."""

    enthalpy: float = parameter("J", "enthalpy taken from neighbours, evaluated by Cantera", varies=False)
    gibbs: float = parameter("J", "Gibbs energy taken from neighbours, evaluated by Cantera", varies=False)

    @property
    def taken(self) -> tuple[Formula, Formula]:
        """Enthalpy and Gibbs energy [J] that one reaction takes from the neighbours."""
        return _given(lambda: self.enthalpy), _given(lambda: self.gibbs)


def _given(value: Callable[[], Expression]) -> Formula:
    return Formula((), lambda _: value())


class SurfaceEngine:
    """A Cantera surface as the source of the net rates of some of its reactions, and of what they take from neighbours.

    ``reactions`` maps the position of each reaction in the surface to its law.
    """

    def __init__(self, surface: Any, species: Sequence[Species], reactions: Mapping[int, EvaluatedReaction]) -> None:
        self.surface = surface
        self.positions = list(reactions)
        open_ones = [i for i, law in reactions.items() if isinstance(law, NeighbourReaction)]
        self.held = Held(surface, open_ones) if open_ones else None
        paths = [reactions[i].path for i in open_ones]
        self.gives = (
            *(f"{law.path}.value" for law in reactions.values()),
            *(f"{path}.enthalpy" for path in paths),
            *(f"{path}.gibbs" for path in paths),
        )
        first = species[0]
        self.reads = ("T_c", first.concentration, *(item.variable for item in species))
        self._sites = first.sites
        self._last: tuple[Sequence[float], Sequence[float]] = (), ()

    def __call__(self, values: Sequence[float]) -> Sequence[float]:
        """Net rates [1/(m^2 s)] at a temperature, the amount of the first species at full coverage, and coverages.

        Then the enthalpy and the Gibbs energy [J] that each reaction with neighbours takes from them.
        """
        if values != self._last[0]:
            self._last = values, self._evaluate(values)
        return self._last[1]

    def _evaluate(self, values: Sequence[float]) -> Sequence[float]:
        T, amount, *coverages = values
        if not (T > 0 and amount > 0):
            return [math.nan] * len(self.gives)
        self.surface.TP = T, None
        if self.held is not None:
            self.held.warm(T)
        self.surface.site_density = amount * self._sites / MOLECULAR
        self.surface.set_unnormalized_coverages(coverages)
        rates = self.surface.net_rates_of_progress
        found = [float(rates[i]) * MOLECULAR for i in self.positions]
        if self.held is None:
            return found
        taken = (self.held.enthalpies(), self.held.gibbs_energies())
        return found + [float(energy) / MOLECULAR for energies in taken for energy in energies]
