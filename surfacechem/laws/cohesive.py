"""Bonds that give way under load: cohesive zones, adhesion intensity, compliant debonding, tensile strength."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import ClassVar

from surfacechem.contracts.terms import Limit, RateLaw, TangentialPotential, parameter
from surfacechem.expressions import EXPONENT_CAP, Expression, decay, positive, sqrt, where

CLOSED_GAP = 1e-16
"""Mixed gap over g_0 that regularises a closed zone, whose direction is undefined: its square is far below the rounding
of one."""


class ExponentialCohesiveZone(TangentialPotential):
    r"""Exponential cohesive law of the gap in tension and shear, elastic contact in compression.

    .. math::
        \Psi = -t_{max} (g + g_0) e^{1 - g/g_0} + \tfrac12 E_n \langle -g_n \rangle^2, \quad
        g = \sqrt{\langle g_n \rangle^2 + g_t^2}, \quad
        (t_n, t_t) = t_{max} \frac{(g_n, g_t)}{g_0} e^{1 - g/g_0} \quad \text{for } g_n > 0

    Shear takes part where the scene has a tangential gap; without one :math:`g = \langle g_n \rangle`. The strength
    :math:`t_{max}` is reached at :math:`g = g_0` in any direction; the work of separation is :math:`e\,t_{max} g_0`.
    Both may vary with temperature and bonding state; the entropy, heat capacity and chemical potential follow. With
    :math:`t_{max} \propto T_0/T` the zone has a positive capacity and cools as it opens; a strength concave in T
    reduces the capacity.

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
        """The gaps at the strength; and zero shear, the peak and kink of the stiffness of a compressed zone."""
        return {"g_n": self.g_0, "g_t": (-self.g_0, 0.0, self.g_0)}

    def energy(self, g_n: Expression, g_t: Expression | None = None) -> Expression:
        """Free energy [J/m^2]."""
        touching, contact = math.e * self.t_max * self.g_0, self.E_n * g_n**2 / 2
        # Without shear no root is needed; at a closed zone its slope would be roundoff.
        if g_t is None or g_t == 0:
            return where(g_n > 0, -touching * _separated(g_n / self.g_0), contact - touching)
        square = where(g_n > 0, g_n**2, 0) + g_t**2
        apart = sqrt(square / self.g_0**2 + CLOSED_GAP**2)
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
    below :math:`g_n = -300\,g_0` it continues along its tangent.

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
        u, falling = g_n / self.g_0, decay(g_n / self.g_0)
        # Below -EXPONENT_CAP the energy continues along its tangent.
        level = constant - linear * EXPONENT_CAP
        tangent = math.exp(EXPONENT_CAP) * (level + (linear - level) * (u + EXPONENT_CAP))
        return self.Phi_n * where(u > -EXPONENT_CAP, constant * falling + linear * u * falling, tangent)


def _separated(u: Expression) -> Expression:
    """(1 + u) exp(-u), written so that its derivatives do not cancel."""
    falling = decay(u)
    return falling + u * falling


class AdhesionIntensity(TangentialPotential):
    r"""Elastic adhesion whose intensity, between zero and one, is the bonding state.

    .. math::
        \Psi = \tfrac12 \phi^2 \left( C_N \langle g_n \rangle^2 + C_T g_t^2 \right)
        + \tfrac12 E_n \langle -g_n \rangle^2 - w \phi

    Tension is :math:`C_N \phi^2 g_n`. Adhesion begins to break at :math:`C_N g_n^2 + C_T g_t^2 = w / \phi`, and w is
    Dupré's energy. Contact in compression is elastic and keeps its stiffness; the original is rigid, the limit of large
    :math:`E_n`. For an energy of adhesion that is not linear add a bond energy.

    In parallel with friction :math:`g_t` is the whole displacement. Friction acts on the unbonded fraction,
    :math:`t_t = \phi^2 C_T g_t + (1 - \phi)\,t_f`. Shear from complete adhesion therefore peaks no lower than without
    friction, at :math:`\sqrt{w\,C_T}` for loss without delay, and ends on the plateau of friction.

    Source: Raous, Cangémi & Cocu (1999), doi 10.1016/S0045-7825(98)00389-2, after Frémond (1987); friction on the
    part :math:`1 - \phi` as in Raous & Monerie (2002), in Contact Mechanics (Kluwer). Any gaps.

    >>> AdhesionIntensity(C_N=1e12, C_T=1e12, w=1.0, E_n=1e14).energy(g_n=1e-6, g_t=0.0, phi=0.5)
    -0.375
    """

    C_N: float = parameter("Pa/m", "normal stiffness of complete adhesion", at_least=0)
    C_T: float = parameter("Pa/m", "tangential stiffness of complete adhesion", at_least=0)
    w: float = parameter("J/m^2", "Dupré energy of adhesion", at_least=0)
    E_n: float = parameter("Pa/m", "contact stiffness in compression", at_least=0)

    def energy(self, g_n: Expression, g_t: Expression, phi: Expression) -> Expression:
        """Free energy [J/m^2]."""
        normal = where(g_n > 0, self.C_N * phi**2, self.E_n) * g_n**2
        return (normal + self.C_T * phi**2 * g_t**2) / 2 - self.w * phi

    def unbonded(self, phi: Expression) -> Expression:
        """Fraction of the interface on which friction acts."""
        return 1 - phi


class AdhesionLoss(RateLaw):
    r"""Viscous and irreversible loss of adhesion.

    .. math:: b\,\dot\phi = -\langle M \rangle, \quad M = \partial \Psi / \partial \phi = N_c\,\mu

    With the potential of adhesion intensity, :math:`b\,\dot\phi = -\langle (C_N g_n^2 + C_T g_t^2) \phi - w \rangle`.
    Lost adhesion does not heal: the rate is zero where adhesion would grow. For adhesion that heals use the linear law
    with :math:`c_r = N_c / b`.

    Source: Raous, Cangémi & Cocu (1999), doi 10.1016/S0045-7825(98)00389-2, with the exponent p = 1. Admissible.

    >>> AdhesionLoss(b=2.0).rate(mu=1.5e-18, n_c=1e18, N_c=1e18), AdhesionLoss(b=2.0).rate(mu=-1.0, n_c=1e18, N_c=1e18)
    (-7.5e+17, 0.0)
    """

    b: float = parameter("J s/m^2", "viscosity of adhesion", above=0)

    kinks: ClassVar[Mapping[str, float]] = {"mu": 0.0}
    """Zero chemical potential, at which loss ends."""

    def rate(self, mu: Expression, n_c: Expression, N_c: Expression) -> Expression:
        """Net rate [1/(m^2 s)]."""
        return -n_c * positive(N_c * mu) / self.b


class CompliantDebonding(RateLaw):
    r"""Bonds break as the gap opens, so that the traction falls along a line to zero.

    .. math:: \phi \le \phi_{env}(g_n) = \frac{t_{max}}{E_b\,g_n}\,\frac{g_f - g_n}{g_f - g_c}, \quad
              g_c = \frac{t_{max}}{E_b}, \quad \dot\phi = \min(R_o / n_c, \dot\phi_{env}) \text{ on the envelope}

    where :math:`R_o` is the net rate of all other bonding laws. On the envelope bonds break at the rate at which it
    falls and other laws form bonds; phi leaves the envelope if this rises faster than they form bonds, or falls more
    slowly than they break bonds. Beyond :math:`g_f` no bond forms. With the potential :math:`\tfrac12 \phi E_b g_n^2`
    the traction is the bilinear law of cohesive zones: it peaks at :math:`t_{max}` and ends at :math:`g_f`; unloading
    is linear to zero gap with the stiffness :math:`\phi E_b`. Without other laws debonding is irreversible.
    Source: Sauer, Duong & Mandadapu (2021), section 5.2 (the path of finite slope); bilinear form as in Camanho &
    Davila (2002), NASA/TM-2002-211737. :math:`g_f > g_c`; :math:`E_b` is that of the potential. Admissible where the
    elastic energy of a bond exceeds its bond energy.

    >>> law = CompliantDebonding(t_max=1e6, E_b=1e14, g_f=5e-8)
    >>> law.envelope(g_n=1e-8), round(law.envelope(g_n=3e-8), 12)
    (1.0, 0.166666666667)
    """

    t_max: float = parameter("Pa", "tensile strength", above=0, stretch=1)
    E_b: float = parameter("Pa/m", "stiffness of complete bonding, per reference area", above=0)
    g_f: float = parameter("m", "gap at which the last bonds break", above=0)

    def peak(self) -> Expression:
        """Return the gap at which complete bonding begins to break [m]."""
        return self.t_max / self.E_b

    def envelope(self, g_n: Expression) -> Expression:
        """Return the largest bonding state at a gap; it falls through zero where the last bonds break."""
        start = self.peak()
        # Below half the gap at the strength all bonds hold, and the value is not used.
        gap = where(g_n > start / 2, g_n, start / 2)
        return start / gap * (self.g_f - gap) / (self.g_f - start)

    def rate(self, n_c: Expression, softening: Expression, overshoot: Expression) -> Expression:
        """Net rate [1/(m^2 s)]; ``overshoot`` is the rate at which phi would exceed the envelope [1/s]."""
        return -n_c * softening * overshoot


class TensileStrength(Limit):
    r"""Tension at which all bonds break at once.

    .. math:: t_n \le t_n^{max}(T_c, \phi)

    Beyond it :math:`\phi = 0` and the interface is no longer bonded. The strength may vary with temperature and bonding
    state through factors, for instance :math:`t_n^{max} = \phi\,(T_0/T_c)\,t_0^{max}`.
    Source: Sauer, Duong & Mandadapu (2021), eq. e:debond.

    >>> TensileStrength(t_max=2e6).strength()
    2000000.0
    """

    t_max: float = parameter("Pa", "tensile strength", at_least=0)

    def strength(self) -> Expression:
        """Strength [Pa]."""
        return self.t_max
