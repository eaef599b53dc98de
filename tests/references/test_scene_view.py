"""What exact solutions read from scenes: none takes the scene of another for its own."""

from contextlib import suppress

import pytest
from case_runs import at_even_times, load, solved
from sampling import every

from surfacechem import format as cases
from surfacechem import references
from surfacechem.errors import InputError
from surfacechem.references.base import SceneView
from surfacechem.results.error_estimates import EVENTS, against_exact

CELLS = ("sudden-contact", "epoxy-cure-thick")
"""Cases whose cells have an error of their own."""


@pytest.mark.parametrize("name", every(3, [name for name in cases.names() if name not in CELLS]))
def test_no_exact_solution_claims_a_case_that_it_does_not_solve(name):
    """Every one is named for every case: it is refused, or meets the run."""
    scene, solution = load(name).case.scene, at_even_times(name)
    late = {EVENTS: solution.accuracy.variables.get(EVENTS, 0.0)}
    for other in references.names():
        with suppress(InputError):
            assert against_exact(solution.trajectory, scene, other, {}, late=late).error < 1e-6, other


@pytest.mark.parametrize(
    ("name", "read", "value"),
    [
        ("compliant-debonding", lambda scene: scene.read("reaction", "t_max"), 80e6),
        ("compliant-debonding", lambda scene: scene.read("potential", "t_max"), None),
        ("viscous-heating", lambda scene: scene.read("friction", "beta"), 0.04),  # of a factor
        ("three-temperatures", lambda scene: scene.total_conductance, 3200.0),
        ("three-temperatures", lambda scene: scene.conductance(into="2"), 700.0),
        ("pair-exchange", lambda scene: scene.conductance(into="1"), None),
        ("stick-slip", lambda scene: scene.read("normal", "m"), None),
        ("stick-slip", lambda scene: scene.read("ramp", "w_t"), 1e-3),
        ("stick-slip-rebonding", lambda scene: scene.relaxation_time, pytest.approx(2.0)),
        ("cooling-to-zero", lambda scene: scene.heat_supply, -50.0),
    ],
)
def test_what_a_scene_tells(name, read, value):
    assert read(SceneView(load(name).case.scene, solved(name).trajectory)) == value


def test_the_same_length_in_two_units():
    back = "values: [60 nm, -20 nm, 0.060000000000000005 um]"
    case = cases.load("sticky-sphere", [f"loading.w_n={{table: {{times: [0 s, 1 s, 2 s], {back}}}}}"])
    view = SceneView(case.scene, solved("sticky-sphere").trajectory)
    assert references.get("cohesive-sphere-on-spring").from_scene(view)["w_turn"] == -20e-9
