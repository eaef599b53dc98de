"""Bounds of the bonding state: where a law would carry it beyond, it is held there until the law turns round.

Holding does no work and takes no energy: bonds that are not there cannot break, and sites that are taken bond no
partner. A law that cannot leave the range by its form needs none of this.

Source: unilateral bounds of the bonding fraction, Sauer, Duong & Mandadapu (2021), section 3.1.
"""

from __future__ import annotations

from dataclasses import replace

import symengine

from surfacechem.assembly.build import Build
from surfacechem.assembly.enclosure import WHOLE, enclosure
from surfacechem.assembly.logarithms import LOGARITHM
from surfacechem.expressions import Expression, where
from surfacechem.system import Transition

COLDEST = 1e-9
"""Lowest temperature at which rates are looked at [K]."""

HELD_AT = {-1.0: "held at zero", 0.0: "between its bounds", 1.0: "held at its upper bound"}


def free_to_react(build: Build, rate: Expression) -> Expression:
    """One while the bonding state is free, zero while it is held at a bound; ``rate`` is what would change it."""
    top = next((p.value for p in build.parameters.items if p.path == "phi_max"), None)
    if top is None or LOGARITHM in build.scene.initial:
        return symengine.Integer(1)
    low, high = _at(build, rate, 0.0)[0] < 0, _at(build, rate, top)[1] > 0
    if not (low or high):
        return symengine.Integer(1)
    held = build.mode("held", 0.0, {value: text for value, text in HELD_AT.items() if value in (-low, 0.0, high)})
    phi, limit = symengine.symbols("phi phi_max")
    for side, bound, gap, words in (
        (-1, symengine.Integer(0), phi, ("unbonded", "no bond is left")),
        (1, limit, limit - phi, ("complete", "bonding is complete")),
    ):
        if side in (-low, high):
            _hold(build, held, side, words, margin=gap, bound=bound)
            _let_go(build, held, side, rate)
    return 1 - held**2


def _hold(
    build: Build, held: Expression, side: int, words: tuple[str, str], *, margin: Expression, bound: Expression
) -> None:
    reached = where(held**2 > 0, 1, margin)
    phi = symengine.Symbol("phi")
    build.transitions.append(Transition(words[0], reached, words[1], {held: symengine.Integer(side)}, {phi: bound}))


def _let_go(build: Build, held: Expression, side: int, rate: Expression) -> None:
    density = build.bonding["phi"].density
    turned = where(side * held > 0, side * build.stretch * rate / density, 1)
    name, reason = ("rebond", "bonds form again") if side < 0 else ("loosen", "bonds begin to break")
    build.transitions.append(Transition(name, turned, reason, {held: symengine.Integer(0)}))


def _at(build: Build, rate: Expression, phi: float) -> tuple[float, float]:
    """Interval of the rate at a value of the bonding state, whatever the other variables are."""
    known = {p.symbol: (p.value, p.value) for p in build.parameters.items if p.load is None}
    known |= {mode.symbol: (min(mode.words), max(mode.words)) for mode in build.modes}
    known |= {node.T: (COLDEST, WHOLE[1]) for node in build.nodes.values()}
    known |= dict.fromkeys(symengine.symbols("t J_c"), (0.0, WHOLE[1]))
    at = {symengine.Symbol("phi"): symengine.Integer(int(phi)) if phi == int(phi) else symengine.RealDouble(phi)}
    for item in build.named:
        if item.name != "J_c":
            at[symengine.Symbol(item.name)] = symengine.sympify(item.expression).subs(at)
    return enclosure(symengine.sympify(rate).subs(at), known)


def released(build: Build) -> None:
    """Transitions that break bonds at once free the bonding state from a bound that held it."""
    held = next((mode.symbol for mode in build.modes if mode.name == "held"), None)
    phi = symengine.Symbol("phi")
    if held is None:
        return
    for j, item in enumerate(build.transitions):
        if phi in item.jump and held not in item.modes:
            build.transitions[j] = replace(item, modes={**item.modes, held: symengine.Integer(0)})
