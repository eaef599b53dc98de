"""Limits of the normal traction: the interface is bonded until it gives way."""

from __future__ import annotations

import symengine

from surfacechem.assembly.build import Build
from surfacechem.errors import InputError
from surfacechem.expressions import Expression, where
from surfacechem.system import Transition
from surfacechem.terms import Limit

OPEN = "the interface debonds as its tensile strength is reached"


def bonded_mode(build: Build) -> None:
    """Whether the interface is bonded, for the potentials that ask; it is, where nothing limits it."""
    if build.interface.limits:
        words = {0.0: "debonded", 1.0: "bonded"}
        build.variables.define("bonded", lambda: build.mode("bonded", 1.0, words), "mode", "interface.limits")
    else:
        build.variables.define("bonded", lambda: symengine.Integer(1), "internal", "no limit of the traction")


def limits(build: Build) -> None:
    """Where a limit is reached bonds break; a rigid interface opens, and closes where the gap has closed."""
    closed = next((mode.symbol for mode in build.modes if mode.name == "closed"), None)
    for law in build.interface.limits:
        _limit(build, law, closed)
    if closed is None:
        return
    if not build.interface.limits:
        t_n = build.variables.get("t_n", "the rigid interface")
        margin = where(closed > 0, -t_n, 1)
        build.transitions.append(Transition("open", margin, "the interface opens", {closed: symengine.Integer(0)}))
    gap = build.variables.get("g_n", "the rigid interface")
    margin = where(closed > 0, 1, gap)
    build.transitions.append(Transition("touch", margin, "the gap closes", {closed: symengine.Integer(1)}))


def _limit(build: Build, law: Limit, closed: Expression | None) -> None:
    bound = build.variables.bind(law, f"interface.limits.{law.name()}")
    if build.interface.bonds:
        raise InputError(f"{law.name()} breaks bonds at once, which the species of a mechanism cannot.", law.place)
    strength = build.variables.call(bound, bound.statement)
    t_n = _traction(build, law)
    bonded = build.variables.get("bonded", law)
    none = symengine.Integer(0)
    # Closed again, a rigid interface that has debonded bears pressure only.
    holds = bonded if closed is None else closed
    strength = strength if closed is None else bonded * strength
    build.transitions.append(
        Transition(
            "debond",
            where(holds > 0, strength - t_n, 1),
            OPEN,
            {mode: none for mode in (bonded, closed) if mode is not None},
            {bond.symbol: none for name, bond in build.bonding.items() if name == "phi"},
            settles=True,
            sinks=law.release,
            violation=law.violation,
        )
    )


def _traction(build: Build, law: Limit) -> Expression:
    if not build.variables.has("t_n"):
        message = "nothing gives the normal traction: mount the bodies (`mechanics`) or give a potential of the gap."
        raise InputError(message, law.place)
    return build.variables.get("t_n", law)
