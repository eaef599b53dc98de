"""Two bodies of constant capacity that exchange heat with a heated medium between them, with capacity or without."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import ClassVar

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.references._special_functions import first_difference, second_difference
from surfacechem.references.base import Array, Parameters, Reference, SceneView


class HeatedMedium(Reference):
    r"""Bodies of constant capacity, a medium between them, and the source :math:`D_0+D_1e^{-\gamma t}` in it."""

    C_1: float = parameter("J/(m^2 K)", "heat capacity of body 1", above=0)
    C_2: float = parameter("J/(m^2 K)", "heat capacity of body 2", above=0)
    h_1: float = parameter("W/(m^2 K)", "conductance between medium and body 1", above=0)
    h_2: float = parameter("W/(m^2 K)", "conductance between medium and body 2", above=0)
    T_1: float = parameter("K", "initial temperature of body 1", above=0)
    T_2: float = parameter("K", "initial temperature of body 2", above=0)
    D_0: float = parameter("W/m^2", "steady part of the source", default=0.0)
    D_1: float = parameter("W/m^2", "decaying part of the source at the start", default=0.0)
    gamma: float = parameter("1/s", "decay rate of the source", default=0.0, at_least=0)

    @classmethod
    def from_scene(cls, scene: SceneView) -> Parameters:
        bodies = {name: scene.constant(name) for name in ("C_1", "C_2")}
        start = {name: scene.initial(name) for name in ("T_1", "T_2")}
        paths = {f"h_{k}": scene.conductance(into=k) for k in (1, 2)}
        return {**bodies, **start, **paths, "D_0": scene.heating_at_T_0}


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

    @classmethod
    def from_scene(cls, scene: SceneView) -> Parameters:
        return {**super().from_scene(scene), "C_c": scene.constant("C_c"), "T_c": scene.initial("T_c")}

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        (q_1, heat_1), (q_2, heat_2), sizes = self._fluxes(t)
        to_1, to_2, (by_1, by_2, off_1, off_2) = q_1 / self.h_1, q_2 / self.h_2, sizes
        given = self.D_0 * t + self.D_1 * t * first_difference(np.zeros_like(t), -self.gamma * t)
        stored = (given - heat_1 - heat_2) / self.C_c
        by_c = self.T_c + (np.abs(given) + by_1 * self.C_1 + by_2 * self.C_2) / self.C_c
        bodies = self.T_1 + heat_1 / self.C_1, self.T_2 + heat_2 / self.C_2
        # Each temperature by the way on which the least is lost: its own heat, or that of another and the flux between.
        ways = (self.T_1 + by_1 + off_1, self.T_2 + by_2 + off_2, by_c)
        T_c = np.choose(np.argmin(ways, axis=0), (bodies[0] + to_1, bodies[1] + to_2, self.T_c + stored))
        least = np.min(ways, axis=0)
        T_1 = np.where(self.T_1 + by_1 <= least + off_1, bodies[0], T_c - to_1)
        T_2 = np.where(self.T_2 + by_2 <= least + off_2, bodies[1], T_c - to_2)
        return {"T_1": T_1, "T_2": T_2, "T_c": T_c, "q_1": q_1, "q_2": q_2}

    def _fluxes(self, t: Array) -> tuple[tuple[Array, Array], tuple[Array, Array], tuple[Array, Array, Array, Array]]:
        """Flux and heat into each body, and the sizes of the terms that they are sums of, as temperatures [K]."""
        q, heat, by, off = np.zeros((4, 2, t.size))
        for rate, mode, initial in self.modes():
            for k, (root, C, h) in enumerate(((self._root_1, self.C_1, self.h_1), (self._root_2, self.C_2, self.h_2))):
                amplitude, integral, size, area = self._mode_in_time(t, rate, mode, initial)
                q[k] += root * mode[k] * amplitude
                heat[k] += root * mode[k] * integral
                by[k] += root * abs(mode[k]) * area / C
                off[k] += root * abs(mode[k]) * size / h
        return (q[0], heat[0]), (q[1], heat[1]), (by[0], by[1], off[0], off[1])

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

    def _mode_in_time(
        self, t: Array, rate: float, mode: tuple[float, float], initial: float
    ) -> tuple[Array, Array, Array, Array]:
        """Amplitude of a mode and its integral over time, of free decay and sources, and the sizes of their terms."""
        zero, decay, source_decay = np.zeros_like(t), -rate * t, -self.gamma * t
        total = self.C_1 + self.C_2 + self.C_c
        drive = rate * (mode[0] * self.C_1 / total / self._root_1 + mode[1] * self.C_2 / total / self._root_2)
        amplitudes = [initial * np.exp(decay)]
        integrals = [initial * t * first_difference(zero, decay)]
        for strength, exponent in ((self.D_0, zero), (self.D_1, source_decay)):
            amplitudes.append(strength * drive * t * first_difference(exponent, decay))
            integrals.append(strength * drive * t**2 * second_difference(exponent, decay))
        sizes = (np.sum(np.abs(terms), axis=0) for terms in (amplitudes, integrals))
        return np.sum(amplitudes, axis=0), np.sum(integrals, axis=0), *sizes


class ThreeTemperaturesNoCapacity(HeatedMedium):
    r"""Two bodies of constant capacity and a medium without: the limit C_c = 0, an algebraic temperature.

    .. math:: T_c=\frac{h_1T_1+h_2T_2+D}{h_1+h_2},\qquad
        q_1=\alpha_1D+h(T_2-T_1),\quad q_2=\alpha_2D-h(T_2-T_1)

    with :math:`D=D_0+D_1e^{-\gamma t}`, :math:`\alpha_k=h_k/(h_1+h_2)`, :math:`h=h_1h_2/(h_1+h_2)`. The difference
    :math:`T_2-T_1` decays at the rate :math:`h(1/C_1+1/C_2)` and is driven by
    :math:`(\alpha_2/C_2-\alpha_1/C_1)D`. The medium starts from its algebraic temperature. Any t >= 0.

    Source: Sauer, Duong & Mandadapu (2021), section 5.6 (heat transfer), with constant capacities, integrated.

    >>> bodies = ThreeTemperaturesNoCapacity(C_1=1200.0, C_2=500.0, h_1=2500.0, h_2=700.0, T_1=290.0, T_2=350.0,
    ...                                      D_0=150.0, D_1=4000.0, gamma=3.0)
    >>> f"{bodies.solution(100.0)['T_c']:.12f}"
    '317.303334981051'
    """

    name: ClassVar[str] = "three-temperatures-no-capacity"

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        share_1, share_2 = self.h_1 / (self.h_1 + self.h_2), self.h_2 / (self.h_1 + self.h_2)
        h = share_1 * self.h_2
        decay = -self.gamma * t
        source = self.D_0 + self.D_1 * np.exp(decay)
        source_energy = self.D_0 * t + self.D_1 * t * first_difference(np.zeros_like(t), decay)
        difference, difference_integral = self._difference(t, h, share_2 / self.C_2 - share_1 / self.C_1)
        T_1 = self.T_1 + (share_1 * source_energy + h * difference_integral) / self.C_1
        T_2 = self.T_2 + (share_2 * source_energy - h * difference_integral) / self.C_2
        return {
            "T_1": T_1,
            "T_2": T_2,
            "T_c": share_1 * T_1 + share_2 * T_2 + source / (self.h_1 + self.h_2),
            "q_1": share_1 * source + h * difference,
            "q_2": share_2 * source - h * difference,
        }

    def _difference(self, t: Array, h: float, drive: float) -> tuple[Array, Array]:
        """T_2 - T_1 and its integral over time."""
        zero, decay, source_decay = np.zeros_like(t), -h * (1.0 / self.C_1 + 1.0 / self.C_2) * t, -self.gamma * t
        initial = self.T_2 - self.T_1
        value, integral = initial * np.exp(decay), initial * t * first_difference(zero, decay)
        for strength, exponent in ((self.D_0, zero), (self.D_1, source_decay)):
            value = value + strength * drive * t * first_difference(exponent, decay)
            integral = integral + strength * drive * t**2 * second_difference(exponent, decay)
        return value, integral
