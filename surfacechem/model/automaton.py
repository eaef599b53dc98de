"""The hybrid automaton of a scene: modes, edges with guards and reset maps, equilibria of gaps, and sinks of heat."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from typing import Any

import symengine

from surfacechem.expressions import Expression, where

ZERO, ONE = symengine.Integer(0), symengine.Integer(1)

SIDE_PATH = "mode.side"
"""Path of the mode that says on which side of touch the gap is."""

SLIP_PATH = "mode.slip"
"""Path of the mode that says whether the interface sticks or slides, and in which direction."""

INTERFACE = "interface"
"""Key of the heat that the interface makes in a jump, beside those of the supports of the axes."""

FOLD_STIFFNESS = 1e-7
"""Tangent stiffness, relative to its parts, at which a quasi-static gap counts as having lost its equilibrium."""

REST_TIME_PATH = "run.rebounds_rest_at"
"""Path of the time at which rebounds too close for time to resolve come to rest (end of a Zeno sequence)."""


When = Mapping[Any, Collection[int]]
"""Values of modes, by their symbols, in which something is active; the other modes may have any value."""


def masked(guard: Expression, when: When) -> Expression:
    """The guard in the modes in which it is active, else 1."""
    for mode, values in when.items():
        guard = where(symengine.Mul(*((mode - value) ** 2 for value in values)) > 0, 1, guard)
    return guard


@dataclass(frozen=True)
class Mode:
    """A discrete variable, such as sticking or sliding; it changes along edges only."""

    name: str
    initial: float
    words: Mapping[float, str]
    """Meaning of each value."""
    start: Expression | None = None
    """The value at the start as it follows from the initial state, where it does."""
    waits: Mapping[float, str] = field(default_factory=dict)
    """Condition that ends a value, in words, for values that are meant to be left."""

    @property
    def symbol(self) -> Any:
        """Its symbol, a parameter that edges change."""
        return symengine.Symbol(self.name)

    @property
    def legend(self) -> str:
        """Its values with their meanings."""
        return ", ".join(f"{value:g}: {word}" for value, word in self.words.items())


@dataclass(frozen=True)
class Register:
    """A number that only edges write: a time, a direction or an impulse that what follows has to remember."""

    name: str
    text: str
    initial: float = 0.0
    given: Callable[[Mapping[str, float]], float] | None = None
    """The value at the start as it follows from what a case gives, by path, where it does."""

    @property
    def symbol(self) -> Any:
        """Its symbol, a parameter that edges change."""
        return symengine.Symbol(self.name)


@dataclass(frozen=True)
class Fold:
    """The loss of the equilibrium of the quasi-static gaps."""

    tangent: Expression
    """Zero at the fold, positive before it."""
    falls: tuple[Expression, ...]
    """Fall of the stiffness along each gap, which gives the direction of the snap-through."""
    stiffness: tuple[tuple[Expression, ...], ...]
    """Fall of the driving traction of each gap along each gap, relative to the stiffness of the former."""
    warming: tuple[Mapping[str, Expression], ...]
    """Rise of the temperatures that follow each gap, by the heat of its own motion [K/m]."""


@dataclass(frozen=True)
class Edge:
    """A guard that must stay positive while the modes are those of ``when``; at its zero, modes and state jump.

    ``modes`` gives new values of modes and registers, ``reset`` those of states, as expressions of the old ones. Then
    the gaps find their next equilibrium, where the edge ``equilibrates``, and the energy that this releases is ``heat``
    of the bodies or of the interface.
    """

    name: str
    guard: Expression
    reason: str
    modes: Mapping[Any, Expression] = field(default_factory=dict)
    reset: Mapping[Any, Expression] = field(default_factory=dict)
    equilibrates: bool = False
    heat: str = "joint"
    """Part that turns into heat what is released before gaps move: 'joint', the support of the bodies along the normal;
    'local', the interface. Then each gap that moves is damped by its own support, and sliding makes the heat of
    friction. In a 'snap' the interface, which has given way, makes it all.
    """
    fold: Fold | None = None
    """The fold that it is, if any."""
    passes: bool = False
    """Whether nothing happens to the interface: a stage of the loading ends."""
    strict: bool = False
    """Whether its guard has to be passed, not only touched."""
    measure: str = ""
    """The state that its guard measures, where those of other edges measure the same."""
    times: tuple[float, ...] = ()
    """Times [s] at which it happens, where these are given."""
    returns: Expression | None = None
    """Time in which it may happen again [s], zero where that is open: its guard begins anew at an exact zero."""
    violation: str = "warn"
    """Response to a jump that would destroy entropy: refuse, warn or accept."""
    when: When = field(default_factory=dict)
    """Modes in which it is active."""

    @property
    def is_impact(self) -> bool:
        """Whether it is an impact, instantaneous at infinite pressure, which may recur ever faster (Zeno behaviour)."""
        return self.returns is not None

    @property
    def masked(self) -> Expression:
        """The guard while it is active, else 1, as one expression to be read or printed."""
        return masked(self.guard, self.when)


@dataclass(frozen=True)
class Constraint:
    """An inclusion as automaton and balances see it; stated in parts, a mode before the edges that change it."""

    modes: tuple[Mode, ...] = ()
    """Modes, in which it holds or not; one that is stated again is refined."""
    registers: tuple[Register, ...] = ()
    edges: tuple[Edge, ...] = ()
    active: Expression = 1
    """One while the balance of the constrained variable governs, zero while the constraint does."""
    reaction: Expression = 0
    """Reaction traction while it holds [Pa]."""
    at_once: bool = False
    """Whether its edges come before those of others that are due at the same moment."""
    beside: Callable[[Edge], Mapping[Any, Expression]] = lambda edge: {}
    """New values of its modes and registers along an edge of another constraint."""


@dataclass(frozen=True)
class Equilibrium:
    """A gap without inertia or damping: its balance of tractions, which holds at every time."""

    state: str
    residual: Expression
    """Traction that drives the gap open, less what resists [Pa]."""
    # Not the residual's magnitude: in a ramp that counts the rounding of time, which all tractions of a moment share.
    size: Expression
    """Size of the tractions that balance [Pa]."""
    along: Mapping[str, Expression] = field(default_factory=dict)
    """Gaps that move with it, and how far: elastic sticking follows the displacement."""
    active: Expression = 1
    """Zero in modes in which it is held."""
    slides: int = 0
    """Direction in which the interface slides where it opens, 1 or -1; 0 where it is balanced in any mode."""
    bears: Expression = 1
    """Friction limit [Pa] of the interface that slides; where it is zero the gap moves either way in a jump."""

    @property
    def axis(self) -> str:
        """The axis along which it moves."""
        return self.state.partition("_")[2]


@dataclass(frozen=True)
class Sink:
    """A temperature node that takes part of the heat made in a jump; a prescribed one passes it on."""

    node: str
    T: Expression
    energy: Expression
    """Internal energy of the node [J/m^2]."""
    share: Expression
    prescribed: bool
