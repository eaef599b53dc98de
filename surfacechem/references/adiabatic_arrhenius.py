"""Adiabatic first-order reaction with an Arrhenius rate: thermal runaway."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.quantities import GAS_CONSTANT
from surfacechem.references._numerics import increasing_root, scaled_Ei, short_integral
from surfacechem.references.base import Array, Quantities, Reference, read


class AdiabaticArrhenius(Reference):
    r"""Adiabatic exothermic first-order bonding with an Arrhenius rate, constant capacity.

    .. math:: \dot\phi=Ae^{-E_a/(R_gT)}(1-\phi),\quad T=T_i+\Delta T\,\phi

    With :math:`s=\frac{E_a}{R_gT}`, :math:`s_i,s_f` its values at :math:`T_i` and :math:`T_f=T_i+\Delta T`

    .. math:: At=e^{s_f}[{\rm Ei}(s_i-s_f)-{\rm Ei}(s-s_f)]-[{\rm Ei}(s_i)-{\rm Ei}(s)]

    is inverted to rounding for :math:`-\ln(1-\phi)`. All terms are scaled by :math:`e^{-s_i}`, so that no activation
    energy overflows. Any t >= 0. During the runaway the error of the temperature is the rounding of t times its slope.

    Source: Abramowitz & Stegun (1964), 5.1 (exponential integral), adiabatic reaction integrated.

    >>> reaction = AdiabaticArrhenius(A=1e13, E_a=1.1e5, T_i=320.0, delta_T=150.0)
    >>> f"{reaction.solution(4743.32606507994)['T']:.8f}"
    '342.50000000'
    """

    A: float = parameter("1/s", "pre-exponential factor", above=0)
    E_a: float = parameter("J/mol", "activation energy", above=0)
    T_i: float = parameter("K", "initial temperature", above=0)
    delta_T: float = parameter("K", "adiabatic temperature rise of the complete reaction", above=0)

    readings = read(reaction="A E_a", temperature="T_i", adiabatic_rise="delta_T")

    @property
    def initial_rate(self) -> float:
        """Initial rate constant [1/s], corrected for the rounding of the exponent, which s_i would amplify."""
        exponent = self._initial_exponent
        exact = Fraction(self.E_a) / (Fraction(str(GAS_CONSTANT)) * Fraction(self.T_i))
        half = math.exp(-0.5 * exponent)
        return half * self.A * half * (1.0 - float(exact - Fraction(exponent)))

    @property
    def _initial_exponent(self) -> float:
        return self.E_a / (GAS_CONSTANT * self.T_i)

    def quantities(self, t: Array) -> Quantities:
        scaled, span = self.initial_rate * t, self._initial_exponent * self.delta_T / (self.T_i + self.delta_T)
        phi = -np.expm1(-increasing_root(self._scaled_time, scaled, scaled, scaled * np.exp(span)))
        return {"phi": phi, "T": self.T_i + self.delta_T * phi}

    def time(self, phi: Array) -> Array:
        """Return the time [s] at which the bonding state is phi."""
        return self._scaled_time(-np.log1p(-phi))[0] / self.initial_rate

    def _scaled_time(self, unreacted: Array) -> tuple[Array, Array]:
        r"""Return :math:`Ae^{-s_i}t` as a function of :math:`-\ln(1-\phi)`, and its slope :math:`e^{s-s_i}`."""
        left, final, s_i = self.delta_T * np.exp(-unreacted), self.T_i + self.delta_T, self._initial_exponent

        def slope(unreacted: Array) -> Array:
            rise = -self.delta_T * np.expm1(-unreacted)
            return np.asarray(np.exp(-s_i * rise / (self.T_i + rise)))

        T = self.T_i - self.delta_T * np.expm1(-unreacted)
        at_start = scaled_Ei(np.array([s_i * self.delta_T / final])) - scaled_Ei(np.array([s_i]))
        now = scaled_Ei(s_i * self.T_i / T * left / final) - scaled_Ei(s_i * self.T_i / T)
        early = unreacted * max(1.0, self.delta_T / self.T_i * max(1.0, s_i)) < 0.25  # the integrals would cancel
        steepness = slope(unreacted)
        return np.where(early, short_integral(slope, unreacted), at_start - steepness * now), steepness
