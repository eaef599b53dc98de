"""What friction resists sliding with, along one direction or in the plane, and what it bears at rest.

In the plane a law that is the same in all directions resists along the unit vector of sliding, by its traction at the
speed of sliding. What sticking bears is half an axis for each direction: of a line, or of an ellipse.
"""

from __future__ import annotations

from collections.abc import Mapping

import symengine

from surfacechem.contracts.terms import Friction, Varying, reads
from surfacechem.errors import InputError
from surfacechem.expressions import Expression, depends, derivative, where
from surfacechem.model.build import Build
from surfacechem.model.components.mounting import ACROSS, ALONG, Direction
from surfacechem.model.system import Caution

NONE, ONE = symengine.Integer(0), symengine.Integer(1)
REST = {"v": NONE, "v_2": NONE, "direction": ONE, "direction_2": ONE}


def directions(build: Build) -> tuple[Direction, ...]:
    """The directions in which the interface moves, or in which its velocity is prescribed."""
    if build.motion.slips:
        return tuple(slip.d for slip in build.motion.slips)
    both = build.variables.has("v_2") or any(law.transverse is not None for law in build.interface.frictions)
    return (ALONG, ACROSS) if both else (ALONG,)


def resistance(
    build: Build, law: Friction, bound: Friction, own: Mapping[str, Expression]
) -> dict[Direction, Expression]:
    """Tractions of a law [Pa] along the directions of sliding."""
    if len(directions(build)) == 1:
        formula = bound.driven if law is build.motion.creeping else bound.statement
        return {ALONG: build.variables.call(bound, formula, own)}
    _refuse_one_component(law)
    if law.transverse is not None:
        formulas = {ALONG: bound.traction, ACROSS: bound.transverse}
        return {d: build.variables.call(bound, formula, own) for d, formula in formulas.items()}
    if build.variables.has("speed"):
        swift = {"v": build.variables.get("speed", law), "direction": ONE}
        size = build.variables.call(bound, bound.statement, {**own, **swift})
        return {d: size * build.variables.get(d.cosine, law) for d in (ALONG, ACROSS)}
    return _in_proportion(build, law, bound, own)


def _refuse_one_component(law: Friction) -> None:
    """A law of one component of the velocity would know the axes."""
    if law.internal:
        raise InputError(f"{law.name()} remembers sliding along one direction, and this scene has two.", law.place)
    for name, _ in law.specs():
        value = getattr(law, name)
        if isinstance(value, Varying) and any(factor.of in REST for factor in value.factors):
            raise InputError(f"{name} varies with one component of the velocity, and this scene has two.", law.place)


def _in_proportion(
    build: Build, law: Friction, bound: Friction, own: Mapping[str, Expression]
) -> dict[Direction, Expression]:
    """Tractions of a law that is linear in the velocity, which needs no direction at rest."""
    speed = symengine.Symbol("speed")
    size = build.variables.call(bound, bound.statement, {**own, "v": speed})
    slope = derivative(size, speed)
    if depends(slope, speed) or symengine.sympify(size).subs({speed: 0}) != 0:
        raise InputError(
            f"in two directions {law.name()} has no direction at rest: it does not grow in proportion to the velocity, "
            "nor does anything stick. Prescribe `v` and `v_2`, mount the bodies in one direction, or add `coulomb`.",
            law.place,
        )
    return {d: slope * build.variables.get(d.velocity, law) for d in (ALONG, ACROSS)}


def resist(build: Build, d: Direction, traction: Expression) -> None:
    """Add to what resists sliding along a direction, where the interface moves by a balance."""
    if build.motion.slips:
        tractions = build.motion.sliding_tractions
        tractions[d.axis] = tractions[d.axis] + traction if d.axis in tractions else traction


def stick_limit(build: Build, law: Friction, bound: Friction, own: Mapping[str, Expression]) -> None:
    """Add what a friction law can carry at rest: its limit, at least what it resists sliding with from rest on."""
    if any(slip.sticks for slip in build.motion.slips):
        _caution(build, law, bound)
    for slip in build.motion.slips:
        if slip.sticks:
            limits, axis = build.motion.stick_limits, slip.d.axis
            borne = build.stretch * _borne(build, bound, slip.d, {**own, **REST})
            limits[axis] = limits[axis] + borne if axis in limits else borne


def _borne(build: Build, bound: Friction, d: Direction, at_rest: Mapping[str, Expression]) -> Expression:
    two = d is ACROSS and bound.transverse is not None
    kinetic = build.variables.call(bound, bound.transverse if two else bound.statement, at_rest)
    if not bound.has_limit:
        return kinetic
    static = build.variables.call(bound, bound.transverse_limit if two else bound.limit, at_rest)
    return static if static == kinetic else where(static > kinetic, static, kinetic)


def _caution(build: Build, law: Friction, bound: Friction) -> None:
    """Tell where a law bears less at rest than it resists sliding with, which happens to no contact.

    The pressure of 1 Pa stands for any: coefficients are compared.
    """
    if not bound.has_limit:
        return
    given = {"p": ONE, **REST}
    kinetic = build.variables.call(bound, bound.statement, given)
    if {"mu_s", "mu_k"} <= vars(bound).keys():  # that of fast sliding, to which that at rest falls
        static, kinetic = vars(bound)["mu_s"], vars(bound)["mu_k"]
    else:
        static = build.variables.call(bound, bound.limit, given)
    if static != kinetic:
        text = (
            f"the static friction of {law.title} is below its sliding friction; what resists sliding from rest on is "
            "what sticking bears"
        )
        build.notes.append(Caution(static - kinetic, text))


def formula_along(law: Friction, d: Direction) -> tuple[str, ...]:
    """What a law reads along a direction."""
    return reads(law.transverse if d is ACROSS and law.transverse is not None else law.statement)
