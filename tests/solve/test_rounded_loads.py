"""Sliding that begins and ends where large loads cancel: rounding of the loads is no error of the step."""

import pytest

from surfacechem.format import load_text
from surfacechem.results.audit import audit
from surfacechem.solve.run import Model, Run

DAMPED = """\
T_0: 300 K
bodies:
  lower: {temperature: 300 K}
  upper: {temperature: 300 K}
interface:
  temperature: 300 K
  friction:
    - coulomb: {mu: 0.4}
    - viscous: {eta: 0.1 Pa s}
mechanics:
  tangential: {k: 1e8 Pa/m, c_b: 1e6 Pa s/m, c_g: 1e5 Pa s/m}
loading:
  p: 1e5 Pa
  g_n: 1e-6 m
  w_t: {harmonic: {amplitude: 2 mm, frequency: 1 Hz}}
run: {until: 3 s}
"""


@pytest.mark.parametrize("rtol", [1e-5, 1e-7, 1e-9, 1e-10, 1e-11, 1e-12, 1e-13])
def test_a_damped_slider_that_turns_six_times(rtol):
    """It starts with velocities of 1e-17 m/s, from tractions of 4e4 Pa that cancel."""
    model = Model(load_text(DAMPED, "damped").system())
    trajectory = model.solve(Run(times=(0.0, 3.0), rtol=rtol))
    assert trajectory.status == "finished", trajectory.reason
    assert [jump.edge.name for jump in trajectory.jumps].count("stop") == 6
    assert audit(trajectory).energy_error < max(100 * rtol, 1e-9)
