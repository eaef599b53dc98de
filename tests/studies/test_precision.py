"""Error against run time: errors fall with the tolerance, references know how uncertain they are, nothing is hidden."""

import re
import shlex
from dataclasses import replace

import numpy as np
import pytest
import xarray
from matplotlib.figure import Figure
from typer.testing import CliRunner

import surfacechem
from surfacechem.cli.main import app
from surfacechem.errors import InputError
from surfacechem.plots import figure
from surfacechem.plots.study import LABEL_VARIABLES
from surfacechem.solve.adapters import sundials
from surfacechem.studies import precision
from surfacechem.studies.precision import Subject, establish, numerical
from surfacechem.studies.report import LIBRARIES, Study

pytestmark = pytest.mark.around


@pytest.fixture(autouse=True)
def quick_methods(monkeypatch, request):
    """References of the two quicker methods, but in slow tests of all."""
    if "slow" not in request.keywords:
        monkeypatch.setattr(precision, "REFERENCE_METHODS", ("radau", "lsoda"))


@pytest.fixture
def blank(monkeypatch):
    """Figures without anything, where they are not what is tested."""
    monkeypatch.setattr(Study, "figure", lambda _: Figure())


def run(*arguments, **more):
    return surfacechem.precision(*arguments, repeat=1, **more)


@pytest.fixture(scope="module")
def study():
    return run("exothermic", ["radau", "lsoda"], [1e-4, 1e-7, 1e-10])


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    found = run(["exothermic", "sliding-dry"], ["radau", "lsoda"], [1e-4, 1e-8])
    return found, found.write(tmp_path_factory.mktemp("study") / "two.nc")


@pytest.fixture(scope="module")
def data(study):
    return study.dataset.set_index(LABEL_VARIABLES)


def subject_of(name, *overrides):
    return precision.subject(surfacechem.load(name, list(overrides)))


# -- errors ------------------------------------------------------------------------------------------------------------


def test_the_times_of_events_have_errors():
    found = run("coulomb-stop", ["radau", "cvode"], [1e-5, 1e-9]).dataset
    errors, limit = found["error_event"].values[0], found["uncertainty_event"].values[0]
    assert np.all(np.isfinite(errors))
    assert np.all(errors[:, 1] <= np.maximum(errors[:, 0], limit))
    assert limit < 1e-9


# -- references --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("rtol", "override", "source", "limit"),
    [
        (1e-13, "reference=", r"\S+ and \S+, extrapolated from rtol 1e-12 and 1e-13", 1e-11),
        (
            1e-6,
            "reference=sliding",
            ".*the exact solution sliding does not apply to this scene: it says nothing of phi.*",
            1,
        ),
    ],
)
def test_a_case_without_an_exact_solution_says_what_it_is_held_against(rtol, override, source, limit):
    data = run("exothermic", ["radau"], [rtol], overrides=[override]).dataset
    assert re.fullmatch(source, str(data["reference"].values[0]))
    assert 0 < float(data["uncertainty_max"][0]) < limit


@pytest.mark.usefixtures("blank")
def test_methods_that_do_not_agree_give_no_reference(monkeypatch, tmp_path):
    limit = precision._limit
    shifts = iter(np.linspace(0.0, 1.0, 1000))
    monkeypatch.setattr(precision, "_limit", lambda loose, tight: limit(loose, tight) * (1 + next(shifts)))
    target = tmp_path / "none.nc"
    options = ["--solvers", "radau", "--tolerances", "1e-6", "--repeat", "1", "--set", "reference=", "-o", str(target)]
    done = CliRunner().invoke(app, ["precision", "exothermic", *options])
    assert done.exit_code == 4
    assert "has no reference: the methods that agree best" in done.output
    with xarray.open_dataset(target) as data:
        assert np.isnan(data["error_max"]).all()
        assert np.isfinite(data["energy_error"]).all()
        assert data.attrs["status"] == "failed"


def test_a_method_that_fails_is_no_reference(monkeypatch):
    monkeypatch.setattr(precision, "REFERENCE_METHODS", ("radau", "scipy-radau", "lsoda"))
    subject = subject_of("exothermic", "reference=")
    original = type(subject.model).solve

    def failing(model, run, changes=None):
        if run.solver == "scipy-radau":
            raise ArithmeticError("lost")
        return original(model, run, changes)

    monkeypatch.setattr(type(subject.model), "solve", failing)
    assert numerical(subject, ["T"]).source.startswith("radau and lsoda")


# -- what failed and what was left out ---------------------------------------------------------------------------------


@pytest.mark.usefixtures("blank")
def test_a_failing_solver_is_shown_as_failed():
    few = run("exothermic", ["radau", "bdf"], [1e-10], overrides=["run.max-steps=40"])
    data = few.dataset.isel(case=0, tolerance=0)
    assert list(data["status"].values) == ["finished", "failed"]
    assert np.isnan(data["error_max"].values[1])
    assert data["count_steps"].values[1] == 40
    for text in (str(data["reason"].values[1]), few.page.text(), few.page.html()):
        assert "the number of steps allowed was used up" in text
    assert re.search(r"bdf\W.*1e-10\W.*failed", few.page.text())
    assert "tr class=marked" in few.page.html()


def test_a_solver_that_raises_is_shown_as_failed(monkeypatch):
    def broken(*_):
        raise RuntimeError("CVODE had a bad day")

    monkeypatch.setattr(sundials.CVODESolver, "solve", broken)
    data = run("exothermic", ["radau", "cvode"], [1e-6]).dataset
    assert list(data["status"].values.ravel()) == ["finished", "failed"]
    assert "CVODE had a bad day" in str(data["reason"].values[0, 1, 0])


def test_a_run_with_other_events_has_failed():
    subject = subject_of("coulomb-stop")
    truth, trajectory = establish(subject, ["T"]), subject.solve("radau", 1e-8)
    early = trajectory.result._replace(times=trajectory.result.times[:3])
    for changes, objection in (
        ({}, ""),
        ({"jumps": ()}, "other events"),
        ({"result": early}, "ended elsewhere than the reference"),
        ({"status": "stopped"}, "ended otherwise than the reference"),
    ):
        found = truth.objection(replace(trajectory, **changes))
        assert found.startswith(objection)
        assert bool(found) == bool(objection)


def test_a_solver_that_cannot_run_a_case_is_left_out(monkeypatch):
    reason = "rates of the mechanism come from Cantera itself, which this solver cannot ask"
    monkeypatch.setattr(Subject, "unable", lambda _, name: reason if name == "ida" else "")
    study = run("exothermic", ["radau", "ida"], [1e-6])
    assert list(study.dataset["status"].values.ravel()) == ["finished", "omitted"]
    assert np.isnan(study.dataset["count_steps"].values.ravel()[1])
    for text in (study.page.text(), study.page.html()):
        assert f"exothermic: ida: {reason}" in text
    assert "ida (left out)" in study.page.html()


# -- the dataset and the report ----------------------------------------------------------------------------------------


def test_opens_plainly_over_case_solver_and_tolerance(written):
    study, (target, *_) = written
    with xarray.open_dataset(target) as opened:
        xarray.testing.assert_identical(opened.load(), study.dataset)
        assert opened["error_max"].dims == ("case", "solver", "tolerance")
        assert list(opened["case_name"].values) == ["exothermic", "sliding-dry"]
        by_name = opened.set_index(LABEL_VARIABLES)
        assert np.isnan(by_name["variable_error_max"].sel(case="sliding-dry", variable="phi")).all()
        assert all(item.attrs["long_name"] for item in opened.variables.values())
        # Texts have no unit.
        assert all(bool(item.attrs.get("units")) == (item.dtype.kind not in "OU") for item in opened.variables.values())


@pytest.mark.slow
def test_follows_the_cf_conventions(written):
    runner = pytest.importorskip("compliance_checker.runner")
    suite = runner.CheckSuite()
    suite.load_all_available_checkers()
    results, problems = suite.run_all(suite.load_dataset(str(written[1][0])), ["cf:1.11"])["cf:1.11"]
    assert problems == {}
    assert [message for result in results for message in result.msgs] == []


def test_hollow_marks_are_below_the_uncertainty(study):
    plot = figure(study.dataset.assign(uncertainty_max=study.dataset["uncertainty_max"] * 0 + 1e-6))
    marks = [line for line in plot.axes[0].lines if line.get_linestyle() == "None"]
    hollow = np.concatenate([line.get_xdata() for line in marks if line.get_markerfacecolor() == "white"])
    solid = np.concatenate([line.get_xdata() for line in marks if line.get_markerfacecolor() != "white"])
    assert 0 < len(hollow) == np.count_nonzero(hollow < 1e-6)
    assert np.all(solid[np.isfinite(solid)] >= 1e-6)
    assert any(handle.get_text() == "below the uncertainty of the reference" for handle in plot.legends[0].get_texts())
    plot = figure(study.dataset.assign(energy_error=study.dataset["energy_error"] * 0))  # nothing to show of it
    assert [ax.get_xlabel() for ax in plot.axes] == ["largest relative error"]


def test_the_report_contains_everything(written):
    study, (_, svg, png, page) = written
    text = page.read_text()
    assert svg.read_text().startswith("<?xml")
    for word in ("exothermic", "sliding-dry", "largest relative error", "run time [s]", "energy residual", "lsoda"):
        assert f"<!-- {word} -->" in svg.read_text()
    assert png.read_bytes().startswith(b"\x89PNG")
    words = [study.command, "<svg", "How it was measured", "Left out", "processor", "warms", *LIBRARIES]
    for case in study.axes["case"]:
        words += [case.reference, f"uncertain  final {case.uncertainty('final'):.1e}"]
        words.append(case.subject.case.text.splitlines()[0])
    words += [f"<td>{solver}</td><td>1e-08</td>" for solver in study.axes["solver"]]
    assert [word for word in words if word not in text] == []
    assert not re.search(r'(src|href)="(?!#)', text)


@pytest.mark.usefixtures("blank")
def test_the_command_holds_whatever_was_given_from_python(tmp_path, monkeypatch):
    """A case by its path, a tolerance of many digits, nothing instead of a reference, a nested value."""
    path = tmp_path / "a case.yaml"
    path.write_text(surfacechem.load("exothermic").case.text)
    changes = {"reference": None, "loading": {"p": "3 Pa"}, "run.until": np.int64(1), "run.rtol": "1e-7"}
    study = run(path, ["radau"], [1.23456789e-7], overrides=changes)
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(app, shlex.split(study.command)[1:])
    assert done.exit_code == 0, done.output
    with xarray.open_dataset("precision.nc") as found:
        for name in ("tolerance", "error_max", "reference"):
            np.testing.assert_array_equal(found[name], study.dataset[name])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["exothermc"], "Did you mean 'exothermic'?"),
        (["exothermic", "--solvers", "radua"], "solvers: no solver 'radua'. Did you mean 'radau'?"),
        (["exothermic", "--solvers", ","], "solvers: at least one is needed."),
        (["exothermic", "--tolerances", "tight"], "--tolerances: 'tight' are no tolerances"),
        (["exothermic", "--tolerances", "1e-4..0"], "--tolerances: '1e-4..0' is no range of tolerances"),
        (["exothermic", "--tolerances", "1e-4..inf"], "--tolerances: '1e-4..inf' is no range of tolerances"),
        (["exothermic", "--tolerances", "1e-320..1"], "tolerances: 1 is outside its range: >= 1e-13 and <= 0.1."),
        (["exothermic", "--tolerances", "2"], "tolerances: 2 is outside its range: >= 1e-13 and <= 0.1."),
        (["exothermic", "--tolerances", "1e-20"], "tolerances: 1e-20 is outside its range: >= 1e-13 and <= 0.1."),
        (["exothermic", "--variables", "phii"], "variables: no variable 'phii' in the cases. Did you mean 'phi'?"),
        (["exothermic", "--repeat", "0"], "repeat: 0 is outside its range: >= 1"),
        (["exothermic", "exothermic"], "the case exothermic is given twice."),
        (["exothermic", "-o", "nowhere/x.nc"], "there is no folder"),
        (["exothermic", "--set", "initial.phi=2"], "phi"),
    ],
)
def test_bad_input_is_refused_before_anything_runs(arguments, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("surfacechem.studies.precision.attempt", None)
    done = CliRunner().invoke(app, ["precision", *arguments])
    assert done.exit_code == 2, done.output
    assert message in done.output
    assert list(tmp_path.iterdir()) == []


def test_no_case_is_no_study():
    with pytest.raises(InputError, match="cases: at least one is needed"):
        surfacechem.precision([])
