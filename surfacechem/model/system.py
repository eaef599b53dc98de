"""The assembled scene: states, equations, ledgers, margins and named quantities as one graph of expressions."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from pickle import PicklingError
from typing import Any, TypeVar

import numpy as np
import symengine
from numpy.typing import NDArray

from surfacechem.contracts.terms import Load, Spec
from surfacechem.contracts.units import TOTAL_UNITS
from surfacechem.expressions import Expression, depends, without
from surfacechem.model.automaton import Edge, Equilibrium, Mode, Register, Sink, When, masked
from surfacechem.quantities import GAPS, VELOCITIES, Quantity
from surfacechem.scene import Engine

Array = NDArray[np.float64]

STABLE_PREFIX = "stable "
"""Prefix of the names of margins that tell a stable state from an unstable one."""

START = "run.t_start"
"""Path of the time at which a stretch between events starts; within it time counts from there."""

DUMMY_STATE = "no_state"
"""Name of the state, always zero, of a scene in which all is prescribed, since solvers need at least one."""

RTOL_PATH = "run.rtol"
"""Path of the relative tolerance of a run, at which endless sequences of events are cut off."""


@dataclass(frozen=True)
class Parameter:
    """A run-time number of the compiled scene: a field of a law, or a local field of a history."""

    symbol: Any
    path: str
    spec: Spec
    value: float
    load: Load | None = None
    """The history whose pieces change the value, if any."""
    field: str = ""
    internal: bool = False
    """Whether it belongs to the solution method, so that no run may change it."""

    @property
    def changeable(self) -> bool:
        """Whether a run may give it another value."""
        return not self.internal and self.load is None

    def at(self, start: float) -> float:
        """Value on the piece of time that begins at ``start`` [s]."""
        return self.load.piece(start)[self.field] if self.load else self.value


@dataclass(frozen=True)
class Given:
    """Initial value of a quantity, given in place of that of a state, which is as a rule the quantity's logarithm."""

    quantity: Quantity
    value: float
    state: Callable[[Mapping[str, float]], float] | None = None
    """The state from all values by path, where it is not the logarithm."""


@dataclass(frozen=True)
class State:
    """A variable that the run solves for: evolved by a balance, or algebraic where that has no capacity."""

    quantity: Quantity
    initial: float
    scale: float
    algebraic: bool = False
    start: str = ""
    """Name of the variable whose initial value it takes, where not its own."""
    finest: float | None = None
    """Size below which it counts as none, relative to the absolute tolerance; its scale, where not given."""
    given: Given | None = None
    """The initial value given of the quantity that it stands for, if any."""
    is_temperature: bool = False

    @cached_property
    def symbol(self) -> Any:
        """Its symbol in the equations."""
        return symengine.Symbol(self.name)

    @cached_property
    def dot(self) -> Any:
        """The symbol of its time derivative."""
        return symengine.Symbol(f"d{self.name}_dt")

    @property
    def name(self) -> str:
        """Name in the dataset."""
        return self.quantity.name

    @cached_property
    def path(self) -> str:
        """Path of its initial value, or of the quantity given in its place."""
        return f"initial.{self.given.quantity.name if self.given else self.start or self.name}"

    @property
    def at_start(self) -> tuple[Quantity, float]:
        """The quantity given at the start, and its value."""
        return (self.given.quantity, self.given.value) if self.given else (self.quantity, self.initial)

    def from_given(self, values: Mapping[str, float]) -> float:
        """Its initial value, from given values by path."""
        if self.given is None:
            return values[self.path]
        return self.given.state(values) if self.given.state else math.log(values[self.path])


@dataclass(frozen=True)
class Named:
    """A named quantity; its expression may use the names of earlier ones."""

    quantity: Quantity
    expression: Expression
    output: bool = True

    @property
    def name(self) -> str:
        """Name in the dataset and in the printed source."""
        return self.quantity.name


def definitions(named: Sequence[Named]) -> dict[Any, Expression]:
    """Named expressions by name, expanded so that none contains another of these names."""
    result: dict[Any, Expression] = {}
    for item in named:
        result[symengine.Symbol(item.name)] = without(item.expression, result)
    return result


@dataclass(frozen=True)
class Account:
    """A line of the ledger, integrated beside the state.

    ``kind`` is 'energy supply', 'entropy supply', 'entropy production', 'dissipation', 'heat', 'bonds' or 'statistics';
    ``law`` names what it belongs to.
    """

    quantity: Quantity
    rate: Expression
    kind: str
    law: str = ""


@dataclass(frozen=True)
class Margin:
    """An event function that must stay positive. At its zero the run ends, or restarts if it is only a kink."""

    name: str
    expression: Expression
    reason: str
    terminal: bool = True
    remedy: str = ""
    """Advice on what to change where it is closed from the start."""
    path: str = ""
    """Path of the entry of a case that it belongs to."""
    stability: str = ""
    """The state whose stability it tells, if any."""
    peak: bool = False
    """Whether a step has to end here and no more, so that it does not pass over a peak; it is no event of the scene."""
    domain: bool = False
    """Whether a law ends there, so that no equilibrium lies beyond."""
    below: tuple[Expression, str] | None = None
    """An expression, and the reason where it is below zero as the margin closes."""
    bound: tuple[str, float] | None = None
    """The state whose bound it is, and the bound."""
    when: When = field(default_factory=dict)
    """Modes in which it is active."""
    at_start: bool = False
    """Whether it holds ever after if it holds at the start."""

    @property
    def masked(self) -> Expression:
        """The expression while the margin is active, else 1, as one expression to be read or printed."""
        return masked(self.expression, self.when)


@dataclass(frozen=True)
class Range:
    """Range of validity of a law in one variable, beyond which it is an extrapolation."""

    variable: str
    low: float
    high: float
    law: str


@dataclass(frozen=True)
class RatePair:
    """Rates forward and backward that are stated apart, held against equilibrium along a run.

    ``departure`` names the quantity ln(k_f/k_r) - ln K(g, T), ``law`` the account of the entropy they produce together.
    """

    departure: str
    title: str
    law: str


@dataclass(frozen=True)
class TimeScale:
    """Characteristic time of a free motion, with advice where it is too short for a run."""

    text: str
    time: Expression
    remedy: str


@dataclass(frozen=True)
class ExternalRates:
    """An engine with the expressions of what it reads."""

    engine: Engine
    reads: tuple[Expression, ...]


@dataclass(frozen=True)
class Role:
    """Role of a variable in this scene: evolved, algebraic, prescribed, constant, derived or merged."""

    variable: str
    role: str
    by: str


@dataclass(frozen=True)
class CappedLaw:
    """The exponents of a law, in words, above whose cap its exponentials go on along their tangents."""

    title: str
    exponents: tuple[Any, ...]


@dataclass(frozen=True)
class Caution:
    """Warning to be given where an expression falls below zero, at the start or along a run."""

    expression: Expression
    text: str


@dataclass(frozen=True)
class Profile:
    """Temperatures across a body, from the contact to the far side."""

    number: int
    body: str
    points: tuple[float, ...]
    """Places as fractions of the thickness."""
    thickness: str
    """Path of the thickness."""
    surface: str
    """Name of the temperature at the contact."""
    anchored: bool
    """Whether that is a state."""
    states: tuple[str, ...]
    """Names of the temperatures inside, in order."""
    far: str = ""
    """Name of the temperature at the far side where it is given."""
    after: float | None = None
    """Time after a sudden change from which on the cells have to resolve it, where the scene gives it."""

    @property
    def name(self) -> str:
        """Name in the dataset."""
        return f"profile_{self.number}"


@dataclass(frozen=True)
class Conductor:
    """Data of a body with a conductivity, to judge whether it may be one lump."""

    number: int
    body: str
    is_lump: bool
    resistance: Expression
    """L / k [m^2 K/W]."""
    capacity: Expression
    """Heat capacity of the whole body [J/(m^2 K)]."""
    conductance: Expression | None
    """Conductance of all paths at the contact [W/(m^2 K)]; None in perfect contact."""


Note = Range | CappedLaw | RatePair | TimeScale | Caution | Profile | Conductor

N = TypeVar("N", bound=Note)


@dataclass(frozen=True)
class System:
    """The assembled system: states, equations and everything that is derived from them.

    The equations are G(t, y, dy/dt; p) = 0, linear in dy/dt; ``rows`` names them. ``energy`` and ``entropy`` are the
    totals whose changes the ledger must explain.
    """

    t: Any
    states: tuple[State, ...]
    parameters: tuple[Parameter, ...]
    named: tuple[Named, ...]
    rows: Mapping[str, Expression]
    ledger: tuple[Account, ...]
    margins: tuple[Margin, ...]
    roles: tuple[Role, ...]
    regime: str
    breakpoints: tuple[float, ...]
    warnings: tuple[str, ...] = ()
    cycles: tuple[str, ...] = ()
    """Frequencies, by path, of loads under which the state may rest: their work still has to be followed."""
    modes: tuple[Mode, ...] = ()
    registers: tuple[Register, ...] = ()
    edges: tuple[Edge, ...] = ()
    equilibria: tuple[Equilibrium, ...] = ()
    sinks: Mapping[str, tuple[Sink, ...]] = field(default_factory=dict)
    """Sinks of the heat of a jump, by its origin: the interface, or the support of an axis."""
    follows: Mapping[str, Expression] = field(default_factory=dict)
    """New values of states that follow the normal gap where it jumps, by name."""
    given: Mapping[str, Expression] = field(default_factory=dict)
    """Tractions of the far field times their gaps [J/m^2], by account of the work."""
    pulls: Mapping[str, tuple[Expression, ...]] = field(default_factory=dict)
    """Stiffness [Pa/m], displacement [m] and traction [Pa] of the far field, and the gap [m], by the account of the
    work."""
    notes: tuple[Note, ...] = ()
    """Notes on what is watched along a run and reported where it matters; no equation depends on them."""
    conductances: Mapping[tuple[str, str], Sequence[Expression]] = field(default_factory=dict)
    """Conductances in parallel between two ends [W/(m^2 K)]."""
    outside: ExternalRates | None = None
    whole: bool = False
    """Whether what is per area elsewhere is that of a pair of bodies."""
    constants: Mapping[str, tuple[Spec, float]] = field(default_factory=dict)
    """Parameters of laws that are left at their defaults, by path: numbers in the equations, which no run may change
    unless they are assembled with another value."""
    origin: partial[System] | None = None
    """Call that assembles it anew, to the last bit: a pickle keeps this and no expressions."""

    def __reduce__(self) -> tuple[Any, ...]:
        """Expressions are not pickled but made again, in the same order."""
        if self.origin is None:
            raise PicklingError("a system that was not assembled from a scene cannot be pickled.")
        return self.origin.func, self.origin.args

    @cached_property
    def definitions(self) -> dict[Any, Expression]:
        """Every name with its expression in t, states, derivatives and parameters only."""
        return definitions(self.named)

    def expand(self, expression: Expression) -> Expression:
        """The expression in t, states, derivatives and parameters only."""
        return without(expression, self.definitions)

    def noted(self, kind: type[N]) -> tuple[N, ...]:
        """The notes of one kind."""
        return tuple(note for note in self.notes if isinstance(note, kind))

    @cached_property
    def profiles(self) -> tuple[Profile, ...]:
        """Temperatures across bodies; their states stand behind all others, profile after profile."""
        return self.noted(Profile)

    def unit(self, unit: str) -> str:
        """A unit per area, or that of the same for a pair of bodies."""
        return TOTAL_UNITS.get(unit, unit) if self.whole else unit

    @cached_property
    def changeable(self) -> dict[str, str]:
        """Units of all that a run may change, by path: parameters and initial values."""
        given = set(self.outside.engine.gives) if self.outside else set()
        units = {p.path: p.spec.unit for p in self.parameters if p.changeable and p.path not in given}
        return units | {state.path: state.at_start[0].unit for state in self.states}

    @property
    def inputs(self) -> list[Any]:
        """Arguments of every compiled function: t, states, derivatives, parameters."""
        states = [state.symbol for state in self.states] + [state.dot for state in self.states]
        return [self.t, *states, *(parameter.symbol for parameter in self.parameters)]

    @cached_property
    def inside(self) -> frozenset[str]:
        """Names of the states inside bodies, which the profiles show together, and of the dummy state."""
        return frozenset([DUMMY_STATE, *(name for profile in self.profiles for name in profile.states)])

    @cached_property
    def of_cells(self) -> frozenset[Any]:
        """States inside bodies and their rates, as symbols: each belongs to one cell."""
        cells = self.inside - {DUMMY_STATE}
        states = (state for state in self.states if state.name in cells)
        return frozenset(symbol for state in states for symbol in (state.symbol, state.dot))

    @property
    def rests(self) -> bool:
        """Whether nothing changes with time: nothing evolves, and no history that is read does."""
        return not self.states and not any(depends(item.expression, self.t) for item in self.named)

    def with_state(self) -> System:
        """The system, with a dummy state where it has none."""
        if self.states:
            return self
        state = State(Quantity(DUMMY_STATE, "1", "stands for states"), 0.0, 1.0)
        return replace(self, states=(state,), rows={DUMMY_STATE: state.dot})

    @property
    def reactions(self) -> tuple[str, ...]:
        """Labels of the reactions in the order of the scene."""
        return tuple(item.name.removeprefix("R_") for item in self.named if item.quantity.tag == "e:R")

    def with_multipliers(self) -> System:
        """The system with a factor on each reaction rate, ``multiplier.LABEL``, one unless it is changed."""
        factors = {
            f"R_{label}": Parameter(
                symengine.Symbol(f"multiplier_{label}"), f"multiplier.{label}", Spec("1", "factor on a rate"), 1.0
            )
            for label in self.reactions
        }
        named = tuple(
            replace(item, expression=factors[item.name].symbol * item.expression) if item.name in factors else item
            for item in self.named
        )
        parameters = (*self.parameters, *factors.values())
        return replace(self, named=named, parameters=parameters, origin=partial(System.with_multipliers, self))

    @property
    def chains(self) -> list[tuple[int, int, int]]:
        """First state, end and anchor of each profile; the anchor is -1 where the contact's temperature is given."""
        names = [state.name for state in self.states]
        return [
            (names.index(p.states[0]), names.index(p.states[-1]) + 1, names.index(p.surface) if p.anchored else -1)
            for p in self.profiles
            if p.states
        ]

    @cached_property
    def outputs(self) -> tuple[Named, ...]:
        """The named quantities that go into the dataset."""
        return tuple(item for item in self.named if item.output)

    @cached_property
    def state_columns(self) -> dict[str, int]:
        """Columns of the states, by name."""
        return {state.name: j for j, state in enumerate(self.states)}

    @cached_property
    def output_columns(self) -> dict[str, int]:
        """Columns of the named quantities of the dataset, by name."""
        return {item.name: j for j, item in enumerate(self.outputs)}

    @cached_property
    def account_columns(self) -> dict[str, list[int]]:
        """Columns of the accounts of each kind."""
        kinds = [account.kind for account in self.ledger]
        return {kind: [j for j, each in enumerate(kinds) if each == kind] for kind in kinds}

    @cached_property
    def energy_has_histories(self) -> bool:
        """Whether the total energy depends on time by itself, as under a load with a history."""
        return self.t in self.definitions[symengine.Symbol("E_total")].free_symbols

    @cached_property
    def paths_by_symbol(self) -> dict[str, str]:
        """Paths of the parameters, by the names of their symbols."""
        return {str(parameter.symbol): parameter.path for parameter in self.parameters}

    def reason(self, margin: Margin, inputs: Array) -> str:
        """Reason why a margin closed, in words, at the arguments of compiled functions there."""
        if margin.below is None:
            return margin.reason
        sign, other = margin.below
        value = symengine.Lambdify(self.inputs, [self.expand(sign)], backend="lambda")(inputs)[0]
        return other if value < 0 else margin.reason

    def residual(self) -> list[Expression]:
        """The equations, expanded, in the order of the rows."""
        return [self.expand(row) for row in self.rows.values()]

    def local(self, expressions: Sequence[Expression]) -> list[Expression]:
        """Expressions in the time of a stretch, so that an event late in a run is as sharp as an early one."""
        start = sum((p.symbol for p in self.parameters if p.path == START), symengine.Integer(0))
        origins = [self.parameters[j].symbol for j in self.origins]
        # What counts from an origin does so in either time; shifted both ways it would be rounded to digits of t.
        lapses = {self.t - origin: symengine.Symbol(f"since {k}") for k, origin in enumerate(origins)}
        shift = {symbol: symbol + start for symbol in (self.t, *origins)}
        back = {dummy: lapse for lapse, dummy in lapses.items()}
        items = [symengine.sympify(item) for item in expressions]
        return [x.subs(lapses).subs(shift).subs(back) if x.free_symbols & shift.keys() else x for x in items]

    @cached_property
    def origins(self) -> list[int]:
        """Columns of the times from which pieces of histories count; a stretch gives them in its own time."""
        return [j for j, p in enumerate(self.parameters) if p.load is not None and p.field == "origin"]

    @cached_property
    def sliding(self) -> NDArray[np.bool_]:
        """Mask of the states that are velocities without inertia, shape (states,)."""
        return np.array([state.algebraic and state.name in VELOCITIES for state in self.states], dtype=bool)

    @property
    def memory(self) -> tuple[Mode | Register, ...]:
        """Modes and registers, which change along edges only."""
        return (*self.modes, *self.registers)

    @cached_property
    def moving_margins(self) -> tuple[Margin, ...]:
        """The margins that change in the course of a run; when time alone leads to a peak is known before."""
        evolved = {x for state in self.states for x in (state.symbol, state.dot)} | {x.symbol for x in self.memory}
        moving = {True: evolved, False: evolved | {self.t}}
        margins = [m for m in self.margins if not m.at_start]
        return tuple(m for m in margins if self.expand(m.masked).free_symbols & moving[m.peak])

    @cached_property
    def limits(self) -> tuple[tuple[Margin, Expression], ...]:
        """The margins that end a run, with their expanded expressions."""
        return tuple((m, self.expand(m.masked)) for m in self.margins if m.terminal)

    @cached_property
    def _when(self) -> list[list[tuple[int, Collection[int]]]]:
        columns = {parameter.symbol: j for j, parameter in enumerate(self.parameters)}
        items: tuple[Margin | Edge, ...] = (*self.moving_margins, *self.edges)
        return [[(columns[mode], values) for mode, values in item.when.items()] for item in items]

    def in_play(self, parameters: Array) -> tuple[bool, ...]:
        """Flags of the guards that are active in the modes among the parameters: the moving margins, then the edges."""
        return tuple(all(parameters[j] in values for j, values in when) for when in self._when)

    @property
    def rules(self) -> list[tuple[int, int, float]]:
        """Modes of active guards as rows (guard, parameter, value): each parameter has to have one of its values."""
        return [(k, j, value) for k, when in enumerate(self._when) for j, values in when for value in values]

    @property
    def moves(self) -> bool:
        """Whether a gap moves by a balance."""
        return not GAPS.isdisjoint(self.state_columns)

    @property
    def in_stretches(self) -> bool:
        """Whether a run is made of stretches, each in a time of its own."""
        return any(parameter.path == START for parameter in self.parameters)

    @property
    def searches(self) -> bool:
        """Whether the state after an edge needs a search: for the equilibrium of a gap, or the effect of load jumps."""
        return bool(self.equilibria) or any(edge.times for edge in self.edges)

    @property
    def jump_energy(self) -> Expression:
        """Energy that a jump conserves: the total energy less the work that far-field tractions do in it [J/m^2].

        Heat contents that depend on temperatures alone are left out: the jump of the rest is what they take up.
        """
        moving = {state.symbol for state in self.states if not state.is_temperature}
        moving |= {self.t, *(item.symbol for item in self.memory)}
        members = symengine.sympify(self.find("E_total").expression).free_symbols
        moved = [member for member in members if self.expand(member).free_symbols & moving]
        return symengine.Add(*moved, *(-work for work in self.given.values()))

    def find(self, name: str) -> Named:
        """The named quantity of that name."""
        return next(item for item in self.named if item.name == name)
