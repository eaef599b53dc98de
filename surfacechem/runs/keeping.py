"""Columns that a store keeps of each run: end, extremes, times of events, series; codes for the ends of runs."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from surfacechem.errors import refuse_unknown
from surfacechem.format.sections import ALL, KeepSection
from surfacechem.model.system import Margin, System
from surfacechem.results.audit import Audit, audit
from surfacechem.results.dataset import quantities
from surfacechem.results.event_table import entropy_destroyed, events_of
from surfacechem.solve.contract import REASONS, Status
from surfacechem.solve.diagnose import GROWS, RUNS_AWAY
from surfacechem.solve.radau.solver import put_rates
from surfacechem.solve.run import Model, Trajectory
from surfacechem.tolerances import GUARD_EPS

Columns = dict[str, NDArray[Any]]
"""Kept columns by name; the first axis is the run."""

STATUSES = ("finished", "stopped", "failed", "refused")
"""Ends of runs, in the order of their codes; the values of a refused run are not admissible at its start."""

INADMISSIBLE, OTHER_REASON = "the values are not admissible at the start", "another reason"

STEADY_STATE, NO_STEADY_STATE = "came to rest", "it does not come to rest"
"""Reasons for the end of a run to a steady state, and for its failure."""

END_COLUMNS = {
    "status": "how the run ended",
    "reason": "why the run ended",
    "time_reached": "time that the run reached",
    "steps": "steps of the run",
    "energy_error": "largest energy residual relative to the energy exchanged",
    "entropy_error": "largest entropy residual relative to what was exchanged",
    "site_error": "largest residual of the site balances",
    "destroys_entropy": "1 where a law or a jump does, else 0",
}
"""Columns about the end of every run, with their meaning; only the time has a unit, seconds."""

BALANCES = tuple(f"{kind}_error" for kind in ("energy", "entropy", "site"))
"""Columns of END_COLUMNS that are errors of balances."""

EXTREMES = {
    "max": (np.fmax, "at most, over outputs, steps and jumps"),
    "min": (np.fmin, "at least, over outputs, steps and jumps"),
}
"""Extremes of a run: suffix of their column names, reduction, and words."""

SINGLE_COLUMNS = {"last": "at the end of the run", **{which: words for which, (_, words) in EXTREMES.items()}}
"""Columns with one number for each run and quantity: suffix of their names, and words."""

REACHES = "reaches "
"""Prefix of the names of margins that locate when a quantity reaches a value."""


@dataclass(frozen=True)
class Keep:
    """Selection of results to be kept: names of quantities and events, and values to be reached by name."""

    last: tuple[str, ...] = ()
    max: tuple[str, ...] = ()
    min: tuple[str, ...] = ()
    series: tuple[str, ...] = ()
    events: tuple[str, ...] = ()
    at_events: tuple[str, ...] = ()
    reach: Mapping[str, float] | None = None
    balances: bool = True
    """True if the errors of the balances are kept."""

    @property
    def single(self) -> dict[str, tuple[str, str]]:
        """Quantity and kind of each column with one number for each run and quantity, by the name of the column."""
        return {f"{name}_{which}": (name, which) for which in SINGLE_COLUMNS for name in getattr(self, which)}


def end_of(run: Trajectory) -> dict[str, Any]:
    """Return the entries of END_COLUMNS for a run, without its balances."""
    steps = run.result.counters.steps
    return {"status": run.status, "reason": run.reason, "time_reached": run.result.t, "steps": steps}


def balances_of(run: Trajectory, balances: Audit) -> dict[str, Any]:
    """Return the entries of END_COLUMNS for the balances of a run."""
    destroys = balances.destroys or entropy_destroyed(run.jumps) > 0
    return {**{name: getattr(balances, name) for name in BALANCES}, "destroys_entropy": destroys}


def keep_of(section: KeepSection | None, system: System) -> Keep:
    """Return the selection of a section, by default all ends, extremes and events; InputError for an unknown name."""
    # Events after which a run goes on are kinks and edges; terminal ones are reasons of ends.
    kinks = [margin.name for margin in system.event_margins if not (margin.terminal or margin.peak)]
    events = [*dict.fromkeys([*kinks, *(edge.name for edge in system.edges)])]
    known = {"quantities": [*quantities(system)], "events": events, "states": [*system.own_states]}
    if section is None:
        every = tuple(known["quantities"])
        return Keep(last=every, max=every, min=every, events=tuple(events))
    kinds = dict.fromkeys(("last", "max", "min", "series"), "quantities") | {"events": "events", "at_events": "states"}
    found: dict[str, tuple[str, ...]] = {}
    for key, kind in kinds.items():
        given = getattr(section, key)
        found[key] = tuple(known[kind] if given == ALL else given)
        refuse_unknown(found[key], known[kind], f"no {kind} are called '{{}}'", section.place(key))
    refuse_unknown(section.reach, known["quantities"], "nothing in this case is called '{}'", section.place("reach"))
    return Keep(**found, reach=dict(section.reach), balances=section.balances == ALL)


def reaching(system: System, keep: Keep) -> System:
    """Return the system with margins that locate when quantities reach the values to be kept, and without a ledger if
    no balances are kept.
    """
    symbols = {state.name: state.symbol for state in system.states}
    margins = []
    for name, value in (keep.reach or {}).items():
        expression = symbols.get(name) or system.find(name).expression
        margins.append(Margin(f"{REACHES}{name}", expression - value, f"{name} reaches {value:g}", terminal=False))
    ledger = system.ledger if keep.balances else ()
    return replace(system, margins=(*system.margins, *margins), ledger=ledger)


def reason_table(system: System) -> list[str]:
    """Return the reasons for the ends of runs, in the order of their codes."""
    margins = system.event_margins
    ends = [text for margin in margins for text in (margin.reason, *(margin.below or ("", ""))[1:]) if text]
    failures = [text for status, text in REASONS.items() if not status.success]
    edges = [edge.reason for edge in system.edges]
    diverging = [
        f"{name} {how}"
        for state in system.own_states.values()
        for name in (state.name, state.at_start[0].name)
        for how in (RUNS_AWAY, GROWS)
    ]
    first = REASONS[Status.FINISHED], INADMISSIBLE
    return list(dict.fromkeys([*first, *ends, *edges, *diverging, *failures, OTHER_REASON]))


def variable(name: str) -> str:
    """Return the name of an event as part of a variable name.

    >>> variable("g_n > 0")
    'g_n_0'
    """
    return re.sub(r"\W+", "_", name).strip("_")


def described(system: System, keep: Keep) -> dict[str, tuple[str, str, str]]:
    """Return type, unit and meaning of every column except the series, by name."""
    q = quantities(system)
    codes = {"status": "int8", "reason": "int16", "steps": "int32"}
    found = {
        name: (codes.get(name, "float64"), "s" if name == "time_reached" else "1", text)
        for name, text in END_COLUMNS.items()
        if name != "destroys_entropy"  # of the runs that are checked alone
        and (keep.balances or name not in BALANCES)
    }
    for column, (name, which) in keep.single.items():
        found[column] = ("float64", q[name].unit, f"{q[name].long_name} {SINGLE_COLUMNS[which]}")
    for name in keep.events:
        found[f"time_{variable(name)}"] = ("float64", "s", f"first time of the event {name}")
        for state in keep.at_events:
            text = f"{q[state].long_name} before the event {name}"
            found[f"{state}_at_{variable(name)}"] = ("float64", q[state].unit, text)
    for name, value in (keep.reach or {}).items():
        text = f"{value:g} {q[name].unit}".removesuffix(" 1")
        found[f"time_to_{name}"] = ("float64", "s", f"time to {name} = {text}")
    return found


def at_end(run: Trajectory) -> dict[str, float]:
    """Return states and named quantities at the end of a run by name, also where the end is no output."""
    result, model = run.result, run.model
    t, y, ydot = np.array([result.t]), result.y[None], result.ydot[None]
    rows = model.inputs(result, t, y, ydot)
    if result.status is Status.FINISHED:  # rates from the equations, as at outputs
        put_rates(model.program, rows)
    return dict(zip(model.system.variable_names, [*result.y, *model.named(rows)[0]], strict=True))


def extremes(run: Trajectory) -> dict[str, dict[str, float]]:
    """Return the largest and smallest value of each quantity over outputs and steps of a run, and after its jumps."""
    leaps, names = run.discontinuities, run.model.system.variable_names
    after = np.array([leaps.after[name][leaps.last] for name in names])
    seen = np.concatenate([*(table.T for table in run.tables), after], axis=1)
    with np.errstate(invalid="ignore"):
        found = {which: best.reduce(seen, axis=1, initial=np.nan) for which, (best, _) in EXTREMES.items()}
    return {which: dict(zip(names, values.tolist(), strict=True)) for which, values in found.items()}


def crossed(before: NDArray[Any], after: NDArray[Any], level: float) -> NDArray[np.bool_]:
    """True for each jump that carries a quantity across a level, or onto it."""
    return ((before < level) & (after >= level)) | ((before > level) & (after <= level))


def begins(distance: NDArray[Any], level: float) -> NDArray[np.bool_]:
    """True where a quantity at this distance from a level is on it at the start, but for roundoff."""
    found: NDArray[np.bool_] = np.abs(distance) <= GUARD_EPS * abs(level)
    return found


class RunByRun:
    """Columns of runs that are solved and evaluated one after the other: any scene, any end."""

    def __init__(self, model: Model, keep: Keep, steady: bool = False) -> None:
        self.model, self.keep = model, keep
        self.reasons = [*reason_table(model.system), *((STEADY_STATE, NO_STEADY_STATE) if steady else ())]

    def columns(self, runs: Sequence[Trajectory | str], times: int, audits: Sequence[Audit] = ()) -> Columns:
        """Return the kept columns of runs with ``times`` output times; ``audits`` saves a second audit. A failed or
        refused run is given by its reason.
        """
        found = [run for run in runs if not isinstance(run, str)]
        balances = iter(audits or map(audit, found) if self.keep.balances else [None] * len(found))
        codes = {reason: STATUSES.index("refused" if reason == INADMISSIBLE else "failed") for reason in self.reasons}
        rows = [
            {"status": codes[run], "reason": self.reasons.index(run), "steps": 0}
            if isinstance(run, str)
            else self._kept(run, next(balances), times)
            for run in runs
        ]
        kinds = {name: kind for name, (kind, _, _) in described(self.model.system, self.keep).items()}
        kept: Columns = {name: np.array([row.get(name, np.nan) for row in rows], kind) for name, kind in kinds.items()}
        for name in self.keep.series:
            nothing = np.full(times, np.nan)
            kept[name] = np.array([row.get(name, nothing) for row in rows])
        return kept

    def _kept(self, run: Trajectory, balances: Audit | None, times: int) -> dict[str, Any]:
        result, keep = run.result, self.keep
        # Reasons of runs end with times and numbers, which are no part of the code.
        reason = max((text for text in self.reasons if run.reason.startswith(text)), key=len, default=OTHER_REASON)
        row = end_of(run) | {"status": STATUSES.index(run.status), "reason": self.reasons.index(reason)}
        row |= balances_of(run, balances) if balances else {}
        last = at_end(run) if keep.last else {}
        row |= {f"{name}_last": last[name] for name in keep.last}
        found = extremes(run) if keep.max or keep.min else {}
        row |= {f"{name}_{which}": of[name] for which, of in found.items() for name in getattr(keep, which)}
        for name in keep.series:
            row[name] = np.append(run.column(name)[0], np.full(times - len(result.times), np.nan))
        return row | self._events(run)

    def _events(self, run: Trajectory) -> dict[str, float]:
        """Return the first time of each event, and of each value that is reached, by column."""
        row: dict[str, float] = {}
        # Events are in order of time, so that the first of a name counts.
        columns = self.model.system.state_columns
        reached = {f"{REACHES}{name}": f"time_to_{name}" for name in self.keep.reach or {}}
        for event in events_of(run) if self.keep.events or reached else ():
            if event.name in reached:
                row.setdefault(reached[event.name], event.t)
            elif (name := variable(event.name)) and f"time_{name}" not in row:
                row[f"time_{name}"] = event.t
                row |= {f"{state}_at_{name}": event.before[columns[state]] for state in self.keep.at_events}
        for name, level in (self.keep.reach or {}).items():
            start, leaps, column = run.column(name)[0][:1], run.discontinuities, f"time_to_{name}"
            leapt = leaps.t[crossed(leaps.before[name], leaps.after[name], level)]
            if begins(start - level, level).any():
                row[column] = 0.0
            elif len(leapt):
                row[column] = min(row.get(column, np.inf), float(leapt[0]))
        return row
