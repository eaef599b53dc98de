"""All bonds break at once: what the bodies' temperature is then, and whether that may happen."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.references._bodies import ConstantCapacity, EnergyModel, UniformBody
from surfacechem.references.base import Array, Parameters, SceneView


class SuddenDebonding(UniformBody):
    r"""Temperature after sudden debonding under a traction, quadratic energies, uniform temperature, and its verdict.

    .. math:: \frac C{2T_0}(T_f^2-T_i^2)=E:=\frac{t_n^2}2\Big(\frac1k+\frac1{E_n}\Big)-\frac{K_0}2\phi_i(2-\phi_i)

    What springs release, less what the bonds take, ends as heat. Admissible iff :math:`E\ge0`: below, energy is
    conserved with :math:`T_f<T_i` but entropy falls by :math:`C(T_i-T_f)/T_0`; at :math:`E\le-CT_i^2/2T_0` no
    temperature conserves energy. The paper has :math:`\phi_i=1`, :math:`T_i=T_0`, a rigid interface, and
    :math:`T_f=T_0\sqrt{1-\kappa+(t_n/t_0)^2}` with :math:`\kappa=K_0/(T_0C)`, :math:`t_0^2=T_0Ck`; its cooling branch
    violates its own second law.

    Source: Sauer, Duong & Mandadapu (2021), section 6.3, with the entropy of the jump.

    >>> bonds = SuddenDebonding(C=2.0, T_0=300.0, T_i=300.0, K_0=600.0, t_n=7e7, k=1e13)
    >>> f"{bonds.final_temperature:.6f} {bonds.entropy_change:.6f} {bonds.verdict}"
    '271.108834 -0.192608 entropy-violating'
    """

    name: ClassVar[str] = "sudden-debonding"

    K_0: float = parameter("J/m^2", "bond energy density")
    phi_i: float = parameter("1", "bonding state before", default=1.0, at_least=0, at_most=1)
    t_n: float = parameter("Pa", "traction before")
    k: float = parameter("Pa/m", "stiffness of the bodies", above=0)
    compliance: float = parameter("m/Pa", "compliance 1/E_n of the bonded interface", default=0.0, at_least=0)

    @classmethod
    def from_scene(cls, scene: SceneView) -> Parameters:
        loaded = scene.initial("t_n") if "t_n" in scene.scene.loading else scene.limit("t_max")
        bonds = {"K_0": scene.potential("K_0"), "phi_i": scene.initial("phi")}
        return {**super().from_scene(scene), **bonds, "t_n": loaded, "k": scene.support("normal", "k")}

    @property
    def released_energy(self) -> float:
        """Energy [J/m^2] that ends as heat."""
        return 0.5 * self.t_n**2 * (1.0 / self.k + self.compliance) - 0.5 * self.K_0 * self.phi_i * (2.0 - self.phi_i)

    @property
    def final_temperature(self) -> float:
        """Temperature [K] after; nan if there is none."""
        if self.verdict == "impossible":
            return math.nan
        return float(self.heated(np.array(self.released_energy)))

    @property
    def entropy_change(self) -> float:
        """Entropy [J/(m^2 K)] that the event produces; nan if it is impossible."""
        excess = np.array([self.T_i, self.final_temperature]) - self.T_0
        before, after = self.model.entropy(excess, self.C, self.T_0)
        return float(after - before)

    @property
    def verdict(self) -> str:
        """admissible, entropy-violating or impossible."""
        if self.released_energy >= 0.0:
            return "admissible"
        content = -self.model.energy(np.array(-self.T_0), self.C, self.T_0)
        content += self.model.energy(np.array(self.T_i - self.T_0), self.C, self.T_0)
        return "entropy-violating" if self.released_energy + float(content) > 0.0 else "impossible"

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        return {"T": self.final_temperature, "entropy_change": self.entropy_change}


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
