"""The assembled scene: states, equations, ledger, margins and named quantities as one graph of expressions."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from pickle import PicklingError
from typing import Any, NamedTuple, TypeVar

import numpy as np
import symengine
from numpy.typing import NDArray

from surfacechem.contracts.terms import Load, Spec
from surfacechem.contracts.units import TOTAL_UNITS
from surfacechem.expressions import Expression, depends, without
from surfacechem.model.automaton import ALWAYS, Edge, Equilibrium, Mode, Register, Sink, When, masked
from surfacechem.quantities import GAPS, VELOCITIES, Quantity
from surfacechem.scene import Engine

Array = NDArray[np.float64]

STABLE_PREFIX = "stable "
"""Prefix of the names of margins that mark the loss of stability of an algebraic state."""

START = "run.t_start"
"""Path of the start time of an arc (flow interval between events); within the arc, time counts from there."""

DUMMY_STATE = "no_state"
"""Name of the state, always zero, of a scene in which everything is prescribed: solvers need at least one state."""

RTOL_PATH = "run.rtol"
"""Path of the relative tolerance of a run, which sets where endless sequences of events are cut off."""


END_PATH = "run.t_end"
"""Path of the end of a run [s], the scale for brief times; one second where no run is planned."""


class Parameter(NamedTuple):
    """A run-time number of the compiled scene: a parameter of a law, a mode, a register or a segment's field."""

    symbol: Any
    path: str
    spec: Spec
    value: float
    load: Load | None = None
    """The history whose segments change the value, if any."""
    field: str = ""
    internal: bool = False
    """True if it belongs to the solution method, so that no run may change it."""

    @property
    def changeable(self) -> bool:
        """True if a run may give it another value."""
        return not self.internal and self.load is None

    def at(self, start: float) -> float:
        """Return the value on the load segment that begins at ``start`` [s]."""
        return self.load.piece(start)[self.field] if self.load else self.value


class Given(NamedTuple):
    """Initial value of a quantity, given instead of that of a state, which is usually the quantity's logarithm."""

    quantity: Quantity
    value: float
    state: Callable[[Mapping[str, float]], float] | None = None
    """Function that computes the state from all values by path; the logarithm if None."""


@dataclass(frozen=True)
class State:
    """An unknown of the run: evolved by a balance, or algebraic if that balance has no inertia or capacity."""

    quantity: Quantity
    initial: float
    scale: float
    algebraic: bool = False
    start: str = ""
    """Name of the variable that gives its initial value, if not the state itself."""
    finest: float | None = None
    """Its size for the absolute tolerance, if smaller than ``scale``."""
    given: Given | None = None
    """The given initial value of the quantity that the state represents, if any."""
    is_temperature: bool = False

    @cached_property
    def symbol(self) -> Any:
        """Symbol of the state in the equations."""
        return symengine.Symbol(self.name)

    @cached_property
    def dot(self) -> Any:
        """Symbol of its time derivative."""
        return symengine.Symbol(f"d{self.name}_dt")

    @property
    def name(self) -> str:
        """Name in the dataset."""
        return self.quantity.name

    @cached_property
    def path(self) -> str:
        """Path of its initial value, or of the quantity that is given instead."""
        return f"initial.{self.given.quantity.name if self.given else self.start or self.name}"

    @property
    def size(self) -> float:
        """Scale by which the absolute tolerance is multiplied."""
        return self.finest or self.scale

    @property
    def at_start(self) -> tuple[Quantity, float]:
        """The quantity that is given at the start, and its value."""
        return (self.given.quantity, self.given.value) if self.given else (self.quantity, self.initial)

    def from_given(self, values: Mapping[str, float]) -> float:
        """Return the initial value of the state, from given values by path."""
        if self.given is None:
            return values[self.path]
        return self.given.state(values) if self.given.state else math.log(values[self.path])


class Named(NamedTuple):
    """A named quantity; its expression may use the names of earlier ones."""

    quantity: Quantity
    expression: Expression
    output: bool = True

    @property
    def name(self) -> str:
        """Name in the dataset and in the printed source."""
        return self.quantity.name

    @property
    def symbol(self) -> Any:
        """Symbol of the quantity in the expressions of later ones."""
        return symengine.Symbol(self.name)


def definitions(named: Sequence[Named]) -> dict[Any, Expression]:
    """Return the named expressions by name, expanded so that none contains another of these names."""
    result: dict[Any, Expression] = {}
    for item in named:
        result[item.symbol] = without(item.expression, result)
    return result


class Account(NamedTuple):
    """A line of the ledger: a quantity that is integrated along with the states.

    ``kind`` is 'energy supply', 'entropy supply', 'entropy production', 'dissipation', 'heat', 'bonds' or 'statistics';
    ``law`` names the law or process that it belongs to.
    """

    quantity: Quantity
    rate: Expression
    kind: str
    law: str = ""


class Margin(NamedTuple):
    """An event function that must stay positive. At its zero the run ends; at a mere kink only the step ends."""

    name: str
    expression: Expression
    reason: str
    terminal: bool = True
    remedy: str = ""
    """Advice on what to change if the margin is not positive at the start."""
    path: str = ""
    """Path of the entry of a case that it belongs to."""
    stability: str = ""
    """The algebraic state whose stability it monitors, if any."""
    peak: bool = False
    """True if only a step ends here, so as not to pass over a peak of a law; it is no event of the scene."""
    domain: bool = False
    """True if the domain of a law ends here, so that no equilibrium lies beyond."""
    below: tuple[Expression, str] | None = None
    """An expression, and the reason to report if it is negative when the margin closes."""
    bound: tuple[str, Expression] | None = None
    """The state that the margin bounds, and the bound."""
    when: When = ALWAYS
    """Values of the modes in which it is active."""
    at_start: bool = False
    """True if it needs a check at the start only: if it holds there, it holds always."""

    @property
    def masked(self) -> Expression:
        """The expression while the margin is active, else 1, as one expression for reading and printing."""
        return masked(self.expression, self.when)


class Range(NamedTuple):
    """Range of validity of a law in one variable; outside, the law extrapolates. Its ends depend on parameters."""

    variable: str
    low: Expression
    high: Expression
    law: str


class RatePair(NamedTuple):
    """A forward and a backward rate that are stated separately, compared with the equilibrium constant along a run.

    ``departure`` names the quantity ln(k_f/k_r) - ln K(g, T), ``law`` the account of the entropy that both produce.
    """

    departure: str
    title: str
    law: str


class TimeScale(NamedTuple):
    """Characteristic time of a free motion, with advice if it is too short for a run."""

    text: str
    time: Expression
    remedy: str


class ExternalRates(NamedTuple):
    """An engine that evaluates rates outside the graph, with the expressions of the variables that it reads."""

    engine: Engine
    reads: tuple[Expression, ...]


class Role(NamedTuple):
    """Role of a variable in this scene: evolved, algebraic, prescribed, constant, derived or merged."""

    variable: str
    role: str
    by: str


class CappedLaw(NamedTuple):
    """Exponents of a law that are capped: above the cap its exponentials continue along their tangents."""

    title: str
    exponents: tuple[Any, ...]


class Caution(NamedTuple):
    """Warning to give if an expression becomes negative, at the start or along a run."""

    expression: Expression
    text: str


class Profile(NamedTuple):
    """Temperature profile across a body, from the contact to the far side."""

    number: int
    body: str
    points: tuple[float, ...]
    """Positions of the temperatures, as fractions of the thickness."""
    thickness: str
    """Path of the thickness."""
    surface: str
    """Name of the temperature at the contact."""
    anchored: bool
    """True if the temperature at the contact is a state."""
    states: tuple[str, ...]
    """Names of the temperatures inside, in order."""
    far: str = ""
    """Name of the temperature at the far side if it is prescribed."""
    after: float | None = None
    """Time after a sudden change from which on the cells have to resolve the profile, if the scene gives it."""

    @property
    def name(self) -> str:
        """Name in the dataset."""
        return f"profile_{self.number}"


class Conductor(NamedTuple):
    """Data of a body with a conductivity, to judge whether one lumped temperature is enough."""

    number: int
    body: str
    is_lump: bool
    resistance: Expression
    """L / k [m^2 K/W]."""
    capacity: Expression
    """Heat capacity of the whole body [J/(m^2 K)]."""
    conductance: Expression | None
    """Conductance of all heat paths at the contact [W/(m^2 K)]; None in perfect contact."""


Note = Range | CappedLaw | RatePair | TimeScale | Caution | Profile | Conductor

N = TypeVar("N", bound=Note)


class Total(NamedTuple):
    """A balanced total, by its columns."""

    variables: list[int]
    """The total and its existing parts, in the table of states and named quantities."""
    accounts: list[int]
    """Accounts of the ledger that explain its change, then others that count as exchange only."""
    booked: int
    """Number of the accounts that explain it."""


TOTALS = (
    (("E_total", "U_1", "U_2", "U_c"), ("energy supply",), ("dissipation",)),
    (("S_total", "S_1", "S_2", "S_c"), ("entropy supply", "entropy production"), ()),
)
"""Balanced totals, each with its parts; the kinds of accounts that explain its change, and further kinds that count as
exchange only.
"""


@dataclass(frozen=True)
class System:
    """The assembled system: states, equations and everything that is derived from them.

    The equations are G(t, y, dy/dt; p) = 0, linear in dy/dt; ``rows`` holds the residuals by the names of their states.
    The named quantities ``E_total`` and ``S_total`` are the totals whose changes the ledger must explain.
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
    """Paths of the frequencies of periodic loads, whose work steps have to resolve even if the state is at rest."""
    modes: tuple[Mode, ...] = ()
    registers: tuple[Register, ...] = ()
    edges: tuple[Edge, ...] = ()
    equilibria: tuple[Equilibrium, ...] = ()
    sinks: Mapping[str, tuple[Sink, ...]] = field(default_factory=dict)
    """Sinks of the heat of a jump, by its origin: the interface, or the support of an axis."""
    followers: Mapping[str, Expression] = field(default_factory=dict)
    """Reset map of states that follow the normal gap when it jumps: new values, by name."""
    far_work: Mapping[str, Expression] = field(default_factory=dict)
    """Tractions of the far field times their gaps [J/m^2], by account of the work."""
    far_fields: Mapping[str, tuple[Expression, ...]] = field(default_factory=dict)
    """Stiffness [Pa/m], displacement [m] and traction [Pa] of the far field, and the gap [m], by account of the
    work."""
    notes: tuple[Note, ...] = ()
    """Records that a run monitors and reports if they matter; no equation depends on them."""
    conductances: Mapping[tuple[str, str], Sequence[Expression]] = field(default_factory=dict)
    """Conductances in parallel between two ends [W/(m^2 K)]."""
    external_rates: ExternalRates | None = None
    in_totals: bool = False
    """True if quantities that are otherwise per area are totals of a pair of bodies."""
    constants: Mapping[str, tuple[Spec, float]] = field(default_factory=dict)
    """Parameters of laws that have their default values, by path. They are numbers in the equations, so a run can
    change them only if the scene is assembled again."""
    origin: partial[System] | None = None
    """Call that assembles the system again, to the last bit; a pickle keeps it instead of expressions."""

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the call that assembles the system: expressions are formed again, in the same order."""
        if self.origin is None:
            raise PicklingError("a system that was not assembled from a scene cannot be pickled.")
        return self.origin.func, self.origin.args

    @cached_property
    def definitions(self) -> dict[Any, Expression]:
        """Every name with its expression in terms of t, states, derivatives and parameters only."""
        return definitions(self.named)

    def expand(self, expression: Expression) -> Expression:
        """Return the expression in terms of t, states, derivatives and parameters only."""
        whole = symengine.sympify(expression)
        return whole if self._names.isdisjoint(whole.free_symbols) else without(whole, self.definitions)

    @cached_property
    def _names(self) -> frozenset[Any]:
        """Symbols of the named quantities."""
        return frozenset(item.symbol for item in self.named)

    def notes_of(self, kind: type[N]) -> tuple[N, ...]:
        """Return the notes of one kind."""
        return tuple(note for note in self.notes if isinstance(note, kind))

    @cached_property
    def cautions(self) -> tuple[tuple[Caution, ...], Any]:
        """The cautions, and the function for the values of their expressions."""
        found = self.notes_of(Caution)
        return found, self._interpreted([item.expression for item in found])

    @cached_property
    def capped_laws(self) -> list[tuple[CappedLaw, Any]]:
        """Laws whose rate may be capped, each with the function for its exponents."""
        return [(law, self._interpreted(law.exponents)) for law in self.notes_of(CappedLaw)]

    def _interpreted(self, expressions: Iterable[Expression]) -> Any:
        """Return the function for the values of expressions, which are too few to be compiled."""
        whole = [self.expand(expression) for expression in expressions]
        return symengine.Lambdify(self.inputs, whole, backend="lambda") if whole else None

    @cached_property
    def profiles(self) -> tuple[Profile, ...]:
        """Temperature profiles of bodies; their states come after all other states, profile by profile."""
        return self.notes_of(Profile)

    @cached_property
    def moving(self) -> list[str]:
        """Names of the quantities that change in time whatever the states do."""
        return [item.name for item in self.named if item.output and depends(item.expression, self.t)]

    def unit(self, unit: str) -> str:
        """Return the unit, or that of the corresponding total if the system is a pair of bodies."""
        return TOTAL_UNITS.get(unit, unit) if self.in_totals else unit

    @cached_property
    def changeable(self) -> dict[str, str]:
        """Units of everything that a run may change, by path: parameters and initial values."""
        given = set(self.external_rates.engine.gives) if self.external_rates else set()
        units = {p.path: p.spec.unit for p in self.parameters if p.changeable and p.path not in given}
        return units | {state.path: state.at_start[0].unit for state in self.states}

    @property
    def inputs(self) -> list[Any]:
        """Arguments of every compiled function: t, states, derivatives, parameters."""
        states = [state.symbol for state in self.states] + [state.dot for state in self.states]
        return [self.t, *states, *(parameter.symbol for parameter in self.parameters)]

    @cached_property
    def interior(self) -> frozenset[str]:
        """Names of the states inside bodies, which the profiles present together, and of the dummy state."""
        return frozenset([DUMMY_STATE, *(name for profile in self.profiles for name in profile.states)])

    @cached_property
    def own_states(self) -> dict[str, State]:
        """States by name, without the interior ones."""
        return {state.name: state for state in self.states if state.name not in self.interior}

    @cached_property
    def cell_symbols(self) -> frozenset[Any]:
        """Symbols of the states inside bodies and of their rates; each belongs to one cell."""
        cells = self.interior - {DUMMY_STATE}
        states = (state for state in self.states if state.name in cells)
        return frozenset(symbol for state in states for symbol in (state.symbol, state.dot))

    @property
    def is_static(self) -> bool:
        """True if nothing changes with time: there are no states, and no named quantity reads a history."""
        return not self.states and not any(depends(item.expression, self.t) for item in self.named)

    def with_dummy_state(self) -> System:
        """Return the system, with a dummy state if it has none."""
        if self.states:
            return self
        state = State(Quantity(DUMMY_STATE, "1", "stands for states"), 0.0, 1.0)
        return replace(self, states=(state,), rows={DUMMY_STATE: state.dot})

    @property
    def reactions(self) -> tuple[str, ...]:
        """Labels of the reactions in the order of the scene."""
        return tuple(item.name.removeprefix("R_") for item in self.named if item.quantity.tag == "e:R")

    def with_multipliers(self) -> System:
        """Return the system with a factor on each reaction rate, ``multiplier.LABEL``, which is one by default."""
        factors = {
            f"R_{label}": Parameter(
                symengine.Symbol(f"multiplier_{label}"), f"multiplier.{label}", Spec("1", "factor on a rate"), 1.0
            )
            for label in self.reactions
        }
        named = tuple(
            item._replace(expression=factors[item.name].symbol * item.expression) if item.name in factors else item
            for item in self.named
        )
        parameters = (*self.parameters, *factors.values())
        return replace(self, named=named, parameters=parameters, origin=partial(System.with_multipliers, self))

    @property
    def chains(self) -> list[tuple[int, int, int]]:
        """First state, end and anchor of each profile; the anchor is -1 if the contact temperature is prescribed."""
        names = [state.name for state in self.states]
        return [
            (names.index(p.states[0]), names.index(p.states[-1]) + 1, names.index(p.surface) if p.anchored else -1)
            for p in self.profiles
            if p.states
        ]

    @cached_property
    def outputs(self) -> tuple[Named, ...]:
        """The named quantities that are written to the dataset."""
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
    def variable_names(self) -> list[str]:
        """Names of the states and of the named quantities of the dataset."""
        return [*self.state_columns, *self.output_columns]

    @cached_property
    def variable_columns(self) -> dict[str, int]:
        """Columns of states and named quantities in a table of both, by name."""
        return {name: j for j, name in enumerate(self.variable_names)}

    @cached_property
    def parameter_columns(self) -> dict[str, int]:
        """Columns of the parameters, by path."""
        return {parameter.path: j for j, parameter in enumerate(self.parameters)}

    @cached_property
    def mode_columns(self) -> dict[str, int]:
        """Columns of the modes among the parameters, by name."""
        columns = {parameter.symbol: j for j, parameter in enumerate(self.parameters)}
        return {mode.name: columns[mode.symbol] for mode in self.modes}

    @cached_property
    def given_values(self) -> dict[str, float]:
        """Parameters and initial values of the scene in SI, by path."""
        values = {parameter.path: parameter.at(0.0) for parameter in self.parameters}
        return values | {state.path: state.at_start[1] for state in self.states}

    def initial_state(self, values: Mapping[str, float]) -> Array:
        """Return the initial values of the states, from given values by path."""
        return np.array([state.from_given(values) for state in self.states])

    @cached_property
    def account_columns(self) -> dict[str, list[int]]:
        """Columns of the accounts of each kind."""
        kinds = [account.kind for account in self.ledger]
        return {kind: [j for j, each in enumerate(kinds) if each == kind] for kind in kinds}

    @cached_property
    def totals(self) -> tuple[Total, ...]:
        """The balanced totals, energy and entropy, which have these parts and whose changes these accounts explain."""
        known, columns = self.variable_columns, self.account_columns
        return tuple(
            Total(
                [known[name] for name in (total, *parts) if name in known],
                [j for kind in (*supplies, *sinks) for j in columns.get(kind, ())],
                sum(len(columns.get(kind, ())) for kind in supplies),
            )
            for (total, *parts), supplies, sinks in TOTALS
        )

    @cached_property
    def least_states(self) -> Array:
        """Least possible values of the states: zero for bonds, minus infinity for others; shape (states,)."""
        bonds = {account.law for account in self.ledger if account.kind == "bonds"}
        return np.array([0.0 if state.name in bonds else -np.inf for state in self.states])

    @cached_property
    def energy_has_histories(self) -> bool:
        """True if the total energy depends explicitly on time, as under a prescribed load."""
        return self.t in self.definitions[symengine.Symbol("E_total")].free_symbols

    def reason(self, margin: Margin, inputs: Array) -> str:
        """Return the reason, in words, why a margin closed; ``inputs`` are those of compiled functions there."""
        if margin.below is None:
            return margin.reason
        sign, other = margin.below
        value = symengine.Lambdify(self.inputs, [self.expand(sign)], backend="lambda")(inputs)[0]
        return other if value < 0 else margin.reason

    def residual(self) -> list[Expression]:
        """Return the residuals, expanded, in the order of the rows."""
        return [self.expand(row) for row in self.rows.values()]

    def local_time(self, expressions: Sequence[Expression]) -> list[Expression]:
        """Return expressions in the local time of an arc, so that late events are located as sharply as early ones."""
        start = sum((p.symbol for p in self.parameters if p.path == START), symengine.Integer(0))
        origins = [self.parameters[j].symbol for j in self.origins]
        # The time since an origin is the same in both times; shifted twice, it would be rounded to the digits of t.
        lapses = {self.t - origin: symengine.Symbol(f"since {k}") for k, origin in enumerate(origins)}
        shift = {symbol: symbol + start for symbol in (self.t, *origins)}
        back = {dummy: lapse for lapse, dummy in lapses.items()}
        items = [symengine.sympify(item) for item in expressions]
        return [x.subs(lapses).subs(shift).subs(back) if x.free_symbols & shift.keys() else x for x in items]

    @cached_property
    def origins(self) -> list[int]:
        """Columns of the origins of load segments; in an arc they are given in local time."""
        return [j for j, p in enumerate(self.parameters) if p.load is not None and p.field == "origin"]

    @cached_property
    def slip_velocities(self) -> NDArray[np.bool_]:
        """Mask of the states that are velocities without inertia, shape (states,)."""
        return np.array([state.algebraic and state.name in VELOCITIES for state in self.states], dtype=bool)

    @property
    def discrete(self) -> tuple[Mode | Register, ...]:
        """Modes and registers, the discrete variables that change along edges only."""
        return (*self.modes, *self.registers)

    @cached_property
    def event_margins(self) -> tuple[Margin, ...]:
        """The margins that can close during a run; a peak in time alone is left out, as it is known beforehand."""
        evolved = {x for state in self.states for x in (state.symbol, state.dot)} | {x.symbol for x in self.discrete}
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
        items: tuple[Margin | Edge, ...] = (*self.event_margins, *self.edges)
        return [[(columns[mode], values) for mode, values in item.when.items()] for item in items]

    def active_guards(self, parameters: Array) -> tuple[bool, ...]:
        """Return a flag for each guard, moving margins and then edges: active in the modes among the parameters."""
        values = parameters.tolist()
        return tuple([not when or all(values[j] in each for j, each in when) for when in self._when])

    @property
    def guard_conditions(self) -> list[tuple[int, int, float]]:
        """Rows (guard, parameter, value) of active modes: each parameter listed must have one of its values."""
        return [(k, j, value) for k, when in enumerate(self._when) for j, values in when for value in values]

    @property
    def has_moving_gap(self) -> bool:
        """True if a gap moves by a balance."""
        return not GAPS.isdisjoint(self.state_columns)

    @property
    def has_arcs(self) -> bool:
        """True if a run consists of arcs, each with a local time."""
        return any(parameter.path == START for parameter in self.parameters)

    @property
    def solves_jumps(self) -> bool:
        """True if the state after an edge has to be solved for: equilibria of gaps, or responses to jumps of loads."""
        return bool(self.equilibria) or any(edge.times for edge in self.edges)

    @property
    def jump_energy(self) -> Expression:
        """Energy that a jump conserves: the total energy less the work of far-field tractions in the jump [J/m^2].

        Heat contents that depend on temperatures alone are left out: they take up the jump of the rest.
        """
        moving = {state.symbol for state in self.states if not state.is_temperature}
        moving |= {self.t, *(item.symbol for item in self.discrete)}
        members = symengine.sympify(self.find("E_total").expression).free_symbols
        moved = [member for member in members if self.expand(member).free_symbols & moving]
        return symengine.Add(*moved, *(-work for work in self.far_work.values()))

    def find(self, name: str) -> Named:
        """Return the named quantity of that name."""
        return next(item for item in self.named if item.name == name)
