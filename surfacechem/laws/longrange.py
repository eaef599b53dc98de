r"""Long-range interaction: surfaces that do not touch, by Lennard-Jones, van der Waals, electrostatics; and two points.

Between flats the energy is per current area. Between a sphere and a plane it is divided by the reference area of all
other quantities of the scene: the tension is the attractive force over that area. Sites and charges stay with the
surfaces, so that their densities fall as these stretch; radii stay. The force on a sphere with sites on its surface is
exact, :math:`F = -2\pi R\,[W(g_n) - W(g_n + 2R)]` with the energy W(g_n) between flats. Derjaguin's approximation drops
the second term.

Energies of two points at a distance are summed over two curved surfaces.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from typing import ClassVar

from surfacechem.contracts.terms import PairEnergy, Potential, option, parameter
from surfacechem.errors import InputError
from surfacechem.expressions import Expression, is_symbolic, log, monotone_cubics, positive, where
from surfacechem.tolerances import REPULSION_WALL

CONTACT_DISTANCE = 1.65e-10
"""Distance [m] of surfaces in contact that gives measured surface energies (Israelachvili 2011, ch. 13)."""


class LennardJones(Potential):
    """Sites on two surfaces that attract and, at short distance, repel each other; subclasses sum over all pairs.

    The sites stay with the surfaces: their densities are those on the reference area.
    """

    positive = ("g_n",)
    repelling: ClassVar[tuple[int, int]]
    """Divisor and power of the repulsion."""
    attracting: ClassVar[tuple[int, int]]
    """Divisor and power of the attraction."""
    strongest: ClassVar[float]
    """Gap over g_0 at the largest tension."""

    n_1: float = parameter("1/m^2", "density of interacting sites on body 1", at_least=0, stretch=-1)
    n_2: float = parameter("1/m^2", "density of interacting sites on body 2", at_least=0, stretch=-1)
    psi_0: float = parameter("J", "interaction energy of a pair", at_least=0)
    g_0: float = parameter("m", "range of the interaction", above=0)

    @property
    def stiffness(self) -> Expression:
        """A = 2 pi n_1 n_2 psi_0 [Pa/m]."""
        return 2 * math.pi * self.n_1 * self.n_2 * self.psi_0

    @property
    def peaks(self) -> Mapping[str, Expression]:
        """The gap at which the attraction is strongest."""
        return {"g_n": self.g_0 * self.strongest}

    def energy(self, g_n: Expression) -> Expression:
        """Free energy [J/m^2]."""
        return self._sum(g_n, self.repelling, self.attracting)

    def repulsion(self, g_n: Expression) -> Expression:
        """Energy of the repulsion [J/m^2]."""
        return self._sum(g_n, self.repelling)

    @abstractmethod
    def _sum(self, g_n: Expression, *terms: tuple[int, int]) -> Expression:
        """Energy of terms of the pair potential [J/m^2]."""


class LennardJonesFlatFlat(LennardJones):
    r"""Lennard-Jones type attraction and repulsion between sites on two flats.

    .. math::
        \Psi = A g_0^2 \left[ \frac1{360} \left( \frac{g_0}{g_n} \right)^8
        - \frac16 \left( \frac{g_0}{g_n} \right)^2 \right], \quad A = 2 \pi n_1 n_2 \psi_0

    The sum of :math:`\psi_{12} = \psi_0 [\frac1{45} (g_0/r)^{10} - \frac13 (g_0/r)^4]` over all pairs. No traction at
    :math:`g_0 15^{-1/6}`, where the adhesion energy is :math:`\frac{15^{1/3}}8 A g_0^2`; strength
    :math:`\frac{2\sqrt5}9 A g_0` at :math:`g_0 5^{-1/6}`. Source: Sauer, Duong & Mandadapu (2021), eqs. e:psi12ex and
    e:bt_sr. g_n > 0; below :math:`0.01\,g_0` the energy continues as a parabola. Per current area, with densities on
    the reference area.

    >>> flats = LennardJonesFlatFlat(n_1=2e19, n_2=3e19, psi_0=4e-21, g_0=3e-10)
    >>> round(flats.energy(g_n=3e-9), 12)
    -0.002261946673
    """

    per = "current"
    repelling, attracting, strongest = (360, 8), (-6, 2), 5 ** (-1 / 6)

    def _sum(self, g_n: Expression, *terms: tuple[int, int]) -> Expression:
        return self.stiffness * self.g_0**2 * _repelling(g_n / self.g_0, *terms)


class LennardJonesSpherePlane(LennardJones):
    r"""Lennard-Jones type attraction and repulsion between sites on a sphere and on a plane, exact.

    .. math::
        t_n = -\frac{2 \pi R}{a} [W(g_n) - W(g_n + 2R)], \quad
        \Psi = \frac{2 \pi R}{a} [V(g_n) - V(g_n + 2R)], \quad
        V = A g_0^3 \left[ \frac1{2520} \left( \frac{g_0}{g} \right)^7 - \frac16 \frac{g_0}{g} \right]

    W is the energy between flats. The double sum over all pairs, for any ratio of radius and gap. Source: integral of
    Sauer, Duong & Mandadapu (2021), eq. e:psi12ex, over sphere and plane. g_n > 0; below :math:`0.01\,g_0` the energy
    continues as a parabola.

    >>> tip = LennardJonesSpherePlane(n_1=2e19, n_2=3e19, psi_0=4e-21, g_0=3e-10, R=5e-8, area=1e-16)
    >>> f"{tip.energy(g_n=3e-9):.9g}"
    '-0.0206974228'
    """

    repelling, attracting, strongest = (2520, 7), (-6, 1), 15 ** (-1 / 6)

    R: float = parameter("m", "radius of the sphere", above=0)
    area: float = parameter("m^2", "reference area", above=0)

    def _sum(self, g_n: Expression, *terms: tuple[int, int]) -> Expression:
        near, far = (_repelling(gap / self.g_0, *terms) for gap in (g_n, g_n + 2 * self.R))
        return 2 * math.pi * self.R / self.area * self.stiffness * self.g_0**3 * (near - far)


class LennardJonesDerjaguin(LennardJonesSpherePlane):
    r"""Lennard-Jones type attraction and repulsion between a large sphere and a plane.

    .. math::
        t_n = -\frac{2 \pi R}{a} W(g_n), \quad
        \Psi = \frac{2 \pi R}{a} A g_0^3 \left[ \frac1{2520} \left( \frac{g_0}{g_n} \right)^7
        - \frac16 \frac{g_0}{g_n} \right]

    W is the energy between flats. Pull-off force :math:`2 \pi R` times the adhesion energy of flats. Two surfaces of
    radii :math:`R_1, R_2` count as one sphere of :math:`R_1 R_2 / (R_1 + R_2)`.
    Source: Derjaguin (1934), doi 10.1007/BF01433225, with Sauer, Duong & Mandadapu (2021), eq. e:psi12ex. g_n > 0, and
    R much larger than g_n: the error is about :math:`(g_n / 2R)^2` of the attraction.

    >>> tip = LennardJonesDerjaguin(n_1=2e19, n_2=3e19, psi_0=4e-21, g_0=3e-10, R=5e-8, area=1e-16)
    >>> f"{tip.energy(g_n=3e-9):.9g}"
    '-0.0213183455'
    """

    def _sum(self, g_n: Expression, *terms: tuple[int, int]) -> Expression:
        return 2 * math.pi * self.R / self.area * self.stiffness * self.g_0**3 * _repelling(g_n / self.g_0, *terms)


class Attraction(Potential):
    """A potential without repulsion, at any distance."""

    def repulsion(self) -> Expression:
        """Energy of the repulsion: zero."""
        return 0.0


class VanDerWaalsFlatFlat(Attraction):
    r"""Van der Waals attraction between two half-spaces.

    .. math:: \Psi = -\frac{A_H}{12 \pi (g_n + D_0)^2}, \quad t_n = \frac{A_H}{6 \pi (g_n + D_0)^3}

    The gap counts from contact, where the outermost atoms are :math:`D_0` apart: there the energy is the work of
    adhesion :math:`A_H / 12 \pi D_0^2`. Below contact the traction is constant; a law of contact has to bear it.

    Source: Hamaker (1937), doi 10.1016/S0031-8914(37)80203-7; cut-off of Israelachvili, Intermolecular and Surface
    Forces (2011), ch. 13. Not retarded: gaps below about 10 nm. Per current area.

    >>> round(VanDerWaalsFlatFlat(A_H=6.5e-20).energy(g_n=0.0), 6)
    -0.063331
    """

    per = "current"

    A_H: float = parameter("J", "Hamaker constant", at_least=0)
    D_0: float = parameter("m", "distance of the outermost atoms in contact", default=CONTACT_DISTANCE, above=0)

    def energy(self, g_n: Expression) -> Expression:
        """Free energy [J/m^2]."""
        distance = _nonnegative_gap(g_n) + self.D_0
        # Below contact the traction is constant: the energy continues along its tangent.
        contact = (2 * g_n / self.D_0 - 1) / self.D_0**2
        return self.A_H / (12 * math.pi) * where(g_n > 0, -1 / distance**2, contact)


class VanDerWaalsSpherePlane(Attraction):
    r"""Van der Waals attraction between a sphere and a half-space, exact.

    .. math::
        \Psi = -\frac{A_H}{6 a} \left[ \frac R h + \frac R{h + 2R} + \ln \frac h{h + 2R} \right], \quad
        t_n = \frac{2 A_H R^3}{3 a h^2 (h + 2R)^2}, \quad h = g_n + D_0

    For a large sphere :math:`a\,t_n = A_H R / 6 h^2`. The gap counts from contact, where the outermost atoms are
    :math:`D_0` apart. Below contact the traction is constant; a law of contact has to bear it.

    Source: Hamaker (1937), doi 10.1016/S0031-8914(37)80203-7. Not retarded: gaps below about 10 nm.

    >>> round(VanDerWaalsSpherePlane(A_H=6.5e-20, R=5e-8, area=1e-16).energy(g_n=0.0), 6)
    -0.032188
    """

    A_H: float = parameter("J", "Hamaker constant", at_least=0)
    R: float = parameter("m", "radius of the sphere", above=0)
    area: float = parameter("m^2", "reference area", above=0)
    D_0: float = parameter("m", "distance of the outermost atoms in contact", default=CONTACT_DISTANCE, above=0)

    def energy(self, g_n: Expression) -> Expression:
        """Free energy [J/m^2]."""
        slope = 4 * self.R**3 / (self.D_0**2 * (self.D_0 + 2 * self.R) ** 2)
        apart, contact = self._shape(_nonnegative_gap(g_n) + self.D_0), self._shape(self.D_0)
        return self.A_H / (6 * self.area) * where(g_n > 0, apart, contact + slope * g_n)

    def _shape(self, h: Expression) -> Expression:
        far = h + 2 * self.R
        return -self.R / h - self.R / far - log(h / far)


class ElectrostaticFlatFlat(Attraction):
    r"""Coulomb interaction of two charged flats.

    .. math:: \Psi = -\frac{s_1 s_2}{2 \varepsilon} g_n, \quad t_n = -\frac{s_1 s_2}{2 \varepsilon}

    Charges of equal sign repel. The traction is independent of the gap as long as the gap is much smaller than the
    flats. Source: Coulomb's law summed over two planes (Jackson, Classical Electrodynamics, 1999, ch. 1); Sauer, Duong
    & Mandadapu (2021), remark 5.9. Fixed charges; any g_n. Per current area, of charge densities on the reference area.

    >>> round(ElectrostaticFlatFlat(s_1=1e-4, s_2=-2e-4).energy(g_n=1e-6), 8)
    0.00112941
    """

    per = "current"

    s_1: float = parameter("C/m^2", "charge density of body 1", stretch=-1)
    s_2: float = parameter("C/m^2", "charge density of body 2", stretch=-1)
    epsilon: float = parameter("F/m", "permittivity of the medium", default=8.8541878128e-12, above=0)

    def energy(self, g_n: Expression) -> Expression:
        """Free energy [J/m^2]."""
        return -self.s_1 * self.s_2 / (2 * self.epsilon) * g_n


class ElectrostaticSpherePlane(Attraction):
    r"""Coulomb interaction of a sphere, charged on its surface, with a charged plane.

    .. math:: \Psi = -\frac{2 \pi R^2 s_1 s_2}{\varepsilon\,a} g_n

    Source: Coulomb's law summed over sphere and plane: the charge :math:`4 \pi R^2 s_1` in the field
    :math:`s_2 / 2 \varepsilon` of the plane (Jackson, Classical Electrodynamics, 1999, ch. 1). Fixed charges; any g_n.

    >>> round(ElectrostaticSpherePlane(s_1=1e-4, s_2=-2e-4, R=1e-6, area=1e-12).energy(g_n=1e-6), 8)
    0.01419257
    """

    s_1: float = parameter("C/m^2", "charge density of the sphere", stretch=-1)
    s_2: float = parameter("C/m^2", "charge density of the plane", stretch=-1)
    R: float = parameter("m", "radius of the sphere", above=0)
    area: float = parameter("m^2", "reference area", above=0)
    epsilon: float = parameter("F/m", "permittivity of the medium", default=8.8541878128e-12, above=0)

    def energy(self, g_n: Expression) -> Expression:
        """Free energy [J/m^2]."""
        return -2 * math.pi * self.R**2 * self.s_1 * self.s_2 / (self.epsilon * self.area) * g_n


def _nonnegative_gap(g_n: Expression) -> Expression:
    """Return the gap, for floats at least zero, since for them both branches of a conditional formula are evaluated."""
    return g_n if is_symbolic(g_n) else max(g_n, 0.0)


def _repelling(x: Expression, *terms: tuple[int, int]) -> Expression:
    """Return the sum of x^-n / d, continued by its parabola below REPULSION_WALL.

    Only trial states of a solver get there.
    """
    level, slope, curvature = (
        sum(math.prod(-n - i for i in range(order)) * REPULSION_WALL ** (-n - order) / d for d, n in terms)
        for order in range(3)
    )
    # For floats both branches are evaluated, and the powers of a small gap would overflow.
    inside, beyond = x if is_symbolic(x) else max(x, REPULSION_WALL), x - REPULSION_WALL
    powers = sum(inside**-n / d for d, n in terms)
    return where(x > REPULSION_WALL, powers, level + beyond * (slope + beyond * curvature / 2))


class InversePower(PairEnergy):
    r"""A power of the distance; the sum of two of them is a Mie potential.

    .. math:: \psi = \psi_0 (r_0 / r)^m

    Source: Mie (1903), doi 10.1002/andp.19033160802. Repels where :math:`\psi_0 > 0`. m > 2, so that a point next to a
    plane has a finite energy.

    >>> InversePower(n_1=1e18, n_2=1e18, psi_0=-4e-21, r_0=1e-9, m=6).energy(2e-9)
    -6.25e-23
    """

    psi_0: float = parameter("J", "energy at the distance r_0, negative where it attracts", varies=False)
    r_0: float = parameter("m", "distance at which the energy is psi_0", above=0, varies=False)
    m: float = parameter("1", "power of the distance", above=2, varies=False)

    def energy(self, r: Expression) -> Expression:
        """Return the energy of a pair [J]."""
        return self.psi_0 * (self.r_0 / r) ** self.m

    @property
    def decay(self) -> float:  # type: ignore[override]
        """The power."""
        return self.m

    def parts(self, unit: float) -> Sequence[tuple[Expression, PairEnergy]]:
        """Return the terms of the energy: factor and law of each."""
        return [(self.psi_0 * (self.r_0 / unit) ** self.m, _power(self.m, unit))]


class LennardJonesPair(PairEnergy):
    r"""Attraction and, nearer, repulsion of Lennard-Jones type.

    .. math:: \psi = \psi_0 \left[ \tfrac1{45} (g_0/r)^{10} - \tfrac13 (g_0/r)^4 \right]

    Source: Sauer, Duong & Mandadapu (2021), eq. e:psi12ex.

    >>> f"{LennardJonesPair(n_1=2e19, n_2=3e19, psi_0=4e-21, g_0=3e-10).energy(3e-10):.6g}"
    '-1.24444e-21'
    """

    psi_0: float = parameter("J", "interaction energy of a pair", above=0, varies=False)
    g_0: float = parameter("m", "range of the interaction", above=0, varies=False)

    def energy(self, r: Expression) -> Expression:
        """Return the energy of a pair [J]."""
        return self.psi_0 * ((self.g_0 / r) ** 10 / 45 - (self.g_0 / r) ** 4 / 3)

    def parts(self, unit: float) -> Sequence[tuple[Expression, PairEnergy]]:
        """Return the terms of the energy: factor and law of each."""
        ratio = self.g_0 / unit
        return [(self.psi_0 * ratio**10 / 45, _power(10, unit)), (-self.psi_0 * ratio**4 / 3, _power(4, unit))]


class PenaltyPair(PairEnergy):
    r"""Repulsion of points that are nearer than a distance.

    .. math:: \psi = \tfrac12 k \langle r_0 - r \rangle^2

    Source: the penalty of contact mechanics (Wriggers, Computational Contact Mechanics, 2006) for pairs of points.

    >>> PenaltyPair(n_1=1e18, n_2=1e18, k=2.0, r_0=3.0).energy(1.0)
    4.0
    """

    k: float = parameter("N/m", "stiffness of a pair", above=0, varies=False)
    r_0: float = parameter("m", "distance below which points repel", above=0, varies=False)

    def energy(self, r: Expression) -> Expression:
        """Return the energy of a pair [J]."""
        return self.k / 2 * positive(self.r_0 - r) ** 2

    @property
    def cutoff(self) -> float:  # type: ignore[override]
        """Cutoff distance [m]."""
        return self.r_0


class PairTable(PairEnergy):
    r"""A law of distance given by a table.

    .. math:: \psi = \text{cubics through } (r_i, \psi_i), \quad 0 \text{ beyond the last}

    Source: Fritsch & Butland (1984), doi 10.1137/0905021, for cubics that keep their order. Nearer than the first point
    the energy goes on in proportion to a power of the distance, that of the first two points.

    >>> law = PairTable(n_1=1e18, n_2=1e18, distances=[1e-10, 2e-10, 4e-10], energies=[4e-21, 1e-21, 0.0])
    >>> round(law.energy(5e-11) / 4e-21, 12), law.energy(5e-10)
    (4.0, 0.0)
    """

    distances: Sequence[float] = option("distances, increasing [m]")
    energies: Sequence[float] = option("energies of a pair there, the last of them zero [J]")

    def __post_init__(self) -> None:
        """Check that the distances and energies are a table."""
        super().__post_init__()
        r, psi = self.distances, self.energies
        if len(r) != len(psi) or len(r) < 3:
            raise InputError(f"a table needs as many distances ({len(r)}) as energies ({len(psi)}), at least 3.")
        if not all(map(math.isfinite, (*r, *psi))) or any(b <= a for a, b in zip((0.0, *r), r, strict=False)):
            raise InputError("distances and energies must be finite, and the distances positive and increasing.")
        if psi[-1] != 0:
            raise InputError(f"the last energy is {psi[-1]:g} J: let the table go on to where it is zero.")
        if psi[0] * psi[1] <= 0:
            text = f"the first two energies, {psi[0]:g} and {psi[1]:g} J, have no sign in common"
            raise InputError(f"{text}, so that no power of the distance goes on nearer: let the table begin nearer.")

    @property
    def cutoff(self) -> float:  # type: ignore[override]
        """Cutoff distance [m]."""
        return self.distances[-1]

    @property
    def kinks(self) -> Mapping[str, Sequence[float]]:
        """The distances of the table, between which it is smooth."""
        return {"r": tuple(self.distances)}

    def energy(self, r: Expression) -> Expression:
        """Return the energy of a pair [J]."""
        x, psi = self.distances, self.energies
        power = math.log(psi[0] / psi[1]) / math.log(x[0] / x[1])
        return monotone_cubics(r, x, psi, psi[0] * (r / x[0]) ** power, 0.0 * r)


def _power(m: float, unit: float) -> PairEnergy:
    """Return the pure power of the distance over a unit of length."""
    return InversePower(n_1=1.0, n_2=1.0, psi_0=1.0, r_0=unit, m=m)
