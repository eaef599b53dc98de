"""Normal contact: elastic, impact and rebound, and cohesive zones that open reversibly or pull off by a jump."""

from __future__ import annotations

import math
from abc import abstractmethod
from functools import cached_property
from typing import NamedTuple

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.errors import InputError
from surfacechem.references.base import Array, Parameters, Quantities, Reference, SceneView, UniformBody, read
from surfacechem.references.numerics import gauss, increasing_root, log_remainder, scaled_rise


class ElasticContact(Reference):
    r"""Elastic bodies pressed or pulled through an elastic interface; the penalty limit is rigid contact.

    .. math:: g_n=\frac{kw}{k+E_n},\quad t_n=E_ng_n,\quad\tfrac12E_ng_n^2=\frac{t_n^2}{2E_n}

    For :math:`E_n\to\infty` the traction tends to k w and the energy of the contact to zero.
    Here :math:`w=w_i+\dot wt`; with a unilateral penalty w <= 0. The energies are accurate to rounding for any
    stiffness.

    Source: Sauer, Duong & Mandadapu (2021), eq. ex:psi_c, in series with a spring.

    >>> contact = ElasticContact(k=1e12, E_n=1e15, w_i=-1e-8)
    >>> f"{contact.solution(0.0)['t_n']:.6f}"
    '-9990.009990'
    """

    k: float = parameter("Pa/m", "stiffness of the bodies", above=0)
    E_n: float = parameter("Pa/m", "contact stiffness", above=0)
    w_i: float = parameter("m", "initial far-field displacement")
    w_dot: float = parameter("m/s", "speed of the far field", default=0.0)

    readings = read(normal="k", potential="E_n", initial="w_i=w_n", ramp="w_dot=w_n")

    def quantities(self, t: Array) -> Quantities:
        w = self.w_i + self.w_dot * t
        g, delta = self.k / (self.k + self.E_n) * w, self.E_n / (self.k + self.E_n) * w
        energies = {"E_spring_n": 0.5 * self.k * delta**2, "U_contact": 0.5 * self.E_n * g**2}
        return {"w_n": w, "g_n": g, "t_n": self.E_n * g, **energies}


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


class IsentropicCohesiveOpening(UniformBody):
    r"""Opening of a cohesive zone that weakens with temperature, in perfect contact and without heat supply: it cools.

    .. math:: T^3-BT^2-a(g_n)=0,\quad a=\frac{t_{max}T_0^2}C(g_n+g_0)e^{1-g_n/g_0},\quad B=T_i-\frac{a(g_i)}{T_i^2}

    for a strength :math:`t_{max}T_0/T`. The entropy
    :math:`C(T/T_0-1)-t_{max}\frac{T_0}{T^2}(g_n+g_0)e^{1-g_n/g_0}` of bodies and zone is constant; fully open, T = B.
    Quadratic energies; :math:`g_n=g_i+\dot gt\ge0`. If B <= 0 the temperature goes to zero as the zone opens.

    Source: Sauer, Duong & Mandadapu (2021), eq. ex:psi_czm and quadratic energy, at constant entropy.

    >>> zone = IsentropicCohesiveOpening(t_max=5e7, g_0=1e-8, C=0.02, T_0=300.0, T_i=300.0, g_dot=1e-8)
    >>> f"{zone.solution(1.0)['T']:.9f} {zone.open_temperature:.9f}"
    '286.764808584 232.042954289'
    """

    t_max: float = parameter("Pa", "strength at T_0", above=0)
    g_0: float = parameter("m", "gap at the strength", above=0)
    g_i: float = parameter("m", "initial gap", default=0.0, at_least=0)
    g_dot: float = parameter("m/s", "opening speed", at_least=0)

    readings = read(potential="t_max g_0", initial="g_i=g_n", ramp="g_dot=g_n")

    @property
    def open_temperature(self) -> float:
        """Temperature [K] of the open bodies."""
        return self.T_i - float(self._a(np.array(self.g_i))) / self.T_i**2

    def quantities(self, t: Array) -> Quantities:
        g, B = self.g_i + self.g_dot * t, self.open_temperature
        a = self._a(g)
        low = np.full_like(a, max(B, 0.0))
        T = increasing_root(lambda x: (x**2 * (x - B), x * (3.0 * x - 2.0 * B)), a, low, low + np.cbrt(a))
        u = g / self.g_0
        scale = self.C / (2.0 * self.T_0)
        zone, before = -4.0 * scale * a / T, -4.0 * scale * self._a(np.array(self.g_i)) / self.T_i
        work = scale * (T - self.T_i) * (T + self.T_i) + zone - before
        return {"g_n": g, "T": T, "t_n": self.t_max * self.T_0 / T * u * np.exp(1.0 - u), "U_c": zone, "work": work}

    def _a(self, g: Array) -> Array:
        return np.asarray(self.t_max * self.T_0**2 / self.C * (g + self.g_0) * np.exp(1.0 - g / self.g_0))


PANEL_LENGTH = 0.25
"""Length of a panel in arsinh of the distance from the fold; the poles of 1 / cosh are pi / 2 away, so that the error
of 16 Gauss points is 25^-32."""


class SnapPoint(NamedTuple):
    """A gap at which the equilibrium is lost, with displacement and traction there, the gap after the jump, and the
    energy that the jump turns into heat.
    """

    g: float
    w: float
    t: float
    g_after: float
    release: float


class AttractionOnSpring(Reference):
    """Bodies that attract each other, one of them on a spring: their gaps in equilibrium, and the jumps between them.

    Energies and forces are per area, or those of the whole pair.
    """

    k: float

    readings = read(normal="k")

    @abstractmethod
    def derivative(self, g: Array, order: int) -> Array:
        """Return a derivative of the energy of the attraction over the gap, of order 0 to 2."""

    def traction(self, g: Array) -> Array:
        """Return the force at a gap, tension positive."""
        return self.derivative(g, 1)

    def displacement(self, g: Array) -> tuple[Array, Array]:
        """Return the far-field displacement [m] at which a gap is in equilibrium, and its slope."""
        return g + self.derivative(g, 1) / self.k, 1.0 + self.derivative(g, 2) / self.k

    def gap(self, w: Array, low: float, high: float) -> Array:
        """Return the gap [m] in equilibrium at displacements w, on a stable branch between two gaps."""
        return increasing_root(self.displacement, w, np.full_like(w, low), np.full_like(w, high))

    def jump(self, g: float, low: float, high: float) -> SnapPoint:
        """Return the jump from a gap to the branch between two others, at the same displacement."""
        w = self.displacement(np.array([g]))[0]
        both = np.array([g, self.gap(w, low, high)[0]])
        before, after = 0.5 * self.k * (w - both) ** 2 + self.derivative(both, 0)
        t, g_after = self.k * (w[0] - g), both[1]
        return SnapPoint(g, float(w[0]), float(t), float(g_after), float(before - after))


class CohesiveZoneOnSpring(AttractionOnSpring):
    """An exponential cohesive zone in series with a spring: its branches and folds."""

    t_max: float = parameter("Pa", "strength", above=0)
    g_0: float = parameter("m", "gap at the strength", above=0)
    k: float = parameter("Pa/m", "stiffness of the bodies", above=0)

    readings = read(potential="t_max g_0")

    @property
    def severity(self) -> float:
        """Ratio of the stiffness to the steepest softening; from one on, every displacement has a unique gap."""
        return math.e * self.k * self.g_0 / self.t_max

    def derivative(self, g: Array, order: int) -> Array:
        u = g / self.g_0
        shape = (-(1.0 + u), u, 1.0 - u)[order] * np.exp(1.0 - u)
        return np.asarray(self.t_max * self.g_0 ** (1 - order) * shape)

    def gap(self, w: Array, low: float, high: float) -> Array:
        lower = np.minimum(low, w)  # the zone only attracts
        return increasing_root(self.displacement, w, lower, np.maximum(np.minimum(w, high), lower))

    @cached_property
    def folds(self) -> tuple[SnapPoint, SnapPoint]:
        """Pull-off and snap-in: at both x with x exp(-x) = k g_0 / t_max, g = g_0 (1 + x)."""
        if self.severity >= 1.0:
            raise InputError(f"{self.name}: stable for every displacement; there is no jump.")
        distance = np.array([-math.log(self.severity)])
        low, high = np.sqrt(2.0 * distance), distance + np.sqrt(distance * (distance + 2.0))
        smaller = float(scaled_rise(np.array([self.severity]))[0])
        larger = 1.0 + float(increasing_root(log_remainder, distance, low, high)[0])
        near, far = self.g_0 * (1.0 + smaller), self.g_0 * (1.0 + larger)
        return self.jump(near, far, math.inf), self.jump(far, 0.0, near)


class CohesivePullOff(CohesiveZoneOnSpring):
    r"""Elastic bodies, held together by an exponential cohesive zone, are pulled apart at constant speed.

    .. math:: k(w-g_n)=t_{max}\frac{g_n}{g_0}e^{1-g_n/g_0},\qquad
        g_{off}=g_0\Big[1-W_0\Big(-\frac{kg_0}{t_{max}}\Big)\Big],\quad
        g_{on}=g_0\Big[1-W_{-1}\Big(-\frac{kg_0}{t_{max}}\Big)\Big]

    Stable for every w iff :math:`kg_0/t_{max}\ge1/e`; otherwise the gap jumps, on opening from :math:`g_{off}`, on
    closing from :math:`g_{on}`, to the other branch at the same w. The heat is the drop of
    :math:`\tfrac12k(w-g_n)^2+\Psi`. Here :math:`w=w_i+\dot wt`, opening, from the closed branch. Both folds are
    accurate to rounding, also where they meet.

    Source: Sauer, Duong & Mandadapu (2021), eq. ex:bt_czm with the sign of tension, with an elastic body.

    >>> bodies = CohesivePullOff(t_max=1e6, g_0=1e-8, k=1e13, w_dot=1e-8)
    >>> off, on = bodies.folds
    >>> f"{off.g:.9e} {off.w:.9e} {off.release:.9e} {on.release:.9e}"
    '1.111832559e-08 1.105377225e-07 3.054240033e-02 1.000742319e-02'
    """

    w_i: float = parameter("m", "initial far-field displacement", default=0.0, at_least=0)
    w_dot: float = parameter("m/s", "speed of the far field", at_least=0)

    readings = read(initial="w_i=w_n", ramp="w_dot=w_n")

    def flaw(self) -> str:
        most = self.folds[0].w if self.severity < 1.0 else math.inf
        return f"w_i must not be above the fold at {most!r} m." if self.w_i > most else ""

    def quantities(self, t: Array) -> Quantities:
        w = self.w_i + self.w_dot * t
        if self.severity >= 1.0:
            g, heat = self.gap(w, 0.0, math.inf), np.zeros_like(w)
        else:
            off, on = self.folds
            closed = self.gap(np.minimum(w, off.w), 0.0, off.g)
            opened = self.gap(np.maximum(w, off.w), on.g, math.inf)
            g, heat = np.where(w > off.w, opened, closed), np.where(w > off.w, off.release, 0.0)
        return {"w_n": w, "g_n": g, "t_n": self.traction(g), "heat": heat}


class CohesivePullOffHeating(CohesivePullOff, UniformBody):
    r"""Cohesive pull-off in perfect thermal contact: the energy that the jump releases heats the bodies.

    .. math:: T^2=T_i^2+\frac{2T_0}C\,\big[\tfrac12k(w-g_n)^2+\Psi\big]_{after}^{before}

    Quadratic energies; a strength that does not depend on temperature, so that the gap is that of the pull-off without
    heat and the temperature changes only at the jump.

    Source: Sauer, Duong & Mandadapu (2021), eq. ex:bt_czm with the sign of tension, and the quadratic energy.

    >>> bodies = CohesivePullOffHeating(t_max=1e6, g_0=1e-8, k=1e13, w_dot=1e-8, C=2e-4, T_0=300.0, T_i=310.0)
    >>> f"{bodies.solution(20.0)['T']:.9f}"
    '433.274971584'
    """

    def quantities(self, t: Array) -> Quantities:
        mechanics = super().quantities(t)
        return {**mechanics, "T": self.heated(np.asarray(mechanics["heat"]))}


class OverdampedPullOff(CohesiveZoneOnSpring):
    r"""Overdamped opening of a cohesive zone at a far-field displacement slightly beyond its fold.

    .. math:: c\,\dot g_n=k(w_{off}+\delta w-g_n)-t_n(g_n),\qquad
        t\simeq\pi c\sqrt{\frac2{a\,k\,\delta w}},\quad a=-t_n''(g_{off})

    The time is an integral over the gap whose peak of width :math:`\sqrt{2k\delta w/a}` at the fold is resolved by
    :math:`g_n-g_{off}\propto\sinh`; the force is summed without cancellation, so that the result is accurate to
    rounding for any :math:`\delta w`. Exact until half way from the fold to the open gap, at `end_time`.

    Source: Sauer, Duong & Mandadapu (2021), eq. ex:bt_czm with the sign of tension; passage time of Strogatz, Nonlinear
    Dynamics and Chaos (1994), section 4.3.

    >>> gap = OverdampedPullOff(t_max=1e6, g_0=1e-8, k=1e13, c=2e5, delta_w=1.1e-15)
    >>> f"{gap.time(4e-8):.8e} {math.pi * gap.c * gap.width / (gap.k * gap.delta_w):.8e}"
    '9.50710596e-05 9.50681912e-05'
    """

    c: float = parameter("Pa s/m", "damping", above=0)
    delta_w: float = parameter("m", "far-field displacement beyond the fold", above=0)
    g_i: float = parameter("m", "initial gap", default=0.0, at_least=0)

    @classmethod
    def from_scene(cls, scene: SceneView) -> Parameters:
        dampers = [c for c in (scene.read("normal", name) for name in ("c_b", "c_g")) if c is not None]
        return {**super().from_scene(scene), "c": sum(dampers) if dampers else None, "g_i": scene.initial("g_n")}

    @property
    def fold(self) -> SnapPoint:
        """Fold that is passed."""
        return self.folds[0]

    @property
    def w(self) -> float:
        """Far-field displacement [m]."""
        return self.fold.w + self.delta_w

    @property
    def width(self) -> float:
        """Width [m] of the bottleneck."""
        x = self.fold.g / self.g_0 - 1.0
        curvature = self.t_max / self.g_0**2 * (1.0 - x) * math.exp(-x)
        return math.sqrt(2.0 * self.k * self.delta_w / curvature)

    @cached_property
    def end_gap(self) -> float:
        """Gap [m] at `end_time`."""
        final = float(self.gap(np.array([self.w]), self.folds[1].g, math.inf)[0])
        return 0.5 * (self.fold.g + final)

    @property
    def end_time(self) -> float:
        """End of the solution [s]."""
        return self.time(self.end_gap)

    def time(self, g: float) -> float:
        """Return the time [s] at which the gap is g."""
        return float(self._times(np.array([g]))[0])

    def quantities(self, t: Array) -> Quantities:
        low, high = np.full_like(t, self.g_i), np.full_like(t, self.end_gap)
        edges, times = self._panels
        guess = np.where(t > 0, np.interp(t, times, self.fold.g + self.width * np.sinh(edges)), low)
        g = increasing_root(lambda x: (self._times(x), self.c / self._force(x - self.fold.g)), t, low, high, guess)
        return {"g_n": g, "t_n": self.traction(g), "v_n": self._force(g - self.fold.g) / self.c}

    def _times(self, g: Array) -> Array:
        """Return the integral of c dg / force, over whole panels and a part of the next one."""
        edges, times = self._panels
        ends = np.arcsinh((g - self.fold.g) / self.width)
        j = np.clip(np.searchsorted(edges, ends, side="right") - 1, 0, len(edges) - 1)
        return np.asarray(times[j] + self._elapsed(edges[j], ends))

    @cached_property
    def _panels(self) -> tuple[Array, Array]:
        """Edges of panels in arsinh of the distance from the fold, in widths, and the times there [s]."""
        first, last = np.arcsinh((np.array([self.g_i, self.end_gap]) - self.fold.g) / self.width)
        edges = np.linspace(first, last, 1 + max(1, math.ceil((last - first) / PANEL_LENGTH)))
        return edges, np.append(0.0, np.cumsum(self._elapsed(edges[:-1], edges[1:])))

    def _elapsed(self, first: Array, last: Array) -> Array:
        """Return the time between two points of a panel."""
        nodes, weights = gauss(16)
        half = 0.5 * (last - first)[:, None]
        u = first[:, None] + half * (1.0 + nodes)
        return np.asarray(half * self.c * self.width * np.cosh(u) / self._force(self.width * np.sinh(u)) @ weights)

    def _force(self, distance: Array) -> Array:
        """Return the driving traction [Pa] at a distance from the gap of the fold."""
        y, x = distance / self.g_0, self.fold.g / self.g_0 - 1.0
        # The terms cancel for small y: up to 0.5 a series of 18 terms is exact, the next is 0.5^20 19 / 20! = 7e-24.
        near = np.where(np.abs(y) < 0.5, y, 0.0)
        coefficients = [0.0, 0.0, *((-1) ** n * (n - 1 - x) / math.factorial(n) for n in range(2, 20))]
        series = np.polynomial.polynomial.polyval(near, coefficients)
        far = -(1.0 + x) * np.expm1(-y) - x * y - y * np.exp(-y)
        shape = np.where(np.abs(y) < 0.5, series, far)
        return np.asarray(self.k * self.delta_w + self.t_max * math.exp(-x) * shape)
