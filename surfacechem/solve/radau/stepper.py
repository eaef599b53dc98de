"""The compiled stepper: compiled once per machine, then loaded from the cache when a solve first needs it.

Importing this module imports neither Numba nor the kernel.
"""

import threading
from collections import namedtuple
from pathlib import Path
from typing import Any

import numpy as np

from surfacechem.compile import objectcode
from surfacechem.compile.cache import compile_kernel, is_filled, kernel_folder

FIELDS: dict[str, tuple[Any, int]] = {
    # the program
    "code": (np.int64, 2),
    "algebraic": (np.bool_, 1),
    "chains": (np.int64, 2),
    "groups": (np.int64, 1),
    # the method
    "rtol": (float, 0),
    "atol": (float, 1),
    # guards: a row (terminal, direction, smooth, strict, in play) for each
    "kinds": (np.int64, 2),
    # runs that others follow
    "goes_on": (int, 0),
    # the runs; all but the first two have one row for all where these are alike
    "y0": (float, 2),
    "parameters": (float, 3),
    "spacing": (float, 1),
    "max_steps": (np.int64, 1),
    # largest accounts and guards of what a run continues
    "peaks": (float, 2),
    "segments": (float, 2),
    "times": (float, 2),
    # results
    "ends": (float, 2),
    "counts": (np.int64, 2),
    "outputs": (float, 3),
    "steps": (float, 3),
    "events": (float, 3),
}
"""Entries of a batch of runs: type and number of axes. The first axis of the last two groups is the run."""

_named: Any = namedtuple
Batch: Any = _named("Batch", FIELDS)
"""What a batch of runs reads, and the rows that it writes."""

END, OUTPUTS, EVENTS, RECORDS, FIRST_COUNTER, STOP, COLUMNS = 0, 1, 2, 3, 4, 10, 11
"""Columns of the table of counts: status, outputs written, events, recorded steps; then six counters, and a flag that
is set from outside to end the run.
"""

_SOURCES = (
    "../contract",
    "../../tolerances",
    "stepper",
    "work",
    "linear",
    "roundoff",
    "tables",
    "newton",
    "step",
    "consistency",
    "dense",
    "quadrature",
    "guards",
    "outputs",
    "driver",
)
_LOCK = threading.Lock()


def _folder() -> Path:
    here = Path(__file__).parent
    return kernel_folder([here / "coefficients.json", *(here / f"{name}.py" for name in _SOURCES)])


def is_compiled() -> bool:
    """Whether the stepper can be loaded instead of compiled (which takes some ten seconds, once)."""
    return _Loaded.kernel is not None or is_filled(_folder())


def _compiled() -> Any:
    from numba import from_dtype, types

    from surfacechem.solve.radau.driver import run_batch
    from surfacechem.solve.radau.work import PARTS

    def kind(dtype: Any, ndim: int) -> Any:
        entry = from_dtype(np.dtype(dtype))
        return types.Array(entry, ndim, "C") if ndim else entry

    numba_types: Any = types
    batch = numba_types.Tuple([kind(*field) for field in FIELDS.values()])
    signature = types.void(types.int64, types.int64, batch)
    kernel = compile_kernel(run_batch, signature, _folder(), PARTS)
    # A batch of no runs: Numba looks longer at the types of its first arguments than a brief run takes.
    kernel(0, 0, tuple(np.zeros((0,) * ndim, dtype) if ndim else dtype(0) for dtype, ndim in FIELDS.values()))
    objectcode.keep(kernel, _folder())
    return kernel


class _Loaded:
    kernel: Any = None


def run_batch() -> Any:
    """The compiled loop over a batch of runs, or of states to be made consistent."""
    if _Loaded.kernel is None:
        with _LOCK:
            _Loaded.kernel = _Loaded.kernel or _compiled()
    return _Loaded.kernel


def load_briefly() -> None:
    """Load the stepper without its compiler where that can be: ready sooner, slower to call; for a process of few
    runs.
    """
    with _LOCK:
        _Loaded.kernel = _Loaded.kernel or objectcode.load(_folder())


def compile_stepper() -> None:
    """Compile the stepper now, as a set-up step, or load it if that has been done."""
    run_batch()
