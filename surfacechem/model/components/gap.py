"""The normal gap that moves by a balance: inertial, overdamped, quasi-static, under dead load, or rigid."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import symengine

from surfacechem.contracts.terms import Spec
from surfacechem.errors import InputError, Place
from surfacechem.expressions import Expression, derivative
from surfacechem.model.automaton import ZERO, Constraint
from surfacechem.model.build import Build, Record
from surfacechem.model.components.mounting import LENGTH_SCALE, Support, far_field, law_reads, support
from surfacechem.model.constraints.threshold import bonds_left
from surfacechem.model.constraints.unilateral import TOUCH_OVERLAP, closing, contact, impacts
from surfacechem.model.system import Margin, State
from surfacechem.quantities import VARIABLES, Quantity

G, V = symengine.symbols("g_n v_n")

RIGID_REMEDY = "Give a potential that lets them, such as `penalty`, or a gap that is not negative."
OVERLAP_ERROR = "the bodies overlap, and their contact is rigid"


def variables(build: Build) -> Iterator[Constraint | Margin | State]:
    """Define the normal gap, a state if it moves by a balance, and rigid contact if no potential reads it."""
    mount = support(build, "n")
    if mount is None:
        return
    meets = not any(law_reads(law, "g_n") for law in build.interface.potentials)
    if meets and mount.quasi_static:
        # No potential of the gap: closed, the interface carries any traction; open, it carries none.
        if not mount.law.k:
            message = "a rigid interface under dead load has no opening. Give the mounting a stiffness k."
            raise InputError(message, Place(path=mount.by))
        far = far_field(build, mount)
        closed = contact(far.force(ZERO, ZERO), _bonded(build))
        opening = closed.active * (far.w + far.F / far.law.k)
        build.variables.define("g_n", partial(build.name, VARIABLES["g_n"], opening), "algebraic", mount.by)
        yield closed
        _carry(build, closed.reaction)
    else:
        yield from _moving(build, mount)
        # A law whose domain is an open gap ends the run as the gap closes, so it needs no contact.
        if meets and not any("g_n" in law.positive for law in (*build.interface.frictions, *build.scene.heat)):
            pull = far_field(build, mount).force(ZERO, ZERO)
            closed = contact(pull, _bonded(build), G, V if mount.inertial else None)
            yield closed
            if mount.inertial:
                build.motion.gap_rates["g_n"] = closed.active * V
            initial, spec = build.scene.initial.get("g_n", 0.0), Spec("m", "initial gap")
            first = build.constant("g_n_i", "initial.g_n", spec, initial, internal=False)
            yield Margin("g_n >= 0", first + TOUCH_OVERLAP, OVERLAP_ERROR, remedy=RIGID_REMEDY, path="initial.g_n")
            _carry(build, closed.reaction)
    if mount.law.e and not (mount.inertial and build.mode("closed") is not None):
        _refuse_restitution(mount, meets)


def _refuse_restitution(mount: Support, meets: bool) -> None:
    """Raise InputError: a coefficient of restitution needs a mass and a rigid contact."""
    why = "a law of the scene ends as the gap closes" if mount.inertial else "nothing with a mass hits anything"
    if mount.inertial and not meets:
        why = "the potential of the gap bears the bodies, and its stiffness and the dampers say how they rebound"
    raise InputError(f"the coefficient of restitution e would change nothing: {why}. Leave it out.", mount.law.place)


def _moving(build: Build, mount: Support) -> Iterator[State]:
    """Yield the states of a gap that moves by a balance, and define its velocity."""
    dot, rates = symengine.Symbol("dg_n_dt"), build.motion.gap_rates
    initial = build.scene.initial.get("g_n", 0.0) if mount.quasi_static else build.initial("g_n")
    build.variables.define("g_n", G, "evolved", mount.by)
    build.variables.get("g_n", "the mechanics")
    yield State(VARIABLES["g_n"], initial, LENGTH_SCALE)
    rates["g_n"] = dot if mount.quasi_static else V
    if mount.inertial:
        build.variables.define("v_n", V, "evolved", mount.by)
        yield State(VARIABLES["v_n"], build.scene.initial.get("v_n", 0.0), LENGTH_SCALE)
    elif mount.damped:

        def yielding() -> Expression:
            """Return the rate from the state rather than a derivative, so that power is linear in rates."""
            rate = far_field(build, mount).damped_rate(G, derivative(build.psi, G))
            return build.name(VARIABLES["v_n"], build.constraint("closed").active * rate)

        build.variables.define("v_n", yielding, "derived", mount.by)


def _bonded(build: Build) -> Expression:
    """Return an expression that is positive while bonds hold a rigid interface."""
    bonds = bonds_left(build)
    return symengine.Integer(bool(build.interface.limits)) if bonds is None else bonds


def _carry(build: Build, traction: Expression) -> None:
    """Define the traction of a rigid contact and its pressure, for laws that read them."""

    def t_n() -> Expression:
        build.areal(Quantity("t_n", "Pa", "normal traction on body 1", tag="e:cons_tc"), traction)
        return symengine.Symbol("t_n")

    def p() -> Expression:
        return build.name(VARIABLES["p"], -build.variables.get("t_n", "the pressure"))

    build.variables.define("t_n", t_n, "derived", "equilibrium with the far field")
    build.variables.define("p", p, "derived", "equilibrium with the far field")


def laws(build: Build) -> Iterator[Record]:
    """Yield the balance of tractions on the gap, the energies of the bodies and the dissipation of their dampers."""
    mount = support(build, "n")
    if mount is None:
        return
    g, far = build.variables.get("g_n", "the mechanics", "mechanics"), far_field(build, mount)
    if "g_n" not in build.motion.gap_rates:
        yield from far.powers(build, g, build.total_derivative(g))
        return
    rate, t_n, closed = build.motion.gap_rates["g_n"], derivative(build.psi, g), build.constraint("closed")
    if not mount.quasi_static:
        build.variables.get("v_n", "the mechanics", "mechanics")
    if not closed.modes:
        yield from closing(build, g)
    moves = symengine.Symbol("dg_n_dt") if mount.damped and not mount.inertial else None
    yield from far.powers(build, g, rate, moves)
    yield from far.balance(build, rate, [t_n], velocity="v_n", active=closed.active if mount.inertial else 1)
    yield from impacts(build)
