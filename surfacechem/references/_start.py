"""What a scene says of itself at the start, by the names that exact solutions use for it."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from surfacechem.references._energy import ConstantCapacity, QuadraticEnergy
from surfacechem.references._slabs import HELD
from surfacechem.scene import Scene
from surfacechem.solve.run import Trajectory

Array = NDArray[np.float64]


class Start:
    """What a scene says of itself at the start, by the names that exact solutions use."""

    def __init__(self, run: Trajectory, scene: Scene) -> None:
        self.run, self.scene = run, scene
        system = run.model.system
        self.parameters = {str(p.symbol): run.values[p.path] for p in system.parameters}
        self.initial = {state.name: state.from_given(run.values) for state in system.states}

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

    def inside(self, k: int) -> float:
        """Initial temperature inside body k, where it is not that of the contact."""
        return self.run.values[f"initial.profile_{k}"]

    def far_conductance(self, k: int) -> float:
        """Conductance at the far side of body k, without end where that is held."""
        given = f"h_far_{k}" in self.parameters
        return self.parameters[f"h_far_{k}"] if given else HELD * (self.named[f"T_far_{k}"] > 0)

    def find(self, name: str) -> float | None:
        """The value of a parameter of an exact solution, or None."""
        for rule in (RULES.get(name), lambda start: start._plain(name)):
            with suppress(KeyError, ZeroDivisionError):  # nothing forms where all is bonded: no rate tells a time
                if rule is not None:
                    return float(rule(self))
        return None

    def _plain(self, name: str) -> float:
        for source in (self.parameters, self.initial):
            if name in source:
                return float(source[name])
        for key in (name, name.removesuffix("_i")):
            if key in self.initial or key in self.named:
                return float(self.initial[key] if key in self.initial else self.named[key])
        return self.at(f".{name}")

    def at(self, ending: str) -> float:
        """The one parameter whose path ends like this; KeyError if there is none, or there are several."""
        found = [value for path, value in self.run.values.items() if path.endswith(ending)]
        if len(found) != 1:
            raise KeyError(ending)
        return found[0]

    def has(self, section: str) -> bool:
        """Whether a section of the case gives any parameter."""
        return any(path.startswith(f"{section}.") for path in self.run.values)

    def ramp(self, variable: str) -> float:
        """The rate at which a variable is driven."""
        return self.at(f"loading.{variable}.ramp.rate")

    def held_at(self, parameter: str) -> float:
        """A parameter of the mounting; of the normal gap if both directions are mounted."""
        paths = [f"mechanics.{direction}.{parameter}" for direction in ("normal", "tangential")]
        return self.run.values[next((path for path in paths if path in self.run.values), paths[0])]

    def damping(self) -> float:
        """Dampers of the normal gap."""
        found = [self.run.values.get(f"mechanics.normal.{name}") for name in ("c_b", "c_g")]
        if found == [None, None]:
            raise KeyError("no damper")
        return sum(value or 0.0 for value in found)

    def sliding(self) -> float:
        """Traction of dry sliding."""
        return float(self.at(".mu") * self.named["p"])

    def sticking(self) -> float:
        """Traction that sticking bears."""
        values = self.run.values
        static = next((values[p] for p in values if p.endswith(".mu_s")), 0.0)
        return float(max(self.at(".mu"), static) * self.named["p"])

    def heated(self, heat: Array) -> Array:
        """The one temperature of the scene once its bodies have taken up a heat."""
        energies = {body.energy.name() for body in self.scene.bodies if body.energy is not None}
        model = {"quadratic": QuadraticEnergy(), "constant": ConstantCapacity()}[",".join(energies)]
        T = self.temperature()
        return T + model.rise(heat, self.capacity(), self.parameters.get("T_0", T), T)

    def temperature(self) -> float:
        """The one temperature of the scene."""
        names = [state.name for state in self.run.model.system.states if state.quantity.unit == "K"]
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
    "R": lambda s: 1 / s.conductance(lambda ends: True),
    "T_1": lambda s: s.inside(1),
    "T_2": lambda s: s.inside(2),
    "h_far_1": lambda s: s.far_conductance(1),
    "h_far_2": lambda s: s.far_conductance(2),
    "h_1": lambda s: s.into(1),
    "h_2": lambda s: s.into(2),
    "k": lambda s: s.held_at("k"),
    "m": lambda s: s.held_at("m"),
    "c": lambda s: s.damping(),
    "V": lambda s: s.ramp("w_t"),
    "w_i": lambda s: s.named["w_n"],
    "w_dot": lambda s: s.ramp("w_n"),
    "g_dot": lambda s: s.ramp("g_n"),
    "a": lambda s: -s.ramp("g_n"),
    "g_i": lambda s: s.initial["g_n"] if "g_n" in s.initial else s.named["g_n"],
    "mu": lambda s: s.at(".mu"),
    "mu_b": lambda s: s.at(".mu_b") * s.parameters["T_0"] / s.temperature(),
    "mu_ub": lambda s: s.at(".mu_ub") * s.parameters["T_0"] / s.temperature(),
    "mu_k": lambda s: s.at(".mu"),
    "t_k": lambda s: s.sliding(),
    "t_s": lambda s: s.sticking(),
    "t_n": lambda s: s.named["t_n"] if s.has("loading.t_n") else s.at(".t_max"),
    "T_a": lambda s: s.named["T_a"] if "T_a" in s.named else s.named["T_2"] if "T_2" in s.named else s.named["T_1"],
}
"""Parameters of exact solutions that are not parameters of the scene under the same name."""
