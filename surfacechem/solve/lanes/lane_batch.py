"""Batches of runs of one model: eight at once in lanes, and one at a time where lanes do not apply."""

from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from surfacechem.compile.vectors import LANES
from surfacechem.solve.contract import Array, Problem, Status
from surfacechem.solve.lanes.layout import MEMORY, SIZES
from surfacechem.solve.radau import stepper
from surfacechem.solve.radau.solver import Room, batch_of, solve_arrays
from surfacechem.solve.radau.stepper import END


def solve_batch(problem: Problem, *columns: Array, room: Room | None = None) -> Any:
    """Solve a batch as :func:`solve_arrays` does, in lanes where the problem may be solved explicitly and has vector
    code.
    """
    if not problem.explicit or problem.program.lanes is None:
        return solve_arrays(problem, *columns, room=room)
    y0, parameters, spacing, *others = map(np.ascontiguousarray, columns)
    runs = y0, parameters, spacing, np.array((problem.max_steps,)), *others
    batch = batch_of(problem, runs, room, problem.program.lane_tables)
    run(batch)
    left = np.flatnonzero(batch.counts[:, END] == Status.LEFT)
    if len(left):
        own = (rows[left] if len(rows) == len(y0) else rows for rows in columns)
        repeated = solve_arrays(problem, *own, room=room)
        for name in ("ends", "counts", "outputs", "records", "events"):
            getattr(batch, name)[left] = getattr(repeated, name)
    return batch


def run(batch: Any) -> None:
    """Run a batch in lanes. Each call has its own memory, so several threads may call it at the same time."""
    words = _words_of(tuple(batch.sizes.tolist()))
    memory = np.zeros(words + LANES, np.int64)
    # A vector that lies across two lines of the cache takes twice the time.
    first = -memory.ctypes.data // memory.itemsize % LANES
    LOOP.load()(0, len(batch.counts), memory[first : first + words], tuple(batch))


@lru_cache(maxsize=64)
def _words_of(sizes: tuple[int, ...]) -> int:
    """Return the number of words of memory for a block of lanes of a program of these sizes."""
    return stepper.words_of(dict(zip(SIZES, sizes, strict=True)), MEMORY)


def _sources() -> list[Path]:
    here = Path(__file__).parent
    own = [here / f"{name}.py" for name in ("vector", "layout", "lane_step", "lane_guards", "lane_run")]
    return [*stepper.sources(), here.parent.parent / "compile" / "vectors.py", *own]


LOOP = stepper.Loop(_sources(), "surfacechem.solve.lanes.lane_run", "run_lanes", brief=True)
"""The compiled loop over lanes."""
