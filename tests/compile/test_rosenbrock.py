"""Linearly implicit steps of eight cases at once: order, dense output, stiffness, and matrices that lose digits."""

import ctypes

import numpy as np
import pytest
import symengine

from surfacechem.compile.program import compile_program
from surfacechem.compile.rosenbrock import CHANGES, DENSE, NODES, STAGES
from surfacechem.compile.vectors import LANES
from surfacechem.tolerances import LINEAR_RTOL

T, X, Y, Z, DX, DY, DZ, K = symengine.symbols("t x y z dx dy dz k")


def lanes_of(states, rates, parameters, sources):
    rows = [rate - source for rate, source in zip(rates, sources, strict=True)]
    return compile_program(T, states, rates, parameters, rows).implicit_lanes


def stepped(code, t, y, h, parameters=(), weights=1e-6):
    """Increments, end states and flags of one step of eight cases: times, states [state, case], steps, parameters."""
    n, total = len(y), code.step.n_out
    given = np.zeros((1 + 2 * n + len(parameters), LANES))
    given[0], given[1 : 1 + n] = t, y
    for row, values in enumerate(parameters, 1 + 2 * n):
        given[row] = values
    inputs = np.concatenate([given, code.constants(given)])
    out = np.zeros((total + n, LANES))
    out[:n], out[total:] = code.states(inputs), weights
    out[total - 1 - n * (n + 2) : total - 1 - n] = code.slopes(inputs)
    inputs[1 + n] = h
    call = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p)(code.step.address)
    call(out.ctypes.data, inputs.ctypes.data, None)
    end = (1 + STAGES) * n
    increments, rates, after = out[n:end].reshape(STAGES, n, LANES), out[end : end + n], out[end + n : end + 2 * n]
    given[0], given[1 : 1 + n] = t + h, after
    assert rates == pytest.approx(code.states(np.concatenate([given, inputs[len(given) :]])))
    return increments, after, out[total - 1]


@pytest.fixture(scope="module")
def curve():
    """Two states that depend on each other and on time: x = exp(sin t), y = 1 / (2 + t)."""
    sources = [X * symengine.cos(T) * (Y * (2 + T)) ** 3, -(Y**2) + (X * symengine.exp(-symengine.sin(T)) - 1) * Y]
    return lanes_of([X, Y], [DX, DY], [], sources)


def exact(t):
    return np.array([np.exp(np.sin(t)), 1 / (2 + t)])


STEPS = 0.2 * 0.5 ** np.arange(LANES)
"""A step in each lane, half as long in each as in the one before."""


def orders(error):
    """Observed orders in the step, of errors above roundoff."""
    large = error[error > 1e-13]
    return np.log2(large[:-1] / large[1:])


def test_a_step_has_local_error_of_sixth_order_and_its_estimate_of_fifth(curve):
    t = 0.3
    increments, after, doubtful = stepped(curve, t, exact(t)[:, None], STEPS)
    assert not doubtful.any()
    for m in range(2):
        assert orders(abs(after[m] - exact(t + STEPS)[m]))[-1] > 5.7
        assert orders(abs(increments[-1, m]))[-1] > 4.7


@pytest.mark.parametrize("x", [0.2, 0.5, 0.9])
def test_dense_output_has_local_error_of_fifth_order(curve, x):
    t = 0.3
    increments, after, _ = stepped(curve, t, exact(t)[:, None], STEPS)
    bent = np.tensordot(DENSE, increments, 1)
    inside = (1 - x) * exact(t)[:, None] + x * (after + (1 - x) * (bent[0] + x * (bent[1] + x * bent[2])))
    for m in range(2):
        assert orders(abs(inside[m] - exact(t + x * STEPS)[m]))[-1] > 4.7


def test_nodes_are_the_sums_of_the_changes():
    """A rate that is one everywhere moves each stage by its node."""
    increments, _, _ = stepped(lanes_of([X], [DX], [], [symengine.Integer(1)]), 0.0, np.zeros((1, LANES)), 1.0)
    for factors, node in zip(CHANGES, NODES, strict=True):
        assert sum(factor * part[0, 0] for factor, part in zip(factors, increments, strict=False)) == pytest.approx(
            node, abs=1e-13
        )


@pytest.mark.parametrize("coupled", [False, True])
def test_a_light_node_follows_its_neighbours_however_stiff_it_is(coupled):
    """A node of capacity down to 1e-15 between two bodies of capacity one: its deviation is gone after one step."""
    light, heat = 10.0 ** -np.arange(1, 16, 2), 20.0 if coupled else 0.0
    sources = [Z - X, Z - Y, (X + Y - 2 * Z + heat * (1 - X)) / K]
    code = lanes_of([X, Y, Z], [DX, DY, DZ], [K], sources)
    _, after, doubtful = stepped(code, 0.0, np.array([1.2, 0.8, 3.0])[:, None] * np.ones(LANES), 0.1, [light])
    assert not doubtful.any()
    x, y, z = after[:, 3:]
    assert z == pytest.approx((x + y + heat * (1 - x)) / 2, abs=2e-3)
    if not coupled:
        kept = 2.0 + 3.0 * light  # all heat
        assert after[0] + after[1] + light * after[2] == pytest.approx(kept, rel=1e-12)


def test_digits_lost_in_a_matrix_are_told():
    """Two states that exchange: their sum is conserved, its part of the matrix is lost in that of a fast exchange."""
    speed = 10.0 ** np.arange(0, 16, 2)
    code = lanes_of([X, Y], [DX, DY], [K], [K * (Y - X) - X, K * (X - Y)])
    _, after, doubtful = stepped(code, 0.0, np.array([1.0, 1.0])[:, None] * np.ones(LANES), 0.1, [speed])
    wrong = abs(after.sum(axis=0) / after[:, 3:4].sum() - 1) > LINEAR_RTOL
    assert not doubtful[:4].any()
    assert doubtful[-2:].all()
    assert not np.any(wrong[4:] & (doubtful[4:] < 0.5))


def test_a_row_that_is_lost_in_another_is_told():
    """An oscillator: without exchanges of rows a step of many periods leaves a tiny pivot, over which it divides."""
    code = lanes_of([X, Y], [DX, DY], [], [Y, -X])
    *_, doubtful = stepped(code, 0.0, np.ones((2, LANES)), 10.0 ** np.arange(0, 16, 2))
    assert doubtful.tolist() == [0.0] * 5 + [1.0] * 3


def test_derivatives_that_are_zero_are_known(curve):
    code = lanes_of([X, Y, Z], [DX, DY, DZ], [], [-X, -Y, X + Y - Z])
    assert sorted(code.nonzeros) == [0, 4, 6, 7, 8]
    assert sorted(curve.nonzeros) == [0, 1, 2, 3, 4, 5]
