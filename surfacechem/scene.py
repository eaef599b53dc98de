"""A scene: two bodies, the interface between them, heat paths, loading and initial values. Plain data, SI units."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from surfacechem.contracts.terms import (
    BodyEnergy,
    FilmGrowth,
    Fluid,
    Friction,
    HeatTransfer,
    Law,
    Limit,
    Load,
    Potential,
    Property,
    RateLaw,
    option,
    parameter,
)
from surfacechem.errors import InputError, Place
from surfacechem.quantities import Quantity

MOST_CELLS = 4096
"""Largest number of cells across a body that a case may give."""


class Body(NamedTuple):
    """One of the two bodies.

    ``temperature`` is the name of the body's temperature node, or a prescribed history; bodies and interface that share
    a node are in perfect thermal contact. Without ``energy`` the body is a reservoir.
    """

    name: str
    temperature: str | Load
    energy: BodyEnergy | None = None
    conduction: Conduction | None = None


class Conduction(Law):
    r"""Heat conduction across a body, from the contact (x = 0) to its far side.

    .. math:: \frac{C(T)}{L}\,\dot T = \frac{\partial}{\partial x}\Big(k\,\frac{\partial T}{\partial x}\Big)

    The body's heat capacity C, per area, is spread over its thickness L. Its temperature is that at the contact; cells
    divide the thickness, in finite volumes of second order, graded as given or towards a ``layer``. Without cells the
    body is one lump. Far side: insulated, held at a temperature, or cooled through ``h_far``. Source: Carslaw & Jaeger
    (1959), Conduction of Heat in Solids, chapter III; the first law in one dimension.
    """

    contract = "conduction"

    thickness: float = parameter("m", "thickness of the body", above=0, varies=False)
    conductivity: float = parameter("W/(m K)", "thermal conductivity", above=0)
    h_far: float | None = parameter(
        "W/(m^2 K)", "conductance at the far side, to what is beyond", default=None, at_least=0, varies=False
    )
    cells: int = option("number of cells; 0 for a lump", default=0)
    accuracy: float | None = option("relative accuracy of temperatures, by which a run chooses the cells", default=None)
    after: float | None = option("time after something sudden from which on the accuracy holds", default=None)
    grading: float = option("width of the cells at the far side over that at the contact", default=1.0)
    far: Load | None = option("temperature at the far side, or beyond it; none where insulated", default=None)
    layer: float = option(
        "part of the thickness that heat has reached when a run is first looked at, towards which cells are graded; "
        "0 where they are graded as given",
        default=0.0,
    )

    @property
    def points(self) -> tuple[float, ...]:
        """Edges of the cells from the contact to the far side, as fractions of the thickness."""
        if self.layer:
            return layered(self.cells, self.layer, both=self.far is not None)
        return graded(self.cells, self.grading)

    @property
    def held(self) -> bool:
        """True if the far side has a prescribed temperature."""
        return self.far is not None and self.h_far is None


class Mounting(Law):
    r"""Mounting of the bodies in one direction of the gap: mass, springs and dampers. Terms left out are absent.

    .. math:: m \ddot g = k (w - g) + c_b (\dot w - \dot g) + F - t - c_g \dot g

    With a mass the gap is inertial, with a damper alone overdamped, with a stiffness alone quasi-static; with a
    far-field traction and nothing else it is under dead load. Source: lumped form of the momentum balance of Sauer,
    Duong & Mandadapu (2021), eq. e:sf_moc.

    Without a potential that bears the bodies their contact is rigid. A mass that reaches it with the velocity
    :math:`v < 0` rebounds with :math:`-e\,v`, and :math:`(1 - e^2)\,m v^2/2` becomes heat in the bodies (Newton's law
    of impact; Brogliato (2016), Nonsmooth Mechanics, doi 10.1007/978-3-319-28664-8). A rebound is never assumed:
    without e the bodies rest on each other as soon as they meet.
    """

    contract = "mechanics"

    k: float = parameter("Pa/m", "stiffness of both bodies in series", default=0.0, at_least=0, varies=False)
    m: float = parameter(
        "kg/m^2", "reduced mass of both bodies, m_1 m_2 / (m_1 + m_2)", default=0.0, at_least=0, varies=False
    )
    c_b: float = parameter(
        "Pa s/m", "damper beside the stiffness; heats the bodies", default=0.0, at_least=0, varies=False
    )
    c_g: float = parameter("Pa s/m", "damper beside the interface; heats it", default=0.0, at_least=0, varies=False)
    beta_1: float = parameter(
        "1", "fraction of the heat of c_b that goes into body 1", default=0.5, at_least=0, at_most=1, varies=False
    )
    e: float = parameter(
        "1", "coefficient of restitution of a rigid contact", default=0.0, at_least=0, at_most=1, varies=False
    )


class Stage(NamedTuple):
    """A stage of the loading: rates of the variables that it moves, and the condition that ends it, if any.

    ``event`` is the name of a transition, or its beginning; ``variable`` ends the stage at ``value``. Only the last
    stage may have no end.
    """

    name: str
    rates: Mapping[str, float] = {}
    """Rates by variable, in its unit per second."""
    duration: float | None = None
    """Length [s]."""
    variable: str = ""
    value: float = 0.0
    rising: bool = True
    """True if the variable reaches the value from below."""
    event: str = ""
    place: Place | None = None


@dataclass(frozen=True)
class Sites:
    """Bonding site densities [1/m^2] of the undeformed surfaces; the reference side defines phi = n_b / n_c."""

    density_1: float
    density_2: float
    reference: int = 1

    def __post_init__(self) -> None:
        """Check that densities are positive and the reference side exists."""
        if not (self.density_1 > 0 and self.density_2 > 0):
            raise InputError("site densities must be positive.")
        if self.reference not in (1, 2):
            raise InputError(f"the reference side is 1 or 2, not {self.reference}.")

    @property
    def density(self) -> float:
        """Reference density N_c [1/m^2]."""
        return self.density_1 if self.reference == 1 else self.density_2

    @property
    def phi_max(self) -> float:
        """Largest possible bonding state: min(n_1, n_2) / n_c."""
        return min(self.density_1, self.density_2) / self.density


class BondingVariable(NamedTuple):
    """A bonding variable other than phi, such as a coverage of a mechanism.

    ``density`` is the amount per reference area [1/m^2] at which the variable is one.
    """

    name: str
    density: float
    long_name: str = ""
    species: str = ""
    """Name in the mechanism."""


class Electrode(NamedTuple):
    """A phase next to the surface whose potential follows from its charge."""

    phase: str
    """Its name as part of names of quantities."""
    title: str
    potential: Quantity
    start: float
    """Initial potential [V]."""
    capacitance: float
    """Capacitance [F/m^2]."""
    current: Load | None = None
    """Electric current into it from outside [A/m^2]; None if zero."""

    @property
    def drive(self) -> Quantity:
        """The current from outside as a quantity."""
        return Quantity(f"j_{self.phase}", "A/m^2", f"current into {self.title} from outside, per reference area")


class Engine(Protocol):
    """External evaluator of some parameters of the scene during a run, as functions of its variables."""

    @property
    def reads(self) -> tuple[str, ...]:
        """Names of the variables that it reads."""

    @property
    def gives(self) -> tuple[str, ...]:
        """Paths of the parameters that it gives."""

    @property
    def histories(self) -> Sequence[tuple[Quantity, Load]]:
        """Prescribed histories that it reads, in addition to the state of the scene."""

    @property
    def electrodes(self) -> Sequence[Electrode]:
        """Electrodes whose potentials it reads; they are states of the scene."""

    def limits(self, values: Mapping[str, Any]) -> Iterable[tuple[str, Any, str]]:
        """Margins of these histories that must stay positive: name, expression, and the reason if it fails.

        ``values`` are the expressions of the histories by name.
        """

    @property
    def names(self) -> Mapping[str, str]:
        """Names, for use in names of quantities, of species that reactions produce in neighbours, by species."""

    @property
    def charges(self) -> Mapping[str, Mapping[str, float]]:
        """Charge [C] per molecule of each charged one of these species, by phase."""

    def __call__(self, values: Sequence[float]) -> NDArray[np.float64]:
        """Return values of the parameters at values of the variables."""


class Medium(NamedTuple):
    """Medium between the bodies: a fluid, or single properties by name (k_m, eta_m, rho_m, cp_m).

    A given property replaces that of the fluid. Without ``thickness`` [m] the medium fills the normal gap, or is a film
    whose thickness changes by ``growth``.
    ``temperatures`` [K] are values that the fit of the fluid's properties must cover.
    """

    fluid: Fluid | None = None
    properties: Mapping[str, float | Property] = {}
    thickness: float | None = None
    temperatures: tuple[float, ...] = ()
    growth: Sequence[FilmGrowth] = ()


@dataclass(frozen=True)
class Interface:
    """Interface between the bodies: its laws, bonding variables, temperature and medium.

    ``temperature`` is the interface's node, a prescribed history, or None without a medium. In that case the heat of
    friction and reactions goes directly into the bodies: the fraction ``partition`` into body 1, the fraction ``loss``
    into the surroundings and the rest into body 2.
    """

    temperature: str | Load | None = None
    potentials: Sequence[Potential] = ()
    frictions: Sequence[Friction] = ()
    reactions: Sequence[RateLaw] = ()
    sites: Sites | None = None
    partition: float = 0.5
    variables: Sequence[BondingVariable] = ()
    bonds: Sequence[str] = ()
    """Names of those variables that count as bonds if phi is not a state."""
    limits: Sequence[Limit] = ()
    loss: float = 0.0
    medium: Medium | None = None
    engine: Engine | None = None
    """Engine that evaluates the rates that are not formulas."""
    remarks: Sequence[str] = ()
    """Remarks on the source of the laws, for readers of the results."""

    @cached_property
    def owners(self) -> dict[str, list[str]]:
        """Paths of the laws, and of the factors of their parameters, by the kind of law."""
        kinds = {"potential": self.potentials, "friction": self.frictions, "reaction": self.reactions}
        laws: dict[str, Sequence[Law]] = {**kinds, "limit": self.limits}
        return {kind: [x.path for law in own for x in (law, *law.factors)] for kind, own in laws.items()}

    @property
    def electrodes(self) -> Sequence[Electrode]:
        """Phases beside it whose potential follows from their charge."""
        return self.engine.electrodes if self.engine else ()

    @property
    def phi_max(self) -> float:
        """Largest possible bonding state."""
        return self.sites.phi_max if self.sites else 1.0

    @property
    def is_even(self) -> bool:
        """True unless one body has fewer sites than the other; which one, the values of a run say."""
        return self.sites is None or self.sites.density_1 == self.sites.density_2


@dataclass(frozen=True)
class Scene:
    """The complete input of a computation."""

    bodies: tuple[Body, Body]
    interface: Interface
    heat: Sequence[HeatTransfer] = ()
    loading: Mapping[str, Load] = field(default_factory=dict)
    surroundings: Load | None = None
    T_0: float | None = None
    initial: Mapping[str, float] = field(default_factory=dict)
    normal: Mounting | None = None
    """Mounting of the normal gap, if it moves by a balance."""
    tangential: Mounting | None = None
    """Mounting of the tangential displacement, if it moves by a balance."""
    transverse: Mounting | None = None
    """Mounting of the transverse displacement, if it differs from ``tangential``; the mass is the same."""
    programme: Sequence[Stage] = ()
    """Stages of the loading, in order."""
    surface: Potential | None = None
    """Free energy of two surfaces of given shapes; quantities otherwise per area are then totals of the pair."""


def graded(cells: int, grading: float = 1.0) -> tuple[float, ...]:
    """Return the points of ``cells`` cells with widths in a geometric series, ``grading`` from the first to the last.

    The mapping is smooth and the same for every number of cells, so that halving the cells shows the error.

    >>> graded(4)
    (0.0, 0.25, 0.5, 0.75, 1.0)
    >>> [round(point, 12) for point in graded(2, grading=9.0)]
    [0.0, 0.25, 1.0]
    """
    if grading == 1.0:
        return tuple(i / cells for i in range(cells + 1))
    s = math.log(grading)
    return (*(math.expm1(s * i / cells) / math.expm1(s) for i in range(cells)), 1.0)


def layered(cells: int, layer: float, both: bool = False) -> tuple[float, ...]:
    """Return the points of cells whose width is proportional to their distance from the contact plus a ``layer``.

    With ``both`` also to the distance from the far side. Layers of every depth from ``layer`` on are then equally well
    resolved. The mapping is smooth and the same for every number of cells.

    >>> [round(point, 12) for point in layered(2, layer=1 / 8)]
    [0.0, 0.25, 1.0]
    >>> [round(point, 12) for point in layered(2, layer=1 / 8, both=True)]
    [0.0, 0.5, 1.0]
    """
    s = e_folds(layer, both)
    if not both:
        return (*(layer * math.expm1(s * i / cells) for i in range(cells)), 1.0)
    ratio = layer / (1 + layer)
    near = [layer * math.expm1(s * i / cells) / (1 + ratio * math.exp(s * i / cells)) for i in range(cells // 2 + 1)]
    return (*near, *(1 - x for x in reversed(near[: (cells + 1) // 2])))


def e_folds(layer: float, both: bool = False) -> float:
    """Return the logarithm of the growth of the cell width, plus that of its decay towards a far side with layers."""
    return math.log1p(1 / layer) * (2 if both else 1)


def volume_shares(at: tuple[float, ...]) -> tuple[float, ...]:
    """Return the volume fraction of each point: half of the cells on either side.

    >>> volume_shares((0.0, 0.25, 1.0))
    (0.125, 0.5, 0.375)
    """
    widths = [b - a for a, b in pairwise(at)]
    return tuple((a + b) / 2 for a, b in zip([0.0, *widths], [*widths, 0.0], strict=True))
