"""Other libraries on the problems of the benchmark, as one who knows each of them would call it.

All are given the same equations, written once in symbols: compiled right-hand sides and exact Jacobians where a library
takes them. A library that is not installed is left out, and said to be: ``pip install heyoka numbalsoda diffrax
libroadrunner`` (numbalsoda is built with cmake and gfortran).
"""

import importlib
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import symengine as se
from events import BROKEN, EVENTS, FAR, RUPTURE, RUPTURE_START, SLIDER, rupture_rates
from solver_problems import PARAMETERS

Run = Callable[[], np.ndarray]
T = se.Symbol("t")


@dataclass(frozen=True)
class Equations:
    """Rates of states y_0, y_1, ..., and what ends a run as it falls to zero."""

    rates: Sequence[Any]
    margin: Any = None

    @property
    def y(self) -> list[Any]:
        """The states."""
        return states(len(self.rates))


def states(count: int) -> list[Any]:
    """Symbols of states."""
    return [se.Symbol(f"y_{k}") for k in range(count)]


@cache
def equations() -> dict[str, Equations]:
    """Equations of each problem; of the slider in stick and in slip."""
    c, k, t0, _, tau = PARAMETERS.tolist()
    T_1, phi = states(2)
    growth = (1 - phi) / tau
    a, b, d = states(3)
    slow, fast, last = 0.04 * a, 1e4 * b * d, 3e7 * b * b
    four, (w, v, bonds), p = states(4), states(3), SLIDER
    return {
        "P1": Equations([k * (1 - phi) * growth * t0 / (c * T_1), growth]),
        "P2": Equations(rupture_rates(T, four, RUPTURE.tolist(), se.exp), four[0] - BROKEN),
        "stick": Equations(
            [se.Float(p["drive"]), se.Float(0.0), (1 - bonds) / p["ageing"]], p["kinetic"] + p["bonded"] * bonds - w
        ),
        "slip": Equations([p["drive"] - v, (w - p["kinetic"]) / p["mass"], se.Float(0.0)], v),
        "P4": Equations([fast - slow, slow - fast - last, last]),
    }


START = {"P1": [300.0, 0.0], "P2": RUPTURE_START, "P3": [0.0, 0.0, 0.0], "P4": [1.0, 0.0, 0.0]}
END = {"P1": 2.5, "P2": 100.0, "P4": 1e11}
TIMES = np.linspace(0.0, 2.5, 201)
"""Outputs of P1."""
RELATIVE = {"P1": 0.01, "P2": 0.01, "P3": 0.01, "P4": 1e-10}
"""Absolute tolerances over the relative ones."""


def evaluated(expression: Any, names: dict[str, Any]) -> Any:
    """An expression in the symbols of another library."""
    return eval(str(expression), {"__builtins__": {}}, names)


@cache
def jitted(name: str) -> tuple[Any, Any, Any]:
    """Rates, Jacobian and margin of equations as Numba compiles them, each written into its last argument."""
    import numba

    of = equations()[name]
    slopes = [[rate.diff(y) for y in of.y] for rate in of.rates]
    take = "; ".join(f"y_{k} = y[{k}]" for k in range(len(of.rates)))
    rows = "; ".join(f"out[{i}] = {rate}" for i, rate in enumerate(of.rates))
    entries = "; ".join(f"J[{i}, {j}] = {x}" for i, row in enumerate(slopes) for j, x in enumerate(row))
    code = f"""
def rates(t, y, out):
    {take}; {rows}

def jacobian(t, y, yp, J):
    {take}; {entries}

def margin(t, y, out):
    {take}; out[0] = {of.margin if of.margin is not None else 1.0}
"""
    space: dict[str, Any] = {"exp": math.exp}
    exec(code, space)
    rates, jacobian, margin = (numba.njit(space[name]) for name in ("rates", "jacobian", "margin"))
    return rates, jacobian, margin


def sundae(name: str, rtol: float, atol: float) -> Any:
    """CVODE with compiled right-hand side and Jacobian, to its event if it has one."""
    from sksundae.cvode import CVODE

    rates, jacobian, margin = jitted(name)
    options: dict[str, Any] = {}
    if equations()[name].margin is not None:

        def event(t: float, y: np.ndarray, out: np.ndarray) -> None:
            margin(t, y, out)

        event.terminal, event.direction = [True], [-1]  # type: ignore[attr-defined]
        options = {"eventsfn": event, "num_events": 1}
    return CVODE(rates, jacfn=jacobian, rtol=rtol, atol=atol, max_num_steps=100_000, **options)


def cvode(case: str, rtol: float) -> Run:
    """scikit-sundae."""
    atol = RELATIVE[case] * rtol
    if case == "P3":
        modes = [sundae(name, rtol, atol) for name in ("stick", "slip")]

        def to_event(event: int, y: np.ndarray, t: float) -> tuple[float, np.ndarray]:
            answer = modes[event % 2].solve(np.array([t, t + FAR]), y)
            return answer.t[-1], answer.y[-1]

        return slides(to_event)
    library, y0 = sundae(case, rtol, atol), np.array(START[case])
    span = TIMES if case == "P1" else np.array([0.0, END[case]])

    def run() -> np.ndarray:
        answer = library.solve(span, y0)
        if case == "P2":
            return np.append(answer.t[-1], answer.y[-1, 1:])
        return np.asarray(answer.y[1:] if case == "P1" else answer.y[-1])

    return run


def slides(to_event: Callable[[int, np.ndarray, float], tuple[float, np.ndarray]]) -> Run:
    """Times of the events of the slider: bonds are broken, and velocity lost, as the mode changes."""

    def run() -> np.ndarray:
        y, t, times = np.zeros(3), 0.0, []
        for event in range(EVENTS):
            t, y = to_event(event, y * [1.0, 0.0, 0.0], t)
            times.append(t)
        return np.array(times)

    return run


def _taylor(name: str, rtol: float) -> Any:
    import heyoka

    of, names = equations()[name], {"exp": heyoka.exp, "t": heyoka.time}
    y = heyoka.make_vars(*map(str, of.y))
    names |= dict(zip(map(str, of.y), y, strict=True))
    zero = 0.0 * y[0]
    system = [(symbol, zero + evaluated(rate, names)) for symbol, rate in zip(y, of.rates, strict=True)]
    ends = []
    if of.margin is not None:
        falling = heyoka.event_direction.negative
        ends = [heyoka.t_event(zero + evaluated(of.margin, names), direction=falling)]
    return heyoka.taylor_adaptive(system, np.zeros(len(y)), tol=rtol, t_events=ends)


def heyoka(case: str, rtol: float) -> Run:
    """Taylor's method, compiled for the equations."""
    if case == "P3":
        modes = [_taylor(name, rtol) for name in ("stick", "slip")]

        def to_event(event: int, y: np.ndarray, t: float) -> tuple[float, np.ndarray]:
            integrator = modes[event % 2]
            integrator.time, integrator.state[:] = t, y
            integrator.reset_cooldowns()
            integrator.propagate_until(t + FAR)
            return integrator.time, integrator.state.copy()

        return slides(to_event)
    integrator = _taylor(case, rtol)

    def run() -> np.ndarray:
        integrator.time, integrator.state[:] = 0.0, START[case]
        return np.asarray(integrator.propagate_grid(TIMES)[-1][1:])

    return run


def numbalsoda(method: str) -> Callable[[str, float], Run]:
    """LSODA or Dormand and Prince's method of order 8 by numbalsoda."""

    def of_case(case: str, rtol: float) -> Run:
        import numba
        from numbalsoda import dop853, lsoda, lsoda_sig

        rates, count = jitted(case)[0], len(START[case])

        @numba.cfunc(lsoda_sig)
        def compiled(t: float, u: Any, du: Any, _p: Any) -> None:
            rates(t, numba.carray(u, count), numba.carray(du, count))

        span = TIMES if case == "P1" else np.array([0.0, END[case]])
        address, y0, atol = compiled.address, np.array(START[case]), RELATIVE[case] * rtol
        solve = {"lsoda": lsoda, "dop853": dop853}[method]
        kept = compiled  # its code lives as long as it does

        def run() -> np.ndarray:
            found, success = solve(address, y0, span, rtol=rtol, atol=atol)
            if not success or not kept:
                return np.full((len(span) - 1, count), np.nan)
            return np.asarray(found[1:] if case == "P1" else found[-1])

        return run

    return of_case


def roadrunner(case: str, rtol: float) -> Run:
    """libroadrunner: CVODE with rates that it compiles."""
    from roadrunner import RoadRunner

    model, of = RoadRunner(), equations()[case]
    for symbol, rate, start in zip(of.y, of.rates, START[case], strict=True):
        model.addParameter(str(symbol), start, False)
        model.addRateRule(str(symbol), str(rate).replace("**", "^"), False)
    model.regenerateModel()
    model.timeCourseSelections = [*map(str, of.y)]
    model.integrator.relative_tolerance = rtol
    model.integrator.absolute_tolerance = RELATIVE[case] * rtol
    model.integrator.maximum_num_steps = 100_000

    def run() -> np.ndarray:
        model.resetAll()
        for symbol, start in zip(of.y, START[case], strict=True):
            model[str(symbol)] = start
        found = np.array(model.simulate(0, END[case], len(TIMES) if case == "P1" else 2))
        return found[1:] if case == "P1" else found[-1]

    return run


def diffrax(case: str, rtol: float) -> Run:
    """diffrax, compiled for the equations: an explicit method on P1, an implicit one on P4."""
    import jax

    jax.config.update("jax_enable_x64", True)
    import diffrax as library
    import jax.numpy as jnp

    of = equations()[case]

    def rates(t: Any, y: Any, _: Any) -> Any:
        names = {"exp": jnp.exp, "t": t} | {str(symbol): y[k] for k, symbol in enumerate(of.y)}
        return jnp.stack([evaluated(rate, names) for rate in of.rates])

    method = library.Dopri8() if case == "P1" else library.Kvaerno5()
    sizes = library.PIDController(rtol=rtol, atol=RELATIVE[case] * rtol)
    kept = library.SaveAt(ts=jnp.array(TIMES[1:])) if case == "P1" else library.SaveAt(t1=True)

    @jax.jit
    def solve(y0: Any) -> Any:
        term = library.ODETerm(rates)
        return library.diffeqsolve(
            term,
            method,
            0.0,
            END[case],
            None,
            y0,
            saveat=kept,
            stepsize_controller=sizes,
            max_steps=100_000,
            throw=False,
        ).ys

    start = jnp.array(START[case])
    return lambda: np.asarray(solve(start) if case == "P1" else solve(start)[-1])


PEERS: dict[str, tuple[str, Callable[[str, float], Run], Sequence[str]]] = {
    "scikit-sundae, compiled": ("sksundae", cvode, ("P1", "P2", "P3", "P4")),
    "heyoka": ("heyoka", heyoka, ("P1", "P3")),
    "numbalsoda dop853": ("numbalsoda", numbalsoda("dop853"), ("P1",)),
    "numbalsoda LSODA": ("numbalsoda", numbalsoda("lsoda"), ("P1", "P4")),
    "libroadrunner": ("roadrunner", roadrunner, ("P1", "P4")),
    "diffrax": ("diffrax", diffrax, ("P1", "P4")),
}
"""Package, what makes a run for a relative tolerance, and the problems that it is for: explicit methods are for what is
not stiff, and those without events for what has none."""


def installed() -> dict[str, tuple[Callable[[str, float], Run], Sequence[str]]]:
    """The libraries that are here; of others it is said that they are not."""
    found = {}
    for name, (package, make, cases) in PEERS.items():
        try:
            importlib.import_module(package)
        except ImportError:
            print(f"{name} is not installed")
            continue
        found[name] = make, cases
    return found
