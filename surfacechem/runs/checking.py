"""Errors of the runs of a store: of a sample spread evenly over its plan, and of the runs with the most steps, each
found as for a single run.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from surfacechem.errors import InputError
from surfacechem.format.plans import permuted
from surfacechem.results.error_estimates import state_floors
from surfacechem.results.store import StoredArray
from surfacechem.runs.keeping import BALANCES, END_COLUMNS, EXTREMES, STATUSES, Keep, RunByRun
from surfacechem.runs.sweeps import SweepAccuracy, SweepSolution, unknown_in
from surfacechem.solve.contract import Index
from surfacechem.solve.radau.outputs import POLYNOMIAL_ERROR
from surfacechem.tolerances import EPS, ERROR_FLOOR, FINER_BY, LINE_ERROR, RUN_ERROR, TINY

if TYPE_CHECKING:
    from surfacechem.runs.streaming import ChunkRuns, Stream

Array = NDArray[Any]

HARDEST_RUNS = 100
"""Runs with the most steps that are checked in addition to the sample of the plan."""

RUNS_AT_ONCE = 50
"""Runs that are checked together, with all their steps in memory: up to some 10 MB a run. More are no faster."""

BALANCE_COLUMNS = (*BALANCES, "destroys_entropy")

CHECKED_COLUMNS = {
    "run": ("int64", "number of the run in the plan, the last dimension fastest; -1 for none"),
    "error": ("float64", "largest relative error of the run"),
    **{name: ("float64", END_COLUMNS[name]) for name in BALANCE_COLUMNS},
}
"""Columns that are stored for each checked run: type and meaning."""


@dataclass(frozen=True)
class Checked:
    """Result of a check: the largest known error, the number of unknown ones, and the source of the errors."""

    error: float
    unknown: int
    count: int
    destroys: int
    """Number of runs in which a law or a jump destroys entropy."""
    source: str
    why: str
    """Reason why an error is unknown, from one of the runs with an unknown error."""

    def __str__(self) -> str:
        """The errors in words."""
        known = f"{self.error:.2g} of {self.count} runs ({self.source})" if self.unknown < self.count else ""
        unknown = unknown_in(self.unknown, self.why)
        return "; ".join(filter(None, (known, unknown)))


def checked_arrays(size: int, count: int) -> tuple[dict[str, int], dict[str, StoredArray]]:
    """Return dimensions and arrays of the checked runs in a store of ``size`` runs."""
    sizes = {"checked": min(count, size), "hardest": min(HARDEST_RUNS, size)} if count else {}
    arrays = {
        f"{which}_{key}": StoredArray(kind, (which,), {"units": "1", "long_name": text})
        for which in sizes
        for key, (kind, text) in CHECKED_COLUMNS.items()
    }
    return sizes, arrays


def check(stream: Stream, threads: int | None = None) -> Checked | None:
    """Find and store the errors of the checked runs, once every chunk is there; None before."""
    store, plan = stream.store, stream.chunks.plan
    sizes = {name: store.layout.sizes[name] for name in ("checked", "hardest") if name in store.layout.sizes}
    if not sizes or not all((store.marks / str(number)).exists() for number in range(store.layout.chunks)):
        return None
    chosen = {"checked": np.sort(permuted(np.arange(sizes["checked"]), plan.size, 0)), "hardest": _hardest(stream)}
    # A fixed permutation of the plan spreads the sample evenly and is the same for every writer.
    found: dict[str, Array] = {}
    every: list[SweepAccuracy] = []
    for which, index in chosen.items():
        columns, accuracies = _columns(stream, index, sizes[which], threads)
        found |= {f"{which}_{key}": values for key, values in columns.items()}
        every += accuracies
    store.write_unchunked(found)
    keys = "run", "error", "destroys_entropy"
    numbers, errors, destroys = (np.concatenate([found[f"{which}_{key}"] for which in chosen]) for key in keys)
    numbers, once = np.unique(numbers, return_index=True)
    once = once[numbers >= 0]  # -1 fills up the hardest runs where fewer succeeded
    errors, destroys = errors[once], np.nansum(destroys[once])
    worst = float(np.fmax.reduce(errors, initial=-np.inf))
    # One source per method: the reason against an exact solution, after the semicolon, differs from run to run.
    sources = {each.source.partition(";")[0]: each.source for each in sorted(every, key=lambda each: len(each.source))}
    why = next((why for each in every for why in each.reasons if why), "")
    return Checked(worst, int(np.isnan(errors).sum()), len(errors), int(destroys), "; ".join(sources.values()), why)


def _columns(
    stream: Stream, index: Index, size: int, threads: int | None
) -> tuple[dict[str, Array], list[SweepAccuracy]]:
    """Return the arrays of the runs with these numbers, and the accuracies of their portions."""
    columns, every = {key: np.full(size, np.nan) for key in CHECKED_COLUMNS}, []
    columns["run"] = np.append(index, np.full(size - len(index), -1))
    for first, part, errors, accuracy in _errors(stream, index, threads):
        for key, values in errors.items():
            columns[key][first : first + len(part)] = values
        every.append(accuracy)
    return columns, every


def _hardest(stream: Stream) -> Index:
    """Return the numbers of the runs with the most steps that did not fail, in ascending order."""
    steps, numbers = np.empty(0, np.int64), np.empty(0, np.int64)
    for number in range(stream.store.layout.chunks):
        taken, status = stream.store.read("steps", number), stream.store.read("status", number)
        went = status < STATUSES.index("failed")
        steps, numbers = (
            np.concatenate([steps, taken[went]]),
            np.concatenate([numbers, stream.store.layout.index(number)[went]]),
        )
        # Ties go to the first run of the plan, so that the choice is unique.
        best = np.lexsort((numbers, -steps))[:HARDEST_RUNS]
        steps, numbers = steps[best], numbers[best]
    return np.sort(numbers)


def _errors(
    stream: Stream, index: Index, threads: int | None
) -> Iterator[tuple[int, Index, dict[str, Any], SweepAccuracy]]:
    """Yield errors and balances of runs solved by themselves, a portion at a time; nothing for an inadmissible run."""
    chunks = stream.chunks
    # No outputs are shown. Extremes lie between the steps, too.
    looks = LINE_ERROR / FINER_BY**2 if chunks.keep.max or chunks.keep.min else 0.0
    even = replace(chunks.simulation.case.run, picture=None, looks=looks)
    for first in range(0, len(index), RUNS_AT_ONCE):
        part = index[first : first + RUNS_AT_ONCE]
        try:
            done = chunks.simulation.sweep_plan(chunks.plan.picked(part), chunks.changes, threads, even)
        except InputError:
            # One of them is refused: solve each alone, so that the others get an error.
            if len(part) > 1:
                for k, one in enumerate(part.tolist()):
                    for _, single, errors, accuracy in _errors(stream, np.array([one]), threads):
                        yield first + k, single, errors, accuracy
            continue
        assert done.accuracy is not None
        values = {name: [end[name] for end in done.run_ends] for name in BALANCE_COLUMNS}
        found = np.maximum(done.accuracy.errors, _apart(chunks, part, done))  # NaN, an unknown error, stays NaN
        accuracy = done.accuracy
        del done  # before the next ones are solved
        yield first, part, {"error": found, **values}, accuracy


def _least_sizes(chunks: ChunkRuns, done: SweepSolution, ends: Mapping[str, Array]) -> Mapping[str, Any]:
    """Return by column what a difference is relative to at least: of states their absolute tolerance, of others a small
    part of the largest one.
    """
    kept, system = chunks.keep, chunks.model.system
    last = {f"{name}_last": column for name, column in system.state_columns.items() if name in kept.last}
    if chunks.run.steady:
        return {name: system.states[column].scale for name, column in last.items()}
    floors = np.array([state_floors(run.stored) for run in done.runs])
    least = {at: ERROR_FLOOR * np.nanmax(np.abs(ends[at]), initial=TINY) for at in ("time_reached", *kept.single)}
    return least | {name: floors[:, column] for name, column in last.items()}


def _apart(chunks: ChunkRuns, part: Index, done: SweepSolution) -> Array:
    """Return the difference between the stored ends of runs and the ends of the same runs solved by themselves, beyond
    roundoff: of states relative to the latter, above their absolute tolerances, of other variables, such as fluxes that
    vanish at rest, relative to their largest values over the run. The same for stored extremes, which those of all
    states that the latter pass through, inside their steps too, may exceed.

    For a run stopped by an event only the time counts: there the state may change by any amount within the last digit
    of the time. Runs to a steady state, solved by themselves, all last as long as the slowest of them: only their
    states are compared, relative to their scales at least.
    """
    kept, states = chunks.keep, chunks.model.system.state_columns
    wide = {column: name for column, (name, which) in kept.single.items() if which != "last" or name not in states}
    keep = Keep(last=kept.last, max=(*wide.values(),), min=(*wide.values(),))
    ends = RunByRun(chunks.model, keep).columns([run.stored for run in done.runs], 0, done.audits)
    over_run = {at: np.fmax(np.abs(ends[f"{name}_max"]), np.abs(ends[f"{name}_min"])) for at, name in wide.items()}
    stored, largest, least = chunks.columns(part), np.zeros(len(part)), _least_sizes(chunks, done, ends)
    rounded = [run.sample.roundings for run in done.runs]
    # Inside steps the states have the error of their polynomial, which is an error of the runs that is known.
    inside = dict.fromkeys(EXTREMES, max(RUN_ERROR, POLYNOMIAL_ERROR * chunks.run.rtol / EPS))
    for name, floor in least.items():
        size = np.fmax(np.abs(ends[name]), np.fmax(over_run.get(name, 0.0), floor))
        of, _, which = name.rpartition("_")
        known = inside.get(which, RUN_ERROR) * np.array([each.get(of, 0.0) for each in rounded])
        apart = np.nan_to_num(np.fmax(np.abs(stored[name] - ends[name]) - known, 0.0) / size)
        apart[np.isnan(stored[name]) != np.isnan(ends[name])] = np.inf
        counts = (name == "time_reached") | (ends["status"] == STATUSES.index("finished"))
        largest = np.maximum(largest, np.where(counts, apart, 0.0))
    return largest
