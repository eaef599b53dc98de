"""Bodies that conduct heat, by Laplace transformation: what they answer to heat at their contact, and the way back.

Source: Carslaw & Jaeger (1959), Conduction of Heat in Solids, chapter XII; Weideman & Trefethen (2007), Parabolic and
hyperbolic contours for computing the Bromwich integral, Math. Comp. 76, and Trefethen, Weideman & Schmelzer (2006),
Talbot quadratures and rational approximations, BIT 46, for the contour.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from surfacechem.references.base import Array

Complex: TypeAlias = NDArray[Any]
"""Complex values."""

NODES = 24
"""Points on the contour: each gains a factor of 3.9, until rounding is reached."""

HELD = 1e300
"""Conductance at a far side that is held at a temperature."""


def inverted(image: Callable[[Complex], Complex], t: Array) -> Array:
    """The function of times t > 0 whose Laplace transform is ``image``.

    >>> bool(abs(inverted(lambda s: 1 / (s + 2), np.array([0.5]))[0] - np.exp(-1)) < 1e-12)
    True
    """
    angle = (2 * np.arange(NODES // 2) + 1) * np.pi / NODES
    path = NODES * (0.5017 * angle / np.tan(0.6407 * angle) - 0.6122 + 0.2645j * angle)
    slope = NODES * (0.5017 / np.tan(0.6407 * angle) - 0.5017 * 0.6407 * angle / np.sin(0.6407 * angle) ** 2 + 0.2645j)
    result = np.zeros(t.shape)
    for z, weight in zip(path, np.exp(path) * slope, strict=True):
        # The other half of the contour is the complex conjugate.
        result += 2 * np.imag(weight * image(z / t) / t) / NODES
    return result


@dataclass(frozen=True)
class Slab:
    """A body of capacity C and conductivity k over its thickness, both per area; a lump without conductivity.

    Beyond the far side is ``T_far`` behind a conductance; without a capacity the body keeps its temperature.
    """

    T: float
    C: float
    thickness: float = 1.0
    conductivity: float = 0.0
    h_far: float = 0.0
    T_far: float = 0.0

    def _wave(self, s: Complex) -> tuple[Complex, Complex, Complex]:
        """Decay per length, k times it, and what a wave has lost across the slab and back."""
        p = np.sqrt(s * self.C / (self.conductivity * self.thickness))
        return p, self.conductivity * p, np.exp(-2 * p * self.thickness)

    def answer(self, s: Complex, x: float = 0.0) -> Complex:
        """Temperature at x per heat flux into the contact."""
        if not self.C:
            return np.zeros_like(s)
        if not self.conductivity:
            return 1 / (self.C * s)
        p, kp, E = self._wave(s)
        back = (kp - self.h_far) / (kp + self.h_far)
        return (np.exp(-p * x) + back * np.exp(-p * (2 * self.thickness - x))) / (kp * (1 - back * E))

    def open(self, s: Complex, x: float = 0.0) -> Complex:
        """Temperature at x less the initial one where nothing enters at the contact."""
        if not (self.C and self.conductivity and self.h_far):
            return np.zeros_like(s)
        p, kp, E = self._wave(s)
        rise = (self.T_far - self.T) / s / (kp / self.h_far * (1 - E) + 1 + E)
        result: Complex = rise * (np.exp(-p * (self.thickness - x)) + np.exp(-p * (self.thickness + x)))
        return result


def flux(first: Slab, second: Slab, resistance: float, s: Complex) -> Complex:
    """Heat flux from the first to the second body."""
    drive = (first.T - second.T) / s + first.open(s) - second.open(s)
    return drive / (first.answer(s) + second.answer(s) + resistance)


def temperature(bodies: tuple[Slab, Slab], resistance: float, number: int, x: float, t: Array) -> Array:
    """Temperature of a body at a distance from the contact, at t > 0."""
    body, sign = bodies[number - 1], 1.0 if number == 2 else -1.0

    def rise(s: Any) -> Any:
        return body.open(s, x) + sign * flux(*bodies, resistance, s) * body.answer(s, x)

    return body.T + inverted(rise, t)
