"""Free slider brought to rest by dry friction."""

from __future__ import annotations

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.references._bodies import UniformBody
from surfacechem.references.base import Array, Quantities, read


class CoulombStop(UniformBody):
    r"""A free mass slides against constant dry friction until it rests; all kinetic energy becomes heat.

    .. math:: v=v_i-\mu p\,t/m\ge0,\quad t_{stop}=\frac{mv_i}{\mu p},\quad s_{stop}=\frac{mv_i^2}{2\mu p},\quad
        T^2=T_i^2+\frac{T_0}Cm(v_i^2-v^2)

    Quadratic energies, perfect thermal contact. Any t >= 0: the velocity is exactly zero from `stop_time` on.

    Source: Sauer, Duong & Mandadapu (2021), eq. e:dry_fric, with Newton's law, integrated.

    >>> slider = CoulombStop(m=5.0, mu=0.25, p=3e4, v_i=2.0, C=100.0, T_0=300.0, T_i=300.0)
    >>> slider.stop_time, slider.stop_distance, float(slider.solution(0.01)["v"])
    (0.0013333333333333333, 0.0013333333333333333, 0.0)
    """

    m: float = parameter("kg/m^2", "mass", above=0)
    mu: float = parameter("1", "sliding friction coefficient", above=0)
    p: float = parameter("Pa", "contact pressure", above=0)
    v_i: float = parameter("m/s", "initial velocity", at_least=0)

    readings = read(tangential="m", friction="mu", initial="p v_i=v")

    @property
    def stop_time(self) -> float:
        """Time [s] at which the mass comes to rest."""
        return self.m * self.v_i / (self.mu * self.p)

    @property
    def stop_distance(self) -> float:
        """Slip [m] at rest."""
        return 0.5 * self.v_i * self.stop_time

    def quantities(self, t: Array) -> Quantities:
        sliding = np.minimum(t, self.stop_time)
        v = np.where(t < self.stop_time, self.v_i - self.mu * self.p / self.m * sliding, 0.0)
        slip = sliding * 0.5 * (self.v_i + v)
        heat = self.mu * self.p * slip
        return {"v": v, "u_t": slip, "heat": heat, "T": self.heated(heat)}
