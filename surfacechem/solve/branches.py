r"""Searches for the next equilibrium: along one gap to the next root or beyond a fold, or of several gaps at once.

Gaps without inertia or damper jump in no time. Where several have lost their equilibrium, or are out of balance, there
may be more than one equilibrium to jump to, and the path decides which. It is taken from the limit of small and equal
dampers, in which each gap moves in proportion to the residual of its tractions, :math:`c\,\dot g_i = r_i(g)`. A search
ends at the limits of the laws' domains, so every equilibrium found lies within them.

Roots in an interval are found in Python: importing SciPy's takes a quarter of a second, as long as most runs.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from surfacechem.compile import PREPARATION
from surfacechem.solve.contract import Array
from surfacechem.tolerances import CBRT_EPS, FEW_EPS, NEGLIGIBLE, NO_AMOUNT, PICOMETRE, TINY

Curve = Callable[[Sequence[float] | Array], Array]

FIRST_STEP, STEP_GROWTH, MOST_STEPS = NO_AMOUNT, 1.02, 2400
"""First step of the search for the next equilibrium, relative to the gap, growth of the steps, and their number."""

SEARCH_REACH = FIRST_STEP * (STEP_GROWTH ** (MOST_STEPS - 1) - 1) / (STEP_GROWTH - 1)
"""Reach of a search, relative to the gap."""


def march(driving: Curve, start: float, direction: float, noise: Curve) -> float | None:
    """Return the gap at which the driving traction, or the motion that starts from a fold, comes to balance.

    At a fold the driving traction starts as roundoff: it counts from where it exceeds the ``noise`` of the tractions.
    """
    push = float(np.sign(driving([start])[0]))
    if push == 0.0 and direction == 0.0:
        return start
    return next_root(driving, start, direction or push, direction or push, noise if direction else None)


def steps_ahead(start: float, direction: float) -> Array:
    """Return gaps from a start in a direction, with geometrically growing steps."""
    size = FIRST_STEP * max(abs(start), PICOMETRE)
    return np.asarray(start + direction * size * (STEP_GROWTH ** np.arange(MOST_STEPS) - 1) / (STEP_GROWTH - 1))


def first_driven_gap(driving: Curve, start: float, direction: float, least: Curve, *, lost: bool) -> float | None:
    """Return the first gap in a direction at which the driving traction points onward by more than ``least``.

    None if there is none, or if the traction opposes the motion before it and the equilibrium is not known to be
    ``lost``.
    """
    gaps = steps_ahead(start, direction)
    values, small = direction * driving(gaps), least(gaps)
    first = int(np.argmax(values > small))
    resists = not lost and bool(np.any(values[:first] < -small[:first]))
    return float(gaps[first]) if values[first] > small[first] and not resists else None


def next_root(curve: Curve, start: float, direction: float, sign: float, noise: Curve | None = None) -> float | None:
    """Return the first zero in a direction of a function with a known sign before it, at the start up to roundoff."""
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
        # A formula may be undefined where it jumps to the other sign, as a stiffness is at a kink of the traction.
        return float(np.nan_to_num(sign * curve([g])[0]))

    # Pass the values already known at the ends: evaluated again by themselves they may round to the other sign.
    found = zero(value, (float(gaps[j - 1]), float(gaps[j])), (float(values[j - 1]), float(values[j])))
    # The sign changes at a pole too, which is not a zero.
    return None if abs(curve([found])[0]) > max(abs(values[j - 1]), abs(values[j])) else found


Indices = NDArray[np.intp]
Field = Callable[[Array], Array]
"""Function from displacements of the gaps to driving tractions, both of shape (points, gaps)."""

MOTION_RTOL, START_PART = 0.1 * NEGLIGIBLE, NEGLIGIBLE
"""Relative tolerance of the damped motion; absolute tolerance and first step, as parts of the first displacement."""

MOTION_STEPS = 20_000
"""Number of steps after which the motion is taken not to come to rest."""


FIRST_OFFSET = 10 * CBRT_EPS
"""Least first displacement from an unstable equilibrium, relative to the gap: the difference quotient taken there must
not reach back to the equilibrium, where laws may have a kink. Ten times CBRT_EPS is a choice; twice would do too.
"""

NEWTON_REACH, REST_STEPS = NEGLIGIBLE, 12
"""Distance to rest, relative to the displacement, within which Newton's method takes over, and its number of steps."""


def stiffness(driving: Field, scale: Array, at: Array) -> Array:
    """Return the derivative of each driving traction by each gap, shape (gaps, gaps), from central differences."""
    nudges = np.diag(CBRT_EPS * scale)
    values = driving(np.vstack([at + nudges, at - nudges]))
    ahead, behind = np.split(values, 2)
    return np.asarray(((ahead - behind) / (2 * CBRT_EPS * scale)[:, None]).T)


def unstable_direction(change: Array) -> Array | None:
    """Return the fastest growing eigenvector of an imbalance, its largest entry 1; None if all decay (stable)."""
    growth, ways = np.linalg.eig(change)
    fastest = int(np.argmax(growth.real))
    if not growth[fastest].real > 0:
        return None
    direction: Array = ways[:, fastest].real
    return np.asarray(direction / direction[np.abs(direction).argmax()])


def come_to_rest(driving: Field, scale: Array, sliding: Array, begins: Array) -> Array | None:
    """Return the displacements at which damped motion comes to rest from a first displacement; None if it does not.

    A gap with a nonzero ``sliding`` slides in that direction: friction resists its motion and never pulls it back.
    """
    with PREPARATION:
        from scipy.integrate import Radau

    def velocity(_: float, ways: Array) -> Array:
        return _resisted(driving(ways.T), sliding).T

    def change(_: float, ways: Array) -> Array:
        return np.nan_to_num(stiffness(lambda at: _resisted(driving(at), sliding), scale, ways))

    start = velocity(0.0, begins[:, None])[:, 0]
    if not np.all(np.isfinite(start)):
        return None
    least = 0.0 if begins.any() else MOTION_RTOL  # a point close to an unstable equilibrium is not at rest
    rest = _at_rest(driving, scale, sliding, begins, least)
    if rest is not None:
        return rest
    finest = START_PART * (float(np.max(np.abs(begins))) or MOTION_RTOL * float(scale.min()))
    options = {"rtol": MOTION_RTOL, "atol": finest, "first_step": finest / np.max(np.abs(start))}
    motion = Radau(velocity, 0.0, begins, np.inf, jac=change, vectorized=True, **options)
    for _ in range(MOTION_STEPS):
        with np.errstate(all="ignore"):  # trial values far ahead may not be finite
            motion.step()
        rest = _at_rest(driving, scale, sliding, motion.y, least)
        if rest is not None or motion.status != "running":
            return rest
        if np.any(np.abs(motion.y) > SEARCH_REACH * scale):  # no equilibrium within reach
            return None
    return None


def _resisted(tractions: Array, sliding: Array) -> Array:
    """Return the driving tractions with friction: a sliding gap is driven in its own direction only."""
    return np.where(sliding != 0, sliding * np.maximum(sliding * tractions, 0.0), tractions)


def _at_rest(driving: Field, scale: Array, sliding: Array, at: Array, least: float) -> Array | None:
    """Return the stable equilibrium that is reached up to roundoff; None if there is none.

    A gap that has slid is then in balance or held by friction. A gap without a driving traction, as under symmetry,
    stays.
    """
    everything = np.arange(len(at))
    moved = np.nonzero(_resisted(driving(at[None]), sliding)[0])[0]
    for free in (everything, moved) if len(moved) < len(at) else (everything,):
        rest = equilibrium(driving, scale, free, at, least)
        if rest is not None and np.all(sliding * rest >= 0):
            return rest
    return None


def equilibrium(driving: Field, scale: Array, free: Indices, at: Array, least: float) -> Array | None:
    """Return the stable equilibrium of the free gaps, if a few short steps of Newton's method lead to it, else None.

    Each step is at most half as long as the last, the first at most ``least`` times the sizes of the gaps.
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
    # If the stiffness cannot balance a residual, the least-squares step is zero, but this is not an equilibrium.
    borne = np.abs(change) @ scale[free] * max(last, 2 * FEW_EPS)
    return at if np.all(np.abs(driving(at[None])[0, free]) <= 2 * borne) else None


def zero(value: Callable[[float], float], ends: tuple[float, float], at_ends: tuple[float, float]) -> float:
    """Return a zero of a function of one variable by bracketing, to the last digits of the argument.

    Each step is by inverse quadratic interpolation where that is monotone, else by bisection.

    Parameters
    ----------
    value
        The function; NaN counts as negative.
    ends, at_ends
        Two arguments, in any order, and the values there, of different signs.

    Returns
    -------
    float
        The zero. Source: Chandrupatla (1997), Advances in Engineering Software 28, 145-149.

    Examples
    --------
    >>> zero(lambda x: x * x - 2, (0.0, 2.0), (-2.0, 2.0))
    1.4142135623730954
    """
    (b, a), (at_b, at_a), part = ends, at_ends, 0.5
    if 0.0 in at_ends:
        return ends[at_ends.index(0.0)]
    while True:
        x = a + part * (b - a)
        at_x = value(x)
        if (at_x > 0) == (at_a > 0):
            c, at_c = a, at_a
        else:
            c, at_c, b, at_b = b, at_b, a, at_a
        a, at_a = x, at_x
        best = b if abs(at_b) < abs(at_a) else a
        closest = FEW_EPS * abs(best) + TINY
        if at_x == 0.0 or abs(b - a) <= 2 * closest:
            return best
        xi, phi = (a - b) / (c - b), (at_a - at_b) / (at_c - at_b)
        if phi * phi < xi and (1 - phi) ** 2 < 1 - xi:
            part = at_a / (at_b - at_a) * at_c / (at_b - at_c)
            part += (c - a) / (b - a) * at_a / (at_c - at_a) * at_b / (at_c - at_b)
        else:
            part = 0.5
        least = closest / abs(b - a)
        part = min(1 - least, max(least, part))
