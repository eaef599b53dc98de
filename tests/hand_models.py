"""Scenes of several families with random parameters, each with its equations written out by hand for SciPy.

Nothing here reads the package: the cases are text, and the equations are those of the literature as one types them.
Each family is a function of a random generator; it hands back the text of a case, the output times, and values by name
at a tolerance of SciPy's solver.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

BOLTZMANN, GAS = 1.380649e-23, 8.31446261815324

T_0 = 300.0
OUTPUTS = 21


@dataclass(frozen=True)
class HandModel:
    """A case as text, its output times, and what its variables are at a tolerance."""

    text: str
    times: np.ndarray
    values: Callable[[float], Mapping[str, np.ndarray]]


def integrated(rhs, y0, times, rtol, scale=None):
    """States at the output times, shape (states, times)."""
    scale = np.maximum(np.abs(y0), 1e-30) if scale is None else np.asarray(scale)
    step = times[-1] / 50
    found = solve_ivp(rhs, (0, times[-1]), y0, "Radau", times, rtol=rtol, atol=1e-3 * rtol * scale, max_step=step)
    assert found.success, found.message
    return found.y


def between(dice, low, high):
    """A random number, even in its logarithm."""
    return float(np.exp(dice.uniform(math.log(low), math.log(high))))


def case(bodies, interface, rest, end):
    """The text of a case; ``bodies`` are the fields of the lower and the upper one."""
    lower, upper = bodies
    return f"""T_0: {T_0}
bodies:
  lower: {{{lower}}}
  upper: {{{upper}}}
interface:
{interface}
{rest}
run: {{until: {end!r}, outputs: {OUTPUTS}, rtol: 1e-10}}
"""


ISOTHERMAL = ("temperature: 300 K", "temperature: 300 K")


def linear_affinity(dice):
    """Bonding that heats or cools: N phi' = -N c mu, mu = K (phi - phi_eq) / N; capacities proportional to T."""
    C, phi_eq = between(dice, 1, 1e3), dice.uniform(0.5, 1.0)
    K = between(dice, 0.01, 0.3) * C * T_0
    N, rate = between(dice, 1e16, 1e19), between(dice, 0.1, 10)
    phi, T = dice.uniform(0, 0.4), dice.uniform(280, 330)
    end = 5 / rate
    bodies = (f"temperature: T, C: {C / 4!r}", f"temperature: T, C: {3 * C / 4!r}")
    interface = f"""  temperature: T
  sites: {N!r}
  potential: [bond-energy: {{K_0: {K!r}, phi_eq: {phi_eq!r}}}]
  bonding: [linear-affinity: {{c_r: {rate * N / K!r}}}]"""

    def rhs(t, y):
        change = -rate * (y[0] - phi_eq)
        return [change, -K * (y[0] - phi_eq) * change / (C * y[1] / T_0)]

    times = np.linspace(0, end, OUTPUTS)
    return HandModel(
        case(bodies, interface, f"initial: {{phi: {phi!r}, T: {T!r}}}", end),
        times,
        lambda rtol: dict(zip(("phi", "T"), integrated(rhs, [phi, T], times, rtol, [1, T]), strict=True)),
    )


def bell_ramp(dice):
    """Bonds under a rising force: phi' = k_on exp(f x_on / kT) (1 - phi) - k_off exp(f x_off / kT) phi."""
    T, k_off, k_on = dice.uniform(280, 320), between(dice, 0.01, 10), between(dice, 0.001, 10)
    x_off, x_on = between(dice, 1e-10, 8e-10), -between(dice, 1e-11, 4e-10)
    start, rate, phi = dice.uniform(0, 1e-11), between(dice, 1e-12, 1e-10), dice.uniform(0.3, 1)
    end = 6 * BOLTZMANN * T / (rate * x_off)
    interface = f"""  temperature: {T!r}
  sites: 1e14
  bonding: [bell: {{k_off: {k_off!r}, x_off: {x_off!r}, k_on: {k_on!r}, x_on: {x_on!r}}}]"""
    rest = f"loading: {{f: {{ramp: {{start: {start!r}, rate: {rate!r}}}}}}}\ninitial: {{phi: {phi!r}}}"

    def rhs(t, y):
        f = (start + rate * t) / (BOLTZMANN * T)
        return [k_on * math.exp(f * x_on) * (1 - y[0]) - k_off * math.exp(f * x_off) * y[0]]

    bodies = (f"temperature: {T!r}", f"temperature: {T!r}")
    times = np.linspace(0, end, OUTPUTS)
    return HandModel(
        case(bodies, interface, rest, end), times, lambda rtol: {"phi": integrated(rhs, [phi], times, rtol, [1])[0]}
    )


def sliding_with_loss(dice):
    """Dry friction mu (T_0 / T)^q at an oscillating velocity, with loss: C T' = mu p |v| - h (T - T_a)."""
    C, h, T_a = between(dice, 100, 1e4), between(dice, 1, 100), dice.uniform(280, 310)
    mu, q, p = dice.uniform(0.1, 0.8), dice.uniform(0.2, 1.5), between(dice, 1e4, 1e6)
    mean, amplitude = between(dice, 0.01, 0.1), dice.uniform(0.1, 0.9)
    end = between(dice, 0.3, 2) * C / h
    f = dice.uniform(1, 4) / end
    bodies = tuple(f"temperature: T, capacity: constant, C: {C / 2!r}" for _ in range(2))
    interface = (
        f"  temperature: T\n  friction: [coulomb: {{mu: {{value: {mu!r}, times: [power: {{exponent: {-q!r}}}]}}}}]"
    )
    wave = f"harmonic: {{mean: {mean!r}, amplitude: {amplitude * mean!r}, frequency: {f!r}}}"
    rest = f"""heat: [conductance: {{between: [lower, surroundings], h: {h!r}}}]
surroundings: {{temperature: {T_a!r}}}
loading: {{p: {p!r}, v: {{{wave}}}}}
initial: {{T: {T_a!r}}}"""

    def rhs(t, y):
        v = mean * (1 + amplitude * math.sin(2 * math.pi * f * t))
        return [(mu * (T_0 / y[0]) ** q * p * v - h * (y[0] - T_a)) / C]

    times = np.linspace(0, end, OUTPUTS)
    return HandModel(
        case(bodies, interface, rest, end), times, lambda rtol: {"T": integrated(rhs, [T_a], times, rtol)[0]}
    )


def stick_slip(dice):
    """A mass that a spring drags: it sticks until k (V t - u) = mu_s p, slides at mu p, and sticks again at v = 0."""
    p, mu = between(dice, 1e4, 1e6), dice.uniform(0.1, 0.5)
    mu_s = mu * dice.uniform(1.1, 2)
    k, m, V = between(dice, 1e7, 1e9), between(dice, 1, 100), between(dice, 1e-4, 1e-2)
    C = between(dice, 100, 1e4)
    first = mu_s * p / (k * V)
    end = first * dice.uniform(1.2, 1.6) + 4 * 2 * math.pi * math.sqrt(m / k)
    bodies = tuple(f"temperature: T, capacity: constant, C: {C / 2!r}" for _ in range(2))
    interface = f"  temperature: T\n  friction: [coulomb: {{mu: {mu!r}, mu_s: {mu_s!r}}}]"
    rest = f"""mechanics: {{tangential: {{k: {k!r}, m: {m!r}}}}}
loading: {{p: {p!r}, w_t: {{ramp: {{rate: {V!r}}}}}}}
initial: {{T: 300 K}}"""
    times = np.linspace(0, end, OUTPUTS)

    def values(rtol):
        """Rest and slip by turns; each slip is an initial value problem that ends where the velocity is zero again."""
        u, T, t, found = 0.0, T_0, 0.0, np.zeros((2, OUTPUTS))
        while t < end:
            leaves = u / V + mu_s * p / (k * V)
            found[:, (times >= t) & (times <= leaves)] = [[u], [T]]
            if leaves >= end:
                break

            def rhs(s, y):
                return [y[1], (k * (V * s - y[0]) - mu * p) / m, mu * p * y[1] / C]

            def stops(s, y, since=leaves):
                return y[1] if s > since + 0.1 * math.sqrt(m / k) else 1.0

            stops.terminal, stops.direction = True, -1
            slip = solve_ivp(
                rhs,
                (leaves, leaves + 20 * math.sqrt(m / k)),
                [u, 0, T],
                "DOP853",
                events=stops,
                rtol=rtol,
                atol=rtol * np.array([1e-9, 1e-9, 1e-3]),
                dense_output=True,
                max_step=0.05 * math.sqrt(m / k),
            )
            t, (u, _, T) = slip.t[-1], slip.y[:, -1]
            inside = (times > leaves) & (times < t)
            if inside.any():
                found[:, inside] = slip.sol(times[inside])[[0, 2]]
        return {"u_t": found[0], "T": found[1]}

    return HandModel(case(bodies, interface, rest, end), times, values)


def aging_contacts(dice):
    """Rate and state: theta' = 1 - |v| theta / L; t = a p arsinh(v / (2 v_0) exp((mu_0 + b ln(v_0 theta / L)) / a))."""
    a, b, mu_0 = dice.uniform(0.005, 0.02), dice.uniform(0.005, 0.03), dice.uniform(0.3, 0.8)
    L, v_0, p = between(dice, 1e-6, 1e-4), between(dice, 1e-7, 1e-5), between(dice, 1e5, 1e7)
    mean, part = between(dice, 0.3, 10) * v_0, dice.uniform(0.1, 0.95)
    theta, end = between(dice, 0.1, 10) * L / mean, 6 * L / mean
    f = dice.uniform(1, 3) / end
    law = f"rate-and-state-aging: {{mu_0: {mu_0!r}, a: {a!r}, b: {b!r}, L: {L!r}, v_0: {v_0!r}}}"
    interface = f"  temperature: 300 K\n  friction: [{law}]"
    wave = f"harmonic: {{mean: {mean!r}, amplitude: {part * mean!r}, frequency: {f!r}}}"
    rest = f"loading: {{p: {p!r}, v: {{{wave}}}}}\ninitial: {{theta: {theta!r}}}"
    times = np.linspace(0, end, OUTPUTS)
    velocity = mean * (1 + part * np.sin(2 * math.pi * f * times))

    def rhs(t, y):
        return [1 - mean * (1 + part * math.sin(2 * math.pi * f * t)) * y[0] / L]

    def values(rtol):
        age = integrated(rhs, [theta], times, rtol)[0]
        strength = np.exp((mu_0 + b * np.log(v_0 * age / L)) / a)
        traction = a * p * np.arcsinh(velocity / (2 * v_0) * strength)
        return {"theta": age, "t_rate_and_state_aging": traction}

    return HandModel(case(ISOTHERMAL, interface, rest, end), times, values)


def pressed_contact(dice):
    """Two bodies under a pressure: C_1 T_1' = -h (T_1 - T_2) = -C_2 T_2', h = 1.25 k m / s (p / H)^0.95."""
    C_1, C_2 = between(dice, 100, 1e4), between(dice, 100, 1e4)
    k, m, s, H = between(dice, 1, 100), between(dice, 0.05, 0.3), between(dice, 1e-7, 1e-5), between(dice, 1e8, 1e10)
    mean, part = between(dice, 1e-4, 1e-2) * H, dice.uniform(0.1, 0.9)
    T_1, T_2 = dice.uniform(280, 400), dice.uniform(280, 400)
    end = 3 * min(C_1, C_2) / (1.25 * k * m / s * (mean / H) ** 0.95)
    f = dice.uniform(1, 4) / end
    bodies = (f"temperature: T_1, capacity: constant, C: {C_1!r}", f"temperature: T_2, capacity: constant, C: {C_2!r}")
    law = f"cooper-mikic-yovanovich: {{between: [lower, upper], k: {k!r}, m: {m!r}, sigma: {s!r}, H: {H!r}}}"
    wave = f"harmonic: {{mean: {mean!r}, amplitude: {part * mean!r}, frequency: {f!r}}}"
    rest = f"heat: [{law}]\nloading: {{p: {{{wave}}}}}\ninitial: {{T_1: {T_1!r}, T_2: {T_2!r}}}"

    def rhs(t, y):
        p = mean * (1 + part * math.sin(2 * math.pi * f * t))
        q = 1.25 * k * m / s * (p / H) ** 0.95 * (y[0] - y[1])
        return [-q / C_1, q / C_2]

    times = np.linspace(0, end, OUTPUTS)
    names = ("T_1", "T_2")
    return HandModel(
        case(bodies, "  partition: 0.5", rest, end),
        times,
        lambda rtol: dict(zip(names, integrated(rhs, [T_1, T_2], times, rtol), strict=True)),
    )


def pull_off(dice, *, inertial):
    """A gap pulled open against t(g) = t_max g / g_0 exp(1 - g / g_0): m g'' + c g' = k (w - g) - t(g)."""
    t_max, g_0 = between(dice, 1e5, 1e7), between(dice, 1e-8, 1e-6)
    k = between(dice, 0.1, 3) * t_max / g_0
    end = between(dice, 0.1, 10)
    speed = dice.uniform(3, 6) * (g_0 + t_max / k) / end
    c = between(dice, 0.003, 0.1) * k * end
    m = between(dice, 1e-4, 1e-2) * k * end**2 if inertial else 0.0
    zone = f"exponential-cohesive-zone: {{t_max: {t_max!r}, g_0: {g_0!r}, E_n: {t_max / g_0!r}}}"
    interface = f"  temperature: 300 K\n  potential: [{zone}]"
    mounting = f"k: {k!r}, c_g: {c!r}" + (f", m: {m!r}" if inertial else "")
    rest = (
        f"mechanics: {{normal: {{{mounting}}}}}\nloading: {{w_n: {{ramp: {{rate: {speed!r}}}}}}}\ninitial: {{g_n: 0}}"
    )
    times = np.linspace(0, end, OUTPUTS)

    def traction(g):
        return t_max * g / g_0 * math.exp(1 - g / g_0) if g > 0 else t_max / g_0 * (math.e + 1) * g

    def rhs(t, y):
        pull = k * (speed * t - y[0]) - traction(y[0])
        return [y[1], (pull - c * y[1]) / m] if inertial else [pull / c]

    def values(rtol):
        start = [0.0, 0.0] if inertial else [0.0]
        found = integrated(rhs, start, times, rtol, [g_0, g_0 / end][: len(start)])
        return dict(zip(("g_n", "v_n"), found, strict=False))

    return HandModel(case(ISOTHERMAL, interface, rest, end), times, values)


def overdamped_pull_off(dice):
    """The gap without a mass."""
    return pull_off(dice, inertial=False)


def inertial_pull_off(dice):
    """The gap with a mass."""
    return pull_off(dice, inertial=True)


def quasi_static_opening(dice):
    """A stiff mounting opens a cohesive zone in equilibrium all the way: k (w - g) = t(g)."""
    t_max, g_0 = between(dice, 1e5, 1e7), between(dice, 1e-8, 1e-6)
    k = dice.uniform(1.2, 4) * t_max / g_0  # the zone softens by t_max / g_0 / e at most
    end = 1.0
    top = dice.uniform(2, 8) * g_0
    zone = f"exponential-cohesive-zone: {{t_max: {t_max!r}, g_0: {g_0!r}, E_n: {t_max / g_0!r}}}"
    interface = f"  temperature: 300 K\n  potential: [{zone}]"
    rest = f"mechanics: {{normal: {{k: {k!r}}}}}\nloading: {{w_n: {{ramp: {{rate: {top!r}}}}}}}\ninitial: {{g_n: 0}}"
    times = np.linspace(0, end, OUTPUTS)

    def values(rtol):
        def residual(g, w):
            return k * (w - g) - t_max * g / g_0 * math.exp(1 - g / g_0)

        gaps = [brentq(residual, 0, w, (w,), xtol=1e-30, rtol=8.9e-16) if w else 0.0 for w in top * times]
        gap = np.array(gaps)
        return {"g_n": gap, "t_n": t_max * gap / g_0 * np.exp(1 - gap / g_0)}

    return HandModel(case(ISOTHERMAL, interface, rest, end), times, values)


def cure(dice):
    """Autocatalytic cure that heats two plates: phi' = (k_1 + k_2 phi^m) (1 - phi)^n, C T' = H phi'."""
    C, T = between(dice, 500, 5000), dice.uniform(400, 480)
    H = dice.uniform(5, 60) * C
    E_1, E_2 = dice.uniform(4e4, 8e4), dice.uniform(4e4, 8e4)
    m, n = dice.uniform(0.4, 1.5), dice.uniform(1.0, 2.0)
    scale = between(dice, 1e-3, 1e-1)
    A_1, A_2 = 0.1 * scale * math.exp(E_1 / (GAS * T)), scale * math.exp(E_2 / (GAS * T))
    phi, end = dice.uniform(0.005, 0.1), 6 / scale
    bodies = tuple(f"temperature: T, capacity: constant, C: {C / 2!r}" for _ in range(2))
    law = f"kamal-sourour: {{A_1: {A_1!r}, A_2: {A_2!r}, E_1: {E_1!r}, E_2: {E_2!r}, m: {m!r}, n: {n!r}}}"
    interface = f"  temperature: T\n  sites: 1e23\n  potential: [linear-enthalpy: {{H_r: {H!r}}}]\n  bonding: [{law}]"

    def rhs(t, y):
        k_1, k_2 = A_1 * math.exp(-E_1 / (GAS * y[1])), A_2 * math.exp(-E_2 / (GAS * y[1]))
        change = (k_1 + k_2 * y[0] ** m) * max(1 - y[0], 0) ** n
        return [change, H / C * change]

    times = np.linspace(0, end, OUTPUTS)
    return HandModel(
        case(bodies, interface, f"initial: {{phi: {phi!r}, T: {T!r}}}", end),
        times,
        lambda rtol: dict(zip(("phi", "T"), integrated(rhs, [phi, T], times, rtol, [1, T]), strict=True)),
    )


def thinning_film(dice):
    """A film that is squeezed and thins as it warms: C T' = eta exp(-beta (T - T_0)) v^2 / g - h (T - T_a)."""
    C, h, T_a = between(dice, 100, 2000), between(dice, 1, 100), dice.uniform(280, 310)
    eta, beta, v = between(dice, 1e-3, 1), dice.uniform(0.0, 0.05), between(dice, 0.01, 1)
    end = between(dice, 0.3, 2) * C / h
    g = eta * v**2 / (h * dice.uniform(5, 100))
    closes = dice.uniform(0.1, 0.95)
    bodies = tuple(f"temperature: T, capacity: constant, C: {C / 2!r}" for _ in range(2))
    law = f"viscous: {{eta: {{value: {eta!r}, times: [exponential: {{beta: {beta!r}}}]}}}}"
    rest = f"""heat: [conductance: {{between: [lower, surroundings], h: {h!r}}}]
surroundings: {{temperature: {T_a!r}}}
loading: {{v: {v!r}, g_n: {{ramp: {{start: {g!r}, rate: {-closes * g / end!r}}}}}}}
initial: {{T: {T_a!r}}}"""

    def rhs(t, y):
        gap = g * (1 - closes * t / end)
        return [(eta * math.exp(-beta * (y[0] - T_0)) * v**2 / gap - h * (y[0] - T_a)) / C]

    times = np.linspace(0, end, OUTPUTS)
    return HandModel(
        case(bodies, f"  temperature: T\n  friction: [{law}]", rest, end),
        times,
        lambda rtol: {"T": integrated(rhs, [T_a], times, rtol)[0]},
    )


FAMILIES = [
    *(linear_affinity, bell_ramp, sliding_with_loss, stick_slip, aging_contacts, pressed_contact),
    *(overdamped_pull_off, inertial_pull_off, quasi_static_opening, cure, thinning_film),
]
