"""Closest-point projection against dense search."""

import math

import numpy as np
import pytest
from sampling import every
from scipy.ndimage import gaussian_filter
from scipy.spatial import KDTree

from surfacechem.errors import InputError
from surfacechem.laws import find
from surfacechem.surfaces.projection import FIRST_ORDER, Surface
from surfacechem.surfaces.shapes import (
    Cap,
    Cavity,
    Cone,
    Cylinder,
    Heights,
    Paraboloid,
    Plane,
    Shape,
    Sphere,
    Torus,
    Wavy,
)

GRID = np.linspace(-3, 3, 25)
ROUGH = Heights(x=GRID, y=GRID, z=(0.1 * np.cos(1.3 * GRID)[:, None] * np.cos(0.9 * GRID)).ravel())
SHAPES = [
    Plane(tilt=0.1),
    Sphere(R=1.0),
    Cap(R=1.0, angle=1.2, tilt=0.2),
    Cavity(R=5.0),
    Cylinder(R=1.0, turn=0.3),
    Paraboloid(R=1.0),
    Cone(slope=0.5),
    Torus(hole=1.5, r=0.5, tilt=0.1),
    Wavy(amplitude=0.1, wavelength=3.0, wavelength_2=2.0),
    Wavy(amplitude=0.1, wavelength=3.0, turn=0.4),
    ROUGH,
]
SURFACES = [Surface(shape, upper, 0.2 * upper) for shape in SHAPES for upper in (False, True)]
every_surface = pytest.mark.parametrize(
    "surface", SURFACES, ids=lambda item: f"{item.shape.name()} {'above' if item.upper else 'below'}"
)


def points(surface):
    """Points outside of the body, off the axis."""
    draw = np.random.default_rng(1)
    x = draw.uniform(0.2, 0.8, (6, 3)) * [1, 1, 0.5] + [0, 0, 0.3]
    return x * [1, 1, -1] if surface.upper else x


@every_surface
def test_no_other_point_is_nearer_and_the_distance_is_along_the_normal(surface):
    x = points(surface)
    found = surface.nearest(x)
    low, high = np.clip(np.transpose(surface.shape.span), -3, 3)
    grid = np.stack(np.meshgrid(*np.linspace(low, high, 401).T, indexing="ij"), axis=-1)
    all_points = surface.derivatives(np.where(grid == 0, 1e-9, grid), 3)[0].reshape(-1, 3)
    for point, gap, foot, normal in zip(x, found.gap, found.point, found.normal, strict=True):
        nearest = np.linalg.norm(all_points - point, axis=-1).min()
        assert gap <= nearest * (1 + 1e-12)
        assert nearest - gap < 2e-3
        assert point - foot == pytest.approx(gap * normal, abs=1e-12)


@pytest.mark.parametrize(
    ("shape", "x"),
    [
        (Wavy(amplitude=0.2, wavelength=0.05), [(0.00699116, 0.0, -0.25786422), (0.01764846, 0.0, -0.12473847)]),
        (Wavy(amplitude=0.5, wavelength=1.0, wavelength_2=0.1), [(-0.05968653, 0.00529196, -2.15254208)]),
        (Wavy(amplitude=0.5, wavelength=1.0, wavelength_2=0.1), [(0.30351270, 0.00617443, 2.25969664)]),
    ],
)
def test_the_nearest_point_of_short_waves_is_not_that_of_another_wave(shape, x):
    """Newton's method leaps over waves that are steep; one wave all around is searched."""
    grid = np.stack(np.meshgrid(*(np.linspace(-0.6, 0.6, n) for n in (1201, 401)), indexing="ij"), axis=-1)
    waves = grid * [shape.wavelength, shape.wavelength_2 or 0.0] * 2
    all_points = Surface(shape).derivatives(waves, 3)[0].reshape(-1, 3)
    for point, gap in zip(x, Surface(shape).nearest(x).gap, strict=True):
        nearest = np.linalg.norm(all_points - point, axis=-1).min()
        assert nearest * 0.99 < abs(gap) <= nearest


@pytest.mark.parametrize("seed", every(3, [3, 19, 26, 33, 34, 45]))
def test_the_nearest_point_of_rough_heights_is_found(seed):
    """Of places that are about as near, in cells beside each other and along an edge, the nearest."""
    draw = np.random.default_rng(seed)
    heights = gaussian_filter(draw.normal(size=(9, 12)), 0.5)
    shape = Heights(x=range(9), y=range(12), z=heights.ravel())
    x = draw.uniform([-1, -1, -2], [9, 12, 3], (1000, 3))
    u, v = (np.linspace(0, count - 1, 40 * count) for count in heights.shape)
    all_points = np.stack([*np.meshgrid(u, v, indexing="ij"), shape.spline(u, v)], axis=-1).reshape(-1, 3)
    assert np.all(np.abs(Surface(shape).nearest(x).gap) <= KDTree(all_points).query(x)[0] * (1 + 1e-12))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Torus(hole=0.0, r=1.0), "hole = 0 is outside its range"),
        (lambda: Heights(x=range(6), y=range(6), z=[0.0] * 35), "have holes: 35 of them on 6 x 6"),
        (lambda: Heights(x=range(6), y=range(6), z=[math.nan] * 36), "not a finite number"),
        (lambda: Heights(x=range(6), y=range(6), z=[0, 0, 1, 1, 0, 0] * 6), "above the highest of the heights"),
        (lambda: Heights(x=[0.0] * 6, y=range(6), z=[0.0] * 36), "increasing places along x"),
        (lambda: Sphere(R=-1.0), "R = -1 is outside its range"),
        (lambda: find(Shape, "spere"), "Did you mean 'sphere'"),
    ],
)
def test_what_is_no_surface_is_refused(make, message):
    with pytest.raises(InputError, match=message):
        make()


@pytest.mark.parametrize(
    "shape",
    [
        Wavy(amplitude=0.1, wavelength=1.0, wavelength_2=0.8, length=4.0, width=3.0),
        Wavy(amplitude=0.3, wavelength=0.9, wavelength_2=1.2, length=0.7, width=3.9),
    ],
)
def test_no_place_is_nearer_than_the_nearest_where_edges_cut_waves_off(shape):
    surface, (low, high) = Surface(shape), np.transpose(shape.span)
    grid = np.stack(np.meshgrid(*np.linspace(low, high, 301).T, indexing="ij"), axis=-1)
    points = np.random.default_rng(18).uniform([*1.1 * low, -1.5], [*1.1 * high, 1.5], (2000, 3))
    dense, _ = KDTree(surface.derivatives(grid, FIRST_ORDER)[0].reshape(-1, 3)).query(points)
    assert np.all(np.abs(surface.nearest(points).gap) <= dense * (1 + 1e-12))
