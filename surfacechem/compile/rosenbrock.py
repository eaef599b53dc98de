"""One linearly implicit step of eight cases at once, as straight-line machine code for one system of equations.

The method is Rodas5P: eight stages, order 5 also on stiff problems, L-stable, with an embedded solution of order 4 and
dense output of order 4. The matrix 1/(gamma h) - J is factored once a step: by its nonzeros alone, in an order that
keeps them few, and without exchanges of rows. Where that loses digits the step is marked as doubtful.

Source: Steinebach (2023), BIT Numerical Mathematics 63, article 27, doi 10.1007/s10543-023-00967-x; in the transformed
variables of Hairer & Wanner, Solving Ordinary Differential Equations II, section IV.7.
"""

import json
from collections.abc import Collection, Iterable
from pathlib import Path
from typing import Any

import numpy as np
from llvmlite import ir

from surfacechem.compile import PREPARATION
from surfacechem.compile.objectcode import engine
from surfacechem.compile.vectors import LaneFunction, by_vector, entry, function_body, number, object_code
from surfacechem.tolerances import EPS, LINEAR_RTOL

_GIVEN = json.loads(Path(__file__).with_suffix(".json").read_text(encoding="utf-8"))
GAMMA, NODES, CHANGES, _COUPLINGS, _TIME_PARTS, _DENSE = (
    _GIVEN[name] for name in ("gamma", "nodes", "changes", "couplings", "time_parts", "dense")
)
"""By stage: its time in the step; the change of the state there, what adds to the rate per unit of the step, both by
the increments of the earlier stages; what the derivative of the rates by time adds, by the step. Last, by all
increments, the factors of x (1 - x), x^2 (1 - x) and x^3 (1 - x) in what the state at a fraction x of the step differs
from the line between its ends.
"""
STAGES = len(NODES)
DENSE = np.array(_DENSE)
MOST_NONZEROS = 2**8
"""Number of nonzero derivatives, as of 16 states that all depend on each other, up to which the code of a step is made
in about a second; it grows with the products of an elimination.
"""
MOST_LOST = 0.1 * LINEAR_RTOL / EPS
"""Factor by which terms may exceed what is left of them: their roundoff is then a tenth of the tolerance."""

_FUNCTION = ir.FunctionType(ir.VoidType(), [ir.IntType(8).as_pointer()] * 3)


@PREPARATION
def compile_step(states: LaneFunction, nonzeros: Collection[int]) -> LaneFunction:
    """Compile a step from the code of the rates.

    ``nonzeros`` are the positions of those derivatives of the rates, by n states and last by time, that may be nonzero.
    Inputs are those of the rates, with the step [s] in row 1 + n. Results are, in rows of n vectors, the rates at the
    start (given), the increments of the stages (the last one is the error), the rates and states at the end, the
    derivatives at the start (given), and what the rates at the end are open by; then a flag of a doubtful step, and the
    weights of the states (given).
    """
    step = _Step(states, nonzeros)
    step.generate()
    held = engine(object_code(step.builder))
    return LaneFunction(int(held.get_function_address("f")), step.weights, (held, states))


class _Step:
    """The code of a step."""

    def __init__(self, states: LaneFunction, nonzeros: Collection[int]) -> None:
        self.states, self.nonzeros, self.n = states, nonzeros, states.n_out
        self.builder = function_body()
        self.out, self.inputs, self.user = self.builder.function.args
        *self.start, self.h = self._load(self.inputs, 0, 2 + self.n)
        self.end = (1 + STAGES) * self.n
        self.derivatives = self.end + 2 * self.n
        self.weights = self.derivatives + (self.n + 2) * self.n + 1
        self.units = self._load(self.out, self.weights, self.n)
        self.terms: list[Any] = []
        """Sizes of the terms that each pivot is the sum of."""
        self.order: list[int] = []
        """States in the order of their elimination."""
        self.factors: dict[tuple[int, int], Any] = {}
        """Factors of the matrix by position, with inverses of the pivots."""

    # -- vectors ----------------------------------------------------------------------------------------------------

    def _load(self, base: Any, row: int, count: int) -> list[Any]:
        return [self.builder.load(entry(self.builder, base, row + m), align=8) for m in range(count)]

    def _store(self, base: Any, row: int, values: Iterable[Any]) -> None:
        for m, value in enumerate(values):
            self.builder.store(value, entry(self.builder, base, row + m), align=8)

    def _sum(self, total: Any, factors: Iterable[float], values: Iterable[Any]) -> Any:
        for factor, value in zip(factors, values, strict=False):
            total = by_vector(self.builder, "fmuladd", number(factor), value, total)
        return total

    def _size(self, value: Any) -> Any:
        return by_vector(self.builder, "fabs", value)

    def _keep_largest(self, rows: list[Any], i: int, j: int, value: Any) -> None:
        """Keep the largest entry of row i, in units of the weights, when that of column j is added."""
        size = self.builder.fmul(self._size(value), self.units[j])
        rows[i] = self.builder.select(self.builder.fcmp_ordered(">", size, rows[i]), size, rows[i])

    def _exceeds(self, size: Any, rest: Any) -> Any:
        """Mask of lanes where a size exceeds what is left by too much, or is not a number."""
        return self.builder.fcmp_unordered(">", size, self.builder.fmul(number(MOST_LOST), self._size(rest)))

    # -- the step ---------------------------------------------------------------------------------------------------

    def generate(self) -> None:
        """Generate the code."""
        b, n = self.builder, self.n
        slopes = self._load(self.out, self.derivatives, n * n + n)
        inverse = b.fdiv(number(1.0), self.h)
        self._factor(b.fmul(inverse, number(1.0 / GAMMA)), slopes)
        increments: list[list[Any]] = []
        for stage in range(STAGES):
            rates = self._load(self.out, 0, n) if stage == 0 else self._rates(NODES[stage], CHANGES[stage], increments)
            before = list(rates)
            for m in range(n):
                earlier = [each[m] for each in increments]
                coupled = self._sum(number(0.0), _COUPLINGS[stage], earlier)
                rates[m] = by_vector(b, "fmuladd", coupled, inverse, rates[m])
                if n * n + m in self.nonzeros and _TIME_PARTS[stage]:
                    part = b.fmul(number(_TIME_PARTS[stage]), self.h)
                    rates[m] = by_vector(b, "fmuladd", part, slopes[n * n + m], rates[m])
            open_by = list(rates)
            self._solve(rates)
            increments.append(rates)
            self._store(self.out, (1 + stage) * n, rates)
        after = self._rates(1.0, [*CHANGES[-1], 1.0], increments)
        self._store(self.out, self.end + n, self._load(self.inputs, 1, n))
        # What the rates at the end are open by after the last increments, which were to close what they were open by
        # before: nothing where the equations are linear.
        per_unit, changes = b.fmul(inverse, number(1.0 / GAMMA)), map(b.fsub, after, before)
        closed = [b.fsub(b.fmul(part, per_unit), change) for part, change in zip(increments[-1], changes, strict=True)]
        self._store(self.out, self.weights - 1 - n, map(b.fsub, open_by, closed))
        b.ret_void()

    def _rates(self, node: float, factors: list[float], increments: list[list[Any]]) -> list[Any]:
        """Evaluate the rates at a fraction of the step, where these factors of the increments are the change."""
        t, *y = self.start
        there = [self._sum(y[m], factors, [each[m] for each in increments]) for m in range(self.n)]
        self._store(self.inputs, 0, [self._sum(t, [node], [self.h]), *there])
        code = self.builder.inttoptr(ir.IntType(64)(self.states.address), _FUNCTION.as_pointer())
        results = self.builder.bitcast(entry(self.builder, self.out, self.end), self.out.type)
        self.builder.call(code, [results, self.inputs, self.user])
        return self._load(self.out, self.end, self.n)

    # -- the matrix -------------------------------------------------------------------------------------------------

    def _factor(self, diagonal: Any, slopes: list[Any]) -> None:
        """Factor the matrix, and store whether digits were lost.

        They are if a pivot is small compared with the terms that it is the sum of, or if a term of an entry is large
        compared with the row, in units of the weights: the errors of a row are then those of another row.
        """
        b, w, n, every = self.builder, self.factors, self.n, range(self.n)
        w |= {divmod(p, n): b.fneg(slopes[p]) for p in range(n * n) if p in self.nonzeros or p % (n + 1) == 0}
        self.terms = [b.fadd(diagonal, self._size(w[k, k])) for k in every]
        w |= {(k, k): b.fadd(diagonal, w[k, k]) for k in every}
        rows, grown, left = [number(0.0)] * n, [number(0.0)] * n, [*every]
        for (i, j), value in w.items():
            self._keep_largest(rows, i, j, value)
        doubtful = b.fcmp_unordered("uno", diagonal, diagonal)
        while left:
            k = min(left, key=lambda k: sum((i, k) in w for i in left) * sum((k, j) in w for j in left))
            left.remove(k)
            doubtful = b.or_(doubtful, self._exceeds(self.terms[k], w[k, k]))
            self._eliminate(k, left, grown)
        for size, row in zip(grown, rows, strict=True):
            doubtful = b.or_(doubtful, self._exceeds(size, row))
        self._store(self.out, self.weights - 1, [b.select(doubtful, number(1.0), number(0.0))])

    def _eliminate(self, k: int, left: list[int], grown: list[Any]) -> None:
        """Eliminate state k from the rows that are left; keep the largest terms of each row."""
        b, w = self.builder, self.factors
        self.order.append(k)
        w[k, k] = b.fdiv(number(1.0), w[k, k])
        columns = [j for j in left if (k, j) in w]
        for i in [i for i in left if (i, k) in w]:
            w[i, k] = b.fneg(b.fmul(w[i, k], w[k, k]))
            for j in columns:
                term = b.fmul(w[i, k], w[k, j])
                w[i, j] = b.fadd(w[i, j], term) if (i, j) in w else term
                self._keep_largest(grown, i, j, term)
                if i == j:
                    self.terms[i] = b.fadd(self.terms[i], self._size(term))

    def _solve(self, x: list[Any]) -> None:
        """Overwrite a right-hand side by the solution."""
        b, w, n = self.builder, self.factors, self.n
        for place, k in enumerate(self.order):
            for i in (i for i in self.order[place + 1 :] if (i, k) in w):
                x[i] = by_vector(b, "fmuladd", w[i, k], x[k], x[i])
        for place in range(n - 1, -1, -1):
            k = self.order[place]
            for j in (j for j in self.order[place + 1 :] if (k, j) in w):
                x[k] = b.fsub(x[k], b.fmul(w[k, j], x[j]))
            x[k] = b.fmul(x[k], w[k, k])
