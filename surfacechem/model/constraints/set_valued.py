r"""Dry friction as a set-valued law: the traction is one of those that the velocity of sliding allows.

.. math:: t \in L\,\partial|v|

At rest it is any up to the limit L, while sliding it is L against the velocity, in the plane on an ellipse. The mode of
slip is -1, 0 or 1 along a line; in the plane it is 0 or 1, beside registers of the direction in which sliding began.
Its edges: the traction that sticking needs passes the limit, the velocity returns to zero.

A limit of zero leaves :math:`t = 0` at any velocity: sticking and sliding are the same there, and the direction of
sliding has no meaning. What slides without inertia goes on as it is, and stops where the limit begins to grow against
it.

In an impact the same law holds for impulses. A mass m that meets a rigid contact with the velocity v and leaves it with
:math:`-e\,v` gives the pressure the impulse :math:`J = (1+e)\,m|v|`, and what slides with a mass m_t of its own loses
:math:`\mu J / m_t` of its velocity, and no more than that. What slides without a mass, or behind a tangential spring of
the interface, sticks for that instant, and nothing is lost.

Source: Coulomb's law as an inclusion, Moreau (1988), Unilateral contact and dry friction in finite freedom dynamics,
doi 10.1007/978-3-7091-2624-0_1; Sauer, Duong & Mandadapu (2021), eqs. e:dry_fric and e:tt_max; impulses of friction as
in Brogliato (2016), Nonsmooth Mechanics, doi 10.1007/978-3-319-28664-8.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import symengine

from surfacechem.contracts.terms import Friction
from surfacechem.errors import InputError
from surfacechem.expressions import Expression, absolute, depends, derivative, sign, where
from surfacechem.model.automaton import ONE, ZERO, Constraint, Edge, Register
from surfacechem.model.build import Build
from surfacechem.model.components.mounting import far_field, feels_pressure
from surfacechem.model.constraints.threshold import broken

SLIP = symengine.Symbol("slip")
P = symengine.Symbol("p of an impact")
IMPULSE = Register("impulse", "impulse of the pressure that friction has not answered yet [Pa s]")

TRIAL_PRESSURES = 1e50, 1e100
"""Pressures [Pa] between which friction has to grow in proportion, as it does at one that is infinite."""

SOFTEN = "Let a potential bear the bodies, such as `penalty`."


def set_valued(
    bears: Mapping[int, Expression],
    back: Mapping[int, Expression],
    aim: Mapping[Expression, Expression],
    onward: Mapping[Expression, Expression],
    begin: Mapping[Expression, Expression],
    end: Mapping[Expression, Expression],
    *,
    equilibrates: bool = False,
) -> Constraint:
    """Edges between sticking and sliding, both ways along a line or in whatever direction of the plane.

    By the mode of slip, ``bears`` is what sticking bears beyond what it has to, ``back`` what is zero where sliding
    stops. As it begins the registers of its direction are those of ``aim``, and the states ``begin`` change; as it
    stops the states ``end`` do, and the modes are those of ``onward``: it may go on where sticking does not bear what
    pulls. Gaps that are quasi-static find their equilibrium.
    """
    edges = []
    for s, guard in bears.items():
        word = {1: " forward", -1: " backward"}[s] if len(bears) > 1 else ""
        reason, modes = f"sticking gives way and the interface slides{word}", {SLIP: symengine.Integer(s), **aim}
        begins = Edge(f"slip{word}", guard, reason, modes, begin, equilibrates, "local", strict=True, when={SLIP: (0,)})
        edges.append(begins)
    for s, guard in back.items():
        reason = "sliding comes to a stop"
        edges.append(Edge("stop", guard, reason, onward, end, heat="local", strict=True, when={SLIP: (s,)}))
    return Constraint(edges=tuple(edges))


def breaks_bonds(build: Build) -> dict[Expression, Expression]:
    """New values of the bonding variables where a law breaks the bonds as sliding begins."""
    law = next((law for law in build.interface.frictions if law.breaks_bonds), None)
    return {} if law is None else broken(build, law)


def friction_impulse(build: Build, impulse: Expression) -> Iterator[Constraint]:
    """Friction impulse: loss of sliding velocity of a mass by the ``impulse`` of the pressure [Pa s] in an impact."""
    laws = [law for law in build.interface.frictions if feels_pressure(law)]
    sliding = [slip for slip in build.motion.slips if slip.slides_inertially]
    if not (laws and sliding):
        return
    v, exerted = symengine.Symbol("speed" if len(sliding) == 2 else "v"), IMPULSE.symbol
    ratio = build.energy.unbonded * symengine.Add(*(_impulse_ratio(build, law, v) for law in laws))
    loss = ratio * exerted / far_field(build, sliding[0].mount).m
    stops = {} if build.mode("slip") is None else {SLIP: where(loss < absolute(v), SLIP, ZERO)}
    left = {v: where(loss < absolute(v), v - loss * sign(v), ZERO)}
    due, reason = where(exerted > 0, -1, 1), "friction answers the impact"
    rub = Edge("rub", due, reason, {exerted: ZERO, **stops}, left, heat="local")
    pressed = {exerted: where(absolute(v) > 0, impulse, ZERO)}
    # Before the bodies rest: friction answers each impact on its own.
    yield Constraint((), (IMPULSE,), (rub,), at_once=True, beside=lambda edge: pressed if edge.is_impact else {})


def _impulse_ratio(build: Build, law: Friction, v: Expression) -> Expression:
    """Impulse of friction over that of the pressure, where sliding slows down under it."""
    unknown = f"{law.name()}: what an impact takes from sliding is not known where"
    if law.transverse is not None:
        raise InputError(
            f"{unknown} friction differs from direction to direction, since it turns within the impact. {SOFTEN}",
            law.place,
        )
    bound = build.bound(law)
    traction = build.variables.call(bound, bound.statement, {"p": P, "v": v, "direction": ONE})
    expression = symengine.sympify(traction).subs({symengine.Symbol("p"): P, symengine.Symbol("t_n"): -P})
    slopes = [derivative(expression, P).subs({P: symengine.RealDouble(p)}) for p in TRIAL_PRESSURES]
    finite, infinite = (build.at_start(slope) for slope in slopes)
    if finite != infinite:
        raise InputError(
            f"{law.name()}: the impulse of friction in an impact is not known where the coefficient of friction varies "
            f"with the pressure, which is not finite then. {SOFTEN}",
            law.place,
        )
    ratio = slopes[-1]
    if depends(ratio, v) or depends(build.expanded(ratio), v):
        raise InputError(
            f"{unknown} the coefficient of friction varies with the sliding velocity, which changes within the impact. "
            f"{SOFTEN}",
            law.place,
        )
    return ratio
