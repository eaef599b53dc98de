"""Compilation of SymEngine expressions to machine code that evaluates eight cases at once, for sweeps.

SymEngine's code is scalar. Here the same graph becomes LLVM vectors with one case in each lane: inputs and results have
the case as last axis. Exponentials and logarithms are vectorised too, accurate to one unit in the last place; functions
that are rare in laws are called from the C library, lane by lane. On a processor with shorter vectors LLVM uses several
of them.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from decimal import Decimal
from functools import reduce
from math import factorial
from typing import Any, NamedTuple

import numpy as np
import symengine
from llvmlite import binding, ir
from numpy.typing import NDArray

from surfacechem.compile import PREPARATION
from surfacechem.compile.objectcode import engine

LANES = 8
"""Cases of a vector: one of the widest vector registers, or two of those of most processors, which hide each other's
latency.
"""

_binding: Any = binding
_Constant: Any = ir.Constant
NUMBER = ir.DoubleType()
VECTOR: Any = ir.VectorType(NUMBER, LANES)
MASK: Any = ir.VectorType(ir.IntType(1), LANES)
INTEGERS: Any = ir.VectorType(ir.IntType(64), LANES)
_POINTER = ir.IntType(8).as_pointer()


class LaneFunction(NamedTuple):
    """Machine code for eight cases at once.

    Its C signature is ``void f(double *out, const double *inputs, void *user)``, with inputs [input, case] and results
    [result, case].

    >>> x, y = symengine.symbols("x y")
    >>> compile_lanes([x, y], [x * y, x + y])(np.arange(16.0).reshape(2, 8))[:, :3]
    array([[ 0.,  9., 20.],
           [ 8., 10., 12.]])
    """

    address: int
    n_out: int
    keep: Any
    """Owner of the machine code: the address is valid as long as this object lives."""

    def __call__(self, inputs: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the results for eight cases, shape (results, 8), from inputs of shape (inputs, 8)."""
        values = np.ascontiguousarray(inputs, dtype=float)
        found = np.empty((self.n_out, LANES))
        code = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p)(self.address)
        code(found.ctypes.data, values.ctypes.data, None)
        return found


@PREPARATION
def compile_lanes(inputs: Sequence[Any], expressions: Sequence[Any]) -> LaneFunction:
    """Compile a vector of expressions of the inputs for eight cases at once.

    Raise NotImplementedError if an expression contains a function without vector code.
    """
    builder = function_body()
    places = {symbol: place for place, symbol in enumerate(inputs)}
    out, given, _ = builder.function.args
    code = Code(builder, lambda symbol: builder.load(entry(builder, given, places[symbol]), align=8), expressions)
    for number, value in enumerate(code.values):
        builder.store(value, entry(builder, out, number), align=8)
    builder.ret_void()
    held = engine(object_code(builder))
    return LaneFunction(int(held.get_function_address("f")), len(expressions), held)


def constants_apart(expressions: Sequence[Any], constants: Iterable[Any]) -> tuple[dict[Any, Any], list[Any]]:
    """Return new symbols with the parts of expressions that read only ``constants``, and the expressions in terms of
    them.

    What does not change along a run is formed once for each, above all divisions and exponentials.

    >>> p, q, x = symengine.symbols("p q x")
    >>> constants_apart([x / (p * q), symengine.exp(p) + x], [p, q])
    ({constant_0: 1/(p*q), constant_1: exp(p)}, [x*constant_0, constant_1 + x])
    """
    parts = _Parts(constants)
    for expression in expressions:
        for part in _arguments_first(expression, lambda each: each.args, parts.known):
            parts.known[part] = parts.replaced(part)
    found = [parts.with_symbols(expression) for expression in expressions]
    return {symbol: part for part, symbol in parts.symbols.items()}, found


MOST_DEGREE = 4
"""Degree up to which a polynomial of states counts as smooth. Over a step states are polynomials of degree 7 of the
time, so that it is one of degree 28 at most, without features narrower than the distance of the stages.
"""


def divisors(expressions: Sequence[Any], t: Any, states: Sequence[Any]) -> tuple[bool, ...]:
    """Return a flag for each state, true if expressions divide by it; nothing if one may have narrow features, because
    it is anything else than a sum of products of a few states and times, their powers, and inverses of states.

    >>> p, t, x, y = symengine.symbols("p t x y")
    >>> divisors([symengine.exp(p) * (t - x) ** 2 / y, x], t, [x, y])
    (False, True)
    >>> [divisors([each], t, [x, y]) for each in (1 / (1 - x), x**5, symengine.exp(x), 1 / t)]
    [(), (), (), ()]
    """
    degrees: dict[Any, float] = {}
    for expression in expressions:
        for part in _arguments_first(expression, lambda each: each.args, degrees):
            own = [degrees[each] for each in part.args]
            degrees[part] = _degree(part, own, states) if any(own) else float(part == t or part in states)
        if degrees[expression] > MOST_DEGREE:
            return ()
    powers = [part.args for part in degrees if type(part).__name__ == "Pow"]
    divided = {base for base, power in powers if power.is_negative}
    return tuple(state in divided for state in states)


def _degree(part: Any, own: Sequence[float], states: Sequence[Any]) -> float:
    """Return the degree of an expression with arguments of these degrees; infinite if it is no polynomial of states and
    their inverses.
    """
    match type(part).__name__:
        case "Add":
            return max(own)
        case "Mul":
            return sum(own)
        case "Pow" if part.args[1].is_Integer and (part.args[1].is_positive or part.args[0] in states):
            return own[0] * abs(int(part.args[1]))
    return math.inf


class _Parts:
    """Parts of expressions in terms of symbols for what is constant."""

    def __init__(self, constants: Iterable[Any]) -> None:
        self.known: dict[Any, Any] = dict.fromkeys(constants)
        """Each part in terms of the symbols; None for one that is constant."""
        self.symbols: dict[Any, Any] = {}

    def _symbol(self, part: Any) -> Any:
        """Return the symbol of a constant part; itself if nothing is to be formed, or if it is no number."""
        if not part.args or type(part).__name__ in _CONDITIONS:
            return part
        return self.symbols.setdefault(part, symengine.Symbol(f"constant_{len(self.symbols)}"))

    def with_symbols(self, part: Any) -> Any:
        """Return a known part in terms of the symbols."""
        return self._symbol(part) if self.known[part] is None else self.known[part]

    def replaced(self, part: Any) -> Any:
        """Return a part whose arguments are known in terms of the symbols; None if it is constant."""
        kind = type(part).__name__
        if not part.args:
            return None if part.is_Number or kind in {*_CONSTANTS, *_BOOLEANS} else part
        fixed = [each for each in part.args if self.known[each] is None]
        if len(fixed) == len(part.args):
            return None
        if kind in ("Add", "Mul") and fixed:  # one constant for all of them
            others = [self.known[each] for each in part.args if self.known[each] is not None]
            return part.func(self._symbol(part.func(*fixed)), *others)
        args = [self.with_symbols(each) for each in part.args]
        if kind == "Piecewise":
            return symengine.Piecewise(*zip(args[::2], args[1::2], strict=True))
        return (_CONDITIONS.get(kind) or part.func)(*args)


def entry(builder: Any, argument: Any, place: int) -> Any:
    """Return a pointer to a vector of an argument."""
    pointer = builder.gep(argument, [ir.IntType(64)(8 * LANES * place)])
    return builder.bitcast(pointer, VECTOR.as_pointer())


def function_body() -> Any:
    """Return a builder of the body of a function ``f`` in a new module."""
    kind = ir.FunctionType(ir.VoidType(), [_POINTER] * 3)
    function: Any = ir.Function(ir.Module(name="lanes"), kind, name="f")
    return ir.IRBuilder(function.append_basic_block())


def object_code(builder: Any) -> bytes:
    """Return the machine code of the builder's module for this processor."""
    _binding.initialize_native_target()
    _binding.initialize_native_asmprinter()
    features = _binding.get_host_cpu_features().flatten()
    target = _binding.Target.from_default_triple()
    machine = target.create_target_machine(cpu=_binding.get_host_cpu_name(), features=features, opt=2, jit=True)
    module = _binding.parse_assembly(str(builder.module))
    passes = _binding.create_pass_builder(machine, _binding.create_pipeline_tuning_options(speed_level=2))
    passes.getModulePassManager().run(module, passes)
    return bytes(machine.emit_object(module))


def _arguments_first(whole: Any, parts: Callable[[Any], Sequence[Any]], known: Mapping[Any, Any]) -> Iterator[Any]:
    """Yield unknown parts of an expression, arguments first, without recursion; the caller adds each to ``known``."""
    left = [whole]
    while left:
        missing = [each for each in parts(left[-1]) if each not in known] if left[-1] not in known else []
        if missing:
            left += missing
        elif (part := left.pop()) not in known:
            yield part


class Code:
    """Vectors for expressions, each part of the graph once; ``read`` returns those of the symbols."""

    def __init__(self, builder: Any, read: Callable[[Any], Any], expressions: Sequence[Any]) -> None:
        self.builder, self.read = builder, read
        self.known: dict[Any, Any] = {}
        """Values of parts that are available at the present position of the code."""
        self.costs: dict[Any, bool] = {}
        named, reduced = symengine.cse([symengine.sympify(each) for each in expressions]) if expressions else ([], [])
        self.definitions = dict(named)
        self.values = [self.value(expression) for expression in reduced]

    def _parts(self, part: Any) -> Sequence[Any]:
        return (self.definitions[part],) if part in self.definitions else part.args

    def value(self, expression: Any) -> Any:
        """Return the vector of a number, a symbol or a function, or the mask of a condition."""
        for part in _arguments_first(expression, self._first, self.known):
            self.known[part] = self._made(part)
        return self.known[expression]

    def _first(self, part: Any) -> Sequence[Any]:
        """Return the parts evaluated before a part: its arguments, except branches that only some cases need."""
        parts = self._parts(part)
        return parts[1:2] if type(part).__name__ == "Piecewise" and self._costs(part) else parts

    def _costs(self, expression: Any) -> bool:
        """True if an expression takes longer than a jump around it."""
        for part in _arguments_first(expression, self._parts, self.costs):
            kind = type(part).__name__
            # These functions take some ten times as long as a sum.
            slow = kind in ("log", *_LIBRARY) or (kind == "Pow" and not part.args[1].is_Integer)
            self.costs[part] = slow or any(self.costs[each] for each in self._parts(part))
        return self.costs[expression]

    def _made(self, part: Any) -> Any:
        kind = type(part).__name__
        if part in self.definitions:
            return self.known[self.definitions[part]]
        if part.is_Symbol:
            return self.read(part)
        if part.is_Number or kind in _CONSTANTS:
            return number(float(part))
        if kind in _BOOLEANS:
            return _Constant(MASK, [int(kind == "BooleanTrue")] * LANES)
        if kind == "Piecewise" and self._costs(part):
            return self._chosen(part.args)
        values = [self.known[each] for each in part.args]
        if kind in _METHODS:
            return _METHODS[kind](self, part, values)
        if kind in _LIBRARY:
            return self._by_library(_LIBRARY[kind], values)
        raise NotImplementedError(f"no vector code for {kind}: {part}")

    def _chosen(self, args: Sequence[Any]) -> Any:
        """Return the first value whose condition holds; each value is evaluated only if a case needs it."""
        value, condition, *rest = args
        holds = self.value(condition)
        first = self._where_any(holds, lambda: self.value(value))
        if not rest:
            return self.builder.select(holds, first, number(np.nan))
        other = self._where_any(self.builder.not_(holds), lambda: self._chosen(rest))
        return self.builder.select(holds, first, other)

    def _where_any(self, mask: Any, made: Callable[[], Any]) -> Any:
        """Return a value whose code is skipped if the mask is false in all cases."""
        bits = ir.IntType(LANES)
        needed = self.builder.icmp_unsigned("!=", self.builder.bitcast(mask, bits), bits(0))
        before = self.builder.block
        outside, self.known = self.known, dict(self.known)
        with self.builder.if_then(needed):
            found = made()
            inside = self.builder.block
        self.known = outside
        result = self.builder.phi(VECTOR)
        result.add_incoming(found, inside)
        result.add_incoming(number(0.0), before)
        return result

    def _piecewise(self, _part: Any, values: Sequence[Any]) -> Any:
        """Return the first value whose condition holds."""
        pairs = list(zip(values[::2], values[1::2], strict=True))
        return reduce(lambda rest, pair: self.builder.select(pair[1], pair[0], rest), pairs[::-1], number(np.nan))

    def _relation(self, part: Any, values: Sequence[Any]) -> Any:
        truths = values[0].type == MASK  # a comparison of two conditions
        compare = self.builder.icmp_unsigned if truths else self.builder.fcmp_ordered
        return compare(_RELATIONS[type(part).__name__], *values)

    def _extreme(self, part: Any, values: Sequence[Any]) -> Any:
        sign = ">" if type(part).__name__ == "Max" else "<"
        return reduce(lambda a, b: self.builder.select(self.builder.fcmp_ordered(sign, a, b), a, b), values)

    def _product(self, part: Any, _values: Sequence[Any]) -> Any:
        """Return a product, with one division for all its negative powers."""
        above: list[Any] = []
        below: list[Any] = []
        for factor in part.args:
            inverse = type(factor).__name__ == "Pow" and factor.args[1].is_Integer and int(factor.args[1]) < 0
            (below if inverse else above).append(factor)
        top = reduce(self.builder.fmul, [self.known[each] for each in above]) if above else number(1.0)
        if not below:
            return top
        bottom = reduce(self.builder.fmul, [self._whole_power(e.args[0], -int(e.args[1])) for e in below])
        return self.builder.fdiv(top, bottom)

    def _power(self, part: Any, _values: Sequence[Any]) -> Any:
        base, exponent = part.args
        if base == symengine.E:
            return exp(self.builder, self.known[exponent])
        if exponent.is_Integer:
            power = self._whole_power(base, abs(int(exponent)))
            return power if int(exponent) > 0 else self.builder.fdiv(number(1.0), power)
        if exponent in (symengine.Rational(1, 2), symengine.Rational(-1, 2)):
            found = by_vector(self.builder, "sqrt", self.known[base])
            return found if exponent > 0 else self.builder.fdiv(number(1.0), found)
        return self._by_library("pow", [self.known[base], self.known[exponent]])

    def _whole_power(self, base: Any, exponent: int) -> Any:
        """Return a power by repeated squaring."""
        square, found = self.known[base], None
        while exponent:
            if exponent % 2:
                found = square if found is None else self.builder.fmul(found, square)
            exponent //= 2
            square = self.builder.fmul(square, square) if exponent else square
        return found

    def _by_library(self, name: str, values: Sequence[Any]) -> Any:
        """Call a function of the C library in each lane."""
        kind = ir.FunctionType(NUMBER, [NUMBER] * len(values))
        function = self.builder.module.globals.get(name) or ir.Function(self.builder.module, kind, name=name)
        places = map(ir.IntType(32), range(LANES))
        given = ([self.builder.extract_element(value, place) for value in values] for place in places)
        return gathered(self.builder, (self.builder.call(function, own) for own in given))


_CONDITIONS: dict[str, Any] = {
    "LessThan": symengine.Le,
    "StrictLessThan": symengine.Lt,
    "Equality": symengine.Eq,
    "Unequality": symengine.Ne,
    "And": symengine.And,
    "Or": symengine.Or,
}
"""What makes a condition, by the kind of its node."""
_CONSTANTS = {"Pi", "Exp1"}
_BOOLEANS = {"BooleanTrue", "BooleanFalse"}
_RELATIONS = {"LessThan": "<=", "StrictLessThan": "<", "Equality": "==", "Unequality": "!="}
_METHODS: dict[str, Callable[[Any, Any, Any], Any]] = {
    "Add": lambda code, _part, values: reduce(code.builder.fadd, values),
    "Mul": Code._product,
    "Pow": Code._power,
    "log": lambda code, _part, values: log(code.builder, *values),
    "Piecewise": Code._piecewise,
    **dict.fromkeys(_RELATIONS, Code._relation),
    "And": lambda code, _part, values: reduce(code.builder.and_, values),
    "Or": lambda code, _part, values: reduce(code.builder.or_, values),
    **dict.fromkeys(("Max", "Min"), Code._extreme),
}
"""Method that generates the vectors of a node of the graph, by its kind."""
_TRIGONOMETRIC = "sin", "cos", "tan", "asin", "acos", "atan"
_HYPERBOLIC = "sinh", "cosh", "tanh", "asinh", "acosh", "atanh"
_LIBRARY = {name: name for name in (*_TRIGONOMETRIC, *_HYPERBOLIC, "erf", "erfc")} | {"Abs": "fabs"}
"""Functions of the C library, by the kind of their node."""


def has_code(expression: Any) -> bool:
    """True if there is vector code for everything in an expression."""
    left = [expression]
    while left:
        part = left.pop()
        kind = type(part).__name__
        if not (part.is_Symbol or part.is_Number or kind in {*_CONSTANTS, *_BOOLEANS, *_METHODS, *_LIBRARY}):
            return False
        left += part.args
    return True


def number(value: float) -> Any:
    """Return a vector with the same number in every lane."""
    return _Constant(VECTOR, [value] * LANES)


def gathered(builder: Any, values: Iterable[Any]) -> Any:
    """Return a vector of numbers, each inserted as it is formed."""
    found = _Constant(VECTOR, ir.Undefined)
    for lane, value in enumerate(values):
        found = builder.insert_element(found, value, ir.IntType(32)(lane))
    return found


def _whole(value: int) -> Any:
    return _Constant(INTEGERS, [value] * LANES)


def _bits(value: float) -> int:
    return int(np.float64(value).view(np.int64))


def by_vector(builder: Any, function: str, *values: Any) -> Any:
    """Call a function that LLVM provides for vectors, such as `sqrt`."""
    name = f"llvm.{function}.v{LANES}f64"
    declared = builder.module.globals.get(name)
    if declared is None:
        declared = ir.Function(builder.module, ir.FunctionType(VECTOR, [VECTOR] * len(values)), name=name)
    return builder.call(declared, values)


def _polynomial(builder: Any, x: Any, coefficients: Sequence[float]) -> Any:
    """Evaluate a polynomial from its coefficients, the lowest first: in pairs, pairs of pairs, ... (Estrin), since in
    Horner's scheme each operation has to wait for the one before.
    """
    terms = [number(c) for c in coefficients]
    while len(terms) > 1:
        # Each pair in one operation where the processor has it.
        pairs = [
            by_vector(builder, "fmuladd", high, x, low) for low, high in zip(terms[::2], terms[1::2], strict=False)
        ]
        terms = pairs + terms[2 * len(pairs) :]
        x = builder.fmul(x, x)
    return terms[0]


_LN2_HIGH = 0.693147180369123816490
_LN2_LOW = float(Decimal(2).ln() - Decimal(_LN2_HIGH))
"""The logarithm of 2 in two parts, the first with trailing zeros, so that its multiples are exact (fdlibm)."""
_ROUNDING_SHIFT = 1.5 * 2.0**52
"""Adding and subtracting it rounds to an integer, which is in the last bits of the sum: many processors have no vector
instruction that converts a number to an integer, or shifts an integer with its sign.
"""
_MAX_EXP, _MIN_EXP = 709.782712893384, -745.2
"""Arguments above which exp overflows, and below which it underflows to zero."""
_EXP = [1.0 / factorial(k) for k in range(2, 14)]
"""Taylor series without its first two terms: below half of the logarithm of 2 the next one is 4e-18."""


def exp(builder: Any, x: Any) -> Any:
    """Exponential of a vector: 2^k exp(r) with abs(r) at most half of the logarithm of 2 (Cody & Waite)."""
    rounded = by_vector(builder, "fmuladd", x, number(1.4426950408889634), number(_ROUNDING_SHIFT))
    whole = builder.fsub(rounded, number(_ROUNDING_SHIFT))
    rest = by_vector(builder, "fmuladd", whole, number(-_LN2_HIGH), x)
    rest = by_vector(builder, "fmuladd", whole, number(-_LN2_LOW), rest)
    series = by_vector(builder, "fmuladd", builder.fmul(rest, rest), _polynomial(builder, rest, _EXP), rest)
    # In two factors, as the power of 2 may lie beyond the range.
    power = builder.sub(builder.bitcast(rounded, INTEGERS), _whole(_bits(_ROUNDING_SHIFT)))
    half = builder.sub(builder.lshr(builder.add(power, _whole(2048)), _whole(1)), _whole(1024))
    first, second = (
        builder.bitcast(builder.shl(builder.add(part, _whole(1023)), _whole(52)), VECTOR)
        for part in (half, builder.sub(power, half))
    )
    found = builder.fmul(by_vector(builder, "fmuladd", series, first, first), second)
    found = builder.select(builder.fcmp_ordered(">", x, number(_MAX_EXP)), number(np.inf), found)
    # Here rather than before: what follows from the argument would have to wait for it.
    found = builder.select(builder.fcmp_ordered("<", x, number(_MIN_EXP)), number(0.0), found)
    return builder.select(builder.fcmp_unordered("uno", x, x), x, found)


_LOG_EVEN = [6.666666666666735130e-01, 2.857142874366239149e-01, 1.818357216161805012e-01, 1.479819860511658591e-01]
_LOG_ODD = [3.999999999940941908e-01, 2.222219843214978396e-01, 1.531383769920937332e-01]
"""Coefficients of the series of log((1 + s) / (1 - s)) / s - 2 in even and odd powers of s^2 (fdlibm, e_log.c)."""
_SQRT_HALF_BITS = 0x3FE6A09E667F3BCD
"""The bits of the square root of one half."""


def log(builder: Any, x: Any) -> Any:
    """Natural logarithm of a vector (fdlibm, e_log.c): x = 2^k (1 + f) with sqrt(1/2) <= 1 + f < sqrt(2)."""
    tiny = builder.fcmp_ordered("<", x, number(2.0**-1022))
    scaled = builder.select(tiny, builder.fmul(x, number(2.0**54)), x)
    bits = builder.sub(builder.bitcast(scaled, INTEGERS), _whole(_SQRT_HALF_BITS))
    # k + 1024 is positive; an integer below 2^52, or-ed with the bits of 2^52, is that double plus the integer.
    counted = builder.lshr(builder.add(bits, _whole(1024 << 52)), _whole(52))
    counted = builder.bitcast(builder.or_(counted, _whole(_bits(2.0**52))), VECTOR)
    power = builder.fsub(counted, builder.select(tiny, number(2.0**52 + 1078.0), number(2.0**52 + 1024.0)))
    kept = builder.add(builder.and_(bits, _whole(2**52 - 1)), _whole(_SQRT_HALF_BITS))
    f = builder.fsub(builder.bitcast(kept, VECTOR), number(1.0))
    s = builder.fdiv(f, builder.fadd(number(2.0), f))
    z = builder.fmul(s, s)
    w = builder.fmul(z, z)
    even, odd = builder.fmul(z, _polynomial(builder, w, _LOG_EVEN)), builder.fmul(w, _polynomial(builder, w, _LOG_ODD))
    half = builder.fmul(number(0.5), builder.fmul(f, f))
    inner = builder.fadd(
        builder.fmul(s, builder.fadd(half, builder.fadd(even, odd))), builder.fmul(power, number(_LN2_LOW))
    )
    found = builder.fsub(builder.fmul(power, number(_LN2_HIGH)), builder.fsub(builder.fsub(half, inner), f))
    usual = builder.and_(builder.fcmp_ordered(">", x, number(0.0)), builder.fcmp_ordered("<", x, number(np.inf)))
    # Infinity, zero, negative numbers, and NaN.
    zero = builder.select(builder.fcmp_ordered("==", x, number(0.0)), number(-np.inf), number(np.nan))
    other = builder.select(builder.fcmp_ordered("==", x, number(np.inf)), x, zero)
    return builder.select(usual, found, other)
