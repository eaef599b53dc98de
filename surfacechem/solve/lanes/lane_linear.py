"""The linear systems of an implicit step of eight runs at once: LU factors of the Newton matrices a/h - J of each run.

All is in units of the weights of the error norm, so that rows and columns have like sizes. Rows are exchanged in each
lane by itself where its pivot is small.

Source: Golub & Van Loan, Matrix Computations, section 3.4; the threshold as in the stepper for single runs.
"""

from typing import Any

from surfacechem.solve.lanes.vector import absolute, any_lane, lanes, put, where
from surfacechem.solve.radau.linear import PIVOT_PART
from surfacechem.solve.radau.work import JACOBIAN, compiled, evaluate


@compiled
def differentiate(w: Any) -> None:
    """Evaluate the derivatives of the rates at the inputs, in units of the weights."""
    evaluate(w, JACOBIAN, w.jacobian)
    for i in range(w.n):
        unit = 1.0 / lanes(w.weight[i])
        for j in range(w.n):
            put(w.jacobian[i, j], lanes(w.jacobian[i, j]) * (lanes(w.weight[j]) * unit))


@compiled
def _exchange(re: Any, im: Any, flags: Any, k: int) -> None:
    """Move a large entry of column k to the pivot, in each lane by itself."""
    for i in range(k + 1, re.shape[0]):
        pivot = absolute(lanes(re[k, k])) + absolute(lanes(im[k, k]))
        moves = PIVOT_PART * (absolute(lanes(re[i, k])) + absolute(lanes(im[i, k]))) > pivot
        put(flags[k, i], where(moves, 1.0, 0.0))
        if any_lane(moves):
            for j in range(k, re.shape[0]):
                for part in (re, im):
                    upper, lower = lanes(part[k, j]), lanes(part[i, j])
                    put(part[k, j], where(moves, lower, upper))
                    put(part[i, j], where(moves, upper, lower))


@compiled
def factor(w: Any, s: int, real: Any, imaginary: Any) -> None:
    """Factor matrix s, J subtracted from a complex number on the diagonal; pivots are replaced by their inverses.

    Where a matrix is singular the factors, and all that is found with them, are not finite.
    """
    n, re, im = w.n, w.matrix[s, 0], w.matrix[s, 1]
    for i in range(n):
        for j in range(n):
            put(re[i, j], 0.0 - lanes(w.jacobian[i, j]))
            put(im[i, j], 0.0)
        put(re[i, i], real - lanes(w.jacobian[i, i]))
        put(im[i, i], imaginary)
    for k in range(n):
        _exchange(re, im, w.exchanged[s], k)
        a, b = lanes(re[k, k]), lanes(im[k, k])
        size = a * a + b * b
        a, b = a / size, (0.0 - b) / size
        put(re[k, k], a)
        put(im[k, k], b)
        for i in range(k + 1, n):
            c, d = lanes(re[i, k]), lanes(im[i, k])
            p, q = a * c - b * d, a * d + b * c
            put(re[i, k], p)
            put(im[i, k], q)
            for j in range(k + 1, n):
                c, d = lanes(re[k, j]), lanes(im[k, j])
                put(re[i, j], lanes(re[i, j]) - (p * c - q * d))
                put(im[i, j], lanes(im[i, j]) - (p * d + q * c))


@compiled
def solve(w: Any, s: int, x: Any, y: Any) -> None:
    """Overwrite a right-hand side, with real part x and imaginary part y, by the solution with matrix s."""
    n, re, im = w.n, w.matrix[s, 0], w.matrix[s, 1]
    for i in range(n):
        unit = 1.0 / lanes(w.weight[i])
        put(x[i], lanes(x[i]) * unit)
        put(y[i], lanes(y[i]) * unit)
    for k in range(n):
        for i in range(k + 1, n):
            moves = lanes(w.exchanged[s, k, i]) > 0.5
            if any_lane(moves):
                for part in (x, y):
                    upper, lower = lanes(part[k]), lanes(part[i])
                    put(part[k], where(moves, lower, upper))
                    put(part[i], where(moves, upper, lower))
        a, b = lanes(x[k]), lanes(y[k])
        for i in range(k + 1, n):
            c, d = lanes(re[i, k]), lanes(im[i, k])
            put(x[i], lanes(x[i]) - (a * c - b * d))
            put(y[i], lanes(y[i]) - (a * d + b * c))
    for k in range(n - 1, -1, -1):
        a, b = lanes(x[k]), lanes(y[k])
        for j in range(k + 1, n):
            c, d, p, q = lanes(re[k, j]), lanes(im[k, j]), lanes(x[j]), lanes(y[j])
            a, b = a - (c * p - d * q), b - (c * q + d * p)
        c, d = lanes(re[k, k]), lanes(im[k, k])
        put(x[k], a * c - b * d)
        put(y[k], a * d + b * c)
    for i in range(n):
        put(x[i], lanes(x[i]) * lanes(w.weight[i]))
        put(y[i], lanes(y[i]) * lanes(w.weight[i]))


@compiled
def solve_of(w: Any, lane: int, x: Any) -> None:
    """Overwrite eight right-hand sides by the solutions with the real matrix, the first one, of one lane."""
    n, a = w.n, w.matrix[0, 0]
    for i in range(n):
        put(x[i], lanes(x[i]) * (1.0 / w.weight[i, lane]))
    for k in range(n):
        for i in range(k + 1, n):
            if w.exchanged[0, k, i, lane] > 0.5:
                upper, lower = lanes(x[k]), lanes(x[i])
                put(x[k], lower)
                put(x[i], upper)
        for i in range(k + 1, n):
            put(x[i], lanes(x[i]) - a[i, k, lane] * lanes(x[k]))
    for k in range(n - 1, -1, -1):
        total = lanes(x[k])
        for j in range(k + 1, n):
            total = total - a[k, j, lane] * lanes(x[j])
        put(x[k], total * a[k, k, lane])
    for i in range(n):
        put(x[i], lanes(x[i]) * w.weight[i, lane])
