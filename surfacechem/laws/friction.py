"""Sliding friction: Coulomb, viscous film."""

from __future__ import annotations

from surfacechem.expressions import Expression
from surfacechem.terms import Friction, parameter


class Coulomb(Friction):
    r"""Amontons-Coulomb dry friction.

    .. math:: t_t = \mu\,p\,\mathrm{sgn}(v), \quad |t_t| \le \mu_s\,p \text{ at rest}

    Source: Sauer, Duong & Mandadapu (2021), eqs. e:dry_fric and e:tt_max. Any v; p >= 0. Dissipates
    :math:`t_t v \ge 0`. Without a static coefficient, or with one below mu, the interface sticks up to mu p.

    >>> Coulomb(mu=0.3).traction(p=1e5, direction=1.0), Coulomb(mu=0.3, mu_s=0.5).limit(p=1e5)
    (30000.0, 50000.0)
    """

    nonnegative = ("p",)

    mu: float = parameter("1", "sliding friction coefficient", at_least=0)
    mu_s: float = parameter("1", "static friction coefficient, where it is above mu", default=0.0, at_least=0)

    def traction(self, p: Expression, direction: Expression) -> Expression:
        """Tangential traction [Pa]."""
        return self.mu * p * direction

    def limit(self, p: Expression) -> Expression:
        """Traction that sticking bears [Pa]."""
        return self.mu_s * p


class Viscous(Friction):
    r"""Newtonian film that fills the gap.

    .. math:: t_t = \eta\,v / g_n

    Source: Sauer, Duong & Mandadapu (2021), eq. e:visc_fric (with eta in Pa s). Any v; g_n > 0.
    Dissipates :math:`t_t v \ge 0`.

    >>> Viscous(eta=0.5).traction(g_n=1e-6, v=0.25)
    125000.0
    """

    positive = ("g_n",)

    eta: float = parameter("Pa s", "film viscosity", at_least=0)

    def traction(self, g_n: Expression, v: Expression) -> Expression:
        """Tangential traction [Pa]."""
        return self.eta * v / g_n
