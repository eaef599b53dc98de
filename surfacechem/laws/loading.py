"""Prescribed histories: hold, ramp, harmonic, table."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import ClassVar

from surfacechem.contracts.terms import Load, option, parameter
from surfacechem.errors import InputError
from surfacechem.expressions import Expression, sin
from surfacechem.tolerances import ZERO_TIME


class Hold(Load):
    r"""A constant.

    .. math:: x(t) = x_0

    Source: definition. In a case file the bare value means the same.

    >>> Hold(level=3.0).value(t=7.0)
    3.0
    """

    level: float = parameter("[x]", "value", varies=False)

    def value(self, t: Expression) -> Expression:
        """Value at time t."""
        return self.level


class Ramp(Load):
    r"""A line in time.

    .. math:: x(t) = x_0 + \dot x\,t

    Source: definition. For a ramp that ends, use a table.

    >>> Ramp(start=1.0, rate=0.5).value(t=4.0)
    3.0
    """

    start: float = parameter("[x]", "value at t = 0", default=0.0, varies=False)
    rate: float = parameter("[x]/s", "rate of change", varies=False)

    def value(self, t: Expression) -> Expression:
        """Value at time t."""
        return self.start + self.rate * t


class Harmonic(Load):
    r"""A sine about a mean.

    .. math:: x(t) = \bar x + \hat x \sin(2 \pi f t + \alpha)

    Source: definition.

    >>> Harmonic(mean=1.0, amplitude=0.5, frequency=1.0).value(t=0.25)
    1.5
    """

    cycle = "frequency"

    mean: float = parameter("[x]", "mean value", default=0.0, varies=False)
    amplitude: float = parameter("[x]", "amplitude", varies=False)
    frequency: float = parameter("1/s", "frequency", above=0, varies=False)
    phase: float = parameter("rad", "phase at t = 0", default=0.0, varies=False)

    def value(self, t: Expression) -> Expression:
        """Value at time t."""
        return self.mean + self.amplitude * sin(2 * math.pi * self.frequency * t + self.phase)


class Table(Load):
    r"""Straight lines between given points, constant before the first and after the last.

    .. math:: x(t) = x_j + s_j (t - t_j) \quad \text{for } t_j \le t < t_{j+1}

    A time given twice is a jump, which variables that store energy (gaps, bonds, temperatures of bodies) may not have.
    Source: definition. A step ends at every point, so that no pulse is stepped over.

    >>> table = Table(times=[0.0, 1.0], values=[0.0, 2.0])
    >>> table.bind(table.piece(0.5)).value(t=0.5)
    1.0
    """

    local: ClassVar[dict[str, str]] = {"origin": "s", "level": "[x]", "slope": "[x]/s"}

    times: Sequence[float] = option("times, never decreasing [s]")
    values: Sequence[float] = option("values at the times [x]")

    def __post_init__(self) -> None:
        """Check that the table is a history."""
        super().__post_init__()
        if len(self.times) != len(self.values) or len(self.times) < 2:
            counts = f"as many times ({len(self.times)}) as values ({len(self.values)})"
            raise InputError(f"a table needs {counts}, at least 2.")
        if not all(math.isfinite(x) for x in (*self.times, *self.values)):
            raise InputError("times and values of a table must be finite.")
        if any(b < a for a, b in pairwise(self.times)):
            raise InputError("times of a table must never decrease.")
        for a, b in pairwise(self.times):
            if 0 < b - a < ZERO_TIME:
                raise InputError(f"{b - a:g} s between two times of a table is no time: for a jump give {b:g} s twice.")
        for t, later in zip(self.times, self.times[2:], strict=False):
            if t == later:
                raise InputError(f"a table has no time three times, as {t:g} s; twice is a jump.")

    def breakpoints(self) -> tuple[float, ...]:
        """Every time of the table."""
        return tuple(dict.fromkeys(self.times))

    def jumps(self) -> tuple[float, ...]:
        """Times given twice with different values."""
        points = list(zip(self.times, self.values, strict=True))
        return tuple(t for (t, x), (s, y) in pairwise(points) if t == s and x != y)

    def piece(self, start: float) -> Mapping[str, float]:
        """Origin, level and slope of the segment that begins at ``start``."""
        # At a jump the later value holds.
        j = bisect_right(self.times, start) - 1
        if j < 0 or j + 1 >= len(self.times):
            edge = max(j, 0)
            return {"origin": 0.0, "level": self.values[edge], "slope": 0.0}
        slope = (self.values[j + 1] - self.values[j]) / (self.times[j + 1] - self.times[j])
        return {"origin": self.times[j], "level": self.values[j], "slope": slope}

    def value(self, t: Expression) -> Expression:
        """Value at time t on the bound segment."""
        return self.level + self.slope * (t - self.origin)

    def __getattr__(self, name: str) -> Expression:
        """Refuse local fields before the law is bound to a segment."""
        raise AttributeError(f"table is not bound to a piece: {name}")
