"""Friction with a direction of its own: slip with two components and different coefficients along them."""

from __future__ import annotations

from surfacechem.contracts.terms import Friction, UnderPressure, parameter
from surfacechem.expressions import Expression


class AnisotropicCoulomb(UnderPressure, Friction):
    r"""Dry friction with a coefficient for each of two directions along the interface.

    .. math:: (t_t, t_2) = p\,\frac{(\mu_1 v,\ \mu_2 v_2)}{\sqrt{v^2 + v_2^2}}

    It sticks within :math:`(t_t/\mu_1)^2 + (t_2/\mu_2)^2 \le p^2`. The traction is not along the slip unless the
    coefficients are equal, when this is `coulomb` in the plane.
    Source: Sauer, Duong & Mandadapu (2021), eq. e:dry_fric with a tensor of coefficients. Any velocities; p >= 0.
    Dissipates :math:`t_t v + t_2 v_2 \ge 0`.

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
