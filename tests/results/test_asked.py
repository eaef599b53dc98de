"""What is asked for is achieved: over all exact solutions errors are within ten times the accuracy asked for."""

from dataclasses import replace

import pytest
from asked import ACCURACIES, EXACT, exact

import surfacechem
from surfacechem.errors import InputError
from surfacechem.results import error_estimates
from surfacechem.results.accuracy import first_tolerance
from surfacechem.solve.run import Run

WITHIN = 10.0

QUICK = [
    *("case endothermic-kappa-0p99", "case force-spectroscopy", "case stick-slip", "case two-way-linear"),
    *("case shared-load-rupture", "case cohesive-pull-off", "chatter 1000", "stop 1e+06", "cold 0.0001"),
    *("endothermic 9.09495e-13", "film 1e-09"),
]
"""Some that are easy and those that are hardest."""


@pytest.mark.parametrize(
    ("name", "accuracy"),
    [
        *((name, accuracy) for name in QUICK for accuracy in ACCURACIES[::4]),
        ("film 1e-12", 1e-10),
        ("case compliant-debonding", 1e-3),
        *(pytest.param(name, each, marks=pytest.mark.slow) for each in ACCURACIES for name in exact(each)),
    ],
)
def test_accuracy_is_achieved(name, accuracy):
    found = EXACT[name](accuracy)
    assert found.ratio(accuracy) < WITHIN, found


SLIPS = [{"outputs": 4}, {"first": "1 ms", "spacing": "logarithmic", "outputs": 50}, {}]
"""Outputs of which the first ones see no slip at all."""


@pytest.mark.parametrize("outputs", SLIPS)
def test_a_run_that_misses_is_run_again_whatever_its_outputs(outputs):
    """The velocity of a slip is known less well than its step; the looser run is not handed out."""
    solution = surfacechem.run("stick-slip-rebonding", {"run": {"until": 40, "accuracy": 1e-4, **outputs}})
    run = solution.trajectory.run
    assert (run.solver, run.rtol) == ("radau", pytest.approx(1e-8))
    assert solution.accuracy.asked == 1e-4
    assert solution.attributes["error_asked"] == 1e-4
    assert solution.accuracy.error < 1e-4
    assert solution.dataset.sizes["time"] == outputs.get("outputs", solution.dataset.sizes["time"])


@pytest.fixture(scope="module")
def fine():
    return surfacechem.run("stick-slip", {"run": {"until": 3, "rtol": 1e-5, "outputs": 6000}}).dataset


@pytest.mark.parametrize("outputs", SLIPS)
@pytest.mark.parametrize("reference", [{}, {"reference": ""}])
def test_the_error_is_that_of_every_moment_whatever_the_outputs(outputs, reference, fine):
    """A slip lasts a thousandth of the run."""
    data = surfacechem.run("stick-slip", {"run": {"until": 3, "rtol": 1e-5, **outputs}, **reference}).dataset
    missed = float(abs(fine.v - fine.v_exact).max() / fine.v.max())
    assert missed / 2 < data.error < 4 * missed
    if not reference:
        assert data.error == fine.error


def test_cells_are_as_accurate_as_the_run_is_asked_to_be():
    solution = surfacechem.run("sudden-contact", ["run={until: 60 s, outputs: 20, accuracy: 1e-4}"])
    assert solution.accuracy.error < 1e-4
    assert not solution.notes


def test_a_given_number_of_cells_that_is_too_small_is_named():
    cells = [f"bodies.{name}.conduction.cells=20" for name in ("epoxy", "glass")]
    solution = surfacechem.run("sudden-contact", [*cells, "run={until: 60 s, outputs: 20, accuracy: 1e-6}"])
    assert solution.accuracy.error > 1e-5
    (note,) = solution.notes
    assert "number is given for epoxy and glass: let `cells: {accuracy: 1e-06}` choose it" in note


def test_what_rounding_forbids_is_said():
    case = surfacechem.load("closing-film", {"run": {"times": [5.0, 9.999999999], "accuracy": 1e-13}, "reference": ""})
    accuracy = case.run().accuracy
    assert accuracy.error > 1e-13
    assert "1e-13 is out of reach, as rounding of the time alone changes a state by" in accuracy.source


def test_events_that_only_one_of_two_runs_has_count_as_a_miss():
    model = surfacechem.load("stick-slip").model
    first, second = (model.solve(Run(times=(0.0, end))) for end in (3.0, 2.0))
    found = error_estimates.compared(replace(first, run=replace(first.run, rtol=1e-6)), second)
    assert found.error == float("inf")
    assert "which had other events" in found.source


def test_without_a_solver_an_accuracy_leaves_the_choice():
    runs = [surfacechem.load("exothermic", {"run": {"until": 1, **more}}).case.run for more in (
        {}, {"accuracy": 1e-6}, {"accuracy": 1e-6, "solver": "lsoda"}, {"solver": "auto"})]  # fmt: skip
    assert [run.solver for run in runs] == ["radau", "auto", "lsoda", "auto"]
    assert [run.rtol for run in runs] == pytest.approx([1e-11, 1e-8, 1e-8, 1e-11])
    with pytest.raises(InputError, match="with `solver: auto` it follows from `accuracy`"):
        surfacechem.load("exothermic", {"run": {"until": 1, "solver": "auto", "rtol": 1e-6}})


@pytest.mark.parametrize(
    ("case", "words"),
    {
        "exothermic": "solver dop853 explicit, order 8, as the start is not stiff",
        "stick-slip": "solver radau implicit, order 5 to 13 by tolerance: a gap moves, and may touch or stop",
        "dna-adhesive": "solver radau implicit, order 5 to 13 by tolerance: stiff, as",
        "hot-plate-bonds": "solver radau implicit, order 5 to 13 by tolerance: some states are algebraic",
        "sudden-contact": "solver radau implicit, order 5 to 13 by tolerance: heat conducted between cells is stiff",
    }.items(),
)
def test_the_choice_explains_itself(case, words):
    simulation = surfacechem.load(case)
    run = replace(simulation.case.run, solver="auto", accuracy=1e-8, rtol=first_tolerance(1e-8))
    problem = simulation.model.problem(run, simulation.model.values())
    told = "\n".join(" ".join(row) for row in error_estimates.reasons(problem, run, simulation.system.has_moving_gap))
    assert told.startswith(words)
    assert "a hundredth of the accuracy 1e-08" in told
    assert "a second run must agree" in told


def test_a_sweep_takes_the_tolerance_of_the_accuracy():
    case = surfacechem.load("exothermic", {"run": {"until": 1, "accuracy": 1e-6}})
    swept = case.sweep({"initial.T": [300, 310]})
    assert (swept.run.solver, swept.run.rtol) == ("dop853", pytest.approx(1e-8))
