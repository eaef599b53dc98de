"""Events of moving gaps: of what is warmed, coincident, brief, and hundreds of them; energies and verdicts."""

import numpy as np
import pytest
from scenes import bodies, perfect_contact, together, varying
from solved import closed

from surfacechem.laws.cohesive import TensileStrength
from surfacechem.laws.factors import LinearInTemperature
from surfacechem.laws.free_energy import BondEnergy, Constant
from surfacechem.laws.friction import Coulomb
from surfacechem.laws.loading import Hold, Ramp, Table
from surfacechem.scene import Mounting

# -- when and how often -----------------------------------------------------------------------------------------------


def test_friction_that_fades_with_temperature():
    """mu p = 3e4 Pa where T - T_0 = 50 K; two bodies of 1 J/(m^2 K) are warmed by 100 W/m^2."""
    mu = varying(0.6, LinearInTemperature(slope=-1e-2))
    loading = {"p": Hold(level=1e5), "w_t": Hold(level=3e-4), "Q_1": Hold(level=100.0)}
    mount = Mounting(k=1e8, c_b=1e4)
    scene = perfect_contact([], frictions=[Coulomb(mu=mu)], energy=Constant, loading=loading, tangential=mount)
    solved = closed(scene, 1.9)
    assert solved.events[0] == "slip forward"
    assert solved.jumps[0].t == pytest.approx(1.0, rel=1e-9)


# -- against closed forms worked out by hand --------------------------------------------------------------------------


def test_two_strengths_reached_at_once_break_the_interface_once():
    given = {"limits": [TensileStrength(t_max=1e6), TensileStrength(t_max=1e6)], "initial": {"phi": 1.0}}
    scene = together([BondEnergy(K_0=0.01)], loading={"w_n": Ramp(rate=1e-6)}, normal=Mounting(k=1e12), **given)
    (debond,) = closed(scene, 2.0).of("debond")
    assert (debond.t, debond.released) == pytest.approx((1.0, 0.5 - 0.005), rel=1e-12)


def test_a_brief_pulse_makes_a_slider_slip_and_stop():
    """A billionth of the run, to twice the limit, then back until the spring holds the limit the other way."""
    reach = 0.5 * 1e5 / 1e10
    pulse = Table(times=[0.0, 0.5, 0.5 + 5e-10, 0.5 + 1e-9, 1.0], values=[0.0, 0.0, 2 * reach, 0.0, 0.0])
    scene = together([], [Coulomb(mu=0.5)], {"p": Hold(level=1e5), "w_t": pulse}, tangential=Mounting(k=1e10))
    trajectory = closed(scene, 1.0, exact=1e-6)  # the pulse lasts ten million last digits of its time
    assert trajectory.events == ["slip forward", "stop"]
    assert [jump.t for jump in trajectory.jumps] == pytest.approx([0.5 + 2.5e-10, 0.5 + 5e-10], abs=3e-16)


# -- hundreds of events lose nothing: every jump is exact to rounding, and none is told that does not happen --

LIGHT = {"pair": bodies("T", "T", C_1=1.0, C_2=1.0)}


def swung(friction, V, end, rtol):
    loading = {"p": Hold(level=1e3), "w_t": Ramp(rate=V)}
    scene = together([], [friction], loading, tangential=Mounting(k=1e5, m=1.0), **LIGHT)
    return closed(scene, end, exact=max(rtol, 1e-11), rtol=rtol, max_steps=10**6)


def test_sliding_that_only_just_stops_does_so_at_rest():
    """Static and kinetic friction alike and no damper: the velocity touches zero once in each of 200 periods."""
    V, omega = 1e-3, np.sqrt(1e5)
    trajectory = swung(Coulomb(mu=0.3), V, 3.0 + 200 * 2 * np.pi / omega, 1e-13)
    assert all(abs(jump.before.y[1]) < 1e-9 * V for jump in trajectory.jumps)
    assert all(jump.released < 1e-18 for jump in trajectory.jumps)
