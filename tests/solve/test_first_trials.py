"""Scenes that one tries first, against closed forms worked out by hand."""

import math

import numpy as np
import pytest
from scenes import SITES, bodies, varying

from surfacechem.laws.bonding import BondEnergy
from surfacechem.laws.cohesive import ExponentialCohesiveZone, TensileStrength
from surfacechem.laws.contact import BondedContact, NormalStiffness, Penalty
from surfacechem.laws.factors import LinearInTemperature
from surfacechem.laws.friction import Coulomb, MohrCoulomb
from surfacechem.laws.loading import Harmonic, Hold, Ramp, Table
from surfacechem.model.assemble import assemble
from surfacechem.results.audit import audit
from surfacechem.scene import Interface, Mounting, Scene, Stage
from surfacechem.solve.run import Model, Run

P, MU, K = 1e5, 0.5, 1e10
"""A slider of stiffness K sticks up to MU P."""

DIGITS = 65.0 * 300.0 * float(np.finfo(float).eps)
"""Heat that the last digit of the temperature of both bodies stands for [J/m^2]."""


def solve(until, potentials=(), frictions=(), limits=(), initial=None, loading=None, closed=1e-9, rtol=1e-11, **scene):
    interface = Interface("T", potentials, frictions, sites=SITES if limits else None, limits=limits)
    start = {"T": 300.0} | (initial or {})
    whole = Scene(bodies("T", "T"), interface, loading=loading or {}, T_0=300.0, initial=start, **scene)
    trajectory = Model(assemble(whole)).solve(Run(times=np.linspace(0.0, until, 21), rtol=rtol))
    assert trajectory.status == "finished", trajectory.reason
    books = audit(trajectory)
    assert np.max(np.abs(books.energy)) < closed * books.energy_scale + DIGITS
    assert books.violations == ()
    return trajectory


def events(trajectory):
    return [(jump.edge.name, jump.t) for jump in trajectory.jumps]


def final(trajectory, name):
    return trajectory.result.y[[state.name for state in trajectory.model.system.states].index(name)]


def slider(history, until=1.0, initial=None, closed=1e-9, **mount):
    loading = {"p": Hold(level=P), "w_t": history}
    mounting = Mounting(k=K, **mount)
    return solve(until, (), [Coulomb(mu=MU)], initial=initial, loading=loading, closed=closed, tangential=mounting)


def test_a_free_body_leaves_a_zone_with_the_energy_it_brought():
    zone, m, v, g = ExponentialCohesiveZone(t_max=1e6, g_0=1e-8, E_n=1e14), 1e-2, -5.0, 1e-7
    start = {"g_n": g, "v_n": v}
    trajectory = solve(1e-6, [zone], initial=start, loading={"F_n": Hold(level=0.0)}, normal=Mounting(m=m))
    assert [name for name, _ in events(trajectory)] == ["touch", "release"]
    left = v**2 + 2 / m * (zone.energy(g_n=g) - zone.energy(g_n=float(final(trajectory, "g_n"))))
    assert final(trajectory, "v_n") == pytest.approx(math.sqrt(left), rel=1e-10)


def test_two_strengths_reached_at_once_break_the_interface_once():
    limits = [TensileStrength(t_max=1e6), TensileStrength(t_max=1e6)]
    trajectory = solve(
        2.0,
        [BondEnergy(K_0=0.01)],
        limits=limits,
        initial={"phi": 1.0},
        loading={"w_n": Ramp(rate=1e-6)},
        normal=Mounting(k=1e12),
    )
    assert events(trajectory) == [("debond", pytest.approx(1.0, rel=1e-12))]
    assert trajectory.jumps[0].released == pytest.approx(0.5 - 0.005, rel=1e-12)


def test_sliding_begins_before_the_interface_debonds():
    loading = {"w_n": Ramp(rate=1e-6), "w_t": Ramp(rate=1e-6)}
    trajectory = solve(
        2.0,
        [BondedContact(E_n=1e13), BondEnergy(K_0=0.01)],
        [MohrCoulomb(mu=0.5, c=5e5)],
        [TensileStrength(t_max=5e5)],
        {"phi": 1.0},
        loading,
        normal=Mounting(k=1e12),
        tangential=Mounting(k=1e12),
    )
    # 1/k + 1/E = 1.1e-12 m/Pa; joint release of both springs less the bonds
    assert events(trajectory) == [
        ("slip forward", pytest.approx(0.5, rel=1e-12)),
        ("debond", pytest.approx(0.55, rel=1e-12)),
    ]
    assert trajectory.jumps[1].released == pytest.approx(0.5 * 5e5**2 * 1.1e-12 - 0.005, rel=1e-9)


@pytest.mark.parametrize(("excess", "slips"), [(-1e-12, 0), (1e-9, 6)])
def test_a_limit_that_is_all_but_touched_and_one_that_is_passed(excess, slips):
    amplitude = MU * P / K * (1 + excess)
    trajectory = slider(Harmonic(amplitude=amplitude, frequency=1.0), until=3.0)
    assert len([name for name, _ in events(trajectory) if name.startswith("slip")]) == slips


def test_a_limit_that_is_reached_at_the_start():
    trajectory = slider(Ramp(start=MU * P / K, rate=1e-6), until=3.0)
    assert events(trajectory) == [("slip forward", 0.0)]
    assert final(trajectory, "u_t") == pytest.approx(3e-6, rel=1e-9)


PULSE = Table(times=[0.0, 0.5, 0.5 + 5e-10, 0.5 + 1e-9, 1.0], values=[0.0, 0.0, 2 * MU * P / K, 0.0, 0.0])
"""A billionth of the run, to twice the limit."""


def test_a_brief_pulse_makes_a_slider_slip():
    """Twice the limit forward, then back until the spring holds the limit the other way, which it does not pass."""
    trajectory = slider(PULSE, closed=1e-6)  # the pulse lasts ten million last digits of its time
    times = [0.5 + 2.5e-10, 0.5 + 5e-10]
    assert [name for name, _ in events(trajectory)] == ["slip forward", "stop"]
    assert [t for _, t in events(trajectory)] == pytest.approx(times, abs=3e-16)


def test_a_brief_pulse_pushes_a_mass():
    """Impulse of the force above the limit, and its stop by friction an eighth of the pulse after it."""
    trajectory = slider(PULSE, initial={"v": 0.0, "u_t": 0.0}, closed=1e-5, m=1.0)
    assert events(trajectory)[-1][0] == "stop"
    assert events(trajectory)[-1][1] == pytest.approx(0.5 + 1.125e-9, abs=1e-15)
    assert final(trajectory, "v") == 0.0


def test_stages_that_end_at_forces_times_and_events():
    stages = (
        Stage("approach", {"w_n": -1e-7}, event="touch"),
        Stage("press", {"w_n": -1e-7}, variable="p", value=1e5),
        Stage("hold", {}, duration=1.0),
        Stage("slide", {"w_t": 1e-7}, event="slip forward"),
        Stage("further", {"w_t": 1e-7}, duration=0.5),
        Stage("pull", {"w_n": 1e-7}, event="release"),
        Stage("leave", {"w_n": 1e-7}),
    )
    trajectory = solve(
        20.0,
        [Penalty(E_n=1e13)],
        [Coulomb(mu=0.3)],
        initial={"w_n": 1e-7, "w_t": 0.0, "g_n": 1e-7},
        normal=Mounting(k=1e12),
        tangential=Mounting(k=1e12),
        programme=stages,
        rtol=1e-12,
    )
    # p = 1e5 Pa at w = -1.1e-7 m, sliding at 0.3 p / k = 3e-8 m; released 1.1 s after the pull begins
    found = dict(reversed(events(trajectory)))
    names = ("touch", "end of press", "end of hold", "slip forward", "end of further", "release")
    assert [found[name] for name in names] == pytest.approx([1.0, 2.1, 3.1, 3.4, 3.9, 5.0], rel=1e-9)


def test_a_contact_that_softens_with_temperature_cools_as_it_is_loaded():
    """S = C (T / T_0 - 1) + 1/2 E_0 a g^2 stays, with the stiffness E_0 [1 - a (T - T_0)] and C = 3 J/(m^2 K)."""
    contact = NormalStiffness(E_n=varying(1e13, LinearInTemperature(slope=-1e-3)))
    load = Harmonic(amplitude=-1e-6, frequency=0.1)
    trajectory = solve(20.0, [contact], loading={"w_n": load}, normal=Mounting(k=1e13))
    values = trajectory.everywhere
    capacity = sum(body.energy.C for body in bodies())
    T = 300.0 * (1 - 0.5 * 1e10 * values["g_n"] ** 2 / capacity)
    assert values["T"] == pytest.approx(T, rel=1e-10)
    assert np.ptp(values["T"]) > 1e-3
