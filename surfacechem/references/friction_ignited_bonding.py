"""Thermally activated bonding between bodies that friction heats steadily."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.quantities import GAS_CONSTANT
from surfacechem.references._inversion import short_integral
from surfacechem.references._special_functions import scaled_expint
from surfacechem.references.base import Array, Parameters, Reference, SceneView


class FrictionIgnitedBonding(Reference):
    r"""First-order Arrhenius bonding without heat of its own while friction heats a constant capacity.

    .. math:: T=T_i+\frac DCt,\qquad
        \ln\frac{1-\phi}{1-\phi_i}=-\frac{AC}D\big[TE_2(s)-T_iE_2(s_i)\big],\quad s=\frac{E_a}{R_gT}

    where :math:`TE_2(s)=Te^{-s}-\frac{E_a}{R_g}E_1(s)`. Any t >= 0; ln_unbonded is exact where :math:`\phi` rounds to
    one.

    Source: Abramowitz & Stegun (1964), 5.1 (exponential integrals); the temperature integral of non-isothermal
    kinetics at a constant heating rate.

    >>> weld = FrictionIgnitedBonding(A=1e14, E_a=1.2e5, T_i=300.0, C=500.0, D=2500.0)
    >>> f"{weld.solution(26.0)['phi']:.12f}"
    '0.473587795480'
    """

    name: ClassVar[str] = "friction-ignited-bonding"

    A: float = parameter("1/s", "pre-exponential factor", above=0)
    E_a: float = parameter("J/mol", "activation energy", above=0)
    T_i: float = parameter("K", "initial temperature", above=0)
    C: float = parameter("J/(m^2 K)", "total heat capacity", above=0)
    D: float = parameter("W/m^2", "friction power", above=0)
    phi_i: float = parameter("1", "initial bonding state", default=0.0, at_least=0, at_most=1)

    @classmethod
    def from_scene(cls, scene: SceneView) -> Parameters:
        own = {name: scene.reaction(name) for name in ("A", "E_a")}
        heat = {"T_i": scene.temperature, "C": scene.capacity, "D": scene.friction_power()}
        return {**own, **heat, "phi_i": scene.initial("phi")}

    @property
    def heating_rate(self) -> float:
        """Rise of the temperature [K/s]."""
        return self.D / self.C

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        reacted = self._integral(t)
        ln_unbonded = np.log1p(-self.phi_i) - reacted
        return {
            "phi": self.phi_i - (1.0 - self.phi_i) * np.expm1(-reacted),
            "T": self.T_i + self.heating_rate * t,
            "ln_unbonded": ln_unbonded,
        }

    def _integral(self, t: Array) -> Array:
        """Integral of the rate constant over time."""
        rise = self.heating_rate * t
        apart = self.A / self.heating_rate * (self._antiderivative(self.T_i + rise) - self._antiderivative(self.T_i))
        exponent = self.E_a / (GAS_CONSTANT * self.T_i) * rise / (self.T_i + rise)
        early = (exponent < 0.5) & (rise < 0.5 * self.T_i)  # there the difference cancels
        return np.where(early, short_integral(self._rate, t), apart)

    def _antiderivative(self, T: Array | float) -> Array:
        s = np.asarray(self.E_a / (GAS_CONSTANT * T))
        return np.asarray(T * np.exp(-s) * scaled_expint(2, s))

    def _rate(self, t: Array) -> Array:
        return np.asarray(self.A * np.exp(-self.E_a / (GAS_CONSTANT * (self.T_i + self.heating_rate * t))))
