"""A body at rest exactly at touch that a load sets in motion slowly: what drives it decides to which side it goes."""

import math

import pytest

from surfacechem.format import load_text
from surfacechem.runs.simulation import Simulation

LOADS = {
    "ramp": "ramp: {{rate: {way}0.1 um/s}}",
    "one-less-cosine": "harmonic: {{mean: {way}10 nm, amplitude: {way}10 nm, frequency: 0.3 Hz, phase: {phase}}}",
    "rest-and-ramp": "table: {{times: [0 s, 0.2 s, 1 s], values: [0, 0, {way}50 nm]}}",
}
"""Far-field displacements whose value is zero at first, and of the smooth ones also the change of the force or more."""

TOLERANCES = (1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12)


def run(load: str, way: str, rtol: float, potential: str):
    text = f"""
bodies: {{lower: {{temperature: 300 K}}, upper: {{temperature: 300 K}}}}
interface:
  temperature: 300 K
  potential: [{potential}]
mechanics: {{normal: {{k: 5e11, c_g: 4e10, m: 7e7}}}}
loading: {{w_n: {{{LOADS[load].format(way=way, phase=-math.pi / 2)}}}}}
initial: {{g_n: 0}}
run: {{until: 1 s, outputs: 11, rtol: {rtol}}}
"""
    return Simulation(load_text(text)).run()


@pytest.mark.parametrize("rtol", TOLERANCES)
@pytest.mark.parametrize("load", LOADS)
def test_a_body_pulled_off_from_rest_at_touch_does_not_touch(load, rtol):
    solution = run(load, "", rtol, "exponential-cohesive-zone: {t_max: 1e5, g_0: 200 nm, E_n: 3e11}")
    assert solution.status == "finished", solution.reason
    assert not solution.trajectory.jumps
    assert solution.accuracy.error < 100 * rtol, solution.accuracy.source


@pytest.mark.parametrize("rtol", TOLERANCES)
@pytest.mark.parametrize("load", LOADS)
def test_a_body_pressed_from_rest_at_touch_touches_once_and_stays(load, rtol):
    solution = run(load, "-", rtol, "exponential-cohesive-zone: {t_max: 1e5, g_0: 200 nm, E_n: 3e12}")
    begins = 0.2 if load == "rest-and-ramp" else 0.0
    assert solution.status == "finished", solution.reason
    assert [jump.edge.name for jump in solution.trajectory.jumps] == ["touch"]
    assert solution.trajectory.jumps[0].t == pytest.approx(begins, rel=1e-9)
    assert solution.accuracy.error < 100 * rtol, solution.accuracy.source
