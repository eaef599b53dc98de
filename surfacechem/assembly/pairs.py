"""Reactions that run one way only and undo each other: whether the two agree with the equilibrium of the potential."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from surfacechem.assembly.build import Build
from surfacechem.expressions import Expression, log_sum, where
from surfacechem.quantities import BOLTZMANN, Quantity
from surfacechem.system import Pair
from surfacechem.terms import RateLaw

LEAST_COVERAGE = 1e-280
"""A vanished coverage counts as this, where its logarithm still cancels from rates and chemical potentials."""


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
    one_way = {label: law for label, law in laws.items() if law.log_rate is not None}
    for label, law in one_way.items():
        change = law.stoichiometry()
        if not change or any(label in group.labels for group in groups):
            continue
        back = {name: -n for name, n in change.items()}
        forward = {name: other for name, other in one_way.items() if other.stoichiometry() == change}
        backward = {name: other for name, other in one_way.items() if other.stoichiometry() == back}
        if backward:
            groups.append(Opposed(change, forward, backward))
    return groups


def departure(build: Build, group: Opposed, mu: Mapping[str, Expression]) -> None:
    """Name ln(k_f / k_r) - ln K, which is what the rates lack to balance where the affinity vanishes."""
    T = build.variables.get("T_c", "the equilibrium of a reaction")
    affinity = sum(n * mu[name] for name, n in group.change.items())
    forward, backward = (_log_rate(build, laws.values()) for laws in (group.forward, group.backward))
    value = build.expanded(forward - backward + affinity / (BOLTZMANN * T))
    present = {
        bond.symbol: where(bond.symbol > LEAST_COVERAGE, bond.symbol, LEAST_COVERAGE) for bond in build.bonding.values()
    }
    text = f"ln(k_f/k_r) - ln K(g, T) of {group.title}"
    build.name(Quantity(f"departure_{group.label}", "1", text), value.subs(present))
    build.pairs.append(Pair(f"departure_{group.label}", group.title, group.label))


def _log_rate(build: Build, laws: Iterable[RateLaw]) -> Expression:
    return log_sum([build.variables.call(law, law.log_rate) for law in laws if law.log_rate is not None])
