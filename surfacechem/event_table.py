"""The events of a run as a table: times, what happened, states before and after, energies and verdicts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from surfacechem.integrate import Trajectory
from surfacechem.jumps import ADMISSIBLE, Jump


@dataclass(frozen=True)
class EventColumn:
    """A column of the table: name, values, unit, long name."""

    name: str
    values: Any
    unit: str
    long_name: str


def event_columns(trajectory: Trajectory) -> list[EventColumn]:
    """The table, without the columns of jumps where nothing jumped; empty where nothing happened."""
    margins, events = trajectory.model.margins, trajectory.result.events
    plain = [
        (float(t), margins[i].name, margins[i].reason, None)
        for t, i in zip(events.t, events.index, strict=True)
        if i < len(margins) and not margins[i].peak
    ]
    jumped = [(jump.t, jump.transition.name, jump.transition.reason, jump) for jump in trajectory.jumps]
    rows = sorted([*plain, *jumped], key=lambda row: row[0])
    if not rows:
        return []
    columns = [
        EventColumn("event_time", np.array([row[0] for row in rows]), "s", "time of the event"),
        EventColumn("event_name", np.array([row[1] for row in rows], dtype=object), "1", "name of the event"),
        EventColumn("event_reason", np.array([row[2] for row in rows], dtype=object), "1", "what happened"),
    ]
    return columns + (_jump_columns(trajectory, [row[3] for row in rows]) if jumped else [])


def event_times(trajectory: Trajectory) -> dict[str, Any]:
    """Times [s] of the events by name, in order; where physics stopped the run, also that of its end."""
    table = {column.name: column.values for column in event_columns(trajectory)}
    times, names = table.get("event_time", np.empty(0)), table.get("event_name", np.empty(0, object))
    found = {str(name): times[names == name] for name in dict.fromkeys(names)}
    ended = {"end": np.array([trajectory.result.t])} if trajectory.status == "stopped" else {}
    return found | ended


def _jump_columns(trajectory: Trajectory, jumps: Sequence[Jump | None]) -> list[EventColumn]:
    def values(read: Any) -> Any:
        return np.array([np.nan if jump is None else read(jump) for jump in jumps])

    verdicts = np.array(["" if jump is None else jump.verdict for jump in jumps], dtype=object)
    columns = [
        EventColumn("event_since", values(lambda j: j.since), "s", "time since the transition before or the start"),
        EventColumn("event_released", values(lambda j: j.released), "J/m^2", "energy turned into heat"),
        EventColumn("event_entropy", values(lambda j: j.entropy), "J/(m^2 K)", "entropy produced"),
        EventColumn("event_verdict", verdicts, "1", "whether the second law allows it"),
    ]
    for k, state in enumerate(trajectory.model.system.states):
        if state.name in trajectory.model.system.inside:
            continue
        q = state.quantity
        columns += [
            EventColumn(f"{q.name}_before", values(lambda j, k=k: j.before.y[k]), q.unit, f"{q.long_name} before"),
            EventColumn(f"{q.name}_after", values(lambda j, k=k: j.after.y[k]), q.unit, f"{q.long_name} after"),
        ]
    return columns


def event_findings(jumps: Sequence[Jump]) -> list[str]:
    """Jumps against the second law that the case did not accept, in words."""
    flagged = [jump for jump in jumps if jump.verdict != ADMISSIBLE and jump.transition.violation != "accept"]
    return [
        f"{jump.transition.reason} at t = {jump.t:.9g} s: {jump.verdict} ({jump.entropy:.3g} J/(m^2 K))"
        for jump in flagged
    ]


def event_waits(trajectory: Trajectory) -> list[str]:
    """What a run that reached its end was still waiting for."""
    parameters, last = trajectory.model.system.parameters, trajectory.jumps[-1:]
    findings = []
    for mode in trajectory.model.system.modes:
        j = next(j for j, parameter in enumerate(parameters) if parameter.symbol == mode.symbol)
        value = float(last[0].after.parameters[j]) if last else mode.initial
        if trajectory.status == "finished" and value in mode.waits:
            findings.append(f"the {mode.name} {mode.words[value]} did not end: it goes on until {mode.waits[value]}")
    return findings


def event_violations(jumps: Sequence[Jump]) -> list[str]:
    """Names of the transitions that have destroyed entropy, or would have."""
    return list(dict.fromkeys(jump.transition.name for jump in jumps if jump.verdict != ADMISSIBLE))


def event_summary(jumps: Sequence[Jump]) -> str:
    """The transitions of a run in one line."""
    names = [jump.transition.name for jump in jumps]
    counts = [f"{names.count(name)} {name}" if names.count(name) > 1 else name for name in dict.fromkeys(names)]
    released = sum(jump.released for jump in jumps)
    verdicts = {jump.verdict for jump in jumps} - {ADMISSIBLE}
    heat = f"; released {released:.4g} J/m^2" if released else ""
    return f"{', '.join(counts)}{heat}; {'all admissible' if not verdicts else ', '.join(sorted(verdicts))}"
