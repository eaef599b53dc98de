"""The reactor that holds a scene."""

from __future__ import annotations

import time
from bisect import bisect_right
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property, partial
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, Self

import numpy as np
from numpy.typing import NDArray

from surfacechem import format as cases
from surfacechem.contracts.terms import Spec
from surfacechem.contracts.units import parse
from surfacechem.errors import InputError, concise
from surfacechem.format import Case
from surfacechem.reactor.coupling import BodyPort, HeatWall, NoFlow, Receiver, function_of, node_of, refuse, suffix_of
from surfacechem.reactor.embedded import EmbeddedScene, EndError, History
from surfacechem.runs.simulation import Simulation
from surfacechem.solve.adapters.cantera_network import LEDGER_UNIT, BackOffError, StateVectorReactor, contents
from surfacechem.solve.contract import Array
from surfacechem.tolerances import FEW_EPS, RUN_EPS

if TYPE_CHECKING:
    import xarray

AREA = Spec("m^2", "area of the interface", above=0)


class InterfaceStopped(Exception):  # noqa: N818 - physics ends here, nothing went wrong
    """The scene ends here, with the reason in words."""


class InterfaceReactor(NoFlow, StateVectorReactor):
    """An interface between two bodies as a reactor of a Cantera network.

    Parameters
    ----------
    case
        A case file, the name of a shipped case, a Case or a Simulation.
    overrides
        Changes of the case, as in ``surfacechem.load``.
    area
        Area by which quantities per area of the scene are multiplied in the network: m^2, or a text with a unit.
    bodies
        Reactors that take the place of bodies: {body: reactor}.
    neighbours
        Gases and solids next to the surface of its mechanism, by their names there: {phase: ReactingGas}.
    name
        Its name in the network; a ``ReactorNet`` of this package numbers names that occur twice.

    Raises
    ------
    InputError
        Where the scene does not allow it.
    """

    scene: EmbeddedScene
    no_inlet = "would be lost: an interface has no volume to fill. Let it end in a reactor beside it."
    no_outlet = "has no source: an interface has no volume to come from. Let it begin in a reactor beside it."
    switches = {  # noqa: RUF012 - never changed
        "chemistry_enabled": (True, "Reactions stop with `phase.set_multiplier(0.0)`."),
        "energy_enabled": (True, "Hold temperatures in the case: `bodies: {lower: {temperature: 300 K}}`."),
    }

    @concise
    def __new__(
        cls,
        case: str | Path | Case | Simulation,
        overrides: Sequence[str] | Mapping[str, object] = (),
        *,
        bodies: Mapping[str, Any] | None = None,
        neighbours: Mapping[str, Any] | None = None,
        name: str = "interface",
        **_: Any,
    ) -> Self:
        """Read the scene: Cantera needs its reactions at creation."""
        if overrides and isinstance(case, Simulation | Case):
            raise InputError("a case that is read already takes no overrides: give them to `surfacechem.load`.")
        if not isinstance(case, Case):
            case = case.case if isinstance(case, Simulation) else cases.load(case, overrides)
        scene = EmbeddedScene(case, bodies or {}, neighbours=neighbours)
        made = super().__new__(cls, contents(scene.reactions or ("bond",)), name=name)
        made.scene = scene
        return made

    @concise
    def __init__(
        self,
        case: str | Path | Case | Simulation,
        overrides: Sequence[str] | Mapping[str, object] = (),
        *,
        area: float | str = 1.0,
        bodies: Mapping[str, Any] | None = None,
        neighbours: Mapping[str, Any] | None = None,
        name: str = "interface",
    ) -> None:
        super().__init__(self.surface, name=name)  # Cantera's part was created in __new__
        self._walls: list[Any] = []
        """Walls with the area of the interface."""
        self.area = area
        self.bodies, self.neighbours = dict(bodies or {}), dict(neighbours or {})
        self.ports: dict[str, BodyPort] = {}
        self.loads: dict[str, Callable[[float], float]] = {}
        self.pressing: tuple[Any, ...] = ()
        """Reactors on both sides of the wall that moves with the gap."""
        self.passes_breakpoints = False
        """True if the network stops at breakpoints."""
        self.t = 0.0
        self._dated = True
        """True if ``t`` is the time of the variables set last."""
        self.restarted = 0.0
        """Time of the start or of the last jump, after which steps begin at the rounding of the time."""
        self._connecting = False
        """True while a wall is created between a body and the reactor in its place."""
        self._is_perturbed = False
        """True if Cantera perturbs multipliers between evaluations of rates."""
        self._is_set, self._asked_at = False, 0.0
        """Whether variables were set since other reactors asked for rates, and the time of that request [s]."""
        self.evaluations, self.seconds = 0, 0.0
        self._set_scene(self.scene)
        self._connecting = True
        for body, reactor in self.bodies.items():
            # Through the wall the reactor supplies the heat that keeps the body at its temperature.
            self._walls.append(HeatWall(self, reactor, interface=self, A=self.area, Q=partial(self._supplied, body)))
        self._connecting = False
        for k, neighbour in enumerate(self.neighbours.values()):
            if isinstance(neighbour, Receiver):
                neighbour.sources.append((self, partial(self._given, k)))

    def __repr__(self) -> str:
        """Return title and states in a line."""
        return f"<InterfaceReactor {self.name!r}: {self.scene.case.title!r}, {', '.join(self.scene.states)}>"

    @property
    def area(self) -> float:
        """Area by which quantities per area of the scene are multiplied in the network: m^2, or set as a text."""
        return self._area

    @area.setter
    def area(self, value: float | str) -> None:
        area = parse(value, "m^2", name="area")
        AREA.check("area", area)
        self._area = area
        for wall in self._walls:
            wall.area = area

    def _set_scene(self, scene: EmbeddedScene) -> None:
        self.scene = scene
        states = [scene.model.system.states[j] for j in scene.evaluation.free]
        # Of a turn, in radians, the absolute error counts: its scale is large.
        units = [1.0 if state.is_temperature else max(state.scale, 1.0) for state in states]
        self.unit = np.array(units + [LEDGER_UNIT] * len(scene.accounts))
        named = zip((*scene.states, *scene.accounts), self.unit.tolist(), strict=True)
        self.names = tuple(name if unit == 1 else f"{name} / {unit:g}" for name, unit in named)
        self.x = scene.start()
        self.ledger = self.x[len(scene.states) :].copy()
        self.booked_at = self.x
        """Variables up to which the network has integrated the ledger."""
        self.reason = ""
        self._last: tuple[float, Array, Array] | None = None
        """Time, variables and rates of the last evaluation."""
        self._current = False
        """True if the rates are those of the variables set last."""
        self._last_inputs: object = None
        """All inputs of those rates; None if they may depend on more."""
        self._input_columns = np.array([*self._paths()], dtype=np.int64)
        self._accounts = {body: scene.account(body) for body in self.bodies}
        """Indices of the variables that hold the heat of the bodies that reactors replace."""
        self.history = History(scene)

    def _supplied(self, body: str, t: float) -> float:
        """Return the heat [W/m^2] that the reactor in place of a body supplies at a time [s]."""
        return -float(self._rates_for_others(t)[self._accounts[body]])

    def _given(self, k: int, t: float) -> tuple[Array, float]:
        """Return species [kmol/s] and enthalpy [W] that reactions give to a neighbour at a time [s]."""
        return self.scene.neighbours[k].given(self._rates_for_others(t), self.area)

    def _add_wall(self, wall: Any) -> None:
        """Refuse a wall on this reactor, which consists of two bodies; Cantera calls it."""
        if self._connecting:
            super()._add_wall(wall)
            return
        names = ", ".join(f"{self.name}.body({body.name!r})" for body in self.scene.case.scene.bodies)
        refuse(wall, f"a wall on {self.name} does not say which body it touches. Put it on one of them: {names}.")

    def add_sensitivity_reaction(self, m: int) -> None:
        """Add sensitivities to the rate of a reaction, by its index from 0; this reactor is in a network already.

        In the network the interface must precede the reactors that take from it, or the network stops: Cantera perturbs
        the rate of a reactor only when it evaluates that reactor.
        """
        super().add_sensitivity_reaction(m)
        self._is_perturbed = True

    def add_sensitivity_species_enthalpy(self, species: Any) -> None:
        """Refuse: the thermo of species is in the formulas of the scene, where Cantera does not change it."""
        remedy = "Change the species in the mechanism, or use `add_sensitivity_reaction`."
        raise InputError(f"sensitivities to the enthalpy of {species} are not known in a network. {remedy}")

    @property
    def _contents(self) -> NoReturn:
        problem = f"{self.name} has no mass, volume or composition: it is an area"
        raise InputError(f"{problem}. Its states are `{self.name}[name]`.")

    mass = volume = density = Y = _contents

    @property
    def T(self) -> float:
        """Present temperature of the interface [K]; InputError if neither it nor the whole scene has one."""
        node = self.scene.case.scene.interface.temperature
        known = {*self.scene.states, *self.scene.model.system.output_columns}
        own = [name for name in (node if isinstance(node, str) else "T_c", "T") if name in known]
        if not own:
            raise InputError(f"the interface of {self.name} has no temperature of its own. Ask for {self.name}['T_1'].")
        return self[own[0]]

    def body(self, name: str) -> Any:
        """Return a reservoir with the temperature of a body, or of 'interface', for walls that exchange heat with it.

        Parameters
        ----------
        name
            The body, or 'interface'.

        Returns
        -------
        cantera.Reservoir
            The reservoir on which to put walls.

        Raises
        ------
        InputError
            Where nothing of that name stores heat, or the network has run.
        """
        case = self.scene.case
        if name not in self.ports:
            self._refuse_late(f"a wall on {name}")
            node = node_of(case.scene, name)
            if node not in self.scene.states:
                raise InputError(f"{node} stores no heat, so a wall cannot give it any. Put the wall on a body.")
            port = BodyPort.of(name, node, f"Q_{suffix_of(case.scene, name)}")
            scene = EmbeddedScene(case, self.bodies, [*self.ports, name], self.loads, self.neighbours)
            self.ports[name] = port
            self._set_scene(scene)
            self.put(self.start())
            self._dated = True
        return self.ports[name]

    def load(self, name: str, function: Callable[[float], float] | float | str) -> None:
        """Set a load to a function of time [s] or a constant, in place of one that the case prescribes.

        Where it jumps, end an ``advance`` there and call ``reinitialize`` on the network.

        Parameters
        ----------
        name
            Any load that acts by its present value: ``p``, ``F_n``, ``F_t``, ``f``, ``Q_1`` and the like, and the
            current into an electrode that holds charge, ``j_electron``.
        function
            Its value in SI at a time [s]; or a number in SI or a text with a unit, at all times.

        Raises
        ------
        InputError
            For any other name or a load given already, or after the network has run.
        """
        given = function_of(self.scene.case.scene, name, function)
        self._set_scene(self._loaded(name, given))
        self.loads[name] = given

    def _loaded(self, name: str, function: Callable[[float], float]) -> EmbeddedScene:
        """Return the scene with another load."""
        self._refuse_late(f"the load {name}")
        if name in self.loads:
            raise InputError(f"the load {name} of {self.name} is given already, by `load` or by `press`: give it once.")
        loads = {**self.loads, name: function}
        return EmbeddedScene(self.scene.case, self.bodies, self.ports, loads, self.neighbours)

    def press(self, gas: Any, outside: Any) -> None:
        """Let a reactor press the gap open against another one, ``outside``, and expand as the gap opens.

        The load ``F_n`` is the difference of their pressures, and a wall between them moves with the gap, so that the
        energy that the gas loses is work on the interface and on the outside.

        Parameters
        ----------
        gas, outside
            Reactors on either side; pressures in Pa, the wall between them has the area of the interface, also later.

        Raises
        ------
        InputError
            Where the gap has no rate of its own, where F_n is given already, or where edges of the scene depend on
            F_n: they would be located at pressures of the past.
        """
        if "g_n" not in self.scene.states:
            raise InputError("a reactor presses on a gap that has a rate of its own: give it a damper or a mass.")
        push = lambda _: gas.phase.P - outside.phase.P  # noqa: E731
        scene = self._loaded("F_n", push)
        if edge := scene.edge_that_reads("F_n"):
            problem = f"{edge} depends on the load of the gap, which a reactor gives at the ends of steps"
            raise InputError(f"{problem}. Prescribe F_n.")
        self._set_scene(scene)
        self.loads["F_n"], self.pressing = push, (gas, outside)
        gap = scene.states.index("g_n")
        rate = lambda t: float(self._rates_for_others(t)[gap])  # noqa: E731
        self._walls.append(HeatWall(gas, outside, interface=self, A=self.area, velocity=rate))

    def _refuse_late(self, what: str) -> None:
        if self.evaluations:
            raise InputError(f"{what} comes too late: put it there before the network runs.")

    # -- the network's view -------------------------------------------------------------------------------------------

    def replace_initialize(self, start: float) -> None:
        super().replace_initialize(start)
        self.restarted = start
        if start != self.t:
            self.begin_segment(start, 0.0)

    def start(self) -> Array:
        return np.asarray(self.x / self.unit)

    def put(self, x: Array) -> None:
        self.x, self._current, self._dated, self._is_set = x * self.unit, False, False, True
        for port in self.ports.values():
            port.warm(float(self.x[self.scene.states.index(port.node)]))

    def rates(self, t: float) -> Array:
        began = time.perf_counter()
        if self._is_perturbed and self._current:
            problem = f"others have asked {self.name} for rates before Cantera has told it which of them it varies"
            remedy = f"Give {self.name} to the network before the reactors that take from it."
            raise InputError(f"{problem}, so sensitivities would be wrong. {remedy}")
        if not self.passes_breakpoints:
            # Refuse a time beyond a breakpoint, where the equations are others.
            breakpoints = self.scene.breakpoints
            following = bisect_right(breakpoints, self.t)
            if following < len(breakpoints) and t > breakpoints[following]:
                problem = f"at t = {breakpoints[following]:g} s, which an ordinary ReactorNet steps over"
                raise InputError(f"the loading has a breakpoint {problem}. Use surfacechem.reactor.ReactorNet.")
        rates = np.asarray(self._rates(t) / self.unit)
        if not self.passes_breakpoints and self.scene.events is not None:
            # Refuse a state beyond an edge that no network has carried out.
            edges = self.scene.model.system.edges
            passed = [edges[i].reason for i in np.flatnonzero(self.scene.events.margins() < 0)]
            if passed:
                reasons = "; ".join(dict.fromkeys(passed))
                problem = f"the scene jumps ({reasons}), which an ordinary ReactorNet does not follow"
                raise InputError(f"{problem}. Use surfacechem.reactor.ReactorNet.")
        self.evaluations += 1
        self.seconds += time.perf_counter() - began
        return rates

    def _rates(self, t: float) -> Array:
        """Return the rates [SI per s] for the values set last; if there are none, the integrator backs off."""
        # All reactors of a network are set before it asks for rates.
        if self._current and self._last is not None and self._last[0] == t:
            return self._last[2]
        asked = t, self.x[: len(self.scene.states)].tobytes(), self.inputs_at(t)
        # The integrator differentiates by every variable, and most of them are lines of the ledger.
        if asked == self._last_inputs and self._last is not None:
            self._current = True
            return self._last[2]
        # Steps as short as the rounding of the time, other than after a start, lead nowhere.
        since = t - self.restarted
        if self._last is not None and 0 < t - self._last[0] <= 2 * FEW_EPS * abs(t) and since > RUN_EPS * abs(t):
            raise self._stopped(f"{self.scene.closest(self._last[0], self._last[1])} near t = {t:.9g} s")
        try:
            rates = self.scene.rates(t, self.x)
        except EndError as end:
            stop = f"{end} at t = {t:.9g} s"
            if self._last is None or abs(t - self._last[0]) <= RUN_EPS * abs(t):
                raise self._stopped(stop) from None
            raise self.error or BackOffError(stop) from None
        self._last, self._last_inputs, self._current = (t, self.x, rates), asked, True
        return rates

    def _rates_for_others(self, t: float) -> Array:
        """Return the rates for another reactor; InputError if this one is not in the network, so has no variables."""
        if not self._is_set and t != self._asked_at:
            raise InputError(self.left_out("a reactor"))
        self._is_set, self._asked_at = False, t
        return self.attempt(self._rates, t)

    def others(self) -> Iterator[tuple[str, Any]]:
        """Yield role and reactor for each connected one: in place of a body, next to it, or behind a wall."""
        for body, reactor in self.bodies.items():
            yield f"stands for the body {body}", reactor
        for name, reactor in self.neighbours.items():
            yield f"is the neighbour {name}", reactor
        for reactor in self.pressing:
            yield "presses on the gap", reactor
        for name, port in self.ports.items():
            for reactor in port.others():
                yield f"has a wall to {name}", reactor

    def left_out(self, partner: str) -> str:
        """Return the message on a network that has a partner of the interface, but not the interface."""
        problem = f"the interface {self.name} to which {partner} is connected is not in the network"
        reason = "so what it gives and takes would never change: give it to the network too"
        return f"{problem}, {reason}. Where another interface has replaced it, make the reactor anew with that."

    def _stopped(self, reason: str) -> InterfaceStopped:
        """Return the end of the scene, which is also stored, since Cantera loses exceptions."""
        self.reason, self.error = reason, InterfaceStopped(reason)
        return self.error

    def inputs_at(self, t: float) -> object:
        """Return everything that the rates at a time [s] depend on besides the variables."""
        return self.area, self._read_network(), [f(t) for f in self.loads.values()]

    def _read_network(self) -> bytes:
        """Read temperatures, heats, multipliers and compositions from the network, and return them as bytes."""
        around = [reactor.T for reactor in self.bodies.values()]
        around += [port.heat() / self.area for port in self.ports.values()]
        multipliers = self.surface.forward_rate_constants[: len(self.scene.reactions)]
        neighbours = [item.state() for item in self.scene.neighbours]
        inputs = np.concatenate([around, multipliers, *neighbours] if around else [multipliers, *neighbours])
        self.scene.evaluation.parameters[self._input_columns] = inputs
        return inputs.tobytes()

    def _paths(self) -> Iterator[int]:
        """Yield the indices of these values among the scene's parameters, in the order of ``_read_network``."""
        names = [f"T_{suffix_of(self.scene.case.scene, name)}" for name in self.bodies]
        names += [port.heat_name for port in self.ports.values()]
        paths = [f"loading.{name}.level" for name in names]
        paths += [f"multiplier.{label}" for label in self.scene.reactions]
        yield from (self.scene.places[path] for path in paths)
        for item in self.scene.neighbours:
            yield from item.places

    def temperatures(self) -> Iterator[tuple[int, Any]]:
        """Yield the places among the scene's parameters of temperatures that reactors give it, and these reactors."""
        yield from zip(self._input_columns.tolist(), self.bodies.values(), strict=False)

    def transitions(self, t: float) -> Array:
        """Return the guards of the transitions in the present network at a time [s]."""
        self._read_network()
        return self.scene.transitions(t, self.x)

    def parameters_at(self, t: float) -> Array:
        """Return the parameters of the scene at a time [s], from the present network."""
        self._read_network()
        self.scene.set_loads(t)
        return self.scene.evaluation.parameters.copy()

    def combined(self, t: float) -> Array:
        """Return how its accounts follow from its states near the present ones: [state, account]."""
        self.parameters_at(t)
        loads = [self.scene.places[path] for path in self.scene.loads]
        return self.scene.combined(t, self.x, [*self._input_columns, *loads])

    @cached_property
    def received(self) -> NDArray[np.bool_]:
        """Mask of the accounts of what reactors in the place of a body, or next to the surface, receive."""
        accounts = (*self.scene.states, *self.scene.accounts)
        indices = [*self._accounts.values(), *chain(*(item.accounts for item in self.scene.neighbours))]
        names = {accounts[i] for i in indices} | ({"H_neighbours"} if self.neighbours else set())
        names |= {f"{name}_entropy" for name in names}  # carried by the same sum
        return np.array([name in names for name in self.scene.accounts], dtype=bool)

    def book(self, x: Array, gain: Array, combined: Array) -> None:
        """Add to the ledger what it gains up to the variables ``x``, from the integrals of all rates.

        Accounts that follow from the states change as these do, whose integrals differ by the error of a step. Those of
        what another reactor receives change as the integrator's, lest anything is lost between the two.
        """
        count, change = len(self.scene.states), x - self.booked_at
        gained = gain[count:] + (change - gain)[:count] @ combined
        self.ledger = self.ledger + np.where(self.received, change[count:], gained)
        self.booked_at = x

    def begin_segment(self, t: float, rtol: float) -> None:
        """Set the load segments that begin at time t [s], at a relative tolerance."""
        self.t, self._last_inputs, self._current, self._dated = t, None, False, True
        self.scene.begin_segment(t, rtol)

    def jump(self, t: float, index: int | None = None) -> None:
        """Carry out a transition at time t [s], or the due ones if None, and keep the new state."""
        self._read_network()
        try:
            self.x, booked = self.scene.moved(t, self.x, index)
            jumps = self.scene.events.instant.jumps if self.scene.events else []
            if self.bodies and any(jump.heat_out for jump in jumps if jump.t == t):
                names = ", ".join(self.bodies)
                jump = f"the jump at t = {t:.9g} s gives heat at once to bodies without a capacity of their own"
                problem = f"{jump}, and reactors stand for {names}: a reactor takes heat in time only"
                remedy = "Give the body a heat capacity, and put a wall between it and the reactor."
                raise InputError(f"{problem}. {remedy}")
            self.ledger, self.booked_at = self.ledger + booked, self.x
        except EndError as end:
            raise self._stopped(f"{end} at t = {t:.9g} s") from None
        self._last, self._last_inputs, self._current = None, None, False
        for port in self.ports.values():
            port.warm(float(self.x[self.scene.states.index(port.node)]))

    def end(self) -> None:
        """Return to the last state before the end of the scene, and record it."""
        if self._last is not None:
            t, self.x, _ = self._last
            self.record(t)

    # -- results ------------------------------------------------------------------------------------------------------

    __iter__ = None  # lest Python asks for the quantities 0, 1, 2

    def __getitem__(self, name: str) -> float:
        """Return the present value, in SI units, of a state or of a named quantity of the scene.

        InputError in an ordinary ReactorNet, which does not pass the time, if the scene has a history and was not
        recorded.
        """
        if self.scene.varies and not self._dated and name not in self.scene.states:
            problem = f"an ordinary ReactorNet does not say at what time {name} is wanted"
            remedy = "Call `interface.record(net.time)` first, or use surfacechem.reactor.ReactorNet."
            raise InputError(f"{problem}, and histories of the scene vary. {remedy}")
        self._read_network()
        return self.scene.quantity(name, self.t, self.x)

    @property
    def seconds_per_rate(self) -> float:
        """Mean time of one evaluation of the rates [s], including the values from the network."""
        return self.seconds / max(self.evaluations, 1)

    @property
    def coupled(self) -> bool:
        """True if any value comes from the network or the script."""
        return bool(self.bodies or self.ports or self.loads or self.neighbours)

    def record(self, t: float) -> None:
        """Record the present state for the dataset; a `ReactorNet` of this package does so at every advance and step.

        Parameters
        ----------
        t
            Time [s].
        """
        self.t, self._dated = t, True
        self._read_network()
        n = len(self.scene.states)
        self.history.append(t, np.concatenate((self.x[:n], self.ledger + (self.x - self.booked_at)[n:])))

    @property
    def dataset(self) -> xarray.Dataset:
        """Dataset of the recorded history, with the variables and attributes of a run."""
        return self.history.solution(self.reason, self.seconds, alone=not self.coupled).dataset
