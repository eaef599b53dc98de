"""Bonds that break gradually under tension: compliant debonding."""

from __future__ import annotations

from surfacechem.contracts.terms import RateLaw, parameter
from surfacechem.expressions import Expression, where


class CompliantDebonding(RateLaw):
    r"""Bonds break as the gap opens, so that the traction falls along a line to zero.

    .. math:: \phi \le \phi_{env}(g_n) = \frac{t_{max}}{E_b\,g_n}\,\frac{g_f - g_n}{g_f - g_c}, \quad
              g_c = \frac{t_{max}}{E_b}, \quad \dot\phi = \min(R_o / n_c, \dot\phi_{env}) \text{ on the envelope}

    where :math:`R_o` is the net rate of all other bonding laws. So bonds break as fast as the envelope falls and others
    form them; where the envelope rises faster than others form bonds, or others break bonds faster than it falls, they
    leave it. Beyond :math:`g_f` no bond forms.
    With the potential :math:`\tfrac12 \phi E_b g_n^2` the traction is the bilinear law of cohesive zones: it peaks at
    :math:`t_{max}` and ends at :math:`g_f`; unloading goes back to zero gap along :math:`\phi E_b`. The break is
    irreversible by itself. Source: Sauer, Duong & Mandadapu (2021), section 5.2 (the path of finite slope); bilinear
    form as in Camanho & Davila (2002), NASA/TM-2002-211737. :math:`g_f > g_c`; :math:`E_b` is that of the potential.
    Admissible where the elastic energy of a bond exceeds its bond energy.

    >>> law = CompliantDebonding(t_max=1e6, E_b=1e14, g_f=5e-8)
    >>> law.envelope(g_n=1e-8), round(law.envelope(g_n=3e-8), 12)
    (1.0, 0.166666666667)
    """

    t_max: float = parameter("Pa", "tensile strength", above=0, stretch=1)
    E_b: float = parameter("Pa/m", "stiffness of complete bonding, per reference area", above=0)
    g_f: float = parameter("m", "gap at which the last bonds break", above=0)

    def peak(self) -> Expression:
        """Gap at which complete bonding begins to break [m]."""
        return self.t_max / self.E_b

    def envelope(self, g_n: Expression) -> Expression:
        """Bonding state that the gap leaves; it falls through zero where the last bonds break."""
        start = self.peak()
        gap = where(g_n > start / 2, g_n, start / 2)
        return start / gap * (self.g_f - gap) / (self.g_f - start)

    def rate(self, n_c: Expression, softening: Expression, overshoot: Expression) -> Expression:
        """Net rate [1/(m^2 s)]; ``overshoot`` is how fast the bonding state would pass the envelope [1/s]."""
        return -n_c * softening * overshoot
