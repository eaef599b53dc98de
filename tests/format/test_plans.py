"""Plans of sweeps: grids, values that go together, samples; each run from its number alone."""

import json
from dataclasses import replace

import numpy as np
import pint
import pytest
import xarray
from scipy import stats

import surfacechem
from surfacechem.errors import InputError
from surfacechem.format.plans import SAMPLERS, Axis, Distribution, EvenlySpaced, Plan, Sample, permuted, recorded_plan

K_0, C_R = "interface.potential.bond-energy.K_0", "interface.bonding.linear-affinity.c_r"
LAWS = {
    "a": (Distribution("Uniform", {"low": 1.0, "high": 3.0}), stats.uniform(1, 2)),
    "b": (Distribution("Normal", {"mean": -1.0, "std": 2.0}), stats.norm(-1, 2)),
    "c": (Distribution("Lognormal", {"median": 2.0, "sigma": 0.5}), stats.lognorm(0.5, scale=2)),
    "d": (Distribution("Uniform", {"low": 1e-3, "high": 10.0, "logarithmic": True}), stats.loguniform(1e-3, 10)),
}
GIVEN = {name: given for name, (given, _) in LAWS.items()}


@pytest.fixture(scope="module")
def bonding():
    return surfacechem.load("exothermic")


@pytest.mark.parametrize("count", [1, 2, 7, 1000])
def test_ranges_are_those_of_numpy(count):
    index = np.arange(count)
    assert np.array_equal(EvenlySpaced(0.3, 7.1, count).at(index), np.linspace(0.3, 7.1, count))
    assert np.array_equal(EvenlySpaced(1e-12, 3e-7, count, True).at(index), np.geomspace(1e-12, 3e-7, count))


def test_a_grid_of_a_billion_is_a_function_of_the_number():
    axes = [Axis(name, EvenlySpaced(0.0, 1.0, 1000)) for name in "abc"]
    plan = Plan(axes)
    assert plan.size == 10**9
    found = plan.at(np.array([0, 123_456_789, 10**9 - 1]))
    for name, place in zip("abc", (123, 456, 789), strict=True):
        assert found[name].tolist() == [0.0, place / 999, 1.0]


@pytest.mark.parametrize("method", SAMPLERS)
@pytest.mark.parametrize("runs", [1, 10, 4096])
def test_draws_follow_their_distributions_and_depend_on_seed_and_number_only(method, runs):
    sample = Sample(GIVEN, runs, method, seed=5)
    whole = sample.at(np.arange(runs))
    picked = np.random.default_rng(1).integers(0, runs, 50)
    for name, values in sample.at(picked).items():
        assert np.array_equal(values, whole[name][picked])
    if runs == 4096:
        for name, (_, law) in LAWS.items():
            assert stats.kstest(whole[name], law.cdf).pvalue > 1e-3
        assert abs(np.corrcoef([*whole.values()])[0, 1]) < 0.1
    other = Sample(GIVEN, runs, method, seed=6).at(np.arange(runs))
    assert not np.array_equal(other["a"], whole["a"])


def test_a_latin_hypercube_has_one_draw_in_each_part():
    even = Distribution("Uniform", {"low": 0.0, "high": 1000.0})
    sample = Sample({"a": even, "b": even}, 1000, "latin-hypercube", 3)
    drawn = sample.at(np.arange(1000))
    for values in drawn.values():
        assert sorted(values.astype(int)) == list(range(1000))
    far = Sample({"a": even}, 10**9, "latin-hypercube").at(np.array([0, 10**9 - 1]))["a"]
    assert np.all((far > 0) & (far < 1000))


@pytest.mark.parametrize("count", [1, 2, 5, 64, 1000])
def test_a_permutation_leads_each_number_to_another(count):
    assert sorted(permuted(np.arange(count), count, 7)) == list(range(count))


def test_a_plan_of_a_case_has_a_grid_and_a_sample(bonding, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "draws.csv").write_text("K_0 [kJ/m^2], T [K]\n0.1, 290\n0.2, 300\n0.3, 310\n")
    of = {K_0: {"table": {"file": "draws.csv"}}, "initial.T": {"table": {"file": "draws.csv"}}}
    plan = bonding.plan({C_R: ["1e15 1/J/s", "2e15 1/J/s"]}, sample={"of": of, "runs": 20, "method": "random"})
    assert (plan.shape, plan.paths) == ((2, 20), [C_R, K_0, "initial.T"])
    found = plan.at(np.arange(40))
    assert set(zip(found[K_0], found["initial.T"], strict=True)) == {(100, 290), (200, 300), (300, 310)}
    assert found[C_R].tolist() == [1e15] * 20 + [2e15] * 20
    again = recorded_plan(plan.record)
    assert again.record == plan.record
    assert all(np.array_equal(values, found[path]) for path, values in again.at(np.arange(40)).items())


def test_arrays_are_the_lists_of_their_numbers(bonding):
    for values in (np.linspace(1.0, 300.0, 7), np.geomspace(1.0, 300.0, 7), np.array([2, 5, 3]), np.array([7.0])):
        ways = values, values.tolist(), xarray.DataArray(values)
        plan, listed, column = (bonding.plan({K_0: given}) for given in ways)
        assert column.record == plan.record
        assert plan.at(np.arange(plan.size))[K_0].tolist() == listed.at(np.arange(plan.size))[K_0].tolist()
        assert recorded_plan(plan.record).at(np.arange(plan.size))[K_0].tolist() == values.tolist()
    assert len(bonding.plan({K_0: np.linspace(1.0, 300.0, 100_000)}).record) < 200
    celsius = xarray.DataArray([17.0, 27.0], attrs={"units": "degC"})
    assert bonding.plan({"initial.T": celsius}).at(np.arange(2))["initial.T"].tolist() == [290.15, 300.15]
    assert bonding.plan({K_0: pint.Quantity([0.1, 0.3], "kJ/m**2")}).axes[0].at(np.arange(2)).tolist() == [100.0, 300.0]
    for one in ({"initial.T": celsius[0]}, "initial.T"):
        with pytest.raises(InputError, match=r"sweep\.over.*(must be a list|takes values by path)"):
            bonding.plan(one)
    with pytest.raises(InputError, match="a range of one value has one end"):
        bonding.plan({K_0: {"from": 1, "to": 2, "points": 1}})
    for wrong in (np.array([1.0, np.nan]), np.array([1.0, np.inf, 2.0]), np.array([]), np.ones(2), np.ones((2, 1))):
        with pytest.raises(InputError, match=K_0):
            bonding.plan({K_0: wrong})


def test_values_that_go_together_are_runs_of_one_dimension(bonding):
    solution = bonding.sweep({K_0: [100.0, 300.0, 200.0], "initial.phi": [0.0, 0.2, 0.0]}, combine="zip")
    data = solution.dataset
    assert data["T"].dims == ("run", "time")
    assert data["K_0"].dims == data["status"].dims == ("run",)
    same = replace(bonding.case.run, picture=None, times=tuple(data.time.values))
    alone = bonding.run({K_0: 300.0, "initial.phi": 0.2}, same).dataset
    assert np.array_equal(data["T"].values[1], alone["T"].values)


def test_a_sample_of_three_parameters_beside_a_grid_runs(bonding):
    of = {K_0: {"normal": {"mean": 300, "std": "3 J/m^2"}}, C_R: {"lognormal": {"median": 6e15, "sigma": 0.1}}}
    data = bonding.sweep({"initial.T": [290, 300]}, sample={"of": of, "runs": 4}).dataset
    assert data["phi"].dims == ("initial_T", "run", "time")
    assert data["phi"].shape[:2] == (2, 4)
    one = data.isel(initial_T=1, run=2)
    values = {K_0: one["K_0"].item(), C_R: one["c_r"].item()}
    same = replace(bonding.case.run, picture=None, times=tuple(data.time.values))
    assert np.array_equal(bonding.run(values, same).dataset["phi"].values, one["phi"].values)


REFUSED = [
    ({}, {"of": {}, "runs": 3}, "a sample needs `of`: distributions of parameters"),
    ({}, {"of": {K_0: {"normal": {"mean": 1}}}, "runs": 3}, "a normal distribution needs `std`"),
    ({}, {"of": {K_0: {}}, "runs": 3}, "a distribution is one of uniform, normal, lognormal and table"),
    ({}, {"of": {K_0: {"uniform": {"from": 2, "to": 1}}}, "runs": 3}, "from 2 to 1 do not increase"),
    ({}, {"of": {K_0: {"uniform": {"from": "1 Pa", "to": 1}}}, "runs": 3}, "1 Pa is a pressure"),
    ({}, {"of": {K_0: {"table": {"file": "no.csv"}}}, "runs": 3}, "no file no.csv"),
    ({}, {"of": {K_0: {"normal": {"mean": 1, "std": 1}}}}, "a sample needs `runs`"),
    ({}, {"of": {"x.y": {"normal": {"mean": 1, "std": 1}}}, "runs": 1}, "no parameter 'x.y' to sweep"),
    ({K_0: [1.0]}, {"of": {K_0: {"normal": {"mean": 1, "std": 1}}}, "runs": 3}, "different parameters"),
    ({K_0: [1.0, 2.0], C_R: [1.0]}, None, "as many values of each parameter, not 2 of interface.potential"),
]


@pytest.mark.parametrize(("over", "sample", "message"), REFUSED)
def test_bad_plans_are_refused(bonding, over, sample, message):
    with pytest.raises(InputError, match=message):
        bonding.plan(over or None, None, sample, None if sample else "zip")


@pytest.mark.parametrize(
    "spoilt", [{"axes": 3}, {"sample": {"draws": 1}}, {"sample": {"draws": {"a": {"kind": "No"}}}}]
)
def test_a_record_that_is_no_plan_is_refused(spoilt):
    record = json.loads(Plan([Axis("a", [1.0])]).record) | spoilt
    with pytest.raises(InputError, match="no plan of a sweep"):
        recorded_plan(json.dumps(record))
