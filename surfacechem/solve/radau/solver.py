"""The default solver: Radau IIA of adaptive order 5, 9, 13, compiled; single runs, batches, and consistent states."""

import threading
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
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
def _kinds(margins: tuple[Margin, ...], in_play: tuple[bool, ...] | None = None) -> NDArray[np.int64]:
    playing = in_play or (True,) * len(margins)
    rows = [(m.terminal, m.direction, m.smooth, m.strict, plays) for m, plays in zip(margins, playing, strict=True)]
    return np.array(rows, np.int64).reshape(-1, 5)


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
        in_play: tuple[bool, ...] | None = None,
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
            _kinds(margins, in_play),
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


def _tables(problems: Sequence[Problem], step_rows: int, event_rows: int) -> _Tables:
    """Tables of problems with as many segments and output times each."""
    first = problems[0]
    segments, times = _shared([problem.segments for problem in problems], [problem.times for problem in problems])
    return _Tables(
        first.program,
        _stacked([problem.y0 for problem in problems]),
        _stacked([problem.parameters for problem in problems]),
        segments,
        times,
        first.rtol,
        _contiguous(first.atol),
        first.margins,
        first.max_steps,
        step_rows,
        event_rows,
        first.exchanged,
        first.seen,
        first.goes_on,
        _stacked([problem.spacing for problem in problems]) if segments.ndim == 2 else first.spacing,
        first.in_play,
    )


def _stacked(rows: Sequence[Any]) -> Array:
    """Values of each problem below each other, without a copy of those of one."""
    return _contiguous(rows[0])[None] if len(rows) == 1 else np.array(rows, dtype=float)


def _shared(*columns: Sequence[Array]) -> list[Array]:
    """Values that all problems have in common, or those of each where they differ in any."""
    alike = all(np.array_equal(values, rows[0]) for rows in columns for values in rows[1:])
    return [_contiguous(rows[0]) if alike else np.array(rows, dtype=float) for rows in columns]


def _run_timed(tables: _Tables, seconds: float | None) -> None:
    """Run once; the compiled loop looks at the stop flag before every step."""
    if seconds is None:
        tables.run(0, 1)
    else:
        timer = threading.Timer(seconds, tables.stop.fill, args=(1,))
        timer.start()
        try:
            tables.run(0, 1)
        finally:
            timer.cancel()


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
        tables = _tables([problem], *_usual_rows(problem))
        _run_timed(tables, problem.max_seconds)
        return _whole(problem, tables, 0)

    def solve_all(self, problems: Sequence[Problem], threads: int = 1) -> list[Result]:
        """Results of problems of one model and one tolerance, each the same as that of :meth:`solve`, whatever the
        number of threads; limits in seconds do not count.
        """
        alike: dict[tuple[Any, ...], list[int]] = {}
        for i, problem in enumerate(problems):
            alike.setdefault((len(problem.segments), len(problem.times), problem.in_play), []).append(i)
        chunks = [group[k : k + CHUNK] for group in alike.values() for k in range(0, len(group), CHUNK)]
        self.prepare()
        with ThreadPoolExecutor(threads) as pool:
            spread = pool.map if len(chunks) > 1 else map
            solved = spread(lambda chunk: _solved([problems[i] for i in chunk]), chunks)
            found = {
                i: result
                for chunk, each in zip(chunks, solved, strict=True)
                for i, result in zip(chunk, each, strict=True)
            }
        return [found[i] for i in range(len(problems))]


def _solved(problems: Sequence[Problem]) -> list[Result]:
    tables = _tables(problems, *_usual_rows(problems[0]))
    tables.run(0, len(problems))
    return [_whole(problem, tables, i) for i, problem in enumerate(problems)]


def _whole(problem: Problem, tables: _Tables, i: int) -> Result:
    """The result of a run in tables; where these were too short it is repeated with the sizes it turned out to need,
    which a limit in seconds may change.
    """
    while True:
        needed, records = int(tables.counts[i, EVENTS]), int(tables.counts[i, RECORDS]) if problem.record_steps else 0
        if needed <= tables.events.shape[1] and records <= tables.steps.shape[1]:
            return _result(problem, tables, i)
        tables, i = _tables([problem], records, needed), 0
        _run_timed(tables, problem.max_seconds)


def _usual_rows(problem: Problem) -> tuple[int, int]:
    """Steps and events for which there is room at first."""
    return STEP_ROWS if problem.record_steps else 0, EVENT_ROWS if problem.margins else 0


def _result(problem: Problem, tables: _Tables, i: int) -> Result:
    program, n = problem.program, problem.program.n
    counts: list[int] = tables.counts[i].tolist()
    outputs, end = counts[OUTPUTS], tables.ends[i]
    m = 1 + 2 * n + program.n_ledger
    values = tables.outputs[i, :outputs]
    events, steps = tables.events[i, : counts[EVENTS]], tables.steps[i, : counts[RECORDS]]
    if len(tables.counts) > 1:  # the room for the steps of many runs is not kept for those that they took
        events, steps = events.copy(), steps.copy()
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
        events=_events(events, n) if counts[EVENTS] else _no_events(n, program.n_ledger),
        counters=Counters(*counts[RECORDS + 1 :]),
        steps=Points(*_points(steps, n)) if problem.record_steps else None,
    )


def _events(found: Array, n: int) -> Events:
    return Events(*_points(found[:, 1:], n), index=found[:, 0].astype(np.int64))


@cache
def _no_events(n: int, q: int) -> Events:
    return Events(*_points(np.empty((0, 1 + 2 * n + q)), n), index=np.empty(0, np.int64))


@dataclass(frozen=True)
class Batch:
    """Ends of many runs as arrays; ``outputs[i, :counts[i]]`` are the outputs run i reached, the rest is not set."""

    status: NDArray[np.int64]
    t: Array
    y: Array
    outputs: Array
    ledger_outputs: Array
    counts: NDArray[np.int64]


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
) -> Batch:
    """Run arrays of initial values [run, state] and parameters [run, segment, parameter] that share segments and output
    times, without anything of the way but the outputs; independent of the number of threads.
    """
    states, table, breaks, outputs = map(_contiguous, (y0, parameters, segments, times))
    if len(states) != len(table):
        raise ValueError(
            f"{len(states)} initial values but {len(table)} parameter tables; one of each a run is needed."
        )
    weights, kinds = np.array(np.broadcast_to(np.asarray(atol, dtype=float), (program.n,))), tuple(margins)
    if len(states):  # of what the runs share is checked that it fits together
        Problem(program, states[0], outputs, breaks, table[0], rtol, weights, kinds, max_steps)
    tables = _Tables(program, states, table, breaks, outputs, rtol, weights, kinds, max_steps, 0, 0)
    stepper.run_batch()
    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(lambda i: tables.run(i, min(i + CHUNK, len(states))), range(0, len(states), CHUNK)))
    n = program.n
    return Batch(
        status=tables.counts[:, END],
        t=tables.ends[:, 0],
        y=tables.ends[:, 1 : 1 + n],
        outputs=tables.outputs[:, :, :n],
        ledger_outputs=tables.outputs[:, :, n:],
        counts=tables.counts[:, OUTPUTS],
    )


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
