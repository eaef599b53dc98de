"""What a run found about rates that are stated both ways: whether they know the equilibrium of the potential.

Where the interface is in equilibrium every reaction runs as often forward as back, so that k_f/k_r is the equilibrium
constant K(g, T), the elastic energy of the bonds included. A reversible law has this by construction; two laws that run
one way each have it only if their parameters say so.

Source: Onsager (1931), Phys. Rev. 37, 405 (detailed balance); Sauer, Duong & Mandadapu (2021), section 4.3 (entropy).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from surfacechem.results.audit import Audit
from surfacechem.solve.run import Trajectory
from surfacechem.tolerances import NEGLIGIBLE

ROUNDED = NEGLIGIBLE
"""Departures below this are rounding of published numbers."""


@dataclass(frozen=True)
class Verdict:
    """Range of ln(k_f/k_r) - ln K(g, T) along a run, and whether they produced entropy all the time."""

    title: str
    low: float
    high: float
    dissipates: bool

    @property
    def largest(self) -> float:
        """Largest departure."""
        return max(abs(self.low), abs(self.high))

    @property
    def consistent(self) -> bool:
        """Whether the rates keep detailed balance, up to rounding of their parameters."""
        return self.largest <= ROUNDED

    def __str__(self) -> str:
        """The verdict in words."""
        entropy = "entropy production stayed positive" if self.dissipates else "it DESTROYED ENTROPY"
        return f"{self.title}: {said(self.low, self.high)}; {entropy}"


def said(low: float, high: float) -> str:
    """A range of departures in words.

    >>> said(-2.3, 0.0)
    'k_f/k_r departs from the equilibrium constant K(g, T) by a factor exp(-2.3) at most'
    """
    worst = low if abs(low) > abs(high) else high
    if not math.isfinite(worst):
        return "one of the two never runs, so that k_f/k_r is not K(g, T)"
    if abs(worst) <= ROUNDED:
        return f"k_f/k_r is K(g, T) to within {abs(worst):.1e}"
    return f"k_f/k_r departs from the equilibrium constant K(g, T) by a factor exp({worst:.3g}) at most"


def verdicts(trajectory: Trajectory, audit: Audit) -> tuple[Verdict, ...]:
    """The verdict on each pair of rates, over all outputs and steps."""
    found = []
    for pair in trajectory.model.system.pairs:
        values = trajectory.everywhere[pair.departure]
        if not len(values):  # a run that ends at its start
            continue
        low, high = float(np.min(values)), float(np.max(values))
        found.append(Verdict(pair.title, low, high, pair.law not in audit.violations))
    return tuple(found)
