"""Two thick bodies brought into contact."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.references.base import Array, Reference

REACH = 11.0
"""Thickness in units of the square root of diffusivity and time up to which the far side feels less than 1e-13."""


class SuddenContact(Reference):
    r"""Two thick bodies in sudden contact, perfect or through a resistance, until their far sides feel it.

    .. math::

        T_c=\frac{e_1T_1+e_2T_2}{e_1+e_2},\qquad
        T_k(x,t)=T_k+(T_c-T_k)\Big[\mathrm{erfc}\,\xi-e^{ax/\sqrt{\alpha_k}+a^2t}\,
        \mathrm{erfc}\big(\xi+a\sqrt t\big)\Big],\qquad \xi=\frac{x}{2\sqrt{\alpha_kt}}

    with the effusivities :math:`e_k=\sqrt{k_kC_k/L_k}`, diffusivities :math:`\alpha_k=k_kL_k/C_k`, and
    :math:`a=(1/e_1+1/e_2)/R`. In perfect contact the second term is absent, and the contact stays at
    :math:`T_c` from the first instant on.

    Until heat has crossed a body, t < L^2 / (121 alpha). Source: Carslaw & Jaeger (1959), Conduction of Heat in
    Solids, sections 2.7 and 2.15.

    >>> skin = dict(T_1=306.0, C_1=4e4, thickness_1=0.01, conductivity_1=0.4)
    >>> SuddenContact(**skin, T_2=276.0, C_2=4e4, thickness_2=0.01, conductivity_2=40.0).contact
    278.72727272727275
    """

    name: ClassVar[str] = "sudden-contact"
    continuous: ClassVar[bool] = True

    T_1: float = parameter("K", "initial temperature of body 1", above=0)
    T_2: float = parameter("K", "initial temperature of body 2", above=0)
    C_1: float = parameter("J/(m^2 K)", "heat capacity of body 1", above=0)
    C_2: float = parameter("J/(m^2 K)", "heat capacity of body 2", above=0)
    thickness_1: float = parameter("m", "thickness of body 1", above=0)
    thickness_2: float = parameter("m", "thickness of body 2", above=0)
    conductivity_1: float = parameter("W/(m K)", "conductivity of body 1", above=0)
    conductivity_2: float = parameter("W/(m K)", "conductivity of body 2", above=0)
    R: float = parameter("m^2 K/W", "resistance of the contact; 0: perfect", default=0.0, at_least=0)

    @property
    def effusivities(self) -> tuple[float, float]:
        """Of both bodies [J/(m^2 K s^0.5)]."""
        return (
            math.sqrt(self.conductivity_1 * self.C_1 / self.thickness_1),
            math.sqrt(self.conductivity_2 * self.C_2 / self.thickness_2),
        )

    @property
    def diffusivities(self) -> tuple[float, float]:
        """Of both bodies [m^2/s]."""
        return (
            self.conductivity_1 * self.thickness_1 / self.C_1,
            self.conductivity_2 * self.thickness_2 / self.C_2,
        )

    @property
    def contact(self) -> float:
        """Temperature to which the contact goes [K]."""
        e_1, e_2 = self.effusivities
        return (e_1 * self.T_1 + e_2 * self.T_2) / (e_1 + e_2)

    @property
    def end_time(self) -> float:
        """Time at which the nearer far side begins to feel the contact [s]."""
        alpha_1, alpha_2 = self.diffusivities
        return min(self.thickness_1**2 / alpha_1, self.thickness_2**2 / alpha_2) / REACH**2

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        T_1, T_2 = (self.profile(number, np.zeros(1), t)[:, 0] for number in (1, 2))
        if not self.R:
            return {"T_1": T_1, "T_2": T_2, "T": T_1}
        q = (T_1 - T_2) / self.R
        return {"T_1": T_1, "T_2": T_2, "q_1": -q, "q_2": q}

    def profile(self, number: int, x: Array, t: Array) -> Array:
        """Temperatures of a body at distances from the contact [m], shape (times, places)."""
        from scipy.special import erfc, erfcx

        start, alpha = (self.T_1, self.T_2)[number - 1], self.diffusivities[number - 1]
        values = np.full((t.size, x.size), start)
        later = t > 0
        xi = x / (2 * np.sqrt(alpha * t[later, None]))
        reached = erfc(xi)
        if self.R:
            a = sum(1 / e for e in self.effusivities) / self.R
            reached = reached - np.exp(-(xi**2)) * erfcx(xi + a * np.sqrt(t[later, None]))
        values[later] += (self.contact - start) * reached
        return values
