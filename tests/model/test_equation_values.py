"""No equation, margin, jump or booking changes unseen."""

import json

import equation_values
import pytest

APPROVED = json.loads(equation_values.TABLE.read_text())


@pytest.mark.parametrize("name", equation_values.SCENES)
def test_every_expression_of_a_scene_keeps_its_approved_value(name):
    """After a change that is meant: `python tests/equation_values.py`, and look at the difference."""
    assert equation_values.computed(name) == pytest.approx(APPROVED[name], rel=1e-12, abs=1e-40)
