"""Staged loading (load steps): variables that move at the rates of the present stage, and events that end stages."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial

import symengine

from surfacechem.contracts.terms import Spec
from surfacechem.contracts.units import quotient
from surfacechem.errors import InputError, refuse_unknown, suggestion
from surfacechem.expressions import Expression, where
from surfacechem.model.automaton import Constraint, Edge, Mode, Register
from surfacechem.model.build import Build
from surfacechem.model.components.interface import LOADABLE
from surfacechem.model.components.mounting import LENGTH_SCALE, SLIDING_TRACTIONS
from surfacechem.model.system import State
from surfacechem.model.variables import unit_of
from surfacechem.quantities import INTERNAL, VARIABLES
from surfacechem.scene import Stage
from surfacechem.tolerances import FEW_EPS

STAGE = symengine.Symbol("stage")
STAGE_START = Register("stage_begun", "time at which the stage began")
STATE_SCALES = {"m": LENGTH_SCALE, "m/s": LENGTH_SCALE}


def variables(build: Build) -> Iterator[Constraint]:
    """Yield the stage as a mode; define a state for each variable that the stages move."""
    stages = build.scene.programme
    words = {float(i): stage.name for i, stage in enumerate(stages)} | {float(len(stages)): "after the last stage"}
    for i, item in enumerate(stages):
        if item.name in [other.name for other in stages[:i]]:
            raise InputError(f"two stages are called '{item.name}'. Give each a name of its own.", item.place)
    waits = {float(i): _awaited(stage) for i, stage in enumerate(stages) if _awaited(stage)}
    yield Constraint((Mode("stage", 0.0, words, waits=waits),))
    moved = dict.fromkeys(name for item in stages for name in item.rates)
    refuse_unknown(moved, LOADABLE, "a programme cannot move '{}'", stages[0].place)
    for name in moved:
        build.variables.define(name, partial(_driven, build, name), "driven", "programme")


def _awaited(stage: Stage) -> str:
    """Return the condition that ends a stage, in words; empty if it has no end."""
    if stage.variable:
        return f"{stage.variable} {'rises' if stage.rising else 'falls'} to {stage.value:g}"
    if stage.duration is not None:
        return f"{stage.duration:g} s have passed"
    return f"the event '{stage.event}'" if stage.event else ""


def _driven(build: Build, name: str) -> Expression:
    """Add a state that moves at the rate of the present stage."""
    quantity = VARIABLES[name]
    rate: Expression = symengine.Integer(0)
    for i, item in enumerate(build.scene.programme):
        if name in item.rates:
            spec = Spec(quotient(quantity.unit, "s"), f"rate of {name} in the stage {item.name}")
            value = build.parameters.add(f"{name}_rate", f"programme.{item.name}.{name}", spec, item.rates[name])
            rate = rate + where(_during(i), value, 0)
    start = build.scene.initial.get(name, 0.0)
    build.add(State(quantity, start, STATE_SCALES.get(quantity.unit, 1.0)))
    build.rows.kinematics(name, rate)
    build.motion.ramp_rates[name] = rate
    return symengine.Symbol(name)


def _during(i: int) -> Expression:
    """Return the condition that stage i is the present one; modes are whole numbers."""
    return symengine.Lt((STAGE - i) ** 2, symengine.RealDouble(0.25))


def stages(build: Build) -> Iterator[Constraint | str]:
    """Yield the edge at the end of each stage: after a time, at a value of a variable, or along another edge."""
    begun, edges = STAGE_START.symbol, []
    waiting = [(i, item) for i, item in enumerate(build.scene.programme) if item.event and item.duration is None]
    for i, item in waiting:
        _refuse_unknown_event(build, i, item)
    for i, item in enumerate(build.scene.programme):
        if item.duration is not None or (item.variable and not item.event):
            modes, reason = {STAGE: symengine.Integer(i + 1), begun: build.t}, f"the stage {item.name} ends"
            guard = _left(build, item)
            edges.append(Edge(f"end of {item.name}", guard, reason, modes, ends_stage=True, when={STAGE: (i,)}))
            if item.variable and _is_so_already(build, i, guard):
                told = f"the stage {item.name} waits until {_awaited(item)}, which it is as the stage begins"
                yield f"{told}: it ends at once, or where roundoff decides. Give another value."

    def advancing(edge: Edge) -> dict[Expression, Expression]:
        """Return the new stage and its start time along an edge that stages wait for."""
        modes: dict[Expression, Expression] = {}
        for i, item in waiting:
            if _is_awaited(item, edge.name) and not edge.ends_stage:
                modes[STAGE] = where(_during(i), i + 1, modes.get(STAGE, STAGE))
                modes[begun] = where(_during(i), build.t, modes.get(begun, begun))
        return modes

    yield Constraint(registers=(STAGE_START,), edges=tuple(edges), resets=advancing)


def _is_so_already(build: Build, i: int, guard: Expression) -> bool:
    """True if a stage is known to wait for what its variable is already, or has passed, as the stage begins.

    Known are variables that stages move, and one that the stage before waits for, unless rates decide its value.
    """
    item, moved = build.scene.programme[i], build.scene.programme[i].variable in build.motion.ramp_rates
    known = build.scene.initial.get(item.variable, 0.0) if moved else math.nan
    for stage in build.scene.programme[:i]:
        if stage.variable == item.variable:
            known = stage.value
        elif item.variable in stage.rates:
            known += stage.rates[item.variable] * (stage.duration or math.nan)
        elif not moved:
            known = math.nan
    if not moved and {state.dot for state in build.states} & build.expanded(guard).free_symbols:
        known = math.nan
    left = known - item.value if item.rising else item.value - known
    return left >= -FEW_EPS * abs(item.value) or (i == 0 and build.at_start(guard) == 0)


def _is_awaited(item: Stage, edge: str) -> bool:
    """Return whether a stage waits for an edge of this name, or of one that begins with whole words: any ``slip``."""
    return f"{edge} ".startswith(f"{item.event} ")


def _refuse_unknown_event(build: Build, i: int, item: Stage) -> None:
    """Raise InputError unless a stage waits for an edge of the interface, or for the end of an earlier stage."""
    before = [f"end of {stage.name}" for stage in build.scene.programme[:i] if not stage.event]
    known = {*(edge.name for edge in build.edges), *before}
    if not any(_is_awaited(item, name) for name in known):
        message = f"the stage {item.name} waits for '{item.event}'.{suggestion(item.event, known)}"
        raise InputError(message, item.place)


def _left(build: Build, item: Stage) -> Expression:
    """Return the guard of the end of a stage: its time left, or the distance of a variable from its end value."""
    path = f"programme.{item.name}"
    if item.duration is not None:
        spec = Spec("s", f"length of the stage {item.name}", above=0)
        return STAGE_START.symbol + build.parameters.add("length", f"{path}.for", spec, item.duration) - build.t
    name, traction = item.variable, item.variable in SLIDING_TRACTIONS
    if name in build.thermal.nodes:
        x = build.thermal.nodes[name].T
    elif build.variables.has(name):
        x = build.variables.get(name, f"the stage {item.name}")
    elif build.is_named(name):
        x = symengine.Symbol(name)
    else:
        roles = (role.variable for role in build.variables.roles if role.role not in ("constant", "internal"))
        known = {*roles, *build.thermal.nodes} - INTERNAL
        raise InputError(f"the stage {item.name} waits for '{name}'.{suggestion(name, known)}", item.place)
    spec = Spec("Pa" if traction else unit_of(name), f"end of the stage {item.name}")
    path = f"{path}.until.{name}{'' if item.rising else '.falls-to'}"
    end = build.parameters.add(f"{name}_end" if traction else name, path, spec, item.value)
    return end - x if item.rising else x - end
