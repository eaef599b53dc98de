"""Variables that a friction law evolves by itself, such as the age of a contact, as logarithms."""

from __future__ import annotations

import math

import symengine

from surfacechem.contracts.terms import Friction
from surfacechem.errors import InputError
from surfacechem.expressions import exp
from surfacechem.model.build import Build
from surfacechem.model.system import Given, State
from surfacechem.quantities import VARIABLES


def memory(build: Build, law: Friction, bound: Friction) -> None:
    """States of the law and their rates; the initial value is that of the quantity, not of its logarithm."""
    for name, of in law.internal.items():
        symbol, dot = symengine.symbols(f"{name} d{name}_dt")
        start = build.initial(of)
        if not start > 0:
            raise InputError(f"initial {of} = {start:g} is outside its range: > 0.", path=f"initial.{of}")
        build.variables.define(name, lambda symbol=symbol: symbol, "evolved", law.path)  # type: ignore[misc]
        given = Given(VARIABLES[of], start)
        build.states.append(State(VARIABLES[name], symbol, dot, math.log(start), 1.0, algebraic=False, given=given))
        build.name(VARIABLES[of], exp(symbol))
    if law.internal:
        for name, rate in build.variables.call(bound, bound.evolution).items():
            build.rows.kinematics(name, rate)
