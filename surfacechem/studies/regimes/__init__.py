"""Regimes of the stability matrix: a case, a parameter taken over decades until it breaks, and what is expected there.

A function marked `regime` in any file of this folder is one; finding it needs nothing else.

>>> list(regimes())[:3]
['affinity', 'bell', 'capacity']
"""

from __future__ import annotations

import pkgutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any, TypeAlias, TypeVar

from surfacechem.errors import refuse_unknown
from surfacechem.references.base import Reference
from surfacechem.solve.contract import Array

Values: TypeAlias = Mapping[str, Array | float]

R = TypeVar("R", bound=Reference)

# Cases that show nothing but where solvers fail stand beside their regimes.
FOLDER = Path(__file__).parent


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
    """A case, by the name of a shipped one or by its file, with changes by path, and what is expected of its run."""

    case: str
    times: Sequence[float]
    """Output times [s]; the run begins at 0."""
    expected: Expectation
    changes: Mapping[str, object] = field(default_factory=dict)


@dataclass(frozen=True)
class Regime:
    """One row of the stability matrix: a parameter that is taken over decades, and the problem at each value."""

    name: str
    title: str
    symbol: str
    """The parameter, as in a heading."""
    values: Sequence[float]
    problem: Callable[[float], Trial]
    label: Callable[[float], str]
    """A value as in a heading."""
    corner: Callable[..., Trial]
    """The problem at a point of the space, of parameters by name."""
    space: Mapping[str, tuple[float, float]]
    """Decimal logarithms between which a search for the worst corner moves each parameter; empty where it does not."""


def regime(
    title: str,
    symbol: str,
    values: Sequence[float],
    corner: Callable[..., Trial] | None = None,
    label: Callable[[float], str] = "{:g}".format,
    **space: tuple[float, float],
) -> Callable[[Callable[..., Trial]], Regime]:
    """Makes a regime of a problem as a function of the parameter, which gives the name; ``corner`` where it differs."""

    def made(problem: Callable[..., Trial]) -> Regime:
        name = problem.__name__.replace("_", "-")
        return Regime(name, title, symbol, values, problem, label, corner or problem, space)

    return made


@cache
def regimes() -> dict[str, Regime]:
    """Every regime by name."""
    modules = [import_module(f"{__name__}.{module.name}") for module in pkgutil.iter_modules(__path__)]
    found = [item for module in modules for item in vars(module).values() if isinstance(item, Regime)]
    return {item.name: item for item in sorted(found, key=lambda item: item.name)}


def chosen(names: Sequence[str]) -> list[Regime]:
    """The regimes of these names, or all; InputError with the nearest guess."""
    known = regimes()
    refuse_unknown(names, known, "no regime '{}'")
    return [known[name] for name in names or known]
