"""Runs until nothing changes any more."""

import numpy as np
import pytest

import surfacechem
from surfacechem.errors import InputError
from surfacechem.runs.checking import check
from surfacechem.runs.keeping import NO_STEADY_STATE, STATUSES, STEADY_STATE
from surfacechem.runs.summaries import store_summary

STEADY = ["run.until=steady"]


@pytest.mark.parametrize("solver", ["radau", "cantera"])
@pytest.mark.parametrize("case", ["dna-adhesive", "exothermic", "elastic-bonds-at-a-gap"])
def test_a_run_ends_where_a_run_ten_times_as_long_ends(case, solver):
    simulation = surfacechem.load(case, [*STEADY, f"run.solver={solver}", "run.rtol=1e-9"])
    solution = simulation.run(error="balances")
    assert solution.status == "finished"
    assert "came to rest" in solution.reason
    end = solution.trajectory.result
    later = surfacechem.load(case, [f"run.until={10 * end.t!r}", "run.rtol=1e-9"]).run(error="balances").trajectory
    np.testing.assert_allclose(end.y, later.result.y, rtol=1e-7)
    assert np.abs(later.result.ydot).max() * end.t < 1e-7 * np.abs(end.y).min()


def test_what_hardly_changes_at_first_is_not_at_rest():
    """A cure at 200 K that takes a month to ignite, and changes by less than its tolerance in the first second."""
    cold = ["initial.T=200", "run.rtol=1e-6", "run.atol=1e-7"]
    end = surfacechem.load("adiabatic-arrhenius", [*STEADY, *cold]).run(error="balances").trajectory.result
    assert end.t > 1e6
    np.testing.assert_allclose(end.y, [1.0, 280.0], rtol=1e-5)
    slow = surfacechem.load("reservoir-exchange", [*STEADY, "run.rtol=1e-6", "bodies.body.C=1e13"])
    with pytest.raises(InputError, match="steady state within 1e"):
        slow.run()


@pytest.mark.parametrize(
    ("case", "message"),
    [
        ("stick-slip", "w_t changes in time, so there is no steady state"),
        ("sliding-dry", "did not reach a steady state within 1e"),
    ],
)
def test_what_comes_to_no_rest_is_refused(case, message):
    with pytest.raises(InputError, match=message):
        surfacechem.load(case, STEADY).run()


def test_runs_of_a_sweep_end_where_the_last_is_at_rest():
    """When each was, and its state, as alone."""
    simulation = surfacechem.load("dna-adhesive", [*STEADY, "run.outputs=3"])
    data = simulation.sweep({"initial.T_2": [300.0, 340.0]}).dataset
    for i, start in enumerate(data["initial_T_2"].values.tolist()):
        # Of the same scene, as absolute tolerances follow from what is written in it.
        alone = surfacechem.load("dna-adhesive", STEADY).run({"initial.T_2": start}, error="balances").dataset
        assert data["event_name"].values[i].tolist() == alone["event_name"].values.tolist() == ["steady"]
        assert data["event_time"].values[i, 0] == alone["event_time"].values[0] == alone["time"].values[-1]
        assert float(data["phi"][i, -1]) == pytest.approx(float(alone["phi"][-1]), rel=1e-8)
    assert float(data["time"][-1]) == data["event_time"].values.max()


def test_a_sweep_says_which_run_comes_to_no_rest():
    simulation = surfacechem.load("reservoir-exchange", [*STEADY, "run.rtol=1e-6", "run.atol=1e-7"])
    with pytest.raises(InputError, match=r"run\.until: .*steady state within 1e.* with bodies\.body\.C = 1e\+13 J/"):
        simulation.sweep({"bodies.body.C": [1e3, 1e13]})


def test_runs_of_a_store_end_where_each_is_at_rest(tmp_path):
    """And those that come to none fail, whatever is beside them."""
    path = "interface.bonding.linear-affinity.c_r"
    rates = [1.0, 1e14, 1e16]  # the first one takes three billion years
    settings = {"run.until": "steady", "run.solver": "radau", "sweep": {"keep": {"last": ["T", "phi"]}}}
    simulation = surfacechem.load("exothermic", settings)
    stream = simulation.stream(simulation.plan({path: rates}), tmp_path / "o.zarr")
    with stream.run().dataset as data:
        assert [STATUSES[code] for code in data["status"].values] == ["failed", "finished", "finished"]
        words = data.attrs["reasons"]
        assert [words[code] for code in data["reason"].values] == [NO_STEADY_STATE, STEADY_STATE, STEADY_STATE]
        for i, rate in enumerate(rates[1:], start=1):
            alone = simulation.run({path: rate}, error="balances").trajectory.result
            assert float(data["time_reached"][i]) == alone.t
            assert [float(data[f"{name}_last"][i]) for name in ("phi", "T")] == alone.y.tolist()
    checked = check(stream)
    assert checked.unknown == 1
    assert 0 < checked.error < 1e-9


def test_errors_of_a_store_until_rest_are_those_of_states(tmp_path):
    """What dies away is next to nothing at the end, and by how much differs from run to run."""
    simulation = surfacechem.load("dna-adhesive", STEADY)
    stream = simulation.stream(simulation.plan({"initial.T_2": [300.0, 340.0]}), tmp_path / "o.zarr")
    stream.run()
    assert 0 < check(stream).error < 1e-7


def test_errors_of_runs_that_come_to_no_rest_are_unknown(tmp_path):
    simulation = surfacechem.load("exothermic", STEADY)
    path = "interface.bonding.linear-affinity.c_r"
    stream = simulation.stream(simulation.plan({path: [1.0, 2.0]}), tmp_path / "o.zarr")
    store = stream.run()
    status, sheet = store_summary(stream, store, check(stream))
    assert (status, dict(sheet.facts)["error"]) == ("failed", "unknown in 2 runs")


@pytest.mark.parametrize(
    ("case", "keep", "message"),
    [("stick-slip", {}, "w_t changes in time"), ("exothermic", {"series": ["T"]}, "a length of its own")],
)
def test_what_no_store_can_keep_until_rest_is_refused_before_it_is_made(case, keep, message, tmp_path):
    simulation = surfacechem.load(case, {"run.until": "steady", "sweep": {"keep": keep}})
    with pytest.raises(InputError, match=message):
        simulation.stream(simulation.plan({"initial.T": [300.0]}), tmp_path / "o.zarr")
    assert not (tmp_path / "o.zarr").exists()
