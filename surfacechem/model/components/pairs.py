r"""Opposed one-way laws: their departure from detailed balance, and the work of a prescribed force.

A prescribed force f is a dead load. Two reactions that undo each other keep detailed balance under it if
:math:`k_f/k_r` grows like :math:`e^{f(x_f-x_r)/k_BT}`, with the work between the two states. The bond gives way by the
difference of its distances to the transition state. The rates therefore determine the length by which a bond of the
species k lets the load down,

.. math:: \sum_k \nu_k \ell_k = x_f - x_r, \qquad \Lambda = -f \sum_k N_k \theta_k \ell_k,

and the load's potential belongs to the affinity of the pair, whose reactions take :math:`f\sum_k\nu_k\ell_k` from it.
It also belongs to the affinity of every law that reads an affinity: in equilibrium
:math:`d\ln\frac{\phi}{1-\phi}/df=\ell/k_BT` of bonds that mix ideally. A law whose rate depends on the force and whose
reverse follows from the affinity has to state its length. A prescribed traction that bonds share is such a force too,
in equal shares.

If pairs around a cycle contradict each other, or the reverse of a reaction does not depend on the force, the lengths
are a least-squares fit, and its residual is a departure from equilibrium. A reaction without a reverse takes no work:
the work of the load after a bond has broken is not done on the interface.

Source: Bell (1978), Science 200, 618, doi 10.1126/science.347575, with the detailed balance of Onsager (1931), Phys.
Rev. 37, 405, under a load.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from surfacechem.contracts.terms import Load, RateLaw, reads
from surfacechem.errors import InputError
from surfacechem.expressions import Expression, depends, derivative, log_sum, where
from surfacechem.model.build import Build
from surfacechem.model.components.force import SHARED_LOAD
from surfacechem.model.components.mounting import driven
from surfacechem.model.system import RatePair
from surfacechem.quantities import BOLTZMANN, Quantity
from surfacechem.tolerances import LARGEST_COVERAGE, LEAST_COVERAGE, RUN_EPS

Array = NDArray[np.float64]


class Opposed(NamedTuple):
    """One-way laws, by label, that change the bonding variables by ``change``, and their reverse laws."""

    change: Mapping[str, int | float]
    forward: Mapping[str, RateLaw]
    backward: Mapping[str, RateLaw]

    @property
    def labels(self) -> tuple[str, ...]:
        """Labels of all laws of the group."""
        return (*self.forward, *self.backward)

    @property
    def label(self) -> str:
        """Short name for the quantities of the group."""
        return "_".join(self.labels)

    @property
    def known_length(self) -> tuple[Mapping[str, int | float], Expression] | None:
        """Change of species and of length, for a pair of single reactions with distances along the force; else None."""
        forward, backward = list(self.forward.values()), list(self.backward.values())
        x_f, x_r = forward[0].distance, backward[0].distance
        if len(forward) > 1 or len(backward) > 1 or x_f is None or x_r is None:
            return None
        return forward[0].stoichiometry(), x_f - x_r


def opposed(laws: Mapping[str, RateLaw]) -> list[Opposed]:
    """Return the groups of one-way laws with a reverse; all laws with the same stoichiometry are in one group."""
    alike: dict[frozenset[tuple[str, float]], dict[str, RateLaw]] = {}
    for label, law in laws.items():
        if law.one_way and (change := law.turnover()):
            alike.setdefault(frozenset(change.items()), {})[label] = law
    groups: list[Opposed] = []
    for key, forward in alike.items():
        backward = alike.get(frozenset((name, -n) for name, n in key))
        # The law of a pair that comes first in the scene is its forward side.
        if backward and not any(group.backward is forward for group in groups):
            groups.append(Opposed(next(iter(forward.values())).turnover(), forward, backward))
    return groups


def departure(build: Build, group: Opposed, mu: Mapping[str, Expression]) -> Iterator[RatePair]:
    """Yield the departure of one-way rates from detailed balance at zero affinity; none for external rates."""
    if any(law.log_rate is None for law in (*group.forward.values(), *group.backward.values())):
        return
    forward, backward = (
        log_sum([build.variables.call(law, law.log_rate) for law in laws.values()])
        for laws in (group.forward, group.backward)
    )
    affinity = sum(n * mu[name] for name, n in group.change.items())
    title = next(iter(group.forward.values())).title.replace(" => ", " <=> ")
    yield _departure(build, group.label, f"{title} (pair)", forward - backward, affinity)


def own_departure(build: Build, label: str, law: RateLaw, affinity: Expression) -> Iterator[RatePair]:
    """Yield the departure from detailed balance of a law that states both rates, if the potential depends on it."""
    known = any(depends(build.psi, build.bonding[name].symbol) for name in law.stoichiometry())
    if law.log_ratio is not None and known:
        yield _departure(build, label, law.title, build.variables.call(law, law.log_ratio), affinity)


def _departure(build: Build, label: str, title: str, log_ratio: Expression, affinity: Expression) -> RatePair:
    T = build.variables.get("T_c", "the equilibrium of a reaction")
    value = build.expanded(log_ratio + affinity / (BOLTZMANN * T))
    inside = {}  # coverages kept inside the bounds at which their logarithms exist
    for bond in (bond for bond in build.bonding.values() if depends(value, bond.symbol)):
        below = where(bond.symbol < LARGEST_COVERAGE, bond.symbol, LARGEST_COVERAGE)
        inside[bond.symbol] = where(bond.symbol > LEAST_COVERAGE, below, LEAST_COVERAGE)
    quantity = Quantity(f"departure_{label}", "1", f"ln(k_f/k_r) - ln K(g, T) of {title}")
    build.name(quantity, value.subs(inside))
    return RatePair(quantity.name, title, label)


def dead_load(build: Build, laws: Mapping[str, RateLaw], pairs: Sequence[Opposed]) -> dict[str, Expression]:
    """Return the potential of a prescribed force per molecule [J], by bonding variable; empty if not read."""
    if not _is_force_prescribed(build):
        idle = next((law for law in laws.values() if law.length is not None and law.log_ratio is None), None)
        if idle is not None:
            here = "Here the potential says what the force does to the equilibrium; leave it out."
            raise InputError(f"x_on of {idle.name()} belongs to a prescribed force. {here}", idle.place)
        return {}
    # A rate that depends on the force while its reverse follows from the affinity, without the work.
    for law in laws.values():
        if law.balanced and law.length is None and "f" in reads(law.statement):
            _hold_at_zero(build, law)
            return {}
    found = lengths(laws, pairs)
    if not found:
        return {}
    f, bonds = build.variables.get("f", "the work of the force"), {name: build.bonding[name] for name in found}
    potential = -f * sum(bond.density * bond.symbol * found[name] for name, bond in bonds.items())
    return {name: derivative(potential, bond.symbol) / bond.density for name, bond in bonds.items()}


def _is_force_prescribed(build: Build) -> bool:
    """True if the force per bond is prescribed, directly or by a traction that the bonds share."""
    shares = any(role.variable == "f" and role.by == SHARED_LOAD for role in build.variables.roles)
    return driven(build, "f") or (shares and driven(build, "t_n"))


def _hold_at_zero(build: Build, law: RateLaw) -> None:
    """Fix a force of zero as a number, since a law without a length omits the work of any other force."""
    load = build.scene.loading.get("f")
    if isinstance(load, Load) and getattr(load, "level", None) == 0.0:
        build.parameters.constants[f"{load.path}.level"] = (dict(load.specs())["level"], 0.0)
        return
    remedy = "Write it as two reactions with `=>`, each with its own distance to the transition state"
    if "x_on" in dict(law.specs()):
        remedy = "Give `x_on`, 0 m where formation does not feel the force"
    problem = "would come to the same equilibrium under any prescribed force"
    reason = "its rate feels the force, but how far a bond lets the load down as it forms is not known"
    raise InputError(f"{law.title} {problem}: {reason}. {remedy}.", law.place)


def by_affinity(law: RateLaw) -> bool:
    """True if a law's rate depends on an affinity that includes the work of a force."""
    return law.length is not None or "mu" in reads(law.statement)


def lengths(laws: Mapping[str, RateLaw], pairs: Sequence[Opposed]) -> dict[str, Expression]:
    """Return the displacement of the load on formation of a bond of each species [m], as far as pairs determine it."""
    known = [pair.known_length for pair in pairs if pair.known_length is not None]
    known += [(law.stoichiometry(), law.length) for law in laws.values() if law.length is not None]
    names = list(dict.fromkeys(name for change, _ in known for name in change))
    both_ways = [law.stoichiometry() for law in laws.values() if law.balanced and not by_affinity(law)]
    changes = _matrix(names, [change for change, _ in known])
    return {
        name: sum(float(c) * x for c, (_, x) in zip(row, known, strict=True) if abs(c) > RUN_EPS)
        for name, row in zip(names, _inverse(changes, _matrix(names, both_ways)), strict=True)
    }


def _matrix(names: Sequence[str], changes: Sequence[Mapping[str, int | float]]) -> Array:
    rows = [[change.get(name, 0) for name in names] for change in changes]
    return np.array(rows, dtype=float).reshape(len(rows), len(names))


def _inverse(changes: Array, kept: Array) -> Array:
    """Return lengths per difference of distance, shape (species, pairs), with none in the reactions ``kept``."""
    if not np.any(kept):
        return np.asarray(np.linalg.pinv(changes))
    _, sizes, rows = np.linalg.svd(kept)
    # Null space of the kept reactions: lengths in it sum to zero over each of them.
    basis = rows[int(np.sum(sizes > RUN_EPS)) :].T
    left = changes @ basis
    left[np.abs(left) < RUN_EPS] = 0.0
    return np.asarray(basis @ np.linalg.pinv(left)) if basis.size else np.zeros(changes.T.shape)
