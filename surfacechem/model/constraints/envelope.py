r"""Gradual debonding along an envelope, a unilateral constraint on the bonding state.

.. math:: \phi \le \phi_{env}(g_n), \quad \dot\phi \le 0, \quad (\phi_{env} - \phi)\,\dot\phi = 0

unless other laws form bonds. The mode ``debonding`` is 0 while phi is below the envelope, 1 while bonds break along it,
and -1 while the gap is open beyond the reach of bonds. It is entered when phi reaches the envelope (``soften``), left
on unloading (``unload``) and when the last bonds break (``part``). If the traction falls faster with the gap than the
bodies unload, the interface tears open at once (``tear``), which is a fold of the quasi-static gap.

Source: Sauer, Duong & Mandadapu (2021), section 5.2; damage as a unilateral constraint as in Raous, Cangemi & Cocu
(1999), doi 10.1016/S0045-7825(98)00389-2.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import symengine

from surfacechem.contracts.terms import RateLaw
from surfacechem.errors import InputError
from surfacechem.expressions import Expression, absolute, derivative, where
from surfacechem.model.automaton import ONE, ZERO, Constraint, Edge, Mode
from surfacechem.model.build import Build
from surfacechem.model.components.mounting import far_field, support
from surfacechem.model.system import Margin
from surfacechem.quantities import VARIABLES
from surfacechem.tolerances import NO_AMOUNT

STRENGTH_RTOL = 1e3 * NO_AMOUNT
"""Relative difference of two statements of a strength that rounded input explains: both have six digits."""

DEBONDING_WORDS = {-1.0: "is open beyond the reach of bonds", 0.0: "keeps its bonds", 1.0: "loses bonds"}
DEBONDING = Mode("debonding", 0.0, DEBONDING_WORDS)
MODE = DEBONDING.symbol

SAME_STIFFNESS = "Give `bond-stiffness` and this law the same E_b."


def variables(build: Build) -> Iterator[Constraint]:
    """Define the mode for the laws that read it; bonds can form unless the gap is open beyond their reach."""
    if any(law.envelope is not None for law in build.interface.reactions):
        build.variables.define("softening", (MODE + MODE**2) / 2, "mode", "interface.bonding")
        yield Constraint((DEBONDING,), active=1 - MODE * (MODE - 1) / 2)


def _check(build: Build, law: RateLaw, phi: Expression, g_n: Expression, peak: Expression) -> tuple[Margin, ...]:
    """Check that the envelope falls from its peak, at which it equals the traction of complete bonding."""
    t_max, g_f = law.t_max, law.g_f  # type: ignore[attr-defined]
    start, end, strength = build.at_start(peak), build.at_start(g_f), build.at_start(t_max)
    what = f"{law.name()}: t_max / E_b = {start:g} m, where complete bonding begins to break,"
    # Both ends of the fall must be distinct, and distinct from zero.
    if not start < (1 - NO_AMOUNT) * end:
        message = f"is not below g_f = {end:g} m: the traction would have to snap back. Raise g_f, or use a limit."
        raise InputError(f"{what} {message}", law.place)
    if start < NO_AMOUNT * end:
        raise InputError(f"{what} is less than {NO_AMOUNT:g} g_f, too little to be resolved. Lower E_b.", law.place)
    t_n = derivative(build.psi, symengine.Symbol("g_n")).xreplace({g_n: peak, symengine.Symbol("side"): 1})
    bonds = t_n.subs({phi: 1}) - t_n.subs({phi: 0})
    if bonds.has(symengine.zoo):
        return ()  # the potential is singular without bonds, so all of its traction is theirs
    borne = build.at_start(bonds)
    if abs(borne - strength) > STRENGTH_RTOL * strength:
        bear = f"the bonds of the potential bear {borne:g} Pa, not the t_max of {strength:g} Pa"
        raise InputError(f"{law.name()}: at t_max / E_b = {start:g} m {bear}. {SAME_STIFFNESS}", law.place)
    # Margins check the same along a run, for parameters that vary or that a sweep changes.
    reason = "the bonds of the potential bear another traction than t_max where they begin to break"
    near = 2 * STRENGTH_RTOL - absolute(build.expanded(bonds / t_max) - 1)
    return (
        Margin("t_max / E_b < g_f", 1 - peak / g_f, "bonds begin to break beyond g_f"),
        Margin("t_max", near, reason, remedy=SAME_STIFFNESS, path=law.path),
    )


def softening(
    build: Build, law: RateLaw, forming: Expression, free: Expression
) -> tuple[list[Constraint | Margin], Expression]:
    """Return the edges that start and end softening, and the rate of a bound law with an envelope.

    ``forming`` is the net rate of the other laws, ``free`` one while the bonding state may change.
    """
    phi, g_n, n_c = (build.variables.get(name, law) for name in ("phi", "g_n", "n_c"))
    left = build.variables.call(law, law.envelope)
    peak = law.peak()  # type: ignore[attr-defined]
    agrees = _check(build, law, phi, g_n, peak)
    # The envelope moves at the gap's rate, replaced by the velocity if that is a separate variable.
    rate = build.total_derivative(left)
    if build.variables.has("v_n"):
        rate = rate.subs({symengine.Symbol("dg_n_dt"): build.variables.get("v_n", "the envelope")})
    overshoot = build.name(VARIABLES["overshoot"], forming * free / n_c - rate, output=False)
    lost, bound = {MODE: -ONE}, build.mode("held")
    breaks = {MODE: ONE} if bound is None else {MODE: ONE, bound: ZERO}
    # Without bonds, and without formation, nothing can break.
    present = where(phi > 0, left - phi, where(forming * free > 0, left - phi, 1))
    beyond = where(phi > 0, left - phi + NO_AMOUNT, 1)
    keeps, loses, parted = {MODE: (0,)}, {MODE: (1,)}, {MODE: (-1,)}
    remains = where(left < phi, where(left > 0, left, 0), phi)
    if "g_n" in build.motion.gap_rates and not build.variables.has("v_n"):
        build.motion.followers[phi] = remains
    fewer = "a jump leaves fewer bonds than there were"
    edges = [
        Edge("yield", beyond, fewer, reset={phi: remains}, equilibrates=True, heat="snap", when=keeps),
        # After unloading, roundoff must not trigger this edge again: the guard has to become negative.
        Edge("soften", present, "bonds begin to break as the gap opens", breaks, strict=True, when=keeps),
        *_tear(build, phi, left),
        Edge("part", left, "the last bonds break", lost, {phi: ZERO}, equilibrates=True, heat="snap", when=loses),
        Edge("unload", overshoot, "bonds do not reach what the gap leaves", {MODE: ZERO}, when=loses),
    ]
    if forming != 0:
        margin, reason = where(forming > 0, -left, 1), "the gap is closed enough to bond"
        edges.append(Edge("rejoin", margin, reason, {MODE: ZERO}, strict=True, when=parted))
    # At the start phi must not exceed the envelope.
    given = where(build.t > 0, 1, where(left > 0, left, 0) - phi + build.variables.get("slack", "the bonds"))
    reason, remedy = "there are more bonds than the gap leaves", "Give fewer bonds under `initial`, or a smaller gap."
    within = Margin("bonds within their envelope", given, reason, remedy=remedy, path="initial.phi")
    modes = (replace(DEBONDING, start=where(left < 0, -1.0, 0.0)),)

    def apart(edge: Edge) -> dict[Expression, Expression]:
        """Return the mode after an edge at which the normal gap jumps: phi leaves the envelope for the time being."""
        return {MODE: where(MODE > 0, 0, MODE)} if edge.equilibrates and MODE not in edge.modes else {}

    stated: list[Constraint | Margin] = [*agrees, within, Constraint(modes, edges=tuple(edges), resets=apart)]
    return stated, build.variables.call(law, law.statement, {"overshoot": overshoot})


def _tear(build: Build, phi: Expression, left: Expression) -> list[Edge]:
    """Return the edge at which a quasi-static gap tears open: its mounting is softer than the fall of the traction."""
    mount = support(build, "n")
    if mount is None or not mount.quasi_static or "g_n" not in build.motion.gap_rates:
        return []
    g, k = symengine.Symbol("g_n"), far_field(build, mount).law.k
    slope = derivative(derivative(build.psi, g).subs({phi: left}), g)
    guard, lost = (k + slope) / (k + absolute(slope)), {MODE: -ONE}
    reason = "the traction falls faster with the gap than the bodies unload: the interface tears open"
    return [Edge("tear", guard, reason, lost, {phi: ZERO}, equilibrates=True, heat="snap", when={MODE: (1,)})]
