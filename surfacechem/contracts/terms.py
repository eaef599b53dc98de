"""Contracts: what a law states and what it may read.

A law is one class. Its parameters are its fields, its YAML name is its class name in kebab-case, and its method states
the one formula; the argument names of the method say which quantities it reads. Everything else about it (schema,
listing, documentation, generic tests) is read off the class.

=================  ==================================================  ===========================
contract           states                                              audited for
=================  ==================================================  ===========================
:class:`Potential`     free energy; all conservative quantities follow     capacity > 0
:class:`BodyEnergy`    free energy of a body as a function of T            capacity > 0
:class:`Friction`      traction that opposes sliding                       traction * v >= 0
:class:`RateLaw`       net reaction rate                                   -mu * rate >= 0
:class:`HeatTransfer`  conductance between two temperatures                conductance >= 0
:class:`Load`          prescribed history of a variable                    --
:class:`Limit`         traction at which the interface gives way           energy, entropy of jumps
:class:`Factor`        how a parameter varies with one variable            --
=================  ==================================================  ===========================
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import ClassVar, Literal

from surfacechem.contracts.law import Factor, Law, Spec, Varying, option, optional, parameter, reads, resolved_unit
from surfacechem.expressions import Expression

__all__ = [
    "BodyEnergy",
    "Factor",
    "Friction",
    "HeatTransfer",
    "Law",
    "Limit",
    "Load",
    "Potential",
    "RateLaw",
    "RateType",
    "Spec",
    "TangentialPotential",
    "UnderPressure",
    "Varying",
    "option",
    "optional",
    "parameter",
    "reads",
    "resolved_unit",
]


class Potential(Law):
    """A term of the interface's Helmholtz free energy per area [J/m^2].

    As the surface stretches, its energy stays with the material (bonds, debris) or is a property of the surface that is
    there (tractions, films): a law says which by ``per``.
    """

    contract = "potential"
    formula = "energy"
    per: ClassVar[Literal["reference", "current"]] = "reference"
    """Area that the energy is per; the assembly multiplies those per current area by the area stretch."""

    energy: ClassVar[Callable[..., Expression]]
    repulsion: ClassVar[Callable[..., Expression] | None] = None
    """Part of the energy whose pressure the contact bears, for a law that attracts bodies which touch; None where
    a law either presses or pulls, so that its pressure is that of the contact."""


class TangentialPotential(Potential):
    """A potential of the tangential gap, which stands beside friction or carries it.

    In parallel its gap is the whole displacement, along which friction acts too, and the tractions add up. In series it
    is an elastic gap: as soon as its traction exceeds what friction bears the interface slides instead. Without shear
    the gap counts as zero, as where adhesion is made anew wherever the surfaces slide to.
    """

    shear: Literal["parallel", "series", "none"] = option(
        "how it acts with friction: 'parallel', beside it on the whole displacement, 'series', on an elastic gap that "
        "slides, or 'none', as if the tangential gap were zero",
        default="parallel",
    )
    unbonded: ClassVar[Callable[..., Expression] | None] = None
    """Fraction of the interface on which friction acts in parallel; all of it where a law does not say."""


class UnderPressure(Law):
    """A law of the contact pressure p: of the net one, or of that which the contact bears without attraction."""

    pressure: Literal["net", "contact"] = option(
        "the pressure that p stands for: 'net' of all attraction, p = -t_n, or 'contact', the repulsive part p_contact",
        default="net",
    )


class BodyEnergy(Law):
    """Helmholtz free energy of a body per unit reference area [J/m^2] as a function of its temperature."""

    contract = "capacity"
    formula = "energy"

    @abstractmethod
    def energy(self, T: Expression, T_0: Expression) -> Expression:
        """Free energy [J/m^2] at T [K]."""


class Friction(Law):
    """Tangential traction [Pa] while sliding, with the sign of sliding; dissipates traction * v >= 0.

    A law that jumps at v = 0 reads ``direction``, the sign of v, and states as ``limit`` what it can bear at rest. In
    the plane ``direction`` and ``direction_2`` are the components of the unit vector of sliding, and a law without
    ``transverse`` resists along it, by its traction at the speed of sliding.
    """

    contract = "friction"
    formula = "traction"
    breaks_bonds: ClassVar[bool] = False
    """Whether bonds break as sliding starts."""
    internal: ClassVar[Mapping[str, str]] = {}
    """Variables of its own that the law evolves, as logarithms, and what each is the logarithm of."""

    traction: ClassVar[Callable[..., Expression]]
    limit: ClassVar[Callable[..., Expression]]
    """Magnitude of the traction that sticking bears [Pa]; absent where a law does not stick."""
    drive: ClassVar[Callable[..., Expression]]
    """What sliding at a velocity takes, as one number that may stand for the velocity; absent where that serves."""
    velocity: ClassVar[Callable[..., Expression] | None] = None
    """Its inverse [m/s]."""
    driven: ClassVar[Callable[..., Expression]]
    """Traction by that number [Pa]."""
    transverse: ClassVar[Callable[..., Expression] | None] = None
    """Traction across v, along the interface [Pa]; None where a law is the same in all directions."""
    transverse_limit: ClassVar[Callable[..., Expression]]
    """What sticking bears across v alone [Pa], half an axis of an ellipse; absent where a law has no ``transverse``."""
    evolution: ClassVar[Callable[..., Mapping[str, Expression]]]
    """Rates of the law's own variables [1/s]; absent where it has none."""

    @property
    def has_limit(self) -> bool:
        """Whether the interface can stick by this law."""
        return hasattr(self, "limit")


@dataclass(frozen=True)
class RateType:
    """A rate type of mechanisms: an Arrhenius coefficient times what load does to one coefficient of a law."""

    name: str
    """Name in a mechanism."""
    factor: str
    """Method of the law that states the logarithm of what load does."""
    constants: Mapping[str, float]
    """Parameters of the law that the Arrhenius coefficient stands for: one, or zero where the other way counts."""
    names: tuple[str, ...] = ()
    """Parameters of the law that a reaction has by the same names, and with the same defaults."""
    renamed: Mapping[str, str] = field(default_factory=dict)
    """Parameters that every reaction gives, by names of its own, each with that in the law."""
    ratios: Mapping[str, str] = field(default_factory=dict)
    """The same for rate constants, which count in the Arrhenius coefficient."""
    distance: str = ""
    """Parameter of the law whose work against the force per bond is the whole factor, if it is."""


class RateLaw(Law):
    """Net rate [1/(m^2 s)] of a reaction per unit current area; dissipates -mu * rate >= 0."""

    contract = "bonding"
    formula = "rate"

    keeps_range: ClassVar[bool] = False
    """Whether its form keeps phi between zero and one, or below phi_max where it reads the partners n_1 and n_2; what
    any other law carries to a bound is held there."""
    rate_types: ClassVar[tuple[RateType, ...]] = ()
    """What mechanisms may use of it."""
    rate: ClassVar[Callable[..., Expression]]
    envelope: ClassVar[Callable[..., Expression] | None] = None
    """Largest fraction of bonds that an opening leaves, for a law by which bonds break gradually."""

    def stoichiometry(self) -> Mapping[str, int | float]:
        """Change of each bonding variable, in its own amounts, per unit of reaction."""
        return {"phi": 1}

    @property
    def log_rate(self) -> Callable[..., Expression] | None:
        """Logarithm of the rate where the law runs one way only; None where its rate vanishes with the affinity.

        A one-way law and one that undoes it are held against the equilibrium of the potential.
        """
        return None

    @property
    def one_way(self) -> bool:
        """Whether the law runs one way only."""
        return self.log_rate is not None

    def turnover(self) -> Mapping[str, int | float]:
        """Change of everything that takes part, what is no bonding variable included: one law may undo another."""
        return self.stoichiometry()

    @property
    def distance(self) -> Expression | None:
        """Distance to the transition state [m] along the force per bond, where that is all that the force does."""
        return None

    @property
    def balanced(self) -> bool:
        """Whether the reverse follows from the affinity, with which the rate vanishes."""
        return "mu" in reads(self.statement)

    @property
    def length(self) -> Expression | None:
        """How far a bond that the law forms lets a load down [m]; None where the law runs one way or does not say."""
        return None

    @property
    def lacks_length(self) -> bool:
        """Whether the rate feels a force that the affinity, from which its reverse follows, does not know."""
        return self.balanced and self.length is None and "f" in reads(self.statement)

    @property
    def taken(self) -> tuple[Callable[..., Expression], Callable[..., Expression]] | None:
        """Enthalpy and Gibbs energy [J] that one reaction takes from what is beside the interface; None where nothing.

        The first is energy that comes in, the second is part of the affinity.
        """
        return None

    @property
    def log_ratio(self) -> Callable[..., Expression] | None:
        """Logarithm of the forward over the backward rate where the law states both; None where they are not its own.

        It is held against the equilibrium of the potential.
        """
        return None


class HeatTransfer(Law):
    """Conductance [W/(m^2 K)] between two temperatures; heat flows from hot to cold.

    A formula that reads ``T_from`` and ``T_to`` gets the temperatures of the two ends.
    """

    contract = "heat"
    formula = "conductance"
    channel: ClassVar[str] = "conduction"
    """What carries the heat, for the names of fluxes."""

    between: tuple[str, str] = option("the two ends: body names, 'interface' or 'surroundings'")
    closure: Literal["direct", "medium", "mean"] = option(
        "'direct' from end to end, 'medium' through the interface with twice the conductance on each side (through a "
        "film as heat made across it leaves it), or 'mean' from the interface into both bodies alike, driven by T_c "
        "over the harmonic mean of their temperatures: it may heat the hotter body from a cooler interface",
        default="direct",
    )
    conductance: ClassVar[Callable[..., Expression]]
    resistances: ClassVar[Callable[..., tuple[Expression, Expression, Expression]] | None] = None
    """Resistances of the first wall, the film and the second wall [m^2 K/W]; None where heat is not made across."""

    def channels(self) -> Mapping[str, Callable[..., Expression]]:
        """The conductances in parallel that the whole is the sum of, by what carries the heat."""
        return {self.channel: self.statement}


class Limit(Law):
    """Traction [Pa] at which the interface gives way at once.

    The jump conserves energy. Where it would destroy entropy the run follows ``violation``: refuse, warn or accept.
    ``release`` says what takes part: 'joint' lets the bodies relax within the jump; 'local' leaves the gap as it is and
    lets the interface pay alone, before a gap without inertia follows.
    Bonds of a mechanism break into what the first reaction that breaks them makes of them.
    """

    contract = "limit"
    formula = "strength"

    release: Literal["joint", "local"] = option("what takes part in the jump: joint or local", default="joint")
    violation: Literal["refuse", "warn", "accept"] = option("what to do where entropy would fall", default="warn")
    breaks: str = option("the species of a mechanism whose bonds break; all bonds if not given", default="")
    strength: ClassVar[Callable[..., Expression]]


class Load(Law):
    """Prescribed history of a variable."""

    contract = "loading"
    formula = "value"

    local: ClassVar[dict[str, str]] = {}
    """Names and units of fields whose values change from one piece of the history to the next."""
    cycle: ClassVar[str] = ""
    """Field that is the frequency of a history that repeats itself."""

    @abstractmethod
    def value(self, t: Expression) -> Expression:
        """Value at time t [s]."""

    def breakpoints(self) -> tuple[float, ...]:
        """Times [s] at which the history or its slope jumps."""
        return ()

    def jumps(self) -> tuple[float, ...]:
        """Times [s] at which the value itself jumps."""
        return ()

    def piece(self, start: float) -> Mapping[str, float]:
        """Values of the local fields on the piece that begins at time ``start`` [s]."""
        return {}
