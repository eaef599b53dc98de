"""Gradual debonding: the mode in which bonds break along an envelope, entered as it is reached, left on unloading."""

from __future__ import annotations

from functools import partial

import symengine

from surfacechem.assembly.build import Build
from surfacechem.assembly.mounting import far_field, held
from surfacechem.errors import InputError
from surfacechem.expressions import Expression, absolute, derivative, where
from surfacechem.quantities import VARIABLES
from surfacechem.system import Margin
from surfacechem.terms import RateLaw
from surfacechem.transitions import Transition

MATCH = 1e-6
"""Relative difference of two statements of a strength that rounded input explains."""

RESOLVED, FINEST = 1 - 1e-9, 1e-9
"""Largest and least part of the opening at which the last bonds break, at which the first ones may."""

SAME = "Give `bond-stiffness` and this law the same E_b."


def _tear(build: Build, mode: Expression, phi: Expression, left: Expression) -> list[Transition]:
    """A quasi-static gap whose mounting is softer than the fall of the traction tears open at once."""
    mount = held(build, "n")
    if mount is None or not mount.quasi_static or "g_n" not in build.motion.gap_rates:
        return []
    g, k = symengine.Symbol("g_n"), far_field(build, mount).k
    slope = derivative(derivative(build.psi, g).subs({phi: left}), g)
    margin = where(mode > 0, (k + slope) / (k + absolute(slope)), 1)
    lost, none = -symengine.Integer(1), symengine.Integer(0)
    reason = "the traction falls faster with the gap than the bodies unload: the interface tears open"
    return [Transition("tear", margin, reason, {mode: lost}, {phi: none}, settles=True, sinks="snap")]


def softening_mode(build: Build) -> None:
    """The mode, and the velocity that drives the break, for the laws that read them."""
    if not any(hasattr(law, "envelope") for law in build.interface.reactions):
        return
    mode = build.mode("debonding", 0.0, {-1.0: "has lost its bonds", 0.0: "keeps its bonds", 1.0: "loses bonds"})
    build.variables.define("softening", lambda: (mode + mode**2) / 2, "mode", "interface.bonding")
    if not build.variables.has("v_n"):
        build.variables.define("v_n", partial(_velocity, build), "derived", "rate of the normal gap")


def _check(build: Build, law: RateLaw, phi: Expression, g_n: Expression, peak: Expression) -> None:
    """The envelope falls after it rose, from the traction that complete bonding bears there."""
    t_max, g_f = law.t_max, law.g_f  # type: ignore[attr-defined]
    t_n = derivative(build.psi, symengine.Symbol("g_n")).xreplace({g_n: peak, symengine.Symbol("side"): 1})
    bonds = t_n.subs({phi: 1}) - t_n.subs({phi: 0})
    _refuse_steep(law, build.at_start(peak), build.at_start(g_f))
    if bonds.has(symengine.zoo):
        return  # the potential does not exist without bonds, which then bear nothing of their own
    borne, strength = build.at_start(bonds), build.at_start(t_max)
    if abs(borne - strength) > MATCH * strength:
        raise InputError(
            f"{law.name()}: at t_max / E_b = {build.at_start(peak):g} m the bonds of the potential bear {borne:g} Pa, "
            f"not the t_max of {strength:g} Pa. {SAME}",
            law.place,
        )
    # What varies, and what a sweep gives, is watched.
    reason = "the bonds of the potential bear another traction than t_max where they begin to break"
    build.margins += [
        Margin("t_max / E_b < g_f", 1 - peak / g_f, "bonds begin to break beyond g_f"),
        Margin("t_max", 2 * MATCH - absolute(build.expanded(bonds / t_max) - 1), reason, remedy=SAME),
    ]


def _refuse_steep(law: RateLaw, peak: float, g_f: float) -> None:
    what = f"{law.name()}: t_max / E_b = {peak:g} m, where complete bonding begins to break,"
    if not peak < RESOLVED * g_f:
        message = f"is not below g_f = {g_f:g} m: the traction would have to snap back. Raise g_f, or use a limit."
        raise InputError(f"{what} {message}", law.place)
    if peak < FINEST * g_f:
        raise InputError(f"{what} is less than {FINEST:g} g_f, too little to be resolved. Lower E_b.", law.place)


def _velocity(build: Build) -> Expression:
    rate = build.motion.gap_rates["g_n"] if "g_n" in build.motion.gap_rates else build.rate_of("g_n")
    return build.name(VARIABLES["v_n"], rate)


def softening(build: Build, law: RateLaw) -> None:
    """What starts and what ends the loss of bonds along the envelope of a bound law."""
    if not hasattr(law, "envelope"):
        return
    mode = next(item.symbol for item in build.modes if item.name == "debonding")
    phi, g_n, v_n = (build.variables.get(name, law) for name in ("phi", "g_n", "v_n"))
    left = build.variables.call(law, law.envelope)
    peak = law.peak()  # type: ignore[attr-defined]
    none, one = symengine.Integer(0), symengine.Integer(1)
    lost = {mode: -one}
    _check(build, law, phi, g_n, peak)
    build.transitions += [
        Transition("soften", where(mode**2 > 0, 1, left - phi), "bonds begin to break as the gap opens", {mode: one}),
        *_tear(build, mode, phi, left),
        Transition("part", where(mode > 0, left, 1), "the last bonds break", lost, {phi: none}, settles=True),
        Transition("unload", where(mode > 0, v_n, 1), "bonds stop breaking as the gap closes", {mode: none}),
        Transition("rejoin", where(mode < 0, g_n - peak, 1), "the gap is closed enough to bond", {mode: none}),
    ]
