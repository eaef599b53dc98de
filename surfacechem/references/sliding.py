"""Heating by steady sliding, quadratic energies."""

from __future__ import annotations

from typing import ClassVar

from surfacechem.references._energy import EnergyModel, QuadraticEnergy
from surfacechem.references._perfect_contact import SteadySliding


class Sliding(SteadySliding):
    r"""Steady sliding at constant dissipation, perfect thermal contact, quadratic energies.

    .. math:: T=\sqrt{T_i^2+2T_0Dt/C},\quad q_k=\frac{C_k}{C}D,\quad S=C\,(T/T_0-1),\quad C=C_1+C_2+C_c

    With :math:`T_i=T_0` this is :math:`T_0\sqrt{1+2t/\tau_s}`, :math:`\tau_s=CT_0/D`. Any t >= 0; D = mu p v (dry) or
    eta v^2/g_n (viscous) as long as it does not change.

    Source: Sauer, Duong & Mandadapu (2021), section 6.1.

    >>> bodies = Sliding(C_1=2000.0, C_2=2000.0, C_c=50.0, T_0=300.0, T_i=300.0, D=1000.0)
    >>> f"{bodies.solution(1215.0)['T']:.10f}"
    '519.6152422707'
    """

    name: ClassVar[str] = "sliding"
    model: ClassVar[EnergyModel] = QuadraticEnergy()
