"""What the potentials of contact, cohesion and long range do, and what follows from them by differentiation."""

import math

import mpmath
import numpy as np
import pytest
import symengine
from scipy.integrate import quad
from test_laws import example
from thermodynamics import number

from surfacechem.contracts.terms import Friction, Potential, reads
from surfacechem.expressions import EXPONENT_CAP, derivative
from surfacechem.format.schema import schema
from surfacechem.laws import laws
from surfacechem.laws.cohesive import ExponentialCohesiveZone, XuNeedleman
from surfacechem.laws.free_energy import Quadratic
from surfacechem.laws.friction import Coulomb, Stribeck
from surfacechem.laws.loading import Hold
from surfacechem.laws.longrange import LennardJonesFlatFlat, VanDerWaalsSpherePlane
from surfacechem.model.assemble import assemble
from surfacechem.runs.listing import law_table
from surfacechem.scene import Body, Interface, Scene
from surfacechem.tolerances import REPULSION_WALL

GAPS = [law for law in laws(Potential).values() if {"g_n", "g_t"} & set(reads(law.energy))]
each_gap_law = pytest.mark.parametrize("law", GAPS, ids=lambda law: law.name())
g, g_t, phi, bonded, T, T_0 = symengine.symbols("g_n g_t phi bonded T_c T_0")


def symbolic(law: Potential):
    return symengine.sympify(law.energy(**{name: symengine.Symbol(name) for name in reads(law.energy)}))


def at(expression, **values: float) -> float:
    """To 60 digits, so that what is compared is the formula and not rounding."""
    point = {symengine.Symbol(name): mpmath.mpf(value) for name, value in values.items()}
    return float(number(expression, point))


def compiled(expression, **values: float) -> float:
    """In double precision, as a run evaluates it."""
    function = symengine.Lambdify([symengine.Symbol(name) for name in values], [expression], backend="llvm")
    return float(function(list(values.values()))[0])


@each_gap_law
def test_finite_everywhere(law):
    """Value, traction and tangent at gaps over 600 decades and of both signs, as compiled."""
    energy = symbolic(example(law, 1))
    names = sorted(str(symbol) for symbol in energy.free_symbols)
    sizes = [0.0, *(sign * 10.0**e for e in (-300, -30, -9, -3, 0, 3, 9, 30) for sign in (1, -1))]
    gaps = [name for name in names if name in ("g_n", "g_t")]
    order = [energy, *(derivative(energy, symengine.Symbol(x)) for x in gaps)]
    order += [derivative(derivative(energy, symengine.Symbol(x)), symengine.Symbol(y)) for x in gaps for y in names]
    function = symengine.Lambdify([symengine.Symbol(name) for name in names], order, backend="llvm")
    for size in sizes:
        for tangential in sizes:
            values = {"g_n": size, "g_t": tangential, "phi": 0.5, "bonded": 1.0, "N_c": 1e15}
            assert np.isfinite(function([values[name] for name in names])).all(), values


def test_cohesive_strength_and_work():
    zone = ExponentialCohesiveZone(t_max=1e6, g_0=1e-8, E_n=1e15)
    for energy in (symbolic(zone), symengine.sympify(zone.energy(g_n=g))):
        traction = derivative(energy, g)
        assert at(traction, g_n=1e-8, g_t=0.0) == pytest.approx(1e6, rel=1e-15)
        assert at(derivative(traction, g), g_n=1e-8, g_t=0.0) == pytest.approx(0.0, abs=1e-15 * 1e6 / 1e-8)
        assert at(traction, g_n=-1e-8, g_t=0.0) == -1e7
        small = compiled(traction, g_n=1e-300, g_t=0.0)
        assert small == pytest.approx(math.e * 1e6 / 1e-8 * 1e-300, rel=1e-14), "no cancellation"
    assert zone.energy(g_n=1.0) - zone.energy(g_n=0.0) == pytest.approx(math.e * 1e6 * 1e-8, rel=1e-15)
    for law in (zone, XuNeedleman(Phi_n=1.0, g_0=1e-8, g_t0=1e-8)):
        slope = derivative(symbolic(law), g)
        assert compiled(slope, g_n=1e-18, g_t=0.0) == pytest.approx(at(slope, g_n=1e-18, g_t=0.0), rel=1e-14)


def test_a_cohesive_zone_is_as_strong_in_shear_as_in_tension():
    """The traction is along the gap, whatever its direction, and pressure adds to it without softening."""
    t_max, g_0, E_n = 1e6, 1e-8, 1e15
    energy = symbolic(ExponentialCohesiveZone(t_max=t_max, g_0=g_0, E_n=E_n))
    normal, shear = derivative(energy, g), derivative(energy, g_t)
    for size in (1e-3, 1.0, 4.0):
        t = t_max * size * math.exp(1 - size)
        for angle in (0.0, 0.4, -0.4, math.pi / 2):
            c, s = math.cos(angle), math.sin(angle)
            gap = {"g_n": size * g_0 * c, "g_t": size * g_0 * s}
            found = at(normal, **gap), at(shear, **gap)
            assert found == pytest.approx((t * c, t * s), rel=1e-14, abs=1e-14 * t)
        pressed = at(normal, g_n=-1e-9, g_t=size * g_0), at(shear, g_n=-1e-9, g_t=size * g_0)
        assert pressed == pytest.approx((-E_n * 1e-9, t), rel=1e-14)
    closed = compiled(derivative(shear, g_t), g_n=0.0, g_t=0.0), compiled(derivative(normal, g), g_n=0.0, g_t=1e-30)
    assert closed == pytest.approx((math.e * t_max / g_0, E_n), rel=1e-14), "stiffness of a closed zone"


def test_van_der_waals_sphere_is_the_sum_of_its_shells():
    """A ball in front of a half-space: slices of the ball at their distance, each attracted as by A_H / (6 pi z^3)."""
    R, h = 5e-8, 2e-9
    slices, _ = quad(
        lambda s: math.pi * s * (2 * R - s) / (h + s) ** 4, 0.0, 2 * R, epsabs=0.0, epsrel=1e-12, limit=200
    )
    law = VanDerWaalsSpherePlane(A_H=6.5e-20, R=R, area=1e-16)
    force = 1e-16 * at(derivative(symbolic(law), g), g_n=h - 1.65e-10)
    assert force == pytest.approx(6.5e-20 / (2 * math.pi) * slices, rel=1e-10)


@pytest.mark.parametrize("delta", [0.5, 1.0, 2.0])
def test_stribeck_goes_from_static_to_sliding(delta):
    law = Stribeck(mu_s=0.6, mu_k=0.4, v_s=1e-3, delta=delta)
    assert law.limit(p=1e5) == 6e4
    for direction in (1.0, -1.0):
        speeds = (0.0, 1e-300, 1e-3, 1e6)
        found = [direction * law.traction(p=1e5, v=direction * v, direction=direction) for v in speeds]
        assert found == pytest.approx([6e4, 6e4, 4e4 + 2e4 / math.e, 4e4], rel=1e-14)
    viscous = Stribeck(mu_s=0.6, mu_k=0.4, v_s=1e-3, delta=delta, c_v=1e3)
    assert viscous.traction(p=1e5, v=100.0, direction=1.0) == pytest.approx(1.4e5, rel=1e-14)
    v = symengine.Symbol("v")
    slope = derivative(law.traction(p=1e5, v=v, direction=1.0), v)
    assert all(math.isfinite(compiled(slope, v=x)) for x in (0.0, 1e-300, -1e-9, 1.0, 1e9))
    assert law.traction(p=1e5, v=symengine.Integer(0), direction=symengine.Integer(1)) == 6e4


def test_a_coefficient_may_be_left_out_of_a_scene():
    """What is not given is no parameter of the scene, and listed so."""
    pair = Body("lower", "T", Quadratic(C=1.0)), Body("upper", "T", Quadratic(C=1.0))
    loading = {"v": Hold(level=0.1), "p": Hold(level=1e5)}
    for law, found in ((Coulomb(mu=0.3), ["mu_coulomb"]), (Coulomb(mu=0.3, mu_s=0.5), ["mu_coulomb", "mu_s"])):
        scene = Scene(pair, Interface("T", (), [law]), (), loading, None, 300.0, {"T": 300.0})
        names = [str(parameter.symbol) for parameter in assemble(scene).parameters]
        assert [name for name in names if name.startswith("mu")] == found
    assert "mu_s [1]: static friction coefficient; mu if not given, >= 0\n" in law_table(Friction)
    definition = schema()["$defs"]["friction.coulomb"]
    assert definition["required"] == ["mu"]
    assert "default" not in definition["properties"]["mu_s"]


def test_cohesion_that_is_pressed_hard_goes_on_along_its_tangent():
    law = XuNeedleman(Phi_n=0.1, g_0=1e-8, g_t0=2e-8, q=0.6, r=0.3)
    g, cap = symengine.Symbol("g"), mpmath.mpf(EXPONENT_CAP) * mpmath.mpf(1e-8)
    energy = law.energy(g_n=g, g_t=1e-8)
    value, slope = (lambda x, e=e: number(e, {g: x}) for e in (energy, derivative(energy, g)))
    before, beyond = -cap * (1 - mpmath.mpf(10) ** -30), -cap * (1 + mpmath.mpf(10) ** -30)
    assert value(beyond) == pytest.approx(value(before), rel=1e-13)
    assert slope(beyond) == pytest.approx(slope(before), rel=1e-13)
    assert value(-3 * cap) == pytest.approx(value(before) - 2 * cap * slope(before), rel=1e-13)


def test_repulsion_of_overlapping_atoms_goes_on_along_its_parabola():
    law = LennardJonesFlatFlat(n_1=2e19, n_2=3e19, psi_0=4e-21, g_0=3e-10)
    g, wall = symengine.Symbol("g"), mpmath.mpf(REPULSION_WALL) * mpmath.mpf(3e-10)
    value = law.energy(g_n=g)
    slope = derivative(value, g)
    curvature = derivative(slope, g)
    third = derivative(curvature, g)
    at = {side: {g: wall * (1 + side * mpmath.mpf(10) ** -12)} for side in (-1, 1)}
    for each in (value, slope, curvature):
        assert number(each, at[-1]) == pytest.approx(number(each, at[1]), rel=1e-9)
    assert number(third, at[-1]) == 0 != number(third, at[1])
