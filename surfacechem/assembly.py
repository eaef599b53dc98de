"""From a scene to its system: roles read off, potentials differentiated, dissipative laws stated, balances formed."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

import symengine

from surfacechem import balances
from surfacechem.balances import Node
from surfacechem.errors import InputError, suggestion
from surfacechem.expressions import Expression, depends, derivative
from surfacechem.quantities import VARIABLES, Quantity
from surfacechem.scene import Body, Scene
from surfacechem.system import Account, Margin, Named, State, System
from surfacechem.terms import HeatTransfer, Law, Load, RateLaw, Spec
from surfacechem.variables import Parameters, Variables

COLD = 1e-9
"""Temperature that counts as zero [K]."""

LOADABLE = ("phi", "g_n", "g_t", "v", "p", "J_c", "Q_1", "Q_2", "Q_c")
"""Variables that a case may prescribe, beside the temperatures."""


def assemble(scene: Scene) -> System:
    """The system of a scene; InputError where a variable that is read has no role, or two."""
    build = Build(scene)
    build.temperatures()
    build.prescribed_variables()
    build.bonding_variables()
    build.free_energy()
    build.reactions()
    build.friction()
    build.heat_paths()
    build.equations()
    build.totals()
    return build.system()


class Build:
    """the system under construction; each method is one stage and leaves its results for the next."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.interface = scene.interface
        custom = [body.temperature for body in scene.bodies if isinstance(body.temperature, str)]
        self.parameters = Parameters([*custom, *(variable.name for variable in self.interface.variables)])
        self.variables = Variables(self.parameters)
        self.t = symengine.Symbol("t")
        self.nodes: dict[str, Node] = {}
        self.node_of: dict[str, Node] = {}
        """Node of each body name, of 'interface' and of 'surroundings'."""
        self.psi: Expression = symengine.Integer(0)
        self.states: list[State] = []
        self.named: list[Named] = []
        self.rows: dict[str, Expression] = {}
        self.ledger: list[Account] = []
        self.margins: list[Margin] = []
        self.bonding: dict[str, tuple[Any, Any, Expression]] = {}
        """Symbol, time derivative and density of each bonding variable that is a state."""
        self.about: dict[Any, Expression] = {}
        self.dissipation: dict[str, Expression] = {}
        """Power that each interface law turns into heat [W/m^2], by the law's label."""
        self.into_body: dict[str, Expression] = {}
        """Heat that reaches each body other than through the interface [W/m^2]."""
        self.from_interface: dict[str, Expression] = {}
        """Heat that each body receives from the interface and the other body by stated laws [W/m^2]."""
        self.breakpoints: set[float] = set()
        self.used_names: set[str] = set()

    # -- helpers ------------------------------------------------------------------------------------------------

    def name(self, quantity: Quantity, expression: Expression, *, output: bool = True) -> Expression:
        """Add a named quantity and return its symbol."""
        self.named.append(Named(quantity, expression, output))
        return symengine.Symbol(quantity.name)

    def constant(self, name: str, path: str, unit: str, text: str, value: float) -> Expression:
        """A scene-level number as a run-time parameter."""
        return self.parameters.constant(name, path, Spec(unit, text), value)

    def label(self, law: Law) -> str:
        """A short unique name of a law for its quantities."""
        base = law.label
        name = next(n for n in (base, *(f"{base}_{i}" for i in range(2, 1000))) if n not in self.used_names)
        self.used_names.add(name)
        return name

    def history(self, name: str, load: Load) -> Expression:
        """A prescribed history as an expression of time; its breakpoints will end a step."""
        self.breakpoints.update(load.breakpoints())
        return self.variables.bind(load, f"loading.{name}").value(self.t)

    def prescribe(self, quantity: Quantity, load: Load) -> Expression:
        """Make a prescribed variable a named quantity."""
        return self.name(quantity, self.history(quantity.name, load))

    def rate_of(self, symbol: Any) -> Expression:
        """Time derivative of a prescribed variable."""
        expression = next(item.expression for item in self.named if item.name == str(symbol))
        return derivative(expression, self.t)

    @property
    def stretch(self) -> Expression:
        """Area stretch J_c, or one."""
        return self.variables.get("J_c", "the balance") if self.variables.has("J_c") else symengine.Integer(1)

    # -- stages -------------------------------------------------------------------------------------------------

    def temperatures(self) -> None:
        """Nodes: who carries which temperature, and which are prescribed."""
        if self.scene.T_0 is not None:
            value = self.scene.T_0
            self.variables.define(
                "T_0", lambda: self.constant("T_0", "T_0", "K", "reference temperature", value), "constant", "T_0"
            )
        for k, body in enumerate(self.scene.bodies, start=1):
            self._join(f"T_{k}", body.temperature, body.name)
        if self.interface.temperature is not None:
            self._join("T_c", self.interface.temperature, "interface")
        else:
            self.variables.define("T_c", self._mean_temperature, "derived", "harmonic mean of the bodies, no medium")
        if self.scene.surroundings is not None:
            self._join("T_a", self.scene.surroundings, "surroundings")
        for k, body in enumerate(self.scene.bodies, start=1):
            self._body_energy(body, f"_{k}")

    def _join(self, variable: str, temperature: str | Load, member: str) -> None:
        load = temperature if isinstance(temperature, Load) else self.scene.loading.get(temperature)
        name = variable if isinstance(temperature, Load) else temperature
        node = self.nodes.get(name) or self._new_node(name, load)
        self.node_of[member] = node
        role = "prescribed" if node.prescribed else ("temperature node" if name == variable else "merged")
        self.variables.define(variable, lambda: node.T, role, f"{member}: {name}")

    def _new_node(self, name: str, load: Load | None) -> Node:
        clash = name in VARIABLES and name not in ("T_1", "T_2", "T_c", "T_a")
        if clash or not name.isidentifier():
            raise InputError(
                f"'{name}' cannot name a temperature: use letters, digits and _, and no symbol of the theory."
            )
        symbol = symengine.Symbol(name)
        quantity = VARIABLES.get(name, Quantity(name, "K", f"temperature of node {name}", name))
        if load is None:
            node = Node(name, symbol, symengine.Symbol(f"d{name}_dt"))
        else:
            self.prescribe(quantity, load)
            node = Node(name, symbol, self.rate_of(symbol), prescribed=True)
        self.nodes[name] = node
        return node

    def _mean_temperature(self) -> Expression:
        T_1, T_2 = (self.variables.get(f"T_{k}", "the interface") for k in (1, 2))
        share_1, share_2 = self.shares()
        return self.name(VARIABLES["T_c"], 1 / (share_1 / T_1 + share_2 / T_2))

    def shares(self) -> tuple[Expression, Expression]:
        """Fractions of the interface's heat that go into body 1 and 2 where there is no medium."""
        if not self.variables.has("partition"):
            path, text, value = "interface.partition", "fraction of heat into body 1", self.interface.partition
            self.variables.define("partition", lambda: self.constant("alpha", path, "1", text, value), "constant", path)
        alpha = self.variables.get("partition", "the interface")
        return alpha, 1 - alpha

    def _body_energy(self, body: Body, suffix: str) -> None:
        node = self.node_of[body.name]
        if body.energy is not None:
            law = self.variables.bind(body.energy, f"bodies.{body.name}", suffix)
            node.energies[body.name] = law.energy(T=node.T, T_0=self.variables.get("T_0", f"the body {body.name}"))

    def prescribed_variables(self) -> None:
        """Histories under ``loading``; each comes to life when something reads it."""
        for name, load in self.scene.loading.items():
            if name in self.nodes:
                continue
            if name not in LOADABLE:
                known = [*LOADABLE, *self.nodes]
                raise InputError(f"loading: nothing is called '{name}'.{suggestion(name, known)}")
            self.variables.define(name, partial(self.prescribe, VARIABLES[name], load), "prescribed", "loading")

    def bonding_variables(self) -> None:
        """Bonding states, site densities and their bounds."""
        sites = self.interface.sites
        if sites is not None:
            define = self.variables.define
            density = sites.density
            define(
                "N_c",
                lambda: self.constant(
                    "N_c", "interface.sites", "1/m^2", "nominal density of reference bonding sites", density
                ),
                "constant",
                "interface.sites",
            )
            define("n_c", self._current_density, "derived", "interface.sites")
        evolving = {name for law in self.interface.reactions for name in law.stoichiometry()}
        if "phi" in evolving:
            limit = sites.phi_max if sites else 1.0
            self._bonding_state(VARIABLES["phi"], self.variables.get("N_c", "the bonding reaction"), limit)
        for variable in self.interface.variables:
            amount = self.constant(
                f"N_{variable.name}", f"interface.{variable.name}.density", "1/m^2", "site density", variable.density
            )
            self._bonding_state(Quantity(variable.name, "1", variable.long_name), amount, 1.0)
            self._amounts(variable.name, amount)
        if self.interface.bonds:
            self.variables.define("phi", self._derived_phi, "derived", "coverages of bonds")

    def _current_density(self) -> Expression:
        nominal = self.variables.get("N_c", "the interface")
        if not self.variables.has("J_c"):
            return nominal
        return self.name(VARIABLES["n_c"], nominal / self.stretch)

    def _amounts(self, name: str, density: Expression) -> None:
        """What a bonding variable amounts to where it is one: N_x per reference area, n_x per current area."""
        self.variables.define(f"N_{name}", lambda: density, "constant", f"interface.{name}")
        self.variables.define(f"n_{name}", lambda: density / self.stretch, "derived", f"interface.{name}")

    def _derived_phi(self) -> Expression:
        N_c = self.variables.get("N_c", "the bonding state")
        bonds = sum(self.bonding[name][0] * self.bonding[name][2] for name in self.interface.bonds)
        return bonds / N_c

    def _bonding_state(self, quantity: Quantity, density: Expression, limit: float) -> None:
        name = quantity.name
        symbol, dot = symengine.Symbol(name), symengine.Symbol(f"d{name}_dt")
        initial = self.initial(name)
        if not 0 <= initial <= limit:
            raise InputError(f"initial {name} = {initial:g} is outside its range: 0 to {limit:g}.")
        self.variables.define(name, lambda: symbol, "evolved", "bonding")
        self.bonding[name] = (symbol, dot, density)
        self.about[symbol] = self.constant(f"{name}_i", f"initial.{name}", "1", f"initial {name}", initial)
        self.states.append(State(quantity, symbol, dot, initial, 1.0, algebraic=False))
        slack = self.variables.get("slack", "bounds") if self.variables.has("slack") else self._slack()
        self.margins.append(Margin(f"{name} >= 0", symbol + slack, f"{name} fell below its bound 0"))
        top = self.constant(f"{name}_max", f"{name}_max", "1", f"upper bound of {name}", limit)
        self.margins.append(Margin(f"{name} <= max", top + slack - symbol, f"{name} rose above its bound {limit:g}"))

    def _slack(self) -> Expression:
        text = "how far rounding may carry a bonding variable beyond its bounds"
        self.variables.define("slack", lambda: self.constant("slack", "run.slack", "1", text, 1e-9), "constant", "run")
        return self.variables.get("slack", "bounds")

    def initial(self, name: str) -> float:
        """Initial value of a state; InputError where the case gives none."""
        if name not in self.scene.initial:
            raise InputError(f"initial: {name} evolves but has no initial value. Add `{name}:` under `initial`.")
        return self.scene.initial[name]

    def free_energy(self) -> None:
        """The sum of the interface's potentials, and the tractions that follow."""
        for law in self.interface.potentials:
            bound = self.variables.bind(law, f"interface.potential.{law.name()}")
            self.psi += self.variables.call(bound, bound.statement)
        if self.interface.temperature is not None:
            node = self.node_of["interface"]
            node.energies["interface"] = self.psi
        elif any(depends(self.psi, self._node_symbol(name)) for name in self.nodes):
            raise InputError(
                "the interface's potential depends on temperature, but the interface has none. "
                "Give `interface.temperature` a name."
            )
        for gap, traction in (("g_n", "t_n"), ("g_t", "t_e")):
            symbol = symengine.Symbol(gap)
            if depends(self.psi, symbol):
                text = "normal traction on body 1" if gap == "g_n" else "elastic tangential traction on body 1"
                self._areal(Quantity(traction, "Pa", text, tag="e:cons_tc"), derivative(self.psi, symbol))
        if self.variables.has("p") is False and depends(self.psi, symengine.Symbol("g_n")):
            self.variables.define(
                "p", lambda: self.name(VARIABLES["p"], -symengine.Symbol("t_n")), "derived", "normal traction"
            )
        elif self.variables.has("p") and depends(self.psi, symengine.Symbol("g_n")):
            raise InputError(
                "p has two roles: prescribed (loading) and derived (a potential gives the normal traction)."
            )

    def _node_symbol(self, name: str) -> Any:
        return symengine.Symbol(name)

    def _areal(self, quantity: Quantity, nominal: Expression) -> Expression:
        """A quantity per current area, and per reference area too where the two differ; returns the nominal one."""
        if not self.variables.has("J_c"):
            return self.name(quantity, nominal)
        per_reference = Quantity(
            f"{quantity.name}_nominal", quantity.unit, f"{quantity.long_name} per reference area", tag=quantity.tag
        )
        symbol = self.name(per_reference, nominal)
        self.name(quantity, symbol / self.stretch)
        return symbol

    def reactions(self) -> None:
        """Chemical potentials, rates, bond balances and what the reactions dissipate."""
        mu = {
            name: self._chemical_potential(name, symbol, density) for name, (symbol, _, density) in self.bonding.items()
        }
        total = {name: symengine.Integer(0) for name in self.bonding}
        for law in self.interface.reactions:
            label = self.label(law)
            nu = law.stoichiometry()
            rate = self._rate(law, label, sum(n * mu[x] for x, n in nu.items()))
            self.dissipation[label] = -self.stretch * rate * sum(n * mu[x] for x, n in nu.items())
            for x, n in nu.items():
                total[x] += n * rate
        for name, (_, dot, density) in self.bonding.items():
            self.rows[name] = balances.site_balance(total[name], dot, density, self.stretch)
            formed = Quantity(f"formed_{name}", "1", f"change of {name} by all reactions")
            self.ledger.append(Account(formed, dot - self.rows[name], "bonds", name))
        self._prescribed_bonding()

    def _chemical_potential(self, name: str, symbol: Any, density: Expression) -> Expression:
        M = derivative(self.psi, symbol)
        suffix = "" if name == "phi" else f"_{name}"
        M = self.name(Quantity(f"M{suffix}", "J/m^2", f"chemical potential of {name} per area", tag="e:SMuc"), M)
        long_name = "chemical potential per bond" if name == "phi" else f"chemical potential of {name} per site"
        return self.name(Quantity(f"mu{suffix}", "J", long_name, tag="e:muc"), M / density, output=name == "phi")

    def _rate(self, law: RateLaw, label: str, affinity: Expression) -> Expression:
        bound = self.variables.bind(law, f"interface.bonding.{law.name()}")
        own = {"mu": affinity, "t": self.t}
        if "phi" in self.bonding:
            symbol, _, density = self.bonding["phi"]
            own["dmu_dphi"] = derivative(derivative(self.psi, symbol), symbol) / density
        rate = self.variables.call(bound, bound.statement, own)
        self._law_margins(law, own)
        return self.name(Quantity(f"R_{label}", "1/(m^2 s)", f"net rate of {law.title}", tag="e:R"), rate)

    def _law_margins(self, law: Law, own: Mapping[str, Expression]) -> None:
        for name in law.positive:
            value = own[name] if name in own else self.variables.get(name, law)
            reason = f"{name} reached zero, where the law {law.name()} ends"
            self.margins.append(Margin(f"{name} > 0", value, reason))

    def _prescribed_bonding(self) -> None:
        phi = symengine.Symbol("phi")
        if "phi" in self.bonding or not depends(self.psi, phi):
            return
        M = self.name(
            Quantity("M", "J/m^2", "chemical potential of phi per area", tag="e:SMuc"), derivative(self.psi, phi)
        )
        rate = self.rate_of(phi)
        if rate != 0:
            self.dissipation["prescribed_bonding"] = -M * rate

    def friction(self) -> None:
        """Sliding tractions and what they dissipate; their power comes from outside."""
        for law in self.interface.frictions:
            label = self.label(law)
            bound = self.variables.bind(law, f"interface.friction.{law.name()}")
            traction = self.variables.call(bound, bound.statement)
            self._law_margins(law, {})
            traction = self.name(Quantity(f"t_{label}", "Pa", f"tangential traction of {law.title}"), traction)
            v = self.variables.get("v", law)
            power = self.stretch * traction * v
            self.dissipation[label] = power
            self._supply(f"W_{label}", f"work done against {law.title}", power, None)
            self._reversal()

    def _reversal(self) -> None:
        v = symengine.Symbol("v")
        if self.rate_of(v) != 0 and not any(margin.name == "v" for margin in self.margins):
            self.margins.append(Margin("v", v, "sliding reverses", terminal=False))

    def _supply(self, name: str, text: str, power: Expression, T: Expression | None) -> None:
        """Book power that comes from outside; as heat at temperature T unless that is None."""
        self.ledger.append(Account(Quantity(name, "J/m^2", text), power, "energy supply"))
        if T is not None:
            entropy = Quantity(f"{name}_entropy", "J/(m^2 K)", f"entropy supplied with {text}")
            self.ledger.append(Account(entropy, power / T, "entropy supply"))

    def heat_paths(self) -> None:
        """Fluxes between nodes, external heat, and the heat of friction and reaction where there is no medium."""
        for body in self.scene.bodies:
            self.into_body[body.name] = self.from_interface[body.name] = symengine.Integer(0)
        for law in self.scene.heat:
            self._heat_path(law)
        for member, Q in ((self.scene.bodies[0].name, "Q_1"), (self.scene.bodies[1].name, "Q_2"), ("interface", "Q_c")):
            if self.variables.has(Q):
                self._external_heat(member, Q)
        if self.interface.temperature is None:
            heat = sum(self.dissipation.values(), symengine.Integer(0))
            if heat != 0:
                self._share(heat)

    def _share(self, heat: Expression) -> None:
        for body, share in zip(self.scene.bodies, self.shares(), strict=True):
            self.node_of[body.name].inflow.append(share * heat)
            self.from_interface[body.name] += share * heat

    def _heat_path(self, law: HeatTransfer) -> None:
        a, b = law.between
        nodes = [self._end(end, law) for end in (a, b)]
        if nodes[0] is nodes[1]:
            raise InputError(f"heat path between {a} and {b}: both share the temperature {nodes[0].name}; remove it.")
        bound = self.variables.bind(law, f"heat.{law.name()}")
        h = self.variables.call(bound, bound.statement)
        area = symengine.Integer(1) if "surroundings" in (a, b) else self.stretch
        quantity = Quantity(self.label_path(law), "W/m^2", f"heat flux from {a} to {b}", tag="e:qc_k1")
        difference = nodes[0].T - nodes[1].T
        flux = self.name(quantity, area * h * difference)
        nodes[0].inflow.append(-flux)
        nodes[1].inflow.append(flux)
        production = area * h * difference**2 / (nodes[0].T * nodes[1].T)
        self._production(quantity.name, f"heat flow from {a} to {b}", production)
        for end, sign in ((a, -1), (b, 1)):
            if end in self.from_interface:
                group = self.into_body if "surroundings" in (a, b) else self.from_interface
                group[end] += sign * flux

    def label_path(self, law: HeatTransfer) -> str:
        """Unique name of the flux along a heat path."""
        short = {body.name: str(k) for k, body in enumerate(self.scene.bodies, start=1)}
        short |= {"interface": "c", "surroundings": "a"}
        base = "q_" + "".join(short[end] for end in law.between)
        name = next(n for n in (base, *(f"{base}_{i}" for i in range(2, 1000))) if n not in self.used_names)
        self.used_names.add(name)
        return name

    def _end(self, end: str, law: HeatTransfer) -> Node:
        if end in self.node_of:
            return self.node_of[end]
        if end == "interface":
            raise InputError(
                "a heat path ends at the interface, which has no temperature. Give `interface.temperature`."
            )
        if end == "surroundings":
            raise InputError("a heat path ends at the surroundings. Give `surroundings: {temperature: ...}`.")
        raise InputError(f"heat path: no end '{end}'.{suggestion(end, [*self.node_of, 'interface', 'surroundings'])}")

    def _external_heat(self, member: str, name: str) -> None:
        Q = self.variables.get(name, "the energy balance")
        text = f"external heat into {member}"
        if member in self.node_of:
            self.node_of[member].inflow.append(Q)
            self._supply(f"H_{name[2:]}", text, Q, self.node_of[member].T)
        else:
            self._supply(f"H_{name[2:]}", text, Q, self.variables.get("T_c", "External heat"))
            self._share(Q)
        if member in self.into_body:
            self.into_body[member] += Q

    def _production(self, name: str, text: str, rate: Expression) -> None:
        sigma = Quantity(f"sigma_{name}", "W/(m^2 K)", f"entropy production of {text}")
        symbol = self.name(sigma, rate)
        integral = Quantity(f"entropy_{name}", "J/(m^2 K)", f"entropy produced by {text}")
        self.ledger.append(Account(integral, symbol, "entropy production", name))

    def equations(self) -> None:
        """The work of the gaps, dissipation, energy balances, states and margins of the temperatures."""
        gap_rates = self._gaps()
        self._dissipation()
        rates = {symbol: dot for symbol, dot, _ in self.bonding.values()} | gap_rates
        phi = symengine.Symbol("phi")
        if phi not in rates and depends(self.psi, phi):
            rates[phi] = self.rate_of(phi)
        free = [node for node in self.nodes.values() if not node.prescribed]
        for node in free:
            self._temperature_state(node)
        centre = self.node_of.get("interface")
        if centre is None or centre.prescribed:
            centre = None
        self._own_rows = {node.name: balances.node_row(node, rates, self.about) for node in free}
        self._rates = rates
        self.rows |= balances.energy_rows(free, centre, rates, self.about)
        for node in free:
            self._temperature_margins(node)
        for node in self.nodes.values():
            if node.prescribed:
                self._recovered_heat(node, rates)

    def _gaps(self) -> dict[Any, Expression]:
        """Rates of the gaps that the potential depends on; books the work of the tractions."""
        rates: dict[Any, Expression] = {}
        for gap in ("g_n", "g_t"):
            symbol = symengine.Symbol(gap)
            if not depends(self.psi, symbol):
                continue
            rates[symbol] = self.rate_of(symbol)
            power = derivative(self.psi, symbol) * rates[symbol]
            if power != 0:
                self._supply(f"W_{gap}", f"work done on the gap {gap}", power, None)
                self._give_power(power)
        return rates

    def _give_power(self, power: Expression) -> None:
        if "interface" in self.node_of:
            self.node_of["interface"].inflow.append(power)

    def _dissipation(self) -> None:
        for label, power in self.dissipation.items():
            text = label.replace("_", " ")
            symbol = self.name(Quantity(f"D_{label}", "W/m^2", f"dissipation of {text}"), power)
            self.ledger.append(
                Account(
                    Quantity(f"heat_{label}", "J/m^2", f"energy dissipated by {text}"), symbol, "dissipation", label
                )
            )
            self._production(label, text, symbol / self.variables.get("T_c", "the dissipation"))
            if label in self._frictions():
                self._give_power(symbol)

    def _frictions(self) -> set[str]:
        return {account.quantity.name[2:] for account in self.ledger if account.quantity.name.startswith("W_")}

    def _temperature_state(self, node: Node) -> None:
        F = node.free_energy
        algebraic = balances.second(F, node.T) == 0
        members = [body for body in self.scene.bodies if self.node_of[body.name] is node]
        if algebraic and members:
            raise InputError(
                f"nothing evolves or prescribes {node.name}: give {members[0].name} a heat capacity C, or its "
                "temperature a value."
            )
        initial = self.scene.initial.get(node.name, self._guess()) if algebraic else self.initial(node.name)
        if not initial > 0:
            raise InputError(f"initial {node.name} = {initial:g} K is not an absolute temperature above zero.")
        quantity = VARIABLES.get(node.name, Quantity(node.name, "K", self._node_title(node), node.name))
        self.states.append(State(quantity, node.T, node.T_dot, initial, initial, algebraic))

    def _node_title(self, node: Node) -> str:
        members = [name for name, other in self.node_of.items() if other is node]
        return "temperature of " + " and ".join(members)

    def _guess(self) -> float:
        """Start value for an algebraic interface temperature: the mean of the bodies."""
        values = [self.scene.initial.get(self.node_of[body.name].name) for body in self.scene.bodies]
        known = [value for value in values if value is not None]
        loads = [body.temperature for body in self.scene.bodies if isinstance(body.temperature, Load)]
        known += [float(load.bind(load.piece(0.0)).value(0.0)) for load in loads]
        return sum(known) / len(known) if known else float(self.scene.T_0 or 300.0)

    def _temperature_margins(self, node: Node) -> None:
        self.margins.append(Margin(f"{node.name} > 0", node.T - COLD, f"the temperature {node.name} reached zero"))
        if next(state for state in self.states if state.name == node.name).algebraic:
            self._fold_margin(node)
        elif "interface" in node.energies and balances.second(self.psi, node.T) != 0:
            capacity = balances.conditioned(node.capacity(), self.about)
            quantity = Quantity(f"C_{node.name}", "J/(m^2 K)", f"heat capacity of {self._node_title(node)[15:]}")
            symbol = self.name(quantity, capacity)
            reason = f"the heat capacity at {node.name} was lost"
            self.margins.append(Margin(f"C_{node.name} > 0", symbol, reason))

    def _fold_margin(self, node: Node) -> None:
        """An algebraic temperature is stable while heat leaves faster than it is produced as it rises."""
        explicit = {dot: -(self.rows[name] - dot) for name, (_, dot, _) in self.bonding.items()}
        row = self._expanded(self._own_rows[node.name].subs(explicit))
        slope = derivative(row, node.T)
        state_symbols = {state.symbol for state in self.states}
        if slope.free_symbols & state_symbols:
            reason = f"ignition: no temperature {node.name} balances the heat that the interface produces"
            self.margins.append(Margin(f"stable {node.name}", slope, reason))

    def _expanded(self, expression: Expression) -> Expression:
        result: dict[Any, Expression] = {}
        for item in self.named:
            result[symengine.Symbol(item.name)] = symengine.sympify(item.expression).subs(result)
        return symengine.sympify(expression).subs(result)

    def _recovered_heat(self, node: Node, rates: Mapping[Any, Expression]) -> None:
        """The heat that must be supplied from outside to keep a prescribed temperature."""
        supply = balances.node_row(node, rates, self.about)
        if supply != 0:
            symbol = self.name(Quantity(f"Q_{node.name}", "W/m^2", f"heat supplied to keep {node.name}"), supply)
            self._supply(f"H_{node.name}", f"heat supplied to keep {node.name}", symbol, node.T)

    def totals(self) -> None:
        """Energies, entropies and the fluxes into the bodies."""
        energies, entropies = [], []
        for node in self.nodes.values():
            for member, F in node.energies.items():
                if F == 0:
                    continue
                suffix = self._suffix(member)
                energies.append(
                    self._total(f"U_{suffix}", "J/m^2", "internal energy", member, balances.internal_energy(F, node.T))
                )
                if derivative(F, node.T) != 0:
                    entropies.append(
                        self._total(f"S_{suffix}", "J/(m^2 K)", "entropy", member, balances.entropy(F, node.T))
                    )
        if self.interface.temperature is None and self.psi != 0:
            energies.append(self._total("U_c", "J/m^2", "internal energy", "interface", self.psi))
        self.name(Quantity("E_total", "J/m^2", "total energy"), sum(energies, symengine.Integer(0)))
        self.name(Quantity("S_total", "J/(m^2 K)", "total entropy"), sum(entropies, symengine.Integer(0)))
        self._fluxes()
        if self.interface.bonds:
            self.name(VARIABLES["phi"], self.variables.get("phi", "the dataset"))

    def _total(self, name: str, unit: str, what: str, member: str, expression: Expression) -> Expression:
        return self.name(Quantity(name, unit, f"{what} of {member}"), expression)

    def _suffix(self, member: str) -> str:
        names = [body.name for body in self.scene.bodies]
        return str(names.index(member) + 1) if member in names else "c"

    def _fluxes(self) -> None:
        fluxes = [self._flux(k, body) for k, body in enumerate(self.scene.bodies, start=1)]
        known = [flux for flux in fluxes if flux is not None]
        if len(known) == 2:
            self.name(Quantity("q_m", "W/m^2", "mean heat flux into the bodies", tag="e:qm_def"), sum(known) / 2)
            self.name(
                Quantity("q_t", "W/m^2", "transfer heat flux from body 2 to body 1", tag="e:qt_def"),
                (known[0] - known[1]) / 2,
            )

    def _flux(self, k: int, body: Body) -> Expression | None:
        """Heat into a body from the interface: stated by its laws, or recovered where they share a temperature."""
        node = self.node_of[body.name]
        recovered = None
        if body.name in node.energies:
            rate = balances.energy_rate(node.energies[body.name], node.T, node.T_dot, {}, {})
            recovered = rate - self.into_body[body.name]
            account = Quantity(f"heat_into_{k}", "J/m^2", f"heat received by {body.name} from the interface")
            self.ledger.append(Account(account, recovered, "heat"))
        shared = any(other is node for name, other in self.node_of.items() if name != body.name)
        flux = recovered if shared else self.from_interface[body.name]
        if flux is None or flux == 0:
            return None
        quantity = Quantity(f"q_{k}", "W/m^2", f"heat flux from the interface into {body.name}", tag="e:qc_k1")
        self._areal(quantity, flux)
        return symengine.Symbol(quantity.name)

    def regime(self) -> str:
        """The thermal regime in words."""
        nodes = [self.node_of[body.name] for body in self.scene.bodies]
        centre = self.node_of.get("interface")
        if centre is None:
            return "no medium" if nodes[0] is not nodes[1] else "perfect contact without a medium"
        if nodes[0] is nodes[1] is centre:
            return "perfect contact"
        if centre in nodes:
            return "one-sided perfect contact"
        return "separate interface temperature"

    def system(self) -> System:
        """The finished system."""
        rows = {name: self.rows[name] for name in (state.name for state in self.states)}
        unread = [n for n in self.scene.loading if n not in self.nodes and not self.variables.was_read(n)]
        warnings = tuple(f"loading: {name} is prescribed but nothing reads it." for name in unread)
        return System(
            self.t,
            tuple(self.states),
            tuple(self.parameters.items),
            tuple(self.named),
            rows,
            tuple(self.ledger),
            tuple(self.margins),
            tuple(self.variables.roles),
            self.regime(),
            tuple(sorted(self.breakpoints)),
            warnings,
        )
