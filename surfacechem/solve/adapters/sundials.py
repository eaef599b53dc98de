"""SUNDIALS' CVODE and IDA under the contract, through scikit-sundae."""

import os
from collections.abc import Callable
from contextlib import redirect_stdout
from typing import Any

import numpy as np
from sksundae.cvode import CVODE
from sksundae.ida import IDA

from surfacechem.solve.adapters.stepping import Method, SingleSteps, StepError, SteppingSolver, View
from surfacechem.solve.contract import Array
from surfacechem.tolerances import RUN_EPS

NAMES = ("cvode", "ida")

# Suppress warnings about small steps on the terminal; failures of steps are raised.
os.environ.setdefault("SUNLOGGER_WARNING_FILENAME", os.devnull)


class _Stretch(SingleSteps):
    """Single steps of either library; dense output is a step back."""

    def __init__(self, library: Any, most: int, t: float, end: float, *start: Array) -> None:
        super().__init__(most, t, end)
        self.integrator, self.x, self.before = library, start[0], 0.0
        self._call(lambda: library.init_step(0.0, *start))

    def _call(self, action: Any) -> Any:
        # The wrapper prints the errors that it also raises.
        try:
            with redirect_stdout(None):
                answer = action()
        except (ValueError, RuntimeError, ArithmeticError, np.linalg.LinAlgError, SystemError) as error:
            raise StepError(str(error)) from error
        except KeyError as error:  # the wrapper has no message for this return code
            raise StepError(f"SUNDIALS gave up with its return code {error}") from error
        if not answer.success:
            raise StepError(str(answer.message))
        return answer

    def step(self) -> float:
        self.before, length, passed = self.passed, self.end - self.start, self.passed
        # After an interpolation the first call only returns to the end of the last step.
        for _attempt in range(2):
            if passed == self.before:
                answer = self._call(lambda: self.integrator.step(length, method="onestep", tstop=length))
                passed, self.x = float(answer.t), np.array(answer.y)
        return passed

    def dense(self) -> Callable[[float], Array]:
        return self._at

    def _at(self, t: float) -> Array:
        since = max(t - self.start, self.before)  # the time of the run may round to before this step
        if t >= self.t or since >= self.passed:  # beyond the end by roundoff, where the library would take another step
            return self.x
        answer = self._call(lambda: self.integrator.step(since, method="normal", tstop=self.end - self.start))
        if not abs(answer.t - since) <= RUN_EPS * since:
            raise StepError(f"asked for t = {t}, given t = {self.start + answer.t}")
        return np.array(answer.y)


def _options(view: View, t: float, y: Array) -> dict[str, Any]:
    """Return the settings that both libraries take; a longest step of 0 is unlimited."""
    longest = min(view.problem.spacing, view.growing_size(t, y[view.differential]))
    return {"rtol": view.problem.rtol, "max_num_steps": 100_000, "max_step": longest if np.isfinite(longest) else 0.0}


class CVODESolver(SteppingSolver):
    """BDF of variable order; algebraic variables are eliminated inside the right-hand side."""

    name = "cvode"
    keeps_longest = True

    def begin(self, view: View, t: float, end: float, y: Array, ydot: Array) -> Method:

        def rates(since: float, x: Array, out: Array) -> None:
            out[:] = view.reduced_rates(t + since, x)

        def jacobian(since: float, x: Array, _rates: Array, out: Array) -> None:
            out[:] = view.reduced_jacobian(t + since, x)

        self.check(len(y[view.differential]))
        first = view.first_step(end - t, y, ydot)
        options = _options(view, t, y) | ({"first_step": first} if np.isfinite(first) else {})
        library = CVODE(rates, atol=view.atol, jacfn=jacobian, **options)
        return _Stretch(library, view.problem.max_steps, t, end, y[view.differential])


class IDASolver(SteppingSolver):
    """BDF of variable order on the implicit equations themselves."""

    name = "ida"
    keeps_algebraic = keeps_longest = True

    def begin(self, view: View, t: float, end: float, y: Array, ydot: Array) -> Method:
        def residual(since: float, x: Array, rate: Array, out: Array) -> None:
            view.residuals += 1
            out[:] = view.program.residual(view.row(t + since, x, rate))

        def jacobian(since: float, x: Array, rate: Array, _residual: Array, shift: float, out: Array) -> None:
            by_state, by_rate = view.matrices(t + since, x, rate)
            out[:] = by_state + shift * by_rate

        indices, options = list(view.algebraic) or None, _options(view, t, y)
        library = IDA(residual, atol=view.problem.atol, jacfn=jacobian, algebraic_idx=indices, **options)
        return _Stretch(library, view.problem.max_steps, t, end, y, ydot)


def make(name: str) -> SteppingSolver:
    """Return the solver of this name."""
    return CVODESolver() if name == "cvode" else IDASolver()
