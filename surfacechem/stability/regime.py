"""What a regime is: a case, a parameter taken over decades until something breaks, and what is expected there."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar, TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]


@dataclass(frozen=True)
class Exact:
    """The run finishes with these values at its output times [s], by name; with so many events, if that is stated.

    States are compared, and named quantities that are listed; each value relative to itself.
    """

    values: Callable[[Array], Mapping[str, Array | float]]
    also: Sequence[str] = ()
    events: int | None = None


@dataclass(frozen=True)
class Stops:
    """Physics ends the run, for a reason that contains these words, at a time [s]."""

    reason: str
    t: float


@dataclass(frozen=True)
class Refused:
    """The input is refused before anything is computed, for a reason that contains these words."""

    reason: str


Expectation: TypeAlias = Exact | Stops | Refused


@dataclass(frozen=True)
class Problem:
    """A shipped case by name, or the text of one, with changes by path, and what is expected of its run."""

    case: str
    times: Sequence[float]
    """Output times [s]; the run begins at 0."""
    expected: Expectation
    changes: Mapping[str, object] = field(default_factory=dict)


class Regime(ABC):
    """One row of the stability matrix. Subclasses state what they are; finding them needs nothing else."""

    name: ClassVar[str]
    title: ClassVar[str]
    symbol: ClassVar[str]
    """What is taken over decades, as in a heading."""
    values: ClassVar[tuple[float, ...]]
    space: ClassVar[Mapping[str, tuple[float, float]]] = {}
    """Decimal logarithms between which a search for the worst corner moves each parameter; empty where it does not."""

    @abstractmethod
    def problem(self, value: float) -> Problem:
        """The case at one value, and what is expected of it."""

    def corner(self, point: Mapping[str, float]) -> Problem:
        """The case at a point of :attr:`space`, of parameters by name."""
        raise NotImplementedError(f"{self.name} has no space to search")

    def label(self, value: float) -> str:
        """A value as in a heading."""
        return f"{value:g}"
