r"""Dry friction as a set-valued force law: the traction is in a set that depends on the slip velocity.

.. math:: t \in L\,\partial|v|

At rest the set is the interval up to the limit L; during slip it is L against the velocity. In the plane it is an
ellipse. The mode ``slip`` is -1, 0 or 1 along a line; in the plane it is 0 or 1, and registers hold the direction in
which slip began. Its edges: the traction needed to stick exceeds the limit; the velocity returns to zero.

A limit of zero gives :math:`t = 0` at any velocity: stick and slip coincide, and the slip direction is meaningless.
Slip without inertia then continues in its mode, and ends when the limit begins to grow against it.

In an impact the same law holds for impulses. A mass m that meets a rigid contact with the velocity v and rebounds with
:math:`-e\,v` gives the pressure the impulse :math:`J = (1+e)\,m|v|`. A sliding mass m_t loses :math:`\mu J / m_t` of
its velocity, at most all of it. Slip without a mass, or behind a tangential spring of the interface, sticks for that
instant without loss.

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
"""Pressures [Pa] between which friction has to be proportional to pressure, as it must at an infinite one."""

SOFTEN = "Let a potential bear the bodies, such as `penalty`."


def set_valued(
    reserves: Mapping[int, Expression],
    back: Mapping[int, Expression],
    aim: Mapping[Expression, Expression],
    onward: Mapping[Expression, Expression],
    begin: Mapping[Expression, Expression],
    end: Mapping[Expression, Expression],
    *,
    equilibrates: bool = False,
    rests: bool = False,
) -> Constraint:
    """Return the edges between stick and slip, in both directions along a line or in any direction of the plane.

    By the slip mode that is entered, ``reserves`` are those of sticking (limit less need); by the mode that is left,
    ``back`` is the guard of the stop. When slip begins, the registers of its direction become ``aim`` and the states
    ``begin`` are reset. When it stops, the states ``end`` are reset and the modes become ``onward``: it may slip on if
    sticking cannot bear the pull. If the edge ``equilibrates``, quasi-static gaps find their equilibrium. If ``back``
    is a rate, slip also stops if it ``rests`` at zero.
    """
    edges = []
    for s, guard in reserves.items():
        word = {1: " forward", -1: " backward"}[s] if len(reserves) > 1 else ""
        reason, modes = f"sticking gives way and the interface slides{word}", {SLIP: symengine.Integer(s), **aim}
        begins = Edge(f"slip{word}", guard, reason, modes, begin, equilibrates, "local", strict=True, when={SLIP: (0,)})
        edges.append(begins)
    for s, guard in back.items():
        reason = "sliding comes to a stop"
        stops = Edge("stop", guard, reason, onward, end, heat="local", strict=True, rests=rests, when={SLIP: (s,)})
        edges.append(stops)
    return Constraint(edges=tuple(edges))


def breaks_bonds(build: Build) -> dict[Expression, Expression]:
    """Return the new values of the bonding variables if a law breaks the bonds when slip begins."""
    law = next((law for law in build.interface.frictions if law.breaks_bonds), None)
    return {} if law is None else broken(build, law)


def friction_impulse(build: Build, impulse: Expression) -> Iterator[Constraint]:
    """Yield the friction impulse, by which a sliding mass slows down; ``impulse`` is that of the pressure [Pa s]."""
    laws = [law for law in build.interface.frictions if feels_pressure(law)]
    sliding = [slip for slip in build.motion.slips if slip.slides_inertially]
    if not (laws and sliding):
        return
    v, exerted = symengine.Symbol("speed" if len(sliding) == 2 else "v"), IMPULSE.symbol
    ratio = build.energy.unbonded * symengine.Add(*(_impulse_ratio(build, law, v) for law in laws))
    loss = ratio * exerted / far_field(build, sliding[0].mount).law.m
    stops = {} if build.mode("slip") is None else {SLIP: where(loss < absolute(v), SLIP, ZERO)}
    left = {v: where(loss < absolute(v), v - loss * sign(v), ZERO)}
    due, reason = where(exerted > 0, -1, 1), "friction answers the impact"
    rub = Edge("rub", due, reason, {exerted: ZERO, **stops}, left, heat="local")
    pressed = {exerted: where(absolute(v) > 0, impulse, ZERO)}
    # Before the rest: friction responds to each impact separately.
    yield Constraint((), (IMPULSE,), (rub,), at_once=True, resets=lambda edge: pressed if edge.is_impact else {})


def _impulse_ratio(build: Build, law: Friction, v: Expression) -> Expression:
    """Return the ratio of the impulse of friction to that of the pressure, for decelerating slip."""
    unknown = f"{law.name()}: what an impact takes from sliding is not known where"
    if law.transverse is not None:
        turns = "friction differs from direction to direction, since it turns within the impact"
        raise InputError(f"{unknown} {turns}. {SOFTEN}", law.place)
    bound = build.bound(law)
    traction = build.variables.call(bound, bound.statement, {"p": P, "v": v, "direction": ONE})
    expression = symengine.sympify(traction).subs({symengine.Symbol("p"): P, symengine.Symbol("t_n"): -P})
    slopes = [derivative(expression, P).subs({P: symengine.RealDouble(p)}) for p in TRIAL_PRESSURES]
    finite, infinite = (build.at_start(slope) for slope in slopes)
    if finite != infinite:
        problem = f"{law.name()}: the impulse of friction in an impact is not known"
        reason = "where the coefficient of friction varies with the pressure, which is not finite then"
        raise InputError(f"{problem} {reason}. {SOFTEN}", law.place)
    ratio = slopes[-1]
    if depends(ratio, v) or depends(build.expanded(ratio), v):
        varies = "the coefficient of friction varies with the sliding velocity, which changes within the impact"
        raise InputError(f"{unknown} {varies}. {SOFTEN}", law.place)
    return ratio
