"""All bonds break at once, bodies of constant capacity."""

from __future__ import annotations

from typing import ClassVar

from surfacechem.references._energy import ConstantCapacity, EnergyModel
from surfacechem.references.sudden_debonding import SuddenDebonding


class SuddenDebondingConstantCapacity(SuddenDebonding):
    r"""Temperature after sudden debonding under a traction, constant capacities, uniform temperature, and its verdict.

    .. math:: C(T_f-T_i)=E:=\frac{t_n^2}2\Big(\frac1k+\frac1{E_n}\Big)-\frac{K_0}2\phi_i(2-\phi_i)

    Admissible iff :math:`E\ge0`; impossible at :math:`E\le-CT_i`.

    Source: Sauer, Duong & Mandadapu (2021), section 6.3, with constant capacities and the entropy of the jump.

    >>> bonds = SuddenDebondingConstantCapacity(C=2.0, T_0=300.0, T_i=300.0, K_0=600.0, t_n=1e8, k=1e13)
    >>> bonds.final_temperature, bonds.verdict
    (400.0, 'admissible')
    """

    name: ClassVar[str] = "sudden-debonding-constant-capacity"
    model: ClassVar[EnergyModel] = ConstantCapacity()
