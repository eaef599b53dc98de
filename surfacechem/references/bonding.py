"""Bonding: relaxation with its heat, between unequal surfaces, and ignited by friction."""

from __future__ import annotations

import math
from dataclasses import fields
from fractions import Fraction
from typing import ClassVar

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.errors import InputError
from surfacechem.quantities import GAS_CONSTANT
from surfacechem.references._bodies import PerfectContact, QuadraticEnergy
from surfacechem.references._numerics import first_difference, scaled_expint, short_integral
from surfacechem.references.base import Array, Parameters, Quantities, Reference, SceneView, read


class Bonding(PerfectContact):
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
    entropy but has no effect on the temperature; :math:`K_0<0<K_1` is an endothermic reaction driven by entropy.
    Valid while :math:`\kappa_2x_0<1` and the energy is sufficient for T > 0; accurate for :math:`1-\kappa_2x_0` down to
    rounding and for any ratio of t to tau.

    Source: Sauer, Duong & Mandadapu (2021), sections 6.1 and 6.2, generalised to unequal bodies, an interface capacity,
    K(T) quadratic in T, and bonding while sliding.

    >>> potential = {"K_0": 120.0, "K_1": 60.0, "K_2": 240.0}
    >>> bonds = Bonding(C_1=1.5, C_2=0.7, C_c=0.3, T_0=300.0, T_i=320.0, phi_i=0.1, tau=2.0, **potential)
    >>> f"{bonds.solution(10.0)['T']:.12f}"
    '295.841884102745'
    """

    model: ClassVar[QuadraticEnergy] = QuadraticEnergy()

    T_i: float = parameter("K", "initial temperature", above=0)
    phi_i: float = parameter("1", "initial bonding state", default=0.0, at_least=0, at_most=1)
    K_0: float = parameter("J/m^2", "temperature-independent part of the bond energy density", default=0.0)
    K_1: float = parameter("J/m^2", "linear (entropic) part of the bond energy density", default=0.0)
    K_2: float = parameter("J/m^2", "quadratic part of the bond energy density", default=0.0)
    tau: float = parameter("s", "relaxation time of bonding", above=0)
    D: float = parameter("W/m^2", "friction power, traction times sliding velocity", default=0.0, at_least=0)

    readings = read(
        potential="K_0 K_1 K_2", initial="phi_i=phi", temperature="T_i", relaxation_time="tau", friction_power="D"
    )

    def __post_init__(self) -> None:
        """Refuse parameters without a positive initial heat capacity."""
        super().__post_init__()
        if self.free_capacity <= 0.0:
            raise InputError(
                f"{self.name}: the total heat capacity must be positive, but K_2 (1 - phi_i)^2 takes away "
                f"{1.0 - self.free_capacity:.17g} of it. Lower K_2 or raise phi_i."
            )

    @property
    def free_capacity(self) -> float:
        r"""Fraction of the initial capacity that the unformed bonds leave, :math:`1-\kappa_2x_0`.

        It may be 2^-52, so it is computed in exact arithmetic.
        """
        taken = Fraction(self.K_2) * (1 - Fraction(self.phi_i)) ** 2
        return float(1 - taken / (Fraction(self.T_0) * self.exact_capacity))

    def unbonded_squared(self, t: Array) -> tuple[Array, Array]:
        """Return the square x of the unbonded fraction, and its decrease, accurate to rounding at any time."""
        initial = (1.0 - self.phi_i) ** 2
        return initial * np.exp(-2.0 * t / self.tau), -initial * np.expm1(-2.0 * t / self.tau)

    def heated(self, t: Array) -> tuple[Array, Array, Array]:
        """Return temperature, its rise above the initial one, and the capacity over which released heat is shared."""
        x, gone = self.unbonded_squared(t)
        kappa_0, kappa_2 = (K / (self.T_0 * self.C) for K in (self.K_0, self.K_2))
        # 1 - kappa_2 x as a sum of positive numbers
        factor = self.free_capacity + kappa_2 * gone if kappa_2 > 0.0 else 1.0 - kappa_2 * x
        released = self.T_0**2 * kappa_0 * gone + 2.0 * self.T_0 * self.D * t / self.C
        T = np.sqrt((self.T_i**2 * self.free_capacity + released) / factor)
        return T, (released - self.T_i**2 * kappa_2 * gone) / factor / (T + self.T_i), self.C * factor

    def quantities(self, t: Array) -> Quantities:
        x, _ = self.unbonded_squared(t)
        T, rise, capacity = self.heated(t)
        excess, relative = self.T_i - self.T_0 + rise, T / self.T_0
        bond_energy = self.K_0 - self.K_2 * relative**2
        share = (x / self.tau * bond_energy + self.D) / capacity
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


class ExothermicBonding(PerfectContact):
    r"""Bonding that releases a constant energy, perfect thermal contact, quadratic energies.

    .. math:: \phi=1-e^{-t/\tau},\quad T=T_0\sqrt{1+\kappa(1-e^{-2t/\tau})},\quad
        q_k=\frac{C_k}{C}\frac{K_0}\tau e^{-2t/\tau},\quad \kappa=\frac{K_0}{T_0C}

    From :math:`\phi=0` and :math:`T=T_0`; any t >= 0, K_0 >= 0. Ends at :math:`T_0\sqrt{1+\kappa}`.

    Source: Sauer, Duong & Mandadapu (2021), section 6.2.1, there for equal bodies and C_c = 0.

    >>> f"{ExothermicBonding(C_1=1.0, C_2=1.0, T_0=300.0, K_0=60.0, tau=0.5).solution(2.5)['T']:.12f}"
    '314.642005143357'
    """

    K_0: float = parameter("J/m^2", "bond energy density", at_least=0)
    tau: float = parameter("s", "relaxation time of bonding", above=0)

    readings = read(potential="K_0", relaxation_time="tau")

    def quantities(self, t: Array) -> Quantities:
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

    K_2: float = parameter("J/m^2", "bond energy density at T_0", at_least=0)
    tau: float = parameter("s", "relaxation time of bonding", above=0)

    readings = read(potential="K_2", relaxation_time="tau")

    def __post_init__(self) -> None:
        """Refuse parameters without a positive initial heat capacity."""
        super().__post_init__()
        if Fraction(self.K_2) >= Fraction(self.T_0) * self.exact_capacity:
            raise InputError(f"{self.name}: K_2 must be below T_0 (C_1 + C_2 + C_c), the capacity it takes away.")

    def quantities(self, t: Array) -> Quantities:
        given = {item.name: getattr(self, item.name) for item in fields(self)}
        every = Bonding(**given, T_i=self.T_0).quantities(t)
        return {name: every[name] for name in ("phi", "T", "q_1", "q_2")}


class BimolecularBonding(Reference):
    r"""Bonds between sites of both surfaces that form in pairs and break, constant temperature.

    .. math:: \dot\phi=k_fn_c\Big(\frac{n_1}{n_c}-\phi\Big)\Big(\frac{n_2}{n_c}-\phi\Big)-k_r\phi,\qquad
        \frac{\phi-\phi_{eq}}{\phi-\phi_2}=\frac{\phi_i-\phi_{eq}}{\phi_i-\phi_2}e^{-k_fn_c(\phi_2-\phi_{eq})t}

    :math:`\phi_{eq}<\phi_2` are the zeros of the rate. Zeros and solution are evaluated without cancellation, also if
    they coincide: equal densities and no rupture, :math:`1-\phi=1/(1+k_fn_ct)`. Any t >= 0.

    Source: second-order kinetics with reversal, integrated; e.g. Lauffenburger & Linderman (1993), Receptors.

    >>> sites = BimolecularBonding(k_f=1e-16, k_r=0.5, n_1=1e16, n_2=2e16, n_c=1e16)
    >>> f"{sites.equilibrium:.10f} {sites.solution(1.0)['phi']:.10f}"
    '0.7192235936 0.6490609274'
    """

    k_f: float = parameter("m^2/s", "rate coefficient of formation", above=0)
    k_r: float = parameter("1/s", "rate of rupture", default=0.0, at_least=0)
    n_1: float = parameter("1/m^2", "density of sites on body 1", above=0)
    n_2: float = parameter("1/m^2", "density of sites on body 2", above=0)
    n_c: float = parameter("1/m^2", "density of reference sites", above=0)
    phi_i: float = parameter("1", "initial bonding state", default=0.0, at_least=0)

    readings = read(reaction="k_f k_r", initial="phi_i=phi")

    @classmethod
    def from_scene(cls, scene: SceneView) -> Parameters:
        N_c, N_1, N_2 = (scene.constant(name) for name in ("N_c", "N_1", "N_2"))
        sites = {"n_c": N_c, "n_1": N_c if N_1 is None else N_1, "n_2": N_c if N_2 is None else N_2}
        return {**super().from_scene(scene), **sites}

    @property
    def equilibrium(self) -> float:
        """Bonding state in equilibrium, the smaller zero of the rate."""
        p, q, loss, distance = self._scaled()
        return 2.0 * p * q / (p + q + loss + distance)

    def _scaled(self) -> tuple[float, float, float, float]:
        """Return both densities and the rupture rate in units of the reference sites, and the distance of the zeros."""
        p, q, loss = self.n_1 / self.n_c, self.n_2 / self.n_c, self.k_r / (self.k_f * self.n_c)
        return p, q, loss, math.sqrt((p - q) ** 2 + loss * (loss + 2.0 * (p + q)))

    def quantities(self, t: Array) -> Quantities:
        start, scaled, distance = self.equilibrium - self.phi_i, self.k_f * self.n_c * t, self._scaled()[-1]
        mean = first_difference(np.zeros_like(scaled), -distance * scaled)  # (1 - exp(-x)) / x
        gone = mean * (start * scaled + distance * scaled) / (1.0 + start * scaled * mean)
        return {"phi": self.phi_i + start * gone}


class FrictionIgnitedBonding(Reference):
    r"""First-order Arrhenius bonding without heat of reaction while friction heats a constant capacity.

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

    A: float = parameter("1/s", "pre-exponential factor", above=0)
    E_a: float = parameter("J/mol", "activation energy", above=0)
    T_i: float = parameter("K", "initial temperature", above=0)
    C: float = parameter("J/(m^2 K)", "total heat capacity", above=0)
    D: float = parameter("W/m^2", "friction power", above=0)
    phi_i: float = parameter("1", "initial bonding state", default=0.0, at_least=0, at_most=1)

    readings = read(reaction="A E_a", initial="phi_i=phi", temperature="T_i", capacity="C", friction_power="D")

    def quantities(self, t: Array) -> Quantities:
        heating, T_E = self.D / self.C, self.E_a / GAS_CONSTANT
        rise = heating * t
        T = self.T_i + rise

        def antiderivative(T: Array | float) -> Array:
            s = np.asarray(T_E / T)
            return np.asarray(T * np.exp(-s) * scaled_expint(2, s))

        apart = self.A / heating * (antiderivative(T) - antiderivative(self.T_i))
        exponent = T_E / self.T_i * rise / T
        early = (exponent < 0.5) & (rise < 0.5 * self.T_i)  # the difference would cancel
        soon = short_integral(lambda t: self.A * np.exp(-T_E / (self.T_i + heating * t)), t)
        reacted = np.where(early, soon, apart)
        return {
            "phi": self.phi_i - (1.0 - self.phi_i) * np.expm1(-reacted),
            "T": T,
            "ln_unbonded": np.log1p(-self.phi_i) - reacted,
        }
