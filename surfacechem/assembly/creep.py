"""Sliding against friction that remembers: its traction is the variable, the velocity follows from it.

At rest such friction creeps, by hundreds of decades slower than it slides, and a reversal passes through all of them
twice. What balances there is smooth: the traction, here in units of the direct effect. With inertia the variable is the
same: where the velocity is next to nothing so is its rate, and the tractions balance; where it is not, the variable is
its logarithm.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

import symengine

from surfacechem.assembly.build import Build
from surfacechem.expressions import Expression
from surfacechem.quantities import VARIABLES
from surfacechem.system import Given, State
from surfacechem.terms import Friction, Varying, reads

DRIVE = "drive"

EFFECT = 1e6
"""Scale of the drive with inertia: tractions are resolved to a part of the direct effect, not of themselves."""

STILL = 1e-20
"""Velocity [m/s] below which a mass only delays creep, which then is as swift whatever its velocity."""


def creeping_law(build: Build) -> Friction | None:
    """The law whose traction determines a velocity without inertia, if there is one."""
    return next((law for law in _laws(build) if not _follows_velocity(law)), None)


def creeping_mass(build: Build) -> Friction | None:
    """The law whose traction stands for a velocity with inertia, if there is one."""
    return next(iter(_laws(build)), None)


def _laws(build: Build) -> list[Friction]:
    return [law for law in build.interface.frictions if hasattr(law, "velocity")]


def _follows_velocity(law: Friction) -> bool:
    factors = [factor for value in _varying(law).values() for factor in value.factors]
    return any("v" in (factor.of, *reads(factor.factor)) for factor in factors)


def _varying(law: Friction) -> dict[str, Varying]:
    values = {name: getattr(law, name) for name, _ in law.specs()}
    return {name: value for name, value in values.items() if isinstance(value, Varying)}


def is_driven(build: Build) -> bool:
    """Whether something stands for the velocity of sliding."""
    return any(state.name == DRIVE for state in build.states)


def driven_sliding(build: Build, law: Friction) -> Expression:
    """The state that stands for a velocity without inertia; what reads the velocity itself gets it from there."""
    build.motion.creeping = law
    return _stand_for_velocity(build, law, partial(build.bound, law), algebraic=True)


def driven_mass(build: Build, law: Friction) -> Expression:
    """The state that stands for a velocity with inertia."""
    if not _varying(law):
        build.motion.creeping = law
    return _stand_for_velocity(build, law, partial(_at_reference, build, law), algebraic=False)


def _at_reference(build: Build, law: Friction) -> Friction:
    """The law without what its parameters vary with, whose rates would be needed for that of the velocity."""
    bound = build.bound(law)
    symbols = {parameter.path: parameter.symbol for parameter in build.parameters.items}
    return bound.bind({name: symbols[f"{bound.path}.{name}"] for name in _varying(law)})


def _stand_for_velocity(build: Build, law: Friction, bound: Callable[[], Friction], *, algebraic: bool) -> Expression:
    symbol, dot = symengine.symbols(f"{DRIVE} d{DRIVE}_dt")
    role, by = ("algebraic", "balance of the tangential tractions") if algebraic else ("evolved", law.path)
    build.variables.define(DRIVE, lambda: symbol, role, by)
    build.variables.define("v", partial(_velocity, build, law, bound), "derived", f"{law.path}, from its traction")
    given = Given(VARIABLES["v"], build.scene.initial.get("v", 0.0), partial(_at_start, build, law, bound))
    build.states.append(State(VARIABLES[DRIVE], symbol, dot, 0.0, 1.0 if algebraic else EFFECT, algebraic, given=given))
    return symbol


def _velocity(build: Build, law: Friction, bound: Callable[[], Friction]) -> Expression:
    return build.name(VARIABLES["v"], build.variables.call(law, bound().velocity, _own(law)))


def _own(law: Friction) -> dict[str, Expression]:
    """The law's own variables, which are read before its memory has made them states."""
    return {name: symengine.Symbol(name) for name in law.internal}


def _at_start(build: Build, law: Friction, bound: Callable[[], Friction], values: Mapping[str, float]) -> float:
    """The drive at the velocity given: the start with inertia, else where the search for the balance begins."""
    drive = build.variables.call(law, bound().drive, {**_own(law), "v": values["initial.v"]})
    numbers = {parameter.symbol: values[parameter.path] for parameter in build.parameters.items}
    numbers |= {state.symbol: state.from_given(values) for state in build.states if state.name != DRIVE}
    try:
        return float(build.expanded(drive).subs({**numbers, build.t: 0.0}))
    except RuntimeError:  # no real number, as of a negative pressure: it is only where the search begins
        return 0.0


def inertia(build: Build, m: Expression) -> Expression:
    """Mass times the rate of the velocity [Pa], which counts what is next to none as a little."""
    v, drive = symengine.symbols(f"v {DRIVE}")
    return m * build.total_derivative(v + STILL * drive)
