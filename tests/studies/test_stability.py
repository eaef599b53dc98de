"""The stability matrix: its expectations hold for our solver, and what does not hold is seen."""

from dataclasses import replace

import numpy as np
import pytest
import xarray
from sampling import every
from typer.testing import CliRunner

from surfacechem.cli.main import app
from surfacechem.runs.simulation import Simulation
from surfacechem.runs.summaries import run_summary
from surfacechem.solve import names
from surfacechem.studies.regimes import Exact, Refused, Stops, regimes
from surfacechem.studies.stability import (
    FAILED,
    REFUSED,
    SENSITIVE,
    SOLVED,
    STUDY_RTOL,
    WRONG,
    digits_left,
    prepared,
    read,
    stability,
    thinned,
    worst_corner,
)
from surfacechem.studies.stability import LEAST as LEAST_DIGITS

pytestmark = pytest.mark.around

BROKEN = {
    # A film of 1e-14 of its thickness: the last bit of the time is a tenth of the gap.
    ("film", 1e-14): FAILED,
    # Changes of the data grow by (T_0 / T)^2, and with the exponential of E_a / (R_g T).
    ("cold", 1e-6): SENSITIVE,
    ("runaway", 200.0): SENSITIVE,
}
"""Where each regime ends; what is listed here and holds is a failure of the test."""

SENSITIVE_CELLS = [place for place, outcome in BROKEN.items() if outcome == SENSITIVE]

LEAST = {"cold": 2.5, "runaway": 7.0, "film": 6.5, "debonding": 8.5, "fold": 8.5, "endothermic": 8.5}
"""Digits that the regime itself leaves at rtol 1e-10; elsewhere nine and a half."""

CELLS = [(name, value) for name, regime in regimes().items() for value in thinned(regime.values)]
ALL = [(name, value) for name, regime in regimes().items() for value in regime.values]


@pytest.mark.parametrize(
    ("name", "value"), [*CELLS, *(pytest.param(*cell, marks=pytest.mark.slow) for cell in ALL if cell not in CELLS)]
)
def test_what_is_expected_of_a_regime_holds(name, value):
    cell = prepared(regimes()[name].problem(value))("radau")
    expected = regimes()[name].problem(value).expected
    right = SOLVED if isinstance(expected, Exact) else REFUSED
    assert cell.outcome == BROKEN.get((name, value), right), cell
    if cell.outcome == right:
        # No method keeps digits that the last ones of the data do not leave.
        assert cell.digits > min(LEAST.get(name, 9.5), digits_left(cell.condition, np.finfo(float).eps)), cell
    if cell.outcome != FAILED and np.isfinite(cell.condition):
        assert cell.digits > digits_left(max(cell.condition, 1.0), STUDY_RTOL) - 0.5, cell


BEYOND = [("chatter", 1e3), ("stop", 1e-15), *(cell for cell in CELLS if cell[0] == "rupture")]
"""Slips as close as events can be told, a way below the absolute tolerance, bonds that run away before they rupture."""
OTHERS = [(*cell, solver) for solver in names if solver != "radau" for cell in CELLS if cell not in BEYOND]


@pytest.mark.parametrize(("name", "value", "solver"), every(40, OTHERS))
def test_another_solver_is_right_or_no_success(name, value, solver):
    cell = prepared(regimes()[name].problem(value), rtol=1e-8)(solver)
    assert cell.outcome in (SOLVED, REFUSED, SENSITIVE, FAILED), cell
    if cell.outcome == SOLVED:
        assert cell.digits > min(5.0, digits_left(max(cell.condition, 1.0), 1e-8) - 1.5), cell


@pytest.mark.parametrize("name", every(6, [name for name, regime in regimes().items() if regime.space]))
def test_random_corners_are_solved(name):
    corner = worst_corner(regimes()[name], rounds=1)
    assert corner.unsolved == 0, corner
    assert corner.cell.digits > 8.0, corner


@pytest.mark.slow
def test_a_search_finds_the_same_corner_again():
    first, second = (worst_corner(regimes()["bell"], rounds=1, seed=1) for _ in range(2))
    assert first.point == second.point
    assert worst_corner(regimes()["bell"], rounds=0, seed=2).point != first.point


def expecting(name: str, value: float, expected):
    return prepared(regimes()[name].problem(value)._replace(expected=expected))("radau")


def test_wrong_expectations_are_caught():
    for name, value, expected, outcome in (
        ("seconds", 1.0, Exact(lambda t: {"T": np.full_like(t, 250.0)}), WRONG),
        ("stop", 1.0, Exact(lambda t: {"v": 0 * t}, events=2), WRONG),
        ("film", 0.0, Stops("g_n reached zero", 20.0), WRONG),
        ("film", 0.0, Stops("the temperature T reached zero", 10.0), WRONG),
        ("film", 0.0, Exact(lambda t: {"T": 300.0 + 0 * t}), FAILED),
        ("seconds", 1.0, Refused("capacity"), WRONG),
        ("endothermic", 0.0, Refused("no such reason"), FAILED),
        ("endothermic", 0.0, Exact(lambda t: {"T": 0 * t}), FAILED),
    ):
        cell = expecting(name, value, expected)
        assert cell.outcome == outcome, cell
        if name == "stop":
            assert cell.reason == "1 events, not 2"


def test_budgets_and_libraries_fail_without_an_exception():
    cell = prepared(regimes()["runaway"].problem(200.0))("cvode")
    assert (cell.outcome, cell.digits) == (FAILED, 0.0)
    assert "the number of steps allowed was used up" in cell.reason
    cell = prepared(regimes()["cold"].problem(1e-4), 1e-6)("lsoda")  # which would step on where it stands
    assert (cell.outcome, cell.digits) == (FAILED, 0.0)
    assert "the temperature T reached zero" in cell.reason


@pytest.mark.parametrize(("name", "value"), SENSITIVE_CELLS)
def test_fewer_than_two_digits_are_the_condition_of_the_problem(name, value):
    cell = prepared(regimes()[name].problem(value))("radau")
    assert digits_left(cell.condition, STUDY_RTOL) < LEAST_DIGITS
    tight = prepared(regimes()[name].problem(value), rtol=1e-13)("radau")
    assert tight.digits > digits_left(cell.condition, np.finfo(float).eps) - 0.5  # nothing but rounding is lost then


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """The study that the command makes, and the folder of what it writes."""
    studies, folder = [], tmp_path_factory.mktemp("stability")

    def kept(*regimes, **options):
        studies.append(stability(*regimes, **options))
        return studies[-1]

    options = ["--solvers", "radau,ida", "--search", "0", "--quick", "-o", str(folder / "study")]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("surfacechem.studies.stability.stability", kept)
        done = CliRunner().invoke(app, ["stability", "seconds", "ignition", *options])
    assert done.exit_code == 0, done.output
    assert "study.nc, " in done.output
    return studies[0], folder


def test_another_suffix_is_refused_before_anything_is_solved(tmp_path):
    done = CliRunner().invoke(app, ["stability", "seconds", "-o", str(tmp_path / "study.txt")])
    assert done.exit_code == 2
    assert "not as '.txt'. Give study." in done.output
    assert not list(tmp_path.iterdir())


def test_the_dataset_holds_every_cell(made):
    _, folder = made
    assert sorted(file.suffix for file in folder.iterdir()) == [".html", ".nc", ".png", ".svg"]
    with xarray.open_dataset(folder / "study.nc") as data:
        assert dict(data["digits"].sizes) == {"regime": 2, "decade": 4, "solver": 2}
        assert data["regime"].values.tolist() == ["seconds", "ignition"]
        assert data["outcome"].sel(regime="ignition", solver="radau").values.tolist()[-1] == REFUSED
        assert data["value"].sel(regime="seconds").values[0] == 1e-15
        assert float(data["digits"].sel(regime="seconds", solver="radau").min()) > 9.5
        assert data["condition"].dims == data["possible"].dims == ("regime", "decade")
        assert 1 < float(data["condition"].sel(regime="seconds").max()) < 20
        assert float(data["possible"].sel(regime="seconds").min()) > 14
        assert data.attrs["command"] == "surfacechem stability seconds ignition --solvers radau,ida --quick --search 0"
        assert data.attrs["versions"].startswith("surfacechem ")


def test_the_report_says_what_every_solver_keeps_and_what_was_left_out(made, monkeypatch):
    study, _ = made
    text, html = study.page.text(), study.page.html()
    assert "Least digits kept over all values, at rtol 1e-10" in text
    assert "tau [s]: 1e-15 .. 1e+15" in text
    for words in ("condition", "possible", "at rtol 1e-10"):
        assert words in text
        assert words in html
    assert "Every cell" not in text
    assert "no temperature T_c balances the heat" in html
    assert "<svg" in html
    assert "8 of 16 values of the regimes, for the sake of time" in text
    assert "the solvers dop853, lsoda, bdf, scipy-radau, cvode, cantera, which were not asked for" in text
    assert "the search for worst corners, which was not asked for" in text
    assert "steps of a run" not in text
    monkeypatch.setitem(regimes(), "seconds", regimes()["seconds"]._replace(values=(1.0,), space={}))
    everything = stability("seconds", solvers=names, rounds=1)
    assert everything.page.omissions == []
    assert "<p>Nothing.</p>" in everything.page.html()


def test_the_figure_holds_regimes_solvers_and_marks(made):
    study, folder = made
    text = (folder / "study.svg").read_text()
    for word in ("seconds", "ignition", "radau", "ida", "R  ended for the right reason", "digits", "possible"):
        assert f"<!-- {word} -->" in text
    plot = study.figure()
    plot.draw_without_rendering()
    legend = plot.legends[0].get_window_extent()
    assert 0 <= legend.x0 < legend.x1 <= plot.bbox.width  # however few values a regime has
    done = CliRunner().invoke(app, ["plot", str(folder / "study.nc"), "--variables", "digits"])
    assert done.exit_code == 2
    assert "the figure of a study has no choice of variables" in done.output


def test_runs_that_take_too_many_steps_are_counted_and_a_study_tells_what_it_is_at(monkeypatch, caplog):
    monkeypatch.setattr("surfacechem.studies.stability.STEPS", 20)
    with caplog.at_level("INFO", "surfacechem"):
        found = stability("capacity", solvers=["radau"], quick=True, rounds=0)
    assert "what lies beyond 20 steps of a run: 4 took as many, and count as failed" in found.page.omissions
    assert caplog.messages == ["capacity: 4 values"]


@pytest.mark.parametrize(("name", "value"), SENSITIVE_CELLS)
def test_where_an_answer_has_no_digits_the_summary_of_the_run_says_so(name, value):
    case = read(regimes()[name].problem(value))
    solution = Simulation(replace(case, own_run=replace(case.run, rtol=1e-10))).run()
    unknown = "ended earlier" in solution.accuracy.source
    assert unknown or solution.accuracy.error > 10.0**-LEAST_DIGITS
    assert any("error" in warning for warning in solution.warnings), solution.warnings
    assert "warning" in str(run_summary(solution, None))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("endotermic",), "no regime 'endotermic'. Did you mean 'endothermic'?"),
        (("seconds", "--solvers", "radua"), "no solver 'radua'. Did you mean 'radau'?"),
        (("seconds", "--rtol", "2"), "--rtol: 2 is outside its range"),
        (("seconds", "--search", "-1"), "--search: -1 is outside its range: >= 0"),
        (("seconds", "--solvers", ","), "--solvers: at least one is needed."),
    ],
)
def test_names_get_the_nearest_guess(arguments, message):
    done = CliRunner().invoke(app, ["stability", *arguments])
    assert done.exit_code == 2
    assert message in done.output
