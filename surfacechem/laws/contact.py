"""Mechanical and thermal part of the interface's free energy: elastic contact, bond springs, capacity."""

from __future__ import annotations

from typing import Literal

from surfacechem.contracts.terms import Potential, TangentialPotential, option, parameter
from surfacechem.expressions import Expression, log, positive, where


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
