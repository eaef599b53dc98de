"""Every run carries its own error, and says where it is from."""

from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

import surfacechem
from surfacechem.achieved import EVENTS, against_tighter, difference, event_error
from surfacechem.cli import app
from surfacechem.errors import InputError
from surfacechem.event_table import event_times


@pytest.fixture(scope="module")
def stick_slip():
    return surfacechem.load("stick-slip")


@pytest.mark.parametrize(
    ("way", "words"),
    [
        ("auto", "exact solution exothermic-bonding"),
        ("estimate", "estimate: a second run at rtol 1e-13"),
        ("balances", "balances only: what they miss is not seen"),
    ],
)
def test_the_summary_says_where_the_error_is_from(way, words, tmp_path):
    target = tmp_path / "run.nc"
    done = CliRunner().invoke(app, ["run", "exothermic", "--error", way, "-o", str(target)])
    assert done.exit_code == 0, done.output
    line = next(line for line in done.output.splitlines() if line.strip().startswith("error"))
    assert words in line
    again = CliRunner().invoke(app, ["rerun", str(target)])
    assert again.exit_code == 0, again.output


def test_another_source_is_refused_before_anything_is_computed():
    with pytest.raises(InputError, match=r"no source 'estimte' of an error\. Did you mean 'estimate'\?"):
        surfacechem.load("exothermic").run(error="estimte")


def test_the_balances_are_the_error_where_nothing_else_is_asked_for():
    solution = surfacechem.load("exothermic").run(error="balances")
    assert solution.accuracy.variables["energy"] == solution.audit.energy_error
    assert solution.accuracy.error == max(solution.accuracy.variables.values())


def test_an_estimate_looks_at_the_times_of_events(stick_slip):
    run = replace(stick_slip.case.run, rtol=1e-6, times=(0.0, 3.0))
    loose, tight = (stick_slip.model.solve(replace(run, rtol=rtol)) for rtol in (1e-6, 1e-12))
    true = event_error(event_times(loose), event_times(tight), 3.0)
    estimate = against_tighter(loose).variables[EVENTS]
    assert estimate == pytest.approx(true, rel=0.1)
    assert estimate > 0


def test_other_events_in_the_second_run_are_said(stick_slip, monkeypatch):
    trajectory = stick_slip.model.solve(stick_slip.case.run)
    second = replace(trajectory, jumps=trajectory.jumps[:-1])
    monkeypatch.setattr(type(stick_slip.model), "resolve", lambda *_: second)
    accuracy = against_tighter(trajectory)
    last = trajectory.jumps[-1].transition.name
    count = len(event_times(trajectory)[last])
    assert f"which had other events: {count - 1} {last} instead of {count}" in accuracy.source
    assert EVENTS not in accuracy.variables


def test_a_second_run_that_ends_earlier_leaves_the_balances(monkeypatch):
    simulation = surfacechem.load("exothermic")
    trajectory = simulation.model.solve(simulation.case.run)
    short = simulation.model.solve(replace(simulation.case.run, times=(0.0, 1.0)))
    monkeypatch.setattr(type(simulation.model), "resolve", lambda *_: short)
    accuracy = against_tighter(trajectory)
    assert accuracy.source.startswith("balances only, since a second run at rtol 1e-13 ended earlier")
    assert np.isfinite(accuracy.error)


def test_the_end_of_a_stopped_run_is_an_event():
    solution = surfacechem.load("cooling-to-zero").run()
    assert solution.status == "stopped"
    assert event_times(solution.trajectory)["end"] == [solution.trajectory.result.t]


def test_differences_between_events_in_words():
    assert difference({"slip": np.array([0.1])}, {"slip": np.array([0.2])}) == ""
    assert difference({}, {"slip": np.array([0.2])}) == "other events: 1 slip instead of 0"


@pytest.mark.parametrize("strength", [20, 55, 90])
def test_an_output_at_the_time_of_a_jump_is_compared_on_the_side_on_which_it_lies(strength):
    """The strength is reached at a whole multiple of the spacing of the outputs, but for the last digits."""
    change = [f"interface.limits.tensile-strength.t_max={strength} MPa"]
    run = surfacechem.load("debonding", change).run()
    assert run.accuracy.source == "exact solution pulled-to-debonding"
    assert run.accuracy.error < 1e-12
    np.testing.assert_allclose(run.dataset.phi, run.dataset.phi_exact, atol=1e-15)


def test_an_output_at_the_time_of_a_jump_is_no_error_of_the_states(tmp_path):
    """Strength falls as heat comes in: the time of debonding is known to the tolerance alone."""
    C, k, t_0, w, heat = 2000.0, 1e13, 20e6, 3.8e-6, 1e4
    hottest = 300.0 * t_0 / (w * k / 2)
    time = (hottest**2 - 300.0**2) * C / 600.0 / heat
    case = tmp_path / "hot.yaml"
    case.write_text(
        f"""
T_0: 300 K
bodies:
  a: {{temperature: T, C: 1 kJ/m^2/K}}
  b: {{temperature: T, C: 1 kJ/m^2/K}}
interface:
  temperature: T
  sites: 1e18
  potential: [bonded-contact: {{E_n: 1e13}}, bond-energy: {{K_0: 1}}]
  limits: [tensile-strength: {{t_max: {{value: 20 MPa, times: [power: {{exponent: -1}}]}}}}]
mechanics: {{normal: {{k: 1e13}}}}
loading: {{w_n: 3.8 um, Q_1: 10 kW/m^2}}
initial: {{T: 300 K, phi: 1}}
run: {{times: [0, 1, {time!r}, 5], rtol: 1e-6}}
"""
    )
    run = surfacechem.load(case).run()
    assert run.trajectory.jumps[0].t == pytest.approx(time, rel=1e-7)
    assert run.accuracy.error < 1e-7
