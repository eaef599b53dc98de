r"""Searches for the next equilibrium: along one gap to the next root or the fold ahead, or of several gaps at once.

Gaps without inertia or damper take no time. Where several have lost their equilibrium, or are pushed out of it, there
may be more than one to end in, and which it is depends on the way. It is that of the limit of small and equal dampers,
in which each gap moves in proportion to what is out of balance of its tractions, :math:`c\,\dot g_i = r_i(g)`. What is
found lies where the laws hold: a search ends at the ends of their domains.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from surfacechem.compile.preparing import PREPARATION
from surfacechem.solve.contract import Array
from surfacechem.solve.zeros import zero
from surfacechem.tolerances import CBRT_EPS, FEW_EPS, NEGLIGIBLE, NO_AMOUNT, PICOMETRE

Curve = Callable[[Sequence[float] | Array], Array]

FIRST_STEP, STEP_GROWTH, MOST_STEPS = NO_AMOUNT, 1.02, 2400
"""First step of the search for the next equilibrium, relative to the gap, its growth, and the number of steps."""

SEARCH_REACH = FIRST_STEP * (STEP_GROWTH ** (MOST_STEPS - 1) - 1) / (STEP_GROWTH - 1)
"""Reach of a search, relative to the gap."""


def march(driving: Curve, start: float, direction: float, noise: Curve) -> float | None:
    """The gap at which the push of the driving traction, or that from a fold, ends.

    At a fold the push begins as rounding: it counts from where it is more than the ``noise`` of the tractions.
    """
    push = float(np.sign(driving([start])[0]))
    if push == 0.0 and direction == 0.0:
        return start
    return next_root(driving, start, direction or push, direction or push, noise if direction else None)


def steps_ahead(start: float, direction: float) -> Array:
    """Gaps in ever longer steps from a gap in a direction."""
    size = FIRST_STEP * max(abs(start), PICOMETRE)
    return np.asarray(start + direction * size * (STEP_GROWTH ** np.arange(MOST_STEPS) - 1) / (STEP_GROWTH - 1))


def push_ahead(driving: Curve, start: float, direction: float, least: Curve, *, lost: bool) -> float | None:
    """The first gap in a direction at which the driving traction pushes on by more than the ``least`` that counts.

    None where there is none, or where it resists before and the balance is not known to be ``lost``.
    """
    gaps = steps_ahead(start, direction)
    values, small = direction * driving(gaps), least(gaps)
    first = int(np.argmax(values > small))
    resists = not lost and bool(np.any(values[:first] < -small[:first]))
    return float(gaps[first]) if values[first] > small[first] and not resists else None


def next_root(curve: Curve, start: float, direction: float, sign: float, noise: Curve | None = None) -> float | None:
    """First zero in a direction of a function of known sign before it, which at the start may be wrong by rounding."""
    gaps = steps_ahead(start, direction)
    values = sign * curve(gaps)
    least = 0.0 if noise is None else noise(gaps)
    first = int(np.argmax(values > least))
    crossed = np.nonzero(~(values[first:] > 0))[0]
    if not values[first] > 0 or len(crossed) == 0 or not np.isfinite(values[first + crossed[0]]):
        return None
    j = first + int(crossed[0])
    if values[j] == 0.0:
        return float(gaps[j])

    def value(g: float) -> float:
        # A formula may have no value just where it jumps to the other sign, as stiffness does at a bend of a traction.
        return float(np.nan_to_num(sign * curve([g])[0]))

    # The ends count as they were seen among the others: alone they may round to the other sign.
    found = zero(value, (float(gaps[j - 1]), float(gaps[j])), (float(values[j - 1]), float(values[j])))
    # At a pole the sign changes too, but there is no zero.
    return None if abs(curve([found])[0]) > max(abs(values[j - 1]), abs(values[j])) else found


Indices = NDArray[np.intp]
Field = Callable[[Array], Array]
"""Driving tractions at ways of the gaps from where they begin, both of shape (points, gaps)."""

MOTION_RTOL, START_PART = 0.1 * NEGLIGIBLE, NEGLIGIBLE
"""Tolerance of the motion, relative to the way so far; it begins within this part of its first push."""

MOTION_STEPS = 20_000
"""Steps after which motion does not come to rest."""


FIRST_PUSH = 10 * CBRT_EPS
"""Part of a gap with which motion begins from an unstable balance at least: the difference taken there does not reach
back to the balance, where laws may have a kink. Ten times is a choice; motion would also leave from twice."""

NEWTON_REACH, REST_STEPS = NEGLIGIBLE, 12
"""Part of the way within which Newton's method takes the last step to rest, and how many steps that may have."""


def stiffness(driving: Field, scale: Array, at: Array) -> Array:
    """Change of each driving traction along each gap, shape (gaps, gaps)."""
    nudges = np.diag(CBRT_EPS * scale)
    values = driving(np.vstack([at + nudges, at - nudges]))
    ahead, behind = np.split(values, 2)
    return np.asarray(((ahead - behind) / (2 * CBRT_EPS * scale)[:, None]).T)


def unstable_direction(change: Array) -> Array | None:
    """Direction in which an imbalance grows the fastest, its largest part 1; None where all decay (stable)."""
    growth, ways = np.linalg.eig(change)
    fastest = int(np.argmax(growth.real))
    if not growth[fastest].real > 0:
        return None
    way: Array = ways[:, fastest].real
    return np.asarray(way / way[np.abs(way).argmax()])


def come_to_rest(driving: Field, scale: Array, onward: Array, begins: Array) -> Array | None:
    """The way of each gap at which damped motion from a first displacement ends; None where it does not.

    A gap with a direction other than zero ``onward`` slides: friction resists its motion and pulls nothing back.
    """
    with PREPARATION:
        from scipy.integrate import Radau

    def velocity(_: float, ways: Array) -> Array:
        return _resisted(driving(ways.T), onward).T

    def change(_: float, ways: Array) -> Array:
        return np.nan_to_num(stiffness(lambda at: _resisted(driving(at), onward), scale, ways))

    start = velocity(0.0, begins[:, None])[:, 0]
    if not np.all(np.isfinite(start)):
        return None
    least = 0.0 if begins.any() else MOTION_RTOL  # what is close to an unstable balance is not at rest in it
    rest = _at_rest(driving, scale, onward, begins, least)
    if rest is not None:
        return rest
    finest = START_PART * (float(np.max(np.abs(begins))) or MOTION_RTOL * float(scale.min()))
    options = {"rtol": MOTION_RTOL, "atol": finest, "first_step": finest / np.max(np.abs(start))}
    motion = Radau(velocity, 0.0, begins, np.inf, jac=change, vectorized=True, **options)
    for _ in range(MOTION_STEPS):
        with np.errstate(all="ignore"):  # far ahead a trial may see no number
            motion.step()
        rest = _at_rest(driving, scale, onward, motion.y, least)
        if rest is not None or motion.status != "running":
            return rest
        if np.any(np.abs(motion.y) > SEARCH_REACH * scale):  # nothing bears it
            return None
    return None


def _resisted(pushes: Array, onward: Array) -> Array:
    """Driving tractions with friction: a gap that slides is driven in one direction only."""
    return np.where(onward != 0, onward * np.maximum(onward * pushes, 0.0), pushes)


def _at_rest(driving: Field, scale: Array, onward: Array, at: Array, least: float) -> Array | None:
    """The stable equilibrium that is as good as reached, to rounding; None where none is.

    In it what has slid is in balance, or friction holds it; what nothing pushes, as where it is symmetric, stays.
    """
    everything = np.arange(len(at))
    moved = np.nonzero(_resisted(driving(at[None]), onward)[0])[0]
    for free in (everything, moved) if len(moved) < len(at) else (everything,):
        rest = equilibrium(driving, scale, free, at, least)
        if rest is not None and np.all(onward * rest >= 0):
            return rest
    return None


def equilibrium(driving: Field, scale: Array, free: Indices, at: Array, least: float) -> Array | None:
    """The stable equilibrium of the gaps that are free, where a few short steps of Newton's method lead to it.

    Each is at most half as long as the one before, the first no longer than the gaps' sizes times ``least``.
    """
    if len(free) == 0:
        return at
    change = stiffness(driving, scale, at)[np.ix_(free, free)]
    if not np.all(np.isfinite(change)) or unstable_direction(change) is not None:
        return None
    reach, last = max(least, NEWTON_REACH * float(np.max(np.abs(at) / scale))), np.inf
    for _ in range(REST_STEPS):
        step = np.linalg.lstsq(change, -driving(at[None])[0, free], rcond=None)[0]
        size = float(np.max(np.abs(step) / scale[free]))
        if not size <= min(reach, last / 2):
            break
        at, last = at.copy(), size
        at[free] += step
        if size <= 2 * FEW_EPS:
            break
    if last > NEWTON_REACH * MOTION_RTOL:
        return None
    # Where nothing bears what is out of balance, Newton's method has no step for it, and that is no rest.
    borne = np.abs(change) @ scale[free] * max(last, 2 * FEW_EPS)
    return at if np.all(np.abs(driving(at[None])[0, free]) <= 2 * borne) else None
