"""Shapes of surfaces: plane, sphere, cap, cavity, cylinder, paraboloid, cone, torus, wavy, measured heights."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from itertools import product
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from surfacechem.contracts.terms import Shape, option, parameter
from surfacechem.errors import InputError
from surfacechem.expressions import Expression, cos, sin

if TYPE_CHECKING:
    from surfacechem.contracts.fits import Array

Indices = NDArray[np.int_]
Span = tuple[tuple[float, float], tuple[float, float]]
Point = tuple[Expression, Expression, Expression]

FULL_TURN = (-math.pi, math.pi)
MAX_SLOPE = 1.57
"""Largest slope of a cone; a needle has no height."""

PER_HALF_WAVE, PER_CELL, MOST_NODES = 128, 8, 1_000_000
"""Points along half a wave, and along each cell of measured heights, from which searches for the closest point start,
and the most points of all cells.
"""

OWN_PART = 0.6
"""Fraction of the spacing of these points within which a Newton step must stay for its start to be the one next to the
closest point: one half, and the error of the step.
"""

SPLINE_OVERSHOOT = 0.1
"""Fraction of the range of heights by which a spline may exceed the highest, as summits lie between the points."""


def _stays_near(away: Array, slopes: Array, ends: Sequence[NDArray[np.bool_]], widths: Sequence[float]) -> Array:
    """Return a mask of Newton steps that stay near their starts (n, 3), from which points are ``away``.

    ``slopes`` (n, 5) are derivatives of the heights: u, v, uu, uv, vv; ``ends`` are masks of starts at edges in u and
    in v, along which their steps go.
    """
    (h_u, h_v, h_uu, h_uv, h_vv), (x_u, x_v, up) = slopes.T, away.T
    E = np.where(ends[0], 1.0, 1 + h_u**2 - up * h_uu)
    F = np.where(ends[0] | ends[1], 0.0, h_u * h_v - up * h_uv)
    G = np.where(ends[1], 1.0, 1 + h_v**2 - up * h_vv)
    along, across = np.where(ends[0], 0.0, x_u + up * h_u), np.where(ends[1], 0.0, x_v + up * h_v)
    det = E * G - F**2
    stays = np.abs(G * along - F * across) <= OWN_PART * widths[0] * det
    return np.asarray(stays & (np.abs(E * across - F * along) <= OWN_PART * widths[1] * det) & (E > 0) & (det > 0))


def _half(extent: float | None) -> tuple[float, float]:
    """Return the interval from minus to plus half of an extent, which may be infinite."""
    half = math.inf if extent is None else extent / 2
    return -half, half


class Plane(Shape):
    r"""Plane, or a rectangular plate.

    .. math:: x = (u, v, 0)

    Source: elementary. Without length or width it has no end in that direction.

    >>> Plane().point(1.0, 2.0)
    (1.0, 2.0, 0.0)
    """

    radii = ()

    length: float | None = parameter("m", "extent along x", default=None, above=0, varies=False)
    width: float | None = parameter("m", "extent along y", default=None, above=0, varies=False)

    def point(self, u: Expression, v: Expression) -> Point:
        """Return the point at the coordinates (u, v)."""
        return u, v, 0 * u

    @property
    def span(self) -> Span:
        """Parameters of the rectangle."""
        return _half(self.length), _half(self.width)

    def foot(self, x: Array) -> Array:
        """Return the parameters of the point below."""
        return x[..., :2]


class Sphere(Shape):
    r"""Sphere.

    .. math:: x = R\,(\sin u \cos v,\; \sin u \sin v,\; \cos u - 1)

    Source: elementary. u is the angle from the highest point.

    >>> Sphere(R=2.0).point(0.0, 1.0)
    (0.0, 0.0, -0.0)
    """

    about_axis = True
    closed = (False, True)
    bulge: ClassVar[int] = 1
    """Sign of the curvature: 1 if the centre is inside the body, -1 if it is outside."""

    R: float = parameter("m", "radius", above=0, varies=False)

    def point(self, u: Expression, v: Expression) -> Point:
        """Return the point at the angles u from the axis and v about it."""
        return self.R * sin(u) * cos(v), self.R * sin(u) * sin(v), -2 * self.bulge * self.R * sin(u / 2) ** 2

    @property
    def span(self) -> Span:
        """Angles of the whole sphere."""
        return (0.0, math.pi), FULL_TURN

    def foot(self, x: Array) -> Array:
        """Return the parameters of the closest point: along the radius."""
        # The direction from the centre, as an angle from the apex.
        up = self.R + self.bulge * x[..., 2]
        return np.stack([np.arctan2(np.hypot(x[..., 0], x[..., 1]), up), np.arctan2(x[..., 1], x[..., 0])], axis=-1)


class Cap(Sphere):
    r"""Spherical cap, the part of a sphere around its highest point.

    .. math:: x = R\,(\sin u \cos v,\; \sin u \sin v,\; \cos u - 1), \quad 0 \le u \le \alpha

    Source: elementary.

    >>> Cap(R=2.0, angle=0.5).span[0]
    (0.0, 0.5)
    """

    angle: float = parameter("rad", "angle from the highest point to the edge", above=0, at_most=math.pi, varies=False)

    @property
    def span(self) -> Span:
        """Angles up to the edge."""
        return (0.0, self.angle), FULL_TURN


class Cavity(Cap):
    r"""Inside of a hollow sphere, whose lowest point is the origin.

    .. math:: x = R\,(\sin u \cos v,\; \sin u \sin v,\; 1 - \cos u), \quad 0 \le u \le \alpha

    Source: elementary. Less than a whole sphere where an angle is given.

    >>> Cavity(R=2.0).point(0.0, 1.0) == Sphere(R=2.0).point(0.0, 1.0)
    True
    """

    bulge = -1

    angle: float = parameter(
        "rad", "angle from the lowest point to the edge", default=math.pi, above=0, at_most=math.pi, varies=False
    )


class Cylinder(Shape):
    r"""Cylinder lying along x.

    .. math:: x = (u,\; R \sin v,\; R\,(\cos v - 1))

    Source: elementary. Without a length it has no end; its end faces are not part of the surface.

    >>> Cylinder(R=2.0).point(1.0, 0.0)
    (1.0, 0.0, -0.0)
    """

    closed = (False, True)

    R: float = parameter("m", "radius", above=0, varies=False)
    length: float | None = parameter("m", "length", default=None, above=0, varies=False)

    def point(self, u: Expression, v: Expression) -> Point:
        """Return the point at the length u and the angle v from the highest line."""
        return u, self.R * sin(v), -2 * self.R * sin(v / 2) ** 2

    @property
    def span(self) -> Span:
        """Length, and full angle."""
        return _half(self.length), FULL_TURN

    def foot(self, x: Array) -> Array:
        """Return the parameters of the closest point: along the radius."""
        return np.stack([x[..., 0], np.arctan2(x[..., 1], x[..., 2] + self.R)], axis=-1)


class SurfaceOfRevolution(Shape):
    """Surface of revolution over the distance u from its axis; infinite without a radius of its edge."""

    about_axis = True
    closed = (False, True)

    radius: float | None = parameter("m", "radius of its edge", default=None, above=0, varies=False)

    @property
    def span(self) -> Span:
        """Distances up to the edge, and full angle."""
        return (0.0, math.inf if self.radius is None else self.radius), FULL_TURN

    def starts(self, x: Array) -> tuple[Indices, Array]:
        """Return starts of the search at the angle of the points about the axis and at the opposite one."""
        angle, radius = np.arctan2(x[:, 1], x[:, 0]), np.hypot(x[:, 0], x[:, 1])
        starts = np.stack([radius, angle, radius, angle + math.pi], axis=-1).reshape(-1, 2)
        return np.repeat(np.arange(len(x)), 2), starts


class Disc(SurfaceOfRevolution):
    r"""Circular disc; without a radius a plane in polar coordinates.

    .. math:: x = (u \cos v,\; u \sin v,\; 0)

    Source: elementary.

    >>> Disc(radius=2.0).point(2.0, 0.0)
    (2.0, 0.0, 0.0)
    """

    radii = ("radius",)

    def point(self, u: Expression, v: Expression) -> Point:
        """Return the point at the distance u from the axis and the angle v about it."""
        return u * cos(v), u * sin(v), 0 * u

    def foot(self, x: Array) -> Array:
        """Return the parameters of the point below."""
        return np.stack([np.hypot(x[..., 0], x[..., 1]), np.arctan2(x[..., 1], x[..., 0])], axis=-1)


class Paraboloid(SurfaceOfRevolution):
    r"""Paraboloid of revolution.

    .. math:: x = (u \cos v,\; u \sin v,\; -u^2 / 2R)

    Source: elementary; the parabola of Derjaguin's approximation and of Hertz's theory.

    >>> Paraboloid(R=2.0).point(2.0, 0.0)
    (2.0, 0.0, -1.0)
    """

    rises = 2

    R: float = parameter("m", "radius of curvature at the highest point", above=0, varies=False)

    def point(self, u: Expression, v: Expression) -> Point:
        """Return the point at the distance u from the axis and the angle v about it."""
        return u * cos(v), u * sin(v), -(u**2) / (2 * self.R)


class Cone(SurfaceOfRevolution):
    r"""Cone, the tip up.

    .. math:: x = (u \cos v,\; u \sin v,\; -u \tan\alpha)

    Source: elementary. It is not smooth at its tip.

    >>> round(Cone(slope=0.25).point(2.0, 0.0)[2], 9)
    -0.510683842
    """

    radii = ("radius",)
    rises = 1

    slope: float = parameter("rad", "angle between its side and the plane", above=0, at_most=MAX_SLOPE, varies=False)

    def point(self, u: Expression, v: Expression) -> Point:
        """Return the point at the distance u from the axis and the angle v about it."""
        return u * cos(v), u * sin(v), -u * math.tan(self.slope)

    def foot(self, x: Array) -> Array:
        """Return the parameters of the closest point of the side below the point."""
        along = np.hypot(x[..., 0], x[..., 1]) * math.cos(self.slope) - x[..., 2] * math.sin(self.slope)
        return np.stack([along * math.cos(self.slope), np.arctan2(x[..., 1], x[..., 0])], axis=-1)


class Torus(Shape):
    r"""Torus lying flat.

    .. math:: x = ((R + r \sin u) \cos v,\; (R + r \sin u) \sin v,\; r\,(\cos u - 1)), \quad R = R_0 + r

    Source: elementary. Its hole is open, so that it does not meet itself. Its highest points are a circle of radius R.

    >>> Torus(hole=1.0, r=1.0).point(0.0, 0.0)
    (2.0, 0.0, -0.0)
    """

    about_axis = True
    closed = (True, True)

    radii = ("hole", "r")

    hole: float = parameter("m", "radius of its hole, R_0", above=0, varies=False)
    r: float = parameter("m", "radius of its tube", above=0, varies=False)

    def point(self, u: Expression, v: Expression) -> Point:
        """Return the point at the angles u about the middle of the tube and v about the axis."""
        out = self.hole + self.r * (1 + sin(u))
        return out * cos(v), out * sin(v), -2 * self.r * sin(u / 2) ** 2

    @property
    def span(self) -> Span:
        """Angles of the whole torus."""
        return FULL_TURN, FULL_TURN

    def foot(self, x: Array) -> Array:
        """Return the parameters of the closest point: along the radius of the tube."""
        out = np.hypot(x[..., 0], x[..., 1]) - self.hole - self.r
        return np.stack([np.arctan2(out, x[..., 2] + self.r), np.arctan2(x[..., 1], x[..., 0])], axis=-1)


class Wavy(Plane):
    r"""Wavy surface, a crest at the origin.

    .. math:: x = (u,\; v,\; A\,[\cos(2\pi u/\lambda) \cos(2\pi v/\lambda_2) - 1])

    Source: Westergaard (1939), J. Appl. Mech. 6, A49: the usual model of a regular rough surface. Without
    :math:`\lambda_2` the waves run along x alone.

    >>> Wavy(amplitude=1e-9, wavelength=1e-7).point(5e-8, 0.0)[2]
    -2e-09
    """

    radii = ("wavelength",)  # type: ignore[assignment]
    foot = None  # type: ignore[assignment]

    amplitude: float = parameter("m", "amplitude", above=0, varies=False)
    wavelength: float = parameter("m", "wavelength along x", above=0, varies=False)
    wavelength_2: float | None = parameter("m", "wavelength along y", default=None, above=0, varies=False)

    def point(self, u: Expression, v: Expression) -> Point:
        """Return the point at the coordinates (u, v)."""
        across = 1 if self.wavelength_2 is None else cos(2 * math.pi / self.wavelength_2 * v)
        return u, v, self.amplitude * (cos(2 * math.pi / self.wavelength * u) * across - 1)

    @property
    def grain(self) -> float:  # type: ignore[override]
        """A quarter of a wavelength."""
        return min(self.wavelength, self.wavelength_2 or math.inf) / 4

    @property
    def waves(self) -> Array:
        """Wavelengths along x and, if there is one, along y."""
        return np.array([wave for wave in (self.wavelength, self.wavelength_2) if wave is not None])

    @cached_property
    def nodes(self) -> Any:
        """Points (along each wave, and height) from a crest to half a wave away."""
        from scipy.spatial import KDTree

        axes = [np.linspace(0, wave / 2, PER_HALF_WAVE) for wave in self.waves]
        places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))
        heights = self.amplitude * (np.prod(np.cos(2 * math.pi / self.waves * places), axis=-1) - 1)
        return KDTree(np.column_stack([places, heights]))

    def starts(self, x: Array) -> tuple[Indices, Array]:
        """Return starts of the search: the nearest points of the half wave in which each point lies, and mirror images.

        The images are in the nearer crest or trough: a start beyond these has an image that is nearer than itself. An
        edge that cuts off the half wave may also cut off the image: then points of the next half wave inwards, its
        crests and troughs are starts too.
        """
        waves, (low, high) = self.waves, np.transpose(self.span)
        count = len(waves)
        along = np.clip(x[:, :count], low[:count], high[:count])
        crest = waves * np.round(along / waves)
        side = np.where(along < crest, -1.0, 1.0)
        outside, trough = (np.abs(place) > high[:count] for place in (crest, crest + side * waves / 2))
        which, found = [], []
        for inner in map(np.array, product((False, True), repeat=count)):
            asked = np.flatnonzero(np.all(~inner | outside | trough, axis=-1))
            middle = np.where(inner & outside, crest + side * waves, crest)[asked]
            turn = np.where(inner, -side, side)[asked]
            own, rest = turn * (x[asked, :count] - middle), x[asked, count:2]
            near = self.nodes.data[self.nodes.query(np.column_stack([own, x[asked, 2]]))[1]][:, :-1]
            image = np.where(own < waves / 4, -near, waves - near)
            pairs = [(near, image), *([(0.0 * near, waves / 2)] if inner.any() else [])]
            for (one, other), chosen in product(pairs, product((False, True), repeat=count)):
                place = middle + turn * np.where(chosen, other, one)
                found.append(np.clip(np.concatenate([place, rest], axis=-1), low, high))
                which.append(asked)
        order = np.argsort(np.concatenate(which), kind="stable")
        return np.concatenate(which)[order], np.concatenate(found)[order]


class Heights(Shape):
    r"""Measured heights on a grid, joined by a spline of degree five; the highest of them is at zero.

    .. math:: x = (u,\; v,\; h(u, v))

    Source: de Boor (1978), A Practical Guide to Splines. The grid has no holes, and is where the surface ends.

    >>> Heights(x=range(6), y=range(6), z=[0.0] * 36).span
    ((0.0, 5.0), (0.0, 5.0))
    """

    radii = ()

    x: Sequence[float] = option("places along x, increasing [m]")
    y: Sequence[float] = option("places along y, increasing [m]")
    z: Sequence[float] = option("heights, all along y for the first x, then for the next [m]")

    def __post_init__(self) -> None:
        """Check that the grid is complete."""
        super().__post_init__()
        for name, places in (("x", self.x), ("y", self.y)):
            if len(places) < 6 or np.any(np.diff(places) <= 0):
                raise InputError(f"heights need at least 6 increasing places along {name}, got {len(places)}.")
        if len(self.z) != len(self.x) * len(self.y):
            grid = f"{len(self.x)} x {len(self.y)} places"
            raise InputError(f"the heights have holes: {len(self.z)} of them on {grid}.")
        if not np.all(np.isfinite(self.z)):
            raise InputError("the heights have holes: one of them is not a finite number.")
        between = self.spline(*((np.array(p[1:]) + p[:-1]) / 2 for p in (self.x, self.y)))
        if between.max() > SPLINE_OVERSHOOT * np.ptp(self.z):
            text = f"between the places a spline is {between.max():.3g} m above the highest of the heights"
            raise InputError(f"{text}: they change too much from place to place; smooth them, or give more of them.")

    @cached_property
    def spline(self) -> Any:
        """The surface as a spline."""
        from scipy.interpolate import RectBivariateSpline

        z = np.reshape(self.z, (len(self.x), len(self.y)))
        return RectBivariateSpline(self.x, self.y, z - z.max(), kx=5, ky=5)

    def point(self, u: Expression, v: Expression) -> Point:
        """Return the point at the coordinates (u, v)."""
        return u, v, self.spline.ev(u, v)

    @property
    def span(self) -> Span:
        """Range of the grid."""
        return (float(self.x[0]), float(self.x[-1])), (float(self.y[0]), float(self.y[-1]))

    @property
    def grain(self) -> float:  # type: ignore[override]
        """The smallest cell of the grid, in which heights are a polynomial."""
        return float(min(np.diff(self.x).min(), np.diff(self.y).min()))

    @cached_property
    def nodes(self) -> Any:
        """Starts of searches on the surface (x, y, z), with derivatives of the heights and a tree of them, several in
        each cell unless these are many; and the numbers a, b of a bound.

        For a point at the distance d, the squared distance of the start next to its closest point exceeds the least one
        by at most a + b d.
        """
        from scipy.spatial import KDTree

        parts = min(PER_CELL, max(1, math.isqrt(MOST_NODES // len(self.z))))
        at = [np.arange(0, len(p) - 1 + 0.5 / parts, 1 / parts) for p in (self.x, self.y)]
        x, y = (np.interp(t, range(len(p)), p) for t, p in zip(at, (self.x, self.y), strict=True))
        places = np.stack([*np.meshgrid(x, y, indexing="ij"), self.spline(x, y)], axis=-1)
        slopes = [self.spline(x, y, *order) for order in ((1, 0), (0, 1), (2, 0), (1, 1), (0, 2))]
        # At the closest point the slope of the squared distance vanishes: next to it the growth is given by the second
        # derivative, 2 (|x_u|^2 - d n . x_uu).
        h_u, h_v, h_uu, h_uv, h_vv = slopes
        first = math.sqrt(1 + (h_u**2 + h_v**2).max())
        second = math.sqrt((h_uu**2 + 2 * h_uv**2 + h_vv**2).max())
        beside = math.hypot(np.diff(x).max(), np.diff(y).max()) / 2
        growth = ((first * beside) ** 2 + second * first * beside**3, second * beside**2)
        return places, np.stack(slopes, axis=-1), KDTree(places.reshape(-1, 3)), growth

    def starts(self, x: Array) -> tuple[Indices, Array]:
        """Return starts of the search: of those next to which the closest point may be, the ones without a nearer
        neighbour, and the ones whose Newton step does not lead to another start.
        """
        places, slopes, tree, (a, b) = self.nodes
        d = tree.query(x)[0]
        near = tree.query_ball_point(x, np.sqrt(d**2 + a + b * d))
        which = np.repeat(np.arange(len(x)), [len(some) for some in near])
        i, j = np.unravel_index(np.concatenate(near).astype(int), places.shape[:2])
        widths = [np.diff(line).max() for line in (places[:, 0, 0], places[0, :, 1])]
        away, least = x[which] - places[i, j], np.ones(len(which), dtype=bool)
        distance = np.linalg.norm(away, axis=-1)
        ends = [(k == 0) | (k == count - 1) for k, count in zip((i, j), places.shape, strict=False)]
        for offsets in product((-1, 0, 1), repeat=2):
            # At an edge the closest point may be a minimum only along the edge.
            beside = (np.where(end, k, k + offset) for end, k, offset in zip(ends, (i, j), offsets, strict=True))
            least &= distance <= np.linalg.norm(x[which] - places[tuple(beside)], axis=-1)
        least |= _stays_near(away, slopes[i, j], ends, widths)
        return which[least], places[i, j, :2][least]

    def derivatives(self, u: Array, v: Array, count: int) -> Array:
        """Return points and derivatives of the spline."""
        orders = [(i - j, j) for i in range(3) for j in range(i + 1)][:count]
        found = np.zeros((len(orders), *np.shape(u), 3))
        found[0, ..., 0], found[0, ..., 1], found[1, ..., 0], found[2, ..., 1] = u, v, 1.0, 1.0
        for k, (i, j) in enumerate(orders):
            found[k, ..., 2] = self.spline.ev(u, v, dx=i, dy=j)
        return found
