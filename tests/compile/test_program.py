"""Machine code from expressions."""

import numpy as np
import pytest
import symengine as se

from surfacechem.compile.program import compile_function, compile_program


def test_derivatives_and_layout() -> None:
    t, x, z, dx, dz, k = se.symbols("t x z dx dz k")
    program = compile_program(
        t, [x, z], [dx, dz], [k], [x * dx + k * z, z**2 - t * x], ledger=[k * dx], margins=[x - 1]
    )
    inputs = [2.0, 3.0, 5.0, 7.0, 11.0, 13.0]
    assert program.n_inputs == 6
    assert program.algebraic == (False, True)
    np.testing.assert_array_equal(program.residual(inputs), [21.0 + 65.0, 25.0 - 6.0])
    np.testing.assert_array_equal(program.jacobian(inputs), [7.0, 13.0, -2.0, 10.0, 3.0, 0.0, 0.0, 0.0])
    assert program.ledger is not None
    assert program.margins is not None
    assert program.ledger([inputs, inputs]).shape == (2, 1)
    np.testing.assert_array_equal(program.margins(inputs), [2.0])


def test_unused_inputs_and_constants() -> None:
    x, y = se.symbols("x y")
    np.testing.assert_array_equal(compile_function([x, y], [x, 3])([1.0, np.nan]), [1.0, 3.0])


def test_counts_must_agree() -> None:
    t, x, dx = se.symbols("t x dx")
    with pytest.raises(ValueError, match="as many equations as states"):
        compile_program(t, [x], [dx], [], [dx, x])
