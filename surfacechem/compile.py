"""SymEngine expressions to machine code.

Every function of a program shares one input layout, [t | y | ydot | p], so that a trajectory keeps one buffer and
fills the parameters once. The machine code is SymEngine's own LLVM output: about 10 ms for a small scene, reached as a
raw pointer by the stepper and as a vectorised function from Python.
"""

import ctypes
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import symengine
from numpy.typing import ArrayLike, NDArray

from surfacechem.expressions import derivative


@dataclass(frozen=True)
class Function:
    """Machine code with the C signature ``void f(double *out, const double *inputs, void *user)``.

    >>> x, y = symengine.symbols("x y")
    >>> compile_function([x, y], [x * y, x + y])([[2.0, 3.0], [4.0, 5.0]])
    array([[ 6.,  5.],
           [20.,  9.]])
    """

    address: int
    user: int
    n_out: int
    keep: Any
    """Owns the machine code: the address is valid as long as this object lives."""

    def __call__(self, inputs: ArrayLike) -> NDArray[np.float64]:
        return np.asarray(self.keep(np.ascontiguousarray(inputs, dtype=float)))


@dataclass(frozen=True)
class Filler:
    """Fills parameters of inputs with what something outside says of the values that it reads there."""

    reads: Function
    positions: NDArray[np.int64]
    """Of the parameters in the inputs."""
    evaluate: Callable[[Sequence[float]], Sequence[float]]

    def __call__(self, inputs: NDArray[np.float64]) -> NDArray[np.float64]:
        """The inputs, one row or many, filled in place."""
        for row in inputs.reshape(-1, inputs.shape[-1]):
            row[self.positions] = self.evaluate(self.reads(row).tolist())
        return inputs


@dataclass(frozen=True)
class Program:
    """A fully implicit system G(t, y, ydot; p) = 0, linear in ydot, with its exact derivatives, ledger and margins."""

    n: int
    n_parameters: int
    n_ledger: int
    n_margins: int
    residual: Function
    jacobian: Function
    """dG/dy (row-major), then dG/dydot."""
    ledger: Function | None
    """Rates of the quadratures integrated beside the state."""
    margins: Function | None
    """Functions whose zeros are events."""
    algebraic: tuple[bool, ...]
    """Per state: no equation contains its derivative."""
    filler: Filler | None = None

    def filled(self, inputs: NDArray[np.float64]) -> NDArray[np.float64]:
        """The inputs, one row or many, with the parameters that come from outside."""
        return self.filler(inputs) if self.filler else inputs

    @cached_property
    def addresses(self) -> NDArray[np.int64]:
        """Code and user data of residual, jacobian, ledger and margins; zero where absent."""
        functions = (self.residual, self.jacobian, self.ledger, self.margins)
        return np.array([(f.address, f.user) if f else (0, 0) for f in functions], dtype=np.int64)

    @cached_property
    def algebraic_mask(self) -> NDArray[np.bool_]:
        return np.array(self.algebraic, dtype=bool)

    @property
    def n_inputs(self) -> int:
        return 1 + 2 * self.n + self.n_parameters


def compile_function(inputs: Sequence[Any], expressions: Sequence[Any]) -> Function:
    """Compile a vector of expressions; inputs that no expression contains are allowed."""
    code = symengine.Lambdify(list(inputs), list(expressions), backend="llvm", cse=True)
    function, user = code.as_ctypes()
    address = ctypes.cast(function, ctypes.c_void_p).value
    return Function(int(address or 0), int(user.value), len(expressions), code)


def compile_program(
    t: Any,
    states: Sequence[Any],
    derivatives: Sequence[Any],
    parameters: Sequence[Any],
    residual: Sequence[Any],
    ledger: Sequence[Any] = (),
    margins: Sequence[Any] = (),
    filler: Filler | None = None,
) -> Program:
    """Compile a system with the Jacobians differentiated from its residual."""
    if not len(states) == len(derivatives) == len(residual):
        counts = f"{len(states)} states, {len(derivatives)} derivatives and {len(residual)} equations"
        raise ValueError(f"{counts}: a system needs as many equations as states, and one derivative a state.")
    inputs = [t, *states, *derivatives, *parameters]
    by_state, by_rate = ([derivative(g, x) for g in residual for x in over] for over in (states, derivatives))
    n = len(states)
    return Program(
        n=n,
        n_parameters=len(parameters),
        n_ledger=len(ledger),
        n_margins=len(margins),
        residual=compile_function(inputs, residual),
        jacobian=compile_function(inputs, by_state + by_rate),
        ledger=compile_function(inputs, ledger) if ledger else None,
        margins=compile_function(inputs, margins) if margins else None,
        algebraic=tuple(all(entry == 0 for entry in by_rate[j::n]) for j in range(n)),
        filler=filler,
    )
