"""Cohesive zones: potentials whose traction rises to a strength and falls to nothing as the gap opens."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from surfacechem.contracts.terms import TangentialPotential, parameter
from surfacechem.expressions import EXPONENT_CAP, Expression, decay, sqrt, where

CLOSED = 1e-16
"""Mixed gap over g_0 of a closed zone, whose direction is undefined: its square is far below the rounding of one."""


class ExponentialCohesiveZone(TangentialPotential):
    r"""Exponential cohesive law of the gap in tension and shear, elastic contact in compression.

    .. math::
        \Psi = -t_{max} (g + g_0) e^{1 - g/g_0} + \tfrac12 E_n \langle -g_n \rangle^2, \quad
        g = \sqrt{\langle g_n \rangle^2 + g_t^2}, \quad
        (t_n, t_t) = t_{max} \frac{(g_n, g_t)}{g_0} e^{1 - g/g_0} \quad \text{for } g_n > 0

    Shear takes part where the scene has a tangential gap; without one :math:`g = \langle g_n \rangle`. The strength
    :math:`t_{max}` is reached at :math:`g = g_0` in any direction; the work of separation is :math:`e\,t_{max} g_0`.
    Both may vary with temperature and bonding state; the entropy, heat capacity and chemical potential that go with it
    follow. With :math:`t_{max} \propto T_0/T` the zone has a positive capacity and cools where it opens; a strength
    concave in T takes capacity away.

    Source: Sauer, Duong & Mandadapu (2021), eqs. ex:psi_czm and ex:bt_czm, with the sign of tension and a signed
    normal gap: with its magnitude in the norm the zone would soften in compression too. Any g_n, g_t; reversible.
    Per current area.

    >>> zone = ExponentialCohesiveZone(t_max=1e6, g_0=1e-8, E_n=1e15)
    >>> round(zone.energy(g_n=0.0), 10), round(zone.energy(g_n=1e-8), 10)
    (-0.0271828183, -0.02)
    >>> round(zone.energy(g_n=0.6e-8, g_t=0.8e-8), 10), round(zone.energy(g_n=-1e-8, g_t=1e-8), 10)
    (-0.02, 0.03)
    """

    per = "current"

    t_max: float = parameter("Pa", "strength, largest tensile traction", at_least=0)
    g_0: float = parameter("m", "gap at the strength", above=0)
    E_n: float = parameter("Pa/m", "contact stiffness in compression", at_least=0)

    @property
    def peaks(self) -> Mapping[str, Expression | Sequence[Expression]]:
        """The gaps at the strength; and no shear, where the stiffness of a pressed zone has its peak and bends."""
        return {"g_n": self.g_0, "g_t": (-self.g_0, 0.0, self.g_0)}

    def energy(self, g_n: Expression, g_t: Expression | None = None) -> Expression:
        """Free energy [J/m^2]."""
        touching, contact = math.e * self.t_max * self.g_0, self.E_n * g_n**2 / 2
        if g_t is None or g_t == 0:
            return where(g_n > 0, -touching * _separated(g_n / self.g_0), contact - touching)
        square = where(g_n > 0, g_n**2, 0) + g_t**2
        apart = sqrt(square / self.g_0**2 + CLOSED**2)
        return where(g_n > 0, 0, contact) - touching * _separated(apart)


class XuNeedleman(TangentialPotential):
    r"""Cohesive zone that couples opening and sliding.

    .. math::
        \Psi = \Phi_n e^{-u} \left\{ (1 - r + u) \frac{1 - q}{r - 1}
        - \left[ q + \frac{r - q}{r - 1} u \right] e^{-w^2} \right\}, \quad
        u = \frac{g_n}{g_0},\; w = \frac{g_t}{g_{t0}}

    The energy of complete separation is zero. :math:`\Phi_n = e\,t_{max} g_0` is the work of normal separation, q the
    ratio of tangential to normal work, r the opening after complete shear without normal traction, over :math:`g_0`.
    The tangential strength is :math:`q \Phi_n \sqrt{2/e} / g_{t0}`. Contact in compression is the same exponential;
    below :math:`g_n = -300\,g_0` it continues as its tangent.

    Source: Xu & Needleman (1993), doi 10.1088/0965-0393/1/2/001. Any g_n, g_t; r other than 1. For q other than 1 the
    coupling is known to be weakly founded: incomplete sliding can leave more normal work than there was
    (van den Bosch, Schreurs & Geers, Engineering Fracture Mechanics 73, 2006). Reversible. Per current area.

    >>> zone = XuNeedleman(Phi_n=0.1, g_0=1e-8, g_t0=2e-8)
    >>> zone.energy(g_n=0.0, g_t=0.0), round(zone.energy(g_n=1e-8, g_t=2e-8), 10)
    (-0.1, -0.0270670566)
    """

    per = "current"

    Phi_n: float = parameter("J/m^2", "work of normal separation", at_least=0)
    g_0: float = parameter("m", "normal gap at the normal strength", above=0)
    g_t0: float = parameter("m", "characteristic tangential gap", above=0)
    q: float = parameter("1", "tangential over normal work of separation", default=1.0, at_least=0)
    r: float = parameter("1", "normal gap over g_0 after complete shear at zero normal traction", default=0.0)

    @property
    def peaks(self) -> Mapping[str, Expression | Sequence[Expression]]:
        """The gaps at the strengths, normal and tangential."""
        return {"g_n": self.g_0, "g_t": (-self.g_t0 / math.sqrt(2), self.g_t0 / math.sqrt(2))}

    def energy(self, g_n: Expression, g_t: Expression) -> Expression:
        """Free energy [J/m^2]."""
        shear = decay((g_t / self.g_t0) ** 2)
        ratio = (1 - self.q) / (self.r - 1)
        constant = (1 - self.r) * ratio - self.q * shear
        linear = ratio - (self.r - self.q) / (self.r - 1) * shear
        return self.Phi_n * _decaying(g_n / self.g_0, constant, linear)


def _separated(u: Expression) -> Expression:
    """(1 + u) exp(-u), written so that its derivatives do not cancel."""
    falling = decay(u)
    return falling + u * falling


def _decaying(u: Expression, constant: Expression, linear: Expression) -> Expression:
    """(constant + linear * u) exp(-u), continued by its tangent below -EXPONENT_CAP."""
    bare = decay(u)
    top, beyond = math.exp(EXPONENT_CAP), u + EXPONENT_CAP
    level = constant - linear * EXPONENT_CAP
    return where(u > -EXPONENT_CAP, constant * bare + linear * u * bare, top * (level + (linear - level) * beyond))
