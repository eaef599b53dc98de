"""View of a scene and of the start of its run, from which exact solutions read their parameters."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from surfacechem.errors import InputError

if TYPE_CHECKING:
    from surfacechem.contracts.terms import Law
    from surfacechem.scene import Scene
    from surfacechem.solve.run import Trajectory
    from surfacechem.surfaces.potential import CurvedSurfaces


class SceneView:
    """A scene as it was run: constants of its laws by contract, loads, supports, capacities and initial values, in SI.

    Read only. A value that the scene does not have, or has more than once, is None.
    """

    def __init__(self, scene: Scene, run: Trajectory) -> None:
        self.scene, self.run, self._system = scene, run, run.model.system

    @cached_property
    def _states(self) -> dict[str, float]:
        return {state.name: state.from_given(self.run.values) for state in self._system.states}

    @cached_property
    def _outputs(self) -> dict[str, float]:
        return dict(zip(self._system.output_columns, self.run.outputs[0].tolist(), strict=True))

    def read(self, reading: str, name: str) -> float | None:
        """Return one of the readings below, by name if it needs one; a preceding minus reverses the sign."""
        found = getattr(self, reading)
        value: float | None = found(name.removeprefix("-")) if callable(found) else found
        return -value if value is not None and name.startswith("-") else value

    # -- laws, loads, supports -----------------------------------------------------------------------------------------

    def potential(self, name: str) -> float | None:
        """Return a constant of the interface's potentials."""
        return self._constant(self.scene.interface.potentials, name)

    def friction(self, name: str) -> float | None:
        """Return a constant of the friction laws."""
        return self._constant(self.scene.interface.frictions, name)

    def reaction(self, name: str) -> float | None:
        """Return a constant of the rate laws."""
        return self._constant(self.scene.interface.reactions, name)

    def limit(self, name: str) -> float | None:
        """Return a constant of the limits of traction."""
        return self._constant(self.scene.interface.limits, name)

    def _constant(self, laws: Iterable[Law], name: str) -> float | None:
        """Return a constant of one of the laws, or of a factor of one of its parameters."""
        paths = []
        for law in laws:
            paths += [law.path, *(factor.path for factor in law.factors)]
        found = [self.run.values[f"{path}.{name}"] for path in paths if f"{path}.{name}" in self.run.values]
        return found[0] if len(found) == 1 else None

    def surface(self, name: str) -> float | None:
        """Return a parameter of the shapes of two bodies, or of a law between them."""
        laws: list[Law] = [*self.surfaces.shapes, *self.surfaces.gap_laws]
        found = {own: getattr(law, own) for law in laws for own, _ in law.specs()}
        # Parameters of pairs of points may have been changed for this run.
        found |= {path.rpartition(".")[2]: x for path, x in self.run.values.items() if path.startswith("surface.pair.")}
        return found.get(name)

    @property
    def surfaces(self) -> CurvedSurfaces:
        """The two surfaces; InputError if the scene has none."""
        from surfacechem.surfaces.potential import CurvedSurfaces

        if not isinstance(self.scene.surface, CurvedSurfaces):
            raise InputError("it needs two bodies with shapes; the scene has no `surface`.")
        return self.scene.surface

    def ramp(self, name: str) -> float | None:
        """Return the constant rate at which a variable is driven, in its unit per second."""
        return self.run.values.get(f"loading.{name}.ramp.rate")

    def normal(self, name: str) -> float | None:
        """Return a constant of the support of the bodies along the normal."""
        return self.run.values.get(f"mechanics.normal.{name}")

    def tangential(self, name: str) -> float | None:
        """Return a constant of the support of the bodies along the interface."""
        return self.run.values.get(f"mechanics.tangential.{name}")

    def conductance(self, into: str) -> float | None:
        """Return the sum of the conductances between the interface and body '1' or '2' [W/(m^2 K)]."""
        ends = {"interface", self.scene.bodies[int(into) - 1].name}
        return self._sum([law for law in self.scene.heat if set(law.between) == ends])

    @property
    def total_conductance(self) -> float | None:
        """Sum of the conductances of all heat paths [W/(m^2 K)]."""
        return self._sum(self.scene.heat)

    def _sum(self, paths: Sequence[Law]) -> float | None:
        """Return the sum of the conductances of heat paths; None if there is no path, or one has no constant h."""
        found = [self.run.values.get(f"{law.path}.h") for law in paths]
        return sum(h for h in found if h is not None) if found and None not in found else None

    # -- bodies and sites ----------------------------------------------------------------------------------------------

    def constant(self, name: str) -> float | None:
        """Return a constant of bodies or sites by its symbol: C_1, C_2, C_c, T_0, N_c, N_1, N_2, thickness_1, ..."""
        path = self._system.paths_by_symbol.get(name)
        return None if path is None else self.run.values[path]

    @property
    def capacity(self) -> float:
        """Sum of all heat capacities at T_0 [J/(m^2 K)]."""
        return sum(self.constant(name) or 0.0 for name in ("C_1", "C_2", "C_c"))

    @property
    def temperature(self) -> float | None:
        """First evolved temperature, or that of the interface [K]."""
        # A scene without bodies has a single temperature, T.
        own = [state.name for state in self._system.states if state.is_temperature]
        return next((T for name in (*own[:1], "T_c", "T") if (T := self.initial(name)) is not None), None)

    @property
    def surroundings_temperature(self) -> float | None:
        """Temperature of the surroundings, else of a body with a prescribed one [K]."""
        return next((self._outputs[name] for name in ("T_a", "T_2", "T_1") if name in self._outputs), None)

    @property
    def adiabatic_rise(self) -> float | None:
        """Temperature rise [K] by the heat of all bonds; zero in reservoirs."""
        heat = self.potential("H_r")
        return None if heat is None else heat / self.capacity if self.capacity else 0.0

    # -- the start -----------------------------------------------------------------------------------------------------

    def initial(self, name: str) -> float | None:
        """Return the initial value of a state, or of a named quantity, a load for instance."""
        return self._states[name] if name in self._states else self._outputs.get(name)

    @property
    def bonding_rate(self) -> float | None:
        """Initial rate of the bonding state [1/s]."""
        column = self._system.state_columns.get("phi")
        return None if column is None else float(self.run.rates[0, column])

    @property
    def relaxation_time(self) -> float | None:
        """Relaxation time [s] of bonding, if its rate is proportional to the distance from equilibrium; without an
        initial rate it may be a parameter of a law.
        """
        if not self.bonding_rate:
            return self.reaction("tau")
        equilibrium = self.potential("phi_eq")
        return ((1.0 if equilibrium is None else equilibrium) - self._states["phi"]) / self.bonding_rate

    @property
    def friction_power(self) -> float:
        """Power of all friction [W/m^2] at the start."""
        return self._dissipated(self._outputs)

    def _dissipated(self, outputs: Mapping[str, float]) -> float:
        accounts = {account.quantity.name for account in self._system.ledger}
        laws = (name[2:] for name in outputs if name.startswith("D_"))
        return sum((outputs[f"D_{law}"] for law in laws if {f"W_{law}", f"heat_{law}"} <= accounts), 0.0)

    @property
    def heat_supply(self) -> float:
        """External heat into bodies and interface [W/m^2]."""
        return float(sum(self._outputs.get(name, 0.0) for name in ("Q_1", "Q_2", "Q_c")))

    @property
    def heating_at_T_0(self) -> float | None:
        """Friction at the reference temperature and external heat [W/m^2]."""
        T_0 = self.constant("T_0")
        if T_0 is None:
            return None
        y = np.array([[value if name == "phi" else T_0 for name, value in self._states.items()]])
        at = self.run.model.evaluate(self.run.result, self.run.result.times[:1], y, np.zeros_like(y))[0]
        return self._dissipated(dict(zip(self._outputs, at.tolist(), strict=True))) + self.heat_supply
