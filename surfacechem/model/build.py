"""The system under construction: records that the phases of the assembly exchange, and the methods that add to it."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, reduce
from itertools import chain, count
from typing import Any, NamedTuple

import symengine

from surfacechem.contracts.terms import Friction, Law, Load, Spec, optional
from surfacechem.errors import InputError
from surfacechem.expressions import Expression, absolute, derivative, where, without
from surfacechem.model import balances
from surfacechem.model.automaton import Constraint, Edge, Equilibrium, Mode, Register
from surfacechem.model.balances import Node, PowerFlow, Rows
from surfacechem.model.system import Account, Margin, Named, Note, Range, Role, State, definitions
from surfacechem.model.variables import Parameters, Variables
from surfacechem.quantities import VARIABLES, Quantity
from surfacechem.scene import Body, Conduction, Interface, Scene, volume_shares
from surfacechem.tolerances import NO_AMOUNT, RUN_EPS, TINY


class Bond(NamedTuple):
    """A bonding variable that is a state: its symbol, rate, site density (its amount at one) and initial value."""

    symbol: Any
    dot: Any
    density: Expression
    initial: Expression


class Slab(NamedTuple):
    """A body divided into cells: temperatures from the contact on, with a prescribed far side as the last one."""

    number: int
    body: Body
    law: Conduction
    points: tuple[float, ...]
    behind: tuple[Node, ...]
    """The nodes behind the one at the contact."""

    @property
    def inner(self) -> tuple[Node, ...]:
        """The nodes behind the contact that evolve."""
        return tuple(node for node in self.behind if not node.prescribed)

    @property
    def profile(self) -> str:
        """Name of its temperature profile."""
        return f"profile_{self.number}"


@dataclass(frozen=True)
class Thermal:
    """Temperature nodes by name, the members that share them, and the bodies that are divided into cells."""

    nodes: Mapping[str, Node]
    members: Mapping[str, str]
    """Name of the node of each body, of the interface and of the surroundings."""
    slabs: Mapping[str, Slab] = field(default_factory=dict)
    resistances: Mapping[str, Expression] = field(default_factory=dict)
    """L / k of the bodies with a stated conductivity [m^2 K/W]."""

    @cached_property
    def node_of(self) -> dict[str, Node]:
        """Node of each member."""
        return {member: self.nodes[name] for member, name in self.members.items()}

    @cached_property
    def free(self) -> list[Node]:
        """The nodes at the contact whose temperature is not prescribed."""
        return [node for node in self.nodes.values() if not node.prescribed]

    @cached_property
    def prescribed(self) -> list[Node]:
        """The nodes at the contact whose temperature is prescribed."""
        return [node for node in self.nodes.values() if node.prescribed]

    @cached_property
    def places(self) -> dict[str, Node]:
        """Nodes by the places that exchange power; the place of a body is its contact."""
        return (
            {node.name: node for slab in self.slabs.values() for node in slab.behind} | dict(self.nodes) | self.node_of
        )

    def owners(self, node: Node) -> str:
        """Return the members that share a node, in words."""
        return " and ".join(member for member, name in self.members.items() if name == node.name)

    def volume(self, body: str) -> dict[str, Expression]:
        """Return the places in a body with their fractions of its volume; the place at the contact comes first."""
        if body not in self.slabs:
            return {body: symengine.Integer(1)}
        slab = self.slabs[body]
        return dict(zip((body, *(node.name for node in slab.behind)), volume_shares(slab.points), strict=True))

    def with_energy(self, member: str, F: Expression) -> Thermal:
        """Return a copy with the free energy of a member [J/m^2]."""
        node = self.node_of[member]
        changed = node._replace(energies={**node.energies, member: F})
        return replace(self, nodes={**self.nodes, node.name: changed})


class Energy(NamedTuple):
    """Free energy of the interface [J/m^2], and the part of the interface on which friction acts."""

    psi: Expression
    unbonded: Expression
    """Fraction of the interface on which friction acts, in parallel with adhesion."""
    unbonded_energy: Expression
    """Elastic energy of the gap in series with friction, per area of that fraction [J/m^2]."""


NO_ENERGY = Energy(symengine.Integer(0), symengine.Integer(1), symengine.Integer(0))
NO_NODES = Thermal({}, {})


BOTH_BODIES = "interface", "each body"
"""Ends of the heat paths that lead into both bodies alike."""

STARTS = {"g_n": "Give `g_n` under `initial`: a gap that finds its equilibrium begins its search there, else at zero."}
"""Advice on a missing initial value of a variable that finds its equilibrium, by variable."""

TAKEN_NAMES = ("M", *(f"{x}_{k}" for x in "SUq" for k in ("1", "2", "c", "m", "t")))
"""Names of quantities that a parameter might have too: a law's M, or the second of two parameters called q."""


@dataclass
class Motion:
    """Part of the build on normal and tangential motion: mountings, tractions and rates."""

    far_fields: dict[str, Any] = field(default_factory=dict)
    """Mountings with their symbols, by axis."""
    ramp_rates: dict[str, Expression] = field(default_factory=dict)
    """Rates of the variables that a programme moves."""
    slips: tuple[Any, ...] = ()
    """Formulation of the tangential motion in each direction that moves by a balance."""
    slip_unknowns: dict[str, Any] = field(default_factory=dict)
    """Unknowns of the tangential balances if sliding has no inertia, by velocity."""
    creep_law: Any = None
    """The friction law whose traction is the unknown of sliding, if the velocity is not."""
    sliding_tractions: dict[str, Expression] = field(default_factory=dict)
    """Traction that resists sliding, by axis."""
    stick_limits: dict[str, Expression] = field(default_factory=dict)
    """Tangential traction up to which the interface sticks, by axis."""
    followers: dict[Any, Expression] = field(default_factory=dict)
    """Reset map of states that follow the normal gap when it jumps."""
    gap_rates: dict[str, Expression] = field(default_factory=dict)
    """Rates of the gaps that move by a balance."""


Record = Thermal | Bond | Energy | State | Account | Margin | Constraint | Equilibrium | PowerFlow | Note | str
"""Records that components yield; a string is a warning."""


@dataclass(eq=False)
class Build:
    """Everything that components have stated so far, with the queries and methods by which they state more."""

    scene: Scene
    parameters: Parameters = field(init=False)
    variables: Variables = field(init=False)
    t: Any = field(default_factory=lambda: symengine.Symbol("t"))
    thermal: Thermal = NO_NODES
    bonding: dict[str, Bond] = field(default_factory=dict)
    energy: Energy = NO_ENERGY
    closing_modes: Mapping[Expression, Expression] = field(default_factory=dict)
    """New values of modes when a rigid contact closes again."""
    rates: dict[Any, Expression] = field(default_factory=dict)
    """Time derivatives of the variables of the interface's free energy other than temperature."""
    inflow: dict[str, list[Expression]] = field(default_factory=dict)
    """Heat and mechanical power into each node [W/m^2]."""
    conductances: dict[tuple[str, str], list[Expression]] = field(default_factory=dict)
    """Conductances in parallel between two ends [W/(m^2 K)]."""
    states: list[State] = field(default_factory=list)
    named: list[Named] = field(default_factory=list)
    rows: Rows = field(default_factory=Rows)
    ledger: list[Account] = field(default_factory=list)
    margins: list[Margin] = field(default_factory=list)
    powers: list[PowerFlow] = field(default_factory=list)
    """Powers between places; the ledger and the balances of energy follow from them."""
    stored: list[Expression] = field(default_factory=list)
    """Energies without a temperature, such as those of springs and charges."""
    loads: dict[str, Load] = field(default_factory=dict)
    """Histories in use, by variable."""
    constraints: list[Constraint] = field(default_factory=list)
    """Constraints in the order in which they were stated."""
    quasi_static: list[Equilibrium] = field(default_factory=list)
    """Quasi-static gaps in the order in which they were stated."""
    motion: Motion = field(default_factory=Motion)
    notes: list[Note] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    used_names: set[str] = field(default_factory=set)

    def __post_init__(self) -> None:
        """Create parameters and variables, with the names of nodes, capacities and bonds reserved."""
        custom = [body.temperature for body in self.scene.bodies if isinstance(body.temperature, str)]
        capacities = [f"C_{node}" for node in (*custom, self.interface.temperature) if isinstance(node, str)]
        bonds = [variable.name for variable in self.interface.variables]
        self.parameters = Parameters([*TAKEN_NAMES, *custom, *capacities, *bonds])
        self.variables = Variables(self.parameters)

    @property
    def interface(self) -> Interface:
        """The interface of the scene."""
        return self.scene.interface

    @property
    def psi(self) -> Expression:
        """Free energy of the interface [J/m^2]."""
        return self.energy.psi

    @property
    def expansion_points(self) -> dict[Any, Expression]:
        """Initial values of the bonding variables, the points about which capacities are expanded."""
        return {bond.symbol: bond.initial for bond in self.bonding.values()}

    def add(self, record: Record) -> None:
        """Keep a record of a component."""
        match record:
            case Thermal():
                self.thermal = record
            case Energy():
                self.energy = record
            case Bond():
                self.bonding[str(record.symbol)] = record
            case Constraint():
                self.constrain(record)
            case _:
                lists: dict[type, list[Any]] = {
                    State: self.states,
                    Account: self.ledger,
                    Margin: self.margins,
                    Equilibrium: self.quasi_static,
                    PowerFlow: self.powers,
                    str: self.warnings,
                }
                lists.get(type(record), self.notes).append(record)

    @property
    def equilibria(self) -> list[Equilibrium]:
        """Quasi-static gaps; an elastic gap that slides reaches equilibrium before the displacement that pulls it."""
        return sorted(self.quasi_static, key=lambda item: item.slip)

    def energy_row(self, node: Node) -> Expression:
        """Return the energy balance of a node as a residual."""
        return balances.node_row(node, self.inflow.get(node.name, ()), self.rates, self.expansion_points)

    def name(self, quantity: Quantity, expression: Expression, *, output: bool = True) -> Expression:
        """Add a named quantity and return its symbol."""
        self.named.append(Named(quantity, expression, output))
        return symengine.Symbol(quantity.name)

    def store(self, quantity: Quantity, energy: Expression) -> None:
        """Add an energy [J/m^2] that has no temperature."""
        self.stored.append(self.name(quantity, energy))

    def constant(self, name: str, path: str, spec: Spec, value: float, *, internal: bool = False) -> Expression:
        """Add a scene-level number as a run-time parameter and return its symbol."""
        return self.parameters.constant(name, path, spec, value, internal)

    def bound(self, law: Friction) -> Friction:
        """Return a friction law with its parameters as symbols; it is bound once."""
        bound: Friction = self.variables.shared(law, f"interface.friction.{law.name()}")
        return bound

    def unique(self, base: str) -> str:
        """Return the name, with a number if it is taken."""
        name = next(n for n in chain((base,), (f"{base}_{i}" for i in count(2))) if n not in self.used_names)
        self.used_names.add(name)
        return name

    def prescribe(self, quantity: Quantity, load: Load) -> Expression:
        """Make a prescribed history a named quantity; its breakpoints will end a step."""
        name = quantity.name
        self.loads[name] = load
        return self.name(quantity, self.variables.bind(load, f"loading.{name}", unit=quantity.unit).value(self.t))

    def slope_of(self, name: str) -> Expression:
        """Return the time derivative of a prescribed variable between its jumps."""
        if name in self.motion.ramp_rates:
            return self.motion.ramp_rates[name]
        expression = next(item.expression for item in self.named if item.name == name)
        return derivative(expression, self.t)

    def rate_of(self, name: str) -> Expression:
        """Return the time derivative of a prescribed variable that stores energy; it must not jump."""
        if name not in self.motion.ramp_rates and (load := self.loads[name]).jumps():
            problem = f"it cannot jump (at t = {load.jumps()[0]:g} s): the work would be unknown"
            raise InputError(f"{name} stores energy, so {problem}. Give the jump a duration.", load.place)
        return self.slope_of(name)

    def refuse_foreign(self, F: Expression, own: set[Any], law: Law) -> None:
        """Raise InputError if a free energy depends on variables that its balance does not account for."""
        moving = {str(state.symbol) for state in self.states} | {node.name for node in self.thermal.nodes.values()}
        moving |= {item.name for item in self.named if item.name in self.loads and self.slope_of(item.name) != 0}
        moving -= {name for name, load in self.loads.items() if self.slope_of(name) == 0 and not load.jumps()}
        foreign = {str(symbol) for symbol in symengine.sympify(F).free_symbols - own} & moving
        if foreign:
            allowed = ", ".join(sorted(str(symbol) for symbol in own))
            problem = f"varies with {', '.join(sorted(foreign))}, which its balance does not know"
            raise InputError(f"the energy of {law.name()} {problem}. It may vary with {allowed}.", law.place)

    def constrain(self, stated: Constraint) -> Constraint:
        """Keep a constraint; its modes and registers become parameters that only edges change."""
        for mode in stated.modes:
            if self.mode(mode.name) is None:
                spec = Spec("1", " or ".join(f"{value:g}: {word}" for value, word in mode.words.items()))
                self.constant(mode.name, f"mode.{mode.name}", spec, mode.initial, internal=True)
        known = {register.name for register in self.registers}
        for register in (item for item in stated.registers if item.name not in known):
            spec = Spec("1", register.text)
            self.constant(register.name, f"register.{register.name}", spec, register.initial, internal=True)
        self.constraints.append(stated)
        return stated

    def constraint(self, mode: str) -> Constraint:
        """Return the constraint with the mode of that name; a constraint that never holds if the scene has none."""
        holding = (item for item in self.constraints if any(mode == other.name for other in item.modes))
        return next(holding, Constraint())

    def mode(self, name: str) -> Any:
        """Return the symbol of a mode, None if the scene has none of that name."""
        return next((mode.symbol for mode in self.constraint(name).modes if mode.name == name), None)

    @property
    def modes(self) -> list[Mode]:
        """The modes of all constraints; of a mode stated twice the last statement."""
        return list({mode.name: mode for item in self.constraints for mode in item.modes}.values())

    @property
    def registers(self) -> list[Register]:
        """The registers of all constraints."""
        return list({register.name: register for item in self.constraints for register in item.registers}.values())

    @property
    def edges(self) -> list[Edge]:
        """The edges of all constraints, each with its resets of the other constraints; those due at once come first."""
        edges = [edge for item in sorted(self.constraints, key=lambda item: not item.at_once) for edge in item.edges]
        for item in self.constraints:
            edges = [edge._replace(modes={**edge.modes, **item.resets(edge)}) for edge in edges]
        return edges

    @property
    def roles(self) -> tuple[Role, ...]:
        """Roles of the variables; a derived variable that is never read is left out."""
        there = {role.variable for role in self.variables.roles if self.variables.was_read(role.variable)}
        there |= {item.name for item in self.named}
        return tuple(role for role in self.variables.roles if role.role != "derived" or role.variable in there)

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Times [s] at which a load or its slope jumps."""
        return tuple(sorted({t for load in self.loads.values() for t in load.breakpoints()}))

    @property
    def cycles(self) -> tuple[str, ...]:
        """Paths of the frequencies of periodic loads."""
        paths = {name: load.path if load.place else f"loading.{name}" for name, load in self.loads.items()}
        return tuple(f"{paths[name]}.{load.cycle}" for name, load in self.loads.items() if load.cycle)

    def at_start(self, expression: Expression) -> float:
        """Return the value at the start, with one for variables without a value; NaN if it is undefined."""
        values = {parameter.symbol: parameter.at(0.0) for parameter in self.parameters.items} | {self.t: 0.0}
        values |= {state.symbol: state.initial for state in self.states}
        try:
            found = self.expanded(expression).subs(values)
            return float(found.subs({x: self.scene.initial.get(str(x), 1.0) for x in found.free_symbols}))
        except RuntimeError:  # a condition on an undefined number
            return math.nan

    def total_derivative(self, expression: Expression) -> Expression:
        """Return the time derivative of an expression of the states and of prescribed variables."""
        expanded = self.expanded(expression)
        rates = {state.symbol: state.dot for state in self.states}
        rates |= {node.T: node.T_dot for node in self.thermal.free}
        return sum((derivative(expanded, x) * x_dot for x, x_dot in rates.items()), derivative(expanded, self.t))

    @property
    def stretch(self) -> Expression:
        """Area stretch J_c; one if there is none, or if curved surfaces are given: these are as deformed already."""
        if self.scene.surface is not None:
            return symengine.Integer(1)
        return self.variables.get("J_c", "the balance") if self.variables.has("J_c") else symengine.Integer(1)

    def initial(self, name: str) -> float:
        """Return the initial value of a state; InputError if the case gives none."""
        if name not in self.scene.initial:
            unknown = [other for other, value in self.scene.initial.items() if math.isnan(value)]
            misspelt = f"; '{unknown[0]}' there is no variable" if unknown else ""
            message = f"{name} evolves but has no initial value. Add `{name}:` under `initial`{misspelt}."
            raise InputError(message, path="initial")
        return self.scene.initial[name]

    def areal(self, quantity: Quantity, nominal: Expression) -> Expression:
        """Name a quantity per current area, and per reference area if the two differ; return the nominal one."""
        if self.stretch == 1:
            return self.name(quantity, nominal)
        name, text = f"{quantity.name}_nominal", f"{quantity.long_name} per reference area"
        symbol = self.name(Quantity(name, quantity.unit, text, tag=quantity.tag), nominal)
        self.name(quantity, symbol / self.stretch)
        return symbol

    def law_domain(self, law: Law, bound: Law, own: Mapping[str, Expression], met: Collection[str] = ()) -> None:
        """Add where a law holds: the ranges that a run monitors, and the margins of its domain as ``bound``."""
        self.law_ranges(law, bound, own)
        self.law_margins(bound, own, met)

    def law_ranges(self, law: Law, bound: Law, own: Mapping[str, Expression]) -> None:
        """Add the ranges of variables that a run monitors for a law, which vary with its parameters alone."""
        if not law.ranges:
            return
        symbols = {item.path: item.symbol for item in self.parameters.items}
        reference = bound.bind({name: symbols[f"{bound.path}.{name}"] for name in law.varying})
        for name, (low, high) in reference.ranges.items():
            value = symengine.sympify(self._read(law, name, own))
            if not value.is_Symbol and not self.is_named(name):  # a sum of coverages of bonds
                value = self.name(VARIABLES[name], value)
            self.notes.append(Range(str(value) if value.is_Symbol else name, low, high, law.title))

    def law_margins(self, law: Law, own: Mapping[str, Expression], met: Collection[str] = ()) -> None:
        """Add the margins of the domain of a law, except for the bounds in ``met``, which its arguments satisfy."""
        ends = f"where the law {law.name()} ends"
        for name in law.positive:
            sought = name in self.motion.gap_rates and name not in self.scene.initial
            value, reason = self._read(law, name, own), f"{law.source(name)} reached zero, {ends}"
            margin = Margin(f"{name} > 0", value, reason, path=law.path)
            self.margins.append(margin._replace(remedy=STARTS.get(name, "") if sought else "", domain=True))
        for name in law.nonnegative:
            if name in met:
                continue
            value, least = self._read(law, name, own), law.least.get(name, 0)
            # The roundoff of a sum is that of its terms, so the bound gets this slack.
            whole = self.expanded(value)
            rounding = sum((absolute(term) for term in whole.args), symengine.Integer(0)) if whole.is_Add else 0
            slack = NO_AMOUNT + RUN_EPS * rounding + RUN_EPS * absolute(least)
            reason = f"{law.source(name)} fell below {least if least != 0 else 'zero'}, {ends}"
            self.margins.append(Margin(f"{name} >= {least}", value - least + slack, reason, path=law.path))
        self._narrow_places(law, own, met)
        self._limit_margins(law, own)

    def _limit_margins(self, law: Law, own: Mapping[str, Expression]) -> None:
        """Add the margins of the ranges of its variables that a law is made for."""
        for name, ends_of in law.limits.items():
            value = self._read(law, name, own)
            told = [f"{end:g}" if isinstance(end, int | float) else str(end) for end in ends_of]
            given = [
                each for each in zip((">=", "<="), ends_of, told, strict=True) if each[1] not in (-math.inf, math.inf)
            ]
            size = reduce(lambda a, b: where(a > b, a, b), [absolute(end) for _, end, _ in given])
            slack = NO_AMOUNT * size
            reason = f"{law.source(name)} left the range of {law.called}, {' to '.join(told)}"
            for side, end, text in given:
                inside = value - end + slack if side == ">=" else end + slack - value
                self.margins.append(Margin(f"{name} {side} {text}", inside, reason, path=law.path, domain=True))

    def _read(self, law: Law, name: str, own: Mapping[str, Expression]) -> Expression:
        """Return the expression that a law reads by a name: from its own arguments, else from the scene."""
        return own[name] if name in own else self.variables.get(law.source(name), law)

    def _narrow_places(self, law: Law, own: Mapping[str, Expression], met: Collection[str]) -> None:
        """Add margins that end steps at the kinks of a law, and at peaks that a step might pass over."""
        for name, bend in law.kinks.items():
            if name not in law.least or name in met:  # else the law ends there
                reason = f"{law.name()} bends at this {name}"
                self.margins.append(Margin(name, self._read(law, name, own) - bend, reason, False))
        for name in met:  # beyond its bound the law is given that
            self._narrow(law, name, self._read(law, name, own), (law.least.get(name, 0),))
        for name, tops in {**dict.fromkeys(law.positive, ()), **law.peaks}.items():
            if name not in own and not self.variables.has(name) and name in optional(law.statement):
                continue
            value = self._read(law, name, own)
            if not symengine.sympify(value).is_Number:
                self._narrow(law, name, value, tops if isinstance(tops, Sequence) else (tops,))

    def _narrow(self, law: Law, name: str, value: Expression, tops: Sequence[Expression]) -> None:
        """Add margins that end a step at peaks and singular ends of a law, and at turning points of a gap with a mass.

        A turning point may lie just short of such a peak, which the step would miss.
        """
        reason, moving = f"{law.name()} is narrow near here", symengine.sympify(self.expanded(value)).free_symbols
        found = [Margin(f"{name} at place {i} of {law.name()}", value - top, reason) for i, top in enumerate(tops, 1)]
        states = {state.symbol for state in self.states}
        for gap, rate in self.motion.gap_rates.items():
            # Only a velocity that is a state, by inertia or a resistance to motion, changes its sign smoothly.
            if symengine.Symbol(gap) in moving and symengine.sympify(rate).free_symbols & states:
                found.append(Margin(f"{gap} turns", rate, reason))
        known = {margin.expression for margin in self.margins}
        self.margins += [item._replace(terminal=False, peak=True) for item in found if item.expression not in known]

    def varying_margins(self) -> None:
        """Add margins that keep varying parameters and their factors in their range, with slack for roundoff."""
        found = []
        for factor, bound, x in self.variables.factors:
            self.law_domain(factor, bound, {} if x is None else {"x": x})
        for law, name, spec, value in self.variables.varying:
            slack = max(NO_AMOUNT * abs(getattr(law, name).value), TINY)  # zero is within a closed bound, too
            low, why = max(spec.above, spec.at_least), f"{law.title}: {name} left its range ({spec.range}) as it varies"
            if math.isfinite(low):
                above = value - low + (slack if spec.at_least >= low else 0)
                found.append(Margin(f"{name} of {law.label} {spec.range}", above, why))
            if math.isfinite(spec.at_most):
                found.append(Margin(f"{name} of {law.label} at most", spec.at_most + slack - value, why))
        self.margins[:0] = found

    def shares(self) -> dict[str, Expression]:
        """Return the fractions of the interface's heat that enter the bodies and the surroundings without a medium."""
        alpha = self._share("alpha", "interface.partition", self.interface.partition, "body 1")
        first, second = (body.name for body in self.scene.bodies)
        if not self.interface.loss:
            return {first: alpha, second: 1 - alpha}
        loss = self._share("alpha_a", "interface.partition.surroundings", self.interface.loss, "the surroundings")
        return {first: alpha, second: 1 - alpha - loss, "surroundings": loss}

    def _share(self, name: str, path: str, value: float, end: str) -> Expression:
        if not self.variables.has(path):
            spec = Spec("1", f"fraction of heat into {end}", at_least=0, at_most=1)
            self.variables.define(path, lambda: self.constant(name, path, spec, value), "constant", path)
        return self.variables.get(path, "the interface", "interface")

    def is_named(self, name: str) -> bool:
        """True if a named quantity has this name."""
        return any(item.name == name for item in self.named)

    def expanded(self, expression: Expression) -> Expression:
        """Return the expression with the names of quantities replaced by their definitions."""
        read, needed = set(symengine.sympify(expression).free_symbols), list[Named]()
        for item in reversed(self.named):  # an expression contains earlier names only
            if item.symbol in read:
                read |= symengine.sympify(item.expression).free_symbols
                needed.append(item)
        return without(expression, definitions(needed[::-1]))
