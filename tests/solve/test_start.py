"""A body at rest exactly at touch that a load sets in motion slowly: what drives it decides to which side it goes."""

import math
from dataclasses import replace

import numpy as np
import pytest
import solved
from scenes import together

from surfacechem.format import load_text
from surfacechem.laws.cohesive import ExponentialCohesiveZone
from surfacechem.laws.friction import Coulomb
from surfacechem.laws.loading import Harmonic, Hold, Ramp
from surfacechem.model.assemble import assemble
from surfacechem.results.audit import audit
from surfacechem.runs.simulation import Simulation
from surfacechem.scene import Mounting
from surfacechem.solve.diagnose import time_scales
from surfacechem.solve.run import Model

LOADS = {
    "ramp": "ramp: {{rate: {way}0.1 um/s}}",
    "one-less-cosine": "harmonic: {{mean: {way}10 nm, amplitude: {way}10 nm, frequency: 0.3 Hz, phase: {phase}}}",
    "rest-and-ramp": "table: {{times: [0 s, 0.2 s, 1 s], values: [0, 0, {way}50 nm]}}",
}
"""Far-field displacements whose value is zero at first, and of the smooth ones also the change of the force or more."""

TOLERANCES = (1e-4, 1e-12)


def runs(load: str, way: str, potential: str):
    """Runs at all tolerances, with these."""
    text = f"""
bodies: {{lower: {{temperature: 300 K}}, upper: {{temperature: 300 K}}}}
interface:
  temperature: 300 K
  potential: [{potential}]
mechanics: {{normal: {{k: 5e11, c_g: 4e10, m: 7e7}}}}
loading: {{w_n: {{{LOADS[load].format(way=way, phase=-math.pi / 2)}}}}}
initial: {{g_n: 0}}
run: {{until: 1 s, outputs: 11}}
"""
    simulation = Simulation(load_text(text))
    return [(rtol, simulation.run(run=replace(simulation.case.run, rtol=rtol))) for rtol in TOLERANCES]


@pytest.mark.parametrize("load", LOADS)
def test_a_body_pulled_off_from_rest_at_touch_does_not_touch(load):
    for rtol, solution in runs(load, "", "exponential-cohesive-zone: {t_max: 1e5, g_0: 200 nm, E_n: 3e11}"):
        assert solution.status == "finished", solution.reason
        assert not solution.trajectory.jumps
        assert solution.accuracy.error < 100 * rtol, solution.accuracy.source


@pytest.mark.parametrize("load", LOADS)
def test_a_body_pressed_from_rest_at_touch_touches_once_and_stays(load):
    begins = 0.2 if load == "rest-and-ramp" else 0.0
    for rtol, solution in runs(load, "-", "exponential-cohesive-zone: {t_max: 1e5, g_0: 200 nm, E_n: 3e12}"):
        assert solution.status == "finished", solution.reason
        assert [jump.edge.name for jump in solution.trajectory.jumps] == ["touch"]
        assert solution.trajectory.jumps[0].t == pytest.approx(begins, rel=1e-9)
        assert solution.accuracy.error < 100 * rtol, solution.accuracy.source


# -- motions far faster than the run: what cannot be followed says so, and what begins and ends at once is held -------

ZONE = ExponentialCohesiveZone(t_max=1e6, g_0=1e-8, E_n=1e14)


def solve(until, potentials=(), frictions=(), initial=None, max_steps=100_000, *, loading, **mounts):
    given = together(potentials, frictions, loading, initial, **mounts)
    return solved.solve(given, until, rtol=1e-13, max_steps=max_steps)


def test_a_slider_that_swings_too_often_says_its_period():
    loading = {"p": Hold(level=1e5), "w_t": Ramp(rate=1e-3)}
    mount = Mounting(k=1e38, m=1.0)
    initial = {"u_t": 0.0, "v": 0.0}
    trajectory = solve(20.0, (), [Coulomb(mu=0.4, mu_s=0.6)], initial, 2000, loading=loading, tangential=mount)
    assert trajectory.status == "failed"
    assert "the period of the tangential displacement, 6.28e-19 s, is too short for a run of 20 s" in trajectory.reason


@pytest.mark.parametrize(("c_g", "max_steps"), [(1e-4, 100_000), (1e-5, 100_000), (1e-7, 10_000)])
def test_a_light_damper_passes_a_fold_and_one_that_is_too_light_says_so(c_g, max_steps):
    mount, loading = Mounting(k=1e13, c_g=c_g), {"w_n": Ramp(rate=1e-8)}
    trajectory = solve(20.0, [ZONE], (), {"g_n": 0.0}, max_steps, loading=loading, normal=mount)
    if c_g < 1e-6:
        assert trajectory.status == "failed"
        assert "leave out the damper" in trajectory.reason
    else:
        assert trajectory.status == "finished", trajectory.reason
        assert audit(trajectory).energy_error < 1e-9


@pytest.mark.parametrize(("c_b", "c_g"), [(3e2, 5e2), (0.0, 8e2)])
def test_dampers_of_the_bodies_and_of_the_gap_relax_together(c_b, c_g):
    mount = Mounting(k=1e13, c_b=c_b, c_g=c_g)
    scene = together([ZONE], (), {"w_n": Ramp(rate=1e-8)}, {"g_n": 0.0}, normal=mount)
    model = Model(assemble(scene))
    ((pace, time),) = time_scales(model.system, model.values())
    assert pace.text == "relaxation of the normal gap"
    assert time == pytest.approx(8e2 / 1e13, rel=1e-14)


def test_a_light_damper_touches_and_releases_once():
    initial, mount = {"g_n": 0.0}, Mounting(k=2e14, c_g=1e-3)
    loading = {"w_n": Harmonic(amplitude=1e-7, frequency=0.1)}
    trajectory = solve(20.0, [ZONE], initial=initial, loading=loading, normal=mount)
    assert trajectory.status == "finished", trajectory.reason
    held = [jump.edge.name for jump in trajectory.jumps if jump.since > 1e-3]
    assert held == ["touch", "release", "touch"]


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
