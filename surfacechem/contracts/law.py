"""What a law is: one class whose fields are its parameters and whose method states one formula.

Name, schema, listing, documentation and generic tests are read off the class. The contracts that laws fulfil are in
:mod:`surfacechem.contracts.terms`, which also gives all of this to those who write one.
"""

from __future__ import annotations

import copy
import dataclasses
import inspect
import math
import re
from abc import ABC
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, Self, dataclass_transform

from surfacechem.contracts.units import quotient
from surfacechem.errors import InputError, Place
from surfacechem.expressions import Expression


@dataclass(frozen=True)
class Spec:
    """What a parameter is: unit ("[x]" stands for the unit of the loaded quantity), meaning and allowed range.

    ``stretch`` is the power of the area stretch J_c with which the formula sees what is given: -1 where that is a
    density per reference area of what stays with the material, and the formula reads one per current area.
    """

    unit: str
    text: str
    above: float = -math.inf
    at_least: float = -math.inf
    at_most: float = math.inf
    varies: bool = True
    stretch: int = 0

    def resolved(self, x: str) -> Spec:
        """The specification with the unit that "[x]" stands for."""
        return dataclasses.replace(self, unit=resolved_unit(self.unit, x))

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


def resolved_unit(unit: str, x: str) -> str:
    """A unit with "[x]" replaced.

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
    """A numeric parameter of a law, in SI units; ``varies`` lets a case make it depend on a variable by factors.

    ``stretch`` is the power of the area stretch that multiplies it, see :class:`Spec`.
    With the default None the formula says what stands for what is not given.
    """
    spec = Spec(unit, text, above, at_least, at_most, varies, stretch)
    return field(default=default, metadata={"spec": spec})


def option(text: str, *, default: Any = dataclasses.MISSING) -> Any:
    """A structural field of a law: a name or a list, not a number that a sweep may change."""
    return field(default=default, metadata={"option": text})


@dataclass_transform(kw_only_default=True, frozen_default=True, field_specifiers=(parameter, option))
@dataclass(frozen=True, kw_only=True, eq=False)
class Law(ABC):
    """A named law with parameters as fields. Subclasses become frozen, keyword-only dataclasses."""

    contract: ClassVar[str] = "law"
    formula: ClassVar[str] = ""
    """Name of the method that states the law."""
    positive: ClassVar[tuple[str, ...]] = ()
    """Variables that must stay above zero for the law to hold."""
    nonnegative: ClassVar[tuple[str, ...]] = ()
    """Variables that must not fall below zero, or below what :attr:`least` states."""

    place: Place | None = field(default=None, repr=False)
    """Where the law stands in its case file; None for laws built in Python."""

    def __init_subclass__(cls, **keywords: Any) -> None:
        super().__init_subclass__(**keywords)
        dataclass(frozen=True, kw_only=True, eq=False)(cls)

    def __post_init__(self) -> None:
        """Check every numeric parameter against its range."""
        for name, spec in self.specs():
            value = getattr(self, name)
            if isinstance(value, Varying):
                spec.check(name, value.value)
            elif isinstance(value, int | float):
                spec.check(name, value)

    @classmethod
    def name(cls) -> str:
        """The name of the law in a case file."""
        return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "-", cls.__name__).lower()

    @property
    def ranges(self) -> Mapping[str, tuple[float, float]]:
        """Ranges of variables outside which the law is an extrapolation; a run that leaves them says so."""
        return {}

    @property
    def limits(self) -> Mapping[str, tuple[float, float]]:
        """Ranges of variables outside which the law has no value; a run that reaches an end of them stops."""
        return {}

    @property
    def least(self) -> Mapping[str, Expression]:
        """Least values of those ``nonnegative`` variables that may fall below zero."""
        return {}

    @property
    def peaks(self) -> Mapping[str, Expression | Sequence[Expression]]:
        """Values of variables at which the formula is narrow, so that a step must not pass over them: where it peaks,
        begins, ends or bends.
        """
        return {}

    @property
    def kinks(self) -> Mapping[str, Expression]:
        """Values of variables at which the formula bends, so that a step has to end there."""
        return {}

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
        """Short name for the quantities that belong to this law."""
        return self.name().replace("-", "_")

    @property
    def title(self) -> str:
        """The law in words."""
        return self.name().replace("-", " ")

    @classmethod
    def specs(cls) -> Iterator[tuple[str, Spec]]:
        """Names and specifications of the numeric parameters."""
        for item in dataclasses.fields(cls):
            if "spec" in item.metadata:
                yield item.name, item.metadata["spec"]

    @classmethod
    def options(cls) -> Iterator[tuple[str, str]]:
        """Names and meanings of the structural fields."""
        for item in dataclasses.fields(cls):
            if "option" in item.metadata:
                yield item.name, item.metadata["option"]

    def refine(self, name: str, spec: Spec) -> Spec:
        """Specification of a parameter of this very law, where its unit depends on the other fields."""
        return spec

    def is_default(self, name: str) -> bool:
        """Whether a parameter was left at its default, so that it is a constant of the formula."""
        default = next(item.default for item in dataclasses.fields(self) if item.name == name)
        return bool(getattr(self, name) == default)

    def with_parts(self, bind: Callable[[Law, str, str], Any]) -> Self:
        """The same law with the laws that it shares with others, if any, put through ``bind``, each with the path under
        which a case finds its parameters and what is added to their names.
        """
        return self

    def given(self, numbers: Mapping[str, float]) -> Self:
        """The same law with other numbers, which are checked."""
        changed: Any = dict(numbers)
        return dataclasses.replace(self, **changed)

    def bind(self, values: Mapping[str, Expression]) -> Self:
        """The same law with some of its parameters replaced, by symbols for instance; nothing is checked."""
        bound = copy.copy(self)
        for name, value in values.items():
            object.__setattr__(bound, name, value)
        return bound


@dataclass(frozen=True)
class Varying:
    """A parameter that depends on variables: a value at the reference state times factors."""

    value: float
    factors: tuple[Factor, ...]


def reads(formula: Callable[..., Expression]) -> tuple[str, ...]:
    """The quantities a law's formula reads: the names of its arguments."""
    return tuple(inspect.signature(formula).parameters)


def optional(formula: Callable[..., Expression]) -> frozenset[str]:
    """Those of them that a scene need not have: the arguments with a default."""
    arguments = inspect.signature(formula).parameters.values()
    return frozenset(item.name for item in arguments if item.default is not inspect.Parameter.empty)


class Factor(Law):
    """How a parameter varies with one variable; multiplies the parameter's value."""

    contract = "factor"
    formula = "factor"

    keeps_sign: ClassVar[bool] = False
    """Whether the factor is positive whatever the variable is."""

    of: str = option("variable it depends on", default="T_c")

    factor: ClassVar[Callable[..., Expression]]
