"""Stick-slip of a mass that a spring pulls at constant speed: without bonds, with bonds that break, or form again."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Iterator
from itertools import islice
from typing import NamedTuple

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.errors import InputError
from surfacechem.references.base import Array, Parameters, Quantities, Reference, SceneView, read
from surfacechem.references.numerics import increasing_root

MOST_CYCLES = 1_000_000
"""Largest number of cycles, so that a time far beyond them is refused at once."""


class Slip(NamedTuple):
    """A slip from rest, at which the spring traction exceeds sliding friction by `drop` [Pa]."""

    m: float
    k: float
    V: float
    drop: float

    @property
    def omega(self) -> float:
        """Angular frequency [1/s] of mass and spring."""
        return math.sqrt(self.k / self.m)

    @property
    def stretch(self) -> float:
        """Initial elongation [m] of the spring above that of steady sliding."""
        return self.drop / self.k

    @property
    def duration(self) -> float:
        """Time [s] until the mass is at rest again."""
        return (math.pi + 2.0 * math.atan2(self.V, self.stretch * self.omega)) / self.omega

    @property
    def distance(self) -> float:
        """Slip [m] from rest to rest."""
        return self.V * self.duration + 2.0 * self.stretch

    @property
    def v_max(self) -> float:
        """Largest velocity [m/s]."""
        return self.V + math.hypot(self.V, self.stretch * self.omega)

    def motion(self, t: Array) -> tuple[Array, Array, Array]:
        """Return slip [m], velocity [m/s] and spring traction above sliding friction [Pa] at times since the start."""
        angle = self.omega * t
        swing = 2.0 * np.sin(0.5 * angle) ** 2  # 1 - cos
        away = self.V / self.omega
        slip = self.V * t + self.stretch * swing - away * np.sin(angle)
        v = self.stretch * self.omega * np.sin(angle) + self.V * swing
        return slip, v, self.k * (self.stretch * np.cos(angle) + away * np.sin(angle))


class Slider(Reference):
    """A mass on a spring whose end moves at constant speed."""

    m: float = parameter("kg/m^2", "mass", above=0)
    k: float = parameter("Pa/m", "tangential stiffness", above=0)
    V: float = parameter("m/s", "speed of the spring's end", above=0)

    readings = read(tangential="m k", ramp="V=w_t")


class StickSlip(Slider):
    r"""Stick-slip of a mass on a spring whose end moves at constant speed, from rest with a relaxed spring.

    .. math:: t_{slip}=\frac2\omega\Big(\pi-\arctan\frac{\Delta\omega}V\Big),\quad t_{stick}=\frac{2\Delta}V,\quad
        v_{max}=V+\sqrt{V^2+\Delta^2\omega^2},\quad \Delta=\frac{t_s-t_k}k,\;\omega=\sqrt{k/m}

    The slip is :math:`Vt_{slip}+2\Delta`, the heat of a cycle :math:`t_k` times that, the mean traction exactly
    :math:`t_k`. Sliding begins at :math:`t_s/(kV)`. With :math:`t_s=t_k` it never rests again. Any t >= 0 and V > 0:
    the period is accurate to rounding over all decades of V.

    Source: Sauer, Duong & Mandadapu (2021), eqs. e:tt_max and e:dry_fric, with an oscillator, integrated.

    >>> slider = StickSlip(m=10.0, k=1e8, V=1e-3, t_s=6e4, t_k=4e4)
    >>> slip = slider.slip
    >>> f"{slider.period:.12f} {slip.duration:.6e} {slip.v_max:.9f} {slider.t_k * slip.distance:.9f}"
    '0.400994458826 9.944588e-04 0.633456323 16.039778353'
    """

    t_s: float = parameter("Pa", "traction that sticking bears", above=0)
    t_k: float = parameter("Pa", "traction of sliding", at_least=0)

    @classmethod
    def from_scene(cls, scene: SceneView) -> Parameters:
        mu, mu_s, p = scene.read("friction", "mu"), scene.read("friction", "mu_s"), scene.initial("p")
        bears = {} if mu is None or p is None else {"t_k": mu * p, "t_s": max(mu, mu_s or 0.0) * p}
        return {**super().from_scene(scene), **bears}

    def flaw(self) -> str:
        return f"t_s must not be below t_k = {self.t_k!r} Pa." if self.t_s < self.t_k else ""

    @property
    def slip(self) -> Slip:
        """Slip of every cycle."""
        return Slip(self.m, self.k, self.V, self.t_s - self.t_k)

    @property
    def onset_time(self) -> float:
        """Time [s] of the first slip."""
        return self.t_s / (self.k * self.V)

    @property
    def stick_time(self) -> float:
        """Duration [s] of a stick."""
        return 2.0 * self.slip.stretch / self.V

    @property
    def period(self) -> float:
        """Duration [s] of a cycle."""
        return self.slip.duration + self.stick_time

    def quantities(self, t: Array) -> Quantities:
        since, pull = t - self.onset_time, self.k * self.V
        cycle = np.maximum(np.floor(since / self.period), 0.0)
        within = since - cycle * self.period
        slips = (since >= 0.0) & (within < self.slip.duration)
        slip, v, above = self.slip.motion(np.where(slips, within, 0.0))
        slip = cycle * self.slip.distance + np.where(slips, slip, np.where(since < 0.0, 0.0, self.slip.distance))
        rest = 2.0 * self.t_k - self.t_s + pull * (within - self.slip.duration)
        spring = np.where(slips, self.t_k + above, np.where(since < 0.0, pull * t, rest))
        tractions = {"t_t": np.where(slips, self.t_k, spring), "spring_traction": spring}
        return {"v": np.where(slips, v, 0.0), "u_t": slip, **tractions, "heat": self.t_k * slip}


class Cycle(NamedTuple):
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
        """Duration of stick and slip [s]."""
        return self.stick_time + self.slip.duration


class BondedSlider(Slider):
    """A mass on a driven spring whose sticking limit grows with its bonds; sliding breaks all of them.

    It starts at rest with a relaxed spring. Subclasses define its cycles, and its bonds during a stick.
    """

    p: float = parameter("Pa", "contact pressure", above=0)
    mu_b: float = parameter("1", "static friction coefficient of complete bonding", above=0)
    mu_ub: float = parameter("1", "static friction coefficient without bonds", above=0)
    mu_k: float = parameter("1", "sliding friction coefficient", at_least=0)

    readings = read(initial="p", friction="mu_b mu_ub mu_k=mu")

    @classmethod
    def from_scene(cls, scene: SceneView) -> Parameters:
        values, T, T_0 = super().from_scene(scene), scene.temperature, scene.constant("T_0")
        cooler = T_0 / T if T and T_0 else 1.0  # bonds bear mu_b p T_0 / T
        return {name: x * cooler if x and name in ("mu_b", "mu_ub") else x for name, x in values.items()}

    def flaw(self) -> str:
        # Below sliding friction it would not stick, and with limits so far apart it would slip back.
        exact = self.mu_k <= self.mu_ub <= self.mu_b <= 2.0 * self.mu_k + self.mu_ub
        return "" if exact else "exact for mu_k <= mu_ub <= mu_b <= 2 mu_k + mu_ub only."

    @abstractmethod
    def cycles(self) -> Iterator[Cycle]:
        """Yield the cycles from the start on."""

    @abstractmethod
    def bonds(self, cycle: Cycle, t: Array) -> Array:
        """Return the bonding state at times since the beginning of the stick of a cycle."""

    def quantities(self, t: Array) -> Quantities:
        values = np.zeros((5, len(t)))
        begin, slipped, last, t_k = 0.0, 0.0, float(np.max(t, initial=0.0)), self.mu_k * self.p
        for cycle in islice(self.cycles(), MOST_CYCLES):
            inside = (t >= begin) & (t < begin + cycle.duration)
            since = t[inside] - begin
            sticks = since < cycle.stick_time
            slip, v, above = cycle.slip.motion(np.where(sticks, 0.0, since - cycle.stick_time))
            phi = np.where(sticks, self.bonds(cycle, since), 0.0)
            spring = np.where(sticks, cycle.start + self.k * self.V * since, t_k + above)
            values[:, inside] = phi, v, slipped + slip, np.where(sticks, spring, t_k), spring
            begin, slipped = begin + cycle.duration, slipped + cycle.slip.distance
            if begin > last:
                break
        else:
            raise InputError(f"{self.name}: more than {MOST_CYCLES} cycles until t = {last!r} s.")
        found = dict(zip(("phi", "v", "u_t", "t_t", "spring_traction"), values, strict=True))
        return {**found, "heat": t_k * found["u_t"]}


class StickSlipDebonding(BondedSlider):
    r"""Stick-slip that begins bonded: the sticking limit is :math:`\mu_bp` once and :math:`\mu_{ub}p` from then on.

    The first slip begins at :math:`t_1=\mu_bp/(kV)` and drops the traction of the spring to :math:`(2\mu_k-\mu_b)p`,
    which may push. From then on it is stick-slip without bonds,

    .. math:: t_2=t_1+t_{slip}(\mu_b)+\frac{(\mu_{ub}+\mu_b-2\mu_k)p}{kV},\quad
        t_{j+1}=t_j+t_{slip}(\mu_{ub})+\frac{2(\mu_{ub}-\mu_k)p}{kV}

    for the beginnings of slips. The contact starts completely bonded. Any t >= 0.

    Source: sticking limit of Sauer, Duong & Mandadapu (2021), eq. e:mu0, at T_0, with an oscillator, integrated.

    >>> slider = StickSlipDebonding(m=10.0, k=1e8, V=1e-3, p=1e5, mu_b=0.9, mu_ub=0.6, mu_k=0.4)
    >>> first, second = islice(slider.cycles(), 2)
    >>> f"{first.slip.v_max:.9f} {first.duration + second.stick_time:.9f}"
    '1.582139146 1.600993859'
    """

    def cycles(self) -> Iterator[Cycle]:
        start, phi, mu = 0.0, 1.0, self.mu_b
        while True:
            slip = Slip(self.m, self.k, self.V, (mu - self.mu_k) * self.p)
            yield Cycle(start, (mu * self.p - start) / (self.k * self.V), phi, mu * self.p, slip)
            start, phi, mu = (2.0 * self.mu_k - mu) * self.p, 0.0, self.mu_ub

    def bonds(self, cycle: Cycle, t: Array) -> Array:
        return np.full_like(t, cycle.phi)


class StickSlipRebonding(BondedSlider):
    r"""Stick-slip with a sticking limit that grows as bonds form; sliding breaks all of them.

    .. math:: \dot\phi=\frac{1-\phi}\tau,\quad t_s=p\,[\mu_{ub}+(\mu_b-\mu_{ub})\phi],\quad
        s=\alpha+\tau W_0\Big(-\frac\beta\tau e^{-\alpha/\tau}\Big)

    is the duration of a stick that begins with the traction :math:`t_b`, with :math:`\alpha=(p\mu_b-t_b)/(kV)`,
    :math:`\beta=p(\mu_b-\mu_{ub})/(kV)`; the next begins with :math:`2t_k-t_s`. In the steady cycle
    :math:`\alpha=2p(\mu_b-\mu_k)/(kV)`, :math:`\beta=2p(\mu_b-\mu_{ub})/(kV)`. For :math:`\mu_{ub}=\mu_k` there is none
    above :math:`V_c=2p(\mu_b-\mu_{ub})/(k\tau)`. Near there the Lambert function loses all digits; the equation without
    it is solved to rounding. The contact starts without bonds.

    Source: sticking limit of Sauer, Duong & Mandadapu (2021), eq. e:mu0, at T_0, with an oscillator, integrated.

    >>> slider = StickSlipRebonding(m=10.0, k=1e8, V=7.5e-5, p=1e5, mu_b=0.7, mu_ub=0.4, mu_k=0.4, tau=2.0)
    >>> f"{slider.steady.stick_time:.9f} {slider.critical_speed:.9f}"
    '7.841380790 0.000300000'
    """

    tau: float = parameter("s", "time scale of bonding", above=0)

    readings = read(relaxation_time="tau")

    @property
    def critical_speed(self) -> float:
        """Speed [m/s] above which a contact with mu_ub = mu_k never sticks again."""
        return 2.0 * self.p * (self.mu_b - self.mu_ub) / (self.k * self.tau)

    @property
    def steady(self) -> Cycle:
        """Steady cycle."""
        excess = 2.0 * self.p * (self.mu_ub - self.mu_k)
        if excess == 0.0 and self.critical_speed <= self.V:
            raise InputError(f"{self.name}: no stick-slip above V = {self.critical_speed!r} m/s.")
        cycle = self._cycle(math.nan, excess, 2.0)
        return Cycle(2.0 * self.p * self.mu_k - cycle.limit, cycle.stick_time, cycle.phi, cycle.limit, cycle.slip)

    def cycles(self) -> Iterator[Cycle]:
        """Yield the cycles from the start on."""
        start = 0.0
        while True:
            cycle = self._cycle(start, self.p * self.mu_ub - start, 1.0)
            yield cycle
            start = 2.0 * self.p * self.mu_k - cycle.limit

    def _cycle(self, start: float, missing: float, weight: float) -> Cycle:
        """Return the cycle whose stick ends when the spring's pull exceeds `weight` times the bonds' effect by
        `missing`.
        """
        scale = self.k * self.V * self.tau
        ratio = weight * self.p * (self.mu_b - self.mu_ub) / scale

        # x, the stick time over tau, solves x + ratio (exp(-x) - 1) = missing / scale, increasing beyond ln(ratio).
        def pulled(x: Array) -> tuple[Array, Array]:
            return x + ratio * np.expm1(-x), 1.0 - ratio * np.exp(-x)

        target, low = np.array([missing / scale]), np.array([max(math.log(ratio), 0.0) if ratio > 0.0 else 0.0])
        x = float(increasing_root(pulled, target, low, target + ratio)[0])
        phi = -math.expm1(-x)
        limit = self.p * (self.mu_ub + (self.mu_b - self.mu_ub) * phi)
        drop = self.p * ((self.mu_ub - self.mu_k) + (self.mu_b - self.mu_ub) * phi)
        return Cycle(start, x * self.tau, phi, limit, Slip(self.m, self.k, self.V, drop))

    def bonds(self, cycle: Cycle, t: Array) -> Array:
        return np.asarray(-np.expm1(-t / self.tau))
