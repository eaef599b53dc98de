"""The state of the interface: prescribed variables, bonding states with their bounds, and the free energy.

If a case gives the initial value of ``ln_phi``, the logarithm is the state, so that survival far below 1e-16 resolves.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Any

import symengine

from surfacechem.contracts.terms import Load, Potential, Spec, UnderPressure
from surfacechem.errors import InputError, suggestion
from surfacechem.expressions import Expression, depends, derivative, where
from surfacechem.model.automaton import Constraint, Edge, Mode
from surfacechem.model.balances import INTERFACE
from surfacechem.model.build import Bond, Build, Energy, Thermal
from surfacechem.model.components.formulation import arrangement, displacement, in_parallel, in_series
from surfacechem.model.components.mounting import law_reads, support
from surfacechem.model.system import Margin, Named, State
from surfacechem.quantities import VARIABLES, Quantity
from surfacechem.scene import BondingVariable, Sites
from surfacechem.tolerances import BOUND_SLACK, NO_AMOUNT

LN_PHI = "ln_phi"

LOADABLE = (
    *("phi", "g_n", "g_t", "v", "v_2", "p", "t_n", "f", "J_c", "Q_1", "Q_2", "Q_c"),
    *("w_n", "w_t", "w_t2", "F_n", "F_t", "F_t2", "u_t"),
)
"""Variables that a case may prescribe, in addition to the temperatures."""

GAP_TRACTIONS = (
    ("g_n", "t_n", "normal traction on body 1"),
    ("g_t", "t_e", "elastic tangential traction on body 1"),
    ("u_t", "t_a", "tangential traction on body 1 of what stands beside friction"),
    ("u_t2", "t_a2", "transverse traction on body 1 of what stands beside friction"),
)
"""Gap, traction that is the derivative of the free energy with respect to it, and its long name."""

GAP, SIDE = symengine.symbols("g_n side")
BY_SIDE = {GAP < 0: SIDE < 0, GAP > 0: SIDE > 0, -GAP < 0: -SIDE < 0, -GAP > 0: -SIDE > 0}
"""Conditions on the side of touch, mapped to conditions on its mode."""


def variables(build: Build) -> Iterator[Bond | Margin]:
    """Define the histories under ``loading``, each made when it is first read, and yield the bonding states."""
    for name, load in build.scene.loading.items():
        if name in build.thermal.nodes:
            continue
        if name not in LOADABLE:
            known = [*LOADABLE, *build.thermal.nodes]
            raise InputError(f"nothing is called '{name}'.{suggestion(name, known)}", path="loading")
        build.variables.define(name, partial(_prescribed, build, name, load), "prescribed", "loading")
    sites = build.interface.sites
    if sites is not None:
        _site_densities(build, sites)
    breaks = build.interface.limits and "phi" not in build.scene.loading and not build.interface.variables
    if breaks or any("phi" in law.stoichiometry() for law in build.interface.reactions):
        density = build.variables.get("N_c", "the bonding state", "interface")
        yield _bonding_state(build, VARIABLES["phi"], density, build.interface.phi_max)
    for variable in build.interface.variables:
        name, by = variable.name, f"interface.{variable.name}"
        amount = _amount(build, variable)
        yield _bonding_state(build, Quantity(name, "1", variable.long_name, species=variable.species), amount, 1.0)
        # Its amount at the value one: N_x per reference area, n_x per current area.
        build.variables.define(f"N_{name}", symengine.sympify(amount), "constant", by)
        build.variables.define(f"n_{name}", partial(_per_current_area, build, amount), "derived", by)
    if build.interface.bonds:
        build.variables.define("phi", partial(_bonded_part, build), "derived", "coverages of bonds")
    yield from _covered(build)


def _amount(build: Build, variable: BondingVariable) -> Expression:
    """Return the amount of a bonding variable at one [1/m^2]; that of a surface species scales with the sites."""
    if not variable.species or build.interface.sites is None:
        spec = Spec("1/m^2", "site density", above=0)
        return build.constant(f"N_{variable.name}", f"interface.{variable.name}.density", spec, variable.density)
    part = variable.density / build.interface.sites.density
    N_c = build.variables.get("N_c", "the bonding state", "interface")
    return N_c if part == 1.0 else part * N_c


def _covered(build: Build) -> Iterator[Margin]:
    """Yield margins of the sum of the coverages of a surface, which stays one if it is one at the start."""
    coverages = [build.bonding[variable.name].symbol for variable in build.interface.variables if variable.species]
    if not coverages:
        return
    slack, left = build.variables.get("slack", "the coverages"), 1 - symengine.Add(*coverages)
    remedy = "Change the coverage of another species by as much."
    for end, side, word in (("sum >= 1", -1, "less"), ("sum <= 1", 1, "more")):
        reason = f"the coverages sum to {word} than one"
        yield Margin(end, slack + side * left, reason, remedy=remedy, path="initial", at_start=True)


def _bonded_part(build: Build) -> Expression:
    """Return the number of all bonds relative to the bonding sites."""
    N_c = build.variables.get("N_c", "the bonding state", "interface")
    bonds = (build.bonding[name] for name in build.interface.bonds)
    return sum(bond.symbol * bond.density for bond in bonds) / N_c


def _prescribed(build: Build, name: str, load: Load) -> Expression:
    symbol = build.prescribe(VARIABLES[name], load)
    if name == "J_c":
        build.add(Margin("J_c > 0", symbol - NO_AMOUNT, "the area stretch J_c reached zero"))
    if name == "phi":
        _bounds(build, "phi", symbol, build.interface.phi_max)
    return symbol


def _site_densities(build: Build, sites: Sites) -> None:
    """Define the densities of bonding sites: nominal, current, and of each body."""
    by, spec = "interface.sites", Spec("1/m^2", "nominal density of reference bonding sites", above=0)

    def n_c() -> Expression:
        nominal = build.variables.get("N_c", "the interface", "interface")
        return build.name(VARIABLES["n_c"], nominal / build.stretch) if build.variables.has("J_c") else nominal

    def of_body(k: int, density: float) -> Expression:
        """Return the sites of one body; those of the reference body are the reference density."""
        if density == sites.density:
            return build.variables.get("n_c", "the interface", "interface")
        return _per_current_area(build, build.variables.get(f"N_{k}", "the interface", "interface"))

    of = [f"{by}.{body.name}" for body in build.scene.bodies]
    path = by if build.interface.is_even else of[sites.reference - 1]
    build.variables.define("N_c", partial(build.constant, "N_c", path, spec, sites.density), "constant", by)
    build.variables.define("n_c", n_c, "derived", by)
    for k, density in enumerate((sites.density_1, sites.density_2), start=1):
        if density != sites.density:
            own = Spec("1/m^2", f"nominal density of bonding sites of body {k}", above=0), density
            amount = partial(build.constant, f"N_{k}", of[k - 1], *own)
            build.variables.define(f"N_{k}", amount, "constant", by)
        build.variables.define(f"n_{k}", partial(of_body, k, density), "derived", by)


def _per_current_area(build: Build, amount: Expression) -> Expression:
    return amount / build.stretch


def _bonding_state(build: Build, quantity: Quantity, density: Expression, limit: float) -> Bond:
    name, given = quantity.name, build.scene.initial
    if name != "phi" or LN_PHI not in given:
        initial = build.initial(name)
    elif "phi" in given:
        message = f"phi has two roles: given by itself and by {LN_PHI}. Remove one of them."
        raise InputError(message, path="initial.phi")
    elif given[LN_PHI] < math.log(math.ulp(0.0)):
        message = f"{LN_PHI} = {given[LN_PHI]:g} is no bonding state that a number can hold."
        raise InputError(message, path=f"initial.{LN_PHI}")
    else:
        initial = math.exp(given[LN_PHI])
    if not 0 <= initial <= limit:
        raise InputError(f"initial {name} = {initial:g} is outside its range: 0 to {limit:g}.", path=f"initial.{name}")
    state = State(quantity, initial, 1.0)
    build.variables.define(name, state.symbol, "evolved", "bonding")
    start, fixed = Spec("1", f"initial {name}"), name not in given
    first = build.constant(f"{name}_i", f"initial.{name}", start, initial, internal=fixed)
    build.add(state)
    _bounds(build, name, state.symbol, limit)
    return Bond(state.symbol, state.dot, density, first)


def _bounds(build: Build, name: str, symbol: Any, limit: float) -> None:
    if not build.variables.has("slack"):
        spec = Spec("1", "how far rounding may carry a bonding variable beyond its bounds")
        number = partial(build.constant, "slack", "run.slack", spec, BOUND_SLACK, internal=True)
        build.variables.define("slack", number, "internal", "run")
    slack = build.variables.get("slack", "the bounds")
    text, sites, shown = f"upper bound of {name}", build.interface.sites, f"{limit:g}"
    if name != "phi" or sites is None or build.interface.is_even:
        top = build.constant(f"{name}_max", f"{name}_max", Spec("1", text), limit, internal=True)
    else:  # it follows the densities of sites of both bodies, which runs may change
        N_c, other = (build.variables.get(x, "the bonds", "interface") for x in ("N_c", f"N_{3 - sites.reference}"))
        top = build.name(Quantity("phi_max", "1", text), where(other < N_c, other / N_c, 1), output=False)
        shown = "phi_max, the partners of a site"
    below, above = f"{name} fell below its bound 0", f"{name} rose above its bound {shown}"
    build.add(Margin(f"{name} >= 0", symbol + slack, below, bound=(name, symengine.Integer(0))))
    build.add(Margin(f"{name} <= {limit:g}", top + slack - symbol, above, bound=(name, top)))


def energies(build: Build) -> Iterator[Constraint | Energy | Margin | Thermal]:
    """Yield the free energy of the interface, the sum of its potentials, and name the tractions that follow from it."""
    bounds = {law: build.variables.bind(law, f"interface.potential.{law.name()}") for law in build.interface.potentials}
    # The tangential gap that a potential reads, if not the elastic one: the displacement, or zero.
    gaps: dict[Potential, Mapping[str, Expression]] = {
        law: {"g_t": symengine.Integer(0)} if arrangement(law) == "none" else {} for law in bounds
    }
    gaps |= {law: {"g_t": displacement(build)} for law in in_parallel(build)}
    stored, energy = _energies(build, bounds, gaps)
    psi = symengine.Integer(0)
    # The balance of the interface accounts for its temperature, bonds, gaps and area stretch.
    centre = build.thermal.members.get("interface")
    known = {symengine.Symbol(x) for x in ("phi", "g_n", "g_t", "u_t", "u_t2", "J_c", centre, *build.bonding) if x}
    for law, F in stored.items():
        build.refuse_foreign(F, known, law)
        psi += F
        build.law_domain(law, bounds[law], gaps[law])
    psi, kinks = _in_sides(build, psi)
    yield from kinks
    names = (*build.thermal.nodes, "T_c") if build.interface.temperature is None else ()
    if any(depends(psi, symengine.Symbol(name)) for name in names):
        problem = "the interface's potential depends on temperature, but the interface has none"
        raise InputError(f"{problem}. Give `interface.temperature` a name.", path="interface")
    _tractions(build, psi)
    if depends(psi, GAP):
        _contact_pressure(build, stored, bounds)
        _net_pressure(build)
    elif build.variables.has("p"):
        build.variables.define("p_contact", lambda: build.variables.get("p", "the contact"), "derived", "p")
    yield energy._replace(psi=psi)
    if build.interface.temperature is not None:
        yield build.thermal.with_energy(INTERFACE, psi)


def _contact_pressure(
    build: Build, stored: Mapping[Potential, Expression], bounds: Mapping[Potential, Potential]
) -> None:
    """Define the contact pressure, from the repulsive part of potentials that may also attract bodies in contact."""
    borne = [
        stored[law] if b.repulsion is None else _per_reference_area(build, b, b.repulsion) for law, b in bounds.items()
    ]
    sides = {} if build.mode("side") is None else BY_SIDE

    def contact() -> Expression:
        """Return the sum of the pressures of the potentials, per current area.

        At zero its derivative is that of a growing pressure: a contact begins so.
        """
        each = (-derivative(symengine.sympify(F).xreplace(sides), GAP) for F in borne)
        return build.name(VARIABLES["p_contact"], symengine.Add(*(where(p < 0, 0, p) for p in each)) / build.stretch)

    build.variables.define("p_contact", contact, "derived", "the repulsive part of the potentials")


def _energies(
    build: Build, bounds: Mapping[Potential, Potential], gaps: Mapping[Potential, Mapping[str, Expression]]
) -> tuple[dict[Potential, Expression], Energy]:
    """Return the energy of each potential, as a function of its tangential gap, in parallel or in series with friction.

    If friction acts on part of the interface only, by a potential in parallel, so does the elastic gap in series with
    friction.
    """
    series = in_series(build)
    found = {law: _per_reference_area(build, b, b.statement, gaps[law]) for law, b in bounds.items()}
    parts: set[Expression] = set()  # several adhesions of the same bonds leave the same part unbonded
    for law in in_parallel(build):
        if (formula := getattr(bounds[law], "unbonded", None)) is not None:
            parts.add(build.variables.call(bounds[law], formula))
            for friction in (item for item in build.interface.frictions if item.breaks_bonds):
                breaks = f"{friction.name()} breaks all bonds as sliding starts"
                build.add(f"{breaks}, and with them the adhesion of {law.name()}.")
    unbonded, unbonded_energy = symengine.Mul(*parts), symengine.Integer(0)
    if unbonded != 1:
        g_t = symengine.Symbol("g_t")
        for law in series:
            sheared = found[law] - symengine.sympify(found[law]).subs({g_t: 0})
            unbonded_energy += sheared
            # The elastic gap exists on the unbonded fraction only.
            found[law] += (unbonded - 1) * sheared
    return found, Energy(symengine.Integer(0), unbonded, unbonded_energy)


def _net_pressure(build: Build) -> None:
    """Warn of laws whose pressure is reduced by the attraction of a potential, and end a step when it reaches zero.

    A law with an adhesive strength adds the attraction again.
    """
    attracting = [law.name() for law in build.interface.potentials if law.repulsion is not None]
    readers = [*build.interface.frictions, *build.interface.reactions, *build.scene.heat]
    relieved = [law for law in readers if law_reads(law, "p") and not getattr(law, "t_n_max", 0)]
    net = [law.name() for law in relieved if not (isinstance(law, UnderPressure) and law.pressure == "contact")]
    if attracting and net:
        lowers = f"The attraction of {' and '.join(attracting)} lowers the net pressure"
        problem = f"which is read by {' and '.join(dict.fromkeys(net))}, although it presses the surfaces together"
        remedy = "give the law `pressure: contact`, or a factor `of: p_contact`"
        build.add(f"{lowers}, {problem}. To read what the contact bears {remedy}.")
        if any(law in relieved for law in build.interface.frictions) and "p" not in build.scene.loading:
            p = build.variables.get("p", "friction")
            build.add(Margin("p", p, "attraction takes all pressure", terminal=False))


def _per_reference_area(
    build: Build,
    law: Potential,
    formula: Callable[..., Expression] | None,
    gaps: Mapping[str, Expression] | None = None,
) -> Expression:
    """Return the free energy of a bound law per reference area, with its dependence on the area stretch."""
    F = build.variables.call(law, formula, gaps)
    if not build.variables.has("J_c"):
        return F
    F = build.stretch * F if law.per == "current" else F
    n_c = symengine.Symbol("n_c")
    return F.subs({n_c: build.variables.get("N_c", law) / build.stretch}) if depends(F, n_c) else F


def _in_sides(build: Build, given: Expression) -> tuple[Expression, list[Constraint | Margin]]:
    """Replace conditions on touch by a mode, so that every step is smooth and touch and release are located."""
    psi = symengine.sympify(given).xreplace(BY_SIDE)
    if not depends(psi, SIDE):
        return given, []
    if "g_n" not in build.motion.gap_rates:
        return given, [Margin("g_n", GAP, "the given gap closes or opens", terminal=False)]
    # Under a dead load, bodies at zero gap count as in contact, loaded or not: nothing else holds them there.
    mount = support(build, "n")
    rests = mount is not None and mount.quasi_static and not mount.law.k
    start = where(GAP > 0, 1.0, -1.0) if rests else where(GAP < 0, -1.0, 1.0)
    edges = []
    for value, name, reason in ((1, "touch", "the bodies touch"), (-1, "release", "the bodies come apart")):
        other, strict, when = {SIDE: symengine.Integer(-value)}, rests and value < 0, {SIDE: (value,)}
        edges.append(Edge(name, value * GAP, reason, other, equilibrates=True, strict=strict, measure="g_n", when=when))
    mode = Mode("side", 1.0, {-1.0: "in contact", 1.0: "apart"}, start)
    return psi, [Constraint((mode,), edges=tuple(edges))]


def _tractions(build: Build, psi: Expression) -> None:
    """Name the tractions of the gaps; define the pressure if the potential gives the normal traction."""
    for gap, traction, text in GAP_TRACTIONS:
        symbol = symengine.Symbol(gap)
        if depends(psi, symbol):
            build.areal(Quantity(traction, "Pa", text, tag="e:cons_tc"), derivative(psi, symbol))
    if parallel := in_parallel(build):
        traction = "t_a" if depends(psi, symengine.Symbol("u_t")) else "t_e"
        names = " and ".join(law.name() for law in parallel)
        text = f"{names} in parallel with friction" if build.interface.frictions else names
        build.variables.define(traction, symengine.Symbol(traction), "derived", text)
    if depends(psi, GAP):
        pressure = partial(build.name, VARIABLES["p"], -symengine.Symbol("t_n"))
        build.variables.define("p", pressure, "derived", "the potential gives the normal traction")


def outputs(build: Build) -> None:
    """Replace the state phi by ln phi: d ln phi / dt is the bond balance divided by phi."""
    if "phi" not in build.bonding or LN_PHI not in build.scene.initial:
        return
    bond = build.bonding["phi"]
    if any(bond.symbol in edge.reset for edge in build.edges):
        message = f"bonds that break at once have no {LN_PHI}. Give `phi` instead."
        raise InputError(message, path=f"initial.{LN_PHI}")
    state = State(VARIABLES[LN_PHI], build.scene.initial[LN_PHI], 1.0)
    phi, rate = Named(VARIABLES["phi"], symengine.exp(state.symbol)), bond.symbol * state.dot
    build.named[:0] = [phi, Named(Quantity(str(bond.dot), "1/s", "rate of change of the bonding state"), rate, False)]
    build.rows.logarithm("phi", state.symbol, LN_PHI, build.expanded(build.rows["phi"]))
    build.states[:] = [state if item.symbol == bond.symbol else item for item in build.states]
