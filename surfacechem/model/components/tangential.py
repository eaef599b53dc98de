r"""Tangential motion: the balance of tractions in each direction, stick and slip.

Exact sticking holds the displacement; in elastic sticking the elastic gap follows it. Slip is inertial, rate-dependent,
or rate-independent, in which case the traction itself determines it. With the far field's traction t_F, that of
adhesion in parallel with friction t_a and that of friction t_f, the driving traction t_F - t_a - t_f is
:math:`m\,\dot v`, zero, or zero by its rate, for a mounting with a mass, a damper, or neither. Smooth friction moves
the interface in two directions by the same equations; stick and slip in the plane has one slip direction for both.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from functools import partial

import symengine

from surfacechem.errors import InputError
from surfacechem.expressions import Expression, absolute, depends, derivative, norm, sign, where
from surfacechem.model.automaton import ONE, ZERO, Constraint, Edge, Equilibrium, Mode, When
from surfacechem.model.balances import MECHANICS, OUTSIDE, WORK, PowerFlow
from surfacechem.model.build import Build, Record
from surfacechem.model.components import sliding_friction
from surfacechem.model.components.formulation import (
    PLACE,
    Formulation,
    directions,
    displacement,
    evolve,
    formulations,
    growth,
    in_parallel,
    in_series,
    name_traction,
)
from surfacechem.model.components.mounting import ACROSS, ALONG, SECTIONS, FarField, far_field
from surfacechem.model.components.sliding_friction import DRIVE, stands_for_velocity
from surfacechem.model.constraints import plane
from surfacechem.model.constraints.set_valued import SLIP, breaks_bonds, set_valued
from surfacechem.model.system import STABLE_PREFIX, Margin
from surfacechem.quantities import VARIABLES
from surfacechem.tolerances import PICOMETRE, TIME_EPS, TINY, TRACTION_EPS

SLIP_WORDS = {-1.0: "slides backward", 0.0: "sticks", 1.0: "slides forward"}


def variables(build: Build) -> Iterator[Constraint]:
    """Define the unknowns and yield the modes of the tangential motion."""
    found = build.motion.slips = formulations(build)
    if not found:
        _prescribed_direction(build)
    elif _in_the_plane(build):
        yield from plane.states(build, found)
    else:
        for kind in found:
            yield from _states(build, kind)


def laws(build: Build) -> Iterator[Record]:
    """Yield the balances of tangential tractions, and the edges between stick and slip."""
    if _in_the_plane(build):
        yield from plane.motion(build, build.motion.slips)
    else:
        for kind in build.motion.slips:
            yield from _motion(build, kind)


def _in_the_plane(build: Build) -> bool:
    return len(build.motion.slips) == 2 and build.motion.slips[0].sticks


def _prescribed_direction(build: Build) -> None:
    """Define the slip direction of a prescribed velocity: a sign, or a unit vector."""
    variables, reader = build.variables, "the friction"
    if in_parallel(build):

        def v() -> Expression:
            return build.name(VARIABLES["v"], build.rate_of(str(displacement(build))))

        variables.define("v", v, "derived", "the prescribed displacement")
    if len(directions(build)) == 1:
        if variables.has("v"):
            variables.define("direction", lambda: sign(variables.get("v", reader)), "internal", "v")
        return

    def speed() -> Expression:
        return build.name(VARIABLES["speed"], norm(variables.get("v", reader), variables.get("v_2", reader)))

    def component(velocity: str) -> Expression:
        size = variables.get("speed", reader)
        return variables.get(velocity, reader) / where(size > 0, size, 1)

    variables.define("speed", speed, "derived", "v and v_2")
    for d in (ALONG, ACROSS):
        variables.define(d.cosine, partial(component, d.velocity), "internal", "v and v_2")


def _states(build: Build, kind: Formulation) -> Iterator[Constraint]:
    """Define the unknowns and yield the modes of the motion in one direction."""
    v, rates, u = kind.d.velocity, build.motion.gap_rates, kind.d.displacement
    alone = len(build.motion.slips) == 1
    if kind.sticks:
        mode = Mode("slip", 0.0, SLIP_WORDS, sign(symengine.Symbol("v")) if kind.slides_inertially else None)
        yield Constraint((mode,), active=SLIP**2)
        build.variables.define("direction", SLIP, "mode", "sticks or slides")
        build.variables.define("sticking", 1 - SLIP**2, "mode", "sticks or slides")
    if kind.mount is not None:
        _displacement(build, kind, alone)
    if kind.elastic:
        # The elastic gap deforms while the interface sticks; without a mounting the displacement is prescribed.
        names = " and ".join(law.name() for law in in_series(build))
        evolve(build, "g_t", f"{names} in series with friction" if build.interface.frictions else names)
        rates["g_t"] = symengine.Symbol("dg_t_dt")
        if kind.mount is None:
            build.variables.get("u_t", "the elastic gap")
            rates["u_t"] = build.rate_of("u_t")
    if kind.rate_dependent and not kind.slides_inertially:
        drive = sliding_friction.evolve_drive(build, inertial=False) if alone else None
        by = "balance of the tangential tractions"
        build.motion.slip_unknowns[v] = evolve(build, v, by, algebraic=True) if drive is None else drive
        if not kind.elastic:
            rates[u] = symengine.Symbol(v)
    elif not kind.slides_inertially:
        build.variables.define(v, partial(_sliding_velocity, build, kind), "derived", "what does not stick")


def _sliding_velocity(build: Build, kind: Formulation) -> Expression:
    """Name the slip velocity: rate of the displacement less that of the elastic gap; zero while sticking."""
    if not kind.slides:
        return ZERO
    if build.variables.has("v_t"):
        build.variables.get("v_t", "sliding")
    rates, u = build.motion.gap_rates, kind.d.displacement
    rate = rates[u] - rates["g_t"] if kind.elastic else rates[u]
    return build.name(VARIABLES[kind.d.velocity], build.constraint("slip").active * rate)


def _displacement(build: Build, kind: Formulation, alone: bool) -> None:
    """Define the displacement, and its velocity if that has inertia or follows from dampers."""
    assert kind.mount is not None
    name, mount, place = kind.d.displacement, kind.mount, f"mechanics.{SECTIONS[kind.d.axis]}"
    u, rates, v = evolve(build, name, place), build.motion.gap_rates, kind.own_velocity
    rates[name] = symengine.Symbol(f"d{name}_dt")
    if kind.inertial:
        rates[name] = symengine.Symbol(v)
        drive = sliding_friction.evolve_drive(build, inertial=True) if v == "v" and alone else None
        if drive is None:
            evolve(build, v, place)
    elif kind.elastic and mount.damped:

        def yielding() -> Expression:
            """Return the velocity at which the dampers bear the unbalanced traction."""
            traction = derivative(build.psi, symengine.Symbol("g_t")) + derivative(build.psi, u)
            return build.name(VARIABLES["v_t"], far_field(build, mount).damped_rate(u, traction))

        rates[name] = symengine.Symbol("v_t")
        build.variables.define("v_t", yielding, "derived", place)


def _motion(build: Build, kind: Formulation) -> Iterator[Record]:
    """Yield the balance of tractions in one direction, and the edges between stick and slip."""
    far = far_field(build, kind.mount) if kind.mount else None
    if build.variables.has("v_t"):
        build.variables.get("v_t", "the mechanics", "mechanics")
    d, u = kind.d, symengine.Symbol(kind.d.displacement)
    v, rate = build.variables.get(d.velocity, "the friction"), build.motion.gap_rates[d.displacement]
    unbonded, t_a = build.energy.unbonded, derivative(build.psi, u)
    t_f = build.motion.sliding_tractions.get(d.axis, ZERO)
    if kind.elastic:
        # Per area on which friction acts, however small.
        needed = derivative(build.psi if unbonded == 1 else build.energy.unbonded_energy, symengine.Symbol("g_t"))
        carried = held = unbonded * needed
    else:
        assert far is not None
        carried = t_f = unbonded * t_f
        held = needed = far.force(u, ZERO) - t_a
    slides = build.constraint("slip").active if kind.sticks else symengine.Integer(kind.slides)
    rest = None
    if far is None:
        text = "work of the far field on the tangential displacement"
        yield PowerFlow(WORK, OUTSIDE, MECHANICS, (carried + t_a) * rate, "W_t", text)
    else:
        derived = rate == symengine.Symbol("v_t") and not kind.inertial
        yield from far.powers(build, u, rate, symengine.Symbol("du_t_dt") if derived else None)
        rest = yield from _balance(build, kind, far, slides, carried, t_a)
    if kind.elastic:
        rest = yield from _elastic_rows(build, kind, slides, t_f, needed, v)
    name_traction(build, d, slides, t_a + carried, t_a + held)
    if kind.sticks and not kind.dead_load:
        yield _friction(build, kind, needed, t_f, v, rest)


def _friction(
    build: Build, kind: Formulation, needed: Expression, t_f: Expression, v: Expression, rest: Expression | None
) -> Constraint:
    """Return the set-valued law, by the reserve of sticking (limit less need) and a guard whose zero stops slip."""
    stops, still, slack = [], v, ZERO
    if kind.slides_inertially:
        still = symengine.Symbol(_velocity_state(build, kind))
        stops = [still]
    elif rest is not None and build.motion.creep_law is None:
        # The velocity follows from tractions: as slip begins their balance at rest is roundoff and must not stop it.
        still = rest
        far = build.motion.far_fields.get(kind.d.axis)
        size = absolute(needed) if kind.elastic or far is None else far.size(far.gap)
        beside = absolute(derivative(build.psi, symengine.Symbol("u_t")))
        slack = TRACTION_EPS * (size + absolute(t_f) + beside)
    limit = _limit(build, kind)
    back = {s: build.expanded(s * still + slack).subs({SLIP: s}) for s in (1, -1)}
    # Without inertia the traction is at its limit as slip stops, and roundoff must not restart it.
    onward = where(absolute(needed) <= limit, 0, sign(needed)) if stops else ZERO
    follows = not (kind.slides_inertially or kind.rate_dependent)
    if follows:
        # While the limit is zero and does not grow, both slip directions are equivalent, and slip does not end, not
        # even at rest: the constant keeps the guard off zero and is below any speed.
        grows = build.total_derivative(limit)
        back = {s: where(limit > 0, at, where(grows > 0, at, absolute(at) + PICOMETRE)) for s, at in back.items()}
        # As a limit of zero begins to grow, slip goes on in the direction of the drive. With the growth of friction it
        # would be as much faster than free slip in one direction as it is slower in the other. At rest it stops.
        other = 2 * free_velocity(build, kind) - v
        onward = where(limit > TIME_EPS * build.t * grows, 0, where(SLIP * other < -PICOMETRE, -SLIP, 0))
    # Beyond touch a contact law may go on to negative pressure; there slip needs a pull to begin.
    reserves = {s: where(limit > 0, limit, 0) - s * needed for s in (1, -1)}
    breaks, end = breaks_bonds(build), dict.fromkeys(stops, ZERO)
    # Rate-independent slip finds its equilibrium at once; in other cases only lost bonds and their heat require one.
    equilibrates = bool(breaks) or follows
    return set_valued(reserves, back, {}, {SLIP: onward}, breaks, end, equilibrates=equilibrates, rests=follows)


def free_velocity(build: Build, kind: Formulation) -> Expression:
    """Return the velocity at which rate-independent slip follows its drive without friction [m/s]."""
    u, rate = symengine.Symbol(kind.d.displacement), build.motion.gap_rates[kind.d.displacement]
    if kind.mount is None or not kind.mount.quasi_static:
        return rate
    pull = build.expanded(far_field(build, kind.mount).force(u, ZERO) - derivative(build.psi, u))
    return -build.total_derivative(pull).subs({symengine.Symbol(f"d{u}_dt"): ZERO}) / derivative(pull, u)


def _limit(build: Build, kind: Formulation) -> Expression:
    """Return the friction limit of sticking [Pa], per area with friction if the interface is elastic."""
    return build.motion.stick_limits.get("t", ZERO) * (1 if kind.elastic else build.energy.unbonded)


def _velocity_state(build: Build, kind: Formulation) -> str:
    """Return the name of the state that is the velocity, or the drive from which it follows."""
    return DRIVE if not kind.elastic and stands_for_velocity(build) else kind.own_velocity


def _balance(
    build: Build, kind: Formulation, far: FarField, slides: Expression, carried: Expression, t_a: Expression
) -> Generator[Record, None, Expression | None]:
    """Set the rows of the displacement and its velocity; return their balance at rest if they determine slip."""
    name = kind.d.displacement
    u, du = symengine.symbols(f"{name} d{name}_dt")
    rate, tractions = build.motion.gap_rates[name], (carried, t_a)
    if kind.inertial:
        state = _velocity_state(build, kind)
        inertia = sliding_friction.inertia(build, far.law.m) if state == DRIVE else None
        active = ONE if kind.elastic else slides
        yield from far.balance(build, rate, tractions, velocity=state, inertia=inertia, active=active)
    elif kind.elastic:
        # The body's spring in series with the elastic gap, which follows at once while it cannot slide.
        coupled = {"g_t": ONE if kind.rate_dependent else 1 - slides}
        yield from far.balance(build, rate, tractions, coupled=coupled)
    elif kind.rate_dependent:
        v = symengine.Symbol(kind.d.velocity)
        build.rows.kinematics(name, v)
        driving, damping = far.force(u, v) - t_a - carried - far.law.c_g * v, far.law.c_b + far.law.c_g
        return (yield from _sliding_row(build, kind, slides, driving, damping))
    elif kind.dead_load:
        build.rows.kinematics(name, ZERO)
        limit = build.motion.stick_limits.get("t")
        if limit is None:
            message = "nothing resists the far-field traction F_t. Give the tangential mounting k, m or a damper."
            raise InputError(message, PLACE)
        yield from _sticks(build, limit, far.force(u, ZERO) - t_a - carried)
    else:
        stiffness, limit = far.law.k if far.law.k != 0 else 1, _limit(build, kind)
        yield from far.balance(build, rate, tractions, active=slides, held=stiffness * du, slip=1, limit=limit)
    return None


def _sticks(build: Build, limit: Expression, needed: Expression) -> Iterator[Margin | Constraint]:
    """Yield the limit of sticking under a dead load, with bonds or after they have broken.

    If it reserves more without bonds, they break and it keeps sticking.
    """
    breaks = breaks_bonds(build)
    limit = build.expanded(limit)
    without = limit.subs(breaks)
    reason = "the dead load exceeds what sticking bears, and nothing holds what slides; a mass or a stiffness would"
    spare = where(without > limit, without, limit) - absolute(needed)
    yield Margin("sticks", where(absolute(needed) > 0, spare, 1), reason)
    if without != limit:
        spare = where(without > limit, limit - absolute(needed), 1)
        because = "sticking gives way, and holds again without bonds"
        yield Constraint(edges=(Edge("slip", spare, because, {}, breaks, heat="local", strict=True),))


def _elastic_rows(
    build: Build, kind: Formulation, slides: Expression, t_f: Expression, t_e: Expression, v: Expression
) -> Generator[Record, None, Expression | None]:
    """Set the rows of the elastic gap and of slip without inertia; return the balance at rest as `_balance` does."""
    dg, rate = symengine.Symbol("dg_t_dt"), build.motion.gap_rates["u_t"]
    if kind.rate_dependent:
        build.rows.kinematics("g_t", rate - v)
        return (yield from _sliding_row(build, kind, slides, t_e - t_f, ZERO))
    if kind.dead_load:
        yield from _sticks(build, build.motion.stick_limits["t"], t_e)
    residual = t_f - t_e
    build.rows.equilibrium("g_t", build.total_derivative(residual), slides, dg - rate)
    size = absolute(t_e) + absolute(t_f)
    # Opposed to the displacement in series with it: the elastic gap grows by the part that does not slide.
    yield Equilibrium("g_t", slides * residual, size, active=slides, slip=-1, limit=_limit(build, kind))
    stiffness = derivative(t_e, symengine.Symbol("g_t"))
    if stiffness.free_symbols & {bond.symbol for bond in build.bonding.values()}:
        reason = "nothing carries the friction of the sliding interface: its tangential stiffness went with its bonds"
        yield Margin("tangential stiffness", where(stiffness > 0, stiffness, -1), reason, when=_while_sliding(kind))
    return None


def _sliding_row(
    build: Build, kind: Formulation, slides: Expression, driving: Expression, damping: Expression
) -> Generator[Margin, None, Expression]:
    """Set the row of a slip velocity without inertia; slip is stable if the resistance grows with it.

    Returns a balance that is zero at rest: that of the tractions [Pa], or the velocity times the size of their slope,
    which changes sign at a fold.
    """
    v = build.motion.slip_unknowns[kind.d.velocity]
    slope, balance = -derivative(build.expanded(driving), v), driving
    # The slope at rest is the limit from the slip direction, also where roundoff gives v the other sign.
    ahead, onward = (slope.subs({v: x + SLIP * TINY}) if kind.sticks else slope for x in (v, where(SLIP * v > 0, v, 0)))
    rest, stable = absolute(ahead) * v, growth(onward, damping)
    if slope != 0 and not depends(slope, v):
        # Solved for the velocity, which is pure roundoff of the tractions as slip begins.
        rest = (driving if derivative(driving, v) == -slope else build.expanded(driving)).subs({v: 0})
        balance, stable = rest / slope - v, slope
    # While sticking there may be no resistance, as without pressure, and hence no such balance.
    if kind.sticks:
        build.rows.switched(str(v), slides, balance, v)
    else:
        build.rows.balance(str(v), balance)
    if build.motion.creep_law is not None and len(build.interface.frictions) == 1 and damping != 0:
        return rest  # both friction and damper grow with the velocity
    if slope == 0:
        problem = "nothing determines the sliding velocity: friction does not depend on it"
        raise InputError(f"{problem}. Give the tangential mounting a mass or a damper.", PLACE)
    yield Margin(f"{STABLE_PREFIX}{v}", stable, kind.unstable, when=_while_sliding(kind), stability=str(v))
    return rest


def _while_sliding(kind: Formulation) -> When:
    """Return the modes in which the interface slides; all modes if it cannot stick."""
    return {SLIP: (-1, 1)} if kind.sticks else {}
