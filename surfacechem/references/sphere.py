"""Sphere with attraction or adhesion: over a plane on a spring, with snap-in and pull-off, and in a cavity."""

from __future__ import annotations

import math
from abc import abstractmethod
from functools import cached_property, partial

import numpy as np

from surfacechem.contracts.terms import parameter
from surfacechem.errors import InputError
from surfacechem.references.base import Array, Parameters, Quantities, Reference, SceneView, read
from surfacechem.references.normal_contact import AttractionOnSpring, SnapPoint
from surfacechem.tolerances import EQUAL

SEARCH_POINTS = 4001
"""Number of approaches in the search for the steepest attraction, on either side of which the folds are bisected."""

LEAST_APPROACH, LARGEST_APPROACH = 1e-2, 1e3
"""Bounds of this search, in units of the range of the interaction."""

PAIR_POWERS = {10: 1 / 45, 4: -1 / 3}
"""Coefficients of a pair energy of Lennard-Jones type by power, eq. e:psi12ex."""


class SphereOnSpring(AttractionOnSpring):
    """A sphere on a spring that is brought slowly to an attracting body and withdrawn again."""

    k: float = parameter("N/m", "stiffness of the spring", above=0)
    g_0: float = parameter("m", "range of the interaction", above=0)
    R: float = parameter("m", "radius of the sphere", above=0)
    w_i: float = parameter("m", "far-field displacement at first and at last", above=0)
    w_turn: float = parameter("m", "displacement at which it turns")
    speed: float = parameter("m/s", "speed both ways", above=0)

    readings = read(surface="R g_0")

    @classmethod
    def from_scene(cls, scene: SceneView) -> Parameters:
        load = scene.scene.loading.get("w_n")
        times, values = (list(getattr(load, name, ())) for name in ("times", "values"))
        same = partial(math.isclose, rel_tol=EQUAL)  # the same length in two units differs by its rounding
        if len(times) != 3 or not same(values[0], values[2]) or not same(times[2], 2 * times[1]):
            raise InputError("it needs a table of `w_n` that goes to one displacement and back at one speed.")
        speed = (values[0] - values[1]) / times[1]
        return {**super().from_scene(scene), "w_i": values[0], "w_turn": values[1], "speed": speed}

    @property
    def end_time(self) -> float:
        """Time [s] of the return to the initial displacement."""
        return 2 * (self.w_i - self.w_turn) / self.speed

    @property
    def ends(self) -> tuple[float, float]:
        """Approaches beyond all that occur [m]."""
        return self.lowest, self.w_i + LARGEST_APPROACH * self.g_0

    @property
    @abstractmethod
    def lowest(self) -> float:
        """An approach below all that occur [m]."""

    @cached_property
    def folds(self) -> tuple[float, float]:
        """Approaches [m] at which equilibrium is lost, on opening and on closing."""
        near, far = self.ends
        places = np.geomspace(LEAST_APPROACH * self.g_0, far, SEARCH_POINTS)
        softest = float(places[np.argmin(self.derivative(places, 2))])
        if self.derivative(np.array([softest]), 2)[0] >= -self.k:
            raise InputError(f"{self.name}: the spring holds it everywhere; there is no jump.")
        return self._fold(near, softest, -1.0), self._fold(softest, far, 1.0)

    # The slope falls and rises once, so that it passes -k once on either side of its lowest value.
    def _fold(self, low: float, high: float, sign: float) -> float:
        """Return the approach [m] at which the slope of the force is minus the spring's stiffness, by bisection."""
        for _ in range(200):
            middle = (low + high) / 2
            held = sign * (float(self.derivative(np.array([middle]), 2)[0]) + self.k)
            low, high = (middle, high) if held < 0 else (low, middle)
        return (low + high) / 2

    @property
    def jumps(self) -> tuple[SnapPoint, SnapPoint]:
        """The pull-off and the snap-in."""
        (off, on), (near, far) = self.folds, self.ends
        return self.jump(off, on, far), self.jump(on, near, off)

    def quantities(self, t: Array) -> Quantities:
        before = self.w_i - self.w_turn - self.speed * t
        w, (off, on), (near, far) = self.w_turn + np.abs(before), self.folds, self.ends
        w_off, w_on = self.displacement(np.array([off, on]))[0]
        # On approach the open branch ends at the snap-in fold, on withdrawal the closed one at the pull-off fold.
        apart = np.where(before > 0, w >= w_on, (w > w_off) | (self.w_turn > w_on))
        open_gap, closed = self.gap(np.maximum(w, w_on), on, far), self.gap(np.minimum(w, w_off), near, off)
        g = np.where(apart, open_gap, closed)
        return {"w_n": w, "g_n": g, "t_n": self.traction(g)}


class AttractingSphereOnSpring(SphereOnSpring):
    r"""A sphere on a spring whose points attract those of a plane, with repulsion at short range: snap-in and pull-off.

    .. math:: k (w - g) = F, \quad F = -\sum_m \frac{4 \pi^2 R\,a_m}{m - 2} \left[ g^{2-m} - (g + 2R)^{2-m} \right]

    with the energy of a pair, :math:`\psi = \sum_m a_m r^{-m}`, of Lennard-Jones type: over a plane the integral of
    :math:`r^{-m}` is :math:`2 \pi g^{2-m} / (m - 2)`, and over a sphere :math:`dA = 2 \pi R\,dz`. Equilibrium is lost
    where the slope of F is -k, and the jump releases the drop of :math:`\tfrac12 k (w - g)^2 + E`.

    Source: Hamaker (1937), doi 10.1016/S0031-8914(37)80203-7, for a pair energy like Sauer, Duong & Mandadapu (2021),
    eq. e:psi12ex, of points on both surfaces.

    >>> tip = AttractingSphereOnSpring(n_1=5e18, n_2=5e18, psi_0=4e-21, g_0=3e-10, R=5e-8, k=0.5, w_i=6e-9,
    ...                                 w_turn=-1e-9, speed=1e-8)
    >>> [f"{jump.g:.6e} {jump.release:.6e}" for jump in tip.jumps]
    ['1.912417e-10 2.867271e-17', '1.021492e-09 8.347971e-19']
    """

    n_1: float = parameter("1/m^2", "density of points on body 1", above=0)
    n_2: float = parameter("1/m^2", "density of points on body 2", above=0)
    psi_0: float = parameter("J", "interaction energy of a pair", above=0)

    readings = read(surface="n_1 n_2 psi_0")

    @property
    def lowest(self) -> float:
        """An approach well within the repulsion [m]."""
        return LEAST_APPROACH * self.g_0

    def derivative(self, g: Array, order: int) -> Array:
        whole = np.zeros_like(g)
        for m, a in PAIR_POWERS.items():
            # In units of the range of the interaction, so that no power overflows.
            near, far = g / self.g_0, (g + 2 * self.R) / self.g_0
            factor = math.prod(3 - m - k for k in range(order)) / ((m - 2) * (m - 3))
            whole += a * factor * (near ** (3 - m - order) - far ** (3 - m - order))
        size = 4 * math.pi**2 * self.R * self.n_1 * self.n_2 * self.psi_0
        return np.asarray(size * self.g_0 ** (3 - order) * whole)


class CohesiveSphereOnSpring(SphereOnSpring):
    r"""A sphere on a spring that adheres to a plane by an exponential cohesive zone: snap-in and pull-off.

    .. math:: k (w - g) = F, \quad F = 2 \pi R \left[ \Psi(g + 2R) - \Psi(g) \right], \quad
              A = 2 \pi R \langle -g \rangle

    Over a sphere :math:`dA = 2 \pi R\,dz`, so that the force is the energy per area between flats, :math:`\Psi`, for
    any law of the gap to the plane. Its largest value is about :math:`2 \pi R` times the work of separation.

    Source: Derjaguin, Muller & Toporov (1975), doi 10.1016/0021-9797(75)90018-1, exact for a rigid sphere; the zone of
    Sauer, Duong & Mandadapu (2021), eq. ex:psi_czm.

    >>> tip = CohesiveSphereOnSpring(t_max=5e6, g_0=5e-9, E_n=2e17, R=1e-6, k=20.0, w_i=6e-8, w_turn=-2e-8, speed=8e-8)
    >>> [f"{jump.w:.6e} {jump.release:.6e}" for jump in tip.jumps]
    ['2.206377e-08 7.832043e-16', '1.856246e-08 4.128297e-16']
    """

    t_max: float = parameter("Pa", "strength", above=0)
    E_n: float = parameter("Pa/m", "contact stiffness in compression", above=0)

    readings = read(surface="t_max E_n")

    @property
    def lowest(self) -> float:
        """An overlap that bears more than adhesion and spring can press [m]."""
        adhesion = math.e * self.t_max * self.g_0
        # Twice and four times the largest possible values of the two.
        pressed = 2 * adhesion + 4 * self.k * (self.w_i - self.w_turn) / (2 * math.pi * self.R)
        return -math.sqrt(2 * pressed / self.E_n)

    def flats(self, g: Array, order: int) -> Array:
        """Return the energy between flats [J/m^2] integrated over the gap (order -1), itself (0), or its slope (1)."""
        apart, pressed = np.maximum(g, 0) / self.g_0, np.minimum(g, 0)
        zone = {-1: (apart + 2), 0: -(apart + 1), 1: apart}[order] * np.exp(1 - apart)
        depth = self.t_max * self.g_0
        contact = {
            -1: self.E_n * pressed**3 / 6 - math.e * depth * pressed,
            0: self.E_n * pressed**2 / 2,
            1: self.E_n * pressed,
        }
        return np.asarray(depth * self.g_0**-order * zone + contact[order])

    def derivative(self, g: Array, order: int) -> Array:
        return 2 * math.pi * self.R * (self.flats(g + 2 * self.R, order - 1) - self.flats(g, order - 1))


class AttractingSphereInCavity(Reference):
    r"""A sphere in a hollow sphere whose points attract each other: the force during motion at a given speed.

    .. math:: E = \sum_m \frac{4 \pi^2 R H a_m}{c (m-2)(m-3)} \left[ (H-R-c)^{3-m} - (H-R+c)^{3-m}
              - (H+R-c)^{3-m} + (H+R+c)^{3-m} \right], \quad F = -\frac{dE}{dc}

    with the distance of the centres :math:`c = H - R - g` and the energy of a pair :math:`\sum_m a_m r^{-m}` of
    Lennard-Jones type. Only off the centre, where the terms would cancel.

    Source: elementary, by rings of equal distance on both spheres; Hamaker (1937), doi 10.1016/S0031-8914(37)80203-7.
    The pair energy is that of Sauer, Duong & Mandadapu (2021), eq. e:psi12ex.

    >>> ball = AttractingSphereInCavity(n_1=5e18, n_2=5e18, psi_0=4e-21, g_0=3e-10, R=2e-8, H=2.5e-8, g_i=1e-9,
    ...                                rate=0, T_i=300.0)
    >>> f"{float(ball.solution(0.0)['t_n']):.6e}"
    '5.263605e-10'
    """

    n_1: float = parameter("1/m^2", "density of points on body 1", above=0)
    n_2: float = parameter("1/m^2", "density of points on body 2", above=0)
    psi_0: float = parameter("J", "interaction energy of a pair", above=0)
    g_0: float = parameter("m", "range of the interaction", above=0)
    R: float = parameter("m", "radius of the sphere", above=0)
    H: float = parameter("m", "radius of the cavity", above=0)
    g_i: float = parameter("m", "approach at the start", above=0)
    rate: float = parameter("m/s", "rate of the approach")

    T_i: float = parameter("K", "temperature, which stays", above=0)

    readings = read(ramp="rate=g_n", initial="g_i=g_n", temperature="T_i", surface="n_1 n_2 psi_0 g_0")

    @classmethod
    def from_scene(cls, scene: SceneView) -> Parameters:
        from surfacechem.surfaces.shapes import Sphere

        radii = [shape.R for shape in scene.surfaces.shapes if isinstance(shape, Sphere)]
        if len(radii) != 2:
            raise InputError("it needs a sphere in a cavity.")
        return {**super().from_scene(scene), "R": min(radii), "H": max(radii)}

    def quantities(self, t: Array) -> Quantities:
        g = self.g_i + self.rate * t
        c, whole = self.H - self.R - g, np.zeros_like(g)
        ends = {1: (self.H - self.R, self.H + self.R), -1: (self.H + self.R, self.H - self.R)}
        for m, a in PAIR_POWERS.items():
            p, terms, slopes = 3 - m, np.zeros_like(g), np.zeros_like(g)
            for sign, (minus, plus) in ends.items():
                # Lengths in units of the range of the interaction.
                near, far = (minus - c) / self.g_0, (plus + c) / self.g_0
                terms += sign * (near**p + far**p)
                slopes += sign * p * (far ** (p - 1) - near ** (p - 1)) / self.g_0
            whole += a / ((m - 2) * (m - 3)) * (terms / c - slopes)
        size = 4 * math.pi**2 * self.R * self.H * self.n_1 * self.n_2 * self.psi_0 * self.g_0**3
        return {"g_n": g, "t_n": size * whole / c, "T": self.T_i}
