r"""Unilateral contact: the gap is not negative, the contact pushes only, and it pushes only where the gap is closed.

.. math:: 0 \le g_n \perp p \ge 0

The mode ``closed`` of a rigid gap begins as the gap closes and ends under tension. A mass m that reaches contact with
:math:`v < 0` leaves it with :math:`-e\,v`, by the impulse :math:`(1+e)\,m|v|`, which friction answers by one of its
own. Finite tractions, those of springs, dampers, cohesion and adhesion, have no part in it. Under a pressing traction
rebounds follow each other ever faster, infinitely many in a time :math:`2 e|v| m / (1-e)|F|` (Zeno). The bodies rest
where what is left of this is nothing, beside the time that has passed or the fastest impact.

Where a potential stands for the contact it has to bear the bodies; where none does, a run ends as the gap closes.

Source: Signorini's condition and Newton's law of impact as in Moreau (1988), doi 10.1007/978-3-7091-2624-0_1, and
Brogliato (2016), Nonsmooth Mechanics, doi 10.1007/978-3-319-28664-8.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import symengine

from surfacechem.contracts.terms import Spec
from surfacechem.expressions import Expression, absolute, derivative, where
from surfacechem.model.automaton import ONE, REST_TIME_PATH, ZERO, Constraint, Edge, Mode, Register
from surfacechem.model.build import Build
from surfacechem.model.components.mounting import FarField, far_field, feels_pressure, support
from surfacechem.model.constraints.set_valued import TRIAL_PRESSURES, friction_impulse
from surfacechem.model.system import RTOL_PATH, Margin
from surfacechem.tolerances import NEWTON_EPS, PICOMETRE

G, V, PRESSURE, TRACTION = symengine.symbols("g_n v_n p t_n")
LANDED = Register("landed", "whether the bodies have met and do not rebound")
FASTEST = Register("fastest", "speed of the fastest impact [m/s]")

NO_SPEED, LEAST_IMPACT = 0.1, 10 * PICOMETRE
"""Part of the fastest impact, or of the time so far, that counts as none, in units of the relative tolerance; and the
speed [m/s] that the fastest impact has at least there."""

SHORTEST_REBOUND = 8 * NEWTON_EPS
"""Part of the time so far that one rebound must take to be told from none: a few hundred ticks of the clock, so that
its event is found to a per cent of it."""

LEAST_PART = 0.5
"""Part to which what is conducted per pressure falls, at least, between the ``TRIAL_PRESSURES`` where it is less than
in proportion."""

DEEP_GAP, TOUCH_GAP, NO_PRESSURE = -1.0, PICOMETRE / 1e3, 1e-3
"""Gaps [m] deep in contact and as good as at touch, and a pressure [Pa] that bears nothing at the former. The softest
contact in use, of 1 Pa/m, has a thousand times as much there; attraction that changes its sign beyond its pole has some
1e-14 Pa, and bonds that have all but gone leave little more.
"""

TOUCH_OVERLAP = PICOMETRE
"""Overlap [m] that still is touch: far below the size of an atom, far above the rounding of a gap."""

CONTACT_REMEDY = "Give a potential that does, such as `penalty`."


def contact(pull: Expression, bonded: Expression, gap: Any = None, velocity: Any = None) -> Constraint:
    """A rigid contact that ``pull`` opens; it is closed at the start where bonds hold it, or nothing pulls.

    ``gap`` and ``velocity`` are those of what moves by a balance of its own.
    """
    start = where(bonded > 0, 1, where(pull > 0, 0, 1))
    if velocity is not None:
        start = where(absolute(velocity) > 0, 0, start)
    if gap is not None:
        start = where(gap > 0, 0, start)
    mode = Mode("closed", 1.0 if gap is None else 0.0, {0.0: "open", 1.0: "closed"}, start)
    return Constraint((mode,), active=1 - mode.symbol, reaction=mode.symbol * pull)


def laws(build: Build) -> Iterator[Constraint]:
    """Edges of a rigid contact: it opens under tension without bonds; a gap that follows at once closes it, too."""
    closed, limits = build.mode("closed"), build.interface.limits
    if closed is None:
        return
    t_n = build.variables.get("t_n", "the rigid interface", "interface")
    debonded = {build.variables.get("bonded", "the rigid interface"): (0,)} if limits else {}
    if not limits or any(law.release == "local" for law in limits):  # else what debonds opens
        # What only touches zero does not part a mass.
        strict, when = any(state.symbol == V for state in build.states), {**debonded, closed: (1,)}
        opens = Edge("open", -t_n, "the interface opens", {closed: ZERO}, equilibrates=True, strict=strict, when=when)
        yield Constraint(edges=(opens,))
    gap = build.variables.get("g_n", "the rigid interface", "interface")
    if "g_n" not in build.motion.gap_rates:
        yield _closing(Edge("touch", gap, "the gap closes", build.reclosing, when={closed: (0,)}))


def _closing(touch: Edge) -> Constraint:
    """An edge that closes the contact; what loads press together closes as they jump, too."""
    pressed = {mode: where(touch.masked < 0, value, mode) for mode, value in touch.modes.items()}
    return Constraint(edges=(touch,), beside=lambda edge: pressed if edge.times else {})


def impacts(build: Build) -> Iterator[Constraint]:
    """Closing of a gap that moves: with a mass by an impact, after which the bodies rebound or rest."""
    closed = build.mode("closed")
    if closed is None or "g_n" not in build.motion.gap_rates:
        return
    mount = support(build, "n")
    assert mount is not None
    shut, apart = {G: ZERO}, {closed: (0,)}
    if not mount.inertial:
        yield _closing(Edge("touch", G, "the gap closes", build.reclosing, shut, equilibrates=True, when=apart))
        return
    far = far_field(build, mount)
    speed, pressing = absolute(V), -far.force(ZERO, ZERO) / far.m
    rests, remembered = _rests(build, far, speed, pressing)
    yield from friction_impulse(build, (1 + far.e) * far.m * speed)
    hits = Edge(
        "impact",
        G,
        "the bodies hit each other",
        {LANDED.symbol: rests, **remembered},
        {**shut, V: where(rests > 0, ZERO, far.e * speed)},
        returns=where(pressing > 0, 2 * V / pressing, ZERO),
        when=apart,
    )
    calm, reason = {LANDED.symbol: ZERO, **build.reclosing}, "the bodies rest on each other"
    rest = Edge("rest", -ONE, reason, calm, equilibrates=True, when={LANDED.symbol: (1,)})
    # What follows at the same moment comes before what would slide as long as the contact is open.
    yield Constraint((), (LANDED, FASTEST) if remembered else (LANDED,), (hits, rest), at_once=True)


def _rests(
    build: Build, far: FarField, speed: Expression, pressing: Expression
) -> tuple[Expression, dict[Expression, Expression]]:
    """Indicator, one where the bodies do not rebound, else zero; and new values of the registers that it reads."""
    if far.e == 0:
        return ONE, {}
    tolerance = build.constant("tolerance", RTOL_PATH, Spec("1", "relative tolerance of the run"), 0.0, internal=True)
    swift = where(speed > FASTEST.symbol, speed, FASTEST.symbol)
    rebound = far.e * speed
    nothing = NO_SPEED * tolerance
    # This flight takes 2 rebound / pressing, and all that follow together 1 / (1 - e) times as long.
    brief = pressing * build.t * ((1 - far.e) * nothing + SHORTEST_REBOUND)
    slow = where(rebound < nothing * (swift + LEAST_IMPACT), 1, where(2 * rebound < brief, 1, 0))
    at_once = build.constant("rests_at", REST_TIME_PATH, Spec("s", "time at which rebounds rest"), -1.0, internal=True)
    return where(build.t > at_once, slow, 1), {FASTEST.symbol: swift}


def jumps(build: Build) -> Iterator[str]:
    """Warn of laws and conductances that would act at the pressure of an impact, infinite for an instant."""
    if LANDED not in build.registers:
        return
    found = [law.name() for law in build.interface.reactions if feels_pressure(law)]
    if not build.motion.slips:  # the velocity of sliding is prescribed, and its drive does the work of friction
        found += [law.name() for law in build.interface.frictions if feels_pressure(law)]
    for (a, b), channels in build.conductances.items():
        for h in channels:
            # What grows less than in proportion to the pressure does nothing in no time.
            at = [build.at_start(h.subs({PRESSURE: p, TRACTION: -p})) / p for p in TRIAL_PRESSURES]
            if at[1] > LEAST_PART * at[0]:
                found.append(f"the conductance between {a} and {b}")
    if found:
        names = " and ".join(dict.fromkeys(found))
        yield f"impacts take no time: what {names} would do at their pressure is left out."


def closing(build: Build, g: Any) -> Iterator[Margin | str]:
    """End a run as the gap closes, unless a potential bears the bodies there, or a law ends there by itself."""
    if any(margin.domain and margin.expression == g for margin in build.margins):
        return
    if build.scene.surface is not None:  # whose range of approach a run does not leave
        return
    # What the potentials bear deep in contact, unless it is the same as at touch.
    t_n, side = build.expanded(derivative(build.psi, g)), symengine.Symbol("side")
    deep = t_n.subs({g: DEEP_GAP, side: -1})
    borne = symengine.Integer(0) if deep == t_n.subs({g: TOUCH_GAP, side: 1}) else -deep
    without_bonds = borne.subs({bond.symbol: 0 for bond in build.bonding.values()})
    if not build.at_start(without_bonds) <= NO_PRESSURE:  # nor where a law has no number there
        return
    if build.at_start(borne) <= NO_PRESSURE:
        yield f"no potential bears the bodies in contact: the run ends if the gap closes. {CONTACT_REMEDY}"
    margin = where(borne > NO_PRESSURE, 1, g + TOUCH_OVERLAP) if borne.free_symbols else g + TOUCH_OVERLAP
    reason = "the gap closed, and no potential bears the bodies in contact"
    yield Margin("g_n >= 0", margin, reason, remedy=CONTACT_REMEDY, domain=True)
