"""The compiled stepper: compiled once per machine, then loaded from the cache when a solve first needs it.

Importing this module imports neither Numba nor the kernel.
"""

import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from surfacechem.compile import objectcode
from surfacechem.compile.cache import compile_kernel, is_filled, kernel_folder

_SOURCES = (
    "../contract",
    "work",
    "linear",
    "roundoff",
    "tables",
    "newton",
    "step",
    "advance",
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
    return kernel_folder([here / f"{name}.py" for name in _SOURCES])


def is_compiled() -> bool:
    """Whether the stepper can be loaded instead of compiled (which takes some ten seconds, once)."""
    return _Loaded.kernel is not None or is_filled(_folder())


def _compiled() -> Any:
    from numba import boolean, float64, int64, void

    from surfacechem.solve.radau.driver import run_batch
    from surfacechem.solve.radau.work import PARTS

    real, table, cube, count = float64[::1], float64[:, ::1], float64[:, :, ::1], int64[:, ::1]
    signature = void(
        int64,
        int64,
        count,
        boolean[::1],
        count,
        int64[::1],
        real,
        real,
        int64,
        int64,
        int64[::1],
        float64,
        float64,
        real,
        count,
        table,
        cube,
        real,
        real,
        table,
        count,
        cube,
        cube,
        cube,
    )
    kernel = compile_kernel(run_batch, signature, _folder(), PARTS)
    _call_once(kernel, signature.args)
    objectcode.keep(kernel, _folder())
    return kernel


def _call_once(kernel: Any, kinds: Sequence[Any]) -> None:
    """A batch of no runs: Numba looks longer at the types of its first arguments than a brief run takes."""
    kernel(*(np.zeros((0,) * kind.ndim, str(kind.dtype)) if hasattr(kind, "ndim") else 0 for kind in kinds))


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
