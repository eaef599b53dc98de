"""Polynomials that are written about a point keep their digits beside it."""

from fractions import Fraction

import pytest
import symengine

from surfacechem.model.balances import conditioned

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
