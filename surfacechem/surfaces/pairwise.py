r"""Force between two surfaces whose points interact in pairs: the double integral of the energy of a pair.

Both tractions come from one potential at the same pairs of points,

.. math:: t_1(x_1) = n_1 n_2 \int_{S_2} \psi'(r) \frac{x_2 - x_1}{r} dA_2,

so that net force and net moment vanish to rounding.
Source: Sauer, Duong & Mandadapu (2021), eqs. e:bt_lr and e:psi12ex.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from surfacechem.contracts.terms import PairEnergy
from surfacechem.errors import InputError
from surfacechem.surfaces.inner_sums import (
    LAST_LEVEL,
    TRUNCATION_PART,
    Extent,
    inner_sums,
    is_round,
    kernel,
    laws_by_extent,
)
from surfacechem.surfaces.nearest_places import NearPlaces
from surfacechem.surfaces.patches import Budget, Patches, integral, outer_patches, with_levels
from surfacechem.surfaces.projection import FIRST_ORDER, Array, Surface, cross
from surfacechem.surfaces.shapes import Plane
from surfacechem.tolerances import FORMULA_EPS, GAP_EPS, NEGLIGIBLE, SUM_RTOL, TINY, ULPS

DECAY_DISTANCES = np.array([1e3, 2e3])
"""Distances, in sizes of the surfaces, at which the decay of a law is tested."""

MOST_DECADES = 100
"""Largest reach over gap, in decades: the largest area is its square."""

ENDLESS_REACH = 1e6
"""Reach over an infinite surface, in sizes of the surfaces, within which a cutoff or an end of a plate is expected."""

POINTS_AT_ONCE = 8
"""Points at which tractions are summed together if the other surface has no circles."""

INTEGRALS = 7
"""Energy, and three components of force and moment."""


@dataclass(frozen=True)
class PairForces:
    """Energy [J], forces [N] and moments about the origin [N m] on both bodies, and the largest relative error of any.

    With several laws all are arrays over them.
    """

    energy: Array
    force_1: Array
    force_2: Array
    moment_1: Array
    moment_2: Array
    error: float
    gap: float
    """Least gap of the surfaces [m]."""
    places: int
    """Number of points at which they are as near."""
    pairs: int
    """Pairs of points that were evaluated."""


def interaction(
    lower: Surface, upper: Surface, laws: Sequence[PairEnergy], rtol: float = SUM_RTOL, budget: Budget | None = None
) -> PairForces:
    """Return the double integrals of laws over two surfaces.

    InputError if an accuracy is out of reach, or takes more than a ``budget``, which other integrals may share. Each
    law uses its own densities.
    """
    check_finite(lower, upper)
    for law in laws:
        _check_decay(law, length(lower, upper), rtol)
        _check_energy(lower, upper, law)
    # The inner surface is the simpler one, if one is.
    swapped = is_round(lower.shape) and (not is_round(upper.shape) or isinstance(lower.shape, Plane))
    swapped |= not is_round(upper.shape) and lower.shape.grain > upper.shape.grain
    outer, inner = (upper, lower) if swapped else (lower, upper)
    found_extents, budget = list(laws_by_extent(laws)), budget or Budget(rtol)
    patches, near = _cut_patches(outer, inner, found_extents, rtol, budget)
    gap = float(near.gap[0])
    rounded = _rounding(outer.derivatives(near.at[0], FIRST_ORDER)[0], gap, found_extents, rtol)
    amounts = np.array([law.n_1 * law.n_2 for law in laws])[:, None]

    def integrand(x: Array, level: int) -> tuple[Array, int]:
        sums, pairs = inner_sums(inner, x, laws, level, rtol)
        found = np.empty((len(x), len(laws), INTEGRALS))
        for j, (energy, push) in enumerate(sums):
            found[:, j, 0], found[:, j, 1:4], found[:, j, 4:] = energy, push, cross(x, push)
        return found * amounts, pairs

    # The truncation error is a hundredth of the accuracy, up to factors of order one.
    rounded += 0.0 if all(math.isfinite(law.cutoff) for law in laws) else 0.1 * rtol
    left = max(rtol, 2 * rounded) - rounded
    # Next to a cutoff the energy is of the order of the force times the distance to it.
    arms = np.array([min(gap, law.cutoff - gap) if law.cutoff > gap else gap for law in laws])[:, None]
    found, error, pairs = integral(
        patches, integrand, inner.search, lambda found: _sizes(found, gap, arms), left, budget
    )
    # The two points of a pair have opposite forces on the line through both, and no net moment.
    _, force, moment = np.split(-found if swapped else found, [1, 4], axis=-1)
    return PairForces(found[:, 0], force, -force, moment, -moment, error + rounded, gap, near.count, pairs)


def _cut_patches(
    outer: Surface, inner: Surface, found: Sequence[Extent], rtol: float, budget: Budget
) -> tuple[Patches, NearPlaces]:
    """Return patches of the outer surface, cut where sums over the inner one have kinks, and the nearest points."""
    size = length(outer, inner)
    reach = max(_reach(outer, inner, extent, rtol) for extent in found)
    patches, near = outer_patches(outer, inner, size, reach, budget)
    gap = float(near.gap[0])
    if not gap > FORMULA_EPS * size:
        text = f"the surfaces overlap or touch, their gap is {gap:.3g} m; a law of pairs of points holds outside only"
        if gap > GAP_EPS:
            text = f"a gap of {gap:.3g} m is lost in the rounding of bodies of {size:.3g} m; give smaller ones"
        raise InputError(f"{text}.")
    levels = sorted({level for extent in found for level in extent.levels(inner.shape)})
    return (with_levels(patches, inner, levels, FORMULA_EPS * size, rtol) if levels else patches), near


def _rounding(x: Array, gap: float, found: Sequence[Extent], rtol: float) -> float:
    """Return the relative error from roundoff of coordinates x at a gap; InputError if it prevents an accuracy."""
    least = FORMULA_EPS + ULPS * float(np.linalg.norm(x)) / gap
    if least > rtol / 2:
        text = f"the accuracy {rtol:.2g} of an integral over the surfaces is out of reach"
        raise InputError(f"{text}: rounding leaves {least:.2g}.")
    # Next to a cutoff the values nearly vanish, and depend on the distance to it.
    left = min((extent.cutoff - gap for extent in found if extent.cutoff > gap), default=math.inf)
    return least + FORMULA_EPS * gap / left


def pair_traction(
    x: Array, normals: Array, inner: Surface, laws: Sequence[PairEnergy], rtol: float, budget: Budget
) -> Array:
    """Return normal tractions (n,) [Pa], tension positive, at points (n, 3) of a surface from all points of another.

    InputError if the sums over the other surface take more than a ``budget``, in which each slice of points is an
    integral.
    """
    found = np.zeros(len(x))
    for part in slices_of(len(x), inner):
        forces = _forces_per_area(x[part], inner, laws, rtol, budget)
        found[part] = np.einsum("nc,nc->n", forces, normals[part])
        budget.done += 1
    return found


def slices_of(count: int, inner: Surface) -> list[slice]:
    """Return slices of this number of points that are summed together."""
    together = count if is_round(inner.shape) else POINTS_AT_ONCE
    return [slice(begin, begin + together) for begin in range(0, count, together)]


def _forces_per_area(x: Array, inner: Surface, laws: Sequence[PairEnergy], rtol: float, budget: Budget) -> Array:
    """Return forces per area (n, 3) on points (n, 3), by rules of increasing level until two successive ones agree."""
    before = None
    for level in range(1, LAST_LEVEL + 1):
        sums, pairs = inner_sums(inner, x, laws, level, rtol)
        budget.take(pairs)
        forces = np.array([law.n_1 * law.n_2 * push for law, (_, push) in zip(laws, sums, strict=True)])
        if before is not None and np.all(np.abs(forces - before) <= rtol * np.linalg.norm(forces, axis=-1)[..., None]):
            break
        before = forces
    return np.asarray(forces.sum(axis=0))


def check_finite(lower: Surface, upper: Surface) -> None:
    """Raise InputError if two infinite surfaces run along each other, so that their energy is infinite too."""
    shapes = [surface.shape for surface in (lower, upper)]
    endless = [[not shape.about_axis and not np.all(np.isfinite(ends)) for ends in shape.span] for shape in shapes]
    # A surface infinite in both directions shares a direction with any that is infinite in one.
    parallel = all(endless[0]) or all(endless[1]) or abs(math.sin(shapes[0].turn - shapes[1].turn)) < FORMULA_EPS
    if any(endless[0]) and any(endless[1]) and parallel:
        raise InputError("both surfaces are endless: give one of them a length, so that the force is finite.")


def _check_decay(law: PairEnergy, size: float, rtol: float) -> None:
    """Raise InputError if a law decays slower than its `decay`, or so slowly that no reach is sufficient."""
    if math.isfinite(law.cutoff):
        return
    near, far = np.abs(kernel(law)(size * DECAY_DISTANCES)[:, 0])
    power = math.log2(near / far) if far > 0 else math.inf
    # Terms that decay faster change the power only slightly.
    if power < law.decay - NEGLIGIBLE:
        text = f"{law.name()} falls off like r^-{power:.3g} over long distances, slower than r^-{law.decay:g}"
        raise InputError(f"{text} as its `decay` says; state a `decay` that it has, above 2.", law.place)
    if -math.log10(rtol) > MOST_DECADES * (law.decay - 2):
        text = f"{law.name()} falls off like r^-{law.decay:g}, too slowly for the accuracy {rtol:.2g}"
        raise InputError(f"{text}; a plane has an infinite energy where it is r^-2.", law.place)


def _reach(lower: Surface, upper: Surface, extent: Extent, rtol: float) -> float:
    """Return the distance from the nearest point up to which a surface is integrated over [m]."""
    size, power = length(lower, upper), extent.decay - 2
    if math.isfinite(extent.cutoff):
        return ENDLESS_REACH * max(size, extent.cutoff)
    shapes = [surface.shape for surface in (lower, upper)]
    rises = max(shape.rises for shape in shapes)
    if not rises or any(np.all(np.isfinite(shape.span)) for shape in shapes):
        return float(size * (rtol * TRUNCATION_PART) ** (-1 / power))
    # At the distance u two infinite ones are u^p apart; for a power m the energy of flats is u^(p (2 - m)) u du.
    drop = max(-surface.shape.point(size, 0.0)[2] for surface in (lower, upper) if surface.shape.rises == rises)
    if rises == 1:  # on the side to which they are tilted, two equal slopes stay closer
        drop = max(drop - size * math.tan(sum(abs(shape.tilt) for shape in shapes)), TINY)
    return float(size * max(1.0, size / drop) ** (1 / rises) * (rtol * TRUNCATION_PART) ** (-1 / (rises * power - 2)))


def _check_energy(lower: Surface, upper: Surface, law: PairEnergy) -> None:
    """Raise InputError if two infinite surfaces separate so slowly that their energy is infinite."""
    shapes = [surface.shape for surface in (lower, upper)]
    turned = [shape for shape in shapes if shape.about_axis and not np.all(np.isfinite(shape.span))]
    endless = turned and not any(np.all(np.isfinite(shape.span)) for shape in shapes)
    # At the distance u their gap is u^p, and the energy of flats for a power m is 2 pi u du u^(p (2 - m)).
    separation = max(shape.rises for shape in shapes)
    if endless and math.isinf(law.cutoff) and separation * (law.decay - 2) <= 2:
        text = f"two endless surfaces have an infinite energy where points interact like r^-{law.decay:g}"
        raise InputError(f"{text}: give the {' and the '.join(shape.name() for shape in turned)} a radius.")


def length(lower: Surface, upper: Surface) -> float:
    """Return a length of the surfaces [m]: the largest radius or extent."""
    shapes = [surface.shape for surface in (lower, upper)]
    # A closed parameter is an angle.
    ends = [end for s in shapes if not s.about_axis for end, closed in zip(s.span, s.closed, strict=True) if not closed]
    spans = [b - a for a, b in ends if np.isfinite(b - a)]
    return float(max([*shapes[0].lengths, *shapes[1].lengths, *spans], default=1.0))


def _sizes(found: Array, gap: float, reach: Array) -> Array:
    """Return the sizes of energies, forces and moments to which errors are relative, as some components vanish.

    That of an energy is at least the force over a ``reach`` [m].
    """
    force = np.maximum(np.linalg.norm(found[:, 1:4], axis=-1, keepdims=True), TINY)
    # Entries that vanish everywhere have the size of the smallest number.
    turning = np.linalg.norm(found[:, 4:], axis=-1, keepdims=True)
    moment = np.maximum(turning, force * gap)
    energy = np.maximum(np.abs(found[:, :1]), force * reach)
    return np.concatenate([energy, np.repeat(force, 3, axis=-1), np.repeat(moment, 3, axis=-1)], axis=-1)
