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
def _scale_rows(a: Any, columns: Any, rows: Any) -> bool:
    """Scales of the rows in units of the columns' typical sizes; False where a row is of zeros or not finite."""
    for i in range(len(rows)):
        largest = 0.0
        for j in range(len(rows)):
            size = size_of(a[i, j]) * columns[j]
            if size > largest or size != size:  # numbers that are none count, too
                largest = size
        if not 0.0 < largest < np.inf:
            return False
        rows[i] = 1.0 / largest
    return True


@compiled
def _eliminate(a: Any, k: int) -> None:
    """Take multiples of row k from those below it, and keep them; its pivot becomes the inverse."""
    # A division less for each right-hand side, of which there are many.
    inverse = 1.0 / a[k, k]
    a[k, k] = inverse
    pivot = a[k, k + 1 :]
    for i in range(k + 1, a.shape[0]):
        # In a large mechanism most species do not take part in each other's reactions.
        if a[i, k] == 0.0:
            continue
        multiple = a[i, k] * inverse
        a[i, k] = multiple
        row = a[i, k + 1 :]
        for j in range(len(pivot)):
            row[j] -= multiple * pivot[j]


@compiled
def factor(a: Any, order: Any, columns: Any, rows: Any, threshold: float) -> bool:
    """Replace a by its factors, the inverse pivots on the diagonal; False if a scaled pivot is not above the
    threshold.
    """
    n = a.shape[0]
    if not _scale_rows(a, columns, rows[:n]):
        return False
    for k in range(n):
        p, best = k, -1.0
        for i in range(k, n):
            size = size_of(a[i, k]) * rows[i]
            if size > best:
                p, best = i, size
        if not size_of(a[p, k]) * rows[p] * columns[k] > threshold:
            return False
        order[k] = p
        if p != k:
            for j in range(n):
                a[k, j], a[p, j] = a[p, j], a[k, j]
            rows[k], rows[p] = rows[p], rows[k]
        _eliminate(a, k)
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
def fold_chains(core: Any, border: Any, bands: Any, chains: Any) -> bool:
    """Eliminate the chains from the core, which is not yet factored; False where a pivot vanishes.

    It leaves inverse pivots in the bands, and beside them the factors of the right-hand side.
    """
    n = core.shape[0]
    for c in range(chains.shape[0]):
        first, end, anchor = chains[c, 0] - n, chains[c, 1] - n, chains[c, 2]
        for i in range(end - 1, first - 1, -1):
            if i < end - 1:
                bands[i, 2] *= bands[i + 1, 1]
                bands[i, 1] -= bands[i, 2] * bands[i + 1, 0]
            if not 0.0 < size_of(bands[i, 1]) < np.inf:
                return False
            bands[i, 1] = 1.0 / bands[i, 1]
        for i in range(n):
            border[i, c] *= bands[first, 1]
            if anchor >= 0:
                core[i, anchor] -= border[i, c] * bands[first, 0]
    return True


@compiled
def shifted(derivatives: Any, shift: Any, matrix: Any) -> None:
    """G_y + shift G_ydot."""
    stiffness, mass = derivatives[0], derivatives[1]
    for i in range(matrix.shape[0]):
        for j in range(matrix.shape[1]):
            matrix[i, j] = shift * mass[i, j] + stiffness[i, j]


@compiled
def fold_shifted(w: Any, shift: Any, core: Any, border: Any, bands: Any) -> bool:
    """Eliminate the chains of G_y + shift G_ydot from its core."""
    shifted(w.border_derivatives, shift, border)
    shifted(w.band_derivatives, shift, bands)
    return bool(fold_chains(core, border, bands, w.chains))


@compiled
def _solve_chained(chains: Any, core: Any, border: Any, bands: Any, order: Any, x: Any) -> None:
    """Overwrite the right-hand side by the solution with a matrix whose chains are folded into its core."""
    n = core.shape[0]
    # The right-hand side of the core with the chains eliminated, from their far ends.
    for c in range(chains.shape[0]):
        first = chains[c, 0]
        for i in range(chains[c, 1] - 2, first - 1, -1):
            x[i] -= bands[i - n, 2] * x[i + 1]
        for i in range(n):
            x[i] -= border[i, c] * x[first]
    solve(core, order, x)
    # The solution along the chains, from that of the core outwards.
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
    if w.links > 0:
        _solve_chained(w.chains, w.real, w.real_border, w.real_bands, w.order[0], x)
    else:
        solve(w.real, w.order[0], x)


@compiled
def solve_complex(w: Any, pair: int, x: Any) -> None:
    """Overwrite the right-hand side by the solution with the complex matrix of a pair of eigenvalues."""
    if w.links > 0:
        border, bands = w.complex_border[pair], w.complex_bands[pair]
        _solve_chained(w.chains, w.complex[pair], border, bands, w.order[1 + pair], x)
    else:
        solve(w.complex[pair], w.order[1 + pair], x)
