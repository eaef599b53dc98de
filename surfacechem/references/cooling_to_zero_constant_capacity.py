"""Constant heat extraction down to zero temperature, constant capacity."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from surfacechem.references._cooling import SteadyCooling
from surfacechem.references.base import Array


class CoolingToZeroConstantCapacity(SteadyCooling):
    r"""Constant heat extraction with a constant capacity.

    .. math:: T=T_i(1-t/t_0),\qquad t_0=CT_i/Q

    Exact for 0 <= t <= t_0, which is `end_time`; the relative accuracy holds up to there.

    Source: energy balance of a body with constant capacity, integrated.

    >>> body = CoolingToZeroConstantCapacity(C=100.0, T_i=300.0, Q=50.0)
    >>> body.end_time, float(body.solution(270.0)["T"])
    (600.0, 165.0)
    """

    name: ClassVar[str] = "cooling-to-zero-constant-capacity"

    @property
    def end_time(self) -> float:
        """Time [s] at which the temperature is zero."""
        return self.C * self.T_i / self.Q

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        return {"T": self.T_i * ((self.end_time - t) / self.end_time)}
