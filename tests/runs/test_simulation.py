"""Running a loaded case with changed parameters, times and tolerances."""

import dataclasses
import gc
import io
import pickle
import weakref

import numpy as np
import pandas
import pint
import pytest
import xarray
from ruamel.yaml import YAML

import surfacechem
from surfacechem import documents
from surfacechem.errors import InputError
from surfacechem.plots import figure
from surfacechem.results.error_estimates import accuracy
from surfacechem.runs import rerun
from surfacechem.studies.stability import stability

pytestmark = pytest.mark.around

K_0 = "interface.potential.bond-energy.K_0"


@pytest.fixture(scope="module")
def simulation():
    return surfacechem.load("exothermic")


def test_a_changed_run_can_be_run_again_from_its_file(simulation, tmp_path):
    settings = dataclasses.replace(simulation.case.run, times=(0.0, 0.3, 0.7, 2.0), atol=1e-14, rtol=1e-9)
    solution = simulation.run({K_0: "600 J/m^2", "initial.phi": 0.1}, settings)
    record = rerun.read(solution.write(tmp_path / "changed.nc"))
    assert rerun.differences(record, rerun.run_again(record)) == []
    assert rerun.differences(record, simulation.run()) != []


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"bodies.lower.C": -1}, r"bodies\.lower\.C = -1 is outside its range: > 0"),
        ({"bodies.lower.C": "1 m"}, r"1 m is a length; bodies\.lower\.C needs a heat capacity per area"),
        ({"bodies.lower.c": 1}, r"no parameter 'bodies\.lower\.c' to change\. Did you mean 'bodies\.lower\.C'\?"),
        ({"initial.T": float("nan")}, r"initial\.T must be finite"),
        ({"initial.T": -3.0}, r"initial.T = -3 is outside its range: > 0"),
        ({"T_0": 0.0}, r"T_0 = 0 is outside its range: > 0"),
        ({"interface.sites": 0.0}, r"interface\.sites = 0 is outside its range: > 0"),
        ({"run.solver": "dop853"}, r"'run\.solver' is a key of the case, .*: give it to `load`, or to"),
        ({"run.solver": "dop"}, r"'run\.solver' is a key of the case"),
        ({"bodies.lower.capacity": "quadratic"}, r"'bodies\.lower\.capacity' is a key of the case"),
        ({"interface.potential.nothing": 1}, r"no parameter 'interface\.potential\.nothing' to change"),
        ({"run.slack": 10.0}, r"no parameter 'run\.slack' to change"),
        ({"phi_max": 5.0}, r"no parameter 'phi_max' to change"),
        ({"initial.phi": 1.5}, r"at the start phi rose above its bound 1"),
        ({"initial.T": 300, "initial.T.level": 310}, "a parameter is given twice, with and without the key of its"),
        (3, "override: changes are texts `path=value`, or values by path, not int"),
        ([3], "changes are texts `path=value`, or values by path, not int"),
        ({3: 4}, "changes are texts `path=value`, or values by path, not int"),
        (["bodies.lower.C=-1"], r"bodies\.lower\.C = -1 is outside its range: > 0"),
    ],
)
def test_a_change_that_makes_no_sense_is_refused(simulation, changes, message):
    with pytest.raises(InputError, match=message):
        simulation.run(changes)


@pytest.mark.parametrize("times", [(), (0.0,), (0.5, 1.0), (0.0, 1.0, 1.0), (0.0, 2.0, 1.0), (0, np.nan), (0, np.inf)])
def test_output_times_start_at_zero_and_increase(simulation, times):
    with pytest.raises(InputError, match="output times must start at 0 and increase"):
        dataclasses.replace(simulation.case.run, times=times)


def test_settings_from_python_are_checked_like_those_of_a_case(simulation):
    settings = dataclasses.replace(simulation.case.run, times=np.linspace(0, 1, 3), picture=None)
    assert simulation.run(run=settings).dataset.time.values.tolist() == [0.0, 0.5, 1.0]
    with pytest.raises(InputError, match="max_steps = 0 is outside its range: >= 1"):
        simulation.run(run=dataclasses.replace(settings, max_steps=0))
    with pytest.raises(InputError, match=r"no solver 'radua'\. Did you mean 'radau'\?"):
        simulation.run(run=dataclasses.replace(settings, solver="radua"))


def test_a_constant_history_is_changed_by_its_name_in_any_unit():
    sliding = surfacechem.load("sliding-dry")
    changed = [sliding.run({"loading.v": v}) for v in ("50 mm/s", 0.05, np.float32(0.05), np.array(1))]
    speeds = [float(solution.dataset["v"][0]) for solution in changed]
    assert speeds == pytest.approx([0.05, 0.05, 0.05, 1.0], rel=1e-7)
    at_a_place = xarray.DataArray([0.05], dims="run")[0]
    assert surfacechem.load("sliding-dry", {"loading.v": at_a_place}).run().dataset["v"][0] == 0.05
    for told in (at_a_place.assign_attrs(units="km s-1"), pint.Quantity(50, "m / s")):
        assert sliding.run({"loading.v": told}).dataset["v"][0] == 50
        assert surfacechem.load("sliding-dry", {"loading.v": told}).run().dataset["v"][0] == 50


def test_a_table_has_no_numbers_to_change():
    case = surfacechem.load("sliding-dry", {"loading.v": {"table": {"times": [0, 1], "values": [0, 1]}}})
    with pytest.raises(InputError, match=r"no parameter 'loading\.v\.table\.slope' to change"):
        case.run({"loading.v.table.slope": 2.0})


M = "interface.bonding.kamal-sourour.m"


@pytest.fixture(scope="module")
def cure():
    """A cure whose case gives the default of the order m."""
    return surfacechem.load("epoxy-cure-isothermal", {M: 1.0, "reference": ""})


def test_a_parameter_at_its_default_is_changed(cure):
    changed = cure.run({M: 1.3})
    given = surfacechem.run("epoxy-cure-isothermal", {M: 1.3, "reference": ""})
    assert np.array_equal(changed.dataset.phi, given.dataset.phi)
    assert np.array_equal(cure.run({M: 1.0}).dataset.phi, cure.run().dataset.phi)
    assert not np.array_equal(changed.dataset.phi, cure.run().dataset.phi)


def test_a_parameter_at_its_default_is_swept(cure, tmp_path):
    swept = cure.sweep({M: [1.0, 1.3]}, changes={"interface.bonding.kamal-sourour.E_1": "1 kJ/mol"})
    same = dataclasses.replace(cure.case.run, picture=None, times=tuple(swept.dataset.time.values))
    singly = [cure.run({M: m}, same).dataset.phi for m in (1.0, 1.3)]
    np.testing.assert_allclose(swept.dataset.phi, singly, rtol=1e-9)
    assert cure.sweep({M: [1.0]}).dataset.phi.shape == (1, cure.run({M: 1.0}).dataset.sizes["time"])
    record = rerun.read(swept.write(tmp_path / "swept.nc"))
    assert rerun.differences(record, rerun.run_again(record)) == []


def test_the_error_is_found_once_and_when_it_is_asked_for(simulation, monkeypatch):
    asked = []
    monkeypatch.setattr("surfacechem.runs.simulation.accuracy", lambda *given: asked.append(given) or accuracy(*given))
    solution = simulation.run()
    assert solution.audit.energy_error < 1e-9
    assert not asked
    assert solution.accuracy is solution.accuracy
    assert solution.dataset.error == solution.accuracy.error
    assert len(asked) == 1


def test_a_solution_is_freed_with_its_last_name(simulation):
    """A collector that counts objects does not see how large their arrays are: it comes too late for a loop of runs."""
    gc.disable()
    try:
        solution = simulation.run()
        assert solution.audit.energy_error < 1e-10
        assert solution.accuracy.error < 1e-10
        freed = weakref.ref(solution.trajectory)
        del solution
        assert freed() is None
    finally:
        gc.enable()


@pytest.mark.parametrize("name", ["exothermic", "stick-slip", "lithium-charging"])
def test_a_solution_comes_back_from_a_pickle_as_it_was(name):
    solution = surfacechem.run(name, ["run.outputs=21"])
    again = pickle.loads(pickle.dumps(solution))
    assert again.dataset.drop_attrs().identical(solution.dataset.drop_attrs())
    assert {**again.attributes, "compile_seconds": 0} == {**solution.attributes, "compile_seconds": 0}
    repeated = again.trajectory.model.solve(again.trajectory.run)
    assert np.array_equal(repeated.result.outputs, solution.trajectory.result.outputs)


@pytest.mark.parametrize(
    ("name", "over"),
    [
        ("force-spectroscopy", None),
        ("debonding", {"initial.T": [300, 310]}),
        ("lithium-charging", {"initial.V_electron": [-2.95, -2.9]}),
    ],
)
def test_a_sweep_comes_back_from_a_pickle_as_it_was(name, over):
    swept = surfacechem.load(name).sweep(over)
    again = pickle.loads(pickle.dumps(swept))
    assert again.dataset.drop_attrs().identical(swept.dataset.drop_attrs())


@pytest.mark.parametrize("suffix", [".xlsx", ".json", ".txt"])
def test_a_dataset_is_written_under_the_name_of_its_format_only(simulation, tmp_path, suffix):
    target = tmp_path / f"run{suffix}"
    with pytest.raises(InputError, match=r"is written as '\.\w+': \.nc, \.nc4, \.cdf, \.csv, \.parquet\. Give run\.nc"):
        simulation.run().write(target)
    assert not target.exists()


def test_a_case_is_a_path_a_text_a_mapping_or_an_open_file(tmp_path):
    path = documents.cases() / "exothermic.yaml"
    text = path.read_text()
    content = YAML(typ="safe").load(text)
    content["initial"]["T"] = np.float64(300)
    with path.open() as file, path.open("rb") as raw:
        sources = (path, str(path), text, content, file, raw, io.StringIO(text))
        found = [surfacechem.load(source) for source in sources]
    first = found[0].run().dataset["T"].values
    assert all(np.array_equal(simulation.run().dataset["T"].values, first) for simulation in found[1:])


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("", "the text of the case is empty"),
        (io.BytesIO(b"\xff"), "case.yaml: no text in UTF-8"),
        (3, "a case is a path, a name, a text, a mapping or an open file, not int"),
        ({"bodies": object()}, "a case holds numbers, texts, lists and mappings, not object"),
        ("title: none\n", "case.yaml:1: the case needs `bodies`"),
        ("interface: {temperature: T_c}\nrun: {until: 1}\n", "case.yaml:1: the case needs `bodies`"),
    ],
)
def test_what_is_no_case_is_refused(source, message):
    with pytest.raises(InputError, match=message):
        surfacechem.load(source)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda case: case.run(run={}), "run is a Run, .*, not dict"),
        (lambda case: case.sweep({"initial.T": [300]}, threads=-1), "a number of threads is 1 or more, not -1"),
        (lambda case: case.sweep({"initial.T": [300]}, threads="2"), "a number of threads is 1 or more, not '2'"),
        (lambda case: case.sweep({"initial.T": [300]}, until=3), "changes are texts `path=value`, .*, not int"),
        (lambda case: case.stream({"initial.T": [300]}, "o.zarr"), "a store needs a plan, .*, not dict"),
        (lambda case: figure(case), "a figure shows a dataset or the path of its file, not Simulation"),
        (lambda _: surfacechem.load("exothermic", 3), "changes are texts `path=value`, .*, not int"),
        (lambda _: surfacechem.precision(3), "cases are names or files, not int"),
        (lambda _: surfacechem.precision("exothermic", tolerances=1e-5), "tolerances are a list, not float"),
        (lambda _: surfacechem.precision("exothermic", tolerances=["a"]), "a tolerance is a number, not str"),
        (lambda _: surfacechem.precision("exothermic", solvers="radau"), "a list of names is needed, not 'radau'"),
        (lambda _: surfacechem.steady("dna-adhesive", of=3), "a list of names is needed, not 3"),
        (lambda case: dataclasses.replace(case.case.run, times=3), "output times are a list of numbers, not 3"),
        (lambda case: dataclasses.replace(case.case.run, times=(0, "a")), "output times are a list of numbers, not"),
        (lambda case: dataclasses.replace(case.case.run, rtol="x"), "rtol is a number, not str"),
        (lambda case: dataclasses.replace(case.case.run, accuracy=-1), "accuracy = -1 is outside its range: > 0"),
        (lambda _: surfacechem.Simulation.of(3), "a simulation is one of a Scene, not int"),
        (lambda _: surfacechem.references.get(3), "the name of an exact solution is a text, not int"),
        (lambda _: surfacechem.precision("exothermic", repeat="a"), "rounds are a whole number, not str"),
        (lambda _: stability(["endothermic"]), r"no regime '\['endothermic'\]'"),
    ],
)
def test_what_is_of_no_use_is_refused_before_anything_runs(simulation, call, message):
    with pytest.raises(InputError, match=message):
        call(simulation)


def test_a_dataset_is_a_table_by_its_suffix(simulation, tmp_path):
    solution = simulation.run()
    frames = [pandas.read_csv(solution.write(tmp_path / "run.csv"))]
    frames.append(pandas.read_parquet(solution.write(tmp_path / "run.parquet")))
    for frame in frames:
        assert np.array_equal(frame["T [K]"], solution.dataset["T"])
        assert np.array_equal(frame["time [s]"], solution.dataset["time"])
    swept = simulation.sweep({"initial.T": [300.0, 310.0]})
    table = pandas.read_csv(swept.write(tmp_path / "sweep.csv"))
    assert np.array_equal(table["phi [1]"].to_numpy(), swept.dataset["phi"].values.ravel())


@pytest.mark.parametrize("swept", [False, True])
def test_a_solution_is_read_drawn_and_told_by_itself(simulation, tmp_path, swept):
    solution = simulation.sweep({"initial.T": [300.0, 310.0]}) if swept else simulation.run()
    assert solution["T"].identical(solution.dataset["T"])
    assert solution.plot(["T"]).axes[0].lines
    assert solution.report(tmp_path / "page.html").read_text().startswith("<!DOCTYPE html>")
    with pytest.raises(InputError, match=r"page.pdf: a report is HTML: give page.html"):
        solution.report("page.pdf")
    assert "data:image/png;base64," in solution._repr_html_()
    with pytest.raises(InputError, match=r"no variable 'phy'\. Did you mean 'phi'\?"):
        solution["phy"]


def test_a_scene_in_python_offers_what_a_case_does(simulation, tmp_path):
    scene, run = simulation.case.scene, dataclasses.replace(simulation.case.run, times=np.linspace(0, 2.5, 5))
    own = surfacechem.Simulation.of(scene, run, "mine")
    assert repr(own) == "<Simulation 'mine': phi, T>"
    assert "<pre>mine" in own._repr_html_()
    solution = own.run({"initial.T": 310.0})
    expected = simulation.run({"initial.T": 310.0}, dataclasses.replace(run, times=tuple(run.times)))
    assert np.array_equal(solution["T"], expected["T"])
    assert np.array_equal(own.sweep({"initial.T": [310.0]})["T"][0], solution["T"])
    assert own.evaluate({"phi": 0.5})["q_reaction"].identical(simulation.evaluate({"phi": 0.5})["q_reaction"])
    with pytest.raises(InputError, match="holds no case, as its scene was built in Python"):
        rerun.run_again(rerun.read(solution.write(tmp_path / "mine.nc")))
