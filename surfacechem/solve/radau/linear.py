"""LU decomposition of small dense real or complex matrices, with scaled partial pivoting.

Rows may differ by forty decades (a capacity of 1e-15 beside a conductance of 1e20). A row is therefore judged by its
largest entry, in units of the columns' typical sizes; the entries themselves are not scaled, so that a row which is a
sum stays exact.

Where the last variables form chains, such as the temperatures across a body, the state is [core | chain | chain ...].
In a chain, numbered from the core outwards, each equation reads its own variable and its two neighbours; the first
one's inner neighbour is one variable of the core, the anchor. The core reads the first variable of each chain. A chain
is eliminated from its far end, which leaves a correction of one column of the core, at a cost proportional to its
length. Nothing is exchanged within a chain: where heat is conducted between capacities its matrix is diagonally
dominant.

A chain is a row (first, end, anchor) of a table, the anchor -1 where the chain hangs on nothing; its equations are rows
(inwards, own, outwards) of the bands; the border holds how the core reads the first variable of each chain.
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


@compiled
def _eliminate(bands: Any, first: int, end: int) -> bool:
    """Remove the outward entries; leaves inverse pivots and the factors of the right-hand side."""
    for i in range(end - 1, first - 1, -1):
        if i < end - 1:
            bands[i, 2] *= bands[i + 1, 1]
            bands[i, 1] -= bands[i, 2] * bands[i + 1, 0]
        if not 0.0 < size_of(bands[i, 1]) < np.inf:
            return False
        bands[i, 1] = 1.0 / bands[i, 1]
    return True


@compiled
def fold_chains(core: Any, border: Any, bands: Any, chains: Any) -> bool:
    """Eliminate the chains from the core, which is not yet factored; False where a pivot vanishes."""
    n = core.shape[0]
    for c in range(chains.shape[0]):
        first, anchor = chains[c, 0] - n, chains[c, 2]
        if not _eliminate(bands, first, chains[c, 1] - n):
            return False
        for i in range(n):
            border[i, c] *= bands[first, 1]
            if anchor >= 0:
                core[i, anchor] -= border[i, c] * bands[first, 0]
    return True


@compiled
def _before(border: Any, bands: Any, chains: Any, x: Any) -> None:
    """The right-hand side of the core with the chains eliminated."""
    n = border.shape[0]
    for c in range(chains.shape[0]):
        first = chains[c, 0]
        for i in range(chains[c, 1] - 2, first - 1, -1):
            x[i] -= bands[i - n, 2] * x[i + 1]
        for i in range(n):
            x[i] -= border[i, c] * x[first]


@compiled
def _behind(n: int, bands: Any, chains: Any, x: Any) -> None:
    """The solution along the chains from that of the core."""
    for c in range(chains.shape[0]):
        first, anchor = chains[c, 0], chains[c, 2]
        if anchor >= 0:
            x[first] -= bands[first - n, 0] * x[anchor]
        x[first] *= bands[first - n, 1]
        for i in range(first + 1, chains[c, 1]):
            x[i] = (x[i] - bands[i - n, 0] * x[i - 1]) * bands[i - n, 1]


@compiled
def solve_real(w: Any, x: Any) -> None:
    """Overwrite the right-hand side by the solution with the real matrix."""
    chained = w.chains.shape[0] > 0
    if chained:
        _before(w.real_border, w.real_bands, w.chains, x)
    solve(w.real, w.order[0], x)
    if chained:
        _behind(w.real.shape[0], w.real_bands, w.chains, x)


@compiled
def solve_complex(w: Any, pair: int, x: Any) -> None:
    """Overwrite the right-hand side by the solution with the complex matrix of a pair of eigenvalues."""
    chained = w.chains.shape[0] > 0
    if chained:
        _before(w.complex_border[pair], w.complex_bands[pair], w.chains, x)
    solve(w.complex[pair], w.order[1 + pair], x)
    if chained:
        _behind(w.real.shape[0], w.complex_bands[pair], w.chains, x)


@compiled
def _shifted(derivatives: Any, shift: Any, matrix: Any) -> None:
    """G_y + shift G_ydot."""
    stiffness, mass = derivatives[0], derivatives[1]
    for i in range(matrix.shape[0]):
        for j in range(matrix.shape[1]):
            matrix[i, j] = shift * mass[i, j] + stiffness[i, j]


@compiled
def fold_shifted(w: Any, shift: Any, core: Any, border: Any, bands: Any) -> bool:
    """Eliminate the chains of G_y + shift G_ydot from its core."""
    _shifted(w.border_derivatives, shift, border)
    _shifted(w.band_derivatives, shift, bands)
    return bool(fold_chains(core, border, bands, w.chains))
