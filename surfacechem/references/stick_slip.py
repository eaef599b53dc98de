"""Stick-slip of a mass that is pulled by a spring at constant speed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.errors import InputError
from surfacechem.references.base import Array, Parameters, Reference, SceneView


@dataclass(frozen=True)
class Slip:
    """A slip that begins at rest with the spring pulling by `drop` [Pa] more than sliding friction resists."""

    m: float
    k: float
    V: float
    drop: float

    @property
    def omega(self) -> float:
        """Angular frequency [1/s] of mass and spring."""
        return math.sqrt(self.k / self.m)

    @property
    def stretch(self) -> float:
        """Elongation [m] of the spring above that of steady sliding, at the start."""
        return self.drop / self.k

    @property
    def duration(self) -> float:
        """Time [s] until the mass rests again."""
        return (math.pi + 2.0 * math.atan2(self.V, self.stretch * self.omega)) / self.omega

    @property
    def distance(self) -> float:
        """Slip [m] from rest to rest."""
        return self.V * self.duration + 2.0 * self.stretch

    @property
    def v_max(self) -> float:
        """Largest velocity [m/s]."""
        return self.V + math.hypot(self.V, self.stretch * self.omega)

    def motion(self, t: Array) -> tuple[Array, Array, Array]:
        """Slip [m], velocity [m/s] and spring traction above sliding friction [Pa] at times since the start."""
        angle = self.omega * t
        swing = 2.0 * np.sin(0.5 * angle) ** 2  # 1 - cos
        away = self.V / self.omega
        slip = self.V * t + self.stretch * swing - away * np.sin(angle)
        v = self.stretch * self.omega * np.sin(angle) + self.V * swing
        return slip, v, self.k * (self.stretch * np.cos(angle) + away * np.sin(angle))


class StickSlip(Reference):
    r"""Stick-slip of a mass on a spring whose end moves at constant speed, from rest with a relaxed spring.

    .. math:: t_{slip}=\frac2\omega\Big(\pi-\arctan\frac{\Delta\omega}V\Big),\quad t_{stick}=\frac{2\Delta}V,\quad
        v_{max}=V+\sqrt{V^2+\Delta^2\omega^2},\quad \Delta=\frac{t_s-t_k}k,\;\omega=\sqrt{k/m}

    The slip is :math:`Vt_{slip}+2\Delta`, the heat of a cycle :math:`t_k` times that, the mean traction exactly
    :math:`t_k`. Sliding begins at :math:`t_s/(kV)`. With :math:`t_s=t_k` it never rests again. Any t >= 0 and V > 0:
    the period is good to rounding over all decades of V.

    Source: Sauer, Duong & Mandadapu (2021), eqs. e:tt_max and e:dry_fric, with an oscillator, integrated.

    >>> slider = StickSlip(m=10.0, k=1e8, V=1e-3, t_s=6e4, t_k=4e4)
    >>> f"{slider.period:.12f} {slider.slip_time:.6e} {slider.v_max:.9f} {slider.heat_per_cycle:.9f}"
    '0.400994458826 9.944588e-04 0.633456323 16.039778353'
    """

    name: ClassVar[str] = "stick-slip"

    m: float = parameter("kg/m^2", "mass", above=0)
    k: float = parameter("Pa/m", "tangential stiffness", above=0)
    V: float = parameter("m/s", "speed of the spring's end", above=0)
    t_s: float = parameter("Pa", "traction that sticking bears", above=0)
    t_k: float = parameter("Pa", "traction of sliding", at_least=0)

    @classmethod
    def from_scene(cls, scene: SceneView) -> Parameters:
        held = {name: scene.support("tangential", name) for name in ("m", "k")}
        mu, mu_s, p = scene.friction("mu"), scene.friction("mu_s"), scene.initial("p")
        if mu is None or p is None:
            return {**held, "V": scene.ramp("w_t")}
        return {**held, "V": scene.ramp("w_t"), "t_k": mu * p, "t_s": max(mu, mu_s or 0.0) * p}

    def __post_init__(self) -> None:
        """Refuse a limit below the traction of sliding."""
        super().__post_init__()
        if self.t_s < self.t_k:
            raise InputError(f"{self.name}: t_s must not be below t_k = {self.t_k!r} Pa.")

    @property
    def slip(self) -> Slip:
        """The slip of every cycle."""
        return Slip(self.m, self.k, self.V, self.t_s - self.t_k)

    @property
    def onset_time(self) -> float:
        """Time [s] of the first slip."""
        return self.t_s / (self.k * self.V)

    @property
    def slip_time(self) -> float:
        """Duration [s] of a slip."""
        return self.slip.duration

    @property
    def stick_time(self) -> float:
        """Duration [s] of a stick."""
        return 2.0 * self.slip.stretch / self.V

    @property
    def period(self) -> float:
        """Duration [s] of a cycle."""
        return self.slip_time + self.stick_time

    @property
    def slip_distance(self) -> float:
        """Slip [m] of a cycle."""
        return self.slip.distance

    @property
    def v_max(self) -> float:
        """Largest sliding velocity [m/s]."""
        return self.slip.v_max

    @property
    def heat_per_cycle(self) -> float:
        """Heat [J/m^2] of a cycle."""
        return self.t_k * self.slip_distance

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        since = t - self.onset_time
        cycle = np.maximum(np.floor(since / self.period), 0.0)
        within = since - cycle * self.period
        slips = (since >= 0.0) & (within < self.slip_time)
        slip, v, above = self.slip.motion(np.where(slips, within, 0.0))
        held = np.where(since < 0.0, 0.0, self.slip_distance)
        rest = 2.0 * self.t_k - self.t_s + self.k * self.V * (within - self.slip_time)
        slip = cycle * self.slip_distance + np.where(slips, slip, held)
        spring = np.where(slips, self.t_k + above, np.where(since < 0.0, self.k * self.V * t, rest))
        tractions = {"t_t": np.where(slips, self.t_k, spring), "spring_traction": spring}
        return {"v": np.where(slips, v, 0.0), "u_t": slip, **tractions, "heat": self.t_k * slip}
