r"""Bonding: chemical potentials, rates, bond balances and what the reactions dissipate.

A reaction that takes :math:`-\nu_j` molecules of the species j of an adjacent phase brings the enthalpy
:math:`-\sum_j \nu_j h_j` and the entropy :math:`-\sum_j \nu_j s_j` to the interface, and its affinity contains
:math:`-\sum_j \nu_j \mu_j`. The phase is at the temperature of the interface, so that nothing is lost on the way.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import symengine

from surfacechem.contracts.terms import RateLaw
from surfacechem.expressions import Expression, absolute, depends, derivative, exponents, where
from surfacechem.model.balances import DISSIPATION, HEAT, INTERFACE, OUTSIDE, Power
from surfacechem.model.build import Build
from surfacechem.model.components.force import RESOLUTION, SHARED
from surfacechem.model.components.mounting import law_reads
from surfacechem.model.components.pulled import book_work, by_affinity, dead_load
from surfacechem.model.constraints.bound import free_to_react
from surfacechem.model.constraints.closing import TOUCHING
from surfacechem.model.constraints.softening import softening, within_reach
from surfacechem.model.pairs import departure, opposed, own_departure
from surfacechem.model.parts import Bond
from surfacechem.model.system import Account, Capped, Caution
from surfacechem.quantities import Quantity

MARGIN = 4
"""How much faster than bonds count as ruptured they may still break."""


def reactions(build: Build) -> Iterator[Power]:
    """Chemical potentials, rates, bond balances and what the reactions dissipate."""
    mu = {name: _chemical_potential(build, name, bond) for name, bond in build.bonding.items()}
    change = {name: symengine.Integer(0) for name in build.bonding}
    laws = {build.label(law): _bound(build, law) for law in build.interface.reactions}
    for law in build.interface.reactions:
        build.law_ranges(law)
    pairs = opposed(laws)
    together = {label: pair.label for pair in pairs for label in pair.labels}
    load = dead_load(build, laws, pairs)
    loaded = {name: value + load.get(name, 0) for name, value in mu.items()}
    pulled = {label: law for label, law in laws.items() if label in together or by_affinity(law)}
    affinities = {label: _affinity(build, law, loaded if label in pulled else mu) for label, law in laws.items()}
    others = {label: law for label, law in laws.items() if not hasattr(law, "envelope")}
    stated = {label: _rate(build, law, affinities[label]) for label, law in others.items()}
    rates = {label: _resolved(build, others, stated, label) for label in others}
    forming = symengine.Add(*(law.stoichiometry().get("phi", 0) * rates[label] for label, law in others.items()))
    free = _free(build, forming)
    rates |= {label: softening(build, law, forming, free) for label, law in laws.items() if label not in others}
    named: dict[str, Expression] = {}
    dissipated: dict[str, Expression] = {}
    for label, law in laws.items():
        nu, affinity = law.stoichiometry(), affinities[label]
        quantity = Quantity(f"R_{label}", "1/(m^2 s)", f"net rate of {law.title}", tag="e:R")
        formed = rates[label] * free if "phi" in nu and label in others else rates[label]
        rate = named[label] = build.name(quantity, formed)
        # Of two one-way reactions one always runs uphill; what they dissipate together is what counts.
        owner = together.get(label, label)
        dissipated[owner] = dissipated.get(owner, 0) - build.stretch * rate * affinity
        for x, n in nu.items():
            change[x] += n * rate
        _across_an_open_gap(build, law, rate)
        own_departure(build, label, law, affinity)
    for owner, power in dissipated.items():
        yield Power(DISSIPATION, INTERFACE, INTERFACE, power, owner)
    yield from supplied(build, laws, named)
    yield from book_work(build, pulled, named, load)
    for pair in pairs:
        departure(build, pair, loaded)
    for name, bond in build.bonding.items():
        build.rows.sites(name, change[name], bond.density, build.stretch)
        formed = Quantity(f"formed_{name}", "1", f"change of {name} by all reactions")
        build.ledger.append(Account(formed, bond.dot - build.rows[name], "bonds", name))
    yield from _prescribed_bonding(build)


def _across_an_open_gap(build: Build, law: RateLaw, rate: Expression) -> None:
    """Tell where bonds form across an open gap at a rate that does not feel it."""
    bonds = {"phi", *build.interface.bonds}
    formed = sum(n for x, n in law.stoichiometry().items() if x in bonds)
    if not formed or not build.variables.has("g_n") or law_reads(law, "bonded"):
        return
    g_n = build.variables.get("g_n", law)
    if build.expanded(rate).free_symbols & build.expanded(g_n).free_symbols - {build.t}:
        return
    text = (
        f"{law.title} forms bonds across an open gap, which it does not read. Where they form in contact only let its "
        "rate fall with the gap, by `gap-attachment` or a factor of g_n"
    )
    build.cautions.append(Caution(where(g_n > TOUCHING, -formed * rate, 0), text))


def _affinity(build: Build, law: RateLaw, mu: Mapping[str, Expression]) -> Expression:
    """Gibbs energy of a reaction, what it takes from neighbours included."""
    own = sum(n * mu[x] for x, n in law.stoichiometry().items())
    return own - affinity_taken(build, law) if law.taken else own


def _potential_per_area(build: Build, name: str, symbol: Any) -> Expression:
    quantity = Quantity(
        "M" if name == "phi" else f"M_{name}", "J/m^2", f"chemical potential of {name} per area", tag="e:SMuc"
    )
    return build.name(quantity, derivative(build.psi, symbol))


def _chemical_potential(build: Build, name: str, bond: Bond) -> Expression:
    M = _potential_per_area(build, name, bond.symbol)
    if name == "phi":
        return build.name(Quantity("mu", "J", "chemical potential per bond", tag="e:muc"), M / bond.density)
    quantity = Quantity(f"mu_{name}", "J", f"chemical potential of {name} per site", tag="e:muc")
    return build.name(quantity, M / bond.density, output=False)


def _bound(build: Build, law: RateLaw) -> RateLaw:
    return build.variables.bind(law, f"interface.bonding.{law.name()}")


def _free(build: Build, forming: Expression) -> Expression:
    """One while the bonding state may change, zero at a bound and beyond the reach of bonds.

    Only what bonds form by may carry them beyond; a law with an envelope ends at its bound by itself.
    """
    if "phi" not in build.bonding or forming == 0:
        return symengine.Integer(1)
    return within_reach(build) * free_to_react(build, forming)


def _rate(build: Build, law: RateLaw, affinity: Expression) -> Expression:
    own = {"mu": affinity, "t": build.t}
    if "phi" in build.bonding:
        bond = build.bonding["phi"]
        own["dmu_dphi"] = derivative(derivative(build.psi, bond.symbol), bond.symbol) / bond.density
    build.refuse_never_positive(law, own)
    rate = build.variables.call(law, law.statement, own)
    build.law_margins(law, own)
    if found := exponents(rate):
        build.capped.append(Capped(law.title, tuple(found)))
    return rate


def _resolved(build: Build, laws: Mapping[str, RateLaw], rates: Mapping[str, Expression], label: str) -> Expression:
    """A rate under load that relaxes no faster than time resolves, both ways alike: faster is at once in any case.

    It stays far faster than all else that changes the same species, so that what they share out does not depend on it.
    """
    law, rate = laws[label], rates[label]
    loads = {symengine.Symbol(name) for name in ("g_n", "f", *(f"f_{name}" for name in build.bonding))}
    if any(role.by == SHARED and build.variables.was_read(role.variable) for role in build.variables.roles):
        return rate  # bonds that share a load rupture, which ends the run before
    if not any(loads & exponent.free_symbols for exponent in exponents(rate)):
        return rate
    own = law.stoichiometry()
    relaxation = _relaxation(build, own, law, rate)
    if relaxation == 0:
        return rate
    others = (absolute(_relaxation(build, own, laws[other], rates[other])) for other in laws if other != label)
    quantity = Quantity(f"steps_{label}", "1", f"relaxations of {law.title} within what time resolves")
    steps = build.name(quantity, relaxation * (build.t * RESOLUTION / MARGIN), output=False)
    allowed = 1 + sum(others) * (build.t / MARGIN)
    return rate * where(steps > allowed, allowed / steps, 1)


def _relaxation(build: Build, names: Iterable[str], law: RateLaw, rate: Expression) -> Expression:
    """How fast a law brings back the variables of these names that it changes [1/s]."""
    changes = ((build.bonding[name], nu) for name, nu in law.stoichiometry().items() if name in names)
    return sum((-nu * derivative(rate, bond.symbol) / bond.density for bond, nu in changes), symengine.Integer(0))


def _prescribed_bonding(build: Build) -> Iterator[Power]:
    phi = symengine.Symbol("phi")
    if "phi" in build.bonding or not depends(build.psi, phi):
        return
    M = _potential_per_area(build, "phi", phi)
    rate = build.rate_of("phi")
    if rate != 0:
        yield Power(DISSIPATION, INTERFACE, INTERFACE, -M * rate, "prescribed_bonding")


NEIGHBOURS = "neighbours"


def affinity_taken(build: Build, law: RateLaw) -> Expression:
    """Gibbs energy [J] that one reaction takes from neighbours."""
    return build.variables.call(law, law.taken[1]) if law.taken else symengine.Integer(0)


def supplied(build: Build, laws: Mapping[str, RateLaw], rates: Mapping[str, Expression]) -> Iterator[Power]:
    """Book the enthalpy and the entropy that reactions take from neighbours; the interface gets the enthalpy."""
    heat, entropy = [], []
    for label, law in laws.items():
        if law.taken:
            h, g = (build.variables.call(law, formula) for formula in law.taken)
            heat.append(build.stretch * rates[label] * h)
            entropy.append(build.stretch * rates[label] * (h - g))
    if not heat:
        return
    text = "enthalpy of what reactions take from neighbours"
    power = build.name(Quantity("q_n", "W/m^2", text), symengine.Add(*heat))
    T = build.variables.get("T_c", "the neighbours")
    with_it = symengine.Add(*entropy) / T
    yield Power(HEAT, OUTSIDE, INTERFACE, power, f"H_{NEIGHBOURS}", text, entropy=with_it)
