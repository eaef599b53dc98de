"""Tangential motion in one direction: exact or elastic sticking, sliding, and what passes from one to the other.

Exact sticking holds the displacement; elastic sticking lets the elastic gap take it up. Sliding is inertial, resisted
by something that depends on its rate, or rate-independent, in which case the traction itself determines it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import symengine

from surfacechem.errors import InputError
from surfacechem.expressions import Expression, absolute, depends, derivative, sign, where
from surfacechem.model.automaton import Edge, Equilibrium, When
from surfacechem.model.balances import MECHANICS, OUTSIDE, WORK, Power
from surfacechem.model.build import Build
from surfacechem.model.components.mounting import KEYS, LENGTH, Direction, FarField, Held, far_field
from surfacechem.model.constraints.breaking import broken
from surfacechem.model.sliding.creep import (
    CREEPS,
    PACE,
    between_creep_and_sliding,
    creeping_law,
    creeping_mass,
    driven_mass,
    driven_sliding,
    inertia,
    stands_for_velocity,
)
from surfacechem.model.sliding.formulations import PLACE, Kind, in_series
from surfacechem.model.system import STABLE, Margin, State
from surfacechem.quantities import VARIABLES, Quantity

NONE = symengine.Integer(0)
CREEP = 1e-25
"""Size [m/s] of a velocity that counts where friction remembers: at rest it creeps, by tens of decades slower."""
STILL = 1e-14
"""Part of the tractions that cancel in a balance that counts as none: a hundred times the rounding of one of them."""

UNSTABLE = (
    "no steady sliding velocity: nothing resists it, or friction falls faster with velocity than anything else "
    "resists; a mass or a viscous resistance would give one"
)
WORDS = {-1.0: "slides backward", 0.0: "sticks", 1.0: "slides forward"}


def states(build: Build, kind: Kind) -> None:
    """States and modes of the motion in one direction."""
    if kind.sticks:
        _modes(build, kind)
    if kind.mount is not None:
        _displacement(build, kind)
    if kind.elastic:
        _elastic_gap(build, kind)
    v = kind.d.velocity
    if kind.rate_dependent and not (kind.inertial and not kind.elastic):
        _sliding(build, v)
        if not kind.elastic:
            build.motion.gap_rates[kind.d.displacement] = symengine.Symbol(v)
    elif not kind.inertial or kind.elastic:
        build.variables.define(v, partial(_sliding_velocity, build, kind), "derived", "what does not stick")


def _sliding(build: Build, v: str) -> None:
    """A velocity without inertia, by itself or by what drives it."""
    law = creeping_law(build) if len(build.motion.slips) == 1 else None
    if law is not None:
        build.motion.slides_by[v] = driven_sliding(build, law)
        return
    symbol = build.motion.slides_by[v] = evolve(build, v, algebraic=True)
    build.variables.define(v, lambda: symbol, "algebraic", "balance of the tangential tractions")


def _modes(build: Build, kind: Kind) -> None:
    start = sign(symengine.Symbol("v")) if kind.inertial and not kind.elastic else None
    slip = build.mode("slip", 0.0, WORDS, start)
    build.variables.define("direction", lambda: slip, "mode", "sticks or slides")
    build.variables.define("sticking", lambda: 1 - slip**2, "mode", "sticks or slides")


def evolve(build: Build, name: str, *, algebraic: bool = False, scale: float = LENGTH) -> Expression:
    """A new state of the motion."""
    symbol, dot = symengine.symbols(f"{name} d{name}_dt")
    start = build.scene.initial.get(name, 0.0)
    creeps = name == "v" and any(law.internal for law in build.interface.frictions)
    finest = CREEP if creeps else None
    build.states.append(State(VARIABLES[name], symbol, dot, start, scale, algebraic, finest=finest))
    return symbol


def _displacement(build: Build, kind: Kind) -> None:
    name = kind.d.displacement
    place, rates = f"mechanics.{KEYS[kind.d.axis]}", build.motion.gap_rates
    u = evolve(build, name)
    build.variables.define(name, lambda: u, "evolved", place)
    rates[name] = symengine.Symbol(f"d{name}_dt")
    if kind.inertial:
        rates[name] = _own_velocity(build, kind, place)
    elif kind.elastic and kind.mount is not None and kind.mount.damped:
        rates[name] = symengine.Symbol("v_t")
        build.variables.define("v_t", partial(_yielding, build, kind.mount), "derived", place)


def _own_velocity(build: Build, kind: Kind, place: str) -> Expression:
    """A velocity with inertia, by itself or by what stands for it."""
    v = kind.own_velocity
    law = creeping_mass(build) if v == "v" and len(build.motion.slips) == 1 else None
    if law is not None:
        driven_mass(build, law)
        return symengine.Symbol(v)
    velocity = evolve(build, v)
    build.variables.define(v, lambda: velocity, "evolved", place)
    return velocity


def _yielding(build: Build, mount: Held) -> Expression:
    """Velocity at which the dampers bear what is out of balance with the elastic gap."""
    far, u = far_field(build, mount), symengine.Symbol("u_t")
    traction = derivative(build.psi, symengine.Symbol("g_t")) + derivative(build.psi, u)
    return build.name(VARIABLES["v_t"], far.yielding(u, traction))


def _elastic_gap(build: Build, kind: Kind) -> None:
    g = evolve(build, "g_t")
    names = " and ".join(law.name() for law in in_series(build))
    arrangement = f"{names} in series with friction" if build.interface.frictions else names
    build.variables.define("g_t", lambda: g, "evolved", arrangement)
    build.motion.gap_rates["g_t"] = symengine.Symbol("dg_t_dt")
    if kind.mount is None:
        build.motion.gap_rates["u_t"] = (
            build.rate_of("u_t") if build.variables.get("u_t", "the elastic gap") is not None else NONE
        )


def _sliding_velocity(build: Build, kind: Kind) -> Expression:
    if not kind.slides:
        return NONE
    rate = build.motion.gap_rates[kind.d.displacement]
    if build.variables.has("v_t"):
        build.variables.get("v_t", "sliding")
    if kind.elastic:
        rate = rate - build.motion.gap_rates["g_t"]
    slip = build.variables.get("direction", "sliding")
    return build.name(VARIABLES[kind.d.velocity], slip**2 * rate)


def motion(build: Build, kind: Kind) -> Iterator[Power]:
    """Balance of the tractions in one direction, and the transitions between sticking and sliding."""
    far = far_field(build, kind.mount) if kind.mount else None
    if build.variables.has("v_t"):
        build.variables.get("v_t", "the mechanics", "mechanics")
    d, u = kind.d, symengine.Symbol(kind.d.displacement)
    v, rate = build.variables.get(d.velocity, "the friction"), build.motion.gap_rates[d.displacement]
    rubs, t_a = build.energy.rubs, derivative(build.psi, u)
    t_f = build.motion.sliding_tractions.get(d.axis, NONE)
    if kind.elastic:
        # Per area on which friction acts, however small that is.
        t_e = derivative(build.psi if rubs == 1 else build.energy.rubbed, symengine.Symbol("g_t"))
        carried, needed = rubs * t_e, t_e
    else:
        t_e, t_f = None, rubs * t_f
        carried, needed = t_f, beside(far, t_a).force(u, NONE)  # type: ignore[arg-type]
    slides = build.variables.get("direction", "sliding") ** 2 if kind.sticks else symengine.Integer(kind.slides)
    if far is not None:
        derived = rate == symengine.Symbol("v_t") and not kind.inertial
        yield from far.book(build, u, rate, symengine.Symbol("du_t_dt") if derived else None)
        _balance(build, kind, far, slides, t_f, carried, t_a)
    else:
        text = "work of the far field on the tangential displacement"
        yield Power(WORK, OUTSIDE, MECHANICS, (carried + t_a) * rate, "W_t", text)
    if t_e is not None:
        _elastic_rows(build, kind, slides, t_f, t_e, v)
    name_traction(build, d, slides, t_a + carried, t_a + (carried if kind.elastic else needed))
    if kind.sticks and "sticks" not in (margin.name for margin in build.margins):
        _transitions(build, kind, needed, _still(build, kind, needed, t_f, v))


def beside(far: FarField, t_a: Expression) -> FarField:
    """The far field less the traction of what stands beside friction, as friction feels it."""
    return replace(far, F=far.F - t_a)


def name_traction(build: Build, d: Direction, slides: Expression, carried: Expression, needed: Expression) -> None:
    """The traction carried while sliding, else what holds the interface."""
    traction = slides * carried + (1 - slides) * needed
    build.areal(Quantity(d.total, "Pa", f"{d.text} on body 1", d.total), traction)


def _balance(
    build: Build,
    kind: Kind,
    mounted: FarField,
    slides: Expression,
    t_f: Expression,
    carried: Expression,
    t_a: Expression,
) -> None:
    """Row of the displacement, and of its velocity where that is a variable of its own."""
    far = beside(mounted, t_a)
    name = kind.d.displacement
    u, du = symengine.symbols(f"{name} d{name}_dt")
    rate = build.motion.gap_rates[name]
    if kind.inertial:
        moves = symengine.Integer(1) if kind.elastic else slides
        build.rows.kinematics(name, rate)
        driving = far.force(u, rate) - carried - far.c_g * rate
        law = creeping_mass(build) if _has_pace(build, kind) else None
        if law is not None:
            build.rows.momentum_of(PACE, inertia(build, far.m), driving, moves)
            between_creep_and_sliding(build, law, driving)
        else:
            build.rows.momentum(kind.own_velocity, driving, far.m, moves)
    elif kind.elastic:
        follows = symengine.Integer(1) if kind.rate_dependent else 1 - slides
        _elastic_balance(build, far, u, du, carried, follows)
    elif kind.rate_dependent:
        v = symengine.Symbol(kind.d.velocity)
        build.rows.kinematics(name, v)
        driving = far.force(u, v) - t_f - far.c_g * v
        _sliding_row(build, kind, slides, driving)
    else:
        driving = far.force(u, NONE) - t_f
        if far.k == 0 and not depends(t_a, u):
            _held_by_friction(build, name, driving)
            return
        held = far.k if far.k != 0 else 1
        build.rows.equilibrium(name, build.total_derivative(driving), slides, held * du)
        size = mounted.size(u) + absolute(t_f) + absolute(t_a)
        build.equilibria.append(Equilibrium(name, slides * driving, size, active=slides, slides=1))


def _has_pace(build: Build, kind: Kind) -> bool:
    return not kind.elastic and stands_for_velocity(build) == PACE


def _held_by_friction(build: Build, name: str, driving: Expression) -> None:
    """Under a dead load alone an interface that sticks does not move, and nothing holds one that slides."""
    build.rows.kinematics(name, NONE)
    limit = build.motion.stick_limits.get("t")
    if limit is None:
        raise InputError(
            "nothing resists the far-field traction F_t. Give the tangential mounting k, m or a damper.", PLACE
        )
    reason = "the dead load exceeds what sticking bears, and nothing holds what slides; a mass or a stiffness would"
    build.margins.append(Margin("sticks", limit - absolute(driving), reason))


def _elastic_balance(
    build: Build, far: FarField, u: Expression, du: Expression, t_e: Expression, follows: Expression
) -> None:
    """The body's spring and damper in series with the elastic gap, which ``follows`` at once what cannot slide."""
    if far.c_b != 0 or far.c_g != 0:
        build.rows.kinematics("u_t", build.motion.gap_rates["u_t"])
        return
    residual = far.force(u, NONE) - t_e
    build.rows.equilibrium("u_t", build.total_derivative(residual))
    size = far.size(u) + absolute(t_e)
    build.equilibria.append(Equilibrium("u_t", residual, size, along={"g_t": follows}))


def _elastic_rows(
    build: Build, kind: Kind, slides: Expression, t_f: Expression, t_e: Expression, v: Expression
) -> None:
    dg = symengine.Symbol("dg_t_dt")
    rate = build.motion.gap_rates["u_t"]
    if kind.rate_dependent:
        build.rows.kinematics("g_t", rate - v)
        driving = t_e - t_f
        _sliding_row(build, kind, slides, driving)
        return
    residual = t_f - t_e
    build.rows.equilibrium("g_t", build.total_derivative(residual), slides, dg - rate)
    size = absolute(t_e) + absolute(t_f)
    build.equilibria.insert(0, Equilibrium("g_t", slides * residual, size, active=slides, slides=-1))
    _carried(build, slides, derivative(t_e, symengine.Symbol("g_t")))


def _carried(build: Build, slides: Expression, stiffness: Expression) -> None:
    """Sliding needs something that carries its friction."""
    if stiffness.free_symbols & {bond.symbol for bond in build.bonding.values()}:
        reason = "nothing carries the friction of the sliding interface: its tangential stiffness went with its bonds"
        margin = where(stiffness > 0, stiffness, -1)
        build.margins.append(Margin("tangential stiffness", margin, reason, when=_while_sliding(build, slides)))


def _while_sliding(build: Build, slides: Expression) -> When:
    """Modes in which the interface slides; any, where it cannot stick."""
    slip = build.find_mode("slip")
    return {slip: (-1, 1)} if slip is not None and depends(slides, slip) else {}


def _sliding_row(build: Build, kind: Kind, slides: Expression, driving: Expression) -> None:
    """A velocity without inertia follows from the tractions, and is stable while what resists it grows with it."""
    v = build.motion.slides_by[kind.d.velocity]
    slope = -derivative(build.expanded(driving), v)
    balance = driving
    if slope != 0 and not depends(slope, v):
        # Solved for the velocity, which is nothing but rounding of the tractions as sliding begins.
        whole = driving if derivative(driving, v) == -slope else build.expanded(driving)
        balance = whole.subs({v: 0}) / slope - v
    # What sticks may have nothing that resists sliding, as where nothing presses it, and no such balance.
    if kind.sticks:
        build.rows.switched(str(v), slides, balance, v)
    else:
        build.rows.balance(str(v), balance)
    if build.motion.creeping is not None and len(build.interface.frictions) == 1 and _is_damped(kind):
        return  # both friction and damper resist the more, the faster it slides
    if slope == 0:
        raise InputError(
            "nothing determines the sliding velocity: friction does not depend on it. Give the tangential mounting a "
            "mass or a damper.",
            PLACE,
        )
    build.margins.append(Margin(f"{STABLE}{v}", slope, UNSTABLE, when=_while_sliding(build, slides)))


def _is_damped(kind: Kind) -> bool:
    return kind.mount is not None and kind.mount.damped and not kind.elastic


def _still(build: Build, kind: Kind, needed: Expression, t_f: Expression, v: Expression) -> Expression:
    """What is zero where sliding stops, positive in the direction of sliding.

    Where tractions alone give a velocity, in proportion, it is their balance at rest: what is left of this as sliding
    begins is rounding, which must not stop it.
    """
    slip = build.variables.get("direction", "sliding")
    if _has_pace(build, kind):
        return slip * symengine.Symbol(PACE)
    if str(v) not in build.motion.slides_by or build.motion.creeping is not None:
        return slip * v
    driving = build.expanded(needed - t_f).subs({v: 0})
    slope = derivative(build.expanded(build.rows[str(v)]), v)
    if depends(slope, v):
        return slip * v
    far = build.motion.far_fields.get(kind.d.axis)
    size = absolute(needed) if kind.elastic or far is None else far.size(symengine.Symbol(kind.d.displacement))
    return slip * driving + STILL * (size + absolute(t_f) + absolute(derivative(build.psi, symengine.Symbol("u_t"))))


def _transitions(build: Build, kind: Kind, needed: Expression, still: Expression) -> None:
    slip = build.variables.get("direction", "sliding")
    limit = build.motion.stick_limits["t"] * (1 if kind.elastic else build.energy.rubs)
    # Beyond touch the law of a contact may go on to negative pressure; nothing gives way there that is not pulled.
    bears = where(limit > 0, limit, 0)
    breaking = next((law for law in build.interface.frictions if law.breaks_bonds), None)
    jump = broken(build, breaking) if breaking is not None else {}
    balanced = not (kind.inertial and not kind.elastic)
    settles = bool(jump) or (balanced and not kind.rate_dependent)  # other gaps follow the bonds and their heat
    for s, word in ((1, "forward"), (-1, "backward")):
        reason = f"sticking gives way and the interface slides {word}"
        build.edges.append(
            Edge(
                f"slip {word}",
                bears - s * needed,
                reason,
                {slip: symengine.Integer(s)},
                jump,
                equilibrates=settles,
                heat="local",
                strict=True,
                when={slip: (0,)},
            )
        )
    # Without inertia the traction is at its limit as sliding stops, and rounding must not start it again.
    onward = NONE if balanced else where(absolute(needed) <= limit, 0, sign(needed))
    paced, velocity = _has_pace(build, kind), symengine.Symbol(kind.d.velocity)
    stop = {} if balanced else {symengine.Symbol(PACE) if paced else velocity: NONE}
    onto = {CREEPS: symengine.Integer(1)} if paced else {}
    reason, moving = "sliding comes to a stop", {slip: (-1, 1)}
    build.edges.append(Edge("stop", still, reason, {slip: onward, **onto}, stop, strict=True, when=moving))
