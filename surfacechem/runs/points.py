"""Evaluation of a scene at given states, without a run: quantities and their exact derivatives by given values.

At each point the states and the prescribed variables have given values, and prescribed variables are held. The balances
are solved for the rest: rates of evolved states, and values of states without capacity or inertia.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import symengine
from numpy.typing import ArrayLike, NDArray

from surfacechem.compile.program import compile_function, expanded, jacobian
from surfacechem.contracts.terms import Load
from surfacechem.contracts.units import parse, plain_values, quotient
from surfacechem.documents import document
from surfacechem.documents.document import Tree
from surfacechem.errors import InputError, Place, refuse_unknown
from surfacechem.expressions import derivative, magnitude
from surfacechem.format.data_files import CSVText
from surfacechem.laws.loading import Hold
from surfacechem.model.assemble import assemble
from surfacechem.model.automaton import Equilibrium
from surfacechem.model.system import Named, System
from surfacechem.quantities import Quantity
from surfacechem.results.audit import extrapolations
from surfacechem.results.dataset import DATASET_NAMES, Results
from surfacechem.results.netcdf import Column, versions
from surfacechem.scene import Scene
from surfacechem.solve.contract import Array
from surfacechem.solve.equilibria import NO_BALANCE, Equilibria, Point
from surfacechem.solve.run import values_of
from surfacechem.solve.segments import mode_starts, start_registers
from surfacechem.tolerances import GUARD_EPS, RUN_EPS, TINY

Points = Mapping[str, ArrayLike]

MOST_NEWTON = 50
"""Largest number of Newton iterations; linear unknowns, such as all rates, take one."""

POINT = ("point",)
UNSOLVED = "the equations have no solution with these values"
LEVEL_SUFFIX = ".level"
"""Suffix of the paths of the values at which histories are held."""


@dataclass(frozen=True, kw_only=True, repr=False)
class PointResults(Results):
    """Quantities at points: ``dataset`` is the xarray Dataset, ``write`` saves the same as netCDF."""

    values: Sequence[Column]
    """Given quantities, and those that follow from them."""
    slopes: Sequence[Column]
    """Derivatives of the quantities that follow by the given ones."""
    refused: Sequence[str]
    """Reason why a law is not valid at a point, by point; empty where all are."""
    warnings: Sequence[str] = ()
    """Warnings about laws that are used outside their range."""

    def __repr__(self) -> str:
        """Return the number of points in a line."""
        return f"<Points of {self.title!r}: {len(self.refused)}, {len(self.values)} quantities>"

    @property
    def columns(self) -> Sequence[Column]:
        """Every variable of the dataset."""
        count = len(self.refused)
        allowed = np.array([not why for why in self.refused], dtype=float)
        found = [Column("point", POINT, np.arange(count, dtype=float), "1", "number of the point")]
        found += [*self.values, *self.slopes, Column("admissible", POINT, allowed, "1", "one where all laws hold")]
        if any(self.refused):
            why = np.array(self.refused, dtype=object)
            found.append(Column("reason", POINT, why, "", "why a law does not hold"))
        return found

    @property
    def attributes(self) -> Mapping[str, str | float | int]:
        """Attributes of the dataset, with its origin."""
        told = {"warnings": "; ".join(self.warnings) or "none", "versions": versions()}
        return {**self._origin("evaluated", f"at {len(self.refused)} points"), **told}


def with_histories_held(scene: Scene) -> Scene:
    """Return the scene with every history held at its initial value."""

    def level(load: Any) -> Any:
        # One parameter replaces a history, so that derivatives can be taken by it.
        return Hold(level=load.at_start(), place=load.place) if isinstance(load, Load) else load

    def body(number: int) -> Any:
        given = scene.bodies[number]
        conduction = given.conduction and replace(given.conduction, far=level(given.conduction.far))
        return given._replace(temperature=level(given.temperature), conduction=conduction)

    return replace(
        scene,
        bodies=(body(0), body(1)),
        interface=replace(scene.interface, temperature=level(scene.interface.temperature)),
        loading={name: level(load) for name, load in scene.loading.items()},
        surroundings=level(scene.surroundings),
    )


@dataclass(frozen=True)
class Argument:
    """Argument that points may give: its column among the arguments of compiled functions, and its quantity."""

    column: int
    quantity: Quantity
    path: str
    is_log: bool = False
    """True if the argument is the logarithm of the quantity."""
    is_made: bool = False
    """True if the argument is computed from the quantity and from other initial values."""

    def values(self, table: Array) -> Array:
        """Return the values of the quantity from the table of arguments."""
        return np.exp(table[:, self.column]) if self.is_log else table[:, self.column]

    def put(self, table: Array, values: Array) -> None:
        """Write values of the quantity into the table; NaN where the logarithm does not exist, so that no law is
        valid.
        """
        with np.errstate(invalid="ignore"):
            table[:, self.column] = np.log(np.where(values > 0, values, np.nan)) if self.is_log else values


class Evaluator:
    """A scene compiled for its values and derivatives at many points."""

    def __init__(self, scene: Scene) -> None:
        self.system = system = assemble(with_histories_held(scene))
        if system.external_rates is not None:
            message = "rates of the mechanism come from Cantera itself, which gives no derivatives."
            raise InputError(message, path="interface.mechanism")
        n = len(system.states)
        self.first = self._begun({})
        """Arguments of compiled functions at the start of the case."""
        self.given, self.parameters = _states(system) | _histories(system), _parameters(system)
        balances = _balances(system, self.quasi_static)
        # Unknowns: rates of evolved states, values of states that are algebraic or in equilibrium.
        self.unknown = [1 + j if state.algebraic else 1 + n + j for j, state in enumerate(system.states)]
        self.unknown += [1 + system.state_columns[name] for name in balances]
        self.rows = [*_rates(system, balances), *(item for item in system.outputs if item.name not in self.given)]
        self.rows += _capacities(system, scene, self.given)
        self.conditions = Conditions(system)
        self._starts = mode_starts(system)
        """Columns of the modes in which a run would start from a state, and the function for their values."""
        by = sorted({*self.unknown, *(item.column for item in self.given.values())})
        expressions = [*system.rows.values(), *balances.values(), *(row.expression for row in self.rows)]
        self.slopes = Slopes(system, expressions, by, self.conditions.margins)

    def at(self, points: Points) -> tuple[list[Column], list[Column], list[str]]:
        """Return columns of given quantities, of those that follow and of derivatives, and the reason at each point
        where a law is not valid.
        """
        table, asked = self._table(points)
        lost = self._settle(table, asked)
        sought = self._sought(asked)
        unknown = [self.unknown[i] for i in sought]
        # All arguments that may be given, in a fixed order, except the unknowns.
        own = {name: item for name, item in self.given.items() if item.column not in unknown}
        values, slopes, margins = self._solved(table, sought, unknown)
        shown = {i: row.quantity for i, row in enumerate(self.rows, start=len(self.unknown)) if row.name not in own}
        found = [_column(x.quantity, x.values(table)) for x in (own | asked).values() if not x.is_made]
        found += [_column(quantity, values[:, i]) for i, quantity in shown.items()]
        by = [item.column for item in own.values()]
        total, there = self.slopes.total(slopes, [*shown], by, sought, unknown)
        derivatives: list[Column] = []
        for k, item in enumerate(own.values()):
            # If the argument is ln x, its derivative by x is 1/x.
            per = 1 / item.values(table) if item.is_log else 1.0
            derivatives += _by(item.quantity, [*shown.values()], total[:, :, k].T * per, there[:, k])
        return found, derivatives, np.where(lost, NO_BALANCE, self.conditions.reasons(table, margins)).tolist()

    def _table(self, points: Points) -> tuple[Array, dict[str, Argument]]:
        """Return the arguments of compiled functions at each point, and the arguments that the points give."""
        asked, columns = self._given(points)
        table = np.tile(self.first, (len(columns), 1))
        if any(item.is_made for item in asked):
            paths = [item.path for item in asked]
            possible = np.where([item.is_log for item in asked] & (columns <= 0), np.nan, columns)
            table[:] = [self._begun(dict(zip(paths, row, strict=True))) for row in possible]
        for item, x in zip(asked, columns.T, strict=True):
            if not item.is_made:
                item.put(table, x)
        # A point has no history: its modes, contact and sliding, follow from its state.
        started, begun = self._starts
        table[:, started] = begun(table)
        return table, {item.quantity.name: item for item in asked}

    def _given(self, points: Points) -> tuple[list[Argument], Array]:
        """Return the arguments that the points give, and their values, shape (points, arguments)."""
        known = self.names | self.parameters
        refuse_unknown(points, known, "points cannot give '{}'")
        given = {name: _numbers(name, value, known[name].quantity.unit) for name, value in points.items()}
        for end in (np.min, np.max):  # the ranges are the same as in a run
            values_of(self.system, {name: end(x) for name, x in given.items() if name in self.parameters})
        first = {known[name].column: name for name in reversed(given)}
        for name in given:
            if first[known[name].column] != name:
                raise InputError(f"points give {first[known[name].column]} or {name}, not both.")
        try:
            columns = np.broadcast_arrays(*given.values())
        except ValueError:
            sizes = ", ".join(f"{len(x)} of {name}" for name, x in given.items())
            raise InputError(f"points need as many values of everything: there are {sizes}.") from None
        return [known[name] for name in given], np.array(columns).T if given else np.zeros((1, 0))

    def _begun(self, changes: Mapping[str, float]) -> Array:
        """Return the arguments at the start of a run, with some values changed by path."""
        system = self.system
        values = {**values_of(system), **changes}
        parameters = np.array([[values[parameter.path] for parameter in system.parameters]])
        start_registers(system, parameters, values)
        states = system.initial_state(values)
        return np.concatenate([[0.0], states, np.zeros_like(states), parameters[0]])

    def _sought(self, asked: Mapping[str, Argument]) -> list[int]:
        """Return the indices of balances to be solved: of unknowns that points neither give nor move with a gap."""
        led = [name for item in self.quasi_static if item.state in asked for name in item.coupled]
        known = [item.column for item in (*asked.values(), *(self.given[name] for name in led))]
        return np.flatnonzero(~np.isin(self.unknown, known)).tolist()

    def _settle(self, table: Array, asked: Collection[str]) -> NDArray[np.bool_]:
        """Equilibrate gaps that points do not give, as at the start of a run; return the mask of points without
        equilibrium.
        """
        lost = np.zeros(len(table), dtype=bool)
        free = [item for item in self.quasi_static if item.state not in asked]
        moves = [{name: far for name, far in item.coupled.items() if name not in asked} for item in free]
        items = tuple(item._replace(coupled=along) for item, along in zip(free, moves, strict=True))
        equilibria = Equilibria(replace(self.system, equilibria=items))
        gaps = [1 + self.system.state_columns[item.state] for item in items]
        for k, row in enumerate(table if items else ()):
            settled = equilibria.equilibrate(Point.of(row.copy(), len(self.system.states)))
            lost[k] = settled is None
            row[gaps] = np.nan
            row[:] = row if settled is None else settled.inputs()
        return lost

    @cached_property
    def names(self) -> dict[str, Argument]:
        """Arguments that points may give, by name, and by name in the dataset."""
        found = dict(self.given)
        for column, state in enumerate(self.system.states, start=1):
            if state.given and state.given.state:
                quantity = state.given.quantity
                found[quantity.name] = Argument(column, quantity, state.path, is_made=True)
        return found | {DATASET_NAMES.get(name, name): item for name, item in found.items()}

    @cached_property
    def quasi_static(self) -> list[Equilibrium]:
        """Gaps in equilibrium that are free at the start."""
        items, start = self.system.equilibria, Point.of(self.first, len(self.system.states))
        return [items[k] for k in Equilibria(self.system).free(start)] if items else []

    def _solved(self, table: Array, rows: Sequence[int], unknown: Sequence[int]) -> tuple[Array, Array, Array]:
        """Solve the balances; return balances and rows at the points, their derivatives, and the margins."""
        for _ in range(MOST_NEWTON):
            values, slopes, margins = self.slopes(table)
            change = -_solve(self.slopes.block(slopes, rows, unknown), values[:, rows, None])[..., 0]
            if np.all(np.isnan(change) | (np.abs(change) <= RUN_EPS * np.maximum(np.abs(table[:, unknown]), TINY))):
                break
            table[:, unknown] += change  # all of a row becomes NaN where its balances have no solution
        return values, slopes, margins


class Conditions:
    """Limits of laws, and guards of edges that a run would take at once. Stability is not required of a point."""

    def __init__(self, system: System) -> None:
        self._limits = [margin for margin, _ in system.limits if not margin.stability]
        self._edges = [edge for edge in system.edges if not (edge.ends_stage or edge.fold)]

    @property
    def margins(self) -> list[Any]:
        """Expressions of the limits, of the guards, and of the magnitudes of the guards, in this order."""
        closed = [limit.masked for limit in self._limits] + [edge.masked for edge in self._edges]
        return closed + [magnitude(edge.guard) for edge in self._edges]

    def reasons(self, table: Array, margins: Array) -> list[str]:
        """Return the reason why no run could be at a point with these arguments and margins; empty where one could."""
        limits, guards, sizes = np.split(margins, np.cumsum([len(self._limits), len(self._edges)]), axis=1)
        unsolved, due = np.isnan(table).any(axis=1), guards < -GUARD_EPS * np.nan_to_num(sizes)
        words = [limit.reason for limit in self._limits] + [edge.reason for edge in self._edges]
        # The first true column gives the reason; the last one, always true, gives none.
        found = np.column_stack([unsolved, ~(limits > 0), due, np.ones(len(table), dtype=bool)])
        return [(UNSOLVED, *words, "")[first] for first in found.argmax(axis=1)]


FLUX_UNITS = ("Pa", "W/m^2", "N", "W")
"""Units of tractions and heat fluxes; a contact element reads all their derivatives by name, also those that are zero.
"""


class Slopes:
    """Expressions with their exact derivatives by some arguments, and margins, compiled as one function."""

    def __init__(self, system: System, rows: Sequence[Any], by: Sequence[int], margins: Sequence[Any]) -> None:
        inputs, self.by = system.inputs, list(by)
        named = [(symengine.Symbol(item.name), item.expression) for item in system.named]
        slopes, names = jacobian(rows, [inputs[column] for column in by], named)
        places = {inputs[column]: k for k, column in enumerate(by)}
        found = {(i, places[x]): slope for i, row in enumerate(slopes) for x, slope in row.items() if slope != 0}
        self.pattern = np.zeros((len(rows), len(by)), dtype=bool)
        self._entries = np.array([*found], dtype=np.int64).reshape(-1, 2).T
        self.pattern[self._entries[0], self._entries[1]] = True
        whole = expanded(names, [*rows, *found.values(), *margins])
        self._function = compile_function(inputs, whole, system.cell_symbols)

    def __call__(self, table: Array) -> tuple[Array, Array, Array]:
        """Return values, derivatives of shape (points, rows, arguments), and margins."""
        ends = np.cumsum([len(self.pattern), self._entries.shape[1]])
        values, entries, margins = np.split(self._function(table), ends, axis=1)
        slopes = np.zeros((len(table), *self.pattern.shape))
        slopes[:, self._entries[0], self._entries[1]] = entries
        return values, slopes, margins

    def block(self, slopes: NDArray[Any], rows: Sequence[int], by: Sequence[int]) -> NDArray[Any]:
        """Return the derivatives of some rows by some arguments."""
        return slopes[..., rows, :][..., [self.by.index(column) for column in by]]

    def total(
        self, slopes: Array, rows: Sequence[int], by: Sequence[int], sought: Sequence[int], unknown: Sequence[int]
    ) -> tuple[Array, NDArray[np.bool_]]:
        """Return total derivatives of rows by given arguments, including those through the unknowns, and the mask of
        those that may be nonzero.

        G(u, x) = 0 gives du/dx = -(dG/du)^-1 dG/dx.
        """
        parts = [(rows, by), (rows, unknown), (sought, unknown), (sought, by)]
        direct, through, inner, outer = (self.block(slopes, *part) for part in parts)
        there, passes, among, reached = (self.block(self.pattern, *part) for part in parts)
        # Dependence of unknowns on an argument through other unknowns: derivatives that are always zero are left out.
        for _ in unknown:
            reached = reached | (among @ reached)
        with np.errstate(invalid="ignore"):  # NaN where no solution was found
            return direct - through @ _solve(inner, outer), there | (passes @ reached)


def _states(system: System) -> dict[str, Argument]:
    """Return the states as arguments by name, except those inside bodies."""
    found = []
    for column, state in enumerate(system.states, start=1):
        is_log = state.given is not None and state.given.state is None
        quantity = state.given.quantity if state.given and is_log else state.quantity
        found.append(Argument(column, quantity, state.path, is_log))
    inside = system.interior
    return {item.quantity.name: item for item in found if item.quantity.name not in inside}


def _histories(system: System) -> dict[str, Argument]:
    """Return the prescribed variables, which are held and thus parameters, as arguments by name."""
    levels = {p.symbol: p.path for p in system.parameters if p.path.endswith(LEVEL_SUFFIX)}
    held_at = [(item.quantity, item.expression) for item in system.named if item.expression in levels]
    return {q.name: Argument(system.inputs.index(symbol), q, levels[symbol]) for q, symbol in held_at}


def _parameters(system: System) -> dict[str, Argument]:
    """Return the parameters of laws as arguments by path."""
    own = [p for p in system.parameters if p.changeable and not p.path.endswith(LEVEL_SUFFIX)]
    quantities = [Quantity(re.sub(r"\W+", "_", p.path).strip("_"), p.spec.unit, p.spec.text) for p in own]
    return {p.path: Argument(system.inputs.index(p.symbol), q, p.path) for p, q in zip(own, quantities, strict=True)}


def _balances(system: System, gaps: Sequence[Equilibrium]) -> dict[str, Any]:
    """Return the residuals of equilibrium by state: the balance of each gap, and the motion of states carried along."""
    found = {item.state: system.expand(item.residual) for item in gaps}
    moved = {state.name: state.symbol - state.initial for state in system.states}
    for item in gaps:
        found |= {name: moved[name] - system.expand(far) * moved[item.state] for name, far in item.coupled.items()}
    return found


def _rates(system: System, balances: Collection[str]) -> Iterator[Named]:
    """Yield rates of evolved states, and values of states that are algebraic or in equilibrium."""
    for state in system.states:
        if state.algebraic or state.name in balances:
            yield Named(state.quantity, state.symbol)
        if not state.algebraic and state.name in system.own_states:
            text = f"rate of change of the {state.quantity.long_name}"
            yield Named(Quantity(f"d{state.name}_dt", quotient(state.quantity.unit, "s"), text), state.dot)


def _capacities(system: System, scene: Scene, given: Mapping[str, Argument]) -> Iterator[Named]:
    """Yield heat capacities of the bodies and the interface, except of bodies that are divided into cells."""
    members = [(f"{k}", body.name, body.temperature) for k, body in enumerate(scene.bodies, start=1)]
    divided = {profile.body for profile in system.profiles}
    for end, owner, temperature in (*members, ("c", "the interface", scene.interface.temperature)):
        node = temperature if isinstance(temperature, str) else f"T_{end}"
        if f"U_{end}" in system.output_columns and node in given and owner not in divided:
            U, T = system.definitions[symengine.Symbol(f"U_{end}")], system.inputs[given[node].column]
            yield Named(Quantity(f"C_{end}", system.unit("J/(m^2 K)"), f"heat capacity of {owner}"), derivative(U, T))


def _numbers(name: str, value: ArrayLike, unit: str) -> Array:
    """Return the values of a column in SI; a text is a quantity with its unit."""
    if hasattr(value, "attrs") or hasattr(value, "magnitude"):  # of xarray or Pint, which may say its unit
        value = plain_values(value)
    if isinstance(value, str):
        return np.array([parse(value, unit, name=name)])
    if isinstance(value, list | tuple) and any(isinstance(x, str) for x in value):
        return np.array([parse(x, unit, name=name) for x in value])
    try:
        found = np.atleast_1d(np.asarray(value, dtype=float))
    except (TypeError, ValueError):
        raise InputError(f"{name} takes numbers in SI, or texts with a unit.") from None
    if found.ndim != 1 or not len(found) or not np.all(np.isfinite(found)):
        raise InputError(f"{name} takes a list of finite numbers in {unit}.")
    return found


def _solve(matrix: Array, right: Array) -> Array:
    """Solve many linear systems; NaN where a matrix is singular."""
    with np.errstate(invalid="ignore"):  # NaN where no gap was found
        singular = np.linalg.slogdet(matrix)[0] == 0  # one singular matrix would make NumPy refuse all
    return np.asarray(np.linalg.solve(np.where(singular[:, None, None], np.nan, matrix), right))


def _column(quantity: Quantity, values: Array) -> Column:
    name = DATASET_NAMES.get(quantity.name, quantity.name)
    return Column(name, POINT, values, quantity.unit, quantity.long_name, quantity.tag)


def _by(x: Quantity, shown: Sequence[Quantity], slopes: Array, there: NDArray[np.bool_]) -> Iterator[Column]:
    """Yield the derivatives by one quantity of those that depend on it, and of all tractions and heat fluxes."""
    for quantity, values, depends in zip(shown, slopes, there, strict=True):
        if depends or quantity.unit in FLUX_UNITS:
            name = "_by_".join(DATASET_NAMES.get(name, name) for name in (quantity.name, x.name))
            # Only the heads of the long names: the rest describes the quantities alone.
            top, bottom = (re.split("[:,(]", q.long_name)[0].strip() for q in (quantity, x))
            text = f"derivative of the {top} by the {bottom}"
            yield Column(name, POINT, values, quotient(quantity.unit, x.unit), text)


def read_points(path: Path, evaluator: Evaluator) -> dict[str, list[float]]:
    """Read points from a CSV file, whose first line has names and units: ``g_n [nm], T_1 [K]``."""
    if not path.is_file():
        raise InputError("there is no such file of points.", Place(str(path)))
    text = CSVText(Tree(document.read(path, str(path)), Place(str(path))), quoted=True)
    nothing = text.error(text.heading[0], "there is no row of values below these names.")
    refuse_unknown([name for name, _ in text.columns], evaluator.names, "points cannot give '{}'", nothing.place)
    if not text.rows:
        raise nothing
    return {name: text.column(name, evaluator.names[name].quantity.unit, name) for name, _ in text.columns}


def evaluation(evaluator: Evaluator, points: Points, **origin: Any) -> PointResults:
    """Evaluate quantities at points, and return them with their origin."""
    try:
        points = dict(points)
    except (TypeError, ValueError):
        raise InputError("points are values by name, such as {'T': [300, 310]}, or a table of pandas.") from None
    values, slopes, refused = evaluator.at(points)
    # A value that no point has, NaN at each, is in no range.
    ranges = {x.name: (np.nanmin(x.values, initial=np.inf), np.nanmax(x.values, initial=-np.inf)) for x in values}
    warnings = extrapolations(evaluator.system, ranges, evaluator.system.given_values)
    return PointResults(values=values, slopes=slopes, refused=refused, warnings=warnings, **origin)
