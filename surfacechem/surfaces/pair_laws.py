"""Energies of two points at a distance, to be summed over two surfaces: Lennard-Jones, powers, penalty, tables."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cached_property

from surfacechem.contracts.terms import PairEnergy, option, parameter
from surfacechem.errors import InputError
from surfacechem.expressions import Expression, positive, where


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

    @cached_property
    def cubics(self) -> list[list[float]]:
        """Coefficients between the points, that of the third power first."""
        from scipy.interpolate import PchipInterpolator

        coefficients: list[list[float]] = PchipInterpolator(self.distances, self.energies).c.T.tolist()
        return coefficients

    def energy(self, r: Expression) -> Expression:
        """Return the energy of a pair [J]."""
        x, psi = self.distances, self.energies
        result = 0.0 * r
        for low, high, (a, b, c, d) in reversed(list(zip(x, x[1:], self.cubics, strict=False))):
            z = r - low
            result = where(r < high, d + z * (c + z * (b + z * a)), result)
        power = math.log(psi[0] / psi[1]) / math.log(x[0] / x[1])
        return where(r < x[0], psi[0] * (r / x[0]) ** power, result)


def _power(m: float, unit: float) -> PairEnergy:
    """Return the pure power of the distance over a unit of length."""
    return InversePower(n_1=1.0, n_2=1.0, psi_0=1.0, r_0=unit, m=m)
