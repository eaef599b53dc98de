"""Reactions of an interface: bonding with its heat, springs in equilibrium, rates by affinity, runaway, and cure."""

from __future__ import annotations

import math
from fractions import Fraction
from functools import cached_property, lru_cache
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from surfacechem.contracts.terms import parameter
from surfacechem.quantities import BOLTZMANN, GAS_CONSTANT
from surfacechem.references.base import (
    Array,
    Parameters,
    PerfectContact,
    QuadraticEnergy,
    Quantities,
    Reference,
    SceneView,
    read,
)
from surfacechem.references.numerics import (
    AutonomousODE,
    first_difference,
    increasing_root,
    scaled_Ei,
    scaled_expint,
    short_integral,
)


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

    def flaw(self) -> str:
        if self.free_capacity > 0.0:
            return ""
        text = "the total heat capacity must be positive, but K_2 (1 - phi_i)^2 takes away"
        return f"{text} {1.0 - self.free_capacity:.17g} of it. Lower K_2 or raise phi_i."

    @cached_property
    def free_capacity(self) -> float:
        r"""Fraction of the initial capacity that the unformed bonds leave, :math:`1-\kappa_2x_0`.

        It may be 2^-52, so it is computed in exact arithmetic.
        """
        taken = Fraction(self.K_2) * (1 - Fraction(self.phi_i)) ** 2
        return float(1 - taken / (Fraction(self.T_0) * self.exact_capacity))

    def heated(self, t: Array) -> tuple[Array, Array, Array, Array]:
        """Return the square x of the unbonded fraction, temperature, its rise above the initial one, and the capacity
        over which released heat is shared.
        """
        # The square and its decrease are accurate to rounding at any time.
        initial = (1.0 - self.phi_i) ** 2
        x, gone = initial * np.exp(-2.0 * t / self.tau), -initial * np.expm1(-2.0 * t / self.tau)
        kappa_0, kappa_2 = (K / (self.T_0 * self.C) for K in (self.K_0, self.K_2))
        # 1 - kappa_2 x as a sum of positive numbers
        factor = self.free_capacity + kappa_2 * gone if kappa_2 > 0.0 else 1.0 - kappa_2 * x
        released = self.T_0**2 * kappa_0 * gone + 2.0 * self.T_0 * self.D * t / self.C
        T = np.sqrt((self.T_i**2 * self.free_capacity + released) / factor)
        return x, T, (released - self.T_i**2 * kappa_2 * gone) / factor / (T + self.T_i), self.C * factor

    def exchanged(self, t: Array, x: Array, T: Array, capacity: Array) -> dict[str, Array]:
        """Return bonding state, temperature and heat into the bodies, from what :meth:`heated` returns."""
        share = (x / self.tau * (self.K_0 - self.K_2 * (T / self.T_0) ** 2) + self.D) / capacity
        phi = self.phi_i - (1.0 - self.phi_i) * np.expm1(-t / self.tau)
        return {"phi": phi, "T": T, "q_1": self.C_1 * share, "q_2": self.C_2 * share}

    def quantities(self, t: Array) -> Quantities:
        x, T, rise, capacity = self.heated(t)
        excess, relative = self.T_i - self.T_0 + rise, T / self.T_0
        bond_energy = self.K_0 - self.K_2 * relative**2
        bond_entropy = -0.5 * x * (self.K_1 + 2.0 * self.K_2 * relative) / self.T_0
        stiffness = self.K_0 + self.K_1 * relative + self.K_2 * relative**2
        return {
            **self.exchanged(t, x, T, capacity),
            "U_c": self.model.energy(excess, self.C_c, self.T_0) + 0.5 * x * bond_energy,
            "S_total": self.model.entropy(excess, self.C, self.T_0) + bond_entropy,
            "sigma_chem": x * stiffness / (self.tau * T),
        }


def _from_reference(case: PerfectContact, t: Array) -> Quantities:
    """Return the solution of a case of `Bonding` that starts without bonds at the reference temperature."""
    bonds = _unbonded(case)
    x, T, _, capacity = bonds.heated(t)
    return bonds.exchanged(t, x, T, capacity)


@lru_cache(maxsize=1)  # whatever follows from the parameters is computed once
def _unbonded(case: PerfectContact) -> Bonding:
    """Return the case of `Bonding` that starts without bonds at the reference temperature."""
    return Bonding(**{item.name: getattr(case, item.name) for item in case.parameters}, T_i=case.T_0)


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
        return _from_reference(self, t)


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

    def flaw(self) -> str:
        all_taken = Fraction(self.K_2) >= Fraction(self.T_0) * self.exact_capacity
        return "K_2 must be below T_0 (C_1 + C_2 + C_c), the capacity it takes away." if all_taken else ""

    def quantities(self, t: Array) -> Quantities:
        return _from_reference(self, t)


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


class LatticeGasSprings(Reference):
    r"""Ideal mixture of free sites and springs at a held gap, with rates that obey detailed balance.

    .. math:: \phi=\phi_{eq}+(\phi_i-\phi_{eq})e^{-(k_f+k_r)t},\qquad
        \frac{k_r}{k_f}=e^{(k_bg_n^2/2-\varepsilon)/k_BT}=\frac{1-\phi_{eq}}{\phi_{eq}},\qquad t_n=n_ck_bg_n\phi

    Any bond energy: no exponential overflows.

    Source: Hill (1960), An Introduction to Statistical Thermodynamics, ch. 7, with the elastic energy of Dembo et al.
    (1988), Proc. R. Soc. Lond. B 234, 55-83, doi 10.1098/rspb.1988.0038.

    >>> film = LatticeGasSprings(n_c=1e16, epsilon=6e-20, k_b=1e-3, T=300.0, g_n=1e-8, k_i=2.0)
    >>> f"{float(film.equilibrium(film.g_n)):.9f} {film.solution(0.5)['t_n']:.6f} Pa"
    '0.917913042 60911.890061 Pa'
    """

    n_c: float = parameter("1/m^2", "density of bonding sites", above=0)
    epsilon: float = parameter("J", "energy released per bond")
    k_b: float = parameter("N/m", "stiffness of a bond", above=0)
    T: float = parameter("K", "temperature", above=0)
    g_n: float = parameter("m", "gap", default=0.0, at_least=0)
    k_i: float = parameter("1/s", "initial rate of phi over the initial free fraction", default=0.0)
    phi_i: float = parameter("1", "initial bonding state", default=0.0, at_least=0, at_most=1)

    readings = read(potential="epsilon k_b", constant="n_c=N_c", temperature="T", initial="g_n phi_i=phi")

    @classmethod
    def from_scene(cls, scene: SceneView) -> Parameters:
        values, rate = super().from_scene(scene), scene.bonding_rate
        phi = values["phi_i"]
        return {**values, "k_i": None if phi is None or rate is None or phi == 1.0 else rate / (1.0 - phi)}

    def equilibrium(self, gap: ArrayLike) -> Array:
        """Return the bonding state in equilibrium at a gap [m]."""
        exponent = (0.5 * self.k_b * np.asarray(gap) ** 2 - self.epsilon) / (BOLTZMANN * self.T)
        return np.asarray(np.exp(-np.logaddexp(0.0, exponent)))

    def quantities(self, t: Array) -> Quantities:
        distance = float(self.equilibrium(self.g_n)) - self.phi_i
        relaxation = self.k_i * (1.0 - self.phi_i) / distance if distance else 0.0  # k_f + k_r
        phi = self.phi_i - distance * np.expm1(-relaxation * t)
        return {"phi": phi, "t_n": self.n_c * self.k_b * self.g_n * phi}


class LinearAffinitySolution(Reference):
    r"""Two-way bonding whose rate is linear in the affinity, constant temperature.

    .. math:: \phi=\phi_{eq}+(\phi_i-\phi_{eq})e^{-\lambda t},\quad \lambda=\frac{c_rK_c}{n_c},\quad
        R_f=n_ck_f(1-\phi),\quad R_b=n_ck_b\phi,\quad R_c=R_f-R_b=n_c\dot\phi

    with :math:`k_f=\lambda\phi_{eq}`, :math:`k_b=\lambda(1-\phi_{eq})`. Any t >= 0.

    Source: Sauer, Duong & Mandadapu (2021), section 5.7 (bonding reactions), linear law, integrated.

    >>> sites = LinearAffinitySolution(n_c=1e18, c_r=4e18, K_c=0.275, phi_eq=0.2 / 0.275, phi_i=0.05)
    >>> f"{sites.solution(0.06043817678166709)['phi']:.12f}"
    '0.093562342248'
    """

    n_c: float = parameter("1/m^2", "density of bonding sites", above=0)
    c_r: float = parameter("1/(J s)", "rate constant per bond", at_least=0)
    K_c: float = parameter("J/m^2", "bond energy density", at_least=0)
    phi_eq: float = parameter("1", "equilibrium bonding state", at_least=0, at_most=1)
    phi_i: float = parameter("1", "initial bonding state", default=0.0, at_least=0, at_most=1)

    readings = read(constant="n_c=N_c", reaction="c_r", potential="phi_eq K_c=K_0", initial="phi_i=phi")

    def quantities(self, t: Array) -> Quantities:
        relaxation, distance = self.c_r * self.K_c / self.n_c, self.phi_eq - self.phi_i
        phi = self.phi_i - distance * np.expm1(-relaxation * t)
        return {
            "phi": phi,
            "R_forward": self.n_c * relaxation * self.phi_eq * (1.0 - phi),
            "R_backward": self.n_c * relaxation * (1.0 - self.phi_eq) * phi,
            "R_c": self.n_c * relaxation * distance * np.exp(-relaxation * t),
        }


class ExponentialAffinitySolution(Reference):
    r"""Two-way bonding whose rate is exponential in the affinity, constant temperature.

    With the affinity :math:`y=a(\phi_{eq}-\phi)=-\mu_c/(k_BT)`, :math:`a=\frac{K_c}{n_ck_BT}`,
    :math:`\lambda=\frac{C_rK_c}{n_c^2}`

    .. math:: \dot\phi=\frac\lambda a(1-e^{-y}),\qquad e^y-1=(e^{y_i}-1)e^{-\lambda t}

    Evaluated in logarithms, so that :math:`|y|` may be 1e6 and more. Any t >= 0; only the rate at t = 0 is beyond the
    range of doubles (minus infinity) for debonding from :math:`y_i<-745`.

    Source: Sauer, Duong & Mandadapu (2021), section 5.7 (bonding reactions), exponential law with the Boltzmann
    constant, integrated.

    >>> sites = ExponentialAffinitySolution(n_c=5e17, C_r=2.5e38, K_c=0.05, T=310.0, phi_eq=0.4, phi_i=1.0)
    >>> f"{sites.solution(1.20603953943341209e-9)['phi']:.12f}"
    '0.996949093794'
    """

    n_c: float = parameter("1/m^2", "density of bonding sites", above=0)
    C_r: float = parameter("1/(J s m^2)", "rate constant per area", at_least=0)
    K_c: float = parameter("J/m^2", "bond energy density", above=0)
    T: float = parameter("K", "temperature", above=0)
    phi_eq: float = parameter("1", "equilibrium bonding state", default=1.0)
    phi_i: float = parameter("1", "initial bonding state", default=0.0, at_least=0, at_most=1)

    readings = read(
        constant="n_c=N_c", reaction="C_r", potential="phi_eq K_c=K_0", initial="phi_i=phi", temperature="T"
    )

    def quantities(self, t: Array) -> Quantities:
        steepness = self.K_c / (self.n_c * BOLTZMANN * self.T)  # affinity in k_B T per distance of phi from equilibrium
        relaxation = self.C_r * self.K_c / self.n_c**2  # decay rate close to equilibrium
        initial = steepness * (self.phi_eq - self.phi_i)
        spent, left, thrust = (_bonding if initial >= 0.0 else _debonding)(initial, relaxation * t)
        from_start, to_equilibrium = self.phi_i + spent / steepness, self.phi_eq - left / steepness
        return {
            "phi": np.where(np.abs(left) < np.abs(spent), to_equilibrium, from_start),
            "phi_dot": relaxation / steepness * thrust,
        }


def _bonding(y_i: float, decay: Array) -> tuple[Array, Array, Array]:
    r"""Return the affinity spent :math:`y_i-y`, the affinity left y, and :math:`1-e^{-y}`, for :math:`y_i\ge0`."""
    log_gone = np.log(-np.expm1(-decay))
    product = np.expm1(-y_i) * np.expm1(-decay)
    spent = np.where(product < 0.5, -np.log1p(-product), -np.logaddexp(-decay, log_gone - y_i))
    log_excess = y_i + np.log(-np.expm1(-y_i)) - decay  # ln(e^y - 1)
    return spent, np.logaddexp(0.0, log_excess), np.exp(-np.logaddexp(0.0, -log_excess))


def _debonding(y_i: float, decay: Array) -> tuple[Array, Array, Array]:
    r"""Return the affinity spent :math:`y_i-y`, the affinity left y, and :math:`1-e^{-y}`, for :math:`y_i<0`."""
    gone, excess = -np.expm1(-decay), np.expm1(y_i) * np.exp(-decay)  # excess = e^y - 1
    power = gone + np.exp(y_i - decay)  # e^y as a sum of positive numbers
    log_factor = -y_i + np.log(-np.expm1(y_i))  # ln(e^-y_i - 1)
    spent = -np.where(
        log_factor < 30.0, np.log1p(np.expm1(min(-y_i, 100.0)) * gone), np.logaddexp(0.0, log_factor + np.log(gone))
    )
    return spent, np.where(excess > -0.5, np.log1p(excess), np.log(power)), excess / power


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

    @cached_property
    def _at_start(self) -> float:
        s_i = self._initial_exponent
        left, whole = scaled_Ei(np.array([s_i * self.delta_T / (self.T_i + self.delta_T), s_i])).tolist()
        return float(left - whole)

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
        now = scaled_Ei(s_i * self.T_i / T * left / final) - scaled_Ei(s_i * self.T_i / T)
        early = unreacted * max(1.0, self.delta_T / self.T_i * max(1.0, s_i)) < 0.25  # the integrals would cancel
        steepness = slope(unreacted)
        return np.where(early, short_integral(slope, unreacted), self._at_start - steepness * now), steepness


class KamalCureConstantCapacity(Reference):
    r"""Adiabatic autocatalytic cure, constant capacities.

    .. math:: \dot\phi=\Big(A_1e^{-E_1/R_gT}+A_2e^{-E_2/R_gT}\phi^m\Big)(1-\phi)^n,\qquad
        T=T_i+\Delta T\,(\phi-\phi_i)

    The time :math:`t=\int d\phi/\dot\phi(\phi,T(\phi))` is a sum of Gauss panels that shrink towards both ends, and is
    inverted to rounding. A ΔT of zero is isothermal cure. :math:`n\ge1`; any t >= 0.

    Source: Kamal & Sourour (1973), Polym. Eng. Sci. 13, 59-64, doi 10.1002/pen.760130110, integrated.

    >>> layer = KamalCureConstantCapacity(A_1=4e5, E_1=7e4, A_2=2e6, E_2=6e4, m=0.5, n=1.5, T_i=360.0, delta_T=120.0)
    >>> f"{layer.solution(190.424045193457)['phi']:.10f}"
    '0.5000000000'
    """

    A_1: float = parameter("1/s", "pre-exponential factor of the uncatalysed reaction", at_least=0)
    E_1: float = parameter("J/mol", "activation energy of the uncatalysed reaction", default=0.0, at_least=0)
    A_2: float = parameter("1/s", "pre-exponential factor of the autocatalytic reaction", at_least=0)
    E_2: float = parameter("J/mol", "activation energy of the autocatalytic reaction", default=0.0, at_least=0)
    m: float = parameter("1", "order of the autocatalysis", default=1.0, above=0)
    n: float = parameter("1", "order of the reaction", default=1.0, at_least=1)
    T_i: float = parameter("K", "initial temperature", above=0)
    delta_T: float = parameter("K", "heat of reaction over the heat capacity at T_0", default=0.0, at_least=0)
    phi_i: float = parameter("1", "initial degree of cure", default=0.0, at_least=0, at_most=1)

    readings = read(reaction="A_1 E_1 A_2 E_2 m n", initial="phi_i=phi", temperature="T_i", adiabatic_rise="delta_T")

    def flaw(self) -> str:
        starts = self.A_1 > 0.0 or (self.phi_i > 0.0 and self.A_2 > 0.0)
        return "" if starts else "nothing starts the reaction; A_1 or phi_i and A_2 must be above zero."

    def rate(self, cured: Array, left: Array) -> Array:
        """Return the rate of phi [1/s] when phi has grown by ``cured`` and is below one by ``left``."""
        RT = GAS_CONSTANT * (self.T_i + self.delta_T * cured)
        k_1, k_2 = self.A_1 * np.exp(-self.E_1 / RT), self.A_2 * np.exp(-self.E_2 / RT)
        return np.asarray((k_1 + k_2 * (self.phi_i + cured) ** self.m) * left**self.n)

    @cached_property
    def _path(self) -> AutonomousODE:
        return AutonomousODE(self.rate, 1.0 - self.phi_i)

    def quantities(self, t: Array) -> Quantities:
        if self.phi_i == 1.0:
            return {"phi": 1.0, "unreacted": 0.0, "T": self.T_i, "phi_dot": 0.0}
        cured, left = self._path.position(t)
        phi = np.where(left < 0.5, 1.0 - left, self.phi_i + cured)
        return {"phi": phi, "unreacted": left, "T": self.T_i + self.delta_T * cured, "phi_dot": self.rate(cured, left)}
