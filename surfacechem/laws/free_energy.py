"""Free energies: of the bodies, and of the interface its mechanical, thermal and chemical parts."""

from __future__ import annotations

from typing import Literal

from surfacechem.contracts.terms import BodyEnergy, Potential, TangentialPotential, option, parameter
from surfacechem.expressions import Expression, decay, log, mixing, positive, where
from surfacechem.quantities import BOLTZMANN


class Quadratic(BodyEnergy):
    r"""Body whose internal energy is quadratic in temperature, so that its capacity grows as T.

    .. math:: F = -\frac{C}{2 T_0}(T - T_0)^2, \quad U = \frac{C}{2 T_0}(T^2 - T_0^2), \quad S = C(T/T_0 - 1)

    Source: Sauer, Duong & Mandadapu (2021), eq. e:Uk0. Any T > 0.

    >>> Quadratic(C=1000.0).energy(T=330.0, T_0=300.0)
    -1500.0
    """

    C: float = parameter("J/(m^2 K)", "heat capacity per area at T_0", above=0)

    def energy(self, T: Expression, T_0: Expression) -> Expression:
        """Free energy [J/m^2]."""
        return -self.C / (2 * T_0) * (T - T_0) ** 2


class Constant(BodyEnergy):
    r"""Body with a constant heat capacity.

    .. math:: F = C\,[\,T - T_0 - T \ln(T/T_0)\,], \quad U = C(T - T_0), \quad S = C \ln(T/T_0)

    Source: classical thermodynamics. Any T > 0.

    >>> round(Constant(C=1000.0).energy(T=330.0, T_0=300.0), 6)
    -1452.359335
    """

    C: float = parameter("J/(m^2 K)", "heat capacity per area", above=0)

    def energy(self, T: Expression, T_0: Expression) -> Expression:
        """Free energy [J/m^2]."""
        return self.C * (T - T_0 - T * log(T / T_0))


class NormalStiffness(Potential):
    r"""Linear elastic contact normal to the interface, in tension and in compression.

    .. math:: \Psi = \tfrac12 E_n g_n^2, \quad t_n = E_n g_n

    :math:`E_n` may vary with temperature and bonding state; the thermo-elastic and chemical terms follow.
    Source: Sauer, Duong & Mandadapu (2021), eq. ex:psi_c. Any g_n.

    >>> NormalStiffness(E_n=1e12).energy(g_n=1e-6)
    0.5
    """

    E_n: float = parameter("Pa/m", "normal contact stiffness", at_least=0)

    def energy(self, g_n: Expression) -> Expression:
        """Free energy [J/m^2]."""
        return self.E_n * g_n**2 / 2


class BondedContact(Potential):
    r"""Linear elastic contact that carries tension only while it is bonded.

    .. math:: \Psi = \tfrac12 E_n g_n^2 \quad \text{if bonded or } g_n < 0, \quad \text{else } 0

    Source: Sauer, Duong & Mandadapu (2021), eq. ex:psi_c with its remark 5.6. Any g_n.

    >>> BondedContact(E_n=1e12).energy(g_n=1e-6, bonded=1.0), BondedContact(E_n=1e12).energy(g_n=1e-6, bonded=0.0)
    (0.5, 0.0)
    """

    E_n: float = parameter("Pa/m", "normal contact stiffness", at_least=0)

    def energy(self, g_n: Expression, bonded: Expression) -> Expression:
        """Free energy [J/m^2]."""
        return self.E_n * (bonded * positive(g_n) ** 2 + positive(-g_n) ** 2) / 2


class TangentialStiffness(TangentialPotential):
    r"""Linear elastic contact along the interface.

    .. math:: \Psi = \tfrac12 E_t g_t^2, \quad t_t = E_t g_t

    In series with friction it is elastic sticking: :math:`g_t` grows up to the friction limit, then the interface
    slides. In parallel with friction it acts on the whole displacement, as a layer of glue does. If :math:`g_t` is
    prescribed, its traction is added to that of friction. Source: Sauer, Duong & Mandadapu (2021), eq. ex:psi_c. Any
    g_t.

    >>> TangentialStiffness(E_t=1e12).energy(g_t=1e-6)
    0.5
    """

    E_t: float = parameter("Pa/m", "tangential contact stiffness", at_least=0)
    shear: Literal["parallel", "series", "none"] = option(
        "how it acts with friction: 'series', on an elastic gap that slides, 'parallel', beside it on the whole "
        "displacement, or 'none'",
        default="series",
    )

    def energy(self, g_t: Expression) -> Expression:
        """Free energy [J/m^2]."""
        return self.E_t * g_t**2 / 2


class Penalty(Potential):
    r"""Unilateral elastic contact: pressure if the bodies overlap, zero traction if they are apart.

    .. math:: \Psi = \tfrac12 E_n \langle -g_n \rangle^2, \quad t_n = -E_n \langle -g_n \rangle

    The energy and its slope are continuous at touch. :math:`E_n` may vary with temperature and bonding state. Rigid
    contact is its limit: in series with a body of stiffness k the overlap is :math:`k w / (k + E_n)`.
    Source: classical penalty method (Wriggers, Computational Contact Mechanics, 2006); Sauer, Duong & Mandadapu
    (2021), eq. ex:psi_c, for g_n < 0. Any g_n.

    >>> Penalty(E_n=1e12).energy(g_n=-1e-6), Penalty(E_n=1e12).energy(g_n=1e-6)
    (0.5, 0)
    """

    E_n: float = parameter("Pa/m", "contact stiffness", at_least=0)

    def energy(self, g_n: Expression) -> Expression:
        """Free energy [J/m^2]."""
        return where(g_n < 0, self.E_n * g_n**2 / 2, 0)


class BondStiffness(Potential):
    r"""Bonds as springs: they carry tension in proportion to the bonding state; contact carries compression.

    .. math:: \Psi = \tfrac12 \phi E_b \langle g_n \rangle^2 + \tfrac12 E_n \langle -g_n \rangle^2

    Loss of bonds is damage in tension only. Tension raises the chemical potential by :math:`\tfrac12 E_b g_n^2`, so
    that with a bond energy :math:`\tfrac12 K (\phi - 1)^2` equilibrium is :math:`\phi = 1 - E_b g_n^2 / 2 K`: peak
    traction at :math:`\sqrt{2K/3E_b}`, work of separation K/2.
    Source: Sauer, Duong & Mandadapu (2021), eq. ex:psi_c with :math:`E_n = \phi E_b`. Any g_n.

    >>> springs = BondStiffness(E_b=1e12, E_n=4e12)
    >>> springs.energy(g_n=1e-6, phi=0.5), springs.energy(g_n=-1e-6, phi=0.5)
    (0.25, 2.0)
    """

    E_b: float = parameter("Pa/m", "stiffness in tension of complete bonding", at_least=0)
    E_n: float = parameter("Pa/m", "contact stiffness in compression", at_least=0)

    def energy(self, g_n: Expression, phi: Expression) -> Expression:
        """Free energy [J/m^2]."""
        return where(g_n > 0, phi * self.E_b, self.E_n) * g_n**2 / 2


class InterfaceCapacity(Potential):
    r"""Heat capacity of the interface, of trapped wear debris or a film for instance.

    .. math:: \Psi = -\frac{C_c}{2 T_0} (T_c - T_0)^2, \quad S = C_c (T_c / T_0 - 1)

    The capacity at T is :math:`C_c T / T_0`. :math:`C_c` may vary with gap and bonding state.
    Source: Sauer, Duong & Mandadapu (2021), eq. ex:psi_c. T > 0.

    >>> InterfaceCapacity(C_c=50.0).energy(T_c=330.0, T_0=300.0)
    -75.0
    """

    C_c: float = parameter("J/(m^2 K)", "heat capacity of the interface at T_0", above=0)

    def energy(self, T_c: Expression, T_0: Expression) -> Expression:
        """Free energy [J/m^2]."""
        return -self.C_c / (2 * T_0) * (T_c - T_0) ** 2


class ConstantInterfaceCapacity(Potential):
    r"""Temperature-independent heat capacity of the interface.

    .. math:: \Psi = C_c\,[\,T_c - T_0 - T_c \ln(T_c/T_0)\,], \quad S = C_c \ln(T_c/T_0)

    Source: classical thermodynamics. T > 0.

    >>> round(ConstantInterfaceCapacity(C_c=50.0).energy(T_c=330.0, T_0=300.0), 6)
    -72.617967
    """

    C_c: float = parameter("J/(m^2 K)", "heat capacity of the interface", above=0)

    def energy(self, T_c: Expression, T_0: Expression) -> Expression:
        """Free energy [J/m^2]."""
        return self.C_c * (T_c - T_0 - T_c * log(T_c / T_0))


class BondEnergy(Potential):
    r"""Quadratic bond energy around an equilibrium bonding state.

    .. math:: \Psi = \tfrac12 K (\phi - \phi_{eq})^2, \quad K = K_0 + K_1 \frac{T}{T_0} + K_2 \frac{T^2}{T_0^2}

    :math:`K_0` releases heat on bonding, :math:`K_2` absorbs it, :math:`K_1` is purely entropic. Each coefficient and
    :math:`\phi_{eq}` may vary with the other variables through factors.

    Source: Sauer, Duong & Mandadapu (2021), eqs. e:phieq and e:Psi_bt. Any phi; the capacity it takes from the
    interface, :math:`K_2 (\phi - \phi_{eq})^2 T / T_0^2` for constant :math:`\phi_{eq}`, must leave a positive rest.

    >>> BondEnergy(K_0=300.0).energy(phi=0.5, T_c=300.0, T_0=300.0)
    37.5
    """

    K_0: float = parameter("J/m^2", "temperature-independent part of the bond energy density", default=0.0)
    K_1: float = parameter("J/m^2", "linear (entropic) part of the bond energy density", default=0.0)
    K_2: float = parameter("J/m^2", "quadratic part of the bond energy density", default=0.0)
    phi_eq: float = parameter("1", "equilibrium bonding state", default=1.0)
    K: float = parameter("1", "common factor of all coefficients", default=1.0)

    def energy(self, phi: Expression, T_c: Expression, T_0: Expression) -> Expression:
        """Free energy [J/m^2]."""
        ratio = T_c / T_0
        stiffness = self.K * (self.K_0 + self.K_1 * ratio + self.K_2 * ratio**2)
        return stiffness * (phi - self.phi_eq) ** 2 / 2


class LinearEnthalpy(Potential):
    r"""Constant heat of reaction: bonding releases H_r per unit of phi.

    .. math:: \Psi = H_r (1 - \phi), \quad M = -H_r

    A forward reaction only: the chemical potential never changes sign. Source: classical; the limit of constant bond
    enthalpy used for cure kinetics.

    >>> LinearEnthalpy(H_r=200.0).energy(phi=0.25)
    150.0
    """

    H_r: float = parameter("J/m^2", "heat released by complete bonding")

    def energy(self, phi: Expression) -> Expression:
        """Free energy [J/m^2]."""
        return self.H_r * (1 - phi)


class LatticeGas(Potential):
    r"""Ideal mixing of bonded and free sites with a constant bond energy.

    .. math:: \Psi = N_c \{ -\varepsilon \phi + k_B T [ \phi \ln \phi + (1 - \phi) \ln (1 - \phi) ] \}

    The natural partner of mass-action kinetics; it has no heat capacity. Source: statistical mechanics of the ideal
    lattice gas (e.g. Hill, An Introduction to Statistical Thermodynamics, 1960, ch. 7). 0 < phi < 1.

    >>> LatticeGas(epsilon=6e-20).energy(phi=0.5, T_c=300.0, N_c=1e16)
    -0.00032870...
    """

    epsilon: float = parameter("J", "energy released per bond")

    def energy(self, phi: Expression, T_c: Expression, N_c: Expression) -> Expression:
        """Free energy [J/m^2]."""
        return N_c * BOLTZMANN * T_c * (mixing(phi) + mixing(1 - phi)) - N_c * self.epsilon * phi


class PartnerMixing(Potential):
    r"""Ideal mixing of bonds and of free partners that move on both surfaces, with a constant bond energy.

    .. math:: \psi = -\varepsilon n_b + k_B T \sum_{x = b, 1, 2} n_x' [\ln (n_x' a) - 1], \quad
              n_b = n_c \phi, \quad n_{1,2}' = n_{1,2} - n_b

    The natural partner of bimolecular kinetics: equilibrium is :math:`n_b / (n_1' n_2') = a\,e^{\varepsilon / k_B T}`,
    its :math:`k_f / k_r`. Partners meet less often at lower density: stretching the surface breaks bonds, and takes up
    the work :math:`k_B T \ln J_c` of each particle that moves on it. Source: ideal gas in two dimensions (Hill, An
    Introduction to Statistical Thermodynamics, 1960, ch. 4 and 10); K in two dimensions as in Dembo, Torney, Saxman &
    Hammer (1988), doi 10.1098/rspb.1988.0038. Per current area. 0 < phi < min(n_1, n_2) / n_c.

    >>> mixing = PartnerMixing(epsilon=6e-20, a=1e-18)
    >>> round(mixing.energy(phi=0.5, T_c=300.0, n_c=1e16, n_1=1e16, n_2=2e16), 9)
    -0.000883927
    """

    per = "current"

    epsilon: float = parameter("J", "energy released per bond")
    a: float = parameter("m^2", "area of a site, from which the bond energy counts", above=0)

    def energy(self, phi: Expression, T_c: Expression, n_c: Expression, n_1: Expression, n_2: Expression) -> Expression:
        """Free energy [J/m^2]."""
        parts = (phi, n_c), (1 - phi * n_c / n_1, n_1), (1 - phi * n_c / n_2, n_2)
        moving = sum(n * (mixing(part) + part * (log(n * self.a) - 1)) for part, n in parts)
        return BOLTZMANN * T_c * moving - self.epsilon * n_c * phi


class BondSprings(Potential):
    r"""Elastic energy of the bonds, each a spring across the gap.

    .. math:: \Psi = N_c\,\phi\,\tfrac12 k_b (g_n - l_0)^2, \quad f = k_b (g_n - l_0), \quad t_n = n_c\,\phi\,f

    Stretched bonds are worth less: the chemical potential contains the energy of the spring. Source: Dembo, Torney,
    Saxman & Hammer (1988), doi 10.1098/rspb.1988.0038. Any g_n; bonds are compressed below :math:`l_0`.

    >>> round(BondSprings(k_b=1e-3).energy(phi=0.5, g_n=1e-8, N_c=1e16), 12)
    0.00025
    """

    k_b: float = parameter("N/m", "stiffness of a bond", at_least=0)
    l_0: float = parameter("m", "gap at which bonds are not stretched", default=0.0)

    def energy(self, phi: Expression, g_n: Expression, N_c: Expression) -> Expression:
        """Free energy [J/m^2]."""
        return N_c * phi * self.k_b * (g_n - self.l_0) ** 2 / 2


class EquilibriumBonds(Potential):
    r"""Bonds in equilibrium with the gap at a given temperature: springs across it that form and break instantly.

    .. math:: \Psi = -N k_B T \ln (1 + K s), \quad s = e^{-k_b (g_n - l_0)^2 / 2 k_B T}, \quad
              \phi = \frac{K s}{1 + K s}, \quad t_n = N \phi\,k_b (g_n - l_0)

    The minimum over :math:`\phi` of ideal mixing plus the energy of the springs, zero without bonds; for loads that are
    slow compared with bonding, at the constant temperature of a bath. For flats and, since it reads only the gap, for
    curved surfaces. It does not model contact. Source: Bell, Dembo & Bongrand (1984), doi
    10.1016/S0006-3495(84)84252-6, for sites that do not move. Any g_n.

    >>> round(EquilibriumBonds(N=1e16, K=50.0, k_b=1e-3, T=300.0).energy(g_n=0.0) / (1.380649e-23 * 300 * 1e16), 9)
    -3.931825633
    """

    N: float = parameter("1/m^2", "density of sites", above=0)
    K: float = parameter("1", "bonded over free sites where bonds are not stretched", above=0)
    k_b: float = parameter("N/m", "stiffness of a bond", above=0)
    T: float = parameter("K", "temperature at which they form and break", above=0)
    l_0: float = parameter("m", "gap at which bonds are not stretched", default=0.0)

    def energy(self, g_n: Expression) -> Expression:
        """Free energy [J/m^2]."""
        heat = BOLTZMANN * self.T
        return -self.N * heat * log(1 + self.K * decay(self.k_b * (g_n - self.l_0) ** 2 / (2 * heat)))
