"""Runs of one model through the steps of eight at once, and one at a time where these steps are not for them."""

import threading
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from surfacechem.compile.cache import compile_kernel, is_filled, kernel_folder
from surfacechem.solve.contract import Array, Problem
from surfacechem.solve.lanes.layout import LEFT, MEMORY, SIZES
from surfacechem.solve.radau import stepper
from surfacechem.solve.radau.solver import Room, batch_of, solve_arrays
from surfacechem.solve.radau.stepper import END

_LOCK = threading.Lock()


def solve_batch(problem: Problem, *columns: Array, room: Room | None = None) -> Any:
    """As :func:`solve_arrays`, eight runs at once where the steps of the problem may be explicit and there is code."""
    if not problem.explicit or problem.program.lanes is None:
        return solve_arrays(problem, *columns, room=room)
    y0, parameters, spacing, *others = map(np.ascontiguousarray, columns)
    runs = y0, parameters, spacing, np.array((problem.max_steps,)), *others
    batch = batch_of(problem, runs, room, problem.program.lane_tables)
    run(batch)
    left = np.flatnonzero(batch.counts[:, END] == LEFT)
    if len(left):
        own = (rows[left] if len(rows) == len(y0) else rows for rows in columns)
        repeated = solve_arrays(problem, *own, room=room)
        for name in ("ends", "counts", "outputs", "records", "events"):
            getattr(batch, name)[left] = getattr(repeated, name)
    return batch


def run(batch: Any) -> None:
    """The runs of a batch, eight at once, with a memory of their own: threads may do so at the same time."""
    memory = np.zeros(_words(tuple(batch.sizes.tolist())), np.int64)
    _kernel()(0, len(batch.counts), memory, tuple(batch))


@lru_cache(maxsize=64)
def _words(sizes: tuple[int, ...]) -> int:
    return stepper.words_of(dict(zip(SIZES, sizes, strict=True)), MEMORY)


_SOURCES = ("vector", "layout", "lane_step", "lane_guards", "lane_run")


class _Loaded:
    kernel: Any = None


def _kernel() -> Any:
    """The compiled loop: compiled once per machine, then loaded from the cache."""
    if _Loaded.kernel is None:
        with _LOCK:
            _Loaded.kernel = _Loaded.kernel or _compiled()
    return _Loaded.kernel


def is_compiled() -> bool:
    """Whether the loop can be loaded instead of compiled (which takes some ten seconds, once)."""
    return _Loaded.kernel is not None or is_filled(_folder())


def _folder() -> Path:
    here = Path(__file__).parent
    own = [here / f"{name}.py" for name in _SOURCES]
    return kernel_folder([*stepper.sources(), here.parent.parent / "compile" / "vectors.py", *own])


def _compiled() -> Any:
    from surfacechem.solve.lanes.lane_run import run_lanes
    from surfacechem.solve.radau.work import PARTS

    return compile_kernel(run_lanes, stepper.signature(), _folder(), PARTS)
