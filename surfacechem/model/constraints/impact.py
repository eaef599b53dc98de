r"""Rigid contact of a gap that moves: it closes, its mass rebounds, and what slides on it is rubbed in that instant.

A mass m that reaches contact with :math:`v < 0` leaves it with :math:`-e\,v`, by the impulse :math:`(1+e)\,m|v|`. Dry
friction acts in proportion to it: what slides with a mass of its own loses :math:`\mu\,(1+e)\,m|v| / m_t` of its
velocity, and no more than that. Finite tractions, those of springs, dampers, cohesion and adhesion, have no part in it.

Under a pressing traction rebounds follow each other ever faster, infinitely many in a time
:math:`2 e|v| m / (1-e)|F|`. The bodies rest where what is left of this is nothing, beside the time that has passed or
the fastest impact.

Source: Newton's law of impact and Coulomb's for impulses; Brogliato (2016), Nonsmooth Mechanics, doi
10.1007/978-3-319-28664-8.
"""

from __future__ import annotations

import symengine

from surfacechem.contracts.terms import Spec
from surfacechem.expressions import Expression, absolute, where
from surfacechem.model.automaton import RESTS, Transition
from surfacechem.model.build import Build
from surfacechem.model.components.mounting import FarField, far_field, held, law_reads
from surfacechem.model.constraints.rubbing import FINITE, INFINITE, rubbing
from surfacechem.model.system import TOLERANCE

NONE, ONE = symengine.Integer(0), symengine.Integer(1)
G, V = symengine.symbols("g_n v_n")

NOTHING, SLOWEST = 0.1, 1e-11
"""Part of the fastest impact, or of the time so far, that counts as none, in units of the relative tolerance; and the
speed [m/s] that the fastest impact has at least there."""

BRIEF = 1e-13
"""Part of the time so far that one rebound must take to be told from none."""

HALF = 0.5
"""Part to which what is conducted per pressure falls, at least, from a high to a very high one where it is less than
in proportion."""


def impacts(build: Build) -> None:
    """How a gap that moves closes: where it has a mass by an impact, after which the bodies rebound or rest."""
    closed = build.find_mode("closed")
    if closed is None or "g_n" not in build.motion.gap_rates:
        return
    mount = held(build, "n")
    assert mount is not None
    margin, shut = where(closed > 0, 1, G), {G: NONE}
    if not mount.inertial:
        build.transitions.append(Transition("touch", margin, "the gap closes", build.motion.heals, shut, settles=True))
        return
    far = far_field(build, mount)
    speed, pressing = absolute(V), -far.force(NONE, NONE) / far.m
    landed = build.mode("landed", 0.0, {0.0: "whether the bodies have met and do not rebound"})
    rests, modes = _rests(build, far, speed, pressing)
    rubs = rubbing(build, (1 + far.e) * far.m * speed)
    # What follows at the same moment comes before what would slide as long as the contact is open.
    build.transitions[:0] = [
        Transition(
            "impact",
            margin,
            "the bodies hit each other",
            {landed: rests, **modes, **rubs.begins},
            {**shut, V: where(rests > 0, NONE, far.e * speed)},
            returns=where(pressing > 0, 2 * V / pressing, NONE),
        ),
        *rubs.transitions,
        Transition(
            "rest",
            where(landed > 0, -1, 1),
            "the bodies rest on each other",
            {landed: NONE, **build.motion.heals},
            settles=True,
        ),
    ]


def _rests(
    build: Build, far: FarField, speed: Expression, pressing: Expression
) -> tuple[Expression, dict[Expression, Expression]]:
    """One where the bodies do not rebound, else zero; and the modes that it has to remember."""
    if far.e == 0:
        return ONE, {}
    tolerance = build.constant("tolerance", TOLERANCE, Spec("1", "relative tolerance of the run"), 0.0, internal=True)
    fastest = build.mode("fastest", 0.0, {0.0: "speed of the fastest impact [m/s]"})
    swift = where(speed > fastest, speed, fastest)
    rebound = far.e * speed
    nothing = NOTHING * tolerance
    # This flight takes 2 rebound / pressing, and all that follow together 1 / (1 - e) times as long.
    brief = pressing * build.t * ((1 - far.e) * nothing + BRIEF)
    slow = where(rebound < nothing * (swift + SLOWEST), 1, where(2 * rebound < brief, 1, 0))
    at_once = build.constant("rests_at", RESTS, Spec("s", "time at which rebounds rest"), -1.0, internal=True)
    return where(build.t > at_once, slow, 1), {fastest: swift}


def missed(build: Build) -> None:
    """Warn of what reads the pressure and would do something in an impact, where that is infinite for no time."""
    if build.find_mode("landed") is None:
        return
    found = [law.name() for law in build.interface.reactions if law_reads(law, "p") or law_reads(law, "t_n")]
    for (a, b), channels in build.conductances.items():
        if any(_keeps_up(build, h) for h in channels):
            found.append(f"the conductance between {a} and {b}")
    if found:
        names = " and ".join(dict.fromkeys(found))
        build.warnings.append(f"impacts take no time: what {names} would do at their pressure is left out.")


def _keeps_up(build: Build, h: Expression) -> bool:
    """Whether a conductance grows at least in proportion to the pressure; what grows less does nothing in no time."""
    at = [build.at_start(h.subs({symengine.Symbol("p"): symengine.RealDouble(p)})) / p for p in (FINITE, INFINITE)]
    return at[1] > HALF * at[0]
