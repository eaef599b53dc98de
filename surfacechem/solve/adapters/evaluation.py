"""Evaluation of a program at one state after another, or at several at once, for libraries that call from Python.

Buffers are reused, so that no array is allocated twice.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property, partial

import numpy as np

from surfacechem.compile.program import C_FUNCTION, ExternalInputs, Function, Program
from surfacechem.solve.contract import Array
from surfacechem.solve.radau import stepper
from surfacechem.solve.radau.solver import search_batch
from surfacechem.solve.radau.stepper import COLUMNS, END


class Evaluation:
    """State, derivatives and parameters of a program in one buffer, made consistent by :meth:`put`.

    ``y``, ``ydot`` and ``parameters`` are views of it; the search for algebraic variables starts from ``guess``, their
    values at the last time. ``ledger()`` returns the rates of the ledger, ``margins()`` the margins.
    """

    def __init__(self, program: Program, y: Array, parameters: Array) -> None:
        n = program.n
        self.program = program
        self.inputs = np.concatenate(([0.0], y, np.zeros(n), parameters))
        self.y, self.ydot, self.parameters = np.split(self.inputs[1:], [n, 2 * n])
        self.free, self.algebraic = map(np.flatnonzero, (~program.algebraic_mask, program.algebraic_mask))
        self.guess = self._found = y[self.algebraic]
        self._nothing = np.zeros(n)
        self._counts = np.zeros((1, COLUMNS), np.int64)
        self._rates = _Code(program.rates, self.inputs, self.ydot) if program.rates else None
        self._external = program.external
        self._reads = _Code(program.external.reads if program.external else None, self.inputs)
        self._ledger = _Code(program.ledger, self.inputs)
        self._margins = _Code(program.margins, self.inputs)

    @cached_property
    def _search(self) -> Callable[[], None]:
        ends, table = self.inputs[: 2 * self.program.n + 1][None], self.parameters[None, None]
        return stepper.LOOP.repeated(search_batch(self.program, ends, table, self._counts))

    def put(self, t: float, differential: Array) -> bool:
        """Set time and differential variables; True if derivatives and algebraic variables were found."""
        # Zero times an infinite rate or NaN is NaN, so one product tests all rates.
        return self.reach(t, differential) and (self._rates is None or math.isfinite(self.ydot.dot(self._nothing)))

    def reach(self, t: float, differential: Array) -> bool:
        """Set time and differential variables; True if algebraic variables were found.

        Without any of these, derivatives may not be finite.
        """
        if self._rates is not None:
            self.inputs[0] = t
            if differential is not self.y:
                self.y[:] = differential
            if self._external is not None:
                self._fill(self._external)
            self._rates()
            return True
        # At the same time start from the same guess: an integrator that takes differences over 1e-27 m would
        # otherwise divide the roundoff of two searches by it, and accept a wrong step as needing no correction.
        if t != self.inputs[0]:
            self.guess = self._found
            self.inputs[0] = t
        self.y[self.free] = differential
        self.y[self.algebraic] = self.guess
        self.ydot[:] = 0.0
        if self._external is not None:
            self._fill(self._external)
        self._counts[:] = 0
        self._search()
        found = bool(self._counts[0, END] == 0)
        if found:
            self._found = self.y[self.algebraic]
        return found

    def hold(self, t: float, y: Array, ydot: Array, whole: bool = True) -> None:
        """Set a known state, with the parameters from external code if ``whole`` is set."""
        self.inputs[0] = t
        self.y[:] = y
        self.ydot[:] = ydot
        if whole and self._external is not None:
            self._fill(self._external)

    def _fill(self, external: ExternalInputs) -> None:
        self.inputs[external.positions] = external.evaluate(self._reads().tolist())

    def restart(self, y: Array) -> None:
        """Set the state after a jump; the search for algebraic variables starts from there."""
        self.y[:] = y
        self.guess = self._found = y[self.algebraic]

    def slopes(self) -> Array:
        """Return the derivatives of the differential variables."""
        return self.ydot[self.free] if len(self.algebraic) else self.ydot

    def rates(self) -> Array:
        """Return the derivatives of the differential variables and of the ledger."""
        return np.concatenate((self.slopes(), self._ledger()))

    def ledger(self) -> Array:
        """Return the rates of the ledger."""
        return self._ledger().copy()

    def margins(self) -> Array:
        """Return the margins."""
        return self._margins().copy()


class Evaluations:
    """Evaluation of a program at many states at once, in one reused buffer."""

    def __init__(self, program: Program, parameters: Array) -> None:
        self.program = program
        self._inputs = np.concatenate((np.zeros(1 + 2 * program.n), parameters))[None]

    def __call__(self, times: Array, y: Array, parameters: Array | None = None) -> tuple[Array, Array, Array, Array]:
        """Return consistent states and rates, NaN where none exist, rates of the ledger and margins, by time.

        ``parameters``, one row or one for each time, are those of this and of later calls.
        """
        program, n = self.program, self.program.n
        rows = self._filled(times, y)
        if parameters is not None:
            rows[:, 1 + 2 * n :] = parameters
        rows = program.filled(rows)
        states, ydot = rows[:, 1 : 1 + n], rows[:, 1 + n : 1 + 2 * n]
        if program.rates is not None:
            ydot[:] = program.rates(rows)
            found = np.isfinite(ydot)
        else:
            ends, counts = rows[:, : 1 + 2 * n].copy(), np.zeros((len(rows), COLUMNS), np.int64)
            table = np.ascontiguousarray(rows[:, None, 1 + 2 * n :])
            stepper.LOOP.run(search_batch(program, ends, table, counts))
            rows[:, : 1 + 2 * n], found = ends, counts[:, END] == 0
        if not found.all():
            lost = ~found.reshape(len(rows), -1).all(axis=1)
            states[lost] = ydot[lost] = np.nan
        ledger, margins = (
            function(rows) if function else np.zeros((len(rows), 0)) for function in (program.ledger, program.margins)
        )
        return states.copy(), ydot.copy(), ledger, margins

    def margins(self, times: Array, y: Array) -> Array:
        """Return margins that depend on time and state alone, a row for each time."""
        assert self.program.margins is not None
        return self.program.margins(self._filled(times, y))

    def _filled(self, times: Array, y: Array) -> Array:
        """Return the buffer with these states; earlier ones are overwritten."""
        n, count = self.program.n, len(times)
        if count > len(self._inputs):
            self._inputs = np.repeat(self._inputs[:1], count, axis=0)
        rows = self._inputs[:count]
        rows[:, 0], rows[:, 1 : 1 + n], rows[:, 1 + n : 1 + 2 * n] = times, y, 0.0
        return rows


class _Code:
    """A compiled function of a buffer of inputs: a call through NumPy takes five times as long."""

    def __init__(self, function: Function | None, inputs: Array, out: Array | None = None) -> None:
        self.out = np.zeros(function.n_out if function else 0) if out is None else out
        self._call: Callable[[], object] = lambda: None
        if function:
            self._call = partial(C_FUNCTION(function.address), self.out.ctypes.data, inputs.ctypes.data, function.user)
        self._keep = function

    def __call__(self) -> Array:
        self._call()
        return self.out
