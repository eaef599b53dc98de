"""Exact solutions that only tests compare with, beside those of the package; `get` finds both."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, ClassVar

import numpy as np
from scipy.special import erfc, erfcx, wrightomega

from surfacechem import references
from surfacechem.contracts.terms import parameter
from surfacechem.errors import InputError
from surfacechem.references._bodies import ConstantCapacity, EnergyModel, FrictionallyHeated
from surfacechem.references._inversion import increasing_root
from surfacechem.references.base import Array, Parameters, Reference, SceneView
from surfacechem.references.bonding import Bonding

Y_FOLD = 2.0 ** (1.0 / 3.0)
NODES, WEIGHTS = np.polynomial.legendre.leggauss(80)

REACH = 11.0
"""Thickness in units of the square root of diffusivity and time up to which the far side feels less than 1e-13."""


class Oracle(Reference):
    """An exact solution that no case names."""

    @classmethod
    def from_scene(cls, scene: SceneView) -> Parameters:
        raise InputError(f"{cls.name} is compared with in tests only.")


# -- chemistry and heat ------------------------------------------------------------------------------------------------


class AdiabaticLinearRate(Oracle):
    r"""Adiabatic first-order bonding with a rate proportional to temperature, constant capacity.

    .. math:: \dot\phi=k_i\frac T{T_i}(1-\phi),\quad T=T_i(1+a\phi),\qquad
        \phi=\frac{e^z-1}{e^z+a},\quad z=(1+a)k_it,\quad a=\frac{\Delta T}{T_i}

    From :math:`\phi=0`. Any t >= 0, a > -1 (exothermic or endothermic).

    Source: linear kinetics of Sauer, Duong & Mandadapu (2021), constant capacity, integrated by partial fractions.

    >>> reaction = AdiabaticLinearRate(k_i=0.3, T_i=300.0, delta_T=450.0)
    >>> f"{reaction.solution(9.5)['T']:.10f}"
    '749.0957668630'
    """

    name: ClassVar[str] = "adiabatic-linear-rate"

    k_i: float = parameter("1/s", "rate constant at T_i", at_least=0)
    T_i: float = parameter("K", "initial temperature", above=0)
    delta_T: float = parameter("K", "adiabatic temperature rise of the complete reaction")

    def __post_init__(self) -> None:
        """Refuse a reaction that needs more heat than there is."""
        super().__post_init__()
        if self.delta_T <= -self.T_i:
            raise InputError(f"{self.name}: delta_T must be above -T_i = {-self.T_i:g} K.")

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        final, a = (self.T_i + self.delta_T) / self.T_i, self.delta_T / self.T_i
        exponent = -final * self.k_i * t
        denominator = final + a * np.expm1(exponent) if a < 0.0 else 1.0 + a * np.exp(exponent)
        phi = -np.expm1(exponent) / denominator
        return {"phi": phi, "T": self.T_i + self.delta_T * phi}


class BondingConstantCapacity(Bonding):
    r"""Bonding with a constant relaxation time and friction power, perfect thermal contact, constant capacities.

    As Bonding, but bodies and interface have constant capacities. The energy
    integral :math:`CT-\frac{K_2x}{2T_0^2}T^2+\frac{K_0x}2=\text{const}+Dt` is then a quadratic equation for the rise

    .. math::
        T-T_i=\frac{2e}{b+\sqrt{b^2-2ke}},\quad k=\frac{K_2x}{T_0^2},\quad b=C-kT_i,\quad
        e=\frac{x_0-x}2\Big(K_0-K_2\frac{T_i^2}{T_0^2}\Big)+Dt

    in which the root is the total capacity :math:`C-kT`. Valid while that is positive.

    Source: Sauer, Duong & Mandadapu (2021), section 6.2, with temperature-independent capacities.

    >>> bonds = BondingConstantCapacity(C_1=1.0, C_2=1.0, T_0=300.0, K_0=60.0, T_i=300.0, tau=0.5)
    >>> f"{bonds.solution(50.0)['T']:.9f}"
    '315.000000000'
    """

    name: ClassVar[str] = "bonding-constant-capacity"
    model: ClassVar[EnergyModel] = ConstantCapacity()

    @property
    def _bond_capacity_scale(self) -> Fraction:
        return self._exact_C * Fraction(self.T_0) ** 2 / Fraction(self.T_i)

    def _curvature(self, unbonded_squared: Array) -> Array:
        return self.K_2 * unbonded_squared / self.T_0**2

    def temperature(self, t: Array) -> tuple[Array, Array]:
        x, y = self.unbonded_squared(t)
        released = 0.5 * y * (self.K_0 - self.K_2 * (self.T_i / self.T_0) ** 2) + self.D * t
        at_start = self.C * self.free_capacity + self._curvature(y) * self.T_i
        rise = 2.0 * released / (at_start + np.sqrt(at_start**2 - 2.0 * self._curvature(x) * released))
        return np.where(self.T_i + rise > 0.0, self.T_i + rise, np.nan), rise

    def heating_share(self, T: Array, t: Array) -> Array:
        x, y = self.unbonded_squared(t)
        rise = T - self.T_i
        return 1.0 / (self.C * self.free_capacity + self._curvature(y) * self.T_i - self._curvature(x) * rise)


class ThinningFilmConstantCapacity(FrictionallyHeated):
    r"""Heating by a film of viscosity :math:`\eta_0e^{-\beta(T-T_0)}`, constant capacity, no loss.

    .. math:: C\dot T=D_0e^{-\beta(T-T_0)},\qquad T=T_i+\frac1\beta\ln\Big(1+\frac{\beta D_it}C\Big),\quad
        D_i=D_0e^{-\beta(T_i-T_0)}

    Any t >= 0, beta > 0.

    Source: Sauer, Duong & Mandadapu (2021), section 6.1, viscous law with a temperature-dependent viscosity (Reynolds
    1886) and a constant capacity, integrated.

    >>> film = ThinningFilmConstantCapacity(C=4000.0, T_0=300.0, T_i=300.0, D_0=3000.0, beta=0.04)
    >>> f"{film.solution(4e4)['T']:.10f}"
    '477.2727455520'
    """

    name: ClassVar[str] = "thinning-film-constant-capacity"

    beta: float = parameter("1/K", "decay of the viscosity per kelvin", above=0)

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        initial = self.D_0 * np.exp(-self.beta * (self.T_i - self.T_0))
        gained = self.beta * initial * t / self.C
        return {"T": self.T_i + np.log1p(gained) / self.beta, "D": initial / (1.0 + gained)}


class ThinningFilmSteadyState(Oracle):
    r"""Steady temperature of a film of viscosity :math:`\eta_0e^{-\beta(T-T_0)}` with a linear heat loss.

    .. math:: D_0e^{-\beta(T-T_0)}=H(T-T_a),\qquad
        T=T_a+\frac1\beta W_0\Big(\frac{\beta D_0}He^{-\beta(T_a-T_0)}\Big)

    evaluated from the logarithm of the argument by Wright's omega function (Corless & Jeffrey 2002), so that nothing
    overflows. Unique and stable for any capacity.

    Source: Sauer, Duong & Mandadapu (2021), section 6.1, viscous law with a temperature-dependent viscosity (Reynolds
    1886) and a loss.

    >>> film = ThinningFilmSteadyState(T_0=300.0, D_0=3000.0, beta=0.04, H=12.0, T_a=300.0)
    >>> f"{film.solution(0.0)['T']:.10f}"
    '343.6382000685'
    """

    name: ClassVar[str] = "thinning-film-steady-state"

    T_0: float = parameter("K", "reference temperature", above=0)
    D_0: float = parameter("W/m^2", "dissipation at T_0", above=0)
    beta: float = parameter("1/K", "decay of the viscosity per kelvin", above=0)
    H: float = parameter("W/(m^2 K)", "conductance to the surroundings", above=0)
    T_a: float = parameter("K", "temperature of the surroundings", above=0)

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        log_argument = np.log(self.beta * self.D_0 / self.H) - self.beta * (self.T_a - self.T_0)
        above = float(wrightomega(log_argument)) / self.beta
        return {"T": self.T_a + above, "D": self.H * above}


class EndothermicMedium(Oracle):
    r"""Capacity of a medium with endothermic bonds, and the growth of a small deviation from the bodies' temperature.

    .. math:: C_{eff}=\Big(C_c-\frac{K_2(1-\phi)^2}{T_0}\Big)\frac T{T_0},\qquad \lambda=-\frac{h_1+h_2}{C_{eff}}

    at a bonding state that does not change. With :math:`C_{eff}<0` every deviation grows, the faster the better the
    conductance: no scene may have it, and one that starts so has to be refused.

    Source: Sauer, Duong & Mandadapu (2021), section 6.2.2 with finite conductances, linearised.

    >>> medium = EndothermicMedium(C_c=0.1, K_2=240.0, phi=0.0, T=300.0, T_0=300.0, h_1=500.0, h_2=300.0)
    >>> f"{medium.capacity:.6f} {medium.growth_rate:.6f}"
    '-0.700000 1142.857143'
    """

    name: ClassVar[str] = "endothermic-medium"

    C_c: float = parameter("J/(m^2 K)", "heat capacity of the medium at T_0", at_least=0)
    K_2: float = parameter("J/m^2", "quadratic part of the bond energy density", at_least=0)
    phi: float = parameter("1", "bonding state", at_least=0, at_most=1)
    T: float = parameter("K", "temperature", above=0)
    T_0: float = parameter("K", "reference temperature", above=0)
    h_1: float = parameter("W/(m^2 K)", "conductance between medium and body 1", at_least=0)
    h_2: float = parameter("W/(m^2 K)", "conductance between medium and body 2", at_least=0)

    @property
    def capacity(self) -> float:
        """Capacity [J/(m^2 K)] at constant bonding state."""
        return (self.C_c - self.K_2 * (1.0 - self.phi) ** 2 / self.T_0) * self.T / self.T_0

    @property
    def growth_rate(self) -> float:
        """Rate [1/s] at which a deviation grows; negative where it decays."""
        return -(self.h_1 + self.h_2) / self.capacity

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        return {"C_eff": self.capacity, "growth_rate": self.growth_rate}


class CouetteFlow(Oracle):
    r"""Steady shear of a film of viscosity :math:`\eta_we^{-\beta(T-T_w)}` between walls at :math:`T_w`.

    .. math:: k\,T''+\tau\,u'=0,\quad\tau=\eta(T)\,u',\qquad
        T=T_w+\frac2\beta\ln\frac{\cosh\lambda}{\cosh\lambda s},\quad
        \sinh\lambda=\sqrt{\mathrm{Na}/8},\quad\mathrm{Na}=\frac{\beta\eta_wv^2}k,\quad
        \tau=\frac{\eta_wv}d\frac{2\lambda}{\sinh2\lambda}

    with s from -1 to 1 across the film. T_c is the mean of T, T_max its largest value. The traction grows with the
    velocity up to the Nahme fold, :math:`\lambda\tanh\lambda=1` at Na = 18.2, beyond which no traction holds a steady
    flow; at a given velocity there is one at any Na.

    An interface with one temperature of the film agrees for :math:`\beta=0`, where
    :math:`T_c-T_w=\eta_wv^2/12k`. It sees the viscosity at T_c instead of across the film: of the rise of T_c it misses
    1.4 % at Na = 1 and 4.3 % at most up to the fold, where its traction is 10 % too large.

    Any t >= 0. Source: Nahme (1940), Ing.-Arch. 11, 191; Gavis & Laurence (1968), doi 10.1021/i160025a032.

    >>> film = CouetteFlow(T_w=300.0, d_m=5e-6, k_m=0.13, eta_w=0.01, beta=0.04, v=30.0)
    >>> f"{film.solution(0.0)['T_c']:.8f}, {film.nahme:.4f}"
    '304.90582203, 2.7692'
    """

    name: ClassVar[str] = "couette-flow"

    T_w: float = parameter("K", "temperature of both walls", above=0)
    d_m: float = parameter("m", "thickness of the film", above=0)
    k_m: float = parameter("W/(m K)", "thermal conductivity of the film", above=0)
    eta_w: float = parameter("Pa s", "viscosity at the walls", above=0)
    beta: float = parameter("1/K", "decay of the viscosity per kelvin", default=0.0, at_least=0)
    v: float = parameter("m/s", "velocity of one wall relative to the other", at_least=0)

    @property
    def nahme(self) -> float:
        """Nahme number: how far viscous heating would thin the film."""
        return self.beta * self.eta_w * self.v**2 / self.k_m

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        lam = math.asinh(math.sqrt(self.nahme / 8))
        thinned = 2 * lam / math.sinh(2 * lam) if lam else 1.0
        traction = self.eta_w * self.v / self.d_m * thinned
        mean = float(WEIGHTS @ self._rise(lam, (NODES + 1) / 2)) / 2
        top = float(self._rise(lam, np.zeros(1))[0])
        return {"T_c": self.T_w + mean, "T_max": self.T_w + top, "t_t": traction, "D": traction * self.v}

    def _rise(self, lam: float, s: Array) -> Array:
        """Temperature above the walls [K] at the distance s from the middle, in half thicknesses."""
        if not lam:
            return self.eta_w * self.v**2 / (8 * self.k_m) * (1 - s**2)
        hotter = 2 * np.sinh(lam * (1 + s) / 2) * np.sinh(lam * (1 - s) / 2) / np.cosh(lam * s)
        return np.asarray(2 / self.beta * np.log1p(hotter))


class SuddenContact(Oracle):
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


# -- mechanics ---------------------------------------------------------------------------------------------------------


class BondSpringsInEquilibrium(Oracle):
    r"""Springs whose stiffness is in proportion to the bonds, and bonds that are in equilibrium with the tension.

    .. math:: \phi=1-\frac{E_bg_n^2}{2K_0},\quad t_n=\phi E_bg_n\quad\text{for }g_n<\sqrt{2K_0/E_b},\quad\text{else }0

    Peak traction at :math:`\sqrt{2K_0/3E_b}`, work of separation :math:`K_0/2`. Here :math:`g_n=g_i+\dot gt\ge0`; the
    limit of kinetics that are fast against the opening.

    Source: Sauer, Duong & Mandadapu (2021), eq. ex:psi_c with :math:`E_n=\phi E_b` and eq. e:Psi_bt, at zero chemical
    potential.

    >>> bonds = BondSpringsInEquilibrium(E_b=1e16, K_0=0.2, g_dot=1e-9)
    >>> f"{bonds.peak_gap:.9e} {bonds.strength:.9e} {bonds.work_of_separation}"
    '3.651483717e-09 2.434322478e+07 0.1'
    """

    name: ClassVar[str] = "bond-springs-in-equilibrium"

    E_b: float = parameter("Pa/m", "stiffness of complete bonding", above=0)
    K_0: float = parameter("J/m^2", "bond energy density", above=0)
    g_i: float = parameter("m", "initial gap", default=0.0, at_least=0)
    g_dot: float = parameter("m/s", "opening speed", at_least=0)

    @property
    def failure_gap(self) -> float:
        """Gap [m] at which the last bond breaks."""
        return math.sqrt(2.0 * self.K_0 / self.E_b)

    @property
    def peak_gap(self) -> float:
        """Gap [m] of the largest traction."""
        return self.failure_gap / math.sqrt(3.0)

    @property
    def strength(self) -> float:
        """Largest traction [Pa]."""
        return 2.0 / 3.0 * self.E_b * self.peak_gap

    @property
    def work_of_separation(self) -> float:
        """Work [J/m^2] of complete opening."""
        return 0.5 * self.K_0

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        g = self.g_i + self.g_dot * t
        ratio = np.minimum(g / self.failure_gap, 1.0)
        phi = (1.0 - ratio) * (1.0 + ratio)
        return {"g_n": g, "phi": phi, "t_n": phi * self.E_b * g}


@dataclass(frozen=True)
class Snap:
    """Gap and far-field displacement [m] at which a gap on a spring is lost."""

    g: float
    w: float


class LennardJonesFlats(Oracle):
    r"""Energy and traction between two flats that move at constant speed, and their characteristic values.

    .. math:: W=Ag_0^2\Big[\frac1{360}\Big(\frac{g_0}{g_n}\Big)^8-\frac16\Big(\frac{g_0}{g_n}\Big)^2\Big],\quad
        t_n=-Ag_0\Big[\frac1{45}\Big(\frac{g_0}{g_n}\Big)^9-\frac13\Big(\frac{g_0}{g_n}\Big)^3\Big],\quad
        A=2\pi n_1n_2\psi_0

    No traction at :math:`g_015^{-1/6}`, strength :math:`\frac{2\sqrt5}9Ag_0` at :math:`g_05^{-1/6}`, adhesion energy
    :math:`\frac{15^{1/3}}8Ag_0^2`, largest softening :math:`\frac352^{2/3}A` at :math:`g_02^{-1/6}`. On a spring the
    gap is lost where the softening is the spring's stiffness. Here :math:`g_n=g_i+\dot gt>0`.

    Source: Sauer, Duong & Mandadapu (2021), eqs. e:psi12ex and e:bt_sr.

    >>> flats = LennardJonesFlats(n_1=2e19, n_2=3e19, psi_0=4e-21, g_0=3e-10, g_i=3e-10)
    >>> f"{flats.strength:.9e} {flats.adhesion_energy:.9f} {flats.largest_softening:.9e}"
    '2.247940714e+09 0.418383022 1.436246635e+19'
    """

    name: ClassVar[str] = "lennard-jones-flats"

    n_1: float = parameter("1/m^2", "density of interacting sites on body 1", above=0)
    n_2: float = parameter("1/m^2", "density of interacting sites on body 2", above=0)
    psi_0: float = parameter("J", "interaction energy of a pair", above=0)
    g_0: float = parameter("m", "range of the interaction", above=0)
    g_i: float = parameter("m", "initial gap", above=0)
    g_dot: float = parameter("m/s", "opening speed", default=0.0)

    @property
    def A(self) -> float:
        """Stiffness scale [Pa/m]."""
        return 2.0 * math.pi * self.n_1 * self.n_2 * self.psi_0

    @property
    def end_time(self) -> float:
        """Time [s] at which flats that approach meet."""
        return -self.g_i / self.g_dot if self.g_dot < 0.0 else math.inf

    @property
    def equilibrium_gap(self) -> float:
        """Gap [m] without traction."""
        return float(self.g_0 * 15.0 ** (-1.0 / 6.0))

    @property
    def strength_gap(self) -> float:
        """Gap [m] of the largest tension."""
        return float(self.g_0 * 5.0 ** (-1.0 / 6.0))

    @property
    def strength(self) -> float:
        """Largest tension [Pa]."""
        return 2.0 * math.sqrt(5.0) / 9.0 * self.A * self.g_0

    @property
    def adhesion_energy(self) -> float:
        """Work of separation [J/m^2]."""
        return float(15.0 ** (1.0 / 3.0) / 8.0 * self.A * self.g_0**2)

    @property
    def largest_softening(self) -> float:
        """Stiffness [Pa/m] from which on a spring holds the flats at any gap."""
        return 0.6 * Y_FOLD**2 * self.A

    def snap_in(self, k: float) -> Snap:
        """Where approaching flats on a spring of stiffness k [Pa/m] jump together."""
        self._check(k)
        y = increasing_root(lambda y: (_softening(y), _change(y)), *self._span(k, 0.0, Y_FOLD))
        return self._snap(y, k)

    def pull_off(self, k: float) -> Snap:
        """Where receding flats on a spring of stiffness k [Pa/m] jump apart."""
        self._check(k)
        target, low, high = self._span(k, Y_FOLD, 5.0 ** (1.0 / 3.0))
        y = -increasing_root(lambda x: (_softening(-x), -_change(-x)), target, -high, -low)
        return self._snap(y, k)

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        g = self.g_i + self.g_dot * t
        return {"g_n": g, "W": self.energy(g), "t_n": self.traction(g)}

    def energy(self, g: Array) -> Array:
        """Energy [J/m^2] at a gap."""
        square = (self.g_0 / g) ** 2
        return np.asarray(self.A * self.g_0**2 * square * (square**3 / 360.0 - 1.0 / 6.0))

    def traction(self, g: Array) -> Array:
        """Tension [Pa] at a gap."""
        ratio = self.g_0 / g
        return np.asarray(-self.A * self.g_0 * ratio**3 * (ratio**6 / 45.0 - 1.0 / 3.0))

    def _check(self, k: float) -> None:
        if not 0.0 < k < self.largest_softening:
            raise InputError(f"{self.name}: no jump with k = {k!r} Pa/m; it takes 0 < k < {self.largest_softening!r}.")

    def _span(self, k: float, low: float, high: float) -> tuple[Array, Array, Array]:
        return np.array([k / self.A]), np.array([low]), np.array([high])

    def _snap(self, y: Array, k: float) -> Snap:
        g = self.g_0 / np.sqrt(y)
        return Snap(float(g[0]), float((g + self.traction(g) / k)[0]))


def _softening(y: Array) -> Array:
    """-dt_n/dg over A as a function of (g_0 / g)^2."""
    return y**2 * (1.0 - y**3 / 5.0)


def _change(y: Array) -> Array:
    return y * (2.0 - y**3)


# -- manufactured ------------------------------------------------------------------------------------------------------


class Manufactured(Oracle):
    r"""Chosen temperatures, bonding state and gap, to be met by supplying heat and bonds.

    .. math:: T_1=T_0\Big(1+\tfrac{\sin2t}{20}\Big),\quad T_2=T_0\Big(\tfrac{11}{10}-\tfrac{e^{-t}}{10}\Big),\quad
        T_c=T_0\Big(1+\tfrac2{25}e^{-t/3}\cos t\Big),\\
        \phi=\tfrac12+\tfrac25\sin(t+0.3),\qquad g_n=g_a\Big(1+\tfrac12\sin3t\Big)

    with t in seconds. The sources :math:`Q_1,Q_2,Q_c,r_\phi` that make any scene follow these functions are what is
    left of its balances when they are inserted; `state` evaluates them with any set of elementary functions, symbols
    included, for that purpose. The other parameters are those of the scene for which sources are tabulated: quadratic
    bodies, and an interface with

    .. math:: \Psi=\tfrac12E_0(1+a_E\phi)(1-b_E\theta)g_n^2-\frac{C_0(1+a_C\phi)}{2T_0}\theta^2
        +\tfrac12\Big(K_0+K_1\tfrac T{T_0}+K_2\tfrac{T^2}{T_0^2}\Big)\Big(1+d_K\tfrac{g_n}{g_a}\Big)
        \Big(\phi-\phi_{e0}-\phi_{e1}\tfrac\theta{T_0}\Big)^2,\quad \theta=T_c-T_0

    linear kinetics :math:`\dot\phi=-c\,e^{-\frac{E_a}{R_g}(1/T_c-1/T_0)}\,\partial\Psi/\partial\phi+r_\phi`, sliding in
    a film, :math:`D=\eta e^{-\beta(T_c-T_0)}v^2/g_{film}`, and conductances h_1, h_2 (medium) and h_d (direct).

    Source: method of manufactured solutions (Roache 2002, J. Fluids Eng. 124, 4-10).

    >>> f"{Manufactured().solution(2.0)['T_c']:.10f}"
    '294.8722341621'
    """

    name: ClassVar[str] = "manufactured"

    T_0: float = parameter("K", "reference temperature", default=300.0, above=0)
    g_a: float = parameter("m", "mean gap", default=1e-6, above=0)
    C_1: float = parameter("J/(m^2 K)", "heat capacity of body 1 at T_0", default=40.0, above=0)
    C_2: float = parameter("J/(m^2 K)", "heat capacity of body 2 at T_0", default=25.0, above=0)
    h_1: float = parameter("W/(m^2 K)", "conductance between medium and body 1", default=900.0)
    h_2: float = parameter("W/(m^2 K)", "conductance between medium and body 2", default=300.0)
    h_d: float = parameter("W/(m^2 K)", "direct conductance between the bodies", default=50.0)
    E_0: float = parameter("Pa/m", "contact stiffness without bonds at T_0", default=1e12)
    a_E: float = parameter("1", "growth of the stiffness with bonding", default=0.5)
    b_E: float = parameter("1/K", "decrease of the stiffness with temperature", default=2e-3)
    C_0: float = parameter("J/(m^2 K)", "heat capacity of the interface without bonds at T_0", default=2.0)
    a_C: float = parameter("1", "growth of the capacity with bonding", default=0.3)
    K_0: float = parameter("J/m^2", "temperature-independent part of the bond energy density", default=300.0)
    K_1: float = parameter("J/m^2", "linear part of the bond energy density", default=80.0)
    K_2: float = parameter("J/m^2", "quadratic part of the bond energy density", default=40.0)
    d_K: float = parameter("1", "growth of the bond energy density with the gap", default=0.2)
    phi_e0: float = parameter("1", "equilibrium bonding state at T_0", default=0.9)
    phi_e1: float = parameter("1", "growth of the equilibrium bonding state with temperature", default=0.3)
    c_over_n: float = parameter("m^2/(J s)", "rate constant per bond over site density", default=0.01)
    E_a: float = parameter("J/mol", "activation energy", default=3e4)
    eta: float = parameter("Pa s", "viscosity of the film at T_0", default=0.05)
    beta: float = parameter("1/K", "decay of the viscosity per kelvin", default=0.01)
    v: float = parameter("m/s", "sliding velocity", default=0.2)
    g_film: float = parameter("m", "film thickness", default=2e-6, above=0)

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        return self.state(t, np)

    def state(self, t: Any, functions: Any) -> dict[str, Any]:
        """The chosen functions at t, with sin, cos and exp from `functions`: numpy, mpmath or a computer algebra."""
        sin, cos, exp = functions.sin, functions.cos, functions.exp
        return {
            "T_1": self.T_0 * (1 + sin(2 * t) / 20),
            "T_2": self.T_0 * (1.1 - exp(-t) / 10),
            "T_c": self.T_0 * (1 + 2 * exp(-t / 3) * cos(t) / 25),
            "phi": 0.5 + 0.4 * sin(t + 0.3),
            "g_n": self.g_a * (1 + sin(3 * t) / 2),
        }


ORACLES: dict[str, type[Reference]] = {
    kind.name: kind
    for kind in list(globals().values())
    if isinstance(kind, type) and issubclass(kind, Reference) and kind.__module__ == __name__ and "name" in vars(kind)
}


def get(name: str) -> type[Reference]:
    """The exact solution called `name`, of the tests or of the package."""
    return ORACLES[name] if name in ORACLES else references.get(name)
