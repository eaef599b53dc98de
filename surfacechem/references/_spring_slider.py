"""One slip of a mass on a driven spring: half an oscillation about steady sliding and a bit more."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from surfacechem.references.base import Array


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
