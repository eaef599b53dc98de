"""A program at one state after another, for a library that calls from Python: no array is made twice."""

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
        self._batch = search_batch(program, ends, table, self._counts)
        self.ledger = _Code(program.ledger, self.inputs)
        self.margins = _Code(program.margins, self.inputs)

    def put(self, t: float, differential: Array) -> bool:
        """Go to a state; whether derivatives and algebraic variables were found there."""
        self.inputs[0] = t
        self.y[self.free] = differential
        self.y[self.algebraic] = self.guess
        self.ydot[:] = 0.0
        self._counts[:] = 0
        self.program.filled(self.inputs)
        stepper.run(self._batch, 0, 1)
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
            self.program.filled(self.inputs)

    def restart(self, y: Array) -> None:
        """Take over a state after a jump; algebraic variables are searched from there."""
        self.y[:] = y
        self.guess = y[self.algebraic]

    def rates(self) -> Array:
        """Derivatives of the differential variables and of the ledger."""
        return np.concatenate((self.ydot[self.free], self.ledger()))


class _Code:
    """A compiled function of a fixed buffer, each of its pieces."""

    def __init__(self, function: Function | None, inputs: Array) -> None:
        self.out = np.zeros(function.size if function else 0)
        self._calls: list[tuple[Any, int, int, int]] = []
        place = self.out.ctypes.data
        for part in (function, *function.rest) if function else ():
            self._calls.append((CODE(part.address), place, inputs.ctypes.data, part.user))
            place += part.n_out * self.out.itemsize
        self._keep = function

    def __call__(self) -> Array:
        for code, *arguments in self._calls:
            code(*arguments)
        return self.out.copy()
