"""A view of a scene and of the start of its run, from which exact solutions read their parameters."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from surfacechem.contracts.terms import Law, Varying

if TYPE_CHECKING:
    from surfacechem.scene import Scene
    from surfacechem.solve.run import Trajectory


class SceneView:
    """A scene as it was run: constants of its laws by contract, loads, supports, capacities and initial values, in SI.

    It is only read. What the scene does not have, or has more than once, is None.
    """

    def __init__(self, scene: Scene, run: Trajectory) -> None:
        self.scene, self.run = scene, run
        self._parameters = {str(p.symbol): run.values[p.path] for p in run.model.system.parameters}
        self._states = {state.name: state.from_given(run.values) for state in run.model.system.states}

    @cached_property
    def _outputs(self) -> dict[str, float]:
        names = (item.name for item in self.run.model.system.outputs)
        return dict(zip(names, self.run.outputs[0], strict=True))

    # -- laws, loads, supports -----------------------------------------------------------------------------------------

    def potential(self, name: str) -> float | None:
        """A constant of the interface's potentials."""
        return self._constant(self.scene.interface.potentials, name)

    def friction(self, name: str) -> float | None:
        """A constant of the friction laws."""
        return self._constant(self.scene.interface.frictions, name)

    def reaction(self, name: str) -> float | None:
        """A constant of the rate laws."""
        return self._constant(self.scene.interface.reactions, name)

    def limit(self, name: str) -> float | None:
        """A constant of the limits of traction."""
        return self._constant(self.scene.interface.limits, name)

    def _constant(self, laws: Iterable[Law], name: str) -> float | None:
        """A constant of one law, as its own or as that of a factor of one of its parameters."""
        paths = []
        for law in laws:
            varying = [value for field, _ in law.specs() if isinstance(value := getattr(law, field), Varying)]
            paths += [law.path, *(factor.path for value in varying for factor in value.factors)]
        found = [self.run.values[f"{path}.{name}"] for path in paths if f"{path}.{name}" in self.run.values]
        return found[0] if len(found) == 1 else None

    def ramp(self, variable: str) -> float | None:
        """The constant rate at which a variable is driven, in its unit per second."""
        return self.run.values.get(f"loading.{variable}.ramp.rate")

    def support(self, direction: str, name: str) -> float | None:
        """A constant of what supports the bodies in the direction 'normal' or 'tangential'."""
        return self.run.values.get(f"mechanics.{direction}.{name}")

    def conductance(self, into: int | None = None) -> float | None:
        """Sum of the conductances of all heat paths, or of those between the interface and body 1 or 2 [W/(m^2 K)].

        None if there is no path, or one has no constant h.
        """
        ends = {"interface", self.scene.bodies[into - 1].name} if into else None
        chosen = [law for law in self.scene.heat if ends is None or set(law.between) == ends]
        found = [self.run.values.get(f"{law.path}.h") for law in chosen]
        return sum(h for h in found if h is not None) if found and None not in found else None

    # -- bodies and sites ----------------------------------------------------------------------------------------------

    def constant(self, name: str) -> float | None:
        """A constant of bodies or sites by its symbol: C_1, C_2, C_c, T_0, N_c, N_1, N_2, thickness_1, ..."""
        return self._parameters.get(name)

    @property
    def capacity(self) -> float:
        """Sum of all heat capacities at T_0 [J/(m^2 K)]."""
        return sum(value for name, value in self._parameters.items() if name in ("C_1", "C_2", "C_c"))

    @property
    def temperature(self) -> float | None:
        """The first temperature that evolves, or that of the interface [K]."""
        names = [state.name for state in self.run.model.system.states if state.quantity.unit == "K"]
        return self._states[names[0]] if names else self._outputs.get("T_c")

    @property
    def surroundings_temperature(self) -> float | None:
        """Temperature of the surroundings, else of a body that is held at one [K]."""
        names = [name for name in ("T_a", "T_2", "T_1") if name in self._outputs]
        return self._outputs[names[0]] if names else None

    @property
    def adiabatic_rise(self) -> float | None:
        """Temperature rise [K] by the heat of all bonds; none in reservoirs."""
        heat = self.potential("H_r")
        return None if heat is None else heat / self.capacity if self.capacity else 0.0

    # -- the start -----------------------------------------------------------------------------------------------------

    def initial(self, name: str) -> float | None:
        """Initial value of a state, or of a named quantity: a load for instance."""
        return self._states[name] if name in self._states else self._outputs.get(name)

    @property
    def bonding_rate(self) -> float | None:
        """Initial rate of the bonding state [1/s]."""
        names = [state.name for state in self.run.model.system.states]
        return float(self.run.rates[0, names.index("phi")]) if "phi" in names else None

    @property
    def relaxation_time(self) -> float | None:
        """Time [s] in which bonds form, if their rate is their distance from equilibrium over it; where nothing forms
        no rate tells it, but a law may.
        """
        if not self.bonding_rate:
            return self.reaction("tau")
        equilibrium = self.potential("phi_eq")
        return ((1.0 if equilibrium is None else equilibrium) - self._states["phi"]) / self.bonding_rate

    def friction_power(self, temperature: float | None = None) -> float:
        """Power of all friction [W/m^2], at the start or with every temperature set to one value."""
        names = [account.quantity.name for account in self.run.model.system.ledger]
        laws = [name[2:] for name in names if name.startswith("W_") and f"heat_{name[2:]}" in names]
        values = self._outputs
        if temperature is not None:
            result = self.run.result
            y = np.array([[value if name == "phi" else temperature for name, value in self._states.items()]])
            at = self.run.model.evaluate(result, result.times[:1], y, np.zeros_like(y))[0]
            values = dict(zip(values, at, strict=True))
        return float(sum(values[f"D_{law}"] for law in laws))

    @property
    def heat_supply(self) -> float:
        """External heat into bodies and interface [W/m^2]."""
        return float(sum(self._outputs.get(name, 0.0) for name in ("Q_1", "Q_2", "Q_c")))

    @property
    def heating_at_T_0(self) -> float | None:
        """Friction at the reference temperature and external heat [W/m^2]."""
        T_0 = self.constant("T_0")
        return None if T_0 is None else self.friction_power(T_0) + self.heat_supply
