"""Free slider brought to rest by direction-dependent dry friction."""

from __future__ import annotations

import math

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.references._bodies import UniformBody
from surfacechem.references._numerics import increasing_root
from surfacechem.references.base import Array, Quantities, read


class AnisotropicSlide(UniformBody):
    r"""A free mass slides on dry friction with a coefficient for each axis, and turns towards the smoother one.

    .. math:: \frac{v_2}{v_{2i}} = \Big(\frac v{v_i}\Big)^r, \quad r = \frac{\mu_2}{\mu_1} \ge 1, \quad
        t_{stop} - t = \frac m{\mu_1 p} I_1(v), \quad u_{stop} - u = \frac m{\mu_1 p} I_2(v)

    .. math:: I_k(v) = \int_0^v x^{k-1} \sqrt{1 + c^2 x^{2 (r - 1)}}\,dx, \quad c = v_{2i} / v_i^r,

    which is a hypergeometric function; for the other axis :math:`c\,I_{1+r}` replaces :math:`I_2`. All kinetic energy
    becomes heat. Quadratic energies, perfect thermal contact. Any t >= 0: from `stop_time` on v is exactly zero.

    Source: Sauer, Duong & Mandadapu (2021), eq. e:dry_fric with a tensor of coefficients, with Newton's law: the
    quotient of its components separates.

    >>> slider = AnisotropicSlide(m=5.0, mu_1=0.2, mu_2=0.4, p=3e4, v_i=1.2, v_2_i=1.6, C=100.0, T_0=300.0, T_i=300.0)
    >>> round(slider.stop_time, 15), float(slider.solution(0.01)["v_2"])
    (0.001245312941584, 0.0)
    """

    m: float = parameter("kg/m^2", "mass", above=0)
    mu_1: float = parameter("1", "friction coefficient along v", above=0)
    mu_2: float = parameter("1", "friction coefficient along v_2, at least mu_1", above=0)
    p: float = parameter("Pa", "contact pressure", above=0)
    v_i: float = parameter("m/s", "initial velocity", above=0)
    v_2_i: float = parameter("m/s", "initial velocity across it")

    readings = read(tangential="m", friction="mu_1 mu_2", initial="p v_i=v v_2_i=v_2")

    @property
    def stop_time(self) -> float:
        """Time [s] at which the mass comes to rest."""
        return float(self._integral(1.0, np.array(1.0)) * self.v_i * self.m / (self.mu_1 * self.p))

    def _integral(self, k: float, x: Array) -> Array:
        """Return I_k of the velocity relative to the initial one."""
        from scipy.special import hyp2f1

        z, e = (self.v_2_i / self.v_i) ** 2, 2 * (self.mu_2 / self.mu_1 - 1)
        if e == 0:
            return np.asarray(x**k / k * math.sqrt(1 + z))
        return np.asarray(x**k / k * hyp2f1(-0.5, k / e, 1 + k / e, -z * x**e))

    def quantities(self, t: Array) -> Quantities:
        ratio, slope, deceleration = self.mu_2 / self.mu_1, self.v_2_i / self.v_i, self.mu_1 * self.p / self.m
        left = np.maximum(self.stop_time - t, 0) * deceleration / self.v_i

        def passed(x: Array) -> tuple[Array, Array]:
            return self._integral(1.0, x), np.sqrt(1 + slope**2 * x ** (2 * (ratio - 1)))

        # Velocity along the first axis relative to the initial one, zero from the stop on.
        x = increasing_root(passed, left, np.zeros_like(t), np.ones_like(t), np.sign(left))
        v, v_2 = self.v_i * x, self.v_2_i * x**ratio
        path, across = (self._integral(k, np.array(1.0)) - self._integral(k, x) for k in (2.0, 1.0 + ratio))
        speed = np.hypot(v, v_2)
        heat = 0.5 * self.m * (math.hypot(self.v_i, self.v_2_i) ** 2 - speed**2)
        turn = np.arctan(slope * x ** (ratio - 1)) - math.atan(slope)
        return {
            "v": v,
            "v_2": v_2,
            "speed": speed,
            "turn": np.where(x > 0, turn, 0.0),
            "u_t": path * self.v_i**2 / deceleration,
            "u_t2": across * self.v_i * self.v_2_i / deceleration,
            "heat": heat,
            "T": self.heated(heat),
        }
