r"""Dry friction in the plane of the interface: a speed and a direction of sliding that both components share.

The velocity of sliding is its speed s times a unit vector n, which has turned by the angle :math:`\alpha` since sliding
began. With :math:`f` what drives the interface less what resists it,

.. math:: m \dot s = f \cdot n, \quad m s\,\dot\alpha = f \cdot n_\perp,

of which the first is regular where sliding stops, so that a stop is the zero of a smooth function. The second is not:
what is not driven straight turns ever faster into its last direction. There s counts as no less than what friction
takes away within the rounding of time. That bends the path of such speeds and takes no energy, since what turns does no
work. Without a mass both lines are balances, which dampers close; springs alone would leave the speed undetermined.

Friction over all directions is an ellipse of tractions, and sticking bears what is inside. Sliding begins in the
direction in which friction is the pull.

Source: Sauer, Duong & Mandadapu (2021), eqs. e:dry_fric and e:tt_max, with Newton's law in polar components of the
velocity; Coulomb's law in the plane as in Acary & Brogliato (2008), doi 10.1007/978-3-540-75392-6.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial, reduce

import symengine

from surfacechem.errors import InputError
from surfacechem.expressions import Expression, cos, depends, derivative, norm, sin, sqrt, where
from surfacechem.model.automaton import Constraint, Mode, Register
from surfacechem.model.balances import Power
from surfacechem.model.build import Build
from surfacechem.model.components.mounting import ACROSS, LENGTH, FarField, far_field
from surfacechem.model.constraints.set_valued import SLIP, breaks_bonds, in_the_plane
from surfacechem.model.sliding.formulation import (
    NONE,
    PLACE,
    UNSTABLE,
    Formulation,
    beside,
    evolve,
    name_traction,
)
from surfacechem.model.system import STABLE, Given, Margin
from surfacechem.quantities import VARIABLES
from surfacechem.tolerances import MOMENT, PICOMETRE, ROUNDING, SQRT_EPS, STILL

SPEED, TURNED = symengine.symbols("speed turn")
SLIDES = SLIP
BEGAN = symengine.symbols("began began_2")
WORDS = {0.0: "sticks", 1.0: "slides"}

SLOWEST = PICOMETRE / 1e6
"""Speed [m/s] below which the turn is never resolved, a picometre in twelve days: it keeps the row regular at t = 0."""

SWIFT, RADIAN = 0.1, 1e6
"""Scales of the speed [m/s] and of the turn [rad]: what rounding of the pull makes of either as sliding begins is no
error. The turn is accurate to a part of one radian, not of itself.
"""


@dataclass(frozen=True)
class Side:
    """One of the two directions: what pulls, what resists sliding, and what sticking bears."""

    kind: Formulation
    far: FarField
    """The far field less ``t_a``."""
    u: Expression
    rate: Expression
    resisted: Expression
    needed: Expression
    """Traction that friction has to bear for the interface to stick."""
    limit: Expression
    t_a: Expression
    """Traction of what stands beside friction."""

    @property
    def driving(self) -> Expression:
        return self.far.force(self.u, self.rate) - self.resisted - self.far.c_g * self.rate


def states(build: Build, kinds: Sequence[Formulation]) -> None:
    """Displacements, speed and direction, and the velocities that follow."""
    inertial = kinds[0].inertial
    if not inertial and not all(kind.rate_dependent for kind in kinds):
        raise InputError(
            "dry friction in two directions does not say how fast the interface slides, nor do springs. Give the "
            "mounting a mass `m`, or a damper `c_b` along both directions.",
            PLACE,
        )
    role = "evolved" if inertial else "algebraic"
    mode = Mode("slip", 0.0, WORDS, where(SPEED > 0, 1.0, 0.0) if inertial else None)
    began = [
        Register(str(b), "component of the direction in which sliding began", initial, partial(_began, v))
        for b, initial, v in zip(BEGAN, (1.0, 0.0), ("v", "v_2"), strict=True)
    ]
    slip = build.constrain(Constraint((mode,), tuple(began), active=SLIDES)).active
    build.variables.define("sticking", lambda: 1 - slip, "mode", "sticks or slides")
    for kind in kinds:
        u = evolve(build, kind.d.displacement)
        build.variables.define(kind.d.displacement, partial(_same, u), "evolved", "mechanics.tangential")
    speed = evolve(build, "speed", algebraic=not inertial, scale=SWIFT if inertial else LENGTH)
    build.variables.define("speed", lambda: speed, role, "balance of the tangential tractions")
    evolve(build, "turn", algebraic=not inertial, scale=RADIAN)
    if inertial:  # the initial speed is given by both components of the velocity
        start = {f"initial.{v}": build.scene.initial.get(v, 0.0) for v in ("v", "v_2")}
        for j, v, of in ((-2, "v", _speed), (-1, "v_2", _straight)):
            given = Given(VARIABLES[v], start[f"initial.{v}"], of)
            build.states[j] = replace(build.states[j], initial=of(start), given=given)
    for kind, cosine in zip(kinds, _unit_vector(), strict=True):
        build.variables.define(kind.d.cosine, partial(_same, slip * cosine), role, "turn")
        velocity = build.name(VARIABLES[kind.d.velocity], SPEED * cosine)
        build.variables.define(kind.d.velocity, partial(_same, velocity), "derived", "speed and turn")
        build.motion.gap_rates[kind.d.displacement] = velocity


def _same(expression: Expression) -> Expression:
    return expression


def _speed(values: Mapping[str, float]) -> float:
    return math.hypot(values.get("initial.v", 0.0), values.get("initial.v_2", 0.0))


def _straight(values: Mapping[str, float]) -> float:
    return 0.0


def _began(v: str, values: Mapping[str, float]) -> float:
    """Component of the unit vector of the initial velocity."""
    speed = _speed(values)
    return values[f"initial.{v}"] / speed if speed else float(v == "v")


def motion(build: Build, kinds: Sequence[Formulation]) -> Iterator[Power | Constraint]:
    """Balances along and across the direction of sliding, and the edges between sticking and sliding."""
    sides = [_side(build, kind) for kind in kinds]
    for side in sides:
        build.rows.kinematics(side.kind.d.displacement, side.rate)
        assert side.kind.mount is not None
        yield from far_field(build, side.kind.mount).book(build, side.u, side.rate)
        name_traction(build, side.kind.d, SLIDES, side.t_a + side.resisted, side.t_a + side.needed)
    still = _inertial(build, sides) if kinds[0].inertial else _steady(build, sides)
    beyond = _largest(sides) - norm(*_scaled(sides))
    stops = (SPEED,) if kinds[0].inertial else ()
    yield in_the_plane(beyond, _aim(build, sides), TURNED, still, breaks_bonds(build), stops)


def _side(build: Build, kind: Formulation) -> Side:
    assert kind.mount is not None
    motion, u = build.motion, symengine.Symbol(kind.d.displacement)
    t_a = derivative(build.psi, u)
    far = beside(far_field(build, kind.mount), t_a)
    resisted, limit = (build.energy.rubs * by[kind.d.axis] for by in (motion.sliding_tractions, motion.stick_limits))
    return Side(kind, far, u, motion.gap_rates[kind.d.displacement], resisted, far.force(u, NONE), limit, t_a)


def _inertial(build: Build, sides: Sequence[Side]) -> Expression:
    """Newton's law along and across the direction of sliding; returns what is zero where sliding stops."""
    turn, m = symengine.Symbol("dturn_dt"), sides[0].far.m
    (x, y), (c, s) = (side.driving for side in sides), _unit_vector()
    along, across = c * x + s * y, c * y - s * x
    # The speed that friction takes away within the rounding of time counts as the least one.
    least = MOMENT * _largest(sides) / m * build.t + SLOWEST
    build.rows.momentum("speed", along, m, SLIDES)
    build.rows.switched("turn", SLIDES, sqrt(SPEED**2 + least**2) * turn - across / m, turn)
    return SPEED + STILL / MOMENT * least


def _steady(build: Build, sides: Sequence[Side]) -> Expression:
    """Balances without inertia; returns what is zero where sliding stops, the one along its direction.

    What resists has to grow with the speed. The direction follows at once, so it has no part in that.
    """
    _refuse_rails(build, sides)
    pull, sizes = [side.needed for side in sides], [_resistance(build, side) for side in sides]
    (size, other), (x, y) = sizes, _unit_vector()
    ahead, aside = _turned(pull)
    along, across = ahead - (size + (other - size) * y**2), aside - (other - size) * x * y
    # What rounding leaves of the balance in which sliding begins must not stop it.
    still = along.subs({SPEED: 0}) + STILL * _largest(sides)
    if size != other:
        rubs = sum((part.subs({SPEED: 0}) for part in sizes), NONE)
        along, across = (where(rubs > 0, *pair) for pair in zip(_elliptic(pull, sizes), (along, across), strict=True))
    slope = derivative(along, SPEED)
    linear = slope != 0 and not depends(slope, SPEED)
    along_row = -along.subs({SPEED: 0}) / slope - SPEED if linear else along
    build.rows.switched("speed", SLIDES, along_row, SPEED)
    build.rows.switched("turn", SLIDES * norm(*pull), across, TURNED)  # what nothing pulls has no direction
    build.motion.slides_by |= {"speed": SPEED, "turn": TURNED}
    stable = -derivative(build.expanded(along), SPEED)
    build.margins.append(Margin(f"{STABLE}speed", stable, UNSTABLE, when={SLIDES: (1,)}, stability="speed"))
    return still


def _unit_vector() -> tuple[Expression, Expression]:
    """The direction of sliding: that in which it began, turned. So a straight line stays one to the last digit."""
    x, y = BEGAN
    return x * cos(TURNED) - y * sin(TURNED), y * cos(TURNED) + x * sin(TURNED)


def _turned(pull: Sequence[Expression]) -> tuple[Expression, Expression]:
    """Components of a vector along and across the direction of sliding.

    They are taken about the direction in which sliding began: there their terms cancel, and what is left is exact.
    """
    (x, y), (b, b_2), c, s = pull, BEGAN, cos(TURNED), sin(TURNED)
    ahead, aside = b * x + b_2 * y, b * y - b_2 * x
    return c * ahead + s * aside, c * aside - s * ahead


def _elliptic(pull: Sequence[Expression], sizes: Sequence[Expression]) -> tuple[Expression, Expression]:
    r"""The balances where the ellipse of what resists is stretched to a circle: its size [Pa], then half the angle that
    is left to turn.

    With the pull (x, y) and the half axes a, b, stretching by (b, a) makes the circle a b, and the pull reaches
    :math:`\rho = |(x b, y a)|`. The size is :math:`|(x, y)| (\rho^2 - a^2 b^2) / \rho (\rho + a b)`: it does not feel
    the direction, and is all but linear in the speed. Its numerator is expanded in powers of the speed, about
    ``reach_0`` and the product ``r_0`` at none, so that it does not lose the least speed beside dry friction.
    """
    (x, y), (a, b) = pull, sizes
    (a_0, a_1), (b_0, b_1) = ((size.subs({SPEED: 0}), derivative(size, SPEED)) for size in sizes)
    if depends(a_1, SPEED) or depends(b_1, SPEED):
        (a_0, b_0), (a_1, b_1) = (a, b), (NONE, NONE)
    r_0, r_1, r_2, reach_0 = a_0 * b_0, a_0 * b_1 + a_1 * b_0, a_1 * b_1, norm(x * b_0, y * a_0)
    excess = (
        (reach_0 - r_0) * (reach_0 + r_0),
        2 * (x**2 * b_0 * b_1 + y**2 * a_0 * a_1 - r_0 * r_1),
        (x * b_1) ** 2 + (y * a_1) ** 2 - r_1**2 - 2 * r_0 * r_2,
        -2 * r_1 * r_2,
        -(r_2**2),
    )
    reach, (along, _) = norm(x * b, y * a), _turned((x * b, y * a))
    across = [_turned(part)[1] for part in ((x * b_0, y * a_0), (x * b_1, y * a_1))]
    whole, double = reach * (reach + a * b), reach + along
    size = norm(x, y) * _power_series(excess) / where(whole > 0, whole, 1)
    return size, _power_series(across) / where(double > 0, double, 1)


def _power_series(terms: Sequence[Expression]) -> Expression:
    """A sum of powers of the speed."""
    return reduce(lambda total, term: total * SPEED + term, reversed(terms))


def _resistance(build: Build, side: Side) -> Expression:
    """What resists sliding along one of the directions alone [Pa]."""
    own = BEGAN[side.kind.d is ACROSS]
    sliding = {b: symengine.Integer(b == own) for b in BEGAN} | {TURNED: NONE, SLIDES: symengine.Integer(1)}
    return build.expanded(side.resisted).subs(sliding) + (side.far.c_b + side.far.c_g) * SPEED


def _largest(sides: Sequence[Side]) -> Expression:
    """The larger half axis of what sticking bears."""
    a, b = (side.limit for side in sides)
    return a if a == b else where(a > b, a, b)


def _scaled(sides: Sequence[Side]) -> list[Expression]:
    """The pull where the ellipse that sticking bears is stretched to a circle about its larger half axis."""
    top = _largest(sides)
    if all(side.limit == top for side in sides):
        return [side.needed for side in sides]
    # What sticking bears along one direction has to be told from none beside the other.
    least = where(top > 0, ROUNDING * top, 1)
    known = [where(side.limit > ROUNDING * top, side.limit, least) for side in sides]
    return [side.needed * where(top > 0, top / limit, 1) for side, limit in zip(sides, known, strict=True)]


def _aim(build: Build, sides: Sequence[Side]) -> dict[Expression, Expression]:
    """The direction in which sliding begins; what nothing holds back begins in that of its drive."""
    pull, drive = _scaled(sides), [build.total_derivative(side.far.force(NONE, NONE)) for side in sides]
    size, pace = norm(*pull), norm(*drive)
    led = [where(pace > 0, x / where(pace > 0, pace, 1), b) for b, x in zip(BEGAN, drive, strict=True)]
    return {
        b: where(size > 0, x / where(size > 0, size, 1), other) for b, x, other in zip(BEGAN, pull, led, strict=True)
    }


def _refuse_rails(build: Build, sides: Sequence[Side]) -> None:
    """Without inertia friction along one direction alone leaves open how sliding begins."""
    a, b = (side.limit for side in sides)
    if a == b:
        return
    top, reason = _largest(sides), "dry friction acts along one of two directions: the way of slip is undetermined"
    ratio = where(top > 0, where(a > b, b, a) / where(top > 0, top, 1) - SQRT_EPS, 1)
    remedy = "Give the mounting a mass `m`, or friction along the other direction, too."
    build.margins.append(Margin("friction in both directions", ratio, reason, remedy=remedy))
