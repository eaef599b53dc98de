"""A thousand events and more lose nothing: every jump is exact to rounding, and none is told that does not happen."""

import numpy as np
import pytest
from scenes import bodies

from surfacechem.laws.contact import Penalty
from surfacechem.laws.friction import Coulomb
from surfacechem.laws.loading import Hold, Ramp
from surfacechem.model.assemble import assemble
from surfacechem.results.audit import audit
from surfacechem.scene import Interface, Mounting, Scene
from surfacechem.solve.run import Model, Run

BODIES = bodies("T", "T", C_1=1.0, C_2=1.0)


def solved(interface, loading, mounts, end, rtol, initial=None):
    scene = Scene(BODIES, interface, (), loading, None, 300.0, {"T": 300.0, **(initial or {})}, **mounts)
    return Model(assemble(scene)).solve(Run(np.linspace(0.0, end, 11).tolist(), rtol, max_steps=10**6))


@pytest.mark.parametrize(("rtol", "lost"), [(1e-11, 1e-9), (1e-13, 1e-11)])
def test_a_mass_bounces_a_thousand_times(rtol, lost):
    """Nothing takes energy from a mass that falls on a spring: it comes back to where it was let go."""
    height = 1e-3
    trajectory = solved(
        Interface("T", [Penalty(E_n=1e8)]),
        {"F_n": Hold(level=-10.0)},
        {"normal": Mounting(k=0.0, m=1.0)},
        20.0,
        rtol,
        {"g_n": height},
    )
    assert len(trajectory.jumps) > 1000
    assert audit(trajectory).energy_error < lost
    energy = {float(0.5 * jump.before.y[1] ** 2) for jump in trajectory.jumps}
    np.testing.assert_allclose(sorted(energy), 10.0 * height, rtol=10 * lost)


def slider(friction, V, end, rtol):
    loading = {"p": Hold(level=1e3), "w_t": Ramp(rate=V)}
    return solved(Interface("T", frictions=[friction]), loading, {"tangential": Mounting(k=1e5, m=1.0)}, end, rtol)


def test_a_mass_sticks_and_slips_a_thousand_times():
    """Period and slip of each cycle are the same to rounding, and all work is heat."""
    V, omega, drop = 5e-3, np.sqrt(1e5), (0.4 - 0.2) * 1e3 / 1e5
    trajectory = slider(Coulomb(mu=0.2, mu_s=0.4), V, 500.0, 1e-11)
    begun = [jump for jump in trajectory.jumps if jump.edge.name == "slip forward"]
    assert len(trajectory.jumps) > 1000
    period = 2 * drop / V + 2 * (np.pi - np.arctan(omega * drop / V)) / omega
    np.testing.assert_allclose(np.diff([jump.t for jump in begun]), period, rtol=1e-9)
    assert audit(trajectory).energy_error < 1e-12
    assert all(abs(jump.before.y[1]) < 1e-11 * V for jump in trajectory.jumps)


@pytest.mark.parametrize("rtol", [1e-9, 1e-11, 1e-13])
def test_sliding_that_only_just_stops_does_so_at_rest(rtol):
    """Static and kinetic friction alike and no damper: the velocity touches zero once in each of 1000 periods."""
    V, omega = 1e-3, np.sqrt(1e5)
    trajectory = slider(Coulomb(mu=0.3), V, 3.0 + 1000 * 2 * np.pi / omega, rtol)
    assert all(abs(jump.before.y[1]) < 1e-9 * V for jump in trajectory.jumps)
    assert all(jump.released < 1e-18 for jump in trajectory.jumps)
    assert audit(trajectory).energy_error < max(rtol, 1e-11)
