r"""Unilateral contact: the gap is not negative, the contact only pushes, and only while the gap is closed.

.. math:: 0 \le g_n \perp p \ge 0

The mode ``closed`` of a rigid gap begins as the gap closes and ends under tension. A mass m that reaches contact with
:math:`v < 0` rebounds with :math:`-e\,v`, by the impulse :math:`(1+e)\,m|v|`, to which friction adds its impulse.
Finite tractions, those of springs, dampers, cohesion and adhesion, have no part in it. Under a pressing traction F
rebounds accumulate, infinitely many in a time :math:`2 e|v| m / (1-e)|F|` (Zeno). The bodies rest once the remainder is
negligible compared with the elapsed time or the fastest impact.

If a potential models the contact it has to bear the bodies; if none does, a run ends as the gap closes.

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
from surfacechem.model.components.mounting import far_field, feels_pressure, support
from surfacechem.model.constraints.set_valued import TRIAL_PRESSURES, friction_impulse
from surfacechem.model.system import RTOL_PATH, Margin
from surfacechem.tolerances import NEWTON_EPS, PICOMETRE

G, V, PRESSURE, TRACTION = symengine.symbols("g_n v_n p t_n")
LANDED = Register("landed", "whether the bodies have met and do not rebound")
FASTEST = Register("fastest", "speed of the fastest impact [m/s]")

NO_SPEED, LEAST_IMPACT = 0.1, 10 * PICOMETRE
"""Fraction of the fastest impact, or of the elapsed time, that counts as zero, in units of the relative tolerance; and
a speed [m/s] that is added to the fastest impact there."""

SHORTEST_REBOUND = 8 * NEWTON_EPS
"""Fraction of the elapsed time below which the flight of one rebound is unresolved: a few hundred ticks of the clock,
so that the event is located to a per cent of the flight."""

LEAST_PART = 0.5
"""Largest fraction to which conductance over pressure falls between the ``TRIAL_PRESSURES`` if it is not
proportional."""

DEEP_GAP, TOUCH_GAP, NO_PRESSURE = -1.0, PICOMETRE / 1e3, 1e-3
"""A gap [m] deep in contact, one practically at touch, and a pressure [Pa] at the former that means no contact. The
softest contact in use, of 1 Pa/m, has a thousand times as much there; attraction that changes its sign beyond its pole
has some 1e-14 Pa, and almost vanished bonds leave little more."""

TOUCH_OVERLAP = PICOMETRE
"""Overlap [m] that still counts as touch: far below the size of an atom, far above the rounding of a gap."""

CONTACT_REMEDY = "Give a potential that does, such as `penalty`."


def contact(pull: Expression, bonded: Expression, gap: Any = None, velocity: Any = None) -> Constraint:
    """Return a rigid contact that ``pull`` opens; it starts closed if bonds hold it or nothing pulls.

    ``gap`` and ``velocity`` are those of a gap that moves by a balance.
    """
    start = where(bonded > 0, 1, where(pull > 0, 0, 1))
    if velocity is not None:
        start = where(absolute(velocity) > 0, 0, start)
    if gap is not None:
        start = where(gap > 0, 0, start)
    mode = Mode("closed", 1.0 if gap is None else 0.0, {0.0: "open", 1.0: "closed"}, start)
    return Constraint((mode,), active=1 - mode.symbol, reaction=mode.symbol * pull)


def laws(build: Build) -> Iterator[Constraint]:
    """Yield the edges of a rigid contact: opening under tension without bonds; closing of a gap without balance."""
    closed, limits = build.mode("closed"), build.interface.limits
    if closed is None:
        return
    t_n = build.variables.get("t_n", "the rigid interface", "interface")
    debonded = {build.variables.get("bonded", "the rigid interface"): (0,)} if limits else {}
    if not limits or any(law.release == "local" for law in limits):  # else debonding opens it
        # The contact of a mass opens when t_n becomes positive; touching zero is not enough.
        strict, when = any(state.symbol == V for state in build.states), {**debonded, closed: (1,)}
        opens = Edge("open", -t_n, "the interface opens", {closed: ZERO}, equilibrates=True, strict=strict, when=when)
        yield Constraint(edges=(opens,))
    gap = build.variables.get("g_n", "the rigid interface", "interface")
    if "g_n" not in build.motion.gap_rates:
        yield _closing(Edge("touch", gap, "the gap closes", build.closing_modes, when={closed: (0,)}))


def _closing(touch: Edge) -> Constraint:
    """Return the constraint of a closing edge; a jump of loads that presses the bodies together closes it too."""
    pressed = {mode: where(touch.masked < 0, value, mode) for mode, value in touch.modes.items()}
    return Constraint(edges=(touch,), resets=lambda edge: pressed if edge.times else {})


def impacts(build: Build) -> Iterator[Constraint]:
    """Yield the closing of a gap that moves: with a mass by an impact, after which the bodies rebound or rest."""
    closed = build.mode("closed")
    if closed is None or "g_n" not in build.motion.gap_rates:
        return
    mount = support(build, "n")
    assert mount is not None
    shut, apart = {G: ZERO}, {closed: (0,)}
    if not mount.inertial:
        yield _closing(Edge("touch", G, "the gap closes", build.closing_modes, shut, equilibrates=True, when=apart))
        return
    far = far_field(build, mount)
    speed, pressing = absolute(V), -far.force(ZERO, ZERO) / far.law.m
    at_rest, remembered = ONE, {}
    if far.law.e != 0:  # one if the bodies do not rebound, else zero, and the new value of the register that it reads
        spec = Spec("1", "relative tolerance of the run")
        tolerance = build.constant("tolerance", RTOL_PATH, spec, 0.0, internal=True)
        swift = where(speed > FASTEST.symbol, speed, FASTEST.symbol)
        rebound = far.law.e * speed
        nothing = NO_SPEED * tolerance
        # The next flight takes 2 rebound / pressing, all flights together 1 / (1 - e) times as long.
        brief = pressing * build.t * ((1 - far.law.e) * nothing + SHORTEST_REBOUND)
        slow = where(rebound < nothing * (swift + LEAST_IMPACT), 1, where(2 * rebound < brief, 1, 0))
        spec = Spec("s", "time at which rebounds rest")
        at_once = build.constant("rests_at", REST_TIME_PATH, spec, -1.0, internal=True)
        at_rest, remembered = where(build.t > at_once, slow, 1), {FASTEST.symbol: swift}
    yield from friction_impulse(build, (1 + far.law.e) * far.law.m * speed)
    hits = Edge(
        "impact",
        G,
        "the bodies hit each other",
        {LANDED.symbol: at_rest, **remembered},
        {**shut, V: where(at_rest > 0, ZERO, far.law.e * speed)},
        return_time=where(pressing > 0, 2 * V / pressing, ZERO),
        when=apart,
    )
    modes_at_rest, reason = {LANDED.symbol: ZERO, **build.closing_modes}, "the bodies rest on each other"
    rest = Edge("rest", -ONE, reason, modes_at_rest, equilibrates=True, when={LANDED.symbol: (1,)})
    # These edges are due at the same time as slip that would begin while the contact is still open, and go first.
    yield Constraint((), (LANDED, FASTEST) if remembered else (LANDED,), (hits, rest), at_once=True)


def jumps(build: Build) -> Iterator[str]:
    """Yield a warning on laws and conductances that would act at the infinite pressure of an impact."""
    if LANDED not in build.registers:
        return
    found = [law.name() for law in build.interface.reactions if feels_pressure(law)]
    if not build.motion.slips:  # prescribed slip: its drive does the work of friction
        found += [law.name() for law in build.interface.frictions if feels_pressure(law)]
    for (a, b), channels in build.conductances.items():
        for h in channels:
            # Growth less than in proportion to the pressure gives nothing in zero time.
            at = [build.at_start(h.subs({PRESSURE: p, TRACTION: -p})) / p for p in TRIAL_PRESSURES]
            if at[1] > LEAST_PART * at[0]:
                found.append(f"the conductance between {a} and {b}")
    if found:
        names = " and ".join(dict.fromkeys(found))
        yield f"impacts take no time: what {names} would do at their pressure is left out."


def closing(build: Build, g: Any) -> Iterator[Margin | str]:
    """End a run as the gap closes, unless a potential bears the bodies there or the domain of a law ends there."""
    if any(margin.domain and margin.expression == g for margin in build.margins):
        return
    if build.scene.surface is not None:  # a run does not leave its range of approach
        return
    # The pressure of the potentials deep in contact, unless it is the same as at touch.
    t_n, side = build.expanded(derivative(build.psi, g)), symengine.Symbol("side")
    deep = t_n.subs({g: DEEP_GAP, side: -1})
    borne = symengine.Integer(0) if deep == t_n.subs({g: TOUCH_GAP, side: 1}) else -deep
    without_bonds = borne.subs({bond.symbol: 0 for bond in build.bonding.values()})
    ends = "no potential bears the bodies in contact"
    if not (least := build.at_start(without_bonds)) <= NO_PRESSURE:  # not below, also if it is NaN
        if least > 0:  # other numbers than those of the scene must bear them, too
            bears = Margin("p > 0 in contact", without_bonds - NO_PRESSURE, ends, remedy=CONTACT_REMEDY)
            yield bears._replace(path="interface.potential", at_start=True)
        return
    if build.at_start(borne) <= NO_PRESSURE:
        yield f"{ends}: the run ends if the gap closes. {CONTACT_REMEDY}"
    margin = where(borne > NO_PRESSURE, 1, g + TOUCH_OVERLAP) if borne.free_symbols else g + TOUCH_OVERLAP
    yield Margin("g_n >= 0", margin, f"the gap closed, and {ends}", remedy=CONTACT_REMEDY, domain=True)
