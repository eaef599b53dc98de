"""A type of compiled code that holds one number of each of eight lanes: arithmetic, comparisons and selection by lane.

Code written with it reads like code for a single run: ``lanes(row)`` loads eight numbers, ``put(row, values)`` stores
them, ``where(mask, a, b)`` selects, ``any_lane(mask)`` asks whether a condition holds in any lane.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from functools import partial
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic, lower_builtin, models, register_model, type_callable

from surfacechem.compile.vectors import INTEGERS, LANES, VECTOR, by_vector, exp, log
from surfacechem.solve.lanes.layout import ORDER

_Constant: Any = ir.Constant
_intrinsic: Any = intrinsic
_lower: Any = lower_builtin
_typed: Any = type_callable


_BYTES = ir.IntType(8).as_pointer()


class _Lanes(types.Type):
    """Eight numbers, or eight truth values."""


LANE, MASK = _Lanes(name="Lanes"), _Lanes(name="Mask")


@register_model(_Lanes)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, VECTOR if kind is LANE else INTEGERS)


def _spread(builder: Any, value: Any) -> Any:
    """Broadcast a number to all lanes."""
    nothing, first = _Constant(VECTOR, ir.Undefined), ir.IntType(32)(0)
    single = builder.insert_element(nothing, value, first)
    return builder.shuffle_vector(single, nothing, _Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES))


def _holds(builder: Any, mask: Any) -> Any:
    """Convert a mask to bits. Between operations it is eight words of ones or zeros, which processors without mask
    registers select by.
    """
    return builder.icmp_signed("<", mask, _Constant(INTEGERS, [0] * LANES))


def _operation(operation: Any, kind: Any, result: Any, emit: Callable[[Any, Any, Any], Any]) -> None:
    """Define a binary operator for two vectors of a kind, and for a vector and a number."""

    @_typed(operation)
    def _type(_context: Any) -> Any:
        def typed(a: Any, b: Any) -> Any:
            fits = all(each is kind or (kind is LANE and isinstance(each, types.Float)) for each in (a, b))
            return result if fits and kind in (a, b) else None

        return typed

    def lowered(_context: Any, builder: Any, signature: Any, args: Any) -> Any:
        given = zip(signature.args, args, strict=True)
        return emit(builder, *(value if each is kind else _spread(builder, value) for each, value in given))

    for pair in ((kind, kind), *(((kind, types.Float), (types.Float, kind)) if kind is LANE else ())):
        _lower(operation, *pair)(lowered)


def _compare(sign: str, builder: Any, a: Any, b: Any) -> Any:
    return builder.sext(builder.fcmp_ordered(sign, a, b), INTEGERS)


_operation(operator.add, LANE, LANE, ir.IRBuilder.fadd)
_operation(operator.sub, LANE, LANE, ir.IRBuilder.fsub)
_operation(operator.mul, LANE, LANE, ir.IRBuilder.fmul)
_operation(operator.truediv, LANE, LANE, ir.IRBuilder.fdiv)
_operation(operator.lt, LANE, MASK, partial(_compare, "<"))
_operation(operator.le, LANE, MASK, partial(_compare, "<="))
_operation(operator.gt, LANE, MASK, partial(_compare, ">"))
_operation(operator.ge, LANE, MASK, partial(_compare, ">="))
_operation(operator.eq, LANE, MASK, partial(_compare, "=="))
_operation(operator.and_, MASK, MASK, ir.IRBuilder.and_)
_operation(operator.or_, MASK, MASK, ir.IRBuilder.or_)


@_typed(operator.invert)
def _type_of_not(_context: Any) -> Any:
    return lambda mask: MASK if mask is MASK else None


@_lower(operator.invert, MASK)
def _not(_context: Any, builder: Any, _signature: Any, args: Any) -> Any:
    return builder.not_(args[0])


def _row(context: Any, builder: Any, kind: Any, row: Any) -> Any:
    """Pointer to eight numbers of a row."""
    return builder.bitcast(context.make_array(kind)(context, builder, row).data, VECTOR.as_pointer())


@_intrinsic
def lanes(_context: Any, row: Any) -> Any:
    """Load the eight numbers of a row."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.load(_row(context, builder, signature.args[0], args[0]), align=8)

    return LANE(row), generate


@_intrinsic
def put(_context: Any, row: Any, values: Any) -> Any:
    """Store eight numbers in a row; a single number is broadcast."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        value = args[1] if signature.args[1] is LANE else _spread(builder, args[1])
        builder.store(value, _row(context, builder, signature.args[0], args[0]), align=8)
        return context.get_dummy_value()

    return types.void(row, values), generate


@_intrinsic
def put_where(_context: Any, mask: Any, row: Any, values: Any) -> Any:
    """Store numbers in the entries of a row where the mask holds; the others stay."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        value = args[2] if signature.args[2] is LANE else _spread(builder, args[2])
        place = _row(context, builder, signature.args[1], args[1])
        chosen = builder.select(_holds(builder, args[0]), value, builder.load(place, align=8))
        # Hide from the optimiser that both places are one: a store by mask, which it would form, takes many times as
        # long on processors without mask registers.
        same_place = builder.asm(ir.FunctionType(place.type, [place.type]), "", "=r,0", [place], False)
        builder.store(chosen, same_place, align=8)
        return context.get_dummy_value()

    return types.void(mask, row, values), generate


@_intrinsic
def where(_context: Any, mask: Any, a: Any, b: Any) -> Any:
    """Select by lane: the first value where the mask holds, else the second."""

    def generate(_context: Any, builder: Any, signature: Any, args: Any) -> Any:
        values = [
            value if kind is LANE else _spread(builder, value)
            for kind, value in zip(signature.args[1:], args[1:], strict=True)
        ]
        return builder.select(_holds(builder, args[0]), *values)

    return LANE(mask, a, b), generate


def _polynomial(context: Any, builder: Any, kind: Any, table: Any, x: Any, load: Callable[[Any], Any]) -> Any:
    """Evaluate a polynomial by Horner's scheme without a loop; ``load`` takes the first entry of a row of the table."""
    array = context.make_array(kind)(context, builder, table)
    rows, stride, total = builder.bitcast(array.data, _BYTES), builder.extract_value(array.strides, 0), None
    for term in range(ORDER - 1, -1, -1):
        row = builder.gep(rows, [builder.mul(stride, stride.type(term))])
        coefficient = load(builder.bitcast(row, array.data.type))
        # One operation where the processor has it.
        total = by_vector(builder, "fmuladd", total, x, coefficient) if total else coefficient
    return total


@_intrinsic
def polynomial(_context: Any, table: Any, column: Any, x: Any) -> Any:
    """Evaluate the polynomials of a column of a table [power, column, lane] at a point of each lane."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        def load(first: Any) -> Any:
            place = builder.gep(first, [builder.mul(args[1], args[1].type(LANES))])
            return builder.load(builder.bitcast(place, VECTOR.as_pointer()), align=8)

        return _polynomial(context, builder, signature.args[0], args[0], args[2], load)

    return LANE(table, column, x), generate


@_intrinsic
def polynomial_of(_context: Any, table: Any, column: Any, lane: Any, x: Any) -> Any:
    """Evaluate the polynomial of one lane at eight points, as :func:`polynomial`."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        def load(first: Any) -> Any:
            place = builder.add(builder.mul(args[1], args[1].type(LANES)), args[2])
            return _spread(builder, builder.load(builder.gep(first, [place])))

        return _polynomial(context, builder, signature.args[0], args[0], args[3], load)

    return LANE(table, column, lane, x), generate


@_intrinsic
def any_lane(_context: Any, mask: Any) -> Any:
    """True if the mask holds in any lane."""

    def generate(_context: Any, builder: Any, _signature: Any, args: Any) -> Any:
        bits = ir.IntType(LANES)
        return builder.icmp_unsigned("!=", builder.bitcast(_holds(builder, args[0]), bits), bits(0))

    return types.boolean(mask), generate


def _unary(emit: Callable[[Any, Any], Any]) -> Any:
    """Return a function of one vector."""

    @_intrinsic
    def apply(_context: Any, value: Any) -> Any:
        def generate(_context: Any, builder: Any, _signature: Any, args: Any) -> Any:
            return emit(builder, args[0])

        return LANE(value), generate

    return apply


same = _unary(_spread)
"""Broadcast one number to eight lanes."""
absolute = _unary(lambda builder, value: by_vector(builder, "fabs", value))
"""Absolute values of eight numbers."""
floor = _unary(lambda builder, value: by_vector(builder, "floor", value))
"""Round eight numbers down to whole numbers."""
square_root = _unary(lambda builder, value: by_vector(builder, "sqrt", value))
"""Square roots of eight numbers."""
logarithm = _unary(log)
"""Natural logarithms of eight numbers."""
exponential = _unary(exp)
"""Exponentials of eight numbers."""
