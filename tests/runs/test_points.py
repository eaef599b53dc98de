"""Quantities at given states: against formulas, against runs, and derivatives against differences."""

import numpy as np
import pandas
import pytest
import xarray
from typer.testing import CliRunner

import surfacechem
from surfacechem.cli import app
from surfacechem.errors import InputError
from surfacechem.runs.points import read_points
from surfacechem.studies.precision import precision

pytestmark = pytest.mark.around

ELEMENT = """
title: A contact element, all of it prescribed
T_0: 300 K
bodies:
  lower: {temperature: 300 K, C: 1 kJ/m^2/K}
  upper: {temperature: 320 K}
interface:
  temperature: 310 K
  sites: 1e17 1/m^2
  potential:
    - bond-stiffness: {E_b: 2 MPa/um, E_n: 50 MPa/um}
    - bond-energy: {K_2: 30 J/m^2}
  friction:
    - coulomb: {mu: 0.3}
heat:
  - conductance: {between: [lower, interface], h: 100 W/m^2/K}
  - conductance: {between: [upper, interface], h: 250 W/m^2/K}
loading: {g_n: -1 nm, v: 1 mm/s, phi: 0.5}
run: {until: 1 s}
"""

STUCK = """
bodies: {lower: {temperature: 300 K}, upper: {temperature: 300 K}}
interface: {potential: [tangential-stiffness: {E_t: 1e13 Pa/m}], friction: [coulomb: {mu: 0.5}]}
mechanics: {tangential: {k: 1e13 Pa/m}}
loading: {p: 1 MPa, w_t: 10 nm}
"""
HUNG = """
bodies: {lower: {temperature: 300 K}, upper: {temperature: 300 K}}
interface: {potential: [exponential-cohesive-zone: {t_max: 1 MPa, g_0: 10 nm, E_n: 1e15 Pa/m}]}
loading: {F_n: 0.2 MPa}
initial: {g_n: 0.2 nm}
"""

POINTS = {
    "element": {"g_n": -2e-9, "phi": 0.3, "v": 2e-3},
    "three-temperatures-no-capacity": {},
    "dna-adhesive": {"theta_bond_s": 0.4, "theta_free_s": 0.5, "T_1": 305.0, "T_2": 330.0},
    "generalised-bonding-sliding": {"phi": 0.4, "T": 310.0},
    "cohesive-cycles": {"w_n": 3e-8},
    "held": {"w_t": 2e-8},
}


@pytest.fixture
def element(tmp_path):
    path = tmp_path / "element.yaml"
    path.write_text(ELEMENT)
    return surfacechem.load(path)


@pytest.mark.parametrize("name", POINTS)
def test_derivatives_are_those_of_the_values(name, element):
    """Central differences of fourth order agree, to the rounding of the values."""
    own = {"element": element, "held": name == "held" and surfacechem.load(STUCK)}
    simulation, at = own.get(name) or surfacechem.load(name), POINTS[name]
    first = simulation.evaluate(at)
    given = [key for key in simulation.evaluator.given if key in first and np.any(first[key])]
    for key in given:
        x = float(first[key][0])
        h = 1e-3 * x
        moved = simulation.evaluate(at | {key: x + h * np.array([-2.0, -1.0, 0.0, 1.0, 2.0])})
        for slope in (slope for slope in moved if str(slope).endswith(f"_by_{key}")):
            of = str(slope).removesuffix(f"_by_{key}")
            y = moved[of].values
            difference = (8 * (y[3] - y[1]) - (y[4] - y[0])) / (12 * h)
            size = np.max(np.abs(y)) / abs(x)
            assert float(moved[slope][2]) == pytest.approx(difference, rel=1e-6, abs=1e-9 * size), slope


def test_points_of_a_run_give_its_dataset():
    simulation = surfacechem.load("three-temperatures")
    run = simulation.run().dataset
    states = [state.name for state in simulation.system.states]
    found = simulation.evaluate({name: run[name].values for name in states})
    for name in simulation.system.output_columns:
        if name in found and name in run:
            size = np.max(np.abs(run[name]))
            assert found[name].values == pytest.approx(run[name].values, rel=1e-9, abs=1e-12 * float(size)), name


def test_what_is_algebraic_is_solved_for_unless_it_is_given():
    simulation = surfacechem.load("three-temperatures-no-capacity")
    solved, start = simulation.evaluate(), simulation.run().dataset
    assert float(solved["T_c"][0]) == pytest.approx(float(start["T_c"][0]), rel=1e-12)
    assert "q_1_by_T_c" not in solved
    given = simulation.evaluate({"T_c": solved["T_c"].values})
    assert float(given["q_1"][0]) == pytest.approx(float(solved["q_1"][0]), rel=1e-12)
    through = given["q_1_by_T_1"] + given["q_1_by_T_c"] * solved["T_c_by_T_1"]
    assert float(through[0]) == pytest.approx(float(solved["q_1_by_T_1"][0]), rel=1e-12)


def test_a_gap_without_inertia_is_in_balance_unless_it_is_given():
    simulation, w = surfacechem.load("cohesive-pull-off"), np.array([2e-8, 4e-8])
    found = simulation.evaluate({"w_n": w})
    assert found["g_n"].values == pytest.approx([0.76383023e-9, 1.66558e-9], rel=1e-5)
    assert found["t_n"].values == pytest.approx(1e13 * (w - found["g_n"].values), rel=1e-12)
    assert "t_n_by_g_n" not in found
    given = simulation.evaluate({"w_n": w, "g_n": found["g_n"].values})
    assert given["t_n"].values == pytest.approx(found["t_n"].values, rel=1e-12)
    through = 1e13 * given["t_n_by_g_n"] / (1e13 + given["t_n_by_g_n"])
    assert found["t_n_by_w_n"].values == pytest.approx(through.values, rel=1e-12)


@pytest.mark.parametrize("name", ["cohesive-cycles", "snap-in", "sticky-sphere", "van-der-waals-sphere"])
def test_the_point_at_the_start_is_that_of_a_run(name):
    simulation = surfacechem.load(name, ["run.until=1 ms"])
    start, run = simulation.evaluate(), simulation.run().dataset
    for quantity in ("g_n", "t_n", "E_total"):
        assert float(start[quantity][0]) == pytest.approx(float(run[quantity][0]), rel=1e-9)


def test_what_a_dead_load_hangs_from_bears_it_or_there_is_no_balance():
    found = surfacechem.load(HUNG).evaluate({"F_n": [2e5, 11e5]})
    assert float(found["t_n"][0]) == pytest.approx(2e5, rel=1e-12)
    assert found["admissible"].values.tolist() == [1, 0]
    assert str(found["reason"].values[1]).startswith("there is no gap at which the tractions are in equilibrium")
    assert np.isnan(found["g_n"][1])
    assert float(found["F_n"][1]) == 11e5


@pytest.mark.parametrize(("given", "gaps"), [({}, (5, 5)), ({"u_t": 2e-9}, (2, 0)), ({"g_t": 2e-9}, (8, 2))])
def test_what_sticks_follows_the_displacement_that_is_found(given, gaps):
    found = surfacechem.load(STUCK).evaluate(given)
    assert [1e9 * float(found[name][0]) for name in ("u_t", "g_t")] == pytest.approx(gaps, rel=1e-12)


def test_sliding_in_the_plane_has_the_direction_that_a_case_or_a_point_gives():
    simulation = surfacechem.load("anisotropic-slide")
    expected = {"v": 1.0, "v_2": 1.5, "t_t": 3328.20117735, "t_t2": 14976.9052981, "D_anisotropic_coulomb": 25793.5591}
    found, turned = simulation.evaluate(), simulation.evaluate({"v_2": [-1.5, 0.0], "v": [1.0, 2.0]})
    assert {name: float(found[name][0]) for name in expected} == pytest.approx(expected, rel=1e-9)
    assert turned["t_t2"].values == pytest.approx([-14976.9052981, 0], rel=1e-9)
    assert turned["v"].values == pytest.approx([1, 2], rel=1e-12)


def test_names_are_those_of_the_results_too():
    simulation = surfacechem.load("three-temperatures")
    told = simulation.evaluate({"Q_ext_c": 200})
    assert told.identical(simulation.evaluate({"Q_c": told["Q_ext_c"].values}))
    with pytest.raises(InputError, match="points give Q_c or Q_ext_c, not both"):
        simulation.evaluate({"Q_c": 1, "Q_ext_c": 1})


def test_a_point_is_the_scene_with_these_values(element, tmp_path):
    moved = surfacechem.load(tmp_path / "element.yaml", ["loading.g_n=3 nm", "interface.friction.coulomb.mu=0.5"])
    one = element.evaluate({"g_n": "3 nm", "interface.friction.coulomb.mu": 0.5})
    other = moved.evaluate()
    assert all(one[name].values == other[name].values for name in other)
    told = CliRunner().invoke(app, ["evaluate", str(tmp_path / "element.yaml")]).stdout
    assert "\n  t_n_by_g_n " in told
    assert "t_n_by_v" not in told  # a zero is counted, not listed
    assert "derivatives, which are not listed" in told


def test_points_where_a_law_does_not_hold_say_so(tmp_path):
    path = tmp_path / "points.csv"
    path.write_text("g_n [um]\n1\n-1\n")
    output = tmp_path / "found.nc"
    done = CliRunner().invoke(app, ["evaluate", "viscous-heating", str(path), "-o", str(output), "-q"])
    assert (done.exit_code, output.exists()) == (3, True)
    assert done.stderr.startswith("surfacechem: stopped: g_n reached zero, where the law viscous")
    found = surfacechem.load("viscous-heating").evaluate({"g_n": [1e-6, -1e-6]})
    assert found["admissible"].values.tolist() == [1, 0]
    assert found["reason"].values[1].startswith("g_n reached zero, where the law viscous")


@pytest.mark.parametrize(
    ("name", "given", "reason"),
    [
        ("stick-slip", {"u_t": [0.6e-3, -0.61e-3]}, "sticking gives way and the interface slides forward"),
        ("pulled-at-an-angle", {"w_t": [0.4e-3, 0.41e-3]}, "sticking gives way and the interface slides"),
        ("rate-and-state-stick-slip", {"theta": [1.0, 0.0]}, "the equations have no solution with these values"),
    ],
)
def test_no_run_could_rest_at_a_point_that_is_not_admissible(name, given, reason):
    found = surfacechem.load(name).evaluate(given)
    assert found["admissible"].values.tolist() == [1, 0]
    assert str(found["reason"].values[1]) == reason


def test_what_no_point_has_is_told_without_a_warning_of_numpy(recwarn):
    found = surfacechem.load("rate-and-state-stick-slip").evaluate({"theta": 0.0})
    assert np.isnan(found["v"].values).all()
    assert (found.attrs["warnings"], recwarn.list) == ("none", [])


def test_points_come_from_a_table_with_units(element, tmp_path):
    path = tmp_path / "points.csv"
    path.write_text("g_n [nm], T_c [degC], phi\n-1, 20, 0.5\n2, 30, 1\n")
    found = element.evaluate(read_points(path, element.evaluator))
    assert found["g_n"].values.tolist() == [-1e-9, 2e-9]
    assert found["T_c"].values.tolist() == [293.15, 303.15]
    assert found["phi"].values.tolist() == [0.5, 1.0]
    path.write_text("g_n [nm], T_c [degC]\n")
    with pytest.raises(InputError, match=r"points.csv:1: there is no row of values"):
        read_points(path, element.evaluator)
    path.write_text("g_n nm\n-1\n")
    with pytest.raises(InputError, match=r"points.csv:1: the heading 'g_n nm' is no name with a unit"):
        read_points(path, element.evaluator)


@pytest.mark.parametrize(
    ("points", "message"),
    [
        ([300, 310], "points are values by name"),
        ({"g_m": 1.0}, "points cannot give 'g_m'. Did you mean 'g_n'?"),
        ({"g_n": "1 K"}, "1 K is a temperature; g_n needs a length"),
        ({"g_n": [1.0, np.nan]}, "g_n takes a list of finite numbers in m."),
        ({"g_n": ["a"]}, "'a' is not a number with a unit; g_n needs a length"),
        ({"g_n": [{}]}, "g_n takes numbers in SI, or texts with a unit."),
        ({"g_n": []}, "g_n takes a list of finite numbers in m."),
        ({"g_n": [1e-9, 2e-9], "v": [1.0, 2.0, 3.0]}, "there are 2 of g_n, 3 of v."),
        ({"interface.friction.coulomb.mu": [0.3, -0.1]}, "coulomb.mu = -0.1 is outside its range: >= 0"),
    ],
)
def test_what_cannot_be_a_point_is_refused(points, message, element):
    with pytest.raises(InputError, match=message.replace("(", r"\(")):
        element.evaluate(points)


def test_a_table_of_points_is_one_of_pandas_too(element):
    points = {"g_n": [-1e-9, 1e-9]}
    assert element.evaluate(pandas.DataFrame(points)).identical(element.evaluate(points))
    in_nanometres = xarray.DataArray([-1, 1], attrs={"units": "nm"})
    assert element.evaluate({"g_n": in_nanometres}).identical(element.evaluate(points))


@pytest.mark.parametrize("changes", [(), "run="])
def test_a_run_of_what_is_prescribed_names_the_command_that_evaluates_it(element, tmp_path, changes):
    assert repr(element).endswith(": nothing to solve>")
    with pytest.raises(
        InputError, match=r"element.yaml:4: bodies: there is nothing.*`surfacechem evaluate .*element.yaml`"
    ):
        surfacechem.load(tmp_path / "element.yaml", changes).run()


def test_what_is_prescribed_runs_along_histories_that_change(tmp_path):
    """Its work is the energy that the contact gives back."""
    path = tmp_path / "moved.yaml"
    path.write_text(
        "bodies: {lower: {temperature: 300 K}, upper: {temperature: 300 K}}\n"
        "interface: {potential: [penalty: {E_n: 50 MPa/um}]}\n"
        "loading: {g_n: {ramp: {start: -2 nm, rate: 2 nm/s}}}\nrun: {until: 1 s}\n"
    )
    found = surfacechem.run(path)
    assert found.dataset.t_n.values == pytest.approx(5e13 * found.dataset.g_n.values, rel=1e-12)
    assert found.dataset.W_g_n.values[-1] == pytest.approx(-5e13 * 2e-9**2 / 2, rel=1e-9)
    assert found.accuracy.error < 1e-9
    with pytest.raises(InputError, match=r"moved.yaml:1: bodies: nothing evolves whose error could be compared"):
        precision(path)


def test_what_is_beyond_the_range_of_a_law_is_told():
    case = surfacechem.load("press-conductance")
    within, beyond = (case.evaluate({"p": p}).attrs["warnings"] for p in (1e5, 1e9))
    assert within == "none"
    assert beyond.endswith("is an extrapolation: p ran from 1e+09 to 1e+09, its range is 1200 to 2.76e+07")
