"""A viscous film that thins with temperature, constant capacity."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.references._heated_body import FrictionallyHeated
from surfacechem.references.base import Array


class ThinningFilmConstantCapacity(FrictionallyHeated):
    r"""Heating by a film of viscosity :math:`\eta_0e^{-\beta(T-T_0)}`, constant capacity, no loss.

    .. math:: C\dot T=D_0e^{-\beta(T-T_0)},\qquad T=T_i+\frac1\beta\ln\Big(1+\frac{\beta D_it}C\Big),\quad
        D_i=D_0e^{-\beta(T_i-T_0)}

    Any t >= 0, beta > 0.

    Source: Sauer, Duong & Mandadapu (2021), section 6.1, viscous law with a temperature-dependent viscosity (Reynolds
    1886) and a constant capacity, integrated.

    >>> film = ThinningFilmConstantCapacity(C=4000.0, T_0=300.0, T_i=300.0, D_0=3000.0, beta=0.04)
    >>> f"{film.solution(4e4)['T']:.10f}"
    '477.2727455520'
    """

    name: ClassVar[str] = "thinning-film-constant-capacity"

    beta: float = parameter("1/K", "decay of the viscosity per kelvin", above=0)

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        initial = self.D_0 * np.exp(-self.beta * (self.T_i - self.T_0))
        gained = self.beta * initial * t / self.C
        return {"T": self.T_i + np.log1p(gained) / self.beta, "D": initial / (1.0 + gained)}
