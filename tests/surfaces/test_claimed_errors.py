"""Whatever an integral is said to be off by, it is not off by more: against sums over pairs of points by hand.

With P(g) the integral of psi r (r - g) from g on, a sphere over a plane has 4 pi^2 R times P at its nearest point less
that at its farthest; two spheres whose centres are c apart have 4 pi^2 R_1 R_2 / c times the sum of P at the four
distances along the line of their centres, with signs.
"""

import math
from itertools import pairwise

import numpy as np
import pytest
from sampling import every
from scipy.interpolate import PchipInterpolator

from surfacechem.laws.free_energy import Penalty
from surfacechem.laws.longrange import InversePower, LennardJonesPair, PairTable, PenaltyPair
from surfacechem.surfaces.forces import density, interaction, over_gap
from surfacechem.surfaces.projection import Surface
from surfacechem.surfaces.shapes import Cap, Cavity, Cone, Cylinder, Disc, Paraboloid, Plane, Sphere

DENSITIES = {"n_1": 1.0, "n_2": 1.0}
R, PSI = [0.1, 0.4, 0.5, 0.9, 1.2], [8.0, 1.0, -1.0, -0.5, 0.0]
ENDLESS, ENDED = 0.1 * 2.0 ** np.arange(60), [0.0, *R]
LAWS = {
    "power": (InversePower(**DENSITIES, psi_0=-1.0, r_0=1.0, m=6), lambda r: -(r**-6.0), ENDLESS),
    "lennard-jones": (
        LennardJonesPair(**DENSITIES, psi_0=1.0, g_0=0.3),
        lambda r: (0.3 / r) ** 10 / 45 - (0.3 / r) ** 4 / 3,
        ENDLESS,
    ),
    "penalty": (PenaltyPair(**DENSITIES, k=1.0, r_0=1.2), lambda r: (1.2 - r) ** 2 / 2, ENDED),
    "table": (PairTable(**DENSITIES, distances=R, energies=PSI), PchipInterpolator(R, PSI), ENDED),
}
PENALTY = [density(Penalty(E_n=1.0))]
GAPS = 0.15, 1.0633, 1.1999, 1.3
"""Near, where the end of a law lies between nodes, barely in reach, and beyond."""
X, W = np.polynomial.legendre.leggauss(20)


def moments(psi, ends, g):
    """The integral of psi r (r - g) from g on, and its slope, between places at which a law bends."""
    places = [g, *(end for end in ends if end > g)]
    found = np.zeros(2)
    for low, high in pairwise(places):
        r = low + (high - low) * (X + 1) / 2
        found += (high - low) / 2 * np.array([np.sum(W * psi(r) * r * (r - g)), -np.sum(W * psi(r) * r)])
    return found


def summed(parts, centres, psi, ends):
    """Energy and its slope over the approach, from signs, distances and their rates, over that of the centres."""
    whole, slope = np.zeros(2)
    for sign, g, rate in parts:
        value, bend = moments(psi, ends, g)
        whole, slope = whole + sign * value, slope + sign * rate * bend
    c, rate = centres
    return whole / c, slope / c - rate * whole / c**2


def sphere_over_plane(d):
    """Of radius 50."""
    return 4 * math.pi**2 * 50, [(1, d, 1), (-1, d + 100, 1)], (1.0, 0.0)


def spheres(d):
    """Of radii 1 and 3."""
    return 4 * math.pi**2 * 3, [(1, d, 1), (-1, d + 2, 1), (-1, d + 6, 1), (1, d + 8, 1)], (d + 4, 1)


def sphere_in_cavity(d):
    """Of radii 2 and 10."""
    return 4 * math.pi**2 * 20, [(1, d, 1), (-1, d + 4, 1), (-1, 16 - d, -1), (1, 20 - d, -1)], (8 - d, -1)


@pytest.mark.parametrize("law", every(2, LAWS))
@pytest.mark.parametrize(
    ("lower", "upper", "exact"),
    [
        (Sphere(R=50.0), Plane(), sphere_over_plane),
        (Sphere(R=1.0), Sphere(R=3.0), spheres),
        (Cavity(R=10.0), Sphere(R=2.0), sphere_in_cavity),
    ],
)
def test_no_error_is_larger_than_claimed(lower, upper, exact, law):
    law, psi, ends = LAWS[law]
    for d in GAPS:
        reach = min(d, law.cutoff - d) if law.cutoff > d else d
        factor, parts, centres = exact(d)
        energy, force = (factor * value for value in summed(parts, centres, psi, ends))
        for rtol in (1e-3, 1e-6, 1e-10):
            found = interaction(Surface(lower), Surface(upper, True, d), [law], rtol)
            assert abs(found.energy[0] - energy) <= found.error * max(abs(energy), abs(force) * reach)
            assert abs(found.force_1[0, 2] - force) <= found.error * abs(force)
            assert np.abs(found.force_1 + found.force_2).max() <= 1e-13 * abs(force)
            assert found.error <= max(rtol, 1e-10)


def legendre(f, low, high, ends=()):
    """Gauss's rule between places, which gather at both ends of each part."""
    found = 0.0
    t = (X + 1) / 2
    for a, b in pairwise([low, *sorted(end for end in ends if low < end < high), high]):
        places = a + (b - a) * t**2 * (3 - 2 * t)
        found += (b - a) * np.sum(W * 3 * t * (1 - t) * [f(x) for x in places])
    return found


def coaxial_discs(psi, ends, d):
    """Of radii 2 and 1: two points are s apart sideways on 2 pi s times what both discs share, moved by s."""

    def shared(s):
        if s <= 1:
            return math.pi
        a, b = math.acos((s**2 + 3) / (4 * s)), math.acos((s**2 - 3) / (2 * s))
        return 4 * a + b - 2 * s * math.sin(a)

    places = [1.0, *(math.sqrt(r**2 - d**2) for r in ends if r > d)]
    return legendre(lambda s: psi(math.hypot(d, s)) * 2 * math.pi * s * shared(s), 0, min(3, places[-1]), places)


def crossed_cylinders(psi, ends, d):
    """Of radii 5 and 8: along both axes at once points have the energy of one over a plane at the height of both."""

    def over_angle(f, R, h):
        """Twice the integral over an angle, of a function of the height that ends where a law does."""
        places = [math.acos(1 - (r - h) / R) for r in ends if r > h]
        return 2 * R * legendre(lambda t: f(h + 2 * R * math.sin(t / 2) ** 2), 0, places[-1], places)

    return over_angle(lambda h: over_angle(lambda g: -2 * math.pi * moments(psi, ends, g)[1], 8, h), 5, d)


@pytest.mark.parametrize("law", every(2, ["penalty", "table"]))
@pytest.mark.parametrize(
    ("lower", "upper", "exact", "gaps", "rtol"),
    [
        (Disc(radius=2.0), Disc(radius=1.0), coaxial_discs, (1.0633, 1.1999), 1e-3),
        (Cylinder(R=5.0), Cylinder(R=8.0, turn=math.pi / 2), crossed_cylinders, (1.1999,), 1e-2),
    ],
)
def test_no_error_is_larger_than_claimed_where_the_inner_surface_is_cut_too(lower, upper, exact, gaps, rtol, law):
    law, psi, ends = LAWS[law]
    for d in gaps:
        energy = exact(psi, ends, d)
        found = interaction(Surface(lower), Surface(upper, True, d), [law], rtol)
        size = max(abs(energy), abs(found.force_1[0, 2]) * min(d, law.cutoff - d))
        assert abs(found.energy[0] - energy) <= found.error * size
        assert found.error <= rtol
        assert np.abs(found.force_1 + found.force_2).max() <= 1e-13 * abs(found.force_1[0, 2])


@pytest.mark.parametrize(
    ("lower", "tilt", "d", "gap"),
    [
        *((Paraboloid(R=1.0), tilt, math.tan(tilt) ** 2 / 2 + 0.1 / math.cos(tilt), 0.1) for tilt in (1.3, 1.45)),
        (Cone(slope=0.3), 0.29, 0.1, 0.1 * math.cos(0.29)),
    ],
)
def test_surfaces_without_end_that_are_turned_are_nearest_and_end_farther_out(lower, tilt, d, gap):
    law = InversePower(n_1=1.0, n_2=1.0, psi_0=-1.0, r_0=1.0, m=6.0)
    rough, fine = (
        interaction(Surface(lower), Surface(Plane(tilt=tilt), True, d), [law], rtol) for rtol in (1e-3, 1e-7)
    )
    assert fine.gap == pytest.approx(gap, rel=1e-9)
    assert rough.energy == pytest.approx(fine.energy, rel=rough.error)


def test_what_is_behind_a_surface_and_beyond_its_edge_is_not_in_the_body():
    """A cap in a wide cavity touches nothing."""
    clear = over_gap(Surface(Cavity(R=10.0)), Surface(Cap(R=2.0, angle=0.5), True, 1.0), PENALTY, rtol=1e-3)
    assert (clear.energy, clear.area, clear.gap) == (0.0, 0.0, pytest.approx(1.0))


@pytest.mark.parametrize(
    ("lower", "upper", "area"),
    [
        (Plane(), Disc(radius=1.0), math.pi),
        (Plane(length=3.0, width=3.0), Plane(length=0.05, width=1.3, turn=0.4), 0.065),
    ],
)
def test_a_plate_pressed_into_a_plane_is_borne_by_its_area_up_to_its_edges(lower, upper, area):
    """Where the gap ends at once, patches of the other body are cut: even a loose accuracy has the exact force."""
    pressed = over_gap(Surface(lower), Surface(upper, True, -0.01), PENALTY, rtol=1e-2)
    assert pressed.force_1[2] == pytest.approx(-0.01 * area, rel=1e-9)
    assert pressed.area == pytest.approx(area, rel=1e-9)
    assert np.abs(pressed.moment_1).max() < 1e-12


@pytest.mark.parametrize(("turn", "rtol"), [(0.4, 1e-4), (0.3, 1e-5)])
def test_an_edge_that_turns_round_between_the_points_of_a_patch_is_followed(turn, rtol):
    """In polar coordinates the straight edges of a plate come nearest somewhere along them."""
    plate = Surface(Plane(length=0.13, width=0.7, turn=turn), True, -0.01)
    pressed = over_gap(Surface(Disc(radius=2.0)), plate, PENALTY, rtol=rtol)
    assert abs(pressed.force_1[2] / (-0.01 * 0.13 * 0.7) - 1) <= pressed.error <= rtol


def test_a_tilted_plate_over_a_plane_has_moments_and_heat_as_summed_over_the_plane():
    """Nearest points of the plate are clipped to it, and the plane is cut into small cells."""
    half, tilt, d, s = np.array([0.65, 0.35]), 0.2, 0.2, 0.3
    upper = Plane(length=1.3, width=0.7, tilt=tilt)
    smooth = [lambda g: np.stack([np.exp(-((g / s) ** 2)), -2 * g / s**2 * np.exp(-((g / s) ** 2))], axis=-1)]
    found = over_gap(Surface(Plane(length=4.0, width=4.0)), Surface(upper, True, d), smooth, (), smooth, 1e-4)
    x = np.stack(np.meshgrid(*[np.linspace(-2, 2, 401)[:-1] + 0.005] * 2, [0.0], indexing="ij"), axis=-1)[:, :, 0]
    along = np.array([[math.cos(tilt), 0.0, math.sin(tilt)], [0.0, 1.0, 0.0]])
    foot = np.clip((x - [0, 0, d]) @ along.T, -half, half) @ along + [0, 0, d]
    away = foot - x
    psi, traction = np.moveaxis(smooth[0](np.linalg.norm(away, axis=-1)), -1, 0)
    pull = (traction / np.linalg.norm(away, axis=-1))[..., None] * away * 0.01**2
    off = found.error * np.linalg.norm(found.force_1)
    assert found.energy == pytest.approx(psi.sum() * 0.01**2, rel=1e-4)
    assert found.conductance == pytest.approx(found.energy, rel=1e-12)
    assert found.force_1 == pytest.approx(pull.sum(axis=(0, 1)), abs=off)
    assert found.moment_1 == pytest.approx(np.cross(x, pull).sum(axis=(0, 1)), abs=off * 4)
    assert found.moment_2 == pytest.approx(-np.cross(foot, pull).sum(axis=(0, 1)), abs=off * 4)
