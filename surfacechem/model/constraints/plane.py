r"""Dry friction in the plane of the interface: both components share a slip speed and a slip direction.

The slip velocity is its speed s times a unit vector n, which has turned by the angle :math:`\alpha` since slip began.
With :math:`f` the driving traction less the resistance,

.. math:: m \dot s = f \cdot n, \quad m s\,\dot\alpha = f \cdot n_\perp.

The first equation is regular as slip stops, so that a stop is the zero of a smooth function. The second is singular:
unless driven straight, the velocity turns ever faster into its last direction. In it s therefore counts as no less than
the speed that friction takes away within the rounding of time, and that all tractions make in that of a brief part of
the run. That bends the path at such speeds and takes no energy, since turning does no work. Without a mass both
equations are balances, which dampers close; springs alone would leave the speed undetermined.

Friction over all directions is an ellipse of tractions, and sticking bears its interior. Slip begins in the direction
whose friction equals the pull.

Source: Sauer, Duong & Mandadapu (2021), eqs. e:dry_fric and e:tt_max, with Newton's law in polar components of the
velocity; Coulomb's law in the plane as in Acary & Brogliato (2008), doi 10.1007/978-3-540-75392-6.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import symengine

from surfacechem.contracts.terms import Spec
from surfacechem.errors import InputError
from surfacechem.expressions import Expression, absolute, cos, depends, derivative, norm, polynomial, sin, sqrt, where
from surfacechem.model.automaton import ZERO, Constraint, Mode, Register
from surfacechem.model.build import Build, Record
from surfacechem.model.components.formulation import PLACE, Formulation, evolve, growth, name_traction
from surfacechem.model.components.mounting import Direction, FarField, far_field
from surfacechem.model.constraints.set_valued import SLIP, breaks_bonds, set_valued
from surfacechem.model.system import END_PATH, STABLE_PREFIX, Given, Margin
from surfacechem.quantities import VARIABLES
from surfacechem.tolerances import BRIEF_PART, RUN_EPS, SQRT_EPS, TIME_EPS, TINY, TRACTION_EPS

SPEED, TURN = symengine.symbols("speed turn")
BEGAN = symengine.symbols("began began_2")
STICK_WORDS = {0.0: "sticks", 1.0: "slides"}

LEAST_SPEED = TINY**0.5
"""Least speed [m/s] in the turn where no traction acts: its square is still a normal number."""

TURN_SCALE = 1e6
"""Scale of the turn [rad]. Its absolute error counts, relative to one radian, and the turn that roundoff of the pull
causes as slip begins is no error."""


class Component(NamedTuple):
    """Tractions in one of the two directions: the pull, the resistance to slip, and the limit of sticking."""

    d: Direction
    far: FarField
    u: Expression
    rate: Expression
    t_a: Expression
    """Traction in parallel with friction."""
    resisted: Expression
    limit: Expression

    @property
    def needed(self) -> Expression:
        """Traction that friction has to bear for the interface to stick."""
        return self.far.force(self.u, ZERO) - self.t_a

    @property
    def driving(self) -> Expression:
        """Traction that drives slip."""
        return self.far.force(self.u, self.rate) - self.t_a - self.resisted - self.far.law.c_g * self.rate


def states(build: Build, kinds: Sequence[Formulation]) -> Iterator[Constraint]:
    """Define displacements, speed, direction, and the velocities that follow; yield the mode and registers of slip."""
    inertial = kinds[0].inertial
    if not inertial and not all(kind.rate_dependent for kind in kinds):
        problem = "dry friction in two directions does not say how fast the interface slides, nor do springs"
        remedy = "Give the mounting a mass `m`, or a damper `c_b` along both directions."
        raise InputError(f"{problem}. {remedy}", PLACE)
    mode = Mode("slip", 0.0, STICK_WORDS, where(SPEED > 0, 1.0, 0.0) if inertial else None)
    registers = (
        Register(str(b), "component of the direction in which sliding began", first, partial(_began, v))
        for b, first, v in zip(BEGAN, (1.0, 0.0), ("v", "v_2"), strict=True)
    )
    yield Constraint((mode,), tuple(registers), active=SLIP)
    build.variables.define("sticking", 1 - SLIP, "mode", "sticks or slides")
    for kind in kinds:
        evolve(build, kind.d.displacement, "mechanics.tangential")
    by, slow = "balance of the tangential tractions", not inertial
    start: dict[str, Any] = {"speed": {}, "turn": {}}
    if inertial:  # both follow from the components of the initial velocity
        along, across = (build.scene.initial.get(v, 0.0) for v in ("v", "v_2"))
        start["speed"] = {"start": math.hypot(along, across), "given": Given(VARIABLES["v"], along, _speed)}
        start["turn"] = {"start": 0.0, "given": Given(VARIABLES["v_2"], across, lambda _: 0.0)}
    evolve(build, "speed", by, algebraic=slow, **start["speed"])
    evolve(build, "turn", algebraic=slow, scale=TURN_SCALE, **start["turn"])
    for kind, cosine in zip(kinds, _unit_vector(), strict=True):
        build.variables.define(kind.d.cosine, SLIP * cosine, "evolved" if inertial else "algebraic", "turn")
        velocity = build.name(VARIABLES[kind.d.velocity], SPEED * cosine)
        build.variables.define(kind.d.velocity, velocity, "derived", "speed and turn")
        build.motion.gap_rates[kind.d.displacement] = velocity


def _speed(values: Mapping[str, float]) -> float:
    return math.hypot(values.get("initial.v", 0.0), values.get("initial.v_2", 0.0))


def _began(v: str, values: Mapping[str, float]) -> float:
    """Return a component of the unit vector of the initial velocity."""
    speed = _speed(values)
    return values[f"initial.{v}"] / speed if speed else float(v == "v")


def motion(build: Build, kinds: Sequence[Formulation]) -> Iterator[Record]:
    """Yield the balances along and across the slip direction, and the edges between stick and slip."""
    sides, unbonded = [], build.energy.unbonded
    for kind in kinds:
        assert kind.mount is not None
        d, u, far = kind.d, symengine.Symbol(kind.d.displacement), far_field(build, kind.mount)
        rate, t_a = build.motion.gap_rates[d.displacement], derivative(build.psi, u)
        resisted, limit = (unbonded * by[d.axis] for by in (build.motion.sliding_tractions, build.motion.stick_limits))
        side = Component(d, far, u, rate, t_a, resisted, limit)
        sides.append(side)
        build.rows.kinematics(d.displacement, rate)
        yield from far.powers(build, u, rate)
        name_traction(build, d, SLIP, t_a + resisted, t_a + side.needed)
    a, b = (side.limit for side in sides)
    largest = a if a == b else where(a > b, a, b)
    if kinds[0].inertial:
        still = _inertial(build, sides, largest)
    else:
        still, ahead = _steady(build, sides, largest)
        if a != b:
            # Without inertia, friction along one direction only leaves the onset of slip undetermined.
            reason = "dry friction acts along one of two directions: the way of slip is undetermined"
            ratio = where(largest > 0, where(a > b, b, a) / where(largest > 0, largest, 1) - SQRT_EPS, 1)
            remedy = "Give the mounting a mass `m`, or friction along the other direction, too."
            yield Margin("friction in both directions", ratio, reason, remedy=remedy)
        stable = growth(ahead, sum(side.far.law.c_b + side.far.law.c_g for side in sides))
        yield Margin(f"{STABLE_PREFIX}speed", stable, kinds[0].unstable, when={SLIP: (1,)}, stability="speed")
    pull = _scaled(sides, largest)
    # Slip begins in the direction of the pull, or, with a limit of zero, in that of the rate of the drive.
    drive = [build.total_derivative(side.far.force(ZERO, ZERO) - side.t_a) for side in sides]
    size, pace = norm(*pull), norm(*drive)
    led = [where(pace > 0, x / where(pace > 0, pace, 1), began) for began, x in zip(BEGAN, drive, strict=True)]
    aimed = [where(size > 0, x / where(size > 0, size, 1), other) for x, other in zip(pull, led, strict=True)]
    aim, beyond = dict(zip(BEGAN, aimed, strict=True)), largest - size
    onward, end = {SLIP: ZERO}, {TURN: ZERO}
    if kinds[0].inertial:  # it slips on if sticking cannot bear the pull
        onward = {SLIP: where(beyond < 0, 1, 0)} | {b: where(beyond < 0, x, b) for b, x in aim.items()}
        end = {TURN: ZERO, SPEED: ZERO}
    yield set_valued({1: beyond}, {1: still}, aim, onward, {**breaks_bonds(build), TURN: ZERO}, end)


def _inertial(build: Build, sides: Sequence[Component], largest: Expression) -> Expression:
    """Set Newton's law along and across the slip direction; return the guard whose zero stops slip."""
    turn, m = symengine.Symbol("dturn_dt"), sides[0].far.law.m
    (x, y), (c, s) = (side.driving for side in sides), _unit_vector()
    along, across = c * x + s * y, c * y - s * x
    # The speed that friction takes away within the rounding of time is the least speed in the turn.
    end = build.constant("t_end", END_PATH, Spec("s", "end of the run"), 1.0, internal=True)
    acting = sum((side.far.size(side.u) + absolute(side.t_a) for side in sides), ZERO)
    least = TIME_EPS * (largest * build.t + BRIEF_PART * acting * end) / m + LEAST_SPEED
    build.rows.momentum("speed", along, m, SLIP)
    build.rows.switched("turn", SLIP, sqrt(SPEED**2 + least**2) * turn - across / m, turn)
    return SPEED + TRACTION_EPS / TIME_EPS * least


def _steady(build: Build, sides: Sequence[Component], largest: Expression) -> tuple[Expression, Expression]:
    r"""Set the balances without inertia; return the guard whose zero stops slip, and their slope with the speed.

    The resistance to slip in the direction n is the vector :math:`(a n_x, b n_y)`, whose half axes a and b grow with
    the speed. Its balance with the pull :math:`\mathbf P`, along n and across it, is

    .. math:: \mathbf P\cdot n - a - (b - a)\,n_y^2 = 0, \quad \mathbf P\cdot n_\perp - (b - a)\,n_x n_y = 0.

    An ellipse of dry friction is stretched to a circle instead, for which the two balances decouple. The direction
    follows at once, so that it does not enter the stability condition on the speed.
    """
    pull, sizes = [side.needed for side in sides], []
    for side, own in zip(sides, BEGAN, strict=True):  # the resistance to slip along each direction alone [Pa]
        sliding = {b: symengine.Integer(b == own) for b in BEGAN} | {TURN: ZERO, SLIP: symengine.Integer(1)}
        damping = (side.far.law.c_b + side.far.law.c_g) * SPEED
        sizes.append(build.expanded(side.resisted).subs(sliding) + damping)
    (a, b), (n_x, n_y) = sizes, _unit_vector()
    ahead, aside = _turned(pull)
    along, across = ahead - (a + (b - a) * n_y**2), aside - (b - a) * n_x * n_y
    still = along.subs({SPEED: 0})
    if a != b:
        dry = sum((part.subs({SPEED: 0}) for part in sizes), ZERO)
        along, across = (where(dry > 0, *pair) for pair in zip(_elliptic(pull, sizes), (along, across), strict=True))
    slope = derivative(along, SPEED)
    linear = slope != 0 and not depends(slope, SPEED)
    build.rows.switched("speed", SLIP, -along.subs({SPEED: 0}) / slope - SPEED if linear else along, SPEED)
    build.rows.switched("turn", SLIP * norm(*pull), across, TURN)  # without a pull there is no direction
    build.motion.slip_unknowns |= {"speed": SPEED, "turn": TURN}
    # The slope at rest is the limit from positive speeds; it changes sign at a fold.
    ahead = -derivative(build.expanded(along), SPEED).subs({SPEED: SPEED + TINY})
    if any(depends(derivative(size, SPEED), SPEED) for size in sizes):
        still = absolute(ahead) * SPEED
    # The roundoff of the balance in which slip begins must not stop it.
    return still + TRACTION_EPS * largest, ahead


def _unit_vector() -> tuple[Expression, Expression]:
    """Return the slip direction: the initial direction, turned. A straight path thus stays exact to the last digit."""
    x, y = BEGAN
    return x * cos(TURN) - y * sin(TURN), y * cos(TURN) + x * sin(TURN)


def _turned(pull: Sequence[Expression]) -> tuple[Expression, Expression]:
    """Return the components of a vector along and across the slip direction.

    They are formed relative to the direction in which slip began: there their terms cancel and the remainder is exact.
    """
    (x, y), (b, b_2), c, s = pull, BEGAN, cos(TURN), sin(TURN)
    ahead, aside = b * x + b_2 * y, b * y - b_2 * x
    return c * ahead + s * aside, c * aside - s * ahead


def _elliptic(pull: Sequence[Expression], sizes: Sequence[Expression]) -> tuple[Expression, Expression]:
    r"""Return the balances on an ellipse stretched to a circle: its size [Pa], then half the angle left to turn.

    The pull (x, y) is in balance with the half axes a, b if :math:`n = (x/a, y/b)` is a unit vector. Stretched by
    a b this is the vector (x b, y a), whose length, the ``reach`` :math:`\rho`, is that of the circle, the ``radius``
    :math:`r = a b`. The first balance,

    .. math:: |(x, y)|\,(\rho - r)/\rho = |(x, y)|\,(\rho^2 - r^2) / \rho\,(\rho + r) = 0,

    is independent of the direction and almost linear in the speed s. The ``excess`` :math:`\rho^2 - r^2` is a
    polynomial of s, since :math:`a = a_0 + a_1 s`, :math:`b = b_0 + b_1 s`, so that with
    :math:`r = r_0 + r_1 s + r_2 s^2` its terms are

    .. math:: (\rho_0 - r_0)(\rho_0 + r_0), \quad 2\,(x^2 b_0 b_1 + y^2 a_0 a_1 - r_0 r_1), \quad
              x^2 b_1^2 + y^2 a_1^2 - r_1^2 - 2 r_0 r_2, \quad -2 r_1 r_2, \quad -r_2^2.

    In this form even the least speed is not lost to rounding next to dry friction. The second balance is the tangent of
    half the angle from n to the stretched pull: its component ``across`` n over the sum of its length and its component
    along n.
    """
    (x, y), (a, b) = pull, sizes
    (a_0, a_1), (b_0, b_1) = ((size.subs({SPEED: 0}), derivative(size, SPEED)) for size in sizes)
    if depends(a_1, SPEED) or depends(b_1, SPEED):
        (a_0, b_0), (a_1, b_1) = (a, b), (ZERO, ZERO)  # not a polynomial: used unchanged
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
    size = norm(x, y) * polynomial(SPEED, excess) / where(whole > 0, whole, 1)
    return size, polynomial(SPEED, across) / where(double > 0, double, 1)


def _scaled(sides: Sequence[Component], top: Expression) -> list[Expression]:
    """Return the pull, scaled so that the ellipse of sticking becomes a circle about its larger half axis."""
    if all(side.limit == top for side in sides):
        return [side.needed for side in sides]
    # A limit below roundoff of the larger one is replaced by that roundoff.
    least = where(top > 0, RUN_EPS * top, 1)
    known = [where(side.limit > RUN_EPS * top, side.limit, least) for side in sides]
    return [side.needed * where(top > 0, top / limit, 1) for side, limit in zip(sides, known, strict=True)]
