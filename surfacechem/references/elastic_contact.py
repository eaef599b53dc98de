"""Linear elastic contact in series with elastic bodies."""

from __future__ import annotations

from surfacechem.contracts.terms import parameter
from surfacechem.references.base import Array, Quantities, Reference, read


class ElasticContact(Reference):
    r"""Elastic bodies pressed or pulled through an elastic interface; the penalty limit is rigid contact.

    .. math:: g_n=\frac{kw}{k+E_n},\quad t_n=E_ng_n,\quad\tfrac12E_ng_n^2=\frac{t_n^2}{2E_n}

    For :math:`E_n\to\infty` the traction tends to k w and the energy of the contact to zero.
    Here :math:`w=w_i+\dot wt`; with a unilateral penalty w <= 0. The energies are accurate to rounding for any
    stiffness.

    Source: Sauer, Duong & Mandadapu (2021), eq. ex:psi_c, in series with a spring.

    >>> contact = ElasticContact(k=1e12, E_n=1e15, w_i=-1e-8)
    >>> f"{contact.solution(0.0)['t_n']:.6f}"
    '-9990.009990'
    """

    k: float = parameter("Pa/m", "stiffness of the bodies", above=0)
    E_n: float = parameter("Pa/m", "contact stiffness", above=0)
    w_i: float = parameter("m", "initial far-field displacement")
    w_dot: float = parameter("m/s", "speed of the far field", default=0.0)

    readings = read(normal="k", potential="E_n", initial="w_i=w_n", ramp="w_dot=w_n")

    def quantities(self, t: Array) -> Quantities:
        w = self.w_i + self.w_dot * t
        g, delta = self.k / (self.k + self.E_n) * w, self.E_n / (self.k + self.E_n) * w
        energies = {"E_spring_n": 0.5 * self.k * delta**2, "U_contact": 0.5 * self.E_n * g**2}
        return {"w_n": w, "g_n": g, "t_n": self.E_n * g, **energies}
