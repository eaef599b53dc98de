"""A program at one state after another, or at several at once, for a library that calls from Python: no array is made
twice.
"""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np

from surfacechem.compile.program import Function, Program
from surfacechem.solve.contract import Array
from surfacechem.solve.radau import stepper
from surfacechem.solve.radau.solver import search_batch
from surfacechem.solve.radau.stepper import COLUMNS, END

CODE = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p)


class Evaluation:
    """State, derivatives and parameters of a program in one buffer, made consistent by :meth:`put`.

    ``y``, ``ydot`` and ``parameters`` are views of it; algebraic variables are searched from ``guess``, where they were
    last. ``ledger()`` are the rates of the ledger there, ``margins()`` the values of the margins.
    """

    def __init__(self, program: Program, y: Array, parameters: Array) -> None:
        n = program.n
        self.program = program
        self.inputs = np.concatenate(([0.0], y, np.zeros(n), parameters))
        self.y, self.ydot, self.parameters = np.split(self.inputs[1:], [n, 2 * n])
        self.free, self.algebraic = map(np.flatnonzero, (~program.algebraic_mask, program.algebraic_mask))
        self.guess = y[self.algebraic]
        self._counts = np.zeros((1, COLUMNS), np.int64)
        ends, table = self.inputs[: 2 * n + 1][None], self.parameters[None, None]
        self._rates = _Code(program.rates, self.inputs[None]) if program.rates else None
        self._search = stepper.Repeated(search_batch(program, ends, table, self._counts))
        self._fill = _Fill(program, self.inputs[None])
        self._ledger = _Code(program.ledger, self.inputs[None])
        self._margins = _Code(program.margins, self.inputs[None])

    def put(self, t: float, differential: Array) -> bool:
        """Go to a state; whether derivatives and algebraic variables were found there."""
        self.inputs[0] = t
        self.y[self.free] = differential
        self.y[self.algebraic] = self.guess
        self.ydot[:] = 0.0
        self._fill()
        if self._rates is not None:
            self.ydot[:] = self._rates()[0]
            return bool(np.isfinite(self.ydot).all())
        self._counts[:] = 0
        self._search()
        found = bool(self._counts[0, END] == 0)
        if found:
            self.guess = self.y[self.algebraic]
        return found

    def hold(self, t: float, y: Array, ydot: Array, whole: bool = True) -> None:
        """Go to a state that is known, with the parameters that come from outside if the whole of it is asked for."""
        self.inputs[0] = t
        self.y[:] = y
        self.ydot[:] = ydot
        if whole:
            self._fill()

    def restart(self, y: Array) -> None:
        """Take over a state after a jump; algebraic variables are searched from there."""
        self.y[:] = y
        self.guess = y[self.algebraic]

    def rates(self) -> Array:
        """Derivatives of the differential variables and of the ledger."""
        return np.concatenate((self.ydot[self.free], self.ledger()))

    def ledger(self) -> Array:
        """Rates of the ledger."""
        return self._ledger()[0].copy()

    def margins(self) -> Array:
        """Values of the margins."""
        return self._margins()[0].copy()


class StateRows:
    """A program at so many states at once, with the same parameters.

    ``y`` and ``ydot``, a row for each state, are views of its buffer.
    """

    def __init__(self, program: Program, parameters: Array, count: int) -> None:
        n = program.n
        self.program = program
        self.inputs = np.zeros((count, program.n_inputs))
        self.inputs[:, 1 + 2 * n :] = parameters
        self.y, self.ydot = self.inputs[:, 1 : 1 + n], self.inputs[:, 1 + n : 1 + 2 * n]
        self._ends = np.zeros((count, 1 + 2 * n))
        self._counts = np.zeros((count, COLUMNS), np.int64)
        self._table = np.ascontiguousarray(self.inputs[:, None, 1 + 2 * n :])
        self._rates = _Code(program.rates, self.inputs) if program.rates else None
        self._search = stepper.Repeated(search_batch(program, self._ends, self._table, self._counts))
        self._fill = _Fill(program, self.inputs)
        self._ledger = _Code(program.ledger, self.inputs)
        self._margins = _Code(program.margins, self.inputs)

    def hold(self, times: Array, y: Array) -> None:
        """Go to states whose derivatives are not known."""
        self.inputs[:, 0] = times
        self.y[:] = y
        self.ydot[:] = 0.0

    def put(self, times: Array, y: Array) -> None:
        """Go to states, and find derivatives and algebraic variables of each; not a number where there are none."""
        self.hold(times, y)
        self._fill()
        if self._rates is not None:
            self.ydot[:] = self._rates()
            self.inputs[~np.isfinite(self.ydot).all(axis=1), 1 : 1 + 2 * self.program.n] = np.nan
            return
        n = self.program.n
        if self.program.filler is not None:
            self._table[:, 0] = self.inputs[:, 1 + 2 * n :]
        self._ends[:], self._counts[:] = self.inputs[:, : 1 + 2 * n], 0
        self._search()
        self._ends[self._counts[:, END] != 0, 1:] = np.nan
        self.inputs[:, : 1 + 2 * n] = self._ends

    def ledger(self) -> Array:
        """Rates of the ledger, a row each."""
        return self._ledger().copy()

    def margins(self) -> Array:
        """Values of the margins, a row each."""
        return self._margins().copy()


class _Code:
    """A compiled function of fixed rows of inputs, each of its pieces: a call from NumPy takes five times as long."""

    def __init__(self, function: Function | None, inputs: Array) -> None:
        self.out = np.zeros((len(inputs), function.size if function else 0))
        self._calls: list[tuple[Any, int, int, int]] = []
        for row, result in zip(inputs, self.out, strict=True):
            place = result.ctypes.data
            for part in (function, *function.rest) if function else ():
                self._calls.append((CODE(part.address), place, row.ctypes.data, part.user))
                place += part.n_out * self.out.itemsize
        self._keep = function

    def __call__(self) -> Array:
        for code, *arguments in self._calls:
            code(*arguments)
        return self.out


class _Fill:
    """Fills rows of inputs with what comes from outside, if anything does."""

    def __init__(self, program: Program, inputs: Array) -> None:
        self.inputs, self.filler = inputs, program.filler
        self._reads = _Code(program.filler.reads if program.filler else None, inputs)

    def __call__(self) -> None:
        if self.filler is not None:
            for row, values in zip(self.inputs, self._reads().tolist(), strict=True):
                row[self.filler.positions] = self.filler.evaluate(values)
