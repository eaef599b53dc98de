"""Friction: sliding tractions, their dissipation, and the internal variables of friction laws.

An internal variable, such as the age of contacts, is evolved as its logarithm.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from functools import partial

import symengine

from surfacechem.contracts.terms import Friction
from surfacechem.errors import InputError
from surfacechem.expressions import Expression, absolute, derivative, exp, sqrt, where
from surfacechem.model.balances import DISSIPATION, INTERFACE, MECHANICS, OUTSIDE, WORK, Power
from surfacechem.model.build import Build
from surfacechem.model.components.mounting import ACROSS, ALONG
from surfacechem.model.sliding.formulation import displacement, in_parallel, resist, resistance, stick_limit
from surfacechem.model.system import Given, Margin, State
from surfacechem.quantities import VARIABLES, Quantity
from surfacechem.tolerances import TINY


def laws(build: Build) -> Iterator[Power | State | Margin]:
    """Name the sliding tractions; yield their dissipation and the work from outside on prescribed sliding."""
    unbonded, total = build.energy.unbonded, symengine.Integer(0)
    resisting: dict[str, Expression] = {}
    if build.interface.frictions:
        build.variables.define("t_s", lambda: _magnitude(build, resisting), "derived", "interface.friction")
    for law in build.interface.frictions:
        label = build.unique(law.label)
        bound = build.bound(law)
        yield from memory(build, law, bound)
        met = pressed(build, law)
        resisted = resistance(build, law, bound, met)
        build.law_margins(bound, {}, met=met)
        power = symengine.Integer(0)
        for d, traction in resisted.items():
            across = " across v" if d is ACROSS else ""
            quantity = Quantity(f"{d.traction}_{label}", "Pa", f"tangential traction of {law.title}{across}")
            named = build.name(quantity, traction)
            nominal = build.stretch * named
            resisting[d.axis] = resisting.get(d.axis, 0) + unbonded * named
            power += unbonded * nominal * build.variables.get(d.velocity, law)
            total += unbonded * nominal
            resist(build, d, nominal)
        yield Power(DISSIPATION, MECHANICS, INTERFACE, power, label)
        if not build.motion.slips:
            text = f"work done against {law.title}"
            yield Power(WORK, OUTSIDE, MECHANICS, power, f"W_{label}", text)
            for v in (d.velocity for d in resisted):
                if build.slope_of(v) != 0 and not any(margin.name == v for margin in build.margins):
                    reason = "sliding reverses" if len(resisted) == 1 else f"{v} changes its sign"
                    yield Margin(v, symengine.Symbol(v), reason, terminal=False)
        else:
            stick_limit(build, law, bound, met)
    if not build.motion.slips and in_parallel(build):
        t_a = derivative(build.psi, displacement(build))
        build.areal(Quantity(ALONG.total, "Pa", f"{ALONG.text} on body 1", ALONG.total), t_a + total)


def _magnitude(build: Build, tractions: Mapping[str, Expression]) -> Expression:
    """Name the magnitude of the sliding traction, given its components."""
    along, *across = tractions.values()
    return build.name(VARIABLES["t_s"], sqrt(along**2 + across[0] ** 2) if across else absolute(along))


def pressed(build: Build, law: Friction) -> dict[str, Expression]:
    """Return the pressure, zero in an open gap, for a law that needs it: an open contact has no friction.

    At p = 0 the derivative is that of the pressed side: a contact starts and ends to press there. In an open gap it is
    zero.
    """
    if "p" not in law.nonnegative or "p" in build.scene.loading:
        return {}
    p, least = build.variables.get("p", law), build.bound(law).least.get("p")
    apart = 0 if (side := build.mode("side")) is None else where(side > 0, TINY, 0)
    return {"p": where(p < apart, 0 * p, p) if least is None else where(p < least, least, p)}


def memory(build: Build, law: Friction, bound: Friction) -> Iterator[State]:
    """Yield the internal variables of a law; the initial value is that of the quantity, not of its logarithm."""
    for name, of in law.internal.items():
        start = build.initial(of)
        if not start > 0:
            raise InputError(f"initial {of} = {start:g} is outside its range: > 0.", path=f"initial.{of}")
        build.variables.define(name, partial(symengine.Symbol, name), "evolved", law.path)
        given = Given(VARIABLES[of], start)
        # The logarithm keeps it positive, and resolves twenty decades of age as well as one.
        yield State(VARIABLES[name], math.log(start), 1.0, given=given)
        build.name(VARIABLES[of], exp(symengine.Symbol(name)))
    if law.internal:
        for name, rate in build.variables.call(bound, bound.evolution).items():
            build.rows.kinematics(name, rate)
