"""Interface of the solvers: problems and results.

A problem is a fully implicit system of index one, G(t, y, ydot; p) = 0, linear in ydot, over load segments, each with
its parameters. Breakpoints end a step; margins (event functions) that cross zero stop the run or end a step; a ledger
of quadratures is integrated along with the state, outside the error norm. A result always carries a status and its
reason in words.
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
    """Not decided here: the run is left to other code, which continues it."""

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
"""Number of edges at one moment from which on they count as chatter."""

RETURN_FACTOR, FITTED_PART = 1.5, 0.1 * NEGLIGIBLE
"""Length of the first segment of an arc after a rebound, in times of flight, and the part of the arc below which that
segment is used: a longer flight is resolved by ordinary steps.
"""


HEAT_STEPS = 60
"""Most Newton steps for the temperature of a body of known energy. If the energy grows with the square of the
temperature, each step far away halves it, so 60 steps cover 18 decades.
"""


class Guard(NamedTuple):
    """Type of an event: the action at a zero crossing of a margin; direction -1 is falling, +1 rising, 0 both.

    A margin that has just fired fires again only after it has left zero. A limit (terminal, falling) that starts at
    zero or below fires at once, with the initial state, if it falls, and not if it rises; a limit that touches zero
    without crossing it fires.
    """

    terminal: bool
    direction: int = -1
    smooth: bool = False
    """True if the equations neither jump nor have a kink there: the step onto it must then pass the error test."""
    strict: bool = False
    """True if zero has to be crossed by more than the tolerance; touching zero does not fire it."""
    domain: bool = False
    """True at the end of the domain of a law, beyond which its values, even by roundoff, have no meaning."""

    @classmethod
    def stop(cls) -> "Guard":
        """Return a terminal event: the run ends where the margin falls to zero."""
        return cls(terminal=True)

    @classmethod
    def restart(cls, direction: int = 0) -> "Guard":
        """Return a kink: a step ends there and the run goes on."""
        return cls(terminal=False, direction=direction)


@dataclass(frozen=True, kw_only=True)
class EdgeTables:
    """Tables of the edges of a system, from which the compiled loop carries out jumps by itself."""

    sizes: Index
    """Numbers of totals of a jump, of values of all nodes, and of variables that resets write."""
    code: Index
    """A row (code, user data) for magnitudes of guards, rates of guards, totals of a jump, nodes, times of flight, and
    each reset; zero if not compiled yet.
    """
    edges: Index
    """A row (measured state, taker of the heat, refuses, index among the rebounding edges, rests) for each edge."""
    when: Index
    """Rows (guard, parameter, value): a guard is active where each of its parameters has one of its values."""
    held: Index
    """Parameters that change along edges: modes and registers."""
    clocks: Index
    """Parameters that are times, first that of the start of an arc."""
    nodes: Index
    """Temperature of each node, as the index of its state; -1 for nodes that pass their heat to a reservoir."""
    accounts: Index
    """A row (kind, index) for each account."""
    least_peaks: Array
    """Least magnitude of each state that counts for the roundoff of guards."""

    @cached_property
    def words(self) -> Index:
        """Address and lengths of each table that the compiled loop reads by name, in order."""
        tables = self.edges, self.when, self.held, self.clocks, self.nodes, self.accounts, self.least_peaks
        return np.array([word for table in tables for word in (table.ctypes.data, *table.shape)], np.int64)


@dataclass(frozen=True)
class Problem:
    """An initial value problem; algebraic entries of y0 are first guesses."""

    program: Program
    y0: Array
    times: Array
    """Output times, strictly increasing, within the segments; may be empty."""
    segments: Array
    """Breakpoints t_0 < ... < t_end."""
    parameters: Array
    """One parameter vector for each segment."""
    rtol: float
    atol: Array
    margins: tuple[Guard, ...] = ()
    max_steps: int = 100_000
    max_seconds: float | None = None
    record_steps: bool = False
    exchanged: Array | None = None
    """Largest magnitude of each quadrature so far, if the problem continues another."""
    margin_peaks: Array | None = None
    """Largest magnitude of each margin so far, if the problem continues another."""
    spacing: float = np.inf
    """Longest time [s] of a step without a check against the equations inside; shorter features may be missed."""
    active: tuple[bool, ...] | None = None
    """Flags of the margins that are active in the modes of this problem; None if all are. Others may have any value."""
    line_error: float = 0.0
    """Largest error of linear interpolation between stored states, as a part of the range of each state; 0 if only
    outputs and ends of steps are stored.
    """
    elapsed: float = 0.0
    """Time [s] from the start of the run to that of the problem; stored states also resolve the logarithm of time."""
    extremes: Array | None = None
    """Least and largest states of the part that the problem continues, shape (2, states)."""
    continued: bool = False
    """True if another problem continues this one: a kink at its very end then counts, as between segments."""
    explicit: bool = False
    """True if steps may be explicit where the equations give their rates and are not stiff."""
    implicit_lanes: bool = False
    """True if a batch may take implicit steps of several runs at once."""
    edges: EdgeTables | None = None
    """Edges that the method itself may carry out; None if runs end at their guards."""

    def __post_init__(self) -> None:
        """Check the sizes of the arrays, which compiled code does not."""
        n, counts = self.program.n, (self.program.n_parameters, self.program.n_margins)
        given = self.y0.shape, self.atol.shape, self.parameters.shape, len(self.margins)
        if given != ((n,), (n,), (len(self.segments) - 1, counts[0]), counts[1]):
            message = f"y0, atol, parameters and margins have the sizes {given}"
            raise ValueError(f"{message}; the program has {n} states, {counts[0]} parameters and {counts[1]} margins.")

    def __getstate__(self) -> dict[str, Any]:
        """Return all but the machine code, which a model makes again."""
        return {**vars(self), "program": None}


def among(t: Array, times: Array) -> Mask:
    """Return a mask of the times that occur among other, sorted ones.

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
    """States and ledgers at a row of times, with their segments where the times do not determine them."""

    t: Array
    y: Array
    ledger: Array
    segment: Index | None = None

    def picked(self, rows: "Index | Mask | slice") -> "States":
        """Some of the rows."""
        assert self.segment is not None
        return States(self.t[rows], self.y[rows], self.ledger[rows], self.segment[rows])

    def in_order(self) -> "States":
        """Return them by segment and by time within it, each time once."""
        assert self.segment is not None
        order = np.lexsort((self.t, self.segment)) if self.segment.any() else self.t.argsort(kind="stable")
        t, segment, new = self.t[order], self.segment[order], np.ones(len(order), dtype=bool)
        new[1:] = (t[1:] != t[:-1]) | (segment[1:] != segment[:-1])
        return self.picked(order[new])


@dataclass(frozen=True)
class Points:
    """States at a row of times: steps or events."""

    t: Array
    y: Array
    ydot: Array
    ledger: Array
    segment: Index | None = field(default=None, kw_only=True)
    """Segment of each point, where several lie so close that the times do not determine it."""


@dataclass(frozen=True)
class Events(Points):
    """Events in order of time; ``index`` is the margin that crossed zero. Coincident ones have a row each."""

    index: Index = field(kw_only=True)


class EdgeCourse(NamedTuple):
    """Arcs and jumps of a run whose edges the compiled loop has carried out."""

    arcs: Array
    """For each arc: start, length, numbers of steps, outputs and stored interior states before it, and parameters."""
    jumps: Array
    """For each jump: the edge, the number of arcs before it, the energy turned into heat, the entropy produced, the
    heat and entropy passed to reservoirs, whether it is admissible, the work done in it by each source; then t, y, ydot
    and parameters before it and after it.
    """


class Result(NamedTuple):
    """A trajectory up to its end. Outputs beyond the end are absent."""

    problem: Problem
    status: Status
    t: float
    """Time reached: the end, the terminal event, or the last good state."""
    y: Array
    ydot: Array
    ledger: Array
    margins: Array
    """Margins at the end; if a run stalls, the one nearest zero is a hint at the reason."""
    times: Array
    outputs: Array
    ledger_outputs: Array
    events: Events
    counters: Counters
    steps: Points | None = None
    stepping: float = float("nan")
    """Time inside a library's steps [s], without outputs and events; NaN for a method that handles those itself."""
    segment: Index | None = None
    """Segment of each output, where the times do not determine it."""
    inside: States | None = None
    """States inside steps and at the start of segments that linear interpolation needs."""
    course: EdgeCourse | None = None
    """Arcs and jumps, if the method carries out edges."""
    known: States | None = None
    """All stored states, if the result consists of several arcs and stores states for linear interpolation."""

    def segments_at(self, t: Array, known: Index | None = None) -> Index:
        """Return the segment of each time; a breakpoint belongs to the segment that it ends."""
        return np.searchsorted(self.problem.segments[1:-1], t, side="left") if known is None else known

    def states(self) -> States:
        """Return all stored states in order of time, each once on each side of a breakpoint."""
        parts = [States(self.times, self.outputs, self.ledger_outputs)]
        if self.steps is not None:
            parts.append(States(self.steps.t, self.steps.y, self.steps.ledger))
        if self.inside is not None:
            parts.append(self.inside)
        t, y, ledger = (np.concatenate(columns) for columns in zip(*(part[:3] for part in parts), strict=True))
        segment = self.segments_at(t)
        if self.inside is not None:  # a state stored at a breakpoint belongs to its other side
            segment[len(t) - len(self.inside.t) :] += among(self.inside.t, self.problem.segments[1:-1])
        return States(t, y, ledger, segment).in_order()


class Solver(ABC):
    """A method for problems; stateless, hence shared between threads."""

    name: str
    counts_rejected = True
    """True if the method reports its number of rejected steps."""
    crosses_edges = False
    """True if the method carries out edges by itself."""

    def prepare(self) -> None:  # noqa: B027 - most methods need nothing
        """Load what the first solve needs, so that it does not count as run time."""

    @abstractmethod
    def solve(self, problem: Problem) -> Result:
        """Integrate a problem. A failure is a status of the result, never an exception or a wrong number."""

    def solve_all(self, problems: Sequence[Problem], threads: int = 1) -> list[Result]:
        """Integrate problems of one model, with the same results as one by one, whatever the number of threads."""
        return [self.solve(problem) for problem in problems]
