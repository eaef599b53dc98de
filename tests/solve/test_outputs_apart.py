"""Output times have no part in a run: steps, events and states are the same to the last bit whatever is asked for."""

from dataclasses import replace

import numpy as np
import pytest

from surfacechem.format import load_text
from surfacechem.runs.simulation import Simulation

BODIES = """
T_0: 300 K
bodies:
  a: {temperature: T, capacity: constant, C: 2 J/m^2/K, stiffness: 2e12 Pa/m}
  b: {temperature: T, capacity: constant, C: 1 J/m^2/K, stiffness: 6e12 Pa/m}
"""

COHESIVE = f"""
title: A mass that bounces against a cohesive zone
{BODIES}
interface:
  temperature: T
  potential:
    - exponential-cohesive-zone:
        t_max: {{value: 2 MPa, times: [power: {{exponent: -1}}]}}
        g_0: 300 nm
        E_n: 3e13 Pa/m
mechanics:
  normal: {{m: 0.2 kg/m^2, c_b: 2e4 Pa s/m, c_g: 1e4 Pa s/m, beta_1: 0.3}}
loading: {{w_n: {{harmonic: {{mean: 0.2 um, amplitude: 1 um, frequency: 60 kHz}}}}}}
initial: {{T: 280 K, g_n: 100 nm, v_n: 5 mm/s}}
run: {{until: 400 us}}
"""

RINGING = f"""
title: Debonding that rings
{BODIES}
interface:
  temperature: T
  sites: 1e18 1/m^2
  potential:
    - bonded-contact: {{E_n: 1.5e13 Pa/m}}
    - bond-energy: {{K_0: 2 J/m^2}}
  limits:
    - tensile-strength: {{t_max: {{value: 9 MPa, times: [power: {{exponent: -1}}]}}}}
mechanics: {{normal: {{m: 5 kg/m^2, c_b: 1e5 Pa s/m}}}}
loading: {{w_n: {{harmonic: {{amplitude: 6 um, frequency: 2 kHz}}}}}}
initial: {{T: 300 K, phi: 1, g_n: 0}}
run: {{until: 3 ms}}
"""


@pytest.mark.parametrize("text", [COHESIVE, RINGING])
def test_outputs_change_nothing(text):
    simulation = Simulation(load_text(text))
    run, found = simulation.case.run, []
    for n in (2, 31, 301, 777):
        times = np.linspace(0.0, run.times[-1], n).tolist()
        trajectory = simulation.model.solve(replace(run, times=times))
        assert trajectory.status == "finished"
        result, jumps = trajectory.result, trajectory.jumps
        events = np.array([[jump.t, jump.released, *jump.after.y] for jump in jumps])
        blocks = (events, result.steps.t, result.steps.y, result.steps.ydot, result.y, result.ledger)
        found.append((len(jumps), result.counters.steps, result.counters.rejected, *(b.tobytes() for b in blocks)))
    assert len(set(found)) == 1
    assert found[0][0] > 10
