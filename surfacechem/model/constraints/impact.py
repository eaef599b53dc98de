r"""Rigid contact of a gap that moves: it closes, its mass rebounds, and what slides on it is rubbed in that instant.

A mass m that reaches contact with :math:`v < 0` leaves it with :math:`-e\,v`, by the impulse :math:`(1+e)\,m|v|`. Dry
friction acts in proportion to it: what slides with a mass of its own loses :math:`\mu\,(1+e)\,m|v| / m_t` of its
velocity, and no more than that. A velocity of sliding that is prescribed stays as it is; its drive does the work
:math:`\mu\,J\,|v|` instead, with the impulse J of the pressure. What slides without a mass, or behind a tangential
spring of the interface, sticks for that instant, and nothing is lost. Finite tractions, those of springs, dampers,
cohesion and adhesion, have no part in it.

Under a pressing traction rebounds follow each other ever faster, infinitely many in a time
:math:`2 e|v| m / (1-e)|F|`. The bodies rest where what is left of this is nothing, beside the time that has passed or
the fastest impact.

Source: Newton's law of impact and Coulomb's for impulses; Brogliato (2016), Nonsmooth Mechanics, doi
10.1007/978-3-319-28664-8.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import symengine

from surfacechem.contracts.terms import Friction, Spec
from surfacechem.errors import InputError
from surfacechem.expressions import Expression, absolute, depends, derivative, sign, where
from surfacechem.model.automaton import RESTS, Edge
from surfacechem.model.build import Build
from surfacechem.model.components.mounting import FarField, far_field, held, law_reads
from surfacechem.model.sliding.formulations import Kind
from surfacechem.model.sliding.resistance import resistance
from surfacechem.model.system import TOLERANCE

NONE, ONE = symengine.Integer(0), symengine.Integer(1)
G, V = symengine.symbols("g_n v_n")

NOTHING, SLOWEST = 0.1, 1e-11
"""Part of the fastest impact, or of the time so far, that counts as none, in units of the relative tolerance; and the
speed [m/s] that the fastest impact has at least there."""

BRIEF = 1e-13
"""Part of the time so far that one rebound must take to be told from none."""

HALF = 0.5
"""Part to which what is conducted per pressure falls, at least, from a high to a very high one where it is less than
in proportion."""


def impacts(build: Build) -> None:
    """How a gap that moves closes: where it has a mass by an impact, after which the bodies rebound or rest."""
    closed = build.find_mode("closed")
    if closed is None or "g_n" not in build.motion.gap_rates:
        return
    mount = held(build, "n")
    assert mount is not None
    shut, apart = {G: NONE}, {closed: (0,)}
    if not mount.inertial:
        closes = Edge("touch", G, "the gap closes", build.motion.heals, shut, equilibrates=True, when=apart)
        build.edges.append(closes)
        return
    far = far_field(build, mount)
    speed, pressing = absolute(V), -far.force(NONE, NONE) / far.m
    landed = build.register("landed", "whether the bodies have met and do not rebound")
    rests, modes = _rests(build, far, speed, pressing)
    rubs = rubbing(build, (1 + far.e) * far.m * speed)
    # What follows at the same moment comes before what would slide as long as the contact is open.
    build.edges[:0] = [
        Edge(
            "impact",
            G,
            "the bodies hit each other",
            {landed: rests, **modes, **rubs.begins},
            {**shut, V: where(rests > 0, NONE, far.e * speed)},
            returns=where(pressing > 0, 2 * V / pressing, NONE),
            when=apart,
        ),
        *rubs.edges,
        Edge(
            "rest",
            -ONE,
            "the bodies rest on each other",
            {landed: NONE, **build.motion.heals},
            equilibrates=True,
            when={landed: (1,)},
        ),
    ]


def _rests(
    build: Build, far: FarField, speed: Expression, pressing: Expression
) -> tuple[Expression, dict[Expression, Expression]]:
    """One where the bodies do not rebound, else zero; and the modes that it has to remember."""
    if far.e == 0:
        return ONE, {}
    tolerance = build.constant("tolerance", TOLERANCE, Spec("1", "relative tolerance of the run"), 0.0, internal=True)
    fastest = build.register("fastest", "speed of the fastest impact [m/s]")
    swift = where(speed > fastest, speed, fastest)
    rebound = far.e * speed
    nothing = NOTHING * tolerance
    # This flight takes 2 rebound / pressing, and all that follow together 1 / (1 - e) times as long.
    brief = pressing * build.t * ((1 - far.e) * nothing + BRIEF)
    slow = where(rebound < nothing * (swift + SLOWEST), 1, where(2 * rebound < brief, 1, 0))
    at_once = build.constant("rests_at", RESTS, Spec("s", "time at which rebounds rest"), -1.0, internal=True)
    return where(build.t > at_once, slow, 1), {fastest: swift}


def missed(build: Build) -> None:
    """Warn of what reads the pressure and would do something in an impact, where that is infinite for no time."""
    if not any(register.name == "landed" for register in build.registers):
        return
    found = [law.name() for law in build.interface.reactions if law_reads(law, "p") or law_reads(law, "t_n")]
    for (a, b), channels in build.conductances.items():
        if any(_keeps_up(build, h) for h in channels):
            found.append(f"the conductance between {a} and {b}")
    if found:
        names = " and ".join(dict.fromkeys(found))
        build.warnings.append(f"impacts take no time: what {names} would do at their pressure is left out.")


def _keeps_up(build: Build, h: Expression) -> bool:
    """Whether a conductance grows at least in proportion to the pressure; what grows less does nothing in no time."""
    at = [build.at_start(h.subs({symengine.Symbol("p"): symengine.RealDouble(p)})) / p for p in (FINITE, INFINITE)]
    return at[1] > HALF * at[0]


P = symengine.Symbol("p of an impact")

FINITE, INFINITE = 1e50, 1e100
"""Pressures [Pa] between which friction has to grow in proportion."""

SOFTEN = "Let a potential bear the bodies, such as `penalty`."


@dataclass(frozen=True)
class Rubbing:
    """What an impact sets off along the interface."""

    begins: Mapping[Expression, Expression] = field(default_factory=dict)
    """Modes that an impact sets."""
    edges: Sequence[Edge] = ()


def rubbing(build: Build, impulse: Expression) -> Rubbing:
    """What friction takes from sliding, or from its drive, by the ``impulse`` of the pressure [Pa s]."""
    laws = [law for law in build.interface.frictions if law_reads(law, "p")]
    if laws and not build.motion.slips:
        return _driven(build, laws, impulse)
    sliding = [kind for kind in build.motion.slips if kind.inertial and not kind.elastic]
    if not (laws and sliding):
        return Rubbing()
    velocity = "speed" if len(sliding) == 2 else "v"
    ratio = build.energy.rubs * symengine.Add(*(_ratio(build, law, velocity) for law in laws))
    return _slowed(build, sliding[0], symengine.Symbol(velocity), ratio, impulse)


def _slowed(build: Build, kind: Kind, v: Expression, ratio: Expression, impulse: Expression) -> Rubbing:
    """Sliding that has a mass loses velocity."""
    assert kind.mount is not None
    exerted = _exerted(build)
    loss = ratio * exerted / far_field(build, kind.mount).m
    left = where(loss < absolute(v), v - loss * sign(v), NONE)
    slip = build.find_mode("slip")
    stops = {} if slip is None else {slip: where(loss < absolute(v), slip, NONE)}
    return Rubbing({exerted: where(absolute(v) > 0, impulse, NONE)}, [_rub(exerted, stops, {v: left})])


def _driven(build: Build, laws: Sequence[Friction], impulse: Expression) -> Rubbing:
    """A prescribed velocity costs its drive work."""
    exerted, powers, works = _exerted(build), NONE, {}
    for law in laws:
        account = build.motion.works[law]
        done = build.register(f"{account}_of_impacts", f"work of impacts against {law.title} [J/m^2]")
        power = build.energy.rubs * _at_infinity(build, law, _power(build, law))
        build.motion.given[account] = done
        works[done] = done + power * exerted
        powers += power
    return Rubbing({exerted: where(powers > 0, impulse, NONE)}, [_rub(exerted, works, {})])


def _exerted(build: Build) -> Any:
    return build.register("impulse", "impulse of the pressure that friction has not answered yet [Pa s]")


def _rub(exerted: Expression, modes: Mapping[Expression, Expression], jump: Mapping[Expression, Expression]) -> Edge:
    margin = where(exerted > 0, -1, 1)
    return Edge("rub", margin, "friction answers the impact", {exerted: NONE, **modes}, jump, heat="local")


def _ratio(build: Build, law: Friction, velocity: str) -> Expression:
    """Impulse of friction over that of the pressure, where sliding slows down under it."""
    if law.transverse is not None:
        raise InputError(
            f"{law.name()}: what an impact takes from sliding is not known where friction differs from direction to "
            f"direction, since it turns within the impact. {SOFTEN}",
            law.place,
        )
    bound, v = build.bound(law), symengine.Symbol(velocity)
    traction = build.variables.call(bound, bound.statement, {"p": P, "v": v, "direction": ONE})
    ratio = _at_infinity(build, law, traction)
    if depends(ratio, v) or depends(build.expanded(ratio), v):
        raise InputError(
            f"{law.name()}: what an impact takes from sliding is not known where the coefficient of friction varies "
            f"with the sliding velocity, which changes within the impact. {SOFTEN}",
            law.place,
        )
    return ratio


def _power(build: Build, law: Friction) -> Expression:
    """Power of friction at the pressure of an impact [W/m^2]."""
    tractions = resistance(build, law, build.bound(law), {"p": P})
    return sum((t * build.variables.get(d.velocity, law) for d, t in tractions.items()), NONE)


def _at_infinity(build: Build, law: Friction, resisted: Expression) -> Expression:
    """How much of it there is per pressure, where that does not depend on how large the pressure is."""
    expression = symengine.sympify(resisted).subs({symengine.Symbol("p"): P, symengine.Symbol("t_n"): -P})
    slopes = [derivative(expression, P).subs({P: symengine.RealDouble(p)}) for p in (FINITE, INFINITE)]
    finite, infinite = (build.at_start(slope) for slope in slopes)
    if finite != infinite:
        raise InputError(
            f"{law.name()}: the impulse of friction in an impact is not known where the coefficient of friction varies "
            f"with the pressure, which is not finite then. {SOFTEN}",
            law.place,
        )
    return slopes[-1]
