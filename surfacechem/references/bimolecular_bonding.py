"""Bonding of two surfaces with different densities of partners."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.references._special_functions import first_difference
from surfacechem.references.base import Array, Parameters, Reference, SceneView


class BimolecularBonding(Reference):
    r"""Partners of both surfaces that find each other, and bonds that break, constant temperature.

    .. math:: \dot\phi=k_fn_c\Big(\frac{n_1}{n_c}-\phi\Big)\Big(\frac{n_2}{n_c}-\phi\Big)-k_r\phi,\qquad
        \frac{\phi-\phi_{eq}}{\phi-\phi_2}=\frac{\phi_i-\phi_{eq}}{\phi_i-\phi_2}e^{-k_fn_c(\phi_2-\phi_{eq})t}

    :math:`\phi_{eq}<\phi_2` are the zeros of the rate. Both are found, and the solution is written, without
    cancellation, also where they coincide: equal densities and no rupture, :math:`1-\phi=1/(1+k_fn_ct)`. Any t >= 0.

    Source: second-order kinetics with reversal, integrated; e.g. Lauffenburger & Linderman (1993), Receptors.

    >>> sites = BimolecularBonding(k_f=1e-16, k_r=0.5, n_1=1e16, n_2=2e16, n_c=1e16)
    >>> f"{sites.equilibrium:.10f} {sites.solution(1.0)['phi']:.10f}"
    '0.7192235936 0.6490609274'
    """

    name: ClassVar[str] = "bimolecular-bonding"

    k_f: float = parameter("m^2/s", "rate coefficient of formation", above=0)
    k_r: float = parameter("1/s", "rate of rupture", default=0.0, at_least=0)
    n_1: float = parameter("1/m^2", "density of sites on body 1", above=0)
    n_2: float = parameter("1/m^2", "density of sites on body 2", above=0)
    n_c: float = parameter("1/m^2", "density of reference sites", above=0)
    phi_i: float = parameter("1", "initial bonding state", default=0.0, at_least=0)

    @classmethod
    def from_scene(cls, scene: SceneView) -> Parameters:
        N_c, N_1, N_2 = (scene.constant(name) for name in ("N_c", "N_1", "N_2"))
        sites = {"n_c": N_c, "n_1": N_c if N_1 is None else N_1, "n_2": N_c if N_2 is None else N_2}
        return {**sites, **{name: scene.reaction(name) for name in ("k_f", "k_r")}, "phi_i": scene.initial("phi")}

    @property
    def _distance(self) -> float:
        """Distance of the zeros of the rate."""
        p, q, loss = self._scaled
        return math.sqrt((p - q) ** 2 + loss * (loss + 2.0 * (p + q)))

    @property
    def _scaled(self) -> tuple[float, float, float]:
        """Both densities and the rupture rate in units of the reference sites."""
        return self.n_1 / self.n_c, self.n_2 / self.n_c, self.k_r / (self.k_f * self.n_c)

    @property
    def equilibrium(self) -> float:
        """Bonding state in equilibrium."""
        p, q, loss = self._scaled
        return 2.0 * p * q / (p + q + loss + self._distance)

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        start, scaled = self.equilibrium - self.phi_i, self.k_f * self.n_c * t
        decay = self._distance * scaled
        mean = first_difference(np.zeros_like(decay), -decay)  # (1 - exp(-decay)) / decay
        gone = mean * (start * scaled + decay) / (1.0 + start * scaled * mean)
        return {"phi": self.phi_i + start * gone}
