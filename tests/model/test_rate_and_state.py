"""Sliding with inertia against rate-and-state friction: it sticks, creeps, slips and swings."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import surfacechem
from surfacechem.errors import InputError
from surfacechem.laws.friction import Coulomb, RateAndStateAging, RateAndStateSlip
from surfacechem.laws.loading import Harmonic, Hold, Ramp, Table
from surfacechem.model.assemble import assemble
from surfacechem.results.audit import audit
from surfacechem.scene import Body, Interface, Mounting, Scene
from surfacechem.solve.run import Model, Run

COLD = Body("lower", Hold(level=300.0)), Body("upper", Hold(level=300.0))
P, K, M = 5e6, 2e9, 1e4
STEADIED = {"mu_0": 0.6, "a": 0.014, "b": 0.008, "L": 5e-5, "v_0": 1e-6}
WEAKENING = {"mu_0": 0.6, "a": 0.01, "b": 0.014, "L": 5e-5, "v_0": 1e-6}
LAWS = [RateAndStateAging, RateAndStateSlip]


def scene(law, mount, loading, parameters=STEADIED, initial=None, p=None, others=()):
    interface = Interface(Hold(level=300.0), (), [law(**parameters), *others])
    loading = {"p": p or Hold(level=P), **loading}
    return Scene(COLD, interface, (), loading, None, 300.0, {"theta": 1.0, **(initial or {})}, tangential=mount)


def solved(item, until, rtol=1e-11, outputs=81):
    trajectory = Model(assemble(item)).solve(Run(np.linspace(0.0, until, outputs).tolist(), rtol))
    assert trajectory.status == "finished", trajectory.reason
    assert audit(trajectory).findings == ()
    assert audit(trajectory).energy_error < 1e-9
    return trajectory


def state(trajectory, name):
    return trajectory.result.outputs[:, [s.name for s in trajectory.model.system.states].index(name)]


def velocity(trajectory):
    return trajectory.everywhere["v"][: len(trajectory.result.times)]


def happened(trajectory):
    return [jump.edge.name for jump in trajectory.jumps]


def plain(law, pull, m, times, y, p=lambda t: P, mu_0=0.6, a=0.01, b=0.014, L=5e-5, v_0=1e-6, turn=0.0):
    """Displacement, velocity and logarithm of the age, by SciPy, in the equations as they stand in the books.

    What has no more than the velocity ``turn`` comes back at once, as fast as it was.
    """

    def rates(t, y):
        u, v, ln_theta = y
        friction = a * p(t) * np.arcsinh(v / (2 * v_0) * np.exp((mu_0 + b * (np.log(v_0 / L) + ln_theta)) / a))
        x = abs(v) / L * np.exp(ln_theta)
        ages = 1 - x if law is RateAndStateAging else -x * np.log(x) if x else 0.0
        return [v, (pull(t, u) - friction) / m, np.exp(-ln_theta) * ages]

    def turns(t, y):
        return abs(y[1]) - turn

    turns.terminal, turns.direction = True, -1
    t, arcs = times[0], []
    while t < times[-1]:
        ahead = times[times >= t]
        arc = solve_ivp(rates, (t, times[-1]), y, "Radau", ahead, events=turns, rtol=1e-10, atol=[1e-17, 1e-24, 1e-11])
        assert arc.success
        arcs.append(arc.y)
        if arc.status == 1:
            t, y = arc.t_events[0][0], arc.y_events[0][0] * [1, -1, 1]
        else:
            t = times[-1]
    return np.hstack(arcs)


def forward(law, pull, m, times, y, mu_0=0.6, a=0.01, b=0.014, L=5e-5, v_0=1e-6):
    """The same for sliding that never reverses, by the logarithm of its velocity."""

    def rates(t, y):
        u, ln_v, ln_theta = y
        drive = ln_v - np.log(2 * v_0) + (mu_0 + b * (np.log(v_0 / L) + ln_theta)) / a
        friction = a * P * (drive + np.log1p(np.sqrt(1 + np.exp(-2 * drive))))
        v = np.exp(ln_v)
        ln_x = ln_v - np.log(L) + ln_theta
        ages = 1 - np.exp(ln_x) if law is RateAndStateAging else -np.exp(ln_x) * ln_x
        return [v, (pull(t, u) - friction) / (m * v), np.exp(-ln_theta) * ages]

    start = [y[0], np.log(y[1]), y[2]]
    found = solve_ivp(rates, (times[0], times[-1]), start, "Radau", times, rtol=1e-10, atol=[1e-17, 1e-11, 1e-11])
    assert found.success
    return found.y[0], np.exp(found.y[1]), found.y[2]


@pytest.mark.parametrize(
    ("law", "V", "reference"),
    [(law, V, reference) for law, slow, fast in zip(LAWS, (1e-9, 1e-8), (1e-3, 1e-6), strict=True)
     for V, reference in ((slow, forward), (fast, plain))],
)  # fmt: skip
def test_stick_slip_is_that_of_the_plain_equations(law, V, reference):
    """Below the critical stiffness (b - a) p / L the block sticks and slips, whatever the velocity of the drive."""
    k = 0.5 * 0.004 * P / 5e-5
    start, theta = 0.6 * P / k, 0.8 * 5e-5 / V
    loading = {"w_t": Ramp(start=start, rate=V)}
    trajectory = solved(scene(law, Mounting(k=k, m=M), loading, WEAKENING, {"theta": theta, "v": V}), 4e-3 / V)
    times = trajectory.result.times
    u, v, ln_theta = reference(law, lambda t, u: k * (start + V * t - u), M, times, [0.0, V, np.log(theta)])
    found = trajectory.everywhere["v"]
    assert found.max() > 20 * V
    assert found.min() < 0.1 * V
    np.testing.assert_allclose(state(trajectory, "u_t"), u, rtol=0, atol=1e-8 * np.max(u))
    np.testing.assert_allclose(state(trajectory, "ln_theta"), ln_theta, rtol=0, atol=1e-7)
    np.testing.assert_allclose(velocity(trajectory), v, rtol=1e-7)
    assert trajectory.result.counters.steps < 1000


@pytest.mark.parametrize("law", LAWS)
def test_a_block_swings_through_its_turning_points(law):
    """Friction is a tenth of the pull of the spring: at a turn the velocity passes all decades in no time."""
    item = scene(law, Mounting(k=K, m=1e6), {"w_t": Hold(level=0.0)}, WEAKENING, {"v": 1.0})
    trajectory = solved(item, 0.3, outputs=31)
    assert np.sum(np.diff(np.sign(velocity(trajectory))) != 0) >= 3
    u, v, _ = plain(law, lambda t, u: -K * u, 1e6, trajectory.result.times, [0.0, 1.0, 0.0], turn=1e-10)
    np.testing.assert_allclose(state(trajectory, "u_t"), u, rtol=0, atol=1e-8 * np.max(u))
    np.testing.assert_allclose(velocity(trajectory), v, rtol=0, atol=1e-8)
    assert happened(trajectory) == []


@pytest.mark.parametrize("law", LAWS)
def test_pressure_that_vanishes_frees_what_creeps(law):
    """Pressed again it comes to rest, where the spring has swung to."""
    fall = {"times": [0.0, 1.0, 1.001, 1.002, 3.0], "values": [P, 0.0, 0.0, P, P]}
    item = scene(law, Mounting(k=K, m=1e4), {"w_t": Hold(level=1e-3)}, WEAKENING, p=Table(**fall))
    trajectory = solved(item, 3.0)
    assert np.max(np.abs(trajectory.everywhere["v"])) > 1e-3
    assert abs(velocity(trajectory)[-1]) < 1e-20


def test_friction_that_sticks_beside_it():
    """A limit of Coulomb's law holds the block, beyond it creep takes over what is left of the pull."""
    others = [Coulomb(mu=0.1)]
    load = {"w_t": Harmonic(amplitude=5e-3, frequency=0.05)}
    trajectory = solved(scene(RateAndStateAging, Mounting(k=K, m=M), load, others=others), 40.0)
    assert happened(trajectory)[:4] == ["slip forward", "stop", "slip backward", "stop"]
    without = solved(scene(RateAndStateAging, Mounting(k=K), load, others=others), 40.0)
    np.testing.assert_allclose(state(trajectory, "u_t"), state(without, "u_t"), rtol=0, atol=1e-7)


def test_the_velocity_at_the_start_is_given_as_such():
    """What is solved for is no part of a case; a velocity given is met to its last digits, creeping or sliding."""
    changes = {"mechanics.tangential.c_b": 0.0, "mechanics.tangential.m": "1e4 kg/m^2", "run.until": "1 s"}
    simulation = surfacechem.load("rate-and-state-stick-slip", changes)
    assert "initial.v" in simulation.system.changeable
    given = [1e-30, -1e-12, 0.0, 1e-9, 1e-6, -1e-2]
    data = simulation.sweep({"initial.v": given}).dataset
    np.testing.assert_allclose(data["v"].values[:, 0], given, rtol=1e-13)
    with pytest.raises(InputError, match=r"no parameter 'initial\.drive'"):
        simulation.run({"initial.drive": 1.0})
