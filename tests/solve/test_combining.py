"""Tables of the Radau family, and their products with the stages."""

import numba
import numpy as np
import pytest

from surfacechem.solve.radau.tables import (
    DEFECT,
    FROM_PARTS,
    GAMMA,
    INVERSE,
    NEWTON_NODES,
    NODES,
    PAIR_VALUES,
    SCAN_RATES,
    SCAN_VALUES,
    SCANNED,
    STAGES,
    TO_PARTS,
)
from surfacechem.solve.radau.work import ROWS, combine

each_member = pytest.mark.parametrize("k", range(3))


@numba.njit
def product(table, rows, terms, values, states, out):
    combine(table.ctypes.data, table.shape[1], rows, terms, values.ctypes.data, states, out.ctypes.data)


@pytest.mark.parametrize("states", [1, 2, 3, 4, 5, 7, 8, 30])
@pytest.mark.parametrize("stages", STAGES)
def test_any_number_of_states(stages, states):
    """What runs over the end of a row is written over, or lies behind the last stage."""
    random = np.random.default_rng(states)
    table, values = random.normal(size=(7, 7)), random.normal(size=(ROWS, states))
    out = np.zeros((ROWS, states))
    product(table, stages, stages, values, states, out)
    expected = np.einsum("ij,jm->im", table[:stages, :stages], values[:stages])
    np.testing.assert_allclose(out[:stages], expected, rtol=1e-13, atol=1e-14)


@each_member
def test_parts_are_eigenvectors(k):
    """The inverse of the collocation matrix in its real eigenbasis: a number and a rotation with growth each pair."""
    s = STAGES[k]
    blocks = np.zeros((s, s))
    blocks[0, 0] = GAMMA[k]
    for i, value in zip(range(1, s, 2), PAIR_VALUES[k], strict=False):
        blocks[i : i + 2, i : i + 2] = [[value.real, -value.imag], [value.imag, value.real]]
    found = FROM_PARTS[k, :s, :s] @ blocks @ -TO_PARTS[k, :s, :s]
    np.testing.assert_allclose(found, INVERSE[k, :s, :s], rtol=1e-11, atol=1e-11)


@each_member
def test_scanned_points_lie_on_the_polynomial(k):
    s, points = STAGES[k], SCANNED[k, : 4 * k + 9]
    polynomial = np.poly1d([*np.random.default_rng(k).normal(size=s), 0.0])
    stages = polynomial(NODES[k, :s])
    rows = slice(len(points)), slice(s)
    np.testing.assert_allclose(SCAN_VALUES[k][rows] @ stages, polynomial(points), rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(SCAN_RATES[k][rows] @ stages, polynomial.deriv()(points), rtol=1e-11, atol=1e-12)
    assert np.all(np.diff(points) > 0)
    assert list(SCAN_VALUES[k, len(points) - 1, :s]) == [0.0] * (s - 1) + [1.0]


@each_member
def test_the_scanned_correction_is_that_of_dense_output(k):
    s, points = STAGES[k], SCANNED[k, : 4 * k + 9]
    shape = DEFECT[k, s + 1]
    for i in range(s, -1, -1):
        shape = shape * (points - NEWTON_NODES[k, i]) + DEFECT[k, i]
    np.testing.assert_allclose(SCAN_VALUES[k, : len(points), s], shape * points, atol=1e-12)
