"""Bonding and sliding together, quadratic energies."""

from __future__ import annotations

from fractions import Fraction
from typing import ClassVar

import numpy as np

from surfacechem.references._bonding import RelaxingBonds
from surfacechem.references._energy import EnergyModel, QuadraticEnergy
from surfacechem.references.base import Array


class Bonding(RelaxingBonds):
    r"""Bonding with a constant relaxation time and friction power, perfect thermal contact, quadratic energies.

    With :math:`K=K_0+K_1T/T_0+K_2T^2/T_0^2`, :math:`x=(1-\phi)^2`, :math:`C=C_1+C_2+C_c`, :math:`\kappa_j=K_j/(T_0C)`

    .. math::
        \phi=1-(1-\phi_i)e^{-t/\tau},\qquad
        T^2=\frac{T_i^2(1-\kappa_2x_0)+T_0^2\kappa_0(x_0-x)+2T_0Dt/C}{1-\kappa_2x},\\
        q_k=\frac{C_k}{C}\,\frac{\frac x\tau(K_0-K_2T^2/T_0^2)+D}{1-\kappa_2x},\qquad
        U_c=\frac{C_c}{2T_0}(T^2-T_0^2)+\frac x2(K_0-K_2T^2/T_0^2),\\
        S=C\Big(\frac T{T_0}-1\Big)-\frac x2\Big(\frac{K_1}{T_0}+\frac{2K_2T}{T_0^2}\Big),\qquad
        \sigma_{chem}=\frac{xK}{\tau T}

    The kinetics are linear in the affinity with :math:`c_r=n_c/(\tau K(T))`. K_1 drives the reaction and produces
    entropy but leaves the temperature alone; :math:`K_0<0<K_1` is an endothermic reaction driven by entropy.
    Valid while :math:`\kappa_2x_0<1` and the energy suffices for T > 0; accurate for :math:`1-\kappa_2x_0` down to
    rounding and for any ratio of t to tau.

    Source: Sauer, Duong & Mandadapu (2021), sections 6.1 and 6.2, generalised to unequal bodies, an interface capacity,
    K(T) quadratic in T, and bonding while sliding.

    >>> potential = {"K_0": 120.0, "K_1": 60.0, "K_2": 240.0}
    >>> bonds = Bonding(C_1=1.5, C_2=0.7, C_c=0.3, T_0=300.0, T_i=320.0, phi_i=0.1, tau=2.0, **potential)
    >>> f"{bonds.solution(10.0)['T']:.12f}"
    '295.841884102745'
    """

    name: ClassVar[str] = "bonding"
    model: ClassVar[EnergyModel] = QuadraticEnergy()

    @property
    def _bond_capacity_scale(self) -> Fraction:
        return Fraction(self.T_0) * self._exact_C

    def _kappa(self, K: float) -> float:
        return K / (self.T_0 * self.C)

    def _capacity_factor(self, t: Array) -> Array:
        r""":math:`1-\kappa_2x` as a sum of positive numbers."""
        x, y = self.unbonded_squared(t)
        kappa_2 = self._kappa(self.K_2)
        return self.free_capacity + kappa_2 * y if kappa_2 > 0.0 else 1.0 - kappa_2 * x

    def temperature(self, t: Array) -> tuple[Array, Array]:
        _, y = self.unbonded_squared(t)
        sliding = 2.0 * self.T_0 * self.D * t / self.C
        released = self.T_0**2 * self._kappa(self.K_0) * y + sliding
        factor = self._capacity_factor(t)
        T = np.sqrt((self.T_i**2 * self.free_capacity + released) / factor)
        return T, (released - self.T_i**2 * self._kappa(self.K_2) * y) / factor / (T + self.T_i)

    def heating_share(self, T: Array, t: Array) -> Array:
        return 1.0 / (self.C * self._capacity_factor(t))
