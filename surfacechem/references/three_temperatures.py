"""Two bodies that exchange heat with a medium between them, constant capacities."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import ClassVar

import numpy as np

from surfacechem.references._exponentials import first_difference, second_difference
from surfacechem.references._media import HeatedMedium
from surfacechem.references.base import Array
from surfacechem.terms import parameter


class ThreeTemperatures(HeatedMedium):
    r"""Two bodies and a medium with heat capacity, all constant, and a decaying source in the medium.

    .. math:: C_k\dot T_k=q_k=h_k(T_c-T_k),\qquad C_c\dot T_c=D_0+D_1e^{-\gamma t}-q_1-q_2

    In :math:`y_k=\sqrt{h_k}(T_c-T_k)` the matrix is symmetric and positive,
    :math:`S_{kl}=\delta_{kl}\frac{h_k}{C_k}+\frac{\sqrt{h_kh_l}}{C_c}`. Each of its two modes answers to the source by
    divided differences of the exponential, and so do the integrals of :math:`q_k` that give the temperatures; the
    response to a steady source, :math:`q_k=D\,C_k/C`, is used to drive the modes. The slow rate is
    :math:`h_1h_2C/(C_1C_2C_c)` over the fast one. No step loses digits for :math:`C_c\to0` or :math:`h_k\to0,\infty`.

    Any t >= 0. Source: Sauer, Duong & Mandadapu (2021), section 5.6 (heat transfer) with constant capacities, solved
    by diagonalisation.

    >>> bodies = ThreeTemperatures(C_1=1200.0, C_2=500.0, C_c=8.0, h_1=2500.0, h_2=700.0,
    ...                            T_1=290.0, T_2=350.0, T_c=300.0, D_0=400.0)
    >>> f"{bodies.solution(10.0)['T_c']:.12f}"
    '310.081108421144'
    """

    name: ClassVar[str] = "three-temperatures"

    C_c: float = parameter("J/(m^2 K)", "heat capacity of the medium", above=0)
    T_c: float = parameter("K", "initial temperature of the medium", above=0)

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        q_1, q_2, heat_1, heat_2 = np.zeros((4, t.size))
        for rate, mode, initial in self.modes():
            amplitude, integral = self._mode_in_time(t, rate, mode, initial)
            q_1, q_2 = q_1 + self._root_1 * mode[0] * amplitude, q_2 + self._root_2 * mode[1] * amplitude
            heat_1, heat_2 = heat_1 + self._root_1 * mode[0] * integral, heat_2 + self._root_2 * mode[1] * integral
        T_1, T_2 = self.T_1 + heat_1 / self.C_1, self.T_2 + heat_2 / self.C_2
        to_1, to_2 = q_1 / self.h_1, q_2 / self.h_2
        T_c = np.where(np.abs(to_1) < np.abs(to_2), T_1 + to_1, T_2 + to_2)
        return {"T_1": T_1, "T_2": T_2, "T_c": T_c, "q_1": q_1, "q_2": q_2}

    @property
    def _root_1(self) -> float:
        return float(np.sqrt(self.h_1))

    @property
    def _root_2(self) -> float:
        return float(np.sqrt(self.h_2))

    def modes(self) -> Iterator[tuple[float, tuple[float, float], float]]:
        """Decay rate [1/s], unit vector and initial amplitude of the fast and of the slow mode."""
        fast, slow, (along, across) = self._rates_and_axes()
        start = (self._root_1 * (self.T_c - self.T_1), self._root_2 * (self.T_c - self.T_2))
        yield fast, (along, across), along * start[0] + across * start[1]
        yield slow, (-across, along), along * start[1] - across * start[0]

    def _rates_and_axes(self) -> tuple[float, float, tuple[float, float]]:
        """Eigenvalues of S and the eigenvector of the larger one: a Jacobi rotation, accurate entry by entry."""
        own_1, own_2 = self.h_1 / self.C_1, self.h_2 / self.C_2
        coupling = self._root_1 * self._root_2 / self.C_c
        half_gap = 0.5 * ((own_1 - own_2) / coupling + (self.h_1 - self.h_2) / (self._root_1 * self._root_2))
        tangent = 1.0 / (abs(half_gap) + np.hypot(1.0, half_gap))
        cosine = 1.0 / np.hypot(1.0, tangent)
        fast = max(own_1 + self.h_1 / self.C_c, own_2 + self.h_2 / self.C_c) + coupling * tangent
        slow = own_1 * (self.h_2 / self.C_c) * ((self.C_1 + self.C_2 + self.C_c) / self.C_2) / fast
        axes = (cosine, cosine * tangent)
        return fast, slow, axes if half_gap >= 0.0 else axes[::-1]

    def _mode_in_time(self, t: Array, rate: float, mode: tuple[float, float], initial: float) -> tuple[Array, Array]:
        """Amplitude of a mode and its integral over time: free decay plus the answers to the two sources."""
        zero, decay, source_decay = np.zeros_like(t), -rate * t, -self.gamma * t
        total = self.C_1 + self.C_2 + self.C_c
        drive = rate * (mode[0] * self.C_1 / total / self._root_1 + mode[1] * self.C_2 / total / self._root_2)
        amplitude = initial * np.exp(decay)
        integral = initial * t * first_difference(zero, decay)
        for strength, exponent in ((self.D_0, zero), (self.D_1, source_decay)):
            amplitude = amplitude + strength * drive * t * first_difference(exponent, decay)
            integral = integral + strength * drive * t**2 * second_difference(exponent, decay)
        return amplitude, integral
