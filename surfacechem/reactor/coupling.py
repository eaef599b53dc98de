"""Coupling of other reactors to a scene: to its bodies and its surface, and the changes of the scene that they need.

A body with a heat capacity is represented in the network by a reservoir at its temperature: heat through Cantera's
walls on that reservoir is external heat of the body. A body without one can be replaced by a reactor: it has the
reactor's temperature, and the reactor receives its heat. Gases and solids react with the surface of the interface:
reactions take molecules from them and add others.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from math import isclose, isfinite
from typing import Any, NoReturn, Self

import cantera
import numpy as np

from surfacechem.contracts.terms import Load, Spec
from surfacechem.contracts.units import parse
from surfacechem.errors import InputError, refuse_unknown, suggestion
from surfacechem.laws.loading import Hold
from surfacechem.mechanism.evaluated import Neighbour, SurfaceEngine
from surfacechem.model.components.interface import LOADABLE
from surfacechem.quantities import VARIABLES
from surfacechem.scene import Scene
from surfacechem.solve.adapters.cantera_network import StateVectorReactor
from surfacechem.solve.contract import Array
from surfacechem.tolerances import RUN_EPS

REFUSED_CONNECTORS: list[Any] = []
"""Connectors that were refused: the reactors they join keep pointers to them in Cantera."""


def refuse(connector: Any, message: str) -> NoReturn:
    """Raise InputError for a connector that Cantera creates, and make it carry nothing between its reactors."""
    REFUSED_CONNECTORS.append(connector)
    if isinstance(connector, cantera.FlowDevice):
        connector.device_coefficient = 0.0
    else:
        connector.area = 0.0
    raise InputError(message)


class NoFlow:
    """A reactor or a reservoir that refuses every flow; Cantera calls these methods."""

    no_inlet: str
    no_outlet: str
    """Why a flow cannot end or begin there, after its name."""

    def _add_inlet(self, device: Any) -> None:
        refuse(device, f"a flow into {self.name} {self.no_inlet}")  # type: ignore[attr-defined]

    def _add_outlet(self, device: Any) -> None:
        refuse(device, f"a flow out of {self.name} {self.no_outlet}")  # type: ignore[attr-defined]


class Receiver:
    """Neighbour of interfaces that receives the products of their reactions."""

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self.sources: list[tuple[Any, Callable[[float], tuple[Array, float]]]] = []
        """Interfaces, each with a function of time [s] for its inflow of species [kmol/s] and enthalpy [W]."""


class Gas(Receiver):
    """Source terms of interfaces in Cantera's balances of a gas.

    ``temperature`` is the index of the temperature among its variables: mass fractions follow it, and the mass is the
    first. ``energies`` is Cantera's name of the molar quantity of species in the energy balance [J/kmol].
    """

    temperature: int
    energies: str

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        phase = self.phase  # type: ignore[attr-defined]
        if phase.thermo_model != "ideal-gas":
            other = f"the phase {phase.name} is {phase.thermo_model}"
            raise InputError(f"{type(self).__name__} is an ideal gas, {other}. A solid or a liquid is a ReactingSolid.")
        self.weights = phase.molecular_weights

    def state_at(self, x: Array) -> Array:
        """Return pressure [Pa] and mole fractions at values of its variables; its phase has those of the present."""
        parts = x[self.temperature + 1 :] / self.weights
        whole, P = parts.sum(), self.phase.P  # type: ignore[attr-defined]
        if self.temperature > 1:  # after mass and volume: the pressure is not held
            P = x[0] / x[1] * whole * cantera.gas_constant * x[self.temperature]
        return np.array([P, *parts / whole])

    def after_eval(self, t: float, _lhs: Any, rhs: Any) -> None:
        """Add to Cantera's balances of mass, energy and species; Cantera calls it after their evaluation."""
        rates, first, phase = np.asarray(rhs), self.temperature + 1, self.phase  # type: ignore[attr-defined]
        for _, source in self.sources:
            amounts, enthalpy = source(t)
            masses = amounts * self.weights
            total = float(amounts @ self.weights)
            rates[0] += total
            if self.energy_enabled:  # type: ignore[attr-defined]  # the left side is the heat capacity
                rates[self.temperature] += enthalpy - float(amounts @ getattr(phase, self.energies))
            rates[first : first + len(masses)] += masses - total * phase.Y


class ReactingGas(Gas, cantera.ExtensibleIdealGasReactor):
    """Cantera's IdealGasReactor for a gas next to the surface of an interface.

    ``InterfaceReactor(..., neighbours={name: gas})`` makes it a neighbour, of one interface or of several.

    Its arguments are those of an IdealGasReactor, first the gas, a ``cantera.Solution``.
    """

    temperature = 2
    energies = "partial_molar_int_energies"


class ReactingGasAtPressure(Gas, cantera.ExtensibleIdealGasConstPressureReactor):
    """Cantera's IdealGasConstPressureReactor for a gas next to the surface of an interface.

    Its arguments are those of an IdealGasConstPressureReactor, first the gas, a ``cantera.Solution``.
    """

    temperature = 1
    energies = "partial_molar_enthalpies"


MASS = Spec("kg", "mass at the start", above=0)


class ReactingSolid(NoFlow, Receiver, StateVectorReactor):
    """A solid or a liquid next to the surface of an interface, such as the particle of an electrode or its electrolyte.

    ``InterfaceReactor(..., neighbours={name: solid})`` makes it a neighbour. Its variables are its amounts relative to
    the total amount at the start; temperature and pressure are held constant, whatever heat that takes. Its electric
    potential is that of the case. There is no other inflow or outflow: connectors are refused.

    Parameters
    ----------
    phase
        A ``cantera.Solution`` in its initial state.
    mass
        Its initial mass: kg, or a text with a unit.
    clone
        True for a copy of the phase; False for the phase itself, whose state then follows the reactor.
    name
        Its name in the network.

    Raises
    ------
    InputError
        For an invalid mass.
    """

    switches = {  # noqa: RUF012 - never changed
        "chemistry_enabled": (True, "Set multipliers on the phase of the interface beside it."),
        "energy_enabled": (False, "Its temperature is held; let a gas or a body have one that follows."),
    }

    no_inlet = "would be lost: only reactions of interfaces change its amounts."
    no_outlet = "has no source: only reactions of interfaces change its amounts."

    def __new__(cls, phase: Any, *, mass: float | str, clone: bool = True, name: str = "solid") -> Self:
        """Use the phase itself, or a copy that Cantera makes for a reservoir."""
        return super().__new__(cls, cantera.Reservoir(phase, clone=True).phase if clone else phase, name=name)

    def __init__(self, phase: Any, *, mass: float | str, clone: bool = True, name: str = "solid") -> None:
        super().__init__(self.surface, name=name)
        kilograms = parse(mass, "kg", name="mass")
        MASS.check("mass", kilograms)
        self.names = tuple(phase.species_names)
        self.whole = kilograms / phase.mean_molecular_weight
        """Total amount at the start [kmol]."""
        self.x = phase.X

    @property
    def phase(self) -> Any:
        """The phase in its present state; Cantera would reset its own phase to the initial state."""
        return self.surface

    @property
    def amounts(self) -> Array:
        """Present amounts of its species [kmol]."""
        return np.asarray(self.x * self.whole)

    @property
    def mass(self) -> float:
        """Present mass [kg]."""
        return float(self.amounts @ self.phase.molecular_weights)

    @property  # type: ignore[misc]  # it follows from the mass
    def volume(self) -> float:
        """Present volume [m^3]."""
        return self.mass / float(self.phase.density)

    def _add_wall(self, wall: Any) -> None:
        refuse(wall, f"a wall on {self.name} would be without effect: its temperature and pressure are held.")

    def start(self) -> Array:
        return np.asarray(self.x)

    def put(self, x: Array) -> None:
        self.x = x
        self.phase.TPX = None, None, x

    def rates(self, t: float) -> Array:
        made = sum((source(t)[0] for _, source in self.sources), np.zeros(len(self.x)))
        return np.asarray(made / self.whole)


LOAD_UNITS = ("Pa", "N", "W/m^2")
"""Units of loads that do work or heat by their present value, independent of their rate."""

THERMO_TEMPERATURES = (300.0, 1500.0)
"""Temperatures [K] at which the thermo of species is compared: polynomials change at 1000 K."""

TERM_SIZE = 100.0
"""Size of the terms of enthalpies and entropies, in units of the gas constant (times temperature)."""

RESERVOIR_YAML = """
phases:
- {name: body, thermo: ideal-gas, species: [nitrogen], state: {T: 300 K, P: 1 atm}}
species:
- {name: nitrogen, composition: {N: 2}, thermo: {model: constant-cp}}
"""
"""Mechanism of a reservoir that represents a body; only its temperature matters."""


def suffix_of(scene: Scene, name: str) -> str:
    """Return the suffix of a body, or of 'interface', in the names of variables; InputError if the name is unknown."""
    names = {body.name: str(k) for k, body in enumerate(scene.bodies, start=1)} | {"interface": "c"}
    refuse_unknown([name], names, "the scene has no body '{}'")
    return names[name]


def node_of(scene: Scene, name: str) -> str:
    """Return the name of the evolving temperature of a body or of the interface; InputError if it has none."""
    where = {"1": scene.bodies[0].temperature, "2": scene.bodies[1].temperature, "c": scene.interface.temperature}
    temperature = where[suffix_of(scene, name)]
    if temperature is None or isinstance(temperature, Load) or temperature in scene.loading:
        problem = f"{name} has no temperature that evolves, so heat through a wall would not change it"
        raise InputError(f"{problem}. Give it a heat capacity, or let a reactor take its place.")
    return temperature


def with_heat(scene: Scene, names: Iterable[str]) -> Scene:
    """Return the scene with external heat into bodies, whose values are set during a run."""
    loading = dict(scene.loading)
    for name in names:
        heat = f"Q_{suffix_of(scene, name)}"
        if heat in scene.loading:
            raise InputError(f"{heat} has two roles: the case prescribes it, and a wall gives it. Remove one of them.")
        loading[heat] = Hold(level=0.0)
    return replace(scene, loading=loading)


def load_units(scene: Scene) -> dict[str, str]:
    """Return the units of the loads that a network can give, by name: those that act by their present value."""
    units = {name: VARIABLES[name].unit for name in LOADABLE}
    currents = {drive.name: drive.unit for drive in (electrode.drive for electrode in scene.interface.electrodes)}
    return {name: unit for name, unit in units.items() if unit in LOAD_UNITS} | currents


def with_loads(scene: Scene, values: Mapping[str, float]) -> Scene:
    """Return the scene with loads whose values are set during a run, in place of those that the case prescribes."""
    known, engine = load_units(scene), scene.interface.engine
    for name in values:
        if name not in known:
            reason = "" if name not in LOADABLE else " Its rate takes part; prescribe its history under `loading`."
            raise InputError(f"'{name}' is no load that a network can give.{suggestion(name, known)}{reason}")
        if not isfinite(values[name]):
            raise InputError(f"the load {name} is {values[name]} at the start, no finite number.")
    given: dict[str, Load] = {name: Hold(level=value) for name, value in values.items()}
    if isinstance(engine, SurfaceEngine):
        scene = replace(scene, interface=replace(scene.interface, engine=engine.driven(given)))
    return replace(scene, loading={**scene.loading, **{name: given[name] for name in given if name in LOADABLE}})


def function_of(scene: Scene, name: str, load: Callable[[float], float] | float | str) -> Callable[[float], float]:
    """Return a load as a function of time; InputError unless it is a function, a number or a text with a unit."""
    if callable(load):

        def checked(t: float) -> float:
            value: Any = load(t)
            try:
                return float(value)
            except (TypeError, ValueError):
                words = f"a number in SI at each time; at t = {t:g} s it is {value!r}"
                raise InputError(f"the load {name} is {words}.") from None

        return checked
    unit = load_units(scene).get(name)
    level = parse(load, unit, name=name) if unit else 0.0  # reported later
    return lambda _: level


def with_neighbours(scene: Scene, reactors: Mapping[str, Any]) -> Scene:
    """Return the scene with neighbours whose pressures and compositions are set during a run.

    Electric potentials stay those of the case.
    """
    if not reactors:
        return scene
    engine = scene.interface.engine
    if not isinstance(engine, SurfaceEngine):
        raise InputError("no reaction of the scene has a neighbour, so no reactor can be one.")
    for name, reactor in reactors.items():
        if not isinstance(reactor, Receiver | cantera.Reservoir):
            kinds = "a ReactingGas or a ReactingSolid"
            raise InputError(f"the neighbour {name} must be {kinds}, as {type(reactor).__name__} takes nothing.")
    for name, own in engine.surface.adjacent.items():
        if name in reactors:
            _refuse_other_phase(name, own, reactors[name].phase)
    states = {}
    for name, reactor in reactors.items():
        phase = reactor.phase
        parts = dict(zip(phase.species_names, phase.X.tolist(), strict=True)) if phase.n_species > 1 else {}
        given = {species: Hold(level=part) for species, part in parts.items()}
        states[name] = Neighbour(Hold(level=float(phase.P)), given)
    return replace(scene, interface=replace(scene.interface, engine=engine.with_neighbours(states)))


def _refuse_other_phase(name: str, own: Any, given: Any) -> None:
    """Refuse a phase other than the neighbour of the mechanism, since the exchange would violate the balances."""
    if own.species_names != given.species_names:
        names = ", ".join(own.species_names)
        raise InputError(f"the reactor of the neighbour {name} has other species than the mechanism: {names}.")
    for ours, theirs in zip(own.species(), given.species(), strict=True):
        for what, same in _agreement(ours, theirs):
            if not same:
                problem = f"has another {what} than in the mechanism, so atoms or energy would be lost"
                remedy = "give the reactor the phase of the mechanism's file"
                raise InputError(f"{ours.name} in the reactor of the neighbour {name} {problem}: {remedy}.")


def _agreement(ours: Any, theirs: Any) -> Iterator[tuple[str, bool]]:
    """Yield properties of a species, and whether two species of one name agree in them."""
    yield "composition", ours.composition == theirs.composition
    yield "weight", isclose(ours.molecular_weight, theirs.molecular_weight, rel_tol=RUN_EPS)
    both, R = (ours.thermo, theirs.thermo), cantera.gas_constant
    if None in both:
        return
    low, high = max(each.min_temp for each in both), min(each.max_temp for each in both)
    for T in np.clip(THERMO_TEMPERATURES, low, high).tolist():
        for what, function, unit in (("enthalpy", "h", R * T), ("entropy", "s", R)):
            found = [getattr(each, function)(T) for each in both]
            yield f"{what} at {T:g} K", isclose(*found, rel_tol=RUN_EPS, abs_tol=RUN_EPS * TERM_SIZE * unit)


def with_reactors(scene: Scene, reactors: Mapping[str, Any]) -> Scene:
    """Return the scene with bodies whose temperatures are set during a run."""
    bodies = {body.name: body for body in scene.bodies}
    for name, reactor in reactors.items():
        if suffix_of(scene, name) == "c":
            raise InputError("a reactor can take the place of a body, not of the interface.")
        body = bodies[name]
        if body.energy is not None or not isinstance(body.temperature, Load):
            problem = "so the case must not give it a heat capacity or a temperature that it shares"
            remedy = f"Write `{name}: {{temperature: 300 K}}`; the value is not used."
            raise InputError(f"a reactor takes the place of {name}, {problem}. {remedy}")
        bodies[name] = body._replace(temperature=Hold(level=float(reactor.T)))
    first, second = bodies.values()
    return replace(scene, bodies=(first, second))


class HeatWall(cantera.Wall):
    """A wall between reactors by which an interface gives heat to them, or moves."""

    def __init__(self, left: Any, right: Any, *, interface: Any, **options: Any) -> None:
        super().__init__(left, right, **options)
        self.interface = interface


class BodyPort(NoFlow, cantera.Reservoir):
    """A body as a reservoir in the network: it has its present temperature, and takes heat through walls alone."""

    no_inlet = "would be lost: a body stores heat, not mass. Let it end in a reactor."
    no_outlet = "has no source: a body stores heat, not mass. Begin it in a reactor."
    node: str
    """Name of its temperature in the scene."""
    heat_name: str
    """Name of the heat that it takes there."""

    @classmethod
    def of(cls, name: str, node: str, heat_name: str) -> Self:
        """Return the reservoir of a body."""
        made = cls(cantera.Solution(yaml=RESERVOIR_YAML, name="body"), clone=False, name=name)
        made.node, made.heat_name = node, heat_name
        return made

    def _add_wall(self, wall: Any) -> None:
        if wall.velocity != 0.0 or wall.expansion_rate_coeff != 0.0:
            refuse(wall, self._rigid())
        super()._add_wall(wall)

    def _rigid(self) -> str:
        """Return the reason why a wall on it cannot move, with the remedy."""
        problem = f"a wall on {self.name} moves, and its work would be lost: a body stores heat here, not volume"
        return f"{problem}. Leave out `velocity` and `K`, or put the moving wall between two gases."

    def warm(self, temperature: float) -> None:
        """Set the temperature [K] that the walls see."""
        if temperature > 0:
            self.phase.TP = temperature, None
            self.syncState()

    def heat(self) -> float:
        """Return the heat [W] that flows into the body through its walls."""
        heat = 0.0
        for wall in self.walls:
            if wall.expansion_rate != 0.0:
                raise InputError(self._rigid())
            if wall.heat_flux != 0.0:
                problem = f"a wall on {self.name} has a heat flux of its own, whose time is not known here"
                remedy = f"Give the wall U or an emissivity, or prescribe {self.heat_name} under `loading`."
                raise InputError(f"{problem}. {remedy}")
            heat += -wall.heat_rate if wall.left_reactor is self else wall.heat_rate
        return heat

    def others(self) -> list[Any]:
        """Return the reactors on the other sides of its walls."""
        return [wall.right_reactor if wall.left_reactor is self else wall.left_reactor for wall in self.walls]
