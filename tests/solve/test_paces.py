"""Motions far faster than the run: what cannot be followed says so, and what begins and ends at once is held."""

import numpy as np
import pytest
from scenes import bodies

from surfacechem.laws.cohesive import ExponentialCohesiveZone
from surfacechem.laws.friction import Coulomb
from surfacechem.laws.loading import Harmonic, Hold, Ramp
from surfacechem.model.assemble import assemble
from surfacechem.results.audit import audit
from surfacechem.scene import Interface, Mounting, Scene
from surfacechem.solve.diagnose import paces
from surfacechem.solve.run import Model, Run

ZONE = ExponentialCohesiveZone(t_max=1e6, g_0=1e-8, E_n=1e14)


def solve(until, potentials=(), frictions=(), initial=None, max_steps=100_000, *, loading, **mounts):
    interface = Interface("T", potentials, frictions)
    start = {"T": 300.0} | (initial or {})
    scene = Scene(bodies("T", "T"), interface, loading=loading, T_0=300.0, initial=start, **mounts)
    return Model(assemble(scene)).solve(Run(times=np.linspace(0.0, until, 11), rtol=1e-13, max_steps=max_steps))


def test_a_slider_that_swings_too_often_says_its_period():
    loading = {"p": Hold(level=1e5), "w_t": Ramp(rate=1e-3)}
    mount = Mounting(k=1e38, m=1.0)
    initial = {"u_t": 0.0, "v": 0.0}
    trajectory = solve(20.0, (), [Coulomb(mu=0.4, mu_s=0.6)], initial, 2000, loading=loading, tangential=mount)
    assert trajectory.status == "failed"
    assert "the period of the tangential displacement, 6.28e-19 s, is too short for a run of 20 s" in trajectory.reason


@pytest.mark.parametrize("c_g", [1e-5])
def test_a_damper_too_light_for_the_passage_of_a_fold_says_so(c_g):
    initial, mount = {"g_n": 0.0}, Mounting(k=1e13, c_g=c_g)
    trajectory = solve(20.0, [ZONE], initial=initial, loading={"w_n": Ramp(rate=1e-8)}, normal=mount)
    assert trajectory.status == "failed"
    assert "leave out the damper" in trajectory.reason


@pytest.mark.parametrize("c_g", [1e-3, 1e-4])
def test_a_light_damper_passes_a_fold(c_g):
    initial, mount = {"g_n": 0.0}, Mounting(k=1e13, c_g=c_g)
    trajectory = solve(20.0, [ZONE], initial=initial, loading={"w_n": Ramp(rate=1e-8)}, normal=mount)
    assert trajectory.status == "finished", trajectory.reason
    assert audit(trajectory).energy_error < 1e-9


@pytest.mark.parametrize(("c_b", "c_g"), [(3e2, 5e2), (4e2, 4e2), (8e2, 0.0), (0.0, 8e2)])
def test_dampers_of_the_bodies_and_of_the_gap_relax_together(c_b, c_g):
    scene = Scene(
        bodies("T", "T"),
        Interface("T", [ZONE]),
        loading={"w_n": Ramp(rate=1e-8)},
        T_0=300.0,
        initial={"T": 300.0, "g_n": 0.0},
        normal=Mounting(k=1e13, c_b=c_b, c_g=c_g),
    )
    model = Model(assemble(scene))
    ((pace, time),) = paces(model.system, model.values())
    assert pace.text == "relaxation of the normal gap"
    assert time == pytest.approx(8e2 / 1e13, rel=1e-14)


def test_a_light_damper_touches_and_releases_once():
    initial, mount = {"g_n": 0.0}, Mounting(k=2e14, c_g=1e-3)
    loading = {"w_n": Harmonic(amplitude=1e-7, frequency=0.1)}
    trajectory = solve(20.0, [ZONE], initial=initial, loading=loading, normal=mount)
    assert trajectory.status == "finished", trajectory.reason
    held = [jump.edge.name for jump in trajectory.jumps if jump.since > 1e-3]
    assert held == ["touch", "release", "touch"]


def test_a_light_damper_keeps_the_energy():
    initial, mount = {"g_n": 0.0}, Mounting(k=2e14, c_g=1e-3)
    loading = {"w_n": Harmonic(amplitude=1e-7, frequency=0.1)}
    trajectory = solve(20.0, [ZONE], initial=initial, loading=loading, normal=mount)
    assert audit(trajectory).energy_error < 1e-9


def test_a_mass_that_starts_on_the_kink_leaves_it():
    initial, mount = {"g_n": 0.0}, Mounting(k=1e13, m=1e-3)
    trajectory = solve(1e-5, [ZONE], initial=initial, loading={"w_n": Ramp(rate=1e-3)}, normal=mount)
    assert trajectory.status == "finished", trajectory.reason
    assert audit(trajectory).energy_error < 1e-9
    # On the spring beside the zone: g = (k / K) V (t - sin(w t) / w) while the zone is linear.
    K = 1e13 + np.e * 1e14
    w, t = np.sqrt(K / 1e-3), trajectory.result.times[1] * 1e-3
    first = trajectory.result.steps.t < t
    found = trajectory.result.steps.y[first][-1]
    names = [state.name for state in trajectory.model.system.states]
    s = trajectory.result.steps.t[first][-1]
    exact = 1e13 / K * 1e-3 * (s - np.sin(w * s) / w)
    assert found[names.index("g_n")] == pytest.approx(exact, rel=1e-3)
