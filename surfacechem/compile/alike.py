"""Expressions of the same form, such as those of a body's cells: each form is compiled once and called in a loop.

The balances of cells, their derivatives and the terms of sums over them are one function of different states and
numbers. The code of such a form is vectorised over the cells, and a table contains the states and numbers that each
cell reads. So the compile time does not grow with the number of cells, and another grid needs no new code.
"""

from __future__ import annotations

import ctypes
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import chain
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import symengine
from llvmlite import ir
from numpy.typing import NDArray

from surfacechem.compile import PREPARATION, vectors
from surfacechem.compile.cache import code_file
from surfacechem.compile.objectcode import engine
from surfacechem.compile.program import C_FUNCTION
from surfacechem.compile.vectors import LANES, NUMBER, VECTOR, Code, function_body, gathered, object_code
from surfacechem.documents.cache_folder import from_file, source_digest
from surfacechem.expressions import derivative, gradient

if TYPE_CHECKING:
    from surfacechem.compile.program import Function

_WORD: Any = ir.IntType(64)
_HEADER_WORDS = 5
"""Header words before those of the loops: number of results; of the rest its number, code, user data and table of
results.
"""
_LOOP_WORDS = 5
"""Words of a loop: number of cases, and the tables of shared inputs, own inputs, numbers and results."""


class Form(NamedTuple):
    """Functions of the inputs shared by all cases of a loop, of the own inputs of each case, and of its numbers."""

    expressions: tuple[Any, ...]
    shared: tuple[Any, ...]
    own: tuple[Any, ...]
    numbers: tuple[Any, ...]

    @property
    def has_code(self) -> bool:
        """True if each case has own inputs, and vector code exists for all functions and their derivatives."""
        slopes = (slope for row in self.expressions for slope in gradient(row).values())
        return bool(self.own) and all(map(vectors.has_code, (*self.expressions, *slopes)))


@dataclass(frozen=True)
class FormLoop:
    """The cases of a form in order: the inputs that each reads, its numbers, and the results to which it is added."""

    form: Form
    own: list[int] = field(default_factory=list)
    numbers: list[float] = field(default_factory=list)
    places: list[int] = field(default_factory=list)

    @property
    def count(self) -> int:
        return len(self.places) // len(self.form.expressions)

    def tables(self, inputs: Mapping[Any, int]) -> tuple[NDArray[Any], ...]:
        """Return positions of shared inputs; own inputs and numbers by vectors of cases; positions of results."""
        vectors = -(-self.count // LANES)

        def by_vectors(values: Sequence[Any], kind: type) -> NDArray[Any]:
            rows: NDArray[Any] = np.array(values, kind).reshape(self.count, -1)
            table = np.pad(rows, ((0, vectors * LANES - self.count), (0, 0)), "edge")
            return np.ascontiguousarray(table.reshape(vectors, LANES, -1).swapaxes(1, 2))

        shared = np.array([inputs[symbol] for symbol in self.form.shared], np.int64)
        return shared, by_vectors(self.own, np.int64), by_vectors(self.numbers, float), np.array(self.places, np.int64)

    def slopes(self, inputs: Mapping[Any, int], places: Mapping[tuple[int, int], int]) -> FormLoop:
        """Return the loop of the derivatives of rows by inputs, for the row and input pairs in ``places``."""
        (row,), shared = self.form.expressions, [inputs[symbol] for symbol in self.form.shared]
        variables = {place for _, place in places}
        symbols = enumerate((*self.form.own, *self.form.shared))
        by = {k: derivative(row, x) for k, x in symbols if x in self.form.own or inputs[x] in variables}
        by = {k: slope for k, slope in by.items() if slope != 0}
        cases = zip(np.array(self.own).reshape(self.count, -1).tolist(), self.places, strict=True)
        found = [places[i, (own + shared)[k]] for own, i in cases for k in by]
        return FormLoop(self.form._replace(expressions=tuple(by.values())), self.own, self.numbers, found)


FormMatch = tuple[str, tuple[int, ...], tuple[float, ...]]
"""A form as text, and its contents from left to right: positions of inputs, and numbers."""


@lru_cache(maxsize=2)  # shared by all functions of a scene
class _Forms:
    """The forms of expressions, with the inputs and numbers of each expression in its form."""

    def __init__(self, inputs: tuple[Any, ...], own: frozenset[Any]) -> None:
        self.places = {symbol: place for place, symbol in enumerate(inputs) if symbol in own}
        self._known: dict[Any, FormMatch] = {symbol: ("x", (place,), ()) for symbol, place in self.places.items()}

    def of(self, part: Any) -> FormMatch:
        """Return the form of a part of an expression."""
        found = self._known.get(part)
        if found is not None:
            return found
        kind = type(part).__name__
        if kind == "RealDouble":
            return "c", (), (float(part),)
        if kind in _COMMUTATIVE:
            texts, own, numbers = zip(*sorted(map(self.of, part.args)), strict=True)
            found = f"{kind}({', '.join(texts)})", tuple(chain(*own)), tuple(chain(*numbers))
        else:
            found = self._whole(part)
        self._known[part] = found
        return found

    def _whole(self, part: Any) -> FormMatch:
        """Return the form of a part that is neither sum nor product: its numbers belong to the form."""
        own = self._own(part)
        form = part.xreplace({x: symengine.Symbol(f"x {k}") for k, x in enumerate(own)})
        numbers = [float(number).hex() for number in form.atoms(symengine.RealDouble)]
        return f"{form} {' '.join(sorted(numbers))}", tuple(self.places[x] for x in own), ()

    def _own(self, part: Any) -> list[Any]:
        return sorted((x for x in part.free_symbols if x in self.places), key=self.places.__getitem__)

    def form(self, part: Any) -> Form:
        """Return the function of which a part and those of the same form are cases."""
        own: dict[Any, Any] = {}
        numbers: list[Any] = []

        def made(part: Any) -> Any:
            kind = type(part).__name__
            if kind == "RealDouble":
                numbers.append(symengine.Symbol(f"number {len(numbers)}"))
                return numbers[-1]
            if kind in _COMMUTATIVE:
                return (symengine.Add if kind == "Add" else symengine.Mul)(*map(made, sorted(part.args, key=self.of)))
            return part.xreplace({x: own.setdefault(x, symengine.Symbol(f"own {len(own)}")) for x in self._own(part)})

        whole = made(symengine.sympify(part))
        shared = sorted(whole.free_symbols - {*own.values(), *numbers}, key=str)
        return Form((whole,), tuple(shared), tuple(own.values()), tuple(numbers))


_COMMUTATIVE = "Add", "Mul"
"""Kinds whose arguments are sorted, so that parts of the same form have them in the same order: along the cells."""


def loops_of(
    inputs: Sequence[Any], expressions: Sequence[Any], own: Collection[Any]
) -> tuple[list[FormLoop], list[Any]]:
    """Return the loops over parts that differ only in their ``own`` inputs and numbers, and the rest of each.

    >>> x = symengine.symbols("x0:20")
    >>> k = symengine.Symbol("k")
    >>> rows = [k * (i + 0.5) * (a - b) for i, (a, b) in enumerate(zip(x, x[1:]))]
    >>> (loop,), rest = loops_of([k, *x], [*rows, k**2], x)
    >>> loop.form.expressions, loop.count, rest[-2:]
    ((k*(-own 0 + own 1)*number 0,), 19, [0, k**2])
    """
    forms, loops = _Forms(tuple(inputs), frozenset(own)), dict[tuple[str, tuple[int, ...]], FormLoop]()
    members: dict[tuple[str, tuple[int, ...]], list[Any]] = {}
    for place, expression in enumerate(expressions):
        for term in _terms(expression):
            text, read, numbers = forms.of(term)
            first = {x: k for k, x in enumerate(dict.fromkeys(read))}
            key = text, tuple(map(first.__getitem__, read))
            loop = loops.get(key)
            if loop is None:
                loop, members[key] = FormLoop(forms.form(term)), []
                loops[key] = loop
            loop.own.extend(first)
            loop.numbers.extend(numbers)
            loop.places.append(place)
            members[key].append(term)
    # Sorted, since the order of terms in sums is not reproducible.
    several = {key: loop for key, loop in sorted(loops.items()) if loop.count >= LANES and loop.form.has_code}
    rest: list[list[Any]] = [[] for _ in expressions]
    for key, loop in loops.items():
        if key not in several:
            for place, term in zip(loop.places, members[key], strict=True):
                rest[place].append(term)
    return [*several.values()], [symengine.Add(*terms) for terms in rest]


def _terms(expression: Any) -> Sequence[Any]:
    """Return the terms of a long sum, or the expression."""
    if expression == 0:
        return ()
    args = expression.args if type(expression).__name__ == "Add" else ()
    return args if len(args) > LANES else (expression,)


class LoopCode:
    """The code of loops with their tables, and the code of the rest.

    ``left`` are the positions of the rest among the results; of each loop ``tables`` are the number of cases and those
    of :meth:`FormLoop.tables`.
    """

    def __init__(
        self, n_out: int, left: NDArray[np.int64], tables: Sequence[tuple[Any, ...]], rest: Function | None, code: bytes
    ) -> None:
        head = [n_out, len(left), *((rest.address, rest.user) if rest else (0, 0)), left.ctypes.data]
        words = [word for count, *arrays in tables for word in (count, *(array.ctypes.data for array in arrays))]
        self.table = np.array([*head, *words], np.int64)
        self._given = n_out, left, tables, rest, code
        self._engine = _engine(code)
        self._n_out = n_out
        self._call: Any = C_FUNCTION(int(self._engine.get_function_address("f")))

    def __reduce__(self) -> tuple[type[LoopCode], tuple[Any, ...]]:
        """Pickle the code and the tables, without addresses."""
        return type(self), self._given

    @classmethod
    def of(
        cls, inputs: Sequence[Any], loops: Sequence[FormLoop], rest: Sequence[Any], code: Function | None
    ) -> LoopCode:
        """Return the code of loops and of the ``rest`` of each expression, of which ``code`` gives those not zero."""
        left = np.array([place for place, expression in enumerate(rest) if expression != 0], np.int64)
        places = {symbol: place for place, symbol in enumerate(inputs)}
        tables = [(loop.count, *loop.tables(places)) for loop in loops]
        return cls(len(rest), left, tables, code, _code_of(tuple(loop.form for loop in loops)))

    def as_ctypes(self) -> tuple[Any, Any]:
        """Return the function and its user data, as SymEngine does for its code."""
        return self._call, ctypes.c_void_p(self.table.ctypes.data)

    def __call__(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the results for rows of inputs."""
        rows = values.reshape(-1, values.shape[-1])
        found = np.empty((len(rows), self._n_out))
        for out, given in zip(found, rows, strict=True):
            self._call(out.ctypes.data, given.ctypes.data, self.table.ctypes.data)
        return found.reshape(*values.shape[:-1], self._n_out)


@lru_cache(maxsize=64)
@PREPARATION
def _code_of(forms: tuple[Form, ...]) -> bytes:
    """Return the code of loops over these forms, which also calls that of the rest.

    Its signature is ``void f(double *out, const double *inputs, void *user)``, with the words of the table as user
    data.
    """

    def made() -> bytes:
        code = _Loops()
        code.nothing()
        code.rest()
        for number, form in enumerate(forms):
            code.loop(form, _HEADER_WORDS + _LOOP_WORDS * number)
        code.builder.ret_void()
        return object_code(code.builder)

    sources = map(source_digest, (__file__, vectors.__file__))  # the sources that generate the code
    origins = (str((form.expressions, form.shared, form.own, form.numbers)) for form in forms)
    return bytes(from_file(code_file([*sources, *origins]), made, bytes, bytes))


_engine = lru_cache(maxsize=64)(PREPARATION(engine))
"""Engine of an object code: functions with the same loops share one."""


class _Loops:
    """The body of the function."""

    def __init__(self) -> None:
        self.builder = function_body()
        self.out, self.inputs, self.user = self.builder.function.args

    def nothing(self) -> None:
        """Set the results to zero, since everything is added to them."""
        with self._each(self._word(0)) as i:
            self.builder.store(NUMBER(0.0), self._entry(self.out, i))

    def rest(self) -> None:
        """Call the code of the expressions that are in no loop."""
        b = self.builder
        count, address, user, places = map(self._word, range(1, _HEADER_WORDS))
        with b.if_then(b.icmp_signed(">", count, _WORD(0))):
            values = b.bitcast(b.alloca(NUMBER, count), self.out.type)
            code = b.inttoptr(address, b.function.ftype.as_pointer())
            b.call(code, [values, self.inputs, b.inttoptr(user, self.user.type)])
            with self._each(count) as i:
                self._add(self._read(places, i, _WORD), self._read(values, i))

    def loop(self, form: Form, head: int) -> None:
        """Add the values of a form, for the number of cases in the words of its loop."""
        b = self.builder
        count, shared, own, numbers, places = (self._word(head + k) for k in range(_LOOP_WORDS))
        known, results = {}, [b.alloca(VECTOR) for _ in form.expressions]
        for k, symbol in enumerate(form.shared):
            known[symbol] = gathered(b, [self._read(self.inputs, self._read(shared, _WORD(k), _WORD))] * LANES)
        with self._each(b.sdiv(b.add(count, _WORD(LANES - 1)), _WORD(LANES))) as block:
            first = b.mul(block, _WORD(LANES))
            for k, symbol in enumerate(form.own):
                row = b.add(b.mul(first, _WORD(len(form.own))), _WORD(LANES * k))
                which = [self._read(own, b.add(row, _WORD(lane)), _WORD) for lane in range(LANES)]
                known[symbol] = gathered(b, [self._read(self.inputs, place) for place in which])
            for k, symbol in enumerate(form.numbers):
                row = b.add(b.mul(first, _WORD(len(form.numbers))), _WORD(LANES * k))
                known[symbol] = self._read(numbers, row, VECTOR)
            values = Code(b, known.__getitem__, form.expressions).values
            for vector, value in zip(results, values, strict=True):
                b.store(value, vector, align=8)
            left = b.sub(count, first)
            with self._each(b.select(b.icmp_signed("<", left, _WORD(LANES)), left, _WORD(LANES))) as lane:
                row = b.mul(b.add(first, lane), _WORD(len(values)))
                for k, vector in enumerate(results):
                    number = self._read(b.bitcast(vector, self.out.type), lane)
                    self._add(self._read(places, b.add(row, _WORD(k)), _WORD), number)

    def _word(self, place: int) -> Any:
        return self._read(self.user, _WORD(place), _WORD)

    def _entry(self, start: Any, place: Any, kind: Any = NUMBER) -> Any:
        """Return a pointer to a word or a number at an offset from a pointer or an address."""
        start = start if start.type == self.out.type else self.builder.inttoptr(start, self.out.type)
        entry = self.builder.gep(start, [self.builder.mul(place, _WORD(8))])
        return self.builder.bitcast(entry, kind.as_pointer())

    def _read(self, start: Any, place: Any, kind: Any = NUMBER) -> Any:
        return self.builder.load(self._entry(start, place, kind), align=8)

    def _add(self, place: Any, value: Any) -> None:
        entry = self._entry(self.out, place)
        self.builder.store(self.builder.fadd(self.builder.load(entry), value), entry)

    @contextmanager
    def _each(self, count: Any) -> Iterator[Any]:
        """Generate code for each number below a count."""
        b = self.builder
        before, test = b.block, b.append_basic_block()
        b.branch(test)
        b.position_at_end(test)
        number = b.phi(count.type)
        number.add_incoming(_WORD(0), before)
        body, after = b.append_basic_block(), b.append_basic_block()
        b.cbranch(b.icmp_signed("<", number, count), body, after)
        b.position_at_end(body)
        yield number
        number.add_incoming(b.add(number, _WORD(1)), b.block)
        b.branch(test)
        b.position_at_end(after)
