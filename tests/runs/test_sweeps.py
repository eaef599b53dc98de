"""Sweeps: many runs of one compiled model, force spectra against the exact formulas, refusals."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import xarray
from test_references import build
from typer.testing import CliRunner

import surfacechem
from surfacechem import format as cases
from surfacechem.cli.main import app
from surfacechem.errors import InputError
from surfacechem.references import get
from surfacechem.runs import rerun
from surfacechem.runs.checking import check
from surfacechem.runs.summaries import sweep_summary
from surfacechem.runs.sweeps import parameter_names
from surfacechem.solve.radau.solver import Radau

pytestmark = pytest.mark.around

RATE = "loading.f.ramp.rate"


@pytest.fixture(scope="module")
def spectrum():
    return surfacechem.sweep("force-spectroscopy")


@pytest.fixture(scope="module")
def bonding():
    return surfacechem.load("exothermic")


def test_what_readers_of_a_run_have_to_know_is_told_of_a_sweep():
    """Where the friction in sliding is above that at rest, which one of two runs has."""
    swept = surfacechem.sweep("stick-slip", {"interface.friction.coulomb.mu": [0.4, 0.7]})
    alone = surfacechem.load("stick-slip").run({"interface.friction.coulomb.mu": 0.7})
    (warning,) = swept.warnings
    assert warning == f"1 of 2 runs: {alone.warnings[0]}" == swept.dataset.attrs["warnings"]
    assert warning in str(sweep_summary(swept, None))


def test_six_decades_of_loading_rates_meet_the_exact_formulas(spectrum):
    data = spectrum.dataset
    assert data.sizes == {"rate": 61, "f": 201, "event": 3}
    assert data["rate"].values[-1] / data["rate"].values[0] == pytest.approx(1e6)
    for rate, one in zip(data["rate"].values, data["rate"], strict=True):
        bond, found = get("bell-ramp")(k_off=0.1, x_off=4e-10, T=300.0, rate=rate), data.sel(rate=one)
        for which in ("mode", "median", "mean"):
            exact = getattr(bond, which)
            assert found[f"f_{which}_exact"] == pytest.approx(exact, rel=1e-12)
            assert abs(found[f"f_{which}"].item() - exact) <= 1e-11 * exact + 1e-24
    assert data.attrs["error"] < 1e-11
    assert data.attrs["error_source"] == "exact solution bell-ramp"
    assert set(data["status"].values) == {"stopped"}
    assert "all bonds broke" in data["reason"].values[0]


def test_outputs_of_a_spectrum_are_at_equal_forces(spectrum):
    data = spectrum.dataset
    np.testing.assert_allclose(data["f"], np.linspace(0, 2e-10, 201), rtol=1e-12)
    one = data.isel(rate=30)
    np.testing.assert_allclose(one["time"] * one["rate"], data["f"], rtol=1e-12)
    bond = build("bell-ramp", {}, k_off=0.1, x_off=4e-10, T=300.0, rate=one["rate"].item())
    np.testing.assert_allclose(data["f_last"], data["rate"] * data["time_reached"], rtol=1e-12)
    assert (one["phi_max"].item(), one["phi_min"].item()) == (1.0, one["phi_last"].item())
    reached = np.isfinite(one["phi"].values)
    exact = bond.solution(one["time"].values[reached])["phi"]
    np.testing.assert_allclose(one["phi"].values[reached], exact, rtol=1e-8, atol=1e-16)
    np.testing.assert_allclose(
        one["density_f"].values[reached], np.exp(bond.log_density(one["f"].values[reached])), rtol=1e-8, atol=1e-4
    )


def test_lifetimes_over_the_force_meet_the_exact_rates():
    data = surfacechem.sweep("bond-lifetimes").dataset
    f = data["loading_f"].values
    np.testing.assert_allclose(data["lifetime"], 10.0 * np.exp(-f * 4e-10 / (1.380649e-23 * 300.0)), rtol=1e-11)
    np.testing.assert_allclose(data["lifetime_exact"], data["lifetime"], rtol=1e-11)
    assert data.attrs["error"] < 1e-11
    assert data.attrs["error_source"] == "exact solution bell-constant-force"
    catch = surfacechem.load("catch-bond", {"run.until": "1 min"}).sweep(until="survival=1e-12").dataset
    rates = [k * np.exp(catch["loading_f"] * x / (1.380649e-23 * 298.15)) for k, x in ((20.0, -8e-10), (0.2, 2e-10))]
    np.testing.assert_allclose(catch["lifetime"], 1 / sum(rates), rtol=1e-11)


def test_what_has_no_lifetime_says_so(tmp_path):
    early = surfacechem.load("bond-lifetimes", {"run.until": "3 s"}).sweep({"loading.f": ["0 pN", "80 pN"]}).dataset
    assert np.isnan(early["lifetime"].values).tolist() == [True, False]
    with pytest.raises(InputError, match=r"must be in \(0, 1e-06\], not 0.5"):
        surfacechem.sweep("bond-lifetimes", until={"survival": 0.5})
    with pytest.raises(InputError, match="no lifetimes: no bonds evolve here, or they can form again"):
        surfacechem.sweep("exothermic", {"T_0": [300.0]}, {"survival": 1e-9})
    case = surfacechem.load("bond-lifetimes")
    with pytest.raises(InputError, match="a store keeps no lifetimes"):
        case.stream(case.plan(), tmp_path / "lifetimes.zarr")


def test_biotin_breaks_near_the_forces_that_were_measured():
    """200 pN at 1.5 nN/s and 230 pN at 110 nN/s, Sedlak et al. (2017); the off-rate is known to a power of ten."""
    data = surfacechem.sweep("biotin-streptavidin").dataset
    assert data.attrs["error"] < 1e-10
    slow, fast = (data["f_mode"].sel(rate=rate, method="nearest").item() for rate in (1.5e-9, 110e-9))
    assert (slow, fast) == (pytest.approx(200e-12, rel=0.02), pytest.approx(230e-12, rel=0.1))


def test_no_errors_are_found_where_no_runs_are_checked(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    section = "sweep={over: {initial.T: [290, 300]}, checked: 0}"
    done = CliRunner().invoke(app, ["sweep", "exothermic", "--set", section, "-v", "-o", "s.nc"])
    assert done.exit_code == 0, done.output
    assert "error" not in done.stdout
    swept = surfacechem.load("exothermic", [section]).sweep(changes={"interface.potential.bond-energy.K_2": 0.1})
    assert swept.accuracy is None
    assert "error" not in swept.dataset
    assert rerun.differences(rerun.read("s.nc"), rerun.run_again(rerun.read("s.nc"))) == []


def test_a_sweep_can_be_run_again_from_its_file(spectrum, tmp_path):
    record = rerun.read(spectrum.write(tmp_path / "spectrum.nc"))
    assert rerun.differences(record, rerun.run_again(record)) == []


@pytest.mark.parametrize(
    ("case", "path", "values"),
    [
        pytest.param(
            "stick-slip", "interface.friction.coulomb.mu_s", 0.1 + np.linspace(0.2, 0.5, 7), marks=pytest.mark.slow
        ),
        ("press-hold-pull", "programme.approach.until.p", ["8 kPa", "10 kPa"]),
        ("exothermic", "initial.T", ["290 K", "300 K", "310 K"]),
        ("closing-gas-gap", "initial.T_2", [500.0, 600.0]),
    ],
)
def test_runs_with_edges_or_fits_share_batches_and_stay_what_they_are(case, path, values, monkeypatch):
    case, rounds, solve_all = surfacechem.load(case), [], Radau.solve_all
    monkeypatch.setattr(Radau, "solve_all", lambda *given: rounds.append(len(given[1])) or solve_all(*given))
    one, two = (case.sweep({path: values}, threads=n) for n in (1, 2))
    assert rounds[0] == len(values) > 1
    for i in range(len(values)):
        alone = case.run(
            one.plan.points[i], replace(case.case.run, picture=None, times=one.runs[i].run.times)
        ).trajectory
        for run in (one.runs[i], two.runs[i]):
            assert run.outputs.tobytes() == alone.outputs.tobytes()
            assert run.result.steps.y.tobytes() == alone.result.steps.y.tobytes()
            assert [jump.t for jump in run.jumps] == [jump.t for jump in alone.jumps]
            assert (run.status, run.reason) == (alone.status, alone.reason)


def test_jumps_of_a_sweep_are_judged_as_those_of_a_run():
    t_max = "interface.limits.tensile-strength.t_max"
    case = surfacechem.load("debonding")
    solution = case.sweep({t_max: ["20 MPa", "77.46 MPa", "1 GPa"]})
    data, single = solution.dataset, case.run({t_max: 20e6})
    assert data["destroys_entropy"].values.tolist() == [1, 0, 0]
    assert data["entropy_destroyed"].values.tolist() == [-single.dataset["event_entropy"].item(), 0, 0]
    assert "debond" in single.dataset.attrs["entropy_violations"]
    assert data["event_name"].values.tolist() == [["debond"], ["debond"], [""]]
    for name in ("event_time", "event_released", "T_before", "T_after"):
        assert data[name].dims == ("t_max", "event")
        assert data[name].values[0].tobytes() == single.dataset[name].values.tobytes()
        assert np.isnan(data[name].values[2]).all()
    (events,) = (line for line in str(sweep_summary(solution, None)).splitlines() if line.startswith("  events"))
    assert "2 debond; debond: destroys entropy in 1 of 3 runs, at worst -0." in events
    assert events.endswith("at t_max = 20 MPa")
    assert "no law destroys entropy, jumps do" in str(sweep_summary(solution, None))
    refused = surfacechem.load("debonding", {"interface.limits.tensile-strength.violation": "refuse"})
    data = refused.sweep({t_max: ["20 MPa", "77.46 MPa"]}).dataset
    assert not data["destroys_entropy"].any()
    assert "destroys entropy" in data["reason"].values[0]


@pytest.mark.parametrize(
    ("case", "path", "value", "written"),
    [
        ("press-hold-pull", "programme.hold.for", 3.0, "programme.hold.for"),
        ("press-hold-pull", "programme.approach.w_n", -2e-7, "programme.approach.w_n"),
        ("press-hold-pull", "programme.pull.until.theta_bond_s.falls-to", 1e-5, None),
        ("press-hold-pull", "programme.approach.until.p.rises-to", 2e3, "programme.approach.until.p"),
        ("debonding", "interface.limits.tensile-strength.t_max.value", 5e7, "interface.limits.tensile-strength.t_max"),
        ("debonding", "mechanics.normal.k", 2e13, None),
        ("sliding-dry", "loading.v", 0.01, "loading.v.level"),
        ("exothermic", "bodies.lower.C", 1e3, None),
    ],
)
def test_paths_of_a_sweep_are_those_of_the_case(case, path, value, written):
    simulation = surfacechem.load(case)
    assert simulation.plan({path: [value]}).axes[0].path == (written or path)
    if path != "mechanics.normal.k":
        changed = surfacechem.load(case, {path: value}).model.values()
        assert changed == simulation.model.values(simulation._values({path: value}))


@pytest.mark.parametrize(
    ("case", "path"),
    [
        ("stick-slip", "mechanics.tangential.m"),
        ("slow-passage", "mechanics.normal.c_g"),
        ("cohesive-pull-off", "mechanics.normal.k"),
    ],
)
def test_what_makes_a_gap_move_as_it_does_cannot_vanish(case, path):
    with pytest.raises(InputError, match=f"{path} = 0 is outside its range: > 0"):
        surfacechem.sweep(case, {path: [1.0, 0.0]})


def test_a_run_that_ends_at_its_start_leaves_the_others_alone(tmp_path):
    limit = "interface.limits.tensile-strength"
    case = surfacechem.load("debonding-cooling", {f"{limit}.violation": "refuse", "loading.w_n.ramp.start": "1 um"})
    swept = case.sweep({f"{limit}.t_max": ["1 kPa", "1 GPa"]})
    data = swept.dataset
    assert list(data["status"].values) == ["stopped", "finished"]
    assert data.attrs["reason"].startswith("1 stopped (")
    assert data.attrs["reason"].endswith("), 1 finished")
    assert data["reason"].values[0].removesuffix(" at t = 0 s") in data.attrs["reason"]
    assert data["reason"].values[0].endswith("which destroys entropy at t = 0 s")
    assert data["T"].values[0, 0] == data["T"].values[1, 0]
    assert np.isnan(data["T"].values[0, 1:]).all()
    assert np.isnan(data["error"].values[0])
    assert np.isfinite(data["error"].values[1])
    assert swept.write(tmp_path / "swept.nc").exists()


REFUSED = [
    ({"nothing": [1.0]}, None, r"no parameter 'nothing' to sweep. Nearest"),
    ({RATE: {"from": 1e-12, "to": 1e-9}}, None, r"a range needs `points`"),
    ({RATE: {"from": "-1 pN/s", "to": "1 pN/s", "points": 3, "spacing": "logarithmic"}}, None, r"ends above zero"),
    ({RATE: {"from": "1 pN", "to": "2 pN", "points": 3}}, None, r"1 pN is a force"),
    ({RATE: {"from": 1, "to": 2, "points": 3, "step": 4}}, None, r"unknown key 'step'"),
    ({RATE: []}, None, r"needs finite values, at least one"),
    ({RATE: [1e-12, 1e-12]}, None, r"has a value twice"),
    ({RATE: [-1e-12]}, None, r"f never reaches 2e-10"),
    ({}, None, r"a sweep needs `over`"),
    ({"initial.phi": [1.0, 2.0]}, None, r"phi rose above its bound 1.* This is the run with initial.phi = 2; a store"),
    (None, {"T_c": "310 K"}, r"T_c is no ramp"),
    (None, {"v": "1 m/s"}, r"no law reads a prescribed v"),
    (None, {"x": "1 m/s"}, r"sweep.until: unknown key 'x'"),
    (None, {"f": "1 pN", "t_n": "1 Pa"}, r"`until` is one prescribed variable"),
]


@pytest.mark.parametrize(("over", "until", "message"), REFUSED)
def test_bad_sweeps_are_refused(over, until, message):
    with pytest.raises(InputError, match=message):
        surfacechem.sweep("force-spectroscopy", over, until)


TABLE = "loading.f={table: {times: [0, 1], values: [0, 1]}}"
PULLED = """
interface: {temperature: 25 degC, bonding: [bell: {k_off: 1 1/s, x_off: 0.3 nm}]}
loading: {f: {ramp: {rate: 10 pN/s}}}
initial: {phi: 1}
run: {until: 2 s}
sweep:
  until: {f: 40 pN}
  over:
    interface.bonding.bell.x_off: [0.1 nm, 0.2 nm]
    interface.bonding.bell.k_off: [1 1/s, -1 1/s]
"""


@pytest.mark.parametrize(
    ("changes", "given", "message"),
    [
        ("", {}, "case.yaml:10: .*k_off = -1 is outside .* run with .*x_off = 0.1 nm, .*k_off = -1 1/s; a store"),
        ("", {"over": {"interface.bonding.bell.k_off": [1, -1]}}, "override: .*k_off = -1 is outside its range"),
        (
            "",
            {"over": {"interface.bonding.bell.k_off": [1], "initial.phi": {"from": 0, "too": 1}}},
            "override: sweep.over.initial.phi: unknown key 'too'",
        ),
        ("loading.f=10 pN", {"over": {"initial.phi": [0.5, 1]}}, "case.yaml:7: f is no ramp"),
        ("loading.f=10 pN", {"until": {"f": "20 pN"}}, "override: f is no ramp"),
        (TABLE, {"over": {"loading.f": [1, 2]}}, "override: .*loading.f cannot be swept: it is a table of times"),
    ],
)
def test_what_is_wrong_in_a_sweep_is_where_it_is_given(changes, given, message):
    with pytest.raises(InputError, match=f"^{message}"):
        surfacechem.load(PULLED, [changes] if changes else []).sweep(**given)


def test_a_case_without_a_sweep(bonding):
    with pytest.raises(InputError, match=r"a sweep needs `sweep: {over: ...}` in the case"):
        bonding.sweep()
    with pytest.raises(InputError, match="unknown key 'ovr'"):
        cases.load("exothermic", {"sweep": {"ovr": {}}})


def test_command_line(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    options = ["--over", f"{RATE}=[1 pN/s, 1 nN/s]", "--until", "f=150 pN", "-o", "s.nc"]
    done = CliRunner().invoke(app, ["sweep", "force-spectroscopy", *options])
    assert done.exit_code == 0, done.output
    labels = ["swept", "solved", "ended", "error", "time", "balances", "written"]
    assert [line.split()[0] for line in done.stdout.splitlines()[1:]] == labels
    assert "rate (1 to 1000 pN/s, 2 values), each until f = 1.5e-10 N" in done.stdout
    with xarray.open_dataset("s.nc") as data:
        assert data["phi"].dims == ("rate", "f")


def test_why_an_error_is_not_known_is_said_once(tmp_path):
    """Where friction at rest is that of sliding, when it slips is not known: a second run slips at other times."""
    case = surfacechem.load("stick-slip", ["run.rtol=1e-12", "run.until=1.2 s"])
    swept = case.sweep({"interface.friction.coulomb.mu": [0.3, 0.6]})
    why = "unknown in 1 run: a second run at rtol 1e-13, which had other events"
    assert swept.accuracy.unknown.startswith(why)
    assert str(sweep_summary(swept, None).facts).count(why) == 1
    _, (*_, error, told) = sweep_summary(swept, None, details=True).tables["Runs"]
    assert error == "error unknown"
    assert f"; {why.replace(' in 1 run', '')}" in told
    assert why in swept.dataset.attrs["error_source"]
    stream = case.stream(swept.plan, tmp_path / "s.zarr")
    stream.run()
    checked = check(stream)
    assert checked.unknown == 1
    assert checked.why in case.run({"interface.friction.coulomb.mu": 0.6}).accuracy.source


def test_species_of_a_sweep_have_the_names_of_the_mechanism():
    data = surfacechem.load("dna-adhesive").sweep({"T_0": [298.0, 299.0]}).dataset
    assert data["coverage"].dims == ("T_0", "time", "species")
    np.testing.assert_array_equal(data["coverage"].sel(species="bond(s)"), data["theta_bond_s"])


CUT_OFF = """
T_0: 300 K
bodies: {a: {temperature: T, C: 10 J/m^2/K}, b: {temperature: T, C: 10 J/m^2/K}}
interface:
  temperature: T
  potential: [penalty: {E_n: 1e13 Pa/m}]
  friction: [mohr-coulomb: {mu: 0.5, t_n_max: 0.2 MPa, c: 0.1 MPa}]
mechanics: {normal: {k: 1e12 Pa/m}}
loading: {w_n: {ramp: {start: -1 um, rate: 0.1 um/s}}, v: 1 um/s}
initial: {T: 300 K}
run: {until: 1 s}
"""


def test_a_parameter_that_is_called_like_an_extreme_is_told_from_it(tmp_path):
    case = surfacechem.load(CUT_OFF)
    swept = case.sweep({"interface.friction.mohr-coulomb.t_n_max": ["0.1 MPa", "0.2 MPa"]})
    stored = case.stream(swept.plan, tmp_path / "s.zarr").run().dataset
    for data in (swept.dataset, stored, xarray.load_dataset(swept.write(tmp_path / "s.nc"))):
        assert data["mohr_coulomb_t_n_max"].values.tolist() == [1e5, 2e5]
        assert data["t_n_max"].dims == ("mohr_coulomb_t_n_max",)
        np.testing.assert_allclose(data["t_n_max"], -8.1818e5, rtol=1e-4)


@pytest.mark.parametrize("name", ["force-spectroscopy", "stick-slip-debonding", "dna-adhesive"])
def test_no_parameter_is_called_like_a_column(name, tmp_path, spectrum):
    case = surfacechem.load(name)
    swept = spectrum if name == "force-spectroscopy" else case.sweep({"T_0": [298.0, 299.0]})
    stored = case.stream(swept.plan, tmp_path / "s.zarr").run().dataset
    names = {str(each) for data in (swept.dataset, stored) for each in (*data.variables, *data.dims)}
    names -= set(swept.parameters)
    found = parameter_names(swept.system, SimpleNamespace(paths=[f"law.{each}" for each in names]))
    assert len(found) == len(names) > 50
    assert names.isdisjoint(found)


def test_a_sweep_that_misses_the_accuracy_that_was_asked_for_says_so():
    done = surfacechem.load("cohesive-cycles").sweep({"bodies.lower.C": [0.001]})
    assert done.accuracy.errors[0] > 1e-8
    assert "1e-08 was asked, which takes a tighter `rtol`" in done.accuracy.source


def test_outputs_on_the_last_of_the_way_to_a_fold_are_before_it():
    """Runs that snap at one time but for a digit share outputs there."""
    done = surfacechem.load("snap-in").sweep({"initial.T": [300.0, 303.0]})
    assert done.accuracy.errors.max() < 1e-7
    for run in done.runs:
        states = [run.result.outputs[run.result.times < jump.t][-1] for jump in run.jumps]
        for state, jump in zip(states, run.jumps, strict=True):
            assert abs(state[0] - jump.before.y[0]) < 0.1 * abs(jump.after.y[0] - jump.before.y[0])
