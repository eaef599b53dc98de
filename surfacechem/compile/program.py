"""Compilation of SymEngine expressions to machine code.

All functions of a program have the same inputs, [t | y | ydot | p], so that a trajectory has one buffer and fills in
the parameters once. The machine code is SymEngine's LLVM output: about 10 ms for a small scene, cached in the user's
cache folder, called by the stepper through a raw pointer and from Python as a vectorised function.
"""

import ctypes
import hashlib
import pickle
import threading
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np
import symengine
from numpy.typing import ArrayLike, NDArray

from surfacechem import expressions as calculus
from surfacechem.compile import PREPARATION
from surfacechem.compile.cache import code_file
from surfacechem.documents.cache_folder import PACKAGE, from_file, source_digest
from surfacechem.expressions import derivative, gradient

if TYPE_CHECKING:
    from surfacechem.compile.alike import FormLoop
    from surfacechem.compile.vectors import LaneFunction

T = TypeVar("T")

C_FUNCTION = ctypes.PYFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p)
"""C signature of machine code, for calls from Python with addresses."""


@dataclass(frozen=True)
class Function:
    """Machine code with the C signature ``void f(double *out, const double *inputs, void *user)``.

    >>> x, y = symengine.symbols("x y")
    >>> compile_function([x, y], [x * y, x + y])([[2.0, 3.0], [4.0, 5.0]])
    array([[ 6.,  5.],
           [20.,  9.]])
    >>> compile_function([x, y], [])([2.0, 3.0])
    array([], dtype=float64)
    """

    address: int
    user: int
    n_in: int
    n_out: int
    keep: Any
    """Owner of the machine code: the address is valid as long as this object lives."""

    def __call__(self, inputs: ArrayLike) -> NDArray[np.float64]:
        values = np.ascontiguousarray(inputs, dtype=float)
        if not (self.n_out and values.size):  # code without results or inputs cannot be called
            return np.empty((*values.shape[:-1], self.n_out))
        if values.shape == (self.n_in,):
            # A direct call, in half the time that the library takes to check its arguments.
            code, row, results = self._called
            found = results()
            code(found, row.from_buffer(values), self.user)
            return np.frombuffer(found)
        return np.asarray(self.keep(values))

    @classmethod
    def of(cls, code: Any, n_in: int, n_out: int) -> "Function":
        """Return the function of code by SymEngine, or of loops."""
        function, user = code.as_ctypes()
        return cls(int(ctypes.cast(function, ctypes.c_void_p).value or 0), int(user.value), n_in, n_out, code)

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the code, without addresses."""
        return Function.of, (self.keep, self.n_in, self.n_out)

    @cached_property
    def _called(self) -> tuple[Any, Any, Any]:
        """The code for direct calls from Python, and the types of its inputs and results."""
        return C_FUNCTION(self.address), ctypes.c_double * self.n_in, ctypes.c_double * self.n_out


class ExternalInputs(NamedTuple):
    """Parameters that an external function computes from values at the inputs, and writes to them."""

    reads: Function
    positions: NDArray[np.int64]
    """Positions of the parameters in the inputs."""
    evaluate: Callable[[Sequence[float]], NDArray[np.float64]]

    def __call__(self, inputs: NDArray[np.float64]) -> NDArray[np.float64]:
        """Fill the inputs, one row or many, in place."""
        rows = inputs.reshape(-1, inputs.shape[-1])
        for row, values in zip(rows, self.reads(rows).tolist(), strict=True):
            row[self.positions] = self.evaluate(values)
        return inputs


_ONE_THREAD = threading.RLock()


class compiled_once(cached_property[T]):  # noqa: N801 - a decorator
    """A property that is compiled on first use, by one thread only: replaced machine code would be freed while tables
    contain its address.
    """

    def __get__(self, owner: Any, kind: type[Any] | None = None) -> Any:  # type: ignore[override]
        with _ONE_THREAD:
            return super().__get__(owner, kind)


@dataclass(frozen=True)
class Lanes:
    """Code for eight cases at once: rates of states and accounts, and margins, from time, state, parameters and
    constants, which are formed from the parameters.
    """

    rates: "LaneFunction"
    margins: "LaneFunction"
    constants: "LaneFunction"
    states: "LaneFunction | None" = None
    """For implicit steps: rates of the states alone."""
    slopes: "LaneFunction | None" = None
    """For implicit steps: derivatives of these rates by the states, row-major, and last by time."""
    nonzeros: frozenset[int] = frozenset()
    """Positions of those that may be nonzero."""

    @compiled_once
    def step(self) -> "LaneFunction":
        """The code of a linearly implicit step."""
        from surfacechem.compile.rosenbrock import compile_step

        assert self.states is not None
        assert self.slopes is not None
        return compile_step(self.states, self.nonzeros)


class Chain(NamedTuple):
    """States from ``first`` to before ``end``, each coupled only to its neighbours, the first one to ``anchor``.

    The anchor is a state before all chains; -1 if there is none.
    """

    first: int
    end: int
    anchor: int


SPARSE_FROM = 400
"""Number of derivatives from which on those that are identically zero are omitted."""

MOST_OPTIMISED = 200
"""Number of expressions from which on they are not optimised: that takes ten times as long as generating their code,
and makes it at most a quarter faster.
"""

MOST_RATE_STATES = 50
"""Number of states of a network above which a second function, of its rates, costs more time than any run gains."""

MOST_LANE_STATES = 29
"""Number of states up to which implicit steps of eight cases at once take less than half the time of those of one,
which skip zeros of matrices from 30 states on.
"""


@dataclass(frozen=True)
class Program:
    """A fully implicit system G(t, y, ydot; p) = 0, linear in ydot, with its exact derivatives, ledger and margins."""

    n: int
    n_parameters: int
    n_ledger: int
    n_margins: int
    residual: Function
    jacobian: Function
    """dG/dy (row-major), then dG/dydot, of the core; then of its border and of the bands of the chains. If there are
    many, only those that may be nonzero, whose positions are in :attr:`nonzeros`.
    """
    ledger: Function | None
    """Rates of the quadratures integrated along with the state."""
    margins: Function | None
    """Functions whose zeros are events."""
    algebraic: tuple[bool, ...]
    """Per state: True if no equation contains its derivative."""
    external: ExternalInputs | None = None
    chains: tuple[Chain, ...] = ()
    nonzeros: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, np.int64))
    """Positions of the computed derivatives, in order; empty if all are computed."""
    groups: tuple[int, ...] = ()
    """Group of each quadrature, 0 to 2, whose largest value scales their errors; -1 if its error is not controlled."""
    solved: Callable[[], Function | None] = lambda: None
    """Compile the rates in explicit form; None if the equations cannot be solved for them one by one."""
    laned: Callable[[bool], Lanes | None] = lambda _: None
    """Compile the code for eight cases at once, True for implicit steps; None if that is not possible."""
    divisors: tuple[bool, ...] = ()
    """Where rates of states and accounts have no narrow features: a flag for each state, true if they divide by it."""
    margin_inputs: frozenset[int] = frozenset()
    """Positions of the inputs that margins read."""
    key: str | None = None
    """Key of its code in the cache, if it is kept there: a digest of all that determines it."""

    @cached_property
    def plain_margins(self) -> bool:
        """True if margins depend neither on derivatives nor on external parameters."""
        outside = self.external.positions.tolist() if self.external else ()
        return self.margin_inputs.isdisjoint((*range(1 + self.n, 1 + 2 * self.n), *outside))

    def filled(self, inputs: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the inputs, one row or many, with the external parameters filled in."""
        return self.external(inputs) if self.external else inputs

    @cached_property
    def tables(self) -> tuple[NDArray[Any], ...]:
        """Tables of a program for the stepper: its sizes (states, accounts, margins, inputs; in the core, chains, cells
        of chains; zeros for edges); a row (code, user data) for residual, jacobian, ledger, margins and rates, zero
        where absent; a mask of the algebraic states; a row (first, end, anchor) for each chain; the positions of the
        computed derivatives; the group of each quadrature, -1 if it is in none; the divisors.
        """
        core = self.chains[0].first if self.chains else self.n
        sizes = self.n, self.n_ledger, self.n_margins, self.n_inputs, core, len(self.chains), self.n - core, 0, 0, 0
        functions = (self.residual, self.jacobian, self.ledger, self.margins, None)
        code = [(f.address, f.user) if f else (0, 0) for f in functions]
        chains = np.array([(c.first, c.end, c.anchor) for c in self.chains], np.int64).reshape(-1, 3)
        groups = np.array(self.groups or (-1,) * self.n_ledger, np.int64)
        arrays = np.array(sizes, np.int64), np.array(code, np.int64), self.algebraic_mask, chains, self.nonzeros
        return *arrays, groups, np.array(self.divisors, np.bool_)

    @compiled_once
    def rates(self) -> Function | None:
        """The rates as functions of time, state and parameters."""
        return self.solved()

    @compiled_once
    def lanes(self) -> Lanes | None:
        """The code for eight cases at once."""
        return self.laned(False)

    @compiled_once
    def implicit_lanes(self) -> Lanes | None:
        """The code for implicit steps of eight cases at once."""
        return self.laned(True)

    def lane_tables(self, lanes: Lanes, linearly: bool) -> tuple[NDArray[Any], ...]:
        """Return the tables of a program for steps of eight cases at once: its sizes (states, accounts, margins, inputs
        with constants, integrated columns); otherwise as the other tables, with rows for the constants and for steps
        that are ``linearly`` implicit, and with the divisors for explicit steps alone.
        """
        n_inputs = self.n_inputs + lanes.constants.n_out
        sizes = self.n, self.n_ledger, self.n_margins, n_inputs, self.n + self.n_ledger
        step = lanes.step if linearly else None
        functions = lanes.states, lanes.slopes, None, lanes.margins, lanes.rates, lanes.constants, step
        code = [(f.address if f else 0, 0) for f in functions]
        own, divisors = (np.array(sizes, np.int64), np.array(code, np.int64)), () if lanes.states else self.divisors
        return *own, *self.tables[2:-1], np.array(divisors, np.bool_)

    @cached_property
    def explicit_tables(self) -> tuple[NDArray[Any], ...]:
        """The tables with the code of the rates."""
        assert self.rates is not None
        sizes, code, *others = self.tables
        code = code.copy()
        code[4] = self.rates.address, self.rates.user
        return sizes, code, *others

    def derivatives(self, inputs: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return dG/dy and dG/dydot as matrices [..., equation, variable]."""
        found = self.jacobian(inputs)
        both = np.zeros((*found.shape[:-1], self.n, 2 * self.n))
        computed, equation, variable = self._places
        both[..., equation, variable] = found[..., computed]
        return both[..., : self.n], both[..., self.n :]

    @cached_property
    def _places(self) -> NDArray[np.int64]:
        """Number among the computed derivatives, equation and variable of each."""
        every = [*_derivatives(self.n, self.chains)]
        computed = [every[k] for k in self.nonzeros.tolist()] if len(self.nonzeros) else every
        there = [(k, i, j) for k, (i, j) in enumerate(computed) if j >= 0]
        return np.array(there, np.int64).reshape(-1, 3).T

    @cached_property
    def algebraic_mask(self) -> NDArray[np.bool_]:
        return np.array(self.algebraic, dtype=bool)

    @property
    def n_inputs(self) -> int:
        return 1 + 2 * self.n + self.n_parameters


def compile_function(
    inputs: Sequence[Any], expressions: Sequence[Any], own: Collection[Any] = (), steps: bool = False
) -> Function:
    """Compile a vector of expressions; inputs that no expression contains are allowed.

    Functions for ``steps``, with thousands of calls, are optimised. Others have few calls, and optimising takes twice
    as long as generating the code. Expressions that differ only in their ``own`` inputs, as those of cells, are
    compiled as loops over one of them.
    """
    if not own:
        return _machine_code(tuple(inputs), tuple(expressions), steps)
    from surfacechem.compile.alike import loops_of

    return _looped(inputs, *loops_of(inputs, expressions, own))


def _looped(inputs: Sequence[Any], loops: Sequence["FormLoop"], rest: Sequence[Any]) -> Function:
    """Return the code of loops and of the expressions that are in none."""
    from surfacechem.compile.alike import LoopCode

    left = tuple(expression for expression in rest if expression != 0)
    code = LoopCode.of(inputs, loops, rest, _machine_code(tuple(inputs), left) if left else None)
    return Function.of(code, len(inputs), len(rest))


@dataclass(frozen=True)
class _Derivatives:
    """Entries of a Jacobian without chains, differentiated on demand: the expressions are enough to load its code."""

    residual: tuple[Any, ...]
    variables: tuple[Any, ...]
    """The states, then their rates."""
    named: tuple[tuple[Any, Any], ...]
    wanted: tuple[tuple[int, int], ...]
    """Equation and variable of each derivative."""

    def __len__(self) -> int:
        return len(self.wanted)

    def __iter__(self) -> Iterator[Any]:
        return iter(_entries(self.residual, self.variables, self.named, self.wanted))

    def origins(self) -> list[str]:
        """Return everything that determines the entries, as text."""
        names = [part for pair in self.named for part in pair]
        differentiation = map(source_digest, (__file__, calculus.__file__))
        return [*differentiation, *serialised((*self.variables, *names, *self.residual))]


@lru_cache(maxsize=128)  # a scene that is reloaded, or differs in numbers only, has the same expressions
@PREPARATION
def _machine_code(
    inputs: tuple[Any, ...], expressions: tuple[Any, ...] | _Derivatives, steps: bool = False
) -> Function:
    opt_level = 3 if steps and len(expressions) < MOST_OPTIMISED else 0

    def make() -> Any:
        return symengine.Lambdify(list(inputs), list(expressions), backend="llvm", cse=True, opt_level=opt_level)

    # Loading code takes a tenth of the time of generating it.
    origins = expressions.origins() if isinstance(expressions, _Derivatives) else serialised(expressions)
    code = from_file(code_file([str(opt_level), _digest(inputs), *origins]), make, pickle.loads, pickle.dumps)
    return Function.of(code, len(inputs), len(expressions))


@dataclass(frozen=True)
class _Compilation:
    """A compilation, which equals another one of the same digest of everything that determines its result."""

    digest: str
    make: Callable[[], Any] = field(compare=False)


def key_of(expressions: Iterable[Any], *others: Any) -> str:
    """Return the key of what is compiled from expressions and ``others``, plain values: a digest of these, of this
    package's code, and of the expressions, exact to the last bit.

    So nothing has to be expanded or differentiated on the way to code that is there.
    """
    # Not their hashes: SymEngine's are equal for numbers such as 0.1 and 0.2.
    return hashlib.sha256(repr((others, _source_digests(), serialised(expressions))).encode()).hexdigest()


@lru_cache(maxsize=1)
def _source_digests() -> list[str]:
    """Return the digests of this package's files."""
    return [source_digest(str(path)) for path in sorted(PACKAGE.rglob("*.py"))]


def kept(make: Callable[[], T], key: str | None) -> T:
    """Return what is compiled under a key, read from the cache if it has been before, in any process."""
    if key is None:
        return make()
    found: T = _compiled(_Compilation(key, make))
    return found


@lru_cache(maxsize=128)
@PREPARATION
def _compiled(compilation: _Compilation) -> Any:
    return from_file(code_file([compilation.digest]), compilation.make, pickle.loads, pickle.dumps)


@lru_cache(maxsize=8)
def _digest(inputs: tuple[Any, ...]) -> str:
    """Return a digest of the inputs, which all functions of a scene share."""
    return hashlib.sha256("\n".join(serialised(inputs)).encode()).hexdigest()


def serialised(expressions: Iterable[Any]) -> list[str]:
    """Return expressions as text, exact to the last bit and in their order.

    Each part occurs once, with the positions of its arguments; last are the positions of the expressions themselves.

    >>> x, y = symengine.symbols("x y")
    >>> serialised([x + 0.1, y])
    ['0x1.999999999999ap-4', 'Symbol x', 'Add [0, 1]', 'Symbol y', '[2, 3]']
    """
    places: dict[Any, int] = {}
    parts: list[str] = []

    def places_of(whole: Iterable[Any]) -> list[int]:
        """Return the positions of expressions, of which the missing ones are written."""
        own: list[int] = []
        left: list[tuple[Any, Iterator[Any], list[int]]] = [(None, iter(whole), own)]
        while left:
            part, args, found = left[-1]
            for arg in args:
                if (place := places.get(arg)) is None:
                    left.append((arg, iter(arg.args), []))
                    break
                found.append(place)
            else:
                left.pop()
                if left:
                    left[-1][2].append(places.setdefault(part, len(parts)))
                    kind = type(part).__name__
                    parts.append(float(part).hex() if kind == "RealDouble" else f"{kind} {found or part}")
        return own

    wanted = places_of(map(symengine.sympify, expressions))
    return [*parts, str(wanted)]


Named = Sequence[tuple[Any, Any]]
"""Symbols with their expressions, which may contain the symbols before them."""


def expanded(named: Named, expressions: Sequence[Any]) -> list[Any]:
    """Return expressions with named symbols replaced; equal symbols are replaced by the same object."""
    known: dict[Any, Any] = {}

    def replaced(expression: Any) -> Any:
        whole = symengine.sympify(expression)
        parts = {symbol: known[symbol] for symbol in whole.free_symbols if symbol in known}
        return whole.xreplace(parts) if parts else whole

    for symbol, expression in needed(named, expressions):
        known[symbol] = replaced(expression)
    return [replaced(expression) for expression in expressions]


def jacobian(
    residual: Sequence[Any], variables: Sequence[Any], named: Named = ()
) -> tuple[list[dict[Any, Any]], list[tuple[Any, Any]]]:
    """Return the nonzero derivatives, a mapping by variable for each equation, and the named symbols that they contain.

    Each named expression is differentiated once, by the symbols in it, and its derivatives are named too, so the work
    is proportional to the number of nonzeros, however often a name is used.

    >>> x, y, r = symengine.symbols("x y r")
    >>> (row,), names = jacobian([r + x], [x, y], [(r, x**2 * y)])
    >>> expanded(names, [row[x], row[y]])
    [1 + 2*x*y, x**2]
    """
    slopes: dict[Any, dict[Any, Any]] = {x: {x: symengine.Integer(1)} for x in variables}
    names: list[tuple[Any, Any]] = []

    def total(expression: Any) -> dict[Any, Any]:
        terms: dict[Any, list[Any]] = {}
        for symbol, by_symbol in gradient(expression).items():
            for x, slope in slopes.get(symbol, {}).items():
                terms.setdefault(x, []).append(by_symbol * slope)
        return {x: symengine.Add(*items) for x, items in terms.items()}

    for symbol, expression in named:
        names.append((symbol, expression))
        slopes[symbol] = {}
        for x, slope in total(expression).items():
            slopes[symbol][x] = symengine.Symbol(f"d {symbol} by {x}")
            names.append((slopes[symbol][x], slope))
    return [total(row) for row in residual], names


def _depends(residual: Sequence[Any], variables: Sequence[Any], named: Named) -> list[set[int]]:
    """Return the variables that each equation contains, directly or in named expressions.

    >>> x, y, z, r = symengine.symbols("x y z r")
    >>> _depends([z + r, y], [x, y, z], [(r, x + 1)])
    [{0, 2}, {1}]
    """
    known = {x: {j} for j, x in enumerate(variables)}

    def read(expression: Any) -> set[int]:
        symbols = symengine.sympify(expression).free_symbols
        return set().union(*(known[symbol] for symbol in symbols if symbol in known))

    for symbol, expression in named:
        known[symbol] = read(expression)
    return [read(row) for row in residual]


def _derivatives(n: int, chains: Sequence[Chain]) -> Iterator[tuple[int, int]]:
    """Yield equation and variable of all derivatives in order, by states and then by rates: of the core, of its border,
    along the chains; the variable is -1 where there is none.
    """
    core = chains[0].first if chains else n
    linked, border = list(_linked(core, chains)), core * len(chains)
    for part in ([(i, j) for i in range(core) for j in range(core)], linked[:border], linked[border:]):
        for over in (0, n):
            yield from ((i, over + j if j >= 0 else j) for i, j in part)


def _entries(
    residual: Sequence[Any], variables: Sequence[Any], named: Named, wanted: Iterable[tuple[int, int]]
) -> list[Any]:
    """Return derivatives of equations by variables."""
    slopes, names = jacobian(residual, variables, named)
    zero = symengine.Integer(0)
    return expanded(names, [slopes[i].get(variables[j], zero) for i, j in wanted])


@dataclass(frozen=True)
class Equations:
    """The expressions of a program, which may contain ``named`` symbols, and the code that is compiled from them."""

    inputs: Sequence[Any]
    n: int
    residual: Sequence[Any]
    ledger: Sequence[Any]
    margins: Sequence[Any]
    chains: Sequence[Chain]
    named: Named

    @property
    def variables(self) -> Sequence[Any]:
        """The states, then their rates."""
        return self.inputs[1 : 1 + 2 * self.n]

    @property
    def core(self) -> int:
        """Number of states before all chains."""
        return self.chains[0].first if self.chains else self.n

    @cached_property
    def rates(self) -> list[Any] | None:
        """The rates in explicit form; None if there are chains, or if the equations cannot be solved for the rates."""
        derivatives = self.variables[self.n :]
        return None if self.chains else solved_rates(expanded(self.named, self.residual), derivatives)

    def parts(self) -> dict[str, Any]:
        """Return the parts of a program that follow from its expressions."""
        n, core, inputs = self.n, self.core, self.inputs
        # Inputs that belong to one cell: its state and rate.
        own = {*inputs[1 + core : 1 + n], *inputs[1 + n + core : 1 + 2 * n]}
        whole, ledger, margins = (expanded(self.named, rows) for rows in (self.residual, self.ledger, self.margins))
        equations, slopes, nonzeros = self._chained(whole, own) if self.chains else self._plain(whole)
        known = {symbol for row in whole[:core] for symbol in row.free_symbols}
        read = {symbol for margin in margins for symbol in margin.free_symbols}
        return {
            "divisors": self._divisors(ledger),
            "residual": equations,
            "jacobian": slopes,
            "ledger": compile_function(inputs, ledger, own, steps=True) if ledger else None,
            "margins": compile_function(inputs, margins, own, steps=True) if margins else None,
            "algebraic": tuple(rate not in known for rate in self.variables[n : n + core]) + (False,) * (n - core),
            "nonzeros": nonzeros,
            "margin_inputs": frozenset(j for j, symbol in enumerate(inputs) if symbol in read),
        }

    def _plain(self, whole: Sequence[Any]) -> tuple[Function, Function, NDArray[np.int64]]:
        """Return the code of equations without chains and of their Jacobian, and the positions of the computed
        derivatives if these are not all.
        """
        named = needed(self.named, self.residual)
        wanted, places = tuple(_derivatives(self.n, ())), np.empty(0, np.int64)
        if len(wanted) >= SPARSE_FROM:
            wanted, places = self._nonzeros(named)
        parts = _Derivatives(tuple(self.residual), tuple(self.variables), tuple(named), wanted)
        slopes = _machine_code(tuple(self.inputs), parts, steps=True)
        return compile_function(self.inputs, whole, steps=True), slopes, places

    def _chained(self, whole: list[Any], own: set[Any]) -> tuple[Function, Function, NDArray[np.int64]]:
        """Return the code of equations with chains and of their Jacobian, and the positions of its derivatives.

        Each form of the chains' equations is differentiated once.
        """
        from surfacechem.compile.alike import loops_of

        core, inputs, named = self.core, self.inputs, needed(self.named, self.residual)
        others = [symengine.Integer(0)] * core
        loops, rest = loops_of(inputs, others + whole[core:], own)
        wanted, nonzeros = self._nonzeros(named)
        places = {(i, 1 + j): place for place, (i, j) in enumerate(wanted)}
        known = {symbol: place for place, symbol in enumerate(inputs)}
        left = _entries([*self.residual[:core], *rest[core:]], self.variables, named, wanted)
        slopes = _looped(inputs, [loop.slopes(known, places) for loop in loops], left)
        return _looped(inputs, loops, [*whole[:core], *rest[core:]]), slopes, nonzeros

    def _nonzeros(self, named: Named) -> tuple[tuple[tuple[int, int], ...], NDArray[np.int64]]:
        """Return equation and variable of the derivatives that may be nonzero, and their positions."""
        depends = _depends(self.residual, self.variables, named)
        every = {k: (i, j) for k, (i, j) in enumerate(_derivatives(self.n, self.chains)) if j in depends[i]}
        return tuple(every.values()), np.array([*every], np.int64)

    def _divisors(self, ledger: Sequence[Any]) -> tuple[bool, ...]:
        """Return the flags of :attr:`Program.divisors`; none where no explicit steps are taken: in large networks, and
        if the equations do not give their rates.
        """
        from surfacechem.compile.vectors import divisors

        if not (rates := self.rates if self.n <= MOST_RATE_STATES else None):
            return ()
        accounts = expanded(list(zip(self.variables[self.n :], rates, strict=True)), ledger)
        return divisors([*rates, *accounts], self.inputs[0], self.variables[: self.n])

    @PREPARATION
    def rate_code(self) -> Function | None:
        """Return the code of the rates; None if the equations do not give them."""
        return compile_function(self.inputs, self.rates, steps=True) if self.rates else None

    def lane_code(self, implicit: bool) -> Lanes | None:
        """Return the code for eight cases at once; None if the equations do not give their rates, or are too many for
        implicit steps.
        """
        from surfacechem.compile.vectors import compile_lanes, constants_apart

        inputs, rates, n = self.inputs, self.rates, self.n
        if not rates or (implicit and n > MOST_LANE_STATES):
            return None
        known = list(zip(self.variables[n:], rates, strict=True))
        ledger, margins = (expanded(known, expanded(self.named, rows)) for rows in (self.ledger, self.margins))
        slopes = []
        if implicit:  # derivatives of rates by states, row-major, and last by time
            rows, zero = jacobian(rates, inputs[: 1 + n])[0], symengine.Integer(0)
            slopes = [row.get(x, zero) for some in (inputs[1 : 1 + n], inputs[:1]) for row in rows for x in some]
        constants, formed = constants_apart([*rates, *ledger, *margins, *slopes], inputs[1 + 2 * n :])
        columns, end, given = n + len(ledger), len(formed) - len(slopes), [*inputs, *constants]
        parts = {"rates": formed[:columns], "margins": formed[columns:end]}
        parts |= {"states": formed[:n], "slopes": formed[end:]} if implicit else {}
        try:
            return Lanes(
                constants=compile_lanes(inputs, list(constants.values())),
                nonzeros=frozenset(place for place, slope in enumerate(slopes) if slope != 0),
                **{name: compile_lanes(given, part) for name, part in parts.items()},
            )
        except NotImplementedError:  # a function without vector code
            return None


def compile_program(
    t: Any,
    states: Sequence[Any],
    derivatives: Sequence[Any],
    parameters: Sequence[Any],
    residual: Sequence[Any],
    ledger: Sequence[Any] = (),
    margins: Sequence[Any] = (),
    chains: Sequence[Chain] = (),
    named: Named = (),
    keeps: bool = False,
) -> Program:
    """Compile a system, with Jacobians differentiated from its residual; expressions may contain ``named`` symbols.

    States and equations of chains come after the others, chain by chain. The code is in the cache afterwards if the
    program ``keeps`` it.
    """
    if not len(states) == len(derivatives) == len(residual):
        counts = f"{len(states)} states, {len(derivatives)} derivatives and {len(residual)} equations"
        raise ValueError(f"{counts}: a system needs as many equations as states, and one derivative a state.")
    inputs = [t, *states, *derivatives, *parameters]
    equations = Equations(inputs, len(states), residual, ledger, margins, chains, named)
    every = *inputs, *residual, *ledger, *margins, *(part for pair in named for part in pair)
    # Where each kind of expressions ends in the list of all of them.
    lengths = len(inputs), len(states), len(ledger), len(margins)
    key = key_of(every, lengths, tuple(chains)) if keeps else None
    return Program(
        n=len(states),
        n_parameters=len(parameters),
        n_ledger=len(ledger),
        n_margins=len(margins),
        chains=tuple(chains),
        solved=equations.rate_code,
        laned=equations.lane_code,
        key=key,
        **kept(equations.parts, key),
    )


def solved_rates(residual: Sequence[Any], rates: Sequence[Any]) -> list[Any] | None:
    """Return the rates from equations that can be solved for them one by one; else None.

    >>> a, b, x = symengine.symbols("a b x")
    >>> solved_rates([2 * b + a - 3 * x, a - x], [a, b])
    [x, x]
    """
    left = dict.fromkeys(rates)
    rows, named = list(residual), []
    while rows:
        unknown = [[rate for rate in left if rate in row.free_symbols] for row in rows]
        found = next((i for i, those in enumerate(unknown) if len(those) == 1), None)
        if found is None:
            return None
        rate, row = unknown[found][0], rows.pop(found)
        named.append((rate, -row.xreplace({rate: 0}) / derivative(row, rate)))
        del left[rate]
    return expanded(named, rates)


def needed(named: Named, expressions: Sequence[Any]) -> Named:
    """Return the named symbols that the expressions contain, directly or through others.

    >>> a, b, c, x = symengine.symbols("a b c x")
    >>> needed([(a, 2 * x), (b, a**2), (c, b)], [b])
    [(a, 2*x), (b, a**2)]
    """
    read = {symbol for expression in expressions for symbol in symengine.sympify(expression).free_symbols}
    found = []
    for symbol, expression in reversed(named):
        if symbol in read:
            read |= symengine.sympify(expression).free_symbols
            found.append((symbol, expression))
    return found[::-1]


def _linked(core: int, chains: Sequence[Chain]) -> Iterator[tuple[int, int]]:
    """Yield equation and variable of each derivative outside the core, in the order of the compiled function.

    First the derivatives of the core's equations by the first variable of each chain, then those of each equation of a
    chain by the inner neighbour, its own variable and the outer neighbour; -1 where there is none.
    """
    yield from ((i, chain.first) for i in range(core) for chain in chains)
    for chain in chains:
        for i in range(chain.first, chain.end):
            yield i, chain.anchor if i == chain.first else i - 1
            yield i, i
            yield i, i + 1 if i + 1 < chain.end else -1
