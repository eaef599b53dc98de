"""Sliding that reverses against rate-and-state friction, under loads that swing and loads that step.

At a reversal the velocity passes within no time through all decades down to its zero, 1e-60 m/s and less.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from surfacechem.laws.contact import TangentialStiffness
from surfacechem.laws.friction import RateAndStateAging, RateAndStateSlip
from surfacechem.laws.loading import Harmonic, Hold
from surfacechem.model.assemble import assemble
from surfacechem.results.audit import audit
from surfacechem.scene import Body, Interface, Mounting, Scene
from surfacechem.solve.run import Model, Run

COLD = Body("lower", Hold(level=300.0)), Body("upper", Hold(level=300.0))
P, K, AMPLITUDE, FREQUENCY = 5e6, 2e9, 5e-3, 0.05
STEADIED = {"mu_0": 0.6, "a": 0.014, "b": 0.008, "L": 5e-5, "v_0": 1e-6}
"""Friction that grows with velocity in the long run, so that sliding is steady at any stiffness."""
WEAKENING = {"mu_0": 0.6, "a": 0.008, "b": 0.014, "L": 5e-5, "v_0": 1e-6}
LAWS = [RateAndStateAging, RateAndStateSlip]


def solved(law, mount, loading, until, rtol=1e-11, elastic=0.0, parameters=STEADIED, outputs=81):
    potentials = [TangentialStiffness(E_t=elastic)] if elastic else []
    interface = Interface(Hold(level=300.0), potentials, [law(**parameters)])
    loading = {"p": Hold(level=P), **loading}
    scene = Scene(COLD, interface, (), loading, None, 300.0, {"theta": 1.0}, tangential=mount)
    return Model(assemble(scene)).solve(Run(np.linspace(0.0, until, outputs).tolist(), rtol))


@np.errstate(over="ignore", invalid="ignore")
def sliding(law, pull, resistance, times, breaks=(), mu_0=0.6, a=0.014, b=0.008, L=5e-5, v_0=1e-6):
    """Displacement, logarithm of the age and velocity where pull(t, u) = a p s + resistance v, by SciPy."""

    def velocity(t, u, ln_theta):
        strength = (mu_0 + b * (np.log(v_0 / L) + ln_theta)) / a

        def of(s):
            return np.sign(s) * v_0 * -np.expm1(-2 * abs(s)) * np.exp(abs(s) - strength)

        s = pull(t, u) / (a * P)
        if resistance and s:
            s = brentq(lambda x: a * P * (x - s) + resistance * of(x), 0.0, s, xtol=1e-15 * abs(s), rtol=1e-15)
        return of(s)

    def rates(t, y):
        v = velocity(t, *y)
        x = abs(v) / L * np.exp(y[1])
        return [v, np.exp(-y[1]) * (1 - x if law is RateAndStateAging else -x * np.log(x) if x else 0.0)]

    y, found = [0.0, 0.0], np.empty((2, len(times)))
    ends = [*breaks, times[-1]]
    for start, end in zip([0.0, *breaks], ends, strict=True):
        within = (times >= start) & (times <= end)
        inside = np.nextafter([start, end], [end, start])
        one = solve_ivp(rates, inside, y, "Radau", np.clip(times[within], *inside), rtol=1e-11, atol=[1e-16, 1e-11])
        y = solve_ivp(rates, inside, y, "Radau", rtol=1e-11, atol=[1e-16, 1e-11]).y[:, -1] if end < ends[-1] else y
        found[:, within] = one.y
    return found, np.array([velocity(t, *y) for t, y in zip(times, found.T, strict=True)])


def reversals(trajectory):
    v = trajectory.everywhere["v"][len(trajectory.result.times) :]
    return int(np.sum(np.diff(np.sign(v[v != 0])) != 0))


@pytest.mark.parametrize(("law", "mount"), [(LAWS[0], Mounting(k=K, c_g=1e9)), (LAWS[1], Mounting(k=K))])
def test_sliding_follows_a_load_that_swings(law, mount):
    trajectory = solved(law, mount, {"w_t": Harmonic(amplitude=AMPLITUDE, frequency=FREQUENCY)}, 40.0)
    assert trajectory.status == "finished", trajectory.reason
    assert reversals(trajectory) == 4
    assert trajectory.result.counters.steps < 4000
    books = audit(trajectory)
    assert books.findings == ()
    assert books.energy_error < 1e-10

    def pull(t, u):
        return mount.k * (AMPLITUDE * np.sin(2 * np.pi * FREQUENCY * t) - u)

    (u, ln_theta), v = sliding(law, pull, mount.c_g, trajectory.result.times)
    outputs = dict(zip([s.name for s in trajectory.model.system.states], trajectory.result.outputs.T, strict=True))
    np.testing.assert_allclose(outputs["u_t"], u, rtol=0, atol=1e-8 * AMPLITUDE)
    np.testing.assert_allclose(outputs["ln_theta"], ln_theta, rtol=0, atol=1e-6)
    named = trajectory.everywhere["v"][: len(v)]
    np.testing.assert_allclose(named[1:], v[1:], rtol=1e-5, atol=1e-60)


@pytest.mark.parametrize(
    ("mount", "elastic"), [(Mounting(k=K, c_b=5e6), 0.0), (Mounting(k=K, c_g=5e6), 0.0), (Mounting(k=K, c_b=5e6), 1e13)]
)
@pytest.mark.parametrize("law", LAWS)
def test_creep_reverses_a_hundred_times(law, mount, elastic):
    """Below what it takes to slide: velocities from 1e-17 m/s through zero and back, in a few steps each."""
    load = Harmonic(amplitude=1e-3, frequency=FREQUENCY)
    trajectory = solved(law, mount, {"w_t": load}, 1000.0, elastic=elastic, parameters=WEAKENING)
    assert trajectory.status == "finished", trajectory.reason
    assert reversals(trajectory) >= 99
    assert trajectory.result.counters.steps < 100 * 60
    assert audit(trajectory).findings == ()
    assert audit(trajectory).energy_error < 1e-10
