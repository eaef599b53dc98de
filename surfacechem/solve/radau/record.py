"""A record for compiled code: pointers, sizes and scalars of one or several trajectories behind one address.

Passed by value its arrays would be hundreds of arguments of every call.
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

from surfacechem.solve.radau.stepper import BATCH, EDGE_TABLES, EDGE_WORDS

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
        fields[name] = _Field(types.Array(entry, axes, "C") if axes else entry, None, place)
        place += 1 + axes
    for name, kind in {**dict.fromkeys(sizes, int), **numbers}.items():
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
    """Load a word that never changes: an address, a size, a scalar of the batch. The metadata lets the compiler keep it
    in a register instead of loading it again after each store.
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
    work arrays, contiguous in a memory.
    """
    fields = record.fields

    @_intrinsic
    def lay_out(_context: Any, batch: Any, memory: Any) -> Any:
        def generate(context: Any, builder: Any, _signature: Any, args: Any) -> Any:
            work = builder.bitcast(_alloca(builder, ir.ArrayType(_WORD, record.words)), _POINTER)

            def store(place: int, value: Any) -> None:
                builder.store(value, _word(builder, work, place, value.type))

            for k, (name, kind) in enumerate(zip(BATCH, batch.types, strict=True)):
                place, value = fields[name].place, builder.extract_value(args[0], k)
                if isinstance(kind, types.Array):
                    given = context.make_array(kind)(context, builder, value)
                    store(place, given.data)
                    for axis in range(kind.ndim):
                        store(place + 1 + axis, builder.extract_value(given.shape, axis))
                    if name == "edge_words":
                        for word in range(EDGE_WORDS):
                            store(word, builder.load(builder.gep(given.data, [_WORD(word)])))
                    if name == "sizes":
                        for j, size in enumerate(record.sizes):
                            entry = builder.gep(given.data, [_WORD(j)])
                            store(fields[size].place, builder.load(entry))
                else:
                    store(place, value)
            for name, kind in record.numbers.items():
                store(fields[name].place, _Constant(context.get_value_type(_NUMBA[kind]), 0))
            free = builder.ptrtoint(context.make_array(memory)(context, builder, args[1]).data, _WORD)
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

        return record(batch, memory), generate

    return lay_out
