"""Rupture of parallel bonds that share a constant load."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from surfacechem.references._cluster import Cluster
from surfacechem.references._exponential_integrals import scaled_expint
from surfacechem.references._quadrature import short_integral
from surfacechem.references._roots import increasing_root
from surfacechem.references.base import Array


class SharedLoadCluster(Cluster):
    r"""Bonds that share a constant traction and do not form again: the fewer are left, the faster they break.

    .. math:: \dot\phi=-k_{off}\phi e^{F/\phi},\quad F=\frac{t_nx_{off}}{n_ck_BT},\qquad
        E_1\Big(\frac F\phi\Big)=E_1\Big(\frac F{\phi_i}\Big)-k_{off}t

    All bonds are broken, with infinite slope, at :math:`t^*=E_1(F/\phi_i)/k_{off}`; before,
    :math:`\phi\simeq F/W_0\big(1/k_{off}(t^*-t)\big)`. Everything is scaled by :math:`e^{-F/\phi_i}`, so that no load
    overflows. Close to rupture the state follows the rounding of t times its own slope.

    Source: Erdmann & Schwarz (2004), J. Chem. Phys. 121, 8997, doi 10.1063/1.1805496, deterministic equation without
    rebinding, integrated.

    >>> traction = 0.5 * 1e14 * 1.380649e-23 * 300.0 / 4e-10
    >>> cluster = SharedLoadCluster(k_off=1.0, x_off=4e-10, T=300.0, n_c=1e14, t_n=traction)
    >>> f"{cluster.end_time:.12f} s, {cluster.solution(0.279886797388080406)['phi']:.12f}"
    '0.559773594776 s, 0.582551985238'
    """

    name: ClassVar[str] = "shared-load-cluster"

    @property
    def end_time(self) -> float:
        """Time [s] at which the last bond breaks; zero below 1e-323 s."""
        start = self._start
        return float(np.exp(-start) * scaled_expint(1, np.array(start))) / self.k_off

    @property
    def _start(self) -> float:
        return self.load / self.phi_i

    def quantities(self, t: Array) -> Mapping[str, Array | float]:
        exponent = self._start + self._growth(np.exp(self._start + np.log(self.k_off * t)))
        phi = np.where(t < self.end_time, self.load / exponent, 0.0)
        return {"phi": phi, "f": self.t_n / (self.n_c * phi)}

    def _growth(self, scaled: Array) -> Array:
        """By how much the exponent F/phi has grown at the time ``scaled``, in units of the start's rate."""
        x_0 = self._start
        whole = float(scaled_expint(1, np.array(x_0)))
        early = scaled < 0.5 * whole
        nothing = np.zeros_like(scaled)
        spent = np.where(early, scaled, 0.0)
        first = increasing_root(self._elapsed, spent, nothing, nothing + max(1.0, x_0) * 50.0)
        remaining = -np.log(np.where(early, 0.5, np.maximum(1.0 - scaled / whole, 2.0**-60)) * whole)
        last = increasing_root(self._log_remaining, remaining, nothing, np.maximum(remaining, 1.0) + 1.0)
        return np.where(early, first, last)

    def _elapsed(self, w: Array) -> tuple[Array, Array]:
        r""":math:`e^{x_0}[E_1(x_0)-E_1(x_0+w)]` and its slope."""
        x_0 = self._start
        apart = scaled_expint(1, np.array(x_0)) - np.exp(-w) * scaled_expint(1, x_0 + w)
        near = w < 0.25 * min(1.0, x_0)
        return np.where(near, short_integral(self._slope, w), apart), self._slope(w)

    def _slope(self, w: Array) -> Array:
        return np.exp(-w) / (self._start + w)

    def _log_remaining(self, w: Array) -> tuple[Array, Array]:
        r""":math:`-\ln[e^{x_0}E_1(x_0+w)]` and its slope."""
        scaled = scaled_expint(1, self._start + w)
        return w - np.log(scaled), 1.0 / (scaled * (self._start + w))
