"""Tables as curves: through their points, of the right slope at both ends, and straight or level beyond them."""

import numpy as np
import pytest
import symengine
from scipy.interpolate import PchipInterpolator

from surfacechem.errors import InputError
from surfacechem.laws.heat_transfer import GapTable

AT, VALUES = (1.0, 2.5, 3.0, 5.0, 6.0), (4.0, 7.0, 7.5, 9.0, 9.8)
CUBICS = PchipInterpolator(AT, VALUES)


def curve(x, *, linear):
    law = GapTable(between=("a", "b"), gaps=AT, conductances=VALUES, extrapolation="linear" if linear else "hold")
    return law.conductance(g_n=x)


@pytest.mark.parametrize("linear", [False, True])
def test_a_curve_is_the_interpolation_of_its_points(linear):
    for x in np.linspace(AT[0], AT[-1], 41):
        assert curve(float(x), linear=linear) == pytest.approx(float(CUBICS(x)), rel=1e-14)


def test_beyond_its_ends_a_curve_goes_on_with_the_slope_of_its_ends():
    slopes = CUBICS.derivative()(np.array([AT[0], AT[-1]]))
    assert np.all(slopes > 0.1)
    for beyond in (0.25, 1.0):
        below, above = (curve(x, linear=True) for x in (AT[0] - beyond, AT[-1] + beyond))
        assert below == pytest.approx(VALUES[0] - slopes[0] * beyond, rel=1e-14)
        assert above == pytest.approx(VALUES[-1] + slopes[1] * beyond, rel=1e-14)
    assert curve(-1e6, linear=True) == 0.0


def test_beyond_its_ends_a_curve_may_stay_level():
    assert [curve(x, linear=False) for x in (-1e6, 1e6)] == [VALUES[0], VALUES[-1]]


@pytest.mark.parametrize("linear", [False, True])
def test_the_slope_of_a_curve_does_not_jump(linear):
    x = symengine.Symbol("x")
    slope = curve(x, linear=linear).diff(x)
    for point in AT if linear else AT[1:-1]:
        before, after = (float(slope.subs({x: point * (1 + side * 1e-9)})) for side in (-1, 1))
        assert after == pytest.approx(before, rel=1e-7)


@pytest.mark.parametrize(
    ("at", "values", "message"),
    [
        ((1.0, 2.0), (1.0,), r"needs as many gaps \(2\) as conductances \(1\)"),
        ((1.0,), (1.0,), "at least 2"),
        ((1.0, np.inf), (1.0, 2.0), "must be finite"),
        ((1.0, 2.0), (1.0, -2.0), "conductances not negative"),
        ((2.0, 2.0), (1.0, 2.0), "gaps of a table must increase"),
    ],
)
def test_a_table_that_is_none_is_refused(at, values, message):
    with pytest.raises(InputError, match=message):
        GapTable(between=("a", "b"), gaps=at, conductances=values)
