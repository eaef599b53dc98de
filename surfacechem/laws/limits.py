"""Limits of traction: tensile strength."""

from __future__ import annotations

from surfacechem.contracts.terms import Limit, parameter
from surfacechem.expressions import Expression


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
