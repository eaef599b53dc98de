"""What laws that are given as measured conductances share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar, Literal

from surfacechem.contracts.terms import HeatTransfer, option
from surfacechem.expressions import Expression
from surfacechem.laws.tabulated import Curve


class ConductanceTable(HeatTransfer):
    """Conductances measured at points of one variable; subclasses have the points as a field, and state the law."""

    over: ClassVar[str]
    """The variable."""
    points: ClassVar[str]
    """The field that holds its points."""

    conductances: Sequence[float] = option("conductances at the points [W/(m^2 K)]")
    extrapolation: Literal["hold", "linear", "refuse"] = option("beyond the ends of the table", default="hold")

    def __post_init__(self) -> None:
        """Check that the table is one."""
        super().__post_init__()
        Curve.check(self._at, self.conductances, self.points, "conductances")

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
        """The conductance at a value of the variable [W/(m^2 K)]."""
        return Curve(self._at, self.conductances).value(x, linear=self.extrapolation == "linear")
