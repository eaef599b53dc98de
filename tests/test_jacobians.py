"""The compiled Jacobians are those of the residual, by differences in 60 digits, in every scene and mode."""

import mpmath
import numpy as np
import pytest
import scenes
import scenes_mechanics
import thermodynamics as laws

from surfacechem.assembly import assemble
from surfacechem.compile import compile_program

CASES = [pytest.param(scene, {}, id=scene.__name__) for scene in scenes.ALL]
CASES += [
    pytest.param(m.scene, modes, id=f"{m.__name__}{list(modes.values())}")
    for m in scenes_mechanics.ALL
    for modes in m.modes
]
STEP = mpmath.mpf(10) ** -25


def slope(row, x, point) -> mpmath.mpf:
    """Central difference of an equation over one variable."""
    step = STEP * max(abs(point[x]), mpmath.mpf(10) ** -9)
    ahead, behind = (laws.number(row, point | {x: point[x] + sign * step}) for sign in (1, -1))
    return (ahead - behind) / (2 * step)


@pytest.mark.parametrize(("scene", "modes"), CASES)
def test_jacobian_is_the_derivative_of_the_residual(scene, modes):
    system = assemble(scene())
    point = laws.consistent_point(system, 1, modes)
    states, rates = [s.symbol for s in system.states], [s.dot for s in system.states]
    rows, parameters = system.residual(), [p.symbol for p in system.parameters]
    program = compile_program(system.t, states, rates, parameters, rows)
    compiled = program.jacobian([float(point[x]) for x in system.inputs])
    found = np.concatenate(compiled.reshape(2, program.n, program.n), axis=1)
    for row, equation in enumerate(rows):
        for column, x in enumerate([*states, *rates]):
            exact = float(slope(equation, x, point))
            # A derivative may be a difference of large terms: relative to what it does to its equation.
            size = max(abs(float(point[y]) * value) for y, value in zip([*states, *rates], found[row], strict=True))
            rounding = 1e-12 * size / max(abs(float(point[x])), 1e-300)
            assert found[row, column] == pytest.approx(exact, rel=1e-9, abs=rounding)
