"""Rupture of bonds under a force that grows at a constant rate."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.references._bell import BellBond
from surfacechem.references._exponential_integrals import scaled_expint
from surfacechem.references.base import Array


class BellRamp(BellBond):
    r"""Bonds under the force :math:`f=rt` that do not form again, and the statistics of the force at which they break.

    .. math:: \frac\phi{\phi_i}=\exp\{-b\,(e^{f/f_\beta}-1)\},\qquad f_\beta=\frac{k_BT}{x_{off}},\quad
        b=\frac{k_{off}f_\beta}r,\\
        f_{mode}=f_\beta\max\Big(\ln\frac1b,0\Big),\quad f_{mean}=f_\beta e^bE_1(b),\quad
        f_{median}=f_\beta\ln\Big(1+\frac{\ln2}b\Big)

    Any loading rate; :math:`\ln\phi` is exact where :math:`\phi` itself is zero in double precision.

    Source: Evans & Ritchie (1997), Biophys. J. 72, 1541-1555, doi 10.1016/S0006-3495(97)78802-7; the mean is the
    integral of their distribution, Abramowitz & Stegun (1964), 5.1.1.

    >>> bond = BellRamp(k_off=0.1, x_off=4e-10, T=300.0, rate=1e-10)
    >>> " ".join(f"{1e12 * force:.6f} pN" for force in (bond.mode, bond.mean, bond.median))
    '47.324836 pN 41.886280 pN 43.683190 pN'
    """

    name: ClassVar[str] = "bell-ramp"

    rate: float = parameter("N/s", "loading rate", above=0)

    @property
    def severity(self) -> float:
        """Rupture rate without force times the time in which the force grows by the force scale: b."""
        return self.k_off * self.force_scale / self.rate

    @property
    def mode(self) -> float:
        """Most probable force at rupture [N]."""
        return self.force_scale * max(-math.log(self.severity), 0.0)

    @property
    def mean(self) -> float:
        """Mean force at rupture [N]."""
        return self.force_scale * float(scaled_expint(1, np.array(self.severity)))

    @property
    def median(self) -> float:
        """Force [N] at which half of the bonds are broken."""
        return self.force_scale * math.log1p(math.log(2.0) / self.severity)

    def log_density(self, f: Array) -> Array:
        """Logarithm of the probability density [1/N] of rupture at the force f."""
        scaled = f / self.force_scale
        return math.log(self.k_off / self.rate) + scaled - self.severity * np.expm1(scaled)

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        f = self.rate * t
        broken = self.severity * np.expm1(f / self.force_scale)
        return {"phi": self.phi_i * np.exp(-broken), "ln_phi": math.log(self.phi_i) - broken, "f": f}
