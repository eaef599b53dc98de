"""A scene in a reactor network: assembled, compiled and evaluated with values from the network.

Its recorded history becomes a solution like that of a run.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from surfacechem.errors import InputError, refuse_unknown
from surfacechem.expressions import depends
from surfacechem.format import Case
from surfacechem.mechanism.evaluated import HeldPhase
from surfacechem.model.assemble import assemble
from surfacechem.model.system import END_PATH, System
from surfacechem.quantities import MOLECULAR
from surfacechem.reactor import coupling
from surfacechem.results.solution import Solution
from surfacechem.solve.adapters.evaluation import Evaluation, Evaluations
from surfacechem.solve.contract import Array, Counters, Events, Problem, Result, Status
from surfacechem.solve.diagnose import STALLED, no_number
from surfacechem.solve.equilibria import Point
from surfacechem.solve.instant import Instant
from surfacechem.solve.run import Model, Run, Trajectory
from surfacechem.tolerances import DEFAULT_RTOL, NEGLIGIBLE, SQRT_EPS, TINY

NO_SHORTER = "the step size fell to rounding level; the scene may end"
"""Reason for the end of a scene that no limit explains."""

NO_END = 1e300
"""End of the last load segment [s]."""

ASSUMED_LENGTH = 1.0
"""Length of an integration that is assumed if no end is given [s]."""

NONE: Mapping[str, Callable[[float], float]] = {}

GLOBAL_ERROR = 100
"""Ratio by which the error of a state may exceed the tolerance of a step."""

NEARBY, SPARE_SAMPLES = 0.1, 8
"""Largest relative change of random states, a choice, and samples beside two for each state: what is no fixed
combination of rates would be one at all of them by chance only."""

ROUNDED_COMBINATION = NEGLIGIBLE * SQRT_EPS
"""Part of a rate that a fixed combination of others may leave: roundoff leaves less, and what is curved leaves more."""

DIFFERENCE_STEPS = 8 * SQRT_EPS
"""A few of the finite-difference steps of Cantera's integrator, which bounds must tolerate."""


class NeighbourReactor(NamedTuple):
    """A reactor next to the surface, with the indices of its variables in the scene."""

    reactor: Any
    held: HeldPhase
    """Its phase, held at the temperature of the surface."""
    places: NDArray[np.int64]
    """Indices of its pressure and mole fractions among the parameters."""
    species: NDArray[np.int64]
    """Indices of the species that reactions produce."""
    accounts: NDArray[np.int64]
    """Indices of the variables that hold the amount of each."""

    def state(self) -> Array:
        """Return its present pressure and mole fractions."""
        phase, found = self.reactor.phase, np.empty(len(self.places))
        found[0] = phase.P
        if len(found) > 1:
            found[1:] = phase.X
        return found

    def given(self, rates: Array, area: float) -> tuple[Array, float]:
        """Return amounts of all species [kmol/s] and enthalpy [W] that reactions on an area give.

        ``rates`` are those of the variables of the scene.
        """
        amounts = np.zeros(len(self.held.enthalpies))
        amounts[self.species] = rates[self.accounts] * (area / MOLECULAR)
        return amounts, float(amounts @ self.held.enthalpies)


class InstantEvents:
    """Events of a scene whose arcs are integrated elsewhere: due edges, event functions, and jumps."""

    def __init__(self, model: Model, problem: Problem, evaluation: Evaluation) -> None:
        assert model.jumper is not None
        self.system, self.jumper = model.system, model.jumper
        self.instant = Instant(model.jumper, problem)
        self.evaluation = evaluation
        """Present state and parameters of the scene."""
        self.loads: Array | None = None
        """Parameters of the load segment that has just ended."""

    def until(self, goal: float, rtol: float) -> None:
        """Set the end of the next integration, relative to which times are brief, and the tolerance."""
        self.instant.end, self.instant.rtol = goal, GLOBAL_ERROR * rtol

    def begin_segment(self, parameters: Array) -> None:
        """Set the parameters of a new load segment; the modes stay."""
        own, columns = self.evaluation.parameters, self.jumper.mode_columns
        modes, self.loads = own[columns].copy(), own.copy()
        own[:] = parameters
        own[columns] = modes

    def here(self) -> Point:
        """Return the state set last."""
        at = self.evaluation
        return Point(float(at.inputs[0]), at.y.copy(), at.ydot.copy(), at.parameters.copy())

    def margins(self) -> Array:
        """Return the guards of the edges at the state set last, infinite if not active."""
        self.instant.update_peaks(self.evaluation.y)
        return self.active(self.evaluation.margins())

    def active(self, margins: Array) -> Array:
        """Return the guards of the edges among margins of shape (..., margins), infinite if not active in the modes."""
        active = self.system.active_guards(self.evaluation.parameters)
        return np.where(active, margins, np.inf)[..., self.instant.first :]

    def soonest(self) -> float:
        """Return the time [s] in which a guard would reach zero at its present rate."""
        now, rates = self.margins(), self.jumper.guard_rates(self.here().inputs())
        with np.errstate(divide="ignore", invalid="ignore"):
            left = np.where((now > 0) & (rates < 0), -now / rates, np.inf)
        return float(left.min(initial=np.inf))

    def resolve(self, index: int | None) -> Array | None:
        """Carry out an edge, if any is given, at the state set last, and all edges that are due then.

        Return what they add to the ledger, None if the scene ends.
        """
        before, here, loads = self.instant.ledger.copy(), self.here(), self.loads
        begun: Point | None = here
        if index is not None:
            begun = self.instant.apply(index, here)
        elif loads is not None:
            histories = [parameter.load is not None for parameter in self.system.parameters]
            last = here._replace(parameters=np.where(histories, loads, here.parameters))
            begun, self.loads = self.instant.begin(here, last), None
        point = self.instant.resolve(begun) if begun is not None else None
        if point is None:
            return None
        self.evaluation.parameters[:] = point.parameters
        self.evaluation.restart(point.y)
        return self.instant.ledger - before


class EndError(Exception):
    """The scene ends at a state, with the reason in words."""


def _refuse_folds(system: System) -> None:
    if any(item.fold is not None for item in system.edges):
        problem = "the gap may lose its quasi-static equilibrium, in a mechanical fold"
        reason = "There it is infinitely fast, so that an integrator without our search cannot come near"
        raise InputError(f"{problem}. {reason}. Give the gap a damper or a mass, or run the case alone.")


class EmbeddedScene:
    """The scene of a case with values from the network: temperatures of reactors, heat, factors on its rates.

    The variables are the differential states and then the ledger, in SI units per area; the parameters are those of
    the present load segment.
    """

    def __init__(
        self,
        case: Case,
        reactors: Mapping[str, Any],
        heated: Iterable[str] = (),
        loads: Mapping[str, Callable[[float], float]] = NONE,
        neighbours: Mapping[str, Any] | None = None,
    ) -> None:
        self.case = case
        self.loads = {f"loading.{name}.level": function for name, function in loads.items()}
        self._asks = False
        """Whether loads are asked for their values."""
        with case.locating():
            scene = coupling.with_heat(coupling.with_reactors(case.scene, reactors), heated)
            scene = coupling.with_loads(scene, {name: function(0.0) for name, function in loads.items()})
            scene = coupling.with_neighbours(scene, neighbours or {})
            system = assemble(scene).with_multipliers()
            _refuse_folds(system)
            self.places = {parameter.path: j for j, parameter in enumerate(system.parameters)}
            """Indices of the parameters, by path."""
            unread = [name for name, path in zip(loads, self.loads, strict=True) if path not in self.places]
            if unread:
                raise InputError(f"nothing of the scene reads the load {unread[0]}.")
            self.reactions = system.reactions
            self.model = Model(system)
            self.values = self.model.values()
            self.problem = self.model.problem(Run(times=(0.0, NO_END)), self.values, passing=False)
        self.evaluation = Evaluation(self.problem.program, self.problem.y0, self.problem.parameters[0])
        self._evaluations = Evaluations(self.problem.program, self.evaluation.parameters)
        self.events: InstantEvents | None = None
        self.begin_segment(0.0, DIFFERENCE_STEPS)
        self.events = InstantEvents(self.model, self.problem, self.evaluation) if self.model.jumper else None
        self._terminal = np.array([margin.terminal for margin in self.model.margins], dtype=bool)
        self.states = tuple(system.states[j].name for j in self.evaluation.free)
        self.neighbours = [self._neighbour(scene.interface.engine, *item) for item in (neighbours or {}).items()]
        """The reactors next to the surface."""

    def _neighbour(self, engine: Any, name: str, reactor: Any) -> NeighbourReactor:
        held = next(held for held in engine.held if held.phase.name == name)
        made = {species: f"made_{part}" for species, part in engine.made_in(held.phase).items()}
        return NeighbourReactor(
            reactor=reactor,
            held=held,
            places=np.array([self.places[f"loading.{quantity.name}.level"] for quantity, _ in held.taken_over]),
            species=np.array([held.phase.species_index(species) for species in made], dtype=np.int64),
            accounts=np.array([len(self.states) + self.accounts.index(name) for name in made.values()], dtype=np.int64),
        )

    def start(self) -> Array:
        """Return the initial values of the variables."""
        ledger = np.zeros(self.problem.program.n_ledger)
        return np.concatenate((self.problem.y0[self.evaluation.free], ledger))

    @cached_property
    def varies(self) -> bool:
        """True if anything depends explicitly on time."""
        system = self.model.system
        return bool(system.moving) or any(depends(row, system.t) for row in system.rows.values())

    @property
    def accounts(self) -> tuple[str, ...]:
        """Names of the ledger's lines."""
        return tuple(account.quantity.name for account in self.model.system.ledger)

    def edge_that_reads(self, load: str) -> str:
        """Return the name of an edge whose guard contains a load; empty if none does."""
        system = self.model.system
        symbol = system.parameters[self.places[f"loading.{load}.level"]].symbol
        return next((edge.name for edge in system.edges if depends(system.expand(edge.guard), symbol)), "")

    def account(self, name: str) -> int:
        """Return the index among the variables of the heat that a replaced body needs to keep its temperature."""
        wanted = f"H_T_{coupling.suffix_of(self.case.scene, name)}"
        if wanted not in self.accounts:
            message = f"no heat flows into {name}, so no reactor can take its place. Give it a path under `heat`."
            raise InputError(message)
        return len(self.states) + self.accounts.index(wanted)

    def put(self, t: float, x: Array) -> bool:
        """Set time, variables and the loads of that time; return whether a consistent state was found."""
        self.set_loads(t)
        return self.evaluation.put(t, x[: len(self.states)])

    def set_loads(self, t: float) -> None:
        """Set the loads of a time; each is asked for its value."""
        if self._asks:
            raise InputError("a load asks for what follows from the loads. Let it read states only.")
        self._asks = True
        try:
            for path, function in self.loads.items():
                self.evaluation.parameters[self.places[path]] = function(t)
        finally:
            self._asks = False

    def rates(self, t: float, x: Array) -> Array:
        """Return the time derivatives of the variables; EndError if there are none, or if a limit is passed."""
        evaluation = self.evaluation
        if not self.put(t, x):
            odd = no_number(self.model.system, self.model.output_function(evaluation.inputs))
            raise EndError(odd or "no state satisfies the equations")
        margins = evaluation.margins()[: len(self._terminal)]
        if len(margins) and not margins[margins.argmin()] >= 0:  # argmin finds NaN, if any
            closed = self._terminal & ~(margins >= 0)
            if closed.any():
                closed &= self.model.system.active_guards(evaluation.parameters)[: len(closed)]
            if closed.any():
                raise EndError(self.model.margins[int(closed.argmax())].reason)
        return evaluation.rates()

    def closest(self, t: float, x: Array) -> str:
        """Return the reason for the end if the integrator cannot go on: that of the limit that came closest."""
        evaluation, start = self.evaluation, self.start()
        self.put(0.0, start)
        terminal = np.flatnonzero(self._terminal)
        before = evaluation.margins()[terminal]
        self.put(t, x)
        left = np.abs(evaluation.margins()[terminal]) / np.maximum(np.abs(before), TINY)
        if not len(left) or left.min() > STALLED:
            return NO_SHORTER
        return self.model.margins[int(terminal[left.argmin()])].reason

    def quantity(self, name: str, t: float, x: Array) -> float:
        """Return a state or a named quantity in SI units."""
        if name in self.states:  # which a load may read
            return float(x[self.states.index(name)])
        evaluation, system = self.evaluation, self.model.system
        self.put(t, x)
        found = dict(zip((state.name for state in system.states), evaluation.y, strict=True))
        if name in found:
            return float(found[name])
        refuse_unknown([name], [*system.output_columns, *found], "the scene has no quantity '{}'")
        return float(self.model.output_function(evaluation.inputs)[system.output_columns[name]])

    @cached_property
    def breakpoints(self) -> tuple[float, ...]:
        """Times [s] at which a history or its slope jumps."""
        return tuple(float(t) for t in self.problem.segments[1:-1])

    def begin_segment(self, t: float, rtol: float) -> None:
        """Set the load segments that begin at time t [s]; bounds get slack for the tolerance."""
        run = Run(times=(0.0, NO_END), rtol=max(rtol, DIFFERENCE_STEPS))
        table = self.model.problem(run, self.values, passing=False).parameters
        parameters = table[bisect_right(self.breakpoints, t)]
        if END_PATH in self.places:  # what is brief in a run; a network has no end
            own = self.case.own_run
            parameters[self.places[END_PATH]] = own.times[-1] if own else ASSUMED_LENGTH
        if self.events:
            self.events.begin_segment(parameters)
        else:
            self.evaluation.parameters[:] = parameters

    def transitions(self, t: float, x: Array) -> Array:
        """Return the guards of the transitions at a time and variables."""
        if self.events is None:
            return np.zeros(0)
        self.put(t, x)
        return self.events.margins()

    def _many(self, times: Array, x: Array, parameters: Array) -> tuple[Array, Array, Array, Array]:
        """Return states, rates, rates of the ledger and margins at several times, a row each."""
        y = np.empty((len(times), self.problem.program.n))
        y[:] = self.evaluation.y  # algebraic variables are searched from the last ones
        y[:, self.evaluation.free] = x[:, : len(self.states)]
        return self._evaluations(times, y, parameters)

    def many_rates(self, times: Array, x: Array, parameters: Array) -> Array:
        """Return the time derivatives of the variables at several times, a row each; so may be the parameters."""
        _, ydot, ledger, _ = self._many(times, x, parameters)
        return np.hstack((ydot[:, self.evaluation.free], ledger))

    def many_transitions(self, times: Array, x: Array, parameters: Array) -> Array:
        """Return the guards of the transitions at several times, a row each; so may be the parameters."""
        assert self.events is not None
        return self.events.active(self._many(times, x, parameters)[3])

    def _sizes(self, x: Array) -> Array:
        """Return magnitudes of the states, or their scales if these are larger."""
        scales = np.array([state.size for state in self.model.system.states])
        return np.asarray(np.maximum(np.abs(x[: len(self.states)]), scales[self.evaluation.free]))

    def soonest_change(self, t: float, x: Array, rtol: float) -> float:
        """Return the time [s] in which a state changes by a relative tolerance, at the present rates."""
        rates = self.many_rates(np.array([t]), x[None], self.evaluation.parameters)[0, : len(self.states)]
        with np.errstate(divide="ignore", over="ignore"):
            return float(np.nanmin(rtol * self._sizes(x) / np.abs(rates), initial=np.inf))

    def combined(self, t: float, x: Array, given: Sequence[int]) -> Array:
        """Return how the accounts follow from the states: [state, account], zero for those that do not.

        The rates of some are fixed combinations of those of the states, such as of bonds or, with constant heat
        capacities, of heat. That shows in the rates at random states about the present ones, times before the next
        breakpoint and parameters ``given`` by the network.
        """
        count, random = len(self.states), np.random.default_rng(0)
        samples = 2 * count + SPARE_SAMPLES
        about = x[:count] + NEARBY * random.random((samples, count)) * self._sizes(x)
        # Any length before the next breakpoint will do: rates that histories change are no fixed combination in it.
        following = min((b for b in self.breakpoints if b > t), default=np.inf)
        times = t + random.random(samples) * min(following - t, 1.0)
        parameters = np.repeat(self.evaluation.parameters[None], samples, axis=0)
        changes = NEARBY * random.random((samples, len(given)))
        parameters[:, given] += changes * np.where(parameters[0, given] != 0, np.abs(parameters[0, given]), 1.0)
        rates = self.many_rates(times, about, parameters)
        rates = rates[np.isfinite(rates).all(axis=1)]
        if len(rates) < count + SPARE_SAMPLES:
            return np.zeros((count, rates.shape[1] - count))
        largest = np.abs(rates).max(axis=0)
        sizes = np.where(largest > TINY, largest, 1.0)
        states, accounts = np.split(rates / sizes, [count], axis=1)
        # The rate of one state alone is found exactly, though reactions that are fast both ways dominate at random
        # states.
        most = np.abs(states).argmax(axis=0)
        alone = accounts[most] * np.sign(np.diag(states[most]))[:, None]
        rest = np.array([np.abs(accounts - np.outer(*pair)).max(axis=0) for pair in zip(states.T, alone, strict=True)])
        serves = (np.arange(len(rest))[:, None] == rest.argmin(axis=0)) & (rest < ROUNDED_COMBINATION)
        alone = np.where(serves, alone, 0.0)
        # States that follow from others, such as the last coverage, would share their part, with their roundoff.
        states = np.where(np.abs(np.diag(np.linalg.qr(states).R)) < ROUNDED_COMBINATION, 0.0, states)
        found = np.linalg.lstsq(states, accounts)[0]
        fits = np.abs(states @ found - accounts).max(axis=0) < ROUNDED_COMBINATION
        found[np.abs(found) < ROUNDED_COMBINATION] = 0.0
        found = np.where(alone.any(axis=0), alone, np.where(fits, found, 0.0))
        return np.asarray(found * sizes[count:] / sizes[:count, None])

    def moved(self, t: float, x: Array, index: int | None) -> tuple[Array, Array]:
        """Return the variables after a transition, or after the due ones if None, and the additions to the ledger.

        EndError if the scene ends with it.
        """
        assert self.events is not None
        self.put(t, x)
        booked = self.events.resolve(index)
        if booked is None:
            raise EndError(self.events.instant.reason)
        states = self.evaluation.y[self.evaluation.free]
        return np.concatenate((states, x[len(self.states) :] + booked)), booked


class History:
    """Recorded states of a scene, each with the parameters at that time."""

    def __init__(self, scene: EmbeddedScene) -> None:
        self.scene = scene
        self.rtol = DEFAULT_RTOL
        self.counters = Counters()
        self.times: list[float] = []
        self.rows: list[tuple[Array, Array, Array, Array]] = []

    def append(self, t: float, x: Array) -> None:
        """Record variables at a time, unless that is the last one; InputError before it."""
        if self.times and t <= self.times[-1]:
            if t < self.times[-1]:
                when = f"at t = {t:g} s, but has been recorded up to t = {self.times[-1]:g} s"
                remedy = "Set `initial_time` of a new network, or make the interface anew."
                raise InputError(f"the interface is {when}. {remedy}")
            return
        evaluation, n = self.scene.evaluation, len(self.scene.states)
        self.scene.put(t, x)
        self.times.append(t)
        self.rows.append((evaluation.y.copy(), evaluation.ydot.copy(), x[n:].copy(), evaluation.parameters.copy()))

    def solution(self, stop: str, seconds: float, *, alone: bool) -> Solution:
        """Return the recorded states as a solution, ended by ``stop`` if that is not empty.

        Only the solution of a scene that ran ``alone`` contains its case, from which it can be rerun.
        """
        if len(self.times) < 2:
            raise InputError("nothing was recorded yet: advance the network, or call `record`, at least twice.")
        end = max(self.times[-1], self.times[-1] - self.times[0])  # a network may begin before zero
        run = Run(times=(0.0, end), rtol=self.rtol, solver="cantera")
        reason = stop or f"reached the end at t = {self.times[-1]:.9g} s"
        status = "stopped" if stop else "finished"
        result = self._result(Status.EVENT if stop else Status.FINISHED)
        case, events = self.scene.case, self.scene.events
        jumps = tuple(events.instant.jumps) if events else ()
        return Solution(
            Trajectory(self.scene.model, run, result, self.scene.values, status, reason, seconds, jumps),
            title=case.title,
            source=case.source,
            case=case.text if alone else "",
            mechanism=case.mechanism_text or "",
            surface=case.scene.surface,
        )

    def _result(self, status: Status) -> Result:
        base, times = self.scene.problem, np.array(self.times)
        before = times[0] - max(1.0, abs(times[0]))
        problem = Problem(
            program=base.program,
            y0=self.rows[0][0],
            times=times,
            segments=np.concatenate(([before], times)),  # up to each record one, with its parameters
            parameters=np.array([row[3] for row in self.rows]),
            rtol=self.rtol,
            atol=base.atol,
            margins=base.margins,
        )
        y, ydot, ledger, _ = self.rows[-1]
        n, q = problem.program.n, problem.program.n_ledger
        none = Events(*(np.empty(shape) for shape in (0, (0, n), (0, n), (0, q))), index=np.empty(0, np.int64))
        return Result(
            problem=problem,
            status=status,
            t=self.times[-1],
            y=y,
            ydot=ydot,
            ledger=ledger,
            margins=np.zeros(problem.program.n_margins),
            times=problem.times,
            outputs=np.array([row[0] for row in self.rows]),
            ledger_outputs=np.array([row[2] for row in self.rows]),
            events=none,
            counters=self.counters,
        )
