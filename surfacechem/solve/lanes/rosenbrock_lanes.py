"""The loop over lanes with linearly implicit steps of order 5 (Rodas5P), of which each lane takes the same work.

A step is a single call of code made for the equations, without iterations. Runs whose matrices lose digits in it are
left to implicit steps.

Source: Steinebach (2023), BIT Numerical Mathematics 63, article 27, doi 10.1007/s10543-023-00967-x.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from surfacechem.compile.rosenbrock import CHANGES, DENSE, STAGES
from surfacechem.compile.rosenbrock import GAMMA as GAMMA_OF_STAGES
from surfacechem.compile.vectors import LANES
from surfacechem.solve.lanes import radau_lanes
from surfacechem.solve.lanes.lane_run import CONSTANTS, loop_of
from surfacechem.solve.lanes.lane_step import error_norm, larger, nothing, put_moved
from surfacechem.solve.lanes.layout import ORDER, ROSENBROCK_MEMORY
from surfacechem.solve.lanes.vector import any_lane, lanes, put, same, where
from surfacechem.solve.radau.work import compiled, evaluate, weighted_sums

STEP = CONSTANTS + 1
"""Row of the code of a step in the table of addresses."""
END_STAGE = 1 + STAGES
"""Row of the rates at the end of the step; that of the states there follows."""
POWER = 0.2
"""Exponent of the size of a step: the error of the embedded solution goes with h^5."""


def _polynomials() -> NDArray[np.float64]:
    """Return the coefficients of x, x^2, ... in the change over a fraction x of the step, a row for each power, by the
    rate at the start (not used) and the increments.
    """
    table = np.zeros((ORDER, 1 + STAGES))
    table[0, 1:] = [*CHANGES[-1], 1.0]
    table[:3, 1:] += DENSE
    table[1:4, 1:] -= DENSE
    return table


_POLYNOMIALS = _polynomials()
_polynomial = weighted_sums(_POLYNOMIALS, LANES)
_quarters = weighted_sums([[x**d for d in range(1, 1 + ORDER)] @ _POLYNOMIALS for x in (0.25, 0.5, 0.75)], LANES)


@compiled
def try_step(w: Any) -> None:
    """Take a step of each lane, and set the norm of its local error."""
    radau_lanes.differentiate(w)
    put(w.inputs[1 + w.n], lanes(w.h))
    evaluate(w, STEP, w.k)
    put(w.evaluations, lanes(w.evaluations) + float(STAGES))
    for m in range(w.n):
        put(w.y_new[m], lanes(w.k[1 + END_STAGE, m]))
    norm, diagonal = error_norm(w, w.k[STAGES]), 1.0 / lanes(w.h) / GAMMA_OF_STAGES
    hides = (norm < 1.0) & radau_lanes.are_open(w, w.gap, diagonal, w.k[END_STAGE])
    if any_lane(hides):
        norm = larger(norm, radau_lanes.norm_at_end(w, 0, diagonal, w.gap, hides))
    put(w.norm, norm)


@compiled
def find_doubtful(w: Any) -> None:
    """Mark as unclear the steps whose matrix has lost digits."""
    put(w.unclear, where(lanes(w.norm) < 1.0, lanes(w.doubtful), 0.0))


@compiled
def put_roughly(w: Any, x: float) -> None:
    """Set the inputs to time and state at a quarter point of each step, by its polynomial."""
    every = LANES * w.n
    _quarters(int(4.0 * x) - 1, w.k.ctypes.data, every, every, w.rates.ctypes.data)
    put_moved(w, x * lanes(w.h), w.rates, 1.0)


@compiled
def interpolate(w: Any, columns: int) -> None:
    """The polynomials of the steps."""
    every, rate = LANES * w.n, 1.0 / lanes(w.h)
    for d in range(ORDER):
        _polynomial(d, w.k.ctypes.data, every, every, w.polynomial[d].ctypes.data)
        for m in range(w.n):
            put(w.polynomial[d, m], lanes(w.polynomial[d, m]) * rate)


@compiled
def put_matrices(w: Any) -> None:
    """Factor the matrices for checks of the polynomials; the code of a step keeps its own ones."""
    radau_lanes.factor(w, 0, w.jacobian, 1.0 / lanes(w.h) / GAMMA_OF_STAGES, same(0.0))


@compiled
def find_defects(w: Any, lane: int, x: Any) -> None:
    """The defects of the dense output as in steps of Radau IIA, but without their loosening, which belongs to an
    estimate of half the order of the step.
    """
    radau_lanes.find_defects(w, lane, x)
    for m in range(w.n):
        put(w.rates[m], lanes(w.rates[m]) * w.loose)


run_linearly = loop_of(
    "RosenbrockLanes", END_STAGE, POWER, ROSENBROCK_MEMORY,
    root_of=radau_lanes.root_of, try_step=try_step, limit_size=radau_lanes.limit_growth, find_noise=nothing,
    find_stiff=find_doubtful, put_roughly=put_roughly, interpolate=interpolate, put_matrices=put_matrices,
    find_defects=find_defects, check_outputs=radau_lanes.check_outputs,
    keep_step=radau_lanes.keep_derivatives,
)  # fmt: skip
"""Solve the runs of a batch."""
