"""Regimes of the stability matrix: a case, a parameter that varies until the problem breaks, and the expected result.

A function marked `regime` in any file of this folder is a regime and is found without registration.

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

# Cases that serve only to show failures of solvers are in the folder of their regimes.
FOLDER = Path(__file__).parent


@dataclass(frozen=True)
class Exact:
    """Expectation that the run finishes with these values at its output times [s], by name, and with so many events.

    States are compared, and the named quantities in ``also``; errors are relative to each value.
    """

    values: Callable[[Array], Values]
    also: Sequence[str] = ()
    events: int | None = None
    data: Mapping[str, float] = field(default_factory=dict)
    again: Callable[[Mapping[str, float], Array], Values] | None = None
    """Function for the values with other data, from which the condition number of the problem follows."""

    @classmethod
    def of(cls, reference: R, read: Callable[[R, Array], Values] = Reference.solution, **more: Any) -> Exact:
        """Return the values of an exact solution, or those that ``read`` takes from it; its parameters are the data."""
        return cls(lambda t: read(reference, t), **_varied(reference, read), **more)


@dataclass(frozen=True)
class Stops:
    """Expectation that physics ends the run, for a reason that contains these words, at a time [s]."""

    reason: str
    t: float
    data: Mapping[str, float] = field(default_factory=dict)
    again: Callable[[Mapping[str, float]], float] | None = None
    """Function for the time with other data, from which the condition number of the problem follows."""

    @classmethod
    def of(cls, reason: str, reference: R, read: Callable[[R], float] = lambda one: one.end_time) -> Stops:
        """Return the end of an exact solution, or the time that ``read`` takes from it; its parameters are the data."""
        return cls(reason, read(reference), **_varied(reference, read))


def _varied(reference: R, read: Callable[..., Any]) -> dict[str, Any]:
    """Return the parameters of an exact solution as data, and a function for its values with other data."""
    data = {item.name: getattr(reference, item.name) for item in fields(reference)}  # type: ignore[arg-type]
    return {"data": data, "again": lambda data, *t: read(type(reference)(**data), *t)}


@dataclass(frozen=True)
class Refused:
    """Expectation that the input is refused before anything is computed, for a reason that contains these words."""

    reason: str


Expectation: TypeAlias = Exact | Stops | Refused


@dataclass(frozen=True)
class Trial:
    """A case, by its name if shipped or by its file, with changes by path, and the expected result of its run."""

    case: str
    times: Sequence[float]
    """Output times [s]; the run begins at 0."""
    expected: Expectation
    changes: Mapping[str, object] = field(default_factory=dict)


@dataclass(frozen=True)
class Regime:
    """A row of the stability matrix: a parameter that varies over decades, and the problem at each value."""

    name: str
    title: str
    symbol: str
    """Symbol of the parameter in headings."""
    values: Sequence[float]
    problem: Callable[[float], Trial]
    label: Callable[[float], str]
    """Text of a value in headings."""
    corner: Callable[..., Trial]
    """The problem at a point of the space, given by parameters by name."""
    space: Mapping[str, tuple[float, float]]
    """Bounds of the decimal logarithm of each parameter in the search for the worst corner; empty without a search."""


def regime(
    title: str,
    symbol: str,
    values: Sequence[float],
    corner: Callable[..., Trial] | None = None,
    label: Callable[[float], str] = "{:g}".format,
    **space: tuple[float, float],
) -> Callable[[Callable[..., Trial]], Regime]:
    """Make a regime of a problem, a function of the parameter whose name it takes; ``corner`` is the problem of the
    search, if it differs.
    """

    def made(problem: Callable[..., Trial]) -> Regime:
        name = problem.__name__.replace("_", "-")
        return Regime(name, title, symbol, values, problem, label, corner or problem, space)

    return made


@cache
def regimes() -> dict[str, Regime]:
    """Return every regime by name."""
    modules = [import_module(f"{__name__}.{module.name}") for module in pkgutil.iter_modules(__path__)]
    found = [item for module in modules for item in vars(module).values() if isinstance(item, Regime)]
    return {item.name: item for item in sorted(found, key=lambda item: item.name)}


def chosen(names: Sequence[str]) -> list[Regime]:
    """Return the regimes of these names, or all; InputError with the nearest guess."""
    known = regimes()
    refuse_unknown(names, known, "no regime '{}'")
    return [known[name] for name in names or known]
