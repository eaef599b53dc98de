"""Running a loaded case with changed parameters, times and tolerances."""

import dataclasses

import numpy as np
import pytest

import surfacechem
from surfacechem import rerun
from surfacechem.errors import InputError

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
        ({"initial.T": -3.0}, r"at the start the temperature T reached zero"),
        ({"T_0": 0.0}, r"T_0 = 0 is outside its range: > 0"),
        ({"interface.sites": 0.0}, r"interface\.sites = 0 is outside its range: > 0"),
        ({"run.slack": 10.0}, r"no parameter 'run\.slack' to change"),
        ({"phi_max": 5.0}, r"no parameter 'phi_max' to change"),
        ({"initial.phi": 1.5}, r"at the start phi rose above its bound 1"),
    ],
)
def test_a_change_that_makes_no_sense_is_refused(simulation, changes, message):
    with pytest.raises(InputError, match=message):
        simulation.run(changes)


@pytest.mark.parametrize("times", [(), (0.0,), (0.5, 1.0), (0.0, 1.0, 1.0), (0.0, 2.0, 1.0)])
def test_output_times_start_at_zero_and_increase(simulation, times):
    with pytest.raises(InputError, match="output times must start at 0 and increase"):
        dataclasses.replace(simulation.case.run, times=times)


def test_output_times_never_change_the_answer(simulation):
    few, many = ((0.0, 2.5), tuple(2.5 * i / 1000 for i in range(1001)))
    ends = [simulation.run(run=dataclasses.replace(simulation.case.run, times=times)) for times in (few, many)]
    first, second = (solution.trajectory.result for solution in ends)
    assert (first.y == second.y).all()
    assert first.counters.steps == second.counters.steps


def test_a_constant_history_is_changed_by_its_name_in_any_unit():
    sliding = surfacechem.load("sliding-dry")
    changed = [sliding.run({"loading.v": v}) for v in ("50 mm/s", 0.05, np.float32(0.05), np.int64(1))]
    speeds = [float(solution.dataset["v"][0]) for solution in changed]
    assert speeds == pytest.approx([0.05, 0.05, 0.05, 1.0], rel=1e-7)


def test_a_table_has_no_numbers_to_change():
    case = surfacechem.load("sliding-dry", {"loading.v": {"table": {"times": [0, 1], "values": [0, 1]}}})
    with pytest.raises(InputError, match=r"no parameter 'loading\.v\.table\.slope' to change"):
        case.run({"loading.v.table.slope": 2.0})


def test_a_case_may_drop_its_exact_solution():
    assert surfacechem.run("exothermic", ["reference="]).accuracy.source.startswith("estimate")
