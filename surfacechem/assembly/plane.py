r"""Motion in the plane of the interface with friction that sticks: a direction of sliding that both components share.

The velocity of sliding is its speed s times a unit vector n, which has turned by the angle :math:`\alpha` since sliding
began. With :math:`f` what drives the interface less what resists it,

.. math:: m \dot s = f \cdot n, \quad m s\,\dot\alpha = f \cdot n_\perp,

of which the first is regular where sliding stops, so that a stop is the zero of a smooth function. The second is not:
what is not driven straight turns ever faster into its last direction. There s counts as no less than what friction
takes away within the rounding of time. That bends the path of such speeds and takes no energy, since what turns does no
work. Without a mass both lines are balances.

Friction over all directions is an ellipse of tractions, and sticking bears what is inside. Sliding begins in the
direction in which friction is the pull.

Source: Sauer, Duong & Mandadapu (2021), eqs. e:dry_fric and e:tt_max, with Newton's law in polar components of the
velocity.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import symengine

from surfacechem.assembly.breaking import broken
from surfacechem.assembly.build import Build
from surfacechem.assembly.folds import determinant
from surfacechem.assembly.kinds import PLACE, Kind
from surfacechem.assembly.mounting import ACROSS, LENGTH, FarField, far_field
from surfacechem.assembly.slip import NONE, UNSTABLE, evolve, name_traction
from surfacechem.errors import InputError
from surfacechem.expressions import Expression, cos, depends, derivative, norm, sin, sqrt, where
from surfacechem.quantities import VARIABLES
from surfacechem.system import Given, Margin
from surfacechem.transitions import Transition

WORDS = {0.0: "sticks", 1.0: "slides"}

MOMENT, SLOWEST = 1e-12, 1e-18
"""Part of the time so far, and speed [m/s], below which the turn of what stops is not resolved."""

STILL, NEXT_TO = 1e-14, 1e-12
"""Parts of what sticking bears that count as none: of a balance, and of one direction beside the other."""

SWIFT, RADIAN = 0.1, 1e6
"""Scales of the speed [m/s] and of the turn [rad]: what rounding of the pull makes of either as sliding begins is no
error. The turn is accurate to a part of one radian, not of itself.
"""

SPEED, TURNED = symengine.symbols("speed turn")
BEGAN = symengine.symbols("began began_2")


def states(build: Build, kinds: Sequence[Kind]) -> None:
    """Displacements, speed and direction, and the velocities that follow."""
    inertial = kinds[0].inertial
    if not (inertial or any(kind.rate_dependent for kind in kinds)):
        raise InputError(
            "what sticks and slides in two directions needs a mass or a damper: without either a spring alone would "
            "have to say how far it slides, and a static limit above the kinetic one leaves that open. Give the "
            "tangential mounting `m` or `c_b`.",
            PLACE,
        )
    slip = build.mode("slip", 0.0, WORDS, where(SPEED > 0, 1.0, 0.0) if inertial else None)
    build.variables.define("sticking", lambda: 1 - slip, "mode", "sticks or slides")
    for kind in kinds:
        u = evolve(build, kind.d.displacement)
        build.variables.define(kind.d.displacement, partial(_same, u), "evolved", "mechanics.tangential")
    speed = evolve(build, "speed", algebraic=not inertial, scale=SWIFT if inertial else LENGTH)
    evolve(build, "turn", algebraic=not inertial, scale=RADIAN)
    if inertial:
        _given_as_velocities(build)
    role = "evolved" if inertial else "algebraic"
    build.variables.define("speed", lambda: speed, role, "balance of the tangential tractions")
    for kind, cosine in zip(kinds, _unit_vector(build), strict=True):
        build.variables.define(kind.d.cosine, partial(_same, slip * cosine), role, "turn")
        velocity = build.name(VARIABLES[kind.d.velocity], SPEED * cosine)
        build.variables.define(kind.d.velocity, partial(_same, velocity), "derived", "speed and turn")
        build.motion.gap_rates[kind.d.displacement] = velocity


def _same(expression: Expression) -> Expression:
    return expression


def _unit_vector(build: Build) -> tuple[Expression, Expression]:
    """The direction of sliding: that in which it began, turned. So a straight line stays one to the last digit."""
    text = {0.0: "component of the direction in which sliding began"}
    for axis, initial, v in zip(BEGAN, (1.0, 0.0), ("v", "v_2"), strict=True):
        build.mode(str(axis), initial, text, given=partial(_began, v))
    x, y = BEGAN
    return x * cos(TURNED) - y * sin(TURNED), y * cos(TURNED) + x * sin(TURNED)


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


@dataclass(frozen=True)
class _Side:
    """One of the two directions: what pulls, what resists sliding, and what sticking bears."""

    kind: Kind
    far: FarField
    u: Expression
    cosine: Expression
    rate: Expression
    resisted: Expression
    needed: Expression
    limit: Expression

    @property
    def driving(self) -> Expression:
        return self.far.force(self.u, self.rate) - self.resisted - self.far.c_g * self.rate


def _side(build: Build, kind: Kind) -> _Side:
    assert kind.mount is not None
    far, u = far_field(build, kind.mount), symengine.Symbol(kind.d.displacement)
    motion = build.motion
    resisted, limit = motion.sliding_tractions[kind.d.axis], motion.stick_limits[kind.d.axis]
    rate = motion.gap_rates[kind.d.displacement]
    cosine = derivative(build.expanded(rate), SPEED)
    return _Side(kind, far, u, cosine, rate, resisted, far.force(u, NONE), limit)


def motion(build: Build, kinds: Sequence[Kind]) -> None:
    """Balances along and across the direction of sliding, and the transitions between sticking and sliding."""
    sides = [_side(build, kind) for kind in kinds]
    slides = symengine.Symbol("slip")
    for side in sides:
        name = side.kind.d.displacement
        build.rows[name] = symengine.Symbol(f"d{name}_dt") - side.rate
        side.far.book(build, side.u, side.rate)
        name_traction(build, side.kind.d, slides, side.resisted, side.needed)
    # What rounding leaves of the balance in which sliding begins must not stop it.
    if kinds[0].inertial:
        _inertial(build, sides, slides)
        still = SPEED + STILL / MOMENT * _least(build, sides)
    else:
        along = _steady(build, sides, slides)
        still = along.subs({SPEED: 0}) + STILL * _largest(sides)
    _transitions(build, sides, still)


def _inertial(build: Build, sides: Sequence[_Side], slides: Expression) -> None:
    (ds, turn), m = symengine.symbols("dspeed_dt dturn_dt"), sides[0].far.m
    (x, y), (c, s), least = (side.driving for side in sides), (side.cosine for side in sides), _least(build, sides)
    along, across = c * x + s * y, c * y - s * x
    build.rows["speed"] = ds - slides * along / m
    build.rows["turn"] = where(slides > 0, sqrt(SPEED**2 + least**2) * turn - across / m, turn)


def _least(build: Build, sides: Sequence[_Side]) -> Expression:
    """Speed that friction takes away within the rounding of time [m/s]."""
    return MOMENT * _largest(sides) / sides[0].far.m * build.t + SLOWEST


def _steady(build: Build, sides: Sequence[_Side], slides: Expression) -> Expression:
    """Balances without inertia; returns that along the direction of sliding.

    They are written about the direction in which sliding began: there their terms cancel, and what is left is exact.
    """
    (x, y), (size, other) = (side.needed for side in sides), (_resistance(build, side) for side in sides)
    if size != other:
        raise InputError(
            "without a mass the direction of sliding by dry friction is that of the pull, unless what resists sliding "
            "differs from direction to direction. Give the tangential mounting a mass `m`, or the same in both.",
            PLACE,
        )
    c, s, (b, b_2) = cos(TURNED), sin(TURNED), BEGAN
    ahead, aside = b * x + b_2 * y, b * y - b_2 * x
    along, across = c * ahead + s * aside - size, c * aside - s * ahead
    slope = derivative(size, SPEED)
    linear = slope != 0 and not depends(slope, SPEED)
    build.rows["speed"] = where(slides > 0, along.subs({SPEED: 0}) / slope - SPEED if linear else along, SPEED)
    build.rows["turn"] = where(slides > 0, across, TURNED)
    build.motion.slides_by |= {"speed": SPEED, "turn": TURNED}
    rows = [build.expanded(row) for row in (along, across)]
    stable = determinant([[-derivative(row, x) for x in (SPEED, TURNED)] for row in rows])
    build.margins.append(Margin("stable speed", where(slides > 0, stable, 1), UNSTABLE))
    return along


def _resistance(build: Build, side: _Side) -> Expression:
    """What resists sliding along one of the directions alone [Pa]."""
    own = BEGAN[side.kind.d is ACROSS]
    pointing = {b: symengine.Integer(b == own) for b in BEGAN}
    friction = build.expanded(side.resisted).subs({**pointing, TURNED: NONE})
    return friction + (side.far.c_b + side.far.c_g) * SPEED


def _largest(sides: Sequence[_Side]) -> Expression:
    """The larger half axis of what sticking bears."""
    a, b = (side.limit for side in sides)
    return a if a == b else where(a > b, a, b)


def _scaled(sides: Sequence[_Side]) -> list[Expression]:
    """The pull where the ellipse that sticking bears is stretched to a circle about its larger half axis."""
    top = _largest(sides)
    if all(side.limit == top for side in sides):
        return [side.needed for side in sides]
    known = [where(side.limit > NEXT_TO * top, side.limit, NEXT_TO * top) for side in sides]
    return [side.needed * where(top > 0, top / limit, 1) for side, limit in zip(sides, known, strict=True)]


def _transitions(build: Build, sides: Sequence[_Side], still: Expression) -> None:
    slip = symengine.Symbol("slip")
    pull, top = _scaled(sides), _largest(sides)
    borne = top - norm(*pull)
    aim = {b: x / where(norm(*pull) > 0, norm(*pull), 1) for b, x in zip(BEGAN, pull, strict=True)}
    breaking = next((law for law in build.interface.frictions if law.breaks_bonds), None)
    jump = broken(build, breaking) if breaking is not None else {}
    margin = where(slip > 0, 1, where(build.t < build.held_until, 1, borne))
    reason = "sticking gives way and the interface slides"
    modes = {slip: symengine.Integer(1), **aim}
    build.transitions.append(Transition("slip", margin, reason, modes, {**jump, TURNED: NONE}, sinks="local"))
    modes = {slip: where(borne < 0, 1, 0)} | {b: where(borne < 0, x, b) for b, x in aim.items()}
    rest = {TURNED: NONE} | ({SPEED: NONE} if sides[0].kind.inertial else {})
    reason = "sliding comes to a stop"
    build.transitions.append(Transition("stop", where(slip > 0, still, 1), reason, modes, rest, sinks="local"))
