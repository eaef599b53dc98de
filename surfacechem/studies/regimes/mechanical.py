"""Mechanical regimes: gaps that close, passage of a fold, friction that chatters."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from surfacechem.errors import InputError
from surfacechem.references.normal_contact import ElasticContact, OverdampedPullOff
from surfacechem.references.sliding import ClosingFilm, CoulombStop
from surfacechem.references.stick_slip import StickSlip
from surfacechem.solve.contract import Array
from surfacechem.studies.regimes import FOLDER, Exact, Stops, Trial, regime

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

    data = {"t_max": exact.t_max, "g_0": exact.g_0, "k": exact.k, "c": exact.c, "w": exact.w}
    passed = Exact(lambda t: {"g_n": np.append(0.0, gaps)}, data=data, again=again)
    return Trial("slow-passage", times.tolist(), passed, {"loading.w_n": exact.w})
