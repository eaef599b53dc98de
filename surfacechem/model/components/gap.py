"""The normal gap where it moves by a balance: inertial, overdamped, quasi-static, under dead load, or rigid."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import symengine

from surfacechem.contracts.terms import Spec
from surfacechem.errors import InputError, Place
from surfacechem.expressions import Expression, absolute, derivative
from surfacechem.model.automaton import Constraint, Equilibrium
from surfacechem.model.balances import Power
from surfacechem.model.build import Build
from surfacechem.model.components.mounting import LENGTH, Held, far_field, held, read_by_potentials
from surfacechem.model.constraints.threshold import bonds_left
from surfacechem.model.constraints.unilateral import TOUCHING, closing, contact, impacts
from surfacechem.model.system import Margin, State
from surfacechem.quantities import VARIABLES, Quantity

SOFT = "Give a potential that lets them, such as `penalty`, or a gap that is not negative."
OVERLAP = "the bodies overlap, and their contact is rigid"


def variables(build: Build) -> None:
    """Give the normal gap its role; where it moves by a balance, it and its velocity become states."""
    mount = held(build, "n")
    if mount is None:
        return
    meets = not read_by_potentials(build, "g_n")
    if meets and mount.quasi_static:
        # An interface that no potential lets open: closed it carries any traction, open it carries none.
        if not mount.law.k:
            raise InputError(
                "a rigid interface under dead load has no opening. Give the mounting a stiffness k.",
                Place(path=mount.by),
            )
        far = far_field(build, mount)
        pull = far.force(symengine.Integer(0), symengine.Integer(0))
        closed = build.constrain(contact(pull, _bonded(build)))
        build.variables.define("g_n", partial(_rigid_gap, build, mount, closed.active), "algebraic", mount.by)
        _carry(build, closed.reaction)
    else:
        build.variables.define("g_n", partial(_moving, build, mount), "evolved", mount.by)
        build.variables.get("g_n", "the mechanics", "mechanics")
        # A law that holds for an open gap only ends the run as the gap closes.
        if meets and not any("g_n" in law.positive for law in (*build.interface.frictions, *build.scene.heat)):
            _unilateral(build, mount)
    _refuse_idle_restitution(build, mount)


def _refuse_idle_restitution(build: Build, mount: Held) -> None:
    """Only a mass that meets a rigid contact rebounds by a coefficient."""
    if not mount.law.e or (mount.inertial and build.mode("closed") is not None):
        return
    why = "a law of the scene ends as the gap closes" if mount.inertial else "nothing with a mass hits anything"
    if mount.inertial and read_by_potentials(build, "g_n"):
        why = "the potential of the gap bears the bodies, and its stiffness and the dampers say how they rebound"
    raise InputError(f"the coefficient of restitution e would change nothing: {why}. Leave it out.", mount.law.place)


def _moving(build: Build, mount: Held) -> Expression:
    symbol, dot = symengine.symbols("g_n dg_n_dt")
    initial = build.scene.initial.get("g_n", 0.0) if mount.quasi_static else build.initial("g_n")
    build.states.append(State(VARIABLES["g_n"], symbol, dot, initial, LENGTH, algebraic=False))
    build.motion.gap_rates["g_n"] = dot
    if mount.inertial:
        velocity, change = symengine.symbols("v_n dv_n_dt")
        start = build.scene.initial.get("v_n", 0.0)
        build.states.append(State(VARIABLES["v_n"], velocity, change, start, LENGTH, algebraic=False))
        build.variables.define("v_n", lambda: velocity, "evolved", mount.by)
        build.motion.gap_rates["g_n"] = velocity
    elif mount.damped:
        build.motion.gap_rates["g_n"] = symengine.Symbol("v_n")
        build.variables.define("v_n", partial(_yielding, build, mount), "derived", mount.by)
    return symbol


def _yielding(build: Build, mount: Held) -> Expression:
    """Velocity at which dampers bear what is out of balance; given by the state, so that power is linear in rates."""
    g = symengine.Symbol("g_n")
    yielding = far_field(build, mount).yielding(g, derivative(build.psi, g))
    return build.name(VARIABLES["v_n"], build.constraint("closed").active * yielding)


def _unilateral(build: Build, mount: Held) -> None:
    """A gap that moves and that no potential bears: closed it stands still and carries any pressure."""
    far = far_field(build, mount)
    pull = far.force(symengine.Integer(0), symengine.Integer(0))
    g, v = symengine.symbols("g_n v_n")
    closed = build.constrain(contact(pull, _bonded(build), g, v if mount.inertial else None))
    if mount.inertial:
        build.motion.gap_rates["g_n"] = closed.active * v
    initial = build.scene.initial.get("g_n", 0.0)
    first = build.constant("g_n_i", "initial.g_n", Spec("m", "initial gap"), initial, internal=False)
    build.margins.append(Margin("g_n >= 0", first + TOUCHING, OVERLAP, remedy=SOFT, path="initial.g_n"))
    _carry(build, closed.reaction)


def _carry(build: Build, traction: Expression) -> None:
    """What a rigid contact carries, for the laws that read it."""
    build.variables.define("t_n", partial(_reaction, build, traction), "derived", "equilibrium with the far field")
    build.variables.define("p", partial(_pressure, build), "derived", "equilibrium with the far field")


def _bonded(build: Build) -> Expression:
    """What is above zero where bonds hold a rigid interface."""
    bonds = bonds_left(build)
    return symengine.Integer(bool(build.interface.limits)) if bonds is None else bonds


def _rigid_gap(build: Build, mount: Held, opens: Expression) -> Expression:
    far = far_field(build, mount)
    return build.name(VARIABLES["g_n"], opens * (far.w + far.F / far.k))


def _reaction(build: Build, traction: Expression) -> Expression:
    build.areal(Quantity("t_n", "Pa", "normal traction on body 1", tag="e:cons_tc"), traction)
    return symengine.Symbol("t_n")


def _pressure(build: Build) -> Expression:
    return build.name(VARIABLES["p"], -build.variables.get("t_n", "the pressure"))


def laws(build: Build) -> Iterator[Power | Constraint]:
    """Balance of the tractions on the gap, the energies of the bodies and what their dampers turn into heat."""
    mount = held(build, "n")
    if mount is None:
        return
    g = build.variables.get("g_n", "the mechanics", "mechanics")
    far = far_field(build, mount)
    if "g_n" not in build.motion.gap_rates:
        rate = build.total_derivative(g)
        yield from far.book(build, g, rate)
        return
    rate = build.motion.gap_rates["g_n"]
    t_n = derivative(build.psi, g)
    if not mount.quasi_static:
        build.variables.get("v_n", "the mechanics", "mechanics")
    if build.mode("closed") is None:
        closing(build, g)
    dot = symengine.Symbol("dg_n_dt")
    yield from far.book(build, g, rate, dot if mount.damped and not mount.inertial else None)
    if mount.inertial:
        build.rows.kinematics("g_n", rate)
        force = far.force(g, rate) - t_n - far.c_g * rate
        build.rows.momentum("v_n", force, far.m, build.constraint("closed").active)
    elif mount.damped:
        build.rows.kinematics("g_n", rate)
    else:
        # Equilibrium at all times: its rate is the equation, itself the start and what a jump has to find.
        residual = far.force(g, symengine.Integer(0)) - t_n
        size = far.size(g) + absolute(t_n)
        build.rows.equilibrium("g_n", build.total_derivative(residual))
        build.equilibria.append(Equilibrium("g_n", residual, size))
    yield from impacts(build)
