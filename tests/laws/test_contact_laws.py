"""What the potentials of contact, cohesion and long range do, and what follows from them by differentiation."""

import math

import mpmath
import pytest
import symengine
from scipy.integrate import quad
from thermodynamics import number

from surfacechem.contracts.terms import Friction, Potential, reads
from surfacechem.expressions import derivative
from surfacechem.format.schema import schema
from surfacechem.laws.free_energy import Quadratic
from surfacechem.laws.friction import Coulomb
from surfacechem.laws.loading import Hold
from surfacechem.laws.longrange import VanDerWaalsSpherePlane
from surfacechem.model.assemble import assemble
from surfacechem.runs.listing import law_table
from surfacechem.scene import Body, Interface, Scene

g, g_t, phi, bonded, T, T_0 = symengine.symbols("g_n g_t phi bonded T_c T_0")


def symbolic(law: Potential):
    return symengine.sympify(law.energy(**{name: symengine.Symbol(name) for name in reads(law.energy)}))


def at(expression, **values: float) -> float:
    """To 60 digits, so that what is compared is the formula and not rounding."""
    point = {symengine.Symbol(name): mpmath.mpf(value) for name, value in values.items()}
    return float(number(expression, point))


def test_van_der_waals_sphere_is_the_sum_of_its_shells():
    """A ball in front of a half-space: slices of the ball at their distance, each attracted as by A_H / (6 pi z^3)."""
    R, h = 5e-8, 2e-9
    slices, _ = quad(
        lambda s: math.pi * s * (2 * R - s) / (h + s) ** 4, 0.0, 2 * R, epsabs=0.0, epsrel=1e-12, limit=200
    )
    law = VanDerWaalsSpherePlane(A_H=6.5e-20, R=R, area=1e-16)
    force = 1e-16 * at(derivative(symbolic(law), g), g_n=h - 1.65e-10)
    assert force == pytest.approx(6.5e-20 / (2 * math.pi) * slices, rel=1e-10)


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
