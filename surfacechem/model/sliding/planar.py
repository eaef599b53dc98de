"""The plane of the interface in two directions: what pulls and resists along each, and along and across the sliding.

What resists sliding has a size along each of the two directions, and spans an ellipse over all of them: that of
friction, of dampers, or of springs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce

import symengine

from surfacechem.expressions import Expression, cos, depends, derivative, norm, sin, where
from surfacechem.model.build import Build
from surfacechem.model.components.mounting import ACROSS, FarField, far_field
from surfacechem.model.sliding.formulations import Kind
from surfacechem.model.sliding.slip import NONE, beside
from surfacechem.model.system import Margin

NEXT_TO = 1e-12
"""Part of what sticking bears along one direction that counts as none beside it along the other."""

SLIGHT = 1e-8
"""Part of the friction along one direction that is too little for the other one."""

RAILS = (
    "nothing rubs along one of two directions; with a mass, or with some friction there, what slides has a direction "
    "from the start"
)

SPEED, TURNED, SLIDES = symengine.symbols("speed turn slip")
BEGAN = symengine.symbols("began began_2")


@dataclass(frozen=True)
class Side:
    """One of the two directions: what pulls, what resists sliding, and what sticking bears."""

    kind: Kind
    far: FarField
    u: Expression
    cosine: Expression
    rate: Expression
    resisted: Expression
    needed: Expression
    limit: Expression
    t_a: Expression
    """Traction of what stands beside friction; ``far`` is the far field less this."""

    @property
    def driving(self) -> Expression:
        return self.far.force(self.u, self.rate) - self.resisted - self.far.c_g * self.rate


def side_of(build: Build, kind: Kind) -> Side:
    """One of the two directions of a scene."""
    assert kind.mount is not None
    motion, u = build.motion, symengine.Symbol(kind.d.displacement)
    t_a = derivative(build.psi, u)
    far = beside(far_field(build, kind.mount), t_a)
    resisted, limit = (build.energy.rubs * by[kind.d.axis] for by in (motion.sliding_tractions, motion.stick_limits))
    rate, cosine = motion.gap_rates[kind.d.displacement], unit_vector()[kind.d is ACROSS]
    return Side(kind, far, u, cosine, rate, resisted, far.force(u, NONE), limit, t_a)


def unit_vector() -> tuple[Expression, Expression]:
    """The direction of sliding: that in which it began, turned. So a straight line stays one to the last digit."""
    x, y = BEGAN
    return x * cos(TURNED) - y * sin(TURNED), y * cos(TURNED) + x * sin(TURNED)


def turned(pull: Sequence[Expression]) -> tuple[Expression, Expression]:
    """Components of a vector along and across the direction of sliding.

    They are taken about the direction in which sliding began: there their terms cancel, and what is left is exact.
    """
    (x, y), (b, b_2), c, s = pull, BEGAN, cos(TURNED), sin(TURNED)
    ahead, aside = b * x + b_2 * y, b * y - b_2 * x
    return c * ahead + s * aside, c * aside - s * ahead


def against(sizes: Sequence[Expression]) -> tuple[Expression, Expression]:
    """Components, along and across the direction of sliding, of what has these sizes along both directions."""
    (size, other), (x, y) = sizes, unit_vector()
    return size + (other - size) * y**2, (other - size) * x * y


def elliptic(pull: Sequence[Expression], sizes: Sequence[Expression]) -> tuple[Expression, Expression]:
    """The balances where the ellipse of what resists is stretched to a circle: its size [Pa], then half the angle that
    is left to turn.

    The size does not feel the direction, and is all but linear in the speed. In powers of the speed neither loses the
    least speed beside dry friction.
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
    reach, (along, _) = norm(x * b, y * a), turned((x * b, y * a))
    across = _power_series([turned(part)[1] for part in ((x * b_0, y * a_0), (x * b_1, y * a_1))])
    whole, double = reach * (reach + a * b), reach + along
    size = norm(x, y) * _power_series(excess) / where(whole > 0, whole, 1)
    return size, across / where(double > 0, double, 1)


def _power_series(terms: Sequence[Expression]) -> Expression:
    """A sum of powers of the speed."""
    return reduce(lambda total, term: total * SPEED + term, reversed(terms))


def resistance(build: Build, side: Side) -> Expression:
    """What resists sliding along one of the directions alone [Pa]."""
    own = BEGAN[side.kind.d is ACROSS]
    sliding = {b: symengine.Integer(b == own) for b in BEGAN} | {TURNED: NONE, SLIDES: symengine.Integer(1)}
    friction = build.expanded(side.resisted).subs(sliding)
    return friction + (side.far.c_b + side.far.c_g) * SPEED


def largest(sides: Sequence[Side]) -> Expression:
    """The larger half axis of what sticking bears."""
    a, b = (side.limit for side in sides)
    return a if a == b else where(a > b, a, b)


def _scaled(sides: Sequence[Side]) -> list[Expression]:
    """The pull where the ellipse that sticking bears is stretched to a circle about its larger half axis."""
    top = largest(sides)
    if all(side.limit == top for side in sides):
        return [side.needed for side in sides]
    known = [where(side.limit > NEXT_TO * top, side.limit, where(top > 0, NEXT_TO * top, 1)) for side in sides]
    return [side.needed * where(top > 0, top / limit, 1) for side, limit in zip(sides, known, strict=True)]


def borne(sides: Sequence[Side]) -> Expression:
    """What sticking bears beyond the pull [Pa]."""
    return largest(sides) - norm(*_scaled(sides))


def aim(build: Build, sides: Sequence[Side]) -> dict[Expression, Expression]:
    """The direction in which sliding begins; what nothing holds back begins in that of its drive."""
    pull = _scaled(sides)
    size = norm(*pull)
    pulled = {b: x / where(size > 0, size, 1) for b, x in zip(BEGAN, pull, strict=True)}
    drive = [build.total_derivative(side.far.force(NONE, NONE)) for side in sides]
    pace = norm(*drive)
    led = {b: where(pace > 0, x / where(pace > 0, pace, 1), b) for b, x in zip(BEGAN, drive, strict=True)}
    return {b: where(size > 0, pulled[b], led[b]) for b in BEGAN}


def rate_independent(kind: Kind) -> bool:
    """Whether springs alone hold what slides."""
    return not (kind.inertial or kind.rate_dependent)


def refuse_rails(build: Build, sides: Sequence[Side]) -> None:
    """Without inertia friction along one direction alone leaves open how sliding begins."""
    a, b = (side.limit for side in sides)
    if a != b:
        least, top = where(a > b, b, a), largest(sides)
        margin = where(top > 0, least / where(top > 0, top, 1) - SLIGHT, 1)
        build.margins.append(Margin("friction in both directions", margin, RAILS))
