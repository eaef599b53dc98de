"""The memory of one trajectory and its record, calls of machine code by its address, and products of tables and stages.

The address is data, not a function type: code compiled here does not depend on the scene that it calls, and stays
cached.

The product of a table of coefficients and the matrix [stage, state] is the most frequent operation of a step. Its loops
are too short to be vectorised by a compiler; here they are written with vectors, whatever the number of states: the
last vector of a row overwrites the start of the next row, which is written later, or rows kept free behind the last
stage.
"""

from collections.abc import Mapping, Sequence
from functools import reduce
from typing import Any, NamedTuple, cast

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import AttributeTemplate
from numba.extending import (
    infer_getattr,
    intrinsic,
    lower_getattr_generic,
    lower_setattr_generic,
    models,
    register_model,
)

from surfacechem.compile.objectcode import DATA, SHAPE
from surfacechem.solve.radau.stepper import BATCH, EDGE_TABLES, EDGE_WORDS, MEMORY, NUMBERS, SETTINGS, SIZES, WIDTH

# -- the record of a trajectory ---------------------------------------------------------------------------------------

# Pointers, sizes and scalars of one or several trajectories behind one address: passed by value its arrays would be
# hundreds of arguments of every call.

_intrinsic: Any = intrinsic
_Constant: Any = ir.Constant
_alloca: Any = cgutils.alloca_once
_typeof: Any = numba.typeof

_WORD = ir.IntType(64)
_POINTER = ir.IntType(8).as_pointer()
_NUMBA: dict[Any, Any] = {float: types.float64, int: types.int64, complex: types.complex128}


class _Field(NamedTuple):
    kind: Any
    shape: tuple[str | int, ...] | None
    """Shape of an array; None if its lengths are stored after its address."""
    place: int
    """Offset in words of eight bytes."""


def _layout(
    sizes: Sequence[str], numbers: Mapping[str, type], memory: Mapping[str, Any]
) -> tuple[dict[str, _Field], int]:
    """Return the fields of a record and its number of words."""
    fields: dict[str, _Field] = {}
    place = 0
    for name, (dtype, axes) in {**EDGE_TABLES, **BATCH}.items():
        entry = _NUMBA.get(dtype) or numba.from_dtype(np.dtype(dtype))
        fields[name] = _Field(types.Array(entry, axes, "C"), None, place)
        place += 1 + axes
    for name, kind in {**dict.fromkeys(sizes, int), **dict.fromkeys(SETTINGS, float), **numbers}.items():
        fields[name] = _Field(_NUMBA[kind], None, place)
        place += 1
    for name, (kind, shape) in memory.items():
        fields[name] = _Field(types.Array(_NUMBA[kind], len(shape), "C"), shape, place)
        place += 1
    return fields, place


class StepperRecord(types.Type):
    """The type of a record: its inputs (a batch), scalars that change, and work arrays.

    ``sizes`` are the names of the entries of the first table of the batch; ``numbers`` and ``memory`` give the type of
    each scalar, and type and shape of each array, by name. ``method`` has compiled functions and numbers of a method
    by name: code that uses them is compiled for each record with its own, and is one source for several methods.
    """

    def __init__(
        self,
        name: str,
        sizes: Sequence[str],
        numbers: Mapping[str, type],
        memory: Mapping[str, Any],
        method: Mapping[str, Any] | None = None,
    ) -> None:
        self.sizes, self.numbers, self.memory, self.method = sizes, numbers, memory, method or {}
        self.fields, self.words = _layout(sizes, numbers, memory)
        super().__init__(name=name)


@register_model(StepperRecord)
class _RecordModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _POINTER)


@infer_getattr
class _RecordFields(AttributeTemplate):
    key = StepperRecord

    def generic_resolve(self, record: Any, name: str) -> Any:
        return _typeof(record.method[name]) if name in record.method else record.fields[name].kind


def _word(builder: Any, work: Any, place: int, kind: Any) -> Any:
    """Return a pointer to a word of the record."""
    return builder.bitcast(builder.gep(work, [_WORD(8 * place)], inbounds=True), kind.as_pointer())


def _fixed(builder: Any, work: Any, place: int, kind: Any) -> Any:
    """Load a word that never changes: an address, a size, a setting. The metadata lets the compiler keep it in a
    register instead of loading it again after each store.
    """
    value = builder.load(_word(builder, work, place, kind))
    value.set_metadata("invariant.load", builder.module.add_metadata([]))
    return value


@lower_getattr_generic(StepperRecord)
def _load_field(context: Any, builder: Any, record: Any, work: Any, name: str) -> Any:
    if name in record.method:
        part = record.method[name]
        return context.get_dummy_value() if callable(part) else context.get_constant(_typeof(part), part)
    kind, shape, place = record.fields[name]
    if name in record.numbers:
        return builder.load(_word(builder, work, place, context.get_value_type(kind)))
    if not isinstance(kind, types.Array):
        return _fixed(builder, work, place, context.get_value_type(kind))
    lengths = []
    for axis, length in enumerate(shape or (None,) * kind.ndim):
        at = place + 1 + axis if length is None else record.fields[length].place if isinstance(length, str) else None
        lengths.append(_WORD(length) if at is None else _fixed(builder, work, at, _WORD))
    size = _WORD(context.get_abi_sizeof(context.get_data_type(kind.dtype)))
    strides, pack = [size], cast(Any, cgutils.pack_array)
    for length in reversed(lengths):
        strides.insert(0, builder.mul(strides[0], length))
    model, value = context.data_model_manager[kind], _Constant(context.get_value_type(kind), ir.Undefined)
    parts = {
        "meminfo": _Constant(_POINTER, None),
        "parent": _Constant(_POINTER, None),
        "nitems": reduce(builder.mul, lengths),
        "itemsize": size,
        "data": _fixed(builder, work, place, context.get_data_type(kind.dtype).as_pointer()),
        "shape": pack(builder, lengths),
        "strides": pack(builder, strides[1:]),
    }
    for part, entry in parts.items():
        value = model.set(builder, value, entry, part)
    return value


@lower_setattr_generic(StepperRecord)
def _store_field(_context: Any, builder: Any, signature: Any, args: Any, name: str) -> None:
    record = signature.args[0]
    assert name in record.numbers, f"{name} does not change"
    work, value = args
    builder.store(value, _word(builder, work, record.fields[name].place, value.type))


def laying_out(record: StepperRecord) -> Any:
    """Return a function that makes the record of a batch on its caller's stack: its inputs, and the addresses of its
    work arrays, contiguous in a memory. Its argument is the address of a table of the arrays of the batch and, last, of
    the memory.
    """
    fields = record.fields
    # Arrays whose entries are words of the record, and where they are.
    copied = {
        "edge_words": (0, EDGE_WORDS),
        "sizes": (fields[record.sizes[0]].place, len(record.sizes)),
        "settings": (fields[SETTINGS[0]].place, len(SETTINGS)),
    }

    @_intrinsic
    def lay_out(_context: Any, _table: Any) -> Any:
        def generate(context: Any, builder: Any, _signature: Any, args: Any) -> Any:
            work = builder.bitcast(_alloca(builder, ir.ArrayType(_WORD, record.words)), _POINTER)

            def store(place: int, value: Any) -> None:
                builder.store(value, _word(builder, work, place, value.type))

            def word(start: Any, offset: int) -> Any:
                """Return the word at an offset in bytes from an address."""
                return builder.load(builder.inttoptr(builder.add(start, _WORD(offset)), _WORD.as_pointer()))

            for k, (name, (_, axes)) in enumerate(BATCH.items()):
                place, array = fields[name].place, word(args[0], 8 * k)
                data, shape = word(array, DATA), word(array, SHAPE)
                for j, value in enumerate([data, *(word(shape, 8 * axis) for axis in range(axes))]):
                    store(place + j, value)
                start, count = copied.get(name, (0, 0))
                for j in range(count):
                    store(start + j, word(data, 8 * j))
            for name, kind in record.numbers.items():
                store(fields[name].place, _Constant(context.get_value_type(_NUMBA[kind]), 0))
            free = word(word(args[0], 8 * len(BATCH)), DATA)
            for name, (kind, shape) in record.memory.items():
                store(fields[name].place, free)
                size = _WORD(np.dtype(kind).itemsize)
                for length in shape:
                    if isinstance(length, str):
                        count = builder.load(_word(builder, work, fields[length].place, _WORD))
                    else:
                        count = _WORD(length)
                    size = builder.mul(size, count)
                free = builder.add(free, size)
            # Later loads are marked invariant: hide from the optimiser that the words have just been written.
            opaque = ir.FunctionType(_POINTER, [_POINTER])
            return builder.asm(opaque, "", "=r,0,~{memory}", [work], True)

        return record(types.int64), generate

    return lay_out


# -- compiled functions -----------------------------------------------------------------------------------------------

_njit: Any = numba.njit
_loop: Any = cgutils.for_range
_strided_loop: Any = cgutils.for_range_slice
_NUMBER = ir.DoubleType()

PARTS: set[str] = set()
"""Names of the functions that only the kernel itself calls."""


def compiled(function: Any) -> Any:
    """Compile a part of the kernel.

    Nothing is allocated: without reference counts the code compiles and runs about twice as fast.
    """
    PARTS.add(function.__qualname__)
    return _njit(error_model="numpy", _nrt=False, no_cpython_wrapper=True, no_cfunc_wrapper=True)(function)


RESIDUAL, JACOBIAN, LEDGER, MARGINS, RATES, MAGNITUDES, GUARD_RATES, TOTALS, NODES, TIMES_OF_RETURN, RESETS = np.arange(
    11
)
"""Rows of the table of addresses (code, user data); of resets the first. They are NumPy integers, as Numba compiles a
function anew for each Python constant.
"""

WORK = StepperRecord("Work", SIZES, NUMBERS, MEMORY)
lay_out = laying_out(WORK)

# -- calls ---------------------------------------------------------------------------------------------------------


@_intrinsic
def _call(_context: Any, _address: Any, _out: Any, _inputs: Any, _user: Any) -> Any:
    signature = types.void(types.intp, types.intp, types.intp, types.intp)

    def generate(context: Any, builder: Any, _signature: Any, args: Any) -> Any:
        kind = ir.FunctionType(ir.VoidType(), [_POINTER] * 3).as_pointer()
        function = builder.inttoptr(args[0], kind)
        builder.call(function, [builder.inttoptr(argument, _POINTER) for argument in args[1:]])
        return context.get_dummy_value()

    return signature, generate


@compiled
def evaluate(w: Any, which: int, result: Any) -> None:
    """Call a function of the program at the current inputs."""
    _call(w.code[which, 0], result.ctypes.data, w.inputs.ctypes.data, w.code[which, 1])


@compiled
def evaluate_at(w: Any, which: int, inputs: Any, result: Any) -> None:
    """Call a function of the program at these inputs."""
    _call(w.code[which, 0], result.ctypes.data, inputs.ctypes.data, w.code[which, 1])


@compiled
def evaluate_jacobian(w: Any) -> None:
    """Evaluate the derivatives at the current inputs: core, border and bands, which are contiguous in memory."""
    evaluate(w, JACOBIAN, w.jacobian)
    if len(w.nonzeros) == 0:
        return
    # From last to first, move each entry to its position, which is never before the one it was written to. Compiled
    # code checks no index: the first row reaches all of them.
    entries, end = w.jacobian[0, 0], w.jacobian.size + w.border_derivatives.size + w.band_derivatives.size
    for k in range(len(w.nonzeros) - 1, -1, -1):
        value, place = entries[k], w.nonzeros[k]
        for between in range(place + 1, end):
            entries[between] = 0.0
        entries[place] = value
        end = place
    for between in range(end):
        entries[between] = 0.0


@compiled
def set_inputs(w: Any, y: Any, ydot: Any) -> None:
    """Write state and rates to the inputs."""
    n, inputs = w.n, w.inputs
    for j in range(n):
        inputs[1 + j] = y[j]
        inputs[1 + n + j] = ydot[j]


@compiled
def put(w: Any, offset: float, y: Any, ydot: Any) -> None:
    """Write state and rates to the inputs, at this time after the start of the step."""
    w.inputs[0] = w.base + (w.tau + offset)
    set_inputs(w, y, ydot)


@compiled
def row_of(table: Any, i: int) -> int:
    """Return the row of run i in a table with one row for each run, or one for all."""
    return min(i, int(table.shape[0]) - 1)


@compiled
def copy(source: Any, target: Any) -> None:
    """Copy entry by entry; a slice assignment would allocate."""
    for j in range(source.shape[0]):
        target[j] = source[j]


@compiled
def clear(target: Any) -> None:
    """Set to zero entry by entry; a slice assignment would compile broadcasting and its errors."""
    for j in range(target.shape[0]):
        target[j] = 0


@compiled
def any_true(flags: Any) -> bool:
    """True if a flag is set."""
    found = False
    for flag in flags:
        found = found or flag != 0
    return found


@compiled
def finite(values: Any) -> bool:
    """True if no entry is infinite or NaN."""
    total = 0.0
    for value in values:
        total += 0.0 * value
    return total == 0.0


@compiled
def keep_largest(values: Any, largest: Any) -> None:
    """Update the largest magnitudes."""
    for j in range(values.shape[0]):
        largest[j] = max(largest[j], abs(values[j]))


# -- tables times stages -------------------------------------------------------------------------------------------

_VECTOR = ir.VectorType(_NUMBER, WIDTH)


@_intrinsic
def combine(
    _context: Any, _table: Any, _width: Any, _rows: Any, _terms: Any, _values: Any, _states: Any, _out: Any
) -> Any:
    """Multiply rows of a table by the first rows of a matrix of values; matrices are given by their addresses.

    The result must be another matrix than the values.
    """
    signature = types.void(*(types.intp,) * 7)

    def generate(context: Any, builder: Any, _signature: Any, args: Any) -> Any:
        table, width, rows, terms, values, states, out = args

        def place(start: Any, row: Any, width: Any, column: Any, kind: Any) -> Any:
            entry = builder.add(builder.mul(row, width), column)
            return builder.inttoptr(builder.add(start, builder.mul(entry, _WORD(8))), kind.as_pointer())

        total = _alloca(builder, _VECTOR)
        with (
            _loop(builder, rows) as row,
            _strided_loop(builder, _WORD(0), states, _WORD(WIDTH), inc=True) as (first, _),
        ):
            builder.store(_Constant(_VECTOR, [0.0] * WIDTH), total)
            with _loop(builder, terms) as term:
                factor = builder.load(place(table, row.index, width, term.index, _NUMBER))
                value = builder.load(place(values, term.index, states, first, _VECTOR), align=8)
                # Broadcast the factor to a vector.
                nothing, lanes = _Constant(_VECTOR, ir.Undefined), ir.VectorType(ir.IntType(32), WIDTH)
                single = builder.insert_element(nothing, factor, ir.IntType(32)(0))
                factors = builder.shuffle_vector(single, nothing, _Constant(lanes, [0] * WIDTH))
                builder.store(builder.fadd(builder.load(total), builder.fmul(factors, value)), total)
            builder.store(builder.load(total), place(out, row.index, states, first, _VECTOR), align=8)
        return context.get_dummy_value()

    return signature, generate


def weighted_sums(table: Any, at_once: int = WIDTH) -> Any:
    """Return a function that multiplies a row of this table and the rows of a matrix, given by its address.

    It takes the first columns of a matrix of any width, so many ``at_once``. The factors are constants in the code and
    zeros are skipped, so it takes half the time of :func:`combine`.
    """
    kind = ir.VectorType(_NUMBER, at_once)
    fused = ("contract",) if at_once > WIDTH else ()  # runs in lanes may round a product and its sum at once

    @_intrinsic
    def sums(_context: Any, _row: Any, _values: Any, _width: Any, _columns: Any, _out: Any) -> Any:
        signature = types.void(*(types.intp,) * 5)

        def generate(_context: Any, builder: Any, _signature: Any, args: Any) -> Any:
            row, values, width, columns, out = args

            def place(start: Any, row: int, column: Any) -> Any:
                entry = builder.add(builder.mul(_WORD(row), width), column)
                return builder.gep(builder.inttoptr(start, _NUMBER.as_pointer()), [entry])

            done = builder.append_basic_block("done")
            cases = builder.switch(row, done)
            for i, factors in enumerate(table):
                block = builder.append_basic_block()
                cases.add_case(_WORD(i), block)
                builder.position_at_end(block)
                with _strided_loop(builder, _WORD(0), columns, _WORD(at_once), inc=True) as (first, _):
                    # Two independent sums, so that neither waits for the other.
                    totals = [_Constant(kind, [0.0] * at_once)] * 2
                    for k, j in enumerate(np.flatnonzero(factors)):
                        pointer = builder.bitcast(place(values, int(j), first), kind.as_pointer())
                        factor = _Constant(kind, [float(factors[j])] * at_once)
                        term = builder.fmul(factor, builder.load(pointer, align=8), flags=fused)
                        totals[k % 2] = builder.fadd(totals[k % 2], term, flags=fused)
                    result = builder.bitcast(place(out, 0, first), kind.as_pointer())
                    builder.store(builder.fadd(*totals), result, align=8)
                builder.branch(done)
            builder.position_at_end(done)
            return _context.get_dummy_value()

        return signature, generate

    return sums
