"""Bonding in perfect thermal contact: the general solution, and the exothermic and endothermic ones of the paper."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from fractions import Fraction
from typing import ClassVar

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.errors import InputError
from surfacechem.references._bodies import EnergyModel, PerfectContact, QuadraticEnergy
from surfacechem.references.base import Array, Parameters, SceneView


class RelaxingBonds(PerfectContact):
    r"""Bond energy :math:`\frac12K(T)x`, :math:`x=(1-\phi)^2`, whose :math:`x` decays as :math:`e^{-2t/\tau}`.

    Everything is written with :math:`y=x_0-x\ge0`, which is known to rounding however small t is. A subclass states the
    temperature and the total capacity; fluxes, energy and entropies follow.
    """

    model: ClassVar[EnergyModel]

    T_i: float = parameter("K", "initial temperature", above=0)
    phi_i: float = parameter("1", "initial bonding state", default=0.0, at_least=0, at_most=1)
    K_0: float = parameter("J/m^2", "temperature-independent part of the bond energy density", default=0.0)
    K_1: float = parameter("J/m^2", "linear (entropic) part of the bond energy density", default=0.0)
    K_2: float = parameter("J/m^2", "quadratic part of the bond energy density", default=0.0)
    tau: float = parameter("s", "relaxation time of bonding", above=0)
    D: float = parameter("W/m^2", "friction power, traction times sliding velocity", default=0.0, at_least=0)

    @classmethod
    def from_scene(cls, scene: SceneView) -> Parameters:
        bonds = {name: scene.potential(name) for name in ("K_0", "K_1", "K_2")}
        start = {"T_i": scene.temperature, "phi_i": scene.initial("phi"), "tau": scene.relaxation_time}
        return {**super().from_scene(scene), **bonds, **start, "D": scene.friction_power()}

    def __post_init__(self) -> None:
        """Refuse what has no positive heat capacity to begin with."""
        super().__post_init__()
        if self.free_capacity <= 0.0:
            raise InputError(
                f"{self.name}: the total heat capacity must be positive, but K_2 (1 - phi_i)^2 takes away "
                f"{1.0 - self.free_capacity:.17g} of it. Lower K_2 or raise phi_i."
            )

    @property
    def free_capacity(self) -> float:
        """Share of the initial capacity that the unformed bonds leave, from exact arithmetic (it may be 2^-52)."""
        return float(1 - Fraction(self.K_2) * (1 - Fraction(self.phi_i)) ** 2 / self._bond_capacity_scale)

    @property
    @abstractmethod
    def _bond_capacity_scale(self) -> Fraction:
        """The value of K_2 x at which the initial capacity vanishes."""

    @abstractmethod
    def temperature(self, t: Array) -> tuple[Array, Array]:
        """Temperature and its rise above the initial one."""

    @abstractmethod
    def heating_share(self, T: Array, t: Array) -> Array:
        """Heating of a body over total heat set free, per capacity of that body."""

    def unbonded_squared(self, t: Array) -> tuple[Array, Array]:
        """The square x of the unbonded fraction, and how much of it is gone."""
        initial = (1.0 - self.phi_i) ** 2
        return initial * np.exp(-2.0 * t / self.tau), -initial * np.expm1(-2.0 * t / self.tau)

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        x, _ = self.unbonded_squared(t)
        T, rise = self.temperature(t)
        excess, relative = self.T_i - self.T_0 + rise, T / self.T_0
        bond_energy = self.K_0 - self.K_2 * relative**2
        share = self.heating_share(T, t) * (x / self.tau * bond_energy + self.D)
        bond_entropy = -0.5 * x * (self.K_1 + 2.0 * self.K_2 * relative) / self.T_0
        stiffness = self.K_0 + self.K_1 * relative + self.K_2 * relative**2
        return {
            "phi": self.phi_i - (1.0 - self.phi_i) * np.expm1(-t / self.tau),
            "T": T,
            "q_1": self.C_1 * share,
            "q_2": self.C_2 * share,
            "U_c": self.model.energy(excess, self.C_c, self.T_0) + 0.5 * x * bond_energy,
            "S_total": self.model.entropy(excess, self.C, self.T_0) + bond_entropy,
            "sigma_chem": x * stiffness / (self.tau * T),
        }


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


class ExothermicBonding(PerfectContact):
    r"""Bonding that sets a constant energy free, perfect thermal contact, quadratic energies.

    .. math:: \phi=1-e^{-t/\tau},\quad T=T_0\sqrt{1+\kappa(1-e^{-2t/\tau})},\quad
        q_k=\frac{C_k}{C}\frac{K_0}\tau e^{-2t/\tau},\quad \kappa=\frac{K_0}{T_0C}

    From :math:`\phi=0` and :math:`T=T_0`; any t >= 0, K_0 >= 0. Ends at :math:`T_0\sqrt{1+\kappa}`.

    Source: Sauer, Duong & Mandadapu (2021), section 6.2.1, there for equal bodies and C_c = 0.

    >>> f"{ExothermicBonding(C_1=1.0, C_2=1.0, T_0=300.0, K_0=60.0, tau=0.5).solution(2.5)['T']:.12f}"
    '314.642005143357'
    """

    name: ClassVar[str] = "exothermic-bonding"

    K_0: float = parameter("J/m^2", "bond energy density", at_least=0)
    tau: float = parameter("s", "relaxation time of bonding", above=0)

    @classmethod
    def from_scene(cls, scene: SceneView) -> Parameters:
        return {**super().from_scene(scene), "K_0": scene.potential("K_0"), "tau": scene.relaxation_time}

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        kappa = self.K_0 / (self.T_0 * self.C)
        released = self.K_0 / self.tau * np.exp(-2.0 * t / self.tau)
        return {
            "phi": -np.expm1(-t / self.tau),
            "T": self.T_0 * np.sqrt(1.0 - kappa * np.expm1(-2.0 * t / self.tau)),
            "q_1": self.C_1 / self.C * released,
            "q_2": self.C_2 / self.C * released,
        }


class EndothermicBonding(PerfectContact):
    r"""Bonding with a bond energy that grows as :math:`T^2`, perfect thermal contact, quadratic energies.

    .. math:: \phi=1-e^{-t/\tau},\quad T=T_0\sqrt{\frac{1-\kappa}{1-\kappa e^{-2t/\tau}}},\quad
        q_k=-\frac{C_k}{C}\frac{K_2}\tau\frac{(1-\kappa)e^{-2t/\tau}}{(1-\kappa e^{-2t/\tau})^2},\quad
        \kappa=\frac{K_2}{T_0C}<1

    From :math:`\phi=0` and :math:`T=T_0`. Ends at :math:`T_0\sqrt{1-\kappa}` after an initial layer as short as
    :math:`\tau(1-\kappa)/2`; accurate for :math:`1-\kappa` down to rounding.

    Source: Sauer, Duong & Mandadapu (2021), section 6.2.2, there for equal bodies and C_c = 0.

    >>> nearly_one = EndothermicBonding(C_1=1.0, C_2=1.0, T_0=256.0, K_2=512.0 * (1.0 - 2.0**-40), tau=1.0)
    >>> f"{nearly_one.solution(1e-12)['T']:.12f}"
    '143.130196231040'
    """

    name: ClassVar[str] = "endothermic-bonding"

    K_2: float = parameter("J/m^2", "bond energy density at T_0", at_least=0)
    tau: float = parameter("s", "relaxation time of bonding", above=0)

    @classmethod
    def from_scene(cls, scene: SceneView) -> Parameters:
        return {**super().from_scene(scene), "K_2": scene.potential("K_2"), "tau": scene.relaxation_time}

    def __post_init__(self) -> None:
        """Refuse what has no positive heat capacity to begin with."""
        super().__post_init__()
        if self.free_capacity <= 0.0:
            raise InputError(f"{self.name}: K_2 must be below T_0 (C_1 + C_2 + C_c), the capacity it takes away.")

    @property
    def free_capacity(self) -> float:
        r""":math:`1-\kappa` from exact arithmetic."""
        return float(1 - Fraction(self.K_2) / (Fraction(self.T_0) * self._exact_C))

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        kappa = self.K_2 / (self.T_0 * self.C)
        ratio = self.free_capacity / (self.free_capacity - kappa * np.expm1(-2.0 * t / self.tau))
        absorbed = self.K_2 / self.tau * np.exp(-2.0 * t / self.tau) * ratio**2 / self.free_capacity
        return {
            "phi": -np.expm1(-t / self.tau),
            "T": self.T_0 * np.sqrt(ratio),
            "q_1": -self.C_1 / self.C * absorbed,
            "q_2": -self.C_2 / self.C * absorbed,
        }
