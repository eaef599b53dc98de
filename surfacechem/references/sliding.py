"""Heating by steady sliding, for both energy models."""

from __future__ import annotations

from typing import ClassVar

from surfacechem.contracts.terms import parameter
from surfacechem.references._bodies import ConstantCapacity, PerfectContact, QuadraticEnergy
from surfacechem.references.base import Array, Quantities, read


class Sliding(PerfectContact):
    r"""Steady sliding at constant dissipation, perfect thermal contact, quadratic energies.

    .. math:: T=\sqrt{T_i^2+2T_0Dt/C},\quad q_k=\frac{C_k}{C}D,\quad S=C\,(T/T_0-1),\quad C=C_1+C_2+C_c

    With :math:`T_i=T_0` this is :math:`T_0\sqrt{1+2t/\tau_s}`, :math:`\tau_s=CT_0/D`. Any t >= 0; D = mu p v (dry) or
    eta v^2/g_n (viscous) as long as it is constant.

    Source: Sauer, Duong & Mandadapu (2021), section 6.1.

    >>> bodies = Sliding(C_1=2000.0, C_2=2000.0, C_c=50.0, T_0=300.0, T_i=300.0, D=1000.0)
    >>> f"{bodies.solution(1215.0)['T']:.10f}"
    '519.6152422707'
    """

    model: ClassVar[QuadraticEnergy | ConstantCapacity] = QuadraticEnergy()

    T_i: float = parameter("K", "initial temperature", above=0)
    D: float = parameter("W/m^2", "friction power, traction times sliding velocity", at_least=0)

    readings = read(temperature="T_i", friction_power="D")

    def quantities(self, t: Array) -> Quantities:
        rise = self.model.rise(self.D * t, self.C, self.T_0, self.T_i)
        return {
            "T": self.T_i + rise,
            "q_1": self.C_1 / self.C * self.D,
            "q_2": self.C_2 / self.C * self.D,
            "S_total": self.model.entropy(self.T_i - self.T_0 + rise, self.C, self.T_0),
        }


class SlidingConstantCapacity(Sliding):
    r"""Steady sliding at constant dissipation, perfect thermal contact, constant capacities.

    .. math:: T=T_i+Dt/C,\quad q_k=\frac{C_k}{C}D,\quad S=C\ln(T/T_0),\quad C=C_1+C_2+C_c

    Any t >= 0. Source: Sauer, Duong & Mandadapu (2021), section 6.1, with temperature-independent capacities.

    >>> bodies = SlidingConstantCapacity(C_1=2000.0, C_2=2000.0, C_c=50.0, T_0=300.0, T_i=300.0, D=1000.0)
    >>> f"{bodies.solution(1215.0)['T']:.10f}"
    '600.0000000000'
    """

    model: ClassVar[QuadraticEnergy | ConstantCapacity] = ConstantCapacity()
