"""Stick-slip with bonds that form again while the contact sticks."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import islice
from typing import ClassVar

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.errors import InputError
from surfacechem.references._inversion import increasing_root
from surfacechem.references.base import Array, Parameters, SceneView
from surfacechem.references.stick_slip import Slip
from surfacechem.references.stick_slip_debonding import BondedSlider

CYCLES = 1_000_000
"""Cycles at most, so that a time far beyond them is refused and not waited for."""


@dataclass(frozen=True)
class Cycle:
    """A stick and the slip that ends it."""

    start: float
    """Spring traction [Pa] at the beginning of the stick."""
    stick_time: float
    phi: float
    """Bonding state at the end of the stick."""
    limit: float
    """Traction [Pa] at the end of the stick."""
    slip: Slip

    @property
    def duration(self) -> float:
        """Stick and slip [s]."""
        return self.stick_time + self.slip.duration


class StickSlipRebonding(BondedSlider):
    r"""Stick-slip with a sticking limit that grows as bonds form; sliding breaks all of them.

    .. math:: \dot\phi=\frac{1-\phi}\tau,\quad t_s=p\,[\mu_{ub}+(\mu_b-\mu_{ub})\phi],\quad
        s=\alpha+\tau W_0\Big(-\frac\beta\tau e^{-\alpha/\tau}\Big)

    is the duration of a stick that begins with the traction :math:`t_b`, with :math:`\alpha=(p\mu_b-t_b)/(kV)`,
    :math:`\beta=p(\mu_b-\mu_{ub})/(kV)`; the next begins with :math:`2t_k-t_s`. In the steady cycle
    :math:`\alpha=2p(\mu_b-\mu_k)/(kV)`, :math:`\beta=2p(\mu_b-\mu_{ub})/(kV)`. For :math:`\mu_{ub}=\mu_k` there is none
    above :math:`V_c=2p(\mu_b-\mu_{ub})/(k\tau)`. Near there the Lambert function loses all digits; what is solved, to
    rounding, is the equation without it. The contact starts at rest, without bonds, with a relaxed spring.

    Source: sticking limit of Sauer, Duong & Mandadapu (2021), eq. e:mu0, at T_0, with an oscillator, integrated.

    >>> slider = StickSlipRebonding(m=10.0, k=1e8, V=7.5e-5, p=1e5, mu_b=0.7, mu_ub=0.4, mu_k=0.4, tau=2.0)
    >>> f"{slider.steady.stick_time:.9f} {slider.critical_speed:.9f}"
    '7.841380790 0.000300000'
    """

    name: ClassVar[str] = "stick-slip-rebonding"

    tau: float = parameter("s", "time scale of bonding", above=0)

    @classmethod
    def from_scene(cls, scene: SceneView) -> Parameters:
        return {**super().from_scene(scene), "tau": scene.relaxation_time}

    @property
    def critical_speed(self) -> float:
        """Speed [m/s] above which a contact with mu_ub = mu_k slides without rest."""
        return 2.0 * self.p * (self.mu_b - self.mu_ub) / (self.k * self.tau)

    @property
    def steady(self) -> Cycle:
        """The cycle that repeats."""
        excess = 2.0 * self.p * (self.mu_ub - self.mu_k)
        if excess == 0.0 and self.critical_speed <= self.V:
            raise InputError(f"{self.name}: no stick-slip above V = {self.critical_speed!r} m/s.")
        cycle = self._cycle(math.nan, excess, 2.0)
        return Cycle(2.0 * self.p * self.mu_k - cycle.limit, cycle.stick_time, cycle.phi, cycle.limit, cycle.slip)

    def cycles(self) -> Iterator[Cycle]:
        """The cycles from the start on."""
        start = 0.0
        while True:
            cycle = self._cycle(start, self.p * self.mu_ub - start, 1.0)
            yield cycle
            start = 2.0 * self.p * self.mu_k - cycle.limit

    def heat(self, cycle: Cycle) -> float:
        """Heat [J/m^2] of a cycle."""
        return self.p * self.mu_k * cycle.slip.distance

    def _cycle(self, start: float, missing: float, weight: float) -> Cycle:
        """The stick after which the spring has pulled by `missing` more than `weight` times what bonds have added."""
        scale = self.k * self.V * self.tau
        ratio = weight * self.p * (self.mu_b - self.mu_ub) / scale
        target, low = np.array([missing / scale]), np.array([max(math.log(ratio), 0.0) if ratio > 0.0 else 0.0])
        x = float(
            increasing_root(
                lambda x: (x + ratio * np.expm1(-x), 1.0 - ratio * np.exp(-x)), target, low, target + ratio
            )[0]
        )
        phi = -math.expm1(-x)
        limit = self.p * (self.mu_ub + (self.mu_b - self.mu_ub) * phi)
        drop = self.p * ((self.mu_ub - self.mu_k) + (self.mu_b - self.mu_ub) * phi)
        return Cycle(start, x * self.tau, phi, limit, Slip(self.m, self.k, self.V, drop))

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        values = np.zeros((6, len(t)))
        begin, slipped, last = 0.0, 0.0, float(np.max(t, initial=0.0))
        for cycle in islice(self.cycles(), CYCLES):
            inside = (t >= begin) & (t < begin + cycle.duration)
            values[:, inside] = self._within(cycle, t[inside] - begin, slipped)
            begin, slipped = begin + cycle.duration, slipped + cycle.slip.distance
            if begin > last:
                break
        else:
            raise InputError(f"{self.name}: more than {CYCLES} cycles until t = {last!r} s.")
        return dict(zip(("phi", "v", "u_t", "t_t", "spring_traction", "heat"), values, strict=True))

    def _within(self, cycle: Cycle, t: Array, slipped: float) -> Array:
        sticks = t < cycle.stick_time
        slip, v, above = cycle.slip.motion(np.where(sticks, 0.0, t - cycle.stick_time))
        phi = np.where(sticks, -np.expm1(-t / self.tau), 0.0)
        spring = np.where(sticks, cycle.start + self.k * self.V * t, self.p * self.mu_k + above)
        t_t = np.where(sticks, spring, self.p * self.mu_k)
        slip = slipped + slip
        return np.array([phi, v, slip, t_t, spring, self.p * self.mu_k * slip])
