"""Two problems with events for the benchmark, solved by ours and by the libraries called directly.

P2 is a Bell cluster under a growing force that ruptures in finite time, between two bodies and a light interface. P3
is a stick-slip slider whose bonds re-form in stick: 24 events, at each of which the mode changes and bonds break. Ours
carries them out itself; the libraries are restarted by hand.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import symengine as se
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from sksundae.cvode import CVODE
from solver_problems import problem, solved_as_arrays

from surfacechem.compile.program import Program, compile_function, compile_program
from surfacechem.expressions import magnitude
from surfacechem.solve import solver
from surfacechem.solve.contract import EdgeTables, Guard, Problem, Status
from surfacechem.solve.lanes.lane_batch import solve_batch
from surfacechem.solve.radau.stepper import END

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
    """The cluster until it is broken."""
    return problem(rupture(), RUPTURE_START, [0.0, 100.0], rtol, parameters=RUPTURE, margins=(Guard.stop(),))


SLIDER = {"drive": 0.1, "mass": 1.0, "kinetic": 0.5, "bonded": 0.5, "ageing": 2.0}
"""Stick-slip: driving velocity, mass, kinetic friction, strength of all bonds, time in which they form; stiffness 1."""


@cache
def slider() -> tuple[Program, EdgeTables]:
    """Stretch w of the spring, velocity v and bonds phi; bonds form in stick (mode 0), and are broken in slip (1).

    Stick ends where no friction is left, slip where no velocity is.
    """
    t, w, v, phi, mode, start = se.symbols("t w v phi mode start")
    dw, dv, dphi = se.symbols("dw dv dphi")
    p = SLIDER
    rows = [
        dw - (p["drive"] - mode * v),
        p["mass"] * dv - mode * (w - p["kinetic"]),
        dphi - (1 - mode) * (1 - phi) / p["ageing"],
    ]
    guards = [p["kinetic"] + p["bonded"] * phi - w, v]
    peaks = {state: se.Symbol(f"peak of {state}") for state in (w, v, phi)}
    inputs = [t, w, v, phi, dw, dv, dphi, mode, start]
    asked = (
        compile_function([*inputs, *peaks.values()], [magnitude(guard, peaks) for guard in guards]),
        compile_function(inputs, [p["bonded"] * dphi - dw, dv]),
        compile_function(inputs, [se.Integer(0)] * 4),
        None,
        None,
        *(compile_function(inputs, [w, se.Integer(0), se.Integer(0), se.Integer(after)]) for after in (1, 0)),
    )
    edges = EdgeTables(
        sizes=np.array([4, 0, 4]),
        code=np.array([(f.address, f.user) if f else (0, 0) for f in asked]),
        edges=np.array([(-1, 0, 0, -1, 0)] * 2),
        when=np.array([(0, 0, 0), (1, 0, 1)]),
        held=np.array([0]),
        clocks=np.array([1]),
        nodes=np.zeros(0, np.int64),
        accounts=np.zeros((0, 2), np.int64),
        least_peaks=np.zeros(3),
    )
    return compile_program(t, [w, v, phi], [dw, dv, dphi], [mode, start], rows, margins=guards), edges


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


EVENTS = 24
FAR = 1000.0
Rates = Callable[[float, np.ndarray], list[float]]
ToEvent = Callable[[Rates, Callable, np.ndarray, float], tuple[float, np.ndarray]]


def lsoda_to_event(rtol: float, atol: float) -> ToEvent:
    """SciPy as a user calls it, to the first event."""

    def run(rates: Rates, margin: Callable, y: np.ndarray, t: float) -> tuple[float, np.ndarray]:
        def event(t: float, y: np.ndarray) -> float:
            return margin(t, y)

        event.terminal, event.direction = True, -1  # type: ignore[attr-defined]
        answer = solve_ivp(rates, (t, t + FAR), y, method="LSODA", rtol=rtol, atol=atol, events=event)
        return answer.t[-1], answer.y[:, -1]

    return run


def cvode_to_event(rtol: float, atol: float) -> ToEvent:
    """scikit-sundae as a user calls it, to the first event."""

    def run(rates: Rates, margin: Callable, y: np.ndarray, t: float) -> tuple[float, np.ndarray]:
        def fill(t: float, y: np.ndarray, out: np.ndarray) -> None:
            out[:] = rates(t, y)

        def event(t: float, y: np.ndarray, out: np.ndarray) -> None:
            out[0] = margin(t, y)

        event.terminal, event.direction = [True], [-1]  # type: ignore[attr-defined]
        library = CVODE(fill, rtol=rtol, atol=atol, max_num_steps=100_000, eventsfn=event, num_events=1)
        answer = library.solve(np.array([t, t + FAR]), y)
        return answer.t[-1], answer.y[-1]

    return run


DIRECT = {"scipy-LSODA": lsoda_to_event, "scikit-sundae-CVODE": cvode_to_event}


def rupture_ours(name: str, rtol: float) -> Callable[[], np.ndarray]:
    """Time of rupture and temperatures then."""
    method, case = solver(name), rupture_problem(rtol)

    def run() -> np.ndarray:
        result = method.solve(case)
        return np.append(result.t, result.y[1:]) if len(result.events.t) else np.full(4, np.nan)

    return run


def rupture_direct(to_event: ToEvent) -> Callable[[], np.ndarray]:
    """The same with a Python right-hand side."""
    parameters = RUPTURE.tolist()

    def rates(t: float, y: np.ndarray) -> list[float]:
        return rupture_rates(t, y.tolist(), parameters, math.exp)

    def run() -> np.ndarray:
        try:
            t, y = to_event(rates, lambda _t, y: y[0] - BROKEN, np.array(RUPTURE_START), 0.0)
        except (ArithmeticError, RuntimeError, ValueError):
            return np.full(4, np.nan)
        return np.append(t, y[1:])

    return run


def rupture_error() -> Callable[[np.ndarray], float]:
    """Largest relative error, against our own run at 1e-13."""
    reference = rupture_ours("radau", 1e-13)()
    return lambda answer: float(np.max(np.abs(answer / reference - 1)))


def slide_ours(name: str, rtol: float) -> Callable[[], np.ndarray]:
    """Times of the events."""
    method, (program, edges) = solver(name), slider()
    end, margins = float(slider_events(EVENTS + 1)[-2:].mean()), (Guard.stop(), Guard.stop())
    options = {"margins": margins, "edges": edges, "explicit": name == "dop853"}
    case = problem(program, np.zeros(3), [0.0, end], rtol, parameters=[0.0, 0.0], **options)

    def run() -> np.ndarray:
        found = method.solve(case).events.t
        return found if len(found) == EVENTS else np.full(EVENTS, np.nan)

    return run


def slide_direct(to_event: ToEvent) -> Callable[[], np.ndarray]:
    """The same with a Python right-hand side a mode."""
    drive, mass, kinetic, bonded, ageing = SLIDER.values()

    def stick(_t: float, y: np.ndarray) -> list[float]:
        return [drive, 0.0, (1 - y[2]) / ageing]

    def slip(_t: float, y: np.ndarray) -> list[float]:
        return [drive - y[1], (y[0] - kinetic) / mass, 0.0]

    modes = (stick, lambda _t, y: kinetic + bonded * y[2] - y[0]), (slip, lambda _t, y: y[1])

    def run() -> np.ndarray:
        y, t, times = np.zeros(3), 0.0, []
        for event in range(EVENTS):
            t, y = to_event(*modes[event % 2], y * [1.0, 0.0, 0.0], t)
            times.append(t)
        return np.array(times)

    return run


def slide_error() -> Callable[[np.ndarray], float]:
    """Largest relative error of the event times, which are known exactly."""
    exact = slider_events(EVENTS)
    return lambda times: float(np.max(np.abs(times / exact - 1)))


def rupture_batch(rtol: float, runs: int, threads: int) -> np.ndarray:
    """Times of rupture of randomised clusters, NaN where none was found."""
    parameters = RUPTURE * np.random.default_rng(0).uniform(0.85, 1.15, (runs, 1, 4))
    y0 = np.tile(RUPTURE_START, (runs, 1))
    shared = replace(rupture_problem(rtol), implicit_lanes=True)
    ends, counts, _ = solved_as_arrays(shared, y0, parameters, threads, solve_batch)
    return np.where(counts[:, END] == Status.EVENT, ends[:, 0], np.nan)
