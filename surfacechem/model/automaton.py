"""The hybrid automaton of a scene: modes, edges with guards and reset maps, equilibria of gaps, and heat sinks."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import symengine

from surfacechem.expressions import Expression, where

ZERO, ONE = symengine.Integer(0), symengine.Integer(1)

SIDE_PATH = "mode.side"
"""Path of the mode that tells on which side of touch the gap is."""

SLIP_PATH = "mode.slip"
"""Path of the mode that tells stick from slip, and the slip direction."""

INTERFACE = "interface"
"""Key of the heat that the interface makes in a jump; the supports have the keys of their axes."""

FOLD_STIFFNESS = 1e-7
"""Tangent stiffness, relative to its parts, below which a quasi-static gap has lost its equilibrium (a fold)."""

REST_TIME_PATH = "run.rebounds_rest_at"
"""Path of the time at which rebounds too close for time to resolve come to rest (end of a Zeno sequence)."""


When = Mapping[Any, Collection[int]]
"""Values of modes, by their symbols, in which a guard is active; the other modes may have any value."""

ALWAYS: When = {}
"""Condition on no mode."""


def masked(guard: Expression, when: When) -> Expression:
    """Return the guard in the modes in which it is active, else 1."""
    for mode, values in when.items():
        guard = where(symengine.Mul(*((mode - value) ** 2 for value in values)) > 0, 1, guard)
    return guard


@dataclass(frozen=True)
class Discrete:
    """A variable that changes along edges only."""

    name: str

    @property
    def symbol(self) -> Any:
        """Its symbol, a parameter that edges change."""
        return symengine.Symbol(self.name)


@dataclass(frozen=True)
class Mode(Discrete):
    """A discrete state, such as stick or slip."""

    initial: float
    words: Mapping[float, str]
    """Meaning of each value."""
    start: Expression | None = None
    """The value at the start if it follows from the initial state."""
    waits: Mapping[float, str] = field(default_factory=dict)
    """Condition that ends a value, in words, for values that a complete run leaves."""

    @property
    def legend(self) -> str:
        """Its values with their meanings, in words."""
        return ", ".join(f"{value:g}: {word}" for value, word in self.words.items())


@dataclass(frozen=True)
class Register(Discrete):
    """A number that later arcs and jumps read: a time, a direction or an impulse."""

    text: str
    initial: float = 0.0
    given: Callable[[Mapping[str, float]], float] | None = None
    """The value at the start if it follows from the values of a case, by path."""


class Fold(NamedTuple):
    """A fold: the loss of the equilibrium of the quasi-static gaps."""

    tangent: Expression
    """Tangent stiffness: zero at the fold, positive before it."""
    falls: tuple[Expression, ...]
    """Decrease of the stiffness along each gap, which gives the direction of the snap-through."""
    stiffness: tuple[tuple[Expression, ...], ...]
    """Decrease of the driving traction of each gap along each gap, relative to the stiffness of the former."""
    warming: tuple[Mapping[str, Expression], ...]
    """Rise of the temperatures that follow each gap, by the heat of its motion [K/m]."""


class Edge(NamedTuple):
    """A guard that must stay positive while the modes are those of ``when``; at its zero, modes and state jump.

    ``modes`` gives new values of modes and registers, ``reset`` those of states, as expressions of the old ones. If the
    edge ``equilibrates``, the gaps then move to their next equilibrium. The energy released is ``heat`` of the bodies
    or of the interface.
    """

    name: str
    guard: Expression
    reason: str
    modes: Mapping[Any, Expression] = {}
    reset: Mapping[Any, Expression] = {}
    equilibrates: bool = False
    heat: str = "joint"
    """Part that dissipates the energy released before gaps move: 'joint', the support of the bodies along the normal;
    'local', the interface. After that the support of each gap that moves damps it, and slip makes the heat of friction.
    In a 'snap' the interface, which has given way, dissipates everything."""
    fold: Fold | None = None
    """The fold that the edge stands for, if any."""
    ends_stage: bool = False
    """True if nothing happens to the interface: a stage of the loading ends."""
    strict: bool = False
    """True if the guard has to become negative, not only touch zero."""
    rests: bool = False
    """True if the guard is a rate, for which a stay at zero counts as crossing."""
    measure: str = ""
    """The state that its guard measures, if edges in other modes measure the same state."""
    times: tuple[float, ...] = ()
    """Prescribed times [s] of the edge, if any."""
    return_time: Expression | None = None
    """Time of flight until it may occur again [s], zero if unknown; its guard restarts from an exact zero."""
    violation: str = "warn"
    """Response to a jump that would destroy entropy: refuse, warn or accept."""
    when: When = ALWAYS
    """Values of the modes in which it is active."""

    @property
    def is_impact(self) -> bool:
        """True for an impact: an instantaneous impulse, which may recur ever faster (Zeno behaviour)."""
        return self.return_time is not None

    @property
    def masked(self) -> Expression:
        """The guard while it is active, else 1, as one expression for reading and printing."""
        return masked(self.guard, self.when)


@dataclass(frozen=True)
class Constraint:
    """An inclusion as the automaton and the balances see it, stated as a whole or in parts, modes before edges."""

    modes: tuple[Mode, ...] = ()
    """Modes that tell whether it holds; a mode that is stated again is refined."""
    registers: tuple[Register, ...] = ()
    edges: tuple[Edge, ...] = ()
    active: Expression = 1
    """One while the balance of the constrained variable governs, zero while the constraint does."""
    reaction: Expression = 0
    """Reaction traction while it holds [Pa]."""
    at_once: bool = False
    """True if its edges precede other edges that are due at the same time."""
    resets: Callable[[Edge], Mapping[Any, Expression]] = lambda edge: {}
    """New values of its modes and registers along an edge of another constraint."""


class Equilibrium(NamedTuple):
    """A gap without inertia or damping: its balance of tractions, which holds at all times."""

    state: str
    residual: Expression
    """Traction that opens the gap, less the resistance [Pa]."""
    # The running error bound of the residual would not do: in a ramp it counts the rounding of time, which all
    # tractions at one time share.
    size: Expression
    """Size of the tractions that balance [Pa]."""
    coupled: Mapping[str, Expression] = {}
    """Gaps that move with it, and by how much: in elastic sticking the elastic gap follows the displacement."""
    active: Expression = 1
    """Zero in modes in which the gap is held."""
    slip: int = 0
    """Slip direction that opens the gap, 1 or -1; 0 if it is in equilibrium in every mode."""
    limit: Expression = 1
    """Friction limit [Pa] during slip; if it is zero, the gap may move either way in a jump."""

    @property
    def axis(self) -> str:
        """The axis along which it moves."""
        return self.state.partition("_")[2]


class Sink(NamedTuple):
    """A temperature node that takes part of the heat of a jump; a prescribed node passes it to the outside."""

    node: str
    T: Expression
    energy: Expression
    """Internal energy of the node [J/m^2]."""
    share: Expression
    prescribed: bool
