"""Heat transfer: conductance."""

from __future__ import annotations

from surfacechem.expressions import Expression
from surfacechem.terms import HeatTransfer, parameter


class Conductance(HeatTransfer):
    r"""Linear heat transfer.

    .. math:: q = h\,(T_{hot} - T_{cold})

    Source: Sauer, Duong & Mandadapu (2021), eqs. e:qc_k1 (body to interface medium) and e:qc_t1 (body to body).

    >>> Conductance(between=("lower", "upper"), h=250.0).conductance()
    250.0
    """

    h: float = parameter("W/(m^2 K)", "thermal conductance", at_least=0)

    def conductance(self) -> Expression:
        """Conductance [W/(m^2 K)]."""
        return self.h
