"""LU of large matrices: again in the order of the one before, and never where that would be wrong."""

import importlib.util
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from surfacechem.solve.radau import work

N = 40


def as_python(name: str) -> Any:
    """A module of the stepper that is not compiled, which for one kind of number would take longer than all tests."""
    spec = importlib.util.find_spec(name)
    module = importlib.util.module_from_spec(spec)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(work, "compiled", lambda function: function)
        spec.loader.exec_module(module)
    return module


linear = as_python("surfacechem.solve.radau.linear")


def factored(derivatives: Any, shift: Any, a: Any, order: Any, places: Any, again: bool, x: Any) -> bool:
    """G_y + shift G_ydot factored, from nothing or in the order known, and a right-hand side solved for."""
    counts, scales = np.zeros((6, len(x)), np.int64), np.ones(len(x))
    linear.count_entries_of_rows(derivatives, counts[5])
    if again:
        known = linear.factor_again(derivatives, counts[5], shift, a, order, places, scales, np.empty(len(x)))
    else:
        linear.shifted(derivatives, shift, a)
        known = linear.factor(a, order, places, scales, np.empty(len(x)), counts, 0.0)
    linear.solve(a, order, places, x)
    return known


@pytest.mark.parametrize("kind", [float, complex])
@pytest.mark.parametrize("seed", range(5))
def test_again_in_the_order_known(kind: type, seed: int) -> None:
    draw = np.random.default_rng(seed)
    derivatives = np.zeros((2, N, N))
    derivatives[0] = np.where(draw.random((N, N)) < 0.06, draw.integers(-2, 3, (N, N)), 0)
    derivatives[1] = np.eye(N)[draw.permutation(N)]
    order, places = np.zeros((6, N), np.int64), np.zeros((N, N), np.int64)
    # Whole numbers: entries of the factors cancel exactly, which they do not the next time.
    assert factored(derivatives, kind(3.0), np.zeros((N, N), kind), order, places, False, np.ones(N, kind))
    derivatives[0] *= 1.0 + 0.1 * draw.random((N, N))
    x, shift = np.ones(N, kind), kind(4.0 if kind is float else 4.0 + 1.0j)
    assert factored(derivatives, shift, np.full((N, N), np.nan, kind), order, places, True, x)
    np.testing.assert_allclose((derivatives[0] + shift * derivatives[1]) @ x, 1.0, rtol=1e-11)
    # An entry where none was nor has come, and a pivot that has become small beside what is below it.
    entries = np.eye(N, dtype=bool)
    for i in range(N):
        entries[i, places[i, : order[3, i]]] = True
    i, j = np.argwhere(~entries)[seed]
    more, small = derivatives.copy(), derivatives.copy()
    more[0, order[4, i], order[5, j]] = 1.0
    # A pivot that is an entry of the matrix as it is, and not the only one of its column.
    eliminated = {place for i in range(N) for place in places[i, : order[2, i]]}
    k = next(k for k in sorted(eliminated) if order[2, k] == 0)
    small[:, order[4, k], order[5, k]] *= 1e-12
    for other in (more, small):
        assert not factored(other, shift, np.zeros((N, N), kind), order, places, True, np.ones(N, kind))


def test_an_order_that_is_not_whole_is_not_used_again() -> None:
    derivatives, order, places = np.array([np.eye(N), np.zeros((N, N))]), np.zeros((6, N), int), np.zeros((N, N), int)
    assert factored(derivatives, 1.0, np.zeros((N, N)), order, places, False, np.ones(N))
    assert order[3, 0] >= 0
    derivatives[0, :2, :2] = 1.0  # singular
    assert not factored(derivatives, 1.0, np.zeros((N, N)), order, places, False, np.ones(N))
    assert order[3, 0] < 0


@pytest.mark.parametrize("seed", range(5))
def test_bounds_hold_and_are_met_where_nothing_cancels(seed: int) -> None:
    """Of a matrix with positive diagonal that dominates and no other positive entry the bound is the solution."""
    draw = np.random.default_rng(seed)
    entries = np.where(draw.random((N, N)) < 0.06, 0.05 * draw.random((N, N)), 0.0)  # no pivot off the diagonal
    for signs in (-1.0, draw.choice([-1.0, 1.0], (N, N))):
        matrix = signs * entries
        np.fill_diagonal(matrix, 1.0 + entries.sum(axis=1))
        a, sizes = np.zeros((N, N)), draw.random(N)
        order, places = np.zeros((6, N), np.int64), np.zeros((N, N), np.int64)
        assert factored(np.array([matrix, np.zeros((N, N))]), 1.0, a, order, places, False, np.ones(N))
        bound = sizes.copy()
        linear.bound_real(SimpleNamespace(real=a, order=[order], places=[places]), bound)
        exact = np.abs(np.linalg.inv(matrix)) @ sizes
        assert np.all(bound >= (1 - 1e-12) * exact)
        if np.isscalar(signs):
            np.testing.assert_allclose(bound, exact, rtol=1e-10)
