"""Sliding friction and the traction that sticking bears: Coulomb, viscous film, Mohr-Coulomb, Stribeck, bonded."""

from __future__ import annotations

from collections.abc import Mapping

from surfacechem.contracts.terms import Friction, UnderPressure, parameter
from surfacechem.expressions import Expression, absolute, decay, positive, power


class Coulomb(UnderPressure, Friction):
    r"""Amontons-Coulomb dry friction.

    .. math:: t_t = \mu\,p\,\mathrm{sgn}(v), \quad |t_t| \le \mu_s\,p \text{ while sticking}

    Source: Sauer, Duong & Mandadapu (2021), eqs. e:dry_fric and e:tt_max. Any v; p >= 0. Dissipates
    :math:`t_t v \ge 0`. Without a static coefficient the interface sticks up to mu p; so it does with one below mu,
    which `check` and the run then say.

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
    r"""Dry friction with adhesion: sliding is resisted without pressure, and in tension up to the adhesive strength.

    .. math:: t_t = [\mu \langle p + t_n^{max} \rangle + c]\,\mathrm{sgn}(v)

    While sticking :math:`|t_t| \le \mu_s \langle p + t_n^{max} \rangle + c`. Adhesion acts through :math:`t_n^{max}`,
    as in tribology, or through c, as in soil mechanics: for constant coefficients :math:`c = \mu\,t_n^{max}` is the
    same law. Where sliding breaks all bonds and the strength is proportional to :math:`\phi`, nothing is left of it;
    let bonds survive sliding or keep a part that does not depend on them.

    Source: Sauer, Duong & Mandadapu (2021), eq. e:M-C; Derjaguin (1934), doi 10.1007/BF01333114. Any v;
    :math:`p \ge -t_n^{max}`. A gap that opens carries the contact beyond its strength, where only c is left; a
    pressure that is prescribed there is refused. Dissipates :math:`t_t v \ge 0`.

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
        """The tension that the adhesive strength bears."""
        return {"p": -self.t_n_max}

    @property
    def kinks(self) -> Mapping[str, Expression]:
        """The tension at which only cohesion is left."""
        return {"p": -self.t_n_max}

    def traction(self, p: Expression, direction: Expression) -> Expression:
        """Tangential traction [Pa]."""
        return (self.mu * positive(p + self.t_n_max) + self.c) * direction

    def limit(self, p: Expression) -> Expression:
        """Largest tangential traction [Pa] that sticking bears."""
        return (self.mu if self.mu_s is None else self.mu_s) * positive(p + self.t_n_max) + self.c


class Stribeck(UnderPressure, Friction):
    r"""Friction that falls from its static to its sliding value with velocity, and rises again in a full film.

    .. math:: t_t = \left[ \mu_k + (\mu_s - \mu_k) e^{-|v / v_s|^\delta} \right] p\,\mathrm{sgn}(v) + c_v v

    Source: Armstrong-Hélouvry, Dupont & Canudas de Wit (1994), doi 10.1016/0005-1098(94)90209-7; named in Sauer, Duong
    & Mandadapu (2021), remark r:512. Any v; p >= 0. Dissipates :math:`t_t v \ge 0`. Where the traction falls with
    velocity faster than a damper resists, steady sliding is unstable.

    >>> round(Stribeck(mu_s=0.6, mu_k=0.4, v_s=1e-3).traction(p=1e5, v=1e-3, direction=1.0), 6)
    47357.588823
    """

    nonnegative = ("p",)

    mu_s: float = parameter("1", "friction coefficient at rest", at_least=0)
    mu_k: float = parameter("1", "friction coefficient of fast sliding", at_least=0)
    v_s: float = parameter("m/s", "Stribeck velocity", above=0)
    delta: float = parameter("1", "exponent of the fall", default=2.0, above=0)
    c_v: float = parameter("Pa s/m", "viscous resistance", default=0.0, at_least=0)

    def traction(self, p: Expression, v: Expression, direction: Expression) -> Expression:
        """Tangential traction [Pa]."""
        fall = decay(power(absolute(v) / self.v_s, self.delta))
        return (self.mu_k + (self.mu_s - self.mu_k) * fall) * p * direction + self.c_v * v

    def limit(self, p: Expression) -> Expression:
        """Largest tangential traction [Pa] that sticking bears."""
        return self.mu_s * p


class BondedCoulomb(UnderPressure, Friction):
    r"""Dry friction whose static coefficient grows with the bonding state and falls with temperature.

    .. math:: |t_t| \le \mu_0\,p \text{ while sticking}, \quad
        \mu_0 = [\phi \mu_b + (1 - \phi) \mu_{ub}] \frac{T_0}{T_c}, \quad t_t = \mu\,p\,\mathrm{sgn}(v)

    Bonds break as sliding starts. Where :math:`\mu_0` falls below :math:`\mu`, as in the heat, :math:`\mu p` is what
    sticking bears, and the run says so. Source: Sauer, Duong & Mandadapu (2021), eqs. e:mu0 and e:dry_fric. Any v;
    p >= 0. Dissipates :math:`t_t v \ge 0`.

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

    Source: Sauer, Duong & Mandadapu (2021), eq. e:visc_fric (with eta in Pa s). Any v; g_n > 0.
    Dissipates :math:`t_t v \ge 0`. It bears nothing at rest.

    >>> Viscous(eta=0.5).traction(g_n=1e-6, v=0.25)
    125000.0
    """

    positive = ("g_n",)

    eta: float = parameter("Pa s", "film viscosity", at_least=0)

    def traction(self, g_n: Expression, v: Expression) -> Expression:
        """Tangential traction [Pa]."""
        return self.eta * v / g_n
