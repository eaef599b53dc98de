"""SciPy's LSODA, BDF and Radau under the contract."""

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.integrate import BDF, LSODA, OdeSolver, Radau

from surfacechem.solve.adapters.dense_step import DenseStep, Steps
from surfacechem.solve.adapters.stepping import Method, NoStateError, SingleSteps, StepError, SteppingSolver, View
from surfacechem.solve.contract import Array, Counters
from surfacechem.tolerances import EPS

NAMES = ("lsoda", "bdf", "scipy-radau")

SMALLEST_RTOL = 100 * EPS
"""Smallest relative tolerance of SciPy, which raises smaller ones to it with a warning."""


class _Stretch(SingleSteps):
    def __init__(self, kind: type[OdeSolver], view: View, t: float, end: float, y: Array) -> None:
        super().__init__(view.problem.max_steps, t, end)
        self.failure: Exception | None = None
        self.view = view
        options: dict[str, Any] = {
            "rtol": max(view.problem.rtol, SMALLEST_RTOL),
            "atol": view.atol,
            "jac": lambda since, x: view.reduced_jacobian(t + since, x),
            "max_step": view.problem.spacing,
        }
        try:
            start = y[view.differential]
            self.solver = kind(lambda since, x: view.reduced_rates(t + since, x), 0.0, start, end - t, **options)
        except (ValueError, ArithmeticError) as error:
            raise StepError(str(error)) from error

    def several(self, most: int) -> Steps:
        steps: list[DenseStep] = []
        longest = min(self.view.problem.spacing, self.view.growing_size(self.t, self.solver.y))
        self.solver.max_step = longest  # type: ignore[attr-defined]  # of each of SciPy's implicit methods
        while self.failure is None and len(steps) < most and not (steps and self.t == self.end):
            try:
                steps.append(self.advance())
            except (StepError, NoStateError) as error:
                self.failure = error  # an event may lie before it
        if not steps and self.failure is not None:
            raise self.failure
        return Steps.of(steps)

    def dense(self) -> Callable[[float], Array]:
        inside, start, end, last = self.solver.dense_output(), self.start, self.t, self.solver.y.copy()
        # The time of the run may round to before the library's last step.
        return lambda t: np.asarray(last if t == end else inside(max(t - start, inside.t_old)))

    def step(self) -> float:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            try:
                message = self.solver.step()
            except (ValueError, ArithmeticError, np.linalg.LinAlgError) as error:
                raise StepError(str(error)) from error
        if self.solver.status == "failed":
            raise StepError(str(message))
        return float(self.solver.t)

    @property
    def counters(self) -> Counters:
        return Counters(factorizations=int(self.solver.nlu))


class SciPySolver(SteppingSolver):
    """One method of ``scipy.integrate``; algebraic variables are eliminated inside the right-hand side."""

    def __init__(self, name: str, kind: type[OdeSolver]) -> None:
        self.name = name
        self.kind = kind

    def begin(self, view: View, t: float, end: float, y: Array, ydot: Array) -> Method:
        return _Stretch(self.kind, view, t, end, y)


def make(name: str) -> SciPySolver:
    """Return the solver of this name."""
    return SciPySolver(name, {"lsoda": LSODA, "bdf": BDF, "scipy-radau": Radau}[name])
