"""SUNDIALS' CVODE and IDA under the contract, through scikit-sundae."""

import os
from contextlib import redirect_stdout
from typing import Any

import numpy as np
from sksundae.cvode import CVODE
from sksundae.ida import IDA

from surfacechem.solve.adapters.dense_step import DenseStep
from surfacechem.solve.adapters.stepping import Method, StepError, SteppingSolver, View
from surfacechem.solve.contract import Array, Problem
from surfacechem.tolerances import ROUNDING

NAMES = ("cvode", "ida")

# Warnings that steps are small would go to the terminal; what a step fails of is raised.
os.environ.setdefault("SUNLOGGER_WARNING_FILENAME", os.devnull)


class _Stretch(Method):
    """Single steps of either library; interpolation inside the last step is a step back to it."""

    def __init__(self, library: Any, t: float, end: float, *start: Array) -> None:
        self.integrator = library
        self.end = end
        self.t = t
        self.x = start[0]
        self._call(lambda: library.init_step(t, *start))

    def _call(self, action: Any) -> Any:
        # The wrapper prints what it also raises.
        try:
            with redirect_stdout(None):
                answer = action()
        except (ValueError, RuntimeError, ArithmeticError, np.linalg.LinAlgError, SystemError) as error:
            raise StepError(str(error)) from error
        except KeyError as error:  # the library's wrapper has no words for this return code
            raise StepError(f"SUNDIALS gave up with its return code {error}") from error
        if not answer.success:
            raise StepError(str(answer.message))
        return answer

    def advance(self) -> DenseStep:
        before = self.t
        # After an interpolation the library first returns to where it was.
        for _attempt in range(2):
            answer = self._call(lambda: self.integrator.step(self.end, method="onestep", tstop=self.end))
            self.t, self.x = float(answer.t), np.array(answer.y)
            if self.t > before:
                break
        return DenseStep(before, self.t, self._at)

    def _at(self, t: float) -> Array:
        if t >= self.t:  # by rounding: asked for what is beyond, the library would step on
            return self.x
        answer = self._call(lambda: self.integrator.step(t, method="normal", tstop=self.end))
        if not abs(answer.t - t) <= ROUNDING * abs(t):
            raise StepError(f"asked for t = {t}, given t = {answer.t}")
        return np.array(answer.y)


def _longest(problem: Problem) -> float:
    """Longest step, as either library is told it; 0 where there is none."""
    return problem.spacing if np.isfinite(problem.spacing) else 0.0


class CVODESolver(SteppingSolver):
    """BDF of variable order; algebraic variables are eliminated inside the right-hand side."""

    name = "cvode"

    def begin(self, view: View, t: float, end: float, y: Array, ydot: Array) -> Method:

        def rates(t: float, x: Array, out: Array) -> None:
            out[:] = view.reduced_rates(t, x)

        def jacobian(t: float, x: Array, _rates: Array, out: Array) -> None:
            out[:] = view.reduced_jacobian(t, x)

        library = CVODE(
            rates,
            rtol=view.problem.rtol,
            atol=view.atol,
            jacfn=jacobian,
            max_num_steps=100_000,
            max_step=_longest(view.problem),
        )
        return _Stretch(library, t, end, y[view.differential])


class IDASolver(SteppingSolver):
    """BDF of variable order on the implicit equations themselves."""

    name = "ida"
    keeps_algebraic = True

    def begin(self, view: View, t: float, end: float, y: Array, ydot: Array) -> Method:
        program = view.problem.program

        def residual(t: float, x: Array, rate: Array, out: Array) -> None:
            view.residuals += 1
            out[:] = program.residual(view.inputs(t, x, rate))

        def jacobian(t: float, x: Array, rate: Array, _residual: Array, shift: float, out: Array) -> None:
            by_state, by_rate = view.matrices(t, x, rate)
            out[:] = by_state + shift * by_rate

        library = IDA(
            residual,
            rtol=view.problem.rtol,
            atol=view.problem.atol,
            jacfn=jacobian,
            max_num_steps=100_000,
            max_step=_longest(view.problem),
            algebraic_idx=list(np.flatnonzero(program.algebraic_mask)) or None,
        )
        return _Stretch(library, t, end, y, ydot)


def make(name: str) -> SteppingSolver:
    """The solver of this name."""
    return CVODESolver() if name == "cvode" else IDASolver()
