"""The events of a run as a table: times, what happened, states before and after, energies and verdicts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from surfacechem.results.netcdf import Column
from surfacechem.solve.jumps import ADMISSIBLE, VIOLATES, Jump
from surfacechem.solve.run import Trajectory

Array = NDArray[np.float64]

SIDE = 1e-13
"""Relative distance from a jump at which a time is that of the jump."""

ROUNDING = 1e-12
"""Heat of a jump that counts as none, relative to the energy that was exchanged."""

SLOW = 1e-3
"""Part of the speed of the fastest impact below which a rebound is one of the last."""

REST = "rest"

KINK = "kink of "
"""How the names of events begin that change nothing but a formula."""


@dataclass(frozen=True)
class Row:
    """An event with the states at its two sides, and its jump where it is one."""

    t: float
    name: str
    reason: str
    before: Array
    after: Array
    jump: Jump | None = None


def event_columns(runs: Sequence[Trajectory], axes: Mapping[str, int] | None = None) -> list[Column]:
    """The table of one run, or of many along the ``axes`` of a sweep, by name and size: there times and values are not
    set beyond the last event of a run. Without the columns of jumps where nothing jumped; empty where nothing happened.
    """
    tables = [{column.name: column for column in _table(run)} for run in runs]
    most = max(len(table["event_time"].values) if table else 0 for table in tables)
    found = []
    for column in {name: column for table in tables for name, column in table.items()}.values():
        empty: str | float = "" if column.values.dtype == object else np.nan
        values = np.full((len(runs), most), empty, dtype=column.values.dtype)
        for row, table in zip(values, tables, strict=True):
            if column.name in table:
                row[: len(table[column.name].values)] = table[column.name].values
        shape = (*(axes or {}).values(), most)
        found.append(replace(column, dimensions=(*(axes or {}), "event"), values=values.reshape(shape)))
    return found


def _table(trajectory: Trajectory) -> list[Column]:
    rows = _rows(trajectory)
    if not rows:
        return []
    columns = [
        _column("event_time", [row.t for row in rows], "s", "time of the event"),
        _column("event_name", [row.name for row in rows], "1", "name of the event"),
        _column("event_reason", [row.reason for row in rows], "1", "what happened"),
    ]
    return columns + (_jump_columns(trajectory, rows) if trajectory.jumps else [])


def _column(name: str, values: Sequence[float | str] | Array, unit: str, long_name: str) -> Column:
    return Column(name, ("event",), np.array(values, object if isinstance(values[0], str) else float), unit, long_name)


def _rows(trajectory: Trajectory) -> list[Row]:
    """Jumps and other events in order of time."""
    margins, events = trajectory.model.margins, trajectory.result.events
    smooth = [
        Row(float(t), margins[i].name, margins[i].reason, y, y)
        for t, i, y in zip(events.t, events.index, events.y, strict=True)
        if i < len(margins) and not margins[i].peak
    ]
    jumped = [Row(j.t, j.edge.name, j.edge.reason, j.before.y, j.after.y, j) for j in trajectory.jumps]
    return sorted([*smooth, *jumped], key=lambda row: row.t)


def event_times(trajectory: Trajectory) -> dict[str, Any]:
    """Times [s] of the events by name, in order; where physics stopped the run, also that of its end.

    Names of kinks, at which a formula changes and nothing else, begin with KINK: whether one that is only grazed is met
    is a matter of rounding.

    Impacts slower than a thousandth of the fastest so far are left out, with what happens at their time but rest: of
    endless rebounds, how many there are is a matter of the tolerance. So is what falls on the very end of the run:
    rounding decides whether it still happens.
    """
    last = trajectory.run.times[-1] * (1 - SIDE)
    rows = [row for row in _telling(trajectory, _rows(trajectory)) if row.t < last]
    times: dict[str, list[float]] = {}
    for row in rows:
        times.setdefault(row.name if row.jump else f"{KINK}{row.name}", []).append(row.t)
    found = {name: np.array(values) for name, values in times.items()}
    ended = {"end": np.array([trajectory.result.t])} if trajectory.status == "stopped" else {}
    return found | ended


def _telling(trajectory: Trajectory, rows: Sequence[Row]) -> list[Row]:
    """The events without slow rebounds and what they set off; coming to rest ends them and is one."""
    names = [state.name for state in trajectory.model.system.states]
    kept, fastest, slow = [], 0.0, -np.inf
    for row in rows:
        if row.jump and row.jump.edge.returns is not None:
            speed = abs(float(row.before[names.index("v_n")]))
            fastest = max(fastest, speed)
            slow = row.t if speed < SLOW * fastest else -np.inf
        elif row.t != slow or row.name == REST:
            slow = -np.inf
        kept += [row] if slow == -np.inf else []
    return kept


def _jump_columns(trajectory: Trajectory, rows: Sequence[Row]) -> list[Column]:
    """What jumped; where nothing did, the state goes on and nothing is released or judged."""
    jumps = [row.jump for row in rows]
    columns = [
        _column("event_since", _since(rows), "s", "time since the transition before or the start"),
        _column("event_released", [j.released if j else 0.0 for j in jumps], "J/m^2", "energy turned into heat"),
        _column("event_entropy", [j.entropy if j else 0.0 for j in jumps], "J/(m^2 K)", "entropy produced"),
        _column(
            "event_verdict",
            [j.verdict if j else "" for j in jumps],
            "1",
            "whether the second law allows it; empty where nothing jumps",
        ),
    ]
    for k, state in enumerate(trajectory.model.system.states):
        if state.name not in trajectory.model.system.inside:
            q = state.quantity
            columns += [
                _column(f"{q.name}_before", [row.before[k] for row in rows], q.unit, f"{q.long_name} before"),
                _column(f"{q.name}_after", [row.after[k] for row in rows], q.unit, f"{q.long_name} after"),
            ]
    return columns


def _since(rows: Sequence[Row]) -> list[float]:
    """Times since the last jump before each row, or since the start."""
    last, found = 0.0, []
    for row in rows:
        found.append(row.jump.since if row.jump else row.t - last)
        last = row.t if row.jump else last
    return found


def entropy_destroyed(jumps: Sequence[Jump]) -> float:
    """Most entropy that a jump has destroyed [J/(m^2 K)]; one that was refused destroys none."""
    return max((-jump.entropy for jump in jumps if jump.verdict == VIOLATES and not jump.stops), default=0.0)


def event_findings(jumps: Sequence[Jump]) -> list[str]:
    """Jumps against the second law that the case did not accept, in words; those that repeat in one line."""
    flagged: dict[tuple[str, str], list[Jump]] = {}
    for jump in jumps:
        if jump.verdict != ADMISSIBLE and jump.edge.violation != "accept":
            flagged.setdefault((jump.edge.reason, jump.verdict), []).append(jump)
    return [_finding(reason, verdict, same) for (reason, verdict), same in flagged.items()]


def _finding(reason: str, verdict: str, jumps: Sequence[Jump]) -> str:
    worst = min(jumps, key=lambda jump: jump.entropy)
    lost, at = f"{worst.entropy:.3g} J/(m^2 K)", f"t = {jumps[0].t:.9g} s"
    if len(jumps) == 1:
        return f"{reason} at {at}: {verdict} ({lost})"
    return f"{reason} {len(jumps)} times, first at {at}: {verdict} (at worst {lost}, at t = {worst.t:.9g} s)"


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
    return list(dict.fromkeys(jump.edge.name for jump in jumps if jump.verdict != ADMISSIBLE))


def event_counts(jumps: Sequence[Jump]) -> str:
    """Names of the transitions, and how often each happened."""
    names = [jump.edge.name for jump in jumps]
    return ", ".join(f"{names.count(name)} {name}" if names.count(name) > 1 else name for name in dict.fromkeys(names))


def event_summary(jumps: Sequence[Jump], exchanged: float) -> str:
    """The transitions of a run in one line; ``exchanged`` is the largest energy that anything exchanged [J/m^2]."""
    released = sum(jump.released for jump in jumps)
    verdicts = {jump.verdict for jump in jumps} - {ADMISSIBLE}
    heat = f"; released {released:.4g} J/m^2" if abs(released) > len(jumps) * ROUNDING * exchanged else ""
    return f"{event_counts(jumps)}{heat}; {'all admissible' if not verdicts else ', '.join(sorted(verdicts))}"
