"""Forces of pairs of points and of laws of the gap: closed forms, balance, order of convergence, limits."""

import math

import mpmath
import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from surfacechem.errors import InputError
from surfacechem.laws.free_energy import BondedContact, EquilibriumBonds, Penalty
from surfacechem.laws.heat_transfer import GasGap
from surfacechem.laws.longrange import InversePower, PairTable, PenaltyPair
from surfacechem.quantities import BOLTZMANN
from surfacechem.surfaces import patches
from surfacechem.surfaces.forces import between_flats, density, interaction, over_gap
from surfacechem.surfaces.inner_sums import LAST_LEVEL, inner_sums
from surfacechem.surfaces.potential import CurvedSurfaces
from surfacechem.surfaces.projection import Surface
from surfacechem.surfaces.shapes import Cone, Cylinder, Disc, Paraboloid, Plane, Sphere, Torus

GAS = density(GasGap(between=("a", "b"), k=0.026, M=0.3))


@pytest.fixture(autouse=True)
def forty_digits():
    with mpmath.workdps(40):
        yield


def power(m):
    return InversePower(n_1=2.0, n_2=3.0, psi_0=1 / 6, r_0=1.0, m=m)


def pair(lower, upper, d, laws, rtol=1e-10):
    return interaction(Surface(lower), Surface(upper, True, d), laws, rtol)


def closed(c, R_1, R_2, m):
    """Double integral of r^-m over two spheres whose centres are c apart; for even m also over one in another."""
    ends = (c + R_1 + R_2, c + R_2 - R_1, c - R_2 + R_1, c - R_1 - R_2)
    sums = sum(sign * mpmath.mpf(end) ** (3 - m) for sign, end in zip((1, -1, -1, 1), ends, strict=True))
    return 4 * mpmath.pi**2 * R_1 * R_2 / (mpmath.mpf(c) * (2 - m) * (3 - m)) * sums


@pytest.mark.parametrize("m", [4, 6, 10])
@pytest.mark.parametrize("d", [1e-3, 0.1, 1.0, 10.0])
def test_two_spheres_are_closed_forms(d, m):
    c = 3 + mpmath.mpf(d)
    found = pair(Sphere(R=1.0), Sphere(R=2.0), d, [power(m)])
    assert found.energy[0] == pytest.approx(float(closed(c, 1, 2, m)), rel=1e-10)
    slope = mpmath.diff(lambda x: closed(x, 1, 2, m), c)
    assert found.force_2[0, 2] == pytest.approx(float(-slope), rel=1e-10)
    assert np.abs(found.force_1 + found.force_2).max() <= 1e-13 * np.abs(found.force_1).max()
    assert np.abs(found.moment_1 + found.moment_2).max() <= 1e-13 * np.abs(found.force_1).max() * 4


@pytest.mark.parametrize(("lower", "upper"), [(Sphere(R=1.0), Sphere(R=2.0)), (Sphere(R=1.0), Torus(hole=1.0, r=0.5))])
def test_both_half_passes_have_one_energy_and_opposite_forces_where_densities_differ(lower, upper):
    """Each sums over its own surface what it feels of the other, by a rule that is no part of the program."""
    law, bodies = power(6), (Surface(lower), Surface(upper, True, 0.5))
    whole, halves = pair(lower, upper, 0.5, [law]), []
    x, w = np.polynomial.legendre.leggauss(60)
    for own, other in (bodies, bodies[::-1]):
        (low, high), _ = own.shape.span
        u = (low + high) / 2 + (high - low) / 2 * x
        points, areas = own.elements(np.stack([u, np.zeros_like(u)], axis=-1))
        area = math.pi * (high - low) * w * areas
        ((energy, push),), _ = inner_sums(other, points, [law], LAST_LEVEL, 1e-12)
        halves.append((law.n_1 * law.n_2 * area @ energy, law.n_1 * law.n_2 * area @ push[:, 2]))
    (energy, force), (same, opposite) = halves
    assert energy == pytest.approx(same, rel=1e-10)
    assert force == pytest.approx(-opposite, rel=1e-10)
    assert (energy, force) == pytest.approx((whole.energy[0], whole.force_1[0, 2]), rel=1e-9)


def test_cylinders_are_what_a_sum_around_both_of_them_gives():
    """Along a line r^-6 gives 3 pi / (8 a^5), over a plane pi / (2 h^4), and the trapezium rule converges at once."""
    d, R_1, R_2, n = 0.3, 1.0, 2.0, 480
    one, other = np.meshgrid(*[2 * math.pi * np.arange(n) / n] * 2)
    heights = [R * (1 - np.cos(angle)) for R, angle in ((R_1, one), (R_2, other))]
    apart = np.hypot(R_1 * np.sin(one) - R_2 * np.sin(other), d + sum(heights))
    area = R_1 * R_2 * (2 * math.pi / n) ** 2
    parallel = area * np.sum(3 * math.pi / 8 * apart**-5)
    crossed = area * np.sum(math.pi / 2 * (d + sum(heights)) ** -4)
    lower, across = Cylinder(R=R_1, length=1.0), Cylinder(R=R_2, turn=math.pi / 2)
    assert pair(lower, Cylinder(R=R_2), d, [power(6)]).energy[0] == pytest.approx(parallel, rel=1e-10)
    assert pair(Cylinder(R=R_1), across, d, [power(6)], 1e-5).energy[0] == pytest.approx(crossed, rel=1e-5)


def test_tilted_plates_are_the_sum_over_both_and_balance_whichever_carries_the_nodes():
    """Gauss's rule on both plates, far enough apart, has 14 digits with 24 points in each direction."""
    plates = Plane(length=1.0, width=0.7), Plane(length=0.8, width=1.0, tilt=0.2)
    x, w = np.polynomial.legendre.leggauss(24)
    u, v, a, b = np.meshgrid(0.5 * x, 0.35 * x, 0.4 * x, 0.5 * x, indexing="ij", sparse=True)
    lower = np.stack(np.broadcast_arrays(u, v, 0 * a * b)[:3])
    away = np.stack(np.broadcast_arrays(u - math.cos(0.2) * a, v - b, -0.6 - math.sin(0.2) * a))
    weights = 0.5 * 0.35 * 0.4 * 0.5 * np.einsum("i,j,k,l->ijkl", w, w, w, w)
    r = np.linalg.norm(away, axis=0)
    push = 6 * weights * r**-8.0 * away
    moment = np.cross(lower, push, axis=0)
    found = pair(*plates, 0.6, [power(6)])
    assert found.energy[0] == pytest.approx(np.sum(weights * r**-6.0), rel=1e-10)
    size = np.abs(found.force_1).max()
    assert found.force_1[0] == pytest.approx(push.sum(axis=(1, 2, 3, 4)), abs=1e-10 * size)
    assert found.moment_1[0] == pytest.approx(moment.sum(axis=(1, 2, 3, 4)), abs=1e-10 * size)
    mirrored = pair(*plates[::-1], 0.6, [power(6)])
    assert found.energy == pytest.approx(mirrored.energy, rel=1e-10)
    assert found.force_1[0] == pytest.approx(mirrored.force_2[0] * [1, 1, -1], abs=1e-10 * size)
    net = np.abs(found.moment_1 + found.moment_2).max()
    assert net <= 1e-13 * size
    turning = found.moment_1[0, 1]
    assert abs(turning) > 1e3 * net


def test_the_force_is_the_slope_of_the_energy_and_the_moment_of_its_tilt():
    h, law = 1e-4, [power(4)]
    low, middle, high = (pair(Torus(hole=1.0, r=0.5), Plane(), d, law, 1e-11) for d in (0.2 - h, 0.2, 0.2 + h))
    assert (low.energy[0] - high.energy[0]) / (2 * h) == pytest.approx(middle.force_2[0, 2], rel=1e-6)
    low, middle, high = (pair(Torus(hole=1.0, r=0.5, tilt=a), Plane(), 0.3, law, 1e-9) for a in (0.1 - h, 0.1, 0.1 + h))
    assert (low.energy[0] - high.energy[0]) / (2 * h) == pytest.approx(middle.moment_1[0, 1], rel=3e-6)


def test_the_local_law_errs_by_gap_over_radius_and_derjaguin_is_its_limit():
    """Also for bodies of different densities: the product counts."""
    law, bodies = power(6), (Sphere(R=1.0), Sphere(R=1.0))
    for of in ("local", "derjaguin"):
        errors = []
        for d in (1e-2, 1e-3):
            exact = pair(*bodies, d, [law]).force_1[0, 2]
            local = over_gap(Surface(bodies[0]), Surface(bodies[1], True, d), [between_flats(law)]).force_1[2]
            derjaguin = -math.pi * 2 * math.pi / 4 * d**-4
            errors.append((local if of == "local" else derjaguin) / exact - 1)
        assert errors[0] / errors[1] == pytest.approx(10, rel=0.02)
        assert abs(errors[1]) < 2e-3


def test_between_flats_ends_with_a_law():
    """W(g) = 2 pi n_1 n_2 times the integral of r psi from g to the end of the law."""
    k, end = 2.0, 3.0
    law = PenaltyPair(n_1=0.5, n_2=2.0, k=k, r_0=end)
    g = np.array([[1e-9, 0.5], [2.9, 3.1]])
    psi, traction = np.moveaxis(between_flats(law)(g), -1, 0)
    left = np.maximum(end - g, 0)
    assert psi == pytest.approx(math.pi * k * (end * left**3 / 3 - left**4 / 4), rel=1e-12)
    assert traction == pytest.approx(-math.pi * k * g * left**2, rel=1e-12)


def test_the_local_law_of_pairs_bends_where_they_do():
    """Between a plane and a sphere, body 1, it is 2 pi R W(d) with the energy W between flats."""
    law, d = PairTable(n_1=1.0, n_2=1.0, distances=[0.5, 1.0, 1.5, 2.0], energies=[4.0, 1.0, -0.5, 0.0]), 0.8
    surfaces = CurvedSurfaces(shapes=(Sphere(R=9.0), Plane()), pairs=[law], approach=(0.7, 0.9), accuracy=1e-12)
    psi = mpmath.quad(lambda r: 2 * mpmath.pi * r * law.energy(float(r)), [d, 1.0, 1.5, 2.0])
    contact = surfaces.contact(d)
    assert float(contact.force_1[2]) == pytest.approx(-2 * math.pi * 9.0 * float(psi), rel=1e-11)
    assert contact.error <= 1e-12


def test_a_sphere_pressed_into_a_penalty():
    """Over the sphere dA = 2 pi R dz, so that F = pi E R delta^2, and the area that overlaps is 2 pi R delta."""
    E, R, delta = 3.0, 2.0, 0.1
    found = over_gap(Surface(Sphere(R=R)), Surface(Plane(), True, -delta), [density(Penalty(E_n=E))])
    assert found.force_2[2] == pytest.approx(math.pi * E * R * delta**2, rel=1e-12)
    assert found.energy == pytest.approx(math.pi * E * R * delta**3 / 3, rel=1e-12)
    assert found.area == pytest.approx(2 * math.pi * R * delta, rel=1e-12)
    assert np.abs(found.moment_1 + found.moment_2).max() <= 1e-13


def test_bonds_in_equilibrium_are_the_least_free_energy_and_hold_a_sphere_by_their_energy_between_flats():
    law = EquilibriumBonds(N=1e16, K=50.0, k_b=1e-3, T=300.0, l_0=1e-9)
    heat, g = BOLTZMANN * 300.0, 3e-9

    def free(phi):
        mixing = heat * (phi * math.log(phi) + (1 - phi) * math.log(1 - phi) - phi * math.log(50.0))
        return 1e16 * (mixing + phi * 1e-3 * (g - 1e-9) ** 2 / 2)

    least = minimize_scalar(free, bounds=(1e-6, 1 - 1e-6), method="bounded", options={"xatol": 1e-10})
    assert law.energy(g) == pytest.approx(least.fun, rel=1e-12)
    R = 1e-6
    found = over_gap(Surface(Sphere(R=R)), Surface(Plane(), True, g), [density(law)])
    assert found.force_1[2] == pytest.approx(2 * math.pi * R * (law.energy(g + 2 * R) - law.energy(g)), rel=1e-10)


class Slow(InversePower):
    """A law that says that it falls off faster than it does."""

    decay = 4.0
    parts = None


SLOW = Slow(n_1=1e18, n_2=1e18, psi_0=-4e-21, r_0=1e-9, m=2.2)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: pair(Sphere(R=1.0), Plane(), -0.1, [power(4)]), "overlap or touch, their gap is -0.1 m"),
        (lambda: pair(Plane(), Plane(turn=0.3), 1.0, [power(6)]), "surfaces are endless: give one of them a length"),
        (lambda: pair(Plane(), Cylinder(R=1.0, turn=0.3), 1.0, [power(6)]), "both surfaces are endless"),
        (lambda: pair(Plane(), Disc(), 1e-9, [power(4.0)]), "give the disc a radius"),
        (lambda: pair(Plane(), Cone(slope=0.7), 1e-9, [power(3.0)]), "give the cone a radius"),
        (lambda: pair(Plane(), Paraboloid(R=1e-8), 1e-9, [power(3.0)]), "give the paraboloid a radius"),
        (lambda: pair(Plane(), Sphere(R=1e-8), 1e-9, [power(2.01)]), "too slowly for the accuracy 1e-10"),
        (lambda: pair(Plane(), Sphere(R=5e-8), 1e-9, [SLOW]), r"slow falls off like r\^-2.2 .* slower than r\^-4"),
        (
            lambda: over_gap(Surface(Paraboloid(R=1.0)), Surface(Plane(), True, 0.1), [], heat=[GAS]),
            "conductance .* no end",
        ),
        (lambda: density(BondedContact(E_n=1.0)), "reads bonded; .* the gap g_n alone"),
        (lambda: PairTable(n_1=1, n_2=1, distances=[1, 2, 3], energies=[1, 2, 3]), "the last energy is 3 J"),
        (lambda: PairTable(n_1=1, n_2=1, distances=[1, 2], energies=[1, 0]), "at least 3"),
        (lambda: PairTable(n_1=1, n_2=1, distances=[1, 2, 3], energies=[1, -1, 0]), "first two energies"),
        (lambda: InversePower(n_1=1, n_2=1, psi_0=1, r_0=1, m=2), "m = 2 is outside its range: > 2"),
        (
            lambda: pair(Paraboloid(R=1.0), Sphere(R=1.0), 0.1, [power(6)], 1e-17),
            "1e-17 of an integral .* out of reach",
        ),
    ],
)
def test_what_has_no_integral_is_refused(make, message, monkeypatch):
    monkeypatch.setattr(patches, "MOST_POINTS", 1_000_000)
    with pytest.raises(InputError, match=message):
        make()


def test_cylinders_that_overlap_are_seen_however_large_their_angles_are_as_numbers():
    """Crossed cylinders are, near their point of contact, a paraboloid whose flats at one gap are ellipses."""
    R, r, depth, stiffness = 5e-8, 2e-8, 1e-10, 1e16
    lower, upper = Surface(Cylinder(R=R)), Surface(Cylinder(R=r, turn=math.pi / 2), True, -depth)
    found = over_gap(lower, upper, [density(Penalty(E_n=stiffness))], rtol=1e-3)
    shallow = math.pi * math.sqrt(R * r) * depth**2 * stiffness
    assert math.isclose(-found.force_1[2], shallow, rel_tol=5 * depth / r)


@pytest.mark.parametrize("turned", [False, True])
def test_laws_side_by_side_are_what_they_are_alone(turned):
    laws = [InversePower(n_1=1.0, n_2=1.0, psi_0=-1.0, r_0=1.0, m=6), PenaltyPair(n_1=1.0, n_2=1.0, k=1.0, r_0=1.5)]
    lower, upper = Plane(), Sphere(R=2.0)
    both = pair(lower, upper, 1.0, laws[::-1] if turned else laws, rtol=1e-4).energy
    alone = [pair(lower, upper, 1.0, [law], rtol=1e-4).energy[0] for law in laws]
    np.testing.assert_allclose(both[::-1] if turned else both, alone, rtol=1e-3)


def test_bodies_that_are_far_apart_see_all_of_each_other():
    """A sphere and a cylinder as a point and a line."""
    found = pair(Cylinder(R=1.0), Sphere(R=1.0), 100.0, [power(6)], rtol=1e-6)
    line = 4 * math.pi * 2 * math.pi * 3 * math.pi / 8 / 102.0**5
    assert float(found.energy[0]) == pytest.approx(line, rel=2e-3)
