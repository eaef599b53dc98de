"""LU decomposition of small dense real or complex matrices, with scaled partial pivoting.

Rows may differ by forty decades (a capacity of 1e-15 beside a conductance of 1e20). A row is therefore judged by its
largest entry, in units of the columns' typical sizes; the entries themselves are not scaled, so that a row which is a
sum stays exact.
"""

from typing import Any

import numpy as np

from surfacechem.solve.radau.work import compiled


@compiled
def size_of(value: Any) -> float:
    """Size of a real or complex number without a root."""
    return float(abs(value.real) + abs(value.imag))


@compiled
def _row_scales(a: Any, columns: Any, rows: Any) -> bool:
    n = a.shape[0]
    for i in range(n):
        largest = 0.0
        for j in range(n):
            largest = max(largest, size_of(a[i, j]) * columns[j])
        if not 0.0 < largest < np.inf:
            return False
        rows[i] = 1.0 / largest
    return True


@compiled
def _swap(a: Any, rows: Any, k: int, p: int) -> None:
    for j in range(a.shape[0]):
        a[k, j], a[p, j] = a[p, j], a[k, j]
    rows[k], rows[p] = rows[p], rows[k]


@compiled
def _pivot(a: Any, rows: Any, k: int) -> int:
    p, best = k, -1.0
    for i in range(k, a.shape[0]):
        size = size_of(a[i, k]) * rows[i]
        if size > best:
            p, best = i, size
    return p


@compiled
def factor(a: Any, order: Any, columns: Any, rows: Any, threshold: float) -> bool:
    """Replace a by its factors, the inverse pivots on the diagonal; False if a scaled pivot is not above the
    threshold.
    """
    n = a.shape[0]
    if not _row_scales(a, columns, rows):
        return False
    for k in range(n):
        p = _pivot(a, rows, k)
        if not size_of(a[p, k]) * rows[p] * columns[k] > threshold:
            return False
        order[k] = p
        if p != k:
            _swap(a, rows, k, p)
        inverse = 1.0 / a[k, k]
        a[k, k] = inverse
        for i in range(k + 1, n):
            factor = a[i, k] * inverse
            a[i, k] = factor
            for j in range(k + 1, n):
                a[i, j] -= factor * a[k, j]
    return True


@compiled
def solve(a: Any, order: Any, x: Any) -> None:
    """Overwrite the right-hand side by the solution; entries of x beyond the matrix are left alone."""
    n = a.shape[0]
    # Sums in a local name: in x each term would wait until the one before it is stored.
    for k in range(n):
        p = order[k]
        total = x[p]
        x[p] = x[k]
        for j in range(k):
            total -= a[k, j] * x[j]
        x[k] = total
    for k in range(n - 1, -1, -1):
        total = x[k]
        for j in range(k + 1, n):
            total -= a[k, j] * x[j]
        x[k] = total * a[k, k]
