"""Force of a law of the gap between two curved surfaces: its energy per area integrated over one of them.

Each point of body 1 contributes with the gap to its closest point on body 2, where the opposite traction acts, so that
net force and net moment vanish up to roundoff. For a pairwise law with the energy between flats this is its local
approximation. Source: Sauer, Duong & Mandadapu (2021), eqs. e:bt_sr and e:psi_c.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from surfacechem.contracts.terms import HeatTransfer, PairEnergy, Potential, Varying, optional, reads
from surfacechem.errors import InputError
from surfacechem.surfaces.inner_sums import gauss_rule, kernel, laws_by_extent, with_slope
from surfacechem.surfaces.pairwise import ENDLESS_REACH, check_finite, length
from surfacechem.surfaces.patches import Budget, Patches, Rules, integral, outer_patches, with_levels
from surfacechem.surfaces.projection import FIRST_ORDER, MOST_NEWTON_STEPS, Array, Projection, Surface, cross
from surfacechem.surfaces.shapes import Plane
from surfacechem.tolerances import FORMULA_EPS, NEGLIGIBLE, SQRT_EPS, SUM_RTOL, TINY

GAP = "g_n"

Density = Callable[[Array], Array]
"""Function from n gaps [m] to energy per area [J/m^2] and traction [Pa], tension positive, shape (n, 2)."""

AREA_ACCURACY = NEGLIGIBLE**2
"""Relative accuracy of the contact area, which affects no force, unless a lower one is requested."""

UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class Contact:
    """Result of the integrals over the gap.

    Energy [J], forces [N] and moments about the origin [N m] on both bodies, area of touch or overlap [m^2], heat
    conductance [W/K] and its slope over the approach [W/(K m)], least gap [m] and the number of places with it, and the
    error relative to the size of each.
    """

    energy: float
    force_1: Array
    force_2: Array
    moment_1: Array
    moment_2: Array
    area: float
    conductance: float
    conductance_slope: float
    gap: float
    places: int
    error: float


def density(law: Potential | HeatTransfer) -> Callable[[Array], Array]:
    """Return value and slope of a law over the gap as machine code; InputError if it depends on anything else."""
    import symengine

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
    size = length(lower, upper)
    below, above = (_corners(body, size * ENDLESS_REACH) for body in (lower, upper))
    n, m = upper.axes[:, 2], lower.axes[:, 2]
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


def _corners(plate: Surface, far: float) -> Array:
    """Return the corners of a plate in order, shape (4, 3)."""
    (a, b), (c, e) = np.nan_to_num(plate.shape.span, posinf=far, neginf=-far)
    return np.asarray(plate.derivatives(np.array([(a, c), (b, c), (b, e), (a, e)]), FIRST_ORDER)[0])


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
        parts = [
            max(abs(found[0]), floor[0], force * size * NEGLIGIBLE**2),
            *[force] * 6,
            *[max(moment, force * size)] * 6,
        ]
        # Where bodies just touch, the overlap is roundoff.
        area = max(abs(found[13]), SQRT_EPS * size**2) * max(1.0, AREA_ACCURACY / rtol)
        flow = max(abs(found[14]), TINY)
        return np.array([*parts, area, flow, max(abs(found[15]), flow / size)])

    whole, error, _ = integral(patches, integrand, upper.search, sizes, rtol, budget, nested=False)
    _check_end(patches, Rules(integrand, upper.search, budget), sizes(whole))
    force_1, force_2, moment_1, moment_2 = np.split(whole[1:13], 4)
    energy, area, conductance, slope = map(float, whole[[0, 13, 14, 15]])
    gap = float(near.gap[0])
    return Contact(energy, force_1, force_2, moment_1, moment_2, area, conductance, slope, gap, near.count, error)


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
