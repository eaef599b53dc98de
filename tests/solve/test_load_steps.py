"""Far-field tractions that jump: what has no inertia or damper moves at once, and what is not stored is heat."""

import numpy as np
import pytest
from scenes import bodies

from surfacechem.laws.contact import NormalStiffness, Penalty, TangentialStiffness
from surfacechem.laws.friction import Coulomb, RateAndStateAging
from surfacechem.laws.loading import Hold, Table
from surfacechem.model.assemble import assemble
from surfacechem.results.audit import audit
from surfacechem.scene import Interface, Mounting, Scene
from surfacechem.solve.run import Model, Run

K, E, MU = 1e9, 1e10, 0.5
LEVELS = [0.0, 1e3, 1.5e3, -2e3]
STEPS = Table(
    times=[0.0, 10.0, 10.0, 20.0, 20.0, 30.0, 30.0, 40.0], values=[level for level in LEVELS for _ in range(2)]
)
BODIES = bodies("T", "T", C_1=1.0, C_2=1.0)


def solved(interface, loading, mounts, initial=None, rtol=1e-11):
    scene = Scene(BODIES, interface, (), loading, None, 300.0, {"T": 300.0, **(initial or {})}, **mounts)
    return Model(assemble(scene)).solve(Run(np.linspace(0.0, 40.0, 9).tolist(), rtol))


def held(trajectory, name):
    """A quantity in the middle of each level of the load."""
    return trajectory.everywhere[name][1 : len(trajectory.result.times) : 2]


def released(trajectory, name):
    return [jump.released for jump in trajectory.jumps if jump.edge.name == name]


def test_an_elastic_gap_moves_at_once():
    loading = {"w_n": Hold(level=0.0), "F_n": STEPS}
    trajectory = solved(Interface("T", [NormalStiffness(E_n=E)]), loading, {"normal": Mounting(k=K)})
    np.testing.assert_allclose(held(trajectory, "g_n"), np.array(LEVELS) / (K + E), rtol=1e-14)
    np.testing.assert_allclose(released(trajectory, "load"), np.diff(LEVELS) ** 2 / (2 * (K + E)), rtol=1e-11)
    assert audit(trajectory).findings == ()
    assert audit(trajectory).energy_error < 1e-9


def test_elastic_sticking_moves_with_the_body():
    loading = {"p": Hold(level=1e6), "w_t": Hold(level=0.0), "F_t": STEPS}
    interface = Interface("T", [TangentialStiffness(E_t=E)], [Coulomb(mu=MU)])
    trajectory = solved(interface, loading, {"tangential": Mounting(k=K)})
    for name in ("u_t", "g_t"):
        np.testing.assert_allclose(held(trajectory, name), np.array(LEVELS) / (K + E), rtol=1e-14)
    assert audit(trajectory).energy_error < 1e-9


@pytest.mark.parametrize("rtol", [1e-6, 1e-11])
def test_what_slides_goes_on_or_sticks_and_turns_back(rtol):
    p = 1e3
    loading = {"p": Hold(level=p), "w_t": Hold(level=0.0), "F_t": STEPS}
    trajectory = solved(Interface("T", frictions=[Coulomb(mu=MU)]), loading, {"tangential": Mounting(k=K)}, rtol=rtol)
    u = np.array([0.0, 1e3 - MU * p, 1.5e3 - MU * p, -2e3 + MU * p]) / K
    np.testing.assert_allclose(held(trajectory, "u_t"), u, rtol=1e-13)
    assert [jump.edge.name for jump in trajectory.jumps] == ["slip forward", "load", "load", "slip backward"]
    moved = np.abs(np.diff(u))
    heat = MU * p * moved + 0.5 * K * moved**2
    np.testing.assert_allclose([jump.released for jump in trajectory.jumps], [*heat[:2], 0.0, heat[2]], rtol=1e-9)
    assert audit(trajectory).energy_error < 1e-9


def test_what_creeps_is_carried_along():
    loading = {"p": Hold(level=1e6), "w_t": Hold(level=0.0), "F_t": STEPS}
    friction = RateAndStateAging(mu_0=0.6, a=0.008, b=0.014, L=5e-6, v_0=1e-6)
    interface = Interface("T", [TangentialStiffness(E_t=E)], [friction])
    trajectory = solved(interface, loading, {"tangential": Mounting(k=K)}, {"theta": 1.0})
    np.testing.assert_allclose(held(trajectory, "u_t"), np.array(LEVELS) / (K + E), rtol=1e-12)
    strength = (0.6 + 0.014 * np.log(1e-6 / 5e-6 * held(trajectory, "theta"))) / 0.008
    drive = held(trajectory, "t_t") / (0.008 * 1e6)
    np.testing.assert_allclose(held(trajectory, "v"), 2e-6 * np.sinh(drive) * np.exp(-strength), rtol=1e-11)
    assert audit(trajectory).findings == ()
    assert audit(trajectory).energy_error < 1e-9


@pytest.mark.parametrize("begin", [0.0, 14.584101652239939, 36.0])
def test_a_late_pulse_is_as_sharp_as_an_early_one(begin):
    """One digit of the time is up to a millionth of the pulse; in a time of its own nothing is lost in it."""
    times = begin + np.array([0.0, 1e-9, 2e-9])
    pulse = Table(times=times.tolist(), values=[0.0, -1e9, 0.0])
    trajectory = solved(
        Interface("T", [Penalty(E_n=1e15)]), {"w_n": Hold(level=0.0), "F_n": pulse}, {"normal": Mounting(k=1e9)}
    )
    books = audit(trajectory)
    assert books.energy_scale == pytest.approx(0.5 * 1e18 / 1e15, rel=1e-5)
    assert books.energy_error < 1e-11
