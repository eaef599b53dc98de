"""Steps serve the ledger too where the states hardly feel what it integrates."""

import numpy as np
import pytest
import symengine as se
from solver_problems import problem

import surfacechem
from surfacechem.compile.program import compile_program
from surfacechem.solve import solver
from surfacechem.solve.contract import Status

RTOL = 1e-11
radau = solver("radau")


def booked(rate, end, x_0=0.0, group=0):
    """A quadrature beside x' = 1 - x: its values at the end of a run, and the steps and refusals."""
    t, x, dx = se.symbols("t x dx")
    program = compile_program(t, [x], [dx], [], [dx - 1 + x], ledger=[rate(t, x, dx)], groups=(group,))
    result = radau.solve(problem(program, [x_0], [0.0, end], RTOL, times=[end]))
    assert result.status == Status.FINISHED
    return result.ledger[0], result.counters


def wall(t):
    """Power of the repulsion 1/g^9 on the gap g = 1/10 + (t - 1)^2."""
    return -9 * (se.Rational(1, 10) + (t - 1) ** 2) ** -10 * 2 * (t - 1)


def test_work_on_a_gap_that_is_moved_through_a_steep_wall():
    work, counters = booked(lambda t, x, dx: wall(t), 1.5)
    exact = 0.35**-9 - 1.1**-9
    assert work == pytest.approx(exact, abs=1e-9 * 0.1**-9)
    assert counters.rejected > 0
    open_work, few = booked(lambda t, x, dx: wall(t), 1.5, group=-1)
    assert abs(open_work - exact) > 1e-6 * 0.1**-9
    assert few.steps < counters.steps


def test_logarithm_of_a_coverage_that_starts_at_zero():
    """The integral of ln(x) dx from 0 is x ln(x) - x."""
    entropy, _ = booked(lambda t, x, dx: dx * se.log(se.Max(x, 1e-300)), 1.0)
    x = 1 - np.exp(-1.0)
    assert entropy == pytest.approx(x * np.log(x) - x, abs=1e-8)


def test_a_rate_that_is_noise_does_not_hold_up_a_run():
    """The rate is the rounding of x + 10^6."""
    _, counters = booked(lambda t, x, dx: ((x + 1e6) - 1e6) - x, 5.0)
    _, alone = booked(lambda t, x, dx: ((x + 1e6) - 1e6) - x, 5.0, group=-1)
    assert counters.steps < 10 * alone.steps + 100


@pytest.mark.parametrize("name", ["l-selectin-tether", "elastic-bonds-at-a-gap"])
def test_bonds_that_start_at_full_coverage(name):
    assert surfacechem.run(name).audit.entropy_error < 1e-8
