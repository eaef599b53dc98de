"""Rates so fast that no run resolves them: those that were capped are never used silently."""

from __future__ import annotations

import numpy as np
import symengine
from numpy.typing import NDArray

from surfacechem.expressions import EXPONENT_CAP
from surfacechem.integrate import Trajectory


def capped_rates(trajectory: Trajectory) -> list[str]:
    """Laws whose rate was beyond exp(EXPONENT_CAP) at an output or a step of a run, in words."""
    system = trajectory.model.system
    if not system.capped:
        return []
    table = _inputs(trajectory)
    if not len(table):  # a run that ends at its start
        return []
    found = []
    for law in system.capped:
        # Interpreted, since they are needed once.
        exponents = [system.expand(expression) for expression in law.exponents]
        values = symengine.Lambdify(system.inputs, exponents, backend="lambda")(table)
        largest = float(np.nanmax(values, initial=-np.inf))
        if largest > EXPONENT_CAP:
            found.append(
                f"{law.title}: the logarithm of its rate coefficient (SI) reached {largest:.4g}; above "
                f"{EXPONENT_CAP:g} the rate goes on along its tangent: it is instantaneous, but not the one stated"
            )
    return found


def _inputs(trajectory: Trajectory) -> NDArray[np.float64]:
    """Arguments of compiled functions at the outputs and steps."""
    result, model = trajectory.result, trajectory.model
    rows = [model.inputs(result, result.times, result.outputs, trajectory.rates)]
    if result.steps is not None:
        rows.append(model.inputs(result, result.steps.t, result.steps.y, result.steps.ydot))
    return np.concatenate(rows)
