"""Two flats that attract and repel each other by a Lennard-Jones type potential."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.errors import InputError
from surfacechem.references._roots import increasing_root
from surfacechem.references.base import Array, Reference

Y_FOLD = 2.0 ** (1.0 / 3.0)


@dataclass(frozen=True)
class Snap:
    """Gap and far-field displacement [m] at which a gap on a spring is lost."""

    g: float
    w: float


class LennardJonesFlats(Reference):
    r"""Energy and traction between two flats that move at constant speed, and their characteristic values.

    .. math:: W=Ag_0^2\Big[\frac1{360}\Big(\frac{g_0}{g_n}\Big)^8-\frac16\Big(\frac{g_0}{g_n}\Big)^2\Big],\quad
        t_n=-Ag_0\Big[\frac1{45}\Big(\frac{g_0}{g_n}\Big)^9-\frac13\Big(\frac{g_0}{g_n}\Big)^3\Big],\quad
        A=2\pi n_1n_2\psi_0

    No traction at :math:`g_015^{-1/6}`, strength :math:`\frac{2\sqrt5}9Ag_0` at :math:`g_05^{-1/6}`, adhesion energy
    :math:`\frac{15^{1/3}}8Ag_0^2`, largest softening :math:`\frac352^{2/3}A` at :math:`g_02^{-1/6}`. On a spring the
    gap is lost where the softening is the spring's stiffness. Here :math:`g_n=g_i+\dot gt>0`.

    Source: Sauer, Duong & Mandadapu (2021), eqs. e:psi12ex and e:bt_sr.

    >>> flats = LennardJonesFlats(n_1=2e19, n_2=3e19, psi_0=4e-21, g_0=3e-10, g_i=3e-10)
    >>> f"{flats.strength:.9e} {flats.adhesion_energy:.9f} {flats.largest_softening:.9e}"
    '2.247940714e+09 0.418383022 1.436246635e+19'
    """

    name: ClassVar[str] = "lennard-jones-flats"

    n_1: float = parameter("1/m^2", "density of interacting sites on body 1", above=0)
    n_2: float = parameter("1/m^2", "density of interacting sites on body 2", above=0)
    psi_0: float = parameter("J", "interaction energy of a pair", above=0)
    g_0: float = parameter("m", "range of the interaction", above=0)
    g_i: float = parameter("m", "initial gap", above=0)
    g_dot: float = parameter("m/s", "opening speed", default=0.0)

    @property
    def A(self) -> float:
        """Stiffness scale [Pa/m]."""
        return 2.0 * math.pi * self.n_1 * self.n_2 * self.psi_0

    @property
    def end_time(self) -> float:
        """Time [s] at which flats that approach meet."""
        return -self.g_i / self.g_dot if self.g_dot < 0.0 else math.inf

    @property
    def equilibrium_gap(self) -> float:
        """Gap [m] without traction."""
        return float(self.g_0 * 15.0 ** (-1.0 / 6.0))

    @property
    def strength_gap(self) -> float:
        """Gap [m] of the largest tension."""
        return float(self.g_0 * 5.0 ** (-1.0 / 6.0))

    @property
    def strength(self) -> float:
        """Largest tension [Pa]."""
        return 2.0 * math.sqrt(5.0) / 9.0 * self.A * self.g_0

    @property
    def adhesion_energy(self) -> float:
        """Work of separation [J/m^2]."""
        return float(15.0 ** (1.0 / 3.0) / 8.0 * self.A * self.g_0**2)

    @property
    def largest_softening(self) -> float:
        """Stiffness [Pa/m] from which on a spring holds the flats at any gap."""
        return 0.6 * Y_FOLD**2 * self.A

    def snap_in(self, k: float) -> Snap:
        """Where approaching flats on a spring of stiffness k [Pa/m] jump together."""
        self._check(k)
        y = increasing_root(lambda y: (_softening(y), _change(y)), *self._span(k, 0.0, Y_FOLD))
        return self._snap(y, k)

    def pull_off(self, k: float) -> Snap:
        """Where receding flats on a spring of stiffness k [Pa/m] jump apart."""
        self._check(k)
        target, low, high = self._span(k, Y_FOLD, 5.0 ** (1.0 / 3.0))
        y = -increasing_root(lambda x: (_softening(-x), -_change(-x)), target, -high, -low)
        return self._snap(y, k)

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        g = self.g_i + self.g_dot * t
        return {"g_n": g, "W": self.energy(g), "t_n": self.traction(g)}

    def energy(self, g: Array) -> Array:
        """Energy [J/m^2] at a gap."""
        square = (self.g_0 / g) ** 2
        return np.asarray(self.A * self.g_0**2 * square * (square**3 / 360.0 - 1.0 / 6.0))

    def traction(self, g: Array) -> Array:
        """Tension [Pa] at a gap."""
        ratio = self.g_0 / g
        return np.asarray(-self.A * self.g_0 * ratio**3 * (ratio**6 / 45.0 - 1.0 / 3.0))

    def _check(self, k: float) -> None:
        if not 0.0 < k < self.largest_softening:
            raise InputError(f"{self.name}: no jump with k = {k!r} Pa/m; it takes 0 < k < {self.largest_softening!r}.")

    def _span(self, k: float, low: float, high: float) -> tuple[Array, Array, Array]:
        return np.array([k / self.A]), np.array([low]), np.array([high])

    def _snap(self, y: Array, k: float) -> Snap:
        g = self.g_0 / np.sqrt(y)
        return Snap(float(g[0]), float((g + self.traction(g) / k)[0]))


def _softening(y: Array) -> Array:
    """-dt_n/dg over A as a function of (g_0 / g)^2."""
    return y**2 * (1.0 - y**3 / 5.0)


def _change(y: Array) -> Array:
    return y * (2.0 - y**3)
