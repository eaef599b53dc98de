"""Heat conductance over the gap of two curved surfaces as a function of their approach."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Any, Self

from surfacechem.contracts.terms import HeatTransfer, option
from surfacechem.documents.cache_folder import Fingerprint, fingerprint, kept
from surfacechem.expressions import Expression
from surfacechem.surfaces.approach import ApproachEnergy, fitted, straight
from surfacechem.surfaces.curved_gap import bends, density, over_gap, passages
from surfacechem.surfaces.patches import Budget
from surfacechem.surfaces.potential import CODE, CurvedSurfaces, integrating
from surfacechem.tolerances import ROUNDING

KNOWN: dict[Fingerprint, ApproachEnergy] = {}
"""Conductances that have been integrated, by what they are the conductances of."""


class CurvedConductance(HeatTransfer):
    """Conductance [W/K] between two curved bodies at the approach g_n, from one per area over the gap."""

    law: HeatTransfer = option("conductance per area, a law of the gap")
    pair: CurvedSurfaces = option("the two surfaces")

    @property
    def channel(self) -> str:  # type: ignore[override]
        """What carries the heat."""
        return self.law.channel

    @property
    def limits(self) -> Mapping[str, tuple[float, float]]:
        """The approaches between which it is known."""
        return self.pair.limits

    @property
    def called(self) -> str:
        """The key of its range."""
        return self.pair.called

    def outline(self) -> Self:
        """The same with a conductance that is a straight line."""
        return self.bind({"curve": straight(*self.pair.approach)})

    @property
    def error(self) -> float:
        """Relative error of the conductance, and of its slope."""
        return self.curve.error

    def erring(self) -> Self:
        """The same, larger by its error."""
        return self.bind({"curve": self.curve.erring()})

    @cached_property
    def curve(self) -> ApproachEnergy:
        """The conductance over the approach."""
        pair, law, levels = self.pair, density(self.law), bends([self.law])
        mark = fingerprint(pair.shapes, self.law, pair.approach, pair.accuracy)
        budget = Budget(pair.accuracy)

        def sample(d: float) -> tuple[float, float, float]:
            finer = max(pair.accuracy / 64, ROUNDING)
            found = pair.at_approach(d, lambda: over_gap(*pair.surfaces(d), [], levels, [law], finer, budget=budget))
            return found.conductance, found.conductance_slope, found.error

        def integrated() -> list[Any]:
            # A conductance and its slope are fitted like an energy and its force.
            cuts = passages(*pair.surfaces(0.0), levels)
            return fitted(sample, *pair.approach, pair.accuracy, cuts, budget=budget).numbers

        if mark not in KNOWN:
            with integrating():
                found = kept(mark, CODE, integrated)
            KNOWN[mark] = ApproachEnergy.of(found)
        return KNOWN[mark]

    def conductance(self, g_n: Expression) -> Expression:
        """Conductance [W/K]."""
        return self.curve.energy(g_n)
