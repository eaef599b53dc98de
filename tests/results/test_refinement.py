"""Outputs that follow a run."""

from dataclasses import replace

import numpy as np
import pytest
from case_runs import load, solved

import surfacechem
from surfacechem.results.event_table import events_of
from surfacechem.results.refinement import needed_rows
from surfacechem.tolerances import LINE_ERROR

FOLLOWED = ("stick-slip", "press-hold-pull", "dna-adhesive", "debonding")
"""With many jumps, with stages, with two time scales, with one jump."""

LINED = (*FOLLOWED, "compliant-debonding")
"""And one with a traction that rises by a ramp in the first part of many, while no state changes."""


@pytest.mark.parametrize("name", FOLLOWED)
def test_no_step_depends_on_the_outputs(name):
    case = load(name)
    run, trajectory = case.case.run, solved(name).trajectory
    for times in ((0.0, run.times[-1]), tuple(np.linspace(0.0, run.times[-1], 37).tolist())):
        other = case.model.solve(replace(run, times=times, picture=None))
        first = case.model.solve(replace(run, rtol=trajectory.run.rtol))
        assert other.result.ledger.tobytes() == first.result.ledger.tobytes()
        assert other.result.counters[:2] == first.result.counters[:2]
        for column in ("t", "y", "ydot", "ledger"):
            assert getattr(other.result.steps, column).tobytes() == getattr(first.result.steps, column).tobytes()


@pytest.mark.parametrize("name", LINED)
def test_lines_between_outputs_show_the_run(name):
    """Over time and over its logarithm, against a run with many outputs, beside the events and the breakpoints."""
    case, solution = load(name), solved(name)
    run, data = solution.trajectory.run, solution.dataset
    end, first = run.times[-1], data.time.values[1]
    times = tuple(np.union1d(np.linspace(0.0, end, 1234), np.geomspace(first, end, 600)[:-1]).tolist())
    dense = case.run(run=replace(run, times=times, picture=None), error="balances").dataset
    beside = [*case.system.breakpoints, *(data.event_time.values if "event_time" in data else ())]
    smooth = np.all(np.abs(np.subtract.outer(dense.time.values, beside)) > 1e-9 * run.times[-1], axis=1)
    tractions = [name for name in ("t_n", "t_t") if name in data]
    for shown in (*(state.name for state in case.system.states), *tractions):
        found, known = dense[shown].values[smooth], data[shown].values
        for begun, over in ((0, np.abs), (1, np.log)):  # a logarithm of the time has no start
            later = dense.time.values[smooth] >= data.time.values[begun]
            at, known_at = dense.time.values[smooth][later], data.time.values[begun:]
            missed = np.interp(over(at), over(known_at), known[begun:]) - found[later]
            assert np.abs(missed).max() <= LINE_ERROR * np.ptp(known), shown


def test_a_long_run_is_shown_as_closely_as_a_brief_one():
    """Its last slips are, whose energy bends where no state does, block by block."""
    case = surfacechem.load("stick-slip", ["run.until=60 s"])
    run, data = case.case.run, case.run(error="balances").dataset
    slips = data.event_time.values[-40:].reshape(-1, 2)
    times = np.unique([0.0, *np.linspace(*slips.T, 40)[1:-1].ravel(), run.times[-1]])
    dense = case.run(run=replace(run, times=tuple(times.tolist()), picture=None), error="balances").dataset
    for name in ("v", "E_kinetic_t", "E_spring_t", "D_coulomb"):
        missed = np.interp(times, data.time, data[name]) - dense[name].values
        assert np.abs(missed).max() <= LINE_ERROR * np.ptp(data[name].values), name


def test_both_sides_of_every_event_and_the_extremes_of_the_steps_are_outputs():
    solution = solved("stick-slip")
    data, trajectory = solution.dataset, solution.trajectory
    times = data.time.values
    assert np.all(np.diff(times) > 0)
    events = events_of(trajectory)
    assert len(events) == 12
    for event in events:
        i = int(np.searchsorted(times, event.t))
        assert times[i] == event.t == np.nextafter(times[i - 1], 1e9)
        for state, before, after in zip(trajectory.model.system.states, event.before, event.after, strict=True):
            np.testing.assert_allclose(data[state.name].values[i - 1 : i + 1], [before, after], rtol=1e-12, atol=1e-15)
    steps = trajectory.result.steps.y[:, trajectory.model.system.state_columns["v"]]
    assert data.v.max() >= steps.max()
    assert data.v.min() <= steps.min()


def test_a_person_may_ask_for_times():
    even = surfacechem.run("stick-slip", {"run.outputs": 11}).dataset
    np.testing.assert_allclose(even.time, np.linspace(0.0, 3.0, 11), rtol=1e-15)
    listed = surfacechem.run("exothermic", {"run": {"times": ["1 s", "2 s"]}}).dataset
    assert listed.time.values.tolist() == [0.0, 1.0, 2.0]


def test_rows_are_needed_where_a_line_over_time_or_its_logarithm_would_miss():
    t = np.array([0.0, 1e-3, 1e-2, 0.1, 0.2, 0.3, 1.0])
    straight, kink = 2.0 * t, np.maximum(t - 0.2, 0.0)
    none = np.zeros(len(t), bool)
    kept = needed_rows(t, np.stack([straight, kink]), np.array([1e9, 1e-3]), none)
    assert t[kept].tolist() == [0.0, 0.2, 0.3, 1.0]
    t = np.append(0.0, np.geomspace(1e-6, 1.0, 200))
    kept = needed_rows(t, t[None], np.array([0.1]), np.zeros(len(t), bool))
    assert np.abs(np.interp(np.log(t[1:]), np.log(t[1:][kept[1:]]), t[1:][kept[1:]]) - t[1:]).max() <= 0.1
    assert 3 < kept.sum() < 12


def test_what_bends_where_no_state_does_is_shown():
    """Heat through a gas that contact spots replace within the last nanometres of an even approach."""
    case = surfacechem.load("thermal-press", {"heat.gap-conductance.C_trans": "1e7 1/m", "run.until": "3 s"})
    solution = case.run(error="balances")
    times = np.append(np.linspace(0.0, 1.99, 200), 2 - np.geomspace(1e-2, 1e-8, 900)[1:])
    dense = case.run(run=replace(case.case.run, times=tuple(times), picture=None), error="balances")["q_12_gas"]
    shown = solution["q_12_gas"]
    missed = np.interp(times, shown.time, shown) - dense.values
    assert np.abs(missed).max() < 2 * LINE_ERROR * np.ptp(dense.values)


def test_the_potential_of_hardly_any_sites_which_is_their_error_needs_no_outputs():
    assert len(solved("press-hold-pull").dataset.time) < 300


RUBBED_ZONE = """
T_0: 300 K
bodies: {lower: {temperature: T_1, C: 10 J/m^2/K}, upper: {temperature: T_2, C: 10 J/m^2/K}}
interface:
  temperature: T_c
  potential:
    - exponential-cohesive-zone: {t_max: 3 MPa, g_0: 5 nm, E_n: 2e15 Pa/m}
    - constant-interface-capacity: {C_c: 0.5 J/m^2/K}
  friction:
    - coulomb: {mu: 0.3}
heat:
  - conductance: {between: [lower, interface], h: 5 kW/m^2/K}
  - conductance: {between: [upper, interface], h: 5 kW/m^2/K}
mechanics: {normal: {k: 1e14 Pa/m}, tangential: {k: 0.8e14 Pa/m}}
loading:
  w_n: {table: {times: [0 s, 1 s, 3 s], values: [-6 nm, -6 nm, 80 nm]}}
  w_t: {ramp: {rate: 30 nm/s}}
initial: {T_1: 300 K, T_2: 300 K, T_c: 300 K}
run: {until: 3 s}
"""


def test_no_two_outputs_have_one_time():
    """Just before a snap steps come so close to each other that hardly a time lies between them."""
    times = surfacechem.run(RUBBED_ZONE).dataset["time"].values
    assert np.all(np.diff(times) > 0)
