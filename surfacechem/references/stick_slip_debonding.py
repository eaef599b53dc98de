"""Stick-slip of a bonded contact whose bonds break in the first slip and do not form again."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.errors import InputError
from surfacechem.references.base import Array, Parameters, Reference, SceneView
from surfacechem.references.stick_slip import Slip, StickSlip


class BondedSlider(Reference):
    """A mass on a driven spring whose contact sticks the better the more bonds it has."""

    m: float = parameter("kg/m^2", "mass", above=0)
    k: float = parameter("Pa/m", "tangential stiffness", above=0)
    V: float = parameter("m/s", "speed of the spring's end", above=0)
    p: float = parameter("Pa", "contact pressure", above=0)
    mu_b: float = parameter("1", "static friction coefficient of complete bonding", above=0)
    mu_ub: float = parameter("1", "static friction coefficient without bonds", above=0)
    mu_k: float = parameter("1", "sliding friction coefficient", at_least=0)

    @classmethod
    def from_scene(cls, scene: SceneView) -> Parameters:
        held = {name: scene.support("tangential", name) for name in ("m", "k")}
        T, T_0 = scene.temperature, scene.constant("T_0")
        cooler = T_0 / T if T and T_0 else 1.0  # bonds bear mu_b p T_0 / T
        limits = {name: scene.friction(name) for name in ("mu_b", "mu_ub")}
        static = {name: None if mu is None else mu * cooler for name, mu in limits.items()}
        return {**held, **static, "V": scene.ramp("w_t"), "p": scene.initial("p"), "mu_k": scene.friction("mu")}

    def __post_init__(self) -> None:
        """Refuse what sticks less than it slides, and limits so far apart that the contact slips back."""
        super().__post_init__()
        if not self.mu_k <= self.mu_ub <= self.mu_b <= 2.0 * self.mu_k + self.mu_ub:
            raise InputError(f"{self.name}: exact for mu_k <= mu_ub <= mu_b <= 2 mu_k + mu_ub only.")


class StickSlipDebonding(BondedSlider):
    r"""Stick-slip that begins bonded: sticking bears :math:`\mu_bp` once and :math:`\mu_{ub}p` ever after.

    The first slip begins at :math:`t_1=\mu_bp/(kV)` and drops the traction of the spring to :math:`(2\mu_k-\mu_b)p`,
    which may push. From then on it is stick-slip without bonds,

    .. math:: t_2=t_1+t_{slip}(\mu_b)+\frac{(\mu_{ub}+\mu_b-2\mu_k)p}{kV},\quad
        t_{j+1}=t_j+t_{slip}(\mu_{ub})+\frac{2(\mu_{ub}-\mu_k)p}{kV}

    for the beginnings of slips. The contact starts at rest, complete in its bonds, with a relaxed spring. Any t >= 0.

    Source: sticking limit of Sauer, Duong & Mandadapu (2021), eq. e:mu0, at T_0, with an oscillator, integrated.

    >>> slider = StickSlipDebonding(m=10.0, k=1e8, V=1e-3, p=1e5, mu_b=0.9, mu_ub=0.6, mu_k=0.4)
    >>> f"{slider.first.v_max:.9f} {slider.unbonded_from:.9f}"
    '1.582139146 1.600993859'
    """

    name: ClassVar[str] = "stick-slip-debonding"

    @property
    def first(self) -> Slip:
        """The slip that breaks the bonds."""
        return Slip(self.m, self.k, self.V, (self.mu_b - self.mu_k) * self.p)

    @property
    def onset_time(self) -> float:
        """Time [s] of the first slip."""
        return self.mu_b * self.p / (self.k * self.V)

    @property
    def unbonded_from(self) -> float:
        """Time [s] of the second slip."""
        left = (2.0 * self.mu_k - self.mu_b) * self.p
        return self.onset_time + self.first.duration + (self.mu_ub * self.p - left) / (self.k * self.V)

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        rest = self.onset_time + self.first.duration
        slip, v, above = self.first.motion(np.clip(t - self.onset_time, 0.0, self.first.duration))
        sliding = (t > self.onset_time) & (t < rest)
        start = np.where(t < rest, 0.0, (2.0 * self.mu_k - self.mu_b) * self.p)
        pulled = start + self.k * self.V * (t - np.where(t < rest, 0.0, rest))
        spring = np.where(sliding, self.mu_k * self.p + above, pulled)
        plain = StickSlip(m=self.m, k=self.k, V=self.V, t_s=self.mu_ub * self.p, t_k=self.mu_k * self.p)
        later = plain.solution(np.maximum(t - self.unbonded_from, 0.0) + plain.onset_time)
        after = t >= self.unbonded_from
        u_t = np.where(t < self.onset_time, 0.0, slip) + np.where(after, later["u_t"], 0.0)
        t_t = np.where(sliding, self.mu_k * self.p, spring)
        return {
            "phi": np.where(t > self.onset_time, 0.0, 1.0),
            "u_t": u_t,
            "v": np.where(after, later["v"], np.where(sliding, v, 0.0)),
            "t_t": np.where(after, later["t_t"], t_t),
            "spring_traction": np.where(after, later["spring_traction"], spring),
            "heat": self.mu_k * self.p * u_t,
        }
