"""No equation, margin, jump or booking changes unseen."""

import json

import equation_values
import mpmath
import numpy as np
import pytest
import thermodynamics

from surfacechem.compile.program import compile_function
from surfacechem.expressions import magnitude
from surfacechem.tolerances import ULPS

APPROVED = json.loads(equation_values.TABLE.read_text())


@pytest.mark.parametrize("name", equation_values.SCENES)
def test_every_expression_of_a_scene_keeps_its_approved_value(name):
    """After a change that is meant: `python tests/equation_values.py`, and look at the difference."""
    assert equation_values.computed(name) == pytest.approx(APPROVED[name], rel=1e-12, abs=1e-40)


@pytest.mark.parametrize("name", list(equation_values.SCENES)[::5])
def test_the_magnitude_of_an_expression_bounds_the_error_of_its_machine_code(name):
    system, point = equation_values.away(name)
    inputs = np.array([float(point[symbol]) for symbol in system.inputs])
    point = {symbol: mpmath.mpf(value) for symbol, value in zip(system.inputs, inputs.tolist(), strict=True)}
    items = [system.expand(expression) for _, expression in equation_values.parts(system)]
    exact = [thermodynamics.number(item, point) for item in items]
    values, bounds = (compile_function(system.inputs, f)(inputs) for f in (items, [magnitude(item) for item in items]))
    errors = np.array([float(abs(mpmath.mpf(float(v)) - e)) for v, e in zip(values, exact, strict=True)])
    assert np.all(errors <= ULPS * bounds)
    assert np.all(bounds >= np.abs(values) * (1 - ULPS))
