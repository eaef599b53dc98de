r"""Limits of the normal traction: the interface is bonded until a threshold is reached, once.

.. math:: t_n \le t_n^{max}

The mode ``bonded`` ends when the traction exceeds the strength: the bonding state, or the bonds of a mechanism by the
reactions that break them, are lost at once, and a rigid interface opens. If the strength depends on the bonds, it
returns with them when the gap closes. Gaps without inertia or damper then find their equilibrium: in the same jump if
the bodies pay for the bonds, or in a second jump if the interface alone pays.

Source: Sauer, Duong & Mandadapu (2021), eq. e:debond.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import symengine

from surfacechem.contracts.terms import Law, Limit
from surfacechem.errors import InputError, suggestion
from surfacechem.expressions import Expression, depends, derivative, where
from surfacechem.model.automaton import ONE, ZERO, Constraint, Edge, Mode, Register
from surfacechem.model.build import Build
from surfacechem.model.components.mounting import law_reads, support

Stoichiometry = Mapping[str, int | float]

BONDED = Mode("bonded", 1.0, {0.0: "debonded", 1.0: "bonded"})
UNRELAXED = Register("loose", "whether the gaps have yet to follow a local jump")


def variables(build: Build) -> None:
    """Define the mode of bonding for potentials that read it; an interface without limits keeps its initial mode."""

    def bonded() -> Expression:
        start = next((mode.start for mode in build.constraint("closed").modes), None)
        if start is None and build.variables.has("g_n"):
            # An open gap without bonds starts debonded.
            start = where(build.variables.get("g_n", "the bonds", "interface") > 0, 0, 1)
            bonds = bonds_left(build)
            start = start if bonds is None else where(bonds > 0, 1, start)
        return build.constrain(Constraint((replace(BONDED, start=start),))).modes[0].symbol

    given = ("mode", "interface.limits") if build.interface.limits else ("internal", "no limit of the traction")
    build.variables.define("bonded", bonded, *given)


def bonds_left(build: Build) -> Expression | None:
    """Return the bonding state, before it is defined for the laws; None if there are no bonds."""
    if "phi" in build.bonding:
        return build.bonding["phi"].symbol
    bonds = [build.bonding[name].symbol for name in build.interface.bonds]
    return symengine.Add(*bonds) if bonds else None


def laws(build: Build) -> Iterator[Constraint]:
    """Yield the edges at which bonds break as the traction exceeds a limit, and at which they rejoin at touch."""
    closed, reclosing = build.mode("closed"), []
    for law in build.interface.limits:
        if not build.variables.has("t_n"):
            remedy = "mount the bodies (`mechanics`) or give a potential of the gap"
            raise InputError(f"nothing gives the normal traction: {remedy}.", law.place)
        bound = build.variables.bind(law, f"interface.limits.{law.name()}")
        build.law_domain(law, bound, {})
        strength = build.variables.call(bound, bound.statement)
        yield from _limit(build, law, strength, closed)
        symbols = build.expanded(strength).free_symbols
        reclosing.append(any(symengine.Symbol(name) in symbols for name in ("phi", *build.interface.bonds)))
    again = {build.variables.get("bonded", "the limit"): ONE} if reclosing and all(reclosing) else {}
    if closed is not None:
        build.closing_modes = {closed: ONE, **again}
    elif again and "g_n" in build.motion.gap_rates:
        # An elastic interface whose strength depends on its bonds can bond again once the gap has closed.
        gap = build.variables.get("g_n", "the limit", "interface")
        reason = "the gap closes, so that bonds can hold again"
        yield Constraint(edges=(Edge("rejoin", gap, reason, again, when=dict.fromkeys(again, (0,))),))


def _limit(build: Build, law: Limit, strength: Expression, closed: Expression | None) -> Iterator[Constraint]:
    """Yield the edge at which the bonds break and, for a local release, the edge at which the gaps follow."""
    t_n, bonded = build.variables.get("t_n", law), build.variables.get("bonded", law)
    local = law.release == "local"
    lost, when = [bonded], {bonded: (1,)}
    if closed is not None:
        # A rigid interface that has debonded and closed again bears pressure only.
        strength, when = bonded * strength, {closed: (1,)}
        lost, when = ([bonded], {bonded: (1,), **when}) if local else ([bonded, closed], when)
    modes, breaks, g = dict.fromkeys(lost, ZERO), broken(build, law, law.breaks), symengine.Symbol("g_n")
    if depends(build.psi, g) and not build.expanded(derivative(build.psi, g)).free_symbols & {*modes, *breaks}:
        names = " and ".join(item.name() for item in build.interface.potentials if law_reads(item, "g_n"))
        problem = f"{law.name()} would change nothing: the tension of {names} does not depend on the bonds"
        remedy = "use `bonded-contact` or `bond-stiffness`, or the factor `proportional: {of: phi}`"
        raise InputError(f"{problem}. Let it: {remedy}.", law.place)
    # In a local release the interface pays for the bonds; the gaps then move in a second jump, for which the bodies
    # pay.
    mount = support(build, "n")
    normal = mount is not None and mount.quasi_static and "g_n" in build.motion.gap_rates
    follow = local and (normal or any(slip.in_equilibrium for slip in build.motion.slips))
    if follow:
        modes[UNRELAXED.symbol] = ONE
        reason, due = "the gap follows what gave way", {UNRELAXED.symbol: (1,)}
        relax = Edge("relax", -ONE, reason, {UNRELAXED.symbol: ZERO}, equilibrates=True, when=due)
        yield Constraint(registers=(UNRELAXED,), edges=(relax,), at_once=True)
    debond = Edge(
        "debond",
        strength - t_n,
        "the interface debonds as its tensile strength is reached",
        modes,
        breaks,
        equilibrates=not follow,
        heat=law.release,
        violation=law.violation,
        when=when,
    )
    yield Constraint(edges=(debond,))


def broken(build: Build, law: Law, named: str = "") -> dict[Expression, Expression]:
    """Return the new values of the bonding variables when all bonds, or the bond ``named``, break at once."""
    bonds, bonding = build.interface.bonds, build.bonding
    if not bonds:
        if named:
            message = f"{law.name()} breaks '{named}', but the bonds are not species of a mechanism."
            raise InputError(message, law.place)
        return {bonding["phi"].symbol: ZERO} if "phi" in bonding else {}
    lost = list(bonds)
    if named:  # by its species, or by the variable
        texts = {item.name: item.long_name.removeprefix("coverage of ") for item in build.interface.variables}
        species = {texts[bond]: bond for bond in bonds} | {bond: bond for bond in bonds}
        if named not in species:
            known = suggestion(named, [*species][: len(bonds)])
            raise InputError(f"{law.name()}: no bond is called '{named}'.{known}", law.place)
        lost = [species[named]]
    changes: dict[str, Expression] = {}
    for name in lost:
        nu = _rupture(build, law, name)
        extent = bonding[name].symbol * bonding[name].density / -nu[name]
        for other, n in nu.items():
            changes[other] = changes.get(other, 0) + n * extent / bonding[other].density
    return {bonding[x].symbol: ZERO if x in lost else bonding[x].symbol + change for x, change in changes.items()}


def _rupture(build: Build, law: Law, name: str) -> Stoichiometry:
    """Return the stoichiometry of rupture per bond: the first reaction of the bond whose products are no bonds."""
    bonds, ways = build.interface.bonds, []
    for nu in (reaction.stoichiometry() for reaction in build.interface.reactions):
        if nu.get(name):
            per_bond = {x: -n / nu[name] for x, n in nu.items() if n}
            if not any(per_bond.get(bond, 0) > 0 for bond in bonds):
                ways.append(per_bond)
    if not ways:
        message = f"{law.name()} breaks bonds at once, but no reaction says what {name} breaks into."
        raise InputError(message, law.place)
    if any(nu != ways[0] for nu in ways[1:]):
        products = " + ".join(x for x, n in ways[0].items() if n > 0)
        build.add(f"{law.name()} breaks {name} into {products}, by the first of the reactions that break it.")
    return ways[0]
