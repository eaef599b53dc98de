"""From a scene to its exact solution: parameters read off the scene, and a check that it solves the scene's equations.

An exact solution that is named for a scene it does not belong to is refused: it must start where the scene starts and
satisfy the assembled equations.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from surfacechem import references
from surfacechem.errors import InputError
from surfacechem.integrate import Trajectory
from surfacechem.references.base import Reference
from surfacechem.scene import Scene

Array = NDArray[np.float64]

MISMATCH = 1e-4
"""Largest part of an equation by which a solution may miss it; differences in time are good to 1e-6 or better."""

PROBES = 7
"""Times at which the equations are tested."""


def exact_values(name: str, options: Mapping[str, float], scene: Scene, run: Trajectory) -> dict[str, Array]:
    """Exact values at the output times by the names of the scene's variables; InputError if it is another scene's."""
    reference = match(references.get(name), options, Start(run, scene))
    exact = renamed(reference.solution(run.result.times), run)
    _check_start(exact, run)
    _check(reference, run)
    return exact


def match(kind: type[Reference], options: Mapping[str, float], start: Start) -> Reference:
    """The reference with the parameters of the scene; ``options`` go first."""
    values = dict(options)
    for item in dataclasses.fields(kind):  # type: ignore[arg-type]
        if item.name not in values:
            found = start.find(item.name)
            if found is not None:
                values[item.name] = found
            elif item.default is dataclasses.MISSING:
                text = item.metadata["spec"].text
                raise InputError(f"it needs {item.name} ({text}), which the scene has not.")
    return kind(**values)


class Start:
    """What a scene says of itself at the start, by the names that exact solutions use."""

    def __init__(self, run: Trajectory, scene: Scene) -> None:
        self.run, self.scene = run, scene
        system = run.model.system
        self.parameters = {str(p.symbol): run.values[p.path] for p in system.parameters}
        self.initial = {state.name: run.values[f"initial.{state.name}"] for state in system.states}

    @cached_property
    def named(self) -> dict[str, float]:
        """Named quantities."""
        names = (item.name for item in self.run.model.system.outputs)
        return dict(zip(names, self.run.outputs[0], strict=True))

    @cached_property
    def rates(self) -> dict[str, float]:
        """Rates of the states."""
        states = self.run.model.system.states
        return {state.name: float(rate) for state, rate in zip(states, self.run.rates[0], strict=True)}

    def find(self, name: str) -> float | None:
        """The value of a parameter of an exact solution, or None."""
        try:
            return float(RULES[name](self)) if name in RULES else self._plain(name)
        except KeyError:
            return None

    def _plain(self, name: str) -> float:
        for source in (self.parameters, self.initial):
            if name in source:
                return float(source[name])
        return float(self.named[name] if name in self.named else self.initial[name.removesuffix("_i")])

    def temperature(self) -> float:
        """The one temperature of the scene."""
        names = [state for state in self.initial if state not in ("phi",) and not state.startswith("theta_")]
        return self.initial[names[0]] if names else self.named["T_c"]

    def capacity(self) -> float:
        """Sum of all capacities at T_0."""
        return sum(value for name, value in self.parameters.items() if name in ("C_1", "C_2", "C_c"))

    def friction(self, temperature: float | None = None) -> float:
        """Power of all friction, at the start or with every temperature set to one value."""
        system = self.run.model.system
        names = [account.quantity.name for account in system.ledger]
        laws = [name[2:] for name in names if name.startswith("W_") and f"heat_{name[2:]}" in names]
        values = self.named if temperature is None else self._at(temperature)
        return float(sum(values[f"D_{law}"] for law in laws))

    def _at(self, temperature: float) -> dict[str, float]:
        model, result = self.run.model, self.run.result
        y = np.array([[v if name == "phi" else temperature for name, v in self.initial.items()]])
        values = model.evaluate(result, result.times[:1], y, np.zeros_like(y))[0]
        return dict(zip((item.name for item in model.system.outputs), values, strict=True))

    def supplied(self) -> float:
        """External heat into all members."""
        return float(sum(self.named.get(name, 0.0) for name in ("Q_1", "Q_2", "Q_c")))

    def conductance(self, chosen: Callable[[tuple[str, str]], bool]) -> float:
        """Sum of the conductances of the chosen heat paths."""
        laws = [law for law in self.scene.heat if chosen(law.between)]
        if not laws:
            raise KeyError("no such heat path")
        return sum(self.run.values[f"{law.path}.h"] for law in laws)

    def into(self, k: int) -> float:
        """Sum of the conductances between the interface and body k."""
        return self.conductance(lambda ends: set(ends) == {"interface", self.scene.bodies[k - 1].name})


RULES: dict[str, Callable[[Start], float]] = {
    "C": lambda s: s.capacity(),
    "n_c": lambda s: s.parameters["N_c"],
    "n_1": lambda s: s.parameters.get("N_1", s.parameters["N_c"]),
    "n_2": lambda s: s.parameters.get("N_2", s.parameters["N_c"]),
    "K_c": lambda s: s.parameters["K_0"],
    "T": lambda s: s.temperature(),
    "T_i": lambda s: s.temperature(),
    "tau": lambda s: (s.parameters.get("phi_eq", 1.0) - s.initial["phi"]) / s.rates["phi"],
    "k_i": lambda s: s.rates["phi"] / (1 - s.initial["phi"]),
    "D": lambda s: s.friction(),
    "D_0": lambda s: s.friction(s.parameters["T_0"]) + s.supplied(),
    "Q": lambda s: -s.supplied(),
    "delta_T": lambda s: s.parameters["H_r"] / s.capacity() if s.capacity() else 0.0,
    "h": lambda s: s.conductance(lambda ends: True),
    "H": lambda s: s.conductance(lambda ends: True),
    "h_1": lambda s: s.into(1),
    "h_2": lambda s: s.into(2),
    "T_a": lambda s: s.named["T_a"] if "T_a" in s.named else s.named["T_2"] if "T_2" in s.named else s.named["T_1"],
}
"""Parameters of exact solutions that are not parameters of the scene under the same name."""


def renamed(exact: Mapping[str, Array], run: Trajectory) -> dict[str, Array]:
    """Exact values under the names of the scene; those it does not have are left out."""
    system = run.model.system
    known = [state.name for state in system.states] + [item.name for item in system.outputs]
    stands_for = {
        "T": [state.name for state in system.states if state.quantity.unit == "K"],
        "R_c": [name for name in known if name.startswith("R_")],
        "sigma_chem": [f"sigma_{name[2:]}" for name in known if name.startswith("R_")],
    }
    result = {}
    for name, values in exact.items():
        candidates = [name] if name in known else stands_for.get(name, [])
        if len(candidates) == 1:
            result[candidates[0]] = values
    return result


def _check_start(exact: Mapping[str, Array], run: Trajectory) -> None:
    """Refuse a solution that starts elsewhere."""
    for j, state in enumerate(run.model.system.states):
        if state.name in exact:
            start, ours = exact[state.name][0], run.result.outputs[0, j]
            if abs(start - ours) > MISMATCH * max(abs(ours), state.scale):
                raise InputError(f"it starts from {state.name} = {start:.6g}, the scene from {ours:.6g}.")


def _check(reference: Reference, run: Trajectory) -> None:
    """Refuse a solution that does not satisfy the scene's equations."""
    probes = np.linspace(0.1, 0.9, PROBES) * run.result.times[-1]
    y, ydot = _along(reference, run, probes)
    problem, program, n = run.result.problem, run.model.program, len(run.model.system.states)
    segment = np.searchsorted(problem.segments[1:-1], probes, side="left")
    inputs = np.concatenate([probes[:, None], y, ydot, problem.parameters[segment]], axis=1)
    misses = program.residual(inputs)
    terms = program.jacobian(inputs)[:, n * n :].reshape(-1, n, n) * ydot[:, None, :]
    sizes = np.abs(terms).sum(axis=2) + np.abs(misses - terms.sum(axis=2))
    # Near equilibrium an equation is a sum of nothing, so its largest size over the run is the scale.
    largest = sizes.max(axis=0)
    parts = np.abs(misses) / np.where(largest > 0, largest, 1.0)
    if parts.max() > MISMATCH:
        j, row = np.unravel_index(parts.argmax(), parts.shape)
        equation = list(run.model.system.rows)[row]
        raise InputError(f"at t = {probes[j]:.3g} s it misses the equation of {equation} by {parts.max():.2%}.")


def _along(reference: Reference, run: Trajectory, t: Array) -> tuple[Array, Array]:
    """Exact states and their rates, by central differences; InputError where the solution leaves a state open."""
    step = 1e-4 * t
    times = np.concatenate([t - 2 * step, t - step, t, t + step, t + 2 * step])
    exact = renamed(reference.solution(times), run)
    names = [state.name for state in run.model.system.states]
    missing = [name for name in names if name not in exact]
    if missing:
        raise InputError(f"it says nothing of {', '.join(missing)}.")
    values = np.array([exact[name] for name in names]).reshape(len(names), 5, len(t))
    slope = (8 * (values[:, 3] - values[:, 1]) - (values[:, 4] - values[:, 0])) / (12 * step)
    return values[:, 2].T, slope.T
