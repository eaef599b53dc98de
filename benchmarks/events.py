"""Two problems with events for the benchmark, solved by ours and by the libraries called directly.

P2 is a Bell cluster under a growing force that ruptures in finite time, between two bodies and a light interface. P3
is a stick-slip slider whose bonds re-form in stick: 24 events, after each of which the run is restarted by hand, with
the mode changed and the bonds broken.
"""

import math
from collections.abc import Callable

import numpy as np
from scipy.integrate import solve_ivp
from sksundae.cvode import CVODE
from solver_problems import (
    BROKEN,
    RUPTURE,
    RUPTURE_START,
    SLIDER,
    problem,
    rupture,
    rupture_problem,
    rupture_rates,
    slider,
    slider_events,
)

from surfacechem.solve import solver
from surfacechem.solve.contract import Margin
from surfacechem.solve.radau.solver import solve_many

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
    """Times of the events, one run to each."""
    method, program, stop = solver(name), slider(), (Margin.stop(),)

    def run() -> np.ndarray:
        y, mode, t, times = np.zeros(3), 0.0, 0.0, []
        for _event in range(EVENTS):
            result = method.solve(problem(program, y, [t, t + FAR], rtol, parameters=[mode], margins=stop))
            t, y, mode = result.t, result.y * [1.0, 0.0, 0.0], 1.0 - mode
            times.append(t)
        return np.array(times)

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
    atol = 0.01 * rtol
    stop = [Margin.stop()]
    batch = solve_many(rupture(), y0, parameters, [0.0, 100.0], rtol, atol, margins=stop, threads=threads)
    return np.where(batch.status == 1, batch.t, np.nan)
