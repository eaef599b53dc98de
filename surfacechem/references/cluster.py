"""Parallel bonds that share a constant load: their rupture, and the critical load with rebinding."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.errors import InputError
from surfacechem.references._numerics import AutonomousODE, increasing_root, remainder, scaled_expint, short_integral
from surfacechem.references.base import Array, Quantities, read
from surfacechem.references.bell import BellBond

FAR = 0.1
"""Excess of F/phi over its critical value above which the two terms of the rate no longer cancel."""


class Cluster(BellBond):
    """Bell bonds whose number per area determines the force on each."""

    n_c: float = parameter("1/m^2", "density of bonding sites", above=0)
    t_n: float = parameter("Pa", "tensile traction", above=0)

    readings = read(constant="n_c=N_c", initial="t_n")

    @property
    def load(self) -> float:
        """Force per site in units of the force scale."""
        return self.t_n / (self.n_c * self.force_scale)


class SharedLoadCluster(Cluster):
    r"""Bonds that share a constant traction and do not form again: the fewer remain, the faster they break.

    .. math:: \dot\phi=-k_{off}\phi e^{F/\phi},\quad F=\frac{t_nx_{off}}{n_ck_BT},\qquad
        E_1\Big(\frac F\phi\Big)=E_1\Big(\frac F{\phi_i}\Big)-k_{off}t

    All bonds are broken, with infinite slope, at :math:`t^*=E_1(F/\phi_i)/k_{off}`; before,
    :math:`\phi\simeq F/W_0\big(1/k_{off}(t^*-t)\big)`. All terms are scaled by :math:`e^{-F/\phi_i}`, so that no load
    overflows. Close to rupture the error of the state is the rounding of t times its slope.

    Source: Erdmann & Schwarz (2004), J. Chem. Phys. 121, 8997, doi 10.1063/1.1805496, deterministic equation without
    rebinding, integrated.

    >>> traction = 0.5 * 1e14 * 1.380649e-23 * 300.0 / 4e-10
    >>> cluster = SharedLoadCluster(k_off=1.0, x_off=4e-10, T=300.0, n_c=1e14, t_n=traction)
    >>> f"{cluster.end_time:.12f} s, {cluster.solution(0.279886797388080406)['phi']:.12f}"
    '0.559773594776 s, 0.582551985238'
    """

    @property
    def end_time(self) -> float:
        """Time [s] at which the last bond breaks; zero below 1e-323 s."""
        start = self.load / self.phi_i
        return float(np.exp(-start) * scaled_expint(1, np.array(start))) / self.k_off

    def quantities(self, t: Array) -> Quantities:
        # The growth w of F/phi from its start x_0 solves e^x_0 [E_1(x_0) - E_1(x_0 + w)] = k_off t e^x_0: directly in
        # the first half of the time, by logarithms of the remaining time in the second.
        x_0 = self.load / self.phi_i
        scaled, whole = np.exp(x_0 + np.log(self.k_off * t)), float(scaled_expint(1, np.array(x_0)))

        def slope(w: Array) -> Array:
            return np.exp(-w) / (x_0 + w)

        def elapsed(w: Array) -> tuple[Array, Array]:
            apart = scaled_expint(1, np.array(x_0)) - np.exp(-w) * scaled_expint(1, x_0 + w)
            near = w < 0.25 * min(1.0, x_0)  # the integrals would cancel
            return np.where(near, short_integral(slope, w), apart), slope(w)

        def log_left(w: Array) -> tuple[Array, Array]:
            left = scaled_expint(1, x_0 + w)
            return w - np.log(left), 1.0 / (left * (x_0 + w))

        early, exponent = scaled < 0.5 * whole, np.full_like(scaled, x_0)
        # Both searches start close below their roots. In the first, the elapsed time is less than (1 - e^-w)/x_0, and
        # half of the total less than 1/(2 x_0); in the second, e^x E_1(x) > 1/(x + 1), and w + 1 is at most `most`.
        gone = scaled[early]
        nothing = np.zeros_like(gone)
        exponent[early] += increasing_root(
            elapsed, gone, nothing, nothing + max(1.0, x_0) * 50.0, -np.log1p(-np.minimum(x_0 * gone, 0.5))
        )
        left = -np.log(np.maximum(1.0 - scaled[~early] / whole, 2.0**-60) * whole)
        most = np.maximum(left, 1.0) + 1.0
        exponent[~early] += increasing_root(log_left, left, np.zeros_like(left), most, left - np.log(x_0 + most))
        phi = np.where(t < self.end_time, self.load / exponent, 0.0)
        return {"phi": phi, "f": self.t_n / (self.n_c * phi)}


@dataclass(frozen=True)
class Expansion:
    r"""The rate r about a bonding state, in units of :math:`e^{1+F_*}`: value, slope and remainder.

    .. math:: r(a+\delta)=r(a)+r'(a)\,\delta+e^{x_a}(a+\delta)(e^{-q}-1+q),\quad x_a=\frac Fa,\quad
        q=\frac{x_a\delta}{a+\delta}
    """

    state: float
    critical_exponent: float
    apart: float
    """Critical exponent minus F/a."""
    value: float
    slope: float

    def rate(self, delta: Array | float, phi: Array | float) -> Array:
        """Return the rate at phi, which is ``delta`` away from the state."""
        q = (self.critical_exponent - self.apart) * delta / phi
        rest = math.exp(-self.apart) * phi * remainder(np.asarray(q))
        return np.asarray(self.value + self.slope * delta + rest)

    def derivative(self, delta: Array) -> Array:
        """Return the derivative of the rate."""
        exponent = self.critical_exponent - self.apart
        q = exponent * delta / (self.state + delta)
        curved = remainder(np.asarray(q)) - np.expm1(-q) * exponent * self.state / (self.state + delta)
        return np.asarray(self.slope + math.exp(-self.apart) * curved)


class RebindingCluster(Cluster):
    r"""Bonds that share a constant traction and form again at free sites, which carry no load.

    .. math:: \dot\phi=-k_{off}\,r(\phi),\quad r=\phi e^{F/\phi}-\gamma(1-\phi),\quad F=\frac{t_nx_{off}}{n_ck_BT},\quad
        \gamma=\frac{k_{on}}{k_{off}}

    A steady state exists up to the critical load :math:`F_*=W_0(\gamma/e)`, where
    :math:`\phi_*=\frac{F_*}{1+F_*}`. Above it the cluster breaks; just above, after
    :math:`\pi\sqrt{2/(e^{F_*/\phi_*}(F-F_*)r''(\phi_*))}/k_{off}`. The paths to the steady state and to rupture are
    quadratures, inverted to rounding. The rate is expanded about the critical state in terms that do not cancel, so
    that the relative error of a lifetime is the rounding of F over its distance from :math:`F_*`.

    Source: Erdmann & Schwarz (2004), J. Chem. Phys. 121, 8997, doi 10.1063/1.1805496; Bell (1978), Science 200, 618.

    >>> site = 1e14 * 1.380649e-23 * 300.0 / 4e-10
    >>> cluster = RebindingCluster(k_off=1.0, k_on=1.0, x_off=4e-10, T=300.0, n_c=1e14, t_n=0.3 * site)
    >>> f"{cluster.critical_load:.10f}, {cluster.critical_state:.10f}, {cluster.end_time:.6f} s"
    '0.2784645428, 0.2178117057, 3.163522 s'
    """

    k_on: float = parameter("1/s", "rate at which free sites bond", above=0)

    readings = read(reaction="k_on")

    @property
    def critical_load(self) -> float:
        """Largest force per site, in units of the force scale, with a steady state: F_*."""
        from scipy.special import wrightomega  # W_0 of an exponential, which may overflow

        return float(wrightomega(math.log(self.k_on / self.k_off) - 1.0))

    @property
    def critical_traction(self) -> float:
        """Largest traction [Pa] with a steady state."""
        return self.critical_load * self.n_c * self.force_scale

    @property
    def critical_state(self) -> float:
        """Bonding state at the critical load."""
        return self.critical_load / (1.0 + self.critical_load)

    @property
    def breaks(self) -> bool:
        """True if the cluster ruptures instead of reaching its steady state."""
        below = self.phi_i < self.critical_state and bool(
            self._about(0.0).rate(self.phi_i - self.critical_state, self.phi_i) > 0.0
        )
        return self.load > self.critical_load or below

    @property
    def end_time(self) -> float:
        """Time [s] at which the last bond breaks; infinite if a steady state is reached."""
        return self._path.duration / self.k_off if self.breaks else math.inf

    @property
    def steady_state(self) -> float:
        """Stable bonding state below the critical load; InputError above it."""
        return self.critical_state + self._above_critical

    @property
    def passage_time(self) -> float:
        """Asymptotic lifetime [s] just above the critical load, from the bottleneck at the slowest state."""
        exponent = 1.0 + self.critical_load
        curvature = math.exp(exponent) * exponent**2 / self.critical_state
        distance = math.exp(exponent) * (self.load - self.critical_load)
        return math.pi * math.sqrt(2.0 / (distance * curvature)) / self.k_off

    def _about(self, d: float) -> Expansion:
        """Return the expansion of the rate about the state that is ``d`` above the critical one."""
        state, exponent, below = self.critical_state + d, 1.0 + self.critical_load, self.critical_load - self.load
        apart = (exponent * d + below) / state  # critical exponent minus that of this state
        slope = -self.critical_load * math.expm1(-apart) + apart * math.exp(-apart)
        value = -self.critical_state * -math.expm1(-below / self.critical_state) if d == 0.0 else 0.0
        return Expansion(state, exponent, apart, value, slope)

    @cached_property
    def _above_critical(self) -> float:
        """Distance of the stable state from the critical one."""
        if self.load > self.critical_load:
            raise InputError(f"{self.name}: no steady state above t_n = {self.critical_traction!r} Pa.")
        expansion = self._about(0.0)
        target = np.array([-expansion.value])
        if target[0] == 0.0:
            return 0.0

        def distance(d: Array) -> tuple[Array, Array]:
            return expansion.rate(d, self.critical_state + d) - expansion.value, expansion.derivative(d)

        top = np.array([1.0 - self.critical_state])
        return float(increasing_root(distance, target, np.zeros(1), top)[0])

    @cached_property
    def _path(self) -> AutonomousODE:
        """Path from the start to rupture or to the steady state, in units of 1/k_off."""
        scale, critical = math.exp(1.0 + self.critical_load), self._about(0.0)
        if self.breaks:

            def rupture(gone: Array, left: Array) -> Array:
                if self.load > self.critical_load + FAR * self.critical_state:  # the two terms do not cancel
                    return left * np.exp(self.load / left) - self.k_on / self.k_off * (1.0 - left)
                delta = np.where(gone < left, self.phi_i - self.critical_state - gone, left - self.critical_state)
                return scale * critical.rate(delta, left)

            return AutonomousODE(rupture, self.phi_i, [x for x in [self.phi_i - self.critical_state] if x > 0.0])
        end, steady = self._about(self._above_critical), self.steady_state
        side = math.copysign(1.0, self.phi_i - steady)

        def relaxing(_: Array, left: Array) -> Array:
            return side * scale * end.rate(side * left, steady + side * left)

        return AutonomousODE(relaxing, abs(self.phi_i - steady))

    def quantities(self, t: Array) -> Quantities:
        if not self.breaks and self.phi_i == self.steady_state:
            phi: Array | float = self.phi_i
        else:
            covered, left = self._path.position(self.k_off * t)
            end = 0.0 if self.breaks else self.steady_state
            toward = math.copysign(1.0, end - self.phi_i)
            phi = np.where(covered < left, self.phi_i + toward * covered, end - toward * left)
        return {"phi": phi, "f": self.t_n / (self.n_c * np.asarray(phi))}
