"""Interface without capacity whose dissipation grows exponentially with its temperature."""

from __future__ import annotations

import math

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.errors import InputError
from surfacechem.references._numerics import increasing_root
from surfacechem.references.base import Array, Quantities, Reference, read

SERIES_LIMIT = 0.1
"""Largest argument for which a series of 16 terms is exact: the next term is 0.1^18 / 18, the first 0.1^2 / 2."""


class SemenovFold(Reference):
    r"""Algebraic temperature of an interface whose dissipation is activated by temperature; lower branch.

    .. math:: D_0e^{\beta(T_c-T_0)}=H(T_c-T_0),\qquad T_c=T_0-\frac1\beta W_0\Big(-\frac{\beta D_0}H\Big),\qquad
        D_0\le D_{crit}=\frac H{e\beta}

    Both branches meet at :math:`T_0+1/\beta`; beyond :math:`D_{crit}` no solution exists (ignition). Close to the fold
    W loses half the digits; v = 1 - beta (T_c - T_0) is found to rounding from :math:`-v-\ln(1-v)=-\ln(D_0/D_{crit})`.
    The remaining error is due to the rounding of D_0: T_c is known to about
    :math:`10^{-16}/(\beta\sqrt{1-D_0/D_{crit}})`.

    Source: Semenov (1928), Z. Phys. 48, 571-582, thermal explosion; interface without capacity of Sauer, Duong &
    Mandadapu (2021).

    >>> interface = SemenovFold(T_0=300.0, beta=0.05, H=50.0, D_0=183.939720585721)
    >>> f"{interface.solution(0.0)['T_c']:.10f}, {interface.critical_dissipation:.10f}"
    '304.6392190597, 367.8794411714'
    """

    T_0: float = parameter("K", "temperature of both bodies", above=0)
    beta: float = parameter("1/K", "growth of the dissipation per kelvin", above=0)
    H: float = parameter("W/(m^2 K)", "sum of the conductances to the bodies", above=0)
    D_0: float = parameter("W/m^2", "dissipation at T_0", at_least=0)

    # The factor of a law has the decay per kelvin; beta is the growth.
    readings = read(constant="T_0", total_conductance="H", heating_at_T_0="D_0", friction="beta=-beta")

    def __post_init__(self) -> None:
        """Refuse parameters beyond ignition."""
        super().__post_init__()
        if self.critical_dissipation < self.D_0:
            raise InputError(f"{self.name}: no solution above D_0 = {self.critical_dissipation!r} W/m^2 (ignition).")

    @property
    def critical_dissipation(self) -> float:
        """Largest D_0 [W/m^2] with a solution."""
        return self.H / (math.e * self.beta)

    def quantities(self, t: Array) -> Quantities:
        scaled = scaled_rise(np.array([self.D_0 / self.critical_dissipation]))[0]
        return {"T_c": self.T_0 + scaled / self.beta, "D": self.H * scaled / self.beta}


def scaled_rise(severity: Array) -> Array:
    r"""Return the smaller x with :math:`xe^{1-x}=D_0/D_{crit}`, as 1 - v; not above one."""
    almost_one = np.nextafter(1.0, 0.0)
    with np.errstate(divide="ignore"):
        distance = np.abs(np.log1p(severity - 1.0))
        low = np.minimum(2.0 / (1.0 + np.sqrt(1.0 + 2.0 / distance)), almost_one)
    high = np.minimum(np.sqrt(2.0 * distance), almost_one)
    v = increasing_root(lambda v: log_remainder(-v), distance, np.minimum(low, high), high)
    return np.where(v < 0.5, 1.0 - v, severity / math.e * np.exp(1.0 - v))


def log_remainder(x: Array) -> tuple[Array, Array]:
    r"""Return :math:`x-\ln(1+x)`, by its series where the two would cancel, and the size of its slope."""
    near = np.clip(x, -SERIES_LIMIT, SERIES_LIMIT)
    series = sum((-1) ** n * near**n / n for n in range(2, 18))
    return np.where(np.abs(x) < SERIES_LIMIT, series, x - np.log1p(x)), np.abs(x) / (1.0 + x)
