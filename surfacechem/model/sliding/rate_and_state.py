r"""Rate-and-state friction: its traction is the unknown, and the slip velocity follows from it.

At rest such friction creeps, hundreds of decades slower than it slides, and a reversal passes through all of them
twice. The traction is smooth there, in units of the direct effect: the drive. It is therefore the state from which the
velocity follows at all speeds, algebraic without a mass. With a mass it obeys Newton's law by the chain rule,
:math:`m\,\dot v(\text{drive}, \theta)` being equal to the unbalanced traction.

Source: Dieterich (1979), doi 10.1029/JB084iB05p02161; Ruina (1983), doi 10.1029/JB088iB12p10359; with the direct effect
as an asinh by Rice, Lapusta & Ranjith (2001), doi 10.1016/S0022-5096(01)00042-4.
"""

from __future__ import annotations

from collections.abc import Mapping

import symengine

from surfacechem.contracts.terms import Friction, reads
from surfacechem.expressions import Expression
from surfacechem.model.build import Build
from surfacechem.model.sliding.formulation import evolve
from surfacechem.model.system import Given
from surfacechem.quantities import VARIABLES
from surfacechem.tolerances import PICOMETRE

DRIVE = "drive"

DRIVE_SCALE = 1e6
"""Scale of the drive of a mass: its error counts relative to the direct effect, not to its value."""

LEAST_INERTIAL = PICOMETRE / 1e8
"""Velocity [m/s] below which a mass only delays creep, a picometre in three years: there the drive responds equally
fast at any velocity, and the row stays regular."""


def evolve_drive(build: Build, *, inertial: bool) -> Expression | None:
    """Add the drive as the state for the slip velocity, if a law has a velocity as function of its traction; else None.

    A mass needs the rate of the velocity, in which varying parameters enter without their factors. Without a mass the
    balance may need the velocity as unknown, if parameters vary with it.
    """
    law = _law(build, inertial)
    if law is None:
        return None
    bound, varying = build.bound(law), law.varying
    if inertial and varying:
        symbols = {parameter.path: parameter.symbol for parameter in build.parameters.items}
        bound = bound.bind({name: symbols[f"{bound.path}.{name}"] for name in varying})
    if not (inertial and varying):
        build.motion.creep_law = law
    # The internal variables of the law are read here before they are defined as states.
    own = {name: symengine.Symbol(name) for name in law.internal}

    def velocity() -> Expression:
        return build.name(VARIABLES["v"], build.variables.call(law, bound.velocity, {**own, DRIVE: symbol}))

    def at_start(values: Mapping[str, float]) -> float:
        """Return the drive at the given velocity, the start value of the search for a balance."""
        drive = build.variables.call(law, bound.drive, {**own, "v": values["initial.v"]})
        return _number_at_start(build, drive, values)

    given = Given(VARIABLES["v"], build.scene.initial.get("v", 0.0), at_start)
    by = "mechanics.tangential" if inertial else "balance of the tangential tractions"
    scale = DRIVE_SCALE if inertial else 1.0
    symbol = evolve(build, DRIVE, by, algebraic=not inertial, scale=scale, given=given)
    build.variables.define("v", velocity, "derived", f"{law.path}, from its traction")
    return symbol


def _number_at_start(build: Build, expression: Expression, values: Mapping[str, float]) -> float:
    numbers = {parameter.symbol: values[parameter.path] for parameter in build.parameters.items}
    numbers |= {state.symbol: state.from_given(values) for state in build.states if state.name != DRIVE}
    try:
        return float(build.expanded(expression).subs({**numbers, build.t: 0.0}))
    except RuntimeError:  # no real number, as at a negative pressure: zero will do as a start value
        return 0.0


def _law(build: Build, inertial: bool) -> Friction | None:
    """Return the first law that gives the velocity as a function of its traction."""
    for law in build.interface.frictions:
        varies_with_velocity = any("v" in (factor.of, *reads(factor.factor)) for factor in law.factors)
        if law.velocity is not None and (inertial or not varies_with_velocity):
            return law
    return None


def stands_for_velocity(build: Build) -> bool:
    """True if the drive is the state from which the slip velocity follows."""
    return any(state.name == DRIVE for state in build.states)


def inertia(build: Build, m: Expression) -> Expression:
    """Return mass times the rate of the velocity [Pa], plus a small inertia of the drive that keeps it regular."""
    return m * build.total_derivative(symengine.Symbol("v") + LEAST_INERTIAL * symengine.Symbol(DRIVE))
