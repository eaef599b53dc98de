"""Regimes of the stability matrix: a case, a parameter taken over decades until it breaks, and what is expected there.

A class in any file of this folder is a regime; finding it needs nothing else.

>>> list(regimes())[:3]
['affinity', 'bell', 'capacity']
"""

from __future__ import annotations

import pkgutil
import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cache
from importlib import import_module
from typing import Any, ClassVar, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from surfacechem.errors import InputError, suggestion
from surfacechem.references.base import Reference

Array: TypeAlias = NDArray[np.float64]

Values: TypeAlias = Mapping[str, Array | float]

R = TypeVar("R", bound=Reference)


@dataclass(frozen=True)
class Exact:
    """The run finishes with these values at its output times [s], by name; with so many events, if that is stated.

    States are compared, and named quantities that are listed; each value relative to itself.
    """

    values: Callable[[Array], Values]
    also: Sequence[str] = ()
    events: int | None = None
    data: Mapping[str, float] = field(default_factory=dict)
    again: Callable[[Mapping[str, float], Array], Values] | None = None
    """The values for other data, which tell how well the problem determines them."""

    @classmethod
    def of(cls, reference: R, read: Callable[[R, Array], Values] = Reference.solution, **more: Any) -> Exact:
        """The values of an exact solution, as they are or as ``read`` off it; its parameters are the data."""
        return cls(lambda t: read(reference, t), **_varied(reference, read), **more)


@dataclass(frozen=True)
class Stops:
    """Physics ends the run, for a reason that contains these words, at a time [s]."""

    reason: str
    t: float
    data: Mapping[str, float] = field(default_factory=dict)
    again: Callable[[Mapping[str, float]], float] | None = None
    """The time for other data, which tell how well the problem determines it."""

    @classmethod
    def of(cls, reason: str, reference: R, read: Callable[[R], float] = lambda one: one.end_time) -> Stops:
        """The end of an exact solution, or what is ``read`` off it; its parameters are the data."""
        return cls(reason, read(reference), **_varied(reference, read))


def _varied(reference: R, read: Callable[..., Any]) -> dict[str, Any]:
    """The parameters of an exact solution as data, and what is read off it for other data."""
    data = {item.name: getattr(reference, item.name) for item in fields(reference)}  # type: ignore[arg-type]
    return {"data": data, "again": lambda data, *t: read(type(reference)(**data), *t)}


@dataclass(frozen=True)
class Refused:
    """The input is refused before anything is computed, for a reason that contains these words."""

    reason: str


Expectation: TypeAlias = Exact | Stops | Refused


@dataclass(frozen=True)
class Trial:
    """A shipped case by name, or the text of one, with changes by path, and what is expected of its run."""

    case: str
    times: Sequence[float]
    """Output times [s]; the run begins at 0."""
    expected: Expectation
    changes: Mapping[str, object] = field(default_factory=dict)


class Regime(ABC):
    """One row of the stability matrix. Subclasses state what they are; the class gives its name."""

    name: ClassVar[str]
    title: ClassVar[str]
    symbol: ClassVar[str]
    """The parameter that is taken over decades, as in a heading."""
    values: ClassVar[tuple[float, ...]]
    space: ClassVar[Mapping[str, tuple[float, float]]] = {}
    """Decimal logarithms between which a search for the worst corner moves each parameter; empty where it does not."""

    def __init_subclass__(cls) -> None:
        cls.name = re.sub(r"(?<=[a-z])(?=[A-Z])", "-", cls.__name__.removesuffix("Regime")).lower()

    @abstractmethod
    def problem(self, value: float) -> Trial:
        """The case at one value, and what is expected of it."""

    def corner(self, point: Mapping[str, float]) -> Trial:
        """The case at a point of :attr:`space`, of parameters by name."""
        raise NotImplementedError(f"{self.name} has no space to search")

    def label(self, value: float) -> str:
        """A value as in a heading."""
        return f"{value:g}"


@cache
def regimes() -> dict[str, Regime]:
    """Every regime by name."""
    modules = [import_module(f"{__name__}.{module.name}") for module in pkgutil.iter_modules(__path__)]
    kinds = [kind for kind in Regime.__subclasses__() if kind.__module__ in {module.__name__ for module in modules}]
    return {kind.name: kind() for kind in sorted(kinds, key=lambda kind: kind.name)}


def chosen(names: tuple[str, ...]) -> list[Regime]:
    """The regimes of these names, or all; InputError with the nearest guess."""
    known = regimes()
    for name in names:
        if name not in known:
            raise InputError(f"no regime '{name}'.{suggestion(name, known)}")
    return [known[name] for name in names or known]
