"""Two bodies that conduct heat, brought into contact."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.references._slabs import Slab, flux, inverted, temperature
from surfacechem.references.base import Array, Reference


class ConductingSlabs(Reference):
    r"""Two slabs of constant properties in contact, perfect or through a resistance, with any far sides.

    .. math:: \frac{C_k}{L_k}\dot T_k=k_k\,T_{k,xx},\qquad q=\frac{T_1-T_2}{R}=-k_k T_{k,x}\Big|_{x=0}

    In Laplace transforms, with :math:`p=\sqrt{sC/(kL)}` and the wave that comes back from the far side, each body
    answers to a flux by :math:`Z=(1+rE)/(kp\,(1-rE))`, :math:`E=e^{-2pL}`, :math:`r=(kp-h)/(kp+h)`, and
    :math:`q=\Delta T/(s\,(Z_1+Z_2+R))`. The way back is a quadrature on Talbot's contour, good to 1e-11 of the
    differences of temperature. A body without conductivity is a lump, one without capacity keeps its temperature.

    Any t >= 0. Source: Carslaw & Jaeger (1959), Conduction of Heat in Solids, section 12.8.

    >>> slab = ConductingSlabs(T_1=400.0, C_1=4000.0, thickness_1=2e-3, conductivity_1=0.2, T_2=300.0, R=1e-3)
    >>> f"{slab.solution(20.0)['T_1']:.8f}"
    '306.43289553'
    """

    name: ClassVar[str] = "conducting-slabs"
    continuous: ClassVar[bool] = True

    T_1: float = parameter("K", "initial temperature of body 1", above=0)
    T_2: float = parameter("K", "initial temperature of body 2", above=0)
    C_1: float = parameter("J/(m^2 K)", "heat capacity of body 1", default=0.0, at_least=0)
    C_2: float = parameter("J/(m^2 K)", "heat capacity of body 2", default=0.0, at_least=0)
    thickness_1: float = parameter("m", "thickness of body 1", default=1.0, above=0)
    thickness_2: float = parameter("m", "thickness of body 2", default=1.0, above=0)
    conductivity_1: float = parameter("W/(m K)", "conductivity of body 1; 0: a lump", default=0.0, at_least=0)
    conductivity_2: float = parameter("W/(m K)", "conductivity of body 2; 0: a lump", default=0.0, at_least=0)
    h_far_1: float = parameter("W/(m^2 K)", "conductance at the far side of body 1", default=0.0, at_least=0)
    h_far_2: float = parameter("W/(m^2 K)", "conductance at the far side of body 2", default=0.0, at_least=0)
    T_far_1: float = parameter("K", "temperature beyond the far side of body 1", default=0.0, at_least=0)
    T_far_2: float = parameter("K", "temperature beyond the far side of body 2", default=0.0, at_least=0)
    R: float = parameter("m^2 K/W", "resistance of the contact; 0: perfect", default=0.0, at_least=0)

    @property
    def bodies(self) -> tuple[Slab, Slab]:
        """Both bodies."""
        return (
            Slab(self.T_1, self.C_1, self.thickness_1, self.conductivity_1, self.h_far_1, self.T_far_1),
            Slab(self.T_2, self.C_2, self.thickness_2, self.conductivity_2, self.h_far_2, self.T_far_2),
        )

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        """Temperatures at the contact; through a resistance also the heat fluxes, which begin finite."""
        T_1, T_2 = (self.profile(number, np.zeros(1), t)[:, 0] for number in (1, 2))
        if not self.R:
            return {"T_1": T_1, "T_2": T_2, "T": T_1}
        q = np.full(t.size, (self.T_1 - self.T_2) / self.R)
        q[t > 0] = inverted(lambda s: flux(*self.bodies, self.R, s), t[t > 0])
        return {"T_1": T_1, "T_2": T_2, "q_1": -q, "q_2": q}

    def profile(self, number: int, x: Array, t: Array) -> Array:
        """Temperatures of a body at distances from the contact [m], shape (times, places)."""
        values = np.full((t.size, x.size), self.bodies[number - 1].T)
        for j, place in enumerate(x.tolist()):
            values[t > 0, j] = temperature(self.bodies, self.R, number, place, t[t > 0])
        return values
