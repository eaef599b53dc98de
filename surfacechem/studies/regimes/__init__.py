"""Regimes of the stability matrix: a case, a parameter that varies until the problem breaks, and the expected result.

A function marked `regime` in this file is a regime and is found without registration: thermal ones, with vanishing
capacities, conductances up to perfect contact and temperatures that lose their balance; mechanical ones, with gaps that
close, the passage of a fold and friction that chatters; chemical ones, with bonding at the limits of heat capacity,
affinity and time scales, and bonds under load.

>>> list(regimes())[:3]
['affinity', 'bell', 'capacity']
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias, TypeVar

import numpy as np

from surfacechem.errors import InputError, refuse_unknown
from surfacechem.quantities import BOLTZMANN, GAS_CONSTANT
from surfacechem.references.base import Reference
from surfacechem.references.bond_rupture import BellConstantForce, SharedLoadCluster, SuddenDebonding
from surfacechem.references.heat_exchange import CoolingToZero, SemenovFold, ThreeTemperatures
from surfacechem.references.normal_contact import ElasticContact, OverdampedPullOff
from surfacechem.references.reactions import (
    AdiabaticArrhenius,
    Bonding,
    EndothermicBonding,
    ExothermicBonding,
    ExponentialAffinitySolution,
)
from surfacechem.references.sliding import ClosingFilm, CoulombStop
from surfacechem.references.stick_slip import StickSlip
from surfacechem.solve.contract import Array

Values: TypeAlias = Mapping[str, Array | float]

R = TypeVar("R", bound=Reference)

# Cases that serve only to show failures of solvers are in the folder of their regimes.
FOLDER = Path(__file__).parent


class Exact(NamedTuple):
    """Expectation that the run finishes with these values at its output times [s], by name, and with so many events.

    States are compared, and the named quantities in ``also``; errors are relative to each value.
    """

    values: Callable[[Array], Values]
    also: Sequence[str] = ()
    events: int | None = None
    data: Mapping[str, float] = {}
    again: Callable[[Mapping[str, float], Array], Values] | None = None
    """Function for the values with other data, from which the condition number of the problem follows."""

    @classmethod
    def of(cls, reference: R, read: Callable[[R, Array], Values] = Reference.solution, **more: Any) -> Exact:
        """Return the values of an exact solution, or those that ``read`` takes from it; its parameters are the data."""
        return cls(lambda t: read(reference, t), **_varied(reference, read), **more)


class Stops(NamedTuple):
    """Expectation that physics ends the run, for a reason that contains these words, at a time [s]."""

    reason: str
    t: float
    data: Mapping[str, float] = {}
    again: Callable[[Mapping[str, float]], float] | None = None
    """Function for the time with other data, from which the condition number of the problem follows."""

    @classmethod
    def of(cls, reason: str, reference: R, read: Callable[[R], float] = lambda one: one.end_time) -> Stops:
        """Return the end of an exact solution, or the time that ``read`` takes from it; its parameters are the data."""
        return cls(reason, read(reference), **_varied(reference, read))


def _varied(reference: R, read: Callable[..., Any]) -> dict[str, Any]:
    """Return the parameters of an exact solution as data, and a function for its values with other data."""
    data = {item.name: getattr(reference, item.name) for item in reference.parameters}
    return {"data": data, "again": lambda data, *t: read(type(reference)(**data), *t)}


class Refused(NamedTuple):
    """Expectation that the input is refused before anything is computed, for a reason that contains these words."""

    reason: str


Expectation: TypeAlias = Exact | Stops | Refused


class Trial(NamedTuple):
    """A case, by its name if shipped or by its file, with changes by path, and the expected result of its run."""

    case: str
    times: Sequence[float]
    """Output times [s]; the run begins at 0."""
    expected: Expectation
    changes: Mapping[str, object] = {}


class Regime(NamedTuple):
    """A row of the stability matrix: a parameter that varies over decades, and the problem at each value."""

    name: str
    title: str
    symbol: str
    """Symbol of the parameter in headings."""
    values: Sequence[float]
    problem: Callable[[float], Trial]
    label: Callable[[float], str]
    """Text of a value in headings."""
    corner: Callable[..., Trial]
    """The problem at a point of the space, given by parameters by name."""
    space: Mapping[str, tuple[float, float]]
    """Bounds of the decimal logarithm of each parameter in the search for the worst corner; empty without a search."""


def regime(
    title: str,
    symbol: str,
    values: Sequence[float],
    corner: Callable[..., Trial] | None = None,
    label: Callable[[float], str] = "{:g}".format,
    **space: tuple[float, float],
) -> Callable[[Callable[..., Trial]], Regime]:
    """Make a regime of a problem, a function of the parameter whose name it takes; ``corner`` is the problem of the
    search, if it differs.
    """

    def made(problem: Callable[..., Trial]) -> Regime:
        name = problem.__name__.replace("_", "-")
        return Regime(name, title, symbol, values, problem, label, corner or problem, space)

    return made


@cache
def regimes() -> dict[str, Regime]:
    """Return every regime by name."""
    found = [item for item in globals().values() if isinstance(item, Regime)]
    return {item.name: item for item in sorted(found, key=lambda item: item.name)}


def chosen(names: Sequence[str]) -> list[Regime]:
    """Return the regimes of these names, or all; InputError with the nearest guess."""
    known = regimes()
    refuse_unknown(names, known, "no regime '{}'")
    return [known[name] for name in names or known]


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


# Least ratio of stick to slip time that differs from steady sliding, whose events are as close. Also the part of the
# width of a bottleneck over which its speed is averaged: enough for a condition number, which has one digit.
SHORTEST_DISTANCE = 1e-5


@regime("Film that closes", "gap / initial gap", (1e-1, 1e-3, 1e-6, 1e-9, 1e-12, 1e-14, 0.0))
def film(value: float) -> Trial:
    """Closing of a sheared film: heat grows like the logarithm of the gap, until time no longer resolves the gap."""
    exact = ClosingFilm(eta=1e-2, v=0.5, g_i=1e-5, a=1e-6, C=800.0, T_0=300.0, T_i=300.0)
    if value == 0.0:
        return Trial("closing-film", [20.0], Stops.of("g_n reached zero", exact))
    last = 10.0 * (1.0 - value)
    return Trial("closing-film", [last / 2, last], Exact.of(exact))


@regime("Contact stiffness to rigid", "E_n [Pa/m]", (1e0, 1e8, 1e12, 1e16, 1e20, 1e28, 1e38))
def penalty(value: float) -> Trial:
    """Contact that becomes rigid: the gap k w / (k + E_n) vanishes while its traction stays."""
    exact = ElasticContact(k=1e12, E_n=value, w_i=0.0, w_dot=-1e-8)
    changes = {"interface.potential.normal-stiffness.E_n": value}
    return Trial(str(FOLDER / "contact.yaml"), [0.25, 0.5, 1.0], Exact.of(exact, also=["t_n"]), changes)


@regime(
    "Stick-slip, speed to nothing",
    "V [m/s]",
    (1e3, 1.0, 1e-3, 1e-6, 1e-9, 1e-12, 1e-15),
    V=(-15.0, 3.0),
    m=(-6.0, 6.0),
    k=(3.0, 13.0),
)
def chatter(V: float, m: float = 10.0, k: float = 1e8) -> Trial:
    """Stick-slip over nineteen decades of speed, with one slip per cycle and no spurious one."""
    exact = StickSlip(t_s=6e4, t_k=4e4, V=V, m=m, k=k)
    if exact.stick_time < SHORTEST_DISTANCE * exact.slip.duration:
        raise InputError(f"a stick of less than {SHORTEST_DISTANCE:g} of a slip is within rounding of steady sliding.")
    first = exact.onset_time + exact.slip.duration
    # Outputs in the middle of three sticks.
    times = [first + (j + 0.5) * exact.stick_time + j * exact.slip.duration for j in range(3)]
    changes = {"loading.w_t": {"ramp": {"rate": V}}, "mechanics.tangential.m": m, "mechanics.tangential.k": k}

    def at_rest(cycle: StickSlip, t: Array) -> dict[str, Array]:
        found = cycle.solution(t)
        return {"u_t": found["u_t"], "v": np.zeros_like(t), "t_t": found["spring_traction"]}

    return Trial("stick-slip", times, Exact.of(exact, at_rest, also=["t_t"], events=6), changes)


@regime("Coulomb friction stops a mass", "v_0 [m/s]", (1e-15, 1e-10, 1e-5, 1.0, 1e3, 1e6))
def stop(value: float) -> Trial:
    """Sliding mass stopped by friction: its velocity is exactly zero from then on."""
    exact = CoulombStop(m=5.0, mu=0.25, p=3e4, v_i=value, C=100.0, T_0=300.0, T_i=300.0)
    end = exact.stop_time
    times = [end * part for part in (0.25, 0.5, 0.9, 1.1, 2.0)]
    return Trial("coulomb-stop", times, Exact.of(exact, events=1), {"initial.v": value})


@regime("Slow passage of a fold", "distance / fold", (1e-2, 1e-3, 1e-5, 1e-7, 1e-9, 1e-11))
def fold(value: float) -> Trial:
    """Damped gap just beyond the fold of its equilibrium: the closer, the longer it stays in a bottleneck, within which
    it is compared.
    """
    gap = {"t_max": 1e6, "g_0": 1e-8, "k": 1e13, "c": 2e5}
    exact = OverdampedPullOff(**gap, delta_w=value * OverdampedPullOff(**gap, delta_w=1.0).fold.w)
    gaps = exact.fold.g + exact.width * np.linspace(-3.0, 3.0, 7)
    times = np.array([exact.time(g) for g in gaps])
    ahead = np.array([exact.time(g) for g in gaps + SHORTEST_DISTANCE * exact.width])
    speeds = SHORTEST_DISTANCE * exact.width / (ahead - times)

    def again(data: Mapping[str, float], t: Array) -> Mapping[str, Array]:
        """Return the gaps for other data to first order, from the times at which they are reached; the far-field
        displacement is part of the data.
        """
        given = {name: data[name] for name in ("t_max", "g_0", "k", "c")}
        beyond = data["w"] - OverdampedPullOff(**given, delta_w=1.0).fold.w
        if beyond <= 0:
            raise InputError("the fold is not reached.")
        other = OverdampedPullOff(**given, delta_w=beyond)
        return {"g_n": gaps + speeds * (t - np.array([other.time(g) for g in gaps]))}

    passed = Exact(lambda t: {"g_n": np.append(0.0, gaps)}, data={**gap, "w": exact.w}, again=again)
    return Trial("slow-passage", times.tolist(), passed, {"loading.w_n": exact.w})


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
    data = {"A": A, "E_a": E_a, "T_i": 300.0, "delta_T": 80.0}
    exact = AdiabaticArrhenius(**data)
    changes = {"interface.bonding.arrhenius.A": A, "interface.bonding.arrhenius.E_a": E_a}
    phi = np.array([0.01, 0.1, 0.3, 0.5, 0.7, 0.9])
    times = exact.time(phi)
    speeds = (1 - phi) * np.exp(value - E_a / (GAS_CONSTANT * (300.0 + 80.0 * phi)))

    def again(data: Mapping[str, float], t: Array) -> Mapping[str, Array]:
        """Return the bonds for other data to first order, from the times at which they are reached; needs no root."""
        other = AdiabaticArrhenius(**data)
        bonds = phi + speeds * (t - other.time(phi))
        return {"phi": bonds, "T": other.T_i + other.delta_T * bonds}

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
