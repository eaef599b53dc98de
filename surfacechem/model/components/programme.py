"""Staged loading: variables that move at the rates of the present stage, and what ends a stage."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import symengine

from surfacechem.contracts.terms import Spec
from surfacechem.errors import InputError, suggestion
from surfacechem.expressions import Expression, where
from surfacechem.model.automaton import Edge
from surfacechem.model.build import Build
from surfacechem.model.components.interface import LOADABLE
from surfacechem.model.components.mounting import LENGTH, TRACTIONS
from surfacechem.model.system import State
from surfacechem.model.variables import unit_of
from surfacechem.quantities import INTERNAL, VARIABLES
from surfacechem.scene import Stage
from surfacechem.units import quotient

SCALES = {"m": LENGTH, "m/s": LENGTH}


def variables(build: Build) -> None:
    """The stage as a mode, and a state for each variable that the stages move."""
    stages = build.scene.programme
    if not stages:
        return
    words = {float(i): stage.name for i, stage in enumerate(stages)} | {float(len(stages)): "after the last stage"}
    for i, item in enumerate(stages):
        if item.name in [other.name for other in stages[:i]]:
            raise InputError(f"two stages are called '{item.name}'. Give each a name of its own.", item.place)
    waits = {float(i): _awaited(stage) for i, stage in enumerate(stages) if _awaited(stage)}
    stage = build.mode("stage", 0.0, words, waits=waits)
    for name in dict.fromkeys(name for item in stages for name in item.rates):
        if name not in LOADABLE:
            message = f"a programme cannot move '{name}'.{suggestion(name, LOADABLE)}"
            raise InputError(message, stages[0].place)
        build.variables.define(name, partial(_driven, build, name, stage), "driven", "programme")


def _awaited(stage: Stage) -> str:
    """What ends a stage, in words; nothing where it has no end."""
    if stage.variable:
        return f"{stage.variable} {'rises' if stage.rising else 'falls'} to {stage.value:g}"
    if stage.duration is not None:
        return f"{stage.duration:g} s have passed"
    return f"the event '{stage.event}'" if stage.event else ""


def _driven(build: Build, name: str, stage: Expression) -> Expression:
    symbol, dot = symengine.Symbol(name), symengine.Symbol(f"d{name}_dt")
    quantity = VARIABLES[name]
    rate: Expression = symengine.Integer(0)
    for i, item in enumerate(build.scene.programme):
        if name in item.rates:
            spec = Spec(quotient(quantity.unit, "s"), f"rate of {name} in the stage {item.name}")
            value = build.parameters.add(f"{name}_rate", f"{_path(item)}.{name}", spec, item.rates[name])
            rate = rate + where(_during(stage, i), value, 0)
    start = build.scene.initial.get(name, 0.0)
    build.states.append(State(quantity, symbol, dot, start, SCALES.get(quantity.unit, 1.0), algebraic=False))
    build.rows.kinematics(name, rate)
    build.motion.drives[name] = rate
    return symbol


def _during(stage: Expression, i: int) -> Expression:
    """Whether the programme is in its stage i; modes are whole numbers."""
    return symengine.Lt((stage - i) ** 2, symengine.RealDouble(0.25))


def stages(build: Build) -> None:
    """The transition at the end of each stage: after a time, at a value of a variable, or at another transition."""
    stages = build.scene.programme
    if not stages:
        return
    stage = build.find_mode("stage")
    begun = build.register("stage_begun", "time at which the stage began")
    for i, item in enumerate(stages):
        advance = {stage: symengine.Integer(i + 1), begun: build.t}
        if item.duration is not None:
            spec = Spec("s", f"length of the stage {item.name}", above=0)
            length = build.parameters.add("length", f"{_path(item)}.for", spec, item.duration)
            _stage_end(build, item, begun + length - build.t, advance, {stage: (i,)})
        elif item.event:
            # The transition itself moves the programme on.
            found = [j for j, other in enumerate(build.edges) if other.name.startswith(item.event)]
            if not found:
                known = [other.name for other in build.edges]
                raise InputError(
                    f"the stage {item.name} waits for '{item.event}'.{suggestion(item.event, known)}", item.place
                )
            for j in found:
                other = build.edges[j]
                modes = {
                    **other.modes,
                    stage: where(_during(stage, i), i + 1, other.modes.get(stage, stage)),
                    begun: where(_during(stage, i), build.t, other.modes.get(begun, begun)),
                }
                build.edges[j] = replace(other, modes=modes)
        elif item.variable:
            _at_value(build, item, stage, i, advance)


def _path(item: Stage) -> str:
    return f"programme.{item.name}"


def _stage_end(
    build: Build,
    item: Stage,
    margin: Expression,
    advance: dict[Expression, Expression],
    during: dict[Expression, tuple[int]],
) -> None:
    reason = f"the stage {item.name} ends"
    build.edges.append(Edge(f"end of {item.name}", margin, reason, advance, passes=True, when=during))


def _at_value(build: Build, item: Stage, stage: Expression, i: int, advance: dict[Expression, Expression]) -> None:
    x = _variable(build, item)
    traction = item.variable in TRACTIONS
    spec = Spec("Pa" if traction else unit_of(item.variable), f"end of the stage {item.name}")
    path = f"{_path(item)}.until.{item.variable}{'' if item.rising else '.falls-to'}"
    name = f"{item.variable}_end" if traction else item.variable
    value = build.parameters.add(name, path, spec, item.value)
    sign = symengine.Integer(1 if item.rising else -1)
    _stage_end(build, item, sign * (value - x), advance, {stage: (i,)})


def _variable(build: Build, item: Stage) -> Expression:
    if item.variable in build.thermal.nodes:
        return build.thermal.nodes[item.variable].T
    if build.variables.has(item.variable):
        return build.variables.get(item.variable, f"the stage {item.name}")
    if build.is_named(item.variable):
        return symengine.Symbol(item.variable)
    roles = (role.variable for role in build.variables.roles if role.role not in ("constant", "internal"))
    known = {*roles, *build.thermal.nodes} - INTERNAL
    raise InputError(
        f"the stage {item.name} waits for '{item.variable}'.{suggestion(item.variable, known)}", item.place
    )
