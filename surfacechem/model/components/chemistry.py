r"""Bonding: chemical potentials, reaction rates, bond balances and the dissipation of reactions.

A reaction that takes :math:`-\nu_j` molecules of the species j of an adjacent phase brings the enthalpy
:math:`-\sum_j \nu_j h_j` and the entropy :math:`-\sum_j \nu_j s_j` to the interface, and its affinity contains
:math:`-\sum_j \nu_j \mu_j`. The phase has the temperature of the interface, so that the transfer produces no entropy.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

import symengine

from surfacechem.contracts.terms import RateLaw
from surfacechem.errors import InputError
from surfacechem.expressions import Expression, absolute, depends, derivative, exponents, terms_of, where
from surfacechem.model.balances import DISSIPATION, HEAT, INTERFACE, OUTSIDE, WORK, PowerFlow
from surfacechem.model.build import Build
from surfacechem.model.components.force import SHARED_LOAD
from surfacechem.model.components.mounting import law_reads
from surfacechem.model.components.pairs import Opposed, by_affinity, dead_load, departure, opposed, own_departure
from surfacechem.model.constraints.bound import bending, bound
from surfacechem.model.constraints.envelope import softening
from surfacechem.model.constraints.unilateral import TOUCH_OVERLAP
from surfacechem.model.system import Account, CappedLaw, Caution, Margin, RatePair
from surfacechem.quantities import Quantity
from surfacechem.tolerances import TIME_EPS

NEIGHBOUR_HEAT = "H_neighbours"
"""Account of the enthalpy that reactions take from neighbours."""

RUPTURE_FACTOR = 4
"""Ratio of the fastest relaxation allowed under load to the loss rate at which bonds count as ruptured."""


class Reaction(NamedTuple):
    """A bound rate law with its affinity and the account of its dissipation."""

    label: str
    law: RateLaw
    affinity: Expression
    """Gibbs energy of reaction [J], including species taken from neighbours and the work of a prescribed force."""
    account: str
    """Label of the dissipation: of two opposed one-way reactions one always runs uphill, so their sum counts."""
    load: Expression
    """Contribution of a prescribed force to the affinity [J]."""
    rate: Expression = 0
    """Net rate per current area [1/(m^2 s)]."""


def laws(build: Build) -> Iterator[PowerFlow | Account | Caution | RatePair | Margin]:
    """Define chemical potentials, rates and bond balances; yield the powers of reactions."""
    yield from _beside(build)
    mu = _chemical_potentials(build)
    kinetics = {}
    for law in build.interface.reactions:
        kinetics[build.unique(law.label)] = bound = build.variables.bind(law, f"interface.bonding.{law.name()}")
        build.law_ranges(law, bound, {})
    pairs = opposed(kinetics)
    load = dead_load(build, kinetics, pairs)
    found = _with_rates(build, [_reaction(build, label, law, mu, load, pairs) for label, law in kinetics.items()])
    dissipated: dict[str, Expression] = {}
    for item in found:
        power = build.stretch * item.rate * item.affinity
        dissipated[item.account] = dissipated.get(item.account, 0) - power
        yield from _across_an_open_gap(build, item.law, item.rate)
        yield from own_departure(build, item.label, item.law, item.affinity)
    for account, power in dissipated.items():
        yield PowerFlow(DISSIPATION, INTERFACE, INTERFACE, power, account)
    yield from _from_neighbours(build, found)
    yield from _made(build, found)
    work = symengine.Add(*(-build.stretch * item.rate * item.load for item in found))
    if work != 0:
        yield PowerFlow(WORK, OUTSIDE, INTERFACE, work, "W_f", "work of the prescribed force on bonds")
    for pair in pairs:
        yield from departure(build, pair, {name: value + load.get(name, 0) for name, value in mu.items()})
    for name, bond in build.bonding.items():
        changes = (item.law.stoichiometry().get(name, 0) * item.rate for item in found)
        build.rows.sites(name, symengine.Add(*changes), bond.density, build.stretch)
        formed = Quantity(f"formed_{name}", "1", f"change of {name} by all reactions")
        yield Account(formed, bond.dot - build.rows[name], "bonds", name)
    phi = symengine.Symbol("phi")
    if "phi" not in build.bonding and depends(build.psi, phi):
        M, rate = _potential_per_area(build, "phi", phi, build.psi), build.rate_of("phi")
        if rate != 0:
            yield PowerFlow(DISSIPATION, INTERFACE, INTERFACE, -M * rate, "prescribed_bonding")


def _chemical_potentials(build: Build) -> dict[str, Expression]:
    """Return the chemical potential per bond or site [J], by bonding variable."""
    mu, terms = {}, terms_of(build.psi)
    for name, bond in build.bonding.items():
        psi = symengine.Add(*terms.get(bond.symbol, ()))
        M, single = _potential_per_area(build, name, bond.symbol, psi) / bond.density, name == "phi"
        text = f"chemical potential {'per bond' if single else f'of {name} per site'}"
        quantity = Quantity("mu" if single else f"mu_{name}", "J", text, tag="e:muc")
        mu[name] = build.name(quantity, M, output=single)
    return mu


def _potential_per_area(build: Build, name: str, symbol: symengine.Symbol, psi: Expression) -> Expression:
    label, text = "M" if name == "phi" else f"M_{name}", f"chemical potential of {name} per area"
    return build.name(Quantity(label, "J/m^2", text, tag="e:SMuc"), derivative(psi, symbol))


def _reaction(
    build: Build,
    label: str,
    law: RateLaw,
    mu: Mapping[str, Expression],
    load: Mapping[str, Expression],
    pairs: Sequence[Opposed],
) -> Reaction:
    nu = law.stoichiometry()
    account = next((pair.label for pair in pairs if label in pair.labels), label)
    pulled = account != label or by_affinity(law)
    potentials = {x: mu[x] + load[x] if pulled and x in load else mu[x] for x in nu}
    affinity = sum(n * potentials[x] for x, n in nu.items())
    if law.taken:
        affinity = affinity - build.variables.call(law, law.taken[1])
    added = symengine.Add(*(n * load[x] for x, n in nu.items() if pulled and x in load))
    return Reaction(label, law, affinity, account, added)


def _with_rates(build: Build, found: Sequence[Reaction]) -> list[Reaction]:
    """Return the reactions with their net rates as named quantities."""
    laws = {item.label: item.law for item in found if item.law.envelope is None}
    stated = {item.label: _rate(build, item.law, item.affinity) for item in found if item.label in laws}
    rates = stated | _resolved(build, laws, stated)
    forming = symengine.Add(*(law.stoichiometry().get("phi", 0) * rates[label] for label, law in laws.items()))
    # One while the bonding state may change; zero at a bound and while debonded. Laws without an envelope could carry
    # it over a bound; a law with an envelope ends there.
    free: Expression = symengine.Integer(1)
    if "phi" in build.bonding and forming != 0:
        free = build.constraint("debonding").active * build.constrain(bound(build, forming)).active
    for item in found:
        if item.label not in laws:
            envelope, rates[item.label] = softening(build, item.law, forming, free)
            for record in envelope:
                build.add(record)
        elif "phi" in item.law.stoichiometry():
            rates[item.label] *= free

    def named(item: Reaction) -> Expression:
        quantity = Quantity(f"R_{item.label}", "1/(m^2 s)", f"net rate of {item.law.title}", tag="e:R")
        return build.name(quantity, rates[item.label])

    return [item._replace(rate=named(item)) for item in found]


def _across_an_open_gap(build: Build, law: RateLaw, rate: Expression) -> Iterator[Caution]:
    """Yield a caution for a law that forms bonds across an open gap at a rate that is independent of the gap."""
    bonds = {"phi", *build.interface.bonds}
    formed = sum(n for x, n in law.stoichiometry().items() if x in bonds)
    if not formed or not build.variables.has("g_n") or law_reads(law, "bonded"):
        return
    g_n = build.variables.get("g_n", law)
    if build.expanded(rate).free_symbols & build.expanded(g_n).free_symbols - {build.t}:
        return
    remedy = "let its rate fall with the gap, by `gap-attachment` or a factor of g_n"
    problem = f"{law.title} forms bonds across an open gap, which it does not read"
    text = f"{problem}. Where they form in contact only {remedy}"
    yield Caution(where(g_n > TOUCH_OVERLAP, -formed * rate, 0), text)


def _rate(build: Build, law: RateLaw, affinity: Expression) -> Expression:
    own, room = {"mu": affinity, "t": build.t}, symengine.Integer(1)
    if law_reads(law, "dmu_dphi") and "phi" in build.bonding:
        bends, room = bending(build, law, affinity)
        own["dmu_dphi"] = bends / room
    for name in law.positive:  # a law that divides by an expression that is zero in this scene does not apply
        value = symengine.sympify(own[name] if name in own else build.variables.get(name, law))
        if value.is_Number and not value > 0:
            always = f"with the laws of this scene {name} is always {value}"
            raise InputError(f"{law.name()} holds for {name} > 0 only; {always}.", law.place)
    rate = build.variables.call(law, law.statement, own)
    build.law_margins(law, own | {"dmu_dphi": own.get("dmu_dphi", 0) * room})
    if law_reads(law, "f") and not depends(rate, symengine.Symbol("f")):
        unset = ", ".join(name for name, _ in law.specs() if vars(law)[name] == 0)
        build.add(f"{law.title} reads the force on bonds, but does not depend on it: without a value are {unset}.")
    if found := exponents(rate):
        build.add(CappedLaw(law.title, tuple(found)))
    return rate


def _resolved(build: Build, laws: Mapping[str, RateLaw], rates: Mapping[str, Expression]) -> dict[str, Expression]:
    """Return the rates whose exponents read a load, each limited to the fastest relaxation that time resolves.

    It then still relaxes at once, and far faster than other reactions that take the same species, so that the partition
    of the species between reactions does not depend on the limit. Both directions are limited alike: reactions that
    read loads and change the same species by one factor, so that their equilibrium stays.
    """
    loaded, limited = _loaded(build, rates), {}
    changed = {label: laws[label].stoichiometry().keys() for label in loaded}
    alike = {label: [name for name in loaded if changed[name] == changed[label]] for label in loaded}
    steps = {label: _steps(build, laws, rates, label, alike) for label in loaded}
    for label in loaded:
        together = sum(steps[name] for name in alike[label])
        limited[label] = rates[label] * where(together > 1, 1 / together, 1)
    return limited


def _steps(
    build: Build,
    laws: Mapping[str, RateLaw],
    rates: Mapping[str, Expression],
    label: str,
    alike: Mapping[str, Sequence[str]],
) -> Expression:
    """Return the relaxations of what a reaction takes in the least time that is resolved beside other reactions that
    take it; of these, one that is limited itself counts by its limit.
    """
    taken = [name for name in laws[label].stoichiometry() if depends(rates[label], build.bonding[name].symbol)]
    fast = _relaxation(build, taken, laws[label], rates[label])
    if fast == 0:
        return fast
    rest = [name for name in laws if name not in alike[label]]
    others = {name: absolute(_relaxation(build, taken, laws[name], rates[name])) for name in rest}
    slow = sum(others[name] for name in others if name not in alike) * (build.t / RUPTURE_FACTOR)
    for name in filter(alike.__contains__, others):
        own = others[name] * (build.t / RUPTURE_FACTOR)
        slow += where(own > 1 / TIME_EPS, 1 / TIME_EPS, own)
    quantity = Quantity(f"steps_{label}", "1", f"relaxations of {laws[label].title} in the least time that is resolved")
    return build.name(quantity, fast * (build.t * TIME_EPS / RUPTURE_FACTOR) / (1 + slow), output=False)


def _loaded(build: Build, rates: Mapping[str, Expression]) -> list[str]:
    """Return the labels of rates whose exponents read a load, other than one that bonds share: these rupture first,
    which ends the run.
    """
    if any(role.by == SHARED_LOAD and build.variables.was_read(role.variable) for role in build.variables.roles):
        return []
    loads = {symengine.Symbol(name) for name in ("g_n", "f", *(f"f_{name}" for name in build.bonding))}
    return [label for label, rate in rates.items() if any(loads & item.free_symbols for item in exponents(rate))]


def _relaxation(build: Build, names: Iterable[str], law: RateLaw, rate: Expression) -> Expression:
    """Return the relaxation rate that a law gives to the named variables [1/s]."""
    changes = ((build.bonding[name], nu) for name, nu in law.stoichiometry().items() if name in names)
    return sum((-nu * derivative(rate, bond.symbol) / bond.density for bond, nu in changes), symengine.Integer(0))


def _from_neighbours(build: Build, found: Sequence[Reaction]) -> Iterator[PowerFlow]:
    """Yield the enthalpy and the entropy that reactions take from neighbours."""
    heat, entropy = [], []
    for item in found:
        if item.law.taken:
            h, g = (build.variables.call(item.law, formula) for formula in item.law.taken)
            heat.append(build.stretch * item.rate * h)
            entropy.append(build.stretch * item.rate * (h - g))
    if heat:
        text = "enthalpy of what reactions take from neighbours"
        power = build.name(Quantity("q_n", "W/m^2", text), symengine.Add(*heat))
        S = symengine.Add(*entropy) / build.variables.get("T_c", "the neighbours")
        yield PowerFlow(HEAT, OUTSIDE, INTERFACE, power, NEIGHBOUR_HEAT, text, entropy=S)


def _beside(build: Build) -> Iterator[Margin]:
    """Define the histories of the neighbouring phases as variables; yield their limits."""
    if (engine := build.interface.engine) is None:
        return
    values = {}
    for quantity, history in engine.histories:
        values[quantity.name] = build.prescribe(quantity, history)
        build.variables.define(quantity.name, values[quantity.name], "prescribed", quantity.long_name)
    for name, expression, reason in engine.limits(values):
        yield Margin(name, expression, reason, path="interface.mechanism.neighbours")


def _made(build: Build, found: Sequence[Reaction]) -> Iterator[Account]:
    """Yield accounts of the species produced in neighbours, per area; name the electric current into each phase."""
    engine, made = build.interface.engine, dict[str, Expression]()
    for item in found:
        for species, nu in item.law.made.items():
            made[species] = made.get(species, 0) + nu * build.stretch * item.rate
    if engine is None or not made:
        return
    for species, total in made.items():
        name, text = engine.names[species], f"of {species} that reactions make, per reference area"
        rate = build.name(Quantity(f"production_{name}", "1/(m^2 s)", f"rate {text}"), total)
        yield Account(Quantity(f"made_{name}", "1/m^2", f"amount {text}"), rate, "production", species)
    for phase, charges in engine.charges.items():
        current = symengine.Add(*(charge * made[species] for species, charge in charges.items()))
        if charges:
            build.name(Quantity(f"i_{phase}", "A/m^2", f"current into {phase}, per reference area"), current)
