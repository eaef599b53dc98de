"""Rupture of bonds under a constant force."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.references._bell import BellBond
from surfacechem.references.base import Array


class BellConstantForce(BellBond):
    r"""Bonds that break under a constant force without forming again.

    .. math:: \phi=\phi_ie^{-kt},\qquad \ln k=\ln k_{off}+\frac{fx_{off}}{k_BT}

    The rate is kept as its logarithm, so that no force overflows; :math:`\ln\phi` is exact where :math:`\phi` itself is
    zero in double precision.

    Source: Bell (1978), Science 200, 618-627, doi 10.1126/science.347575.

    >>> bond = BellConstantForce(k_off=0.1, x_off=4e-10, T=300.0, f=3e-11)
    >>> f"{bond.solution(1.37945379273430010)['phi']:.12f}, {bond.half_life:.6f} s"
    '0.082084998624, 0.382466 s'
    """

    name: ClassVar[str] = "bell-constant-force"

    f: float = parameter("N", "force per bond")

    @property
    def log_rate(self) -> float:
        """Logarithm of the rupture rate in 1/s."""
        return math.log(self.k_off) + self.f / self.force_scale

    @property
    def half_life(self) -> float:
        """Time [s] in which half of the bonds break; zero below 1e-323 s."""
        return math.log(2.0) * math.exp(-max(self.log_rate, -700.0))

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        broken = np.exp(np.log(t) + self.log_rate)
        return {"phi": self.phi_i * np.exp(-broken), "ln_phi": math.log(self.phi_i) - broken}
