r"""Work of a prescribed force on bonds, which no potential of the interface holds.

A force f that a scene prescribes is a dead load. Two reactions that undo each other keep detailed balance under it if
:math:`k_f/k_r` grows like :math:`e^{f(x_f-x_r)/k_BT}` with the work on the way from one state to the other, between
which a bond gives way by the difference of its distances to the transition state. So the rates say how far a bond of
the species k lets the load down,

.. math:: \sum_k \nu_k \ell_k = x_f - x_r, \qquad \Lambda = -f \sum_k N_k \theta_k \ell_k,

and the load's potential belongs to the affinity of the pair, whose reactions take :math:`f\sum_k\nu_k\ell_k` from it.
So it does to that of every law which goes by the affinity: in equilibrium :math:`d\ln\frac{\phi}{1-\phi}/df=\ell/k_BT`
of bonds that mix ideally. A law that feels the force while its reverse follows from the affinity has to say its length
itself. A prescribed traction that bonds share is such a force too, a share each.

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

from surfacechem.contracts.terms import Load, RateLaw, reads
from surfacechem.errors import InputError
from surfacechem.expressions import Expression, derivative
from surfacechem.model.balances import INTERFACE, OUTSIDE, WORK, Power
from surfacechem.model.build import Build
from surfacechem.model.components.force import SHARED
from surfacechem.model.components.mounting import driven
from surfacechem.model.pairs import Opposed

Array = NDArray[np.float64]
Change = Mapping[str, int | float]

NO_PART = 1e-12
"""Coefficients below this are rounding."""


def dead_load(build: Build, laws: Mapping[str, RateLaw], pairs: Sequence[Opposed]) -> dict[str, Expression]:
    """Potential of a prescribed force per molecule [J], by bonding variable; empty where no rate feels one."""
    given = _prescribed(build)
    unknown = next((law for law in laws.values() if _lacks_length(law)), None)
    if given and unknown is not None:
        if _is_held_at_zero(build):
            return {}
        raise _unknown_length(unknown)
    for law in laws.values() if not given else ():
        _refuse_idle_length(law)
    found = lengths(laws, pairs) if given else {}
    if not found:
        return {}
    f = build.variables.get("f", "the work of the force")
    load = -f * sum(build.bonding[name].density * build.bonding[name].symbol * found[name] for name in found)
    return {name: derivative(load, build.bonding[name].symbol) / build.bonding[name].density for name in found}


def _prescribed(build: Build) -> bool:
    """Whether the force on a bond is prescribed, by itself or as its share in a prescribed traction."""
    shares = any(role.variable == "f" and role.by == SHARED for role in build.variables.roles)
    return driven(build, "f") or (shares and driven(build, "t_n"))


def _is_held_at_zero(build: Build) -> bool:
    """Whether the case holds the force at zero, where it does no work. Any other force is assembled anew."""
    load = build.scene.loading.get("f")
    if not isinstance(load, Load) or getattr(load, "level", None) != 0.0:
        return False
    build.parameters.constants[f"{load.path}.level"] = (dict(load.specs())["level"], 0.0)
    return True


def by_affinity(law: RateLaw) -> bool:
    """Whether a law goes by an affinity that the work of a force is part of."""
    return law.length is not None or "mu" in reads(law.statement)


def _lacks_length(law: RateLaw) -> bool:
    """Whether the rate of a law feels the force and its reverse follows from the affinity, without the work."""
    return law.balanced and law.length is None and "f" in reads(law.statement)


def _unknown_length(law: RateLaw) -> InputError:
    remedy = (
        "Give `x_on`, 0 m where formation does not feel the force"
        if hasattr(law, "x_on")
        else "Write it as two reactions with `=>`, each with its own distance to the transition state"
    )
    return InputError(
        f"{law.title} would come to the same equilibrium under any prescribed force: its rate feels the force, but "
        f"how far a bond lets the load down as it forms is not known. {remedy}.",
        law.place,
    )


def _refuse_idle_length(law: RateLaw) -> None:
    if law.length is not None and law.log_ratio is None:
        raise InputError(
            f"x_on of {law.name()} belongs to a prescribed force. Here the potential says what the force does to the "
            "equilibrium; leave it out.",
            law.place,
        )


def book_work(
    build: Build, laws: Mapping[str, RateLaw], rates: Mapping[str, Expression], load: Mapping[str, Expression]
) -> Iterator[Power]:
    """What reactions take from the load comes in as work."""
    taken = [
        -build.stretch * rates[label] * n * load[name]
        for label, law in laws.items()
        for name, n in law.stoichiometry().items()
        if name in load
    ]
    if taken:
        text = "work of the prescribed force on bonds"
        yield Power(WORK, OUTSIDE, INTERFACE, symengine.Add(*taken), "W_f", text)


def lengths(laws: Mapping[str, RateLaw], pairs: Sequence[Opposed]) -> dict[str, Expression]:
    """How far a bond of each species lets a load down [m], up to what no pair tells; empty where no pair feels it."""
    known = [*_known(pairs), *((law.stoichiometry(), law.length) for law in laws.values() if law.length is not None)]
    names = list(dict.fromkeys(name for change, _ in known for name in change))
    both_ways = [law.stoichiometry() for law in laws.values() if law.balanced and not by_affinity(law)]
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
