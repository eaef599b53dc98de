"""Conductances that are measured, as smooth curves of one variable."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import ClassVar, Literal

from surfacechem.contracts.terms import HeatTransfer, option
from surfacechem.errors import InputError
from surfacechem.expressions import Expression, positive, where


class ConductanceTable(HeatTransfer):
    """Conductances measured at points of one variable; subclasses have the points as a field, and state the law.

    Points are joined by cubics that keep their order: no overshoot, continuous slope; never below zero.

    Source: Fritsch & Butland (1984), doi 10.1137/0905021.
    """

    over: ClassVar[str]
    """The variable."""
    points: ClassVar[str]
    """The field that holds its points."""

    conductances: Sequence[float] = option("conductances at the points [W/(m^2 K)]")
    extrapolation: Literal["hold", "linear", "refuse"] = option("beyond the ends of the table", default="hold")

    def __post_init__(self) -> None:
        """The points are finite, increasing, not negative and at least two."""
        super().__post_init__()
        at, values, of = self._at, self.conductances, self.points
        if len(at) != len(values) or len(at) < 2:
            raise InputError(f"a table needs as many {of} ({len(at)}) as conductances ({len(values)}), at least 2.")
        if not all(math.isfinite(x) for x in (*at, *values)) or min(values) < 0:
            raise InputError(f"{of} and conductances of a table must be finite, and the conductances not negative.")
        if any(b <= a for a, b in pairwise(at)):
            raise InputError(f"{of} of a table must increase from each to the next.")

    @property
    def _at(self) -> Sequence[float]:
        found: Sequence[float] = getattr(self, self.points)
        return found

    @property
    def ranges(self) -> Mapping[str, tuple[float, float]]:
        """From the first point of the table to the last."""
        return {self.over: (self._at[0], self._at[-1])}

    @property
    def peaks(self) -> Mapping[str, Sequence[float]]:
        """The points of the table, between which all may change."""
        return {self.over: tuple(self._at)}

    @property
    def limits(self) -> Mapping[str, tuple[float, float]]:
        """The ends of a table that is not extrapolated."""
        return self.ranges if self.extrapolation == "refuse" else {}

    def _interpolated(self, x: Expression) -> Expression:
        """The conductance [W/(m^2 K)] at a value of the variable; beyond the ends constant, or by the end slopes."""
        from scipy.interpolate import PchipInterpolator

        at, values, linear = self._at, self.conductances, self.extrapolation == "linear"
        interpolation = PchipInterpolator(at, values)
        cubics = interpolation.c.T.tolist()
        slopes = interpolation((at[0], at[-1]), 1).tolist() if linear else (0.0, 0.0)
        result = values[-1] + slopes[1] * (x - at[-1])
        for (low, high), (a, b, c, d) in reversed(list(zip(pairwise(at), cubics, strict=True))):
            z = x - low
            result = where(x < high, d + z * (c + z * (b + z * a)), result)
        result = where(x < at[0], values[0] + slopes[0] * (x - at[0]), result)
        return positive(result) if linear else result
