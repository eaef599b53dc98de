"""Chemical regimes: bonding at the limits of heat capacity, affinity and time scales, and bonds under load."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from surfacechem.quantities import BOLTZMANN, GAS_CONSTANT
from surfacechem.references.bond_rupture import BellConstantForce, SharedLoadCluster, SuddenDebonding
from surfacechem.references.heat_exchange import CoolingToZero
from surfacechem.references.reactions import (
    AdiabaticArrhenius,
    Bonding,
    EndothermicBonding,
    ExothermicBonding,
    ExponentialAffinitySolution,
)
from surfacechem.solve.contract import Array
from surfacechem.studies.regimes import Exact, Refused, Stops, Trial, regime

CAPACITY_LOST = "heat capacity at T was lost"
N_C = 1e18


@regime(
    "Endothermic bonding, kappa to 1",
    "1 - kappa",
    (*(2.0**-n for n in (1, 10, 20, 30, 40, 46, 50, 52)), 0.0),
    label=lambda value: f"2^{math.log2(value):.0f}" if value else "0",
)
def endothermic(value: float) -> Trial:
    r"""Bonds take all heat except :math:`1-\kappa`: bodies at 256 K end at :math:`256\sqrt{1-\kappa}` after a layer
    :math:`\tau(1-\kappa)/2`. With kappa = 1 no heat is left and the input is refused.
    """
    K_2 = 512.0 * (1.0 - value)
    rate = {"value": N_C / K_2, "times": [{"power": {"exponent": -2}}]}
    changes = {
        "T_0": 256,
        "initial.T": 256,
        "interface.potential.bond-energy.K_2": K_2,
        "interface.bonding.linear-affinity.c_r": rate,
    }
    if value == 0.0:
        return Trial("endothermic-kappa-0p99", [5.0], Refused(CAPACITY_LOST), changes)
    exact = EndothermicBonding(C_1=1.0, C_2=1.0, T_0=256.0, K_2=K_2, tau=1.0)
    return Trial("endothermic-kappa-0p99", np.geomspace(1e-2 * value, 5.0, 25).tolist(), Exact.of(exact), changes)


def bonding_while_sliding(
    tau: float, C_1: float = 1.5, K_0: float = 120.0, D: float = 1e-3, T_i: float = 320.0
) -> Trial:
    """Return the problem with parameters of any size; the interface takes as much heat as it may."""
    given = {"C_1": C_1, "K_0": K_0, "T_i": T_i, "tau": tau, "D": D}
    exact = Bonding(C_2=0.7, C_c=0.3, T_0=300.0, phi_i=0.1, K_1=60.0, K_2=240.0, **given)
    changes = {
        "bodies.lower.C": C_1,
        "interface.potential.bond-energy.K_0": K_0,
        "interface.bonding.relaxation.tau": tau,
        "interface.friction.coulomb.mu": 1.0,
        "loading.p": D,
        "loading.v": 1.0,
        "initial.T": T_i,
    }
    return Trial("generalised-bonding-sliding", np.geomspace(1e-2 * tau, 1e6, 25).tolist(), Exact.of(exact), changes)


@regime(
    "Bonding within a part of the sliding time",
    "sliding time / bonding time",
    (1e0, 1e3, 1e6, 1e9, 1e12, 1e15, 1e18),
    bonding_while_sliding,
    tau=(-15.0, 6.0),
    C_1=(-6.0, 6.0),
    K_0=(-6.0, 6.0),
    D=(-9.0, 3.0),
    T_i=(0.0, 4.0),
)
def scale_ratio(value: float) -> Trial:
    """Bonds that form within a fraction of a second while friction heats the bodies for a million seconds."""
    return bonding_while_sliding(1e6 / value)


@regime("Exothermic bonding in 1e-15 to 1e15 s", "tau [s]", tuple(10.0**k for k in (-15, -10, -5, 0, 5, 10, 15)))
def seconds(value: float) -> Trial:
    """The same reaction from femtoseconds to 30 million years."""
    exact = ExothermicBonding(C_1=1.0, C_2=1.0, T_0=300.0, K_0=300.0, tau=value)
    changes = {"interface.bonding.linear-affinity.c_r": N_C / 300.0 / value}
    return Trial("exothermic", [value * k / 4 for k in range(1, 21)], Exact.of(exact), changes)


@regime(
    "Exponential law far from equilibrium",
    "|mu| / (k_B T)",
    (1e-6, 1e-3, 1.0, 30.0, 700.0, 1e3, 1e4, 1e6),
    a=(-8.0, 6.0),
    T=(0.0, 4.0),
    rate=(-12.0, 12.0),
)
def affinity(a: float, T: float = 310.0, rate: float = 1.0) -> Trial:
    r"""Exponential law from equilibrium to an affinity of a million :math:`k_BT`, where its rate overflows."""
    n = 5e17
    K = a * n * BOLTZMANN * T
    exact = ExponentialAffinitySolution(n_c=n, C_r=rate * n * n / K, K_c=K, T=T)
    changes = {
        "bodies.lower.temperature": T,
        "bodies.upper.temperature": T,
        "interface.temperature": T,
        "interface.potential.bond-energy.K_0": K,
        "interface.bonding.exponential-affinity.C_r": rate * n * n / K,
    }
    times = np.geomspace(1e-6 / rate, 5.0 / rate, 22).tolist()
    return Trial("exponential-affinity", times, Exact.of(exact), changes)


@regime("Thermal runaway of an activated reaction", "E_a / (R_g T)", (1.0, 5.0, 10.0, 24.0, 50.0, 100.0, 200.0))
def runaway(value: float) -> Trial:
    """Thermal explosion by self-heating: with the activation it becomes later, steeper, and less well conditioned."""
    E_a, A = value * GAS_CONSTANT * 300.0, math.exp(value)
    exact = AdiabaticArrhenius(A=A, E_a=E_a, T_i=300.0, delta_T=80.0)
    changes = {"interface.bonding.arrhenius.A": A, "interface.bonding.arrhenius.E_a": E_a}
    phi = np.array([0.01, 0.1, 0.3, 0.5, 0.7, 0.9])
    times = exact.time(phi)
    speeds = (1 - phi) * np.exp(value - E_a / (GAS_CONSTANT * (300.0 + 80.0 * phi)))

    def again(data: Mapping[str, float], t: Array) -> Mapping[str, Array]:
        """Return the bonds for other data to first order, from the times at which they are reached; needs no root."""
        other = AdiabaticArrhenius(**data)
        bonds = phi + speeds * (t - other.time(phi))
        return {"phi": bonds, "T": other.T_i + other.delta_T * bonds}

    data = {"A": A, "E_a": E_a, "T_i": 300.0, "delta_T": 80.0}
    return Trial("adiabatic-arrhenius", times.tolist(), Exact(exact.solution, data=data, again=again), changes)


@regime("Cooling towards T = 0", "T / T_0", (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 0.0))
def cold(value: float) -> Trial:
    """Cooling at a constant rate until the temperature is this part of its initial value; at zero the run stops."""
    exact = CoolingToZero(C=100.0, T_0=300.0, T_i=300.0, Q=50.0)
    if value == 0.0:
        return Trial("cooling-to-zero", [2 * exact.end_time], Stops.of("the temperature T reached zero", exact))
    last = exact.end_time * (1.0 - value**2)
    return Trial("cooling-to-zero", [last / 2, last], Exact.of(exact))


# -- bonds under load: exponents beyond the range of doubles, and rupture with an infinite slope -----------------------

T, X = 300.0, 4e-10
FORCE = BOLTZMANN * T / X

# Logarithm of the rate [1/s] beyond which rupture is not resolved in time.
MOST_IMMEDIATE = 230.0


@regime(
    "Bell exponents to 1e4",
    "F x / (k_B T)",
    (1e-3, 1.0, 10.0, 100.0, 500.0, 700.0, 1e3, 1e4),
    exponent=(-3.0, 4.0),
    k_off=(-12.0, 12.0),
)
def bell(exponent: float, k_off: float = 0.1) -> Trial:
    """Force that accelerates rupture by up to exp(10000): the bonds vanish, without an infinity.

    Times are relative to that of rupture, or to 1e-100 s if it is shorter: rates beyond exp(300) count as immediate.
    """
    force = exponent * FORCE
    exact = BellConstantForce(k_off=k_off, x_off=X, T=T, f=force)
    changes = {"loading.f": force, "interface.bonding.bell.k_off": k_off}
    span = math.exp(-min(exact.log_rate, MOST_IMMEDIATE))
    times = [span * part for part in (0.01, 0.1, 0.5, 1.0, 3.0)]
    return Trial("bond-constant-force", times, Exact.of(exact), changes)


@regime("Rupture under a shared load", "load per site x / (k_B T)", (1e-6, 1e-3, 0.1, 0.5, 1.0, 10.0, 100.0, 500.0))
def rupture(value: float) -> Trial:
    """Bonds that share a load until the last one breaks, at a time known up to roundoff."""
    sites = 1e14
    exact = SharedLoadCluster(k_off=0.5, x_off=X, T=T, n_c=sites, t_n=value * sites * FORCE)
    changes = {"loading.t_n": value * sites * FORCE}
    if value > 300.0:
        return Trial("shared-load-rupture", [1.0], Refused("the bonds ruptured"), changes)
    return Trial("shared-load-rupture", [2.0 * exact.end_time], Stops.of("the bonds ruptured", exact), changes)


@regime(
    "Sudden debonding, verdicts of the second law",
    "K_0 / (T_0 C)",
    (1e-12, 1e-6, 1e-3, 0.1, 0.9, 1.2, 1.2499999, 1.26, 1e6),
)
def debonding(value: float) -> Trial:
    """All bonds break at once, and heat pays for the energy that springs do not: ever less is left, then none."""
    K_0 = value * 600.0
    changes = {"interface.potential.bond-energy.K_0": K_0}
    strength = 38.72983346207417e6
    exact = SuddenDebonding(C=2.0, T_0=300.0, T_i=300.0, K_0=K_0, t_n=strength, k=1e13)
    if value > 1.25:
        impossible = Stops.of("which is impossible", exact, lambda bonds: bonds.t_n / bonds.k / 1e-6)
        return Trial("debonding-cooling", [10.0], impossible, changes)

    def after(bonds: SuddenDebonding, t: Array) -> dict[str, Array]:
        return {"T": np.where(t < 9.0, 300.0, bonds.final_temperature)}

    return Trial("debonding-cooling", [1.0, 10.0], Exact.of(exact, after, events=1), changes)
