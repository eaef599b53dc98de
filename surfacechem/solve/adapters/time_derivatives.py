"""Rates along a trajectory."""

import numpy as np

from surfacechem.solve.contract import Array, Result
from surfacechem.solve.radau.solver import consistent


def output_rates(result: Result) -> Array:
    """Derivatives at the outputs, from the equations: the polynomial's own derivative is one order less accurate."""
    problem = result.problem
    if not len(result.times):
        return np.empty_like(result.outputs)
    segment = result.segments_at(result.times, result.segment)
    guess = np.zeros_like(result.outputs)
    return consistent(problem.program, result.times, result.outputs, guess, problem.parameters[segment]).ydot
