"""A program at one state after another, or at several at once, for a library that calls from Python: no array is made
twice.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from surfacechem.compile.program import CODE, Function, Program
from surfacechem.solve.contract import Array
from surfacechem.solve.radau import stepper
from surfacechem.solve.radau.solver import search_batch
from surfacechem.solve.radau.stepper import COLUMNS, END


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
        self._rates = _Code(program.rates, self.inputs) if program.rates else None
        self._search = stepper.Repeated(search_batch(program, ends, table, self._counts))
        self._reads = _Code(program.filler.reads if program.filler else None, self.inputs)
        self._ledger = _Code(program.ledger, self.inputs)
        self._margins = _Code(program.margins, self.inputs)

    def put(self, t: float, differential: Array) -> bool:
        """Go to a state; whether derivatives and algebraic variables were found there."""
        self.inputs[0] = t
        if self._rates is not None:
            self.y[:] = differential
            self._fill()
            self.ydot[:] = self._rates()
            return all(map(math.isfinite, self.ydot.tolist()))
        self.y[self.free] = differential
        self.y[self.algebraic] = self.guess
        self.ydot[:] = 0.0
        self._fill()
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

    def _fill(self) -> None:
        filler = self.program.filler
        if filler is not None:
            self.inputs[filler.positions] = filler.evaluate(self._reads().tolist())

    def restart(self, y: Array) -> None:
        """Take over a state after a jump; algebraic variables are searched from there."""
        self.y[:] = y
        self.guess = y[self.algebraic]

    def rates(self) -> Array:
        """Derivatives of the differential variables and of the ledger."""
        return np.concatenate((self.ydot[self.free], self.ledger()))

    def ledger(self) -> Array:
        """Rates of the ledger."""
        return self._ledger().copy()

    def margins(self) -> Array:
        """Values of the margins."""
        return self._margins().copy()


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

    def hold(self, times: Array, y: Array) -> None:
        """Go to states whose derivatives are not known."""
        self.inputs[:, 0] = times
        self.y[:] = y
        self.ydot[:] = 0.0

    def put(self, times: Array, y: Array) -> None:
        """Go to states, and find derivatives and algebraic variables of each; not a number where there are none."""
        self.hold(times, y)
        self.program.filled(self.inputs)
        if self.program.rates is not None:
            self.ydot[:] = self.program.rates(self.inputs)
            found = np.isfinite(self.ydot).all(axis=1)
        else:
            found = self._search()
        self.inputs[~found, 1 : 1 + 2 * self.program.n] = np.nan

    def _search(self) -> NDArray[np.bool_]:
        """Find derivatives and algebraic variables; where they were found."""
        n, count = self.program.n, len(self.inputs)
        ends, counts = self.inputs[:, : 1 + 2 * n].copy(), np.zeros((count, COLUMNS), np.int64)
        table = np.ascontiguousarray(self.inputs[:, None, 1 + 2 * n :])
        stepper.run(search_batch(self.program, ends, table, counts), 0, count)
        self.inputs[:, : 1 + 2 * n] = ends
        return np.asarray(counts[:, END] == 0)

    def values(self) -> tuple[Array, Array]:
        """Rates of the ledger and values of the margins, a row for each state."""
        ledger, margins = (
            function(self.inputs) if function else np.zeros((len(self.inputs), 0))
            for function in (self.program.ledger, self.program.margins)
        )
        return ledger, margins


class _Code:
    """A compiled function of a buffer of inputs, each of its pieces: a call from NumPy takes five times as long."""

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
        return self.out
