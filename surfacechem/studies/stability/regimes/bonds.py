"""Bonds under load: exponents beyond what a double holds, and rupture with an infinite slope."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from surfacechem.quantities import BOLTZMANN
from surfacechem.references.bell import BellConstantForce
from surfacechem.references.cluster import SharedLoadCluster
from surfacechem.references.sudden_debonding import SuddenDebonding
from surfacechem.studies.stability.regime import Array, Exact, Problem, Refused, Regime, Stops

T, X = 300.0, 4e-10
FORCE = BOLTZMANN * T / X

IMMEDIATE = 230.0
"""Logarithm of the rate [1/s] beyond which rupture is not resolved in time."""


class Bell(Regime):
    """A force that speeds rupture up by exp(10000): the bonds are gone, without an infinity.

    Times are that of rupture, or 1e-100 s where it is shorter: rates beyond exp(300) are taken as immediate.
    """

    name = "bell"
    title = "Bell exponents to 1e4"
    symbol = "F x / (k_B T)"
    values = (1e-3, 1.0, 10.0, 100.0, 500.0, 700.0, 1e3, 1e4)
    space: ClassVar = {"exponent": (-3.0, 4.0), "k_off": (-12.0, 12.0)}

    def problem(self, value: float) -> Problem:
        return self.corner({"exponent": value, "k_off": 0.1})

    def corner(self, point: Mapping[str, float]) -> Problem:
        """Exponent and rate at rest of any size."""
        force, k = point["exponent"] * FORCE, point["k_off"]
        exact = BellConstantForce(k_off=k, x_off=X, T=T, f=force)
        changes = {"loading.f": force, "interface.bonding.bell.k_off": k}
        span = math.exp(-min(exact.log_rate, IMMEDIATE))
        times = [span * part for part in (0.01, 0.1, 0.5, 1.0, 3.0)]
        return Problem("bond-constant-force", times, Exact.of(exact), changes)


class Rupture(Regime):
    """Bonds that share a load until the last one breaks, at a time known to rounding."""

    name = "rupture"
    title = "Rupture under a shared load"
    symbol = "load per site x / (k_B T)"
    values = (1e-6, 1e-3, 0.1, 0.5, 1.0, 10.0, 100.0, 500.0)

    def problem(self, value: float) -> Problem:
        sites = 1e14
        exact = SharedLoadCluster(k_off=0.5, x_off=X, T=T, n_c=sites, t_n=value * sites * FORCE)
        changes = {"loading.t_n": value * sites * FORCE}
        if value > 300.0:
            return Problem("shared-load-rupture", [1.0], Refused("the bonds ruptured"), changes)
        return Problem("shared-load-rupture", [2.0 * exact.end_time], Stops.of("the bonds ruptured", exact), changes)


class Debonding(Regime):
    """All bonds break at once, and heat pays for what springs do not: less and less is left, then nothing."""

    name = "debonding"
    title = "Sudden debonding, verdicts of the second law"
    symbol = "K_0 / (T_0 C)"
    values = (1e-12, 1e-6, 1e-3, 0.1, 0.9, 1.2, 1.2499999, 1.26, 1e6)

    def problem(self, value: float) -> Problem:
        K_0 = value * 600.0
        changes = {"interface.potential.bond-energy.K_0": K_0}
        strength = 38.72983346207417e6
        exact = SuddenDebonding(C=2.0, T_0=300.0, T_i=300.0, K_0=K_0, t_n=strength, k=1e13)
        if value > 1.25:
            impossible = Stops.of("which is impossible", exact, lambda bonds: bonds.t_n / bonds.k / 1e-6)
            return Problem("debonding-cooling", [10.0], impossible, changes)

        def after(bonds: SuddenDebonding, t: Array) -> dict[str, Array]:
            return {"T": np.where(t < 9.0, 300.0, bonds.final_temperature)}

        return Problem("debonding-cooling", [1.0, 10.0], Exact.of(exact, after, events=1), changes)
