"""What the stages of the assembly share: each leaves its results here for the next."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import symengine

from surfacechem.contracts.terms import Friction, Load
from surfacechem.expressions import Expression
from surfacechem.model.automaton import Edge, Equilibrium, Mode, Register
from surfacechem.model.balances import Node, Power, Rows
from surfacechem.model.conductors import Profile
from surfacechem.model.refit import Fit
from surfacechem.model.system import Account, Capped, Caution, Margin, Named, Pace, Pair, Range, State
from surfacechem.model.variables import Parameters, Variables
from surfacechem.scene import Interface, Scene

NAMED = ("M", *(f"{x}_{k}" for x in "SUq" for k in ("1", "2", "c", "m", "t")))
"""Names of quantities that a parameter might have too: a law's M, or the second of two that are called q."""


@dataclass(frozen=True)
class Bond:
    """A bonding variable that is a state: its symbol, its rate and the amount per reference area where it is one."""

    symbol: Any
    dot: Any
    density: Expression


@dataclass
class Motion:
    """What the stages that let the gap and the interface move leave for each other."""

    mechanical: list[Expression] = field(default_factory=list)
    """Elastic and kinetic energies of the bodies [J/m^2]."""
    given: dict[str, Expression] = field(default_factory=dict)
    """What works in a jump [J/m^2], potentials of the far-field tractions above all, by the account of that work."""
    pulls: dict[str, tuple[Expression, ...]] = field(default_factory=dict)
    """Stiffness, displacement and traction of the far field, and the gap, by the account of the work."""
    far_fields: dict[str, Any] = field(default_factory=dict)
    """Mountings with their symbols, by direction."""
    drives: dict[str, Expression] = field(default_factory=dict)
    """Rates of the variables that a programme moves."""
    slips: tuple[Any, ...] = ()
    """What determines the tangential motion in each direction in which it moves by a balance."""
    slides_by: dict[str, Any] = field(default_factory=dict)
    """The variables that the balances of tangential tractions determine, where sliding has no inertia, by velocity."""
    creeping: Any = None
    """The friction law whose traction is the variable of sliding, where that is not the velocity."""
    sliding_tractions: dict[str, Expression] = field(default_factory=dict)
    """Traction that resists sliding along each direction, by axis."""
    stick_limits: dict[str, Expression] = field(default_factory=dict)
    """Tangential traction that sticking can bear along each direction, by axis."""
    jolted: dict[Any, Expression] = field(default_factory=dict)
    """New values of modes and states where loads jump, before what is in equilibrium with them follows."""
    rubs: Expression = field(default_factory=lambda: symengine.Integer(1))
    """Fraction of the interface on which friction acts, beside adhesion in parallel."""
    rubbed: Expression = field(default_factory=lambda: symengine.Integer(0))
    """Energy, per area of that fraction, of the elastic gap that friction slides on [J/m^2]."""
    follows: dict[Any, Expression] = field(default_factory=dict)
    """New values of states that follow the normal gap where it jumps."""
    gap_rates: dict[str, Expression] = field(default_factory=dict)
    """Rates of the gaps that move by a balance."""
    works: dict[Friction, str] = field(default_factory=dict)
    """Accounts of the work against friction where the velocity of sliding is prescribed."""
    heals: dict[Expression, Expression] = field(default_factory=dict)
    """New values of modes that a rigid contact has as it closes again."""


@dataclass(eq=False)
class Draft:
    """The system under construction."""

    scene: Scene
    parameters: Parameters = field(init=False)
    variables: Variables = field(init=False)
    t: Any = field(default_factory=lambda: symengine.Symbol("t"))
    nodes: dict[str, Node] = field(default_factory=dict)
    node_of: dict[str, Node] = field(default_factory=dict)
    """Node of each body name, of 'interface' and of 'surroundings'."""
    slabs: dict[str, Any] = field(default_factory=dict)
    """Bodies divided into cells, by name."""
    resistances: dict[str, Expression] = field(default_factory=dict)
    """L / k of the bodies that say how they conduct [m^2 K/W]."""
    profiles: list[Profile] = field(default_factory=list)
    psi: Expression = field(default_factory=lambda: symengine.Integer(0))
    states: list[State] = field(default_factory=list)
    named: list[Named] = field(default_factory=list)
    rows: Rows = field(default_factory=Rows)
    ledger: list[Account] = field(default_factory=list)
    margins: list[Margin] = field(default_factory=list)
    bonding: dict[str, Bond] = field(default_factory=dict)
    about: dict[Any, Expression] = field(default_factory=dict)
    """Initial values of the bonding variables, about which capacities are written."""
    bound_frictions: dict[Friction, Friction] = field(default_factory=dict)
    powers: list[Power] = field(default_factory=list)
    """All that passes energy on, from which the ledger and the balances of energy follow."""
    loads: dict[str, Load] = field(default_factory=dict)
    """Histories that are in use, by variable."""
    rates: dict[Any, Expression] = field(default_factory=dict)
    """Time derivatives of what the interface's free energy depends on beside temperature."""
    breakpoints: set[float] = field(default_factory=set)
    cycles: list[str] = field(default_factory=list)
    """Paths of the frequencies of histories that repeat themselves."""
    ranges: list[Range] = field(default_factory=list)
    capped: list[Capped] = field(default_factory=list)
    modes: list[Mode] = field(default_factory=list)
    registers: list[Register] = field(default_factory=list)
    edges: list[Edge] = field(default_factory=list)
    equilibria: list[Equilibrium] = field(default_factory=list)
    motion: Motion = field(default_factory=Motion)
    pairs: list[Pair] = field(default_factory=list)
    paces: list[Pace] = field(default_factory=list)
    cautions: list[Caution] = field(default_factory=list)
    conductances: dict[tuple[str, str], list[Expression]] = field(default_factory=dict)
    """Conductances in parallel between two ends [W/(m^2 K)]."""
    warnings: list[str] = field(default_factory=list)
    fit: Callable[[], Fit] | None = None
    """The fit of the medium's fluid, once a law asks for one of its properties."""
    used_names: set[str] = field(default_factory=set)

    def __post_init__(self) -> None:
        """Names that are taken."""
        custom = [body.temperature for body in self.scene.bodies if isinstance(body.temperature, str)]
        capacities = [f"C_{node}" for node in (*custom, self.interface.temperature) if isinstance(node, str)]
        self.parameters = Parameters(
            [*NAMED, *custom, *capacities, *(variable.name for variable in self.interface.variables)]
        )
        self.variables = Variables(self.parameters)

    @property
    def interface(self) -> Interface:
        """The interface of the scene."""
        return self.scene.interface
