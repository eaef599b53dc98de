"""Gaps without mass or damper: their common equilibrium, sliding to it, the folds at which it is lost, and the search
for the next one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from surfacechem.compile import PREPARATION
from surfacechem.compile.program import Function, compile_function
from surfacechem.expressions import Expression, derivative
from surfacechem.model.automaton import FOLD_STIFFNESS, SIDE_PATH, SLIP_PATH
from surfacechem.model.system import System
from surfacechem.solve.contract import Array, Index
from surfacechem.tolerances import (
    CBRT_EPS,
    DRIFT,
    FEW_EPS,
    GAP_EPS,
    IDLE,
    MOST_DRIFT,
    NANOMETRE,
    NEGLIGIBLE,
    NEWTON_EPS,
    NO_AMOUNT,
    PICOMETRE,
    RUN_EPS,
    TINY,
)

# -- searches for the next equilibrium --------------------------------------------------------------------------------

# Along one gap to the next root or beyond a fold, or of several gaps at once.
#
# Gaps without inertia or damper jump in no time. Where several have lost their equilibrium, or are out of balance,
# there may be more than one equilibrium to jump to, and the path decides which. It is taken from the limit of small and
# equal dampers, in which each gap moves in proportion to the residual of its tractions, :math:`c\,\dot g_i = r_i(g)`.
# A search ends at the limits of the laws' domains, so every equilibrium found lies within them.
#
# Roots in an interval are found in Python: importing SciPy's takes a quarter of a second, as long as most runs.

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


# -- equilibria of a scene -------------------------------------------------------------------------------------------

Heat = Callable[[Array], Array]
"""Function from inputs to inputs with the temperatures that a jump to them gives."""

BALANCED = RUN_EPS
"""Residual of the tractions that counts as balanced, relative to its terms: those of a run include its roundoff."""

NO_BALANCE = "there is no gap at which the tractions are in equilibrium at the start"

CORRECTIONS = 3
"""Newton steps that remove the drift of an integration from the gaps: each doubles the digits."""


def drift_of(rtol: float) -> float:
    """Return the residual of tractions that the integration may cause at a tolerance, relative to its terms."""
    return min(DRIFT * rtol, MOST_DRIFT)


class Point(NamedTuple):
    """A state with the parameters at that moment."""

    t: float
    y: Array
    ydot: Array
    parameters: Array

    @classmethod
    def of(cls, inputs: Array, n: int) -> Point:
        """Make the point from arguments of compiled functions with this number of states."""
        return cls(float(inputs[0]), inputs[1 : 1 + n], inputs[1 + n : 1 + 2 * n], inputs[1 + 2 * n :])

    def inputs(self) -> Array:
        """Return the arguments of compiled functions."""
        return np.concatenate(([self.t], self.y, self.ydot, self.parameters))


def compiled(system: System, expressions: Iterable[Expression]) -> Function:
    """Compile expressions of a system as a function of its inputs."""
    return compile_function(system.inputs, [system.expand(item) for item in expressions])


def formulas(expressions: Callable[[Any], Iterable[Expression]]) -> cached_property[Function]:
    """Return an attribute: the function for expressions of its owner, which has a system, compiled on first use."""
    return cached_property(lambda owner: compiled(owner.system, expressions(owner)))


def rate_of(system: System, expression: Expression) -> Expression:
    """Return the total time derivative of an expression of a system."""
    expanded = system.expand(expression)
    return sum((derivative(expanded, s.symbol) * s.dot for s in system.states), derivative(expanded, system.t))


class GapDirection(NamedTuple):
    """A direction in the space of the gaps, the gap that measures the distance, and the weights of the tractions."""

    changes: Array
    """Change of each state, shape (states,)."""
    column: int
    """The state that changes by one."""
    weights: Array
    """Weights of the driving tractions, shape (equilibria,)."""


class FoldPoint(NamedTuple):
    """A fold: its point, the direction in the space of the gaps in which equilibrium is lost, and the sign along it."""

    point: Point
    direction: GapDirection
    sign: float


class FreeGaps(NamedTuple):
    """The gaps that are not held at a point, as displacements from there."""

    which: Indices
    columns: Index
    """Columns of the states that are the gaps."""
    changes: Array
    """Change of the states with each gap, shape (gaps, states)."""
    driving: Field
    scale: Array
    """Sizes of the gaps [m]."""


class Equilibria:
    """The quasi-static gaps of a system; each function is compiled on first use."""

    def __init__(self, system: System) -> None:
        self.system = system
        self.items = system.equilibria
        self.columns = np.array([system.state_columns[e.state] for e in self.items], dtype=np.int64)
        """Columns of the states that are the gaps."""
        columns = system.parameter_columns
        self.slip = columns.get(SLIP_PATH) if any(e.slip for e in self.items) else None
        """Column of the sliding mode among the parameters, if gaps in equilibrium stick or slide."""
        sided = SIDE_PATH in columns and "g_n" in system.state_columns
        self._side = 1 + 2 * len(system.states) + columns[SIDE_PATH] if sided else None
        self.followers = [1 + system.state_columns[name] for name in system.followers]
        """Columns among the inputs of the states that follow the normal gap where it jumps."""

    _balance = formulas(lambda self: (item for e in self.items for item in (e.residual, e.size)))
    """Driving traction and size of its terms, for each gap; compiled separately for searches over many rows."""
    _friction_limits = formulas(lambda self: (e.limit for e in self.items))
    """Friction limit of each gap [Pa]."""
    _follow = formulas(lambda self: self.system.followers.values())
    """States that follow the normal gap where it jumps."""

    @cached_property
    def _moving(self) -> Function:
        """For each gap: zero if it is held, and the change of each state with it."""
        rows = (
            [e.active, *(e.coupled.get(name, int(name == e.state)) for name in self.system.state_columns)]
            for e in self.items
        )
        return compiled(self.system, (item for row in rows for item in row))

    @cached_property
    def _tangents(self) -> Function:
        """For each gap: driving traction, its derivative along the moving states, and its partial time derivative."""
        symbols, found = {state.name: state.symbol for state in self.system.states}, []
        for e in self.items:
            residual = self.system.expand(e.residual)
            with_it = (self.system.expand(w) * derivative(residual, symbols[x]) for x, w in e.coupled.items())
            slope = derivative(residual, symbols[e.state]) + sum(with_it)
            found += [residual, slope, derivative(residual, self.system.t)]
        return compiled(self.system, found)

    # -- gaps along a line ----------------------------------------------------------------------------------------

    def free(self, point: Point) -> Indices:
        """Return the indices of the gaps that are not held."""
        return np.nonzero(self._moving(point.inputs())[:: 1 + len(self.system.states)])[0]

    def changes(self, point: Point) -> Array:
        """Return the change of each state with each gap by itself, shape (gaps, states)."""
        return self._moving(point.inputs()).reshape(len(self.items), 1 + len(self.system.states))[:, 1:]

    def together(self, point: Point, weights: Array) -> GapDirection:
        """Return the common direction of several gaps, measured by the gap that moves the most, whose weight is 1."""
        changes = (weights[:, None] * self.changes(point)).sum(axis=0)
        return GapDirection(changes, int(self.columns[np.abs(weights).argmax()]), weights)

    def _free(self, point: Point, heat: Heat | None) -> FreeGaps:
        which = self.free(point)
        changes, columns = self.changes(point)[which], self.columns[which]

        def driving(moved: Array) -> Array:
            rows = np.repeat(point.inputs()[None], len(moved), axis=0)
            rows[:, 1 : 1 + len(point.y)] += moved @ changes
            return self.driving(self._arrived(rows, jumps=heat is not None), heat)[:, which]

        return FreeGaps(which, columns, changes, driving, np.maximum(np.abs(point.y[columns]), NANOMETRE))

    def _arrived(self, rows: Array, *, jumps: bool) -> Array:
        """Update the mode of touch in inputs whose gaps have moved; in a jump the following states too."""
        if self._side is not None:
            # A law that changes at touch is valid on its own side only and may have poles beyond.
            column, g = self._side, rows[:, 1 + self.system.state_columns["g_n"]]
            rows[:, column] = np.where(g == 0, rows[:, column], np.sign(g))
        if jumps and self.followers:
            rows[:, self.followers] = self._follow(rows)
        return rows

    def along(self, point: Point, line: GapDirection, gaps: Sequence[float] | Array, *, jumps: bool = False) -> Array:
        """Return inputs with these gaps along a direction."""
        rows = np.repeat(point.inputs()[None], len(gaps), axis=0)
        rows[:, 1 : 1 + len(point.y)] += np.outer(np.asarray(gaps) - point.y[line.column], line.changes)
        rows[:, 1 + line.column] = gaps
        return self._arrived(rows, jumps=jumps)

    def moved(self, point: Point, rows: Array) -> Point:
        """Return the point with the states and modes of the only row."""
        n = len(point.y)
        return point._replace(y=rows[0, 1 : 1 + n], parameters=rows[0, 1 + 2 * n :])

    def _curves(self, point: Point, line: GapDirection, heat: Heat | None) -> tuple[Curve, Curve]:
        """Return the driving traction along a direction and its roundoff, as functions of the measuring gap."""
        pulled, jumps = line.weights != 0, heat is not None

        def driving(gaps: Sequence[float] | Array) -> Array:
            tractions = self.driving(self.along(point, line, gaps, jumps=jumps), heat)
            return np.asarray(np.where(pulled, tractions, 0.0) @ line.weights)

        def noise(gaps: Sequence[float] | Array) -> Array:
            sizes = np.atleast_2d(self._balance(self.along(point, line, gaps, jumps=jumps)))[:, 1::2]
            return np.asarray(NEWTON_EPS * np.where(pulled, sizes, 0.0) @ np.abs(line.weights))

        return driving, noise

    def balance(self, point: Point) -> tuple[Array, Array]:
        """Return the driving traction of each gap, and the size of its terms."""
        values = self._balance(point.inputs())
        return values[::2], values[1::2]

    def driving(self, rows: Array, heat: Heat | None = None) -> Array:
        """Return driving tractions, shape (rows, equilibria), with the temperatures that a jump to the rows gives."""
        return np.asarray(np.atleast_2d(self._balance(_warmed(rows, heat)))[:, ::2])

    # -- equilibrium ----------------------------------------------------------------------------------------------

    def equilibrate(
        self, point: Point, heat: Heat | None = None, balanced: float = BALANCED, lost: FoldPoint | None = None
    ) -> Point | None:
        """Return the point with all gaps in equilibrium, coupled by pressure, shear and heat; None if none exists.

        A single gap is found by a search along it, several gaps as the end of their damped motion. If the tractions are
        ``balanced`` within this part, a sliding gap moves on only if that equilibrium is unstable. From an equilibrium
        that is ``lost`` the gaps move on with the parameters of the point.
        """
        if lost is not None:
            return self._released(lost.point._replace(parameters=point.parameters), heat, lost)
        if not self.items or len(self.free(point)) == 0:
            return point
        driving, sizes = self.balance(point)
        is_balanced = np.all(np.abs(driving) <= balanced * sizes)
        return self._released(point, heat, self._unstable(point, heat) if is_balanced else None)

    def equilibrate_near(self, point: Point, heat: Heat, span: Array) -> Point | None:
        """Return the point with all gaps in equilibrium, for loads that change in small steps.

        Newton's method is used while its first step is at most as long as the gaps or their whole ``span``, shape
        (states,), and each further step at most half as long as the last; otherwise the general search.
        """
        if len(self.free(point)) == 0:
            return point
        free = self._free(point, heat)
        n, sizes = len(free.which), np.maximum(free.scale, span[free.columns])
        line = equilibrium(free.driving, sizes, np.arange(n), np.zeros(n), 1.0)
        if line is None:
            return self.equilibrate(point, heat)
        there = point._replace(y=point.y + line @ free.changes)
        return self.moved(point, self._arrived(there.inputs()[None], jumps=True))

    def _released(self, point: Point, heat: Heat | None, lost: FoldPoint | None) -> Point | None:
        """Return the point at which the free gaps come to rest after losing equilibrium, or when unbalanced."""
        free = self.free(point)
        if len(free) > 1:
            return self._damped(point, heat, lost)
        if len(free) == 0:
            return point
        alone = np.eye(len(self.items))[free[0]]
        line, sign = (lost.direction, lost.sign) if lost else (self.together(point, alone), 0.0)
        sliding = self.slip_sign(point, line)
        driving, noise = self._curves(point, line, heat)
        start = float(point.y[line.column])
        if sliding and not sign:
            gap = self._slid(point, line, sliding, driving, noise)
        else:
            gap = march(driving, start, sign, noise)
            if gap is not None and abs(gap) < GAP_EPS and abs(driving([0.0])) <= noise([0.0]):
                gap = 0.0  # exact, for laws that end at touch
        if gap is None or (sliding and gap == start):
            return None if gap is None else point
        return self.moved(point, self.along(point, line, [gap], jumps=heat is not None))

    def _slid(self, point: Point, line: GapDirection, sliding: float, driving: Curve, noise: Curve) -> float | None:
        """Return the gap at which sliding comes to balance; friction never pulls it back.

        Sliding has begun because the driving traction exceeded the friction limit by at least roundoff. If the
        stiffness is almost zero, as at a fold that is reached by the change of loads alone, this makes a visible
        distance.
        """
        start = float(point.y[line.column])
        now, least = sliding * float(driving([start])[0]), float(noise([start])[0])
        beyond = march(lambda gaps: driving(gaps) + sliding * least, start, sliding, noise) if now > -least else start
        slope = float(np.abs(line.weights) @ np.abs(self._tangents(point.inputs())[1::3]))
        if beyond is None or abs(beyond - start) * slope > BALANCED / NEWTON_EPS * least:
            return beyond
        return march(driving, start, 0.0, noise) if now > 0 else start

    def _damped(self, point: Point, heat: Heat | None, lost: FoldPoint | None) -> Point | None:
        """Return the point at which several gaps come to rest together, by damped motion."""
        free = self._free(point, heat)
        begins = np.zeros(len(free.which))
        if lost is not None:
            along, noise = self._curves(point, lost.direction, heat)
            start = float(point.y[lost.direction.column])
            gap = first_driven_gap(along, start, lost.sign, noise, lost=True)
            if gap is None:
                return None
            line = lost.sign * lost.direction.weights[free.which]
            # A smaller displacement is lost in the roundoff of the other gaps.
            begins = line * max(abs(gap - start), FIRST_OFFSET / float(np.max(np.abs(line) / free.scale)))
        rest = come_to_rest(free.driving, free.scale, self._slip_directions(point)[free.which], begins)
        if rest is None:
            return None
        y, columns = point.y + rest @ free.changes, free.columns
        y[columns] = np.where(np.abs(y[columns]) < GAP_EPS, 0.0, y[columns])  # exact, for laws that end at touch
        return self.moved(point, self._arrived(point._replace(y=y).inputs()[None], jumps=heat is not None))

    def _unstable(self, point: Point, heat: Heat | None) -> FoldPoint | None:
        """Return the direction in which gaps leave an unstable equilibrium, a fold already passed; None if stable.

        If friction falls with its own heat, steady sliding is impossible on a spring softer than this fall. A gap
        without a driving traction yet, as under symmetry, gets the sign of the next change of the loads.
        """
        sliding, free = self._slip_directions(point), self._free(point, heat)
        tractions = sliding if sliding.any() else self._tangents(point.inputs())[2::3]
        if not tractions[free.which].any():
            return None
        # From differences in the direction of the tractions alone: at touch the stiffness is another one behind.
        nudges = np.where(tractions[free.which] < 0, -CBRT_EPS, CBRT_EPS) * free.scale
        still, *ahead = free.driving(np.vstack([np.zeros(len(nudges)), np.diag(nudges)]))
        change = ((np.array(ahead) - still) / nudges[:, None]).T
        found = unstable_direction(change) if np.all(np.isfinite(change)) else None
        weights = np.zeros(len(sliding))
        weights[free.which] = 0.0 if found is None else found
        sign = float(np.sign(weights @ tractions))
        if not sign:
            return None
        line = self.together(point, weights)
        driving, noise = self._curves(point, line, heat)
        start = float(point.y[line.column])
        left = np.abs(driving([start]))  # the residual that the integration may have caused
        begins = first_driven_gap(driving, start, sign, lambda gaps: noise(gaps) + left, lost=False)
        return None if begins is None else FoldPoint(point, line, sign)

    def corrected(self, point: Point) -> Point:
        """Return the point without the drift that the integration has left in its gaps."""
        for _ in range(CORRECTIONS if self.items else 0):
            values = self._tangents(point.inputs())
            y = point.y.copy()
            tangents = zip(self.columns, self.changes(point), values[::3], values[1::3], strict=True)
            for column, with_it, residual, slope in tangents:
                change = -residual / slope if slope < 0 else 0.0
                if abs(change) <= NEGLIGIBLE * max(abs(point.y[column]), PICOMETRE):  # larger changes are no drift
                    y += change * with_it
            point = point._replace(y=y)
        return point

    # -- sliding --------------------------------------------------------------------------------------------------

    def _slip_directions(self, point: Point) -> Array:
        """Return the sliding direction of each gap; zero for a gap that may move both ways.

        A sliding gap may move both ways if its friction limit is zero.
        """
        slip = 0.0 if self.slip is None else point.parameters[self.slip]
        if not slip:
            return np.zeros(len(self.items))
        directions: Array = slip * np.array([e.slip for e in self.items])
        return np.where(self._friction_limits(point.inputs()) > 0, directions, 0.0)

    def slip_sign(self, point: Point, line: GapDirection) -> float:
        """Return the sign of a direction in which the interface slides; zero if nothing slides along it."""
        return float(np.sign(self._slip_directions(point) @ line.weights))

    def with_slip(self, point: Point, slip: float) -> Point:
        """Return the point with another mode of sliding."""
        parameters = point.parameters.copy()
        if self.slip is not None:
            parameters[self.slip] = slip
        return point._replace(parameters=parameters)

    def would_reverse(self, point: Point, drift: float, noise: float = 0.0, heat: Heat | None = None) -> bool:
        """True if the tractions would pull a sliding gap back, by more than ``drift``, relative to the terms of the
        balance, and more than ``noise`` [Pa].
        """
        sliding = self._slip_directions(point)
        if not sliding.any():
            return False
        j = int(np.abs(sliding).argmax())
        inputs = _warmed(point.inputs()[None], heat)[0]
        residual, slope = self._tangents(inputs)[3 * j : 3 * j + 2]
        size = self._balance(inputs)[2 * j + 1]
        # Without elastic support (slope >= 0) it cannot stick.
        return bool(slope < 0 and sliding[j] * residual < -max(drift * size, noise))


def _warmed(rows: Array, heat: Heat | None) -> Array:
    """Return inputs with the temperatures that a jump to them gives, where these are finite."""
    if heat is None:
        return rows
    warmed = heat(rows)
    return np.where(np.isfinite(warmed), warmed, rows)


class Folds:
    """The edges of a system that are folds, by index."""

    def __init__(self, equilibria: Equilibria) -> None:
        self.equilibria, self.system = equilibria, equilibria.system
        self.items = {index: edge.fold for index, edge in enumerate(self.system.edges) if edge.fold is not None}

    @cached_property
    def _tangents(self) -> dict[int, Function]:
        """Tangent stiffness; compiled separately, as a search evaluates it at many rows."""
        return {index: compiled(self.system, [fold.tangent]) for index, fold in self.items.items()}

    @cached_property
    def _shapes(self) -> dict[int, Function]:
        """For each fold: decrease of the tangent along each gap, warming of states by each gap, stiffness matrix."""
        found = {}
        for index, fold in self.items.items():
            warming = [rise.get(name, 0) for rise in fold.warming for name in self.system.state_columns]
            entries = [entry for row in fold.stiffness for entry in row]
            found[index] = compiled(self.system, [*fold.falls, *warming, *entries])
        return found

    _approach = formulas(
        lambda self: (x for e in self.equilibria.items for x in (e.residual, rate_of(self.system, e.residual)))
    )
    """Driving traction of each gap, and its total time derivative."""

    def _shape(self, index: int, point: Point) -> tuple[Array, GapDirection, Array]:
        """Return the decrease of a fold's tangent along each gap, the singular direction, and the change of the states
        along it, warming included.
        """
        n = len(self.equilibria.items)
        values = np.atleast_1d(self._shapes[index](point.inputs()))
        falls, warming, entries = np.split(values, [n, n + n * len(self.system.states)])
        # The null vector of the stiffness: motion along it changes no traction.
        free, weights = self.equilibria.free(point), np.zeros(n)
        weights[free] = np.linalg.svd(entries.reshape(n, n)[np.ix_(free, free)])[2][-1] if len(free) > 1 else 1.0
        weights /= weights[np.abs(weights).argmax()]
        line = self.equilibria.together(point, weights)
        return falls, line, line.changes + warming.reshape(n, -1).T @ line.weights

    def at(self, index: int, point: Point) -> FoldPoint | None:
        """Return the fold near a point; None if it is out of reach, or the edge is not a fold.

        Near a fold the gap changes with the square root of time, so a run ends a little before it, or beyond. If the
        stiffness rises as the interface slides on, only the change of loads leads to the fold, and the interface is not
        driven there.
        """
        if index not in self.items or not len(self.equilibria.free(point)):
            return None
        falls, line, changes = self._shape(index, point)
        sign, sliding = float(np.sign(falls @ line.weights)), self.equilibria.slip_sign(point, line)
        if sliding and sign != sliding:
            return None

        there = line._replace(changes=changes)

        def ahead(gaps: Sequence[float] | Array) -> Array:
            return np.asarray(self._tangents[index](self.equilibria.along(point, there, gaps))).reshape(-1)

        start = float(point.y[line.column])
        passed = bool(ahead([start])[0] < 0)  # as a step may, by its tolerance
        at = next_root(ahead, start, -sign if passed else sign, -1.0 if passed else 1.0)
        if at is None:
            return None
        return FoldPoint(self.equilibria.moved(point, self.equilibria.along(point, there, [at])), line, sign)

    def held_at(self, index: int, lost: FoldPoint) -> FoldPoint | None:
        """Return the same fold with sliding gaps stuck; None if sticking preserves the equilibrium."""
        point = self.equilibria.with_slip(lost.point, 0.0)
        if self._tangents[index](point.inputs())[0] > FOLD_STIFFNESS:
            return None
        falls, line, _ = self._shape(index, point)
        return FoldPoint(point, line, float(np.sign(falls @ line.weights)))

    def reached(self, point: Point, rtol: float) -> int:
        """Return the fold so close to a point that the run's tolerance cannot tell them apart; -1 if there is none."""
        for index in self.items:
            found = self.at(index, point)
            if found is None:
                continue
            (_, sizes), (left, _) = self.equilibria.balance(point), self.equilibria.balance(found.point)
            if np.all(np.abs(left) <= drift_of(rtol) * np.abs(sizes)):
                return index
        return -1

    def in_time(self, index: int, point: Point, end: float) -> Point:
        """Return a point close to a fold, at the time of the fold if that is before the end; else unchanged.

        The resisting traction at the fold's gap falls to zero linearly in time, however inaccurately the run has
        followed the accelerating gap.
        """
        lost = self.at(index, point)
        if lost is None:
            return point
        beside = point.ydot - point.ydot[lost.direction.column] * self._shape(index, point)[2]
        values = self._approach(lost.point._replace(ydot=beside).inputs())
        push, change = (lost.sign * float(lost.direction.weights @ part) for part in (values[::2], values[1::2]))
        left = -push / change if push < 0 < change else 0.0
        return point._replace(t=point.t + left) if left < min(IDLE * point.t, end - point.t) else point
