"""The default solver: compiled Radau IIA of adaptive order 5, 9, 13; single runs, batches, and consistent states."""

import threading
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import cache, lru_cache, partial
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfacechem.compile.program import MOST_RATE_STATES, Program
from surfacechem.solve.contract import (
    Array,
    Counters,
    EdgeCourse,
    EdgeTables,
    Events,
    Guard,
    Points,
    Problem,
    Result,
    Solver,
    States,
    Status,
)
from surfacechem.solve.radau import stepper
from surfacechem.solve.radau.stepper import (
    ARCS,
    COLUMNS,
    EDGE_WORDS,
    END,
    EVENTS,
    FIRST_COUNTER,
    INSIDE,
    JUMPS,
    OUTPUTS,
    RECORDS,
    STOP,
    Batch,
)

STEP_ROWS, EVENT_ROWS, INSIDE_ROWS = 512, 64, 4096
"""Room for steps, events and states inside steps of each of many runs, whose tables lie far apart in memory."""
ALONE_ROWS = 1024
"""Room for the steps, and as many events, of a run that is alone, a choice: what it does not write to costs nothing."""
Room: TypeAlias = tuple[int, int, int, int]
"""Numbers of steps, events, stored states inside steps, and jumps for which a run has memory."""
CHUNK = 256
"""Runs that a thread takes at a time."""
_STATUSES = tuple(Status)
_floats = partial(np.ascontiguousarray, dtype=float)


@lru_cache(maxsize=256)
def _kinds(margins: tuple[Guard, ...], active: tuple[bool, ...] | None = None) -> NDArray[np.int64]:
    flags = active or (True,) * len(margins)
    rows = [(*margin, is_active) for margin, is_active in zip(margins, flags, strict=True)]
    return np.array(rows, np.int64).reshape(-1, 6)


@lru_cache(maxsize=4)
def _no_rows(runs: int) -> Array:
    return np.empty((runs, 0, 0))


@lru_cache(maxsize=64)
def _zeros(count: int) -> Array:
    """Return cached zeros that nothing writes to: a run may take less time than allocating them."""
    return np.zeros(count)


def peaks_before(problem: Problem) -> Array:
    """Return the largest accounts and guards, and the extremes, of the part that a problem continues; zeros if none."""
    accounts, guards = problem.exchanged, problem.margin_peaks
    none, unseen = _zeros(problem.program.n_ledger), _zeros(problem.program.n_margins)
    if accounts is None and guards is None:
        return _zeros(len(none) + len(unseen))
    extremes = (problem.extremes.ravel(),) if problem.extremes is not None else ()
    return np.concatenate((none if accounts is None else accounts, unseen if guards is None else guards, *extremes))


NO_WORDS = np.zeros(EDGE_WORDS, np.int64)
"""Addresses and lengths of tables without edges."""


def _with_edges(tables: Sequence[NDArray[Any]], edges: EdgeTables | None) -> Sequence[NDArray[Any]]:
    """Return the tables of a program, with those of edges."""
    if edges is None:
        return *tables, NO_WORDS
    sizes, code, *others = tables
    sizes, code = sizes.copy(), np.concatenate([code, edges.code])
    sizes[-3:] = edges.sizes
    return sizes, code, *others, edges.words


def _usual_room(problem: Problem, steps: int, events: int) -> Room:
    ends = problem.edges is None and all(margin.terminal for margin in problem.margins)
    # Pages that are never read are cleared all the same.
    rows = min(events, len(problem.margins)) if ends else events
    return steps * problem.record_steps, rows, INSIDE_ROWS * bool(problem.line_error), events


def batch_of(
    problem: Problem,
    runs: Sequence[Array],
    room: Room | None = None,
    tables: Sequence[NDArray[Any]] | None = None,
    max_steps: Sequence[int] = (),
) -> Any:
    """Return a batch of runs of a problem.

    The runs share with it all but their y0, parameters, spacing, peaks, segments and times, which are given in this
    order with the run as first axis. ``room``, ``tables`` and ``max_steps`` replace the usual memory, the program's
    tables and the limit of the problem.
    """
    program, times = problem.program, runs[-1]
    explicit = tables is None and problem.explicit and program.rates is not None
    n, q, m, count = program.n, program.n_ledger, program.n_margins, len(runs[0])
    arcs = jumps = _no_rows(count)
    step_rows, event_rows, rows, jump_rows = room or _usual_room(problem, STEP_ROWS, EVENT_ROWS)
    if problem.edges is not None:
        arcs = np.empty((count, event_rows + len(problem.parameters), 5 + program.n_parameters))
        jumps = np.empty((count, jump_rows, 3 + problem.edges.sizes[0] + 2 * program.n_inputs))
    return Batch(
        *_with_edges(tables or (program.explicit_tables if explicit else program.tables), problem.edges),
        np.array((problem.rtol, explicit, problem.continued, problem.line_error, problem.elapsed)),
        _floats(problem.atol),
        _kinds(problem.margins, problem.active),
        np.array(max_steps or (problem.max_steps,)),
        *runs,
        np.empty((count, 1 + 2 * n + q + m)),
        np.zeros((count, COLUMNS), np.int64),
        np.empty((count, times.shape[1], n + q)),
        np.empty((count, step_rows, 1 + 2 * n + q)) if step_rows else _no_rows(count),
        np.empty((count, event_rows, 2 + 2 * n + q)) if event_rows else _no_rows(count),
        np.empty((count, rows, n + q)) if problem.line_error else _no_rows(count),
        np.empty((count, rows)),
        arcs,
        jumps,
    )


def _run_one(problem: Problem, room: Room | None = None) -> Any:
    """Run a batch of one; the compiled loop checks the stop flag before every step."""
    y0, parameters, segments, times = (
        _floats(values)[None] for values in (problem.y0, problem.parameters, problem.segments, problem.times)
    )
    columns = y0, parameters, np.array((problem.spacing,)), peaks_before(problem)[None], segments, times
    batch = batch_of(problem, columns, room or _usual_room(problem, ALONE_ROWS, ALONE_ROWS))
    if problem.max_seconds is None:
        stepper.LOOP.run(batch)
        return batch
    timer = threading.Timer(problem.max_seconds, batch.counts[:, STOP].fill, args=(1,))
    timer.start()
    try:
        stepper.LOOP.run(batch)
    finally:
        timer.cancel()
    return batch


def _points(rows: Array, n: int) -> tuple[Array, Array, Array, Array]:
    return rows[:, 0], rows[:, 1 : 1 + n], rows[:, 1 + n : 1 + 2 * n], rows[:, 1 + 2 * n :]


class Radau(Solver):
    """Radau IIA with 3, 5 or 7 stages, chosen by tolerance and by the convergence of Newton's method.

    Source: Hairer & Wanner (1999), Stiff differential equations solved by Radau methods, J. Comput. Appl. Math. 111.
    """

    name = "radau"
    crosses_edges = True

    def prepare(self) -> None:
        stepper.LOOP.load()

    def solve(self, problem: Problem) -> Result:
        return _whole(problem, _run_one(problem), 0)

    def solve_all(self, problems: Sequence[Problem], threads: int = 1) -> list[Result]:
        """Solve problems of one model and one tolerance, each with the same result as :meth:`solve`, whatever the
        number of threads; limits in seconds are ignored.
        """
        if len(problems) == 1:
            return [self.solve(problems[0])]
        alike: dict[tuple[Any, ...], list[int]] = {}
        for i, problem in enumerate(problems):
            # Common to the problems of a batch, in addition to the model and its margins.
            shape = len(problem.segments), problem.atol.tobytes(), problem.rtol
            interior = problem.line_error and (problem.line_error, problem.elapsed)
            alike.setdefault((*shape, problem.active, problem.continued, interior, bool(problem.edges)), []).append(i)
        most = min(CHUNK, -(-len(problems) // threads))
        chunks = [group[k : k + most] for group in alike.values() for k in range(0, len(group), most)]
        found: dict[int, Result] = {}

        def solve(chunk: list[int]) -> None:
            found.update(zip(chunk, _solved([problems[i] for i in chunk]), strict=True))

        with ThreadPoolExecutor(threads) as pool:
            list((pool.map if len(chunks) > 1 else map)(solve, chunks))
        return [found[i] for i in range(len(problems))]


class Dop853(Radau):
    """Explicit steps of order 8 as long as the equations give their rates and are not stiff, then steps of Radau IIA.

    Source: Hairer, Norsett & Wanner, Solving Ordinary Differential Equations I, section II.5, and its program DOP853.
    """

    name = "dop853"

    def solve(self, problem: Problem) -> Result:
        return super().solve(problem if problem.explicit else replace(problem, explicit=True))

    def solve_all(self, problems: Sequence[Problem], threads: int = 1) -> list[Result]:
        return super().solve_all([replace(problem, explicit=True) for problem in problems], threads)


def _solved(problems: Sequence[Problem]) -> list[Result]:
    """Solve problems of one model and one shape."""

    def shared(rows: Sequence[Array] | Array) -> Array:
        """Return a single row if all problems have the same, else a row for each."""
        alike = all(np.array_equal(values, rows[0]) for values in rows[1:])
        return _floats(rows[0])[None] if alike else np.array(rows, dtype=float)

    own = [(each.y0, each.parameters, each.spacing, peaks_before(each)) for each in problems]
    y0, parameters, spacing, peaks = (np.array(values, float) for values in zip(*own, strict=True))
    most = max(len(each.times) for each in problems)
    # Outputs are padded with infinite times, which no run reaches.
    times = np.full((len(problems), most), np.inf)
    for row, each in zip(times, problems, strict=True):
        row[: len(each.times)] = each.times
    segments = shared([each.segments for each in problems])
    columns = y0, parameters, spacing, peaks, segments, shared(times)
    batch = batch_of(problems[0], columns, max_steps=[each.max_steps for each in problems])
    stepper.LOOP.run(batch)
    return [_whole(problem, batch, i) for i, problem in enumerate(problems)]


def _whole(problem: Problem, batch: Any, i: int) -> Result:
    """Return the result of a run of a batch; if its tables were too short, repeat it with the sizes that it needed.

    A run that was ended by its limit in seconds is repeated for the same number of steps, whatever time that takes.
    """
    repeated, stopped = problem, False
    while True:
        counts: list[int] = batch.counts[i].tolist()
        if counts[END] == Status.STOPPED:
            repeated, stopped = replace(problem, max_seconds=None, max_steps=counts[FIRST_COUNTER]), True
        elif stopped and counts[END] == Status.MAX_STEPS:
            counts[END] = Status.STOPPED
        needed = counts[RECORDS] * problem.record_steps, counts[EVENTS], counts[INSIDE], counts[JUMPS]
        tables = batch.records, batch.events, batch.inside, batch.jumps
        if all(rows <= table.shape[1] for rows, table in zip(needed, tables, strict=True)):
            return _result(problem, batch, i, counts)
        batch, i = _run_one(repeated, needed), 0


def _result(problem: Problem, batch: Any, i: int, counts: Sequence[int]) -> Result:
    program, n = problem.program, problem.program.n
    outputs, end = counts[OUTPUTS], batch.ends[i]
    m = 1 + 2 * n + program.n_ledger
    values = batch.outputs[i, :outputs]
    # Copy the rows of many runs, so that their unused memory is freed.
    kept = np.array if len(batch.counts) > 1 else np.asarray

    def written(table: Array, column: int) -> Array:
        return kept(table[i, : counts[column]])

    inside = written(batch.inside, INSIDE) if problem.line_error else None
    return Result(
        problem=problem,
        status=_STATUSES[counts[END]],
        t=float(end[0]),
        y=end[1 : 1 + n],
        ydot=end[1 + n : 1 + 2 * n],
        ledger=end[1 + 2 * n : m],
        margins=end[m:],
        times=problem.times if outputs == len(problem.times) else problem.times[:outputs],
        outputs=values[:, :n],
        ledger_outputs=values[:, n:],
        events=_events(written(batch.events, EVENTS), n) if counts[EVENTS] else _no_events(n, program.n_ledger),
        counters=Counters(*counts[FIRST_COUNTER:STOP]),
        steps=Points(*_points(written(batch.records, RECORDS), n)) if problem.record_steps else None,
        inside=inside if inside is None else States(written(batch.inside_times, INSIDE), inside[:, :n], inside[:, n:]),
        course=EdgeCourse(written(batch.arcs, ARCS), written(batch.jumps, JUMPS)) if counts[ARCS] else None,
    )


def _events(rows: Array, n: int) -> Events:
    return Events(*_points(rows[:, 1:], n), index=rows[:, 0].astype(np.int64))


@cache
def _no_events(n: int, q: int) -> Events:
    return _events(np.empty((0, 2 + 2 * n + q)), n)


def solve_arrays(problem: Problem, *columns: Array, room: Room | None = None) -> Any:
    """Solve runs that share a problem except y0, parameters, spacing, peaks, segments and times; return the batch.

    These are given in this order with the run as first axis, which has length one where a value is the same for all.
    The rows of the batch are as the stepper writes them; ``room`` replaces the usual memory for each run.
    """
    batch = batch_of(problem, [*map(np.ascontiguousarray, columns)], room)
    stepper.LOOP.run(batch)
    return batch


class Consistent(NamedTuple):
    """States that satisfy G(t, y, ydot) = 0; ``valid`` is False where none was found."""

    y: Array
    ydot: Array
    valid: NDArray[np.bool_]


def search_batch(program: Program, ends: Array, table: Array, counts: NDArray[np.int64]) -> Any:
    """Return the batch whose rows [t | y | ydot] of ``ends`` are made consistent in place.

    ``table`` [row, 1, parameter] may have one row for all; ``counts`` [row, COLUMNS] gets the outcomes under END.
    """
    rows, nothing = np.zeros((1, 0)), _no_rows(len(ends))
    return Batch(
        *program.tables, NO_WORDS,
        np.array((1.0, 0.0, 0.0, 0.0, 0.0)), np.ones(program.n), _kinds(()), np.empty(0, np.int64),
        ends, table, np.zeros(0), rows, rows, rows, ends, counts,
        *(nothing,) * 4, rows, *(nothing,) * 2,
    )  # fmt: skip


def consistent(program: Program, t: ArrayLike, y: ArrayLike, ydot: ArrayLike, parameters: ArrayLike) -> Consistent:
    """Keep the differential variables; find their derivatives and the algebraic variables.

    For one state or an array of states [..., n]; entries of ``ydot`` and of algebraic variables are first guesses;
    parameters are one vector or one for each state.
    """
    values = np.asarray(y, dtype=float)
    n, shape = program.n, values.shape
    ends = np.empty((values.size // n, 1 + 2 * n))
    ends[:, 0] = np.broadcast_to(t, shape[:-1]).reshape(-1)
    ends[:, 1 : 1 + n] = values.reshape(-1, n)
    ends[:, 1 + n :] = np.broadcast_to(ydot, shape).reshape(-1, n)
    table = _floats(parameters).reshape(-1, 1, program.n_parameters) if program.n_parameters else np.zeros((1, 1, 0))
    if len(table) not in (1, len(ends)):
        raise ValueError(f"{len(ends)} states but {len(table)} parameter vectors; one is needed, or one a state.")
    if program.external is not None:
        rows = np.broadcast_to(table[:, 0], (len(ends), program.n_parameters))
        filled = program.filled(np.concatenate([ends, rows], axis=1))
        table = np.ascontiguousarray(filled[:, None, 1 + 2 * n :])
    counts = np.zeros((len(ends), COLUMNS), np.int64)
    stepper.LOOP.run(search_batch(program, ends, table, counts))
    valid = (counts[:, END] == 0).reshape(shape[:-1])
    return Consistent(ends[:, 1 : 1 + n].reshape(shape), ends[:, 1 + n :].reshape(shape), valid)


def put_rates(program: Program, rows: Array) -> None:
    """Write the derivatives of the states, from the equations, into rows of arguments of compiled functions; those of
    the dense output are of one order less.
    """
    n = program.n
    rates = rows[:, 1 + n : 1 + 2 * n]
    rates[:] = 0.0
    # A formula is much faster than a linear system for each row.
    if program.external is None and n <= MOST_RATE_STATES and program.rates is not None:
        rates[:] = program.rates(rows)
    else:
        rates[:] = consistent(program, rows[:, 0], rows[:, 1 : 1 + n], rates, rows[:, 1 + 2 * n :]).ydot
