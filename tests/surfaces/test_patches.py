"""Patches of integrals over surfaces: no near place is missed at any accuracy, and bends of laws are met."""

import math

import numpy as np
import pytest
from scipy.integrate import quad

from surfacechem.laws.free_energy import Penalty
from surfacechem.laws.longrange import LennardJonesPair
from surfacechem.surfaces import patches
from surfacechem.surfaces.forces import density, interaction, level_approaches, over_gap
from surfacechem.surfaces.nearest_places import near_places
from surfacechem.surfaces.projection import Surface
from surfacechem.surfaces.shapes import Cylinder, Heights, Plane, Sphere, Torus, Wavy

SIDE = np.linspace(0, 1e-6, 31)
LAW = LennardJonesPair(n_1=5e18, n_2=5e18, psi_0=4e-21, g_0=3e-10)
STIFF = [density(Penalty(E_n=1.0))]


def bumps(*places):
    """Heights with bumps of one height at some places; another one of them is nowhere at a grid point."""
    x, y = np.meshgrid(SIDE, SIDE, indexing="ij")
    z = sum(2e-8 * np.exp(-((x - a) ** 2 + (y - b) ** 2) / 1.28e-14) for a, b in places)
    return Heights(x=SIDE, y=SIDE, z=z.ravel())


def test_a_second_place_that_is_as_near_counts_at_any_accuracy():
    """A grid of thirty steps along one side has a place at both, so that both are as near to rounding."""
    step = SIDE[1]
    shape = bumps((8 * step, 9 * step), (22 * step, 21 * step))
    lower, upper = Surface(shape), Surface(Plane(), True, 1e-9)
    exact = interaction(lower, upper, [LAW], 1e-4)
    assert exact.places == 2
    for rtol in (1e-1, 1e-3):
        found = interaction(lower, upper, [LAW], rtol)
        assert found.error <= rtol
        assert found.force_1[0, 2] == pytest.approx(exact.force_1[0, 2], rel=rtol)


def test_a_pole_beside_the_nearest_place_is_no_place_itself():
    """At it no direction of the parameters leads anywhere, but the surface does."""
    for tilt in (0.01, 0.0873, 0.3):
        upper = Surface(Plane(length=3.0, width=2.0, tilt=tilt), True, 0.1)
        found = near_places(Surface(Sphere(R=1.0)), upper, 3.0, (False, False))
        assert found.gap == pytest.approx([1.1 * math.cos(tilt) - 1], rel=1e-12)
        assert [found.at[0, 0], math.cos(found.at[0, 1])] == pytest.approx([tilt, -1], rel=1e-6)


def test_every_summit_that_is_near_is_found_with_its_exact_gap():
    draw = np.random.default_rng(3)
    places = draw.uniform(1e-7, 9e-7, (5, 2))
    shape = bumps(*places)
    found = near_places(Surface(shape), Surface(Plane(), True, 1e-9), 1e-6, (False, False), shape.grain)
    x = np.linspace(0, 1e-6, 2001)
    z = shape.spline(x, x)
    inner = z[1:-1, 1:-1]
    around = [z[1 + i : 2000 + i, 1 + j : 2000 + j] for i in (-1, 0, 1) for j in (-1, 0, 1) if i or j]
    summits = inner[np.all([inner > other for other in around], axis=0)]
    assert len(found.gap) == len(summits)
    assert np.sort(found.gap) == pytest.approx(np.sort(1e-9 - summits), abs=1e-12)
    slopes = [shape.spline.ev(*found.at.T, dx=1, dy=0), shape.spline.ev(*found.at.T, dx=0, dy=1)]
    assert np.abs(slopes).max() < 1e-7


@pytest.mark.parametrize(
    ("shapes", "gap"),
    [
        ((Torus(hole=1.0, r=0.5), Sphere(R=2.0)), math.hypot(1.5, 0.0)),
        ((Cylinder(R=1.0, turn=0.3), Torus(hole=1.0, r=0.5, tilt=0.2)), None),
    ],
)
def test_the_least_gap_of_round_pairs_is_exact(shapes, gap):
    """A ball above the hole of a ring: the distance from its centre to the middle of the tube, less both radii."""
    lower, upper = Surface(shapes[0]), Surface(shapes[1], True, 0.1)
    found = near_places(lower, upper, 2.0, (False, gap is not None))
    if gap is not None:
        assert found.gap[0] == pytest.approx(math.hypot(1.5, 2.6) - 2.5, rel=1e-14)
    around = found.at[0] + np.stack(np.meshgrid(*[np.linspace(-1e-3, 1e-3, 41)] * 2), axis=-1)
    assert upper.nearest(lower.derivatives(around, 3)[0]).gap.min() >= found.gap[0] - 1e-14


def test_a_wave_pressed_into_a_plane_bears_what_one_integral_says():
    """The gap to a plane is the height, so that force and area are integrals along the wave."""
    A, wave, depth, length = 0.1, 1.0, 0.05, 3.0
    found = over_gap(
        Surface(Wavy(amplitude=A, wavelength=wave, length=length, width=0.5)),
        Surface(Plane(), True, -depth),
        STIFF,
        rtol=1e-9,
    )
    k = 2 * math.pi / wave
    edge = math.acos(1 - depth / A) / k

    def stretch(x):
        return math.hypot(1, A * k * math.sin(k * x))

    area = 0.5 * 6 * quad(stretch, 0, edge, epsabs=0, epsrel=1e-12)[0]
    pressed = quad(lambda x: (depth - A * (1 - math.cos(k * x))) * stretch(x), 0, edge, epsabs=0, epsrel=1e-12)[0]
    load = 0.5 * 6 * pressed
    assert -found.force_1[2] == pytest.approx(load, rel=1e-9)
    assert found.area == pytest.approx(area, rel=1e-6)


def test_where_nothing_is_symmetric_the_area_of_contact_is_exact_too():
    """A tilted ball is a ball, turned about its pole: the cap of depth h has the area 2 pi R h."""
    R, tilt, approach = 1.0, 0.3, -0.01
    depth = R * (1 - math.cos(tilt)) - approach
    found = over_gap(Surface(Sphere(R=R, tilt=tilt)), Surface(Plane(), True, approach), STIFF, rtol=1e-5)
    assert found.gap == pytest.approx(-depth, rel=1e-13)
    assert found.area == pytest.approx(2 * math.pi * R * depth, rel=1e-5)
    assert -found.force_1[2] == pytest.approx(math.pi * R * depth**2, rel=1e-7)


def test_a_place_beside_the_pole_of_a_sphere_is_found():
    """A plane tilted by less than a step of the grid is nearest where its normal points, not at the pole."""
    overlap, R, tilt = 1e-6, 1.0, -0.02
    upper = Surface(Plane(tilt=tilt), True, (R - overlap) / math.cos(tilt) - R)
    found = over_gap(Surface(Sphere(R=R)), upper, STIFF, rtol=1e-5)
    assert found.gap == pytest.approx(-overlap, rel=1e-8)
    assert np.linalg.norm(found.force_1) == pytest.approx(math.pi * R * overlap**2, rel=1e-7)


@pytest.mark.parametrize(("tilt", "other"), [(0.02, 0.03), (0.1, -0.05)])
def test_the_least_gap_of_plates_that_are_turned_and_pressed_in_is_that_of_a_corner(tilt, other):
    """Beyond the edge of the other plate the gap jumps, so that there is no slope to follow."""
    lower = Surface(Plane(length=2.0, width=1.0, tilt=tilt, turn=0.3))
    plate = Plane(length=1.5, width=1.2, tilt=other, turn=-0.4)
    upper = Surface(plate, True, level_approaches(lower, Surface(plate, True), [0.0])[-1] - 1e-3)
    at = np.stack(np.meshgrid(np.linspace(-1, 1, 401), np.linspace(-0.5, 0.5, 401), indexing="ij"), axis=-1)
    seen = upper.nearest(lower.derivatives(at, 3)[0]).gap.min()
    found = near_places(lower, upper, 2.0, (False, False)).gap[0]
    assert seen - 2e-4 < found <= seen


@pytest.mark.parametrize("seed", [85, 147])
def test_the_least_gap_of_plates_through_each_other_is_not_that_beyond_an_edge(seed):
    """Where the gap jumps rounding decides on which side a place is when it is looked at again."""
    draw = np.random.default_rng(seed)

    def plate():
        length, width = draw.uniform(0.5, 2, 2)
        turn, tilt = (draw.uniform(-most, most) * (draw.random() < 0.7) for most in (3, 0.6))
        return Plane(length=length, width=width, turn=turn, tilt=tilt)

    lower, upper = Surface(plate()), Surface(plate(), True, draw.uniform(0, 1.5))
    at = np.stack(np.meshgrid(*(np.linspace(*ends, 161) for ends in lower.shape.span), indexing="ij"), axis=-1)
    assert near_places(lower, upper, 4.0, (False, False)).gap[0] <= upper.nearest(lower.derivatives(at, 3)[0]).gap.min()


@pytest.mark.parametrize("error", [1.0, 1.0 - 1e-2, 0.1])
def test_an_error_that_hardly_falls_is_beyond_every_budget(error):
    expected = patches._expected([(1e6, 1.0), (1e7, error)], 1e-9)
    assert (expected <= 1e7) if error == 1 else (expected > patches.MOST_POINTS)
