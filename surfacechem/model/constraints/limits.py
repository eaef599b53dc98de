"""Limits of the normal traction: the interface is bonded until it gives way."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import symengine

from surfacechem.contracts.terms import Limit
from surfacechem.errors import InputError
from surfacechem.expressions import Expression, depends, derivative, where
from surfacechem.model.automaton import Edge
from surfacechem.model.build import Build
from surfacechem.model.components.mounting import law_reads
from surfacechem.model.constraints.breaking import bonds_left, broken, follows_bonds

OPEN = "the interface debonds as its tensile strength is reached"


def bonded_mode(build: Build) -> None:
    """Whether the interface is bonded, for the potentials that ask; what nothing limits stays as it starts."""
    given = ("mode", "interface.limits") if build.interface.limits else ("internal", "no limit of the traction")
    build.variables.define("bonded", partial(_bonded, build), *given)


def _bonded(build: Build) -> Expression:
    return build.mode("bonded", 1.0, {0.0: "debonded", 1.0: "bonded"}, _starts_bonded(build))


def _starts_bonded(build: Build) -> Expression | None:
    """An open gap without bonds is not bonded."""
    closed = next((mode.start for mode in build.modes if mode.name == "closed"), None)
    if closed is not None or not build.variables.has("g_n"):
        return closed
    start = where(build.variables.get("g_n", "the bonds", "interface") > 0, 0, 1)
    bonds = bonds_left(build)
    return start if bonds is None else where(bonds > 0, 1, start)


def limits(build: Build) -> None:
    """Where a limit is reached bonds break; a rigid interface opens, and closes where the gap has closed."""
    closed = build.find_mode("closed")
    heals = [_limit(build, law, closed) for law in build.interface.limits]
    again: dict[Expression, Expression] = {}
    if heals and all(heals):
        again = {build.variables.get("bonded", "the limit"): symengine.Integer(1)}
    if closed is None:
        _rebond(build, again)
        return
    if not build.interface.limits:
        t_n = build.variables.get("t_n", "the rigid interface", "interface")
        _opening(build, -t_n, closed, {closed: (1,)})
    build.motion.heals = {closed: symengine.Integer(1), **again}
    gap = build.variables.get("g_n", "the rigid interface", "interface")
    if "g_n" not in build.motion.gap_rates:
        build.edges.append(Edge("touch", gap, "the gap closes", build.motion.heals, when={closed: (0,)}))


def _opening(build: Build, margin: Expression, closed: Expression, when: Mapping[Expression, tuple[int]]) -> None:
    """A rigid interface without bonds opens under tension."""
    modes = {closed: symengine.Integer(0)}
    # A pull that only touches zero does not part bodies that have inertia.
    to_pass = any(state.name == "v_n" for state in build.states)
    build.edges.append(Edge("open", margin, "the interface opens", modes, equilibrates=True, strict=to_pass, when=when))


def _rebond(build: Build, again: dict[Expression, Expression]) -> None:
    """An elastic interface whose strength is that of its bonds can bond again where the gap has closed."""
    if not again or "g_n" not in build.motion.gap_rates:
        return
    (bonded,) = again
    gap = build.variables.get("g_n", "the limit", "interface")
    reason = "the gap closes, so that bonds can hold again"
    build.edges.append(Edge("rejoin", gap, reason, again, when={bonded: (0,)}))


def _limit(build: Build, law: Limit, closed: Expression | None) -> bool:
    """State a limit; whether its strength is that of the bonds, so that it can come back with them."""
    bound = build.variables.bind(law, f"interface.limits.{law.name()}")
    strength = build.variables.call(bound, bound.statement)
    t_n = _traction(build, law)
    bonded = build.variables.get("bonded", law)
    none = symengine.Integer(0)
    # Closed again, a rigid interface that has debonded bears pressure only.
    holds = bonded if closed is None else closed
    strength = strength if closed is None else bonded * strength
    modes = [mode for mode in (bonded, closed) if mode is not None]
    when = {holds: (1,)}
    if closed is not None and law.release == "local":
        modes = [bonded]
        when = {bonded: (1,), closed: (1,)}
        _opening(build, -t_n, closed, {bonded: (0,), closed: (1,)})
    breaks = broken(build, law, law.breaks)
    _refuse_idle(build, law, {*modes, *breaks})
    build.edges.append(
        Edge(
            "debond",
            strength - t_n,
            OPEN,
            dict.fromkeys(modes, none),
            breaks,
            equilibrates=True,
            heat=law.release,
            violation=law.violation,
            when=when,
        )
    )
    return follows_bonds(build, strength)


def _refuse_idle(build: Build, law: Limit, changed: set[Expression]) -> None:
    """A limit of a tension that bonds do not carry would change nothing."""
    g = symengine.Symbol("g_n")
    if not depends(build.psi, g) or build.expanded(derivative(build.psi, g)).free_symbols & changed:
        return
    names = " and ".join(item.name() for item in build.interface.potentials if law_reads(item, "g_n"))
    raise InputError(
        f"{law.name()} would change nothing: the tension of {names} does not depend on the bonds. Let it: use "
        "`bonded-contact` or `bond-stiffness`, or the factor `proportional: {of: phi}`.",
        law.place,
    )


def _traction(build: Build, law: Limit) -> Expression:
    if not build.variables.has("t_n"):
        message = "nothing gives the normal traction: mount the bodies (`mechanics`) or give a potential of the gap."
        raise InputError(message, law.place)
    return build.variables.get("t_n", law)
