"""LU decomposition of small dense real or complex matrices, with scaled partial pivoting.

Rows may differ by forty decades (a capacity of 1e-15 and a conductance of 1e20). Each row is therefore compared by its
largest entry in units of the columns' typical sizes; the entries themselves are not scaled, so that a row which is a
sum stays exact.

Where the last variables form chains, such as the temperatures across a body, the state is [core | chain | chain ...].
In a chain, numbered from the core outwards, each equation reads its own variable and its two neighbours; the inner
neighbour of the first is one variable of the core, the anchor. The core reads the first variable of each chain. A chain
is eliminated from its far end, which corrects one column of the core, at a cost proportional to its length. Chains are
not pivoted: where heat is conducted between capacities the matrix is diagonally dominant.

The core of a large mechanism is sparse, since most species take no part in each other's reactions. From LARGE_MATRIX
rows on, the column with the fewest remaining entries is eliminated next, by the row with the fewest among those whose
pivot is not small, after Markowitz (1957) with the threshold of Duff, Erisman & Reid (1986).

A chain is a row (first, end, anchor) of a table, with anchor -1 where the chain has none; its equations are rows
(inwards, own, outwards) of the bands; the border holds the derivatives of the core by the first variable of each chain.
"""

from typing import Any

import numpy as np

from surfacechem.solve.radau.work import compiled

LARGE_MATRIX = 30
"""Number of rows from which on columns are exchanged too, and zeros skipped."""

PIVOT_PART = 0.1
"""Least pivot, relative to the largest scaled entry of its column, that is accepted to keep the factors sparse."""

REPEATED_PIVOT = PIVOT_PART**2
"""The same for a matrix that is factored in the pivot order of an earlier one."""


@compiled
def size_of(value: Any) -> float:
    """Return |Re| + |Im| of a number, which needs no square root."""
    return float(abs(value.real) + abs(value.imag))


@compiled
def _scale_rows(a: Any, columns: Any, rows: Any) -> bool:
    """Compute the scales of the rows, in units of the columns' typical sizes; False if a row is zero or not finite."""
    for i in range(len(rows)):
        largest = 0.0
        for j in range(len(rows)):
            size = size_of(a[i, j]) * columns[j]
            if size > largest or size != size:  # NaN counts, too
                largest = size
        if not 0.0 < largest < np.inf:
            return False
        rows[i] = 1.0 / largest
    return True


@compiled
def _eliminate(a: Any, k: int) -> None:
    """Subtract multiples of row k from the rows below it and store the multipliers; the pivot is replaced by its
    inverse.
    """
    # Saves a division for each of many right-hand sides.
    inverse = 1.0 / a[k, k]
    a[k, k] = inverse
    pivot = a[k, k + 1 :]
    for i in range(k + 1, a.shape[0]):
        if a[i, k] == 0.0:
            continue
        multiple = a[i, k] * inverse
        a[i, k] = multiple
        row = a[i, k + 1 :]
        for j in range(len(pivot)):
            row[j] -= multiple * pivot[j]


@compiled
def _emptiest(
    a: Any, k: int, columns: Any, origins: Any, rows: Any, counts: Any, threshold: float
) -> tuple[int, int, int]:
    """Return row and column of the next pivot, and the number of entries in that column; the row is -1 where no scaled
    pivot of the column exceeds the threshold.
    """
    n, q, best, p, found = a.shape[0], k, 0.0, -1, 0
    for j in range(k + 1, n):
        if counts[1, j] < counts[1, q]:
            q = j
    for i in range(k, n):
        if a[i, q] != 0.0:
            counts[3, found] = i
            found += 1
            best = max(best, size_of(a[i, q]) * rows[i])
    if best * columns[origins[q]] > threshold:
        for m in range(found):
            i = counts[3, m]
            if size_of(a[i, q]) * rows[i] >= PIVOT_PART * best and (p < 0 or counts[0, i] < counts[0, p]):
                p = i
    return p, q, found


@compiled
def _exchange(a: Any, k: int, p: int, q: int, order: Any, rows: Any, counts: Any) -> None:
    """Exchange rows k and p, and columns k and q."""
    n = a.shape[0]
    order[0, k], order[1, k] = p, q
    order[4, k], order[4, p] = order[4, p], order[4, k]
    order[5, k], order[5, q] = order[5, q], order[5, k]
    if p != k:
        for j in range(n):
            a[k, j], a[p, j] = a[p, j], a[k, j]
        rows[k], rows[p] = rows[p], rows[k]
        counts[0, k], counts[0, p] = counts[0, p], counts[0, k]
    if q != k:
        for i in range(n):
            a[i, k], a[i, q] = a[i, q], a[i, k]
        counts[1, k], counts[1, q] = counts[1, q], counts[1, k]


@compiled
def _eliminate_entries(a: Any, k: int, p: int, below: int, counts: Any) -> None:
    """Eliminate as _eliminate does, entry by entry, and update the counts; rows k and p have been exchanged."""
    n, found = a.shape[0], 0
    inverse = 1.0 / a[k, k]
    a[k, k] = inverse
    for j in range(k + 1, n):
        if a[k, j] != 0.0:
            counts[1, j] -= 1
            counts[2, found] = j
            found += 1
    for listed in range(below):
        i = counts[3, listed]
        if i == p:
            continue
        i = p if i == k else i
        multiple = a[i, k] * inverse
        a[i, k] = multiple
        counts[0, i] -= 1
        for m in range(found):
            j = counts[2, m]
            if a[i, j] == 0.0:
                counts[0, i] += 1
                counts[1, j] += 1
            a[i, j] -= multiple * a[k, j]


@compiled
def _list_entries(a: Any, order: Any, places: Any, marks: Any) -> None:
    """List the positions of possible nonzeros in each row of the factors: first those left of the diagonal, then those
    right of it.
    """
    n = a.shape[0]
    for i in range(n):
        found = 0
        for j in range(n):
            marks[j] = a[i, j] != 0.0
        for j in range(n):
            if j == i:
                order[2, i] = found
            elif marks[j] != 0:
                places[i, found] = j
                found += 1
                if j < i:
                    for m in range(order[2, j], order[3, j]):
                        marks[places[j, m]] = 1
        order[3, i] = found


@compiled
def _factor_large(a: Any, order: Any, places: Any, columns: Any, rows: Any, counts: Any, threshold: float) -> bool:
    n = a.shape[0]
    for i in range(n):
        counts[0, i] = counts[1, i] = 0
        order[4, i] = order[5, i] = i
    for i in range(n):
        for j in range(n):
            if a[i, j] != 0.0:
                counts[0, i] += 1
                counts[1, j] += 1
    order[3, 0] = -1  # not valid until complete: no other matrix may use this order
    for k in range(n):
        p, q, below = _emptiest(a, k, columns, order[5], rows, counts, threshold)
        if p < 0:
            return False
        _exchange(a, k, p, q, order, rows, counts)
        _eliminate_entries(a, k, p, below, counts)
    _list_entries(a, order, places, counts[3])
    return True


@compiled
def count_entries_of_rows(derivatives: Any, counts: Any) -> None:
    """Count the nonzeros of each row of G_y and G_ydot together."""
    for i in range(len(counts)):
        found = 0
        for j in range(len(counts)):
            found += derivatives[0, i, j] != 0.0 or derivatives[1, i, j] != 0.0
        counts[i] = found


@compiled
def factor_again(
    derivatives: Any, entries: Any, shift: Any, a: Any, order: Any, places: Any, columns: Any, rows: Any
) -> bool:
    """Factor G_y + shift G_ydot in the pivot order of an earlier large matrix, touching only the known nonzeros.

    False if the matrix has nonzeros elsewhere, which the counts of its rows tell, or if a pivot has become small.
    """
    for i in range(a.shape[0]):
        row, known, found, largest = a[i], order[3, i], 0, 0.0
        for m in range(known + 1):
            j = places[i, m] if m < known else i
            g, r = derivatives[0, order[4, i], order[5, j]], derivatives[1, order[4, i], order[5, j]]
            found += g != 0.0 or r != 0.0
            row[j] = shift * r + g
            largest = max(largest, size_of(row[j]) * columns[order[5, j]])
        if found != entries[order[4, i]] or not 0.0 < largest < np.inf:
            return False
        rows[i] = 1.0 / largest
        for m in range(order[2, i]):
            k = places[i, m]
            multiple = row[k] * a[k, k]
            if not size_of(multiple) * rows[i] * REPEATED_PIVOT <= rows[k]:
                return False
            row[k] = multiple
            pivot = a[k]
            for later in range(order[2, k], order[3, k]):
                j = places[k, later]
                row[j] -= multiple * pivot[j]
        if not 0.0 < size_of(row[i]) < np.inf:
            return False
        row[i] = 1.0 / row[i]
    return True


@compiled
def factor(a: Any, order: Any, places: Any, columns: Any, rows: Any, counts: Any, threshold: float) -> bool:
    """Replace a by its LU factors with the inverse pivots on the diagonal; False if a scaled pivot does not exceed the
    threshold.

    The rows of ``order`` hold: row exchanges, column exchanges, the number of entries of each row left of its diagonal,
    and in all, and the original rows and columns; ``places`` holds the columns of the entries. ``counts`` is work space
    of four rows.
    """
    n = a.shape[0]
    if not _scale_rows(a, columns, rows[:n]):
        return False
    if n >= LARGE_MATRIX:
        return bool(_factor_large(a, order, places, columns, rows, counts, threshold))
    for k in range(n):
        p, best = k, -1.0
        for i in range(k, n):
            size = size_of(a[i, k]) * rows[i]
            if size > best:
                p, best = i, size
        if not size_of(a[p, k]) * rows[p] * columns[k] > threshold:
            return False
        order[0, k] = p
        if p != k:
            for j in range(n):
                a[k, j], a[p, j] = a[p, j], a[k, j]
            rows[k], rows[p] = rows[p], rows[k]
        _eliminate(a, k)
    return True


@compiled
def _solve_large(a: Any, order: Any, places: Any, x: Any) -> None:
    n = a.shape[0]
    for k in range(n):
        p = order[0, k]
        total = x[p]
        x[p] = x[k]
        for m in range(order[2, k]):
            j = places[k, m]
            total -= a[k, j] * x[j]
        x[k] = total
    for k in range(n - 1, -1, -1):
        total = x[k]
        for m in range(order[2, k], order[3, k]):
            j = places[k, m]
            total -= a[k, j] * x[j]
        x[k] = total * a[k, k]
    for k in range(n - 1, -1, -1):
        q = order[1, k]
        x[k], x[q] = x[q], x[k]


@compiled
def solve(a: Any, order: Any, places: Any, x: Any) -> None:
    """Overwrite a right-hand side by the solution; entries of x beyond the matrix are not touched."""
    n = a.shape[0]
    if n >= LARGE_MATRIX:
        _solve_large(a, order, places, x)
        return
    # Sums in a local variable: in x each term would wait for the store of the one before.
    for k in range(n):
        p = order[0, k]
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
    """Eliminate the chains from the core, which is not factored yet; False if a pivot vanishes.

    It leaves the inverse pivots in the bands, and next to them the factors for right-hand sides.
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
    """Form G_y + shift G_ydot."""
    stiffness, mass = derivatives[0], derivatives[1]
    for i in range(matrix.shape[0]):
        for j in range(matrix.shape[1]):
            matrix[i, j] = shift * mass[i, j] + stiffness[i, j]


@compiled
def _solve_chained(chains: Any, core: Any, border: Any, bands: Any, order: Any, places: Any, x: Any) -> None:
    """Overwrite a right-hand side by the solution of a system whose chains are eliminated from its core."""
    n = core.shape[0]
    # Eliminate the chains from the right-hand side, from their far ends.
    for c in range(chains.shape[0]):
        first = chains[c, 0]
        for i in range(chains[c, 1] - 2, first - 1, -1):
            x[i] -= bands[i - n, 2] * x[i + 1]
        for i in range(n):
            x[i] -= border[i, c] * x[first]
    solve(core, order, places, x)
    # Back-substitute along the chains, from the core outwards.
    for c in range(chains.shape[0]):
        first, anchor = chains[c, 0], chains[c, 2]
        if anchor >= 0:
            x[first] -= bands[first - n, 0] * x[anchor]
        x[first] *= bands[first - n, 1]
        for i in range(first + 1, chains[c, 1]):
            x[i] = (x[i] - bands[i - n, 0] * x[i - 1]) * bands[i - n, 1]


@compiled
def solve_real(w: Any, x: Any) -> None:
    """Overwrite a right-hand side by the solution of the real Newton system."""
    if w.links > 0:
        _solve_chained(w.chains, w.real, w.real_border, w.real_bands, w.order[0], w.places[0], x)
    else:
        solve(w.real, w.order[0], w.places[0], x)


@compiled
def bound_real(w: Any, x: Any) -> None:
    """Overwrite bounds of a right-hand side by bounds of the solution of the real Newton system, a large one.

    Source: Higham (2002), Accuracy and Stability of Numerical Algorithms, section 8.3: with the comparison matrices of
    the factors, whose entries are the absolute values, nothing cancels.
    """
    a, order, places = w.real, w.order[0], w.places[0]
    n = a.shape[0]
    for k in range(n):
        p = order[0, k]
        x[k], x[p] = x[p], x[k]
        for m in range(order[2, k]):
            j = places[k, m]
            x[k] += abs(a[k, j]) * x[j]
    for k in range(n - 1, -1, -1):
        for m in range(order[2, k], order[3, k]):
            j = places[k, m]
            x[k] += abs(a[k, j]) * x[j]
        x[k] *= abs(a[k, k])
    for k in range(n - 1, -1, -1):
        q = order[1, k]
        x[k], x[q] = x[q], x[k]


@compiled
def solve_complex(w: Any, pair: int, x: Any) -> None:
    """Overwrite a right-hand side by the solution of the complex Newton system of one pair of eigenvalues."""
    if w.links > 0:
        border, bands = w.complex_border[pair], w.complex_bands[pair]
        _solve_chained(w.chains, w.complex[pair], border, bands, w.order[1 + pair], w.places[1 + pair], x)
    else:
        solve(w.complex[pair], w.order[1 + pair], w.places[1 + pair], x)
