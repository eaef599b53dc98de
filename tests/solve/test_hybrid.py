"""Events of moving gaps: at the start, at breakpoints, coincident, brief, without end; energies and verdicts."""

from dataclasses import replace

import numpy as np
import pytest
from scenes import bodies, perfect_contact, together, varying
from solved import Solved, closed, solve

from surfacechem.format import load_text
from surfacechem.laws.cohesive import TensileStrength
from surfacechem.laws.factors import LinearInTemperature
from surfacechem.laws.free_energy import BondEnergy, Constant, Penalty
from surfacechem.laws.friction import Coulomb
from surfacechem.laws.loading import Hold, Ramp, Table
from surfacechem.runs.simulation import Simulation, load
from surfacechem.scene import Body, Interface, Mounting, Scene

COLD = Body("lower", Hold(level=300.0)), Body("upper", Hold(level=300.0))


def slider(friction, mounting, drive, p=1e5, potentials=(), programme=(), **initial) -> Scene:
    """Reservoirs about a contact that sticks and slides."""
    loading = ({} if drive is None else {"w_t": drive}) | {"p": Hold(level=p)}
    interface = Interface(Hold(level=300.0), potentials, [friction])
    return Scene(COLD, interface, (), loading, None, 300.0, initial, programme=programme, tangential=mounting)


def test_outputs_close_to_a_fold_are_among_the_known_states():
    simulation = load("cohesive-pull-off")
    (fold, *_) = (jump.t for jump in simulation.run().trajectory.jumps)
    times = (0.0, *(fold * (1 - np.geomspace(1e-2, 1e-15, 60))).tolist(), simulation.case.run.times[-1])
    result = simulation.run(run=replace(simulation.case.run, times=times, solver="lsoda")).trajectory.result
    assert np.isin(result.times, result.known.t).all()


# -- when and how often -----------------------------------------------------------------------------------------------


def test_a_limit_that_is_exceeded_from_the_start():
    """A spring stretched beyond the limit starts to slide at once, in its own direction."""
    solved = solve(slider(Coulomb(mu=0.4, mu_s=0.6), Mounting(k=1e8, m=10.0), Hold(level=0.0), u_t=1e-3), 1e-2)
    assert solved.jumps[0].t == 0.0
    assert solved.events[:2] == ["slip backward", "stop"]
    assert solved["v"][-1] == 0.0


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


def test_a_mass_bounces_hundreds_of_times():
    """Nothing takes energy from a mass that falls on a spring: it comes back to where it was let go."""
    fall = {"loading": {"F_n": Hold(level=-10.0)}, "initial": {"g_n": 1e-3}, "normal": Mounting(m=1.0)}
    trajectory = closed(together([Penalty(E_n=1e8)], **fall, **LIGHT), 4.0, max_steps=10**6)
    assert len(trajectory.jumps) > 200
    energy = {float(0.5 * jump.before.y[1] ** 2) for jump in trajectory.jumps}
    np.testing.assert_allclose(sorted(energy), 10.0 * 1e-3, rtol=1e-8)


def swung(friction, V, end, rtol):
    loading = {"p": Hold(level=1e3), "w_t": Ramp(rate=V)}
    scene = together([], [friction], loading, tangential=Mounting(k=1e5, m=1.0), **LIGHT)
    return closed(scene, end, exact=max(rtol, 1e-11), rtol=rtol, max_steps=10**6)


def test_a_mass_sticks_and_slips_hundreds_of_times():
    """Period and slip of each cycle are the same to rounding, and all work is heat."""
    V, omega, drop = 5e-3, np.sqrt(1e5), (0.4 - 0.2) * 1e3 / 1e5
    trajectory = swung(Coulomb(mu=0.2, mu_s=0.4), V, 100.0, 1e-11)
    assert len(trajectory.jumps) > 200
    period = 2 * drop / V + 2 * (np.pi - np.arctan(omega * drop / V)) / omega
    np.testing.assert_allclose(np.diff([jump.t for jump in trajectory.of("slip forward")]), period, rtol=1e-9)
    assert all(abs(jump.before.y[1]) < 1e-11 * V for jump in trajectory.jumps)


def test_sliding_that_only_just_stops_does_so_at_rest():
    """Static and kinetic friction alike and no damper: the velocity touches zero once in each of 200 periods."""
    V, omega = 1e-3, np.sqrt(1e5)
    trajectory = swung(Coulomb(mu=0.3), V, 3.0 + 200 * 2 * np.pi / omega, 1e-13)
    assert all(abs(jump.before.y[1]) < 1e-9 * V for jump in trajectory.jumps)
    assert all(jump.released < 1e-18 for jump in trajectory.jumps)


# -- output times have no part in a run: steps, events and states are the same to the last bit whatever is asked for --

COHESIVE = """
title: A mass that bounces against a cohesive zone
T_0: 300 K
bodies:
  a: {temperature: T, capacity: constant, C: 2 J/m^2/K, stiffness: 2e12 Pa/m}
  b: {temperature: T, capacity: constant, C: 1 J/m^2/K, stiffness: 6e12 Pa/m}
interface:
  temperature: T
  potential:
    - exponential-cohesive-zone:
        t_max: {value: 2 MPa, times: [power: {exponent: -1}]}
        g_0: 300 nm
        E_n: 3e13 Pa/m
mechanics:
  normal: {m: 0.2 kg/m^2, c_b: 2e4 Pa s/m, c_g: 1e4 Pa s/m, beta_1: 0.3}
loading: {w_n: {harmonic: {mean: 0.2 um, amplitude: 1 um, frequency: 60 kHz}}}
initial: {T: 280 K, g_n: 100 nm, v_n: 5 mm/s}
run: {until: 400 us}
"""


def test_outputs_change_nothing():
    simulation = Simulation(load_text(COHESIVE))
    run, found = simulation.case.run, []
    for n in (2, 777):
        trajectory = Solved(simulation.model.solve(replace(run, times=np.linspace(0.0, run.times[-1], n).tolist())))
        assert trajectory.status == "finished"
        result, jumps = trajectory.result, trajectory.jumps
        events = np.array([[jump.t, jump.released, *jump.after.y] for jump in jumps])
        blocks = (events, result.steps.t, result.steps.y, result.steps.ydot, result.y, result.ledger)
        found.append((len(jumps), result.counters.steps, result.counters.rejected, *(b.tobytes() for b in blocks)))
    assert len(set(found)) == 1
    assert found[0][0] > 10
