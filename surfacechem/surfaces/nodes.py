"""Integrals over two surfaces: nodes that gather where the other surface is near, refined until they are accurate.

Around the foot of a point at the distance h the parameters are x = h sinh t. In t the distance has no feature narrower
than pi/2 whatever h is, so that Gauss's rule on pieces of a fixed length converges geometrically for any gap; the
number of pieces grows with the logarithm of size over gap. The outer surface is divided adaptively.

Source: Johnston & Elliott (2005), doi 10.1002/nme.1208, for the substitution; Genz & Malik (1980),
doi 10.1016/0771-050X(80)90039-X, for the adaptive subdivision, which is SciPy's.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any

import numpy as np

from surfacechem.contracts.terms import PairEnergy
from surfacechem.errors import InputError
from surfacechem.surfaces.projection import FIRST, POLE, Array, Projection, Surface
from surfacechem.surfaces.shapes import Cavity, Cylinder, Disc, Plane, Sphere
from surfacechem.tolerances import FLOOR

ORDERS = (4, 6, 9, 13, 18, 25)
"""Points of Gauss's rule on each piece, more and more of them until two in a row agree."""

WITHIN = {FLOOR: 13, 0.0: 25}
"""Order of the inner rule where the outer surface is divided adaptively, by the least accuracy it is enough for."""

PIECE = 2.0
"""Length of a piece in t."""

MOST_NODES = 400_000
"""Pairs of points that are looked at together."""

MOST_DIVISIONS = 400
"""Divisions of the outer surface after which an accuracy is out of reach."""

SHALLOWEST = 2.0**-20
"""Part of the size of a surface below which a gap is one of contact."""

Sums = tuple[Array, Array, Array]
"""For n outer points: energy (n,), force on them (n, 3), and inner points weighted by what acts on each (n, 3)."""


@dataclass(frozen=True)
class Grid:
    """Points (n, k, 3) of the inner surface for each of n points of the outer one, with their areas (n, k)."""

    outer: Array
    x: Array
    area: Array

    def sums(self, law: Callable[[Array], Array]) -> Sums:
        """Sums over the inner points of a law of the distance."""
        away = self.outer[:, None] - self.x
        r = np.sqrt(np.einsum("nkc,nkc->nk", away, away))
        psi, slope = np.moveaxis(law(r), -1, 0)
        strength = -slope * self.area / r
        push, theirs = (np.einsum("nk,nkc->nc", strength, arms) for arms in (away, self.x))
        return np.einsum("nk,nk->n", psi, self.area), push, theirs


@dataclass(frozen=True)
class Circles:
    """Circles around the feet (n, 3) on a plane, a sphere or a cavity: their distances from the outer points, how far
    they lie below the feet, and their areas, each (n, k).
    """

    foot: Array
    normal: Array
    gap: Array
    r: Array
    down: Array
    area: Array

    def sums(self, law: Callable[[Array], Array]) -> Sums:
        """Sums over the circles of a law of the distance; what points across the normal cancels."""
        psi, slope = np.moveaxis(law(self.r), -1, 0)
        strength = -slope * self.area / self.r
        whole, lower = strength.sum(axis=-1)[:, None], np.einsum("nk,nk->n", strength, self.down)[:, None]
        push = (whole * self.gap[:, None] + lower) * self.normal
        return np.einsum("nk,nk->n", psi, self.area), push, whole * self.foot - lower * self.normal


def is_round(surface: Surface) -> bool:
    """Whether all points of a surface are alike: a plane without end, a whole sphere or cavity."""
    shape = surface.shape
    if type(shape) is Plane:
        return shape.length is None and shape.width is None
    return type(shape) is Sphere or (type(shape) is Cavity and shape.angle == math.pi)


@lru_cache
def _legendre(order: int) -> tuple[Array, Array]:
    return np.polynomial.legendre.leggauss(order)


def gauss(low: Array, high: Array, order: int) -> tuple[Array, Array]:
    """Nodes and weights (n, k) of Gauss's rule on pieces of the intervals between two arrays (n,)."""
    pieces = max(1, math.ceil(float(np.max(high - low)) / PIECE))
    x, w = _legendre(order)
    at = ((np.arange(pieces)[:, None] + (x + 1) / 2) / pieces).ravel()
    length = (high - low)[:, None]
    return low[:, None] + length * at, length * np.tile(w / 2, pieces) / pieces


def inner_nodes(surface: Surface, x: Array, order: int, law: PairEnergy, rtol: float) -> Grid | Circles:
    """Nodes around the nearest point of the surface for each point (n, 3); InputError where it is in the body."""
    found = surface.nearest(x)
    if not np.all(found.gap > 0):
        raise InputError("the surfaces overlap; a law of pairs of points holds outside only.")
    # Of what lies beyond, a part of size (h / reach)^(decay - 2) of all is missed.
    reach = np.minimum(found.gap * (rtol / 10) ** (-1 / (law.decay - 2)), law.cutoff)
    if is_round(surface):
        return _around(surface, found, reach, order, law.cutoff)
    low, high = np.transpose(surface.shape.span)
    _, x_u, x_v = surface.derivatives(found.at, FIRST)
    axes = []
    for k, tangent in enumerate((x_u, x_v)):
        at, size = found.at[:, k], np.maximum(np.linalg.norm(tangent, axis=-1), POLE)
        ends = (at - math.pi, at + math.pi) if surface.shape.closed[k] else (low[k], high[k])
        scale, far = found.gap / size, reach / size
        below, above = np.minimum(at - ends[0], far), np.minimum(ends[1] - at, far)
        t, w = gauss(-np.arcsinh(below / scale), np.arcsinh(above / scale), order)
        axes.append((at[:, None] + scale[:, None] * np.sinh(t), w * scale[:, None] * np.cosh(t)))
    (u, du), (v, dv) = axes
    u, v = np.broadcast_arrays(u[:, :, None], v[:, None, :])
    points, x_u, x_v = surface.derivatives(np.stack([u, v], axis=-1).reshape(len(x), -1, 2), FIRST)
    E, F, G = (np.einsum("nkc,nkc->nk", *pair) for pair in ((x_u, x_u), (x_u, x_v), (x_v, x_v)))
    return Grid(x, points, np.sqrt(E * G - F**2) * (du[:, :, None] * dv[:, None, :]).reshape(len(x), -1))


def _around(surface: Surface, near: Projection, reach: Array, order: int, cutoff: float) -> Circles:
    """Circles around the feet on a plane, a sphere or a cavity, up to where a law ends."""
    shape, gap = surface.shape, near.gap
    bent = 0.0 if isinstance(shape, Plane) else getattr(shape, "bulge") / getattr(shape, "R")  # noqa: B009
    end = np.minimum(reach, math.pi / abs(bent)) if bent else reach
    if math.isfinite(cutoff):
        # The circle at which the distance is the cut-off, from the law of cosines.
        chord = np.maximum(cutoff**2 - gap**2, 0.0) / (1 + bent * gap)
        end = 2 / abs(bent) * np.arcsin(np.minimum(np.sqrt(chord) * abs(bent) / 2, 1)) if bent else np.sqrt(chord)
    t, w = gauss(np.zeros_like(gap), np.arcsinh(end / gap), order)
    s = gap[:, None] * np.sinh(t)
    ds = w * np.hypot(gap[:, None], s)
    chord = 2 * np.sin(bent * s / 2) / bent if bent else s
    out = np.sin(bent * s) / bent if bent else s
    # The law of cosines for a chord, which does not cancel next to the foot.
    r = np.sqrt(gap[:, None] ** 2 + (1 + bent * gap[:, None]) * chord**2)
    return Circles(near.point, near.normal, gap, r, bent * chord**2 / 2, 2 * math.pi * np.abs(out) * ds)


def closest(outer: Surface, inner: Surface, size: float, alike: tuple[bool, bool]) -> tuple[Array, float]:
    """Parameters of the point of one surface that is nearest to the other, and the gap there [m].

    It is sought near the origin within ``size`` [m] where a surface has no end.
    """
    low, high = np.nan_to_num(np.transpose(outer.shape.span), posinf=size, neginf=-size)
    grid = np.stack(np.meshgrid(*np.linspace(low, high, 33).T, indexing="ij"), axis=-1).reshape(-1, 2)
    if outer.shape.about_axis and low[0] == 0:
        grid = np.maximum(grid, [POLE, -np.inf])
    gaps = inner.nearest(outer.derivatives(grid, FIRST)[0]).gap
    at = grid[np.argmin(gaps)]
    if any(alike):
        return at, float(gaps.min())
    from scipy.optimize import minimize

    scale = (high - low) / 32

    def gap(z: Array) -> float:
        return float(inner.nearest(outer.derivatives(np.clip(at + z * scale, low, high), FIRST)[0]).gap)

    found: Any = minimize(gap, np.zeros(2), method="Nelder-Mead", options={"xatol": SHALLOWEST})
    return np.clip(at + found.x * scale, low, high), float(found.fun)


@dataclass(frozen=True)
class Outer:
    """Nodes over the outer surface around its nearest point; directions in which nothing changes have two of them."""

    surface: Surface
    at: Array
    scale: Array
    low: Array
    high: Array
    alike: tuple[bool, bool]

    @property
    def box(self) -> tuple[Array, Array]:
        """Ends of the substituted parameters in the directions in which something changes."""
        free = [k for k in range(2) if not self.alike[k]]
        ends = np.arcsinh((np.stack([self.low, self.high]) - self.at) / self.scale)
        return ends[0, free], ends[1, free]

    def nodes(self, t: Array) -> tuple[Array, Array]:
        """Points (n, k, 3) and vectors of their area (n, k, 3) at substituted parameters (n, free)."""
        rows, weights, free = [], [], iter(t.T)
        for k in range(2):
            if self.alike[k]:
                middle, half = (self.low[k] + self.high[k]) / 2, (self.high[k] - self.low[k]) / 2
                # Across a closed direction what points there cancels, along a length Gauss's rule of two points.
                shift = half / 2 if self.surface.shape.closed[k] else half / math.sqrt(3)
                rows.append(np.broadcast_to([middle - shift, middle + shift], (len(t), 2)))
                weights.append(np.full((len(t), 2), half))
            else:
                z = next(free)
                rows.append((self.at[k] + self.scale[k] * np.sinh(z))[:, None])
                weights.append((self.scale[k] * np.cosh(z))[:, None])
        u, v = np.broadcast_arrays(rows[0][:, :, None], rows[1][:, None, :])
        at = np.stack([u, v], axis=-1).reshape(len(t), -1, 2)
        x, area = self.surface.elements(at)
        return x, area * (weights[0][:, :, None] * weights[1][:, None, :]).reshape(len(t), -1, 1)


def outer_nodes(outer: Surface, inner: Surface, size: float, reach: float) -> tuple[Outer, float]:
    """The nodes over a surface that are graded towards the other, and the gap where they are nearest."""
    if type(outer.shape) is Plane and is_round(outer) and outer.shape.tilt == 0:
        # Polar coordinates, in which nothing may change around an axis.
        polar = Surface(Disc(), outer.upper, outer.approach)
        outer = polar if alike_around(polar, inner) else outer
    alike = _alike_along(outer, inner), alike_around(outer, inner)
    at, gap = closest(outer, inner, size, alike)
    low, high = np.transpose(outer.shape.span)
    _, x_u, x_v = outer.derivatives(at, FIRST)
    lengths = np.maximum(np.linalg.norm([x_u, x_v], axis=-1), POLE)
    scale = max(abs(gap), size * SHALLOWEST) / lengths
    closed, far = np.array(outer.shape.closed), reach / lengths
    low, high = (np.where(closed, at + s * math.pi, np.clip(e, -far, far)) for s, e in ((-1, low), (1, high)))
    return Outer(outer, at, scale, low, high, alike), gap


def alike_around(outer: Surface, inner: Surface) -> bool:
    """Whether nothing changes around a common axis."""
    axial = all(s.shape.tilt == 0 for s in (outer, inner)) and outer.shape.about_axis
    return axial and (inner.shape.about_axis or is_round(inner))


def _alike_along(outer: Surface, inner: Surface) -> bool:
    """Whether nothing changes along a cylinder over something without end in its direction."""
    shapes = outer.shape, inner.shape
    if not isinstance(shapes[0], Cylinder) or any(shape.tilt for shape in shapes):
        return False
    same = shapes[0].turn == shapes[1].turn and isinstance(shapes[1], Cylinder) and shapes[1].length is None
    return same or (is_round(inner) and isinstance(shapes[1], Plane))


def _scaled(integrand: Callable[[Array, int], Array], order: int, usual: Array, t: Array) -> Array:
    return integrand(t, order) / usual


def product_rule(box: Sequence[Array], order: int) -> tuple[Array, Array]:
    """Nodes (n, directions) and weights (n,) over a box."""
    rules = [gauss(low[None], high[None], order) for low, high in zip(*box, strict=True)]
    at = np.stack(np.meshgrid(*(t[0] for t, _ in rules), indexing="ij"), axis=-1).reshape(-1, len(rules))
    return at, np.prod(np.stack(np.meshgrid(*(w[0] for _, w in rules), indexing="ij")), axis=0).ravel()


def integral(
    integrand: Callable[[Array, int], Array], box: Sequence[Array], sizes: Callable[[Array], Array], rtol: float
) -> tuple[Array, float]:
    """Integral over a box of an array, a function of nodes and of the order of rules inside it, and its error relative
    to the ``sizes`` of the entries; InputError where the accuracy is out of reach.
    """
    before: Array | None = None
    for order in ORDERS:
        at, weights = product_rule(box, order)
        now = np.tensordot(weights, integrand(at, order), axes=1)
        if before is not None:
            error = float(np.max(np.abs(now - before) / sizes(now)))
            if error <= rtol:
                return now, error
        before = now
    return _adaptive(integrand, box, sizes, rtol, now)


def _adaptive(
    integrand: Callable[[Array, int], Array],
    box: Sequence[Array],
    sizes: Callable[[Array], Array],
    rtol: float,
    about: Array,
) -> tuple[Array, float]:
    """The same where something narrow is elsewhere than at the foot: the box is divided where it is."""
    from scipy.integrate import cubature

    usual, most = sizes(about), MOST_DIVISIONS
    order = next(order for least, order in WITHIN.items() if rtol >= least)
    scaled = partial(_scaled, integrand, order, usual)
    found: Any = cubature(scaled, *box, rule="gk15", rtol=0.0, atol=rtol, max_subdivisions=most)
    error = float(np.max(np.abs(found.error * usual) / sizes(found.estimate * usual)))
    if not error <= rtol:
        raise InputError(
            f"the accuracy {rtol:g} of an integral over the surfaces is out of reach: it errs by {error:.2g}."
        )
    return found.estimate * usual, error
