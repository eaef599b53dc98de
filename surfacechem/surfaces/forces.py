r"""Force between two curved surfaces: of laws between pairs of their points, and of laws of the gap.

For pairs it is the double integral of the energy of a pair. Both tractions come from one potential at the same pairs of
points,

.. math:: t_1(x_1) = n_1 n_2 \int_{S_2} \psi'(r) \frac{x_2 - x_1}{r} dA_2,

so that net force and net moment vanish to rounding.

For a law of the gap its energy per area is integrated over one of them. Each point of body 1 contributes with the gap
to its closest point on body 2, where the opposite traction acts, so that net force and net moment vanish up to
roundoff. For a pairwise law with the energy between flats this is its local approximation.

Source: Sauer, Duong & Mandadapu (2021), eqs. e:bt_lr, e:psi12ex, e:bt_sr and e:psi_c.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from surfacechem.contracts.terms import HeatTransfer, PairEnergy, Potential, Varying, optional, reads
from surfacechem.errors import InputError
from surfacechem.expressions import symengine
from surfacechem.surfaces.inner_sums import (
    LAST_LEVEL,
    TRUNCATION_PART,
    Extent,
    gauss_rule,
    inner_sums,
    is_round,
    kernel,
    laws_by_extent,
    with_slope,
)
from surfacechem.surfaces.nearest_places import NearPlaces
from surfacechem.surfaces.patches import Budget, Patches, Rules, integral, outer_patches, with_levels
from surfacechem.surfaces.projection import FIRST_ORDER, MOST_NEWTON_STEPS, Array, Projection, Surface, cross
from surfacechem.surfaces.shapes import Plane
from surfacechem.tolerances import FORMULA_EPS, GAP_EPS, NEGLIGIBLE, SQRT_EPS, SUM_RTOL, TINY, ULPS

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

    With several pair laws all are arrays over them.
    """

    energy: Any
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
    """Pairs of points that were evaluated, or points whose gap was searched for."""


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
    found, amounts = np.zeros(len(x)), np.array([law.n_1 * law.n_2 for law in laws])[:, None, None]
    for part in slices_of(len(x), inner):
        before = None
        for level in range(1, LAST_LEVEL + 1):  # until two successive rules agree
            sums, pairs = inner_sums(inner, x[part], laws, level, rtol)
            budget.take(pairs)
            forces = amounts * np.array([push for _, push in sums])
            off = rtol * np.linalg.norm(forces, axis=-1)[..., None]
            if before is not None and np.all(np.abs(forces - before) <= off):
                break
            before = forces
        found[part] = np.einsum("nc,nc->n", forces.sum(axis=0), normals[part])
        budget.done += 1
    return found


def slices_of(count: int, inner: Surface) -> list[slice]:
    """Return slices of this number of points that are summed together."""
    together = count if is_round(inner.shape) else POINTS_AT_ONCE
    return [slice(begin, begin + together) for begin in range(0, count, together)]


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
    radii = [getattr(shape, name) or 0.0 for shape in shapes for name in shape.radii]
    return float(max([*radii, *spans], default=0.0) or 1.0)


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


GAP = "g_n"

Density = Callable[[Array], Array]
"""Function from n gaps [m] to energy per area [J/m^2] and traction [Pa], tension positive, shape (n, 2)."""

AREA_ACCURACY = NEGLIGIBLE**2
"""Relative accuracy of the contact area, which affects no force, unless a lower one is requested."""

UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class Contact(PairForces):
    """Result of the integrals over the gap: also the area of touch or overlap [m^2], the heat conductance [W/K], and
    its slope over the approach [W/(K m)].
    """

    area: float
    conductance: float
    conductance_slope: float


def density(law: Potential | HeatTransfer) -> Callable[[Array], Array]:
    """Return value and slope of a law over the gap as machine code; InputError if it depends on anything else."""
    foreign = [name for name in reads(law.statement) if name != GAP and name not in optional(law.statement)]
    varying = [name for name, _ in law.specs() if isinstance(getattr(law, name), Varying)]
    if foreign or varying:
        what = f"reads {foreign[0]}" if foreign else f"has a {varying[0]} that varies"
        raise InputError(f"{law.name()} {what}; over curved surfaces a law may read the gap g_n alone.", law.place)
    g = symengine.Symbol(GAP)
    return with_slope(law.statement(**({GAP: g} if GAP in reads(law.statement) else {})), g)


def between_flats(law: PairEnergy) -> Density:
    """Return the energy of a pair law summed over two flats: the traction is exact, t = -2 pi n_1 n_2 g psi(g).

    The energy is zero at a thousand times the least of the gaps it is evaluated at.
    """
    psi, amount = kernel(law), 2 * np.pi * law.n_1 * law.n_2
    if law.parts is not None:
        # The integral of a power of the distance is a power.
        parts = [(amount * factor / (part.decay - 2), kernel(part)) for factor, part in law.parts(1.0)]

        def summed(gaps: Array) -> Array:
            whole = sum(size * one(gaps)[..., 0] for size, one in parts) * gaps**2
            return np.stack([whole, -amount * gaps * psi(gaps)[..., 0]], axis=-1)

        return summed
    ends, last = np.array([kink for extent in laws_by_extent([law]) for kink in extent.kinks]), law.cutoff

    def at(gaps: Array) -> Array:
        # Pieces of r = g exp(t) up to the cutoff or, without one, to exp(8) g, cut at kinks.
        g = gaps.reshape(-1, 1)
        most = np.log(np.maximum(last / g, 1)) if math.isfinite(last) else np.full_like(g, 8.0)
        cuts = np.clip(np.log(np.maximum(ends / g, 1)), 0, most)
        t, w = gauss_rule(np.sort(np.concatenate([most * np.linspace(0, 1, 9), cuts], axis=1), axis=1), 24)
        r = g * np.exp(t)
        whole = np.sum(psi(r)[..., 0] * r**2 * w, axis=1)
        if math.isinf(last):
            # The remainder of a power follows from its value at the end.
            end = g[:, 0] * math.exp(8)
            whole += psi(end)[..., 0] * end**2 / (law.decay - 2)
        return np.stack([amount * whole.reshape(gaps.shape), -amount * gaps * psi(gaps)[..., 0]], axis=-1)

    return at


def kinks(laws: Iterable[Potential | HeatTransfer]) -> list[float]:
    """Return the gaps at which laws have kinks or narrow peaks, and zero."""
    found = {0.0}
    for law in laws:
        for places in (law.kinks.get(GAP, ()), law.peaks.get(GAP, ())):
            found |= {float(x) for x in (places if isinstance(places, Sequence) else (places,))}
    return sorted(found)


def level_approaches(lower: Surface, upper: Surface, levels: Sequence[float]) -> list[float]:
    """Return the approaches at which the least gap passes levels, where the force has kinks.

    The ``upper`` body is at zero. For two plates these are the approaches at which a corner of one of them passes a
    level, or crossing edges of both, in closed form.
    """
    if not all(type(body.shape) is Plane for body in (lower, upper)):
        return [_approach_at_level(lower, upper, level) for level in levels]
    size, sides = length(lower, upper), []
    for plate in (lower, upper):  # the corners of each in order, shape (4, 3)
        (a, b), (c, e) = np.nan_to_num(plate.shape.span, posinf=size * ENDLESS_REACH, neginf=-size * ENDLESS_REACH)
        sides.append(np.asarray(plate.derivatives(np.array([(a, c), (b, c), (b, e), (a, e)]), FIRST_ORDER)[0]))
    (below, above), n, m = sides, upper.axes[:, 2], lower.axes[:, 2]
    found = []
    for moved in (above + level * n for level in levels):
        # A corner of one plate over the other; the upper one is offset by the level.
        over, under = (below - moved[0]) @ n / n[2], -moved @ m / m[2]
        found += over[_is_on_plate(upper, below - over[:, None] * UP)].tolist()
        found += under[_is_on_plate(lower, moved + under[:, None] * UP)].tolist()
        for a, b in zip(below, np.roll(below, 1, axis=0), strict=True):
            for c, e in zip(moved, np.roll(moved, 1, axis=0), strict=True):
                across = np.cross(b - a, e - c)
                if abs(across[2]) > FORMULA_EPS * np.linalg.norm(b - a) * np.linalg.norm(e - c):
                    d = (a - c) @ across / across[2]
                    s, t = (np.cross(c - a, way)[2] / across[2] for way in (b - a, e - c))
                    found += [float(d)] if 0 <= s <= 1 and 0 <= t <= 1 else []
    distinct = np.unique(found)
    return list(map(float, distinct[np.diff(distinct, prepend=-np.inf) > FORMULA_EPS * size]))


def _approach_at_level(lower: Surface, upper: Surface, level: float) -> float:
    """Return the approach at which the least gap is a level: the level itself unless a body is tilted about its
    summit.
    """
    size = length(lower, upper)
    d, before, step = level, math.nan, math.nan
    for _ in range(MOST_NEWTON_STEPS):
        _, near = outer_patches(lower, replace(upper, approach=d), size, size * ENDLESS_REACH, Budget(SUM_RTOL))
        left = level - float(near.gap[0])
        if abs(left) <= FORMULA_EPS * size:
            break
        # Secant method; the first slope is 1, the largest possible.
        step = left * (step / (before - left) if before - left else 1.0) if math.isfinite(before) else left
        d, before = d + step, left
    return d


def _is_on_plate(plate: Surface, x: Array) -> NDArray[np.bool_]:
    """Return a mask of the points (n, 3) in a plate's plane that are on the plate."""
    return np.asarray(
        np.all(np.abs((x @ plate.axes)[:, :2]) <= np.max(plate.shape.span, axis=1) * (1 + FORMULA_EPS), axis=1)
    )


def over_gap(
    lower: Surface,
    upper: Surface,
    laws: Sequence[Density],
    levels: Sequence[float] = (0.0,),
    heat: Sequence[Callable[[Array], Array]] = (),
    rtol: float = SUM_RTOL,
    floor: tuple[float, float] = (0.0, 0.0),
    budget: Budget | None = None,
) -> Contact:
    """Integrate laws of the gap over body 1; ``levels`` are gaps [m] at which the laws have kinks.

    Errors are relative to energy and force, or to a ``floor`` [J, N] if that is larger. InputError if an accuracy is
    out of reach, or takes more than a ``budget``, which other integrals may share.
    """
    check_finite(lower, upper)
    size, budget = length(lower, upper), budget or Budget(rtol)
    patches, near = outer_patches(lower, upper, size, size * ENDLESS_REACH, budget)
    patches = with_levels(patches, upper, levels, FORMULA_EPS * size, rtol)

    def integrand(x: Array, level: int) -> tuple[Array, int]:
        return integrands(x, upper.nearest(x), laws, heat), len(x)

    def sizes(found: Array) -> Array:
        force, moment = (float(np.linalg.norm(found[k])) for k in (slice(1, 4), slice(7, 10)))
        force = max(force, floor[1], TINY)
        energy = max(abs(found[0]), floor[0], force * size * NEGLIGIBLE**2)
        parts = [energy, *[force] * 6, *[max(moment, force * size)] * 6]
        # Where bodies just touch, the overlap is roundoff.
        area = max(abs(found[13]), SQRT_EPS * size**2) * max(1.0, AREA_ACCURACY / rtol)
        flow = max(abs(found[14]), TINY)
        return np.array([*parts, area, flow, max(abs(found[15]), flow / size)])

    whole, error, points = integral(patches, integrand, upper.search, sizes, rtol, budget, nested=False)
    _check_end(patches, Rules(integrand, upper.search, budget), sizes(whole))
    force_1, force_2, moment_1, moment_2 = np.split(whole[1:13], 4)
    energy, area, conductance, slope = map(float, whole[[0, 13, 14, 15]])
    found = force_1, force_2, moment_1, moment_2, error, float(near.gap[0]), near.count, points
    return Contact(energy, *found, area, conductance, slope)


def _check_end(patches: Patches, rules: Rules, sizes: Array) -> None:
    """Raise InputError if an integrand over an infinite surface does not decay towards its far end."""
    low, high = np.isinf(np.transpose(patches.surface.shape.span))
    last = (high & (patches.high == patches.high.max(axis=0))) | (low & (patches.low == patches.low.min(axis=0)))
    if not last.any():
        return
    ends = patches[last.any(axis=1)]
    none = np.zeros(len(ends), dtype=int)
    share = np.abs(rules(ends, none, none).sum(axis=0) / sizes)
    # The zero of energy is arbitrary, but force and conductance must be finite.
    for name, part in (("force", share[1:7]), ("conductance", share[14:15])):
        if part.max() > NEGLIGIBLE:
            text = f"the {name} over a surface without end has no end either: give that body a radius or a length"
            raise InputError(f"{text}, or name the other one first.")


def integrands(x: Array, near: Projection, laws: Sequence[Density], heat: Sequence[Callable[[Array], Array]]) -> Array:
    """Return the integrands per area at points (n, 3) of body 1, in the order of :class:`Contact`."""
    count = np.zeros((*near.gap.shape, 16))
    for law in laws:
        psi, traction = np.moveaxis(law(near.gap), -1, 0)
        # Tension pulls body 1 against the direction from body 2 to it.
        pull = -traction[..., None] * near.direction
        count[..., 0] += psi
        count[..., 1:7] += np.concatenate([pull, -pull], axis=-1)
        count[..., 7:13] += np.concatenate([cross(x, pull), -cross(near.point, pull)], axis=-1)
    count[..., 13] = near.gap <= 0
    for path in heat:
        h, slope = np.moveaxis(path(near.gap), -1, 0)
        count[..., 14] += h
        # As body 2 moves up, the gap to its closest point grows by the vertical component of the direction.
        count[..., 15] -= slope * near.direction[..., 2]
    return count
