"""A program at one state after another, or at several at once, for a library that calls from Python: no array is made
twice.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import numpy as np

from surfacechem.compile.program import CODE, Function, Program
from surfacechem.solve.contract import Array
from surfacechem.solve.radau import stepper
from surfacechem.solve.radau.solver import search_batch
from surfacechem.solve.radau.stepper import COLUMNS, END


class Evaluation:
    """State, derivatives and parameters of a program in one buffer, made consistent by :meth:`put`.

    ``y``, ``ydot`` and ``parameters`` are views of it; algebraic variables are searched from ``guess``, where they were
    at the time before. ``ledger()`` are the rates of the ledger there, ``margins()`` the values of the margins.
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
        ends, table = self.inputs[: 2 * n + 1][None], self.parameters[None, None]
        self._rates = _Code(program.rates, self.inputs, self.ydot) if program.rates else None
        self._search = stepper.Repeated(search_batch(program, ends, table, self._counts))
        self._reads = _Code(program.filler.reads if program.filler else None, self.inputs)
        self._ledger = _Code(program.ledger, self.inputs)
        self._margins = _Code(program.margins, self.inputs)

    def put(self, t: float, differential: Array) -> bool:
        """Go to a state; whether derivatives and algebraic variables were found there."""
        # At the same time the search begins at the same place: an integrator that differentiates by 1e-27 m would
        # else divide by it what rounding makes of two searches, and take a step that it does not correct for right.
        if t != self.inputs[0]:
            self.guess = self._found
        self.inputs[0] = t
        if self._rates is not None:
            self.y[:] = differential
            self._fill()
            # Nothing times a number is nothing, unless that is infinite or none.
            return math.isfinite(self._rates().dot(self._nothing))
        self.y[self.free] = differential
        self.y[self.algebraic] = self.guess
        self.ydot[:] = 0.0
        self._fill()
        self._counts[:] = 0
        self._search()
        found = bool(self._counts[0, END] == 0)
        if found:
            self._found = self.y[self.algebraic]
        return found

    def hold(self, t: float, y: Array, ydot: Array, whole: bool = True) -> None:
        """Go to a state that is known, with the parameters that come from outside if the whole of it is asked for."""
        self.inputs[0] = t
        self.y[:] = y
        self.ydot[:] = ydot
        if whole:
            self._fill()

    def _fill(self) -> None:
        filler = self.program.filler
        if filler is not None:
            self.inputs[filler.positions] = filler.evaluate(self._reads().tolist())

    def restart(self, y: Array) -> None:
        """Take over a state after a jump; algebraic variables are searched from there."""
        self.y[:] = y
        self.guess = self._found = y[self.algebraic]

    def slopes(self) -> Array:
        """Derivatives of the differential variables."""
        return self.ydot[self.free] if len(self.algebraic) else self.ydot

    def rates(self) -> Array:
        """Derivatives of the differential variables and of the ledger."""
        return np.concatenate((self.slopes(), self._ledger()))

    def ledger(self) -> Array:
        """Rates of the ledger."""
        return self._ledger().copy()

    def margins(self) -> Array:
        """Values of the margins."""
        return self._margins().copy()


def at_rows(program: Program, parameters: Array, times: Array, y: Array) -> tuple[Array, Array, Array, Array]:
    """The equations at many states with the same parameters: states with the algebraic variables found, which are not a
    number where there are none, their derivatives, rates of the ledger and values of the margins, a row for each.
    """
    n, count = program.n, len(times)
    rows = program.filled(_inputs(parameters, times, y))
    if program.rates is not None:
        rows[:, 1 + n : 1 + 2 * n] = program.rates(rows)
        found = np.isfinite(rows[:, 1 + n : 1 + 2 * n]).all(axis=1)
    else:
        ends, counts = rows[:, : 1 + 2 * n].copy(), np.zeros((count, COLUMNS), np.int64)
        table = np.ascontiguousarray(rows[:, None, 1 + 2 * n :])
        stepper.run(search_batch(program, ends, table, counts), 0, count)
        rows[:, : 1 + 2 * n], found = ends, counts[:, END] == 0
    rows[~found, 1 : 1 + 2 * n] = np.nan
    ledger, margins = (
        function(rows) if function else np.zeros((count, 0)) for function in (program.ledger, program.margins)
    )
    return rows[:, 1 : 1 + n], rows[:, 1 + n : 1 + 2 * n], ledger, margins


def margins_at_rows(program: Program, parameters: Array, times: Array, y: Array) -> Array:
    """Values of margins that read nothing but the state, at many states with the same parameters, a row for each."""
    assert program.margins is not None
    return program.margins(_inputs(parameters, times, y))


def _inputs(parameters: Array, times: Array, y: Array) -> Array:
    return np.concatenate((times[:, None], y, np.zeros_like(y), np.tile(parameters, (len(times), 1))), axis=1)


class _Code:
    """A compiled function of a buffer of inputs, each of its pieces: a call from NumPy takes five times as long."""

    def __init__(self, function: Function | None, inputs: Array, out: Array | None = None) -> None:
        self.out = np.zeros(function.size if function else 0) if out is None else out
        self._calls: list[Callable[[], object]] = []
        place = self.out.ctypes.data
        for part in (function, *function.rest) if function else ():
            self._calls.append(partial(CODE(part.address), place, inputs.ctypes.data, part.user))
            place += part.n_out * self.out.itemsize
        self._keep = function

    def __call__(self) -> Array:
        for call in self._calls:
            call()
        return self.out
