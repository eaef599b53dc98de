r"""What friction does in an impact: an impulse in proportion to that of the pressure, and no more than stops sliding.

A velocity of sliding that is prescribed stays as it is; its drive does the work :math:`\mu\,J\,|v|` instead, with the
impulse J of the pressure. What slides without a mass, or behind a tangential spring of the interface, sticks for that
instant, and nothing is lost.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import symengine

from surfacechem.contracts.terms import Friction
from surfacechem.errors import InputError
from surfacechem.expressions import Expression, absolute, depends, derivative, sign, where
from surfacechem.model.automaton import Transition
from surfacechem.model.build import Build
from surfacechem.model.components.mounting import far_field, law_reads
from surfacechem.model.sliding.formulations import Kind
from surfacechem.model.sliding.resistance import resistance

NONE, ONE = symengine.Integer(0), symengine.Integer(1)
P = symengine.Symbol("p of an impact")

FINITE, INFINITE = 1e50, 1e100
"""Pressures [Pa] between which friction has to grow in proportion."""

SOFTEN = "Let a potential bear the bodies, such as `penalty`."


@dataclass(frozen=True)
class Rubbing:
    """What an impact sets off along the interface."""

    begins: Mapping[Expression, Expression] = field(default_factory=dict)
    """Modes that an impact sets."""
    transitions: Sequence[Transition] = ()


def rubbing(build: Build, impulse: Expression) -> Rubbing:
    """What friction takes from sliding, or from its drive, by the ``impulse`` of the pressure [Pa s]."""
    laws = [law for law in build.interface.frictions if law_reads(law, "p")]
    if laws and not build.motion.slips:
        return _driven(build, laws, impulse)
    sliding = [kind for kind in build.motion.slips if kind.inertial and not kind.elastic]
    if not (laws and sliding):
        return Rubbing()
    velocity = "speed" if len(sliding) == 2 else "v"
    ratio = build.motion.rubs * symengine.Add(*(_ratio(build, law, velocity) for law in laws))
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
        done = build.mode(f"{account}_of_impacts", 0.0, {0.0: f"work of impacts against {law.title} [J/m^2]"})
        power = build.motion.rubs * _at_infinity(build, law, _power(build, law))
        build.motion.given[account] = done
        works[done] = done + power * exerted
        powers += power
    return Rubbing({exerted: where(powers > 0, impulse, NONE)}, [_rub(exerted, works, {})])


def _exerted(build: Build) -> Any:
    return build.mode("impulse", 0.0, {0.0: "impulse of the pressure that friction has not answered yet [Pa s]"})


def _rub(
    exerted: Expression, modes: Mapping[Expression, Expression], jump: Mapping[Expression, Expression]
) -> Transition:
    margin = where(exerted > 0, -1, 1)
    return Transition("rub", margin, "friction answers the impact", {exerted: NONE, **modes}, jump, sinks="local")


def _ratio(build: Build, law: Friction, velocity: str) -> Expression:
    """Impulse of friction over that of the pressure, where sliding slows down under it."""
    if hasattr(law, "transverse"):
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
