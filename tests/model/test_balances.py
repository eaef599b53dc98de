"""Balances keep the digits of what is small in them: polynomials beside a point, heat beside mechanical power."""

from fractions import Fraction

import pytest
import symengine

from surfacechem.model.balances import Rows, conditioned

X = symengine.Symbol("x")
BESIDE = 1.0 + 2.0**-20


@pytest.mark.parametrize("power", [1, 2, 3, 4, 5])
def test_what_is_nearly_nothing_beside_a_point_keeps_its_digits(power):
    expanded = symengine.expand((X - 1) ** power)
    exact = float((Fraction(BESIDE) - 1) ** power)
    found = float(conditioned(expanded, {X: symengine.Integer(1)}).subs({X: BESIDE}))
    assert found == pytest.approx(exact, rel=1e-14, abs=0)


def test_a_polynomial_stays_the_same():
    y = symengine.Symbol("y")
    polynomial = 3 - 2 * X + 5 * X**2 * y - 7 * X**4 + y**3
    again = conditioned(polynomial, {X: symengine.Integer(2), y: symengine.Rational(1, 3)})
    assert symengine.expand(again - polynomial) == 0


def test_what_is_no_polynomial_is_left_alone():
    for expression in (symengine.exp(X), X**9, 1 / X):
        assert conditioned(expression, {X: symengine.Integer(1)}) == expression


def test_the_row_of_momentum_is_the_balance_or_keeps_what_is_held():
    rows, (inertia, force, moves) = Rows(), symengine.symbols("inertia force moves")
    rows.momentum("v_t", force, 1, moves, inertia)
    assert symengine.expand(rows["v_t"].subs({moves: 1})) == inertia - force
    assert rows["v_t"].subs({moves: 0}) == symengine.Symbol("dv_t_dt")


def test_the_row_of_a_logarithm_is_the_rate_per_bond():
    """From x' = c x - k with x = exp(y): y' = c - k exp(-y)."""
    rows, (y, dy, c, k) = Rows(), symengine.symbols("y dy_dt c k")
    rows["x"] = symengine.exp(y) * dy - (c * symengine.exp(y) - k)
    rows.logarithm("x", y, "y", rows["x"])
    assert list(rows) == ["y"]
    assert symengine.expand(rows["y"] - (dy - c + k * symengine.exp(-y))) == 0
