"""Bodies that are pulled apart until their rigid interface debonds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.errors import InputError
from surfacechem.references.base import Array, Parameters, SceneView
from surfacechem.references.sudden_debonding import SuddenDebonding


class PulledToDebonding(SuddenDebonding):
    r"""Elastic bodies, bonded by a rigid interface, are pulled apart at constant speed until all bonds break at once.

    .. math:: t_n=kw<t_0\,\phi_i\,T_0/T_i,\qquad w=\dot wt;\quad\text{then }\phi=0,\ t_n=0,\ g_n=w,\ T=T_f

    with the final temperature of sudden debonding, whose parameter :math:`t_n` is here the strength
    :math:`t_0` of complete bonding at :math:`T_0`. There is no solution where debonding is impossible.

    Source: Sauer, Duong & Mandadapu (2021), section 6.3 with eq. e:debond.

    >>> bodies = PulledToDebonding(
    ...     C=2.0, T_0=300.0, T_i=300.0, K_0=300.0, t_n=7.745966692414834e7, k=1e13, w_dot=1e-6)
    >>> f"{bodies.debonding_time:.9f} {bodies.solution(9.0)['T']:.9f}"
    '7.745966692 367.423461417'
    """

    name: ClassVar[str] = "pulled-to-debonding"

    w_dot: float = parameter("m/s", "speed of the far field", above=0)

    @classmethod
    def from_scene(cls, scene: SceneView) -> Parameters:
        return {**super().from_scene(scene), "w_dot": scene.ramp("w_n")}

    @property
    def debonding_time(self) -> float:
        """Time [s] at which the strength is reached."""
        return self.traction / (self.k * self.w_dot)

    @property
    def traction(self) -> float:
        """Traction [Pa] at which the interface debonds."""
        return self.t_n * self.phi_i * self.T_0 / self.T_i

    @property
    def released_energy(self) -> float:
        """Energy [J/m^2] that ends as heat."""
        return super().released_energy + 0.5 * (self.traction**2 - self.t_n**2) * (1.0 / self.k + self.compliance)

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        if self.verdict == "impossible":
            raise InputError(f"{self.name}: no temperature conserves the energy.")
        bonded, w = t < self.debonding_time, self.w_dot * t
        return {
            "w_n": w,
            "g_n": np.where(bonded, 0.0, w),
            "t_n": np.where(bonded, self.k * w, 0.0),
            "phi": np.where(bonded, self.phi_i, 0.0),
            "T": np.where(bonded, self.T_i, self.final_temperature),
        }
