"""Body that bounces on a rigid one under a dead load, and comes to rest after infinitely many rebounds."""

from __future__ import annotations

import math

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.references._bodies import UniformBody
from surfacechem.references.base import Array, Quantities, read


class BouncingBody(UniformBody):
    r"""A mass falls under a constant load and rebounds with the fraction e of its velocity; the lost energy is heat.

    .. math:: a=-F/m,\quad V=\sqrt{v_i^2+2ag_i},\quad t_1=\frac{v_i+V}a,\quad t_{n+1}-t_n=\frac{2Ve^n}a,\quad
        t_\infty=t_1+\frac{2V}a\,\frac e{1-e},\quad T_n^2=T_i^2+\frac{T_0}Cm V^2\,(1-e^{2n})

    Quadratic energies, perfect thermal contact. Any t >= 0: from `rest_time` on the gap and its velocity are zero.

    Source: free fall and Newton's law of impact, summed.

    >>> plate = BouncingBody(m=5.0, e=0.5, F_n=-50.0, g_n_i=0.2, v_n_i=0.0, C=100.0, T_0=300.0, T_i=300.0)
    >>> plate.first, plate.rest_time, float(plate.solution(0.3)["g_n"])
    (0.2, 0.6000000000000001, 0.05)
    """

    m: float = parameter("kg/m^2", "mass", above=0)
    e: float = parameter("1", "coefficient of restitution", default=0.0, at_least=0, at_most=1)
    F_n: float = parameter("Pa", "load, negative where it presses", at_most=0)
    g_n_i: float = parameter("m", "initial gap", at_least=0)
    v_n_i: float = parameter("m/s", "initial opening velocity")

    readings = read(normal="m e", initial="F_n g_n_i=g_n v_n_i=v_n")

    @property
    def _fall(self) -> tuple[float, float]:
        """Acceleration towards contact, and speed of the first impact."""
        acceleration = -self.F_n / self.m
        return acceleration, math.sqrt(self.v_n_i**2 + 2 * acceleration * self.g_n_i)

    @property
    def first(self) -> float:
        """Time [s] of the first impact."""
        a, speed = self._fall
        if not a:
            return -self.g_n_i / self.v_n_i if self.v_n_i < 0 else math.inf
        return (self.v_n_i + speed) / a

    @property
    def rest_time(self) -> float:
        """Time [s] at which it comes to rest."""
        a, speed = self._fall
        if self.e == 1 or not a:
            return self.first if self.e == 0 else math.inf
        return self.first + 2 * speed / a * self.e / (1 - self.e)

    def quantities(self, t: Array) -> Quantities:
        a, speed = self._fall
        e, first = self.e, self.first
        flight = 2 * speed / a if a else math.inf  # time of flight from the speed of the first impact

        def flown(n: Array) -> Array:
            """Return the duration of n flights after the first impact, in units of ``flight``."""
            return n if e == 1 else e * (1 - e**n) / (1 - e)

        n = np.where(t < first, 0.0, 1.0)  # number of impacts at the times
        if a and e:
            flights = np.maximum((t - first) / flight, 0.0)
            left = np.maximum(1 - flights * (1 - e) / e, np.finfo(float).tiny)
            whole = np.floor(flights if e == 1 else np.log(left) / math.log(e))
            # The logarithm is rounded, so that the number may be one too small or too large.
            whole += np.where(flights >= flown(whole + 1), 1.0, 0.0) - np.where(flights < flown(whole), 1.0, 0.0)
            n = np.where(t < first, 0.0, whole + 1)
        since = np.where(n > 0, t - (first + (flight * flown(n - 1) if a else 0.0)), t)
        v = np.where(n > 0, speed * e**n, self.v_n_i)
        g = np.where(n > 0, 0.0, self.g_n_i) + v * since - a * since**2 / 2
        rests = t >= self.rest_time
        heat = self.m * speed**2 / 2 * np.where(rests, 1.0, 1 - e ** (2 * n))
        return {
            "g_n": np.where(rests, 0.0, g),
            "v_n": np.where(rests, 0.0, v - a * since),
            "released": heat,
            "T": self.heated(heat),
        }
