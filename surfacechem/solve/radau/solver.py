"""The default solver: Radau IIA of adaptive order 5, 9, 13, compiled; single runs, batches, and consistent states."""

import threading
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, fields
from functools import cache, lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfacechem.compile.program import Program
from surfacechem.solve.contract import Array, Counters, Events, Margin, Points, Problem, Result, Solver, Status
from surfacechem.solve.radau import stepper

EVENT_ROWS = 64
STEP_ROWS = 512
CHUNK = 256
"""Runs a thread takes at a time."""
END, OUTPUTS, EVENTS, RECORDS = range(4)
_STATUSES = tuple(Status)
LOOSEST = 3e-5
"""Tolerances above this are taken as this: a step that they allow can be longer than a layer it never sees."""

SPACING, TIMES = 10, 15
"""Where the spacing, and segments and output times, stand among the arguments of the compiled entry point."""


@lru_cache(maxsize=256)
def _kinds(margins: tuple[Margin, ...]) -> NDArray[np.int64]:
    rows = [(margin.terminal, margin.direction, margin.smooth, margin.to_pass) for margin in margins]
    return np.array(rows, np.int64).reshape(-1, 4)


class _Tables:
    """Input and output arrays of a batch of runs, in the order of the compiled entry point."""

    def __init__(
        self,
        program: Program,
        y0: Array,
        parameters: Array,
        segments: Array,
        times: Array,
        rtol: float,
        atol: Array,
        margins: tuple[Margin, ...],
        max_steps: int,
        step_rows: int,
        event_rows: int,
        exchanged: Array | None = None,
        seen: Array | None = None,
        goes_on: bool = False,
        spacing: Array | float = np.inf,
    ) -> None:
        runs, n, q = len(y0), program.n, program.n_ledger
        self.stop = np.zeros(1, np.int64)
        self.ends = np.empty((runs, 1 + 2 * n + q + program.n_margins))
        self.counts = np.zeros((runs, 10), np.int64)
        self.outputs = np.empty((runs, times.shape[-1], n + q))
        self.steps = np.empty((runs, step_rows, 1 + 2 * n + q)) if step_rows else _no_rows(runs)
        self.events = np.empty((runs, event_rows, 2 + 2 * n + q)) if event_rows else _no_rows(runs)
        self.own_times = (np.broadcast_to(spacing, (runs,)), segments, times) if segments.ndim == 2 else None
        self.arguments = (
            program.addresses,
            program.algebraic_mask,
            program.chain_table,
            program.ledger_groups,
            np.zeros(q) if exchanged is None else exchanged,
            np.zeros(program.n_margins) if seen is None else seen,
            int(goes_on),
            max_steps,
            self.stop,
            min(rtol, LOOSEST),
            spacing if isinstance(spacing, float) else float(np.min(spacing)),
            atol,
            _kinds(margins),
            y0,
            parameters,
            segments,
            times,
            self.ends,
            self.counts,
            self.outputs,
            self.steps,
            self.events,
        )

    def run(self, first: int, last: int) -> None:
        if self.own_times is None:
            stepper.run_batch()(first, last, *self.arguments)
            return
        arguments = list(self.arguments)
        for i in range(first, last):
            arguments[SPACING] = float(self.own_times[0][i])
            arguments[TIMES : TIMES + 2] = (own[i] for own in self.own_times[1:])
            stepper.run_batch()(i, i + 1, *arguments)


@lru_cache(maxsize=4)
def _no_rows(runs: int) -> Array:
    return np.empty((runs, 0, 0))


@cache
def _no_accounts() -> NDArray[np.int64]:
    return np.empty(0, np.int64)


def _contiguous(values: ArrayLike) -> Array:
    if isinstance(values, np.ndarray) and values.dtype == np.float64 and values.flags.c_contiguous:
        return values
    return np.ascontiguousarray(values, dtype=float)


def _tables(problem: Problem, step_rows: int, event_rows: int) -> _Tables:
    return _Tables(
        problem.program,
        _contiguous(problem.y0)[None],
        _contiguous(problem.parameters)[None],
        _contiguous(problem.segments),
        _contiguous(problem.times),
        problem.rtol,
        _contiguous(problem.atol),
        problem.margins,
        problem.max_steps,
        step_rows,
        event_rows,
        problem.exchanged,
        problem.seen,
        problem.goes_on,
        problem.spacing,
    )


def _run_timed(tables: _Tables, seconds: float | None) -> list[int]:
    """Run once and count; the compiled loop looks at the stop flag before every step."""
    if seconds is None:
        tables.run(0, 1)
    else:
        timer = threading.Timer(seconds, tables.stop.fill, args=(1,))
        timer.start()
        try:
            tables.run(0, 1)
        finally:
            timer.cancel()
    counts: list[int] = tables.counts[0].tolist()
    return counts


def _points(rows: Array, n: int) -> tuple[Array, Array, Array, Array]:
    return rows[:, 0], rows[:, 1 : 1 + n], rows[:, 1 + n : 1 + 2 * n], rows[:, 1 + 2 * n :]


class Radau(Solver):
    """Radau IIA with 3, 5 or 7 stages, chosen by tolerance and by the convergence of Newton's method.

    Source: Hairer & Wanner (1999), Stiff differential equations solved by Radau methods, J. Comput. Appl. Math. 111.
    """

    name = "radau"

    def prepare(self) -> None:
        stepper.compile_stepper()

    def solve(self, problem: Problem) -> Result:
        rows = STEP_ROWS if problem.record_steps else 0
        tables = _tables(problem, rows, EVENT_ROWS if problem.margins else 0)
        counts = _run_timed(tables, problem.max_seconds)
        while counts[EVENTS] > tables.events.shape[1] or (
            problem.record_steps and counts[RECORDS] > tables.steps.shape[1]
        ):
            # The tables were too short; the run is repeated with the sizes it turned out to need, which a limit in
            # seconds may change.
            tables = _tables(problem, counts[RECORDS] if problem.record_steps else 0, counts[EVENTS])
            counts = _run_timed(tables, problem.max_seconds)
        return _result(problem, tables, counts)


def _result(problem: Problem, tables: _Tables, counts: list[int]) -> Result:
    program, n = problem.program, problem.program.n
    outputs, end = counts[OUTPUTS], tables.ends[0]
    m = 1 + 2 * n + program.n_ledger
    values = tables.outputs[0, :outputs]
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
        events=_events(tables.events[0, : counts[EVENTS]], n) if counts[EVENTS] else _no_events(n, program.n_ledger),
        counters=Counters(*counts[RECORDS + 1 :]),
        steps=Points(*_points(tables.steps[0, : counts[RECORDS]], n)) if problem.record_steps else None,
    )


def _events(found: Array, n: int) -> Events:
    return Events(*_points(found[:, 1:], n), index=found[:, 0].astype(np.int64))


@cache
def _no_events(n: int, q: int) -> Events:
    return Events(*_points(np.empty((0, 1 + 2 * n + q)), n), index=np.empty(0, np.int64))


@dataclass(frozen=True)
class Batch:
    """Ends of many runs; ``outputs[i, :counts[i]]`` are the outputs run i reached, the rest is not set."""

    status: NDArray[np.int64]
    t: Array
    y: Array
    ydot: Array
    ledger: Array
    margins: Array
    outputs: Array
    ledger_outputs: Array
    counts: NDArray[np.int64]
    steps: NDArray[np.int64]
    events: Sequence[Events]
    """Events of each run, where they were asked for."""


def solve_many(
    program: Program,
    y0: ArrayLike,
    parameters: ArrayLike,
    segments: ArrayLike,
    rtol: float,
    atol: ArrayLike,
    *,
    times: ArrayLike = (),
    margins: Sequence[Margin] = (),
    max_steps: int = 100_000,
    threads: int = 1,
    event_rows: int = 0,
    spacing: ArrayLike = np.inf,
) -> Batch:
    """Run a batch of initial values [run, state] and parameters [run, segment, parameter]; independent of the number
    of threads.

    Segments and output times are shared by all runs, or have one row a run, both of them; so may the spacing have.
    Events are recorded where ``event_rows``, the usual number of them, is not zero.
    """
    states, table, breaks, outputs = map(_contiguous, (y0, parameters, segments, times))
    weights = np.broadcast_to(np.asarray(atol, dtype=float), (program.n,))
    own = breaks.ndim == 2
    rows = {len(states), len(table), *((len(breaks), len(outputs)) if own else ())}
    if len(rows) != 1 or outputs.ndim != breaks.ndim:
        counts = f"{len(states)} initial values but {len(table)} parameter tables"
        raise ValueError(f"{counts}; a batch needs one of each a run, and of segments and times too if of either.")
    kinds = tuple(margins)
    for i in range(len(states) if own else min(1, len(states))):  # runs that share times share all that is checked
        when, pieces = (outputs[i], breaks[i]) if own else (outputs, breaks)
        Problem(program, states[i], when, pieces, table[i], rtol, weights, kinds, max_steps)
    while True:
        tables = _Tables(
            program,
            states,
            table,
            breaks,
            outputs,
            rtol,
            np.array(weights),
            kinds,
            max_steps,
            0,
            event_rows,
            spacing=np.asarray(spacing, dtype=float),
        )
        _run_all(tables, len(states), threads)
        most = int(tables.counts[:, EVENTS].max(initial=0))
        if not 0 < event_rows < most:
            return _batch(program, tables)
        event_rows = most


def _run_all(tables: _Tables, runs: int, threads: int) -> None:
    stepper.run_batch()
    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(lambda start: tables.run(start, min(start + CHUNK, runs)), range(0, runs, CHUNK)))


def _batch(program: Program, tables: _Tables) -> Batch:
    n, q = program.n, program.n_ledger
    _, y, ydot, rest = _points(tables.ends, n)
    room = tables.events.shape[1]
    events = zip(tables.events, np.minimum(tables.counts[:, EVENTS], room).tolist(), strict=True)
    return Batch(
        status=tables.counts[:, END],
        t=tables.ends[:, 0],
        y=y,
        ydot=ydot,
        ledger=rest[:, :q],
        margins=rest[:, q:],
        outputs=tables.outputs[:, :, :n],
        ledger_outputs=tables.outputs[:, :, n:],
        counts=tables.counts[:, OUTPUTS],
        steps=tables.counts[:, RECORDS + 1],
        events=[_events(found[:count], n) if count else _no_events(n, q) for found, count in events],
    )


def gathered(batches: Sequence[Batch], order: NDArray[np.int64]) -> Batch:
    """One batch of many; ``order`` is which run each of theirs is, one batch after the other."""
    if len(batches) == 1:
        return batches[0]
    back = np.argsort(order)
    columns = {item.name: [getattr(batch, item.name) for batch in batches] for item in fields(Batch)}
    events = [found for batch in columns.pop("events") for found in batch]
    joined = {name: np.concatenate(parts)[back] for name, parts in columns.items()}
    return Batch(**joined, events=[events[i] for i in back])


@dataclass(frozen=True)
class Consistent:
    """States that satisfy G(t, y, ydot) = 0; ``valid`` is False where none was found."""

    y: Array
    ydot: Array
    valid: NDArray[np.bool_]


def search_arguments(program: Program, ends: Array, table: Array, counts: NDArray[np.int64]) -> tuple[Any, ...]:
    """Arguments of the compiled loop that make rows [t | y | ydot] consistent where they stand.

    ``table`` [row, 1, parameter] may have one row for all; ``counts`` [row, 10] gets the outcomes under END.
    """
    none, nothing = np.zeros(0), _no_rows(len(ends))
    return (
        0, len(ends), program.addresses, program.algebraic_mask, program.chain_table, _no_accounts(), none, none, 0, 0,
        counts[0], 1.0, np.inf, np.ones(program.n), _kinds(()),
        ends, table, none, none, ends, counts, nothing, nothing, nothing,
    )  # fmt: skip


def consistent(program: Program, t: ArrayLike, y: ArrayLike, ydot: ArrayLike, parameters: ArrayLike) -> Consistent:
    """Keep the differential variables; find their derivatives and the algebraic variables.

    For one state or a row of states [..., n]; entries of ``ydot`` and of algebraic variables are first guesses;
    parameters are one vector or one for each state.
    """
    values = np.asarray(y, dtype=float)
    n, shape = program.n, values.shape
    ends = np.empty((values.size // n, 1 + 2 * n))
    ends[:, 0] = np.broadcast_to(t, shape[:-1]).reshape(-1)
    ends[:, 1 : 1 + n] = values.reshape(-1, n)
    ends[:, 1 + n :] = np.broadcast_to(ydot, shape).reshape(-1, n)
    table = (
        _contiguous(parameters).reshape(-1, 1, program.n_parameters) if program.n_parameters else np.zeros((1, 1, 0))
    )
    if len(table) not in (1, len(ends)):
        raise ValueError(f"{len(ends)} states but {len(table)} parameter vectors; one is needed, or one a state.")
    if program.filler is not None:
        rows = np.broadcast_to(table[:, 0], (len(ends), program.n_parameters))
        filled = program.filled(np.concatenate([ends, rows], axis=1))
        table = np.ascontiguousarray(filled[:, None, 1 + 2 * n :])
    counts = np.zeros((len(ends), 10), np.int64)
    stepper.run_batch()(*search_arguments(program, ends, table, counts))
    valid = (counts[:, END] == 0).reshape(shape[:-1])
    return Consistent(ends[:, 1 : 1 + n].reshape(shape), ends[:, 1 + n :].reshape(shape), valid)
