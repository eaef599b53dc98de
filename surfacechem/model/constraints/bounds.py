"""Bounds of the bonding state: where a law would carry it beyond, it is held there until the law turns round.

Holding does no work and takes no energy: bonds that are not there cannot break, and sites that are taken bond no
partner. A law that cannot leave the range by its form needs none of this.

Source: unilateral bounds of the bonding fraction, Sauer, Duong & Mandadapu (2021), section 3.1.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import symengine

from surfacechem.expressions import Expression, where
from surfacechem.model.automaton import Edge
from surfacechem.model.build import Build
from surfacechem.model.components.logarithms import LOGARITHM
from surfacechem.model.constraints.active_bounds import Decision
from surfacechem.quantities import Quantity

INSIDE = 1e-15
"""Distance from a bound, in parts of the range, at which the law there is asked which way it points.

An equilibrium that lies nearer, as that of bonds with mixing entropy under a large load does, is one at the bound.
"""

SINGULAR = type(symengine.zoo), type(symengine.nan), type(symengine.oo)

HELD_AT = {-1.0: "held at zero", 0.0: "between its bounds", 1.0: "held at its upper bound"}


@dataclass(frozen=True)
class Bound:
    """A bound of the bonding state, and the rate at which a law would carry it beyond."""

    side: int
    value: Expression
    gap: Expression
    """Distance from the bound."""
    beyond: Expression
    """Rate of bonding next to the bound, positive outwards [1/(m^2 s)]."""
    words: tuple[str, str, str, str]
    """Name and reason of the transition to the bound and of the one away from it."""


def free_to_react(build: Build, rate: Expression) -> Expression:
    """One while the bonding state is free, zero while it is held at a bound; ``rate`` is what would change it."""
    top = next((p.value for p in build.parameters.items if p.path == "phi_max"), None)
    if top is None or LOGARITHM in build.scene.initial:
        return symengine.Integer(1)
    build.decision = Decision(build, rate, top)
    sides = build.decision.usual if build.sides is None else build.sides
    if not sides:
        return symengine.Integer(1)
    words = {value: text for value, text in HELD_AT.items() if value == 0 or value in sides}
    held = build.mode("held", 0.0, words)
    for side, made in ((-1, _lower), (1, _upper)):
        if side in sides:
            bound = made(build, rate)
            _hold(build, held, bound)
            _let_go(build, held, bound)
    return 1 - held**2


def _lower(build: Build, rate: Expression) -> Bound:
    phi, limit = symengine.symbols("phi phi_max")
    words = ("unbonded", "no bond is left", "rebond", "bonds form again")
    return Bound(-1, symengine.Integer(0), phi, -_rate_at(build, rate, INSIDE * limit, words[0]), words)


def _upper(build: Build, rate: Expression) -> Bound:
    phi, limit = symengine.symbols("phi phi_max")
    words = ("complete", "bonding is complete", "loosen", "bonds begin to break")
    return Bound(1, limit, limit - phi, _rate_at(build, rate, (1 - INSIDE) * limit, words[0]), words)


def _rate_at(build: Build, rate: Expression, phi: Expression, name: str) -> Expression:
    """The rate as it would be at a value of the bonding state, by name; as it is where it has none there."""
    at: dict[Any, Expression] = {symengine.Symbol("phi"): phi}
    if build.expanded(rate).subs(at).atoms(*SINGULAR):
        return rate
    needed = _read(build, rate)
    for item in [item for item in build.named if item.name in needed]:
        there = symengine.sympify(item.expression).subs(at)
        if there != item.expression:
            quantity = replace(item.quantity, name=f"{item.name}_{name}")
            at[symengine.Symbol(item.name)] = build.name(quantity, there, output=False)
    return build.name(Quantity(f"R_{name}", "1/(m^2 s)", "net rate at the bound"), rate.subs(at), output=False)


def _read(build: Build, expression: Expression) -> set[str]:
    """Names of the quantities that an expression reads, also through others."""
    found = {str(symbol) for symbol in expression.free_symbols}
    for item in reversed(build.named):
        if item.name in found:
            found |= {str(symbol) for symbol in symengine.sympify(item.expression).free_symbols}
    return found


def _hold(build: Build, held: Expression, bound: Bound) -> None:
    # Where the law points inwards no bound is needed: what rounding has carried beyond comes back by itself.
    margin = where(bound.beyond > 0, bound.gap, 1)
    name, reason, *_ = bound.words
    modes, jump = {held: symengine.Integer(bound.side)}, {symengine.Symbol("phi"): bound.value}
    build.edges.append(Edge(name, margin, reason, modes, jump, measure="phi", when={held: (0,)}))


def _let_go(build: Build, held: Expression, bound: Bound) -> None:
    density = build.bonding["phi"].density
    turned = build.stretch * bound.beyond / density
    *_, name, reason = bound.words
    free = {held: symengine.Integer(0)}
    build.edges.append(Edge(name, turned, reason, free, when={held: (bound.side,)}))


def released(build: Build) -> None:
    """Transitions that break bonds at once free the bonding state from a bound that held it."""
    held = next((mode.symbol for mode in build.modes if mode.name == "held"), None)
    phi = symengine.Symbol("phi")
    if held is None:
        return
    for j, item in enumerate(build.edges):
        if phi in item.reset and held not in item.modes:
            build.edges[j] = replace(item, modes={**item.modes, held: symengine.Integer(0)})
