r"""Friction: sliding tractions, their dissipation, and the internal variables of friction laws.

An internal variable, such as the age of contacts, is evolved as its logarithm.

Rate-and-state friction has its traction as the unknown, from which the slip velocity follows. At rest such friction
creeps, hundreds of decades slower than it slides, and a reversal passes through all of them twice. The traction is
smooth there, in units of the direct effect: the drive. It is therefore the state from which the velocity follows at
all speeds, algebraic without a mass. With a mass it obeys Newton's law by the chain rule, :math:`m\,\dot
v(\text{drive}, \theta)` being equal to the unbalanced traction.

Source: Dieterich (1979), doi 10.1029/JB084iB05p02161; Ruina (1983), doi 10.1029/JB088iB12p10359; with the direct effect
as an asinh by Rice, Lapusta & Ranjith (2001), doi 10.1016/S0022-5096(01)00042-4.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from functools import partial

import symengine

from surfacechem.contracts.terms import Friction, reads
from surfacechem.errors import InputError
from surfacechem.expressions import Expression, absolute, derivative, exp, sqrt, where
from surfacechem.model.balances import DISSIPATION, INTERFACE, MECHANICS, OUTSIDE, WORK, PowerFlow
from surfacechem.model.build import Build
from surfacechem.model.components.formulation import displacement, evolve, in_parallel, resistance, stick_limit
from surfacechem.model.components.mounting import ACROSS, ALONG
from surfacechem.model.system import Given, Margin, State
from surfacechem.quantities import VARIABLES, Quantity
from surfacechem.tolerances import RELATIVE_INERTIA, TINY


def laws(build: Build) -> Iterator[PowerFlow | State | Margin]:
    """Name the sliding tractions; yield their dissipation and the work from outside on prescribed sliding."""
    unbonded, total = build.energy.unbonded, symengine.Integer(0)
    resisting: dict[str, Expression] = {}
    if build.interface.frictions:
        build.variables.define("t_s", lambda: _magnitude(build, resisting), "derived", "interface.friction")
    for law in build.interface.frictions:
        label = build.unique(law.label)
        bound = build.bound(law)
        yield from memory(build, law, bound)
        met = pressed(build, law)
        resisted = resistance(build, law, bound, met)
        build.law_domain(law, bound, {}, met)
        power = symengine.Integer(0)
        for d, traction in resisted.items():
            across = " across v" if d is ACROSS else ""
            quantity = Quantity(f"{d.traction}_{label}", "Pa", f"tangential traction of {law.title}{across}")
            named = build.name(quantity, traction)
            nominal = build.stretch * named
            resisting[d.axis] = resisting.get(d.axis, 0) + unbonded * named
            power += unbonded * nominal * build.variables.get(d.velocity, law)
            total += unbonded * nominal
            tractions = build.motion.sliding_tractions
            tractions[d.axis] = tractions.get(d.axis, 0) + nominal
        yield PowerFlow(DISSIPATION, MECHANICS, INTERFACE, power, label)
        if not build.motion.slips:
            text = f"work done against {law.title}"
            yield PowerFlow(WORK, OUTSIDE, MECHANICS, power, f"W_{label}", text)
            for v in (d.velocity for d in resisted):
                if build.slope_of(v) != 0 and not any(margin.name == v for margin in build.margins):
                    reason = "sliding reverses" if len(resisted) == 1 else f"{v} changes its sign"
                    yield Margin(v, symengine.Symbol(v), reason, terminal=False)
        else:
            stick_limit(build, law, bound, met)
    if not build.motion.slips and in_parallel(build):
        t_a = derivative(build.psi, displacement(build))
        build.areal(Quantity(ALONG.total, "Pa", f"{ALONG.text} on body 1", ALONG.total), t_a + total)


def _magnitude(build: Build, tractions: Mapping[str, Expression]) -> Expression:
    """Name the magnitude of the sliding traction, given its components."""
    along, *across = tractions.values()
    return build.name(VARIABLES["t_s"], sqrt(along**2 + across[0] ** 2) if across else absolute(along))


def pressed(build: Build, law: Friction) -> dict[str, Expression]:
    """Return the pressure, zero in an open gap, for a law that needs it: an open contact has no friction.

    At p = 0 the derivative is that of the pressed side: a contact starts and ends to press there. In an open gap it is
    zero.
    """
    if "p" not in law.nonnegative or "p" in build.scene.loading:
        return {}
    p, least = build.variables.get("p", law), build.bound(law).least.get("p")
    apart = 0 if (side := build.mode("side")) is None else where(side > 0, TINY, 0)
    return {"p": where(p < apart, 0 * p, p) if least is None else where(p < least, least, p)}


def memory(build: Build, law: Friction, bound: Friction) -> Iterator[State]:
    """Yield the internal variables of a law; the initial value is that of the quantity, not of its logarithm."""
    for name, of in law.internal.items():
        start = build.initial(of)
        if not start > 0:
            raise InputError(f"initial {of} = {start:g} is outside its range: > 0.", path=f"initial.{of}")
        build.variables.define(name, partial(symengine.Symbol, name), "evolved", law.path)
        given = Given(VARIABLES[of], start)
        # The logarithm keeps it positive, and resolves twenty decades of age as well as one.
        yield State(VARIABLES[name], math.log(start), 1.0, given=given)
        build.name(VARIABLES[of], exp(symengine.Symbol(name)))
    if law.internal:
        for name, rate in build.variables.call(bound, bound.evolution).items():
            build.rows.kinematics(name, rate)


DRIVE = "drive"

DRIVE_SCALE = 1e6
"""Scale of the drive of a mass: its error counts relative to the direct effect, not to its value."""


def evolve_drive(build: Build, *, inertial: bool) -> Expression | None:
    """Add the drive as the state for the slip velocity, if a law has a velocity as function of its traction; else None.

    A mass needs the rate of the velocity, in which varying parameters enter without their factors. Without a mass the
    balance may need the velocity as unknown, if parameters vary with it.
    """
    law = _law(build, inertial)
    if law is None:
        return None
    bound, varying = build.bound(law), law.varying
    if inertial and varying:
        symbols = {parameter.path: parameter.symbol for parameter in build.parameters.items}
        bound = bound.bind({name: symbols[f"{bound.path}.{name}"] for name in varying})
    if not (inertial and varying):
        build.motion.creep_law = law
    # The internal variables of the law are read here before they are defined as states.
    own = {name: symengine.Symbol(name) for name in law.internal}

    def velocity() -> Expression:
        return build.name(VARIABLES["v"], build.variables.call(law, bound.velocity, {**own, DRIVE: symbol}))

    def at_start(values: Mapping[str, float]) -> float:
        """Return the drive at the given velocity, the start value of the search for a balance."""
        drive = build.variables.call(law, bound.drive, {**own, "v": values["initial.v"]})
        return _number_at_start(build, drive, values)

    given = Given(VARIABLES["v"], build.scene.initial.get("v", 0.0), at_start)
    by = "mechanics.tangential" if inertial else "balance of the tangential tractions"
    scale = DRIVE_SCALE if inertial else 1.0
    symbol = evolve(build, DRIVE, by, algebraic=not inertial, scale=scale, given=given)
    build.variables.define("v", velocity, "derived", f"{law.path}, from its traction")
    return symbol


def _number_at_start(build: Build, expression: Expression, values: Mapping[str, float]) -> float:
    numbers = {parameter.symbol: values[parameter.path] for parameter in build.parameters.items}
    numbers |= {state.symbol: state.from_given(values) for state in build.states if state.name != DRIVE}
    try:
        return float(build.expanded(expression).subs({**numbers, build.t: 0.0}))
    except RuntimeError:  # no real number, as at a negative pressure: zero will do as a start value
        return 0.0


def _law(build: Build, inertial: bool) -> Friction | None:
    """Return the first law that gives the velocity as a function of its traction."""
    for law in build.interface.frictions:
        varies_with_velocity = any("v" in (factor.of, *reads(factor.factor)) for factor in law.factors)
        if law.velocity is not None and (inertial or not varies_with_velocity):
            return law
    return None


def stands_for_velocity(build: Build) -> bool:
    """True if the drive is the state from which the slip velocity follows."""
    return any(state.name == DRIVE for state in build.states)


def inertia(build: Build, m: Expression) -> Expression:
    """Return mass times the rate of the velocity [Pa], plus a small inertia of the drive that keeps it regular.

    A mass only delays creep that is so slow: there the drive responds equally fast at any velocity.
    """
    law = _law(build, inertial=True)
    assert law is not None
    path = f"{build.bound(law).path}.{law.reference_velocity}"
    least = RELATIVE_INERTIA * next(item.symbol for item in build.parameters.items if item.path == path)
    return m * build.total_derivative(symengine.Symbol("v") + least * symengine.Symbol(DRIVE))
