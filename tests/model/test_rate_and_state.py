"""Rate-and-state friction, with inertia and without: it sticks, creeps, slips, swings and turns round.

At a reversal the velocity passes within no time through all decades down to its zero, 1e-60 m/s and less.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from solved import solve

import surfacechem
from surfacechem.contracts.terms import Varying
from surfacechem.errors import InputError
from surfacechem.laws.factors import Linear, LinearInTemperature
from surfacechem.laws.friction import Coulomb, RateAndStateAging, RateAndStateSlip
from surfacechem.laws.loading import Harmonic, Hold, Ramp, Table
from surfacechem.runs.check import consistent_start, rates
from surfacechem.scene import Body, Interface, Mounting, Scene

COLD = Body("lower", Hold(level=300.0)), Body("upper", Hold(level=300.0))
P, K, M = 5e6, 2e9, 1e4
STEADIED = {"mu_0": 0.6, "a": 0.014, "b": 0.008, "L": 5e-5, "v_0": 1e-6}
WEAKENING = {"mu_0": 0.6, "a": 0.01, "b": 0.014, "L": 5e-5, "v_0": 1e-6}


def scene(law, mount, loading, parameters=STEADIED, initial=None, p=None, others=(), potentials=()):
    interface = Interface(Hold(level=300.0), potentials, [law(**parameters), *others])
    loading = {"p": p or Hold(level=P), **loading}
    return Scene(COLD, interface, (), loading, None, 300.0, {"theta": 1.0, **(initial or {})}, tangential=mount)


def solved(item, until, outputs=81):
    trajectory = solve(item, until, outputs=outputs)
    assert trajectory.status == "finished", trajectory.reason
    assert trajectory.findings == ()
    assert trajectory.energy_error < 1e-9
    return trajectory


def velocity(trajectory):
    return trajectory.column("v")[0]


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
    found = solve_ivp(rates, (times[0], times[-1]), start, "LSODA", times, rtol=1e-12, atol=[1e-18, 1e-12, 1e-12])
    assert found.success
    return found.y[0], np.exp(found.y[1]), found.y[2]


def test_pressure_that_vanishes_frees_what_creeps():
    """Pressed again it comes to rest, where the spring has swung to."""
    fall = {"times": [0.0, 1.0, 1.001, 1.002, 3.0], "values": [P, 0.0, 0.0, P, P]}
    item = scene(RateAndStateSlip, Mounting(k=K, m=1e4), {"w_t": Hold(level=1e-3)}, WEAKENING, p=Table(**fall))
    trajectory = solved(item, 3.0)
    assert np.max(np.abs(trajectory.everywhere("v"))) > 1e-3
    assert abs(velocity(trajectory)[-1]) < 1e-20


def test_friction_that_sticks_beside_it():
    """A limit of Coulomb's law holds the block, beyond it creep takes over what is left of the pull."""
    others = [Coulomb(mu=0.1)]
    load = {"w_t": Harmonic(amplitude=5e-3, frequency=0.05)}
    trajectory = solved(scene(RateAndStateAging, Mounting(k=K, m=M), load, others=others), 40.0)
    # As creep ends the velocity passes zero within its tolerance, the pull still above the limit, and may do so twice.
    jumps = trajectory.jumps
    apart = [jump for jump, last in zip(jumps[1:], jumps, strict=False) if jump.t - last.t > 1e-13]
    assert [jump.edge.name for jump in (jumps[0], *apart)][:4] == ["slip forward", "stop", "slip backward", "stop"]
    without = solved(scene(RateAndStateAging, Mounting(k=K), load, others=others), 40.0)
    np.testing.assert_allclose(trajectory["u_t"], without["u_t"], rtol=0, atol=1e-7)


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


def test_parameters_that_vary_with_temperature():
    """The rate of temperature has no part in that of the velocity."""
    warm = Body("lower", Hold(level=300.0)), Body("upper", Ramp(start=300.0, rate=1.0))
    vary = Varying(0.014, (LinearInTemperature(of="T_2", slope=1e-3),))
    load = {"w_t": Harmonic(amplitude=5e-3, frequency=0.05), "p": Hold(level=P)}
    found = []
    for m in (0.0, 1.0):
        interface = Interface(Hold(level=300.0), (), [RateAndStateAging(**{**STEADIED, "a": vary})])
        item = Scene(warm, interface, (), load, None, 300.0, {"theta": 1.0}, tangential=Mounting(k=K, m=m))
        found.append(solved(item, 40.0)["u_t"])
    np.testing.assert_allclose(found[1], found[0], rtol=0, atol=1e-10)


def test_the_age_at_the_start_is_changed_in_seconds():
    """What is solved for is its logarithm, which is nothing that a case gives."""
    simulation = surfacechem.load("rate-and-state-velocity-steps", ["run.outputs=201"])
    assert "initial.theta" in simulation.system.changeable
    data = simulation.sweep({"initial.theta": ["5 s", 10.0]}).dataset
    np.testing.assert_allclose(data["theta"].values[:, 0], [5.0, 10.0], rtol=1e-14)
    np.testing.assert_array_equal(data["initial_theta"].values, [5.0, 10.0])
    assert data["initial_theta"].attrs["units"] == "s"
    assert data["theta"].values[1].tobytes() == simulation.run().dataset["theta"].values.tobytes()
    assert data.attrs["error"] < 1e-8
    for value, message in ((0.0, "outside its range: > 0"), ("1 m", "needs a time")):
        with pytest.raises(InputError, match=message):
            simulation.run({"initial.theta": value})
    with pytest.raises(InputError, match=r"no parameter 'initial\.ln_theta'"):
        simulation.run({"initial.ln_theta": 1.0})


@pytest.mark.parametrize("ratio", [0.9, 1.1])
def test_growth_rates_are_those_of_linear_stability(ratio):
    """About steady sliding B x'' + (k - k_c) x' + k V x / L = 0, B = a p / V + c_b, k_c = [(b - a) p - c_b V] / L."""
    p, V, c_b, L = 5e6, 1e-6, 5e6, 1e-5
    critical = (0.005 * p - c_b * V) / L
    k = ratio * critical
    ramp = {"ramp": {"start": 0.6 * p / k, "rate": V}}
    changes = {"mechanics.tangential.k": k, "initial.theta": L / V, "loading.w_t": ramp}
    simulation = surfacechem.load("rate-and-state-stick-slip", changes)
    start = consistent_start(simulation.model, simulation.model.values())
    expected = np.roots([0.01 * p / V + c_b, k - critical, k * V / L])
    np.testing.assert_allclose(sorted(rates(start), key=np.imag), sorted(expected, key=np.imag), rtol=1e-8)
    assert np.all((rates(start).real > 1e-12) == (ratio < 1))


def test_sticking_needs_no_pressure():
    """What nothing presses yet rests until its load begins, though it could not slide in balance."""
    load, others = {"w_t": Table(times=[0.0, 2.0, 4.0], values=[0.0, 0.0, 1e-6])}, [Coulomb(mu=0.2, mu_s=0.8)]
    given = scene(RateAndStateAging, Mounting(k=1e10), load, WEAKENING, p=Hold(level=0.0), others=others)
    trajectory = solve(given, [0.0, 1.0, 3.0])
    assert trajectory.status == "stopped", trajectory.reason
    assert trajectory.reason.startswith("no steady sliding velocity: nothing resists it")
    assert trajectory.result.t == pytest.approx(2.0, rel=1e-9)


def test_an_extreme_direct_effect_does_not_overflow():
    law = RateAndStateAging(mu_0=0.6, a=1e-4, b=1.5e-4, L=1e-5, v_0=1e-6)
    assert law.traction(p=1e6, v=1e-6, ln_theta=np.log(10.0)) == pytest.approx(6e5, rel=1e-12)
    assert law.traction(p=1e6, v=-1e-6, ln_theta=np.log(10.0)) == pytest.approx(-6e5, rel=1e-12)
    assert law.traction(p=1e6, v=0.0, ln_theta=np.log(10.0)) == 0.0


@pytest.mark.parametrize("length", [1e-9, 1e-6, 1e3, 1e9])
def test_creep_from_rest_is_the_same_in_any_unit_of_length(length):
    """The velocity itself is the unknown where a parameter varies with it; it begins 24 decades below its guess."""

    def creep(unit):
        direct = Varying(0.012, (Linear(of="v", slope=100.0 / unit),))
        numbers = {"mu_0": 0.6, "a": direct, "b": 0.008, "L": 1e-5 * unit, "v_0": 1e-6 * unit}
        mount, drive = Mounting(k=2e10 / unit, c_b=1e8 / unit), {"w_t": Ramp(rate=1e-6 * unit)}
        made = scene(RateAndStateAging, mount, drive, numbers, {"v": 1e-6 * unit}, Hold(level=1e6))
        run = solved(made, 60.0, 21)
        return run["v"] / unit, run.result.counters.steps

    (found, steps), (metres, least) = creep(length), creep(1.0)
    assert metres[0] == pytest.approx(2e-6 * np.exp(-0.6 / 0.012) * np.sinh(100 / 0.012e6), rel=1e-9)
    np.testing.assert_allclose(found, metres, rtol=1e-9)
    assert steps < 1.2 * least
