"""Sliding friction and the traction that sticking bears: dry, viscous, bonded, rate-and-state, anisotropic."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from typing import ClassVar

from surfacechem.contracts.terms import Friction, UnderPressure, parameter
from surfacechem.expressions import Expression, absolute, asinh_exp, decay, exp, log, power, sinh_exp, where
from surfacechem.tolerances import TINY


class Coulomb(UnderPressure, Friction):
    r"""Amontons-Coulomb dry friction.

    .. math:: t_t = \mu\,p\,\mathrm{sgn}(v), \quad |t_t| \le \mu_s\,p \text{ while sticking}

    Source: Sauer, Duong & Mandadapu (2021), eqs. e:dry_fric and e:tt_max. Any v; p >= 0. Dissipates
    :math:`t_t v \ge 0`. Without a static coefficient, or with one below mu, the interface sticks up to mu p; `check`
    and the run report the latter.

    >>> Coulomb(mu=0.3).traction(p=1e5, direction=1.0), Coulomb(mu=0.3, mu_s=0.5).limit(p=1e5)
    (30000.0, 50000.0)
    """

    nonnegative = ("p",)

    mu: float = parameter("1", "sliding friction coefficient", at_least=0)
    mu_s: float | None = parameter("1", "static friction coefficient; mu if not given", default=None, at_least=0)

    def traction(self, p: Expression, direction: Expression) -> Expression:
        """Tangential traction [Pa]."""
        return self.mu * p * direction

    def limit(self, p: Expression) -> Expression:
        """Largest tangential traction [Pa] that sticking bears."""
        return (self.mu if self.mu_s is None else self.mu_s) * p


class MohrCoulomb(UnderPressure, Friction):
    r"""Dry friction with adhesion: it acts without pressure too, and in tension up to the adhesive strength.

    .. math:: t_t = [\mu \langle p + t_n^{max} \rangle + c]\,\mathrm{sgn}(v)

    While sticking :math:`|t_t| \le \mu_s \langle p + t_n^{max} \rangle + c`. Adhesion acts through :math:`t_n^{max}`,
    as in tribology, or through c, as in soil mechanics: for constant coefficients :math:`c = \mu\,t_n^{max}` is the
    same law. If sliding breaks all bonds, a strength proportional to :math:`\phi` vanishes; let bonds survive sliding
    or keep a part of the strength that does not depend on them.

    Source: Sauer, Duong & Mandadapu (2021), eq. e:M-C; Derjaguin (1934), doi 10.1007/BF01333114. Any v;
    :math:`p \ge -t_n^{max}`. An opening gap carries the contact beyond its strength, where only c remains; a pressure
    prescribed there is refused. Dissipates :math:`t_t v \ge 0`.

    >>> MohrCoulomb(mu=0.5, t_n_max=2e4).traction(p=-1e4, direction=1.0)
    5000.0
    """

    nonnegative = ("p",)

    mu: float = parameter("1", "sliding friction coefficient", at_least=0)
    t_n_max: float = parameter("Pa", "adhesive tensile strength", default=0.0, at_least=0)
    c: float = parameter("Pa", "shear strength without pressure (cohesion)", default=0.0, at_least=0)
    mu_s: float | None = parameter("1", "static friction coefficient; mu if not given", default=None, at_least=0)

    @property
    def least(self) -> Mapping[str, Expression]:
        """The tension equal to the adhesive strength."""
        return {"p": -self.t_n_max}

    @property
    def kinks(self) -> Mapping[str, Expression]:
        """The tension beyond which only cohesion remains."""
        return {"p": -self.t_n_max}

    def traction(self, p: Expression, direction: Expression) -> Expression:
        """Tangential traction [Pa]."""
        return (self.mu * self._pressed(p) + self.c) * direction

    def limit(self, p: Expression) -> Expression:
        """Largest tangential traction [Pa] that sticking bears."""
        return (self.mu if self.mu_s is None else self.mu_s) * self._pressed(p) + self.c

    def _pressed(self, p: Expression) -> Expression:
        """Pressure beyond the adhesive strength [Pa]; one at zero grows or falls, as a contact begins."""
        return where(p < -self.t_n_max, 0 * p, p + self.t_n_max)


class Stribeck(UnderPressure, Friction):
    r"""Friction that falls from its static to its sliding value with velocity, and rises again in a full film.

    .. math:: t_t = \left[ \mu_k + (\mu_s - \mu_k) e^{-|v / v_s|^\delta} \right] p\,\mathrm{sgn}(v) + c_v v

    Source: Armstrong-Hélouvry, Dupont & Canudas de Wit (1994), doi 10.1016/0005-1098(94)90209-7; named in Sauer, Duong
    & Mandadapu (2021), remark 5.12. Any v; p >= 0. Dissipates :math:`t_t v \ge 0`. If the traction falls faster with
    velocity than the traction of a damper grows, steady sliding is unstable.

    >>> round(Stribeck(mu_s=0.6, mu_k=0.4, v_s=1e-3).traction(p=1e5, v=1e-3, direction=1.0), 6)
    47357.588823
    """

    nonnegative = ("p",)
    rest_exponent = "delta"

    mu_s: float = parameter("1", "friction coefficient at rest", at_least=0)
    mu_k: float = parameter("1", "friction coefficient of fast sliding", at_least=0)
    v_s: float = parameter("m/s", "Stribeck velocity", above=0)
    delta: float = parameter("1", "exponent of the fall", default=2.0, above=0)
    c_v: float = parameter("Pa s/m", "viscous resistance", default=0.0, at_least=0)

    def traction(self, p: Expression, v: Expression, direction: Expression) -> Expression:
        """Tangential traction [Pa]."""
        # decay needs no cap, since the exponent is never positive, so that like terms combine in slopes. For delta >= 1
        # the slope of the power at rest is the limit from positive speeds; for delta < 1 it is infinite.
        ahead = absolute(v) / self.v_s + where(self.delta < 1, 0, TINY)
        fall = decay(power(ahead, self.delta))
        return (self.mu_k + (self.mu_s - self.mu_k) * fall) * p * direction + self.c_v * v

    def limit(self, p: Expression) -> Expression:
        """Largest tangential traction [Pa] that sticking bears."""
        return self.mu_s * p

    def fast(self, p: Expression) -> Expression:
        """Dry traction of fast sliding [Pa]."""
        return self.mu_k * p


class BondedCoulomb(UnderPressure, Friction):
    r"""Dry friction whose static coefficient grows with the bonding state and falls with temperature.

    .. math:: |t_t| \le \mu_0\,p \text{ while sticking}, \quad
        \mu_0 = [\phi \mu_b + (1 - \phi) \mu_{ub}] \frac{T_0}{T_c}, \quad t_t = \mu\,p\,\mathrm{sgn}(v)

    Bonds break as sliding starts. If :math:`\mu_0` falls below :math:`\mu`, as on heating, the limit of sticking is
    :math:`\mu p`, and the run reports it. Source: Sauer, Duong & Mandadapu (2021), eqs. e:mu0 and e:dry_fric. Any v; p
    >= 0. Dissipates :math:`t_t v \ge 0`.

    >>> BondedCoulomb(mu=0.3, mu_b=0.7, mu_ub=0.3).limit(p=1e5, phi=0.5, T_c=300.0, T_0=300.0)
    50000.0
    """

    nonnegative = ("p",)
    breaks_bonds = True

    mu: float = parameter("1", "sliding friction coefficient", at_least=0)
    mu_b: float = parameter("1", "static friction coefficient of complete bonding at T_0", at_least=0)
    mu_ub: float = parameter("1", "static friction coefficient without bonds at T_0", at_least=0)

    def traction(self, p: Expression, direction: Expression) -> Expression:
        """Tangential traction [Pa]."""
        return self.mu * p * direction

    def limit(self, p: Expression, phi: Expression, T_c: Expression, T_0: Expression) -> Expression:
        """Largest tangential traction [Pa] that sticking bears."""
        return (phi * self.mu_b + (1 - phi) * self.mu_ub) * T_0 / T_c * p


class Viscous(Friction):
    r"""Newtonian film that fills the gap.

    .. math:: t_t = \eta\,v / g_n

    Source: Sauer, Duong & Mandadapu (2021), eq. e:visc_fric (with eta in Pa s). Any v; g_n > 0. Dissipates
    :math:`t_t v \ge 0`. Zero at rest.

    >>> Viscous(eta=0.5).traction(g_n=1e-6, v=0.25)
    125000.0
    """

    positive = ("g_n",)

    eta: float = parameter("Pa s", "film viscosity", at_least=0)

    def traction(self, g_n: Expression, v: Expression) -> Expression:
        """Tangential traction [Pa]."""
        return self.eta * v / g_n


LEAST_VELOCITY = 1e-300
"""Sliding velocity [m/s] that counts as zero in a logarithm."""


class RateAndState(UnderPressure, Friction):
    """Traction of both forms of rate-and-state friction, regularised at rest."""

    nonnegative = ("p",)
    internal: ClassVar[Mapping[str, str]] = {"ln_theta": "theta"}
    reference_velocity = "v_0"

    mu_0: float = parameter("1", "steady friction coefficient at v_0", above=0)
    a: float = parameter("1", "direct effect of velocity", above=0)
    b: float = parameter("1", "effect of the age of the contact", at_least=0)
    L: float = parameter("m", "slip over which the contact forgets", above=0)
    v_0: float = parameter("m/s", "velocity of reference", above=0)

    def traction(self, p: Expression, v: Expression, ln_theta: Expression) -> Expression:
        """Tangential traction [Pa]."""
        return self.driven(p, self.drive(v, ln_theta))

    def driven(self, p: Expression, drive: Expression) -> Expression:
        """Tangential traction [Pa] from the drive, the traction in units of the direct effect, a p."""
        return self.a * p * drive

    def drive(self, v: Expression, ln_theta: Expression) -> Expression:
        """Drive at a velocity: the traction in units of the direct effect, a p."""
        # asinh_exp, since the exponential may overflow while the product does not: a contact of a year at rest.
        return asinh_exp(v / (2 * self.v_0), self._strength(ln_theta))

    def velocity(self, drive: Expression, ln_theta: Expression) -> Expression:
        """Sliding velocity [m/s] at a traction in units of the direct effect: the inverse of :meth:`drive`."""
        return 2 * self.v_0 * sinh_exp(drive, -self._strength(ln_theta))

    def _strength(self, ln_theta: Expression) -> Expression:
        return (self.mu_0 + self.b * (log(self.v_0 / self.L) + ln_theta)) / self.a

    @abstractmethod
    def evolution(self, v: Expression, ln_theta: Expression) -> Mapping[str, Expression]:
        """Rate of the logarithm of the age [1/s]."""


class RateAndStateAging(RateAndState):
    r"""Rate-and-state friction whose contacts strengthen at rest (Dieterich's aging law).

    .. math:: t_t = a\,p\,\operatorname{arsinh}\left[\frac{v}{2 v_0}
              \exp\frac{\mu_0 + b \ln(v_0\theta/L)}{a}\right], \quad \dot\theta = 1 - \frac{|v|\,\theta}{L}

    For :math:`v > 0` this is :math:`\mu_0 + a\ln(v/v_0) + b\ln(v_0\theta/L)` times p. Velocity-weakening if b > a:
    steady sliding is then unstable below the stiffness :math:`(b - a)\,p / L`. Source: Dieterich (1979), doi
    10.1029/JB084iB05p02161; Ruina (1983), doi 10.1029/JB088iB12p10359; regularised as in Rice & Ben-Zion (1996), doi
    10.1073/pnas.93.9.3811. Any v; p >= 0. Dissipates :math:`t_t v \ge 0`.

    >>> law = RateAndStateAging(mu_0=0.6, a=0.01, b=0.015, L=1e-5, v_0=1e-6)
    >>> round(law.traction(p=1e6, v=1e-6, ln_theta=2.302585092994046), 3)
    600000.0
    """

    def evolution(self, v: Expression, ln_theta: Expression) -> Mapping[str, Expression]:
        """Rate of the logarithm of the age [1/s]."""
        return {"ln_theta": exp(-ln_theta) - absolute(v) / self.L}


class RateAndStateSlip(RateAndState):
    r"""Rate-and-state friction whose contacts change by slip only (Ruina's slip law).

    .. math:: t_t = a\,p\,\operatorname{arsinh}\left[\frac{v}{2 v_0}
              \exp\frac{\mu_0 + b \ln(v_0\theta/L)}{a}\right], \quad
              \dot\theta = -\frac{|v|\,\theta}{L} \ln\frac{|v|\,\theta}{L}

    Source: Ruina (1983), doi 10.1029/JB088iB12p10359; regularised as in Rice & Ben-Zion (1996),
    doi 10.1073/pnas.93.9.3811. Any v; p >= 0. Dissipates :math:`t_t v \ge 0`.

    >>> law = RateAndStateSlip(mu_0=0.6, a=0.01, b=0.015, L=1e-5, v_0=1e-6)
    >>> round(law.traction(p=1e6, v=1e-6, ln_theta=2.302585092994046), 3)
    600000.0
    """

    def evolution(self, v: Expression, ln_theta: Expression) -> Mapping[str, Expression]:
        """Rate of the logarithm of the age [1/s]."""
        speed = absolute(v)
        # At zero velocity the logarithm would be infinite, and its product with the velocity zero.
        moving = where(speed > LEAST_VELOCITY, speed, LEAST_VELOCITY + 0 * speed)
        return {"ln_theta": -speed / self.L * (log(moving / self.L) + ln_theta)}


class AnisotropicCoulomb(UnderPressure, Friction):
    r"""Dry friction with a coefficient for each of two directions along the interface.

    .. math:: (t_t, t_2) = p\,\frac{(\mu_1 v,\ \mu_2 v_2)}{\sqrt{v^2 + v_2^2}}

    It sticks within :math:`(t_t/\mu_1)^2 + (t_2/\mu_2)^2 \le p^2`. The traction is not along the slip unless the
    coefficients are equal, which gives `coulomb` in the plane. Source: Sauer, Duong & Mandadapu (2021), eq. e:dry_fric
    with a tensor of coefficients. Any velocities; p >= 0. Dissipates :math:`t_t v + t_2 v_2 \ge 0`.

    >>> law = AnisotropicCoulomb(mu_1=0.3, mu_2=0.6)
    >>> law.traction(p=1e5, direction=0.6), law.transverse(p=1e5, direction_2=0.8)
    (18000.0, 48000.0)
    """

    nonnegative = ("p",)

    mu_1: float = parameter("1", "friction coefficient along v", at_least=0)
    mu_2: float = parameter("1", "friction coefficient along v_2", at_least=0)

    def traction(self, p: Expression, direction: Expression) -> Expression:
        """Tangential traction along v [Pa]."""
        return self.mu_1 * p * direction

    def transverse(self, p: Expression, direction_2: Expression) -> Expression:
        """Tangential traction along v_2 [Pa]."""
        return self.mu_2 * p * direction_2

    def limit(self, p: Expression) -> Expression:
        """Largest traction along v [Pa] that sticking bears."""
        return self.mu_1 * p

    def transverse_limit(self, p: Expression) -> Expression:
        """Largest traction along v_2 [Pa] that sticking bears."""
        return self.mu_2 * p


class AnisotropicViscous(Friction):
    r"""Newtonian film with a viscosity for each of two directions along the interface.

    .. math:: (t_t, t_2) = (\eta_1 v,\ \eta_2 v_2) / g_n

    Source: Sauer, Duong & Mandadapu (2021), eq. e:visc_fric with a tensor of viscosities. Any velocities; g_n > 0.
    Dissipates :math:`t_t v + t_2 v_2 \ge 0`.

    >>> law = AnisotropicViscous(eta_1=0.5, eta_2=0.2)
    >>> law.traction(g_n=0.5, v=0.25), law.transverse(g_n=0.5, v_2=1.0)
    (0.25, 0.4)
    """

    positive = ("g_n",)

    eta_1: float = parameter("Pa s", "film viscosity along v", at_least=0)
    eta_2: float = parameter("Pa s", "film viscosity along v_2", at_least=0)

    def traction(self, g_n: Expression, v: Expression) -> Expression:
        """Tangential traction along v [Pa]."""
        return self.eta_1 * v / g_n

    def transverse(self, g_n: Expression, v_2: Expression) -> Expression:
        """Tangential traction along v_2 [Pa]."""
        return self.eta_2 * v_2 / g_n
