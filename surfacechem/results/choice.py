"""Runs as accurate as was asked: tolerance from the accuracy, error estimated, tightened where it is missed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from surfacechem.results.accuracy import MARGIN, TIGHTEST, second_tolerance
from surfacechem.results.achieved import apart, floors, second_run, stated, unknown
from surfacechem.results.solution import Accuracy
from surfacechem.solve import ASKING
from surfacechem.solve.run import Model, Run, Trajectory


def asked(run: Run) -> float:
    """The relative accuracy that a run asks for."""
    return run.accuracy if run.accuracy is not None else run.rtol / MARGIN


def solve(model: Model, run: Run, changes: Mapping[str, float] | None = None) -> tuple[Trajectory, Accuracy]:
    """The loosest run of a row, each tighter by a hundred, that differs from the next by no more than was asked.

    The first has a hundredth of the accuracy as its tolerance. Most runs are confirmed by their second, so the cost is
    that of two runs, the second at a hundredth of the tolerance.
    """
    return verified(model.solve(run, changes))


def verified(first: Trajectory) -> tuple[Trajectory, Accuracy]:
    """The run, or a tighter one, that has the accuracy that was asked for as far as a next one tells."""
    wanted = asked(first.run)
    while True:
        last = first.run.rtol <= TIGHTEST
        second = first.model.resolve(first, second_tolerance(first.run.rtol))
        found = replace(compared(first, second), asked=wanted)
        if second.status == "failed" or found.error <= wanted:
            return first, found
        if last:
            return first, replace(found, source=f"{found.source}; {_missed(first, wanted)}")
        first = second


def compared(first: Trajectory, second: Trajectory) -> Accuracy:
    """Largest differences of two runs: of states and of times of events, the end among them where physics set it."""
    rtol = second.run.rtol
    if second.status == "failed":
        return unknown(f"a second run at rtol {rtol:.0e} failed: {second.reason}")
    source = second_run(second.run)
    if first.status != second.status:
        return Accuracy(math.inf, f"{source}, which {second.status}: {second.reason}")
    errors, others = apart(first, second)
    if others and first.run.rtol > TIGHTEST:  # there rounding decides of events that change nothing
        return Accuracy(math.inf, f"{source}, which had {others}")
    if not errors:
        return unknown("the run ended before its second output")
    return Accuracy(stated(errors), source, errors)


def rounding_of_time(trajectory: Trajectory) -> float:
    """Largest relative change of a state by the last bit of an output time: no run is nearer than that.

    It is large where a state runs towards a singular end.
    """
    result = trajectory.result
    size = np.maximum(np.abs(result.outputs), floors(trajectory))
    change = np.finfo(float).eps * np.abs(trajectory.rates) * result.times[:, None]
    return float(np.max(np.divide(change, size, out=np.zeros_like(change), where=size > 0), initial=0.0))


def _missed(trajectory: Trajectory, wanted: float) -> str:
    lost = rounding_of_time(trajectory)
    if lost > wanted / 10:
        return f"{wanted:.0e} is out of reach, as rounding of the time alone changes a state by {lost:.0e}"
    return f"{wanted:.0e} is not reached at the tightest tolerance"


def reasons(model: Model, run: Run) -> list[tuple[str, str, str]]:
    """What was chosen for a run and why, a row each."""
    chosen, system = model.chosen(run), model.system
    parts = ["algebraic states"] if any(state.algebraic for state in system.states) else []
    parts += ["jumps" if system.transitions else "margins"] if system.transitions or model.margins else []
    method = f"compiled, with exact Jacobian{''.join(f', {part}' for part in parts)}; order 5 to 13 by tolerance"
    if chosen.solver in ASKING:
        method = "rates of the mechanism come from Cantera itself, which it can ask"
    part = f"a hundredth of the accuracy {asked(run):.0e}, as errors of smooth runs are below 100 rtol"
    if run.rtol == TIGHTEST:
        part = f"for the accuracy {asked(run):.0e}; below this is rounding"
    return [
        ("solver", chosen.solver, method),
        ("rtol", f"{run.rtol:.0e}", part),
        (
            "verified",
            f"{second_tolerance(run.rtol):.0e}",
            "a second run must agree to the accuracy, else it is verified in turn",
        ),
    ]
