"""Every run carries its own error, and says where it is from."""

import math
from dataclasses import replace
from functools import partial

import mpmath
import numpy as np
import pytest
from typer.testing import CliRunner

import surfacechem
from surfacechem.cli.main import app
from surfacechem.errors import InputError
from surfacechem.results.accuracy import NOTHING_EVOLVES, CellErrors
from surfacechem.results.error_estimates import (
    EVENTS,
    against_exact,
    estimated,
    floors,
    state_differences,
    unknown,
    with_cells,
)
from surfacechem.results.event_table import event_times
from surfacechem.runs import rerun
from surfacechem.runs.summaries import run_summary, sweep_summary
from surfacechem.tolerances import EPS


@pytest.fixture(scope="module")
def stick_slip():
    return surfacechem.load("stick-slip")


def test_what_rounding_leaves_of_an_end_is_compared_with_what_the_exact_solution_has_before_its_own():
    found = surfacechem.load("shared-load-rupture").run({"loading.t_n": 1.1e4})
    assert found.trajectory.reason.startswith("the bonds ruptured")
    late = found.dataset.isel(time=slice(-6, None))
    assert np.all(np.isfinite(found.dataset["f_exact"]))
    np.testing.assert_allclose(late["phi_exact"], late["phi"], rtol=0.1)


def test_an_end_that_the_exact_solution_has_is_compared_with_it(monkeypatch):
    """It needs no second run; an end elsewhere does."""
    case, runs = surfacechem.load("shared-load-rupture"), []
    tighter = "surfacechem.results.error_estimates.second_tolerance"
    monkeypatch.setattr(tighter, lambda rtol: runs.append(rtol) or 0.1 * rtol)
    solution = case.run()
    assert 0 < solution.accuracy.variables[EVENTS] < 1e-12
    assert not runs
    assert case.run(["interface.bonding.bell.x_off=0.5 nm"]).accuracy.error < 1e-8
    assert not runs
    assert surfacechem.load("stick-slip").run().accuracy
    assert len(runs) == 1


def test_where_nothing_evolves_the_error_is_that_of_the_laws():
    laws = CellErrors({"t_n": 1e-9}, source="and one with forces of the surfaces wrong by their error, 1.0e-09")
    found = with_cells(unknown(NOTHING_EVOLVES), laws)
    assert (found.error, found.variables) == (1e-9, {"t_n": 1e-9})
    assert found.source == "estimate: a second run with forces of the surfaces wrong by their error, 1.0e-09"
    late = unknown("a second run at rtol 1e-13 failed")
    assert with_cells(late, laws) == late


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


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("cohesive-cycles", {}),
        ("cohesive-cycles", {"accuracy": 1e-6, "rtol": 1e-8}),
        ("cohesive-cycles", {"accuracy": None, "solver": "radau", "rtol": 1e-6}),
        ("exothermic", {"accuracy": 1e-6, "solver": "auto", "rtol": 1e-8}),
    ],
)
def test_what_was_asked_for_is_asked_for_again(name, changes, tmp_path):
    case = surfacechem.load(name)
    record = rerun.read(case.run(run=replace(case.case.run, **changes)).write(tmp_path / "run.nc"))
    assert rerun.differences(record, rerun.run_again(record)) == []


def test_another_source_is_refused_before_anything_is_computed():
    with pytest.raises(InputError, match="the accuracy 1e-09 is verified by a second run, which `balances` leaves out"):
        surfacechem.load("debonding").run(error="balances")
    with pytest.raises(InputError, match=r"no source 'estimte' of an error\. Did you mean 'estimate'\?"):
        surfacechem.load("exothermic").run(error="estimte")


def test_the_same_run_has_the_same_accuracy():
    case = surfacechem.load("exothermic")
    assert case.run().accuracy == case.run().accuracy != case.run(error="estimate").accuracy


@pytest.mark.parametrize(("phi", "floor"), [(1.0, 1e-60 / 1e-8), (1e-31, EPS)])
def test_a_coverage_that_is_never_more_than_rounding_has_no_error(phi, floor):
    """One that decays from something is resolved however small it becomes, where the tolerance says so."""
    changes = {"initial.phi": phi, "run.rtol": 1e-8, "run.atol": 1e-60, "run.until": "100 s"}
    case = surfacechem.load("bond-constant-force", changes)
    assert floors(case.model.solve(case.case.run))["phi"] == pytest.approx(floor, rel=1e-12)


def test_other_events_in_the_second_run_are_said(stick_slip):
    trajectory = stick_slip.model.solve(stick_slip.case.run)
    second = replace(trajectory, jumps=trajectory.jumps[:-1])
    found = estimated(trajectory, second)
    last = trajectory.jumps[-1].edge.name
    count = len(event_times(trajectory)[last])
    assert f"which had other events: {count - 1} {last} instead of {count}" in found.source
    assert (found.error, found.variables[EVENTS]) == (EPS, 0.0)  # the states agree, and events that both have
    away = replace(second, result=second.result._replace(outputs=2 * second.result.outputs))
    assert math.isnan(estimated(trajectory, away).error)  # one of the two went another way
    late = against_exact(trajectory, stick_slip.case.scene, "stick-slip", {}, away)
    assert late.variables[EVENTS] == 0.0


@pytest.mark.parametrize("rtol", [1e-5, 1e-7, 1e-9])
def test_a_gap_that_touches_zero_for_a_moment_has_a_known_error(rtol):
    """A plate on a spring with a damper touches another one as its load turns, and rounding decides whether it does."""
    load = "{table: {times: [0, 0.2, 0.4, 0.6, 0.8, 1.1], values: [0, 1 mm, 0, 1 mm, 0, 1 mm]}}"
    text = on_a_spring("k: 1 MPa/m, c_b: 0.6 MPa s/m", load, "interface: {potential: [penalty: {E_n: 1 MPa/m}]}")
    found = surfacechem.run(f"{text}initial: {{g_n: 0 m}}\nrun: {{until: 1 s, rtol: {rtol}}}")
    assert found.accuracy.error < 1e-13


@pytest.mark.parametrize(
    ("first", "second", "fate"),
    [
        (("finished", 2.0), ("stopped", 1.0), "ended earlier"),
        (("stopped", 1.0), ("finished", 2.0), "finished later"),
        (("finished", 2.0), ("failed", 1.0), "ended earlier"),
        (("failed", 1.0), ("failed", 2.0), "failed later"),
    ],
)
def test_the_error_is_unknown_where_one_run_goes_on_beyond_the_end_of_the_other(stick_slip, first, second, fate):
    runs = [(status, replace(stick_slip.case.run, times=(0.0, end))) for status, end in (first, second)]
    found = estimated(*(replace(stick_slip.model.solve(run), status=status) for status, run in runs))
    assert found.source.startswith(f"unknown: a second run at rtol 1e-11 {fate}")
    assert np.isnan(found.error)


@pytest.mark.parametrize("more", ["accuracy: 1e-6", "rtol: 1e-6"])
def test_a_run_that_has_used_up_its_budget_is_not_made_again(more, monkeypatch):
    found = surfacechem.run("stick-slip", [f"run={{until: 3 s, max-steps: 10, {more}}}", "reference="])
    monkeypatch.setattr(type(found.trajectory.model), "solve_all", None)
    assert found.accuracy.source.startswith("unknown: the run failed: the number of steps allowed was used up")


@pytest.mark.parametrize("strength", [20, 55])
def test_an_output_at_the_time_of_a_jump_is_compared_on_the_side_on_which_it_lies(strength):
    """The strength is reached at a whole multiple of the spacing of the outputs, but for the last digits."""
    change = [f"interface.limits.tensile-strength.t_max={strength} MPa"]
    run = surfacechem.load("debonding", change).run()
    assert run.accuracy.source == "exact solution pulled-to-debonding"
    assert run.accuracy.error < 1e-12
    np.testing.assert_allclose(run.dataset.phi, run.dataset.phi_exact, atol=1e-15)


@pytest.mark.parametrize("reference", [{}, {"reference": ""}])
def test_a_run_that_ends_before_its_second_output_knows_its_error(reference):
    """It reaches zero temperature at 300 s."""
    solution = surfacechem.run("cooling-to-zero", {"run": {"until": "1e5 s", "outputs": 3}, **reference})
    assert len(solution.trajectory.result.times) == 1
    true = abs(solution.trajectory.result.t / 300.0 - 1)
    assert set(solution.accuracy.variables) == {"T", EVENTS}
    assert true / 10 < solution.accuracy.variables[EVENTS] < solution.accuracy.error < 1e-9


def test_balances_tell_nothing_of_a_run_that_ends_before_its_second_output():
    solution = surfacechem.load("cooling-to-zero", {"run": {"until": "1e5 s", "outputs": 3}}).run(error="balances")
    assert np.isnan(solution.accuracy.error)
    assert "unknown: the run ended before its second output" in str(run_summary(solution, None))
    assert np.isnan(solution.attributes["error"])


def test_species_that_never_exceed_the_absolute_tolerance_are_no_error():
    """A state of 1e-31 that two runs know to no digit is known as well as its tolerance asks."""
    trajectory = surfacechem.run("exothermic").trajectory
    first, second = (
        replace(trajectory, result=trajectory.result._replace(outputs=trajectory.result.outputs * [part, 1.0]))
        for part in (1e-31, 3e-31)
    )
    errors, _ = state_differences(first, second)
    assert errors["phi"] < 1e-24


STRENGTH = "interface.limits.tensile-strength.t_max"


@pytest.mark.parametrize("error", ["auto", "estimate"])
def test_an_event_that_falls_on_the_end_is_no_error(error):
    """At 1 um/s the strength of 100 MPa is reached at the very end; rounding decides whether a run sees it."""
    simulation = surfacechem.load("debonding")
    assert simulation.run({STRENGTH: "100 MPa"}, error=error).accuracy.error < 1e-12
    swept = simulation.sweep({STRENGTH: ["20 MPa", "60 MPa", "100 MPa"]})
    assert swept.accuracy.source == "exact solution pulled-to-debonding"
    assert np.all(swept.accuracy.errors < 1e-12)


def test_an_exact_solution_with_parameters_of_its_own_is_of_the_scene_as_written():
    """A separation that differs by 1e-15 of itself leaves the equations as they are, not the time of the passage."""
    w_n = 1.1063772254722603e-07
    simulation = surfacechem.load("slow-passage")
    why = "does not apply to this scene: it is given with delta_w, and the scene was changed"
    changed = simulation.run({"loading.w_n": w_n * (1 + 1e-9)})
    for accuracy in (changed.accuracy, simulation.sweep({"loading.w_n": [w_n, w_n * (1 + 1e-9)]}).accuracy):
        assert accuracy.source.startswith("estimate")
        assert accuracy.source.endswith(why)
    assert "g_n_exact" not in changed.dataset
    for same in (simulation.run({"loading.w_n": w_n}), surfacechem.run("slow-passage", ["run.outputs=31"])):
        assert same.accuracy.source == "exact solution overdamped-pull-off"


def test_an_exact_solution_that_overflows_gives_way_to_a_second_run():
    changes = {"interface.bonding.bell.k_off": 1e12}
    accuracy = surfacechem.load("adhesion-cluster").run(changes).accuracy
    assert accuracy.source.startswith("estimate")
    assert accuracy.source.endswith("its formulas leave the range of numbers")


def test_a_sweep_of_which_no_error_is_known_says_so(tmp_path):
    """Runs that end before their second output have the error of their end; without it that of a sweep is unknown."""
    swept = surfacechem.load("cooling-to-zero", {"run": {"until": "1e5 s", "outputs": 3}, "reference": ""}).sweep(
        {"initial.T": [290.0, 300.0]}
    )
    assert np.all((swept.accuracy.errors > 0) & (swept.accuracy.errors < 1e-9))
    nothing = replace(swept, judge=lambda _: replace(swept.accuracy, errors=np.full(2, np.nan)))
    assert "error      unknown (estimate: a second sweep at rtol 1e-13 that" in str(sweep_summary(nothing, None))
    assert np.isnan(nothing.attributes["error"])


@pytest.mark.parametrize("name", ["adhesion-cluster", "stick-slip-rebonding", "three-temperatures"])
def test_the_error_of_what_follows_from_states_is_that_against_an_exact_solution(name):
    case = surfacechem.load(name)
    loose = replace(case.case.run, rtol=1e-5)
    exact, solution = case.run(run=loose).accuracy.variables, case.run(run=loose, error="estimate")
    named = exact.keys() & solution.trajectory.model.system.output_columns.keys()
    assert named
    for each in named:
        assert exact[each] / 2 < solution[each].attrs["error"] < 2 * exact[each]


def test_a_variable_says_its_error_and_the_summary_the_worst():
    """Beside a jump of a load a time is compared; a chemical potential of next to no bonds is known to no digit."""
    assert max(surfacechem.run("area-stretch").accuracy.everywhere.values()) < 1e-8
    solution = surfacechem.run("press-hold-pull")
    assert solution["M_theta_bond_s"].attrs["error"] > 0.01 > solution["t_n"].attrs["error"]
    assert "of what follows from the states up to 0." in str(run_summary(solution, None))


def on_a_spring(mechanics: str, loading: str, interface: str = "interface: {potential: [penalty: {E_n: 1 MPa/um}]}"):
    bodies = "bodies: {a: {temperature: 300 K}, b: {temperature: 300 K}}"
    return f"{bodies}\n{interface}\nmechanics: {{normal: {{{mechanics}}}}}\nloading: {{w_n: {loading}}}\n"


@pytest.mark.parametrize(
    "scene",
    [
        on_a_spring("k: 20 MPa/mm", "{harmonic: {mean: 5 um, amplitude: 3 um, frequency: 1 Hz}}"),  # never touched
        on_a_spring("k: 20 MPa/mm", "{harmonic: {amplitude: 5 um, frequency: 1 Hz}}", ""),  # rigid, opens and closes
        on_a_spring("k: 20 kPa/mm, m: 1 kg/m^2", "5 um") + "initial: {g_n: 5 um}\n",  # at rest
    ],
    ids=["open", "rigid", "resting"],
)
def test_what_is_nothing_is_not_wrong(scene):
    """A spring at no extension, what it releases there, and a mass in equilibrium are known to their rounding."""
    solution = surfacechem.run(f"{scene}run: {{until: 3 s}}")
    assert max(solution.accuracy.everywhere.values()) < 1e-9
    assert solution.warnings == ()


def test_a_small_velocity_that_is_no_rounding_has_its_error():
    scene = on_a_spring("k: 20 kPa/mm, m: 1 kg/m^2", "5 um")
    solution = surfacechem.run(f"{scene}initial: {{g_n: 5.000001 um}}\nrun: {{until: 10 ms, rtol: 1e-3}}")
    assert solution.accuracy.variables["v_n"] > 1e-9


def test_a_flux_that_the_tolerance_does_not_resolve_has_its_error():
    """Between bodies of almost the same temperature: a difference of large numbers, not a square of errors."""
    text = "bodies: {a: {temperature: T_1, C: 1 kJ/m^2/K}, b: {temperature: T_2, C: 1 kJ/m^2/K}}\nT_0: 300 K\n"
    text += "heat: [conductance: {between: [a, b], h: 1e6}]\nloading: {Q_1: 1 W/m^2}\ninitial: {T_1: 300, T_2: 300}\n"
    solution = surfacechem.run(f"{text}run: {{until: 1 s, rtol: 1e-6}}")
    assert "q_12" in solution.accuracy.everywhere


PLATE = """
bodies: {a: {temperature: 300 K}, b: {temperature: 300 K}}
interface: {temperature: 300 K}
mechanics: {normal: {m: 1 kg/m^2, e: 0.95}}
loading: {F_n: {harmonic: {mean: -10 Pa, amplitude: 14 Pa, frequency: 1 Hz}}}
initial: {g_n: 0.3 m, v_n: 0}
run: {until: %d s}
"""


def height(at, t, g, v, by):
    """Of a flight that begins at t from the gap g with the velocity v, in doubles by NumPy, in all digits by mpmath."""
    w, lift, s = 2 * by.pi, 14 / (2 * by.pi), at - t
    return g + (v + lift * by.cos(w * t)) * s - 5 * s**2 - lift / w * (by.sin(w * at) - by.sin(w * t))


def shaken_plate(end):
    """Gap of the plate by flights in 40 digits, each to its impact."""
    with mpmath.workdps(40):
        w, lift = 2 * mpmath.pi, 14 / (2 * mpmath.pi)
        t, g, v, e = mpmath.mpf(0), mpmath.mpf(0.3), mpmath.mpf(0), mpmath.mpf(0.95)
        while True:
            times = np.linspace(float(t), end, int(1000 * (end - float(t))) + 2)[1:]
            below = np.flatnonzero(height(times, float(t), float(g), float(v), np)[1:] <= 0)
            if not len(below):
                return float(height(mpmath.mpf(end), t, g, v, mpmath))
            bracket = times[below[0]], times[below[0] + 1]
            flight = partial(height, t=t, g=g, v=v, by=mpmath)
            hit = mpmath.findroot(flight, bracket, solver="anderson")
            fallen = v - 10 * (hit - t) - lift * (mpmath.cos(w * hit) - mpmath.cos(w * t))
            t, g, v = hit, mpmath.mpf(0), -e * fallen


@pytest.mark.parametrize(("end", "asked"), [(22, ""), (34, ", accuracy: 1e-8")])
def test_impacts_that_magnify_rounding_are_known_to(end, asked):
    """Two runs of the same numbers round the times of the first impacts alike, and what follows magnifies that."""
    solution = surfacechem.load((PLATE % end).replace(" s}", f" s{asked}}}")).run()
    error = abs(solution.dataset["g_n"].values[-1] / shaken_plate(end) - 1)
    assert 1e-8 < error < 4 * solution.accuracy.error < 40 * error  # the difference of two random sums


DAMPED = """
bodies: {lower: {temperature: 300 K}, upper: {temperature: 300 K}}
interface: {temperature: 300 K, friction: [coulomb: {mu: 0.5}]}
mechanics: {tangential: {k: 1 MPa/mm, c_b: 1e9 Pa s/m}}
loading: {p: 1 MPa, w_t: {ramp: {rate: 1 um/s}}}
run: {until: 2000 s}
"""


def test_a_velocity_from_a_balance_is_compared_with_how_fast_it_sets_in():
    found = surfacechem.run(DAMPED)
    assert found.accuracy.error < 1e-9
    trajectory, column = found.trajectory, found.trajectory.model.system.state_columns["v"]
    v, t = trajectory.result.outputs[:, column], trajectory.result.times
    # As sliding begins at 499 s the velocity goes on to that of the far field within c_b/k, 1 s.
    expected = np.where((t > 499) & (v > 0), 1e-6 - v, 0.0)
    assert trajectory.rates[:, column] == pytest.approx(expected, rel=1e-3, abs=1e-10)
