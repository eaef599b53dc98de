"""Contracts: the statement of a law and the variables that it may read.

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
:class:`Property`      property of the medium between the bodies           --
:class:`Shape`         surface of a body                                   --
:class:`PairEnergy`    energy of two points at a distance                  --
:class:`FilmGrowth`    rate at which the medium between the bodies thickens  --
=================  ==================================================  ===========================

A :class:`Fluid` is a medium whose properties have no formula.
"""

from __future__ import annotations

import copy
import dataclasses
import inspect
import math
import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, lru_cache
from typing import TYPE_CHECKING, Any, ClassVar, Literal, NamedTuple, Self, dataclass_transform

from surfacechem.contracts.units import quotient
from surfacechem.errors import InputError, Place
from surfacechem.expressions import Expression

if TYPE_CHECKING:
    from surfacechem.contracts.fits import Piece


class Spec(NamedTuple):
    """Specification of a parameter: unit ("[x]" is the unit of the loaded quantity), meaning and allowed range.

    ``stretch`` is the power of the area stretch J_c that multiplies the given value in the formula: -1 if the value is
    a density per reference area that stays with the material, while the formula reads one per current area.
    """

    unit: str
    text: str
    above: float = -math.inf
    at_least: float = -math.inf
    at_most: float = math.inf
    varies: bool = True
    stretch: int = 0

    def resolved(self, x: str) -> Spec:
        """Return the specification with "[x]" replaced by a unit."""
        return _resolved(self, x)

    def check(self, name: str, value: float) -> None:
        """Raise InputError unless the value is finite and in range."""
        if not math.isfinite(value):
            raise InputError(f"{name} must be finite, got {value}.")
        if value <= self.above or value < self.at_least or value > self.at_most:
            raise InputError(f"{name} = {value:g} is outside its range: {self.range}.")

    @property
    def range(self) -> str:
        """The allowed range in words."""
        bounds = (("> ", self.above), (">= ", self.at_least), ("<= ", self.at_most))
        return " and ".join(f"{sign}{bound:g}" for sign, bound in bounds if math.isfinite(bound)) or "any"


@lru_cache(maxsize=1024)  # asked for each entry of a list
def _resolved(spec: Spec, x: str) -> Spec:
    return spec._replace(unit=resolved_unit(spec.unit, x))


def resolved_unit(unit: str, x: str) -> str:
    """Return a unit with "[x]" replaced.

    >>> resolved_unit("[x]/s", "m/s")
    'm/s^2'
    """
    top, _, bottom = unit.partition("/")
    return quotient(*(x if part == "[x]" else part for part in (top, bottom))) if "[x]" in unit else unit


def parameter(
    unit: str,
    text: str,
    *,
    default: Any = dataclasses.MISSING,
    above: float = -math.inf,
    at_least: float = -math.inf,
    at_most: float = math.inf,
    varies: bool = True,
    stretch: int = 0,
) -> Any:
    """Declare a numeric parameter of a law, in SI units; ``varies`` lets a case multiply it by factors of variables.

    ``stretch`` is the power of the area stretch that multiplies it, see :class:`Spec`.
    With the default None the formula defines the behaviour without a value.
    """
    spec = Spec(unit, text, above, at_least, at_most, varies, stretch)
    return field(default=default, metadata={"spec": spec})


def option(text: str, *, default: Any = dataclasses.MISSING) -> Any:
    """Declare a structural field of a law: a name or a list, not a number that a sweep may change."""
    return field(default=default, metadata={"option": text})


@dataclass_transform(kw_only_default=True, frozen_default=True, field_specifiers=(parameter, option))
# Two laws with the same numbers are two terms of a scene: they compare by identity.
@dataclass(frozen=True, kw_only=True, eq=False)
class Law(ABC):
    """A named law with parameters as fields. Subclasses become frozen, keyword-only dataclasses."""

    contract: ClassVar[str] = "law"
    formula: ClassVar[str] = ""
    """Name of the method that states the law."""
    positive: ClassVar[tuple[str, ...]] = ()
    """Variables that must stay above zero for the law to hold."""
    nonnegative: ClassVar[tuple[str, ...]] = ()
    """Variables that must not fall below zero, or below their value in :attr:`least`."""

    place: Place | None = field(default=None, repr=False)
    """Place of the law in its case file; None for laws built in Python."""

    def __init_subclass__(cls, **keywords: Any) -> None:
        super().__init_subclass__(**keywords)
        dataclass(frozen=True, kw_only=True, eq=False)(cls)

    def __post_init__(self) -> None:
        """Check every numeric parameter against its range."""
        for name, spec in self.specs():
            value = getattr(self, name)
            # Symbols, which `bind` inserts, have no value to check.
            if isinstance(value, Varying):
                spec.check(name, value.value)
            elif isinstance(value, int | float):
                spec.check(name, value)

    @classmethod
    @cache
    def name(cls) -> str:
        """The name of the law in a case file."""
        return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "-", cls.__name__).lower()

    @property
    def ranges(self) -> Mapping[str, tuple[float, float]]:
        """Ranges of variables outside which the law is an extrapolation; a run that leaves them reports it."""
        return {}

    @property
    def limits(self) -> Mapping[str, tuple[Expression, Expression]]:
        """Ranges of variables outside which the law has no value; a run that reaches their end stops."""
        return {}

    @property
    def least(self) -> Mapping[str, Expression]:
        """Least values of ``nonnegative`` variables whose bound is not zero."""
        return {}

    @property
    def peaks(self) -> Mapping[str, Expression | Sequence[Expression]]:
        """Values of variables near which the formula varies on a short scale: peaks, ends and bends.

        A step must not pass over them.
        """
        return {}

    @property
    def kinks(self) -> Mapping[str, Expression]:
        """Values of variables at which the formula has a kink, so that a step has to end there."""
        return {}

    @classmethod
    def is_stated(cls) -> bool:
        """True if a class has its formula; a common base of several laws has none."""
        return hasattr(cls, cls.formula) and not inspect.isabstract(cls)

    @property
    def statement(self) -> Callable[..., Expression]:
        """The bound method that states the law."""
        method: Callable[..., Expression] = getattr(self, self.formula)
        return method

    @property
    def path(self) -> str:
        """Dotted path of the law in its case file, else its name."""
        return self.place.path if self.place else self.name()

    @property
    def label(self) -> str:
        """Short name for the quantities of this law."""
        return self.name().replace("-", "_")

    @property
    def title(self) -> str:
        """The law in words."""
        return self.name().replace("-", " ")

    @property
    def called(self) -> str:
        """Name of the law in messages of runs that leave its range."""
        return f"the law {self.name()}"

    @classmethod
    @cache
    def specs(cls) -> tuple[tuple[str, Spec], ...]:
        """Return names and specifications of the numeric parameters."""
        return tuple((item.name, item.metadata["spec"]) for item in dataclasses.fields(cls) if "spec" in item.metadata)

    @classmethod
    def options(cls) -> list[tuple[str, str]]:
        """Return names and meanings of the structural fields."""
        return [(item.name, item.metadata["option"]) for item in dataclasses.fields(cls) if "option" in item.metadata]

    @property
    def varying(self) -> dict[str, Varying]:
        """Parameters that depend on variables, by name."""
        values = {name: getattr(self, name) for name, _ in self.specs()}
        return {name: value for name, value in values.items() if isinstance(value, Varying)}

    @property
    def factors(self) -> list[Factor]:
        """The factors of all parameters that depend on variables."""
        return [factor for value in self.varying.values() for factor in value.factors]

    def at_reference(self) -> Self:
        """Return the law with its varying parameters at their reference values."""
        return self.bind({name: value.value for name, value in self.varying.items()})

    def source(self, argument: str) -> str:
        """Return the variable of the scene that an argument stands for."""
        return argument

    def refine(self, name: str, spec: Spec) -> Spec:
        """Return the specification of a parameter of this law, if its unit depends on the other fields."""
        return spec

    def is_default(self, name: str) -> bool:
        """True if a parameter has its default value, so that it is a constant of the formula."""
        default = next(item.default for item in dataclasses.fields(self) if item.name == name)
        return bool(getattr(self, name) == default)

    def with_parts(self, bind: Callable[[Law, str, str], Any]) -> Self:
        """Return the law with its shared sublaws, if any, bound by ``bind``.

        ``bind`` gets a law, the path under which a case finds its parameters, and a suffix of their names.
        """
        return self

    def surrogate(self) -> Self:
        """Return a cheap substitute for a costly law, so that everything else can be checked first."""
        return self

    @property
    def error(self) -> float:
        """Relative error of the numbers that the law computes internally; zero for a formula."""
        return 0.0

    def perturbed(self) -> Self:
        """Return the law perturbed by its :attr:`error`."""
        return self

    def given(self, numbers: Mapping[str, float]) -> Self:
        """Return the law with other numbers, which are checked."""
        changed: Any = dict(numbers)
        return dataclasses.replace(self, **changed)

    def bind(self, values: Mapping[str, Expression]) -> Self:
        """Return the law with some of its parameters replaced, by symbols for instance; without a check."""
        # Not `replace`, which would check symbols against ranges.
        bound = copy.copy(self)
        for name, value in values.items():
            object.__setattr__(bound, name, value)
        return bound


class Varying(NamedTuple):
    """A parameter that depends on variables: a value at the reference state times factors."""

    value: float
    factors: tuple[Factor, ...]


def reads(formula: Callable[..., Expression]) -> tuple[str, ...]:
    """Return the quantities that a formula reads: the names of its arguments."""
    # The arguments are the only declaration of what a formula reads.
    return tuple(inspect.signature(formula).parameters)


def optional(formula: Callable[..., Expression]) -> frozenset[str]:
    """Return the optional quantities of a formula, which a scene may lack: the arguments with a default."""
    arguments = inspect.signature(formula).parameters.values()
    return frozenset(item.name for item in arguments if item.default is not inspect.Parameter.empty)


class Factor(Law):
    """A factor of a parameter's value that varies with one variable."""

    contract = "factor"
    formula = "factor"

    keeps_sign: ClassVar[bool] = False
    """True if the factor is positive for any value of the variable."""

    of: str = option("variable it depends on", default="T_c")

    factor: ClassVar[Callable[..., Expression]]

    def source(self, argument: str) -> str:
        """Return the variable of the scene that an argument stands for; that of x is an option."""
        return self.of if argument == "x" else argument


class Potential(Law):
    """A term of the interface's Helmholtz free energy per area [J/m^2].

    As the surface stretches, the energy stays with the material (bonds, debris) or belongs to the current surface
    (tractions, films): ``per`` states which.
    """

    contract = "potential"
    formula = "energy"
    per: ClassVar[Literal["reference", "current"]] = "reference"
    """Reference area of the energy; the assembly multiplies an energy per current area by the area stretch."""

    energy: ClassVar[Callable[..., Expression]]
    repulsion: ClassVar[Callable[..., Expression] | None] = None
    """Repulsive part of the energy, whose pressure the contact bears, for a law that also attracts bodies in contact.
    None if a law either repels or attracts, so that its pressure is that of the contact."""


class TangentialPotential(Potential):
    """A potential of the tangential gap, in parallel or in series with friction.

    In parallel its gap is the whole displacement, along which friction acts too, and the tractions add up. In series it
    is an elastic gap: when its traction exceeds the friction limit the interface slides. Without shear the gap counts
    as zero, as for adhesion that forms anew during slip.
    """

    shear: Literal["parallel", "series", "none"] = option(
        "how it acts with friction: 'parallel', beside it on the whole displacement, 'series', on an elastic gap that "
        "slides, or 'none', as if the tangential gap were zero",
        default="parallel",
    )
    unbonded: ClassVar[Callable[..., Expression] | None] = None
    """Fraction of the interface on which friction acts in parallel; all of it by default."""


class UnderPressure(Law):
    """A law of the contact pressure p: the net one, or the one that the contact bears without attraction."""

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
    """Tangential traction [Pa] during slip, with the sign of the slip velocity; dissipates traction * v >= 0.

    A law that jumps at v = 0 reads ``direction``, the sign of v, and states as ``limit`` the traction it bears at rest.
    In the plane ``direction`` and ``direction_2`` are the components of the unit vector of slip, and a law without
    ``transverse`` acts along it, with its traction at the slip speed.
    """

    contract = "friction"
    formula = "traction"
    breaks_bonds: ClassVar[bool] = False
    """True if bonds break as slip begins."""
    internal: ClassVar[Mapping[str, str]] = {}
    """Internal variables that the law evolves, as logarithms, and the variable of each logarithm."""

    traction: ClassVar[Callable[..., Expression]]
    limit: ClassVar[Callable[..., Expression]]
    """Friction limit [Pa] of sticking; absent if a law does not stick."""
    fast: ClassVar[Callable[..., Expression] | None] = None
    """Dry traction [Pa] to which that at rest falls, or rises, as sliding grows faster; None if it stays."""
    rest_exponent: ClassVar[str] = ""
    """Parameter that is the power of the velocity with which the traction leaves that at rest: below 1 its slope there
    is infinite. Empty if there is none."""
    drive: ClassVar[Callable[..., Expression]]
    """Measure of the traction at a velocity, an unknown that may replace the velocity; absent if not needed."""
    velocity: ClassVar[Callable[..., Expression] | None] = None
    """Inverse of :attr:`drive` [m/s]."""
    driven: ClassVar[Callable[..., Expression]]
    """Traction at a value of :attr:`drive` [Pa]."""
    reference_velocity: ClassVar[str] = ""
    """Parameter [m/s] relative to which creep is slow, of a law with :attr:`velocity`."""
    transverse: ClassVar[Callable[..., Expression] | None] = None
    """Traction across v, along the interface [Pa]; None for an isotropic law."""
    transverse_limit: ClassVar[Callable[..., Expression]]
    """Limit of sticking across v alone [Pa], a half axis of an ellipse; absent without ``transverse``."""
    evolution: ClassVar[Callable[..., Mapping[str, Expression]]]
    """Rates of the internal variables [1/s]; absent if there are none."""

    @property
    def has_limit(self) -> bool:
        """True if the interface can stick by this law."""
        return hasattr(self, "limit")


class RateType(NamedTuple):
    """A rate type of mechanisms by which a law modifies an Arrhenius coefficient."""

    name: str
    """Name in a mechanism."""
    method: str
    """Method of the law: the logarithm of a factor of the coefficient, or a method that REACTIONS in
    :mod:`surfacechem.mechanism.rates` requires."""
    constants: Mapping[str, float] = {}
    """Rate constants of the law: one for the constant that the Arrhenius coefficient replaces, zero for its reverse."""
    names: tuple[str, ...] = ()
    """Parameters of the law that a reaction has by the same names, with the same defaults."""
    renamed: Mapping[str, str] = {}
    """Parameters that every reaction gives under other names, each with its name in the law."""
    ratios: Mapping[str, str] = {}
    """Rate constants, as ratios to the Arrhenius coefficient, by their names in a reaction, with those in the law."""
    distance: str = ""
    """Parameter of the law whose work against the force per bond is the whole factor, if that is so."""


class RateLaw(Law):
    """Net rate [1/(m^2 s)] of a reaction per unit current area; dissipates -mu * rate >= 0."""

    contract = "bonding"
    formula = "rate"

    keeps_range: ClassVar[bool] = False
    """True if its form keeps phi between zero and one, or below phi_max if it reads the partners n_1 and n_2. Any other
    law is constrained at the bounds."""
    rate_types: ClassVar[tuple[RateType, ...]] = ()
    """Rate types of mechanisms that the law provides."""
    rate: ClassVar[Callable[..., Expression]]
    envelope: ClassVar[Callable[..., Expression] | None] = None
    """Largest fraction of bonds at an opening, for a law by which bonds break gradually."""

    def stoichiometry(self) -> Mapping[str, int | float]:
        """Return the change of each bonding variable, in its amounts, per unit of reaction."""
        return {"phi": 1}

    @property
    def log_rate(self) -> Callable[..., Expression] | None:
        """Logarithm of the rate of a one-way law; None if the rate vanishes with the affinity.

        A one-way law and its reverse are compared with the equilibrium of the potential.
        """
        return None

    @property
    def one_way(self) -> bool:
        """True if the law is one-way."""
        # A rate that vanishes with the affinity has no logarithm.
        return self.log_rate is not None

    def turnover(self) -> Mapping[str, int | float]:
        """Return the change of all species, including ones that are no bonding variables, to find reverse laws."""
        return self.stoichiometry()

    @property
    def distance(self) -> Expression | None:
        """Distance to the transition state [m] along the force per bond, if the force has no other effect."""
        return None

    @property
    def balanced(self) -> bool:
        """True if the reverse rate follows from the affinity, with which the net rate vanishes."""
        return "mu" in reads(self.statement)

    @property
    def length(self) -> Expression | None:
        """Displacement of the load as the law forms a bond [m]; None if the law is one-way or does not state it."""
        return None

    @property
    def taken(self) -> tuple[Callable[..., Expression], Callable[..., Expression]] | None:
        """Enthalpy and Gibbs energy [J] that one reaction takes from neighbouring phases; None if nothing.

        The first is an energy supply, the second is part of the affinity.
        """
        return None

    @property
    def made(self) -> Mapping[str, float]:
        """Molecules that one reaction produces in neighbouring phases, by species."""
        return {}

    @property
    def log_ratio(self) -> Callable[..., Expression] | None:
        """Logarithm of the ratio of forward to backward rate, if the law states both rates; else None.

        It is compared with the equilibrium of the potential.
        """
        return None


class HeatTransfer(Law):
    """Conductance [W/(m^2 K)] between two temperatures; heat flows from hot to cold.

    A formula that reads ``T_from`` and ``T_to`` gets the temperatures of the two ends.
    """

    contract = "heat"
    formula = "conductance"
    channel: ClassVar[str] = "conduction"
    """Kind of heat transfer, for the names of fluxes."""

    between: tuple[str, str] = option("the two ends: body names, 'interface' or 'surroundings'")
    closure: Literal["direct", "medium", "mean"] = option(
        "'direct' from end to end, 'medium' through the interface with twice the conductance on each side (through a "
        "film as heat made across it leaves it), or 'mean' from the interface into both bodies alike, driven by T_c "
        "over the harmonic mean of their temperatures: it may heat the hotter body from a cooler interface",
        default="direct",
    )
    conductance: ClassVar[Callable[..., Expression]]
    resistances: ClassVar[Callable[..., tuple[Expression, Expression, Expression]] | None] = None
    """Resistances of the first wall, the film and the second wall [m^2 K/W]; None if heat is not produced across a
    film."""

    def channels(self) -> Mapping[str, Callable[..., Expression]]:
        """Return the parallel conductances whose sum is the total, by channel of heat transfer."""
        return {self.channel: self.statement}


class Limit(Law):
    """Traction [Pa] at which the interface gives way at once.

    The jump conserves energy. If it would destroy entropy the run follows ``violation``: refuse, warn or accept.
    ``release`` states what takes part: 'joint' lets the bodies relax within the jump; 'local' keeps the gap in the jump
    and lets the interface alone pay, before a gap without inertia follows. Bonds of a mechanism break into the products
    of the first reaction that breaks them.
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
    """Names and units of fields whose values change from one load segment to the next."""
    cycle: ClassVar[str] = ""
    """Field that is the frequency of a periodic history."""

    @abstractmethod
    def value(self, t: Expression) -> Expression:
        """Value at time t [s]."""

    def breakpoints(self) -> tuple[float, ...]:
        """Return the times [s] at which the history or its slope jumps."""
        return ()

    def jumps(self) -> tuple[float, ...]:
        """Return the times [s] at which the value jumps."""
        return ()

    def piece(self, start: float) -> Mapping[str, float]:
        """Return the values of the local fields on the load segment that begins at time ``start`` [s]."""
        return {}

    def at_start(self) -> float:
        """Value at t = 0."""
        return float(self.bind(self.piece(0.0)).value(0.0))


class Property(Law):
    """Property of the medium between the bodies, as a function of temperature and pressure."""

    contract = "property"
    formula = "value"
    quantity: ClassVar[str]
    """Name of the property in the table of quantities."""

    value: ClassVar[Callable[..., Expression]]


class FilmGrowth(Law):
    """Rate of the thickness of the film between the bodies [m/s], positive for growth."""

    contract = "growth"
    formula = "rate"

    rate: ClassVar[Callable[..., Expression]]


class Shape(Law):
    """Surface of a body as a function of two parameters [m].

    Its highest point is the origin and the body lies below it; a second body is its mirror image above. The normal
    x_u x x_v points out of the body. It is turned about z first, then tilted about y.
    """

    contract = "shape"
    formula = "point"
    about_axis: ClassVar[bool] = False
    """True if v is the angle about z of a surface of revolution."""
    closed: ClassVar[tuple[bool, bool]] = (False, False)
    """True, for u and for v, if the surface is periodic in the parameter."""

    radii: ClassVar[Sequence[str]] = ("R",)
    """Parameters that are lengths of the whole shape."""
    rises: ClassVar[int] = 0
    """Power of the distance from the axis with which the surface falls away at large distance."""
    grain: ClassVar[float] = math.inf
    """Length below which it is smooth [m]: a cell of measured heights, a fraction of a wavelength."""

    turn: float = parameter("rad", "angle by which it is turned about z", default=0.0, varies=False)
    tilt: float = parameter("rad", "angle by which it is tilted about y", default=0.0, varies=False)

    point: ClassVar[Callable[..., tuple[Expression, Expression, Expression]]]

    @property
    @abstractmethod
    def span(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Bounds of u and of v."""

    foot: ClassVar[Callable[..., Any] | None] = None
    """Parameters (..., 2) of the nearest point to each of the points (..., 3), if there is a closed form; one beyond
    the bounds is moved to the edge."""
    starts: ClassVar[Callable[..., tuple[Any, Any]]]
    """Without a closed form, starts of searches for the nearest point: indices (m,) of the points (n, 3), in order and
    one or more for each, and the parameters (m, 2) at which the searches begin."""
    derivatives: ClassVar[Callable[..., Any] | None] = None
    """Derivatives (count, ..., 3) that are no formulas, in the order 1, u, v, uu, uv, vv, uuu, uuv, uvv, vvv."""


class PairEnergy(Law):
    """Energy [J] of two points of two surfaces at the distance r, per product of their numbers."""

    contract = "pair"
    formula = "energy"
    cutoff: ClassVar[float] = math.inf
    """Distance beyond which the energy is zero [m]."""
    decay: ClassVar[float] = 4.0
    """Least power with which the energy falls at large distances."""
    parts: ClassVar[Callable[..., Sequence[tuple[Expression, Any]]] | None] = None
    """Laws without parameters, for a unit of length [m], whose weighted sum is the energy; the parameters enter the
    weights. If there are none, a change of any parameter but the densities needs a new integration."""

    n_1: float = parameter("1/m^2", "density of interacting points on body 1", above=0, stretch=-1)
    n_2: float = parameter("1/m^2", "density of interacting points on body 2", above=0, stretch=-1)

    energy: ClassVar[Callable[..., Expression]]


class FluidRange(NamedTuple):
    """Temperatures [K] between which a fluid keeps its phase, with reasons for both ends."""

    low: float
    high: float
    reason_low: str
    reason_high: str


class Fluid(ABC):
    """A substance whose properties have no formula; they are fitted if a scene reads them.

    Properties have the names of the table of quantities; ``capacity_m`` is the heat capacity per volume over T,
    rho_m cp_m / T [J/(m^3 K^2)].
    """

    name: str
    pressure: float

    @abstractmethod
    def range(self, T: float) -> FluidRange:
        """Return the range of temperatures around T [K] with properties; InputError if there are none at T."""

    @abstractmethod
    def fit(self, quantity: str, low: float, high: float, target: float) -> tuple[Piece, ...]:
        """Fit a property between two temperatures [K] to a relative accuracy; InputError if there is none."""

    @property
    def remark(self) -> str:
        """Remark for the user before the properties are fitted; empty if there is none."""
        return ""
