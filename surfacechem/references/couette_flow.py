"""Plane Couette flow of a film that heats and thins, solved across the film."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.errors import InputError
from surfacechem.references.base import Array, Parameters, Reference, SceneView

NODES, WEIGHTS = np.polynomial.legendre.leggauss(80)


class CouetteFlow(Reference):
    r"""Steady shear of a film of viscosity :math:`\eta_we^{-\beta(T-T_w)}` between walls at :math:`T_w`.

    .. math:: k\,T''+\tau\,u'=0,\quad\tau=\eta(T)\,u',\qquad
        T=T_w+\frac2\beta\ln\frac{\cosh\lambda}{\cosh\lambda s},\quad
        \sinh\lambda=\sqrt{\mathrm{Na}/8},\quad\mathrm{Na}=\frac{\beta\eta_wv^2}k,\quad
        \tau=\frac{\eta_wv}d\frac{2\lambda}{\sinh2\lambda}

    with s from -1 to 1 across the film. T_c is the mean of T, T_max its largest value. The traction grows with the
    velocity up to the Nahme fold, :math:`\lambda\tanh\lambda=1` at Na = 18.2, beyond which no traction holds a steady
    flow; at a given velocity there is one at any Na.

    An interface with one temperature of the film agrees for :math:`\beta=0`, where
    :math:`T_c-T_w=\eta_wv^2/12k`. It sees the viscosity at T_c instead of across the film: of the rise of T_c it misses
    1.4 % at Na = 1 and 4.3 % at most up to the fold, where its traction is 10 % too large.

    Any t >= 0. Source: Nahme (1940), Ing.-Arch. 11, 191; Gavis & Laurence (1968), doi 10.1021/i160025a032.

    >>> film = CouetteFlow(T_w=300.0, d_m=5e-6, k_m=0.13, eta_w=0.01, beta=0.04, v=30.0)
    >>> f"{film.solution(0.0)['T_c']:.8f}, {film.nahme:.4f}"
    '304.90582203, 2.7692'
    """

    name: ClassVar[str] = "couette-flow"

    T_w: float = parameter("K", "temperature of both walls", above=0)
    d_m: float = parameter("m", "thickness of the film", above=0)
    k_m: float = parameter("W/(m K)", "thermal conductivity of the film", above=0)
    eta_w: float = parameter("Pa s", "viscosity at the walls", above=0)
    beta: float = parameter("1/K", "decay of the viscosity per kelvin", default=0.0, at_least=0)
    v: float = parameter("m/s", "velocity of one wall relative to the other", at_least=0)

    @classmethod
    def from_scene(cls, scene: SceneView) -> Parameters:
        walls = {scene.initial(T) for T in ("T_1", "T_2")}
        if len(walls) > 1:
            raise InputError("it is of a film between walls of one temperature.")
        return {
            "T_w": walls.pop(),
            "d_m": scene.constant("d_m"),
            "k_m": scene.constant("k_m"),
            "eta_w": scene.constant("eta_m"),
            "beta": scene.friction("beta") or 0.0,
            "v": scene.initial("v"),
        }

    @property
    def nahme(self) -> float:
        """Nahme number: how far viscous heating would thin the film."""
        return self.beta * self.eta_w * self.v**2 / self.k_m

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        lam = math.asinh(math.sqrt(self.nahme / 8))
        thinned = 2 * lam / math.sinh(2 * lam) if lam else 1.0
        traction = self.eta_w * self.v / self.d_m * thinned
        mean = float(WEIGHTS @ self._rise(lam, (NODES + 1) / 2)) / 2
        top = float(self._rise(lam, np.zeros(1))[0])
        return {"T_c": self.T_w + mean, "T_max": self.T_w + top, "t_t": traction, "D": traction * self.v}

    def _rise(self, lam: float, s: Array) -> Array:
        """Temperature above the walls [K] at the distance s from the middle, in half thicknesses."""
        if not lam:
            return self.eta_w * self.v**2 / (8 * self.k_m) * (1 - s**2)
        hotter = 2 * np.sinh(lam * (1 + s) / 2) * np.sinh(lam * (1 - s) / 2) / np.cosh(lam * s)
        return np.asarray(2 / self.beta * np.log1p(hotter))
