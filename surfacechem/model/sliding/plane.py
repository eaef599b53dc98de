r"""Motion in the plane of the interface with friction that sticks: a direction of sliding that both components share.

The velocity of sliding is its speed s times a unit vector n, which has turned by the angle :math:`\alpha` since sliding
began. With :math:`f` what drives the interface less what resists it,

.. math:: m \dot s = f \cdot n, \quad m s\,\dot\alpha = f \cdot n_\perp,

of which the first is regular where sliding stops, so that a stop is the zero of a smooth function. The second is not:
what is not driven straight turns ever faster into its last direction. There s counts as no less than what friction
takes away within the rounding of time. That bends the path of such speeds and takes no energy, since what turns does no
work. Without a mass both lines are balances; on springs alone their rates say how far it slides.

Friction over all directions is an ellipse of tractions, and sticking bears what is inside. Sliding begins in the
direction in which friction is the pull.

Source: Sauer, Duong & Mandadapu (2021), eqs. e:dry_fric and e:tt_max, with Newton's law in polar components of the
velocity.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial

import symengine

from surfacechem.errors import InputError
from surfacechem.expressions import Expression, depends, derivative, norm, sqrt, where
from surfacechem.model.automaton import Edge
from surfacechem.model.balances import Power
from surfacechem.model.build import Build
from surfacechem.model.components.mounting import LENGTH, far_field
from surfacechem.model.constraints.breaking import broken
from surfacechem.model.sliding.formulations import PLACE, Kind
from surfacechem.model.sliding.planar import (
    BEGAN,
    SLIDES,
    SPEED,
    TURNED,
    Side,
    against,
    aim,
    borne,
    elliptic,
    largest,
    rate_independent,
    refuse_rails,
    resistance,
    side_of,
    turned,
    unit_vector,
)
from surfacechem.model.sliding.plane_springs import PATH, on_springs
from surfacechem.model.sliding.slip import NONE, STILL, UNSTABLE, evolve, name_traction
from surfacechem.model.system import STABLE, Given, Margin
from surfacechem.quantities import VARIABLES

WORDS = {0.0: "sticks", 1.0: "slides"}

MOMENT, SLOWEST = 1e-12, 1e-18
"""Part of the time so far, and speed [m/s], below which the turn of what stops is not resolved."""

SWIFT, RADIAN = 0.1, 1e6
"""Scales of the speed [m/s] and of the turn [rad]: what rounding of the pull makes of either as sliding begins is no
error. The turn is accurate to a part of one radian, not of itself.
"""


def states(build: Build, kinds: Sequence[Kind]) -> None:
    """Displacements, speed and direction, and the velocities that follow."""
    inertial = kinds[0].inertial
    slip = build.mode("slip", 0.0, WORDS, where(SPEED > 0, 1.0, 0.0) if inertial else None)
    build.variables.define("sticking", lambda: 1 - slip, "mode", "sticks or slides")
    for kind in kinds:
        u = evolve(build, kind.d.displacement)
        build.variables.define(kind.d.displacement, partial(_same, u), "evolved", "mechanics.tangential")
    balanced = not inertial and _rate_dependent(kinds)
    role = "algebraic" if balanced else "evolved"
    if inertial or balanced:
        speed = evolve(build, "speed", algebraic=balanced, scale=SWIFT if inertial else LENGTH)
        build.variables.define("speed", lambda: speed, role, "balance of the tangential tractions")
    else:
        _path(build, slip)
    evolve(build, "turn", algebraic=balanced, scale=RADIAN)
    if inertial:
        _given_as_velocities(build)
    _began_along(build)
    for kind, cosine in zip(kinds, unit_vector(), strict=True):
        build.variables.define(kind.d.cosine, partial(_same, slip * cosine), role, "turn")
        velocity = build.name(VARIABLES[kind.d.velocity], SPEED * cosine)
        build.variables.define(kind.d.velocity, partial(_same, velocity), "derived", "speed and turn")
        build.motion.gap_rates[kind.d.displacement] = velocity


def _path(build: Build, slip: Expression) -> None:
    """The length of the path of sliding, whose rate is the speed."""
    path = evolve(build, PATH)
    build.variables.define(PATH, lambda: path, "evolved", "balance of the tangential tractions")
    speed = build.name(VARIABLES["speed"], slip * symengine.Symbol(f"d{PATH}_dt"))
    build.variables.define("speed", lambda: speed, "derived", "the path of sliding")


def _rate_dependent(kinds: Sequence[Kind]) -> bool:
    """Whether what resists sliding depends on its speed, in whichever direction."""
    found = {kind.rate_dependent for kind in kinds}
    if len(found) > 1:
        raise InputError(
            "something resists sliding along one direction in proportion to its rate, and nothing does along the "
            "other, where sliding would have no speed. Give both a damper, or a mass `m`.",
            PLACE,
        )
    return found == {True}


def _same(expression: Expression) -> Expression:
    return expression


def _began_along(build: Build) -> None:
    """The direction in which sliding began."""
    text = "component of the direction in which sliding began"
    for axis, initial, v in zip(BEGAN, (1.0, 0.0), ("v", "v_2"), strict=True):
        build.register(str(axis), text, initial, partial(_began, v))


def _given_as_velocities(build: Build) -> None:
    """The initial speed is given by both components of the velocity."""
    start = {f"initial.{v}": build.scene.initial.get(v, 0.0) for v in ("v", "v_2")}
    for j, v, state in ((-2, "v", _speed), (-1, "v_2", _straight)):
        given = Given(VARIABLES[v], start[f"initial.{v}"], state)
        build.states[j] = replace(build.states[j], initial=state(start), given=given)


def _speed(values: Mapping[str, float]) -> float:
    return math.hypot(values.get("initial.v", 0.0), values.get("initial.v_2", 0.0))


def _straight(values: Mapping[str, float]) -> float:
    return 0.0


def _began(v: str, values: Mapping[str, float]) -> float:
    """Component of the unit vector of the initial velocity."""
    speed = _speed(values)
    return values[f"initial.{v}"] / speed if speed else float(v == "v")


def motion(build: Build, kinds: Sequence[Kind]) -> Iterator[Power]:
    """Balances along and across the direction of sliding, and the transitions between sticking and sliding."""
    sides = [side_of(build, kind) for kind in kinds]
    for side in sides:
        name = side.kind.d.displacement
        build.rows.kinematics(name, side.rate)
        assert side.kind.mount is not None
        yield from far_field(build, side.kind.mount).book(build, side.u, side.rate)
        name_traction(build, side.kind.d, SLIDES, side.t_a + side.resisted, side.t_a + side.needed)
    _transitions(build, sides, _balance(build, sides))


def _balance(build: Build, sides: Sequence[Side]) -> Expression:
    """Rows of what slides; returns what is zero where it stops.

    What rounding leaves of the balance in which sliding begins must not stop it.
    """
    kind = sides[0].kind
    if kind.inertial:
        _inertial(build, sides)
        return SPEED + STILL / MOMENT * _least(build, sides)
    refuse_rails(build, sides)
    if rate_independent(kind):
        on_springs(build, sides)
        return SPEED
    return _steady(build, sides).subs({SPEED: 0}) + STILL * largest(sides)


def _inertial(build: Build, sides: Sequence[Side]) -> None:
    turn, m = symengine.Symbol("dturn_dt"), sides[0].far.m
    (x, y), (c, s), least = (side.driving for side in sides), (side.cosine for side in sides), _least(build, sides)
    along, across = c * x + s * y, c * y - s * x
    build.rows.momentum("speed", along, m, SLIDES)
    build.rows.switched("turn", SLIDES, sqrt(SPEED**2 + least**2) * turn - across / m, turn)


def _least(build: Build, sides: Sequence[Side]) -> Expression:
    """Speed that friction takes away within the rounding of time [m/s]."""
    return MOMENT * largest(sides) / sides[0].far.m * build.t + SLOWEST


def _steady(build: Build, sides: Sequence[Side]) -> Expression:
    """Balances without inertia; returns that along the direction of sliding, which has a sign.

    What resists has to grow with the speed. The direction follows at once, so it has no part in that.
    """
    pull, sizes = [side.needed for side in sides], [resistance(build, side) for side in sides]
    along, across = (x - resisted for x, resisted in zip(turned(pull), against(sizes), strict=True))
    signed = along
    if sizes[0] != sizes[1]:
        rubs = sum((size.subs({SPEED: 0}) for size in sizes), NONE)
        along, across = (where(rubs > 0, *pair) for pair in zip(elliptic(pull, sizes), (along, across), strict=True))
    slope = derivative(along, SPEED)
    linear = slope != 0 and not depends(slope, SPEED)
    along_row = -along.subs({SPEED: 0}) / slope - SPEED if linear else along
    build.rows.switched("speed", SLIDES, along_row, SPEED)
    build.rows.switched("turn", SLIDES * norm(*pull), across, TURNED)  # what nothing pulls has no direction
    build.motion.slides_by |= {"speed": SPEED, "turn": TURNED}
    stable = -derivative(build.expanded(along), SPEED)
    build.margins.append(Margin(f"{STABLE}speed", stable, UNSTABLE, when={SLIDES: (1,)}))
    return signed


def _transitions(build: Build, sides: Sequence[Side], still: Expression) -> None:
    kind, left, aimed = sides[0].kind, borne(sides), aim(build, sides)
    breaking = next((law for law in build.interface.frictions if law.breaks_bonds), None)
    jump = {**(broken(build, breaking) if breaking is not None else {}), TURNED: NONE}
    modes, reason = {SLIDES: symengine.Integer(1), **aimed}, "sticking gives way and the interface slides"
    sticks, slides = {SLIDES: (0,)}, {SLIDES: (1,)}
    begins = Edge("slip", left, reason, modes, jump, rate_independent(kind), "local", strict=True, when=sticks)
    # Without inertia the traction is at its limit as sliding stops, and rounding must not start it again.
    onward = {SLIDES: where(left < 0, 1, 0)} | {b: where(left < 0, x, b) for b, x in aimed.items()}
    modes, rest = (onward, {SPEED: NONE}) if kind.inertial else ({SLIDES: NONE}, {})
    reason = "sliding comes to a stop"
    ends = Edge("stop", still, reason, modes, {TURNED: NONE, **rest}, heat="local", strict=True, when=slides)
    build.edges += [begins, ends]
