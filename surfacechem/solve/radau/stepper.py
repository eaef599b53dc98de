"""The compiled stepper: compiled once per machine, then loaded from the cache when a solve first needs it.

Importing this module imports neither Numba nor the kernel.
"""

import math
import threading
from collections import namedtuple
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache, partial
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from surfacechem.compile import objectcode
from surfacechem.compile.cache import compile_kernel, copy_shipped, is_filled, kernel_folder
from surfacechem.solve.contract import CHATTER

EDGE_TABLES: dict[str, tuple[Any, int]] = {
    "edges": (np.int64, 2),
    "when": (np.int64, 2),
    "held": (np.int64, 1),
    "clocks": (np.int64, 1),
    "nodes": (np.int64, 1),
    "accounts": (np.int64, 2),
    "least_peaks": (float, 1),
}
"""Tables of edges, where runs go on along them: type and number of axes, as EdgeTables has them."""

EDGE_WORDS = sum(1 + axes for _, axes in EDGE_TABLES.values())
"""Words that tell where they are: of each its address and its lengths."""

BATCH: dict[str, tuple[Any, int]] = {
    # the program
    "sizes": (np.int64, 1),
    "code": (np.int64, 2),
    "algebraic": (np.bool_, 1),
    "chains": (np.int64, 2),
    # places of the derivatives that are formed; none where all are
    "nonzeros": (np.int64, 1),
    "groups": (np.int64, 1),
    # address and lengths of each of the tables of edges: one array is taken apart sooner than seven
    "edge_words": (np.int64, 1),
    # the method
    "rtol": (float, 0),
    "atol": (float, 1),
    # whether steps are explicit as long as the equations are not stiff
    "explicitly": (int, 0),
    # guards: a row (terminal, direction, smooth, strict, in play, domain) for each
    "kinds": (np.int64, 2),
    # runs that others follow
    "goes_on": (int, 0),
    # part of its range by which a straight line between known states may miss another one; 0 where none are added
    "picture": (float, 0),
    # time that the run has lasted before
    "before": (float, 0),
    # the runs; all but the first two have one row for all where these are alike
    "y0": (float, 2),
    "parameters": (float, 3),
    "spacing": (float, 1),
    "max_steps": (np.int64, 1),
    # largest accounts and guards of what a run continues, least and largest states where a picture is wanted
    "peaks": (float, 2),
    "segments": (float, 2),
    "times": (float, 2),
    # results
    "ends": (float, 2),
    "counts": (np.int64, 2),
    "outputs": (float, 3),
    "records": (float, 3),
    "events": (float, 3),
    # states inside steps, and their times
    "inside": (float, 3),
    "inside_times": (float, 2),
    # arcs and jumps, where runs go on along edges: see Course
    "arcs": (float, 3),
    "jumps": (float, 3),
}
"""Entries of a batch of runs: type and number of axes. The first axis of the last two groups is the run."""

_named: Any = namedtuple
Batch: Any = _named("Batch", BATCH)
"""Inputs of a batch of runs, and the rows that it writes."""

END, OUTPUTS, EVENTS, RECORDS, INSIDE, FIRST_COUNTER, STOP, ARCS, JUMPS, COLUMNS = 0, 1, 2, 3, 4, 5, 11, 12, 13, 14
"""Columns of the table of counts: status, outputs written, events, recorded steps, states inside steps; then six
counters, a flag that is set from outside to end the run, arcs and jumps.
"""

MEASURE, TAKER, REFUSES, RETURNS = range(4)
"""Columns of the table of edges."""

BONDS, WORK, RELEASED, PRODUCED, HEAT_OUT, ENTROPY_OUT, NOT_BOOKED = range(7)
"""Kinds of accounts on which jumps are booked: the change of a state, that of a book; four sums of a jump."""

SIZES = ("n", "n_ledger", "n_margins", "n_inputs", "core", "links", "cells", "n_books", "n_nodal", "n_reset")
"""Sizes of a program, in the order in which it tells them: the core is what is in no chain, the links are the chains,
the cells what is in them; then of jumps what is looked at before and after them, of the nodes and what is reset.
"""

NUMBERS: dict[str, type] = {
    # The time is base + tau, with tau counted from the last restart: steps can be far smaller than an ulp of the time.
    # Of the stored polynomial the step, and where predictions start in it (0 or 1); of the factors and of the Jacobian
    # the steps.
    **dict.fromkeys(("base", "tau", "h_last", "offset", "h_factored", "h_jacobian"), float),
    # Newton: rate of contraction, what is left after a correction in units of it, how wrong the first guess of the
    # stages was and how large rounding is in units of the tolerance. How much larger than the tolerance the estimate
    # of low order may be.
    **dict.fromkeys(("theta", "contraction", "guessed", "roundoff", "loose"), float),
    # Of the trial before, if the ledger has refused it: its step, and what it missed in units of what is allowed.
    **dict.fromkeys(("h_refused", "norm_refused"), float),
    # Counters of a run.
    **dict.fromkeys(("steps", "rejected", "residuals", "jacobians", "factorizations", "iterations"), int),
    # Member of the Radau family now, and that of the stored polynomial. Newton iterations of this step; easy steps in a
    # row; age of the Jacobian; steps that the ledger has refused.
    **dict.fromkeys(("member", "last_member", "tries", "calm", "fresh", "refused"), int),
    # Whether steps are explicit now; twice the number of those that were stiff.
    **dict.fromkeys(("explicit", "stiff_steps"), int),
    # Where edges are carried out: the time at which the arc began and that of the last rebound, with how long it stays
    # away; where the arc ends at the latest, in its own time, and up to where it has outputs. The first event of the
    # arc, and the steps taken and rejected before it; whether loads change at the end of the segment.
    **dict.fromkeys(("origin", "rebounded", "flight_time", "arc_end", "shown"), float),
    **dict.fromkeys(("first_event", "steps_before", "rejected_before", "loads_change"), int),
}
"""Numbers of a trajectory that change."""

WIDTH = 4
"""States in a vector of the processor."""

ROWS = 7 + WIDTH - 1
"""Rows of a matrix of seven stages with room for the last vector, even of a single state."""

SCAN_POINTS = 17
"""Points of a step of the highest order at which guards are examined."""


def _arrays(names: str, *shape: str | int, kind: type = float) -> dict[str, tuple[type, tuple[str | int, ...]]]:
    return dict.fromkeys(names.split(), (kind, shape))


MEMORY = {
    # t, y, ydot, parameters: what every function of the program is given
    **_arrays("inputs", "n_inputs"),
    # state and rates, now and as a trial; weights of the error norm; typical sizes, now and when factors were made
    **_arrays("y ydot trial trial_dot weight scale pivot", "n"),
    # error of the step, correction of its polynomial; right-hand sides and columns of linear systems
    **_arrays("error correction rhs delta columns", "n"),
    # rounding of the variables; roughness of the equations over neighbouring times
    **_arrays("noise wobble wobble_now", "n"),
    **_arrays("wobble_sums", 3, "n"),
    # stages: increments, those of the stored step, residuals and corrections, slopes; corrections in the eigenbasis
    **_arrays("z z_last g slopes parts", ROWS, "n"),
    **_arrays("pairs", 3, "n", kind=complex),
    # rates at the stages of an explicit step
    **_arrays("k", 16, "n"),
    # derivatives by states and by rates, one behind the other as the compiled function writes them
    **_arrays("jacobian", 2, "core", "core"),
    **_arrays("border_derivatives", 2, "core", "links"),
    **_arrays("band_derivatives", 2, "cells", 3),
    # Newton matrices, then their factors, what rows and columns of these were exchanged with, where the entries
    # of large ones are, and these counted; in the last row those of the derivatives
    **_arrays("real", "core", "core"),
    **_arrays("real_border", "core", "links"),
    **_arrays("real_bands", "cells", 3),
    **_arrays("complex", 3, "core", "core", kind=complex),
    **_arrays("complex_border", 3, "core", "links", kind=complex),
    **_arrays("complex_bands", 3, "cells", 3, kind=complex),
    **_arrays("order", 4, 6, "core", kind=int),
    **_arrays("places", 4, "core", "core", kind=int),
    **_arrays("entries", 6, "core", kind=int),
    # polynomials in Newton's form: the stored one, and those of state and ledger over the step
    **_arrays("z_polynomial polynomial", "n", 9),
    # fractions of the step of four outputs
    **_arrays("fractions", 4),
    **_arrays("q_polynomial", "n_ledger", 9),
    # change of the state and its rate at the points where guards are examined
    **_arrays("scanned scanned_rates", SCAN_POINTS + WIDTH - 1, "n"),
    # shares of the logarithm of the time at these points
    **_arrays("decades", SCAN_POINTS),
    # least and largest values of the states so far
    **_arrays("least largest", "n"),
    # ledger: now, as a trial, correction of its polynomial, a probe; defects, what the step turns over, what errors are
    # held against, the largest so far, errors that the tolerance of the states excuses; at the stages; rates there and,
    # last, at the start
    **_arrays("q q_trial q_correction q_probe q_miss q_turned q_scale q_largest q_excused", "n_ledger"),
    **_arrays("q_stage", ROWS, "n_ledger"),
    **_arrays("rates", 8, "n_ledger"),
    # guards: value now, at the two points before, at the start of the step and elsewhere; largest so far; slope
    **_arrays("margin margin_before margin_earlier margin_first margin_probe margin_largest margin_slope", "n_margins"),
    # side of zero on which each was last seen, at the start of the step and at the point before; ends of the interval
    # in which it reaches zero; which have fired
    **_arrays("side side_first side_last low high", "n_margins"),
    **_arrays("fired playing", "n_margins", kind=int),
    # moments between arcs: t, y, ydot, parameters, followed by how large the states have been; the same after a jump,
    # and before it with the measured state moved by its rounding; what is looked at there
    **_arrays("moment", "n_inputs"),
    **_arrays("sized peaks_seen", "n"),
    **_arrays("after perturbed", "n_inputs"),
    **_arrays("books_before books_after books_perturbed", "n_books"),
    **_arrays("nodal targets", "n_nodal"),
    **_arrays("reset", "n_reset"),
    **_arrays("magnitude", "n_margins"),
    **_arrays("booked exchanged", "n_ledger"),
    # times of the last jumps, the latest last
    **_arrays("jumped", CHATTER),
}
"""Arrays that a trajectory writes to: type and shape."""


def words_of(size_of: Mapping[str, int], memory: Mapping[str, tuple[type, tuple[str | int, ...]]]) -> int:
    """Words of eight bytes that these arrays take up for these sizes."""
    total = 0
    for kind, shape in memory.values():
        lengths = (size_of[length] if isinstance(length, str) else length for length in shape)
        total += np.dtype(kind).itemsize // 8 * math.prod(lengths)
    return total


@lru_cache(maxsize=64)
def _words_of(sizes: tuple[int, ...]) -> int:
    """Memory of a trajectory of a program of these sizes, in words."""
    return words_of(dict(zip(SIZES, sizes, strict=True)), MEMORY)


_SOURCES = (
    "../contract",
    "../../tolerances",
    "stepper",
    "record",
    "work",
    "linear",
    "roundoff",
    "tables",
    "explicit",
    "newton",
    "step",
    "consistency",
    "dense",
    "guards",
    "outputs",
    "../edges",
    "driver",
)


def sources() -> list[Path]:
    """The files that the compiled code depends on."""
    here = Path(__file__).parent
    return [here / "coefficients.json", *(here / f"{name}.py" for name in _SOURCES)]


class Loop:
    """A compiled loop over a batch of runs: compiled once per machine, then loaded when it is first needed.

    The module of the function is imported where it has to be compiled, as it imports Numba.
    """

    def __init__(self, sources: Sequence[Path], module: str, function: str, brief: bool = False) -> None:
        self._sources, self._module, self._function, self._brief = sources, module, function, brief
        self._kernel: Any = None
        self._lock = threading.Lock()

    @property
    def folder(self) -> Path:
        """Folder of its compiled code, filled from the wheel if that carries any that fits."""
        folder = kernel_folder(self._sources)
        copy_shipped(folder, self._sources)
        return folder

    @property
    def is_compiled(self) -> bool:
        """Whether it can be loaded instead of compiled (which takes some ten seconds, once)."""
        return self._kernel is not None or is_filled(self.folder)

    def load(self) -> Any:
        """The compiled function; without its compiler where each call takes long beside what that costs."""
        if self._kernel is None:
            with self._lock:
                self._kernel = self._kernel or (self._brief and objectcode.load(self.folder)) or self._compiled()
        return self._kernel

    def load_briefly(self) -> None:
        """Load it without its compiler where that can be: ready sooner, slower to call; for a process of few runs."""
        with self._lock:
            self._kernel = self._kernel or objectcode.load(self.folder)

    def _compiled(self) -> Any:
        from surfacechem.solve.radau.work import PARTS

        kernel = compile_kernel(getattr(import_module(self._module), self._function), _signature(), self.folder, PARTS)
        if not self._brief:
            # A batch of no runs: Numba looks longer at the types of its first arguments than a brief run takes.
            nothing = (np.zeros((EDGE_WORDS,) * axes, dtype) if axes else dtype(0) for dtype, axes in BATCH.values())
            kernel(0, 0, np.zeros(0, np.int64), tuple(nothing))
        objectcode.keep(kernel, self.folder)
        return kernel


def _signature() -> Any:
    """Argument types of a compiled loop: the first run and the one behind the last, memory, and the batch."""
    from numba import from_dtype, types

    numba_types: Any = types
    entries = [(from_dtype(np.dtype(dtype)), axes) for dtype, axes in BATCH.values()]
    batch = numba_types.Tuple([types.Array(entry, axes, "C") if axes else entry for entry, axes in entries])
    return types.void(types.int64, types.int64, types.int64[::1], batch)


LOOP = Loop(sources(), "surfacechem.solve.radau.driver", "run_batch")
"""The compiled loop over runs, or over states to be made consistent."""


def repeated(batch: Any) -> Callable[[], None]:
    """Runs a batch at each call, again and again in one memory: each time it takes its rows as they are then."""
    memory = np.zeros(_words_of(tuple(batch.sizes.tolist())), np.int64)
    return partial(LOOP.load(), 0, len(batch.ends), memory, tuple(batch))


def run(batch: Any) -> None:
    """Run a batch in a memory of its own: threads may run others at the same time."""
    repeated(batch)()
