"""Interface of the solvers: problems and results.

A problem is a fully implicit system of index one, G(t, y, ydot; p) = 0, linear in ydot, over segments with their own
parameters. Time breakpoints end a step; margins that cross zero stop the run or end a step; a ledger of quadratures
is integrated beside the state, outside the error norm. A result always carries a status and its reason in words.
"""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from surfacechem.compile.program import Program
from surfacechem.tolerances import NEGLIGIBLE

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Index = NDArray[np.int64]


class Status(IntEnum):
    """Outcome of a run."""

    FINISHED = 0
    EVENT = 1
    STEP_UNDERFLOW = 2
    MAX_STEPS = 3
    NOT_FINITE = 4
    NO_CONSISTENT_STATE = 5
    SINGULAR = 6
    STOPPED = 7
    FAILED = 8
    LEFT = 9
    """Undecided here: the case is left to other code, which carries the run on."""

    @property
    def success(self) -> bool:
        return self in (Status.FINISHED, Status.EVENT)


REASONS = {
    Status.FINISHED: "reached the end",
    Status.EVENT: "a terminal margin reached zero",
    Status.STEP_UNDERFLOW: "the step size fell to rounding level; the solution may end here",
    Status.MAX_STEPS: "the number of steps allowed was used up",
    Status.NOT_FINITE: "the equations or their derivatives are not finite here",
    Status.NO_CONSISTENT_STATE: "no values of the algebraic variables satisfy the equations here",
    Status.SINGULAR: "the equations do not determine the derivatives and algebraic variables here (singular matrix)",
    Status.STOPPED: "the time allowed for the run was used up",
    Status.FAILED: "the library failed",
    Status.LEFT: "the compiled loop leaves it to others",
}


CHATTER = 12
"""Edges at one moment from which on they are chatter."""

RETURN_FACTOR, FITTED_PART = 1.5, 0.1 * NEGLIGIBLE
"""A time beyond that of the return, in parts of it, and the part of an arc below which the first step is fitted to it:
what is longer a step meets by itself."""


HEAT_STEPS = 60
"""Newton steps in which a body takes on the temperature of its energy at most: where this grows with the square of the
temperature, far away each halves it, so that these are 18 decades.
"""


@dataclass(frozen=True)
class Guard:
    """Type of an event: the action at a zero crossing of a margin; direction -1 is falling, +1 rising, 0 both.

    A margin that has just fired fires again only after it has left zero. A limit, terminal and falling, that is zero
    or below at a start fires at once where it falls, with the state of the start, and not where it rises; one that
    touches zero without crossing it has reached it.
    """

    terminal: bool
    direction: int = -1
    smooth: bool = False
    """Whether the equations neither jump nor bend there: then the step onto it has to pass the test of its error."""
    strict: bool = False
    """Whether it has to be passed: touched, or passed for a moment by less than the tolerance, it holds."""
    domain: bool = False
    """Whether a law ends there: what it says beyond, be it by rounding, has no meaning."""

    @classmethod
    def stop(cls) -> "Guard":
        """A terminal event: the run ends where the margin falls to zero."""
        return cls(terminal=True)

    @classmethod
    def bear(cls) -> "Guard":
        """A terminal event: the run ends where the margin falls below zero."""
        return cls(terminal=True, strict=True)

    @classmethod
    def restart(cls, direction: int = 0) -> "Guard":
        """A kink: a step ends there and the run goes on."""
        return cls(terminal=False, direction=direction)

    @classmethod
    def peak(cls) -> "Guard":
        """A narrow peak: a step ends there that is short enough to have seen it."""
        return cls(terminal=False, direction=0, smooth=True)


@dataclass(frozen=True, kw_only=True)
class EdgeTables:
    """Tables of the edges of a system, by which the compiled loop carries runs along them by itself."""

    sizes: Index
    """Numbers of values in the books of a jump, of values of all nodes, and of the variables that resets write."""
    code: Index
    """A row (code, user data) for magnitudes and rates of guards, books, nodes, times of return and each reset; zero
    where it has not been compiled yet."""
    edges: Index
    """A row (measured state, taker of the heat, refuses, place among those that return) for each edge."""
    when: Index
    """Rows (guard, parameter, value): a guard is active where each of its parameters has one of its values."""
    held: Index
    """Parameters that change along edges."""
    clocks: Index
    """Parameters that are times, that of the start of an arc first."""
    nodes: Index
    """The state of each node; -1 for those that pass their heat on."""
    accounts: Index
    """A row (kind, place) for each account."""
    least_peaks: Array
    """Sizes of the states that count however small they have been."""

    @cached_property
    def words(self) -> Index:
        """Address and lengths of each table that is read by name, one behind the other."""
        tables = self.edges, self.when, self.held, self.clocks, self.nodes, self.accounts, self.least_peaks
        return np.array([word for table in tables for word in (table.ctypes.data, *table.shape)], np.int64)


def integers(rows: Sequence[Any], *shape: int) -> Index:
    """An array of integers of this shape."""
    return np.array(rows, np.int64).reshape(shape)


NO_EDGES = EdgeTables(
    sizes=np.zeros(3, np.int64),
    code=integers([], 0, 2),
    edges=integers([], 0, 4),
    when=integers([], 0, 3),
    held=integers([], 0),
    clocks=integers([], 0),
    nodes=integers([], 0),
    accounts=integers([], 0, 2),
    least_peaks=np.zeros(0),
)
"""Empty tables: runs end at the edges."""


@dataclass(frozen=True)
class Problem:
    """One initial value problem; algebraic entries of y0 are first guesses."""

    program: Program
    y0: Array
    times: Array
    """Output times, strictly increasing, within the segments; may be empty."""
    segments: Array
    """Breakpoints t_0 < ... < t_end."""
    parameters: Array
    """One parameter vector a segment."""
    rtol: float
    atol: Array
    margins: tuple[Guard, ...] = ()
    max_steps: int = 100_000
    max_seconds: float | None = None
    record_steps: bool = False
    exchanged: Array | None = None
    """Largest amount of each quadrature so far, where the problem continues another."""
    seen: Array | None = None
    """Largest size of each margin so far, where the problem continues another."""
    spacing: float = np.inf
    """Longest time [s] of a step that is left without a look at the equations: what is briefer may be passed over."""
    in_play: tuple[bool, ...] | None = None
    """Flags of the margins that are active in the modes, constant here; None where all are. Others may be anything."""
    picture: float = 0.0
    """Part of its range by which a straight line may miss a state between two that are known; 0 where none are added
    to the outputs and the ends of steps."""
    before: float = 0.0
    """Time [s] that the run has lasted before; its logarithm is part of the picture."""
    extremes: Array | None = None
    """Least and largest states of what the problem continues, shape (2, states)."""
    goes_on: bool = False
    """Whether another problem continues this one: then a kink at its very end counts, as one between segments."""
    explicit: bool = False
    """Whether steps may be explicit where the equations give their rates and are not stiff."""
    edges: EdgeTables = NO_EDGES
    """The edges along which the method itself goes on, if it can."""

    def __post_init__(self) -> None:
        """Check the sizes of arrays, which compiled code does not."""
        n, counts = self.program.n, (self.program.n_parameters, self.program.n_margins)
        given = self.y0.shape, self.atol.shape, self.parameters.shape, len(self.margins)
        if given != ((n,), (n,), (len(self.segments) - 1, counts[0]), counts[1]):
            message = f"y0, atol, parameters and margins have the sizes {given}"
            raise ValueError(f"{message}; the program has {n} states, {counts[0]} parameters and {counts[1]} margins.")

    def __getstate__(self) -> dict[str, Any]:
        """All but machine code, which a model makes again."""
        return {**vars(self), "program": None}


def among(t: Array, times: Array) -> Mask:
    """Mask of the times that are among others, which are in order.

    >>> among(np.array([3.0, 1.0, 2.5]), np.array([1.0, 2.0, 3.0])).tolist()
    [True, True, False]
    """
    if not len(times):
        return np.zeros(len(t), bool)
    return np.asarray(times[np.minimum(np.searchsorted(times, t), len(times) - 1)] == t)


class Counters(NamedTuple):
    """Counts of the work of a run."""

    steps: int = 0
    rejected: int = 0
    residuals: int = 0
    jacobians: int = 0
    factorizations: int = 0
    iterations: int = 0


class States(NamedTuple):
    """States and ledgers at a row of times, with their segments where these do not tell."""

    t: Array
    y: Array
    ledger: Array
    segment: Index | None = None


@dataclass(frozen=True)
class Points:
    """States at a row of times: steps or events."""

    t: Array
    y: Array
    ydot: Array
    ledger: Array
    segment: Index | None = field(default=None, kw_only=True)
    """Segment of each, where several lie so close that their times do not tell."""


@dataclass(frozen=True)
class Events(Points):
    """Events in order of time; ``index`` is the margin that crossed zero. Coincident ones have a row each."""

    index: Index = field(kw_only=True)


class EdgeCourse(NamedTuple):
    """Arcs and jumps of a run that the compiled loop has carried along edges."""

    arcs: Array
    """Of each arc its start, its length, how many steps, outputs and states inside steps there were before, and its
    parameters."""
    jumps: Array
    """Of each jump the edge, how many arcs there were before, the energy that it turns into heat, the entropy that it
    produces, heat and entropy that it passes on, whether it is admissible, the work done in it, by what does it; then
    t, y, ydot and parameters before it and after it."""


@dataclass(slots=True)
class Result:
    """A trajectory up to where it ended. Outputs beyond the stop are absent."""

    problem: Problem
    status: Status
    t: float
    """The time reached: the end, the terminal event, or the last good state."""
    y: Array
    ydot: Array
    ledger: Array
    margins: Array
    """Margins at the end; where a run stalls, the one nearest zero is a hint at the reason."""
    times: Array
    outputs: Array
    ledger_outputs: Array
    events: Events
    counters: Counters
    steps: Points | None = None
    stepping: float = float("nan")
    """Time inside a library's own steps [s], without outputs and events; NaN for a method that does them itself."""
    segment: Index | None = None
    """Segment of each output, where their times do not tell."""
    inside: States | None = None
    """States inside steps and at the start of segments that a picture needs."""
    course: EdgeCourse | None = None
    """Arcs and jumps, where the method carries out edges."""
    known: States | None = None
    """All states that are known, where the result is of several arcs and a picture is wanted."""

    def segments_at(self, t: Array, known: Index | None = None) -> Index:
        """Segment of each time; a breakpoint belongs to the one that it ends."""
        return np.searchsorted(self.problem.segments[1:-1], t, side="left") if known is None else known

    def states(self) -> States:
        """All states that are known, in order of time, each once on each side of a breakpoint."""
        t, y, ledger, segment = self.scattered()
        kept = in_order(t, segment)
        return States(t[kept], y[kept], ledger[kept], segment[kept])

    def scattered(self) -> tuple[Array, Array, Array, Index]:
        """Times, states, ledgers and segments of all that is known, in the order in which it is kept."""
        parts = [States(self.times, self.outputs, self.ledger_outputs)]
        if self.steps is not None:
            parts.append(States(self.steps.t, self.steps.y, self.steps.ledger))
        if self.inside is not None:
            parts.append(self.inside)
        t, y, ledger = (np.concatenate(columns) for columns in zip(*(part[:3] for part in parts), strict=True))
        if len(self.problem.segments) == 2:
            return t, y, ledger, np.zeros(len(t), np.int64)
        segment = self.segments_at(t)
        if self.inside is not None:  # what is added at a breakpoint is its other side
            segment[len(t) - len(self.inside.t) :] += among(self.inside.t, self.problem.segments[1:-1])
        return t, y, ledger, segment


def in_order(t: Array, segment: Index) -> Index:
    """Places of what is known at these times, in order of the segments and of the times in them, each time once."""
    order = np.lexsort((t, segment))
    new = np.ones(len(order), dtype=bool)
    new[1:] = (np.diff(t[order]) != 0) | (np.diff(segment[order]) != 0)
    return order[new]


class Solver(ABC):
    """A method for problems; stateless, hence shared between threads."""

    name: str
    counts_rejected = True
    """Whether it is known how many steps the method has rejected."""
    crosses_edges = False
    """Whether the method goes on along edges by itself."""

    def prepare(self) -> None:  # noqa: B027 - most methods need nothing
        """Load what the first solve needs, so that it does not count as run time."""

    @abstractmethod
    def solve(self, problem: Problem) -> Result:
        """Integrate a problem. Failure of the method is a status of the result, never an exception or a wrong
        number.
        """

    def solve_all(self, problems: Sequence[Problem], threads: int = 1) -> list[Result]:
        """Integrate problems of one model, whatever the number of threads with the same results as one by one."""
        return [self.solve(problem) for problem in problems]
