"""Debonding: of all bonds at once under a traction or as the bodies are pulled apart, and along a falling line."""

from __future__ import annotations

import math

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.errors import InputError
from surfacechem.references._bodies import UniformBody
from surfacechem.references.base import Array, Parameters, Quantities, Reference, SceneView, read


class SuddenDebonding(UniformBody):
    r"""Sudden debonding under a traction, quadratic energies: the uniform temperature afterwards and its verdict.

    .. math:: \frac C{2T_0}(T_f^2-T_i^2)=E:=\frac{t_n^2}2\Big(\frac1k+\frac1{E_n}\Big)-\frac{K_0}2\phi_i(2-\phi_i)

    The energy that springs release, less that of the bonds, becomes heat. Admissible iff :math:`E\ge0`: below, energy
    is conserved with :math:`T_f<T_i` but entropy falls by :math:`C(T_i-T_f)/T_0`; at :math:`E\le-CT_i^2/2T_0` no
    temperature conserves energy. The paper has :math:`\phi_i=1`, :math:`T_i=T_0`, a rigid interface, and
    :math:`T_f=T_0\sqrt{1-\kappa+(t_n/t_0)^2}` with :math:`\kappa=K_0/(T_0C)`, :math:`t_0^2=T_0Ck`; its cooling branch
    violates its own second law.

    Source: Sauer, Duong & Mandadapu (2021), section 6.3, with the entropy of the jump.

    >>> bonds = SuddenDebonding(C=2.0, T_0=300.0, T_i=300.0, K_0=600.0, t_n=7e7, k=1e13)
    >>> f"{bonds.final_temperature:.6f} {bonds.entropy_change:.6f} {bonds.verdict}"
    '271.108834 -0.192608 entropy-violating'
    """

    K_0: float = parameter("J/m^2", "bond energy density")
    phi_i: float = parameter("1", "bonding state before", default=1.0, at_least=0, at_most=1)
    t_n: float = parameter("Pa", "traction before")
    k: float = parameter("Pa/m", "stiffness of the bodies", above=0)
    compliance: float = parameter("m/Pa", "compliance 1/E_n of the bonded interface", default=0.0, at_least=0)

    readings = read(potential="K_0", initial="phi_i=phi", normal="k")

    @classmethod
    def from_scene(cls, scene: SceneView) -> Parameters:
        loaded = scene.initial("t_n") if "t_n" in scene.scene.loading else scene.limit("t_max")
        return {**super().from_scene(scene), "t_n": loaded}

    @property
    def traction(self) -> float:
        """Traction [Pa] at which the interface debonds."""
        return self.t_n

    @property
    def released_energy(self) -> float:
        """Energy [J/m^2] that becomes heat."""
        elastic = 0.5 * self.traction**2 * (1.0 / self.k + self.compliance)
        return elastic - 0.5 * self.K_0 * self.phi_i * (2.0 - self.phi_i)

    @property
    def final_temperature(self) -> float:
        """Temperature [K] after debonding; NaN if there is none."""
        if self.verdict == "impossible":
            return math.nan
        return float(self.heated(np.array(self.released_energy)))

    @property
    def entropy_change(self) -> float:
        """Entropy [J/(m^2 K)] that the event produces; NaN if it is impossible."""
        before, after = self.model.entropy(np.array([self.T_i, self.final_temperature]) - self.T_0, self.C, self.T_0)
        return float(after - before)

    @property
    def verdict(self) -> str:
        """'admissible', 'entropy-violating' or 'impossible'."""
        if self.released_energy >= 0.0:
            return "admissible"
        none, before = self.model.energy(np.array([0.0, self.T_i]) - self.T_0, self.C, self.T_0)
        return "entropy-violating" if self.released_energy + float(before - none) > 0.0 else "impossible"

    def quantities(self, t: Array) -> Quantities:
        return {"T": self.final_temperature, "entropy_change": self.entropy_change}


class PulledToDebonding(SuddenDebonding):
    r"""Elastic bodies, bonded by a rigid interface, are pulled apart at constant speed until all bonds break at once.

    .. math:: t_n=kw<t_0\,\phi_i\,T_0/T_i,\qquad w=\dot wt;\quad\text{then }\phi=0,\ t_n=0,\ g_n=w,\ T=T_f

    with the final temperature of sudden debonding, whose parameter :math:`t_n` is here the strength
    :math:`t_0` of complete bonding at :math:`T_0`. There is no solution if debonding is impossible.

    Source: Sauer, Duong & Mandadapu (2021), section 6.3 with eq. e:debond.

    >>> bodies = PulledToDebonding(
    ...     C=2.0, T_0=300.0, T_i=300.0, K_0=300.0, t_n=7.745966692414834e7, k=1e13, w_dot=1e-6)
    >>> f"{bodies.debonding_time:.9f} {bodies.solution(9.0)['T']:.9f}"
    '7.745966692 367.423461417'
    """

    w_dot: float = parameter("m/s", "speed of the far field", above=0)

    readings = read(ramp="w_dot=w_n")

    @property
    def debonding_time(self) -> float:
        """Time [s] at which the strength is reached."""
        return self.traction / (self.k * self.w_dot)

    @property
    def traction(self) -> float:
        return self.t_n * self.phi_i * self.T_0 / self.T_i

    def quantities(self, t: Array) -> Quantities:
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


class BilinearDebonding(Reference):
    r"""Bonds that break along a falling line of traction as the gap opens, closes, and opens again.

    .. math:: t_n=\phi E_bg_n,\qquad
        \phi=\frac{g_c}{\hat g}\,\frac{g_f-\hat g}{g_f-g_c},\quad g_c=\frac{t_{max}}{E_b}\le\hat g\le g_f,\qquad
        D=\tfrac12(t_{max}\hat g-\hat tg_c)-H_r(1-\phi)

    with the largest gap so far :math:`\hat g`, and the energy dissipated so far, D: the area between loading and
    unloading less the energy stored by the broken bonds. Its total is :math:`\tfrac12t_{max}g_f-H_r`. The gap opens at
    a constant speed to :math:`g_1`, closes at the same speed, and opens again. Any t >= 0.

    Source: bilinear law as in Camanho & Davila (2002), NASA/TM-2002-211737, integrated.

    >>> zone = BilinearDebonding(t_max=8e7, E_b=1e15, g_f=24e-6, H_r=2.0, g_1=8e-6, speed=1e-6)
    >>> " ".join(f"{x:.9f}" for x in zone.solution([4.0, 12.0, 40.0])["heat"])
    '155.357859532 315.872909699 958.000000000'
    """

    t_max: float = parameter("Pa", "tensile strength", above=0)
    E_b: float = parameter("Pa/m", "stiffness of complete bonding", above=0)
    g_f: float = parameter("m", "gap at which the last bonds break", above=0)
    H_r: float = parameter("J/m^2", "heat released by complete bonding", default=0.0)
    g_1: float = parameter("m", "gap at which it is first closed again", at_least=0)
    speed: float = parameter("m/s", "speed of the gap", above=0)

    readings = read(reaction="t_max E_b g_f", potential="H_r")

    def __post_init__(self) -> None:
        """Refuse a line that does not fall."""
        super().__post_init__()
        if self.g_f <= self.peak:
            raise InputError(f"{self.name}: g_f must be above t_max / E_b = {self.peak!r} m.")

    @property
    def peak(self) -> float:
        """Gap [m] of the largest traction."""
        return self.t_max / self.E_b

    def quantities(self, t: Array) -> Quantities:
        back, again = 2.0 * self.g_1 - self.speed * t, self.speed * t - 2.0 * self.g_1
        g = np.where(self.speed * t <= self.g_1, self.speed * t, np.maximum(back, again))
        largest = np.clip(np.maximum(g, np.where(self.speed * t > self.g_1, self.g_1, 0.0)), self.peak, self.g_f)
        left = (self.g_f - largest) / (self.g_f - self.peak)
        phi = self.peak / largest * left
        lost = (largest - self.peak) * self.g_f / (largest * (self.g_f - self.peak))  # 1 - phi
        heat = 0.5 * self.t_max * (largest - self.peak * left) - self.H_r * lost
        return {"g_n": g, "phi": phi, "t_n": phi * self.E_b * g, "heat": heat}
