"""LU decomposition of a matrix whose last variables form chains, such as the temperatures across a body.

The state is [core | chain | chain ...]. In a chain, numbered from the core outwards, each equation reads its own
variable and its two neighbours; the first one's inner neighbour is one variable of the core, the anchor. The core reads
the first variable of each chain. A chain is eliminated from its far end, which leaves a correction of one column of
the core, at a cost proportional to its length. Nothing is exchanged within a chain: where heat is conducted between
capacities its matrix is diagonally dominant.

A chain is a row (first, end, anchor) of a table, the anchor -1 where the chain hangs on nothing; its equations are rows
(inwards, own, outwards) of the bands; the border holds how the core reads the first variable of each chain.
"""

from typing import Any

import numpy as np

from surfacechem.solve.radau.lu import size_of, solve
from surfacechem.solve.radau.work import compiled


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
