"""Time of a run against the number of cells in each body, beside SUNDIALS with its banded matrices.

    python benchmarks/conduction.py

Two slabs in contact through a resistance, 20 s, at rtol 1e-8; IDA gets the same compiled equations, in an order in
which they are banded, and differences in place of derivatives. Least CPU time of several runs; compile time apart.
"""

import time
from collections.abc import Callable

import numpy as np
from sksundae.ida import IDA

from surfacechem.format import load_text
from surfacechem.runs.simulation import Simulation

CELLS = (25, 50, 100, 200, 400)
RTOL, END, REPEATS = 1e-8, 20.0, 5
CASE = """
bodies:
  lower: {{temperature: T_1, capacity: constant, C: 4 kJ/m^2/K, conduction: {{{slab}}}}}
  upper: {{temperature: T_2, capacity: constant, C: 4 kJ/m^2/K, conduction: {{{slab}}}}}
heat: [conductance: {{between: [lower, upper], h: 1 kW/m^2/K}}]
T_0: 300 K
initial: {{T_1: 400 K, T_2: 300 K}}
run: {{until: 20 s, outputs: 11, rtol: {rtol}}}
"""


def scene(cells: int) -> Simulation:
    """Two slabs of so many cells each."""
    slab = f"thickness: 2 mm, conductivity: 0.2 W/m/K, cells: {cells + cells % 2}"
    return Simulation(load_text(CASE.format(slab=slab, rtol=RTOL)))


def least(run: Callable[[], object]) -> float:
    """Least CPU time of a run [s]."""
    times = []
    for _ in range(REPEATS):
        start = time.process_time()
        run()
        times.append(time.process_time() - start)
    return min(times)


def banded(simulation: Simulation) -> Callable[[], object]:
    """The same run by IDA, its unknowns in an order in which the matrix is banded."""
    program, n = simulation.model.program, simulation.model.program.n
    inside = (n - 2) // 2
    order = np.array([*range(inside + 1, 1, -1), 0, 1, *range(inside + 2, n)])
    problem = simulation.model.problem(simulation.case.run, simulation.model.values())
    inputs = np.concatenate([np.zeros(1 + 2 * n), problem.parameters[0]])

    def residual(t: float, y: np.ndarray, rate: np.ndarray, out: np.ndarray) -> None:
        inputs[0], inputs[1 + order], inputs[1 + n + order] = t, y, rate
        out[:] = program.residual(inputs)[order]

    weights = np.abs(program.derivatives(np.concatenate([[0.0], problem.y0, 0 * problem.y0, problem.parameters[0]]))[1])
    assert not np.any(np.abs(np.subtract.outer(np.argsort(order), np.argsort(order)))[weights > 0] > 2)
    matrix = program.derivatives(np.concatenate([[0.0], problem.y0, 0 * problem.y0, problem.parameters[0]]))
    inputs[1 : 1 + n], inputs[1 + n : 1 + 2 * n] = problem.y0, 0.0
    rate = np.linalg.solve(matrix[1], -program.residual(inputs))

    def run() -> object:
        solver = IDA(
            residual, rtol=RTOL, atol=1e-6 * RTOL * 300, linsolver="band", lband=2, uband=2, max_num_steps=100_000
        )
        return solver.solve(np.linspace(0.0, END, 11), problem.y0[order], rate[order])

    return run


def main() -> None:
    """Print the table."""
    print("cells  compile [s]  run [ms]  steps  IDA, banded [ms]  difference [K]")
    for cells in CELLS:
        start = time.process_time()
        simulation = scene(cells)
        model = simulation.model
        compiled = time.process_time() - start
        solved = model.solve(simulation.case.run)
        ours = least(lambda model=model, run=simulation.case.run: model.solve(run))
        other = banded(simulation)
        theirs = least(other)
        n = model.program.n
        difference = abs(other().y[-1][(n - 2) // 2] - solved.result.outputs[-1, 0])
        print(
            f"{cells:5d}  {compiled:11.2f}  {1e3 * ours:8.2f}  {solved.result.counters.steps:5d}  {1e3 * theirs:16.1f}"
            f"  {difference:14.1e}"
        )


if __name__ == "__main__":
    main()
