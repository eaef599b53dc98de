"""Autocatalytic cure of a layer, quadratic energies."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.references._cure import Cure
from surfacechem.references.base import Array


class KamalCure(Cure):
    r"""Adiabatic autocatalytic cure, quadratic energies.

    .. math:: \dot\phi=\Big(A_1e^{-E_1/R_gT}+A_2e^{-E_2/R_gT}\phi^m\Big)(1-\phi)^n,\qquad
        T^2=T_i^2+2T_0\,\Delta T\,(\phi-\phi_i)

    The time :math:`t=\int d\phi/\dot\phi(\phi,T(\phi))` is a sum of Gauss panels that shrink towards both ends, and is
    inverted to rounding. A ΔT of zero is isothermal cure. :math:`n\ge1`; any t >= 0.

    Source: Kamal & Sourour (1973), Polym. Eng. Sci. 13, 59-64, doi 10.1002/pen.760130110, integrated; quadratic
    energy of Sauer, Duong & Mandadapu (2021).

    >>> layer = KamalCure(A_1=4e5, E_1=7e4, A_2=2e6, E_2=6e4, m=0.5, n=1.5, T_i=360.0, T_0=360.0, delta_T=120.0)
    >>> f"{layer.solution(194.380585280484161)['phi']:.10f}"
    '0.5000000000'
    """

    name: ClassVar[str] = "kamal-cure"

    T_0: float = parameter("K", "reference temperature", above=0)

    def temperature(self, cured: Array) -> Array:
        return np.sqrt(self.T_i**2 + 2.0 * self.T_0 * self.delta_T * cured)
