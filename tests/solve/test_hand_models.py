"""Random scenes against the same scenes as plain SciPy models, which know nothing of the package's equations."""

import numpy as np
import pytest
from hand_models import FAMILIES, HandModel

from surfacechem.format import load_text
from surfacechem.runs.simulation import Simulation

TIGHT, TIGHTER = 1e-10, 1e-12
"""Tolerances of SciPy's solver; what lies between the two bounds its error at the second."""

SAFETY, ROUNDING = 10.0, 1e-11
"""Allowed times the errors of both, and what rounding of hand-written formulas may add."""

FEW, MANY = range(2), range(100, 140)


def compare(family, seed: int) -> None:
    """Every variable at every output: apart by no more than the errors that both state."""
    model: HandModel = family(np.random.default_rng([seed, FAMILIES.index(family)]))
    solution = Simulation(load_text(model.text)).run()
    assert solution.status == "finished", f"{solution.reason}\n{model.text}"
    assert not np.isnan(solution.accuracy.error), f"the error is {solution.accuracy.source}\n{model.text}"
    np.testing.assert_allclose(solution.dataset["time"], model.times, rtol=1e-14)
    loose, tight = model.values(TIGHT), model.values(TIGHTER)
    for name, exact in tight.items():
        size = float(np.max(np.abs(exact)))
        apart = float(np.max(np.abs(solution.dataset[name].values - exact))) / size
        hand = float(np.max(np.abs(loose[name] - exact))) / size
        allowed = SAFETY * (solution.accuracy.error + hand) + ROUNDING
        assert apart <= allowed, f"{name} differs by {apart:.1e}, {allowed:.1e} is allowed\n{model.text}"


@pytest.mark.parametrize("seed", FEW)
@pytest.mark.parametrize("family", FAMILIES)
def test_a_scene_is_what_its_equations_say_when_written_by_hand(family, seed):
    compare(family, seed)


@pytest.mark.slow
@pytest.mark.parametrize("family", FAMILIES)
def test_many_scenes_are_what_their_equations_say_when_written_by_hand(family):
    failures = {}
    for seed in MANY:
        try:
            compare(family, seed)
        except AssertionError as error:  # every failure of the family is told
            failures[seed] = str(error)
    assert not failures
