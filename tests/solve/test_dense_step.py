"""Crossings inside a step of a library: the same ones as the compiled stepper finds, on random polynomials."""

from functools import partial
from itertools import pairwise

import numpy as np
import pytest
import symengine as se
from solver_problems import problem

from surfacechem.compile.program import compile_program
from surfacechem.solve import solver
from surfacechem.solve.adapters.dense_step import (
    NODES,
    DenseStep,
    Guards,
    Steps,
    at_nodes,
    first_crossing,
    gained_at,
    hermite,
    on_step,
)
from surfacechem.solve.contract import Guard

GUARDS, DEGREE = 3, 4
CLOSEST = 2e-3
"""Least distance of a pair of zeros: a thirtieth of that of the points at which guards are looked at."""


@pytest.fixture(scope="module")
def clock():
    """y' = 1 with guards that are polynomials of y, their coefficients parameters."""
    t, y, dy = se.symbols("t y dy")
    p = se.symarray("p", GUARDS * (DEGREE + 1)).tolist()
    rows = [p[k * (DEGREE + 1) : (k + 1) * (DEGREE + 1)] for k in range(GUARDS)]
    guards = [sum(c * y**j for j, c in enumerate(row)) for row in rows]
    return compile_program(t, [y], [dy], p, [dy - 1], margins=guards)


def polynomial(rng: np.random.Generator, direction: int) -> np.ndarray:
    """Coefficients of a polynomial with three random zeros and a fourth beside one of them, such that the first of the
    pair counts.
    """
    zeros = rng.choice([0.15, 0.45, 0.75, 1.05, 1.35], 3, replace=False) + rng.uniform(-0.05, 0.05, 3)
    monic = np.poly([*zeros, zeros[0] + CLOSEST * (1 + rng.exponential())])
    before = np.sign(np.polyval(monic, zeros[0] - CLOSEST))
    return monic[::-1] * 10.0 ** rng.uniform(-6, 6) * (-direction * before or rng.choice([-1.0, 1.0]))


@pytest.mark.parametrize("seed", range(40))
def test_the_stepper_finds_the_same(clock, seed):
    rng = np.random.default_rng(seed)
    directions = rng.integers(-1, 2, GUARDS).tolist()
    rows = np.array([polynomial(rng, d) for d in directions])
    kinds = tuple(Guard(True, d, strict=d == -1 and bool(rng.integers(2))) for d in directions)
    active = tuple(bool(flag) for flag in rng.random(GUARDS) < 0.8)
    case = problem(clock, [0.0], [0.0, 1.0], 1e-9, parameters=rows.ravel(), margins=kinds, active=active)
    found = solver("radau").solve(case).events

    def values(_t: float, x: np.ndarray) -> np.ndarray:
        return np.array([np.polyval(row[::-1], x[0]) for row in rows])

    guards, at_once = Guards.of(kinds, values), Guards.of(kinds, values)
    at_once.rows = lambda _, x: np.array([values(0.0, row) for row in x])
    step = DenseStep(0.0, 1.0, lambda t: np.array([t]))
    for each in (guards, at_once):
        each.start(values(0.0, np.zeros(1)))
        t, fired = first_crossing(step, each, np.array(active), 1e-10)
        assert fired == found.index.tolist()
        assert t == pytest.approx(found.t[0] if fired else 1.0, rel=1e-9)
    state = [[vars(each)[name].tolist() for name in ("sides", "largest", "now", "due")] for each in (guards, at_once)]
    assert state[0] == state[1]


def test_what_has_just_fired_has_to_leave_zero_first():
    guards = Guards.of([Guard.restart()], lambda t, _: np.array([t * (1.0 - t)]))
    step = DenseStep(0.0, 2.0, lambda _: np.zeros(0))
    guards.start(np.array([1e-20]), fired=[0])
    t, fired = first_crossing(step, guards, np.ones(1, bool), 0.0)
    assert fired == [0]
    assert t == pytest.approx(1.0, rel=1e-14)


def test_a_guard_too_small_for_a_parabola_has_no_zero():
    guards = Guards.of([Guard.stop()], lambda t, _: np.array([5e-324 * (1.0 + abs(t - 0.5) * 100.0)]))
    guards.start(np.array([5e-324 * 51.0]))
    assert first_crossing(DenseStep(0.0, 1.0, lambda _: np.zeros(0)), guards, np.ones(1, bool), 0.0) == (1.0, [])


def test_a_guard_that_jumps_right_after_no_time_is_found_there():
    jump, nothing = 1e-300, np.zeros(0)
    guards = Guards.of([Guard.stop()], lambda t, _: np.array([1.0 if t < jump else -1e-57]))
    guards.start(np.array([1.0]))
    t, fired = first_crossing(DenseStep(0.0, 1e-15, lambda _: nothing), guards, np.ones(1, bool), 0.0)
    assert fired == [0]
    assert t == pytest.approx(jump, rel=1e-14)


def test_a_polynomial_follows_from_its_derivatives_at_the_ends_of_a_step():
    power = np.polynomial.Polynomial([3.0, -1.0, 4.0, 1.0, -5.0, 9.0])
    times = np.array([0.5, 2.0, 2.25])
    ends = np.array([[[power.deriv(k)(t)] for k in range(3)] for t in times])
    rows = hermite(np.diff(times), ends)
    for k, (start, end) in enumerate(pairwise(times)):
        nodes = start + (end - start) * NODES
        np.testing.assert_allclose(on_step(end, end - start, rows[k], nodes)[:, 0], power(nodes), atol=1e-12)
        np.testing.assert_allclose(at_nodes(rows)[k, :, 0], power(nodes[1:]), atol=1e-12)
    pairs = zip(pairwise(times), rows, strict=True)
    one = [DenseStep(*pair, partial(on_step, pair[1], pair[1] - pair[0], row)) for pair, row in pairs]
    for last in (2.25, 2.125):  # the second step is cut
        nodes = np.array([0.5 + 1.5 * NODES[1:], 2.0 + (last - 2.0) * NODES[1:]]).T
        for steps in (Steps.of(one), Steps(times, one.__getitem__, at_nodes(rows))):
            np.testing.assert_allclose(steps.at_nodes(nodes)[:, 0], power(nodes.ravel()), atol=1e-12)


def test_a_ledger_is_the_integral_of_its_rates():
    times = 2.0 + 3.0 * NODES
    gained = 3.0 * gained_at(2.0 / 3.0, (times**4)[:, None])
    assert gained[0] == pytest.approx((4.0**5 - 2.0**5) / 5, rel=1e-13)
