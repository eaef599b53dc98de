"""Random scenes in which something is brief, each with its answer from closed forms and SciPy's interpolation alone.

A family makes a case as text and the values at its end. Histories and laws are written out anew here, so that what
surfacechem makes of them is compared with what they are. Every integrand is cut where it is narrow: at the places of
its law, where the history turns, and at distances from them that grow by a factor.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator
from scipy.special import roots_legendre

Array = NDArray[np.float64]

GAS, BOLTZMANN = 8.31446261815324, 1.380649e-23
MEAN, DROP = 350.0, 100.0
"""Mean temperature of two plates, and their difference at the start [K]."""


@dataclass
class NarrowScene:
    """A case, the values that it ends with, and what is told of the scene where it fails."""

    family: str
    text: str
    expected: dict[str, float]
    narrow: str
    size: float = 0.0
    """What errors are relative to, where not to the values themselves."""
    rounded: float = 0.0
    """What the last digits of the time of a steep history make of that, at most."""


@dataclass
class History:
    """A function of time, its text in a case, and the times at which it turns or bends."""

    text: str
    value: Callable[[Any], Any]
    marks: list[float]

    def passes(self, level: float, end: float) -> list[float]:
        """Times at which it has a value."""
        found = []
        points = sorted({0.0, end, *(t for t in self.marks if 0 < t < end)})
        for a, b in pairwise(points):
            low, high = self.value(a) - level, self.value(b) - level
            if low * high < 0:
                for _ in range(200):
                    middle = 0.5 * (a + b)
                    a, b = (middle, b) if (self.value(middle) - level) * low > 0 else (a, middle)
                found.append(0.5 * (a + b))
        return found


def ramp(rng: np.random.Generator, low: float, high: float, end: float) -> History:
    """From one value to the other."""
    start, stop = (low, high) if rng.random() < 0.5 else (high, low)
    rate = (stop - start) / end
    return History(f"{{ramp: {{start: {start!r}, rate: {rate!r}}}}}", lambda t: start + rate * t, [])


def harmonic(rng: np.random.Generator, low: float, high: float, end: float) -> History:
    """Up and down between two values, a fraction of a time or many."""
    mean, amplitude = 0.5 * (low + high), 0.5 * (high - low)
    frequency, phase = float(10 ** rng.uniform(-0.3, 1.3)) / end, float(rng.uniform(0, 6.28))
    w = 2 * math.pi * frequency
    text = f"{{harmonic: {{mean: {mean!r}, amplitude: {amplitude!r}, frequency: {frequency!r}, phase: {phase!r}}}}}"
    turns = [((k + 0.5) * math.pi - phase) / w for k in range(-1, int(w * end / math.pi) + 4)]
    turns = [t for t in turns if 0 < t < end]
    return History(text, lambda t: mean + amplitude * np.sin(w * t + phase), turns)


def pulse(rng: np.random.Generator, low: float, high: float, end: float) -> History:
    """At one value but for a brief visit to the other."""
    width = end * float(10 ** rng.uniform(-5, -1.3))
    start = float(rng.uniform(0.05, 0.8)) * end
    rest, top = (low, high) if rng.random() < 0.5 else (high, low)
    times = [0.0, start, start + 0.3 * width, start + 0.6 * width, start + width]
    values = [rest, rest, top, top, rest]
    text = f"{{table: {{times: {times!r}, values: {values!r}}}}}"

    return History(text, lambda t: np.interp(t, times, values), times[1:])


HISTORIES = (ramp, harmonic, pulse)


def history(rng: np.random.Generator, low: float, high: float, end: float) -> History:
    """Any of them."""
    return HISTORIES[rng.integers(len(HISTORIES))](rng, low, high, end)


def integral(function: Callable[[Array], Array], end: float, marks: list[float]) -> float:
    """The integral from zero on, cut around the marks at distances that grow; by Gauss at two orders that agree."""
    near = [end * 10.0**k for k in np.arange(-13.0, 0.0, 0.25)]
    cuts = np.array([0.0, end, *(m + s * d for m in (0.0, end, *marks) for d in (0.0, *near) for s in (-1, 1))])
    points = np.unique(cuts[(cuts >= 0) & (cuts <= end)])
    rough, fine = (_gauss(function, points, order) for order in (24, 32))
    assert abs(fine - rough) <= 2 * EPS / BRIEFEST * abs(fine)  # each of the two knows times to a last digit of them
    return fine


def _gauss(function: Callable[[Array], Array], points: Array, order: int) -> float:
    nodes, weights = roots_legendre(order)
    half, middle = 0.5 * np.diff(points), 0.5 * (points[1:] + points[:-1])
    return float(np.sum(half * (function(middle[:, None] + half[:, None] * nodes) @ weights)))


def narrow(rng: np.random.Generator) -> float:
    """How wide something is, relative to the whole."""
    return float(10 ** rng.uniform(-5, -1.5))


def duration(rng: np.random.Generator) -> float:
    """How long a run is [s]."""
    return float(10 ** rng.uniform(0, 3))


def scaled(
    rng: np.random.Generator, function: Callable[[Array], Array], end: float, marks: list[float]
) -> tuple[float, float]:
    """A factor and the integral of a function times it, such that what is narrow is felt."""
    whole, wanted = integral(function, end, marks), float(rng.uniform(0.1, 2.0))
    return (wanted / whole, wanted) if whole > 1e-12 * end else (1.0, whole)  # a history may come nowhere near


def around(gap: History, places: list[float], end: float) -> list[float]:
    """When a history turns or passes a place."""
    return [*gap.marks, *(t for place in places for t in gap.passes(place, end))]


PLATES = """T_0: 300 K
bodies:
  lower: {temperature: T_1, C: 1 kJ/m^2/K, capacity: constant}
  upper: {temperature: T_2, C: 1 kJ/m^2/K, capacity: constant}
initial: {T_1: 300 K, T_2: 400 K}
"""

EPS, BRIEFEST = float(np.finfo(float).eps), 1e-8
"""Last digit of a number, and part of a run that the briefest lasts."""

EXPOSURE = 500.0
"""Integral of the conductance over time in which the difference of the plates falls to 1/e [J/(m^2 K)]."""


def plates(family: str, law: str, loading: str, exponent: float, end: float, scale: str, rest: str = "") -> NarrowScene:
    """Two plates whose temperatures approach each other by a conductance that depends on the loading alone."""
    text = f"title: {family}\n{PLATES}{rest}\nheat: [{{{law}}}]\nloading: {{{loading}}}\nrun: {{until: {end!r} s}}\n"
    left = 0.5 * DROP * math.exp(-exponent)
    return NarrowScene(family, text, {"T_1": MEAN - left, "T_2": MEAN + left}, scale)


def layer(rng: np.random.Generator, span: float, width: float) -> list[float]:
    """Points of a table that is high at the middle one."""
    centre = float(rng.uniform(0.15, 0.85)) * span
    return [0.0, centre - 0.5 * width * span, centre, centre + 0.5 * width * span, span]


def tabulated(
    rng: np.random.Generator,
    at: list[float],
    x: History,
    end: float,
    places: list[float],
    unit: Callable[[Array], Array],
) -> tuple[str, float]:
    """The conductances of a table, and what comes of them where ``unit`` is the variable of a history."""
    table = PchipInterpolator(at, [0.0, 0.0, 1.0, 0.0, 0.0])
    marks = around(x, places, end)
    factor, exponent = scaled(rng, lambda t: table(np.clip(unit(x.value(t)), at[0], at[-1])), end, marks)
    return f"conductances: {[0.0, 0.0, EXPOSURE * factor, 0.0, 0.0]!r}", exponent


def gap_table(rng: np.random.Generator) -> NarrowScene:
    """A conductance that is high in a part of the gap."""
    end, width = duration(rng), narrow(rng)
    at, gap = layer(rng, 1e-3, width), history(rng, 0.0, 1e-3, end)
    values, exponent = tabulated(rng, at, gap, end, at, lambda g: g)
    law = f"gap-table: {{between: [lower, upper], gaps: {at!r}, {values}}}"
    return plates("gap-table", law, f"g_n: {gap.text}", exponent, end, f"{width:.1e} of the gap")


def elastic_pressure_table(rng: np.random.Generator) -> NarrowScene:
    """The same over a pressure, which follows from a given gap and the elasticity of the contact."""
    end, width = duration(rng), narrow(rng)
    at, gap = layer(rng, 1e6, width), history(rng, -1e-6, 1e-6, end)
    places = [0.0, *(-x / 1e12 for x in at)]
    values, exponent = tabulated(rng, at, gap, end, places, lambda g: np.maximum(-1e12 * g, 0.0))
    law = f"pressure-table: {{between: [lower, upper], pressures: {at!r}, {values}}}"
    rest = "interface: {potential: [{penalty: {E_n: 1e12 Pa/m}}]}"
    return plates("elastic pressure", law, f"g_n: {gap.text}", exponent, end, f"{width:.1e} of the pressure", rest)


def spots(h_0: float, decay: float) -> str:
    """Contact spots without gas, and with as little radiation as can be."""
    law = f"h_0: {h_0!r}, C_trans: {decay!r}, k_gas: 0, g_0: 1e-6, epsilon_1: 1e-15, epsilon_2: 1e-15"
    return f"gap-conductance: {{between: [lower, upper], {law}}}"


def tapping(rng: np.random.Generator) -> NarrowScene:
    """Contact spots that let go within little of the travel."""
    end, width = duration(rng), narrow(rng)
    lowest = float(rng.choice([0.0, 1e-3 * width * rng.random(), -1e-4 * rng.random()]))
    gap, decay = history(rng, lowest, 1e-3, end), 1e3 / width
    marks = around(gap, [0.0], end)
    factor, exponent = scaled(rng, lambda t: np.exp(-decay * np.maximum(gap.value(t), 0.0)), end, marks)
    law = spots(EXPOSURE * factor, decay)
    return plates("gap-conductance", law, f"g_n: {gap.text}", exponent, end, f"{width:.1e} of the travel")


ONE = """T_0: 300 K
bodies:
  lower: {temperature: T, C: 1 kJ/m^2/K, capacity: constant}
  upper: {temperature: T, C: 1 kJ/m^2/K, capacity: constant}
initial: {T: 300 K}
"""

HEAT = 1e5
"""Work that warms both by 50 K [J/m^2]."""


def rubbed(family: str, law: str, loading: str, heat: float, end: float, scale: str) -> NarrowScene:
    """One temperature that rises by the work of friction."""
    interface = f"interface: {{temperature: T, friction: [{{{law}}}]}}"
    text = f"title: {family}\n{ONE}{interface}\nloading: {{{loading}}}\nrun: {{until: {end!r} s}}\n"
    return NarrowScene(family, text, {"T": 300.0 + heat * HEAT / 2e3}, scale)


def stribeck(rng: np.random.Generator) -> NarrowScene:
    """Friction that is there near rest only, at a velocity that passes it."""
    end, width = duration(rng), narrow(rng)
    v = history(rng, float(rng.choice([-1.0, 0.0])), 1.0, end)

    def power(t: Array) -> Array:
        speed = np.abs(v.value(t))
        return 0.5 * np.exp(-np.minimum((speed / width) ** 2, 700.0)) * speed

    places = [s * m * width for s in (-1, 1) for m in (0.0, 0.1, 0.5, 1.0, 2.0, 5.0)]
    factor, heat = scaled(rng, power, end, around(v, places, end))
    law = f"stribeck: {{mu_s: 0.5, mu_k: 0.0, v_s: {width!r}}}"
    return rubbed("stribeck", law, f"p: {HEAT * factor!r}, v: {v.text}", heat, end, f"{width:.1e} of the velocity")


def film(rng: np.random.Generator) -> NarrowScene:
    """A sheared film whose thickness comes close to nothing."""
    end, width = duration(rng), narrow(rng)
    gap = history(rng, width * 1e-3, 1e-3, end)
    factor, heat = scaled(rng, lambda t: 1 / gap.value(t), end, gap.marks)
    law = f"viscous: {{eta: {HEAT * factor!r}}}"
    return rubbed("film", law, f"v: 1 m/s, g_n: {gap.text}", heat, end, f"{width:.1e} of the travel")


def bonded(family: str, bonding: str, loading: str, exponent: float, end: float, scale: str) -> NarrowScene:
    """Bonds that form, or break where the exponent is negative, by a rate that depends on the loading alone."""
    forms = exponent > 0
    bodies = ONE.replace("{T: 300 K}", f"{{T: 300 K, phi: {0 if forms else 1}}}")
    interface = f"interface: {{temperature: T, sites: 1e15 1/m^2, bonding: [{{{bonding}}}]}}"
    text = f"title: {family}\n{bodies}{interface}\nloading: {{{loading}}}\nrun: {{until: {end!r} s}}\n"
    return NarrowScene(family, text, {"phi": -math.expm1(-exponent) if forms else math.exp(exponent)}, scale)


def attachment(rng: np.random.Generator) -> NarrowScene:
    """Bonds that form where their tethers are not stretched, at a gap that passes there."""
    end, width, rest = duration(rng), narrow(rng), float(rng.uniform(0.0, 1e-6))
    gap, spread = history(rng, 0.0, 1e-6, end), width * 1e-6
    places = [rest + s * m * spread for s in (-1, 1) for m in (0.0, 0.3, 1.0, 2.0, 4.0, 8.0)]
    marks = around(gap, places, end)
    k_on, exponent = scaled(rng, lambda t: np.exp(-0.5 * ((gap.value(t) - rest) / spread) ** 2), end, marks)
    stiffness = BOLTZMANN * 300.0 / spread**2
    law = f"gap-attachment: {{k_on: {k_on!r}, stiffness: {stiffness!r}, rest_length: {rest!r}}}"
    return bonded("attachment", law, f"g_n: {gap.text}", exponent, end, f"{width:.1e} of the gap")


def bell(rng: np.random.Generator) -> NarrowScene:
    """Bonds that break while the force is high, which is brief as the rate is exponential in it."""
    end = duration(rng)
    f = history(rng, 0.0, float(rng.uniform(50e-12, 600e-12)), end)
    highest = max(float(f.value(t)) for t in (0.0, end, *f.marks))
    x = 5e-10 / (BOLTZMANN * 300.0)
    marks = around(f, [highest - m / x for m in (1.0, 3.0, 10.0, 30.0)], end)
    k_off, exponent = scaled(rng, lambda t: np.exp(f.value(t) * x), end, marks)
    law = f"bell: {{k_off: {k_off!r}, x_off: 5e-10}}"
    return bonded("bell", law, f"f: {f.text}", -exponent, end, f"{1 / (highest * x):.1e} of the force")


def activated(rng: np.random.Generator) -> NarrowScene:
    """Bonds that form while a given temperature is high."""
    end = duration(rng)
    T = history(rng, 300.0, float(rng.uniform(400.0, 900.0)), end)
    highest = max(float(T.value(t)) for t in (0.0, end, *T.marks))
    E = float(10 ** rng.uniform(5, 6))
    span = GAS * highest**2 / E
    marks = around(T, [highest - m * span for m in (1.0, 3.0, 10.0, 30.0)], end)
    factor, exponent = scaled(rng, lambda t: np.exp(E / GAS * (1 / highest - 1 / T.value(t))), end, marks)
    A = factor * math.exp(E / (GAS * highest))
    text = f"""title: activated
T_0: 300 K
bodies:
  lower: {{temperature: T}}
  upper: {{temperature: T}}
interface: {{temperature: T, sites: 1e15 1/m^2, bonding: [{{arrhenius: {{A: {A!r}, E_a: {E!r}}}}}]}}
loading: {{T: {T.text}}}
initial: {{phi: 0}}
run: {{until: {end!r} s}}
"""
    return NarrowScene("activated", text, {"phi": -math.expm1(-exponent)}, f"{span / (highest - 300):.1e} of the rise")


def worked(
    family: str, law: str, gap: History, energy: Callable[[float], float], end: float, scale: str
) -> NarrowScene:
    """The work on a given gap is what the energy changes by; told in units of the largest energy on the way."""
    interface = f"interface: {{temperature: T, potential: [{{{law}}}]}}"
    text = f"title: {family}\n{ONE}{interface}\nloading: {{g_n: {gap.text}}}\nrun: {{until: {end!r} s}}\n"
    start, stop = energy(float(gap.value(0.0))), energy(float(gap.value(end)))
    size = max(abs(energy(float(gap.value(t)))) for t in (0.0, end, *gap.marks, *gap.passes(0.0, end)))
    digits = 4 * np.finfo(float).eps
    steep = [*gap.marks, *(t for level in (1e-9, 1e-8, 1e-7, 1e-6) for t in gap.passes(level, end))]
    beside = [[energy(float(gap.value(t * (1 + s * digits)))) for s in (-1, 1)] for t in steep]
    rounded = max((abs(after - before) for before, after in beside), default=0.0)
    return NarrowScene(family, text, {"W_g_n": stop - start}, scale, size, rounded / size if size else 0.0)


def zone(rng: np.random.Generator) -> NarrowScene:
    """Work on a gap that is moved through an attraction, which no state feels."""
    end, width = duration(rng), narrow(rng)
    gap = history(rng, float(rng.choice([0.0, -1e-6 * rng.random()])), 1e-3, end)
    g_0, t_max, E_n = 1e-3 * width, 1e6, 1e12

    def energy(g: float) -> float:
        u = g / g_0
        held = math.exp(-u) * (1 + u) if u > 0 else 1.0
        return -t_max * g_0 * math.e * held + 0.5 * E_n * min(g, 0.0) ** 2

    law = f"exponential-cohesive-zone: {{t_max: {t_max!r}, g_0: {g_0!r}, E_n: {E_n!r}}}"
    return worked("cohesive-zone", law, gap, energy, end, f"{width:.1e} of the travel")


def _swing(rng: np.random.Generator, end: float, nearest: float) -> tuple[History, str, str]:
    """A mass on a spring that starts at its highest: its motion, its loading, and the rest of the case."""
    cycles, swing = float(rng.uniform(0.3, 8)), 4e-4
    w, mean = 2 * math.pi * cycles / end, nearest + swing
    turns = [k * math.pi / w for k in range(1, int(2 * cycles) + 1)]
    rest = f"mechanics: {{normal: {{m: 1.0, k: {w**2!r}}}}}"
    # No difference of what is much larger than the gap where it is least.
    return History("", lambda t: nearest + 2 * swing * np.cos(0.5 * w * t) ** 2, turns), f"w_n: {mean!r}", rest


def _swinging(scene: NarrowScene, motion: History) -> NarrowScene:
    start = f"g_n: {float(motion.value(0.0))!r}, v_n: 0"
    return replace(scene, text=scene.text.replace("T_2: 400 K}", f"T_2: 400 K, {start}}}"))


def swinging_mass(rng: np.random.Generator) -> NarrowScene:
    """A mass that swings through a layer."""
    end, width = duration(rng), narrow(rng)
    motion, loading, rest = _swing(rng, end, 1e-4)
    at = layer(rng, 1e-3, width)
    values, exponent = tabulated(rng, at, motion, end, at, lambda g: g)
    law, scale = f"gap-table: {{between: [lower, upper], gaps: {at!r}, {values}}}", f"{width:.1e} of the travel"
    return _swinging(plates("swinging mass", law, loading, exponent, end, scale, rest), motion)


def swinging_spots(rng: np.random.Generator) -> NarrowScene:
    """A mass that swings close to touch, where contact spots hold for little."""
    end, width = duration(rng), narrow(rng) ** 2
    motion, loading, rest = _swing(rng, end, 1e-4 * width * rng.random())
    decay = 1e3 / width
    factor, exponent = scaled(rng, lambda t: np.exp(-decay * motion.value(t)), end, around(motion, [], end))
    law = spots(EXPOSURE * factor, decay)
    scene = plates("swinging spots", law, loading, exponent, end, f"{width:.1e} of the travel", rest)
    return _swinging(scene, motion)


FAMILIES = [
    *(gap_table, elastic_pressure_table, tapping, stribeck, film),
    *(attachment, bell, zone, activated, swinging_mass, swinging_spots),
]


def scene(seed: int) -> NarrowScene:
    """A random scene; the families follow each other."""
    return FAMILIES[seed % len(FAMILIES)](np.random.default_rng(seed))
