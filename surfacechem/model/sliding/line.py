r"""Tangential motion in one direction: the balance of the tractions, sticking and sliding.

Exact sticking holds the displacement; elastic sticking lets the elastic gap take it up. Sliding is inertial, resisted
by something that depends on its rate, or rate-independent, in which case the traction itself determines it. With the
far field's traction t_F, that of adhesion beside friction t_a and of friction t_f the driving traction t_F - t_a - t_f
is :math:`m\,\dot v`, zero, or zero by its rate, as the mounting has a mass, a damper, or neither.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import symengine

from surfacechem.errors import InputError
from surfacechem.expressions import Expression, absolute, depends, derivative, sign, where
from surfacechem.model.automaton import Constraint, Equilibrium, Mode, When
from surfacechem.model.balances import MECHANICS, OUTSIDE, WORK, Power
from surfacechem.model.build import Build
from surfacechem.model.components.mounting import KEYS, FarField, far_field
from surfacechem.model.constraints.set_valued import SLIP, along_a_line, breaks_bonds
from surfacechem.model.sliding import rate_and_state
from surfacechem.model.sliding.formulation import (
    NONE,
    ONE,
    PLACE,
    UNSTABLE,
    Formulation,
    beside,
    evolve,
    in_series,
    name_traction,
)
from surfacechem.model.sliding.rate_and_state import DRIVE, stands_for_velocity
from surfacechem.model.system import STABLE, Margin
from surfacechem.quantities import VARIABLES
from surfacechem.tolerances import STILL

WORDS = {-1.0: "slides backward", 0.0: "sticks", 1.0: "slides forward"}


def states(build: Build, kind: Formulation) -> None:
    """States and modes of the motion in one direction."""
    v, rates = kind.d.velocity, build.motion.gap_rates
    if kind.sticks:
        start = sign(symengine.Symbol("v")) if kind.slides_inertially else None
        slip = build.constrain(Constraint((Mode("slip", 0.0, WORDS, start),), active=SLIP**2)).modes[0].symbol
        build.variables.define("direction", lambda: slip, "mode", "sticks or slides")
        build.variables.define("sticking", lambda: 1 - slip**2, "mode", "sticks or slides")
    if kind.mount is not None:
        _displacement(build, kind)
    if kind.elastic:
        _elastic_gap(build, kind)
    if kind.rate_dependent and not kind.slides_inertially:
        law = rate_and_state.law_of_traction(build, inertial=False) if len(build.motion.slips) == 1 else None
        if law is not None:
            build.motion.slides_by[v] = rate_and_state.evolve_drive(build, law, inertial=False)
        else:
            symbol = build.motion.slides_by[v] = evolve(build, v, algebraic=True)
            build.variables.define(v, lambda: symbol, "algebraic", "balance of the tangential tractions")
        if not kind.elastic:
            rates[kind.d.displacement] = symengine.Symbol(v)
    elif not kind.slides_inertially:
        build.variables.define(v, partial(_sliding_velocity, build, kind), "derived", "what does not stick")


def _elastic_gap(build: Build, kind: Formulation) -> None:
    """The gap that gives way while the interface sticks; the displacement is prescribed where no mounting holds it."""
    g, rates = evolve(build, "g_t"), build.motion.gap_rates
    names = " and ".join(law.name() for law in in_series(build))
    arrangement = f"{names} in series with friction" if build.interface.frictions else names
    build.variables.define("g_t", lambda: g, "evolved", arrangement)
    rates["g_t"] = symengine.Symbol("dg_t_dt")
    if kind.mount is None:
        moved = build.variables.get("u_t", "the elastic gap") is not None
        rates["u_t"] = build.rate_of("u_t") if moved else NONE


def _displacement(build: Build, kind: Formulation) -> None:
    """The displacement, and its velocity where that has inertia or follows from dampers."""
    assert kind.mount is not None
    name, mount, place = kind.d.displacement, kind.mount, f"mechanics.{KEYS[kind.d.axis]}"
    u, rates = evolve(build, name), build.motion.gap_rates
    build.variables.define(name, lambda: u, "evolved", place)
    rates[name] = symengine.Symbol(f"d{name}_dt")
    if kind.inertial:
        v = kind.own_velocity
        rates[name] = symengine.Symbol(v)
        alone = v == "v" and len(build.motion.slips) == 1
        law = rate_and_state.law_of_traction(build, inertial=True) if alone else None
        if law is not None:
            rate_and_state.evolve_drive(build, law, inertial=True)
        else:
            velocity = evolve(build, v)
            build.variables.define(v, lambda: velocity, "evolved", place)
    elif kind.elastic and mount.damped:

        def yielding() -> Expression:
            """Velocity at which the dampers bear what is out of balance with the elastic gap."""
            traction = derivative(build.psi, symengine.Symbol("g_t")) + derivative(build.psi, u)
            return build.name(VARIABLES["v_t"], far_field(build, mount).yielding(u, traction))

        rates[name] = symengine.Symbol("v_t")
        build.variables.define("v_t", yielding, "derived", place)


def _sliding_velocity(build: Build, kind: Formulation) -> Expression:
    if not kind.slides:
        return NONE
    rate = build.motion.gap_rates[kind.d.displacement]
    if build.variables.has("v_t"):
        build.variables.get("v_t", "sliding")
    if kind.elastic:
        rate = rate - build.motion.gap_rates["g_t"]
    return build.name(VARIABLES[kind.d.velocity], build.variables.get("direction", "sliding") ** 2 * rate)


def motion(build: Build, kind: Formulation) -> Iterator[Power | Constraint]:
    """Balance of the tractions in one direction, and the edges between sticking and sliding."""
    far = far_field(build, kind.mount) if kind.mount else None
    if build.variables.has("v_t"):
        build.variables.get("v_t", "the mechanics", "mechanics")
    d, u = kind.d, symengine.Symbol(kind.d.displacement)
    v, rate = build.variables.get(d.velocity, "the friction"), build.motion.gap_rates[d.displacement]
    rubs, t_a = build.energy.rubs, derivative(build.psi, u)
    t_f = build.motion.sliding_tractions.get(d.axis, NONE)
    if kind.elastic:
        # Per area on which friction acts, however small that is.
        needed = derivative(build.psi if rubs == 1 else build.energy.rubbed, symengine.Symbol("g_t"))
        carried = held = rubs * needed
    else:
        carried = t_f = rubs * t_f
        held = needed = beside(far, t_a).force(u, NONE)  # type: ignore[arg-type]
    slides = build.variables.get("direction", "sliding") ** 2 if kind.sticks else symengine.Integer(kind.slides)
    if far is not None:
        derived = rate == symengine.Symbol("v_t") and not kind.inertial
        yield from far.book(build, u, rate, symengine.Symbol("du_t_dt") if derived else None)
        _balance(build, kind, far, slides, carried, t_a)
    else:
        text = "work of the far field on the tangential displacement"
        yield Power(WORK, OUTSIDE, MECHANICS, (carried + t_a) * rate, "W_t", text)
    if kind.elastic:
        _elastic_rows(build, kind, slides, t_f, needed, v)
    name_traction(build, d, slides, t_a + carried, t_a + held)
    if kind.sticks and "sticks" not in (margin.name for margin in build.margins):
        limit = build.motion.stick_limits["t"] * (1 if kind.elastic else rubs)
        stops = [symengine.Symbol(_velocity_state(build, kind))] if kind.slides_inertially else []
        equilibrates = not (kind.slides_inertially or kind.rate_dependent)
        back = {s: build.expanded(_still(build, kind, s, needed, t_f, v)).subs({SLIP: s}) for s in (1, -1)}
        yield along_a_line(needed, limit, back, breaks_bonds(build), stops, equilibrates=equilibrates)


def _velocity_state(build: Build, kind: Formulation) -> str:
    """The state that is the velocity, or stands for it."""
    return DRIVE if not kind.elastic and stands_for_velocity(build) else kind.own_velocity


def _balance(
    build: Build, kind: Formulation, mounted: FarField, slides: Expression, carried: Expression, t_a: Expression
) -> None:
    """Row of the displacement, and of its velocity where that is a variable of its own."""
    far, name = beside(mounted, t_a), kind.d.displacement
    u, du = symengine.symbols(f"{name} d{name}_dt")
    rate = build.motion.gap_rates[name]
    if kind.inertial:
        moves, state = ONE if kind.elastic else slides, _velocity_state(build, kind)
        build.rows.kinematics(name, rate)
        driving = far.force(u, rate) - carried - far.c_g * rate
        if state == DRIVE:
            build.rows.momentum_of(state, rate_and_state.inertia(build, far.m), driving, moves)
        else:
            build.rows.momentum(state, driving, far.m, moves)
    elif kind.elastic and (far.c_b != 0 or far.c_g != 0):
        build.rows.kinematics(name, rate)
    elif kind.elastic:
        # The body's spring in series with the elastic gap, which follows at once while it cannot slide.
        residual = far.force(u, NONE) - carried
        build.rows.equilibrium(name, build.total_derivative(residual))
        size, follows = far.size(u) + absolute(carried), ONE if kind.rate_dependent else 1 - slides
        build.equilibria.append(Equilibrium(name, residual, size, along={"g_t": follows}))
    elif kind.rate_dependent:
        v = symengine.Symbol(kind.d.velocity)
        build.rows.kinematics(name, v)
        _sliding_row(build, kind, slides, far.force(u, v) - carried - far.c_g * v)
    elif far.k == 0 and not depends(t_a, u):
        # Under a dead load alone an interface that sticks does not move, and nothing holds one that slides.
        build.rows.kinematics(name, NONE)
        limit = build.motion.stick_limits.get("t")
        if limit is None:
            message = "nothing resists the far-field traction F_t. Give the tangential mounting k, m or a damper."
            raise InputError(message, PLACE)
        reason = "the dead load exceeds what sticking bears, and nothing holds what slides; a mass or a stiffness would"
        build.margins.append(Margin("sticks", limit - absolute(far.force(u, NONE) - carried), reason))
    else:
        driving = far.force(u, NONE) - carried
        held = far.k if far.k != 0 else 1
        build.rows.equilibrium(name, build.total_derivative(driving), slides, held * du)
        size = mounted.size(u) + absolute(carried) + absolute(t_a)
        build.equilibria.append(Equilibrium(name, slides * driving, size, active=slides, slides=1))


def _elastic_rows(
    build: Build, kind: Formulation, slides: Expression, t_f: Expression, t_e: Expression, v: Expression
) -> None:
    """Row of the elastic gap, and of the velocity of sliding where that is a variable of its own."""
    dg, rate = symengine.Symbol("dg_t_dt"), build.motion.gap_rates["u_t"]
    if kind.rate_dependent:
        build.rows.kinematics("g_t", rate - v)
        _sliding_row(build, kind, slides, t_e - t_f)
        return
    residual = t_f - t_e
    build.rows.equilibrium("g_t", build.total_derivative(residual), slides, dg - rate)
    size = absolute(t_e) + absolute(t_f)
    build.equilibria.insert(0, Equilibrium("g_t", slides * residual, size, active=slides, slides=-1))
    stiffness = derivative(t_e, symengine.Symbol("g_t"))
    if stiffness.free_symbols & {bond.symbol for bond in build.bonding.values()}:
        reason = "nothing carries the friction of the sliding interface: its tangential stiffness went with its bonds"
        margin = where(stiffness > 0, stiffness, -1)
        build.margins.append(Margin("tangential stiffness", margin, reason, when=_while_sliding(build, slides)))


def _while_sliding(build: Build, slides: Expression) -> When:
    """Modes in which the interface slides; any, where it cannot stick."""
    slip = build.mode("slip")
    return {slip: (-1, 1)} if slip is not None and depends(slides, slip) else {}


def _sliding_row(build: Build, kind: Formulation, slides: Expression, driving: Expression) -> None:
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
    damped = kind.mount is not None and kind.mount.damped and not kind.elastic
    if build.motion.creeping is not None and len(build.interface.frictions) == 1 and damped:
        return  # both friction and damper resist the more, the faster it slides
    if slope == 0:
        raise InputError(
            "nothing determines the sliding velocity: friction does not depend on it. Give the tangential mounting a "
            "mass or a damper.",
            PLACE,
        )
    build.margins.append(Margin(f"{STABLE}{v}", slope, UNSTABLE, when=_while_sliding(build, slides), stability=str(v)))


def _still(
    build: Build, kind: Formulation, slip: int, needed: Expression, t_f: Expression, v: Expression
) -> Expression:
    """What is zero where sliding stops, positive in the direction ``slip`` of sliding.

    Where tractions alone give a velocity, in proportion, it is their balance at rest: what is left of this as sliding
    begins is rounding, which must not stop it.
    """
    if kind.slides_inertially:
        return slip * symengine.Symbol(_velocity_state(build, kind))
    if str(v) not in build.motion.slides_by or build.motion.creeping is not None:
        return slip * v
    driving = build.expanded(needed - t_f).subs({v: 0})
    slope = derivative(build.expanded(build.rows[str(v)]), v)
    if depends(slope, v):
        return slip * v
    far = build.motion.far_fields.get(kind.d.axis)
    size = absolute(needed) if kind.elastic or far is None else far.size(symengine.Symbol(kind.d.displacement))
    return slip * driving + STILL * (size + absolute(t_f) + absolute(derivative(build.psi, symengine.Symbol("u_t"))))
