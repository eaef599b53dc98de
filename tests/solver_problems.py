"""Small systems with known solutions, shared by the solver tests."""

from functools import cache

import numpy as np
import symengine as se
from scipy.optimize import brentq

from surfacechem.compile.program import Program, compile_program
from surfacechem.solve.contract import Margin, Problem

CONDUCTANCE = (1e3, 1e12, 1e20)
PARAMETERS = np.array([2.0, 300.0, 300.0, 1.0, 0.5])


def problem(
    program: Program,
    y0,
    segments,
    rtol,
    *,
    atol=None,
    times=(),
    parameters=(),
    margins: tuple[Margin, ...] = (),
    **options,
):
    """A problem of one parameter set, with weights that do not matter by default."""
    weights = np.full(program.n, rtol * 1e-2 if atol is None else atol)
    return Problem(
        program,
        np.array(y0, dtype=float),
        np.asarray(times, dtype=float),
        np.array(segments),
        np.atleast_2d(np.array(parameters, dtype=float)).reshape(1, program.n_parameters),
        rtol,
        weights,
        margins,
        **options,
    )


@cache
def exothermic() -> Program:
    """Exothermic bonding: total energy and the number of bonds."""
    t, temperature, phi, rate, growth = se.symbols("t T phi dT dphi")
    c, k, t0, n, tau = se.symbols("C K0 T0 n tau")
    rows = [c * temperature / t0 * rate - k * (1 - phi) * growth, n * growth - n / tau * (1 - phi)]
    return compile_program(t, [temperature, phi], [rate, growth], [c, k, t0, n, tau], rows)


def exothermic_exact(t, parameters=PARAMETERS):
    c, k, t0, _, tau = parameters
    temperature = t0 * np.sqrt(1 - k / (t0 * c) * np.expm1(-2 * np.asarray(t) / tau))
    return np.stack([temperature, -np.expm1(-np.asarray(t) / tau)], axis=-1)


def exothermic_problem(rtol: float, outputs: int = 200) -> Problem:
    times = np.linspace(0.0, 2.5, outputs + 1)[1:]
    return Problem(
        exothermic(),
        np.array([300.0, 0.0]),
        times,
        np.array([0.0, 2.5]),
        PARAMETERS[None],
        rtol,
        np.array([3.0, 0.01]) * rtol,
    )


def _robertson_rows():
    t, a, b, c, da, db, dc = se.symbols("t a b c da db dc")
    slow, fast, last = 0.04 * a, 1e4 * b * c, 3e7 * b**2
    return t, [a, b, c], [da, db, dc], [da + slow - fast, db - slow + fast + last], dc - last


@cache
def robertson() -> Program:
    t, y, ydot, rows, last = _robertson_rows()
    return compile_program(t, y, ydot, [], [*rows, last])


@cache
def robertson_sums() -> Program:
    """The second row is the sum of the rates: no cancelling rates are integrated, so every digit can be had."""
    t, y, ydot, rows, last = _robertson_rows()
    return compile_program(t, y, ydot, [], [rows[0], sum(ydot), last])


@cache
def robertson_dae() -> Program:
    t, y, ydot, rows, _ = _robertson_rows()
    return compile_program(t, y, ydot, [], [*rows, sum(y) - 1])


def coupled_nodes(conductance: float) -> Program:
    """A light and a heavy node behind a conductance; the second row is the balance of both."""
    t, a, b, da, db = se.symbols("t a b da db")
    return compile_program(t, [a, b], [da, db], [], [1e-15 * da + conductance * (a - b), 1e-15 * da + 2.0 * db - 3.0])


@cache
def linear_decay() -> Program:
    t, y, dy = se.symbols("t y dy")
    return compile_program(t, [y], [dy], [], [dy + y], margins=[y - 0.5])


RUPTURE = np.array([0.2, 1.0, 4000.0, 1e-9])
"""Force ramp per second in units of kT/x, rebinding rate, activation temperature, capacity of the interface."""
RUPTURE_START = [0.9, 300.0, 300.0, 300.0]
BROKEN = 0.05
"""Coverage at which the cluster counts as broken."""


def rupture_rates(t, y, parameters, exp):
    """Bell bonds under a shared, growing force, with rebinding, Arrhenius rates and the heat of bonds: rates of
    coverage, both bodies and the light interface between them.
    """
    phi, below, above, between = y
    ramp, rebinding, activation, capacity = parameters
    warm = exp(activation * (1 / 300.0 - 1 / between))
    bonding = warm * (rebinding * (1 - phi) - phi * exp(ramp * t / phi * 300.0 / between))
    to_below, to_above = between - below, between - above
    return [bonding, to_below, to_above, (20.0 * bonding - to_below - to_above) / capacity]


@cache
def rupture() -> Program:
    """The interface's row is the balance of all energy: conductance 1, capacities 1, 1 and 1e-9."""
    t, *y = se.symbols("t phi T_1 T_2 T_c")
    ydot = list(se.symbols("dphi dT_1 dT_2 dT_c"))
    parameters = list(se.symbols("ramp rebinding activation C_c"))
    bonding, below, above, _ = rupture_rates(t, y, parameters, se.exp)
    rows = [ydot[0] - bonding, ydot[1] - below, ydot[2] - above]
    rows.append(parameters[3] * ydot[3] + ydot[1] + ydot[2] - 20.0 * ydot[0])
    return compile_program(t, y, ydot, parameters, rows, margins=[y[0] - BROKEN])


def rupture_problem(rtol: float) -> Problem:
    return problem(rupture(), RUPTURE_START, [0.0, 100.0], rtol, parameters=RUPTURE, margins=(Margin.stop(),))


SLIDER = {"drive": 0.1, "mass": 1.0, "kinetic": 0.5, "bonded": 0.5, "ageing": 2.0}
"""Stick-slip: driving velocity, mass, kinetic friction, strength of all bonds, time in which they form; stiffness 1."""


@cache
def slider() -> Program:
    """Stretch w of the spring, velocity v and bonds phi; bonds form in stick (mode 0), and are broken in slip (1).

    The margin is the friction left in stick, the velocity in slip.
    """
    t, w, v, phi, mode = se.symbols("t w v phi mode")
    dw, dv, dphi = se.symbols("dw dv dphi")
    p = SLIDER
    rows = [
        dw - (p["drive"] - mode * v),
        p["mass"] * dv - mode * (w - p["kinetic"]),
        dphi - (1 - mode) * (1 - phi) / p["ageing"],
    ]
    friction_left = p["kinetic"] + p["bonded"] * phi - w
    return compile_program(
        t, [w, v, phi], [dw, dv, dphi], [mode], rows, margins=[(1 - mode) * friction_left + mode * v]
    )


def slider_events(count: int) -> np.ndarray:
    """Exact times at which slip begins and ends, from stick without stretch or bonds."""
    p = SLIDER
    omega = p["mass"] ** -0.5
    t, w, times = 0.0, 0.0, []
    while len(times) < count:

        def friction_left(s, w=w):
            return p["kinetic"] - p["bonded"] * np.expm1(-s / p["ageing"]) - w - p["drive"] * s

        s = brentq(friction_left, 0.0, 20.0, xtol=1e-15)
        excess = p["bonded"] * -np.expm1(-s / p["ageing"])
        # v = V (1 - cos a) + excess omega sin a vanishes again at a = 2 pi - 2 atan(excess omega / V), where the
        # excess has changed its sign.
        slip = (2 * np.pi - 2 * np.arctan(excess * omega / p["drive"])) / omega
        times += [t + s, t + s + slip]
        t, w = times[-1], p["kinetic"] - excess
    return np.array(times[:count])
