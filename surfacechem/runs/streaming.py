"""Sweeps of any size: runs are computed in chunks, from the plan to the store, with only current chunks in memory."""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from surfacechem import format as cases
from surfacechem.errors import InputError, Place, refuse_unknown
from surfacechem.format.plans import Plan, recorded_plan
from surfacechem.format.sections import ALL, SweepSection
from surfacechem.results.dataset import quantities
from surfacechem.results.netcdf import CONVENTIONS, COORDINATES, Column, cf_unit, versions
from surfacechem.results.store import Layout, Store, StoredArray, begin, opened, store_path
from surfacechem.runs import checking, keeping, sweeps
from surfacechem.runs.arrays import ArrayRuns, JumpingRuns, cannot_jump, is_array
from surfacechem.runs.at_rest import NoSteadyStateError, refuse_histories, to_steady_state
from surfacechem.runs.checking import Checked, checked_arrays
from surfacechem.runs.keeping import INADMISSIBLE, NO_STEADY_STATE, STATUSES, Columns, Keep, RunByRun, keep_of, variable
from surfacechem.solve import AUTO, EXPLICIT, IMPLICIT
from surfacechem.solve.contract import Index
from surfacechem.solve.lanes import lane_batch
from surfacechem.solve.radau.stepper import Loop
from surfacechem.solve.run import Model, Run, Trajectory

if TYPE_CHECKING:
    from surfacechem.runs.simulation import Simulation


EXPLICIT_RUNS, IMPLICIT_RUNS, JUMPING_RUNS, SLOW_RUNS = 2**18, 2**14, 2**12, 2**9
"""Largest numbers of runs in a chunk, about one or two seconds of work: of runs with explicit steps, with implicit
steps, with jumps, and of runs that are solved one by one.
"""

RUNS_OF_A_PIECE = 2**14
"""Largest number of runs that a thread takes at a time; with far fewer, calls of NumPy and waiting threads cost time,
with far more, arrays leave the cache.
"""


class ChunkRuns:
    """The runs of a plan, computed in any order and in parts of any size, as columns of the kept results."""

    def __init__(
        self,
        simulation: Simulation,
        plan: Plan,
        keep: Keep,
        changes: Mapping[str, float],
        checked: int = 0,
        run: Run | None = None,
    ) -> None:
        self.simulation, self.plan, self.keep = simulation, plan, keep
        self.changes, self.checked = changes, checked
        self.model = Model(keeping.reaching(sweeps.prepared(simulation.system, plan), keep))
        case = simulation.case
        # If the case names no solver, the one that suits the scene.
        asked = case.run if "run.solver" in case.places else replace(case.run, solver=AUTO)
        self.automatic = asked.solver == AUTO
        chosen = run or self.model.chosen(asked, self.model.values(changes))
        self.run = sweeps.following(self.model, plan, chosen, changes) if keep.series and run is None else chosen
        self.one_by_one = RunByRun(self.model, keep, chosen.steady)
        arrays = ArrayRuns(self.model, plan, self.run, changes, keep, self.automatic)
        is_vector = is_array(self.model, plan, self.run, arrays.problem)
        self.solvers = [arrays] if is_vector and cannot_jump(self.model, arrays.problem) else []
        if is_vector and self.model.system.edges:
            self.solvers.append(JumpingRuns(self.model, plan, self.run, changes, keep, self.automatic))
        """Ways to compute runs as arrays, in the order in which they are tried; the rest is solved run by run."""
        self.arrays = arrays if self.solvers else None

    @cached_property
    def record(self) -> tuple[str, str, str]:
        """Plan, kept results and changes as text."""
        return self.plan.record, json.dumps(asdict(self.keep)), json.dumps(dict(self.changes))

    def __reduce__(self) -> tuple[Any, ...]:
        """Return the definition of the sweep, from which a worker computes any of its runs."""
        case = self.simulation.case
        return _runs_of, (case.name, case.text, case.mechanism_text, *self.record, self.run)

    @cached_property
    def lanes(self) -> Loop | None:
        """The method by which eight runs are stepped at once; None if no runs are."""
        return next((next(lane_batch.methods_of(each.problem), None) for each in self.solvers if not each.jumps), None)

    @property
    def steps(self) -> str:
        """How the runs are stepped, in words."""
        if self.lanes is not None:
            return f"eight runs at once, by {self.lanes.title}"
        if self.arrays is None:
            return f"one run after another, each prepared in Python, by {self.run.solver}"
        return f"one run after another in the compiled loop, by {self.run.solver}"

    @property
    def at_once(self) -> int:
        """Largest number of runs in a chunk."""
        if any(solver.problem.explicit and not solver.jumps for solver in self.solvers):
            return EXPLICIT_RUNS
        if all(solver.jumps for solver in self.solvers):
            return JUMPING_RUNS if self.solvers else SLOW_RUNS
        return IMPLICIT_RUNS

    @property
    def waits(self) -> bool:
        """True if the loop that steps eight runs at once has to be compiled before the first of them."""
        return self.lanes is not None and not self.lanes.is_compiled

    @cached_property
    def piece(self) -> int:
        """Number of runs computed at once, small enough that outputs and all derived arrays stay small."""
        return 2**6 if self.arrays is None else int(np.clip(self.arrays.at_once, 2**6, RUNS_OF_A_PIECE))

    def flags(self, name: str) -> dict[str, Any]:
        """Return the attributes with codes and their meanings, if the variable holds codes."""
        words = {"status": STATUSES, "reason": self.one_by_one.reasons}.get(name)
        if words is None:
            return {}
        return {"flag_values": list(range(len(words))), "flag_meanings": " ".join(map(variable, words))}

    def columns(self, index: Index) -> Columns:
        """Compute the kept columns of the runs with these numbers."""
        values = self.plan.at(index)
        times = len(self.run.times)
        columns: Columns = {}
        left = np.arange(len(index))
        for solver in self.solvers:
            done, found = solver.solve({path: column[left] for path, column in values.items()})
            if len(left) == len(index) and done.all():
                return found
            _put(columns, left[done], found, len(index))
            left = left[~done]
            if not len(left):
                return columns
        # Runs that arrays leave open are solved run by run; results do not depend on the other runs of a chunk.
        _put(columns, left, self.one_by_one.columns(self._solved(values, left), times), len(index))
        return columns

    def _solved(self, values: Mapping[str, Any], chosen: Index) -> list[Trajectory | str]:
        """Solve runs one by one; for a run that is inadmissible or reaches no steady state return the reason."""
        points = [{path: float(column[i]) for path, column in values.items()} for i in chosen.tolist()]
        try:  # all in one call of the compiled loop
            full = [self.model.values({**self.changes, **point}) for point in points]
            runs = sweeps.settings(self.model.system, self.plan, self.run, full)
            if self.run.steady:  # each to its steady state, whatever the other runs are
                runs = [to_steady_state(self.model, run, at) for run, at in zip(runs, full, strict=True)]
            return [*map(self._sure, self.model.solve_all(list(zip(runs, full, strict=True))))]
        except InputError as error:
            if len(chosen) == 1:
                return [NO_STEADY_STATE if isinstance(error, NoSteadyStateError) else INADMISSIBLE]
        return [run for i in chosen.tolist() for run in self._solved(values, np.array([i]))]

    def _sure(self, done: Trajectory) -> Trajectory:
        """Repeat a run by implicit steps where explicit ones, chosen by the values of the case, have failed."""
        if done.status == "failed" and self.automatic and done.run.solver == EXPLICIT:
            return self.model.solve_values(replace(done.run, solver=IMPLICIT), done.values)
        return done


def _put(columns: Columns, own: Index, found: Columns, count: int) -> None:
    """Write the columns of the runs ``own`` into the columns of all ``count`` runs."""
    for name, column in found.items():
        nothing = np.nan if column.dtype.kind == "f" else 0
        whole = columns.setdefault(name, np.full((count, *column.shape[1:]), nothing, column.dtype))
        whole[own] = column


# -- a sweep into a store ---------------------------------------------------------------------------------------------


@lru_cache(maxsize=2)
def _runs_of(name: str, text: str, mechanism: str | None, plan: str, keep: str, changes: str, run: Run) -> ChunkRuns:
    """Return the runs of a sweep from their definition as text, in any process."""
    from surfacechem.runs.simulation import Simulation

    case = cases.load_text(text, name, mechanism_text=mechanism, allow_code=True)
    kept: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in json.loads(keep).items()}
    return ChunkRuns(Simulation(case), recorded_plan(plan), Keep(**kept), json.loads(changes), run=run)


@dataclass(frozen=True)
class Progress:
    """Progress of a sweep."""

    runs: int
    done: int
    failed: int
    resumed: int
    """Runs that were stored before."""


@dataclass(frozen=True)
class Stream:
    """A sweep that is written to a store."""

    chunks: ChunkRuns = field(repr=False)
    store: Store
    part: tuple[int, int] = (1, 1)
    resumed: bool = field(default=False, repr=False)
    """True if the store is an earlier one, of which all but its chunks is made anew first."""

    @property
    def numbers(self) -> range:
        """Chunks of this part, at a stride of the number of parts, so that parts take equal time."""
        k, count = self.part
        return range(k - 1, self.store.layout.chunks, count)

    def run(
        self, threads: int | None = None, client: Any = None, on_progress: Callable[[Progress], None] = lambda _: None
    ) -> Store:
        """Compute the missing chunks and store them. With the ``client`` of a dask.distributed cluster its workers
        compute, while this process writes.
        """
        layout, threads = self.store.layout, sweeps.processors(threads)
        with self.store.locked(f"{self.part[0]}-of-{self.part[1]}"):
            if self.resumed:
                self.store.restore()
            numbers = list(self.numbers)
            missing = [number for number in numbers if not self.store.done(number)]
            runs, resumed = layout.runs_of(numbers), layout.runs_of(set(numbers) - set(missing))
            done, failed = resumed, 0
            on_progress(Progress(runs, done, failed, resumed))
            for number, futures in self._computed(missing, threads, client):
                parts = []
                for future in futures:
                    parts.append(columns := future.result())
                    done += len(columns["status"])
                    failed += int(np.sum(columns["status"] >= STATUSES.index("failed")))
                    on_progress(Progress(runs, done, failed, resumed))
                # Only this thread writes, so that chunks and their marks are written in order.
                columns = {name: np.concatenate([each[name] for each in parts]) for name in parts[0]}
                self.store.write(number, columns, threads)
        return self.store

    def check(self, threads: int | None = None) -> Checked | None:
        """Find and store the errors of the checked runs, once every chunk is there; None before."""
        return checking.check(self, threads)

    def _computed(self, numbers: Sequence[int], threads: int, client: Any) -> Iterator[tuple[int, list[Any]]]:
        """Yield the futures of the columns of the parts of chunks, in order; the next chunks are computed meanwhile."""
        pool = ThreadPoolExecutor(threads)

        def submit(part: Index) -> Any:
            if client:
                return client.submit(ChunkRuns.columns, self.chunks, part, pure=False)
            return pool.submit(self.chunks.columns, part)

        ahead = 2 * len(client.scheduler_info()["workers"]) if client else 1
        waiting: deque[tuple[int, list[Any]]] = deque()
        try:
            for number in numbers:
                index = self.store.layout.index(number)
                # The threads share a chunk in parts of equal size.
                rounds = -(-len(index) // (threads * self.chunks.piece))
                size = len(index) if client else -(-len(index) // (threads * rounds))
                parts = [index[first : first + size] for first in range(0, len(index), size)]
                waiting.append((number, [submit(part) for part in parts]))
                if len(waiting) > ahead:
                    yield waiting.popleft()
            while waiting:
                yield waiting.popleft()
        finally:
            # If writing has failed, nothing more is computed in vain.
            for future in (future for _, futures in waiting for future in futures):
                future.cancel()
            pool.shutdown(wait=False, cancel_futures=True)


def failed_runs(path: Path, status: str) -> Plan:
    """Return the plan of the runs of a store with this status; InputError if it has none, or is no store of a sweep."""
    refuse_unknown([status], STATUSES, "no runs are called '{}'", Place(path="--only"))
    data = opened(path)
    if "sweep" not in data.attrs:
        raise InputError("is no store of a sweep.", Place(str(path)))
    codes, plan = data["status"].values.ravel(), recorded_plan(data.attrs["sweep"])
    found = np.flatnonzero(codes == STATUSES.index(status))
    if not len(found):
        raise InputError(f"no run of it is {status}.", Place(str(path)))
    return plan.picked(found)


def steps_of(simulation: Simulation) -> str:
    """Return in words how the runs of the sweep of a case are stepped, if they are written to a store."""
    plan, section = simulation.plan(), simulation.case.sweep or SweepSection()
    simulation, _ = simulation._ready({}, plan)
    return ChunkRuns(simulation, plan, keep_of(section.keep, sweeps.prepared(simulation.system, plan)), {}).steps


def stream(
    simulation: Simulation,
    plan: Plan,
    path: str | Path,
    *,
    changes: Mapping[str, float],
    resume: bool = False,
    part: tuple[int, int] = (1, 1),
) -> Stream:
    """Prepare a sweep into a store, which is created, or opened to be continued."""
    match part:
        case (int(k), int(parts)) if 1 <= k <= parts:
            pass
        case _:
            raise InputError(f"{part} is no part; the first of 16 is (1, 16).", Place(path="part"))
    target, case = store_path(path), simulation.case
    section = case.sweep or SweepSection()
    keep = keep_of(section.keep, sweeps.prepared(simulation.system, plan))
    if case.run.steady:
        refuse_histories(simulation.system)
        if keep.series:
            message = "each run until `steady` has a length of its own, so that no series fit."
            raise InputError(message, path="sweep.keep")
    checked = plan.size if section.checked == ALL else int(section.checked)
    chunks = ChunkRuns(simulation, plan, keep, changes, checked)
    store = begin(target, _layout(chunks), resume or part != (1, 1))
    return Stream(chunks, store, part, resume)


def _layout(chunks: ChunkRuns) -> Layout:
    """Return arrays, coordinates and attributes of the store of a sweep."""
    system, plan, keep = chunks.model.system, chunks.plan, chunks.keep
    names = sweeps.parameter_names(system, plan)
    sizes = sweeps.dimensions(plan, names)
    runs = tuple(sizes)
    variables = {
        name: StoredArray(kind, runs, {"units": cf_unit(unit), "long_name": text, **chunks.flags(name)})
        for name, (kind, unit, text) in keeping.described(system, keep).items()
    }
    coordinates = sweeps.parameter_columns(system, plan, names)
    if keep.series:
        sizes["time"] = len(chunks.run.times)
        coordinates.append(Column("time", ("time",), np.asarray(chunks.run.times), "s", "time since the start"))
    for name in keep.series:
        q = quantities(system)[name]
        attributes = Column(name, (), None, q.unit, q.long_name).attributes
        variables[name] = StoredArray("float64", (*runs, "time"), attributes)
    more, beside = checked_arrays(plan.size, chunks.checked)
    return Layout(sizes | more, runs, variables, beside, coordinates, _attributes(chunks), chunks.at_once)


def _attributes(chunks: ChunkRuns) -> dict[str, Any]:
    """Return the attributes of a store: the same for all writers, and none that changes with time."""
    case, (plan, keep, changes) = chunks.simulation.case, chunks.record
    texts = {"case": case.text, "mechanism": case.mechanism_text}
    return {
        "Conventions": CONVENTIONS,
        "title": case.title,
        "source": case.source or "surfacechem",
        **{name: text for name, text in texts.items() if text},
        "sweep": plan,
        "keep": keep,
        "changes": changes,
        "run": json.dumps({**asdict(chunks.run), "times": list(chunks.run.times)}),
        "runs": chunks.plan.size,
        COORDINATES: " ".join(sweeps.parameter_names(chunks.model.system, chunks.plan)),
        "check": chunks.checked,
        "regime": chunks.model.system.regime,
        "reasons": chunks.one_by_one.reasons,
        "versions": versions(),
    }
