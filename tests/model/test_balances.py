"""Balances keep the digits of what is small in them: polynomials beside a point, heat beside mechanical power."""

from fractions import Fraction

import mpmath
import pytest
import scenes
import symengine
import thermodynamics as laws

from surfacechem.laws.free_energy import Constant
from surfacechem.laws.loading import Ramp
from surfacechem.laws.longrange import LennardJonesFlatFlat, LennardJonesSpherePlane
from surfacechem.model.assemble import assemble
from surfacechem.model.balances import Rows, conditioned
from surfacechem.scene import Body, Interface, Scene

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


def test_the_power_of_elastic_tractions_leaves_the_balance_of_energy():
    """It is stored as it flows in, and would leave its rounding, which may be larger than all heat."""
    common = {"n_1": 1e19, "n_2": 1e19, "psi_0": 1e-21}
    potentials = [
        LennardJonesSpherePlane(**common, g_0=2e-6, R=1e-4, area=1e-12),
        LennardJonesFlatFlat(**common, g_0=3e-6),
    ]
    bodies = Body("lower", "T", Constant(C=1.0)), Body("upper", "T", Constant(C=1.0))
    loading = {"g_n": Ramp(start=2e-8, rate=2e-9)}
    system = assemble(Scene(bodies, Interface("T", potentials), [], loading, None, 300.0, {"T": 300.0}))
    read = {str(x) for x in system.expand(system.rows["T"]).free_symbols}
    assert read <= {"T", "dT_dt", "T_0", "C_1", "C_2"}


def test_maxwell_relations():
    """The mixed derivatives of one potential agree: dt_n/dphi = dM/dg_n, dS/dg_n = -dt_n/dT, dS/dphi = -dM/dT."""
    system = assemble(scenes.coupled())
    g, phi, T = (symengine.Symbol(name) for name in ("g_n", "phi", "T_c"))
    t_n, M, S = (system.find(name).expression for name in ("t_n", "M", "S_c"))
    point = laws.consistent_point(system, 0) | {g: mpmath.mpf(1e-6), symengine.Symbol("g_t"): mpmath.mpf(1e-7)}
    for left, right in [(t_n.diff(phi), M.diff(g)), (S.diff(g), -t_n.diff(T)), (S.diff(phi), -M.diff(T))]:
        assert laws.number(left, point) != 0
        assert laws.closes([left], [right], point)


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
