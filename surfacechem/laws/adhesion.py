"""Adhesion intensity of Frémond and of Raous, Cangémi and Cocu: bonds as an internal variable, and how they break."""

from __future__ import annotations

from collections.abc import Mapping

from surfacechem.contracts.terms import RateLaw, TangentialPotential, parameter
from surfacechem.expressions import Expression, positive, where


class AdhesionIntensity(TangentialPotential):
    r"""Elastic adhesion of an intensity between zero and one, the bonding state.

    .. math::
        \Psi = \tfrac12 \phi^2 \left( C_N \langle g_n \rangle^2 + C_T g_t^2 \right)
        + \tfrac12 E_n \langle -g_n \rangle^2 - w \phi

    Tension is :math:`C_N \phi^2 g_n`. Adhesion begins to break where :math:`C_N g_n^2 + C_T g_t^2 = w / \phi`, and w is
    Dupré's energy. Contact in compression is elastic and does not lose stiffness; the original is rigid, the limit of
    large :math:`E_n`. Another energy of adhesion than the linear one is had by a bond energy beside it.

    In parallel with friction :math:`g_t` is the whole displacement. Friction acts on the part that is not bonded,
    :math:`t_t = \phi^2 C_T g_t + (1 - \phi)\,t_f`, so that shear that begins with complete adhesion peaks no lower
    than without it, at :math:`\sqrt{w\,C_T}` where nothing delays the loss, and ends on the plateau of friction.

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

    With the potential of adhesion intensity,
    :math:`b\,\dot\phi = -\langle (C_N g_n^2 + C_T g_t^2) \phi - w \rangle`. What is lost does not heal: where adhesion
    would grow, it rests. Where it may heal use the linear law with :math:`c_r = N_c / b`.

    Source: Raous, Cangémi & Cocu (1999), doi 10.1016/S0045-7825(98)00389-2, with the exponent p = 1. Admissible.

    >>> AdhesionLoss(b=2.0).rate(mu=1.5e-18, n_c=1e18, N_c=1e18), AdhesionLoss(b=2.0).rate(mu=-1.0, n_c=1e18, N_c=1e18)
    (-7.5e+17, 0.0)
    """

    b: float = parameter("J s/m^2", "viscosity of adhesion", above=0)

    @property
    def kinks(self) -> Mapping[str, Expression]:
        """Where loss ends."""
        return {"mu": 0.0}

    def rate(self, mu: Expression, n_c: Expression, N_c: Expression) -> Expression:
        """Net rate [1/(m^2 s)]."""
        return -n_c * positive(N_c * mu) / self.b
