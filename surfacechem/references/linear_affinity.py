"""Bonding and debonding with a rate linear in the affinity, isothermal."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.references.base import Array, Parameters, Reference, SceneView


class LinearAffinity(Reference):
    r"""Two-way bonding whose rate is linear in the affinity, constant temperature.

    .. math:: \phi=\phi_{eq}+(\phi_i-\phi_{eq})e^{-\lambda t},\quad \lambda=\frac{c_rK_c}{n_c},\quad
        R_f=n_ck_f(1-\phi),\quad R_b=n_ck_b\phi,\quad R_c=R_f-R_b=n_c\dot\phi

    with :math:`k_f=\lambda\phi_{eq}`, :math:`k_b=\lambda(1-\phi_{eq})`. Any t >= 0.

    Source: Sauer, Duong & Mandadapu (2021), section 5.7 (bonding reactions), linear law, integrated.

    >>> sites = LinearAffinity(n_c=1e18, c_r=4e18, K_c=0.275, phi_eq=0.2 / 0.275, phi_i=0.05)
    >>> f"{sites.solution(0.06043817678166709)['phi']:.12f}"
    '0.093562342248'
    """

    name: ClassVar[str] = "linear-affinity"

    n_c: float = parameter("1/m^2", "density of bonding sites", above=0)
    c_r: float = parameter("1/(J s)", "rate constant per bond", at_least=0)
    K_c: float = parameter("J/m^2", "bond energy density", at_least=0)
    phi_eq: float = parameter("1", "equilibrium bonding state", at_least=0, at_most=1)
    phi_i: float = parameter("1", "initial bonding state", default=0.0, at_least=0, at_most=1)

    @classmethod
    def from_scene(cls, scene: SceneView) -> Parameters:
        sites = {"n_c": scene.constant("N_c"), "c_r": scene.reaction("c_r")}
        bonds = {"K_c": scene.potential("K_0"), "phi_eq": scene.potential("phi_eq"), "phi_i": scene.initial("phi")}
        return {**sites, **bonds}

    @property
    def relaxation_rate(self) -> float:
        """The rate [1/s] at which the distance from equilibrium decays."""
        return self.c_r * self.K_c / self.n_c

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        lam, distance = self.relaxation_rate, self.phi_eq - self.phi_i
        phi = self.phi_i - distance * np.expm1(-lam * t)
        return {
            "phi": phi,
            "R_forward": self.n_c * lam * self.phi_eq * (1.0 - phi),
            "R_backward": self.n_c * lam * (1.0 - self.phi_eq) * phi,
            "R_c": self.n_c * lam * distance * np.exp(-lam * t),
        }
