"""Patches cut where the gap passes a level at which a law has a kink, and where the nearest point comes to an edge of
the other surface, so that rules stay accurate on both sides.

Source: Saye (2015), doi 10.1137/140966290: along the direction in which the gap changes most its level is found on each
line of nodes; the other direction is cut where the level leaves the patch.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from surfacechem.surfaces.nodes import gauss_rule
from surfacechem.surfaces.patches import FIRST_LEVEL, Levels, Patches
from surfacechem.surfaces.projection import FIRST_ORDER, Array, Projection, Surface

SAMPLES = np.array([0, 1 / 128, 1 / 4, 1 / 2, 3 / 4, 127 / 128, 1])
"""Places along each side of a patch at which it is seen whether it has a level. Two at either end tell the slope there:
a height that turns round between two others has passed it with another sign.
"""

SLIGHT_CUT, CUT_HALVINGS = 0.1, 8
"""A patch of which a level cuts off less, as part times rest, is halved at first, at most so many times more than it
takes until its area is the accuracy.
"""

MOST_CROSSED = 256
"""Patches that an edge crosses beside their level are halved, too, while they are no more: where lines meet, not where
they run along each other.
"""

SIDE_PARTS, ROOT_SAMPLES = 3, 10
"""Parts of a side on each of which there are lines of nodes, and gaps that are looked at to find a level on a line."""


@dataclass(frozen=True)
class LevelPatches(Patches):
    """Patches with the level (n,) that each has, the number of one of the gap to another surface or of an edge of
    that, and the direction (n,) along which it is found; minus one where there is none. Heights over a level that are
    less than the ``noise`` [m] are none.
    """

    arrays: ClassVar[Sequence[str]] = (*Patches.arrays, "level", "along", "share", "crossed", "leaves")

    other: Surface
    levels: tuple[float, ...]
    noise: float
    level: Levels
    along: Levels
    share: Array
    """Fraction of each below the level times that above."""
    crossed: NDArray[np.bool_]
    """Whether an edge divides each in another way."""
    leaves: Array
    """Coordinates across that direction at which the level leaves each at its ends (n, 2), unless not sought yet."""

    @property
    def fewest(self) -> int:
        """Level of the rule that patches begin with: a level may bulge between the lines on which it is found."""
        return FIRST_LEVEL if self.other.search == 1 else super().fewest

    @property
    def kinds(self) -> Levels:
        """The direction of each."""
        return self.along

    def halved(self) -> Self:
        """Halves of the patches, each with the level it has itself."""
        return super().halved().marked().left()

    def marked(self) -> Self:
        """Patches with the level and its direction as they now are."""
        u, v = (self.low[:, k, None] + (self.high - self.low)[:, k, None] * SAMPLES for k in range(2))
        x, near = self.seen(*np.broadcast_arrays(u[:, :, None], v[:, None, :]))
        heights = self.heights(near)
        # Of several levels the one that divides a patch most evenly.
        below, above = (np.mean(s * heights > self.noise, axis=(1, 2)) for s in (-1, 1))
        best, share = np.argmax(below * above, axis=1), np.max(below * above, axis=1)
        over = np.take_along_axis(heights, best[:, None, None, None], axis=-1)
        # Along its direction a line of nodes passes a level once.
        steps = [np.diff(over[..., 0], axis=k + 1) for k in range(2)]
        turns = np.stack(
            [
                np.any((step.min(axis=k + 1) < -self.noise) & (step.max(axis=k + 1) > self.noise), axis=1)
                for k, step in enumerate(steps)
            ]
        )
        steepness = np.stack([np.abs(step).mean(axis=(1, 2)) for step in steps])
        along = np.argmax(np.where(np.array(self.alike)[:, None], -1.0, np.where(turns, 0.0, steepness)), axis=0)
        # Two edges are never one line; where a gap jumps its level is on the edge. Far from the body no edge counts.
        edges = np.arange(heights.shape[-1]) < len(self.other.edges)
        alike = np.mean((heights > 0) == (over > 0), axis=(1, 2))
        apart = np.where(edges & edges[best, None], np.arange(len(edges)) != best[:, None], (alike > 0) & (alike < 1))
        crossed = np.any((below * above > 0) & apart & (edges | edges[best, None]), axis=1)
        crossed |= (share > 0) & turns[along, np.arange(len(along))]
        crossed &= near.gap.min(axis=(1, 2)) < np.linalg.norm(x[:, -1, -1] - x[:, 0, 0], axis=-1)
        along, none = np.where(share > 0, along, -1), np.full((len(self), 2), math.nan)
        return replace(self, level=best, along=along, share=share, crossed=crossed, leaves=none)

    def nodes(self, order: int) -> tuple[Array, Array]:
        """Points (n, k, 3) of a rule, and their areas (n, k), on both sides of the level; all of one kind."""
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

    def most(self, order: int) -> int:
        """Two sides of the level on each line, and parts across them."""
        return super().most(order) * (2 * SIDE_PARTS if self.along[0] >= 0 else 1)

    def cost(self, order: int) -> int:
        """Cost of the searches for the level on each line of nodes."""
        return 0 if self.along[0] < 0 else len(self) * SIDE_PARTS * order * ROOT_SAMPLES * self.other.search

    def _across(self, j: int, order: int) -> tuple[Array, Array]:
        """Nodes and weights (n, m) across the direction of the level, cut where it leaves the patch."""
        if self.alike[j]:
            return self.rule(j, order)
        edges = np.column_stack([self.low[:, j], self.leaves, self.high[:, j]])
        return gauss_rule(np.sort(edges, axis=1), order)

    def left(self) -> Self:
        """Patches with the places where their levels leave them."""
        leaves = self.leaves.copy()
        for k in range(2):
            chosen = self.along == k
            if self.alike[1 - k] or not chosen.any():
                continue
            passed = self[chosen]
            ends = np.concatenate([passed.low[:, k], passed.high[:, k]])
            leaves[chosen] = passed.joined(passed).crossing(1 - k, ends).reshape(2, -1).T
        return replace(self, leaves=leaves)

    def divided(self, k: int) -> Self:
        """Patches divided at their levels once for all, where nothing changes across a direction."""
        passed, rest = self[self.along == k], self[self.along != k]
        return rest.joined(passed.cut(k, passed.crossing(k, passed.low[:, 1 - k])))

    def crossing(self, k: int, across: Array) -> Array:
        """Coordinate along a direction where each patch passes its level, at one (n,) across it; else its end."""
        from scipy.optimize.elementwise import find_root

        def above(t: Array, across: Array, which: Array) -> Array:
            _, near = self[which].seen(*((t, across) if k == 0 else (across, t)))
            return np.asarray(self.heights(near)[np.arange(len(which)), self.level[which]])

        ends = self.low[:, k], self.high[:, k]
        reached: Any = {"fatol": self.noise}
        found: Any = find_root(above, ends, args=(across, np.arange(len(self))), tolerances=reached)
        return np.asarray(np.where(found.success, found.x, ends[1]))

    def seen(self, u: Array, v: Array) -> tuple[Array, Projection]:
        """Points (n, ..., 3) at substituted parameters (n, ...), and what they see of the other surface."""
        at = np.stack([self.parameters(k, t)[0] for k, t in enumerate((u, v))], axis=-1)
        x = self.surface.derivatives(at, FIRST_ORDER)[0]
        return x, self.other.nearest(x)

    def heights(self, near: Projection) -> Array:
        """Distances (n, ..., levels) [m] of points beyond edges, along which a gap may jump, and over its levels."""
        return np.concatenate([near.beyond, near.gap[..., None] - self.levels], axis=-1)


def with_levels(patches: Patches, other: Surface, levels: Sequence[float], noise: float, rtol: float) -> LevelPatches:
    """Patches of a surface, each with the level of the gap to the other, or the edge of that, which passes through it,
    if one does.
    """
    for k in range(2):
        if not patches.alike[k]:
            # The places that patches gather around, where gaps are least, are at corners of them.
            around = (patches.low[:, k] < 0) & (patches.high[:, k] > 0)
            patches = patches[~around].joined(patches[around].cut(k, 0.0))
    parts = {name: getattr(patches, name) for name in ("surface", "alike", *Patches.arrays)}
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
    if any(found.alike):
        for _ in range(len(levels) + len(other.edges)):
            if np.all(found.along < 0):
                break
            found = found.divided(found.alike.index(False)).marked()
        return found
    for _ in range(CUT_HALVINGS - math.floor(math.log2(rtol) / 2)):
        slight = (found.along >= 0) & (found.share < SLIGHT_CUT)
        if found.crossed.sum() <= MOST_CROSSED:
            slight |= found.crossed
        if not slight.any():
            break
        found = found[~slight].joined(Patches.halved(found[slight]).marked())
    return found.left()
