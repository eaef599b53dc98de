"""At which bounds a scene holds its bonding state, and which bounds other values of its parameters need."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Holding:
    """Bounds at which the bonding state is held, -1 for zero and 1 for the upper one, and how to have others."""

    sides: frozenset[int]
    paths: tuple[str, ...]
    """Paths of the parameters that decide."""
    needed: Callable[[Mapping[str, tuple[float, float]]], frozenset[int]]
    """The bounds that are needed while the parameters that decide lie in intervals, by path."""
    again: Callable[[frozenset[int]], Any]
    """The system of the same scene with other bounds."""

    def needed_by(self, points: Sequence[Mapping[str, float]]) -> frozenset[int]:
        """The bounds that one of several sets of values needs, or more of them."""
        columns = {path: [point[path] for point in points] for path in self.paths}
        anywhere = self.needed({path: (min(values), max(values)) for path, values in columns.items()})
        found: frozenset[int] = frozenset()
        for point in points:
            if found == anywhere:
                break
            found |= self.needed({path: (point[path], point[path]) for path in self.paths})
        return found
