"""Patches cut along levels of the gap at which a law has a kink, and along lines where the foot reaches an edge of the
other surface, so that quadrature stays accurate on both sides.

Source: Saye (2015), doi 10.1137/140966290: the level is located on each line of nodes along the direction in which the
gap changes most; the other direction is cut where the level leaves the patch.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from surfacechem.surfaces.inner_sums import gauss_rule
from surfacechem.surfaces.patches import FIRST_LEVEL, Levels, Patches
from surfacechem.surfaces.projection import FIRST_ORDER, Array, Projection, Surface

SAMPLES = np.array([0, 1 / 128, 1 / 4, 1 / 2, 3 / 4, 127 / 128, 1])
"""Points along each side of a patch at which it is tested for a level. The pairs at the ends give the slope there: a
minimum or maximum between other points shows as a change of its sign.
"""

SLIGHT_CUT, CUT_HALVINGS = 0.1, 8
"""A patch divided so unevenly that part times rest is below this is halved first. The second is the number of halvings
in excess of those that reduce its area to the accuracy.
"""

MOST_CROSSED = 256
"""Patches crossed by an edge in addition to their level are halved too, if there are at most this many: lines then
cross rather than run along each other.
"""

SIDE_PARTS, ROOT_SAMPLES = 3, 10
"""Parts of a side with separate lines of nodes, and gaps evaluated to locate a level on a line."""


@dataclass(frozen=True)
class LevelPatches(Patches):
    """Patches with levels: of the gap to another surface, or of the distance beyond one of its edges.

    ``level`` (n,) is the index of each patch's level, and ``along`` (n,) the direction in which it is located, -1 if it
    has none. Heights above a level smaller than ``noise`` [m] count as zero.
    """

    arrays: ClassVar[Sequence[str]] = (*Patches.arrays, "level", "along", "share", "crossed", "leaves")

    other: Surface
    levels: tuple[float, ...]
    noise: float
    level: Levels
    along: Levels
    share: Array
    """Fraction of each patch below the level times the fraction above."""
    crossed: NDArray[np.bool_]
    """True for patches that an edge divides in another way."""
    leaves: Array
    """Coordinates across that direction where the level leaves each patch at its ends (n, 2); NaN if unknown."""

    @property
    def first_level(self) -> int:
        """Level of the first rule of patches: a cut may be curved between the lines on which it is located."""
        return FIRST_LEVEL if self.other.search == 1 else super().first_level

    @property
    def rule_kinds(self) -> Levels:
        """Direction of the level of each patch."""
        return self.along

    def halved(self) -> Self:
        """Return the halves of the patches, each with its own level."""
        return super().halved().marked().left()

    def marked(self) -> Self:
        """Return the patches with their levels and directions determined anew."""
        u, v = (self.low[:, k, None] + (self.high - self.low)[:, k, None] * SAMPLES for k in range(2))
        x, near = self.seen(*np.broadcast_arrays(u[:, :, None], v[:, None, :]))
        heights = self.heights(near)
        # Take the level that divides a patch most evenly.
        below, above = (np.mean(s * heights > self.noise, axis=(1, 2)) for s in (-1, 1))
        best, share = np.argmax(below * above, axis=1), np.max(below * above, axis=1)
        over = np.take_along_axis(heights, best[:, None, None, None], axis=-1)
        # Choose a direction in which each line of nodes crosses the level once.
        steps = [np.diff(over[..., 0], axis=k + 1) for k in range(2)]
        turns = np.stack(
            [
                np.any((step.min(axis=k + 1) < -self.noise) & (step.max(axis=k + 1) > self.noise), axis=1)
                for k, step in enumerate(steps)
            ]
        )
        steepness = np.stack([np.abs(step).mean(axis=(1, 2)) for step in steps])
        along = np.argmax(np.where(np.array(self.uniform)[:, None], -1.0, np.where(turns, 0.0, steepness)), axis=0)
        # Two edges never coincide; where a gap jumps its level is on the edge. Far from the body edges do not matter.
        edges = np.arange(heights.shape[-1]) < len(self.other.edges)
        alike = np.mean((heights > 0) == (over > 0), axis=(1, 2))
        apart = np.where(edges & edges[best, None], np.arange(len(edges)) != best[:, None], (alike > 0) & (alike < 1))
        crossed = np.any((below * above > 0) & apart & (edges | edges[best, None]), axis=1)
        crossed |= (share > 0) & turns[along, np.arange(len(along))]
        crossed &= near.gap.min(axis=(1, 2)) < np.linalg.norm(x[:, -1, -1] - x[:, 0, 0], axis=-1)
        along, none = np.where(share > 0, along, -1), np.full((len(self), 2), math.nan)
        return replace(self, level=best, along=along, share=share, crossed=crossed, leaves=none)

    def nodes(self, order: int) -> tuple[Array, Array]:
        """Return a rule's points (n, k, 3) on both sides of the level, and areas (n, k); patches are of one kind."""
        k = int(self.along[0])
        if k < 0:
            return super().nodes(order)
        across, width = self._across(1 - k, order)
        n, m = across.shape
        each = self[np.repeat(np.arange(n), m)]
        t, w = gauss_rule(np.stack([each.low[:, k], each.crossing(k, across.ravel()), each.high[:, k]], axis=1), order)
        there, thickness = self.parameters(1 - k, across, width)
        here, length = (part.reshape(n, m, -1) for part in each.parameters(k, t, w))
        at = (here, np.broadcast_to(there[..., None], here.shape))
        return self.points(np.stack(at if k == 0 else at[::-1], axis=-1), length * thickness[..., None])

    def point_count(self, order: int) -> int:
        """Return a rule's points on each patch: on two sides of the level, in several parts across."""
        return super().point_count(order) * (2 * SIDE_PARTS if self.along[0] >= 0 else 1)

    def cost(self, order: int) -> int:
        """Return the cost of the searches for the level on each line of nodes."""
        return 0 if self.along[0] < 0 else len(self) * SIDE_PARTS * order * ROOT_SAMPLES * self.other.search

    def _across(self, j: int, order: int) -> tuple[Array, Array]:
        """Return nodes and weights (n, m) across the direction of the level, cut where it leaves the patch."""
        if self.uniform[j]:
            return self.rule(j, order)
        edges = np.column_stack([self.low[:, j], self.leaves, self.high[:, j]])
        return gauss_rule(np.sort(edges, axis=1), order)

    def left(self) -> Self:
        """Return the patches with the points at which their levels leave them."""
        leaves = self.leaves.copy()
        for k in range(2):
            chosen = self.along == k
            if self.uniform[1 - k] or not chosen.any():
                continue
            passed = self[chosen]
            ends = np.concatenate([passed.low[:, k], passed.high[:, k]])
            leaves[chosen] = passed.joined(passed).crossing(1 - k, ends).reshape(2, -1).T
        return replace(self, leaves=leaves)

    def divided(self, k: int) -> Self:
        """Return the patches divided at their levels once and for all, if nothing varies across a direction."""
        passed, rest = self[self.along == k], self[self.along != k]
        return rest.joined(passed.cut(k, passed.crossing(k, passed.low[:, 1 - k])))

    def crossing(self, k: int, across: Array) -> Array:
        """Return the coordinate along a direction at which each patch passes its level, at ``across``; else its end."""
        from scipy.optimize.elementwise import find_root

        def above(t: Array, across: Array, which: Array) -> Array:
            _, near = self[which].seen(*((t, across) if k == 0 else (across, t)))
            return np.asarray(self.heights(near)[np.arange(len(which)), self.level[which]])

        ends = self.low[:, k], self.high[:, k]
        reached: Any = {"fatol": self.noise}
        found: Any = find_root(above, ends, args=(across, np.arange(len(self))), tolerances=reached)
        return np.asarray(np.where(found.success, found.x, ends[1]))

    def seen(self, u: Array, v: Array) -> tuple[Array, Projection]:
        """Return points (n, ..., 3) at substituted parameters (n, ...), and their projections on the other surface."""
        at = np.stack([self.parameters(k, t)[0] for k, t in enumerate((u, v))], axis=-1)
        x = self.surface.derivatives(at, FIRST_ORDER)[0]
        return x, self.other.nearest(x)

    def heights(self, near: Projection) -> Array:
        """Return distances (n, ..., levels) [m] beyond edges, where the gap may jump, and above levels of the gap."""
        return np.concatenate([near.beyond, near.gap[..., None] - self.levels], axis=-1)


def with_levels(patches: Patches, other: Surface, levels: Sequence[float], noise: float, rtol: float) -> LevelPatches:
    """Return patches of a surface with the gap levels and edges of the other surface that divide them."""
    for k in range(2):
        if not patches.uniform[k]:
            # Points of least gap, towards which patches are graded, must be at corners of patches.
            around = (patches.low[:, k] < 0) & (patches.high[:, k] > 0)
            patches = patches[~around].joined(patches[around].cut(k, 0.0))
    parts = {name: getattr(patches, name) for name in ("surface", "uniform", *Patches.arrays)}
    none = np.zeros(len(patches), dtype=int)
    found = LevelPatches(
        **parts,
        other=other,
        levels=tuple(levels),
        noise=noise,
        level=none,
        along=none,
        share=0.0 * none,
        crossed=none > 0,
        leaves=np.zeros((len(patches), 2)),
    )
    found = found.marked()
    if any(found.uniform):
        for _ in range(len(levels) + len(other.edges)):
            if np.all(found.along < 0):
                break
            found = found.divided(found.uniform.index(False)).marked()
        return found
    for _ in range(CUT_HALVINGS - math.floor(math.log2(rtol) / 2)):
        slight = (found.along >= 0) & (found.share < SLIGHT_CUT)
        if found.crossed.sum() <= MOST_CROSSED:
            slight |= found.crossed
        if not slight.any():
            break
        found = found[~slight].joined(Patches.halved(found[slight]).marked())
    return found.left()
