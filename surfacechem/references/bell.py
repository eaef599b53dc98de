"""Rupture of bonds by Bell's law: under a constant force, and under a force that grows at a constant rate."""

from __future__ import annotations

import math

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.quantities import BOLTZMANN
from surfacechem.references._numerics import scaled_expint
from surfacechem.references.base import Array, Quantities, Reference, read


class BellBond(Reference):
    """Bonds with a rupture rate exponential in their force, by a rate without force and a transition distance."""

    k_off: float = parameter("1/s", "rupture rate without force", above=0)
    x_off: float = parameter("m", "distance to the transition state", above=0)
    T: float = parameter("K", "temperature", above=0)
    phi_i: float = parameter("1", "initial bonding state", default=1.0, above=0, at_most=1)

    readings = read(reaction="k_off x_off", initial="phi_i=phi", temperature="T")

    @property
    def force_scale(self) -> float:
        """Force [N] that increases the rupture rate by a factor e: k_B T / x_off."""
        return BOLTZMANN * self.T / self.x_off


class BellConstantForce(BellBond):
    r"""Bonds that break under a constant force without forming again.

    .. math:: \phi=\phi_ie^{-kt},\qquad \ln k=\ln k_{off}+\frac{fx_{off}}{k_BT}

    The rate is kept as its logarithm, so that no force overflows; :math:`\ln\phi` is exact even if :math:`\phi`
    underflows to zero.

    Source: Bell (1978), Science 200, 618-627, doi 10.1126/science.347575.

    >>> bond = BellConstantForce(k_off=0.1, x_off=4e-10, T=300.0, f=3e-11)
    >>> f"{bond.solution(1.37945379273430010)['phi']:.12f}, {bond.half_life:.6f} s"
    '0.082084998624, 0.382466 s'
    """

    f: float = parameter("N", "force per bond")

    readings = read(initial="f")
    statistics = ("lifetime",)

    @property
    def log_rate(self) -> float:
        """Logarithm of the rupture rate in 1/s."""
        return math.log(self.k_off) + self.f / self.force_scale

    @property
    def lifetime(self) -> float:
        """Mean time [s] to rupture, 1/k; zero below 1e-323 s."""
        return math.exp(-max(self.log_rate, -700.0))

    @property
    def half_life(self) -> float:
        """Time [s] in which half of the bonds break; zero below 1e-323 s."""
        return math.log(2.0) * self.lifetime

    def quantities(self, t: Array) -> Quantities:
        broken = np.exp(np.log(t) + self.log_rate)
        return {"phi": self.phi_i * np.exp(-broken), "ln_phi": math.log(self.phi_i) - broken}


class BellRamp(BellBond):
    r"""Bonds under the force :math:`f=rt` that do not form again, and the statistics of the force at which they break.

    .. math:: \frac\phi{\phi_i}=\exp\{-b\,(e^{f/f_\beta}-1)\},\qquad f_\beta=\frac{k_BT}{x_{off}},\quad
        b=\frac{k_{off}f_\beta}r,\\
        f_{mode}=f_\beta\max\Big(\ln\frac1b,0\Big),\quad f_{mean}=f_\beta e^bE_1(b),\quad
        f_{median}=f_\beta\ln\Big(1+\frac{\ln2}b\Big)

    Any loading rate; :math:`\ln\phi` is exact even if :math:`\phi` underflows to zero.

    Source: Evans & Ritchie (1997), Biophys. J. 72, 1541-1555, doi 10.1016/S0006-3495(97)78802-7; the mean is the
    integral of their distribution, Abramowitz & Stegun (1964), 5.1.1.

    >>> bond = BellRamp(k_off=0.1, x_off=4e-10, T=300.0, rate=1e-10)
    >>> " ".join(f"{1e12 * force:.6f} pN" for force in (bond.mode, bond.mean, bond.median))
    '47.324836 pN 41.886280 pN 43.683190 pN'
    """

    rate: float = parameter("N/s", "loading rate", above=0)

    readings = read(ramp="rate=f")
    statistics = ("mode", "median", "mean")

    @property
    def severity(self) -> float:
        """Rupture rate without force, times the time in which the force grows by the force scale: b."""
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
        """Return the logarithm of the probability density [1/N] of rupture at the force f."""
        scaled = f / self.force_scale
        return math.log(self.k_off / self.rate) + scaled - self.severity * np.expm1(scaled)

    def quantities(self, t: Array) -> Quantities:
        f = self.rate * t
        broken = self.severity * np.expm1(f / self.force_scale)
        return {"phi": self.phi_i * np.exp(-broken), "ln_phi": math.log(self.phi_i) - broken, "f": f}
