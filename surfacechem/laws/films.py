"""A medium between the bodies: its viscosity, and its films, which conduct, shear, store heat, grow and wear."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar

from surfacechem.contracts.terms import (
    FilmGrowth,
    Friction,
    HeatTransfer,
    Potential,
    Property,
    UnderPressure,
    parameter,
)
from surfacechem.expressions import Expression, absolute, exp, log, positive, power, sqrt
from surfacechem.quantities import BOLTZMANN


class Film(HeatTransfer):
    r"""Conduction across a film of the medium.

    .. math:: h = k_m / d_m

    The conductivity is that of the medium at :math:`T_c`. Source: Fourier's law. For films much thicker than the mean
    free path, and too thin for convection.

    With ``closure: medium`` :math:`T_c` is the mean temperature of the film and heat is produced across it, as by
    shear: the profile is a parabola on top of a line, and the heat flux into the wall k is

    .. math:: q_k = \frac{6 k_m}{d_m} \left( T_c - \frac{T_1 + T_2}{2} \right) + \frac{k_m}{d_m} (T_l - T_k),
              \quad l \ne k

    exact in the steady state for uniform heat production. Its entropy production is positive while the ratio of the two
    temperatures is below 7. Source: plane Couette flow with viscous heating (Bird, Stewart & Lightfoot, Transport
    Phenomena, 2002, section 10.4).

    >>> round(Film(between=("lower", "upper")).conductance(k_m=0.026, d_m=1e-5), 9)
    2600.0
    """

    channel = "film"
    positive = ("d_m",)

    def conductance(self, k_m: Expression, d_m: Expression) -> Expression:
        """Conductance [W/(m^2 K)]."""
        return k_m / d_m

    def resistances(self, k_m: Expression, d_m: Expression) -> tuple[Expression, Expression, Expression]:
        """Thermal resistances of walls and film [m^2 K/W]."""
        return 0, d_m / k_m, 0


class RarefiedFilm(HeatTransfer):
    r"""Conduction across a gas film, with temperature jumps at its walls.

    .. math:: h = \frac{k_m}{Y + d_m + M}, \quad
              M = \left(\frac{2 - \alpha_1}{\alpha_1} + \frac{2 - \alpha_2}{\alpha_2}\right)
              \frac{2 \gamma}{\gamma + 1} \frac{\Lambda}{\mathrm{Pr}}, \quad
              \Lambda = \eta_m \sqrt{\frac{\pi}{2 p_m \rho_m}}

    In contact the gas keeps the mean thickness Y of the voids. Everything but Y and the accommodation is a property of
    the medium at :math:`T_c`. Source: Yovanovich, DeVaal & Hegazy (1982), AIAA paper 82-0888; the jump is that of
    Kennard, Kinetic Theory of Gases (1938). Dilute gases; from continuum to free molecular flow within a few per cent,
    for jumps much smaller than the temperatures.

    >>> law = RarefiedFilm(between=("lower", "upper"))
    >>> gas = {"k_m": 0.0259, "eta_m": 1.79e-5, "rho_m": 1.138, "cp_m": 1041.0, "gamma_m": 1.401, "p_m": 101325.0}
    >>> round(law.conductance(d_m=1e-6, **gas), 3)
    21328.612
    """

    channel = "film"

    alpha_1: float = parameter("1", "thermal accommodation at the first end", default=1.0, above=0, at_most=1)
    alpha_2: float = parameter("1", "thermal accommodation at the second end", default=1.0, above=0, at_most=1)
    Y: float = parameter("m", "mean gap at touch, left by the roughness", default=0.0, at_least=0)

    peaks: ClassVar[Mapping[str, float]] = {"d_m": 0.0}
    """Touch, where the film is thinnest."""

    def conductance(
        self,
        k_m: Expression,
        eta_m: Expression,
        rho_m: Expression,
        cp_m: Expression,
        gamma_m: Expression,
        p_m: Expression,
        d_m: Expression,
    ) -> Expression:
        """Conductance [W/(m^2 K)]."""
        return 1 / sum(self.resistances(k_m, eta_m, rho_m, cp_m, gamma_m, p_m, d_m))

    def resistances(
        self,
        k_m: Expression,
        eta_m: Expression,
        rho_m: Expression,
        cp_m: Expression,
        gamma_m: Expression,
        p_m: Expression,
        d_m: Expression,
    ) -> tuple[Expression, Expression, Expression]:
        """Thermal resistances of the jump at each wall, and of the gas between [m^2 K/W]."""
        mean_free_path = eta_m * sqrt(math.pi / (2 * p_m * rho_m))
        prandtl = eta_m * cp_m / k_m
        # A temperature jump is equivalent to a layer of gas: each wall has the resistance of such a thickness.
        jump = 2 * gamma_m / (gamma_m + 1) * mean_free_path / prandtl
        first, second = ((2 - alpha) / alpha * jump / k_m for alpha in (self.alpha_1, self.alpha_2))
        return first, (positive(d_m) + self.Y) / k_m, second


class FilmShear(Friction):
    r"""Newtonian film of the medium.

    .. math:: t_t = \eta_m\,v / d_m

    The viscosity is that of the medium at :math:`T_c`, so that it falls as the film heats. Source: Sauer, Duong &
    Mandadapu (2021), eq. e:visc_fric. Any v; laminar. Dissipates :math:`t_t v \ge 0`.

    >>> round(FilmShear().traction(eta_m=0.5, d_m=1e-6, v=0.25), 6)
    125000.0
    """

    positive = ("d_m",)

    def traction(self, eta_m: Expression, d_m: Expression, v: Expression) -> Expression:
        """Tangential traction [Pa]."""
        return eta_m * v / d_m


class FilmCapacity(Potential):
    r"""Heat that a film of the medium stores.

    .. math:: \Psi = d_m f_m(T_c), \quad -T_c\,f_m'' = \rho_m c_{p,m}

    :math:`f_m` is the exact double integral of the heat capacity; it and its slope are zero at the start. The film
    keeps its thickness; the work of its thermal expansion goes to its surroundings at constant pressure. Per current
    area: material that flows in as the surface stretches comes from the reference temperature, reversibly.
    Source: classical thermodynamics.

    >>> FilmCapacity().energy(d_m=1e-6, f_m=-2.5e7)
    -25.0
    """

    per = "current"

    def energy(self, d_m: Expression, f_m: Expression) -> Expression:
        """Free energy [J/m^2]."""
        return d_m * f_m


class ActivatedGrowth(FilmGrowth):
    """Growth of a tribofilm over a barrier that stress lowers."""

    G_0: float = parameter("m/s", "growth rate without a barrier", at_least=0)
    E: float = parameter("J", "activation energy without stress", at_least=0)
    V: float = parameter("m^3", "activation volume", at_least=0)

    def under(self, stress: Expression, T_c: Expression) -> Expression:
        """Growth rate [m/s] under a stress [Pa]."""
        return self.G_0 * exp((stress * self.V - self.E) / (BOLTZMANN * T_c))


class PressureActivatedGrowth(UnderPressure, ActivatedGrowth):
    r"""Growth of a tribofilm that pressure and heat activate.

    .. math:: \dot d_m = G_0 \exp\left( -\frac{E - p V}{k_B T_c} \right)

    Source: Gosvami, Bares, Mangolini, Konicek, Yablon & Carpick (2015), doi 10.1126/science.1258788, for films of zinc
    dialkyldithiophosphate under the tip of an atomic force microscope; Bell (1978), doi 10.1126/science.347575. Heat of
    formation and heat capacity of the film are neglected: films are nanometres thick.

    >>> law = PressureActivatedGrowth(G_0=0.1, E=1.28e-19, V=4e-30)
    >>> round(law.rate(p=4e9, T_c=373.0) / law.rate(p=0.0, T_c=373.0), 6)
    22.351742
    """

    def rate(self, p: Expression, T_c: Expression) -> Expression:
        """Growth rate [m/s]."""
        return self.under(p, T_c)


class ShearActivatedGrowth(ActivatedGrowth):
    r"""Growth of a tribofilm that shear and heat activate.

    .. math:: \dot d_m = G_0 \exp\left( -\frac{E - t_s V}{k_B T_c} \right)

    :math:`t_s` is the magnitude of the sliding traction. Source: Zhang & Spikes (2016), doi 10.1007/s11249-016-0706-7,
    for films of zinc dialkyldithiophosphate that grow in a lubricant between surfaces which do not touch; Bell (1978),
    doi 10.1126/science.347575. Heat of formation and heat capacity of the film are neglected.

    >>> law = ShearActivatedGrowth(G_0=0.1, E=1.28e-19, V=9e-29)
    >>> round(law.rate(t_s=2e8, T_c=353.0) / law.rate(t_s=0.0, T_c=353.0), 6)
    40.17719
    """

    def rate(self, t_s: Expression, T_c: Expression) -> Expression:
        """Growth rate [m/s]."""
        return self.under(t_s, T_c)


class FilmWear(FilmGrowth):
    r"""Wear of a film by sliding, at a rate proportional to its thickness.

    .. math:: \dot d_m = -|v|\,d_m / L

    With steady growth the film tends to the thickness at which growth and wear balance. Source: wear proportional to
    the thickness, since thicker films are softer, as in Akchurin & Bosman (2017), doi 10.1007/s11249-017-0842-8; here
    per distance slid, as in Archard (1953), doi 10.1063/1.1721448.

    >>> FilmWear(L=0.5).rate(v=-0.1, d_m=1e-7)
    -2e-08
    """

    L: float = parameter("m", "distance slid over which the film wears to 1/e", above=0)

    def rate(self, v: Expression, d_m: Expression) -> Expression:
        """Rate of its thickness [m/s]."""
        return -absolute(v) * d_m / self.L


class Vogel(Property):
    r"""Viscosity of a liquid that falls with temperature.

    .. math:: \eta = a\,e^{b / (T_c - c)}

    Three measured viscosities determine a, b and c. Source: Vogel (1921), Physikalische Zeitschrift 22, 645.
    :math:`T_c > c`; a run that reaches c stops.

    >>> round(Vogel(a=6e-5, b=900.0, c=165.0).value(T_c=313.15), 9)
    0.026088989
    """

    quantity = "eta_m"

    a: float = parameter("Pa s", "viscosity at infinite temperature", above=0)
    b: float = parameter("K", "how fast it falls", at_least=0)
    c: float = parameter("K", "temperature at which it would be infinite", at_least=0, varies=False)

    @property
    def limits(self) -> Mapping[str, tuple[Expression, Expression]]:
        """The pole of the formula."""
        return {"T_c": (self.c, math.inf)}

    def value(self, T_c: Expression) -> Expression:
        """Viscosity [Pa s]."""
        return self.a * exp(self.b / (T_c - self.c))


class Roelands(Property):
    r"""Viscosity of an oil as a function of temperature and contact pressure.

    .. math:: \eta = \eta_0 \exp\left\{ (\ln \eta_0 + 9.67) \left[ \left(1 + \frac{p}{p_0}\right)^{Z}
              \left(\frac{T_c - 138}{T_0 - 138}\right)^{-S_0} - 1 \right] \right\}, \quad p_0 = 0.196\ \mathrm{GPa}

    with temperatures in K and :math:`\eta_0` in Pa s at the reference temperature :math:`T_0`. Source: Roelands (1966),
    thesis, TU Delft, in the form of Houpert (1985), Journal of Tribology 107, 241. Pressures up to about 0.5 GPa;
    :math:`T_c > 138` K, else the run stops.

    >>> law = Roelands(eta_0=0.04, Z=0.6, S_0=1.1)
    >>> [round(law.value(T_c=313.15, p=p, T_0=313.15), 9) for p in (0.0, 1e8)]
    [0.04, 0.244499904]
    """

    quantity = "eta_m"

    eta_0: float = parameter("Pa s", "viscosity at T_0 without pressure", above=0)
    Z: float = parameter("1", "index of the pressure", default=0.0, at_least=0)
    S_0: float = parameter("1", "index of the temperature", default=0.0, at_least=0)

    limits: ClassVar[Mapping[str, tuple[float, float]]] = {"T_c": (138.0, math.inf)}
    """The pole of the formula."""

    def value(self, T_c: Expression, p: Expression, T_0: Expression) -> Expression:
        """Viscosity [Pa s]."""
        thinned = power((T_c - 138) / (T_0 - 138), -self.S_0)
        pressed = power(1 + p / 0.196e9, self.Z)
        return self.eta_0 * exp((log(self.eta_0) + 9.67) * (pressed * thinned - 1))
