"""Constant heat extraction down to zero temperature."""

from __future__ import annotations

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.references._bodies import UniformBody
from surfacechem.references.base import Array, Quantities, read


class CoolingToZero(UniformBody):
    r"""Constant heat extraction with quadratic energies; zero temperature is reached with infinite slope.

    .. math:: T=T_i\sqrt{1-t/t_0},\qquad t_0=\frac{CT_i^2}{2T_0Q}

    Exact for 0 <= t <= t_0, which is `end_time`, with full relative accuracy up to there.

    Source: Sauer, Duong & Mandadapu (2021), quadratic energy, integrated.

    >>> body = CoolingToZero(C=100.0, T_0=300.0, T_i=300.0, Q=50.0)
    >>> body.end_time, f"{body.solution(270.0)['T']:.10f}"
    (300.0, '94.8683298051')
    """

    Q: float = parameter("W/m^2", "heat extracted", above=0)

    readings = read(heat_supply="Q=-Q")

    @property
    def end_time(self) -> float:
        """Time [s] at which the temperature is zero."""
        return self.C * self.T_i**2 / (2.0 * self.T_0 * self.Q)

    def quantities(self, t: Array) -> Quantities:
        return {"T": self.T_i * np.sqrt((self.end_time - t) / self.end_time)}
