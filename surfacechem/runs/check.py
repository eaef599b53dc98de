"""What can be told about a scene before it runs: its numbers without dimension, its time scales, what is unused."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from surfacechem.contracts.terms import Law, Varying
from surfacechem.model.automaton import INTERFACE
from surfacechem.model.system import System
from surfacechem.quantities import BOLTZMANN, GAS_CONSTANT
from surfacechem.results.extremes import cautioned
from surfacechem.runs.lumping import lumpings
from surfacechem.scene import Scene
from surfacechem.solve.contract import Problem
from surfacechem.solve.diagnose import paces
from surfacechem.solve.run import Model

Array = NDArray[np.float64]

ROUNDING = 1e-10
"""Rates slower than this part of the fastest are zero: a conserved quantity."""


@dataclass(frozen=True)
class Group:
    """A number that tells how a scene will behave."""

    name: str
    value: float
    unit: str
    text: str


@dataclass(frozen=True)
class Start:
    """The linearised equations M dy' + K dy = 0 at a consistent initial state."""

    y: Array
    ydot: Array
    M: Array
    K: Array
    outputs: Mapping[str, float]
    inputs: Array
    """Arguments of compiled functions."""


def consistent_start(model: Model, values: Mapping[str, float]) -> Start | None:
    """Rates and algebraic variables at the start by Newton's method; None where it finds none."""
    system = model.system
    n = len(system.states)
    algebraic = np.array([state.algebraic for state in system.states])
    parameters = [p.at(0.0) if p.load else values[p.path] for p in system.parameters]
    y, ydot = np.array([state.from_given(values) for state in system.states]), np.zeros(n)
    for _ in range(50):
        inputs = np.concatenate([[0.0], y, ydot, parameters])
        K, M = model.program.derivatives(inputs)
        change = _newton_step(np.where(algebraic, K, M), model.program.residual(inputs))
        if change is None:
            return None
        y, ydot = y + np.where(algebraic, change, 0.0), ydot + np.where(algebraic, 0.0, change)
        if np.all(np.abs(change) <= 1e-12 * np.maximum(np.abs(np.where(algebraic, y, ydot)), 1e-300)):
            break
    inputs = np.concatenate([[0.0], y, ydot, parameters])
    outputs = model.output_function(inputs)
    names = [item.name for item in system.outputs]
    return Start(y, ydot, M, K, dict(zip(names, outputs.tolist(), strict=True)), inputs)


def _newton_step(matrix: Array, residual: Array) -> Array | None:
    if not (np.all(np.isfinite(matrix)) and np.all(np.isfinite(residual))):
        return None
    try:
        return np.asarray(np.linalg.solve(matrix, -residual), dtype=np.float64)
    except np.linalg.LinAlgError:
        return None


def rates(start: Start) -> NDArray[np.complex128]:
    """Finite growth rates [1/s] of small disturbances at the start; conserved quantities are left out."""
    from scipy.linalg import eigvals

    rows = np.maximum(np.abs(start.M).max(axis=1), np.abs(start.K).max(axis=1))
    scale = np.where(rows > 0, rows, 1.0)[:, None]
    alpha, beta = eigvals(-start.K / scale, start.M / scale, homogeneous_eigvals=True)
    finite = np.abs(beta) > 1e-14 * np.abs(alpha)
    values = np.asarray(alpha[finite] / beta[finite], dtype=np.complex128)
    largest = np.max(np.abs(values), initial=0.0)
    return np.asarray(values[np.abs(values) > ROUNDING * largest])


def groups(model: Model, scene: Scene, values: Mapping[str, float], end: float) -> list[Group]:
    """The numbers of a scene, as far as its parameters and its initial state tell them."""
    found = [*_bond_energy(scene), *_activation(scene, values)]
    start = consistent_start(model, values)
    if start is None:
        return found
    return [
        *found,
        *_affinity(scene, start, model.system),
        *_heat(model.system, scene, start, end),
        *(Group(*row[:2], "1", row[2]) for body in lumpings(model.system, start.inputs, end) for row in body.rows()),
        *_time_scales(start, end),
        *(
            Group("t / t_own", end / t, "1", f"length of the run in units of the {p.text}")
            for p, t in paces(model.system, values)
        ),
    ]


def number(value: float | Varying) -> float:
    """A parameter at the reference state."""
    return value.value if isinstance(value, Varying) else float(value)


def _bond_energy(scene: Scene) -> Iterator[Group]:
    C, T_0 = capacity_with_interface(scene), scene.T_0
    laws = [law for law in scene.interface.potentials if law.name() == "bond-energy"]
    if not (C and T_0 and laws):
        return
    kappa = {
        name: sum(number(getattr(law, name)) * number(vars(law)["K"]) for law in laws) / (T_0 * C)
        for name in ("K_0", "K_2")
    }
    x = (scene.initial.get("phi", 0.0) - number(vars(laws[0])["phi_eq"])) ** 2
    if kappa["K_0"]:
        yield Group("kappa_0", kappa["K_0"], "1", "K_0 / (T_0 C): bond energy against heat content")
    if kappa["K_2"]:
        verdict = "valid" if kappa["K_2"] * x < 1 else "NOT valid"
        text = f"K_2 / (T_0 C); kappa_2 (phi_i - phi_eq)^2 = {kappa['K_2'] * x:.6g} must be below 1: {verdict}"
        yield Group("kappa_2", kappa["K_2"], "1", text)


def capacity_with_interface(scene: Scene) -> float:
    """Heat capacity at T_0 of all that shares the interface's temperature; of both bodies where there is no medium."""
    node = scene.interface.temperature
    bodies = [body for body in scene.bodies if node is None or body.temperature == node]
    capacities = [(body.energy, "C") for body in bodies] + [(law, "C_c") for law in scene.interface.potentials]
    return sum(number(getattr(law, name)) for law, name in capacities if hasattr(law, name))


def _activation(scene: Scene, values: Mapping[str, float]) -> Iterator[Group]:
    temperatures = [values[name] for name in ("initial.T_c", "initial.T", "initial.T_1") if name in values]
    for law in scene.interface.reactions:
        energy = number(getattr(law, "E_a", 0.0))
        if energy and temperatures:
            value = energy / (GAS_CONSTANT * temperatures[0])
            yield Group("E_a / (R_g T)", value, "1", f"activation of {law.title} at the start")


def _affinity(scene: Scene, start: Start, system: System) -> Iterator[Group]:
    temperatures = dict(start.outputs) | {s.name: y for s, y in zip(system.states, start.y.tolist(), strict=True)}
    node = scene.interface.temperature
    T = temperatures.get(node if isinstance(node, str) else "T_c")
    if T is None or not start.outputs.get("mu"):
        return
    yield Group("mu / (k_B T_c)", start.outputs["mu"] / (BOLTZMANN * T), "1", "affinity per bond at the start")


def _heat(system: System, scene: Scene, start: Start, end: float) -> Iterator[Group]:
    """Heat paths and dissipation against capacities, over the whole run."""
    capacities = {s.name: c for s, c in zip(system.states, np.diag(start.M), strict=True) if s.is_temperature}
    for profile in system.profiles:
        capacities[profile.surface] = sum(capacities.get(name, 0.0) for name in (profile.surface, *profile.states))
    nodes = {body.name: body.temperature for body in scene.bodies} | {"interface": scene.interface.temperature}
    for law in scene.heat:
        ends = [capacities.get(str(nodes.get(name)), 0.0) for name in law.between]
        smallest = min((c for c in ends if c > 0), default=None)
        if smallest and hasattr(law, "h"):
            text = f"heat exchange {law.between[0]} - {law.between[1]} over the run against the smaller capacity"
            yield Group("h t / C", number(law.h) * end / smallest, "1", text)
    heat = sum(value for name, value in start.outputs.items() if name.startswith("D_"))
    content = sum(c * y for c, y in zip(np.diag(start.M), start.y, strict=True) if c > 0 and y > 1)
    if heat and capacities and content > 0:
        text = "dissipation at the start, kept up over the run, against heat content"
        yield Group("D t / (C T)", heat * end / content, "1", text)


def _time_scales(start: Start, end: float) -> Iterator[Group]:
    values = rates(start)
    falling, rising = -values.real[values.real < 0], values.real[values.real > 0]
    if len(falling):
        yield Group("t_fast", 1 / falling.max(), "s", "fastest relaxation at the start")
        yield Group("t_slow", 1 / falling.min(), "s", "slowest relaxation at the start")
        yield Group("stiffness", end * falling.max(), "1", "length of the run against the fastest relaxation")
    if len(rising):
        yield Group("t_growth", 1 / rising.max(), "s", "a disturbance grows by e in this time at the start")


def warnings(system: System) -> list[str]:
    """What is given but has no effect, beside what the assembly found."""
    formulas = [*_audited(system), *_heated(system)]
    read = {symbol for row in [*system.residual(), *map(system.expand, formulas)] for symbol in row.free_symbols}
    idle = [
        p for p in system.parameters if p.symbol not in read and not p.internal and not p.path.startswith("initial.")
    ]
    return [*system.warnings, *(f"{p.path} = {p.at(0.0):g} has no effect on the equations." for p in idle)]


def cautions(model: Model, problem: Problem) -> list[str]:
    """What the start gives reason to be cautious of."""
    start = [np.zeros(1), problem.y0, np.zeros(len(problem.y0)), problem.parameters[0]]
    return cautioned(model.system, np.concatenate(start)[None])


def lumping_warnings(model: Model, values: Mapping[str, float], end: float) -> list[str]:
    """Bodies that should not be one lump, and by how much they err."""
    start = consistent_start(model, values) if model.system.conductors else None
    found = lumpings(model.system, start.inputs, end) if start is not None else []
    return [warning for body in found for warning in body.warnings()]


def _audited(system: System) -> list[object]:
    return (
        [a.rate for a in system.ledger]
        + [m.masked for m in system.margins]
        + [i.expression for i in system.outputs]
        + [c.resistance for c in system.conductors]
        + [x for item in system.edges for x in (item.masked, *item.modes.values(), *item.reset.values())]
    )


def _heated(system: System) -> list[object]:
    """Parts of the heat of jumps; what slides or snaps makes all of it in the interface, none in supports."""
    jumps = [item for item in system.edges if (item.equilibrates or item.reset) and not item.measure]
    supported = any(item.heat == "joint" for item in jumps)
    makers = [sinks for maker, sinks in system.sinks.items() if jumps and (supported or maker == INTERFACE)]
    return [sink.share for sinks in makers for sink in sinks]


def laws_of(scene: Scene) -> list[Law]:
    """Every law of a scene, in the order of the case file."""
    interface = scene.interface
    bodies = [body.energy for body in scene.bodies if body.energy is not None]
    return [*bodies, *interface.potentials, *interface.reactions, *interface.frictions, *scene.heat]


def significant(value: float) -> str:
    """Four digits are enough to judge a group by."""
    return f"{value:.4g}" if math.isfinite(value) else str(value)
