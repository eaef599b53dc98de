"""The compiled stepper: compiled once per machine, then loaded from the cache on the first solve.

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

from surfacechem.compile.cache import compile_kernel, copy_shipped, kernel_folder, store_code, stored_code
from surfacechem.compile.objectcode import Kernel
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
"""Tables of edges, as in EdgeTables: type and number of axes."""

EDGE_WORDS = sum(1 + axes for _, axes in EDGE_TABLES.values())
"""Number of words for the address and the lengths of each of these tables."""

BATCH: dict[str, tuple[Any, int]] = {
    # the program
    "sizes": (np.int64, 1),
    "code": (np.int64, 2),
    "algebraic": (np.bool_, 1),
    "chains": (np.int64, 2),
    # positions of the derivatives that are formed; empty if all are
    "nonzeros": (np.int64, 1),
    "groups": (np.int64, 1),
    # for explicit steps, of equations without narrow features: flags of the states that they divide by; else empty
    "divisors": (np.bool_, 1),
    # address and lengths of each table of edges: one array is unpacked faster than seven
    "edge_words": (np.int64, 1),
    # the method
    "settings": (float, 1),
    "atol": (float, 1),
    # guards: a row (terminal, direction, smooth, strict, domain, active) for each
    "kinds": (np.int64, 2),
    # most steps, one number for all runs or one each
    "max_steps": (np.int64, 1),
    # the runs; all but the first two have a single row if it is the same for all runs
    "y0": (float, 2),
    "parameters": (float, 3),
    "spacing": (float, 1),
    # largest accounts and guards so far, then least and largest states if states are stored for interpolation
    "peaks": (float, 2),
    "segments": (float, 2),
    "times": (float, 2),
    # results
    "ends": (float, 2),
    "counts": (np.int64, 2),
    "outputs": (float, 3),
    "records": (float, 3),
    "events": (float, 3),
    # stored states inside steps, and their times
    "inside": (float, 3),
    "inside_times": (float, 2),
    # arcs and jumps, if the loop carries out edges: see EdgeCourse
    "arcs": (float, 3),
    "jumps": (float, 3),
}
"""Entries of a batch of runs: type and number of axes. The first axis of the last two groups is the run."""

SETTINGS = (
    "rtol",
    # true if steps are explicit as long as the equations are not stiff
    "explicitly",
    # true if other problems continue the runs
    "continued",
    # allowed error of linear interpolation between stored states, as a part of their range; 0: none are added
    "line_error",
    # time from the start of the run to that of the problem
    "elapsed",
)
"""Settings of a batch, in this order."""

_named: Any = namedtuple
Batch: Any = _named("Batch", BATCH)
"""Inputs of a batch of runs, and the rows that it writes."""

END, OUTPUTS, EVENTS, RECORDS, INSIDE, FIRST_COUNTER, STOP, ARCS, JUMPS, COLUMNS = 0, 1, 2, 3, 4, 5, 11, 12, 13, 14
"""Columns of the table of counts: status, outputs written, events, recorded steps, stored states inside steps; then six
counters, a flag that is set from outside to end the run, arcs and jumps.
"""

MEASURE, HEAT_SOURCE, REFUSES, RETURNS, RESTS = range(5)
"""Columns of the table of edges."""

BONDS, WORK, RELEASED, PRODUCED, HEAT_OUT, ENTROPY_OUT, NOT_BOOKED = range(7)
"""Kinds of accounts in jumps: the change of a state, the change of a total, four amounts of a jump, none."""

SIZES = ("n", "n_ledger", "n_margins", "n_inputs", "core", "links", "cells", "n_totals", "n_nodal", "n_reset")
"""Sizes of a program, in this order. The core are the states in no chain, the links the chains, the cells the states in
chains; then the numbers of totals of a jump, of values of the nodes and of variables that resets write.
"""

NUMBERS: dict[str, type] = {
    # The time is base + tau, with tau counted from the last restart: steps may be far smaller than an ulp of the time.
    # Step of the stored polynomial, and where predictions start in it (0 or 1); steps of the factors and of the
    # Jacobian.
    **dict.fromkeys(("base", "tau", "h_last", "offset", "h_factored", "h_jacobian"), float),
    # Newton: rate of contraction; remaining error after a correction, relative to it; error of the first guess of the
    # stages, and roundoff, in units of the tolerance; factor by which the estimate of low order may exceed the
    # tolerance.
    **dict.fromkeys(("theta", "contraction", "guess_error", "roundoff", "loose"), float),
    # Last trial, if the ledger has rejected it: its step, and its error in units of the allowed one.
    **dict.fromkeys(("h_refused", "norm_refused"), float),
    # Counters of a run.
    **dict.fromkeys(("steps", "rejected", "residuals", "jacobians", "factorizations", "iterations"), int),
    # Member of the Radau family, now and in the stored polynomial. Newton iterations of this step; consecutive easy
    # steps; age of the Jacobian; steps that the ledger has rejected.
    **dict.fromkeys(("member", "last_member", "newton_steps", "easy_steps", "jacobian_age", "ledger_rejections"), int),
    # True if steps are explicit now; twice the number of stiff steps.
    **dict.fromkeys(("explicit", "stiff_steps"), int),
    # If edges are carried out: start of the arc, time of the last rebound and its time of flight; latest end of the
    # arc, in its own time, and the end of its outputs. The first event of the
    # arc, and the steps taken and rejected before it; true if loads change at the end of the segment.
    **dict.fromkeys(("arc_start", "rebound_time", "flight_time", "arc_end", "outputs_end"), float),
    **dict.fromkeys(("first_event", "steps_before", "rejected_before", "loads_change"), int),
}
"""Scalars of a trajectory that change."""

WIDTH = 4
"""Number of states in a vector register."""

ROWS = 7 + WIDTH - 1
"""Rows of a matrix of seven stages with space for the last vector, even of a single state."""

CACHE_LINE = 8
"""Number of words in a line of the processor's cache."""

SCAN_POINTS = 17
"""Points of a step of the highest order at which guards are evaluated."""


def _arrays(names: str, *shape: str | int, kind: type = float) -> dict[str, tuple[type, tuple[str | int, ...]]]:
    return dict.fromkeys(names.split(), (kind, shape))


MEMORY = {
    # t, y, ydot, parameters: the arguments of every function of the program
    **_arrays("inputs", "n_inputs"),
    # state and rates, present and trial; weights of the error norm; typical sizes, now and at the last factorization
    **_arrays("y ydot trial trial_dot weight scale pivot", "n"),
    # error of the step, correction of its polynomial; right-hand sides and columns of linear systems
    **_arrays("error correction rhs delta columns", "n"),
    # roundoff of the variables; fifth differences of the equations over neighbouring times
    **_arrays("noise differences differences_now", "n"),
    **_arrays("difference_sums", 3, "n"),
    # stages: increments, those of the stored step, residuals and corrections, rates; corrections in the eigenbasis
    **_arrays("z z_last g slopes parts", ROWS, "n"),
    **_arrays("pairs", 3, "n", kind=complex),
    # rates at the stages of an explicit step
    **_arrays("k", 16, "n"),
    # derivatives by states and by rates, contiguous as the compiled function writes them
    **_arrays("jacobian", 2, "core", "core"),
    **_arrays("border_derivatives", 2, "core", "links"),
    **_arrays("band_derivatives", 2, "cells", 3),
    # Newton matrices, overwritten by their factors; exchanges of rows and columns; columns of the entries of
    # large ones, and their numbers; in the last row those of the derivatives
    **_arrays("real", "core", "core"),
    **_arrays("real_border", "core", "links"),
    **_arrays("real_bands", "cells", 3),
    **_arrays("complex", 3, "core", "core", kind=complex),
    **_arrays("complex_border", 3, "core", "links", kind=complex),
    **_arrays("complex_bands", 3, "cells", 3, kind=complex),
    **_arrays("order", 4, 6, "core", kind=int),
    **_arrays("places", 4, "core", "core", kind=int),
    **_arrays("entries", 5, "core", kind=int),
    # state and rates at the start of a step in parts
    **_arrays("y_first ydot_first", "n"),
    # polynomials in Newton's form: the stored one, and those of state and ledger over the step
    **_arrays("z_polynomial polynomial", "n", 9),
    # four outputs as fractions of the step
    **_arrays("fractions", 4),
    **_arrays("q_polynomial", "n_ledger", 9),
    # change of the state and its rate at the points where guards are evaluated
    **_arrays("scanned scanned_rates", SCAN_POINTS + WIDTH - 1, "n"),
    # logarithm of the time at these points, as a part of its change over the step
    **_arrays("decades", SCAN_POINTS),
    # least and largest values of the states so far
    **_arrays("least largest", "n"),
    # ledger: present, trial, correction of its polynomial, probe; errors, turnover of the step, scale of the error
    # norm, largest so far, errors explained by the tolerance of the states; at the stages; rates there and,
    # last, at the start; present and rates at the start of a step in parts
    **_arrays("q q_trial q_correction q_probe q_error q_turnover q_scale q_largest q_explained", "n_ledger"),
    **_arrays("q_first rates_first", "n_ledger"),
    **_arrays("q_stage", ROWS, "n_ledger"),
    **_arrays("rates", 8, "n_ledger"),
    # guards: present value, at the last two points, at the start of the step, at a probe; largest so far; slope
    **_arrays("margin margin_before margin_earlier margin_first margin_probe margin_largest margin_slope", "n_margins"),
    # side of zero, at the start of the step and at the last point; ends of the interval
    # in which it reaches zero; flags of those that have fired and of the active ones
    **_arrays("side side_first side_last low high", "n_margins"),
    **_arrays("fired active", "n_margins", kind=int),
    # moment between arcs: t, y, ydot, parameters; peaks of the states; the moment after a jump,
    # and before it with the measured state perturbed by its roundoff; totals there
    **_arrays("moment", "n_inputs"),
    **_arrays("state_sizes peaks_seen", "n"),
    **_arrays("after perturbed", "n_inputs"),
    **_arrays("totals_before totals_after totals_perturbed", "n_totals"),
    **_arrays("nodal targets", "n_nodal"),
    **_arrays("reset", "n_reset"),
    **_arrays("magnitude", "n_margins"),
    **_arrays("booked exchanged", "n_ledger"),
    # times of the last jumps, in order
    **_arrays("jump_times", CHATTER),
}
"""Arrays that a trajectory writes to: type and shape."""


def sources() -> list[Path]:
    """Return the files that the compiled code depends on: those of this folder, except the solver that calls it."""
    here = Path(__file__).parent
    own = sorted({*here.glob("*.py")} - {here / "solver.py"})
    outside = here.parent / "contract.py", here.parent / "edges.py", here.parents[1] / "tolerances.py"
    return [*own, here / "coefficients.json", *outside]


class Loop:
    """A compiled loop over a batch of runs: compiled once per machine, then loaded on first use.

    ``sizes`` are the names of the entries of the first table of a batch, ``memory`` type and shape of each work array.
    The module of the function is imported only for compilation, as it imports Numba.
    """

    def __init__(
        self, title: str, sources: Sequence[Path], function: str, sizes: Sequence[str], memory: Mapping[str, Any]
    ) -> None:
        self.title, self.sizes, self.memory = title, sizes, memory
        self._sources, self._function = sources, function
        self._kernel: Kernel | None = None
        self._lock = threading.Lock()

    @property
    def folder(self) -> Path:
        """Folder of its compiled code, filled from the wheel if that contains code that fits."""
        folder = kernel_folder(self._sources)
        copy_shipped(folder, self._sources)
        return folder

    @property
    def is_compiled(self) -> bool:
        """True if it can be loaded instead of compiled (which takes some ten seconds, once)."""
        return self._kernel is not None or stored_code(self.folder) is not None

    def load(self) -> Kernel:
        """Return the compiled function."""
        with self._lock:
            if self._kernel is None:
                code = stored_code(self.folder)
                if code is None:
                    from surfacechem.solve.radau.work import PARTS

                    module, _, function = self._function.rpartition(".")
                    code = compile_kernel(getattr(import_module(module), function), PARTS)
                    store_code(self.folder, code)
                self._kernel = Kernel(code)
            return self._kernel

    def repeated(self, batch: Any) -> Callable[[], None]:
        """Return a function that runs a batch at each call in the same memory, with the present rows of its arrays."""
        words = _words_of(self, tuple(batch.sizes.tolist()))
        memory = np.zeros(words + CACHE_LINE, np.int64)
        # A vector that lies across two lines of the cache takes twice the time.
        first = -memory.ctypes.data // memory.itemsize % CACHE_LINE
        return partial(self.load(), len(batch.ends), (*batch, memory[first : first + words]))

    def run(self, batch: Any) -> None:
        """Run a batch in newly allocated memory, so that threads may run others at the same time."""
        self.repeated(batch)()


@lru_cache(maxsize=256)
def _words_of(loop: Loop, sizes: tuple[int, ...]) -> int:
    """Return the number of words of the work arrays for a program of these sizes."""
    size_of, total = dict(zip(loop.sizes, sizes, strict=True)), 0
    for kind, shape in loop.memory.values():
        lengths = (size_of[length] if isinstance(length, str) else length for length in shape)
        total += np.dtype(kind).itemsize // 8 * math.prod(lengths)
    return total


LOOP = Loop("Radau IIA of order 5, 9 or 13", sources(), "surfacechem.solve.radau.driver.run_batch", SIZES, MEMORY)
"""The compiled loop over runs, or over states to be made consistent."""
