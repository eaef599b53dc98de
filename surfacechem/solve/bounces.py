"""Rebounds: transitions whose margin leaves an exact zero and may soon be back, ever lower and sooner.

How large the margin has been before is no measure of its rounding then, and a first step must not pass the return.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from surfacechem.solve.contract import Result, Status
from surfacechem.solve.jumps import Jump, Jumper
from surfacechem.tolerances import PICOMETRE

Array = NDArray[np.float64]

ALOFT, SOON = 1.5, 1e-4
"""A time beyond that of the return, in parts of it, and the part of a stretch below which the first step is fitted to
it."""

GAP = 1e-6
"""Size [m] that such a margin has at least where it does not rebound: what is opened slowly begins by rounding."""


MANY = 1000
"""Rebounds of a run from which on they are what its steps were used for."""

ENDLESS = (
    "the number of steps allowed was used up by rebounds; with a smaller coefficient of restitution they would end"
)

MISSED = "the method has not seen the gap close; radau does, or a tighter tolerance"


class Rebounds:
    """The rebounds of a run; ``first`` is the index of the first transition among the margins."""

    def __init__(self, jumper: Jumper, first: int) -> None:
        self.jumper = jumper
        self.margins = [first + j for j, item in enumerate(jumper.system.edges) if item.returns is not None]
        self.count = 0
        self.last = (0.0, 0.0)
        """Time of the last one, and how long it takes to return [s]; zero where that is open."""

    def see(self, jump: Jump) -> None:
        """Remember a jump where it is a rebound, or ends them."""
        if jump.edge.returns is not None:
            self.count += 1
            self.last = jump.t, float(np.max(self.jumper.times_of_return(jump.after.inputs())))

    def pieces(self, start: float, end: float) -> Array:
        """Pieces of a stretch in its own time: one of its own for what returns so soon that a step might miss it."""
        soon = ALOFT * self._aloft(start)
        inside = [soon] if 0 < soon < SOON * (end - start) else []
        return np.array([0.0, *inside, end - start])

    def seen(self, start: float, sizes: Array) -> Array:
        """Sizes of the margins that their rounding is in proportion to."""
        if not self.margins:
            return sizes
        own = sizes.copy()
        own[self.margins] = 0.0 if self._aloft(start) else np.maximum(sizes[self.margins], GAP)
        return own

    def missed(self, result: Result) -> bool:
        """Whether an arc has ended beyond what it should have ended at, by more than has a meaning for bodies."""
        ended = result.events.index if result.status is Status.EVENT else ()
        playing = result.problem.in_play
        found = [j for j in self.margins if playing is None or playing[j]] if len(result.margins) else []
        return any(result.margins[j] < -PICOMETRE and j not in ended for j in found)

    def _aloft(self, start: float) -> float:
        """Time [s] for which what has just rebounded stays away."""
        since, time = self.last
        return time if since == start else 0.0
