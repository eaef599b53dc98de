"""Limits that are touched and not passed, and sliding that begins, stops and lies at rest: each once, and no more."""

import numpy as np
import pytest
from scenes import bodies

from surfacechem.laws.contact import Penalty, TangentialStiffness
from surfacechem.laws.friction import Coulomb, Stribeck
from surfacechem.laws.loading import Harmonic, Hold, Ramp, Table
from surfacechem.model.assemble import assemble
from surfacechem.results.audit import audit
from surfacechem.scene import Interface, Mounting, Scene
from surfacechem.solve.run import Model, Run

MU, P = 0.3, 100.0
LIMIT = MU * P
BODIES = bodies("T", "T", C_1=10.0, C_2=10.0)
RTOLS = [1e-6, 1e-9, 1e-11, 1e-13]


def solved(interface, loading, end, rtol=1e-11, initial=None, **mounts):
    scene = Scene(BODIES, interface, (), loading, None, 300.0, {"T": 300.0, **(initial or {})}, **mounts)
    return Model(assemble(scene)).solve(Run(np.linspace(0.0, end, 101).tolist(), rtol))


def names(trajectory):
    return [jump.edge.name for jump in trajectory.jumps]


def block(amplitude, frequency, end, rtol, mean=0.0, initial=None):
    """A mass that rubs under a traction that swings."""
    loading = {"p": Hold(level=P), "F_t": Harmonic(amplitude=amplitude, frequency=frequency, mean=mean)}
    mount = Mounting(m=5.0)
    return solved(Interface("T", frictions=[Coulomb(mu=MU)]), loading, end, rtol, initial, tangential=mount)


def elastic(amplitude, rtol, end=3.0):
    """Elastic sticking in series with a spring as stiff: the elastic gap is half of what is imposed."""
    loading = {"p": Hold(level=P), "w_t": Harmonic(amplitude=amplitude, frequency=3.0)}
    interface = Interface("T", [TangentialStiffness(E_t=1e6)], [Coulomb(mu=MU)])
    return solved(interface, loading, end, rtol, tangential=Mounting(k=1e6))


@pytest.mark.parametrize("rtol", RTOLS)
@pytest.mark.parametrize(("amplitude", "mean", "frequency"), [(LIMIT, 0.0, 3.0), (LIMIT / 2, LIMIT / 2, 7.0)])
def test_a_traction_that_touches_the_limit_moves_nothing(amplitude, mean, frequency, rtol):
    trajectory = block(amplitude, frequency, 3.0, rtol, mean)
    assert trajectory.status == "finished"
    assert names(trajectory) == []
    assert np.all(trajectory.everywhere["v"] == 0)
    assert np.all(trajectory.everywhere["u_t"] == 0)


@pytest.mark.parametrize("rtol", RTOLS)
@pytest.mark.parametrize("amplitude", [60e-6, 59.999999999999e-6])
def test_elastic_sticking_that_touches_its_limit_sticks(amplitude, rtol):
    trajectory = elastic(amplitude, rtol)
    assert trajectory.status == "finished"
    assert names(trajectory) == []
    times = trajectory.result.times
    gap = 0.5 * amplitude * np.sin(6 * np.pi * times)
    np.testing.assert_allclose(trajectory.result.outputs[:, 1], gap, rtol=0, atol=max(10 * rtol, 1e-10) * amplitude)


@pytest.mark.parametrize("rtol", [1e-9, 1e-11, 1e-13])
@pytest.mark.parametrize("amplitude", [60.001e-6, 60.1e-6, 66e-6])
def test_a_limit_that_is_just_passed_slides_from_there_to_the_peak(amplitude, rtol):
    """From a peak the gap has to swing by twice the limit: it slides in each half of a period, for a moment."""
    trajectory = elastic(amplitude, rtol)
    first = np.arcsin(60e-6 / amplitude)
    again = np.arcsin((120e-6 - amplitude) / amplitude)
    half = np.arange(18)
    begins = np.where(half == 0, first, half * np.pi + again) / (6 * np.pi)
    ends = (half + 0.5) / 3.0 / 2.0
    assert names(trajectory) == [x for j in half for x in (("slip forward", "slip backward")[j % 2], "stop")]
    found = np.array([jump.t for jump in trajectory.jumps])
    np.testing.assert_allclose(found[::2], begins, rtol=0, atol=max(10 * rtol, 1e-9))
    np.testing.assert_allclose(found[1::2], ends, rtol=0, atol=max(10 * rtol, 1e-9))


@pytest.mark.parametrize("rtol", [1e-9, 1e-11, 1e-13])
def test_a_block_that_is_shaken_begins_and_stops_once_in_each_half_period(rtol):
    trajectory = block(1.5 * LIMIT, 3.0, 3.0, rtol, initial={"v": 0.01})
    found = names(trajectory)
    assert found[0] == "stop"
    expected = [x for j in range(len(found)) for x in (("slip backward", "slip forward")[j % 2], "stop")]
    begun = [jump.t for jump in trajectory.jumps if jump.edge.name != "stop"]
    first = expected.index(found[1])
    assert found[1:] == expected[first : first + len(found) - 1]
    omega = 6 * np.pi
    phase = np.mod(omega * np.array(begun), np.pi)
    np.testing.assert_allclose(phase, np.arcsin(1 / 1.5), rtol=1e-11)


@pytest.mark.parametrize("rtol", [1e-9, 1e-11, 1e-13])
def test_a_damper_of_the_bodies_does_not_delay_the_slip(rtol):
    """Before the first slip the bodies push with k w + c_b w': at rest that has to be what the static limit bears."""
    k, m, c, V, p_0, rise = 3e7, 25.0, 900.0, 3e-3, 1e5, 5e3
    friction = Stribeck(mu_s=0.7, mu_k=0.3, v_s=4e-3, delta=1.3, c_v=300.0)
    loading = {"p": Ramp(start=p_0, rate=rise), "w_t": Ramp(rate=V)}
    mount = Mounting(k=k, m=m, c_b=c)
    trajectory = solved(Interface("T", frictions=[friction]), loading, 6.0, rtol, tangential=mount)
    assert names(trajectory) == ["slip forward", "stop"] * (len(trajectory.jumps) // 2)
    for jump in trajectory.jumps[::2]:
        u = jump.before.y[0]
        onset = (0.7 * p_0 + k * u - c * V) / (k * V - 0.7 * rise)
        assert jump.t == pytest.approx(onset, rel=1e-13)


def bouncing(tangential, initial, end, F_t=None):
    loading = {"F_n": Hold(level=-3000.0), **({"F_t": F_t} if F_t else {})}
    loading |= {"w_t": Hold(level=0.0)} if tangential.k else {}
    interface = Interface("T", [Penalty(E_n=8e9)], [Coulomb(mu=0.05)])
    start = {"g_n": 1e-4, "v_n": -0.5, **initial}
    return solved(interface, loading, end, initial=start, normal=Mounting(m=3.0), tangential=tangential)


def test_what_lies_at_rest_on_a_body_that_bounces_does_not_begin_to_slide():
    """Friction stops what slides in the first contacts; then there is neither traction nor velocity across."""
    trajectory = bouncing(Mounting(m=3.0), {"v": 0.3}, 0.02)
    assert names(trajectory).count("stop") == 1
    others = [name for name in names(trajectory) if name != "stop"]
    assert others == ["touch", "release"] * (len(others) // 2)


def test_what_lies_in_the_air_moves_with_the_least_push():
    """A traction that begins while nothing presses begins to move it at once, and to and fro."""
    push = Table(times=[0.0, 1e-3, 1e-3, 2e-2], values=[0.0, 0.0, 50.0, 50.0])
    trajectory = bouncing(Mounting(m=3.0), {}, 1.5e-3, push)
    assert names(trajectory) == ["touch", "release", "slip forward"]
    assert trajectory.jumps[-1].t == pytest.approx(1e-3, rel=1e-12)
    assert trajectory.result.y[3] == pytest.approx(50.0 / 3.0 * 0.5e-3, rel=1e-9)


def test_what_turns_round_in_the_air_rubs_the_other_way_when_it_lands():
    """On a spring in the air the velocity swings: each contact takes energy, whichever way it slides then."""
    trajectory = bouncing(Mounting(m=3.0, k=1e8), {"v": 2.0}, 0.02)
    assert trajectory.status == "finished"
    flying = [jump for jump in trajectory.jumps if jump.edge.name == "stop" and jump.before.y[0] > 0]
    assert flying
    assert all(np.sign(jump.before.y[2]) == np.sign(jump.after.y[2]) for jump in flying)
    heat = trajectory.everywhere["T"][len(trajectory.result.times) :]
    assert np.all(np.diff(heat) > -1e-12)
    assert audit(trajectory).energy_error < 1e-9
    assert audit(trajectory).findings == ()


def closing(friction, rtol):
    """A rigid contact closes at 1/3 s under what is dragged along by a spring."""
    wall = Table(times=[0.0, 1.0, 3.0, 4.0], values=[5e-6, -10e-6, -10e-6, 5e-6])
    loading = {"w_n": wall, "w_t": Ramp(rate=1e-5)}
    mounts = {"normal": Mounting(k=1e10), "tangential": Mounting(k=1e10)}
    trajectory = solved(Interface("T", frictions=[friction]), loading, 5.0, rtol, **mounts)
    times = trajectory.result.times
    opening = np.maximum(-np.interp(times, wall.times, wall.values), 0.0)
    return trajectory, times, opening


@pytest.mark.parametrize("rtol", RTOLS)
@pytest.mark.parametrize("mu_s", [None, 0.8])
def test_what_slides_as_a_rigid_contact_closes_slides_on(mu_s, rtol):
    """Friction grows by less than the spring pulls more: what moves does not stop, whatever would hold it at rest."""
    trajectory, times, pressing = closing(Coulomb(mu=0.5, mu_s=mu_s), rtol)
    assert names(trajectory) == ["slip forward", "touch", "open"]
    np.testing.assert_allclose(trajectory.result.outputs[:, 0], 1e-5 * times - 0.5 * pressing, rtol=0, atol=1e-18)


@pytest.mark.parametrize("rtol", RTOLS)
def test_what_slides_as_a_rigid_contact_closes_stops_where_friction_grows_faster(rtol):
    trajectory, times, pressing = closing(Coulomb(mu=0.8), rtol)
    assert names(trajectory) == ["slip forward", "touch", "stop", "slip forward", "open"]
    found = [jump.t for jump in trajectory.jumps]
    np.testing.assert_allclose(found, [0.0, 1 / 3, 1 / 3, 1 / 3 + 0.8, 11 / 3], rtol=0, atol=1e-14)
    held = (times > 1 / 3) & (times < 1 / 3 + 0.8)
    u = np.where(held, 1e-5 / 3, 1e-5 * times - 0.8 * pressing)
    np.testing.assert_allclose(trajectory.result.outputs[:, 0], u, rtol=0, atol=1e-18)
