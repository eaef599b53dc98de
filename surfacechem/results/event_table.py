"""Table of the events of runs: times, names and reasons, states before and after, energies and verdicts."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np

from surfacechem.results.netcdf import Column
from surfacechem.solve.contract import Array
from surfacechem.solve.jumps import ADMISSIBLE, VIOLATES, Jump
from surfacechem.solve.run import Trajectory
from surfacechem.tolerances import NEGLIGIBLE, RUN_EPS, TIME_EPS

SIDE = RUN_EPS / 8
"""Relative distance from a jump within which a time is equal to that of the jump, 1.1e-13: times are sums over some 1e5
steps, whose roundings add up to a tenth of those of 1e7.
"""

REST = "rest"

STEADY = "steady"

KINK = "kink of "
"""Prefix of the names of events at which only a formula changes."""


class EventRow(NamedTuple):
    """An event with the states on both sides of it, and its jump if it is one."""

    t: float
    since: float
    """Time since the preceding jump, or since the start."""
    name: str
    reason: str
    before: Array
    after: Array
    jump: Jump | None = None
    released: float = 0.0
    """Energy turned into heat; it, the entropy produced and the verdict of the second law are empty without a jump."""
    entropy: float = 0.0
    verdict: str = ""


def events_of(trajectory: Trajectory) -> list[EventRow]:
    """Return jumps and other events of a run in order of time."""
    margins, events = trajectory.model.margins, trajectory.result.events
    found = [
        EventRow(float(t), 0.0, margins[i].name, margins[i].reason, y, y)
        for t, i, y in zip(events.t, events.index, events.y, strict=True)
        if i < len(margins) and not margins[i].peak
    ]
    for j in trajectory.jumps:
        done = j.released, j.entropy, j.verdict
        found.append(EventRow(j.t, j.since, j.edge.name, j.edge.reason, j.before.y, j.after.y, j, *done))
    if trajectory.run.rest is not None:
        y = trajectory.result.y
        found.append(EventRow(trajectory.run.rest, 0.0, STEADY, "came to rest, a steady state", y, y))
    last, rows = 0.0, []
    for event in sorted(found, key=lambda event: event.t):
        rows.append(event if event.jump else event._replace(since=event.t - last))
        last = event.t if event.jump else last
    return rows


def event_columns(runs: Sequence[Trajectory], axes: Mapping[str, int] | None = None) -> list[Column]:
    """Return the table of one run, or of many along the ``axes`` of a sweep, by name and size.

    In a sweep, entries beyond the last event of a run are unset. Columns of jumps are left out if no run jumps; empty
    if there are no events.
    """
    system, events = runs[0].model.system, [events_of(run) for run in runs]
    most = max(map(len, events))
    sizes = {**(axes or {}), "event": most}

    def column(name: str, unit: str, text: str, value: Callable[[EventRow], float | str]) -> Column:
        # Texts have no unit.
        table = np.full((len(runs), most), np.nan) if unit else np.full((len(runs), most), "", dtype=object)
        for row, own in zip(table, events, strict=True):
            row[: len(own)] = [value(event) for event in own]
        return Column(name, tuple(sizes), table.reshape(*sizes.values()), system.unit(unit), text)

    if not most:
        return []
    columns = [
        column("event_time", "s", "time of the event", attrgetter("t")),
        column("event_name", "", "name of the event", attrgetter("name")),
        column("event_reason", "", "what happened", attrgetter("reason")),
    ]
    if not any(run.jumps for run in runs):
        return columns
    verdict = "whether the second law allows it; empty where nothing jumps"
    columns += [
        column("event_since", "s", "time since the transition before or the start", attrgetter("since")),
        column("event_released", "J/m^2", "energy turned into heat", attrgetter("released")),
        column("event_entropy", "J/(m^2 K)", "entropy produced", attrgetter("entropy")),
        column("event_verdict", "", verdict, attrgetter("verdict")),
    ]
    for name, state in system.own_states.items():
        q, k = state.quantity, system.state_columns[name]
        for side in ("before", "after"):
            text, read = f"{q.long_name} {side}", lambda event, side=side, k=k: float(getattr(event, side)[k])
            columns.append(column(f"{q.name}_{side}", q.unit, text, read))
    return columns


def event_times(trajectory: Trajectory) -> dict[str, Any]:
    """Return the times [s] of the events by name, in order; if physics stopped the run, also the time of its end.

    Names of kinks, at which only a formula changes, begin with KINK: roundoff decides whether a kink that is only
    grazed counts.

    Impacts slower than a thousandth of the fastest so far are left out, with all events at their time except rest: the
    number of rebounds in a Zeno sequence depends on the tolerance. Events at the very end of the run are left out, as
    roundoff decides whether they happen; so are events that others undo at the same time, as where a gap touches zero
    and opens again, and the time of a steady state, which depends on the tolerance.
    """
    columns = trajectory.model.system.state_columns
    end, fastest, slow = trajectory.run.times[-1] * (1 - SIDE), 0.0, -np.inf
    times: dict[str, list[float]] = {}
    for event in _lasting(trajectory) if trajectory.jumps else events_of(trajectory):
        if event.jump and event.jump.edge.is_impact:
            speed = abs(float(event.before[columns["v_n"]]))
            fastest = max(fastest, speed)
            slow = event.t if speed < NEGLIGIBLE * fastest else -np.inf
        elif event.t != slow or event.name == REST:  # coming to rest ends the rebounds, and counts
            slow = -np.inf
        if slow == -np.inf and event.t < end and event.name != STEADY:
            times.setdefault(event.name if event.jump else f"{KINK}{event.name}", []).append(event.t)
    found = {name: np.array(values) for name, values in times.items()}
    ended = {"end": np.array([trajectory.result.t])} if trajectory.status == "stopped" else {}
    return found | ended


def _lasting(trajectory: Trajectory) -> list[EventRow]:
    """Return the events without those that others at the same time undo: modes and states are equal around them."""
    problem, modes = trajectory.result.problem, [*trajectory.model.system.mode_columns.values()]
    moments: list[list[Jump]] = []
    for jump in trajectory.jumps:
        if not moments or jump.since > TIME_EPS * jump.t:
            moments.append([])
        moments[-1].append(jump)
    undone: set[int] = set()
    for jumps in (each for each in moments if len(each) > 1):
        before, after = jumps[0].before, jumps[-1].after
        same = np.abs(after.y - before.y) <= problem.rtol * np.abs(before.y) + problem.atol
        if same.all() and np.array_equal(before.parameters[modes], after.parameters[modes]):
            undone.update(map(id, jumps))
    return [event for event in events_of(trajectory) if id(event.jump) not in undone]


def entropy_destroyed(jumps: Sequence[Jump]) -> float:
    """Return the most entropy that a jump has destroyed [J/(m^2 K)]; a jump that was refused destroys none."""
    return max((-jump.entropy for jump in jumps if jump.verdict == VIOLATES and not jump.stops), default=0.0)


def event_findings(jumps: Sequence[Jump], unit: str = "J/(m^2 K)") -> Iterator[str]:
    """Describe jumps that violate the second law and that the case did not accept; repeated ones in one line. ``unit``
    is the unit of entropy.
    """
    flagged: dict[tuple[str, str], list[Jump]] = {}
    for jump in jumps:
        if jump.verdict != ADMISSIBLE and jump.edge.violation != "accept":
            flagged.setdefault((jump.edge.reason, jump.verdict), []).append(jump)
    for (reason, verdict), same in flagged.items():
        worst = min(same, key=lambda jump: jump.entropy)
        first, lost = f"t = {same[0].t:.9g} s", f"{worst.entropy:.3g} {unit}"
        if len(same) == 1:
            yield f"{reason} at {first}: {verdict} ({lost})"
        else:
            times, at = f"{len(same)} times, first at {first}", f"t = {worst.t:.9g} s"
            yield f"{reason} {times}: {verdict} (at worst {lost}, at {at})"


def event_waits(trajectory: Trajectory) -> Iterator[str]:
    """Describe transitions for which a run that reached its end was still waiting, except those that end with it."""
    system, last = trajectory.model.system, trajectory.jumps[-1:]
    for mode in system.modes:
        value = float(last[0].after.parameters[system.mode_columns[mode.name]]) if last else mode.initial
        if trajectory.status == "finished" and value in mode.waits and not _ends(trajectory, mode.symbol, value):
            yield f"the {mode.name} {mode.words[value]} did not end: it goes on until {mode.waits[value]}"


def _ends(trajectory: Trajectory, mode: Any, value: float) -> bool:
    """True if the stage that a mode has at the end of a run ends with it, within the roundoff of time."""
    model, result = trajectory.model, trajectory.result
    edges = [j for j, edge in enumerate(model.system.edges) if edge.ends_stage and edge.when.get(mode) == (value,)]
    if not edges or model.jumper is None or model.program.margins is None:
        return False
    row = model.inputs(result, np.array([result.t]), result.y[None], result.ydot[None], np.array([-1]))
    left, rates = model.program.margins(row)[0, len(model.margins) :], model.jumper.guard_rates(row)[0]
    return bool(np.any((left + SIDE * result.t * rates)[edges] <= 0))


def event_counts(jumps: Sequence[Jump]) -> str:
    """List the names of the transitions with their counts."""
    names = [jump.edge.name for jump in jumps]
    return ", ".join(f"{names.count(name)} {name}" if names.count(name) > 1 else name for name in dict.fromkeys(names))


def event_summary(jumps: Sequence[Jump], exchanged: float, unit: str = "J/m^2") -> str:
    """Summarise the transitions of a run in one line; ``exchanged`` is the largest energy that was exchanged."""
    released = sum(jump.released for jump in jumps)
    verdicts = {jump.verdict for jump in jumps} - {ADMISSIBLE}
    heat = f"; released {released:.4g} {unit}" if abs(released) > len(jumps) * RUN_EPS * exchanged else ""
    return f"{event_counts(jumps)}{heat}; {'all admissible' if not verdicts else ', '.join(sorted(verdicts))}"
