"""Rates forward and backward that are stated apart: whether they agree with the equilibrium of the potential."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from surfacechem.contracts.terms import RateLaw
from surfacechem.expressions import Expression, depends, log_sum, where
from surfacechem.model.build import Build
from surfacechem.model.system import Pair
from surfacechem.quantities import BOLTZMANN, Quantity

LEAST_COVERAGE = 1e-280
"""A vanished coverage counts as this, where its logarithm still cancels from rates and chemical potentials."""

LARGEST_COVERAGE = 1 - 1e-15
"""A full coverage counts as this, for the logarithm of what is left."""


@dataclass(frozen=True)
class Opposed:
    """One-way laws, by label, that change the bonding variables by ``change``, and those that change them back."""

    change: Mapping[str, int | float]
    forward: Mapping[str, RateLaw]
    backward: Mapping[str, RateLaw]

    @property
    def labels(self) -> tuple[str, ...]:
        """Labels of all of them."""
        return (*self.forward, *self.backward)

    @property
    def label(self) -> str:
        """Short name for the quantities that belong to all of them."""
        return "_".join(self.labels)

    @property
    def title(self) -> str:
        """The reaction both ways."""
        first = next(iter(self.forward.values()))
        return first.title.replace(" => ", " <=> ")


def opposed(laws: Mapping[str, RateLaw]) -> list[Opposed]:
    """The one-way laws that have a counterpart; all that share a stoichiometry belong together."""
    groups: list[Opposed] = []
    one_way = {label: law for label, law in laws.items() if law.one_way}
    for label, law in one_way.items():
        change = law.turnover()
        if not change or any(label in group.labels for group in groups):
            continue
        back = {name: -n for name, n in change.items()}
        forward = {name: other for name, other in one_way.items() if other.turnover() == change}
        backward = {name: other for name, other in one_way.items() if other.turnover() == back}
        if backward:
            groups.append(Opposed(change, forward, backward))
    return groups


def departure(build: Build, group: Opposed, mu: Mapping[str, Expression]) -> None:
    """Name what the rates of one-way laws lack to balance where the affinity vanishes; rates from outside are not."""
    if any(law.log_rate is None for law in (*group.forward.values(), *group.backward.values())):
        return
    forward, backward = (_log_rate(build, laws.values()) for laws in (group.forward, group.backward))
    affinity = sum(n * mu[name] for name, n in group.change.items())
    _name(build, group.label, f"{group.title} (pair)", forward - backward, affinity)


def own_departure(build: Build, label: str, law: RateLaw, affinity: Expression) -> None:
    """The same for a law that states its rates both ways, where the potential knows of the reaction at all."""
    known = any(depends(build.psi, build.bonding[name].symbol) for name in law.stoichiometry())
    if law.log_ratio is not None and known:
        _name(build, label, law.title, build.variables.call(law, law.log_ratio), affinity)


def _name(build: Build, label: str, title: str, log_ratio: Expression, affinity: Expression) -> None:
    T = build.variables.get("T_c", "the equilibrium of a reaction")
    value = build.expanded(log_ratio + affinity / (BOLTZMANN * T))
    inside = {bond.symbol: _inside(bond.symbol) for bond in build.bonding.values()}
    quantity = Quantity(f"departure_{label}", "1", f"ln(k_f/k_r) - ln K(g, T) of {title}")
    build.name(quantity, value.subs(inside))
    build.pairs.append(Pair(quantity.name, title, label))


def _inside(coverage: Expression) -> Expression:
    """The coverage, within bounds where its logarithm and that of its complement exist."""
    below = where(coverage < LARGEST_COVERAGE, coverage, LARGEST_COVERAGE)
    return where(coverage > LEAST_COVERAGE, below, LEAST_COVERAGE)


def _log_rate(build: Build, laws: Iterable[RateLaw]) -> Expression:
    return log_sum([build.variables.call(law, law.log_rate) for law in laws if law.log_rate is not None])
