"""Linear combinations of the stages, of four states at a time.

A table of coefficients times the matrix [stage, state] is what a step does most often. Its loops are too short for a
compiler to make vectors of them; here they are written as vectors, whatever the number of states: the last vector of
a row runs over into the next row, which is written after it, or into rows that are kept free behind the last stage.
"""

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

_intrinsic: Any = intrinsic
_Constant: Any = ir.Constant
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
