"""Thermal regimes: vanishing capacities, conductances up to perfect contact, temperatures that lose their balance."""

from __future__ import annotations

import math

import numpy as np

from surfacechem.references.heat_exchange import SemenovFold, ThreeTemperatures
from surfacechem.studies.regimes import FOLDER, Exact, Refused, Stops, Trial, regime

# Cases of a medium from which bonds take heat, and of a film heated by friction.
MEDIUM_CASE, FILM_CASE = str(FOLDER / "medium.yaml"), str(FOLDER / "film.yaml")

BODIES = {"C_1": 1200.0, "C_2": 500.0, "C_c": 8.0, "h_1": 2500.0, "h_2": 700.0, "D_0": 150.0}


def three_temperatures(**parameters: float) -> Trial:
    """Return the problem of two bodies and a medium, from the initial layer to the end."""
    p = {**BODIES, **parameters}
    exact = ThreeTemperatures(T_1=290.0, T_2=350.0, T_c=300.0, **p)
    changes = {
        "bodies.lower.C": p["C_1"],
        "bodies.upper.C": p["C_2"],
        "interface.potential.constant-interface-capacity.C_c": p["C_c"],
        "heat": [
            {"conductance": {"between": ["lower", "interface"], "h": p["h_1"]}},
            {"conductance": {"between": ["upper", "interface"], "h": p["h_2"]}},
        ],
        "loading.Q_c": p["D_0"],
    }
    layer = p["C_c"] / (p["h_1"] + p["h_2"])
    times = np.geomspace(min(layer, 1.0), 10.0, 25).tolist()
    return Trial("three-temperatures", times, Exact.of(exact), changes)


@regime("Capacity of the interface to nothing", "C_c [J/(m^2 K)]", (8.0, 1e-3, 1e-6, 1e-9, 1e-12, 1e-15, 1e-18))
def capacity(value: float) -> Trial:
    """Medium whose capacity vanishes: it follows the bodies after a layer as short as its capacity is small."""
    return three_temperatures(C_c=value)


@regime("Conductances to perfect contact", "h [W/(m^2 K)]", (1e0, 1e4, 1e8, 1e12, 1e16, 1e20))
def conductance(value: float) -> Trial:
    """Conductances that grow until the two bodies are in perfect contact."""
    return three_temperatures(h_1=value, h_2=value)


@regime(
    "Range of the rates of heat exchange",
    "fastest rate / slowest rate",
    (1e2, 1e5, 1e10, 1e15, 1e20, 1e25),
    three_temperatures,
    C_1=(-9.0, 9.0),
    C_2=(-9.0, 9.0),
    C_c=(-18.0, 6.0),
    h_1=(-9.0, 15.0),
    h_2=(-9.0, 15.0),
    D_0=(-6.0, 6.0),
)
def stiffness(value: float) -> Trial:
    """Light, well connected body and heavy, insulated one: a wide range of rates in a linear system."""
    spread = math.sqrt(value)
    return three_temperatures(C_1=spread, C_2=1.0, C_c=1.0 / spread, h_1=1.0, h_2=1.0, D_0=1e-3)


@regime(
    "Capacity that bonds leave to the interface",
    "C_eff [J/(m^2 K)]",
    (1e-1, 1e-4, 1e-8, 1e-12, 1e-15, -1e-15, -1e-8, -1e-1),
)
def lost_capacity(value: float) -> Trial:
    """Bonds that take 0.8 J/(m^2 K) from a medium with slightly more, which settles, or with less, which is refused."""
    changes = {"interface.potential.interface-capacity.C_c": 0.8 + value}
    if value < 0:
        return Trial(MEDIUM_CASE, [1.0], Refused("heat capacity at T_c was lost"), changes)
    settled = Exact(
        lambda t: {"T_c": np.where(t < 1.0, 301.0, 300.0)},
        data={"T_1": 300.0, "T_2": 300.0},
        again=lambda data, t: {"T_c": np.full_like(t, (500.0 * data["T_1"] + 300.0 * data["T_2"]) / 800.0)},
    )
    return Trial(MEDIUM_CASE, [1.0], settled, changes)


CRITICAL_HEAT = 50.0 / (math.e * 0.05)


@regime(
    "Ignition of an algebraic temperature",
    "1 - D_0 / D_crit",
    (0.5, 1e-1, 1e-3, 1e-6, 1e-9, 1e-12, -1e-9, -1e-3, -1e-1),
)
def ignition(value: float) -> Trial:
    r"""Medium without capacity whose heat grows exponentially with its temperature: one half before the fold at
    :math:`H/(e\beta)`, where the temperature is known to the square root of rounding, and no solution beyond.
    """
    heat = (1.0 - value) * CRITICAL_HEAT
    changes = {"interface.friction.viscous.eta": {"value": heat * 1e-4, "times": [{"exponential": {"beta": -0.05}}]}}
    if value < 0:
        return Trial(FILM_CASE, [1.0], Stops("ignition: no temperature T_c balances the heat", 0.0), changes)
    exact = SemenovFold(T_0=300.0, beta=0.05, H=50.0, D_0=heat)
    return Trial(FILM_CASE, [1.0], Exact.of(exact, lambda fold, t: {"T_c": fold.solution(t)["T_c"]}), changes)
