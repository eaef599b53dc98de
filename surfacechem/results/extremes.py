"""What a run has met that a reader has to know: rates so fast that none resolves them, and laws out of their sense."""

from __future__ import annotations

import numpy as np
import symengine
from numpy.typing import NDArray

from surfacechem.expressions import EXPONENT_CAP
from surfacechem.model.system import System
from surfacechem.solve.run import Trajectory
from surfacechem.tolerances import ROUNDING


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


def cautions(trajectory: Trajectory) -> list[str]:
    """What an output or a step of a run gives reason to be cautious of."""
    system = trajectory.model.system
    return cautioned(system, _inputs(trajectory)) if system.cautions else []


def cautioned(system: System, rows: NDArray[np.float64]) -> list[str]:
    """The cautions that apply at one of several states, which are the arguments of compiled functions."""
    if not (system.cautions and len(rows)):
        return []
    expressions = [system.expand(item.expression) for item in system.cautions]
    values = symengine.Lambdify(system.inputs, expressions, backend="lambda")(rows).reshape(len(rows), -1)
    least, size = np.nanmin(values, axis=0), np.nanmax(np.abs(values), axis=0)
    return [item.text for item, x in zip(system.cautions, least < -ROUNDING * size, strict=True) if x]


def _inputs(trajectory: Trajectory) -> NDArray[np.float64]:
    """Arguments of compiled functions at the outputs and steps."""
    result, model = trajectory.result, trajectory.model
    rows = [model.inputs(result, result.times, result.outputs, trajectory.rates)]
    if result.steps is not None:
        rows.append(model.inputs(result, result.steps.t, result.steps.y, result.steps.ydot))
    return np.concatenate(rows)
