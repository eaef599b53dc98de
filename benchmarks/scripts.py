"""Cost of `run` of every shipped case beside a script that calls LSODA of SciPy, at equal error.

    python benchmarks/scripts.py [--cases exothermic,debonding] [output folder]

The script is what a person would write: a Python function of the rates with the numbers of the case in it, one call of
LSODA for each piece of the loads. Its formulas are ours, with their guards at singular ends, which a person may leave
out. It knows neither error, balances nor events, which `run` tells: the first figure of ours is that of a run with its
balances, the second has its error, too, from the exact solution or a second run. Both programs are compared at the
output times of the case, as the largest error of a state relative to its largest value. The loosest tolerance of LSODA
counts that is as good as ours; where none is, the tightest, which is marked. Milliseconds of CPU time, errors, and how
many times longer the script takes than a run without its error are kept in benchmarks/results/scripts.csv. Cases that
such a script cannot solve are listed with the reason.
"""

import argparse
import csv
import math
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import symengine
from scipy.integrate import solve_ivp

import surfacechem
from surfacechem.compile.printing import _Python as Python
from surfacechem.compile.program import solved_rates
from surfacechem.format.cases import names
from surfacechem.results.solution import Solution
from surfacechem.runs.simulation import Simulation
from surfacechem.solve.contract import Array, Problem
from surfacechem.solve.run import Model, Run

TOLERANCES = [10.0**-k for k in range(4, 14)]
REPEATS, ENOUGH = 5, 1.0
"""Runs of each at least, and seconds after which there are no more."""

MOST = 200_000
"""Evaluations of the rates after which a script has failed: towards a singular end its steps shrink without end."""


def seconds(call: Callable[[], object]) -> float:
    """CPU time of a call, the least of several."""
    found, begun = [], time.process_time()
    while len(found) < REPEATS or (time.process_time() - begun < ENOUGH / 10 and len(found) < 100):
        start = time.process_time()
        call()
        found.append(time.process_time() - start)
        if time.process_time() - begun > ENOUGH:
            break
    return min(found)


def obstacle(simulation: Simulation, solution: Solution) -> str:
    """Reason why LSODA alone cannot solve a case; empty where it can."""
    system, program = simulation.system, simulation.model.program
    if system.external_rates is not None:
        return "rates come from Cantera itself"
    if any(program.algebraic):
        return "some states are algebraic"
    if program.chains:
        return "heat is conducted in cells"
    if not system.states:
        return "nothing evolves"
    if solution.trajectory.jumps:
        return f"{len(solution.trajectory.jumps)} jumps, each to be located and carried out"
    return "" if program.rates is not None else "the equations determine their rates together"


def rates_of(model: Model) -> Callable[..., list[float]]:
    """The rates as a Python function of t, y and parameters."""
    system = model.system
    rates = solved_rates(system.residual(), [state.dot for state in system.states])
    assert rates is not None
    symbols = [system.t, *(state.symbol for state in system.states), *(p.symbol for p in system.parameters)]
    plain = {symbol: symengine.Symbol(f"x{i}") for i, symbol in enumerate(symbols)}
    found: list[Any] = [rate.xreplace(plain) for rate in rates]
    # What stands behind a condition is evaluated where it holds alone.
    guarded = any(rate.atoms(symengine.Piecewise) for rate in found)
    parts, found = ([], found) if guarded else symengine.cse(found)
    # SymPy itself looks for ever at conditions that have conditions inside.
    text, names, n = Python().text, [str(name) for name in plain.values()], 1 + len(system.states)
    lines = [f"[{', '.join(names[1:n])}] = y", f"[{', '.join(names[n:])}] = p"]
    lines += [*(f"{name} = {text(part)}" for name, part in parts), f"return [{', '.join(map(text, found))}]"]
    space: dict[str, Any] = {"math": math}
    exec(f"def rates({names[0]}, y, p):\n    " + "\n    ".join(lines), space)
    return space["rates"]  # type: ignore[no-any-return]


def script(rates: Callable[..., list[float]], problem: Problem, times: Array, rtol: float) -> Array | None:
    """States at these times by LSODA; None where it fails."""
    atol, y, rows = rtol * problem.atol / problem.rtol, problem.y0, [problem.y0[None]]
    left = iter(range(MOST))

    def counted(t: float, y: Array, p: list[float]) -> list[float]:
        next(left)
        return rates(t, y, p)

    for start, last, p in zip(problem.segments, problem.segments[1:], problem.parameters.tolist(), strict=False):
        end = min(last, times[-1])
        if end <= start:
            break
        inside = times[(times > start) & (times < end)]
        at = np.append(inside, end)
        try:
            answer = solve_ivp(counted, (start, end), y, method="LSODA", t_eval=at, rtol=rtol, atol=atol, args=(p,))
        except (ValueError, OverflowError, ZeroDivisionError, StopIteration):
            return None
        if not answer.success or not np.all(np.isfinite(answer.y)):
            return None
        y = answer.y[:, -1]
        rows.append(answer.y.T if end in times else answer.y.T[:-1])
    return np.concatenate(rows)


def with_error(solution: Solution) -> object:
    """The balances and the error of a run."""
    return solution.audit, solution.accuracy


def measured(name: str) -> list[str]:
    """A row of the table: of a case that a script can solve its costs, errors and ratio, else the reason."""
    simulation = surfacechem.load(name)
    solution = simulation.run()
    if why := obstacle(simulation, solution):
        return [name, "", "", "", "", "", "", why]
    model, run = simulation.model, simulation.case.run
    ours = solution.trajectory.result
    times = ours.times
    exact = model.solve(Run(times=tuple(times), rtol=1e-13, looks=0.0)).result.outputs
    size = np.abs(exact).max(axis=0)
    size[size == 0] = 1.0

    def error(found: Array | None) -> float:
        return np.inf if found is None or found.shape != exact.shape else float(np.max(np.abs(found - exact) / size))

    own, rates, problem = error(ours.outputs), rates_of(model), model.problem(run, model.values())
    spent = seconds(lambda: simulation.run().audit)
    judged = seconds(lambda: with_error(simulation.run()))
    reached, rtol = np.inf, TOLERANCES[-1]
    for rtol in TOLERANCES:
        reached = error(script(rates, problem, times, rtol))
        if reached <= own:
            break
    theirs = seconds(lambda: script(rates, problem, times, rtol))
    if not np.isfinite(reached):
        return [name, *f"{1e3 * spent:.2f} {1e3 * judged:.2f} {own:.1e}".split(), "", "", "", "fails at the tightest"]
    note = "" if reached <= own else "as good as ours at no tolerance"
    row = f"{1e3 * spent:.2f} {1e3 * judged:.2f} {own:.1e} {1e3 * theirs:.2f} {reached:.1e} {theirs / spent:.2f}"
    return [name, *row.split(), note]


def main() -> None:
    """Measure the cases and keep the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", type=Path, default=Path(__file__).parent / "results")
    parser.add_argument("--cases", default=",".join(names()))
    chosen = parser.parse_args()
    with (chosen.folder / "scripts.csv").open("w", newline="") as file:
        table = csv.writer(file)
        table.writerow(
            ["case", "run [ms]", "with its error [ms]", "its error", "LSODA [ms]", "its error", "ratio", "note"]
        )
        for name in chosen.cases.split(","):
            row = measured(name)
            print(" ".join(f"{cell:>12}" if i else f"{cell:34}" for i, cell in enumerate(row)), flush=True)
            table.writerow(row)


if __name__ == "__main__":
    main()
