"""Motions of a scene that are far faster than its run, and what a run that they bring to an end says of it."""

from __future__ import annotations

from collections.abc import Mapping

from surfacechem.model.system import Pace, System
from surfacechem.solve.contract import Result, Status

FEW, SHARP = 100.0, 1e-12
"""Steps in a period, fewer than which follow nothing, and the part of the time that a step can still resolve."""


def paces(system: System, values: Mapping[str, float]) -> list[tuple[Pace, float]]:
    """Times in which the gaps move by themselves [s], the shortest first."""
    point = {parameter.symbol: values[parameter.path] for parameter in system.parameters}
    found = [(pace, float(system.expand(pace.time).subs(point))) for pace in system.paces]
    return sorted(found, key=lambda item: item[1])


def too_fast(system: System, result: Result, values: Mapping[str, float]) -> str:
    """What is too short to be followed, and what to do, where that is why a run could not go on."""
    end = float(result.problem.segments[-1])
    shortest = {Status.MAX_STEPS: FEW * end / result.problem.max_steps, Status.STEP_UNDERFLOW: SHARP * result.t}
    for pace, time in paces(system, values):
        if time < shortest.get(result.status, 0.0):
            return f": the {pace.text}, {time:.3g} s, is too short for a run of {end:.3g} s; {pace.remedy}"
    return ""
