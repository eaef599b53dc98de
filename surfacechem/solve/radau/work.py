"""Calling machine code by its address from compiled Python, and the workspace of one trajectory.

The address is data, not a function type: code compiled here never depends on the scene it calls and is cached for good.

A table of coefficients times the matrix [stage, state] is what a step does most often. Its loops are too short for a
compiler to make vectors of them; here they are written as vectors, whatever the number of states: the last vector of
a row runs over into the next row, which is written after it, or into rows that are kept free behind the last stage.
"""

from functools import partial
from typing import Any, NamedTuple

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.imputils import impl_ret_borrowed
from numba.core.typing.templates import AttributeTemplate
from numba.extending import infer_getattr, intrinsic, lower_getattr_generic, models, register_model
from numba.np.arrayobj import populate_array

from surfacechem.solve.radau.tables import SCAN_POINTS

_njit: Any = numba.njit
_intrinsic: Any = intrinsic
_borrowed: Any = impl_ret_borrowed
_Constant: Any = ir.Constant

PARTS: set[str] = set()
"""Names of the functions that only the kernel itself calls."""


def compiled(function: Any, counted: bool = False) -> Any:
    """A part of the kernel. Nothing is allocated inside a step; without reference counts the code compiles and runs
    about twice as fast.
    """
    PARTS.add(function.__qualname__)
    return _njit(error_model="numpy", _nrt=counted, no_cpython_wrapper=True, no_cfunc_wrapper=True)(function)


RESIDUAL, JACOBIAN, LEDGER, MARGINS = np.arange(4)
FUNCTIONS = 4
"""Rows of the table of addresses (code, user data, function, place in its result); further rows are later parts of
functions that are compiled in pieces. NumPy's integers, as Numba compiles what takes a Python constant anew for each
constant."""

(
    ATOL, WEIGHT, SCALE, Y, YDOT, ERROR, RHS, TRIAL, TRIAL_DOT, DELTA, COLUMNS, CORRECTION, NOISE, PIVOT,
    WOBBLE, WOBBLE_NOW, WOBBLE_SUMS,
) = np.arange(17)  # fmt: skip
"""Rows of the vectors of length n; PIVOT is SCALE as it was when the Newton matrices were factored, WOBBLE the
roughness of the equations over neighbouring times. It is found from the last three rows, of which WOBBLE_SUMS is the
first."""
Q, Q_TRIAL, Q_CORRECTION, Q_PROBE, Q_MISS, Q_SCALE, Q_LARGEST, Q_NUDGED = np.arange(8)
"""Rows of the vectors of length n_ledger."""
(
    M_NOW, M_SIDE, M_BEFORE, M_EARLIER, M_LARGEST, M_SLOPE, M_PROBE, M_LOW, M_HIGH, M_FIRST, M_FIRST_SIDE, M_LAST_SIDE,
) = np.arange(12)  # fmt: skip
"""Rows of the vectors of length n_margins: value; side of zero it was last seen on; values at the two points before;
largest size so far; slope; value elsewhere; ends of the interval in which it reaches zero; value and side at the
start of the step; side at the point before."""
(
    BASE, TAU, H_LAST, OFFSET, THETA, CONTRACTION, ROUNDOFF, RTOL, LOOSE, H_FACTORED, H_JACOBIAN, GUESSED,
) = np.arange(12)  # fmt: skip
"""Clock: time is BASE + TAU, with TAU counted from the last restart, so that steps can be far smaller than one ulp of
t. H_FACTORED and H_JACOBIAN are the steps of the current factors and Jacobian; GUESSED is by how much the first
guess of the stages was wrong, in units of the tolerance."""
STEPS, REJECTED, RESIDUALS, JACOBIANS, FACTORIZATIONS, ITERATIONS = np.arange(6)
MEMBER, LAST_MEMBER, TRIES, CALM, FRESH, REFUSED = np.arange(6, 12)
"""Counters; members of the Radau family used now and by the stored polynomial; Newton
iterations of this step and easy steps in a row; whether the Jacobian was taken at the current state; steps that the
ledger has refused."""


class Work(NamedTuple):
    """Everything one trajectory writes to; allocated once for a batch."""

    code: Any
    algebraic: Any
    chains: Any
    groups: Any
    kinds: Any
    inputs: Any
    clock: Any
    count: Any
    vector: Any
    z: Any
    z_last: Any
    g: Any
    slopes: Any
    parts: Any
    pairs: Any
    jacobian: Any
    border_derivatives: Any
    band_derivatives: Any
    real: Any
    real_border: Any
    real_bands: Any
    complex: Any
    complex_border: Any
    complex_bands: Any
    order: Any
    z_polynomial: Any
    scanned: Any
    scanned_rates: Any
    ledger: Any
    q_stage: Any
    rates: Any
    polynomial: Any
    q_polynomial: Any
    margin: Any
    fired: Any


class WorkType(types.Type):
    """Pointer to a Work. By value its arrays would be 140 arguments of every call."""

    def __init__(self, content: Any) -> None:
        self.content = content
        super().__init__(name=f"Pointer({content})")


@register_model(WorkType)
class _WorkModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, ir.IntType(8).as_pointer())  # type: ignore[no-untyped-call]


@infer_getattr
class _WorkFields(AttributeTemplate):
    key = WorkType

    def generic_resolve(self, work: Any, name: str) -> Any:  # type: ignore[override]
        return work.content.types[work.content.fields.index(name)]


def _load(builder: Any, pointer: Any, kind: Any) -> Any:
    """Load a structure leaf by leaf, so that unused leaves are dropped."""
    if not isinstance(kind, ir.Aggregate):
        return builder.load(pointer)
    value = _Constant(kind, ir.Undefined)
    for i in range(len(kind)):
        leaf = builder.gep(pointer, [ir.IntType(32)(0), ir.IntType(32)(i)], inbounds=True)
        value = builder.insert_value(value, _load(builder, leaf, kind.gep(_Constant(ir.IntType(32), i))), i)
    return value


@lower_getattr_generic(WorkType)  # type: ignore[no-untyped-call]
def _load_field(context: Any, builder: Any, work: Any, value: Any, name: str) -> Any:
    kind = context.get_value_type(work.content)
    index = ir.IntType(32)(work.content.fields.index(name))
    pointer = builder.gep(builder.bitcast(value, kind.as_pointer()), [ir.IntType(32)(0), index], inbounds=True)
    field = work.content.types[work.content.fields.index(name)]
    return _borrowed(context, builder, field, _load(builder, pointer, pointer.type.pointee))


@_intrinsic
def reference(_context: Any, content: Any) -> Any:
    """Pointer to a copy on the caller's stack; the caller keeps the arrays alive."""

    def generate(_context: Any, builder: Any, _signature: Any, args: Any) -> Any:
        slot = cgutils.alloca_once_value(builder, args[0])  # type: ignore[no-untyped-call]
        return builder.bitcast(slot, ir.IntType(8).as_pointer())

    return WorkType(content)(content), generate


@_intrinsic
def _call(_context: Any, _address: Any, _out: Any, _inputs: Any, _user: Any) -> Any:
    signature = types.void(types.intp, types.intp, types.intp, types.intp)

    def generate(context: Any, builder: Any, _signature: Any, args: Any) -> Any:
        pointer = ir.IntType(8).as_pointer()
        kind = ir.FunctionType(ir.VoidType(), [pointer, pointer, pointer]).as_pointer()
        function = builder.inttoptr(args[0], kind)
        builder.call(function, [builder.inttoptr(argument, pointer) for argument in args[1:]])
        return context.get_dummy_value()

    return signature, generate


@compiled
def _evaluate_rest(w: Any, which: int, out: int) -> None:
    for part in range(FUNCTIONS, w.code.shape[0]):
        if w.code[part, 2] == which:
            _call(w.code[part, 0], out + 8 * w.code[part, 3], w.inputs.ctypes.data, w.code[part, 1])


@compiled
def evaluate(w: Any, which: int, out: int) -> None:
    """Call a function of the program on the current inputs; ``out`` is the address of the result."""
    _call(w.code[which, 0], out, w.inputs.ctypes.data, w.code[which, 1])
    if w.code.shape[0] > FUNCTIONS:
        _evaluate_rest(w, which, out)


@compiled
def set_inputs(w: Any, y: Any, ydot: Any) -> None:
    """State and rates of the next call."""
    n = y.shape[0]
    for j in range(n):
        w.inputs[1 + j] = y[j]
        w.inputs[1 + n + j] = ydot[j]


@compiled
def copy(source: Any, target: Any) -> None:
    """Copy entry by entry; a slice assignment would allocate."""
    for j in range(source.shape[0]):
        target[j] = source[j]


@compiled
def clear(target: Any) -> None:
    """Set entry by entry; a slice assignment would bring broadcasting and its errors."""
    for j in range(target.shape[0]):
        target[j] = 0


@compiled
def any_true(flags: Any) -> bool:
    """Whether a flag is set."""
    found = False
    for flag in flags:
        found = found or flag != 0
    return found


@compiled
def finite(values: Any) -> bool:
    """Whether no entry is infinite or NaN."""
    total = 0.0
    for value in values:
        total += 0.0 * value
    return total == 0.0


@_intrinsic
def _take(_context: Any, cursor: Any, shape: Any, kind: Any) -> Any:
    """An array on the memory the cursor, a vector of one address, points to; moves the cursor to its end."""
    array = types.Array(kind.instance_type, len(shape), "C")

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        place = context.make_array(signature.args[0])(context, builder, args[0]).data
        start = builder.load(place)
        size = context.get_constant(types.intp, array.dtype.bitwidth // 8)
        lengths = cgutils.unpack_tuple(builder, args[1])  # type: ignore[no-untyped-call]
        strides = [size]
        for length in reversed(lengths):
            strides.insert(0, builder.mul(strides[0], length))
        builder.store(builder.add(start, strides[0]), place)
        made = context.make_array(array)(context, builder)
        data = builder.inttoptr(start, made.data.type)
        populate_array(made, data=data, shape=lengths, strides=strides[1:], itemsize=size, meminfo=None)  # type: ignore[no-untyped-call]
        return made._getvalue()

    return array(cursor, shape, kind), generate


@partial(compiled, counted=True)
def lay_out(batch: Any, cursor: Any) -> Work:
    """Workspace of a trajectory on the zeros from the cursor's address on; leaves their end there. No memory is
    touched. The three arrays of derivatives follow each other, as the compiled function writes them.
    """
    algebraic, chains, groups = batch.algebraic, batch.chains, batch.groups
    n_parameters, n_margins = batch.parameters.shape[2], batch.kinds.shape[0]
    n, links, n_ledger = algebraic.shape[0], chains.shape[0], groups.shape[0]
    core = chains[0, 0] if links > 0 else n
    cells = n - core
    return Work(
        batch.code,
        algebraic,
        chains,
        groups,
        batch.kinds,
        _take(cursor, (1 + 2 * n + n_parameters,), np.float64),
        _take(cursor, (GUESSED + 1,), np.float64),
        _take(cursor, (REFUSED + 1,), np.int64),
        _take(cursor, (WOBBLE_SUMS + 3, n), np.float64),
        _take(cursor, (ROWS, n), np.float64),
        _take(cursor, (ROWS, n), np.float64),
        _take(cursor, (ROWS, n), np.float64),
        _take(cursor, (ROWS, n), np.float64),
        _take(cursor, (ROWS, n), np.float64),
        _take(cursor, (3, n), np.complex128),
        _take(cursor, (2, core, core), np.float64),
        _take(cursor, (2, core, links), np.float64),
        _take(cursor, (2, cells, 3), np.float64),
        _take(cursor, (core, core), np.float64),
        _take(cursor, (core, links), np.float64),
        _take(cursor, (cells, 3), np.float64),
        _take(cursor, (3, core, core), np.complex128),
        _take(cursor, (3, core, links), np.complex128),
        _take(cursor, (3, cells, 3), np.complex128),
        _take(cursor, (4, core), np.int64),
        _take(cursor, (n, 9), np.float64),
        _take(cursor, (SCAN_POINTS + 3, n), np.float64),
        _take(cursor, (SCAN_POINTS + 3, n), np.float64),
        _take(cursor, (Q_NUDGED + 1, n_ledger), np.float64),
        _take(cursor, (7, n_ledger), np.float64),
        _take(cursor, (8, n_ledger), np.float64),
        _take(cursor, (n, 9), np.float64),
        _take(cursor, (n_ledger, 9), np.float64),
        _take(cursor, (M_LAST_SIDE + 1, n_margins), np.float64),
        _take(cursor, (n_margins,), np.int64),
    )


_loop: Any = cgutils.for_range
_strided_loop: Any = cgutils.for_range_slice

WIDTH = 4
"""States in a vector."""

ROWS = 7 + WIDTH - 1
"""Rows of a matrix of seven stages with room for the last vector, even of a single state."""


@_intrinsic
def combine(
    _context: Any, _table: Any, _width: Any, _rows: Any, _terms: Any, _values: Any, _states: Any, _out: Any
) -> Any:
    """Rows of a table of some width times the first so many rows of values; table, values and result, which is another
    matrix, are given by their addresses.
    """
    signature = types.void(*(types.intp,) * 7)

    def generate(context: Any, builder: Any, _signature: Any, args: Any) -> Any:
        table, width, rows, terms, values, states, out = args
        place = _places(builder)
        total = cgutils.alloca_once(builder, _VECTOR)  # type: ignore[no-untyped-call]
        with (
            _loop(builder, rows) as row,
            _strided_loop(builder, states.type(0), states, states.type(WIDTH), inc=True) as (first, _),
        ):
            builder.store(_Constant(_VECTOR, [0.0] * WIDTH), total)
            with _loop(builder, terms) as term:
                factor = builder.load(place(table, row.index, width, term.index, _NUMBER))
                value = builder.load(place(values, term.index, states, first, _VECTOR), align=8)
                product = builder.fmul(_spread(builder, factor), value)
                builder.store(builder.fadd(builder.load(total), product), total)
            builder.store(builder.load(total), place(out, row.index, states, first, _VECTOR), align=8)
        return context.get_dummy_value()

    return signature, generate


_NUMBER = ir.DoubleType()
_VECTOR = ir.VectorType(_NUMBER, WIDTH)


def _places(builder: Any) -> Any:
    """Pointer to the entry (row, column) of a matrix that begins at an address."""

    def place(start: Any, row: Any, width: Any, column: Any, kind: Any) -> Any:
        entry = builder.add(builder.mul(row, width), column)
        address = builder.add(start, builder.mul(entry, start.type(8)))
        return builder.inttoptr(address, kind.as_pointer())

    return place


def _spread(builder: Any, number: Any) -> Any:
    """A vector of the same number."""
    nothing = _Constant(_VECTOR, ir.Undefined)
    first = builder.insert_element(nothing, number, ir.IntType(32)(0))
    return builder.shuffle_vector(first, nothing, _Constant(ir.VectorType(ir.IntType(32), WIDTH), [0] * WIDTH))
