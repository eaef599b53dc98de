"""Formulation of the tangential motion of a scene in each direction, and the tractions of friction.

Each direction that moves by a balance is inertial, overdamped or quasi-static, and sticks exactly or elastically. In
the plane an isotropic law acts along the unit vector of the slip velocity, with its traction at the slip speed. The
limit of sticking is a half axis for each direction: of an interval, or of an ellipse.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import symengine

from surfacechem.contracts.terms import Friction, Potential, TangentialPotential, reads
from surfacechem.errors import InputError, Place
from surfacechem.expressions import Expression, absolute, depends, derivative, log, sqrt, where
from surfacechem.model.automaton import ONE, ZERO
from surfacechem.model.build import Build
from surfacechem.model.components.mounting import (
    ACROSS,
    ALONG,
    LENGTH_SCALE,
    Direction,
    Support,
    driven,
    law_reads,
    support,
    transverse_support,
)
from surfacechem.model.constraints.set_valued import SLIP
from surfacechem.model.system import Caution, Given, State
from surfacechem.quantities import VARIABLES, Quantity
from surfacechem.tolerances import LEAST_CREEP

REST = {"v": ZERO, "v_2": ZERO, "direction": ONE, "direction_2": ONE}

UNSTABLE = (
    "no steady sliding velocity: nothing resists it, or friction falls faster with velocity than anything else "
    "resists; more viscous resistance would give one, so would a mass"
)

PLACE = Place(path="mechanics.tangential")


class Formulation(NamedTuple):
    """Formulation of the tangential motion of a scene in one direction."""

    d: Direction
    mount: Support | None
    """None if the displacement is prescribed."""
    elastic: bool
    """True if sticking is elastic: the free energy depends on the elastic gap."""
    sticks: bool
    """True if some friction law has a limit below which there is no slip."""
    rate_dependent: bool
    """True if the resistance to slip depends on its velocity."""
    dead_load: bool
    """True if only a prescribed traction moves it: sticking holds its place, and nothing balances the load in slip."""
    slides: bool
    """True if a law or a rigid interface determines the slip; otherwise the elastic gap is the whole displacement."""

    @property
    def inertial(self) -> bool:
        return self.mount is not None and self.mount.inertial

    @property
    def slides_inertially(self) -> bool:
        """True if the slip velocity has inertia."""
        return self.inertial and not self.elastic

    @property
    def unstable(self) -> str:
        """Reason why no steady slip velocity exists, with the remedy that fits."""
        return f"{UNSTABLE} if sticking were exact, without an elastic gap g_t" if self.elastic else UNSTABLE

    @property
    def in_equilibrium(self) -> bool:
        """True if one of its gaps responds at once to a change of tractions."""
        quasi_static = self.mount is not None and self.mount.quasi_static
        if self.elastic:
            return quasi_static or not self.rate_dependent
        return quasi_static and not self.rate_dependent and not self.dead_load

    @property
    def own_velocity(self) -> str:
        """Name of the displacement's velocity, which is the slip velocity unless the interface is elastic."""
        return "v_t" if self.elastic else self.d.velocity


def formulations(build: Build) -> tuple[Formulation, ...]:
    """Return the formulations for each direction in which the scene moves by a balance."""
    mount = support(build, "t")
    elastic = bool(in_series(build)) and not driven(build, "g_t")
    across = transverse_support(build, mount) if mount is not None else None
    if mount is not None and across is not None:
        if elastic:
            problem = "the interface moves in two directions, but the elastic gap g_t of its potential has one"
            moving = "what moves it across (`transverse`, w_t2, F_t2, v_2 or a law with two directions)"
            raise InputError(f"{problem}. Leave out {moving}, or the potential of g_t.", PLACE)
        if given := {"v", "v_2"} & build.scene.loading.keys():
            problem = f"{min(given)} is prescribed, but a mounting moves the interface along it"
            remedy = "Prescribe `v` and `v_2` under `loading`, or let the mounting give both."
            raise InputError(f"{problem}. {remedy}", PLACE)
        return _formulation(build, ALONG, mount, elastic), _formulation(build, ACROSS, across, elastic)
    if build.scene.transverse is not None:
        message = "a mounting across stands beside one along: give `tangential`, too."
        raise InputError(message, build.scene.transverse.place)
    if mount is None and not (elastic and "u_t" in build.scene.loading):
        return ()
    return (_formulation(build, ALONG, mount, elastic),)


def _formulation(build: Build, d: Direction, mount: Support | None, elastic: bool) -> Formulation:
    laws = build.interface.frictions
    rate_dependent = any(_feels_velocity(law, d) for law in laws)
    rate_dependent = rate_dependent or (not elastic and mount is not None and mount.damped)
    sticks = any(law.has_limit for law in laws)
    # Only the load and friction act on the displacement, and only friction may hold it.
    free = mount is not None and mount.quasi_static and not (mount.law.k or in_parallel(build))
    dead_load = free and not rate_dependent and (sticks or not elastic)
    return Formulation(d, mount, elastic, sticks, rate_dependent, dead_load, bool(laws) or not elastic)


def growth(slope: Expression, damping: Expression) -> Expression:
    """Return a stability measure of the slope of the resistance, relative to the damping if there is any.

    If positive it is the logarithm of one plus the ratio, as the slope of friction may be infinite at rest.
    """
    ratio = slope / damping if damping != 0 else slope
    return where(slope > 0, log(1 + where(slope > 0, ratio, 0)), ratio)


def _feels_velocity(law: Friction, d: Direction) -> bool:
    """True if the resistance of a law along a direction depends on the velocity."""
    formula = law.transverse if d is ACROSS and law.transverse is not None else law.statement
    return bool({"v", "v_2"} & {*reads(formula)})


def _sheared(build: Build) -> list[Potential]:
    return [law for law in build.interface.potentials if law_reads(law, "g_t") and arrangement(law) != "none"]


def arrangement(law: Potential) -> str:
    """Return the arrangement of a potential with friction, in series or in parallel."""
    return law.shear if isinstance(law, TangentialPotential) else "series"


def in_parallel(build: Build) -> tuple[Potential, ...]:
    """Return the potentials whose tangential gap is the whole displacement, in parallel with friction.

    A motion in two directions has no elastic gap, so that the gap is the displacement there even without friction. A
    gap and a velocity that are prescribed separately define no common displacement.
    """
    mount, frictions = support(build, "t"), bool(build.interface.frictions)
    if mount is not None:
        beside = not driven(build, "g_t") and (frictions or transverse_support(build, mount) is not None)
    else:
        beside = frictions and not driven(build, "v") and (driven(build, "g_t") or driven(build, "u_t"))
    return tuple(law for law in _sheared(build) if beside and arrangement(law) == "parallel")


def in_series(build: Build) -> tuple[Potential, ...]:
    """Return the potentials of an elastic gap, in series with friction."""
    parallel = in_parallel(build)
    return tuple(law for law in _sheared(build) if law not in parallel)


def displacement(build: Build) -> Expression:
    """Return the tangential gap in parallel with friction: the displacement, in two directions its length.

    Laws read its square, so that it needs no guard at zero.
    """
    if len(build.motion.slips) == 2:
        return sqrt(sum(symengine.Symbol(slip.d.displacement) ** 2 for slip in build.motion.slips))
    name = "g_t" if driven(build, "g_t") else "u_t"
    return build.variables.get(name, "the adhesion beside friction")


def evolve(
    build: Build,
    name: str,
    by: str = "",
    *,
    start: float | None = None,
    given: Given | None = None,
    algebraic: bool = False,
    scale: float = LENGTH_SCALE,
) -> Expression:
    """Add a state of the motion; if ``by`` names what determines it, also a variable of its name."""
    initial = build.scene.initial.get(name, 0.0) if start is None else start
    creeping = [law for law in build.interface.frictions if name == "v" and law.reference_velocity]
    speeds = [getattr(law.at_reference(), law.reference_velocity) for law in creeping]
    finest = LEAST_CREEP * min(speeds) if speeds else None
    state = State(VARIABLES[name], initial, scale, algebraic, finest=finest, given=given)
    build.add(state)
    if by:
        build.variables.define(name, state.symbol, "algebraic" if algebraic else "evolved", by)
    return state.symbol


def name_traction(build: Build, d: Direction, slides: Expression, carried: Expression, needed: Expression) -> None:
    """Name the total traction: the one carried in slip, else the one that holds the interface."""
    traction = slides * carried + (1 - slides) * needed
    build.areal(Quantity(d.total, "Pa", f"{d.text} on body 1", d.total), traction)


def directions(build: Build) -> tuple[Direction, ...]:
    """Return the directions in which the interface moves, or in which its velocity is prescribed."""
    if build.motion.slips:
        return tuple(slip.d for slip in build.motion.slips)
    both = build.variables.has("v_2") or any(law.transverse is not None for law in build.interface.frictions)
    return (ALONG, ACROSS) if both else (ALONG,)


def resistance(
    build: Build, law: Friction, bound: Friction, own: Mapping[str, Expression]
) -> dict[Direction, Expression]:
    """Return the tractions of a law [Pa] by direction of slip."""
    both = directions(build)
    if len(both) == 1:
        formula = bound.driven if law is build.motion.creep_law else bound.statement
        traction = build.variables.call(bound, formula, own)
        if any(slip.sticks for slip in build.motion.slips):
            # |v| has no sign: roundoff that moves the interface the wrong way as slip begins would be driven on.
            v = symengine.Symbol(ALONG.velocity)
            traction = symengine.sympify(traction).subs({absolute(v): SLIP * v})
        return {ALONG: traction}
    _refuse_one_component(law)
    if law.transverse is not None:
        formulas = {ALONG: bound.traction, ACROSS: bound.transverse}
        return {d: build.variables.call(bound, formula, own) for d, formula in formulas.items()}
    if build.variables.has("speed"):
        swift = {"v": build.variables.get("speed", law), "direction": ONE}
        size = build.variables.call(bound, bound.statement, {**own, **swift})
        return {d: size * build.variables.get(d.cosine, law) for d in both}
    # A resistance linear in the velocity needs no direction at rest.
    speed = symengine.Symbol("speed")
    size = build.variables.call(bound, bound.statement, {**own, "v": speed})
    slope = derivative(size, speed)
    if depends(slope, speed) or symengine.sympify(size).subs({speed: 0}) != 0:
        problem = "has no direction at rest: it does not grow in proportion to the velocity, nor does anything stick"
        remedy = "Prescribe `v` and `v_2`, mount the bodies in one direction, or add `coulomb`."
        raise InputError(f"in two directions {law.name()} {problem}. {remedy}", law.place)
    return {d: slope * build.variables.get(d.velocity, law) for d in both}


def _refuse_one_component(law: Friction) -> None:
    """Raise InputError if a law reads one component of the velocity, since it would depend on the axes."""
    if law.internal:
        raise InputError(f"{law.name()} remembers sliding along one direction, and this scene has two.", law.place)
    for name, value in law.varying.items():
        if any(factor.of in REST for factor in value.factors):
            raise InputError(f"{name} varies with one component of the velocity, and this scene has two.", law.place)


def _warn_of_static_friction(build: Build, law: Friction, bound: Friction) -> None:
    """Add cautions for a limit of sticking below kinetic friction, which is unphysical: it is raised to that."""
    given = {"p": ONE, **REST}  # 1 Pa stands for any pressure: coefficients are compared
    static = build.variables.call(bound, bound.limit, given)
    kinetic = build.variables.call(bound, bound.fast or bound.statement, given)
    told = "it rises as sliding grows faster" if bound.fast else "sticking bears the latter"
    if law.rest_exponent:
        rise = where(getattr(bound, law.rest_exponent) < 1, static - kinetic, ONE)
        steep = f"the friction of {law.title} rises from rest with an infinite slope, which no step resolves"
        build.add(Caution(rise, f"{steep}: give a {law.rest_exponent} of 1 or more"))
    if static != kinetic:
        text = f"the static friction of {law.title} is below its sliding friction: {told}"
        build.add(Caution(static - kinetic, text))


def stick_limit(build: Build, law: Friction, bound: Friction, own: Mapping[str, Expression]) -> None:
    """Add the traction up to which a friction law sticks: its limit, or the kinetic friction at v = 0 if larger."""
    sticking = [slip.d for slip in build.motion.slips if slip.sticks]
    if sticking and bound.has_limit:
        _warn_of_static_friction(build, law, bound)
    for d in sticking:
        limits, at_rest, two = build.motion.stick_limits, {**own, **REST}, d is ACROSS and bound.transverse is not None
        borne = build.variables.call(bound, bound.transverse if two else bound.statement, at_rest)
        if bound.has_limit:
            static = build.variables.call(bound, bound.transverse_limit if two else bound.limit, at_rest)
            borne = static if static == borne else where(static > borne, static, borne)
        limits[d.axis] = limits.get(d.axis, 0) + build.stretch * borne
