"""Sliding against friction that remembers: its traction is the variable, the velocity follows from it.

At rest such friction creeps, by hundreds of decades slower than it slides, and a reversal passes through all of them
twice. What balances there is smooth: the traction, here in units of the direct effect. With inertia the same holds as
long as creep bears what drives it; what slides faster, flies or swings through has its velocity for a variable.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import symengine

from surfacechem.contracts.terms import Friction, Varying, reads
from surfacechem.expressions import Expression, absolute, where
from surfacechem.model.automaton import Edge
from surfacechem.model.build import Build
from surfacechem.model.components.friction import pressed
from surfacechem.model.system import Given, State
from surfacechem.quantities import VARIABLES

DRIVE = "drive"

PACE = "pace"
"""What stands for a velocity with inertia: the drive while it creeps, else the velocity in grains."""

EFFECT = 1e6
"""Scale of both: tractions are resolved to a part of the direct effect, not of themselves."""

GRAIN = 1e-9
"""What a velocity of sliding is counted in, in the unit of the law: a turn is a step of the friction, and is met."""

STILL = 1e-20
"""Velocity [m/s] below which a mass only delays creep, which then is as swift whatever its velocity."""

SLOW, FAST = 0.01, 0.1
"""Velocities below which sliding becomes creep and above which creep becomes sliding, in the unit of the law."""

WORDS = {0.0: "slides", 1.0: "creeps"}
CREEPS = symengine.Symbol("creeps")


def creeping_law(build: Build) -> Friction | None:
    """The law whose traction determines a velocity without inertia, if there is one."""
    return next((law for law in _laws(build) if not _follows_velocity(law)), None)


def creeping_mass(build: Build) -> Friction | None:
    """The law whose traction stands for a velocity with inertia, if there is one."""
    return next(iter(_laws(build)), None)


def _laws(build: Build) -> list[Friction]:
    return [law for law in build.interface.frictions if law.velocity is not None]


def _follows_velocity(law: Friction) -> bool:
    factors = [factor for value in _varying(law).values() for factor in value.factors]
    return any("v" in (factor.of, *reads(factor.factor)) for factor in factors)


def _varying(law: Friction) -> dict[str, Varying]:
    values = {name: getattr(law, name) for name, _ in law.specs()}
    return {name: value for name, value in values.items() if isinstance(value, Varying)}


def stands_for_velocity(build: Build) -> str:
    """The state that stands for the velocity of sliding, if there is one."""
    return next((state.name for state in build.states if state.name in (DRIVE, PACE)), "")


def driven_sliding(build: Build, law: Friction) -> Expression:
    """The state that stands for a velocity without inertia; what reads the velocity itself gets it from there."""
    build.motion.creeping = law
    symbol, dot = symengine.symbols(f"{DRIVE} d{DRIVE}_dt")
    build.variables.define(DRIVE, lambda: symbol, "algebraic", "balance of the tangential tractions")
    build.variables.define("v", partial(_velocity, build, law), "derived", f"{law.path}, from its traction")
    given = Given(VARIABLES["v"], build.scene.initial.get("v", 0.0), partial(_drive_at_start, build, law))
    build.states.append(State(VARIABLES[DRIVE], symbol, dot, 0.0, 1.0, algebraic=True, given=given))
    return symbol


def driven_mass(build: Build, law: Friction) -> None:
    """The state that stands for a velocity with inertia, and the mode that says for what in it."""
    symbol, dot = symengine.symbols(f"{PACE} d{PACE}_dt")
    build.mode("creeps", 0.0, WORDS, given=partial(_creeps_at_start, build, law))
    if not _varying(law):
        build.motion.creeping = law
        build.variables.define(DRIVE, partial(_drive, build, law), "derived", law.path)
    build.variables.define("v", partial(_velocity_of_mass, build, law), "evolved", "mechanics.tangential")
    given = Given(VARIABLES["v"], build.scene.initial.get("v", 0.0), partial(_pace_at_start, build, law))
    build.states.append(State(VARIABLES[PACE], symbol, dot, 0.0, EFFECT, algebraic=False, given=given))


def _at_reference(build: Build, law: Friction) -> Friction:
    """The law without what its parameters vary with, whose rates would be needed for that of the velocity."""
    bound = build.bound(law)
    symbols = {parameter.path: parameter.symbol for parameter in build.parameters.items}
    return bound.bind({name: symbols[f"{bound.path}.{name}"] for name in _varying(law)})


def _drive(build: Build, law: Friction) -> Expression:
    """Traction in units of the direct effect."""
    pace, reference = symengine.Symbol(PACE), _at_reference(build, law)
    sliding = build.variables.call(law, reference.drive, {**_own(law), "v": GRAIN * reference.velocity_unit() * pace})
    return where(CREEPS > 0, pace, sliding)


def _velocity_of_mass(build: Build, law: Friction) -> Expression:
    pace, reference = symengine.Symbol(PACE), _at_reference(build, law)
    creeping = build.variables.call(law, reference.velocity, {**_own(law), "drive": pace})
    return build.name(VARIABLES["v"], where(CREEPS > 0, creeping, GRAIN * reference.velocity_unit() * pace))


def _velocity(build: Build, law: Friction) -> Expression:
    bound = build.bound(law)
    return build.name(VARIABLES["v"], build.variables.call(law, bound.velocity, _own(law)))


def _own(law: Friction) -> dict[str, Expression]:
    """The law's own variables, which are read before its memory has made them states."""
    return {name: symengine.Symbol(name) for name in law.internal}


def _drive_at_start(build: Build, law: Friction, values: Mapping[str, float]) -> float:
    """The drive at the velocity given, where the search for the balance begins."""
    return _at_start(build, law, build.bound(law), values)


def _pace_at_start(build: Build, law: Friction, values: Mapping[str, float]) -> float:
    """What stands for the velocity given."""
    if _creeps_at_start(build, law, values):
        return _at_start(build, law, _at_reference(build, law), values)
    return values["initial.v"] / GRAIN / _unit_at_start(build, law, values)


def _creeps_at_start(build: Build, law: Friction, values: Mapping[str, float]) -> float:
    return float(abs(values["initial.v"]) < SLOW * _unit_at_start(build, law, values))


def _unit_at_start(build: Build, law: Friction, values: Mapping[str, float]) -> float:
    numbers = {parameter.symbol: values[parameter.path] for parameter in build.parameters.items}
    return float(symengine.sympify(_at_reference(build, law).velocity_unit()).subs(numbers))


def _at_start(build: Build, law: Friction, bound: Friction, values: Mapping[str, float]) -> float:
    drive = build.variables.call(law, bound.drive, {**_own(law), "v": values["initial.v"]})
    numbers = {parameter.symbol: values[parameter.path] for parameter in build.parameters.items}
    others = [state for state in build.states if state.name not in (DRIVE, PACE)]
    numbers |= {state.symbol: state.from_given(values) for state in others}
    try:
        return float(build.expanded(drive).subs({**numbers, build.t: 0.0}))
    except RuntimeError:  # no real number, as of a negative pressure: it is only where the search begins
        return 0.0


def inertia(build: Build, m: Expression) -> Expression:
    """Mass times the rate of the velocity [Pa], which counts what is next to none as a little."""
    return m * build.total_derivative(symengine.Symbol("v") + CREEPS * STILL * symengine.Symbol(PACE))


def between_creep_and_sliding(build: Build, law: Friction, driving: Expression) -> None:
    """Sliding that dies away where friction bears what drives it becomes creep, until it does not bear that any more.

    ``driving`` [Pa] is what is left of all tractions.
    """
    v, reference = symengine.Symbol("v"), _at_reference(build, law)
    slow, fast = SLOW * reference.velocity_unit(), FAST * reference.velocity_unit()
    pull = absolute(driving + _borne(build, law, v))
    left, room = _excess(absolute(v), slow), _excess(pull, _borne(build, law, slow))
    slip = build.find_mode("slip")
    sliding = {} if slip is None else {slip: (-1, 1)}
    drive = build.variables.call(law, reference.drive, {**_own(law), "v": v})
    pace = symengine.Symbol(PACE)
    falls = Edge(
        "creep",
        where(left > room, left, room),
        "sliding dies away and the interface creeps",
        {CREEPS: symengine.Integer(1)},
        {pace: drive},
        when={CREEPS: (0,), **sliding},
    )
    reason = "creep does not bear what drives it and the interface slides"
    rises = {pace: v / (GRAIN * reference.velocity_unit())}
    build.edges += [
        falls,
        Edge(
            "slide",
            _borne(build, law, fast) - pull,
            reason,
            {CREEPS: symengine.Integer(0)},
            rises,
            strict=True,
            when={CREEPS: (1,), **sliding},
        ),
    ]


def _borne(build: Build, law: Friction, v: Expression) -> Expression:
    """Traction of the friction at a velocity [Pa]."""
    bound = build.bound(law)
    return build.stretch * build.variables.call(law, bound.statement, {**pressed(build, law), "v": v})


def _excess(x: Expression, y: Expression) -> Expression:
    """By how much x is above y, relative to both; neither is negative."""
    return where(x + y > 0, (x - y) / (x + y), 1)
