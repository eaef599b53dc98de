"""Small systems with known solutions, shared by the solver tests."""

from concurrent.futures import ThreadPoolExecutor
from functools import cache

import numpy as np
import symengine as se

from surfacechem.compile.program import Program, compile_program
from surfacechem.solve.contract import Guard, Problem
from surfacechem.solve.radau.solver import solve_arrays

T, Y, DY = se.symbols("t y dy")
CONDUCTANCE = (1e3, 1e12, 1e20)
PARAMETERS = np.array([2.0, 300.0, 300.0, 1.0, 0.5])


def scalar(row, *ledger, margins=()) -> Program:
    """One equation for y' at t."""
    return compile_program(T, [Y], [DY], [], [row], ledger=ledger, margins=margins)


def problem(
    program: Program,
    y0,
    segments,
    rtol,
    *,
    atol=None,
    times=(),
    parameters=(),
    margins: tuple[Guard, ...] = (),
    **options,
):
    """A problem of one parameter set, with weights that do not matter by default."""
    weights = np.full(program.n, rtol * 1e-2 if atol is None else atol)
    return Problem(
        program,
        np.array(y0, dtype=float),
        np.asarray(times, dtype=float),
        np.array(segments),
        np.atleast_2d(np.array(parameters, dtype=float)).reshape(1, program.n_parameters),
        rtol,
        weights,
        margins,
        **options,
    )


def solved_as_arrays(shared: Problem, y0, parameters, threads: int = 1, solve=solve_arrays):
    """Ends, counts and outputs of runs that share all with a problem but y0 and parameters, on so many threads."""
    peaks = np.zeros((1, shared.program.n_ledger + shared.program.n_margins))
    alike = np.array([shared.spacing]), peaks, shared.segments[None], shared.times[None]

    def part(rows):
        batch = solve(shared, y0[rows], parameters[rows], *alike)
        return batch.ends, batch.counts, batch.outputs

    with ThreadPoolExecutor(threads) as pool:
        parts = list(pool.map(part, np.array_split(np.arange(len(y0)), threads)))
    return [np.concatenate(columns) for columns in zip(*parts, strict=True)]


@cache
def exothermic() -> Program:
    """Exothermic bonding: total energy and the number of bonds."""
    t, temperature, phi, rate, growth = se.symbols("t T phi dT dphi")
    c, k, t0, n, tau = se.symbols("C K0 T0 n tau")
    rows = [c * temperature / t0 * rate - k * (1 - phi) * growth, n * growth - n / tau * (1 - phi)]
    return compile_program(t, [temperature, phi], [rate, growth], [c, k, t0, n, tau], rows)


def exothermic_exact(t, parameters=PARAMETERS):
    c, k, t0, _, tau = parameters
    temperature = t0 * np.sqrt(1 - k / (t0 * c) * np.expm1(-2 * np.asarray(t) / tau))
    return np.stack([temperature, -np.expm1(-np.asarray(t) / tau)], axis=-1)


def exothermic_problem(rtol: float, outputs: int = 200) -> Problem:
    times = np.linspace(0.0, 2.5, outputs + 1)[1:]
    return Problem(
        exothermic(),
        np.array([300.0, 0.0]),
        times,
        np.array([0.0, 2.5]),
        PARAMETERS[None],
        rtol,
        np.array([3.0, 0.01]) * rtol,
    )


def _robertson_rows():
    t, a, b, c, da, db, dc = se.symbols("t a b c da db dc")
    slow, fast, last = 0.04 * a, 1e4 * b * c, 3e7 * b**2
    return t, [a, b, c], [da, db, dc], [da + slow - fast, db - slow + fast + last], dc - last


@cache
def robertson() -> Program:
    t, y, ydot, rows, last = _robertson_rows()
    return compile_program(t, y, ydot, [], [*rows, last])


@cache
def robertson_sums() -> Program:
    """The second row is the sum of the rates: no cancelling rates are integrated, so every digit can be had."""
    t, y, ydot, rows, last = _robertson_rows()
    return compile_program(t, y, ydot, [], [rows[0], sum(ydot), last])


@cache
def robertson_dae() -> Program:
    t, y, ydot, rows, _ = _robertson_rows()
    return compile_program(t, y, ydot, [], [*rows, sum(y) - 1])


def coupled_nodes(conductance: float) -> Program:
    """A light and a heavy node behind a conductance; the second row is the balance of both."""
    t, a, b, da, db = se.symbols("t a b da db")
    return compile_program(t, [a, b], [da, db], [], [1e-15 * da + conductance * (a - b), 1e-15 * da + 2.0 * db - 3.0])


@cache
def linear_decay() -> Program:
    return scalar(DY + Y, margins=[Y - 0.5])
