"""Two bodies of constant capacity that exchange heat with a heated medium between them, with capacity or without."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.references._numerics import first_difference, second_difference
from surfacechem.references.base import Array, Quantities, Reference, read


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

    readings = read(constant="C_1 C_2", initial="T_1 T_2", conductance="h_1=1 h_2=2", heating_at_T_0="D_0")


class ThreeTemperatures(HeatedMedium):
    r"""Two bodies and a medium with heat capacity, all constant, and a decaying source in the medium.

    .. math:: C_k\dot T_k=q_k=h_k(T_c-T_k),\qquad C_c\dot T_c=D_0+D_1e^{-\gamma t}-q_1-q_2

    In :math:`y_k=\sqrt{h_k}(T_c-T_k)` the matrix is symmetric and positive,
    :math:`S_{kl}=\delta_{kl}\frac{h_k}{C_k}+\frac{\sqrt{h_kh_l}}{C_c}`. The response of each of its two modes to the
    source consists of divided differences of the exponential, and so do the integrals of :math:`q_k` that give the
    temperatures; the response to a steady source, :math:`q_k=D\,C_k/C`, is used to drive the modes. The slow rate is
    :math:`h_1h_2C/(C_1C_2C_c)` over the fast one. No step loses digits for :math:`C_c\to0` or :math:`h_k\to0,\infty`.

    Any t >= 0. Source: Sauer, Duong & Mandadapu (2021), section 5.6 (heat transfer) with constant capacities, solved
    by diagonalisation.

    >>> bodies = ThreeTemperatures(C_1=1200.0, C_2=500.0, C_c=8.0, h_1=2500.0, h_2=700.0,
    ...                            T_1=290.0, T_2=350.0, T_c=300.0, D_0=400.0)
    >>> f"{bodies.solution(10.0)['T_c']:.12f}"
    '310.081108421144'
    """

    C_c: float = parameter("J/(m^2 K)", "heat capacity of the medium", above=0)
    T_c: float = parameter("K", "initial temperature of the medium", above=0)

    readings = read(constant="C_c", initial="T_c")

    def quantities(self, t: Array) -> Quantities:
        zero, decay, total = np.zeros_like(t), -self.gamma * t, self.C_1 + self.C_2 + self.C_c
        # Flux and heat into each body, and the sizes of their terms as temperatures [K].
        q, heat, by, off = np.zeros((4, 2, t.size))
        for rate, mode, initial in self.modes():
            # Amplitude of the mode and its integral over time: free decay and both parts of the source.
            drive = rate * sum(axis * C / total / root for axis, C, _, root in zip(mode, *self._paths, strict=True))
            free = -rate * t
            amplitudes, integrals = [initial * np.exp(free)], [initial * t * first_difference(zero, free)]
            for strength, exponent in ((self.D_0, zero), (self.D_1, decay)):
                amplitudes.append(strength * drive * t * first_difference(exponent, free))
                integrals.append(strength * drive * t**2 * second_difference(exponent, free))
            for k, (axis, C, h, root) in enumerate(zip(mode, *self._paths, strict=True)):
                q[k] += root * axis * np.sum(amplitudes, axis=0)
                heat[k] += root * axis * np.sum(integrals, axis=0)
                by[k] += root * abs(axis) * np.sum(np.abs(integrals), axis=0) / C
                off[k] += root * abs(axis) * np.sum(np.abs(amplitudes), axis=0) / h
        given = self.D_0 * t + self.D_1 * t * first_difference(zero, decay)
        by_c = self.T_c + (np.abs(given) + by[0] * self.C_1 + by[1] * self.C_2) / self.C_c
        bodies, to = (self.T_1 + heat[0] / self.C_1, self.T_2 + heat[1] / self.C_2), (q[0] / self.h_1, q[1] / self.h_2)
        # Each temperature in the way with the least cancellation: from its own heat, or from another one and the flux.
        ways = (self.T_1 + by[0] + off[0], self.T_2 + by[1] + off[1], by_c)
        own = self.T_c + (given - heat[0] - heat[1]) / self.C_c
        T_c = np.choose(np.argmin(ways, axis=0), (bodies[0] + to[0], bodies[1] + to[1], own))
        least = np.min(ways, axis=0)
        T_1 = np.where(self.T_1 + by[0] <= least + off[0], bodies[0], T_c - to[0])
        T_2 = np.where(self.T_2 + by[1] <= least + off[1], bodies[1], T_c - to[1])
        return {"T_1": T_1, "T_2": T_2, "T_c": T_c, "q_1": q[0], "q_2": q[1]}

    @property
    def _paths(self) -> tuple[tuple[float, float], ...]:
        """Capacities of the bodies, conductances to them, and square roots of the conductances."""
        return (self.C_1, self.C_2), (self.h_1, self.h_2), (float(np.sqrt(self.h_1)), float(np.sqrt(self.h_2)))

    def modes(self) -> Iterator[tuple[float, tuple[float, float], float]]:
        """Yield decay rate [1/s], unit vector and initial amplitude of the fast and of the slow mode.

        The eigenvalues of S, and the eigenvector of the larger one, follow from a Jacobi rotation, accurate by entry.
        """
        _, _, (root_1, root_2) = self._paths
        own_1, own_2 = self.h_1 / self.C_1, self.h_2 / self.C_2
        coupling = root_1 * root_2 / self.C_c
        half_gap = 0.5 * ((own_1 - own_2) / coupling + (self.h_1 - self.h_2) / (root_1 * root_2))
        tangent = 1.0 / (abs(half_gap) + np.hypot(1.0, half_gap))
        cosine = 1.0 / np.hypot(1.0, tangent)
        fast = max(own_1 + self.h_1 / self.C_c, own_2 + self.h_2 / self.C_c) + coupling * tangent
        slow = own_1 * (self.h_2 / self.C_c) * ((self.C_1 + self.C_2 + self.C_c) / self.C_2) / fast
        along, across = (cosine, cosine * tangent) if half_gap >= 0.0 else (cosine * tangent, cosine)
        start = (root_1 * (self.T_c - self.T_1), root_2 * (self.T_c - self.T_2))
        yield fast, (along, across), along * start[0] + across * start[1]
        yield slow, (-across, along), along * start[1] - across * start[0]


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

    def quantities(self, t: Array) -> Quantities:
        share_1, share_2 = self.h_1 / (self.h_1 + self.h_2), self.h_2 / (self.h_1 + self.h_2)
        h, initial, zero, source_decay = share_1 * self.h_2, self.T_2 - self.T_1, np.zeros_like(t), -self.gamma * t
        # T_2 - T_1 and its integral over time: free decay and both parts of the source.
        decay, drive = -h * (1.0 / self.C_1 + 1.0 / self.C_2) * t, share_2 / self.C_2 - share_1 / self.C_1
        difference, integral = initial * np.exp(decay), initial * t * first_difference(zero, decay)
        for strength, exponent in ((self.D_0, zero), (self.D_1, source_decay)):
            difference = difference + strength * drive * t * first_difference(exponent, decay)
            integral = integral + strength * drive * t**2 * second_difference(exponent, decay)
        source = self.D_0 + self.D_1 * np.exp(source_decay)
        given = self.D_0 * t + self.D_1 * t * first_difference(zero, source_decay)
        T_1 = self.T_1 + (share_1 * given + h * integral) / self.C_1
        T_2 = self.T_2 + (share_2 * given - h * integral) / self.C_2
        return {
            "T_1": T_1,
            "T_2": T_2,
            "T_c": share_1 * T_1 + share_2 * T_2 + source / (self.h_1 + self.h_2),
            "q_1": share_1 * source + h * difference,
            "q_2": share_2 * source - h * difference,
        }
