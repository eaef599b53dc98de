"""Batches of runs of one model: eight at once in lanes, and one at a time where lanes do not apply."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from surfacechem.compile.rosenbrock import MOST_NONZEROS
from surfacechem.solve.contract import Array, Problem, Status
from surfacechem.solve.lanes.layout import EXPLICIT_MEMORY, RADAU_MEMORY, ROSENBROCK_MEMORY, SIZES
from surfacechem.solve.radau import stepper
from surfacechem.solve.radau.solver import Room, batch_of, solve_arrays
from surfacechem.solve.radau.stepper import END, Loop
from surfacechem.tolerances import LINEAR_RTOL


def solve_batch(problem: Problem, *columns: Array, room: Room | None = None) -> Any:
    """Solve a batch as :func:`solve_arrays` does, in lanes where the problem may be solved so and has vector code.

    What explicit steps leave is tried by implicit ones, if the problem allows them; what these leave is solved alone.
    """
    methods = methods_of(problem)
    batch = _solved(problem, next(methods, None), columns, room)
    # A method is compiled when runs are left to it.
    while len(left := np.flatnonzero(batch.counts[:, END] == Status.LEFT)):
        own = [rows[left] if len(rows) == len(columns[0]) else rows for rows in columns]
        repeated = _solved(problem, next(methods, None), own, room)
        for name in ("ends", "counts", "outputs", "records", "events"):
            getattr(batch, name)[left] = getattr(repeated, name)
    return batch


def _solved(problem: Problem, method: Loop | None, columns: Sequence[Array], room: Room | None) -> Any:
    """Solve a batch by one method, without one run by run."""
    if method is None:
        return solve_arrays(problem, *columns, room=room)
    lanes = problem.program.lanes if method is EXPLICIT else problem.program.implicit_lanes
    assert lanes is not None
    tables = problem.program.lane_tables(lanes, method is ROSENBROCK)
    batch = batch_of(problem, [*map(np.ascontiguousarray, columns)], room, tables)
    method.run(batch)
    return batch


CODE = "vectors.py", "rosenbrock.py", "rosenbrock.json"
"""Files of the room that compiles a program on which the loops depend."""


def _loop(title: str, memory: Mapping[str, Any], module: str, function: str, *parts: str) -> Loop:
    here = Path(__file__).parent
    own = [here / f"{name}.py" for name in ("vector", "layout", "lane_step", "lane_guards", "lane_run", *parts)]
    sources = [*stepper.sources(), *(here.parent.parent / "compile" / name for name in CODE), *own]
    return Loop(title, sources, f"{__package__}.{module}.{function}", SIZES, memory)


EXPLICIT = _loop("explicit steps of order 8", EXPLICIT_MEMORY, "lane_run", "run_explicitly")
_LINEARLY = "linearly implicit steps of order 5", ROSENBROCK_MEMORY, "rosenbrock_lanes", "run_linearly"
ROSENBROCK = _loop(*_LINEARLY, "radau_lanes", "rosenbrock_lanes")
RADAU = _loop("Radau IIA of order 9", RADAU_MEMORY, "radau_lanes", "run_by_radau", "radau_lanes")


def methods_of(problem: Problem) -> Iterator[Loop]:
    """Yield the methods of a batch in lanes, each for what those before leave; none if its runs are solved alone."""
    if problem.explicit and problem.program.lanes:
        yield EXPLICIT
    if problem.implicit_lanes and (lanes := problem.program.implicit_lanes):
        if problem.rtol >= LINEAR_RTOL and not problem.program.n_ledger and len(lanes.nonzeros) <= MOST_NONZEROS:
            yield ROSENBROCK
        yield RADAU
