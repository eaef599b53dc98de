"""Steady state of a viscous film that thins with temperature and loses heat."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.references.base import Array, Reference


class ThinningFilmSteadyState(Reference):
    r"""Steady temperature of a film of viscosity :math:`\eta_0e^{-\beta(T-T_0)}` with a linear heat loss.

    .. math:: D_0e^{-\beta(T-T_0)}=H(T-T_a),\qquad
        T=T_a+\frac1\beta W_0\Big(\frac{\beta D_0}He^{-\beta(T_a-T_0)}\Big)

    evaluated from the logarithm of the argument by Wright's omega function (Corless & Jeffrey 2002), so that nothing
    overflows. Unique and stable for any capacity.

    Source: Sauer, Duong & Mandadapu (2021), section 6.1, viscous law with a temperature-dependent viscosity (Reynolds
    1886) and a loss.

    >>> film = ThinningFilmSteadyState(T_0=300.0, D_0=3000.0, beta=0.04, H=12.0, T_a=300.0)
    >>> f"{film.solution(0.0)['T']:.10f}"
    '343.6382000685'
    """

    name: ClassVar[str] = "thinning-film-steady-state"

    T_0: float = parameter("K", "reference temperature", above=0)
    D_0: float = parameter("W/m^2", "dissipation at T_0", above=0)
    beta: float = parameter("1/K", "decay of the viscosity per kelvin", above=0)
    H: float = parameter("W/(m^2 K)", "conductance to the surroundings", above=0)
    T_a: float = parameter("K", "temperature of the surroundings", above=0)

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        from scipy.special import wrightomega

        log_argument = np.log(self.beta * self.D_0 / self.H) - self.beta * (self.T_a - self.T_0)
        above = float(wrightomega(log_argument)) / self.beta
        return {"T": self.T_a + above, "D": self.H * above}
