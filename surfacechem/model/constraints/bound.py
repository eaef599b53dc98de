r"""Bounds of the bonding state: :math:`0 \le \phi \le \phi_{max}`, a differential inclusion.

.. math:: N_c\,\dot\phi \in J_c R - \mathcal{N}_{[0, \phi_{max}]}(\phi)

with the normal cone :math:`\mathcal{N}` of the interval: if a law would carry phi beyond a bound, phi is held there
until the rate points inwards. The constraint does no work and takes no energy, since absent bonds cannot break and
occupied sites cannot bond. A law that declares ``keeps_range`` needs no bounds.

Source: unilateral bounds of the bonding fraction, Sauer, Duong & Mandadapu (2021), section 3.1; projected dynamics as
in Acary & Brogliato (2008), Numerical Methods for Nonsmooth Dynamical Systems, doi 10.1007/978-3-540-75392-6.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import symengine

from surfacechem.contracts.terms import RateLaw, reads
from surfacechem.expressions import Expression, derivative, magnitude, where
from surfacechem.model.automaton import Constraint, Edge, Mode
from surfacechem.model.build import Build
from surfacechem.model.components.interface import LN_PHI
from surfacechem.model.system import Caution
from surfacechem.quantities import Quantity
from surfacechem.tolerances import BOUND_EPS, EPS, FRACTION_FLOOR, LEAST_COVERAGE

NOT_NUMBERS = type(symengine.zoo), type(symengine.nan), type(symengine.oo)

PHI, PHI_MAX = symengine.symbols("phi phi_max")
BOUND_WORDS = {-1.0: "held at zero", 0.0: "between its bounds", 1.0: "held at its upper bound"}
BOUNDS = (
    (-1, symengine.Integer(0), BOUND_EPS * PHI_MAX, "unbonded", "no bond is left", "rebond", "bonds form again"),
    (1, PHI_MAX, (1 - BOUND_EPS) * PHI_MAX, "complete", "bonding is complete", "loosen", "bonds begin to break"),
)
"""Side and value of each bound, the value next to it, names and reasons of the edges to the bound and away from it."""


def bound(build: Build, rate: Expression) -> Constraint:
    """Return the bounds of the bonding state as a constraint; ``rate`` is its rate without bounds."""
    if not _may_leave_the_range(build):
        return Constraint()
    outward = {side: side * _rate_at(build, rate, at, inside, name) for side, at, inside, name, *_ in BOUNDS}
    bounds = [bound for bound in BOUNDS if outward[bound[0]] != 0]
    if not bounds:
        return Constraint()
    sides = {0, *(side for side, *_ in bounds)}
    mode = Mode("held", 0.0, {side: text for side, text in BOUND_WORDS.items() if side in sides})
    held, edges = mode.symbol, []
    for side, at, _, name, reason, back, why in bounds:
        # If the law points inwards no bound is needed: a state that roundoff has carried beyond comes back.
        left = where(outward[side] > 0, side * (at - PHI), 1)
        turned = build.stretch * outward[side] / build.bonding["phi"].density
        modes, free = {held: symengine.Integer(side)}, {held: symengine.Integer(0)}
        edges += [
            Edge(name, left, reason, modes, {PHI: at}, measure="phi", when={held: (0,)}),
            Edge(back, turned, why, free, when={held: (side,)}),
        ]

    def breaking(edge: Edge) -> dict[Expression, Expression]:
        """Return the new mode along an edge at which bonds break at once: a bound no longer holds the bonding state."""
        return {held: symengine.Integer(0)} if PHI in edge.reset and held not in edge.modes else {}

    return Constraint((mode,), edges=tuple(edges), active=1 - held**2, resets=breaking)


def bending(build: Build, law: RateLaw, mu: Expression) -> tuple[Expression, Expression]:
    """Return the derivative of the chemical potential by the bonding state as a numerator and a denominator.

    The denominator alone is zero where ideal mixing bends without bound: where no bond, or no free site, is left. Both
    have finite derivatives, unlike the quotient and its inverse. A law of this derivative relaxes the logarithm of phi,
    so that any number of bonds next to none is resolved; where it stays at a bound a caution is given.
    """
    zero, under = symengine.Integer(0), symengine.Integer(1)
    bends = derivative(derivative(build.psi, PHI), PHI) / build.bonding["phi"].density
    poles = {p: p.args[1] for p in bends.atoms(symengine.Piecewise) if p.args[1].args[0] == FRACTION_FLOOR}
    over = rest = bends.xreplace(dict.fromkeys(poles, zero))
    for pole, condition in sorted(poles.items(), key=str):
        fraction = condition.args[1]
        residue = bends.xreplace({**dict.fromkeys(poles, zero), pole: pole.args[0] * fraction}) - rest
        side = where(condition, fraction, 0)
        over, under = over * side + under * residue, under * side
    if poles:
        build.states[:] = [replace(s, finest=LEAST_COVERAGE) if s.symbol == PHI else s for s in build.states]
        low, high = (build.expanded(mu).subs({PHI: inside}) for _, _, inside, *_ in BOUNDS)
        text = f"{law.title} does not leave a bound of phi, where ideal mixing bends without bound: start beside it"
        build.add(Caution(where(under > 0, 1, where(PHI > PHI_MAX / 2, -high, low)), text))
    return over, under


def _may_leave_the_range(build: Build) -> bool:
    """True if a law without an envelope may carry the bonding state out of its range."""
    if "phi" not in build.bonding or LN_PHI in build.scene.initial:
        return False
    laws, even = [law for law in build.interface.reactions if law.envelope is None], build.interface.is_even
    return not all(law.keeps_range and (even or "n_2" in reads(law.statement)) for law in laws)


def _is_singular(whole: Expression, phi: Expression, numbers: Mapping[Any, float]) -> bool:
    """True if a rate has a pole, or the logarithm of zero up to roundoff, at a bonding state."""

    def has_none(argument: Expression) -> bool:
        try:
            both = [x.subs(numbers) for x in (argument, magnitude(argument))]
            if any(x.free_symbols for x in both):
                return False
            # Within one rounding it is zero; at BOUND_EPS next to a bound it is larger.
            return any(x.atoms(*NOT_NUMBERS) for x in both) or abs(float(both[0])) <= 0.5 * EPS * float(both[1])
        except RuntimeError:  # a condition on an undefined number, or no number
            return True

    arguments = (logarithm.args[0].subs({PHI: phi}) for logarithm in whole.atoms(symengine.log))
    return bool(whole.subs({PHI: phi}).atoms(*NOT_NUMBERS)) or any(map(has_none, arguments))


def _rate_at(build: Build, rate: Expression, at: Expression, inside: Expression, name: str) -> Expression:
    """Return the rate at a bound, or next to it if it is singular there; the rate unchanged if both fail."""
    whole, numbers = build.expanded(rate), {PHI_MAX: build.interface.phi_max}
    numbers |= {item.symbol: item.value for item in build.parameters.items}
    phi = next((phi for phi in (at, inside) if not _is_singular(whole, phi, numbers)), None)
    if phi is None:
        return rate
    rests = phi is inside and whole.subs({PHI: at}).subs({PHI_MAX: numbers[PHI_MAX]}).is_zero
    if rests or whole.subs({PHI: phi}) == 0:
        return symengine.Integer(0)
    # The quantities that the rate reads, directly or through others, are named at the bound too, so that common
    # subexpressions stay common there.
    needed = set(map(str, rate.free_symbols))
    for item in reversed(build.named):
        if item.name in needed:
            needed.update(map(str, symengine.sympify(item.expression).free_symbols))
    put: dict[Any, Expression] = {PHI: phi}
    for item in [item for item in build.named if item.name in needed]:
        value = symengine.sympify(item.expression).subs(put)
        if value != item.expression:
            quantity = item.quantity._replace(name=f"{item.name}_{name}")
            put[symengine.Symbol(item.name)] = build.name(quantity, value, output=False)
    return build.name(Quantity(f"R_{name}", "1/(m^2 s)", "net rate at the bound"), rate.subs(put), output=False)
