r"""Work of a prescribed force on bonds, which no potential of the interface holds.

A force f that a scene prescribes is a dead load. Two reactions that undo each other keep detailed balance under it if
:math:`k_f/k_r` grows like :math:`e^{f(x_f-x_r)/k_BT}` with the work on the way from one state to the other, between
which a bond gives way by the difference of its distances to the transition state. So the rates say how far a bond of
the species k lets the load down,

.. math:: \sum_k \nu_k \ell_k = x_f - x_r, \qquad \Lambda = -f \sum_k N_k \theta_k \ell_k,

and the load's potential belongs to the affinity of the pair, whose reactions take :math:`f\sum_k\nu_k\ell_k` from it.
Where pairs around a cycle contradict each other, or reactions whose reverse knows no force, the lengths are the closest
(least squares), and what is left is a departure from equilibrium. A reaction that nothing undoes takes no work: what
the load does once a bond has let go is not the interface's.

Source: Bell (1978), Science 200, 618, doi 10.1126/science.347575, with the detailed balance of Onsager (1931), Phys.
Rev. 37, 405, under a load.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import symengine
from numpy.typing import NDArray

from surfacechem.assembly.build import Build
from surfacechem.assembly.pairs import Opposed
from surfacechem.expressions import Expression, derivative
from surfacechem.terms import RateLaw

Array = NDArray[np.float64]
Change = Mapping[str, int | float]

NO_PART = 1e-12
"""Coefficients below this are rounding."""


def dead_load(build: Build, laws: Mapping[str, RateLaw], pairs: Sequence[Opposed]) -> dict[str, Expression]:
    """Potential of a prescribed force per molecule [J], by bonding variable; empty where no pair of rates feels one."""
    found = lengths(laws, pairs) if "f" in build.scene.loading else {}
    if not found:
        return {}
    f = build.variables.get("f", "the work of the force")
    load = -f * sum(build.bonding[name].density * build.bonding[name].symbol * found[name] for name in found)
    return {name: derivative(load, build.bonding[name].symbol) / build.bonding[name].density for name in found}


def book_work(
    build: Build, laws: Mapping[str, RateLaw], rates: Mapping[str, Expression], load: Mapping[str, Expression]
) -> None:
    """What reactions take from the load comes in as work."""
    taken = [
        -build.stretch * rates[label] * n * load[name]
        for label, law in laws.items()
        for name, n in law.stoichiometry().items()
        if name in load
    ]
    if taken:
        power = symengine.Add(*taken)
        build.supply("W_f", "work of the prescribed force on bonds", power, None)
        build.into_interface.append(power)
        build.node_of["interface"].inflow.append(power)


def lengths(laws: Mapping[str, RateLaw], pairs: Sequence[Opposed]) -> dict[str, Expression]:
    """How far a bond of each species lets a load down [m], up to what no pair tells; empty where no pair feels it."""
    known = list(_known(pairs))
    names = list(dict.fromkeys(name for change, _ in known for name in change))
    both_ways = [law.stoichiometry() for law in laws.values() if not law.one_way and law.log_ratio is None]
    inverse = _inverse(*(_matrix(names, changes) for changes in ([change for change, _ in known], both_ways)))
    return {
        name: sum(float(c) * x for c, (_, x) in zip(row, known, strict=True) if abs(c) > NO_PART)
        for name, row in zip(names, inverse, strict=True)
    }


def _known(pairs: Sequence[Opposed]) -> Iterator[tuple[Change, Expression]]:
    """Change of species and of length, for each pair of single reactions that a force drives along a distance."""
    for pair in pairs:
        forward, backward = list(pair.forward.values()), list(pair.backward.values())
        if len(forward) == len(backward) == 1:
            x_f, x_r = forward[0].distance, backward[0].distance
            if x_f is not None and x_r is not None:
                yield forward[0].stoichiometry(), x_f - x_r


def _matrix(names: Sequence[str], changes: Sequence[Change]) -> Array:
    rows = [[change.get(name, 0) for name in names] for change in changes]
    return np.array(rows, dtype=float).reshape(len(rows), len(names))


def _inverse(changes: Array, kept: Array) -> Array:
    """Lengths per difference of distance, shape (species, pairs), of which none changes in the reactions ``kept``."""
    if not np.any(kept):
        return np.asarray(np.linalg.pinv(changes))
    _, sizes, rows = np.linalg.svd(kept)
    basis = rows[int(np.sum(sizes > NO_PART)) :].T
    left = changes @ basis
    left[np.abs(left) < NO_PART] = 0.0
    return np.asarray(basis @ np.linalg.pinv(left)) if basis.size else np.zeros(changes.T.shape)
