"""Sliding without inertia against friction that remembers: its traction is the variable, the velocity follows from it.

At rest such friction creeps, by hundreds of decades slower than it slides, and a reversal passes through all of them
twice. What balances there is smooth: the traction, here in units of the direct effect.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import symengine

from surfacechem.assembly.build import Build
from surfacechem.expressions import Expression
from surfacechem.quantities import VARIABLES
from surfacechem.system import Given, State
from surfacechem.terms import Friction, Varying, reads

DRIVE = "drive"


def creeping_law(build: Build) -> Friction | None:
    """The law whose traction determines a velocity without inertia, if there is one."""
    laws = [law for law in build.interface.frictions if hasattr(law, "velocity")]
    return next((law for law in laws if not _follows_velocity(law)), None)


def _follows_velocity(law: Friction) -> bool:
    values = [getattr(law, name) for name, _ in law.specs()]
    factors = [factor for value in values if isinstance(value, Varying) for factor in value.factors]
    return any("v" in (factor.of, *reads(factor.factor)) for factor in factors)


def driven_sliding(build: Build, law: Friction) -> Expression:
    """The state that stands for the velocity; what reads the velocity itself gets it from there."""
    symbol, dot = symengine.symbols(f"{DRIVE} d{DRIVE}_dt")
    build.motion.creeping = law
    build.variables.define(DRIVE, lambda: symbol, "algebraic", "balance of the tangential tractions")
    build.variables.define("v", partial(_velocity, build, law), "derived", f"{law.path}, from its traction")
    given = Given(VARIABLES["v"], build.scene.initial.get("v", 0.0), partial(_at_start, build, law))
    build.states.append(State(VARIABLES[DRIVE], symbol, dot, 0.0, 1.0, algebraic=True, given=given))
    return symbol


def _velocity(build: Build, law: Friction) -> Expression:
    bound = build.bound(law)
    return build.name(VARIABLES["v"], build.variables.call(bound, bound.velocity, _own(law)))


def _own(law: Friction) -> dict[str, Expression]:
    """The law's own variables, which are read before its memory has made them states."""
    return {name: symengine.Symbol(name) for name in law.internal}


def _at_start(build: Build, law: Friction, values: Mapping[str, float]) -> float:
    """The drive at the velocity given, where the search for that which balances begins."""
    bound = build.bound(law)
    drive = build.variables.call(bound, bound.drive, {**_own(law), "v": values["initial.v"]})
    numbers = {parameter.symbol: values[parameter.path] for parameter in build.parameters.items}
    numbers |= {state.symbol: state.from_given(values) for state in build.states if state.name != DRIVE}
    try:
        return float(build.expanded(drive).subs({**numbers, build.t: 0.0}))
    except RuntimeError:  # no real number, as of a negative pressure: it is only where the search begins
        return 0.0
