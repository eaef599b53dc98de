"""Heating by steady sliding, constant capacities."""

from __future__ import annotations

from typing import ClassVar

from surfacechem.references._energy import ConstantCapacity, EnergyModel
from surfacechem.references._perfect_contact import SteadySliding


class SlidingConstantCapacity(SteadySliding):
    r"""Steady sliding at constant dissipation, perfect thermal contact, constant capacities.

    .. math:: T=T_i+Dt/C,\quad q_k=\frac{C_k}{C}D,\quad S=C\ln(T/T_0),\quad C=C_1+C_2+C_c

    Any t >= 0. Source: Sauer, Duong & Mandadapu (2021), section 6.1, with temperature-independent capacities.

    >>> bodies = SlidingConstantCapacity(C_1=2000.0, C_2=2000.0, C_c=50.0, T_0=300.0, T_i=300.0, D=1000.0)
    >>> f"{bodies.solution(1215.0)['T']:.10f}"
    '600.0000000000'
    """

    name: ClassVar[str] = "sliding-constant-capacity"
    model: ClassVar[EnergyModel] = ConstantCapacity()
